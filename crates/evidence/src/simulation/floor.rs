//! Noise floor: the smallest sigma of a coefficient under random drift, and the dwell beyond which longer
//! dwells do not help.
//!
//! All dwells of a scheme are multiplied by a factor, from 1/16 to 256 in steps of sqrt 2 as far as dwells
//! are admitted (on average). For each factor the covariance of the filter runs once, with noise of Z, random
//! drift and biases as in a run, but with a diffuse prior. The least sigma of a coefficient over these dwells
//! is its floor. The dwell beyond which longer dwells do not help is the shortest one with a sigma within 5 %
//! of the floor. A coefficient whose sigma comes that close only in the last two octaves still falls, and has
//! no floor in this range. One that is there at the shortest dwell may have its least sigma at a shorter one.
//! Within a long position samples are merged at constant noise density: twice as many after every 20 steps,
//! from its start and from its end, since the walk erases information in between. All samples count, also
//! those at the start of a position that the record leaves out.
//!
//! # One position in closed form
//! About an axis that the earth does not turn (psi_x at the equator, X_p to the North) `psi' = D + b + w`,
//! `b' = v`, `z = psi + u`, with densities `N^2` of w (angle random walk), `K^2` of v (rate random walk) and
//! `R = sigma_Z^2 dt` of u. With an unknown psi(0) and D, and `b(0) = 0`, D is the rate at the start; by time
//! reversal it is as well known as `D + b` at the end.
//!
//! - Exact observations, R = 0: D is observed through `psi'`, with white noise of density N^2. The Riccati
//!   equation `p' = K^2 - p^2/N^2` from p(0) = infinity has `sigma^2 = K N coth(K T/N)`: the floor is
//!   `sqrt(K N)`, and sigma is within 5 % of it at `T = 1.530 N/K`, where `coth = 1.05^2`.
//! - No angle random walk, N = 0: with `P = U V^-1` the Riccati equation is `U' = F U + Q V`,
//!   `V' = H^T U/R - F^T V`, U(0) = 1, V(0) = 0. In units of `1/lambda = (R/K^2)^(1/4)` every entry obeys
//!   `y'''' = -y`, so with `a = lambda T/sqrt 2`
//!   `sigma^2 = K^(3/2) R^(1/4) sqrt 2 (sinh a cosh a + sin a cos a)/(sinh^2 a - sin^2 a)`: `12 R/T^3` for
//!   short dwells (order one), and a floor of `sqrt 2 K^(3/2) R^(1/4)`.
//! - No rate random walk, K = 0: `sigma^2 = N^2/(T - 2 tau tanh(T/(2 tau)))` with `tau = sqrt R/N`:
//!   `12 R/T^3`, then `N^2/T`, and no floor.

use obsdeg_core::model::settings::DriftNoise;
use obsdeg_core::model::{Scheme, ranges};
use obsdeg_ekf::linear::last_covariance;
use obsdeg_ekf::{CovarianceForm, SquareRootInformation};
use obsdeg_exact::parallel;
use schemars::JsonSchema;
use serde::Serialize;

use super::batch::{batch, wider};
use super::conditions::{Conditions, shown_unit, si_per_shown};
use super::datasheet::GyroNoise;
use super::error::SimulationError;
use super::plan::Plan;
use super::start::RunStart;
use crate::prediction::Prediction;

/// Exponents of the factors on the dwells, as powers of sqrt 2.
const FACTORS: std::ops::RangeInclusive<i32> = -8..=16;
/// Number of steps of one length at either end of a dwell.
const STEPS: usize = 20;
/// Ratio of a diffuse prior to the sigma of the best known unknown.
const WIDTH: f64 = 1e10;
/// Ratio to the floor up to which a sigma counts as having reached it.
const WITHIN: f64 = 1.05;
/// Largest fraction of the longest dwell at which sigma may reach the floor; beyond it sigma still falls.
const SETTLED: f64 = 0.25;

/// Noise floor: the least sigmas of coefficients under random drift, however long the dwells.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NoiseFloor {
    /// Density of the random drift besides the noise of the gyros, in deg/sqrt(h).
    pub drift_noise_deg_sqrt_h: f64,
    /// Noise of the gyros by their datasheet.
    pub gyro_noise: GyroNoise,
    /// Shortest and longest dwell that were examined, in s: the mean of the positions, all in proportion.
    pub dwells_s: [f64; 2],
    /// Noise floor of each coefficient, in model order.
    pub coefficients: Vec<CoefficientFloor>,
}

