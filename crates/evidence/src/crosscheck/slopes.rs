//! Evidence a: the slope of sigma against the dwell, on logarithmic axes.

use obsdeg_core::model::{Dwell, Scheme, SchemeError};
use obsdeg_ekf::SquareRootInformation;

use crate::simulation::SimulationError;
use crate::simulation::batch::{batch, diffuse_prior};
use crate::simulation::conditions::Conditions;
use crate::simulation::plan::Plan;

/// The dwells at which the slope is measured, in s: so short that the highest order outweighs the lower ones, long
/// against rounding.
const MEASURED: [f64; 5] = [2.0, 3.56, 6.32, 11.2, 20.0];
/// More dwells for the plot.
const SHOWN: [f64; 6] = [63.2, 200.0, 632.0, 1120.0, 2000.0, 6320.0];
/// The dwell whose measurements say how wide the prior is.
const PRIOR_AT: f64 = 20.0;
/// How far slopes between neighbouring dwells may differ.
const BEND: f64 = 0.05;
/// Samples per position: the noise of a sample is scaled so that its density stays.
const SAMPLES: f64 = 50.0;

/// Sigma of some functionals against the dwell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Slopes {
    /// The dwells of the first position, ascending, in s.
    pub dwells: Vec<f64>,
    /// Of every functional: sigma at every dwell, SI units.
    pub sigmas: Vec<Vec<f64>>,
    /// Of every functional: the slope over the measured dwells.
    pub slopes: Vec<f64>,
    /// Of every functional: whether that is a slope. It is none where sigma is that of the prior, nor where it bends:
    /// where rounding bounds it, or where the dwells are not short (positions that hardly differ, a latitude close to a
    /// pole).
    pub straight: Vec<bool>,
}

/// The slopes of `functionals` of the initial unknowns of `scheme`, without drift noise and with a diffuse prior.
///
/// # Errors
/// [`SimulationError`].
pub(crate) fn slopes(
    scheme: &Scheme,
    conditions: &Conditions,
    functionals: &[Vec<(usize, f64)>],
) -> Result<Slopes, SimulationError> {
    let mut dwells: Vec<f64> = MEASURED.into_iter().chain(SHOWN).collect();
    dwells.sort_by(f64::total_cmp);
    let plan = |dwell: f64| {
        let scaled = scaled(scheme, conditions, dwell).map_err(|_| too_different());
        scaled.and_then(|(scheme, conditions)| match Plan::derived(&scheme, &conditions) {
            Err(SimulationError::TooManySteps { .. }) => Err(too_different()),
            plan => plan,
        })
    };
    let prior = diffuse_prior(&plan(PRIOR_AT)?)?;
    let root = |dwell: f64| -> Result<_, SimulationError> {
        let prior = SquareRootInformation::prior(&prior)?;
        Ok(batch(&plan(dwell)?, prior)?.information.inverse_root()?)
    };
    let mut sigmas = vec![Vec::new(); functionals.len()];
    let mut roots = Vec::new();
    for dwell in dwells {
        match root(dwell) {
            Ok(root) => roots.push((dwell, root)),
            // a dwell that is only shown may be too long for this prior
            Err(e) if MEASURED.contains(&dwell) => return Err(e),
            Err(_) => {}
        }
    }
    let dwells: Vec<f64> = roots.iter().map(|(dwell, _)| *dwell).collect();
    for (_, root) in &roots {
        for (s, functional) in sigmas.iter_mut().zip(functionals) {
            // c S^-1: large variances cancel here, not in the covariance
            let entry = |j: usize| functional.iter().map(|&(i, k)| k * root[(i, j)]).sum::<f64>();
            s.push((0..root.ncols()).map(|j| entry(j).powi(2)).sum::<f64>().sqrt());
        }
    }
    let measured: Vec<usize> = (0..dwells.len()).filter(|&i| MEASURED.contains(&dwells[i])).collect();
    let slope = |s: &Vec<f64>| regression(measured.iter().map(|&i| (dwells[i].ln(), s[i].ln())));
    let straight = |(s, functional): (&Vec<f64>, &Vec<(usize, f64)>)| {
        let given = functional.iter().map(|&(i, k)| (k * prior[i]).powi(2)).sum::<f64>().sqrt();
        let local =
            measured.windows(2).map(|w| (s[w[1]] / s[w[0]]).ln() / (dwells[w[1]] / dwells[w[0]]).ln());
        let (least, most) = local.fold((f64::MAX, f64::MIN), |(l, m), x| (l.min(x), m.max(x)));
        most - least <= BEND && measured.iter().all(|&i| s[i] < given / 10.0)
    };
    let straight = sigmas.iter().zip(functionals).map(straight).collect();
    Ok(Slopes { slopes: sigmas.iter().map(slope).collect(), straight, dwells, sigmas })
}

/// The dwells differ so much that no slope can be measured.
fn too_different() -> SimulationError {
    let what = "the dwells of the positions differ so much that no slope against them can be measured";
    SimulationError::Unresolvable { what: what.into() }
}

/// The scheme with its first position lasting `dwell`, the others in proportion.
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
