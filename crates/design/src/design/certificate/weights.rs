//! Optimal weights of candidates: a primal-dual interior-point method on the simplex. Candidates are
//! added as they are needed (column generation).
//!
//! With the objective f convex in the weights, `tau f(w) - sum_i ln w_i` has its minimum within N / tau
//! of the least f. Newton's method follows these minima as tau grows. The curvature of the barriers is
//! that of their multipliers (S. J. Wright, *Primal-Dual Interior-Point Methods*, 1997); without them
//! weights go to zero slowly. The matrix X of each minimum gives a bound, valid whether or not the
//! minimum is reached (`bound`).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::bound::{Additive, DualVariables, Objective};

/// Relative gap between the objective and its bound at which the search for weights ends.
const GAP: f64 = 1e-7;
/// Factor on tau between two minima.
const FASTER: f64 = 12.0;
/// Newton decrement below which tau is increased.
const CENTRED: f64 = 1e-6;
/// Largest fraction of the distance to zero that a step may cover.
const INSIDE: f64 = 0.95;
/// Largest number of Newton steps to one minimum.
const STEPS: usize = 40;
/// Number of candidates that column generation starts with.
const ACTIVE: usize = 160;
/// Largest number of rounds of column generation.
const ROUNDS: usize = 60;
/// Relative gap above which the attained objective is a result of the ridge.
const SINGULAR: f64 = 1e-6;
/// Numbers of digits tried for listed weights.
const DIGITS: [i32; 3] = [2, 3, 4];
const FAINT: f64 = 1e-7;
const COARSE: f64 = 1e-3;
/// Ridge added to the information, as a fraction of the mean information: it makes undetermined
/// directions regular.
const RIDGE: f64 = 1e-13;

/// Optimal weights with the bound that they prove.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OptimalWeights {
    /// Weight of every candidate, dimensionless (sum 1).
    pub(super) weights: Vec<f64>,
    /// Objective at these weights.
    pub(super) attained: f64,
    /// Lower bound on the objective of every scheme.
    pub(super) bound: f64,
    /// Dual variables that prove the bound; their X gives the gain of any other candidate.
    pub(super) dual: DualVariables,
}

/// Barrier function at some weights, with the Cholesky factor of the information.
struct BarrierPoint {
    root: Cholesky<f64, Dyn>,
    /// `tau f`, with the barriers of the constraints of the objective itself.
    value: f64,
}

/// First and second derivatives of the part of the barrier function that depends on the objective.
struct BarrierSlopes {
    /// Gradient with respect to the weights (shape n).
    gradient: Vec<f64>,
    /// Hessian with respect to the weights (n x n); s is at its minimum for the weights.
    hessian: DMatrix<f64>,
    /// Derivatives with respect to s, and of its minimum; `None` if the objective has no s.
    by_s: Option<ByS>,
}

struct ByS {
    gradient: f64,
    curvature: f64,
    /// `ds/dw` (shape n).
    follows: Vec<f64>,
}

/// Barrier problem for a subset of the candidates.
struct WeightProblem<'a> {
    problem: &'a Additive,
    /// Indices of the candidates.
    active: Vec<usize>,
    /// Factors `F_i` of `A_i = F_i^T F_i` (r x m).
    factors: Vec<DMatrix<f64>>,
    ridge: f64,
}

/// Optimal weights and the bound that they prove; stops when `proceed` returns false. `None` where all
/// candidates together do not determine the unknowns that count in double precision.
pub(super) fn weigh(problem: &Additive, proceed: &dyn Fn() -> bool) -> Option<OptimalWeights> {
    // the result is unknown if it depends on the ridge, and if rounding decides without the ridge
    [RIDGE, 0.0].into_iter().find_map(|ridge| {
        let found = generated(problem, ridge, proceed)?;
        let singular = found.bound > found.attained * (1.0 + SINGULAR);
        (!singular).then(|| OptimalWeights { attained: found.attained.max(found.bound), ..found })
    })
}

