//! Exact coefficients: a number times a power product of the earth-rate components.

use std::fmt;

use obsdeg_exact::{Radical, RootField};
use schemars::JsonSchema;
use serde::Serialize;

/// A number of a coefficient.
#[derive(Debug, Clone, PartialEq)]
pub enum Number {
    /// Exact: `a + b sqrt 2 + c sqrt 3 + d sqrt 6`.
    Radical(Radical),
    /// Exact: an expression in sines and cosines.
    Text(String),
    /// Rounded.
    Decimal(f64),
}

/// How exact a printed coefficient is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// Rationals and square roots.
    Exact,
    /// Sines and cosines of angles.
    Symbolic,
    /// Decimals, rounded to six digits.
    Decimal,
}

/// `number * wN^a * wU^b`.
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficient {
    /// The number.
    pub number: Number,
    /// Exponents `(a, b)` of `(wN, wU)`.
    pub rates: Rates,
}

/// Exponents of `(wN, wU)`.
pub type Rates = [i32; 2];

/// The exponents that are tried, simplest first.
pub(crate) fn candidate_rates() -> Vec<Rates> {
    let mut all: Vec<Rates> =
        (-2..=2).flat_map(|a| (-2..=2).map(move |b| [a, b])).collect();
    all.sort_by_key(|[a, b]| (a.abs() + b.abs(), -a, -b));
    all
}

/// One value of a coefficient, with the earth rate there.
#[derive(Debug, Clone, Copy)]
pub struct Image<E> {
    /// The value.
    pub value: E,
    /// `(wN, wU)`.
    pub rates: [E; 2],
}

impl Coefficient {
    /// Whether the coefficient is zero.
    pub fn is_zero(&self) -> bool {
        match &self.number {
            Number::Radical(r) => r.terms() == 0,
            Number::Decimal(x) => *x == 0.0,
            Number::Text(t) => t == "0",
        }
    }

    /// The coefficient whose images are `images[sample][embedding]`: recovered in the first sample,
    /// confirmed in every embedding of the second.
    pub fn recover(fields: &[RootField; 2], images: &[[Image<u64>; 4]; 2]) -> Option<Self> {
        candidate_rates().into_iter().find_map(|rates| {
            let number = |sample: usize, k: usize| {
                let (f, image) = (&fields[sample].field, images[sample][k]);
                let mut value = image.value;
                for (e, &rate) in rates.iter().zip(&image.rates) {
                    if *e != 0 && rate == 0 {
                        return None;
                    }
                    let factor = f.pow(if *e > 0 { f.inv(rate) } else { rate }, e.unsigned_abs().into());
                    value = f.mul(value, factor);
                }
                Some(value)
            };
            let first = [number(0, 0)?, number(0, 1)?, number(0, 2)?, number(0, 3)?];
            let radical = Radical::recover(&fields[0], first)?;
            let exponents = obsdeg_exact::radical::embeddings(fields[1].order);
            let confirmed = exponents
                .iter()
                .enumerate()
                .all(|(k, &a)| number(1, k) == Some(radical.image(&fields[1].conjugate(a))));
            confirmed.then_some(Self { number: Number::Radical(radical), rates })
        })
    }

    /// The decimal coefficient with values `images` at several earth rates, if it is a number times a
    /// power product.
    pub fn fit(images: &[Image<f64>]) -> Option<Self> {
        let (first, rest) = images.split_first()?;
        if images.iter().all(|i| i.value.abs() < 1e-11) {
            return Some(Self { number: Number::Decimal(0.0), rates: [0, 0] });
        }
        candidate_rates().into_iter().find_map(|rates| {
            let number = |i: &Image<f64>| i.value / (i.rates[0].powi(rates[0]) * i.rates[1].powi(rates[1]));
            let x = number(first);
            rest.iter()
                .all(|i| (number(i) - x).abs() <= 1e-8 * x.abs())
                .then_some(Self { number: Number::Decimal(x), rates })
        })
    }

    /// How exact the number is.
    pub fn form(&self) -> Form {
        match self.number {
            Number::Radical(_) => Form::Exact,
            Number::Text(_) => Form::Symbolic,
            Number::Decimal(_) => Form::Decimal,
        }
    }

