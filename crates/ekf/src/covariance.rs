//! Covariance of the estimate, in one of two forms.
//!
//! - **Joseph**: P itself, symmetric, updated one scalar measurement at a time by
//!   `(I - k h) P (I - k h)^T + k r k^T`, in which rounding cannot make P indefinite to first order.
//! - **UD**: `P = U diag(d) U^T` with unit upper triangular U: Bierman's measurement update and Thornton's
//!   time update (Bierman 1977, *Factorization Methods for Discrete Sequential Estimation*, V.3, VI.4). It
//!   holds twice the digits and serves diffuse priors.

use nalgebra::DMatrix;

use crate::error::{EkfError, check_symmetric, is_positive};
use crate::transition::{Transition, dot};

/// Storage form of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CovarianceForm {
    /// P, updated in Joseph's form.
    #[default]
    Joseph,
    /// `U diag(d) U^T`.
    Ud,
}

/// One scalar measurement `z = h x + v`, `v ~ N(0, r)`, with the non-zero entries of h.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarOutput {
    /// `(state, coefficient)`.
    pub h: Vec<(usize, f64)>,
    /// Variance of the noise.
    pub r: f64,
}

impl ScalarOutput {
    /// `h x`.
    pub fn predict(&self, x: &[f64]) -> f64 {
        self.h.iter().map(|&(i, c)| c * x[i]).sum()
    }

    /// Checks that its states are among n, and that its variance is positive and finite.
    ///
    /// # Errors
    /// [`EkfError`].
    pub(crate) fn check(&self, n: usize) -> Result<(), EkfError> {
        check_entries("H", &self.h, n)?;
        if is_positive(self.r) && self.r.is_finite() {
            Ok(())
        } else {
            Err(EkfError::NotPositive { what: "R", value: self.r })
        }
    }
}

/// Checks that the entries of a row are finite and belong to n states.
fn check_entries(what: &'static str, row: &[(usize, f64)], n: usize) -> Result<(), EkfError> {
    match row.iter().find(|(state, x)| *state >= n || !x.is_finite()) {
        Some(&(column, value)) if column < n => Err(EkfError::NotFinite { what, value, row: 0, column }),
        Some(&(state, _)) => Err(EkfError::Shape { what, expected: (1, n), found: (1, state + 1) }),
        None => Ok(()),
    }
}

/// Noise that one step adds to the state: Q, positive semidefinite, with the states that it affects.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProcessNoise {
    states: Vec<usize>,
    /// Q on these states.
    q: DMatrix<f64>,
    /// `Q = G diag(d) G^T` on these states, column by column.
    factors: Vec<(f64, Vec<f64>)>,
}

impl ProcessNoise {
    /// No noise.
    pub fn none() -> Self {
        Self::default()
    }

    /// The noise of covariance `q` (n x n).
    ///
    /// # Errors
    /// [`EkfError`] unless q is finite, symmetric and positive semidefinite.
    pub fn new(q: &DMatrix<f64>) -> Result<Self, EkfError> {
        let n = q.nrows();
        check_symmetric("Q", q, n)?;
        let states: Vec<usize> = (0..n).filter(|&i| (0..n).any(|j| q[(i, j)] != 0.0)).collect();
        let m = states.len();
        let block = DMatrix::from_fn(m, m, |i, j| q[(states[i], states[j])]);
        let (u, d) = ud_factors("Q", &block, false)?;
        let column = |j: usize| (0..m).map(|i| u[(i, j)]).collect();
        let factors = (0..m).filter(|&j| d[j] > 0.0).map(|j| (d[j], column(j))).collect();
        Ok(Self { states, q: block, factors })
    }
}

/// Result of one scalar update.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// The Kalman gain (shape n).
    pub k: Vec<f64>,
    /// Variance of the innovation, `h P h^T + r`.
    pub s: f64,
}

/// A covariance matrix (n x n).
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    n: usize,
    form: CovarianceForm,
    /// Column by column: P (symmetric), or U (unit upper triangular, diagonal not stored).
    m: Vec<f64>,
    /// The diagonal of D in the UD form.
    d: Vec<f64>,
    scratch: Vec<f64>,
}

impl Covariance {
    /// The covariance `p`.
    ///
    /// # Errors
    /// [`EkfError`] unless `p` is finite, symmetric and positive definite.
    pub fn new(what: &'static str, p: &DMatrix<f64>, form: CovarianceForm) -> Result<Self, EkfError> {
        let n = p.nrows();
        check_symmetric(what, p, n)?;
        let (u, d) = ud_factors(what, p, true)?;
        let m = if form == CovarianceForm::Joseph { p } else { &u };
        Ok(Self { n, form, m: m.as_slice().to_vec(), d, scratch: Vec::new() })
    }

