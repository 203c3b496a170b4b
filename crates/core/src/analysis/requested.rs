//! Combinations that a scheme asks for: read, checked to be linear, judged.

use obsdeg_exact::radical::{Ratio, embeddings};
use obsdeg_exact::{Field, Radical, SplitMix64};

use super::{AnalysisError, Status, Verdict};
use crate::degree::coefficient::{Coefficient, Image, Number, rates_between, recover_radical};
use crate::degree::ensemble::Verdicts;
use crate::model::expression::{Environment, Expression, ExpressionError, Function, Node, evaluate, parse};
use crate::model::platform::{RandomValues, Sample};
use crate::model::ring::{Ring, Text};
use crate::model::{Angle, Platform};
use crate::solution::solver::Sparse;
use crate::solution::symbols::Symbols;

/// What the names of a combination stand for.
struct Names<'a> {
    unknowns: &'a [String],
    generic: Vec<String>,
    symbols: Symbols,
}

impl<'a> Names<'a> {
    fn of(platform: &'a Platform) -> Self {
        let generic = platform.scheme().generic_names();
        Self { unknowns: platform.names(), generic, symbols: Symbols::of(platform) }
    }

    /// The cosine and sine of an angle of the scheme as text.
    fn cos_sin(&self, angle: &str) -> Option<(String, String)> {
        let angle: Angle = angle.strip_suffix(" deg").unwrap_or(angle).parse().ok()?;
        self.symbols.has(&angle).then(|| self.symbols.cos_sin(&angle))
    }
}

/// `n = s^2 m` with m one of 1, 2, 3, 6: s and the place of `sqrt m` in a radical.
fn square_root(n: i32) -> Option<(i64, usize)> {
    let n = i64::from(n);
    [1, 2, 3, 6].into_iter().enumerate().find_map(|(i, m)| {
        let square = (n > 0 && n % m == 0).then_some(n / m)?;
        let s = square.isqrt();
        (s * s == square).then_some((s, i))
    })
}

struct Unit<'a> {
    names: &'a Names<'a>,
    values: &'a RandomValues,
    sample: &'a Sample,
    /// The value of each unknown.
    unknowns: &'a [u64],
    rates: [u64; 2],
}

impl Environment for Unit<'_> {
    fn name(&self, name: &str) -> Option<u64> {
        match name {
            "wN" => Some(self.rates[0]),
            "wU" => Some(self.rates[1]),
            _ => self.names.unknowns.iter().position(|n| n == name).map(|c| self.unknowns[c]),
        }
    }
    fn cos_sin(&self, angle: &str) -> Option<(u64, u64)> {
        let (c, s) = self.names.cos_sin(angle)?;
        let value = |text: &str| self.names.symbols.value(text, self.values, self.sample);
        Some((value(&c)?, value(&s)?))
    }
    fn sqrt(&self, n: i32) -> Option<u64> {
        let (s, place) = square_root(n)?;
        let mut coefficients = [Ratio { num: 0, den: 1 }; 4];
        coefficients[place] = Ratio { num: s, den: 1 };
        Some(Radical { coefficients }.image(&self.sample.roots))
    }
    fn known(&self) -> Vec<String> {
        let rates = ["wN".to_string(), "wU".into()];
        self.names.unknowns.iter().chain(&self.names.generic).cloned().chain(rates).collect()
    }
}

/// One point at which a combination is looked at.
struct At<'a> {
    values: &'a RandomValues,
    sample: &'a Sample,
    rates: [u64; 2],
}

impl At<'_> {
    fn field(&self) -> &Field {
        &self.sample.roots.field
    }
}

