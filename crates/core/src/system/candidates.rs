//! Candidates for outputs of a model: quantities that could be measured, with their costs.

use std::ops::Range;

use serde_spanned::Spanned;
use toml::Value;

use super::error::FilePlace;
use super::error::ModelError;
use super::model::{Candidate, MAX_EXPERIMENTS, Named, PlacedExpression, SystemModel};
use super::reader::{ModelEntry, ModelReader, base};
use crate::language::{Expression, Node, Shape, Shapes, nearest, parse_components};

/// Words for groups of candidates, with their meanings.
pub const CANDIDATE_WORDS: [(&str, &str); 6] = [
    ("states", "every state"),
    ("outputs", "every output of the model"),
    ("inputs", "every unknown input"),
    ("parameters", "every parameter: its value becomes known"),
    ("candidates", "those of the table [candidates] of the file"),
    (EXPERIMENT, "one more experiment: the same outputs, from another start"),
];

/// Word, and name, of the candidate that is one more experiment.
const EXPERIMENT: &str = "experiment";

impl SystemModel {
    /// Candidates from a list such as `states` or `x1, x2, x1 + x3`: words of [`CANDIDATE_WORDS`], names and
    /// expressions, separated by commas. Repeated ones count once.
    ///
    /// # Errors
    /// [`ModelError`] for an expression that cannot be read, and for a word without a meaning in this model.
    pub fn candidates_of(&self, list: &str) -> Result<Vec<Candidate>, ModelError> {
        let mut out: Vec<Candidate> = Vec::new();
        for item in items(list) {
            let found = self.candidates_of_item(item)?;
            out.extend(found);
        }
        let mut seen = std::collections::HashSet::new();
        out.retain(|c| seen.insert(c.named.name.clone()));
        if out.iter().filter(|c| c.experiment).count() > 1 {
            return Err(wrong(list.trim(), "more than one experiment; expected at most one more"));
        }
        if out.iter().any(|c| c.experiment) && self.experiments >= MAX_EXPERIMENTS {
            let message = format!("the model has {MAX_EXPERIMENTS} experiments, and no more are possible");
            return Err(wrong(list.trim(), &message));
        }
        match out.is_empty() {
            false => Ok(out),
            true => {
                Err(wrong(list.trim(), "no candidate; expected states, or expressions separated by commas"))
            }
        }
    }

    fn candidates_of_item(&self, item: &str) -> Result<Vec<Candidate>, ModelError> {
        let outputs = || self.outputs.iter().map(|(named, e)| one(named.clone(), e.clone()));
        let found: Vec<Candidate> = match item {
            "" => return Err(wrong(item, "nothing between two commas; expected an expression")),
            "states" => self.states.iter().map(|s| named(&s.named)).collect(),
            "inputs" => self.unknown_inputs.iter().map(|u| named(&u.0)).collect(),
            "parameters" => self.parameters.iter().map(named).collect(),
            "outputs" => outputs().collect(),
            "candidates" => self.candidates.clone(),
            EXPERIMENT => vec![Candidate {
                named: Named { name: EXPERIMENT.into(), ..Named::default() },
                parts: Vec::new(),
                experiment: true,
                cost: 1.0,
            }],
            expression => return self.candidate(expression).map(|c| vec![c]),
        };
        match found.is_empty() {
            false => Ok(found),
            true => Err(wrong(item, "the model has none; expected other candidates")),
        }
    }

    /// Refuses a candidate of the file that has the name of a state, a parameter, an unknown input or an
    /// output but is another quantity.
    pub(super) fn check_candidates(&self) -> Result<(), ModelError> {
        let states = self.states.iter().map(|s| &s.named.name);
        let own = states.chain(self.parameters.iter().map(|p| &p.name));
        let own: Vec<&String> = own.chain(self.unknown_inputs.iter().map(|u| &u.0.name)).collect();
        for candidate in &self.candidates {
            let Some(part) = candidate.parts.first() else { continue };
            let name = &candidate.named.name;
            let output = self.outputs.iter().find(|o| o.0.name == *name).map(|o| &o.1.text);
            let base = |other: &&String| other.split('[').next() == Some(name);
            let taken = own.iter().any(base) && part.text != *name;
            if taken || output.is_some_and(|text| part.text != *text) {
                let message = format!("{name} is something else in the model; expected another name");
                return Err(part.place.error(message, part.expression.span()));
            }
        }
        Ok(())
    }

