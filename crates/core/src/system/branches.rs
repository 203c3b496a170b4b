//! Branches of the functions of a model, and the sides of them on which it was judged.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Serialize;

use super::constraints::slots_of;
use super::dag::Op;
use super::model::SystemModel;
use super::model::compiled::{Compiled, Role};
use super::text::text;
use crate::language::Function;

/// Side of a branch of abs or sign on which the verdicts were computed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct BranchSide {
    /// Condition on the argument of abs or sign that holds at the start of the runs at both random points,
    /// and with it where the verdicts hold: `t - 7 < 0`. An argument that had either sign is named with both.
    pub condition: String,
    /// True if the argument depends on the time.
    pub of_time: bool,
    /// True if the file gives the value of the argument at the start: known starts and constants, and no
    /// second segment.
    pub given: bool,
}

/// True if not all values of a slot are given.
fn varies(compiled: &Compiled, slot: usize) -> bool {
    match compiled.roles[slot] {
        Role::Constant(c) => (0..compiled.experiments.len()).any(|e| compiled.constants(e)[c].is_none()),
        _ => true,
    }
}

/// True if the value of a node at the start of the first segment is given: it depends only on states with
/// given starts and on given constants.
fn is_given(compiled: &Compiled, node: usize) -> bool {
    slots_of(&compiled.dag, node).into_iter().all(|s| match compiled.roles[s] {
        Role::State(i) => compiled.starts[i].is_some_and(|start| !open(compiled, start)),
        _ => !varies(compiled, s),
    })
}

/// True if a node depends on a value that is not given.
fn open(compiled: &Compiled, node: usize) -> bool {
    slots_of(&compiled.dag, node).into_iter().any(|s| varies(compiled, s))
}

/// Functions with branches whose argument is not given: it depends on unknowns, inputs, generic constants or
/// the time.
pub(super) fn branches(compiled: &Compiled) -> Vec<String> {
    let branched = [Function::Abs, Function::Sign, Function::Sqrt, Function::Asin, Function::Acos];
    let taken = |f: Function| {
        compiled.dag.ops.iter().any(|op| {
            // sign is the derivative of abs
            matches!(*op, Op::Primitive { function, of, .. } if function == f
                && !(f == Function::Sign && compiled.dag.has(Function::Abs, of))
                && open(compiled, of))
        })
    };
    let named = Function::ALL.iter().filter(|(_, f)| branched.contains(f) && taken(*f));
    named.map(|(name, _)| name.to_string()).collect()
}

/// Arguments of abs and sign that are not given, in the order of the graph.
pub(super) fn sided(compiled: &Compiled) -> Vec<usize> {
    let of = |op: &Op| match *op {
        Op::Primitive { function: Function::Abs | Function::Sign, of, .. } => Some(of),
        _ => None,
    };
    let all: BTreeSet<usize> = compiled.dag.ops.iter().filter_map(of).collect();
    all.into_iter().filter(|&node| open(compiled, node)).collect()
}

/// Signs of arguments, by argument and then by run (experiment by experiment, segment by segment): true if
/// positive at the start of the run, false if negative; `None` if the argument takes no part in it.
pub(crate) type Signs = Vec<Vec<Option<bool>>>;

/// Sides of the branches at two points, in words.
pub(super) fn sides(model: &SystemModel, compiled: &Compiled, points: &[Signs; 2]) -> Vec<BranchSide> {
    let names = model.slot_names();
    let segments = compiled.segments.len().max(1);
    let label = |run: usize| {
        let experiment = (model.experiments > 1).then(|| format!("experiment {}", run / segments + 1));
        let segment = (segments > 1).then(|| format!("segment {}", run % segments + 1));
        experiment.into_iter().chain(segment).collect::<Vec<_>>().join(", ")
    };
    let side = |positive: bool| if positive { "> 0" } else { "< 0" };
    let mut out = Vec::new();
    for (k, node) in sided(compiled).into_iter().enumerate() {
        let [first, second] = points.each_ref().map(|signs| signs.get(k).cloned().unwrap_or_default());
        let runs = first.iter().zip(&second).enumerate().filter_map(|(run, pair)| match pair {
            (Some(a), Some(b)) if a == b => Some((run, side(*a).to_string())),
            (Some(a), Some(b)) => {
                Some((run, format!("{} at one point and {} at the other", side(*a), side(*b))))
            }
            _ => None,
        });
        let runs: Vec<(usize, String)> = runs.collect();
        let Some((_, one)) = runs.first() else { continue };
        let argument =
            text(&compiled.dag, node, &names).unwrap_or_else(|| "an argument too long to print".into());
        let condition = match runs.iter().all(|(_, side)| side == one) {
            true => format!("{argument} {one}"),
            false => {
                let each = runs.iter().map(|(run, side)| format!("{argument} {side} ({})", label(*run)));
                each.collect::<Vec<_>>().join(", ")
            }
        };
        let of_time = slots_of(&compiled.dag, node).into_iter().any(|s| compiled.roles[s] == Role::Time);
        let given = segments == 1 && is_given(compiled, node);
        out.push(BranchSide { condition, of_time, given });
    }
    out
}
