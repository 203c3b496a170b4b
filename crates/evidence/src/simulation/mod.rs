//! A torquing scheme run through the filter: one run against one truth, and what it says.

pub(crate) mod answer;
pub(crate) mod attained;
pub(crate) mod batch;
pub(crate) mod carries;
pub(crate) mod conditions;
pub(crate) mod consistency;
mod curvature;
pub(crate) mod extended;
pub(crate) mod floor;
pub(crate) mod gyro_noise;
pub(crate) mod iterated;
pub(crate) mod plan;
pub(crate) mod record;
mod seen;
pub(crate) mod state;
pub(crate) mod truth;

pub use answer::*;
pub use attained::Attained;
pub use batch::{Batch, batch, diffuse_prior};
pub use carries::{OtherCarry, other_carries};
pub use conditions::{
    Conditions, PRIOR, Stated, general_first, is_rate, latitude_of, resolve, shown_unit, si_per_shown,
};
pub use consistency::{Consistency, Doubt};
pub use extended::{Ended, Extended, PlatformMotion};
pub use floor::{CoefficientFloor, NoiseFloor, Reached, noise_floor, sigmas_without_prior};
pub use gyro_noise::{Bias, GyroNoise, Sensor};
pub use iterated::iterated;
pub use plan::{Plan, PlatformProcess, Segment, SegmentKind, steps};
pub use record::{Record, RunStart, Series, Traces, run};
pub use seen::{no_prior, predict, predict_run};
pub use state::PlatformState;
pub use truth::{Noise, TruthModel};

use obsdeg_core::degree::Status;
use obsdeg_core::model::settings::{DriftNoise, FilterKind};
use obsdeg_core::model::{Carry, Scheme, SchemeError};
use obsdeg_ekf::EkfError;

use crate::prediction::{PredictedCombination, Prediction, PredictionError};
use crate::requirements::{Basis, Claim, Miss, Requirements, meets};
use answer::chosen;
use conditions::REQUIRED;
use consistency::Outcomes;

