//! The estimate: Gauss and Newton on the starts of all runs and the constants they share, without a prior on what the records determine.
//!
//! What no record can tell (the null space of the exact verdict) is held loosely about its first estimate, so that steps stay where the model is near linear; nothing
//! of it is reported. A weak pull on all else is towards where the iteration is, and so leaves no trace in where it ends.

use std::cell::Cell;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use obsdeg_ekf::{EkfError, Manifold};
use obsdeg_evidence::prediction::Combination;
use obsdeg_evidence::simulation::{Conditions, PlatformState};

use super::CalibrationError;
use super::run::{Key, Run};
use crate::Going;
use crate::least_squares::{Information, Linearised, Rows, Solution};

/// Most linearisations.
const PASSES: usize = 40;
/// The iteration has settled when it moves by less than this, in standard deviations of any combination as the fit has them.
const SETTLED: f64 = 1e-4;
/// It has settled, too, where no step leads further down and the last is less than this.
const NEARLY: f64 = 0.02;
/// Halvings of a step that leads away.
const HALVINGS: usize = 12;
/// How much wider than the prior what nobody can know is held.
pub(crate) const LOOSE: f64 = 10.0;
/// The same where it is taken as known.
pub(crate) const TIGHT: f64 = 1e-5;
/// No coefficient is tried that is further from its first estimate, in prior standard deviations: what is held so weakly may go anywhere, and such a
/// platform turns so fast that to follow it takes minutes.
const FAR: f64 = 100.0;
/// How much wider than the prior everything is pulled to where the iteration is.
pub(crate) const WEAK: f64 = 1e7;

/// The unknowns of all runs: those of each run that are its own (psi, biases), and the coefficients.
#[derive(Debug, Clone)]
pub(crate) struct Unknowns {
    /// Of every run, the unknown that each of its states is.
    pub index: Vec<Vec<usize>>,
    /// The number of unknowns.
    pub n: usize,
    /// Prior standard deviations (SI), of which multiples are taken.
    pub prior: Vec<f64>,
    /// First estimates (SI).
    pub first: Vec<f64>,
    /// What is held loosely: directions, a column each.
    pub loose: DMatrix<f64>,
    /// Biases of all runs: their prior is a property of the gyros.
    pub biases: Vec<usize>,
    /// The coefficients, which all runs have in common.
    coefficients: Range<usize>,
}

impl Unknowns {
    /// Of runs of one platform with `psi` states of their own before `coefficients` common ones, and `biases` of their own behind; `prior` and `first` are of
    /// one run, `null` its directions that nothing determines.
    pub(crate) fn new(
        runs: usize,
        [psi, coefficients, biases]: [usize; 3],
        prior: &[f64],
        first: &[f64],
        null: &[Combination],
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
        // directions of psi alone are each run's own; others move the psi of all
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
        let biases = index.iter().flat_map(|i| i[psi + coefficients..].iter().copied()).collect();
        Self { index, n, prior: all, first: start, loose, biases, coefficients: runs * own..n }
    }

    /// Rows that hold the loose directions within `width` times the prior, the least information that does with the prior as its measure, and biases.
    fn holding(&self, width: f64) -> DMatrix<f64> {
        let weighted =
            DMatrix::from_fn(self.n, self.loose.ncols(), |i, j| self.loose[(i, j)] / self.prior[i]);
        let q = if weighted.ncols() == 0 { weighted } else { weighted.qr().q() };
        let m = q.ncols();
        let mut rows = DMatrix::from_fn(m, self.n, |j, i| q[(i, j)] / (width * self.prior[i]));
        // random biases have a prior that is theirs
        rows = rows.resize_vertically(m + self.biases.len(), 0.0);
        self.biases.iter().enumerate().for_each(|(k, &i)| rows[(m + k, i)] = 1.0 / self.prior[i]);
        rows
    }

    /// Whether a coefficient is beyond all that is tried.
    fn far(&self, at: &[PlatformState]) -> bool {
        let to = self.to_first(at);
        self.coefficients.clone().any(|i| to[i].abs() > FAR * self.prior[i])
    }

