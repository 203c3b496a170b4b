//! Layout of a scheme file, as TOML reads it: every value with its byte range. The JSON Schema is derived
//! from it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_spanned::Spanned;

use crate::model::geometry::Geometry;
use crate::model::path::Path;
use crate::model::ranges;
use crate::model::recording::SchemeRecord;
use crate::model::scheme::Carry;
use crate::model::settings::{DriftNoise, FilterKind, Propagation, Truth};
use crate::model::terms::{DefinedBy, Term};
use crate::title_block::TitleBlock;

/// Value as written: a number or text, with its byte range.
pub(super) type Literal = Option<Spanned<toml::Value>>;
/// Numbers by unknown or family.
pub(super) type Numbers = BTreeMap<Spanned<String>, Spanned<f64>>;

/// Layout of a scheme file. Angles and the latitude are read as exact decimals.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SchemeFile {
    /// Name of the scheme in reports; the name of the file when left out.
    #[schemars(with = "Option<String>")]
    pub(super) name: Option<Spanned<String>>,
    /// Purpose and source of the scheme, printed in reports.
    #[schemars(with = "Option<String>")]
    pub(super) description: Option<Spanned<String>>,
    /// Title block of the review: reference, revision, date, author, and the roles that sign.
    #[schemars(with = "Option<TitleBlock>")]
    pub(super) document: Option<Spanned<TitleBlock>>,
    /// Carry between positions: platform (default), inertial or reset.
    #[schemars(with = "Option<Carry>")]
    pub(super) carry: Option<Spanned<String>>,
    /// Latitude in degrees; generic when left out.
    #[schemars(with = "Option<f64>", extend("minimum" = -90, "maximum" = 90))]
    pub(super) latitude_deg: Literal,
    /// Unknown terms, for instance `["F", "I", "O", "S"]` or `["gyros", "K0"]`, or `"drift"`.
    #[schemars(with = "Option<Vec<TermEntry>>", extend("type" = ["array", "string", "null"]))]
    pub(super) terms: Literal,
    /// Sensors that define the platform axes, and so the misalignments in `gyros`, `accelerometers` and `all`
    /// among the terms: accelerometers (default; GM, M3), gyros (GM3, M6) or body (GM, M6).
    #[schemars(with = "Option<DefinedBy>")]
    pub(super) frame: Option<Spanned<String>>,
    /// Slew path where a position states none: one-axis (the shortest turn) or gimbals (alpha, beta, gamma
    /// one after another, within gimbal limits wherever both ends are). Torquer errors (GS, GM, GM3) act on
    /// it.
    #[schemars(with = "Option<Path>")]
    pub(super) path: Option<Spanned<String>>,
    /// True if psi_y^n is measured too.
    #[serde(default)]
    pub(super) measured_azimuth: bool,
    /// Axes of the gyros (the paper's when left out) and of the accelerometers (X_p, Y_p, Z_p when left out).
    #[schemars(with = "Option<Geometry>")]
    pub(super) geometry: Option<Spanned<Geometry>>,
    /// Linear combinations of unknowns to be judged, for instance `"D_IX - D_IY"`.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub(super) combinations: Vec<Spanned<String>>,
    /// Conditions of `obsdeg simulate` and `obsdeg crosscheck`.
    #[serde(default)]
    pub(super) simulation: SimulationEntry,
    /// Largest sigma allowed, by unknown or family, as in D_F = 0.02: in deg for psi, in deg/h for D_F, in
    /// deg/h/g for the rest.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>", extend("additionalProperties" = within(ranges::REQUIREMENT)))]
    pub(super) requirements: Numbers,
    /// Bench: sizes (one sigma) of errors that the scheme does not estimate, by error or family, as in K0 =
    /// 20: in ug for K0, ppm for K1, GS, earth_rate and gravity, arcsec for M, GM, latitude, azimuth and
    /// attitude, in the unit of the coefficient for others. Errors that are left out count nothing.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>", extend("additionalProperties" = within(ranges::BENCH)))]
    pub(super) bench: Numbers,
    /// Ageing: random walk of the coefficients between calibrations, by coefficient or family, as in D_F =
    /// 0.002, in the unit of the coefficient per sqrt(day). A coefficient that is left out does not age.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>", extend("additionalProperties" = within(ranges::AGEING)))]
    pub(super) ageing: Numbers,
    /// Acceptance of calibrated coefficients: limits and risk.
    #[serde(default)]
    pub(super) acceptance: AcceptanceEntry,
    /// Gimbal limits; free gimbals when left out. For positions beyond, the answer lists angles of the same
    /// attitude within the limits.
    #[serde(default)]
    pub(super) gimbals: GimbalEntry,
    /// Reading of the records of `obsdeg calibrate`: columns, units and intervals at rest.
    #[schemars(with = "Option<SchemeRecord>")]
    pub(super) record: Option<Spanned<SchemeRecord>>,
    /// Positions of the scheme, in order of time.
    #[serde(default, rename = "position")]
    #[schemars(with = "Vec<PositionEntry>")]
    pub(super) positions: Vec<Spanned<PositionEntry>>,
}

