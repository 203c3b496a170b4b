//! Answer of a calibration as plain data.

use obsdeg_core::degree::Status;
use obsdeg_core::model::settings::Assignment;
use obsdeg_core::title_block::TitleBlock;
use obsdeg_evidence::acceptance::AcceptanceReport;
use obsdeg_evidence::requirements::Requirements;
use obsdeg_evidence::simulation::omitted::{ChangePerUnit, Suspicion};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::setup::{Setup, SourceRecord};

/// Name and version of the JSON layout.
pub const LAYOUT: &str = "obsdeg.calibration/1";

/// Calibration of a scheme from one or several records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Calibration {
    /// Layout of this answer: `obsdeg.calibration/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Name of the scheme; empty if it has none.
    #[serde(default)]
    pub name: String,
    /// Title block of the scheme's documents.
    #[serde(default)]
    pub document: TitleBlock,
    /// True if the model and its sigmas explain the records.
    pub consistent: bool,
    /// Evidence against the model or its sigmas, the gravest first; empty if there is none.
    pub findings: Vec<CalibrationFinding>,
    /// Estimates of the unknowns, psi of the start of each record.
    pub quantities: Vec<Estimated>,
    /// Outcome of the requirements on coefficients by the sigmas of the estimates, rescaled where they are
    /// too small, with what a bench adds and what a suspected error would change; null if none is stated.
    /// Requirements on psi are not judged: a calibration estimates psi of the start of a record.
    #[serde(default)]
    pub requirements: Option<Requirements>,
    /// Acceptance of the coefficients within the limits of the scheme, by the same uncertainties; null if no
    /// limits are stated.
    #[serde(default)]
    pub acceptance: Option<AcceptanceReport>,
    /// Further runs that bring coefficients to requirements they miss; empty if none is missed.
    #[serde(default)]
    pub next_runs: Vec<NextRun>,
    /// Estimates of combinations of unknowns that are not determined alone, and of those asked for.
    pub combinations: Vec<Estimated>,
    /// Covariance of all estimates that do not follow from others.
    pub covariance: CovarianceTable,
    /// Quality of the whole fit: chi-square, its band and its factor.
    pub fit: Fit,
    /// Curvature of the estimates over what the records and priors leave open.
    #[serde(default)]
    pub curvature: Curvature,
    /// Quality of the fit by record and position.
    pub positions: Vec<PositionFit>,
    /// Quality of the fit by component of Z.
    pub channels: Vec<ChannelFit>,
    /// Measurements that were left out as outliers.
    pub outliers: Vec<Outlier>,
    /// Number of measurements that were left out as outliers.
    pub outlier_count: usize,
    /// Second path to the estimate: the filter against least squares.
    pub second_path: SecondPath,
    /// Agreement of the coefficients of several records; null for one record.
    pub repeatability: Option<Repeatability>,
    /// Records that were read, with their clocks and columns.
    pub records: Vec<RecordReport>,
    /// Assumptions of the estimates: conditions, noise, priors and gate.
    pub assumed: Assumed,
    /// Errors that the scheme does not estimate: suspicion in these records, and what they cannot show.
    #[serde(default)]
    pub omitted: Omitted,
    /// Scheme, geometry and carry that were calibrated.
    pub setup: Setup,
    /// Records that the estimates rest on, including those of the calibration before.
    pub rests_on: Vec<SourceRecord>,
    /// Residuals over time, by record and component.
    pub series: Vec<ResidualSeries>,
    /// Every measurement and what the estimate leaves of it.
    #[serde(skip)]
    #[schemars(skip)]
    pub residuals: Vec<Residual>,
}

impl Calibration {
    /// True values of another run of the calibrated platform: the determined unknowns, with psi of the first
    /// record.
    pub fn values(&self) -> Vec<Assignment> {
        let first = |e: &Estimated| {
            let name = e.name.strip_suffix(" (record 1)").unwrap_or(&e.name).to_string();
            Some(Assignment { value: e.estimate.filter(|_| !name.contains(" (record "))?, name })
        };
        self.quantities.iter().filter_map(first).collect()
    }
}

