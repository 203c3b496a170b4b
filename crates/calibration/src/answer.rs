//! What a calibration says: plain data.

use obsdeg_core::degree::Status;
use obsdeg_core::model::settings::Assignment;
use obsdeg_evidence::requirements::Requirements;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::setup::{Basis, Setup};

/// Name and version of the JSON layout.
pub(crate) const SCHEMA: &str = "obsdeg.calibration/1";

/// A calibration from records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Calibration {
    /// `obsdeg.calibration/1`.
    pub schema: String,
    /// Version of the program.
    pub version: String,
    /// Whether the model and its sigmas explain the records.
    pub consistent: bool,
    /// What speaks against that, the gravest first; empty when nothing does.
    pub findings: Vec<Finding>,
    /// Every unknown, psi of the start of each record.
    pub quantities: Vec<Estimated>,
    /// Outcome of the requirements on coefficients by the sigmas of the estimates, rescaled where they are
    /// too small; null where none is stated. Those on psi are not judged: a calibration estimates psi of the
    /// start of a record.
    #[serde(default)]
    pub requirements: Option<Requirements>,
    /// Combinations of what is not told apart one by one, and those asked for.
    pub combinations: Vec<Estimated>,
    /// Of all that has an estimate.
    pub covariance: CovarianceTable,
    /// The whole fit.
    pub fit: Fit,
    /// By record and position.
    pub positions: Vec<PositionFit>,
    /// By component of Z.
    pub channels: Vec<ChannelFit>,
    /// Measurements that were left out.
    pub outliers: Vec<Outlier>,
    /// How many samples were left out in all.
    pub outlier_count: usize,
    /// The second path to the estimate.
    pub second_path: SecondPath,
    /// How far the coefficients of several records agree.
    pub repeatability: Option<Repeatability>,
    /// What was read.
    pub records: Vec<RecordReport>,
    /// What was assumed.
    pub assumed: Assumed,
    /// What it is of.
    pub setup: Setup,
    /// The records that it rests on, those of the calibration before too.
    pub rests_on: Vec<Basis>,
    /// What is left over time, by record and component.
    pub series: Vec<ResidualSeries>,
    /// Every measurement and what the estimate leaves of it.
    #[serde(skip)]
    #[schemars(skip)]
    pub residuals: Vec<Residual>,
}

impl Calibration {
    /// Its platform as true values of another run: what is determined, psi that of the first record.
    pub fn values(&self) -> Vec<Assignment> {
        let first = |e: &Estimated| {
            let name = e.name.strip_suffix(" (record 1)").unwrap_or(&e.name).to_string();
            Some(Assignment { value: e.estimate.filter(|_| !name.contains(" (record "))?, name })
        };
        self.quantities.iter().filter_map(first).collect()
    }
}