/// Limits within which calibrated coefficients are accepted.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct AcceptanceEntry {
    /// Largest probability, dimensionless, that an accepted coefficient lies outside its limits; 0.05 when
    /// left out.
    #[schemars(with = "Option<f64>", extend("minimum" = 1e-6, "maximum" = 0.5))]
    pub(super) risk: Option<Spanned<f64>>,
    /// Limits by coefficient or family, in the unit of the coefficient (deg/h, deg/h/g): a largest magnitude,
    /// as in D_F = 20, or the lowest and the highest value, as in D_IX = [-0.5, 0.2].
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, LimitEntry>")]
    pub(super) limits: BTreeMap<Spanned<String>, Spanned<LimitEntry>>,
}

/// Limits of a coefficient in its unit.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number (largest magnitude) or [low, high]")]
pub(super) enum LimitEntry {
    /// Largest magnitude of the coefficient, in its unit.
    Magnitude(f64),
    /// Lowest and highest value of the coefficient, in its unit.
    Interval([f64; 2]),
}

impl From<LimitEntry> for [f64; 2] {
    fn from(entry: LimitEntry) -> Self {
        match entry {
            LimitEntry::Magnitude(x) => [-x, x],
            LimitEntry::Interval(ends) => ends,
        }
    }
}

/// Conditions of simulated and predicted runs.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SimulationEntry {
    /// Model that generates the truth: linear or exact; left out, exact with a filter that has full attitudes
    /// (extended, iterated), and linear otherwise.
    pub(super) truth: Option<Truth>,
    /// Filter: linear, extended or iterated; when left out, linear where the small-angle model holds.
    pub(super) filter: Option<FilterKind>,
    /// Largest step in s; 10 when left out.
    #[schemars(with = "Option<f64>", extend("minimum" = ranges::STEP_S.low, "maximum" = ranges::STEP_S.high))]
    pub(super) step_s: Option<Spanned<f64>>,
    /// Dwell, in s, of positions without dwell_s; 1000 when left out.
    #[schemars(
        with = "Option<f64>",
        extend("minimum" = ranges::DWELL_S.low, "maximum" = ranges::DWELL_S.high)
    )]
    pub(super) dwell_s: Option<Spanned<f64>>,
    /// Rate of the rotations between positions in deg/s; instantaneous when left out.
    #[schemars(
        with = "Option<f64>",
        extend("minimum" = ranges::SLEW_RATE_DEG_S.low, "maximum" = ranges::SLEW_RATE_DEG_S.high)
    )]
    pub(super) slew_rate_deg_s: Option<Spanned<f64>>,
    /// Noise of the observation per sample, in g; 1e-5 when left out.
    #[schemars(
        with = "Option<f64>",
        extend("minimum" = ranges::NOISE_G.low, "maximum" = ranges::NOISE_G.high)
    )]
    pub(super) accelerometer_noise_g: Option<Spanned<f64>>,
    /// Bias instability of the accelerometers, in ug (B of IEEE Std 952), a Gauss-Markov process of each;
    /// none when left out.
    #[schemars(
        with = "Option<f64>",
        extend("minimum" = ranges::INSTABILITY_UG.low, "maximum" = ranges::INSTABILITY_UG.high)
    )]
    pub(super) accelerometer_bias_instability_ug: Option<Spanned<f64>>,
    /// Correlation time of the accelerometer bias instability, in s; 3600 when left out.
    #[schemars(
        with = "Option<f64>",
        extend("minimum" = ranges::CORRELATION_S.low, "maximum" = ranges::CORRELATION_S.high)
    )]
    pub(super) accelerometer_correlation_time_s: Option<Spanned<f64>>,
    /// Noise of a measured azimuth per sample, in deg; 0.001 when left out.
    #[schemars(
        with = "Option<f64>",
        extend("minimum" = ranges::AZIMUTH_NOISE_DEG.low, "maximum" = ranges::AZIMUTH_NOISE_DEG.high)
    )]
    pub(super) azimuth_noise_deg: Option<Spanned<f64>>,
    /// Random drift: "0.01 deg/h" (bias of one step) when left out, or for instance "0.001 deg/sqrt(h)".
    #[schemars(with = "Option<String>", extend("pattern" = "deg */ *(h|sqrt\\(h\\))|^ *0+[.]?0* *$"))]
    pub(super) drift_noise: Option<Spanned<DriftNoise>>,
    /// Angle random walk of the gyros in deg/sqrt(h), one for all or [X, Y, Z]; all the white drift there is
    /// if drift_noise is left out.
    #[schemars(with = "Option<PerGyroEntry>")]
    pub(super) angle_random_walk_deg_sqrt_h: Literal,
    /// Rate random walk of the gyros in deg/h/sqrt(h), one for all or [X, Y, Z].
    #[schemars(with = "Option<PerGyroEntry>")]
    pub(super) rate_random_walk_dph_sqrt_h: Literal,
    /// Bias instability of the gyros in deg/h (B of IEEE Std 952), one for all or [X, Y, Z].
    #[schemars(with = "Option<PerGyroEntry>")]
    pub(super) bias_instability_dph: Literal,
    /// Correlation time of the bias instability in s; 3600 when left out.
    #[schemars(
        with = "Option<f64>",
        extend("minimum" = ranges::CORRELATION_S.low, "maximum" = ranges::CORRELATION_S.high)
    )]
    pub(super) correlation_time_s: Option<Spanned<f64>>,
    /// Propagation of the filter: exponential (default) or rk4.
    pub(super) propagation: Option<Propagation>,
    /// Factor on the true drift coefficients and their priors, dimensionless; 1 when left out.
    #[schemars(
        with = "Option<f64>",
        extend("minimum" = ranges::DRIFT_SCALE.low, "maximum" = ranges::DRIFT_SCALE.high)
    )]
    pub(super) drift_scale: Option<Spanned<f64>>,
    /// True values by unknown or family, as in D_F = 11, in the unit of the unknown.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>", extend("additionalProperties" = within(ranges::VALUE)))]
    pub(super) values: Numbers,
    /// Initial estimates by unknown or family, in the unit of the unknown.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>", extend("additionalProperties" = within(ranges::VALUE)))]
    pub(super) estimates: Numbers,
    /// Initial standard deviations by unknown or family, in the unit of the unknown.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>", extend("additionalProperties" = within(ranges::PRIOR)))]
    pub(super) priors: Numbers,
}

