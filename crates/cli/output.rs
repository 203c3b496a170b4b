//! Results to stdout or to a file, whole or not at all.

use std::io::{IsTerminal, Write};
use std::path::Path;

use obsdeg_report::{File, Layout};

use crate::arguments::{FolderArguments, OutputArguments};
use crate::failure::Failure;

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

/// Refuses a file that exists.
pub(crate) fn check_file(path: &Path, force: bool) -> Result<(), Failure> {
    match path.exists() && !force {
        true => Err(Failure::input(format!("{} exists; --force replaces it", path.display()))),
        false => Ok(()),
    }
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

/// Writes the first file to `path` and the others into `folder`: first beside it, then moved in place, the first one last.
pub(crate) fn write_review(path: &Path, folder: &Path, files: &[File]) -> Result<(), Failure> {
    let Some((first, pictures)) = files.split_first() else { return Ok(()) };
    let place = || -> std::io::Result<()> {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let new = tempfile::Builder::new().prefix(".obsdeg").tempdir_in(parent)?;
        for file in files {
            std::fs::write(new.path().join(&file.name), &file.bytes)?;
        }
        if !pictures.is_empty() {
            std::fs::create_dir_all(folder)?;
        }
        for file in pictures {
            std::fs::rename(new.path().join(&file.name), folder.join(&file.name))?;
        }
        std::fs::rename(new.path().join(&first.name), path)
    };
    place().map_err(|e| Failure::input(format!("cannot write {}: {e}", path.display())))
}

/// The file's name without its ending; the folder's for a `scheme.toml`.
pub(crate) fn name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    let folder = path.parent().and_then(Path::file_name).filter(|_| stem == "scheme");
    folder.unwrap_or(stem).to_string_lossy().into_owned()
}

/// Writes `text` to the file of the arguments (by a temporary file and a rename) or to stdout.
pub(crate) fn write(out: &OutputArguments, text: &str) -> Result<(), Failure> {
    check(out)?;
    match &out.output {
        Some(path) => write_file(path, text)
            .map_err(|e| Failure::input(format!("cannot write {}: {e}", path.display()))),
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

pub(crate) fn write_file(path: &Path, text: &str) -> std::io::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = tempfile::Builder::new().prefix(".obsdeg").tempfile_in(folder)?;
    file.write_all(text.as_bytes())?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// Refuses early what `write_folder` would refuse.
pub(crate) fn check_folder(out: &FolderArguments) -> Result<(), Failure> {
    let Some(path) = &out.output else { return Ok(()) };
    check_emptiness(path, out.force)
}

/// Writes all files into the folder of the arguments, if there is one: first beside it, then moved in place.
pub(crate) fn write_folder(out: &FolderArguments, files: &[File]) -> Result<(), Failure> {
    let Some(path) = &out.output else { return Ok(()) };
    check_folder(out)?;
    let place = || -> std::io::Result<()> {
        let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let new = tempfile::Builder::new().prefix(".obsdeg").tempdir_in(parent)?;
        for file in files {
            std::fs::write(new.path().join(&file.name), &file.bytes)?;
        }
        std::fs::create_dir_all(path)?;
        for file in files {
            std::fs::rename(new.path().join(&file.name), path.join(&file.name))?;
        }
        Ok(())
    };
    place().map_err(|e| Failure::input(format!("cannot write to {}: {e}", path.display())))
}
