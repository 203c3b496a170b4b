//! Information of all measurements of a plan on the unknowns at its start.

use nalgebra::DMatrix;
use obsdeg_ekf::{EkfError, SquareRootInformation};
use obsdeg_exact::interrupt;

use super::conditions::is_rate;
use super::plan::Plan;

/// Ratio of a diffuse prior to the sigma of one unknown by the measurements alone, all others known. It is
/// wide against all that can be determined, and far enough from 1e16 that rounding does not look like
/// information.
const WIDER_PSI: f64 = 1e12;
/// Ratio of a diffuse prior for drifts. Drifts enter with the dwell, which in a sweep grows to hundreds of
/// times that of the prior.
const WIDER_DRIFT: f64 = 1e10;
/// Number of rows that are added at a time.
const ROWS: usize = 4096;

/// Root of the information on the initial unknowns, and the transition from start to end.
#[derive(Debug, Clone)]
pub struct Batch {
    /// Information on the initial unknowns, without a prior unless one was given.
    pub information: SquareRootInformation,
    /// Transition `Phi(end, start)` (n x n).
    pub to_end: DMatrix<f64>,
}

/// Adds all measurements of `plan` to `information`, as functionals of the initial unknowns. Process noise
/// and biases are left out.
///
/// # Errors
/// [`EkfError`] for a number that is not finite.
pub fn batch(plan: &Plan, mut information: SquareRootInformation) -> Result<Batch, EkfError> {
    let n = plan.unknowns();
    let most = ROWS.max(4 * n);
    let mut rows: Vec<f64> = Vec::new();
    let mut add = |rows: &mut Vec<f64>| {
        let taken = DMatrix::from_row_slice(rows.len() / n, n, rows);
        rows.clear();
        information.add(&taken)
    };
    let to_end = each_row(plan, |row| {
        rows.extend(row);
        if rows.len() >= most * n { add(&mut rows) } else { Ok(()) }
    })?;
    if !rows.is_empty() {
        add(&mut rows)?;
    }
    Ok(Batch { information, to_end })
}

/// Passes all measurements of `plan`, in units of their noise, to `sink` one after the other, as functionals
/// of the initial unknowns. Returns the transition from start to end.
pub(crate) fn each_row(
    plan: &Plan,
    mut sink: impl FnMut(&mut dyn Iterator<Item = f64>) -> Result<(), EkfError>,
) -> Result<DMatrix<f64>, EkfError> {
    let (n, states) = (plan.unknowns(), plan.states());
    // states by unknowns
    let mut to_now: DMatrix<f64> = DMatrix::identity(states, n);
    let mut scratch = Vec::new();
    for stage in &plan.stages {
        for _ in 0..stage.steps {
            interrupt::check();
            for column in to_now.as_mut_slice().chunks_exact_mut(states) {
                stage.transition.apply(column, &mut scratch);
            }
            for output in &stage.outputs {
                let weight = 1.0 / output.r.sqrt();
                sink(
                    &mut to_now.as_slice().chunks_exact(states).map(|column| weight * output.predict(column)),
                )?;
            }
        }
    }
    Ok(to_now.resize_vertically(n, 0.0))
}

/// Standard deviations of a diffuse prior, so wide that the measurements of `plan` outweigh it. They scale
/// with the sigmas by the measurements, so that noise, steps and dwells do not matter.
///
/// # Errors
/// [`EkfError`] for a number that is not finite.
pub fn diffuse_prior(plan: &Plan) -> Result<Vec<f64>, EkfError> {
    let information = batch(plan, SquareRootInformation::none(plan.unknowns()))?.information;
    Ok(wider(plan, &information, WIDER_PSI, WIDER_DRIFT))
}

/// Standard deviations of a wide prior. For drifts they are `drift` times the sigma of the best known drift
/// by `information`. For psi, and all other unknowns that are no rates, they are `psi` times that of the best
/// known one. Each of these sigmas takes all other unknowns as known.
pub(crate) fn wider(plan: &Plan, information: &SquareRootInformation, psi: f64, drift: f64) -> Vec<f64> {
    let units = plan.platform.units();
    let sigma = |psi: bool, wider: f64| {
        let own = information.root().column_iter().zip(units).filter(|(_, u)| is_rate(u) != psi);
        let largest = own.map(|(column, _)| column.norm()).fold(0.0, f64::max);
        // without measurements any prior will do
        if largest > 0.0 { wider / largest } else { wider }
    };
    let (psi, drift) = (sigma(true, psi), sigma(false, drift));
    units.iter().map(|u| if is_rate(u) { drift } else { psi }).collect()
}
