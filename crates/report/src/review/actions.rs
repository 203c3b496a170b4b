//! Recommended actions by the findings on a scheme, a model or a calibration.

use obsdeg_calibration::Calibration;
use obsdeg_calibration::answer::{CalibrationFinding, CellKind, ClockRate, Estimated, PositionFit};
use obsdeg_core::degree::Status;
use obsdeg_core::span::Span;
use obsdeg_core::system::{NumberOfSolutions, SystemQuantity};
use obsdeg_design::review::{ModelReview, SchemeReview};
use obsdeg_evidence::compare::ComparedScheme;
use obsdeg_evidence::requirements::Miss;

use super::sensitivity::fewest_of_all;
use crate::calibration_findings::{durations, is_clock};
use crate::document::number;
use crate::simulation::NOT_TRUSTED;
use crate::{gimbals, omitted, resolve, stated, words};

/// Advice for a run that is not consistent.
const INCONSISTENT: &str = "Do not use the filter's sigmas: its run is inconsistent with the truth.";
/// Advice if checks of the filter fail.
const FAILING: &str = "First explain the filter checks that fail (section Evidence by a filter).";

/// Advice for a calibration whose iteration did not settle.
const UNSETTLED: &str = "Look at units, labels and times of the record, and state first estimates near the truth \
                         in the scheme file.";

/// Actions for a scheme, the gravest first.
pub(super) fn of_scheme(s: &SchemeReview, review: &ComparedScheme) -> Vec<String> {
    let missed = |why: Miss| -> Vec<&str> {
        review.requirements.missed.iter().filter(|m| m.why == why).map(|m| m.name.as_str()).collect()
    };
    let mut out = unobservable(s, review, missed(Miss::NotObservable));
    let large = missed(Miss::TooLarge);
    if !large.is_empty() {
        let advised =
            review.omitted.advice.iter().find(|a| a.met).map(|a| format!("{}.", omitted::advised(a)));
        out.push(advised.unwrap_or_else(|| longer(s, review, &large)));
    }
    out.extend(missed_in_run(s, review));
    out.extend(large_angles(s));
    if gimbals::lead(s.analysis.gimbals.as_ref()).is_some() {
        out.push("Change positions or paths that the gimbals cannot follow (Positions).".into());
    }
    if !s.simulation.consistency.consistent {
        out.push(INCONSISTENT.into());
    } else if !s.simulation.filter.trusted {
        out.push(format!("{NOT_TRUSTED}."));
    }
    match &s.evidence {
        Ok(e) if !e.passed => out.push(FAILING.into()),
        _ => {}
    }
    if review.requirements.stated == 0 {
        out.push("State requirements: nothing says yet what is good enough.".into());
    }
    if out.is_empty() {
        out.push(no_action(s, review).into());
    }
    out
}

/// Actions for unknowns that the positions do not determine: required ones, and without requirements all.
fn unobservable(s: &SchemeReview, review: &ComparedScheme, required: Vec<&str>) -> Vec<String> {
    let mut out = Vec::new();
    let fewest = || fewest_of_all(s, review).map_or_else(String::new, |text| format!("; {text}"));
    if !required.is_empty() {
        out.push(format!(
            "Add or change positions: these do not determine {}{}.",
            words::names(required),
            fewest()
        ));
        out.extend(resolve::to_resolve_in_scheme(&s.analysis));
    }
    let stated = review.requirements.stated;
    let open: Vec<&str> = (review.quantities.iter())
        .filter(|q| stated == 0 && q.status != Status::Observable && q.sigma.is_none())
        .filter(|q| !q.name.starts_with("psi"))
        .map(|q| q.name.as_str())
        .collect();
    if !open.is_empty() {
        out.push(format!(
            "If you need {}, add or change positions: these do not determine them{}.",
            words::names(open),
            fewest()
        ));
    }
    out
}

/// Action for requirements that the run misses and the prediction does not; `None` without any.
fn missed_in_run(s: &SchemeReview, review: &ComparedScheme) -> Option<String> {
    let here: Vec<&str> = review.requirements.missed.iter().map(|m| m.name.as_str()).collect();
    let in_run = s.simulation.run.requirements.missed.iter().map(|m| m.name.as_str());
    let only_there: Vec<&str> = in_run.filter(|name| !here.contains(name)).collect();
    (!only_there.is_empty()).then(|| {
        format!(
            "Look at the run: it misses {} although the prediction does not ({}).",
            words::names(only_there),
            stated::run(&s.simulation.run, &s.simulation.conditions)
        )
    })
}

