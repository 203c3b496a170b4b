//! Accuracy of psi at the end of a scheme, when the platform is used: requirements on psi refer to it.

use obsdeg_core::model::{Carry, LOCAL, PSI_EPS};

use crate::design::measure::evaluator::{CandidateAttitude, Evaluator, OwnPsi, SequenceState};
use crate::design::measure::stop::Stop;
use crate::design::request::limits::MAX_UNKNOWNS;

impl Evaluator {
    /// Sigma in deg of psi at the end of a sequence, in platform axes (inertial carry: those of its
    /// first position); under reset carry at the end of every position. It is infinite where psi is not
    /// determined. The list is empty if a coefficient that counts is not determined.
    pub fn psi_sigmas<S: Copy + Into<Stop>>(&self, sequence: &[S]) -> Vec<[f64; 3]> {
        let (state, mut root) = (self.state_of(sequence), Vec::new());
        if self.root(&state, &mut root) { self.psi_of(&state, &root) } else { Vec::new() }
    }

    /// Largest ratio of a sigma of psi to its limit in deg, dimensionless.
    pub(crate) fn psi_over(&self, state: &SequenceState, root: &[f64], limits: &[f64; 3]) -> f64 {
        if limits.iter().all(|l| l.is_infinite()) {
            return 0.0;
        }
        let over = |sigmas: [f64; 3]| sigmas.iter().zip(limits).map(|(s, l)| s / l).fold(0.0, f64::max);
        self.psi_of(state, root).into_iter().map(over).fold(0.0, f64::max)
    }

    /// Sigmas as [`Self::psi_sigmas`], from the Cholesky factor of the information of the sequence.
    fn psi_of(&self, state: &SequenceState, root: &[f64]) -> Vec<[f64; 3]> {
        let n = self.n;
        let sigma = |root: &[f64], psi: &[f64]| {
            solved(root, n, psi.iter().copied()).map_or(f64::INFINITY, |y| norm(&y).to_degrees())
        };
        match (self.carry(), state.path.first()) {
            (Carry::Reset, _) if let Some(bias) = &self.bias => (0..state.path.len())
                .map(|i| match self.root_with_psi(bias, &state.path, i) {
                    Some(root) => self.own_psi_at_end(state.path[i]).map(|psi| sigma(&root, &psi)),
                    None => [f64::INFINITY; 3],
                })
                .collect(),
            (Carry::Reset, _) => state.path.iter().map(|&c| self.psi_of_position(c, root)).collect(),
            // psi is carried in n: psi^c = C^T psi^n
            (Carry::Inertial, Some(&first)) => {
                let psi = self.in_platform_axes(first, &state.psi.each_ref().map(Vec::as_slice));
                vec![psi.map(|psi| sigma(root, &psi))]
            }
            _ => vec![state.psi.each_ref().map(|psi| sigma(root, psi))],
        }
    }

    /// `C^T X` of rows in n (3 x m), C the attitude of a candidate.
    fn in_platform_axes(&self, candidate: usize, rows: &[&[f64]; 3]) -> [Vec<f64>; 3] {
        let c = &self.candidates[candidate].c;
        let row = |k: usize| (0..rows[0].len()).map(|j| (0..3).map(|r| c[r][k] * rows[r][j]).sum()).collect();
        std::array::from_fn(row)
    }

    /// Psi in platform axes at the end of a position as a functional of psi at its start in these axes
    /// and of the coefficients (3 x n).
    fn own_psi_at_end(&self, candidate: usize) -> [Vec<f64>; 3] {
        let CandidateAttitude { c, effects, .. } = &self.candidates[candidate];
        let phi = &self.dwelling_of(candidate).phi;
        let entry = |r: usize, j: usize| match j.checked_sub(3) {
            None => (0..3).map(|i| phi[r][i] * c[i][j]).sum::<f64>(),
            Some(d) => (0..3).map(|i| phi[r][3 + i] * effects[i][d]).sum(),
        };
        let rows: [Vec<f64>; 3] = std::array::from_fn(|r| (0..self.n).map(|j| entry(r, j)).collect());
        self.in_platform_axes(candidate, &rows.each_ref().map(Vec::as_slice))
    }

