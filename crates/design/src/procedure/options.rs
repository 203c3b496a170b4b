//! Options of a sheet, and the reasons why there is none.

use obsdeg_evidence::simulation::SimulationError;

/// Options of a sheet.
#[derive(Debug, Clone, PartialEq)]
pub struct ProcedureOptions {
    /// Tilt that is always allowed in the readings, in degrees.
    pub tilt_deg: f64,
    /// Seed of the verdicts.
    pub seed: u64,
}

impl Default for ProcedureOptions {
    fn default() -> Self {
        Self { tilt_deg: TILT_DEG, seed: 1 }
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
    let (what, range, expected) = ("a tilt", 0.01..=90.0, "0.01 to 90 degrees");
    match options.tilt_deg {
        found if !range.contains(&found) => Err(ProcedureError::Number { what, found, expected }),
        _ => Ok(()),
    }
}
