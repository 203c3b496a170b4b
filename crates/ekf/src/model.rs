//! Model of a system for a filter: `x' = f(t, x) + w`, `z = h(t, x) + v`.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use crate::covariance::ProcessNoise;
use crate::error::EkfError;
use crate::transition::Transition;

/// Dynamics `x' = f(t, x) + w`, w white of spectral density Q. States are in the units of the model,
/// time in seconds.
pub trait Process {
    /// Number n of states.
    fn states(&self) -> usize;
    /// `f(t, x)` (shape n).
    fn f(&self, t: f64, x: &DVector<f64>) -> DVector<f64>;
    /// `F = df/dx` (n x n).
    fn jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64>;
    /// Spectral density Q of the process noise (n x n), in squared units per second.
    fn noise(&self, t: f64) -> DMatrix<f64>;
}

/// Motion of a state of any kind over a step: the discrete form of a [`Process`], and the only form for
/// a state that is no vector.
pub trait Motion<X> {
    /// Moves `x` from `t` to `t + dt`. Returns the transition of its local coordinates (Phi, n x n,
    /// from those about the state before to those about the state after), and the noise of the step in
    /// the latter.
    ///
    /// # Errors
    /// [`EkfError`] if the model gives a number that is not finite.
    fn advance(&self, t: f64, dt: f64, x: &mut X) -> Result<(Transition, Cow<'_, ProcessNoise>), EkfError>;
}

/// Observation `z = h(t, x) + v`, `v ~ N(0, R)`. For a state that is no vector, H is the derivative
/// with respect to its local coordinates.
pub trait Measurement<X = DVector<f64>> {
    /// Number m of outputs.
    fn outputs(&self) -> usize;
    /// `h(t, x)` (shape m).
    fn h(&self, t: f64, x: &X) -> DVector<f64>;
    /// `H = dh/dx` (m x n).
    fn jacobian(&self, t: f64, x: &X) -> DMatrix<f64>;
    /// Covariance R of the noise (m x m), positive definite.
    fn noise(&self, t: f64) -> DMatrix<f64>;
}

/// Derivative `df/dx` by central differences with steps `step_i` (shape n), for tests of Jacobians.
pub fn central_difference(
    f: impl Fn(&DVector<f64>) -> DVector<f64>,
    x: &DVector<f64>,
    step: &DVector<f64>,
) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = (0..x.len())
        .map(|j| {
            let at = |sign: f64| {
                let mut moved = x.clone();
                moved[j] += sign * step[j];
                f(&moved)
            };
            (at(1.0) - at(-1.0)) / (2.0 * step[j])
        })
        .collect();
    DMatrix::from_columns(&columns)
}
