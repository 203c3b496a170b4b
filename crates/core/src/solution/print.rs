//! Solutions as text: common factors in front, terms of equal coefficient in brackets. A blank multiplies.
//! The formula is unambiguous whatever precedence a reader gives to the blank: a quotient before it stands
//! in brackets, unless it is a number.

use schemars::JsonSchema;
use serde::Serialize;

use super::solve::Solved;
use super::solver::Frame;
use super::term::DerivativeTerm;
use crate::degree::coefficient::{Coefficient, product};
use crate::model::Scheme;

/// Label, in formulas, of a station: a point at which derivatives of Z are taken.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct StationLabel {
    /// Label in formulas: `p1`, `"about X"`, `p1[45 deg]`.
    pub label: String,
    /// Name of the position or rotation.
    pub position: String,
    /// Angle of the rotation at this station, in degrees, right-handed; null for a position at rest.
    /// Derivatives of Z at such a station are those of a turning platform, not of one that stopped there.
    pub turned_deg: Option<f64>,
    /// Axis of the rotation: `X_p`, `Y_p`, `Z_p`, `N`, `U` or `E`; null for a position at rest.
    pub about: Option<String>,
    /// Rate of turning in formulas, such as `w@p1`: the derivative of that angle by time, in rad/s; null for
    /// a position at rest.
    pub rate: Option<String>,
}

/// Name in a formula: in quotation marks unless it consists of letters, digits and `_` and begins with a
/// letter.
pub(crate) fn quoted(name: &str) -> String {
    let plain =
        name.starts_with(char::is_alphabetic) && name.chars().all(|c| c.is_alphanumeric() || c == '_');
    if plain { name.into() } else { format!("{name:?}") }
}

/// Stations of a scheme: its positions, and the attitudes of its rotations.
pub(crate) fn stations(scheme: &Scheme) -> Vec<StationLabel> {
    let stations = scheme.stations();
    let label = |s: &crate::model::scheme::Station<'_>| {
        let name = quoted(&s.position.name);
        let angle = s.turned.as_ref().map(|t| &t.angle);
        StationLabel {
            label: angle.map_or(name.clone(), |a| format!("{name}[{a} deg]")),
            position: s.position.name.clone(),
            turned_deg: angle.and_then(crate::model::Angle::degrees),
            about: s.turned.as_ref().map(|t| t.axis.to_string()),
            rate: angle.map(|_| format!("w@{name}")),
        }
    };
    stations.iter().map(label).collect()
}

/// Sum with its common factor in front: `factor [ sign coefficient (sign Z ...) ... ]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Grouped {
    /// Common factor, positive, without rates; `None` for one.
    pub factor: Option<Coefficient>,
    /// Groups of terms with equal coefficients.
    pub groups: Vec<Group>,
}

/// Group `sign coefficient * w^turns * (sum of signed Z)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// True for a minus sign.
    pub negative: bool,
    /// Magnitude of the coefficient.
    pub coefficient: Coefficient,
    /// Power of the turning rate, common to all terms.
    pub turns: usize,
    /// Terms, each with true for a minus sign inside the group.
    pub terms: Vec<(bool, DerivativeTerm)>,
}

/// Groups the terms of a solution.
pub fn group(solved: &Solved, stations: &[StationLabel]) -> Grouped {
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
        let same = |g: &&mut Group| {
            let other = &g.terms[0].1;
            let rates = [other.station, term.station].map(|s| &stations[s].rate);
            g.turns == term.turns
                && (g.turns == 0 || rates[0] == rates[1])
                && g.coefficient.to_string() == text
        };
        match groups.iter_mut().find(same) {
            Some(g) => g.terms.push((negative != g.negative, term.clone())),
            None => {
                let terms = vec![(false, term.clone())];
                groups.push(Group { negative, coefficient, turns: term.turns, terms });
            }
        }
    }
    Grouped { factor, groups }
}

impl Group {
    /// Factors of the group, without a leading one: `1/2`, `wU/wN`, `w@p1^2`.
    pub fn factors(&self, stations: &[StationLabel]) -> Vec<String> {
        let (_, mut factors) = self.coefficient.sign_and_factors();
        let rate = stations[self.terms[0].1.station].rate.as_deref();
        factors.extend(rate.filter(|_| self.turns > 0).map(|rate| rate_power(rate, self.turns)));
        factors
    }
}

/// Power of a turning rate: `w@p1`, `w@p1^2`.
fn rate_power(rate: &str, turns: usize) -> String {
    if turns == 1 { rate.into() } else { format!("{rate}^{turns}") }
}

/// Observation of a term, as in `Z1''`.
fn observed(term: &DerivativeTerm, frame: Frame) -> String {
    let base = match (frame, term.azimuth) {
        (_, true) => "Za".to_string(),
        (Frame::N, _) => format!("Z{}", term.component),
        (Frame::Platform, _) => format!("Z{}", ["x", "y", "z"][term.component - 1]),
    };
    format!("{base}{}", "'".repeat(term.order))
}

/// Name of a derivative of Z, as in `Z1''@p2`.
pub(crate) fn z_name(term: &DerivativeTerm, frame: Frame, stations: &[StationLabel]) -> String {
    format!("{}@{}", observed(term, frame), stations[term.station].label)
}

