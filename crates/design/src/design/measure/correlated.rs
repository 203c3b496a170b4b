//! Correlated noise of Z: each accelerometer has a bias that is a Gauss-Markov process beside its white
//! noise, and that continues in platform axes from position to position. Three such processes, alike
//! and independent, are so in any axes.
//!
//! The present bias b is a state that no coefficient depends on. Given the unknowns x it has a mean `K
//! x` and a covariance that does not depend on x, so a sequence keeps these two beside the information
//! on x. For a dwell, the information on its local unknowns, b at its start and b at its end contains
//! everything that samples and process determine; b in between is eliminated. It is computed once,
//! sample by sample. Adding a position adds this information after elimination of b at the start, up to
//! its mean, and b at the end: information only grows, and nothing large is subtracted from it.
//!
//! Information is thus no sum over positions under any carry, and order matters: bounds that rest on such
//! a sum do not hold here.

use nalgebra::Matrix3 as Small;
use obsdeg_core::model::{Carry, LOCAL};
use obsdeg_ekf::BiasState;

use crate::design::measure::elimination::eliminate;
use crate::design::measure::evaluator::{Evaluator, SequenceState};
use crate::design::measure::noise_process::{BiasDistribution, STEP, times};
use crate::design::measure::stop::Stop;
use crate::design::request::limits::MAX_UNKNOWNS;

impl Evaluator {
    /// Adds a position to `state`. Under reset carry psi of the position is eliminated, or with `kept`
    /// takes the place of psi among the unknowns.
    pub(crate) fn extend_correlated(
        &self,
        bias: &BiasState,
        state: &SequenceState,
        stop: Stop,
        kept: bool,
        out: &mut SequenceState,
    ) {
        let n = self.n;
        let reset = self.carry() == Carry::Reset;
        let seconds = self.path_to(state.path.last().copied(), stop).map_or(0.0, |t| t.seconds);
        let (c, dwelling) = self.stands(stop.candidate);
        let Some(of_dwell) = &dwelling.correlated else { return };
        // b^n = C b
        let axes = Small::from_fn(|i, j| c[i][j]);
        let before = match &state.joint {
            Some(joint) => joint.wait(bias, seconds, &axes),
            None => BiasDistribution::start(bias, n),
        };
        // order: b at the start minus its mean, psi of this position alone (if it is), b at the end;
        // then the other local unknowns, and the mean
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
                // the mean enters wherever b at the start does
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
        // all but b and psi of this position, as functionals of the unknowns
        let mut local = self.functionals::<LOCAL, MAX_UNKNOWNS>(state, stop);
        if kept {
            (0..3).for_each(|r| local[r][..3].copy_from_slice(&c[r]));
        }
        let mut rows = vec![[0.0; MAX_UNKNOWNS]; STEP];
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
            let mut weighted = [0.0; MAX_UNKNOWNS];
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
        out.joint = Some(BiasDistribution { covariance, mean });
        self.go_on(dwelling, c, &local, out);
        out.path.clone_from(&state.path);
        out.path.push(stop.candidate);
        out.seconds = state.seconds + dwelling.seconds + seconds;
    }

    /// Cholesky factor of the information on psi of one position of a sequence and on all coefficients,
    /// under reset carry.
    pub(crate) fn root_with_psi(
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
