//! The information of a sequence of positions, built up position by position: what a search evaluates millions of times.

use nalgebra::DMatrix;
use obsdeg_ekf::integrate::van_loan;

use super::DesignError;
use crate::model::attitude::{Euler, Matrix3, c_n};
use crate::model::platform::{LOCAL, local_dynamics, local_output};
use crate::model::ring::Float;
use crate::model::{Carry, Platform, Scheme};
use crate::simulation::conditions::{Conditions, latitude_of, si_per_shown};
use crate::simulation::plan::{Plan, W_IE};

/// Most unknowns of a search: psi and the coefficients of ten terms.
pub const MAX: usize = 33;

impl Criterion {
    /// worst, A, D, E or margin.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Worst => "worst",
            Self::A => "A",
            Self::D => "D",
            Self::E => "E",
            Self::Margin(_) => "margin",
        }
    }
}

/// One candidate: its attitude, and how coefficients become drift there.
#[derive(Debug, Clone)]
struct Candidate {
    c: Matrix3<f64>,
    /// `C E(g)` (3 x d).
    drift: [Vec<f64>; 3],
}

/// What every evaluation shares.
#[derive(Debug, Clone)]
pub struct Evaluator {
    carry: Carry,
    /// Unknowns: psi, then d coefficients.
    n: usize,
    /// Information of one position on its `(psi^n, eps^n)`.
    local: [[f64; LOCAL]; LOCAL],
    /// `psi^n` after a position as a function of `(psi^n, eps^n)` before.
    phi: [[f64; LOCAL]; 3],
    candidates: Vec<Candidate>,
    /// deg/h per unit of each coefficient.
    dph: f64,
}

/// A sequence so far.
#[derive(Debug, Clone)]
pub struct State {
    /// Information (n x n), row by row, lower triangle.
    information: Vec<f64>,
    /// psi in the carried axes as a functional of the unknowns (3 x n).
    psi: [Vec<f64>; 3],
}

impl Evaluator {
    /// The evaluator for positions of `dwell_s` each, without drift noise and slews.
    ///
    /// # Errors
    /// [`DesignError`].
    pub fn new(
        base: &Scheme,
        candidates: &[Euler],
        conditions: &Conditions,
        dwell_s: f64,
    ) -> Result<Self, DesignError> {
        let scheme = Scheme {
            positions: Scheme::of_angles(candidates.iter().cloned()).positions,
            latitude: latitude_of(base),
            combinations: Vec::new(),
            carry: Carry::Platform,
            ..base.clone()
        };
        let latitude = scheme
            .latitude
            .map_or((1.0, 0.0), |l| obsdeg_exact::Turn::from_nanodeg(l.nanodeg()).cos_sin_f64());
        let platform = Platform::new(scheme)?;
        let n = platform.names().len();
        if n > MAX {
            return Err(DesignError::TooManyUnknowns { found: n });
        }
        let f = local_dynamics(&Float, &(W_IE * latitude.0), &(W_IE * latitude.1));
        let f = DMatrix::from_fn(LOCAL, LOCAL, |i, j| f[i][j]);
        let steps = (dwell_s / conditions.step_s - 1e-9).ceil().max(1.0) as usize;
        let none = DMatrix::zeros(LOCAL, LOCAL);
        let (step, _) = van_loan(&f, &none, dwell_s / steps as f64)?;
        let outputs = local_output(&Float, base.measured_azimuth);
        let mut now: DMatrix<f64> = DMatrix::identity(LOCAL, LOCAL);
        let mut local = [[0.0; LOCAL]; LOCAL];
        for _ in 0..steps {
            now = &step * now;
            for (component, h) in &outputs {
                let weight = 1.0 / Plan::output_sigma(*component, conditions).powi(2);
                let row: [f64; LOCAL] = std::array::from_fn(|j| (0..LOCAL).map(|i| h[i] * now[(i, j)]).sum());
                for i in 0..LOCAL {
                    for j in 0..LOCAL {
                        local[i][j] += weight * row[i] * row[j];
                    }
                }
            }
        }
        let candidates = candidates
            .iter()
            .map(|euler| {
                let c = c_n(&Float, euler, None, |a| a.turn().cos_sin_f64());
                Candidate { drift: platform.drift_rows(&Float, &c), c }
            })
            .collect();
        let phi = std::array::from_fn(|i| std::array::from_fn(|j| now[(i, j)]));
        Ok(Self { carry: base.carry, n, local, phi, candidates, dph: si_per_shown("deg/h") })
    }

