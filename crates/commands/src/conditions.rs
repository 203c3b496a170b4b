//! The conditions of a run, shared by the commands that simulate.

use std::ops::RangeInclusive;

use clap::Args;
use obsdeg_core::model::ranges::{self, Range};
use obsdeg_core::model::settings::{
    Assignment, AssignmentError, DriftNoise, FilterKind, Propagation, Settings, Truth, concerns, known,
};
use obsdeg_core::model::{PerGyro, Platform, Scheme, may_be_omitted, omitted_meant};
use obsdeg_evidence::simulation::{Conditions, general_first};
use serde::{Deserialize, Serialize};

use crate::arguments::{Word, one_of};
use crate::problem::Problem;
use crate::text;

/// Range of the number of Monte Carlo runs.
pub(crate) const RUNS: RangeInclusive<u64> = 2..=10_000_000;

/// Parser of a number within a range.
pub(crate) fn within(range: Range) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.trim().parse().ok().filter(|x| range.admits(*x));
        number.ok_or_else(|| format!("expected {range}"))
    }
}

/// Parser of `NAME=X` with a number within a range.
pub(crate) fn assigned(
    range: Range,
) -> impl Fn(&str) -> Result<Assignment, String> + Clone + Send + Sync + 'static {
    move |text| {
        let a: Assignment = text.parse().map_err(|e: AssignmentError| e.to_string())?;
        if range.admits(a.value) { Ok(a) } else { Err(format!("expected {range}")) }
    }
}

/// Measurement and requirements: all conditions that a prediction from the information matrix needs.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[command(next_help_heading = "Measurement")]
pub struct MeasurementOptions {
    /// Dwell of positions that do not say theirs, in s (default: 1000; 0.001 to 1e6 s)
    #[arg(long, value_name = "S", value_parser = within(ranges::DWELL_S))]
    pub dwell: Option<f64>,

    /// Largest sampling step, in s (default: 10; 1e-6 to 1e6 s)
    #[arg(long, value_name = "S", value_parser = within(ranges::STEP_S))]
    pub step: Option<f64>,

    /// White noise of Z per sample and axis, in g (default: 1e-5; 1e-15 to 1000 g)
    #[arg(long, value_name = "G", value_parser = within(ranges::NOISE_G))]
    pub noise: Option<f64>,

    /// Bias instability of the accelerometers in ug: B, a first-order Gauss-Markov process of each that goes
    /// on from position to position, as --bias-instability of gyros (default: none; 1e-9 to 1e9 ug)
    #[arg(long, value_name = "B", value_parser = within(ranges::INSTABILITY_UG))]
    pub accelerometer_instability: Option<f64>,

    /// Its correlation time, in s (default: 3600; 1 to 1e9 s)
    #[arg(long, value_name = "S", value_parser = within(ranges::CORRELATION_S))]
    pub accelerometer_correlation_time: Option<f64>,

    /// Noise of a measured azimuth per sample, in deg (default: 0.001; 1e-12 to 1000 deg)
    #[arg(long, value_name = "DEG", value_parser = within(ranges::AZIMUTH_NOISE_DEG))]
    pub azimuth_noise: Option<f64>,

    /// Random drift with its unit: "0.01 deg/h" is a bias held for one step, "0.001 deg/sqrt(h)" a random
    /// walk (default: none in predictions, 0.01 deg/h in simulated runs; 0, or 1e-12 to 1e6)
    #[arg(long, value_name = "NOISE")]
    pub drift_noise: Option<DriftNoise>,

    /// Standard deviation of an unknown or family beforehand in deg, deg/h, deg/h/g, ppm, arcsec, ug:
    /// D_F=0.1, psi=0.05. It counts in sigmas, not in what is observable (default: none in predictions; in
    /// simulated runs psi 0.1, D_F 20, D_I D_O D_S 10, others by family: prior_sigma in the JSON; 1e-9 to
    /// 1e9)
    #[arg(long, value_name = "NAME=X", value_parser = assigned(ranges::PRIOR))]
    #[serde(with = "text::list")]
    pub prior: Vec<Assignment>,

