//! Model files: TOML, with errors that state their place.

mod entries;
mod layout;

use serde_spanned::Spanned;
use toml::Value;

use super::error::ModelError;
use super::model::{
    AlgebraicEquation, MAX_EXPERIMENTS, PlacedExpression, StartTime, State, SystemModel, check_signs,
};
use super::nominal::nominal;
use super::reader::{ModelEntry, ModelReader, base, in_order, last_mention};
use crate::language::file_error::explain;
use crate::language::{Shape, Shapes};
use crate::model::recording::{ModelRecord, Recording};
use crate::title_block::TitleBlock;

pub use layout::{ExperimentEntry, ModelFile, SegmentEntry};

impl ModelReader<'_> {
    /// Title block of the review, if it is right.
    fn title_block(&self, file: &ModelFile) -> Result<TitleBlock, ModelError> {
        let Some(document) = &file.document else { return Ok(TitleBlock::default()) };
        match document.get_ref().wrong() {
            Some(message) => Err(self.at(document.span(), "the title block".into(), message)),
            None => Ok(document.get_ref().clone()),
        }
    }

    fn number_of_experiments(&self, file: &ModelFile) -> Result<usize, ModelError> {
        let given = file.experiments.as_ref();
        if let Some(number) = given.filter(|n| !(1..=MAX_EXPERIMENTS).contains(n.get_ref())) {
            let message = format!("expected 1 to {MAX_EXPERIMENTS}");
            return Err(self.at(number.span(), "experiments".into(), message));
        }
        let own = file.own.len();
        if own == 0 {
            return Ok(given.map_or(1, |n| *n.get_ref()));
        }
        if let Some(number) = given.filter(|n| *n.get_ref() != own) {
            let message =
                format!("{}, and {own} [[experiment]]; expected as many, or no number", number.get_ref());
            return Err(self.at(number.span(), "experiments".into(), message));
        }
        if own > MAX_EXPERIMENTS {
            let message = format!("{own} [[experiment]]; expected at most {MAX_EXPERIMENTS}");
            return Err(ModelError { what: "experiments".into(), message, span: None });
        }
        Ok(own)
    }

    /// States, parameters, inputs, constants and definitions.
    fn quantities(&mut self, file: &ModelFile, model: &mut SystemModel) -> Result<(), ModelError> {
        // sizes first: expressions may use names that are declared later
        let (states, known, unknown) =
            (in_order(&file.states), in_order(&file.known_inputs), in_order(&file.unknown_inputs));
        let algebraic = in_order(&file.algebraic);
        for (key, value) in states.iter().chain(&algebraic).chain(&known).chain(&unknown) {
            self.declare(key, value.span())?;
        }
        if let Some(parameters) = &file.parameters {
            model.parameters = self.parameters(parameters)?;
        }
        let (constants, definitions) = (in_order(&file.constants), in_order(&file.definitions));
        let all: [&[ModelEntry<'_>]; 6] = [&states, &algebraic, &known, &unknown, &constants, &definitions];
        self.names_of_their_own(&all, &model.parameters)?;
        for (key, value) in self.by_use("the constant", &constants)? {
            model.constants.extend(self.constants(key, value)?);
        }
        for (key, value) in self.by_use("the definition of", &definitions)? {
            let what = format!("the definition of {}", base(key));
            let (name, parts) = self.defined((key, &what), value.get_ref(), value.span())?;
            model.definitions.extend(self.entries(name).into_iter().zip(parts));
        }
        for (key, value) in states {
            model.states.extend(self.states(base(key), value)?);
        }
        for (key, value) in algebraic {
            if value.get_ref().as_table().is_some_and(|t| t.contains_key("initial")) {
                let message = "a start of an algebraic unknown; expected none, since its equation gives it";
                return Err(self.at(value.span(), format!("the equation of {}", base(key)), message.into()));
            }
            let equation = |s: State| AlgebraicEquation { named: s.named, equation: s.equation };
            model.algebraic.extend(self.states(base(key), value)?.into_iter().map(equation));
        }
        for (key, value) in known {
            model.known_inputs.extend(self.known_inputs(base(key), value)?);
        }
        for (key, value) in unknown {
            model.unknown_inputs.extend(self.unknown_inputs(base(key), value)?);
        }
        Ok(())
    }

    /// Outputs; returns their shapes.
    fn outputs(&self, file: &ModelFile, model: &mut SystemModel) -> Result<Shapes, ModelError> {
        let mut shapes = Shapes::new();
        for (key, value) in in_order(&file.outputs) {
            let (named, found) = self.output(key, value)?;
            shapes.insert(base(key).into(), found.shape);
            model.outputs.extend(named.into_iter().zip(found.parts));
        }
        Ok(shapes)
    }

    /// Constraints and combinations.
    fn conditions(&self, file: &ModelFile, model: &mut SystemModel) -> Result<(), ModelError> {
        for c in &file.constraints {
            let (constraints, not_negative) = self.constraint(c)?;
            model.constraints.extend(constraints);
            model.not_negative.extend(not_negative);
        }
        for c in &file.combinations {
            let what = format!("the combination {}", c.get_ref());
            let found = self.formulas(&what, &Value::String(c.get_ref().clone()), c.span())?;
            let whole = format!("({})", c.get_ref().trim());
            let texts = match found.shape {
                Shape::SCALAR => vec![c.get_ref().clone()],
                shape => shape.names(&whole),
            };
            let entries = found.parts.into_iter().zip(texts);
            model.combinations.extend(entries.map(|(part, text)| PlacedExpression { text, ..part }));
        }
        Ok(())
    }

    /// Reading of the records, of known inputs and outputs of the model only.
    fn recording(&self, record: &Spanned<ModelRecord>, model: &SystemModel) -> Result<Recording, ModelError> {
        let inputs: Vec<&str> = model.known_inputs.iter().map(|i| i.0.name.as_str()).collect();
        let outputs: Vec<&str> = model.outputs.iter().map(|o| o.0.name.as_str()).collect();
        let wrong = |message| self.at(record.span(), "the record".into(), message);
        let recording = Recording::from(record.get_ref().clone());
        recording.check_model(&inputs, &outputs).map_err(wrong)?;
        Ok(recording)
    }
}

/// True if a text is meant as a model, not a scheme.
pub fn is_model(text: &str) -> bool {
    text.lines().map(str::trim_start).any(|l| l.starts_with("[states") || l.starts_with("[outputs"))
}

/// Reads a model.
///
/// # Errors
/// [`ModelError`] with the byte range of the fault, if it is known.
pub fn read(text: &str) -> Result<SystemModel, ModelError> {
    check_signs(text)?;
    let file: ModelFile = toml::from_str(text).map_err(|e| {
        let (message, span) = explain::<ModelFile>(text, &e);
        ModelError { what: "the model file".into(), message, span }
    })?;
    let mut r = ModelReader { text, shapes: Shapes::new() };
    let mut model = SystemModel {
        name: file.name.clone().unwrap_or_default(),
        description: file.description.clone(),
        discrete: file.discrete,
        document: r.title_block(&file)?,
        experiments: r.number_of_experiments(&file)?,
        ..SystemModel::default()
    };
    r.quantities(&file, &mut model)?;
    for (i, own) in file.own.iter().enumerate() {
        model.own.push(r.experiment(i, own, &model)?);
    }
    let outputs = r.outputs(&file, &mut model)?;
    for (i, segment) in file.segments.iter().enumerate() {
        model.segments.push(r.segment(i, segment)?);
    }
    model.time = file.time.as_ref().map_or(Ok(StartTime::Zero), |time| r.time(time))?;
    r.conditions(&file, &mut model)?;
    let mut model = model.without_algebraic().map_err(|e| placed(text, e))?;
    model.candidates = r.file_candidates(&in_order(&file.candidates))?;
    model.check_candidates()?;
    nominal(&r, &outputs, &file.simulation, &mut model)?;
    if let Some(record) = &file.record {
        model.recording = r.recording(record, &model)?;
    }
    check_whole(text, file.name.is_some(), &model)?;
    Ok(model.by_one_factor())
}

/// Error with the place of the last mention of its subject, if it has none.
fn placed(text: &str, e: ModelError) -> ModelError {
    ModelError { span: e.span.clone().or_else(|| last_mention(text, &e.what)), ..e }
}

/// Checks that concern the model as a whole. Errors without a place get that of the last mention of their
/// subject.
fn check_whole(text: &str, is_named: bool, model: &SystemModel) -> Result<(), ModelError> {
    let placed = |e: ModelError| placed(text, e);
    model.check().map_err(placed)?;
    if !model.candidates.is_empty() {
        model.measuring(&model.candidates, true).0.checked().map_err(placed)?;
    }
    // the missing name concerns no equation: faults of these are reported first
    if !is_named {
        model.checked().map_err(placed)?;
        return Err(ModelError {
            what: "the model file".into(),
            message: "the key `name` is missing; expected it at the top of the file".into(),
            span: Some(0..text.chars().next().map_or(0, char::len_utf8)),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::entries::Places;
    use super::*;

    /// Parameters keep the order of their lines or of the inline table, for keys of every kind; the time for
    /// many parameters does not grow with their square.
    #[test]
    fn parameters_keep_the_order_of_the_file() {
        let order = |parameters: &str| {
            let text = format!("name = \"m\"\n{parameters}\n[states]\nx = \"-x\"\n[outputs]\ny = \"x\"\n");
            let model = read(&text).expect("a model");
            model.parameters.iter().map(|p| p.name.clone()).collect::<Vec<_>>().join(" ")
        };
        let tables = [
            ("[parameters]\nzeta = {}\nb = {}\n  a.unit = \"1/h\"\n\"c\" = {}\n'd' = {}", "d zeta b a c"),
            ("parameters = { zeta = {}, b = { unit = \"a\" }, a2 = {}, a = {} }", "zeta b a a2"),
            ("parameters = { \"v[2]\" = {}, 'b' = {}, a = {} }", "v[1] v[2] b a"),
            ("[parameters]\nb = {}\n\"v[2]\" = {}\na = {}", "b v[1] v[2] a"),
            ("parameters = [\"z\", \"a\"]", "z a"),
        ];
        for (text, expected) in tables {
            assert_eq!(order(text), expected, "{text}");
        }
        let names: Vec<String> =
            (0..20_000u32).map(|i| format!("p{}", i.wrapping_mul(7919) % 20_011)).collect();
        let places = |text: &str| {
            let places = Places::of(text, text.len());
            let mut sorted: Vec<&String> = names.iter().collect();
            sorted.sort_unstable();
            sorted.sort_by_cached_key(|n| places.of_key(n));
            sorted.into_iter().eq(&names)
        };
        assert!(places(&names.iter().map(|n| format!("{n} = {{}}\n")).collect::<String>()));
        assert!(places(&format!(
            "{{ {} }}",
            names.iter().map(|n| format!("{n} = {{}}")).collect::<Vec<_>>().join(", ")
        )));
    }
}
