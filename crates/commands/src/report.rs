//! Design review of schemes and models.

use clap::Args;
use obsdeg_calibration::answer::LAYOUT;
use obsdeg_calibration::{Calibration, Setup};
use obsdeg_core::system::SystemModel;
use obsdeg_design::review::{DesignReview, ReviewError, ReviewOptions, review};
use obsdeg_evidence::compare::Entry;
use obsdeg_evidence::requirements::Requirements;
use obsdeg_report::{File, Origin, ReviewFormat};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::analyze::certificate_digest;
use crate::arguments::{ANY, Assumptions, Given, SEED, check_whole, whole};
use crate::conditions::{ConditionOptions, RUNS};
use crate::host::{Host, Now};
use crate::problem::Problem;
use crate::source::{Input, ModelWithText, NamedInput, Source, title};

/// Request of `report`: assumptions, conditions and number of Monte Carlo runs.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct Report {
    /// Seed of all random choices
    #[arg(long, default_value_t = SEED, value_parser = whole::<u64>(ANY))]
    pub seed: u64,

    /// Assumptions that override those of scheme files.
    #[command(flatten)]
    #[serde(flatten)]
    pub assumptions: Assumptions,

    /// Monte Carlo runs of the evidence
    #[arg(
        id = "monte_carlo", long = "runs", value_name = "N", default_value_t = DEFAULT_RUNS,
        value_parser = whole::<u32>(RUNS)
    )]
    pub runs: u32,

    /// Conditions of a run.
    #[command(flatten)]
    #[serde(flatten)]
    pub conditions: ConditionOptions,

    /// Given options that concern one kind of file only.
    #[arg(skip)]
    #[serde(skip)]
    pub given: Given,
}

/// Default number of Monte Carlo runs.
const DEFAULT_RUNS: u32 = 100;

impl Default for Report {
    fn default() -> Self {
        Self {
            seed: SEED,
            assumptions: Assumptions::default(),
            runs: DEFAULT_RUNS,
            conditions: ConditionOptions::default(),
            given: Given::default(),
        }
    }
}

impl Report {
    /// Refuses options on schemes for a report without one.
    ///
    /// # Errors
    /// The options that have no meaning.
    pub fn assumes_nothing(&self) -> Result<(), Problem> {
        let default = Self::default();
        let asked = (&self.assumptions, &self.conditions, self.runs, self.seed);
        match asked == (&default.assumptions, &default.conditions, default.runs, default.seed) {
            true => Ok(()),
            false => Err(Problem::input(
                "the report of a calibration has its conditions; expected no conditions, --runs or --seed \
                 without a scheme or model",
            )),
        }
    }
}

/// Review with the calibrations that are part of it.
#[derive(Debug)]
pub struct Reviewed {
    review: DesignReview,
    calibrations: Vec<(String, Calibration)>,
    certificates: Vec<String>,
}

/// Calibration that is part of a review.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CalibrationFile {
    /// Name of the calibration, such as its folder.
    pub name: String,
    /// JSON of the calibration.
    pub source: Source,
}

/// Reviews schemes and models.
///
/// # Errors
/// Defect of a scheme, a model or a calibration.
pub fn report(
    a: &Report,
    read: Vec<NamedInput>,
    calibrations: &[CalibrationFile],
    host: &mut Host<'_>,
) -> Result<Reviewed, Problem> {
    check_whole("--runs", a.runs, &RUNS)?;
    a.given.concern(&read)?;
    let mut entries: Vec<Entry> = Vec::new();
    let mut files: Vec<ModelWithText> = Vec::new();
    for (name, input) in read {
        match input {
            Input::Model(file) => files.push(*file),
            Input::Scheme(mut scheme) => {
                a.assumptions.apply(&mut scheme);
                let conditions = a.conditions.conditions(&scheme);
                let name = if scheme.name.is_empty() { title(&name) } else { scheme.name.clone() };
                entries.push(Entry { name, scheme: *scheme, conditions });
            }
        }
    }
    let mut read = Vec::new();
    for file in calibrations {
        let (found, of) = calibration(&file.source, &entries)?;
        // calibrated values replace stated ones, without a factor
        let own = &mut entries[of].conditions;
        own.drift_scale = 1.0;
        own.values.extend(found.values());
        read.push((file.name.clone(), found));
    }
    let calibrations = read;
    if !entries.is_empty() {
        a.conditions.concern(entries.iter().map(|e| &e.scheme))?;
    }
    let models: Vec<SystemModel> = files.iter().map(|f| f.model.clone()).collect();
    let options = ReviewOptions { runs: a.runs as usize, seed: a.seed };
    let progress = host.progress;
    let reviewed = review(&entries, &models, options, host.worker.as_deref_mut(), &|what, share| {
        progress(Now::of(what, (share * 900.0) as u64, 1000))
    });
    let review = reviewed.map_err(|e| match e {
        ReviewError::Simulation { name, error } => Problem::from(error).in_file(&name),
        ReviewError::Model { model, error } => files[model].wrong(&error),
        ReviewError::Interrupted => Problem::interrupted(),
        e @ ReviewError::Analysis { .. } => Problem::input(e.to_string()),
    })?;
    let digest = |e: &Entry| match certificate_digest(&e.scheme) {
        Ok(hex) => format!("sha256 of the certificate of {}: {hex}", e.name),
        Err(why) => format!("{}: {why}", e.name),
    };
    let certificates = entries.iter().map(digest).collect();
    Ok(Reviewed { review, calibrations, certificates })
}

