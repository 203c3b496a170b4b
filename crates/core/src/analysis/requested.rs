//! Combinations that a scheme asks for: read, checked to be linear, judged.

use obsdeg_exact::{Field, RootField, SplitMix64};

use super::{AnalysisError, Status, Verdict};
use crate::degree::coefficient::{Coefficient, Image, Number, rates_between, recover_radical};
use crate::degree::ensemble::Verdicts;
use crate::model::Platform;
use crate::model::expression::{Environment, Expression, ExpressionError, Node, evaluate, parse};
use crate::solution::solver::Sparse;

struct Unit<'a> {
    names: &'a [String],
    /// The value of each unknown.
    values: &'a [u64],
    rates: [u64; 2],
}

impl Environment for Unit<'_> {
    fn name(&self, name: &str) -> Option<u64> {
        match name {
            "wN" => Some(self.rates[0]),
            "wU" => Some(self.rates[1]),
            _ => self.names.iter().position(|n| n == name).map(|c| self.values[c]),
        }
    }
    fn cos_sin(&self, _: &str) -> Option<(u64, u64)> {
        None
    }
    fn known(&self) -> Vec<String> {
        self.names.iter().cloned().chain(["wN".into(), "wU".into()]).collect()
    }
}

/// The coefficients of a linear expression at one sample, or why it is not linear: then it is not the sum of its parts at a random point.
fn row_of(
    expression: &Expression,
    names: &[String],
    f: &Field,
    rates: [u64; 2],
    rng: &mut SplitMix64,
) -> Result<Vec<u64>, ExpressionError> {
    let at = |values: &[u64]| evaluate(expression, f, &Unit { names, values, rates });
    let zero = vec![0; names.len()];
    let unit =
        |c: usize| -> Vec<u64> { (0..names.len()).map(|j| if j == c { f.one() } else { 0 }).collect() };
    // what it does not name has no part in it
    let named =
        |c: usize| expression.nodes.iter().any(|n| matches!(n, Node::Name(name) if *name == names[c]));
    let row: Vec<u64> =
        (0..names.len()).map(|c| if named(c) { at(&unit(c)) } else { Ok(0) }).collect::<Result<_, _>>()?;
    let probe: Vec<u64> = names.iter().map(|_| rng.below(f.modulus())).collect();
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

/// Checks that a text is a linear combination of unknowns of these names.
pub(crate) fn check(text: &str, names: &[String]) -> Result<(), ExpressionError> {
    let parsed = parse(text)?;
    let mut rng = SplitMix64::of(1, "combination", &[text]);
    // there are enough primes of order 4
    let Ok(roots) = RootField::random(4, &mut rng) else { return Ok(()) };
    let rates = [0; 2].map(|_| 1 + rng.below(roots.field.modulus() - 1));
    row_of(&parsed, names, &roots.field, rates, &mut rng).map(|_| ())
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
    let names = platform.names();
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
            let sample = verdicts.values[0].sample(scheme, 1);
            let rates = [sample.point.w_n, sample.point.w_u];
            let row = row_of(&parsed, names, &sample.roots.field, rates, &mut rng).map_err(wrap)?;
            let degree = verdicts.stairs.iter().position(|v| v.contains(&row));
            let moved = (0..names.len()).any(|c| row[c] != 0 && verdicts.degrees.excited[c]);
            let status = match degree {
                Some(_) => Status::Observable,
                None if moved => Status::Inseparable,
                None => Status::NotExcited,
            };
            let terms = terms_of(&parsed, platform, verdicts, &mut rng).map_err(wrap)?;
            Ok(Requested { text: text.clone(), row, terms, verdict: Verdict { status, degree } })
        })
        .collect()
}

/// The exact coefficients of a linear expression with rational coefficients and rates.
fn terms_of(
    parsed: &Expression,
    platform: &Platform,
    verdicts: &Verdicts,
    rng: &mut SplitMix64,
) -> Result<Sparse, ExpressionError> {
    let names = platform.names();
    let fields = [*verdicts.values[0].roots(), *verdicts.values[1].roots()];
    let f = fields[0].field;
    let mut nonzero = || 1 + rng.below(f.modulus() - 1);
    let [one, other] = [[nonzero(), nonzero()], [nonzero(), nonzero()]];
    let mut at = |field: usize, rates: [u64; 2]| {
        row_of(parsed, names, &fields[field].field, rates, rng).map(|row| (row, rates))
    };
    let first = at(0, one)?;
    let second = at(0, other)?;
    let ones = [0, 1].map(|i| at(i, [fields[i].field.one(); 2]));
    let [one_a, one_b] = ones;
    let (one_a, one_b) = (one_a?, one_b?);
    let unsupported = || ExpressionError::Syntax {
        expected: "rational coefficients times powers of wN and wU",
        found: "another coefficient".into(),
        span: parsed.span(),
    };
    (0..names.len())
        .filter(|&c| first.0[c] != 0)
        .map(|c| {
            let a = Image { value: first.0[c], rates: first.1 };
            let b = Image { value: second.0[c], rates: second.1 };
            let rates = rates_between(&f, a, b).ok_or_else(unsupported)?;
            let images = [[one_a.0[c]; 4], [one_b.0[c]; 4]];
            let number = recover_radical(&fields, &images).ok_or_else(unsupported)?;
            Ok((c, Coefficient { number: Number::Radical(number), rates }))
        })
        .collect()
}
