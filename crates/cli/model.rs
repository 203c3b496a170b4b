//! Model files: read once, their errors drawn in their text wherever they come up.

use std::path::Path;

use obsdeg_core::system::run::RunError;
use obsdeg_core::system::{ModelError, SystemModel, json, model_file};

use crate::arguments::read_text;
use crate::failure::Failure;

/// A model with the file it came from.
pub(crate) struct ModelFile {
    pub(crate) model: SystemModel,
    source: Source,
}

/// The file.
struct Source {
    name: String,
    text: String,
    is_json: bool,
}

impl Source {
    fn wrong(&self, e: &ModelError) -> Failure {
        match e.span.clone() {
            // places in JSON are inside its strings
            Some(span) if !self.is_json => Failure::at(&e.to_string(), &self.name, &self.text, span),
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
        let name = path.display().to_string();
        let source = Source { name, text: read_text(path, "model")?, is_json: is_json(path) };
        let read = if source.is_json { json::read(&source.text) } else { model_file::read(&source.text) };
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
