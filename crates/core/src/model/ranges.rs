//! Which numbers are admitted: generous physical ranges, the same for files, options and the library. Within
//! them squares and products stay far from the ends of what a double holds.

use std::fmt;

/// An interval of admitted numbers, ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The smallest.
    pub low: f64,
    /// The largest.
    pub high: f64,
    /// The unit of both; empty when it depends on the unknown.
    pub unit: &'static str,
}

const fn range(low: f64, high: f64, unit: &'static str) -> Range {
    Range { low, high, unit }
}

/// A sampling step.
pub const STEP_S: Range = range(1e-6, 1e6, "s");
/// The dwell of a position.
pub const DWELL_S: Range = range(1e-3, 1e6, "s");
/// The rate of a slew.
/// The largest turn from one position to the next.
pub const TURN_DEG: Range = range(1e-3, 180.0, "degrees");
/// The rate of slews.
pub const SLEW_RATE_DEG_S: Range = range(1e-3, 1e4, "deg/s");
/// White noise of the observation.
pub const NOISE_G: Range = range(1e-15, 1e3, "g");
/// Bias instability of the accelerometers.
pub const INSTABILITY_UG: Range = range(1e-9, 1e9, "ug");
/// Noise of a measured azimuth.
pub const AZIMUTH_NOISE_DEG: Range = range(1e-12, 1e3, "deg");
/// Random drift that is not zero, in deg/h or deg/sqrt(h).
pub const DRIFT_NOISE: Range = range(1e-12, 1e6, "");
/// A noise of a gyro that is not zero, in deg/sqrt(h), deg/h/sqrt(h) or deg/h.
pub const GYRO_NOISE: Range = range(1e-12, 1e6, "");
/// The correlation time of a bias instability.
pub const CORRELATION_S: Range = range(1.0, 1e9, "s");
/// The factor on the true drifts and their priors.
pub const DRIFT_SCALE: Range = range(1e-6, 1e6, "");
/// A prior standard deviation.
pub const PRIOR: Range = range(1e-9, 1e9, "");
/// A true value, or an initial estimate.
pub const VALUE: Range = range(-1e6, 1e6, "");
/// A size (one sigma) of an error that is not estimated, in the unit of the error.
pub const BENCH: Range = range(0.0, 1e9, "");
/// A random walk of a coefficient between calibrations, in the unit of the coefficient per sqrt(day).
pub const AGEING: Range = range(0.0, 1e9, "");
/// A required standard deviation.
pub const REQUIREMENT: Range = range(1e-12, 1e9, "");

impl Range {
    /// True if it holds `x`; never for NaN.
    pub fn admits(&self, x: f64) -> bool {
        (self.low..=self.high).contains(&x)
    }
}

/// The shortest text of a number, with a power of ten where it is very small or large.
struct Short(f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            x if x == 0.0 || (1e-3..1e5).contains(&x.abs()) => write!(f, "{x}"),
            x => write!(f, "{x:e}"),
        }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {}", Short(self.low), Short(self.high))?;
        if self.unit.is_empty() { Ok(()) } else { write!(f, " {}", self.unit) }
    }
}

/// A number beyond its range.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what} is {found}; expected {expected}")]
pub struct RangeError {
    /// What has the number.
    pub what: String,
    /// The number found.
    pub found: String,
    /// The range.
    pub expected: String,
}

impl Range {
    /// Refuses a number that it does not hold.
    ///
    /// # Errors
    /// [`RangeError`] that names `what`.
    pub fn check(&self, what: impl Into<String>, x: f64) -> Result<(), RangeError> {
        if self.admits(x) {
            return Ok(());
        }
        Err(RangeError { what: what.into(), found: Short(x).to_string(), expected: self.to_string() })
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
