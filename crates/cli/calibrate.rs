//! `obsdeg calibrate`: what a scheme determines, from the record of its run.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::{Arg, Args};
use obsdeg_calibration::answer::{CovarianceTable, Finding};
use obsdeg_calibration::platform::STANDARD_GRAVITY;
use obsdeg_calibration::record::Record;
use obsdeg_calibration::system::SystemFinding;
use obsdeg_calibration::{
    Before, Going, Options, SystemCalibrationError, SystemOptions, calibrate, calibrate_system,
};
use obsdeg_core::model::Scheme;
use obsdeg_core::model::ranges;
use obsdeg_core::model::settings::{DriftNoise, Settings};
use obsdeg_evidence::simulation::Conditions;
use obsdeg_report::{
    File, ReportError, calibration_figures, residuals_csv, system_calibration_figures, system_residuals_csv,
};

use crate::arguments::{ANY, Assumptions, Given, Named, model_in, scheme_in, whole};
use crate::conditions::{GyroNoiseArguments, within};
use crate::failure::Failure;
use crate::input::{Input, ModelFile, Source, is_stdin, open};
use crate::interrupt;
use crate::output::{Output, to_a_folder};
use crate::progress::Bar;

const AFTER_HELP: &str = "\
Examples:
  obsdeg calibrate scheme.toml monday.csv
  obsdeg calibrate scheme.toml monday.csv tuesday.parquet --noise 2e-5 -o calibration
  obsdeg calibrate scheme.toml wednesday.csv --prior calibration/calibration.json
  gzip -dc record.csv.gz | obsdeg calibrate scheme.toml -
  obsdeg calibrate examples/influenza/model.toml examples/influenza/data.csv --profile beta
  gzip -dc examples/handheld/record.csv.gz | obsdeg calibrate examples/handheld/accelerometers.toml -

A record has a header with units: `t [s]`, three of `fx [g]` `fy [g]` `fz [g]` (outputs of the accelerometers in platform axes; m/s^2, mg, ug as well), \
`Zx Zy Zz` or `Z1 Z3` (`Z2` with unknown accelerometers), `Za [deg]` where the azimuth is measured, and `position` with the names of the \
scheme (empty while the platform turns); without that column the timeline of the scheme says what is where. `sigma_fx [g]` and so on make a row a mean with a sigma of \
its own. `alpha [deg] beta [deg] gamma [deg]` are held against the attitudes of the scheme, and what is left of the measurements against a temperature `T [degC]`. Other names, counts \
instead of units, and positions that are to be found as intervals at rest: `[record]` of the scheme (obsdeg schema scheme) or model. Lines that begin with # are comments, an empty cell is a value that is not there. With -o it writes calibration.json, coefficients.csv (with the whole \
covariance), residuals.csv and figures.

Exit codes: 0 done and consistent, 1 the model or its sigmas do not explain the record, 2 bad input, 3 internal error, 130 interrupted (with what there is by then, once the records are \
read).";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, mut_args(to_a_folder), mut_args(words))]
pub(crate) struct Arguments {
    /// Seed of the exact verdicts
    #[arg(long, default_value_t = 1, value_parser = whole::<u64>(ANY))]
    seed: u64,

    /// The scheme or model file, then records of its runs (CSV or Parquet; a model takes one); - is stdin
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,

    /// The scheme file; FILEs are records then
    #[arg(long, value_name = "FILE")]
    scheme: Option<PathBuf>,

    /// The model file of any other system; FILE is the record then, with columns `t`, outputs, known inputs, `sigma_NAME` of either,
    /// `experiment`
    #[arg(long, value_name = "FILE", conflicts_with = "scheme")]
    model: Option<PathBuf>,

    /// Starts of the iteration, that of the file and others about it; fewer are made where no other solution is to be expected
    #[arg(long, value_name = "N", help_heading = "Models", default_value_t = 16, value_parser = whole::<u32>(1..=10_000))]
    starts: u32,

    /// The profile of an unknown, what the data say of it when all others follow; may be given several times
    #[arg(long, value_name = "NAME", help_heading = "Models")]
    profile: Vec<String>,

    #[command(flatten)]
    assumptions: Assumptions,

    /// White noise of Z per sample and axis, in g (default: that of the scheme, or 1e-5; 1e-15 to 1000 g)
    #[arg(long, value_name = "G", value_parser = within(ranges::NOISE_G))]
    noise: Option<f64>,

