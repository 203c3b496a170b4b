//! Model as part of a review.

use obsdeg_core::degree::Status;
use obsdeg_core::system::{NumberOfSolutions, SystemAnalysis, SystemQuantity};
use obsdeg_design::review::{ModelReview, ModelRun, WithoutOutput};
use obsdeg_evidence::simulation::Outcome;
use obsdeg_evidence::system::{SystemEstimate, SystemEvidence};

use super::answers::{self, Answers};
use super::evidence::ERRORS;
use super::pictures;
use super::sections::{derivatives, is_list, section};
use crate::document::{DocumentBlock, Grade, StatusBox, StatusRow, TableCell, number};
use crate::{Answer, stated, system, words};

/// Verdict on a model: its limits, and the determined unknowns.
fn verdict(m: &ModelReview) -> String {
    let a = &m.analysis;
    let seen: Vec<_> = a.quantities.iter().filter(|q| q.status == Status::Observable).collect();
    let worst = seen.iter().filter_map(|q| q.degree).max();
    let derivatives = worst.map_or_else(String::new, |k| {
        format!(", {}", derivatives(k, seen.iter().map(|q| (q.name.as_str(), q.degree))))
    });
    let what = match a.rests_on_bound {
        true => format!("no derivative up to order {}", a.last_order),
        false => "no output".into(),
    };
    let lost = match a.unobservable_directions {
        0 => "nothing is lost".to_string(),
        1 => format!("one direction changes {what}"),
        n => format!("{n} independent directions change {what}"),
    };
    let limits = limits(m);
    let whole = |e: &SystemEvidence| e.passed && e.not_resolvable == 0 && e.orders.measured == e.orders.of;
    let filter = match &m.evidence {
        Some(e) if whole(e) && limits.is_empty() => {
            " The information of a simulated run agrees with all verdicts."
        }
        Some(e) if e.passed => {
            " The information of a simulated run agrees with the verdicts as far as it shows them."
        }
        _ => "",
    };
    let lead = if limits.is_empty() { String::new() } else { format!("Limited: {}. ", limits.join("; ")) };
    format!(
        "{lead}{} of {} unknowns are observable{derivatives} ({}); {lost}.{filter}",
        seen.len(),
        a.quantities.len(),
        solutions(a)
    )
}

/// Sentence on the numbers of solutions of observable unknowns.
fn solutions(a: &SystemAnalysis) -> String {
    let seen: Vec<_> = a.quantities.iter().filter(|q| q.status == Status::Observable).collect();
    let one = |q: &&&SystemQuantity| {
        matches!(
            q.number_of_solutions,
            Some(NumberOfSolutions::OneByExpression | NumberOfSolutions::Counted(1))
        )
    };
    match seen.iter().filter(one).count() {
        0 => "locally".into(),
        k if k == seen.len() => "each with one solution".into(),
        k => format!("{k} with one solution, the others locally"),
    }
}

/// Answer to the question whether the information of a run agrees with the verdicts.
fn evidence(m: &ModelReview) -> (Grade, String) {
    match &m.evidence {
        Some(e) if e.passed => {
            let mut text = format!("agree in all {} checks", e.checks);
            if e.not_resolvable > 0 {
                text += &format!(", {} not resolvable", e.not_resolvable);
            }
            if e.orders.measured < e.orders.of {
                text += &format!(", {} of {} degrees measured", e.orders.measured, e.orders.of);
            }
            (Grade::Good, text)
        }
        Some(e) => (Grade::Limited, format!("DISAGREE in {} of {} checks", e.failures, e.checks)),
        None => (Grade::Open, "not taken".into()),
    }
}

/// Answer to the question whether the run of the filter is credible.
fn credible(m: &ModelReview) -> (Grade, String) {
    match m.run.as_ref().map(|r| &r.run.consistency) {
        None => (Grade::Open, "not run".into()),
        Some(c) if c.consistent => (Grade::Good, "consistent with its truth".into()),
        Some(c) => (Grade::Limited, format!("NOT consistent with its truth: {}", words::run::doubts(c))),
    }
}

/// Unknowns whose estimate in the run equals the prior.
fn by_prior(m: &ModelReview) -> Vec<&str> {
    let rests = |o: Outcome| matches!(o, Outcome::PriorOnly | Outcome::RestsOnPrior);
    let estimates = m.run.iter().flat_map(|r| &r.run.quantities);
    // an unknown without a status is a known start, which rests on nothing else
    let never = |e: &SystemEstimate| matches!(e.status, Some(Status::Inseparable | Status::NotExcited));
    let unknown = estimates.filter(|e| e.status.is_some() && (never(e) || rests(e.outcome)));
    unknown.map(|e| e.name.as_str()).collect()
}

