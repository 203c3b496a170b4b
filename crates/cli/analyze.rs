//! `obsdeg analyze`: the degree table of one scheme.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use obsdeg_core::analysis::{AnalysisError, Options, analyze};
use obsdeg_core::solution::requested::CombinationError;
use obsdeg_core::solution::solver::Frame;
use obsdeg_core::system::analyze_system;

use crate::arguments::{OutputArguments, SchemeArguments};
use crate::engine::{EngineArguments, notice, rest};
use crate::failure::Failure;
use crate::model::ModelFile;
use crate::progress::Spinner;
use crate::{interrupt, output};

const AFTER_HELP: &str = "\
Examples:
  obsdeg analyze --angles 0,0,0 --angles 180,0,0        the paper's two positions
  obsdeg analyze --angles NUE --angles NDW              the same by direction letters
  obsdeg analyze --angles alpha,0,gamma                 any alpha, any gamma, with degenerate angles
  obsdeg analyze --angles -90,0,0 --latitude 28.2 --carry inertial
  obsdeg analyze --angles 0,0,0 --terms drift           eps^n of a single position
  obsdeg analyze --angles 0,0,0 --combination \"D_FZ - wN*psi_y\"
  obsdeg analyze --scheme scheme.toml --format json -o verdicts.json
  obsdeg analyze --model model.toml                     any system x' = f(x, u, p, t), z = h

Units: angles and latitude in deg; psi in rad and D in rad/s, rad/s/g inside the formulas, with wN, wU in
rad/s and Z in g. Exit codes: 0 done, 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Switch {
    On,
    Off,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FrameArgument {
    N,
    Platform,
}

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    scheme: SchemeArguments,

    /// Any other system: a model file (TOML, or JSON)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["angles", "scheme", "carry", "latitude", "terms", "measured_azimuth", "combination", "frame", "formulas"])]
    model: Option<PathBuf>,

    /// The highest order of derivatives to look at in a model that has no proven end
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(0..=1000))]
    order: Option<u16>,

    /// Solving expressions; off never starts the symbolic engine
    #[arg(long, value_name = "ON|OFF", default_value = "on", hide_possible_values = true)]
    solutions: Switch,

    /// Axes of Z in solutions: n (North-Up-East, as in the paper) or platform
    #[arg(long, value_name = "FRAME", default_value = "n", hide_possible_values = true)]
    frame: FrameArgument,

    /// Print Z and its derivatives, and psi and eps at each position, as formulas
    #[arg(long)]
    formulas: bool,

    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    seed: u64,

    #[command(flatten)]
    engine: EngineArguments,

    #[command(flatten)]
    output: OutputArguments,
}

pub(crate) fn run(a: &Arguments) -> Result<ExitCode, Failure> {
    interrupt::ends()?;
    output::check(&a.output)?;
    if let Some(path) = &a.model {
        return system(a, path);
    }
    if a.order.is_some() {
        return Err(Failure::input("--order goes with --model: a scheme has a proven end".into()));
    }
    let scheme = a.scheme.scheme()?;
    let options = Options {
        seed: a.seed,
        solutions: a.solutions == Switch::On,
        formulas: a.formulas,
        frame: if a.frame == FrameArgument::N { Frame::N } else { Frame::Platform },
    };
    let mut worker = a.engine.worker(a.output.quiet)?;
    let spinner = Spinner::start("solving symbolically (--solutions off leaves it out)", a.output.quiet);
    let analysed = analyze(&scheme, options, worker.as_mut());
    drop(spinner);
    rest(worker.as_mut());
    let analysis = analysed.map_err(|e| match e {
        AnalysisError::Combination(CombinationError { text, reason, span }) => {
            Failure::at(&format!("combination: {reason}"), "--combination", &text, span)
        }
        AnalysisError::Scheme(e) => Failure::input(e.to_string()),
        AnalysisError::Verdict(e) => Failure::internal(e.to_string()),
    })?;
    notice(worker.as_ref(), a.output.quiet);
    let text = obsdeg_report::analysis(&analysis, a.output.format, output::layout(&a.output))
        .map_err(|e| Failure::internal(e.to_string()))?;
    output::write(&a.output, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// A model file.
fn system(a: &Arguments, path: &Path) -> Result<ExitCode, Failure> {
    let file = ModelFile::read(path)?;
    let mut worker = a.engine.worker(a.output.quiet)?;
    let spinner = Spinner::start("judging the model", a.output.quiet);
    let engine = (a.solutions == Switch::On).then_some(worker.as_mut());
    let analysed = analyze_system(&file.model, a.seed, a.order.map(Into::into), engine);
    drop(spinner);
    rest(worker.as_mut());
    let analysis = analysed.map_err(|e| file.wrong(&e))?;
    notice(worker.as_ref(), a.output.quiet);
    let text = obsdeg_report::system(&analysis, a.output.format, output::layout(&a.output))
        .map_err(|e| Failure::internal(e.to_string()))?;
    output::write(&a.output, &text)?;
    Ok(ExitCode::SUCCESS)
}