/// Weights as they are listed, and the objective at these divided by their sum. They have two digits,
/// or more where the objective is worse by more than [`COARSE`]. `None` where rounded weights do not
/// determine the unknowns that count.
pub(super) fn listed(problem: &Additive, weights: &[f64]) -> Option<(Vec<f64>, f64)> {
    let of = |weights: &[f64]| {
        let active: Vec<usize> = (0..weights.len()).filter(|&i| weights[i] > 0.0).collect();
        let sum: f64 = weights.iter().sum();
        let parts: Vec<f64> = active.iter().map(|&i| weights[i] / sum).collect();
        WeightProblem::new(problem, active, 0.0).objective(&parts)
    };
    let least = of(weights)?;
    let found = DIGITS.iter().filter_map(|&digits| {
        let weights: Vec<f64> = weights.iter().map(|&w| rounded(w, digits)).collect();
        let objective = of(&weights)?;
        Some((weights, objective))
    });
    let mut last = None;
    for (weights, objective) in found {
        let near = objective <= least * (1.0 + COARSE);
        last = Some((weights, objective));
        if near {
            break;
        }
    }
    last
}

/// Weight rounded to `digits` digits; 0 below [`FAINT`].
fn rounded(weight: f64, digits: i32) -> f64 {
    if weight < FAINT {
        return 0.0;
    }
    let unit = 10f64.powi(digits - 1 - weight.log10().floor() as i32);
    (weight * unit).round() / unit
}

/// Optimal weights as [`weigh`], by column generation with the given ridge.
fn generated(problem: &Additive, ridge: f64, proceed: &dyn Fn() -> bool) -> Option<OptimalWeights> {
    let all = problem.candidates.len();
    let mean = problem.candidates.iter().map(DMatrix::trace).sum::<f64>() / all as f64;
    let ridge = ridge * (mean + problem.prior.trace()) / problem.unknowns() as f64;
    let every = all.div_ceil(ACTIVE).max(1);
    let mut active: Vec<usize> = (0..all).step_by(every).collect();
    let mut best: Option<OptimalWeights> = None;
    for _ in 0..ROUNDS {
        let weighing = WeightProblem::new(problem, active.clone(), ridge);
        let Some(found) = weighing.weigh(proceed) else {
            // these candidates do not determine the unknowns that count: add more
            let missing = (0..all).filter(|i| !active.contains(i)).step_by(2).collect::<Vec<_>>();
            if missing.is_empty() {
                return best;
            }
            active.extend(missing);
            continue;
        };
        let bound = best.as_ref().map_or(0.0, |b| b.bound);
        let gains = problem.gains(&found.dual.x);
        let of_active = active.iter().map(|&i| gains[i]).fold(0.0, f64::max);
        let weights = found.weights.clone();
        if bound < found.bound {
            best = Some(found);
        } else if let Some(best) = &mut best {
            (best.weights, best.attained) = (found.weights, found.attained);
        }
        let mut missing: Vec<usize> =
            (0..all).filter(|&i| gains[i] > of_active * (1.0 + GAP) && !active.contains(&i)).collect();
        if missing.is_empty() || !proceed() {
            break;
        }
        missing.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]));
        missing.truncate(ACTIVE / 4);
        // candidates without weight and with a small gain are dropped
        let counts = |i: &usize| weights[*i] > 1e-7 || gains[*i] > 0.98 * of_active;
        active.retain(counts);
        active.extend(missing);
    }
    best
}

/// Factor `F` with `A = F^T F` and as many rows as the rank of A, by Cholesky's decomposition with
/// pivots.
fn factor(a: &DMatrix<f64>) -> DMatrix<f64> {
    let m = a.nrows();
    let mut rest = a.clone();
    let least = 1e-12 * a.trace();
    let mut rows: Vec<DVector<f64>> = Vec::new();
    while rows.len() < m {
        let (pivot, size) = rest.diagonal().argmax();
        if size <= least {
            break;
        }
        let row = rest.column(pivot) / size.sqrt();
        rest -= &row * row.transpose();
        rows.push(row);
    }
    DMatrix::from_fn(rows.len(), m, |i, j| rows[i][j])
}

