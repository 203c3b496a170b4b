//! Roots of univariate polynomials in a prime field.
//!
//! A polynomial is its coefficients, constant term first, without trailing zeros.

use crate::{Field, SplitMix64};

pub(crate) fn trim(mut a: Vec<u64>) -> Vec<u64> {
    while a.last() == Some(&0) {
        a.pop();
    }
    a
}

/// The polynomial of degree below `points.len()` through `points` (distinct abscissae), by Newton's
/// divided differences.
pub fn interpolate(f: &Field, points: &[(u64, u64)]) -> Vec<u64> {
    let mut divided: Vec<u64> = points.iter().map(|&(_, y)| y).collect();
    for level in 1..points.len() {
        for i in (level..points.len()).rev() {
            let dx = f.sub(points[i].0, points[i - level].0);
            divided[i] = f.mul(f.sub(divided[i], divided[i - 1]), f.inv(dx));
        }
    }
    let mut result: Vec<u64> = Vec::new();
    for i in (0..points.len()).rev() {
        // result = result * (x - x_i) + divided_i
        let mut next = vec![0; result.len() + 1];
        for (j, &a) in result.iter().enumerate() {
            next[j + 1] = f.add(next[j + 1], a);
            next[j] = f.sub(next[j], f.mul(a, points[i].0));
        }
        next[0] = f.add(next[0], divided[i]);
        result = next;
    }
    trim(result)
}

pub(crate) fn remainder(f: &Field, a: &[u64], m: &[u64]) -> Vec<u64> {
    let mut a = a.to_vec();
    let lead = f.inv(m[m.len() - 1]);
    while a.len() >= m.len() {
        let factor = f.mul(a[a.len() - 1], lead);
        let shift = a.len() - m.len();
        for (i, &c) in m.iter().enumerate() {
            a[shift + i] = f.sub(a[shift + i], f.mul(factor, c));
        }
        a.pop();
        a = trim(a);
    }
    a
}

/// `a / b` for a divisor `b` of `a`.
pub(crate) fn quotient(f: &Field, a: &[u64], b: &[u64]) -> Vec<u64> {
    let mut rest = a.to_vec();
    let lead = f.inv(b.last().copied().unwrap_or(0));
    let mut out = vec![0; (a.len() + 1).saturating_sub(b.len())];
    for (shift, slot) in out.iter_mut().enumerate().rev() {
        *slot = f.mul(rest[shift + b.len() - 1], lead);
        for (i, &c) in b.iter().enumerate() {
            rest[shift + i] = f.sub(rest[shift + i], f.mul(*slot, c));
        }
    }
    trim(out)
}

/// The value at `x`.
pub(crate) fn value(f: &Field, a: &[u64], x: u64) -> u64 {
    a.iter().rev().fold(0, |sum, &c| f.add(f.mul(sum, x), c))
}

pub(crate) fn gcd(f: &Field, mut a: Vec<u64>, mut b: Vec<u64>) -> Vec<u64> {
    while !b.is_empty() {
        let r = remainder(f, &a, &b);
        (a, b) = (b, r);
    }
    a
}

pub(crate) fn multiply(f: &Field, a: &[u64], b: &[u64]) -> Vec<u64> {
    if a.is_empty() || b.is_empty() {
        return Vec::new();
    }
    let mut out = vec![0; a.len() + b.len() - 1];
    for (i, &x) in a.iter().enumerate() {
        for (j, &y) in b.iter().enumerate() {
            out[i + j] = f.add(out[i + j], f.mul(x, y));
        }
    }
    trim(out)
}

fn power_modulo(f: &Field, base: &[u64], mut e: u64, m: &[u64]) -> Vec<u64> {
    let mut square = remainder(f, base, m);
    let mut result = remainder(f, &[f.one()], m);
    while e > 0 {
        if e & 1 == 1 {
            result = remainder(f, &multiply(f, &result, &square), m);
        }
        square = remainder(f, &multiply(f, &square, &square), m);
        e >>= 1;
    }
    result
}

fn subtract(f: &Field, a: &[u64], b: &[u64]) -> Vec<u64> {
    let at = |v: &[u64], i: usize| v.get(i).copied().unwrap_or(0);
    trim((0..a.len().max(b.len())).map(|i| f.sub(at(a, i), at(b, i))).collect())
}

/// One root of the polynomial `a` in the field, or `None` when it has none there
/// (Cantor, Zassenhaus 1981, doi:10.1090/S0025-5718-1981-0606517-5).
pub fn root(f: &Field, a: &[u64], rng: &mut SplitMix64) -> Option<u64> {
    let a = trim(a.to_vec());
    if a.len() < 2 {
        return None;
    }
    let x = [0, f.one()];
    // the product of the linear factors
    let mut linear = gcd(f, a.clone(), subtract(f, &power_modulo(f, &x, f.modulus(), &a), &x));
    while linear.len() > 2 {
        let shift = [f.from_u64(rng.next_u64()), f.one()];
        let half = power_modulo(f, &shift, (f.modulus() - 1) / 2, &linear);
        let split = gcd(f, linear.clone(), subtract(f, &half, &[f.one()]));
        if split.len() > 1 && split.len() < linear.len() {
            linear = split;
        }
    }
    (linear.len() == 2).then(|| f.neg(f.mul(linear[0], f.inv(linear[1]))))
}

/// Number of different roots of a non-zero polynomial in the algebraic closure, if its degree is below
/// the characteristic: its degree minus that of the common divisor with its derivative.
pub fn distinct_roots(f: &Field, a: &[u64]) -> usize {
    let a = trim(a.to_vec());
    let slope = a.iter().enumerate().skip(1).map(|(k, &c)| f.mul(c, f.from_u64(k as u64)));
    let common = gcd(f, a.clone(), trim(slope.collect()));
    a.len() - common.len().min(a.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn finds_a_root_of_a_product(roots in prop::collection::vec(-50i64..50, 1..5), seed in any::<u64>()) {
            let f = Field::new((1 << 60) + 33);
            let product = roots.iter().fold(vec![f.one()], |acc, &r| {
                multiply(&f, &acc, &[f.from_i64(-r), f.one()])
            });
            let found = root(&f, &product, &mut SplitMix64::new(seed)).expect("it splits");
            prop_assert!(roots.iter().any(|&r| f.from_i64(r) == found));
        }

        #[test]
        fn interpolation_goes_through_the_points(ys in prop::collection::vec(any::<u64>(), 1..8)) {
            let f = Field::new((1 << 60) + 33);
            let points: Vec<(u64, u64)> =
                ys.iter().enumerate().map(|(i, &y)| (f.from_u64(i as u64 + 3), f.from_u64(y))).collect();
            let a = interpolate(&f, &points);
            prop_assert!(a.len() <= points.len());
            for (x, y) in points {
                prop_assert_eq!(value(&f, &a, x), y);
            }
        }
    }

    #[test]
    fn an_irreducible_polynomial_has_no_root() {
        let f = Field::new((1 << 60) + 33);
        // by Euler's criterion
        let minus_one = f.neg(f.one());
        let non_square = |k: &u64| f.pow(f.from_u64(*k), (f.modulus() - 1) / 2) == minus_one;
        let k = (2..).find(non_square).expect("half are non-squares");
        let a = [f.neg(f.from_u64(k)), 0, f.one()];
        assert_eq!(root(&f, &a, &mut SplitMix64::new(1)), None);
    }
}
