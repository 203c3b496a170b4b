//! Degenerate loci: conditions on generic angles under which a verdict changes.

use obsdeg_exact::{Echelon, Field, SplitMix64, polynomial};
use obsdeg_symbolic::{Job, Request};
use schemars::JsonSchema;
use serde::Serialize;

use super::local::rows_at;
use super::solver::Solver;
use crate::analysis::{Difference, verdict};
use crate::degree::ensemble::{Verdicts, staircase};
use crate::degree::staircase::Degrees;
use crate::model::Platform;
use crate::model::expression::{Environment, Expression, Node, evaluate, evaluate_f64, parse};
use crate::model::platform::{Point, RandomValues};
use crate::model::ring::{Ring, Text};
use crate::model::scheme::Station;

/// A condition and what it does.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Locus {
    /// The condition, one irreducible factor, such as `alpha = 0` or a polynomial in half tangents.
    pub condition: String,
    /// The rank profile at a general point of the locus.
    pub rank_profile: Vec<usize>,
    /// The unknowns whose verdict changes there.
    pub changes: Vec<Difference>,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Found {
    /// The loci; `None` without generic angles or worker.
    pub loci: Option<Vec<Locus>>,
    /// Why some may be missing.
    pub incomplete: Option<String>,
}

/// Where a generic angle is put.
#[derive(Debug, Clone)]
enum Condition {
    /// `tan(name/2)` is infinite: 180 degrees.
    HalfTurn(String),
    /// A polynomial in half tangents vanishes.
    Factor(String),
}

/// Random points tried per factor: a polynomial has a root in a random field with probability near
/// 1 - 1/e.
const TRIES: usize = 40;

/// The degenerate loci of a scheme with generic angles.
///
/// Wherever a rank of `V_k`, or of `V_k` without the column of an unknown outside `V_k`, drops, every
/// maximal minor vanishes. So the factors of one minor each are candidates, and a candidate counts
/// when the verdict at a random point of it differs.
///
/// # Errors
/// A sentence that says why they were not computed.
pub fn loci(
    platform: &Platform,
    verdicts: &Verdicts,
    solver: &mut Solver<'_>,
    seed: u64,
) -> Result<Found, String> {
    let names = platform.scheme().generic_names();
    if names.is_empty() {
        return Ok(Found::default());
    }
    let stations = platform.scheme().stations();
    if !stations.iter().flat_map(Station::angles).all(|a| a.turn().is_multiple_of_deg(90)) {
        return Err(
            "degenerate loci are computed when all other angles and offsets are multiples of 90 deg".into()
        );
    }
    let requests = candidate_requests(platform, verdicts, solver, &names);
    let Some(worker) = solver.worker() else { return Ok(Found::default()) };
    let mut conditions: Vec<Condition> = names.iter().cloned().map(Condition::HalfTurn).collect();
    let mut seen: Vec<String> = Vec::new();
    let mut incomplete = None;
    for request in requests {
        let factors = match worker.ask(&request) {
            Ok((factors, _)) => factors,
            Err(e) => {
                incomplete = Some(format!("the list of degenerate angles may lack some: {e}"));
                break;
            }
        };
        for factor in factors.into_iter().filter(|f| !seen.contains(f)).collect::<Vec<_>>() {
            conditions.push(Condition::Factor(factor.clone()));
            seen.push(factor);
        }
    }
    let mut rng = platform.scheme().random(seed, "degenerate angles");
    let mut out: Vec<Locus> = Vec::new();
    for condition in conditions {
        let Some(there) = degrees_on(platform, &condition, &names, &mut rng)? else { continue };
        let changes: Vec<Difference> = platform
            .names()
            .iter()
            .enumerate()
            .map(|(c, name)| Difference {
                name: name.clone(),
                here: verdict(&verdicts.degrees, c),
                there: verdict(&there, c),
            })
            .filter(|d| d.here != d.there)
            .collect();
        if changes.is_empty() && there.rank_profile == verdicts.degrees.rank_profile {
            continue;
        }
        out.push(Locus { condition: describe(&condition), rank_profile: there.rank_profile, changes });
    }
    Ok(Found { loci: Some(out), incomplete })
}

/// One request per candidate matrix, over `t_name = tan(name/2)`.
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
    // where all entries of one column vanish, its unknown is no longer excited
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

fn half_tangent_point(platform: &Platform, solver: &Solver<'_>) -> Point<Text> {
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
    Point {
        ring: Text,
        w_n: rate(solver.tables.zeros.w_n),
        w_u: rate(solver.tables.zeros.w_u),
        attitudes: platform.scheme().stations().iter().map(|s| s.attitude(&Text, cos_sin)).collect(),
    }
}

