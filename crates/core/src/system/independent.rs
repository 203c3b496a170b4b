//! Functions whose values are independent of each other at a generic point. Random values then replace them,
//! and prime fields decide as for rational models.
//!
//! Let `u_1 .. u_m` be the arguments of exp and tanh, and the logarithms; let `v_1 .. v_l` be the arguments
//! of sin, cos and tan, and the arc tangents. Assume that no combination of the `u` with rational
//! coefficients, not all zero, is constant, and none of the `v`. Then all `exp u_i`, `exp(i v_j)`,
//! logarithms and arc tangents together are algebraically independent over the rational functions of the
//! unknowns. This is Ax's theorem (Ax 1971, doi:10.2307/1970774: the transcendence degree of `(w, exp w)` is
//! at least the number of independent `w` plus the rank of their differentials), applied to the `u`, the
//! `i v` and generic multiples of all variables, by induction over functions of functions. So a point with
//! random values of the functions is a generic point, and the degree of every minor in these values is
//! bounded as for any other variable (crates/README.md, *Certainty*).
//!
//! The rank of the gradients proves that no combination is constant. The gradients stand side by side at
//! random points of a prime field: a rank modulo a prime is never too large. If the rank is not full, or an
//! argument is special (a given start or value, the time, a jump), nothing is concluded, and real numbers of
//! many digits decide.

use std::collections::BTreeSet;

use obsdeg_exact::{Echelon, Field, Reals, SplitMix64};

use super::constraints::slots_of;
use super::dag::Op;
use super::model::compiled::{Compiled, Role};
use super::model::{KnownInput, StateStart, SystemModel};
use super::rows::layout::Layout;
use super::rows::point::{PointBuilder, random_field};
use super::taylor::{Signal, Taylor};
use super::values::Values;
use super::work::{Spent, Work, WorkStep};
use crate::language::Function;

/// Largest number of points at which gradients are computed.
const POINTS: usize = 32;

/// Set of a function: true if it takes the exponential of its argument, false if it is a logarithm itself;
/// true for real, false for imaginary arguments. `None` for other functions.
fn family(function: Function) -> Option<(bool, bool)> {
    match function {
        Function::Exp | Function::Tanh => Some((false, true)),
        Function::Log => Some((true, true)),
        Function::Sin | Function::Cos | Function::Tan => Some((false, false)),
        Function::Atan => Some((true, false)),
        Function::Asin | Function::Acos | Function::Sqrt | Function::Abs | Function::Sign => None,
    }
}

/// Number of functions, if their values are proven to be independent and there is a real point at which all
/// are defined; `None` otherwise.
pub(super) fn independent_functions(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    rng: &mut SplitMix64,
    spent: &mut Spent,
) -> Option<usize> {
    let functions = functions(compiled);
    if functions.is_empty() {
        return Some(0);
    }
    if model.experiments > 1 || !compiled.constraints.is_empty() {
        return None;
    }
    // exp u and tanh u count as one, as do sin v, cos v, tan v; exp(log x) and log x do not
    let mut sets: [BTreeSet<(bool, usize)>; 2] = Default::default();
    for &(node, function, of) in &functions {
        let (inverse, real) = family(function)?;
        if slots_of(&compiled.dag, of).into_iter().any(|s| !is_generic(model, compiled.roles[s])) {
            return None;
        }
        sets[usize::from(real)].insert((inverse, if inverse { node } else { of }));
    }
    // beyond the limit of work nothing is concluded
    let work = Work::new(model.work_limit);
    let builder = PointBuilder { model, compiled, layout, field: random_field(rng), work: &work };
    let free = sets.iter().all(|nodes| is_free(&builder, nodes, rng))
        && is_somewhere(model, compiled, layout, rng, &work);
    spent.add(&work);
    free.then_some(functions.len())
}

/// True if there is a real point at which rates and outputs are defined: then they are defined around it.
fn is_somewhere(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    rng: &mut SplitMix64,
    work: &Work,
) -> bool {
    let field = Reals::<2>;
    let builder = PointBuilder { model, compiled, layout, field, work };
    let roots: Vec<usize> =
        compiled.rates(0).iter().chain(compiled.outputs(0)).chain(&compiled.combinations).copied().collect();
    (0..<Reals<2> as Values>::ATTEMPTS).any(|attempt| {
        let Some(values) = builder.values(rng, attempt) else { return false };
        let starts = vec![None; values.len()];
        let signals = values.into_iter().map(|value| Signal::Constant { value, component: None }).collect();
        let seed = SplitMix64::new(0);
        Taylor::new(&compiled.dag, field, 0, signals, &starts, &roots, false, seed, work).is_ok()
    })
}

