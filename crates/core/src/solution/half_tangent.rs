//! Zeros, in degrees, of polynomials in the tangent of half an angle.

use crate::language::{Expression, Node};

/// Largest degree that is solved.
const DEGREE: usize = 200;
/// Number of intervals examined before the rest counts as not resolved.
const INTERVALS: usize = 1_000;
/// Boundary in t between the two halves of a turn. It is the half tangent of no angle in use, so that no
/// root lies at an end.
const CUT: f64 = 1.037_128_492_311_7;
/// Accuracy of a root, in rad.
const WIDTH: f64 = 1e-8;

/// Number with a bound on its rounding error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RoundedNumber {
    value: f64,
    error: f64,
}

impl RoundedNumber {
    /// True for a positive number, false for a negative one; `None` if the sign is not certain.
    fn sign(self) -> Option<bool> {
        (self.value.abs() > self.error).then_some(self.value > 0.0)
    }

    fn mean(self, other: Self) -> Self {
        let value = (self.value + other.value) / 2.0;
        let error = (self.error + other.error) / 2.0 * (1.0 + 4.0 * f64::EPSILON);
        Self { value, error: error + f64::EPSILON * value.abs() }
    }
}

/// Angles at which a polynomial vanishes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Roots {
    /// Angles in degrees from 0 to 360, ascending.
    pub(super) deg: Vec<f64>,
    /// True if these are certainly all angles. Otherwise rounding, the degree, or roots very close together
    /// left some undecided.
    pub(super) all: bool,
}

/// Coefficients of a polynomial, lowest first, each with the sum of the magnitudes of its terms.
type Magnified = Vec<(f64, f64)>;

fn number(x: f64) -> Magnified {
    vec![(x, x.abs())]
}

fn times(a: &[(f64, f64)], b: &[(f64, f64)]) -> Magnified {
    let mut out = vec![(0.0, 0.0); a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j].0 += x.0 * y.0;
            out[i + j].1 += x.1 * y.1;
        }
    }
    out
}

/// Sum `a + sign b`.
fn plus(a: &[(f64, f64)], b: &[(f64, f64)], sign: f64) -> Magnified {
    let x = |v: &[(f64, f64)], i: usize| v.get(i).copied().unwrap_or_default();
    (0..a.len().max(b.len()))
        .map(|i| {
            let (a, b) = (x(a, i), x(b, i));
            (a.0 + sign * b.0, a.1 + b.1)
        })
        .collect()
}

/// Coefficients of a polynomial in one name, lowest first, with the values of the others from `at`; `None`
/// if the expression is no polynomial.
pub(super) fn coefficients(
    e: &Expression,
    name: &str,
    at: &dyn Fn(&str) -> f64,
) -> Option<Vec<RoundedNumber>> {
    let mut values: Vec<Magnified> = Vec::with_capacity(e.nodes.len());
    let mut whole = true;
    // bound on the number of nested multiplications of sums
    let mut depth = 0.0;
    for node in &e.nodes {
        let value = match node {
            Node::Number { mantissa, decimals } => {
                whole &= *decimals == 0;
                number(*mantissa as f64 / 10f64.powi(*decimals))
            }
            Node::Name(n) if n == name => vec![(0.0, 0.0), (1.0, 1.0)],
            Node::Name(n) => {
                whole = false;
                number(at(n))
            }
            Node::Call { .. } => return None,
            Node::Negate(a) => values[*a].iter().map(|x| (-x.0, x.1)).collect(),
            Node::Add(a, b) => plus(&values[*a], &values[*b], 1.0),
            Node::Subtract(a, b) => plus(&values[*a], &values[*b], -1.0),
            Node::Multiply(a, b) => times(&values[*a], &values[*b]),
            Node::Divide(a, b) => match values[*b][..] {
                [(x, _)] => {
                    whole = false;
                    values[*a].iter().map(|y| (y.0 / x, y.1 / x.abs())).collect()
                }
                _ => return None,
            },
            Node::Power(a, k) => {
                let k = e.integer_at(*k).filter(|k| (0..=DEGREE as i32).contains(k))?;
                depth += f64::from(k);
                (0..k).fold(number(1.0), |product, _| times(&product, &values[*a]))
            }
        };
        depth += 1.0;
        values.push(value);
        if values.last().is_some_and(|v| v.len() > DEGREE + 1) {
            return None;
        }
    }
    let last = values.pop()?;
    // sums of whole numbers below 2^53 are exact
    let exact = whole && last.iter().all(|x| x.1 < 9e15);
    let unit = if exact { 0.0 } else { f64::EPSILON * depth * last.len() as f64 };
    let rounded = last.iter().map(|x| RoundedNumber { value: x.0, error: unit * x.1 });
    last.iter().all(|x| x.1.is_finite()).then(|| rounded.collect())
}

