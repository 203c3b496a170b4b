//! Noise coefficients from overlapping Allan variances: white noise N, flicker noise B, random walk K, by
//! generalised least squares.
//!
//! `sigma^2(tau) = N^2/tau + (2 ln 2/pi) B^2 + K^2 tau/3` (IEEE Std 952-1997, C.1) is linear in the squares
//! of the coefficients. Estimates at different cluster times are means of squares of overlapping second
//! differences of the summed samples, so they depend on each other. These differences are stationary and
//! normal: their covariances follow from a generalised autocovariance of the sums, `-|t|/2`, `t^2 ln|t|/(2
//! pi)` and `|t|^3/12` for the three noises, and the covariance of two variances is twice the mean of
//! the squared covariances over all pairs (Greenhall, Riley 2003, *Uncertainty of stability variances
//! based on finite differences*). Weights, sigmas and degrees of freedom thus follow from the fitted
//! noise, without rules of thumb.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::consistency::{chi_square_band, chi_square_tail};
use crate::error::EkfError;

/// Noises of a sensor that an Allan deviation distinguishes, in the order of [`NoiseFit::terms`].
pub const TERMS: usize = 3;
/// Score above which a noise is resolved: its squared coefficient in standard deviations, as these are
/// without the noise.
pub(crate) const RESOLVED: f64 = 3.0;
/// Probability that an unresolved coefficient lies below its limit.
pub const LIMIT: f64 = 0.95;
/// Quantile of the unit normal distribution at [`LIMIT`].
const LIMIT_SIGMAS: f64 = 1.644_853_626_951_472_2;
/// Number of lags per cluster in the sums over lags; covariances are smooth in between.
const PER_CLUSTER: usize = 16;
/// Largest number of lags per cluster of the larger size. Where the sizes are farther apart, the covariance
/// of white noise is sampled too coarsely, but it is negligible; that of a random walk is smooth over the
/// larger cluster, and without it the matrix of many sizes would not be positive definite.
const MOST_PER_CLUSTER: usize = 4096;
/// Fractions by which covariances between sizes are reduced, in turn, until their matrix is positive
/// definite.
const REDUCED: [f64; 4] = [0.0, 1e-3, 1e-2, 1e-1];
/// Largest number of passes over the weights.
const PASSES: usize = 60;
/// Largest number of doublings of a squared coefficient in search of its limit, and of halvings of the
/// interval of the limit.
const DOUBLINGS: usize = 20;
const HALVINGS: usize = 30;
/// Relative change of the squared coefficients below which the weights have converged.
const SETTLED: f64 = 1e-9;

/// Overlapping Allan variance at one cluster size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AllanPoint {
    /// Number of samples of a cluster.
    pub samples: usize,
    /// Variance, in the square of the unit of the samples.
    pub variance: f64,
}

/// Overlapping Allan variance at clusters of `m` samples: all differences within stretches of evenly
/// spaced samples, with gaps between stretches. `None` if no stretch has 2m samples.
pub fn overlapping_variance(stretches: &[Vec<f64>], m: usize) -> Option<AllanPoint> {
    let (mut total, mut count) = (0.0, 0);
    for rates in stretches.iter().filter(|s| m > 0 && s.len() >= 2 * m) {
        // sums of the differences from the first sample: a common offset costs no digits
        let mut theta = Vec::with_capacity(rates.len() + 1);
        let mut sum = 0.0;
        theta.push(sum);
        for rate in rates {
            sum += rate - rates[0];
            theta.push(sum);
        }
        let differences = rates.len() - 2 * m + 1;
        total +=
            (0..differences).map(|k| (theta[k + 2 * m] - 2.0 * theta[k + m] + theta[k]).powi(2)).sum::<f64>();
        count += differences;
    }
    let m2 = (m as f64).powi(2);
    (count > 0).then(|| AllanPoint { samples: m, variance: total / (2.0 * m2 * count as f64) })
}

/// Allan variance of each noise at clusters of m samples, for a squared coefficient of one in samples.
fn shapes(m: usize) -> [f64; TERMS] {
    let m = m as f64;
    [1.0 / m, 2.0 * std::f64::consts::LN_2 / std::f64::consts::PI, m / 3.0]
}

