//! Solutions as text: common factors in front, terms of equal coefficient in brackets. A blank multiplies, and however strongly
//! a reader thinks it does, the formula means the same: a quotient before one stands in brackets, unless it is a number.

use super::solver::{Frame, Solved, Term};
use crate::degree::coefficient::Coefficient;

/// A sum with its common factor taken out:
/// `factor [ sign coefficient (sign Z ...) ... ]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Grouped {
    /// The factor in front, positive, without rates; `None` for one.
    pub factor: Option<Coefficient>,
    /// Groups of terms with equal coefficients.
    pub groups: Vec<Group>,
}

/// `sign coefficient * (sum of signed Z)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// True for minus.
    pub negative: bool,
    /// The magnitude.
    pub coefficient: Coefficient,
    /// Terms, each with true for minus inside the group.
    pub terms: Vec<(bool, Term)>,
}

/// Collects the terms of a solution.
pub fn group(solved: &Solved) -> Grouped {
    let magnitude = |c: &Coefficient| -> (bool, Coefficient) {
        let negative = c.sign_and_factors().0;
        (negative, if negative { c.negated() } else { c.clone() })
    };
    let mut factor: Option<Coefficient> = None;
    let numbers: Vec<Coefficient> =
        solved.terms.iter().map(|t| magnitude(&t.coefficient).1.without_rates()).collect();
    // a single term keeps its number, so that its sign stands in front of it
    if let Some((first, rest)) = numbers.split_first()
        && !rest.is_empty()
        && first.to_string() != "1"
        && rest.iter().all(|n| n.to_string() == first.to_string())
    {
        factor = Some(first.clone());
    }
    let mut groups: Vec<Group> = Vec::new();
    for term in &solved.terms {
        let (negative, mut coefficient) = magnitude(&term.coefficient);
        if factor.is_some() {
            coefficient = Coefficient { rates: coefficient.rates, ..Coefficient::one() };
        }
        let text = coefficient.to_string();
        match groups.iter_mut().find(|g| g.coefficient.to_string() == text) {
            Some(g) => g.terms.push((negative != g.negative, term.clone())),
            None => groups.push(Group { negative, coefficient, terms: vec![(false, term.clone())] }),
        }
    }
    Grouped { factor, groups }
}

/// The name of a derivative of Z, as in `Z1''@p2`.
pub fn z_name(term: &Term, frame: Frame, positions: &[String]) -> String {
    let base = match (frame, term.azimuth) {
        (_, true) => "Za".to_string(),
        (Frame::N, _) => format!("Z{}", term.component),
        (Frame::Platform, _) => format!("Z{}", ["x", "y", "z"][term.component - 1]),
    };
    format!("{base}{}@{}", "'".repeat(term.order), positions[term.position])
}

/// Factors as one, to be followed by a blank and what they multiply: `wU`, `1/2*wU`, `(wU/wN)`.
fn before_a_blank(factors: &[String]) -> String {
    let text = factors.join("*");
    // quotients outside of all brackets, but for the number in front
    let digits = |t: &str| t.find(|c: char| !c.is_ascii_digit()).unwrap_or(t.len());
    let rest = &text[digits(&text)..];
    let below = rest.strip_prefix('/').map_or(0, digits);
    let rest =
        rest.get(below + 1..).filter(|r| below > 0 && (r.is_empty() || r.starts_with('*'))).unwrap_or(rest);
    let mut depth = 0;
    let quotient = rest.chars().any(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        c == '/' && depth == 0
    });
    if quotient { format!("({text})") } else { text }
}

/// A solution in one line, as in `1/2 [ wU (Z1@p1 + Z1@p2) - Z3'@p1 - Z3'@p2 ]`.
pub fn text(solved: &Solved, frame: Frame, positions: &[String]) -> String {
    let grouped = group(solved);
    let mut out = String::new();
    let sign = |out: &mut String, negative: bool| {
        out.push_str(match (out.is_empty(), negative) {
            (true, true) => "-",
            (true, false) => "",
            (false, true) => " - ",
            (false, false) => " + ",
        });
    };
    for g in &grouped.groups {
        let (_, factors) = g.coefficient.sign_and_factors();
        let single = g.terms.len() == 1;
        if factors.is_empty() {
            for (negative, term) in &g.terms {
                sign(&mut out, *negative != g.negative);
                out.push_str(&z_name(term, frame, positions));
            }
            continue;
        }
        sign(&mut out, g.negative);
        out.push_str(&before_a_blank(&factors));
        out.push_str(if single { " " } else { " (" });
        let mut inner = String::new();
        for (negative, term) in &g.terms {
            sign(&mut inner, *negative);
            inner.push_str(&z_name(term, frame, positions));
        }
        out.push_str(&inner);
        if !single {
            out.push(')');
        }
    }
    match grouped.factor {
        None if out.is_empty() => "0".into(),
        None => out,
        Some(factor) => format!("{} [ {out} ]", before_a_blank(&factor.sign_and_factors().1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::degree::coefficient::Number;
    use crate::solution::solver::Verification;
    use obsdeg_exact::Radical;

    #[test]
    fn the_form_of_the_method() {
        let term = |position, component, order, num, rates| Term {
            position,
            component,
            azimuth: false,
            order,
            coefficient: Coefficient { number: Number::Radical(Radical::rational(num, 2)), rates },
        };
        let solved = Solved {
            terms: vec![
                term(0, 1, 0, 1, [0, 1]),
                term(1, 1, 0, 1, [0, 1]),
                term(0, 3, 1, -1, [0, 0]),
                term(1, 3, 1, -1, [0, 0]),
            ],
            verification: Verification::Modular,
        };
        let names = ["p1".to_string(), "p2".to_string()];
        assert_eq!(text(&solved, Frame::N, &names), "1/2 [ wU (Z1@p1 + Z1@p2) - Z3'@p1 - Z3'@p2 ]");
        // the sign of a single term stands before its number, not between the two
        let single = Solved { terms: vec![term(0, 3, 1, -1, [0, 1])], ..solved };
        assert_eq!(text(&single, Frame::N, &names), "-1/2*wU Z3'@p1");
    }

    #[test]
    fn quotients_before_a_blank() {
        for (plain, printed) in [
            ("wU", "wU"),
            ("1/2", "1/2"),
            ("1/2*wU", "1/2*wU"),
            ("3*wU", "3*wU"),
            ("1/wN", "(1/wN)"),
            ("1/2*wU/wN", "(1/2*wU/wN)"),
            ("1/2/sin(a)", "(1/2/sin(a))"),
            ("1/2a", "(1/2a)"),
            ("sqrt(2)/2", "(sqrt(2)/2)"),
            ("(1/2+sqrt(2)/2)*wU", "(1/2+sqrt(2)/2)*wU"),
        ] {
            assert_eq!(before_a_blank(&[plain.to_string()]), printed);
        }
    }
}
