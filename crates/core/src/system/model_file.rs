//! Model files: TOML, with errors that know their place.

use std::collections::BTreeMap;
use std::ops::Range;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_spanned::Spanned;
use toml::Value;

use super::model::{
    Constant, KnownInput, MAX_DEGREE, MAX_EXPERIMENTS, ModelError, Named, Place, PlacedExpression, Segment,
    State, StateStart, SystemModel,
};
use crate::model::expression::{Names, Node, nearest, parse_with};
use crate::model::file_error::explain;

/// The layout of a model file. Expressions are texts with `+ - * / ^`, brackets, decimals (exact), `sin cos tan asin acos atan exp log sqrt`
/// and the names of the model; `t` is the time.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// Name of the system.
    #[schemars(required)]
    name: Option<String>,
    /// What it is and where it comes from.
    #[serde(default)]
    description: String,
    /// States: the derivative, `x = "-a*x"`, or a table with equation, initial ("known", or an exact value), unit, description.
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    states: BTreeMap<String, Spanned<Value>>,
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
    /// Names for subexpressions.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    definitions: BTreeMap<String, Spanned<Value>>,
    /// Outputs: an expression, or a table with expression, unit, description.
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    outputs: BTreeMap<String, Spanned<Value>>,
    /// Runs with starts of their own; parameters are shared.
    #[serde(default)]
    #[schemars(with = "Option<usize>")]
    experiments: Option<Spanned<usize>>,
    /// Segments of the timeline, reached at once: constants = { c = "-1" }, carry = { x = "-x" } (states that jump).
    #[serde(default, rename = "segment")]
    segments: Vec<SegmentEntry>,
    /// Combinations to be judged.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    combinations: Vec<Spanned<String>>,
    /// Numbers for `obsdeg simulate --model`.
    #[serde(default)]
    simulation: SimulationEntry,
}

/// Numbers for a simulation, in the units of the model.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimulationEntry {
    /// How long it runs.
    #[schemars(with = "Option<f64>")]
    duration: Option<Spanned<f64>>,
    /// Between two samples.
    #[schemars(with = "Option<f64>")]
    step: Option<Spanned<f64>>,
    /// True values of states at the start, parameters, unknown inputs (w, w', ...) and generic constants.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>")]
    values: BTreeMap<String, Spanned<f64>>,
    /// Standard deviations of the initial estimates; as large as the value when left out (1 for zero).
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>")]
    priors: BTreeMap<String, Spanned<f64>>,
    /// Standard deviation of the noise of a sample, by output.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>")]
    noise: BTreeMap<String, Spanned<f64>>,
    /// Generic known inputs as functions of the time t.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, String>")]
    inputs: BTreeMap<String, Spanned<Value>>,
}

/// A segment of the timeline.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentEntry {
    /// Constants that take another value.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    constants: BTreeMap<String, Spanned<Value>>,
    /// States behind the jump, in terms of those before.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    carry: BTreeMap<String, Spanned<Value>>,
}

/// In the order of the file.
fn in_order(map: &BTreeMap<String, Spanned<Value>>) -> Vec<(&String, &Spanned<Value>)> {
    let mut out: Vec<_> = map.iter().collect();
    out.sort_by_key(|(_, v)| v.span().start);
    out
}

/// A file under way.
struct Reader<'a> {
    text: &'a str,
}

