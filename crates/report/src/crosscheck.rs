//! The cross-check of exact verdicts and filter.

use obsdeg_evidence::crosscheck::{Check, CrossCheck, Statistic};

use crate::document::{Block, Document, number, optional};
use crate::simulation::{conditions, validity, warning};
use crate::words::{self, band};

/// What was not measured is neither.
fn mark(pass: impl Into<Option<bool>>) -> String {
    match pass.into() {
        Some(true) => "pass",
        Some(false) => "FAIL",
        None => "-",
    }
    .into()
}

/// The mark of a slope; one that was measured and is none is no failure.
fn slope(c: &Check) -> String {
    if c.measured.is_some() && c.pass.is_none() { "not resolvable".into() } else { mark(c.pass) }
}

fn measured(c: &Check) -> String {
    let text = c.measured.map_or_else(|| "-".into(), |x| format!("{x:.3}"));
    if text == "-0.000" { "0.000".into() } else { text }
}

pub(crate) fn document(c: &CrossCheck) -> Document {
    let mut blocks = Vec::new();
    let mut table = |heading: &str, header: Vec<&'static str>, numbers: Vec<bool>, rows: Vec<Vec<String>>| {
        if !rows.is_empty() {
            blocks.push(Block::Table { heading: heading.into(), header, numbers, rows });
        }
    };
    table(
        "a. slope of log sigma (psi: of the start) against log dwell; b. factor on sigma (psi: of the end) for a prior variance times 100",
        vec![
            "unknown",
            "degree",
            "accuracy order",
            "slope predicted",
            "measured",
            "",
            "factor predicted",
            "measured",
            "",
        ],
        vec![false, true, true, true, true, false, true, true, false],
        c.quantities
            .iter()
            .map(|q| {
                vec![
                    q.name.clone(),
                    words::degree(q.degree),
                    words::accuracy_order(q.degree, q.accuracy_order, true),
                    format!("{:.1}", q.slope.predicted),
                    measured(&q.slope),
                    slope(&q.slope),
                    format!("{:.0}", q.inflation.predicted),
                    measured(&q.inflation),
                    mark(q.inflation.pass),
                ]
            })
            .collect(),
    );
    table(
        "b. directions that Z does not see (SI units)",
        vec!["direction", "part of it seen", "", "correlation, signed", ""],
        vec![false, true, false, true, false],
        c.null_space
            .iter()
            .map(|v| {
                vec![
                    v.direction.clone(),
                    v.seen.measured.map_or_else(|| "-".into(), |x| format!("{x:.1e}")),
                    mark(v.seen.pass),
                    v.correlation.map_or_else(
                        || "-".into(),
                        |k| k.measured.map_or_else(String::new, |x| format!("{x:.6}")),
                    ),
                    v.correlation.map_or_else(String::new, |k| mark(k.pass)),
                ]
            })
            .collect(),
    );
    let mut rows = vec![vec![
        "b. directions not seen".to_string(),
        c.defect.predicted.to_string(),
        c.defect.measured.to_string(),
        String::new(),
        mark(c.defect.pass),
    ]];
    for d in &c.covariance {
        rows.push(vec![
            format!("c. {}", d.name),
            "0".into(),
            format!("{:.1e}", d.difference),
            format!("up to {:.0e}", d.limit),
            mark(d.pass),
        ]);
    }
    let statistic = |s: &Statistic| {
        vec![
            format!("d. {}, {} runs", s.name, c.monte_carlo.runs),
            number(s.expected),
            number(s.measured),
            format!("{} (99.9 %: {})", band(s.band), band(s.wide_band)),
            mark(s.pass),
        ]
    };
    rows.extend(c.monte_carlo.statistics.iter().map(statistic));
    rows.push(vec![
        "d. innovations white".into(),
        String::new(),
        number(c.monte_carlo.whiteness_probability),
        "above 0.001".into(),
        mark(c.monte_carlo.white),
    ]);
    rows.push(vec![
        "e. Kendall tau-b of predicted and measured orders".into(),
        "1".into(),
        c.ranking.kendall_tau.map_or_else(|| "all tied".into(), number),
        String::new(),
        mark(c.ranking.pass),
    ]);
    for k in &c.controls {
        rows.push(vec![
            format!("f. {}: failing checks of a, b; NIS", k.name),
            "fails".into(),
            format!("{} of {}; {}", k.failed, k.checks, number(k.nis)),
            format!("(99.9 %: {})", band(k.band)),
            mark(k.pass),
        ]);
    }
    table(
        "The filter as a whole",
        vec!["evidence", "predicted", "measured", "band (95 %)", ""],
        vec![false, true, true, false, false],
        rows,
    );
    let mut list =
        |heading: &str, lines: Vec<String>| blocks.push(Block::List { heading: heading.into(), lines });
    if !c.disagreements.is_empty() {
        list("What disagrees", c.disagreements.clone());
    }
    list("Validity of the small-angle model", validity(&c.validity));
    let mut assumed = conditions(&c.conditions, &c.timeline);
    assumed.push(format!("carry {}; seed {}; truths drawn from the prior", c.carry, c.seed));
    if let Some(filter) = &c.filter {
        assumed.push(format!("the filter is wrong on purpose: {filter}"));
    }
    assumed.push(format!("a prediction is wrong with probability below {:.0e}", c.error_bound));
    list("Assumed", assumed);
    let verdict = match (c.passed, c.verdicts_agree) {
        (true, _) => "filter and exact verdicts agree",
        (false, true) => {
            "filter and exact verdicts agree, but the Monte Carlo runs (d) do NOT fit the filter"
        }
        (false, false) => "filter and exact verdicts DISAGREE",
    };
    let mut lead: Vec<String> = warning(&c.conditions).into_iter().collect();
    lead.push(format!("{} of {} accuracy orders measured", c.orders.measured, c.orders.of));
    if c.timeline.iter().any(|t| t.slew) {
        lead.push(
            "a, b, c and f are taken with instantaneous repositioning, as the exact verdicts: a slew of finite duration moves psi by \
             drifts of its own; d knows of the slews"
                .into(),
        );
    }
    if !c.passed && !c.validity.holds && c.conditions.truth == obsdeg_core::model::settings::Truth::Exact {
        lead.push(format!(
            "the truth is exact and the drifts are too large for the linear model: |psi| reaches {} deg, so (6) leaves out {} times the noise of Z",
            number(c.validity.largest_psi_deg),
            optional(Some(c.validity.neglected_g / c.validity.accelerometer_noise_g))
        ));
    }
    Document { title: format!("Cross-check: {verdict} ({} carry)", c.carry), lead, blocks }
}
