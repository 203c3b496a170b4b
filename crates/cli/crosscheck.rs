//! `obsdeg crosscheck`: the exact verdicts against a filter.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use obsdeg_core::model::{Carry, Latitude, Scheme};
use obsdeg_evidence::crosscheck::{FilterChange, Options, crosscheck};
use obsdeg_evidence::system::crosscheck_system;
use obsdeg_report::{File, Format, Layout};

use crate::arguments::{FolderArguments, SchemeArguments};
use crate::conditions::ConditionArguments;
use crate::failure::{CHECK, Failure};
use crate::interrupt;
use crate::model::ModelFile;
use crate::output;
use crate::progress::Bar;
use crate::simulate::failure;

const AFTER_HELP: &str = "\
Examples:
  obsdeg crosscheck --angles 0,0,0 --angles 180,0,0
  obsdeg crosscheck --scheme scheme.toml --runs 1000 -o evidence
  obsdeg crosscheck --angles 0,0,0 --angles 180,0,0 --filter-carry inertial     (must disagree)
  obsdeg crosscheck --model examples/lotka-volterra/model.toml

Evidence: a. log-log slope of sigma against the dwell, b. prior inflation and null vectors, c. covariance against
inverse information, d. Monte Carlo consistency, e. rank correlation of orders, f. filters that are wrong on purpose.
With -o it writes evidence.json and its figures as SVG and PNG.
Exit codes: 0 everything agrees, 1 something disagrees, 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    scheme: SchemeArguments,

    /// Any other system: a model file with its table of numbers for a simulation
    #[arg(long, value_name = "FILE", conflicts_with_all = ["angles", "scheme", "carry", "latitude", "terms", "measured_azimuth", "combination", "dwell", "step", "noise", "azimuth_noise", "requirement", "truth", "slew_rate", "drift_noise", "propagation", "value", "prior", "estimate", "drift_scale", "filter_carry", "filter_latitude", "filter_drop", "runs"])]
    model: Option<PathBuf>,

    #[command(flatten)]
    conditions: ConditionArguments,

    /// Monte Carlo runs
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(2..=10_000_000))]
    runs: u32,

    /// Seed of all random choices; the result does not depend on the number of threads
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Make the filter wrong: another carry
    #[arg(long, value_name = "CARRY", help_heading = "Controls")]
    filter_carry: Option<Carry>,

    /// Make the filter wrong: another latitude in degrees
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, help_heading = "Controls")]
    filter_latitude: Option<Latitude>,

    /// Make the filter wrong: it does not know of this position
    #[arg(long, value_name = "POSITION", help_heading = "Controls")]
    filter_drop: Option<String>,

    #[command(flatten)]
    output: FolderArguments,
}

pub(crate) fn run(a: &Arguments) -> Result<ExitCode, Failure> {
    interrupt::ends()?;
    output::check_folder(&a.output)?;
    if let Some(path) = &a.model {
        return system(a, path);
    }
    let scheme = a.scheme.scheme()?;
    a.conditions.concern(std::iter::once(&scheme))?;
    let conditions = a.conditions.conditions(&scheme);
    let dropped = a.filter_drop.as_ref().map(|name| position(&scheme, name)).transpose()?;
    let filter = FilterChange { carry: a.filter_carry, latitude: a.filter_latitude, dropped };
    let options = Options { runs: a.runs as usize, seed: a.seed, filter };
    let bar = Bar::start(u64::from(a.runs), "Monte Carlo", a.output.quiet);
    let checked = crosscheck(&scheme, &conditions, &options, &|done| {
        bar.at(done as u64);
        true
    });
    drop(bar);
    let evidence = checked.map_err(failure)?;
    let internal = |e: obsdeg_report::ReportError| Failure::internal(e.to_string());
    let text = obsdeg_report::crosscheck(&evidence, a.output.format, output::terminal()).map_err(internal)?;
    if a.output.output.is_some() {
        output::write_folder(&a.output, &obsdeg_report::crosscheck_files(&evidence).map_err(internal)?)?;
    }
    output::print(&text)?;
    Ok(if evidence.passed { ExitCode::SUCCESS } else { ExitCode::from(CHECK) })
}

/// A model file.
fn system(a: &Arguments, path: &Path) -> Result<ExitCode, Failure> {
    let file = ModelFile::read(path)?;
    let evidence = crosscheck_system(&file.model, a.seed).map_err(|e| file.wrong_run(&e))?;
    let internal = |e: obsdeg_report::ReportError| Failure::internal(e.to_string());
    let text =
        obsdeg_report::system_evidence(&evidence, a.output.format, output::terminal()).map_err(internal)?;
    if a.output.output.is_some() {
        let json = obsdeg_report::system_evidence(&evidence, Format::Json, Layout::default());
        let file = File { name: "evidence.json".into(), bytes: json.map_err(internal)?.into_bytes() };
        output::write_folder(&a.output, &[file])?;
    }
    output::print(&text)?;
    Ok(if evidence.passed { ExitCode::SUCCESS } else { ExitCode::from(CHECK) })
}

fn position(scheme: &Scheme, name: &str) -> Result<usize, Failure> {
    let names: Vec<&str> = scheme.positions.iter().map(|p| p.name.as_str()).collect();
    let found = names.iter().position(|n| *n == name);
    found.ok_or_else(|| {
        Failure::input(format!(
            "--filter-drop `{name}`: no such position; expected one of {}",
            names.join(", ")
        ))
    })
}
