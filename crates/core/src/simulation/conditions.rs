//! The conditions of a run: noise, steps, true values, priors. All in the units of the report.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::SimulationError;
use super::ranges::{self, Range, RangeError};
use crate::model::expression::nearest;
use crate::model::{Latitude, Platform, Position, Scheme};

/// How the truth is generated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Truth {
    /// By the linear model of the filter: (2), (6).
    #[default]
    Linear,
    /// By direction cosines: the drift turns the true attitude, the specific force is taken in the true
    /// platform frame.
    Exact,
}

/// How the filter gets its transition matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Propagation {
    /// The matrix exponential of the linear model.
    #[default]
    Exponential,
    /// Runge-Kutta of order four, as the paper.
    Rk4,
}

/// Random drift, equal for the three gyros, with its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub enum DriftNoise {
    /// A bias in deg/h, drawn anew for every step and held over it.
    OneStep(f64),
    /// White drift: angle random walk in deg/sqrt(h).
    RandomWalk(f64),
}

impl DriftNoise {
    /// The number without its unit.
    pub fn amount(self) -> f64 {
        match self {
            Self::OneStep(x) | Self::RandomWalk(x) => x,
        }
    }

    /// Refuses what is neither zero nor in its range.
    fn check(self, what: &str) -> Result<(), RangeError> {
        if self.amount() == 0.0 { Ok(()) } else { ranges::DRIFT_NOISE.check(what, self.amount()) }
    }

    /// The standard deviation in rad/s of the bias held over one step of `dt` seconds.
    pub fn held_rad_s(self, dt: f64) -> f64 {
        match self {
            Self::OneStep(x) => x.to_radians() / 3600.0,
            Self::RandomWalk(x) => x.to_radians() / 60.0 / dt.sqrt(),
        }
    }

    /// Its density in deg/sqrt(h) (angle random walk) with steps of `dt` seconds: a bias held for one step turns by
    /// `x dt`, and independent steps add up in squares.
    pub fn density_deg_sqrt_h(self, dt: f64) -> f64 {
        match self {
            Self::OneStep(x) => x * (dt / 3600.0).sqrt(),
            Self::RandomWalk(x) => x,
        }
    }
}

