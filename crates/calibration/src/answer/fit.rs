//! Estimates of a calibration, further runs, and the quality of the fit.

use obsdeg_core::degree::Status;
use obsdeg_core::span::Span;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::setup::SourceRecord;

/// Estimate of an unknown or a combination.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Estimated {
    /// Name of the unknown, or the combination.
    pub name: String,
    /// Unit of the estimate: deg, deg/h, deg/h/g, ...
    pub unit: String,
    /// Verdict of the scheme on the unknown or combination.
    pub status: Status,
    /// Observable degree; null if not observable.
    pub degree: Option<usize>,
    /// True if scheme and records determine it. If false, there is no estimate.
    pub determined: bool,
    /// Estimate in the unit of `unit`; null if not determined.
    pub estimate: Option<f64>,
    /// Standard deviation of the estimate by the assumed noise, in the unit of `unit`; null if not
    /// determined.
    pub sigma: Option<f64>,
    /// Standard deviation, in the unit of `unit`, with errors of the records times the root of chi-square per
    /// degree of freedom, where that is above one; prior knowledge stays as it is. Null if not determined.
    pub sigma_rescaled: Option<f64>,
    /// Standard deviation, in the unit of `unit`, by the linear model at the attitudes of the scheme, with
    /// the times and the noise of the records (and prior knowledge); null if not determined.
    pub predicted_sigma: Option<f64>,
    /// Total uncertainty that requirements are judged by, in the unit of `unit`: the larger sigma, what the
    /// bench adds, and how far a suspected error moves the estimate; null where these add nothing.
    #[serde(default)]
    pub total: Option<f64>,
    /// Largest sigma that the scheme requires, in the unit of `unit`; null if none is stated.
    #[serde(default)]
    pub required_sigma: Option<f64>,
    /// Sigma over that with all undetermined unknowns known, dimensionless: above one if the nonlinear model
    /// couples an unknown that stays open within its box to the estimate. Null if not determined.
    #[serde(rename = "held_factor")]
    pub constrained_factor: Option<f64>,
    /// Part of sigma, in the unit of `unit`, by what the records leave open within its box (see
    /// `assumed.held`): zero if nothing of it bends into the estimate. Null if not determined.
    #[serde(default)]
    pub open_sigma: Option<f64>,
    /// True if the estimate rests on a stated prior: scheme and records alone do not determine it.
    #[serde(default)]
    pub from_prior: bool,
    /// Shift that the program's prior would make to the estimate, in sigma (dimensionless); null if not
    /// determined, and if priors are stated: these are in the estimate.
    pub prior_shift: Option<f64>,
    /// Factor on sigma that the program's prior would make, dimensionless: 1 where it does not matter; null
    /// as `prior_shift`.
    pub prior_factor: Option<f64>,
    /// True if scheme and records determine it at small drifts, but at the drifts of these records what they
    /// leave open bends the run, so that no sigma describes its error. `determined` is false then.
    #[serde(default)]
    pub left_open: bool,
}

impl Estimated {
    /// Larger one of sigma and rescaled sigma, in the unit of `unit`; `None` if not determined.
    pub fn larger_sigma(&self) -> Option<f64> {
        self.sigma.map(|s| self.sigma_rescaled.map_or(s, |r| r.max(s)))
    }

    /// Uncertainty that requirements are judged by, in the unit of `unit`: the total, where something adds to
    /// the larger sigma.
    pub fn uncertainty(&self) -> Option<f64> {
        self.total.or_else(|| self.larger_sigma())
    }

    /// Root sum of squares of what a bench and a suspected error add to the larger sigma, in the unit of
    /// `unit`; `None` where nothing does.
    pub fn outside(&self) -> Option<f64> {
        let own = self.larger_sigma()?;
        self.total.map(|t| (t * t - own * own).max(0.0).sqrt())
    }
}