    /// Requirements, and the bench.
    #[command(flatten)]
    #[serde(flatten)]
    pub judged: RequirementOptions,
}

/// Requirements, and the bench that total uncertainties include.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[command(next_help_heading = "Measurement")]
pub struct RequirementOptions {
    /// Largest standard deviation allowed at the end for an unknown or family in deg, deg/h, deg/h/g, ppm,
    /// arcsec, ug: D=0.05, D_FX=0.01, K1=5 (default: none, so that nothing is judged; 1e-12 to 1e9)
    #[arg(long, value_name = "NAME=X", value_parser = assigned(ranges::REQUIREMENT))]
    #[serde(with = "text::list")]
    pub requirement: Vec<Assignment>,

    /// Bench: sizes (one sigma) of errors that the scheme does not estimate, by error or family:
    /// K0=20,latitude=10. Units: ug (K0), ug/g^2 (K2, Kx), ug/g^3 (K3), ppm (K1, GS, earth_rate, gravity),
    /// arcsec (M, GM, latitude, azimuth, attitude), deg/h, deg/h/g (D_F; D_I, D_O, D_S), deg/h/g^2 (D_II ...
    /// D_OS). Requirements are then judged by the total uncertainty (default: none counts; 0 to 1e9)
    #[arg(long, value_name = "NAME=X", value_delimiter = ',', value_parser = benched)]
    #[serde(with = "text::list")]
    pub bench: Vec<Assignment>,
}

impl RequirementOptions {
    /// Checks that every requirement concerns an unknown of at least one scheme and that no name has two
    /// values.
    ///
    /// # Errors
    /// The assignment that concerns none, with names it might mean.
    pub fn concern<'a>(&self, schemes: impl Iterator<Item = &'a Scheme> + Clone) -> Result<(), Problem> {
        stated_once("--bench", &self.bench)?;
        concern_some("--requirement", &self.requirement, schemes)
    }

    /// Adds the requirements and the bench to those of the conditions.
    pub(crate) fn add_to(&self, conditions: &mut Conditions) {
        conditions.requirements.extend(general_first(self.requirement.clone()));
        conditions.bench.extend(general_first(self.bench.clone()));
    }
}

/// Parser of a size of a bench error: `K0=20`.
fn benched(text: &str) -> Result<Assignment, String> {
    if text.parse::<Assignment>().is_err() {
        return Err("expected NAME=NUMBER in the unit of the error, as in K0=20 or latitude=10".into());
    }
    let a = assigned(ranges::BENCH)(text)?;
    if may_be_omitted(&a.name) { Ok(a) } else { Err(omitted_meant(&a.name)) }
}

/// Datasheet of the gyros; scheme files may state it too.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[command(next_help_heading = "Gyro noise")]
pub struct GyroNoiseOptions {
    /// Angle random walk in deg/sqrt(h), one number for all gyros or X,Y,Z; without --drift-noise it is all
    /// the white drift there is (default: none; 0, or 1e-12 to 1e6)
    #[arg(long, value_name = "N[,N,N]")]
    #[serde(with = "text")]
    pub angle_random_walk: Option<PerGyro>,

    /// Rate random walk in deg/h/sqrt(h), likewise: a state of each gyro (default: none; 0, or 1e-12 to 1e6)
    #[arg(long, value_name = "K[,K,K]")]
    #[serde(with = "text")]
    pub rate_random_walk: Option<PerGyro>,

    /// Bias instability in deg/h, likewise: B of IEEE Std 952, a first-order Gauss-Markov state of each gyro
    /// whose Allan peak is 0.664 B (default: none; 0, or 1e-12 to 1e6)
    #[arg(long, value_name = "B[,B,B]")]
    #[serde(with = "text")]
    pub bias_instability: Option<PerGyro>,

    /// Its correlation time, in s (default: 3600; 1 to 1e9 s)
    #[arg(long, value_name = "S", value_parser = within(ranges::CORRELATION_S))]
    pub correlation_time: Option<f64>,
}

impl GyroNoiseOptions {
    /// Settings of a run that the options state.
    pub fn settings(&self) -> Settings {
        Settings {
            angle_random_walk_deg_sqrt_h: self.angle_random_walk,
            rate_random_walk_dph_sqrt_h: self.rate_random_walk,
            bias_instability_dph: self.bias_instability,
            correlation_time_s: self.correlation_time,
            ..Settings::default()
        }
    }
}

