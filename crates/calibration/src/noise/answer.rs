//! Noise of the sensors of a static record, as plain data.

use obsdeg_core::span::Span;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Name and version of the JSON layout.
pub(crate) const SCHEMA: &str = "obsdeg.allan/1";

/// Noise of the sensors of a static record, by its overlapping Allan deviation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SensorNoiseReport {
    /// Layout of this answer: `obsdeg.allan/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Name of the record, as it was given.
    pub record: String,
    /// Number of rows of the record.
    pub samples: usize,
    /// First and last time of the record, in s.
    pub span_s: Span<f64>,
    /// Usual interval between rows, in s.
    pub interval_s: f64,
    /// Number of gaps: intervals between rows of more than one and a half usual ones, or less than half of
    /// one.
    pub gaps: usize,
    /// Largest deviation of another interval from the usual one, as a fraction of it (dimensionless).
    pub jitter: f64,
    /// Columns that are not used, as in the header of the record.
    pub ignored: Vec<String>,
    /// Noise by column of the record.
    pub columns: Vec<ColumnNoise>,
    /// Keys of a `[simulation]` table for the noise that is resolved.
    pub settings: Vec<NoiseSetting>,
    /// Text of the `[simulation]` table of a scheme file with the keys of `settings`, in TOML.
    pub simulation_table: String,
    /// Statements on the record and on how noise maps to settings.
    pub notes: Vec<String>,
}

/// Kind of a sensor, by the unit of its column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SensorKind {
    /// Gyro: the column is a rate of rotation.
    Gyro,
    /// Accelerometer: the column is a specific force.
    Accelerometer,
}

/// Noise of one column of a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColumnNoise {
    /// Column, as in the header of the record.
    pub column: String,
    /// Kind of the sensor, by the unit of the column.
    pub sensor: SensorKind,
    /// Unit of the deviations: deg/h (gyro) or ug (accelerometer).
    pub unit: String,
    /// Number of samples that count.
    pub samples: usize,
    /// Number of cells that are empty or NaN.
    pub empty_cells: usize,
    /// Number of cells far from both neighbours, which were left out.
    pub left_out: usize,
    /// Numbers of the first lines with cells that were left out (dimensionless); at most 20.
    pub left_out_lines: Vec<u64>,
    /// Mean of the samples, in the unit of `unit`.
    pub mean: f64,
    /// Noise coefficients by a fit to the Allan variances.
    pub coefficients: Vec<NoiseCoefficient>,
    /// Sum of squared residuals of the fit by the covariance of the Allan variances, dimensionless.
    pub chi_square: f64,
    /// Number of degrees of freedom of the fit.
    pub degrees_of_freedom: usize,
    /// Probability that noise of these kinds leaves a larger sum.
    pub probability: f64,
    /// True if noise of these kinds explains the deviations (probability above 0.001).
    pub explained: bool,
    /// Overlapping Allan deviation by cluster time.
    pub deviations: Vec<AllanDeviation>,
}

/// Kind of noise of a sensor (IEEE Std 952-1997, Annex C).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NoiseKind {
    /// White noise of a rate: angle random walk of a gyro, velocity random walk of an accelerometer; the
    /// deviation falls with the root of the cluster time.
    RandomWalk,
    /// Flicker noise: bias instability; the deviation does not change with the cluster time.
    BiasInstability,
    /// Random walk of a rate: rate random walk of a gyro, acceleration random walk of an accelerometer; the
    /// deviation grows with the root of the cluster time.
    RateRandomWalk,
}

/// Noise coefficient of a sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NoiseCoefficient {
    /// Kind of the noise that the coefficient is of.
    pub noise: NoiseKind,
    /// Name of the coefficient in words.
    pub name: String,
    /// Unit of the coefficient, such as deg/sqrt(h).
    pub unit: String,
    /// True if the record resolves the coefficient: its square is more than three standard deviations.
    pub resolved: bool,
    /// Estimate in the unit of `unit`; null if not resolved.
    pub value: Option<f64>,
    /// Standard deviation of the estimate in the unit of `unit`; null if not resolved.
    pub sigma: Option<f64>,
    /// Upper limit in the unit of `unit`: the coefficient lies below it with probability 0.95.
    pub limit: f64,
    /// Least coefficient that this record resolves beside its other noise, in the unit of `unit`.
    pub least_resolved: f64,
}

/// Overlapping Allan deviation at one cluster time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AllanDeviation {
    /// Cluster time of the deviation, in s.
    pub tau_s: f64,
    /// Number of samples of a cluster.
    pub samples: usize,
    /// Deviation, in the unit of the column's `unit`.
    pub deviation: f64,
    /// Lower end of the confidence band, in the unit of the column's `unit`.
    pub low: f64,
    /// Upper end of the confidence band, in the unit of the column's `unit`.
    pub high: f64,
    /// Degrees of freedom of the variance, by the fitted noise (dimensionless).
    pub degrees_of_freedom: f64,
    /// Deviation of the fitted noise, in the unit of the column's `unit`.
    pub fitted: f64,
}

/// Key of a `[simulation]` table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NoiseSetting {
    /// Key of the table, with its unit, such as `angle_random_walk_deg_sqrt_h`.
    pub key: String,
    /// Values in the unit of the name of `key`: one, or three for the gyros X, Y, Z.
    pub values: Vec<f64>,
}