    /// The number of states.
    pub fn states(&self) -> usize {
        self.n
    }

    /// P as a matrix.
    pub fn matrix(&self) -> DMatrix<f64> {
        let n = self.n;
        match self.form {
            CovarianceForm::Joseph => DMatrix::from_column_slice(n, n, &self.m),
            CovarianceForm::Ud => {
                let u = DMatrix::from_fn(n, n, |i, j| self.u(i, j));
                let mut scaled = u.clone();
                for (j, &d) in self.d.iter().enumerate() {
                    scaled.column_mut(j).scale_mut(d);
                }
                scaled * u.transpose()
            }
        }
    }

    /// The standard deviation of every state.
    pub fn sigmas(&self) -> Vec<f64> {
        (0..self.n)
            .map(|i| match self.form {
                CovarianceForm::Joseph => self.m[i * self.n + i].max(0.0).sqrt(),
                CovarianceForm::Ud => {
                    (i..self.n).map(|j| self.u(i, j).powi(2) * self.d[j]).sum::<f64>().sqrt()
                }
            })
            .collect()
    }

    /// The variance `c P c^T` of a functional, given by its non-zero entries.
    ///
    /// # Errors
    /// [`EkfError`] for an entry that is not finite, or is of no state.
    pub fn variance(&self, c: &[(usize, f64)]) -> Result<f64, EkfError> {
        check_entries("c", c, self.n)?;
        Ok(match self.form {
            CovarianceForm::Joseph => {
                let row = |i: usize| c.iter().map(|&(j, b)| b * self.m[j * self.n + i]).sum::<f64>();
                c.iter().map(|&(i, a)| a * row(i)).sum()
            }
            // the columns of U first: large variances cancel there, not in P
            CovarianceForm::Ud => (0..self.n)
                .map(|j| c.iter().map(|&(i, a)| a * self.u(i, j)).sum::<f64>().powi(2) * self.d[j])
                .sum(),
        })
    }

    fn u(&self, i: usize, j: usize) -> f64 {
        match i.cmp(&j) {
            std::cmp::Ordering::Less => self.m[j * self.n + i],
            std::cmp::Ordering::Equal => 1.0,
            std::cmp::Ordering::Greater => 0.0,
        }
    }

    /// Propagates the covariance: `P <- Phi P Phi^T + Q`.
    ///
    /// # Errors
    /// [`EkfError::Shape`] unless Phi and Q are of the states of P.
    pub fn propagate(&mut self, phi: &Transition, noise: &ProcessNoise) -> Result<(), EkfError> {
        check_step(self.n, phi, noise)?;
        self.propagate_checked(phi, noise);
        Ok(())
    }

    /// Propagates the covariance for a step that was checked.
    pub(crate) fn propagate_checked(&mut self, phi: &Transition, noise: &ProcessNoise) {
        match self.form {
            CovarianceForm::Joseph => self.propagate_full(phi, noise),
            CovarianceForm::Ud => self.propagate_ud(phi, noise),
        }
    }

    fn propagate_full(&mut self, phi: &Transition, noise: &ProcessNoise) {
        let (n, active) = (self.n, phi.active());
        // M = Phi_a P, row by row; P is symmetric, so its rows are its columns
        self.scratch.clear();
        for a in 0..active.len() {
            let row = phi.row(a);
            self.scratch.extend(self.m.chunks_exact(n).map(|column| dot(row, column)));
        }
        for (a, &i) in active.iter().enumerate() {
            let ma = &self.scratch[a * n..(a + 1) * n];
            for (j, &x) in ma.iter().enumerate() {
                self.m[j * n + i] = x;
                self.m[i * n + j] = x;
            }
        }
        for (a, &i) in active.iter().enumerate() {
            let ma = &self.scratch[a * n..(a + 1) * n];
            for (b, &j) in active.iter().enumerate().take(a + 1) {
                let x = dot(ma, phi.row(b));
                self.m[j * n + i] = x;
                self.m[i * n + j] = x;
            }
        }
        for (b, &j) in noise.states.iter().enumerate() {
            for (a, &i) in noise.states.iter().enumerate() {
                self.m[j * n + i] += noise.q[(a, b)];
            }
        }
    }

