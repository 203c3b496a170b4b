//! Addition theorems: functions of sums and multiples of arguments, written by functions of the parts.
//!
//! `exp(2x + y)` is `exp(x)^2 exp(y)`, `cos(a - b)` is `cos a cos b + sin a sin b`, and a quarter turn
//! exchanges sine and cosine. The remaining functions have arguments without such relations, so their values
//! may be independent (`independent`). Arguments are compared as polynomials with rational coefficients in
//! slots and in nodes that are no polynomials, so nothing depends on a random point.

use std::collections::{BTreeMap, HashMap};

use super::dag::{Dag, Op};
use super::functions::{gcd, plus, times};
use super::model::compiled::Compiled;
use crate::language::Function;

/// Largest number of terms of an argument.
const TERMS: usize = 24;
/// Highest power of a function of a part.
const POWER: i64 = 12;

/// A rational number in lowest terms.
type IntegerRatio = (i64, i64);
/// Factors (nodes) and their powers.
type SlotPowers = Vec<(usize, u32)>;
/// A polynomial with rational coefficients; no coefficient is zero.
type SlotPolynomial = BTreeMap<SlotPowers, IntegerRatio>;

/// An argument as a combination of kept arguments.
#[derive(Debug, Clone)]
struct ArgumentParts {
    /// Kept arguments with their multiples: `(index, multiple)`.
    of: Vec<(usize, i64)>,
    /// Number of quarter turns that are added.
    quarters: i64,
}

/// Arguments of one family of functions.
#[derive(Debug, Default)]
struct ArgumentFamily {
    /// Kept arguments: node, number of quarter turns, and divisor.
    kept: Vec<(usize, i64, i64)>,
    /// Combination of kept arguments by the node of an argument.
    parts: HashMap<usize, ArgumentParts>,
}

/// The system with every function of a sum or a multiple of other arguments written by functions of these;
/// `None` if there is none, or if multiples are large.
pub(super) fn written_apart(compiled: &Compiled) -> Option<Compiled> {
    let families = [false, true].map(|real| family(&compiled.dag, real));
    let [circular, real] = &families;
    let plain =
        |f: &ArgumentFamily| f.parts.len() == f.kept.len() && f.kept.iter().all(|k| k.1 == 0 && k.2 == 1);
    if plain(circular) && plain(real) {
        return None;
    }
    let mut dag = Dag::default();
    dag.definite.clone_from(&compiled.dag.definite);
    let mut nodes: Vec<usize> = Vec::with_capacity(compiled.dag.ops.len());
    for op in &compiled.dag.ops {
        nodes.push(match *op {
            Op::Number { .. } | Op::Slot(_) | Op::Pi => dag.add(*op),
            Op::Add(a, b) => dag.sum(nodes[a], nodes[b]),
            Op::Subtract(a, b) => dag.difference(nodes[a], nodes[b]),
            Op::Multiply(a, b) => dag.product(nodes[a], nodes[b]),
            Op::Divide(a, b) => dag.quotient(nodes[a], nodes[b]),
            Op::Primitive { function, of, .. } => {
                let family = if matches!(function, Function::Exp | Function::Tanh) { real } else { circular };
                match family.parts.get(&of) {
                    Some(parts) if is_function_of_sums(function) => {
                        family.write(&mut dag, &nodes, function, parts)?
                    }
                    _ => dag.function(function, nodes[of]),
                }
            }
        });
    }
    Some(compiled.with(dag, &nodes))
}

/// True if the function has an addition theorem.
fn is_function_of_sums(function: Function) -> bool {
    use Function::{Cos, Exp, Sin, Tan, Tanh};
    matches!(function, Sin | Cos | Tan | Exp | Tanh)
}

