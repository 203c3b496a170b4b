//! Cross-check of exact verdicts against a filter.

use obsdeg_core::model::settings::{FilterKind, Truth};
use obsdeg_evidence::crosscheck::{
    Agreement, Check, Control, Counts, CrossCheck, MonteCarlo, NullEvidence, QuantityEvidence, Ranking,
    Statistic,
};

use crate::Answer;
use crate::document::{Document, DocumentBlock, left, number, optional, right};
use crate::simulation::{conditions, validity, warning};
use crate::words::run::band;
use crate::words::{self, wrong_below};

/// Mark of the outcome of a check.
fn mark(outcome: Agreement) -> String {
    match outcome {
        Agreement::Agrees => "pass",
        Agreement::Disagrees => "FAIL",
        Agreement::NotResolvable => "not resolvable",
        Agreement::NotTested => "-",
    }
    .into()
}

fn passed(pass: bool) -> String {
    mark(if pass { Agreement::Agrees } else { Agreement::Disagrees })
}

/// The gravest of several outcomes.
fn gravest(outcomes: impl IntoIterator<Item = Agreement>) -> Agreement {
    let order = [Agreement::Disagrees, Agreement::NotResolvable, Agreement::Agrees];
    let found: Vec<Agreement> = outcomes.into_iter().collect();
    order.into_iter().find(|o| found.contains(o)).unwrap_or(Agreement::NotTested)
}

fn measured(c: &Check) -> String {
    let text = c.measured.map_or_else(|| "-".into(), |x| format!("{x:.3}"));
    if text == "-0.000" { "0.000".into() } else { text }
}

/// Item a without dwells, unknown by unknown.
fn by_derivatives(c: &CrossCheck) -> DocumentBlock {
    let row = |q: &QuantityEvidence| {
        let partners = q.partners.as_ref().map_or(Agreement::NotTested, |p| p.outcome);
        vec![
            q.name.clone(),
            q.status.to_string(),
            q.status_measured.map_or_else(|| "-".into(), |s| s.to_string()),
            words::degree(q.degree),
            format!("{:.1}", q.degree_slope.predicted),
            measured(&q.degree_slope),
            q.partners.as_ref().map_or_else(|| "-".into(), |p| p.predicted.len().to_string()),
            q.partners
                .as_ref()
                .and_then(|p| p.measured.as_ref())
                .map_or_else(|| "-".into(), |m| m.len().to_string()),
            mark(gravest([q.status_outcome, q.degree_slope.outcome, partners])),
        ]
    };
    DocumentBlock::table(
        "a. the degree: slope of log sigma against log dwell where psi goes on between positions as it was \
         at the start of each",
        [
            left("unknown"),
            left("status"),
            left("measured"),
            right("degree"),
            right("slope predicted"),
            right("measured"),
            right("partners"),
            right("measured"),
            left("finding"),
        ],
        c.quantities.iter().map(row),
    )
}

/// Items a and b with dwells, unknown by unknown.
fn by_unknown(c: &CrossCheck) -> DocumentBlock {
    let row = |q: &QuantityEvidence| {
        vec![
            q.name.clone(),
            words::accuracy_order(q.degree, q.accuracy_order, true),
            format!("{:.1}", q.slope.predicted),
            measured(&q.slope),
            mark(gravest([q.slope.outcome, q.slope_at_end.outcome])),
            format!("{:.0}", q.inflation.predicted),
            measured(&q.inflation),
            mark(q.inflation.outcome),
        ]
    };
    DocumentBlock::table(
        "a. the accuracy order: slope of log sigma (psi: of the start; held against that of the end as well) \
         against log dwell; b. factor on sigma (psi: of the end) for a prior variance times 100",
        [
            left("unknown"),
            right("accuracy order"),
            right("slope predicted"),
            right("measured"),
            left("finding"),
            right("factor predicted"),
            right("measured"),
            left("finding"),
        ],
        c.quantities.iter().map(row),
    )
}