impl<'a> WeightProblem<'a> {
    fn new(problem: &'a Additive, active: Vec<usize>, ridge: f64) -> Self {
        let factors = active.iter().map(|&i| factor(&problem.candidates[i])).collect();
        Self { problem, active, factors, ridge }
    }

    fn information(&self, w: &[f64]) -> DMatrix<f64> {
        let m = self.problem.unknowns();
        let mut out = self.problem.prior.clone() + DMatrix::identity(m, m) * self.ridge;
        for (&i, &w) in self.active.iter().zip(w) {
            out.zip_apply(&self.problem.candidates[i], |sum, a| *sum += w * a);
        }
        out
    }

    /// Information reduced for E-optimality: `M - s` on the unknowns that count.
    fn reduced(&self, w: &[f64], s: f64) -> DMatrix<f64> {
        let mut out = self.information(w);
        if self.problem.objective == Objective::Least {
            (self.problem.nuisance..self.problem.unknowns()).for_each(|i| out[(i, i)] -= s);
        }
        out
    }

    /// `M^-1 v_j` of the columns of the objective (m x t), and `v_j^T M^-1 v_j` (shape t).
    fn solved(&self, root: &Cholesky<f64, Dyn>) -> (DMatrix<f64>, Vec<f64>) {
        match &self.problem.objective {
            Objective::Mean(vectors) | Objective::Largest(vectors, _) => {
                let u = root.solve(vectors);
                let values = (0..vectors.ncols()).map(|j| vectors.column(j).dot(&u.column(j))).collect();
                (u, values)
            }
            Objective::Volume | Objective::Least => (DMatrix::zeros(self.problem.unknowns(), 0), Vec::new()),
        }
    }

    /// Objective `-log det M_S / d`.
    fn volume(&self, root: &Cholesky<f64, Dyn>) -> f64 {
        let l = root.l_dirty();
        let counting = self.problem.nuisance..self.problem.unknowns();
        -2.0 * counting.map(|j| l[(j, j)].ln()).sum::<f64>() / self.problem.counting() as f64
    }

    /// Objective at the weights `w`.
    fn objective(&self, w: &[f64]) -> Option<f64> {
        let root = self.information(w).cholesky()?;
        let value = match &self.problem.objective {
            Objective::Volume => self.volume(&root).exp(),
            Objective::Mean(vectors) => self.solved(&root).1.iter().sum::<f64>() / vectors.ncols() as f64,
            Objective::Largest(_, offsets) => {
                self.solved(&root).1.iter().zip(offsets).map(|(v, o)| v + o).fold(0.0, f64::max)
            }
            Objective::Least => {
                let (first, d) = (self.problem.nuisance, self.problem.counting());
                root.inverse().view((first, first), (d, d)).into_owned().symmetric_eigenvalues().max()
            }
        };
        Some(value).filter(|v| v.is_finite() && *v > 0.0)
    }

    /// `tau f / scale` with the barriers of the objective, not those of the weights; `None` outside its
    /// domain.
    fn at(&self, w: &[f64], s: f64, tau: f64, scale: f64) -> Option<BarrierPoint> {
        let root = self.reduced(w, s).cholesky()?;
        let value = match &self.problem.objective {
            Objective::Volume => tau * self.volume(&root),
            Objective::Mean(vectors) => {
                tau * self.solved(&root).1.iter().sum::<f64>() / vectors.ncols() as f64 / scale
            }
            Objective::Largest(_, offsets) => {
                let (s, left) = slacks_of(&self.solved(&root).1, offsets, tau / scale)?;
                tau * s / scale - left.iter().map(|left| (left / scale).ln()).sum::<f64>()
            }
            Objective::Least => {
                let l = root.l_dirty();
                -tau * s / scale - 2.0 * (0..l.nrows()).map(|j| l[(j, j)].ln()).sum::<f64>()
            }
        };
        value.is_finite().then_some(BarrierPoint { root, value })
    }