    /// Candidate from an expression, or from the name of a state, a parameter, an unknown input, a candidate
    /// of the file or an output.
    fn candidate(&self, text: &str) -> Result<Candidate, ModelError> {
        let own = (self.states.iter().map(|s| &s.named))
            .chain(&self.parameters)
            .chain(self.unknown_inputs.iter().map(|u| &u.0));
        if let Some(own) = own.into_iter().find(|n| n.name == text) {
            return Ok(named(own));
        }
        if let Some(own) = self.candidates.iter().find(|c| c.named.name == text) {
            return Ok(own.clone());
        }
        if let Some((own, expression)) = self.outputs.iter().find(|o| o.0.name == text) {
            return Ok(one(own.clone(), expression.clone()));
        }
        let is_name = text.chars().all(|c| c.is_alphanumeric() || c == '_');
        let known = self
            .slot_names()
            .iter()
            .chain(self.definitions.iter().map(|d| &d.0))
            .any(|n| n.split('[').next() == Some(text));
        if is_name && !known {
            let words = CANDIDATE_WORDS.map(|(word, _)| word.to_string());
            if let Some(word) = nearest(text, &words) {
                return Err(wrong(text, &format!("`{text}` is not known here; did you mean `{word}`?")));
            }
        }
        let place = FilePlace { what: format!("the candidate {text}"), offset: None };
        let expanded = self.with_outputs(text);
        let read = parse_components(&expanded, &self.shapes()).map_err(|e| ModelError {
            what: place.what.clone(),
            message: e.to_string(),
            span: None,
        })?;
        let part = |expression| PlacedExpression { text: expanded.clone(), expression, place: place.clone() };
        Ok(Candidate {
            named: Named { name: text.into(), ..Named::default() },
            parts: read.entries.into_iter().map(part).collect(),
            experiment: false,
            cost: 1.0,
        })
    }

    /// Expression with the names of scalar outputs and candidates of the file replaced by their expressions,
    /// in parentheses; a name of the model itself stays.
    fn with_outputs(&self, text: &str) -> String {
        let own = self.slot_names();
        let is_own = |name: &str| own.iter().chain(self.definitions.iter().map(|d| &d.0)).any(|n| n == name);
        let outputs = self.outputs.iter().map(|(named, e)| (named.name.as_str(), e.text.as_str()));
        let candidates = self.candidates.iter().filter(|c| c.parts.len() == 1);
        let candidates = candidates.map(|c| (c.named.name.as_str(), c.parts[0].text.as_str()));
        let known: Vec<(&str, &str)> = outputs.chain(candidates).filter(|(name, _)| !is_own(name)).collect();
        let in_name = |c: char| c.is_alphanumeric() || c == '_';
        let mut out = String::new();
        let mut rest = text;
        while let Some(first) = rest.chars().next() {
            let word = rest.find(|c| !in_name(c)).unwrap_or(rest.len()).max(first.len_utf8());
            let (token, after) = rest.split_at(word);
            match known.iter().find(|(name, _)| *name == token && !after.starts_with('[')) {
                Some((_, expression)) => out += &format!("({expression})"),
                None => out += token,
            }
            rest = after;
        }
        out
    }

