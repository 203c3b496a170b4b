//! Beginning of a review: every unknown in one picture and the actions; for several schemes the comparison
//! and the recommended scheme.

use obsdeg_core::degree::Status;
use obsdeg_core::system::SystemAnalysis;
use obsdeg_design::review::{DesignReview, GenericReview, SchemeReview};
use obsdeg_evidence::compare::{ComparedQuantity, ComparedScheme};
use obsdeg_evidence::requirements::Requirements;

use super::pictures::still;
use super::sections::{duration, joined};
use crate::compare::{deciding, unknowns};
use crate::document::{DocumentBlock, Grade, StatusBox, StatusRow, TableCell, left, number};
use crate::rows::{Chart, ChartRow};
use crate::{compare, stated, words};

/// Largest number of rows of a chart, so that it fits a page.
const ROWS: usize = 24;

/// Outcome of one requirement, in words.
fn margin(q: &ComparedQuantity) -> (String, Grade) {
    match (q.requirement, q.margin, deciding(q)) {
        (Some(required), Some(m), Some(found)) if found <= required => {
            (format!("{} met", number(m)), Grade::Good)
        }
        (Some(_), Some(m), _) => (format!("{} MISSED", number(m)), Grade::Missed),
        (_, _, None) => {
            ("not determined".into(), if q.requirement.is_some() { Grade::Missed } else { Grade::Open })
        }
        (None, _, Some(_)) => ("nothing required".into(), Grade::Open),
        (Some(_), None, Some(_)) => ("no number".into(), Grade::Missed),
    }
}

/// Picture of a chart; `all` is the number of rows before it was cut.
fn chart(name: &str, caption: String, chart: Chart, all: usize) -> DocumentBlock {
    let shown = chart.rows.len();
    let part = if all > shown { format!(" ({shown} of {all})") } else { String::new() };
    still(name, format!("{caption}{part}"), chart.svg())
}

/// Largest number of rows of the chart on the first page.
const FIRST: usize = 20;

/// The worst rows, in the order of all; `worse` has the larger number for the worse row.
fn worst_rows<T>(all: Vec<T>, worse: impl Fn(&T) -> f64) -> Vec<T> {
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|&a, &b| worse(&all[b]).total_cmp(&worse(&all[a])));
    order.truncate(FIRST);
    all.into_iter().enumerate().filter(|(i, _)| order.contains(i)).map(|(_, row)| row).collect()
}

/// Degree and margin of every unknown of a scheme, best first, of many the smallest margins; degrees alone
/// without requirements.
pub(super) fn margins(s: &SchemeReview, review: &ComparedScheme, id: &str) -> DocumentBlock {
    let all = &s.analysis.quantities;
    if review.requirements.stated == 0 {
        return degrees(all.iter().map(|q| (q.name.as_str(), q.status, q.degree)), all.len(), id);
    }
    let row = |q: &obsdeg_core::analysis::Quantity| {
        let predicted = review.quantities.iter().find(|p| p.name == q.name);
        let (text, grade) = predicted.map_or_else(|| ("-".into(), Grade::Open), margin);
        let row = ChartRow {
            name: q.name.clone(),
            remark: words::degree(q.degree),
            marks: vec![predicted.and_then(|p| p.margin)],
            limit: None,
            text,
            grade,
        };
        (row, predicted.is_some_and(|p| p.requirement.is_some()))
    };
    // what is required and not determined first, then by margin, then what is not required
    let worse = |(row, required): &(ChartRow, bool)| match (required, row.marks[0]) {
        (true, None) => f64::INFINITY,
        (true, Some(margin)) => 1.0 / margin,
        (false, _) => -1.0,
    };
    let picture = Chart {
        remark: "degree",
        label: match review.conditions.bench {
            Some(_) => "margin: required over total".into(),
            None => "margin: required over predicted sigma".into(),
        },
        orders: false,
        threshold: Some(1.0),
        series: Vec::new(),
        rows: worst_rows(all.iter().map(row).collect(), worse).into_iter().map(|r| r.0).collect(),
    };
    let caption = "Unknowns with their degree and their margin: to the right of 1 a requirement is met by \
                   prediction, and a ring is missed"
        .to_string();
    chart(&format!("{id}_margins"), caption, picture, all.len())
}