/// Noise floor of one coefficient, which is a constant: a drift coefficient D_F is the bias at the start of
/// the run.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CoefficientFloor {
    /// Name of the coefficient, as in the model.
    pub name: String,
    /// Unit of the sigmas of the coefficient.
    pub unit: String,
    /// Sigma with the dwells of the scheme, without prior, in the unit of `unit`; null if samples do not
    /// determine it.
    pub sigma: Option<f64>,
    /// Least sigma over all dwells examined, in the unit of `unit`; null if samples do not determine it.
    pub least_sigma: Option<f64>,
    /// Range of dwells in which the least sigma is reached; null if samples do not determine it.
    pub reached: Option<Reached>,
    /// Shortest dwell, in s (mean of the positions), at which sigma is within 5 % of the least; null unless
    /// it lies within the dwells examined.
    pub dwell_s: Option<f64>,
}

/// Range of dwells in which a sigma comes within 5 % of the least.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reached {
    /// Shortest dwell examined: shorter ones may give the same or a smaller sigma.
    AtTheShortest,
    /// Dwell between the shortest and a quarter of the longest examined.
    Within,
    /// Dwell beyond a quarter of the longest examined: sigma still falls.
    StillFalls,
}

/// Noise floor of a scheme; `None` if its gyros have no noise of their own.
///
/// # Errors
/// [`SimulationError`].
pub fn noise_floor(
    scheme: &Scheme,
    conditions: &Conditions,
    prediction: &Prediction,
) -> Result<Option<NoiseFloor>, SimulationError> {
    if conditions.gyro_noise.is_none() {
        return Ok(None);
    }
    let mean = mean_dwell(scheme, conditions);
    let factors = FACTORS.map(|k| 2f64.powf(f64::from(k) / 2.0));
    let factors: Vec<f64> = factors.filter(|f| *f == 1.0 || ranges::DWELL_S.admits(f * mean)).collect();
    let curve = |i: usize| sigmas_without_prior(scheme, conditions, factors[i]);
    let curves: Vec<Vec<f64>> = parallel::try_map(factors.len(), curve)?;
    let plan = Plan::new(scheme, conditions)?;
    let (names, units) = (plan.platform.names(), plan.platform.units());
    let of = |c: usize| {
        let scale = si_per_shown(units[c]);
        let curve: Vec<(f64, f64)> =
            factors.iter().zip(&curves).map(|(f, s)| (f * mean, s[c] / scale)).collect();
        let found = prediction.unknowns[c].determined.then(|| least(&curve));
        CoefficientFloor {
            name: names[c].clone(),
            unit: shown_unit(units[c]).into(),
            sigma: found.and_then(|_| curve.iter().find(|(t, _)| *t == mean).map(|p| p.1)),
            least_sigma: found.map(|f| f.0),
            reached: found.map(|f| f.1),
            dwell_s: found.and_then(|f| (f.1 == Reached::Within).then_some(f.2)),
        }
    };
    Ok(Some(NoiseFloor {
        drift_noise_deg_sqrt_h: conditions.drift_noise.density_deg_sqrt_h(conditions.step_s),
        gyro_noise: conditions.gyro_noise,
        dwells_s: [factors[0] * mean, factors[factors.len() - 1] * mean],
        coefficients: (0..names.len()).filter(|&c| units[c] != "rad").map(of).collect(),
    }))
}

/// Least sigma of a curve of (dwell, sigma), how it is reached, and the shortest dwell within 5 % of it.
fn least(curve: &[(f64, f64)]) -> (f64, Reached, f64) {
    let least = curve.iter().map(|p| p.1).fold(f64::MAX, f64::min);
    let limit = WITHIN * least;
    let longest = curve.last().map_or(0.0, |p| p.0);
    let reached = curve.iter().position(|p| p.1 <= limit).unwrap_or(0);
    let Some(before) = reached.checked_sub(1) else { return (least, Reached::AtTheShortest, curve[0].0) };
    // power law between two dwells
    let ((t0, s0), (t1, s1)) = (curve[before], curve[reached]);
    let dwell = t0 * (t1 / t0).powf((limit / s0).ln() / (s1 / s0).ln());
    (least, if dwell <= SETTLED * longest { Reached::Within } else { Reached::StillFalls }, dwell)
}

/// Mean dwell of the positions, in s.
fn mean_dwell(scheme: &Scheme, conditions: &Conditions) -> f64 {
    let dwells = scheme.positions.iter().map(|p| p.dwell.map_or(conditions.dwell_s, |d| d.seconds()));
    dwells.sum::<f64>() / scheme.positions.len() as f64
}

