//! One run: truth, filter, and everything that is plotted of it.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::settings::Truth;
use obsdeg_ekf::linear::{covariance_pass, state_pass};
use obsdeg_ekf::{Covariance, Form};

use super::SimulationError;
use super::conditions::{Conditions, ESTIMATE, PRIOR, TRUE_VALUE, resolve, shown_unit, si_per_shown};
use super::plan::Plan;
use super::state::PlatformState;
use super::truth::{Noise, TruthModel, check_drifts};
use crate::prediction::Prediction;

/// Where a run starts, in SI units (shape n each: the unknowns, then the biases).
#[derive(Debug, Clone, PartialEq)]
pub struct RunStart {
    /// The true unknowns.
    pub truth: Vec<f64>,
    /// The initial estimate.
    pub estimate: Vec<f64>,
    /// Its standard deviations.
    pub sigma: Vec<f64>,
}

impl RunStart {
    /// What the conditions say for the unknowns of `plan`.
    ///
    /// # Errors
    /// [`SimulationError`] for unknown names, and exact truth without coefficients.
    pub fn new(plan: &Plan, conditions: &Conditions) -> Result<Self, SimulationError> {
        if conditions.truth == Truth::Exact && !plan.has_coefficients() {
            return Err(SimulationError::ExactDrift);
        }
        let p = &plan.platform;
        let si = |values: Vec<f64>, scaled: bool| -> Vec<f64> {
            let units = p.units().iter();
            let scale = |u: &str| if scaled && u != "rad" { conditions.drift_scale } else { 1.0 };
            units.zip(values).map(|(u, v)| v * si_per_shown(u) * scale(u)).collect()
        };
        let sigma = resolve(PRIOR, p, &conditions.priors, 1.0)?;
        let mut out = Self {
            truth: si(resolve(TRUE_VALUE, p, &conditions.values, 0.0)?, true),
            estimate: si(resolve(ESTIMATE, p, &conditions.estimates, 0.0)?, false),
            sigma: si(sigma, true),
        };
        let biases = plan.bias_sigmas();
        out.truth.extend(biases.iter().map(|_| 0.0));
        out.estimate.extend(biases.iter().map(|_| 0.0));
        out.sigma.extend(biases);
        Ok(out)
    }

    /// The initial covariance.
    ///
    /// # Errors
    /// [`SimulationError::Filter`].
    pub fn covariance(&self, form: Form) -> Result<Covariance, SimulationError> {
        Ok(Covariance::new("P0", &self.variances(), form)?)
    }

    /// The initial variances (n x n, diagonal).
    pub(super) fn variances(&self) -> DMatrix<f64> {
        DMatrix::from_diagonal(&DVector::from_iterator(self.sigma.len(), self.sigma.iter().map(|s| s * s)))
    }

    /// The initial estimate as the state of a filter that carries attitudes.
    pub(super) fn state(&self, plan: &Plan) -> PlatformState {
        PlatformState::of_unknowns(&self.estimate, plan.constants())
    }
}

/// One unknown or combination over time, in SI units, from t = 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// The truth.
    pub truth: Vec<f64>,
    /// The estimate.
    pub estimate: Vec<f64>,
    /// Its standard deviation.
    pub sigma: Vec<f64>,
}

/// What is plotted of a run, sample by sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Traces {
    /// Names of the series: unknowns, then combinations.
    pub names: Vec<String>,
    /// The units in which they are shown.
    pub units: Vec<String>,
    /// What a series is divided by to be shown.
    pub scales: Vec<f64>,
    /// Whether samples determine what a series shows; otherwise it is known from the prior only.
    pub determined: Vec<bool>,
    /// The unit of the time; empty when none is given.
    pub time_unit: String,
    /// The times, from 0.
    pub time: Vec<f64>,
    /// The position or segment of every sample.
    pub position: Vec<usize>,
    /// One per name.
    pub series: Vec<Series>,
}

/// A run, sample by sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Truth, estimate and sigma of everything.
    pub traces: Traces,
    /// Whitened innovations, one per output and sampled step.
    pub whitened: Vec<f64>,
    /// The covariance at the end.
    pub last_covariance: Covariance,
    /// Estimate minus truth of all its states at the end.
    pub last_error: Vec<f64>,
    /// Largest `|psi|`, in rad.
    pub largest_psi: f64,
}

