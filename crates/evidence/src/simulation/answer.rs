//! Answer of one run as plain data.

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
use crate::simulation::omitted::OmittedEffects;

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.simulation/2";

/// Run of the filter against a simulated truth.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Simulation {
    /// Layout of this answer: `obsdeg.simulation/2`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Carry: quantity that continues from one position to the next.
    pub carry: Carry,
    /// Conditions of the run, with their units.
    pub conditions: ConditionsReport,
    /// Positions and slews of the run, in order of time.
    pub timeline: Vec<TimelineReport>,
    /// Estimates of the unknowns at the end of the run, in model order.
    pub quantities: Vec<Estimate>,
    /// Estimates of observable combinations of unknowns that are not observable alone.
    pub combinations: Vec<Estimate>,
    /// Outcome of the requirements by prediction, as in every other command: the information of all samples
    /// with the noise, the random drift and the priors that are stated.
    pub requirements: Requirements,
    /// Outcome of the requirements in this run, by the sigmas of its filter at the end; with a bench by their
    /// totals with its errors, which the truth of the run does not have.
    pub run: RunRequirements,
    /// Outcome of the same scheme under the other carries.
    pub other_carries: Vec<OtherCarry>,
    /// Effect of what the scheme does not estimate, by the weights of the predicted sigmas.
    pub omitted: OmittedEffects,
    /// Consistency of errors and innovations with the filter's covariances.
    pub consistency: Consistency,
    /// Filter of the run, and the reason for it.
    pub filter: FilterReport,
    /// Validity of the small-angle model at these drifts.
    pub validity: Validity,
    /// Noise floor: the least sigmas of coefficients, however long the dwells; left out where the gyros have
    /// no noise of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_floor: Option<NoiseFloor>,
    /// Angles and turns beyond the gimbal limits of the scheme; left out where it states none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gimbals: Option<GimbalReport>,
    /// Seed of the noise and of all random choices.
    pub seed: u64,
}

/// Requirements by the sigmas of a run, beside the prediction.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RunRequirements {
    /// Outcome of the requirements in the run.
    pub requirements: Requirements,
    /// Largest ratio of a sigma of the run to the predicted one, over the unknowns that have both; null if
    /// none has.
    pub largest_ratio: Option<SigmaRatio>,
    /// Smallest ratio of a sigma of the run to the predicted one; null if no unknown has both.
    pub smallest_ratio: Option<SigmaRatio>,
    /// Reasons why the sigmas of the run may differ from the predicted ones.
    pub differs: Vec<RunDiffers>,
}

/// Ratio of a run's sigma to the predicted one.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SigmaRatio {
    /// Name of the unknown with this ratio.
    pub name: String,
    /// Sigma of the run over the predicted sigma, dimensionless.
    pub ratio: f64,
}

/// Reason why the sigmas of a run may differ from the predicted ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RunDiffers {
    /// Random drift of the program, since none is stated.
    RandomDrift,
    /// Priors of the program, since not every unknown has a stated one.
    Prior,
    /// Filter with full attitudes, while the prediction is for small angles.
    FullAttitudes,
}

/// Conditions of a run with their units.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ConditionsReport {
    /// Model that generates the truth: linear or exact.
    pub truth: Truth,
    /// Latitude of the run, in degrees.
    pub latitude_deg: f64,
    /// True if the program chose the latitude.
    pub latitude_by_default: bool,
    /// Largest step between samples, in s.
    pub step_s: f64,
    /// Time at the start of each position at rest, in s, whose samples do not count; left out where all
    /// count.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settle_s: Option<f64>,
    /// Rate of slews in deg/s unless a position states its own; null for instantaneous slews.
    pub slew_rate_deg_s: Option<f64>,
    /// Noise of the observation per sample, in g.
    pub accelerometer_noise_g: f64,
    /// Bias instability of the accelerometers, states of the filter and of the truth; left out where there is
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accelerometer_bias: Option<AccelerometerBias>,
    /// Random drift with its unit.
    pub drift_noise: String,
    /// Density of the random drift, in deg/sqrt(h), in the shortest and in the longest step of the timeline.
    pub drift_noise_density_deg_sqrt_h: [f64; 2],
    /// Step, in s, for which a bias of one step was given; null for a density.
    pub drift_noise_step_s: Option<f64>,
    /// True if the density differs by more than 1 % from that with the given step.
    pub drift_noise_differs: bool,
    /// Noise of the gyros by their datasheet, states of the filter and of the truth; left out where there is
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gyro_noise: Option<GyroNoise>,
    /// Propagation of the filter: exponential or rk4.
    pub propagation: Propagation,
    /// Factor on the true drifts and their priors, dimensionless.
    pub drift_scale: f64,
    /// Bench that is stated: sizes (one sigma) of errors that are not estimated, in their units; left out
    /// where none is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bench: Option<String>,
    /// Keys of the conditions that nobody states, so that the run has those of the program: latitude_deg,
    /// accelerometer_noise_g, step_s, dwell_s, azimuth_noise_deg, drift_noise, values, priors; other_values
    /// and other_priors where they are stated for some of the unknowns only.
    pub by_default: Vec<String>,
}