    /// Information of a position, with the prior of its psi, on psi^n at its end: with itself and with
    /// the other local unknowns (3 x L). `psi(end) = A psi(start) + B eps` with a rotation A, so
    /// psi(start) is `A^T (psi(end) - B eps)`.
    fn information_at_end(&self, candidate: usize) -> [[f64; LOCAL]; 3] {
        let (c, dwelling) = self.stands(candidate);
        let phi = &dwelling.phi;
        let mut start: [[f64; LOCAL]; 3] = std::array::from_fn(|i| dwelling.local[i]);
        for (i, row) in start.iter_mut().enumerate() {
            for (j, x) in row[..3].iter_mut().enumerate() {
                *x += self.prior.psi.iter().enumerate().map(|(k, p)| c[i][k] * p * c[j][k]).sum::<f64>();
            }
        }
        // of psi(start) with psi(end) and the other unknowns
        let with: [[f64; LOCAL]; 3] = std::array::from_fn(|i| {
            let psi: [f64; 3] = std::array::from_fn(|j| (0..3).map(|k| start[i][k] * phi[j][k]).sum());
            std::array::from_fn(|j| match j {
                0..3 => psi[j],
                3..PSI_EPS => start[i][j] - (0..3).map(|k| psi[k] * phi[k][j]).sum::<f64>(),
                _ => start[i][j],
            })
        });
        std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| phi[i][k] * with[k][j]).sum()))
    }

    /// Sigma in deg of psi at the end of a position with a psi of its own; `root` is the factor of the
    /// information of the whole scheme on the coefficients.
    fn psi_of_position(&self, candidate: usize, root: &[f64]) -> [f64; 3] {
        let OwnPsi { variances, moved } = self.own_psi(candidate);
        let n = self.n;
        // L^-1 of the three at once
        let (mut z, mut sums) = ([[0.0; 3]; MAX_UNKNOWNS], *variances);
        for (i, moved) in moved.iter().enumerate() {
            let row = &root[(i + 3) * n + 3..=(i + 3) * n + i + 3];
            let mut rest = *moved;
            for (l, z) in row[..i].iter().zip(&z) {
                (0..3).for_each(|k| rest[k] -= l * z[k]);
            }
            if row[i] > 0.0 {
                z[i] = rest.map(|x| x / row[i]);
                (0..3).for_each(|k| sums[k] += z[i][k] * z[i][k]);
            } else {
                // components that the open direction affects
                (0..3).filter(|&k| rest[k].abs() >= OPEN).for_each(|k| sums[k] = f64::INFINITY);
            }
        }
        sums.map(|sum| sum.sqrt().to_degrees())
    }

    /// Psi of a single position, computed when first needed.
    pub(crate) fn own_psi(&self, candidate: usize) -> &OwnPsi {
        self.candidates[candidate].psi.get_or_init(|| self.psi_alone(candidate))
    }

    fn psi_alone(&self, candidate: usize) -> OwnPsi {
        let (n, c) = (self.n, &self.candidates[candidate].c);
        let effects = &self.candidates[candidate].effects;
        let local = self.information_at_end(candidate);
        // information on psi^c, and between psi^c and the coefficients
        let weighted = |k: usize, j: usize| (0..3).map(|r| c[r][k] * local[r][j]).sum::<f64>();
        let own = |i: usize, k: usize| (0..3).map(|r| weighted(i, r) * c[r][k]).sum::<f64>();
        let cross = |i: usize, d: usize| {
            let of = |(r, row): (usize, &Vec<f64>)| row.get(d).map_or(0.0, |x| weighted(i, 3 + r) * x);
            effects.iter().enumerate().map(of).sum::<f64>()
        };
        let mut l = [0.0; 9];
        for i in 0..3 {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| l[3 * i + k] * l[3 * j + k]).sum();
                let rest = own(i, j) - sum;
                l[3 * i + j] = match i == j {
                    true if rest <= 1e-13 * own(i, i) => 0.0,
                    true => rest.sqrt(),
                    false if l[4 * j] > 0.0 => rest / l[4 * j],
                    false => 0.0,
                };
            }
        }
        let cross: Vec<[f64; 3]> = (0..n - 3).map(|d| [0, 1, 2].map(|i| cross(i, d))).collect();
        let mut out = OwnPsi { variances: [f64::INFINITY; 3], moved: vec![[0.0; 3]; n - 3] };
        for k in 0..3 {
            let unit = (0..3).map(|r| f64::from(u8::from(r == k)));
            let Some(y) = solved(&l, 3, unit) else { continue };
            // A^-1 e = L^-T y, from the last row on
            let mut x = [0.0; 3];
            for i in (0..3).rev() {
                let sum: f64 = (i + 1..3).map(|j| l[3 * j + i] * x[j]).sum();
                x[i] = if l[4 * i] > 0.0 { (y[i] - sum) / l[4 * i] } else { 0.0 };
            }
            out.variances[k] = y.iter().map(|y| y * y).sum();
            for (moved, row) in out.moved.iter_mut().zip(&cross) {
                moved[k] = row.iter().zip(&x).map(|(c, x)| c * x).sum();
            }
        }
        out
    }
}

/// Tolerance below which a component along an undetermined direction is rounding.
const OPEN: f64 = 1e-12;

/// Solution `L^-1 b` for a lower triangular `l` (n x n); `None` where a zero on its diagonal leaves it
/// open.
fn solved(l: &[f64], n: usize, b: impl Iterator<Item = f64>) -> Option<Vec<f64>> {
    let mut y: Vec<f64> = Vec::with_capacity(n);
    for (i, b) in b.enumerate().take(n) {
        let row = &l[i * n..=i * n + i];
        let rest = b - row.iter().zip(&y).map(|(a, y)| a * y).sum::<f64>();
        y.push(match row[i] {
            d if d > 0.0 => rest / d,
            _ if rest.abs() < OPEN => 0.0,
            _ => return None,
        });
    }
    Some(y)
}

fn norm(y: &[f64]) -> f64 {
    y.iter().map(|x| x * x).sum::<f64>().sqrt()
}