/// Item b, direction by direction.
fn by_direction(c: &CrossCheck) -> DocumentBlock {
    let row = |v: &NullEvidence| {
        let correlation = |k: Check| k.measured.map_or_else(String::new, |x| format!("{x:.6}"));
        vec![
            v.direction.clone(),
            v.seen.measured.map_or_else(|| "-".into(), |x| format!("{x:.1e}")),
            mark(v.seen.outcome),
            v.correlation.map_or_else(|| "-".into(), correlation),
            v.correlation.map_or_else(String::new, |k| mark(k.outcome)),
        ]
    };
    DocumentBlock::table(
        "b. directions that Z does not see (SI units)",
        [
            left("direction"),
            right("part of it seen"),
            left("finding"),
            right("correlation, signed"),
            left("finding"),
        ],
        c.null_space.iter().map(row),
    )
}

/// Checks of the whole scheme: the number of directions of item b, and items c to f.
fn whole(c: &CrossCheck) -> DocumentBlock {
    let spaces = c.spaces.iter().map(|s| {
        let what = format!("a. {}", s.what);
        vec![what, s.predicted.clone(), s.measured.clone(), String::new(), mark(s.outcome)]
    });
    let mut rows: Vec<Vec<String>> = spaces.collect();
    rows.push(vec![
        "a. directions not seen with dwells".into(),
        c.defect.predicted.to_string(),
        c.defect.measured.to_string(),
        String::new(),
        mark(c.defect.outcome),
    ]);
    rows.extend(c.covariance.iter().map(|d| {
        let limit = format!("up to {:.0e}", d.limit);
        vec![format!("c. {}", d.name), "0".into(), format!("{:.1e}", d.difference), limit, mark(d.outcome)]
    }));
    rows.extend(of_monte_carlo(&c.monte_carlo));
    rows.extend(of_ranking(&c.ranking));
    rows.extend(c.controls.iter().map(|k: &Control| {
        let name = format!("f. {}: failing checks of a, b; NIS", k.name);
        let found = format!("{} of {}; {}", k.failed, k.checks, number(k.nis));
        vec![name, "fails".into(), found, format!("(99.9 %: {})", band(k.band)), mark(k.outcome)]
    }));
    let columns =
        [left("evidence"), right("predicted"), right("measured"), left("band (95 %)"), left("finding")];
    DocumentBlock::table("The filter as a whole", columns, rows)
}

/// Row of a check that passes or fails.
fn row(evidence: String, predicted: String, measured: String, band: String, pass: bool) -> Vec<String> {
    vec![evidence, predicted, measured, band, passed(pass)]
}

/// Item d: statistics of the Monte Carlo runs.
fn of_monte_carlo(d: &MonteCarlo) -> Vec<Vec<String>> {
    let mut rows: Vec<Vec<String>> = Vec::new();
    rows.extend(d.statistics.iter().map(|s: &Statistic| {
        let of = match d.filter {
            FilterKind::Linear => String::new(),
            other => format!(" of the {} filter", other.name()),
        };
        let name = format!("d. {}, {} runs{of}", s.name, d.runs);
        let bands = format!("{} (99.9 %: {})", band(s.band), band(s.wide_band));
        row(name, number(s.expected), number(s.measured), bands, s.pass)
    }));
    rows.push(row(
        "d. innovations white".into(),
        String::new(),
        number(d.whiteness_probability),
        "above 0.001".into(),
        d.white,
    ));
    rows
}

/// Item e: orders of the unknowns by sigma.
fn of_ranking(r: &Ranking) -> Vec<Vec<String>> {
    let mut rows = vec![vec![
        "e. Kendall tau-b of predicted and measured orders".into(),
        "1".into(),
        r.kendall_tau.map_or_else(|| "all tied".into(), number),
        String::new(),
        passed(r.pass),
    ]];
    rows.extend(r.errors.map(|tau| {
        let name = "e. Kendall tau-b of predicted orders and errors of the runs, in sigmas of the prior";
        vec![
            name.into(),
            String::new(),
            number(tau),
            "at these dwells: decides nothing".into(),
            String::new(),
        ]
    }));
    rows
}

