//! Answers to the questions of a board: one table for the first two printed pages, with a column for each
//! scheme, model or calibration.

use obsdeg_core::analysis::Analysis;
use obsdeg_design::review::SchemeReview;
use obsdeg_evidence::compare::ComparedScheme;

use super::{actions, verdict};
use crate::document::{DocumentBlock, Grade, TableCell, left, number};
use crate::{omitted, resolve, stated, words};

/// Heading of the table of answers.
const HEADING: &str = "Answers in brief";
/// Question of a table of several subjects on what to do.
const NEXT: &str = "Next step";

/// Answers on one scheme, model or calibration.
pub(crate) struct Answers {
    /// Name of the scheme, model or calibration.
    pub(crate) name: String,
    /// Questions with their answers, in the order of the table.
    pub(crate) rows: Vec<(&'static str, TableCell)>,
    /// First action, and the number of further ones. Of a single subject the box above has the actions.
    pub(crate) next: String,
}

/// Tables of the answers on all subjects of a report: of several first what is the same for all of them.
pub(crate) fn tables(all: &[Answers]) -> Vec<DocumentBlock> {
    let [first, others @ ..] = all else { return Vec::new() };
    if others.is_empty() {
        let rows = first.rows.iter().map(|(question, cell)| vec![TableCell::from(*question), cell.clone()]);
        return vec![DocumentBlock::table(HEADING, [left("question"), left("answer")], rows)];
    }
    let mut questions: Vec<&str> = Vec::new();
    for (question, _) in all.iter().flat_map(|a| &a.rows) {
        if !questions.contains(question) {
            questions.push(question);
        }
    }
    questions.push(NEXT);
    let of = |a: &Answers, question: &str| match question {
        NEXT => a.next.clone().into(),
        _ => a.rows.iter().find(|r| r.0 == question).map_or_else(|| "-".into(), |r| r.1.clone()),
    };
    let (mut alike, mut rows) = (Vec::new(), Vec::new());
    for question in questions {
        let mut cells: Vec<TableCell> = all.iter().map(|a| of(a, question)).collect();
        match cells.iter().all(|c| c.text == cells[0].text && c.grade == cells[0].grade) {
            true => alike.push(vec![question.into(), cells.remove(0)]),
            false => rows.push([vec![question.into()], cells].concat()),
        }
    }
    let mut columns = vec![left("question")];
    columns.extend(all.iter().map(|a| left(a.name.clone())));
    let same = format!("{HEADING}, the same for all {}", all.len());
    let both = [(HEADING.into(), columns, rows), (same, vec![left("question"), left("answer")], alike)];
    let written = both.into_iter().filter(|(.., rows)| !rows.is_empty());
    written.map(|(heading, columns, rows)| DocumentBlock::table(heading, columns, rows)).collect()
}

/// Answers on a scheme; `certified`: the report names digests of certificates.
pub(super) fn of_scheme(s: &SchemeReview, review: &ComparedScheme, certified: bool) -> Answers {
    let drop = resolve::position_to_drop(review).unwrap_or_else(|| match s.positions.len() {
        1 => "None: the scheme has one position".into(),
        _ => "Not computed: the scheme rotates or has many positions".into(),
    });
    Answers {
        name: s.name.clone(),
        rows: vec![
            ("Carry", words::assumptions::carry(s.analysis.carry).into()),
            ("Assumed", assumed(s, review).into()),
            ("Chosen by the program", chosen(s, review).into()),
            ("What limits it", limits(s, review)),
            ("Accelerometers off by 20 ug", omitted::accelerometers_off(review).into()),
            ("Duration", duration(s, review).into()),
            ("Position to drop", drop.into()),
            ("Proven by", proven(&s.analysis, certified).into()),
            ("Verified by", verified(s)),
        ],
        next: next(actions::of_scheme(s, review)),
    }
}

/// Conditions of the predicted sigmas in one line.
fn assumed(s: &SchemeReview, review: &ComparedScheme) -> String {
    let m = &review.conditions;
    let azimuth =
        m.azimuth_noise_deg.map_or_else(String::new, |a| format!(", of the measured azimuth {a:e} deg"));
    let dwells = || s.positions.iter().map(|p| p.dwell_s);
    let (least, most) = dwells().fold((f64::MAX, f64::MIN), |(l, h), t| (l.min(t), h.max(t)));
    let dwell = match least == most {
        true => format!("dwell {} s per position", super::sections::seconds(most)),
        false => format!(
            "dwell {} to {} s per position",
            super::sections::seconds(least),
            super::sections::seconds(most)
        ),
    };
    let mut out = vec![
        format!("noise of Z {:e} g per sample and axis{azimuth}", m.accelerometer_noise_g),
        format!("a sample at least every {} s", m.step_s),
        dwell,
        format!("latitude {} deg", m.latitude_deg),
    ];
    out.extend(m.settle_s.map(words::run::settle));
    out.extend(m.slew_rate_deg_s.map(|r| format!("turns at {r} deg/s, without samples")));
    out.extend(m.accelerometer_bias.as_ref().map(words::run::accelerometer_bias));
    out.extend(m.drift_noise.as_ref().map(|noise| format!("random drift {noise}")));
    out.extend(m.gyro_noise.as_ref().map(words::run::gyro_noise));
    out.push(
        m.prior.as_ref().map_or_else(|| "no prior".into(), |p| format!("prior {p} (units of the file)")),
    );
    out.push(m.bench.as_deref().map_or_else(
        || "no bench (errors outside the model count as zero)".into(),
        words::assumptions::bench,
    ));
    out.join("; ")
}

/// Conditions that the file does not state, of the prediction and then of the run.
fn chosen(s: &SchemeReview, review: &ComparedScheme) -> String {
    let predicted = stated::chosen(&review.conditions);
    let c = &s.simulation.conditions;
    let run = stated::chosen_in_run(c, &s.simulation.quantities, &review.conditions.by_default);
    match (predicted, run) {
        (None, None) => "Nothing: the file or the command states every condition".into(),
        (Some(p), None) => p,
        (None, Some(r)) => format!("For the prediction nothing. For the simulated run: {r}"),
        (Some(p), Some(r)) => format!("{p}. For the simulated run besides: {r}"),
    }
}

/// Limits of the verdict, the unknowns without an answer and the least accurate coefficient.
fn limits(s: &SchemeReview, review: &ComparedScheme) -> TableCell {
    let mut out = verdict::limits(s);
    let lost: Vec<&str> =
        (review.quantities.iter()).filter(|q| q.sigma.is_none()).map(|q| q.name.as_str()).collect();
    if !lost.is_empty() && lost != verdict::by_prior(s) {
        out.push(format!("not determined: {}", words::names(lost)));
    }
    let r = &review.requirements;
    let grade = match (r.stated, r.missed.is_empty(), out.is_empty()) {
        (_, false, _) => Grade::Missed,
        (_, _, false) => Grade::Limited,
        (0, ..) => Grade::Open,
        (_, true, true) => Grade::Good,
    };
    if !r.missed.is_empty() {
        out.insert(0, format!("{} of {} requirements NOT met", r.missed.len(), r.stated));
    }
    if let Some(margin) = stated::worst_margin(&review.requirements) {
        out.push(format!(
            "smallest margin{} {margin}{}",
            stated::whose_margin(&review.requirements),
            review.requirements.worst.as_ref().map_or_else(String::new, |w| largest_shares(review, &w.name))
        ));
    } else if let Some(worst) = &review.worst {
        let by = match review.conditions.bench {
            Some(_) => largest_shares(review, &worst.name),
            None => ", by the noise and the dwells".into(),
        };
        out.push(format!("{} {}{by}", stated::worst(&review.requirements), stated::worst_sigma(worst)));
    }
    if out.is_empty() {
        out.push("nothing found".into());
    }
    TableCell::graded(stated::capital(&out.join("; ")), grade)
}

/// The two largest sources in the budget of an unknown; empty without a bench.
fn largest_shares(review: &ComparedScheme, unknown: &str) -> String {
    let budget = review.omitted.budgets.iter().find(|b| b.unknown == unknown);
    let listed = budget.iter().flat_map(|b| &b.lines).take(2).map(|l| {
        format!(
            "{} of {} {} ({:.0} % of its squared total)",
            l.source,
            number(l.value),
            l.value_unit,
            l.percent
        )
    });
    let listed: Vec<String> = listed.collect();
    if listed.is_empty() { String::new() } else { format!(", by {}", listed.join(" and ")) }
}

/// Total time with its parts.
fn duration(s: &SchemeReview, review: &ComparedScheme) -> String {
    let slews: f64 = s.positions.iter().filter_map(|p| p.slew_s).sum();
    let dwells: f64 = s.positions.iter().map(|p| p.dwell_s).sum();
    let n = s.positions.len();
    let turns = match slews > 0.0 {
        true => format!(
            "; {} s at rest, {} s of turns",
            super::sections::seconds(dwells),
            super::sections::seconds(slews)
        ),
        false => "; turns count as instantaneous".into(),
    };
    format!(
        "{}, {n} position{}{turns}",
        super::sections::duration(review.total_s),
        if n == 1 { "" } else { "s" }
    )
}

/// Certainty of the exact verdicts, and the figures that no proof covers.
pub(super) fn proven(a: &Analysis, certified: bool) -> String {
    let c = &a.certainty;
    let certificate = if certified { "; certificate: see How to check this without obsdeg" } else { "" };
    format!(
        "Status and degree: {}, a verdict is {}{certificate}. Sigmas are \
         predicted, not proven",
        c.method,
        words::wrong_below(c.error_bound)
    )
}

/// Checks by a filter and by one run.
fn verified(s: &SchemeReview) -> TableCell {
    let (grade, evidence) = verdict::evidence(s);
    let consistent = s.simulation.consistency.consistent;
    let run = if consistent { "is consistent" } else { "is NOT consistent" };
    let small = match s.simulation.validity.holds {
        true => "",
        false => ". Both are of the small-angle model, which does not hold at these drifts",
    };
    let text = format!(
        "Kalman filter and exact verdicts: {evidence}. One simulated run {run} with its truth{small}"
    );
    TableCell::graded(text, if consistent { grade } else { Grade::Limited })
}

/// First action, and the number of further ones.
pub(super) fn next(actions: Vec<String>) -> String {
    let first = actions.first().cloned().unwrap_or_default();
    match actions.len().saturating_sub(1) {
        0 => first,
        more => format!("{first} ({more} more below)"),
    }
}
