//! Probability that white noise is as correlated as a series.
//!
//! The statistic of Ljung and Box is a sum of squares of autocorrelations, which are not quite independent:
//! for 200 values and 20 lags its variance is 47 where that of chi-square is 40, and it is beyond the
//! chi-square quantile of 0.033 % five times as often. Its distribution for white normal noise depends on the
//! numbers of values and lags alone, so the probability is the share of simulated series that are as
//! correlated (Monte Carlo test: Barnard 1963; with the stopping rule of Besag and Clifford 1991,
//! doi:10.1093/biomet/78.2.301).

use obsdeg_ekf::consistency::{autocorrelation, ljung_box};
use obsdeg_evidence::simulation::Noise;

/// Fewest values of which a correlation is tested.
const FEWEST: usize = 40;
/// Lags of the correlation, at most a quarter of the values.
const LAGS: usize = 20;
/// Probabilities by chi-square between which series are simulated: above the approximation suffices, below no
/// simulation reaches.
const SIMULATED: (f64, f64) = (1e-9, 0.02);
/// Longest series that is simulated; for longer ones chi-square is as good.
const LONGEST: usize = 4000;
/// Most simulated series, most products of all of them, and the number of series as correlated that suffices.
const SERIES: usize = 50_000;
const PRODUCTS: usize = 400_000_000;
const ENOUGH: usize = 100;

/// Probability that white normal noise has autocorrelations as large as `series` (unit normals, if white);
/// `None` for less than 40 values.
pub(crate) fn whiteness(series: &[f64]) -> Option<f64> {
    let n = series.len();
    let lags = LAGS.min(n / 4);
    let own = ljung_box(&autocorrelation(series, lags), n);
    let simulated = (SIMULATED.0..SIMULATED.1).contains(&own) && n <= LONGEST;
    (n >= FEWEST).then(|| if simulated { share(own, n, lags) } else { own })
}

/// Share of series of `n` white values that are as correlated as one with the probability `own` by
/// chi-square; the series itself counts as one of them.
fn share(own: f64, n: usize, lags: usize) -> f64 {
    let most = SERIES.min(PRODUCTS / (n * lags));
    let mut noise = Noise::new(1, n as u64);
    let mut values = vec![0.0; n];
    let mut as_correlated = 1;
    for drawn in 1..=most {
        values.iter_mut().for_each(|x| *x = noise.normal());
        as_correlated += usize::from(ljung_box(&autocorrelation(&values, lags), n) <= own);
        if as_correlated > ENOUGH {
            return (as_correlated - 1) as f64 / drawn as f64;
        }
    }
    as_correlated as f64 / (most + 1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of white series whose probability is below a level equals that level, with series of another
    /// generator; by chi-square it is twice to three times the level.
    #[test]
    fn probabilities_of_white_series_are_true() {
        for n in [60, 200] {
            let mut noise = Noise::new(7, 3);
            let (mut own, mut plain) = (0, 0);
            let count = 4000;
            for _ in 0..count {
                let series: Vec<f64> = (0..n).map(|_| noise.normal()).collect();
                own += usize::from(whiteness(&series).expect("enough values") < 0.01);
                let lags = LAGS.min(n / 4);
                plain += usize::from(ljung_box(&autocorrelation(&series, lags), n) < 0.01);
            }
            // 3.3 sigma of a share of 1 %
            let band = 3.3 * (0.01 * 0.99 * count as f64).sqrt();
            assert!((own as f64 - 0.01 * count as f64).abs() < band, "{own} of {count} at {n}");
            assert!(plain as f64 > 0.01 * count as f64 + band, "{plain} of {count} at {n}");
        }
    }

    #[test]
    fn correlated_series_are_correlated() {
        let mut noise = Noise::new(11, 0);
        let mut x = 0.0;
        let series: Vec<f64> = (0..200)
            .map(|_| {
                x = 0.8 * x + noise.normal();
                x
            })
            .collect();
        assert!(whiteness(&series).is_some_and(|p| p < 1e-9));
        assert_eq!(whiteness(&series[..39]), None);
    }
}
