//! Truth of a run: the linear model itself, or direction cosines.

use obsdeg_core::model::settings::Truth;
use obsdeg_core::model::slew::{W_IE, apply, cross, rotation, rotation_vector, times, transpose};
use obsdeg_core::model::{AZIMUTH, Carry, Float, Matrix3};
use obsdeg_exact::interrupt;

use super::conditions::Conditions;
use super::error::SimulationError;
use super::gyro_noise::Gyros;
use super::limits::MAX_INTEGRATION;
pub(crate) use super::noise::Noise;
use super::plan::Plan;
use super::plan::process::G_N;
use super::plan::timeline::{SegmentKind, integration_steps};
use super::state::orthonormal;

/// Bound on the angle, in rad, between true and computed platform after `dt` at a drift of `drifts` rad/s; g
/// is one at most.
pub(super) fn drift_turn(drifts: f64, dt: f64) -> f64 {
    (drifts + W_IE) * dt.abs()
}

/// Checks that an exact truth needs few enough integration steps and has no torquer errors in instantaneous
/// turns. `drifts` bounds the rate of the coefficients, in rad/s.
///
/// # Errors
/// [`SimulationError::TooManySteps`].
pub(crate) fn check_drifts(plan: &Plan, conditions: &Conditions, drifts: f64) -> Result<(), SimulationError> {
    if conditions.truth != Truth::Exact {
        return Ok(());
    }
    if plan.torqued_at_once() {
        return Err(SimulationError::TorquedAtOnce);
    }
    let mut turn = 0.0;
    for s in &plan.segments {
        // random drift of a step: six sigma of three axes
        let kick = 11.0 * conditions.drift_noise.held_rad_s(s.dt) + plan.random_rate(s.dt);
        turn += drift_turn(drifts + kick, s.dt) * s.steps as f64;
    }
    integration_steps(turn).map(|_| ())
}

/// Truth that is stepped in time with the filter.
#[derive(Debug, Clone)]
pub struct TruthModel<'a> {
    plan: &'a Plan,
    conditions: &'a Conditions,
    /// True unknowns with the current psi, and biases.
    x: Vec<f64>,
    scratch: Vec<f64>,
    kick: Vec<f64>,
    /// Standard deviations of the components of Z.
    sigmas: Vec<f64>,
    /// Gyros of the exact truth, for the parts of the last step.
    gyros: Option<Gyros>,
    /// Tilt `E = C_p^n C_n^c = exp([psi^n x])` of the exact truth, and its segment.
    exact: Option<(Matrix3<f64>, usize)>,
    /// Largest `|psi|` so far, in rad.
    pub largest_psi: f64,
}

impl<'a> TruthModel<'a> {
    /// Truth that starts from the unknowns and biases `x` (shape n, SI).
    pub fn new(plan: &'a Plan, conditions: &'a Conditions, x: Vec<f64>) -> Self {
        let sigmas = plan.components.iter().map(|&c| Plan::output_sigma(c, conditions)).collect();
        let mut out = Self {
            plan,
            conditions,
            x,
            scratch: Vec::new(),
            kick: Vec::new(),
            sigmas,
            gyros: None,
            exact: None,
            largest_psi: 0.0,
        };
        out.restart();
        out
    }

    /// Restarts the truth from other unknowns.
    pub fn reset(&mut self, x: &[f64]) {
        self.x.copy_from_slice(x);
        self.restart();
    }

    fn restart(&mut self) {
        self.largest_psi = 0.0;
        // C_c^p = exp(-[psi^c x])
        self.exact =
            (self.conditions.truth == Truth::Exact).then(|| (rotation(&self.plan.psi_n(0, &self.x)), 0));
        self.watch(0);
    }

    /// True unknowns with the current psi, and biases.
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    fn watch(&mut self, segment: usize) {
        let length = self.plan.psi_n(segment, &self.x).iter().map(|x| x * x).sum::<f64>().sqrt();
        self.largest_psi = self.largest_psi.max(length);
    }

