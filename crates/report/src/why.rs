//! Explanations of single verdicts.

use obsdeg_core::degree::Status;
use obsdeg_core::remedies::Change;
use obsdeg_core::why::{Assumption, AssumptionKind, Improvement, OutputDerivative, UnseenDirection, Why};
use serde::Serialize;

use crate::document::{DocumentBlock, left, right};
use crate::resolve::changes;
use crate::words::{self, names};

/// Blocks of all explanations.
pub(crate) fn blocks(all: &[Why]) -> Vec<DocumentBlock> {
    all.iter().flat_map(of).collect()
}

fn of(why: &Why) -> Vec<DocumentBlock> {
    let Explanation { heading, lines, improvements, columns, rows, no_change } = Explanation::new(why);
    let [change, degree, more, loses] = columns;
    let columns = [left(change), right(degree), left(more), left(loses)];
    let improvements = match rows.is_empty() {
        true => DocumentBlock::list(improvements, vec![no_change.into()]),
        false => DocumentBlock::table(improvements, columns, rows.into_iter().map(Vec::from)),
    };
    vec![DocumentBlock::list(heading, lines), improvements]
}

/// Explanation of one verdict in words.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Explanation {
    /// Verdict as a heading: `Why D_FZ is not observable`.
    pub heading: String,
    /// Deciding derivatives, the unobserved direction, assumptions, and parts that are missing: one sentence
    /// each, without a full stop.
    pub lines: Vec<String>,
    /// Heading of the changes.
    pub improvements: String,
    /// Headings of the columns of `rows`.
    pub columns: [&'static str; 4],
    /// Changes that make the unknown observable or lower its degree, in order of cost: the change, the
    /// degree with it, other unknowns that become observable, unknowns that cease to be.
    pub rows: Vec<[String; 4]>,
    /// Reason why there are no `rows`; empty if there are some.
    pub no_change: &'static str,
}

impl Explanation {
    pub(crate) fn new(why: &Why) -> Self {
        let mut lines = Vec::new();
        let decided = why.determined_by.iter().map(derivative).collect::<Vec<_>>();
        if !decided.is_empty() {
            let words = match decided.len() {
                1 => "determines it",
                _ => "determine it; without any one of these they do not",
            };
            lines.push(format!("{} {words}", decided.join(", ")));
        }
        lines.extend(why.unseen.as_ref().map(|u| unseen(&why.name, u)));
        lines.extend(why.symmetries.iter().map(|words| format!("no output changes with this: {words}")));
        lines.extend(assumptions(&why.assumptions, why.degree));
        lines.extend(why.not_explained.iter().map(|text| format!("not tried: {text}")));
        let improvements = match why.degree {
            Some(_) => format!("What lowers the degree of {}, in order of cost", why.name),
            None => format!("What makes {} observable, in order of cost", why.name),
        };
        let rows: Vec<_> = groups(&why.remedies).iter().map(|group| row(group)).collect();
        let no_change = match why.degree {
            _ if !rows.is_empty() => "",
            Some(0) => "nothing has to: the outputs themselves determine it",
            _ => "no change that was tried",
        };
        let columns = ["change", "degree", "makes observable as well", "loses"];
        Self { heading: heading(why), lines, improvements, columns, rows, no_change }
    }
}

fn heading(why: &Why) -> String {
    let verdict = match (why.status, why.degree) {
        (_, Some(degree)) => format!("has degree {degree}"),
        (Status::NotSeen, _) => "is not resolved".into(),
        (Status::NotExcited, _) => "is not excited".into(),
        _ => "is not observable".into(),
    };
    format!("Why {} {verdict}", why.name)
}

/// Derivative as text: `Z1''@p1`, `y^(4) (segment 2)`.
fn derivative(d: &OutputDerivative) -> String {
    let order = match d.order {
        k @ 0..=3 => "'".repeat(k),
        k => format!("^({k})"),
    };
    match &d.place {
        Some(place) if place.contains(' ') => format!("{}{order} ({place})", d.output),
        Some(place) => format!("{}{order}@{place}", d.output),
        None => format!("{}{order}", d.output),
    }
}

