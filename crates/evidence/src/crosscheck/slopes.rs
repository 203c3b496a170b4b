//! Sigma against the dwell, at the dwells of a platform, for the plot.

use obsdeg_core::model::{Dwell, Scheme, SchemeError};
use obsdeg_ekf::SquareRootInformation;

use crate::simulation::SimulationError;
use crate::simulation::batch::{batch, diffuse_prior};
use crate::simulation::conditions::Conditions;
use crate::simulation::plan::Plan;

/// Dwells of the plot, in s.
const SHOWN: [f64; 11] = [2.0, 3.56, 6.32, 11.2, 20.0, 63.2, 200.0, 632.0, 1120.0, 2000.0, 6320.0];
/// Dwell, in s, whose measurements set the width of the prior.
const PRIOR_AT: f64 = 20.0;
/// Number of samples per position: the noise of a sample is scaled so that its density stays.
const SAMPLES: f64 = 50.0;

/// Sigmas of functionals against the dwell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DwellSigmas {
    /// Dwells of the first position, ascending, in s.
    pub dwells: Vec<f64>,
    /// Sigmas by functional, then by dwell, in SI units.
    pub sigmas: Vec<Vec<f64>>,
}

/// Sigmas of `functionals` of the initial unknowns of `scheme`, without drift noise and with a diffuse prior.
/// Dwells that doubles do not resolve are left out.
pub(crate) fn slopes(
    scheme: &Scheme,
    conditions: &Conditions,
    functionals: &[Vec<(usize, f64)>],
) -> DwellSigmas {
    let plan = |dwell: f64| -> Result<Plan, SimulationError> {
        let (scheme, conditions) = scaled(scheme, conditions, dwell)?;
        Plan::derived(&scheme, &conditions)
    };
    let root = |dwell: f64| -> Result<_, SimulationError> {
        let prior = SquareRootInformation::prior(&diffuse_prior(&plan(PRIOR_AT)?)?)?;
        Ok(batch(&plan(dwell)?, prior)?.information.inverse_root()?)
    };
    let mut out = DwellSigmas { dwells: Vec::new(), sigmas: vec![Vec::new(); functionals.len()] };
    for (dwell, root) in SHOWN.into_iter().filter_map(|dwell| Some((dwell, root(dwell).ok()?))) {
        out.dwells.push(dwell);
        for (s, functional) in out.sigmas.iter_mut().zip(functionals) {
            // c S^-1: large variances cancel here, not in the covariance
            let entry = |j: usize| functional.iter().map(|&(i, k)| k * root[(i, j)]).sum::<f64>();
            s.push((0..root.ncols()).map(|j| entry(j).powi(2)).sum::<f64>().sqrt());
        }
    }
    out
}

/// Scheme with its first position lasting `dwell`, the others in proportion.
fn scaled(scheme: &Scheme, conditions: &Conditions, dwell: f64) -> Result<(Scheme, Conditions), SchemeError> {
    let seconds = |d: Option<Dwell>| d.map_or(conditions.dwell_s, Dwell::seconds);
    let factor = scheme.positions.first().map_or(1.0, |p| dwell / seconds(p.dwell));
    let scheme = scheme.with_dwells(conditions.dwell_s, factor)?;
    let step = dwell / SAMPLES;
    let conditions = Conditions {
        step_s: step,
        slews: false,
        accelerometer_noise_g: conditions.accelerometer_noise_g * (conditions.step_s / step).sqrt(),
        azimuth_noise_deg: conditions.azimuth_noise_deg * (conditions.step_s / step).sqrt(),
        ..conditions.clone().without_drift_noise()
    };
    Ok((scheme, conditions))
}
