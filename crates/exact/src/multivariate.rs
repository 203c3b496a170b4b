//! Sparse polynomials in several variables over the field.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use crate::Field;

/// A product of powers: `(variable, exponent)`, variables rising, no exponent zero.
pub type Monomial = Vec<(u32, u32)>;

/// A polynomial: its monomials with their coefficients, none of which is zero.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Polynomial {
    terms: BTreeMap<Monomial, u64>,
}

fn product(a: &[(u32, u32)], b: &[(u32, u32)]) -> Monomial {
    let (mut i, mut j) = (0, 0);
    let mut out = Monomial::with_capacity(a.len() + b.len());
    while i < a.len() && j < b.len() {
        match a[i].0.cmp(&b[j].0) {
            Ordering::Less => {
                out.push(a[i]);
                i += 1;
            }
            Ordering::Greater => {
                out.push(b[j]);
                j += 1;
            }
            Ordering::Equal => {
                out.push((a[i].0, a[i].1 + b[j].1));
                (i, j) = (i + 1, j + 1);
            }
        }
    }
    out.extend_from_slice(&a[i..]);
    out.extend_from_slice(&b[j..]);
    out
}

/// Number of choices of `k` among `n`; `u64::MAX` where it is larger.
fn binomial(n: u64, k: u64) -> u64 {
    let Some(rest) = n.checked_sub(k) else { return 0 };
    let mut out = 1u64;
    for i in 0..k.min(rest) {
        // out (n - i) / (i + 1) is whole, and never smaller than out
        let next = u128::from(out) * u128::from(n - i) / u128::from(i + 1);
        match u64::try_from(next) {
            Ok(next) => out = next,
            Err(_) => return u64::MAX,
        }
    }
    out
}

impl Polynomial {
    /// A constant polynomial.
    pub fn constant(x: u64) -> Self {
        Self { terms: (x != 0).then(|| (Monomial::new(), x)).into_iter().collect() }
    }

    /// A single variable.
    pub fn variable(f: &Field, v: u32) -> Self {
        Self { terms: [(vec![(v, 1)], f.one())].into() }
    }

    /// The monomials with their coefficients.
    pub fn terms(&self) -> impl DoubleEndedIterator<Item = (&Monomial, u64)> {
        self.terms.iter().map(|(m, &c)| (m, c))
    }

    /// The number of terms.
    pub fn len(&self) -> usize {
        self.terms.len()
    }

    /// True if it is zero.
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// The total degree; 0 of zero.
    pub fn degree(&self) -> u32 {
        self.terms.keys().map(|m| m.iter().map(|p| p.1).sum()).max().unwrap_or(0)
    }

    /// The number that it equals; `None` if it is not constant.
    pub fn as_constant(&self) -> Option<u64> {
        match self.terms.first_key_value() {
            None => Some(0),
            Some((m, &c)) if m.is_empty() && self.terms.len() == 1 => Some(c),
            Some(_) => None,
        }
    }

    /// The variables that occur.
    pub fn variables(&self) -> BTreeSet<u32> {
        self.terms.keys().flat_map(|m| m.iter().map(|p| p.0)).collect()
    }

    /// The highest power of a variable.
    pub fn degree_in(&self, v: u32) -> u32 {
        self.terms.keys().flat_map(|m| m.iter().filter(|p| p.0 == v)).map(|p| p.1).max().unwrap_or(0)
    }

    /// The highest power of any variable; 0 of a number.
    pub fn highest_power(&self) -> u32 {
        self.terms.keys().flat_map(|m| m.iter().map(|p| p.1)).max().unwrap_or(0)
    }

    /// The coefficient of each power of a variable.
    pub fn split(&self, v: u32) -> BTreeMap<u32, Self> {
        let mut out: BTreeMap<u32, Self> = BTreeMap::new();
        for (m, &c) in &self.terms {
            let mut rest = m.clone();
            let at = rest.iter().position(|p| p.0 == v);
            let power = at.map_or(0, |i| rest.remove(i).1);
            out.entry(power).or_default().terms.insert(rest, c);
        }
        out
    }

    /// The partial derivative.
    pub fn derivative(&self, f: &Field, v: u32) -> Self {
        let mut out = Self::default();
        for (m, &c) in &self.terms {
            let Some(at) = m.iter().position(|p| p.0 == v) else { continue };
            let mut m = m.clone();
            let power = m[at].1;
            match power {
                1 => drop(m.remove(at)),
                _ => m[at].1 -= 1,
            }
            out.put(f, m, f.mul(c, f.from_u64(power.into())));
        }
        out
    }

