//! Conditions of a run: noise, steps, true values, priors; all in the units of the report.

use std::collections::BTreeMap;

use obsdeg_core::model::ranges::{self, Range};
use obsdeg_core::model::settings::{
    Assignment, DriftNoise, FilterKind, Propagation, Settings, Truth, concerns, is_family, known,
};
use obsdeg_core::model::{Latitude, Platform, Position, Scheme};

use obsdeg_ekf::SensorNoise;

use super::datasheet::GyroNoise;
use super::error::SimulationError;
use crate::requirements::SigmaSource;

/// Conditions of a run: everything that it needs besides the scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditions {
    /// Model of the truth.
    pub truth: Truth,
    /// Requested filter; `None`: the linear one where its model holds, the iterated one elsewhere.
    pub filter: Option<FilterKind>,
    /// Largest step, in s; a position is divided into equal steps.
    pub step_s: f64,
    /// Dwell of positions that state none, in s.
    pub dwell_s: f64,
    /// Time at the start of every position at rest, in s, whose samples are left out (`settle` of the record;
    /// 0: none). A rotating segment has no rest, and none of its samples is left out.
    pub settle_s: f64,
    /// Rate of the rotations between positions, in deg/s; `None`: instantaneous, unless the position states a
    /// rate.
    pub slew_rate_deg_s: Option<f64>,
    /// True if positions may be reached by slews; false: every position is reached instantaneously.
    pub slews: bool,
    /// White noise of the observation per sample and axis, in g.
    pub accelerometer_noise_g: f64,
    /// Bias instability of the accelerometers, in ug: the coefficient B, as for gyros; 0: none.
    pub accelerometer_instability_ug: f64,
    /// Correlation time, in s, of the Gauss-Markov process that models the bias instability of the
    /// accelerometers.
    pub accelerometer_correlation_s: f64,
    /// Noise of a measured azimuth per sample, in deg.
    pub azimuth_noise_deg: f64,
    /// Random drift of the gyros.
    pub drift_noise: DriftNoise,
    /// Step of the stated drift noise, in s: a bias held for one step has another density with other steps.
    pub drift_noise_step_s: f64,
    /// Further noise of the gyros by their datasheet.
    pub gyro_noise: GyroNoise,
    /// Propagation of the filter.
    pub propagation: Propagation,
    /// True values; later ones override earlier ones.
    pub values: Vec<Assignment>,
    /// Factor on the true drift coefficients and their priors, dimensionless.
    pub drift_scale: f64,
    /// Initial estimates; later ones override earlier ones.
    pub estimates: Vec<Assignment>,
    /// Initial standard deviations; later ones override earlier ones.
    pub priors: Vec<Assignment>,
    /// Largest standard deviations allowed, as stated: the program has none of its own.
    pub requirements: Vec<Assignment>,
    /// Sizes (one sigma) of errors that are not estimated, in their units; an error without a stated size
    /// does not count.
    pub bench: Vec<Assignment>,
    /// Conditions that a file or an option states, whatever their values: see [`Self::states`].
    pub stated: Stated,
}

/// Conditions that a file or an option states. The program chooses the others and every answer names them;
/// chosen random drift, priors and true values count in runs only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stated {
    /// True if the largest step between samples is stated.
    pub step: bool,
    /// True if the dwell of positions without one is stated.
    pub dwell: bool,
    /// True if the white noise of the accelerometers is stated.
    pub accelerometer_noise: bool,
    /// True if the noise of a measured azimuth is stated.
    pub azimuth_noise: bool,
    /// True if random drift is stated: `drift_noise` or an angle random walk of the gyros.
    pub drift_noise: bool,
    /// True if the model of the truth is stated.
    pub truth: bool,
}

/// Latitude of a scheme that states none, in degrees (the paper does not give its own).
pub(crate) const DEFAULT_LATITUDE: &str = "28.2";

fn assign(name: &str, value: f64) -> Assignment {
    Assignment { name: name.into(), value }
}

