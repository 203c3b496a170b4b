//! `obsdeg analyze`: the degree table of one scheme.

use clap::{ArgAction, Args};
use obsdeg_core::analysis::{AnalysisOptions, analyze};
use obsdeg_core::solution::Frame;
use obsdeg_core::system::{COUNT_LIMIT, SystemOptions, analyze_system};

use crate::arguments::{InputArguments, one_of};
use crate::engine::EngineArguments;
use crate::failure::Failure;
use crate::input::Input;
use crate::interrupt;
use crate::output::Output;

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

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    input: InputArguments,

    /// The highest order of derivatives to look at in a model that has no proven end
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u16).range(0..=1000))]
    order: Option<u16>,

    /// Limit of the work of counting the solutions of a model: millions of products at each of two points (30 ms each) [default: 3]
    #[arg(long, value_name = "MILLIONS")]
    count_limit: Option<u64>,

    /// Solving expressions and numbers of solutions; off never starts the symbolic engine
    #[arg(long, value_name = "ON|OFF", default_value = "on", hide_possible_values = true, action = ArgAction::Set, value_parser = one_of([("on", true), ("off", false)]))]
    solutions: bool,

    /// Axes of Z in solutions: n (North-Up-East, as in the paper) or platform
    #[arg(long, value_name = "FRAME", default_value = "n", hide_possible_values = true, value_parser = one_of([("n", Frame::N), ("platform", Frame::Platform)]))]
    frame: Frame,

    /// Print Z and its derivatives, and psi and eps at each position, as formulas
    #[arg(long)]
    formulas: bool,

    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    seed: u64,

    #[command(flatten)]
    engine: EngineArguments,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    interrupt::ends()?;
    a.output.target.check()?;
    if a.order.is_some() && a.input.model.is_none() {
        return Err(Failure::input("--order goes with --model: a scheme has a proven end".into()));
    }
    if a.count_limit.is_some() && a.input.model.is_none() {
        return Err(Failure::input(
            "--count-limit goes with --model: a scheme is linear, and its solutions are unique".into(),
        ));
    }
    let (seed, solutions, quiet) = (a.seed, a.solutions, a.output.target.quiet);
    match a.input.read()? {
        Input::Scheme(scheme) => {
            let options = AnalysisOptions { seed, solutions, formulas: a.formulas, frame: a.frame };
            let message = "solving symbolically (--solutions off leaves it out)";
            let analysis = a.engine.lend(message, quiet, |worker| Ok(analyze(&scheme, options, worker)?))?;
            a.output.write(&analysis)
        }
        Input::Model(file) => {
            let options = SystemOptions {
                seed,
                solutions,
                count_limit: a.count_limit.unwrap_or(COUNT_LIMIT),
                order: a.order.map(Into::into),
            };
            let analysis = a.engine.lend("judging the model", quiet, |worker| {
                analyze_system(&file.model, options, worker).map_err(|e| file.wrong(&e))
            })?;
            a.output.write(&analysis)
        }
    }
}
