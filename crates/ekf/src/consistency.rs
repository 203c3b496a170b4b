//! Whether a filter's errors are what its covariance says: NEES, NIS, whiteness, with chi-square bands
//! (Bar-Shalom, Li, Kirubarajan 2001, *Estimation with Applications to Tracking and Navigation*, 5.4).

use nalgebra::{Cholesky, DMatrix, Dyn};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::error::{EkfError, check_symmetric, is_positive};

/// The probability that a statistic of a right model lies in its band.
pub const CONFIDENCE: f64 = 0.95;

/// The interval that the mean of `count` independent chi-square variables of `dof` degrees of freedom each
/// stays in with probability `confidence`.
///
/// ```
/// let (low, high) = obsdeg_ekf::consistency::chi_square_band(15.0, 200.0, 0.95);
/// assert!((low - 14.25).abs() < 0.01 && (high - 15.77).abs() < 0.01);
/// ```
pub fn chi_square_band(dof: f64, count: f64, confidence: f64) -> (f64, f64) {
    let Ok(chi) = ChiSquared::new(dof * count) else { return (0.0, f64::INFINITY) };
    let tail = (1.0 - confidence) / 2.0;
    (chi.inverse_cdf(tail) / count, chi.inverse_cdf(1.0 - tail) / count)
}

/// `e^T P^-1 e` of a fixed covariance for any number of errors.
#[derive(Debug, Clone)]
pub struct Nees {
    /// `L^-1 diag(1/scale)`, row by row, lower triangular.
    rows: Vec<Vec<f64>>,
}

impl Nees {
    /// The factor of `p`, whose rows and columns are scaled to unit variance first.
    ///
    /// # Errors
    /// [`EkfError`] unless `p` is positive definite.
    pub fn new(p: &DMatrix<f64>) -> Result<Self, EkfError> {
        let n = p.nrows();
        check_symmetric("P", p, n)?;
        if let Some(row) = (0..n).find(|&i| !is_positive(p[(i, i)])) {
            return Err(EkfError::NotPositiveDefinite { what: "P", pivot: p[(row, row)], row });
        }
        let scale: Vec<f64> = (0..n).map(|i| 1.0 / p[(i, i)].sqrt()).collect();
        let scaled = DMatrix::from_fn(n, n, |i, j| p[(i, j)] * scale[i] * scale[j]);
        let refuse = || EkfError::NotPositiveDefinite { what: "P", pivot: 0.0, row: n - 1 };
        let l = Cholesky::<f64, Dyn>::new(scaled).ok_or_else(refuse)?.l();
        let inverse = l.solve_lower_triangular(&DMatrix::identity(n, n)).ok_or_else(refuse)?;
        let rows = (0..n).map(|i| (0..=i).map(|j| inverse[(i, j)] * scale[j]).collect()).collect();
        Ok(Self { rows })
    }

    /// `e^T P^-1 e`, chi-square with n degrees of freedom when `e ~ N(0, P)`.
    pub fn of(&self, e: &[f64]) -> f64 {
        self.rows.iter().map(|row| crate::transition::dot(row, e).powi(2)).sum()
    }
}

/// The autocorrelation of a sequence of unit normals at lags 1, 2, ...; each is normal with variance 1/N for
/// white innovations.
pub fn autocorrelation(whitened: &[f64], lags: usize) -> Vec<f64> {
    let power: f64 = whitened.iter().map(|v| v * v).sum();
    (1..=lags)
        .map(|lag| {
            let sum: f64 = whitened.iter().zip(whitened.iter().skip(lag)).map(|(a, b)| a * b).sum();
            if power > 0.0 { sum / power } else { 0.0 }
        })
        .collect()
}

/// The probability that white noise has autocorrelations (of `count` samples) at least this large: Ljung and
/// Box 1978, doi:10.1093/biomet/65.2.297.
pub fn ljung_box(autocorrelation: &[f64], count: usize) -> f64 {
    let n = count as f64;
    let sum: f64 = autocorrelation.iter().enumerate().map(|(k, r)| r * r / (n - k as f64 - 1.0)).sum();
    let statistic = n * (n + 2.0) * sum;
    ChiSquared::new(autocorrelation.len() as f64).map_or(f64::NAN, |chi| chi.sf(statistic))
}
