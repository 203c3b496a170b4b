//! Map from one of two solutions to the other, as expressions of few unknowns.
//!
//! If an unknown has two values, the second root of its polynomial is its value at the other solution. This
//! value is sought as an expression of the values of the first solution, among quotients `a b/c` of unknowns
//! and sums of two or three of these. An expression counts if it has that value at a random point of both
//! fields.

use std::collections::BTreeMap;

use obsdeg_exact::Field;

use super::fibre::Fibre;

/// Largest number of unknowns among which quotients are formed.
const FACTORS: usize = 24;

/// Quotient of unknowns, `a b/c`, each of which may be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct QuotientTerm {
    above: [Option<usize>; 2],
    below: Option<usize>,
    negative: bool,
}

impl QuotientTerm {
    fn value(&self, f: &Field, values: &[u64], inverses: &[u64]) -> u64 {
        let factors = self.above.iter().flatten().map(|&i| values[i]);
        let factors = factors.chain(self.below.iter().map(|&i| inverses[i]));
        let size = factors.fold(f.one(), |x, y| f.mul(x, y));
        if self.negative { f.neg(size) } else { size }
    }

    fn text(&self, name: &dyn Fn(usize) -> String) -> String {
        let above: Vec<String> = self.above.iter().flatten().map(|&i| name(i)).collect();
        let above = if above.is_empty() { "1".into() } else { above.join("*") };
        match self.below {
            Some(i) => format!("{above}/{}", name(i)),
            None => above,
        }
    }
}

/// All quotients of `n` values, short ones first.
fn terms(n: usize) -> Vec<QuotientTerm> {
    let places = || std::iter::once(None).chain((0..n).map(Some));
    let mut out = Vec::new();
    for below in places() {
        for a in 0..n {
            for b in places().take_while(|b| b.is_none_or(|b| b <= a)) {
                if below != Some(a) && (b.is_none() || below != b) {
                    let above = [Some(a), b];
                    out.extend([false, true].map(|negative| QuotientTerm { above, below, negative }));
                }
            }
        }
        if below.is_some() {
            out.extend([false, true].map(|negative| QuotientTerm { above: [None; 2], below, negative }));
        }
    }
    out.sort_by_key(|t| (t.above.iter().flatten().count() + usize::from(t.below.is_some()), t.negative));
    out
}

/// Values of the unknowns at a point, and of the terms.
struct SolutionPoint<'a> {
    f: Field,
    values: &'a [u64],
    /// Values of the terms.
    terms: Vec<u64>,
}

/// Sums of at most three terms with a value at each point.
fn sum_with(
    points: &[SolutionPoint<'_>; 2],
    known: &BTreeMap<u64, usize>,
    unknown: usize,
    targets: [u64; 2],
) -> Option<Vec<usize>> {
    let holds = |list: &[usize]| {
        points
            .iter()
            .zip(targets)
            .all(|(p, target)| list.iter().fold(0, |sum, &t| p.f.add(sum, p.terms[t])) == target)
    };
    let first = &points[0];
    if let Some(&t) = known.get(&targets[0])
        && holds(&[t])
    {
        return Some(vec![t]);
    }
    // the unknown itself and two more terms, or two terms
    let own = (0..first.terms.len()).find(|&t| first.terms[t] == first.values[unknown]);
    for start in [None, own] {
        if start.is_none() && own.is_none() {
            continue;
        }
        let begun = start.map_or(0, |t| first.terms[t]);
        let rest = first.f.sub(targets[0], begun);
        for (a, &x) in first.terms.iter().enumerate() {
            if let Some(&b) = known.get(&first.f.sub(rest, x)) {
                let list: Vec<usize> = start.into_iter().chain([a, b]).collect();
                if holds(&list) {
                    return Some(list);
                }
            }
        }
    }
    None
}

/// Map between two solutions in words, `replace ka by ke, ke by ka, V by V*ke/ka`; `None` if there are not
/// two, or if a value of the second is no short expression of those of the first.
pub(super) fn second_solution(
    fields: [Field; 2],
    fibres: [&Fibre; 2],
    name: &dyn Fn(usize) -> String,
) -> Option<String> {
    let n = fibres[0].values.len();
    if fibres.iter().any(|p| !p.is_pair) || n > FACTORS {
        return None;
    }
    let terms = terms(n);
    let point = |i: usize| {
        let (f, values) = (fields[i], &fibres[i].values[..]);
        let inverses: Vec<u64> = values.iter().map(|&x| if x == 0 { 0 } else { f.inv(x) }).collect();
        let of_terms = terms.iter().map(|t| t.value(&f, values, &inverses)).collect();
        SolutionPoint { f, values, terms: of_terms }
    };
    let points = [point(0), point(1)];
    let mut known = BTreeMap::new();
    for (t, &x) in points[0].terms.iter().enumerate() {
        known.entry(x).or_insert(t);
    }
    let mut changes = Vec::new();
    for unknown in 0..n {
        let other = |i: usize| -> Option<u64> {
            let (f, value) = (&fields[i], fibres[i].values[unknown]);
            match fibres[i].polynomials[unknown].as_deref() {
                Ok([_, _]) => Some(value),
                // the roots of x^2 + b x + c sum to -b
                Ok([_, b, a]) => Some(f.sub(f.neg(f.mul(*b, f.inv(*a))), value)),
                _ => None,
            }
        };
        let targets = [other(0)?, other(1)?];
        if targets[0] == fibres[0].values[unknown] {
            continue;
        }
        let list = sum_with(&points, &known, unknown, targets)?;
        let mut text = String::new();
        for &t in &list {
            text.push_str(match (text.is_empty(), terms[t].negative) {
                (true, true) => "-",
                (true, false) => "",
                (false, true) => " - ",
                (false, false) => " + ",
            });
            text.push_str(&terms[t].text(name));
        }
        changes.push(format!("{} by {text}", name(unknown)));
    }
    (!changes.is_empty()).then(|| format!("replace {}", changes.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The two solutions of absorption and elimination: the rates exchange, and the volume changes with
    /// them.
    #[test]
    fn quotients_are_found() {
        let fields = [Field::new((1 << 60) + 33), Field::new((1 << 60) + 195)];
        let fibre = |f: &Field, [a, e, v]: [u64; 3]| {
            let other = f.mul(v, f.mul(e, f.inv(a)));
            let roots = |x: u64, y: u64| Ok(vec![f.mul(x, y), f.neg(f.add(x, y)), f.one()]);
            Fibre {
                values: vec![a, e, v],
                polynomials: vec![roots(a, e), roots(e, a), roots(v, other)],
                is_pair: true,
                functions: Vec::new(),
            }
        };
        let both = [fibre(&fields[0], [5, 7, 11]), fibre(&fields[1], [123, 77, 19])];
        let name = |i: usize| ["ka", "ke", "V"][i].to_string();
        let found = second_solution(fields, [&both[0], &both[1]], &name);
        assert_eq!(found.as_deref(), Some("replace ka by ke, ke by ka, V by V*ke/ka"));
    }
}