/// Covariances of the second differences at clusters of `m` and `other` samples, `lag` samples apart, for
/// each noise.
fn covariances(m: usize, other: usize, lag: i64) -> [f64; TERMS] {
    const WEIGHTS: [f64; 3] = [1.0, -2.0, 1.0];
    let mut out = [0.0; TERMS];
    for (i, a) in WEIGHTS.iter().enumerate() {
        for (j, b) in WEIGHTS.iter().enumerate() {
            let t = (lag + (j * other) as i64 - (i * m) as i64).unsigned_abs() as f64;
            let k = a * b;
            out[0] -= k * t / 2.0;
            if t > 1.0 {
                out[1] += k * t * t * t.ln() / std::f64::consts::TAU;
            }
            out[2] += k * t * t * t / 12.0;
        }
    }
    out
}

/// Sums from which the covariance of the variances at two cluster sizes follows: for squared coefficients x
/// it is `sum_ab x_a x_b S_ab`.
fn pair(lengths: &[usize], m: usize, other: usize) -> [[f64; TERMS]; TERMS] {
    let mut out = [[0.0; TERMS]; TERMS];
    let differences = |n: usize, m: usize| (n + 1).saturating_sub(2 * m) as i64;
    let count: f64 =
        [m, other].map(|m| lengths.iter().map(|&n| differences(n, m)).sum::<i64>() as f64).iter().product();
    if count == 0.0 {
        return out;
    }
    let stride = (m.min(other) / PER_CLUSTER).max(m.max(other) / MOST_PER_CLUSTER).max(1);
    let wide = 4 * m.max(other) as i64;
    let (first, last) = (-2 * other as i64 - wide, 2 * m as i64 + wide);
    for lag in (first..=last).step_by(stride) {
        let pairs = |&n: &usize| {
            let (own, others) = (differences(n, m), differences(n, other));
            (own.min(others - lag) - 0.max(-lag)).max(0)
        };
        let pairs = lengths.iter().map(pairs).sum::<i64>();
        if pairs == 0 {
            continue;
        }
        let c = covariances(m, other, lag);
        for (row, a) in out.iter_mut().zip(c) {
            row.iter_mut().zip(c).for_each(|(s, b)| *s += pairs as f64 * a * b);
        }
    }
    let scale = stride as f64 / (2.0 * (m as f64 * other as f64).powi(2) * count);
    out.iter_mut().flatten().for_each(|s| *s *= scale);
    out
}

/// Coefficient of a noise that a record resolves, in the unit of the samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResolvedNoise {
    /// Coefficient of the noise.
    pub value: f64,
    /// Standard deviation of the coefficient.
    pub sigma: f64,
}

/// Fit of one noise. Coefficients are in the unit of the samples, with times in samples: N for the mean
/// over one sample, K for the step from one sample to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TermFit {
    /// Coefficient and its standard deviation; `None` where it is not resolved.
    pub found: Option<ResolvedNoise>,
    /// Upper limit: the coefficient lies below it with probability [`LIMIT`].
    pub limit: f64,
    /// Smallest coefficient that this record resolves beside the noises that it has.
    pub least: f64,
}

/// Allan deviation beside the fitted one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedPoint {
    /// Number of samples of a cluster.
    pub samples: usize,
    /// Deviation, in the unit of the samples.
    pub deviation: f64,
    /// Lower end of the confidence band of the deviation.
    pub low: f64,
    /// Upper end of the confidence band of the deviation.
    pub high: f64,
    /// Degrees of freedom of the variance for the fitted noise.
    pub degrees_of_freedom: f64,
    /// Deviation of the fitted noise.
    pub fitted: f64,
}

/// Fit of the noise coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseFit {
    /// White noise, flicker noise, random walk.
    pub terms: [TermFit; TERMS],
    /// Fitted deviations, by cluster size.
    pub points: Vec<FittedPoint>,
    /// Sum of squared residuals by the covariance of the variances.
    pub chi_square: f64,
    /// Degrees of freedom of that sum.
    pub degrees_of_freedom: usize,
    /// Probability of a larger sum for noise of these three kinds alone.
    pub probability: f64,
}

/// Allan variances with the sums from which their covariances follow.
struct FitProblem<'a> {
    points: &'a [AllanPoint],
    pairs: Vec<[[f64; TERMS]; TERMS]>,
}

/// Squared coefficients and their covariance (zero for noises that were left out).
struct AllanSolution {
    x: [f64; TERMS],
    covariance: DMatrix<f64>,
    left: f64,
}

