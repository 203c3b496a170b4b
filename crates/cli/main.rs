//! The command line of obsdeg: arguments in, text out, exit codes. One file per command.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is the command line")]

mod allan;
mod analyze;
mod arguments;
mod calibrate;
mod compare;
mod completions;
mod crosscheck;
mod design;
mod engine;
mod failure;
mod files;
mod help;
mod input;
mod interrupt;
mod licences;
#[cfg(feature = "symbolica")]
mod lock;
mod origin;
mod output;
mod paper;
mod print;
mod procedure;
mod progress;
mod report;
mod schema;
mod simulate;
mod terminal;
mod third_party;
mod verify;

use std::process::ExitCode;

use clap::builder::{PossibleValuesParser, ValueParser};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ArgAction, CommandFactory, FromArgMatches, Parser, Subcommand};

use arguments::given;
use failure::{Failure, say};
use obsdeg_commands::Given;
use obsdeg_report::visible;

const AFTER_HELP: &str = "\
Examples:
  obsdeg analyze --angles 0,0,0 --angles 180,0,0
  obsdeg analyze scheme.toml --carry inertial -o verdicts.json
  obsdeg analyze model.toml
  obsdeg simulate --angles 0,0,0 --angles 180,0,0 -o run
  obsdeg crosscheck --angles 0,0,0 --angles 180,0,0
  obsdeg procedure scheme.toml -o run
  obsdeg calibrate scheme.toml record.csv
  obsdeg allan night.csv
  obsdeg compare a.toml b.toml
  obsdeg design --positions 5 --carry inertial
  obsdeg report scheme.toml model.toml -o review.html
  obsdeg paper

Exit codes: 0 done, 1 a check failed, 2 bad input, 3 internal error, 130 interrupted.";

/// Exact observable degrees: which unknowns a scheme determines, and with how many derivatives.
#[derive(Debug, Parser)]
#[command(name = "obsdeg", version, about, after_help = AFTER_HELP, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// The observable degree of every unknown of a scheme or model, and whether it is identifiable
    Analyze(analyze::Arguments),
    /// Run a Kalman filter against a simulated truth: the paper's run, or any scheme
    Simulate(simulate::Arguments),
    /// Hold the exact verdicts against a filter: evidence of several kinds
    Crosscheck(crosscheck::Arguments),
    /// Write the sheet by which a scheme is run: turns, waits, recordings, readings, what is known when
    Procedure(procedure::Arguments),
    /// Estimate what a scheme or model determines from records of its runs
    Calibrate(calibrate::Arguments),
    /// Noise of gyros and accelerometers from a record at rest: Allan deviation and coefficients
    Allan(allan::Arguments),
    /// Judge schemes side by side: verdicts, predicted accuracy, what each position is for
    Compare(compare::Arguments),
    /// Find schemes: the fewest positions, or the best of a number of them
    Design(design::Arguments),
    /// Write the design review of schemes and models: HTML, PDF, Markdown or LaTeX
    Report(report::Arguments),
    /// Recompute the equations and claims of the paper: what agrees, and what does not
    Paper(paper::Arguments),
    /// Check a certificate of `obsdeg analyze` or `obsdeg design`, with code of its own
    Verify(verify::Arguments),
    /// Print what others wrote of this build, and the texts of their licences
    Licences(licences::Arguments),
    /// Print the completion script of a shell
    Completions(completions::Arguments),
    /// Print a manual page, or write all of them to a folder
    Man(completions::ManArguments),
    /// Print a JSON Schema: of results, or of scheme files
    Schema(schema::Arguments),
}

/// The command line with its rules for negative numbers. After an option with a value, a negative number is
/// that value, so that the error can name what is expected. After a numeric option any exponent counts
/// (`-1e-5`); after others only text that cannot be an option.
fn command() -> clap::Command {
    let takes =
        |a: &clap::Arg| !a.is_positional() && matches!(a.get_action(), ArgAction::Set | ArgAction::Append);
    let number = ValueParser::from(clap::value_parser!(f64)).type_id();
    let short = std::env::args_os().any(|a| a == "-h");
    let command = Cli::command().mut_subcommands(move |command| {
        let command = help::in_lines(command, short);
        command.mut_args(|a| match takes(&a) && !a.is_allow_hyphen_values_set() {
            true if a.get_value_parser().type_id() == number => a.allow_hyphen_values(true),
            true => a.allow_negative_numbers(true),
            false => a,
        })
    });
    let pages: Vec<String> = command.get_subcommands().map(|c| c.get_name().to_string()).collect();
    command.mut_subcommand("man", |man| {
        man.mut_arg("command", |a| a.value_parser(PossibleValuesParser::new(pages)))
    })
}

