//! Calibration of any system from data: Gauss-Newton with the Jacobians of the model's own graph, from
//! several starts.

mod answer;
mod before;
mod constraints;
mod data;
mod fit;
mod outliers;
mod search;
mod units;

use std::cell::Cell;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::degree::{Status, Verdict};
use obsdeg_core::system::{
    Compiled, Judgement, ModelError, StartTime, StateStart, SystemModel, invariant_reports, judge_compiled,
    symmetries,
};
use obsdeg_ekf::EkfError;
use obsdeg_ekf::consistency::chi_square_band;
use obsdeg_evidence::system::{FilterState, Numeric};

pub use answer::{
    OtherSolution, OtherStarts, OutputFit, Profile, StatesStart, SystemCalibration, SystemCalibrationError,
    SystemEstimated, SystemFinding, SystemResidual,
};

use crate::CalibrationProgress;
use crate::answer::{Before, CovarianceTable};
use crate::least_squares::LeastSquaresSolution;
use crate::levels;
use crate::record::Record;
use crate::setup::SourceRecord;
use before::said_before;
use data::{ModelData, before_first_row, read};
use fit::{LONG, ModelRows, Settled, Stuck, SystemProblem, WEAK, leverage, rank, settle, size, step};

/// Name and version of the JSON layout.
const SCHEMA: &str = "obsdeg.system-calibration/1";
/// Largest ratio of sigmas, for a pull ten times as weak, of a determined unknown.
const DETERMINED: f64 = 1.05;
/// Most steps of integration over all rows, and for each row besides.
const STEPS: f64 = 50_000.0;
const STEPS_A_ROW: f64 = 50.0;
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

/// Combination: its text, degree, value, and derivatives by unknowns.
type OfInvariant = (String, Option<usize>, f64, Vec<(usize, f64)>);

/// Free unknowns of a model: their names, and their verdicts where the model has them.
struct FreeUnknowns {
    names: Vec<String>,
    verdicts: Vec<Option<Verdict>>,
}

impl FreeUnknowns {
    /// True if the unknown `j` is observable.
    fn observable(&self, j: usize) -> bool {
        self.verdicts[j].is_some_and(|v| v.status == Status::Observable)
    }
}

/// Fit at the solution.
struct FinalFit {
    best: Settled,
    /// Rows at the solution.
    at: ModelRows,
    solution: LeastSquaresSolution,
    /// Solution with a pull ten times as weak.
    weaker: LeastSquaresSolution,
    /// True for each free unknown that model and record determine.
    determined: Vec<bool>,
    degrees_of_freedom: usize,
    /// Chi-square per degree of freedom.
    mean: f64,
}

impl FinalFit {
    /// True if the record determines a functional of the free unknowns.
    fn determines(&self, terms: &[(usize, f64)]) -> bool {
        self.weaker.sigma(terms) <= DETERMINED * self.solution.sigma(terms)
    }

    /// Covariance of two functionals with the noise that the fit has, if that is larger.
    fn between(&self, a: &[(usize, f64)], b: &[(usize, f64)]) -> f64 {
        self.solution.covariance_with(a, b, self.mean.sqrt().max(1.0), &self.at.known.0)
    }

    /// Band of chi-square per degree of freedom.
    fn band(&self) -> (f64, f64) {
        let free = self.degrees_of_freedom as f64;
        let band = chi_square_band(free, 1.0, 1.0 - levels::NOISE);
        (band.0 / free, band.1 / free)
    }

    /// Estimate of a functional by its name and unit.
    fn estimated(
        &self,
        (name, unit): (&str, String),
        verdict: Option<Verdict>,
        determined: bool,
        value: f64,
        terms: &[(usize, f64)],
    ) -> SystemEstimated {
        let there = |x: f64| determined.then_some(x);
        SystemEstimated {
            name: name.into(),
            unit,
            status: verdict.map(|v| v.status),
            degree: verdict.and_then(|v| v.degree),
            determined,
            estimate: there(value),
            sigma: there(self.solution.sigma(terms)),
            sigma_rescaled: there(self.between(terms, terms).max(0.0).sqrt()),
        }
    }
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
            starts: (tried, led),
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