/// Angles in 0..360 degrees at which `sum c_k tan(angle/2)^k` vanishes, except for 180, where the tangent is
/// infinite; `None` for the zero polynomial.
///
/// On `0..CUT` in t and in 1/t, both signs, the polynomial is written in Bernstein's basis. By Descartes'
/// rule it has no root if all coefficients have the same sign, and one if they change it once. Other
/// intervals are halved by de Casteljau's construction. A coefficient below its rounding error has no sign.
pub(super) fn roots_deg(coefficients: &[RoundedNumber]) -> Option<Roots> {
    let zero = |c: &RoundedNumber| c.value == 0.0 && c.error == 0.0;
    let used = coefficients.iter().rposition(|c| !zero(c))?;
    let lowest = coefficients.iter().position(|c| !zero(c))?;
    let mut out = Roots { deg: Vec::new(), all: used <= DEGREE };
    if lowest > 0 {
        out.deg.push(0.0);
    }
    let c = &coefficients[lowest..=used];
    let signed = |c: &[RoundedNumber], sign: f64| -> Vec<RoundedNumber> {
        let of = |(i, c): (usize, &RoundedNumber)| RoundedNumber {
            value: if i % 2 == 1 { sign * c.value } else { c.value },
            ..*c
        };
        c.iter().enumerate().map(of).collect()
    };
    let reversed: Vec<RoundedNumber> = c.iter().rev().copied().collect();
    if out.all {
        // angles of roots in t and in 1/t
        for (polynomial, sign, end, from_half_turn) in [
            (c, 1.0, CUT, false),
            (&reversed, 1.0, 1.0 / CUT, true),
            (&reversed, -1.0, 1.0 / CUT, true),
            (c, -1.0, CUT, false),
        ] {
            let (roots, all) = positive_roots(&signed(polynomial, sign), end);
            out.all &= all;
            let in_turn = |t: f64| {
                let angle = 2.0 * t.atan().to_degrees();
                let angle = if from_half_turn { 180.0 - angle } else { angle };
                let angle = if sign < 0.0 { 360.0 - angle } else { angle };
                // a whole number up to rounding is taken as whole
                if (angle - angle.round()).abs() < 1e-10 { angle.round() } else { angle }
            };
            out.deg.extend(roots.into_iter().map(in_turn));
        }
    }
    out.deg.sort_by(f64::total_cmp);
    Some(out)
}

/// Roots between 0 and `end`, and true if these are certainly all.
fn positive_roots(c: &[RoundedNumber], end: f64) -> (Vec<f64>, bool) {
    let (mut roots, mut all) = (Vec::new(), true);
    let mut intervals = vec![(0.0, end, bernstein(c, end))];
    let mut looked_at = 0;
    while let Some((low, high, b)) = intervals.pop() {
        match changes(&b) {
            Some(0) => continue,
            Some(1) => match refine(low, high, b) {
                Some(root) => roots.push(root),
                None => all = false,
            },
            _ => {
                looked_at += 1;
                if looked_at > INTERVALS || high - low < WIDTH {
                    all = false;
                    continue;
                }
                let middle = (low + high) / 2.0;
                let (left, right) = halves(b);
                intervals.extend([(middle, high, right), (low, middle, left)]);
            }
        }
    }
    (roots, all)
}

/// Coefficients of `sum c_k t^k` on `0..end` in Bernstein's basis:
/// `b_j = sum_i C(j, i) / C(d, i) c_i end^i`.
fn bernstein(c: &[RoundedNumber], end: f64) -> Vec<RoundedNumber> {
    let d = c.len() - 1;
    let unit = f64::EPSILON * (4 * d + 8) as f64;
    (0..=d)
        .map(|j| {
            let (mut sum, mut error, mut weight) = (0.0, 0.0, 1.0);
            for (i, c) in c.iter().enumerate().take(j + 1) {
                sum += weight * c.value;
                error += weight * (c.error + unit * c.value.abs());
                weight *= end * (j - i) as f64 / (d - i).max(1) as f64;
            }
            RoundedNumber { value: sum, error }
        })
        .collect()
}

/// Number of changes of sign; `None` if it is not certain.
fn changes(b: &[RoundedNumber]) -> Option<usize> {
    let signs: Vec<Option<bool>> = b.iter().map(|x| x.sign()).collect();
    // an unknown sign between two different signs does not count
    let idle = |j: usize| {
        j > 0
            && j + 1 < b.len()
            && signs[j - 1].zip(signs[j + 1]).is_some_and(|(before, after)| before != after)
    };
    if (0..b.len()).any(|j| signs[j].is_none() && !idle(j)) {
        return None;
    }
    let known: Vec<bool> = signs.into_iter().flatten().collect();
    Some(known.windows(2).filter(|w| w[0] != w[1]).count())
}

