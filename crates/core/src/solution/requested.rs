//! Requested combinations of a scheme, judged, with their exact coefficients.

use std::ops::Range;

use obsdeg_exact::SplitMix64;
use obsdeg_exact::radical::embeddings;

use super::solver::Sparse;
use crate::degree::coefficient::{Coefficient, Image, Number, rates_between, recover_radical};
use crate::degree::ensemble::Verdicts;
use crate::degree::status::{Status, Verdict};
use crate::language::{Expression, ExpressionError, Function, Node, parse};
use crate::model::Platform;
use crate::model::combination::{CombinationNames, EvaluationPoint, not_zero, row_of, square_root};
use crate::model::ring::{Ring, Text};

/// Error for a requested combination that is no linear combination of the unknowns.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("combination `{text}`: {reason}")]
pub struct CombinationError {
    /// Combination as written.
    pub text: String,
    /// Reason for the error.
    pub reason: String,
    /// Byte range of the error in the text.
    pub span: Range<usize>,
}

/// Requested combination.
pub(crate) struct Requested {
    /// Combination as written.
    pub text: String,
    /// Coefficients in the first field of the verdicts.
    pub row: Vec<u64>,
    /// Exact coefficients.
    pub terms: Sparse,
    /// Verdict by the filtration.
    pub verdict: Verdict,
}

/// Reads and judges the requested combinations of a scheme; the seed chooses the points at which they are
/// evaluated.
pub(crate) fn requested_combinations(
    platform: &Platform,
    verdicts: &Verdicts,
    seed: u64,
) -> Result<Vec<Requested>, CombinationError> {
    let scheme = platform.scheme();
    let mut rng = scheme.random(seed, "combinations asked for");
    let names = CombinationNames::of(platform);
    scheme
        .combinations
        .iter()
        .map(|text| {
            let wrap = |e: ExpressionError| CombinationError {
                text: text.clone(),
                reason: e.to_string(),
                span: e.span(),
            };
            let parsed = parse(text).map_err(wrap)?;
            let values = &verdicts.values[0];
            let sample = &values.sample(scheme, 1);
            let rates = [sample.point.w_n, sample.point.w_u];
            let row = row_of(&parsed, &names, &EvaluationPoint { values, sample, rates }, &mut rng)
                .map_err(wrap)?;
            let degree = verdicts.spans.iter().position(|v| v.contains(&row));
            let moved = (0..row.len()).any(|c| row[c] != 0 && verdicts.degrees.excited[c]);
            let status = Status::of(degree, moved);
            let terms = terms_of(&parsed, platform, &names, verdicts, &mut rng).map_err(wrap)?;
            Ok(Requested { text: text.clone(), row, terms, verdict: Verdict { status, degree } })
        })
        .collect()
}

/// Exact coefficients of a linear expression: numbers times powers of the rates.
fn terms_of(
    parsed: &Expression,
    platform: &Platform,
    names: &CombinationNames<'_>,
    verdicts: &Verdicts,
    rng: &mut SplitMix64,
) -> Result<Sparse, ExpressionError> {
    let scheme = platform.scheme();
    let values = &verdicts.values[0];
    let sample = &values.sample(scheme, 1);
    let f = sample.roots.field;
    let mut rates = || [1 + rng.below(f.modulus() - 1), 1 + rng.below(f.modulus() - 1)];
    let [one, other] = [rates(), rates()];
    let first = row_of(parsed, names, &EvaluationPoint { values, sample, rates: one }, rng)?;
    not_zero(parsed, &first)?;
    let second = row_of(parsed, names, &EvaluationPoint { values, sample, rates: other }, rng)?;
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

/// Coefficient of an unknown as text in the symbols of the formulas, at rates one: the expression where this
/// unknown is one and the others are zero. It has been evaluated before, so nothing in it fails.
fn text_of(expression: &Expression, names: &CombinationNames<'_>, unknown: &str) -> String {
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
        // one as a factor is omitted; sums stand in brackets
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
