//! Evidence for a scheme: slopes of the filter, and a simulated run.

use obsdeg_core::degree::Status;
use obsdeg_design::review::SchemeReview;
use obsdeg_evidence::compare::ComparedScheme;
use obsdeg_evidence::simulation::Outcome;

use super::pictures;
use super::sections::is_list;
use crate::Answer;
use crate::document::{Document, DocumentBlock, TableCell};
use crate::words;

/// Largest number of pictures of slopes, one for each unit, in the printed part of an appendix.
const SLOPES: usize = 4;

/// Evidence: a line per kind of check that agrees, and the rows of those that do not.
pub(super) fn evidence_of(s: &SchemeReview, id: &str) -> Vec<DocumentBlock> {
    let c = match &s.evidence {
        Ok(c) => c,
        Err(e) => return vec![DocumentBlock::Text(format!("None: {}.", words::run::no_evidence(e)))],
    };
    let outcome = match (c.passed, c.verdicts_agree) {
        (true, _) if c.counts.not_resolvable > 0 => "agree in every check that is resolvable",
        (true, _) => "agree in every check",
        (false, true) => "agree, but the Monte Carlo runs do NOT fit the filter, as listed below",
        (false, false) => "DISAGREE, as listed below",
    };
    // the run has the truth of the checks
    let run = if s.simulation.consistency.consistent { "" } else { ", but the run below is not consistent" };
    let mut out = vec![DocumentBlock::Text(format!(
        "Exact verdicts and a Kalman filter are two independent paths: they {outcome}{run}."
    ))];
    let Document { lead, blocks, .. } = c.document();
    out.extend(lead.into_iter().map(DocumentBlock::Text));
    let (mut agree, mut open, mut details) = (Vec::new(), Vec::new(), Vec::new());
    for block in blocks {
        match block {
            DocumentBlock::Table { heading, columns, rows } => {
                let fails = |row: &&Vec<TableCell>| {
                    row.iter().any(|c| c.text == "FAIL" || c.text == "not resolvable")
                };
                let failing: Vec<Vec<TableCell>> = rows.iter().filter(fails).cloned().collect();
                agree.push(format!("{heading}: {} of {} agree", rows.len() - failing.len(), rows.len()));
                if !failing.is_empty() {
                    open.push(DocumentBlock::Table {
                        heading: format!("Not agreeing: {heading}"),
                        columns: columns.clone(),
                        rows: failing,
                    });
                }
                details.push(DocumentBlock::Table { heading, columns, rows });
            }
            b if is_list(&b, "Assumed") || is_list(&b, "Validity of the small-angle model") => {}
            b if is_list(&b, "What disagrees") || is_list(&b, "Not resolvable, and why") => open.push(b),
            b => details.push(b),
        }
    }
    out.push(DocumentBlock::list("Checks", agree));
    out.extend(open);
    let mut slopes = pictures::slopes(c, id);
    let more = slopes.split_off(slopes.len().min(SLOPES));
    out.extend(slopes);
    out.extend(pictures::consistency(c, id));
    details.extend(more);
    details.push(pictures::correlation(c, &format!("{id}_correlation")));
    out.extend(DocumentBlock::details(3, "Every check", details));
    out
}

/// Number of pictures of errors in the printed part of an appendix.
pub(super) const ERRORS: usize = 6;

/// One run against a simulated truth: its lists, the errors of the worst unknowns, and in the details all.
pub(super) fn run(s: &SchemeReview, review: &ComparedScheme, id: &str) -> Vec<DocumentBlock> {
    let blocks = s.simulation.document().blocks.into_iter();
    let kept = |b: &DocumentBlock| {
        matches!(b, DocumentBlock::Table { .. } | DocumentBlock::List { .. })
            && !["Assumed", "Validity of the small-angle model"].iter().any(|name| is_list(b, name))
            && !matches!(b, DocumentBlock::List { heading, .. } if heading.starts_with("Not estimated"))
    };
    // the unknowns' table has the predicted sigmas, and a page has no room for more columns
    let blocks = blocks.filter(kept).map(|b| b.without(&["predicted"]));
    let (mut details, mut out): (Vec<DocumentBlock>, Vec<DocumentBlock>) =
        blocks.partition(|b| matches!(b, DocumentBlock::Table { .. }));
    out.insert(0, DocumentBlock::Text("One run against a simulated truth, with its errors:".into()));
    let flat: Vec<&str> = (s.simulation.quantities.iter())
        .filter(|q| q.status == Status::NotExcited && q.outcome == Outcome::PriorOnly)
        .map(|q| q.name.as_str())
        .collect();
    let margin = |name: &str| review.quantities.iter().find(|q| q.name == name).and_then(|q| q.margin);
    let mut errors = pictures::errors(&s.traces, &flat, id);
    errors.sort_by(|(a, _), (b, _)| {
        margin(a).unwrap_or(f64::INFINITY).total_cmp(&margin(b).unwrap_or(f64::INFINITY))
    });
    let mut pictures: Vec<DocumentBlock> = errors.into_iter().map(|(_, picture)| picture).collect();
    let rest = pictures.split_off(pictures.len().min(ERRORS));
    out.extend(pictures);
    out.extend(pictures::not_drawn(&flat));
    details.extend(rest);
    out.extend(DocumentBlock::details(3, "Estimates at the end, and the errors of all others", details));
    out
}