impl FromStr for DriftNoise {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}` is no random drift; expected a number with a unit, as in \"0.01 deg/h\" (bias of one step) or \"0.001 deg/sqrt(h)\""
            )
        };
        let compact: String = text.chars().filter(|c| !c.is_whitespace()).collect();
        let split = compact.find("deg").ok_or_else(wrong)?;
        let value: f64 = compact[..split].parse().map_err(|_| wrong())?;
        let noise = match &compact[split..] {
            "deg/h" => Self::OneStep(value),
            "deg/sqrt(h)" => Self::RandomWalk(value),
            _ => return Err(wrong()),
        };
        noise
            .check("")
            .map_err(|e| format!("`{text}`: expected 0, or {} {}", e.expected, &compact[split..]))?;
        Ok(noise)
    }
}

impl TryFrom<String> for DriftNoise {
    type Error = String;
    fn try_from(text: String) -> Result<Self, String> {
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

/// A number for one unknown (`D_FX`, `psi_x`) or a family (`psi`, `D_F`, `D_I`, ..., `D`).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Assignment {
    /// The unknown or family.
    pub name: String,
    /// In the unit of the unknown: deg, deg/h, deg/h/g, deg/h/g^2.
    pub value: f64,
}

impl FromStr for Assignment {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no assignment; expected NAME=NUMBER, as in D_FX=11 or psi=0.1");
        let (name, value) = text.split_once('=').ok_or_else(wrong)?;
        let value: f64 = value.trim().parse().map_err(|_| wrong())?;
        if !value.is_finite() || name.trim().is_empty() {
            return Err(wrong());
        }
        Ok(Self { name: name.trim().into(), value })
    }
}

/// Everything that a run needs besides the scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditions {
    /// How the truth is generated.
    pub truth: Truth,
    /// Largest step, in s; a position is divided into equal steps.
    pub step_s: f64,
    /// Dwell of positions that do not say theirs, in s.
    pub dwell_s: f64,
    /// Rate of the rotations between positions in deg/s; `None`: instantaneous, unless the position says otherwise.
    pub slew_rate_deg_s: Option<f64>,
    /// False: every position is reached at once, whatever it says.
    pub slews: bool,
    /// White noise of the observation per sample and axis, in g.
    pub accelerometer_noise_g: f64,
    /// Noise of a measured azimuth per sample, in deg.
    pub azimuth_noise_deg: f64,
    /// Random drift.
    pub drift_noise: DriftNoise,
    /// The step in s for which it was given: a bias of one step has another density with other steps.
    pub drift_noise_step_s: f64,
    /// How the filter is propagated.
    pub propagation: Propagation,
    /// True values, later ones override.
    pub values: Vec<Assignment>,
    /// Factor on the true drift coefficients and their priors.
    pub drift_scale: f64,
    /// Initial estimates.
    pub estimates: Vec<Assignment>,
    /// Initial standard deviations.
    pub priors: Vec<Assignment>,
    /// The largest standard deviations allowed.
    pub requirements: Vec<Assignment>,
}

/// The latitude of a scheme that names none, in degrees (the paper's is not given).
pub const DEFAULT_LATITUDE: &str = "28.2";

fn assign(name: &str, value: f64) -> Assignment {
    Assignment { name: name.into(), value }
}

impl Default for Conditions {
    /// The paper's run; what it does not give (prior, latitude, requirements) is chosen here.
    fn default() -> Self {
        let first_order = |value| ["D_I", "D_O", "D_S"].map(|name| assign(name, value));
        let drift = [("D_FX", 11.0), ("D_FY", 12.0), ("D_FZ", 13.0)].map(|(n, v)| assign(n, v));
        let values = [assign("D", 0.5), assign("psi", 0.1), assign("eps", 10.0)].into_iter();
        let priors = [assign("D", 1.0), assign("psi", 0.1), assign("eps", 20.0), assign("D_F", 20.0)];
        Self {
            truth: Truth::Linear,
            step_s: 10.0,
            dwell_s: 1000.0,
            slew_rate_deg_s: None,
            slews: true,
            accelerometer_noise_g: 1e-5,
            azimuth_noise_deg: 0.001,
            drift_noise: DriftNoise::OneStep(0.01),
            drift_noise_step_s: 10.0,
            propagation: Propagation::Exponential,
            values: values.chain(first_order(5.0)).chain(drift).collect(),
            drift_scale: 1.0,
            estimates: Vec::new(),
            priors: priors.into_iter().chain(first_order(10.0)).collect(),
            requirements: vec![assign("D", 0.1), assign("eps", 0.1), assign("psi", 0.01)],
        }
    }
}

/// The conditions as a scheme gives them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settings {
    /// linear (default) or exact.
    pub truth: Option<Truth>,
    /// Largest step in s; 10 when left out.
    pub step_s: Option<f64>,
    /// Dwell of positions without dwell_s; 1000 when left out.
    pub dwell_s: Option<f64>,
    /// Rate of the rotations between positions in deg/s; instantaneous when left out.
    pub slew_rate_deg_s: Option<f64>,
    /// Noise of the observation per sample in g; 1e-5 when left out.
    pub accelerometer_noise_g: Option<f64>,
    /// Noise of a measured azimuth per sample in deg; 0.001 when left out.
    pub azimuth_noise_deg: Option<f64>,
    /// "0.01 deg/h" (bias of one step) when left out, or for instance "0.001 deg/sqrt(h)".
    pub drift_noise: Option<DriftNoise>,
    /// exponential (default) or rk4.
    pub propagation: Option<Propagation>,
    /// Factor on the true drift coefficients and their priors.
    pub drift_scale: Option<f64>,
    /// True values by unknown or family, as in D_F = 11.
    pub values: BTreeMap<String, f64>,
    /// Initial estimates.
    pub estimates: BTreeMap<String, f64>,
    /// Initial standard deviations.
    pub priors: BTreeMap<String, f64>,
}

/// Families before single unknowns.
fn by_family(given: &BTreeMap<String, f64>) -> Vec<Assignment> {
    let mut given: Vec<Assignment> = given.iter().map(|(n, v)| assign(n, *v)).collect();
    given.sort_by_key(|a| a.name.len());
    given
}

impl Conditions {
    /// Overrides what `settings` gives.
    pub fn apply(&mut self, settings: &Settings) {
        fn set<T: Copy>(slot: &mut T, value: Option<T>) {
            if let Some(value) = value {
                *slot = value;
            }
        }
        set(&mut self.truth, settings.truth);
        set(&mut self.step_s, settings.step_s);
        set(&mut self.dwell_s, settings.dwell_s);
        set(&mut self.accelerometer_noise_g, settings.accelerometer_noise_g);
        set(&mut self.azimuth_noise_deg, settings.azimuth_noise_deg);
        if let Some(noise) = settings.drift_noise {
            self.drift_noise = noise;
            self.drift_noise_step_s = self.step_s;
        }
        set(&mut self.propagation, settings.propagation);
        set(&mut self.drift_scale, settings.drift_scale);
        self.slew_rate_deg_s = settings.slew_rate_deg_s.or(self.slew_rate_deg_s);
        for (list, given) in [
            (&mut self.values, &settings.values),
            (&mut self.estimates, &settings.estimates),
            (&mut self.priors, &settings.priors),
        ] {
            list.extend(by_family(given));
        }
    }

    /// The conditions of a scheme: the paper's, with what the scheme gives.
    pub fn of(scheme: &Scheme) -> Self {
        let mut out = Self::default();
        out.apply(&scheme.simulation);
        out.requirements.extend(by_family(&scheme.requirements));
        out
    }

    /// Whether the requirements are those of the program: neither file nor option states one.
    pub fn requires_by_default(&self) -> bool {
        self.requirements == Self::default().requirements
    }

    /// The rate in deg/s at which a position is reached; `None`: at once.
    pub fn slew_rate(&self, position: &Position) -> Option<f64> {
        let own = position.slew.as_ref().and_then(|s| s.rate_deg_s);
        own.or(self.slew_rate_deg_s).filter(|_| self.slews)
    }

    /// Checks what the types do not: every number is in its range.
    ///
    /// # Errors
    /// [`SimulationError::Range`] naming the offender.
    pub fn validate(&self) -> Result<(), SimulationError> {
        let single = [
            ("step_s", self.step_s, ranges::STEP_S),
            ("dwell_s", self.dwell_s, ranges::DWELL_S),
            ("slew_rate_deg_s", self.slew_rate_deg_s.unwrap_or(1.0), ranges::SLEW_RATE_DEG_S),
            ("accelerometer_noise_g", self.accelerometer_noise_g, ranges::NOISE_G),
            ("azimuth_noise_deg", self.azimuth_noise_deg, ranges::AZIMUTH_NOISE_DEG),
            ("drift_scale", self.drift_scale, ranges::DRIFT_SCALE),
        ];
        for (what, x, range) in single {
            range.check(what, x)?;
        }
        self.drift_noise.check("drift_noise")?;
        for (what, list, range) in self.lists() {
            for a in list {
                range.check(format!("the {what} of {}", a.name), a.value)?;
            }
        }
        Ok(())
    }

    /// Every list of assignments, in words, with the range of its numbers.
    fn lists(&self) -> [(&'static str, &[Assignment], Range); 4] {
        [
            (TRUE_VALUE, &self.values, ranges::VALUE),
            (ESTIMATE, &self.estimates, ranges::VALUE),
            (PRIOR, &self.priors, ranges::PRIOR),
            (REQUIRED, &self.requirements, ranges::REQUIREMENT),
        ]
    }

    /// The same without assignments to single unknowns that `platform` does not have: for another carry, or other positions.
    pub(crate) fn within(&self, platform: &Platform) -> Self {
        let kept = |list: &[Assignment]| -> Vec<Assignment> {
            let has = |a: &&Assignment| {
                is_family(&a.name) || platform.names().iter().any(|name| concerns(&a.name, name))
            };
            list.iter().filter(has).cloned().collect()
        };
        Self {
            values: kept(&self.values),
            estimates: kept(&self.estimates),
            priors: kept(&self.priors),
            requirements: kept(&self.requirements),
            ..self.clone()
        }
    }

    /// Checks that every assignment concerns an unknown of `platform`, or a family that a gyro model may have.
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`].
    pub fn concern(&self, platform: &Platform) -> Result<(), SimulationError> {
        self.lists()
            .into_iter()
            .try_for_each(|(what, list, _)| resolve(what, platform, list, 0.0).map(|_| ()))
    }
}