/// Arguments of exp and tanh, or of sin, cos and tan: the kept ones, and the others as combinations of them.
fn family(dag: &Dag, real: bool) -> ArgumentFamily {
    let mut out = ArgumentFamily::default();
    // kept arguments, reduced: leading monomial, polynomial, and its combination of the kept arguments
    let mut reduced: Vec<(SlotPowers, SlotPolynomial, Vec<IntegerRatio>)> = Vec::new();
    let mut found: Vec<(usize, i64, Vec<IntegerRatio>)> = Vec::new();
    let mut polynomials = HashMap::new();
    let quarter = |turn: IntegerRatio| if turn.1 <= 2 { Some(turn.0 * (2 / turn.1)) } else { None };
    for op in &dag.ops {
        let Op::Primitive { function, of, .. } = *op else { continue };
        let own = matches!(function, Function::Exp | Function::Tanh) == real && is_function_of_sums(function);
        if !own || found.iter().any(|f| f.0 == of) {
            continue;
        }
        let Some(mut rest) = polynomial(dag, of, &mut polynomials) else { continue };
        // constants in an argument must be quarter turns of angles; otherwise the argument stays unchanged
        let pi = dag.ops.iter().position(|op| *op == Op::Pi);
        let turn = pi.and_then(|pi| rest.remove(&vec![(pi, 1)])).unwrap_or((0, 1));
        let Some(quarters) = quarter(turn).filter(|q| *q == 0 || !real) else { continue };
        if rest.contains_key(&Vec::new()) {
            continue;
        }
        let made = reduce(&mut rest, &reduced);
        let Some(mut made) = made else { continue };
        if let Some((leading, &(p, q))) = rest.first_key_value() {
            // independent of the other arguments: kept
            let (leading, inverse) = (leading.clone(), if p < 0 { (-q, -p) } else { (q, p) });
            made.resize(out.kept.len(), (0, 1));
            let minus = |x: &IntegerRatio| times((-x.0, x.1), inverse);
            let row: Option<Vec<IntegerRatio>> = made.iter().map(minus).chain([Some(inverse)]).collect();
            let scaled = rest.iter().map(|(m, c)| Some((m.clone(), times(*c, inverse)?)));
            let (Some(row), Some(scaled)) = (row, scaled.collect::<Option<SlotPolynomial>>()) else {
                continue;
            };
            reduced.push((leading, scaled, row));
            made = vec![(0, 1); out.kept.len()];
            made.push((1, 1));
            out.kept.push((of, quarters, 1));
            found.push((of, quarters, made));
        } else {
            found.push((of, quarters, made));
        }
    }
    for (_, _, made) in &found {
        for (kept, ratio) in out.kept.iter_mut().zip(made) {
            kept.2 = kept.2 / gcd(kept.2, ratio.1) * ratio.1;
        }
    }
    for (of, quarters, made) in found {
        let times = |(k, ratio): (usize, &IntegerRatio)| (k, ratio.0 * (out.kept[k].2 / ratio.1));
        let of_parts = made.iter().enumerate().map(times).filter(|(_, n)| *n != 0).collect();
        out.parts.insert(of, ArgumentParts { of: of_parts, quarters });
    }
    out
}

/// Subtracts multiples of reduced polynomials from `rest` as long as it contains their leading monomials.
/// Returns the multiples, by kept arguments; `None` beyond small numbers.
fn reduce(
    rest: &mut SlotPolynomial,
    reduced: &[(SlotPowers, SlotPolynomial, Vec<IntegerRatio>)],
) -> Option<Vec<IntegerRatio>> {
    let mut made = vec![(0, 1); reduced.len()];
    for (leading, polynomial, row) in reduced {
        let Some(&factor) = rest.get(leading) else { continue };
        for (monomial, &c) in polynomial {
            add(rest, monomial.clone(), times((-factor.0, factor.1), c)?)?;
        }
        for (sum, &x) in made.iter_mut().zip(row) {
            *sum = plus(*sum, times(factor, x)?)?;
        }
    }
    Some(made)
}

fn add(sum: &mut SlotPolynomial, monomial: SlotPowers, c: IntegerRatio) -> Option<()> {
    let new = plus(sum.get(&monomial).copied().unwrap_or((0, 1)), c)?;
    match new.0 {
        0 => drop(sum.remove(&monomial)),
        _ => drop(sum.insert(monomial, new)),
    }
    Some(())
}

