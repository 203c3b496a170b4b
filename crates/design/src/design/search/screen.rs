//! Lower bound over the last two positions, for pruning where information does not add over positions:
//! pairs that cannot be good enough are not evaluated.
//!
//! After a prefix psi is a functional P of the unknowns x. Any continuation, a sequence s, adds `T^T
//! S(s) T`: S(s) is the information of s as a scheme of its own, on psi at its start and the
//! coefficients, and `T = [P; 0 I]`. So for any vector x
//!
//! ```text
//! x^T M x = x^T M_prefix x + sum_j q_j(z_j, x),   z_0 = P x,  z_(j+1) = F_j z_j + h_j x
//! ```
//!
//! with q_j the information of position j alone, F_j and h_j the effect of its dwell on psi: x is
//! carried through the positions in three numbers z, instead of a matrix. By duality
//! (`certificate::bound`) the criterion of the whole is at least the inverse of this sum, so all pairs
//! that add too little along x are excluded at once. Any x is valid. Good choices are those of the
//! prefix with the mean of all continuations, and those of one of the remaining pairs: an x that
//! excludes one pair excludes many others.
//!
//! Psi continues here as in the scheme. Relaxed bounds are of little use. Where psi may be anything
//! before a dwell, carry only adds information, so reset carry bounds nothing. With psi known before
//! every dwell the drift between is known exactly. One X for all continuations (the mean, or its best
//! weights) keeps most pairs of the best schemes (`crates/README.md`, with numbers).
//!
//! Rounding: an excluded pair must be worse than the limit *as the search would have computed it*.
//! Cholesky's decomposition and the triangular systems of a criterion are exact for a matrix that
//! differs from the computed M by at most `gamma_(3n+1) sqrt(m_ii m_jj)` in every entry (N. J. Higham,
//! *Accuracy and Stability of Numerical Algorithms*, 2nd edition, 2002, theorems 8.5 and 10.3, each
//! column of L being no longer than `sqrt(m_ii)`), and every bound above holds for that matrix too. So
//! no condition number enters: the energy of x may be off by `gamma (sum_i |x_i| sqrt(m_ii))^2`. The
//! information of a position is `L^T G L` with `|G_ab| <= sqrt(G_aa G_bb)`; the rounding of its sums
//! and products is likewise at most `gamma (sum_i |x_i| s_i)^2`, `s_i = sum_a sqrt(G_aa) |L_ai|`
//! ([`MagnitudeBounds`]). Eigenvalues (E) are those of a matrix that is off by a small multiple of n u of its
//! norm, as for any backward stable method (G. H. Golub, C. F. Van Loan, *Matrix Computations*, section
//! 8.3); for the library used it is assumed to be [`EIGENVALUES`] n u at most. A pivot that the search
//! skips as a rounding residue of an undetermined direction counts as zero here too.

use obsdeg_core::model::LOCAL;
use obsdeg_exact::SplitMix64;

use crate::design::certificate::bounded::rounding;
use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::{Evaluator, SequenceState};
use crate::design::request::limits::MAX_UNKNOWNS;

/// Error of eigenvalues, in n u times the norm (an assumption).
const EIGENVALUES: usize = 10;
/// Number of directions of the first tests, for criteria in which every coefficient is one.
const DIRECTIONS: usize = 2;
/// Fraction of the mean in the information that tests are made from.
const MEAN: f64 = 1e-3;
/// Cost of a vector, in evaluations of a pair; initial and largest credit. Each excluded pair adds to
/// the credit; when it is used up, the remaining pairs are evaluated.
const COST: usize = 4;
const CREDIT: usize = 40;
const MOST_CREDIT: usize = 80;
/// Number of power iterations towards the largest principal sigma.
const POWERS: usize = 4;

/// Bounds on the continuations of a prefix.
pub(crate) struct Screen<'a> {
    evaluator: &'a Evaluator,
    criterion: &'a Criterion,
    positions: AttitudeInformation,
    /// Mean information of two positions (n x n, lower triangle).
    mean: Vec<f64>,
    magnitudes: MagnitudeBounds,
}

