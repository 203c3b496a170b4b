//! `obsdeg analyze`: the degree tables of schemes and models.

use std::path::{Path, PathBuf};

use clap::{ArgAction, Args};
use obsdeg_core::analysis::{Analysis, AnalysisOptions, analyze};
use obsdeg_core::solution::Frame;
use obsdeg_core::system::{COUNT_LIMIT, SystemAnalysis, SystemOptions, analyze_system};
use obsdeg_report::{Answer, Document, Several, position_figure};
use serde::Serialize;

use crate::arguments::{ANY, Given, InputArguments, Word, one_of, whole};
use crate::engine::{EngineArguments, notice};
use crate::failure::Failure;
use crate::input::{Input, title};
use crate::interrupt;
use crate::output::{Output, write_files};

const AFTER_HELP: &str = "\
Examples:
  obsdeg analyze --angles 0,0,0 --angles 180,0,0        the paper's two positions
  obsdeg analyze --angles NUE --angles NDW              the same by direction letters
  obsdeg analyze --angles alpha,0,gamma                 any alpha, any gamma, with degenerate angles
  obsdeg analyze --angles -90,0,0 --latitude 28.2 --carry inertial
  obsdeg analyze --angles 0,0,0 --terms drift           eps^n of a single position
  obsdeg analyze --angles 0,0,0 --combination \"D_FZ - wN*psi_y\"
  obsdeg analyze scheme.toml -o verdicts.json           JSON by the ending; .csv, .md, .tex as well
  obsdeg analyze model.toml                             any system x' = f(x, u, p, t), z = h
  obsdeg analyze examples/*/scheme.toml -o all.csv      several, one after another
  obsdeg analyze --angles NUE --angles NDW --figures pictures

Units: angles and latitude in deg; psi in rad and D in rad/s, rad/s/g inside the formulas, with wN, wU in rad/s and Z in g.

Exit codes: 0 done, 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// Seed of all random choices
    #[arg(long, default_value_t = 1, value_parser = whole::<u64>(ANY))]
    seed: u64,

    #[command(flatten)]
    input: InputArguments,

    /// The highest order of derivatives to look at in a model that has no proven end
    #[arg(long, value_name = "K", help_heading = "Models", value_parser = whole::<u16>(0..=1000))]
    order: Option<u16>,

    /// Limit of the work of counting the solutions of a model: millions of products at each of two points (30 ms each) [default: 3]
    #[arg(long, value_name = "MILLIONS", help_heading = "Models", value_parser = whole::<u64>(ANY))]
    count_limit: Option<u64>,

    /// Solving expressions and numbers of solutions
    #[arg(long, value_name = "ON|OFF", help_heading = "Solutions", default_value = "on", action = ArgAction::Set, value_parser = one_of(SOLUTIONS))]
    solutions: bool,

    /// Axes of Z in solutions
    #[arg(long, value_name = "FRAME", help_heading = "Solutions", default_value = "n", value_parser = one_of(FRAMES))]
    frame: Frame,

    /// Print Z and its derivatives, and psi and eps at each position, as formulas
    #[arg(long, help_heading = "Solutions")]
    formulas: bool,

    #[command(flatten)]
    engine: EngineArguments,

    #[command(flatten)]
    output: Output,

    /// Draw the positions of every scheme, with g and the earth rate, as SVG into a folder
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    figures: Option<PathBuf>,
}

/// The words of `--solutions`.
const SOLUTIONS: [Word<bool>; 2] =
    [("on", "all that there are", true), ("off", "none; never starts the symbolic engine", false)];

/// The words of `--frame`.
const FRAMES: [Word<Frame>; 2] = [
    ("n", "North-Up-East, as in the paper", Frame::N),
    ("platform", "those of the platform", Frame::Platform),
];

/// The answer on a scheme or a model.
#[derive(Serialize)]
#[serde(untagged)]
enum Judged {
    Scheme(Box<Analysis>),
    Model(Box<SystemAnalysis>),
}

impl Answer for Judged {
    fn document(&self) -> Document {
        match self {
            Self::Scheme(a) => a.document(),
            Self::Model(a) => a.document(),
        }
    }
}

pub(crate) fn run(a: &Arguments, given: &Given) -> Result<(), Failure> {
    interrupt::ends()?;
    let target = &a.output.target;
    a.output.check()?;
    let mut banner = Vec::new();
    let mut judged = Vec::new();
    let read = a.input.read(given)?;
    let several = read.len() > 1;
    let mut figures = Vec::new();
    for (name, input) in read {
        // what is wrong in a model is drawn in its file
        let of_scheme = several && matches!(input, Input::Scheme(_));
        let (answer, said) = judge(a, &input).map_err(|e| if of_scheme { e.in_file(&name) } else { e })?;
        // the same of every answer that needed the engine
        if banner.is_empty() {
            banner = said;
        }
        if let (Input::Scheme(scheme), Some(_)) = (&input, &a.figures) {
            let mut file = position_figure(scheme);
            if several {
                file.name = format!("{}-{}", title(Path::new(&name)), file.name);
            }
            figures.push(file);
        }
        judged.push((name, answer));
    }
    if let Some(folder) = &a.figures {
        write_files(folder, &figures, target.force)?;
    }
    match judged.len() {
        1 => judged.iter().try_for_each(|(_, one)| a.output.write(one))?,
        _ => a.output.write(&Several(judged))?,
    }
    notice(&banner, target.quiet);
    Ok(())
}

/// The answer on one of them, and what the engine says of itself.
fn judge(a: &Arguments, input: &Input) -> Result<(Judged, Vec<String>), Failure> {
    let (seed, solutions, quiet) = (a.seed, a.solutions, a.output.target.quiet);
    match input {
        Input::Scheme(scheme) => {
            let options = AnalysisOptions { seed, solutions, formulas: a.formulas, frame: a.frame };
            let message = "solving symbolically (--solutions off leaves it out)";
            a.engine.lend(message, quiet, |worker| {
                Ok(Judged::Scheme(Box::new(analyze(scheme, options, worker)?)))
            })
        }
        Input::Model(file) => {
            let options = SystemOptions {
                seed,
                solutions,
                count_limit: a.count_limit.unwrap_or(COUNT_LIMIT),
                order: a.order.map(Into::into),
            };
            a.engine.lend("judging the model", quiet, |worker| {
                let found = analyze_system(&file.model, options, worker).map_err(|e| file.wrong(&e))?;
                Ok(Judged::Model(Box::new(found)))
            })
        }
    }
}
