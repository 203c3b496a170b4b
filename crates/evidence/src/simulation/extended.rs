//! Extended filter of a platform: its state is the attitude itself, its dynamics are those of direction
//! cosines, and its Jacobians are taken at the estimate. Its equations are written independently of the
//! linear model (6), (8).
//!
//! `E = C_p^n C_n^c = exp([psi^n x])` obeys `E' = [(E omega - omega + eps^n) x] E`, with
//! `eps^n = C_p^n eps^p(g^p)` and `g^p = C_n^p g^n`, and the output is `Z^n = g^n - E^T g^n`. The error is
//! `delta` with `E_true = exp([delta x]) E`, so
//!
//! ```text
//! delta' = -omega x delta + C_p^n Gamma C_n^p [g^n x] delta + N dD
//! dZ^n   = -E^T [g^n x] delta + C_c^n (M(f^p) dK - A C_n^p [g^n x] delta)
//! Gamma = d eps^p / d g^p,  N D = eps^n,  A = d a^p / d f^p,  M K = a^p,  f^p = -C_n^p g^n
//! ```
//!
//! with the error `a^p` of the accelerometers, and `eps^p` a function of the torqued rate too. At `E = 1`,
//! `D = 0` these are the equations of the linear model (`[g^n x] delta` is the change of g in platform axes
//! that turn by `delta`).

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::slew::{apply, cross, rotation_vector, times, transpose};
use obsdeg_core::model::{AZIMUTH, Carry, ErrorSource, ErrorTerm, Matrix3, SignedAxis};
use obsdeg_ekf::{
    Covariance, CovarianceForm, EkfError, Filter, Manifold, Measurement, Motion, ProcessNoise, Stage,
    Transition, Update,
};
use obsdeg_exact::interrupt;

use super::biases::{Bias, Sensor};
use super::conditions::Conditions;
use super::error::SimulationError;
use super::limits::MAX_INTEGRATION;
use super::plan::Plan;
use super::plan::process::G_N;
use super::plan::timeline::integration_steps;
use super::start::RunStart;
use super::state::{PlatformState, inverse_left_jacobian, orthonormal};
use super::truth::drift_turn;

/// Drift `eps^p` (rad/s), or error of the accelerometers (g), in platform axes.
struct Errors {
    /// Sum over all terms.
    sum: [f64; 3],
    /// Derivative of the sum by `g^p`, or by the specific force.
    slope: Matrix3<f64>,
}

/// Errors of the constants `d`, each times its weight. `of` gives the argument of a source in platform axes;
/// `None` switches the source off. The derivative is by the source `by`. `by_d` becomes the contribution of
/// each constant to its platform axis per unit: `(axis, value)`.
fn errors<'a>(
    terms: &[ErrorTerm],
    weights: &[f64],
    d: &[f64],
    of: impl Fn(ErrorSource) -> Option<&'a [f64; 3]>,
    by: ErrorSource,
    by_d: &mut Vec<(usize, f64)>,
) -> Errors {
    let mut out = Errors { sum: [0.0; 3], slope: [[0.0; 3]; 3] };
    by_d.clear();
    let sign = |negative: bool| if negative { -1.0 } else { 1.0 };
    for ((term, weight), d) in terms.iter().zip(weights).zip(d) {
        let axis = term.input.axis;
        let Some(x) = of(term.source) else {
            by_d.push((axis, 0.0));
            continue;
        };
        let along = weight * sign(term.input.negative);
        let factor = |a: &SignedAxis| sign(a.negative) * x[a.axis];
        let excitation = along * term.factors.iter().map(factor).product::<f64>();
        by_d.push((axis, excitation));
        out.sum[axis] += excitation * d;
        if term.source != by {
            continue;
        }
        for (k, one) in term.factors.iter().enumerate() {
            let others = term.factors.iter().enumerate().filter(|(j, _)| *j != k);
            let others: f64 = others.map(|(_, a)| factor(a)).product();
            out.slope[axis][one.axis] += along * sign(one.negative) * others * d;
        }
    }
    out
}