    /// Noise of a measured azimuth per sample, in deg (default: that of the scheme, or 0.001; 1e-12 to 1000 deg)
    #[arg(long, value_name = "DEG", value_parser = within(ranges::AZIMUTH_NOISE_DEG))]
    azimuth_noise: Option<f64>,

    /// Estimate the noise of every component of Z from what the estimate leaves of it
    #[arg(long)]
    estimate_noise: bool,

    /// Samples within so many s are taken together as one measurement (default: the step of the scheme, or 10 s)
    #[arg(long, value_name = "S", value_parser = within(ranges::STEP_S))]
    step: Option<f64>,

    /// Rate of the turns between positions in deg/s (default: that of the scheme, or at once)
    #[arg(long, value_name = "DEG_S", value_parser = within(ranges::SLEW_RATE_DEG_S))]
    slew_rate: Option<f64>,

    /// Random drift with its unit: "0.01 deg/h" is a bias held for one step, "0.001 deg/sqrt(h)" a random walk
    /// (default: that of the scheme, or 0.01 deg/h)
    #[arg(long, value_name = "NOISE")]
    drift_noise: Option<DriftNoise>,

    #[command(flatten)]
    gyro_noise: GyroNoiseArguments,

    /// What one g is, in m/s^2 (9 to 10.5)
    #[arg(long, value_name = "M_S2", default_value_t = STANDARD_GRAVITY, value_parser = gravity)]
    gravity: f64,

    /// Probability that no measurement of a right record is left out as an outlier; 1 leaves none out (0.5 to 1)
    #[arg(long, value_name = "P", default_value_t = 0.999, value_parser = probability)]
    gate: f64,

    /// A calibration of the same platform or system before: the JSON that -o writes (one that was not consistent counts with its sigmas rescaled)
    #[arg(long = "prior", value_name = "FILE")]
    before: Option<PathBuf>,

    #[command(flatten)]
    output: Output,
}

/// What shared options say here.
fn words(arg: Arg) -> Arg {
    match arg.get_id().as_str() {
        "output" => arg.help("Write calibration, coefficients, residuals and figures to a folder"),
        "carry" => arg.help("What is carried between positions (default: that of the scheme)"),
        "latitude" => arg.help("Latitude in degrees (default: that of the scheme, or 28.2)"),
        _ => arg,
    }
}

fn gravity(text: &str) -> Result<f64, String> {
    number_within(text, 9.0, 10.5)
}

fn probability(text: &str) -> Result<f64, String> {
    number_within(text, 0.5, 1.0)
}

fn number_within(text: &str, low: f64, high: f64) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|x: &f64| (low..=high).contains(x));
    number.ok_or_else(|| format!("expected a number from {low} to {high}"))
}

pub(crate) fn run(a: &Arguments, given: &Given) -> Result<(), Failure> {
    let interrupted = interrupt::flag()?;
    a.output.check_folder()?;
    let bar = Bar::start(0, "", a.output.target.quiet);
    let going = |now: Going<'_>| {
        bar.calibrates(now);
        !interrupted.load(Ordering::Relaxed)
    };
    let (named, records) = a.read()?;
    given.concern([&named])?;
    let mut scheme = match named.1 {
        Input::Scheme(scheme) => scheme,
        Input::Model(file) => return run_model(a, &file, records, &going),
    };
    a.assumptions.apply(&mut scheme);
    let records = records.iter().map(|path| record(path)).collect::<Result<Vec<_>, _>>()?;
    let options = Options {
        gravity_m_s2: a.gravity,
        estimate_noise: a.estimate_noise,
        gate: a.gate,
        prior: a.before.as_deref().map(|p| prior(p, "obsdeg.calibration", "scheme")).transpose()?,
        seed: a.seed,
    };
    let calibration = calibrate(&scheme, &a.conditions(&scheme), records, &options, &going)?;
    drop(bar);
    a.output.write_folder(&calibration, "calibration.json", || {
        let coefficients = obsdeg_report::written(
            &calibration,
            obsdeg_report::Format::Csv,
            obsdeg_report::Layout::default(),
        )?;
        let mut files = vec![
            File { name: "coefficients.csv".into(), bytes: coefficients.into_bytes() },
            File { name: "residuals.csv".into(), bytes: residuals_csv(&calibration)?.into_bytes() },
        ];
        files.extend(calibration_figures(&calibration)?);
        Ok::<_, ReportError>(files)
    })?;
    if calibration.findings.contains(&Finding::Interrupted) {
        return Err(unfinished());
    }
    if calibration.consistent { Ok(()) } else { Err(Failure::check()) }
}

