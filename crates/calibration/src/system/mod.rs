//! Calibration of any system from data: Gauss-Newton with the Jacobians of the model's own graph, from
//! several starts.

mod answer;
mod before;
mod constraints;
mod data;
mod final_fit;
mod fit;
mod outliers;
mod search;
mod start;
mod tables;
mod units;

use std::cell::Cell;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::system::{
    Compiled, Judgement, ModelError, StartTime, StateStart, SystemModel, judge_compiled,
};
use obsdeg_ekf::EkfError;
use obsdeg_evidence::system::{FilterState, Numeric};

use crate::CalibrationProgress;
use crate::answer::Before;
use crate::record::Record;
use crate::setup::SourceRecord;
use before::said_before;
use data::{ModelData, before_first_row, read};
use final_fit::{FinalFit, FreeUnknowns, SCHEMA};
use fit::{LONG, Settled, Stuck, SystemProblem, WEAK, rank, settle, step};
use start::{first_noise, first_start, integration_steps, nowhere, plain};

pub use answer::{
    OtherSolution, OtherStarts, OutputFit, Profile, ProfilePoint, StatesStart, SystemCalibration,
    SystemCalibrationError, SystemEstimated, SystemFinding, SystemResidual, TriedStarts,
};

/// Most doublings of the number of integration steps.
const DOUBLINGS: usize = 6;

/// Most rounds of estimating the noise.
const ROUNDS: usize = 30;

/// Options of a system calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct SystemCalibrationOptions {
    /// Number of starts.
    pub starts: usize,
    /// Names of the unknowns with a requested profile.
    pub profiles: Vec<String>,
    /// Prior calibration: it applies to unknowns of the same names.
    pub prior: Option<Before<String>>,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// Calibrates `model` from a record.
///
/// # Errors
/// [`SystemCalibrationError`].
pub fn calibrate_system(
    model: &SystemModel,
    record: Record,
    options: &SystemCalibrationOptions,
    progress: &dyn Fn(CalibrationProgress<'_>) -> bool,
) -> Result<SystemCalibration, SystemCalibrationError> {
    let compiled = model.compile()?;
    let data = read(record, model, compiled.uses_time(), progress)?;
    let basis = SourceRecord { record: data.name.clone(), digest: data.digest.clone() };
    let own = digest(model);
    let again = options.prior.as_ref().and_then(|b| Some((b, basis.among(&b.rests_on)?)));
    if let Some((_, other)) = again.filter(|(b, _)| b.of == own) {
        let other = format!("{}, which the calibration before rests on, of the same model", other.record);
        return Err(SystemCalibrationError::SameRecord { record: basis.record, other });
    }
    let mut numeric = Numeric::with_inputs(model, &compiled, &data.inputs)?;
    data.origins.iter().enumerate().for_each(|(experiment, t)| numeric.begin(experiment, *t));
    let stopped = Cell::new(false);
    let progress = |now: CalibrationProgress<'_>| {
        stopped.set(!progress(now) || stopped.get());
        !stopped.get()
    };
    let found = Calibrating::new(model, &compiled, numeric, &data, options, &progress)?.run();
    // an evaluation that was stopped leaves no numbers
    found.map_err(|e| if stopped.get() { SystemCalibrationError::Interrupted } else { e })
}

/// Digest of a model, by everything that its verdicts depend on.
fn digest(model: &SystemModel) -> String {
    format!("{:016x}", model.random(0, "calibration").next_u64())
}

/// State of a calibration.
struct Calibrating<'a> {
    model: &'a SystemModel,
    compiled: &'a Compiled,
    data: &'a ModelData,
    options: &'a SystemCalibrationOptions,
    problem: SystemProblem<'a>,
    /// All filter states at the first start.
    base: DVector<f64>,
    /// True for each output whose noise is estimated.
    estimated: Vec<bool>,
}