/// Estimates with the covariance of their errors.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct CovarianceTable {
    /// Names, in the order of rows and columns.
    pub names: Vec<String>,
    /// Units of the estimates, in the same order.
    pub units: Vec<String>,
    /// Estimates in the same order, each in its unit.
    pub estimates: Vec<f64>,
    /// Covariance of the errors by the assumed noise, in products of the units of row and column.
    pub covariance: Vec<Vec<f64>>,
    /// Covariance, in products of the units of row and column, with errors of the data times the root of
    /// chi-square per degree of freedom, where that is above one; prior knowledge stays as it is.
    pub rescaled: Vec<Vec<f64>>,
}

impl CovarianceTable {
    /// True if rows and columns are those of the names, with variances that are finite and not negative.
    pub fn is_square(&self) -> bool {
        let n = self.names.len();
        let whole = |table: &Vec<Vec<f64>>| {
            table.len() == n
                && table.iter().all(|row| row.len() == n && row.iter().all(|x| x.is_finite()))
                && (0..n).all(|k| table[k][k] >= 0.0)
        };
        self.units.len() == n && self.estimates.len() == n && whole(&self.covariance) && whole(&self.rescaled)
    }
}

/// A further run that brings a coefficient closer to its requirement: a dwell at one attitude, calibrated
/// with this answer as prior (`--prior`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NextRun {
    /// Name of the coefficient whose requirement is missed.
    pub unknown: String,
    /// Unit of the sigmas of the coefficient, such as deg/h.
    pub unit: String,
    /// Sigma by this answer, rescaled, in the unit of `unit`; null if not determined.
    pub sigma: Option<f64>,
    /// Largest sigma that meets the requirement, in the unit of `unit`; zero if a bench alone uses it up. It
    /// is less than the requirement if a bench adds to it.
    pub required_sigma: f64,
    /// Attitude of the run: the name of a cardinal attitude, or of a position of the scheme. Null if no
    /// attitude makes sigma smaller by 1 %.
    pub attitude: Option<String>,
    /// Dwell in s: the shortest that meets the requirement to 1 %; if none does, 16 times the longest dwell
    /// of the scheme. Null as `attitude`.
    pub dwell_s: Option<f64>,
    /// Sigma after this run, in the unit of `unit`, by the linear model. Null as `attitude`.
    pub sigma_then: Option<f64>,
    /// True if that meets the requirement.
    pub met: bool,
}

/// Prior calibration; `S` describes what it is for.
#[derive(Debug, Clone, PartialEq)]
pub struct Before<S> {
    /// Names of the unknowns with a stated prior that the estimates already include: it counts once.
    pub priors: Vec<String>,
    /// Estimates of the prior calibration, with the covariance that counts.
    pub estimates: CovarianceTable,
    /// Records that the prior calibration rests on, including those of its own prior.
    pub rests_on: Vec<SourceRecord>,
    /// Platform or model that the prior calibration is for.
    pub of: S,
}

/// Quality of the whole fit: chi-square, its band and its factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fit {
    /// Chi-square: the sum of squares of all residuals in sigma, dimensionless.
    pub chi_square: f64,
    /// Number of degrees of freedom of chi-square; fractions occur.
    pub degrees_of_freedom: f64,
    /// Acceptance band of 99.9 % of chi-square per degree of freedom, dimensionless.
    pub band: Span<f64>,
    /// Factor to multiply sigmas by: the root of chi-square per degree of freedom, dimensionless.
    pub factor: f64,
    /// Number of linearisations until convergence.
    pub passes: usize,
}

/// Curvature of the estimates over what the records and priors leave open.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Curvature {
    /// Largest difference of the run and its linear model along the longest axes of the estimates' errors, in
    /// sigma (dimensionless): below 0.4 the linear covariance holds. Null if the run cannot be followed
    /// there, or if another minimum fits nearly as well.
    pub kappa: Option<f64>,
    /// Number of weighted samples of the posterior (0 below a curvature of 0.4).
    pub samples: usize,
    /// Number of samples that were not found (the equation of each is solved by iteration): the first ends
    /// the search, with no estimate.
    pub failed: usize,
    /// True if estimates and sigmas are mean and covariance of the samples of the posterior.
    pub from_samples: bool,
}

