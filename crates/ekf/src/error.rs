//! Errors of the filter.

use nalgebra::DMatrix;

/// Error for an input; `what` is its name (`P0`, `R`, `Phi`, ...).
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EkfError {
    /// Matrix or vector of the wrong shape.
    #[error("{what} has shape {}x{}; expected {}x{}", found.0, found.1, expected.0, expected.1)]
    Shape {
        /// Name of the input.
        what: &'static str,
        /// Rows and columns expected.
        expected: (usize, usize),
        /// Rows and columns found.
        found: (usize, usize),
    },
    /// Entry that is NaN or infinite.
    #[error("{what} has an entry that is not finite: {value} at row {row}, column {column}")]
    NotFinite {
        /// Name of the input.
        what: &'static str,
        /// Entry that was found.
        value: f64,
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
    },
    /// Interruption by the caller.
    #[error("interrupted")]
    Interrupted,
    /// State with NaN or infinity.
    #[error("{what} is not finite")]
    StateNotFinite {
        /// Name of the input.
        what: &'static str,
    },
    /// Divergence of the estimate.
    #[error("the filter diverges: {what}")]
    Diverged {
        /// Quantity that grew.
        what: &'static str,
    },
    /// Matrix that is not symmetric.
    #[error("{what} is not symmetric: entries ({row},{column}) and ({column},{row}) differ")]
    NotSymmetric {
        /// Name of the input.
        what: &'static str,
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
    },
    /// Covariance that is not invertible.
    #[error("{what} is not positive definite: pivot {pivot:e} in row {row}")]
    NotPositiveDefinite {
        /// Name of the input.
        what: &'static str,
        /// Pivot that was found.
        pivot: f64,
        /// Row, from 0.
        row: usize,
    },
    /// Covariance with a negative direction.
    #[error("{what} is not positive semidefinite: pivot {pivot:e} in row {row}")]
    NotPositiveSemidefinite {
        /// Name of the input.
        what: &'static str,
        /// Pivot that was found.
        pivot: f64,
        /// Row, from 0.
        row: usize,
    },
    /// Variance of measurement noise that is not positive.
    #[error("{what} is {value:e}; expected a variance above 0")]
    NotPositive {
        /// Name of the input.
        what: &'static str,
        /// Value that was found.
        value: f64,
    },
    /// Information that leaves a direction undetermined.
    #[error("the information is singular: unknown {column} is not determined")]
    Singular {
        /// Index of the unknown, from 0.
        column: usize,
    },
}

impl EkfError {
    /// True if numbers of the right shape exceeded what doubles resolve.
    pub fn is_numeric(&self) -> bool {
        !matches!(self, Self::Shape { .. } | Self::NotSymmetric { .. })
    }
}

/// True if `x` is a number above zero; false for NaN.
pub(crate) fn is_positive(x: f64) -> bool {
    x > 0.0
}

/// Checks the shape of a column and that all its entries are finite.
pub(crate) fn check_column(what: &'static str, v: &[f64], expected: usize) -> Result<(), EkfError> {
    if v.len() != expected {
        return Err(EkfError::Shape { what, expected: (expected, 1), found: (v.len(), 1) });
    }
    match v.iter().position(|x| !x.is_finite()) {
        Some(row) => Err(EkfError::NotFinite { what, value: v[row], row, column: 0 }),
        None => Ok(()),
    }
}

/// Checks the shape of `m` and that all its entries are finite.
pub(crate) fn check(what: &'static str, m: &DMatrix<f64>, expected: (usize, usize)) -> Result<(), EkfError> {
    if m.shape() != expected {
        return Err(EkfError::Shape { what, expected, found: m.shape() });
    }
    for (i, &value) in m.iter().enumerate() {
        if !value.is_finite() {
            let (row, column) = (i % m.nrows(), i / m.nrows());
            return Err(EkfError::NotFinite { what, value, row, column });
        }
    }
    Ok(())
}

/// Checks shape, finiteness and symmetry (to rounding).
pub(crate) fn check_symmetric(what: &'static str, m: &DMatrix<f64>, n: usize) -> Result<(), EkfError> {
    check(what, m, (n, n))?;
    for column in 0..n {
        for row in column + 1..n {
            let scale = (m[(row, row)].abs() * m[(column, column)].abs()).sqrt();
            if (m[(row, column)] - m[(column, row)]).abs() > 1e-9 * scale {
                return Err(EkfError::NotSymmetric { what, row, column });
            }
        }
    }
    Ok(())
}
