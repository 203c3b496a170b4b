//! Random errors of inertial sensors, in the terms of IEEE Std 952-1997, Annex C: white noise, a random walk,
//! bias instability; their states and spectral densities for a filter, and their Allan variances.

use nalgebra::DMatrix;

use crate::error::EkfError;
use crate::integrate::van_loan;

/// Floor of the Allan deviation of flicker noise of coefficient B, divided by B: `sqrt(2 ln 2/pi)`
/// (IEEE Std 952-1997, C.1.1.3).
pub const FLICKER_FLOOR: f64 = 0.664_282_470_267_960_1;
/// Largest Allan deviation of a first-order Gauss-Markov process divided by its standard deviation, at
/// [`MARKOV_PEAK_AT`] correlation times: `0.437 sqrt(2)` (C.1.1.5).
pub const MARKOV_PEAK: f64 = 0.617_364_283_144_441_4;
/// Cluster time of the largest Allan deviation of a Gauss-Markov process, in correlation times.
pub const MARKOV_PEAK_AT: f64 = 1.892_617_832_925_018_8;
/// Standard gravity, in m/s^2.
const STANDARD_GRAVITY: f64 = 9.80665;

/// Random errors of one sensor, in its unit: rad/s for a gyro, g for an accelerometer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorNoise {
    /// White noise N: angle (velocity) random walk, the root of its two-sided density, in unit sqrt(s).
    pub white: f64,
    /// Random walk K of the bias, in unit/sqrt(s).
    pub walk: f64,
    /// Bias instability: the coefficient B of flicker noise, in the unit.
    pub instability: f64,
    /// Correlation time in s of the Gauss-Markov process that represents the bias instability.
    pub correlation_s: f64,
}

/// State of the bias: `b' = -b/time + w`, w white; a random walk has no decay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasState {
    /// Decay rate, one over the correlation time, in 1/s.
    pub decay: f64,
    /// Two-sided density of w, in unit^2/s.
    pub density: f64,
    /// Variance at the start, in unit^2: the stationary one, zero for a random walk.
    pub variance: f64,
}

impl SensorNoise {
    /// Noise of a gyro by its datasheet, in rad/s: angle random walk in deg/sqrt(h), rate random walk
    /// in deg/h/sqrt(h), bias instability in deg/h with a correlation time in s.
    ///
    /// ```
    /// let gyro = obsdeg_ekf::SensorNoise::gyro(0.001, 0.01, 0.003, 3600.0);
    /// // 0.001 deg/sqrt(h) is 0.06 deg/h after a second
    /// assert!((gyro.white.to_degrees() * 3600.0 - 0.06).abs() < 1e-12);
    /// ```
    pub fn gyro(angle_walk: f64, rate_walk: f64, instability: f64, correlation_s: f64) -> Self {
        let dph = 1f64.to_radians() / 3600.0;
        Self {
            white: angle_walk * 60.0 * dph,
            walk: rate_walk * dph / 60.0,
            instability: instability * dph,
            correlation_s,
        }
    }

    /// Noise of an accelerometer by its datasheet, in g: velocity random walk in m/s/sqrt(h),
    /// acceleration random walk in ug/sqrt(h), bias instability in ug with a correlation time in s.
    pub fn accelerometer(velocity_walk: f64, bias_walk: f64, instability: f64, correlation_s: f64) -> Self {
        Self {
            white: velocity_walk / 60.0 / STANDARD_GRAVITY,
            walk: bias_walk * 1e-6 / 60.0,
            instability: instability * 1e-6,
            correlation_s,
        }
    }

    /// Stationary standard deviation of the Gauss-Markov process: its largest Allan deviation is the
    /// floor of the flicker noise that it represents, `0.617 sigma = 0.664 B`.
    pub fn markov_sigma(&self) -> f64 {
        self.instability * FLICKER_FLOOR / MARKOV_PEAK
    }

    /// States of the bias: a random walk, then a Gauss-Markov process, each if present.
    pub fn states(&self) -> Vec<BiasState> {
        let walk = BiasState { decay: 0.0, density: self.walk.powi(2), variance: 0.0 };
        let (decay, variance) = (1.0 / self.correlation_s, self.markov_sigma().powi(2));
        let markov = BiasState { decay, density: 2.0 * variance * decay, variance };
        [walk, markov].into_iter().filter(|s| s.density > 0.0).collect()
    }

    /// Matrix F and density Q of the sensor's integral (an angle, a velocity) and its bias states, in
    /// this order.
    pub fn model(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let states = self.states();
        let n = states.len() + 1;
        let (mut f, mut q) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
        q[(0, 0)] = self.white.powi(2);
        for (i, s) in states.iter().enumerate() {
            f[(0, i + 1)] = 1.0;
            f[(i + 1, i + 1)] = -s.decay;
            q[(i + 1, i + 1)] = s.density;
        }
        (f, q)
    }

    /// Allan variance at a cluster time of `tau` s, in unit^2: `N^2/tau + K^2 tau/3`, and of the Gauss-Markov
    /// process of correlation time T with x = tau/T `2 sigma^2/x (1 - (3 - 4 e^-x + e^-2x)/(2 x))` (C.1.1.1,
    /// C.1.1.4, C.1.1.5).
    pub fn allan_variance(&self, tau: f64) -> f64 {
        let x = tau / self.correlation_s;
        // the difference cancels for a small x
        let markov = if x < 1e-2 {
            2.0 * x / 3.0 * (1.0 - x * (0.75 - x * (0.35 - 0.125 * x)))
        } else {
            2.0 / x * (1.0 - (3.0 - 4.0 * (-x).exp() + (-2.0 * x).exp()) / (2.0 * x))
        };
        let markov = if self.instability > 0.0 { self.markov_sigma().powi(2) * markov } else { 0.0 };
        self.white.powi(2) / tau + self.walk.powi(2) * tau / 3.0 + markov
    }
}

/// Discretisation `(Phi, Q_d)` of `x' = F x + w` over any `dt`: Van Loan's exponential over a part in
/// which nothing decays by more than e, doubled by `Phi(2h) = Phi Phi`, `Q_d(2h) = Phi Q_d Phi^T +
/// Q_d`. (The exponential alone contains `e^(-F dt)`, which overflows after many correlation times.)
///
/// # Errors
/// [`EkfError`] as [`van_loan`].
pub fn discretised(
    f: &DMatrix<f64>,
    q: &DMatrix<f64>,
    dt: f64,
) -> Result<(DMatrix<f64>, DMatrix<f64>), EkfError> {
    let decay = (0..f.nrows().min(f.ncols())).map(|i| f[(i, i)].abs()).fold(0.0, f64::max);
    let doublings = (decay * dt).log2().ceil().clamp(0.0, 1000.0);
    let (mut phi, mut q_d) = van_loan(f, q, dt / doublings.exp2())?;
    for _ in 0..doublings as usize {
        q_d += &phi * &q_d * phi.transpose();
        phi = &phi * &phi;
    }
    let symmetric = (&q_d + q_d.transpose()) / 2.0;
    Ok((phi, symmetric))
}