/// Largest magnitudes over all candidates, for bounds on rounding.
struct MagnitudeBounds {
    /// `sum_a sqrt(G_aa) |L_ai|` of psi, summed over its components.
    psi: f64,
    /// `sum_a sqrt(G_aa) |L_ai|` of every unknown (shape n); zero for psi.
    own: Vec<f64>,
    /// Largest factor from psi before a dwell to a component of psi after it.
    grow: f64,
    /// Largest effect of every unknown on psi after a dwell (shape n); zero for psi.
    gain: Vec<f64>,
}

/// Information of every candidate as a scheme of its own, on psi at its start, as it is carried, and on
/// the coefficients. Each vector holds one entry of all candidates.
struct AttitudeInformation {
    /// Information on psi: xx, 2 xy, yy, 2 xz, 2 yz, zz.
    psi: [Vec<f64>; 6],
    /// Twice the information between psi and every coefficient (3 x d).
    cross: [Vec<Vec<f64>>; 3],
    /// Information on the coefficients, row by row of the lower triangle, twice where off the diagonal.
    coefficients: Vec<Vec<f64>>,
    /// Psi after the dwell as a function of psi (3 x 3), and of every coefficient (3 x d).
    turned: [[Vec<f64>; 3]; 3],
    shifted: [Vec<Vec<f64>>; 3],
}

/// Vectors of a bound: the square of the criterion, in units of the evaluator, is at least `most`
/// divided by the sum of their `x^T M x`.
struct ExclusionTest {
    vectors: Vec<[f64; MAX_UNKNOWNS]>,
    most: f64,
}

/// Energy of one vector at every candidate: a position adds `constant + linear z + psi(z)`, and carries
/// on `turned z + shift`.
struct VectorEnergy {
    linear: [Vec<f64>; 3],
    constant: Vec<f64>,
    shift: [Vec<f64>; 3],
}

/// Working space of one thread.
pub(crate) struct Scratch {
    one: SequenceState,
    two: SequenceState,
    /// Information with the mean of two further positions.
    mean: Vec<f64>,
    mixed: SequenceState,
    tried: Vec<bool>,
    draw: SplitMix64,
    root: Vec<f64>,
    inverse: Vec<f64>,
    /// Bounds on the root of the contribution of every unknown to M: of the prefix, and of two further
    /// positions.
    sizes: Vec<[f64; 3]>,
    lanes: VectorEnergy,
    energy: Vec<f64>,
}

impl<'a> Screen<'a> {
    /// Screen for `evaluator`; `None` where order does not matter, where turns take time, or where the
    /// noise of Z is correlated, so that continuations have no information of their own.
    pub(crate) fn new(evaluator: &'a Evaluator, criterion: &'a Criterion) -> Option<Self> {
        if !evaluator.ordered() || !evaluator.slew_paths.is_empty() || evaluator.bias.is_some() {
            return None;
        }
        let (n, count) = (evaluator.n, evaluator.candidates.len());
        // the prior is in the prefix
        let bare = evaluator.without_prior();
        let (start, mut one, mut two) = (bare.start(), bare.start(), bare.start());
        let mut mean = vec![0.0; n * n];
        let mut alone = Vec::with_capacity(count);
        for first in 0..count {
            bare.extend_information(&start, first.into(), &mut one);
            for second in 0..count {
                bare.extend_information(&one, second.into(), &mut two);
                mean.iter_mut().zip(&two.information).for_each(|(sum, x)| *sum += x);
            }
            alone.push(one.clone());
        }
        mean.iter_mut().for_each(|x| *x /= (count * count) as f64);
        let magnitudes = MagnitudeBounds::of(&bare, &alone);
        Some(Self { evaluator, criterion, positions: AttitudeInformation::of(&alone, n), mean, magnitudes })
    }

    pub(crate) fn scratch(&self) -> Scratch {
        let count = self.evaluator.candidates.len();
        let lanes = VectorEnergy {
            linear: std::array::from_fn(|_| vec![0.0; count]),
            constant: vec![0.0; count],
            shift: std::array::from_fn(|_| vec![0.0; count]),
        };
        let start = || self.evaluator.start();
        Scratch {
            one: start(),
            two: start(),
            mean: start().information,
            mixed: start(),
            tried: Vec::new(),
            draw: SplitMix64::new(1),
            root: Vec::new(),
            inverse: Vec::new(),
            sizes: Vec::new(),
            lanes,
            energy: Vec::new(),
        }
    }

