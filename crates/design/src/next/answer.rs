//! Next positions of a scheme: plain data.

use std::collections::BTreeMap;

use obsdeg_core::model::{Carry, Geometry};
use obsdeg_core::remedies::Resolved;
use obsdeg_evidence::requirements::{Requirements, Worst};
use obsdeg_evidence::simulation::MeasurementReport;
use schemars::JsonSchema;
use serde::Serialize;

/// Name and version of the JSON layout.
pub(crate) const NEXT_SCHEMA: &str = "obsdeg.next/1";

/// Positions by which a scheme gains most.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NextPositions {
    /// Layout of this answer: `obsdeg.next/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Carry: quantity that continues from one position to the next.
    pub carry: Carry,
    /// Mounting of the gyros and accelerometers.
    pub geometry: Geometry,
    /// Unknown terms of the gyro model.
    pub terms: String,
    /// Positions of the scheme before the added ones; empty after a calibration.
    pub positions: Vec<String>,
    /// Euler angles alpha, beta, gamma of each of the `positions` in degrees, as text; of one with a rotation
    /// at its start.
    pub position_angles: Vec<String>,
    /// True if the covariance of a calibration is known beforehand: the added positions are a run of their
    /// own.
    pub after_calibration: bool,
    /// Number of days of ageing since the calibration; null without ageing.
    pub days: Option<f64>,
    /// Ageing of the coefficients as stated: random walk in the unit of the coefficient per sqrt(day).
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub ageing: BTreeMap<String, f64>,
    /// Names of the table of ageing that are no coefficients of the scheme, and have no effect.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unused_ageing: Vec<String>,
    /// Requalification after each requested number of days; left out without days.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub schedule: Vec<Requalification>,
    /// Candidates for the added positions, within the gimbal limits.
    pub candidates: Vec<String>,
    /// Candidates beyond the gimbal limits.
    pub beyond_gimbals: Vec<String>,
    /// Number of added positions.
    pub added: usize,
    /// Coefficients that must be observable and are compared.
    pub required: Vec<String>,
    /// Conditions of the measurement.
    pub conditions: MeasurementReport,
    /// State before the added positions; null for a scheme without positions.
    pub before: Option<Standing>,
    /// Observable degrees before the added positions, in the order of `required`: null for a coefficient that
    /// is not observable; empty for a scheme without positions and after a calibration.
    pub degrees_before: Vec<Option<usize>>,
    /// Best extensions, best first.
    pub found: Vec<Extension>,
    /// State with each single candidate added, best first; left out where two positions are added. Candidates
    /// beyond the limits of time are missing, and those not compared before an interruption.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub by_candidate: Vec<CandidateGain>,
    /// Number of extensions as good as the first, including the first.
    pub as_good: u64,
    /// Bound over all attitudes, not the candidates alone; null unless one position is added after a
    /// calibration that determines the first-order drift coefficients one by one.
    pub bound: Option<AttitudeBound>,
    /// Shortest dwell, equal at all positions of the first extension, with which every requirement is met;
    /// null without requirements, or if no dwell up to 16 times the stated one meets them.
    pub meets: Option<Meeting>,
    /// Number of extensions compared.
    pub examined: u64,
    /// True if every extension by the candidates was compared, so that the first is the best of all.
    pub proven: bool,
    /// True if the comparison was stopped early.
    pub interrupted: bool,
    /// Requirements on unknowns outside `required`: this answer does not judge them.
    pub not_judged: Vec<String>,
    /// Bound on the probability that the verdicts of one extension are wrong.
    pub error_bound: f64,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Bound on sigmas with one more position of the stated dwell, whatever its attitude: without a bench and
