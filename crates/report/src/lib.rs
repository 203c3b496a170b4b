//! Results as text: tables, JSON, Markdown, CSV, LaTeX, pages. This crate only formats: it computes nothing.
//!
//! ```
//! use obsdeg_core::analysis::{AnalysisOptions, analyze};
//! use obsdeg_core::model::{Angle, Scheme};
//! use obsdeg_report::{Format, TerminalLayout, written};
//!
//! let positions = [[0, 0, 0], [180, 0, 0]].map(|p| p.map(Angle::from_degrees));
//! let answer = analyze(&Scheme::of_angles(positions), AnalysisOptions::default(), None)?;
//! let text = written(&answer, Format::Markdown, TerminalLayout::default())?;
//! assert!(text.starts_with("# Observable degrees"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod acceptance;
mod analysis;
mod audit;
mod budget;
mod calibration;
mod calibration_figures;
mod calibration_findings;
mod calibration_page;
mod cells;
mod compare;
mod crosscheck;
mod csv_text;
mod design;
mod document;
mod excess;
mod figure;
mod figures;
mod gimbals;
mod globe;
mod html;
mod latex;
mod markdown;
mod next;
mod next_figures;
mod omitted;
mod panels;
#[cfg(feature = "pdf")]
mod pdf;
mod poses;
mod procedure;
mod records_read;
mod resolve;
mod review;
mod rows;
mod sensor_figures;
mod sensor_noise;
mod sensors;
mod series;
mod simulation;
mod slew_sequence;
mod stated;
mod system;
mod system_calibration;
mod table;
mod tables;
mod vector;
mod visible;
mod why;
mod words;

pub use budget::budget_csv;
pub use calibration::{covariance_csv, residuals_csv};
pub use calibration_figures::calibration_figures;
pub use document::Document;
pub use excess::Excess;
pub use figure::{FigureError, png};
pub use figures::{File, crosscheck_figures, simulation_figures};
pub use next_figures::next_figures;
pub use poses::position_figure;
pub use procedure::{procedure_page, record_header, steps_csv};
pub use sensor_figures::sensor_figures;
pub use sensor_noise::sensor_noise_figures;
pub use series::{series_csv, series_parquet};
pub use system_calibration::{system_calibration_figures, system_residuals_csv};
pub use table::in_ascii;
pub use tables::Table;
pub use visible::visible;
pub use why::Explanation;

use std::fmt;
use std::str::FromStr;

use obsdeg_calibration::Calibration;
use obsdeg_design::design::Design;
use obsdeg_design::review::DesignReview;

/// A text format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Format {
    /// For the terminal.
    #[default]
    Table,
    /// JSON with a schema name.
    Json,
    /// GitHub-flavoured Markdown.
    Markdown,
    /// Comma-separated values: one [`Table`] of the answer.
    Csv,
    /// LaTeX tables for `\input` (packages booktabs, longtable, amsmath).
    Latex,
}

/// Error for a word that names no format.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is not a format; expected table, json, markdown, csv or latex")]
pub struct FormatError {
    /// The word.
    pub found: String,
}

impl Format {
    /// All formats with their names.
    pub const ALL: [(Self, &'static str); 5] = [
        (Self::Table, "table"),
        (Self::Json, "json"),
        (Self::Markdown, "markdown"),
        (Self::Csv, "csv"),
        (Self::Latex, "latex"),
    ];
}

impl FromStr for Format {
    type Err = FormatError;
    fn from_str(text: &str) -> Result<Self, FormatError> {
        let known = Self::ALL.into_iter().find(|(_, name)| *name == text);
        known.map(|(format, _)| format).ok_or_else(|| FormatError { found: text.into() })
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Self::ALL.iter().find(|(format, _)| format == self).map_or("", |(_, name)| name);
        f.write_str(name)
    }
}

/// Layout of a table on a terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TerminalLayout {
    /// Width in characters; `None` for no limit.
    pub width: Option<u16>,
    /// True if headings and verdicts are styled with ANSI codes.
    pub color: bool,
    /// True if only ASCII is written: lines are drawn in ASCII, and other characters written as `\u{e9}`.
    pub ascii: bool,
    /// True if the details of an answer are left out, and named in the last line.
    pub brief: bool,
}

/// MathML of an expression in program notation; `None` if it cannot be typeset.
pub fn mathml(expression: &str) -> Option<String> {
    html::mathml(&latex::expression(expression))
}