impl FitProblem<'_> {
    /// Covariance of the variances for squared coefficients `x`.
    fn covariance(&self, x: &[f64; TERMS]) -> DMatrix<f64> {
        let n = self.points.len();
        DMatrix::from_fn(n, n, |i, j| {
            let s = &self.pairs[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)];
            (0..TERMS).map(|a| (0..TERMS).map(|b| x[a] * x[b] * s[a][b]).sum::<f64>()).sum()
        })
    }

    /// Least squares for the noises `kept` with weights by squared coefficients `by`.
    fn solve(&self, kept: &[usize], by: &[f64; TERMS]) -> Option<AllanSolution> {
        let n = self.points.len();
        let covariance = self.covariance(&by.map(|x| x.max(0.0)));
        let reduced = |part: &f64| {
            let entry = |i, j| covariance[(i, j)] * if i == j { 1.0 } else { 1.0 - part };
            Cholesky::new(DMatrix::from_fn(n, n, entry))
        };
        let root = REDUCED.iter().find_map(reduced)?.l();
        let design = DMatrix::from_fn(n, kept.len(), |i, j| shapes(self.points[i].samples)[kept[j]]);
        let y = DVector::from_iterator(n, self.points.iter().map(|p| p.variance));
        let (a, b) = (root.solve_lower_triangular(&design)?, root.solve_lower_triangular(&y)?);
        // columns of about unit length, against rounding
        let scale: Vec<f64> = a.column_iter().map(|c| c.norm()).collect();
        let scaled = DMatrix::from_fn(n, kept.len(), |i, j| a[(i, j)] / scale[j]);
        let inverse = (scaled.transpose() * &scaled).try_inverse()?;
        let found = &inverse * (scaled.transpose() * &b);
        let left = (&b - &scaled * &found).norm_squared();
        let mut out = AllanSolution { x: [0.0; TERMS], covariance: DMatrix::zeros(TERMS, TERMS), left };
        for (i, &k) in kept.iter().enumerate() {
            out.x[k] = found[i] / scale[i];
            for (j, &l) in kept.iter().enumerate() {
                out.covariance[(k, l)] = inverse[(i, j)] / scale[i] / scale[j];
            }
        }
        Some(out)
    }

    /// Least squares as [`Self::solve`], with weights from its own solution.
    fn settle(&self, kept: &[usize]) -> Option<AllanSolution> {
        let mut by = [0.0; TERMS];
        // initial weights: each noise as large as it can be alone
        for &k in kept {
            let each = self.points.iter().map(|p| p.variance / shapes(p.samples)[k]);
            by[k] = each.fold(f64::INFINITY, f64::min);
        }
        let mut out = self.solve(kept, &by)?;
        for _ in 0..PASSES {
            let change = by.iter().zip(&out.x).map(|(a, b)| (a - b.max(0.0)).abs() / (a + b.abs() + 1e-300));
            let settled = change.fold(0.0, f64::max) <= SETTLED;
            // mean with the previous weights, which prevents oscillation
            by = std::array::from_fn(|k| (by[k] + out.x[k].max(0.0)) / 2.0);
            out = self.solve(kept, &by)?;
            if settled {
                break;
            }
        }
        Some(out)
    }

    /// Noises `others` and `k`, in order.
    fn with(others: &[usize], k: usize) -> Vec<usize> {
        let mut all = others.to_vec();
        all.push(k);
        all.sort_unstable();
        all
    }

    /// Squared coefficient of `k` in standard deviations, both by the weights of a fit of the other
    /// noises `kept`: a score test of the absence of `k`. Standard deviations by its own weights grow
    /// with the coefficient, so a noise that few clusters show would never be significant. Infinite if
    /// the others fit nothing.
    fn test(&self, kept: &[usize], k: usize) -> f64 {
        let others: Vec<usize> = kept.iter().copied().filter(|&l| l != k).collect();
        let found = self.settle(&others).and_then(|o| self.solve(kept, &o.x.map(|x| x.max(0.0))));
        found.map_or(f64::INFINITY, |f| f.x[k] / f.covariance[(k, k)].sqrt())
    }

    /// Standard deviation of the squared coefficient of `k` if only the noises `others` are present,
    /// with the coefficients of `solved`.
    fn without(&self, others: &[usize], solved: &AllanSolution, k: usize) -> Option<f64> {
        let mut by = solved.x;
        by[k] = 0.0;
        // without others, the noise itself gives the weights
        let by = if others.is_empty() { solved.x } else { by };
        Some(self.solve(&Self::with(others, k), &by)?.covariance[(k, k)].sqrt())
    }

    /// The squared coefficient that would give an estimate as small as the one found, or a smaller one, with
    /// probability 1 - [`LIMIT`]: estimate and standard deviation are those by its own weights (Neyman). The
    /// estimate is skewed to the right, so the normal quantile is on the safe side. An estimate below zero
    /// counts as zero: chance would else give limits far below what the record resolves.
    fn limit(&self, others: &[usize], solved: &AllanSolution, k: usize) -> Option<f64> {
        let all = Self::with(others, k);
        let beyond = |x: f64| -> Option<bool> {
            let mut by = solved.x;
            by[k] = x;
            let own = self.solve(&all, &by)?;
            Some(own.x[k].max(0.0) + LIMIT_SIGMAS * own.covariance[(k, k)].sqrt() > x)
        };
        let (mut low, mut high) = (0.0, self.without(others, solved, k)?.max(solved.x[k]));
        for _ in 0..DOUBLINGS {
            if !beyond(high)? {
                break;
            }
            (low, high) = (high, 2.0 * high);
        }
        for _ in 0..HALVINGS {
            let middle = (low + high) / 2.0;
            if beyond(middle)? { low = middle } else { high = middle }
        }
        Some(high)
    }
}

