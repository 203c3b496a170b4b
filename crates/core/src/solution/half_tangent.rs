//! Where a polynomial in the tangent of half an angle vanishes, in degrees.

use crate::model::expression::{Expression, Node};

/// Roots closer than this are not told apart, in rad.
const APART: f64 = 1e-9;

/// The coefficients of a polynomial in one name, lowest first, with the values of the others from `at`; `None` for what is no
/// polynomial.
pub(super) fn coefficients(e: &Expression, name: &str, at: &dyn Fn(&str) -> f64) -> Option<Vec<f64>> {
    let mut values: Vec<Vec<f64>> = Vec::with_capacity(e.nodes.len());
    let times = |a: &[f64], b: &[f64]| {
        let mut out = vec![0.0; a.len() + b.len() - 1];
        for (i, x) in a.iter().enumerate() {
            for (j, y) in b.iter().enumerate() {
                out[i + j] += x * y;
            }
        }
        out
    };
    let plus = |a: &[f64], b: &[f64], sign: f64| -> Vec<f64> {
        let x = |v: &[f64], i: usize| v.get(i).copied().unwrap_or(0.0);
        (0..a.len().max(b.len())).map(|i| x(a, i) + sign * x(b, i)).collect()
    };
    for node in &e.nodes {
        let value = match node {
            Node::Number { mantissa, decimals } => vec![*mantissa as f64 / 10f64.powi(*decimals)],
            Node::Name(n) if n == name => vec![0.0, 1.0],
            Node::Name(n) => vec![at(n)],
            Node::Call { .. } => return None,
            Node::Negate(a) => values[*a].iter().map(|x| -x).collect(),
            Node::Add(a, b) => plus(&values[*a], &values[*b], 1.0),
            Node::Subtract(a, b) => plus(&values[*a], &values[*b], -1.0),
            Node::Multiply(a, b) => times(&values[*a], &values[*b]),
            Node::Divide(a, b) => match values[*b][..] {
                [x] => values[*a].iter().map(|y| y / x).collect(),
                _ => return None,
            },
            Node::Power(a, k) => {
                let k = e.integer_at(*k).filter(|k| (0..=400).contains(k))?;
                (0..k).fold(vec![1.0], |product, _| times(&product, &values[*a]))
            }
        };
        values.push(value);
    }
    values.pop().filter(|c| c.iter().all(|x| x.is_finite()))
}

/// All angles in 0..360 degrees at which `sum c_k tan(angle/2)^k` vanishes, but for 180, where it is infinite; `None` for the zero
/// polynomial.
///
/// Times `cos(angle/2)^d` it is a trigonometric polynomial f with `|f'| <= d/2 S` and `|f''| <= d^2/4 S`, S the sum of magnitudes of
/// its coefficients. An interval in which f is too far from zero to vanish has no root; one in which f' is too far from zero
/// to change sign has one exactly if f changes sign; others are halved.
pub(super) fn roots_deg(coefficients: &[f64]) -> Option<Vec<f64>> {
    let used = coefficients.iter().rposition(|c| *c != 0.0)?;
    let (c, d) = (&coefficients[..=used], used as i32);
    let size: f64 = c.iter().map(|x| x.abs()).sum();
    let f = |x: f64| -> f64 {
        let (s, k) = (x / 2.0).sin_cos();
        c.iter().enumerate().map(|(i, c)| c * s.powi(i as i32) * k.powi(d - i as i32)).sum()
    };
    let slope = |x: f64| -> f64 {
        let (s, k) = (x / 2.0).sin_cos();
        let term = |i: i32| -> f64 {
            let up = if i > 0 { f64::from(i) * s.powi(i - 1) * k.powi(d - i + 1) } else { 0.0 };
            let down = if i < d { f64::from(d - i) * s.powi(i + 1) * k.powi(d - i - 1) } else { 0.0 };
            (up - down) / 2.0
        };
        c.iter().enumerate().map(|(i, c)| c * term(i as i32)).sum()
    };
    let (first, second) = (size * f64::from(d) / 2.0, size * f64::from(d * d) / 4.0);
    let mut found: Vec<f64> = Vec::new();
    // 180 degrees lies at the ends
    let pi = std::f64::consts::PI;
    let mut intervals = vec![(-pi, pi)];
    while let Some((low, high)) = intervals.pop() {
        let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
        if f(middle).abs() > first * half {
            continue;
        }
        let steady = slope(middle).abs() > second * half;
        if !steady && half > APART {
            // the upper half is looked at last, so that roots come in order
            intervals.extend([(middle, high), (low, middle)]);
            continue;
        }
        let (mut low, mut high) = (low, high);
        if steady && (f(low) > 0.0) == (f(high) > 0.0) {
            continue;
        }
        while steady && high - low > 1e-15 * pi {
            let middle = (low + high) / 2.0;
            if middle <= low || middle >= high {
                break;
            }
            if (f(middle) > 0.0) == (f(low) > 0.0) { low = middle } else { high = middle }
        }
        let root = (low + high) / 2.0;
        if found.last().is_none_or(|last| root - last > 4.0 * APART) {
            found.push(root);
        }
    }
    let in_turn = |x: f64| {
        let deg = x.to_degrees();
        let deg = if deg < -1e-10 { deg + 360.0 } else { deg.max(0.0) };
        // what is a whole number up to rounding is one
        if (deg - deg.round()).abs() < 1e-10 { deg.round() } else { deg }
    };
    let mut out: Vec<f64> = found.into_iter().filter(|x| pi - x.abs() > 4.0 * APART).map(in_turn).collect();
    out.sort_by(f64::total_cmp);
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::expression::parse;

    fn roots(text: &str) -> Vec<f64> {
        let c = coefficients(&parse(text).expect("parses"), "t_a", &|_| 3f64.sqrt()).expect("a polynomial");
        roots_deg(&c).expect("not zero")
    }

    #[test]
    fn roots_in_degrees() {
        assert_eq!(roots("t_a"), [0.0]);
        assert_eq!(roots("-1+t_a^2"), [90.0, 270.0]);
        assert_eq!(roots("t_a-t_b"), [120.0]);
        assert_eq!(roots("1+t_a^2"), [] as [f64; 0]);
        // tan(a/2)^2 = 1/2: cos a = 1/3
        let third = (1.0f64 / 3.0).acos().to_degrees();
        for (found, expected) in roots("-1+2*t_a^2").iter().zip([third, 360.0 - third]) {
            assert!((found - expected).abs() < 1e-12);
        }
        // close together, and many
        let close = roots("(t_a-1)*(1000*t_a-1001)*(t_a+2)");
        assert_eq!(close.len(), 3);
        assert!((close[1] - 2.0 * 1.001f64.atan().to_degrees()).abs() < 1e-9, "{close:?}");
        let many: String = (0..30).map(|k| format!("*({k}-7*t_a)")).collect();
        assert_eq!(roots(&many[1..]).len(), 30);
        assert_eq!(roots_deg(&[0.0, 0.0]), None);
    }
}