impl Default for Conditions {
    /// Conditions of the paper's run. Its prior and latitude, which the paper does not give, are chosen here.
    /// No requirements.
    fn default() -> Self {
        let first_order = |value| ["D_I", "D_O", "D_S"].map(|name| assign(name, value));
        let drift = [("D_FX", 11.0), ("D_FY", 12.0), ("D_FZ", 13.0)].map(|(n, v)| assign(n, v));
        let values = [assign("D", 0.5), assign("psi", 0.1), assign("eps", 10.0)].into_iter();
        let priors = [assign("D", 1.0), assign("psi", 0.1), assign("eps", 20.0), assign("D_F", 20.0)];
        // ppm, arcsec, ug, ug/g^2, ug/g^3: true value, prior
        let others = [
            ("GS", 100.0, 300.0),
            ("GM", 60.0, 120.0),
            ("K0", 300.0, 1000.0),
            ("K1", 100.0, 300.0),
            ("M", 60.0, 120.0),
            ("K2", 20.0, 50.0),
            ("K3", 10.0, 30.0),
            ("Kx", 10.0, 30.0),
        ];
        Self {
            truth: Truth::Linear,
            filter: None,
            step_s: 10.0,
            dwell_s: 1000.0,
            settle_s: 0.0,
            slew_rate_deg_s: None,
            slews: true,
            accelerometer_noise_g: 1e-5,
            accelerometer_instability_ug: 0.0,
            accelerometer_correlation_s: 3600.0,
            azimuth_noise_deg: 0.001,
            drift_noise: DriftNoise::OneStep(0.01),
            drift_noise_step_s: 10.0,
            gyro_noise: GyroNoise::default(),
            propagation: Propagation::Exponential,
            values: values
                .chain(first_order(5.0))
                .chain(drift)
                .chain(others.map(|(name, value, _)| assign(name, value)))
                .collect(),
            drift_scale: 1.0,
            estimates: Vec::new(),
            priors: priors
                .into_iter()
                .chain(first_order(10.0))
                .chain(others.map(|(name, _, prior)| assign(name, prior)))
                .collect(),
            requirements: Vec::new(),
            bench: Vec::new(),
            stated: Stated::default(),
        }
    }
}

/// Assignments with families before single unknowns, so that single values hold in whatever order they are
/// given. Among equal names the last one counts.
pub fn general_first(mut given: Vec<Assignment>) -> Vec<Assignment> {
    given.sort_by_key(|a| a.name.len());
    given
}

fn by_family(given: &BTreeMap<String, f64>) -> Vec<Assignment> {
    general_first(given.iter().map(|(n, v)| assign(n, *v)).collect())
}

