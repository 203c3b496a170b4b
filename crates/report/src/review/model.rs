//! Model as part of a review.

use obsdeg_core::degree::Status as Exact;
use obsdeg_core::system::{NumberOfSolutions, SystemAnalysis, SystemQuantity};
use obsdeg_design::review::ModelReview;
use obsdeg_evidence::simulation::Outcome;
use obsdeg_evidence::system::{SystemEstimate, SystemEvidence};

use super::{ERRORS, derivatives, is_list, pictures, section};
use crate::document::{Block, Grade, Status, StatusRow};
use crate::{Answer, words};

/// Verdict on a model: its limits, and the determined unknowns.
fn verdict(m: &ModelReview) -> String {
    let a = &m.analysis;
    let seen: Vec<_> = a.quantities.iter().filter(|q| q.status == Exact::Observable).collect();
    let worst = seen.iter().filter_map(|q| q.degree).max();
    let derivatives = worst.map_or_else(String::new, |k| {
        format!(", {}", derivatives(k, seen.iter().map(|q| (q.name.as_str(), q.degree))))
    });
    let what = match a.rests_on_bound {
        true => format!("no derivative up to order {}", a.last_order),
        false => "no output".into(),
    };
    let lost = match a.unobservable_directions {
        0 => "nothing is lost".to_string(),
        1 => format!("one direction changes {what}"),
        n => format!("{n} independent directions change {what}"),
    };
    let limits = limits(m);
    let whole = |e: &SystemEvidence| e.passed && e.not_resolvable == 0 && e.orders.measured == e.orders.of;
    let filter = match &m.evidence {
        Some(e) if whole(e) && limits.is_empty() => {
            " The information of a simulated run agrees with all verdicts."
        }
        Some(e) if e.passed => {
            " The information of a simulated run agrees with the verdicts as far as it shows them."
        }
        _ => "",
    };
    let lead = if limits.is_empty() { String::new() } else { format!("Limited: {}. ", limits.join("; ")) };
    format!(
        "{lead}{} of {} unknowns are observable{derivatives} ({}); {lost}.{filter}",
        seen.len(),
        a.quantities.len(),
        solutions(a)
    )
}

/// Sentence on the numbers of solutions of observable unknowns.
fn solutions(a: &SystemAnalysis) -> String {
    let seen: Vec<_> = a.quantities.iter().filter(|q| q.status == Exact::Observable).collect();
    let one = |q: &&&SystemQuantity| {
        matches!(
            q.number_of_solutions,
            Some(NumberOfSolutions::OneByExpression | NumberOfSolutions::Counted(1))
        )
    };
    match seen.iter().filter(one).count() {
        0 => "locally".into(),
        k if k == seen.len() => "each with one solution".into(),
        k => format!("{k} with one solution, the others locally"),
    }
}

/// Answer to the question whether the information of a run agrees with the verdicts.
fn evidence(m: &ModelReview) -> (Grade, String) {
    match &m.evidence {
        Some(e) if e.passed && e.not_resolvable > 0 => {
            (Grade::Good, format!("agree in all {} checks, {} not resolvable", e.checks, e.not_resolvable))
        }
        Some(e) if e.passed => (Grade::Good, format!("agree in all {} checks", e.checks)),
        Some(e) => (Grade::Limited, format!("DISAGREE in {} of {} checks", e.failures, e.checks)),
        None => (Grade::Open, "not taken".into()),
    }
}

/// Answer to the question whether the run of the filter is credible.
fn credible(m: &ModelReview) -> (Grade, String) {
    match m.run.as_ref().map(|r| &r.0.consistency) {
        None => (Grade::Open, "not run".into()),
        Some(c) if c.consistent => (Grade::Good, "consistent with its truth".into()),
        Some(c) => (Grade::Limited, format!("NOT consistent with its truth: {}", words::doubts(c))),
    }
}

