//! What is read: a scheme or a model, told apart by what it says, from whatever kind of file; its errors are drawn in its text.

use std::io::{Error, ErrorKind, Read, Result as Io};
use std::ops::Range;
use std::path::{Path, PathBuf};

use obsdeg_core::model::{Scheme, scheme_file};
use obsdeg_core::system::{ModelError, SystemModel, json, model_file};
use obsdeg_evidence::system::RunError;

use crate::failure::Failure;

/// Largest input file, in bytes.
const MAX_FILE: u64 = 50_000_000;

/// What is judged.
pub(crate) enum Input {
    Scheme(Box<Scheme>),
    Model(Box<ModelFile>),
}

impl Input {
    pub(crate) fn scheme(scheme: Scheme) -> Self {
        Self::Scheme(Box::new(scheme))
    }

    pub(crate) fn model(file: ModelFile) -> Self {
        Self::Model(Box::new(file))
    }
}

/// A model with the file it came from.
pub(crate) struct ModelFile {
    pub(crate) model: SystemModel,
    source: Source,
}

impl ModelFile {
    /// What is wrong with the model.
    pub(crate) fn wrong(&self, e: &ModelError) -> Failure {
        self.source.wrong(&e.to_string(), e.span.clone())
    }

    /// What is wrong with a run of it.
    pub(crate) fn wrong_run(&self, e: &RunError) -> Failure {
        match e {
            RunError::Model(e) => self.wrong(e),
            RunError::Filter { .. } => self.source.wrong(&e.to_string(), None),
        }
    }
}

/// Whether a path stands for stdin.
pub(crate) fn is_stdin(path: &Path) -> bool {
    path == Path::new("-")
}

/// A file that was read.
pub(crate) struct Source {
    path: PathBuf,
    text: String,
}

impl Source {
    /// The text of a file, or of stdin (`-`); `what` it is stands in the errors. Pipes and devices are read too (`/dev/stdin`, `<(command)`), up to the same
    /// limit; a pipe that nobody writes to is refused.
    pub(crate) fn read(path: &Path, what: &str) -> Result<Self, Failure> {
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
        Ok(Self { path: path.to_path_buf(), text })
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// The name of the file as it was given.
    pub(crate) fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// The scheme or the model that it is.
    pub(crate) fn scheme_or_model(self) -> Result<Input, Failure> {
        if self.is_model() { self.model().map(Input::model) } else { self.scheme().map(Input::scheme) }
    }

    /// The scheme.
    pub(crate) fn scheme(&self) -> Result<Scheme, Failure> {
        scheme_file::read(&self.text).map_err(|e| match self.is_model() {
            true => Failure::input(format!(
                "{} is a model file; expected a scheme file, with [[position]] tables",
                self.path.display()
            )),
            false => self.wrong(&e.message, e.span),
        })
    }

    /// The model.
    pub(crate) fn model(self) -> Result<ModelFile, Failure> {
        let read = if self.is_json() { json::read(&self.text) } else { model_file::read(&self.text) };
        match read {
            Ok(model) => Ok(ModelFile { model, source: self }),
            Err(_) if scheme_file::is_scheme(&self.text) => Err(Failure::input(format!(
                "{} is a scheme file; expected a model file, with [states] and [outputs]",
                self.path.display()
            ))),
            Err(e) => Err(self.wrong(&e.to_string(), e.span)),
        }
    }

    /// Whether it is meant as a model, which may be JSON.
    fn is_model(&self) -> bool {
        self.is_json() || model_file::is_model(&self.text)
    }

    /// Whether it is JSON: no TOML begins with a brace. What neither begins so nor is meant as a scheme or a model in TOML is what its name says.
    fn is_json(&self) -> bool {
        let toml = || scheme_file::is_scheme(&self.text) || model_file::is_model(&self.text);
        let named = self.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        self.text.trim_start().starts_with('{') || named && !toml()
    }

    fn wrong(&self, message: &str, span: Option<Range<usize>>) -> Failure {
        let name = self.path.display().to_string();
        match span {
            Some(span) => Failure::at(message, &name, &self.text, span),
            None => Failure::input(format!("{name}: {message}")),
        }
    }
}

/// A file's name without its ending; the folder's for a `scheme.toml`.
pub(crate) fn title(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    let folder = path.parent().and_then(Path::file_name).filter(|_| stem == "scheme");
    folder.unwrap_or(stem).to_string_lossy().into_owned()
}

/// Opens without waiting for somebody to write into a pipe; reading waits for whoever has it open.
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
