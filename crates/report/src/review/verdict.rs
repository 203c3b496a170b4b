//! Verdict on a scheme in words, its limits first, and its status.

use obsdeg_core::degree::Status;
use obsdeg_design::review::SchemeReview;
use obsdeg_evidence::compare::{ComparedQuantity, ComparedScheme};
use obsdeg_evidence::simulation::Outcome;

use super::sections::{derivatives, duration, joined};
use crate::document::{Grade, StatusBox, StatusRow, number};
use crate::{gimbals, omitted, stated, words};

/// Name for the unknowns besides psi.
fn kind(coefficients: &[&ComparedQuantity]) -> &'static str {
    match coefficients.first() {
        Some(q) if q.name.starts_with("eps") => "components of the drift",
        _ if coefficients.iter().any(|q| !q.name.starts_with("D_")) => "coefficients",
        _ => "gyro coefficients",
    }
}

/// Reason why the small-angle model does not hold; `None` if it does.
fn small_angles(s: &SchemeReview) -> Option<String> {
    let v = &s.simulation.validity;
    (!v.holds).then(|| {
        format!(
            "the small-angle model does NOT hold for {}: |psi| reaches {} deg, which leaves out {} times the \
             noise of Z and {} deg/h of drift",
            stated::drifts(&s.simulation.conditions),
            number(v.largest_psi_deg),
            number(v.neglected_g / v.accelerometer_noise_g),
            number(v.neglected_dph)
        )
    })
}

/// Unknowns whose estimate in the run equals the prior.
pub(super) fn by_prior(s: &SchemeReview) -> Vec<&str> {
    let rests = |o: Outcome| matches!(o, Outcome::PriorOnly | Outcome::RestsOnPrior);
    s.simulation.quantities.iter().filter(|q| rests(q.outcome)).map(|q| q.name.as_str()).collect()
}

/// Unknowns with a degree that the samples of the dwell do not determine.
fn lost_with_dwell(s: &SchemeReview) -> Vec<&str> {
    let a = &s.analysis;
    let lost = a.quantities.iter().filter(|q| q.degree.is_some() && q.accuracy_order.is_none());
    lost.filter(|_| a.has_accuracy_orders).map(|q| q.name.as_str()).collect()
}

/// Answer to the question whether the checks of a filter agree.
pub(super) fn evidence(s: &SchemeReview) -> (Grade, String) {
    match &s.evidence {
        Ok(e) if e.passed => {
            let open = match e.counts.not_resolvable {
                0 => String::new(),
                n => format!(" but {n} that are not resolvable"),
            };
            (Grade::Good, format!("agree in every check{open}, {} Monte Carlo runs", e.monte_carlo.runs))
        }
        Ok(e) => {
            let n = e.disagreements.len();
            let checks = format!("{n} check{}", if n == 1 { "" } else { "s" });
            let what = match e.verdicts_agree {
                true => format!("agree, but the Monte Carlo runs do NOT fit the filter ({checks})"),
                false => format!("DISAGREE in {checks}"),
            };
            (Grade::Limited, what)
        }
        Err(e) => (Grade::Open, format!("not taken: {}", words::run::no_evidence(e))),
    }
}

/// Limits of the verdict, the gravest first.
pub(super) fn limits(s: &SchemeReview) -> Vec<String> {
    // drifts that are not stated limit no scheme
    let states_drifts = !stated::drifts_by_default(&s.simulation.conditions);
    let mut out: Vec<String> = small_angles(s).filter(|_| states_drifts).into_iter().collect();
    out.extend(gimbals::lead(s.analysis.gimbals.as_ref()));
    if !s.simulation.consistency.consistent {
        out.push(format!(
            "the run of the filter is NOT consistent with its truth ({})",
            words::run::doubts(&s.simulation.consistency)
        ));
    } else if !s.simulation.filter.trusted {
        out.push("the sigmas of the filter are not to be trusted at these drifts".into());
    }
    match evidence(s) {
        (Grade::Good, _) => {}
        (Grade::Limited | Grade::Missed, what) => out.push(format!("filter and exact verdicts {what}")),
        (Grade::Open, what) => out.push(format!("evidence by a filter is {what}")),
    }
    let prior = by_prior(s);
    if !prior.is_empty() {
        let (n, all) = (prior.len(), s.simulation.quantities.len());
        out.push(format!("{n} of {all} estimates rest on the prior ({})", words::names(prior)));
    }
    let lost = lost_with_dwell(s);
    if !lost.is_empty() {
        out.push(format!(
            "with dwell, {} are not determined although they have a degree",
            words::names(lost)
        ));
    }
    if !s.analysis.has_accuracy_orders {
        out.push("accuracy orders are not computed".into());
    }
    out
}

/// Advantage of samples over derivatives: the dwell, or dwell and slews.
fn dwell_or_slews(s: &SchemeReview) -> &'static str {
    if s.simulation.timeline.iter().any(|t| t.slew) { "dwell and slews" } else { "dwell" }
}

