//! Noise coefficients as keys of a `[simulation]` table, and their values per sample and per step.

use obsdeg_ekf::noise::MARKOV_PEAK_AT;

use super::answer::{ColumnNoise, NoiseCoefficient, NoiseKind, NoiseSetting, SensorKind};
use crate::record::STANDARD_GRAVITY;

/// Coefficient of a kind of noise.
fn coefficient(column: &ColumnNoise, noise: NoiseKind) -> Option<&NoiseCoefficient> {
    column.coefficients.iter().find(|c| c.noise == noise)
}

/// Columns of a kind of sensor.
fn sensors(columns: &[ColumnNoise], kind: SensorKind) -> Vec<&ColumnNoise> {
    columns.iter().filter(|c| c.sensor == kind).collect()
}

/// Values of a coefficient: of all three sensors if `three` (0 where it is not resolved), otherwise the
/// largest; `None` where none is resolved.
fn values(of: &[&ColumnNoise], noise: NoiseKind, three: bool) -> Option<Vec<f64>> {
    let each: Vec<Option<f64>> = of.iter().map(|c| coefficient(c, noise)?.value).collect();
    let largest = each.iter().copied().flatten().reduce(f64::max)?;
    Some(if three && each.len() == 3 {
        each.into_iter().map(|x| x.unwrap_or(0.0)).collect()
    } else {
        vec![largest]
    })
}

/// Correlation time (s) of the Gauss-Markov process that models flicker noise: its largest Allan deviation is
/// where the fitted deviation is least.
fn correlation_s(of: &[&ColumnNoise]) -> Option<f64> {
    let resolved = |c: &&&ColumnNoise| coefficient(c, NoiseKind::BiasInstability).is_some_and(|c| c.resolved);
    let least =
        |c: &&ColumnNoise| c.deviations.iter().min_by(|a, b| a.fitted.total_cmp(&b.fitted)).map(|d| d.tau_s);
    let all: Vec<f64> = of.iter().filter(resolved).filter_map(least).collect();
    let mean = all.iter().map(|t| t.ln()).sum::<f64>() / all.len() as f64;
    (!all.is_empty()).then(|| mean.exp() / MARKOV_PEAK_AT)
}

/// White noise of a sample (g) of an accelerometer with this velocity random walk (m/s/sqrt(h)), for samples
/// `dt` s apart.
fn per_sample(walk: f64, dt: f64) -> f64 {
    walk / 60.0 / STANDARD_GRAVITY / dt.sqrt()
}

/// Keys for the resolved noise; rows are `dt` s apart.
pub(super) fn of(columns: &[ColumnNoise], dt: f64) -> Vec<NoiseSetting> {
    let (gyros, accelerometers) =
        (sensors(columns, SensorKind::Gyro), sensors(columns, SensorKind::Accelerometer));
    let mut out = Vec::new();
    let mut set = |key: &str, values: Option<Vec<f64>>| {
        out.extend(values.map(|values| NoiseSetting { key: key.into(), values }));
    };
    set("angle_random_walk_deg_sqrt_h", values(&gyros, NoiseKind::RandomWalk, true));
    set("bias_instability_dph", values(&gyros, NoiseKind::BiasInstability, true));
    set("correlation_time_s", correlation_s(&gyros).map(|t| vec![t]));
    set("rate_random_walk_dph_sqrt_h", values(&gyros, NoiseKind::RateRandomWalk, true));
    let walk = values(&accelerometers, NoiseKind::RandomWalk, false);
    set("accelerometer_noise_g", walk.map(|w| w.into_iter().map(|w| per_sample(w, dt)).collect()));
    set("accelerometer_bias_instability_ug", values(&accelerometers, NoiseKind::BiasInstability, false));
    set("accelerometer_correlation_time_s", correlation_s(&accelerometers).map(|t| vec![t]));
    out
}

/// Number in four significant digits, the accuracy of a fit.
fn rounded(x: f64) -> String {
    let text = format!("{x:.3e}");
    text.parse::<f64>()
        .map_or(text, |x| if (1e-4..1e6).contains(&x.abs()) { x.to_string() } else { format!("{x:e}") })
}

/// Settings as a table in TOML.
pub(super) fn table(settings: &[NoiseSetting]) -> String {
    let value = |s: &NoiseSetting| match &s.values[..] {
        [x] if s.key.contains("_random_walk") || s.key == "bias_instability_dph" => {
            let x = rounded(*x);
            format!("[{x}, {x}, {x}]")
        }
        [x] => rounded(*x),
        all => format!("[{}]", all.iter().map(|x| rounded(*x)).collect::<Vec<_>>().join(", ")),
    };
    let lines: Vec<String> = settings.iter().map(|s| format!("{} = {}", s.key, value(s))).collect();
    if lines.is_empty() { String::new() } else { format!("[simulation]\n{}\n", lines.join("\n")) }
}

/// Notes on settings of other commands with the same meaning.
pub(super) fn notes(columns: &[ColumnNoise], dt: f64) -> Vec<String> {
    let (gyros, accelerometers) =
        (sensors(columns, SensorKind::Gyro), sensors(columns, SensorKind::Accelerometer));
    let largest = |of: &[&ColumnNoise], noise| values(of, noise, false).and_then(|v| v.first().copied());
    let mut out = Vec::new();
    if let Some(n) = largest(&gyros, NoiseKind::RandomWalk) {
        let step: f64 = 10.0;
        out.push(format!(
            "An angle random walk of {} deg/sqrt(h) is `drift_noise = \"{0} deg/sqrt(h)\"`, or as a bias \
             held for a step of S s 60 N/sqrt(S): \"{} deg/h\" for step_s = {step}. State drift_noise or \
             angle_random_walk_deg_sqrt_h, not both.",
            rounded(n),
            rounded(60.0 * n / step.sqrt()),
        ));
    }
    if let Some(n) = largest(&accelerometers, NoiseKind::RandomWalk) {
        out.push(format!(
            "accelerometer_noise_g is the white noise of one sample, N/sqrt(interval): {} g for rows {} s \
             apart; for means over S s it is {} g/sqrt(S).",
            rounded(per_sample(n, dt)),
            rounded(dt),
            rounded(per_sample(n, 1.0)),
        ));
    }
    if largest(&accelerometers, NoiseKind::RateRandomWalk).is_some() {
        out.push("An acceleration random walk has no key in [simulation]: simulations leave it out.".into());
    }
    for (of, kind) in [(&gyros, "gyros"), (&accelerometers, "accelerometers")] {
        if correlation_s(of).is_some() {
            out.push(format!(
                "The bias instability of {kind} stands for a Gauss-Markov process; its correlation time puts \
                 the largest Allan deviation of the process where the fitted deviation is least."
            ));
        }
    }
    out
}
