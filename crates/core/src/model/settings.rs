//! Settings of a run: steps, noise, true values, priors, requirements, all in the units of the report.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::per_gyro::PerGyro;
use super::ranges::{self, Range, RangeError};
use crate::language::{among, nearest};

/// Model that generates the truth of a simulated run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Truth {
    /// Linear model of the filter: (2), (6).
    #[default]
    Linear,
    /// Direction cosines: the drift turns the true attitude, the specific force is taken in the true platform
    /// frame.
    Exact,
}

/// Filter that estimates the unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FilterKind {
    /// Linear model with gains that are known beforehand: small psi.
    Linear,
    /// Extended filter: full attitudes, Jacobians at the current estimate.
    Extended,
    /// Iterated filter: full attitudes, relinearised along the whole run until it converges.
    Iterated,
}

impl FilterKind {
    /// All kinds of filters.
    pub const ALL: [Self; 3] = [Self::Linear, Self::Extended, Self::Iterated];

    /// Name in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Extended => "extended",
            Self::Iterated => "iterated",
        }
    }
}

/// Computation of the filter's transition matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Propagation {
    /// Matrix exponential of the linear model.
    #[default]
    Exponential,
    /// Runge-Kutta integration of order four, as in the paper.
    Rk4,
}

/// Random drift, equal for the three gyros, with its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub enum DriftNoise {
    /// Bias in deg/h, drawn anew for every step and constant within it.
    OneStep(f64),
    /// White drift: angle random walk in deg/sqrt(h).
    RandomWalk(f64),
}

impl DriftNoise {
    /// Number without its unit.
    pub fn amount(self) -> f64 {
        match self {
            Self::OneStep(x) | Self::RandomWalk(x) => x,
        }
    }

    /// Refuses a number that is neither zero nor in its range.
    pub fn check(self, what: &str) -> Result<(), RangeError> {
        if self.amount() == 0.0 { Ok(()) } else { ranges::DRIFT_NOISE.check(what, self.amount()) }
    }

    /// Standard deviation in rad/s of the bias that is constant over one step of `dt` seconds.
    pub fn held_rad_s(self, dt: f64) -> f64 {
        match self {
            Self::OneStep(x) => x.to_radians() / 3600.0,
            Self::RandomWalk(x) => x.to_radians() / 60.0 / dt.sqrt(),
        }
    }

    /// Density in deg/sqrt(h) (angle random walk) with steps of `dt` seconds. A bias x that is constant over
    /// one step turns by `x dt`; independent steps add up in squares.
    pub fn density_deg_sqrt_h(self, dt: f64) -> f64 {
        match self {
            Self::OneStep(x) => x * (dt / 3600.0).sqrt(),
            Self::RandomWalk(x) => x,
        }
    }
}

/// Reasons why a text is no random drift.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DriftNoiseError {
    /// The text has no number with a unit.
    #[error(
        "`{found}` is no random drift; expected 0, or a number with a unit, as in \"0.01 deg/h\" (bias of \
         one step) or \"0.001 deg/sqrt(h)\""
    )]
    Form {
        /// Text found.
        found: String,
    },
    /// The number is out of its range.
    #[error("`{found}`: expected 0, or {expected} {unit}")]
    Value {
        /// Number found.
        found: String,
        /// Admitted range.
        expected: String,
        /// Unit of the number.
        unit: String,
    },
}

impl FromStr for DriftNoise {
    type Err = DriftNoiseError;
    fn from_str(text: &str) -> Result<Self, DriftNoiseError> {
        let wrong = || DriftNoiseError::Form { found: text.into() };
        let compact: String = text.chars().filter(|c| !c.is_whitespace()).collect();
        // zero needs no unit
        if compact.contains('0') && matches!(compact.trim_matches('0'), "" | ".") {
            return Ok(Self::OneStep(0.0));
        }
        let split = compact.find("deg").ok_or_else(wrong)?;
        let value: f64 = compact[..split].parse().map_err(|_| wrong())?;
        let noise = match &compact[split..] {
            "deg/h" => Self::OneStep(value),
            "deg/sqrt(h)" => Self::RandomWalk(value),
            _ => return Err(wrong()),
        };
        noise.check("").map_err(|e| DriftNoiseError::Value {
            found: text.into(),
            expected: e.expected,
            unit: compact[split..].into(),
        })?;
        Ok(noise)
    }
}

