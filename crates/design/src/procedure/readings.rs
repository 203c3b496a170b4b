//! Readings of the accelerometers at rest, with their tolerances.
//!
//! A platform without errors reads `f^c = -C_n^c g^n` in g. A tilt by an angle `a` changes each component by
//! at most `2 sin(a/2)`. The tilt is the allowed one, the one that the stated true values give by the linear
//! model, and three sigma of that by the stated priors and random drift. Stated errors of the accelerometers,
//! of attitudes and of gravity add to it.

use obsdeg_core::model::OmittedModel;
use obsdeg_core::model::settings::Assignment;
use obsdeg_evidence::simulation::omitted::Bench;
use obsdeg_evidence::simulation::{
    Conditions, Plan, SegmentKind, Sensor, SimulationError, is_rate, resolve, si_per_shown,
};

use super::answer::{Step, StepKind, Tolerance};
use super::options::{ProcedureError, ProcedureOptions};

/// Tolerance from which a reading tells little, in g.
const WIDE_G: f64 = 0.25;
/// Number of sigmas of the priors, the bench and the random drift in a tolerance.
const SIGMAS: f64 = 3.0;
/// Number of sigmas of the noise in a tolerance: every sample of the run stays within.
const NOISE: f64 = 5.0;

/// Adds readings and tolerances to the steps at rest; returns their basis.
///
/// # Errors
/// [`ProcedureError::Simulation`] for a value of a name that the scheme does not have.
pub(super) fn add(
    steps: &mut [Step],
    plan: &Plan,
    conditions: &Conditions,
    options: &ProcedureOptions,
) -> Result<Tolerance, ProcedureError> {
    let sizes = |what, stated: &[Assignment]| -> Result<Vec<f64>, ProcedureError> {
        let units = plan.platform.units();
        let scale =
            |unit: &str| si_per_shown(unit) * if is_rate(unit) { conditions.drift_scale } else { 1.0 };
        let found = resolve(what, &plan.platform, stated, 0.0)?;
        Ok(found.iter().zip(units).map(|(x, unit)| x * scale(unit)).collect())
    };
    let values = sizes("true value", conditions.stated_values())?;
    let priors = sizes("prior", conditions.stated_priors())?;
    let (accelerometers_g, not_counted) = accelerometers(plan, conditions, &values, &priors)?;
    let tilts = tilts(plan, &values, &priors);
    let mut at_rest = 0;
    for step in steps.iter_mut().filter(|s| matches!(s.kind, StepKind::Record | StepKind::Wait)) {
        while plan_position(plan, at_rest) != step.position && at_rest + 1 < plan.attitudes.len() {
            at_rest += 1;
        }
        // f = -C_n^c g^n with g^n = (0, -1, 0): the second row of C_c^n
        let clean = |x: f64| (x * 1e12).round() / 1e12 + 0.0;
        step.force_g = Some(plan.attitudes[at_rest][1].map(clean));
        let tilt = (options.tilt_deg.to_radians() + tilts[at_rest]).min(std::f64::consts::PI);
        let noise = NOISE * conditions.accelerometer_noise_g;
        step.tolerance_g = Some(2.0 * (tilt / 2.0).sin() + accelerometers_g + noise);
    }
    let some = |sizes: &[f64]| sizes.iter().any(|x| *x != 0.0);
    let wide = |s: &&Step| s.kind == StepKind::Record && s.tolerance_g.is_some_and(|t| t > WIDE_G);
    Ok(Tolerance {
        tilt_deg: options.tilt_deg,
        by_values: some(&values),
        by_priors: some(&priors),
        by_noise: noisy(plan),
        accelerometers_g,
        not_counted,
        wide: steps.iter().filter(wide).map(|s| s.position.clone()).collect(),
    })
}

fn plan_position(plan: &Plan, i: usize) -> &str {
    &plan.platform.scheme().positions[i].name
}

