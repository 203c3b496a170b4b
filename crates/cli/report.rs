//! `obsdeg report`: the design review of schemes and models, as one file.

use std::path::{Path, PathBuf};

use clap::{Arg, Args};
use obsdeg_calibration::{Calibration, Setup};
use obsdeg_core::system::SystemModel;
use obsdeg_design::review::{ReviewError, ReviewOptions, review};
use obsdeg_evidence::compare::Entry;
use obsdeg_report::{ReportError, ReviewFormat, picture_folder};

use crate::arguments::{ANY, Assumptions, FileArguments, Given, Word, one_of, whole};
use crate::conditions::ConditionArguments;
use crate::engine::{EngineArguments, notice};
use crate::failure::Failure;
use crate::input::{Input, ModelFile, Source, title};
use crate::interrupt;
use crate::origin::origin;
use crate::output::Target;
use crate::progress::Bar;

const AFTER_HELP: &str = "\
Examples:
  obsdeg report examples/paper-p1-p2/scheme.toml -o review.html
  obsdeg report a.toml b.toml --carry inertial --requirement D=0.05 -o review.html
  obsdeg report scheme.toml -o review.pdf                (with the cargo feature `pdf`)
  obsdeg report examples/two-compartment/model.toml -o review.md
  obsdeg report scheme.toml --calibration calibration -o review.html

The format follows the ending of the file, or --format. HTML and PDF are one file; Markdown and LaTeX have their pictures in a \
folder of their own beside it, review_figures for review.md. The same command writes the same bytes.

Exit codes: 0 done, 2 bad input, 3 internal error, 130 interrupted.";

/// The words of `--format`.
const FORMATS: [Word<ReviewFormat>; 4] = [
    ("html", "one self-contained page", ReviewFormat::Html),
    ("pdf", "one file (cargo feature `pdf`)", ReviewFormat::Pdf),
    ("markdown", "with its pictures in a folder beside it", ReviewFormat::Markdown),
    ("latex", "with its pictures in a folder beside it", ReviewFormat::Latex),
];

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, override_usage = "obsdeg report [OPTIONS] <FILE>... -o <FILE>", mut_args(words))]
pub(crate) struct Arguments {
    /// Seed of all random choices
    #[arg(long, default_value_t = 1, value_parser = whole::<u64>(ANY))]
    seed: u64,

    #[command(flatten)]
    files: FileArguments,

    /// The format (default: by the ending of the file)
    #[arg(long, value_name = "FORMAT", help_heading = "Output", value_parser = one_of(FORMATS))]
    format: Option<ReviewFormat>,

    #[command(flatten)]
    target: Target,

    #[command(flatten)]
    assumptions: Assumptions,

    /// What `obsdeg calibrate -o` wrote of a run: its folder, or calibration.json; may be given several times
    #[arg(long, value_name = "FOLDER")]
    calibration: Vec<PathBuf>,

    /// Monte Carlo runs of the evidence
    #[arg(long = "runs", value_name = "N", default_value_t = 100, value_parser = whole::<u32>(2..=10_000_000))]
    monte_carlo: u32,

    #[command(flatten)]
    engine: EngineArguments,

    #[command(flatten)]
    conditions: ConditionArguments,
}

/// What shared options say here.
fn words(arg: Arg) -> Arg {
    match arg.get_id().as_str() {
        "output" => arg.required(true).help("The file to be written"),
        "force" => arg.help("Replace existing files"),
        "carry" => arg.help("What is carried between positions, for all schemes"),
        "latitude" => arg.help(
            "Latitude in degrees, for all schemes (default: that of the file; 28.2 where numbers need one)",
        ),
        _ => arg,
    }
}

