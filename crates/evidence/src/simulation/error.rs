//! Errors of a simulation.

use obsdeg_core::model::{Carry, SchemeError};
use obsdeg_ekf::EkfError;

use super::limits::MAX_UNKNOWNS;
use crate::prediction::PredictionError;

/// Reason why a scheme cannot be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// A generic angle has no number.
    #[error("the angle `{name}` is generic; expected numbers for a simulation")]
    GenericAngle {
        /// Name of the angle.
        name: String,
    },
    /// Slews of finite duration carry psi^n: another carry is impossible.
    #[error(
        "slews of finite duration carry psi in geographic axes; found {carry} carry, expected inertial (or \
         no slew rate)"
    )]
    SlewCarry {
        /// Carry that was found.
        carry: Carry,
    },
    /// The turn of a slew does not lead to its position.
    #[error(
        "the slew to `{name}` does not lead there: expected an axis and angle that turn the position before into it"
    )]
    SlewMisses {
        /// Name of the position.
        name: String,
    },
    /// A path gimbal by gimbal begins at Euler angles, which a rotation has left.
    #[error(
        "`{name}` follows a rotating segment, which leaves the Euler angles that path = \"gimbals\" starts \
         from: expected a slew of the position, or path = \"one-axis\""
    )]
    GimbalsAfterRotation {
        /// Name of the position.
        name: String,
    },
    /// A platform that is not at rest before the end of a position.
    #[error(
        "a wait of {settle_s} s for rest leaves no sample of the dwell of {place} ({dwell_s} s); expected a \
         longer dwell or a shorter wait (settle under [record])"
    )]
    Settle {
        /// Time at the start of the position whose samples are left out, in s.
        settle_s: f64,
        /// Position, in words.
        place: String,
        /// Dwell of the position, in s.
        dwell_s: f64,
    },
    /// A filter that does not know a position does not know a slew to it.
    #[error("a dropped position goes with instantaneous repositioning; found a slew rate")]
    DroppedSlew,
    /// The only position cannot be dropped.
    #[error("the only position cannot be dropped; expected a scheme of at least two positions")]
    DroppedOnly,
    /// The caller stopped the work.
    #[error("interrupted before the runs were done")]
    Interrupted,
    /// Accuracy orders of a rotation are not computed.
    #[error("the cross-check takes positions; found a rotating segment")]
    CrosscheckRotation,
    /// The exact truth needs coefficients, not the drift itself.
    #[error("exact truth needs coefficients; found the unknowns `drift` (use terms such as F,I,O,S)")]
    ExactDrift,
    /// A truth of small angles is no motion of a platform.
    #[error(
        "the {filter} filter has full attitudes, and a linear truth is the small-angle model itself, which \
         no platform follows: expected \
         truth = \"exact\" (or none stated) with this filter, or filter = \"linear\""
    )]
    LinearTruth {
        /// Name of the filter.
        filter: &'static str,
    },
    /// A filter with another carry or without a position must be linear.
    #[error(
        "a filter that is wrong on purpose (another carry, a position left out) is the linear one; found the \
         {filter} filter"
    )]
    WrongOnPurpose {
        /// Name of the filter.
        filter: &'static str,
    },
    /// Full attitudes have no instantaneous turns.
    #[error(
        "full attitudes with unknown torquer errors (GS, GM, GM3) need turns that take time; expected a slew \
         rate (slew_rate_deg_s, --slew-rate), \
         or filter = \"linear\" and truth = \"linear\""
    )]
    TorquedAtOnce,
    /// Too many unknowns for a full covariance.
    #[error("{found} unknowns; expected at most {} for a simulation", MAX_UNKNOWNS)]
    TooManyUnknowns {
        /// Number of unknowns.
        found: usize,
    },
    /// Too many unknowns under another carry of a comparison.
    #[error("{found} unknowns under reset carry, which is compared too; expected at most {}", MAX_UNKNOWNS)]
    ComparedUnknowns {
        /// Number of unknowns.
        found: usize,
    },
    /// Too many steps.
    #[error("{found} {what}; expected at most {most} (take longer steps)")]
    TooManySteps {
        /// Number found.
        found: String,
        /// Name of the counted quantity.
        what: &'static str,
        /// Largest number allowed.
        most: usize,
    },
    /// Numbers within their ranges that doubles do not resolve.
    #[error("not resolvable in double precision: {what}")]
    Unresolvable {
        /// Quantity that cannot be resolved.
        what: String,
    },
    /// Covariance known beforehand that does not fit the scheme.
    #[error(
        "the covariance of the calibration beforehand: {why}; expected that of an answer of obsdeg calibrate \
         on coefficients of the scheme"
    )]
    KnownCovariance {
        /// Reason, as the end of a sentence.
        why: String,
    },
    /// A condition beyond its range.
    #[error(transparent)]
    Range(#[from] obsdeg_core::model::ranges::RangeError),
    /// A value for an unknown that the scheme does not have.
    #[error("{what} for `{found}`: no such unknown; {known}")]
    UnknownName {
        /// Name of the list of assignments.
        what: &'static str,
        /// Name that was found.
        found: String,
        /// Names that were expected.
        known: String,
    },
    /// A size for an error that no scheme has.
    #[error(transparent)]
    Bench(#[from] crate::simulation::omitted::bench::BenchError),
    /// Error of the scheme itself.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// Exact verdicts are not available.
    #[error(transparent)]
    Prediction(#[from] PredictionError),
    /// The filter refuses a number.
    #[error(transparent)]
    Filter(#[from] EkfError),
}

impl SimulationError {
    /// True if numbers within their ranges go beyond what doubles resolve.
    pub fn is_numeric(&self) -> bool {
        match self {
            Self::Unresolvable { .. } => true,
            Self::Filter(e) => e.is_numeric(),
            _ => false,
        }
    }
}