/// Largest turn by drifts in one step, in rad: far beyond the validity of any run.
const MOST_TURN: f64 = 100.0;

/// Attitude `E` and the derivative of the local coordinates by those at the start of the step: three rows, by
/// psi (3) and D (m), or none if they are not requested.
#[derive(Clone)]
struct AttitudeMotion {
    e: Matrix3<f64>,
    rows: Vec<f64>,
}

/// Tilt of the platform in one step, and the propagation of an error of the attitude.
#[derive(Debug, Clone, PartialEq)]
pub struct Tilt {
    /// Tilt `E = C_p^n C_n^c` at the start of the step.
    pub from: Matrix3<f64>,
    /// Tilt `E` at the end of the step.
    pub to: Matrix3<f64>,
    /// Transition of the error `delta` (rad, in n) over the step: `E_true = exp([delta x]) E`.
    pub transition: Matrix3<f64>,
}

/// Motion of one step of a segment in the extended filter.
pub struct PlatformMotion<'a> {
    plan: &'a Plan,
    conditions: &'a Conditions,
    /// Terms by which the constants of the state enter the drift.
    terms: &'a [ErrorTerm],
    segment: usize,
    /// Matrix from psi in the axes of the unknowns to `psi^n`.
    to_n: &'a Matrix3<f64>,
    /// Index of the psi that moves.
    block: usize,
}

impl PlatformMotion<'_> {
    /// Mean remaining fraction of each constant over a step of `dt`: one for a coefficient, less for a
    /// decaying bias.
    fn weights(&self, dt: f64) -> Vec<f64> {
        let mean = |x: f64| if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x };
        let fading = self.plan.biases.iter().map(|b| mean(b.process.decay * dt));
        vec![1.0; self.plan.platform.coefficients()].into_iter().chain(fading).collect()
    }

    /// Time derivative of `moving` at time `t` of the segment.
    fn slope(
        &self,
        t: f64,
        moving: &AttitudeMotion,
        [d, weights]: [&[f64]; 2],
        by_d: &mut Vec<(usize, f64)>,
    ) -> AttitudeMotion {
        let (e, earth) = (&moving.e, self.plan.earth_rate());
        let computed = self.plan.attitude(self.segment, t);
        let c = times(e, &computed);
        let back = transpose(&c);
        let g = apply(&back, &G_N);
        let torqued = self.plan.torqued_rate(&computed, self.plan.turns(self.segment));
        let of = |source: ErrorSource| match source {
            ErrorSource::Gravity => Some(&g),
            ErrorSource::Rate => Some(&torqued),
            ErrorSource::Force => None,
        };
        let drift = errors(self.terms, weights, d, of, ErrorSource::Gravity, by_d);
        let (turned, eps) = (apply(e, &earth), apply(&c, &drift.sum));
        let rate: [f64; 3] = std::array::from_fn(|i| turned[i] - earth[i] + eps[i]);
        // -omega x + C Gamma C^T [g x]
        let (omega, tilted) = (cross(&earth), times(&times(&c, &times(&drift.slope, &back)), &cross(&G_N)));
        let a: Matrix3<f64> = std::array::from_fn(|i| std::array::from_fn(|j| tilted[i][j] - omega[i][j]));
        let width = 3 + d.len();
        let mut rows = vec![0.0; moving.rows.len()];
        for (i, row) in rows.chunks_exact_mut(width).enumerate() {
            for (j, k) in a[i].iter().enumerate() {
                let from = &moving.rows[j * width..(j + 1) * width];
                row.iter_mut().zip(from).for_each(|(x, y)| *x += k * y);
            }
            for (x, &(axis, value)) in row[3..].iter_mut().zip(by_d.iter()) {
                *x += c[i][axis] * value;
            }
        }
        AttitudeMotion { e: times(&cross(&rate), e), rows }
    }
}