    /// Number of terms in which a variable occurs.
    pub fn terms_with(&self, v: u32) -> usize {
        self.terms.keys().filter(|m| m.iter().any(|p| p.0 == v)).count()
    }

    /// The coefficient of a monomial.
    pub fn coefficient(&self, m: &[(u32, u32)]) -> u64 {
        self.terms.get(m).copied().unwrap_or(0)
    }

    /// Adds a term.
    pub fn put(&mut self, f: &Field, m: Monomial, c: u64) {
        #[cfg(test)]
        tests::PUT.set(tests::PUT.get() + 1);
        if c == 0 {
            return;
        }
        match self.terms.entry(m) {
            std::collections::btree_map::Entry::Vacant(e) => {
                e.insert(c);
            }
            std::collections::btree_map::Entry::Occupied(mut e) => match f.add(*e.get(), c) {
                0 => {
                    e.remove();
                }
                sum => *e.get_mut() = sum,
            },
        }
    }

    /// `self += factor * other`.
    pub fn add_scaled(&mut self, f: &Field, other: &Self, factor: u64) {
        for (m, c) in other.terms() {
            self.put(f, m.clone(), f.mul(c, factor));
        }
    }

    /// `self += a b`.
    pub fn add_product(&mut self, f: &Field, a: &Self, b: &Self) {
        for (m, c) in a.terms() {
            for (n, d) in b.terms() {
                self.put(f, product(m, n), f.mul(c, d));
            }
        }
    }

    /// `factor * self`.
    pub fn scaled(&self, f: &Field, factor: u64) -> Self {
        let mut out = Self::default();
        out.add_scaled(f, self, factor);
        out
    }

    /// Number of products of coefficients, and of unchanged terms, in [`replaced`](Self::replaced) with
    /// a value of `terms` terms. It is exact if no two products of monomials of the value are equal,
    /// otherwise an upper bound.
    pub fn products_of_replaced(&self, v: u32, terms: usize) -> u64 {
        let (power, t) = (u64::from(self.degree_in(v)), terms as u64);
        // the power k has (k + t - 1 over k) terms; the sum of these for k < p is (p + t - 1 over t)
        let powers = match power {
            0 => 0,
            _ => t.saturating_mul(binomial(power.saturating_add(t) - 1, t)),
        };
        let own = self.terms.keys().map(|m| match m.iter().find(|p| p.0 == v) {
            None => 1,
            Some(_) if t == 0 => 0,
            Some(&(_, k)) => binomial(u64::from(k).saturating_add(t) - 1, k.into()),
        });
        own.fold(powers, u64::saturating_add)
    }

    /// The polynomial with `value` in place of a variable.
    pub fn replaced(&self, f: &Field, v: u32, value: &Self) -> Self {
        let mut powers = vec![Self::constant(f.one())];
        let mut out = Self::default();
        for (m, c) in self.terms() {
            let Some(at) = m.iter().position(|p| p.0 == v) else {
                out.put(f, m.clone(), c);
                continue;
            };
            let mut rest = m.clone();
            let exponent = rest.remove(at).1 as usize;
            while powers.len() <= exponent {
                let mut next = Self::default();
                next.add_product(f, &powers[powers.len() - 1], value);
                powers.push(next);
            }
            for (n, d) in powers[exponent].terms() {
                out.put(f, product(&rest, n), f.mul(c, d));
            }
        }
        out
    }

    /// The polynomial with renamed variables; `None` if one has no name. Different variables need
    /// different names.
    pub fn renamed(&self, name: impl Fn(u32) -> Option<u32>) -> Option<Self> {
        let monomial = |m: &Monomial| {
            let mut m: Monomial = m.iter().map(|&(v, e)| Some((name(v)?, e))).collect::<Option<_>>()?;
            m.sort_unstable();
            Some(m)
        };
        let terms = self.terms.iter().map(|(m, &c)| Some((monomial(m)?, c))).collect::<Option<_>>()?;
        Some(Self { terms })
    }

