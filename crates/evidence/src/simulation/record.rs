//! One run: truth, filter, and the time series for plots.

use obsdeg_core::model::settings::{FilterKind, Truth};
use obsdeg_ekf::linear::{covariance_pass, state_pass};
use obsdeg_ekf::{Covariance, CovarianceForm, Manifold, Update};

use super::answer::{FilterReason, FilterReport};
use super::conditions::{Conditions, shown_unit, si_per_shown};
use super::error::SimulationError;
use super::extended::{ExtendedFilter, FilterResult};
use super::iterated::{MAX_ITERATED_STEPS, iterated};
use super::noise::Noise;
use super::plan::Plan;
pub(crate) use super::start::RunStart;
use super::state::PlatformState;
use super::truth::{TruthModel, check_drifts};
use super::validity::Validity;
use crate::prediction::Prediction;

/// Unknown or combination over time, in SI units, from t = 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// True values.
    pub truth: Vec<f64>,
    /// Estimates.
    pub estimate: Vec<f64>,
    /// Standard deviations of the estimates.
    pub sigma: Vec<f64>,
}

/// Time series of a run for plots, sample by sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Traces {
    /// Names of the series: unknowns, then combinations.
    pub names: Vec<String>,
    /// Units in which the series are shown.
    pub units: Vec<String>,
    /// Divisors from SI to the shown units, by series.
    pub scales: Vec<f64>,
    /// True for each series that samples determine; false if only the prior does.
    pub determined: Vec<bool>,
    /// Unit of the time; empty when none is given.
    pub time_unit: String,
    /// Times, from 0, in the unit of the time.
    pub time: Vec<f64>,
    /// Index of the position or segment, by sample.
    pub position: Vec<usize>,
    /// Series, by name.
    pub series: Vec<Series>,
    /// Series of a linear filter on the same measurements, where another filter is shown.
    pub linear: Option<Vec<Series>>,
}

/// Run, sample by sample.
#[derive(Debug, Clone, PartialEq)]
pub struct RunRecord {
    /// Truth, estimate and sigma of all quantities.
    pub traces: Traces,
    /// Whitened innovations, one per output and sampled step.
    pub whitened: Vec<f64>,
    /// Covariance at the end.
    pub last_covariance: Covariance,
    /// Estimate minus truth of all states of the filter at the end.
    pub last_error: Vec<f64>,
    /// Filter of the run.
    pub filter: FilterReport,
    /// Validity of the small-angle model for the truth.
    pub validity: Validity,
}

/// Quantities that a run records: unknowns, then combinations, as functionals of the unknowns.
struct RecordedQuantities<'a> {
    /// Number of unknowns.
    unknowns: usize,
    combinations: Vec<&'a [(usize, f64)]>,
}

impl RecordedQuantities<'_> {
    fn len(&self) -> usize {
        self.unknowns + self.combinations.len()
    }

    /// Values of all quantities at the state `x`.
    fn values<'b>(&'b self, x: &'b [f64]) -> impl Iterator<Item = f64> + 'b {
        let combination = |c: &&[(usize, f64)]| c.iter().map(|&(j, k)| k * x[j]).sum();
        x[..self.unknowns].iter().copied().chain(self.combinations.iter().map(combination))
    }

    /// Standard deviations of all quantities. `local` turns a functional of the unknowns into one of the
    /// local coordinates of the covariance, or returns `None` where both are the same.
    fn sigmas(
        &self,
        p: &Covariance,
        local: impl Fn(usize, &[(usize, f64)]) -> Option<Vec<(usize, f64)>>,
    ) -> Vec<f64> {
        let own = p.sigmas();
        let of = |c: &[(usize, f64)]| p.variance(c).map_or(f64::NAN, |v| v.max(0.0).sqrt());
        (0..self.len())
            .map(|i| match i.checked_sub(self.unknowns) {
                None => local(i, &[(i, 1.0)]).map_or(own[i], |c| of(&c)),
                Some(c) => {
                    let terms = self.combinations[c];
                    local(i, terms).map_or_else(|| of(terms), |c| of(&c))
                }
            })
            .collect()
    }
}