/// Requirements by prediction, which decides the grade, and in the run.
fn requirements(s: &SchemeReview, review: &ComparedScheme) -> (Grade, String) {
    let predicted = stated::requirements(&review.requirements);
    let run = stated::run_beside(&review.requirements, &s.simulation.run, &s.simulation.conditions);
    match (review.requirements.stated, review.requirements.all_met()) {
        (0, _) => (Grade::Open, predicted),
        (_, true) => (Grade::Good, format!("{predicted}; {run}")),
        (_, false) => (Grade::Missed, format!("{predicted}; {run}")),
    }
}

/// Verdict: missed requirements, limits, determined unknowns, accuracy.
pub(super) fn sentences(
    s: &SchemeReview,
    review: &ComparedScheme,
    coefficients: &[&ComparedQuantity],
) -> String {
    let with_dwell: Vec<&ComparedQuantity> =
        coefficients.iter().filter(|q| q.sigma.is_some()).copied().collect();
    let first = determined(s, coefficients, &with_dwell);
    let accuracy = accuracy(review, &with_dwell);
    let limits = limits(s);
    let filter = filter_agreement(s, limits.is_empty());
    let lead = if limits.is_empty() { String::new() } else { format!("Limited: {}. ", limits.join("; ")) };
    // margins and the run are in the status
    let missed = match requirements(s, review).0 {
        Grade::Missed => format!("{}. ", stated::capital(&stated::verdict(&review.requirements))),
        _ => String::new(),
    };
    format!("{missed}{lead}{first}. {accuracy}{filter}.")
}

/// Number of unknowns that the scheme determines, with their degrees, and the unknowns that it does not.
/// `with_dwell` are those of `coefficients` that samples determine.
fn determined(
    s: &SchemeReview,
    coefficients: &[&ComparedQuantity],
    with_dwell: &[&ComparedQuantity],
) -> String {
    let a = &s.analysis;
    let of = |status: Status| coefficients.iter().filter(move |q| q.status == status);
    let seen: Vec<&&ComparedQuantity> = of(Status::Observable).collect();
    let (all, what) = (coefficients.len(), kind(coefficients));
    let same = seen.iter().map(|q| &q.name).eq(with_dwell.iter().map(|q| &q.name));
    let mut first = match (seen.len(), same) {
        (n, true) if n == all => format!("The scheme determines every one of the {all} {what}"),
        (n, true) => format!("The scheme determines {n} of the {all} {what}"),
        (n, false) => format!(
            "The scheme determines {n} of the {all} {what} by derivatives, and {} of them with {}, during \
             which psi moves",
            with_dwell.len(),
            dwell_or_slews(s)
        ),
    };
    if let Some(worst) = seen.iter().filter_map(|q| q.degree).max() {
        let degrees = seen.iter().map(|q| (q.name.as_str(), q.degree));
        first.push_str(&format!(", {}", derivatives(worst, degrees)));
    }
    let partners = |q: &&&ComparedQuantity| {
        let verdict = a.quantities.iter().find(|v| v.name == q.name);
        let partners = verdict.map_or_else(String::new, |v| v.partners.join(", "));
        format!("{} from {partners}", q.name)
    };
    let lost: Vec<String> =
        of(Status::Inseparable).filter(|q| q.sigma.is_none()).map(|q| partners(&q)).collect();
    let lost = lost.join("; ");
    let silent = joined(of(Status::NotExcited).map(|q| q.name.as_str()));
    if !lost.is_empty() {
        first.push_str(&format!("; it cannot tell {lost}"));
    }
    if !silent.is_empty() {
        first.push_str(&format!("; it does not excite {silent}"));
    }
    first
}

/// Largest predicted sigma of the coefficients that samples determine, and the largest total with a bench.
fn accuracy(review: &ComparedScheme, with_dwell: &[&ComparedQuantity]) -> String {
    // other units do not compare
    let rates: Vec<&ComparedQuantity> = match with_dwell.iter().any(|q| q.unit.starts_with("deg/h")) {
        true => with_dwell.iter().filter(|q| q.unit.starts_with("deg/h")).copied().collect(),
        false => with_dwell.to_vec(),
    };
    let worst = rates.iter().filter_map(|q| Some((q, q.sigma?))).max_by(|x, y| x.1.total_cmp(&y.1));
    let accuracy = worst.map_or_else(
        || "None of them has a finite predicted sigma".to_string(),
        |(q, sigma)| {
            format!(
                "The largest predicted sigma of {} is {} {} ({}) after {}",
                if rates.len() == with_dwell.len() { "those" } else { "the drift coefficients" },
                number(sigma),
                q.unit,
                q.name,
                duration(review.total_s)
            )
        },
    );
    let total = rates.iter().filter_map(|q| Some((q, q.total?))).max_by(|x, y| x.1.total_cmp(&y.1));
    let total = total.map_or_else(String::new, |(q, total)| {
        format!(", with the bench the largest total uncertainty is {} {} ({})", number(total), q.unit, q.name)
    });
    format!("{accuracy}{total}")
}