/// Evidence against the model or its sigmas.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", tag = "kind")]
#[schemars(rename = "Finding")]
pub enum CalibrationFinding {
    /// Interrupted iteration: the estimates are where it was then.
    Interrupted,
    /// Iteration that did not converge.
    NotSettled,
    /// Specific force that is not one g long, with no unknown that explains it.
    Force {
        /// Name of the record with this finding.
        record: String,
        /// Mean length of the specific force in the record, in g.
        length_g: f64,
        /// True if the length is the same at all positions.
        alike: bool,
        /// Position with the shortest specific force.
        least: ForceLength,
        /// Position with the longest specific force.
        most: ForceLength,
        /// Errors of one axis, each of which alone makes the force one g long; empty if several axes are
        /// wrong, or all alike.
        causes: Vec<ForceCause>,
    },
    /// Cells of a column that hold one value again and again, far from their neighbours or many times in a
    /// row; they were left out.
    Cells {
        /// Name of the record with this finding.
        record: String,
        /// Column of these cells, as in the header of the record.
        column: String,
        /// Kind of these cells: a code of missing values, or a stuck output.
        kind_of_cells: CellKind,
        /// Value of these cells, in the unit of the column.
        value: f64,
        /// Number of cells that hold the value.
        count: usize,
        /// First and last line number of these cells in the record.
        lines: (u64, u64),
    },
    /// Measurements in succession that lie off to the same side; they were left out. Outliers are independent
    /// of each other: these are a step of an output, or the platform moved.
    Succession {
        /// Name of the record with this finding.
        record: String,
        /// Name of the position at which these measurements lie.
        position: String,
        /// Component of Z (`Z1`, `Z2`, `Z3` or `Za`) or, for single cells, the column of the record.
        channel: String,
        /// Number of these measurements.
        count: usize,
        /// First and last line number in the record.
        lines: (u64, u64),
        /// Times of the first and the last one, in s of the record's timeline.
        span_s: (f64, f64),
        /// Least and largest distance from the expected value, in standard deviations (dimensionless).
        sigmas: (f64, f64),
    },
    /// Record with the noise of another one: a copy, whose numbers count twice.
    Copy {
        /// Name of the record with this finding.
        record: String,
        /// Name of the record with the same noise.
        other: String,
        /// Coefficient of correlation of the residuals of both, dimensionless, -1 to 1.
        correlation: f64,
    },
    /// Turns that last longer or shorter than in the scheme, while positions do not.
    Turns {
        /// Name of the record with this finding.
        record: String,
        /// Duration of a turn in the record over that in the scheme, dimensionless.
        factor: f64,
        /// Slew rate of the record, in deg/s; null where the scheme states none for all slews.
        slew_rate_deg_s: Option<f64>,
    },
    /// Clock of a record that was set forward during the run: with the times behind a gap corrected,
    /// chi-square falls to a twentieth or less.
    ClockJump {
        /// Name of the record with this finding.
        record: String,
        /// Line number of the first row behind the jump.
        line: u64,
        /// Position of the rows before and behind the jump, or both positions if they differ.
        place: String,
        /// Time of the last row before the jump, in s as in the record.
        from_s: f64,
        /// Time by which the clock was set forward, in s.
        by_s: f64,
        /// Chi-square per degree of freedom with the times corrected, dimensionless.
        chi_square: f64,
        /// True if the model explains the records with the times corrected; there are no other findings then.
        explains: bool,
    },
    /// Clock of a record that does not run as fast as that of the scheme, or as the earth turns.
    Clock {
        /// Name of the record with this finding.
        record: String,
        /// Fraction by which the clock is fast, by the times at which positions begin and end, dimensionless;
        /// null if they show none.
        by_durations: Option<f64>,
        /// Standard deviation of `by_durations`, dimensionless: rows leave the begin and the end of a
        /// position open by the time between two of them; null without `by_durations`.
        #[serde(default)]
        by_durations_sigma: Option<f64>,
        /// Rate error of the clock by the times at which the drift changes with the position; null if that is
        /// within chance.
        #[serde(default)]
        by_changes: Option<ClockRate>,
        /// Fraction by which the clock is fast by the rate of the earth; null if that is within chance.
        by_earth: Option<ClockRate>,
    },
    /// Position that fits worse than its measurements allow.
    Position {
        /// Name of the record with this finding.
        record: String,
        /// Name of the position with this finding.
        position: String,
        /// Chi-square per degree of freedom, dimensionless; 1 is expected.
        chi_square: f64,
        /// Factor by which the sigmas are too small there, dimensionless: the root of `chi_square`.
        factor: f64,
    },
    /// Positions that all fit alike, and not as their sigmas say.
    Noise {
        /// Chi-square per degree of freedom, dimensionless; 1 is expected.
        chi_square: f64,
        /// Factor to multiply the sigmas by, dimensionless.
        factor: f64,
    },
    /// Component of Z that does not fit as its sigma says.
    Channel {
        /// Component of Z: `Z1`, `Z2`, `Z3` or `Za`.
        channel: String,
        /// Chi-square per degree of freedom, dimensionless; 1 is expected.
        chi_square: f64,
        /// Factor to multiply its sigma by, dimensionless.
        factor: f64,
    },
    /// Residuals of a component that are not independent of each other.
    Correlated {
        /// Name of the record with this finding.
        record: String,
        /// Component of Z: `Z1`, `Z2`, `Z3` or `Za`.
        channel: String,
        /// Probability that independent residuals are as correlated as these.
        probability: f64,
    },
    /// Residuals of a component that follow the temperature.
    Temperature {
        /// Name of the record with this finding.
        record: String,
        /// Component of Z: `Z1`, `Z2`, `Z3` or `Za`.
        channel: String,
        /// Coefficient of correlation of residuals and temperature, dimensionless, -1 to 1.
        correlation: f64,
        /// Probability that chance alone gives such a correlation.
        probability: f64,
    },
    /// Too many measurements lie far off for all of them to be outliers; none of these was left out.
    Outliers {
        /// Number of measurements that lie far off.
        count: usize,
        /// Total number of measurements.
        of: usize,
    },
    /// Records that do not agree on the coefficients.
    Repeatability {
        /// Chi-square per degree of freedom, dimensionless; 1 is expected.
        chi_square: f64,
    },
    /// Filter and least squares that do not agree.
    SecondPath {
        /// Largest difference of both, in sigma, dimensionless.
        difference: f64,
    },
    /// Error that is not among the unknowns and explains the residuals: see `omitted`.
    Suspect {
        /// Names of the errors: one, or a pair where a second one explains more than chance would.
        errors: Vec<String>,
        /// Fall of chi-square with them among the unknowns, dimensionless.
        chi_square_fall: f64,
    },
    /// Prior knowledge that does not agree with the records.
    Known {
        /// Chi-square per degree of freedom, dimensionless; 1 is expected.
        chi_square: f64,
    },
}

