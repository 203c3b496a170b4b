//! Lower bounds on the criterion of every scheme of given candidates, where information adds over
//! positions: duality of optimal design.
//!
//! Let `M = P + sum_i A_i` be the information of a scheme of k candidates (P: the prior). For every
//! matrix X
//!
//! ```text
//! tr(V^T M^-1 V) >= tr(V^T X)^2 / tr(X^T M X)            (Cauchy and Schwarz in the inner product of M)
//! log det M_S    <= d log(tr(X^T M X) / d) - 2 log |det X_S|   (M_S, X_S: without the nuisance)
//! tr(X^T M X)    <= tr(X^T P X) + k max_i tr(X^T A_i X)
//! ```
//!
//! so every X gives a bound, whatever rounding error X has. The X of the optimal weights gives the
//! largest one (J. Kiefer and J. Wolfowitz, 1960, doi 10.4153/CJM-1960-030-4, for the determinant; F.
//! Pukelsheim, *Optimal Design of Experiments*, 1993, chapter 7, for the others).

use nalgebra::DMatrix;

use super::bounded::rounding;

/// Objective to minimise: a function of the inverse of an information matrix M. S is the block of this
/// inverse for the d unknowns that count.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Objective {
    /// `det(S)^(1/d)` (D-optimal).
    Volume,
    /// `mean_j v_j^T M^-1 v_j` (A-optimal), `v_j` the columns (m x t).
    Mean(DMatrix<f64>),
    /// Largest eigenvalue of S (E-optimal).
    Least,
    /// `max_j (o_j + v_j^T M^-1 v_j)`, `v_j` the columns (m x t), `o_j` the offsets (shape t).
    Largest(DMatrix<f64>, Vec<f64>),
}

/// Additive information: the sum over the k candidates of a scheme, repetitions allowed, and the prior.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Additive {
    /// k times the information of each candidate (m x m), unknowns that do not count first.
    pub(super) candidates: Vec<DMatrix<f64>>,
    /// Prior information (m x m).
    pub(super) prior: DMatrix<f64>,
    /// Number of unknowns that do not count.
    pub(super) nuisance: usize,
    /// Objective to minimise.
    pub(super) objective: Objective,
}

/// Dual variables: a matrix X with weights of the columns. They prove a lower bound.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DualVariables {
    /// Matrix X (m x t).
    pub(super) x: DMatrix<f64>,
    /// Weights of the terms `o_j + v_j^T M^-1 v_j`, none negative (shape t, sum 1); empty for other
    /// objectives.
    pub(super) shares: Vec<f64>,
}

impl Additive {
    pub(super) fn unknowns(&self) -> usize {
        self.prior.nrows()
    }

    /// Number of unknowns that count.
    pub(super) fn counting(&self) -> usize {
        self.unknowns() - self.nuisance
    }

    /// `tr(X^T A_i X)` of every candidate: the gradient of the objective with respect to its weight, up
    /// to sign and factor.
    pub(super) fn gains(&self, x: &DMatrix<f64>) -> Vec<f64> {
        let w = x * x.transpose();
        self.candidates.iter().map(|a| a.dot(&w)).collect()
    }

    /// Lower bound on the objective for all weights of sum 1, hence for every scheme; 0 if none is
    /// known. It allows for the rounding of its own evaluation; the matrices `A_i` and P count as
    /// exact.
    pub(super) fn lower_bound(&self, dual: &DualVariables) -> f64 {
        self.lower_bound_over(dual, 0.0)
    }

