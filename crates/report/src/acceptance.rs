//! Acceptance of coefficients within limits, before and after a run.

use obsdeg_evidence::acceptance::{AcceptanceLimit, AcceptanceReport, Decision};

use crate::document::{Block, Cell, Grade, estimate, left, number, optional, right, short};
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
pub(crate) fn table(a: &AcceptanceReport) -> Block {
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
    let row = |l: &AcceptanceLimit| -> Vec<Cell> {
        let (value, decision) = match l.decision {
            Some(d) => (estimate(l.estimate, l.uncertainty), Cell::graded(word(d), grade(d))),
            None => (String::new(), Cell::from("")),
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
        texts.into_iter().map(Cell::from).chain([decision]).collect()
    };
    Block::table("Acceptance", columns, a.limits.iter().map(row))
}

/// Rule of the decision, in sentences.
pub(crate) fn rule(a: &AcceptanceReport) -> Vec<String> {
    let percent = short(100.0 * a.risk);
    vec![
        format!(
            "accepted: the estimate lies inside the limits by the guard band, so that the coefficient lies \
             outside them with a probability of at most {percent} % (JCGM 106:2012)"
        ),
        format!(
            "rejected: the estimate lies beyond a limit by the guard band; a coefficient within the limits is \
             rejected with a probability of at most {percent} %"
        ),
        "undecided between, without an estimate, and after a calibration that is not consistent".into(),
    ]
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