/// Ctrl-C; what there is was written.
fn unfinished() -> Failure {
    Failure::unfinished("interrupted".into())
}

/// A model and its data.
fn run_model(
    a: &Arguments,
    file: &ModelFile,
    records: &[PathBuf],
    going: &dyn Fn(Going<'_>) -> bool,
) -> Result<(), Failure> {
    let [data] = records else {
        return Err(Failure::input(format!("found {} records; expected one of a model", records.len())));
    };
    let record = record(data)?;
    let options = SystemOptions {
        starts: a.starts as usize,
        profiles: a.profile.clone(),
        prior: a.before.as_deref().map(|p| prior(p, "obsdeg.system-calibration", "model")).transpose()?,
        seed: a.seed,
    };
    let found = calibrate_system(&file.model, record, &options, going).map_err(|e| match e {
        SystemCalibrationError::Model(e) => file.wrong(&e),
        SystemCalibrationError::Interrupted => unfinished(),
        e => Failure::input(e.to_string()),
    })?;
    a.output.write_folder(&found, "calibration.json", || {
        let text =
            obsdeg_report::written(&found, obsdeg_report::Format::Csv, obsdeg_report::Layout::default())?;
        let mut files = vec![
            File { name: "coefficients.csv".into(), bytes: text.into_bytes() },
            File { name: "residuals.csv".into(), bytes: system_residuals_csv(&found)?.into_bytes() },
        ];
        files.extend(system_calibration_figures(&found)?);
        Ok::<_, ReportError>(files)
    })?;
    if found.findings.contains(&SystemFinding::Interrupted) {
        return Err(unfinished());
    }
    if found.consistent == Some(false) { Err(Failure::check()) } else { Ok(()) }
}

impl Arguments {
    /// The scheme or the model, with its file, and the records of its runs.
    fn read(&self) -> Result<(Named, &[PathBuf]), Failure> {
        let (named, records) = if let Some(path) = &self.model {
            (model_in(path)?, &self.files[..])
        } else if let Some(path) = &self.scheme {
            (scheme_in(path)?, &self.files[..])
        } else {
            let [file, records @ ..] = &self.files[..] else {
                return Err(Failure::input("expected a scheme or model file and a record of its run".into()));
            };
            if is_stdin(file) && records.iter().any(|r| is_stdin(r)) {
                return Err(Failure::input("- is given twice; expected one file on stdin".into()));
            }
            let source = Source::read(file, "scheme or model")?;
            ((source.name(), source.scheme_or_model()?), records)
        };
        match records {
            [] => Err(Failure::input(format!("no record; expected records of the run of {}", named.0))),
            records => Ok((named, records)),
        }
    }

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
        out
    }
}

/// A record that is a file, or stdin.
fn record(path: &Path) -> Result<Record, Failure> {
    let wrong = |e: &dyn std::fmt::Display| Failure::input(e.to_string());
    if path == Path::new("-") {
        return Record::stream("stdin", Box::new(std::io::stdin())).map_err(|e| wrong(&e));
    }
    let name = path.display().to_string();
    let file = open(path).map_err(|e| Failure::input(format!("cannot read the record {name}: {e}")))?;
    Record::file(&name, file).map_err(|e| wrong(&e))
}

/// A calibration before, of a scheme or a model as `kind` and `of`, the schema and the key that says what it is of.
fn prior<S: serde::de::DeserializeOwned>(path: &Path, kind: &str, of: &str) -> Result<Before<S>, Failure> {
    let source = Source::read(path, "calibration")?;
    let wrong = |found: &str| {
        Failure::input(format!(
            "{}: {found}; expected the calibration.json that `obsdeg calibrate -o` wrote of a {of}",
            path.display()
        ))
    };
    let value: serde_json::Value = match serde_json::from_str(source.text()) {
        Ok(value) => value,
        Err(_) if !source.text().trim_start().starts_with('{') => return Err(wrong("no JSON")),
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
    // sigmas that are not to be relied upon as they are
    if value["consistent"] == false {
        estimates.covariance.clone_from(&estimates.rescaled);
    }
    let rests_on = serde_json::from_value(key("rests_on")).map_err(older)?;
    let of = serde_json::from_value(key(if of == "scheme" { "setup" } else { of })).map_err(older)?;
    Ok(Before { estimates, rests_on, of })
}
