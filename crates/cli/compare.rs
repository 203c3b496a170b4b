//! `obsdeg compare`: schemes side by side.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use obsdeg_core::model::{Carry, Latitude};
use obsdeg_evidence::compare::{Entry, compare};

use crate::arguments::{OutputArguments, read_scheme};
use crate::conditions::MeasurementArguments;
use crate::failure::Failure;
use crate::progress::Spinner;
use crate::simulate::failure;
use crate::{interrupt, output};

const AFTER_HELP: &str = "\
Examples:
  obsdeg compare examples/five-positions/scheme.toml examples/six-positions/scheme.toml
  obsdeg compare a.toml b.toml --carry inertial --requirement D=0.05 --format markdown -o review.md

Requirements are those of a scheme file, [requirements], or --requirement.
Exit codes: 0 done (whether requirements are met or not), 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// Scheme files (TOML)
    #[arg(value_name = "FILE", required = true)]
    schemes: Vec<PathBuf>,

    /// What is carried between positions, for all schemes: platform, inertial or reset
    #[arg(long, value_name = "CARRY")]
    carry: Option<Carry>,

    /// Latitude in degrees, for all schemes (default: that of the file, or 28.2)
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    latitude: Option<Latitude>,

    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    seed: u64,

    #[command(flatten)]
    output: OutputArguments,

    #[command(flatten)]
    measurement: MeasurementArguments,
}

pub(crate) fn run(a: &Arguments) -> Result<ExitCode, Failure> {
    interrupt::ends()?;
    output::check(&a.output)?;
    let mut entries = Vec::with_capacity(a.schemes.len());
    for path in &a.schemes {
        let mut scheme = read_scheme(path)?;
        scheme.carry = a.carry.unwrap_or(scheme.carry);
        scheme.latitude = a.latitude.or(scheme.latitude);
        let conditions = a.measurement.conditions(&scheme);
        entries.push(Entry { name: output::name(path), scheme, conditions });
    }
    a.measurement.concern(entries.iter().map(|e| &e.scheme))?;
    let spinner = Spinner::start("judging schemes", a.output.quiet);
    let compared = compare(&entries, a.seed);
    drop(spinner);
    let comparison = compared.map_err(|(name, e)| failure(e).in_file(&name))?;
    let text = obsdeg_report::comparison(&comparison, a.output.format, output::layout(&a.output))
        .map_err(|e| Failure::internal(e.to_string()))?;
    output::write(&a.output, &text)?;
    Ok(ExitCode::SUCCESS)
}