    /// Shapes of the names that are vectors or matrices.
    fn shapes(&self) -> Shapes {
        let mut out = Shapes::new();
        for name in self.slot_names().iter().chain(self.definitions.iter().map(|d| &d.0)) {
            let Some((base, index)) = name.split_once('[') else { continue };
            let index: Vec<usize> =
                index.trim_end_matches(']').split(',').filter_map(|i| i.trim().parse().ok()).collect();
            let shape = out.entry(base.to_string()).or_insert(Shape::SCALAR);
            match index[..] {
                [rows] => *shape = Shape::vector(rows.max(shape.rows)),
                [rows, columns] => {
                    *shape = Shape { rows: rows.max(shape.rows), columns: columns.max(shape.columns) };
                }
                _ => {}
            }
        }
        out
    }

    /// The model with candidates as its outputs, beside its own outputs if `own`, and the outputs of each
    /// candidate; without requested combinations. With an experiment among the candidates it has one more,
    /// which differs from the last one by its start only.
    pub fn measuring(&self, candidates: &[Candidate], own: bool) -> (Self, Vec<Range<usize>>) {
        let mut out = Self { combinations: Vec::new(), candidates: Vec::new(), ..self.clone() };
        if !own {
            out.outputs.clear();
        }
        let mut ranges = Vec::new();
        for (i, candidate) in candidates.iter().enumerate() {
            let start = out.outputs.len();
            if candidate.experiment {
                out.experiments = out.experiments.max(1) + 1;
                out.own.extend(self.own.last().cloned());
            }
            for (k, part) in candidate.parts.iter().enumerate() {
                let name = format!("candidate {}.{}", i + 1, k + 1);
                out.outputs.push((Named { name, ..Named::default() }, part.clone()));
            }
            ranges.push(start..out.outputs.len());
        }
        (out, ranges)
    }
}

impl ModelReader<'_> {
    /// Candidate of an entry of the table `candidates`: an expression, or a table with expression, cost,
    /// unit, description.
    pub(super) fn file_candidate(&self, (key, value): ModelEntry<'_>) -> Result<Candidate, ModelError> {
        let (name, span) = (base(key), value.span());
        let what = format!("the candidate {name}");
        let table = value.get_ref().as_table();
        let (mut inner, mut cost) = (value.get_ref(), 1.0);
        if let Some(t) = table {
            self.known_keys(&what, t, &span, &["expression", "experiment", "cost", "unit", "description"])?;
            let experiment = match t.get("experiment") {
                None => false,
                Some(Value::Boolean(true)) if !t.contains_key("expression") => true,
                Some(_) => {
                    let message = "expected either an expression, or experiment = true".into();
                    return Err(self.at(span, what, message));
                }
            };
            cost = match t.get("cost") {
                None => 1.0,
                Some(Value::Integer(n)) => *n as f64,
                Some(Value::Float(x)) => *x,
                Some(_) => f64::NAN,
            };
            let none = || self.at(span.clone(), what.clone(), "no expression; expected one".into());
            if experiment {
                check_cost(cost).map_err(|message| self.at(span, what, message))?;
                let named = self.named(name, table);
                return Ok(Candidate { named, parts: Vec::new(), experiment, cost });
            }
            inner = t.get("expression").ok_or_else(none)?;
        }
        check_cost(cost).map_err(|message| self.at(span.clone(), what.clone(), message))?;
        let found = self.formulas(&what, inner, span)?;
        Ok(Candidate { named: self.named(name, table), parts: found.parts, experiment: false, cost })
    }

    /// All candidates of the file, in its order.
    pub(super) fn file_candidates(
        &self,
        entries: &[(&String, &Spanned<Value>)],
    ) -> Result<Vec<Candidate>, ModelError> {
        entries.iter().map(|entry| self.file_candidate(*entry)).collect()
    }
}

/// Checks a cost.
///
/// # Errors
/// Description of the admitted costs.
pub fn check_cost(cost: f64) -> Result<(), String> {
    let steps = cost * 1e6;
    match (1.0..=1e12).contains(&steps) && (steps - steps.round()).abs() < 1e-3 {
        true => Ok(()),
        false => {
            Err(format!("found {cost}; expected a cost above 0 and up to 1000000, with at most 6 decimals"))
        }
    }
}

fn wrong(what: &str, message: &str) -> ModelError {
    ModelError { what: format!("the candidates `{what}`"), message: message.into(), span: None }
}

