//! Degenerate loci: conditions on generic angles under which a verdict changes.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use obsdeg_exact::{Echelon, Field, PrimeError, SplitMix64, polynomial};
use obsdeg_symbolic::{Job, Request, Worker};
use schemars::JsonSchema;
use serde::Serialize;

use super::half_tangent::{Roots, coefficients, roots_deg};
use super::local::rows_at;
use super::solver::Solver;
use crate::degree::ensemble::{Verdicts, filtration};
use crate::degree::filtration::Degrees;
use crate::degree::status::{Difference, Verdict};
use crate::language::{Environment, Expression, ExpressionError, Node, evaluate, parse};
use crate::model::Platform;
use crate::model::platform::{PlatformPoint, RandomValues};
use crate::model::ring::{Ring, Text};
use crate::model::scheme::Station;

/// Condition on generic angles, and its effect on the verdicts.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Locus {
    /// Condition: `alpha = 0, 180 deg`, `alpha = -beta`, or a polynomial in tangents of half angles that
    /// vanishes; one that is too long to print is described.
    pub condition: String,
    /// Points on the locus, in degrees by angle: all of them when `complete`, examples otherwise.
    pub points_deg: Vec<BTreeMap<String, f64>>,
    /// True if the condition is on a single angle and `points_deg` certainly holds all its values.
    pub complete: bool,
    /// Rank profile at a general point of the locus.
    pub rank_profile: Vec<usize>,
    /// Unknowns whose verdict changes on the locus.
    pub changes: Vec<Difference>,
}

/// Degenerate loci of a scheme, and the reason why some may be missing.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct DegenerateLoci {
    /// Degenerate loci; `None` without generic angles or worker.
    pub loci: Option<Vec<Locus>>,
    /// Reason why some may be missing; `None` if none is.
    pub incomplete: Option<String>,
}

/// Condition on the generic angles.
#[derive(Debug, Clone)]
enum Condition {
    /// Half turn: the angle is 180 degrees, where `tan(name/2)` is infinite.
    HalfTurn(String),
    /// Factor: a polynomial in half tangents vanishes.
    Factor(String),
}

/// Longest condition that is printed in full, in characters.
const LONGEST: usize = 120;
/// Number of values of the other angles tried for an example.
const EXAMPLES: usize = 48;

/// Number of random points tried per factor. A polynomial has a root in a random field with probability near
/// 1 - 1/e.
const TRIES: usize = 40;

/// Reasons why degenerate loci were not computed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum LociError {
    /// Another angle or offset is no multiple of 90 degrees: the factors have no numbers for its sine.
    #[error("degenerate loci are computed when all other angles and offsets are multiples of 90 deg")]
    OtherAngles,
    /// Minors with turning rates are not factored.
    #[error("degenerate angles of a scheme whose rotations are judged by the course of Z are not computed")]
    OutputHistory,
    /// The engine's answer could not be read.
    #[error("factor `{text}`: {error}")]
    Factor {
        /// Text of the answer.
        text: String,
        /// Error in the text.
        error: ExpressionError,
    },
    /// No field fits the angles.
    #[error(transparent)]
    Prime(#[from] PrimeError),
}

/// Degenerate loci of a scheme with generic angles.
///
/// If the rank of `V_k`, or of `V_k` without the column of an unknown outside `V_k`, drops, every maximal
/// minor vanishes. So the factors of one minor each are candidates. A candidate counts if the verdict at a
/// random point of it differs.
///
/// # Errors
/// [`LociError`].
pub(crate) fn loci(
    platform: &Platform,
    verdicts: &Verdicts,
    solver: &mut Solver<'_>,
    seed: u64,
) -> Result<DegenerateLoci, LociError> {
    let names = platform.scheme().generic_names();
    if names.is_empty() {
        return Ok(DegenerateLoci::default());
    }
    if platform.scheme().by_history() {
        return Err(LociError::OutputHistory);
    }
    let stations = platform.scheme().stations();
    if !stations.iter().flat_map(Station::angles).all(|a| a.turn().is_multiple_of_deg(90)) {
        return Err(LociError::OtherAngles);
    }
    let requests = candidate_requests(platform, verdicts, solver, &names);
    let Some(worker) = solver.worker() else { return Ok(DegenerateLoci::default()) };
    let (conditions, stopped) = conditions(&names, &requests, worker);
    let mut rng = platform.scheme().random(seed, "degenerate angles");
    let mut found = FoundLoci::default();
    for condition in conditions {
        found.judge(platform, verdicts, (&condition, &names), &mut rng)?;
    }
    let incomplete = found.incomplete(stopped);
    Ok(DegenerateLoci { loci: Some(found.loci.into_iter().map(finished).collect()), incomplete })
}

