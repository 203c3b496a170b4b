//! One run of the filter.

use std::collections::BTreeMap;

use obsdeg_core::model::settings::{FilterKind, Propagation, Truth};
use obsdeg_evidence::simulation::{
    CoefficientFloor, ConditionsReport, Estimate, FilterReason, FilterReport, NoiseFloor, Outcome,
    Simulation, TimelineReport, Validity,
};

use crate::document::{Document, DocumentBlock, left, number, optional, right};
use crate::{Answer, gimbals, omitted, stated, words};

/// Assumptions of a run, one sentence each.
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
            let turn = t.turn.map_or_else(String::new, |turn| format!(" by {}", words::turn(&turn)));
            format!("{what}{}{turn} {}-{} s", t.position, number_short(t.start_s), number_short(t.end_s))
        })
        .collect();
    let mut out = vec![
        format!("truth {truth}"),
        format!("latitude {} deg{by}", c.latitude_deg),
        format!(
            "noise: Z {:e} g per sample and axis, random drift {}",
            c.accelerometer_noise_g,
            drift_noise(c)
        ),
        format!("steps of at most {} s, filter propagated by {propagation}", c.step_s),
        format!("repositioning {slew}"),
        format!("timeline {}", parts.join(", ")),
    ];
    out.extend(c.settle_s.map(words::run::settle));
    if c.drift_scale != 1.0 {
        out.push(format!("true drifts and their priors times {}", c.drift_scale));
    }
    out.extend(c.gyro_noise.as_ref().map(words::run::gyro_noise));
    let accelerometers = |b| format!("{}: states of filter and truth", words::run::accelerometer_bias(b));
    out.extend(c.accelerometer_bias.as_ref().map(accelerometers));
    out.extend(warning(c));
    out
}

/// Density of the random drift, or its range over the steps.
fn density(c: &ConditionsReport) -> String {
    let [low, high] = c.drift_noise_density_deg_sqrt_h.map(number);
    if low == high { format!("{low} deg/sqrt(h)") } else { format!("{low} to {high} deg/sqrt(h)") }
}

/// Random drift as it was given; a bias held for one step also as a density.
fn drift_noise(c: &ConditionsReport) -> String {
    match c.drift_noise_step_s {
        Some(_) => format!("{} held for one step: {}", c.drift_noise, density(c)),
        None => c.drift_noise.clone(),
    }
}

/// Warning that a bias held for one step was given for steps of another length.
pub(crate) fn warning(c: &ConditionsReport) -> Option<String> {
    let step = c.drift_noise_step_s.filter(|_| c.drift_noise_differs)?;
    Some(format!(
        "warning: the random drift, {} held for one step, was given for steps of {step} s; with the steps \
         here its density is another, {}: a density in deg/sqrt(h) does not depend on them",
        c.drift_noise,
        density(c)
    ))
}

fn number_short(x: f64) -> String {
    let text = format!("{x:.1}");
    text.strip_suffix(".0").map_or(text.clone(), String::from)
}