/// Truth of a run and its measurements.
pub(crate) struct SampledTruth {
    /// True values by recorded quantity, from t = 0.
    truth: Vec<Vec<f64>>,
    /// Measurements, one per step and component; zero where none is taken.
    pub(crate) z: Vec<f64>,
    /// True states at the end.
    pub(crate) end: Vec<f64>,
    /// Largest `|psi|`, in rad.
    pub(crate) largest_psi: f64,
}

/// Samples the truth that starts from the states `x` over the whole of `plan`; `record` gets the states from
/// t = 0.
pub(crate) fn sample(
    truth: &mut TruthModel<'_>,
    plan: &Plan,
    noise: &mut Noise,
    z: &mut Vec<f64>,
    mut record: impl FnMut(&[f64]),
) {
    z.clear();
    record(truth.x());
    let mut now = vec![0.0; plan.components.len()];
    for (segment, s) in plan.segments.iter().enumerate() {
        let seen = plan.stages[segment].outputs.len();
        now.fill(0.0);
        for step in 0..s.steps {
            truth.step(segment, step, noise, &mut now[..seen]);
            z.extend_from_slice(&now);
            record(truth.x());
        }
    }
}

fn sampled(
    plan: &Plan,
    conditions: &Conditions,
    start: &RunStart,
    recorded: &RecordedQuantities<'_>,
    seed: u64,
) -> Result<SampledTruth, SimulationError> {
    let n = plan.unknowns();
    let first = n - plan.platform.coefficients();
    check_drifts(plan, conditions, plan.drift_bound(&start.truth[first..n]))?;
    let mut noise = Noise::new(seed, 0);
    let mut from = start.truth.clone();
    for (x, sigma) in from.iter_mut().zip(&start.sigma).skip(n) {
        *x = sigma * noise.normal();
    }
    let mut truth = TruthModel::new(plan, conditions, from);
    let (mut values, mut z) = (vec![Vec::new(); recorded.len()], Vec::new());
    sample(&mut truth, plan, &mut noise, &mut z, |x| {
        values.iter_mut().zip(recorded.values(x)).for_each(|(v, x)| v.push(x));
    });
    Ok(SampledTruth { truth: values, z, end: truth.x().to_vec(), largest_psi: truth.largest_psi })
}

/// Largest `|psi|` of the run of `seed`, in rad.
///
/// # Errors
/// See [`run`].
pub(crate) fn largest_psi(
    plan: &Plan,
    conditions: &Conditions,
    start: &RunStart,
    seed: u64,
) -> Result<f64, SimulationError> {
    let nothing = RecordedQuantities { unknowns: 0, combinations: Vec::new() };
    Ok(sampled(plan, conditions, start, &nothing, seed)?.largest_psi)
}

/// Results of a filter on some measurements.
struct FilterSeries {
    /// Estimates by quantity, from t = 0.
    estimate: Vec<Vec<f64>>,
    /// Standard deviations by quantity, from t = 0.
    sigma: Vec<Vec<f64>>,
    whitened: Vec<f64>,
    covariance: Covariance,
    /// Estimate minus truth at the end, in the coordinates of the covariance.
    error: Vec<f64>,
    /// Number of linearisations, and true if they converged.
    passes: (usize, bool),
}

/// Results of the linear filter: its gains first, then its state.
fn linear(
    plan: &Plan,
    start: &RunStart,
    sampled: &SampledTruth,
    recorded: &RecordedQuantities<'_>,
) -> Result<FilterSeries, SimulationError> {
    let prior = start.covariance(CovarianceForm::Ud)?;
    let mut sigma = vec![Vec::new(); recorded.len()];
    let mut push = |p: &Covariance| {
        let now = recorded.sigmas(p, |_, _| None);
        sigma.iter_mut().zip(now).for_each(|(s, now)| s.push(now));
    };
    push(&prior);
    let mut covariance = prior.clone();
    let total = plan.segments.iter().map(|s| s.steps).sum::<usize>();
    let gains = covariance_pass(&plan.stages, prior, |step, p| {
        push(p);
        if step + 1 == total {
            covariance.clone_from(p);
        }
    })?;
    let mut x = start.estimate.clone();
    let (mut estimate, mut whitened) = (vec![Vec::new(); recorded.len()], Vec::new());
    let mut push = |x: &[f64]| estimate.iter_mut().zip(recorded.values(x)).for_each(|(e, x)| e.push(x));
    push(&x);
    let m = plan.components.len();
    let measure =
        |step: usize, _: usize, z: &mut [f64]| z.copy_from_slice(&sampled.z[step * m..step * m + z.len()]);
    state_pass(&plan.stages, &gains, &mut x, measure, |_, x, innovations| {
        push(x);
        whitened.extend_from_slice(innovations);
    })?;
    let error = x.iter().zip(&sampled.end).map(|(a, b)| a - b).collect();
    Ok(FilterSeries { estimate, sigma, whitened, covariance, error, passes: (1, true) })
}