/// Action for drifts at which the small-angle model does not hold; `None` where it does.
fn large_angles(s: &SchemeReview) -> Option<String> {
    if s.simulation.validity.holds {
        return None;
    }
    let of = match stated::drifts_by_default(&s.simulation.conditions) {
        true => {
            "State the drifts of your gyros (true values of the simulation): at those of the paper, which \
             stand in their place, the small-angle model does not hold. Then compensate"
        }
        false => "At these drifts the small-angle model does not hold: compensate",
    };
    Some(format!(
        "{of} known drifts before the run, or use a filter with full attitudes (a simulation with the exact \
         truth shows its sigmas)."
    ))
}

/// Sentence of a scheme that needs no action.
fn no_action(s: &SchemeReview, review: &ComparedScheme) -> &'static str {
    match (review.requirements.all_met(), &s.evidence) {
        (false, _) => "Look at the unknowns without a number (Unknowns, Evidence by a filter).",
        (_, Ok(_)) => {
            "No action: every requirement is met, by prediction and in the run, and no \
             check fails."
        }
        (_, Err(_)) => {
            "No action from what was computed: every requirement is met, by prediction and in the run. \
             Evidence by a filter was not taken."
        }
    }
}

/// True if the sigma of an unknown alone meets its requirement.
fn sigma_meets(review: &ComparedScheme, name: &str) -> bool {
    let own = review.quantities.iter().find(|q| q.name == name);
    own.and_then(|q| q.sigma.zip(q.requirement)).is_some_and(|(sigma, required)| sigma <= required)
}

/// Advice on longer dwells for requirements that sigmas miss.
fn longer(s: &SchemeReview, review: &ComparedScheme, large: &[&str]) -> String {
    let required = |name: &str| review.quantities.iter().find(|q| q.name == name).and_then(|q| q.requirement);
    let meets = |row: &[Option<f64>], name: &str| {
        let sigma = s.dwells.names.iter().position(|n| n == name).and_then(|c| row[c]);
        sigma.zip(required(name)).is_some_and(|(sigma, required)| sigma <= required)
    };
    let longer = || s.dwells.x.iter().zip(&s.dwells.sigmas).filter(|(x, _)| **x > 1.0);
    let names = words::names(large.iter().copied());
    match longer().find(|(_, row)| large.iter().all(|name| meets(row, name))) {
        Some((factor, _)) => {
            format!(
                "Dwell {} times as long: by prediction this meets the requirement of {names}.",
                number(*factor)
            )
        }
        None if large.iter().all(|name| sigma_meets(review, name)) => {
            let tried = review
                .omitted
                .advice
                .iter()
                .min_by(|a, b| a.total_over_required.total_cmp(&b.total_over_required));
            let tried = tried.map_or_else(String::new, |a| {
                format!(" Best change that was tried: {}.", omitted::advised(a))
            });
            format!(
                "Change the positions, the bench or the requirements: for {names} sigma alone meets the \
                 requirement, the total with the bench does not.{tried}"
            )
        }
        None => {
            let most = s.dwells.x.last().copied().unwrap_or(1.0);
            let or_bench = if review.requirements.with_bench { ", the bench" } else { "" };
            format!(
                "Change the positions, the noise of Z{or_bench} or the requirements: dwells up to {} times \
                 as long do not meet those of {names}.",
                number(most)
            )
        }
    }
}

/// Actions for a model, the gravest first; `by_prior` has the unknowns whose estimate in the run equals the
/// prior.
pub(super) fn of_model(m: &ModelReview, by_prior: &[&str]) -> Vec<String> {
    let a = &m.analysis;
    let named = |of: &dyn Fn(&&SystemQuantity) -> bool| -> Vec<&str> {
        a.quantities.iter().filter(of).map(|q| q.name.as_str()).collect()
    };
    let mut out = Vec::new();
    if m.evidence.as_ref().is_some_and(|e| !e.passed) {
        out.push("First explain the checks that fail (section Evidence by samples and a filter).".into());
    }
    out.extend(resolve::to_resolve_in_model(a));
    let unseen = named(&|q| q.status == Status::NotSeen);
    if !unseen.is_empty() {
        out.push(format!(
            "Look at derivatives of orders above {} for {}: no end is proven.",
            a.last_order,
            words::names(unseen)
        ));
    }
    let several = named(&|q| matches!(q.number_of_solutions, Some(NumberOfSolutions::Counted(k)) if k > 1));
    if !several.is_empty() {
        out.push(format!(
            "Start near the truth, or add knowledge that distinguishes the solutions, for {}: the outputs \
             allow several.",
            words::names(several)
        ));
    }
    match &m.run {
        None => out
            .push("State numbers for a run in the model file: without them no accuracy is predicted.".into()),
        Some(r) if !r.run.consistency.consistent => out.push(INCONSISTENT.into()),
        Some(_) => {}
    }
    // what is not observable has an action above
    let prior: Vec<&str> = (by_prior.iter().copied())
        .filter(|name| a.quantities.iter().any(|q| q.name == *name && q.status == Status::Observable))
        .collect();
    if !prior.is_empty() {
        out.push(format!(
            "Make the run longer or the noise smaller for {}: the estimate relies on the prior.",
            words::names(prior)
        ));
    }
    if out.is_empty() {
        out.push(match &m.evidence {
            Some(_) => {
                "No action: every unknown is observable, the run is consistent with its truth, and no check fails."
                    .into()
            }
            None => {
                "No action from what was computed: every unknown is observable. No evidence was taken."
                    .into()
            }
        });
    }
    out
}

