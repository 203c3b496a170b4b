//! Estimate: Gauss-Newton on the starts of all runs and the constants that they share.
//!
//! There are two modes. *Data alone*: no prior on unknowns that the records determine. The undetermined
//! directions (null space of the exact verdict) stay within a stated box about their first estimates, one
//! standard deviation wide, and are not reported. *Priors as stated*: exactly the unknowns with a prior in a
//! file or an option have that prior, and the estimate is the most probable one. A weak pull on all other
//! unknowns is towards the current iterate, so it does not affect the result.

use std::cell::Cell;

use nalgebra::{DMatrix, DVector};
use obsdeg_ekf::{EkfError, Manifold};
use obsdeg_evidence::prediction::Combination;
use obsdeg_evidence::simulation::{Conditions, PlatformState};

use super::CalibrationError;
use super::run::{MeasurementKey, RecordedRun};
use crate::CalibrationProgress;
use crate::least_squares::PriorRows;
use crate::least_squares::{LeastSquaresSolution, Linearised, StackedRows, StartInformation};

/// Most linearisations.
const PASSES: usize = 40;
/// Convergence limit: largest step, in standard deviations of any combination by the fit.
const SETTLED: f64 = 1e-4;
/// Largest last step of an iteration that counts as converged when no step lowers the sum of squares.
const NEARLY: f64 = 0.02;
/// Largest turn of an attitude by a step, in rad: beyond it the linear model fails.
pub(super) const TURN: f64 = 0.4;
/// Most halvings of a step that increases the sum of squares.
const HALVINGS: usize = 12;
/// Relative eigenvalue, by the largest, below which a direction is free of all priors.
const RANK: f64 = 1e-18;
/// Relative size from which a functional has a component in a direction.
const OPEN: f64 = 1e-9;
/// Width of the box of undetermined directions, in prior standard deviations.
pub(crate) const BOX: f64 = 1.0;
/// Width of the box where the directions count as known.
pub(crate) const TIGHT: f64 = 1e-5;
/// Factor by which the pull towards the current iterate is weaker than the prior.
pub(crate) const WEAK: f64 = 1e7;

/// Largest turn (rad) of an attitude by a correction; its first `3 attitudes` components are turns.
pub(super) fn largest_turn(correction: &[f64], attitudes: usize) -> f64 {
    let turns = correction[..3 * attitudes].chunks_exact(3);
    turns.map(|v| v.iter().map(|x| x * x).sum::<f64>().sqrt()).fold(0.0, f64::max)
}

/// Unknowns of all runs: each run's own (psi, biases), and the common coefficients.
#[derive(Debug, Clone)]
pub(crate) struct RunUnknowns {
    /// Index of the unknown for every state, by run.
    pub index: Vec<Vec<usize>>,
    /// Number of unknowns.
    pub n: usize,
    /// Prior standard deviations (SI), of which multiples are used.
    pub prior: Vec<f64>,
    /// First estimates (SI).
    pub first: Vec<f64>,
    /// Directions that neither records nor priors determine, one per column: they stay within the box.
    pub loose: DMatrix<f64>,
    /// Unknowns with a stated prior.
    pub stated: Vec<usize>,
    /// Number of directions that priors determine and records do not.
    pub given: usize,
    /// True if the scheme alone leaves directions undetermined, whatever priors are stated.
    pub undetermined: bool,
    /// Biases of all runs: their prior is a property of the gyros.
    pub biases: Vec<usize>,
}