/// A node as a polynomial; `None` if it is too large.
fn polynomial(
    dag: &Dag,
    node: usize,
    known: &mut HashMap<usize, Option<SlotPolynomial>>,
) -> Option<SlotPolynomial> {
    if let Some(found) = known.get(&node) {
        return found.clone();
    }
    let one = || Some(SlotPolynomial::from([(vec![(node, 1)], (1, 1))]));
    let number = |x: IntegerRatio| {
        let mut out = SlotPolynomial::new();
        add(&mut out, Vec::new(), x)?;
        Some(out)
    };
    let out = match (dag.rational(node), dag.ops[node]) {
        (Some(x), _) => number(x),
        (None, Op::Add(a, b) | Op::Subtract(a, b)) => {
            let minus = matches!(dag.ops[node], Op::Subtract(..));
            let (left, right) = (polynomial(dag, a, known), polynomial(dag, b, known));
            left.zip(right).and_then(|(mut sum, right)| {
                let signed = |(p, q): IntegerRatio| if minus { (-p, q) } else { (p, q) };
                right.into_iter().try_for_each(|(m, c)| add(&mut sum, m, signed(c)))?;
                Some(sum)
            })
        }
        (None, Op::Multiply(a, b)) => {
            let (left, right) = (polynomial(dag, a, known), polynomial(dag, b, known));
            left.zip(right).and_then(|(left, right)| product(&left, &right))
        }
        (None, Op::Divide(a, b)) => match dag.rational(b) {
            Some((p, q)) if p != 0 => {
                let factor = number(if p < 0 { (-q, -p) } else { (q, p) })?;
                polynomial(dag, a, known).and_then(|above| product(&above, &factor))
            }
            _ => one(),
        },
        _ => one(),
    };
    let out = out.filter(|p| p.len() <= TERMS);
    known.insert(node, out.clone());
    out
}

fn product(left: &SlotPolynomial, right: &SlotPolynomial) -> Option<SlotPolynomial> {
    let mut out = SlotPolynomial::new();
    for (m, &c) in left {
        for (n, &d) in right {
            let mut powers: BTreeMap<usize, u32> = m.iter().copied().collect();
            for (node, k) in n {
                let power = powers.entry(*node).or_default();
                *power = power.checked_add(*k)?;
            }
            add(&mut out, powers.into_iter().collect(), times(c, d)?)?;
        }
        if out.len() > TERMS {
            return None;
        }
    }
    Some(out)
}

impl ArgumentFamily {
    /// Node of a function written by functions of the kept arguments; `None` if a power is large.
    fn write(
        &self,
        dag: &mut Dag,
        nodes: &[usize],
        function: Function,
        parts: &ArgumentParts,
    ) -> Option<usize> {
        if let ([(k, 1)], 0) = (&parts.of[..], parts.quarters)
            && let (node, 0, 1) = self.kept[*k]
        {
            // the kept argument itself, or an equal one
            return Some(dag.function(function, nodes[node]));
        }
        if parts.of.iter().any(|(_, n)| n.abs() > POWER) {
            return None;
        }
        let arguments: Vec<(usize, i64)> =
            parts.of.iter().map(|&(k, n)| (self.argument(dag, nodes, k), n)).collect();
        if matches!(function, Function::Exp | Function::Tanh) {
            let mut value = dag.integer(1);
            for (argument, n) in arguments {
                let one = dag.function(Function::Exp, argument);
                let power = dag.integer_power(one, n).ok()?;
                value = dag.product(value, power);
            }
            if function == Function::Exp {
                return Some(value);
            }
            // (E^2 - 1)/(E^2 + 1)
            let (square, one) = (dag.product(value, value), dag.integer(1));
            let (above, below) = (dag.difference(square, one), dag.sum(square, one));
            return Some(dag.quotient(above, below));
        }
        let mut value = (dag.integer(1), dag.integer(0));
        for (argument, n) in arguments {
            let (cosine, sine) =
                (dag.function(Function::Cos, argument), dag.function(Function::Sin, argument));
            let one = (cosine, if n < 0 { dag.negative(sine) } else { sine });
            for _ in 0..n.abs() {
                value = turned(dag, value, one);
            }
        }
        for _ in 0..parts.quarters.rem_euclid(4) {
            value = (dag.negative(value.1), value.0);
        }
        Some(match function {
            Function::Cos => value.0,
            Function::Sin => value.1,
            _ => dag.quotient(value.1, value.0),
        })
    }

