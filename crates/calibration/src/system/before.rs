//! Information of a prior calibration on the unknowns of a model.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::answer::SystemCalibrationError;
use super::constraints::bound_and_free;
use super::fit::{SystemProblem, size};
use crate::answer::CovarianceTable;

/// Relative variance, by the trace, below which a direction counts as constrained by the prior calibration.
const CONSTRAINED: f64 = 1e-14;

/// Rows and values of the information of `table` on the free unknowns `names` of `problem`, with unit errors.
/// Along directions that the prior calibration had constrained and the model constrains too, the prior adds
/// nothing: the nonlinear constraints hold by themselves.
pub(super) fn said_before(
    table: &CovarianceTable,
    names: &[&str],
    problem: &SystemProblem<'_>,
    base: &DVector<f64>,
) -> Result<(DMatrix<f64>, DVector<f64>), SystemCalibrationError> {
    let nothing = || SystemCalibrationError::Prior { found: table.names.join(", ") };
    let n = table.names.len();
    let shapes = table.estimates.len() == n && table.covariance.len() == n;
    if !shapes || table.covariance.iter().any(|row| row.len() != n) {
        return Err(nothing());
    }
    let place = |k: usize| names.iter().position(|name| *name == table.names[k]).map(|j| (k, j));
    let found: Vec<(usize, usize)> = (0..n).filter_map(place).collect();
    if found.is_empty() {
        return Err(nothing());
    }
    let bound = || {
        let names: Vec<&str> = found.iter().map(|&(k, _)| table.names[k].as_str()).collect();
        SystemCalibrationError::PriorConstrained { found: names.join(", ") }
    };
    let m = found.len();
    let mut x = DVector::from_iterator(names.len(), problem.free.iter().map(|&i| base[i]));
    found.iter().for_each(|&(k, j)| x[j] = table.estimates[k]);
    // relative to the sizes of the unknowns
    let sizes: Vec<f64> = found.iter().map(|&(_, j)| size(x[j])).collect();
    let entry = |i: usize, j: usize| table.covariance[found[i].0][found[j].0] / sizes[i] / sizes[j];
    let mut p = DMatrix::from_fn(m, m, entry);
    let whole = p.trace();
    // constraints on these unknowns alone: their rows without the part that other unknowns can compensate
    let rows = problem.bounds(base, &x);
    let own = DMatrix::from_fn(rows.nrows(), m, |i, k| rows[(i, found[k].1)]);
    let mut others = rows;
    found.iter().for_each(|&(_, j)| others.column_mut(j).fill(0.0));
    let (others, _) = bound_and_free(&others.transpose()).map_err(|_| nothing())?;
    let (directions, _) =
        bound_and_free(&(&own - &others * (others.transpose() * &own))).map_err(|_| nothing())?;
    if directions.ncols() > 0 {
        let along = (directions.transpose() * &p * &directions).symmetric_eigen();
        for (k, value) in along.eigenvalues.iter().enumerate() {
            if *value <= CONSTRAINED * whole {
                let constrained = &directions * along.eigenvectors.column(k);
                p += &constrained * constrained.transpose();
            }
        }
    }
    let diagonal = p.diagonal();
    let root = Cholesky::new(p).ok_or_else(bound)?.l();
    if (0..m).any(|i| root[(i, i)].powi(2) <= CONSTRAINED * diagonal[i]) {
        return Err(bound());
    }
    let rows = DMatrix::from_fn(m, names.len(), |i, j| if found[i].1 == j { 1.0 / sizes[i] } else { 0.0 });
    let rows = root.solve_lower_triangular(&rows).ok_or_else(bound)?;
    let values = &rows * x;
    Ok((rows, values))
}
