//! Linear combinations of unknowns as text: read, and checked to be linear.

use obsdeg_exact::radical::Ratio;
use obsdeg_exact::{Field, Radical, SplitMix64};

use super::platform::{FieldSample, RandomValues};
use super::symbols::Symbols;
use super::{Angle, Platform};
use crate::language::{Environment, Expression, ExpressionError, Node, evaluate, parse};

/// Names in a combination and their meanings.
pub(crate) struct CombinationNames<'a> {
    pub(crate) unknowns: &'a [String],
    generic: Vec<String>,
    pub(crate) symbols: Symbols,
}

impl<'a> CombinationNames<'a> {
    pub(crate) fn of(platform: &'a Platform) -> Self {
        let generic = platform.scheme().generic_names();
        Self { unknowns: platform.names(), generic, symbols: Symbols::of(platform) }
    }

    /// The cosine and sine of an angle of the scheme as text.
    pub(crate) fn cos_sin(&self, angle: &str) -> Option<(String, String)> {
        let angle: Angle = angle.strip_suffix(" deg").unwrap_or(angle).parse().ok()?;
        self.symbols.has(&angle).then(|| self.symbols.cos_sin(&angle))
    }
}

/// Square root of `n = s^2 m` with m one of 1, 2, 3, 6: s and the index of `sqrt m` in a radical.
pub(crate) fn square_root(n: i32) -> Option<(i64, usize)> {
    let n = i64::from(n);
    [1, 2, 3, 6].into_iter().enumerate().find_map(|(i, m)| {
        let square = (n > 0 && n % m == 0).then_some(n / m)?;
        let s = square.isqrt();
        (s * s == square).then_some((s, i))
    })
}

struct UnknownValues<'a> {
    names: &'a CombinationNames<'a>,
    values: &'a RandomValues,
    sample: &'a FieldSample,
    /// Value of each unknown.
    unknowns: &'a [u64],
    rates: [u64; 2],
}

impl Environment for UnknownValues<'_> {
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

/// Point at which a combination is evaluated.
pub(crate) struct EvaluationPoint<'a> {
    pub(crate) values: &'a RandomValues,
    pub(crate) sample: &'a FieldSample,
    pub(crate) rates: [u64; 2],
}

impl EvaluationPoint<'_> {
    fn field(&self) -> &Field {
        &self.sample.roots.field
    }
}

/// The coefficients of a linear expression at one point, or the reason why it is not linear. It is linear if
/// it equals the sum of its parts at random values.
pub(crate) fn row_of(
    expression: &Expression,
    names: &CombinationNames<'_>,
    point: &EvaluationPoint<'_>,
    rng: &mut SplitMix64,
) -> Result<Vec<u64>, ExpressionError> {
    let (f, n) = (point.field(), names.unknowns.len());
    let at = |unknowns: &[u64]| {
        let EvaluationPoint { values, sample, rates } = *point;
        evaluate(expression, f, &UnknownValues { names, values, sample, unknowns, rates })
    };
    let zero = vec![0; n];
    let unit = |c: usize| -> Vec<u64> { (0..n).map(|j| if j == c { f.one() } else { 0 }).collect() };
    // unknowns that it does not name have coefficient zero
    let named = |c: usize| {
        expression.nodes.iter().any(|n| matches!(n, Node::Name(name) if *name == names.unknowns[c]))
    };
    let not_linear = || ExpressionError::Syntax {
        expected: "a linear combination of unknowns such as D_IX - D_IY",
        found: "something that is not linear in them".into(),
        span: expression.span(),
    };
    let probe: Vec<u64> = (0..n).map(|_| rng.below(f.modulus())).collect();
    let there = at(&probe)?;
    // an expression that can be divided by there, but not where the unknowns are zero, contains unknowns
    let divided = |e: ExpressionError| match e {
        ExpressionError::DivisionByZero { .. } => not_linear(),
        other => other,
    };
    let row: Vec<u64> = (0..n)
        .map(|c| if named(c) { at(&unit(c)) } else { Ok(0) })
        .collect::<Result<_, _>>()
        .map_err(divided)?;
    let linear =
        at(&zero).map_err(divided)? == 0 && there == f.dot(0, row.iter().copied().zip(probe.iter().copied()));
    if linear { Ok(row) } else { Err(not_linear()) }
}

/// Refuses a combination that is zero for all values of the unknowns and rates; `row` is its row at random
/// rates.
pub(crate) fn not_zero(expression: &Expression, row: &[u64]) -> Result<(), ExpressionError> {
    if row.iter().any(|x| *x != 0) {
        return Ok(());
    }
    Err(ExpressionError::Syntax {
        expected: "a combination in which some unknown counts",
        found: "one that is always zero".into(),
        span: expression.span(),
    })
}

/// Checks that a text is a linear combination of the unknowns of `platform`, with known coefficients.
pub(crate) fn check(text: &str, platform: &Platform) -> Result<(), ExpressionError> {
    let parsed = parse(text)?;
    let mut rng = SplitMix64::of(1, "combination", &[text]);
    // every validated scheme has a field
    let Ok(values) = RandomValues::draw(platform.scheme(), &mut rng) else { return Ok(()) };
    let sample = values.sample(platform.scheme(), 1);
    let rates = [0; 2].map(|_| 1 + rng.below(sample.roots.field.modulus() - 1));
    let row = row_of(
        &parsed,
        &CombinationNames::of(platform),
        &EvaluationPoint { values: &values, sample: &sample, rates },
        &mut rng,
    )?;
    not_zero(&parsed, &row)
}