    /// Weights that minimise the objective, step by step, with the best bound of all steps.
    fn weigh(&self, proceed: &dyn Fn() -> bool) -> Option<OptimalWeights> {
        let n = self.active.len();
        let mut w = vec![1.0 / n as f64; n];
        let mut scale = self.objective(&w)?;
        let least = self.problem.objective == Objective::Least;
        let mut s = if least { 0.5 / scale } else { 0.0 };
        let mut best: Option<OptimalWeights> = None;
        let mut tau = n as f64;
        let mut multipliers: Vec<f64> = w.iter().map(|w| 1.0 / w).collect();
        while tau < 1e3 * n as f64 / GAP {
            let unit = if least { 1.0 / scale } else { scale };
            for _ in 0..STEPS {
                let Some(decrement) = self.newton(&mut w, &mut s, &mut multipliers, tau, unit) else { break };
                if decrement < CENTRED {
                    break;
                }
            }
            scale = self.objective(&w)?;
            let dual = self.dual(&w, s, tau / unit)?;
            let bound = self.problem.lower_bound(&dual);
            if best.as_ref().is_none_or(|b| bound > b.bound) {
                let mut weights = vec![0.0; self.problem.candidates.len()];
                self.active.iter().zip(&w).for_each(|(&i, &w)| weights[i] = w);
                best = Some(OptimalWeights { weights, attained: scale, bound, dual });
            }
            let sought = best.as_ref().map_or(0.0, |b| b.attained / b.bound - 1.0);
            if sought < GAP || !proceed() {
                break;
            }
            tau *= FASTER;
            multipliers.iter_mut().for_each(|x| *x *= FASTER);
        }
        best
    }

    /// Dual variables at the weights `w`.
    fn dual(&self, w: &[f64], s: f64, rate: f64) -> Option<DualVariables> {
        let problem = self.problem;
        let m = problem.unknowns();
        // factor of an inverse: L^-T, upper triangular
        let inverse_root = |root: &Cholesky<f64, Dyn>| {
            let upper = root.l().transpose();
            upper.solve_upper_triangular(&DMatrix::identity(m, m))
        };
        match &problem.objective {
            Objective::Volume => {
                let root = self.information(w).cholesky()?;
                let x = inverse_root(&root)?.columns(problem.nuisance, problem.counting()).into_owned();
                Some(DualVariables { x, shares: Vec::new() })
            }
            Objective::Least => {
                Some(DualVariables { x: inverse_root(&self.reduced(w, s).cholesky()?)?, shares: Vec::new() })
            }
            Objective::Mean(vectors) => {
                let share = 1.0 / vectors.ncols() as f64;
                let root = self.information(w).cholesky()?;
                let x = self.solved(&root).0 * share.sqrt();
                Some(DualVariables { x, shares: vec![share; vectors.ncols()] })
            }
            Objective::Largest(_, offsets) => {
                let root = self.information(w).cholesky()?;
                let (mut x, values) = self.solved(&root);
                let shares = multipliers_of(&slacks_of(&values, offsets, rate)?.1);
                let sum: f64 = shares.iter().sum();
                let shares: Vec<f64> = shares.iter().map(|x| x / sum).collect();
                for (j, share) in shares.iter().enumerate() {
                    x.column_mut(j).scale_mut(share.sqrt());
                }
                Some(DualVariables { x, shares })
            }
        }
    }