/// Half turns of all angles and the different factors of the requests; with the reason why some requests have
/// no answer.
fn conditions(
    names: &[String],
    requests: &[Request],
    worker: &mut Worker,
) -> (Vec<Condition>, Option<String>) {
    let mut conditions: Vec<Condition> = names.iter().cloned().map(Condition::HalfTurn).collect();
    let mut seen: Vec<String> = Vec::new();
    for request in requests {
        let factors = match worker.ask(request) {
            Ok((factors, _)) => factors,
            Err(e) => return (conditions, Some(e.to_string())),
        };
        for factor in factors.into_iter().filter(|f| !seen.contains(f)).collect::<Vec<_>>() {
            conditions.push(Condition::Factor(factor.clone()));
            seen.push(factor);
        }
    }
    (conditions, None)
}

/// Loci found so far.
#[derive(Default)]
struct FoundLoci {
    /// Points of each locus, and its effect; its condition is not yet written.
    loci: Vec<(LocusPoints, Locus)>,
    /// Number of conditions of which the points or the effect are not known.
    undecided: usize,
}

impl FoundLoci {
    /// Adds a condition if it changes the verdicts.
    fn judge(
        &mut self,
        platform: &Platform,
        verdicts: &Verdicts,
        (condition, names): (&Condition, &[String]),
        rng: &mut SplitMix64,
    ) -> Result<(), LociError> {
        let place = match LocusPoints::of(condition, names) {
            RealPoints::Nowhere => return Ok(()),
            RealPoints::At(place) => Some(place),
            RealPoints::Unknown => None,
        };
        let Some(there) = degrees_on(platform, condition, names, rng)? else {
            self.undecided += 1;
            return Ok(());
        };
        let difference = |(c, name): (usize, &String)| Difference {
            name: name.clone(),
            here: Verdict::of(&verdicts.degrees, c),
            there: Verdict::of(&there, c),
        };
        let differences = platform.names().iter().enumerate().map(difference);
        let changes: Vec<Difference> = differences.filter(|d| d.here != d.there).collect();
        if changes.is_empty() && there.rank_profile == verdicts.degrees.rank_profile {
            return Ok(());
        }
        match place {
            Some(place) => self.add(place, there.rank_profile, changes),
            None => self.undecided += 1,
        }
        Ok(())
    }

    /// Adds a locus. Values of one angle with the same effect are one condition.
    fn add(&mut self, place: LocusPoints, rank_profile: Vec<usize>, changes: Vec<Difference>) {
        let same = |l: &&mut (LocusPoints, Locus)| {
            let same_angle = l.0.angle.is_some() && l.0.angle == place.angle && l.0.words == place.words;
            same_angle && l.1.rank_profile == rank_profile && l.1.changes == changes
        };
        match self.loci.iter_mut().find(same) {
            Some((other, _)) => other.points_deg.extend(place.points_deg),
            None => {
                let blank = Locus {
                    condition: String::new(),
                    points_deg: vec![],
                    complete: false,
                    rank_profile,
                    changes,
                };
                self.loci.push((place, blank));
            }
        }
    }

    /// Reason why loci may be missing, with the one for which the requests were `stopped`.
    fn incomplete(&self, stopped: Option<String>) -> Option<String> {
        let undecided = self.undecided;
        if undecided == 0 {
            return stopped;
        }
        let few = format!(
            "of {undecided} {} it is not known whether angles meet {} or what changes there",
            if undecided == 1 { "condition" } else { "conditions" },
            if undecided == 1 { "it" } else { "them" },
        );
        Some(stopped.map_or(few.clone(), |e| format!("{e}; {few}")))
    }
}

