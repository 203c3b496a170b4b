//! Numbers for a simulation in a model file.

use std::collections::BTreeMap;
use std::ops::Range;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_spanned::Spanned;
use toml::Value;

use super::error::ModelError;
use super::model::{Named, SystemModel};
use super::reader::ModelReader;
use crate::language::{Node, Shapes, nearest};

/// Numbers for a simulation, in the units of the model.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SimulationEntry {
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
    entry: &SimulationEntry,
    model: &mut SystemModel,
) -> Result<(), ModelError> {
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
    let outputs_known = names(&mut model.outputs.iter().map(|o| &o.0));
    // `p` stands for all of p[1], p[2], ..., `p@2` for these in the second experiment
    let experiments = model.experiments;
    let in_one = |name: &str| {
        name.split_once('@').map_or((name.to_string(), None), |(n, e)| (n.into(), Some(e.to_string())))
    };
    let entries = |name: &str, shapes: &Shapes| -> Vec<String> {
        let (name, experiment) = in_one(name);
        let plain = name.trim_end_matches('\'');
        let end =
            format!("{}{}", &name[plain.len()..], experiment.map(|e| format!("@{e}")).unwrap_or_default());
        let entries = shapes.get(plain).map_or_else(|| vec![plain.to_string()], |s| s.names(plain));
        entries.into_iter().map(|n| format!("{n}{end}")).collect()
    };
    let known = |what: &str, name: &str, entries: &[String], list: &[String], span: Range<usize>| {
        let one_of_them = |e: &String| e.parse().is_ok_and(|e: usize| (1..=experiments).contains(&e));
        if entries
            .iter()
            .map(|e| in_one(e))
            .all(|(n, e)| list.contains(&n) && e.as_ref().is_none_or(one_of_them))
        {
            return Ok(());
        }
        let hint = nearest(name, list).map(|h| format!("; did you mean `{h}`?")).unwrap_or_default();
        Err(r.at(span, format!("{what} of the simulation"), format!("`{name}` is not known here{hint}")))
    };
    let nominal = &mut model.simulation;
    for (what, map, list, shapes, target, positive) in [
        ("values", &entry.values, &values, &r.shapes, &mut nominal.values, false),
        ("priors", &entry.priors, &unknowns, &r.shapes, &mut nominal.priors, true),
        ("noise", &entry.noise, &outputs_known, outputs, &mut nominal.noise, true),
    ] {
        // entries with an index come after the whole
        let mut ordered: Vec<_> = map.iter().collect();
        ordered.sort_by_key(|(name, _)| name.contains('['));
        for (name, value) in ordered {
            let entries = entries(name, shapes);
            known(what, name, &entries, list, value.span())?;
            let one = if positive { "a number above 0" } else { "a number" };
            let refuse = |found: &str| {
                let expected = match entries.len() {
                    1 => one.to_string(),
                    n => format!("{one}, or a list of {n}"),
                };
                r.at(value.span(), format!("{what} of {name}"), format!("{found}expected {expected}"))
            };
            let mut given = numbers(value.get_ref())
                .ok_or_else(|| refuse(&format!("found a {}; ", value.get_ref().type_str())))?;
            if given.iter().any(|x| !x.is_finite() || (positive && *x <= 0.0)) {
                return Err(refuse(""));
            }
            if given.len() == 1 && !value.get_ref().is_array() {
                given = vec![given[0]; entries.len()];
            }
            if given.len() != entries.len() {
                return Err(refuse(&format!("found {} numbers; ", given.len())));
            }
            target.extend(entries.into_iter().zip(given));
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
        let entries = entries(name, &r.shapes);
        known("inputs", name, &entries, &generic, value.span())?;
        let what = format!("the input {name} of the simulation");
        let formulas = r.fitted((name, &what), value.get_ref(), value.span())?;
        for (name, formula) in entries.into_iter().zip(formulas) {
            let other = formula.expression.nodes.iter().position(|n| matches!(n, Node::Name(n) if n != "t"));
            if let Some(i) = other {
                let message = "expected a function of the time t alone".into();
                return Err(formula.place.error(message, formula.expression.spans[i].clone()));
            }
            nominal.inputs.insert(name, formula);
        }
    }
    Ok(())
}
