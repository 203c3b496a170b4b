//! A torquing scheme run through the filter: one run against one truth, and what it says.

pub mod answer;
pub(crate) mod attitude_path;
pub mod batch;
pub mod conditions;
pub mod plan;
pub mod ranges;
pub mod record;
pub mod truth;

use obsdeg_ekf::EkfError;
use obsdeg_ekf::consistency::{CONFIDENCE, Nees, autocorrelation, chi_square_band, ljung_box};

pub use answer::{Simulation, Validity};
pub use conditions::Conditions;
pub use plan::Plan;
pub use record::{Record, Start, Traces, run};

use crate::model::{Carry, Scheme, SchemeError};
use crate::prediction::{Prediction, PredictionError};
use answer::{ConditionsReport, Consistency, Estimate, Outcome, SCHEMA, TimelineReport};
use conditions::{resolve, shown_unit, si_per_shown};
use plan::Kind;

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
    /// Too many unknowns for a full covariance.
    #[error("{found} unknowns; expected at most {} for a simulation", plan::MAX_UNKNOWNS)]
    TooManyUnknowns {
        /// Number of unknowns.
        found: usize,
    },
    /// Too many steps.
    #[error("{found} steps; expected at most {} (take longer steps)", plan::MAX_STEPS)]
    TooManySteps {
        /// Number of steps.
        found: usize,
    },
    /// A condition beyond its range.
    #[error(transparent)]
    Range(#[from] ranges::RangeError),
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
    let start = Start::new(&plan, conditions)?;
    let rates = [plan.point.w_n, plan.point.w_u];
    let prediction = Prediction::new(&plan.platform, rates, seed)?;
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
    let units: Vec<&str> = plan.platform.units().to_vec();
    let requirements = resolve("required sigma", &plan.platform, &conditions.requirements, f64::NAN)?;
    let mut quantities = Vec::new();
    for (c, u) in prediction.unknowns.iter().enumerate() {
        let scale = si_per_shown(units[c]);
        let series = &record.traces.series[c];
        quantities.push(Estimate {
            status: u.status,
            degree: u.degree,
            accuracy_order: u.accuracy_order,
            ..estimate(&plan.platform.names()[c], units[c], scale, series, record, Some(requirements[c]))
        });
    }
    let mut combinations = Vec::new();
    for (i, c) in prediction.combinations.iter().enumerate() {
        let unit = units[c.terms[0].0];
        let series = &record.traces.series[n + i];
        combinations.push(Estimate {
            status: c.status,
            degree: c.degree,
            accuracy_order: c.accuracy_order,
            ..estimate(
                &c.expression,
                unit,
                si_per_shown(unit),
                series,
                record,
                Some(requirements[c.terms[0].0]),
            )
        });
    }
    let consistency = consistency(plan, record, &quantities)?;
    let validity = validity(plan, conditions, record, &requirements);
    Ok(Simulation {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        carry: scheme.carry,
        conditions: conditions_report(scheme, plan, conditions),
        timeline: timeline_report(plan),
        quantities,
        combinations,
        consistency,
        validity,
        seed,
    })
}

/// The conditions as they are reported.
pub fn conditions_report(scheme: &Scheme, plan: &Plan, conditions: &Conditions) -> ConditionsReport {
    ConditionsReport {
        truth: conditions.truth,
        latitude_deg: plan.platform.scheme().latitude.map_or(0.0, |l| l.degrees()),
        latitude_by_default: scheme.latitude.is_none(),
        step_s: conditions.step_s,
        slew_rate_deg_s: conditions.slew_rate_deg_s,
        accelerometer_noise_g: conditions.accelerometer_noise_g,
        drift_noise: conditions.drift_noise.to_string(),
        propagation: conditions.propagation,
        drift_scale: conditions.drift_scale,
    }
}

/// The timeline as it is reported.
pub fn timeline_report(plan: &Plan) -> Vec<TimelineReport> {
    let positions = &plan.platform.scheme().positions;
    let mut out: Vec<TimelineReport> = Vec::new();
    for s in &plan.segments {
        let (slew, end_s) = (matches!(s.kind, Kind::Slew(_)), s.start_s + s.dt * s.steps as f64);
        let position = &positions[s.position].name;
        match out.last_mut() {
            // a rotation is one segment per step
            Some(last) if last.position == *position && last.slew == slew => last.end_s = end_s,
            _ => out.push(TimelineReport { position: position.clone(), slew, start_s: s.start_s, end_s }),
        }
    }
    out
}

