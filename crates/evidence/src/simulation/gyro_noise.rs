//! Random drift of the gyros by their datasheet. Angle random walk is white drift; rate random walk and bias
//! instability are states behind the unknowns, in the filter and in the truth alike. The bias instability of
//! the accelerometers is coloured noise of Z.
//!
//! The drift of a gyro is `D_F + b_K + b_B` about its input axis, plus the g-sensitive terms. `b_K' = w`,
//! `b_K(0) = 0`, is the rate random walk, `b_B' = -b_B/T + w` the bias instability. Every D is therefore a
//! constant, and D_F is the bias at the *start* of the run, apart from the initial `b_B`. A coefficient is
//! not the bias at the end.

use nalgebra::DMatrix;
use obsdeg_core::model::slew::apply;
use obsdeg_core::model::{Float, Matrix3, local_dynamics};
use obsdeg_ekf::SensorNoise;
use obsdeg_ekf::noise::discretised;

use super::biases::{Bias, NoiseStep, Sensor, root};
use super::error::SimulationError;
use super::noise::Noise;
use super::plan::Plan;
use super::plan::timeline::SegmentKind;

impl Plan {
    /// Input axis of a gyro in platform axes.
    fn input_axis(&self, gyro: usize) -> [f64; 3] {
        self.platform.scheme().geometry.gyros()[gyro].I.vector().map(f64::from)
    }

    /// True if sensors have bias states, or gyros white drift of their own.
    pub(super) fn is_noisy(&self) -> bool {
        !self.biases.is_empty() || self.gyros.iter().any(|g| g.white > 0.0)
    }

    /// Transition and noise covariance `(Phi, Q)` over a step of a segment, by the noise of the gyros. Their
    /// states are psi (in the axes of the unknowns) and the m biases, 3 + m in all. The matrices are exact at
    /// a position. While the platform turns, the step is divided into parts of at most 0.02 rad with the
    /// attitude of their middle.
    pub(super) fn bias_step(&self, segment: usize) -> Result<NoiseStep, SimulationError> {
        let s = &self.segments[segment];
        let n = 3 + self.biases.len();
        let parts = match &s.kind {
            SegmentKind::Dwell => 1,
            SegmentKind::Slew(_) | SegmentKind::Rotation(_) => self.substeps(segment),
        };
        let h = s.dt / parts as f64;
        let (mut phi, mut q) = (DMatrix::identity(n, n), DMatrix::zeros(n, n));
        for i in 0..parts {
            let (f, density) = self.bias_model(&self.attitude(segment, (i as f64 + 0.5) * h));
            let (part, noise) = discretised(&f, &density, h)?;
            q = &part * q * part.transpose() + noise;
            phi = part * phi;
        }
        // psi^n = P psi
        let block = &self.blocks[s.position];
        let mut to_psi = DMatrix::identity(n, n);
        for i in 0..3 {
            for j in 0..3 {
                to_psi[(i, j)] = block.rows[j][i];
            }
        }
        let q = &to_psi * q * to_psi.transpose();
        Ok((&to_psi * phi * to_psi.transpose(), (&q + q.transpose()) / 2.0))
    }

    /// Dynamics F and noise density Q of psi^n and the biases at the attitude `C_c^n`.
    fn bias_model(&self, attitude: &Matrix3<f64>) -> NoiseStep {
        let n = 3 + self.biases.len();
        let (mut f, mut q) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        let local = local_dynamics(&Float, &self.point.w_n, &self.point.w_u);
        for i in 0..3 {
            for j in 0..3 {
                f[(i, j)] = local[i][j];
            }
        }
        let axes: [[f64; 3]; 3] = std::array::from_fn(|g| apply(attitude, &self.input_axis(g)));
        for (axis, gyro) in axes.iter().zip(&self.gyros) {
            for i in 0..3 {
                for j in 0..3 {
                    q[(i, j)] += gyro.white.powi(2) * axis[i] * axis[j];
                }
            }
        }
        for (k, bias) in self.biases.iter().enumerate() {
            if let Sensor::Gyro(gyro) = bias.sensor {
                (0..3).for_each(|i| f[(i, 3 + k)] = axes[gyro][i]);
            }
            f[(3 + k, 3 + k)] = -bias.process.decay;
            q[(3 + k, 3 + k)] = bias.process.density;
        }
        (f, q)
    }

