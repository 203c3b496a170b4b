//! `obsdeg calibrate`: estimates of what a scheme or model determines, from records of its runs.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::{Arg, Args};
use obsdeg_commands::{AcceptanceReport, Calibrate, Expected, Given, Host, Source, calibrate};

use crate::arguments::RequireMet;
use crate::failure::Failure;
use crate::input::{FileKind, is_stdin, open_record, read, read_as};
use crate::interrupt;
use crate::output::{Output, to_a_folder};
use crate::progress::Bar;

const AFTER_HELP: &str = "\
Examples:
  obsdeg calibrate scheme.toml monday.csv
  obsdeg calibrate scheme.toml monday.csv tuesday.parquet --noise 2e-5 -o calibration
  obsdeg calibrate scheme.toml monday.csv --dry-run
  obsdeg calibrate scheme.toml wednesday.csv --prior calibration/calibration.json
  gzip -dc record.csv.gz | obsdeg calibrate scheme.toml -
  obsdeg calibrate examples/influenza/model.toml examples/influenza/data.csv --profile beta
  gzip -dc examples/handheld/record.csv.gz | obsdeg calibrate examples/handheld/accelerometers.toml -

A record has a header with units: `t [s]`, three of `fx [g]` `fy [g]` `fz [g]` (outputs of the \
accelerometers in platform axes; m/s^2, mg, ug as well; increments of velocity since the row before, as \
pulses are, in m/s, cm/s, mm/s, um/s), `Zx Zy Zz` or `Z1 Z3` (`Z2` with unknown accelerometers), `Za [deg]` \
where the azimuth is measured, and `position` with the names of the scheme (empty while the platform turns); \
without that column the timeline of the scheme says what is where. `sigma_fx [g]` and so on make a row a \
mean with a sigma of its own. `alpha [deg] beta [deg] gamma [deg]` are held against the attitudes of the \
scheme, and what is left of the measurements against a temperature `T [degC]`. Other names, counts instead \
of units, and positions that are to be found as intervals at rest: `[record]` of the scheme (obsdeg schema \
scheme) or model. Lines that begin with # are comments, an empty cell is a value that is not there. Columns \
are separated by commas, semicolons or tabs (then with decimal commas too); a column `t` without a unit may \
hold dates. With -o it writes calibration.json, coefficients.csv, covariance.csv, residuals.csv and figures.

Exit codes: 0 done and consistent, 1 the model or its sigmas do not explain the record, or a requirement is \
missed or a limit not accepted (with --require-met), 2 bad input, 3 internal error, 130 interrupted (with what there is by then, \
once the records are read).";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, mut_args(to_a_folder), mut_args(words))]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Calibrate,

    /// The scheme or model file, then records of its runs (CSV or Parquet; a model takes one); - is stdin
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,

    /// The scheme file; FILEs are records then
    #[arg(long, value_name = "FILE")]
    scheme: Option<PathBuf>,

    /// The model file of any other system; FILE is the record then, with columns `t`, outputs, known inputs,
    /// `sigma_NAME` of either, `experiment`, `segment`
    #[arg(long, value_name = "FILE", conflicts_with = "scheme")]
    model: Option<PathBuf>,

    /// A calibration of the same platform or system before: the JSON that -o writes (one that was not
    /// consistent counts with its sigmas rescaled)
    #[arg(long = "prior", value_name = "FILE")]
    before: Option<PathBuf>,

    #[command(flatten)]
    met: RequireMet,

    #[command(flatten)]
    output: Output,
}

/// Help of shared options for `calibrate`.
fn words(arg: Arg) -> Arg {
    match arg.get_id().as_str() {
        "output" => arg.help("Write calibration, coefficients, residuals and figures to a folder"),
        "carry" => {
            arg.help("Quantity that continues from one position to the next (default: that of the scheme)")
        }
        "latitude" => arg.help("Latitude in degrees (default: that of the scheme, or 28.2)"),
        _ => arg,
    }
}

