//! Results to stdout or to a file, whole or not at all.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use obsdeg_report::{File, Layout};

use crate::arguments::{FolderArguments, OutputArguments};
use crate::failure::Failure;
use crate::files;

/// Columns of a table that does not go to a terminal.
const PIPE: Layout = Layout { width: Some(120), color: false };

/// The layout for where the output goes.
pub(crate) fn layout(out: &OutputArguments) -> Layout {
    if out.output.is_some() { PIPE } else { terminal() }
}

/// The layout for stdout.
pub(crate) fn terminal() -> Layout {
    let stdout = std::io::stdout();
    if !stdout.is_terminal() {
        return PIPE;
    }
    Layout {
        width: terminal_size::terminal_size().map(|(w, _)| w.0),
        color: anstream::AutoStream::choice(&stdout) != anstream::ColorChoice::Never,
    }
}

/// Refuses early, before any work, what `write` would refuse.
pub(crate) fn check(out: &OutputArguments) -> Result<(), Failure> {
    match &out.output {
        Some(path) => check_file(path, out.force),
        None => Ok(()),
    }
}

/// Refuses a file that exists, and what is no file.
pub(crate) fn check_file(path: &Path, force: bool) -> Result<(), Failure> {
    files::destination(path).map_err(|e| cannot_write(path, &e))?;
    match path.exists() && !force {
        true => Err(Failure::input(format!("{} exists; --force replaces it", path.display()))),
        false => Ok(()),
    }
}

fn cannot_write(path: &Path, e: &std::io::Error) -> Failure {
    Failure::input(format!("cannot write {}: {e}", path.display()))
}

/// Puts files in place; `target` is what the user named.
fn place(target: &Path, files: &[(PathBuf, &[u8])]) -> Result<(), Failure> {
    files::place(target, files).map_err(|(path, e)| cannot_write(&path, &e))
}

/// Refuses a folder with something in it.
pub(crate) fn check_emptiness(path: &Path, force: bool) -> Result<(), Failure> {
    if path.exists() && !path.is_dir() {
        return Err(Failure::input(format!("{} is a file; expected a folder", path.display())));
    }
    let occupied = std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some());
    if occupied && !force {
        return Err(Failure::input(format!("{} is not empty; --force replaces its files", path.display())));
    }
    Ok(())
}

/// Writes the first file to `path` and the others below `folder`; the first one comes last.
pub(crate) fn write_review(path: &Path, folder: &Path, files: &[File]) -> Result<(), Failure> {
    let Some((first, pictures)) = files.split_first() else { return Ok(()) };
    let pictures = pictures.iter().map(|file| (folder.join(&file.name), file.bytes.as_slice()));
    let all: Vec<_> = pictures.chain([(path.to_path_buf(), first.bytes.as_slice())]).collect();
    place(path, &all)
}

/// The file's name without its ending; the folder's for a `scheme.toml`.
pub(crate) fn name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    let folder = path.parent().and_then(Path::file_name).filter(|_| stem == "scheme");
    folder.unwrap_or(stem).to_string_lossy().into_owned()
}

/// Writes `text` to the file of the arguments or to stdout.
pub(crate) fn write(out: &OutputArguments, text: &str) -> Result<(), Failure> {
    check(out)?;
    match &out.output {
        Some(path) => place(path, &[(path.clone(), text.as_bytes())]),
        None => print(text),
    }
}

/// Writes to stdout; a reader that has left is no error.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::input(format!("cannot write to stdout: {e}")))
        }
        _ => Ok(()),
    }
}

/// Refuses early what `write_folder` would refuse.
pub(crate) fn check_folder(out: &FolderArguments) -> Result<(), Failure> {
    let Some(path) = &out.output else { return Ok(()) };
    check_emptiness(path, out.force)
}

/// Writes all files into the folder of the arguments, if there is one.
pub(crate) fn write_folder(out: &FolderArguments, files: &[File]) -> Result<(), Failure> {
    let Some(path) = &out.output else { return Ok(()) };
    check_folder(out)?;
    let files: Vec<_> = files.iter().map(|file| (path.join(&file.name), file.bytes.as_slice())).collect();
    place(path, &files)
}