impl PlatformMotion<'_> {
    /// Attitude `C_c^n` at the end of a step, the errors of the accelerometers there, and the contribution of
    /// each constant to its platform axis.
    fn accelerometers(
        &self,
        e: &Matrix3<f64>,
        x: &PlatformState,
    ) -> (Matrix3<f64>, Errors, Vec<(usize, f64)>) {
        let c = self.plan.attitude(self.segment, self.plan.segments[self.segment].dt);
        let mut by_k = Vec::new();
        if !self.plan.platform.observed().accelerometers && self.plan.accelerometer_biases().next().is_none()
        {
            return (c, Errors { sum: [0.0; 3], slope: [[0.0; 3]; 3] }, by_k);
        }
        let force = apply(&transpose(&times(e, &c)), &G_N).map(|x| -x);
        let of = |source: ErrorSource| (source == ErrorSource::Force).then_some(&force);
        let weights = vec![1.0; x.constants.len()];
        let found = errors(self.terms, &weights, &x.constants, of, ErrorSource::Force, &mut by_k);
        (c, found, by_k)
    }

    /// Index of the attitude that moves in this segment, from 0.
    pub fn block(&self) -> usize {
        self.block
    }

    /// Psi (rad, in the axes of the unknowns) of the smallest turn of the platform after which gravity is
    /// `seen` (any length, in n): `E^T g^n = seen`, so that `Z^n = g^n - seen`. `None` where `seen` points
    /// straight up.
    pub fn levelled(&self, seen: &[f64; 3]) -> Option<[f64; 3]> {
        let across = apply(&cross(seen), &G_N);
        let sine = across.iter().map(|x| x * x).sum::<f64>().sqrt();
        let cosine: f64 = seen.iter().zip(&G_N).map(|(s, g)| s * g).sum();
        let angle = sine.atan2(cosine);
        if !angle.is_finite() || sine <= 1e-9 * seen.iter().map(|x| x.abs()).sum::<f64>() {
            return (cosine > 0.0).then_some([0.0; 3]);
        }
        Some(apply(&transpose(self.to_n), &across.map(|x| x * angle / sine)))
    }

    /// Stage of the linear model for this segment.
    pub(super) fn stage(&self) -> &Stage {
        &self.plan.stages[self.segment]
    }

    /// Moves `x` by `dt`, without derivatives.
    ///
    /// # Errors
    /// See [`Motion::advance`].
    pub fn carry(&self, t: f64, dt: f64, x: &mut PlatformState) -> Result<(), EkfError> {
        self.integrate(t, dt, x, Vec::new())?;
        self.fade(dt, x);
        Ok(())
    }

    /// Decay of the biases of `x` over `dt`.
    fn fade(&self, dt: f64, x: &mut PlatformState) {
        let behind = x.constants.len() - self.plan.biases.len();
        for (bias, x) in self.plan.biases.iter().zip(&mut x.constants[behind..]) {
            *x *= (-bias.process.decay * dt).exp();
        }
    }

    /// Tilt `E = C_p^n C_n^c` of `x`.
    fn tilted(&self, x: &PlatformState) -> Matrix3<f64> {
        times(self.to_n, &times(&x.attitudes[self.block], &transpose(self.to_n)))
    }

    /// Moves `x` by `dt` and returns the tilt of the platform.
    ///
    /// # Errors
    /// See [`Motion::advance`].
    pub fn tilt(&self, t: f64, dt: f64, x: &mut PlatformState) -> Result<Tilt, EkfError> {
        let (from, width) = (self.tilted(x), 3 + x.constants.len());
        let mut moved = vec![0.0; 3 * width];
        (0..3).for_each(|i| moved[i * width + i] = 1.0);
        let moved = self.integrate(t, dt, x, moved)?;
        self.fade(dt, x);
        let transition = std::array::from_fn(|i| std::array::from_fn(|j| moved[i * width + j]));
        Ok(Tilt { from, to: self.tilted(x), transition })
    }

    /// Turns the psi of `x` that moves by `dt`, and with it the `rows` of local coordinates (in n, as in
    /// [`AttitudeMotion`]).
    fn integrate(
        &self,
        t: f64,
        dt: f64,
        x: &mut PlatformState,
        rows: Vec<f64>,
    ) -> Result<Vec<f64>, EkfError> {
        let (p, d) = (self.to_n, &x.constants[..]);
        let weights = self.weights(dt);
        let back = transpose(p);
        let mut now = AttitudeMotion { e: times(p, &times(&x.attitudes[self.block], &back)), rows };
        let kick = self.conditions.drift_noise.held_rad_s(dt.abs());
        let (coefficients, biases) = d.split_at(self.plan.platform.coefficients());
        let random = self.plan.drift_biases().map(|(k, _)| biases[k].abs()).sum::<f64>();
        let drifts = self.plan.drift_bound(coefficients) + random;
        let turn = drift_turn(drifts + kick, dt);
        if turn.is_nan() || turn > MOST_TURN {
            return Err(EkfError::Diverged {
                what: "the estimated drifts turn the platform by a hundred radians in one step",
            });
        }
        let substeps =
            self.plan.substeps(self.segment).max(integration_steps(turn).unwrap_or(MAX_INTEGRATION));
        let h = dt / substeps as f64;
        let mut by_d = Vec::with_capacity(d.len());
        let add = |y: &mut AttitudeMotion, k: &AttitudeMotion, h: f64| {
            y.e.iter_mut().flatten().zip(k.e.iter().flatten()).for_each(|(x, k)| *x += h * k);
            y.rows.iter_mut().zip(&k.rows).for_each(|(x, k)| *x += h * k);
        };
        let moved = |y: &AttitudeMotion, k: &AttitudeMotion, h: f64| {
            let mut out = y.clone();
            add(&mut out, k, h);
            out
        };
        for i in 0..substeps {
            let t = t + i as f64 * h;
            let mut slope = |t: f64, y: &AttitudeMotion| self.slope(t, y, [d, &weights], &mut by_d);
            let k1 = slope(t, &now);
            let k2 = slope(t + h / 2.0, &moved(&now, &k1, h / 2.0));
            let k3 = slope(t + h / 2.0, &moved(&now, &k2, h / 2.0));
            let k4 = slope(t + h, &moved(&now, &k3, h));
            for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                add(&mut now, &k, h * weight / 6.0);
            }
            now.e = orthonormal(&now.e);
        }
        x.attitudes[self.block] = times(&back, &times(&now.e, p));
        Ok(now.rows)
    }
}