/// Chart of the degrees alone, of many unknowns the largest.
fn degrees<'a>(
    all: impl Iterator<Item = (&'a str, Status, Option<usize>)>,
    count: usize,
    id: &str,
) -> DocumentBlock {
    let row = |(name, status, degree): (&str, Status, Option<usize>)| ChartRow {
        name: name.into(),
        remark: words::degree(degree),
        marks: vec![degree.map(|k| k as f64)],
        limit: None,
        text: status.to_string(),
        grade: if degree.is_some() { Grade::Good } else { Grade::Limited },
    };
    let picture = Chart {
        remark: "degree",
        label: "degree: order of derivatives".into(),
        orders: true,
        threshold: None,
        series: Vec::new(),
        rows: worst_rows(all.map(row).collect(), |row| row.marks[0].unwrap_or(f64::INFINITY)),
    };
    let caption =
        "Unknowns with their degree, the order of derivatives that their solution needs".to_string();
    chart(&format!("{id}_degrees"), caption, picture, count)
}

pub(super) fn model_degrees(a: &SystemAnalysis, id: &str) -> DocumentBlock {
    degrees(a.quantities.iter().map(|q| (q.name.as_str(), q.status, q.degree)), a.quantities.len(), id)
}

pub(super) fn generic_degrees(g: &GenericReview, id: &str) -> DocumentBlock {
    let all = &g.analysis.quantities;
    degrees(all.iter().map(|q| (q.name.as_str(), q.status, q.degree)), all.len(), id)
}

/// Answer to the question whether the compared schemes have the same conditions.
fn like_with_like(r: &DesignReview) -> StatusRow {
    let totals = || r.comparison.schemes.iter().map(|s| s.total_s);
    let (least, most) = totals().fold((f64::MAX, f64::MIN), |(l, h), t| (l.min(t), h.max(t)));
    let time = match least == most {
        true => format!("all take {}", duration(least)),
        false => format!("they take {} to {}", duration(least), duration(most)),
    };
    let (grade, text) = match r.comparison.differ.is_empty() {
        true => (Grade::Good, format!("same conditions, unknowns and requirements; {time}")),
        false => {
            (Grade::Limited, format!("the schemes differ in {}; {time}", r.comparison.differ.join(", ")))
        }
    };
    StatusRow { what: "Like with like", grade, text }
}

/// Recommended scheme, and the reason.
fn recommended(r: &DesignReview) -> StatusRow {
    let (grade, text) = choice(r);
    StatusRow { what: "Recommended", grade, text }
}

/// Sentence on the unknowns of each scheme that others lack.
fn estimated_besides(schemes: &[ComparedScheme]) -> String {
    let has = |s: &ComparedScheme, name: &str| s.quantities.iter().any(|q| q.name == name);
    let besides = |s: &ComparedScheme| {
        let own = s.quantities.iter().map(|q| q.name.as_str());
        // every position has a psi of its own under reset carry
        let own: Vec<&str> = own
            .filter(|name| !name.starts_with("psi") && schemes.iter().any(|other| !has(other, name)))
            .collect();
        (!own.is_empty()).then(|| format!("{} estimates {}", s.name, words::names(own)))
    };
    let listed: Vec<String> = schemes.iter().filter_map(besides).collect();
    if listed.is_empty() { listed.concat() } else { format!("; not in all: {}", listed.join("; ")) }
}

/// The most accurate and the shortest scheme, between which no stated requirement decides.
fn without_requirements(schemes: &[ComparedScheme]) -> String {
    let sigma = |s: &ComparedScheme| s.worst.as_ref().map_or(f64::INFINITY, |w| w.sigma_dph);
    let accurate = schemes.iter().min_by(|a, b| sigma(a).total_cmp(&sigma(b)));
    let accurate = accurate.and_then(|s| Some((s, s.worst.as_ref()?)));
    let accurate = accurate.map_or_else(
        || "no scheme determines every coefficient".into(),
        |(s, w)| {
            format!(
                "most accurate {} ({} {})",
                s.name,
                stated::worst(&s.requirements),
                stated::worst_sigma(w)
            )
        },
    );
    let all = schemes.iter().any(|s| s.worst.is_some());
    let shortest =
        (schemes.iter().filter(|s| s.worst.is_some() == all)).min_by(|a, b| a.total_s.total_cmp(&b.total_s));
    let shortest = shortest.map_or_else(String::new, |s| {
        let determined = if all { " that determines every coefficient" } else { "" };
        format!("; shortest{determined} {} ({})", s.name, duration(s.total_s))
    });
    format!(
        "none: no requirement says what is good enough. State requirements of every scheme; until then \
         accuracy and time decide: {accurate}{shortest}"
    )
}

