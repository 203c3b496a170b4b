//! Model files: read once, their errors drawn in their text wherever they come up.

use std::path::Path;

use obsdeg_core::model::scheme_file;
use obsdeg_core::system::{ModelError, SystemModel, json, model_file};
use obsdeg_evidence::system::run::RunError;

use crate::failure::Failure;
use crate::input::read_text;

/// A model with the file it came from.
pub(crate) struct ModelFile {
    pub(crate) model: SystemModel,
    source: Source,
}

/// The file.
struct Source {
    name: String,
    text: String,
}

impl Source {
    fn wrong(&self, e: &ModelError) -> Failure {
        match e.span.clone() {
            _ if scheme_file::is_scheme(&self.text) => Failure::input(format!(
                "{} is a scheme file; expected a model file, with [states] and [outputs] (schemes go with --scheme)",
                self.name
            )),
            Some(span) => Failure::at(&e.to_string(), &self.name, &self.text, span),
            _ => Failure::input(format!("{}: {e}", self.name)),
        }
    }
}

/// Whether a file ends as JSON does.
pub(crate) fn is_json(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"))
}

impl ModelFile {
    /// Reads TOML, or JSON by the ending of the file.
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        Self::of(path, read_text(path, "model")?)
    }

    /// The model of a file that was read.
    pub(crate) fn of(path: &Path, text: String) -> Result<Self, Failure> {
        let source = Source { name: path.display().to_string(), text };
        let read = if is_json(path) { json::read(&source.text) } else { model_file::read(&source.text) };
        let model = read.map_err(|e| source.wrong(&e))?;
        Ok(Self { model, source })
    }

    /// What is wrong with the model.
    pub(crate) fn wrong(&self, e: &ModelError) -> Failure {
        self.source.wrong(e)
    }

    /// What is wrong with a run of it.
    pub(crate) fn wrong_run(&self, e: &RunError) -> Failure {
        match e {
            RunError::Model(e) => self.wrong(e),
            RunError::Filter { .. } => Failure::input(format!("{}: {e}", self.source.name)),
        }
    }
}
