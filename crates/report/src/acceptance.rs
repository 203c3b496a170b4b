//! Acceptance of coefficients within limits, before and after a run.

use obsdeg_evidence::acceptance::{AcceptanceLimit, AcceptanceReport, Decision};

use crate::document::{DocumentBlock, Grade, TableCell, estimate, left, number, optional, right, short};
use crate::words::names;

/// Decision in a word.
fn word(d: Decision) -> &'static str {
    match d {
        Decision::Accepted => "accepted",
        Decision::Rejected => "REJECTED",
        Decision::Undecided => "undecided",
    }
}

fn grade(d: Decision) -> Grade {
    match d {
        Decision::Accepted => Grade::Good,
        Decision::Rejected => Grade::Missed,
        Decision::Undecided => Grade::Limited,
    }
}

/// Table of the limits with their guard bands. Before a run estimate and decision are blank.
pub(crate) fn table(heading: &str, a: &AcceptanceReport) -> DocumentBlock {
    let filled = a.limits.iter().any(|l| l.decision.is_some());
    let uncertainty = if filled { "uncertainty" } else { "predicted uncertainty" };
    let columns = [
        left("coefficient"),
        left("unit"),
        left("limits"),
        right(uncertainty),
        left("accepted from, to"),
        left("rejected below, above"),
        right("estimate"),
        left("decision"),
    ];
    let ends = |of: Option<[f64; 2]>| {
        of.map_or_else(|| "none".into(), |[a, b]| format!("{}, {}", number(a), number(b)))
    };
    let row = |l: &AcceptanceLimit| -> Vec<TableCell> {
        let (value, decision) = match l.decision {
            Some(d) => {
                let why = if l.by_prior { " (prior alone)" } else { "" };
                (
                    estimate(l.estimate, l.uncertainty),
                    TableCell::graded(format!("{}{why}", word(d)), grade(d)),
                )
            }
            None if l.by_prior => (String::new(), TableCell::from("undecided (prior alone)")),
            None => (String::new(), TableCell::from("")),
        };
        let texts = [
            l.name.clone(),
            l.unit.clone(),
            ends(Some([l.low, l.high])),
            optional(l.uncertainty),
            ends(l.accepted),
            ends(l.rejected_beyond),
            value,
        ];
        texts.into_iter().map(TableCell::from).chain([decision]).collect()
    };
    DocumentBlock::table(heading, columns, a.limits.iter().map(row))
}

/// Rule of the decision, in sentences.
pub(crate) fn rule(a: &AcceptanceReport) -> Vec<String> {
    let percent = match short(100.0 * a.risk) {
        rounded if rounded == "0" => number(100.0 * a.risk),
        rounded => rounded,
    };
    vec![
        format!(
            "accepted: the estimate lies inside the limits by the guard band, so that the coefficient lies \
             outside them with a probability of at most {percent} % (JCGM 106:2012)"
        ),
        format!(
            "rejected: the estimate lies beyond a limit by the guard band; a coefficient within the limits is \
             rejected with a probability of at most {percent} %"
        ),
        "undecided between, without an estimate, for what priors alone bound, and after a calibration that is not \
         consistent"
            .into(),
    ]
}

/// Coefficients of which no estimate can be accepted, in a sentence; `None` without any.
pub(crate) fn impossible(a: &AcceptanceReport) -> Option<String> {
    let of = |why: &str, is: &dyn Fn(&&AcceptanceLimit) -> bool| {
        let none: Vec<&str> = a.limits.iter().filter(is).map(|l| l.name.as_str()).collect();
        (!none.is_empty()).then(|| format!("{} ({why})", names(none)))
    };
    let unknown = of("not determined", &|l| l.uncertainty.is_none() || l.by_prior);
    let narrow = of("limits too narrow for the uncertainty", &|l| {
        l.uncertainty.is_some() && !l.by_prior && l.accepted.is_none()
    });
    let all: Vec<String> = unknown.into_iter().chain(narrow).collect();
    (!all.is_empty()).then(|| format!("NO estimate can be accepted of {}", all.join("; ")))
}

/// Decisions in a sentence; `None` before a run.
pub(crate) fn sentence(a: &AcceptanceReport) -> Option<String> {
    let of = |d: Decision| -> Vec<&str> {
        a.limits.iter().filter(|l| l.decision == Some(d)).map(|l| l.name.as_str()).collect()
    };
    let [accepted, rejected, undecided] =
        [of(Decision::Accepted), of(Decision::Rejected), of(Decision::Undecided)];
    let all = a.limits.len();
    if accepted.len() + rejected.len() + undecided.len() == 0 {
        return None;
    }
    if accepted.len() == all {
        return Some(format!("every coefficient with limits is accepted, {all} of {all}"));
    }
    if !a.valid {
        return Some("no coefficient is accepted or rejected: the calibration is not consistent".into());
    }
    let mut parts = vec![format!("{} of {all} accepted", accepted.len())];
    if !rejected.is_empty() {
        parts.push(format!("REJECTED: {}", names(rejected)));
    }
    if !undecided.is_empty() {
        parts.push(format!("undecided: {}", names(undecided)));
    }
    Some(format!("acceptance: {}", parts.join("; ")))
}
