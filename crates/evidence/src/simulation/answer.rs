//! The answer of one run: plain data.

use obsdeg_core::degree::Status;
use obsdeg_core::model::settings::{FilterKind, Propagation, Truth};
use obsdeg_core::model::slew::Turn;
use obsdeg_core::model::{Carry, GimbalReport, Scheme};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::carries::OtherCarry;
use super::conditions::{Conditions, latitude_of};
use super::consistency::{CREDIBLE, Consistency};
use super::datasheet::GyroNoise;
use super::floor::NoiseFloor;
pub use super::validity::Validity;
use crate::requirements::{Miss, Requirements, meets};

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.simulation/2";

/// One run of the filter against a simulated truth.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Simulation {
    /// `obsdeg.simulation/2`.
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
    /// Outcome of the requirements by prediction, as in every other command: the information of all samples
    /// with the noise, the random drift and the priors that are stated.
    pub requirements: Requirements,
    /// Outcome of the requirements in this run, by the sigmas of its filter at the end.
    pub run: RunRequirements,
    /// The same scheme under the other carries.
    pub other_carries: Vec<OtherCarry>,
    /// Whether errors and innovations are what the filter believes.
    pub consistency: Consistency,
    /// Which filter it is, and why.
    pub filter: FilterReport,
    /// Whether the linear model holds for these drifts.
    pub validity: Validity,
    /// How well coefficients can be known however long the dwells; left out where the gyros have no noise of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_floor: Option<NoiseFloor>,
    /// Angles and turns beyond the gimbal limits that the scheme states; left out where it states none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gimbals: Option<GimbalReport>,
    /// Seed of the noise.
    pub seed: u64,
}

/// A run's sigmas against the requirements, beside the prediction.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RunRequirements {
    /// Outcome of the requirements in the run.
    pub requirements: Requirements,
    /// The largest ratio of a sigma of the run to the predicted one, over the unknowns that have both; null
    /// where none has.
    pub largest_ratio: Option<SigmaRatio>,
    /// The smallest such ratio; null where no unknown has both.
    pub smallest_ratio: Option<SigmaRatio>,
    /// Reasons why the sigmas of the run may differ from the predicted ones.
    pub differs: Vec<RunDiffers>,
}

/// The ratio of a run's sigma to the predicted one.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SigmaRatio {
    /// The unknown.
    pub name: String,
    /// Sigma of the run over the predicted sigma, dimensionless.
    pub ratio: f64,
}

/// Reason why the sigmas of a run may differ from the predicted ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RunDiffers {
    /// The random drift of the program: none is stated.
    RandomDrift,
    /// Priors of the program: not every unknown has a stated one.
    Prior,
    /// A filter with full attitudes: the prediction is that of small angles.
    FullAttitudes,
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
    /// Bias instability of the accelerometers, states of the filter and of the truth; left out where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accelerometer_bias: Option<AccelerometerBias>,
    /// Random drift with its unit.
    pub drift_noise: String,
    /// Its density in deg/sqrt(h) in the shortest and in the longest step of the timeline.
    pub drift_noise_density_deg_sqrt_h: [f64; 2],
    /// The step in s for which a bias of one step was given; null for a density.
    pub drift_noise_step_s: Option<f64>,
    /// Whether the density is another than with that step, by more than 1 %.
    pub drift_noise_differs: bool,
    /// What the datasheet of the gyros says besides, states of the filter and of the truth; left out where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gyro_noise: Option<GyroNoise>,
    /// Propagation of the filter.
    pub propagation: Propagation,
    /// Factor on true drifts and their priors.
    pub drift_scale: f64,
    /// Keys of the conditions that nobody states, so that the run has those of the program: latitude_deg,
    /// accelerometer_noise_g, step_s, dwell_s, azimuth_noise_deg, drift_noise, values, priors.
    pub by_default: Vec<String>,
}

