//! Maps that take every solution of a rational model to another: unknowns change their signs, or exchange.
//!
//! A map of states and constants is valid if right-hand sides, outputs, known starts, constraints and jumps
//! transform accordingly. Changes of sign are found structurally: the sign of a product is the product of
//! signs, and both terms of a sum have the same sign. This is a linear system over two elements, without
//! random choices. Exchanges are tried, and must hold at a random point of each prime field.

use std::collections::{BTreeMap, BTreeSet};

use obsdeg_exact::{Field, SplitMix64};

use super::constraints::below;
use super::dag::{Dag, Op};
use super::model::compiled::{Compiled, Role};
use super::rows::layout::{Layout, Unknown};
use super::values::Values;

/// Largest number of slots of unknowns among which exchanges of two and of three pairs are tried.
const TWO_PAIRS: usize = 24;
const THREE_PAIRS: usize = 10;

/// Map of unknown states and constants: for each slot the slot that replaces it, and true if its sign
/// changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Twin {
    images: BTreeMap<usize, (usize, bool)>,
}

/// Set of slots, for sums modulo two.
type Parity = BTreeSet<usize>;

fn sum(a: &Parity, b: &Parity) -> Parity {
    a.symmetric_difference(b).copied().collect()
}

/// Maps of a model that change an observable unknown.
pub(super) fn twins(
    compiled: &Compiled,
    layout: &Layout,
    degrees: &[Option<usize>],
    fields: [Field; 2],
    rng: &mut SplitMix64,
) -> Vec<Twin> {
    let is_observable = |slot: &usize| {
        let role = compiled.roles[*slot];
        layout.unknowns.iter().zip(degrees).any(|(u, d)| u.role == role && d.is_some())
    };
    // a known start without a formula is a number that no map changes
    let unknown = |slot: &usize| match compiled.roles[*slot] {
        role @ Role::State(s) => {
            compiled.starts[s].is_some() || layout.unknowns.iter().any(|u| u.role == role)
        }
        Role::Parameter(_) | Role::UnknownInput(_) => true,
        _ => false,
    };
    let slots: Vec<usize> = (0..compiled.roles.len()).filter(unknown).collect();
    let mut out: Vec<Twin> = Vec::new();
    for signs in negations(compiled, &slots) {
        if signs.iter().any(is_observable) {
            out.push(Twin { images: signs.into_iter().map(|s| (s, (s, true))).collect() });
        }
    }
    let points: Vec<TestPoint> =
        fields.into_iter().filter_map(|f| TestPoint::new(compiled, f, rng)).collect();
    for pairs in exchanges(compiled, &slots) {
        let images = pairs.iter().flat_map(|&(a, b)| [(a, (b, false)), (b, (a, false))]).collect();
        let twin = Twin { images };
        let new = pairs.iter().any(|p| is_observable(&p.0) || is_observable(&p.1));
        if new && points.len() == 2 && points.iter().all(|p| p.holds(compiled, &twin)) {
            out.push(twin);
        }
    }
    out
}

/// Nodes that a map must transform, each with the state it belongs to: rates, starts and jumps; outputs
/// belong to none.
fn carried(compiled: &Compiled) -> Vec<(Option<usize>, usize)> {
    let slot = |s: usize| compiled.roles.iter().position(|r| *r == Role::State(s));
    let mut out = Vec::new();
    for e in 0..compiled.experiments.len() {
        out.extend(compiled.rates(e).iter().enumerate().map(|(s, &node)| (slot(s), node)));
        out.extend(compiled.outputs(e).iter().map(|&node| (None, node)));
    }
    out.extend(compiled.starts.iter().enumerate().filter_map(|(s, node)| Some((slot(s), (*node)?))));
    let jumps = compiled.segments.iter().flat_map(|s| &s.carry);
    out.extend(jumps.map(|&(s, node)| (slot(s), node)));
    out
}

/// Independent sets of slots whose signs may change together.
fn negations(compiled: &Compiled, slots: &[usize]) -> Vec<Parity> {
    let dag = &compiled.dag;
    let carried = carried(compiled);
    let roots = carried.iter().map(|c| c.1).chain(compiled.constraints.iter().copied());
    let needed: BTreeSet<usize> = roots.flat_map(|node| below(dag, node)).collect();
    let mut signs: BTreeMap<usize, Parity> = BTreeMap::new();
    // sums of slots' signs that must be even
    let mut even: Vec<Parity> = Vec::new();
    for &i in &needed {
        let of = |node: usize| signs.get(&node).cloned().unwrap_or_default();
        let sign = match dag.ops[i] {
            Op::Slot(s) if slots.contains(&s) => Parity::from([s]),
            Op::Number { .. } | Op::Slot(_) | Op::Pi => Parity::new(),
            Op::Add(a, b) | Op::Subtract(a, b) => match (is_zero(dag, a), is_zero(dag, b)) {
                (true, _) => of(b),
                (_, true) => of(a),
                _ => {
                    even.push(sum(&of(a), &of(b)));
                    of(a)
                }
            },
            Op::Multiply(a, b) | Op::Divide(a, b) => sum(&of(a), &of(b)),
            // the sign of its argument must not change
            Op::Primitive { of: argument, .. } => {
                even.push(of(argument));
                Parity::new()
            }
        };
        signs.insert(i, sign);
    }
    for (slot, node) in carried {
        if !is_zero(dag, node) {
            let own: Parity = slot.into_iter().filter(|s| slots.contains(s)).collect();
            even.push(sum(&signs[&node], &own));
        }
    }
    null_sets(slots, even)
}

