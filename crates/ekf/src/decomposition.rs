//! The singular value decomposition, by faer.

use nalgebra::DMatrix;

use crate::error::{EkfError, check};

/// Singular values, descending, and the right singular vectors as columns (n x n) of a matrix with at
/// least as many rows as columns.
///
/// # Errors
/// [`EkfError::NotFinite`], and [`EkfError::Singular`] should the iteration not converge.
pub fn singular_values(a: &DMatrix<f64>) -> Result<(Vec<f64>, DMatrix<f64>), EkfError> {
    let n = a.ncols();
    check("A", a, a.shape())?;
    let matrix = faer::Mat::from_fn(a.nrows(), n, |i, j| a[(i, j)]);
    let svd = matrix.svd().map_err(|_| EkfError::Singular { column: 0 })?;
    let values = (0..n).map(|i| svd.S()[i]).collect();
    Ok((values, DMatrix::from_fn(n, n, |i, j| svd.V()[(i, j)])))
}
