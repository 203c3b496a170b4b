//! Correlated noise of Z: the bias process b of each accelerometer beside its white noise, over waits
//! and dwells.

use std::ops::Range;

use nalgebra::{DMatrix, Matrix3 as Small};
use obsdeg_core::model::{AZIMUTH, LOCAL};
use obsdeg_ekf::BiasState;

use crate::design::measure::elimination::eliminate;

/// Size of the information of a dwell: local unknowns, b at its start, b at its end.
const SIZE: usize = LOCAL + 6;
/// Size with one more b: that of the previous sample, or the mean of b at the start.
pub(crate) const STEP: usize = SIZE + 3;

/// Information of a dwell on its local unknowns, b at its start and b at its end, in n (lower
/// triangle).
pub(crate) type DwellInformation = [[f64; SIZE]; SIZE];

/// Distribution of b given the unknowns, in platform axes.
#[derive(Debug, Clone)]
pub(crate) struct BiasDistribution {
    /// Covariance in g^2 (3 x 3).
    pub(crate) covariance: Small<f64>,
    /// Mean as a functional of the unknowns (3 x n).
    pub(crate) mean: [Vec<f64>; 3],
}

/// Propagation of the process over `seconds`: the factor on b, and the variance of its increment.
fn step(bias: &BiasState, seconds: f64) -> (f64, f64) {
    let x = bias.decay * seconds;
    ((-x).exp(), bias.variance * -(-2.0 * x).exp_m1())
}

impl BiasDistribution {
    /// Stationary distribution, before any sample (n unknowns).
    pub(crate) fn start(bias: &BiasState, n: usize) -> Self {
        Self { covariance: Small::identity() * bias.variance, mean: std::array::from_fn(|_| vec![0.0; n]) }
    }

    /// Distribution after `seconds` without samples, then in other axes.
    pub(crate) fn wait(&self, bias: &BiasState, seconds: f64, axes: &Small<f64>) -> Self {
        let (left, variance) = step(bias, seconds);
        let covariance = self.covariance * (left * left) + Small::identity() * variance;
        Self { covariance: axes * covariance * axes.transpose(), mean: times(&(axes * left), &self.mean) }
    }
}

/// Product `A X` (3 x n).
pub(crate) fn times(a: &Small<f64>, x: &[Vec<f64>; 3]) -> [Vec<f64>; 3] {
    let n = x[0].len();
    std::array::from_fn(|r| (0..n).map(|j| (0..3).map(|k| a[(r, k)] * x[k][j]).sum()).collect())
}

/// Component of Z in n: its index, its row on the local unknowns, and the weight of a sample (1 /
/// variance).
pub(crate) struct ObservedComponent {
    pub(crate) component: usize,
    pub(crate) row: [f64; LOCAL],
    pub(crate) weight: f64,
}

/// Information of the samples `counted` of a dwell, `dt` s apart, where the noise of Z is correlated;
/// `transition` is that of the local unknowns from sample to sample.
pub(crate) fn of_dwell(
    outputs: &[ObservedComponent],
    bias: &BiasState,
    transition: &DMatrix<f64>,
    counted: Range<usize>,
    dt: f64,
) -> DwellInformation {
    let (left, variance) = step(bias, dt);
    let mut now: DMatrix<f64> = DMatrix::identity(LOCAL, LOCAL);
    // order: b of the previous sample, local unknowns, b at the start, b of this sample
    let mut all = [[0.0; STEP]; STEP];
    for k in 0..counted.end {
        now = transition * now;
        // for the first sample, b of the previous one is b at the start
        let before = if k == 0 { 3 + LOCAL } else { 0 };
        for axis in 0..3 {
            let (b, c) = (before + axis, 6 + LOCAL + axis);
            all[b][b] += left * left / variance;
            all[c][b] -= left / variance;
            all[c][c] += 1.0 / variance;
        }
        eliminate(&mut all, STEP, if k == 0 { 0..0 } else { 0..3 });
        for ObservedComponent { component, row: h, weight } in outputs.iter().filter(|_| k >= counted.start) {
            let mut row = [0.0; STEP];
            for (j, x) in row[3..3 + LOCAL].iter_mut().enumerate() {
                *x = (0..LOCAL).map(|i| h[i] * now[(i, j)]).sum();
            }
            if *component != AZIMUTH {
                row[6 + LOCAL + component - 1] = 1.0;
            }
            for i in 0..STEP {
                for j in 0..=i {
                    all[i][j] += weight * row[i] * row[j];
                }
            }
        }
        if k + 1 < counted.end {
            // b of this sample becomes that of the previous one
            let from = |i: usize| if i < 3 { 6 + LOCAL + i } else { i };
            let gone = |i: usize| i >= 6 + LOCAL;
            let held = all;
            all = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let (a, b) = (from(i), from(j));
                    if gone(i) || gone(j) { 0.0 } else { held[a.max(b)][a.min(b)] }
                })
            });
        }
    }
    std::array::from_fn(|i| std::array::from_fn(|j| all[i + 3][j + 3]))
}
