//! Random points of a prime field at which the constraints of a model hold (for real numbers see `newton`).
//!
//! Constraints are solved block by block. A block contains all constraints without free values other than
//! those of one of them. All of its constraints but one must be linear in the values that are solved for. So
//! they leave a line, on which the last constraint is a polynomial in one unknown. A root of it in the field
//! is drawn: this solves `|q| = 1`, or the six conditions of a rotation matrix.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Serialize;

use obsdeg_exact::polynomial::{interpolate, root};
use obsdeg_exact::{Echelon, Field, SplitMix64};

use super::dag::{Dag, Op};
use super::values::ConstraintFailure;
use super::work::{PER_NODE, Work, WorkStep};

/// Number of draws of a block: half of all quadratic equations have a root in a field.
const TRIES: usize = 60;
/// Number of draws of a block without free values: only the choice of its roots differs.
const TRIES_OF_POINTS: usize = 4;
/// Highest degree of a constraint on a line.
const MAX_DEGREE: usize = 400;
/// Operations of a root of a polynomial and of its interpolation, divided by the square of its degree. The
/// powers modulo the polynomial up to the prime take 61 squares and as many products by halves, each with
/// its remainder; the interpolation takes a division of two numbers for every pair of points.
const PER_SQUARE: u64 = 512;

/// A constraint that is a product, and the factor that was taken for it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ConstraintFactor {
    /// Constraint that is a product, as written.
    pub constraint: String,
    /// Factor that is zero where the verdicts are judged.
    pub factor: String,
    /// Other factors of the constraint, by which it could hold as well.
    pub others: Vec<String>,
    /// True if the factor is the one that is zero at the values under `[simulation.values]`; otherwise it is
    /// the first with a real point at which the others are not zero, unknowns alone last.
    pub given: bool,
}

/// The slots that a node depends on.
pub(crate) fn slots_of(dag: &Dag, node: usize) -> BTreeSet<usize> {
    let ops = below(dag, node).into_iter().map(|i| dag.ops[i]);
    ops.filter_map(|op| if let Op::Slot(s) = op { Some(s) } else { None }).collect()
}

/// The nodes that a node depends on, and itself, in order.
pub(crate) fn below(dag: &Dag, node: usize) -> BTreeSet<usize> {
    let (mut out, mut left) = (BTreeSet::new(), vec![node]);
    while let Some(i) = left.pop() {
        if out.insert(i) {
            match dag.ops[i] {
                Op::Number { .. } | Op::Slot(_) | Op::Pi => {}
                Op::Add(a, b) | Op::Subtract(a, b) | Op::Multiply(a, b) | Op::Divide(a, b) => {
                    left.extend([a, b])
                }
                Op::Primitive { of, .. } => left.push(of),
            }
        }
    }
    out
}

/// Rational constraint of the graph.
struct Constraint<'a> {
    dag: &'a Dag,
    f: &'a Field,
    node: usize,
    nodes: BTreeSet<usize>,
}