/// without random drift, which only add to sigmas.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AttitudeBound {
    /// Smallest sigma of each required drift coefficient by any attitude, each by itself.
    pub sigmas: Vec<Worst>,
    /// Smallest value by any attitude of the largest ratio of sigma to requirement over these coefficients,
    /// dimensionless; null without requirements on them.
    pub ratio: Option<f64>,
    /// Smallest value by any attitude of the largest of these sigmas, in deg/h or deg/h/g; null with
    /// requirements on them.
    pub worst_dph: Option<f64>,
}

/// State of the required coefficients.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Standing {
    /// Required coefficients that neither the samples nor prior knowledge determine.
    pub not_observable: Vec<String>,
    /// Largest observable degree of a required coefficient; null if one has none.
    pub worst_degree: Option<usize>,
    /// Outcome of the requirements.
    pub requirements: Requirements,
    /// Largest sigma (with a bench: total uncertainty) of the determined required drift coefficients; null if
    /// none is determined.
    pub worst: Option<Worst>,
    /// Duration of all positions and slews, in s.
    pub total_s: f64,
}

/// Extension of a scheme by one or two positions.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Extension {
    /// Added positions, in order.
    pub positions: Vec<AddedPosition>,
    /// Required coefficients that become observable, with their degrees.
    pub resolves: Vec<Resolved>,
    /// Required coefficients whose degree becomes lower, with the new degrees.
    pub lowers: Vec<Resolved>,
    /// State with the added positions.
    pub then: Standing,
}

/// State of the required coefficients with one candidate added.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CandidateGain {
    /// Candidate: directions of X_p, Y_p and Z_p, angles, or a name.
    pub candidate: String,
    /// Euler angles alpha, beta, gamma in degrees, as text.
    pub angles: String,
    /// Number of required coefficients that neither the samples nor prior knowledge determine.
    pub not_observable: usize,
    /// Largest ratio of uncertainty to requirement, dimensionless; null without requirements, or if no
    /// coefficient with a requirement is determined.
    pub ratio: Option<f64>,
    /// Largest sigma (with a bench: total uncertainty) of the determined required drift coefficients; null if
    /// none is determined.
    pub worst: Option<Worst>,
    /// Observable degrees in the order of `required`; null for a coefficient that is not observable.
    pub degrees: Vec<Option<usize>>,
}

/// Position that is added to a scheme.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AddedPosition {
    /// Name of the position in the extended scheme.
    pub name: String,
    /// Candidate: directions of X_p, Y_p and Z_p, angles, or a name.
    pub candidate: String,
    /// Euler angles alpha, beta, gamma in degrees, as text.
    pub angles: String,
    /// Axis of the half turn to the position: dimensionless components North, Up, East; left out for other
    /// turns, and if slews take no time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_turn_about: Option<[f64; 3]>,
}

/// Requalification after a number of days: runs that meet the requirements again.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Requalification {
    /// Number of days since the calibration.
    pub days: f64,
    /// State of the aged coefficients without a measurement.
    pub before: Standing,
    /// Smallest number of positions with the stated dwell that meets every requirement: 0 if they are met
    /// without a measurement; null if no extension by up to `added` positions meets them.
    pub fewest: Option<usize>,
    /// Best extension with the fewest positions; null if `fewest` is 0 or null.
    pub best: Option<Extension>,
    /// Shortest run of up to `added` positions, with an equal dwell at each, that meets every requirement;
    /// null if `fewest` is 0, or if no run meets them with 16 times the stated dwell.
    pub quickest: Option<Quickest>,
    /// Number of extensions compared: all by the candidates.
    pub examined: u64,
}

/// Shortest run that meets the requirements.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Quickest {
    /// Positions of the run, in order.
    pub positions: Vec<AddedPosition>,
    /// Dwell at each position, in s, in whole seconds.
    pub dwell_s: f64,
    /// Duration of the run with its slews, in s.
    pub total_s: f64,
}

/// Shortest dwell that meets the requirements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Meeting {
    /// Dwell at each added position, in s, in whole seconds.
    pub dwell_s: f64,
    /// Duration of all positions and slews with this dwell, in s.
    pub total_s: f64,
}
