//! Biases of sensors as states behind the unknowns.

use nalgebra::DMatrix;
use obsdeg_ekf::{BiasState, SensorNoise};

/// Sensor of a bias.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensor {
    /// Gyro X, Y or Z (0, 1, 2). Its bias is a drift, in rad/s.
    Gyro(usize),
    /// Accelerometers along platform axis x, y or z (0, 1, 2), in g, as they enter Z. Three alike and
    /// independent instruments have the same statistics in any axes, so the mounting does not matter.
    Accelerometer(usize),
}

/// State behind the unknowns: part of the bias of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bias {
    /// Sensor of the bias.
    pub sensor: Sensor,
    /// Process of the bias.
    pub process: BiasState,
}

/// Bias states of all gyros, then those of the accelerometers.
pub(super) fn biases(gyros: &[SensorNoise; 3], accelerometer: &SensorNoise) -> Vec<Bias> {
    let of = |sensor: Sensor, noise: &SensorNoise| {
        noise.states().into_iter().map(move |process| Bias { sensor, process })
    };
    let gyros = gyros.iter().enumerate().flat_map(|(g, noise)| of(Sensor::Gyro(g), noise));
    gyros.chain((0..3).flat_map(|a| of(Sensor::Accelerometer(a), accelerometer))).collect()
}

/// Transition and noise covariance `(Phi, Q)` of some states over a step.
pub(super) type NoiseStep = (DMatrix<f64>, DMatrix<f64>);

/// Lower triangular root of a covariance, zero in directions without noise.
pub(super) fn root(q: &DMatrix<f64>) -> DMatrix<f64> {
    let n = q.nrows();
    let mut l = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = q[(i, j)] - (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum::<f64>();
            // a pivot of rounding size is no noise
            l[(i, j)] = match (i == j, l[(j, j)]) {
                (true, _) if sum > 1e-13 * q[(i, i)] => sum.sqrt(),
                (false, d) if d > 0.0 => sum / d,
                _ => 0.0,
            };
        }
    }
    l
}
