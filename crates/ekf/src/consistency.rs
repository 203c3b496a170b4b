//! Consistency of a filter's errors with its covariance: NEES, NIS, whiteness, with chi-square bands
//! (Bar-Shalom, Li, Kirubarajan 2001, *Estimation with Applications to Tracking and Navigation*, 5.4).

use nalgebra::DMatrix;
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};
use statrs::function::erf::erfc;

use crate::covariance::{Covariance, CovarianceForm};
use crate::decomposition::singular_values;
use crate::error::EkfError;

/// Probability that a statistic of a right model lies in its band.
pub const CONFIDENCE: f64 = 0.95;

/// Interval that contains the mean of `count` independent chi-square variables of `dof` degrees of
/// freedom each with probability `confidence`.
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

/// Quantile of a chi-square variable of `dof` degrees of freedom at probability `confidence`: the gate
/// of an innovation. Infinite unless `dof` is positive.
pub fn chi_square_quantile(dof: f64, confidence: f64) -> f64 {
    ChiSquared::new(dof).map_or(f64::INFINITY, |chi| chi.inverse_cdf(confidence))
}

/// Quantile of Student's t at probability `confidence`: a unit normal over the root of an independent
/// chi-square per degree of freedom (`dof` of them). It is the gate of a residual whose sigma is
/// estimated from the others (Student 1908, doi:10.1093/biomet/6.1.1). Infinite unless `dof` is
/// positive.
///
/// ```
/// let gate = obsdeg_ekf::consistency::student_quantile(10.0, 0.975);
/// assert!((gate - 2.228139).abs() < 1e-5);
/// ```
pub fn student_quantile(dof: f64, confidence: f64) -> f64 {
    StudentsT::new(0.0, 1.0, dof).map_or(f64::INFINITY, |t| t.inverse_cdf(confidence))
}

/// Probability that a normal variable of mean 0 and variance 1 is at most `x`.
///
/// ```
/// let p = obsdeg_ekf::consistency::normal_cdf(1.959964);
/// assert!((p - 0.975).abs() < 1e-6);
/// ```
pub fn normal_cdf(x: f64) -> f64 {
    erfc(-x / std::f64::consts::SQRT_2) / 2.0
}

/// Probability that a chi-square variable of `dof` degrees of freedom exceeds `x`.
pub fn chi_square_tail(dof: f64, x: f64) -> f64 {
    ChiSquared::new(dof).map_or(0.0, |chi| chi.sf(x))
}

/// Evaluates `e^T P^-1 e` for a fixed covariance and any number of errors, by `P = U diag(d) U^T`.
#[derive(Debug, Clone, PartialEq)]
pub struct Nees {
    /// U above its diagonal, column by column.
    u: Vec<f64>,
    d: Vec<f64>,
}

impl Nees {
    /// Factorises `p`.
    ///
    /// # Errors
    /// [`EkfError`] unless `p` is symmetric and positive definite.
    pub fn new(p: &DMatrix<f64>) -> Result<Self, EkfError> {
        Self::of_covariance(&Covariance::new("P", p, CovarianceForm::Ud)?)
    }

    /// Takes the factors of the covariance of a filter, without computation in the UD form.
    ///
    /// # Errors
    /// [`EkfError::NotPositiveDefinite`].
    pub fn of_covariance(p: &Covariance) -> Result<Self, EkfError> {
        let (u, d) = p.factors()?;
        Ok(Self { u, d })
    }

    /// Returns `e^T P^-1 e`, chi-square with n degrees of freedom if `e ~ N(0, P)`; `e` (shape n) is
    /// overwritten.
    ///
    /// # Errors
    /// [`EkfError::Shape`].
    pub fn of(&self, e: &mut [f64]) -> Result<f64, EkfError> {
        let n = self.d.len();
        if e.len() != n {
            return Err(EkfError::Shape { what: "e", expected: (n, 1), found: (e.len(), 1) });
        }
        let mut sum = 0.0;
        // y = U^-1 e from the last component up
        for j in (0..n).rev() {
            let (above, y) = e.split_at_mut(j);
            let y = y[0];
            sum += y * y / self.d[j];
            for (x, u) in above.iter_mut().zip(&self.u[j * n..j * n + j]) {
                *x -= u * y;
            }
        }
        Ok(sum)
    }

