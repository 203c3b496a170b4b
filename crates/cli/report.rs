//! `obsdeg report`: the design review of schemes and models, as one file.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use obsdeg_core::model::{Carry, Latitude};
use obsdeg_core::system::{SystemModel, model_file};
use obsdeg_design::review::{Options, ReviewError, review};
use obsdeg_evidence::compare::Entry;
use obsdeg_report::{ReviewFormat, picture_folder};

use crate::arguments::scheme_of;
use crate::conditions::ConditionArguments;
use crate::engine::{EngineArguments, notice};
use crate::failure::Failure;
use crate::input::read_text;
use crate::model::{ModelFile, is_json};
use crate::progress::Bar;
use crate::simulate::failure;
use crate::{interrupt, output};

const AFTER_HELP: &str = "\
Examples:
  obsdeg report examples/paper-p1-p2/scheme.toml -o review.html
  obsdeg report a.toml b.toml --carry inertial --requirement D=0.05 -o review.html
  obsdeg report scheme.toml -o review.pdf                (with the cargo feature `pdf`)
  obsdeg report examples/two-compartment/model.toml -o review.md

The format follows the ending of the file, or --format. HTML and PDF are one file; Markdown and LaTeX have their
pictures in a folder of their own beside it, review_figures for review.md. The same command writes the same bytes.
Exit codes: 0 done, 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FormatArgument {
    Html,
    Pdf,
    Markdown,
    Latex,
}

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// Scheme files (TOML) and model files (TOML, or JSON)
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,

    /// html, pdf, markdown or latex (default: by the ending of the file)
    #[arg(long, value_name = "FORMAT", hide_possible_values = true)]
    format: Option<FormatArgument>,

    /// The file to be written
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Replace existing files
    #[arg(long)]
    force: bool,

    /// Say nothing on stderr but errors
    #[arg(short, long)]
    quiet: bool,

    /// What is carried between positions, for all schemes: platform, inertial or reset
    #[arg(long, value_name = "CARRY")]
    carry: Option<Carry>,

    /// Latitude in degrees, for all schemes (default: that of the file; 28.2 where numbers need one)
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    latitude: Option<Latitude>,

    /// Monte Carlo runs of the evidence
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(2..=10_000_000))]
    runs: u32,

    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    seed: u64,

    #[command(flatten)]
    engine: EngineArguments,

    #[command(flatten)]
    conditions: ConditionArguments,
}

pub(crate) fn run(a: &Arguments) -> Result<ExitCode, Failure> {
    interrupt::ends()?;
    let format = format(a)?;
    let pictures = matches!(format, ReviewFormat::Markdown | ReviewFormat::Latex);
    let parent = a.output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = picture_folder(&a.output.file_stem().unwrap_or_default().to_string_lossy());
    output::check_file(&a.output, a.force)?;
    if pictures {
        output::check_emptiness(&parent.join(&folder), a.force)?;
    }
    let mut entries: Vec<Entry> = Vec::new();
    let mut files: Vec<ModelFile> = Vec::new();
    for path in &a.files {
        let text = read_text(path, "scheme or model")?;
        if is_json(path) || model_file::is_model(&text) {
            files.push(ModelFile::of(path, text)?);
            continue;
        }
        let mut scheme = scheme_of(path, &text)?;
        scheme.carry = a.carry.unwrap_or(scheme.carry);
        scheme.latitude = a.latitude.or(scheme.latitude);
        let conditions = a.conditions.conditions(&scheme);
        let name = if scheme.name.is_empty() { output::name(path) } else { scheme.name.clone() };
        entries.push(Entry { name, scheme, conditions });
    }
    if !entries.is_empty() {
        a.conditions.concern(entries.iter().map(|e| &e.scheme))?;
    }
    let models: Vec<SystemModel> = files.iter().map(|f| f.model.clone()).collect();
    let mut worker = a.engine.worker(a.quiet)?;
    let bar = Bar::start(1000, "", a.quiet);
    let options = Options { runs: a.runs as usize, seed: a.seed };
    let reviewed = review(&entries, &models, options, worker.as_mut(), &|what, share| {
        bar.says(what);
        bar.at((share * 900.0) as u64);
        true
    });
    let reviewed = reviewed.map_err(|e| match e {
        ReviewError::Simulation { name, error } => failure(error).in_file(&name),
        ReviewError::Model { model, error } => files[model].wrong(&error),
        e @ (ReviewError::Analysis { .. } | ReviewError::Interrupted) => Failure::input(e.to_string()),
    })?;
    bar.says("writing");
    let written = obsdeg_report::review(&reviewed, format, &folder).map_err(|e| match e {
        obsdeg_report::ReportError::NoPdf => Failure::input(e.to_string()),
        e => Failure::internal(e.to_string()),
    })?;
    notice(worker.as_ref(), a.quiet);
    output::write_review(&a.output, parent, &written)?;
    Ok(ExitCode::SUCCESS)
}

fn format(a: &Arguments) -> Result<ReviewFormat, Failure> {
    let ending = a.output.extension().map(|e| e.to_string_lossy().to_lowercase());
    let format = match (a.format, ending.as_deref()) {
        (Some(FormatArgument::Html), _) | (None, Some("html" | "htm")) => ReviewFormat::Html,
        (Some(FormatArgument::Pdf), _) | (None, Some("pdf")) => ReviewFormat::Pdf,
        (Some(FormatArgument::Markdown), _) | (None, Some("md")) => ReviewFormat::Markdown,
        (Some(FormatArgument::Latex), _) | (None, Some("tex")) => ReviewFormat::Latex,
        (None, _) => {
            return Err(Failure::input(format!(
                "no format for {}; expected a file that ends in .html, .pdf, .md or .tex, or --format",
                a.output.display()
            )));
        }
    };
    if format == ReviewFormat::Pdf && !obsdeg_report::HAS_PDF {
        return Err(Failure::input(obsdeg_report::ReportError::NoPdf.to_string()));
    }
    Ok(format)
}
