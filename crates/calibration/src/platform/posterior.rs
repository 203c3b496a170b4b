//! Samples of the posterior of an estimate with curvature: randomise, then optimise (Bardsley, Solonen,
//! Haario, Laine 2014, doi:10.1137/140964023).
//!
//! All residuals in sigma, with those of priors, are a function `r(x)`; at the estimate its derivative is
//! `-J = -Q R`. Each sample solves `Q^T r(x) = -eps` with `eps` standard normal. The density of the posterior
//! over that of the samples is its weight, `exp(-(|r|^2 - |eps|^2)/2) / |det(Q^T J(x))|`, so weighted means
//! are those of the posterior whatever the curvature. In a linear problem all weights are equal.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use obsdeg_evidence::simulation::Noise;

use super::CalibrationError;
use super::estimate::{BOX, LinearisedRecord, LinearisedRuns, PlatformEstimate, PlatformProblem, TURN};
use crate::least_squares::{Linearised, RunState, StartInformation};

/// Most linearisations of a sample.
const PASSES: usize = 25;
/// Length, in sigma, of what a sample leaves of its equation.
const SOLVED: f64 = 1e-2;
/// Most halvings of a step that leads away.
const HALVINGS: usize = 8;

/// Sample of a posterior.
pub(super) struct PosteriorSample {
    /// Unknowns, relative to the estimate.
    pub x: DVector<f64>,
    /// Logarithm of its weight, relative to that of the estimate.
    pub weight: f64,
}

/// Equation of the samples: the derivative of all residuals at the estimate.
pub(super) struct Equation {
    /// Its product with the weights of the measurements (rows x states), by run.
    weighted: Vec<DMatrix<f64>>,
    /// Rows of the box and the stated priors, and of the prior information.
    beside: [DMatrix<f64>; 2],
    /// Root of the information on the unknowns.
    root: Cholesky<f64, Dyn>,
}

/// Change of all outputs of a run by each state of its start (rows x states).
fn derivative(run: &Linearised) -> DMatrix<f64> {
    let n = run.states();
    let mut out = DMatrix::zeros(run.residuals.len(), n);
    for state in 0..n {
        let mut start = vec![0.0; n];
        start[state] = 1.0;
        let mut row = 0;
        run.carried(&start, |step, d| {
            for output in &run.stages[step].outputs {
                out[(row, state)] = output.h.iter().map(|&(j, c)| c * d[j]).sum();
                row += 1;
            }
        });
    }
    out
}

/// Residuals of a run that starts at zero times the inverse of their covariance, with the random drift.
fn weighted(run: &Linearised, residuals: &[f64]) -> Result<DVector<f64>, CalibrationError> {
    let n = run.states();
    let run = Linearised { residuals: residuals.to_vec(), ..run.clone() };
    let start = RunState { correction: DVector::zeros(n), root: DMatrix::zeros(n, 0) };
    let states = StartInformation::of(&run)?.states(&run, start)?;
    let mut out = Vec::with_capacity(residuals.len());
    for (stage, state) in run.stages.iter().zip(&states[1..]) {
        for output in &stage.outputs {
            let seen: f64 = output.h.iter().map(|&(j, c)| c * state.correction[j]).sum();
            out.push((residuals[out.len()] - seen) / output.r);
        }
    }
    Ok(DVector::from_vec(out))
}

/// Normal vectors in pairs of opposite sign (n x `pairs` of one sign), scaled so that their covariance is
/// exactly the identity: a linear problem has exactly its own covariance then. Needs as many pairs as n.
pub(super) fn normal_pairs(n: usize, pairs: usize, noise: &mut Noise) -> Option<DMatrix<f64>> {
    let all = DMatrix::from_fn(n, pairs, |_, _| noise.normal());
    let root = (&all * all.transpose() / pairs as f64).cholesky()?;
    root.l_dirty().solve_lower_triangular(&all)
}