/// Term of a solution, machine-readable.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SolutionTerm {
    /// Coefficient with its sign, such as `-wU*w@p1/(2*wN)`; decimals with all their digits.
    pub coefficient: String,
    /// Derivative of the observation, such as `Z1'`.
    pub observation: String,
    /// Label of the station at which the derivative is taken.
    pub station: String,
}

/// Terms of a solution, one by one.
pub(crate) fn terms(solved: &Solved, frame: Frame, stations: &[StationLabel]) -> Vec<SolutionTerm> {
    let term = |t: &DerivativeTerm| {
        let (negative, mut factors) = t.coefficient.precise_sign_and_factors();
        let station = &stations[t.station];
        factors.extend(station.rate.as_deref().filter(|_| t.turns > 0).map(|rate| rate_power(rate, t.turns)));
        let magnitude = if factors.is_empty() { "1".into() } else { product(&factors) };
        SolutionTerm {
            coefficient: format!("{}{magnitude}", if negative { "-" } else { "" }),
            observation: observed(t, frame),
            station: station.label.clone(),
        }
    };
    solved.terms.iter().map(term).collect()
}

/// Product of factors that is followed by a blank and another factor: `wU`, `1/2*wU`, `(wU/wN)`.
fn before_a_blank(factors: &[String]) -> String {
    let text = product(factors);
    // quotients outside of all brackets, except for the leading number
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

/// Solution in one line, as in `1/2 [ wU (Z1@p1 + Z1@p2) - Z3'@p1 - Z3'@p2 ]`.
pub(crate) fn text(solved: &Solved, frame: Frame, stations: &[StationLabel]) -> String {
    let grouped = group(solved, stations);
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
        let factors = g.factors(stations);
        let single = g.terms.len() == 1;
        if factors.is_empty() {
            for (negative, term) in &g.terms {
                sign(&mut out, *negative != g.negative);
                out.push_str(&z_name(term, frame, stations));
            }
            continue;
        }
        sign(&mut out, g.negative);
        out.push_str(&before_a_blank(&factors));
        out.push_str(if single { " " } else { " (" });
        let mut inner = String::new();
        for (negative, term) in &g.terms {
            sign(&mut inner, *negative);
            inner.push_str(&z_name(term, frame, stations));
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
    use crate::solution::solve::{FoundBy, Verification};
    use obsdeg_exact::Radical;

    #[test]
    fn the_form_of_the_method() {
        let term = |station, component, order, num, rates| DerivativeTerm {
            station,
            component,
            azimuth: false,
            order,
            turns: 0,
            coefficient: Coefficient { number: Number::Radical(Radical::rational(num, 2)), rates },
        };
        let solved = Solved {
            terms: vec![
                term(0, 1, 0, 1, [0, 1]),
                term(1, 1, 0, 1, [0, 1]),
                term(0, 3, 1, -1, [0, 0]),
                term(1, 3, 1, -1, [0, 0]),
            ],
            found_by: FoundBy::PrimeFields,
            verification: Verification::Modular,
        };
        let attitude = crate::model::scheme::parse_attitude("0,0,0").expect("an attitude");
        let names = stations(&Scheme::of_angles([attitude.clone(), attitude]));
        assert_eq!(text(&solved, Frame::N, &names), "1/2 [ wU (Z1@p1 + Z1@p2) - Z3'@p1 - Z3'@p2 ]");
        // the sign of a single term stands before its number, not after it
        let single = Solved { terms: vec![term(0, 3, 1, -1, [0, 1])], ..solved };
        assert_eq!(text(&single, Frame::N, &names), "-1/2*wU Z3'@p1");
    }

    /// No label of a station reads as a sum, a product or another name.
    #[test]
    fn labels() {
        let attitude = crate::model::scheme::parse_attitude("0,0,0").expect("an attitude");
        let mut scheme = Scheme::of_angles([attitude.clone(), attitude]);
        scheme.positions[0].rotation = crate::model::rotation::Rotation::new("X_p", "-90").ok();
        scheme.positions[1].name = "about X-1".into();
        let labels = stations(&scheme);
        let texts: Vec<&str> = labels.iter().map(|l| l.label.as_str()).collect();
        assert_eq!(texts[..3], ["p1[0 deg]", "p1[-11.25 deg]", "p1[-22.5 deg]"]);
        assert_eq!(texts.last(), Some(&"\"about X-1\""));
        assert_eq!((labels[1].turned_deg, labels[1].rate.as_deref()), (Some(-11.25), Some("w@p1")));
        assert_eq!(
            (quoted("p+1").as_str(), quoted("1").as_str(), quoted("\u{b5}1").as_str()),
            ("\"p+1\"", "\"1\"", "\u{b5}1")
        );
    }

    #[test]
    fn quotients_before_a_blank() {
        for (plain, printed) in [
            ("wU", "wU"),
            ("1/2", "1/2"),
            ("1/2*wU", "1/2*wU"),
            ("3*wU", "3*wU"),
            ("1/wN", "(1/wN)"),
            ("1/2*wU/wN", "(wU/(2*wN))"),
            ("1/2/sin(a)", "(1/(2*sin(a)))"),
            ("1/2a", "(1/2a)"),
            ("sqrt(2)/2", "(sqrt(2)/2)"),
            ("(1/2+sqrt(2)/2)*wU", "(1/2+sqrt(2)/2)*wU"),
        ] {
            assert_eq!(before_a_blank(&[plain.to_string()]), printed);
        }
    }
}