/// The recommended scheme of several with the same conditions. Schemes that differ in nothing but their
/// unknowns are judged by the requirements of each.
fn choice(r: &DesignReview) -> (Grade, String) {
    let schemes = &r.comparison.schemes;
    let unlike: Vec<&str> =
        r.comparison.differ.iter().map(String::as_str).filter(|of| *of != "unknowns").collect();
    if !unlike.is_empty() {
        let differ = r.comparison.differ.join(", ");
        return (
            Grade::Open,
            format!(
                "none: schemes that differ in {differ} are answers to different questions. Give them the \
                 same {}{}",
                unlike.join(", "),
                estimated_besides(schemes)
            ),
        );
    }
    if schemes.iter().any(|s| s.requirements.stated == 0) {
        return (Grade::Open, without_requirements(schemes));
    }
    let (grade, text) = by_requirements(r);
    (grade, format!("{text}{}", estimated_besides(schemes)))
}

fn by_requirements(r: &DesignReview) -> (Grade, String) {
    let schemes = &r.comparison.schemes;
    let worst = |s: &ComparedScheme| s.requirements.worst.as_ref().map_or(0.0, |w| w.margin);
    let meeting: Vec<usize> = (0..schemes.len()).filter(|&i| schemes[i].requirements.all_met()).collect();
    let best = meeting.iter().copied().min_by(|&i, &k| {
        let (a, b) = (&schemes[i], &schemes[k]);
        a.total_s.total_cmp(&b.total_s).then(worst(b).total_cmp(&worst(a)))
    });
    if let Some(best) = best {
        let s = &schemes[best];
        let as_short = meeting.iter().filter(|&&i| schemes[i].total_s == s.total_s).count();
        let why = match (meeting.len(), as_short) {
            (1, _) => "the only one that meets every requirement by prediction".to_string(),
            (n, 1) => format!(
                "the shortest of {n} that meet every requirement by prediction, {}",
                duration(s.total_s)
            ),
            (n, k) => format!(
                "of {n} that meet every requirement by prediction, {k} of them equally short, the one with \
                 the largest worst margin"
            ),
        };
        let doubts = doubts(&r.schemes[best]);
        let grade = if doubts.is_empty() { Grade::Good } else { Grade::Limited };
        let doubts = if doubts.is_empty() { doubts } else { format!("; but {doubts}") };
        return (grade, format!("{}: {why}{doubts}", s.name));
    }
    let missed = |s: &ComparedScheme| s.requirements.missed.len();
    let fewest = schemes.iter().map(missed).min().unwrap_or(0);
    let nearest = schemes.iter().filter(|s| missed(s) == fewest);
    let names = joined(nearest.map(|s| s.name.as_str()));
    (
        Grade::Missed,
        format!(
            "none: no scheme meets every requirement by prediction; fewest are missed by {names} ({fewest})"
        ),
    )
}

/// Reasons against a scheme that meets its requirements by prediction.
fn doubts(s: &SchemeReview) -> String {
    let run = &s.simulation;
    let found = [
        (run.run.requirements.any_missed(), "its run misses some"),
        (!run.validity.holds, "the small-angle model does not hold at its drifts"),
        (!run.consistency.consistent, "its run is not consistent with its truth"),
        (s.evidence.as_ref().is_ok_and(|e| !e.passed), "checks of the filter fail"),
    ];
    joined(found.into_iter().filter(|f| f.0).map(|f| f.1))
}

/// Comparison on one page: recommendation, schemes as columns, sigmas as a picture.
pub(super) fn comparison(blocks: &mut Vec<DocumentBlock>, r: &DesignReview, answers: Vec<DocumentBlock>) {
    let title = format!("Comparison of {} schemes", r.schemes.len());
    blocks.push(DocumentBlock::Status(vec![StatusBox {
        title,
        rows: vec![recommended(r), like_with_like(r)],
        actions: vec![],
    }]));
    blocks.extend(answers);
    blocks.push(matrix(&r.comparison.schemes));
    blocks.push(sigmas(&r.comparison.schemes));
}

/// `15 of 15 met`, `3 of 15 MISSED`.
fn kept(r: &Requirements) -> String {
    match (r.stated, r.all_met()) {
        (0, _) => "none".into(),
        (n, true) => format!("{} of {n} met", r.met),
        (n, false) => format!("{} of {n} MISSED", r.missed.len()),
    }
}