impl PlatformProblem<'_> {
    /// Equation of the samples about an estimate; `None` if its information is singular.
    ///
    /// # Errors
    /// [`CalibrationError`] when a number is not finite.
    pub(super) fn equation(&self, estimate: &PlatformEstimate) -> Result<Option<Equation>, CalibrationError> {
        let mut all = Vec::with_capacity(self.runs.len());
        for LinearisedRecord { run, .. } in &estimate.at.runs {
            let own = derivative(run);
            let columns = own.column_iter().map(|c| weighted(run, c.into_owned().as_slice()));
            let columns = columns.collect::<Result<Vec<_>, _>>()?;
            all.push(DMatrix::from_columns(&columns));
        }
        let none = DMatrix::zeros(0, self.unknowns.n);
        let known = self.known.as_ref().map_or(none, |k| k.rows.clone());
        let beside = [self.unknowns.constraint_rows(BOX), known];
        let information = self.slope(&all, &beside, &estimate.at);
        let symmetric = (&information + information.transpose()) / 2.0;
        Ok(symmetric.cholesky().map(|root| Equation { weighted: all, beside, root }))
    }

    /// `J^T J(x)`, with J that of the estimate.
    fn slope(
        &self,
        weighted: &[DMatrix<f64>],
        beside: &[DMatrix<f64>; 2],
        at: &LinearisedRuns,
    ) -> DMatrix<f64> {
        let mut out: DMatrix<f64> = beside.iter().map(|rows| rows.transpose() * rows).sum();
        for ((LinearisedRecord { run, .. }, weighted), index) in
            at.runs.iter().zip(weighted).zip(&self.unknowns.index)
        {
            let own = weighted.transpose() * derivative(run);
            for (a, &i) in index.iter().enumerate() {
                index.iter().enumerate().for_each(|(b, &j)| out[(i, j)] += own[(a, b)]);
            }
        }
        out
    }

    /// `J^T r(x)`, with J that of the estimate.
    fn pull(&self, of: &Equation, at: &LinearisedRuns) -> DVector<f64> {
        let [constraining, known] = &of.beside;
        let mut out = constraining.transpose() * self.constraint_residuals(constraining, &at.x)
            + known.transpose() * self.known_left(known, &at.x);
        for ((LinearisedRecord { run, .. }, weighted), index) in
            at.runs.iter().zip(&of.weighted).zip(&self.unknowns.index)
        {
            let own = weighted.transpose() * DVector::from_column_slice(&run.residuals);
            index.iter().enumerate().for_each(|(a, &i)| out[i] += own[a]);
        }
        out
    }

    /// Sample for `eps`; `None` if its equation is not solved.
    pub(super) fn sample(
        &self,
        of: &Equation,
        estimate: &PlatformEstimate,
        eps: &DVector<f64>,
    ) -> Option<PosteriorSample> {
        let towards = of.root.l_dirty().lower_triangle() * eps;
        // what is left of the equation, in sigma
        let left =
            |at: &LinearisedRuns| of.root.l_dirty().solve_lower_triangular(&(self.pull(of, at) + &towards));
        let mut at = self.at(estimate.at.x.clone()).ok()?;
        let mut length = left(&at)?.norm();
        for _ in 0..PASSES {
            let slope = self.slope(&of.weighted, &of.beside, &at);
            let lu = slope.lu();
            if length <= SOLVED {
                let x = self.between(&estimate.at.x, &at.x);
                let volume: f64 = lu.u().diagonal().iter().map(|u| u.abs().ln()).sum();
                let there: f64 = of.root.l_dirty().diagonal().iter().map(|l| 2.0 * l.ln()).sum();
                let fit = (eps.norm_squared() - (at.cost - estimate.at.cost)) / 2.0;
                return Some(PosteriorSample { x, weight: fit - volume + there })
                    .filter(|s| s.weight.is_finite());
            }
            let step = lu.solve(&(self.pull(of, &at) + &towards))?;
            let mut step = &step * (TURN / self.turn(&at, &step)).min(1.0);
            let mut next = None;
            for _ in 0..=HALVINGS {
                let found = self.at(self.moved(&at.x, &step)).ok();
                let found = found.and_then(|at| Some((left(&at)?.norm(), at)));
                next = found.filter(|(next, _)| *next < length);
                if next.is_some() || self.stopped.get() {
                    break;
                }
                step /= 2.0;
            }
            (length, at) = next?;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The covariance of the drawn vectors is the identity.
    #[test]
    fn pairs_have_covariance_one() {
        let half = normal_pairs(15, 60, &mut Noise::new(1, 0)).expect("enough pairs");
        let covariance = &half * half.transpose() / 60.0;
        assert!((covariance - DMatrix::identity(15, 15)).amax() < 1e-12);
    }
}
