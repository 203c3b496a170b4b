//! Conditions and timeline of a run, as reported.

use obsdeg_core::model::Scheme;
use obsdeg_core::model::settings::{Assignment, DriftNoise, concerns};

use super::answer::{AccelerometerBias, ConditionsReport, TimelineReport, chosen};
use super::conditions::Conditions;
use super::plan::Plan;
use super::plan::timeline::SegmentKind;

/// Conditions of a run, as reported.
pub(crate) fn conditions_report(scheme: &Scheme, plan: &Plan, conditions: &Conditions) -> ConditionsReport {
    let noise = conditions.drift_noise;
    let given = matches!(noise, DriftNoise::OneStep(_)).then_some(conditions.drift_noise_step_s);
    // a slew takes as many steps as a position of its duration
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
        settle_s: conditions.stated_settle_s(),
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
        bench: conditions.bench_in_words(),
        by_default: chosen_for_run(scheme, plan.platform.names(), conditions),
    }
}

/// Keys of the conditions of a run that are not stated.
fn chosen_for_run(scheme: &Scheme, unknowns: &[String], conditions: &Conditions) -> Vec<String> {
    let mut out = chosen(scheme, conditions);
    let some_left = |stated: &[Assignment]| {
        let left = unknowns.iter().any(|name| !stated.iter().any(|a| concerns(&a.name, name)));
        !stated.is_empty() && left
    };
    let own = [
        ("truth", !conditions.states().truth && conditions.has_full_attitudes()),
        ("drift_noise", !conditions.states().drift_noise && conditions.drift_noise.amount() > 0.0),
        ("values", conditions.stated_values().is_empty()),
        ("other_values", some_left(conditions.stated_values())),
        ("priors", conditions.stated_priors().is_empty()),
        ("other_priors", some_left(conditions.stated_priors())),
    ];
    out.extend(own.into_iter().filter(|(_, by_default)| *by_default).map(|(key, _)| key.into()));
    out
}

/// Timeline of a plan, as reported.
pub(crate) fn timeline_report(plan: &Plan) -> Vec<TimelineReport> {
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
