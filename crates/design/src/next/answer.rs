//! The next positions of a scheme: plain data.

use std::collections::BTreeMap;

use obsdeg_core::model::{Carry, Geometry};
use obsdeg_core::remedies::Resolved;
use obsdeg_evidence::requirements::{Requirements, Worst};
use obsdeg_evidence::simulation::MeasurementReport;
use schemars::JsonSchema;
use serde::Serialize;

/// Name and version of the JSON layout.
pub const NEXT_SCHEMA: &str = "obsdeg.next/1";

/// Positions that a scheme gains most by.
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
    /// Positions of the scheme, before those that are added; empty where a calibration is the start.
    pub positions: Vec<String>,
    /// True if the covariance of a calibration is known beforehand: the added positions are a run of their
    /// own.
    pub after_calibration: bool,
    /// Days since the calibration, in which the coefficients aged; null without ageing.
    pub days: Option<f64>,
    /// Ageing of the coefficients as stated: random walk in the unit of the coefficient per sqrt(day).
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub ageing: BTreeMap<String, f64>,
    /// Requalification after each number of days asked for; left out without one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub schedule: Vec<Requalification>,
    /// Candidates for the added positions, within the gimbal limits.
    pub candidates: Vec<String>,
    /// Candidates that the gimbals do not reach.
    pub beyond_gimbals: Vec<String>,
    /// Number of positions that are added.
    pub added: usize,
    /// Coefficients that must be observable and that are compared.
    pub required: Vec<String>,
    /// Conditions of the measurement.
    pub conditions: MeasurementReport,
    /// State without more positions; null if it cannot be computed.
    pub before: Option<Standing>,
    /// Best extensions, best first.
    pub found: Vec<Extension>,
    /// Number of extensions that are as good as the first, the first included.
    pub as_good: u64,
    /// Least dwell at the positions of the first extension, the same at each, with which every requirement is
    /// met; null if none is stated, or if no dwell up to 16 times the stated one meets them.
    pub meets: Option<Meeting>,
    /// Number of extensions that were compared.
    pub examined: u64,
    /// True if every extension by the candidates was compared: the first is the best of all.
    pub proven: bool,
    /// True if the comparison was stopped early.
    pub interrupted: bool,
    /// Requirements on unknowns outside `required`, which this answer does not judge.
    pub not_judged: Vec<String>,
    /// Bound on the probability that the verdicts of one extension are wrong.
    pub error_bound: f64,
    /// Seed of all random choices.
    pub seed: u64,
}

/// State of the required coefficients.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Standing {
    /// Required coefficients that neither samples nor what is known beforehand bound.
    pub not_observable: Vec<String>,
    /// Largest observable degree of a required coefficient; null if one has none.
    pub worst_degree: Option<usize>,
    /// Outcome of the requirements.
    pub requirements: Requirements,
    /// Largest sigma, with a bench the largest total uncertainty, of the required drift coefficients that are
    /// bounded; null if there is none.
    pub worst: Option<Worst>,
    /// Duration of all positions and slews, in s.
    pub total_s: f64,
}

/// Extension of a scheme.
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

/// Position that is added to a scheme.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct AddedPosition {
    /// Name of the position in the extended scheme.
    pub name: String,
    /// Candidate: directions of X_p, Y_p and Z_p, angles, or a name.
    pub candidate: String,
    /// Euler angles alpha, beta, gamma in degrees, as text.
    pub angles: String,
    /// Axis (North, Up, East) of the half turn that leads to the position, where slews take time; left out
    /// for other turns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_turn_about: Option<[f64; 3]>,
}

/// What brings the coefficients back to their requirements after a number of days.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Requalification {
    /// Days since the calibration.
    pub days: f64,
    /// State of the aged coefficients without a measurement.
    pub before: Standing,
    /// Fewest positions, of the stated dwell, with which every requirement is met: 0 if they are met without
    /// a measurement; null if no extension by up to the number of added positions meets them.
    pub fewest: Option<usize>,
    /// Best extension of that many positions; null for 0.
    pub best: Option<Extension>,
    /// Shortest run of up to the number of added positions, with one dwell at each, that meets every
    /// requirement; null for 0 positions, and if none meets them with 16 times the stated dwell.
    pub quickest: Option<Quickest>,
    /// Number of extensions that were compared: all by the candidates.
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

/// Dwell that meets the requirements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Meeting {
    /// Dwell at each added position, in s, in whole seconds.
    pub dwell_s: f64,
    /// Duration of all positions and slews with this dwell, in s.
    pub total_s: f64,
}