/// Position of the scheme, by `angles_deg` or `attitude`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct PositionEntry {
    /// Name of the position in solutions; p1, p2, ... when left out.
    #[schemars(with = "Option<String>")]
    pub(super) name: Option<Spanned<String>>,
    /// Euler angles alpha, beta, gamma in degrees; a string names a generic angle.
    #[schemars(with = "Option<Vec<f64>>", extend("items" = angle(), "minItems" = 3, "maxItems" = 3))]
    pub(super) angles_deg: Option<Spanned<Vec<Spanned<toml::Value>>>>,
    /// Dwell at the position, in s; dwell_s of the simulation when left out.
    #[schemars(
        with = "Option<f64>",
        extend("minimum" = ranges::DWELL_S.low, "maximum" = ranges::DWELL_S.high)
    )]
    pub(super) dwell_s: Literal,
    /// Rotation that starts at this position; dwell_s is its duration.
    #[schemars(with = "Option<RotationEntry>")]
    pub(super) rotation: Option<Spanned<RotationEntry>>,
    /// Slew from the position before, with psi^n carried; Z is not used meanwhile.
    #[schemars(with = "Option<SlewEntry>")]
    pub(super) slew: Option<Spanned<SlewEntry>>,
    /// Directions of X_p, Y_p, Z_p out of N S U D E W, as in "NUE".
    #[schemars(with = "Option<String>", extend("pattern" = "^[NSUDEW]{3}$"))]
    pub(super) attitude: Option<Spanned<String>>,
}

