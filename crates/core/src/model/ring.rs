//! Rings in which the same model is evaluated.

use std::sync::OnceLock;

use obsdeg_exact::series::SeriesRing;
use obsdeg_exact::{Ball, Field};

/// Arithmetic that a model needs of its numbers. The platform is written once over this trait: its images in
/// a prime field give the verdicts, in `f64` the decimals, as text the exact formulas.
pub trait Ring {
    /// Element of the ring.
    type Element: Clone;
    /// The neutral element of addition.
    fn zero(&self) -> Self::Element;
    /// The neutral element of multiplication.
    fn one(&self) -> Self::Element;
    /// Sum `a + b`.
    fn add(&self, a: &Self::Element, b: &Self::Element) -> Self::Element;
    /// Product `a b`.
    fn mul(&self, a: &Self::Element, b: &Self::Element) -> Self::Element;
    /// Negative `-a`.
    fn neg(&self, a: &Self::Element) -> Self::Element;
    /// True if `a` is certainly zero.
    fn is_zero(&self, a: &Self::Element) -> bool;

    /// Sum of products `sum a_i b_i`.
    fn dot<'a>(
        &self,
        terms: impl IntoIterator<Item = (&'a Self::Element, &'a Self::Element)>,
    ) -> Self::Element
    where
        Self::Element: 'a,
    {
        terms.into_iter().fold(self.zero(), |sum, (a, b)| {
            if self.is_zero(a) || self.is_zero(b) { sum } else { self.add(&sum, &self.mul(a, b)) }
        })
    }
}

impl Ring for Field {
    type Element = u64;
    #[inline]
    fn zero(&self) -> u64 {
        0
    }
    #[inline]
    fn one(&self) -> u64 {
        Field::one(self)
    }
    #[inline]
    fn add(&self, a: &u64, b: &u64) -> u64 {
        Field::add(self, *a, *b)
    }
    #[inline]
    fn mul(&self, a: &u64, b: &u64) -> u64 {
        Field::mul(self, *a, *b)
    }
    #[inline]
    fn neg(&self, a: &u64) -> u64 {
        Field::neg(self, *a)
    }
    #[inline]
    fn is_zero(&self, a: &u64) -> bool {
        *a == 0
    }
}

impl Ring for SeriesRing {
    type Element = Vec<u64>;
    fn zero(&self) -> Vec<u64> {
        vec![0; self.precision]
    }
    fn one(&self) -> Vec<u64> {
        self.monomial(self.field.one(), 0)
    }
    fn add(&self, a: &Vec<u64>, b: &Vec<u64>) -> Vec<u64> {
        a.iter().zip(b).map(|(&a, &b)| self.field.add(a, b)).collect()
    }
    fn mul(&self, a: &Vec<u64>, b: &Vec<u64>) -> Vec<u64> {
        SeriesRing::mul(self, a, b)
    }
    fn neg(&self, a: &Vec<u64>) -> Vec<u64> {
        a.iter().map(|&a| self.field.neg(a)).collect()
    }
    fn is_zero(&self, a: &Vec<u64>) -> bool {
        a.iter().all(|&a| a == 0)
    }
    fn dot<'a>(&self, terms: impl IntoIterator<Item = (&'a Vec<u64>, &'a Vec<u64>)>) -> Vec<u64> {
        let mut sum = self.zero();
        for (a, b) in terms {
            self.add_product(&mut sum, a, b);
        }
        sum
    }
}

/// Ring of floating-point numbers.
#[derive(Debug, Clone, Copy)]
pub struct Float;

impl Ring for Float {
    type Element = f64;
    #[inline]
    fn zero(&self) -> f64 {
        0.0
    }
    #[inline]
    fn one(&self) -> f64 {
        1.0
    }
    #[inline]
    fn add(&self, a: &f64, b: &f64) -> f64 {
        a + b
    }
    #[inline]
    fn mul(&self, a: &f64, b: &f64) -> f64 {
        a * b
    }
    #[inline]
    fn neg(&self, a: &f64) -> f64 {
        -a
    }
    #[inline]
    fn is_zero(&self, a: &f64) -> bool {
        *a == 0.0
    }
}

/// Real number of 512 bits with a bound on its error.
pub(crate) type Real = Ball<8>;

/// Ring of real numbers of many digits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ManyDigits;