    /// Node of a kept argument, without its quarter turns, divided by its divisor.
    fn argument(&self, dag: &mut Dag, nodes: &[usize], k: usize) -> usize {
        let (node, quarters, by) = self.kept[k];
        let mut out = nodes[node];
        if quarters != 0 {
            let (pi, half) = (dag.add(Op::Pi), dag.integer(2));
            let (count, turn) = (dag.integer(quarters), dag.quotient(pi, half));
            let turns = dag.product(count, turn);
            out = dag.difference(out, turns);
        }
        let by = dag.integer(by);
        dag.quotient(out, by)
    }
}

/// Cosine and sine of a sum of two angles.
fn turned(dag: &mut Dag, a: (usize, usize), b: (usize, usize)) -> (usize, usize) {
    let products = [(a.0, b.0), (a.1, b.1), (a.1, b.0), (a.0, b.1)].map(|(x, y)| dag.product(x, y));
    (dag.difference(products[0], products[1]), dag.sum(products[2], products[3]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::model_file;
    use crate::system::taylor::{Signal, Taylor};
    use crate::system::values::Values;
    use crate::system::work::{Work, WorkLimit};
    use obsdeg_exact::{Reals, SplitMix64};

    /// Rewritten graphs keep their values, in 256 bits at a random point, and contain no two functions of
    /// related arguments.
    #[test]
    fn values_stay_what_they_are() {
        for (output, functions) in [
            ("exp(2*x + q) - exp(x)*exp(q - x/3)", 2),
            ("sin(x - q)*cos(q) + tan(3*x) - sin(2*x + pi/2)", 4),
            ("cos(q*(x + 1)) + sin(q*x - 3*pi/2 + 2*q)", 2),
            ("tanh(x) + tanh(2*x) + exp(-x/2)", 1),
            ("sin(x + 90*deg) + cos(450*deg - x)", 2),
            ("sin(log(x) + q) + sin(log(x) - q) + cos(pi)", 2),
            ("exp(c*x) + exp(x)*sin(x)", 2),
        ] {
            let text =
                format!("name='m'\n[constants]\nc='3/2'\n[states]\nx='0'\nq='0'\n[outputs]\ny='{output}'");
            let before = model_file::read(&text).expect("a model").compile().expect("a graph");
            let after = written_apart(&before).expect("there is something to write");
            let value = |compiled: &Compiled| {
                let mut rng = SplitMix64::new(3);
                let numbers: Vec<_> = compiled
                    .roles
                    .iter()
                    .map(|r| match r {
                        crate::system::model::compiled::Role::Constant(_) => Reals::<4>.number(15, 1),
                        _ => Reals::<4>.random(&mut rng, 0),
                    })
                    .collect();
                let signals =
                    numbers.iter().map(|&value| Signal::Constant { value, component: None }).collect();
                let starts = vec![None; numbers.len()];
                let seed = SplitMix64::new(0);
                let roots = compiled.outputs(0);
                let (dag, work) = (&compiled.dag, Work::new(WorkLimit::DEFAULT));
                let at = Taylor::new(dag, Reals::<4>, 0, signals, &starts, roots, false, seed, &work);
                at.expect("a point").start(roots[0])
            };
            let off = value(&before).sub(&value(&after));
            assert!(off.is_zero() && off.radius_log2() < -200.0, "{output}: {off:?}");
            let is_left = |i: &usize| {
                matches!(
                    after.dag.ops[*i],
                    Op::Primitive { function, .. } if function != Function::Log
                )
            };
            let below = super::super::constraints::below(&after.dag, after.outputs(0)[0]);
            assert_eq!(below.iter().filter(|i| is_left(i)).count(), functions, "{output}");
            assert!(written_apart(&after).is_none(), "{output}");
        }
        for plain in
            ["sin(x)*exp(q)", "exp(x + 1) + sin(30*deg)", "sin(x*q) + sin(x)", "exp(x^2) + exp(x)", "sqrt(x)"]
        {
            let text = format!("name='m'\n[states]\nx='0'\nq='0'\n[outputs]\ny='{plain}'");
            let graph = model_file::read(&text).expect("a model").compile().expect("a graph");
            assert!(written_apart(&graph).is_none(), "{plain}");
        }
    }
}
