//! Exact coefficients: a number times a power product of the earth-rate components.

use std::fmt;

use obsdeg_exact::{Field, Radical, RootField};
use schemars::JsonSchema;
use serde::Serialize;

/// Number of a coefficient: exact or decimal.
#[derive(Debug, Clone, PartialEq)]
pub enum Number {
    /// Exact: `a + b sqrt 2 + c sqrt 3 + d sqrt 6`.
    Radical(Radical),
    /// Exact: an expression in sines and cosines.
    Text {
        /// Text in the symbols of the engine.
        raw: String,
        /// Text for readers.
        shown: String,
    },
    /// Decimal, rounded.
    Decimal(f64),
}

/// Longest readable number in a formula, in characters.
pub(crate) const READABLE: usize = 40;

/// Coefficients in printed form: if one of them is too long to read, all become decimals.
pub(crate) fn readable(coefficients: Vec<Coefficient>) -> Vec<Coefficient> {
    if coefficients.iter().any(Coefficient::is_unreadable) {
        return coefficients.iter().map(Coefficient::rounded).collect();
    }
    coefficients
}

/// Form of a printed coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// Rational numbers and square roots, exact.
    Exact,
    /// Sines and cosines of angles.
    Symbolic,
    /// Decimals, rounded to six places (small ones to six digits).
    Decimal,
}

/// Coefficient `number * wN^a * wU^b`.
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficient {
    /// Number without the rates.
    pub number: Number,
    /// Exponents `(a, b)` of `(wN, wU)`.
    pub rates: Rates,
}

/// Exponents of `(wN, wU)`.
pub(crate) type Rates = [i32; 2];

/// Exponents that are tried, simplest first.
fn candidate_rates() -> Vec<Rates> {
    let mut all: Vec<Rates> = (-2..=2).flat_map(|a| (-2..=2).map(move |b| [a, b])).collect();
    all.sort_by_key(|[a, b]| (a.abs() + b.abs(), -a, -b));
    all
}

/// Value of a coefficient in a field, with the earth rate at that point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Image {
    /// Value of the coefficient.
    pub value: u64,
    /// Earth rate `(wN, wU)`.
    pub rates: [u64; 2],
}

/// Exponents `(a, b)` for which `value / (wN^a wU^b)` is equal at two points of one field; `None` if there
/// are none.
pub(crate) fn rates_between(f: &Field, first: Image, second: Image) -> Option<Rates> {
    if first.value == 0 && second.value == 0 {
        return Some([0, 0]);
    }
    let number = |image: Image, rates| Some(f.mul(image.value, f.inv(power(f, image.rates, rates)?)));
    candidate_rates()
        .into_iter()
        .find(|&rates| number(first, rates).is_some_and(|x| number(second, rates) == Some(x)))
}

/// `wN^a wU^b` in a field; `None` when a rate that occurs is zero.
pub(crate) fn power(f: &Field, values: [u64; 2], rates: Rates) -> Option<u64> {
    values.into_iter().zip(rates).try_fold(f.one(), |product, (w, e)| {
        let base = match e {
            0 => return Some(product),
            _ if w == 0 => return None,
            e if e < 0 => f.inv(w),
            _ => w,
        };
        Some(f.mul(product, f.pow(base, e.unsigned_abs().into())))
    })
}

/// Number with the images `images[sample][embedding]`: recovered in the first sample, confirmed in every
/// embedding of the second.
pub(crate) fn recover_radical(fields: &[RootField; 2], images: &[[u64; 4]; 2]) -> Option<Radical> {
    let radical = Radical::recover(&fields[0], images[0])?;
    let exponents = obsdeg_exact::radical::embeddings(fields[1].order);
    let confirmed =
        exponents.iter().zip(images[1]).all(|(&a, image)| image == radical.image(&fields[1].conjugate(a)));
    confirmed.then_some(radical)
}

impl Coefficient {
    /// True if the coefficient is zero.
    pub fn is_zero(&self) -> bool {
        match &self.number {
            Number::Radical(r) => r.terms() == 0,
            Number::Decimal(x) => *x == 0.0,
            Number::Text { raw, .. } => raw == "0",
        }
    }

    /// The number one.
    pub fn one() -> Self {
        Self { number: Number::Radical(Radical::rational(1, 1)), rates: [0, 0] }
    }

