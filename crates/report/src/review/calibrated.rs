//! Calibration as part of a review.

use obsdeg_calibration::Calibration;
use obsdeg_calibration::answer::{PositionFit, RecordReport};
use obsdeg_evidence::acceptance::Decision;

use super::answers::{self, Answers};
use crate::Answer;
use crate::calibration::{assumed, values_by_default};
use crate::calibration_figures::{
    allan_figure, estimate_figures, file_name, residual_figure, whiteness_figure,
};
use crate::calibration_findings::finding;
use crate::document::{
    Document, DocumentBlock, Drawing, Grade, Picture, StatusBox, StatusRow, TableCell, number,
};
use crate::figure::Figure;
use crate::{acceptance, omitted, stated, words};

/// Section of a calibration: its answer and its pictures, whose names begin with `id`.
pub(super) fn section(c: &Calibration, id: &str) -> Vec<DocumentBlock> {
    let Document { lead, blocks, .. } = c.document();
    let Pictures { estimates, residuals, details } = pictures(c, id);
    let text = lead.into_iter().map(DocumentBlock::Text);
    text.chain(blocks).chain(estimates).chain(residuals).chain(details).collect()
}

/// Pictures of a calibration.
pub(crate) struct Pictures {
    /// Three sigma about the estimates by family.
    pub(crate) estimates: Vec<DocumentBlock>,
    /// Residuals over time by component.
    pub(crate) residuals: Vec<DocumentBlock>,
    /// Allan deviation and autocorrelation of the residuals by component.
    pub(crate) details: Vec<DocumentBlock>,
}

/// Pictures of a calibration; their names begin with `id`.
pub(crate) fn pictures(c: &Calibration, id: &str) -> Pictures {
    let curves = |name: String, caption: String, figure: Figure| {
        DocumentBlock::Picture(Picture { name, caption, drawing: Drawing::Curves(Box::new(figure)) })
    };
    let estimates = estimate_figures(c).into_iter().enumerate().map(|(i, mut figure)| {
        // the table of coefficients has the estimates
        for name in &mut figure.x_names {
            name.truncate(name.find(" = ").unwrap_or(name.len()));
        }
        DocumentBlock::Picture(Picture {
            name: format!("{id}_estimates_{}", i + 1),
            caption: format!(
                "Three sigma about the estimates of {}: rescaled by the fit, predicted, and required where a \
                 requirement is stated",
                figure.title
            ),
            drawing: Drawing::Bars(Box::new(figure)),
        })
    });
    let mut out = Pictures { estimates: estimates.collect(), residuals: Vec::new(), details: Vec::new() };
    for (i, s) in c.series.iter().enumerate() {
        let of = if c.records.len() > 1 { format!(" of {}", file_name(&s.record)) } else { String::new() };
        let name = |kind: &str| format!("{id}_{kind}_{}", i + 1);
        let what = &s.channel;
        out.residuals.push(curves(
            name("residuals"),
            format!("Residuals of {what}{of}, with bands of three sigma"),
            residual_figure(c, s),
        ));
        if s.allan.len() > 1 {
            let caption = format!(
                "Allan deviation of the residuals of {what}{of}: white noise falls with the root of the \
                 cluster time; a rise is an error outside the model"
            );
            out.details.push(curves(name("allan"), caption, allan_figure(s)));
        }
        if !s.autocorrelation.is_empty() {
            let caption = format!("Autocorrelation of the residuals of {what}{of}");
            out.details.push(DocumentBlock::Picture(Picture {
                name: name("whiteness"),
                caption,
                drawing: Drawing::Bars(Box::new(whiteness_figure(s))),
            }));
        }
    }
    out
}

/// Answers to the questions of a board.
pub(crate) fn answers(name: &str, c: &Calibration) -> Answers {
    let of = |r: &RecordReport| {
        format!(
            "{}: {}, {} samples",
            file_name(&r.name),
            super::sections::duration(r.span_s.length()),
            r.samples
        )
    };
    Answers {
        name: name.into(),
        rows: vec![
            ("Carry", words::assumptions::carry(c.setup.carry).into()),
            ("Assumed", assumed_in_brief(c).into()),
            ("Chosen by the program", chosen(c).into()),
            ("What limits it", limits(c)),
            ("Accelerometers off by 20 ug", omitted::calibration::accelerometers_off_in_record(c).into()),
            ("Duration", c.records.iter().map(of).collect::<Vec<_>>().join("; ").into()),
            ("Position to drop", position_to_drop(c).into()),
            ("Proven by", PROVEN.into()),
            ("Verified by", verified(c)),
        ],
        next: answers::next(super::actions::of_calibration(c)),
    }
}

/// Part of a calibration that is proven.
const PROVEN: &str = "Whether the scheme determines an unknown, by exact ranks in two prime fields. \
                      Estimates, sigmas and chi-square are computed, not proven";

/// Conditions that neither the scheme nor the command states.
fn chosen(c: &Calibration) -> String {
    values_by_default(&c.assumed).map_or_else(
        || "Nothing: the scheme or the command states latitude, noise and random drift".into(),
        |listed| stated::capital(&listed),
    )
}

/// Assumptions in one line, with the gate of outliers.
fn assumed_in_brief(c: &Calibration) -> String {
    let mut out = assumed(c);
    out.push(format!(
        "measurements far off are left out: any of a right record with probability {}",
        number(1.0 - c.assumed.gate)
    ));
    stated::capital(&out.join("; "))
}

