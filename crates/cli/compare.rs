//! `obsdeg compare`: schemes side by side.

use std::path::{Path, PathBuf};

use clap::{Arg, Args};
use obsdeg_evidence::compare::{Entry, compare};

use crate::arguments::{Assumptions, read_all};
use crate::conditions::{GyroNoiseArguments, MeasurementArguments};
use crate::failure::Failure;
use crate::input::{Input, title};
use crate::interrupt;
use crate::output::Output;
use crate::progress::Spinner;

const AFTER_HELP: &str = "\
Examples:
  obsdeg compare examples/five-positions/scheme.toml examples/six-positions/scheme.toml
  obsdeg compare a.toml b.toml --carry inertial --requirement D=0.05 --format markdown -o review.md

Requirements are those of a scheme file, [requirements], or --requirement. Gyro noise adds the noise floor of every coefficient: \
predicted sigmas are without drift noise.

Exit codes: 0 done (whether requirements are met or not), 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, mut_args(words))]
pub(crate) struct Arguments {
    /// Seed of all random choices
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Scheme files (TOML); - is stdin
    #[arg(value_name = "FILE", required = true)]
    schemes: Vec<PathBuf>,

    #[command(flatten)]
    assumptions: Assumptions,

    #[command(flatten)]
    output: Output,

    #[command(flatten)]
    measurement: MeasurementArguments,

    #[command(flatten)]
    gyro_noise: GyroNoiseArguments,
}

/// What shared options say here.
fn words(arg: Arg) -> Arg {
    match arg.get_id().as_str() {
        "carry" => arg.help("What is carried between positions, for all schemes"),
        "latitude" => arg.help("Latitude in degrees, for all schemes (default: that of the file, or 28.2)"),
        _ => arg,
    }
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    interrupt::ends()?;
    a.output.check()?;
    let mut entries = Vec::with_capacity(a.schemes.len());
    for (path, input) in read_all(&a.schemes)? {
        let Input::Scheme(mut scheme) = input else {
            return Err(Failure::input(format!(
                "{path} is a model file; expected scheme files (`obsdeg analyze` and `obsdeg report` judge models side by side)"
            )));
        };
        a.assumptions.apply(&mut scheme);
        let mut conditions = a.measurement.conditions(&scheme);
        conditions.apply(&a.gyro_noise.settings());
        entries.push(Entry { name: title(Path::new(&path)), scheme: *scheme, conditions });
    }
    a.measurement.concern(entries.iter().map(|e| &e.scheme))?;
    let spinner = Spinner::start("judging schemes", a.output.target.quiet);
    let compared = compare(&entries, a.seed);
    drop(spinner);
    let comparison = compared.map_err(|(name, e)| Failure::from(e).in_file(&name))?;
    a.output.write(&comparison)
}
