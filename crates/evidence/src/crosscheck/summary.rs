//! Outcomes of all checks, in words.

use obsdeg_core::span::Span;

use super::answer::{Agreement, Check, CrossCheck};
use super::{rules, structure};

/// Outcomes of all checks.
pub(super) fn outcomes(c: &CrossCheck) -> impl Iterator<Item = Agreement> {
    let covariance = c.covariance.iter().map(|d| d.outcome);
    let statistics = c.monte_carlo.statistics.iter().map(|s| s.pass);
    let controls = c.controls.iter().map(|k| k.outcome);
    let others = statistics.chain([c.monte_carlo.white, c.ranking.pass]).map(Agreement::of);
    let structure = structure::outcomes(&c.quantities, &c.spaces, &c.null_space, &c.defect);
    structure.chain(covariance).chain(controls).chain(others)
}

/// Failed checks of d, in words.
pub(super) fn misfits(c: &CrossCheck) -> Vec<String> {
    let mut out = Vec::new();
    for s in c.monte_carlo.statistics.iter().filter(|s| !s.pass) {
        let Span { from, to } = s.wide_band;
        out.push(format!("{} is {:.4}, outside {from:.3}..{to:.3}", s.name, s.measured));
    }
    if c.monte_carlo.unsettled > 0 {
        out.push(format!("{} of {} runs did not settle", c.monte_carlo.unsettled, c.monte_carlo.runs));
    }
    if !c.monte_carlo.white {
        out.push("innovations are not white".into());
    }
    out
}

/// Failed checks of a, b, c, e and f, in words.
pub(super) fn disagreements(c: &CrossCheck) -> Vec<String> {
    let mut out = Vec::new();
    let failed = |c: &Check| c.measured.filter(|_| c.fails());
    for q in &c.quantities {
        if !q.modelled {
            out.push(format!("{}: the filter has no such unknown", q.name));
        }
        if let (Some(found), Agreement::Disagrees) = (q.status_measured, q.status_outcome) {
            out.push(format!("{}: {found} instead of {}", q.name, q.status));
        }
        for (check, of) in [
            (&q.degree_slope, "slope without dwells"),
            (&q.slope, "slope"),
            (&q.slope_at_end, "slope at the end"),
        ] {
            if let Some(found) = failed(check) {
                out.push(format!("{}: {of} {found:.3} instead of {:.1}", q.name, check.predicted));
            }
        }
        if let Some(p) = q.partners.as_ref().filter(|p| p.outcome == Agreement::Disagrees) {
            let list = |names: &[String]| if names.is_empty() { "none".into() } else { names.join(", ") };
            let found = p.measured.as_deref().map_or_else(String::new, list);
            out.push(format!("{}: partners {found} instead of {}", q.name, list(&p.predicted)));
        }
        if let Some(found) = failed(&q.inflation) {
            let expected = q.inflation.predicted;
            out.push(match rules::LINEAR.check(expected == 1.0, Some(found)).fails() {
                true => format!("{}: prior inflation {found:.3} instead of {expected:.0}", q.name),
                false => format!("{}: prior inflation {expected:.0}, which many digits contradict", q.name),
            });
        }
    }
    for s in c.spaces.iter().filter(|s| s.outcome == Agreement::Disagrees) {
        out.push(format!("{}: {} instead of {}", s.what, s.measured, s.predicted));
    }
    for v in &c.null_space {
        if v.seen.fails() {
            out.push(format!("{}: the filter sees this direction", v.direction));
        }
        if v.correlation.is_some_and(|k| k.fails()) {
            out.push(format!("{}: correlation is not +-1", v.direction));
        }
    }
    if c.defect.outcome == Agreement::Disagrees {
        out.push(format!("{} directions unseen instead of {}", c.defect.measured, c.defect.predicted));
    }
    out.extend(
        c.covariance
            .iter()
            .filter(|d| d.outcome == Agreement::Disagrees)
            .map(|d| format!("{}: {:.1e}", d.name, d.difference)),
    );
    if !c.ranking.pass {
        out.push("predicted and measured orders rank differently".into());
    }
    for control in c.controls.iter().filter(|k| k.outcome == Agreement::Disagrees) {
        out.push(format!("{} was not found out", control.name));
    }
    out
}

/// Reasons why checks are not resolvable, one for each; `filter` has those of evidence b.
pub(super) fn unresolved(c: &CrossCheck, filter: Vec<String>) -> Vec<String> {
    let mut out = Vec::new();
    let open = |outcome: Agreement| outcome == Agreement::NotResolvable;
    for q in &c.quantities {
        let slopes = [
            (&q.degree_slope, "slope without dwells"),
            (&q.slope, "slope"),
            (&q.slope_at_end, "slope at the end"),
        ];
        for (check, of) in slopes.into_iter().filter(|(check, _)| open(check.outcome)) {
            out.push(match check.measured {
                Some(x) => format!(
                    "{}: {of} {x:.3} is that of its degree: the coefficients are doubles, whose rounding \
                     hides what dwells add",
                    q.name
                ),
                None => format!("{}: {of}: it does not settle, or is not told from rounding", q.name),
            });
        }
        if open(q.status_outcome) {
            out.push(format!("{}: status: its slope without dwells does not settle", q.name));
        }
        if q.partners.as_ref().is_some_and(|p| open(p.outcome)) {
            out.push(format!("{}: partners: what is seen is not told from rounding", q.name));
        }
    }
    out.extend(filter);
    for s in c.spaces.iter().filter(|s| open(s.outcome)) {
        out.push(format!("{}: ranks are not told from rounding", s.what));
    }
    if open(c.defect.outcome) {
        out.push("number of directions unseen: what is seen is not told from rounding".into());
    }
    for d in c.covariance.iter().filter(|d| open(d.outcome)) {
        out.push(format!(
            "{}: {:.1e}, of which rounding may make a tenth of the limit",
            d.name, d.difference
        ));
    }
    for k in c.controls.iter().filter(|k| open(k.outcome)) {
        out.push(format!(
            "{}: it is off by {:.3} deg, and its innovations need not show it",
            k.name, k.off_deg
        ));
    }
    out
}
