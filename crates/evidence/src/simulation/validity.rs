//! Validity of the small-angle model for the drifts of a run.

use schemars::JsonSchema;
use serde::Serialize;

use super::conditions::{Conditions, REQUIRED, is_rate, resolve, si_per_shown};
use super::error::SimulationError;
use super::plan::Plan;

/// Validity of the small-angle model at the drifts of a run.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Validity {
    /// Largest platform error `|psi|`, in deg.
    pub largest_psi_deg: f64,
    /// Largest `|psi|^2/2`, in g: the term that the observation model (6) neglects.
    pub neglected_g: f64,
    /// Noise of the observation per sample, in g.
    pub accelerometer_noise_g: f64,
    /// Largest g-sensitive coefficient times the largest `|psi|`, in deg/h: the term that the drift model (3)
    /// neglects.
    pub neglected_dph: f64,
    /// Smallest sigma required of a drift coefficient, in deg/h (per g); null if none is required.
    pub smallest_requirement_dph: Option<f64>,
    /// True if `neglected_g` is at most the noise and `neglected_dph` at most the smallest requirement.
    pub holds: bool,
}

impl Validity {
    /// Validity of a run from the true states `start`, in which `|psi|` reached `psi` (rad).
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`] for a requirement on an unknown that the scheme does not have.
    pub fn of(
        plan: &Plan,
        conditions: &Conditions,
        start: &[f64],
        psi: f64,
    ) -> Result<Self, SimulationError> {
        let dph = si_per_shown("deg/h");
        let requirements = resolve(REQUIRED, &plan.platform, &conditions.requirements, f64::NAN)?;
        let units = plan.platform.units();
        let sensitive = units.iter().zip(start).filter(|(unit, _)| is_rate(unit) && unit.contains("/g"));
        let coefficient = sensitive.map(|(_, d)| d.abs()).fold(0.0, f64::max) / dph;
        let smallest = units.iter().zip(&requirements).filter(|(unit, t)| is_rate(unit) && !t.is_nan());
        let smallest = smallest.map(|(_, t)| *t).reduce(f64::min);
        let (neglected_g, neglected_dph) = (psi * psi / 2.0, coefficient * psi);
        let small = neglected_g <= conditions.accelerometer_noise_g;
        Ok(Self {
            largest_psi_deg: psi.to_degrees(),
            neglected_g,
            accelerometer_noise_g: conditions.accelerometer_noise_g,
            neglected_dph,
            smallest_requirement_dph: smallest,
            holds: small && smallest.is_none_or(|t| neglected_dph <= t),
        })
    }
}