/// The degrees at a random point of the condition, agreed on by two fields; `None` when it has no
/// real points.
fn degrees_on(
    platform: &Platform,
    condition: &Condition,
    names: &[String],
    rng: &mut SplitMix64,
) -> Result<Option<Degrees>, String> {
    let parsed = match condition {
        Condition::HalfTurn(_) => None,
        Condition::Factor(text) => Some(parse(text).map_err(|e| format!("factor `{text}`: {e}"))?),
    };
    if parsed.as_ref().is_some_and(|e| !has_real_zero(e, names)) {
        return Ok(None);
    }
    let mut found: Vec<Degrees> = Vec::new();
    for _ in 0..TRIES {
        let mut values = RandomValues::draw(platform.scheme(), rng).map_err(|e| e.to_string())?;
        let placed = match (condition, &parsed) {
            (Condition::HalfTurn(name), _) => values.set_half_turn(name),
            (_, Some(e)) => place(&mut values, e, names, rng),
            _ => false,
        };
        if !placed {
            continue;
        }
        found.push(staircase(platform, &values.sample(platform.scheme(), 1)).0);
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

/// Puts the generic angles at a random point where the polynomial vanishes; false when this field has
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

/// An upper bound on the degree of a polynomial in one name.
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

/// Whether the polynomial takes both signs, or zero, on a grid of half tangents.
fn has_real_zero(e: &Expression, names: &[String]) -> bool {
    let steps: usize = if names.len() == 1 { 2001 } else { 61 };
    let tangent = |i: usize| {
        let half = std::f64::consts::FRAC_PI_2 * (2.0 * (i as f64 + 0.5) / steps as f64 - 1.0);
        if 2 * i + 1 == steps { 0.0 } else { half.tan() }
    };
    let (mut positive, mut negative) = (false, false);
    for i in 0..steps {
        for j in 0..if names.len() == 1 { 1 } else { steps } {
            let at = |n: &str| match names.iter().position(|m| n.strip_prefix("t_") == Some(m)) {
                Some(0) => tangent(i),
                Some(1) => tangent(j),
                // further names run along with the first two, at incommensurate steps
                Some(k) => tangent((i * (2 * k + 1) + j * (k + 1)) % steps),
                None => f64::NAN,
            };
            let v = evaluate_f64(e, &at);
            if v == 0.0 {
                return true;
            }
            positive |= v > 0.0;
            negative |= v < 0.0;
        }
    }
    positive && negative
}

fn describe(condition: &Condition) -> String {
    let text = match condition {
        Condition::HalfTurn(name) => return format!("{name} = 180"),
        Condition::Factor(text) => text,
    };
    let name = |text: &str| -> Option<String> {
        let name = text.strip_prefix("t_")?;
        name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_').then(|| name.to_string())
    };
    for (sign, degrees) in [("", 0), ("-1+", 90), ("1+", -90)] {
        if let Some(name) = text.strip_prefix(sign).and_then(name) {
            return format!("{name} = {degrees}");
        }
    }
    for (operator, sign) in [('-', ""), ('+', "-")] {
        if let Some((a, b)) = text.split_once(operator)
            && let (Some(a), Some(b)) = (name(a), name(b))
        {
            return format!("{a} = {sign}{b}");
        }
    }
    let mut shown = String::new();
    let mut rest = text.as_str();
    while let Some(start) = rest.find("t_") {
        let name_end = rest[start + 2..]
            .find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
            .map_or(rest.len(), |e| start + 2 + e);
        shown.push_str(&rest[..start]);
        shown.push_str(&format!("tan({}/2)", &rest[start + 2..name_end]));
        rest = &rest[name_end..];
    }
    format!("{shown}{rest} = 0")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_in_words() {
        let factor = |t: &str| describe(&Condition::Factor(t.into()));
        assert_eq!(factor("t_alpha"), "alpha = 0");
        assert_eq!(factor("-1+t_beta"), "beta = 90");
        assert_eq!(factor("1+t_beta"), "beta = -90");
        assert_eq!(factor("t_a-t_b"), "a = b");
        assert_eq!(factor("t_a+t_b"), "a = -b");
        assert_eq!(factor("-1+2*t_a*t_b+t_a^2"), "-1+2*tan(a/2)*tan(b/2)+tan(a/2)^2 = 0");
    }

    #[test]
    fn real_zeros() {
        let real = |t: &str| has_real_zero(&parse(t).expect("parses"), &["a".into(), "b".into()]);
        assert!(real("t_a-t_b") && real("t_a^2-2") && real("t_a^2+t_b^2"));
        assert!(!real("t_a^2+1") && !real("1+t_a^2*t_b^2"));
    }
}