impl Constraint<'_> {
    /// Number of operations of the constraint's value.
    fn operations(&self) -> u64 {
        self.node as u64 + PER_NODE * self.nodes.len() as u64
    }

    /// Numerator and denominator at given values of the slots.
    fn at(&self, values: &[u64]) -> (u64, u64) {
        let f = self.f;
        let mut out: Vec<(u64, u64)> = vec![(0, 0); self.node + 1];
        for &i in &self.nodes {
            out[i] = match self.dag.ops[i] {
                Op::Number { mantissa, decimals } => {
                    let ten = f.pow(f.from_u64(10), decimals.unsigned_abs().into());
                    let m = crate::language::from_i128(f, mantissa);
                    if decimals < 0 { (f.mul(m, ten), f.one()) } else { (m, ten) }
                }
                Op::Slot(s) => (values[s], f.one()),
                Op::Add(a, b) | Op::Subtract(a, b) => {
                    let ((a, b), (c, d)) = (out[a], out[b]);
                    let (left, right) = (f.mul(a, d), f.mul(c, b));
                    let sum = if matches!(self.dag.ops[i], Op::Add(..)) {
                        f.add(left, right)
                    } else {
                        f.sub(left, right)
                    };
                    (sum, f.mul(b, d))
                }
                Op::Multiply(a, b) => (f.mul(out[a].0, out[b].0), f.mul(out[a].1, out[b].1)),
                Op::Divide(a, b) => (f.mul(out[a].0, out[b].1), f.mul(out[a].1, out[b].0)),
                // refused before
                Op::Primitive { .. } | Op::Pi => (0, 0),
            };
        }
        out[self.node]
    }

    /// Bounds on the degrees of numerator and denominator in some slots together.
    fn degree(&self, slots: &[usize]) -> (usize, usize) {
        let mut out: Vec<(usize, usize)> = vec![(0, 0); self.node + 1];
        for &i in &self.nodes {
            let plus = |a: usize, b: usize| a.saturating_add(b);
            out[i] = match self.dag.ops[i] {
                Op::Slot(s) => (usize::from(slots.contains(&s)), 0),
                Op::Add(a, b) | Op::Subtract(a, b) => {
                    let ((a, b), (c, d)) = (out[a], out[b]);
                    (plus(a, d).max(plus(c, b)), plus(b, d))
                }
                Op::Multiply(a, b) => (plus(out[a].0, out[b].0), plus(out[a].1, out[b].1)),
                Op::Divide(a, b) => (plus(out[a].0, out[b].1), plus(out[a].1, out[b].0)),
                Op::Number { .. } | Op::Pi | Op::Primitive { .. } => (0, 0),
            };
        }
        out[self.node]
    }

    /// Coefficients of the numerator in some slots, then the constant term; `None` if it is not linear in
    /// them, which a random second difference shows.
    fn linear(&self, slots: &[usize], values: &[u64], rng: &mut SplitMix64) -> Option<Vec<u64>> {
        let f = self.f;
        if self.degree(slots).1 > 0 {
            return None;
        }
        let mut values = values.to_vec();
        let mut at = |point: &dyn Fn(usize) -> u64| {
            for (k, &s) in slots.iter().enumerate() {
                values[s] = point(k);
            }
            self.at(&values).0
        };
        let [a, b] = [0, 1].map(|_| slots.iter().map(|_| rng.below(f.modulus())).collect::<Vec<u64>>());
        let zero = at(&|_| 0);
        let sum = at(&|k| f.add(a[k], b[k]));
        let (first, second) = (at(&|k| a[k]), at(&|k| b[k]));
        if f.add(sum, zero) != f.add(first, second) {
            return None;
        }
        let mut row: Vec<u64> =
            (0..slots.len()).map(|j| f.sub(at(&|k| if k == j { f.one() } else { 0 }), zero)).collect();
        row.push(zero);
        Some(row)
    }
}

/// Changes the values of `free` slots to a random solution: the nodes `constraints` (rational, of slots
/// alone) become zero.
///
/// # Errors
/// [`ConstraintFailure`]: the constraint that could not be solved, or an exceeded limit of work.
pub(crate) fn hold(
    dag: &Dag,
    constraints: &[usize],
    values: &mut [u64],
    free: &[bool],
    f: &Field,
    rng: &mut SplitMix64,
    work: &Work,
) -> Result<(), ConstraintFailure> {
    let mut all: Vec<Constraint<'_>> = Vec::new();
    for &node in constraints {
        let nodes = below(dag, node);
        let known: usize = all.iter().map(|g| g.nodes.len()).sum();
        let bytes = 32 * (known + nodes.len()) as u64;
        work.take(WorkStep::Constraints, 2 * PER_NODE * nodes.len() as u64, bytes)?;
        all.push(Constraint { dag, f, node, nodes });
    }
    // mirrored entries are one node
    let first = |c: &usize| constraints[..*c].iter().all(|node| *node != constraints[*c]);
    let mut open: Vec<(usize, BTreeSet<usize>)> = (all.iter().enumerate().filter(|(c, _)| first(c)))
        .map(|(c, g)| (c, slots_of(dag, g.node).into_iter().filter(|&s| free[s]).collect()))
        .collect();
    while let Some((_, slots)) = open.iter().min_by_key(|(_, slots)| slots.len()) {
        let slots: Vec<usize> = slots.iter().copied().collect();
        let left: usize = open.iter().map(|(_, s)| s.len()).sum();
        work.take(WorkStep::Constraints, (left as u64).saturating_mul(slots.len() as u64), 0)?;
        let block: Vec<usize> =
            (open.iter()).filter(|(_, s)| s.iter().all(|s| slots.contains(s))).map(|(c, _)| *c).collect();
        let block_of: Vec<&Constraint<'_>> = block.iter().map(|&c| &all[c]).collect();
        // constraints without free values hold or do not hold
        let operations = block_of.iter().map(|g| g.operations()).fold(0, u64::saturating_add);
        let holds = |values: &[u64]| {
            work.take(WorkStep::Constraints, operations, 0).is_ok()
                && block_of.iter().all(|g| matches!(g.at(values), (0, d) if d != 0))
        };
        let found = match slots.is_empty() {
            true => holds(values),
            false => {
                let tries = if slots.len() <= block.len() { TRIES_OF_POINTS } else { TRIES };
                (0..tries).any(|_| solve(&block_of, &slots, values, f, rng, work).is_some() && holds(values))
            }
        };
        if !found {
            // a refusal holds for every later try
            work.take(WorkStep::Constraints, 0, 0)?;
            return Err(ConstraintFailure::Constraint(block[0]));
        }
        open.retain(|(c, _)| !block.contains(c));
        for (_, left) in &mut open {
            left.retain(|s| !slots.contains(s));
        }
    }
    Ok(())
}

