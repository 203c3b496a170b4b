//! Reasons that a number of solutions is not decided, and the limits that do not depend on the work.

use obsdeg_exact::groebner::OverLimit;

/// Most solutions that are counted.
pub(super) const SOLUTIONS: usize = 64;
/// Most unknowns: what has more is far beyond any limit of work, and its rows take memory.
pub(super) const UNKNOWNS: usize = 60;
/// A polynomial of more terms is not formed.
pub(super) const LONGEST: usize = 400;

/// Reason that the number of solutions is not decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum NotCounted {
    /// A function in an equation.
    #[error("solutions are counted for models without functions only")]
    NotRational,
    /// Decided in real numbers.
    #[error(
        "solutions are counted in prime fields, and the verdicts were decided in real numbers (constraints that follow from each other, \
         or hold in no prime field)"
    )]
    InDigits,
    /// Too many unknowns.
    #[error("there are more than {UNKNOWNS} unknowns")]
    TooLarge,
    /// Too long an equation.
    #[error("an equation has more than {LONGEST} terms")]
    TooLong,
    /// Beyond the limit.
    #[error(
        "the elimination takes more products of coefficients than --count-limit allows; a larger --count-limit allows more"
    )]
    OverLimit,
    /// A power that the elimination does not form.
    #[error("the elimination would form powers above 255, whatever --count-limit")]
    TooHigh,
    /// More than counted.
    #[error("there are more than {SOLUTIONS}")]
    TooMany,
    /// The start or an input is special.
    #[error(
        "starts, inputs, segments or constraints are not generic: there are several with the derivatives looked at, and those of a higher order may leave fewer"
    )]
    NotClosed(usize),
    /// Two points disagree.
    #[error("two random points disagree")]
    Disagree,
    /// No point was found.
    #[error("no random point could be used")]
    NoPoint,
}

impl From<OverLimit> for NotCounted {
    fn from(_: OverLimit) -> Self {
        Self::OverLimit
    }
}
