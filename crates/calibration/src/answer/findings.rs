//! Findings of a calibration: evidence against the model, the record or the stated sigmas.

use obsdeg_core::span::Span;
use obsdeg_evidence::simulation::omitted::{ChangePerUnit, Suspicion};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::records::ClockRate;

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
        lines: Span<u64>,
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
        lines: Span<u64>,
        /// Times of the first and the last one, in s of the record's timeline.
        span_s: Span<f64>,
        /// Least and largest distance from the expected value, in standard deviations (dimensionless).
        sigmas: Span<f64>,
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