impl TryFrom<String> for DriftNoise {
    type Error = DriftNoiseError;
    fn try_from(text: String) -> Result<Self, DriftNoiseError> {
        text.parse()
    }
}

impl From<DriftNoise> for String {
    fn from(noise: DriftNoise) -> Self {
        noise.to_string()
    }
}

impl fmt::Display for DriftNoise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OneStep(x) => write!(f, "{x} deg/h"),
            Self::RandomWalk(x) => write!(f, "{x} deg/sqrt(h)"),
        }
    }
}

/// Value for one unknown (`D_FX`, `psi_x`) or a family (`psi`, `D_F`, `D_I`, ..., `D`).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Assignment {
    /// Name of the unknown or family.
    pub name: String,
    /// Value in the unit of the unknown: deg, deg/h, deg/h/g, deg/h/g^2, ppm, arcsec, ug, ug/g^2, ug/g^3.
    pub value: f64,
}

/// Error for a text that is no assignment.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is no assignment; expected NAME=NUMBER, as in D_FX=11 or psi=0.1")]
pub struct AssignmentError {
    /// Text found.
    pub found: String,
}

impl fmt::Display for Assignment {
    /// Text `D_FX=11`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.name, self.value)
    }
}

impl FromStr for Assignment {
    type Err = AssignmentError;
    fn from_str(text: &str) -> Result<Self, AssignmentError> {
        let wrong = || AssignmentError { found: text.into() };
        let (name, value) = text.split_once('=').ok_or_else(wrong)?;
        let value: f64 = value.trim().parse().map_err(|_| wrong())?;
        if !value.is_finite() || name.trim().is_empty() {
            return Err(wrong());
        }
        Ok(Self { name: name.trim().into(), value })
    }
}

/// Settings of a run in a scheme file; missing ones have defaults.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settings {
    /// Model of the truth: linear or exact; if missing, exact with a filter that has full attitudes, linear
    /// otherwise.
    pub truth: Option<Truth>,
    /// Filter: linear, extended or iterated; if missing, linear where the small-angle model holds.
    pub filter: Option<FilterKind>,
    /// Largest step in s; 10 if missing.
    pub step_s: Option<f64>,
    /// Dwell, in s, of positions without dwell_s; 1000 if missing.
    pub dwell_s: Option<f64>,
    /// Rate of the rotations between positions in deg/s; instantaneous if missing.
    pub slew_rate_deg_s: Option<f64>,
    /// Noise of the observation per sample in g; 1e-5 if missing.
    pub accelerometer_noise_g: Option<f64>,
    /// Bias instability of the accelerometers in ug; none if missing.
    pub accelerometer_bias_instability_ug: Option<f64>,
    /// Correlation time of the accelerometer bias instability in s; 3600 if missing.
    pub accelerometer_correlation_time_s: Option<f64>,
    /// Noise of a measured azimuth per sample in deg; 0.001 if missing.
    pub azimuth_noise_deg: Option<f64>,
    /// Random drift: "0.01 deg/h" (bias of one step) if missing, or for instance "0.001 deg/sqrt(h)".
    pub drift_noise: Option<DriftNoise>,
    /// Angle random walk of the gyros in deg/sqrt(h), instead of drift_noise; none if missing.
    pub angle_random_walk_deg_sqrt_h: Option<PerGyro>,
    /// Rate random walk of the gyros in deg/h/sqrt(h); none if missing.
    pub rate_random_walk_dph_sqrt_h: Option<PerGyro>,
    /// Bias instability of the gyros in deg/h; none if missing.
    pub bias_instability_dph: Option<PerGyro>,
    /// Correlation time of the bias instability in s; 3600 if missing.
    pub correlation_time_s: Option<f64>,
    /// Propagation of the filter: exponential (default) or rk4.
    pub propagation: Option<Propagation>,
    /// Factor on the true drift coefficients and their priors, dimensionless.
    pub drift_scale: Option<f64>,
    /// True values by unknown or family, in the unit of the unknown, as in D_F = 11.
    pub values: BTreeMap<String, f64>,
    /// Initial estimates by unknown or family, in the unit of the unknown.
    pub estimates: BTreeMap<String, f64>,
    /// Initial standard deviations by unknown or family, in the unit of the unknown.
    pub priors: BTreeMap<String, f64>,
}

