//! The rings in which one and the same model is written out.

use obsdeg_exact::Field;
use obsdeg_exact::series::SeriesRing;

/// What a model needs of its numbers. The platform is written once over this trait: its images in a
/// prime field give the verdicts, in `f64` the decimals, as text the exact formulas.
pub trait Ring {
    /// An element.
    type Element: Clone;
    /// The neutral element of addition.
    fn zero(&self) -> Self::Element;
    /// The neutral element of multiplication.
    fn one(&self) -> Self::Element;
    /// `a + b`.
    fn add(&self, a: &Self::Element, b: &Self::Element) -> Self::Element;
    /// `a b`.
    fn mul(&self, a: &Self::Element, b: &Self::Element) -> Self::Element;
    /// `-a`.
    fn neg(&self, a: &Self::Element) -> Self::Element;
    /// Whether `a` is zero for certain.
    fn is_zero(&self, a: &Self::Element) -> bool;

    /// `sum a_i b_i`.
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
    fn zero(&self) -> u64 {
        0
    }
    fn one(&self) -> u64 {
        Field::one(self)
    }
    fn add(&self, a: &u64, b: &u64) -> u64 {
        Field::add(self, *a, *b)
    }
    fn mul(&self, a: &u64, b: &u64) -> u64 {
        Field::mul(self, *a, *b)
    }
    fn neg(&self, a: &u64) -> u64 {
        Field::neg(self, *a)
    }
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

/// Floating-point numbers.
#[derive(Debug, Clone, Copy)]
pub struct Float;

impl Ring for Float {
    type Element = f64;
    fn zero(&self) -> f64 {
        0.0
    }
    fn one(&self) -> f64 {
        1.0
    }
    fn add(&self, a: &f64, b: &f64) -> f64 {
        a + b
    }
    fn mul(&self, a: &f64, b: &f64) -> f64 {
        a * b
    }
    fn neg(&self, a: &f64) -> f64 {
        -a
    }
    fn is_zero(&self, a: &f64) -> bool {
        *a == 0.0
    }
}

/// The sign of a text and its magnitude as a factor: a sum is put in brackets.
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

/// Expressions as text, unexpanded but for zeros and ones.
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
