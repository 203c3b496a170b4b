//! `obsdeg procedure`: the sheet by which a scheme is run on the bench.

use std::path::PathBuf;

use clap::Args;
use obsdeg_commands::{Given, ProcedureRequest, procedure};

use crate::arguments::{Files, RequireMet, one_file, with_latitude};
use crate::failure::Failure;
use crate::input::read;
use crate::interrupt;
use crate::output::{Output, to_a_folder};

const AFTER_HELP: &str = "\
Examples:
  obsdeg procedure scheme.toml -o run
  obsdeg procedure --angles NUE --angles NDW --carry inertial --slew-rate 2 --settle 30
  obsdeg procedure scheme.toml --dialect psins -o run
  obsdeg procedure --rotations table.txt --start 0,0,0 -o run

The steps in order of time: turns with axis, angle and rate, gimbal angles, waits, recordings, what the \
accelerometers should read, and what is known after each position. Uncertainties are predicted from the \
recorded time. With -o it writes procedure.json, procedure.html (to print), controller.csv (or controller.txt), \
scheme.toml with all conditions, record.csv with the header of the record, and positions.svg. Then: \
`obsdeg calibrate run/scheme.toml run/record.csv`, which decides on the limits of [acceptance].

Exit codes: 0 done, 1 the gimbals cannot execute it, or a requirement is missed (with --require-met), 2 bad \
input, 3 internal error, 130 interrupted.";

/// File of the record in the folder of a run, which a logger fills.
const RECORD: &str = "record.csv";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, mut_args(one_file), mut_args(to_a_folder), mut_args(with_latitude))]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: ProcedureRequest,

    #[command(flatten)]
    files: Files,

    /// Rotation table instead of a scheme: rows k, Ux, Uy, Uz, angle, T, T0, T1 in degrees and s, about the
    /// axes right, front, up of the body, which are Z_p, X_p, Y_p
    #[arg(long, value_name = "FILE", help_heading = "Sheet")]
    rotations: Option<PathBuf>,

    #[command(flatten)]
    met: RequireMet,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(mut a: Arguments, given: Given) -> Result<(), Failure> {
    interrupt::ends()?;
    a.output.check_folder()?;
    a.output.target.keeps(RECORD, 2, "the record of a run")?;
    a.asked.input.given = given;
    let rotations = a.rotations.as_deref().map(|path| read(path, "rotation table")).transpose()?;
    let planned = procedure(&a.asked, a.files.read()?, rotations.as_ref())?;
    let requirements = Some(&planned.sheet.requirements);
    a.met.check(requirements)?;
    a.output.write_folder(&planned.sheet, "procedure.json", || planned.files())?;
    a.output.target.drops(&["controller.csv", "controller.txt"], &planned.controller())?;
    if planned.sheet.executable { a.met.decide(requirements) } else { Err(Failure::check()) }
}