/// Sigma of every unknown at the end of a run with all dwells times `factor`, with all noise and a diffuse
/// prior, in SI units (shape n).
///
/// # Errors
/// [`SimulationError`].
pub fn sigmas_without_prior(
    scheme: &Scheme,
    conditions: &Conditions,
    factor: f64,
) -> Result<Vec<f64>, SimulationError> {
    let scaled = scheme.with_dwells(conditions.dwell_s, factor)?;
    let density = conditions.drift_noise.density_deg_sqrt_h(conditions.step_s);
    let drift_noise = DriftNoise::RandomWalk(density);
    // one step per position, which is then divided into parts
    let whole = Conditions { step_s: f64::MAX, settle_s: 0.0, drift_noise, ..conditions.clone() };
    let plan = Plan::derived(&scaled, &whole)?;
    let mut plan = plan.in_steps(&whole, |s| parts(s.steps as f64 * s.dt, conditions.step_s))?;
    for (stage, segment) in plan.stages.iter_mut().zip(&plan.segments) {
        // samples of one longer step are merged
        let dwell = scaled.positions[segment.position].dwell.map_or(segment.dt, |d| d.seconds());
        for output in &mut stage.outputs {
            output.r *= own_step(dwell, conditions.step_s) / segment.dt;
        }
    }
    let mut sigma = wide_prior(&plan, &whole)?;
    sigma.extend(plan.bias_sigmas());
    let prior = RunStart { truth: Vec::new(), estimate: Vec::new(), sigma }.covariance(CovarianceForm::Ud)?;
    let mut last = last_covariance(&plan.stages, prior)?.sigmas();
    last.truncate(plan.unknowns());
    Ok(last)
}

/// Standard deviations of a prior that is diffuse beside the samples of `plan` under random drift (shape n).
/// The factor grows with the random drift of the run, which weakens the samples.
///
/// # Errors
/// [`SimulationError::Filter`] for a number that is not finite.
pub(super) fn wide_prior(plan: &Plan, conditions: &Conditions) -> Result<Vec<f64>, SimulationError> {
    let information = batch(plan, SquareRootInformation::none(plan.unknowns()))?.information;
    let duration = plan.duration_s();
    let density = DriftNoise::RandomWalk(conditions.drift_noise.density_deg_sqrt_h(conditions.step_s));
    let random = plan.random_rate(duration) + 6.0 * density.held_rad_s(duration);
    let width = WIDTH * (1.0 + random * duration / conditions.accelerometer_noise_g);
    Ok(wider(plan, &information, width, width))
}

/// Length, in s, of the equal steps of at most `step` that a dwell is divided into.
fn own_step(dwell: f64, step: f64) -> f64 {
    dwell / (dwell / step - 1e-9).ceil().max(1.0)
}

/// Parts of a dwell as (number of steps, step in s): the step doubles from part to part, from both ends.
fn parts(dwell: f64, step: f64) -> Vec<(usize, f64)> {
    let (mut dt, mut left) = (own_step(dwell, step), dwell);
    let mut ends = Vec::new();
    while left > 4.0 * STEPS as f64 * dt {
        ends.push((STEPS, dt));
        left -= 2.0 * STEPS as f64 * dt;
        dt *= 2.0;
    }
    let middle = (left / dt - 1e-9).ceil().max(1.0);
    let back: Vec<_> = ends.iter().rev().copied().collect();
    ends.push((middle as usize, left / middle));
    ends.extend(back);
    ends
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_the_dwell() {
        for (dwell, step) in
            [(1000.0, 10.0), (100.0, 10.0), (5.0, 10.0), (256_000.0, 10.0), (12_345.0, 7.0), (1e9, 1e-6)]
        {
            let parts = parts(dwell, step);
            let total: f64 = parts.iter().map(|(n, dt)| *n as f64 * dt).sum();
            assert!((total / dwell - 1.0).abs() < 1e-12, "{dwell} {step}: {total}");
            let steps: usize = parts.iter().map(|p| p.0).sum();
            assert!(steps <= 2500, "{dwell} {step}: {steps}");
            // at its ends it has the usual step, and nowhere a step much longer than the distance from them
            assert_eq!(parts[0].1, own_step(dwell, step));
            let mut t = 0.0f64;
            for (n, dt) in &parts {
                let distance = t.min(dwell - t - *n as f64 * dt);
                assert!(
                    *dt <= own_step(dwell, step) * (1.0 + 1e-12) || *dt <= distance / 8.0,
                    "{dwell} {step}: {dt} at {t}"
                );
                t += *n as f64 * dt;
            }
        }
        assert_eq!(parts(100.0, 10.0), [(10, 10.0)]);
    }

    #[test]
    fn the_least_of_a_curve() {
        let dwells = (0..10).map(|k| 2f64.powi(k));
        let curve =
            |f: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> { dwells.clone().map(|t| (t, f(t))).collect() };
        // a power law still falls; a curve that rises again has its least value in between
        assert_eq!(least(&curve(&|t| 1.0 / t)).1, Reached::StillFalls);
        let (found, reached, dwell) = least(&curve(&|t| if t < 8.0 { 8.0 / t } else { t / 8.0 }));
        assert_eq!((found, reached), (1.0, Reached::Within));
        assert!((dwell - 8.0 / 1.05).abs() < 1e-9, "{dwell}");
        assert_eq!(least(&curve(&|_| 3.0)), (3.0, Reached::AtTheShortest, 1.0));
        assert_eq!(least(&curve(&|t| t)), (1.0, Reached::AtTheShortest, 1.0));
    }
}