/// Locus with its condition and sorted points.
fn finished((mut place, locus): (LocusPoints, Locus)) -> Locus {
    let angle = place.angle.clone();
    place.points_deg.sort_by(|a, b| angle.as_ref().map_or(Ordering::Equal, |n| a[n].total_cmp(&b[n])));
    Locus {
        condition: place.condition(),
        complete: angle.is_some() && place.words.is_none(),
        points_deg: place.points_deg,
        ..locus
    }
}

/// Requests, one per candidate matrix, over `t_name = tan(name/2)`.
fn candidate_requests(
    platform: &Platform,
    verdicts: &Verdicts,
    solver: &Solver<'_>,
    names: &[String],
) -> Vec<Request> {
    let point = half_tangent_point(platform, solver);
    let text = rows_at(platform, &point, &solver.tables.observables);
    let first = solver.tables.first();
    let n = platform.names().len();
    let symbols: Vec<String> = names.iter().map(|name| format!("t_{name}")).collect();
    let mut out: Vec<Request> = Vec::new();
    // if all entries of one column vanish, its unknown is no longer excited
    for c in 0..n {
        let column: Vec<Vec<String>> =
            text.iter().filter(|row| row[c] != "0").map(|row| vec![row[c].clone()]).collect();
        let job = Job::MinorFactors { matrix: column };
        out.push(Request { symbols: symbols.clone(), generators: vec![], angles: vec![], job });
    }
    for k in 0..verdicts.degrees.rank_profile.len() {
        let mut basis = Echelon::new(first.sample.roots.field, n);
        let rows: Vec<usize> =
            solver.tables.rows_up_to(k).into_iter().filter(|&j| basis.insert(&first.rows[j])).collect();
        let outside = (0..n).filter(|&c| !basis.has_unit(c) && !basis.is_zero_column(c));
        for removed in std::iter::once(None).chain(outside.map(Some)) {
            let used = |c: &usize| Some(*c) != removed && rows.iter().any(|&j| text[j][*c] != "0");
            let columns: Vec<usize> = (0..n).filter(used).collect();
            let matrix =
                rows.iter().map(|&j| columns.iter().map(|&c| text[j][c].clone()).collect()).collect();
            let request = Request {
                symbols: symbols.clone(),
                generators: vec![],
                angles: vec![],
                job: Job::MinorFactors { matrix },
            };
            if !out.contains(&request) {
                out.push(request);
            }
        }
    }
    out
}

fn half_tangent_point(platform: &Platform, solver: &Solver<'_>) -> PlatformPoint<Text> {
    let rate = |zero: bool| if zero { Text.zero() } else { Text.one() };
    let quarter =
        [("1", "0"), ("0", "1"), ("-1", "0"), ("0", "-1")].map(|(c, s)| (c.to_string(), s.to_string()));
    let cos_sin = |angle: &crate::model::Angle| {
        let (a, b) = &quarter[(angle.turn().nanodeg() / 90_000_000_000) as usize % 4];
        let Some((name, minus)) = angle.generic() else { return (a.clone(), b.clone()) };
        let c = format!("((1-t_{name}^2)/(1+t_{name}^2))");
        let s = format!("({}2*t_{name}/(1+t_{name}^2))", if minus { "-" } else { "" });
        let cos = Text.add(&Text.mul(&c, a), &Text.neg(&Text.mul(&s, b)));
        (cos, Text.add(&Text.mul(&s, a), &Text.mul(&c, b)))
    };
    PlatformPoint {
        ring: Text,
        w_n: rate(solver.tables.zeros.w_n),
        w_u: rate(solver.tables.zeros.w_u),
        attitudes: platform.scheme().stations().iter().map(|s| s.attitude(&Text, cos_sin)).collect(),
        turns: Vec::new(),
    }
}

