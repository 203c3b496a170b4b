//! Estimates of what a scheme or model determines, from records of its runs.

use std::ops::RangeInclusive;

use clap::Args;
use obsdeg_calibration::answer::{CalibrationFinding, CovarianceTable};
use obsdeg_calibration::platform::{RecordsRead, STANDARD_GRAVITY, read_records};
use obsdeg_calibration::record::Record;
use obsdeg_calibration::system::SystemFinding;
use obsdeg_calibration::{
    Before, Calibration, CalibrationProgress, Options, SystemCalibration, SystemCalibrationError,
    SystemCalibrationOptions, calibrate_system,
};
use obsdeg_core::model::Scheme;
use obsdeg_core::model::ranges;
use obsdeg_core::model::settings::{DriftNoise, Settings};
use obsdeg_evidence::acceptance::AcceptanceReport;
use obsdeg_evidence::requirements::Requirements;
use obsdeg_evidence::simulation::Conditions;
use obsdeg_report::{
    Answer, Document, File, Format, Origin, ReportError, ReviewFormat, Table, TerminalLayout,
    calibration_figures, calibration_report, covariance_csv, residuals_csv, system_calibration_figures,
    system_residuals_csv,
};
use serde::{Deserialize, Serialize};

use crate::arguments::{ANY, Assumptions, Given, SEED, check_whole, whole};
use crate::conditions::{GyroNoiseOptions, RequirementOptions, within};
use crate::host::Host;
use crate::problem::{Problem, ProblemKind};
use crate::source::{Input, ModelWithText, NamedInput, Source};

/// Default number of starts.
const STARTS: u32 = 16;
/// Range of the number of starts.
const SOME_STARTS: RangeInclusive<u64> = 1..=10_000;
/// Default of `--gate`.
const GATE: f64 = 0.999;
/// Range of one g, in m/s^2.
pub(crate) const GRAVITY: [f64; 2] = [9.0, 10.5];
/// Range of `--gate`.
const PROBABILITY: [f64; 2] = [0.5, 1.0];

/// Request of `calibrate`: how records are read, and how estimates are made.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct Calibrate {
    /// Seed of the exact verdicts
    #[arg(long, default_value_t = SEED, value_parser = whole::<u64>(ANY))]
    pub seed: u64,

    /// Starts of the iteration, that of the file and others about it; fewer are made where no other solution
    /// is to be expected
    #[arg(
        long, value_name = "N", help_heading = "Models", default_value_t = STARTS,
        value_parser = whole::<u32>(SOME_STARTS)
    )]
    pub starts: u32,

    /// The profile of an unknown, what the data say of it when all others follow; may be given several times
    #[arg(long, value_name = "NAME", help_heading = "Models")]
    pub profile: Vec<String>,

    /// Assumptions that override those of scheme files.
    #[command(flatten)]
    #[serde(flatten)]
    pub assumptions: Assumptions,

    /// White noise of Z per sample and axis, in g (default: that of the scheme, or 1e-5; 1e-15 to 1000 g)
    #[arg(long, value_name = "G", value_parser = within(ranges::NOISE_G))]
    pub noise: Option<f64>,

    /// Noise of a measured azimuth per sample, in deg (default: that of the scheme, or 0.001; 1e-12 to 1000
    /// deg)
    #[arg(long, value_name = "DEG", value_parser = within(ranges::AZIMUTH_NOISE_DEG))]
    pub azimuth_noise: Option<f64>,

    /// Estimate the noise of every component of Z from what the estimate leaves of it
    #[arg(long)]
    pub estimate_noise: bool,

    /// Samples within so many s are taken together as one measurement (default: the step of the scheme, or 10
    /// s)
    #[arg(long, value_name = "S", value_parser = within(ranges::STEP_S))]
    pub step: Option<f64>,

    /// Rate of the turns between positions in deg/s (default: that of the scheme, or at once)
    #[arg(long, value_name = "DEG_S", value_parser = within(ranges::SLEW_RATE_DEG_S))]
    pub slew_rate: Option<f64>,

    /// Random drift with its unit: "0.01 deg/h" is a bias held for one step, "0.001 deg/sqrt(h)" a random
    /// walk (default: that of the scheme, or 0.01 deg/h)
    #[arg(long, value_name = "NOISE")]
    pub drift_noise: Option<DriftNoise>,

    /// Requirements, and the bench.
    #[command(flatten)]
    #[serde(flatten)]
    pub judged: RequirementOptions,

    /// The datasheet of the gyros.
    #[command(flatten)]
    #[serde(flatten)]
    pub gyro_noise: GyroNoiseOptions,

    /// Value of one g, in m/s^2 (9 to 10.5)
    #[arg(long, value_name = "M_S2", default_value_t = STANDARD_GRAVITY, value_parser = number_within(GRAVITY))]
    pub gravity: f64,

    /// Probability that no measurement of a right record is left out as an outlier; 1 leaves none out (0.5 to
    /// 1)
    #[arg(long, value_name = "P", default_value_t = GATE, value_parser = number_within(PROBABILITY))]
    pub gate: f64,

    /// Show how the records are read (columns, positions, times, gaps, cells left out), and estimate nothing
    #[arg(long)]
    #[serde(skip)]
    pub dry_run: bool,

    /// Given options that concern one kind of file only.
    #[arg(skip)]
    #[serde(skip)]
    pub given: Given,
}