impl Reader<'_> {
    fn at(&self, span: Range<usize>, what: String, message: String) -> ModelError {
        ModelError { what, message, span: Some(span) }
    }

    /// The text of an expression: as written for a number, its contents for a string.
    fn formula(
        &self,
        what: String,
        value: &Value,
        span: Range<usize>,
    ) -> Result<PlacedExpression, ModelError> {
        let within = &self.text[span.clone()];
        let source = match value {
            Value::String(s) => s.clone(),
            Value::Integer(i) if within.contains(['{', '[']) => i.to_string(),
            Value::Float(x) if within.contains(['{', '[']) => x.to_string(),
            Value::Integer(_) | Value::Float(_) => within.replace('_', ""),
            other => {
                let message =
                    format!("found a {}; expected an expression in quotes, or a number", other.type_str());
                return Err(self.at(span, what, message));
            }
        };
        // escapes aside, the expression stands in the file as it is
        let offset = if source.is_empty() { None } else { within.find(&source).map(|o| span.start + o) };
        let place = Place { what, offset: offset.or((source.is_empty()).then_some(span.start)) };
        let expression = parse_with(&source, Names::Plain).map_err(|e| {
            let mut error = place.error(e.to_string(), e.span());
            error.span.get_or_insert(span.clone());
            error
        })?;
        Ok(PlacedExpression { text: source, expression, place })
    }

    /// A table's entry, and a check that there is nothing else in it.
    fn known_keys(
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

    fn named(&self, name: &str, table: Option<&toml::Table>) -> Named {
        let text = |key: &str| {
            table.and_then(|t| t.get(key)).and_then(Value::as_str).unwrap_or_default().to_string()
        };
        Named { name: name.into(), unit: text("unit"), description: text("description") }
    }

    fn state(&self, name: &str, value: &Spanned<Value>) -> Result<State, ModelError> {
        let (what, span) = (format!("the equation of {name}"), value.span());
        let Some(table) = value.get_ref().as_table() else {
            let equation = self.formula(what, value.get_ref(), span)?;
            return Ok(State { named: self.named(name, None), equation, start: StateStart::Unknown });
        };
        self.known_keys(&what, table, &span, &["equation", "initial", "unit", "description"])?;
        let equation = table
            .get("equation")
            .ok_or_else(|| self.at(span.clone(), what.clone(), "no equation; expected one".into()))?;
        let start = match table.get("initial") {
            None => StateStart::Unknown,
            Some(Value::String(s)) if s == "known" => StateStart::Known,
            Some(Value::String(s)) if s == "unknown" => StateStart::Unknown,
            Some(value) => StateStart::Value(self.formula(
                format!("the initial value of {name}"),
                value,
                span.clone(),
            )?),
        };
        let equation = self.formula(what, equation, span)?;
        Ok(State { named: self.named(name, Some(table)), equation, start })
    }

    /// `{ polynomial = 2 }`.
    fn polynomial(&self, what: &str, table: &toml::Table, span: &Range<usize>) -> Result<usize, ModelError> {
        let degree = table.get("polynomial").and_then(Value::as_integer);
        degree.and_then(|d| usize::try_from(d).ok()).filter(|d| *d <= MAX_DEGREE).ok_or_else(|| {
            self.at(span.clone(), what.into(), format!("expected polynomial = a degree of 0 to {MAX_DEGREE}"))
        })
    }

    /// The parameters, in the order of the file.
    fn parameters(&self, entry: &Spanned<Value>) -> Result<Vec<Named>, ModelError> {
        let span = entry.span();
        match entry.get_ref() {
            Value::Array(list) => {
                let name = |value: &Value| {
                    let text = value.as_str().ok_or_else(|| {
                        self.at(span.clone(), "parameters".into(), "expected names in quotes".into())
                    })?;
                    Ok(self.named(text, None))
                };
                list.iter().map(name).collect()
            }
            Value::Table(table) => {
                // the line that the key begins, or its place in an inline table
                let begins = |line: &str, name: &str| {
                    let rest = line.trim_start().strip_prefix(name);
                    rest.is_some_and(|r| r.trim_start().starts_with(['=', '.']))
                };
                let place = |name: &str| {
                    let lines = self.text[span.start..].lines().position(|line| begins(line, name));
                    (lines, self.text[span.clone()].find(name))
                };
                let mut names: Vec<&String> = table.keys().collect();
                names.sort_by_key(|n| place(n));
                let parameter = |name: &String| {
                    let what = format!("the parameter {name}");
                    let Some(entry) = table.get(name).and_then(Value::as_table) else {
                        let message = "expected a table, as in { unit = \"1/h\" }".into();
                        return Err(self.at(span.clone(), what, message));
                    };
                    self.known_keys(&what, entry, &span, &["unit", "description"])?;
                    Ok(self.named(name, Some(entry)))
                };
                names.into_iter().map(parameter).collect()
            }
            _ => {
                let message = "expected a list of names, or a table".into();
                Err(self.at(span, "parameters".into(), message))
            }
        }
    }

    fn known_input(&self, name: &str, value: &Spanned<Value>) -> Result<(Named, KnownInput), ModelError> {
        let (what, span) = (format!("the known input {name}"), value.span());
        let kind = match value.get_ref() {
            Value::String(s) if s == "generic" => KnownInput::Generic,
            Value::String(s) if s == "constant" => KnownInput::Polynomial(0),
            Value::Table(t) if t.contains_key("function") => {
                self.known_keys(&what, t, &span, &["function", "unit", "description"])?;
                KnownInput::Function(self.formula(what, &t["function"], span)?)
            }
            Value::Table(t) => {
                self.known_keys(&what, t, &span, &["polynomial", "unit", "description"])?;
                KnownInput::Polynomial(self.polynomial(&what, t, &span)?)
            }
            _ => {
                let message = "expected \"generic\", \"constant\", { polynomial = degree } or { function = \"sin(t)\" }";
                return Err(self.at(span, what, message.into()));
            }
        };
        Ok((self.named(name, value.get_ref().as_table()), kind))
    }

    fn unknown_input(
        &self,
        name: &str,
        value: &Spanned<Value>,
    ) -> Result<(Named, Option<usize>), ModelError> {
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
        Ok((self.named(name, value.get_ref().as_table()), degree))
    }

    fn constant(&self, name: &str, value: &Spanned<Value>) -> Result<(Named, Constant), ModelError> {
        let what = format!("the constant {name}");
        let table = value.get_ref().as_table();
        let kind = match (value.get_ref(), table) {
            (Value::String(s), _) if s == "generic" => Constant::Generic,
            (_, Some(t)) => {
                self.known_keys(&what, t, &value.span(), &["value", "unit", "description"])?;
                match t.get("value") {
                    None => Constant::Generic,
                    Some(inner) => Constant::Value(self.formula(what, inner, value.span())?),
                }
            }
            (other, None) => Constant::Value(self.formula(what, other, value.span())?),
        };
        Ok((self.named(name, table), kind))
    }

    fn output(&self, name: &str, value: &Spanned<Value>) -> Result<(Named, PlacedExpression), ModelError> {
        let (what, span) = (format!("the output {name}"), value.span());
        let table = value.get_ref().as_table();
        let formula = match table {
            None => self.formula(what, value.get_ref(), span)?,
            Some(t) => {
                self.known_keys(&what, t, &span, &["expression", "unit", "description"])?;
                let inner = t.get("expression").ok_or_else(|| {
                    self.at(span.clone(), what.clone(), "no expression; expected one".into())
                })?;
                self.formula(what, inner, span)?
            }
        };
        Ok((self.named(name, table), formula))
    }

    /// Segment `i`, counted from 0.
    fn segment(&self, i: usize, segment: &SegmentEntry) -> Result<Segment, ModelError> {
        let mut out = Segment::default();
        for (list, map, kind) in [
            (&mut out.constants, &segment.constants, "the constant"),
            (&mut out.carry, &segment.carry, "the carried state"),
        ] {
            for (name, value) in in_order(map) {
                let what = format!("{kind} {name} of segment {}", i + 1);
                list.push((name.clone(), self.formula(what, value.get_ref(), value.span())?));
            }
        }
        Ok(out)
    }
}