/// Results of the extended filter, in one pass or iterated.
fn extended(
    plan: &Plan,
    conditions: &Conditions,
    start: &RunStart,
    sampled: &SampledTruth,
    recorded: &RecordedQuantities<'_>,
    again: bool,
) -> Result<FilterSeries, SimulationError> {
    let filter = ExtendedFilter::new(plan, conditions, Update::default())?;
    let (mut estimate, mut sigma) = (vec![Vec::new(); recorded.len()], vec![Vec::new(); recorded.len()]);
    let mut push = |state: &PlatformState, p: &Covariance| {
        let x = state.unknowns();
        estimate.iter_mut().zip(recorded.values(&x)).for_each(|(e, x)| e.push(x));
        let psi = plan.states() - plan.constants();
        // coefficients are their own local coordinates
        let local = |i: usize, c: &[(usize, f64)]| (i < psi || c.len() > 1).then(|| state.functional(c));
        sigma.iter_mut().zip(recorded.sigmas(p, local)).for_each(|(s, now)| s.push(now));
    };
    push(&start.state(plan), &start.covariance(CovarianceForm::Ud)?);
    let mut whitened = Vec::new();
    let on_step = |_: usize, x: &PlatformState, p: &Covariance, innovations: &[f64]| {
        push(x, p);
        whitened.extend_from_slice(innovations);
    };
    let ended = if again {
        iterated(&filter, start, &sampled.z, on_step)?
    } else {
        filter.run(start, &sampled.z, on_step)?
    };
    let truth = PlatformState::of_unknowns(&sampled.end, plan.constants());
    let error = truth.local(&ended.x).iter().map(|x| -x).collect();
    let FilterResult { covariance, passes, converged, .. } = ended;
    Ok(FilterSeries { estimate, sigma, whitened, covariance, error, passes: (passes, converged) })
}

