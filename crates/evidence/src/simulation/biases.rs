//! Biases of sensors as states behind the unknowns.

use nalgebra::DMatrix;
use obsdeg_ekf::{BiasState, SensorNoise};

/// Whose bias it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensor {
    /// A gyro: 0, 1, 2 for X, Y, Z. Its bias is a drift, in rad/s.
    Gyro(usize),
    /// What accelerometers make of a component of Z, in platform axes x, y, z: 0, 1, 2; in g. Three alike and
    /// independent make the same in any axes, so the mounting does not matter.
    Accelerometer(usize),
}

/// A state behind the unknowns: part of the bias of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bias {
    /// Whose.
    pub sensor: Sensor,
    /// Its process.
    pub process: BiasState,
}

/// What of all gyros goes on as states, then what of the accelerometers.
pub(super) fn biases(gyros: &[SensorNoise; 3], accelerometer: &SensorNoise) -> Vec<Bias> {
    let of = |sensor: Sensor, noise: &SensorNoise| {
        noise.states().into_iter().map(move |process| Bias { sensor, process })
    };
    let gyros = gyros.iter().enumerate().flat_map(|(g, noise)| of(Sensor::Gyro(g), noise));
    gyros.chain((0..3).flat_map(|a| of(Sensor::Accelerometer(a), accelerometer))).collect()
}

/// `(Phi, Q)` of some states over a step.
pub(super) type Step = (DMatrix<f64>, DMatrix<f64>);

/// The lower triangular root of a covariance, zero in directions without noise.
pub(super) fn root(q: &DMatrix<f64>) -> DMatrix<f64> {
    let n = q.nrows();
    let mut l = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = q[(i, j)] - (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum::<f64>();
            // a pivot that rounding leaves is no noise
            l[(i, j)] = match (i == j, l[(j, j)]) {
                (true, _) if sum > 1e-13 * q[(i, i)] => sum.sqrt(),
                (false, d) if d > 0.0 => sum / d,
                _ => 0.0,
            };
        }
    }
    l
}