fn is_zero(dag: &Dag, node: usize) -> bool {
    matches!(dag.ops[node], Op::Number { mantissa: 0, .. })
}

/// Basis of the sets of slots that share an even number with every one of `even`.
fn null_sets(slots: &[usize], even: Vec<Parity>) -> Vec<Parity> {
    // reduced rows by their pivots
    let mut rows: BTreeMap<usize, Parity> = BTreeMap::new();
    for mut row in even {
        for (pivot, other) in &rows {
            if row.contains(pivot) {
                row = sum(&row, other);
            }
        }
        let Some(&pivot) = row.first() else { continue };
        for other in rows.values_mut().filter(|o| o.contains(&pivot)) {
            *other = sum(other, &row);
        }
        rows.insert(pivot, row);
    }
    let free = slots.iter().filter(|s| !rows.contains_key(s));
    let set = |&s: &usize| -> Parity {
        let dependent = rows.iter().filter(|(_, row)| row.contains(&s)).map(|(&pivot, _)| pivot);
        dependent.chain([s]).collect()
    };
    free.map(set).collect()
}

/// Exchanges that are tried: one pair, then two and three disjoint ones, of unknowns of one kind.
fn exchanges(compiled: &Compiled, slots: &[usize]) -> Vec<Vec<(usize, usize)>> {
    let kind = |slot: usize| std::mem::discriminant(&compiled.roles[slot]);
    let mut pairs = Vec::new();
    for (i, &a) in slots.iter().enumerate() {
        pairs.extend(slots[i + 1..].iter().filter(|&&b| kind(a) == kind(b)).map(|&b| (a, b)));
    }
    if slots.len() > TWO_PAIRS {
        return Vec::new();
    }
    let mut out: Vec<Vec<(usize, usize)>> = pairs.iter().map(|&p| vec![p]).collect();
    let mut last = out.clone();
    for _ in 1..if slots.len() > THREE_PAIRS { 2 } else { 3 } {
        let mut next = Vec::new();
        for list in &last {
            let apart = |p: &&(usize, usize)| {
                list.iter().all(|q| *q < **p && ![q.0, q.1].contains(&p.0) && ![q.0, q.1].contains(&p.1))
            };
            next.extend(pairs.iter().filter(apart).map(|&p| [&list[..], &[p]].concat()));
        }
        out.extend(next.iter().cloned());
        last = next;
    }
    out
}

/// Random point of a field at which maps are tested, with the values of all nodes there.
struct TestPoint {
    f: Field,
    point: Vec<u64>,
    nodes: Vec<u64>,
}

impl TestPoint {
    fn new(compiled: &Compiled, f: Field, rng: &mut SplitMix64) -> Option<Self> {
        let point: Vec<u64> = compiled.roles.iter().map(|_| rng.below(f.modulus())).collect();
        let nodes = values(&compiled.dag, &f, &point)?;
        Some(Self { f, point, nodes })
    }

    /// True if all nodes transform with an exchange.
    fn holds(&self, compiled: &Compiled, twin: &Twin) -> bool {
        let image = |slot: usize| twin.images.get(&slot).map_or(slot, |i| i.0);
        let moved: Vec<u64> = (0..self.point.len()).map(|s| self.point[image(s)]).collect();
        let Some(nodes) = values(&compiled.dag, &self.f, &moved) else { return false };
        let state = |s: usize| {
            let slot = compiled.roles.iter().position(|r| *r == Role::State(s)).unwrap_or(usize::MAX);
            match compiled.roles.get(image(slot)) {
                Some(&Role::State(i)) => i,
                _ => s,
            }
        };
        let same = |here: usize, there: usize| nodes[here] == self.nodes[there];
        let experiment = |e: usize| {
            let (rates, outputs) = (compiled.rates(e), compiled.outputs(e));
            (0..rates.len()).all(|s| same(rates[s], rates[state(s)])) && outputs.iter().all(|&o| same(o, o))
        };
        let start = |s: usize| match (compiled.starts[s], compiled.starts[state(s)]) {
            (Some(a), Some(b)) => same(a, b),
            (None, None) => true,
            _ => false,
        };
        let jumps = |segment: &super::model::compiled::CompiledSegment| {
            let of = |s: usize| segment.carry.iter().find(|c| c.0 == s).map(|c| c.1);
            (0..compiled.starts.len()).all(|s| match (of(s), of(state(s))) {
                (Some(a), Some(b)) => same(a, b),
                (None, None) => true,
                _ => false,
            })
        };
        let held = |of: &[u64]| -> Vec<u64> {
            let mut out: Vec<u64> = compiled.constraints.iter().map(|&c| of[c]).collect();
            out.sort_unstable();
            out
        };
        (0..compiled.experiments.len()).all(experiment)
            && (0..compiled.starts.len()).all(start)
            && compiled.segments.iter().all(jumps)
            && held(&nodes) == held(&self.nodes)
    }
}

