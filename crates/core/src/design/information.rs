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

    /// The largest sigma of a coefficient, in deg/h (per g); infinite when one is not determined.
    pub fn worst_sigma(&self, state: &State, root: &mut Vec<f64>) -> f64 {
        let n = self.n;
        let first = if self.carry == Carry::Reset { 3 } else { 0 };
        let m = n - first;
        // Cholesky of the information in reverse order of unknowns: the coefficients come first, psi last
        root.resize(m * m, 0.0);
        let l = &mut root[..];
        let entry = |i: usize, j: usize| {
            let (a, b) = (n - 1 - i, n - 1 - j);
            state.information[a.max(b) * n + a.min(b)]
        };
        for i in 0..m {
            let (done, rest) = l.split_at_mut(i * m);
            let row = &mut rest[..m];
            for j in 0..i {
                let other = &done[j * m..j * m + j + 1];
                let sum: f64 = row[..j].iter().zip(other).map(|(a, b)| a * b).sum();
                row[j] = (entry(i, j) - sum) / other[j];
            }
            let diagonal = entry(i, i);
            let pivot = diagonal - row[..i].iter().map(|a| a * a).sum::<f64>();
            // what rounding leaves of an undetermined direction
            if pivot <= 1e-13 * diagonal {
                return f64::INFINITY;
            }
            row[i] = pivot.sqrt();
        }
        // columns of L^-1: the variance of unknown i is the square of column i
        let mut worst = 0.0f64;
        let mut column = [0.0; MAX];
        for i in 0..n - 3 {
            column[i] = 1.0 / l[i * m + i];
            let mut variance = column[i] * column[i];
            for r in i + 1..m {
                let row = &l[r * m..r * m + r + 1];
                let sum: f64 = row[i..r].iter().zip(&column[i..r]).map(|(a, b)| a * b).sum();
                column[r] = -sum / row[r];
                variance += column[r] * column[r];
            }
            worst = worst.max(variance);
        }
        worst.sqrt() / self.dph
    }

    /// The worst sigma of a whole sequence.
    pub fn of_sequence(&self, sequence: &[usize]) -> f64 {
        let (mut now, mut next) = (self.start(), self.start());
        for &c in sequence {
            self.extend(&now, c, &mut next);
            std::mem::swap(&mut now, &mut next);
        }
        self.worst_sigma(&now, &mut Vec::new())
    }
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
