//! Calibration as part of a review.

use obsdeg_calibration::Calibration;
use obsdeg_evidence::acceptance::Decision;

use crate::Answer;
use crate::calibration::finding;
use crate::calibration_figures::{
    allan_figure, estimate_figures, file_name, residual_figure, whiteness_figure,
};
use crate::document::{Block, Document, Drawing, Grade, Picture, Status, StatusRow};
use crate::figure::Figure;
use crate::{acceptance, stated};

/// Section of a calibration: its answer and its pictures, whose names begin with `id`.
pub(super) fn section(c: &Calibration, id: &str) -> Vec<Block> {
    let Document { lead, blocks, .. } = c.document();
    let Pictures { estimates, residuals, details } = pictures(c, id);
    let text = lead.into_iter().map(Block::Text);
    text.chain(blocks).chain(estimates).chain(residuals).chain(details).collect()
}

/// Pictures of a calibration.
pub(crate) struct Pictures {
    /// Three sigma about the estimates by family.
    pub(crate) estimates: Vec<Block>,
    /// Residuals over time by component.
    pub(crate) residuals: Vec<Block>,
    /// Allan deviation and autocorrelation of the residuals by component.
    pub(crate) details: Vec<Block>,
}

/// Pictures of a calibration; their names begin with `id`.
pub(crate) fn pictures(c: &Calibration, id: &str) -> Pictures {
    let curves = |name: String, caption: String, figure: Figure| {
        Block::Picture(Picture { name, caption, drawing: Drawing::Curves(Box::new(figure)) })
    };
    let estimates = estimate_figures(c).into_iter().enumerate().map(|(i, figure)| {
        Block::Picture(Picture {
            name: format!("{id}_estimates_{}", i + 1),
            caption: format!(
                "Three sigma about the estimates of {}: rescaled by the fit, predicted, and required where a \
                 requirement is stated",
                figure.title
            ),
            drawing: Drawing::Still(figure.svg()),
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
            out.details.push(Block::Picture(Picture {
                name: name("whiteness"),
                caption,
                drawing: Drawing::Still(whiteness_figure(s).svg()),
            }));
        }
    }
    out
}

/// Status of a calibration.
pub(crate) fn status(c: &Calibration, title: String) -> Status {
    let row = |what, grade, text| StatusRow { what, grade, text };
    let all = c.quantities.len();
    let determined = c.quantities.iter().filter(|u| u.determined).count();
    let first = c.findings.first().map(|f| finding(f, &c.records));
    let f = &c.fit;
    let required = c.requirements.as_ref().filter(|r| r.stated > 0).map(|r| {
        let grade = if r.all_met() { Grade::Good } else { Grade::Missed };
        row("Requirements", grade, stated::requirements(r))
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
    Status {
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
                    if (f.band.0..=f.band.1).contains(&(f.factor * f.factor)) {
                        Grade::Good
                    } else {
                        Grade::Limited
                    },
                    format!(
                        "{:.3} per degree of freedom ({:.3} to {:.3})",
                        f.factor * f.factor,
                        f.band.0,
                        f.band.1
                    ),
                ),
            ])
            .collect(),
        actions: super::actions::of_calibration(c),
    }
}
