//! `obsdeg allan`: the noise of sensors from a static record.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::{Arg, Args};
use obsdeg_commands::{Allan, Host, allan, allan_files};

use crate::failure::Failure;
use crate::input::open_record;
use crate::interrupt;
use crate::output::{Output, to_a_folder};
use crate::progress::Bar;

const AFTER_HELP: &str = "\
Examples:
  obsdeg allan night.csv
  obsdeg allan night.parquet --column wx --column wy -o noise
  gzip -dc night.csv.gz | obsdeg allan - --format json

A record of sensors at rest, in CSV or Parquet: `t [s]` and columns with a unit, of gyros (deg/h, deg/s, \
mdeg/s, rad/s, mrad/s) or accelerometers (g, mg, ug, m/s^2). Noise coefficients come from a fit to \
overlapping Allan variances with their covariances: angle (velocity) random walk, bias instability, rate \
(acceleration) random walk. A coefficient is resolved if its square is more than three standard deviations, \
as they are without it; else its upper limit is printed. The answer ends with the `[simulation]` table that \
other commands read. With -o it writes allan.json, coefficients.csv, deviations.csv, simulation.toml and \
figures.

Exit codes: 0 done, 1 noise of these kinds does not explain the deviations of a column, 2 bad input, 3 \
internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, mut_args(to_a_folder), mut_args(words))]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Allan,

    /// The record of sensors at rest (CSV or Parquet); - is stdin
    #[arg(value_name = "FILE")]
    record: PathBuf,

    #[command(flatten)]
    output: Output,
}

/// Help texts of shared options for this command.
fn words(arg: Arg) -> Arg {
    match arg.get_id().as_str() {
        "output" => arg.help("Write coefficients, deviations, the settings and figures to a folder"),
        _ => arg,
    }
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    let interrupted = interrupt::flag()?;
    a.output.check_folder()?;
    let bar = Bar::start(a.output.target.quiet);
    let progress = |now| {
        bar.show(&now);
        !interrupted.load(Ordering::Relaxed)
    };
    let found = allan(&a.asked, open_record(&a.record)?, &Host { worker: None, progress: &progress })?;
    drop(bar);
    a.output.write_folder(&found, "allan.json", || allan_files(&found))?;
    if found.columns.iter().all(|c| c.explained) { Ok(()) } else { Err(Failure::check()) }
}
