//! The information of all measurements of a plan on the unknowns at its start.

use nalgebra::DMatrix;
use obsdeg_ekf::{EkfError, SquareRootInformation};

use super::plan::Plan;

/// Diffuse prior standard deviation of psi, in rad: with that of the drift in the ratio of the earth rate, so that
/// a null vector of both is left as loose as either.
const DIFFUSE_PSI: f64 = 1e6;
/// Diffuse prior standard deviation of a drift, in rad/s.
const DIFFUSE_DRIFT: f64 = 1e2;

/// The root of the information on the initial unknowns, and the transition from start to end.
#[derive(Debug, Clone)]
pub struct Batch {
    /// Without prior, unless one was given.
    pub information: SquareRootInformation,
    /// `Phi(end, start)` (n x n).
    pub to_end: DMatrix<f64>,
}

/// Adds all measurements of `plan` to `information`; process noise is left out.
///
/// # Errors
/// [`EkfError`] when a number is not finite.
pub fn batch(plan: &Plan, mut information: SquareRootInformation) -> Result<Batch, EkfError> {
    let n = plan.unknowns();
    let mut to_now: DMatrix<f64> = DMatrix::identity(n, n);
    let mut scratch = Vec::new();
    for stage in &plan.stages {
        let outputs = stage.outputs.len();
        let mut rows = DMatrix::zeros(stage.steps * outputs, n);
        for step in 0..stage.steps {
            for column in to_now.as_mut_slice().chunks_exact_mut(n) {
                stage.transition.apply(column, &mut scratch);
            }
            for (k, output) in stage.outputs.iter().enumerate() {
                let weight = 1.0 / output.r.sqrt();
                for j in 0..n {
                    let column = &to_now.as_slice()[j * n..(j + 1) * n];
                    rows[(step * outputs + k, j)] = weight * output.predict(column);
                }
            }
        }
        if outputs > 0 {
            information.add(&rows)?;
        }
    }
    Ok(Batch { information, to_end: to_now })
}

/// Standard deviations that say nothing.
pub fn diffuse_prior(plan: &Plan) -> Vec<f64> {
    plan.platform.units().iter().map(|u| if *u == "rad" { DIFFUSE_PSI } else { DIFFUSE_DRIFT }).collect()
}
