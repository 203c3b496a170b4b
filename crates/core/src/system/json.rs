//! Models as JSON objects: `states`, `params`, `equations`, `outputs` and what else there is to say.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::model::{
    Constant, Formula, KnownInput, MAX_DEGREE, MAX_EXPERIMENTS, ModelError, Named, Place, Segment, Start,
    State, SystemModel,
};
use crate::model::expression::{Names, parse_with};

/// The layout; keys that are not listed are left alone.
#[derive(Debug, Deserialize)]
struct Layout {
    name: String,
    #[serde(default)]
    description: String,
    states: Vec<String>,
    #[serde(default)]
    params: Vec<String>,
    equations: BTreeMap<String, String>,
    outputs: serde_json::Map<String, serde_json::Value>,
    #[serde(default)]
    known_inputs: Vec<String>,
    #[serde(default)]
    unknown_inputs: Vec<String>,
    /// Absent: arbitrary, as null.
    #[serde(default)]
    unknown_input_max_derivative: Option<usize>,
    #[serde(default)]
    known_constants: Vec<String>,
    #[serde(default)]
    input_assumption: BTreeMap<String, String>,
    #[serde(default)]
    known_initial_values: BTreeMap<String, String>,
    #[serde(default)]
    known_initial_conditions: Vec<String>,
    #[serde(default)]
    experiments: Option<usize>,
    #[serde(default)]
    segments: Vec<BTreeMap<String, String>>,
    #[serde(default)]
    segment_constants: Vec<String>,
    #[serde(default)]
    observable_combinations: Vec<String>,
}

fn named(name: &str) -> Named {
    Named { name: name.into(), ..Named::default() }
}

fn formula(what: String, text: &str) -> Result<Formula, ModelError> {
    let place = Place { what, offset: None };
    let expression = parse_with(text, Names::Plain)
        .map_err(|e| place.error(format!("{e}, in `{}`", cut(text)), e.span()))?;
    Ok(Formula { text: text.into(), expression, place })
}

/// What fits into a message.
fn cut(text: &str) -> String {
    let short: String = text.chars().take(60).collect();
    if short.len() < text.len() { format!("{short}...") } else { short }
}

/// Reads a model.
///
/// # Errors
/// [`ModelError`] naming the key.
pub fn read(text: &str) -> Result<SystemModel, ModelError> {
    let refuse = |what: &str, message: String| ModelError { what: what.into(), message, span: None };
    let layout: Layout = serde_json::from_str(text).map_err(|e| refuse("the model", e.to_string()))?;
    let experiments = layout.experiments.unwrap_or(1);
    if !(1..=MAX_EXPERIMENTS).contains(&experiments) {
        return Err(refuse("experiments", format!("{experiments}; expected 1 to {MAX_EXPERIMENTS}")));
    }
    if let Some(found) = layout.unknown_input_max_derivative.filter(|d| *d > MAX_DEGREE) {
        let message = format!("{found}; expected at most {MAX_DEGREE}");
        return Err(refuse("unknown_input_max_derivative", message));
    }
    let known = |name: &String, list: &[String]| list.contains(name);
    if let Some(name) = layout.equations.keys().find(|n| !known(n, &layout.states)) {
        return Err(refuse("equations", format!("`{name}` is no state")));
    }
    let mut model = SystemModel {
        name: layout.name.clone(),
        description: layout.description.clone(),
        parameters: layout.params.iter().map(|p| named(p)).collect(),
        experiments,
        ..SystemModel::default()
    };
    for state in &layout.states {
        let text = layout.equations.get(state);
        let text = text.ok_or_else(|| refuse("equations", format!("`{state}` has none; expected one")))?;
        let start = match layout.known_initial_values.get(state) {
            Some(value) => Start::Value(formula(format!("the initial value of {state}"), value)?),
            None if known(state, &layout.known_initial_conditions) => Start::Known,
            None => Start::Unknown,
        };
        let equation = formula(format!("the equation of {state}"), text)?;
        model.states.push(State { named: named(state), equation, start });
    }
    for (name, text) in &layout.outputs {
        let text = text.as_str().ok_or_else(|| refuse("outputs", format!("`{name}` is no text")))?;
        model.outputs.push((named(name), formula(format!("the output {name}"), text)?));
    }
    for input in &layout.known_inputs {
        let kind = match layout.input_assumption.get(input).map(String::as_str) {
            None => KnownInput::Generic,
            Some("constant") => KnownInput::Polynomial(0),
            Some(other) => {
                return Err(refuse("input_assumption", format!("`{other}`; expected constant")));
            }
        };
        model.known_inputs.push((named(input), kind));
    }
    let degree = layout.unknown_input_max_derivative;
    // absent as a key: the signal itself is constant in none of the models, so arbitrary
    model.unknown_inputs = layout.unknown_inputs.iter().map(|u| (named(u), degree)).collect();
    let constants = layout.known_constants.iter().chain(&layout.segment_constants);
    model.constants = constants.map(|c| (named(c), Constant::Generic)).collect();
    for segment in &layout.segments {
        let constants = segment.iter().map(|(name, value)| {
            Ok((name.clone(), formula(format!("the value of {name} in a segment"), value)?))
        });
        model
            .segments
            .push(Segment { constants: constants.collect::<Result<_, ModelError>>()?, carry: Vec::new() });
    }
    for text in &layout.observable_combinations {
        model.combinations.push(formula(format!("the combination {text}"), text)?);
    }
    Ok(model)
}
