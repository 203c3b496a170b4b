//! The Allan deviation.

use crate::error::EkfError;

/// The overlapping Allan deviation at clusters of `m` samples, in the unit of the samples: with the sums
/// `theta_k` of the first k of N `rates`, the root of
/// `sum (theta_(k+2m) - 2 theta_(k+m) + theta_k)^2 / (2 m^2 (N - 2m + 1))` over k = 0..=N - 2m (IEEE Std
/// 952-1997, C.1; the estimator of Howe, Allan, Barnes 1981, doi:10.1109/FREQ.1981.200541).
///
/// ```
/// // a ramp of one a sample: cluster means m apart differ by m
/// let ramp: Vec<f64> = (0..100).map(f64::from).collect();
/// let found = obsdeg_ekf::allan::overlapping_deviation(&ramp, 5)?;
/// assert!((found - 5.0 / 2f64.sqrt()).abs() < 1e-12);
/// # Ok::<(), obsdeg_ekf::EkfError>(())
/// ```
///
/// # Errors
/// [`EkfError::Shape`] when m is zero, or there are less than 2m samples.
pub fn overlapping_deviation(rates: &[f64], m: usize) -> Result<f64, EkfError> {
    let n = rates.len();
    let least = m.saturating_mul(2).max(2);
    if m == 0 || n < least {
        return Err(EkfError::Shape {
            what: "the samples of two clusters",
            expected: (1, least),
            found: (1, n),
        });
    }
    // sums of the differences from the first sample: a common offset costs no digits
    let mut theta = Vec::with_capacity(n + 1);
    let mut sum = 0.0;
    theta.push(sum);
    for rate in rates {
        sum += rate - rates[0];
        theta.push(sum);
    }
    let second = |k: usize| (theta[k + 2 * m] - 2.0 * theta[k + m] + theta[k]).powi(2);
    let count = n - 2 * m + 1;
    let total: f64 = (0..count).map(second).sum();
    Ok((total / (2.0 * count as f64)).sqrt() / m as f64)
}
