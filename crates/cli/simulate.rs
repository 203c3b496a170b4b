//! `obsdeg simulate`: one run of the filter against a simulated truth.

use clap::Args;
use obsdeg_commands::{Given, Simulate, simulate, simulation_files};

use crate::arguments::{Files, RequireMet, one_file, with_latitude};
use crate::failure::Failure;
use crate::interrupt;
use crate::output::{Output, to_a_folder};

const AFTER_HELP: &str = "\
Examples:
  obsdeg simulate --angles 0,0,0 --angles 180,0,0
  obsdeg simulate --angles 0,0,0 --angles 180,0,0 --truth exact --carry inertial --drift-scale 0.001
  obsdeg simulate scheme.toml --slew-rate 1 --carry inertial -o run
  obsdeg simulate examples/lotka-volterra/model.toml -o run

What nothing states is that of the paper's run, which the answer says: psi(0) 0.1 deg each, D_F 11, 12, 13 \
deg/h, D_I D_O D_S 5 deg/h/g, random drift 0.01 deg/h, noise 1e-5 g, steps of 10 s, 1000 s a position, 28.2 \
deg North. Requirements are judged by the predicted sigmas, with the random drift and the priors that are \
stated; the run is an example, its sigmas stand beside them. With -o it writes summary.json, series.csv, \
series.parquet and, as SVG and PNG, two figures per unknown (estimate, .error), all in one, and those of the \
paper; with a bench budget.csv too.

Exit codes: 0 done, 1 a requirement is missed (with --require-met), 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, mut_args(one_file), mut_args(to_a_folder), mut_args(with_latitude))]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Simulate,

    #[command(flatten)]
    files: Files,

    #[command(flatten)]
    met: RequireMet,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(mut a: Arguments, given: Given) -> Result<(), Failure> {
    interrupt::ends()?;
    a.output.check_folder()?;
    a.asked.input.given = given;
    let input = a.asked.input.read_one(a.files.read()?)?;
    let (run, traces) = simulate(&a.asked, &input)?;
    a.met.check(run.requirements())?;
    a.output.write_folder(&run, "summary.json", || simulation_files(&run, &traces, true))?;
    a.met.decide(run.requirements())
}