/// Conditions of a run; options override those of scheme files.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
#[command(next_help_heading = "Conditions of the run")]
pub struct ConditionOptions {
    /// Measurement and requirements.
    #[command(flatten)]
    #[serde(flatten)]
    pub measurement: MeasurementOptions,

    /// Model of the simulated truth (default: linear; with --filter extended or iterated exact)
    #[arg(long, value_name = "LEVEL", value_parser = one_of(TRUTHS))]
    pub truth: Option<Truth>,

    /// The filter (default: linear where its model holds, else iterated)
    #[arg(long, value_name = "FILTER", value_parser = one_of(FilterKind::ALL.map(|f| (f.name(), filter_words(f), f))))]
    pub filter: Option<FilterKind>,

    /// Positions are reached by rotations at this rate, in deg/s; inertial carry only (default:
    /// instantaneous; 0.001 to 10000 deg/s)
    #[arg(long, value_name = "DEG_S", value_parser = within(ranges::SLEW_RATE_DEG_S))]
    pub slew_rate: Option<f64>,

    /// The datasheet of the gyros.
    #[command(flatten)]
    #[serde(flatten)]
    pub gyro_noise: GyroNoiseOptions,

    /// Transition matrix of the filter (default: exponential)
    #[arg(long, value_name = "HOW", value_parser = one_of(PROPAGATIONS))]
    pub propagation: Option<Propagation>,

    /// True value of an unknown or family in deg, deg/h, deg/h/g, ppm, arcsec, ug: D_FX=11, D_I=5, psi=0.1
    /// (the paper's; -1e6 to 1e6)
    #[arg(long, value_name = "NAME=X", value_parser = assigned(ranges::VALUE))]
    #[serde(with = "text::list")]
    pub value: Vec<Assignment>,

    /// Initial estimate, likewise (default: 0; -1e6 to 1e6)
    #[arg(long, value_name = "NAME=X", value_parser = assigned(ranges::VALUE))]
    #[serde(with = "text::list")]
    pub estimate: Vec<Assignment>,

    /// Factor on the true drifts and their priors (default: 1; 1e-6 to 1e6)
    #[arg(long, value_name = "X", value_parser = within(ranges::DRIFT_SCALE))]
    pub drift_scale: Option<f64>,
}

/// The words of `--truth`.
const TRUTHS: [Word<Truth>; 2] = [
    ("linear", "the model itself", Truth::Linear),
    ("exact", "direction cosines, specific force in the true platform frame", Truth::Exact),
];

/// The words of `--propagation`.
const PROPAGATIONS: [Word<Propagation>; 2] = [
    ("exponential", "the matrix exponential", Propagation::Exponential),
    ("rk4", "Runge-Kutta of fourth order", Propagation::Rk4),
];

fn filter_words(filter: FilterKind) -> &'static str {
    match filter {
        FilterKind::Linear => "small angles, gains known beforehand",
        FilterKind::Extended => "full attitudes, Jacobians at the estimate",
        FilterKind::Iterated => "the same, linearised again along the whole run",
    }
}

/// Refuses an option that gives one name two values: one of them would be ignored.
///
/// # Errors
/// The name, and both values.
fn stated_once(option: &str, given: &[Assignment]) -> Result<(), Problem> {
    for (i, a) in given.iter().enumerate() {
        if let Some(before) = given[..i].iter().find(|b| b.name == a.name && b.value != a.value) {
            let found = format!("{option} {}={} and {}={}", a.name, before.value, a.name, a.value);
            return Err(Problem::input(format!("{found}: expected one value of {}", a.name)));
        }
    }
    Ok(())
}