/// Functions in rates, outputs, starts, constants and jumps: node, kind, argument.
fn functions(compiled: &Compiled) -> Vec<(usize, Function, usize)> {
    let dag = &compiled.dag;
    let experiments = 0..compiled.experiments.len();
    let own = experiments.flat_map(|e| {
        let given = compiled.constants(e).iter().flatten();
        compiled.rates(e).iter().chain(compiled.outputs(e)).chain(given)
    });
    let segments =
        compiled.segments.iter().flat_map(|s| s.constants.iter().chain(&s.carry)).map(|(_, node)| node);
    let mut left: Vec<usize> = own
        .chain(compiled.starts.iter().flatten())
        .chain(segments)
        .chain(&compiled.combinations)
        .copied()
        .collect();
    let mut seen = vec![false; dag.ops.len()];
    let mut out = Vec::new();
    while let Some(i) = left.pop() {
        if std::mem::replace(&mut seen[i], true) {
            continue;
        }
        match dag.ops[i] {
            Op::Number { .. } | Op::Slot(_) | Op::Pi => {}
            Op::Add(a, b) | Op::Subtract(a, b) | Op::Multiply(a, b) | Op::Divide(a, b) => left.extend([a, b]),
            Op::Primitive { function, of, weight } => {
                out.push((i, function, of));
                left.extend([of, weight]);
            }
        }
    }
    out
}

/// True if the slots of an argument have generic values at the beginning of every run and segment, the same
/// in all of them; or if it is a number that never changes.
fn is_generic(model: &SystemModel, role: Role) -> bool {
    let changes = |name: &str| model.segments.iter().any(|s| s.constants.iter().any(|c| c.0 == name));
    let jumps = |name: &str| model.segments.iter().any(|s| s.carry.iter().any(|c| c.0 == name));
    match role {
        Role::State(i) => {
            let s = &model.states[i];
            !matches!(s.start, StateStart::Value(_)) && !jumps(&s.named.name)
        }
        Role::Parameter(_) | Role::UnknownInput(_) => true,
        Role::KnownInput(i) => !matches!(model.known_input(0, i), KnownInput::Function(_)),
        Role::Constant(i) => !changes(&model.constants[i].0.name),
        Role::Time => false,
    }
}

/// True if no combination of these nodes is constant: their gradients by all generic slots, side by side at
/// some points, have full rank.
fn is_free(
    builder: &PointBuilder<'_, '_, Field>,
    nodes: &BTreeSet<(bool, usize)>,
    rng: &mut SplitMix64,
) -> bool {
    let compiled = builder.compiled;
    let roots: Vec<usize> = nodes.iter().map(|n| n.1).collect();
    let given =
        |s: usize| matches!(compiled.roles[s], Role::Constant(c) if compiled.constants(0)[c].is_some());
    let components: Vec<usize> = (0..compiled.roles.len()).filter(|&s| !given(s)).collect();
    let mut rows: Vec<Vec<u64>> = vec![Vec::new(); roots.len()];
    for _ in 0..POINTS.min(roots.len()) {
        let Some(values) = builder.values(rng, 0) else { return false };
        let signal = |(s, value): (usize, &u64)| Signal::Constant {
            value: *value,
            component: components.binary_search(&s).ok(),
        };
        let signals = values.iter().enumerate().map(signal).collect();
        let (starts, seed) = (vec![None; values.len()], SplitMix64::new(0));
        let dag = &compiled.dag;
        let at = Taylor::new(
            dag,
            builder.field,
            components.len(),
            signals,
            &starts,
            &roots,
            false,
            seed,
            builder.work,
        );
        let Ok(at) = at else { return false };
        for (row, &node) in rows.iter_mut().zip(&roots) {
            let start = row.len();
            row.resize(start + components.len(), 0);
            for (&component, x) in at.components_of(node).iter().zip(at.dual(node, 0)) {
                row[start + component as usize] = *x;
            }
        }
        // each row against all before it
        let (count, columns) = (rows.len() as u64, rows[0].len() as u64);
        let elimination = count.saturating_mul(count).saturating_mul(columns);
        if builder
            .work
            .take(WorkStep::Independence, elimination, 8 * count.saturating_mul(2 * columns))
            .is_err()
        {
            return false;
        }
        let mut space = Echelon::new(builder.field, rows[0].len());
        if rows.iter().all(|row| space.insert(row)) {
            return true;
        }
    }
    roots.is_empty()
}