impl Motion<PlatformState> for PlatformMotion<'_> {
    fn advance(
        &self,
        t: f64,
        dt: f64,
        x: &mut PlatformState,
    ) -> Result<(Transition, Cow<'_, ProcessNoise>), EkfError> {
        let width = 3 + x.constants.len();
        let mut moved = vec![0.0; 3 * width];
        (0..3).for_each(|i| moved[i * width + i] = 1.0);
        let moved = self.integrate(t, dt, x, moved)?;
        let (p, back) = (self.to_n, transpose(self.to_n));
        // into the axes of the unknowns
        let (n, first) = (x.dimension(), 3 * x.attitudes.len());
        let mut rows = vec![0.0; 3 * n];
        for (i, row) in rows.chunks_exact_mut(n).enumerate() {
            let entry = |k: usize| (0..3).map(|r| back[i][r] * moved[r * width + k]).sum::<f64>();
            let local: [f64; 3] = std::array::from_fn(entry);
            for j in 0..3 {
                row[3 * self.block + j] = (0..3).map(|r| local[r] * p[r][j]).sum();
            }
            (0..x.constants.len()).for_each(|k| row[first + k] = entry(3 + k));
        }
        let mut active: Vec<usize> = (3 * self.block..3 * self.block + 3).collect();
        // decaying biases
        let behind = n - self.plan.biases.len();
        for (k, bias) in self.plan.biases.iter().enumerate().filter(|(_, b)| b.process.decay > 0.0) {
            let left = (-bias.process.decay * dt).exp();
            x.constants[behind - first + k] *= left;
            active.push(behind + k);
            rows.resize(rows.len() + n, 0.0);
            if let Some(row) = rows.chunks_exact_mut(n).last() {
                row[behind + k] = left;
            }
        }
        let noise = Cow::Borrowed(&self.stage().noise);
        Ok((Transition::of_rows(n, active, rows)?, noise))
    }
}