    /// Moves by one step of a segment and fills `z` for a dwell (shape m). `step` counts within the segment.
    pub fn step(&mut self, segment: usize, step: usize, noise: &mut Noise, z: &mut [f64]) {
        interrupt::check();
        if self.exact.is_some() {
            self.step_exact(segment, step, noise, z);
        } else {
            self.step_linear(segment, noise, z);
        }
        self.watch(segment);
        for (z, sigma) in z.iter_mut().zip(&self.sigmas) {
            *z += sigma * noise.normal();
        }
    }

    fn step_linear(&mut self, segment: usize, noise: &mut Noise, z: &mut [f64]) {
        let stage = &self.plan.stages[segment];
        stage.transition.apply(&mut self.x, &mut self.scratch);
        let plan = self.plan;
        let root = &plan.noise_roots[segment];
        self.kick.clear();
        self.kick.extend((0..root.nrows()).map(|_| noise.normal()));
        let moved = plan.psi_columns(segment).iter().copied().chain(plan.unknowns()..plan.states());
        for (i, c) in moved.enumerate() {
            self.x[c] += (0..=i).map(|k| root[(i, k)] * self.kick[k]).sum::<f64>();
        }
        for (z, output) in z.iter_mut().zip(&stage.outputs) {
            *z = output.predict(&self.x);
        }
    }

    fn step_exact(&mut self, segment: usize, step: usize, noise: &mut Noise, z: &mut [f64]) {
        let plan = self.plan;
        let s = &plan.segments[segment];
        let Some((mut e, before)) = self.exact else { return };
        if plan.segments[before].position != s.position {
            e = self.repositioned(&e, before, segment);
        }
        // drift noise in platform axes: held for one step; a slew has several such steps
        let (parts, held) = self.held(segment);
        let mut kick = [0; 3].map(|_| held * noise.normal());
        let kicked = kick.iter().map(|x| x * x).sum::<f64>().sqrt();
        let drifts = plan.drift_bound(self.coefficients());
        // at most the number checked before the run
        let turn = drift_turn(drifts + kicked + plan.random_rate(s.dt), s.dt);
        let substeps = plan.substeps(segment).max(integration_steps(turn).unwrap_or(MAX_INTEGRATION));
        let of_part = substeps.div_ceil(parts);
        let substeps = parts * of_part;
        let h = s.dt / substeps as f64;
        let gyros = plan
            .is_noisy()
            .then(|| self.gyros.take().filter(|g| g.is_for(h)).unwrap_or_else(|| Gyros::new(plan, h)));
        for i in 0..substeps {
            let t = step as f64 * s.dt + i as f64 * h;
            if i > 0 && i % of_part == 0 {
                kick = [0; 3].map(|_| held * noise.normal());
            }
            let mut drift = kick;
            if let Some(gyros) = &gyros {
                gyros.draw(plan, &mut self.x[plan.unknowns()..], noise, &mut drift);
            }
            e = self.runge_kutta(segment, t, h, &e, &drift);
        }
        self.gyros = gyros;
        self.exact = Some((e, segment));
        let psi_n = rotation_vector(&e);
        let block = &plan.blocks[s.position];
        for (k, &column) in block.columns[..3].iter().enumerate() {
            self.x[column] = (0..3).map(|r| block.rows[r][k] * psi_n[r]).sum();
        }
        // Z^n = C_c^n (f^p + g^c) = g^n - C_c^n g^p, with f^p = -g^p and g^p = C_n^c E^T g^n, plus the error
        // of the accelerometers
        let seen = apply(&transpose(&e), &G_N);
        let c = plan.attitude(segment, (step + 1) as f64 * s.dt);
        let force = apply(&transpose(&c), &seen).map(|x| -x);
        let mut error = plan.accelerometer_error(&c, &force, self.coefficients());
        for (k, axis, _) in plan.accelerometer_biases() {
            let bias = self.x[plan.unknowns() + k];
            (0..3).for_each(|r| error[r] += c[r][axis] * bias);
        }
        for (z, &component) in z.iter_mut().zip(&plan.components) {
            let of_z = |k: usize| G_N[k] - seen[k] + error[k];
            *z = if component == AZIMUTH { psi_n[1] } else { of_z(component - 1) };
        }
    }

