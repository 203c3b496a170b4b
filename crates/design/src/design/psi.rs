//! The accuracy of psi: what requirements on it are held against.

use obsdeg_core::model::Carry;

use super::information::{Evaluator, MAX, State};
use super::ways::Stop;

/// A position's own psi in platform axes.
#[derive(Debug, Clone)]
pub(super) struct OwnPsi {
    /// The variance in rad^2 of every component, prior included, where the coefficients are known; infinite where it is not determined.
    pub(super) variances: [f64; 3],
    /// By which functional of the coefficients each component is off where they are not known (d x 3, in the order of the evaluator);
    /// zero where it is not determined.
    pub(super) moved: Vec<[f64; 3]>,
}

impl Evaluator {
    /// Sigma in deg of psi in platform axes at the start of a whole sequence, or of its every position under reset
    /// carry; infinite where it is not determined, none when a coefficient that counts is not.
    pub fn psi_sigmas<S: Copy + Into<Stop>>(&self, sequence: &[S]) -> Vec<[f64; 3]> {
        let (state, mut root) = (self.state_of(sequence), Vec::new());
        if self.root(&state, &mut root) { self.psi_of(&state, &root) } else { Vec::new() }
    }

    /// The largest sigma of psi over its limit (deg).
    pub(super) fn psi_over(&self, state: &State, root: &[f64], limits: &[f64; 3]) -> f64 {
        if limits.iter().all(|l| l.is_infinite()) {
            return 0.0;
        }
        let over = |sigmas: [f64; 3]| sigmas.iter().zip(limits).map(|(s, l)| s / l).fold(0.0, f64::max);
        self.psi_of(state, root).into_iter().map(over).fold(0.0, f64::max)
    }

    /// Sigma in deg of psi in platform axes at the start, or of every position under reset carry; infinite where it is
    /// not determined.
    fn psi_of(&self, state: &State, root: &[f64]) -> Vec<[f64; 3]> {
        let n = self.n;
        let unit = |k: usize| -> [f64; 3] { std::array::from_fn(|r| f64::from(u8::from(r == k))) };
        match (self.carry(), state.path.first()) {
            (Carry::Reset, _) if let Some(bias) = &self.bias => (0..state.path.len())
                .map(|i| {
                    let root = self.root_with_psi(bias, &state.path, i);
                    let sigma = |root: &Vec<f64>, k| {
                        let psi = unit(k).into_iter().chain(std::iter::repeat_n(0.0, n - 3));
                        Some(norm(&solved(root, n, psi)?).to_degrees())
                    };
                    [0, 1, 2].map(|k| root.as_ref().and_then(|r| sigma(r, k)).unwrap_or(f64::INFINITY))
                })
                .collect(),
            (Carry::Reset, _) => state.path.iter().map(|&c| self.psi_of_position(c, root)).collect(),
            (carry, first) => {
                // psi is carried in platform axes, or in n: psi^c = C^T psi^n
                let inertial = first.filter(|_| carry == Carry::Inertial);
                let c = inertial.map_or_else(|| [0, 1, 2].map(unit), |&c| self.candidates[c].c);
                let sigma = |k: usize| {
                    let psi = (0..n).map(|r| if r < 3 { c[r][k] } else { 0.0 });
                    solved(root, n, psi).map_or(f64::INFINITY, |y| norm(&y).to_degrees())
                };
                vec![[0, 1, 2].map(sigma)]
            }
        }
    }

    /// Sigma in deg of psi of a position with a psi of its own, when the rest of the scheme knows the coefficients as
    /// `root` says.
    fn psi_of_position(&self, candidate: usize, root: &[f64]) -> [f64; 3] {
        let OwnPsi { variances, moved } = self.own_psi(candidate);
        let n = self.n;
        // L^-1 of the three at once
        let (mut z, mut sums) = ([[0.0; 3]; MAX], *variances);
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
                // what leaves it open
                (0..3).filter(|&k| rest[k].abs() >= OPEN).for_each(|k| sums[k] = f64::INFINITY);
            }
        }
        sums.map(|sum| sum.sqrt().to_degrees())
    }

    /// The psi of a position of its own, found when first asked for.
    pub(super) fn own_psi(&self, candidate: usize) -> &OwnPsi {
        self.candidates[candidate].psi.get_or_init(|| self.psi_alone(candidate))
    }

    fn psi_alone(&self, candidate: usize) -> OwnPsi {
        let (n, c) = (self.n, &self.candidates[candidate].c);
        let effects = &self.candidates[candidate].effects;
        let dwelling = self.dwelling_of(candidate);
        let local = |i: usize, j: usize| dwelling.local[i][j];
        // information on psi^c, and between psi^c and the coefficients
        let weighted = |k: usize, j: usize| (0..3).map(|r| c[r][k] * local(r, j)).sum::<f64>();
        let prior = |i: usize, k: usize| if i == k { self.prior.psi[k] } else { 0.0 };
        let own = |i: usize, k: usize| prior(i, k) + (0..3).map(|r| weighted(i, r) * c[r][k]).sum::<f64>();
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
            // A^-1 e = L^-T y, from the last
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

/// What is below is rounding, of what a zero on the diagonal leaves open.
const OPEN: f64 = 1e-12;

/// `L^-1 b` of a lower triangular `l` (n x n); `None` where a zero on its diagonal leaves it open.
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