/// Traces of a run with names, units and times, without series.
fn empty_traces(plan: &Plan, prediction: &Prediction) -> Traces {
    let mut traces = Traces {
        names: plan.platform.names().to_vec(),
        time_unit: "s".into(),
        time: vec![0.0],
        position: vec![0],
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
    traces
}

/// Checks that all numbers of a run are finite.
fn check_finite(sampled: &SampledTruth, filtered: &FilterSeries) -> Result<(), SimulationError> {
    let finite = |list: &[f64]| list.iter().all(|x| x.is_finite());
    let all = |lists: &[Vec<f64>]| lists.iter().all(|l| finite(l));
    let ended = finite(&filtered.whitened) && finite(&filtered.error) && all(&sampled.truth);
    if ended && all(&filtered.estimate) && all(&filtered.sigma) {
        return Ok(());
    }
    let what = "the run of the filter ends in numbers that are none".into();
    Err(SimulationError::Unresolvable { what })
}

/// Runs the filter of `plan` against one truth with randomly drawn biases. The conditions select the filter,
/// or the validity of the small-angle model does. Where it is not the linear one, the linear filter also runs
/// on the same measurements.
///
/// # Errors
/// [`SimulationError::Filter`] when the prior is refused, [`SimulationError::TooManySteps`] for an exact
/// truth that turns too fast, [`SimulationError::Unresolvable`] for a number that is not finite.
pub fn run(
    plan: &Plan,
    conditions: &Conditions,
    start: &RunStart,
    prediction: &Prediction,
    seed: u64,
) -> Result<RunRecord, SimulationError> {
    let n = plan.unknowns();
    let recorded = RecordedQuantities {
        unknowns: n,
        combinations: prediction.combinations.iter().map(|c| &c.terms[..]).collect(),
    };
    let mut traces = empty_traces(plan, prediction);
    let sampled = sampled(plan, conditions, start, &recorded, seed)?;
    let validity = Validity::of(plan, conditions, &start.truth, sampled.largest_psi)?;
    let (kind, reason) = choose(plan, conditions, &validity)?;
    let filtered = match kind {
        FilterKind::Linear => linear(plan, start, &sampled, &recorded)?,
        FilterKind::Extended => extended(plan, conditions, start, &sampled, &recorded, false)?,
        FilterKind::Iterated => extended(plan, conditions, start, &sampled, &recorded, true)?,
    };
    check_finite(&sampled, &filtered)?;
    let series = |filtered: FilterSeries| -> Vec<Series> {
        let both = filtered.estimate.into_iter().zip(filtered.sigma).zip(&sampled.truth);
        both.map(|((estimate, sigma), truth)| Series { truth: truth.clone(), estimate, sigma }).collect()
    };
    // results of the linear filter for comparison
    if kind != FilterKind::Linear {
        traces.linear = Some(series(linear(plan, start, &sampled, &recorded)?));
    }
    let (passes, converged) = filtered.passes;
    Ok(RunRecord {
        whitened: filtered.whitened.clone(),
        last_covariance: filtered.covariance.clone(),
        last_error: filtered.error.clone(),
        filter: FilterReport {
            kind,
            reason,
            passes,
            converged,
            trusted: trusted(kind, conditions, &validity, psi_prior(plan, start)),
        },
        validity,
        traces: Traces { series: series(filtered), ..traces },
    })
}

/// Filter of the run, and the reason of the choice.
pub(crate) fn choose(
    plan: &Plan,
    conditions: &Conditions,
    validity: &Validity,
) -> Result<(FilterKind, FilterReason), SimulationError> {
    conditions.check_truth()?;
    let steps = plan.segments.iter().map(|s| s.steps).sum::<usize>();
    match conditions.filter {
        Some(FilterKind::Iterated) if steps > MAX_ITERATED_STEPS => {
            let (found, what) = (steps.to_string(), "steps of an iterated filter");
            Err(SimulationError::TooManySteps { found, what, most: MAX_ITERATED_STEPS })
        }
        Some(kind) => Ok((kind, FilterReason::Given)),
        None if conditions.truth == Truth::Linear => Ok((FilterKind::Linear, FilterReason::LinearTruth)),
        None if validity.holds => Ok((FilterKind::Linear, FilterReason::Valid)),
        None if steps > MAX_ITERATED_STEPS => Ok((FilterKind::Extended, FilterReason::NotValid)),
        None => Ok((FilterKind::Iterated, FilterReason::NotValid)),
    }
}

/// True if the sigmas of a filter are right at this truth: it is linearised along the whole run, or its model
/// is that of the truth. An extended filter is linearised within its prior too: `psi_prior` in rad.
fn trusted(kind: FilterKind, conditions: &Conditions, validity: &Validity, psi_prior: f64) -> bool {
    match kind {
        FilterKind::Linear => validity.holds || conditions.truth == Truth::Linear,
        FilterKind::Extended => {
            validity.holds && psi_prior * psi_prior / 2.0 <= validity.accelerometer_noise_g
        }
        FilterKind::Iterated => true,
    }
}

/// Largest standard deviation of psi at the start, in rad.
fn psi_prior(plan: &Plan, start: &RunStart) -> f64 {
    let psi = plan.platform.units().iter().zip(&start.sigma).filter(|(unit, _)| **unit == "rad");
    psi.map(|(_, sigma)| *sigma).fold(0.0, f64::max)
}

/// Number of the first step of every segment.
pub(crate) fn first_steps(plan: &Plan) -> Vec<usize> {
    let starts = plan.segments.iter().scan(0, |next, s| {
        let first = *next;
        *next += s.steps;
        Some(first)
    });
    starts.collect()
}