/// MathML of a solution from its terms, each a coefficient, an observation and a station; `None` if it cannot
/// be typeset.
pub fn solution_mathml(terms: &[[&str; 3]]) -> Option<String> {
    html::lines(&latex::solution_of(terms), 0)
}

/// Reason why a result could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// JSON failed.
    #[error("cannot write JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// The answer has no table of this name.
    #[error("no table `{asked}` in this answer; expected one of {}", known.join(", "))]
    NoTable {
        /// Requested name.
        asked: String,
        /// Names of the tables of the answer.
        known: Vec<String>,
    },
    /// CSV failed.
    #[error("cannot write CSV: {0}")]
    Csv(#[from] csv::Error),
    /// Parquet failed.
    #[error("cannot write Parquet: {0}")]
    Parquet(#[from] parquet::errors::ParquetError),
    /// A picture could not be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// This build has no typesetter.
    #[error(
        "this program was built without PDF; build it with `--features pdf`, or write HTML (-o review.html) \
         and print it from a browser"
    )]
    NoPdf,
    /// The typesetter failed.
    #[error("cannot typeset: {0}")]
    Typeset(String),
    /// The template of the page failed.
    #[error("cannot write the page: {0}")]
    Page(#[from] minijinja::Error),
}

/// A result that can be written in every text format.
pub trait Answer: serde::Serialize {
    /// Name and version of the JSON layout (`obsdeg.analysis/1`); `None` for a list of answers.
    fn layout(&self) -> Option<&str> {
        None
    }

    /// Content, independent of the format.
    fn document(&self) -> Document;

    /// Answer in sentences that can stand alone, the answer itself first; empty for results without such.
    fn sentences(&self) -> Vec<String> {
        Vec::new()
    }

    /// Explanations of single verdicts in words, as asked for; empty for results without such.
    fn explanations(&self) -> Vec<Explanation> {
        Vec::new()
    }

    /// Tables of the answer: the lists in its JSON.
    ///
    /// # Errors
    /// Errors of the serialisation.
    fn tables(&self) -> Result<Vec<Table>, serde_json::Error> {
        Ok(tables::of_json(&serde_json::to_value(self)?))
    }

    /// Name of the table that is written if none is named.
    fn main_table(&self) -> &'static str {
        "quantities"
    }
}

/// Answers on several files, with the names of the files.
pub struct Several<A>(pub Vec<(String, A)>);

impl<A: Answer> serde::Serialize for Several<A> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(serde::Serialize)]
        struct One<'a, A> {
            file: &'a str,
            answer: &'a A,
        }
        serializer.collect_seq(self.0.iter().map(|(file, answer)| One { file, answer }))
    }
}

impl<A: Answer> Answer for Several<A> {
    fn document(&self) -> Document {
        let mut blocks = Vec::new();
        for (file, answer) in &self.0 {
            let document = answer.document();
            let title = format!("{file}: {}", document.title);
            blocks.push(document::DocumentBlock::Section { level: 1, title });
            blocks.extend(document.lead.into_iter().map(document::DocumentBlock::Text));
            blocks.extend(document.blocks);
        }
        Document { title: String::new(), lead: vec![], blocks }
    }

    fn tables(&self) -> Result<Vec<Table>, serde_json::Error> {
        let of = |(file, answer): &'_ (String, A)| Ok((file.clone(), answer.tables()?));
        let all: Vec<(String, Vec<Table>)> =
            self.0.iter().map(of).collect::<Result<_, serde_json::Error>>()?;
        Ok(tables::together(all))
    }

    fn main_table(&self) -> &'static str {
        self.0.first().map_or("answer", |(_, answer)| answer.main_table())
    }
}

/// A result in the given format, ending in a newline.
///
/// # Errors
/// [`ReportError`] when a serializer fails.
pub fn written(answer: &impl Answer, format: Format, layout: TerminalLayout) -> Result<String, ReportError> {
    Ok(match format {
        Format::Table => table::document(&answer.document(), layout),
        Format::Json => json(answer)?,
        Format::Markdown => markdown::document(&answer.document().plain()),
        Format::Csv => csv(answer, None)?,
        Format::Latex => latex::document(&answer.document().plain()),
    })
}

/// Result as JSON.
///
/// # Errors
/// [`ReportError::Json`].
pub fn json(answer: &impl Answer) -> Result<String, ReportError> {
    Ok(visible::json(answer)?)
}

/// A result as a part of an HTML page, such as a notebook: tables and formulas (MathML) that read without
/// scripts.
///
/// # Errors
/// [`ReportError`] when the template fails.
pub fn fragment(answer: &impl Answer) -> Result<String, ReportError> {
    html::fragment(&answer.document())
}

