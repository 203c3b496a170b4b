//! Run of the extended Kalman filter on any system, against a truth from the same equations.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::degree::Status;
use obsdeg_core::model::settings::FilterKind;
use obsdeg_core::system::{
    Compiled, DigitsReport, Judgement, ModelError, StateStart, SystemModel, judge_compiled,
};
use obsdeg_ekf::integrate::runge_kutta;
use obsdeg_ekf::{CovarianceForm, EkfError, Filter, Measurement};
use obsdeg_exact::interrupt;
use schemars::JsonSchema;
use serde::Serialize;

use super::numeric::{FilterState, Numeric};
use crate::simulation::Traces;
use crate::simulation::answer::Outcome;
use crate::simulation::consistency::{Consistency, Outcomes};
use crate::simulation::record::Series;
use crate::simulation::truth::Noise;

/// Name and version of the JSON layout.
pub(crate) const SCHEMA: &str = "obsdeg.system-run/1";
/// Most samples of a run.
const MAX_SAMPLES: f64 = 1e6;
/// Number of Runge-Kutta steps between two samples.
const SUBSTEPS: usize = 4;
/// Standard deviation of a known start, relative to its value (absolute for zero): a covariance needs one.
const KNOWN: f64 = 1e-9;

/// Largest violation of a constraint by true values, relative to its terms.
const HELD: f64 = 1e-9;
/// Relative standard deviation along a direction that constraints determine: a factorisation needs a positive
/// one.
const SINGULAR: f64 = 1e-7;
/// Number of draws from the prior for the uncertainty of a constraint beyond its differential.
const DRAWS: usize = 64;
/// Relative sigma of a direction, by the unknowns' sigmas, below which errors of linearisation and rounding
/// dominate a run linearised at its estimates.
const RESOLUTION: f64 = 1e-6;

/// Simulated run of a system with an extended Kalman filter.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemRun {
    /// Layout of this answer: `obsdeg.system-run/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Name of the system, as in its file.
    pub name: String,
    /// Estimates of the unknowns at the end of the run.
    pub quantities: Vec<SystemEstimate>,
    /// Consistency of errors and innovations with the filter's covariances.
    pub consistency: Consistency,
    /// Time of the model at which the run begins, in its unit; 1 stands for a generic time. Null where
    /// neither the equations nor the known inputs hold the time.
    pub time: Option<f64>,
    /// Duration of every experiment, in the unit of `t` in the model.
    pub duration: f64,
    /// Time between two samples, in the unit of `t` in the model.
    pub step: f64,
    /// Standard deviation of the noise of a sample, by output, in its unit.
    pub noise: Vec<(String, f64)>,
    /// Names of the unknowns whose prior the file does not state, so that the program chose it: the size of
    /// the true value, and 1 where that is zero.
    pub priors_by_default: Vec<String>,
    /// Bound on the probability that a verdict is wrong; null for a model judged in real numbers.
    pub error_bound: Option<f64>,
    /// Margin of the rank decisions in real numbers; null for a model judged in prime fields.
    pub digits: Option<DigitsReport>,
    /// Seed of the noise and of the initial errors.
    pub seed: u64,
}

/// Estimate of one unknown at the end of the run.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemEstimate {
    /// Name of the unknown, as in the model.
    pub name: String,
    /// Unit of the unknown, as in the model file.
    pub unit: String,
    /// Verdict on the unknown; null for a state with a known initial value.
    pub status: Option<Status>,
    /// Observable degree; null if the unknown is not observable.
    pub degree: Option<usize>,
    /// True value of the unknown, in its unit.
    pub truth: f64,
    /// Estimate of the unknown, in its unit.
    pub estimate: f64,
    /// Estimate minus true value, in the unit of the unknown.
    pub error: f64,
    /// Standard deviation of the error by the filter, in the unit of the unknown.
    pub sigma: f64,
    /// Error over sigma, dimensionless; about -3 to 3 for a consistent filter.
    pub error_over_sigma: f64,
    /// Standard deviation at the start of the run, in the unit of the unknown.
    pub prior_sigma: f64,
    /// Outcome for the unknown; requirements do not exist here.
    pub outcome: Outcome,
}

impl SystemEstimate {
    /// True if by the exact verdict the outputs determine the quantity; false also where no order up to the
    /// bound does.
    pub fn is_determined(&self) -> bool {
        is_determined(self.status)
    }
}

/// True for a known start too, which is no unknown.
fn is_determined(status: Option<Status>) -> bool {
    status.is_none_or(|s| s == Status::Observable)
}