    /// Thornton's modified weighted Gram-Schmidt orthogonalisation of `[Phi U, G]` with weights `[d,
    /// d_q]`. States after the last changed one keep their rows of U and their d; in their columns the
    /// changed rows of `Phi U` are those of the new U. Only the block before them is orthogonalised.
    fn propagate_ud(&mut self, phi: &Transition, noise: &ProcessNoise) {
        let n = self.n;
        let Some(last) = phi.active().iter().chain(&noise.states).max() else { return };
        let (lead, width) = (last + 1, last + 1 + noise.factors.len());
        let mut buffer = std::mem::take(&mut self.scratch);
        buffer.clear();
        buffer.resize((lead + 2) * width + phi.active().len() * n, 0.0);
        let (w, rest) = buffer.split_at_mut(lead * width);
        let (weights, rest) = rest.split_at_mut(width);
        let (weighted, products) = rest.split_at_mut(width);
        // the changed rows of Phi U; U is unit upper triangular
        for (a, product) in products.chunks_exact_mut(n).enumerate() {
            let row = phi.row(a);
            for (j, x) in product.iter_mut().enumerate() {
                *x = row[j] + dot(&row[..j], &self.m[j * n..j * n + j]);
            }
        }
        for (i, row) in w.chunks_exact_mut(width).enumerate() {
            row[i] = 1.0;
            for (j, x) in row.iter_mut().enumerate().take(lead).skip(i + 1) {
                *x = self.m[j * n + i];
            }
        }
        for (&i, product) in phi.active().iter().zip(products.chunks_exact(n)) {
            w[i * width..i * width + lead].copy_from_slice(&product[..lead]);
            for (j, &x) in product.iter().enumerate().skip(lead) {
                self.m[j * n + i] = x;
            }
        }
        weights[..lead].copy_from_slice(&self.d[..lead]);
        for (k, (d, g)) in noise.factors.iter().enumerate() {
            weights[lead + k] = *d;
            for (&i, &x) in noise.states.iter().zip(g) {
                w[i * width + lead + k] = x;
            }
        }
        for j in (0..lead).rev() {
            let (above, row) = w.split_at_mut(j * width);
            let row = &row[..width];
            for ((x, &y), &d) in weighted.iter_mut().zip(row).zip(weights.iter()) {
                *x = y * d;
            }
            let d = dot(weighted, row);
            self.d[j] = d;
            for (i, upper) in above.chunks_exact_mut(width).enumerate() {
                let u = if d > 0.0 { dot(upper, weighted) / d } else { 0.0 };
                self.m[j * n + i] = u;
                for (x, &y) in upper.iter_mut().zip(row) {
                    *x -= u * y;
                }
            }
        }
        self.scratch = buffer;
    }

    /// Updates the covariance by one scalar measurement; the gain goes to `gain` (its `k` is resized to
    /// n).
    ///
    /// # Errors
    /// [`EkfError`] for an output with other states, or without noise; nothing has changed then.
    pub fn update(&mut self, output: &ScalarOutput, gain: &mut Gain) -> Result<(), EkfError> {
        output.check(self.n)?;
        self.update_checked(output, gain);
        Ok(())
    }

    /// Updates the covariance by an output that was checked.
    pub(crate) fn update_checked(&mut self, output: &ScalarOutput, gain: &mut Gain) {
        gain.k.resize(self.n, 0.0);
        match self.form {
            CovarianceForm::Joseph => self.update_joseph(output, gain),
            CovarianceForm::Ud => self.update_bierman(output, gain),
        }
    }

    fn update_joseph(&mut self, output: &ScalarOutput, gain: &mut Gain) {
        let n = self.n;
        // p = P h^T
        let mut buffer = std::mem::take(&mut self.scratch);
        buffer.clear();
        buffer.resize(2 * n, 0.0);
        let (p, rest) = buffer.split_at_mut(n);
        for &(i, c) in &output.h {
            for (x, &y) in p.iter_mut().zip(&self.m[i * n..(i + 1) * n]) {
                *x += c * y;
            }
        }
        gain.s = output.predict(p) + output.r;
        let inverse = 1.0 / gain.s;
        for (k, &x) in gain.k.iter_mut().zip(p.iter()) {
            *k = x * inverse;
        }
        // with P1 = P - k p^T: P+ = P1 - (P1 h^T) k^T + r k k^T; `rest` is r k - P1 h^T
        for (x, &k) in rest.iter_mut().zip(&gain.k) {
            *x = output.r * k;
        }
        for &(i, c) in &output.h {
            let column = &self.m[i * n..(i + 1) * n];
            for ((x, &y), &k) in rest.iter_mut().zip(column).zip(&gain.k) {
                *x -= c * (y - k * p[i]);
            }
        }
        for j in 0..n {
            let (pj, kj) = (p[j], gain.k[j]);
            let column = &mut self.m[j * n..(j + 1) * n];
            for ((x, &k), &t) in column[j..].iter_mut().zip(&gain.k[j..]).zip(&rest[j..]) {
                *x += t * kj - k * pj;
            }
        }
        for j in 0..n {
            for i in j + 1..n {
                self.m[i * n + j] = self.m[j * n + i];
            }
        }
        self.scratch = buffer;
    }

