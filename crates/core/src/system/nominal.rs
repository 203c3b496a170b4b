//! Numbers for a simulation in a model file.

use std::collections::BTreeMap;
use std::ops::Range;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_spanned::Spanned;
use toml::Value;

use super::error::ModelError;
use super::model::{Named, PlacedExpression, SystemModel};
use super::reader::ModelReader;
use crate::language::{Node, Shapes, nearest};

/// Numbers for a simulation, in the units of the model.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "SimulationEntry")]
pub(super) struct ModelSimulationEntry {
    /// Duration of every experiment, in the unit of `t`.
    #[schemars(with = "Option<f64>")]
    duration: Option<Spanned<f64>>,
    /// Time between two samples, in the unit of `t`.
    #[schemars(with = "Option<f64>")]
    step: Option<Spanned<f64>>,
    /// True values of states at the start, parameters, unknown inputs (w, w', ...) and generic constants, in
    /// their units; of a vector a list, or one number for all entries; `x` in all experiments, or `"x@2"` in
    /// the second.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    values: BTreeMap<String, Spanned<Value>>,
    /// Standard deviations of the initial estimates, in the units of the unknowns; as large as the value when
    /// left out (1 for zero).
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    priors: BTreeMap<String, Spanned<Value>>,
    /// Standard deviation of the noise of a sample, by output, in its unit.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    noise: BTreeMap<String, Spanned<Value>>,
    /// Generic known inputs as functions of the time t.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    inputs: BTreeMap<String, Spanned<Value>>,
}

/// Numbers in a value, row by row; `None` if it contains anything else.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Integer(i) => Some(vec![*i as f64]),
        Value::Float(x) => Some(vec![*x]),
        Value::Array(list) => list.iter().map(numbers).collect::<Option<Vec<_>>>().map(|l| l.concat()),
        _ => None,
    }
}

/// Checked numbers for a simulation: known names, admitted numbers.
pub(super) fn nominal(
    r: &ModelReader<'_>,
    outputs: &Shapes,
    entry: &ModelSimulationEntry,
    model: &mut SystemModel,
) -> Result<(), ModelError> {
    let reader = NominalReader { r, experiments: model.experiments };
    let unknowns = unknown_names(model);
    let mut valued = unknowns.clone();
    valued.extend(names(model.constants.iter().map(|c| &c.0)));
    let measured = names(model.outputs.iter().map(|o| &o.0));
    let generic = names(model.known_inputs.iter().map(|u| &u.0));
    let shapes = &r.shapes;
    let (values, priors, noise) = (
        NumberTable { what: "values", entries: &entry.values, names: &valued, shapes, positive: false },
        NumberTable { what: "priors", entries: &entry.priors, names: &unknowns, shapes, positive: true },
        NumberTable {
            what: "noise",
            entries: &entry.noise,
            names: &measured,
            shapes: outputs,
            positive: true,
        },
    );
    let nominal = &mut model.simulation;
    reader.numbers(&values, &mut nominal.values)?;
    reader.numbers(&priors, &mut nominal.priors)?;
    reader.numbers(&noise, &mut nominal.noise)?;
    reader.positive("duration", entry.duration.as_ref(), &mut nominal.duration)?;
    reader.positive("step", entry.step.as_ref(), &mut nominal.step)?;
    reader.inputs(&entry.inputs, &generic, &mut nominal.inputs)
}

fn names<'a>(list: impl Iterator<Item = &'a Named>) -> Vec<String> {
    list.map(|n| n.name.clone()).collect()
}

/// Names of states, parameters and unknown inputs, with three derivatives of each input.
fn unknown_names(model: &SystemModel) -> Vec<String> {
    let primes =
        |name: &String| -> Vec<String> { (0..4).map(|k| format!("{name}{}", "'".repeat(k))).collect() };
    let mut unknowns = names(model.states.iter().map(|s| &s.named));
    unknowns.extend(names(model.parameters.iter()));
    unknowns.extend(names(model.unknown_inputs.iter().map(|u| &u.0)).iter().flat_map(primes));
    unknowns
}

/// Name and experiment of a key: `p@2` is `p` in the second experiment.
fn in_one(name: &str) -> (String, Option<String>) {
    name.split_once('@').map_or((name.to_string(), None), |(n, e)| (n.into(), Some(e.to_string())))
}

/// Names of the entries of a key: `p` stands for all of p[1], p[2], ..., `p@2` for these in the second
/// experiment.
fn entries_of(name: &str, shapes: &Shapes) -> Vec<String> {
    let (name, experiment) = in_one(name);
    let plain = name.trim_end_matches('\'');
    let end = format!("{}{}", &name[plain.len()..], experiment.map(|e| format!("@{e}")).unwrap_or_default());
    let entries = shapes.get(plain).map_or_else(|| vec![plain.to_string()], |s| s.names(plain));
    entries.into_iter().map(|n| format!("{n}{end}")).collect()
}