/// Errors that a calibration does not estimate.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Omitted {
    /// Number of errors that were tried, each by a score test on the residuals: those that a record can show.
    pub tried: usize,
    /// Error or pair that explains residuals better than chance; null where chance is enough.
    pub suspicion: Option<Suspicion>,
    /// Errors that no record of this scheme shows and that change a coefficient.
    pub silent: Vec<SilentError>,
    /// Sizes of families that the bench does not state in full, at which one by itself uses up the margin of
    /// a requirement; empty where a requirement is missed or none is stated.
    #[serde(default)]
    pub limits: Vec<FamilyLimit>,
}

/// Size of all terms of a family of errors at which a requirement is just met.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FamilyLimit {
    /// Name of the family, such as `K0` or `latitude`.
    pub family: String,
    /// Unit of its sizes: ug, ppm, arcsec, ...
    pub unit: String,
    /// Name of the unknown whose requirement is reached first.
    pub unknown: String,
    /// Size (one sigma) of each term of the family, in the unit of `unit`.
    pub size: f64,
}

/// Error that no record of a scheme shows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SilentError {
    /// Name of the error, such as `K0_X`.
    pub name: String,
    /// Unit of its size: ug, ppm, arcsec, ...
    pub unit: String,
    /// Names of the unknowns whose estimates it changes.
    pub changes: Vec<String>,
    /// Changes of the coefficients per unit of the error: the same whatever the record says.
    pub sensitivities: Vec<ChangePerUnit>,
}

/// Kind of cells that hold one value again and again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CellKind {
    /// Code of missing values: far from its neighbours.
    Code,
    /// Stuck output: equal to the rows before it to the last digit.
    Stuck,
}

/// Length of the specific force at a position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ForceLength {
    /// Name of the position with this length.
    pub position: String,
    /// Length of the specific force, in g.
    pub length_g: f64,
}