impl Measurement<PlatformState> for PlatformMotion<'_> {
    fn outputs(&self) -> usize {
        self.plan.components.len()
    }

    fn h(&self, _: f64, x: &PlatformState) -> DVector<f64> {
        let e = self.tilted(x);
        let seen = apply(&transpose(&e), &G_N);
        let (c, errors, _) = self.accelerometers(&e, x);
        let added = apply(&c, &errors.sum);
        let of_z = |k: usize| G_N[k] - seen[k] + added[k];
        let component = |&c: &usize| if c == AZIMUTH { rotation_vector(&e)[1] } else { of_z(c - 1) };
        DVector::from_iterator(self.outputs(), self.plan.components.iter().map(component))
    }

    fn jacobian(&self, _: f64, x: &PlatformState) -> DMatrix<f64> {
        let e = self.tilted(x);
        let horizontal = times(&transpose(&e), &cross(&G_N));
        let (attitude, errors, by_k) = self.accelerometers(&e, x);
        // f^p = -C_n^p g^n turns with delta
        let force = times(&transpose(&times(&e, &attitude)), &cross(&G_N));
        let tilted = times(&attitude, &times(&errors.slope, &force));
        let first = 3 * x.attitudes.len();
        let mut out = DMatrix::zeros(self.outputs(), x.dimension());
        for (i, &c) in self.plan.components.iter().enumerate() {
            let row = if c == AZIMUTH {
                inverse_left_jacobian(&rotation_vector(&e))[1]
            } else {
                for (k, &(axis, value)) in by_k.iter().enumerate() {
                    out[(i, first + k)] = attitude[c - 1][axis] * value;
                }
                std::array::from_fn(|j| -horizontal[c - 1][j] - tilted[c - 1][j])
            };
            for j in 0..3 {
                out[(i, 3 * self.block + j)] = (0..3).map(|r| row[r] * self.to_n[r][j]).sum();
            }
        }
        out
    }

    fn noise(&self, _: f64) -> DMatrix<f64> {
        let sigma = self.plan.components.iter().map(|&c| Plan::output_sigma(c, self.conditions));
        DMatrix::from_diagonal(&DVector::from_iterator(self.outputs(), sigma.map(|s| s * s)))
    }
}

/// Extended filter of a plan, ready to run.
pub struct ExtendedFilter<'a> {
    plan: &'a Plan,
    conditions: &'a Conditions,
    /// Matrix from psi in the axes of the unknowns to `psi^n`, and index of the psi, by position.
    carried: Vec<(Matrix3<f64>, usize)>,
    /// Terms by which the constants of the state enter the drift and Z: coefficients, then biases.
    terms: Vec<ErrorTerm>,
    update: Update,
}

/// Result of a filter after its last step.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterResult {
    /// Estimate at the end.
    pub x: PlatformState,
    /// Covariance of the local coordinates of the estimate.
    pub covariance: Covariance,
    /// Number of linearisations of the whole run: 1 for a filter that makes one pass.
    pub passes: usize,
    /// True if the linearisations converged.
    pub converged: bool,
}