impl Default for Calibrate {
    fn default() -> Self {
        Self {
            seed: SEED,
            starts: STARTS,
            profile: Vec::new(),
            assumptions: Assumptions::default(),
            noise: None,
            azimuth_noise: None,
            estimate_noise: false,
            step: None,
            slew_rate: None,
            drift_noise: None,
            judged: RequirementOptions::default(),
            gyro_noise: GyroNoiseOptions::default(),
            gravity: STANDARD_GRAVITY,
            gate: GATE,
            dry_run: false,
            given: Given::default(),
        }
    }
}

/// Parser of a number from `low` to `high`.
pub(crate) fn number_within(
    [low, high]: [f64; 2],
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.trim().parse().ok().filter(|x: &f64| (low..=high).contains(x));
        number.ok_or_else(|| format!("expected a number from {low} to {high}"))
    }
}

/// Calibration of a platform or a model, or the way in which records are read.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Calibrated {
    /// Calibration of a platform.
    Platform(Box<Calibration>),
    /// Calibration of a model.
    Model(Box<SystemCalibration>),
    /// Way in which records are read; nothing was estimated.
    Read(Box<RecordsRead>),
}

impl Answer for Calibrated {
    fn layout(&self) -> Option<&str> {
        match self {
            Self::Platform(a) => a.layout(),
            Self::Model(a) => a.layout(),
            Self::Read(a) => a.layout(),
        }
    }

    fn document(&self) -> Document {
        match self {
            Self::Platform(a) => a.document(),
            Self::Model(a) => a.document(),
            Self::Read(a) => a.document(),
        }
    }

    fn tables(&self) -> Result<Vec<Table>, serde_json::Error> {
        match self {
            Self::Platform(a) => a.tables(),
            Self::Model(a) => a.tables(),
            Self::Read(a) => a.tables(),
        }
    }

    fn main_table(&self) -> &'static str {
        match self {
            Self::Platform(a) => a.main_table(),
            Self::Model(a) => a.main_table(),
            Self::Read(a) => a.main_table(),
        }
    }
}

impl Calibrated {
    /// Outcome of the requirements; `None` where none is stated.
    pub fn requirements(&self) -> Option<&Requirements> {
        match self {
            Self::Platform(c) => c.requirements.as_ref(),
            Self::Model(_) | Self::Read(_) => None,
        }
    }

    /// Acceptance within the limits of the scheme; `None` where none is stated.
    pub fn acceptance(&self) -> Option<&AcceptanceReport> {
        match self {
            Self::Platform(c) => c.acceptance.as_ref(),
            Self::Model(_) | Self::Read(_) => None,
        }
    }