/// Actions for a calibration, the gravest first.
pub(super) fn of_calibration(c: &Calibration) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    for f in &c.findings {
        let line = of_finding(c, f);
        // several positions or components may give the same line
        if !out.contains(&line) {
            out.push(line);
        }
    }
    out.extend(undetermined(c));
    out.extend(missed_requirements(c));
    let met = c.requirements.as_ref().is_some_and(|r| !r.with_bench && r.all_met());
    let limits = if met && c.consistent { omitted::calibration::main_limits(c) } else { String::new() };
    if !limits.is_empty() {
        out.push(format!(
            "State the bench: without it errors outside the model count as zero, and the requirements are met \
             only while these are small ({limits}, each by itself)."
        ));
    }
    if out.is_empty() {
        out.push("No action: every unknown is determined, and model and sigmas explain the record.".into());
    }
    out
}

/// Actions for unknowns that the calibration does not determine.
fn undetermined(c: &Calibration) -> Vec<String> {
    let mut out = Vec::new();
    let without = |of: fn(&Estimated) -> bool| -> Vec<&str> {
        c.quantities.iter().filter(|u| !u.determined && of(u)).map(|u| u.name.as_str()).collect()
    };
    let by_scheme = without(|u| u.degree.is_none());
    if !by_scheme.is_empty() {
        out.push(format!(
            "Add or change positions for {}: the scheme does not determine them.",
            words::names(by_scheme)
        ));
    }
    let open = without(|u| u.left_open);
    if !open.is_empty() {
        out.push(format!(
            "State priors of the drifts as small as is true, or add positions, \
             for {}: the record leaves them open at these drifts.",
            words::names(open)
        ));
    }
    let by_record = without(|u| u.degree.is_some() && !u.left_open);
    if !by_record.is_empty() {
        out.push(format!(
            "Record longer or more runs for {}: these do not determine them.",
            words::names(by_record)
        ));
    }
    out
}

/// Actions for requirements that the record misses.
fn missed_requirements(c: &Calibration) -> Vec<String> {
    let mut out = Vec::new();
    let missed = c.requirements.iter().flat_map(|r| r.missed.iter().map(|m| m.name.as_str()));
    let missed = missed.filter(|name| c.quantities.iter().any(|q| q.name == *name && q.determined));
    let by_bench = |name: &&str| c.next_runs.iter().any(|n| n.unknown == *name && n.required_sigma == 0.0);
    let (by_bench, missed): (Vec<&str>, Vec<&str>) = missed.partition(by_bench);
    if !by_bench.is_empty() {
        out.push(format!(
            "Estimate the errors of the bench too, or make them smaller, for {}: the bench alone uses up their \
             requirements, so that no longer record meets them.",
            words::names(by_bench)
        ));
    }
    if !missed.is_empty() {
        out.push(format!(
            "Record longer, or one more position, for {}: by this record their requirements are NOT met \
             (a design of the next position after this calibration names it).",
            words::names(missed)
        ));
    }
    out
}

/// Action for positions whose residuals do not fit.
fn at_positions(c: &Calibration) -> String {
    let unfit: Vec<&PositionFit> = (c.findings.iter())
        .filter_map(|f| match f {
            CalibrationFinding::Position { record, position, .. } => {
                c.positions.iter().find(|p| p.record == *record && p.position == *position)
            }
            _ => None,
        })
        .collect();
    let names = words::names(unfit.iter().map(|p| p.position.as_str()));
    let without = match unfit[..] {
        [p] if p.loses.is_empty() => ". Without it every estimate remains".into(),
        [p] => {
            format!(
                ". Without it {} would have no estimate",
                words::names(p.loses.iter().map(String::as_str))
            )
        }
        _ if unfit.len() == c.positions.len() => {
            ". No position fits: it may be the record of another scheme".into()
        }
        _ => String::new(),
    };
    format!("Look at the record at {names}: attitudes, labels, rest{without}.")
}

