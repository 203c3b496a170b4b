//! Rational functions of a prime field as text over the rational numbers.

use obsdeg_exact::divisor::{Algebra, lexicographic};
use obsdeg_exact::fraction::Fraction;
use obsdeg_exact::groebner::OverLimit;
use obsdeg_exact::multivariate::{Monomial, Polynomial};
use obsdeg_exact::{Ratio, gcd};

/// Largest numerator and denominator of a coefficient. There are fewer such fractions than elements of the
/// field, but not many fewer: every recovered number is checked in a second field.
const BOUND: u64 = 1 << 29;

/// Terms with integer coefficients that share no divisor, the leading one positive and first.
type IntegerTerms = Vec<(Monomial, i64)>;

/// Text of an expression in the names of its variables; `None` if a denominator is zero, or a coefficient is
/// too large.
///
/// # Errors
/// [`OverLimit`].
pub(super) fn text(s: &mut Algebra, e: &Fraction, names: &[String]) -> Result<Option<String>, OverLimit> {
    if e.is_zero() {
        return Ok(Some("0".into()));
    }
    let f = s.f;
    let mut constant = f.mul(s.leading(&e.numerator), f.inv(s.leading(&e.denominator)));
    let mut sides: [Vec<String>; 2] = Default::default();
    for (side, p) in [&e.numerator, &e.denominator].into_iter().enumerate() {
        let mut factors = Vec::new();
        for (factor, power) in s.factors(p)? {
            let Some(terms) = integers(s, &factor) else { return Ok(None) };
            // the leading coefficient of the factor that is used is one
            let lead = f.from_i64(terms.first().map_or(1, |t| t.1));
            let lead = f.pow(lead, power.into());
            constant = f.mul(constant, if side == 0 { f.inv(lead) } else { lead });
            factors.push((terms, power));
        }
        // simplest factors first
        factors.sort_by(|a, b| a.0.len().cmp(&b.0.len()).then_with(|| lexicographic(&b.0[0].0, &a.0[0].0)));
        sides[side] = factors.iter().map(|(terms, power)| factor(terms, *power, names)).collect();
    }
    let Some(constant) = Ratio::within(&f, constant, BOUND) else { return Ok(None) };
    for (side, size) in sides.iter_mut().zip([constant.num.abs(), constant.den]) {
        if size != 1 || side.is_empty() {
            side.insert(0, size.to_string());
        }
    }
    let [above, below] = sides;
    let sign = if constant.num < 0 { "-" } else { "" };
    // a sum alone needs no brackets
    let bare = |p: &str| p.strip_prefix('(').and_then(|p| p.strip_suffix(')')).map(str::to_string);
    let whole = below == ["1"];
    let above = match above.as_slice() {
        [one] if whole && sign.is_empty() => bare(one).unwrap_or_else(|| one.clone()),
        several => several.join("*"),
    };
    Ok(Some(match below.as_slice() {
        _ if whole => format!("{sign}{above}"),
        [one] => format!("{sign}{above}/{one}"),
        several => format!("{sign}{above}/({})", several.join("*")),
    }))
}

/// A polynomial with rational coefficients, multiplied to integers without a common divisor.
fn integers(s: &Algebra, p: &Polynomial) -> Option<IntegerTerms> {
    let mut ratios: Vec<(Monomial, Ratio)> = Vec::new();
    for (m, c) in p.terms() {
        ratios.push((m.clone(), Ratio::within(&s.f, c, BOUND)?));
    }
    ratios.sort_by(|a, b| lexicographic(&b.0, &a.0));
    let mut common: i64 = 1;
    for (_, r) in &ratios {
        let step = r.den / gcd(common as u64, r.den as u64) as i64;
        common = common.checked_mul(step)?;
    }
    let whole = |r: &Ratio| r.num.checked_mul(common / r.den);
    let sizes: Vec<i64> = ratios.iter().map(|(_, r)| whole(r)).collect::<Option<_>>()?;
    let divisor = sizes.iter().fold(0, |d, x| gcd(d, x.unsigned_abs())) as i64;
    let sign = sizes.first()?.signum();
    Some(ratios.into_iter().zip(sizes).map(|((m, _), x)| (m, sign * (x / divisor))).collect())
}

/// Text of a factor: `x^2`, `(x-2*y)`, `(x+1)^3`.
fn factor(terms: &IntegerTerms, power: u32, names: &[String]) -> String {
    let mut sum = String::new();
    for (m, c) in terms {
        let sign = match (*c < 0, sum.is_empty()) {
            (true, _) => "-",
            (false, true) => "",
            (false, false) => "+",
        };
        let size = (c.abs() != 1 || m.is_empty()).then(|| c.abs().to_string());
        let name = |&(v, e): &(u32, u32)| match e {
            1 => names[v as usize].clone(),
            e => format!("{}^{e}", names[v as usize]),
        };
        let product: Vec<String> = size.into_iter().chain(m.iter().map(name)).collect();
        sum.push_str(&format!("{sign}{}", product.join("*")));
    }
    match (terms.len(), power) {
        (1, 1) => sum,
        (1, e) => format!("{sum}^{e}"),
        (_, 1) => format!("({sum})"),
        (_, e) => format!("({sum})^{e}"),
    }
}
