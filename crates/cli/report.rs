//! `obsdeg report`: the design review of schemes and models, as one file.

use std::path::{Path, PathBuf};

use clap::{Arg, Args};
use obsdeg_commands::{
    AcceptanceReport, CalibrationFile, Given, Host, Report, Source, Word, calibration_report, one_of, origin,
    report,
};
use obsdeg_report::{File, ReviewFormat, picture_folder};

use crate::arguments::{AllFiles, RequireMet};
use crate::engine::{EngineArguments, notice, say_busy};
use crate::failure::Failure;
use crate::failure::say;
use crate::input::read;
use crate::interrupt;
use crate::origin::command;
use crate::output::Target;
use crate::print::{PdfBy, PdfPrinter, print};
use crate::progress::Bar;

const AFTER_HELP: &str = "\
Examples:
  obsdeg report examples/paper-p1-p2/scheme.toml -o review.html
  obsdeg report a.toml b.toml --carry inertial --requirement D=0.05 -o review.html
  obsdeg report scheme.toml -o review.pdf
  obsdeg report examples/two-compartment/model.toml -o review.md
  obsdeg report scheme.toml --calibration calibration -o review.html
  obsdeg report --calibration today --calibration march -o calibration.html

The format follows the ending of the file, or --format. HTML and PDF are one file: a PDF is the page as a \
browser of this computer prints it, or by the typesetter (--pdf-by). Markdown and LaTeX have \
their pictures in a folder of their own beside it, review_figures for review.md. Without a scheme the report is that of \
the first calibration, and of what changed since the others. The same command writes the same bytes.

Exit codes: 0 done, 1 a requirement is missed (with --require-met), 2 bad input, 3 internal error, 130 interrupted.";

/// The words of `--format`.
const FORMATS: [Word<ReviewFormat>; 4] = [
    ("html", "one self-contained page", ReviewFormat::Html),
    ("pdf", "one file, printed by a browser or the typesetter", ReviewFormat::Pdf),
    ("markdown", "with its pictures in a folder beside it", ReviewFormat::Markdown),
    ("latex", "with its pictures in a folder beside it", ReviewFormat::Latex),
];

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, override_usage = "obsdeg report [OPTIONS] <FILE>... -o <FILE>", mut_args(words))]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Report,

    #[command(flatten)]
    files: AllFiles,

    /// The format (default: by the ending of the file)
    #[arg(long, value_name = "FORMAT", help_heading = "Output", value_parser = one_of(FORMATS))]
    format: Option<ReviewFormat>,

    #[command(flatten)]
    target: Target,

    /// Maker of a PDF: browser (the first that is found), the path of one, or typesetter (cargo feature
    /// `pdf`); default: a browser, and where none is found the typesetter
    #[arg(long, value_name = "PROGRAM", help_heading = "Output")]
    pdf_by: Option<PdfBy>,

    /// Folder that `obsdeg calibrate -o` wrote, or its calibration.json; may be given several times. Without
    /// a FILE the report is that of the calibration
    #[arg(long, value_name = "FOLDER")]
    calibration: Vec<PathBuf>,

    #[command(flatten)]
    met: RequireMet,

    #[command(flatten)]
    engine: EngineArguments,
}

/// Help of shared options for `report`.
fn words(arg: Arg) -> Arg {
    match arg.get_id().as_str() {
        "files" => arg.required_unless_present("calibration"),
        "output" => arg.required(true).help("The file to be written"),
        "force" => arg.help("Replace existing files"),
        "carry" => arg.help("Quantity that continues from one position to the next, for all schemes"),
        "latitude" => arg.help(
            "Latitude in degrees, for all schemes (default: that of the file; 28.2 where numbers need one)",
        ),
        _ => arg,
    }
}