/// Degrees at a random point of the condition on which two fields agree; `None` if no point was found.
fn degrees_on(
    platform: &Platform,
    condition: &Condition,
    names: &[String],
    rng: &mut SplitMix64,
) -> Result<Option<Degrees>, LociError> {
    let parsed = match condition {
        Condition::HalfTurn(_) => None,
        Condition::Factor(text) => {
            Some(parse(text).map_err(|error| LociError::Factor { text: text.clone(), error })?)
        }
    };
    let mut found: Vec<Degrees> = Vec::new();
    for _ in 0..TRIES {
        let mut values = RandomValues::draw(platform.scheme(), rng)?;
        let placed = match (condition, &parsed) {
            (Condition::HalfTurn(name), _) => values.set_half_turn(name),
            (_, Some(e)) => place(&mut values, e, names, rng),
            _ => false,
        };
        if !placed {
            continue;
        }
        found.push(filtration(platform, &values.sample(platform.scheme(), 1)).0);
        if let [.., a, b] = &found[..]
            && a == b
        {
            return Ok(Some(a.clone()));
        }
    }
    Ok(None)
}

struct Tangents<'a> {
    names: &'a [String],
    values: &'a [u64],
}

impl Environment for Tangents<'_> {
    fn name(&self, name: &str) -> Option<u64> {
        let suffix = name.strip_prefix("t_")?;
        self.names.iter().position(|n| n == suffix).map(|i| self.values[i])
    }
    fn cos_sin(&self, _: &str) -> Option<(u64, u64)> {
        None
    }
    fn known(&self) -> Vec<String> {
        self.names.iter().map(|n| format!("t_{n}")).collect()
    }
}

/// Sets the generic angles to a random point where the polynomial vanishes. Returns false if this field has
/// none for the values drawn.
fn place(values: &mut RandomValues, e: &Expression, names: &[String], rng: &mut SplitMix64) -> bool {
    let f: Field = values.roots().field;
    let Some(main) = names.iter().position(|n| degree_in(e, &format!("t_{n}")) > 0) else { return false };
    let mut tangents: Vec<u64> = names.iter().map(|_| f.from_u64(rng.next_u64())).collect();
    let degree = degree_in(e, &format!("t_{}", names[main]));
    let points: Option<Vec<(u64, u64)>> = (0..=degree as u64)
        .map(|x| {
            tangents[main] = f.from_u64(x);
            evaluate(e, &f, &Tangents { names, values: &tangents }).ok().map(|y| (f.from_u64(x), y))
        })
        .collect();
    let Some(root) = points.and_then(|p| polynomial::root(&f, &polynomial::interpolate(&f, &p), rng)) else {
        return false;
    };
    tangents[main] = root;
    names.iter().zip(&tangents).all(|(n, &t)| values.set_half_tangent(n, t))
}

/// Upper bound on the degree of a polynomial in one name.
fn degree_in(e: &Expression, name: &str) -> usize {
    let mut degrees: Vec<usize> = Vec::with_capacity(e.nodes.len());
    for node in &e.nodes {
        degrees.push(match node {
            Node::Number { .. } | Node::Call { .. } => 0,
            Node::Name(n) => usize::from(n == name),
            Node::Negate(a) | Node::Divide(a, _) => degrees[*a],
            Node::Add(a, b) | Node::Subtract(a, b) => degrees[*a].max(degrees[*b]),
            Node::Multiply(a, b) => degrees[*a] + degrees[*b],
            Node::Power(a, k) => degrees[*a] * e.integer_at(*k).map_or(1, |k| k.unsigned_abs() as usize),
        });
    }
    degrees.last().copied().unwrap_or(0)
}

/// Real points of a condition.
#[derive(Debug, Clone, PartialEq)]
struct LocusPoints {
    /// Name of the angle, if the condition is on a single one.
    angle: Option<String>,
    /// Values of the angles: all of them if there are no words, examples otherwise.
    points_deg: Vec<BTreeMap<String, f64>>,
    /// Condition in words; `None` if the values state it.
    words: Option<String>,
}

/// Knowledge about the real points of a condition.
#[derive(Debug, Clone, PartialEq)]
enum RealPoints {
    /// The condition has no real point, or only points that satisfy two conditions at once.
    Nowhere,
    At(LocusPoints),
    /// No real point was found, but there may be one.
    Unknown,
}

/// Degrees as text: whole numbers without decimals, others with four.
fn degrees(x: f64) -> String {
    if x == x.round() { format!("{x:.0}") } else { format!("{x:.4}") }
}