    /// One damped Newton step. Returns its decrement, or `None` when nothing gets smaller.
    fn newton(
        &self,
        w: &mut [f64],
        s: &mut f64,
        multipliers: &mut [f64],
        tau: f64,
        scale: f64,
    ) -> Option<f64> {
        let here = self.at(w, *s, tau, scale)?;
        let slopes = self.slopes(&here.root, w, tau, scale)?;
        let n = w.len();
        // minimum over s at the present weights
        let to_s = slopes.by_s.as_ref().map_or(0.0, |by| -by.gradient / by.curvature);
        let pulled = |i: usize| slopes.by_s.as_ref().map_or(0.0, |by| by.gradient * by.follows[i]);
        // in units of the weights themselves
        let h = DMatrix::from_fn(n, n, |i, j| {
            let own = if i == j { w[i] * multipliers[i] } else { 0.0 };
            w[i] * w[j] * slopes.hessian[(i, j)] + own
        });
        let g = DVector::from_fn(n, |i, _| w[i] * (slopes.gradient[i] + pulled(i)) - 1.0);
        let a = DVector::from_column_slice(w);
        // rounding of large curvatures may make the Hessian indefinite
        let rough = f64::EPSILON * n as f64 * h.diagonal().max();
        let root = (h.clone() + DMatrix::identity(n, n) * rough).cholesky()?;
        let (to, along) = (root.solve(&g), root.solve(&a));
        let y = &along * (a.dot(&to) / a.dot(&along)) - to;
        let s_step = slopes.by_s.as_ref().map_or(0.0, |by| {
            to_s + by.follows.iter().zip(w.iter()).zip(y.iter()).map(|((f, w), y)| f * w * y).sum::<f64>()
        });
        let of_s = slopes.by_s.as_ref().map_or(0.0, |by| by.gradient * by.gradient / by.curvature);
        let decrement = of_s - g.dot(&y);
        if !(decrement.is_finite() && decrement > 0.0) {
            return None;
        }
        follow(multipliers, w, &y);
        let logs = |w: &[f64]| w.iter().map(|w| w.ln()).sum::<f64>();
        let before = here.value - logs(w);
        let deepest = y.iter().fold(0.0f64, |m, y| m.max(-y));
        let mut step = if deepest > 0.0 { (INSIDE / deepest).min(1.0) } else { 1.0 };
        for _ in 0..30 {
            let mut next: Vec<f64> = w.iter().zip(y.iter()).map(|(w, y)| w * (1.0 + step * y)).collect();
            let sum: f64 = next.iter().sum();
            next.iter_mut().for_each(|w| *w /= sum);
            let s_next = *s + step * s_step;
            let there = self.at(&next, s_next, tau, scale).map(|at| at.value - logs(&next));
            if there.is_some_and(|v| v <= before - 1e-4 * step * decrement + 1e-12 * before.abs()) {
                w.copy_from_slice(&next);
                *s = s_next;
                return Some(decrement);
            }
            step *= 0.5;
        }
        None
    }

    /// Gradient and Hessian of [`Self::at`] with respect to the weights, and to s where the objective
    /// has it.
    fn slopes(&self, root: &Cholesky<f64, Dyn>, w: &[f64], tau: f64, scale: f64) -> Option<BarrierSlopes> {
        match &self.problem.objective {
            Objective::Volume => Some(self.slopes_of_volume(root, w, tau)),
            Objective::Least => Some(self.slopes_of_least(root, tau / scale)),
            Objective::Mean(vectors) => Some(self.slopes_of_mean(root, vectors.ncols(), tau / scale)),
            Objective::Largest(_, offsets) => self.slopes_of_largest(root, offsets, tau / scale),
        }
    }

    /// `F_i M^-1` of every candidate.
    fn through(&self, root: &Cholesky<f64, Dyn>) -> Vec<DMatrix<f64>> {
        let inverse = root.inverse();
        self.factors.iter().map(|f| f * &inverse).collect()
    }

    /// Slopes for the objective [`Objective::Volume`].
    fn slopes_of_volume(&self, root: &Cholesky<f64, Dyn>, w: &[f64], tau: f64) -> BarrierSlopes {
        let (n, problem) = (w.len(), self.problem);
        let through = self.through(root);
        let pair = |i: usize, j: usize| &through[i] * self.factors[j].transpose();
        let d = problem.counting() as f64;
        let nuisance = problem.nuisance;
        // from the information on the nuisance alone
        let root = (nuisance > 0)
            .then(|| self.information(w).view((0, 0), (nuisance, nuisance)).into_owned().cholesky());
        let inner = root.flatten().map(|r| r.inverse());
        let corner = |i: usize| self.factors[i].columns(0, nuisance);
        let own: Vec<DMatrix<f64>> =
            (0..n).map(|i| inner.as_ref().map_or_else(|| DMatrix::zeros(0, 0), |v| corner(i) * v)).collect();
        let hidden = |i: usize, j: usize| match inner {
            Some(_) => &own[i] * corner(j).transpose(),
            None => DMatrix::zeros(self.factors[i].nrows(), self.factors[j].nrows()),
        };
        let gradient = (0..n).map(|i| tau / d * (hidden(i, i).trace() - pair(i, i).trace())).collect();
        let entry = |i: usize, j: usize| tau / d * (pair(i, j).norm_squared() - hidden(i, j).norm_squared());
        BarrierSlopes { gradient, hessian: symmetric(n, &entry), by_s: None }
    }

