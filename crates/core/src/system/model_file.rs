//! Model files: TOML, with errors that state their place.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_spanned::Spanned;
use toml::Value;

use super::error::ModelError;
use super::model::{
    AlgebraicEquation, Constant, ExperimentChanges, KnownInput, MAX_DEGREE, MAX_EXPERIMENTS, ModelSegment,
    Named, PlacedExpression, StartTime, State, StateStart, SystemModel, check_signs,
};
use super::nominal::{SimulationEntry, nominal};
use super::reader::{Formulas, ModelEntry, ModelReader, base, declared, in_order, last_mention};
use crate::language::file_error::explain;
use crate::language::{Node, Shape, Shapes, nearest, parse};
use crate::model::recording::{ModelRecord, Recording};
use crate::title_block::TitleBlock;

/// Layout of a model file. Expressions are texts with `+ - * / ^`, brackets, decimals (exact),
/// `sin cos tan asin acos atan atan2 exp log sqrt tanh abs sign`, `pi`, `deg` and the names of the model; `t`
/// is the time. A name such as `"p[3]"` declares a vector, `"C[3,3]"` a matrix: `p` stands for the whole and
/// `p[1]`, `C[1,2]` for its entries, in expressions and in the answer. `[a, b]` makes a vector of scalars and
/// a matrix of rows. `cross dot norm transpose skew`, of quaternions (w, x, y, z) `R qmul conj qdot`, and the
/// turns `Rx Ry Rz` take them. Constants, definitions and outputs have the shape of their expression.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// Name of the system in answers and reports.
    #[schemars(required)]
    name: Option<String>,
    /// Purpose and source of the system, printed in reports.
    #[serde(default)]
    description: String,
    /// Title block of the review: reference, revision, date, author, and the roles that sign.
    #[serde(default)]
    #[schemars(with = "Option<TitleBlock>")]
    document: Option<Spanned<TitleBlock>>,
    /// True for a model in discrete time: the equation of a state is its value one step later,
    /// `x = "a*x"` for `x[t+1] = a x[t]`, and degrees count steps. `analyze` judges such models; the other
    /// commands refuse them.
    #[serde(default)]
    discrete: bool,
    /// States: the derivative, `x = "-a*x"`, or a table with equation, initial ("known", or an exact value),
    /// unit, description. If there are none, the outputs depend on parameters and inputs alone.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    states: BTreeMap<String, Spanned<Value>>,
    /// Algebraic unknowns, each with an expression that is zero, `v = "R*i - v"`, or a table with equation,
    /// unit, description. Together the equations determine them (index 1); they hold + - * / and whole powers
    /// of states, algebraic unknowns, parameters, constants and known inputs.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    algebraic: BTreeMap<String, Spanned<Value>>,
    /// Unknown constants: a list of names, or tables with unit and description.
    #[serde(default)]
    #[schemars(with = "serde_json::Value")]
    parameters: Option<Spanned<Value>>,
    /// Known inputs: "generic", "constant", { polynomial = degree }, { function = "sin(2*t)" }.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    known_inputs: BTreeMap<String, Spanned<Value>>,
    /// Unknown inputs: "arbitrary" or { polynomial = degree }.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    unknown_inputs: BTreeMap<String, Spanned<Value>>,
    /// Known constants: "generic", or an exact value.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    constants: BTreeMap<String, Spanned<Value>>,
    /// Names for subexpressions, in any order.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    definitions: BTreeMap<String, Spanned<Value>>,
    /// Outputs: an expression, or a table with expression, unit, description.
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    outputs: BTreeMap<String, Spanned<Value>>,
    /// Number of experiments: runs with their own initial states and shared parameters; when left out, the
    /// number of `[[experiment]]` tables, or 1.
    #[serde(default)]
    #[schemars(with = "Option<usize>")]
    experiments: Option<Spanned<usize>>,
    /// Experiments one by one, with the constants and inputs that differ.
    #[serde(default, rename = "experiment")]
    own: Vec<ExperimentEntry>,
    /// Segments of the timeline, reached at once: constants = { c = "-1" }, carry = { x = "-x" } (states
    /// that jump).
    #[serde(default, rename = "segment")]
    segments: Vec<SegmentEntry>,
    /// Time t at which the run begins: a number (0 when left out), or "generic". Where equations or known
    /// inputs hold t, the first segment is judged at this time: verdicts at t = 0 may differ from those at
    /// any later time. Later segments are judged at a generic time.
    #[schemars(with = "Option<serde_json::Value>")]
    time: Option<Spanned<Value>>,
    /// Equations that hold at the start of every experiment, as `norm(q) = 1`. There must be a real point
    /// that meets them and at which their gradients are independent; where none is found, one near
    /// `simulation.values` is. Random starts lie on them, and their differentials are known.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    constraints: Vec<Spanned<String>>,
    /// Combinations of unknowns to be judged, as expressions.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    combinations: Vec<Spanned<String>>,
    /// Quantities that could be measured, for `obsdeg design`: an expression, or a table with expression (or
    /// `experiment = true`: the same outputs from another start), cost (1 when left out), unit, description.
    /// Candidates are no outputs of the model.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    candidates: BTreeMap<String, Spanned<Value>>,
    /// Numbers for `obsdeg simulate --model`, in the units of the model.
    #[serde(default)]
    simulation: SimulationEntry,
    /// Reading of the record of `obsdeg calibrate --model`: columns, known values and intervals at rest.
    #[schemars(with = "Option<ModelRecord>")]
    record: Option<Spanned<ModelRecord>>,
}