pub(crate) fn run(mut a: Arguments, given: Given) -> Result<(), Failure> {
    let interrupted = interrupt::flag()?;
    a.output.check_folder()?;
    a.asked.given = given;
    let bar = Bar::start(a.output.target.quiet);
    let progress = |now| {
        bar.show(&now);
        !interrupted.load(Ordering::Relaxed)
    };
    let (source, records) = a.read()?;
    let named = source.read()?;
    let records = records.iter().map(|path| open_record(path)).collect::<Result<Vec<_>, _>>()?;
    let before = a.before.as_deref().map(|path| read(path, "calibration")).transpose()?;
    let host = Host { worker: None, progress: &progress };
    let found = calibrate(&a.asked, named, records, before.as_ref(), &host)?;
    drop(bar);
    let acceptance = found.acceptance();
    if acceptance.is_none() {
        a.met.check(found.requirements())?;
    }
    let accepted = acceptance.is_none_or(AcceptanceReport::all_accepted);
    let file = if a.asked.dry_run { "records.json" } else { "calibration.json" };
    a.output.write_folder(&found, file, || found.files(true))?;
    match found.passed() {
        _ if found.interrupted() => Err(Failure::unfinished("interrupted".into())),
        true => a.met.decide_with(found.requirements(), accepted),
        false => Err(Failure::check()),
    }
}

impl Arguments {
    /// Scheme or model file, and the paths of the records of its runs.
    fn read(&self) -> Result<(Source, &[PathBuf]), Failure> {
        self.check_kinds()?;
        let (source, records) = if let Some(path) = &self.model {
            (read_as(path, Expected::Model)?, &self.files[..])
        } else if let Some(path) = &self.scheme {
            (read_as(path, Expected::Scheme)?, &self.files[..])
        } else {
            let [file, records @ ..] = &self.files[..] else {
                return Err(Failure::input("expected a scheme or model file and a record of its run".into()));
            };
            if is_stdin(file) && records.iter().any(|r| is_stdin(r)) {
                return Err(Failure::input("- is given twice; expected one file on stdin".into()));
            }
            (read(file, "scheme or model")?, records)
        };
        match records {
            [] => Err(Failure::input(format!("no record; expected records of the run of {}", source.name))),
            records => Ok((source, records)),
        }
    }

    /// Refuses a file of the wrong kind; if the order of the files is wrong, the message shows the right
    /// command.
    fn check_kinds(&self) -> Result<(), Failure> {
        let given = self.model.as_ref().or(self.scheme.as_ref());
        let (first, records) = match (given, &self.files[..]) {
            (Some(first), records) => (first, records),
            (None, [first, records @ ..]) => (first, records),
            (None, []) => return Ok(()),
        };
        let runs_of = |kind| matches!(kind, Some(FileKind::Scheme | FileKind::Model));
        let other = records.iter().find(|path| runs_of(FileKind::of(path)));
        let name = first.display();
        match (FileKind::of(first), other) {
            (Some(FileKind::Record), Some(file)) => {
                let records: Vec<String> = std::iter::once(first)
                    .chain(records.iter().filter(|path| *path != file))
                    .map(|path| path.display().to_string())
                    .collect();
                let kind = FileKind::of(file).map_or_else(String::new, |k| k.to_string());
                Err(Failure::input(format!(
                    "{name} is a record and {file} {kind}; expected `obsdeg calibrate {file} {}`",
                    records.join(" "),
                    file = file.display()
                )))
            }
            (Some(kind @ FileKind::Record), None) => Err(Failure::input(format!(
                "{name} is {kind}; expected a scheme or model file, then records: `obsdeg calibrate scheme.toml {name}`"
            ))),
            (Some(kind @ FileKind::Calibration), _) => Err(Failure::input(format!(
                "{name} is {kind}, which `obsdeg calibrate` wrote; expected a scheme or model file (`--prior \
                 {name}` takes it for what was known before)"
            ))),
            _ => {
                let wrong = |path: &&PathBuf| FileKind::of(path).is_some_and(|kind| kind != FileKind::Record);
                let Some((path, kind)) = records.iter().find(wrong).and_then(|p| Some((p, FileKind::of(p)?)))
                else {
                    return Ok(());
                };
                let hint = match kind {
                    FileKind::Calibration => {
                        format!("`--prior {}` takes it for what was known before", path.display())
                    }
                    _ => format!("one scheme or model, which is {name}"),
                };
                Err(Failure::input(format!(
                    "{} is {kind}; expected a record, in CSV or Parquet ({hint})",
                    path.display()
                )))
            }
        }
    }
}
