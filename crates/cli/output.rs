//! Writes results to stdout, a file or a folder, completely or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Arg, Args};
use obsdeg_report::{Answer, File, Format, TerminalLayout, csv, written};

use crate::failure::Failure;
use crate::files;
use crate::progress::Spinner;
use crate::terminal::{PIPE, layout};
use obsdeg_commands::{Word, one_of};

/// The words of `--format`.
const FORMATS: [Word<Format>; 5] = [
    ("table", "for the terminal", Format::Table),
    ("json", "everything, under a schema (obsdeg schema)", Format::Json),
    ("markdown", "GitHub-flavoured", Format::Markdown),
    ("csv", "one table, all digits; --table says which", Format::Csv),
    ("latex", "tables for \\input (booktabs, longtable, amsmath)", Format::Latex),
];

/// Format and destination of results.
#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub(crate) struct Output {
    /// The format (default: by the ending of -o, .json .md .csv .tex .txt; without one table)
    #[arg(long, value_name = "FORMAT", value_parser = one_of(FORMATS))]
    format: Option<Format>,

    /// Which list of the JSON the CSV holds, such as quantities or combinations (default: the main one)
    #[arg(long, value_name = "NAME")]
    table: Option<String>,

    /// Nothing but ASCII in tables and messages (default: where the locale is not UTF-8, which on a terminal
    /// it also is where none of LC_ALL, LC_CTYPE, LANG is set, and on a terminal under TERM=dumb; pipes and
    /// files are UTF-8 without a locale)
    #[arg(long)]
    ascii: bool,

    #[command(flatten)]
    pub(crate) target: Target,
}

/// Destination of results.
#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub(crate) struct Target {
    /// Write to a file instead of stdout (-)
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long)]
    pub(crate) force: bool,

    /// Say nothing on stderr but errors and what is missing in the answer
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// Endings of files that other programs write; a destination with such an ending is no folder.
const ELSEWHERE: [&str; 13] =
    ["html", "htm", "pdf", "xlsx", "xls", "ods", "parquet", "xml", "yaml", "yml", "svg", "png", "toml"];

/// Ending of a file name, in small letters.
fn ending(path: &Path) -> Option<String> {
    path.extension().map(|e| e.to_string_lossy().to_lowercase())
}

/// Help of options for commands that also write figures and series ([`Output::write_folder`]).
pub(crate) fn to_a_folder(arg: Arg) -> Arg {
    let arg = match arg.get_id().as_str() {
        "format" => arg.help("The format on stdout (default: table)"),
        "output" => arg.value_name("DIR").help(
            "Write summary, series and figures to a folder; a name that ends in .json, .md, .csv or .tex: \
             the answer alone",
        ),
        "force" => arg.help("Replace files in an existing folder"),
        "quiet" => arg,
        _ => return arg,
    };
    arg.help_heading("Output")
}