impl ManyDigits {
    /// Angle of the half turn, computed once.
    fn pi() -> &'static Real {
        static PI: OnceLock<Real> = OnceLock::new();
        PI.get_or_init(Real::pi)
    }

    /// Cosine and sine of an angle in 1e-9 degrees; exact at quarter turns.
    pub(crate) fn cos_sin(nanodeg: i64) -> Option<(Real, Real)> {
        const QUARTER: i64 = 90_000_000_000;
        let (quarters, rest) = (nanodeg.div_euclid(QUARTER).rem_euclid(4), nanodeg.rem_euclid(QUARTER));
        let half_turns = Real::from_i64(rest).div(&Real::from_i64(2 * QUARTER))?;
        let (s, c) = if rest == 0 { Real::ZERO.sin_cos()? } else { half_turns.mul(Self::pi()).sin_cos()? };
        Some(match quarters {
            0 => (c, s),
            1 => (s.neg(), c),
            2 => (c.neg(), s.neg()),
            _ => (s, c.neg()),
        })
    }

    /// The nearest double, or zero if the number cannot be distinguished from zero to 1e-60; `None` if the
    /// number is not known to all digits of a double.
    pub(crate) fn to_f64(x: &Real) -> Option<f64> {
        let known =
            if x.is_zero() { x.radius_log2() < -200.0 } else { x.radius_log2() < x.size_log2() - 60.0 };
        Some(x.to_f64()).filter(|x| known && x.is_finite())
    }
}

impl Ring for ManyDigits {
    type Element = Real;
    fn zero(&self) -> Real {
        Real::ZERO
    }
    fn one(&self) -> Real {
        Real::from_i64(1)
    }
    fn add(&self, a: &Real, b: &Real) -> Real {
        a.add(b)
    }
    fn mul(&self, a: &Real, b: &Real) -> Real {
        a.mul(b)
    }
    fn neg(&self, a: &Real) -> Real {
        a.neg()
    }
    fn is_zero(&self, a: &Real) -> bool {
        a.is_exactly_zero()
    }
}

/// Sign of a text, and its magnitude as a factor: a sum is put in brackets.
fn signed_factor(text: &str) -> (bool, String) {
    let (minus, rest) = text.strip_prefix('-').map_or((false, text), |rest| (true, rest));
    let mut depth = 0;
    let sum = rest.char_indices().any(|(i, c)| {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            '+' | '-' => return depth == 0 && i > 0,
            _ => {}
        }
        false
    });
    if sum { (false, format!("({text})")) } else { (minus, rest.to_string()) }
}

/// Ring of expressions as text, not expanded except for zeros and ones.
#[derive(Debug, Clone, Copy)]
pub struct Text;

impl Ring for Text {
    type Element = String;
    fn zero(&self) -> String {
        "0".into()
    }
    fn one(&self) -> String {
        "1".into()
    }
    fn add(&self, a: &String, b: &String) -> String {
        match (a.as_str(), b.as_str()) {
            ("0", _) => b.clone(),
            (_, "0") => a.clone(),
            _ if b.starts_with('-') => format!("{a}{b}"),
            _ => format!("{a}+{b}"),
        }
    }
    fn mul(&self, a: &String, b: &String) -> String {
        let ((minus_a, a), (minus_b, b)) = (signed_factor(a), signed_factor(b));
        let magnitude = match (a.as_str(), b.as_str()) {
            ("0", _) | (_, "0") => return "0".into(),
            ("1", _) => b,
            (_, "1") => a,
            _ => format!("{a}*{b}"),
        };
        if minus_a == minus_b { magnitude } else { format!("-{magnitude}") }
    }
    fn neg(&self, a: &String) -> String {
        match signed_factor(a) {
            (_, zero) if zero == "0" => zero,
            (true, magnitude) => magnitude,
            (false, magnitude) => format!("-{magnitude}"),
        }
    }
    fn is_zero(&self, a: &String) -> bool {
        a == "0"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_keep_signs_outside_and_sums_in_brackets() {
        let t = |s: &str| s.to_string();
        assert_eq!(Text.mul(&t("-a"), &t("-b*c")), "a*b*c");
        assert_eq!(Text.mul(&t("-a"), &t("b-c")), "-a*(b-c)");
        assert_eq!(Text.mul(&t("-(a+b)"), &t("-1")), "(a+b)");
        assert_eq!(Text.neg(&t("-a+b")), "-(-a+b)");
        assert_eq!(Text.neg(&t("0")), "0");
        assert_eq!(Text.add(&t("a"), &t("-b")), "a-b");
        assert_eq!(Text.mul(&t("a+b"), &t("1")), "(a+b)");
    }
}
