//! Transition matrices that are the identity but for some rows.

use nalgebra::DMatrix;

use crate::error::{EkfError, check};

/// A transition matrix Phi (n x n) with the rows in which it differs from the identity: constants of the
/// model cost nothing to propagate.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    n: usize,
    active: Vec<usize>,
    /// The active rows of Phi, each of shape n, one after the other.
    rows: Vec<f64>,
}

impl Transition {
    /// The identity of n states.
    pub fn identity(n: usize) -> Self {
        Self { n, active: Vec::new(), rows: Vec::new() }
    }

    /// The transition of `phi`.
    ///
    /// # Errors
    /// [`EkfError`] unless `phi` is square and finite.
    pub fn new(phi: &DMatrix<f64>) -> Result<Self, EkfError> {
        let n = phi.nrows();
        check("Phi", phi, (n, n))?;
        let is_unit = |i: usize| (0..n).all(|j| phi[(i, j)] == f64::from(u8::from(i == j)));
        let active: Vec<usize> = (0..n).filter(|&i| !is_unit(i)).collect();
        let rows = active.iter().flat_map(|&i| (0..n).map(move |j| phi[(i, j)])).collect();
        Ok(Self { n, active, rows })
    }

    /// The identity but for the rows `active` (ascending), given one after the other, n numbers each.
    ///
    /// # Errors
    /// [`EkfError`] for rows that are not ascending states of the n, a wrong count of numbers, or one that is
    /// not finite.
    pub fn of_rows(n: usize, active: Vec<usize>, rows: Vec<f64>) -> Result<Self, EkfError> {
        let ascending = active.windows(2).all(|w| w[0] < w[1]);
        let last = active.last().map_or(0, |i| i + 1);
        if !ascending || last > n || rows.len() != n * active.len() {
            let found = (last.max(active.len()), rows.len().checked_div(active.len()).unwrap_or(0));
            return Err(EkfError::Shape { what: "Phi", expected: (n, n), found });
        }
        match rows.iter().position(|x| !x.is_finite()) {
            Some(k) => {
                let (row, column) = (active[k / n], k % n);
                Err(EkfError::NotFinite { what: "Phi", value: rows[k], row, column })
            }
            None => Ok(Self { n, active, rows }),
        }
    }

    /// The number of states.
    pub fn states(&self) -> usize {
        self.n
    }

    /// Transition with `constants` further states that are constant, after its own.
    #[must_use]
    pub fn widened(&self, constants: usize) -> Self {
        let n = self.n + constants;
        let mut rows = vec![0.0; n * self.active.len()];
        for (a, row) in rows.chunks_exact_mut(n.max(1)).enumerate() {
            row[..self.n].copy_from_slice(self.row(a));
        }
        Self { n, active: self.active.clone(), rows }
    }

    /// The rows that differ from the identity.
    pub fn active(&self) -> &[usize] {
        &self.active
    }

    /// The active row of index `a` (shape n).
    pub(crate) fn row(&self, a: usize) -> &[f64] {
        &self.rows[a * self.n..(a + 1) * self.n]
    }

    /// Phi as a matrix.
    pub fn matrix(&self) -> DMatrix<f64> {
        let mut phi = DMatrix::identity(self.n, self.n);
        for (a, &i) in self.active.iter().enumerate() {
            for (j, &x) in self.row(a).iter().enumerate() {
                phi[(i, j)] = x;
            }
        }
        phi
    }

    /// `x <- Phi x` (shape n); `scratch` has room for the active rows.
    pub fn apply(&self, x: &mut [f64], scratch: &mut Vec<f64>) {
        scratch.clear();
        scratch.extend((0..self.active.len()).map(|a| dot(self.row(a), x)));
        for (&i, &value) in self.active.iter().zip(scratch.iter()) {
            x[i] = value;
        }
    }
}

impl Transition {
    /// `x <- Phi^T x` (shape n); `scratch` has room for the active rows.
    pub(crate) fn apply_transposed(&self, x: &mut [f64], scratch: &mut Vec<f64>) {
        scratch.clear();
        scratch.extend(self.active.iter().map(|&i| x[i]));
        self.active.iter().for_each(|&i| x[i] = 0.0);
        for (row, y) in self.rows.chunks_exact(self.n.max(1)).zip(scratch.iter()) {
            x.iter_mut().zip(row).for_each(|(x, phi)| *x += phi * y);
        }
    }
}

/// The scalar product, in four partial sums.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (mut s, n) = ([0.0; 4], a.len().min(b.len()));
    let (ca, cb) = (a[..n].chunks_exact(4), b[..n].chunks_exact(4));
    let tail: f64 = ca.remainder().iter().zip(cb.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in ca.zip(cb) {
        for k in 0..4 {
            s[k] += x[k] * y[k];
        }
    }
    (s[0] + s[1]) + (s[2] + s[3]) + tail
}