impl Settings {
    /// Numbers by their keys in a scheme file, each with its range.
    pub(crate) fn numbers(&self) -> Vec<(String, f64, Range)> {
        let single = [
            ("step_s", self.step_s, ranges::STEP_S),
            ("dwell_s", self.dwell_s, ranges::DWELL_S),
            ("slew_rate_deg_s", self.slew_rate_deg_s, ranges::SLEW_RATE_DEG_S),
            ("accelerometer_noise_g", self.accelerometer_noise_g, ranges::NOISE_G),
            (
                "accelerometer_bias_instability_ug",
                self.accelerometer_bias_instability_ug,
                ranges::INSTABILITY_UG,
            ),
            (
                "accelerometer_correlation_time_s",
                self.accelerometer_correlation_time_s,
                ranges::CORRELATION_S,
            ),
            ("azimuth_noise_deg", self.azimuth_noise_deg, ranges::AZIMUTH_NOISE_DEG),
            ("drift_scale", self.drift_scale, ranges::DRIFT_SCALE),
            ("correlation_time_s", self.correlation_time_s, ranges::CORRELATION_S),
            (
                "drift_noise",
                self.drift_noise.map(DriftNoise::amount).filter(|x| *x != 0.0),
                ranges::DRIFT_NOISE,
            ),
        ];
        let single =
            single.into_iter().filter_map(|(key, x, range)| Some((format!("simulation.{key}"), x?, range)));
        let gyros = self.gyros().into_iter().flat_map(|(key, x)| {
            let amounts = x.into_iter().flat_map(PerGyro::amounts);
            amounts.map(move |x| (format!("simulation.{key}"), x, ranges::GYRO_NOISE))
        });
        let lists = self.lists().into_iter().flat_map(|(key, list, range)| {
            list.iter().map(move |(name, x)| (format!("simulation.{key}.{name}"), *x, range))
        });
        single.chain(gyros).chain(lists).collect()
    }

