//! Entries of a model file: states, parameters, inputs, constants, outputs, experiments and segments.

use std::collections::HashMap;
use std::ops::Range;

use serde_spanned::Spanned;
use toml::Value;

use super::super::error::ModelError;
use super::super::model::{
    Constant, ExperimentChanges, KnownInput, MAX_DEGREE, ModelSegment, Named, StartTime, State, StateStart,
    SystemModel,
};
use super::super::reader::{Formulas, ModelReader, base, declared, in_order};
use super::layout::{ExperimentEntry, SegmentEntry};
use crate::language::{Node, nearest, parse};

impl ModelReader<'_> {
    /// Checks that a table has no other keys than the given ones.
    pub(in crate::system) fn known_keys(
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
    pub(in crate::system) fn named(&self, name: &str, table: Option<&toml::Table>) -> Named {
        let text = |key: &str| {
            table.and_then(|t| t.get(key)).and_then(Value::as_str).unwrap_or_default().to_string()
        };
        Named { name: name.into(), unit: text("unit"), description: text("description") }
    }

    /// Names of the entries of `name`, each with unit and description of the whole.
    fn named_entries(&self, name: &str, table: Option<&toml::Table>) -> Vec<Named> {
        self.entries(name).iter().map(|n| self.named(n, table)).collect()
    }

    pub(super) fn states(&self, name: &str, value: &Spanned<Value>) -> Result<Vec<State>, ModelError> {
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
    pub(super) fn time(&self, entry: &Spanned<Value>) -> Result<StartTime, ModelError> {
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
    pub(super) fn parameters(&mut self, entry: &Spanned<Value>) -> Result<Vec<Named>, ModelError> {
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

    pub(super) fn known_inputs(
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

    pub(super) fn unknown_inputs(
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

    pub(super) fn constants(
        &mut self,
        key: &str,
        value: &Spanned<Value>,
    ) -> Result<Vec<(Named, Constant)>, ModelError> {
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
    pub(super) fn output(
        &self,
        key: &str,
        value: &Spanned<Value>,
    ) -> Result<(Vec<Named>, Formulas), ModelError> {
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
    pub(super) fn experiment(
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
    pub(super) fn segment(&self, i: usize, segment: &SegmentEntry) -> Result<ModelSegment, ModelError> {
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
}

/// Places of keys in a text: the line that a key begins, or its place in an inline table in the first part
/// of the text.
pub(super) struct Places<'t> {
    lines: HashMap<&'t str, usize>,
    inline: HashMap<&'t str, usize>,
}

impl<'t> Places<'t> {
    /// Places in a text whose first `inline` bytes may be an inline table.
    pub(super) fn of(text: &'t str, inline: usize) -> Self {
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
    pub(super) fn of_key(&self, name: &str) -> (Option<usize>, Option<usize>) {
        (self.lines.get(name).copied(), self.inline.get(name).copied())
    }
}
