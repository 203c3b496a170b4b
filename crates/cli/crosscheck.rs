//! `obsdeg crosscheck`: the exact verdicts against a filter.

use clap::Args;
use obsdeg_core::model::{Carry, Latitude, Scheme};
use obsdeg_evidence::crosscheck::{CrossCheckOptions, FilterChange, crosscheck};
use obsdeg_evidence::system::crosscheck_system;
use obsdeg_report::{ReportError, crosscheck_figures};

use crate::arguments::{ANY, CARRIES, Given, InputArguments, one_file, one_of, whole};
use crate::conditions::ConditionArguments;
use crate::failure::Failure;
use crate::input::Input;
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

Evidence: a. degrees, ranks, null space, combinations and partners by samples of a model of its own in many digits, and log-log \
slopes of sigma against the dwell, b. prior inflation and null vectors, c. covariance against inverse information, and the model \
against equations of direction cosines, d. Monte Carlo consistency, e. rank correlation of orders, f. filters that are wrong on \
purpose. What is not resolvable, by a test that is stated, neither agrees nor disagrees. With -o it writes evidence.json and its \
figures as SVG and PNG.

Exit codes: 0 nothing disagrees, 1 something disagrees, 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, mut_args(one_file), mut_args(to_a_folder))]
pub(crate) struct Arguments {
    /// Seed of all random choices; the result does not depend on the number of threads
    #[arg(long, default_value_t = 1, value_parser = whole::<u64>(ANY))]
    seed: u64,

    #[command(flatten)]
    input: InputArguments,

    #[command(flatten)]
    conditions: ConditionArguments,

    /// Monte Carlo runs
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = whole::<u32>(2..=10_000_000))]
    runs: u32,

    /// Make the filter wrong: another carry
    #[arg(long, value_name = "CARRY", help_heading = "Controls", value_parser = one_of(CARRIES))]
    filter_carry: Option<Carry>,

    /// Make the filter wrong: another latitude in degrees
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, help_heading = "Controls")]
    filter_latitude: Option<Latitude>,

    /// Make the filter wrong: it does not know of this position
    #[arg(long, value_name = "POSITION", help_heading = "Controls")]
    filter_drop: Option<String>,

    #[command(flatten)]
    output: Output,
}

pub(crate) fn run(a: &Arguments, given: &Given) -> Result<(), Failure> {
    interrupt::ends()?;
    a.output.check_folder()?;
    let passed = match a.input.read_one(given)? {
        Input::Scheme(scheme) => {
            a.conditions.concern(std::iter::once(&*scheme))?;
            let conditions = a.conditions.conditions(&scheme);
            let dropped = a.filter_drop.as_ref().map(|name| position(&scheme, name)).transpose()?;
            let filter = FilterChange { carry: a.filter_carry, latitude: a.filter_latitude, dropped };
            let options = CrossCheckOptions { runs: a.runs as usize, seed: a.seed, filter };
            let bar = Bar::start(u64::from(a.runs), "Monte Carlo", a.output.target.quiet);
            let checked = crosscheck(&scheme, &conditions, &options, &|done| {
                bar.at(done as u64);
                true
            });
            drop(bar);
            let evidence = checked?;
            let figures = || crosscheck_figures(&evidence).map_err(ReportError::from);
            a.output.write_folder(&evidence, "evidence.json", figures)?;
            evidence.passed
        }
        Input::Model(file) => {
            let evidence = crosscheck_system(&file.model, a.seed).map_err(|e| file.wrong_run(&e))?;
            let none = || Ok::<_, ReportError>(vec![]);
            a.output.write_folder(&evidence, "evidence.json", none)?;
            evidence.passed
        }
    };
    if passed { Ok(()) } else { Err(Failure::check()) }
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
