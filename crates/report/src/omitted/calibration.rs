//! Errors that a calibration does not estimate, in sentences.

use obsdeg_calibration::Calibration;
use obsdeg_calibration::answer::{Omitted, SilentError};
use obsdeg_calibration::levels::SUSPECT;
use obsdeg_evidence::simulation::omitted::{ChangePerUnit, SuspectedChange};

use super::sizes::{SMALLEST, below, limits};
use super::{CHANGES, OFF_UG, SILENT};
use crate::document::number;

/// Sentence on the effect of accelerometers that are off by 20 ug on a calibration.
pub(crate) fn accelerometers_off_in_record(c: &Calibration) -> String {
    let is_zero = |name: &str| name.starts_with("K0");
    if c.quantities.iter().any(|q| is_zero(&q.name)) {
        return format!(
            "Nothing changes: the scheme estimates K0, so that {OFF_UG} ug do not enter other estimates"
        );
    }
    if let Some(l) = c.omitted.limits.iter().find(|l| l.family == "K0") {
        let met = if OFF_UG < l.size { "every requirement stays met" } else { "requirements are NOT met" };
        return format!(
            "Errors K0 of {OFF_UG} ug (1 sigma each): {met}; all are met up to {} {}, from where that on {} is \
             missed first",
            below(l.size),
            l.unit,
            l.unknown
        );
    }
    let silent = c.omitted.silent.iter().filter(|s| is_zero(&s.name));
    let change = silent.flat_map(|s| s.sensitivities.iter().map(move |k| (s, k)));
    match change.max_by(|x, y| x.1.per_unit.abs().total_cmp(&y.1.per_unit.abs())) {
        Some((s, k)) => format!(
            "{} of {OFF_UG} {} changes {} by {} {}, and no record of this scheme shows it",
            s.name,
            s.unit,
            k.unknown,
            number(OFF_UG * k.per_unit.abs()),
            k.unit
        ),
        None if c.requirements.as_ref().is_some_and(|r| r.with_bench && r.all_met()) => {
            "The bench states K0: every uncertainty and margin here counts its size".into()
        }
        None => "Not computed for this record: the report of its scheme has the changes".into(),
    }
}

/// The silent errors of a calibration, as the condition of "consistent"; empty if none changes a
/// coefficient.
pub(crate) fn silent(of: &Omitted) -> String {
    if of.silent.is_empty() {
        return String::new();
    }
    let change = |c: &ChangePerUnit, unit: &str| {
        format!("changes {} by {} {} per {unit}", c.unknown, number(c.per_unit), c.unit)
    };
    // unknowns without a number, such as the scale factor that takes an error of third order up
    let named = |name: &String| format!("changes {name}");
    let one = |s: &SilentError| {
        let mut changes: Vec<String> = match s.sensitivities.is_empty() {
            false => s.sensitivities.iter().map(|c| change(c, &s.unit)).collect(),
            true => s.changes.iter().map(named).collect(),
        };
        let more = changes.len().saturating_sub(CHANGES);
        changes.truncate(CHANGES);
        changes.extend((more > 0).then(|| format!("{more} more changes in JSON")));
        format!("{} ({})", s.name, changes.join(", "))
    };
    let more = of.silent.len().saturating_sub(SILENT);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let listed: Vec<String> = of.silent.iter().take(SILENT).map(one).collect();
    format!("; silent here: {}{more}", listed.join("; "))
}