    /// Clears the entries of `alive` for pairs of candidates after `state` whose criterion exceeds
    /// `limit`. Pairs are ordered by first candidate, then by second.
    pub(crate) fn pairs(&self, state: &SequenceState, limit: f64, alive: &mut [bool], on: &mut Scratch) {
        self.with_mean(state, on);
        self.magnitudes.behind(state, &mut on.sizes);
        on.mixed.information.copy_from_slice(&on.mean);
        // a pair that no vector excludes is tried once
        on.tried.clear();
        on.tried.resize(alive.len(), false);
        let (mut directions, mut credit) = (DIRECTIONS, CREDIT);
        loop {
            for test in self.tests(directions, on) {
                credit += self.apply(&test, state, limit, alive, on) / test.vectors.len();
            }
            (directions, credit) = (1, credit.min(MOST_CREDIT).saturating_sub(COST));
            let open = |i: &usize| alive[*i] && !on.tried[*i];
            let left = (0..alive.len()).filter(open).count();
            if left < COST || credit == 0 {
                return;
            }
            // a random pair: neighbouring pairs are alike
            let drawn = on.draw.below(left as u64) as usize;
            let Some(pair) = (0..alive.len()).filter(open).nth(drawn) else { return };
            on.tried[pair] = true;
            // information of that pair, mixed with some of the mean to be regular
            let count = self.evaluator.candidates.len();
            self.evaluator.extend_information(state, (pair / count).into(), &mut on.one);
            self.evaluator.extend_information(&on.one, (pair % count).into(), &mut on.two);
            let both = on.two.information.iter().zip(&on.mean);
            on.mixed
                .information
                .iter_mut()
                .zip(both)
                .for_each(|(m, (x, y))| *m = (1.0 - MEAN) * x + MEAN * y);
        }
    }

    /// Clears the entries of `alive` that a test excludes, and returns their number.
    fn apply(
        &self,
        test: &ExclusionTest,
        state: &SequenceState,
        limit: f64,
        alive: &mut [bool],
        on: &mut Scratch,
    ) -> usize {
        let Scratch { energy, lanes, sizes, .. } = on;
        energy.clear();
        energy.resize(alive.len(), 0.0);
        let (mut known, count) = (0.0, self.evaluator.candidates.len());
        for x in &test.vectors {
            let z = self.behind(state, x, sizes, &mut known);
            lanes.take(&self.positions, x);
            let rows = energy.chunks_exact_mut(count).zip(alive.chunks_exact(count)).enumerate();
            for (c, (energy, _)) in rows.filter(|(_, (_, alive))| alive.contains(&true)) {
                let own = lanes.at(c, &self.positions, &z);
                lanes.all(&self.positions, &lanes.behind(c, &self.positions, &z), own, energy);
            }
        }
        let mut gone = 0;
        for (alive, energy) in alive.iter_mut().zip(&*energy) {
            let out = *alive && self.is_worse(test.most, known + energy, limit);
            *alive &= !out;
            gone += usize::from(out);
        }
        gone
    }

    /// True if a scheme with the sum `energy` of `x^T M x` has a criterion above `limit`; false for an
    /// energy that is no number.
    fn is_worse(&self, most: f64, energy: f64, limit: f64) -> bool {
        // rounding of n logarithms up to 100 (D), or of n squares
        let limit = limit * self.evaluator.dph * (1.0 + rounding(64 * self.evaluator.n));
        most > limit * limit * energy
    }

