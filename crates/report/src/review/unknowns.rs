//! Unknowns of a scheme: their verdicts and sigmas, the null space and the solving expressions.

use obsdeg_core::analysis::Analysis;
use obsdeg_evidence::compare::{ComparedQuantity, ComparedScheme};

use super::sections::joined;
use crate::analysis::null_vector;
use crate::document::{DocumentBlock, Typeset, left, optional, right};
use crate::{compare, latex, omitted, stated, words};

/// Largest number of rows of a table in the printed part of an appendix.
const PRINTED: usize = 14;

/// Effects of errors that the scheme does not estimate; with a bench also the budgets. Long tables are
/// details.
pub(super) fn not_estimated(review: &ComparedScheme) -> Vec<DocumentBlock> {
    let (effects, budgets) = omitted::in_full(&review.omitted);
    let long = |b: &DocumentBlock| matches!(b, DocumentBlock::Table { rows, .. } if rows.len() > PRINTED);
    let (long, mut out): (Vec<DocumentBlock>, Vec<DocumentBlock>) = effects.into_iter().partition(long);
    out.extend(DocumentBlock::details(3, "Every error that is not estimated", long));
    out.extend(DocumentBlock::details(3, "Uncertainty budgets, line by line", budgets));
    out
}

pub(super) fn unknowns(a: &Analysis, review: &ComparedScheme) -> DocumentBlock {
    let row = |q: &obsdeg_core::analysis::Quantity| {
        let predicted = review.quantities.iter().find(|p| p.name == q.name);
        let of = |value: fn(&ComparedQuantity) -> Option<f64>| optional(predicted.and_then(value));
        let excited = predicted.map_or_else(Vec::new, |p| {
            let names = review.positions.iter().zip(&p.excitation).filter(|(_, e)| **e > 1e-9);
            names.map(|(n, _)| n.as_str()).collect()
        });
        vec![
            q.name.clone(),
            predicted.map_or_else(|| q.unit.clone(), |p| p.unit.clone()),
            q.status.to_string(),
            words::degree(q.degree),
            words::accuracy_order(q.degree, q.accuracy_order, a.has_accuracy_orders),
            if q.partners.is_empty() { "-".into() } else { q.partners.join(" ") },
            of(|p| p.sigma),
            of(|p| p.total),
            of(|p| p.requirement),
            of(|p| p.margin),
            if excited.is_empty() { "-".into() } else { excited.join(" ") },
        ]
    };
    DocumentBlock::table(
        format!(
            "Every unknown, best first (- where it is not determined; {})",
            stated::predicted(&review.conditions)
        ),
        [
            left("unknown"),
            left("unit"),
            left("status"),
            right("degree"),
            right("accuracy order"),
            left("not told from"),
            right("predicted sigma"),
            right(TOTAL),
            right("required"),
            right("margin"),
            left("excited at"),
        ],
        a.quantities.iter().map(row),
    )
    .without(&left_out(review))
}

/// Title of the column of total uncertainties.
const TOTAL: &str = "total with the bench";

/// Columns that are empty without requirements or without a bench.
pub(super) fn left_out(review: &ComparedScheme) -> Vec<&'static str> {
    let required: &[&str] = if review.requirements.stated > 0 { &[] } else { &compare::REQUIREMENTS };
    let bench = review.conditions.bench.is_none().then_some(TOTAL);
    required.iter().copied().chain(bench).collect()
}

pub(super) fn null_space(blocks: &mut Vec<DocumentBlock>, a: &Analysis) {
    let mut lines = Vec::new();
    for v in &a.null_space {
        let names = joined(v.iter().map(|c| c.name.as_str()));
        let parts: Vec<String> = (v.iter())
            .map(|c| match &c.coefficient {
                Some(k) => format!("{} by {k}", c.name),
                None => c.name.clone(),
            })
            .collect();
        lines.push(match v.len() {
            1 => format!("no derivative of Z changes with {names}"),
            _ => format!("no derivative of Z changes when these change together: {}", parts.join(", ")),
        });
    }
    let silent = words::not_excited(a);
    if !silent.is_empty() {
        lines.push(format!("no position excites {}: each can take any value", silent.join(", ")));
    }
    if lines.is_empty() {
        lines.push("nothing: every unknown is observable by derivatives".into());
    }
    let seen: Vec<&str> = (a.quantities.iter())
        .filter(|q| q.degree.is_none() && q.accuracy_order.is_some())
        .map(|q| q.name.as_str())
        .collect();
    if !seen.is_empty() {
        lines.push(format!(
            "with dwell, during which psi moves, these are determined nonetheless: {}",
            seen.join(", ")
        ));
    }
    blocks.push(DocumentBlock::list("", lines));
    blocks.extend(DocumentBlock::formulas(words::UNSEEN, a.null_space.iter().map(|v| null_vector(v))));
    let combination = |c: &obsdeg_core::analysis::CombinationReport| {
        let asked = if c.requested { ", asked for" } else { "" };
        let dwell = match words::with_dwell(a, c.degree, c.accuracy_order) {
            same if same.is_empty() => same,
            other => format!(", with dwell {other}"),
        };
        let verdict = match c.degree {
            Some(k) => format!("degree {k}{dwell}{asked}"),
            None => format!("{}{dwell}{asked}", c.status),
        };
        Typeset {
            text: format!("{}: {verdict}", c.expression),
            latex: format!("{}\\quad\\text{{{verdict}}}", latex::expression(&c.expression)),
        }
    };
    blocks.extend(DocumentBlock::formulas(
        "Observable combinations",
        words::assumptions::combinations(a).map(combination),
    ));
}

/// Length in bytes from which a formula is one of many terms or decimals.
const LONG_FORMULA: usize = 220;

pub(super) fn solved(a: &Analysis) -> Vec<DocumentBlock> {
    let formula = |left: String, expression: &str, solution: &obsdeg_core::analysis::Solution| Typeset {
        text: format!("{expression} = {}", solution.text),
        latex: format!("{left} = {}", latex::solution(solution, a.frame, &a.stations)),
    };
    let unknowns = a.quantities.iter().filter_map(|q| {
        let solution = q.solution.as_ref()?;
        Some(formula(latex::symbol(&q.name), &q.name, solution))
    });
    let combinations = words::assumptions::combinations(a).filter_map(|c| {
        let solution = c.solution.as_ref()?;
        Some(formula(latex::expression(&c.expression), &c.expression, solution))
    });
    let is_long = |f: &Typeset| f.text.len() > LONG_FORMULA;
    let ((long, short), (long_sums, short_sums)): ((Vec<_>, Vec<_>), (Vec<_>, Vec<_>)) =
        (unknowns.partition(is_long), combinations.partition(is_long));
    let none = long.is_empty() && short.is_empty();
    let mut out: Vec<DocumentBlock> =
        Vec::from_iter(none.then(|| DocumentBlock::Text("No unknown is observable by itself.".into())));
    out.extend(DocumentBlock::formulas("Unknowns", short));
    out.extend(DocumentBlock::formulas("Combinations", short_sums));
    out.extend(DocumentBlock::list_if_any(words::ACCURACY, words::accuracy(a)));
    let long = DocumentBlock::formulas("Unknowns", long)
        .into_iter()
        .chain(DocumentBlock::formulas("Combinations", long_sums));
    out.extend(DocumentBlock::details(3, "Formulas of many terms or decimals", long.collect()));
    out
}
