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
use obsdeg_core::model::{Carry, LOCAL, Matrix3};
use obsdeg_ekf::BiasState;

use crate::design::measure::elimination::eliminate;
use crate::design::measure::evaluator::{Evaluator, SequenceState};
use crate::design::measure::noise_process::{BiasDistribution, DwellInformation, STEP, times};
use crate::design::measure::stop::Stop;
use crate::design::request::limits::MAX_UNKNOWNS;

/// First place of the mean of b at the start.
const MEAN: usize = STEP - 3;

/// Places of the states of a position: b at the start minus its mean, psi of this position alone (if it is),
/// b at the end; then the other local unknowns, and the mean.
struct StatePlaces {
    /// True if psi belongs to this position alone.
    alone: bool,
    /// First place of psi.
    psi: usize,
    /// First place of b at the end.
    end: usize,
}

impl StatePlaces {
    fn new(alone: bool) -> Self {
        let (psi, end) = if alone { (3, 6) } else { (6, 3) };
        Self { alone, psi, end }
    }

    /// Place of entry `i` of the information of a dwell.
    fn of(&self, i: usize) -> usize {
        match i {
            0..3 => self.psi + i,
            3..LOCAL => 6 + i,
            _ if i < LOCAL + 3 => i - LOCAL,
            _ => self.end + i - LOCAL - 3,
        }
    }
}

/// Mean of b at the end, whose first place is `end`, as a functional of the unknowns (3 x n), up to the
/// covariance of b; `rows` are the states as functionals.
fn mean_at_end(
    all: &[[f64; STEP]; STEP],
    rows: &[[f64; MAX_UNKNOWNS]],
    end: usize,
    n: usize,
) -> [Vec<f64>; 3] {
    std::array::from_fn(|r| {
        let mut sum = vec![0.0; n];
        for (i, row) in rows.iter().enumerate().skip(end + 3) {
            sum.iter_mut().zip(row).for_each(|(s, x)| *s -= all[i][end + r] * x);
        }
        sum
    })
}

/// Adds the information on the states from place `first` on to that on the unknowns (n x n, lower triangle);
/// `rows` are the states as functionals.
fn add_information(
    all: &[[f64; STEP]; STEP],
    rows: &[[f64; MAX_UNKNOWNS]],
    first: usize,
    n: usize,
    information: &mut [f64],
) {
    for i in first..STEP {
        let mut weighted = [0.0; MAX_UNKNOWNS];
        for (j, row) in rows.iter().enumerate().skip(first) {
            let g = all[i.max(j)][i.min(j)];
            weighted[..n].iter_mut().zip(row).for_each(|(w, x)| *w += g * x);
        }
        for (k, x) in rows[i][..n].iter().enumerate().filter(|(_, x)| **x != 0.0) {
            let row = &mut information[k * n..=k * n + k];
            row.iter_mut().zip(&weighted).for_each(|(sum, w)| *sum += x * w);
        }
    }
}

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
        let seconds = self.path_to(state.path.last().copied(), stop).map_or(0.0, |t| t.seconds);
        let (c, dwelling) = self.stands(stop.candidate);
        let Some(of_dwell) = &dwelling.correlated else { return };
        // b^n = C b
        let axes = Small::from_fn(|i, j| c[i][j]);
        let before = match &state.joint {
            Some(joint) => joint.wait(bias, seconds, &axes),
            None => BiasDistribution::start(bias, n),
        };
        let places = StatePlaces::new(self.carry() == Carry::Reset && !kept);
        let end = places.end;
        let mut all = self.information_of_step(of_dwell, &before, c, &places);
        // all but b and psi of this position, as functionals of the unknowns
        let mut local = self.functionals::<LOCAL, MAX_UNKNOWNS>(state, stop);
        if kept {
            (0..3).for_each(|r| local[r][..3].copy_from_slice(&c[r]));
        }
        let mut rows = vec![[0.0; MAX_UNKNOWNS]; STEP];
        let first = if places.alone { 3 } else { 0 };
        (first..LOCAL).for_each(|i| rows[places.of(i)] = local[i]);
        (0..3).for_each(|r| rows[MEAN + r][..n].copy_from_slice(&before.mean[r]));
        eliminate(&mut all, STEP, 0..end);
        let own = Small::from_fn(|i, j| all[end + i.max(j)][end + i.min(j)]);
        let covariance = own.try_inverse().unwrap_or_else(Small::zeros);
        let through = mean_at_end(&all, &rows, end, n);
        eliminate(&mut all, STEP, end..end + 3);
        out.information.copy_from_slice(&state.information);
        self.know_first(state, c, |i, j, known| out.information[i * n + j] += known);
        if kept {
            self.prior.psi.iter().enumerate().for_each(|(k, p)| out.information[k * n + k] += p);
        }
        add_information(&all, &rows, end + 3, n, &mut out.information);
        // back into platform axes
        let mean = times(&(axes.transpose() * covariance), &through);
        let covariance = axes.transpose() * covariance * axes;
        out.joint = Some(BiasDistribution { covariance, mean });
        self.go_on(dwelling, c, &local, out);
        out.path.clone_from(&state.path);
        out.path.push(stop.candidate);
        out.seconds = state.seconds + dwelling.seconds + seconds;
    }

    /// Information of a position on its states (lower triangle), from the distribution of b before it.
    fn information_of_step(
        &self,
        of_dwell: &DwellInformation,
        before: &BiasDistribution,
        c: &Matrix3<f64>,
        places: &StatePlaces,
    ) -> [[f64; STEP]; STEP] {
        let place = |i: usize| places.of(i);
        let mut all = [[0.0; STEP]; STEP];
        let mut add = |i: usize, j: usize, x: f64| all[i.max(j)][i.min(j)] += x;
        let is_start = |i: usize| (LOCAL..LOCAL + 3).contains(&i);
        for (i, row) in of_dwell.iter().enumerate() {
            for (j, &x) in row[..=i].iter().enumerate() {
                add(place(i), place(j), x);
                // the mean enters wherever b at the start does
                match (is_start(i), is_start(j)) {
                    (true, true) => {
                        add(MEAN + i - LOCAL, MEAN + j - LOCAL, x);
                        add(MEAN + i - LOCAL, place(j), x);
                        if i != j {
                            add(MEAN + j - LOCAL, place(i), x);
                        }
                    }
                    (true, false) => add(MEAN + i - LOCAL, place(j), x),
                    (false, true) => add(MEAN + j - LOCAL, place(i), x),
                    (false, false) => {}
                }
            }
        }
        let inverse = before.covariance.try_inverse().unwrap_or_else(Small::zeros);
        (0..3).for_each(|i| (0..=i).for_each(|j| add(i, j, inverse[(i, j)])));
        if places.alone {
            for (i, j) in [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)] {
                let known = self.prior.psi.iter().enumerate().map(|(k, p)| c[i][k] * p * c[j][k]);
                add(places.psi + i, places.psi + j, known.sum());
            }
        }
        all
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