/// Limits of the verdict.
fn limits(m: &ModelReview) -> Vec<String> {
    let mut out = Vec::new();
    match credible(m) {
        (Grade::Good, _) => {}
        (_, what) => out.push(format!("the filter is {what}")),
    }
    match evidence(m) {
        (Grade::Good, _) => {}
        (Grade::Limited | Grade::Missed, what) => {
            out.push(format!("the information of a run and the exact verdicts {what}"))
        }
        (Grade::Open, _) => out.push("no evidence by a run is taken".into()),
    }
    let prior = by_prior(m);
    if !prior.is_empty() {
        out.push(format!("the estimate relies on its prior for {}", words::names(prior)));
    }
    if m.analysis.rests_on_bound {
        out.push(format!("what is not observable rests on orders up to {}", m.analysis.bound));
    }
    out
}

/// Status of a model.
pub(super) fn status(m: &ModelReview) -> StatusBox {
    let a = &m.analysis;
    let seen = a.quantities.iter().filter(|q| q.status == Status::Observable).count();
    let row = |what, (grade, text)| StatusRow { what, grade, text };
    let every = if seen == a.quantities.len() { Grade::Good } else { Grade::Limited };
    let mut rows = vec![
        row("Observable", (every, format!("{seen} of {} unknowns: {}", a.quantities.len(), solutions(a)))),
        row("Filter, one run", credible(m)),
        row("Samples and exact verdicts", evidence(m)),
    ];
    let prior = by_prior(m);
    if !prior.is_empty() {
        rows.push(row("Resting on the prior", (Grade::Limited, words::names(prior.iter().copied()))));
    }
    StatusBox { title: a.name.clone(), rows, actions: super::actions::of_model(m, &prior) }
}

/// Answers to the questions of a board.
pub(super) fn answers(m: &ModelReview) -> Answers {
    let a = &m.analysis;
    let carry = "None: a model has no positions. States go on by the equations of the file";
    let off =
        "Not computed: a model has no bench. Add an error as an unknown constant to see what it changes";
    let duration = m.run.as_ref().map_or_else(
        || match &m.refused {
            Some(reason) => format!("No run: {reason}"),
            None => "No run".into(),
        },
        |ModelRun { run, .. }| {
            format!(
                "A run of {} with a sample every {}, in the unit of t",
                number(run.duration),
                number(run.step)
            )
        },
    );
    let (evidence_grade, evidence) = evidence(m);
    let (run_grade, run) = credible(m);
    let verified = format!("Samples and exact verdicts: {evidence}. Filter, one run: {run}");
    let grade = if run_grade == Grade::Limited { run_grade } else { evidence_grade };
    Answers {
        name: a.name.clone(),
        rows: vec![
            ("Carry", carry.into()),
            ("Assumed", assumed(m).into()),
            ("Chosen by the program", chosen(m).into()),
            ("What limits it", limits_in_brief(m)),
            ("Accelerometers off by 20 ug", off.into()),
            ("Duration", duration.into()),
            ("Output to drop", output_to_drop(m).into()),
            ("Proven by", proven(m).into()),
            ("Verified by", TableCell::graded(verified, grade)),
        ],
        next: answers::next(super::actions::of_model(m, &by_prior(m))),
    }
}

/// Conditions of the verdicts and of the run in one line.
fn assumed(m: &ModelReview) -> String {
    let a = &m.analysis;
    let mut out = vec![match a.constraints.is_empty() {
        true => "a generic point: starts, parameters and inputs are not special".into(),
        false => format!("at the start {}", a.constraints.join(", ")),
    }];
    out.extend((!a.known.is_empty()).then(|| format!("known starts {}", a.known.join(", "))));
    if let Some(ModelRun { run, .. }) = &m.run {
        let noise: Vec<String> = run.noise.iter().map(|(name, sigma)| format!("{name} {sigma}")).collect();
        out.push(format!("the run: noise of a sample {}; true values of the file", noise.join(", ")));
    }
    stated::capital(&out.join("; "))
}

/// Conditions that the file does not state.
fn chosen(m: &ModelReview) -> String {
    let a = &m.analysis;
    let mut out = Vec::new();
    out.extend(a.rests_on_bound.then(|| format!("orders of derivatives up to {}", a.bound)));
    out.extend(m.run.as_ref().and_then(|r| system::priors_chosen(&r.run)));
    match (out.is_empty(), &m.run) {
        (true, Some(_)) => "Nothing: the file states every condition".into(),
        (true, None) => "Nothing for the verdicts; there is no run".into(),
        (false, _) => stated::capital(&out.join("; ")),
    }
}