pub(crate) fn run(a: &Arguments, given: &Given) -> Result<(), Failure> {
    interrupt::ends()?;
    let path = a.target.path().unwrap_or(Path::new("-"));
    let format = format(a.format, path)?;
    let folder = picture_folder(&path.file_stem().unwrap_or_default().to_string_lossy());
    a.target.check()?;
    if matches!(format, ReviewFormat::Markdown | ReviewFormat::Latex) {
        a.target.check_beside(&folder)?;
    }
    let mut entries: Vec<Entry> = Vec::new();
    let mut files: Vec<ModelFile> = Vec::new();
    let read = a.files.read()?;
    given.concern(&read)?;
    for (path, input) in read {
        match input {
            Input::Model(file) => files.push(*file),
            Input::Scheme(mut scheme) => {
                let title = title(Path::new(&path));
                a.assumptions.apply(&mut scheme);
                let conditions = a.conditions.conditions(&scheme);
                let name = if scheme.name.is_empty() { title } else { scheme.name.clone() };
                entries.push(Entry { name, scheme: *scheme, conditions });
            }
        }
    }
    let calibration = |path: &PathBuf| calibration(path, &entries);
    let calibrations = a.calibration.iter().map(calibration).collect::<Result<Vec<_>, _>>()?;
    if !entries.is_empty() {
        a.conditions.concern(entries.iter().map(|e| &e.scheme))?;
    }
    let models: Vec<SystemModel> = files.iter().map(|f| f.model.clone()).collect();
    let mut worker = a.engine.worker(a.target.quiet)?;
    let bar = Bar::start(1000, "", a.target.quiet);
    let options = ReviewOptions { runs: a.monte_carlo as usize, seed: a.seed };
    let reviewed = review(&entries, &models, options, worker.as_mut(), &|what, share| {
        bar.says(what);
        bar.at((share * 900.0) as u64);
        true
    });
    let reviewed = reviewed.map_err(|e| match e {
        ReviewError::Simulation { name, error } => Failure::from(error).in_file(&name),
        ReviewError::Model { model, error } => files[model].wrong(&error),
        e @ (ReviewError::Analysis { .. } | ReviewError::Interrupted) => Failure::input(e.to_string()),
    })?;
    let calibrated: Vec<PathBuf> = a.calibration.iter().map(|path| calibration_file(path)).collect();
    let origin = origin(a.files.paths().chain(&calibrated))?;
    bar.says("writing");
    let written = obsdeg_report::review(&reviewed, &calibrations, &origin, format, &folder)?;
    written.split_first().map_or(Ok(()), |(text, pictures)| a.target.write(&text.bytes, pictures))?;
    notice(worker.as_ref().map_or(&[], |w| w.banner()), a.target.quiet);
    Ok(())
}

/// Where a calibration is.
fn calibration_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("calibration.json") } else { path.to_path_buf() }
}

/// A calibration of one of the schemes, and what it is called: its folder.
fn calibration(path: &Path, entries: &[Entry]) -> Result<(String, Calibration), Failure> {
    let file = calibration_file(path);
    let source = Source::read(&file, "calibration")?;
    let wrong = |found: &str| {
        let expected = "expected what `obsdeg calibrate -o` wrote of a scheme of this review";
        Failure::input(format!("{}: {found}; {expected}", file.display()))
    };
    let of_model = source.text().contains("\"obsdeg.system-calibration/");
    let found: Calibration = serde_json::from_str(source.text()).map_err(|e| match of_model {
        true => wrong("the calibration of a model"),
        false => wrong(&e.to_string()),
    })?;
    let differences = entries.iter().map(|e| (&e.name, Setup::of(&e.scheme).differences(&found.setup)));
    let nearest = differences.min_by_key(|(_, d)| d.len());
    match nearest {
        None => return Err(wrong("no scheme is reviewed that it could be of")),
        Some((_, d)) if d.is_empty() => {}
        Some((name, d)) => {
            return Err(wrong(&format!("the calibration of another scheme than {name} ({})", d.join("; "))));
        }
    }
    let named = if path.is_dir() { Some(path) } else { path.parent() };
    let name = named.and_then(Path::file_name).map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    Ok((name, found))
}

/// The format that is asked for, or that of the file's ending.
fn format(asked: Option<ReviewFormat>, path: &Path) -> Result<ReviewFormat, Failure> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let by_ending = match ending.as_deref() {
        Some("html" | "htm") => Some(ReviewFormat::Html),
        Some("pdf") => Some(ReviewFormat::Pdf),
        Some("md") => Some(ReviewFormat::Markdown),
        Some("tex") => Some(ReviewFormat::Latex),
        _ => None,
    };
    let format = asked.or(by_ending).ok_or_else(|| {
        Failure::input(format!(
            "no format for {}; expected a file that ends in .html, .pdf, .md or .tex, or --format",
            path.display()
        ))
    })?;
    if format == ReviewFormat::Pdf && !obsdeg_report::HAS_PDF {
        return Err(ReportError::NoPdf.into());
    }
    Ok(format)
}