impl Output {
    /// Options for the wording of an answer that were given.
    pub(crate) fn wording(&self) -> impl Iterator<Item = &'static str> {
        let given =
            [("--format", self.format.is_some()), ("--table", self.table.is_some()), ("--ascii", self.ascii)];
        given.into_iter().filter_map(|(option, given)| given.then_some(option))
    }

    /// True if the ending makes the destination a file with the answer alone. Only for commands that may also
    /// write a folder with figures and series.
    fn is_file(&self) -> bool {
        let path = self.target.path().filter(|path| !path.is_dir());
        let files = ["json", "md", "csv", "tex", "txt"];
        path.and_then(ending).is_some_and(|e| files.contains(&e.as_str()) || ELSEWHERE.contains(&e.as_str()))
    }

    /// Refuses, before any work, a folder that is not empty, or an existing file.
    pub(crate) fn check_folder(&self) -> Result<(), Failure> {
        if self.is_file() { self.check() } else { self.target.check_folder() }
    }

    /// Refuses, before any work, a destination that cannot be written, and an unknown format.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        self.format()?;
        self.target.check()
    }

    /// The requested format, or the format of the file's ending.
    fn format(&self) -> Result<Format, Failure> {
        let by_ending = match self.target.path().and_then(ending).as_deref() {
            Some("json") => Format::Json,
            Some("md") => Format::Markdown,
            Some("csv") => Format::Csv,
            Some("tex") => Format::Latex,
            Some(other) if other != "txt" && self.format.is_none() => {
                let pages = ["html", "htm", "pdf"].contains(&other);
                let pages = if pages { " (pages are written by `obsdeg report`)" } else { "" };
                return Err(Failure::input(format!(
                    "no format for .{other} here; expected a file that ends in .json, .md, .csv, .tex or \
                     .txt (a table), or --format{pages}"
                )));
            }
            _ if self.table.is_some() => Format::Csv,
            _ => Format::Table,
        };
        let format = self.format.unwrap_or(by_ending);
        match &self.table {
            Some(table) if format != Format::Csv => {
                Err(Failure::input(format!("--table {table} is about CSV, and the format is {format}")))
            }
            _ => Ok(format),
        }
    }

    /// Text of a result in a format.
    fn text(&self, result: &impl Answer, format: Format, layout: TerminalLayout) -> Result<String, Failure> {
        Ok(match format {
            Format::Csv => csv(result, self.table.as_deref())?,
            _ => written(result, format, layout)?,
        })
    }

    /// Writes a result to the file or to stdout.
    pub(crate) fn write(&self, result: &impl Answer) -> Result<(), Failure> {
        self.write_all(result, true)
    }

    /// Writes a result to the file or to stdout, a table with its details or without.
    pub(crate) fn write_all(&self, result: &impl Answer, details: bool) -> Result<(), Failure> {
        let stdout = self.target.path().is_none();
        let layout = if stdout { layout(self.ascii) } else { TerminalLayout { ascii: self.ascii, ..PIPE } };
        let layout = TerminalLayout { brief: !details, ..layout };
        self.target.write(self.text(result, self.format()?, layout)?.as_bytes(), &[])
    }

    /// Writes a result to stdout and, if a folder is given, its JSON and the files of `more` into the folder.
    pub(crate) fn write_folder<E>(
        &self,
        result: &impl Answer,
        json: &str,
        more: impl FnOnce() -> Result<Vec<File>, E>,
    ) -> Result<(), Failure>
    where
        Failure: From<E>,
    {
        if self.is_file() {
            return self.write(result);
        }
        let asked = self.format.unwrap_or(if self.table.is_some() { Format::Csv } else { Format::Table });
        if let Some(table) = self.table.as_ref().filter(|_| asked != Format::Csv) {
            return Err(Failure::input(format!("--table {table} is about CSV, and the format is {asked}")));
        }
        let text = self.text(result, asked, layout(self.ascii))?;
        if let Some(folder) = self.target.path() {
            let _spinner = Spinner::start("drawing figures", self.target.quiet);
            let bytes = written(result, Format::Json, TerminalLayout::default())?.into_bytes();
            let mut files = vec![File { name: json.into(), bytes }];
            files.extend(more()?);
            self.target.check_folder()?;
            place(folder, &below(folder, &files).collect::<Vec<_>>())?;
        }
        print(text.as_bytes())
    }
}

impl Target {
    /// Path of the file or folder; `None` is stdout.
    pub(crate) fn path(&self) -> Option<&Path> {
        self.output.as_deref().filter(|path| *path != Path::new("-"))
    }

    /// Removes files of a run before from the folder: those of `names` that are not `kept`.
    pub(crate) fn drops(&self, names: &[&str], kept: &str) -> Result<(), Failure> {
        let Some(folder) = self.path().filter(|folder| folder.is_dir()) else { return Ok(()) };
        for path in names.iter().filter(|name| **name != kept).map(|name| folder.join(name)) {
            if path.is_file() {
                std::fs::remove_file(&path)
                    .map_err(|e| Failure::input(format!("{} cannot be removed: {e}", path.display())))?;
            }
        }
        Ok(())
    }

    /// Refuses, whatever `--force`, a folder whose file `name` has more than `lines` lines: somebody filled
    /// it.
    pub(crate) fn keeps(&self, name: &str, lines: usize, what: &str) -> Result<(), Failure> {
        let Some(path) = self.path().map(|folder| folder.join(name)) else { return Ok(()) };
        let found = std::fs::read(&path).map_or(0, |text| text.iter().filter(|b| **b == b'\n').count());
        match found > lines {
            true => Err(Failure::input(format!(
                "{} holds {what}: {found} lines; expected another folder, or move it away",
                path.display()
            ))),
            false => Ok(()),
        }
    }