impl RunUnknowns {
    /// Unknowns of runs of one platform. Each run has its own `psi` states, then come the `coefficients`
    /// common to all, then the run's own `biases`. `prior` and `first` are those of one run, `null` its
    /// undetermined directions, and `stated` is true for states with a stated prior.
    pub(crate) fn new(
        runs: usize,
        [psi, coefficients, biases]: [usize; 3],
        prior: &[f64],
        first: &[f64],
        null: &[Combination],
        stated: &[bool],
    ) -> Self {
        let own = psi + biases;
        let n = runs * own + coefficients;
        let of = |run: usize, state: usize| match state {
            s if s < psi => run * own + s,
            s if s < psi + coefficients => runs * own + s - psi,
            s => run * own + s - coefficients,
        };
        let index: Vec<Vec<usize>> =
            (0..runs).map(|r| (0..own + coefficients).map(|s| of(r, s)).collect()).collect();
        let (mut all, mut start) = (vec![0.0; n], vec![0.0; n]);
        for states in &index {
            for (s, &i) in states.iter().enumerate() {
                (all[i], start[i]) = (prior[s], first[s]);
            }
        }
        // directions of psi alone belong to one run; others change the psi of all runs
        let mut columns: Vec<DVector<f64>> = Vec::new();
        for direction in null {
            let common = direction.iter().any(|(s, _)| *s >= psi);
            let mut column = |among: &[Vec<usize>]| {
                let mut v = DVector::zeros(n);
                for states in among {
                    direction.iter().for_each(|&(s, k)| v[states[s]] = k);
                }
                columns.push(v);
            };
            if common { column(&index) } else { index.iter().for_each(|i| column(std::slice::from_ref(i))) }
        }
        let loose = if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) };
        let with_prior = index.iter().flat_map(|own| own.iter().zip(stated)).filter(|(_, s)| **s);
        let mut stated: Vec<usize> = with_prior.map(|(i, _)| *i).collect();
        stated.sort_unstable();
        stated.dedup();
        let biases = index.iter().flat_map(|i| i[psi + coefficients..].iter().copied()).collect();
        Self {
            index,
            n,
            prior: all,
            first: start,
            loose,
            biases,
            stated,
            given: 0,
            undetermined: !null.is_empty(),
        }
    }

    /// Removes from the box the combinations of its directions that prior rows on the unknowns (any x n)
    /// determine.
    pub(crate) fn determined_by(&mut self, prior: &DMatrix<f64>) {
        let size =
            |c: usize| (0..self.n).map(|i| (self.loose[(i, c)] / self.prior[i]).powi(2)).sum::<f64>().sqrt();
        let scaled = DMatrix::from_fn(self.n, self.loose.ncols(), |i, c| {
            self.loose[(i, c)] / size(c).max(f64::MIN_POSITIVE)
        });
        let seen = prior * &scaled;
        let m = scaled.ncols();
        if m == 0 || seen.nrows() == 0 {
            return;
        }
        let eigen = (seen.transpose() * &seen).symmetric_eigen();
        let most = eigen.eigenvalues.amax();
        let open: Vec<usize> = (0..m).filter(|&k| eigen.eigenvalues[k] <= RANK * most).collect();
        self.given = m - open.len();
        self.loose = DMatrix::from_fn(self.n, open.len(), |i, c| {
            (0..m).map(|k| scaled[(i, k)] * eigen.eigenvectors[(k, open[c])]).sum()
        });
    }

    /// Rows of the stated priors, with unit errors.
    pub(crate) fn stated_rows(&self) -> DMatrix<f64> {
        let mut rows = DMatrix::zeros(self.stated.len(), self.n);
        self.stated.iter().enumerate().for_each(|(k, &i)| rows[(k, i)] = 1.0 / self.prior[i]);
        rows
    }

    /// True if a functional has a component in directions that only the box bounds.
    pub(crate) fn is_open(&self, terms: &[(usize, f64)]) -> bool {
        (0..self.loose.ncols()).any(|c| {
            let of = |&(i, k): &(usize, f64)| (k * self.loose[(i, c)], (k * self.prior[i]).abs());
            let size = (0..self.n).map(|i| (self.loose[(i, c)] / self.prior[i]).powi(2)).sum::<f64>().sqrt();
            let (sum, scale) = terms.iter().map(of).fold((0.0, 0.0), |s, x| (s.0 + x.0, s.1 + x.1));
            sum.abs() > OPEN * scale * size
        })
    }

    /// Rows that constrain the loose directions within `width` times the prior, with the least information
    /// that does so, and rows of the biases and the stated priors.
    pub(super) fn constraint_rows(&self, width: f64) -> DMatrix<f64> {
        let weighted =
            DMatrix::from_fn(self.n, self.loose.ncols(), |i, j| self.loose[(i, j)] / self.prior[i]);
        let q = if weighted.ncols() == 0 { weighted } else { weighted.qr().q() };
        let m = q.ncols();
        let mut rows = DMatrix::from_fn(m, self.n, |j, i| q[(i, j)] / (width * self.prior[i]));
        // random biases have priors of their own
        rows = rows.resize_vertically(m + self.biases.len(), 0.0);
        self.biases.iter().enumerate().for_each(|(k, &i)| rows[(m + k, i)] = 1.0 / self.prior[i]);
        let stated = self.stated_rows();
        let above = rows.nrows();
        rows = rows.resize_vertically(above + stated.nrows(), 0.0);
        rows.rows_mut(above, stated.nrows()).copy_from(&stated);
        rows
    }

    /// Local coordinates of all unknowns at the first estimates, relative to `at`.
    fn to_first(&self, at: &[PlatformState]) -> DVector<f64> {
        let mut out = DVector::zeros(self.n);
        for (x, index) in at.iter().zip(&self.index) {
            let first: Vec<f64> = index.iter().map(|&i| self.first[i]).collect();
            let constants = x.dimension() - 3 * x.attitudes();
            let to = PlatformState::of_unknowns(&first, constants).local(x);
            index.iter().zip(to).for_each(|(&i, d)| out[i] = d);
        }
        out
    }
}