    /// Slopes for the objective [`Objective::Least`].
    fn slopes_of_least(&self, root: &Cholesky<f64, Dyn>, rate: f64) -> BarrierSlopes {
        let problem = self.problem;
        // with Z = R R^T: R^T A_i R as vectors, and R^T P R, P the unit matrix on the unknowns
        // that count
        let r = root
            .l()
            .transpose()
            .solve_upper_triangular(&DMatrix::identity(problem.unknowns(), problem.unknowns()));
        let r = r.unwrap_or_else(|| DMatrix::zeros(problem.unknowns(), problem.unknowns()));
        let counting = r.rows(problem.nuisance, problem.counting());
        let unit = counting.transpose() * counting;
        let of: Vec<DMatrix<f64>> = self.factors.iter().map(|f| f * &r).map(|f| f.transpose() * f).collect();
        let curvature = unit.norm_squared();
        let follows: Vec<f64> = of.iter().map(|x| x.dot(&unit) / curvature).collect();
        let rest: Vec<DMatrix<f64>> = of.iter().zip(&follows).map(|(x, c)| x - &unit * *c).collect();
        BarrierSlopes {
            gradient: of.iter().map(|x| -x.trace()).collect(),
            hessian: symmetric(self.factors.len(), &|i, j| rest[i].dot(&rest[j])),
            by_s: Some(ByS { gradient: unit.trace() - rate, curvature, follows }),
        }
    }

    /// Slopes for the objective [`Objective::Mean`] over `count` columns.
    fn slopes_of_mean(&self, root: &Cholesky<f64, Dyn>, count: usize, rate: f64) -> BarrierSlopes {
        let n = self.factors.len();
        let through = self.through(root);
        let pair = |i: usize, j: usize| &through[i] * self.factors[j].transpose();
        let factor = rate / count as f64;
        let (u, _) = self.solved(root);
        let seen: Vec<DMatrix<f64>> = self.factors.iter().map(|f| f * &u).collect();
        let gradient = (0..n).map(|i| -factor * seen[i].norm_squared()).collect();
        let entry = |i: usize, j: usize| 2.0 * factor * pair(i, j).dot(&(&seen[i] * seen[j].transpose()));
        BarrierSlopes { gradient, hessian: symmetric(n, &entry), by_s: None }
    }

    /// Slopes for the objective [`Objective::Largest`]; s is at its minimum for the weights.
    fn slopes_of_largest(
        &self,
        root: &Cholesky<f64, Dyn>,
        offsets: &[f64],
        rate: f64,
    ) -> Option<BarrierSlopes> {
        let n = self.factors.len();
        let through = self.through(root);
        let pair = |i: usize, j: usize| &through[i] * self.factors[j].transpose();
        let (u, values) = self.solved(root);
        let shares = multipliers_of(&slacks_of(&values, offsets, rate)?.1);
        let seen: Vec<DMatrix<f64>> = self.factors.iter().map(|f| f * &u).collect();
        let weighted: Vec<DMatrix<f64>> = seen
            .iter()
            .map(|x| DMatrix::from_fn(x.nrows(), x.ncols(), |r, j| x[(r, j)] * shares[j]))
            .collect();
        // share_j times the slope of v_j by the weights relative to the slope of s, which
        // follows their mean
        let slope = |i: usize, j: usize| -seen[i].column(j).norm_squared();
        let slopes = DMatrix::from_fn(n, shares.len(), slope);
        let weighed = |row: usize, by: &dyn Fn(f64) -> f64| -> f64 {
            slopes.row(row).iter().zip(&shares).map(|(x, share)| x * by(*share)).sum()
        };
        let curvature: f64 = shares.iter().map(|x| x * x).sum();
        let follows: Vec<f64> = (0..n).map(|i| weighed(i, &|x| x * x) / curvature).collect();
        let rest = |i: usize, j: usize| shares[j] * (slopes[(i, j)] - follows[i]);
        let rest = DMatrix::from_fn(n, shares.len(), rest);
        let outer = &rest * rest.transpose();
        let entry =
            |i: usize, j: usize| outer[(i, j)] + 2.0 * pair(i, j).dot(&(&weighted[i] * seen[j].transpose()));
        let gradient = (0..n).map(|i| weighed(i, &|x| x)).collect();
        Some(BarrierSlopes { gradient, hessian: symmetric(n, &entry), by_s: None })
    }
}