/// Rotation of the platform at a constant rate.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RotationEntry {
    /// Axis of the rotation: X_p, Y_p, Z_p (platform) or N, U, E (geographic).
    #[schemars(with = "String", extend("enum" = AXES))]
    pub(super) about: Spanned<String>,
    /// Total angle of the rotation in degrees, right-handed. Two of angle_deg, rate_deg_s and the position's
    /// dwell_s determine the rotation; angle_deg alone takes the dwell of the conditions.
    #[schemars(with = "Option<f64>")]
    pub(super) angle_deg: Literal,
    /// Rate of the rotation in deg/s, right-handed.
    #[schemars(with = "Option<f64>")]
    pub(super) rate_deg_s: Literal,
}

/// Turn to a position at a constant rate.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SlewEntry {
    /// Rate of the turn in deg/s; slew_rate_deg_s of the simulation when left out.
    #[schemars(
        with = "Option<f64>",
        extend("minimum" = ranges::SLEW_RATE_DEG_S.low, "maximum" = ranges::SLEW_RATE_DEG_S.high)
    )]
    pub(super) rate_deg_s: Option<Spanned<f64>>,
    /// Axis of the turn: X_p, Y_p, Z_p (platform), N, U, E (geographic), or a direction [North, Up, East]
    /// such as [1, 1, 0]. When left out: the shortest turn; a half turn goes about the direction whose first
    /// non-zero component is positive.
    #[schemars(with = "Option<AboutEntry>")]
    pub(super) about: Literal,
    /// Total angle about that axis in degrees, right-handed; the shorter turn when left out, half turns
    /// right-handed.
    #[schemars(with = "Option<f64>")]
    pub(super) angle_deg: Literal,
}

/// Noise of all gyros, or of X, Y, Z, in the unit of the key.
#[derive(JsonSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "says what a file may hold")]
enum PerGyroEntry {
    All(#[schemars(extend("minimum" = 0, "maximum" = ranges::GYRO_NOISE.high))] f64),
    Each(#[schemars(extend("items" = none_or(ranges::GYRO_NOISE)))] [f64; 3]),
}

/// Term of the error model, or family of terms.
#[derive(JsonSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "says what a file may hold")]
enum TermEntry {
    Term(Term),
    Family(#[schemars(extend("enum" = ["gyros", "accelerometers", "all"]))] String),
}

/// Axis by its name, or a direction in n (dimensionless, of any length above 0).
#[derive(JsonSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "says what a file may hold")]
enum AboutEntry {
    Named(#[schemars(extend("enum" = AXES))] String),
    Direction([f64; 3]),
}

/// Limits of the Euler angles as [low, high] in degrees.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct GimbalEntry {
    /// Limits of alpha, the outer gimbal, about North, in degrees.
    #[schemars(with = "Option<Vec<f64>>", extend("minItems" = 2, "maxItems" = 2))]
    pub(super) alpha_deg: Option<Spanned<Vec<Spanned<toml::Value>>>>,
    /// Limits of beta, the middle gimbal, in degrees.
    #[schemars(with = "Option<Vec<f64>>", extend("minItems" = 2, "maxItems" = 2))]
    pub(super) beta_deg: Option<Spanned<Vec<Spanned<toml::Value>>>>,
    /// Limits of gamma, the inner gimbal, about Z_p, in degrees.
    #[schemars(with = "Option<Vec<f64>>", extend("minItems" = 2, "maxItems" = 2))]
    pub(super) gamma_deg: Option<Spanned<Vec<Spanned<toml::Value>>>>,
}

/// Names of the axes of a turn.
const AXES: [&str; 6] = ["X_p", "Y_p", "Z_p", "N", "U", "E"];

/// JSON Schema of an angle: degrees, or the name of a generic angle with an offset.
fn angle() -> serde_json::Value {
    serde_json::json!({ "anyOf": [{ "type": "number" }, { "type": "string" }] })
}

/// JSON Schema of the numbers in a range.
fn within(range: ranges::Range) -> serde_json::Value {
    serde_json::json!({ "type": "number", "minimum": range.low, "maximum": range.high })
}

/// JSON Schema of zero and the numbers up to the end of a range.
fn none_or(range: ranges::Range) -> serde_json::Value {
    serde_json::json!({ "type": "number", "minimum": 0, "maximum": range.high })
}
