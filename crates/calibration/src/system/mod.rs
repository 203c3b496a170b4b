//! Any system calibrated from data: Gauss and Newton with the Jacobians of the model's own graph, from several starts.

mod answer;
mod data;

use nalgebra::{DMatrix, DVector, RowDVector};
use obsdeg_core::degree::Status;
use obsdeg_core::system::{Compiled, ModelError, StateStart, SystemModel, judge_compiled};
use obsdeg_ekf::consistency::{autocorrelation, chi_square_band, chi_square_quantile, ljung_box};
use obsdeg_ekf::integrate::runge_kutta;
use obsdeg_ekf::{EkfError, Measurement};
use obsdeg_evidence::simulation::Noise;
use obsdeg_evidence::system::{FilterState, Numeric};

pub use answer::{
    OtherSolution, OutputFit, Profile, SystemCalibration, SystemCalibrationError, SystemEstimated,
    SystemFinding, SystemResidual,
};

use crate::Going;
use crate::answer::{Before, CovarianceTable};
use crate::least_squares::{Rows, Solution};
use crate::record::Record;
use crate::setup::Basis;
use data::{Data, Read, read};

/// Name and version of the JSON layout.
const SCHEMA: &str = "obsdeg.system-calibration/1";
/// Most iterations from a start.
const PASSES: usize = 200;
/// An iteration has settled when it moves by less than this, in standard deviations as the fit has them.
const SETTLED: f64 = 1e-5;
/// A pull is weak: so many times wider than an unknown is large.
const WEAK: f64 = 1e7;
/// A pull ten times as weak leaves the sigma of what is determined.
const DETERMINED: f64 = 1.05;
/// The probability with which right data are in their bands.
const STRICT: f64 = 0.999;
/// Two solutions are one when all that is determined differs by less, in sigma.
const SAME: f64 = 1e-2;
/// A solution is listed beside the best when its sum of squares is not larger by more, in units of what is left per degree of freedom.
const NEAR: f64 = 25.0;
/// Doublings of the steps of integration that are tried.
const DOUBLINGS: usize = 6;
/// Rounds in which the noise is estimated.
const ROUNDS: usize = 30;
/// How far starts are from each other: standard deviation of their logarithm.
const SPREAD: f64 = 1.5;
/// Fewest residuals of which a correlation is told.
const FEWEST: usize = 40;

/// What is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct SystemOptions {
    /// How many starts.
    pub starts: usize,
    /// Unknowns of which a profile is wanted.
    pub profiles: Vec<String>,
    /// A calibration before: what it says of unknowns of the same names.
    pub prior: Option<Before<String>>,
    /// Seed.
    pub seed: u64,
}
/// A model with its data.
struct Problem<'a> {
    numeric: Numeric<'a>,
    data: &'a Read,
    /// Filter states that are estimated.
    free: Vec<usize>,
    /// By output: the noise of the model's file, or as estimated; what a record says comes first.
    noise: Vec<f64>,
    /// Longest step of integration.
    longest: f64,
    /// Rows and values of what was known before of the free unknowns, with unit errors.
    known: (DMatrix<f64>, DVector<f64>),
    /// Hears of every evaluation; where it says no, iterations end.
    going: &'a dyn Fn(Going<'_>) -> bool,
    /// How many there were.
    passes: usize,
    /// Whether it said no.
    stopped: bool,
}

/// Rows of the model at some unknowns: a row of derivatives by the free unknowns, what is left, and sigma.
struct At {
    rows: DMatrix<f64>,
    left: DVector<f64>,
    sigmas: Vec<f64>,
    /// Row of the data and output.
    keys: Vec<(usize, usize)>,
    /// The same of what was known before, with unit errors.
    known: (DMatrix<f64>, DVector<f64>),
}

impl At {
    /// The sum of squares in sigma.
    fn cost(&self) -> f64 {
        self.cost_by(&self.sigmas)
    }

    /// The same with other sigmas: those of errors of inputs are what they are at the unknowns of the moment.
    fn cost_by(&self, sigmas: &[f64]) -> f64 {
        let measured: f64 = self.left.iter().zip(sigmas).map(|(e, s)| (e / s).powi(2)).sum();
        measured + self.known.1.norm_squared()
    }
}