/// Limits of the verdict, and the unknowns without an answer.
fn limits_in_brief(m: &ModelReview) -> TableCell {
    let mut out = limits(m);
    let all = &m.analysis.quantities;
    let lost: Vec<&str> =
        all.iter().filter(|q| q.status != Status::Observable).map(|q| q.name.as_str()).collect();
    if !lost.is_empty() && lost != by_prior(m) {
        out.push(format!("not determined: {}", words::names(lost)));
    }
    let several =
        |q: &&SystemQuantity| matches!(q.number_of_solutions, Some(NumberOfSolutions::Counted(k)) if k > 1);
    let several: Vec<&str> = all.iter().filter(several).map(|q| q.name.as_str()).collect();
    if !several.is_empty() {
        out.push(format!("several solutions for {}", words::names(several)));
    }
    match out.is_empty() {
        true => TableCell::graded("Nothing found", Grade::Good),
        false => TableCell::graded(stated::capital(&out.join("; ")), Grade::Limited),
    }
}

/// Output without which the verdicts change least, or that none can be dropped.
fn output_to_drop(m: &ModelReview) -> String {
    let Some(all) = &m.outputs else {
        return "Not computed: the model has many outputs or unknowns".into();
    };
    if all.is_empty() {
        return "None: the model has one output".into();
    }
    let of = |names: &[String]| words::names(names.iter().map(String::as_str));
    let a = &m.analysis;
    let keeps = |o: &&WithoutOutput| o.lost.is_empty() && o.rank == a.rank;
    let least = all.iter().filter(keeps).map(|o| (o.largest, o.higher.len())).min();
    if let Some(least) = least {
        let best: Vec<&WithoutOutput> =
            all.iter().filter(keeps).filter(|o| (o.largest, o.higher.len()) == least).collect();
        let names: Vec<&str> = best.iter().map(|o| o.name.as_str()).collect();
        let one = if names.len() > 1 { "one of " } else { "" };
        let degrees = match (&best[..], least.1) {
            (_, 0) => "with the same degrees".into(),
            ([o], _) => {
                format!("but {} by derivatives of a higher order, up to {}", of(&o.higher), o.largest)
            }
            (_, n) => format!(
                "but {n} unknown{} by derivatives of a higher order, up to {}",
                if n == 1 { "" } else { "s" },
                least.0
            ),
        };
        return format!(
            "You can drop {one}{}: what is observable stays so locally, {degrees}; sigmas grow",
            words::names(names)
        );
    }
    let each = all.iter().map(|o| match o.lost.is_empty() {
        true => format!("without {} {} of {} independent combinations", o.name, a.rank - o.rank, a.rank),
        false => format!("without {} {}", o.name, of(&o.lost)),
    });
    format!("Keep all outputs. These are not observable any more: {}", each.collect::<Vec<_>>().join("; "))
}

/// Certainty of the exact verdicts, and the figures that no proof covers.
fn proven(m: &ModelReview) -> String {
    let a = &m.analysis;
    format!(
        "Status and degree: {}. Estimates and sigmas of the run are computed, not proven",
        system::certainty(a.error_bound, a.digits, a.seed)
    )
}

/// Part with verdict, unknowns, equations and evidence.
pub(super) fn part(blocks: &mut Vec<DocumentBlock>, m: &ModelReview, level: usize, id: &str) {
    let a = &m.analysis;
    let document = a.document();
    blocks.push(section(level, "Verdict"));
    blocks.extend((!a.description.is_empty()).then(|| DocumentBlock::Text(a.description.clone())));
    blocks.push(DocumentBlock::Text(verdict(m)));
    blocks.push(section(level, "Unknowns and equations"));
    blocks.extend(document.blocks);
    blocks.push(pictures::model_staircase(a, &format!("{id}_staircase")));
    blocks.push(section(level, "Evidence by samples and a filter"));
    let refused = |e| DocumentBlock::Text(format!("no run or no evidence: {e}."));
    blocks.extend(m.refused.as_ref().map(refused));
    if let Some(e) = &m.evidence {
        let document = e.document();
        blocks.extend(document.lead.into_iter().map(DocumentBlock::Text));
        blocks.extend(document.blocks);
    }
    if let Some(ModelRun { run, traces }) = &m.run {
        let document = run.document();
        blocks.extend(document.blocks.into_iter().filter(|b| !is_list(b, "Assumed")));
        let flat: Vec<&str> = (run.quantities.iter())
            .filter(|e| e.status == Some(Status::NotExcited) && e.outcome == Outcome::PriorOnly)
            .map(|e| e.name.as_str())
            .collect();
        let mut errors: Vec<DocumentBlock> =
            pictures::errors(traces, &flat, id).into_iter().map(|e| e.1).collect();
        let rest = errors.split_off(errors.len().min(ERRORS));
        blocks.extend(errors);
        blocks.extend(pictures::not_drawn(&flat));
        blocks.extend(DocumentBlock::details(level + 1, "Errors of all others", rest));
    }
}