impl ConditionsReport {
    /// True if a prior is stated.
    pub fn states_priors(&self) -> bool {
        !self.by_default.iter().any(|key| key == "priors")
    }
}

/// The bias instability of the accelerometers: a first-order Gauss-Markov process of each, which goes on in platform axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AccelerometerBias {
    /// The coefficient B in ug; sigma of the process is 1.076 B.
    pub instability_ug: f64,
    /// Its correlation time in s.
    pub correlation_time_s: f64,
}

impl AccelerometerBias {
    /// What the conditions say; none where it is zero.
    pub fn of(conditions: &Conditions) -> Option<Self> {
        (conditions.accelerometer_instability_ug > 0.0).then_some(Self {
            instability_ug: conditions.accelerometer_instability_ug,
            correlation_time_s: conditions.accelerometer_correlation_s,
        })
    }
}

/// Conditions of predicted sigmas: the information of all samples with the noise, the random drift and the
/// priors that are stated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MeasurementReport {
    /// Latitude in degrees.
    pub latitude_deg: f64,
    /// Whether the latitude was chosen by the program.
    pub latitude_by_default: bool,
    /// Dwell of positions that do not say theirs, in s.
    pub dwell_s: f64,
    /// Largest step between samples in s; a position is divided into equal steps.
    pub step_s: f64,
    /// Noise of the observation per sample and axis in g.
    pub accelerometer_noise_g: f64,
    /// Bias instability of the accelerometers; left out where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accelerometer_bias: Option<AccelerometerBias>,
    /// Noise of the azimuth per sample in deg; null where it is not measured.
    pub azimuth_noise_deg: Option<f64>,
    /// Rate of slews in deg/s where a position does not say its own; null: instantaneous.
    pub slew_rate_deg_s: Option<f64>,
    /// Random drift that is stated, with its unit; null: none counts.
    #[serde(default)]
    pub drift_noise: Option<String>,
    /// Datasheet of the gyros; left out where they have no noise of their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gyro_noise: Option<GyroNoise>,
    /// Priors that are stated, as 1 sigma in the units of the unknowns; null: none counts.
    #[serde(default)]
    pub prior: Option<String>,
    /// Keys of the conditions above that nobody states, so that the program chose them: latitude_deg,
    /// accelerometer_noise_g, step_s, dwell_s, azimuth_noise_deg.
    #[serde(default)]
    pub by_default: Vec<String>,
}

impl MeasurementReport {
    /// Of `scheme` under `conditions`.
    pub fn new(scheme: &Scheme, conditions: &Conditions) -> Self {
        Self {
            latitude_deg: latitude_of(scheme).map_or(0.0, |l| l.degrees()),
            latitude_by_default: scheme.latitude.is_none(),
            dwell_s: conditions.dwell_s,
            step_s: conditions.step_s,
            accelerometer_noise_g: conditions.accelerometer_noise_g,
            accelerometer_bias: AccelerometerBias::of(conditions),
            azimuth_noise_deg: scheme.measured_azimuth.then_some(conditions.azimuth_noise_deg),
            slew_rate_deg_s: conditions.slew_rate_deg_s.filter(|_| conditions.slews),
            drift_noise: conditions.as_stated().drift_noise_in_words(),
            gyro_noise: (!conditions.gyro_noise.is_none()).then_some(conditions.gyro_noise),
            prior: conditions.stated_prior_in_words(),
            by_default: chosen(scheme, conditions),
        }
    }
}