/// Unknowns whose estimate in the run equals the prior.
fn by_prior(m: &ModelReview) -> Vec<&str> {
    let rests = |o: Outcome| matches!(o, Outcome::PriorOnly | Outcome::RestsOnPrior);
    let estimates = m.run.iter().flat_map(|(run, _)| &run.quantities);
    // an unknown without a status is a known start, which rests on nothing else
    let never = |e: &SystemEstimate| matches!(e.status, Some(Exact::Inseparable | Exact::NotExcited));
    let unknown = estimates.filter(|e| e.status.is_some() && (never(e) || rests(e.outcome)));
    unknown.map(|e| e.name.as_str()).collect()
}

/// Limits of the verdict.
fn limits(m: &ModelReview) -> Vec<String> {
    let mut out = Vec::new();
    match credible(m) {
        (Grade::Good, _) => {}
        (_, what) => out.push(format!("the filter is {what}")),
    }
    match evidence(m) {
        (Grade::Good, _) => {}
        (Grade::Limited | Grade::Missed, what) => {
            out.push(format!("the information of a run and the exact verdicts {what}"))
        }
        (Grade::Open, _) => out.push("no evidence by a run is taken".into()),
    }
    let prior = by_prior(m);
    if !prior.is_empty() {
        out.push(format!("the prior alone speaks for {}", words::names(prior)));
    }
    if m.analysis.rests_on_bound {
        out.push(format!("what is not observable rests on orders up to {}", m.analysis.bound));
    }
    out
}

/// Status of a model.
pub(super) fn status(m: &ModelReview) -> Status {
    let a = &m.analysis;
    let seen = a.quantities.iter().filter(|q| q.status == Exact::Observable).count();
    let row = |what, (grade, text)| StatusRow { what, grade, text };
    let every = if seen == a.quantities.len() { Grade::Good } else { Grade::Limited };
    let mut rows = vec![
        row("Observable", (every, format!("{seen} of {} unknowns: {}", a.quantities.len(), solutions(a)))),
        row("Filter, one run", credible(m)),
        row("Samples and exact verdicts", evidence(m)),
    ];
    let prior = by_prior(m);
    if !prior.is_empty() {
        rows.push(row("Resting on the prior", (Grade::Limited, words::names(prior))));
    }
    Status { title: a.name.clone(), rows, actions: super::actions::of_model(m) }
}

/// Part with verdict, unknowns, equations and evidence.
pub(super) fn part(blocks: &mut Vec<Block>, m: &ModelReview, level: usize, id: &str) {
    let a = &m.analysis;
    let document = a.document();
    blocks.push(section(level, "Verdict"));
    blocks.extend((!a.description.is_empty()).then(|| Block::Text(a.description.clone())));
    blocks.push(Block::Text(verdict(m)));
    blocks.push(section(level, "Unknowns and equations"));
    blocks.extend(document.blocks);
    blocks.push(pictures::model_staircase(a, &format!("{id}_staircase")));
    blocks.push(section(level, "Evidence by samples and a filter"));
    let refused = |e| Block::Text(format!("no run or no evidence: {e}."));
    blocks.extend(m.refused.as_ref().map(refused));
    if let Some(e) = &m.evidence {
        let document = e.document();
        blocks.extend(document.lead.into_iter().map(Block::Text));
        blocks.extend(document.blocks);
    }
    if let Some((run, traces)) = &m.run {
        let document = run.document();
        blocks.extend(document.blocks.into_iter().filter(|b| !is_list(b, "Assumed")));
        let flat: Vec<&str> = (run.quantities.iter())
            .filter(|e| e.status == Some(Exact::NotExcited) && e.outcome == Outcome::PriorOnly)
            .map(|e| e.name.as_str())
            .collect();
        let mut errors: Vec<Block> = pictures::errors(traces, &flat, id).into_iter().map(|e| e.1).collect();
        let rest = errors.split_off(errors.len().min(ERRORS));
        blocks.extend(errors);
        blocks.extend(pictures::not_drawn(&flat));
        blocks.extend(Block::details(level + 1, "Errors of all others", rest));
    }
}