impl<'a> ExtendedFilter<'a> {
    /// Extended filter of `plan`; `update` sets the iterations of a single update.
    ///
    /// # Errors
    /// [`SimulationError::ExactDrift`] unless the unknowns are coefficients.
    pub fn new(plan: &'a Plan, conditions: &'a Conditions, update: Update) -> Result<Self, SimulationError> {
        if !plan.has_coefficients() {
            return Err(SimulationError::ExactDrift);
        }
        if plan.torqued_at_once() {
            return Err(SimulationError::TorquedAtOnce);
        }
        let mut carried: Vec<(Matrix3<f64>, usize)> = Vec::with_capacity(plan.attitudes.len());
        for (i, c) in plan.attitudes.iter().enumerate() {
            carried.push(match (carried.last(), plan.platform.scheme().carry) {
                // psi^c continues
                (Some((before, _)), Carry::Platform) => {
                    (times(c, &times(&transpose(&plan.ends[i - 1]), before)), 0)
                }
                // psi^n continues
                (Some((before, _)), Carry::Inertial) => (*before, 0),
                (None, _) | (_, Carry::Reset) => (*c, i),
            });
        }
        let gyros = plan.platform.scheme().geometry.gyros();
        let bias = |b: &Bias| match b.sensor {
            Sensor::Gyro(gyro) => ErrorTerm::bias(gyros[gyro].I),
            Sensor::Accelerometer(axis) => ErrorTerm {
                source: ErrorSource::Force,
                ..ErrorTerm::bias(SignedAxis { axis, negative: false })
            },
        };
        let terms = plan.platform.error_terms().iter().cloned().chain(plan.biases.iter().map(bias)).collect();
        Ok(Self { plan, conditions, carried, terms, update })
    }

    /// Motion of a segment.
    pub fn motion(&self, segment: usize) -> PlatformMotion<'_> {
        let (to_n, block) = &self.carried[self.plan.segments[segment].position];
        PlatformMotion {
            plan: self.plan,
            conditions: self.conditions,
            terms: &self.terms,
            segment,
            to_n,
            block: *block,
        }
    }

    /// Plan of the filter.
    pub(super) fn plan(&self) -> &'a Plan {
        self.plan
    }

    /// Runs the filter from `start` over the measurements `z`, one per output and step; those of slews are
    /// not used. `on_step` gets the number of every step, the estimate, the covariance of its local
    /// coordinates and the whitened innovations.
    ///
    /// # Errors
    /// [`EkfError`] for a number that is not finite, or if `z` belongs to another run.
    pub fn run(
        &self,
        start: &RunStart,
        z: &[f64],
        mut on_step: impl FnMut(usize, &PlatformState, &Covariance, &[f64]),
    ) -> Result<FilterResult, EkfError> {
        let plan = self.plan;
        let outputs = plan.components.len();
        check_measurements(plan, z)?;
        let mut filter = Filter::new(start.state(plan), &start.variances(), CovarianceForm::Ud)?;
        let mut there = Vec::with_capacity(outputs);
        let mut step = 0;
        for (segment, s) in plan.segments.iter().enumerate() {
            let motion = self.motion(segment);
            for i in 0..s.steps {
                interrupt::check();
                filter.advance(&motion, i as f64 * s.dt, s.dt)?;
                let mut whitened = Vec::new();
                if !plan.stages[segment].outputs.is_empty() {
                    there.clear();
                    there.extend(z[step * outputs..(step + 1) * outputs].iter().copied().map(Some));
                    let t = s.start_s + s.dt * (i + 1) as f64;
                    whitened = filter.update_with(&motion, t, &there, &self.update)?.whitened;
                }
                on_step(step, filter.x(), filter.covariance(), &whitened);
                step += 1;
            }
        }
        let (x, covariance) = (filter.x().clone(), filter.covariance().clone());
        Ok(FilterResult { x, covariance, passes: 1, converged: true })
    }
}