/// Table of numbers by name.
struct NumberTable<'a> {
    /// Name of the table.
    what: &'a str,
    entries: &'a BTreeMap<String, Spanned<Value>>,
    /// Names that may have a number.
    names: &'a [String],
    shapes: &'a Shapes,
    /// True if all numbers are above 0.
    positive: bool,
}

/// Reader of numbers for a simulation.
struct NominalReader<'a> {
    r: &'a ModelReader<'a>,
    /// Number of experiments of the model.
    experiments: usize,
}

impl NominalReader<'_> {
    /// Refuses a key whose entries are not among `list`, or whose experiment does not exist.
    fn known(
        &self,
        what: &str,
        name: &str,
        entries: &[String],
        list: &[String],
        span: Range<usize>,
    ) -> Result<(), ModelError> {
        let one_of_them = |e: &String| e.parse().is_ok_and(|e: usize| (1..=self.experiments).contains(&e));
        if entries
            .iter()
            .map(|e| in_one(e))
            .all(|(n, e)| list.contains(&n) && e.as_ref().is_none_or(one_of_them))
        {
            return Ok(());
        }
        let hint = nearest(name, list).map(|h| format!("; did you mean `{h}`?")).unwrap_or_default();
        let message = format!("`{name}` is not known here{hint}");
        Err(self.r.at(span, format!("{what} of the simulation"), message))
    }

    /// Adds the numbers of a table to `target`.
    fn numbers(&self, table: &NumberTable<'_>, target: &mut BTreeMap<String, f64>) -> Result<(), ModelError> {
        // entries with an index come after the whole
        let mut ordered: Vec<_> = table.entries.iter().collect();
        ordered.sort_by_key(|(name, _)| name.contains('['));
        for (name, value) in ordered {
            let entries = entries_of(name, table.shapes);
            self.known(table.what, name, &entries, table.names, value.span())?;
            let given = self.given(table, name, value, entries.len())?;
            target.extend(entries.into_iter().zip(given));
        }
        Ok(())
    }

    /// Numbers of a key, as many as it has entries.
    fn given(
        &self,
        table: &NumberTable<'_>,
        name: &str,
        value: &Spanned<Value>,
        entries: usize,
    ) -> Result<Vec<f64>, ModelError> {
        let one = if table.positive { "a number above 0" } else { "a number" };
        let refuse = |found: &str| {
            let expected = match entries {
                1 => one.to_string(),
                n => format!("{one}, or a list of {n}"),
            };
            let what = format!("{} of {name}", table.what);
            self.r.at(value.span(), what, format!("{found}expected {expected}"))
        };
        let mut given = numbers(value.get_ref())
            .ok_or_else(|| refuse(&format!("found a {}; ", value.get_ref().type_str())))?;
        if given.iter().any(|x| !x.is_finite() || (table.positive && *x <= 0.0)) {
            return Err(refuse(""));
        }
        if given.len() == 1 && !value.get_ref().is_array() {
            given = vec![given[0]; entries];
        }
        if given.len() != entries {
            return Err(refuse(&format!("found {} numbers; ", given.len())));
        }
        Ok(given)
    }

    /// Sets `target` to a number above 0, if the file gives it.
    fn positive(
        &self,
        what: &str,
        value: Option<&Spanned<f64>>,
        target: &mut Option<f64>,
    ) -> Result<(), ModelError> {
        let Some(value) = value else { return Ok(()) };
        if !(value.get_ref().is_finite() && *value.get_ref() > 0.0) {
            let message = "expected a number above 0".into();
            return Err(self.r.at(value.span(), format!("{what} of the simulation"), message));
        }
        *target = Some(*value.get_ref());
        Ok(())
    }

    /// Adds known inputs as functions of the time to `target`; `generic` are the known inputs of the model.
    fn inputs(
        &self,
        inputs: &BTreeMap<String, Spanned<Value>>,
        generic: &[String],
        target: &mut BTreeMap<String, PlacedExpression>,
    ) -> Result<(), ModelError> {
        for (name, value) in inputs {
            let entries = entries_of(name, &self.r.shapes);
            self.known("inputs", name, &entries, generic, value.span())?;
            let what = format!("the input {name} of the simulation");
            let formulas = self.r.fitted((name, &what), value.get_ref(), value.span())?;
            for (name, formula) in entries.into_iter().zip(formulas) {
                let other =
                    formula.expression.nodes.iter().position(|n| matches!(n, Node::Name(n) if n != "t"));
                if let Some(i) = other {
                    let message = "expected a function of the time t alone".into();
                    return Err(formula.place.error(message, formula.expression.spans[i].clone()));
                }
                target.insert(name, formula);
            }
        }
        Ok(())
    }
}