pub(crate) fn run(mut a: Arguments, given: Given) -> Result<(), Failure> {
    interrupt::ends()?;
    let path = a.target.path().unwrap_or(Path::new("-"));
    let format = format(a.format, path)?;
    if a.pdf_by.is_some() && format != ReviewFormat::Pdf {
        return Err(Failure::input("--pdf-by does nothing without a PDF; expected -o FILE.pdf".into()));
    }
    let printer = (format == ReviewFormat::Pdf).then(|| PdfPrinter::find(a.pdf_by.as_ref())).transpose()?;
    let folder = picture_folder(&path.file_stem().unwrap_or_default().to_string_lossy());
    a.target.check()?;
    if matches!(format, ReviewFormat::Markdown | ReviewFormat::Latex) {
        a.target.check_beside(&folder)?;
    }
    a.asked.given = given;
    let sources = a.files.read()?;
    let read = sources.iter().cloned().map(Source::read).collect::<Result<Vec<_>, _>>()?;
    let calibrations = a.calibration.iter().map(|path| calibration(path));
    let calibrations = calibrations.collect::<Result<Vec<_>, _>>()?;
    let origin = origin(command(), sources.iter().chain(calibrations.iter().map(|c| &c.source)));
    if read.is_empty() {
        a.asked.assumes_nothing()?;
        let page =
            printer.as_ref().filter(|p| matches!(p, PdfPrinter::Browser(_))).map(|_| ReviewFormat::Html);
        let (files, read) = calibration_report(&calibrations, &origin, page.unwrap_or(format), &folder)?;
        let requirements = || read.iter().take(1).filter_map(|c| c.requirements.as_ref());
        a.met.check(requirements())?;
        a.write(files, printer.as_ref())?;
        let accepted = read.first().and_then(|c| c.acceptance.as_ref());
        return a.met.decide_with(requirements(), accepted.is_none_or(AcceptanceReport::all_accepted));
    }
    let mut worker = a.engine.worker(a.target.quiet, Box::new(Vec::new))?;
    let bar = Bar::start(a.target.quiet);
    let progress = |now| {
        bar.show(&now);
        true
    };
    let mut host = Host { worker: worker.as_mut(), progress: &progress };
    let reviewed = report(&a.asked, read, &calibrations, &mut host)?;
    a.met.check(reviewed.requirements())?;
    bar.set_message("writing");
    let written = match &printer {
        Some(PdfPrinter::Browser(_)) => reviewed.files(&origin, ReviewFormat::Html, &folder)?,
        _ => reviewed.files(&origin, format, &folder)?,
    };
    drop(bar);
    a.write(written, printer.as_ref())?;
    worker.iter().for_each(say_busy);
    notice(worker.as_ref().map_or(&[], |w| w.banner()), a.target.quiet);
    a.met.decide(reviewed.requirements())
}

impl Arguments {
    /// Writes the text, printed by the browser where one is given, and the pictures beside it.
    fn write(&self, mut files: Vec<File>, printer: Option<&PdfPrinter>) -> Result<(), Failure> {
        if let (Some(PdfPrinter::Browser(browser)), Some(page)) = (printer, files.first_mut()) {
            let bar = Bar::start(self.target.quiet);
            bar.set_message("printing");
            page.bytes = print(browser, &page.bytes)?;
            drop(bar);
            if !self.target.quiet {
                say(&format!("printed by {}", browser.display()));
            }
        }
        files.split_first().map_or(Ok(()), |(text, pictures)| self.target.write(&text.bytes, pictures))
    }
}

/// Reads a calibration; its name is that of its folder.
fn calibration(path: &Path) -> Result<CalibrationFile, Failure> {
    let file = if path.is_dir() { path.join("calibration.json") } else { path.to_path_buf() };
    let named = if path.is_dir() { Some(path) } else { path.parent() };
    let name = named.and_then(Path::file_name).map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    Ok(CalibrationFile { name, source: read(&file, "calibration")? })
}

/// The requested format, or the format of the file's ending.
fn format(asked: Option<ReviewFormat>, path: &Path) -> Result<ReviewFormat, Failure> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let by_ending = match ending.as_deref() {
        Some("html" | "htm") => Some(ReviewFormat::Html),
        Some("pdf") => Some(ReviewFormat::Pdf),
        Some("md") => Some(ReviewFormat::Markdown),
        Some("tex") => Some(ReviewFormat::Latex),
        _ => None,
    };
    asked.or(by_ending).ok_or_else(|| {
        Failure::input(format!(
            "no format for {}; expected a file that ends in .html, .pdf, .md or .tex, or --format",
            path.display()
        ))
    })
}