/// Hint for an argument that a command does not know. It names the commands that have such an option, or the
/// command for a file in place of a command.
fn hint(e: &clap::Error) -> Option<String> {
    let is_file =
        |text: &str| std::path::Path::new(text).extension().is_some_and(|x| x == "toml" || x == "json");
    if let (ErrorKind::InvalidSubcommand, Some(ContextValue::String(found))) =
        (e.kind(), e.get(ContextKind::InvalidSubcommand))
    {
        return is_file(found).then(|| format!("a scheme or model is judged by `obsdeg analyze {found}`"));
    }
    let Some(ContextValue::String(found)) = e.get(ContextKind::InvalidArg) else { return None };
    if e.kind() != ErrorKind::UnknownArgument {
        return None;
    }
    let command = command();
    if let Some(option) = found.strip_prefix('-') {
        let has = |c: &&clap::Command| {
            c.get_arguments().any(|a| match option.strip_prefix('-') {
                Some(long) => a.get_long() == Some(long),
                None => a.get_short().is_some_and(|short| option.starts_with(short)),
            })
        };
        let names: Vec<&str> = command.get_subcommands().filter(has).map(clap::Command::get_name).collect();
        let named = names.iter().map(|name| format!("`obsdeg {name}`")).collect::<Vec<_>>().join(", ");
        return (!names.is_empty()).then(|| format!("{found} is an option of {named}"));
    }
    None
}

/// The parsed arguments, and the options that concern one kind of file only. Errors are printed without
/// control characters of the arguments.
fn arguments() -> Result<(Cli, Given), ExitCode> {
    let command = command();
    let parsed = command.clone().try_get_matches().and_then(|matches| {
        let of = matches.subcommand().and_then(|(name, of)| Some((command.find_subcommand(name)?, of)));
        let given = of.map(|(command, of)| given(command, of)).unwrap_or_default();
        Ok((Cli::from_arg_matches(&matches)?, given))
    });
    parsed.map_err(|mut e| {
        if let Some(hint) = hint(&e) {
            e.remove(ContextKind::SuggestedArg);
            e.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![hint.into()]));
        } else if e.kind() == ErrorKind::UnknownArgument {
            // drops clap's suggestion to pass the option as a file name
            e.remove(ContextKind::Suggested);
        }
        let message = e.render().to_string();
        let text = message.lines().all(|line| visible(line) == line);
        if !e.use_stderr() || text && (message.is_ascii() || !terminal::plain_messages()) {
            // coloured where the terminal has colours; a failure to print has no reader
            let _ = e.print();
        } else {
            say(&message);
        }
        ExitCode::from(if e.use_stderr() { failure::INPUT } else { 0 })
    })
}

fn run() -> Result<(), ExitCode> {
    // the program starts itself in this mode, for symbolic jobs on stdin and stdout
    if std::env::args_os().nth(1).is_some_and(|a| a == "symbolic-worker") {
        return symbolic_worker().map_err(|failure| failure.report());
    }
    let (cli, given) = arguments()?;
    let done = match cli.command {
        Command::Analyze(a) => analyze::run(a, given),
        Command::Simulate(a) => simulate::run(a, given),
        Command::Crosscheck(a) => crosscheck::run(a, given),
        Command::Procedure(a) => procedure::run(a, given),
        Command::Calibrate(a) => calibrate::run(a, given),
        Command::Allan(a) => allan::run(&a),
        Command::Compare(a) => compare::run(&a),
        Command::Design(a) => design::run(&a),
        Command::Report(a) => report::run(a, given),
        Command::Paper(a) => paper::run(&a),
        Command::Verify(a) => verify::run(&a),
        Command::Licences(a) => licences::run(&a),
        Command::Completions(a) => completions::run(&a),
        Command::Man(a) => completions::man(&a),
        Command::Schema(a) => schema::run(&a),
    };
    done.map_err(|failure| failure.report())
}

#[cfg(feature = "symbolica")]
fn symbolic_worker() -> Result<(), Failure> {
    let input = std::io::BufReader::new(std::io::stdin());
    // the parent has ended or the time is up: ends at once, in the middle of a computation
    #[allow(clippy::exit, reason = "nobody waits for the other thread")]
    let end = || std::process::exit(0);
    let served = obsdeg_symbolic::worker::serve(&lock::symbolic_lock_file(), input, std::io::stdout(), end);
    served.map_err(|e| Failure::internal(format!("the symbolic worker lost its pipe: {e}")))
}

#[cfg(not(feature = "symbolica"))]
fn symbolic_worker() -> Result<(), Failure> {
    Err(Failure::input("this program was built without the symbolic engine".into()))
}

fn main() -> ExitCode {
    // a panic is a defect of the program; its message is already on stderr
    match std::panic::catch_unwind(run) {
        Ok(done) => done.err().unwrap_or(ExitCode::SUCCESS),
        Err(_) => ExitCode::from(failure::INTERNAL),
    }
}