/// Symmetric matrix (n x n) of these entries.
fn symmetric(n: usize, entry: &dyn Fn(usize, usize) -> f64) -> DMatrix<f64> {
    let mut h = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let x = entry(i, j);
            (h[(i, j)], h[(j, i)]) = (x, x);
        }
    }
    h
}

/// Minimum over s of `rate s - sum_j ln(s - o_j - v_j)`: s, and the distance of each `o_j + v_j` below
/// s; `None` where values are not finite.
fn slacks_of(values: &[f64], offsets: &[f64], rate: f64) -> Option<(f64, Vec<f64>)> {
    let totals: Vec<f64> = values.iter().zip(offsets).map(|(v, o)| v + o).collect();
    let largest = totals.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // distance of s above the largest value: the sum of the inverses falls with it and is convex, so
    // Newton's steps increase to the end
    let mut above = 1.0 / rate;
    for _ in 0..100 {
        let left = || totals.iter().map(|a| above + (largest - a));
        let beyond = left().map(|x| 1.0 / x).sum::<f64>() - rate;
        if beyond.is_nan() || beyond.abs() <= 1e-13 * rate {
            break;
        }
        above += beyond / left().map(|x| 1.0 / (x * x)).sum::<f64>();
    }
    let left: Vec<f64> = totals.iter().map(|a| above + (largest - a)).collect();
    (largest.is_finite() && left.iter().all(|x| *x > 0.0)).then_some((largest + above, left))
}

/// Newton's step of the multipliers for the relative step `y` of the weights, shortened so that they stay
/// positive.
fn follow(multipliers: &mut [f64], w: &[f64], y: &DVector<f64>) {
    let steps: Vec<f64> =
        multipliers.iter().zip(w.iter()).zip(y.iter()).map(|((z, w), y)| 1.0 / w - z * (1.0 + y)).collect();
    let deepest = multipliers.iter().zip(&steps).map(|(z, d)| -d / z).fold(0.0, f64::max);
    let part = if deepest > 0.0 { (INSIDE / deepest).min(1.0) } else { 1.0 };
    multipliers.iter_mut().zip(&steps).for_each(|(z, d)| *z += part * d);
}