impl Problem<'_> {
    /// All filter states of free values `x`, known starts from the others.
    fn all(&self, base: &DVector<f64>, x: &DVector<f64>) -> DVector<f64> {
        let mut out = base.clone();
        self.free.iter().zip(x.iter()).for_each(|(&i, v)| out[i] = *v);
        self.numeric.set_known_starts(&mut out);
        out
    }

    /// The derivatives of all filter states at the start by the free ones.
    fn of_free(&self, base: &DVector<f64>, x: &DVector<f64>) -> DMatrix<f64> {
        let n = base.len();
        let mut out = DMatrix::zeros(n, self.free.len());
        for j in 0..self.free.len() {
            let h = 1e-6 * x[j].abs().max(1e-6);
            let at = |sign: f64| {
                let mut moved = x.clone();
                moved[j] += sign * h;
                self.all(base, &moved)
            };
            out.set_column(j, &((at(1.0) - at(-1.0)) / (2.0 * h)));
            out[(self.free[j], j)] = 1.0;
        }
        out
    }

    /// The model at free values `x`, in steps `1/finer` as long.
    fn at(&mut self, base: &DVector<f64>, x: &DVector<f64>, finer: usize) -> Result<At, EkfError> {
        self.passes += 1;
        self.stopped |= !(self.going)(Going::Passes(self.passes));
        let start = self.all(base, x);
        let to_start = self.of_free(base, x);
        let segments = self.numeric.segments();
        let mut out = At {
            rows: DMatrix::zeros(0, 0),
            left: DVector::zeros(0),
            sigmas: Vec::new(),
            keys: Vec::new(),
            known: (self.known.0.clone(), &self.known.1 - &self.known.0 * x),
        };
        let (mut rows, mut left): (Vec<RowDVector<f64>>, Vec<f64>) = (Vec::new(), Vec::new());
        let data = self.data;
        let ones = vec![1.0; self.noise.len()];
        let mut now = (usize::MAX, 0.0, start.clone(), to_start.clone());
        for (k, row) in data.rows.iter().enumerate() {
            if now.0 != row.run {
                now = (row.run, 0.0, start.clone(), to_start.clone());
            }
            let part = row.experiment * segments;
            // what was held until here, then what is held from here on
            if row.t > now.1 {
                let process = self.numeric.process(part);
                let steps = ((row.t - now.1) / self.longest).ceil().max(1.0) as usize * finer;
                let next = runge_kutta(&process, now.1, &now.2, row.t - now.1, steps)?;
                now = (row.run, row.t, next.x, next.phi * now.3);
            }
            for (&input, (value, _)) in data.inputs.iter().zip(&row.inputs) {
                self.numeric.hold(input, *value);
            }
            if row.outputs.iter().all(Option::is_none) {
                continue;
            }
            let h = self.numeric.measurement(part, &ones).h(row.t, &now.2);
            let jacobian = Measurement::jacobian(&self.numeric.measurement(part, &ones), row.t, &now.2);
            let by_inputs = self.by_inputs(part, row, &now.2, &ones);
            for (j, measured) in row.outputs.iter().enumerate() {
                let Some(measured) = measured else { continue };
                let own = row.sigmas[j].unwrap_or(self.noise[j]);
                out.sigmas.push((own * own + by_inputs[j]).sqrt());
                rows.push(jacobian.row(j) * &now.3);
                left.push(measured - h[j]);
                out.keys.push((k, j));
            }
        }
        let n = self.free.len();
        out.rows = DMatrix::from_fn(rows.len(), n, |i, j| rows[i][j]);
        out.left = DVector::from_vec(left);
        let bad = out.left.iter().chain(out.rows.iter()).find(|x| !x.is_finite());
        match bad {
            Some(&value) => Err(EkfError::NotFinite { what: "the outputs", value, row: 0, column: 0 }),
            None => Ok(out),
        }
    }

    /// The variance that errors of the inputs of a row make of every output.
    fn by_inputs(&mut self, part: usize, row: &Data, x: &DVector<f64>, ones: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; ones.len()];
        for (&input, &(value, sigma)) in self.data.inputs.iter().zip(&row.inputs) {
            if sigma == 0.0 {
                continue;
            }
            let mut at = |by: f64| {
                self.numeric.hold(input, value + by);
                self.numeric.measurement(part, ones).h(row.t, x)
            };
            let half = (at(sigma) - at(-sigma)) / 2.0;
            self.numeric.hold(input, value);
            out.iter_mut().zip(half.iter()).for_each(|(v, h)| *v += h * h);
        }
        out
    }
}

/// How large an unknown is, for a pull.
fn size(x: f64) -> f64 {
    x.abs().max(1e-3)
}