/// Sentences on whether the small-angle model holds, with its figures.
pub(crate) fn validity(v: &Validity, c: &ConditionsReport) -> Vec<String> {
    let drifts = stated::drifts(c);
    let ratio = v.neglected_g / v.accelerometer_noise_g;
    let required = v
        .smallest_requirement_dph
        .map_or_else(String::new, |t| format!(" against the required {} deg/h", number(t)));
    let head = if v.holds {
        format!("the small-angle model holds for {drifts}")
    } else {
        format!(
            "the small-angle model does NOT hold for {drifts}: a real platform would not follow the linear filter"
        )
    };
    vec![
        head,
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

/// Filter that ran, and the reason for it.
pub(crate) fn filter(f: &FilterReport) -> Vec<String> {
    let (what, passes) = match f.kind {
        FilterKind::Linear => ("linear: small angles, gains known beforehand".into(), String::new()),
        FilterKind::Extended => {
            ("extended: full attitudes, Jacobians at the estimate of the moment".into(), String::new())
        }
        FilterKind::Iterated => (
            format!("iterated: full attitudes, linearised along the whole run, {} times", f.passes),
            if f.converged { String::new() } else { ", which did NOT settle".into() },
        ),
    };
    let why = match f.reason {
        FilterReason::Given => "as asked for",
        FilterReason::LinearTruth => "chosen since the truth is that of the linear model",
        FilterReason::Valid => "chosen since the small-angle model holds for this truth",
        FilterReason::NotValid => "chosen since the small-angle model does not hold for this truth",
    };
    let mut out = vec![format!("{what}{passes}; {why}")];
    if f.kind != FilterKind::Linear {
        out.push(
            "verdicts and degrees are those of small angles; what a filter learns beyond them comes of the \
             attitudes that drift reached"
                .into(),
        );
    }
    if !f.trusted {
        let why = match f.kind {
            FilterKind::Linear => "its model leaves out what the large angles do",
            _ => "it is linearised before the drifts are known",
        };
        out.push(format!(
            "do not trust the sigmas of this filter where the small-angle model does not hold, at the truth \
             or within the prior of psi: {why}; one run that is consistent does not show that they are \
             right; the iterated filter (--filter iterated) is linearised along the whole run"
        ));
    }
    out
}

/// Row on the linear filter's estimate from the same measurements.
fn linear(e: &Estimate) -> Option<Vec<String>> {
    let l = e.linear?;
    let [error, sigma, own] = [l.error, l.sigma, e.sigma].map(number);
    Some(vec![e.name.clone(), e.unit.clone(), own, sigma, error, format!("{:.2}", l.error / l.sigma)])
}

/// Outcome of an unknown. `missed by the bench` if sigma alone meets the requirement and the total does not.
fn outcome(e: &Estimate) -> &'static str {
    match (e.outcome, e.required_sigma) {
        (Outcome::Converging, Some(required)) if e.sigma <= required => "missed by the bench",
        (outcome, _) => words::run::outcome(outcome),
    }
}

fn row(e: &Estimate) -> Vec<String> {
    let mut out = vec![e.name.clone(), e.unit.clone()];
    out.extend(words::run::estimate(e.degree, [e.truth, e.estimate, e.error, e.sigma], e.error_over_sigma));
    out.extend([optional(e.predicted_sigma), optional(e.time_to_requirement_s), outcome(e).into()]);
    out
}

/// Requirements such as `0.1 deg/h`: one per unit, or by name if they differ.
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

/// Sentences on estimates that rest on priors, one for each group of unknowns that share them.
fn priors(quantities: &[Estimate], filter: FilterKind) -> Vec<String> {
    let mut groups: BTreeMap<Vec<usize>, Vec<&str>> = BTreeMap::new();
    for (i, q) in quantities.iter().enumerate().filter(|(_, q)| !q.prior_of.is_empty()) {
        let of = |(k, o): (usize, &Estimate)| (k == i || q.prior_of.contains(&o.name)).then_some(k);
        groups.entry(quantities.iter().enumerate().filter_map(of).collect()).or_default().push(&q.name);
    }
    let line = |(of, who): (Vec<usize>, Vec<&str>)| {
        let of = words::names(of.iter().map(|&k| quantities[k].name.as_str()));
        format!("{}: on the priors of {of} together, which the outputs do not tell apart", words::names(who))
    };
    let mut out: Vec<String> = groups.into_iter().map(line).collect();
    if filter != FilterKind::Linear && !out.is_empty() {
        let text = "this is said of small angles: with the full attitudes of this filter other priors may \
                    bear on these estimates too";
        out.push(text.into());
    }
    out
}

/// Advice for a consistent run of a filter whose model is not valid.
pub(crate) const NOT_TRUSTED: &str = "Do not trust the filter's sigmas, although this run is consistent: the \
                                      small-angle model does not hold, at the truth or within the prior of \
                                      psi, and the filter is not linearised along the whole run. Use the \
                                      iterated filter (--filter iterated)";

/// First lines: requirements by prediction and in the run, then the carry and the conditions that are not
/// stated.
fn lead(s: &Simulation) -> Vec<String> {
    let [predicted, run] = [stated::requirements(&s.requirements), stated::run(&s.run, &s.conditions)]
        .map(|t| stated::capital(&t));
    let mut out = vec![format!("{predicted}."), format!("{run}.")];
    if !s.consistency.consistent {
        let whose = if stated::drifts_by_default(&s.conditions) && s.conditions.states_priors() {
            ", which is the paper's, against the priors that are stated: state the drifts (--value) or leave \
             this run out of account"
        } else {
            ""
        };
        out.push(format!("Do not use the filter's sigmas: its run is inconsistent with the truth{whose}."));
    }
    if s.consistency.consistent && !s.filter.trusted {
        out.push(format!("{NOT_TRUSTED}."));
    }
    out.extend(gimbals::lead(s.gimbals.as_ref()));
    out.push(stated::carry(s.carry).into());
    out.extend(omitted::lead(&s.omitted, s.requirements.with_bench, s.requirements.all_met()));
    out.extend(stated::other_carries(&s.other_carries));
    out.extend(stated::by_default_in_run(&s.conditions, &s.quantities));
    out.extend(warning(&s.conditions));
    out
}

/// Meaning of the degree in the table of estimates.
fn degree_heading(s: &Simulation) -> &'static str {
    // torquer errors act in slews, which the verdicts assume to be fast
    let torqued = s.quantities.iter().any(|q| q.name.starts_with("GS_") || q.name.starts_with("GM_"));
    if torqued && s.timeline.iter().any(|t| t.slew) {
        "exact verdict of turns fast against the earth rate, - not observable; outcome: with the slews"
    } else if s.timeline.iter().any(|t| t.slew) {
        "exact verdict of repositioning at once, - not observable; outcome: with the slews"
    } else {
        "exact verdict, - not observable"
    }
}