fn estimate(
    name: &str,
    unit: &str,
    scale: f64,
    series: &record::Series,
    record: &Record,
    required: Option<f64>,
) -> Estimate {
    let last = |v: &[f64]| v.last().copied().unwrap_or(0.0) / scale;
    let (truth, estimate, sigma) = (last(&series.truth), last(&series.estimate), last(&series.sigma));
    let prior_sigma = series.sigma[0] / scale;
    let required_sigma = required.filter(|t| !t.is_nan());
    let reached = required_sigma.and_then(|t| series.sigma.iter().position(|s| s / scale <= t));
    let error = estimate - truth;
    let error_over_sigma = if sigma > 0.0 { error / sigma } else { 0.0 };
    let verdict = if error_over_sigma.abs() > 4.0 {
        Outcome::Inconsistent
    } else if sigma > 0.9 * prior_sigma {
        Outcome::PriorOnly
    } else if required_sigma.is_none_or(|t| sigma <= t) {
        Outcome::Reached
    } else {
        Outcome::Converging
    };
    Estimate {
        name: name.into(),
        unit: shown_unit(unit).into(),
        status: crate::analysis::Status::Observable,
        degree: None,
        accuracy_order: None,
        truth,
        estimate,
        error,
        sigma,
        error_over_sigma,
        prior_sigma,
        required_sigma,
        time_to_requirement_s: reached.map(|i| record.traces.time[i]),
        verdict,
    }
}

fn consistency(
    plan: &Plan,
    record: &Record,
    quantities: &[Estimate],
) -> Result<Consistency, SimulationError> {
    let n = plan.unknowns();
    let outputs = plan.components.len();
    let samples = record.whitened.len() / outputs;
    let nis = record.whitened.iter().map(|v| v * v).sum::<f64>() / samples as f64;
    let mut error: Vec<f64> = record.traces.series[..n]
        .iter()
        .map(|s| s.estimate.last().copied().unwrap_or(0.0) - s.truth.last().copied().unwrap_or(0.0))
        .collect();
    let nees = Nees::of_covariance(&record.last_covariance)?.of(&mut error);
    let lags = 20.min(samples / 4).max(1);
    let whiteness = (0..outputs)
        .map(|j| {
            let one: Vec<f64> = record.whitened.iter().skip(j).step_by(outputs).copied().collect();
            ljung_box(&autocorrelation(&one, lags), one.len())
        })
        .fold(1.0, f64::min);
    let strict = chi_square_band(outputs as f64, samples as f64, 0.999);
    let consistent =
        nis <= strict.1 && nis >= strict.0 && quantities.iter().all(|q| q.error_over_sigma.abs() <= 4.0);
    Ok(Consistency {
        nis,
        nis_band: chi_square_band(outputs as f64, samples as f64, CONFIDENCE),
        nees,
        nees_band: chi_square_band(n as f64, 1.0, CONFIDENCE),
        whiteness_probability: whiteness,
        consistent,
    })
}

/// The validity of the small-angle model, by the figures that decide it.
pub fn validity(plan: &Plan, conditions: &Conditions, record: &Record, requirements: &[f64]) -> Validity {
    let psi = record.largest_psi;
    let dph = si_per_shown("deg/h");
    let sensitive =
        plan.platform.units().iter().zip(&record.traces.series).filter(|(unit, _)| unit.contains("/g"));
    let coefficient = sensitive.map(|(_, s)| s.truth[0].abs()).fold(0.0, f64::max) / dph;
    let smallest =
        plan.platform.units().iter().zip(requirements).filter(|(unit, t)| **unit != "rad" && !t.is_nan());
    let smallest = smallest.map(|(_, t)| *t).reduce(f64::min);
    let (neglected_g, neglected_dph) = (psi * psi / 2.0, coefficient * psi);
    Validity {
        largest_psi_deg: psi.to_degrees(),
        neglected_g,
        accelerometer_noise_g: conditions.accelerometer_noise_g,
        neglected_dph,
        smallest_requirement_dph: smallest,
        holds: neglected_g <= conditions.accelerometer_noise_g && smallest.is_none_or(|t| neglected_dph <= t),
    }
}