/// Error of one axis that explains why the specific force is not one g long.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ForceCause {
    /// Kind of the error: scale or zero.
    pub error: ForceError,
    /// Output of the accelerometer: fx, fy, fz.
    pub axis: String,
    /// Error of the axis: scale as a fraction (dimensionless) or zero in g, by which the recorded output is
    /// larger.
    pub by: f64,
    /// Standard deviation of the error, as `by`: dimensionless (scale) or in g (zero).
    pub sigma: f64,
    /// Fraction by which the force is longer besides, at all positions alike, dimensionless; null for none.
    pub besides: Option<f64>,
}

/// Kind of error of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceError {
    /// Scale error, a fraction of the output.
    Scale,
    /// Zero error, in g of the output.
    Zero,
}

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
    pub band: (f64, f64),
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
    pub lines: (u64, u64),
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
    pub band: (f64, f64),
}

/// Record that was read, with its clock and columns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecordReport {
    /// Name of the record, as it was given.
    pub name: String,
    /// Number of samples in the record.
    pub samples: usize,
    /// Usual interval between rows, in s.
    #[serde(default)]
    pub interval_s: f64,
    /// Intervals of more than three usual ones without rows, beyond the time of the slew where one lies
    /// between; at most 1000.
    #[serde(default)]
    pub gaps: Vec<Gap>,
    /// Number of empty cells at positions, by column that is read; columns without are left out.
    #[serde(default)]
    pub empty_cells: Vec<EmptyCells>,
    /// Time of the record, in s, at which psi is estimated: the start of the scheme's first position, or the
    /// first row at it where only rows say when positions begin.
    #[serde(default)]
    pub psi_at_s: f64,
    /// Number of samples at no position of the scheme.
    pub unused: usize,
    /// Number of samples at positions that were left out because the platform waits for rest (`settle` of the
    /// scheme file).
    #[serde(default)]
    pub waiting: usize,
    /// Number of bins of the samples.
    pub bins: usize,
    /// First and last time of the record, in s.
    pub span_s: (f64, f64),
    /// Source of the position of each sample.
    pub positions_by: PositionsBy,
    /// Longest interval, in s, in which a change of position may lie by the rows beside it: its time is
    /// uniform there, which is part of the sigmas. Null where the scheme says when positions change, or no
    /// drift passes from one to the next.
    #[serde(default)]
    pub change_open_s: Option<f64>,
    /// Columns that are not used.
    pub ignored: Vec<String>,
    /// Mean length of the specific force, in g; null if the record has no forces.
    pub force_g: Option<f64>,
    /// Largest distance of the gimbals from the attitudes of the scheme, in deg; null if the record has no
    /// gimbal angles.
    pub gimbals_deg: Option<f64>,
    /// Rate error of the clock of the record.
    pub clock: Clock,
}

/// Number of empty cells in a column of a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EmptyCells {
    /// Column of the cells, as in the header of the record.
    pub column: String,
    /// Number of cells that are empty or NaN, in rows at positions.
    pub count: usize,
}

/// Gap in a record: an interval without rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Gap {
    /// Time of the row before the gap, in s as in the record.
    pub from_s: f64,
    /// Time of the row after the gap, in s as in the record.
    pub to_s: f64,
    /// Line number of the row after the gap.
    pub line: u64,
    /// Position of the rows before and after the gap, or both positions if they differ.
    pub place: String,
}

/// Offset and rate error of the clock of a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Clock {
    /// Time of the record, in s, at which the scheme begins; null where positions are held otherwise than in
    /// the scheme, so that rows alone say when each begins.
    #[serde(default)]
    pub offset_s: Option<f64>,
    /// Standard deviation of that time, in s; null where it was not estimated: the labels of the rows agree
    /// with it.
    #[serde(default)]
    pub offset_sigma_s: Option<f64>,
    /// Fraction by which the clock is fast, dimensionless, if positions begin and end as in a scheme with all
    /// times stretched by it: a clock, or a scheme run so; null if not.
    pub by_durations: Option<f64>,
    /// Standard deviation of `by_durations`, dimensionless: rows leave the begin and the end of a
    /// position open by the time between two of them; null without `by_durations`.
    #[serde(default)]
    pub by_durations_sigma: Option<f64>,
    /// Rate error of the clock by the times at which the drift changes with the position, on the timeline of
    /// the scheme: a clock, or positions held longer or shorter. Null where positions are held otherwise than
    /// in the scheme, or where drifts change too little.
    #[serde(default)]
    pub by_changes: Option<ClockRate>,
    /// Fraction by which the clock is fast by the rate of the earth when all unknowns follow; drifts are too
    /// small by the same fraction. Null if its sigma would be above a third.
    pub by_earth: Option<ClockRate>,
}