/// Sentences of a calibration on errors that it does not estimate.
pub(crate) fn calibration(of: &Omitted) -> Vec<String> {
    let mut out = vec![format!(
        "{} errors that are not estimated were tried on the residuals, each by a score test; a suspicion has a \
         chance of at most {:.1} % where nothing is wrong",
        of.tried,
        100.0 * SUSPECT
    )];
    let Some(s) = &of.suspicion else {
        out.push("no suspicion: chance explains the residuals as well as any of them".into());
        return out;
    };
    let errors: Vec<String> = s
        .errors
        .iter()
        .map(|e| format!("{} = {} +- {} {}", e.name, number(e.estimate), number(e.sigma), e.unit))
        .collect();
    let verb = match (s.explained, errors.len() > 1) {
        (true, true) => "explain the residuals",
        (true, false) => "explains the residuals",
        (false, true) => "explain most of the residuals, of all pairs, but not all of them",
        (false, false) => "explains most of the residuals, of all errors, but not all of them",
    };
    out.push(format!(
        "{} {verb}: chi-square falls by {} (probability by chance {})",
        errors.join(" and "),
        number(s.chi_square_fall),
        match s.probability > SMALLEST {
            true => format!("at most {:.1e}", s.probability),
            false => format!("below {SMALLEST:e}"),
        }
    ));
    // older answers name indistinguishable errors for the first error only
    let of_first = s.errors.iter().all(|e| e.indistinguishable.is_empty()).then_some(&s.indistinguishable);
    for (e, first) in s.errors.iter().zip(of_first.into_iter().map(Some).chain(std::iter::repeat(None))) {
        let others = first.unwrap_or(&e.indistinguishable);
        if !others.is_empty() {
            out.push(format!("this record does not distinguish {} from {}", e.name, others.join(", ")));
        }
    }
    let names: Vec<String> = s.errors.iter().map(|e| e.name.clone()).collect();
    out.push(estimated_by(&names));
    let with = if errors.len() > 1 { "them" } else { "it" };
    let others = if errors.len() > 1 { 0 } else { s.indistinguishable.len() };
    out.extend(s.changes.iter().map(|c| change(c, others, with)));
    out
}

/// Advice for estimating errors: terms to add to the scheme, or errors to measure.
pub(crate) fn estimated_by(errors: &[String]) -> String {
    let (mut terms, mut others) = (Vec::new(), Vec::new());
    for name in errors {
        let family = name.split(['_', '@']).next().unwrap_or(name);
        match family {
            "D" => terms.push(name[2..].trim_end_matches(['X', 'Y', 'Z']).to_string()),
            "M" => terms.push("M6".into()),
            "K0" | "K1" | "K2" | "K3" | "Kx" | "GS" | "GM" => terms.push(family.into()),
            _ => others.push(name.clone()),
        }
    }
    terms.dedup();
    let add = (!terms.is_empty()).then(|| format!("add {} to the terms of the scheme", terms.join(",")));
    let measure = (!others.is_empty())
        .then(|| format!("{} cannot be a term: measure it, and correct the scheme", others.join(", ")));
    add.into_iter().chain(measure).collect::<Vec<_>>().join("; ")
}

/// Sizes of biases and misalignments of the accelerometers up to which the requirements of a calibration are
/// met; empty where none are computed.
pub(crate) fn main_limits(c: &Calibration) -> String {
    let all = c.omitted.limits.iter().filter(|l| ["K0", "M"].contains(&l.family.as_str()));
    let listed: Vec<String> = all.map(|l| format!("{} < {} {}", l.family, below(l.size), l.unit)).collect();
    listed.join(", ")
}

/// Conditions of the requirements of a calibration: suspected errors, and sizes of errors that the bench does
/// not state.
pub(crate) fn of_requirements(c: &Calibration) -> Vec<String> {
    let Some(r) = &c.requirements else { return Vec::new() };
    let mut out = Vec::new();
    out.extend(c.omitted.suspicion.as_ref().map(|s| {
        let names: Vec<&str> = s.errors.iter().map(|e| e.name.as_str()).collect();
        format!(
            "The requirements count what {} would change of each estimate as an uncertainty.",
            names.join(" and ")
        )
    }));
    // sigmas that a finding contradicts leave no margin
    let all = c.omitted.limits.iter().filter(|_| c.consistent);
    let listed = limits(all.map(|l| (l.family.as_str(), l.size, l.unit.as_str(), String::new())));
    out.extend(listed.map(|listed| {
        let of = if r.with_bench { ", of what the bench does not state" } else { "" };
        let bench = if r.with_bench { "" } else { "No bench is stated. " };
        format!("{bench}Met while{of}, each family by itself, 1 sigma of each of its terms: {listed}.")
    }));
    out
}

/// Estimate with suspected errors among the unknowns. It is a range if indistinguishable errors give
/// different values.
fn change(c: &SuspectedChange, others: usize, with: &str) -> String {
    let (unknown, unit, estimate) = (&c.unknown, &c.unit, number(c.estimate));
    let [lowest, highest] = [c.lowest, c.highest].map(number);
    match others {
        0 => format!("with {with}, {unknown} is {} {unit}, not {estimate}", number(c.with)),
        _ if lowest == highest => {
            format!("with any of these, {unknown} is {lowest} {unit}, not {estimate}")
        }
        _ => format!(
            "with one of these, {unknown} is between {lowest} and {highest} {unit}, by which of them it is, \
             not {estimate}"
        ),
    }
}