/// Experiment with constants or known inputs of its own.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExperimentEntry {
    /// Constants with another value in this experiment.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    constants: BTreeMap<String, Spanned<Value>>,
    /// Known inputs of another kind in this experiment.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    known_inputs: BTreeMap<String, Spanned<Value>>,
}

/// Segment of the timeline, with its own constants and jumps.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentEntry {
    /// Constants with another value in this segment.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    constants: BTreeMap<String, Spanned<Value>>,
    /// States after the jump, as expressions of those before.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    carry: BTreeMap<String, Spanned<Value>>,
}

impl ModelReader<'_> {
    /// Checks that a table has no other keys than the given ones.
    pub(super) fn known_keys(
        &self,
        what: &str,
        table: &toml::Table,
        span: &Range<usize>,
        keys: &[&str],
    ) -> Result<(), ModelError> {
        let Some(wrong) = table.keys().find(|k| !keys.contains(&k.as_str())) else { return Ok(()) };
        let known: Vec<String> = keys.iter().map(ToString::to_string).collect();
        let hint = nearest(wrong, &known).map(|h| format!("; did you mean `{h}`?")).unwrap_or_default();
        let message = format!("unknown key `{wrong}`{hint} (expected {})", keys.join(", "));
        let start = self.text[span.clone()].find(wrong.as_str()).map_or(span.start, |o| span.start + o);
        Err(self.at(start..start + wrong.len(), what.into(), message))
    }

    /// Name with unit and description from a table.
    pub(super) fn named(&self, name: &str, table: Option<&toml::Table>) -> Named {
        let text = |key: &str| {
            table.and_then(|t| t.get(key)).and_then(Value::as_str).unwrap_or_default().to_string()
        };
        Named { name: name.into(), unit: text("unit"), description: text("description") }
    }

    /// Names of the entries of `name`, each with unit and description of the whole.
    fn named_entries(&self, name: &str, table: Option<&toml::Table>) -> Vec<Named> {
        self.entries(name).iter().map(|n| self.named(n, table)).collect()
    }

    fn states(&self, name: &str, value: &Spanned<Value>) -> Result<Vec<State>, ModelError> {
        let (what, span) = (format!("the equation of {name}"), value.span());
        let table = value.get_ref().as_table();
        let (mut equation, mut initial) = (value.get_ref(), None);
        if let Some(table) = table {
            self.known_keys(&what, table, &span, &["equation", "initial", "unit", "description"])?;
            let none = || self.at(span.clone(), what.clone(), "no equation; expected one".into());
            equation = table.get("equation").ok_or_else(none)?;
            initial = table.get("initial");
        }
        let named = self.named_entries(name, table);
        let starts = match initial {
            None => vec![StateStart::Unknown; named.len()],
            Some(Value::String(s)) if s == "known" => vec![StateStart::Known; named.len()],
            Some(Value::String(s)) if s == "unknown" => vec![StateStart::Unknown; named.len()],
            Some(value) => {
                let what = format!("the initial value of {name}");
                let found = self.fitted((name, &what), value, span.clone())?;
                found.into_iter().map(StateStart::Value).collect()
            }
        };
        let equations = self.fitted((name, &what), equation, span)?;
        let state = |((named, equation), start)| State { named, equation, start };
        Ok(named.into_iter().zip(equations).zip(starts).map(state).collect())
    }

    /// Start time: `0`, `2.5` or `"generic"`.
    fn time(&self, entry: &Spanned<Value>) -> Result<StartTime, ModelError> {
        let text = match entry.get_ref() {
            Value::String(word) if word == "generic" => return Ok(StartTime::Generic),
            Value::Integer(n) => n.to_string(),
            Value::Float(x) => x.to_string(),
            _ => String::new(),
        };
        let (negative, digits) = text.strip_prefix('-').map_or((1, text.as_str()), |rest| (-1, rest));
        match parse(digits).map(|e| e.nodes) {
            Ok(nodes) => match nodes[..] {
                [Node::Number { mantissa: 0, .. }] => Ok(StartTime::Zero),
                [Node::Number { mantissa, decimals }] => {
                    Ok(StartTime::At { mantissa: negative * mantissa, decimals })
                }
                _ => Err(()),
            },
            Err(_) => Err(()),
        }
        .map_err(|()| self.at(entry.span(), "time".into(), "expected a number or \"generic\"".into()))
    }

    /// Degree of `{ polynomial = 2 }`.
    fn polynomial(&self, what: &str, table: &toml::Table, span: &Range<usize>) -> Result<usize, ModelError> {
        let degree = table.get("polynomial").and_then(Value::as_integer);
        degree.and_then(|d| usize::try_from(d).ok()).filter(|d| *d <= MAX_DEGREE).ok_or_else(|| {
            self.at(span.clone(), what.into(), format!("expected polynomial = a degree of 0 to {MAX_DEGREE}"))
        })
    }

    /// Parameters, in the order of the file.
    fn parameters(&mut self, entry: &Spanned<Value>) -> Result<Vec<Named>, ModelError> {
        let span = entry.span();
        let mut out = Vec::new();
        match entry.get_ref() {
            Value::Array(list) => {
                for value in list {
                    let text = value.as_str().ok_or_else(|| {
                        self.at(span.clone(), "parameters".into(), "expected names in quotes".into())
                    })?;
                    let name = self.declare(text, span.clone())?;
                    out.extend(self.named_entries(name, None));
                }
            }
            Value::Table(table) => {
                let places = Places::of(&self.text[span.start..], span.len());
                let mut names: Vec<&String> = table.keys().collect();
                names.sort_by_cached_key(|n| places.of_key(n));
                for key in names {
                    let what = format!("the parameter {key}");
                    let Some(entry) = table.get(key).and_then(Value::as_table) else {
                        let message = "expected a table, as in { unit = \"1/h\" }".into();
                        return Err(self.at(span.clone(), what, message));
                    };
                    self.known_keys(&what, entry, &span, &["unit", "description"])?;
                    let name = self.declare(key, span.clone())?;
                    out.extend(self.named_entries(name, Some(entry)));
                }
            }
            _ => {
                let message = "expected a list of names, or a table".into();
                return Err(self.at(span, "parameters".into(), message));
            }
        }
        Ok(out)
    }

    fn known_inputs(
        &self,
        name: &str,
        value: &Spanned<Value>,
    ) -> Result<Vec<(Named, KnownInput)>, ModelError> {
        let (what, span) = (format!("the known input {name}"), value.span());
        let named = self.named_entries(name, value.get_ref().as_table());
        let kinds = match value.get_ref() {
            Value::String(s) if s == "generic" => vec![KnownInput::Generic; named.len()],
            Value::String(s) if s == "constant" => vec![KnownInput::Polynomial(0); named.len()],
            Value::Table(t) if t.contains_key("function") => {
                self.known_keys(&what, t, &span, &["function", "unit", "description"])?;
                let functions = self.fitted((name, &what), &t["function"], span)?;
                functions.into_iter().map(KnownInput::Function).collect()
            }
            Value::Table(t) => {
                // the key `function` was handled above
                self.known_keys(&what, t, &span, &["polynomial", "function", "unit", "description"])?;
                vec![KnownInput::Polynomial(self.polynomial(&what, t, &span)?); named.len()]
            }
            _ => {
                let message = "expected \"generic\", \"constant\", { polynomial = degree } or { function = \
                               \"sin(t)\" }";
                return Err(self.at(span, what, message.into()));
            }
        };
        Ok(named.into_iter().zip(kinds).collect())
    }

    fn unknown_inputs(
        &self,
        name: &str,
        value: &Spanned<Value>,
    ) -> Result<Vec<(Named, Option<usize>)>, ModelError> {
        let (what, span) = (format!("the unknown input {name}"), value.span());
        let degree = match value.get_ref() {
            Value::String(s) if s == "arbitrary" => None,
            Value::String(s) if s == "constant" => Some(0),
            Value::Table(t) => {
                self.known_keys(&what, t, &span, &["polynomial", "unit", "description"])?;
                Some(self.polynomial(&what, t, &span)?)
            }
            _ => {
                let message = "expected \"arbitrary\", \"constant\" or { polynomial = degree }";
                return Err(self.at(span, what, message.into()));
            }
        };
        let named = self.named_entries(name, value.get_ref().as_table());
        Ok(named.into_iter().map(|n| (n, degree)).collect())
    }

    fn constants(&mut self, key: &str, value: &Spanned<Value>) -> Result<Vec<(Named, Constant)>, ModelError> {
        let (what, span) = (format!("the constant {}", base(key)), value.span());
        let table = value.get_ref().as_table();
        if let Some(t) = table {
            self.known_keys(&what, t, &span, &["value", "unit", "description"])?;
        }
        let inner = match (value.get_ref(), table) {
            (Value::String(s), _) if s == "generic" => None,
            (_, Some(t)) => t.get("value"),
            (other, None) => Some(other),
        };
        let Some(inner) = inner else {
            let name = self.declare(key, span)?;
            return Ok(self.named_entries(name, table).into_iter().map(|n| (n, Constant::Generic)).collect());
        };
        let (name, values) = self.defined((key, &what), inner, span)?;
        let values = values.into_iter().map(Constant::Value);
        Ok(self.named_entries(name, table).into_iter().zip(values).collect())
    }

    /// Entries of an output. It may have the name of the state that it equals: no expression can refer to
    /// it.
    fn output(&self, key: &str, value: &Spanned<Value>) -> Result<(Vec<Named>, Formulas), ModelError> {
        let (what, span) = (format!("the output {}", base(key)), value.span());
        let (name, shape) = declared(key).map_err(|m| self.at(span.clone(), format!("`{key}`"), m))?;
        let table = value.get_ref().as_table();
        let mut inner = value.get_ref();
        if let Some(t) = table {
            self.known_keys(&what, t, &span, &["expression", "unit", "description"])?;
            let none = || self.at(span.clone(), what.clone(), "no expression; expected one".into());
            inner = t.get("expression").ok_or_else(none)?;
        }
        let found = self.formulas(&what, inner, span.clone())?;
        if let Some(shape) = shape.filter(|s| *s != found.shape) {
            let message = format!("found {}; expected {shape}, as `{key}` declares it", found.shape);
            return Err(self.at(span, what, message));
        }
        let named = found.shape.names(name).iter().map(|n| self.named(n, table)).collect();
        Ok((named, found))
    }

    /// Differences of experiment `i`, counted from 0.
    fn experiment(
        &self,
        i: usize,
        entry: &ExperimentEntry,
        model: &SystemModel,
    ) -> Result<ExperimentChanges, ModelError> {
        let mut out = ExperimentChanges::default();
        let own = format!("of experiment {}", i + 1);
        for (name, value) in in_order(&entry.constants) {
            let what = format!("the constant {name} {own}");
            let parts = self.fitted((name, &what), value.get_ref(), value.span())?;
            out.constants.extend(self.entries(name).into_iter().zip(parts));
        }
        for (name, value) in in_order(&entry.known_inputs) {
            let inputs = self.known_inputs(name, value)?;
            let known = |n: &Named| model.known_inputs.iter().any(|u| u.0.name == n.name);
            if !inputs.iter().all(|u| known(&u.0)) {
                let all: Vec<String> = model.known_inputs.iter().map(|u| u.0.name.clone()).collect();
                let hint = nearest(name, &all).map(|h| format!("; did you mean `{h}`?")).unwrap_or_default();
                let message = format!("`{name}` is no known input; expected one of [known_inputs]{hint}");
                return Err(self.at(value.span(), format!("the known input {name} {own}"), message));
            }
            out.known_inputs.extend(inputs.into_iter().map(|(named, kind)| (named.name, kind)));
        }
        Ok(out)
    }

    /// Segment `i`, counted from 0.
    fn segment(&self, i: usize, segment: &SegmentEntry) -> Result<ModelSegment, ModelError> {
        let mut out = ModelSegment::default();
        for (list, map, kind) in [
            (&mut out.constants, &segment.constants, "the constant"),
            (&mut out.carry, &segment.carry, "the carried state"),
        ] {
            for (name, value) in in_order(map) {
                let what = format!("{kind} {name} of segment {}", i + 1);
                let parts = self.fitted((name, &what), value.get_ref(), value.span())?;
                list.extend(self.entries(name).into_iter().zip(parts));
            }
        }
        Ok(out)
    }

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

