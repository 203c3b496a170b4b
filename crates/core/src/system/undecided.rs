//! Reasons why a number of solutions is not decided, and the limits that do not depend on the work.

use obsdeg_exact::groebner::OverLimit;

/// Largest number of solutions that are counted.
pub(super) const SOLUTIONS: usize = 64;
/// Largest number of unknowns: larger models are far beyond any limit of work, and their rows take memory.
pub(super) const UNKNOWNS: usize = 60;
/// Largest number of terms of a polynomial that is formed.
pub(super) const LONGEST: usize = 400;

/// Work of relations, in millions of products, that decides most published systems.
pub(super) const ENOUGH: u64 = 6000;

/// Reason why the number of solutions is not decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum NotCounted {
    /// An equation contains a function.
    #[error("solutions are counted for models without functions only")]
    NotRational,
    /// The verdicts were decided in real numbers.
    #[error(
        "solutions are counted in prime fields, and the verdicts were decided in real numbers (constraints \
         that follow from each other, or hold in no prime field)"
    )]
    InDigits,
    /// The model has too many unknowns.
    #[error("there are more than {UNKNOWNS} unknowns")]
    TooLarge,
    /// An equation is too long.
    #[error("an equation has more than {LONGEST} terms")]
    TooLong,
    /// The elimination exceeds its limits of work.
    #[error(
        "the elimination takes more products of coefficients than --count-limit and --relation-limit allow; a \
         larger one may decide"
    )]
    OverLimit,
    /// The elimination exceeds its limits of work, and relations were sought with little work.
    #[error(
        "the elimination takes more products of coefficients than its limits allow; --relation-limit \
         {ENOUGH}, which takes up to half a minute, may decide"
    )]
    InLittleWork,
    /// The elimination needs a power that it does not form.
    #[error("the elimination would form powers above 255, whatever --count-limit")]
    TooHigh,
    /// There are more solutions than are counted.
    #[error("there are more than {SOLUTIONS}")]
    TooMany,
    /// The start or an input is special.
    #[error(
        "starts, inputs, segments or constraints are not generic: there are several with the derivatives \
         looked at, and those of a higher order may leave fewer"
    )]
    NotClosed(usize),
    /// The numbers at two points differ.
    #[error("two random points disagree")]
    Disagree,
    /// A function contains a known input or start.
    #[error(
        "values are counted of functions of unknowns and known constants, without known inputs and starts"
    )]
    KnownSignal,
    /// No point was found.
    #[error("no random point could be used")]
    NoPoint,
}

impl From<OverLimit> for NotCounted {
    fn from(_: OverLimit) -> Self {
        Self::OverLimit
    }
}
