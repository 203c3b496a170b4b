//! Sheet of a run as plain data.

use obsdeg_core::model::Carry;
use obsdeg_core::title_block::TitleBlock;
use obsdeg_evidence::acceptance::AcceptanceReport;
use obsdeg_evidence::requirements::Requirements;
use obsdeg_evidence::simulation::MeasurementReport;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Name and version of the JSON layout.
pub(super) const PROCEDURE_SCHEMA: &str = "obsdeg.procedure/1";

/// Executable sheet of a scheme: turns, waits and recordings in order of time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Procedure {
    /// Layout of this answer: `obsdeg.procedure/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Name of the scheme; empty if it has none.
    pub name: String,
    /// Title block of the printed sheet.
    pub document: TitleBlock,
    /// Carry of psi between positions.
    pub carry: Carry,
    /// True if the gimbals can execute every step.
    pub executable: bool,
    /// Obstacles of the gimbals; empty if the sheet is executable.
    pub obstacles: Vec<Obstacle>,
    /// Steps of the sheet, in order of time.
    pub steps: Vec<Step>,
    /// Total time of the sheet, in s.
    pub total_s: f64,
    /// True if the time of the turns is part of the times: a slew rate is stated.
    pub timed_turns: bool,
    /// True for each of alpha, beta and gamma that has no limits, so that its angle may wind up.
    pub free_gimbals: [bool; 3],
    /// Longest interval between rows that the uncertainties rest on, in s.
    pub row_s: f64,
    /// Rate of the earth in North and Up, in deg/h, by which the platform is torqued.
    pub earth_rate_dph: [f64; 2],
    /// Time at rest before each recording, in s, within the dwell of the position.
    pub settle_s: f64,
    /// Basis of the tolerances of the readings.
    pub tolerance: Tolerance,
    /// State of the coefficients after each position; of a scheme with many positions, after the last one.
    pub after: Vec<AfterPosition>,
    /// Coefficients with the position from which each is known.
    pub coefficients: Vec<CoefficientProgress>,
    /// Outcome of the requirements at the end, by prediction, without the samples of the waits.
    pub requirements: Requirements,
    /// Acceptance limits with their guard bands by the predicted uncertainties; null if none are stated.
    pub acceptance: Option<AcceptanceReport>,
    /// Conditions of the predictions.
    pub conditions: MeasurementReport,
    /// Attitude at the start as PSINS has it: pitch, roll and yaw in degrees of a body with the axes right,
    /// front and up along Z_p, X_p and Y_p.
    pub start_attitude_deg: [f64; 3],
    /// Rotation table of the PSINS kind; empty without a slew rate.
    pub rotations: Vec<RotationRow>,
    /// Seed of the exact verdicts.
    pub seed: u64,
}

/// Obstacle of the gimbals on the way to a position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Obstacle {
    /// Name of the position that is not reached, or whose rotation is not possible.
    pub position: String,
    /// Kind of the obstacle on the way.
    pub kind: ObstacleKind,
    /// Gimbal that stops: alpha, beta or gamma; null near beta = +-90 deg and for other kinds.
    pub gimbal: Option<String>,
    /// Limit at which the gimbal stops, in degrees; null for other kinds.
    pub at_deg: Option<f64>,
    /// Angle that the platform has turned by then, in degrees; null for other kinds.
    pub after_deg: Option<f64>,
}

/// Kind of an obstacle of the gimbals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ObstacleKind {
    /// A gimbal stops at its limit or at the lock during the turn.
    Stop,
    /// No gimbal angles of the attitude lie within the limits.
    Limits,
    /// The path gimbal by gimbal starts at other gimbal angles than those where the gimbals stand.
    Elsewhere,
    /// The stated turn does not lead to the position.
    Misses,
}

/// Step of the sheet, with its times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Step {
    /// Number of the step, from 1.
    pub number: usize,
    /// Kind of the step: what is done.
    pub kind: StepKind,
    /// Name of the position in which the step takes place, or to which it leads.
    pub position: String,
    /// Start of the step after the start of the first position, in s.
    pub start_s: f64,
    /// Duration of the step, in s; 0 for turns of unstated rate.
    pub duration_s: f64,
    /// Gimbal angles at the end of the step, in degrees: alpha (outer), beta (middle), gamma (inner).
    pub gimbals_deg: [f64; 3],
    /// Turn of the platform; null at rest.
    pub turn: Option<StepTurn>,
    /// Readings of the accelerometers X_p, Y_p, Z_p at rest, in g, of a platform without errors; null while
    /// it turns.
    pub force_g: Option<[f64; 3]>,
    /// Largest deviation of a reading, in g, that the stated drifts explain; null while the platform turns.
    pub tolerance_g: Option<f64>,
}

