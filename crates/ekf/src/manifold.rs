//! States that are no vectors: attitudes, say, or an attitude with some constants.

use nalgebra::DVector;

use crate::transition::Transition;

/// State x with n local coordinates: `x (+) delta` is the state with coordinates `delta` about x, and
/// `x (-) y` the coordinates of x about y. The error of an estimate and its covariance are in the
/// coordinates about the estimate (Sola, Deray, Atchuthan 2018, arXiv:1812.01537; Hertzberg et al.
/// 2013, doi:10.1016/j.inffus.2011.08.003).
pub trait Manifold: Clone {
    /// Number n of local coordinates.
    fn dimension(&self) -> usize;

    /// Moves the state: `x <- x (+) delta` (shape n).
    fn retract(&mut self, delta: &[f64]);

    /// Coordinates `self (-) from` (shape n) of this state about `from`, so that `from (+) delta` is
    /// this state.
    fn local(&self, from: &Self) -> Vec<f64>;

    /// Jacobian, at `delta`, of the coordinates about `x (+) delta` with respect to those about x (n x
    /// n): the effect of a reset on the covariance. `None` if it is the identity, as for vectors.
    fn transport(&self, delta: &[f64]) -> Option<Transition>;

    /// True if all numbers of the state are finite.
    fn is_finite(&self) -> bool;
}

impl Manifold for DVector<f64> {
    fn dimension(&self) -> usize {
        self.len()
    }

    fn retract(&mut self, delta: &[f64]) {
        self.iter_mut().zip(delta).for_each(|(x, d)| *x += d);
    }

    fn local(&self, from: &Self) -> Vec<f64> {
        self.iter().zip(from.iter()).map(|(x, y)| x - y).collect()
    }

    fn transport(&self, _: &[f64]) -> Option<Transition> {
        None
    }

    fn is_finite(&self) -> bool {
        self.iter().all(|x| x.is_finite())
    }
}