    /// The coefficient with a long root expression replaced by its decimal.
    #[must_use]
    pub fn rounded(&self) -> Self {
        match &self.number {
            Number::Radical(r) => Self { number: Number::Decimal(r.to_f64()), rates: self.rates },
            _ => self.clone(),
        }
    }

    /// True if the number is exact and longer than [`READABLE`] as text.
    pub(crate) fn is_unreadable(&self) -> bool {
        matches!(self.number, Number::Radical(_)) && self.without_rates().to_string().len() > READABLE
    }

    /// The coefficient with the powers of the rates removed.
    #[must_use]
    pub(crate) fn without_rates(&self) -> Self {
        Self { number: self.number.clone(), rates: [0, 0] }
    }

    /// The coefficient negated, for a number that prints with a leading minus.
    #[must_use]
    pub fn negated(&self) -> Self {
        let number = match &self.number {
            Number::Radical(r) => Number::Radical(r.negated()),
            Number::Decimal(x) => Number::Decimal(-x),
            Number::Text { raw, shown } => {
                let strip = |s: &str| s.strip_prefix('-').map_or_else(|| format!("-({s})"), String::from);
                Number::Text { raw: strip(raw), shown: strip(shown) }
            }
        };
        Self { number, rates: self.rates }
    }

    /// Form of the number: exact, symbolic or decimal.
    pub fn form(&self) -> Form {
        match self.number {
            Number::Radical(_) => Form::Exact,
            Number::Text { .. } => Form::Symbolic,
            Number::Decimal(_) => Form::Decimal,
        }
    }

    /// The sign and the magnitude as factors, without a leading `1`.
    pub fn sign_and_factors(&self) -> (bool, Vec<String>) {
        self.factors(self.number.sign_and_factor(decimal))
    }

    /// The sign and the magnitude as factors, with all digits of decimals.
    pub(crate) fn precise_sign_and_factors(&self) -> (bool, Vec<String>) {
        self.factors(self.number.sign_and_factor(|x| x.to_string()))
    }

    fn factors(&self, (negative, mut factors): (bool, Vec<String>)) -> (bool, Vec<String>) {
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
    /// The sign and the magnitude of the number; the magnitude is empty for one.
    fn sign_and_factor(&self, decimal: impl Fn(f64) -> String) -> (bool, Vec<String>) {
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
            Self::Text { shown, .. } => {
                let t = shown.as_str();
                let inner = t.strip_prefix('-').filter(|rest| !has_sum(rest));
                let (negative, t) = inner.map_or((false, t), |rest| (true, rest));
                let text = if has_sum(t) { format!("({t})") } else { t.to_string() };
                (negative, if text == "1" { vec![] } else { vec![text] })
            }
        }
    }
}

/// True if a text has a sum outside of all brackets.
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

/// Factors of a product or quotient outside of all brackets: `(above, below)` the bar. Brackets around a
/// product below the bar are removed.
fn bars(text: &str) -> (Vec<&str>, Vec<&str>) {
    let (mut above, mut below) = (Vec::new(), Vec::new());
    let (mut depth, mut start, mut under) = (0, 0, false);
    for (i, c) in text.char_indices().chain([(text.len(), '*')]) {
        depth += i32::from(c == '(') - i32::from(c == ')');
        if depth != 0 || !matches!(c, '*' | '/') {
            continue;
        }
        let part = &text[start..i];
        let inner = part.strip_prefix('(').and_then(|p| p.strip_suffix(')'));
        match inner.filter(|p| under && !has_sum(p) && !p.contains('/')) {
            Some(inner) => below.extend(bars(inner).0),
            None if under => below.push(part),
            None => above.push(part),
        }
        (start, under) = (i + 1, c == '/');
    }
    (above, below)
}

/// Factors as one text with one fraction bar, so that numerator and denominator are unambiguous:
/// `wU*w@p1/(2*wN)`. A leading number keeps its own bar: `1/2*wU`.
pub(crate) fn product(factors: &[String]) -> String {
    let text = factors.join("*");
    let (mut above, below) = bars(&text);
    if below.iter().all(|b| b.bytes().all(|c| c.is_ascii_digit())) && below.len() < 2 {
        return text;
    }
    above.retain(|a| *a != "1");
    let above = if above.is_empty() { "1".into() } else { above.join("*") };
    match &below[..] {
        [one] => format!("{above}/{one}"),
        several => format!("{above}/({})", several.join("*")),
    }
}