impl LocusPoints {
    fn of(condition: &Condition, names: &[String]) -> RealPoints {
        let text = match condition {
            Condition::HalfTurn(name) => {
                let points_deg = vec![BTreeMap::from([(name.clone(), 180.0)])];
                return RealPoints::At(Self { angle: Some(name.clone()), points_deg, words: None });
            }
            Condition::Factor(text) => text,
        };
        let Ok(e) = parse(text) else { return RealPoints::Unknown };
        let in_it: Vec<&String> = names.iter().filter(|n| degree_in(&e, &format!("t_{n}")) > 0).collect();
        let roots = |name: &str, others: &dyn Fn(&str) -> f64| -> Roots {
            let found = coefficients(&e, &format!("t_{name}"), others).and_then(|c| roots_deg(&c));
            found.unwrap_or(Roots { deg: Vec::new(), all: false })
        };
        if let [name] = in_it[..] {
            let Roots { deg, all } = roots(name, &|_| f64::NAN);
            if deg.is_empty() {
                return if all { RealPoints::Nowhere } else { RealPoints::Unknown };
            }
            let points_deg = deg.into_iter().map(|x| BTreeMap::from([(name.clone(), x)])).collect();
            let words = (!all).then(|| in_words(&e, text, &in_it));
            return RealPoints::At(Self { angle: Some(name.clone()), points_deg, words });
        }
        // a factor that is never negative vanishes on no surface
        if never_negative(&e) {
            return RealPoints::Nowhere;
        }
        // examples: solve for each angle in turn, with some values of the others
        for i in 0..EXAMPLES {
            let value = |n: &str| {
                let place = in_it.iter().position(|m| m.as_str() == n).unwrap_or(0);
                ((70 + 330 * place + i * (53 + 44 * place)) % 360) as f64
            };
            // multiples of 45 degrees may be degenerate for other reasons
            if in_it.iter().any(|n| value(n) % 45.0 == 0.0) {
                continue;
            }
            for main in &in_it {
                let at = |t: &str| (value(t.strip_prefix("t_").unwrap_or(t)).to_radians() / 2.0).tan();
                let points = roots(main, &at).deg.into_iter().map(|x| {
                    let of = |n: &&String| ((*n).clone(), if n == main { x } else { value(n) });
                    in_it.iter().map(of).collect()
                });
                let points_deg: Vec<BTreeMap<String, f64>> = points.collect();
                if !points_deg.is_empty() {
                    let words = Some(in_words(&e, text, &in_it));
                    return RealPoints::At(Self { angle: None, points_deg, words });
                }
            }
        }
        RealPoints::Unknown
    }

    /// Condition `alpha = 0, 180 deg`, or in words with an example.
    fn condition(&self) -> String {
        let list = |name: &str| {
            let values: Vec<String> = self.points_deg.iter().map(|p| degrees(p[name])).collect();
            format!("{name} = {} deg", values.join(", "))
        };
        match (&self.words, &self.angle, self.points_deg.first()) {
            (None, Some(name), _) => list(name),
            (Some(words), Some(name), _) => format!("{words}, for instance at {}", list(name)),
            (Some(words), None, Some(point)) if words.contains("tan(") => {
                let values: Vec<String> =
                    point.iter().map(|(n, x)| format!("{n} = {}", degrees(*x))).collect();
                format!("{words}, for instance at {} deg", values.join(", "))
            }
            (words, ..) => words.clone().unwrap_or_default(),
        }
    }
}

/// True if the text shows that a polynomial is a sum of products of squares.
fn never_negative(e: &Expression) -> bool {
    let mut out: Vec<bool> = Vec::with_capacity(e.nodes.len());
    for node in &e.nodes {
        out.push(match node {
            Node::Number { mantissa, .. } => *mantissa >= 0,
            Node::Name(_) | Node::Call { .. } | Node::Negate(_) | Node::Subtract(..) => false,
            Node::Add(a, b) | Node::Multiply(a, b) | Node::Divide(a, b) => out[*a] && out[*b],
            Node::Power(a, k) => out[*a] || e.integer_at(*k).is_some_and(|k| k % 2 == 0),
        });
    }
    out.last().copied().unwrap_or(false)
}

