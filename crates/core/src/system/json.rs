//! Models as JSON objects: `states`, `params`, `equations`, `outputs` and optional keys.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use serde_json::value::RawValue;

use super::error::FilePlace;
use super::error::ModelError;
use super::model::{
    Constant, KnownInput, MAX_DEGREE, MAX_EXPERIMENTS, ModelSegment, Named, PlacedExpression, State,
    StateStart, SystemModel, check_signs,
};
use crate::language::file_error::{explain_message, json_kind};
use crate::language::{Names, parse_with};
use crate::model::angle::excerpt;

/// Model as a JSON object; other keys are ignored.
#[derive(Debug, Deserialize)]
struct JsonModel {
    name: String,
    #[serde(default)]
    description: String,
    states: Vec<String>,
    #[serde(default)]
    params: Vec<String>,
    equations: BTreeMap<String, PlacedText>,
    outputs: Outputs,
    #[serde(default)]
    known_inputs: Vec<String>,
    #[serde(default)]
    unknown_inputs: Vec<String>,
    /// Highest derivative of unknown inputs; missing or null: arbitrary.
    #[serde(default)]
    unknown_input_max_derivative: Option<usize>,
    #[serde(default)]
    known_constants: Vec<String>,
    #[serde(default)]
    input_assumption: BTreeMap<String, PlacedText>,
    #[serde(default)]
    known_initial_values: BTreeMap<String, PlacedText>,
    #[serde(default)]
    known_initial_conditions: Vec<String>,
    #[serde(default)]
    experiments: Option<usize>,
    #[serde(default)]
    segments: Vec<BTreeMap<String, PlacedText>>,
    #[serde(default)]
    segment_constants: Vec<String>,
    #[serde(default)]
    observable_combinations: Vec<PlacedText>,
}

/// Text with its address in the memory of the file.
#[derive(Debug)]
struct PlacedText {
    text: String,
    address: usize,
    length: usize,
}

impl<'de> Deserialize<'de> for PlacedText {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let raw = <&RawValue>::deserialize(deserializer)?.get();
        let text = serde_json::from_str(raw)
            .map_err(|_| D::Error::custom(format!("found {}; expected a text in quotes", json_kind(raw))))?;
        Ok(Self { text, address: raw.as_ptr().addr(), length: raw.len() })
    }
}

/// Outputs in the order of the file.
#[derive(Debug)]
struct Outputs(Vec<(String, PlacedText)>);

impl<'de> Deserialize<'de> for Outputs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder;
        impl<'de> serde::de::Visitor<'de> for InOrder {
            type Value = Outputs;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }
            fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<Outputs, A::Error> {
                let mut out: Vec<(String, PlacedText)> = Vec::new();
                while let Some((name, text)) = map.next_entry()? {
                    out.retain(|(n, _)| *n != name);
                    out.push((name, text));
                }
                Ok(Outputs(out))
            }
        }
        deserializer.deserialize_map(InOrder)
    }
}

/// Text of the file.
struct JsonFile<'a>(&'a str);