impl ConditionsReport {
    /// True if a prior is stated.
    pub fn states_priors(&self) -> bool {
        !self.by_default.iter().any(|key| key == "priors")
    }
}

/// Bias instability of the accelerometers: a first-order Gauss-Markov process of each, which continues in
/// platform axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AccelerometerBias {
    /// Coefficient B of the bias instability, in ug; sigma of the process is 1.076 B.
    pub instability_ug: f64,
    /// Correlation time of the process, in s.
    pub correlation_time_s: f64,
}

impl AccelerometerBias {
    /// Report of the bias instability of the accelerometers under the conditions; `None` where it is zero.
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
    /// Latitude of the scheme, in degrees.
    pub latitude_deg: f64,
    /// True if the program chose the latitude.
    pub latitude_by_default: bool,
    /// Dwell, in s, of positions that do not state their own.
    pub dwell_s: f64,
    /// Largest step between samples in s; a position is divided into equal steps.
    pub step_s: f64,
    /// Time at the start of each position at rest, in s, whose samples do not count; left out where all
    /// count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub settle_s: Option<f64>,
    /// Noise of the observation per sample and axis, in g.
    pub accelerometer_noise_g: f64,
    /// Bias instability of the accelerometers; left out where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accelerometer_bias: Option<AccelerometerBias>,
    /// Noise of the azimuth per sample, in deg; null if it is not measured.
    pub azimuth_noise_deg: Option<f64>,
    /// Rate of slews in deg/s unless a position states its own; null for instantaneous slews.
    pub slew_rate_deg_s: Option<f64>,
    /// Random drift that is stated, with its unit; null if none is.
    #[serde(default)]
    pub drift_noise: Option<String>,
    /// Noise of the gyros by their datasheet; left out where they have no noise of their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gyro_noise: Option<GyroNoise>,
    /// Priors that are stated, as 1 sigma in the units of the unknowns; null if none are.
    #[serde(default)]
    pub prior: Option<String>,
    /// Bench that is stated: sizes (one sigma) of errors that are not estimated, in their units; left out
    /// where none is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bench: Option<String>,
    /// Keys of the conditions above that nobody states, so that the program chose them: latitude_deg,
    /// accelerometer_noise_g, step_s, dwell_s, azimuth_noise_deg.
    #[serde(default)]
    pub by_default: Vec<String>,
}

impl MeasurementReport {
    /// Report on `scheme` under `conditions`.
    pub fn new(scheme: &Scheme, conditions: &Conditions) -> Self {
        Self {
            latitude_deg: latitude_of(scheme).map_or(0.0, |l| l.degrees()),
            latitude_by_default: scheme.latitude.is_none(),
            dwell_s: conditions.dwell_s,
            step_s: conditions.step_s,
            settle_s: conditions.stated_settle_s(),
            accelerometer_noise_g: conditions.accelerometer_noise_g,
            accelerometer_bias: AccelerometerBias::of(conditions),
            azimuth_noise_deg: scheme.measured_azimuth.then_some(conditions.azimuth_noise_deg),
            slew_rate_deg_s: conditions.slew_rate_deg_s.filter(|_| conditions.slews),
            drift_noise: conditions.as_stated().drift_noise_in_words(),
            gyro_noise: (!conditions.gyro_noise.is_none()).then_some(conditions.gyro_noise),
            prior: conditions.stated_prior_in_words(),
            bench: conditions.bench_in_words(),
            by_default: chosen(scheme, conditions),
        }
    }
}

/// Keys of the conditions of a prediction that are not stated.
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

/// Position or slew of the timeline.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TimelineReport {
    /// Name of the position, or of the one that a slew leads to.
    pub position: String,
    /// True if this is a slew, false for a position.
    pub slew: bool,
    /// Start of the position or slew, in s.
    pub start_s: f64,
    /// End of the position or slew, in s.
    pub end_s: f64,
    /// Turn of the slew: its axis and angle; null for a position.
    pub turn: Option<Turn>,
}

