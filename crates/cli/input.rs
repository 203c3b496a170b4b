//! Files and pipes as texts.

use std::io::{Error, ErrorKind, Read, Result as Io};
use std::path::{Path, PathBuf};

use obsdeg_calibration::record::Record;
use obsdeg_commands::{Expected, Source};
use obsdeg_core::model::scheme_file;
use obsdeg_core::system::model_file;

use crate::failure::Failure;

/// Largest input file, in bytes.
const MAX_FILE: u64 = 50_000_000;

/// Kind of file that a text is meant to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FileKind {
    Scheme,
    Model,
    Calibration,
    Record,
}

impl FileKind {
    /// Kind of the file at `path`, judged by its beginning. `None` for stdin, pipes and files that cannot be
    /// read.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        const BEGINNING: u64 = 1 << 16;
        if is_stdin(path) || !path.metadata().is_ok_and(|m| m.is_file()) {
            return None;
        }
        let mut bytes = Vec::new();
        open(path).ok()?.take(BEGINNING).read_to_end(&mut bytes).ok()?;
        let text = String::from_utf8_lossy(&bytes);
        let header = text.lines().map(str::trim).find(|l| !l.is_empty() && !l.starts_with('#'));
        if bytes.starts_with(b"PAR1") {
            Some(Self::Record)
        } else if text.contains("\"obsdeg.calibration/") || text.contains("\"obsdeg.system-calibration/") {
            Some(Self::Calibration)
        } else if scheme_file::is_scheme(&text) {
            Some(Self::Scheme)
        } else if text.trim_start().starts_with('{') || model_file::is_model(&text) {
            Some(Self::Model)
        } else {
            // outside brackets, no line of TOML has a comma without an equals sign before it
            header
                .filter(|h| h.contains([',', ';', '\t']) && !h.contains(['=', '{', '}']))
                .map(|_| Self::Record)
        }
    }
}

impl std::fmt::Display for FileKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Scheme => "a scheme",
            Self::Model => "a model",
            Self::Calibration => "a calibration",
            Self::Record => "a record",
        })
    }
}

/// True if a path stands for stdin.
pub(crate) fn is_stdin(path: &Path) -> bool {
    path == Path::new("-")
}

/// Text of a file, or of stdin (`-`). `what` names the kind of file in errors. Pipes and devices are read too
/// (`/dev/stdin`, `<(command)`), up to the same limit. A pipe that nobody writes to is refused.
pub(crate) fn read(path: &Path, what: &str) -> Result<Source, Failure> {
    let stdin = is_stdin(path);
    let path = if stdin { Path::new("stdin") } else { path };
    let name = path.display();
    let wrong = |e: Error| Failure::input(format!("cannot read the {what} file {name}: {e}"));
    let too_large = |size: &str| {
        Failure::input(format!("the {what} file {name} has {size} bytes; expected at most {MAX_FILE}"))
    };
    let mut bytes = Vec::new();
    let (read, is_file) = if stdin {
        (std::io::stdin().take(MAX_FILE + 1).read_to_end(&mut bytes).map_err(wrong)?, false)
    } else {
        let file = open(path).map_err(wrong)?;
        let metadata = file.metadata().map_err(wrong)?;
        if metadata.is_dir() {
            return Err(Failure::input(format!("{name} is a folder; expected a {what} file")));
        }
        if metadata.is_file() && metadata.len() > MAX_FILE {
            return Err(too_large(&metadata.len().to_string()));
        }
        let read = file.take(MAX_FILE + 1).read_to_end(&mut bytes).map_err(wrong)?;
        (read, metadata.is_file())
    };
    if read as u64 > MAX_FILE {
        return Err(too_large(&format!("more than {MAX_FILE}")));
    }
    if read == 0 && !is_file {
        return Err(wrong(Error::new(ErrorKind::UnexpectedEof, "nothing comes out of it")));
    }
    let text = String::from_utf8(bytes);
    let text = text.map_err(|e| wrong(Error::new(ErrorKind::InvalidData, e.utf8_error())))?;
    Ok(Source::new(path.display().to_string(), text))
}

/// Text of a file that must be a scheme, or must be a model.
pub(crate) fn read_as(path: &Path, must_be: Expected) -> Result<Source, Failure> {
    let what = if must_be == Expected::Model { "model" } else { "scheme" };
    Ok(Source { must_be, ..read(path, what)? })
}

/// Refuses to read stdin twice.
pub(crate) fn one_on_stdin<'a>(paths: impl Iterator<Item = &'a PathBuf>) -> Result<(), Failure> {
    match paths.filter(|path| is_stdin(path)).count() {
        0 | 1 => Ok(()),
        _ => Err(Failure::input("- is given twice; expected one file on stdin".into())),
    }
}

/// Texts of files with schemes and models.
pub(crate) fn read_all(paths: &[PathBuf]) -> Result<Vec<Source>, Failure> {
    one_on_stdin(paths.iter())?;
    paths.iter().map(|path| read(path, "scheme or model")).collect()
}

/// Opens a file without waiting for a writer of a pipe; reads wait for the process that has the pipe open.
#[cfg(unix)]
pub(crate) fn open(path: &Path) -> Io<std::fs::File> {
    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
    use std::os::unix::fs::OpenOptionsExt;
    let file = std::fs::File::options().read(true).custom_flags(OFlags::NONBLOCK.bits() as i32).open(path)?;
    fcntl_setfl(&file, fcntl_getfl(&file)? - OFlags::NONBLOCK)?;
    Ok(file)
}

#[cfg(not(unix))]
pub(crate) fn open(path: &Path) -> Io<std::fs::File> {
    std::fs::File::open(path)
}

/// Opens a record: a file, or stdin.
pub(crate) fn open_record(path: &Path) -> Result<Record, Failure> {
    let wrong = |e: &dyn std::fmt::Display| Failure::input(e.to_string());
    if path == Path::new("-") {
        return Record::stream("stdin", Box::new(std::io::stdin())).map_err(|e| wrong(&e));
    }
    let name = path.display().to_string();
    let file = open(path).map_err(|e| Failure::input(format!("cannot read the record {name}: {e}")))?;
    Record::file(&name, file).map_err(|e| wrong(&e))
}