/// Table of a result as CSV; the main table if `table` is `None`. The text is empty for an empty list.
///
/// # Errors
/// [`ReportError::NoTable`], and when a serializer fails.
pub fn csv(answer: &impl Answer, table: Option<&str>) -> Result<String, ReportError> {
    let tables = answer.tables()?;
    let asked = table.unwrap_or(answer.main_table());
    let known = || tables.iter().map(|t| t.name.clone()).collect();
    let table = tables.iter().find(|t| t.name == asked);
    if table.is_none() && tables::is_empty_list(&serde_json::to_value(answer)?, asked) {
        return Ok(String::new());
    }
    let table = table.ok_or_else(|| ReportError::NoTable { asked: asked.into(), known: known() })?;
    csv_text::write(std::iter::once(table.columns.clone()).chain(table.rows.iter().cloned()))
}

/// The front of a design as SVG and PNG.
///
/// # Errors
/// [`ReportError`] when it cannot be drawn.
pub fn design_figures(d: &Design) -> Result<Vec<File>, ReportError> {
    Ok(design::figures(d)?)
}

/// True if this build can write a PDF.
pub const HAS_PDF: bool = cfg!(feature = "pdf");

/// A format of a design review.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReviewFormat {
    /// One self-contained page.
    #[default]
    Html,
    /// GitHub-flavoured Markdown, with its pictures in a folder.
    Markdown,
    /// A LaTeX document, with its pictures in a folder.
    Latex,
    /// A PDF (cargo feature `pdf`).
    Pdf,
}

/// Name of the folder of the pictures beside a text file; `stem` is the file's name without its ending.
pub fn picture_folder(stem: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || "_-.".contains(c) { c } else { '_' };
    format!("{}_figures", stem.chars().map(plain).collect::<String>())
}

/// Origin of a report: command, files and certificates.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Origin {
    /// The command that gives the same answer.
    pub command: String,
    /// Every file that it read, with its digest.
    pub inputs: Vec<String>,
    /// Per scheme: the digest of its certificate, or why it has none.
    pub certificates: Vec<String>,
}

/// The files of a design review, with calibrations by name: the text first, then the pictures that it refers
/// to, in `folder` beside it.
///
/// # Errors
/// [`ReportError`].
pub fn review(
    r: &DesignReview,
    calibrations: &[(String, Calibration)],
    origin: &Origin,
    format: ReviewFormat,
    folder: &str,
) -> Result<Vec<File>, ReportError> {
    rendered(review::document(r, calibrations, origin), &r.version, format, folder)
}

/// The files of the report of the first of some calibrations with names; the others are earlier ones: the
/// text first, then the pictures that it refers to, in `folder` beside it.
///
/// # Errors
/// [`ReportError`].
pub fn calibration_report(
    calibrations: &[(String, Calibration)],
    origin: &Origin,
    format: ReviewFormat,
    folder: &str,
) -> Result<Vec<File>, ReportError> {
    let version = calibrations.first().map_or("", |(_, c)| c.version.as_str());
    rendered(calibration_page::document(calibrations, origin), version, format, folder)
}

/// The files of a document: the text first, then the pictures that it refers to.
fn rendered(
    boxes: Document,
    version: &str,
    format: ReviewFormat,
    folder: &str,
) -> Result<Vec<File>, ReportError> {
    let document = if format == ReviewFormat::Html { boxes } else { boxes.plain() };
    match format {
        ReviewFormat::Html => Ok(vec![File::new("review.html", html::page(&document, version)?)]),
        ReviewFormat::Markdown => {
            let document = document.with_pictures_in(folder);
            let mut files = vec![File::new("review.md", markdown::document(&document))];
            let svg = |p: &document::Picture| File::new(format!("{}.svg", p.name), p.svg());
            files.extend(document.pictures().map(svg));
            Ok(files)
        }
        ReviewFormat::Latex => {
            let document = document.with_pictures_in(folder);
            let mut files = vec![File::new("review.tex", latex::alone(&document))];
            for p in document.pictures() {
                files.push(File::new(format!("{}.pdf", p.name), vector::pdf(&p.svg())?));
            }
            Ok(files)
        }
        #[cfg(feature = "pdf")]
        ReviewFormat::Pdf => Ok(vec![File::new("review.pdf", pdf::pages(&document)?)]),
        #[cfg(not(feature = "pdf"))]
        ReviewFormat::Pdf => Err(ReportError::NoPdf),
    }
}
