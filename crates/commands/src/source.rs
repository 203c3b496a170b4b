//! What is read: a scheme or a model, told apart by what it says; its errors have their place in its text.

use std::ops::Range;
use std::path::Path;

use obsdeg_core::model::{Scheme, scheme_file};
use obsdeg_core::system::{ModelError, SystemModel, json, model_file};
use obsdeg_evidence::system::RunError;
use serde::{Deserialize, Serialize};

use crate::problem::Problem;

/// A text with a scheme or a model.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// What it is called, a file's name as it was given.
    #[serde(default)]
    pub name: String,
    /// All that it says: TOML, or JSON of a model.
    pub text: String,
    /// What it must be.
    #[serde(default)]
    pub must_be: Expected,
}

/// What a text must be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Expected {
    /// Either.
    #[default]
    Any,
    /// A scheme.
    Scheme,
    /// A model.
    Model,
}

/// What is judged.
#[derive(Debug, Clone)]
pub enum Input {
    /// A torquing scheme.
    Scheme(Box<Scheme>),
    /// Any system.
    Model(Box<ModelFile>),
}

/// What was read, with its name (none for angles).
pub type Named = (String, Input);

/// A model with the text it came from.
#[derive(Debug, Clone)]
pub struct ModelFile {
    /// The model.
    pub model: SystemModel,
    source: Source,
}

impl ModelFile {
    /// What is wrong with the model.
    pub fn wrong(&self, e: &ModelError) -> Problem {
        self.source.wrong(&e.to_string(), e.span.clone())
    }

    /// What is wrong with a run of it.
    pub fn wrong_run(&self, e: &RunError) -> Problem {
        match e {
            RunError::Model(e) => self.wrong(e),
            RunError::Filter { .. } => self.source.wrong(&e.to_string(), None),
        }
    }
}

impl Source {
    /// A text that is either.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: text.into(), must_be: Expected::Any }
    }

    /// The scheme or the model that it is, with its name.
    ///
    /// # Errors
    /// What is wrong with it, at its place.
    pub fn read(self) -> Result<Named, Problem> {
        self.refuse_foreign()?;
        let name = self.name.clone();
        let input = match self.must_be {
            Expected::Any if self.is_model() => Input::Model(Box::new(self.model()?)),
            Expected::Model => Input::Model(Box::new(self.model()?)),
            Expected::Any | Expected::Scheme => Input::Scheme(Box::new(self.scheme()?)),
        };
        Ok((name, input))
    }

    /// The scheme.
    ///
    /// # Errors
    /// What is wrong with it, at its place.
    pub fn scheme(&self) -> Result<Scheme, Problem> {
        scheme_file::read(&self.text).map_err(|e| match self.is_model() {
            true => Problem::input(format!(
                "{} is a model file; expected a scheme file, with [[position]] tables",
                self.name
            )),
            false => self.wrong(&e.message, e.span),
        })
    }

    /// The model.
    fn model(self) -> Result<ModelFile, Problem> {
        let read = if self.is_json() { json::read(&self.text) } else { model_file::read(&self.text) };
        match read {
            Ok(model) => Ok(ModelFile { model, source: self }),
            Err(_) if scheme_file::is_scheme(&self.text) => Err(Problem::input(format!(
                "{} is a scheme file; expected a model file, with [states] and [outputs]",
                self.name
            ))),
            Err(e) => Err(self.wrong(&e.to_string(), e.span)),
        }
    }

    /// Refuses a model of another tool, with the line of Python that judges it.
    fn refuse_foreign(&self) -> Result<(), Problem> {
        let ending = Path::new(&self.name).extension().map(|e| e.to_string_lossy().to_lowercase());
        let by_ending = match ending.as_deref() {
            Some("jl") => Some("@ODEmodel of StructuralIdentifiability.jl"),
            Some("xml" | "sbml") => Some("SBML"),
            Some("m") => Some("a script of STRIKE-GOLDD"),
            Some("yaml" | "yml") => Some("a PEtab problem"),
            _ => None,
        };
        let by_text = match &self.text {
            text if text.contains("@ODEmodel") => Some("@ODEmodel of StructuralIdentifiability.jl"),
            text if text.trim_start().starts_with('<') => Some("SBML"),
            _ => None,
        };
        let own = || self.is_json() || scheme_file::is_scheme(&self.text) || model_file::is_model(&self.text);
        let Some(kind) = by_text.or(by_ending).filter(|_| !own()) else { return Ok(()) };
        let plain = |c: char| c.is_alphanumeric() || "/._- +~@:".contains(c);
        let name = if self.name.chars().all(plain) && !self.name.is_empty() { &self.name } else { "FILE" };
        Err(Problem::input(format!(
            "{} seems to be {kind}; expected a scheme (TOML) or a model (TOML, JSON). The Python package \
             imports it: python -c 'import obsdeg; print(obsdeg.analyze(obsdeg.load(\"{name}\")))'",
            self.name
        )))
    }

    /// True if it is meant as a model, which may be JSON.
    pub(crate) fn is_model(&self) -> bool {
        self.is_json() || model_file::is_model(&self.text)
    }

    /// True if it is JSON: no TOML begins with a brace. What neither begins so nor is meant as a scheme or a
    /// model in TOML is what its name says.
    fn is_json(&self) -> bool {
        let toml = || scheme_file::is_scheme(&self.text) || model_file::is_model(&self.text);
        let named = Path::new(&self.name).extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        self.text.trim_start().starts_with('{') || named && !toml()
    }

    fn wrong(&self, message: &str, span: Option<Range<usize>>) -> Problem {
        match span {
            Some(span) => Problem::at(message, &self.name, &self.text, span),
            None if self.name.is_empty() => Problem::input(message),
            None => Problem::input(format!("{}: {message}", self.name)),
        }
    }
}

/// A file's name without its ending; the folder's for a `scheme.toml`.
pub fn title(name: &str) -> String {
    let path = Path::new(name);
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    let folder = path.parent().and_then(Path::file_name).filter(|_| stem == "scheme");
    folder.unwrap_or(stem).to_string_lossy().into_owned()
}