/// Action for one finding of a calibration.
fn of_finding(c: &Calibration, f: &CalibrationFinding) -> String {
    match f {
        CalibrationFinding::Interrupted => "Run the same command again, to its end.".into(),
        CalibrationFinding::NotSettled => UNSETTLED.into(),
        CalibrationFinding::Clock { by_durations, by_durations_sigma, by_changes, by_earth, .. } => {
            let by_durations = durations(*by_durations, *by_durations_sigma);
            of_clock(by_durations.as_ref(), by_changes.as_ref(), by_earth.as_ref()).into()
        }
        CalibrationFinding::Cells { column, kind_of_cells, lines, .. } => {
            of_cells(column, *kind_of_cells, *lines)
        }
        CalibrationFinding::Succession { position, .. } => format!(
            "Look at the record around these lines: after a step of an output, run {position} again; where \
             the platform was disturbed, empty the cells of those rows."
        ),
        CalibrationFinding::ClockJump { line, by_s, .. } => format!(
            "Subtract {by_s:.1} s from the times from line {line} on, and calibrate again. Let loggers run by UTC or \
             by a clock that nobody sets."
        ),
        CalibrationFinding::Copy { record, .. } => format!("Leave {record} out: it is a copy."),
        CalibrationFinding::Turns { .. } => {
            "State the rate of the turns of this run, and calibrate again.".into()
        }
        CalibrationFinding::Force { .. } => {
            "Add scales and zeros of the accelerometers to the unknowns (K1, K0), or state the \
             gravity of the place, for forces in m/s^2."
                .into()
        }
        CalibrationFinding::Position { .. } => at_positions(c),
        CalibrationFinding::Noise { .. } | CalibrationFinding::Channel { .. } => {
            "Estimate the noise from the record, or use the rescaled sigmas instead of those of the \
             assumed noise."
                .into()
        }
        CalibrationFinding::Correlated { .. } => {
            "State noise with memory (random walk, bias instability), or add an unknown for what drifts: \
             sigmas of white noise are too small."
                .into()
        }
        CalibrationFinding::Temperature { .. } => {
            "Repeat the run at a steady temperature: the residuals follow it.".into()
        }
        CalibrationFinding::Outliers { .. } => "Check the noise of the record: too many of its samples are \
                                     far off."
            .into(),
        CalibrationFinding::Repeatability { .. } => {
            "Calibrate each record alone: the coefficients changed between the runs, or sigmas are too small."
                .into()
        }
        CalibrationFinding::SecondPath { .. } => {
            "Do not use the estimates: two ways to compute them do not agree.".into()
        }
        CalibrationFinding::Suspect { errors, .. } => format!(
            "Estimate the error that the residuals show, or repair the bench: {} ({}).",
            errors.join(" and "),
            omitted::calibration::estimated_by(errors)
        ),
        CalibrationFinding::Known { .. } => {
            "Calibrate without the earlier calibration: it does not agree with these records.".into()
        }
    }
}

/// Action for cells of a column that hold one value again and again.
fn of_cells(column: &str, kind: CellKind, Span { from: first, to: last }: Span<u64>) -> String {
    match kind {
        CellKind::Code => format!(
            "Look at column {column} of the record: state its codes of missing values in the scheme file."
        ),
        CellKind::Stuck => format!(
            "Look at column {column} of the record between lines {first} and {last}: empty the cells of a stuck \
             output."
        ),
    }
}

/// Action for a clock that is fast or slow by durations of positions, changes of position or the earth rate.
fn of_clock(
    by_durations: Option<&ClockRate>,
    by_changes: Option<&ClockRate>,
    by_earth: Option<&ClockRate>,
) -> &'static str {
    match (by_changes, by_durations, by_earth) {
        (Some(_), ..) => {
            "Compare the times of the record and of its positions with those of its run: either the clock is \
             wrong, and drifts by the same part, or the scheme has other times."
        }
        (None, Some(_), Some(_)) if is_clock(by_durations, by_earth) => {
            "Correct the times of the record: its clock fits neither the scheme nor the earth rate. \
             Drifts are wrong by the same part or more."
        }
        (None, _, Some(_)) => {
            "Look at latitude, rate of turns and times of the record, and at errors that are no \
             unknowns: its rates are not those of the scheme."
        }
        (None, _, None) => {
            "Compare the times of the record with those of its run: if its clock is wrong, drifts are \
             wrong by the same part or more."
        }
    }
}
