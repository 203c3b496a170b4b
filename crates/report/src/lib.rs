//! Results as text: tables, JSON, Markdown, CSV, LaTeX. Pure formatting: nothing is computed here.
//!
//! ```
//! use obsdeg_core::analysis::{AnalysisOptions, analyze};
//! use obsdeg_core::model::{Angle, Scheme};
//! use obsdeg_report::{Format, Layout, written};
//!
//! let positions = [[0, 0, 0], [180, 0, 0]].map(|p| p.map(Angle::from_degrees));
//! let answer = analyze(&Scheme::of_angles(positions), AnalysisOptions::default(), None)?;
//! let text = written(&answer, Format::Markdown, Layout::default())?;
//! assert!(text.starts_with("# Observable degrees"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod analysis;
mod audit;
mod calibration;
mod compare;
mod crosscheck;
mod csv_text;
mod design;
mod document;
mod figure;
mod figures;
mod html;
mod latex;
mod markdown;
#[cfg(feature = "pdf")]
mod pdf;
mod poses;
mod review;
mod rows;
mod series;
mod simulation;
mod system;
mod system_calibration;
mod table;
mod vector;
mod visible;
mod walks;
mod words;

pub use calibration::{calibration_figures, residuals_csv};
pub use document::Document;
pub use figure::{FigureError, png};
pub use figures::{File, crosscheck_figures, simulation_figures};
pub use poses::position_figure;
pub use series::{series_csv, series_parquet};
pub use system_calibration::{system_calibration_figures, system_residuals_csv};
pub use visible::visible;

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
    /// Comma-separated values: one row per unknown and combination.
    Csv,
    /// LaTeX tables for `\input` (packages booktabs, longtable, amsmath).
    Latex,
}

/// Not a format.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is not a format; expected table, json, markdown, csv or latex")]
pub struct FormatError {
    /// The text found.
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

/// How a table is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Layout {
    /// Columns of the terminal; `None` for no limit.
    pub width: Option<u16>,
    /// Whether headings are styled with ANSI codes.
    pub color: bool,
}

/// Why a result could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// JSON.
    #[error("cannot write JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// CSV.
    #[error("cannot write CSV: {0}")]
    Csv(#[from] csv::Error),
    /// Parquet.
    #[error("cannot write Parquet: {0}")]
    Parquet(#[from] parquet::errors::ParquetError),
    /// A picture.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// No typesetter in this build.
    #[error("this program was built without the feature `pdf`; expected html, markdown or latex")]
    NoPdf,
    /// The typesetter refused.
    #[error("cannot typeset: {0}")]
    Typeset(String),
    /// A page.
    #[error("cannot write the page: {0}")]
    Page(#[from] minijinja::Error),
}

/// A result that can be written in every text format.
pub trait Answer: serde::Serialize {
    /// What it says, in no format.
    fn document(&self) -> Document;

    /// Its rows in CSV, names first, where they are not those of the first table.
    fn records(&self) -> Option<Vec<Vec<String>>> {
        None
    }
}

/// A result in the given format, ending in a newline.
///
/// # Errors
/// [`ReportError`] when a serializer fails.
pub fn written(answer: &impl Answer, format: Format, layout: Layout) -> Result<String, ReportError> {
    Ok(match format {
        Format::Table => table::document(&answer.document(), layout),
        Format::Json => visible::json(answer)?,
        Format::Markdown => markdown::document(&answer.document()),
        Format::Csv => match answer.records() {
            Some(rows) => csv_text::write(rows)?,
            None => csv_text::document(&answer.document())?,
        },
        Format::Latex => latex::document(&answer.document()),
    })
}

/// A part in percent, never below what it is: `0.0021 %`.
pub fn percent(x: f64) -> String {
    design::percent(x)
}

/// The front of a design as SVG and PNG.
///
/// # Errors
/// [`ReportError`] when it cannot be drawn.
pub fn design_figures(d: &Design) -> Result<Vec<File>, ReportError> {
    Ok(design::figures(d)?)
}

/// Whether this build can write a PDF.
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

/// The folder of the pictures of a text whose file has this name without its ending: beside it, and its own.
pub fn picture_folder(stem: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || "_-.".contains(c) { c } else { '_' };
    format!("{}_figures", stem.chars().map(plain).collect::<String>())
}

/// What a report was made by and of.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Origin {
    /// The command that gives the same answer.
    pub command: String,
    /// Every file that it read, with its digest.
    pub inputs: Vec<String>,
}

/// The files of a design review, with calibrations by name: the text first, then the pictures that it refers to, in `folder` beside it.
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
    let boxes = review::document(r, calibrations, origin);
    let document = if format == ReviewFormat::Html { boxes } else { boxes.plain() };
    match format {
        ReviewFormat::Html => Ok(vec![File::new("review.html", html::page(&document, &r.version)?)]),
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