/// Refuses an assignment that concerns no unknown of any scheme: it would be ignored.
///
/// # Errors
/// The assignment, and names it might mean.
pub(crate) fn concern_some<'a>(
    option: &str,
    given: &[Assignment],
    schemes: impl Iterator<Item = &'a Scheme> + Clone,
) -> Result<(), Problem> {
    stated_once(option, given)?;
    for a in given {
        let mut hint = None;
        for scheme in schemes.clone() {
            let platform = Platform::new(scheme.clone()).map_err(|e| Problem::input(e.to_string()))?;
            if platform.names().iter().any(|name| concerns(&a.name, name)) {
                hint = None;
                break;
            }
            hint.get_or_insert_with(|| known(platform.names(), &a.name));
        }
        if let Some(hint) = hint {
            let message =
                format!("`{option} {}={}`: no unknown here is `{}`; {hint}", a.name, a.value, a.name);
            return Err(Problem::input(message));
        }
    }
    Ok(())
}

impl MeasurementOptions {
    /// Checks that every assignment concerns an unknown of at least one scheme.
    ///
    /// # Errors
    /// The assignment that concerns none, with names it might mean.
    pub fn concern<'a>(&self, schemes: impl Iterator<Item = &'a Scheme> + Clone) -> Result<(), Problem> {
        // without accelerometer bias instability the correlation time has no effect
        let states = |s: &Scheme| s.simulation.accelerometer_bias_instability_ug.is_some();
        if self.accelerometer_correlation_time.is_some()
            && self.accelerometer_instability.is_none()
            && !schemes.clone().any(states)
        {
            return Err(Problem::input(
                "--accelerometer-correlation-time does nothing here: expected --accelerometer-instability with it",
            ));
        }
        concern_some("--prior", &self.prior, schemes.clone())?;
        self.judged.concern(schemes)
    }

    /// Names of the given options.
    pub fn given(&self) -> impl Iterator<Item = &'static str> {
        let all = [
            ("--dwell", self.dwell.is_some()),
            ("--step", self.step.is_some()),
            ("--noise", self.noise.is_some()),
            ("--accelerometer-instability", self.accelerometer_instability.is_some()),
            ("--accelerometer-correlation-time", self.accelerometer_correlation_time.is_some()),
            ("--azimuth-noise", self.azimuth_noise.is_some()),
            ("--drift-noise", self.drift_noise.is_some()),
            ("--prior", !self.prior.is_empty()),
            ("--requirement", !self.judged.requirement.is_empty()),
            ("--bench", !self.judged.bench.is_empty()),
        ];
        all.into_iter().filter_map(|(option, given)| given.then_some(option))
    }

    /// Conditions that the scheme and the options state; the others are those of the paper.
    pub fn conditions(&self, scheme: &Scheme) -> Conditions {
        let mut out = Conditions::of(scheme);
        out.apply(&Settings {
            step_s: self.step,
            dwell_s: self.dwell,
            accelerometer_noise_g: self.noise,
            accelerometer_bias_instability_ug: self.accelerometer_instability,
            accelerometer_correlation_time_s: self.accelerometer_correlation_time,
            azimuth_noise_deg: self.azimuth_noise,
            drift_noise: self.drift_noise,
            ..Settings::default()
        });
        out.priors.extend(general_first(self.prior.clone()));
        self.judged.add_to(&mut out);
        out
    }
}

impl ConditionOptions {
    /// Checks that every assignment concerns an unknown of at least one scheme.
    ///
    /// # Errors
    /// The assignment that concerns none, with names it might mean.
    pub fn concern<'a>(&self, schemes: impl Iterator<Item = &'a Scheme> + Clone) -> Result<(), Problem> {
        self.measurement.concern(schemes.clone())?;
        for (option, given) in [("--value", &self.value), ("--estimate", &self.estimate)] {
            concern_some(option, given, schemes.clone())?;
        }
        Ok(())
    }

    /// Conditions of the paper's run, with those of the scheme and the options in their place.
    pub fn conditions(&self, scheme: &Scheme) -> Conditions {
        let mut out = self.measurement.conditions(scheme);
        out.apply(&Settings {
            truth: self.truth,
            filter: self.filter,
            slew_rate_deg_s: self.slew_rate,
            propagation: self.propagation,
            drift_scale: self.drift_scale,
            ..self.gyro_noise.settings()
        });
        out.values.extend(general_first(self.value.clone()));
        out.estimates.extend(general_first(self.estimate.clone()));
        out
    }
}