/// One attempt at a block: new values for `slots`, of which as many are solved for as there are constraints.
fn solve(
    block: &[&Constraint<'_>],
    slots: &[usize],
    values: &mut [u64],
    f: &Field,
    rng: &mut SplitMix64,
    work: &Work,
) -> Option<()> {
    let m = block.len();
    let take = |operations: u64| work.take(WorkStep::Constraints, operations, 0).ok();
    // along every slot, and at the points that test whether a constraint is linear
    let operations = block.iter().map(|g| g.operations()).fold(0, u64::saturating_add);
    take(operations.saturating_mul(m as u64 + 8).saturating_add((m as u64).saturating_pow(3)))?;
    for &s in slots {
        values[s] = rng.below(f.modulus());
    }
    // choose any m of the slots
    let mut chosen = slots.to_vec();
    for i in 0..chosen.len().min(m) {
        let j = i + rng.below((chosen.len() - i) as u64) as usize;
        chosen.swap(i, j);
    }
    let chosen = chosen.get(..m)?;
    let mut linear = Echelon::new(*f, m + 1);
    let mut bent = None;
    for (k, g) in block.iter().enumerate() {
        let row = if m > 1 { g.linear(chosen, values, rng) } else { None };
        match row {
            // one constraint always remains for the end
            Some(row) if k + 1 < m || bent.is_some() => {
                linear.insert(&row);
            }
            _ if bent.is_some() => return None,
            _ => bent = Some(g),
        }
    }
    let bent = bent?;
    let line = SolutionLine::of(f, &linear, m, rng)?;
    let degree = bent.degree(chosen).0;
    if degree > MAX_DEGREE {
        return None;
    }
    let mut at = |t: u64| {
        chosen.iter().enumerate().for_each(|(k, &s)| values[s] = line.at(f, k, t));
        bent.at(values).0
    };
    let points = degree as u64 + 1;
    take(points * bent.operations() + points * points * PER_SQUARE)?;
    let samples: Vec<(u64, u64)> = (0..=degree as u64).map(|t| f.from_u64(t)).map(|t| (t, at(t))).collect();
    let polynomial = interpolate(f, &samples);
    let t = if polynomial.is_empty() { 0 } else { root(f, &polynomial, rng)? };
    at(t);
    Some(())
}

/// Line on which linear constraints hold: a point and a direction, by slot.
struct SolutionLine {
    point: Vec<u64>,
    direction: Vec<u64>,
}

impl SolutionLine {
    /// Solutions in m slots of equations whose last column is the constant term, from a random point of them;
    /// `None` if they are no line.
    fn of(f: &Field, linear: &Echelon, m: usize, rng: &mut SplitMix64) -> Option<Self> {
        let [first, second] = <[Vec<u64>; 2]>::try_from(linear.null_space()).ok()?;
        let (a, b) = (first[m], second[m]);
        let weight = rng.below(f.modulus());
        // a point of the line has 1 as its last entry, a direction has 0
        let height = f.add(a, f.mul(weight, b));
        if height == 0 {
            return None;
        }
        let scale = f.inv(height);
        let point = |k: usize| f.mul(f.add(first[k], f.mul(weight, second[k])), scale);
        let direction = |k: usize| f.sub(f.mul(first[k], b), f.mul(second[k], a));
        Some(Self { point: (0..m).map(point).collect(), direction: (0..m).map(direction).collect() })
    }

    /// Value of slot k at the parameter t.
    fn at(&self, f: &Field, k: usize, t: u64) -> u64 {
        f.add(self.point[k], f.mul(t, self.direction[k]))
    }
}
