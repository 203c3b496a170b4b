//! Answers to the questions of a board on schemes: one table for the first two printed pages, schemes as
//! columns.

use obsdeg_core::degree::Status as Exact;
use obsdeg_design::review::{DesignReview, SchemeReview};
use obsdeg_evidence::compare::ComparedScheme;

use super::{actions, verdict};
use crate::document::{Block, Cell, Grade, left};
use crate::{Origin, omitted, resolve, stated, words};

/// Heading of the table of answers.
const HEADING: &str = "Answers in brief";

/// Answers on every scheme of a review. Of a single scheme the box above has the next steps.
pub(super) fn table(r: &DesignReview, origin: &Origin) -> Block {
    let alone = r.schemes.len() == 1;
    let all: Vec<_> = r.schemes.iter().zip(&r.comparison.schemes).collect();
    let mut columns = vec![left("question")];
    columns.extend(all.iter().map(|(s, _)| left(if alone { "answer".into() } else { s.name.clone() })));
    let certified = !origin.certificates.is_empty();
    let line = |name: &str, cell: &dyn Fn(&SchemeReview, &ComparedScheme) -> Cell| -> Vec<Cell> {
        std::iter::once(name.into()).chain(all.iter().map(|(s, review)| cell(s, review))).collect()
    };
    let mut rows = vec![
        line("Carry", &|s, _| words::carry(s.analysis.carry).into()),
        line("Assumed", &|s, review| assumed(s, review).into()),
        line("Chosen by the program", &|s, review| chosen(s, review).into()),
        line("What limits it", &|s, review| limits(s, review)),
        line("Accelerometers off by 20 ug", &|_, review| omitted::accelerometers_off(review).into()),
        line("Duration", &|s, review| duration(s, review).into()),
        line("Position to drop", &|_, review| {
            resolve::position_to_drop(review)
                .unwrap_or_else(|| "Not computed: the scheme has one position, rotates, or is long".into())
                .into()
        }),
        line("Proven by", &|s, _| proven(s, certified).into()),
        line("Verified by", &|s, _| verified(s)),
    ];
    if !alone {
        rows.push(line("Next step", &|s, review| next(s, review).into()));
    }
    Block::table(HEADING, columns, rows)
}

/// Conditions of the predicted sigmas in one line.
fn assumed(s: &SchemeReview, review: &ComparedScheme) -> String {
    let m = &review.conditions;
    let azimuth =
        m.azimuth_noise_deg.map_or_else(String::new, |a| format!(", of the measured azimuth {a:e} deg"));
    let dwells = || s.positions.iter().map(|p| p.dwell_s);
    let (least, most) = dwells().fold((f64::MAX, f64::MIN), |(l, h), t| (l.min(t), h.max(t)));
    let dwell = match least == most {
        true => format!("dwell {} s per position", super::seconds(most)),
        false => format!("dwell {} to {} s per position", super::seconds(least), super::seconds(most)),
    };
    let mut out = vec![
        format!("noise of Z {:e} g per sample and axis{azimuth}", m.accelerometer_noise_g),
        format!("a sample at least every {} s", m.step_s),
        dwell,
        format!("latitude {} deg", m.latitude_deg),
    ];
    out.extend(m.settle_s.map(words::settle));
    out.extend(m.slew_rate_deg_s.map(|r| format!("turns at {r} deg/s, without samples")));
    out.extend(m.accelerometer_bias.as_ref().map(words::accelerometer_bias));
    out.extend(m.drift_noise.as_ref().map(|noise| format!("random drift {noise}")));
    out.extend(m.gyro_noise.as_ref().map(words::gyro_noise));
    out.push(
        m.prior.as_ref().map_or_else(|| "no prior".into(), |p| format!("prior {p} (units of the file)")),
    );
    out.push(
        m.bench
            .as_deref()
            .map_or_else(|| "no bench (errors outside the model count as zero)".into(), words::bench),
    );
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
fn limits(s: &SchemeReview, review: &ComparedScheme) -> Cell {
    let mut out = verdict::limits(s);
    let lost: Vec<&str> = (review.quantities.iter())
        .filter(|q| q.status != Exact::Observable && q.sigma.is_none())
        .map(|q| q.name.as_str())
        .collect();
    if !lost.is_empty() {
        out.push(format!("not determined: {}", words::names(lost)));
    }
    let found = !out.is_empty() || !review.requirements.missed.is_empty();
    if let Some(margin) = stated::worst_margin(&review.requirements) {
        out.push(format!("smallest margin{} {margin}", stated::whose_margin(&review.requirements)));
    } else if let Some(worst) = &review.worst {
        out.push(format!("{} {}", stated::worst(&review.requirements), stated::worst_sigma(worst)));
    }
    if out.is_empty() {
        out.push("nothing found".into());
    }
    Cell::graded(stated::capital(&out.join("; ")), if found { Grade::Limited } else { Grade::Good })
}

/// Total time with its parts.
fn duration(s: &SchemeReview, review: &ComparedScheme) -> String {
    let slews: f64 = s.positions.iter().filter_map(|p| p.slew_s).sum();
    let dwells: f64 = s.positions.iter().map(|p| p.dwell_s).sum();
    let n = s.positions.len();
    let turns = match slews > 0.0 {
        true => format!("; {} s at rest, {} s of turns", super::seconds(dwells), super::seconds(slews)),
        false => "; turns count as instantaneous".into(),
    };
    format!("{}, {n} position{}{turns}", super::duration(review.total_s), if n == 1 { "" } else { "s" })
}

/// Certainty of the exact verdicts, and the figures that no proof covers.
fn proven(s: &SchemeReview, certified: bool) -> String {
    let c = &s.analysis.certainty;
    let certificate = if certified { "; certificate: see How to check this without obsdeg" } else { "" };
    format!(
        "Status and degree: {}, a verdict is wrong with probability below {}{certificate}. Sigmas are \
         predicted, not proven",
        c.method,
        words::at_most(c.error_bound)
    )
}

/// Checks by a filter and by one run.
fn verified(s: &SchemeReview) -> Cell {
    let (grade, evidence) = verdict::evidence(s);
    let consistent = s.simulation.consistency.consistent;
    let run = if consistent { "is consistent" } else { "is NOT consistent" };
    let text =
        format!("Kalman filter and exact verdicts: {evidence}. One simulated run {run} with its truth");
    Cell::graded(text, if consistent { grade } else { Grade::Limited })
}

/// First action, and the number of further ones.
fn next(s: &SchemeReview, review: &ComparedScheme) -> String {
    let all = actions::of_scheme(s, review);
    let first = all.first().cloned().unwrap_or_default();
    match all.len().saturating_sub(1) {
        0 => first,
        more => format!("{first} ({more} more below)"),
    }
}