    /// Standard deviations of the biases at the start. A filter needs positive ones: a random walk, which
    /// starts at zero, gets a millionth of its standard deviation after the shortest step.
    pub fn bias_sigmas(&self) -> Vec<f64> {
        let shortest = self.segments.iter().map(|s| s.dt).fold(f64::MAX, f64::min);
        let sigma = |b: &Bias| b.process.variance.max(1e-12 * b.process.density * shortest).sqrt();
        self.biases.iter().map(sigma).collect()
    }

    /// Biases that are drifts of gyros, with their indices.
    pub(super) fn drift_biases(&self) -> impl Iterator<Item = (usize, &Bias)> {
        self.biases.iter().enumerate().filter(|(_, b)| matches!(b.sensor, Sensor::Gyro(_)))
    }

    /// Biases that are errors of accelerometers, with their indices and platform axes.
    pub(super) fn accelerometer_biases(&self) -> impl Iterator<Item = (usize, usize, &Bias)> {
        self.biases.iter().enumerate().filter_map(|(k, b)| match b.sensor {
            Sensor::Accelerometer(axis) => Some((k, axis, b)),
            Sensor::Gyro(_) => None,
        })
    }

    /// Bound (six sigma) on the rate of the biases and white drift of all gyros over a step of `dt`, in
    /// rad/s.
    pub(super) fn random_rate(&self, dt: f64) -> f64 {
        let walked =
            |b: &Bias| if b.process.decay > 0.0 { 0.0 } else { b.process.density * self.duration_s() };
        let bias = |b: &Bias| (b.process.variance + walked(b)).sqrt();
        let white: f64 = self.gyros.iter().map(|g| g.white / dt.sqrt()).sum();
        6.0 * (self.drift_biases().map(|(_, b)| bias(b)).sum::<f64>() + white)
    }
}

/// Gyros of an exact truth, drawn part by part of a step: angle and biases of each together.
#[derive(Debug, Clone)]
pub(super) struct Gyros {
    h: f64,
    /// Transition and root of the noise covariance, `(Phi, root of Q)`, of angle and biases, by gyro.
    steps: Vec<NoiseStep>,
}

impl Gyros {
    /// Gyros for parts of `h` s.
    pub(super) fn new(plan: &Plan, h: f64) -> Self {
        let of = |gyro: &SensorNoise| {
            let (f, q) = gyro.model();
            // NaN ends the run
            let refused = |_| (f.map(|_| f64::NAN), q.map(|_| f64::NAN));
            discretised(&f, &q, h).map_or_else(refused, |(phi, q)| (phi, root(&q)))
        };
        Self { h, steps: plan.gyros.iter().map(of).collect() }
    }

    /// True if the gyros are for parts of `h` s.
    pub(super) fn is_for(&self, h: f64) -> bool {
        self.h == h
    }

    /// Draws one part: advances the biases and adds the mean drift over the part to `drift`, in platform axes
    /// (rad/s).
    pub(super) fn draw(&self, plan: &Plan, biases: &mut [f64], noise: &mut Noise, drift: &mut [f64; 3]) {
        let mut first = 0;
        for (g, (phi, root)) in self.steps.iter().enumerate() {
            let n = phi.nrows();
            let own = &mut biases[first..first + n - 1];
            first += n - 1;
            let kick: Vec<f64> = (0..n).map(|_| noise.normal()).collect();
            let next: Vec<f64> = (0..n)
                .map(|i| {
                    let carried: f64 = own.iter().enumerate().map(|(k, b)| phi[(i, k + 1)] * b).sum();
                    carried + (0..=i).map(|k| root[(i, k)] * kick[k]).sum::<f64>()
                })
                .collect();
            own.copy_from_slice(&next[1..]);
            for (sum, axis) in drift.iter_mut().zip(plan.input_axis(g)) {
                *sum += axis * next[0] / self.h;
            }
        }
        for (k, _, bias) in plan.accelerometer_biases() {
            let left = (-bias.process.decay * self.h).exp();
            biases[k] =
                left * biases[k] + (bias.process.variance * (1.0 - left * left)).sqrt() * noise.normal();
        }
    }
}