    /// Returns `P x`; adds `x^T M_prefix x` and the rounding bound of the whole energy to `known`.
    fn behind(
        &self,
        state: &SequenceState,
        x: &[f64; MAX_UNKNOWNS],
        sizes: &[[f64; 3]],
        known: &mut f64,
    ) -> [f64; 3] {
        let n = self.evaluator.n;
        let mut sum = 0.0;
        for (i, xi) in x[..n].iter().enumerate() {
            let row = &state.information[i * n..=i * n + i];
            let line: f64 = row[..i].iter().zip(x).map(|(m, xj)| m * xj).sum();
            sum += xi * (2.0 * line + row[i] * xi);
        }
        let z = state.psi.each_ref().map(|row| row.iter().zip(x).map(|(p, x)| p * x).sum());
        let (mut size, mut counting) = ([0.0; 3], [0.0; 2]);
        for (i, (x, sizes)) in x.iter().zip(sizes).enumerate() {
            (0..3).for_each(|k| size[k] += x.abs() * sizes[k]);
            if i >= 3 + self.evaluator.nuisance {
                counting[0] += x * x;
                counting[1] += sizes.iter().map(|s| s * s).sum::<f64>();
            }
        }
        let eigenvalues = match self.criterion {
            Criterion::E => rounding(3 * EIGENVALUES * n) * counting[0] * counting[1],
            _ => 0.0,
        };
        // of each position its functionals, their products and sums, and those of x with them; then the
        // decomposition: the root of each m_ii is at most the sum of the three
        *known += sum + rounding(8 * n + 128) * size.iter().map(|s| s * s).sum::<f64>() + eigenvalues;
        z
    }

    /// Information of `state` with the mean of two further positions.
    fn with_mean(&self, state: &SequenceState, on: &mut Scratch) {
        let n = self.evaluator.n;
        // P^T S_zz P + P^T S_zx + S_xz P + S_xx, with S_zz / 2 P + S_zx first
        let symmetric = |i: usize, j: usize| self.mean[i.max(j) * n + i.min(j)];
        let mut half = [[0.0; MAX_UNKNOWNS]; 3];
        for (r, row) in half.iter_mut().enumerate() {
            for (k, psi) in state.psi.iter().enumerate() {
                let s = 0.5 * symmetric(r, k);
                row.iter_mut().zip(psi).for_each(|(x, p)| *x += s * p);
            }
            (3..n).for_each(|j| row[j] += symmetric(r, j));
        }
        for i in 0..n {
            for j in 0..=i {
                let mut sum = if j < 3 { 0.0 } else { self.mean[i * n + j] };
                for (psi, half) in state.psi.iter().zip(&half) {
                    sum += psi[i] * half[j] + half[i] * psi[j];
                }
                on.mean[i * n + j] = state.information[i * n + j] + sum;
            }
        }
    }

    /// Tests from some information; `directions` of them for criteria in which every coefficient is
    /// one.
    fn tests(&self, directions: usize, on: &mut Scratch) -> Vec<ExclusionTest> {
        if !self.evaluator.root(&on.mixed, &mut on.root) {
            return Vec::new();
        }
        inverse(&on.root, self.evaluator.n, &mut on.inverse);
        self.of_inverse(&on.inverse, directions)
    }

    /// Tests from the inverse of the factor, `M^-1 = K^T K`.
    fn of_inverse(&self, k: &[f64], most: usize) -> Vec<ExclusionTest> {
        let n = self.evaluator.n;
        let begin = 3 + self.evaluator.nuisance;
        let d = (n - begin) as f64;
        // K^T K u
        let solved = |u: &[f64; MAX_UNKNOWNS]| -> [f64; MAX_UNKNOWNS] {
            let mut out = [0.0; MAX_UNKNOWNS];
            for r in 0..n {
                let row = &k[r * n..=r * n + r];
                let y: f64 = row.iter().zip(u).map(|(a, b)| a * b).sum();
                row.iter().zip(&mut out).for_each(|(a, o)| *o += a * y);
            }
            out
        };
        let unit = |j: usize| -> [f64; MAX_UNKNOWNS] { std::array::from_fn(|i| f64::from(u8::from(i == j))) };
        let variance = |j: usize| (j..n).map(|r| k[r * n + j] * k[r * n + j]).sum::<f64>();
        let alone = |j: usize, limit: f64| {
            let x = solved(&unit(j));
            ExclusionTest { most: (x[j] / limit).powi(2), vectors: vec![x] }
        };
        let directions = |limit: &dyn Fn(usize) -> f64| {
            let mut order: Vec<(f64, usize)> =
                (begin..n).map(|j| (variance(j) / limit(j).powi(2), j)).filter(|(v, _)| *v > 0.0).collect();
            order.sort_by(|a, b| b.0.total_cmp(&a.0));
            order.into_iter().take(most).map(|(_, j)| alone(j, limit(j))).collect()
        };
        match self.criterion {
            Criterion::Worst => directions(&|_| 1.0),
            // without psi: the margin is at least that of the coefficients
            Criterion::Margin(limits) => directions(&|j| limits.coefficients[j - begin]),
            Criterion::A => {
                let vectors: Vec<_> = (begin..n).map(|j| solved(&unit(j))).collect();
                let trace: f64 = vectors.iter().zip(begin..).map(|(x, j)| x[j]).sum();
                vec![ExclusionTest { vectors, most: trace * trace / d }]
            }
            Criterion::D => {
                let row = |j: usize| std::array::from_fn(|i| if i <= j { k[j * n + i] } else { 0.0 });
                let logs: f64 = (begin..n).map(|j| k[j * n + j].ln()).sum();
                vec![ExclusionTest {
                    vectors: (begin..n).map(row).collect(),
                    most: d * (2.0 * logs / d).exp(),
                }]
            }
            Criterion::E => {
                let largest = (begin..n).max_by(|a, b| variance(*a).total_cmp(&variance(*b)));
                let mut x = unit(largest.unwrap_or(begin));
                let counting = |x: &[f64; MAX_UNKNOWNS]| x[begin..n].iter().map(|x| x * x).sum::<f64>();
                for _ in 0..POWERS {
                    let size = counting(&x).sqrt();
                    let u = std::array::from_fn(|i| if i >= begin { x[i] / size } else { 0.0 });
                    x = solved(&u);
                }
                vec![ExclusionTest { most: counting(&x), vectors: vec![x] }]
            }
        }
    }
}