/// What speaks against the model or its sigmas.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Finding {
    /// The iteration was interrupted: the estimates are where it was then.
    Interrupted,
    /// The iteration did not settle.
    NotSettled,
    /// The specific force is not one g long, and no unknown explains that.
    Force {
        /// The record.
        record: String,
        /// Its mean length, in g.
        length_g: f64,
        /// Whether it is as long at all positions.
        alike: bool,
        /// Where it is shortest.
        least: ForceLength,
        /// Where it is longest.
        most: ForceLength,
        /// Each of these alone makes it one g long: none where several axes are off, or all alike.
        causes: Vec<ForceCause>,
    },
    /// Cells of a column that hold one value again and again, far from their neighbours or many times in a
    /// row; they were left out.
    Cells {
        /// The record.
        record: String,
        /// The column, as its header is written.
        column: String,
        /// What these cells may be.
        kind_of_cells: CellKind,
        /// The value, as it is written.
        value: f64,
        /// Number of cells.
        count: usize,
        /// First and last line.
        lines: (u64, u64),
    },
    /// The clock of a record does not go as fast as that of the scheme, or as the earth turns.
    Clock {
        /// The record.
        record: String,
        /// By which part it is fast, as positions begin and end.
        by_durations: Option<f64>,
        /// The same by the rate of the earth, where that is beyond chance.
        by_earth: Option<ClockByEarth>,
    },
    /// A position fits worse than its measurements allow.
    Position {
        /// The record.
        record: String,
        /// The position.
        position: String,
        /// Chi-square per degree of freedom.
        chi_square: f64,
        /// How many times too small the sigmas are there: its root.
        factor: f64,
    },
    /// All positions fit alike, and not as their sigmas say.
    Noise {
        /// Chi-square per degree of freedom.
        chi_square: f64,
        /// What the sigmas are to be multiplied by.
        factor: f64,
    },
    /// A component of Z fits not as its sigma says.
    Channel {
        /// The component.
        channel: String,
        /// Chi-square per degree of freedom.
        chi_square: f64,
        /// What its sigma is to be multiplied by.
        factor: f64,
    },
    /// The residuals of a component are not independent of each other.
    Correlated {
        /// The record.
        record: String,
        /// The component.
        channel: String,
        /// Probability that independent ones are correlated so.
        probability: f64,
    },
    /// The residuals of a component go with the temperature.
    Temperature {
        /// The record.
        record: String,
        /// The component.
        channel: String,
        /// The coefficient of correlation.
        correlation: f64,
        /// Probability of that by chance.
        probability: f64,
    },
    /// Too many measurements lie far off for all of them to be outliers; none of these was left out.
    Outliers {
        /// How many.
        count: usize,
        /// Of so many.
        of: usize,
    },
    /// The records do not agree on the coefficients.
    Repeatability {
        /// Chi-square per degree of freedom.
        chi_square: f64,
    },
    /// Filter and least squares do not agree.
    SecondPath {
        /// The largest difference, in sigma.
        difference: f64,
    },
    /// What was known before does not agree with the records.
    Known {
        /// Chi-square per degree of freedom.
        chi_square: f64,
    },
}

/// What cells may be that hold one value again and again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CellKind {
    /// A code of missing values: it is far from its neighbours.
    Code,
    /// An output that is stuck: it is what the rows before it have to the last digit.
    Stuck,
}

/// How long the specific force is at a position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ForceLength {
    /// The position.
    pub position: String,
    /// In g.
    pub length_g: f64,
}

/// What one axis may be off by, so that the specific force is not one g long.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ForceCause {
    /// What it is an error of.
    pub error: ForceError,
    /// The output of the accelerometer: fx, fy, fz.
    pub axis: String,
    /// What is recorded is larger by this: as a part (scale), or in g (zero).
    pub by: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// The part by which the force is longer besides, at all positions alike.
    pub besides: Option<f64>,
}

/// What an axis is off in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceError {
    /// Its scale.
    Scale,
    /// Its zero.
    Zero,
}

/// An unknown or a combination.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Estimated {
    /// Its name.
    pub name: String,
    /// Its unit: deg, deg/h, deg/h/g, ...
    pub unit: String,
    /// The exact verdict of the scheme.
    pub status: Status,
    /// The observable degree.
    pub degree: Option<usize>,
    /// Whether scheme and records determine it; otherwise there is no estimate.
    pub determined: bool,
    /// The estimate.
    pub estimate: Option<f64>,
    /// Its standard deviation, by the noise that was assumed.
    pub sigma: Option<f64>,
    /// The same with errors of the records times the root of chi-square per degree of freedom, where that is above one; what was known before stays as it is.
    pub sigma_rescaled: Option<f64>,
    /// What the linear model has at the times and with the noise of the records (and what was known before), where the platform is at the attitudes of the scheme.
    pub predicted_sigma: Option<f64>,
    /// What sigma is times that with all known that nothing determines: above one where the nonlinear model bends what is held within its prior into the estimate.
    pub held_factor: Option<f64>,
    /// How far the prior of the scheme would move the estimate, in sigma.
    pub prior_shift: Option<f64>,
    /// What it would make of sigma: 1 where it does not matter.
    pub prior_factor: Option<f64>,
}

/// Estimates with their covariance.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct CovarianceTable {
    /// Names, in the order of rows and columns.
    pub names: Vec<String>,
    /// Their units.
    pub units: Vec<String>,
    /// Their estimates.
    pub estimates: Vec<f64>,
    /// The covariance of their errors, by the noise that was assumed.
    pub covariance: Vec<Vec<f64>>,
    /// The same with errors of the data times the root of chi-square per degree of freedom, where that is above one; what was known before stays as it is.
    pub rescaled: Vec<Vec<f64>>,
}

