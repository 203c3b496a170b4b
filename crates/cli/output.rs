//! Where results go: to stdout, to a file or into a folder, whole or not at all.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::{Arg, Args};
use obsdeg_report::{Answer, File, Format, Layout, written};

use crate::failure::Failure;
use crate::files;
use crate::progress::Spinner;

/// Columns of a table that does not go to a terminal.
const PIPE: Layout = Layout { width: Some(120), color: false };

/// In which format and where results are written.
#[derive(Debug, Args)]
pub(crate) struct Output {
    /// table, json, markdown, csv or latex
    #[arg(long, value_name = "FORMAT", default_value_t = Format::Table)]
    format: Format,

    #[command(flatten)]
    pub(crate) target: Target,
}

/// Where results are written.
#[derive(Debug, Args)]
pub(crate) struct Target {
    /// Write to a file instead of stdout
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long)]
    force: bool,

    /// Say nothing on stderr but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// What the options say where there are figures and series too ([`Output::write_folder`]).
pub(crate) fn to_a_folder(arg: Arg) -> Arg {
    let arg = match arg.get_id().as_str() {
        "format" => arg.help("Format on stdout: table, json, markdown, csv or latex"),
        "output" => arg.value_name("DIR").help("Write summary, series and figures to a folder"),
        "force" => arg.help("Replace files in an existing folder"),
        "quiet" => arg,
        _ => return arg,
    };
    arg.help_heading("Output")
}

impl Output {
    /// Writes a result to the file or to stdout.
    pub(crate) fn write(&self, result: &impl Answer) -> Result<(), Failure> {
        let layout = if self.target.output.is_some() { PIPE } else { terminal() };
        self.target.write(written(result, self.format, layout)?.as_bytes(), &[])
    }

    /// Writes a result to stdout and, if there is a folder, its JSON and `more` into that.
    pub(crate) fn write_folder<E>(
        &self,
        result: &impl Answer,
        json: &str,
        more: impl FnOnce() -> Result<Vec<File>, E>,
    ) -> Result<(), Failure>
    where
        Failure: From<E>,
    {
        let text = written(result, self.format, terminal())?;
        if let Some(folder) = &self.target.output {
            let _spinner = Spinner::start("drawing figures", self.target.quiet);
            let bytes = written(result, Format::Json, Layout::default())?.into_bytes();
            let mut files = vec![File { name: json.into(), bytes }];
            files.extend(more()?);
            self.target.check_folder()?;
            place(folder, &below(folder, &files).collect::<Vec<_>>())?;
        }
        print(text.as_bytes())
    }
}

impl Target {
    /// Refuses early, before any work, what cannot be written to a file: one that exists, and what is no file.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        let Some(path) = &self.output else { return Ok(()) };
        files::destination(path).map_err(|e| cannot_write(path, &e))?;
        match path.exists() && !self.force {
            true => Err(Failure::input(format!("{} exists; --force replaces it", path.display()))),
            false => Ok(()),
        }
    }

    /// Refuses early a folder with something in it.
    pub(crate) fn check_folder(&self) -> Result<(), Failure> {
        self.output.as_deref().map_or(Ok(()), |folder| self.check_emptiness(folder))
    }

    /// Refuses early a folder beside the file with something in it.
    pub(crate) fn check_beside(&self, folder: &str) -> Result<(), Failure> {
        let beside = self.output.as_deref().map(|path| files::folder(path).join(folder));
        beside.map_or(Ok(()), |folder| self.check_emptiness(&folder))
    }

    fn check_emptiness(&self, path: &Path) -> Result<(), Failure> {
        if path.exists() && !path.is_dir() {
            return Err(Failure::input(format!("{} is a file; expected a folder", path.display())));
        }
        let occupied = std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some());
        if occupied && !self.force {
            return Err(Failure::input(format!(
                "{} is not empty; --force replaces its files",
                path.display()
            )));
        }
        Ok(())
    }

    /// The file if it is there and is not to be replaced.
    pub(crate) fn existing(&self) -> Option<&Path> {
        self.output.as_deref().filter(|path| path.exists() && !self.force)
    }

    /// Writes `text` to the file, in place of what is there.
    pub(crate) fn replace(&self, text: &[u8]) -> Result<(), Failure> {
        let Some(path) = &self.output else { return print(text) };
        place(path, &[(path.clone(), text)])
    }

    /// Writes `text` to the file or to stdout; beside a file what it refers to, which comes first.
    pub(crate) fn write(&self, text: &[u8], beside: &[File]) -> Result<(), Failure> {
        let Some(path) = &self.output else { return print(text) };
        self.check()?;
        let all: Vec<_> = below(files::folder(path), beside).chain([(path.clone(), text)]).collect();
        place(path, &all)
    }
}

/// The layout for stdout.
fn terminal() -> Layout {
    let stdout = std::io::stdout();
    if !stdout.is_terminal() {
        return PIPE;
    }
    Layout {
        width: terminal_size::terminal_size().map(|(w, _)| w.0),
        color: anstream::AutoStream::choice(&stdout) != anstream::ColorChoice::Never,
    }
}

fn cannot_write(path: &Path, e: &std::io::Error) -> Failure {
    Failure::input(format!("cannot write {}: {e}", path.display()))
}

/// Where files go below a folder.
fn below<'a>(folder: &'a Path, files: &'a [File]) -> impl Iterator<Item = (PathBuf, &'a [u8])> {
    files.iter().map(|file| (folder.join(&file.name), file.bytes.as_slice()))
}

/// Puts files in place; `target` is what the user named.
fn place(target: &Path, files: &[(PathBuf, &[u8])]) -> Result<(), Failure> {
    files::place(target, files).map_err(|(path, e)| cannot_write(&path, &e))
}

/// Writes to stdout; a reader that has left is no error.
pub(crate) fn print(text: &[u8]) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::input(format!("cannot write to stdout: {e}")))
        }
        _ => Ok(()),
    }
}
