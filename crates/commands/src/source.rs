//! Schemes and models as texts: their kind follows from the content, and errors have their place in the text.

use std::ops::Range;
use std::path::Path;

use obsdeg_core::model::{Scheme, scheme_file};
use obsdeg_core::system::{ModelError, SystemModel, json, model_file};
use obsdeg_evidence::system::RunError;
use serde::{Deserialize, Serialize};

use crate::problem::Problem;

/// Text of a scheme or a model.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// Name of the text, such as the path of its file as given.
    #[serde(default)]
    pub name: String,
    /// Content: TOML, or JSON of a model.
    pub text: String,
    /// Kind that the content must be of.
    #[serde(default)]
    pub must_be: Expected,
}

/// Kind that a text must be of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Expected {
    /// A scheme or a model.
    #[default]
    Any,
    /// A scheme.
    Scheme,
    /// A model.
    Model,
}

/// Scheme or model to judge.
#[derive(Debug, Clone)]
pub enum Input {
    /// Torquing scheme.
    Scheme(Box<Scheme>),
    /// Any system.
    Model(Box<ModelWithText>),
}

/// Input with its name, which is empty for angles of the command line.
pub type NamedInput = (String, Input);

/// Model with the text that it was read from.
#[derive(Debug, Clone)]
pub struct ModelWithText {
    /// The model.
    pub model: SystemModel,
    source: Source,
}

impl ModelWithText {
    /// Problem of a model's error, with its place in the text.
    pub fn wrong(&self, e: &ModelError) -> Problem {
        self.source.wrong(&e.to_string(), e.span.clone())
    }

    /// Problem of an error in a run of the model.
    pub(crate) fn wrong_run(&self, e: &RunError) -> Problem {
        match e {
            RunError::Model(e) => self.wrong(e),
            RunError::Filter { .. } => self.source.wrong(&e.to_string(), None),
        }
    }
}

impl Source {
    /// Text of a scheme or a model.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: text.into(), must_be: Expected::Any }
    }

    /// Reads the scheme or the model in the text.
    ///
    /// # Errors
    /// Defect of the content, with its place.
    pub fn read(self) -> Result<NamedInput, Problem> {
        self.refuse_foreign()?;
        let name = self.name.clone();
        let input = match self.must_be {
            Expected::Any if self.is_model() => Input::Model(Box::new(self.model()?)),
            Expected::Model => Input::Model(Box::new(self.model()?)),
            Expected::Any | Expected::Scheme => Input::Scheme(Box::new(self.scheme()?)),
        };
        Ok((name, input))
    }

    /// Reads the scheme in the text.
    ///
    /// # Errors
    /// Defect of the content, with its place.
    pub fn scheme(&self) -> Result<Scheme, Problem> {
        scheme_file::read(&self.text).map_err(|e| match self.is_model() {
            true => Problem::input(format!(
                "{} is a model file; expected a scheme file, with [[position]] tables",
                self.name
            )),
            false => self.wrong(&e.message, e.span),
        })
    }

    /// Reads the model in the text.
    fn model(self) -> Result<ModelWithText, Problem> {
        let read = if self.is_json() { json::read(&self.text) } else { model_file::read(&self.text) };
        match read {
            Ok(model) => Ok(ModelWithText { model, source: self }),
            Err(_) if scheme_file::is_scheme(&self.text) => Err(Problem::input(format!(
                "{} is a scheme file; expected a model file, with [states] and [outputs]",
                self.name
            ))),
            Err(e) => Err(self.wrong(&e.to_string(), e.span)),
        }
    }

    /// Refuses a model of another tool; the message has the line of Python that judges it.
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

    /// True if the text is meant as a model: JSON, or TOML with keys of a model.
    pub(crate) fn is_model(&self) -> bool {
        self.is_json() || model_file::is_model(&self.text)
    }

    /// True if the text is JSON: no TOML begins with a brace. A text that neither begins with one nor has
    /// keys of a scheme or a model in TOML is judged by its name.
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

/// File name without its ending; for `scheme.toml` the name of its folder.
pub fn title(name: &str) -> String {
    let path = Path::new(name);
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    let folder = path.parent().and_then(Path::file_name).filter(|_| stem == "scheme");
    folder.unwrap_or(stem).to_string_lossy().into_owned()
}
