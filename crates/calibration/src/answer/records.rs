//! Records of a calibration as read, assumed values, and residuals over time.

use obsdeg_core::json_list;
use obsdeg_core::span::Span;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    pub span_s: Span<f64>,
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
    pub priors: Vec<HeldUnknown>,
    /// Box of what the records leave open: name of the unknown, one standard deviation in its unit, and that
    /// unit.
    #[serde(rename = "held")]
    pub constrained: Vec<HeldUnknown>,
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
    pub points: Vec<ResidualPoint>,
    /// Correlation of the residuals with those one, two, ... measurements later, dimensionless.
    pub autocorrelation: Vec<f64>,
    /// Number of residuals, listed here or not.
    pub count: usize,
    /// Cluster time in s, overlapping Allan deviation of the residuals (IEEE Std 952-1997, C.1), and that of
    /// white residuals of the assumed sigma, both in the unit of `unit`; slews take no time here.
    pub allan: Vec<ResidualDeviation>,
}

/// A column that is used.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ColumnRead {
    /// The header, as it is written.
    pub column: String,
    /// Factor from the unit of the column to s, g, g s (increments of velocity), rad or degC.
    pub factor: f64,
}

/// Unknown that a standard deviation holds; in JSON `[name, sigma, unit]`.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldUnknown {
    /// Name of the unknown.
    pub name: String,
    /// Standard deviation, in `unit`.
    pub sigma: f64,
    /// Unit of the standard deviation.
    pub unit: String,
}

json_list!(HeldUnknown { name: String, sigma: f64, unit: String });

/// Residual with its time; in JSON `[t_s, residual, sigma]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualPoint {
    /// Time of the measurement, in s.
    pub t_s: f64,
    /// Residual, in the unit of its series.
    pub residual: f64,
    /// Standard deviation of the residual by the assumed noise, in the same unit.
    pub sigma: f64,
}

json_list!(ResidualPoint { t_s: f64, residual: f64, sigma: f64 });

/// Allan deviation of residuals; in JSON `[tau_s, deviation, white]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualDeviation {
    /// Cluster time, in s.
    pub tau_s: f64,
    /// Overlapping Allan deviation of the residuals, in the unit of their series.
    pub deviation: f64,
    /// Allan deviation of white residuals of the assumed sigma, in the same unit.
    pub white: f64,
}

json_list!(ResidualDeviation { tau_s: f64, deviation: f64, white: f64 });

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