    /// The value at a point.
    pub fn at(&self, f: &Field, point: &[u64]) -> u64 {
        let value =
            |m: &Monomial| m.iter().fold(f.one(), |x, &(v, e)| f.mul(x, f.pow(point[v as usize], e.into())));
        self.terms().fold(0, |sum, (m, c)| f.add(sum, f.mul(c, value(m))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    thread_local! {
        /// Number of calls of [`Polynomial::put`]: one for each product of coefficients and each term
        /// that is copied.
        pub(super) static PUT: std::cell::Cell<u64> = const { std::cell::Cell::new(0) };
    }

    /// Number of terms that `replaced` adds, and the number predicted.
    fn put_and_counted(p: &Polynomial, value: &Polynomial) -> (u64, u64) {
        let f = Field::new((1 << 60) + 33);
        let counted = p.products_of_replaced(0, value.len());
        PUT.set(0);
        p.replaced(&f, 0, value);
        (PUT.get(), counted)
    }

    /// A sum of `terms` variables, the first of which is `x1`, and a polynomial with one term for each
    /// exponent: of `x0` and of a variable that occurs nowhere else.
    fn sum_and_terms(terms: u32, exponents: &[u32]) -> (Polynomial, Polynomial) {
        let f = Field::new((1 << 60) + 33);
        let (mut value, mut p) = (Polynomial::default(), Polynomial::default());
        (0..terms).for_each(|i| value.put(&f, vec![(i + 1, 1)], f.one()));
        for (i, &e) in exponents.iter().enumerate() {
            let other = (100 + i as u32, 1);
            p.put(&f, if e == 0 { vec![other] } else { vec![(0, e), other] }, f.one());
        }
        (value, p)
    }

    /// The predicted number of operations equals the number done, for sums of different variables, also
    /// with one power among many low ones.
    #[test]
    fn products_of_what_is_put_in() {
        let exponents: [&[u32]; 9] =
            [&[1], &[3], &[5, 1], &[4, 4, 4], &[7, 1, 1, 1, 1, 0], &[2, 0], &[0, 0], &[12], &[1; 40]];
        for exponents in exponents {
            for terms in [0, 1, 2, 3, 4, 9] {
                let (value, p) = sum_and_terms(terms, exponents);
                let (put, counted) = put_and_counted(&p, &value);
                assert_eq!(put, counted, "{terms} terms, {exponents:?}");
            }
        }
        // by hand: 3 (1 + 3 + 6 + 10 + 15) for the powers of three terms up to the fifth, 21 and 3 for the
        // terms themselves
        let (value, p) = sum_and_terms(3, &[5, 1]);
        assert_eq!(put_and_counted(&p, &value), (3 * 35 + 21 + 3, 3 * 35 + 21 + 3));
    }

    /// Fewer operations are done than predicted if products of monomials are equal.
    #[test]
    fn equal_products_are_counted_apart() {
        let f = Field::new((1 << 60) + 33);
        let (_, p) = sum_and_terms(0, &[6, 2]);
        // 1 + x1 + x1^2: its power k has 2k + 1 terms
        let mut value = Polynomial::constant(f.one());
        (1..3).for_each(|e| value.put(&f, vec![(1, e)], f.one()));
        let (put, counted) = put_and_counted(&p, &value);
        assert_eq!(put, 3 * (1 + 3 + 5 + 7 + 9 + 11) + 13 + 5);
        assert_eq!(counted, 3 * (1 + 3 + 6 + 10 + 15 + 21) + 28 + 6);
    }

    /// Predictions beyond 64 bits saturate, long before the powers are formed.
    #[test]
    fn counts_beyond_64_bits_are_the_largest() {
        let f = Field::new((1 << 60) + 33);
        let mut p = Polynomial::default();
        p.put(&f, vec![(0, 1000)], f.one());
        // 4 (1003 over 4) + (1003 over 3)
        assert_eq!(p.products_of_replaced(0, 4), 4 * 41_917_125_250 + 167_668_501);
        assert_eq!(p.products_of_replaced(0, 60), u64::MAX);
        p.put(&f, vec![(0, u32::MAX)], f.one());
        assert_eq!(p.products_of_replaced(0, usize::MAX), u64::MAX);
        assert_eq!(p.highest_power(), u32::MAX);
        assert_eq!(Polynomial::constant(f.one()).products_of_replaced(0, 60), 1);
        assert_eq!(
            [(5, 2), (2, 5), (0, 0), (67, 33)].map(|(n, k)| binomial(n, k)),
            [10, 0, 1, 14_226_520_737_620_288_370]
        );
        assert_eq!(binomial(68, 34), u64::MAX);
    }
}