    /// True if the model and its sigmas explain the records.
    pub fn passed(&self) -> bool {
        match self {
            Self::Platform(c) => c.consistent,
            Self::Model(c) => c.consistent != Some(false),
            Self::Read(_) => true,
        }
    }

    /// True if the calibration was ended before it settled.
    pub fn interrupted(&self) -> bool {
        match self {
            Self::Platform(c) => c.findings.contains(&CalibrationFinding::Interrupted),
            Self::Model(c) => c.findings.contains(&SystemFinding::Interrupted),
            Self::Read(_) => false,
        }
    }

    /// Files beside the JSON: coefficients, their covariance, residuals, and with `pictures` the page and the
    /// figures.
    ///
    /// # Errors
    /// [`ReportError`] of a figure that cannot be drawn.
    pub fn files(&self, pictures: bool) -> Result<Vec<File>, ReportError> {
        let coefficients = obsdeg_report::written(self, Format::Csv, TerminalLayout::default())?;
        let (covariance, residuals) = match self {
            Self::Platform(c) => (&c.covariance, residuals_csv(c)?),
            Self::Model(c) => (&c.covariance, system_residuals_csv(c)?),
            Self::Read(_) => return Ok(Vec::new()),
        };
        let mut files = vec![
            File { name: "coefficients.csv".into(), bytes: coefficients.into_bytes() },
            File { name: "covariance.csv".into(), bytes: covariance_csv(covariance)?.into_bytes() },
            File { name: "residuals.csv".into(), bytes: residuals.into_bytes() },
        ];
        if !pictures {
            return Ok(files);
        }
        if let Self::Platform(c) = self {
            let named = [(String::new(), c.as_ref().clone())];
            let page = calibration_report(&named, &Origin::default(), ReviewFormat::Html, "")?;
            let page = page.into_iter().take(1).map(|f| File { name: "calibration.html".into(), ..f });
            files.extend(page);
        }
        files.extend(match self {
            Self::Platform(c) => calibration_figures(c)?,
            Self::Model(c) => system_calibration_figures(c)?,
            Self::Read(_) => Vec::new(),
        });
        Ok(files)
    }
}

/// Calibrates a platform or a model from records of its runs. `before` is the JSON of an earlier calibration.
///
/// # Errors
/// Defect of the scheme, the model, a record or the earlier calibration.
pub fn calibrate(
    a: &Calibrate,
    named: NamedInput,
    records: Vec<Record>,
    before: Option<&Source>,
    host: &Host<'_>,
) -> Result<Calibrated, Problem> {
    for (option, found, range) in [("--gravity", a.gravity, GRAVITY), ("--gate", a.gate, PROBABILITY)] {
        let [low, high] = range;
        if !(low..=high).contains(&found) {
            return Err(Problem::input(format!("{option} {found}: expected a number from {low} to {high}")));
        }
    }
    check_whole("--starts", a.starts, &SOME_STARTS)?;
    let progress = |now: CalibrationProgress<'_>| (host.progress)(now.into());
    a.given.concern([&named])?;
    let mut scheme = match named.1 {
        Input::Scheme(scheme) => scheme,
        Input::Model(_) if a.dry_run => {
            return Err(Problem::input(
                "--dry-run shows how the records of a scheme are read; expected a scheme, found a model",
            ));
        }
        Input::Model(file) => return of_model(a, &file, records, before, &progress),
    };
    a.assumptions.apply(&mut scheme);
    a.judged.concern(std::iter::once(&*scheme))?;
    let options = Options {
        gravity_m_s2: a.gravity,
        estimate_noise: a.estimate_noise,
        gate: a.gate,
        prior: before.map(|p| prior(p, "obsdeg.calibration", "scheme")).transpose()?,
        seed: a.seed,
    };
    if a.dry_run {
        let read = read_records(&scheme, &a.conditions(&scheme), records, &options, &progress)?;
        return Ok(Calibrated::Read(Box::new(read)));
    }
    let found = obsdeg_calibration::calibrate(&scheme, &a.conditions(&scheme), records, &options, &progress)?;
    Ok(Calibrated::Platform(Box::new(found)))
}