/// Decimal text: six decimals, or six significant digits of small numbers, without trailing zeros. Nearly
/// cancelling terms of a solution then have equal absolute accuracy.
pub(crate) fn decimal(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let digits = (5 - x.abs().log10().floor() as i32).clamp(6, 17) as usize;
    let text = format!("{x:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

/// Text of a sum: joins coefficients and names, as in `D_FZ - wN*psi_y`.
pub(crate) fn linear_combination<'a>(terms: impl IntoIterator<Item = (&'a Coefficient, &'a str)>) -> String {
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
        out.push_str(&product(&factors));
    }
    if out.is_empty() { "0".into() } else { out }
}

impl fmt::Display for Coefficient {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_zero() {
            return f.write_str("0");
        }
        let (negative, factors) = self.sign_and_factors();
        let magnitude = if factors.is_empty() { "1".into() } else { product(&factors) };
        write!(f, "{}{magnitude}", if negative { "-" } else { "" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use obsdeg_exact::Ratio;

    fn coefficient(x: f64, rates: Rates) -> Coefficient {
        Coefficient { number: Number::Decimal(x), rates }
    }

    #[test]
    fn prints_signs_and_rates() {
        assert_eq!(coefficient(-1.0, [1, 0]).to_string(), "-wN");
        assert_eq!(coefficient(0.5, [-1, 1]).to_string(), "0.5*wU/wN");
        assert_eq!(coefficient(1.0, [0, 0]).to_string(), "1");
        let sum =
            linear_combination([(&coefficient(1.0, [0, 0]), "D_FZ"), (&coefficient(-1.0, [1, 0]), "psi_y")]);
        assert_eq!(sum, "D_FZ - wN*psi_y");
    }

    #[test]
    fn one_bar() {
        for (factors, printed) in [
            (&["1/2", "wU"][..], "1/2*wU"),
            (&["sqrt(2)/2", "wU^2"], "sqrt(2)/2*wU^2"),
            (&["wU/wN"], "wU/wN"),
            (&["1/2*wU/wN", "w@p1"], "wU*w@p1/(2*wN)"),
            (&["1/2", "wU/3"], "wU/(2*3)"),
            (&["1/2/cos(alpha)^2", "wN"], "wN/(2*cos(alpha)^2)"),
            (&["1/2/(cos(a)*sin(a))", "wN"], "wN/(2*cos(a)*sin(a))"),
            (&["(1+sqrt(3))/cos(a + b)/wN"], "(1+sqrt(3))/(cos(a + b)*wN)"),
            (&["1/(1+sin(a))"], "1/(1+sin(a))"),
            (&["1/wN"], "1/wN"),
            (&["cos(a)^2/sin(a)", "D_SZ"], "cos(a)^2*D_SZ/sin(a)"),
        ] {
            let factors: Vec<String> = factors.iter().map(ToString::to_string).collect();
            assert_eq!(product(&factors), printed);
        }
    }

    #[test]
    fn rates_are_found_by_comparison() {
        let f = Field::new((1 << 60) + 33);
        let at = |n: i64, u: i64| {
            let rates = [f.from_i64(n), f.from_i64(u)];
            let product = f.mul(f.from_ratio(-1, 3), f.mul(rates[1], f.inv(rates[0])));
            Image { value: product, rates }
        };
        assert_eq!(rates_between(&f, at(5, 7), at(11, 13)), Some([-1, 1]));
        let sum = |n: i64, u: i64| Image { value: f.from_i64(n + u), ..at(n, u) };
        assert_eq!(rates_between(&f, sum(5, 7), sum(11, 13)), None);
    }

    fn radical(parts: [(i64, i64); 4], rates: Rates) -> Coefficient {
        let sum = |c: [(i64, i64); 4]| Radical { coefficients: c.map(|(num, den)| Ratio { num, den }) };
        Coefficient { number: Number::Radical(sum(parts)), rates }
    }

    fn symbolic(shown: &str) -> Coefficient {
        Coefficient { number: Number::Text { raw: shown.into(), shown: shown.into() }, rates: [0, 0] }
    }

    const ZERO: (i64, i64) = (0, 1);

    #[test]
    fn what_is_zero_and_how_exact_it_is() {
        let of = |c: &Coefficient| (c.is_zero(), c.form());
        assert_eq!(of(&radical([ZERO; 4], [1, 0])), (true, Form::Exact));
        assert_eq!(of(&radical([ZERO, ZERO, (1, 2), ZERO], [0, 0])), (false, Form::Exact));
        assert_eq!(of(&coefficient(0.0, [0, 0])), (true, Form::Decimal));
        assert_eq!(of(&coefficient(-0.1, [0, 0])), (false, Form::Decimal));
        assert_eq!(of(&symbolic("0")), (true, Form::Symbolic));
        assert_eq!(of(&symbolic("sin(a)")), (false, Form::Symbolic));
        assert_eq!(of(&Coefficient::one()), (false, Form::Exact));
        assert_eq!(symbolic("0").to_string(), "0");
    }

    #[test]
    fn factors_of_every_kind_of_number() {
        let of = |c: &Coefficient| c.sign_and_factors();
        let list = |negative: bool, factors: &[&str]| {
            (negative, factors.iter().map(ToString::to_string).collect::<Vec<_>>())
        };
        assert_eq!(of(&Coefficient::one()), list(false, &[]));
        assert_eq!(of(&radical([(-1, 1), ZERO, ZERO, ZERO], [0, 1])), list(true, &["wU"]));
        assert_eq!(of(&radical([(1, 2), ZERO, ZERO, ZERO], [2, -1])), list(false, &["1/2*wN^2/wU"]));
        assert_eq!(of(&radical([(1, 1), (-1, 1), ZERO, ZERO], [0, 0])), list(true, &["(-1+sqrt(2))"]));
        assert_eq!(of(&radical([(1, 1), ZERO, ZERO, ZERO], [-1, -2])), list(false, &["1/wN/wU^2"]));
        assert_eq!(of(&coefficient(-1.0, [0, 0])), list(true, &[]));
        assert_eq!(of(&symbolic("-sin(a)")), list(true, &["sin(a)"]));
        assert_eq!(of(&symbolic("-sin(a)+1")), list(false, &["(-sin(a)+1)"]));
        assert_eq!(of(&symbolic("sin(a-b)")), list(false, &["sin(a-b)"]));
        assert_eq!(of(&symbolic("1")), list(false, &[]));
        // zero has no sign
        assert_eq!(of(&radical([ZERO; 4], [0, 0])), list(false, &["0"]));
        assert_eq!(of(&coefficient(0.0, [0, 0])), list(false, &["0"]));
        // all digits if requested
        let third = coefficient(-1.0 / 3.0, [1, 0]);
        assert_eq!(third.sign_and_factors(), list(true, &["0.333333", "wN"]));
        assert_eq!(third.precise_sign_and_factors(), list(true, &["0.3333333333333333", "wN"]));
    }

    #[test]
    fn sums_outside_of_brackets() {
        for sum in ["a+b", "a-b", "sin(a)-1", "(a)+(b)", "2*a+b"] {
            assert!(has_sum(sum), "{sum}");
        }
        for product in ["-a", "sin(a+b)", "a*-b", "a^-2", "a/-b", "(a+b)*(c-d)", "+a"] {
            assert!(!has_sum(product), "{product}");
        }
    }

    #[test]
    fn negated_is_the_opposite() {
        assert_eq!(coefficient(0.5, [1, 0]).negated(), coefficient(-0.5, [1, 0]));
        assert_eq!(
            radical([(1, 2), ZERO, (-3, 1), ZERO], [0, 0]).negated(),
            radical([(-1, 2), ZERO, (3, 1), ZERO], [0, 0])
        );
        assert_eq!(symbolic("-sin(a)").negated(), symbolic("sin(a)"));
        assert_eq!(symbolic("sin(a)").negated(), symbolic("-(sin(a))"));
    }

    #[test]
    fn long_roots_become_decimals_together() {
        let long = radical([(1234, 987), (-4321, 789), (77777, 1234), (1, 98765)], [1, 0]);
        assert!(long.without_rates().to_string().len() > READABLE && long.is_unreadable());
        // as long as allowed
        let limit =
            radical([(-1_234_567_890_123_456_789, 9_123_456_789_012_345_678), ZERO, ZERO, ZERO], [0, 0]);
        assert!(limit.to_string().len() == READABLE && !limit.is_unreadable(), "{limit}");
        let half = radical([(1, 2), ZERO, ZERO, ZERO], [0, 0]);
        assert!(!half.is_unreadable() && !coefficient(1.0, [0, 0]).is_unreadable());
        assert_eq!(readable(vec![half.clone()]), vec![half.clone()]);
        let shown = readable(vec![half, long]);
        assert_eq!(shown[0], coefficient(0.5, [0, 0]));
        // 1234/987 - 4321/789 sqrt 2 + 77777/1234 sqrt 3 + sqrt 6/98765, by bc
        let Number::Decimal(x) = shown[1].number else { panic!("{:?}", shown[1]) };
        assert!((x - 102.673_590_249_84).abs() < 1e-9 && shown[1].rates == [1, 0], "{x}");
    }

    #[test]
    fn powers_of_the_rates() {
        let f = Field::new((1 << 60) + 33);
        let rates = [f.from_i64(3), f.from_i64(5)];
        assert_eq!(power(&f, rates, [2, -1]), Some(f.from_ratio(9, 5)));
        assert_eq!(power(&f, rates, [0, 0]), Some(f.one()));
        assert_eq!(power(&f, [0, rates[1]], [0, 1]), Some(rates[1]));
        assert_eq!(power(&f, [0, rates[1]], [1, 1]), None);
        let zero = Image { value: 0, rates };
        assert_eq!(rates_between(&f, zero, zero), Some([0, 0]));
        assert_eq!(rates_between(&f, zero, Image { value: 1, rates }), None);
        assert_eq!(rates_between(&f, Image { value: 1, rates }, zero), None);
        // the simplest comes first; exponents go up to the second power of each rate
        let all = candidate_rates();
        assert_eq!((all.len(), &all[..5]), (25, &[[0, 0], [1, 0], [0, 1], [0, -1], [-1, 0]][..]));
        let square = |n: i64, u: i64| {
            let rates = [f.from_i64(n), f.from_i64(u)];
            Image { value: f.mul(f.from_i64(7), f.from_ratio(n * n, u * u)), rates }
        };
        assert_eq!(rates_between(&f, square(3, 5), square(11, 13)), Some([2, -2]));
    }

    #[test]
    fn a_radical_must_hold_in_both_fields() {
        use obsdeg_exact::SplitMix64;
        use obsdeg_exact::radical::embeddings;
        let mut rng = SplitMix64::new(9);
        let fields = [0, 1].map(|_| RootField::random(24, &mut rng).expect("order"));
        let sent =
            Radical { coefficients: [(1, 2), (-3, 4), ZERO, (5, 1)].map(|(num, den)| Ratio { num, den }) };
        let images = fields.map(|k| embeddings(24).map(|a| sent.image(&k.conjugate(a))));
        assert_eq!(recover_radical(&fields, &images), Some(sent));
        for e in 0..4 {
            let mut wrong = images;
            wrong[1][e] = fields[1].field.add(wrong[1][e], fields[1].field.one());
            assert_eq!(recover_radical(&fields, &wrong), None);
        }
    }

    #[test]
    fn sums_of_named_terms() {
        let (half, minus) = (coefficient(0.5, [0, 0]), coefficient(-1.0, [0, 1]));
        assert_eq!(linear_combination([(&minus, "a"), (&half, "b")]), "-wU*a + 0.5*b");
        assert_eq!(linear_combination([(&coefficient(0.0, [0, 0]), "a"), (&half, "b")]), "0.5*b");
        assert_eq!(linear_combination([]), "0");
    }

    #[test]
    fn six_decimals() {
        assert_eq!(decimal(0.123_456_789), "0.123457");
        assert_eq!(decimal(1234567.0), "1234567");
        assert_eq!(decimal(-1.5), "-1.5");
        // nearly cancelling terms of 1249.85 and -670.001
        assert_eq!(decimal(1_249.850_123_4), "1249.850123");
        assert_eq!(["0", "0.001", "100000", "99999.9"], [0.0, 0.001, 1e5, 99_999.9].map(decimal)[..]);
    }
}