/// Places of keys in a text: the line that a key begins, or its place in an inline table in the first part
/// of the text.
struct Places<'t> {
    lines: HashMap<&'t str, usize>,
    inline: HashMap<&'t str, usize>,
}

impl<'t> Places<'t> {
    /// Places in a text whose first `inline` bytes may be an inline table.
    fn of(text: &'t str, inline: usize) -> Self {
        let (mut out, mut at) = (Self { lines: HashMap::new(), inline: HashMap::new() }, 0);
        for (k, line) in text.lines().enumerate() {
            if let Some((key, _)) = line.split_once(['=', '.']) {
                let key = key.trim().trim_start_matches('"').trim_end_matches('"');
                out.lines.entry(key).or_insert(k);
            }
        }
        while let Some(begin) = text[at..inline].find(|c: char| !c.is_whitespace() && !"{}=,.".contains(c)) {
            let word = &text[at + begin..inline];
            let quote = word.chars().next().filter(|c| ['"', '\''].contains(c));
            let word = &word[quote.map_or(0, char::len_utf8)..];
            let end = word.find(|c: char| match quote {
                Some(quote) => c == quote,
                None => c.is_whitespace() || "{}=,.".contains(c),
            });
            let word = &word[..end.unwrap_or(word.len())];
            out.inline.entry(word).or_insert(at + begin);
            at += begin + word.len() + 2 * quote.map_or(0, char::len_utf8);
            at = at.min(inline);
        }
        out
    }

    /// Sort key of a name: names in an inline table come first.
    fn of_key(&self, name: &str) -> (Option<usize>, Option<usize>) {
        (self.lines.get(name).copied(), self.inline.get(name).copied())
    }
}

#[cfg(test)]
mod tests {
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