    /// Nothing yet.
    pub fn start(&self) -> State {
        let unit = |r: usize| (0..self.n).map(|c| f64::from(u8::from(c == r))).collect();
        State { information: vec![0.0; self.n * self.n], psi: std::array::from_fn(unit) }
    }

    /// Whether the order of positions makes a difference.
    pub fn ordered(&self) -> bool {
        self.carry != Carry::Reset
    }

    /// Adds a position to `state`; the result goes to `out`.
    pub fn extend(&self, state: &State, candidate: usize, out: &mut State) {
        let n = self.n;
        let Candidate { c, drift } = &self.candidates[candidate];
        let mut local = [[0.0; MAX]; LOCAL];
        for r in 0..3 {
            match self.carry {
                Carry::Inertial => local[r][..n].copy_from_slice(&state.psi[r]),
                // psi of the position is eliminated below
                Carry::Reset => local[r][..3].copy_from_slice(&c[r]),
                Carry::Platform => {
                    for (j, x) in local[r][..n].iter_mut().enumerate() {
                        *x = (0..3).map(|k| c[r][k] * state.psi[k][j]).sum();
                    }
                }
            }
            local[3 + r][3..n].copy_from_slice(&drift[r]);
        }
        // G L, then L^T (G L)
        let mut weighted = [[0.0; MAX]; LOCAL];
        for (i, row) in weighted.iter_mut().enumerate() {
            for (k, l) in local.iter().enumerate() {
                let g = self.local[i][k];
                if g != 0.0 {
                    for (x, y) in row[..n].iter_mut().zip(&l[..n]) {
                        *x += g * y;
                    }
                }
            }
        }
        out.information.copy_from_slice(&state.information);
        if self.carry == Carry::Reset {
            let mut own = [[0.0; MAX]; MAX];
            for (i, row) in own[..n].iter_mut().enumerate() {
                for (l, w) in local.iter().zip(&weighted) {
                    for (x, y) in row[..=i].iter_mut().zip(&w[..=i]) {
                        *x += l[i] * y;
                    }
                }
            }
            eliminate(&mut own, n, 3);
            for (i, row) in own[..n].iter().enumerate() {
                for (x, y) in out.information[i * n..=i * n + i].iter_mut().zip(row) {
                    *x += y;
                }
            }
        } else {
            for i in 0..n {
                let row = &mut out.information[i * n..=i * n + i];
                for (l, w) in local.iter().zip(&weighted).filter(|(l, _)| l[i] != 0.0) {
                    for (x, y) in row.iter_mut().zip(&w[..=i]) {
                        *x += l[i] * y;
                    }
                }
            }
        }
        if self.carry != Carry::Reset {
            let mut after = [[0.0; MAX]; 3];
            for (row, phi) in after.iter_mut().zip(&self.phi) {
                for (l, p) in local.iter().zip(phi) {
                    for (x, y) in row[..n].iter_mut().zip(&l[..n]) {
                        *x += p * y;
                    }
                }
            }
            for (k, row) in out.psi.iter_mut().enumerate() {
                match self.carry {
                    Carry::Platform => {
                        for (j, x) in row.iter_mut().enumerate() {
                            *x = (0..3).map(|r| c[r][k] * after[r][j]).sum();
                        }
                    }
                    _ => row.copy_from_slice(&after[k][..n]),
                }
            }
        }
    }

