//! Evidence a: the slope of sigma against the dwell, on logarithmic axes.

use obsdeg_ekf::SquareRootInformation;

use crate::model::{Dwell, Scheme};
use crate::simulation::SimulationError;
use crate::simulation::batch::{batch, diffuse_prior};
use crate::simulation::conditions::{Conditions, DriftNoise};
use crate::simulation::plan::Plan;

/// The dwells at which the slope is measured, in s: so short that the highest order outweighs the lower ones, long against
/// rounding.
const MEASURED: [f64; 5] = [2.0, 3.56, 6.32, 11.2, 20.0];
/// More dwells for the plot.
const SHOWN: [f64; 6] = [63.2, 200.0, 632.0, 1120.0, 2000.0, 6320.0];
/// How much looser the prior is than that of the inflation: the dwells are that much shorter.
const LOOSER: f64 = 100.0;
/// Samples per position: the noise of a sample is scaled so that its density stays.
const SAMPLES: f64 = 50.0;

/// Sigma of some functionals against the dwell.
#[derive(Debug, Clone, PartialEq)]
pub struct Slopes {
    /// The dwells of the first position, ascending, in s.
    pub dwells: Vec<f64>,
    /// Of every functional: sigma at every dwell, SI units.
    pub sigmas: Vec<Vec<f64>>,
    /// Of every functional: the slope over the measured dwells.
    pub slopes: Vec<f64>,
}

/// The slopes of `functionals` of the initial unknowns of `scheme`, without drift noise and with a diffuse prior.
///
/// # Errors
/// [`SimulationError`].
pub fn slopes(
    scheme: &Scheme,
    conditions: &Conditions,
    functionals: &[Vec<(usize, f64)>],
) -> Result<Slopes, SimulationError> {
    let mut dwells: Vec<f64> = MEASURED.into_iter().chain(SHOWN).collect();
    dwells.sort_by(f64::total_cmp);
    let mut sigmas = vec![Vec::new(); functionals.len()];
    for &dwell in &dwells {
        let (scheme, conditions) = scaled(scheme, conditions, dwell);
        let plan = Plan::new(&scheme, &conditions)?;
        let prior: Vec<f64> = diffuse_prior(&plan).iter().map(|s| s * LOOSER).collect();
        let prior = SquareRootInformation::prior(&prior)?;
        let root = batch(&plan, prior)?.information.inverse_root()?;
        for (s, functional) in sigmas.iter_mut().zip(functionals) {
            // c S^-1: large variances cancel here, not in the covariance
            let entry = |j: usize| functional.iter().map(|&(i, k)| k * root[(i, j)]).sum::<f64>();
            s.push((0..root.ncols()).map(|j| entry(j).powi(2)).sum::<f64>().sqrt());
        }
    }
    let measured: Vec<usize> = (0..dwells.len()).filter(|&i| MEASURED.contains(&dwells[i])).collect();
    let slope = |s: &Vec<f64>| regression(measured.iter().map(|&i| (dwells[i].ln(), s[i].ln())));
    Ok(Slopes { slopes: sigmas.iter().map(slope).collect(), dwells, sigmas })
}

/// The scheme with its first position lasting `dwell`, the others in proportion.
fn scaled(scheme: &Scheme, conditions: &Conditions, dwell: f64) -> (Scheme, Conditions) {
    let seconds = |d: Option<Dwell>| d.map_or(conditions.dwell_s, Dwell::seconds);
    let factor = scheme.positions.first().map_or(1.0, |p| dwell / seconds(p.dwell));
    let mut scheme = scheme.clone();
    for p in &mut scheme.positions {
        p.dwell = p.dwell.and_then(|d| Dwell::from_seconds(d.seconds() * factor));
    }
    let step = dwell / SAMPLES;
    let conditions = Conditions {
        step_s: step,
        dwell_s: conditions.dwell_s * factor,
        slews: false,
        accelerometer_noise_g: conditions.accelerometer_noise_g * (conditions.step_s / step).sqrt(),
        azimuth_noise_deg: conditions.azimuth_noise_deg * (conditions.step_s / step).sqrt(),
        drift_noise: DriftNoise::OneStep(0.0),
        ..conditions.clone()
    };
    (scheme, conditions)
}

/// The slope of the least-squares line.
fn regression(points: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (x, y) in points {
        n += 1.0;
        sx += x;
        sy += y;
        sxx += x * x;
        sxy += x * y;
    }
    (n * sxy - sx * sy) / (n * sxx - sx * sx)
}