fn multipliers_of(left: &[f64]) -> Vec<f64> {
    left.iter().map(|x| 1.0 / x).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression of degree two on [-1, 1]: `A_i = f f^T`, f = (1, x, x^2), at `points` points.
    fn quadratic(points: usize, nuisance: usize, objective: Objective) -> Additive {
        let at = |i: usize| -> DMatrix<f64> {
            let x = 2.0 * i as f64 / (points - 1) as f64 - 1.0;
            // unknowns that count come last
            let f = if nuisance == 2 {
                DVector::from_vec(vec![1.0, x, x * x])
            } else {
                DVector::from_vec(vec![x * x, x, 1.0])
            };
            &f * f.transpose()
        };
        let candidates = (0..points).map(at).collect();
        Additive { candidates, prior: DMatrix::zeros(3, 3), nuisance, objective }
    }

    /// Pukelsheim, Optimal Design of Experiments, 9.5 and 9.12: weights at -1, 0, 1 of the D-, A- and
    /// E-optimal designs, and of the one for the coefficient of x^2 alone. Column generation finds them
    /// among 401 points.
    #[test]
    fn weights_are_those_of_the_textbook() {
        let units = DMatrix::identity(3, 3);
        let square = DMatrix::from_column_slice(3, 1, &[0.0, 0.0, 1.0]);
        let cases = [
            (0, Objective::Volume, [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0]),
            (0, Objective::Mean(units.clone()), [0.25, 0.5, 0.25]),
            (0, Objective::Least, [0.2, 0.6, 0.2]),
            (2, Objective::Volume, [0.25, 0.5, 0.25]),
            (2, Objective::Least, [0.25, 0.5, 0.25]),
            (2, Objective::Largest(square, vec![0.0]), [0.25, 0.5, 0.25]),
        ];
        for points in [3, 41, 401] {
            for (nuisance, objective, expected) in &cases {
                let problem = quadratic(points, *nuisance, objective.clone());
                let found = weigh(&problem, &|| true).expect("weights");
                assert!(found.attained / found.bound < 1.0 + 1e-6, "{points} {objective:?}: {found:?}");
                for (i, w) in [(0, expected[0]), (points / 2, expected[1]), (points - 1, expected[2])] {
                    assert!(
                        (found.weights[i] - w).abs() < 2e-3,
                        "{points} {objective:?}: {:?}",
                        found.weights
                    );
                }
            }
        }
    }

    /// Gradient and Hessian with s as one more variable.
    fn whole(slopes: BarrierSlopes) -> (Vec<f64>, DMatrix<f64>) {
        let n = slopes.gradient.len();
        let (mut gradient, mut h) = (slopes.gradient, slopes.hessian);
        if let Some(by) = slopes.by_s {
            gradient.push(by.gradient);
            h = h.insert_row(n, 0.0).insert_column(n, 0.0);
            let m = DVector::from_fn(n + 1, |i, _| if i < n { by.follows[i] } else { -1.0 });
            h += &m * m.transpose() * by.curvature;
        }
        (gradient, h)
    }

    /// Gradients and Hessians equal differences of the barrier function.
    #[test]
    fn slopes_are_differences() {
        let units = DMatrix::identity(3, 3);
        let objectives = [
            (0, Objective::Volume),
            (1, Objective::Volume),
            (0, Objective::Mean(units.clone())),
            (0, Objective::Least),
            (1, Objective::Least),
            (0, Objective::Largest(units, vec![0.1, 0.0, 0.3])),
        ];
        for (nuisance, objective) in objectives {
            let mut problem = quadratic(5, 0, objective.clone());
            problem.nuisance = nuisance;
            let weighing = WeightProblem::new(&problem, (0..5).collect(), 0.0);
            let w = [0.3, 0.1, 0.25, 0.15, 0.2];
            let scale = weighing.objective(&w).expect("regular");
            let s = if objective == Objective::Least { 0.5 / scale } else { 2.0 * scale };
            let (tau, unit) = (7.0, 1.3);
            let root = weighing.at(&w, s, tau, unit).expect("inside").root;
            let (gradient, hessian) = whole(weighing.slopes(&root, &w, tau, unit).expect("inside"));
            let moved = |k: usize, h: f64| {
                let (mut w, mut s) = (w, s);
                if k < 5 {
                    w[k] += h
                } else {
                    s += h
                }
                (w, s)
            };
            let h = 1e-5;
            for k in 0..gradient.len() {
                let (up, down) = (moved(k, h), moved(k, -h));
                let value = |(w, s): &([f64; 5], f64)| weighing.at(w, *s, tau, unit).expect("inside").value;
                let slope = (value(&up) - value(&down)) / (2.0 * h);
                assert!(
                    (slope - gradient[k]).abs() < 1e-5 * (1.0 + slope.abs()),
                    "{objective:?} {k}: {slope} {}",
                    gradient[k]
                );
                let at = |(w, s): &([f64; 5], f64)| {
                    let root = weighing.at(w, *s, tau, unit).expect("inside").root;
                    whole(weighing.slopes(&root, w, tau, unit).expect("inside")).0
                };
                for (j, (a, b)) in at(&up).iter().zip(at(&down)).enumerate() {
                    let bend = (a - b) / (2.0 * h);
                    let computed = hessian[(k, j)];
                    assert!(
                        (bend - computed).abs() < 1e-4 * (1.0 + bend.abs()),
                        "{objective:?} {k} {j}: {bend} {computed}"
                    );
                }
            }
        }
    }
}
