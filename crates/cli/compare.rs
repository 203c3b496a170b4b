//! `obsdeg compare`: schemes side by side.

use clap::{Arg, Args};
use obsdeg_commands::{Compare, Source, compare};

use crate::arguments::{AllFiles, RequireMet};
use crate::failure::Failure;
use crate::interrupt;
use crate::output::Output;
use crate::progress::Spinner;

const AFTER_HELP: &str = "\
Examples:
  obsdeg compare examples/five-positions/scheme.toml examples/six-positions/scheme.toml
  obsdeg compare a.toml b.toml --carry inertial --requirement D=0.05 --format markdown -o review.md

Requirements are those of a scheme file, [requirements], or --requirement; without, none is judged. \
Predicted sigmas are those at the end of the scheme, with the random drift and the priors that are stated. \
Gyro noise adds the noise floor of every coefficient.

Exit codes: 0 done, 1 a requirement is missed (with --require-met), 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, override_usage = "obsdeg compare [OPTIONS] <FILE>...", mut_args(words))]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Compare,

    #[command(flatten)]
    files: AllFiles,

    #[command(flatten)]
    met: RequireMet,

    #[command(flatten)]
    output: Output,

    /// The table has its details too: every unknown with its excitation, every position and condition, the
    /// errors that are not estimated, and what is assumed; other formats always have them
    #[arg(long, help_heading = "Output")]
    details: bool,
}

/// Help of shared options for `compare`.
fn words(arg: Arg) -> Arg {
    match arg.get_id().as_str() {
        "files" => arg.help("Scheme files (TOML); - is stdin"),
        // `--model` is refused; the message names the command that judges models
        "model" => arg.hide(true),
        "carry" => arg.help("Quantity that continues from one position to the next, for all schemes"),
        "latitude" => arg.help("Latitude in degrees, for all schemes (default: that of the file, or 28.2)"),
        _ => arg,
    }
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    interrupt::ends()?;
    a.output.check()?;
    let read = a.files.read()?.into_iter().map(Source::read).collect::<Result<_, _>>()?;
    let spinner = Spinner::start("judging schemes", a.output.target.quiet);
    let comparison = compare(&a.asked, read);
    drop(spinner);
    let comparison = comparison?;
    let requirements = || comparison.schemes.iter().map(|s| &s.requirements);
    a.met.check(requirements())?;
    a.output.write_all(&comparison, a.details)?;
    a.met.decide(requirements())
}
