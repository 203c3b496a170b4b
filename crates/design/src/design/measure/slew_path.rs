//! Slew path: the effect on psi of a turn that takes time, from one candidate to another.

use obsdeg_core::model::Matrix3;
use obsdeg_core::model::slew::{Slew, Turn};

/// Largest turn of an integration step, in rad.
const TURN_STEP: f64 = 0.05;

/// Effect of the turn from one candidate to another.
#[derive(Debug, Clone)]
pub(crate) struct SlewPath {
    pub(crate) seconds: f64,
    /// `psi^n` after the turn as a function of `psi^n` before it.
    pub(crate) phi: Matrix3<f64>,
    /// `psi^n` after the turn as a function of the coefficients (3 x d).
    pub(crate) drift: [Vec<f64>; 3],
    /// `psi^n` after the turn as a function of the errors that are not estimated and count (3 x
    /// errors).
    pub(crate) omitted: [Vec<f64>; 3],
    /// Axis and angle; `None` where both attitudes are the same.
    pub(crate) turn: Option<Turn>,
    /// Opposite path of a half turn; `None` for other turns.
    pub(crate) other: Option<Box<Self>>,
}

impl SlewPath {
    /// Path between equal attitudes, for `d` coefficients.
    pub(crate) fn none(d: usize) -> Self {
        let phi = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
        let drift = std::array::from_fn(|_| vec![0.0; d]);
        Self { seconds: 0.0, phi, drift, omitted: Default::default(), turn: None, other: None }
    }

    /// Integrates `X' = W X + [0 | C(t) E(g(t))]` from `X = [1 | 0]` by Runge-Kutta: psi^n after a turn
    /// as a function of psi^n before it and of the coefficients. `drift_at` is `C E(g)` (3 x d) at a
    /// time in s, followed by the columns of errors that are not estimated.
    pub(crate) fn along(
        slew: &Slew,
        w: &Matrix3<f64>,
        d: usize,
        drift_at: impl Fn(f64) -> [Vec<f64>; 3],
    ) -> Self {
        let steps = (slew.turned(slew.duration_s) / TURN_STEP).ceil().max(1.0);
        let dt = slew.duration_s / steps;
        let mut before = drift_at(0.0);
        let n = 3 + before[0].len();
        let slope = |x: &[Vec<f64>; 3], drift: &[Vec<f64>; 3]| -> [Vec<f64>; 3] {
            std::array::from_fn(|i| {
                let own = |k: usize| if k < 3 { 0.0 } else { drift[i][k - 3] };
                (0..n).map(|k| own(k) + (0..3).map(|j| w[i][j] * x[j][k]).sum::<f64>()).collect()
            })
        };
        let moved = |x: &[Vec<f64>; 3], k: &[Vec<f64>; 3], h: f64| -> [Vec<f64>; 3] {
            std::array::from_fn(|i| x[i].iter().zip(&k[i]).map(|(x, k)| x + h * k).collect())
        };
        let mut x: [Vec<f64>; 3] =
            std::array::from_fn(|i| (0..n).map(|k| f64::from(u8::from(i == k))).collect());
        for step in 0..steps as usize {
            let t = step as f64 * dt;
            let (middle, after) = (drift_at(t + dt / 2.0), drift_at(t + dt));
            let k1 = slope(&x, &before);
            let k2 = slope(&moved(&x, &k1, dt / 2.0), &middle);
            let k3 = slope(&moved(&x, &k2, dt / 2.0), &middle);
            let k4 = slope(&moved(&x, &k3, dt), &after);
            for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                x = moved(&x, &k, weight * dt / 6.0);
            }
            before = after;
        }
        Self {
            // durations are compared: rounding must not make them differ
            seconds: (slew.duration_s * 1e9).round() / 1e9,
            phi: std::array::from_fn(|i| std::array::from_fn(|j| x[i][j])),
            drift: std::array::from_fn(|i| x[i][3..3 + d].to_vec()),
            omitted: std::array::from_fn(|i| x[i][3 + d..].to_vec()),
            turn: Some(slew.turn()),
            other: None,
        }
    }
}