/// Fits noise to Allan variances of stretches of `lengths` samples. Each band contains its deviation
/// with probability `confidence`. Unresolved noises are removed one after the other, the least
/// significant first.
///
/// # Errors
/// [`EkfError::Shape`] for too few variances: at least one more than noises; [`EkfError::NotFinite`] if
/// their covariance is singular, as for constant samples.
pub fn fit(points: &[AllanPoint], lengths: &[usize], confidence: f64) -> Result<NoiseFit, EkfError> {
    let n = points.len();
    if n < TERMS + 1 {
        return Err(EkfError::Shape { what: "Allan variances", expected: (1, TERMS + 1), found: (1, n) });
    }
    let pairs = (0..n).flat_map(|i| (0..=i).map(move |j| (i, j)));
    let pairs = pairs.map(|(i, j)| pair(lengths, points[i].samples, points[j].samples)).collect();
    let fitting = FitProblem { points, pairs };
    let none =
        || EkfError::NotFinite { what: "the Allan variances", value: points[0].variance, row: 0, column: 0 };
    let mut kept: Vec<usize> = (0..TERMS).collect();
    while kept.len() > 1 {
        let tests: Vec<f64> = kept.iter().map(|&k| fitting.test(&kept, k)).collect();
        let least = (0..kept.len()).min_by(|&a, &b| tests[a].total_cmp(&tests[b]));
        let Some(least) = least.filter(|&i| tests[i] < RESOLVED) else { break };
        kept.remove(least);
    }
    let solved = fitting.settle(&kept).ok_or_else(none)?;
    let term = |k: usize| -> Option<TermFit> {
        let resolved = kept.contains(&k);
        let others: Vec<usize> = kept.iter().copied().filter(|&l| l != k).collect();
        let (x, sigma) = (solved.x[k], solved.covariance[(k, k)].sqrt());
        Some(TermFit {
            found: resolved.then(|| ResolvedNoise { value: x.sqrt(), sigma: sigma / (2.0 * x.sqrt()) }),
            limit: fitting.limit(&others, &solved, k)?.sqrt(),
            least: (RESOLVED * fitting.without(&others, &solved, k)?).sqrt(),
        })
    };
    let terms = [term(0).ok_or_else(none)?, term(1).ok_or_else(none)?, term(2).ok_or_else(none)?];
    let x = solved.x.map(|x| x.max(0.0));
    let covariance = fitting.covariance(&x);
    let point = |(i, p): (usize, &AllanPoint)| {
        let model: f64 = shapes(p.samples).iter().zip(&x).map(|(s, x)| s * x).sum();
        let dof = 2.0 * model * model / covariance[(i, i)];
        let (low, high) = chi_square_band(dof, 1.0, confidence);
        FittedPoint {
            samples: p.samples,
            deviation: p.variance.sqrt(),
            low: (p.variance * dof / high).sqrt(),
            high: (p.variance * dof / low).sqrt(),
            degrees_of_freedom: dof,
            fitted: model.sqrt(),
        }
    };
    let degrees_of_freedom = n - kept.len();
    Ok(NoiseFit {
        terms,
        points: points.iter().enumerate().map(point).collect(),
        chi_square: solved.left,
        degrees_of_freedom,
        probability: chi_square_tail(degrees_of_freedom as f64, solved.left),
    })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// Figures of allantools, with their origin.
    const FIGURES: &str = include_str!("../tests/data/allantools.csv");

    /// Series `white`, `flicker` or `walk` of these figures.
    fn series(name: &str) -> Vec<f64> {
        let next = |n: &u64| Some(16807 * n % 2_147_483_647);
        let numbers = std::iter::successors(Some(1_234_567_890_u64), next).take(1000);
        let white: Vec<f64> = numbers.map(|n| n as f64 / 2_147_483_647.0 - 0.5).collect();
        let walk = white.iter().scan(0.0, |sum, x| {
            *sum += x;
            Some(*sum)
        });
        let mut h = vec![1.0];
        (1..1000).for_each(|k| h.push(h[k - 1] * (k as f64 - 0.5) / k as f64));
        let flicker = (0..1000).map(|i| (0..=i).map(|k| h[k] * white[i - k]).sum());
        match name {
            "white" => white,
            "walk" => walk.collect(),
            _ => flicker.collect(),
        }
    }

    #[test]
    fn deviations_and_bands_are_those_of_allantools() {
        let mut lines = 0;
        for line in FIGURES.lines().filter(|l| !l.starts_with('#')).skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            let number = |i: usize| cells[i].parse::<f64>().expect("a number");
            let m = number(1) as usize;
            let found = overlapping_variance(&[series(cells[0])], m).expect("long enough").variance.sqrt();
            assert!((found / number(2) - 1.0).abs() < 1e-9, "{line}: {found}");
            let (low, high) = chi_square_band(number(3), 1.0, 0.95);
            let band = [(found * found * number(3) / high).sqrt(), (found * found * number(3) / low).sqrt()];
            assert!(
                (band[0] / number(4) - 1.0).abs() < 1e-6 && (band[1] / number(5) - 1.0).abs() < 1e-6,
                "{line}"
            );
            // its degrees of freedom are approximate, and poor for short clusters: 782 for white noise
            // and m = 1, where 666 are right
            if m >= 16 {
                let which = ["white", "flicker", "walk"].iter().position(|n| *n == cells[0]).expect("there");
                let model = shapes(m)[which];
                let own = 2.0 * model * model / pair(&[1000], m, m)[which][which];
                assert!((own / number(3) - 1.0).abs() < 0.06, "{line}: {own}");
            }
            lines += 1;
        }
        assert_eq!(lines, 24);
    }

    /// White noise and a random walk of 20,000 and 100,000 samples: sizes up to 4096 times apart, whose
    /// covariances make a positive definite matrix.
    #[test]
    fn long_records_are_fitted() {
        for (n, walk) in [(20_000, 0.1), (100_000, 0.01), (100_000, 1.0)] {
            let mut random = Pcg64Mcg::seed_from_u64(n as u64);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let mut bias = 0.0;
            // means over each sample of a continuous walk W: the integral of W over the unit interval has the
            // variance 1/3 and the covariance 1/2 with W(1)
            let samples: Vec<f64> = (0..n)
                .map(|_| {
                    let (step, rest) = (normal(), normal());
                    let mean = bias + walk * (step / 2.0 + rest / 12f64.sqrt());
                    bias += walk * step;
                    mean + normal()
                })
                .collect();
            let sizes = (0..).map(|k| 1 << k).take_while(|m| 4 * m <= n);
            let stretches = [samples];
            let points: Vec<AllanPoint> =
                sizes.map(|m| overlapping_variance(&stretches, m).expect("long enough")).collect();
            let found = fit(&points, &[n], 0.95).expect("a fit");
            for (term, truth) in [(0, 1.0), (2, walk)] {
                let ResolvedNoise { value: x, sigma } = found.terms[term].found.expect("resolved");
                assert!((x - truth).abs() < 4.0 * sigma && sigma < 0.2 * truth, "{n} {term}: {x} {sigma}");
            }
        }
    }

    /// Degrees of freedom of white noise at clusters of one sample: (3 (N - 1)/2 - 2 (N - 2)/N) 4/9 for N =
    /// 1001 (NIST SP 1065, table 5).
    #[test]
    fn degrees_of_freedom_of_white_noise() {
        let own = 2.0 / pair(&[1000], 1, 1)[0][0];
        assert!((own - 665.8).abs() < 1.0, "{own}");
    }

    /// White noise and a random walk in many records: errors are as large as their sigmas, and flicker
    /// noise is seldom resolved where there is none (it may replace an unresolved random walk).
    #[test]
    fn sigmas_are_true() {
        let (records, samples, walk) = (60, 4096, 0.1);
        let (mut squares, mut flicker, mut chi, mut dof) = ([0.0; 2], 0, 0.0, 0);
        let mut unresolved = 0;
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        for _ in 0..records {
            let mut bias = 0.0;
            let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
            let rates: Vec<f64> = (0..samples)
                .map(|_| {
                    bias += walk * normal();
                    bias + normal()
                })
                .collect();
            let all = [rates];
            let points: Vec<AllanPoint> =
                (0..10).filter_map(|k| overlapping_variance(&all, 1 << k)).collect();
            let found = fit(&points, &[samples], 0.95).expect("a fit");
            for ((k, truth), sum) in [(0, 1.0), (2, walk)].into_iter().zip(&mut squares) {
                let Some(ResolvedNoise { value: x, sigma }) = found.terms[k].found else {
                    unresolved += 1;
                    continue;
                };
                *sum += ((x - truth) / sigma).powi(2) / f64::from(records);
            }
            flicker += u32::from(found.terms[1].found.is_some());
            chi += found.chi_square;
            dof += found.degrees_of_freedom;
        }
        // mean squares of 60 errors in sigma, and of all residuals: within their bands of 99.9 %
        let (low, high) = chi_square_band(1.0, f64::from(records), 0.999);
        assert!(squares.iter().all(|s| (low..=high).contains(s)), "{squares:?} {low} {high}");
        let (low, high) = chi_square_band(1.0, dof as f64, 0.999);
        let chi = chi / dof as f64;
        assert!((low..=high).contains(&chi), "{chi} {low} {high}");
        // one in 740 squares is more than three sigma above zero: three of 60 have a probability of 1e-4
        assert!(flicker < 3 && unresolved == 0, "{flicker} {unresolved}");
    }

    /// Limits of random walks that a record seldom or never resolves, and of none. A limit of 95 %
    /// fails in at most 5 % of all records for any walk: in at most 20 of 200 (binomial, normal
    /// approximation of 99.9 %: 10 + 3.29 sqrt(200 0.05 0.95)). Without a walk, one is resolved with a
    /// probability of 1 in 740: at most 3 of 200 (Poisson with mean 0.27, 99.98 %). Walks of 0.02 were
    /// resolved in 391 of 400 other records.
    #[test]
    fn limits_hold_as_often_as_they_say() {
        let (records, samples) = (200, 4096);
        let mut rng = Pcg64Mcg::seed_from_u64(11);
        for (walk, least) in [(0.05, 199), (0.02, 185), (0.01, 0), (0.003, 0), (0.0, 0)] {
            let (mut fail, mut resolved, mut flicker) = (0, 0, 0);
            for _ in 0..records {
                let mut bias = 0.0;
                let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
                let mut next = || {
                    bias += walk * normal();
                    bias + normal()
                };
                let all = [(0..samples).map(|_| next()).collect::<Vec<f64>>()];
                let points: Vec<AllanPoint> =
                    (0..10).filter_map(|k| overlapping_variance(&all, 1 << k)).collect();
                let found = fit(&points, &[samples], 0.95).expect("a fit");
                let term = &found.terms[2];
                fail += u32::from(term.limit < walk);
                // 1.645 of 3 standard deviations of the square
                assert!(term.limit > 0.73 * term.least, "{} {}", term.limit, term.least);
                resolved += u32::from(found.terms[2].found.is_some());
                flicker += u32::from(found.terms[1].found.is_some());
            }
            assert!(fail <= 20 && resolved >= least, "{walk}: {fail} {resolved}");
            assert!(walk > 0.0 || resolved.max(flicker) <= 3, "{resolved} {flicker}");
        }
    }

    /// Two stretches with a gap between them are pooled; a constant contains no noise.
    #[test]
    fn stretches_are_pooled() {
        let white = series("white");
        let halves = [white[..500].to_vec(), white[500..].to_vec()];
        let each =
            |s: &Vec<f64>| overlapping_variance(std::slice::from_ref(s), 4).expect("long enough").variance;
        let both = overlapping_variance(&halves, 4).expect("long enough").variance;
        assert!((both - (each(&halves[0]) + each(&halves[1])) / 2.0).abs() < 1e-12);
        assert_eq!(overlapping_variance(&halves, 251), None);
        let flat = [vec![2.0; 500]];
        let points: Vec<AllanPoint> = (0..6).filter_map(|k| overlapping_variance(&flat, 1 << k)).collect();
        assert!(fit(&points, &[500], 0.95).is_err());
    }
}
