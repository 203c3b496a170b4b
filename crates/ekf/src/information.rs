//! The information matrix of a batch of measurements, by its square root.

use nalgebra::{DMatrix, DVector};

use crate::error::{EkfError, check, is_positive};

/// The upper triangular square root `S` of the information `S^T S` (n x n). Rows are added by a QR
/// factorisation, so no precision is lost to squaring.
#[derive(Debug, Clone, PartialEq)]
pub struct SquareRootInformation {
    s: DMatrix<f64>,
}

impl SquareRootInformation {
    /// No information on n unknowns.
    pub fn none(n: usize) -> Self {
        Self { s: DMatrix::zeros(n, n) }
    }

    /// Independent prior standard deviations; infinite for no prior.
    ///
    /// # Errors
    /// [`EkfError`] unless all are positive.
    pub fn prior(sigmas: &[f64]) -> Result<Self, EkfError> {
        match sigmas.iter().position(|s| !is_positive(*s)) {
            Some(row) => Err(EkfError::NotPositiveDefinite { what: "P0", pivot: sigmas[row], row }),
            None => Ok(Self {
                s: DMatrix::from_diagonal(&DVector::from_iterator(
                    sigmas.len(),
                    sigmas.iter().map(|s| 1.0 / s),
                )),
            }),
        }
    }

    /// Adds measurements: rows of `H Phi(t, t_0) / sigma` (any number x n).
    ///
    /// # Errors
    /// [`EkfError`] for a wrong shape or a number that is not finite.
    pub fn add(&mut self, rows: &DMatrix<f64>) -> Result<(), EkfError> {
        let n = self.s.ncols();
        check("the measurement rows", rows, (rows.nrows(), n))?;
        let mut stacked = DMatrix::zeros(n + rows.nrows(), n);
        stacked.view_mut((0, 0), (n, n)).copy_from(&self.s);
        stacked.view_mut((n, 0), (rows.nrows(), n)).copy_from(rows);
        self.s = stacked.qr().r();
        Ok(())
    }

    /// The root S (n x n).
    pub fn root(&self) -> &DMatrix<f64> {
        &self.s
    }

    /// The covariance `(S^T S)^-1`.
    ///
    /// # Errors
    /// [`EkfError::Singular`] when a pivot is zero to rounding.
    pub fn covariance(&self) -> Result<DMatrix<f64>, EkfError> {
        let inverse = self.inverse_root()?;
        Ok(&inverse * inverse.transpose())
    }

    /// The standard deviations of the unknowns.
    ///
    /// # Errors
    /// [`EkfError::Singular`].
    pub fn sigmas(&self) -> Result<Vec<f64>, EkfError> {
        let inverse = self.inverse_root()?;
        Ok(inverse.row_iter().map(|r| r.norm()).collect())
    }

    /// `S^-1`, upper triangular.
    ///
    /// # Errors
    /// [`EkfError::Singular`].
    pub fn inverse_root(&self) -> Result<DMatrix<f64>, EkfError> {
        let n = self.s.ncols();
        for column in 0..n {
            let norm = self.s.column(column).norm();
            if !is_positive(self.s[(column, column)].abs() - 1e-15 * norm) {
                return Err(EkfError::Singular { column });
            }
        }
        self.s.solve_upper_triangular(&DMatrix::identity(n, n)).ok_or(EkfError::Singular { column: n })
    }
}
