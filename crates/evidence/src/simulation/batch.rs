//! The information of all measurements of a plan on the unknowns at its start.

use nalgebra::DMatrix;
use obsdeg_ekf::{EkfError, SquareRootInformation};
use obsdeg_exact::interrupt;

use super::conditions::is_rate;
use super::plan::Plan;

/// How many times wider a prior that says nothing is than what the measurements alone say of one unknown, the
/// others known: wide against all that can be determined, and far enough from 1e16 that rounding does not
/// look like information.
const WIDER_PSI: f64 = 1e12;
/// The same for drifts. They enter with the dwell, which in a sweep grows to hundreds of times that at which
/// the prior was taken.
const WIDER_DRIFT: f64 = 1e10;
/// Rows that are added at a time.
const ROWS: usize = 4096;

/// The root of the information on the initial unknowns, and the transition from start to end.
#[derive(Debug, Clone)]
pub struct Batch {
    /// Without prior, unless one was given.
    pub information: SquareRootInformation,
    /// `Phi(end, start)` (n x n).
    pub to_end: DMatrix<f64>,
}

/// Adds all measurements of `plan` to `information`, as functionals of the initial unknowns; process noise is
/// left out, and so are the biases.
///
/// # Errors
/// [`EkfError`] when a number is not finite.
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

/// All measurements of `plan` in units of their noise as functionals of the initial unknowns, one after the
/// other; the transition from start to end.
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

/// Standard deviations that say nothing beside the measurements of `plan`: in units of what these say, so
/// that noise, steps and dwells do not matter.
///
/// # Errors
/// [`EkfError`] when a number is not finite.
pub fn diffuse_prior(plan: &Plan) -> Result<Vec<f64>, EkfError> {
    let information = batch(plan, SquareRootInformation::none(plan.unknowns()))?.information;
    Ok(wider(plan, &information, WIDER_PSI, WIDER_DRIFT))
}

/// Standard deviations so many times wider than what `information` says of the best known drift, and of the
/// best known of the others (psi, and what is no rate), all others known.
pub(crate) fn wider(plan: &Plan, information: &SquareRootInformation, psi: f64, drift: f64) -> Vec<f64> {
    let units = plan.platform.units();
    let sigma = |psi: bool, wider: f64| {
        let own = information.root().column_iter().zip(units).filter(|(_, u)| is_rate(u) != psi);
        let largest = own.map(|(column, _)| column.norm()).fold(0.0, f64::max);
        // nothing is measured of any: any prior will do
        if largest > 0.0 { wider / largest } else { wider }
    };
    let (psi, drift) = (sigma(true, psi), sigma(false, drift));
    units.iter().map(|u| if is_rate(u) { drift } else { psi }).collect()
}
