//! The fixed-interval smoother of Rauch, Tung and Striebel (1965, doi:10.2514/3.3166), for states of any
//! kind.

use nalgebra::{DMatrix, DVector};

use crate::consistency::Nees;
use crate::covariance::Covariance;
use crate::error::{EkfError, check};
use crate::filter::Filter;
use crate::manifold::Manifold;
use crate::transition::Transition;

/// Record of a filter's run: its predictions and updates in turn.
///
/// ```
/// use nalgebra::{DMatrix, DVector, dmatrix, dvector};
/// use obsdeg_ekf::{CovarianceForm, Filter, FixedInterval, Measurement, Process, Transition};
///
/// /// A random walk, seen every second.
/// struct Walk;
/// impl Process for Walk {
///     fn states(&self) -> usize { 1 }
///     fn f(&self, _: f64, _: &DVector<f64>) -> DVector<f64> { dvector![0.0] }
///     fn jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> { dmatrix![0.0] }
///     fn noise(&self, _: f64) -> DMatrix<f64> { dmatrix![1.0] }
/// }
/// impl Measurement for Walk {
///     fn outputs(&self) -> usize { 1 }
///     fn h(&self, _: f64, x: &DVector<f64>) -> DVector<f64> { x.clone() }
///     fn jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> { dmatrix![1.0] }
///     fn noise(&self, _: f64) -> DMatrix<f64> { dmatrix![1.0] }
/// }
/// let mut filter = Filter::new(dvector![0.0], &dmatrix![1.0], CovarianceForm::Joseph)?;
/// let mut interval = FixedInterval::new(&filter);
/// for (t, z) in [0.3, 1.1, 0.9].into_iter().enumerate() {
///     filter.predict(&Walk, t as f64, 1.0, 1)?;
///     interval.predicted(&filter, Transition::new(&dmatrix![1.0])?);
///     filter.update(&Walk, t as f64 + 1.0, &dvector![z])?;
///     interval.updated(&filter);
/// }
/// let smoothed = interval.smooth()?;
/// assert_eq!(smoothed.len(), 4); // the start, and three moments
/// assert!(smoothed[1].p[(0, 0)] < 0.5);
/// # Ok::<(), obsdeg_ekf::EkfError>(())
/// ```
#[derive(Debug, Clone)]
pub struct FixedInterval<X = DVector<f64>> {
    moments: Vec<Moment<X>>,
}

/// Prediction and updated estimate at one moment.
#[derive(Debug, Clone)]
struct Moment<X> {
    /// Transition Phi from the previous moment.
    phi: Transition,
    predicted: (X, Covariance),
    updated: (X, Covariance),
}

/// Estimate at one moment from all measurements of the interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoothed<X> {
    /// Estimate of the state.
    pub x: X,
    /// Covariance of the error of the estimate (n x n).
    pub p: DMatrix<f64>,
}

impl<X: Manifold> FixedInterval<X> {
    /// Record that starts with the present estimate of the filter.
    pub fn new(filter: &Filter<X>) -> Self {
        let now = state(filter);
        let identity = Transition::identity(filter.covariance().states());
        Self { moments: vec![Moment { phi: identity, predicted: now.clone(), updated: now }] }
    }

    /// Adds a prediction (or jump) of the filter by `phi`.
    pub fn predicted(&mut self, filter: &Filter<X>, phi: Transition) {
        let now = state(filter);
        self.moments.push(Moment { phi, predicted: now.clone(), updated: now });
    }

    /// Replaces the last estimate by the updated one of the filter.
    pub fn updated(&mut self, filter: &Filter<X>) {
        if let Some(last) = self.moments.last_mut() {
            last.updated = state(filter);
        }
    }

    /// Estimates at the start and after every prediction, from all measurements.
    ///
    /// # Errors
    /// [`EkfError`] when a predicted covariance is not positive definite, or a number not finite.
    pub fn smooth(&self) -> Result<Vec<Smoothed<X>>, EkfError> {
        let mut out: Vec<Smoothed<X>> = Vec::with_capacity(self.moments.len());
        for (k, moment) in self.moments.iter().enumerate().rev() {
            let (x, p) = (&moment.updated.0, moment.updated.1.matrix());
            let (Some(later), Some(next)) = (out.last(), self.moments.get(k + 1)) else {
                out.push(Smoothed { x: x.clone(), p });
                continue;
            };
            // C = P Phi^T M^-1, M the predicted covariance: C^T = M^-1 (Phi P)
            let gain = Nees::of_covariance(&next.predicted.1)?.solve(&(next.phi.matrix() * &p)).transpose();
            check("the gain of the smoother", &gain, p.shape())?;
            let error = &gain * DVector::from_vec(later.x.local(&next.predicted.0));
            let difference = &later.p - next.predicted.1.matrix();
            let mut covariance = &p + &gain * difference * gain.transpose();
            let mut smoothed = x.clone();
            smoothed.retract(error.as_slice());
            if let Some(transport) = x.transport(error.as_slice()) {
                let j = transport.matrix();
                covariance = &j * covariance * j.transpose();
            }
            let covariance = (&covariance + covariance.transpose()) / 2.0;
            out.push(Smoothed { x: smoothed, p: covariance });
        }
        out.reverse();
        Ok(out)
    }
}

fn state<X: Manifold>(filter: &Filter<X>) -> (X, Covariance) {
    (filter.x().clone(), filter.covariance().clone())
}