    /// Estimates of the unknowns.
    fn quantities(&self, unknowns: &FreeUnknowns, fit: &FinalFit) -> Vec<SystemEstimated> {
        let of = |(j, name): (usize, &String)| {
            let named = (name.as_str(), self.unit(self.problem.free[j]));
            fit.estimated(named, unknowns.verdicts[j], fit.determined[j], fit.best.x[j], &[(j, 1.0)])
        };
        unknowns.names.iter().enumerate().map(of).collect()
    }

    /// Estimates of the requested combinations, then of identifiable combinations of unknowns that are not
    /// determined alone, by the symmetries of the model.
    fn combinations(
        &self,
        judged: &Judgement,
        names: &[String],
        fit: &FinalFit,
    ) -> Result<Vec<SystemEstimated>, ModelError> {
        let all = self.problem.all(&self.base, &fit.best.x);
        let (values, by_all) = self.problem.numeric.combinations(&all);
        let by_free = by_all * self.problem.of_free(&self.base, &fit.best.x);
        let requested = self.model.combinations.iter().zip(judged.asked()).enumerate().map(|(i, (c, v))| {
            let terms: Vec<(usize, f64)> = by_free.row(i).iter().copied().enumerate().collect();
            let determined = v.status == Status::Observable && fit.determines(&terms);
            fit.estimated((c.text.as_str(), String::new()), Some(v), determined, values[i], &terms)
        });
        let mut out: Vec<SystemEstimated> = requested.collect();
        for (text, degree, value, terms) in self.invariants(judged, names, &fit.best.x)? {
            if out.iter().any(|c| c.name == text) {
                continue;
            }
            let verdict = Verdict { status: Status::Observable, degree };
            let named = (text.as_str(), String::new());
            out.push(fit.estimated(named, Some(verdict), fit.determines(&terms), value, &terms));
        }
        Ok(out)
    }

    /// Covariance of the determined unknowns.
    fn covariance(&self, names: &[String], fit: &FinalFit) -> CovarianceTable {
        let own: Vec<usize> = (0..names.len()).filter(|&j| fit.determined[j]).collect();
        let p = fit.solution.covariance();
        CovarianceTable {
            names: own.iter().map(|&j| names[j].clone()).collect(),
            units: own.iter().map(|&j| self.unit(self.problem.free[j])).collect(),
            estimates: own.iter().map(|&j| fit.best.x[j]).collect(),
            covariance: own.iter().map(|&i| own.iter().map(|&j| p[(i, j)]).collect()).collect(),
            rescaled: own
                .iter()
                .map(|&i| own.iter().map(|&j| fit.between(&[(i, 1.0)], &[(j, 1.0)])).collect())
                .collect(),
        }
    }

    /// True if the noise of every output is estimated: chi-square then says nothing.
    fn all_estimated(&self) -> bool {
        self.estimated.iter().all(|e| *e)
    }

    /// Evidence against the model or its sigmas.
    fn findings(
        &self,
        fit: &FinalFit,
        residuals: &[SystemResidual],
        outputs: &[OutputFit],
    ) -> Vec<SystemFinding> {
        let (band, mean) = (fit.band(), fit.mean);
        let mut out = Vec::new();
        if self.problem.stopped {
            out.push(SystemFinding::Interrupted);
        } else if !fit.best.converged {
            out.push(SystemFinding::NotSettled);
        }
        if !self.all_estimated() && !(band.0..=band.1).contains(&mean) {
            out.push(SystemFinding::Noise { chi_square: mean, factor: mean.sqrt() });
        }
        for o in outputs {
            if let Some(probability) =
                o.whiteness_probability.filter(|p| p * (outputs.len() as f64) < levels::CORRELATED)
            {
                out.push(SystemFinding::Correlated { output: o.output.clone(), probability });
            }
        }
        out.extend(self.outliers(residuals, outputs));
        out
    }