/// Rate error of the clock of a record, with its sigma.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClockRate {
    /// Fraction by which the clock is fast, dimensionless.
    pub fast: f64,
    /// Standard deviation of `fast`, dimensionless: a fraction not much larger is not significant.
    pub sigma: f64,
}

/// Source of the position of each sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PositionsBy {
    /// Column of labels: a position ends behind its last sample, and the next begins when the slew is over; a
    /// change lies in the middle of what the rows beside it leave open.
    Labels,
    /// Timeline of the scheme, by the times of the samples.
    Timeline,
    /// Column of labels that agrees with the timeline of the scheme, which sets the start and end of a
    /// position.
    Both,
    /// Intervals at rest that were found, as many as the scheme has positions; slews lie in the middle
    /// between them.
    Static,
}

/// Assumptions of the estimates: conditions, noise, priors and gate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Assumed {
    /// Latitude of the calibration, in deg.
    pub latitude_deg: f64,
    /// True if the scheme states no latitude.
    pub latitude_by_default: bool,
    /// Acceleration of one g, in m/s^2.
    pub gravity_m_s2: f64,
    /// Width of a bin, in s: samples within it are taken together.
    pub bin_s: f64,
    /// White noise of Z per sample and axis as given, in g.
    pub accelerometer_noise_g: f64,
    /// True if the noise was estimated from the records.
    pub noise_estimated: bool,
    /// Density of the white drift, in deg/sqrt(h).
    pub drift_noise_deg_sqrt_h: f64,
    /// Probability that no measurement of a right record is left out.
    pub gate: f64,
    /// Names of the unknowns and combinations taken from a calibration before.
    pub known: Vec<String>,
    /// Differences of the scheme of that calibration.
    pub known_differs: Vec<String>,
    /// Priors that the estimates hold as stated: name of the unknown, standard deviation in its unit, and
    /// that unit. Empty: estimates by the data alone.
    #[serde(default)]
    pub priors: Vec<(String, f64, String)>,
    /// Box of what the records leave open: name of the unknown, one standard deviation in its unit, and that
    /// unit.
    #[serde(rename = "held")]
    pub constrained: Vec<(String, f64, String)>,
    /// Keys of the conditions that nobody states, so that the program chose them: latitude_deg,
    /// accelerometer_noise_g, drift_noise.
    #[serde(default)]
    pub by_default: Vec<String>,
    /// Seed of the exact verdicts.
    pub seed: u64,
}

/// Residuals of a component in a record, in order of time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ResidualSeries {
    /// Name of the record with these residuals.
    pub record: String,
    /// Component of Z: `Z1`, `Z2`, `Z3` or `Za`.
    pub channel: String,
    /// Unit of the residuals: g or rad.
    pub unit: String,
    /// Time in s, residual and its sigma by the assumed noise in the unit of `unit`: at most a thousand
    /// points, evenly picked.
    pub points: Vec<(f64, f64, f64)>,
    /// Correlation of the residuals with those one, two, ... measurements later, dimensionless.
    pub autocorrelation: Vec<f64>,
    /// Number of residuals, listed here or not.
    pub count: usize,
    /// Cluster time in s, overlapping Allan deviation of the residuals (IEEE Std 952-1997, C.1), and that of
    /// white residuals of the assumed sigma, both in the unit of `unit`; slews take no time here.
    pub allan: Vec<(f64, f64, f64)>,
}

/// Residual of one measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// Index of the record, from 0.
    pub record: usize,
    /// Index of the position, from 0.
    pub position: usize,
    /// Index of the channel, from 0.
    pub channel: usize,
    /// Time of the measurement, in s.
    pub t_s: f64,
    /// Measurement minus estimate, in g or rad.
    pub residual: f64,
    /// Standard deviation by the assumed noise, in g or rad.
    pub sigma: f64,
    /// Difference from the value that all other measurements predict, over its standard deviation.
    pub normalised: f64,
}