/// The coefficients of a linear expression at one point, or why it is not linear: then it is not the sum of its parts at random values.
fn row_of(
    expression: &Expression,
    names: &Names<'_>,
    point: &At<'_>,
    rng: &mut SplitMix64,
) -> Result<Vec<u64>, ExpressionError> {
    let (f, n) = (point.field(), names.unknowns.len());
    let at = |unknowns: &[u64]| {
        let At { values, sample, rates } = *point;
        evaluate(expression, f, &Unit { names, values, sample, unknowns, rates })
    };
    let zero = vec![0; n];
    let unit = |c: usize| -> Vec<u64> { (0..n).map(|j| if j == c { f.one() } else { 0 }).collect() };
    // what it does not name has no part in it
    let named = |c: usize| {
        expression.nodes.iter().any(|n| matches!(n, Node::Name(name) if *name == names.unknowns[c]))
    };
    let row: Vec<u64> =
        (0..n).map(|c| if named(c) { at(&unit(c)) } else { Ok(0) }).collect::<Result<_, _>>()?;
    let probe: Vec<u64> = (0..n).map(|_| rng.below(f.modulus())).collect();
    let linear = at(&zero)? == 0 && at(&probe)? == f.dot(0, row.iter().copied().zip(probe.iter().copied()));
    if !linear {
        return Err(ExpressionError::Syntax {
            expected: "a linear combination of unknowns such as D_IX - D_IY",
            found: "something that is not linear in them".into(),
            span: expression.span(),
        });
    }
    Ok(row)
}

/// Checks that a text is a linear combination of the unknowns of `platform`, with coefficients that are known.
pub(crate) fn check(text: &str, platform: &Platform) -> Result<(), ExpressionError> {
    let parsed = parse(text)?;
    let mut rng = SplitMix64::of(1, "combination", &[text]);
    // every validated scheme has a field
    let Ok(values) = RandomValues::draw(platform.scheme(), &mut rng) else { return Ok(()) };
    let sample = values.sample(platform.scheme(), 1);
    let rates = [0; 2].map(|_| 1 + rng.below(sample.roots.field.modulus() - 1));
    row_of(&parsed, &Names::of(platform), &At { values: &values, sample: &sample, rates }, &mut rng)
        .map(|_| ())
}

/// A combination that was asked for.
pub(crate) struct Requested {
    /// As written.
    pub(crate) text: String,
    /// Its coefficients in the first field of the verdicts.
    pub(crate) row: Vec<u64>,
    /// Its exact coefficients.
    pub(crate) terms: Sparse,
    /// What the staircase says.
    pub(crate) verdict: Verdict,
}

/// Reads and judges the combinations that a scheme asks for; the seed chooses the points at which they are looked at.
pub(crate) fn requested_combinations(
    platform: &Platform,
    verdicts: &Verdicts,
    seed: u64,
) -> Result<Vec<Requested>, AnalysisError> {
    let scheme = platform.scheme();
    let mut rng = scheme.random(seed, "combinations asked for");
    let names = Names::of(platform);
    scheme
        .combinations
        .iter()
        .map(|text| {
            let wrap = |e: ExpressionError| AnalysisError::Combination {
                text: text.clone(),
                reason: e.to_string(),
                span: e.span(),
            };
            let parsed = parse(text).map_err(wrap)?;
            let values = &verdicts.values[0];
            let sample = &values.sample(scheme, 1);
            let rates = [sample.point.w_n, sample.point.w_u];
            let row = row_of(&parsed, &names, &At { values, sample, rates }, &mut rng).map_err(wrap)?;
            let degree = verdicts.stairs.iter().position(|v| v.contains(&row));
            let moved = (0..row.len()).any(|c| row[c] != 0 && verdicts.degrees.excited[c]);
            let status = match degree {
                Some(_) => Status::Observable,
                None if moved => Status::Inseparable,
                None => Status::NotExcited,
            };
            let terms = terms_of(&parsed, platform, &names, verdicts, &mut rng).map_err(wrap)?;
            Ok(Requested { text: text.clone(), row, terms, verdict: Verdict { status, degree } })
        })
        .collect()
}