/// Runs with the assumptions of the fit.
pub(crate) struct PlatformProblem<'a> {
    pub conditions: &'a Conditions,
    pub runs: &'a [RecordedRun],
    pub unknowns: &'a RunUnknowns,
    /// Standard deviations of a sample, by channel.
    pub sigmas: Vec<f64>,
    /// Prior information on some combinations: rows and values in SI units, with unit errors.
    pub known: Option<PriorRows>,
    /// Progress callback, called for every linearisation; the iteration ends when it returns false.
    pub progress: &'a dyn Fn(CalibrationProgress<'_>) -> bool,
    /// Number of linearisations.
    pub passes: Cell<usize>,
    /// True if the callback returned false.
    pub stopped: Cell<bool>,
}

/// Run, linearised at the estimate.
#[derive(Debug, Clone)]
pub(crate) struct LinearisedRecord {
    /// Stages and residuals.
    pub run: Linearised,
    /// Measurement of every residual.
    pub keys: Vec<MeasurementKey>,
}

/// All runs, linearised at the estimate.
pub(crate) struct LinearisedRuns {
    pub x: Vec<PlatformState>,
    pub runs: Vec<LinearisedRecord>,
    pub information: Vec<StartInformation>,
    /// Sum of squares of all residuals, with those of constraining rows and prior information.
    pub cost: f64,
}

/// End of the iteration.
pub(crate) struct PlatformEstimate {
    pub at: LinearisedRuns,
    /// Last step (nearly zero) with its covariance.
    pub solution: LeastSquaresSolution,
    pub passes: usize,
    pub converged: bool,
    /// Number of other minima that are nearly as low.
    pub rivals: usize,
}