/// Whether a text is meant as a model, not a scheme.
pub fn is_model(text: &str) -> bool {
    text.lines().any(|l| l.trim_start().starts_with("[states"))
}

/// Reads a model.
///
/// # Errors
/// [`ModelError`] with the byte range of the offender where it is known.
pub fn read(text: &str) -> Result<SystemModel, ModelError> {
    let file: ModelFile = toml::from_str(text).map_err(|e| {
        let (message, span) = explain::<ModelFile>(text, &e);
        ModelError { what: "the model file".into(), message, span }
    })?;
    let r = Reader { text };
    let mut model = SystemModel {
        name: file.name.clone().unwrap_or_default(),
        description: file.description,
        experiments: 1,
        ..SystemModel::default()
    };
    if let Some(experiments) = &file.experiments {
        model.experiments = *experiments.get_ref();
        if !(1..=MAX_EXPERIMENTS).contains(&model.experiments) {
            let message = format!("expected 1 to {MAX_EXPERIMENTS}");
            return Err(r.at(experiments.span(), "experiments".into(), message));
        }
    }
    for (name, value) in in_order(&file.states) {
        model.states.push(r.state(name, value)?);
    }
    if let Some(parameters) = &file.parameters {
        model.parameters = r.parameters(parameters)?;
    }
    for (name, value) in in_order(&file.known_inputs) {
        model.known_inputs.push(r.known_input(name, value)?);
    }
    for (name, value) in in_order(&file.unknown_inputs) {
        model.unknown_inputs.push(r.unknown_input(name, value)?);
    }
    for (name, value) in in_order(&file.constants) {
        model.constants.push(r.constant(name, value)?);
    }
    for (name, value) in in_order(&file.definitions) {
        let formula = r.formula(format!("the definition of {name}"), value.get_ref(), value.span())?;
        model.definitions.push((name.clone(), formula));
    }
    for (name, value) in in_order(&file.outputs) {
        model.outputs.push(r.output(name, value)?);
    }
    for (i, segment) in file.segments.iter().enumerate() {
        model.segments.push(r.segment(i, segment)?);
    }
    for c in &file.combinations {
        let what = format!("the combination {}", c.get_ref());
        model.combinations.push(r.formula(what, &Value::String(c.get_ref().clone()), c.span())?);
    }
    nominal(&r, &file.simulation, &mut model)?;
    let placed =
        |e: ModelError| ModelError { span: e.span.clone().or_else(|| last_mention(text, &e.what)), ..e };
    model.check().map_err(placed)?;
    // it stands in no equation: what is wrong with these is said first
    if file.name.is_none() {
        model.compile().map_err(placed)?;
        let message = "the key `name` is missing; expected it at the top of the file".into();
        return Err(r.at(0..text.chars().next().map_or(0, char::len_utf8), "the model file".into(), message));
    }
    Ok(model)
}