impl Conditions {
    /// Overrides conditions by those that `settings` states.
    pub fn apply(&mut self, settings: &Settings) {
        fn set<T: Copy>(slot: &mut T, value: Option<T>) {
            if let Some(value) = value {
                *slot = value;
            }
        }
        let stated = &mut self.stated;
        stated.step |= settings.step_s.is_some();
        stated.dwell |= settings.dwell_s.is_some();
        stated.accelerometer_noise |= settings.accelerometer_noise_g.is_some();
        stated.azimuth_noise |= settings.azimuth_noise_deg.is_some();
        stated.drift_noise |=
            settings.drift_noise.is_some() || settings.angle_random_walk_deg_sqrt_h.is_some();
        stated.truth |= settings.truth.is_some();
        set(&mut self.truth, settings.truth);
        self.filter = settings.filter.or(self.filter);
        // a filter with full attitudes is for a platform that has them
        if !stated.truth {
            self.truth = if self.has_full_attitudes() { Truth::Exact } else { Self::default().truth };
        }
        set(&mut self.step_s, settings.step_s);
        set(&mut self.dwell_s, settings.dwell_s);
        set(&mut self.accelerometer_noise_g, settings.accelerometer_noise_g);
        set(&mut self.accelerometer_instability_ug, settings.accelerometer_bias_instability_ug);
        set(&mut self.accelerometer_correlation_s, settings.accelerometer_correlation_time_s);
        set(&mut self.azimuth_noise_deg, settings.azimuth_noise_deg);
        if let Some(noise) = settings.drift_noise {
            self.drift_noise = noise;
            self.drift_noise_step_s = self.step_s;
        }
        let gyros = &mut self.gyro_noise;
        set(&mut gyros.angle_random_walk_deg_sqrt_h, settings.angle_random_walk_deg_sqrt_h);
        set(&mut gyros.rate_random_walk_dph_sqrt_h, settings.rate_random_walk_dph_sqrt_h);
        set(&mut gyros.bias_instability_dph, settings.bias_instability_dph);
        set(&mut gyros.correlation_time_s, settings.correlation_time_s);
        // an angle random walk states the white drift
        if settings.angle_random_walk_deg_sqrt_h.is_some() && settings.drift_noise.is_none() {
            self.drift_noise = DriftNoise::OneStep(0.0);
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

    /// Conditions of a scheme: those of the paper, with those that the scheme states.
    pub fn of(scheme: &Scheme) -> Self {
        let mut out = Self::default();
        out.apply(&scheme.simulation);
        out.settle_s = scheme.recording.settle.unwrap_or(0.0);
        out.requirements.extend(by_family(&scheme.requirements));
        out.bench.extend(by_family(&scheme.bench));
        out
    }

    /// Priors that a file or an option states, without those of the program.
    pub fn stated_priors(&self) -> &[Assignment] {
        self.priors.strip_prefix(&Self::default().priors[..]).unwrap_or(&self.priors)
    }

    /// True values that a file or an option states, without those of the paper.
    pub fn stated_values(&self) -> &[Assignment] {
        self.values.strip_prefix(&Self::default().values[..]).unwrap_or(&self.values)
    }

    /// Basis of a prediction under these conditions.
    pub fn basis(&self) -> SigmaSource {
        if self.stated_priors().is_empty() { SigmaSource::Predicted } else { SigmaSource::PredictedWithPrior }
    }

    /// Stated priors in words, such as `psi 0.05, D_F 20`, each in the unit of its unknown; `None` where none
    /// is stated.
    pub fn stated_prior_in_words(&self) -> Option<String> {
        let scale = match self.drift_scale {
            1.0 => String::new(),
            factor => format!(", those of drifts times {factor}"),
        };
        let listed: Vec<String> =
            self.stated_priors().iter().map(|a| format!("{} {}", a.name, a.value)).collect();
        (!listed.is_empty()).then(|| format!("{}{scale}", listed.join(", ")))
    }

    /// Sizes of the bench in words, such as `K0 20, latitude 10`, each in the unit of its error, with the
    /// sizes that a family stated later overrides; `None` where none is stated.
    pub(crate) fn bench_in_words(&self) -> Option<String> {
        // of two sizes of the same error the later one counts
        let counts = |i: &usize| {
            let own = &self.bench[*i].name;
            !self.bench[i + 1..].iter().any(|later| later.name == *own || concerns(&later.name, own))
        };
        let named = |i: usize| format!("{} {}", self.bench[i].name, self.bench[i].value);
        let listed: Vec<String> = (0..self.bench.len()).filter(counts).map(named).collect();
        let family = |i: usize| {
            let own = &self.bench[i].name;
            (i + 1..self.bench.len())
                .rfind(|&k| self.bench[k].name != *own && concerns(&self.bench[k].name, own))
        };
        let gone = (0..self.bench.len()).filter(|i| !counts(i));
        let gone: Vec<String> =
            gone.filter_map(|i| Some(format!("{} gives way to {}", named(i), named(family(i)?)))).collect();
        let gone = if gone.is_empty() { String::new() } else { format!(" ({})", gone.join("; ")) };
        (!listed.is_empty()).then(|| format!("{}{gone}", listed.join(", ")))
    }

    /// Random drift with its unit, in words; `None` where there is none.
    pub fn drift_noise_in_words(&self) -> Option<String> {
        (self.drift_noise.amount() > 0.0).then(|| self.drift_noise.to_string())
    }

    /// Conditions that are stated; a value other than the program's own counts as stated.
    pub fn states(&self) -> Stated {
        let own = Self::default();
        let Stated { step, dwell, accelerometer_noise, azimuth_noise, drift_noise, truth } = self.stated;
        Stated {
            step: step || self.step_s != own.step_s,
            dwell: dwell || self.dwell_s != own.dwell_s,
            accelerometer_noise: accelerometer_noise
                || self.accelerometer_noise_g != own.accelerometer_noise_g,
            azimuth_noise: azimuth_noise || self.azimuth_noise_deg != own.azimuth_noise_deg,
            drift_noise: drift_noise || self.drift_noise != own.drift_noise,
            truth,
        }
    }

    /// True if the requested filter has full attitudes.
    pub(crate) fn has_full_attitudes(&self) -> bool {
        self.filter.is_some_and(|filter| filter != FilterKind::Linear)
    }

    /// Checks that the requested filter can follow the truth of a run.
    ///
    /// # Errors
    /// [`SimulationError::LinearTruth`].
    pub(crate) fn check_truth(&self) -> Result<(), SimulationError> {
        match self.filter {
            Some(filter) if filter != FilterKind::Linear && self.truth == Truth::Linear => {
                Err(SimulationError::LinearTruth { filter: filter.name() })
            }
            _ => Ok(()),
        }
    }

    /// Conditions that requirements are judged by: without random drift that is not stated. (Priors that are
    /// not stated do not count either: see [`Self::stated_priors`].)
    pub fn as_stated(&self) -> Self {
        let drift_noise = if self.states().drift_noise { self.drift_noise } else { DriftNoise::OneStep(0.0) };
        Self { drift_noise, ..self.clone() }
    }

    /// Time at the start of a position whose samples are left out, in s; `None` where none is.
    pub(crate) fn stated_settle_s(&self) -> Option<f64> {
        Some(self.settle_s).filter(|s| *s > 0.0)
    }

    /// True if every position of `scheme` has samples that count.
    pub fn leaves_samples(&self, scheme: &Scheme) -> bool {
        let dwells = scheme.positions.iter().map(|p| p.dwell.map_or(self.dwell_s, |d| d.seconds()));
        dwells.fold(f64::INFINITY, f64::min) > 1.001 * self.settle_s
    }

    /// Rate at which a position is reached, in deg/s; `None`: instantaneously.
    pub fn slew_rate(&self, position: &Position) -> Option<f64> {
        let own = position.slew.as_ref().and_then(|s| s.rate_deg_s);
        own.or(self.slew_rate_deg_s).filter(|_| self.slews)
    }

    /// Conditions without random drift of any kind, and without bias instability of the accelerometers: the
    /// noise of Z is white.
    pub fn without_drift_noise(self) -> Self {
        Self {
            drift_noise: DriftNoise::OneStep(0.0),
            gyro_noise: GyroNoise::default(),
            accelerometer_instability_ug: 0.0,
            ..self
        }
    }

    /// Noise of the accelerometers in g, without their white noise.
    pub fn accelerometer(&self) -> SensorNoise {
        let correlation = self.accelerometer_correlation_s;
        SensorNoise::accelerometer(0.0, 0.0, self.accelerometer_instability_ug, correlation)
    }

    /// Checks that every number is in its range.
    ///
    /// # Errors
    /// [`SimulationError::Range`] with the name of the number.
    pub fn validate(&self) -> Result<(), SimulationError> {
        let single = [
            ("step_s", self.step_s, ranges::STEP_S),
            ("dwell_s", self.dwell_s, ranges::DWELL_S),
            ("settle_s", self.settle_s, ranges::SETTLE_S),
            ("slew_rate_deg_s", self.slew_rate_deg_s.unwrap_or(1.0), ranges::SLEW_RATE_DEG_S),
            ("accelerometer_noise_g", self.accelerometer_noise_g, ranges::NOISE_G),
            ("azimuth_noise_deg", self.azimuth_noise_deg, ranges::AZIMUTH_NOISE_DEG),
            ("drift_scale", self.drift_scale, ranges::DRIFT_SCALE),
        ];
        for (what, x, range) in single {
            range.check(what, x)?;
        }
        if self.accelerometer_instability_ug != 0.0 {
            ranges::INSTABILITY_UG
                .check("accelerometer_bias_instability_ug", self.accelerometer_instability_ug)?;
        }
        ranges::CORRELATION_S.check("accelerometer_correlation_time_s", self.accelerometer_correlation_s)?;
        self.drift_noise.check("drift_noise")?;
        self.gyro_noise.validate()?;
        for (what, list, range) in self.lists() {
            for a in list {
                range.check(format!("the {what} of {}", a.name), a.value)?;
            }
        }
        for a in &self.bench {
            ranges::BENCH.check(format!("the size of {} in the bench", a.name), a.value)?;
        }
        Ok(())
    }

    /// Lists of assignments with their names and the ranges of their numbers.
    fn lists(&self) -> [(&'static str, &[Assignment], Range); 4] {
        [
            (TRUE_VALUE, &self.values, ranges::VALUE),
            (ESTIMATE, &self.estimates, ranges::VALUE),
            (PRIOR, &self.priors, ranges::PRIOR),
            (REQUIRED, &self.requirements, ranges::REQUIREMENT),
        ]
    }

    /// Conditions without assignments to single unknowns that `platform` does not have, for another carry or
    /// other positions.
    pub fn within(&self, platform: &Platform) -> Self {
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

    /// Checks that every assignment concerns an unknown of `platform`, or a family that a gyro model may
    /// have.
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`].
    pub fn concern(&self, platform: &Platform) -> Result<(), SimulationError> {
        self.lists()
            .into_iter()
            .try_for_each(|(what, list, _)| resolve(what, platform, list, 0.0).map(|_| ()))
    }
}

/// Name of a true value in messages.
pub(crate) const TRUE_VALUE: &str = "true value";
/// Name of an initial estimate in messages.
pub(crate) const ESTIMATE: &str = "initial estimate";
/// Name of a prior standard deviation in messages.
pub const PRIOR: &str = "prior sigma";
/// Name of a requirement in messages.
pub(crate) const REQUIRED: &str = "required sigma";

/// Latitude of a scheme, or the default.
pub fn latitude_of(scheme: &Scheme) -> Option<Latitude> {
    scheme.latitude.or_else(|| DEFAULT_LATITUDE.parse().ok())
}

/// Values of the unknowns of `platform`, each in its unit (psi in deg): `default` where nothing is assigned.
///
/// # Errors
/// [`SimulationError::UnknownName`] for an assignment that concerns no unknown. A family that the scheme does
/// not have is accepted if the gyro model has it.
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
                known: known(platform.names(), &a.name),
            });
        }
    }
    Ok(out)
}

/// Largest sigmas allowed, by unknown, in the shown units; `None` where nothing is required.
///
/// # Errors
/// [`SimulationError::UnknownName`], as [`resolve`].
pub fn required_sigmas(
    platform: &Platform,
    conditions: &Conditions,
) -> Result<Vec<Option<f64>>, SimulationError> {
    let required = resolve(REQUIRED, platform, &conditions.within(platform).requirements, f64::NAN)?;
    Ok(required.into_iter().map(|r| Some(r).filter(|r| !r.is_nan())).collect())
}

/// Unit in which an unknown is given and reported: deg for psi.
pub fn shown_unit(unit: &str) -> &str {
    if unit == "rad" { "deg" } else { unit }
}

/// True if an unknown of this unit is a rate.
pub fn is_rate(unit: &str) -> bool {
    unit.starts_with("deg/h")
}

/// Factor from the shown unit of an unknown to SI: rad per deg, rad/s per deg/h, 1 per ppm, rad per arcsec, g
/// per ug.
pub fn si_per_shown(unit: &str) -> f64 {
    match unit {
        "rad" => 1f64.to_radians(),
        "arcsec" => 1f64.to_radians() / 3600.0,
        "ppm" => 1e-6,
        _ if unit.starts_with("ug") => 1e-6,
        _ => 1f64.to_radians() / 3600.0,
    }
}