impl MagnitudeBounds {
    /// Bounds for the candidates of an evaluator without priors; `alone` are their states as first
    /// positions.
    fn of(evaluator: &Evaluator, alone: &[SequenceState]) -> Self {
        let n = evaluator.n;
        let mut out = Self { psi: 0.0, own: vec![0.0; n], grow: 1.0, gain: vec![0.0; n] };
        let start = evaluator.start();
        for (c, state) in alone.iter().enumerate() {
            let local = evaluator.functionals::<LOCAL, MAX_UNKNOWNS>(&start, c.into());
            let dwelling = evaluator.dwelling_of(c);
            let size = |i: usize| -> f64 {
                local.iter().enumerate().map(|(a, row)| dwelling.local[a][a].sqrt() * row[i].abs()).sum()
            };
            // psi is turned from the platform axes to n and back: two matrices with rows of absolute
            // sums up to sqrt(3)
            let after = |row: &[f64]| 3.0 * row.iter().map(|x| x.abs()).sum::<f64>();
            out.psi = out.psi.max((0..3).map(size).sum());
            out.grow = state.psi.iter().fold(out.grow, |m, row| m.max(after(&row[..3])));
            for i in 3..n {
                out.own[i] = out.own[i].max(size(i));
                out.gain[i] = state.psi.iter().fold(out.gain[i], |m, row| m.max(after(&row[i..=i])));
            }
        }
        out
    }

    /// Bounds on the root of the contribution of every unknown to M, of the prefix and of two further
    /// positions.
    fn behind(&self, state: &SequenceState, sizes: &mut Vec<[f64; 3]>) {
        let n = self.own.len();
        sizes.clear();
        sizes.extend((0..n).map(|i| {
            let known = state.information[i * n + i].max(0.0).sqrt();
            let psi = state.psi.iter().fold(0.0f64, |m, row| m.max(row[i].abs()));
            let first = psi * self.psi + self.own[i];
            [known, first, (self.grow * psi + self.gain[i]) * self.psi + self.own[i]]
        }));
    }
}

impl AttitudeInformation {
    fn of(alone: &[SequenceState], n: usize) -> Self {
        let entry = |i: usize, j: usize| -> Vec<f64> {
            let factor = if i == j { 1.0 } else { 2.0 };
            alone.iter().map(|a| factor * a.information[i * n + j]).collect()
        };
        let after = |r: usize, j: usize| -> Vec<f64> { alone.iter().map(|a| a.psi[r][j]).collect() };
        let pairs = (3..n).flat_map(|i| (3..=i).map(move |j| (i, j)));
        Self {
            psi: [entry(0, 0), entry(1, 0), entry(1, 1), entry(2, 0), entry(2, 1), entry(2, 2)],
            cross: std::array::from_fn(|r| (3..n).map(|j| entry(j, r)).collect()),
            coefficients: pairs.map(|(i, j)| entry(i, j)).collect(),
            turned: std::array::from_fn(|r| std::array::from_fn(|k| after(r, k))),
            shifted: std::array::from_fn(|r| (3..n).map(|j| after(r, j)).collect()),
        }
    }
}