/// The step from `at`, pulled by `pull` per size of an unknown.
fn step(at: &At, x: &DVector<f64>, pull: f64) -> Result<Solution, EkfError> {
    let n = x.len();
    let mut rows = Rows::new(n);
    let weights = DVector::from_iterator(at.sigmas.len(), at.sigmas.iter().map(|s| 1.0 / s));
    let whitened = DMatrix::from_fn(at.rows.nrows(), n, |i, j| at.rows[(i, j)] * weights[i]);
    rows.add(&whitened, &at.left.component_mul(&weights));
    rows.add(&at.known.0, &at.known.1);
    let pulls = DVector::from_iterator(n, x.iter().map(|v| pull / size(*v)));
    rows.add(&DMatrix::from_diagonal(&pulls), &DVector::zeros(n));
    rows.solve()
}

/// Where an iteration ended.
#[derive(Debug, Clone)]
struct Settled {
    x: DVector<f64>,
    cost: f64,
    converged: bool,
}

/// Levenberg and Marquardt from `x`; unknowns with `fixed` stay.
fn settle(
    problem: &mut Problem<'_>,
    base: &DVector<f64>,
    mut x: DVector<f64>,
    finer: usize,
    fixed: Option<usize>,
) -> Result<Settled, EkfError> {
    let freeze = |at: &mut At| {
        if let Some(j) = fixed {
            at.rows.column_mut(j).fill(0.0);
            at.known.0.column_mut(j).fill(0.0);
        }
    };
    let mut at = problem.at(base, &x, finer)?;
    freeze(&mut at);
    let mut cost = at.cost();
    // a pull as strong as the data say little at first
    let mut pull = 1e-2 * (cost.max(1.0)).sqrt();
    let mut converged = false;
    for _ in 0..PASSES {
        if problem.stopped {
            break;
        }
        let solution = step(&at, &x, pull)?;
        let moved = &x + &solution.x;
        let next = problem.at(base, &moved, finer).ok();
        let next = next.filter(|n| n.cost_by(&at.sigmas) <= cost * (1.0 + 1e-12));
        let scale = (cost / at.sigmas.len() as f64).max(1.0).sqrt();
        // how far it would go without the pull
        let weak = step(&at, &x, 1.0 / WEAK)?;
        let left = determined_part(&at, &weak);
        if left <= SETTLED * scale {
            converged = true;
            break;
        }
        match next {
            Some(mut n) => {
                freeze(&mut n);
                (x, cost, at) = (moved, n.cost(), n);
                pull = (pull / 5.0).max(1.0 / WEAK);
            }
            None => {
                pull *= 4.0;
                if pull > 1e12 {
                    break;
                }
            }
        }
    }
    Ok(Settled { x, cost, converged })
}

/// How far a step moves the outputs, in sigma.
fn determined_part(at: &At, solution: &Solution) -> f64 {
    let moved = &at.rows * &solution.x;
    let measured: f64 = moved.iter().zip(&at.sigmas).map(|(m, s)| (m / s).powi(2)).sum();
    (measured + (&at.known.0 * &solution.x).norm_squared()).sqrt()
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
    if !model.constraints.is_empty() {
        return Err(SystemCalibrationError::NotYet { what: "constraints" });
    }
    if model.segments.len() > 1 {
        return Err(SystemCalibrationError::NotYet { what: "several segments" });
    }
    let compiled = model.compile()?;
    let data = read(record, model, going)?;
    let basis = Basis { record: data.name.clone(), digest: data.digest.clone() };
    let own = digest(model);
    let again = options.prior.as_ref().and_then(|b| Some((b, basis.among(&b.rests_on)?)));
    if let Some((_, other)) = again.filter(|(b, _)| b.of == own) {
        let other = format!("{}, which the calibration before rests on, of the same model", other.record);
        return Err(SystemCalibrationError::SameRecord { record: basis.record, other });
    }
    let numeric = Numeric::with_inputs(model, &compiled, &data.inputs)?;
    Calibrating::new(model, &compiled, numeric, &data, options, going)?.run()
}

/// The digest of a model: of what its verdicts depend on.
fn digest(model: &SystemModel) -> String {
    format!("{:016x}", model.random(0, "calibration").next_u64())
}

