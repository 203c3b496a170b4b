//! Sensitivity of a scheme: settings, correlations, the fewest positions and the best schemes.

use obsdeg_design::design::Minimum;
use obsdeg_design::review::SchemeReview;
use obsdeg_evidence::compare::ComparedScheme;

use super::pictures;
use super::unknowns::left_out;
use crate::document::{DocumentBlock, left, number, right};
use crate::excess::Excess;
use crate::{compare, resolve, words};

pub(super) fn sensitivity(s: &SchemeReview, review: &ComparedScheme, id: &str) -> Vec<DocumentBlock> {
    let row = |c: &obsdeg_evidence::compare::Sensitivity| {
        vec![
            c.condition.clone(),
            compare::rank(c.rank, review.has_accuracy_orders),
            compare::worst(c.worst.as_ref()),
            compare::worst(c.worst_determined.as_ref()),
        ]
    };
    let mut out = vec![DocumentBlock::table(
        format!(
            "Rank, and largest {} in deg/h (per g): of all coefficients, of those determined here (- where one \
             is not observable)",
            if review.conditions.bench.is_some() { "total uncertainty with the bench" } else { "sigma" }
        ),
        [left("condition"), right("rank with dwell"), left("of all"), left("of those determined")],
        review.sensitivity.iter().map(row),
    )];
    out.extend(DocumentBlock::list_if_any(
        "Verdicts under the other carries",
        words::assumptions::carries(&s.analysis),
    ));
    out.extend(pictures::latitudes(s, &format!("{id}_latitude")));
    out
}

/// Absolute value from which a correlation of two estimates is listed, and the number of lines.
const CORRELATED: f64 = 0.9;

const LINES: usize = 6;

/// Strongest correlations, under a diffuse prior, of the estimates of unknowns that are determined.
pub(super) fn correlated(s: &SchemeReview) -> Option<DocumentBlock> {
    let of = &s.evidence.as_ref().ok()?.correlation;
    let determined = |name: &str| {
        let found = s.analysis.quantities.iter().find(|q| q.name == name);
        found.is_some_and(|q| q.degree.is_some())
    };
    let mut pairs: Vec<(f64, &str, &str)> = Vec::new();
    for (i, a) in of.names.iter().enumerate().filter(|(_, name)| determined(name)) {
        for (j, b) in of.names.iter().enumerate().take(i).filter(|(_, name)| determined(name)) {
            pairs.push((of.values[i][j], b, a));
        }
    }
    pairs.retain(|p| p.0.abs() >= CORRELATED);
    pairs.sort_by(|p, q| q.0.abs().total_cmp(&p.0.abs()));
    let more = pairs.len().saturating_sub(LINES);
    let mut lines: Vec<String> =
        pairs.iter().take(LINES).map(|(r, a, b)| format!("{a} and {b}: {r:.3}")).collect();
    lines.extend((more > 0).then(|| format!("{more} more pairs")));
    let title = format!(
        "Estimates that depend on each other (correlation of {CORRELATED} or more, with a diffuse prior)"
    );
    DocumentBlock::list_if_any(title, lines)
}

/// Sentence on the smallest number of cardinal attitudes that make every coefficient observable.
pub(super) fn fewest_of_all(s: &SchemeReview, review: &ComparedScheme) -> Option<String> {
    let all = s.alternatives.all.as_ref()?;
    Some(match (all.positions, all.never.is_empty()) {
        (Some(k), _) => format!(
            "to observe every coefficient takes at least {k} of the 24 cardinal attitudes under {} carry \
             (exhaustive search), for instance {}",
            review.carry,
            all.witness.join(", ")
        ),
        (None, false) => format!("no set of the 24 cardinal attitudes determines {}", all.never.join(", ")),
        // larger sets were not searched
        (None, true) => format!(
            "no set of {} of the 24 cardinal attitudes determines every coefficient",
            all.none_of.last()?[0]
        ),
    })
}

/// Fewest positions, the best scheme of the cardinal attitudes, and what each position is needed for.
pub(super) fn fewest(blocks: &mut Vec<DocumentBlock>, s: &SchemeReview, review: &ComparedScheme) {
    let mut lines = Vec::new();
    lines.extend(s.alternatives.kept.as_ref().map(|kept| fewest_of_these(kept, s, review)));
    lines.extend(fewest_of_all(s, review));
    lines.extend(best_of_all(s));
    lines.extend(resolve::position_to_drop(review));
    blocks.push(DocumentBlock::list("", lines));
    if !review.drop_one.is_empty() {
        blocks.push(without_one_position(review));
    }
}

/// Sentence on the fewest positions of the scheme that observe what it observes.
fn fewest_of_these(kept: &Minimum, s: &SchemeReview, review: &ComparedScheme) -> String {
    let required = &s.alternatives.required;
    match kept.positions {
        Some(k) if k == s.positions.len() => {
            // what slews determine besides is in the rows without one position
            let beside = match review.slews.is_empty() {
                true => "",
                false => "; what follows counts the slews too",
            };
            format!(
                "all {k} positions are needed to observe {} by repositioning at once{beside}",
                required.join(", ")
            )
        }
        Some(k) => format!(
            "{k} of the {} positions ({}) suffice to observe {}; whether they meet the requirements is \
             another question",
            s.positions.len(),
            kept.witness.join(", "),
            required.join(", ")
        ),
        None => "too many sets of positions to look for the fewest".into(),
    }
}

/// Sentence on the best scheme of cardinal attitudes at the dwell of this one, and on the bound of its
/// criterion.
fn best_of_all(s: &SchemeReview) -> Option<String> {
    let alternatives = &s.alternatives;
    let c = alternatives.certificate.as_ref()?;
    let same_dwell = |dwell_s: f64| s.positions.first().is_some_and(|p| p.dwell_s == dwell_s);
    let best = alternatives.front.iter().find(|f| same_dwell(f.dwell_s))?;
    let Excess { value, bound, percent } = Excess::new(best.value, c.best_possible, c.within_percent);
    Some(format!(
        "of {} of the 24 cardinal attitudes at {} s each none has a largest sigma of {} below {bound} \
         (optimal weights); the best found has {value}, at most {percent} above",
        alternatives.front_positions,
        number(best.dwell_s),
        alternatives.required.join(", "),
    ))
}

/// Table of the scheme without one of its positions.
fn without_one_position(review: &ComparedScheme) -> DocumentBlock {
    let row = |d: &obsdeg_evidence::compare::DropOne| {
        let lost = if d.lost.is_empty() { "-".into() } else { d.lost.join(" ") };
        vec![
            d.position.clone(),
            lost,
            compare::worst(d.worst.as_ref()),
            compare::requirements(&d.requirements),
        ]
    };
    let figure = match review.conditions.bench.is_some() {
        true => "worst total(D), with the bench [deg/h, /g]",
        false => "worst sigma(D) [deg/h, /g]",
    };
    let columns = ["without", "not observable any more", figure, compare::REQUIREMENTS[0]].map(left);
    let table = DocumentBlock::table("Without one position", columns, review.drop_one.iter().map(row));
    table.without(&left_out(review))
}