/// Reason why there is no run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RunError {
    /// Error of the model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The filter met a number that is not finite.
    #[error("the filter stopped after {time} of {duration}: {error}")]
    Filter {
        /// Time that the filter reached.
        time: f64,
        /// Duration of the run.
        duration: f64,
        /// Error of the filter.
        error: EkfError,
    },
}

fn missing(what: &str, message: &str) -> ModelError {
    ModelError { what: what.into(), message: message.into(), span: None }
}

/// Start of a state of the filter.
fn start<'a>(model: &'a SystemModel, state: &FilterState) -> &'a StateStart {
    match *state {
        FilterState::State { i, .. } => &model.states[i].start,
        _ => &StateStart::Unknown,
    }
}

/// Names of the unknowns whose prior the file does not state.
fn priors_by_default(model: &SystemModel, numeric: &Numeric<'_>) -> Vec<String> {
    let nominal = &model.simulation;
    let all = numeric.states.iter().zip(&numeric.names);
    let chosen = all.filter(|(state, name)| {
        matches!(start(model, state), StateStart::Unknown) && nominal.named(&nominal.priors, name).is_none()
    });
    chosen.map(|(_, name)| name.clone()).collect()
}

/// Values and priors by filter state.
fn starts(model: &SystemModel, numeric: &Numeric<'_>) -> Result<(DVector<f64>, Vec<f64>), ModelError> {
    let nominal = &model.simulation;
    let n = numeric.states.len();
    let (mut truth, mut sigmas) = (DVector::zeros(n), vec![1.0; n]);
    for (c, (state, name)) in numeric.states.iter().zip(&numeric.names).enumerate() {
        if !matches!(start(model, state), StateStart::Value(_)) {
            truth[c] = nominal.named(&nominal.values, name).ok_or_else(|| {
                missing(&format!("`{name}`"), "no true value; expected one under [simulation.values]")
            })?;
        }
    }
    numeric.set_known_starts(&mut truth);
    let (residuals, rows) = numeric.constraints(&truth);
    for (k, residual) in residuals.iter().enumerate() {
        let size: f64 = rows.row(k).iter().zip(truth.iter()).map(|(g, x)| (g * x).abs()).sum();
        if residual.is_nan() || residual.abs() > HELD * size.max(f64::MIN_POSITIVE) {
            let text = &model.constraints[k % model.constraints.len()].text;
            let message = format!(
                "the values under [simulation.values] miss it by {residual:.1e}; expected values that hold it"
            );
            return Err(missing(&format!("the constraint {text}"), &message));
        }
        if rows.row(k).iter().all(|g| *g == 0.0) {
            let text = &model.constraints[k % model.constraints.len()].text;
            let message = "its gradient vanishes at the values under [simulation.values], so that a filter \
                cannot hold it; \
                           expected values at which it does not";
            return Err(missing(&format!("the constraint {text}"), message));
        }
    }
    for (c, (state, name)) in numeric.states.iter().zip(&numeric.names).enumerate() {
        let size = if truth[c] == 0.0 { 1.0 } else { truth[c].abs() };
        sigmas[c] = match start(model, state) {
            StateStart::Unknown => nominal.named(&nominal.priors, name).unwrap_or(size),
            StateStart::Known | StateStart::Value(_) => KNOWN * size,
        };
    }
    Ok((truth, sigmas))
}

/// Numbers of a run.
#[derive(Debug, Clone)]
pub(super) struct RunNumbers<'a> {
    pub(super) numeric: Numeric<'a>,
    /// True states of the filter at the start, and the standard deviations of their first estimates.
    pub(super) truth: DVector<f64>,
    pub(super) prior: Vec<f64>,
    /// Standard deviations of the noise, by output.
    pub(super) sigmas: Vec<f64>,
    pub(super) duration: f64,
    pub(super) step: f64,
}

impl<'a> RunNumbers<'a> {
    pub(super) fn new(model: &SystemModel, compiled: &'a Compiled) -> Result<Self, ModelError> {
        let numeric = Numeric::new(model, compiled)?;
        let nominal = &model.simulation;
        let no = |what: &str| {
            missing(&format!("the {what} of the simulation"), "missing; expected one under [simulation]")
        };
        let noise =
            |name: &String| nominal.noise.get(name).copied().ok_or_else(|| no(&format!("noise of {name}")));
        let sigmas = model.outputs.iter().map(|o| noise(&o.0.name)).collect::<Result<_, _>>()?;
        let duration = nominal.duration.ok_or_else(|| no("duration"))?;
        let step = nominal.step.ok_or_else(|| no("step"))?;
        let (truth, prior) = starts(model, &numeric)?;
        Ok(Self { numeric, truth, prior, sigmas, duration, step })
    }
}