/// Checks that the measurements belong to the steps of `plan`.
pub(super) fn check_measurements(plan: &Plan, z: &[f64]) -> Result<(), EkfError> {
    let (steps, outputs) = (plan.segments.iter().map(|s| s.steps).sum::<usize>(), plan.components.len());
    if z.len() == steps * outputs {
        return Ok(());
    }
    Err(EkfError::Shape {
        what: "z",
        expected: (steps, outputs),
        found: (z.len().div_ceil(outputs), outputs),
    })
}

#[cfg(test)]
mod tests {
    use obsdeg_core::model::settings::{DriftNoise, Truth};
    use obsdeg_core::model::{Path, Rotation, Scheme, parse_attitude};
    use obsdeg_ekf::Manifold;
    use obsdeg_exact::SplitMix64;

    use super::*;
    use crate::simulation::truth::{Noise, TruthModel};

    /// Plan of three positions, the middle one rotating, with terms of every order, and slews if `slew` has a
    /// rate.
    fn plan((carry, slew, azimuth, terms): (Carry, Option<f64>, bool, &str)) -> (Plan, Conditions) {
        let attitudes =
            ["10,25,40", "130,-50,70", "-95,33,-160"].map(|a| parse_attitude(a).expect("an attitude"));
        let mut scheme = Scheme { carry, measured_azimuth: azimuth, ..Scheme::of_angles(attitudes) };
        scheme.unknowns = terms.parse().expect("terms");
        // torquer errors need exact turns
        scheme.path = (terms != GYROS).then_some(Path::Gimbals);
        if terms == GYROS {
            scheme.positions[1].rotation = Some(Rotation::new("Y_p", "140").expect("a rotation"));
        }
        let conditions = Conditions {
            truth: Truth::Exact,
            slew_rate_deg_s: slew,
            dwell_s: 300.0,
            step_s: 60.0,
            drift_noise: DriftNoise::OneStep(0.0),
            accelerometer_noise_g: 1e-15,
            azimuth_noise_deg: 1e-12,
            ..Conditions::default()
        };
        (Plan::new(&scheme, &conditions).expect("a plan"), conditions)
    }

    const GYROS: &str = "F,I,O,S,II,SS,IO";
    const CASES: [(Carry, Option<f64>, bool, &str); 8] = [
        (Carry::Platform, None, false, GYROS),
        (Carry::Inertial, None, true, GYROS),
        (Carry::Reset, None, false, GYROS),
        (Carry::Inertial, Some(1.0), false, GYROS),
        (Carry::Inertial, Some(0.3), true, GYROS),
        (Carry::Inertial, Some(1.0), true, "F,I,O,S,GS,GM,K0,K1,M6,K2,K3,Kx"),
        (Carry::Platform, None, false, "all"),
        (Carry::Reset, None, true, "F,SS,GS,GM3,K0,M3,Kx"),
    ];

