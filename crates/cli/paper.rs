//! `obsdeg paper`: the paper against the algebra.

use clap::Args;
use obsdeg_commands::{Paper, paper};

use crate::failure::Failure;
use crate::interrupt;
use crate::output::Output;

const AFTER_HELP: &str = "\
Examples:
  obsdeg paper
  obsdeg paper --format json --seed 7

Equations (1) to (28) are compared with the model at random points of prime fields, claims about degrees are \
judged by the engine, those of section 3.3 by the filter under the conditions of section 3.1. Each line says \
agree, with a condition, disagree, or not covered, and why.

The paper: Ding, Cai, Huang, J. NUDT 39(1), 2017, 1001-2486(2017)01-040-06.
Exit codes: 0 done (whatever the findings), 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Paper,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    interrupt::ends()?;
    a.output.check()?;
    a.output.write(&paper(&a.asked)?)
}
