//! What no scheme of some candidates can beat, where information adds over positions: duality of optimal design.
//!
//! Let `M = P + sum_i A_i` be the information of a scheme of k candidates (P: known beforehand). For every matrix X
//!
//! ```text
//! tr(V^T M^-1 V) >= tr(V^T X)^2 / tr(X^T M X)            (Cauchy and Schwarz in the inner product of M)
//! log det M_S    <= d log(tr(X^T M X) / d) - 2 log |det X_S|   (M_S: without the nuisance; X_S: those rows of X)
//! tr(X^T M X)    <= tr(X^T P X) + k max_i tr(X^T A_i X)
//! ```
//!
//! so any X gives a bound, whatever rounding did on the way to it, and the X of the optimal weights gives the best
//! (J. Kiefer and J. Wolfowitz, 1960, doi 10.4153/CJM-1960-030-4, for the determinant; F. Pukelsheim, *Optimal Design
//! of Experiments*, 1993, chapter 7, for the others).

use nalgebra::DMatrix;

use super::bounded::rounding;

/// What is to be small, of the inverse of an information matrix.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Aim {
    /// `det(S)^(1/d)`, S the block of what counts of the inverse (D-optimal).
    Volume,
    /// `mean_j v_j^T M^-1 v_j` (A-optimal), `v_j` the columns (m x t).
    Mean(DMatrix<f64>),
    /// The largest eigenvalue of S (E-optimal).
    Least,
    /// `max_j (o_j + v_j^T M^-1 v_j)`, `v_j` the columns (m x t), `o_j` the offsets (shape t).
    Largest(DMatrix<f64>, Vec<f64>),
}

/// Information that adds: a scheme takes one of the candidates, k times.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Additive {
    /// k times the information of each candidate (m x m), what does not count first.
    pub(super) candidates: Vec<DMatrix<f64>>,
    /// What is known beforehand (m x m).
    pub(super) prior: DMatrix<f64>,
    /// How many unknowns do not count.
    pub(super) nuisance: usize,
    /// What is to be small.
    pub(super) aim: Aim,
}

/// A matrix X with the weights of its columns: what proves a bound.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dual {
    /// m x t.
    pub(super) x: DMatrix<f64>,
    /// The weight of every column's aim, none below 0 (shape t, sum 1); empty where there are none.
    pub(super) shares: Vec<f64>,
}

impl Additive {
    pub(super) fn unknowns(&self) -> usize {
        self.prior.nrows()
    }

    /// How many unknowns count.
    pub(super) fn counting(&self) -> usize {
        self.unknowns() - self.nuisance
    }

    /// `tr(X^T A_i X)` of every candidate: the gradient of the aim by its weight, up to sign and factor.
    pub(super) fn gains(&self, x: &DMatrix<f64>) -> Vec<f64> {
        let w = x * x.transpose();
        self.candidates.iter().map(|a| a.dot(&w)).collect()
    }

    /// The aim is not below this at any weights of sum 1, hence in no scheme; 0 where nothing is known. Rounding in
    /// evaluating it is allowed for: what is claimed of matrices `A_i`, P as they are given.
    pub(super) fn lower_bound(&self, dual: &Dual) -> f64 {
        self.lower_bound_over(dual, 0.0)
    }

    /// The same where there are other candidates, none of which adds more than `others` to `tr(X^T M X)`.
    pub(super) fn lower_bound_over(&self, dual: &Dual, others: f64) -> f64 {
        let x = &dual.x;
        let (m, columns) = x.shape();
        let (w, size) = (x * x.transpose(), x.abs() * x.abs().transpose());
        // above what it is: entries of W are rounded as well as the sum over them
        let above = |a: &DMatrix<f64>| a.dot(&w) + rounding(m * m + columns) * a.abs().dot(&size);
        let most = self.candidates.iter().map(&above).fold(others, f64::max);
        let energy = above(&self.prior) + most;
        let shared = |vectors: &DMatrix<f64>| -> f64 {
            let column = |(j, share): (usize, &f64)| {
                let (v, x) = (vectors.column(j), x.column(j));
                let sizes: f64 = v.iter().zip(x.iter()).map(|(v, x)| (v * x).abs()).sum();
                share.sqrt() * (v.dot(&x) - rounding(m) * sizes)
            };
            let sum: f64 = dual.shares.iter().enumerate().map(column).sum();
            sum.max(0.0).powi(2) / energy
        };
        let d = self.counting() as f64;
        let bound = match &self.aim {
            Aim::Volume => {
                let logs = || (0..self.counting()).map(|j| x[(self.nuisance + j, j)].abs().ln());
                let sizes: f64 = logs().map(f64::abs).sum();
                d * (2.0 * logs().sum::<f64>() / d - 4.0 * f64::EPSILON * sizes).exp() / energy
            }
            Aim::Least => x.rows(self.nuisance, self.counting()).norm_squared() / energy,
            Aim::Mean(vectors) => shared(vectors),
            Aim::Largest(vectors, offsets) => {
                let known: f64 = offsets.iter().zip(&dual.shares).map(|(o, s)| o * s).sum();
                known + shared(vectors)
            }
        };
        // logarithms and shares are rounded too
        let bound = bound * (1.0 - rounding(m * columns));
        if bound.is_finite() { bound.max(0.0) } else { 0.0 }
    }
}