/// Schemes as columns: positions, rank, requirements, and the margin of every unknown.
fn matrix(schemes: &[ComparedScheme]) -> DocumentBlock {
    let mut columns = vec![left("")];
    columns.extend(schemes.iter().map(|s| left(s.name.clone())));
    let line = |name: &str, cell: &dyn Fn(&ComparedScheme) -> TableCell| -> Vec<TableCell> {
        std::iter::once(name.into()).chain(schemes.iter().map(cell)).collect()
    };
    let mut rows = vec![
        line("positions", &|s| s.positions.len().to_string().into()),
        line("rank with dwell", &|s| {
            let grade = if s.rank[0] == s.rank[1] { Grade::Good } else { Grade::Limited };
            TableCell::graded(compare::rank(s.rank, s.has_accuracy_orders), grade)
        }),
        line("requirements", &|s| {
            let grade = match (s.requirements.stated, s.requirements.all_met()) {
                (0, _) => Grade::Open,
                (_, true) => Grade::Good,
                (_, false) => Grade::Missed,
            };
            TableCell::graded(kept(&s.requirements), grade)
        }),
    ];
    let judged = schemes.iter().any(|s| s.requirements.stated > 0);
    for of in unknowns(schemes).into_iter().filter(|_| judged) {
        rows.push(line(&of.name, &|s| match s.quantities.iter().find(|q| q.name == of.name) {
            None => "no unknown".into(),
            Some(q) => {
                let (text, grade) = margin(q);
                TableCell::graded(text, grade)
            }
        }));
    }
    let heading = if judged {
        "Margins (required over predicted sigma, with a bench over the total: 1 or more is met)"
    } else {
        "Side by side"
    };
    DocumentBlock::table(heading, columns, rows)
}

/// Sigma of every unknown in every scheme, with the requirement if all schemes have the same.
fn sigmas(schemes: &[ComparedScheme]) -> DocumentBlock {
    let all = unknowns(schemes);
    let bench = schemes.iter().any(|s| s.conditions.bench.is_some());
    let of = |s: &ComparedScheme, name: &str| s.quantities.iter().find(|q| q.name == name).cloned();
    let row = |q: &&ComparedQuantity| {
        let required = || schemes.iter().filter_map(|s| of(s, &q.name)).map(|q| q.requirement);
        let same = required().all(|r| r == q.requirement);
        ChartRow {
            name: q.name.clone(),
            remark: q.unit.clone(),
            marks: schemes.iter().map(|s| of(s, &q.name).as_ref().and_then(deciding)).collect(),
            limit: q.requirement.filter(|_| same),
            text: String::new(),
            grade: Grade::Open,
        }
    };
    let picture = Chart {
        remark: "unit",
        label: if bench { "sigma or total" } else { "predicted sigma" }.into(),
        orders: false,
        threshold: None,
        series: schemes.iter().map(|s| s.name.clone()).collect(),
        rows: all.iter().take(ROWS).map(row).collect(),
    };
    let what = if bench { "Predicted sigma, of schemes with a bench the total," } else { "Predicted sigma" };
    let caption = format!(
        "{what} of every unknown in each scheme; a stroke: what all of them require; no mark: not determined"
    );
    chart("comparison_sigmas", caption, picture, all.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_margin_is_met_or_missed_by_what_decides_requirements() {
        let q = |requirement: Option<f64>, sigma: Option<f64>| ComparedQuantity {
            name: "D_FX".into(),
            unit: "deg/h".into(),
            status: Status::Observable,
            degree: Some(1),
            accuracy_order: Some(1),
            sigma,
            total: None,
            by_prior: false,
            sigma_extended: None,
            requirement,
            margin: requirement.zip(sigma).map(|(r, s)| r / s),
            excitation: Vec::new(),
            carried_by: Vec::new(),
        };
        // with a bench the total decides
        let missed = ComparedQuantity { total: Some(0.5), margin: Some(0.2), ..q(Some(0.1), Some(0.05)) };
        assert!(margin(&missed) == ("0.2000 MISSED".into(), Grade::Missed));
        for (requirement, sigma, expected, grade) in [
            (Some(0.1), Some(0.05), "2.000 met", Grade::Good),
            (Some(0.1), Some(0.1), "1.000 met", Grade::Good),
            (Some(0.1), Some(0.2), "0.5000 MISSED", Grade::Missed),
            (Some(0.1), None, "not determined", Grade::Missed),
            (None, None, "not determined", Grade::Open),
            (None, Some(0.1), "nothing required", Grade::Open),
        ] {
            let (text, found) = margin(&q(requirement, sigma));
            assert!(text == expected && found == grade, "{text}");
        }
    }
}