/// Why a scheme cannot be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// A generic angle has no number.
    #[error("the angle `{name}` is generic; expected numbers for a simulation")]
    GenericAngle {
        /// Its name.
        name: String,
    },
    /// Slews carry psi^n.
    #[error(
        "slews of finite duration carry psi in geographic axes; found {carry} carry, expected inertial (or no slew rate)"
    )]
    SlewCarry {
        /// The carry found.
        carry: Carry,
    },
    /// The turn of a slew ends elsewhere.
    #[error(
        "the slew to `{name}` does not lead there: expected an axis and angle that turn the position before into it"
    )]
    SlewMisses {
        /// The position.
        name: String,
    },
    /// A filter that does not know of a position knows of no slew to it.
    #[error("a dropped position goes with instantaneous repositioning; found a slew rate")]
    DroppedSlew,
    /// The only position cannot be dropped.
    #[error("the only position cannot be dropped; expected a scheme of at least two positions")]
    DroppedOnly,
    /// Whoever asked wanted no more.
    #[error("interrupted before the runs were done")]
    Interrupted,
    /// The accuracy orders of a rotation are not known.
    #[error("the cross-check takes positions; found a rotating segment")]
    CrosscheckRotation,
    /// The exact truth turns an attitude by coefficients.
    #[error("exact truth needs coefficients; found the unknowns `drift` (use terms such as F,I,O,S)")]
    ExactDrift,
    /// Full attitudes have no turns at once.
    #[error(
        "full attitudes with unknown torquer errors (GS, GM, GM3) need turns that take time; expected a slew rate (slew_rate_deg_s, --slew-rate), \
         or filter = \"linear\" and truth = \"linear\""
    )]
    TorquedAtOnce,
    /// Too many unknowns for a full covariance.
    #[error("{found} unknowns; expected at most {} for a simulation", plan::MAX_UNKNOWNS)]
    TooManyUnknowns {
        /// Number of unknowns.
        found: usize,
    },
    /// Too many unknowns under a carry that is looked at for comparison.
    #[error(
        "{found} unknowns under reset carry, which is compared too; expected at most {}",
        plan::MAX_UNKNOWNS
    )]
    ComparedUnknowns {
        /// Number of unknowns.
        found: usize,
    },
    /// Too many steps.
    #[error("{found} {what}; expected at most {most} (take longer steps)")]
    TooManySteps {
        /// Their number.
        found: String,
        /// What is counted.
        what: &'static str,
        /// The most.
        most: usize,
    },
    /// Numbers that are admitted, but that doubles cannot tell apart.
    #[error("not resolvable in double precision: {what}")]
    Unresolvable {
        /// What is not.
        what: String,
    },
    /// A condition beyond its range.
    #[error(transparent)]
    Range(#[from] obsdeg_core::model::ranges::RangeError),
    /// A value for something that the scheme does not have.
    #[error("{what} for `{found}`: no such unknown; {known}")]
    UnknownName {
        /// Which list.
        what: &'static str,
        /// The name found.
        found: String,
        /// What was expected.
        known: String,
    },
    /// The scheme itself.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// No exact verdicts.
    #[error(transparent)]
    Prediction(#[from] PredictionError),
    /// The filter refuses a number.
    #[error(transparent)]
    Filter(#[from] EkfError),
}

impl SimulationError {
    /// Whether admitted numbers went beyond what doubles resolve.
    pub fn is_numeric(&self) -> bool {
        match self {
            Self::Unresolvable { .. } => true,
            Self::Filter(e) => e.is_numeric(),
            _ => false,
        }
    }
}

/// Simulates `scheme` once: the summary and the time series.
///
/// # Errors
/// [`SimulationError`].
pub fn simulate(
    scheme: &Scheme,
    conditions: &Conditions,
    seed: u64,
) -> Result<(Simulation, Record), SimulationError> {
    let plan = Plan::new(scheme, conditions)?;
    let start = RunStart::new(&plan, conditions)?;
    let prediction = predict_run(&plan, &start.sigma[..plan.unknowns()], seed)?;
    let record = run(&plan, conditions, &start, &prediction, seed)?;
    let summary = summary(scheme, &plan, conditions, &prediction, &record, seed)?;
    Ok((summary, record))
}

fn summary(
    scheme: &Scheme,
    plan: &Plan,
    conditions: &Conditions,
    prediction: &Prediction,
    record: &Record,
    seed: u64,
) -> Result<Simulation, SimulationError> {
    let n = plan.unknowns();
    let (names, units) = (plan.platform.names(), plan.platform.units());
    let requirements = resolve(REQUIRED, &plan.platform, &conditions.requirements, f64::NAN)?;
    let required = |c: usize| Some(requirements[c]).filter(|r| !r.is_nan());
    let attained = Attained::new(scheme, conditions, seed)?;
    let unknowns = prediction.unknowns.iter().enumerate().map(|(c, u)| {
        let verdict = (u.status, u.degree, u.accuracy_order, u.determined_at_end);
        let wanted = [required(c), attained.sigmas[c]];
        estimate(&names[c], units[c], verdict, c, record, wanted)
    });
    let mut quantities: Vec<Estimate> = unknowns.collect();
    for (q, u) in
        quantities.iter_mut().zip(&prediction.unknowns).filter(|(q, _)| q.outcome == Outcome::PriorOnly)
    {
        let unseen = u.partners.iter().filter(|&&p| !prediction.unknowns[p].determined_at_end);
        q.prior_of = unseen.map(|&p| names[p].clone()).collect();
    }
    let combination = |(i, c): (usize, &PredictedCombination)| -> Result<Estimate, SimulationError> {
        let verdict = (c.status, c.degree, c.accuracy_order, c.determined_at_end);
        let lead = c.terms[0].0;
        let predicted = attained.sigma_of(&c.terms)? / si_per_shown(units[lead]);
        let wanted = [required(lead), c.determined_at_end.then_some(predicted)];
        Ok(estimate(&c.expression, units[lead], verdict, n + i, record, wanted))
    };
    let combinations = prediction.combinations.iter().enumerate();
    let combinations: Vec<Estimate> = combinations.map(combination).collect::<Result<_, _>>()?;
    let consistency = Consistency::of(Outcomes {
        whitened: &record.whitened,
        outputs: plan.components.len(),
        error: record.last_error.clone(),
        covariance: &record.last_covariance,
        normalised: quantities.iter().map(|q| (q.name.as_str(), q.error_over_sigma)).collect(),
        resolution: 0.0,
    })?;
    let noise_floor = noise_floor(scheme, conditions, prediction)?;
    Ok(Simulation {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        carry: scheme.carry,
        conditions: conditions_report(scheme, plan, conditions),
        timeline: timeline_report(plan),
        requirements: attained.requirements(conditions)?,
        run: run_requirements(plan, conditions, &quantities, record)?,
        other_carries: other_carries(scheme, conditions, seed)?,
        quantities,
        combinations,
        consistency,
        filter: record.filter,
        validity: record.validity.clone(),
        noise_floor,
        gimbals: scheme.gimbal_report(),
        seed,
    })
}

/// Outcome of the requirements in the run, and the reasons why its sigmas may differ from the predicted ones.
fn run_requirements(
    plan: &Plan,
    conditions: &Conditions,
    quantities: &[Estimate],
    record: &Record,
) -> Result<RunRequirements, SimulationError> {
    let claims = quantities.iter().map(|q| Claim {
        name: &q.name,
        required: q.required_sigma,
        // what a stated prior bounds counts, as in the prediction
        sigma: match q.outcome.miss() {
            Some(Miss::NotObservable) if q.predicted_sigma.is_some() => Ok(q.sigma),
            Some(why) => Err(why),
            None => Ok(q.sigma),
        },
    });
    let ratio = |q: &Estimate| {
        let ratio = q.sigma / q.predicted_sigma?;
        ratio.is_finite().then(|| SigmaRatio { name: q.name.clone(), ratio })
    };
    let by_ratio = |a: &SigmaRatio, b: &SigmaRatio| a.ratio.total_cmp(&b.ratio);
    let priors = resolve(PRIOR, &plan.platform, conditions.stated_priors(), f64::NAN)?;
    let differs = [
        (RunDiffers::RandomDrift, !conditions.states().drift_noise && conditions.drift_noise.amount() > 0.0),
        (RunDiffers::Prior, priors.iter().any(|p| p.is_nan())),
        (RunDiffers::FullAttitudes, record.filter.kind != FilterKind::Linear),
    ];
    Ok(RunRequirements {
        requirements: Requirements::of(Basis::Run, claims),
        largest_ratio: quantities.iter().filter_map(ratio).max_by(by_ratio),
        smallest_ratio: quantities.iter().filter_map(ratio).min_by(by_ratio),
        differs: differs.into_iter().filter_map(|(reason, here)| here.then_some(reason)).collect(),
    })
}

/// The conditions as they are reported.
pub fn conditions_report(scheme: &Scheme, plan: &Plan, conditions: &Conditions) -> ConditionsReport {
    let noise = conditions.drift_noise;
    let given = matches!(noise, DriftNoise::OneStep(_)).then_some(conditions.drift_noise_step_s);
    // a slew takes as many steps as a position would
    let steps = plan.segments.iter().map(|s| match s.kind {
        SegmentKind::Slew(_) => s.dt.min(conditions.step_s),
        _ => s.dt,
    });
    let (shortest, longest) = steps.fold((f64::MAX, 0.0f64), |(l, h), dt| (l.min(dt), h.max(dt)));
    let density = [shortest, longest].map(|dt| noise.density_deg_sqrt_h(dt));
    let differs = |step: f64| density.iter().any(|d| (d / noise.density_deg_sqrt_h(step) - 1.0).abs() > 0.01);
    ConditionsReport {
        truth: conditions.truth,
        latitude_deg: plan.platform.scheme().latitude.map_or(0.0, |l| l.degrees()),
        latitude_by_default: scheme.latitude.is_none(),
        step_s: conditions.step_s,
        slew_rate_deg_s: conditions.slew_rate_deg_s,
        accelerometer_noise_g: conditions.accelerometer_noise_g,
        accelerometer_bias: AccelerometerBias::of(conditions),
        drift_noise: noise.to_string(),
        drift_noise_density_deg_sqrt_h: density,
        drift_noise_step_s: given,
        drift_noise_differs: given.is_some_and(differs),
        gyro_noise: (!conditions.gyro_noise.is_none()).then_some(conditions.gyro_noise),
        propagation: conditions.propagation,
        drift_scale: conditions.drift_scale,
        by_default: chosen_for_run(scheme, conditions),
    }
}

/// Keys of the conditions of a run that nobody states.
fn chosen_for_run(scheme: &Scheme, conditions: &Conditions) -> Vec<String> {
    let mut out = chosen(scheme, conditions);
    let own = [
        ("drift_noise", !conditions.states().drift_noise && conditions.drift_noise.amount() > 0.0),
        ("values", conditions.stated_values().is_empty()),
        ("priors", conditions.stated_priors().is_empty()),
    ];
    out.extend(own.into_iter().filter(|(_, by_default)| *by_default).map(|(key, _)| key.into()));
    out
}

/// The timeline as it is reported.
pub fn timeline_report(plan: &Plan) -> Vec<TimelineReport> {
    let positions = &plan.platform.scheme().positions;
    let mut out: Vec<TimelineReport> = Vec::new();
    for s in &plan.segments {
        let (slew, end_s) = (matches!(s.kind, SegmentKind::Slew(_)), s.start_s + s.dt * s.steps as f64);
        let position = &positions[s.position].name;
        match out.last_mut() {
            // a rotation is one segment per step
            Some(last) if last.position == *position && last.slew == slew => last.end_s = end_s,
            _ => {
                let turn = if let SegmentKind::Slew(slew) = &s.kind { Some(slew.turn()) } else { None };
                out.push(TimelineReport {
                    position: position.clone(),
                    slew,
                    start_s: s.start_s,
                    end_s,
                    turn,
                });
            }
        }
    }
    out
}

/// The estimate of series `i` at the end; `verdict` is the exact one with whether samples determine it, the
/// last are the required and the predicted sigma.
fn estimate(
    name: &str,
    unit: &str,
    verdict: (Status, Option<usize>, Option<usize>, bool),
    i: usize,
    record: &Record,
    [required_sigma, predicted_sigma]: [Option<f64>; 2],
) -> Estimate {
    let (status, degree, accuracy_order, determined) = verdict;
    let (series, scale) = (&record.traces.series[i], si_per_shown(unit));
    let last = |v: &[f64]| v.last().map_or(f64::NAN, |x| x / scale);
    let (truth, estimate, sigma) = (last(&series.truth), last(&series.estimate), last(&series.sigma));
    let prior_sigma = series.sigma[0] / scale;
    let linear = record.traces.linear.as_ref().map(|all| {
        let s = &all[i];
        LinearEstimate { error: last(&s.estimate) - truth, sigma: last(&s.sigma) }
    });
    let error = estimate - truth;
    let error_over_sigma = if error == 0.0 { 0.0 } else { error / sigma };
    // from when on sigma meets it to the end
    let reached = required_sigma.and_then(|r| {
        let missed = series.sigma.iter().rposition(|s| !meets(s / scale, r));
        missed.map_or(Some(0), |i| (i + 1 < series.sigma.len()).then_some(i + 1))
    });
    Estimate {
        name: name.into(),
        unit: shown_unit(unit).into(),
        status,
        degree,
        accuracy_order,
        truth,
        estimate,
        error,
        sigma,
        predicted_sigma,
        error_over_sigma,
        linear,
        prior_sigma,
        required_sigma,
        time_to_requirement_s: reached.filter(|_| determined).map(|i| record.traces.time[i]),
        outcome: Outcome::of(
            determined,
            record.filter.kind,
            error_over_sigma,
            [prior_sigma, sigma],
            required_sigma,
        ),
        prior_of: Vec::new(),
    }
}

impl Validity {
    /// The figures that decide it, for a run from the true states `start` in which `|psi|` reached `psi` (rad).
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`] for a requirement on what the scheme does not have.
    pub fn of(
        plan: &Plan,
        conditions: &Conditions,
        start: &[f64],
        psi: f64,
    ) -> Result<Self, SimulationError> {
        let dph = si_per_shown("deg/h");
        let requirements = resolve(REQUIRED, &plan.platform, &conditions.requirements, f64::NAN)?;
        let units = plan.platform.units();
        let sensitive = units.iter().zip(start).filter(|(unit, _)| is_rate(unit) && unit.contains("/g"));
        let coefficient = sensitive.map(|(_, d)| d.abs()).fold(0.0, f64::max) / dph;
        let smallest = units.iter().zip(&requirements).filter(|(unit, t)| is_rate(unit) && !t.is_nan());
        let smallest = smallest.map(|(_, t)| *t).reduce(f64::min);
        let (neglected_g, neglected_dph) = (psi * psi / 2.0, coefficient * psi);
        let small = neglected_g <= conditions.accelerometer_noise_g;
        Ok(Self {
            largest_psi_deg: psi.to_degrees(),
            neglected_g,
            accelerometer_noise_g: conditions.accelerometer_noise_g,
            neglected_dph,
            smallest_requirement_dph: smallest,
            holds: small && smallest.is_none_or(|t| neglected_dph <= t),
        })
    }
}
