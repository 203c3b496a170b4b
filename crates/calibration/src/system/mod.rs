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
use obsdeg_core::degree::Status;
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

use crate::Going;
use crate::answer::{Before, CovarianceTable};
use crate::least_squares::Solution;
use crate::levels;
use crate::record::Record;
use crate::setup::Basis;
use before::said_before;
use data::{Read, before_first_row, read};
use fit::{At, LONG, Problem, Settled, Stuck, WEAK, leverage, rank, settle, size, step};

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
pub struct SystemOptions {
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
    options: &SystemOptions,
    going: &dyn Fn(Going<'_>) -> bool,
) -> Result<SystemCalibration, SystemCalibrationError> {
    let compiled = model.compile()?;
    let data = read(record, model, compiled.uses_time(), going)?;
    let basis = Basis { record: data.name.clone(), digest: data.digest.clone() };
    let own = digest(model);
    let again = options.prior.as_ref().and_then(|b| Some((b, basis.among(&b.rests_on)?)));
    if let Some((_, other)) = again.filter(|(b, _)| b.of == own) {
        let other = format!("{}, which the calibration before rests on, of the same model", other.record);
        return Err(SystemCalibrationError::SameRecord { record: basis.record, other });
    }
    let mut numeric = Numeric::with_inputs(model, &compiled, &data.inputs)?;
    data.origins.iter().enumerate().for_each(|(experiment, t)| numeric.begin(experiment, *t));
    let stopped = Cell::new(false);
    let going = |now: Going<'_>| {
        stopped.set(!going(now) || stopped.get());
        !stopped.get()
    };
    let found = Calibrating::new(model, &compiled, numeric, &data, options, &going)?.run();
    // an evaluation that was stopped leaves no numbers
    found.map_err(|e| if stopped.get() { SystemCalibrationError::Interrupted } else { e })
}

/// Digest of a model, by everything that its verdicts depend on.
fn digest(model: &SystemModel) -> String {
    format!("{:016x}", model.random(0, "calibration").next_u64())
}

/// Combination: its text, degree, value, and derivatives by unknowns.
type OfInvariant = (String, Option<usize>, f64, Vec<(usize, f64)>);