    /// Noises of the gyros by their keys.
    pub(crate) fn gyros(&self) -> [(&'static str, Option<PerGyro>); 3] {
        [
            ("angle_random_walk_deg_sqrt_h", self.angle_random_walk_deg_sqrt_h),
            ("rate_random_walk_dph_sqrt_h", self.rate_random_walk_dph_sqrt_h),
            ("bias_instability_dph", self.bias_instability_dph),
        ]
    }

    /// Lists by their keys, with the range of their numbers.
    pub(crate) fn lists(&self) -> [(&'static str, &BTreeMap<String, f64>, Range); 3] {
        [
            ("values", &self.values, ranges::VALUE),
            ("estimates", &self.estimates, ranges::VALUE),
            ("priors", &self.priors, ranges::PRIOR),
        ]
    }
}

/// True if an assignment to `pattern` concerns the unknown `name`.
pub fn concerns(pattern: &str, name: &str) -> bool {
    let base = name.split('@').next().unwrap_or(name);
    let base = base.strip_suffix("^n").unwrap_or(base);
    let family = base.strip_prefix("D_").zip(pattern.strip_prefix("D_"));
    let family = family.is_some_and(|(own, asked)| own.len() == asked.len() + 1 && own.starts_with(asked));
    let kind = base.split_once('_').is_some_and(|(kind, _)| kind == pattern);
    pattern == name || pattern == base || family || kind
}

/// True if some scheme has an unknown or family of this name.
pub(crate) fn may_be_unknown(name: &str) -> bool {
    let axis = |name: &str| matches!(name, "psi_x" | "psi_y" | "psi_z" | "eps_x" | "eps_y" | "eps_z");
    let number = |i: &str| i.len() <= 4 && !i.starts_with('0') && i.bytes().all(|b| b.is_ascii_digit());
    let at = |name: &str| {
        let parts = name.split_once('@');
        parts.is_some_and(|(own, i)| own.starts_with("psi") && axis(own) && !i.is_empty() && number(i))
    };
    is_family(name) || axis(name.strip_suffix("^n").unwrap_or(name)) || at(name)
}

/// True if a gyro model may have this family, even if the scheme at hand does not.
pub fn is_family(name: &str) -> bool {
    families().chain(coefficients()).any(|known| known == name)
}

/// Names that stand for several unknowns.
fn families() -> impl Iterator<Item = String> {
    ["psi", "eps", "D"].into_iter().chain(super::Term::ALL.iter().map(|t| t.family())).map(String::from)
}

/// Names of the coefficients that an error model may have.
fn coefficients() -> impl Iterator<Item = String> {
    let geometry = super::Geometry::default();
    super::Term::ALL.iter().flat_map(move |t| t.coefficients(&geometry)).map(|(name, _)| name)
}

/// Hint for an unknown `name`: the nearest name among the unknowns and families of any scheme.
pub(crate) fn meant(name: &str) -> String {
    let axes = |stem: &str, letters: [char; 3]| letters.map(|l| format!("{stem}{l}"));
    let angles = ["psi_", "eps_"].into_iter().flat_map(|stem| axes(stem, ['x', 'y', 'z']));
    let all: Vec<String> = families().chain(angles).chain(coefficients()).collect();
    let expected = "expected an unknown such as D_FX or psi_x, or a family such as D_F, D or psi";
    match nearest(name, &all) {
        Some(near) => format!("did you mean `{near}`? ({expected})"),
        None => expected.into(),
    }
}

/// Hint for an unknown `name` among the `names` of unknowns and their families: the nearest name, or all
/// names (the first ones of very many).
pub fn known(names: &[String], name: &str) -> String {
    let mut families: Vec<String> = families().collect();
    families.dedup();
    let families = families.into_iter().filter(|f| names.iter().any(|n| concerns(f, n)));
    let names: Vec<String> = names.iter().cloned().chain(families).collect();
    among(name, &names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_families() {
        assert!(concerns("D_F", "D_FX") && concerns("D", "D_FX") && concerns("D_FX", "D_FX"));
        assert!(concerns("D_I", "D_IX") && !concerns("D_I", "D_IIX") && concerns("D_II", "D_IIX"));
        assert!(concerns("psi", "psi_x@2") && concerns("psi_x", "psi_x@2") && concerns("psi_x@2", "psi_x@2"));
        assert!(!concerns("psi_x@1", "psi_x@2") && concerns("eps_x", "eps_x^n") && !concerns("D_", "D_FX"));
        assert!(
            is_family("D_SS")
                && is_family("D_FX")
                && is_family("D")
                && !is_family("D_FW")
                && !is_family("D_")
        );
    }

    #[test]
    fn units_of_the_random_drift() {
        assert_eq!("0.01 deg/h".parse(), Ok(DriftNoise::OneStep(0.01)));
        assert_eq!("0.001deg/sqrt(h)".parse(), Ok(DriftNoise::RandomWalk(0.001)));
        for none in ["0", " 0.0 ", "0 deg/h", "00."] {
            assert_eq!(none.parse(), Ok(DriftNoise::OneStep(0.0)), "{none}");
        }
        for wrong in ["", ".", "00.1", "0 h", "0.01", "-1 deg/h", "nan deg/h", "1 rad/s", "deg/h"] {
            assert!(wrong.parse::<DriftNoise>().is_err(), "{wrong}");
        }
        // a random walk of N deg/sqrt(h) turns by N deg after an hour, whatever the step
        let walk = |dt: f64| DriftNoise::RandomWalk(0.3).held_rad_s(dt) * dt * (3600.0 / dt).sqrt();
        assert!((walk(10.0).to_degrees() - 0.3).abs() < 1e-12 && (walk(1.0) - walk(10.0)).abs() < 1e-15);
    }
}