impl PlatformProblem<'_> {
    /// Linearises all runs at `x`.
    pub(crate) fn at(&self, x: Vec<PlatformState>) -> Result<LinearisedRuns, CalibrationError> {
        self.at_parts(x, |_| &[])
    }

    /// Linearises all runs along trajectories in parts, by run (see [`RecordedRun::along_parts`]).
    pub(super) fn at_parts<'n>(
        &self,
        x: Vec<PlatformState>,
        nodes: impl Fn(usize) -> &'n [(usize, PlatformState)],
    ) -> Result<LinearisedRuns, CalibrationError> {
        self.passes.set(self.passes.get() + 1);
        if !(self.progress)(CalibrationProgress::Passes(self.passes.get())) {
            self.stopped.set(true);
        }
        let each = self.runs.iter().zip(&x).enumerate();
        let runs = each.map(|(r, (run, x))| run.along_parts(self.conditions, &self.sigmas, x, nodes(r)));
        let runs = runs.map(|along| along.map(|(run, keys)| LinearisedRecord { run, keys }));
        let runs = runs.collect::<Result<Vec<_>, _>>()?;
        let information =
            runs.iter().map(|r| StartInformation::of(&r.run)).collect::<Result<Vec<_>, EkfError>>()?;
        let mut cost: f64 = information.iter().map(StartInformation::at_zero).sum();
        cost += self.constraint_residuals(&self.unknowns.constraint_rows(BOX), &x).norm_squared();
        if let Some(PriorRows { rows, .. }) = &self.known {
            cost += self.known_left(rows, &x).norm_squared();
        }
        Ok(LinearisedRuns { x, runs, information, cost })
    }

    /// States of all runs with all unknowns zero: the platform at the attitudes of the scheme.
    pub(crate) fn at_rest(&self) -> Vec<PlatformState> {
        let of = |(run, index): (&RecordedRun, &Vec<usize>)| {
            PlatformState::of_unknowns(&vec![0.0; index.len()], run.plan.constants())
        };
        self.runs.iter().zip(&self.unknowns.index).map(of).collect()
    }

    /// Values of the unknowns at `x`.
    pub(crate) fn values(&self, x: &[PlatformState]) -> DVector<f64> {
        let mut out = DVector::zeros(self.unknowns.n);
        for (x, index) in x.iter().zip(&self.unknowns.index) {
            index.iter().zip(x.unknowns()).for_each(|(&i, v)| out[i] = v);
        }
        out
    }

    /// Residuals at `x` of the rows that constrain unknowns about their first estimates.
    pub(super) fn constraint_residuals(&self, rows: &DMatrix<f64>, x: &[PlatformState]) -> DVector<f64> {
        rows * self.unknowns.to_first(x)
    }

    /// Residuals at `x` of the rows of the prior information.
    pub(super) fn known_left(&self, rows: &DMatrix<f64>, x: &[PlatformState]) -> DVector<f64> {
        self.known.as_ref().map_or_else(|| DVector::zeros(0), |k| &k.values - rows * self.values(x))
    }

    /// Next step from `at`, with a pull to it `weak` times as weak as the prior.
    pub(crate) fn step(&self, at: &LinearisedRuns, weak: f64) -> Result<LeastSquaresSolution, EkfError> {
        self.step_with(at, weak, None)
    }

    /// Next step from `at`, with the undetermined directions constrained within `width` times their prior.
    pub(crate) fn step_constrained(
        &self,
        at: &LinearisedRuns,
        width: f64,
    ) -> Result<LeastSquaresSolution, EkfError> {
        self.pulled(self.said(at, None, width), WEAK)
    }

    /// Next step from `at`, with another information of one run.
    pub(crate) fn step_with(
        &self,
        at: &LinearisedRuns,
        weak: f64,
        instead: Option<(usize, &StartInformation)>,
    ) -> Result<LeastSquaresSolution, EkfError> {
        self.pulled(self.said(at, instead, BOX), weak)
    }

    fn pulled(&self, mut rows: StackedRows, weak: f64) -> Result<LeastSquaresSolution, EkfError> {
        let pull = self.unknowns.prior.iter().map(|s| 1.0 / (weak * s));
        let n = self.unknowns.n;
        rows.add(&DMatrix::from_diagonal(&DVector::from_iterator(n, pull)), &DVector::zeros(n));
        rows.solve()
    }

    /// Step from `at` with the prior on everything about the first estimates.
    pub(crate) fn step_with_prior(&self, at: &LinearisedRuns) -> Result<LeastSquaresSolution, EkfError> {
        let mut rows = self.said(at, None, BOX);
        let weights = DVector::from_iterator(self.unknowns.n, self.unknowns.prior.iter().map(|s| 1.0 / s));
        let to = self.unknowns.to_first(&at.x).component_mul(&weights);
        rows.add(&DMatrix::from_diagonal(&weights), &to);
        rows.solve()
    }

    /// Rows of the records, of the constrained directions and of the prior information.
    fn said(
        &self,
        at: &LinearisedRuns,
        instead: Option<(usize, &StartInformation)>,
        width: f64,
    ) -> StackedRows {
        let n = self.unknowns.n;
        let mut rows = StackedRows::new(n);
        for (r, (information, index)) in at.information.iter().zip(&self.unknowns.index).enumerate() {
            let information = instead.filter(|(of, _)| *of == r).map_or(information, |(_, other)| other);
            let mut wide = DMatrix::zeros(information.root.nrows(), n);
            for (s, &i) in index.iter().enumerate() {
                wide.set_column(i, &information.root.column(s));
            }
            rows.add(&wide, &information.right);
        }
        let constraint_rows = self.unknowns.constraint_rows(width);
        rows.add(&constraint_rows, &self.constraint_residuals(&constraint_rows, &at.x));
        if let Some(PriorRows { rows: known, .. }) = &self.known {
            rows.add(known, &self.known_left(known, &at.x));
        }
        rows
    }

    /// Factor on standard deviations by the fit: root of chi-square per measurement, at least one.
    fn scale(&self, at: &LinearisedRuns) -> f64 {
        let rows: usize = at.runs.iter().map(|r| r.run.residuals.len()).sum();
        (at.cost / rows.max(1) as f64).max(1.0).sqrt()
    }

    /// Moves `x` by a step of all unknowns.
    pub(super) fn moved(&self, x: &[PlatformState], step: &DVector<f64>) -> Vec<PlatformState> {
        let mut out = x.to_vec();
        for (x, index) in out.iter_mut().zip(&self.unknowns.index) {
            let delta: Vec<f64> = index.iter().map(|&i| step[i]).collect();
            x.retract(&delta);
        }
        out
    }

    /// Largest angle (rad) by which a step turns a platform anywhere in its run.
    pub(super) fn turn(&self, at: &LinearisedRuns, step: &DVector<f64>) -> f64 {
        let mut largest: f64 = 0.0;
        for ((LinearisedRecord { run, .. }, index), x) in at.runs.iter().zip(&self.unknowns.index).zip(&at.x)
        {
            let own: Vec<f64> = index.iter().map(|&i| step[i]).collect();
            largest = largest.max(largest_turn(&own, x.attitudes()));
            run.carried(&own, |_, d| largest = largest.max(largest_turn(d, x.attitudes())));
        }
        largest
    }

    /// Iterates from `x`.
    pub(super) fn settle(&self, x: Vec<PlatformState>) -> Result<PlatformEstimate, CalibrationError> {
        let mut at = self.at(x)?;
        let mut solution = self.step(&at, WEAK)?;
        let (mut passes, mut converged) = (1, false);
        while passes < PASSES && !self.stopped.get() {
            let size = (&solution.root * &solution.x).norm();
            if size <= SETTLED * self.scale(&at) {
                converged = true;
                break;
            }
            let mut step = &solution.x * (TURN / self.turn(&at, &solution.x)).min(1.0);
            let mut found = None;
            for _ in 0..=HALVINGS {
                passes += 1;
                let next = self.at(self.moved(&at.x, &step)).ok();
                // rounding may increase the sum of squares at the end
                found = next.filter(|n| n.cost <= at.cost * (1.0 + 1e-9) + 1e-6);
                if found.is_some() {
                    break;
                }
                step /= 2.0;
            }
            let Some(next) = found else { break };
            at = next;
            solution = self.step(&at, WEAK)?;
        }
        // where no step lowers the sum of squares, the rest of the step is curvature within it
        let size = (&solution.root * &solution.x).norm();
        converged |= size <= NEARLY * self.scale(&at);
        Ok(PlatformEstimate { at, solution, passes, converged, rivals: 0 })
    }

    /// Number of measurements.
    pub(crate) fn rows(&self, e: &PlatformEstimate) -> f64 {
        e.at.runs.iter().map(|r| r.run.residuals.len()).sum::<usize>() as f64
    }
}