/// Rows and values of what a calibration before says of the unknowns `names`, with unit errors.
fn said_before(
    table: &CovarianceTable,
    names: &[&str],
) -> Result<(DMatrix<f64>, DVector<f64>), SystemCalibrationError> {
    let nothing = || SystemCalibrationError::Prior { found: table.names.join(", ") };
    let n = table.names.len();
    let shapes = table.estimates.len() == n && table.covariance.len() == n;
    if !shapes || table.covariance.iter().any(|row| row.len() != n) {
        return Err(nothing());
    }
    let place = |k: usize| names.iter().position(|name| *name == table.names[k]).map(|j| (k, j));
    let found: Vec<(usize, usize)> = (0..n).filter_map(place).collect();
    if found.is_empty() {
        return Err(nothing());
    }
    let m = found.len();
    let p = DMatrix::from_fn(m, m, |i, j| table.covariance[found[i].0][found[j].0]);
    let root = nalgebra::Cholesky::new(p).ok_or_else(nothing)?.l();
    let rows = DMatrix::from_fn(m, names.len(), |i, j| f64::from(u8::from(found[i].1 == j)));
    let values = DMatrix::from_fn(m, 1, |i, _| table.estimates[found[i].0]);
    let solve = |b: DMatrix<f64>| root.solve_lower_triangular(&b).ok_or_else(nothing);
    Ok((solve(rows)?, solve(values)?.column(0).into_owned()))
}

