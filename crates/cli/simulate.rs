//! `obsdeg simulate`: one run of the filter against a simulated truth.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use obsdeg_core::analysis::AnalysisError;
use obsdeg_core::solution::requested::CombinationError;
use obsdeg_evidence::prediction::PredictionError;
use obsdeg_evidence::simulation::{SimulationError, Traces, simulate};
use obsdeg_evidence::system::simulate_system;
use obsdeg_report::{File, Format, Layout, ReportError, series_csv, series_parquet, simulation_figures};

use crate::arguments::{FolderArguments, SchemeArguments};
use crate::conditions::ConditionArguments;
use crate::failure::Failure;
use crate::model::ModelFile;
use crate::progress::Spinner;
use crate::{interrupt, output};

const AFTER_HELP: &str = "\
Examples:
  obsdeg simulate --angles 0,0,0 --angles 180,0,0
  obsdeg simulate --angles 0,0,0 --angles 180,0,0 --truth exact --carry inertial --drift-scale 0.001
  obsdeg simulate --scheme scheme.toml --slew-rate 1 --carry inertial -o run
  obsdeg simulate --model examples/lotka-volterra/model.toml -o run

Left to itself it is the paper's run: psi(0) 0.1 deg each, D_F 11, 12, 13 deg/h, D_I D_O D_S 5 deg/h/g, random
drift 0.01 deg/h, noise 1e-5 g, steps of 10 s, 1000 s a position. With -o it writes summary.json, series.csv,
series.parquet and a figure per unknown as SVG and PNG.
Exit codes: 0 done (whatever the verdict), 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    scheme: SchemeArguments,

    /// Any other system: a model file with its table of numbers for a simulation
    #[arg(long, value_name = "FILE", conflicts_with_all = ["angles", "scheme", "carry", "latitude", "terms", "measured_azimuth", "combination", "dwell", "step", "noise", "azimuth_noise", "requirement", "truth", "slew_rate", "drift_noise", "propagation", "value", "prior", "estimate", "drift_scale"])]
    model: Option<PathBuf>,

    #[command(flatten)]
    conditions: ConditionArguments,

    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
    seed: u64,

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
    let (summary, record) = simulate(&scheme, &conditions, a.seed).map_err(failure)?;
    let text = obsdeg_report::simulation(&summary, a.output.format, output::terminal())
        .map_err(|e| Failure::internal(e.to_string()))?;
    if a.output.output.is_some() {
        let _spinner = Spinner::start("drawing figures", a.output.quiet);
        let json = obsdeg_report::simulation(&summary, Format::Json, Layout::default());
        let files = files(json, &record.traces).map_err(|e| Failure::internal(e.to_string()))?;
        output::write_folder(&a.output, &files)?;
    }
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// A model file.
fn system(a: &Arguments, path: &Path) -> Result<ExitCode, Failure> {
    let file = ModelFile::read(path)?;
    let (run, traces) = simulate_system(&file.model, a.seed).map_err(|e| file.wrong_run(&e))?;
    let text = obsdeg_report::system_run(&run, a.output.format, output::terminal())
        .map_err(|e| Failure::internal(e.to_string()))?;
    if a.output.output.is_some() {
        let _spinner = Spinner::start("drawing figures", a.output.quiet);
        let json = obsdeg_report::system_run(&run, Format::Json, Layout::default());
        let files = files(json, &traces).map_err(|e| Failure::internal(e.to_string()))?;
        output::write_folder(&a.output, &files)?;
    }
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// What goes into the folder.
fn files(json: Result<String, ReportError>, traces: &Traces) -> Result<Vec<File>, ReportError> {
    let mut files = vec![
        File { name: "summary.json".into(), bytes: json?.into_bytes() },
        File { name: "series.csv".into(), bytes: series_csv(traces)?.into_bytes() },
        File { name: "series.parquet".into(), bytes: series_parquet(traces)? },
    ];
    files.extend(simulation_figures(traces)?);
    Ok(files)
}

/// What is wrong with the input, or with the program.
pub(crate) fn failure(e: SimulationError) -> Failure {
    match e {
        SimulationError::Prediction(PredictionError::Analysis(AnalysisError::Combination(
            CombinationError { text, reason, span },
        ))) => Failure::at(&format!("combination: {reason}"), "--combination", &text, span),
        SimulationError::Filter(e) if e.is_numeric() => Failure::input(format!(
            "these numbers cannot be resolved in double precision ({e}); expected priors, noise, steps and rates that are closer together"
        )),
        // too many unknowns, or accuracy orders beyond the series
        SimulationError::Prediction(PredictionError::Analysis(AnalysisError::Scheme(_)))
        | SimulationError::Prediction(PredictionError::Accuracy(_)) => Failure::input(e.to_string()),
        SimulationError::Prediction(_) | SimulationError::Filter(_) => Failure::internal(e.to_string()),
        _ => Failure::input(e.to_string()),
    }
}