/// State of a calibration.
struct Calibrating<'a> {
    model: &'a SystemModel,
    compiled: &'a Compiled,
    data: &'a Read,
    options: &'a SystemOptions,
    problem: Problem<'a>,
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
        data: &'a Read,
        options: &'a SystemOptions,
        going: &'a dyn Fn(Going<'_>) -> bool,
    ) -> Result<Self, SystemCalibrationError> {
        let nominal = &model.simulation;
        let known = |state: &FilterState| match *state {
            FilterState::State { i, .. } => model.states[i].start != StateStart::Unknown,
            FilterState::Parameter(_) | FilterState::Input { .. } => false,
        };
        let free: Vec<usize> = (0..numeric.states.len()).filter(|&i| !known(&numeric.states[i])).collect();
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
        // a row without a sigma of its own needs one
        let bare = |j: usize| data.rows.iter().any(|r| r.outputs[j].is_some() && r.sigmas[j].is_none());
        let by_inputs = data.rows.iter().any(|r| r.inputs.iter().any(|(_, s)| *s > 0.0));
        let (mut noise, mut estimated) = (Vec::new(), Vec::new());
        for (j, (named, _)) in model.outputs.iter().enumerate() {
            let given = nominal.noise.get(&named.name).copied();
            let unknown = given.is_none() && bare(j) && !by_inputs;
            estimated.push(unknown);
            let spread = spread(data.rows.iter().filter_map(|r| r.outputs[j]));
            noise.push(given.unwrap_or(if unknown { spread } else { 0.0 }));
        }
        let last = data.rows.iter().map(|r| r.t).fold(0.0, f64::max);
        let longest = nominal.step.unwrap_or(f64::INFINITY).min(if last > 0.0 { last / 50.0 } else { 1.0 });
        // checked before the work begins
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
        let known = (DMatrix::zeros(0, free.len()), DVector::zeros(0));
        let long = found + data.rows.len() as f64 > LONG;
        let mut problem =
            Problem { numeric, data, free, noise, longest, known, long, going, passes: 0, stopped: false };
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
        let measured = self.data.rows.iter().flat_map(|r| &r.outputs).flatten().count();
        let starts = self.starts();
        let names: Vec<String> =
            self.problem.free.iter().map(|&i| self.problem.numeric.names[i].clone()).collect();
        let verdict = |j: usize| {
            judged.verdict(self.model, &names[j]).or_else(|| judged.verdict(self.model, plain(&names[j])))
        };
        let verdicts: Vec<_> = (0..names.len()).map(verdict).collect();
        let observable = |j: usize| verdicts[j].is_some_and(|v| v.status == Status::Observable);
        let (ends, tried, first_error) = self.search(&starts, &observable);
        let model = self.model;
        let constraint = |i: usize| model.constraints[i % model.constraints.len()].text.clone();
        let stuck = |e| match e {
            Stuck::Numbers(reason) => SystemCalibrationError::Nowhere { starts: tried, reason },
            Stuck::Held(i) => SystemCalibrationError::Unheld { starts: tried, constraint: constraint(i) },
        };
        let Some(best) = ends.first().cloned() else {
            return Err(stuck(first_error.unwrap_or(Stuck::Numbers(EkfError::Singular { column: 0 }))));
        };
        let nowhere = |reason| SystemCalibrationError::Nowhere { starts: tried, reason };
        if let Some(i) = self.problem.flat(&self.base, &best.x) {
            return Err(SystemCalibrationError::Flat { constraint: constraint(i) });
        }
        // more integration steps until the solution does not change visibly
        let mut finer = 1;
        let mut best = best;
        for _ in 0..DOUBLINGS {
            if self.problem.stopped {
                break;
            }
            let coarse = self.problem.at(&self.base, &best.x, finer).map_err(nowhere)?;
            let fine = self.problem.at(&self.base, &best.x, 2 * finer).map_err(nowhere)?;
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
            best = settle(&mut self.problem, &self.base, best.x, finer, None).map_err(stuck)?;
        }
        // noise that is not stated
        for _ in 0..ROUNDS {
            let at = self.problem.at(&self.base, &best.x, finer).map_err(nowhere)?;
            let factors = self.factors(&at, &best.x).map_err(nowhere)?;
            if factors.iter().all(|f| (f - 1.0).abs() < 1e-4) {
                break;
            }
            self.problem.noise.iter_mut().zip(&factors).for_each(|(s, f)| *s *= f);
            best = settle(&mut self.problem, &self.base, best.x, finer, None).map_err(stuck)?;
        }
        let at = self.problem.at(&self.base, &best.x, finer).map_err(nowhere)?;
        let solution = step(&at, &best.x, 1.0 / WEAK).map_err(nowhere)?;
        let weaker = step(&at, &best.x, 0.1 / WEAK).map_err(nowhere)?;
        let determined: Vec<bool> = (0..names.len())
            .map(|j| observable(j) && weaker.sigma(&[(j, 1.0)]) <= DETERMINED * solution.sigma(&[(j, 1.0)]))
            .collect();
        let rank = rank(&solution);
        let measured = measured + at.known.1.len();
        if measured <= rank {
            return Err(SystemCalibrationError::TooFew { found: measured, unknowns: rank });
        }
        let degrees_of_freedom = measured - rank;
        let mean = at.cost() / degrees_of_freedom as f64;
        let rescale = mean.sqrt().max(1.0);
        let known = &at.known.0;
        let between = |a: &[(usize, f64)], b: &[(usize, f64)]| solution.covariance_with(a, b, rescale, known);
        let estimate =
            |name: &str, unit: &str, status, degree, determined: bool, value: f64, terms: &[(usize, f64)]| {
                let sigma = solution.sigma(terms);
                let there = |x: f64| determined.then_some(x);
                SystemEstimated {
                    name: name.into(),
                    unit: unit.into(),
                    status,
                    degree,
                    determined,
                    estimate: there(value),
                    sigma: there(sigma),
                    sigma_rescaled: there(between(terms, terms).max(0.0).sqrt()),
                }
            };
        let unknowns: Vec<SystemEstimated> = (0..names.len())
            .map(|j| {
                let v = verdicts[j];
                let unit = self.unit(self.problem.free[j]);
                let (status, degree) = (v.map(|v| v.status), v.and_then(|v| v.degree));
                estimate(&names[j], &unit, status, degree, determined[j], best.x[j], &[(j, 1.0)])
            })
            .collect();
        let all = self.problem.all(&self.base, &best.x);
        let (values, by_all) = self.problem.numeric.combinations(&all);
        let by_free = by_all * self.problem.of_free(&self.base, &best.x);
        let combinations =
            self.model.combinations.iter().zip(judged.asked()).enumerate().map(|(i, (c, v))| {
                let terms: Vec<(usize, f64)> = by_free.row(i).iter().copied().enumerate().collect();
                let (sigma, wide) = (solution.sigma(&terms), weaker.sigma(&terms));
                let determined = v.status == Status::Observable && wide <= DETERMINED * sigma;
                estimate(&c.text, "", Some(v.status), v.degree, determined, values[i], &terms)
            });
        let mut combinations: Vec<SystemEstimated> = combinations.collect();
        // identifiable combinations of unknowns that are not determined alone, by the symmetries of the model
        for (text, degree, value, terms) in self.invariants(&judged, &names, &best.x)? {
            if combinations.iter().any(|c| c.name == text) {
                continue;
            }
            let determined = weaker.sigma(&terms) <= DETERMINED * solution.sigma(&terms);
            let status = Some(Status::Observable);
            combinations.push(estimate(&text, "", status, degree, determined, value, &terms));
        }
        let own: Vec<usize> = (0..names.len()).filter(|&j| determined[j]).collect();
        let p = solution.covariance();
        let covariance = CovarianceTable {
            names: own.iter().map(|&j| names[j].clone()).collect(),
            units: own.iter().map(|&j| self.unit(self.problem.free[j])).collect(),
            estimates: own.iter().map(|&j| best.x[j]).collect(),
            covariance: own.iter().map(|&i| own.iter().map(|&j| p[(i, j)]).collect()).collect(),
            rescaled: own
                .iter()
                .map(|&i| own.iter().map(|&j| between(&[(i, 1.0)], &[(j, 1.0)])).collect())
                .collect(),
        };
        let residuals = self.residuals(&at, &solution);
        let outputs = self.with_gates(self.outputs(&residuals, &at, &solution));
        let all_estimated = self.estimated.iter().all(|e| *e);
        let band = chi_square_band(degrees_of_freedom as f64, 1.0, 1.0 - levels::NOISE);
        let band = (band.0 / degrees_of_freedom as f64, band.1 / degrees_of_freedom as f64);
        let mut findings = Vec::new();
        if self.problem.stopped {
            findings.push(SystemFinding::Interrupted);
        } else if !best.converged {
            findings.push(SystemFinding::NotSettled);
        }
        if !all_estimated && !(band.0..=band.1).contains(&mean) {
            findings.push(SystemFinding::Noise { chi_square: mean, factor: mean.sqrt() });
        }
        for o in &outputs {
            if let Some(probability) =
                o.whiteness_probability.filter(|p| p * (outputs.len() as f64) < levels::CORRELATED)
            {
                findings.push(SystemFinding::Correlated { output: o.output.clone(), probability });
            }
        }
        findings.extend(self.outliers(&residuals, &outputs));
        let (others, led, other_starts) = self.others(&ends, &best, &determined, &solution, mean, finer);
        let profiles = self.profiles(&names, &best, &solution, finer)?;
        Ok(SystemCalibration {
            schema: SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            name: self.model.name.clone(),
            consistent: (!all_estimated || !findings.is_empty()).then_some(findings.is_empty()),
            findings,
            quantities: unknowns,
            combinations,
            covariance,
            chi_square: at.cost(),
            degrees_of_freedom,
            band,
            factor: mean.sqrt(),
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

    /// Identifiable products and sums of unknowns that are not determined alone: their text, degree, value at
    /// `x`, and derivatives by the unknowns `names`. Combinations with known starts are left out.
    fn invariants(
        &self,
        judged: &Judgement,
        names: &[String],
        x: &DVector<f64>,
    ) -> Result<Vec<OfInvariant>, ModelError> {
        let found = symmetries(self.model, self.compiled, judged, self.options.seed)?;
        let reports = invariant_reports(self.model, judged, &found);
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
    fn rests_on(&self) -> Vec<Basis> {
        let own = Basis { record: self.data.name.clone(), digest: self.data.digest.clone() };
        let before = self.options.prior.iter().flat_map(|b| b.rests_on.iter());
        let before = before.filter(|b| own.among(std::slice::from_ref(b)).is_none());
        std::iter::once(own.clone()).chain(before.cloned()).collect()
    }

    /// True if the prior calibration rests on the same record.
    fn shared(&self) -> bool {
        let own = Basis { record: self.data.name.clone(), digest: self.data.digest.clone() };
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
    fn factors(&self, at: &At, x: &DVector<f64>) -> Result<Vec<f64>, EkfError> {
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
        solution: &Solution,
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
