//! Rational functions of several variables, in lowest terms.

use crate::divisor::Algebra;
use crate::groebner::OverLimit;
use crate::multivariate::Polynomial;

/// Work per power of a fraction that is stored, besides its terms.
const POWER: u64 = 64;

/// `numerator / denominator` without a common divisor; the denominator's leading coefficient is one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fraction {
    /// Numerator polynomial.
    pub numerator: Polynomial,
    /// Denominator polynomial, with leading coefficient one.
    pub denominator: Polynomial,
}

impl Fraction {
    /// Number of terms of numerator and denominator together.
    pub fn terms(&self) -> usize {
        self.numerator.len() + self.denominator.len()
    }

    /// True if it is zero.
    pub fn is_zero(&self) -> bool {
        self.numerator.is_empty()
    }

    /// True if the variable `v` occurs.
    pub fn holds(&self, v: u32) -> bool {
        self.numerator.terms_with(v) > 0 || self.denominator.terms_with(v) > 0
    }
}

/// # Errors
/// All functions return [`OverLimit`] when the work is used up.
impl Algebra {
    /// A polynomial as a fraction.
    pub fn whole(&self, numerator: Polynomial) -> Fraction {
        Fraction { numerator, denominator: Polynomial::constant(self.f.one()) }
    }

    /// A fraction in lowest terms from a denominator with any leading coefficient.
    fn settled(&self, numerator: Polynomial, denominator: Polynomial) -> Fraction {
        let scale = self.f.inv(self.leading(&denominator));
        Fraction {
            numerator: numerator.scaled(&self.f, scale),
            denominator: denominator.scaled(&self.f, scale),
        }
    }

    /// `a / d` for a divisor `d` of `a`.
    fn over(&mut self, a: &Polynomial, d: &Polynomial) -> Result<Polynomial, OverLimit> {
        if d.as_constant() == Some(self.f.one()) {
            self.copies([a])?;
            return Ok(a.clone());
        }
        self.quotient(a, d)?.ok_or(OverLimit)
    }