/// `sum += factor * entries`, entry by entry.
fn add(sum: &mut [f64], factor: f64, entries: &[f64]) {
    sum.iter_mut().zip(entries).for_each(|(s, x)| *s += factor * x);
}

impl VectorEnergy {
    fn take(&mut self, positions: &AttitudeInformation, x: &[f64; MAX_UNKNOWNS]) {
        let all = self.linear.iter_mut().chain(&mut self.shift).chain(std::iter::once(&mut self.constant));
        all.for_each(|entries| entries.fill(0.0));
        let d = positions.cross[0].len();
        let coefficients = &x[3..3 + d];
        for (j, &xj) in coefficients.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            for r in 0..3 {
                add(&mut self.linear[r], xj, &positions.cross[r][j]);
                add(&mut self.shift[r], xj, &positions.shifted[r][j]);
            }
            let row = &positions.coefficients[j * (j + 1) / 2..];
            for (entries, xi) in row.iter().zip(&coefficients[..=j]) {
                add(&mut self.constant, xj * xi, entries);
            }
        }
    }

    /// Contribution of candidate `c` if psi is z.
    fn at(&self, c: usize, positions: &AttitudeInformation, z: &[f64; 3]) -> f64 {
        let [x, y, w] = *z;
        let products = [x * x, x * y, y * y, x * w, y * w, w * w];
        let square: f64 = positions.psi.iter().zip(products).map(|(entries, p)| entries[c] * p).sum();
        let linear: f64 = self.linear.iter().zip(z).map(|(entries, z)| entries[c] * z).sum();
        self.constant[c] + linear + square
    }

    /// Psi after a dwell at candidate `c`.
    fn behind(&self, c: usize, positions: &AttitudeInformation, z: &[f64; 3]) -> [f64; 3] {
        let turned =
            |r: usize| positions.turned[r].iter().zip(z).map(|(entries, z)| entries[c] * z).sum::<f64>();
        std::array::from_fn(|r| self.shift[r][c] + turned(r))
    }

    /// Adds `before` and the contribution of every candidate, if psi is z, to `energy`.
    fn all(&self, positions: &AttitudeInformation, z: &[f64; 3], before: f64, energy: &mut [f64]) {
        let n = energy.len();
        let [x, y, w] = *z;
        let [lx, ly, lw] = self.linear.each_ref().map(|entries| &entries[..n]);
        let [xx, xy, yy, xw, yw, ww] = positions.psi.each_ref().map(|entries| &entries[..n]);
        let constant = &self.constant[..n];
        for c in 0..n {
            energy[c] += before
                + constant[c]
                + x * (lx[c] + x * xx[c] + y * xy[c] + w * xw[c])
                + y * (ly[c] + y * yy[c] + w * yw[c])
                + w * (lw[c] + w * ww[c]);
        }
    }
}

