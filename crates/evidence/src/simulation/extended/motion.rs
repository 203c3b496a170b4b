//! Motion of the full attitude along a segment: its equations, their Jacobians and the measurement.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::slew::{apply, cross, rotation_vector, times, transpose};
use obsdeg_core::model::{AZIMUTH, ErrorSource, ErrorTerm, Matrix3, SignedAxis};
use obsdeg_ekf::{EkfError, Measurement, Motion, ProcessNoise, Stage, Transition};

use super::super::conditions::Conditions;
use super::super::limits::MAX_INTEGRATION;
use super::super::plan::Plan;
use super::super::plan::process::G_N;
use super::super::plan::timeline::integration_steps;
use super::super::state::{PlatformState, inverse_left_jacobian, orthonormal};
use super::super::truth::drift_turn;
use obsdeg_ekf::Manifold;

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
    pub(super) plan: &'a Plan,
    pub(super) conditions: &'a Conditions,
    /// Terms by which the constants of the state enter the drift.
    pub(super) terms: &'a [ErrorTerm],
    pub(super) segment: usize,
    /// Matrix from psi in the axes of the unknowns to `psi^n`.
    pub(super) to_n: &'a Matrix3<f64>,
    /// Index of the psi that moves.
    pub(super) block: usize,
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
    pub(in crate::simulation) fn stage(&self) -> &Stage {
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