    /// `a / b` in lowest terms; `b` is not zero.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn fraction(&mut self, a: &Polynomial, b: &Polynomial) -> Result<Fraction, OverLimit> {
        let common = self.divisor(a, b)?;
        let (a, b) = (self.over(a, &common)?, self.over(b, &common)?);
        Ok(self.settled(a, b))
    }

    /// `-a`.
    pub fn minus(&self, a: &Fraction) -> Fraction {
        let numerator = a.numerator.scaled(&self.f, self.f.neg(self.f.one()));
        Fraction { numerator, denominator: a.denominator.clone() }
    }

    /// `1 / a`; `a` is not zero.
    pub fn inverse(&self, a: &Fraction) -> Fraction {
        self.settled(a.denominator.clone(), a.numerator.clone())
    }

    /// `a + b`.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn sum(&mut self, a: &Fraction, b: &Fraction) -> Result<Fraction, OverLimit> {
        // only common divisors of the denominators can cancel (Henrici 1956, doi:10.1145/320815.320818)
        let common = self.divisor(&a.denominator, &b.denominator)?;
        let of_b = self.over(&b.denominator, &common)?;
        let of_a = self.over(&a.denominator, &common)?;
        let mut above = self.product(&a.numerator, &of_b)?;
        let other = self.product(&b.numerator, &of_a)?;
        above.add_scaled(&self.f, &other, self.f.one());
        let again = self.divisor(&above, &common)?;
        let above = self.over(&above, &again)?;
        let shared = self.over(&a.denominator, &again)?;
        let below = self.product(&shared, &of_b)?;
        Ok(self.settled(above, below))
    }

    /// `a b`.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn times(&mut self, a: &Fraction, b: &Fraction) -> Result<Fraction, OverLimit> {
        let first = self.divisor(&a.numerator, &b.denominator)?;
        let second = self.divisor(&b.numerator, &a.denominator)?;
        let (x, y) = (self.over(&a.numerator, &first)?, self.over(&b.numerator, &second)?);
        let (u, w) = (self.over(&a.denominator, &second)?, self.over(&b.denominator, &first)?);
        let (above, below) = (self.product(&x, &y)?, self.product(&u, &w)?);
        Ok(self.settled(above, below))
    }

    /// A polynomial with a fraction in place of a variable.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn put_into(&mut self, p: &Polynomial, v: u32, value: &Fraction) -> Result<Fraction, OverLimit> {
        self.copies([p, p])?;
        let parts = p.split(v);
        let degree = parts.keys().next_back().copied().unwrap_or(0);
        if degree == 0 {
            return Ok(self.whole(p.clone()));
        }
        // all powers are stored
        self.work.take(POWER * u64::from(degree))?;
        // sum of c_k n^k d^(m-k), divided by d^m
        let mut powers = vec![[Polynomial::constant(self.f.one()), Polynomial::constant(self.f.one())]];
        for k in 0..degree as usize {
            let next = [
                self.product(&powers[k][0], &value.numerator)?,
                self.product(&powers[k][1], &value.denominator)?,
            ];
            self.keep(next[0].len() + next[1].len())?;
            powers.push(next);
        }
        let mut above = Polynomial::default();
        for (k, c) in &parts {
            let both = self.product(&powers[*k as usize][0], &powers[(degree - k) as usize][1])?;
            let term = self.product(c, &both)?;
            above.add_scaled(&self.f, &term, self.f.one());
        }
        self.fraction(&above, &powers[degree as usize][1])
    }

    /// A fraction with another in place of a variable; `None` where the denominator vanishes.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn replaced(
        &mut self,
        a: &Fraction,
        v: u32,
        value: &Fraction,
    ) -> Result<Option<Fraction>, OverLimit> {
        if !a.holds(v) {
            return Ok(Some(a.clone()));
        }
        let above = self.put_into(&a.numerator, v, value)?;
        let below = self.put_into(&a.denominator, v, value)?;
        if below.is_zero() {
            return Ok(None);
        }
        let below = self.inverse(&below);
        Ok(Some(self.times(&above, &below)?))
    }

    /// The partial derivative.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn slope(&mut self, a: &Fraction, v: u32) -> Result<Fraction, OverLimit> {
        let f = self.f;
        let above = a.numerator.derivative(&f, v);
        if a.denominator.terms_with(v) == 0 {
            return self.fraction(&above, &a.denominator);
        }
        let mut difference = self.product(&above, &a.denominator)?;
        let other = self.product(&a.numerator, &a.denominator.derivative(&f, v))?;
        difference.add_scaled(&f, &other, f.neg(f.one()));
        let first = self.fraction(&difference, &a.denominator)?;
        let inverse = self.settled(Polynomial::constant(f.one()), a.denominator.clone());
        self.times(&first, &inverse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::groebner::RemainingWork;
    use crate::{Field, SplitMix64};

    /// Random expressions: each result has the value of the operations on numbers, and is in lowest
    /// terms.
    #[test]
    fn fractions_are_their_values() {
        let f = Field::new((1 << 60) + 33);
        let mut s = Algebra { f, rng: SplitMix64::new(3), work: RemainingWork::new(1 << 32) };
        let mut rng = SplitMix64::new(7);
        for _ in 0..60 {
            let point: Vec<u64> = (0..4).map(|_| f.from_u64(rng.next_u64())).collect();
            let at = |a: &Fraction| f.mul(a.numerator.at(&f, &point), f.inv(a.denominator.at(&f, &point)));
            let mut list: Vec<Fraction> = (0..4).map(|v| s.whole(Polynomial::variable(&f, v))).collect();
            for _ in 0..6 {
                let [i, j] = [0; 2].map(|_| rng.below(list.len() as u64) as usize);
                let (a, b) = (list[i].clone(), list[j].clone());
                let new = match rng.below(4) {
                    0 => {
                        let new = s.sum(&a, &b).expect("work");
                        assert_eq!(at(&new), f.add(at(&a), at(&b)));
                        new
                    }
                    1 if !b.is_zero() => {
                        let inverse = s.inverse(&b);
                        let new = s.times(&a, &inverse).expect("work");
                        assert_eq!(f.mul(at(&new), at(&b)), at(&a));
                        new
                    }
                    2 => {
                        let value = list[4.min(list.len() - 1)].clone();
                        let Some(new) = s.replaced(&a, 1, &value).expect("work") else { continue };
                        let mut moved = point.clone();
                        moved[1] = at(&value);
                        let there = |p: &Polynomial| p.at(&f, &moved);
                        assert_eq!(f.mul(at(&new), there(&a.denominator)), there(&a.numerator));
                        new
                    }
                    _ => {
                        // (a b)' = a' b + a b', and a - a = 0
                        let product = s.times(&a, &b).expect("work");
                        let [x, y, z] = [&a, &b, &product].map(|p| s.slope(p, 2).expect("work"));
                        assert_eq!(at(&z), f.add(f.mul(at(&x), at(&b)), f.mul(at(&a), at(&y))));
                        let minus = s.minus(&a);
                        assert!(s.sum(&a, &minus).expect("work").is_zero());
                        product
                    }
                };
                let one = s.divisor(&new.numerator, &new.denominator).expect("work");
                assert!(new.is_zero() || one.as_constant().is_some(), "{new:?}");
                list.push(new);
            }
        }
    }
}