/// True if the statistics of the Monte Carlo runs are within their bands.
fn fits(d: &MonteCarlo) -> bool {
    d.white && d.statistics.iter().all(|s| s.pass)
}

/// First lines: warnings and the numbers of outcomes.
fn lead(c: &CrossCheck) -> Vec<String> {
    let mut out: Vec<String> = warning(&c.conditions).into_iter().collect();
    let Counts { agree, disagree, not_resolvable, not_tested } = c.counts;
    out.push(format!(
        "checks: {agree} agree, {disagree} disagree, {not_resolvable} not resolvable, {not_tested} not \
         tested; {} of {} accuracy orders measured",
        c.orders.measured, c.orders.of
    ));
    if c.timeline.iter().any(|t| t.slew) {
        out.push(
            "a, b, c and f are taken with instantaneous repositioning, as the exact verdicts: a slew of \
             finite duration moves psi by drifts of its own; d knows of the slews"
                .into(),
        );
    }
    if c.bench.is_some() {
        out.push(
            "the bench is no part of a cross-check: it changes no verdict, and no record here has its errors"
                .into(),
        );
    }
    if !c.passed && !c.validity.holds && c.conditions.truth == Truth::Exact {
        let why = match c.monte_carlo.filter {
            FilterKind::Linear => {
                let ratio = c.validity.neglected_g / c.validity.accelerometer_noise_g;
                format!(", so (6) leaves out {} times the noise of Z", optional(Some(ratio)))
            }
            FilterKind::Extended => {
                "; the extended filter is linearised before the drifts are known, the iterated one (--filter \
                 iterated) along the whole run"
                    .into()
            }
            FilterKind::Iterated => "; the iterated filter has full attitudes".into(),
        };
        out.push(format!(
            "the truth is exact and the drifts are too large for the linear model: |psi| reaches {} deg{why}",
            number(c.validity.largest_psi_deg),
        ));
    }
    out
}

impl Answer for CrossCheck {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let mut blocks = Vec::new();
        if !self.quantities.is_empty() {
            blocks.extend([by_derivatives(self), by_unknown(self)]);
        }
        blocks.extend((!self.null_space.is_empty()).then(|| by_direction(self)));
        blocks.push(whole(self));
        blocks.extend(DocumentBlock::list_if_any("What disagrees", self.disagreements.clone()));
        blocks.extend(DocumentBlock::list_if_any("Not resolvable, and why", self.unresolved.clone()));
        blocks.push(DocumentBlock::list("How", self.method.clone()));
        blocks.push(DocumentBlock::list("Not tested by evidence", self.not_tested.clone()));
        blocks.push(DocumentBlock::list(
            "Validity of the small-angle model",
            validity(&self.validity, &self.conditions),
        ));
        let mut assumed = conditions(&self.conditions, &self.timeline);
        let drawn = if self.monte_carlo.about_the_truth {
            "runs: the drifts of the scheme, initial estimates drawn about them with the prior"
        } else {
            "truths drawn from the prior"
        };
        assumed.push(format!("carry {}; seed {}; {drawn}", self.carry, self.seed));
        let wrong = self.filter.as_ref();
        assumed.extend(wrong.map(|filter| format!("the filter is wrong on purpose: {filter}")));
        assumed.push(format!("a prediction is {}", wrong_below(self.error_bound)));
        blocks.push(DocumentBlock::list("Assumed", assumed));
        let verdict = match (self.passed, self.verdicts_agree) {
            (true, _) if self.counts.not_resolvable > 0 => {
                "filter and exact verdicts agree as far as resolvable"
            }
            (true, _) => "filter and exact verdicts agree",
            (false, true) if self.monte_carlo.unsettled > 0 && fits(&self.monte_carlo) => {
                "filter and exact verdicts agree, but some Monte Carlo runs (d) did NOT settle"
            }
            (false, true) => {
                "filter and exact verdicts agree, but the Monte Carlo runs (d) do NOT fit the filter"
            }
            (false, false) => "filter and exact verdicts DISAGREE",
        };
        Document { title: format!("Cross-check: {verdict} ({} carry)", self.carry), lead: lead(self), blocks }
    }
}
