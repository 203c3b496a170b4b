//! One run of the filter.

use obsdeg_core::simulation::answer::{ConditionsReport, Estimate, Simulation, TimelineReport, Validity};
use obsdeg_core::simulation::conditions::{Propagation, Truth};

use crate::document::{Block, Document, number, optional};
use crate::words;

/// What a run assumes, a sentence each.
pub(crate) fn conditions(c: &ConditionsReport, timeline: &[TimelineReport]) -> Vec<String> {
    let truth = match c.truth {
        Truth::Linear => "linear: the model of the filter itself",
        Truth::Exact => {
            "exact: direction cosines, specific force in the true platform frame, drift at the true attitude"
        }
    };
    let slew = match (timeline.iter().any(|t| t.slew), c.slew_rate_deg_s) {
        (false, _) => "instantaneous".into(),
        (true, Some(r)) => format!("{r} deg/s unless the position says otherwise, Z not used meanwhile"),
        (true, None) => "as the positions say, Z not used meanwhile".to_string(),
    };
    let by = if c.latitude_by_default { " (chosen here: the scheme names none)" } else { "" };
    let propagation = match c.propagation {
        Propagation::Exponential => "matrix exponential",
        Propagation::Rk4 => "Runge-Kutta of order 4",
    };
    let parts: Vec<String> = timeline
        .iter()
        .map(|t| {
            let what = if t.slew { "slew to " } else { "" };
            format!("{what}{} {}-{} s", t.position, number_short(t.start_s), number_short(t.end_s))
        })
        .collect();
    let mut out = vec![
        format!("truth {truth}"),
        format!("latitude {} deg{by}", c.latitude_deg),
        format!(
            "noise: Z {:e} g per sample and axis, random drift {}",
            c.accelerometer_noise_g, c.drift_noise
        ),
        format!("steps of at most {} s, filter propagated by {propagation}", c.step_s),
        format!("repositioning {slew}"),
        format!("timeline {}", parts.join(", ")),
    ];
    if c.drift_scale != 1.0 {
        out.push(format!("true drifts and their priors times {}", c.drift_scale));
    }
    out
}

fn number_short(x: f64) -> String {
    let text = format!("{x:.1}");
    text.strip_suffix(".0").map_or(text.clone(), String::from)
}

/// Why the small-angle model holds or does not, with its figures.
pub(crate) fn validity(v: &Validity) -> Vec<String> {
    let ratio = v.neglected_g / v.accelerometer_noise_g;
    let required = v
        .smallest_requirement_dph
        .map_or_else(String::new, |t| format!(" against the required {} deg/h", number(t)));
    let head = if v.holds {
        "the small-angle model holds for these drifts"
    } else {
        "the small-angle model does NOT hold for these drifts: a real platform would not follow the linear filter"
    };
    vec![
        head.into(),
        format!("|psi| reaches {} deg", number(v.largest_psi_deg)),
        format!(
            "the observation (6) leaves out |psi|^2/2 = {} g, {} times the noise of Z ({} g)",
            number(v.neglected_g),
            number(ratio),
            format_args!("{:e}", v.accelerometer_noise_g)
        ),
        format!("the drift (3) leaves out D |psi| = {} deg/h{required}", number(v.neglected_dph)),
    ]
}

fn row(e: &Estimate) -> Vec<String> {
    vec![
        e.name.clone(),
        e.unit.clone(),
        words::degree(e.degree),
        number(e.truth),
        number(e.estimate),
        number(e.error),
        number(e.sigma),
        format!("{:.2}", e.error_over_sigma),
        optional(e.time_to_requirement_s),
        e.verdict.to_string(),
    ]
}

/// `0.1 deg/h`, one for every unit, or by name where they differ.
fn requirements(quantities: &[Estimate]) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for q in quantities {
        let Some(required) = q.required_sigma else { continue };
        let uniform = quantities.iter().all(|o| o.unit != q.unit || o.required_sigma == q.required_sigma);
        let text = format!("{required} {}", q.unit);
        let text = if uniform { text } else { format!("{} {text}", q.name) };
        if !out.contains(&text) {
            out.push(text);
        }
    }
    out
}

pub(crate) fn document(s: &Simulation) -> Document {
    let header = vec![
        "unknown",
        "unit",
        "degree",
        "truth",
        "estimate",
        "error",
        "sigma",
        "error/sigma",
        "t to required [s]",
        "verdict",
    ];
    let numbers = vec![false, false, true, true, true, true, true, true, true, false];
    let table = |heading: &str, rows: &[Estimate]| Block::Table {
        heading: heading.into(),
        header: header.clone(),
        numbers: numbers.clone(),
        rows: rows.iter().map(row).collect(),
    };
    let list = |heading: &str, lines: Vec<String>| Block::List { heading: heading.into(), lines };
    let end = s.timeline.last().map_or(0.0, |t| t.end_s);
    let mut blocks =
        vec![table("Estimates at the end (degree: exact verdict, - not observable)", &s.quantities)];
    if !s.combinations.is_empty() {
        blocks.push(table("Combinations (psi: of the end)", &s.combinations));
    }
    let c = &s.consistency;
    let band = |(low, high): (f64, f64)| format!("{}..{}", number(low), number(high));
    let verdict = if c.consistent {
        "the filter is consistent with this truth"
    } else {
        "the filter is NOT consistent with this truth"
    };
    blocks.push(list(
        "Consistency",
        vec![
            verdict.into(),
            format!("mean NIS {} (95 %: {})", number(c.nis), band(c.nis_band)),
            format!("NEES at the end {} (95 %: {})", number(c.nees), band(c.nees_band)),
            format!("innovations white: probability {}", number(c.whiteness_probability)),
        ],
    ));
    blocks.push(list("Validity of the small-angle model", validity(&s.validity)));
    let mut assumed = conditions(&s.conditions, &s.timeline);
    assumed.push(format!("carry {}; seed {}", s.carry, s.seed));
    assumed.push(format!("required sigma {}", requirements(&s.quantities).join(", ")));
    blocks.push(list("Assumed", assumed));
    let positions = s.timeline.iter().filter(|t| !t.slew).count();
    Document {
        title: format!(
            "Simulation: {positions} position{}, {} carry, {} s",
            if positions == 1 { "" } else { "s" },
            s.carry,
            number_short(end)
        ),
        lead: Vec::new(),
        blocks,
    }
}
