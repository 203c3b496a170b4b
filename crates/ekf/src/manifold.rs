//! States that are no vectors: attitudes, say, or an attitude with some constants.

use nalgebra::DVector;

use crate::transition::Transition;

/// A state x with n local coordinates: `x (+) delta` is the state at `delta`, and `x (-) y` where x is as
/// seen from y. The error of an estimate, and its covariance, are in the coordinates about the estimate
/// (Sola, Deray, Atchuthan 2018, arXiv:1812.01537; Hertzberg et al. 2013, doi:10.1016/j.inffus.2011.08.003).
pub trait Manifold: Clone {
    /// The number n of local coordinates.
    fn dimension(&self) -> usize;

    /// `x <- x (+) delta` (shape n).
    fn retract(&mut self, delta: &[f64]);

    /// `self (-) from`: the coordinates (shape n) of this state about `from`, so that `from (+) delta` is
    /// this state.
    fn local(&self, from: &Self) -> Vec<f64>;

    /// The Jacobian, at `delta`, of the coordinates about `x (+) delta` by those about x (n x n): what a
    /// reset does to the covariance. `None` where it is the identity, as for vectors.
    fn transport(&self, delta: &[f64]) -> Option<Transition>;

    /// True if all its numbers are finite.
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