/// Everything on the way.
struct Calibrating<'a> {
    model: &'a SystemModel,
    compiled: &'a Compiled,
    data: &'a Read,
    options: &'a SystemOptions,
    problem: Problem<'a>,
    /// All filter states at the first start.
    base: DVector<f64>,
    /// Whether the noise of an output is estimated.
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
        let names: Vec<&str> = free.iter().map(|&i| numeric.names[i].as_str()).collect();
        let known = match &options.prior {
            Some(before) => said_before(&before.estimates, &names)?,
            None => (DMatrix::zeros(0, free.len()), DVector::zeros(0)),
        };
        let problem =
            Problem { numeric, data, free, noise, longest, known, going, passes: 0, stopped: false };
        Ok(Self { model, compiled, data, options, problem, base, estimated })
    }

    /// The starts: that of the file, then others about it.
    fn starts(&self) -> Vec<DVector<f64>> {
        let mut noise = Noise::new(self.options.seed, 18);
        let first: Vec<f64> = self.problem.free.iter().map(|&i| self.base[i]).collect();
        (0..self.options.starts.max(1))
            .map(|k| {
                let of = |x: &f64| match (k, *x == 0.0) {
                    (0, _) => *x,
                    (_, true) => noise.normal(),
                    (_, false) => x * (SPREAD * noise.normal()).exp(),
                };
                DVector::from_vec(first.iter().map(of).collect())
            })
            .collect()
    }

    fn run(mut self) -> Result<SystemCalibration, SystemCalibrationError> {
        let judged = judge_compiled(self.model, self.compiled, self.options.seed, None)?;
        let measured = self.data.rows.iter().flat_map(|r| &r.outputs).flatten().count();
        let starts = self.starts();
        let mut first_error = None;
        let mut ends: Vec<Settled> = Vec::new();
        for x in &starts {
            // what there is so far is the answer
            if self.problem.stopped && !ends.is_empty() {
                break;
            }
            match settle(&mut self.problem, &self.base, x.clone(), 1, None) {
                Ok(end) => ends.push(end),
                Err(e) => drop(first_error.get_or_insert(e)),
            }
        }
        ends.sort_by(|a, b| {
            (!a.converged, a.cost).partial_cmp(&(!b.converged, b.cost)).unwrap_or(std::cmp::Ordering::Equal)
        });
        let Some(best) = ends.first().cloned() else {
            let reason = first_error.unwrap_or(EkfError::Singular { column: 0 });
            return Err(SystemCalibrationError::Nowhere { starts: starts.len(), reason });
        };
        let nowhere = |reason| SystemCalibrationError::Nowhere { starts: starts.len(), reason };
        // steps of integration until finer ones change nothing that shows
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
            best = settle(&mut self.problem, &self.base, best.x, finer, None).map_err(nowhere)?;
        }
        // noise that nobody gave
        for _ in 0..ROUNDS {
            let at = self.problem.at(&self.base, &best.x, finer).map_err(nowhere)?;
            let factors = self.factors(&at, &best.x).map_err(nowhere)?;
            if factors.iter().all(|f| (f - 1.0).abs() < 1e-4) {
                break;
            }
            self.problem.noise.iter_mut().zip(&factors).for_each(|(s, f)| *s *= f);
            best = settle(&mut self.problem, &self.base, best.x, finer, None).map_err(nowhere)?;
        }
        let at = self.problem.at(&self.base, &best.x, finer).map_err(nowhere)?;
        let solution = step(&at, &best.x, 1.0 / WEAK).map_err(nowhere)?;
        let weaker = step(&at, &best.x, 0.1 / WEAK).map_err(nowhere)?;
        let names: Vec<String> =
            self.problem.free.iter().map(|&i| self.problem.numeric.names[i].clone()).collect();
        let verdict = |j: usize| {
            judged.verdict(self.model, &names[j]).or_else(|| judged.verdict(self.model, plain(&names[j])))
        };
        let determined: Vec<bool> = (0..names.len())
            .map(|j| {
                let observable = verdict(j).is_some_and(|v| v.status == Status::Observable);
                observable && weaker.sigma(&[(j, 1.0)]) <= DETERMINED * solution.sigma(&[(j, 1.0)])
            })
            .collect();
        let rank = rank(&solution, &best.x);
        let measured = measured + self.problem.known.1.len();
        if measured <= rank {
            return Err(SystemCalibrationError::TooFew { found: measured, unknowns: rank });
        }
        let degrees_of_freedom = measured - rank;
        let mean = at.cost() / degrees_of_freedom as f64;
        let rescale = mean.sqrt().max(1.0);
        let known = &self.problem.known.0;
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
                let v = verdict(j);
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
        let combinations = combinations.collect();
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
        let outputs = self.outputs(&residuals, &at, &solution);
        let all_estimated = self.estimated.iter().all(|e| *e);
        let band = chi_square_band(degrees_of_freedom as f64, 1.0, STRICT);
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
                o.whiteness_probability.filter(|p| p * (outputs.len() as f64) < 1.0 - STRICT)
            {
                findings.push(SystemFinding::Correlated { output: o.output.clone(), probability });
            }
        }
        let gate = chi_square_quantile(1.0, 1.0 - (1.0 - STRICT) / measured as f64).sqrt();
        for r in residuals.iter().filter(|r| r.normalised.abs() > gate * rescale) {
            let output = self.model.outputs[r.output].0.name.clone();
            findings.push(SystemFinding::Outlier { output, line: r.line, sigmas: r.normalised / rescale });
        }
        let (others, led) = self.others(&ends, &best, &determined, &solution, mean, finer);
        let profiles = self.profiles(&names, &best, &solution, finer)?;
        Ok(SystemCalibration {
            schema: SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            name: self.model.name.clone(),
            consistent: (!all_estimated || !findings.is_empty()).then_some(findings.is_empty()),
            findings,
            unknowns,
            combinations,
            covariance,
            chi_square: at.cost(),
            degrees_of_freedom,
            band,
            factor: mean.sqrt(),
            outputs,
            others,
            starts: (starts.len(), led),
            profiles,
            samples: self.data.samples,
            intervals: self.data.intervals,
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

    /// The records that the estimates rest on.
    fn rests_on(&self) -> Vec<Basis> {
        let own = Basis { record: self.data.name.clone(), digest: self.data.digest.clone() };
        let before = self.options.prior.iter().flat_map(|b| b.rests_on.iter());
        let before = before.filter(|b| own.among(std::slice::from_ref(b)).is_none());
        std::iter::once(own.clone()).chain(before.cloned()).collect()
    }

    /// Whether the calibration before rests on the same record.
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

    /// What the noise of every output is to be multiplied by: 1 where it is given.
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

    fn residuals(&self, at: &At, solution: &Solution) -> Vec<SystemResidual> {
        let of = |(i, &(k, output)): (usize, &(usize, usize))| {
            let row = &self.data.rows[k];
            let free = (1.0 - leverage(at, solution, i)).max(1e-9);
            SystemResidual {
                output,
                experiment: row.experiment,
                line: row.line,
                t: row.t,
                measured: row.outputs[output].unwrap_or(f64::NAN),
                residual: at.left[i],
                sigma: at.sigmas[i],
                normalised: at.left[i] / at.sigmas[i] / free.sqrt(),
            }
        };
        at.keys.iter().enumerate().map(of).collect()
    }

    fn outputs(&self, residuals: &[SystemResidual], at: &At, solution: &Solution) -> Vec<OutputFit> {
        let of = |j: usize| {
            let own: Vec<&SystemResidual> = residuals.iter().filter(|r| r.output == j).collect();
            let of_output = (0..at.keys.len()).filter(|&i| at.keys[i].1 == j);
            let (free, variance) = of_output.fold((0.0, 0.0), |(sum, variance), i| {
                let free = 1.0 - leverage(at, solution, i);
                (sum + free, variance + free * at.sigmas[i] * at.sigmas[i])
            });
            let chi: f64 = own.iter().map(|r| (r.residual / r.sigma).powi(2)).sum();
            let squares: f64 = own.iter().map(|r| r.residual * r.residual).sum();
            let series: Vec<f64> = own.iter().map(|r| r.normalised).collect();
            let lags = (series.len() / 4).min(20);
            let sigma = own.first().map(|r| r.sigma).filter(|s| own.iter().all(|r| r.sigma == *s));
            OutputFit {
                output: self.model.outputs[j].0.name.clone(),
                measurements: own.len(),
                sigma,
                estimated: self.estimated[j],
                chi_square: if free > 1e-9 { chi / free } else { 0.0 },
                rms: (squares / own.len().max(1) as f64).sqrt(),
                expected_rms: (f64::max(variance, 0.0) / own.len().max(1) as f64).sqrt(),
                whiteness_probability: (series.len() >= FEWEST)
                    .then(|| ljung_box(&autocorrelation(&series, lags), series.len())),
            }
        };
        (0..self.model.outputs.len()).map(of).collect()
    }

    /// Solutions apart from the best that fit nearly as well, and how many starts led to the best.
    fn others(
        &mut self,
        ends: &[Settled],
        best: &Settled,
        determined: &[bool],
        solution: &Solution,
        mean: f64,
        finer: usize,
    ) -> (Vec<OtherSolution>, usize) {
        let same = |a: &DVector<f64>, b: &DVector<f64>| {
            (0..a.len()).filter(|&j| determined[j]).all(|j| {
                (a[j] - b[j]).abs()
                    <= SAME * solution.sigma(&[(j, 1.0)]) * mean.sqrt().max(1.0) + 1e-9 * size(b[j])
            })
        };
        let (mut out, mut led): (Vec<OtherSolution>, usize) = (Vec::new(), 0);
        for end in ends.iter().filter(|e| e.converged) {
            // with the noise and the steps of the solution
            let Ok(end) = settle(&mut self.problem, &self.base, end.x.clone(), finer, None) else { continue };
            if !end.converged {
                continue;
            }
            if same(&end.x, &best.x) {
                led += 1;
                continue;
            }
            if end.cost > best.cost + NEAR * mean.max(1e-300) {
                continue;
            }
            let known = out.iter_mut().find(|o| same(&end.x, &DVector::from_column_slice(&o.values)));
            match known {
                Some(o) => o.starts += 1,
                None => out.push(OtherSolution {
                    chi_square: end.cost,
                    starts: 1,
                    values: end.x.iter().copied().collect(),
                }),
            }
        }
        out.sort_by(|a, b| a.chi_square.total_cmp(&b.chi_square));
        (out, led)
    }

    /// Profiles: an unknown at values about its estimate, all others following.
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
            // three sigma, or half of what nobody knows
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
            let flat = points.iter().all(|p| p.1.abs() < 0.01);
            out.push(Profile { name: name.clone(), points, flat });
        }
        Ok(out)
    }
}

/// The part of a measurement that follows it.
fn leverage(at: &At, solution: &Solution, i: usize) -> f64 {
    let row = at.rows.row(i) * &solution.inverse_root;
    (row.norm() / at.sigmas[i]).powi(2)
}

/// The number of combinations that the data determine: a pull is all there is of the others.
fn rank(solution: &Solution, x: &DVector<f64>) -> usize {
    // of unknowns in units of their size the root has singular values of the pull, or far larger ones
    let scaled = DMatrix::from_fn(x.len(), x.len(), |i, j| solution.root[(i, j)] * size(x[j]));
    let values = obsdeg_ekf::decomposition::singular_values(&scaled).map(|(v, _)| v).unwrap_or_default();
    values.iter().filter(|v| **v > 10.0 / WEAK).count()
}

/// The name without its experiment.
fn plain(name: &str) -> &str {
    name.split_once('@').map_or(name, |(n, _)| n)
}

/// A first noise of an output: a tenth of its standard deviation.
fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / n;
    let square = values.map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    if square > 0.0 { 0.1 * square.sqrt() } else { 0.1 * size(mean) }
}