/// Agreement of a filter with the verdicts, within limits or without.
fn filter_agreement(s: &SchemeReview, unlimited: bool) -> &'static str {
    match (&s.evidence, unlimited) {
        (Ok(e), true) if e.passed && e.counts.not_resolvable == 0 => {
            ", and the filter agrees with all verdicts"
        }
        (Ok(e), true) if e.passed => ", and the filter agrees with the verdicts as far as it shows them",
        (Ok(e), false) if e.passed => "; within these limits a filter agrees with the exact verdicts",
        _ => "",
    }
}

/// Sentences on errors outside the model that requirements rest on: of those without a stated size the sizes
/// that use up a margin.
fn outside(review: &ComparedScheme) -> String {
    let (of, r) = (&review.omitted, &review.requirements);
    let while_small = omitted::met_while(of, r.with_bench, false).filter(|_| r.all_met());
    let not_counted = omitted::not_counted(of, r.with_bench, r.all_met())
        .filter(|_| r.with_bench || !r.all_met() || while_small.is_some());
    not_counted.into_iter().chain(while_small).fold(String::from("."), |out, line| format!("{out} {line}"))
}

/// Status of a scheme.
pub(super) fn status(s: &SchemeReview, review: &ComparedScheme) -> StatusBox {
    let lost = lost_with_dwell(s);
    let every = review.quantities.iter().all(|q| q.status == Status::Observable) && lost.is_empty();
    let grade = |good: bool| if good { Grade::Good } else { Grade::Limited };
    let (checks, agreement) = evidence(s);
    let (required, requirements) = requirements(s, review);
    let requirements = match review.requirements.stated {
        0 => requirements,
        _ => format!("{requirements}{}", outside(review)),
    };
    let prior = by_prior(s);
    let mut rows = vec![
        row("Observable", grade(every), observable(s, review, &lost)),
        row("Requirements", required, requirements),
    ];
    let beyond = gimbals::lead(s.analysis.gimbals.as_ref());
    rows.extend(beyond.map(|text| row("Gimbals", Grade::Missed, text)));
    let small = match stated::drifts_by_default(&s.simulation.conditions) {
        true => Grade::Open,
        false => grade(s.simulation.validity.holds),
    };
    let holds = || format!("holds for {}", stated::drifts(&s.simulation.conditions));
    let consistent = s.simulation.consistency.consistent;
    rows.extend([
        row("Small-angle model", small, small_angles(s).unwrap_or_else(holds)),
        row("Filter, one run", grade(consistent && s.simulation.filter.trusted), one_run(s)),
        row("Filter and exact verdicts", checks, agreement),
        row(
            "Resting on the prior",
            grade(prior.is_empty()),
            if prior.is_empty() { "no estimate of the run".into() } else { words::names(prior) },
        ),
    ]);
    StatusBox { title: s.name.clone(), rows, actions: super::actions::of_scheme(s, review) }
}

/// Answer to one question of a status.
fn row(what: &'static str, grade: Grade, text: String) -> StatusRow {
    StatusRow { what, grade, text }
}

/// Numbers of observable unknowns, by derivatives and with dwell; `lost` have a degree that dwell takes away.
fn observable(s: &SchemeReview, review: &ComparedScheme, lost: &[&str]) -> String {
    let of = |psi: bool| review.quantities.iter().filter(move |q| q.name.starts_with("psi") == psi);
    let count = |psi: bool, seen: fn(&&ComparedQuantity) -> bool| {
        format!("{} of {}", of(psi).filter(seen).count(), of(psi).count())
    };
    let coefficients: Vec<&ComparedQuantity> = of(false).collect();
    let what = kind(&coefficients);
    let [by, with]: [fn(&&ComparedQuantity) -> bool; 2] =
        [|q| q.status == Status::Observable, |q| q.sigma.is_some()];
    let text = format!("{} {what}, {} of psi", count(false, by), count(true, by));
    let observable = if review.quantities.iter().all(|q| by(&q) == with(&q)) {
        text
    } else {
        let how = dwell_or_slews(s);
        format!("by derivatives {text}; with {how} {} and {}", count(false, with), count(true, with))
    };
    match lost.is_empty() {
        true => observable,
        false => format!("{observable}, without {}", words::names(lost.iter().copied())),
    }
}

/// Consistency of the run of the filter.
fn one_run(s: &SchemeReview) -> String {
    let consistency = &s.simulation.consistency;
    match (consistency.consistent, s.simulation.filter.trusted) {
        (true, true) => "consistent with its truth".into(),
        (true, false) => "consistent with its truth, which says little: its sigmas are not to be trusted at \
                          these drifts"
            .into(),
        (false, _) => format!("NOT consistent with its truth: {}", words::run::doubts(consistency)),
    }
}