/// Findings, unknowns without an estimate, and the smallest margin.
fn limits(c: &Calibration) -> TableCell {
    let mut out: Vec<String> = c.findings.iter().take(1).map(|f| finding(f, &c.records)).collect();
    let more = c.findings.len().saturating_sub(1);
    out.extend((more > 0).then(|| format!("{more} more finding{} below", if more == 1 { "" } else { "s" })));
    let lost: Vec<&str> = c.quantities.iter().filter(|q| !q.determined).map(|q| q.name.as_str()).collect();
    if !lost.is_empty() {
        out.push(format!("not determined: {}", words::names(lost)));
    }
    let missed = c.requirements.as_ref().filter(|r| !r.missed.is_empty());
    let grade = match (missed.is_some() || !c.consistent, out.is_empty()) {
        (true, _) => Grade::Missed,
        (false, false) => Grade::Limited,
        (false, true) => Grade::Good,
    };
    if let Some(r) = missed {
        out.insert(0, format!("{} of {} requirements NOT met", r.missed.len(), r.stated));
    }
    if let Some((r, margin)) = c.requirements.as_ref().and_then(|r| Some((r, stated::worst_margin(r)?))) {
        out.push(format!("smallest margin{} {margin}", stated::whose_margin(r)));
    }
    if out.is_empty() {
        out.push("nothing found".into());
    }
    TableCell::graded(stated::capital(&out.join("; ")), grade)
}

/// Positions of the record without which every estimate remains.
fn position_to_drop(c: &Calibration) -> String {
    if c.positions.len() < 2 {
        return "None: the record has one position".into();
    }
    if !c.quantities.iter().any(|q| q.determined) {
        return "None: no unknown is determined".into();
    }
    let record = |p: &PositionFit| c.records.iter().position(|r| r.name == p.record);
    let name = |p: &PositionFit| match record(p).filter(|_| c.records.len() > 1) {
        Some(k) => format!("{} (record {})", p.position, k + 1),
        None => p.position.clone(),
    };
    let kept: Vec<String> = c.positions.iter().filter(|p| p.loses.is_empty()).map(name).collect();
    match kept.is_empty() {
        true => "Keep all: without any one of them an estimate is lost".into(),
        false => format!(
            "Without one of {} every estimate remains; sigmas grow, and requirements are not judged again",
            words::names(kept.iter().map(String::as_str))
        ),
    }
}

/// Second path, chi-square and agreement of several records.
fn verified(c: &Calibration) -> TableCell {
    let f = &c.fit;
    if !c.quantities.iter().any(|q| q.determined) {
        return TableCell::graded("Nothing to compare: no unknown is determined", Grade::Open);
    }
    let mut out = vec![
        format!(
            "A filter as a second path: estimates within {} sigma, sigmas within {} of themselves",
            number(c.second_path.difference),
            number(c.second_path.sigma_difference)
        ),
        format!(
            "chi-square {} per degree of freedom, expected {} to {}",
            number(f.factor * f.factor),
            number(f.band.from),
            number(f.band.to)
        ),
    ];
    out.extend(c.repeatability.as_ref().map(|r| {
        format!(
            "records agree with chi-square {}, expected {} to {}",
            number(r.chi_square),
            number(r.band.from),
            number(r.band.to)
        )
    }));
    TableCell::graded(out.join("; "), if c.consistent { Grade::Good } else { Grade::Missed })
}

/// Status of a calibration.
pub(crate) fn status(c: &Calibration, title: String) -> StatusBox {
    let row = |what, grade, text| StatusRow { what, grade, text };
    let all = c.quantities.len();
    let determined = c.quantities.iter().filter(|u| u.determined).count();
    let first = c.findings.first().map(|f| finding(f, &c.records));
    let f = &c.fit;
    let required = c.requirements.as_ref().filter(|r| r.stated > 0).map(|r| {
        let grade = match (r.all_met(), c.consistent) {
            (false, _) => Grade::Missed,
            (true, true) => Grade::Good,
            (true, false) => Grade::Limited,
        };
        let doubt = if c.consistent { "" } else { ", by sigmas that a finding contradicts" };
        row("Requirements", grade, format!("{}{doubt}", stated::requirements(r)))
    });
    let accepted = c.acceptance.as_ref().and_then(|a| {
        let rejected = a.limits.iter().any(|l| l.decision == Some(Decision::Rejected));
        let grade = match a.all_accepted() {
            true => Grade::Good,
            false if rejected => Grade::Missed,
            false => Grade::Limited,
        };
        Some(row("Acceptance", grade, acceptance::sentence(a)?))
    });
    StatusBox {
        title,
        rows: required
            .into_iter()
            .chain(accepted)
            .chain([
                row(
                    "Consistent",
                    if c.consistent { Grade::Good } else { Grade::Missed },
                    first.unwrap_or_else(|| "model and sigmas explain the record".into()),
                ),
                row(
                    "Determined",
                    if determined == all { Grade::Good } else { Grade::Limited },
                    format!("{determined} of {all} unknowns"),
                ),
                row(
                    "Chi-square",
                    if f.band.contains(&(f.factor * f.factor)) { Grade::Good } else { Grade::Limited },
                    format!(
                        "{:.3} per degree of freedom ({:.3} to {:.3})",
                        f.factor * f.factor,
                        f.band.from,
                        f.band.to
                    ),
                ),
            ])
            .collect(),
        actions: super::actions::of_calibration(c),
    }
}