    fn random(plan: &Plan, rng: &mut SplitMix64, psi: f64, drift: f64) -> Vec<f64> {
        let mut next = |scale: f64| scale * (2.0 * (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 1.0);
        plan.platform.units().iter().map(|u| next(if *u == "rad" { psi } else { drift })).collect()
    }

    /// Phi and H are the derivatives of motion and output, far from zero, for every kind of segment.
    #[test]
    fn jacobians_are_derivatives() {
        let mut rng = SplitMix64::new(3);
        for case in CASES {
            let (carry, (plan, conditions)) = (case.0, plan(case));
            let filter = ExtendedFilter::new(&plan, &conditions, Update::default()).expect("coefficients");
            let n = plan.states();
            for segment in 0..plan.segments.len() {
                let motion = filter.motion(segment);
                let x = PlatformState::of_unknowns(&random(&plan, &mut rng, 0.3, 1e-4), plan.constants());
                let dt = plan.segments[segment].dt;
                let moved = |x: &PlatformState| {
                    let mut y = x.clone();
                    let phi = motion.advance(0.0, dt, &mut y).expect("finite").0;
                    (y, phi)
                };
                let (end, phi) = moved(&x);
                let (phi, h) = (phi.matrix(), Measurement::jacobian(&motion, 0.0, &end));
                for j in 0..n {
                    let size = if plan.platform.units()[j] == "rad" { 1e-5 } else { 1e-8 };
                    let at = |from: &PlatformState, sign: f64| {
                        let mut delta = vec![0.0; n];
                        delta[j] = sign * size;
                        let mut y = from.clone();
                        y.retract(&delta);
                        y
                    };
                    let ends = [1.0, -1.0].map(|s| DVector::from_vec(moved(&at(&x, s)).0.local(&end)));
                    let found = (&ends[0] - &ends[1]) / (2.0 * size);
                    let scale = phi.column(j).amax().max(1.0);
                    assert!((found - phi.column(j)).amax() < 1e-7 * scale, "{carry} {segment}: Phi, {j}");
                    let seen = [1.0, -1.0].map(|s| motion.h(0.0, &at(&end, s)));
                    let found = (&seen[0] - &seen[1]) / (2.0 * size);
                    assert!((found - h.column(j)).amax() < 1e-8, "{carry} {segment}: H, {j}");
                }
            }
        }
    }

    /// At zero the Jacobians equal those of the linear model of the verdicts, which has its own code for
    /// (1)-(6) and the carries.
    #[test]
    fn at_zero_it_is_the_linear_model() {
        for case in CASES {
            let (carry, (plan, conditions)) = (case.0, plan(case));
            let filter = ExtendedFilter::new(&plan, &conditions, Update::default()).expect("coefficients");
            let n = plan.states();
            let zero = PlatformState::of_unknowns(&vec![0.0; n], plan.constants());
            for (segment, stage) in
                plan.segments.iter().zip(&plan.stages).enumerate().map(|(i, (_, s))| (i, s))
            {
                let motion = filter.motion(segment);
                let phi =
                    motion.advance(0.0, plan.segments[segment].dt, &mut zero.clone()).expect("finite").0;
                let difference = phi.matrix() - stage.transition.matrix();
                assert!(difference.amax() < 1e-9, "{carry} {segment}: {:e}", difference.amax());
                let h = Measurement::jacobian(&motion, 0.0, &zero);
                for (i, output) in stage.outputs.iter().enumerate() {
                    let mut row = DVector::zeros(n);
                    output.h.iter().for_each(|&(j, c)| row[j] += c);
                    assert!((row - h.row(i).transpose()).amax() < 1e-14, "{carry} {segment}: output {i}");
                }
            }
        }
    }

    /// Motion and output equal those of the exact truth, step by step, for large drifts.
    #[test]
    fn it_goes_with_the_exact_truth() {
        let mut rng = SplitMix64::new(5);
        for case in CASES {
            let (carry, (plan, conditions)) = (case.0, plan(case));
            let filter = ExtendedFilter::new(&plan, &conditions, Update::default()).expect("coefficients");
            let start = random(&plan, &mut rng, 0.02, 6e-5);
            let mut truth = TruthModel::new(&plan, &conditions, start.clone());
            let mut x = PlatformState::of_unknowns(&start, plan.constants());
            let mut noise = Noise::new(1, 0);
            for (segment, s) in plan.segments.iter().enumerate() {
                let motion = filter.motion(segment);
                for i in 0..s.steps {
                    let mut z = vec![0.0; plan.stages[segment].outputs.len()];
                    truth.step(segment, i, &mut noise, &mut z);
                    motion.advance(i as f64 * s.dt, s.dt, &mut x).expect("finite");
                    let far =
                        x.unknowns().iter().zip(truth.x()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(far < 1e-11, "{carry} {segment}: {far:e}");
                    for (z, h) in z.iter().zip(motion.h(0.0, &x).iter()) {
                        assert!((z - h).abs() < 1e-11, "{carry} {segment}: {z} {h}");
                    }
                }
            }
            // with fewer drifts psi stays about constant
            assert!(truth.largest_psi > if case.3 == GYROS { 0.03 } else { 0.01 }, "something moved");
        }
    }
}