/// Largest change of a reading, in g, by errors of the accelerometers: the stated values, and three sigma of
/// their priors, of the bench and of the bias instability. A factor of g is at most 1. Also the families of
/// the bench that are not part of it.
fn accelerometers(
    plan: &Plan,
    conditions: &Conditions,
    values: &[f64],
    priors: &[f64],
) -> Result<(f64, Vec<String>), ProcedureError> {
    let units = plan.platform.units();
    let own: Vec<usize> = (0..units.len()).filter(|&c| !is_rate(units[c]) && units[c] != "rad").collect();
    let stated: f64 = own.iter().map(|&c| values[c].abs()).sum();
    let model = OmittedModel::new(&plan.platform);
    let bench = Bench::of(&conditions.bench, &model).map_err(SimulationError::from)?;
    let sizes = model.terms().iter().zip(&bench.sizes).filter_map(|(t, size)| Some((t, (*size)?)));
    let (counted, others): (Vec<_>, Vec<_>) =
        sizes.filter(|(_, size)| *size > 0.0).partition(|(t, _)| is_counted(t.family));
    let mut bench: f64 = counted.iter().map(|(t, size)| (size * si_per_shown(t.unit)).powi(2)).sum();
    let biases = plan.biases.iter().zip(plan.bias_sigmas());
    let instability = biases.filter(|(b, _)| matches!(b.sensor, Sensor::Accelerometer(_)));
    bench += instability.map(|(_, sigma)| sigma * sigma).sum::<f64>();
    let known: f64 = own.iter().map(|&c| priors[c].powi(2)).sum();
    let mut others: Vec<String> = others.iter().map(|(t, _)| t.family.to_string()).collect();
    others.dedup();
    Ok((stated + SIGMAS * (bench + known).sqrt(), others))
}

/// True for a family of the bench that changes readings directly.
fn is_counted(family: &str) -> bool {
    family.starts_with('K') || family == "M" || family == "M3" || ["attitude", "gravity"].contains(&family)
}

/// True if random drift or biases are stated.
fn noisy(plan: &Plan) -> bool {
    plan.biases.iter().any(|b| matches!(b.sensor, Sensor::Gyro(_)))
        || plan.noise_roots.iter().any(|root| root.iter().any(|x| *x != 0.0))
}

/// Largest tilt of the platform in each position, in rad, by the linear model: that of the true values
/// `values`, and three sigma of that by the priors `priors` (both in SI units, shape n).
fn tilts(plan: &Plan, values: &[f64], priors: &[f64]) -> Vec<f64> {
    let n = plan.unknowns();
    let columns: Vec<usize> = (0..n).filter(|&c| priors[c] != 0.0).collect();
    let own = |c: usize, size: f64| (0..plan.states()).map(|i| if i == c { size } else { 0.0 }).collect();
    let mut states: Vec<Vec<f64>> = columns.iter().map(|&c| own(c, priors[c])).collect();
    states.extend(plan.bias_sigmas().into_iter().enumerate().map(|(k, sigma)| own(n + k, sigma)));
    let mut value = values.to_vec();
    value.resize(plan.states(), 0.0);
    states.push(value);
    let mut out = vec![0.0f64; plan.attitudes.len()];
    let mut scratch = Vec::new();
    // variance of psi by the noise of the steps so far
    let mut white = 0.0;
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    for (k, segment) in plan.segments.iter().enumerate() {
        let mut note = |states: &[Vec<f64>], white: f64| {
            let tilt = |x: &Vec<f64>| length(plan.psi_n(k, x));
            let Some((value, spread)) = states.split_last() else { return };
            let sigma = (spread.iter().map(|x| tilt(x).powi(2)).sum::<f64>() + white).sqrt();
            let all = &mut out[segment.position];
            *all = all.max(tilt(value) + SIGMAS * sigma);
        };
        let at_rest = segment.kind == SegmentKind::Dwell;
        if at_rest {
            note(&states, white);
        }
        let root = &plan.noise_roots[k];
        let step: f64 = root.rows(0, root.nrows().min(3)).iter().map(|x| x * x).sum();
        for _ in 0..segment.steps {
            for x in &mut states {
                plan.stages[k].transition.apply(x, &mut scratch);
            }
            white += step;
            if at_rest {
                note(&states, white);
            }
        }
    }
    out
}