/// A calibration before, of what `S` says.
#[derive(Debug, Clone, PartialEq)]
pub struct Before<S> {
    /// Its estimates; the covariance is the one that counts.
    pub estimates: CovarianceTable,
    /// The records that it rests on, those of its own prior too.
    pub rests_on: Vec<Basis>,
    /// What it is of.
    pub of: S,
}

/// How well everything fits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fit {
    /// The sum of squares of all residuals, in sigma.
    pub chi_square: f64,
    /// Its degrees of freedom.
    pub degrees_of_freedom: f64,
    /// Where chi-square per degree of freedom lies with a probability of 99.9 %.
    pub band: (f64, f64),
    /// The root of chi-square per degree of freedom: what sigmas are to be multiplied by.
    pub factor: f64,
    /// Linearisations.
    pub passes: usize,
}

/// How well a position fits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PositionFit {
    /// The record.
    pub record: String,
    /// The position.
    pub position: String,
    /// From when, in s of the record's timeline.
    pub start_s: f64,
    /// To when.
    pub end_s: f64,
    /// How long the specific force is there, in g, where the record has it: a median, which single samples do not move.
    pub force_g: Option<f64>,
    /// Measurements: components of Z of bins.
    pub measurements: usize,
    /// Chi-square per degree of freedom.
    pub chi_square: f64,
    /// The degrees of freedom.
    pub degrees_of_freedom: f64,
    /// Without it: the unknown that moves most, in standard deviations of the move.
    pub moves: Option<Moved>,
    /// Without it these are not determined.
    pub loses: Vec<String>,
}

/// An unknown that moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Moved {
    /// Its name.
    pub name: String,
    /// By how much, in standard deviations.
    pub sigmas: f64,
}

/// How well a component of Z fits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChannelFit {
    /// `Z1`, `Z2`, `Z3` or `Za`.
    pub channel: String,
    /// Unit of its sigmas.
    pub unit: String,
    /// Of a sample, as it was used.
    pub sigma: f64,
    /// Of a sample, by the scatter of the samples of a bin about a line; null where bins have too few.
    pub scatter: Option<f64>,
    /// Chi-square per degree of freedom.
    pub chi_square: f64,
    /// The degrees of freedom.
    pub degrees_of_freedom: f64,
    /// Smallest probability over the records that independent residuals are correlated as these are; null for few.
    pub whiteness_probability: Option<f64>,
    /// How residuals go with the temperature, in the record where that is least likely by chance; null without one, and for few.
    pub temperature: Option<Warmth>,
}

/// How residuals go with the temperature, position by position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Warmth {
    /// The coefficient of correlation at the position where it is strongest.
    pub correlation: f64,
    /// Probability that residuals that do not depend on it are correlated so, all positions together (R. A. Fisher, Metron 1, 1921).
    pub probability: f64,
}

/// A measurement that was left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Outlier {
    /// The record.
    pub record: String,
    /// Its lines, from and to.
    pub lines: (u64, u64),
    /// When, in s of the record's timeline.
    pub t_s: f64,
    /// The component of Z or, of a single cell, the column of the record.
    pub channel: String,
    /// How far it is off, in standard deviations.
    pub sigmas: f64,
}

/// The filter against least squares, with one wide prior for both.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SecondPath {
    /// The largest difference of the estimates at the end of a record, in sigma.
    pub difference: f64,
    /// The largest difference of sigmas there, as a part.
    pub sigma_difference: f64,
}

/// Several records, one platform.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Repeatability {
    /// What the coefficients of the records differ by, as chi-square per degree of freedom.
    pub chi_square: f64,
    /// The degrees of freedom.
    pub degrees_of_freedom: f64,
    /// Where it lies with a probability of 99.9 %.
    pub band: (f64, f64),
}

/// A record that was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RecordReport {
    /// Its name.
    pub name: String,
    /// Its samples.
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
    /// Samples at no position of the scheme.
    pub unused: usize,
    /// Bins.
    pub bins: usize,
    /// First and last time, in s as they are in the record.
    pub span_s: (f64, f64),
    /// What says where each sample was taken.
    pub positions_by: PositionsBy,
    /// Columns that nothing was made of.
    pub ignored: Vec<String>,
    /// The mean length of the specific force, in g, where the record has it.
    pub force_g: Option<f64>,
    /// How far the gimbals are from the attitudes of the scheme at most, in deg, where the record has their angles.
    pub gimbals_deg: Option<f64>,
    /// Its clock.
    pub clock: Clock,
}

