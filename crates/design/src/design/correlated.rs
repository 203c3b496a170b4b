//! Noise of Z that is correlated: each accelerometer has a bias that is a Gauss-Markov process beside its white noise, and that goes on
//! in platform axes from position to position. Three alike and independent ones are so in any axes.
//!
//! The bias b of the moment is a state that no coefficient depends on. Given the unknowns x it has a mean `K x` and a covariance that knows nothing of
//! them, so a sequence keeps these two beside the information on x. Of a dwell the information on its local unknowns, b at its start and b at its end holds
//! all that samples and the process say, what b was in between eliminated: it is computed once, sample by sample. Putting a position behind others
//! adds what is left of that when b at the start, up to its mean, and b at the end are eliminated: information only grows, and nothing large
//! is subtracted from it.
//!
//! So information is no sum over positions, under no carry, and order matters: bounds that rest on such a sum do not hold here.

use nalgebra::{DMatrix, Matrix3 as Small};
use obsdeg_core::model::{AZIMUTH, Carry, Float, LOCAL, local_output};
use obsdeg_ekf::BiasState;
use obsdeg_evidence::simulation::Plan;

use super::information::{Evaluator, MAX, State, eliminate};
use super::ways::Stop;

/// Local unknowns, b at the start of a dwell, b at its end.
const SIZE: usize = LOCAL + 6;
/// With one b more: that of the sample before, or the mean of the one at the start.
const STEP: usize = SIZE + 3;

/// The information of a dwell on its local unknowns, b at its start and b at its end, in n (lower triangle).
pub(super) type OfDwell = [[f64; SIZE]; SIZE];

/// What is known of b given the unknowns, in platform axes.
#[derive(Debug, Clone)]
pub(super) struct Joint {
    /// Its covariance, in g^2 (3 x 3).
    covariance: Small<f64>,
    /// Its mean as a functional of the unknowns (3 x n).
    mean: [Vec<f64>; 3],
}

/// What of a process goes on over `seconds`: the factor on b, and the variance that comes anew.
fn step(bias: &BiasState, seconds: f64) -> (f64, f64) {
    let x = bias.decay * seconds;
    ((-x).exp(), bias.variance * -(-2.0 * x).exp_m1())
}

impl Joint {
    /// Where nothing has been measured (n unknowns).
    pub(super) fn start(bias: &BiasState, n: usize) -> Self {
        Self { covariance: Small::identity() * bias.variance, mean: std::array::from_fn(|_| vec![0.0; n]) }
    }

    /// Over a time without samples, then in other axes.
    fn wait(&self, bias: &BiasState, seconds: f64, axes: &Small<f64>) -> Self {
        let (left, variance) = step(bias, seconds);
        let covariance = self.covariance * (left * left) + Small::identity() * variance;
        Self { covariance: axes * covariance * axes.transpose(), mean: times(&(axes * left), &self.mean) }
    }
}

/// `A X` (3 x n).
fn times(a: &Small<f64>, x: &[Vec<f64>; 3]) -> [Vec<f64>; 3] {
    let n = x[0].len();
    std::array::from_fn(|r| (0..n).map(|j| (0..3).map(|k| a[(r, k)] * x[k][j]).sum()).collect())
}