    /// Identifiable products and sums of unknowns that are not determined alone: their text, degree, value at
    /// `x`, and derivatives by the unknowns `names`. Combinations with known starts are left out.
    fn invariants(
        &self,
        judged: &Judgement,
        names: &[String],
        x: &DVector<f64>,
    ) -> Result<Vec<OfInvariant>, ModelError> {
        let found = symmetries(self.model, self.compiled, judged, self.options.seed)?;
        let reports = invariant_reports(judged, &found);
        let of = |(i, report): (&obsdeg_core::system::Invariant, obsdeg_core::system::SystemCombination)| {
            let place = |&(c, m): &(usize, i64)| {
                let name = &judged.layout.unknowns[c].name;
                Some((names.iter().position(|n| n == name)?, m as f64))
            };
            let powers: Vec<(usize, f64)> = i.terms.iter().map(place).collect::<Option<_>>()?;
            let value = match i.product {
                true => powers.iter().map(|&(j, m)| x[j].powf(m)).product(),
                false => powers.iter().map(|&(j, m)| m * x[j]).sum::<f64>(),
            };
            let by = |&(j, m): &(usize, f64)| (j, if i.product { m * value / x[j] } else { m });
            let terms: Vec<(usize, f64)> = powers.iter().map(by).collect();
            let finite = terms.iter().all(|t| t.1.is_finite());
            finite.then_some((report.expression, report.degree, value, terms))
        };
        Ok(found.invariants.iter().zip(reports).filter_map(of).collect())
    }

    /// Records that the estimates rest on.
    fn rests_on(&self) -> Vec<SourceRecord> {
        let own = SourceRecord { record: self.data.name.clone(), digest: self.data.digest.clone() };
        let before = self.options.prior.iter().flat_map(|b| b.rests_on.iter());
        let before = before.filter(|b| own.among(std::slice::from_ref(b)).is_none());
        std::iter::once(own.clone()).chain(before.cloned()).collect()
    }

    /// True if the prior calibration rests on the same record.
    fn shared(&self) -> bool {
        let own = SourceRecord { record: self.data.name.clone(), digest: self.data.digest.clone() };
        self.options.prior.as_ref().is_some_and(|b| own.among(&b.rests_on).is_some())
    }

    fn unit(&self, state: usize) -> String {
        match self.problem.numeric.states[state] {
            FilterState::State { i, .. } => self.model.states[i].named.unit.clone(),
            FilterState::Parameter(i) => self.model.parameters[i].unit.clone(),
            FilterState::Input { i, derivative: 0, .. } => self.model.unknown_inputs[i].0.unit.clone(),
            FilterState::Input { .. } => String::new(),
        }
    }

    /// Factors on the noise of the outputs: 1 where it is given.
    fn factors(&self, at: &ModelRows, x: &DVector<f64>) -> Result<Vec<f64>, EkfError> {
        let solution = step(at, x, 1.0 / WEAK)?;
        let of = |j: usize| {
            let own = (0..at.keys.len()).filter(|&i| at.keys[i].1 == j);
            let (chi, free) = own.fold((0.0, 0.0), |(c, f), i| {
                (c + (at.left[i] / at.sigmas[i]).powi(2), f + 1.0 - leverage(at, &solution, i))
            });
            if self.estimated[j] && chi > 0.0 && free > 1e-9 { (chi / free).sqrt() } else { 1.0 }
        };
        Ok((0..self.estimated.len()).map(of).collect())
    }

    /// Profiles: chi-square at values of an unknown about its estimate, with all others fitted.
    fn profiles(
        &mut self,
        names: &[String],
        best: &Settled,
        solution: &LeastSquaresSolution,
        finer: usize,
    ) -> Result<Vec<Profile>, SystemCalibrationError> {
        let mut out = Vec::new();
        for name in &self.options.profiles {
            let j = names.iter().position(|n| n == name).ok_or_else(|| {
                SystemCalibrationError::NoUnknown { found: name.clone(), expected: names.join(", ") }
            })?;
            // three sigma, or half of the size where sigma is large
            let width = (3.0 * solution.sigma(&[(j, 1.0)])).min(0.5 * size(best.x[j]));
            let mut points = vec![(best.x[j], 0.0)];
            for side in [-1.0, 1.0] {
                let mut x = best.x.clone();
                for k in 1..=4 {
                    x[j] = best.x[j] + side * width * f64::from(k) / 4.0;
                    let Ok(end) = settle(&mut self.problem, &self.base, x.clone(), finer, Some(j)) else {
                        break;
                    };
                    points.push((x[j], end.cost - best.cost));
                    x = end.x;
                }
            }
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            // an unknown that constraints alone determine has no other values
            points.dedup_by(|a, b| a.0 == b.0);
            let flat = points.len() > 1 && points.iter().all(|p| p.1.abs() < 0.01);
            out.push(Profile { name: name.clone(), points, flat });
        }
        Ok(out)
    }
}