/// Quality of the fit at one position of a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PositionFit {
    /// Name of the record with this position.
    pub record: String,
    /// Name of the position in the scheme.
    pub position: String,
    /// Start of the position, in s of the record's timeline.
    pub start_s: f64,
    /// End of the position, in s of the record's timeline.
    pub end_s: f64,
    /// Length of the specific force at the position, in g: a median, which single samples do not affect; null
    /// if the record has no forces.
    pub force_g: Option<f64>,
    /// Number of measurements: components of Z of bins.
    pub measurements: usize,
    /// Chi-square per degree of freedom, dimensionless; 1 is expected.
    pub chi_square: f64,
    /// Number of degrees of freedom of chi-square; fractions occur.
    pub degrees_of_freedom: f64,
    /// Unknown that changes most without the position; null if there is none.
    pub moves: Option<Moved>,
    /// Unknowns and combinations that are not determined without the position.
    pub loses: Vec<String>,
}

/// Change of an unknown or combination without one position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Moved {
    /// Name of the unknown, or the combination.
    pub name: String,
    /// Change over its standard deviation, dimensionless.
    pub sigmas: f64,
}

/// Quality of the fit of one component of Z.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChannelFit {
    /// Component of Z: `Z1`, `Z2`, `Z3` or `Za`.
    pub channel: String,
    /// Unit of `sigma` and `scatter`: g or rad.
    pub unit: String,
    /// Standard deviation of a sample as assumed, in the unit of `unit`.
    pub sigma: f64,
    /// Standard deviation of a sample, in the unit of `unit`, by the scatter of the samples of a bin about a
    /// line; null if bins have too few.
    pub scatter: Option<f64>,
    /// Chi-square per degree of freedom, dimensionless; 1 is expected.
    pub chi_square: f64,
    /// Number of degrees of freedom of chi-square; fractions occur.
    pub degrees_of_freedom: f64,
    /// Smallest probability over the records that independent residuals are as correlated as these; null for
    /// few.
    pub whiteness_probability: Option<f64>,
    /// Correlation of residuals and temperature in the record where chance is least likely; null without
    /// temperature, and for few.
    pub temperature: Option<Warmth>,
}

/// Correlation of residuals and temperature, position by position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Warmth {
    /// Coefficient of correlation at the position where it is strongest, dimensionless, -1 to 1.
    pub correlation: f64,
    /// Probability that residuals independent of the temperature are as correlated, all positions together
    /// (R. A. Fisher, Metron 1, 1921).
    pub probability: f64,
}

/// Measurement that was left out as an outlier.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outlier {
    /// Name of the record with the outlier.
    pub record: String,
    /// First and last line number of the measurement in the record.
    pub lines: Span<u64>,
    /// Time of the measurement, in s of the record's timeline.
    pub t_s: f64,
    /// Component of Z (`Z1`, `Z2`, `Z3` or `Za`) or, for a single cell, the column of the record.
    pub channel: String,
    /// Distance from the expected value, in standard deviations (dimensionless).
    pub sigmas: f64,
}

/// Filter against least squares, with one wide prior for both.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SecondPath {
    /// Largest difference of the estimates at the end of a record, in sigma (dimensionless).
    pub difference: f64,
    /// Largest relative difference of sigmas there, dimensionless.
    pub sigma_difference: f64,
}

/// Agreement of several records of one platform.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Repeatability {
    /// Chi-square per degree of freedom of the differences between the records' coefficients, dimensionless.
    pub chi_square: f64,
    /// Number of degrees of freedom of chi-square; fractions occur.
    pub degrees_of_freedom: f64,
    /// Acceptance band of 99.9 % of chi-square per degree of freedom, dimensionless.
    pub band: Span<f64>,
}
