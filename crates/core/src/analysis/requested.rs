//! Combinations that a scheme asks for: read, checked to be linear, judged.

use super::{AnalysisError, Status, Verdict};
use crate::degree::coefficient::{Coefficient, Image, Number, rates_between, recover_radical};
use crate::degree::ensemble::Verdicts;
use crate::model::Platform;
use crate::model::expression::{Environment, Expression, ExpressionError, evaluate, parse};
use crate::model::platform::Sample;
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

/// The coefficients of a linear expression at one sample, or why it is not linear.
fn row_of(expression: &Expression, names: &[String], sample: &Sample) -> Result<Vec<u64>, ExpressionError> {
    let f = sample.roots.field;
    let rates = [sample.point.w_n, sample.point.w_u];
    let at = |values: &[u64]| evaluate(expression, &f, &Unit { names, values, rates });
    let zero = vec![0; names.len()];
    let unit =
        |c: usize| -> Vec<u64> { (0..names.len()).map(|j| if j == c { f.one() } else { 0 }).collect() };
    let row: Vec<u64> = (0..names.len()).map(|c| at(&unit(c))).collect::<Result<_, _>>()?;
    let probe: Vec<u64> = (0..names.len() as u64).map(|c| f.from_u64(1_000_003 + 7919 * c * c)).collect();
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

/// Reads and judges the combinations that a scheme asks for.
pub(crate) fn requested_combinations(
    platform: &Platform,
    verdicts: &Verdicts,
) -> Result<Vec<Requested>, AnalysisError> {
    let scheme = platform.scheme();
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
            let row = row_of(&parsed, names, &sample).map_err(wrap)?;
            let degree = verdicts.stairs.iter().position(|v| v.contains(&row));
            let moved = (0..names.len()).any(|c| row[c] != 0 && verdicts.degrees.excited[c]);
            let status = match degree {
                Some(_) => Status::Observable,
                None if moved => Status::Inseparable,
                None => Status::NotExcited,
            };
            let terms = terms_of(&parsed, platform, verdicts).map_err(wrap)?;
            Ok(Requested { text: text.clone(), row, terms, verdict: Verdict { status, degree } })
        })
        .collect()
}

/// The exact coefficients of a linear expression with rational coefficients and rates.
fn terms_of(
    parsed: &Expression,
    platform: &Platform,
    verdicts: &Verdicts,
) -> Result<Sparse, ExpressionError> {
    let scheme = platform.scheme();
    let names = platform.names();
    let at = |field: usize, a: u64, rates: Option<[u64; 2]>| {
        let mut sample = verdicts.values[field].sample(scheme, a);
        if let Some([w_n, w_u]) = rates {
            (sample.point.w_n, sample.point.w_u) = (w_n, w_u);
        }
        let rates = [sample.point.w_n, sample.point.w_u];
        row_of(parsed, names, &sample).map(|row| (row, rates, sample.roots.field))
    };
    let fields = [*verdicts.values[0].roots(), *verdicts.values[1].roots()];
    let f = fields[0].field;
    let pairs = [[f.from_u64(1009), f.from_u64(2003)], [f.from_u64(3001), f.from_u64(4001)]];
    let first = at(0, 1, Some(pairs[0]))?;
    let second = at(0, 1, Some(pairs[1]))?;
    let ones = [0, 1].map(|i| at(i, 1, Some([fields[i].field.one(); 2])));
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