impl Reviewed {
    /// Outcome of the requirements of every scheme, by prediction, then that of every calibration, by its
    /// sigmas.
    pub fn requirements(&self) -> impl Iterator<Item = &Requirements> {
        let predicted = self.review.comparison.schemes.iter().map(|s| &s.requirements);
        predicted.chain(self.calibrations.iter().filter_map(|(_, c)| c.requirements.as_ref()))
    }

    /// Files of the review: the text first, then the pictures that it refers to, in `folder` beside it.
    ///
    /// # Errors
    /// [`Problem`] of a picture that cannot be drawn.
    pub fn files(&self, origin: &Origin, format: ReviewFormat, folder: &str) -> Result<Vec<File>, Problem> {
        let origin = Origin { certificates: self.certificates.clone(), ..origin.clone() };
        Ok(obsdeg_report::review(&self.review, &self.calibrations, &origin, format, folder)?)
    }
}

/// Files of the report of calibrations without a scheme: of the first one, the others being earlier ones.
///
/// # Errors
/// Defect of a calibration, or a picture that cannot be drawn.
pub fn calibration_report(
    calibrations: &[CalibrationFile],
    origin: &Origin,
    format: ReviewFormat,
    folder: &str,
) -> Result<(Vec<File>, Vec<Calibration>), Problem> {
    let read = calibrations.iter().map(|f| Ok((f.name.clone(), read_calibration(&f.source)?)));
    let read: Vec<(String, Calibration)> = read.collect::<Result<_, Problem>>()?;
    let files = obsdeg_report::calibration_report(&read, origin, format, folder)?;
    Ok((files, read.into_iter().map(|(_, c)| c).collect()))
}

/// Origin of a review: a command that gives the same answer, and the digest of every file.
pub fn origin<'a>(command: String, sources: impl Iterator<Item = &'a Source>) -> Origin {
    Origin { command, inputs: sources.map(digest).collect(), certificates: Vec::new() }
}

/// Line `sha256 of scheme.toml: ...` with the digest in hexadecimal digits.
fn digest(source: &Source) -> String {
    let hex: String = Sha256::digest(source.text.as_bytes()).iter().map(|b| format!("{b:02x}")).collect();
    format!("sha256 of {}: {hex}", source.name)
}

fn wrong_calibration(source: &Source, found: &str) -> Problem {
    let expected = "expected what `obsdeg calibrate -o` wrote of a scheme of this review";
    Problem::input(format!("{}: {found}; {expected}", source.name))
}

/// Reads the calibration of a scheme.
fn read_calibration(source: &Source) -> Result<Calibration, Problem> {
    let of_model = source.text.contains("\"obsdeg.system-calibration/");
    let read: Result<Calibration, _> = serde_json::from_str(&source.text);
    let found = read.map_err(|e| match of_model {
        true => wrong_calibration(source, "the calibration of a model"),
        false if !source.text.trim_start().starts_with('{') => wrong_calibration(source, "no JSON"),
        false => wrong_calibration(source, &format!("no calibration, or one of another version ({e})")),
    })?;
    if found.schema != LAYOUT {
        return Err(wrong_calibration(
            source,
            &format!("a calibration of another version ({})", found.schema),
        ));
    }
    match found.covariance.is_square() {
        true => Ok(found),
        false => Err(wrong_calibration(source, "a covariance that is not one of its coefficients")),
    }
}

/// Reads a calibration; returns it with the index of its scheme among `entries`.
fn calibration(source: &Source, entries: &[Entry]) -> Result<(Calibration, usize), Problem> {
    let wrong = |found: &str| wrong_calibration(source, found);
    let found = read_calibration(source)?;
    let differences = entries.iter().map(|e| (&e.name, Setup::of(&e.scheme).differences(&found.setup)));
    let nearest = differences.enumerate().min_by_key(|(_, (_, d))| d.len());
    match nearest {
        None => Err(wrong("no scheme is reviewed that it could be of")),
        Some((of, (_, d))) if d.is_empty() => Ok((found, of)),
        Some((_, (name, d))) => {
            Err(wrong(&format!("the calibration of another scheme than {name} ({})", d.join("; "))))
        }
    }
}