/// Condition that a polynomial in half tangents vanishes, in words: a relation of two angles if it is one.
fn in_words(e: &Expression, text: &str, in_it: &[&String]) -> String {
    let name = |text: &str| -> Option<String> {
        let name = text.strip_prefix("t_")?;
        name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_').then(|| name.to_string())
    };
    let pair = |text: &str, operator: char| {
        let (a, b) = text.split_once(operator)?;
        Some((name(a)?, name(b)?))
    };
    if let Some((a, b)) = pair(text, '-') {
        return format!("{a} = {b}");
    }
    if let Some((a, b)) = pair(text, '+') {
        return format!("{a} = -{b}");
    }
    for (start, sign) in [("-1+", '+'), ("1+", '-')] {
        if let Some((a, b)) = text.strip_prefix(start).and_then(|t| pair(t, '*')) {
            return format!("{a} {sign} {b} = 180 deg");
        }
    }
    let mut shown = String::new();
    let mut rest = text;
    while let Some(start) = rest.find("t_") {
        let name_end = rest[start + 2..]
            .find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
            .map_or(rest.len(), |e| start + 2 + e);
        shown.push_str(&rest[..start]);
        shown.push_str(&format!("tan({}/2)", &rest[start + 2..name_end]));
        rest = &rest[name_end..];
    }
    shown.push_str(rest);
    if shown.len() > LONGEST {
        let of_names = |f: &dyn Fn(&&String) -> String| in_it.iter().map(f).collect::<Vec<_>>().join(", ");
        let tangents = of_names(&|n| format!("tan({n}/2)"));
        let degrees = of_names(&|n| degree_in(e, &format!("t_{n}")).to_string());
        let terms = 1 + text.char_indices().filter(|(i, c)| *i > 0 && matches!(c, '+' | '-')).count();
        return format!("a polynomial of {terms} terms in {tangents}, of degree {degrees}, vanishes");
    }
    format!("{shown} = 0")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_in_words() {
        let names = ["a".to_string(), "b".into()];
        let place = |t: &str| LocusPoints::of(&Condition::Factor(t.into()), &names);
        let factor = |t: &str| match place(t) {
            RealPoints::At(p) => Some(p.condition()),
            _ => None,
        };
        let says = |t: &str, words: &str| assert_eq!(factor(t).as_deref(), Some(words));
        says("t_a", "a = 0 deg");
        says("-1+t_b^2", "b = 90, 270 deg");
        says("-1+2*t_b^2", "b = 70.5288, 289.4712 deg");
        says("t_a-t_b", "a = b");
        says("t_a+t_b", "a = -b");
        says("-1+t_a*t_b", "a + b = 180 deg");
        says("1+t_a*t_b", "a - b = 180 deg");
        // tan(b/2) = (1 - tan(35 deg)^2) / (2 tan(35 deg)) = 1/tan(70 deg): b = 40 deg
        says(
            "-1+2*t_a*t_b+t_a^2",
            "-1+2*tan(a/2)*tan(b/2)+tan(a/2)^2 = 0, for instance at a = 70, b = 40 deg",
        );
        // an unreadably long condition is described
        let long: String = (0..40).map(|k| format!("+{}*t_a^{}*t_b^3", k + 2, k % 7)).collect();
        let words = factor(&format!("-1{long}")).expect("it has points");
        let described =
            "a polynomial of 41 terms in tan(a/2), tan(b/2), of degree 6, 3, vanishes, for instance at a = ";
        assert!(words.len() < 160 && words.starts_with(described), "{words}");
        // no real point; points that satisfy two conditions; not all points known
        for t in ["1+t_a^2", "1+t_a^2*t_b^2", "t_a^2+2*t_b^2", "3+t_a^2*(1+t_b^2)"] {
            assert_eq!(place(t), RealPoints::Nowhere, "{t}");
        }
        assert_eq!(place("3-2*t_a+t_a^2-2*t_b+t_b^2"), RealPoints::Unknown);
        let hidden = factor("(t_a-1)*(t_b-t_b+3*t_a-1)^2*(t_a^200-1)*t_a");
        assert_eq!(hidden, None, "beyond the limit");
        says("(t_a-1)*(3*t_a-1)^2", "(tan(a/2)-1)*(3*tan(a/2)-1)^2 = 0, for instance at a = 90 deg");
    }
}