/// Value of every node of a rational graph; `None` for a division by zero or a function.
fn values(dag: &Dag, f: &Field, slots: &[u64]) -> Option<Vec<u64>> {
    let mut out: Vec<u64> = Vec::with_capacity(dag.ops.len());
    for op in &dag.ops {
        out.push(match *op {
            Op::Number { mantissa, decimals } => Values::number(f, mantissa, decimals),
            Op::Slot(s) => slots[s],
            Op::Add(a, b) => f.add(out[a], out[b]),
            Op::Subtract(a, b) => f.sub(out[a], out[b]),
            Op::Multiply(a, b) => f.mul(out[a], out[b]),
            Op::Divide(_, b) if out[b] == 0 => return None,
            Op::Divide(a, b) => f.mul(out[a], f.inv(out[b])),
            Op::Pi | Op::Primitive { .. } => return None,
        });
    }
    Some(out)
}

/// Index of the unknown in another slot that corresponds to `u`.
fn in_slot(compiled: &Compiled, layout: &Layout, u: &Unknown, slot: usize) -> Option<usize> {
    let role = compiled.roles[slot];
    let same = |o: &Unknown| {
        o.role == role
            && o.derivative == u.derivative
            && (o.experiment == u.experiment || o.experiment.is_none())
    };
    layout.unknowns.iter().position(same)
}

impl Twin {
    /// Slot that replaces an unknown, its own or another, and true if the sign changes.
    fn image(&self, compiled: &Compiled, layout: &Layout, unknown: usize) -> Option<(usize, bool)> {
        let u = &layout.unknowns[unknown];
        let slot = compiled.roles.iter().position(|r| *r == u.role)?;
        let Some(&(to, negative)) = self.images.get(&slot) else { return Some((unknown, false)) };
        Some((in_slot(compiled, layout, u, to)?, negative))
    }

    /// Map in words: `negate q[1], q[2]`, `swap k1 and k2, x1 and x2`.
    pub(super) fn words(&self, compiled: &Compiled, name: &dyn Fn(Role) -> String) -> String {
        let of = |slot: usize| name(compiled.roles[slot]);
        let negated: Vec<String> = self.images.iter().filter(|i| i.1.1).map(|i| of(*i.0)).collect();
        if !negated.is_empty() {
            return format!("negate {}", negated.join(", "));
        }
        let pairs = self.images.iter().filter(|(a, b)| **a < b.0);
        let pairs: Vec<String> = pairs.map(|(&a, b)| format!("{} and {}", of(a), of(b.0))).collect();
        format!("swap {}", pairs.join(", "))
    }
}

/// Number of distinct values that the maps give to an unknown at a point (values by unknown): a lower bound
/// on its number of solutions.
pub(super) fn images(
    twins: &[Twin],
    compiled: &Compiled,
    layout: &Layout,
    f: &Field,
    at: &[u64],
    unknown: usize,
) -> usize {
    let (mut seen, mut left) = (BTreeSet::from([(unknown, false)]), vec![(unknown, false)]);
    while let Some((here, negative)) = left.pop() {
        for twin in twins {
            if let Some((to, sign)) = twin.image(compiled, layout, here)
                && seen.insert((to, negative != sign))
            {
                left.push((to, negative != sign));
            }
        }
    }
    let value =
        |&(unknown, negative): &(usize, bool)| if negative { f.neg(at[unknown]) } else { at[unknown] };
    seen.iter().map(value).collect::<BTreeSet<u64>>().len()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The basis generates all sets of five slots with an even number in common with every given one, by
    /// enumeration.
    #[test]
    fn null_sets_are_all() {
        let slots = [2, 3, 5, 7, 11];
        let even: Vec<Parity> = vec![[2, 3].into(), [5, 7, 11].into(), [2, 3, 5, 7, 11].into()];
        let basis = null_sets(&slots, even.clone());
        let set = |code: usize| -> Parity {
            slots.iter().enumerate().filter(|(i, _)| code >> i & 1 == 1).map(|s| *s.1).collect()
        };
        let good = |s: &Parity| even.iter().all(|e| e.intersection(s).count() % 2 == 0);
        let brute: BTreeSet<Parity> = (0..32).map(set).filter(good).collect();
        let spanned: BTreeSet<Parity> = (0..1usize << basis.len())
            .map(|code| {
                let chosen = basis.iter().enumerate().filter(|(i, _)| code >> i & 1 == 1);
                chosen.fold(Parity::new(), |s, b| sum(&s, b.1))
            })
            .collect();
        assert_eq!(spanned, brute);
        assert_eq!(brute.len(), 8);
    }
}
