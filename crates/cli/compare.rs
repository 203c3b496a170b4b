//! `obsdeg compare`: schemes side by side.

use std::path::Path;

use clap::{Arg, Args};
use obsdeg_evidence::compare::{Entry, compare};

use crate::arguments::{ANY, Assumptions, FileArguments, whole};
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
#[command(after_help = AFTER_HELP, override_usage = "obsdeg compare [OPTIONS] <FILE>...", mut_args(words))]
pub(crate) struct Arguments {
    /// Seed of all random choices
    #[arg(long, default_value_t = 1, value_parser = whole::<u64>(ANY))]
    seed: u64,

    #[command(flatten)]
    files: FileArguments,

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
        "files" => arg.help("Scheme files (TOML); - is stdin"),
        // one is refused, with where it can be judged
        "model" => arg.hide(true),
        "carry" => arg.help("What is carried between positions, for all schemes"),
        "latitude" => arg.help("Latitude in degrees, for all schemes (default: that of the file, or 28.2)"),
        _ => arg,
    }
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    interrupt::ends()?;
    a.output.check()?;
    let mut entries = Vec::new();
    for (path, input) in a.files.read()? {
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
