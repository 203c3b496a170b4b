//! Admitted numbers: generous physical ranges, the same for files, options and the library. Within them
//! squares and products stay far from the limits of a double.

use std::fmt;

/// Interval of admitted numbers, ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Smallest admitted number.
    pub low: f64,
    /// Largest admitted number.
    pub high: f64,
    /// Unit of both ends; empty if it depends on the unknown.
    pub unit: &'static str,
}

const fn range(low: f64, high: f64, unit: &'static str) -> Range {
    Range { low, high, unit }
}

/// Sampling step.
pub const STEP_S: Range = range(1e-6, 1e6, "s");
/// Dwell of a position.
pub const DWELL_S: Range = range(1e-3, 1e6, "s");
/// Time at the start of a position whose samples are left out.
pub const SETTLE_S: Range = range(0.0, 1e6, "s");
/// Largest turn from one position to the next.
pub const TURN_DEG: Range = range(1e-3, 180.0, "degrees");
/// Rate of slews.
pub const SLEW_RATE_DEG_S: Range = range(1e-3, 1e4, "deg/s");
/// White noise of the observation.
pub const NOISE_G: Range = range(1e-15, 1e3, "g");
/// Bias instability of the accelerometers.
pub const INSTABILITY_UG: Range = range(1e-9, 1e9, "ug");
/// Noise of a measured azimuth.
pub const AZIMUTH_NOISE_DEG: Range = range(1e-12, 1e3, "deg");
/// Random drift other than zero, in deg/h or deg/sqrt(h).
pub const DRIFT_NOISE: Range = range(1e-12, 1e6, "");
/// Noise of a gyro other than zero, in deg/sqrt(h), deg/h/sqrt(h) or deg/h.
pub(crate) const GYRO_NOISE: Range = range(1e-12, 1e6, "");
/// Correlation time of a bias instability.
pub const CORRELATION_S: Range = range(1.0, 1e9, "s");
/// Factor on the true drifts and their priors.
pub const DRIFT_SCALE: Range = range(1e-6, 1e6, "");
/// Prior standard deviation.
pub const PRIOR: Range = range(1e-9, 1e9, "");
/// True value, or initial estimate.
pub const VALUE: Range = range(-1e6, 1e6, "");
/// Size (one sigma) of an error that is not estimated, in the unit of the error.
pub const BENCH: Range = range(0.0, 1e9, "");
/// Random walk of a coefficient between calibrations, in the unit of the coefficient per sqrt(day).
pub(crate) const AGEING: Range = range(0.0, 1e9, "");
/// Required standard deviation.
pub const REQUIREMENT: Range = range(1e-12, 1e9, "");

impl Range {
    /// True if the range contains `x`; false for NaN.
    pub fn admits(&self, x: f64) -> bool {
        (self.low..=self.high).contains(&x)
    }
}

/// Shortest text of a number, with a power of ten for very small and large numbers.
struct ShortNumber(f64);

impl fmt::Display for ShortNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            x if x == 0.0 || (1e-3..1e5).contains(&x.abs()) => write!(f, "{x}"),
            x => write!(f, "{x:e}"),
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {}", ShortNumber(self.low), ShortNumber(self.high))?;
        if self.unit.is_empty() { Ok(()) } else { write!(f, " {}", self.unit) }
    }
}

/// Error for a number beyond its range.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what} is {found}; expected {expected}")]
pub struct RangeError {
    /// Name of the quantity.
    pub what: String,
    /// Number found.
    pub found: String,
    /// Admitted range.
    pub expected: String,
}

impl Range {
    /// Refuses a number that the range does not contain.
    ///
    /// # Errors
    /// [`RangeError`] that names `what`.
    pub fn check(&self, what: impl Into<String>, x: f64) -> Result<(), RangeError> {
        if self.admits(x) {
            return Ok(());
        }
        Err(RangeError { what: what.into(), found: ShortNumber(x).to_string(), expected: self.to_string() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_hold_their_ends_and_say_so() {
        for r in [STEP_S, DWELL_S, NOISE_G, PRIOR, VALUE] {
            assert!(r.admits(r.low) && r.admits(r.high) && r.admits(1.0));
            assert!(!r.admits(r.low * (1.0 - 1e-9 * r.low.signum())) && !r.admits(r.high * (1.0 + 1e-9)));
            assert!(!r.admits(f64::NAN) && !r.admits(f64::INFINITY));
        }
        let said = |x: f64| STEP_S.check("step_s", x).map_err(|e| e.to_string());
        assert_eq!(said(10.0), Ok(()));
        assert_eq!(said(-5.0), Err("step_s is -5; expected 1e-6 to 1e6 s".into()));
        assert_eq!(said(f64::NAN), Err("step_s is NaN; expected 1e-6 to 1e6 s".into()));
        assert_eq!(NOISE_G.to_string(), "1e-15 to 1000 g");
    }
}