/// Initial error drawn from the prior under the constraints, and its covariance. Constraints are nonlinear:
/// their residuals along the tangent space, found by draws, are their uncertainties.
fn initial_error(
    numeric: &Numeric<'_>,
    truth: &DVector<f64>,
    prior: &[f64],
    noise: &mut Noise,
) -> (DVector<f64>, DMatrix<f64>) {
    let n = truth.len();
    let diagonal = DMatrix::from_diagonal(&DVector::from_iterator(n, prior.iter().map(|s| s * s)));
    let (residuals, rows) = numeric.constraints(truth);
    // gains of the constraints, one after the other, with the uncertainties `r`
    let condition = |r: &[f64]| {
        let (mut p, mut gains) = (diagonal.clone(), Vec::new());
        for (k, r) in r.iter().enumerate() {
            let g = rows.row(k).transpose();
            let pg = &p * &g;
            let s = g.dot(&pg) + r;
            // a redundant constraint determines nothing more
            if s > KNOWN * KNOWN * g.component_mul(&g).dot(&diagonal.diagonal()) {
                p -= &pg * pg.transpose() / s;
                gains.push((&pg / s, g));
            }
        }
        (p, gains)
    };
    let draw = |gains: &[(DVector<f64>, DVector<f64>)], noise: &mut Noise| {
        let mut e = DVector::from_iterator(n, (0..n).map(|c| prior[c] * noise.normal()));
        for (gain, g) in gains {
            e -= gain * g.dot(&e);
        }
        e
    };
    let (_, gains) = condition(&vec![0.0; residuals.len()]);
    let mut left = vec![0.0; residuals.len()];
    if !left.is_empty() {
        for _ in 0..DRAWS {
            let e = draw(&gains, noise);
            for (sum, r) in left.iter_mut().zip(numeric.constraints(&(truth + e)).0) {
                *sum += r * r / DRAWS as f64;
            }
        }
    }
    let (mut p, _) = condition(&left);
    if !left.is_empty() {
        p += &diagonal * (SINGULAR * SINGULAR);
    }
    (draw(&gains, noise), p)
}

/// Directions in which constraints leave the unknowns free, to first order; they move with the states, in
/// units of the priors.
struct Tangent {
    /// Orthonormal columns, n x k.
    basis: DMatrix<f64>,
    prior: DVector<f64>,
}

impl Tangent {
    /// Tangent space at the start; `None` for a model without constraints.
    fn new(numeric: &Numeric<'_>, truth: &DVector<f64>, prior: &[f64]) -> Option<Self> {
        let (_, rows) = numeric.constraints(truth);
        let prior = DVector::from_column_slice(prior);
        let mut basis = DMatrix::identity(prior.len(), prior.len());
        for row in rows.row_iter() {
            let row = row.transpose().component_mul(&prior);
            let free = basis.transpose() * &row;
            // a redundant constraint removes no direction
            if free.norm() > KNOWN * row.norm() {
                basis = complement(&basis, &free);
            }
        }
        (basis.ncols() < prior.len()).then_some(Self { basis, prior })
    }

    /// Moves the directions by a transition with the derivatives `phi`.
    fn carry(&mut self, phi: &DMatrix<f64>) {
        let n = self.prior.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| phi[(i, j)] * self.prior[j] / self.prior[i]);
        self.basis = (scaled * &self.basis).qr().q();
    }

    /// Columns that project an error in the units of the filter onto the free directions.
    fn columns(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.prior.len(), self.basis.ncols(), |i, j| self.basis[(i, j)] / self.prior[i])
    }
}

/// Orthonormal columns of the span of `basis` that are orthogonal to `basis * direction`: a reflection turns
/// the direction into the first axis, which is left out.
fn complement(basis: &DMatrix<f64>, direction: &DVector<f64>) -> DMatrix<f64> {
    let mut v = direction / direction.norm();
    v[0] += v[0].signum();
    let v = v.normalize();
    let reflected = basis - (basis * &v) * (v.transpose() * 2.0);
    reflected.columns(1, basis.ncols() - 1).into_owned()
}

