//! Score test: omitted errors that explain the residuals of a fit.
//!
//! Let `r` be the whitened residuals, and `w_j` the part of the whitened column j orthogonal to all changes
//! of the unknowns. Then `q_j = (w_j r)^2 / (w_j w_j)` is chi-square with one degree of freedom if the error
//! is zero. It equals the fall of chi-square with the error among the unknowns. The estimate of the error is
//! `(w_j r) / (w_j w_j)` (Rao 1948, doi:10.1017/S0305004100023987). Residuals may exceed their sigmas even
//! with the error among the unknowns. The fall is then divided by the remaining chi-square per degree of
//! freedom, since noise beyond the stated one is no error of the bench. Bonferroni's bound accounts for the
//! number of errors tried.

use nalgebra::DMatrix;
use obsdeg_ekf::consistency::{chi_square_quantile, chi_square_tail};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Confidence of the bound on chi-square above which a single error does not explain the residuals.
const UNEXPLAINED: f64 = 0.999;
/// Largest difference of the falls of chi-square within a group, at the size found: three sigma.
const SAME: f64 = 9.0;
/// Relative error of a fall by linearisation at a fit that the error displaces.
const BENT: f64 = 0.05;
/// Squared relative length below which a column counts as rounding.
const ROUNDING: f64 = 1e-20;

/// Sums over the whitened residuals of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreSums {
    /// Products `w_j w_k` (errors x errors).
    pub products: DMatrix<f64>,
    /// Products `w_j r`, by error.
    pub against: Vec<f64>,
    /// Sum `r r`: chi-square of the fit.
    pub chi_square: f64,
    /// Degrees of freedom of the fit.
    pub degrees_of_freedom: f64,
    /// True for each error that a record can show, by its exact class. The column of any other error only
    /// reflects the width of the prior.
    pub shown: Vec<bool>,
}

/// Error, or pair of errors, that explains the residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualExplanation {
    /// Indices of one or two errors.
    pub errors: Vec<usize>,
    /// Estimate and standard deviation of each error, in SI units.
    pub estimates: Vec<[f64; 2]>,
    /// Fall of chi-square with the errors among the unknowns.
    pub fall: f64,
    /// Bound on the probability that chance alone causes such a fall for any error tried.
    pub probability: f64,
    /// Indices, by error, of the other errors that these residuals do not distinguish from it.
    pub groups: Vec<Vec<usize>>,
    /// True if chi-square with the errors among the unknowns is within its band.
    pub explained: bool,
}

/// Suspicion that errors that are not estimated are in a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Suspicion {
    /// One error, or a pair where a second one explains more of the residuals than chance would.
    pub errors: Vec<SuspectedError>,
    /// Other errors that this record does not distinguish from the first one, by name.
    pub indistinguishable: Vec<String>,
    /// True if the residuals are within their band with the errors among the unknowns; false if something is
    /// left that they do not explain.
    #[serde(default = "yes")]
    pub explained: bool,
    /// Fall of chi-square with the errors among the unknowns, dimensionless.
    pub chi_square_fall: f64,
    /// Bound on the probability that chance gives such a fall to any of the errors that were tried.
    pub probability: f64,
    /// Estimates that the errors, or an indistinguishable one, change most in their own sigma, the largest
    /// change first.
    pub changes: Vec<SuspectedChange>,
}

/// Value of `explained` in answers without this field.
fn yes() -> bool {
    true
}

/// Error that explains residuals, with its estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SuspectedError {
    /// Name of the error, such as `K0_Y`.
    pub name: String,
    /// Unit of its estimate and sigma.
    pub unit: String,
    /// Estimate of the error from the residuals, in the unit of `unit`.
    pub estimate: f64,
    /// Standard deviation of the estimate by the stated noise, in the unit of `unit`.
    pub sigma: f64,
    /// Other errors that this record does not distinguish from this one, by name.
    #[serde(default)]
    pub indistinguishable: Vec<String>,
}

/// Estimate without and with suspected errors among the unknowns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SuspectedChange {
    /// Name of the unknown that is estimated.
    pub unknown: String,
    /// Unit of both estimates of the unknown.
    pub unit: String,
    /// Estimate of the fit, in the unit of `unit`.
    pub estimate: f64,
    /// Estimate with the suspected errors among the unknowns, in the unit of `unit`.
    pub with: f64,
    /// Lowest estimate with the suspected error or one of `indistinguishable` among the unknowns, in the unit
    /// of `unit`.
    pub lowest: f64,
    /// Highest estimate with the suspected error or one of `indistinguishable` among the unknowns, in the
    /// unit of `unit`.
    pub highest: f64,
}

impl ScoreSums {
    /// Errors that these residuals can show.
    pub fn tried(&self) -> Vec<usize> {
        let m = self.against.len();
        let largest = (0..m).map(|j| self.products[(j, j)]).fold(0.0, f64::max);
        (0..m).filter(|&j| self.shown[j] && self.products[(j, j)] > ROUNDING * largest).collect()
    }

    /// Fall of chi-square with one error among the unknowns.
    pub fn fall(&self, j: usize) -> f64 {
        self.against[j] * self.against[j] / self.products[(j, j)]
    }

