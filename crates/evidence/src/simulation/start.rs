//! Start of a run: truth, estimate and prior of every state.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::settings::Truth;
use obsdeg_ekf::{Covariance, CovarianceForm};

use super::conditions::{Conditions, ESTIMATE, PRIOR, TRUE_VALUE, is_rate, resolve, si_per_shown};
use super::error::SimulationError;
use super::plan::Plan;
use super::state::PlatformState;

/// Start of a run in SI units (shape n each: the unknowns, then the biases).
#[derive(Debug, Clone, PartialEq)]
pub struct RunStart {
    /// True values.
    pub truth: Vec<f64>,
    /// Initial estimates.
    pub estimate: Vec<f64>,
    /// Standard deviations of the initial estimates.
    pub sigma: Vec<f64>,
}

impl RunStart {
    /// Start of the unknowns of `plan` by the conditions.
    ///
    /// # Errors
    /// [`SimulationError`] for unknown names, and for an exact truth without coefficients.
    pub fn new(plan: &Plan, conditions: &Conditions) -> Result<Self, SimulationError> {
        if conditions.truth == Truth::Exact && !plan.has_coefficients() {
            return Err(SimulationError::ExactDrift);
        }
        let p = &plan.platform;
        let si = |values: Vec<f64>, scaled: bool| -> Vec<f64> {
            let units = p.units().iter();
            let scale = |u: &str| if scaled && is_rate(u) { conditions.drift_scale } else { 1.0 };
            units.zip(values).map(|(u, v)| v * si_per_shown(u) * scale(u)).collect()
        };
        let sigma = resolve(PRIOR, p, &conditions.priors, 1.0)?;
        let mut out = Self {
            truth: si(resolve(TRUE_VALUE, p, &conditions.values, 0.0)?, true),
            estimate: si(resolve(ESTIMATE, p, &conditions.estimates, 0.0)?, false),
            sigma: si(sigma, true),
        };
        let biases = plan.bias_sigmas();
        out.truth.extend(biases.iter().map(|_| 0.0));
        out.estimate.extend(biases.iter().map(|_| 0.0));
        out.sigma.extend(biases);
        Ok(out)
    }

    /// Initial covariance.
    ///
    /// # Errors
    /// [`SimulationError::Filter`].
    pub fn covariance(&self, form: CovarianceForm) -> Result<Covariance, SimulationError> {
        Ok(Covariance::new("P0", &self.variances(), form)?)
    }

    /// Initial variances (n x n, diagonal).
    pub(super) fn variances(&self) -> DMatrix<f64> {
        DMatrix::from_diagonal(&DVector::from_iterator(self.sigma.len(), self.sigma.iter().map(|s| s * s)))
    }

    /// Initial estimate as the state of a filter with full attitudes.
    pub(super) fn state(&self, plan: &Plan) -> PlatformState {
        PlatformState::of_unknowns(&self.estimate, plan.constants())
    }
}
