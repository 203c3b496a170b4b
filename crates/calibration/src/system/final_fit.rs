//! Final fit of a system: its free unknowns, and which functionals it determines.

use obsdeg_core::degree::{Status, Verdict};
use obsdeg_core::span::Span;

use super::answer::SystemEstimated;
use super::fit::{ModelRows, Settled};
use crate::least_squares::LeastSquaresSolution;
use crate::levels;

/// Name and version of the JSON layout.
pub(super) const SCHEMA: &str = "obsdeg.system-calibration/1";

/// Largest ratio of sigmas, for a pull ten times as weak, of a determined unknown.
const DETERMINED: f64 = 1.05;

/// Combination: its text, degree, value, and derivatives by unknowns.
pub(super) type OfInvariant = (String, Option<usize>, f64, Vec<(usize, f64)>);

/// Free unknowns of a model: their names, and their verdicts where the model has them.
pub(super) struct FreeUnknowns {
    pub(super) names: Vec<String>,
    pub(super) verdicts: Vec<Option<Verdict>>,
}

impl FreeUnknowns {
    /// True if the unknown `j` is observable.
    pub(super) fn observable(&self, j: usize) -> bool {
        self.verdicts[j].is_some_and(|v| v.status == Status::Observable)
    }
}

/// Fit at the solution.
pub(super) struct FinalFit {
    pub(super) best: Settled,
    /// Rows at the solution.
    pub(super) at: ModelRows,
    pub(super) solution: LeastSquaresSolution,
    /// Solution with a pull ten times as weak.
    pub(super) weaker: LeastSquaresSolution,
    /// True for each free unknown that model and record determine.
    pub(super) determined: Vec<bool>,
    pub(super) degrees_of_freedom: usize,
    /// Chi-square per degree of freedom.
    pub(super) mean: f64,
}

impl FinalFit {
    /// True if the record determines a functional of the free unknowns.
    pub(super) fn determines(&self, terms: &[(usize, f64)]) -> bool {
        self.weaker.sigma(terms) <= DETERMINED * self.solution.sigma(terms)
    }

    /// Covariance of two functionals with the noise that the fit has, if that is larger.
    pub(super) fn between(&self, a: &[(usize, f64)], b: &[(usize, f64)]) -> f64 {
        self.solution.covariance_with(a, b, self.mean.sqrt().max(1.0), &self.at.known.0)
    }

    /// Band of chi-square per degree of freedom.
    pub(super) fn band(&self) -> Span<f64> {
        let free = self.degrees_of_freedom as f64;
        levels::band(free, levels::NOISE)
    }

    /// Estimate of a functional by its name and unit.
    pub(super) fn estimated(
        &self,
        (name, unit): (&str, String),
        verdict: Option<Verdict>,
        determined: bool,
        value: f64,
        terms: &[(usize, f64)],
    ) -> SystemEstimated {
        let there = |x: f64| determined.then_some(x);
        SystemEstimated {
            name: name.into(),
            unit,
            status: verdict.map(|v| v.status),
            degree: verdict.and_then(|v| v.degree),
            determined,
            estimate: there(value),
            sigma: there(self.solution.sigma(terms)),
            sigma_rescaled: there(self.between(terms, terms).max(0.0).sqrt()),
        }
    }
}