impl JsonFile<'_> {
    /// Byte range of a text in the file, with its quotes.
    fn span(&self, text: &PlacedText) -> Option<Range<usize>> {
        let start = text.address.checked_sub(self.0.as_ptr().addr())?;
        (start + text.length <= self.0.len()).then_some(start..start + text.length)
    }

    fn formula(&self, what: String, text: &PlacedText) -> Result<PlacedExpression, ModelError> {
        let span = self.span(text);
        // a text without escapes is the same in the file
        let plain = |s: &Range<usize>| self.0.get(s.start + 1..s.end - 1) == Some(text.text.as_str());
        let place = FilePlace { what, offset: span.clone().filter(plain).map(|s| s.start + 1) };
        let expression = parse_with(&text.text, Names::Plain).map_err(|e| {
            let mut error = place.error(e.to_string(), e.span());
            error.span = error.span.or(span);
            error
        })?;
        Ok(PlacedExpression { text: text.text.clone(), expression, place })
    }

    /// Error in the value of a key, at its first occurrence in quotes.
    fn refuse(&self, key: &str, message: String) -> ModelError {
        let span = self.0.find(&format!("\"{key}\"")).map(|at| at..at + key.len() + 2);
        ModelError { what: key.into(), message, span }
    }

    /// Checks numbers, and that equations are those of states.
    fn check(&self, layout: &JsonModel, experiments: usize) -> Result<(), ModelError> {
        if !(1..=MAX_EXPERIMENTS).contains(&experiments) {
            return Err(self.refuse("experiments", format!("{experiments}; expected 1 to {MAX_EXPERIMENTS}")));
        }
        if let Some(found) = layout.unknown_input_max_derivative.filter(|d| *d > MAX_DEGREE) {
            let message = format!("{found}; expected at most {MAX_DEGREE}");
            return Err(self.refuse("unknown_input_max_derivative", message));
        }
        if let Some(name) = layout.equations.keys().find(|n| !layout.states.contains(n)) {
            return Err(self.refuse("equations", format!("`{name}` is no state")));
        }
        Ok(())
    }

    fn states(&self, layout: &JsonModel) -> Result<Vec<State>, ModelError> {
        let mut out = Vec::new();
        for state in &layout.states {
            let text = layout.equations.get(state);
            let text =
                text.ok_or_else(|| self.refuse("equations", format!("`{state}` has none; expected one")))?;
            let start = match layout.known_initial_values.get(state) {
                Some(value) => {
                    StateStart::Value(self.formula(format!("the initial value of {state}"), value)?)
                }
                None if layout.known_initial_conditions.contains(state) => StateStart::Known,
                None => StateStart::Unknown,
            };
            let equation = self.formula(format!("the equation of {state}"), text)?;
            out.push(State { named: named(state), equation, start });
        }
        Ok(out)
    }

    fn known_inputs(&self, layout: &JsonModel) -> Result<Vec<(Named, KnownInput)>, ModelError> {
        let mut out = Vec::new();
        for input in &layout.known_inputs {
            let kind = match layout.input_assumption.get(input).map(|t| t.text.as_str()) {
                None => KnownInput::Generic,
                Some("constant") => KnownInput::Polynomial(0),
                Some(other) => {
                    return Err(self.refuse("input_assumption", format!("`{other}`; expected constant")));
                }
            };
            out.push((named(input), kind));
        }
        Ok(out)
    }

    /// Error for a message of the JSON reader, which states its place after the fault.
    fn refused(&self, e: &serde_json::Error) -> ModelError {
        let message = e.to_string();
        let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(m, _)| m);
        let line = self.0.split_inclusive('\n').take(e.line().saturating_sub(1)).map(str::len).sum::<usize>();
        let end = (line + e.column()).min(self.0.len());
        let before = self.0.get(..end).unwrap_or("");
        // go back over the token that ends here
        let start = match before.strip_suffix('"') {
            Some(inner) => inner.rfind('"').unwrap_or(0),
            None => before.trim_end_matches(|c: char| c.is_alphanumeric() || "-+.".contains(c)).len(),
        };
        let start = if start == before.len() {
            before.char_indices().next_back().map_or(0, |(i, _)| i)
        } else {
            start
        };
        ModelError {
            what: "the model file".into(),
            message: explain_message(message),
            span: Some(start..before.len()),
        }
    }
}

fn named(name: &str) -> Named {
    Named { name: name.into(), ..Named::default() }
}

/// Reads a model.
///
/// # Errors
/// [`ModelError`] with the byte range of the fault, if it is known.
pub fn read(text: &str) -> Result<SystemModel, ModelError> {
    check_signs(text)?;
    let file = JsonFile(text);
    let layout: JsonModel = serde_json::from_str(text).map_err(|e| file.refused(&e))?;
    let experiments = layout.experiments.unwrap_or(1);
    file.check(&layout, experiments)?;
    let mut model = SystemModel {
        name: layout.name.clone(),
        description: layout.description.clone(),
        parameters: layout.params.iter().map(|p| named(p)).collect(),
        experiments,
        states: file.states(&layout)?,
        ..SystemModel::default()
    };
    for (name, text) in &layout.outputs.0 {
        model.outputs.push((named(name), file.formula(format!("the output {name}"), text)?));
    }
    model.known_inputs = file.known_inputs(&layout)?;
    let degree = layout.unknown_input_max_derivative;
    // a missing key means arbitrary: in no model is the signal itself constant
    model.unknown_inputs = layout.unknown_inputs.iter().map(|u| (named(u), degree)).collect();
    let constants = layout.known_constants.iter().chain(&layout.segment_constants);
    model.constants = constants.map(|c| (named(c), Constant::Generic)).collect();
    for segment in &layout.segments {
        let constants = segment.iter().map(|(name, value)| {
            Ok((name.clone(), file.formula(format!("the value of {name} in a segment"), value)?))
        });
        model.segments.push(ModelSegment {
            constants: constants.collect::<Result<_, ModelError>>()?,
            carry: Vec::new(),
        });
    }
    for text in &layout.observable_combinations {
        model.combinations.push(file.formula(format!("the combination {}", excerpt(&text.text)), text)?);
    }
    Ok(model)
}
