//! Coefficients that are known beforehand with their covariance: a calibration of another day.

use nalgebra::DMatrix;

use super::conditions::si_per_shown;
use super::error::SimulationError;
use super::plan::Plan;
use crate::prediction::Prediction;

/// Covariance of coefficients that is known beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownCovariance {
    /// Coefficients, or combinations of coefficients as named by an answer: rows and columns of the
    /// covariance. Names that a scheme does not have are ignored.
    pub names: Vec<String>,
    /// Covariance in products of the shown units of row and column (shape n x n).
    pub covariance: Vec<Vec<f64>>,
}

impl KnownCovariance {
    /// Standard deviation of a coefficient in its shown unit; `None` if it is not among the names.
    pub fn sigma(&self, name: &str) -> Option<f64> {
        let k = self.names.iter().position(|n| n == name)?;
        Some(self.covariance.get(k)?.get(k)?.max(0.0).sqrt())
    }

    /// Covariance after a number of days with a random walk of the coefficients: `q^2 t` is added to each
    /// variance, with `q` by name in the unit of the coefficient per sqrt(day). Names without a `q`
    /// (combinations) are left out.
    pub fn aged(&self, walk: impl Fn(&str) -> Option<f64>, days: f64) -> Self {
        let kept: Vec<(usize, f64)> =
            self.names.iter().enumerate().filter_map(|(k, name)| Some((k, walk(name)?))).collect();
        let entry = |i: usize, j: usize| self.covariance.get(i).and_then(|row| row.get(j)).copied();
        let row = |&(i, q): &(usize, f64)| -> Vec<f64> {
            let own = |j: usize| if i == j { q * q * days } else { 0.0 };
            kept.iter().map(|&(j, _)| entry(i, j).unwrap_or(f64::NAN) + own(j)).collect()
        };
        Self {
            names: kept.iter().map(|(k, _)| self.names[*k].clone()).collect(),
            covariance: kept.iter().map(row).collect(),
        }
    }

    /// Root of the information on the unknowns of a plan in SI units (m x unknowns): rows of measurements of
    /// unit noise. psi belongs to another run, so combinations with psi are left out.
    ///
    /// # Errors
    /// [`SimulationError::KnownCovariance`] if no name is a coefficient of the plan, or the covariance is not
    /// positive definite.
    pub fn rows(&self, plan: &Plan, prediction: &Prediction) -> Result<DMatrix<f64>, SimulationError> {
        let wrong = |why: &str| SimulationError::KnownCovariance { why: why.into() };
        let (names, units) = (plan.platform.names(), plan.platform.units());
        let psi = names.len() - plan.platform.coefficients();
        let terms = |name: &String| -> Option<Vec<(usize, f64)>> {
            let single = names.iter().position(|n| n == name).map(|i| vec![(i, 1.0)]);
            let combination = prediction.combinations.iter().find(|c| c.expression == *name);
            let terms = single.or_else(|| combination.map(|c| c.terms.clone()))?;
            terms.iter().all(|(i, _)| *i >= psi).then_some(terms)
        };
        let n = self.names.len();
        if self.covariance.len() != n || self.covariance.iter().any(|row| row.len() != n) {
            return Err(wrong("its shape is not that of its names"));
        }
        let found: Vec<(usize, Vec<(usize, f64)>)> =
            (0..n).filter_map(|k| Some((k, terms(&self.names[k])?))).collect();
        if found.is_empty() {
            return Err(wrong("none of its names is a coefficient of the scheme"));
        }
        let scale = |terms: &[(usize, f64)]| si_per_shown(units[terms[0].0]);
        let m = found.len();
        let covariance = DMatrix::from_fn(m, m, |i, j| {
            let ((a, s), (b, t)) = (&found[i], &found[j]);
            self.covariance[*a][*b] * scale(s) * scale(t)
        });
        let root = covariance.cholesky().ok_or_else(|| wrong("it is not positive definite"))?.l();
        let mut rows = DMatrix::zeros(m, names.len());
        for (i, (_, terms)) in found.iter().enumerate() {
            terms.iter().for_each(|&(c, k)| rows[(i, c)] += k);
        }
        root.solve_lower_triangular(&rows).ok_or_else(|| wrong("it is not positive definite"))
    }
}
