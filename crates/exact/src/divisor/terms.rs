//! Terms of polynomials in lexicographic order, by powers of one variable and by contents.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use crate::multivariate::{Monomial, Polynomial};
use crate::{Field, polynomial};

/// Monomial in lexicographic order, the first variable greatest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Lex(pub(super) Monomial);

impl Ord for Lex {
    fn cmp(&self, other: &Self) -> Ordering {
        lexicographic(&self.0, &other.0)
    }
}

impl PartialOrd for Lex {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Values `(x, c(x))` of the coefficients of a polynomial at points of a variable.
pub(super) type PointValues = BTreeMap<Lex, Vec<(u64, u64)>>;

/// Leading coefficient.
pub(super) fn top(parts: &BTreeMap<Lex, Vec<u64>>) -> Vec<u64> {
    parts.values().next_back().cloned().unwrap_or_default()
}

/// Lexicographic order of monomials, the first variable greatest; products preserve it.
pub fn lexicographic(a: &[(u32, u32)], b: &[(u32, u32)]) -> Ordering {
    for (x, y) in a.iter().zip(b) {
        let order = y.0.cmp(&x.0).then(x.1.cmp(&y.1));
        if order != Ordering::Equal {
            return order;
        }
    }
    a.len().cmp(&b.len())
}

/// The greatest monomial in lexicographic order with its coefficient.
pub(super) fn lead(p: &Polynomial) -> Option<(&Monomial, u64)> {
    p.terms().max_by(|a, b| lexicographic(a.0, b.0))
}

/// `a / b` of monomials, where `b` divides `a`.
pub(super) fn ratio(a: &[(u32, u32)], b: &[(u32, u32)]) -> Option<Monomial> {
    let mut out = a.to_vec();
    for &(v, e) in b {
        let at = out.iter().position(|x| x.0 == v && x.1 >= e)?;
        out[at].1 -= e;
    }
    out.retain(|x| x.1 > 0);
    Some(out)
}

/// The greatest monomial that divides every term.
pub(super) fn monomial_content(p: &Polynomial) -> Monomial {
    let mut terms = p.terms();
    let mut out = terms.next().map(|t| t.0.clone()).unwrap_or_default();
    for (m, _) in terms {
        for x in &mut out {
            x.1 = x.1.min(m.iter().find(|y| y.0 == x.0).map_or(0, |y| y.1));
        }
        out.retain(|x| x.1 > 0);
    }
    out
}

/// `p / m`, where `m` divides every term.
pub(super) fn without(f: &Field, p: &Polynomial, m: &[(u32, u32)]) -> Polynomial {
    let mut out = Polynomial::default();
    for (n, c) in p.terms() {
        out.put(f, ratio(n, m).unwrap_or_default(), c);
    }
    out
}

/// Coefficients along one variable, by the monomial in the other variables.
pub(super) fn along(p: &Polynomial, v: u32) -> BTreeMap<Lex, Vec<u64>> {
    let mut out: BTreeMap<Lex, Vec<u64>> = BTreeMap::new();
    for (m, c) in p.terms() {
        let mut rest = m.clone();
        let at = rest.iter().position(|x| x.0 == v);
        let power = at.map_or(0, |i| rest.remove(i).1) as usize;
        let list = out.entry(Lex(rest)).or_default();
        list.resize(list.len().max(power + 1), 0);
        list[power] = c;
    }
    out
}

/// Inverse of [`along`].
pub(super) fn joined(f: &Field, parts: &BTreeMap<Lex, Vec<u64>>, v: u32) -> Polynomial {
    let mut out = Polynomial::default();
    for (m, coefficients) in parts {
        for (k, &c) in coefficients.iter().enumerate() {
            let mut m = m.0.clone();
            if k > 0 {
                let at = m.partition_point(|x| x.0 < v);
                m.insert(at, (v, k as u32));
            }
            out.put(f, m, c);
        }
    }
    out
}

/// A polynomial along one variable, with numbers for all others.
pub(super) fn image(f: &Field, p: &Polynomial, point: &[u64], v: u32) -> Vec<u64> {
    let mut out = vec![0; p.degree_in(v) as usize + 1];
    for (m, c) in p.terms() {
        let (mut value, mut power) = (c, 0);
        for &(w, e) in m {
            match w == v {
                true => power = e as usize,
                false => value = f.mul(value, f.pow(point[w as usize], e.into())),
            }
        }
        out[power] = f.add(out[power], value);
    }
    polynomial::trim(out)
}