    /// Refuses, before any work, an existing file (without `--force`) and a path that is no regular file.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        let Some(path) = self.path() else { return Ok(()) };
        files::destination(path).map_err(|e| cannot_write(path, &e))?;
        let folder = files::folder(path);
        if !folder.is_dir() {
            return Err(Failure::input(format!(
                "cannot write {}: the folder {} does not exist",
                path.display(),
                folder.display()
            )));
        }
        match path.exists() && !self.force {
            true => Err(Failure::input(format!("{} exists; --force replaces it", path.display()))),
            false => Ok(()),
        }
    }

    /// Refuses, before any work, a folder that is not empty.
    pub(crate) fn check_folder(&self) -> Result<(), Failure> {
        if self.output.as_deref() == Some(Path::new("-")) {
            return Err(Failure::input(
                "-o - is stdout; expected a folder, for figures and series too".into(),
            ));
        }
        self.path().map_or(Ok(()), |folder| self.check_emptiness(folder))
    }

    /// Refuses, before any work, a folder beside the file that is not empty.
    pub(crate) fn check_beside(&self, folder: &str) -> Result<(), Failure> {
        let beside = self.path().map(|path| files::folder(path).join(folder));
        beside.map_or(Ok(()), |folder| self.check_emptiness(&folder))
    }

    fn check_emptiness(&self, path: &Path) -> Result<(), Failure> {
        check_is_folder(path)?;
        let occupied = std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some());
        if occupied && !self.force {
            return Err(Failure::input(format!(
                "{} is not empty; --force replaces its files",
                path.display()
            )));
        }
        Ok(())
    }

    /// Path of the destination if it exists and may not be replaced.
    pub(crate) fn existing(&self) -> Option<&Path> {
        self.path().filter(|path| path.exists() && !self.force)
    }

    /// Writes `text` to the file, over an existing one.
    pub(crate) fn replace(&self, text: &[u8]) -> Result<(), Failure> {
        let Some(path) = self.path() else { return print(text) };
        place(path, &[(path.to_path_buf(), text)])
    }

    /// Writes `text` to the file or to stdout. Beside a file, the files that the text refers to are written
    /// first.
    pub(crate) fn write(&self, text: &[u8], beside: &[File]) -> Result<(), Failure> {
        let Some(path) = self.path() else { return print(text) };
        self.check()?;
        let all: Vec<_> = below(files::folder(path), beside).chain([(path.to_path_buf(), text)]).collect();
        place(path, &all)
    }
}

fn cannot_write(path: &Path, e: &std::io::Error) -> Failure {
    Failure::input(format!("cannot write {}: {e}", path.display()))
}

/// Refuses an existing path that is no folder.
fn check_is_folder(path: &Path) -> Result<(), Failure> {
    match path.exists() && !path.is_dir() {
        true => Err(Failure::input(format!("{} is a file; expected a folder", path.display()))),
        false => Ok(()),
    }
}

/// Puts files into a folder, which is created if missing. Existing files are replaced only if `force` is
/// true.
pub(crate) fn write_files(folder: &Path, files: &[File], force: bool) -> Result<(), Failure> {
    check_is_folder(folder)?;
    if let Some((path, _)) = below(folder, files).find(|(path, _)| path.exists() && !force) {
        return Err(Failure::input(format!("{} exists; --force replaces it", path.display())));
    }
    // the manual's folder may be missing in a new home folder
    std::fs::create_dir_all(folder).map_err(|e| cannot_write(folder, &e))?;
    place(folder, &below(folder, files).collect::<Vec<_>>())
}

/// Puts one file in place, over an existing one.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    files::destination(path).map_err(|e| cannot_write(path, &e))?;
    place(path, &[(path.to_path_buf(), bytes)])
}

/// Paths and contents of files in a folder.
fn below<'a>(folder: &'a Path, files: &'a [File]) -> impl Iterator<Item = (PathBuf, &'a [u8])> {
    files.iter().map(|file| (folder.join(&file.name), file.bytes.as_slice()))
}

/// Puts files in place; `target` is the path that the user named.
fn place(target: &Path, files: &[(PathBuf, &[u8])]) -> Result<(), Failure> {
    files::place(target, files).map_err(|(path, e)| cannot_write(&path, &e))
}

/// Writes to stdout; a closed pipe is no error.
pub(crate) fn print(text: &[u8]) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::input(format!("cannot write to stdout: {e}")))
        }
        _ => Ok(()),
    }
}
