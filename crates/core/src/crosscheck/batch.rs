//! The information of all measurements of a plan on the unknowns at its start.

use nalgebra::DMatrix;
use obsdeg_ekf::{EkfError, SquareRootInformation};

use crate::simulation::plan::Plan;

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