    /// Part of `e^T P^-1 e` (`e`: shape n) along the principal axes of the correlation matrix whose
    /// sigma is at least `least` times those of the components, and the number of these axes. Along the
    /// other axes a filter that is linearised in doubles knows less than its covariance claims.
    ///
    /// ```
    /// use obsdeg_ekf::consistency::Nees;
    /// // two components that are one, but for 1e-9
    /// let p = nalgebra::DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, 1.0 + 1e-12]);
    /// let nees = Nees::new(&p).expect("positive definite");
    /// let (sum, directions) = nees.resolved(&[0.5, 0.5001], 1e-3).expect("two of two");
    /// assert!((sum - 0.25).abs() < 1e-3 && directions == 1);
    /// assert!(nees.of(&mut [0.5, 0.5001]).expect("two of two") > 1e3);
    /// ```
    ///
    /// # Errors
    /// [`EkfError`].
    pub fn resolved(&self, e: &[f64], least: f64) -> Result<(f64, usize), EkfError> {
        let n = self.d.len();
        if e.len() != n {
            return Err(EkfError::Shape { what: "e", expected: (n, 1), found: (e.len(), 1) });
        }
        let u = |i: usize, j: usize| if i == j { 1.0 } else { self.u[j * n + i] };
        let mut root = DMatrix::from_fn(n, n, |j, i| if i > j { 0.0 } else { u(i, j) * self.d[j].sqrt() });
        let sigmas: Vec<f64> = root.column_iter().map(|c| c.norm()).collect();
        for (mut column, sigma) in root.column_iter_mut().zip(&sigmas) {
            column /= *sigma;
        }
        if root.iter().any(|x| !x.is_finite()) {
            return Ok((f64::NAN, n));
        }
        let (values, axes) = singular_values(&root)?;
        let along = |k: usize| -> f64 { (0..n).map(|i| axes[(i, k)] * e[i] / sigmas[i]).sum() };
        let seen = values.iter().take_while(|value| **value >= least).count();
        Ok(((0..seen).map(|k| (along(k) / values[k]).powi(2)).sum(), seen))
    }

    /// `P^-1 b` (n x any).
    pub(crate) fn solve(&self, b: &DMatrix<f64>) -> DMatrix<f64> {
        let n = self.d.len();
        let u = |i: usize, j: usize| self.u[j * n + i];
        let mut out = b.clone();
        for mut column in out.column_iter_mut() {
            for j in (0..n).rev() {
                for i in 0..j {
                    column[i] -= u(i, j) * column[j];
                }
            }
            for (x, d) in column.iter_mut().zip(&self.d) {
                *x /= d;
            }
            for j in 0..n {
                for i in 0..j {
                    column[j] -= u(i, j) * column[i];
                }
            }
        }
        out
    }
}

/// Autocorrelation of a sequence of unit normals at lags 1, 2, ...; each value is normal with variance
/// 1/N for white innovations.
pub fn autocorrelation(whitened: &[f64], lags: usize) -> Vec<f64> {
    let power: f64 = whitened.iter().map(|v| v * v).sum();
    (1..=lags)
        .map(|lag| {
            let sum: f64 = whitened.iter().zip(whitened.iter().skip(lag)).map(|(a, b)| a * b).sum();
            if power > 0.0 { sum / power } else { 0.0 }
        })
        .collect()
}

/// Probability that white noise has autocorrelations (of `count` samples) at least this large: Ljung
/// and Box 1978, doi:10.1093/biomet/65.2.297.
pub fn ljung_box(autocorrelation: &[f64], count: usize) -> f64 {
    ljung_box_of_sequences(autocorrelation, count, 1)
}

/// Probability as [`ljung_box`] for `sequences` independent sequences of `length` samples each, whose
/// products are summed at every lag: each sequence has `length - lag` of them.
///
/// ```
/// use obsdeg_ekf::consistency::{ljung_box, ljung_box_of_sequences};
/// assert_eq!(ljung_box_of_sequences(&[0.1], 50, 1), ljung_box(&[0.1], 50));
/// // one sequence of twice the length has one more product
/// assert!(ljung_box_of_sequences(&[0.1], 50, 2) < ljung_box(&[0.1], 100));
/// ```
pub fn ljung_box_of_sequences(autocorrelation: &[f64], length: usize, sequences: usize) -> f64 {
    let (length, sequences) = (length as f64, sequences as f64);
    let n = length * sequences;
    // white, r at a lag has the variance (length - lag) / (length (n + 2))
    let term = |(k, r): (usize, &f64)| r * r / (length - k as f64 - 1.0);
    let statistic = length * (n + 2.0) * autocorrelation.iter().enumerate().map(term).sum::<f64>();
    ChiSquared::new(autocorrelation.len() as f64).map_or(f64::NAN, |chi| chi.sf(statistic))
}
