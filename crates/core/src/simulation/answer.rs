//! The answer of one run: plain data.

use schemars::JsonSchema;
use serde::Serialize;

use super::conditions::{Propagation, Truth};
use crate::analysis::Status;
use crate::model::Carry;

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.simulation/1";

/// One run of the filter against a simulated truth.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Simulation {
    /// `obsdeg.simulation/1`.
    pub schema: String,
    /// Version of the program.
    pub version: String,
    /// What is carried between positions.
    pub carry: Carry,
    /// Under which conditions.
    pub conditions: ConditionsReport,
    /// The timeline.
    pub timeline: Vec<TimelineReport>,
    /// The unknowns in model order: at the end of the run.
    pub quantities: Vec<Estimate>,
    /// Observable combinations of unknowns that are not observable alone.
    pub combinations: Vec<Estimate>,
    /// Whether errors and innovations are what the filter believes.
    pub consistency: Consistency,
    /// Whether the linear model holds for these drifts.
    pub validity: Validity,
    /// Seed of the noise.
    pub seed: u64,
}

/// The conditions of a run with their units.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ConditionsReport {
    /// How the truth is generated.
    pub truth: Truth,
    /// Latitude in degrees.
    pub latitude_deg: f64,
    /// Whether the latitude was chosen by the program.
    pub latitude_by_default: bool,
    /// Largest step in s.
    pub step_s: f64,
    /// Rate of slews in deg/s where a position does not say its own; null: instantaneous.
    pub slew_rate_deg_s: Option<f64>,
    /// Noise of the observation per sample in g.
    pub accelerometer_noise_g: f64,
    /// Random drift with its unit.
    pub drift_noise: String,
    /// Propagation of the filter.
    pub propagation: Propagation,
    /// Factor on true drifts and their priors.
    pub drift_scale: f64,
}

/// A position or slew of the timeline.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TimelineReport {
    /// The position, or the one a slew goes to.
    pub position: String,
    /// Whether it is a slew.
    pub slew: bool,
    /// Start in s.
    pub start_s: f64,
    /// End in s.
    pub end_s: f64,
}

/// The estimate of one unknown or combination at the end of the run.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Estimate {
    /// The unknown or combination.
    pub name: String,
    /// Unit of all its numbers.
    pub unit: String,
    /// The exact verdict.
    pub status: Status,
    /// The observable degree.
    pub degree: Option<usize>,
    /// The accuracy order.
    pub accuracy_order: Option<usize>,
    /// The truth.
    pub truth: f64,
    /// The estimate.
    pub estimate: f64,
    /// Estimate minus truth.
    pub error: f64,
    /// What the filter believes of the error.
    pub sigma: f64,
    /// Error over sigma.
    pub error_over_sigma: f64,
    /// Sigma at the start.
    pub prior_sigma: f64,
    /// The sigma to be reached.
    pub required_sigma: Option<f64>,
    /// When it was reached, in s.
    pub time_to_requirement_s: Option<f64>,
    /// What came out.
    pub verdict: Outcome,
}

/// What a run says of one unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Sigma is at or below what is required.
    Reached,
    /// Sigma fell, but not to what is required.
    Converging,
    /// Sigma is (nearly) that of the prior: the data say nothing.
    PriorOnly,
    /// The error is beyond four sigma: the filter is wrong about it.
    Inconsistent,
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Reached => "reached",
            Self::Converging => "converging",
            Self::PriorOnly => "prior only",
            Self::Inconsistent => "inconsistent",
        })
    }
}

/// Statistics of one run.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Consistency {
    /// Mean normalised innovation squared; its expectation is the number of outputs.
    pub nis: f64,
    /// The band of the mean NIS, 95 %.
    pub nis_band: (f64, f64),
    /// Normalised estimation error squared at the end; its expectation is the number of unknowns.
    pub nees: f64,
    /// Its band, 95 %.
    pub nees_band: (f64, f64),
    /// Probability that white noise has autocorrelations as large as the innovations', smallest over outputs.
    pub whiteness_probability: f64,
    /// Whether the run is credible: NIS within the band of 99.9 %, no error beyond four sigma.
    pub consistent: bool,
}

/// Whether the small-angle model holds for the drifts of a run.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Validity {
    /// Largest `|psi|`, in deg.
    pub largest_psi_deg: f64,
    /// Largest `|psi|^2/2`, in g: what the observation model (6) leaves out.
    pub neglected_g: f64,
    /// Noise of the observation, in g.
    pub accelerometer_noise_g: f64,
    /// Largest g-sensitive coefficient times the largest `|psi|`, in deg/h: what the drift model (3) leaves out.
    pub neglected_dph: f64,
    /// The smallest sigma required of a drift coefficient, in deg/h (per g).
    pub smallest_requirement_dph: Option<f64>,
    /// Whether both are small.
    pub holds: bool,
}