/// All filter states at the first start: values of the file, and 1 where it states none.
fn first_start(model: &SystemModel, numeric: &Numeric<'_>) -> Result<DVector<f64>, ModelError> {
    let nominal = &model.simulation;
    let value = |(i, name): (usize, &String)| {
        let found = nominal.named(&nominal.values, name);
        let start = match numeric.states[i] {
            FilterState::State { i, .. } => &model.states[i].start,
            _ => &StateStart::Unknown,
        };
        match (found, start) {
            (Some(v), _) => Ok(v),
            (None, StateStart::Known) => Err(ModelError {
                what: format!("`{name}`"),
                message: "a known start without a value; expected one under [simulation.values]".into(),
                span: None,
            }),
            (None, _) => Ok(1.0),
        }
    };
    let base = numeric.names.iter().enumerate().map(value).collect::<Result<Vec<_>, _>>()?;
    let mut base = DVector::from_vec(base);
    numeric.set_known_starts(&mut base);
    Ok(base)
}

/// Noise by output at the first start, and true for each output whose noise is estimated.
fn first_noise(model: &SystemModel, data: &ModelData) -> (Vec<f64>, Vec<bool>) {
    // a row without a sigma of its own needs one
    let bare = |j: usize| data.rows.iter().any(|r| r.outputs[j].is_some() && r.sigmas[j].is_none());
    let by_inputs = data.rows.iter().any(|r| r.inputs.iter().any(|(_, s)| *s > 0.0));
    let (mut noise, mut estimated) = (Vec::new(), Vec::new());
    for (j, (named, _)) in model.outputs.iter().enumerate() {
        let given = model.simulation.noise.get(&named.name).copied();
        let unknown = given.is_none() && bare(j) && !by_inputs;
        estimated.push(unknown);
        let spread = spread(data.rows.iter().filter_map(|r| r.outputs[j]));
        noise.push(given.unwrap_or(if unknown { spread } else { 0.0 }));
    }
    (noise, estimated)
}

/// Longest step of integration, and the number of steps over all rows.
///
/// # Errors
/// [`SystemCalibrationError::TooLong`], before the work begins.
fn integration_steps(model: &SystemModel, data: &ModelData) -> Result<(f64, f64), SystemCalibrationError> {
    let last = data.rows.iter().map(|r| r.t).fold(0.0, f64::max);
    let usual = if last > 0.0 { last / 50.0 } else { 1.0 };
    let longest = model.simulation.step.unwrap_or(f64::INFINITY).min(usual);
    let mut found = 0.0;
    for run in data.rows.chunk_by(|a, b| (a.experiment, a.run) == (b.experiment, b.run)) {
        let steps = |from: f64, to: f64| ((to - from) / longest).ceil().max(1.0);
        found += steps(0.0, run[0].t) + run.windows(2).map(|w| steps(w[0].t, w[1].t)).sum::<f64>();
    }
    let most = STEPS + STEPS_A_ROW * data.rows.len() as f64;
    if !model.states.is_empty() && found > most {
        let record = data.name.clone();
        return Err(SystemCalibrationError::TooLong { record, last, found, longest, most });
    }
    Ok((longest, found))
}

/// Error of `starts` from which the model gives no numbers.
fn nowhere(starts: usize) -> impl Fn(EkfError) -> SystemCalibrationError {
    move |reason| SystemCalibrationError::Nowhere { starts, reason }
}

/// Name of an unknown without its experiment.
fn plain(name: &str) -> &str {
    name.split_once('@').map_or(name, |(n, _)| n)
}

/// First estimate of the noise of an output: a tenth of its standard deviation.
fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / n;
    let square = values.map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    if square > 0.0 { 0.1 * square.sqrt() } else { 0.1 * size(mean) }
}