    /// The criterion of a sequence, smaller is better; infinite, or as large as rounding makes it, when a
    /// coefficient is not determined. Sigmas are in deg/h
    /// (per g). `root` is working space.
    pub fn value(&self, state: &State, criterion: &Criterion, root: &mut Vec<f64>) -> f64 {
        let (n, d) = (self.n, self.n - 3);
        let first = if self.carry == Carry::Reset { 3 } else { 0 };
        // Cholesky of the information, psi first: the block of the coefficients is the root of the inverse of their covariance
        root.resize(n * n, 0.0);
        let l = &mut root[..];
        for i in first..n {
            let (done, rest) = l.split_at_mut(i * n);
            let row = &mut rest[..=i];
            let given = &state.information[i * n..=i * n + i];
            for j in first..i {
                let other = &done[j * n..=j * n + j];
                let sum: f64 = row[first..j].iter().zip(&other[first..j]).map(|(a, b)| a * b).sum();
                row[j] = (given[j] - sum) / other[j];
            }
            let pivot = given[i] - row[first..i].iter().map(|a| a * a).sum::<f64>();
            // what rounding leaves of an undetermined direction
            if pivot <= 1e-13 * given[i] {
                return f64::INFINITY;
            }
            row[i] = pivot.sqrt();
        }
        if *criterion == Criterion::D {
            // the geometric mean of the principal sigmas
            let logs: f64 = (3..n).map(|i| l[i * n + i].ln()).sum();
            return (-logs / d as f64).exp() / self.dph;
        }
        if *criterion == Criterion::E {
            let block = DMatrix::from_fn(d, d, |i, j| if j <= i { l[(i + 3) * n + j + 3] } else { 0.0 });
            let information = &block * block.transpose();
            return 1.0 / information.symmetric_eigenvalues().min().max(0.0).sqrt() / self.dph;
        }
        // the variance of coefficient i is the square of column i of the inverse root
        let (mut worst, mut sum) = (0.0f64, 0.0);
        let mut column = [0.0; MAX];
        for i in 3..n {
            column[i] = 1.0 / l[i * n + i];
            let mut variance = column[i] * column[i];
            for r in i + 1..n {
                let row = &l[r * n..=r * n + r];
                let product: f64 = row[i..r].iter().zip(&column[i..r]).map(|(a, b)| a * b).sum();
                column[r] = -product / row[r];
                variance += column[r] * column[r];
            }
            sum += variance;
            worst = worst.max(match criterion {
                Criterion::Margin(requirements) => variance / (requirements[i - 3] * requirements[i - 3]),
                _ => variance,
            });
        }
        match criterion {
            Criterion::A => (sum / d as f64).sqrt() / self.dph,
            // requirements are in deg/h already
            _ => worst.sqrt() / self.dph,
        }
    }

    /// The criterion of a whole sequence.
    pub fn of_sequence(&self, sequence: &[usize], criterion: &Criterion) -> f64 {
        let (mut now, mut next) = (self.start(), self.start());
        for &c in sequence {
            self.extend(&now, c, &mut next);
            std::mem::swap(&mut now, &mut next);
        }
        self.value(&now, criterion, &mut Vec::new())
    }
}

/// What makes one scheme better than another, all of the coefficients alone.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Criterion {
    /// The largest sigma.
    #[default]
    Worst,
    /// The root of the mean variance (A-optimal).
    A,
    /// The geometric mean of the principal sigmas: the volume of the error ellipsoid (D-optimal).
    D,
    /// The largest principal sigma (E-optimal).
    E,
    /// The largest sigma over its requirement (shape d, in deg/h per g).
    Margin(Vec<f64>),
}

/// The Schur complement of the first `leading` unknowns of a symmetric matrix (lower triangle); these are set to zero.
fn eliminate(m: &mut [[f64; MAX]; MAX], n: usize, leading: usize) {
    for p in 0..leading {
        let pivot = m[p][p];
        if pivot <= 0.0 {
            continue;
        }
        let column: [f64; MAX] = std::array::from_fn(|i| if i < n && i >= p { m[i][p] } else { 0.0 });
        for i in p + 1..n {
            for j in p + 1..=i {
                m[i][j] -= column[i] * column[j] / pivot;
            }
        }
        for row in m.iter_mut().take(n).skip(p) {
            row[p] = 0.0;
        }
    }
}