impl<'a> Calibrating<'a> {
    fn new(
        model: &'a SystemModel,
        compiled: &'a Compiled,
        numeric: Numeric<'a>,
        data: &'a ModelData,
        options: &'a SystemCalibrationOptions,
        progress: &'a dyn Fn(CalibrationProgress<'_>) -> bool,
    ) -> Result<Self, SystemCalibrationError> {
        let known = |state: &FilterState| match *state {
            FilterState::State { i, .. } => model.states[i].start != StateStart::Unknown,
            FilterState::Parameter(_) | FilterState::Input { .. } => false,
        };
        let free: Vec<usize> = (0..numeric.states.len()).filter(|&i| !known(&numeric.states[i])).collect();
        let base = first_start(model, &numeric)?;
        let (noise, estimated) = first_noise(model, data);
        let (longest, found) = integration_steps(model, data)?;
        let known = (DMatrix::zeros(0, free.len()), DVector::zeros(0));
        let long = found + data.rows.len() as f64 > LONG;
        let mut problem = SystemProblem {
            numeric,
            data,
            free,
            noise,
            longest,
            known,
            long,
            progress,
            passes: 0,
            stopped: false,
        };
        if let Some(before) = &options.prior {
            let names: Vec<&str> = problem.free.iter().map(|&i| problem.numeric.names[i].as_str()).collect();
            problem.known = said_before(&before.estimates, &names, &problem, &base)?;
        }
        Ok(Self { model, compiled, data, options, problem, base, estimated })
    }

    /// Verdicts: with functions of the time, those of almost every time where the states start with a row.
    fn judged(&self) -> Result<Judgement, ModelError> {
        let any_time = self.data.states_start != StatesStart::Model && self.compiled.uses_time();
        let generic = any_time.then(|| SystemModel { time: StartTime::Generic, ..self.model.clone() });
        judge_compiled(generic.as_ref().unwrap_or(self.model), self.compiled, self.options.seed, None)
    }

    fn run(mut self) -> Result<SystemCalibration, SystemCalibrationError> {
        let judged = self.judged()?;
        let starts = self.starts();
        let unknowns = self.free_unknowns(&judged);
        let (ends, tried, first_error) = self.search(&starts, &|j| unknowns.observable(j));
        let best = self.best_end(&ends, tried, first_error)?;
        let (best, finer) = self.with_finer_steps(best, tried)?;
        let best = self.with_estimated_noise(best, finer, tried)?;
        let fit = self.final_fit(best, finer, &unknowns, tried)?;
        let quantities = self.quantities(&unknowns, &fit);
        let combinations = self.combinations(&judged, &unknowns.names, &fit)?;
        let covariance = self.covariance(&unknowns.names, &fit);
        let residuals = self.residuals(&fit.at, &fit.solution);
        let outputs = self.with_gates(self.outputs(&residuals, &fit.at, &fit.solution));
        let findings = self.findings(&fit, &residuals, &outputs);
        let FinalFit { best, solution, determined, mean, .. } = &fit;
        let (others, led, other_starts) = self.others(&ends, best, determined, solution, *mean, finer);
        let profiles = self.profiles(&unknowns.names, best, solution, finer)?;
        Ok(SystemCalibration {
            schema: SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            name: self.model.name.clone(),
            consistent: (!self.all_estimated() || !findings.is_empty()).then_some(findings.is_empty()),
            findings,
            quantities,
            combinations,
            covariance,
            chi_square: fit.at.cost(),
            degrees_of_freedom: fit.degrees_of_freedom,
            band: fit.band(),
            factor: fit.mean.sqrt(),
            outputs,
            others,
            starts: TriedStarts { tried, led },
            other_starts: OtherStarts { failed: tried - ends.len(), ..other_starts },
            starts_at_most: starts.len(),
            profiles,
            samples: self.data.samples,
            intervals: self.data.intervals,
            begins: self.data.origins.first().copied().filter(|t| *t != 0.0),
            states_start: self.data.states_start,
            before_first_row: before_first_row(&self.data.rows),
            rows: self.data.rows.len(),
            ignored: self.data.ignored.clone(),
            model: digest(self.model),
            rests_on: self.rests_on(),
            shared: self.shared(),
            substeps: finer,
            seed: self.options.seed,
            residuals,
        })
    }

    /// Free unknowns with their verdicts; that of an unknown of one experiment may have its plain name.
    fn free_unknowns(&self, judged: &Judgement) -> FreeUnknowns {
        let names: Vec<String> =
            self.problem.free.iter().map(|&i| self.problem.numeric.names[i].clone()).collect();
        let verdict = |name: &String| {
            judged.verdict(self.model, name).or_else(|| judged.verdict(self.model, plain(name)))
        };
        let verdicts = names.iter().map(verdict).collect();
        FreeUnknowns { names, verdicts }
    }

    /// Text of the constraint of this index.
    fn constraint(&self, i: usize) -> String {
        self.model.constraints[i % self.model.constraints.len()].text.clone()
    }

    /// Error of `tried` starts that lead to no solution.
    fn stuck(&self, e: Stuck, tried: usize) -> SystemCalibrationError {
        match e {
            Stuck::Numbers(reason) => nowhere(tried)(reason),
            Stuck::Constraint(i) => {
                SystemCalibrationError::ConstraintUnmet { starts: tried, constraint: self.constraint(i) }
            }
        }
    }

    /// End of the search with the lowest sum of squares.
    fn best_end(
        &self,
        ends: &[Settled],
        tried: usize,
        first_error: Option<Stuck>,
    ) -> Result<Settled, SystemCalibrationError> {
        let Some(best) = ends.first().cloned() else {
            let e = first_error.unwrap_or(Stuck::Numbers(EkfError::Singular { column: 0 }));
            return Err(self.stuck(e, tried));
        };
        match self.problem.flat(&self.base, &best.x) {
            Some(i) => Err(SystemCalibrationError::Flat { constraint: self.constraint(i) }),
            None => Ok(best),
        }
    }

    /// Solution with more integration steps, until it does not change visibly, and the factor of their
    /// number.
    fn with_finer_steps(
        &mut self,
        mut best: Settled,
        tried: usize,
    ) -> Result<(Settled, usize), SystemCalibrationError> {
        let mut finer = 1;
        for _ in 0..DOUBLINGS {
            if self.problem.stopped {
                break;
            }
            let coarse = self.problem.at(&self.base, &best.x, finer).map_err(nowhere(tried))?;
            let fine = self.problem.at(&self.base, &best.x, 2 * finer).map_err(nowhere(tried))?;
            let scale = (coarse.cost() / coarse.sigmas.len() as f64).max(1.0).sqrt();
            let off = coarse
                .left
                .iter()
                .zip(fine.left.iter())
                .zip(&coarse.sigmas)
                .map(|((a, b), s)| ((a - b) / s).abs());
            if off.fold(0.0, f64::max) <= 1e-3 * scale {
                break;
            }
            finer *= 2;
            best = self.settled(best.x, finer, tried)?;
        }
        Ok((best, finer))
    }

    /// Solution with the noise that is not stated, as the residuals have it.
    fn with_estimated_noise(
        &mut self,
        mut best: Settled,
        finer: usize,
        tried: usize,
    ) -> Result<Settled, SystemCalibrationError> {
        for _ in 0..ROUNDS {
            let at = self.problem.at(&self.base, &best.x, finer).map_err(nowhere(tried))?;
            let factors = self.factors(&at, &best.x).map_err(nowhere(tried))?;
            if factors.iter().all(|f| (f - 1.0).abs() < 1e-4) {
                break;
            }
            self.problem.noise.iter_mut().zip(&factors).for_each(|(s, f)| *s *= f);
            best = self.settled(best.x, finer, tried)?;
        }
        Ok(best)
    }

    /// End of the iteration from `x`.
    fn settled(
        &mut self,
        x: DVector<f64>,
        finer: usize,
        tried: usize,
    ) -> Result<Settled, SystemCalibrationError> {
        let end = settle(&mut self.problem, &self.base, x, finer, None);
        end.map_err(|e| self.stuck(e, tried))
    }

    /// Fit at the solution `best`.
    fn final_fit(
        &mut self,
        best: Settled,
        finer: usize,
        unknowns: &FreeUnknowns,
        tried: usize,
    ) -> Result<FinalFit, SystemCalibrationError> {
        let at = self.problem.at(&self.base, &best.x, finer).map_err(nowhere(tried))?;
        let solution = step(&at, &best.x, 1.0 / WEAK).map_err(nowhere(tried))?;
        let weaker = step(&at, &best.x, 0.1 / WEAK).map_err(nowhere(tried))?;
        let rank = rank(&solution);
        let measured = self.data.rows.iter().flat_map(|r| &r.outputs).flatten().count() + at.known.1.len();
        if measured <= rank {
            return Err(SystemCalibrationError::TooFew { found: measured, unknowns: rank });
        }
        let degrees_of_freedom = measured - rank;
        let mean = at.cost() / degrees_of_freedom as f64;
        let mut out =
            FinalFit { best, at, solution, weaker, determined: Vec::new(), degrees_of_freedom, mean };
        let determined = |j: usize| unknowns.observable(j) && out.determines(&[(j, 1.0)]);
        out.determined = (0..unknowns.names.len()).map(determined).collect();
        Ok(out)
    }
}
