//! Quotients, common divisors and factors of polynomials in several variables.
//!
//! A greatest common divisor is interpolated from its images at points, one variable at a time (Brown
//! 1971, doi:10.1145/321662.321664). Images in one variable first show which variables it contains; the
//! others are replaced by numbers. Every result is verified by division.

mod terms;

use std::collections::BTreeMap;

use crate::groebner::{OverLimit, RemainingWork};
use crate::multivariate::{Monomial, Polynomial};
use crate::{Field, SplitMix64, polynomial};
use terms::{Lex, PointValues, along, image, joined, lead, monomial_content, ratio, top, without};

pub use terms::lexicographic;

/// Work per term of a product, or of a copy: its monomial is allocated and inserted among the others.
const TERM: u64 = 4;

/// Number of terms above which a polynomial exceeds the cache, and the factor on the work per term
/// then.
const FAR: (u64, u64) = (4096, 8);

/// Work per inverse of a number.
const INVERSE: u64 = 16;

/// Largest power of a variable: images along it are dense.
const POWER: u64 = 1 << 16;

/// Polynomial algebra within a limit of work.
pub struct Algebra {
    /// The field of the coefficients.
    pub f: Field,
    /// Generator of its random points.
    pub rng: SplitMix64,
    /// Remaining work.
    pub work: RemainingWork,
}

/// Work of `terms` terms that are made or copied.
pub(crate) fn work_of(terms: u64) -> u64 {
    terms.saturating_mul(if terms > FAR.0 { TERM * FAR.1 } else { TERM })
}

impl Algebra {
    /// Random number that is not zero.
    fn number(&mut self) -> u64 {
        self.f.from_u64(1 + self.rng.below(self.f.modulus() - 1))
    }