/// Empty cells of a column.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EmptyCells {
    /// The column, as its header is written.
    pub column: String,
    /// Number of its cells that are empty or NaN, in rows at positions.
    pub count: usize,
}

/// An interval without rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Gap {
    /// Time of the row before it, in s as it is in the record.
    pub from_s: f64,
    /// Time of the row after it, in s as it is in the record.
    pub to_s: f64,
    /// Line of the row after it.
    pub line: u64,
    /// Position that the rows before and after it were taken at, or the two positions.
    pub place: String,
}

/// How right the clock of a record is.
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
    /// By which part it is fast, where positions begin and end as in a scheme whose times are so many times as long: a clock, or a scheme that was run so.
    pub by_durations: Option<f64>,
    /// By which part it is fast by the rate of the earth when all unknowns follow; drifts are too small by the same part. Nothing where sigma would be above a third.
    pub by_earth: Option<ClockByEarth>,
}

/// A clock by the rate of the earth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClockByEarth {
    /// The part by which it is fast.
    pub fast: f64,
    /// Its standard deviation: a part that is not much larger does not show.
    pub sigma: f64,
}

/// What says where a sample was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PositionsBy {
    /// A column of labels: a position ends with its last sample, and the next begins when the slew is over.
    Labels,
    /// The timeline of the scheme.
    Timeline,
    /// A column of labels that agrees with the timeline of the scheme, which says when a position begins and ends.
    Both,
    /// Intervals at rest that were found, as many as the scheme has positions: turns are in the middle of what is between them.
    Static,
}

/// What was assumed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Assumed {
    /// In deg.
    pub latitude_deg: f64,
    /// Whether the scheme names no latitude.
    pub latitude_by_default: bool,
    /// What one g is.
    pub gravity_m_s2: f64,
    /// Samples within so many s are taken together.
    pub bin_s: f64,
    /// White noise of Z per sample and axis in g, as it was given.
    pub accelerometer_noise_g: f64,
    /// Whether the noise was estimated from the records.
    pub noise_estimated: bool,
    /// White drift.
    pub drift_noise_deg_sqrt_h: f64,
    /// Probability that no measurement of a right record is left out.
    pub gate: f64,
    /// Names taken from a calibration before.
    pub known: Vec<String>,
    /// What is different in the scheme of that.
    pub known_differs: Vec<String>,
    /// What nothing determines, unknown by unknown: the standard deviation within which it is held, in its unit.
    pub held: Vec<(String, f64, String)>,
    /// Keys of the conditions that nobody states, so that the program chose them: latitude_deg,
    /// accelerometer_noise_g, drift_noise.
    #[serde(default)]
    pub by_default: Vec<String>,
    /// Seed of the exact verdicts.
    pub seed: u64,
}

/// What is left of a component of a record, in the order of time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ResidualSeries {
    /// The record.
    pub record: String,
    /// The component.
    pub channel: String,
    /// The unit of residuals.
    pub unit: String,
    /// Time in s, residual and its sigma by the noise that was assumed: at most a thousand, evenly picked.
    pub points: Vec<(f64, f64, f64)>,
    /// Their correlation with those one, two, ... measurements later.
    pub autocorrelation: Vec<f64>,
    /// How many there are.
    pub count: usize,
    /// Cluster time in s, the overlapping Allan deviation of the residuals (IEEE Std 952-1997, C.1), and that of white ones of the assumed sigma; turns
    /// between positions take no time here.
    pub allan: Vec<(f64, f64, f64)>,
}

/// A measurement and what is left of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// Which record, from 0.
    pub record: usize,
    /// Which position, from 0.
    pub position: usize,
    /// Which channel, from 0.
    pub channel: usize,
    /// When, in s.
    pub t_s: f64,
    /// What is left of it, in g or rad.
    pub residual: f64,
    /// Its standard deviation by the noise that was assumed.
    pub sigma: f64,
    /// What all other measurements leave of it, in its own standard deviations.
    pub normalised: f64,
}
