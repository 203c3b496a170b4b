//! Extended filter of a platform: its state is the attitude itself, its dynamics are those of direction
//! cosines, and its Jacobians are taken at the estimate. Its equations are written independently of the
//! linear model (6), (8).
//!
//! `E = C_p^n C_n^c = exp([psi^n x])` obeys `E' = [(E omega - omega + eps^n) x] E`, with
//! `eps^n = C_p^n eps^p(g^p)` and `g^p = C_n^p g^n`, and the output is `Z^n = g^n - E^T g^n`. The error is
//! `delta` with `E_true = exp([delta x]) E`, so
//!
//! ```text
//! delta' = -omega x delta + C_p^n Gamma C_n^p [g^n x] delta + N dD
//! dZ^n   = -E^T [g^n x] delta + C_c^n (M(f^p) dK - A C_n^p [g^n x] delta)
//! Gamma = d eps^p / d g^p,  N D = eps^n,  A = d a^p / d f^p,  M K = a^p,  f^p = -C_n^p g^n
//! ```
//!
//! with the error `a^p` of the accelerometers, and `eps^p` a function of the torqued rate too. At `E = 1`,
//! `D = 0` these are the equations of the linear model (`[g^n x] delta` is the change of g in platform axes
//! that turn by `delta`).

pub(crate) mod motion;

use obsdeg_core::model::slew::{times, transpose};
use obsdeg_core::model::{Carry, ErrorSource, ErrorTerm, Matrix3, SignedAxis};
use obsdeg_ekf::{Covariance, CovarianceForm, EkfError, Filter, Update};
use obsdeg_exact::interrupt;

use super::biases::{Bias, Sensor};
use super::conditions::Conditions;
use super::error::SimulationError;
use super::plan::Plan;
use super::start::RunStart;
use super::state::PlatformState;
use motion::PlatformMotion;

/// Extended filter of a plan, ready to run.
pub struct ExtendedFilter<'a> {
    plan: &'a Plan,
    conditions: &'a Conditions,
    /// Matrix from psi in the axes of the unknowns to `psi^n`, and index of the psi, by position.
    carried: Vec<(Matrix3<f64>, usize)>,
    /// Terms by which the constants of the state enter the drift and Z: coefficients, then biases.
    terms: Vec<ErrorTerm>,
    update: Update,
}

/// Result of a filter after its last step.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterResult {
    /// Estimate at the end.
    pub x: PlatformState,
    /// Covariance of the local coordinates of the estimate.
    pub covariance: Covariance,
    /// Number of linearisations of the whole run: 1 for a filter that makes one pass.
    pub passes: usize,
    /// True if the linearisations converged.
    pub converged: bool,
}

impl<'a> ExtendedFilter<'a> {
    /// Extended filter of `plan`; `update` sets the iterations of a single update.
    ///
    /// # Errors
    /// [`SimulationError::ExactDrift`] unless the unknowns are coefficients.
    pub fn new(plan: &'a Plan, conditions: &'a Conditions, update: Update) -> Result<Self, SimulationError> {
        if !plan.has_coefficients() {
            return Err(SimulationError::ExactDrift);
        }
        if plan.torqued_at_once() {
            return Err(SimulationError::TorquedAtOnce);
        }
        let mut carried: Vec<(Matrix3<f64>, usize)> = Vec::with_capacity(plan.attitudes.len());
        for (i, c) in plan.attitudes.iter().enumerate() {
            carried.push(match (carried.last(), plan.platform.scheme().carry) {
                // psi^c continues
                (Some((before, _)), Carry::Platform) => {
                    (times(c, &times(&transpose(&plan.ends[i - 1]), before)), 0)
                }
                // psi^n continues
                (Some((before, _)), Carry::Inertial) => (*before, 0),
                (None, _) | (_, Carry::Reset) => (*c, i),
            });
        }
        let gyros = plan.platform.scheme().geometry.gyros();
        let bias = |b: &Bias| match b.sensor {
            Sensor::Gyro(gyro) => ErrorTerm::bias(gyros[gyro].I),
            Sensor::Accelerometer(axis) => ErrorTerm {
                source: ErrorSource::Force,
                ..ErrorTerm::bias(SignedAxis { axis, negative: false })
            },
        };
        let terms = plan.platform.error_terms().iter().cloned().chain(plan.biases.iter().map(bias)).collect();
        Ok(Self { plan, conditions, carried, terms, update })
    }

    /// Motion of a segment.
    pub fn motion(&self, segment: usize) -> PlatformMotion<'_> {
        let (to_n, block) = &self.carried[self.plan.segments[segment].position];
        PlatformMotion {
            plan: self.plan,
            conditions: self.conditions,
            terms: &self.terms,
            segment,
            to_n,
            block: *block,
        }
    }

    /// Plan of the filter.
    pub(super) fn plan(&self) -> &'a Plan {
        self.plan
    }

    /// Runs the filter from `start` over the measurements `z`, one per output and step; those of slews are
    /// not used. `on_step` gets the number of every step, the estimate, the covariance of its local
    /// coordinates and the whitened innovations.
    ///
    /// # Errors
    /// [`EkfError`] for a number that is not finite, or if `z` belongs to another run.
    pub fn run(
        &self,
        start: &RunStart,
        z: &[f64],
        mut on_step: impl FnMut(usize, &PlatformState, &Covariance, &[f64]),
    ) -> Result<FilterResult, EkfError> {
        let plan = self.plan;
        let outputs = plan.components.len();
        check_measurements(plan, z)?;
        let mut filter = Filter::new(start.state(plan), &start.variances(), CovarianceForm::Ud)?;
        let mut there = Vec::with_capacity(outputs);
        let mut step = 0;
        for (segment, s) in plan.segments.iter().enumerate() {
            let motion = self.motion(segment);
            for i in 0..s.steps {
                interrupt::check();
                filter.advance(&motion, i as f64 * s.dt, s.dt)?;
                let mut whitened = Vec::new();
                if !plan.stages[segment].outputs.is_empty() {
                    there.clear();
                    there.extend(z[step * outputs..(step + 1) * outputs].iter().copied().map(Some));
                    let t = s.start_s + s.dt * (i + 1) as f64;
                    whitened = filter.update_with(&motion, t, &there, &self.update)?.whitened;
                }
                on_step(step, filter.x(), filter.covariance(), &whitened);
                step += 1;
            }
        }
        let (x, covariance) = (filter.x().clone(), filter.covariance().clone());
        Ok(FilterResult { x, covariance, passes: 1, converged: true })
    }
}

/// Checks that the measurements belong to the steps of `plan`.
pub(super) fn check_measurements(plan: &Plan, z: &[f64]) -> Result<(), EkfError> {
    let (steps, outputs) = (plan.segments.iter().map(|s| s.steps).sum::<usize>(), plan.components.len());
    if z.len() == steps * outputs {
        return Ok(());
    }
    Err(EkfError::Shape {
        what: "z",
        expected: (steps, outputs),
        found: (z.len().div_ceil(outputs), outputs),
    })
}

#[cfg(test)]
mod tests;
