//! Evaluation of a model's numbers and functions in a field, and random points there: what a field offers.

use obsdeg_exact::{Scalars, SplitMix64};

use super::dag::Dag;
use super::work::{Refused, Work};
use crate::language::Function;

/// Why no point was found at which constraints hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NotHeld {
    /// This constraint could not be solved.
    Constraint(usize),
    /// Only points were found at which the gradients of the constraints depend on each other, this one among
    /// them.
    Dependent(usize),
    /// The work is beyond its limit.
    Refused,
}

impl NotHeld {
    /// The same, with the constraint that `place` names for its own.
    pub(super) fn of(self, place: impl FnOnce(usize) -> usize) -> Self {
        match self {
            Self::Constraint(c) => Self::Constraint(place(c)),
            Self::Dependent(c) => Self::Dependent(place(c)),
            Self::Refused => Self::Refused,
        }
    }
}

impl From<Refused> for NotHeld {
    fn from(_: Refused) -> Self {
        Self::Refused
    }
}

/// A field in which a model has values.
pub(crate) trait Values: Scalars {
    /// How many points are tried before what is not defined there is taken to be so everywhere.
    const ATTEMPTS: usize;
    /// Bits of a number, where what is zero is told by a gap.
    const BITS: i64;
    /// Most coefficients of a direction that is sought among polynomials.
    const COEFFICIENTS: usize;

    /// What products of series need.
    type Plan: Clone + std::fmt::Debug;

    /// For series of this length.
    fn plan(&self, length: usize) -> Self::Plan;
    /// The first `n` coefficients of the product of a series with each of several, which are known to the
    /// plan by their keys.
    fn products(
        &self,
        plan: &mut Self::Plan,
        a: &[Self::Element],
        factors: &[(usize, &[Self::Element])],
        n: usize,
    ) -> Vec<Vec<Self::Element>>;
    /// `mantissa / 10^decimals`.
    fn number(&self, mantissa: i128, decimals: i32) -> Self::Element;
    /// The half turn.
    fn pi(&self) -> Self::Element;
    /// The true value of a function; `None` where it is not defined.
    fn function(&self, function: Function, x: &Self::Element) -> Option<Self::Element>;
    /// True if a number is positive, false if it is negative; `None` where it is zero or has no sign.
    fn is_positive(&self, x: &Self::Element) -> Option<bool>;
    /// A random value of something generic at the given attempt to find a point.
    fn random(&self, rng: &mut SplitMix64, attempt: usize) -> Self::Element;
    /// A random number that shares so many bits with a given one (with 0: is below one by them); `None` where
    /// numbers have no distance.
    fn near(&self, x: f64, bits: i64, rng: &mut SplitMix64) -> Option<Self::Element>;
    /// A random Taylor coefficient of a generic signal.
    fn coefficient(&self, rng: &mut SplitMix64) -> Self::Element;
    /// Changes the values of `free` slots such that the nodes `constraints` (rational, of slots alone) are
    /// zero.
    ///
    /// # Errors
    /// The constraint that could not be solved, or that the work is beyond its limit.
    fn hold(
        &self,
        dag: &Dag,
        constraints: &[usize],
        values: &mut [Self::Element],
        free: &[bool],
        rng: &mut SplitMix64,
        work: &Work,
    ) -> Result<(), NotHeld>;
}