impl Evaluator {
    /// What the samples of a dwell say where the noise of Z is correlated; `transition` is that of the local unknowns from sample to sample.
    pub(super) fn of_dwell(
        &self,
        bias: &BiasState,
        transition: &DMatrix<f64>,
        steps: usize,
        dt: f64,
    ) -> OfDwell {
        let (left, variance) = step(bias, dt);
        let outputs = local_output(&Float, self.platform.observed());
        let mut now: DMatrix<f64> = DMatrix::identity(LOCAL, LOCAL);
        // b of the sample before, local unknowns, b at the start, b of this sample
        let mut all = [[0.0; STEP]; STEP];
        for k in 0..steps {
            now = transition * now;
            // b of the sample before is b at the start, first
            let before = if k == 0 { 3 + LOCAL } else { 0 };
            for axis in 0..3 {
                let (b, c) = (before + axis, 6 + LOCAL + axis);
                all[b][b] += left * left / variance;
                all[c][b] -= left / variance;
                all[c][c] += 1.0 / variance;
            }
            eliminate(&mut all, STEP, if k == 0 { 0..0 } else { 0..3 });
            for (component, h) in &outputs {
                let weight = 1.0 / Plan::output_sigma(*component, &self.conditions).powi(2);
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
            if k + 1 < steps {
                // b of this sample becomes that of the one before
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

    /// Adds a position to `state`. Under reset carry its psi is eliminated, or where it is `kept` stands in the place of psi among the
    /// unknowns.
    pub(super) fn extend_correlated(
        &self,
        bias: &BiasState,
        state: &State,
        stop: Stop,
        kept: bool,
        out: &mut State,
    ) {
        let n = self.n;
        let reset = self.carry() == Carry::Reset;
        let seconds = self.way_to(state.path.last().copied(), stop).map_or(0.0, |t| t.seconds);
        let (c, dwelling) = self.stands(stop.candidate);
        let Some(of_dwell) = &dwelling.correlated else { return };
        // b^n = C b
        let axes = Small::from_fn(|i, j| c[i][j]);
        let before = match &state.joint {
            Some(joint) => joint.wait(bias, seconds, &axes),
            None => Joint::start(bias, n),
        };
        // b at the start up to its mean, psi where it is of this position alone, b at the end; the rest of the local unknowns, and the mean
        let alone = reset && !kept;
        let (psi, end) = if alone { (3, 6) } else { (6, 3) };
        let mean = STEP - 3;
        let place = |i: usize| match i {
            0..3 => psi + i,
            3..LOCAL => 6 + i,
            _ if i < LOCAL + 3 => i - LOCAL,
            _ => end + i - LOCAL - 3,
        };
        let mut all = [[0.0; STEP]; STEP];
        let mut add = |i: usize, j: usize, x: f64| all[i.max(j)][i.min(j)] += x;
        let is_start = |i: usize| (LOCAL..LOCAL + 3).contains(&i);
        for (i, row) in of_dwell.iter().enumerate() {
            for (j, &x) in row[..=i].iter().enumerate() {
                add(place(i), place(j), x);
                // the mean is there wherever b at the start is
                match (is_start(i), is_start(j)) {
                    (true, true) => {
                        add(mean + i - LOCAL, mean + j - LOCAL, x);
                        add(mean + i - LOCAL, place(j), x);
                        if i != j {
                            add(mean + j - LOCAL, place(i), x);
                        }
                    }
                    (true, false) => add(mean + i - LOCAL, place(j), x),
                    (false, true) => add(mean + j - LOCAL, place(i), x),
                    (false, false) => {}
                }
            }
        }
        let inverse = before.covariance.try_inverse().unwrap_or_else(Small::zeros);
        (0..3).for_each(|i| (0..=i).for_each(|j| add(i, j, inverse[(i, j)])));
        if alone {
            for (i, j) in [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)] {
                let known = self.prior.psi.iter().enumerate().map(|(k, p)| c[i][k] * p * c[j][k]);
                add(psi + i, psi + j, known.sum());
            }
        }
        // all but b and psi alone as functionals of the unknowns
        let mut local = self.functionals::<LOCAL, MAX>(state, stop);
        if kept {
            (0..3).for_each(|r| local[r][..3].copy_from_slice(&c[r]));
        }
        let mut rows = vec![[0.0; MAX]; STEP];
        let first = if alone { 3 } else { 0 };
        (first..LOCAL).for_each(|i| rows[place(i)] = local[i]);
        (0..3).for_each(|r| rows[mean + r][..n].copy_from_slice(&before.mean[r]));
        eliminate(&mut all, STEP, 0..end);
        let own = Small::from_fn(|i, j| all[end + i.max(j)][end + i.min(j)]);
        let covariance = own.try_inverse().unwrap_or_else(Small::zeros);
        let through: [Vec<f64>; 3] = std::array::from_fn(|r| {
            let mut sum = vec![0.0; n];
            for (i, row) in rows.iter().enumerate().skip(end + 3) {
                sum.iter_mut().zip(row).for_each(|(s, x)| *s -= all[i][end + r] * x);
            }
            sum
        });
        eliminate(&mut all, STEP, end..end + 3);
        out.information.copy_from_slice(&state.information);
        self.know_first(state, c, |i, j, known| out.information[i * n + j] += known);
        if kept {
            self.prior.psi.iter().enumerate().for_each(|(k, p)| out.information[k * n + k] += p);
        }
        for i in end + 3..STEP {
            let mut weighted = [0.0; MAX];
            for (j, row) in rows.iter().enumerate().skip(end + 3) {
                let g = all[i.max(j)][i.min(j)];
                weighted[..n].iter_mut().zip(row).for_each(|(w, x)| *w += g * x);
            }
            for (k, x) in rows[i][..n].iter().enumerate().filter(|(_, x)| **x != 0.0) {
                let row = &mut out.information[k * n..=k * n + k];
                row.iter_mut().zip(&weighted).for_each(|(sum, w)| *sum += x * w);
            }
        }
        // back into platform axes
        let mean = times(&(axes.transpose() * covariance), &through);
        let covariance = axes.transpose() * covariance * axes;
        out.joint = Some(Joint { covariance, mean });
        self.go_on(dwelling, c, &local, out);
        out.path.clone_from(&state.path);
        out.path.push(stop.candidate);
        out.seconds = state.seconds + dwelling.seconds + seconds;
    }

    /// The root of the information on psi of one position of a sequence and all coefficients, under reset carry.
    pub(super) fn root_with_psi(
        &self,
        bias: &BiasState,
        path: &[usize],
        position: usize,
    ) -> Option<Vec<f64>> {
        let (mut now, mut next) = (self.start(), self.start());
        for (i, &candidate) in path.iter().enumerate() {
            self.extend_correlated(bias, &now, candidate.into(), i == position, &mut next);
            std::mem::swap(&mut now, &mut next);
        }
        let mut root = Vec::new();
        self.root_from(0, &now, &mut root).then_some(root)
    }
}