/// Tables of the estimates of unknowns and of combinations.
fn estimates(s: &Simulation) -> Vec<DocumentBlock> {
    let mut columns = vec![left("unknown"), left("unit")];
    columns.extend(words::run::ESTIMATE.map(right));
    columns.extend([right("predicted"), right("at [s]"), left("outcome")]);
    let table = |heading: &str, rows: &[Estimate]| {
        DocumentBlock::table(heading, columns.clone(), rows.iter().map(row))
    };
    let degree = degree_heading(s);
    let bench = match s.requirements.with_bench {
        true => ", where the total with the bench does; reached: the total",
        false => "",
    };
    let mut blocks = vec![table(
        &format!(
            "Estimates at the end (degree: {degree}; predicted: sigma by what is stated; at: when sigma met the \
             requirement{bench})"
        ),
        &s.quantities,
    )];
    if !s.combinations.is_empty() {
        blocks.push(table("Combinations (psi: of the end)", &s.combinations));
    }
    blocks
}

/// Table of the linear filter on the same measurements.
fn beside_linear(s: &Simulation) -> DocumentBlock {
    let numbers = ["sigma", "linear: sigma", "error", "in sigma"].map(right);
    let columns: Vec<_> = [left("unknown"), left("unit")].into_iter().chain(numbers).collect();
    let rows = s.quantities.iter().chain(&s.combinations).filter_map(linear);
    DocumentBlock::table("Beside it, the linear filter on the same measurements", columns, rows)
}

/// Sentences on the consistency of the run.
fn consistency(s: &Simulation) -> Vec<String> {
    let mut consistency = words::run::consistency(&s.consistency);
    if s.consistency.consistent && !s.filter.trusted {
        consistency[0] = "this run is consistent with its truth, which says little of this filter (see \
                          Filter): the errors of many runs decide (obsdeg crosscheck)"
            .into();
    }
    consistency
}

/// Noise floor of the coefficients, with its meaning.
fn noise_floor(f: &NoiseFloor) -> [DocumentBlock; 2] {
    let mut columns = vec![left("coefficient"), left("unit")];
    columns.extend(words::run::FLOOR.map(right));
    let row =
        |c: &CoefficientFloor| [vec![c.name.clone(), c.unit.clone()], words::run::floor(c).into()].concat();
    let means = words::run::FLOOR_MEANS.map(String::from).into_iter().chain(words::run::floor_of(f));
    [
        DocumentBlock::table("Noise floor", columns, f.coefficients.iter().map(row)),
        DocumentBlock::list("Noise floor: what it is", means.collect()),
    ]
}

/// Conditions of the run, with its carry, seed, requirements and bench.
fn assumed(s: &Simulation) -> Vec<String> {
    let mut assumed = conditions(&s.conditions, &s.timeline);
    assumed.push(format!("carry {}; seed {}", s.carry, s.seed));
    let required = requirements(&s.quantities);
    if !required.is_empty() {
        assumed.push(format!("required sigma {}", required.join(", ")));
    }
    assumed.extend(s.conditions.bench.as_deref().map(words::assumptions::bench));
    assumed
}

impl Answer for Simulation {
    fn layout(&self) -> Option<&str> {
        Some(&self.schema)
    }

    fn document(&self) -> Document {
        let mut blocks = estimates(self);
        blocks.extend(DocumentBlock::list_if_any(
            "Known from the prior only: on which priors",
            priors(&self.quantities, self.filter.kind),
        ));
        blocks.extend(omitted::blocks(&self.omitted, ""));
        blocks.push(DocumentBlock::list("Filter", filter(&self.filter)));
        if self.filter.kind != FilterKind::Linear {
            blocks.push(beside_linear(self));
        }
        blocks.push(DocumentBlock::list("Consistency", consistency(self)));
        blocks.push(DocumentBlock::list(
            "Validity of the small-angle model",
            validity(&self.validity, &self.conditions),
        ));
        blocks.extend(self.noise_floor.iter().flat_map(noise_floor));
        blocks.extend(gimbals::block(self.gimbals.as_ref()));
        blocks.push(DocumentBlock::list("Assumed", assumed(self)));
        let positions = self.timeline.iter().filter(|t| !t.slew).count();
        let end = self.timeline.last().map_or(0.0, |t| t.end_s);
        Document {
            title: format!(
                "Simulation: {positions} position{}, {} carry, {} s",
                if positions == 1 { "" } else { "s" },
                self.carry,
                number_short(end)
            ),
            lead: lead(self),
            blocks,
        }
    }
}