    /// Takes the work of storing `terms` terms, which bounds their memory.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn keep(&mut self, terms: usize) -> Result<(), OverLimit> {
        self.work.take((TERM * FAR.1).saturating_mul(terms as u64))
    }

    /// Takes the work of copies of polynomials.
    pub(crate) fn copies<'p>(
        &mut self,
        of: impl IntoIterator<Item = &'p Polynomial>,
    ) -> Result<(), OverLimit> {
        self.work.take(1 + of.into_iter().map(|p| work_of(p.len() as u64)).sum::<u64>())
    }

    /// `a b`.
    ///
    /// # Errors
    /// [`OverLimit`]; also for powers above 65536.
    pub fn product(&mut self, a: &Polynomial, b: &Polynomial) -> Result<Polynomial, OverLimit> {
        self.work.take(1 + work_of((a.len() as u64).saturating_mul(b.len() as u64)))?;
        if u64::from(a.highest_power()) + u64::from(b.highest_power()) > POWER {
            return Err(OverLimit);
        }
        let mut out = Polynomial::default();
        out.add_product(&self.f, a, b);
        Ok(out)
    }

    /// The polynomial with leading coefficient one.
    pub(crate) fn monic(&self, p: &Polynomial) -> Polynomial {
        lead(p).map_or_else(Polynomial::default, |(_, c)| p.scaled(&self.f, self.f.inv(c)))
    }

    /// The coefficient of the leading term in lexicographic order; 0 of zero.
    pub fn leading(&self, p: &Polynomial) -> u64 {
        lead(p).map_or(0, |t| t.1)
    }

    /// `a / b`, or `None` where `b` does not divide `a`; `b` is not zero.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn quotient(&mut self, a: &Polynomial, b: &Polynomial) -> Result<Option<Polynomial>, OverLimit> {
        let f = self.f;
        self.copies([a, a])?;
        if let Some(c) = b.as_constant() {
            return Ok(Some(a.scaled(&f, f.inv(c))));
        }
        // along one variable first, which excludes most cases without division
        let point = self.point(a, b);
        for v in b.variables() {
            let [x, y] = self.images(a, b, &point, v)?;
            if !polynomial::remainder(&f, &x, &y).is_empty() {
                return Ok(None);
            }
        }
        let mut rest: BTreeMap<Lex, u64> = a.terms().map(|(m, c)| (Lex(m.clone()), c)).collect();
        let Some((top, c)) = lead(b) else { return Ok(None) };
        let inverse = f.inv(c);
        let mut out = Polynomial::default();
        while let Some((m, c)) = rest.last_key_value() {
            let Some(m) = ratio(&m.0, top) else { return Ok(None) };
            let c = f.mul(*c, inverse);
            // the product, and the insertion of its terms
            self.copies([b, b])?;
            let mut step = Polynomial::default();
            step.put(&f, m, f.neg(c));
            let mut product = Polynomial::default();
            product.add_product(&f, &step, b);
            for (n, d) in product.terms() {
                let slot = rest.entry(Lex(n.clone())).or_insert(0);
                *slot = f.add(*slot, d);
                if *slot == 0 {
                    rest.remove(&Lex(n.clone()));
                }
            }
            out.add_scaled(&f, &step, f.neg(f.one()));
        }
        Ok(Some(out))
    }

    /// Random numbers for all variables of two polynomials.
    fn point(&mut self, a: &Polynomial, b: &Polynomial) -> Vec<u64> {
        let last = a.variables().into_iter().chain(b.variables()).max().map_or(0, |v| v as usize + 1);
        (0..last).map(|_| self.number()).collect()
    }

    /// Images of two polynomials along a variable, with the work of one modulo the other.
    fn images(
        &mut self,
        a: &Polynomial,
        b: &Polynomial,
        point: &[u64],
        v: u32,
    ) -> Result<[Vec<u64>; 2], OverLimit> {
        self.copies([a, b])?;
        let [x, y] = [a, b].map(|p| u64::from(p.degree_in(v)) + 1);
        self.work.take(x.saturating_mul(y) + INVERSE * x.min(y))?;
        Ok([a, b].map(|p| image(&self.f, p, point, v)))
    }

    /// The greatest common divisor, with leading coefficient one.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn divisor(&mut self, a: &Polynomial, b: &Polynomial) -> Result<Polynomial, OverLimit> {
        let f = self.f;
        // powers that all terms share, and the polynomials without them
        self.copies([a, a, b, b])?;
        if a.is_empty() || b.is_empty() {
            return Ok(self.monic(if a.is_empty() { b } else { a }));
        }
        let (m, n) = (monomial_content(a), monomial_content(b));
        let smaller = |&(v, e): &(u32, u32)| {
            let other = n.iter().find(|y| y.0 == v)?.1;
            Some((v, e.min(other)))
        };
        let mut common = Polynomial::default();
        common.put(&f, m.iter().filter_map(smaller).collect(), f.one());
        let rest = self.divisor_of_rest(&without(&f, a, &m), &without(&f, b, &n))?;
        self.product(&common, &rest)
    }

    /// The greatest common divisor of polynomials that no monomial divides.
    fn divisor_of_rest(&mut self, a: &Polynomial, b: &Polynomial) -> Result<Polynomial, OverLimit> {
        let f = self.f;
        let one = Polynomial::constant(f.one());
        if a.as_constant().is_some() || b.as_constant().is_some() {
            return Ok(one);
        }
        let point = self.point(a, b);
        let (of_a, of_b) = (a.variables(), b.variables());
        let mut held: Vec<(u32, usize)> = Vec::new();
        for &v in of_a.intersection(&of_b) {
            let [x, y] = self.images(a, b, &point, v)?;
            let degree = polynomial::gcd(&f, x, y).len().saturating_sub(1);
            held.extend((degree > 0).then_some((v, degree)));
        }
        if held.is_empty() {
            return Ok(one);
        }
        // one of the two polynomials itself
        for (p, other) in [(a, b), (b, a)] {
            let whole =
                p.variables().len() == held.len() && held.iter().all(|&(v, d)| p.degree_in(v) as usize == d);
            if whole && self.quotient(other, p)?.is_some() {
                return Ok(self.monic(p));
            }
        }
        self.copies([a, b])?;
        let kept = |v: u32| held.iter().any(|h| h.0 == v);
        let mut parts = Vec::new();
        for p in [a, b] {
            let mut out = Polynomial::default();
            for (m, c) in p.terms() {
                let (inside, outside): (Monomial, Monomial) = m.iter().partition(|x| kept(x.0));
                let power = |x: u64, &(v, e): &(u32, u32)| f.mul(x, f.pow(point[v as usize], e.into()));
                out.put(&f, inside, outside.iter().fold(c, power));
            }
            parts.push(out);
        }
        let found = self.interpolated(&parts[0], &parts[1], &held)?;
        let divides = self.quotient(a, &found)?.is_some() && self.quotient(b, &found)?.is_some();
        // an unlucky point is as likely as a number that is guessed
        if divides { Ok(found) } else { Err(OverLimit) }
    }

    /// The greatest common divisor of two polynomials in some variables, with the given degrees in
    /// these.
    fn interpolated(
        &mut self,
        a: &Polynomial,
        b: &Polynomial,
        held: &[(u32, usize)],
    ) -> Result<Polynomial, OverLimit> {
        let f = self.f;
        let Some((&(v, bound), others)) = held.split_last() else {
            return Ok(Polynomial::constant(f.one()));
        };
        self.copies([a, a, b, b])?;
        let degrees = [a, b].map(|p| u64::from(p.degree_in(v)) + 1);
        let [mut a, mut b] = [a, b].map(|p| along(p, v));
        // the dense coefficients: their values at a point, and their common divisors
        let [x, y] =
            [(&a, degrees[0]), (&b, degrees[1])].map(|(parts, d)| d.saturating_mul(parts.len() as u64));
        let dense = x.saturating_add(y);
        let mut content = Vec::new();
        for (parts, degree) in [(&mut a, degrees[0]), (&mut b, degrees[1])] {
            let own = self.divide_by_content(parts, degree)?;
            content = polynomial::gcd(&f, content, own);
        }
        let scale = polynomial::gcd(&f, top(&a), top(&b));
        let points = bound + scale.len();
        let terms = TERM * (a.len() + b.len()) as u64;
        let each = dense.saturating_add(terms);
        let (at, values) = self.images_along([&a, &b], &scale, (points, each), others)?;
        let mut parts = BTreeMap::new();
        let mut own = Vec::new();
        for (m, mut list) in values {
            // a missing term has the coefficient zero
            let missing: Vec<u64> = at.iter().copied().filter(|x| !list.iter().any(|y| y.0 == *x)).collect();
            list.extend(missing.into_iter().map(|x| (x, 0)));
            // values, differences, and the common divisor with the previous coefficients
            self.work.take((points as u64).saturating_mul(points as u64).saturating_mul(INVERSE))?;
            let c = polynomial::interpolate(&f, &list);
            own = polynomial::gcd(&f, own, c.clone());
            parts.insert(m, c);
        }
        for c in parts.values_mut() {
            *c = polynomial::multiply(&f, &polynomial::quotient(&f, c, &own), &content);
        }
        Ok(self.monic(&joined(&f, &parts, v)))
    }

    /// Divides dense coefficients of this degree by their greatest common divisor, and returns it.
    fn divide_by_content(
        &mut self,
        parts: &mut BTreeMap<Lex, Vec<u64>>,
        degree: u64,
    ) -> Result<Vec<u64>, OverLimit> {
        let f = self.f;
        let mut own = Vec::new();
        for c in parts.values() {
            self.work.take((c.len() as u64).saturating_mul(degree.saturating_mul(2)))?;
            own = polynomial::gcd(&f, own, c.clone());
        }
        for c in parts.values_mut() {
            *c = polynomial::quotient(&f, c, &own);
        }
        Ok(own)
    }

    /// Greatest common divisors at as many `points` of a variable, each for `work` products, with the leading
    /// coefficient `scale`: the points, and the values of each coefficient at those where it is not zero.
    fn images_along(
        &mut self,
        both: [&BTreeMap<Lex, Vec<u64>>; 2],
        scale: &[u64],
        (points, work): (usize, u64),
        others: &[(u32, usize)],
    ) -> Result<(Vec<u64>, PointValues), OverLimit> {
        let f = self.f;
        let mut values = PointValues::new();
        let mut at = Vec::new();
        while at.len() < points {
            self.work.take(work)?;
            let x = self.number();
            let leads = both.map(|parts| polynomial::value(&f, &top(parts), x));
            if leads.contains(&0) || at.contains(&x) {
                continue;
            }
            let [p, q] = both.map(|parts| {
                let mut out = Polynomial::default();
                parts.iter().for_each(|(m, c)| out.put(&f, m.0.clone(), polynomial::value(&f, c, x)));
                out
            });
            let image = self.interpolated(&p, &q, others)?;
            let factor = f.mul(polynomial::value(&f, scale, x), f.inv(self.leading(&image)));
            for (m, c) in image.terms() {
                let list = values.entry(Lex(m.clone())).or_default();
                list.push((x, f.mul(c, factor)));
            }
            at.push(x);
        }
        Ok((at, values))
    }

    /// Factors with their powers, as found from single variables, contents along a variable and
    /// repetition; each has leading coefficient one. Factors may be reducible.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn factors(&mut self, p: &Polynomial) -> Result<Vec<(Polynomial, u32)>, OverLimit> {
        let f = self.f;
        let content = monomial_content(p);
        let mut out: Vec<(Polynomial, u32)> =
            content.iter().map(|&(v, e)| (Polynomial::variable(&f, v), e)).collect();
        let mut left = vec![self.monic(&without(&f, p, &content))];
        while let Some(p) = left.pop() {
            if p.as_constant().is_some() {
                continue;
            }
            match self.divisor_within(&p)? {
                Some(d) => {
                    let rest = self.quotient(&p, &d)?.ok_or(OverLimit)?;
                    // a common divisor of both is a double factor
                    let both = self.divisor(&d, &rest)?;
                    for part in [d, rest] {
                        let part = self.quotient(&part, &both)?.ok_or(OverLimit)?;
                        left.extend([both.clone(), self.monic(&part)]);
                    }
                }
                None => match out.iter_mut().find(|x| x.0 == p) {
                    Some(same) => same.1 += 1,
                    None => out.push((p, 1)),
                },
            }
        }
        Ok(out)
    }

    /// A divisor that is neither one nor the whole: a content along a variable, or a repeated factor.
    fn divisor_within(&mut self, p: &Polynomial) -> Result<Option<Polynomial>, OverLimit> {
        let f = self.f;
        for v in p.variables() {
            self.copies([p, p, p])?;
            let mut parts = p.split(v).into_values();
            let Some(first) = parts.next() else { continue };
            let mut others = Polynomial::default();
            for other in parts {
                let factor = self.number();
                others.add_scaled(&f, &other, factor);
            }
            let content = self.divisor(&first, &others)?;
            if content.as_constant().is_none() && content.len() < p.len() {
                return Ok(Some(content));
            }
            let repeated = self.divisor(p, &p.derivative(&f, v))?;
            if repeated.as_constant().is_none() && repeated.degree() < p.degree() {
                return Ok(Some(repeated));
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests;
