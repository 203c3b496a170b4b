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

impl Polynomial {
    /// A number.
    pub fn constant(x: u64) -> Self {
        Self { terms: (x != 0).then(|| (Monomial::new(), x)).into_iter().collect() }
    }

    /// A variable.
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

    /// Whether it is zero.
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// The total degree; 0 of zero.
    pub fn degree(&self) -> u32 {
        self.terms.keys().map(|m| m.iter().map(|p| p.1).sum()).max().unwrap_or(0)
    }

    /// The number that it is, if it is one.
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

    /// What each power of a variable is multiplied with.
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

    /// In how many terms a variable occurs.
    pub fn terms_with(&self, v: u32) -> usize {
        self.terms.keys().filter(|m| m.iter().any(|p| p.0 == v)).count()
    }

    /// The coefficient of a monomial.
    pub fn coefficient(&self, m: &[(u32, u32)]) -> u64 {
        self.terms.get(m).copied().unwrap_or(0)
    }

    /// Adds a term.
    pub fn put(&mut self, f: &Field, m: Monomial, c: u64) {
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

    /// Products of coefficients that [`replaced`](Self::replaced) takes at most with a value of this many terms.
    pub fn products_of_replaced(&self, v: u32, terms: usize) -> u64 {
        let (power, own) = (u64::from(self.degree_in(v)), self.len() as u64);
        // a power k of t terms has at most (k + t - 1 over t - 1)
        let more = (terms as u64).saturating_sub(1).min(power);
        let most = power.saturating_add(terms as u64).saturating_sub(1);
        let highest =
            (0..more).fold(1u128, |n, i| (n * u128::from(most - i) / u128::from(i + 1)).min(1 << 60)) as u64;
        let powers = highest.saturating_mul(power).saturating_mul(terms as u64);
        powers.saturating_add(own.saturating_mul(highest))
    }

    /// With `value` in place of a variable.
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

    /// With other names for its variables; `None` where one has none. Names must keep the variables apart.
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

    /// By counting: the powers of a sum up to the one that is put in, and its terms with every term.
    #[test]
    fn products_of_what_is_put_in() {
        let f = Field::new((1 << 60) + 33);
        for (power, terms) in [(1, 1), (3, 1), (5, 2), (4, 3), (7, 4), (2, 9)] {
            let mut p = Polynomial::default();
            p.put(&f, vec![(0, power)], f.one());
            p.put(&f, vec![(0, 1), (20, 1)], f.one());
            let mut value = Polynomial::default();
            (0..terms).for_each(|i| value.put(&f, vec![(i + 1, 1)], f.one()));
            let (mut products, mut last) = (0, Polynomial::constant(f.one()));
            for _ in 0..power {
                products += (last.len() * value.len()) as u64;
                let mut next = Polynomial::default();
                next.add_product(&f, &last, &value);
                last = next;
            }
            products += (last.len() + value.len()) as u64;
            let bound = p.products_of_replaced(0, value.len());
            // every power is counted as large as the highest
            let most = products * u64::from(power) * terms.max(2) as u64;
            assert!(bound >= products && bound <= most, "{bound} {products}");
            assert_eq!(p.highest_power(), power);
        }
        // refused long before it is formed
        let mut p = Polynomial::default();
        p.put(&f, vec![(0, 1000)], f.one());
        assert!(p.products_of_replaced(0, 4) > 100_000_000 && p.products_of_replaced(0, 60) > 1 << 59);
        assert_eq!(Polynomial::constant(f.one()).products_of_replaced(0, 60), 1);
    }
}
