//! Options of a sheet, and the reasons why there is none.

use obsdeg_evidence::simulation::SimulationError;

/// Options of a sheet.
#[derive(Debug, Clone, PartialEq)]
pub struct ProcedureOptions {
    /// Time at rest before each recording, in s, within the dwell of the position.
    pub settle_s: f64,
    /// Tilt that is always allowed in the readings, in degrees.
    pub tilt_deg: f64,
    /// Seed of the verdicts.
    pub seed: u64,
}

impl Default for ProcedureOptions {
    fn default() -> Self {
        Self { settle_s: 0.0, tilt_deg: TILT_DEG, seed: 1 }
    }
}

/// Tilt that is allowed where nobody states another one, in degrees: 0.0175 g.
pub const TILT_DEG: f64 = 1.0;

/// Error of a sheet.
#[derive(Debug, thiserror::Error)]
pub enum ProcedureError {
    /// Error of the scheme or its conditions.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A wait that leaves no time to record.
    #[error("a wait of {settle_s} s leaves nothing of the dwell of `{position}` ({dwell_s} s) to record")]
    Settle {
        /// Time at rest before a recording, in s.
        settle_s: f64,
        /// Name of the position.
        position: String,
        /// Dwell of the position, in s.
        dwell_s: f64,
    },
    /// A number out of its range.
    #[error("{what} of {found}: expected {expected}")]
    Number {
        /// Name of the number.
        what: &'static str,
        /// Number that was found.
        found: f64,
        /// Admitted numbers.
        expected: &'static str,
    },
}

/// Checks the numbers of the options.
///
/// # Errors
/// [`ProcedureError::Number`].
pub(super) fn check(options: &ProcedureOptions) -> Result<(), ProcedureError> {
    let numbers = [
        ("a wait", options.settle_s, 0.0..=1e5, "0 to 100000 s"),
        ("a tilt", options.tilt_deg, 0.01..=90.0, "0.01 to 90 degrees"),
    ];
    for (what, found, range, expected) in numbers {
        if !range.contains(&found) {
            return Err(ProcedureError::Number { what, found, expected });
        }
    }
    Ok(())
}