/// A true value in words.
pub const TRUE_VALUE: &str = "true value";
/// An initial estimate in words.
pub const ESTIMATE: &str = "initial estimate";
/// A prior standard deviation in words.
pub const PRIOR: &str = "prior sigma";
/// A requirement in words.
pub const REQUIRED: &str = "required sigma";

impl Settings {
    /// Every number by its key in a scheme file, with its range.
    pub(crate) fn numbers(&self) -> Vec<(String, f64, Range)> {
        let single = [
            ("step_s", self.step_s, ranges::STEP_S),
            ("dwell_s", self.dwell_s, ranges::DWELL_S),
            ("slew_rate_deg_s", self.slew_rate_deg_s, ranges::SLEW_RATE_DEG_S),
            ("accelerometer_noise_g", self.accelerometer_noise_g, ranges::NOISE_G),
            ("azimuth_noise_deg", self.azimuth_noise_deg, ranges::AZIMUTH_NOISE_DEG),
            ("drift_scale", self.drift_scale, ranges::DRIFT_SCALE),
            (
                "drift_noise",
                self.drift_noise.map(DriftNoise::amount).filter(|x| *x != 0.0),
                ranges::DRIFT_NOISE,
            ),
        ];
        let single =
            single.into_iter().filter_map(|(key, x, range)| Some((format!("simulation.{key}"), x?, range)));
        let lists = self.lists().into_iter().flat_map(|(key, list, range)| {
            list.iter().map(move |(name, x)| (format!("simulation.{key}.{name}"), *x, range))
        });
        single.chain(lists).collect()
    }