/// Keys of the conditions of a prediction that nobody states.
pub(super) fn chosen(scheme: &Scheme, conditions: &Conditions) -> Vec<String> {
    let stated = conditions.states();
    let needs_dwell = scheme.positions.iter().any(|p| p.dwell.is_none());
    let all = [
        ("latitude_deg", scheme.latitude.is_none()),
        ("accelerometer_noise_g", !stated.accelerometer_noise),
        ("step_s", !stated.step),
        ("dwell_s", !stated.dwell && needs_dwell),
        ("azimuth_noise_deg", !stated.azimuth_noise && scheme.measured_azimuth),
    ];
    all.into_iter().filter(|(_, by_default)| *by_default).map(|(key, _)| key.into()).collect()
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
    /// How a slew turns; null at a position.
    pub turn: Option<Turn>,
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
    /// Predicted sigma by the conditions that are stated; null where neither samples nor stated priors bound
    /// it.
    pub predicted_sigma: Option<f64>,
    /// Error over sigma.
    pub error_over_sigma: f64,
    /// What the linear filter makes of the same measurements; null where it is the filter.
    pub linear: Option<LinearEstimate>,
    /// Sigma at the start.
    pub prior_sigma: f64,
    /// The sigma to be reached.
    pub required_sigma: Option<f64>,
    /// When it was reached first, in s; null for what the samples do not determine.
    pub time_to_requirement_s: Option<f64>,
    /// What came out.
    pub outcome: Outcome,
    /// On whose prior it rests besides its own: what the outputs do not tell it from. Empty unless it is known from the prior only.
    pub prior_of: Vec<String>,
}

/// What the linear filter says at the end of the run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct LinearEstimate {
    /// Estimate minus truth.
    pub error: f64,
    /// What it believes of the error.
    pub sigma: f64,
}

/// Which filter ran.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FilterReport {
    /// The filter.
    pub kind: FilterKind,
    /// Why this one.
    pub reason: FilterReason,
    /// Linearisations of the whole run: 1 but for the iterated filter.
    pub passes: usize,
    /// Whether they settled.
    pub converged: bool,
}

/// Why a filter was chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FilterReason {
    /// It was asked for.
    Given,
    /// The truth is that of the linear model.
    LinearTruth,
    /// The small-angle model holds for the truth.
    Valid,
    /// It does not.
    NotValid,
}

/// What a run says of one unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Sigma is at or below what is required.
    Reached,
    /// Sigma fell, but not to what is required.
    Converging,
    /// Sigma fell; nothing is required of it.
    Determined,
    /// The samples determine it, but sigma is (nearly) that of the prior.
    RestsOnPrior,
    /// The samples do not determine it: whatever sigma says, it comes of the prior.
    PriorOnly,
    /// The verdict, which is about small angles, has it undetermined; a filter with full attitudes learns of it through large
    /// ones.
    LargeAnglesOnly,
    /// The error is beyond four sigma: the filter is wrong about it.
    Inconsistent,
    /// The error or sigma is no number.
    NoNumber,
}

impl Outcome {
    /// The outcome for an unknown that samples determine or not, with its sigma at the start and at the end.
    pub(crate) fn of(
        determined: bool,
        filter: FilterKind,
        error_over_sigma: f64,
        [prior, sigma]: [f64; 2],
        required: Option<f64>,
    ) -> Self {
        if !(error_over_sigma.is_finite() && sigma.is_finite()) {
            Self::NoNumber
        } else if !determined && (filter == FilterKind::Linear || sigma > 0.9 * prior) {
            Self::PriorOnly
        } else if error_over_sigma.abs() > CREDIBLE {
            Self::Inconsistent
        } else if !determined {
            Self::LargeAnglesOnly
        } else if sigma > 0.9 * prior {
            Self::RestsOnPrior
        } else if required.is_some_and(|r| meets(sigma, r)) {
            Self::Reached
        } else if required.is_some() {
            Self::Converging
        } else {
            Self::Determined
        }
    }

    /// Why it meets no requirement, whatever sigma is.
    pub(crate) fn miss(self) -> Option<Miss> {
        match self {
            Self::Reached | Self::Converging | Self::Determined => None,
            Self::RestsOnPrior => Some(Miss::RestsOnPrior),
            Self::PriorOnly | Self::LargeAnglesOnly => Some(Miss::NotObservable),
            Self::Inconsistent => Some(Miss::Inconsistent),
            Self::NoNumber => Some(Miss::NoNumber),
        }
    }
}
