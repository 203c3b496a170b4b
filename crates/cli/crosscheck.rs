//! `obsdeg crosscheck`: the exact verdicts against a filter.

use clap::Args;
use obsdeg_commands::{Crosscheck, Given, Host, crosscheck, crosscheck_files};

use crate::arguments::{Files, one_file, with_latitude};
use crate::failure::Failure;
use crate::interrupt;
use crate::output::{Output, to_a_folder};
use crate::progress::Bar;

const AFTER_HELP: &str = "\
Examples:
  obsdeg crosscheck --angles 0,0,0 --angles 180,0,0
  obsdeg crosscheck scheme.toml --runs 1000 -o evidence
  obsdeg crosscheck --angles 0,0,0 --angles 180,0,0 --filter-carry inertial     (must disagree)
  obsdeg crosscheck --angles 0,0,0 --angles 180,0,0 --truth exact     (at the scheme's own drifts)
  obsdeg crosscheck examples/lotka-volterra/model.toml

Evidence: a. degrees, ranks, null space, combinations and partners by samples of a model of its own in many \
digits, and log-log slopes of sigma against the dwell, b. prior inflation and null vectors, c. covariance \
against inverse information, and the model against equations of direction cosines, d. Monte Carlo \
consistency, e. rank correlation of orders, f. filters that are wrong on purpose. What is not resolvable, by \
a test that is stated, neither agrees nor disagrees. With -o it writes evidence.json and its figures as SVG \
and PNG.

Exit codes: 0 nothing disagrees, 1 something disagrees, 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, mut_args(one_file), mut_args(to_a_folder), mut_args(with_latitude))]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Crosscheck,

    #[command(flatten)]
    files: Files,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(mut a: Arguments, given: Given) -> Result<(), Failure> {
    interrupt::ends()?;
    a.output.check_folder()?;
    a.asked.input.given = given;
    let input = a.asked.input.read_one(a.files.read()?)?;
    let bar = Bar::start(a.output.target.quiet);
    let progress = |now| {
        bar.show(&now);
        true
    };
    let evidence = crosscheck(&a.asked, &input, &Host { worker: None, progress: &progress });
    drop(bar);
    let evidence = evidence?;
    a.output.write_folder(&evidence, "evidence.json", || crosscheck_files(&evidence))?;
    if evidence.passed() { Ok(()) } else { Err(Failure::check()) }
}