/// The exact coefficients of a linear expression: numbers times powers of the rates.
fn terms_of(
    parsed: &Expression,
    platform: &Platform,
    names: &Names<'_>,
    verdicts: &Verdicts,
    rng: &mut SplitMix64,
) -> Result<Sparse, ExpressionError> {
    let scheme = platform.scheme();
    let values = &verdicts.values[0];
    let sample = &values.sample(scheme, 1);
    let f = sample.roots.field;
    let mut rates = || [1 + rng.below(f.modulus() - 1), 1 + rng.below(f.modulus() - 1)];
    let [one, other] = [rates(), rates()];
    let first = row_of(parsed, names, &At { values, sample, rates: one }, rng)?;
    let second = row_of(parsed, names, &At { values, sample, rates: other }, rng)?;
    let unsupported = || ExpressionError::Syntax {
        expected: "coefficients that are numbers times powers of wN and wU, such as 2*wN, wU/wN or sqrt(2)/2",
        found: "a sum of such powers, or a power beyond 2".into(),
        span: parsed.span(),
    };
    (0..first.len())
        .filter(|&c| first[c] != 0)
        .map(|c| {
            let a = Image { value: first[c], rates: one };
            let b = Image { value: second[c], rates: other };
            let rates = rates_between(&f, a, b).ok_or_else(unsupported)?;
            let raw = text_of(parsed, names, &names.unknowns[c]);
            let images = [0, 1].map(|i| {
                let values = &verdicts.values[i];
                embeddings(values.roots().order)
                    .map(|a| names.symbols.value(&raw, values, &values.sample(scheme, a)).unwrap_or(0))
            });
            let fields = [*verdicts.values[0].roots(), *verdicts.values[1].roots()];
            let number = match recover_radical(&fields, &images) {
                Some(radical) => Number::Radical(radical),
                None => Number::Text { shown: names.symbols.display(&raw), raw },
            };
            Ok((c, Coefficient { number, rates }))
        })
        .collect()
}

/// The coefficient of an unknown as text in the symbols of the formulas, at rates one: the expression where this unknown is one and
/// the others are zero. It has been evaluated before, so nothing in it fails.
fn text_of(expression: &Expression, names: &Names<'_>, unknown: &str) -> String {
    let mut values: Vec<String> = Vec::with_capacity(expression.nodes.len());
    let integer = |i: usize| expression.integer_at(i);
    for node in &expression.nodes {
        let value = match node {
            Node::Number { mantissa, decimals } => match decimals {
                0.. => quotient(&mantissa.to_string(), &power("10", *decimals)),
                _ => Text.mul(&mantissa.to_string(), &power("10", -decimals)),
            },
            Node::Name(name) if name == "wN" || name == "wU" || name == unknown => Text.one(),
            Node::Name(_) => Text.zero(),
            Node::Call { function, argument } => {
                let angle = expression.angle_at(*argument).and_then(|(name, minus)| {
                    let (c, s) = names.cos_sin(name)?;
                    Some((c, if minus { Text.neg(&s) } else { s }))
                });
                match (function, angle, integer(*argument).and_then(square_root)) {
                    (Function::Cos, Some((c, _)), _) => c,
                    (Function::Sin, Some((_, s)), _) => s,
                    (Function::Sqrt, _, Some((s, place))) => {
                        Text.mul(&s.to_string(), &["1", "r_2", "r_3", "r_2*r_3"][place].to_string())
                    }
                    _ => Text.zero(),
                }
            }
            Node::Negate(a) => Text.neg(&values[*a]),
            Node::Add(a, b) => Text.add(&values[*a], &values[*b]),
            Node::Subtract(a, b) => Text.add(&values[*a], &Text.neg(&values[*b])),
            Node::Multiply(a, b) => Text.mul(&values[*a], &values[*b]),
            Node::Divide(a, b) => quotient(&values[*a], &values[*b]),
            Node::Power(a, k) => power(&values[*a], integer(*k).unwrap_or(0)),
        };
        values.push(value);
    }
    values.pop().unwrap_or_else(|| Text.zero())
}

fn quotient(a: &str, b: &str) -> String {
    match (a, b) {
        ("0", _) | (_, "1") => a.into(),
        // times one: sums stand in brackets
        _ => {
            let above = Text.mul(&a.to_string(), &Text.one());
            let plain = b.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
            if plain { format!("{above}/{b}") } else { format!("{above}/({b})") }
        }
    }
}

fn power(a: &str, k: i32) -> String {
    match (a, k) {
        (_, 0) => Text.one(),
        ("0" | "1", _) | (_, 1) => a.into(),
        _ => {
            let plain = a.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
            let base = if plain { a.to_string() } else { format!("({a})") };
            format!("{}{base}^{}", if k < 0 { "1/" } else { "" }, k.unsigned_abs())
        }
    }
}