/// Kind of a step of the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StepKind {
    /// Set the gimbals to the first position.
    Set,
    /// Turn alpha and gamma together at beta = +-90 deg, while the platform rests and is recorded.
    Gimbals,
    /// Turn to the next position, without recording.
    Turn,
    /// Wait at rest, without recording.
    Wait,
    /// Record the outputs at rest.
    Record,
    /// Record the outputs during a rotation.
    Rotate,
}

/// Turn of the platform in a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepTurn {
    /// Axis in n (North, Up, East): a unit vector, dimensionless.
    pub about: [f64; 3],
    /// Axis in the platform (X_p, Y_p, Z_p): a unit vector, dimensionless.
    pub about_platform: [f64; 3],
    /// Angle of the turn in degrees, right-handed about the axis, above 0.
    pub angle_deg: f64,
    /// Rate of the turn in deg/s; null if none is stated.
    pub rate_deg_s: Option<f64>,
    /// Gimbal angles before the turn, in degrees: alpha, beta, gamma.
    pub from_deg: [f64; 3],
    /// Largest rates of alpha, beta and gamma during the turn, in deg/s; null if no rate is stated.
    pub gimbal_rates_deg_s: Option<[f64; 3]>,
    /// Gimbal that makes the turn alone: alpha, beta or gamma; null about one axis.
    pub gimbal: Option<String>,
}

/// Basis of the tolerances of the readings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Tolerance {
    /// Tilt that is always allowed, in degrees.
    pub tilt_deg: f64,
    /// True if true values of coefficients or psi are stated, whose drift is added.
    pub by_values: bool,
    /// True if priors are stated, of which three sigma are added.
    pub by_priors: bool,
    /// True if random drift or biases are stated, of whose tilt three sigma are added.
    pub by_noise: bool,
    /// Part of the tolerance, in g, for errors of the accelerometers, of attitudes and of gravity: stated
    /// values, and three sigma of the stated priors, of the bench and of the bias instability.
    pub accelerometers_g: f64,
    /// Families of the bench that are not part of the tolerance.
    pub not_counted: Vec<String>,
    /// Names of the positions whose tolerance is so large that the readings tell little: above 0.25 g.
    pub wide: Vec<String>,
}

/// State of the coefficients after a position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AfterPosition {
    /// Name of the position that has ended.
    pub position: String,
    /// End of the position, in s.
    pub end_s: f64,
    /// Number of requirements that are met.
    pub met: usize,
    /// Coefficients that the samples determine from here on, whatever the priors.
    pub determines: Vec<String>,
    /// Coefficients that meet their requirement from here on.
    pub meets: Vec<String>,
    /// Uncertainty of each coefficient, in the order of `coefficients` and in its unit; null where
    /// neither samples nor stated priors bound it.
    pub uncertainty: Vec<Option<f64>>,
}

/// Coefficient with the positions from which it is known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CoefficientProgress {
    /// Name of the coefficient, such as D_FX.
    pub name: String,
    /// Unit of the uncertainty and the requirement.
    pub unit: String,
    /// Uncertainty at the end, in the unit of `unit`; null if neither samples nor stated priors bound the
    /// coefficient.
    pub uncertainty: Option<f64>,
    /// True if the samples do not determine the coefficient, so that stated priors alone bound it.
    pub by_prior: bool,
    /// Largest uncertainty allowed, in the unit of `unit`; null without a requirement.
    pub required: Option<f64>,
    /// Position from whose end on the samples determine the coefficient; null if they do not at the end,
    /// and for a scheme of more than 100 positions.
    pub determined_from: Option<String>,
    /// Position from whose end on the requirement is met; null without a requirement, if it is missed at
    /// the end, and for a scheme of more than 100 positions.
    pub met_from: Option<String>,
}

/// Row of a rotation table: `[k, Ux, Uy, Uz, angle, T, T0, T1]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RotationRow {
    /// Number of the row, from 1.
    pub number: usize,
    /// Axis in the body (right, front, up): a unit vector, dimensionless.
    pub axis: [f64; 3],
    /// Angle about the axis in degrees, right-handed.
    pub angle_deg: f64,
    /// Duration of the rotation, in s.
    pub rotate_s: f64,
    /// Time at rest before the rotation, in s.
    pub before_s: f64,
    /// Time at rest after the rotation, in s.
    pub after_s: f64,
}
