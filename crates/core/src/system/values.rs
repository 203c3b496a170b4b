//! Operations that a field offers to models: values of numbers and functions, and random points.

use obsdeg_exact::{Scalars, SplitMix64};

use super::dag::Dag;
use super::work::{Refused, Work};
use crate::language::Function;

/// Reasons why no point was found at which constraints hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ConstraintFailure {
    /// This constraint could not be solved.
    Constraint(usize),
    /// Only points with dependent gradients of the constraints were found; this constraint is among them.
    Dependent(usize),
    /// The work exceeds its limit.
    Refused,
}

impl ConstraintFailure {
    /// The reason with the index of its constraint replaced by `place`.
    pub(super) fn of(self, place: impl FnOnce(usize) -> usize) -> Self {
        match self {
            Self::Constraint(c) => Self::Constraint(place(c)),
            Self::Dependent(c) => Self::Dependent(place(c)),
            Self::Refused => Self::Refused,
        }
    }
}

impl From<Refused> for ConstraintFailure {
    fn from(_: Refused) -> Self {
        Self::Refused
    }
}

/// Index of a series, and the factor of it with its key.
pub(crate) type KeyedFactor<'a, E> = (usize, usize, &'a [E]);

/// Field in which a model has values.
pub(crate) trait Values: Scalars {
    /// Number of points tried before an undefined expression counts as undefined everywhere.
    const ATTEMPTS: usize;
    /// Bits of a number; in real numbers zero is distinguished by a gap.
    const BITS: i64;
    /// Largest number of coefficients of a polynomial direction that is sought.
    const COEFFICIENTS: usize;

    /// Precomputed data for products of series.
    type SeriesPlan: Clone + std::fmt::Debug;

    /// Plan for series of this length.
    fn plan(&self, length: usize) -> Self::SeriesPlan;
    /// For each list of `(index, key, factor)` the first `n` coefficients of the sum of the products of
    /// `of[index]` and the factor, which the plan knows by its key; `None` if there is none of these.
    fn sums<'a>(
        &self,
        plan: &mut Self::SeriesPlan,
        of: &[Option<&'a [Self::Element]>],
        lists: &[Vec<KeyedFactor<'a, Self::Element>>],
        n: usize,
    ) -> Vec<Option<Vec<Self::Element>>>;
    /// Decimal `mantissa / 10^decimals`.
    fn number(&self, mantissa: i128, decimals: i32) -> Self::Element;
    /// Number pi.
    fn pi(&self) -> Self::Element;
    /// True value of a function; `None` if it is not defined.
    fn function(&self, function: Function, x: &Self::Element) -> Option<Self::Element>;
    /// True for a positive number, false for a negative one; `None` if it is zero or has no sign.
    fn is_positive(&self, x: &Self::Element) -> Option<bool>;
    /// Random value of a generic quantity at the given attempt to find a point.
    fn random(&self, rng: &mut SplitMix64, attempt: usize) -> Self::Element;
    /// Random number that shares `bits` bits with a given one (near 0: below one by as many); `None` if
    /// numbers have no distance.
    fn near(&self, x: f64, bits: i64, rng: &mut SplitMix64) -> Option<Self::Element>;
    /// Random Taylor coefficient of a generic signal.
    fn coefficient(&self, rng: &mut SplitMix64) -> Self::Element;
    /// Changes the values of `free` slots so that the nodes `constraints` (rational, of slots alone) are
    /// zero.
    ///
    /// # Errors
    /// Constraint that could not be solved, or an exceeded limit of work.
    fn hold(
        &self,
        dag: &Dag,
        constraints: &[usize],
        values: &mut [Self::Element],
        free: &[bool],
        rng: &mut SplitMix64,
        work: &Work,
    ) -> Result<(), ConstraintFailure>;
}