    fn update_bierman(&mut self, output: &ScalarOutput, gain: &mut Gain) {
        let n = self.n;
        let mut alpha = output.r;
        for j in 0..n {
            let column = &mut self.m[j * n..j * n + j];
            // f = U^T h, g = D f
            let f: f64 = output
                .h
                .iter()
                .map(|&(i, c)| match i.cmp(&j) {
                    std::cmp::Ordering::Less => c * column[i],
                    std::cmp::Ordering::Equal => c,
                    std::cmp::Ordering::Greater => 0.0,
                })
                .sum();
            let g = self.d[j] * f;
            let before = alpha;
            alpha += f * g;
            self.d[j] *= before / alpha;
            let lambda = -f / before;
            for (u, k) in column.iter_mut().zip(gain.k.iter_mut()) {
                let old = *u;
                *u += lambda * *k;
                *k += old * g;
            }
            gain.k[j] = g;
        }
        gain.s = alpha;
        let inverse = 1.0 / alpha;
        for k in &mut gain.k {
            *k *= inverse;
        }
    }

    /// `(U, d)` with `P = U diag(d) U^T`: U column by column, only above the diagonal.
    ///
    /// # Errors
    /// [`EkfError::NotPositiveDefinite`] when P itself has lost it.
    pub(crate) fn factors(&self) -> Result<(Vec<f64>, Vec<f64>), EkfError> {
        match self.form {
            CovarianceForm::Ud => Ok((self.m.clone(), self.d.clone())),
            CovarianceForm::Joseph => {
                let (u, d) = ud_factors("P", &self.matrix(), true)?;
                Ok((u.as_slice().to_vec(), d))
            }
        }
    }
}

/// Checks that Phi and Q of a step have n states.
///
/// # Errors
/// [`EkfError::Shape`].
pub(crate) fn check_step(n: usize, phi: &Transition, noise: &ProcessNoise) -> Result<(), EkfError> {
    let refuse = |what, found| Err(EkfError::Shape { what, expected: (n, n), found: (found, found) });
    match noise.states.last() {
        _ if phi.states() != n => refuse("Phi", phi.states()),
        Some(&last) if last >= n => refuse("Q", last + 1),
        _ => Ok(()),
    }
}

/// `p = U diag(d) U^T` with unit upper triangular U.
///
/// # Errors
/// [`EkfError`] when a pivot is negative, or zero where `definite`.
pub(crate) fn ud_factors(
    what: &'static str,
    p: &DMatrix<f64>,
    definite: bool,
) -> Result<(DMatrix<f64>, Vec<f64>), EkfError> {
    let n = p.nrows();
    let mut a = p.clone();
    let mut u = DMatrix::identity(n, n);
    let mut d = vec![0.0; n];
    for j in (0..n).rev() {
        let pivot = a[(j, j)];
        let rounding = 1e-14 * p[(j, j)].abs() * n as f64;
        if definite && !is_positive(pivot) {
            return Err(EkfError::NotPositiveDefinite { what, pivot, row: j });
        }
        if pivot < -rounding {
            return Err(EkfError::NotPositiveSemidefinite { what, pivot, row: j });
        }
        if !definite && pivot <= rounding {
            // the column of a zero pivot must be zero
            if let Some(row) =
                (0..j).find(|&i| a[(i, j)].abs() > 1e-9 * (a[(i, i)].abs() * p[(j, j)].abs()).sqrt())
            {
                return Err(EkfError::NotPositiveSemidefinite { what, pivot, row });
            }
            continue;
        }
        d[j] = pivot;
        for i in 0..j {
            u[(i, j)] = a[(i, j)] / pivot;
        }
        for c in 0..j {
            for r in 0..=c {
                a[(r, c)] -= u[(r, j)] * pivot * u[(c, j)];
                a[(c, r)] = a[(r, c)];
            }
        }
    }
    Ok((u, d))
}