/// Numbers for a simulation: names that are known, numbers that can be.
fn nominal(r: &Reader<'_>, entry: &SimulationEntry, model: &mut SystemModel) -> Result<(), ModelError> {
    let names =
        |list: &mut dyn Iterator<Item = &Named>| -> Vec<String> { list.map(|n| n.name.clone()).collect() };
    let inputs = names(&mut model.unknown_inputs.iter().map(|u| &u.0));
    let primes =
        |name: &String| -> Vec<String> { (0..4).map(|k| format!("{name}{}", "'".repeat(k))).collect() };
    let mut unknowns = names(&mut model.states.iter().map(|s| &s.named));
    unknowns.extend(names(&mut model.parameters.iter()));
    unknowns.extend(inputs.iter().flat_map(primes));
    let mut values = unknowns.clone();
    values.extend(names(&mut model.constants.iter().map(|c| &c.0)));
    let outputs = names(&mut model.outputs.iter().map(|o| &o.0));
    let known = |what: &str, name: &str, list: &[String], span: Range<usize>| {
        if list.iter().any(|n| n == name) {
            return Ok(());
        }
        let hint = nearest(name, list).map(|h| format!("; did you mean `{h}`?")).unwrap_or_default();
        Err(r.at(span, format!("{what} of the simulation"), format!("`{name}` is not known here{hint}")))
    };
    let nominal = &mut model.simulation;
    for (what, map, list, target, positive) in [
        ("values", &entry.values, &values, &mut nominal.values, false),
        ("priors", &entry.priors, &unknowns, &mut nominal.priors, true),
        ("noise", &entry.noise, &outputs, &mut nominal.noise, true),
    ] {
        for (name, value) in map {
            known(what, name, list, value.span())?;
            let x = *value.get_ref();
            if !x.is_finite() || (positive && x <= 0.0) {
                let message = if positive { "expected a number above 0" } else { "expected a number" };
                return Err(r.at(value.span(), format!("{what} of {name}"), message.into()));
            }
            target.insert(name.clone(), x);
        }
    }
    for (what, value, target) in
        [("duration", &entry.duration, &mut nominal.duration), ("step", &entry.step, &mut nominal.step)]
    {
        if let Some(value) = value {
            if !(value.get_ref().is_finite() && *value.get_ref() > 0.0) {
                let message = "expected a number above 0".into();
                return Err(r.at(value.span(), format!("{what} of the simulation"), message));
            }
            *target = Some(*value.get_ref());
        }
    }
    let generic = names(&mut model.known_inputs.iter().map(|u| &u.0));
    for (name, value) in &entry.inputs {
        known("inputs", name, &generic, value.span())?;
        let formula =
            r.formula(format!("the input {name} of the simulation"), value.get_ref(), value.span())?;
        let other = formula.expression.nodes.iter().position(|n| matches!(n, Node::Name(n) if n != "t"));
        if let Some(i) = other {
            let message = "expected a function of the time t alone".into();
            return Err(formula.place.error(message, formula.expression.spans[i].clone()));
        }
        nominal.inputs.insert(name.clone(), formula);
    }
    Ok(())
}

/// Where a name in quotes (`` `x` ``) is last given: as a key, or in a list of names.
fn last_mention(text: &str, quoted: &str) -> Option<Range<usize>> {
    let name = quoted.strip_prefix('`')?.strip_suffix('`')?;
    let given = |at: usize| {
        let (before, after) = (&text[..at], text[at + name.len()..].trim_start());
        let key = after.starts_with('=') && before.trim_end_matches([' ', '\t']).ends_with(['\n', '{', ',']);
        key || (before.ends_with('"') && text[at + name.len()..].starts_with('"'))
    };
    let at = text.match_indices(name).map(|(at, _)| at).filter(|&at| given(at)).last()?;
    Some(at..at + name.len())
}