/// Runs the filter of `plan` against one truth; its biases are drawn.
///
/// # Errors
/// [`SimulationError::Filter`] when the prior is refused, [`SimulationError::TooManySteps`] for an exact truth that
/// turns too fast, [`SimulationError::Unresolvable`] when something is not finite.
pub fn run(
    plan: &Plan,
    conditions: &Conditions,
    start: &RunStart,
    prediction: &Prediction,
    seed: u64,
) -> Result<Record, SimulationError> {
    let n = plan.unknowns();
    let first = n - plan.platform.coefficients();
    check_drifts(plan, conditions, start.truth[first..n].iter().map(|d| d.abs()).sum())?;
    let combinations: Vec<&[(usize, f64)]> = prediction.combinations.iter().map(|c| &c.terms[..]).collect();
    let mut traces = Traces {
        names: plan.platform.names().to_vec(),
        time_unit: "s".into(),
        time: vec![0.0],
        position: vec![0],
        series: vec![Series::default(); n + combinations.len()],
        ..Traces::default()
    };
    traces.names.extend(prediction.combinations.iter().map(|c| c.expression.clone()));
    traces.determined.extend(prediction.unknowns.iter().map(|u| u.determined_at_end));
    traces.determined.extend(prediction.combinations.iter().map(|c| c.determined_at_end));
    let own_units = plan.platform.units();
    let units = own_units.iter().chain(prediction.combinations.iter().map(|c| &own_units[c.terms[0].0]));
    for unit in units {
        traces.units.push(shown_unit(unit).into());
        traces.scales.push(si_per_shown(unit));
    }
    for segment in &plan.segments {
        for i in 1..=segment.steps {
            traces.time.push(segment.start_s + segment.dt * i as f64);
            traces.position.push(segment.position);
        }
    }
    let mut record = Record {
        traces,
        whitened: Vec::new(),
        last_covariance: start.covariance(Form::Ud)?,
        last_error: Vec::new(),
        largest_psi: 0.0,
    };
    let value = |x: &[f64], i: usize| match i.checked_sub(n) {
        None => x[i],
        Some(c) => combinations[c].iter().map(|&(j, k)| k * x[j]).sum(),
    };
    let sigmas = |series: &mut [Series], p: &Covariance| {
        let own = p.sigmas();
        for (i, s) in series.iter_mut().enumerate() {
            s.sigma.push(match i.checked_sub(n) {
                Some(c) => p.variance(combinations[c]).map_or(f64::NAN, |v| v.max(0.0).sqrt()),
                None => own[i],
            });
        }
    };
    let prior = record.last_covariance.clone();
    sigmas(&mut record.traces.series, &prior);
    let (series, last) = (&mut record.traces.series, &mut record.last_covariance);
    let total = record.traces.time.len() - 1;
    let gains = covariance_pass(&plan.stages, prior, |step, p| {
        sigmas(series, p);
        if step + 1 == total {
            last.clone_from(p);
        }
    })?;

    let mut noise = Noise::new(seed, 0);
    let mut true_start = start.truth.clone();
    for (x, sigma) in true_start.iter_mut().zip(&start.sigma).skip(n) {
        *x = sigma * noise.normal();
    }
    let mut truth = TruthModel::new(plan, conditions, true_start);
    let mut x = start.estimate.clone();
    for (i, s) in record.traces.series.iter_mut().enumerate() {
        s.truth.push(value(truth.x(), i));
        s.estimate.push(value(&x, i));
    }
    let first_step = first_steps(plan);
    let mut truths: Vec<Vec<f64>> = vec![Vec::with_capacity(total); record.traces.series.len()];
    let (series, whitened) = (&mut record.traces.series, &mut record.whitened);
    state_pass(
        &plan.stages,
        &gains,
        &mut x,
        |step, segment, z| {
            truth.step(segment, step - first_step[segment], &mut noise, z);
            for (i, t) in truths.iter_mut().enumerate() {
                t.push(value(truth.x(), i));
            }
        },
        |_, x, innovations| {
            for (i, s) in series.iter_mut().enumerate() {
                s.estimate.push(value(x, i));
            }
            whitened.extend_from_slice(innovations);
        },
    )?;
    for (s, t) in record.traces.series.iter_mut().zip(truths) {
        s.truth.extend(t);
    }
    record.largest_psi = truth.largest_psi;
    record.last_error = x.iter().zip(truth.x()).map(|(a, b)| a - b).collect();
    let finite = |list: &[f64]| list.iter().all(|x| x.is_finite());
    let ended = |s: &Series| finite(&s.truth) && finite(&s.estimate) && finite(&s.sigma);
    if !(finite(&record.whitened) && finite(&record.last_error) && record.traces.series.iter().all(ended)) {
        let what = "the run of the filter ends in numbers that are none".into();
        return Err(SimulationError::Unresolvable { what });
    }
    Ok(record)
}

/// The number of the first step of every segment.
pub(crate) fn first_steps(plan: &Plan) -> Vec<usize> {
    let starts = plan.segments.iter().scan(0, |next, s| {
        let first = *next;
        *next += s.steps;
        Some(first)
    });
    starts.collect()
}