/// Inverse of a lower triangular matrix (n x n); rows of a zero pivot are zero.
fn inverse(root: &[f64], n: usize, out: &mut Vec<f64>) {
    out.clear();
    out.resize(n * n, 0.0);
    for r in 0..n {
        let pivot = root[r * n + r];
        if pivot <= 0.0 {
            continue;
        }
        let (before, row) = out.split_at_mut(r * n);
        row[r] = 1.0 / pivot;
        for m in 0..r {
            let l = root[r * n + m];
            if l != 0.0 {
                for (o, k) in row[..=m].iter_mut().zip(&before[m * n..=m * n + m]) {
                    *o -= l * k;
                }
            }
        }
        row[..r].iter_mut().for_each(|x| *x /= pivot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::measure::criterion::SigmaLimits;
    use crate::design::{Candidates, SequenceState};
    use obsdeg_core::model::settings::Assignment;
    use obsdeg_core::model::{Angle, Carry, Euler, Scheme};
    use obsdeg_evidence::simulation::Conditions;

    /// Random scheme, with the number of its coefficients.
    fn drawn_scheme(below: &mut dyn FnMut(u64) -> usize) -> (Scheme, usize) {
        let carry = [Carry::Platform, Carry::Inertial][below(2)];
        let terms = ["F", "F,I", "O,S", "F,I,O,S", "F,O,K0", "F,I,K1,M3"][below(6)];
        let base = Scheme {
            carry,
            latitude: (10 + below(70)).to_string().parse().ok(),
            unknowns: terms.parse().expect("terms"),
            ..Scheme::default()
        };
        (base, 3 * terms.split(',').count())
    }

    /// Random conditions; every third task has priors.
    fn drawn_conditions(task: usize, below: &mut dyn FnMut(u64) -> usize) -> Conditions {
        let mut conditions = Conditions {
            dwell_s: [50.0, 1000.0, 4000.0][below(3)],
            step_s: 50.0,
            accelerometer_noise_g: [1e-7, 1e-5, 1e-3][below(3)],
            ..Conditions::default()
        };
        if task.is_multiple_of(3) {
            let known = [("D", [0.01, 1.0][below(2)]), ("psi", 1e-3), ("psi_y", 1e-5)];
            let stated = known.map(|(name, value)| Assignment { name: name.into(), value });
            conditions.priors.extend(stated.into_iter().take(1 + below(3)));
        }
        conditions
    }

    /// Random candidates, cardinal or not.
    fn drawn_candidates(below: &mut dyn FnMut(u64) -> usize) -> Vec<Euler> {
        let cardinals = Candidates::cardinals().attitudes;
        let cardinal = below(2) == 0;
        (0..3 + below(5))
            .map(|_| match cardinal {
                true => cardinals[below(24)].clone(),
                false => std::array::from_fn(|_| Angle::from_degrees(below(360) as i32 - 180)),
            })
            .collect()
    }

    /// For any limit no pair is excluded whose criterion is within it, and nearly all worse ones are:
    /// both carries, every criterion, and random terms, candidates, dwells and coefficients that count.
    #[test]
    fn what_is_within_the_limit_is_not_excluded() {
        let mut rng = SplitMix64::new(23);
        let (mut worse, mut excluded, mut within) = (0, 0, 0);
        for task in 0..400 {
            let mut below = |n: u64| rng.below(n) as usize;
            let (base, d) = drawn_scheme(&mut below);
            let conditions = drawn_conditions(task, &mut below);
            let candidates = drawn_candidates(&mut below);
            let mut counting: Vec<usize> = (0..d).filter(|_| below(4) > 0).collect();
            if counting.is_empty() {
                counting.push(0);
            }
            let limits = SigmaLimits {
                coefficients: counting.iter().map(|_| 10f64.powi(below(5) as i32 - 3)).collect(),
                psi: [0.01, 1.0, f64::INFINITY],
            };
            let criteria =
                [Criterion::Worst, Criterion::A, Criterion::D, Criterion::E, Criterion::Margin(limits)];
            let criterion = criteria[task % criteria.len()].clone();
            let evaluator = Evaluator::new(&base, &candidates, &counting, &conditions).expect("an evaluator");
            let screen = Screen::new(&evaluator, &criterion).expect("a screen");
            let count = candidates.len();
            let prefix: Vec<usize> = (0..1 + below(5)).map(|_| below(count as u64)).collect();
            let state: SequenceState = evaluator.state_of(&prefix);
            let values: Vec<f64> = (0..count * count)
                .map(|pair| {
                    let sequence: Vec<usize> =
                        prefix.iter().copied().chain([pair / count, pair % count]).collect();
                    evaluator.of_sequence(&sequence, &criterion)
                })
                .collect();
            let limit = values[below((count * count) as u64)] * [1.0, 1.0, 0.5, 2.0][below(4)];
            if !limit.is_finite() {
                continue;
            }
            let mut alive = vec![true; values.len()];
            screen.pairs(&state, limit, &mut alive, &mut screen.scratch());
            for (value, alive) in values.iter().zip(alive) {
                assert!(alive || *value > limit, "task {task} {base:?} {criterion:?}: {value} {limit}");
                within += usize::from(*value <= limit);
                worse += usize::from(*value > limit * 1.5);
                excluded += usize::from(*value > limit * 1.5 && !alive);
            }
        }
        assert!(within > 2000 && worse > 1000 && excluded * 10 > worse * 7, "{within} {worse} {excluded}");
    }
}