/// Estimate of one unknown or combination at the end of the run.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Estimate {
    /// Name of the unknown, or the combination.
    pub name: String,
    /// Unit of the truth, the estimates and the sigmas.
    pub unit: String,
    /// Verdict: observable, inseparable or not excited.
    pub status: Status,
    /// Observable degree; null if not observable.
    pub degree: Option<usize>,
    /// Accuracy order; null if no dwell makes it observable, or if none were computed.
    pub accuracy_order: Option<usize>,
    /// True value, in the unit of `unit`.
    pub truth: f64,
    /// Estimate at the end of the run, in the unit of `unit`.
    pub estimate: f64,
    /// Estimate minus true value, in the unit of `unit`.
    pub error: f64,
    /// Standard deviation of the error by the filter, in the unit of `unit`.
    pub sigma: f64,
    /// Predicted sigma under the stated conditions, in the unit of `unit`; null if neither samples nor stated
    /// priors bound it.
    pub predicted_sigma: Option<f64>,
    /// Error over sigma, dimensionless; about -3 to 3 for a consistent filter.
    pub error_over_sigma: f64,
    /// Estimate of the linear filter from the same measurements; null if the run's filter is linear.
    pub linear: Option<LinearEstimate>,
    /// Standard deviation at the start of the run, in the unit of `unit`.
    pub prior_sigma: f64,
    /// Largest sigma allowed, in the unit of `unit`; null if none is required.
    pub required_sigma: Option<f64>,
    /// Time, in s, from which sigma meets the requirement to the end; null if it does not, if the total with
    /// a bench does not, or if the samples do not determine the unknown.
    pub time_to_requirement_s: Option<f64>,
    /// Outcome of the run for this unknown or combination.
    pub outcome: Outcome,
    /// Indistinguishable unknowns whose priors the estimate relies on besides its own. Empty unless it is
    /// known from the prior only.
    pub prior_of: Vec<String>,
}

/// Estimate of the linear filter at the end of the run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct LinearEstimate {
    /// Estimate minus true value, in the unit of the unknown.
    pub error: f64,
    /// Standard deviation of the error by the linear filter, in the unit of the unknown.
    pub sigma: f64,
}

/// Filter of the run, and the reason for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct FilterReport {
    /// Filter of the run: linear, extended or iterated.
    pub kind: FilterKind,
    /// Reason for the choice of this filter.
    pub reason: FilterReason,
    /// Number of linearisations of the whole run: 1 except for the iterated filter.
    pub passes: usize,
    /// True if the linearisations converged.
    pub converged: bool,
    /// False if the sigmas are not to be trusted even where one run is consistent: the small-angle model does
    /// not hold for the truth, and the filter is linear, or extended and so linearised before drifts are
    /// known.
    pub trusted: bool,
}

/// Reason for the choice of a filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FilterReason {
    /// Choice by a file or an option.
    Given,
    /// Truth of the linear model.
    LinearTruth,
    /// Validity of the small-angle model at the truth.
    Valid,
    /// Invalidity of the small-angle model at the truth.
    NotValid,
}

/// Outcome of a run for one unknown or combination.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Reached: sigma, with a bench the total uncertainty, is at or below the requirement.
    Reached,
    /// Converging: sigma fell, but it, or with a bench the total uncertainty, is above the requirement.
    Converging,
    /// Determined: sigma fell; nothing is required of it.
    Determined,
    /// Determined by the samples, but sigma is (nearly) that of the prior.
    RestsOnPrior,
    /// Not determined by the samples: sigma comes from the prior alone.
    PriorOnly,
    /// Not determined for small angles; a filter with full attitudes learns of it through large ones.
    LargeAnglesOnly,
    /// Inconsistent: the error is beyond four sigma, so the filter is wrong.
    Inconsistent,
    /// Error or sigma that is not a finite number.
    NoNumber,
}

impl Outcome {
    /// Outcome for an unknown, from its sigmas at the start and at the end. `required` comes with the
    /// uncertainty that it limits: sigma at the end, and the contribution of a bench.
    pub(crate) fn of(
        determined: bool,
        filter: FilterKind,
        error_over_sigma: f64,
        [prior, sigma]: [f64; 2],
        required: Option<(f64, f64)>,
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
        } else if required.is_some_and(|(required, total)| meets(total, required)) {
            Self::Reached
        } else if required.is_some() {
            Self::Converging
        } else {
            Self::Determined
        }
    }

    /// Reason why the unknown meets no requirement, whatever its sigma; `None` if it can.
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