    /// The sign and the magnitude as factors, without a leading `1`.
    pub fn sign_and_factors(&self) -> (bool, Vec<String>) {
        let (negative, mut factors) = self.number.sign_and_factor();
        let rate = |name: &str, e: i32| match e {
            1 => name.to_string(),
            _ => format!("{name}^{e}"),
        };
        let names = ["wN", "wU"].into_iter().zip(self.rates);
        let above: Vec<String> = names.clone().filter(|(_, e)| *e > 0).map(|(n, e)| rate(n, e)).collect();
        let below: Vec<String> = names.filter(|(_, e)| *e < 0).map(|(n, e)| rate(n, -e)).collect();
        factors.extend(above);
        if !below.is_empty() {
            let numerator = if factors.is_empty() { "1".into() } else { factors.join("*") };
            factors = vec![format!("{numerator}/{}", below.join("/"))];
        }
        (negative, factors)
    }
}

impl Number {
    /// The sign and the magnitude (nothing for one).
    fn sign_and_factor(&self) -> (bool, Vec<String>) {
        match self {
            Self::Radical(r) => {
                let negative = r.to_f64() < 0.0;
                let text = if negative { r.negated() } else { *r }.to_string();
                match text.as_str() {
                    "1" => (negative, vec![]),
                    _ if r.terms() > 1 => (negative, vec![format!("({text})")]),
                    _ => (negative, vec![text]),
                }
            }
            Self::Decimal(x) => {
                let text = decimal(x.abs());
                (*x < 0.0, if text == "1" { vec![] } else { vec![text] })
            }
            Self::Text(t) => {
                let inner = t.strip_prefix('-').filter(|rest| !has_sum(rest));
                let (negative, t) = inner.map_or((false, t.as_str()), |rest| (true, rest));
                let text = if has_sum(t) { format!("({t})") } else { t.to_string() };
                (negative, if text == "1" { vec![] } else { vec![text] })
            }
        }
    }
}

/// Whether a text has a sum outside of all brackets.
fn has_sum(text: &str) -> bool {
    let mut depth = 0;
    let mut previous = ' ';
    for (i, c) in text.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            '+' | '-' if depth == 0 && i > 0 && !matches!(previous, '^' | '*' | '/') => return true,
            _ => {}
        }
        previous = c;
    }
    false
}

/// Six significant digits, without trailing zeros.
pub fn decimal(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let digits = (5 - x.abs().log10().floor() as i32).clamp(0, 17) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// `lhs` and the terms of a sum: joins coefficients and names, as in `D_FZ - wN*psi_y`.
pub fn linear_combination<'a>(terms: impl IntoIterator<Item = (&'a Coefficient, &'a str)>) -> String {
    let mut out = String::new();
    for (coefficient, name) in terms.into_iter().filter(|(c, _)| !c.is_zero()) {
        let (negative, mut factors) = coefficient.sign_and_factors();
        factors.push(name.into());
        out.push_str(match (out.is_empty(), negative) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        });
        out.push_str(&factors.join("*"));
    }
    if out.is_empty() { "0".into() } else { out }
}

impl fmt::Display for Coefficient {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_zero() {
            return f.write_str("0");
        }
        let (negative, factors) = self.sign_and_factors();
        let magnitude = if factors.is_empty() { "1".into() } else { factors.join("*") };
        write!(f, "{}{magnitude}", if negative { "-" } else { "" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coefficient(x: f64, rates: Rates) -> Coefficient {
        Coefficient { number: Number::Decimal(x), rates }
    }

    #[test]
    fn prints_signs_and_rates() {
        assert_eq!(coefficient(-1.0, [1, 0]).to_string(), "-wN");
        assert_eq!(coefficient(0.5, [-1, 1]).to_string(), "0.5*wU/wN");
        assert_eq!(coefficient(1.0, [0, 0]).to_string(), "1");
        let sum = linear_combination([
            (&coefficient(1.0, [0, 0]), "D_FZ"),
            (&coefficient(-1.0, [1, 0]), "psi_y"),
        ]);
        assert_eq!(sum, "D_FZ - wN*psi_y");
    }

    #[test]
    fn fits_power_products_only() {
        let at = |f: &dyn Fn(f64, f64) -> f64| {
            [(0.7, 1.3), (1.1, 0.6), (0.9, 1.7)].map(|(n, u)| Image { value: f(n, u), rates: [n, u] })
        };
        let c = Coefficient::fit(&at(&|n, u| -0.25 * u / n)).expect("a power product");
        assert_eq!(c.to_string(), "-0.25*wU/wN");
        assert_eq!(Coefficient::fit(&at(&|n, u| n + u)), None);
    }

    #[test]
    fn six_digits() {
        assert_eq!(decimal(0.123_456_789), "0.123457");
        assert_eq!(decimal(1234567.0), "1234567");
        assert_eq!(decimal(-1.5), "-1.5");
    }
}