    /// The lists by their keys, with the range of their numbers.
    pub(crate) fn lists(&self) -> [(&'static str, &BTreeMap<String, f64>, Range); 3] {
        [
            ("values", &self.values, ranges::VALUE),
            ("estimates", &self.estimates, ranges::VALUE),
            ("priors", &self.priors, ranges::PRIOR),
        ]
    }
}

/// The latitude of a scheme, or the default.
pub fn latitude_of(scheme: &Scheme) -> Option<Latitude> {
    scheme.latitude.or_else(|| DEFAULT_LATITUDE.parse().ok())
}

/// Whether an assignment to `pattern` concerns the unknown `name`.
pub(crate) fn concerns(pattern: &str, name: &str) -> bool {
    let base = name.split('@').next().unwrap_or(name);
    let base = base.strip_suffix("^n").unwrap_or(base);
    let family = base.strip_prefix("D_").zip(pattern.strip_prefix("D_"));
    let family = family.is_some_and(|(own, asked)| own.len() == asked.len() + 1 && own.starts_with(asked));
    let kind = base.split_once('_').is_some_and(|(kind, _)| kind == pattern);
    pattern == name || pattern == base || family || kind
}

/// Whether some scheme has an unknown or family of this name.
pub(crate) fn may_be_unknown(name: &str) -> bool {
    let axis = |name: &str| matches!(name, "psi_x" | "psi_y" | "psi_z" | "eps_x" | "eps_y" | "eps_z");
    let number = |i: &str| i.len() <= 4 && !i.starts_with('0') && i.bytes().all(|b| b.is_ascii_digit());
    let at = |name: &str| {
        let parts = name.split_once('@');
        parts.is_some_and(|(own, i)| own.starts_with("psi") && axis(own) && !i.is_empty() && number(i))
    };
    is_family(name) || axis(name.strip_suffix("^n").unwrap_or(name)) || at(name)
}

/// Whether a gyro model may have it, even if the scheme at hand does not.
pub(crate) fn is_family(name: &str) -> bool {
    let letters = name.strip_prefix("D_").unwrap_or("");
    let letters = letters.strip_suffix(['X', 'Y', 'Z']).unwrap_or(letters);
    ["psi", "eps", "D"].contains(&name) || crate::model::Term::ALL.iter().any(|t| t.letters() == letters)
}

/// Families that stand for several unknowns.
const FAMILIES: [&str; 7] = ["psi", "eps", "D", "D_F", "D_I", "D_O", "D_S"];

/// What could have been meant by `name`: the nearest, or all there is (the first of very many).
pub(crate) fn known(platform: &Platform, name: &str) -> String {
    let families = FAMILIES.iter().filter(|f| platform.names().iter().any(|n| concerns(f, n)));
    let names: Vec<String> =
        platform.names().iter().cloned().chain(families.map(ToString::to_string)).collect();
    match nearest(name, &names) {
        Some(hint) => format!("did you mean `{hint}`?"),
        None if names.len() > 40 => {
            format!("expected one of {}, ... or a family such as D_F", names[..20].join(", "))
        }
        None => format!("expected one of {}", names.join(", ")),
    }
}

/// One number per unknown of `platform`, in the unit of the unknown (psi in deg): `default` where nothing is
/// assigned.
///
/// # Errors
/// [`SimulationError::UnknownName`] for an assignment that concerns nothing; a family that the scheme does not have is
/// accepted when the gyro model has it.
pub fn resolve(
    what: &'static str,
    platform: &Platform,
    assignments: &[Assignment],
    default: f64,
) -> Result<Vec<f64>, SimulationError> {
    let mut out = vec![default; platform.names().len()];
    for a in assignments {
        let mut found = is_family(&a.name);
        for (slot, name) in out.iter_mut().zip(platform.names()) {
            if concerns(&a.name, name) {
                *slot = a.value;
                found = true;
            }
        }
        if !found {
            return Err(SimulationError::UnknownName {
                what,
                found: a.name.clone(),
                known: known(platform, &a.name),
            });
        }
    }
    Ok(out)
}

/// The unit in which an unknown is given and reported: degrees for psi.
pub fn shown_unit(unit: &str) -> &str {
    if unit == "rad" { "deg" } else { unit }
}

/// SI units per shown unit of an unknown: rad per deg, rad/s per deg/h.
pub fn si_per_shown(unit: &str) -> f64 {
    if unit == "rad" { 1f64.to_radians() } else { 1f64.to_radians() / 3600.0 }
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
        for wrong in ["0.01", "-1 deg/h", "nan deg/h", "1 rad/s", "deg/h"] {
            assert!(wrong.parse::<DriftNoise>().is_err(), "{wrong}");
        }
        // a random walk of N deg/sqrt(h) turns by N after an hour, whatever the step
        let walk = |dt: f64| DriftNoise::RandomWalk(0.3).held_rad_s(dt) * dt * (3600.0 / dt).sqrt();
        assert!((walk(10.0).to_degrees() - 0.3).abs() < 1e-12 && (walk(1.0) - walk(10.0)).abs() < 1e-15);
    }
}