/// Runs the filter of `model`: the truth starts at the values of its file, the estimate at an error drawn
/// from the prior, and `seed` sets the random numbers.
///
/// # Errors
/// [`RunError`].
pub fn simulate_system(model: &SystemModel, seed: u64) -> Result<(SystemRun, Traces), RunError> {
    let compiled = model.compile()?;
    let judged = judge_compiled(model, &compiled, seed, None)?;
    let numbers = RunNumbers::new(model, &compiled)?;
    let (segments, duration) = (numbers.numeric.segments(), numbers.duration);
    let parts = segments * numbers.numeric.experiments();
    let samples = (duration / numbers.step / segments as f64 - 1e-9).ceil().max(1.0);
    if samples * parts as f64 > MAX_SAMPLES {
        return Err(
            missing("the step of the simulation", "too short; expected at most 1000000 samples").into()
        );
    }
    let mut run = FilterRun::new(model, &numbers, samples, seed)?;
    for part in 0..parts {
        run.part(part)?;
    }
    let FilterRun { mut traces, filter, truth, tangent, whitened, dt, .. } = run;
    let estimates = estimates(model, &judged, &numbers.numeric, &traces, &numbers.prior);
    traces.determined = estimates.iter().map(SystemEstimate::is_determined).collect();
    let consistency = Consistency::of(Outcomes {
        whitened: &whitened,
        outputs: numbers.sigmas.len(),
        error: (filter.x() - &truth).as_slice().to_vec(),
        covariance: filter.covariance(),
        normalised: estimates.iter().map(|e| (e.name.as_str(), e.error_over_sigma)).collect(),
        free: tangent.map(|t| t.columns()),
        resolution: RESOLUTION,
    });
    Ok((
        SystemRun {
            schema: SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            name: model.name.clone(),
            quantities: estimates,
            consistency: consistency.map_err(stopped(duration, duration))?,
            time: compiled.uses_time().then(|| model.time.number()),
            duration,
            step: dt,
            noise: model
                .outputs
                .iter()
                .map(|o| o.0.name.clone())
                .zip(numbers.sigmas.iter().copied())
                .collect(),
            priors_by_default: priors_by_default(model, &numbers.numeric),
            error_bound: judged.error_bound(),
            digits: judged.digits(),
            seed,
        },
        traces,
    ))
}

/// Error of a filter at `time` of a run of `duration`.
fn stopped(time: f64, duration: f64) -> impl Fn(EkfError) -> RunError {
    move |error| RunError::Filter { time, duration, error }
}

/// Filter and truth along a run.
struct FilterRun<'a> {
    numbers: &'a RunNumbers<'a>,
    /// Number of samples of a part, and the time between two.
    samples: f64,
    dt: f64,
    truth: DVector<f64>,
    filter: Filter,
    tangent: Option<Tangent>,
    noise: Noise,
    traces: Traces,
    whitened: Vec<f64>,
}

impl<'a> FilterRun<'a> {
    /// Start of a run with `samples` samples in each part.
    fn new(
        model: &SystemModel,
        numbers: &'a RunNumbers<'a>,
        samples: f64,
        seed: u64,
    ) -> Result<Self, RunError> {
        let RunNumbers { numeric, truth, prior, duration, .. } = numbers;
        let mut noise = Noise::new(seed, 0);
        let (error, p0) = initial_error(numeric, truth, prior, &mut noise);
        let estimate = truth + error;
        let filter = Filter::new(estimate, &p0, CovarianceForm::Ud).map_err(stopped(0.0, *duration))?;
        let traces = Traces {
            names: numeric.names.clone(),
            units: numeric.states.iter().map(|s| unit(model, s)).collect(),
            scales: vec![1.0; truth.len()],
            series: vec![Series::default(); truth.len()],
            ..Traces::default()
        };
        let mut out = Self {
            numbers,
            samples,
            dt: duration / numeric.segments() as f64 / samples,
            truth: truth.clone(),
            filter,
            tangent: Tangent::new(numeric, truth, prior),
            noise,
            traces,
            whitened: Vec::new(),
        };
        out.record(0.0, 0);
        Ok(out)
    }

    /// Adds truth, estimate and sigmas at a time of the run to the traces.
    fn record(&mut self, time: f64, part: usize) {
        self.traces.time.push(time);
        self.traces.position.push(part);
        let own = self.filter.covariance().sigmas();
        for (c, s) in self.traces.series.iter_mut().enumerate() {
            s.truth.push(self.truth[c]);
            s.estimate.push(self.filter.x()[c]);
            s.sigma.push(own[c]);
        }
    }