fn unseen(name: &str, u: &UnseenDirection) -> String {
    let what = match &u.components[..] {
        [_] => format!("a change of {name} alone changes"),
        all if all.iter().all(|c| c.coefficient.is_some()) => {
            format!("a change along {} changes", words::null_vector(all))
        }
        all => format!("a joint change of {} changes", names(all.iter().map(|c| c.name.as_str()))),
    };
    if u.at_every_order {
        return format!("{what} no derivative of the outputs of any order");
    }
    let seen = match &u.seen_by[..] {
        [] => String::new(),
        seen => {
            let does = if seen.len() == 1 { "does" } else { "do" };
            format!(", but {} {does}", seen.iter().map(derivative).collect::<Vec<_>>().join(", "))
        }
    };
    match u.up_to_order {
        0 => format!("{what} no output itself{seen}"),
        k => format!("{what} no derivative up to order {k}{seen}"),
    }
}

fn assumption(a: &Assumption) -> String {
    match a.kind {
        AssumptionKind::Carry => format!("{} carry", a.stated),
        AssumptionKind::Latitude if a.stated.ends_with("deg") => format!("the latitude {}", a.stated),
        AssumptionKind::Latitude => "the generic latitude".into(),
        AssumptionKind::Angles => "the angles".into(),
        AssumptionKind::Azimuth => "the measured azimuth".into(),
        AssumptionKind::Position => format!("the position {}", a.stated),
        AssumptionKind::Output => format!("the output {}", a.stated),
        AssumptionKind::KnownStart => format!("the known start of {}", a.stated),
        AssumptionKind::KnownConstant => format!("the known constant {}", a.stated),
        AssumptionKind::KnownInput => format!("the known input {}", a.stated),
        AssumptionKind::Constraint => format!("the constraint {}", a.stated),
    }
}

/// Deciding assumptions, one line each; then the others in one line.
fn assumptions(all: &[Assumption], degree: Option<usize>) -> Vec<String> {
    let verdict = |degree: Option<usize>| match degree {
        Some(k) => format!("degree {k}"),
        None => "not observable".into(),
    };
    let (deciding, others): (Vec<&Assumption>, Vec<&Assumption>) = all.iter().partition(|a| a.decides);
    let line = |a: &&Assumption| {
        let differs = a.otherwise.iter().filter(|o| o.degree != degree);
        let other = differs.map(|o| format!("{}: {}", o.condition, verdict(o.degree)));
        format!("it rests on {} ({})", assumption(a), other.collect::<Vec<_>>().join("; "))
    };
    let mut out: Vec<String> = deciding.iter().map(line).collect();
    if !others.is_empty() {
        let list: Vec<String> = others.iter().map(|a| assumption(a)).collect();
        out.push(format!("it does not rest on {}", names(list.iter().map(String::as_str))));
    }
    out
}

/// Improvements grouped by kind and effect.
fn groups(all: &[Improvement]) -> Vec<Vec<&Improvement>> {
    let kind = |i: &Improvement| match i.changes[..] {
        [Change::Known { .. }] => Some(0),
        [Change::Attitude { .. }] => Some(1),
        [Change::Output { .. }] => Some(2),
        _ => None,
    };
    let same = |a: &Improvement, b: &Improvement| {
        kind(a).is_some()
            && kind(a) == kind(b)
            && (a.degree, &a.resolves, &a.loses) == (b.degree, &b.resolves, &b.loses)
    };
    let mut out: Vec<Vec<&Improvement>> = Vec::new();
    for one in all {
        match out.iter_mut().find(|group| same(group[0], one)) {
            Some(group) => group.push(one),
            None => out.push(vec![one]),
        }
    }
    out
}

fn row(group: &[&Improvement]) -> [String; 4] {
    let first = group[0];
    let several: Vec<&str> = group
        .iter()
        .filter_map(|i| match &i.changes[..] {
            [Change::Known { name }] => Some(name.as_str()),
            [Change::Attitude { attitude, .. }] => Some(attitude.as_str()),
            [Change::Output { state }] => Some(state.as_str()),
            _ => None,
        })
        .collect();
    let change = match (&first.changes[..], several.len()) {
        (_, 0 | 1) => changes(&first.changes),
        ([Change::Known { .. }], _) => format!("know one of {}", names(several)),
        ([Change::Attitude { .. }], _) => format!("add a position, one of {}", names(several)),
        _ => format!("measure one of {}", names(several)),
    };
    let resolves = names(first.resolves.iter().map(|r| r.name.as_str()));
    let loses = names(first.loses.iter().map(String::as_str));
    [change, words::degree(Some(first.degree)), resolves, loses]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_in_words() {
        let of = |order, place: Option<&str>| {
            derivative(&OutputDerivative { output: "y".into(), order, place: place.map(Into::into) })
        };
        assert_eq!(of(0, None), "y");
        assert_eq!(of(2, Some("p1")), "y''@p1");
        assert_eq!(of(4, Some("segment 2")), "y^(4) (segment 2)");
    }
}