    /// Lower bound as [`Self::lower_bound`], with further candidates of which none adds more than
    /// `others` to `tr(X^T M X)`.
    pub(super) fn lower_bound_over(&self, dual: &DualVariables, others: f64) -> f64 {
        let x = &dual.x;
        let (m, columns) = x.shape();
        let (w, size) = (x * x.transpose(), x.abs() * x.abs().transpose());
        // upper bound: entries of W are rounded, and so is the sum over them
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
        let bound = match &self.objective {
            Objective::Volume => {
                let logs = || (0..self.counting()).map(|j| x[(self.nuisance + j, j)].abs().ln());
                let sizes: f64 = logs().map(f64::abs).sum();
                d * (2.0 * logs().sum::<f64>() / d - 4.0 * f64::EPSILON * sizes).exp() / energy
            }
            Objective::Least => x.rows(self.nuisance, self.counting()).norm_squared() / energy,
            Objective::Mean(vectors) => shared(vectors),
            Objective::Largest(vectors, offsets) => {
                let known: f64 = offsets.iter().zip(&dual.shares).map(|(o, s)| o * s).sum();
                known + shared(vectors)
            }
        };
        // logarithms and shares are rounded too
        let bound = bound * (1.0 - rounding(m * columns));
        if bound.is_finite() { bound.max(0.0) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::exact::{BallReal, BallRing, real};
    use super::super::weights::weigh;
    use super::*;
    use crate::design::measure::criterion::{Criterion, SigmaLimits};
    use crate::design::measure::evaluator::Evaluator;
    use obsdeg_core::model::{Angle, Carry, Euler, Ring, Scheme};
    use obsdeg_evidence::simulation::Conditions;
    use obsdeg_exact::SplitMix64;

    /// Bound that an X proves, in 512 bits, for the information of the candidates in double precision.
    fn proven(evaluator: &Evaluator, k: usize, problem: &Additive, dual: &DualVariables) -> BallReal {
        let (n, m) = (evaluator.n, problem.unknowns());
        let columns: Vec<Vec<BallReal>> =
            dual.x.column_iter().map(|c| c.iter().copied().map(real).collect()).collect();
        let square = real(evaluator.dph).mul(&real(evaluator.dph));
        let energy = |entry: &dyn Fn(usize, usize) -> f64| {
            let mut sum = BallReal::ZERO;
            for x in &columns {
                for (i, j) in (0..m).flat_map(|i| (0..m).map(move |j| (i, j))) {
                    sum = sum.add(&x[i].mul(&x[j]).mul(&real(entry(i, j))));
                }
            }
            sum
        };
        let most =
            evaluator.candidates.iter().map(|c| energy(&|i, j| c.own[(3 + i.max(j)) * n + 3 + i.min(j)]));
        let most = most.fold(BallReal::ZERO, |a, b| if b.sub(&a).is_positive() { b } else { a });
        let known = energy(&|i, j| if i == j { evaluator.prior.coefficients[i] } else { 0.0 });
        let energy = most.mul(&BallReal::from_i64(k as i64)).add(&known).mul(&square);
        let d = problem.counting();
        let counting = |j: usize| problem.nuisance + j;
        let over = |x: BallReal, y: &BallReal| x.div(y).expect("not zero");
        let shared = |vectors: &DMatrix<f64>| {
            let mut sum = BallReal::ZERO;
            for (j, x) in columns.iter().enumerate() {
                let v: Vec<BallReal> = vectors.column(j).iter().copied().map(real).collect();
                let root = real(dual.shares[j]).sqrt().unwrap_or(BallReal::ZERO);
                sum = sum.add(&root.mul(&BallRing.dot(v.iter().zip(x))));
            }
            over(sum.mul(&sum), &energy)
        };
        let shares = dual.shares.iter().fold(BallReal::ZERO, |sum, s| sum.add(&real(*s)));
        match &problem.objective {
            Objective::Volume => {
                let logs = (0..d).map(|j| columns[j][counting(j)].abs().ln().expect("positive"));
                let sum = logs.fold(BallReal::ZERO, |sum, x| sum.add(&x));
                let mean = over(sum.shifted(1), &BallReal::from_i64(d as i64));
                over(mean.exp().expect("finite").mul(&BallReal::from_i64(d as i64)), &energy)
            }
            Objective::Least => {
                let squares = columns.iter().flat_map(|x| x[problem.nuisance..].iter().map(|x| x.mul(x)));
                over(squares.fold(BallReal::ZERO, |sum, x| sum.add(&x)), &energy)
            }
            Objective::Mean(vectors) => over(shared(vectors), &shares),
            Objective::Largest(vectors, offsets) => {
                let known = offsets.iter().zip(&dual.shares).map(|(o, s)| real(*o).mul(&real(*s)));
                over(known.fold(shared(vectors), |sum, x| sum.add(&x)), &shares)
            }
        }
    }

    /// Random problems of every criterion: the bound in double precision is never above the one that
    /// its X proves in 512 bits, and below it by less than 1e-7, relative.
    #[test]
    fn no_bound_is_above_what_its_matrix_proves() {
        let mut rng = SplitMix64::new(43);
        let mut stated = 0;
        for task in 0..60 {
            let mut below = |n: u64| rng.below(n) as usize;
            let terms = ["F", "F,I", "F,O,S", "F,K0"][below(4)];
            let base = Scheme {
                carry: Carry::Reset,
                latitude: (5 + below(80)).to_string().parse().ok(),
                unknowns: terms.parse().expect("terms"),
                ..Scheme::default()
            };
            let candidates: Vec<Euler> = (0..8 + below(8))
                .map(|_| std::array::from_fn(|_| Angle::from_degrees(45 * below(8) as i32)))
                .collect();
            let counting: Vec<usize> = (0..3 * terms.split(',').count() - below(2)).collect();
            let psi = if task % 2 == 0 { [f64::INFINITY; 3] } else { [0.01; 3] };
            let limits = SigmaLimits { coefficients: vec![0.03; counting.len()], psi };
            let criteria =
                [Criterion::Worst, Criterion::A, Criterion::D, Criterion::E, Criterion::Margin(limits)];
            let criterion = &criteria[task % criteria.len()];
            let conditions = Conditions::default();
            let evaluator = Evaluator::new(&base, &candidates, &counting, &conditions).expect("an evaluator");
            let k = 3 + below(9);
            let problem = evaluator.additive(evaluator.objective(criterion), k);
            let Some(found) = weigh(&problem, &|| true) else { continue };
            let bound = problem.lower_bound(&found.dual);
            let truth = proven(&evaluator, k, &problem, &found.dual);
            assert!(truth.sub(&real(bound)).is_positive(), "task {task} {criterion:?}: {bound:e}");
            let part = truth.to_f64() / bound - 1.0;
            assert!(part < 1e-7, "task {task} {criterion:?}: {part:e}");
            stated += 1;
        }
        assert!(stated > 40, "{stated}");
    }
}