    /// Jump into a part, which begins at `begin` of its experiment.
    fn jump(&mut self, part: usize, begin: f64) -> Result<(), RunError> {
        let RunNumbers { numeric, prior, duration, .. } = self.numbers;
        let (behind, jacobian) = numeric.carry(part, begin, &self.truth);
        let (x, phi) = numeric.carry(part, begin, self.filter.x());
        if behind != self.truth || x != *self.filter.x() {
            if let Some(tangent) = &mut self.tangent {
                tangent.carry(&jacobian);
            }
            self.truth = behind;
            // a jump that forgets a state leaves its variance: as good as known
            let p = &phi * self.filter.covariance().matrix() * phi.transpose();
            let floor = prior.iter().map(|s| (KNOWN * s).powi(2));
            let floor = DMatrix::from_diagonal(&DVector::from_iterator(prior.len(), floor));
            self.filter =
                Filter::new(x, &(p + floor), CovarianceForm::Ud).map_err(stopped(begin, *duration))?;
        }
        Ok(())
    }

    /// Runs the filter through a part. Every experiment has its own time.
    fn part(&mut self, part: usize) -> Result<(), RunError> {
        let RunNumbers { numeric, sigmas, duration, .. } = self.numbers;
        let (segments, dt) = (numeric.segments(), self.dt);
        let begin = (part % segments) as f64 * self.samples * dt;
        let before = (part / segments) as f64 * duration;
        self.jump(part, begin)?;
        let process = numeric.process(part);
        let measurement = numeric.measurement(part, sigmas);
        let stopped = |time: f64| stopped(time, *duration);
        for k in 0..self.samples as usize {
            interrupt::check();
            let t = begin + k as f64 * dt;
            let moved = runge_kutta(&process, t, &self.truth, dt, SUBSTEPS).map_err(stopped(t))?;
            self.truth = moved.x;
            if let Some(tangent) = &mut self.tangent {
                tangent.carry(&moved.phi);
            }
            self.filter.predict(&process, t, dt, SUBSTEPS).map_err(stopped(t))?;
            let mut z = measurement.h(t + dt, &self.truth);
            for (z, sigma) in z.iter_mut().zip(sigmas) {
                *z += sigma * self.noise.normal();
            }
            let updated = self.filter.update(&measurement, t + dt, &z).map_err(stopped(t + dt))?;
            self.whitened.extend(updated.whitened);
            self.record(before + t + dt, part);
        }
        Ok(())
    }
}

fn unit(model: &SystemModel, state: &FilterState) -> String {
    match *state {
        FilterState::State { i, .. } => model.states[i].named.unit.clone(),
        FilterState::Parameter(i) => model.parameters[i].unit.clone(),
        FilterState::Input { i, derivative: 0, .. } => model.unknown_inputs[i].0.unit.clone(),
        FilterState::Input { .. } => String::new(),
    }
}

fn estimates(
    model: &SystemModel,
    judged: &Judgement,
    numeric: &Numeric<'_>,
    traces: &Traces,
    stated: &[f64],
) -> Vec<SystemEstimate> {
    let of = |(c, name): (usize, &String)| {
        let series = &traces.series[c];
        let last = |v: &Vec<f64>| v.last().copied().unwrap_or(f64::NAN);
        let (truth, estimate, sigma) = (last(&series.truth), last(&series.estimate), last(&series.sigma));
        let verdict = judged.verdict(model, name);
        let prior_sigma = series.sigma.first().copied().unwrap_or(f64::NAN);
        let error = estimate - truth;
        let error_over_sigma = if error == 0.0 { 0.0 } else { error / sigma };
        let size = series.truth.first().map_or(1.0, |x| if *x == 0.0 { 1.0 } else { x.abs() });
        let status = verdict.map(|v| v.status);
        // a run may determine a quantity that no derivative up to the bound does
        let determined = is_determined(status) || status == Some(Status::NotSeen);
        SystemEstimate {
            name: name.clone(),
            unit: unit(model, &numeric.states[c]),
            status,
            degree: verdict.and_then(|v| v.degree),
            truth,
            estimate,
            error,
            sigma,
            error_over_sigma,
            prior_sigma,
            outcome: Outcome::of(
                determined,
                FilterKind::Linear,
                error_over_sigma,
                // a known start is no prior of the end; constraints make the prior of the start smaller, by
                // what no file states
                [if stated[c] <= 100.0 * KNOWN * size { f64::INFINITY } else { stated[c] }, sigma],
                None,
            ),
        }
    };
    numeric.names.iter().enumerate().map(of).collect()
}