    /// Number of draws of the drift noise within a step of a segment, and their standard deviation in rad/s:
    /// a slew has as many draws as a position of its duration has steps, each with its share of the angle
    /// that the filter assumes.
    fn held(&self, segment: usize) -> (usize, f64) {
        let s = &self.plan.segments[segment];
        if !matches!(s.kind, SegmentKind::Slew(_)) {
            return (1, self.conditions.drift_noise.held_rad_s(s.dt));
        }
        let dt = self.conditions.step_s.min(s.dt);
        let parts = (s.dt / dt).ceil();
        (parts as usize, self.conditions.drift_noise.held_rad_s(dt) * (dt * parts / s.dt).sqrt())
    }

    /// Tilt E after an instantaneous change of position, or the unchanged one before a slew.
    fn repositioned(&self, e: &Matrix3<f64>, before: usize, segment: usize) -> Matrix3<f64> {
        let plan = self.plan;
        match plan.platform.scheme().carry {
            // the platform turns by the commanded angle, in its own axes
            Carry::Inertial => *e,
            // C_c^p continues
            Carry::Platform => {
                let (old, new) = (plan.segments[before].position, plan.segments[segment].position);
                let turn = times(&plan.attitudes[new], &transpose(&plan.ends[old]));
                times(&turn, &times(e, &transpose(&turn)))
            }
            Carry::Reset => rotation(&plan.psi_n(segment, &self.x)),
        }
    }

    /// One step of `E' = [(E omega_ie + eps + kick - omega_ie) x] E` in n. The platform turns at the
    /// commanded rate in its own axes, plus its drift; the commanded rate itself drops out.
    fn runge_kutta(&self, segment: usize, t: f64, h: f64, e: &Matrix3<f64>, kick: &[f64; 3]) -> Matrix3<f64> {
        let earth = self.plan.earth_rate();
        let slope = |t: f64, e: &Matrix3<f64>| {
            let c = times(e, &self.plan.attitude(segment, t));
            let rate = || self.plan.torqued_rate(&self.plan.attitude(segment, t), self.plan.turns(segment));
            let (turned, noise, drift) = (apply(e, &earth), apply(&c, kick), self.drift_n(&c, rate));
            times(&cross(&std::array::from_fn(|i| turned[i] - earth[i] + drift[i] + noise[i])), e)
        };
        let moved = |k: &Matrix3<f64>, h: f64| -> Matrix3<f64> {
            std::array::from_fn(|i| std::array::from_fn(|j| e[i][j] + h * k[i][j]))
        };
        let k1 = slope(t, e);
        let k2 = slope(t + h / 2.0, &moved(&k1, h / 2.0));
        let k3 = slope(t + h / 2.0, &moved(&k2, h / 2.0));
        let k4 = slope(t + h, &moved(&k3, h));
        let next: Matrix3<f64> = std::array::from_fn(|i| {
            std::array::from_fn(|j| e[i][j] + h / 6.0 * (k1[i][j] + 2.0 * (k2[i][j] + k3[i][j]) + k4[i][j]))
        });
        orthonormal(&next)
    }

    /// Drift `eps^n = C_p^n E(g^p) D` at the true attitude; torquers have the commanded rate.
    fn drift_n(&self, c: &Matrix3<f64>, rate: impl FnOnce() -> [f64; 3]) -> [f64; 3] {
        let rows = self.plan.platform.errors().drift_rows(&Float, c, rate);
        std::array::from_fn(|r| rows[r].iter().zip(self.coefficients()).map(|(a, d)| a * d).sum())
    }

    /// True coefficients.
    fn coefficients(&self) -> &[f64] {
        let n = self.plan.unknowns();
        &self.x[n - self.plan.platform.coefficients()..n]
    }
}