/// Calibrates a model from its only record.
fn of_model(
    a: &Calibrate,
    file: &ModelWithText,
    records: Vec<Record>,
    before: Option<&Source>,
    progress: &dyn Fn(CalibrationProgress<'_>) -> bool,
) -> Result<Calibrated, Problem> {
    let found = records.len();
    let Ok([record]) = <[Record; 1]>::try_from(records) else {
        return Err(Problem::input(format!("found {found} records; expected one of a model")));
    };
    let options = SystemCalibrationOptions {
        starts: a.starts as usize,
        profiles: a.profile.clone(),
        prior: before.map(|p| prior(p, "obsdeg.system-calibration", "model")).transpose()?,
        seed: a.seed,
    };
    let found = calibrate_system(&file.model, record, &options, progress).map_err(|e| match e {
        SystemCalibrationError::Model(e) => file.wrong(&e),
        SystemCalibrationError::Interrupted => {
            Problem { kind: ProblemKind::Interrupted, ..Problem::input("interrupted") }
        }
        e => Problem::input(e.to_string()),
    })?;
    Ok(Calibrated::Model(Box::new(found)))
}

impl Calibrate {
    fn conditions(&self, scheme: &Scheme) -> Conditions {
        let mut out = Conditions::of(scheme);
        out.apply(&Settings {
            step_s: self.step,
            accelerometer_noise_g: self.noise,
            azimuth_noise_deg: self.azimuth_noise,
            slew_rate_deg_s: self.slew_rate,
            drift_noise: self.drift_noise,
            ..self.gyro_noise.settings()
        });
        self.judged.add_to(&mut out);
        out
    }
}

/// Reads an earlier calibration. `kind` is the name of its JSON layout without the version; `of` is `scheme`
/// or `model`.
fn prior<S: serde::de::DeserializeOwned>(
    source: &Source,
    kind: &str,
    of: &str,
) -> Result<Before<S>, Problem> {
    let wrong = |found: &str| {
        Problem::input(format!(
            "{}: {found}; expected the calibration.json that `obsdeg calibrate -o` wrote of a {of}",
            source.name
        ))
    };
    let value: serde_json::Value = match serde_json::from_str(&source.text) {
        Ok(value) => value,
        Err(_) if !source.text.trim_start().starts_with('{') => return Err(wrong("no JSON")),
        Err(e) => return Err(wrong(&format!("JSON that cannot be read ({e})"))),
    };
    let schema = value.get("schema").and_then(|s| s.as_str()).unwrap_or_default();
    match schema.split('/').next().unwrap_or_default() {
        found if found == kind => {}
        "obsdeg.calibration" => return Err(wrong("the calibration of a scheme")),
        "obsdeg.system-calibration" => return Err(wrong("the calibration of a model")),
        _ => return Err(wrong("no calibration")),
    }
    let key = |name: &str| value.get(name).cloned().unwrap_or_default();
    let older = |e: serde_json::Error| wrong(&format!("a calibration of another version ({e})"));
    let mut estimates: CovarianceTable = serde_json::from_value(key("covariance")).map_err(older)?;
    // the sigmas of an inconsistent calibration are too small
    if value["consistent"] == false {
        estimates.covariance.clone_from(&estimates.rescaled);
    }
    let rests_on = serde_json::from_value(key("rests_on")).map_err(older)?;
    let of = serde_json::from_value(key(if of == "scheme" { "setup" } else { of })).map_err(older)?;
    // a prior is unknown, standard deviation, unit; a model's calibration has none
    let named = |prior: &serde_json::Value| prior[0].as_str().map(String::from);
    let priors = value["assumed"]["priors"].as_array().map_or(&[][..], Vec::as_slice);
    let priors = priors.iter().filter_map(named).collect();
    Ok(Before { priors, estimates, rests_on, of })
}