/// The polynomial on each half of an interval.
fn halves(mut b: Vec<RoundedNumber>) -> (Vec<RoundedNumber>, Vec<RoundedNumber>) {
    let mut left = Vec::with_capacity(b.len());
    for n in (0..b.len()).rev() {
        left.push(b[0]);
        for j in 0..n {
            b[j] = b[j].mean(b[j + 1]);
        }
    }
    (left, b)
}

/// The only root in an interval; `None` if rounding hides its place.
fn refine(mut low: f64, mut high: f64, mut b: Vec<RoundedNumber>) -> Option<f64> {
    loop {
        let middle = (low + high) / 2.0;
        let before = b[0].sign()?;
        let (left, right) = halves(b);
        match right[0].sign() {
            Some(sign) if middle > low && middle < high => {
                if sign == before {
                    (low, b) = (middle, right);
                } else {
                    (high, b) = (middle, left);
                }
            }
            _ => return (high - low < WIDTH).then_some(middle),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::parse;

    fn roots(text: &str) -> Roots {
        let c = coefficients(&parse(text).expect("parses"), "t_a", &|_| 3f64.sqrt()).expect("a polynomial");
        roots_deg(&c).expect("not zero")
    }

    /// Asserts that the roots are those in `expected`.
    fn are(text: &str, expected: &[f64]) {
        let found = roots(text);
        assert!(found.all && found.deg.len() == expected.len(), "{text}: {found:?}");
        for (found, expected) in found.deg.iter().zip(expected) {
            assert!((found - expected).abs() < WIDTH.to_degrees(), "{text}: {found} {expected}");
        }
    }

    fn deg(t: f64) -> f64 {
        (2.0 * t.atan()).to_degrees().rem_euclid(360.0)
    }

    #[test]
    fn roots_in_degrees() {
        are("t_a", &[0.0]);
        assert_eq!(roots("-1+t_a^2").deg, [90.0, 270.0]);
        are("t_a-t_b", &[120.0]);
        are("1+t_a^2", &[]);
        are("5", &[]);
        // tan(a/2)^2 = 1/2: cos a = 1/3
        let third = (1.0f64 / 3.0).acos().to_degrees();
        are("-1+2*t_a^2", &[third, 360.0 - third]);
        are("t_a^3*(-1+2*t_a^2)*(1+t_a^2)^2", &[0.0, third, 360.0 - third]);
        // near 180 degrees, and close together
        are("(t_a-1000000)*(t_a+1000000)", &[deg(1e6), deg(-1e6)]);
        are("(t_a-1)*(1000*t_a-1001)*(t_a+2)", &[90.0, deg(1.001), deg(-2.0)]);
        // a near-zero minimum is no root
        are("(1000*t_a-1001)^2+1", &[]);
        let many: String = (0..8).map(|k| format!("*({k}-5*t_a)")).collect();
        are(&many[1..], &(0..8).map(|k| deg(f64::from(k) / 5.0)).collect::<Vec<_>>());
        assert_eq!(roots_deg(&[RoundedNumber { value: 0.0, error: 0.0 }; 2]), None);
    }

    #[test]
    fn what_rounding_hides_is_not_said_to_be_all() {
        // a double root, thirty roots whose coefficients no double holds, and a degree beyond the limit
        let many: String = (0..30).map(|k| format!("*({k}-7*t_a)")).collect();
        for text in ["(3*t_a-1)^2", &many[1..]] {
            assert!(!roots(text).all, "{text}");
        }
        assert_eq!(coefficients(&parse("t_a^200*t_a-1").expect("parses"), "t_a", &|_| 0.0), None);
    }

    /// Finds as many roots as signs change on a fine grid, for polynomials with well-separated roots.
    #[test]
    fn as_many_as_signs_change() {
        let mut seed = 7u64;
        for degree in 1..12 {
            let mut next = || {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                f64::from((seed >> 33) as u32 % 2001) - 1000.0
            };
            let c: Vec<f64> = (0..=degree).map(|_| next() + 0.5).collect();
            let f = |x: f64| -> f64 {
                let (s, k) = (x / 2.0).sin_cos();
                c.iter().enumerate().map(|(i, c)| c * s.powi(i as i32) * k.powi((degree - i) as i32)).sum()
            };
            let steps = 20_000;
            let at = |i: usize| std::f64::consts::PI * (2.0 * i as f64 / steps as f64 - 1.0);
            let crossed = (0..steps).filter(|&i| (f(at(i)) > 0.0) != (f(at(i + 1)) > 0.0)).count();
            let c: Vec<RoundedNumber> = c.iter().map(|x| RoundedNumber { value: *x, error: 0.0 }).collect();
            let found = roots_deg(&c).expect("not zero");
            assert!(found.all && found.deg.len() == crossed, "{degree}: {found:?} {crossed}");
            assert!(found.deg.iter().all(|x| f(x.to_radians()).abs() < 1e-9));
        }
    }
}