    /// Chi-square per degree of freedom after a fall by `unknowns` more unknowns; at least one.
    fn left_over(&self, fall: f64, unknowns: f64) -> f64 {
        ((self.chi_square - fall) / (self.degrees_of_freedom - unknowns).max(1.0)).max(1.0)
    }

    /// True if chi-square is within its band after a fall by `unknowns` more unknowns.
    fn explained(&self, fall: f64, unknowns: f64) -> bool {
        let free = (self.degrees_of_freedom - unknowns).max(1.0);
        self.chi_square - fall <= chi_square_quantile(free, UNEXPLAINED)
    }

    /// Errors that explain as much as `own` beside `other`.
    fn group_beside(
        &self,
        own: usize,
        other: usize,
        (fall, left_over): (f64, f64),
        tried: &[usize],
    ) -> Vec<usize> {
        let alike = |&&k: &&usize| {
            k != own
                && k != other
                && self.pair([k, other]).is_some_and(|(_, with)| (fall - with) / left_over < SAME)
        };
        tried.iter().filter(alike).copied().collect()
    }

    /// Estimates with their standard deviations, and the fall of chi-square, of a pair.
    fn pair(&self, [i, j]: [usize; 2]) -> Option<([[f64; 2]; 2], f64)> {
        let (a, b, c) = (self.products[(i, i)], self.products[(i, j)], self.products[(j, j)]);
        let determinant = a * c - b * b;
        // errors that the residuals do not distinguish are no pair
        if determinant <= 1e-6 * a * c {
            return None;
        }
        let (u, v) = (self.against[i], self.against[j]);
        let [x, y] = [(c * u - b * v) / determinant, (a * v - b * u) / determinant];
        let sigmas = [(c / determinant).sqrt(), (a / determinant).sqrt()];
        Some(([[x, sigmas[0]], [y, sigmas[1]]], x * u + y * v))
    }

    /// Errors that the residuals do not distinguish from `j` at the size found: by their columns, or by their
    /// falls.
    fn group(&self, j: usize, tried: &[usize]) -> Vec<usize> {
        let left_over = self.left_over(self.fall(j), 1.0);
        let fall = self.fall(j) / left_over;
        let same = |&&k: &&usize| {
            let product = self.products[(j, k)];
            let alike = product * product / (self.products[(j, j)] * self.products[(k, k)]);
            let less = fall - self.fall(k) / left_over;
            k != j && (fall * (1.0 - alike) < SAME || less < SAME + BENT * fall)
        };
        tried.iter().filter(same).copied().collect()
    }

    /// Best explanation of the residuals: a single error, or a pair if no single one explains them; `None` if
    /// chance suffices. `level` is the probability of an explanation where nothing is wrong.
    pub fn explanation(&self, level: f64) -> Option<ResidualExplanation> {
        let tried = self.tried();
        let best = tried.iter().copied().max_by(|&i, &j| self.fall(i).total_cmp(&self.fall(j)))?;
        let fall = self.fall(best);
        let counted = fall / self.left_over(fall, 1.0);
        let probability = (chi_square_tail(1.0, counted) * tried.len() as f64).min(1.0);
        let own = self.products[(best, best)];
        let explained = self.explained(fall, 1.0);
        let single = ResidualExplanation {
            errors: vec![best],
            estimates: vec![[self.against[best] / own, 1.0 / own.sqrt()]],
            fall,
            probability,
            groups: vec![self.group(best, &tried)],
            explained,
        };
        // a band of all residuals hides a second error that is many sigmas large
        let pair = if explained && probability >= level { None } else { self.best_pair(&tried, fall, level) };
        pair.or_else(|| (probability < level).then_some(single))
    }

    /// The best pair, if it explains more than the best single error by more than chance.
    fn best_pair(&self, tried: &[usize], single: f64, level: f64) -> Option<ResidualExplanation> {
        let pairs = tried.iter().enumerate().flat_map(|(k, &i)| tried[..k].iter().map(move |&j| [i, j]));
        let found = pairs.filter_map(|p| self.pair(p).map(|(estimates, fall)| (p, estimates, fall)));
        let (mut errors, mut estimates, fall) = found.max_by(|a, b| a.2.total_cmp(&b.2))?;
        let count = (tried.len() * tried.len().saturating_sub(1) / 2) as f64;
        let left_over = self.left_over(fall, 2.0);
        let probability = (chi_square_tail(2.0, fall / left_over) * count).min(1.0);
        let more = chi_square_tail(1.0, (fall - single) / left_over) * tried.len() as f64;
        if probability >= level || more >= level {
            return None;
        }
        // the error with the larger fall of its own comes first
        if self.fall(errors[0]) < self.fall(errors[1]) {
            errors.reverse();
            estimates.reverse();
        }
        let [a, b] = errors;
        let found = (fall, left_over);
        Some(ResidualExplanation {
            errors: errors.into(),
            estimates: estimates.into(),
            fall,
            probability,
            groups: vec![self.group_beside(a, b, found, tried), self.group_beside(b, a, found, tried)],
            explained: self.explained(fall, 2.0),
        })
    }
}