    /// Local coordinates of all unknowns at the first estimates, seen from `at`.
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

/// Runs and what is assumed of them.
pub(crate) struct Problem<'a> {
    pub conditions: &'a Conditions,
    pub runs: &'a [Run],
    pub unknowns: &'a Unknowns,
    /// Of a sample, by channel.
    pub sigmas: Vec<f64>,
    /// What was known before of some combinations: rows and values in SI, with unit errors.
    pub known: Option<(DMatrix<f64>, DVector<f64>)>,
    /// Hears of every linearisation; where it says no, the iteration ends.
    pub going: &'a dyn Fn(Going<'_>) -> bool,
    /// How many there were.
    pub passes: Cell<usize>,
    /// Whether it said no.
    pub stopped: Cell<bool>,
}

/// Every run linearised at the estimate.
pub(crate) struct At {
    pub x: Vec<PlatformState>,
    pub runs: Vec<(Linearised, Vec<Key>)>,
    pub information: Vec<Information>,
    /// What the estimate leaves, with what is held and known.
    pub cost: f64,
}

/// Where the iteration ended.
pub(crate) struct Estimate {
    pub at: At,
    /// The last step (nearly zero) with its covariance.
    pub solution: Solution,
    pub passes: usize,
    pub converged: bool,
}

impl Problem<'_> {
    /// Linearises all runs at `x`, of each the first `part` of its bins.
    pub(crate) fn at(&self, x: Vec<PlatformState>, part: f64) -> Result<At, CalibrationError> {
        self.passes.set(self.passes.get() + 1);
        if !(self.going)(Going::Passes(self.passes.get())) {
            self.stopped.set(true);
        }
        let most = |run: &Run| ((run.len() as f64 * part).ceil() as usize).max(1);
        let each = self.runs.iter().zip(&x);
        let runs = each.map(|(run, x)| run.along(self.conditions, &self.sigmas, x, most(run)));
        let runs = runs.collect::<Result<Vec<_>, _>>()?;
        let information =
            runs.iter().map(|(run, _)| Information::of(run)).collect::<Result<Vec<_>, EkfError>>()?;
        let mut cost: f64 = information.iter().map(Information::at_zero).sum();
        cost += (self.unknowns.holding(LOOSE) * self.unknowns.to_first(&x)).norm_squared();
        if let Some((rows, values)) = &self.known {
            cost += (values - rows * self.values(&x)).norm_squared();
        }
        Ok(At { x, runs, information, cost })
    }

    /// Every run where all unknowns are zero: the platform at the attitudes of the scheme.
    pub(crate) fn at_rest(&self) -> Vec<PlatformState> {
        let of = |(run, index): (&Run, &Vec<usize>)| {
            PlatformState::of_unknowns(&vec![0.0; index.len()], run.plan.constants())
        };
        self.runs.iter().zip(&self.unknowns.index).map(of).collect()
    }

    /// The unknowns at `x`.
    pub(crate) fn values(&self, x: &[PlatformState]) -> DVector<f64> {
        let mut out = DVector::zeros(self.unknowns.n);
        for (x, index) in x.iter().zip(&self.unknowns.index) {
            index.iter().zip(x.unknowns()).for_each(|(&i, v)| out[i] = v);
        }
        out
    }

    /// The next step from `at`: everything pulled there `weak` times as weakly as the prior would.
    pub(crate) fn step(&self, at: &At, weak: f64) -> Result<Solution, EkfError> {
        self.step_with(at, weak, None)
    }

    /// The same with what nothing determines held within `width` times its prior.
    pub(crate) fn step_held(&self, at: &At, width: f64) -> Result<Solution, EkfError> {
        self.pulled(self.said(at, None, width), WEAK)
    }

    /// The same with another information of one run.
    pub(crate) fn step_with(
        &self,
        at: &At,
        weak: f64,
        instead: Option<(usize, &Information)>,
    ) -> Result<Solution, EkfError> {
        self.pulled(self.said(at, instead, LOOSE), weak)
    }

    fn pulled(&self, mut rows: Rows, weak: f64) -> Result<Solution, EkfError> {
        let pull = self.unknowns.prior.iter().map(|s| 1.0 / (weak * s));
        let n = self.unknowns.n;
        rows.add(&DMatrix::from_diagonal(&DVector::from_iterator(n, pull)), &DVector::zeros(n));
        rows.solve()
    }

    /// The step from `at` with the prior of everything about the first estimates.
    pub(crate) fn step_with_prior(&self, at: &At) -> Result<Solution, EkfError> {
        let mut rows = self.said(at, None, LOOSE);
        let weights = DVector::from_iterator(self.unknowns.n, self.unknowns.prior.iter().map(|s| 1.0 / s));
        let to = self.unknowns.to_first(&at.x).component_mul(&weights);
        rows.add(&DMatrix::from_diagonal(&weights), &to);
        rows.solve()
    }

    /// What the records say, and what is held or known.
    fn said(&self, at: &At, instead: Option<(usize, &Information)>, width: f64) -> Rows {
        let n = self.unknowns.n;
        let mut rows = Rows::new(n);
        for (r, (information, index)) in at.information.iter().zip(&self.unknowns.index).enumerate() {
            let information = instead.filter(|(of, _)| *of == r).map_or(information, |(_, other)| other);
            let mut wide = DMatrix::zeros(information.root.nrows(), n);
            for (s, &i) in index.iter().enumerate() {
                wide.set_column(i, &information.root.column(s));
            }
            rows.add(&wide, &information.right);
        }
        let holding = self.unknowns.holding(width);
        rows.add(&holding, &(&holding * self.unknowns.to_first(&at.x)));
        if let Some((known, values)) = &self.known {
            rows.add(known, &(values - known * self.values(&at.x)));
        }
        rows
    }

    /// A standard deviation as the fit has it.
    fn scale(&self, at: &At) -> f64 {
        let rows: usize = at.runs.iter().map(|(run, _)| run.residuals.len()).sum();
        (at.cost / rows.max(1) as f64).max(1.0).sqrt()
    }

    /// Moves `x` by `step` of all unknowns.
    fn moved(&self, x: &[PlatformState], step: &DVector<f64>) -> Vec<PlatformState> {
        let mut out = x.to_vec();
        for (x, index) in out.iter_mut().zip(&self.unknowns.index) {
            let delta: Vec<f64> = index.iter().map(|&i| step[i]).collect();
            x.retract(&delta);
        }
        out
    }

    /// Iterates from `x` over the first `part` of every run.
    fn settle(&self, x: Vec<PlatformState>, part: f64) -> Result<Estimate, CalibrationError> {
        let mut at = self.at(x, part)?;
        let mut solution = self.step(&at, WEAK)?;
        let (mut passes, mut converged) = (1, false);
        while passes < PASSES && !self.stopped.get() {
            let size = (&solution.root * &solution.x).norm();
            if size <= SETTLED * self.scale(&at) {
                converged = true;
                break;
            }
            let mut step = solution.x.clone();
            let mut found = None;
            for _ in 0..=HALVINGS {
                passes += 1;
                let next = self.moved(&at.x, &step);
                let next = if self.unknowns.far(&next) { None } else { self.at(next, part).ok() };
                // by rounding, a sum of squares may grow at the end
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
        // where nothing leads further down, what is left of a step is what the model bends within it
        let size = (&solution.root * &solution.x).norm();
        converged |= size <= NEARLY * self.scale(&at);
        Ok(Estimate { at, solution, passes, converged })
    }

    /// The estimate from `x`: of all of the runs at once, or where that does not settle or fits poorly and `first` is true, of longer and longer parts of them.
    ///
    /// # Errors
    /// [`CalibrationError`] when a number is none.
    pub(crate) fn estimate(&self, x: Vec<PlatformState>, first: bool) -> Result<Estimate, CalibrationError> {
        let direct = self.settle(x.clone(), 1.0);
        let poor = |e: &Estimate| !e.converged || e.at.cost > 2.0 * self.rows(e);
        if direct.as_ref().is_ok_and(|e| !first || !poor(e) || self.stopped.get()) {
            return direct;
        }
        let by_and_by = || -> Result<Estimate, CalibrationError> {
            let mut x = x;
            let mut passes = 0;
            for part in [0.125, 0.25, 0.5] {
                let found = self.settle(x, part)?;
                passes += found.passes;
                x = found.at.x;
            }
            let found = self.settle(x, 1.0)?;
            Ok(Estimate { passes: passes + found.passes, ..found })
        };
        match (direct, by_and_by()) {
            (Ok(a), Ok(b)) => {
                let better = (b.converged, -b.at.cost) > (a.converged, -a.at.cost);
                let passes = a.passes + b.passes;
                Ok(Estimate { passes, ..if better { b } else { a } })
            }
            (Ok(e), Err(_)) | (Err(_), Ok(e)) => Ok(e),
            (Err(e), Err(_)) => Err(e),
        }
    }

    /// The number of measurements.
    pub(crate) fn rows(&self, e: &Estimate) -> f64 {
        e.at.runs.iter().map(|(run, _)| run.residuals.len()).sum::<usize>() as f64
    }
}