fn one(named: Named, part: PlacedExpression) -> Candidate {
    Candidate { named, parts: vec![part], experiment: false, cost: 1.0 }
}

/// Candidate that is the quantity of this name.
fn named(of: &Named) -> Candidate {
    let expression = Expression {
        nodes: vec![Node::Name(of.name.clone())],
        spans: std::iter::once(0..of.name.len()).collect(),
    };
    let place = FilePlace { what: format!("the candidate {}", of.name), offset: None };
    one(of.clone(), PlacedExpression { text: of.name.clone(), expression, place })
}

/// Parts of a list, separated by commas outside of brackets.
fn items(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut out) = (0i32, 0, Vec::new());
    for (i, c) in list.char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            ',' if depth == 0 => {
                out.push(list[start..i].trim());
                start = i + 1;
            }
            _ => {}
        }
    }
    out.push(list[start..].trim());
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::model_file::read;

    const TEXT: &str = "name = 'm'\nparameters = ['k']\n[states]\nx = '-k*x + w'\n'p[2]' = '[p[2], \
                        x]'\n[unknown_inputs]\nw = 'constant'\n[outputs]\ny = 'x'\n[candidates]\nbeat = { \
                        expression = 'x*k', cost = 2.5, unit = 'V' }\nplace = 'p'\n";

    fn names(list: &str) -> Vec<String> {
        let model = read(TEXT).expect("a model");
        let found = model.candidates_of(list).expect("candidates");
        found.into_iter().map(|c| format!("{} {} {}", c.named.name, c.parts.len(), c.cost)).collect()
    }

    #[test]
    fn lists_by_hand() {
        assert_eq!(names("states"), ["x 1 1", "p[1] 1 1", "p[2] 1 1"]);
        assert_eq!(names("inputs, parameters,x"), ["w 1 1", "k 1 1", "x 1 1"]);
        assert_eq!(names("outputs, candidates"), ["y 1 1", "beat 1 2.5", "place 2 1"]);
        assert_eq!(names("y, beat, place, beat"), ["y 1 1", "beat 1 2.5", "place 2 1"]);
        assert_eq!(
            names("atan2(x, k), x + 2*w, p, atan2(x, k)"),
            ["atan2(x, k) 1 1", "x + 2*w 1 1", "p 2 1"]
        );
    }

    #[test]
    fn what_is_wrong_is_named() {
        let model = read(TEXT).expect("a model");
        let error = |list: &str| model.candidates_of(list).expect_err("refused").to_string();
        assert!(error("x,,k").contains("nothing between two commas"), "{}", error("x,,k"));
        assert!(error("x +").contains("the candidate x +"), "{}", error("x +"));
        let none = SystemModel { candidates: Vec::new(), ..model.clone() };
        assert!(none.candidates_of("candidates").expect_err("none").to_string().contains("has none"));
        for (text, message) in [
            ("z = { cost = 1 }", "no expression"),
            ("z = { expression = 'x', cost = 0 }", "expected a cost above 0"),
            ("z = { expression = 'x', cost = 'high' }", "expected a cost above 0"),
            ("z = { expression = 'x', price = 1 }", "unknown key `price`"),
            ("z = 'x + nowhere'", "nowhere"),
            ("x = 'k'", "x is something else"),
            ("y = 'k'", "y is something else"),
        ] {
            let e = read(&format!("{TEXT}{text}\n")).expect_err("refused");
            assert!(e.to_string().contains(message) && e.span.is_some(), "{e}");
        }
    }

    #[test]
    fn outputs_are_those_of_candidates() {
        let model = read(TEXT).expect("a model");
        let candidates = model.candidates_of("candidates").expect("candidates");
        let (other, ranges) = model.measuring(&candidates, true);
        assert_eq!((other.outputs.len(), ranges), (4, vec![1..2, 2..4]));
        other.compile().expect("a graph");
        assert_eq!(model.measuring(&candidates, false).1, [0..1, 1..3]);
    }
}
