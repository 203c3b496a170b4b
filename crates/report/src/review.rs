//! Design review: its sections in the order of a review.

mod actions;
mod calibrated;
mod first;
mod generic;
mod model;
mod notation;
mod pictures;
mod verdict;

use obsdeg_calibration::Calibration;
use obsdeg_core::analysis::Analysis;
use obsdeg_core::degree::Status as Exact;
use obsdeg_design::review::{DesignReview, SchemeReview};
use obsdeg_evidence::compare::{ComparedScheme, Quantity};
use obsdeg_evidence::crosscheck::CrossCheck;
use obsdeg_evidence::simulation::Outcome;

use crate::analysis::null_vector;
use crate::document::{Block, Document, Typeset, left, number, optional, right};
use crate::excess::Excess;
use crate::{Answer, Origin, budget, compare, gimbals, latex, omitted, simulation, stated, words};

/// Note on the effect of a calibration on the review of its scheme.
const CALIBRATED: &str = "The run that is simulated of its scheme, and the check whether the small-angle \
                          model holds, are of a platform with these estimates in place of the values that \
                          the scheme states (of several calibrations those of the last); what is not \
                          determined has the values of the scheme.";

/// Review as one document. A single scheme or model has its status, a picture of the unknowns and its
/// sections. Several have the comparison first and every part folded below it.
pub(crate) fn document(
    r: &DesignReview,
    calibrations: &[(String, Calibration)],
    origin: &Origin,
) -> Document {
    let alone = r.schemes.len() + r.generic.len() + r.models.len() == 1;
    let level = if alone { 1 } else { 2 };
    let reviewed = || r.schemes.iter().zip(&r.comparison.schemes);
    let mut blocks = Vec::new();
    if r.schemes.len() > 1 {
        first::comparison(&mut blocks, r);
    }
    let run = calibrations.iter().map(|(name, c)| calibrated::status(c, format!("Calibration {name}")));
    let all = (reviewed().map(|(s, review)| verdict::status(s, review)))
        .chain(r.generic.iter().map(generic::status))
        .chain(r.models.iter().map(model::status))
        .chain(run);
    blocks.push(Block::Status(all.collect()));
    if alone {
        blocks.extend(reviewed().map(|(s, review)| first::margins(s, review, "s1")));
        blocks.extend(r.generic.iter().map(|g| first::generic_degrees(g, "g1")));
        blocks.extend(r.models.iter().map(|m| first::model_degrees(&m.analysis, "m1")));
    }
    if r.schemes.len() > 1 {
        blocks.push(section(1, "Comparison of the schemes"));
        let comparison = r.comparison.document();
        blocks.extend(comparison.blocks.into_iter().filter(|b| !is_list(b, "Assumed")));
        blocks.extend(pictures::time_against_sigma(&r.schemes, "comparison_front"));
    }
    let mut part = |title: String, own: Vec<Block>| match alone {
        true => blocks.extend(own),
        false => blocks.push(Block::Fold { title, blocks: own }),
    };
    for (i, (s, review)) in reviewed().enumerate() {
        let (mut own, id) = (Vec::new(), format!("s{}", i + 1));
        if !alone {
            own.push(first::margins(s, review, &id));
        }
        scheme(&mut own, s, review, level, &id);
        part(format!("Scheme {}", s.name), own);
    }
    for (i, g) in r.generic.iter().enumerate() {
        let (mut own, id) = (Vec::new(), format!("g{}", i + 1));
        if !alone {
            own.push(first::generic_degrees(g, &id));
        }
        generic::part(&mut own, g, level, &id);
        part(format!("Scheme {}", g.name), own);
    }
    for (i, m) in r.models.iter().enumerate() {
        let (mut own, id) = (Vec::new(), format!("m{}", i + 1));
        if !alone {
            own.push(first::model_degrees(&m.analysis, &id));
        }
        model::part(&mut own, m, level, &id);
        part(format!("Model {}", m.analysis.name), own);
    }
    for (i, (name, c)) in calibrations.iter().enumerate() {
        blocks.push(section(1, format!("Calibration {name}")));
        blocks.push(Block::Text(CALIBRATED.into()));
        blocks.extend(calibrated::section(c, &format!("c{}", i + 1)));
    }
    certificates(&mut blocks, origin);
    blocks.push(section(1, "Notation"));
    blocks.push(notation::notation(r));
    blocks.push(section(1, "About this report"));
    blocks.push(Block::list(
        "",
        vec![
            format!("obsdeg {}; seed {}; {} Monte Carlo runs", r.version, r.seed, r.runs),
            format!(
                "verdicts are exact ranks in prime fields; predicted {}",
                stated::predicted_of(r.comparison.schemes.iter().map(|s| &s.conditions))
            ),
        ],
    ));
    blocks.extend(Block::list_if_any(
        "Command",
        Vec::from_iter((!origin.command.is_empty()).then(|| origin.command.clone())),
    ));
    blocks.extend(Block::list_if_any("Files that were read", origin.inputs.clone()));
    let names: Vec<&str> = (r.schemes.iter().map(|s| s.name.as_str()))
        .chain(r.generic.iter().map(|g| g.name.as_str()))
        .chain(r.models.iter().map(|m| m.analysis.name.as_str()))
        .collect();
    Document { title: format!("Design review: {}", names.join(", ")), lead: Vec::new(), blocks }
}

/// Section on checking the exact verdicts of schemes without this program.
fn certificates(blocks: &mut Vec<Block>, origin: &Origin) {
    if origin.certificates.is_empty() {
        return;
    }
    blocks.push(section(1, "How to check this without obsdeg"));
    let steps = [
        "The exact verdicts of a scheme (status and degree of every unknown, ranks, null space) have a \
         certificate: a JSON file that proves them.",
        "obsdeg analyze SCHEME.toml --certificate c.json writes it. The same verdicts give the same bytes, \
         whatever the seed.",
        "The digest below identifies the file: sha256sum c.json.",
        "python3 tools/verify_certificate.py c.json SCHEME.toml checks it with the standard library of \
         Python alone; obsdeg verify c.json SCHEME.toml with a crate that shares no code with the engine.",
        "The chapter Certificates of the book specifies the file and the check, so that you can write a \
         checker of your own.",
        "Predicted sigmas, the run and the evidence by a filter are not part of a certificate.",
    ];
    blocks.push(Block::list("", steps.map(String::from).to_vec()));
    blocks.push(Block::list("Certificates", origin.certificates.clone()));
}

fn section(level: usize, title: impl Into<String>) -> Block {
    Block::Section { level, title: title.into() }
}

fn is_list(block: &Block, name: &str) -> bool {
    matches!(block, Block::List { heading, .. } if heading == name)
}

fn joined<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

fn scheme(blocks: &mut Vec<Block>, s: &SchemeReview, review: &ComparedScheme, level: usize, id: &str) {
    let a = &s.analysis;
    let coefficients: Vec<&Quantity> =
        review.quantities.iter().filter(|q| !q.name.starts_with("psi")).collect();
    blocks.push(section(level, "Verdict"));
    blocks.extend((!s.description.is_empty()).then(|| Block::Text(s.description.clone())));
    blocks.push(Block::Text(verdict::sentences(s, review, &coefficients)));
    if s.simulation.timeline.iter().any(|t| t.slew) {
        let exact = if a.positions.iter().any(|p| !p.turns.is_empty()) {
            "are exact and of turns fast against the earth rate, in which torquer errors act"
        } else {
            "are exact and of repositioning at once"
        };
        let text = format!(
            "Turning between these positions takes time. Degrees, accuracy orders, ranks, what cannot be \
             told apart, formulas and the fewest positions {exact}; predicted sigmas, requirements and the \
             run are with the slews, by which psi moves and which may determine more, or less."
        );
        blocks.push(Block::Text(text));
    }
    blocks.extend(simulation::warning(&s.simulation.conditions).map(Block::Text));
    blocks.push(section(level, "Unknowns"));
    blocks.push(unknowns(a, review));
    blocks.push(pictures::staircase(a, &format!("{id}_staircase")));
    blocks.push(section(level, "What cannot be told apart"));
    null_space(blocks, a);
    blocks.push(section(level, "Positions"));
    positions(blocks, s, &coefficients, review, id);
    blocks.push(section(level, "How each is solved"));
    solved(blocks, a);
    blocks.push(section(level, "Sensitivity"));
    sensitivity(blocks, s, review, id);
    blocks.push(section(level, "What is not estimated"));
    not_estimated(blocks, review, id);
    blocks.push(section(level, "Fewest positions, and what each is for"));
    fewest(blocks, s, review, id);
    blocks.push(section(level, "Evidence by a filter"));
    evidence(blocks, s, id);
    blocks.push(section(level, "Validity of the small-angle model"));
    blocks.push(Block::list("", simulation::validity(&s.simulation.validity, &s.simulation.conditions)));
    blocks.extend(compare::at_own_drifts(std::slice::from_ref(review)));
    blocks.push(section(level, "Assumptions and certainty"));
    let mut assumed = words::assumptions(a);
    // carry, latitude and observation are stated above
    assumed
        .extend(stated::measurement(&review.conditions).into_iter().filter(|l| !l.starts_with("latitude")));
    assumed.extend(simulation::conditions(&s.simulation.conditions, &s.simulation.timeline));
    assumed.push(words::certainty(a));
    let evidence = s.evidence.as_ref().err().map(words::no_evidence);
    let alternatives = s.alternatives.refused.iter().map(|e| format!("no alternatives: {e}"));
    let notes = a.notes.iter().cloned().chain(evidence).chain(alternatives);
    assumed.extend(notes.map(|n| format!("note: {n}")));
    blocks.push(Block::list("", assumed));
}

/// `with derivatives up to order 2 (D_FY, D_IY)`: names if only some unknowns need that order.
fn derivatives<'a>(worst: usize, all: impl Iterator<Item = (&'a str, Option<usize>)>) -> String {
    let all: Vec<_> = all.collect();
    let names: Vec<&str> = all.iter().filter(|q| q.1 == Some(worst)).map(|q| q.0).collect();
    match (worst, names.len() == all.len()) {
        (0, _) => "without any derivative".into(),
        (k, true) => format!("with derivatives up to order {k}"),
        (k, false) => format!("with derivatives up to order {k} ({})", names.join(", ")),
    }
}

/// Effects of errors that the scheme does not estimate; with a bench also the budgets.
fn not_estimated(blocks: &mut Vec<Block>, review: &ComparedScheme, id: &str) {
    let (effects, budgets) = omitted::in_full(&review.omitted);
    blocks.extend(effects);
    let caption =
        "Uncertainty budgets: shares of samples and of the errors of the bench in the squared total";
    let picture = budget::bars(&review.omitted);
    blocks.extend(picture.map(|svg| pictures::still(&format!("{id}_budget"), caption, svg)));
    blocks.extend(budgets);
}

fn unknowns(a: &Analysis, review: &ComparedScheme) -> Block {
    let row = |q: &obsdeg_core::analysis::Quantity| {
        let predicted = review.quantities.iter().find(|p| p.name == q.name);
        let of = |value: fn(&Quantity) -> Option<f64>| optional(predicted.and_then(value));
        let excited = predicted.map_or_else(Vec::new, |p| {
            let names = review.positions.iter().zip(&p.excitation).filter(|(_, e)| **e > 1e-9);
            names.map(|(n, _)| n.as_str()).collect()
        });
        vec![
            q.name.clone(),
            predicted.map_or_else(|| q.unit.clone(), |p| p.unit.clone()),
            q.status.to_string(),
            words::degree(q.degree),
            words::accuracy_order(q.degree, q.accuracy_order, a.has_accuracy_orders),
            if q.partners.is_empty() { "-".into() } else { q.partners.join(" ") },
            of(|p| p.sigma),
            of(|p| p.total),
            of(|p| p.requirement),
            of(|p| p.margin),
            if excited.is_empty() { "-".into() } else { excited.join(" ") },
        ]
    };
    Block::table(
        format!(
            "Every unknown, best first (- where it is not determined; {})",
            stated::predicted(&review.conditions)
        ),
        [
            left("unknown"),
            left("unit"),
            left("status"),
            right("degree"),
            right("accuracy order"),
            left("not told from"),
            right("predicted sigma"),
            right(TOTAL),
            right("required"),
            right("margin"),
            left("excited at"),
        ],
        a.quantities.iter().map(row),
    )
    .without(&left_out(review))
}

/// Title of the column of total uncertainties.
const TOTAL: &str = "total with the bench";

/// Columns that are empty without requirements or without a bench.
fn left_out(review: &ComparedScheme) -> Vec<&'static str> {
    let required: &[&str] = if review.requirements.stated > 0 { &[] } else { &compare::REQUIREMENTS };
    let bench = review.conditions.bench.is_none().then_some(TOTAL);
    required.iter().copied().chain(bench).collect()
}

fn null_space(blocks: &mut Vec<Block>, a: &Analysis) {
    let mut lines = Vec::new();
    for v in &a.null_space {
        let names = joined(v.iter().map(|c| c.name.as_str()));
        let parts: Vec<String> = (v.iter())
            .map(|c| match &c.coefficient {
                Some(k) => format!("{} by {k}", c.name),
                None => c.name.clone(),
            })
            .collect();
        lines.push(match v.len() {
            1 => format!("no derivative of Z changes with {names}"),
            _ => format!("no derivative of Z changes when these change together: {}", parts.join(", ")),
        });
    }
    let silent = words::not_excited(a);
    if !silent.is_empty() {
        lines.push(format!("no position excites {}: each can take any value", silent.join(", ")));
    }
    if lines.is_empty() {
        lines.push("nothing: every unknown is observable by derivatives".into());
    }
    let seen: Vec<&str> = (a.quantities.iter())
        .filter(|q| q.degree.is_none() && q.accuracy_order.is_some())
        .map(|q| q.name.as_str())
        .collect();
    if !seen.is_empty() {
        lines.push(format!(
            "with dwell, during which psi moves, these are determined nonetheless: {}",
            seen.join(", ")
        ));
    }
    blocks.push(Block::list("", lines));
    blocks.extend(Block::formulas(words::UNSEEN, a.null_space.iter().map(|v| null_vector(v))));
    let combination = |c: &obsdeg_core::analysis::CombinationReport| {
        let asked = if c.requested { ", asked for" } else { "" };
        let dwell = match words::with_dwell(a, c.degree, c.accuracy_order) {
            same if same.is_empty() => same,
            other => format!(", with dwell {other}"),
        };
        let verdict = match c.degree {
            Some(k) => format!("degree {k}{dwell}{asked}"),
            None => format!("{}{dwell}{asked}", c.status),
        };
        Typeset {
            text: format!("{}: {verdict}", c.expression),
            latex: format!("{}\\quad\\text{{{verdict}}}", latex::expression(&c.expression)),
        }
    };
    blocks.extend(Block::formulas("Observable combinations", a.combinations.iter().map(combination)));
}

/// A time in s, to a tenth.
fn seconds(t: f64) -> String {
    let text = format!("{t:.1}");
    text.strip_suffix(".0").map_or(text.clone(), String::from)
}

fn positions(
    blocks: &mut Vec<Block>,
    s: &SchemeReview,
    coefficients: &[&Quantity],
    review: &ComparedScheme,
    id: &str,
) {
    let component = |x: f64| if x == x.round() { format!("{x:.0}") } else { format!("{x:.3}") };
    let g = |g: [f64; 3]| g.map(component).join(", ");
    let rows = s.analysis.positions.iter().zip(&s.positions).map(|(p, numbers)| {
        vec![
            p.name.clone(),
            words::angles(p),
            p.attitude.clone().unwrap_or_else(|| "-".into()),
            seconds(numbers.start_s),
            seconds(numbers.dwell_s),
            numbers.slew_s.map_or_else(|| "-".into(), seconds),
            numbers.turn.map_or_else(|| "-".into(), |turn| words::turn(&turn)),
            g(numbers.g[0]),
            g(numbers.g[1]),
            g(numbers.g[2]),
        ]
    });
    blocks.push(Block::table(
        "Positions, with the components of g along the axes I, O, S of each gyro (in g, at the start)",
        [
            left("position"),
            left("alpha, beta, gamma [deg]"),
            left("X_p Y_p Z_p"),
            right("start [s]"),
            right("dwell [s]"),
            right("slew to it [s]"),
            left("turn"),
            right("gyro X: I O S"),
            right("gyro Y: I O S"),
            right("gyro Z: I O S"),
        ],
        rows,
    ));
    blocks.extend(gimbals::block(s.analysis.gimbals.as_ref()));
    let at = &s.simulation.conditions;
    blocks.extend(pictures::poses(&s.poses, at.latitude_deg, at.latitude_by_default, id));
    blocks.push(pictures::attitudes(s, &format!("{id}_attitude")));
    if coefficients.iter().any(|q| !q.excitation.is_empty()) {
        blocks.push(pictures::excitation(coefficients, &review.positions, &format!("{id}_excitation")));
    }
}

fn solved(blocks: &mut Vec<Block>, a: &Analysis) {
    let formula = |left: String, expression: &str, solution: &obsdeg_core::analysis::Solution| Typeset {
        text: format!("{expression} = {}", solution.text),
        latex: format!("{left} = {}", latex::solution(solution, a.frame, &a.stations)),
    };
    let unknowns = a.quantities.iter().filter_map(|q| {
        let solution = q.solution.as_ref()?;
        Some(formula(latex::symbol(&q.name), &q.name, solution))
    });
    let none = || Block::Text("No unknown is observable by itself.".into());
    blocks.push(Block::formulas("Unknowns", unknowns).unwrap_or_else(none));
    let combinations = a.combinations.iter().filter_map(|c| {
        let solution = c.solution.as_ref()?;
        Some(formula(latex::expression(&c.expression), &c.expression, solution))
    });
    blocks.extend(Block::formulas("Combinations", combinations));
    blocks.extend(Block::list_if_any(words::ACCURACY, words::accuracy(a)));
}

fn sensitivity(blocks: &mut Vec<Block>, s: &SchemeReview, review: &ComparedScheme, id: &str) {
    let row = |c: &obsdeg_evidence::compare::Sensitivity| {
        vec![
            c.condition.clone(),
            compare::rank(c.rank, review.has_accuracy_orders),
            compare::worst(c.worst.as_ref()),
            compare::worst(c.worst_determined.as_ref()),
        ]
    };
    blocks.push(Block::table(
        "Rank, and largest sigma in deg/h (per g): of all coefficients, of those determined here (- where \
         one is not observable)",
        [left("condition"), right("rank with dwell"), left("of all"), left("of those determined")],
        review.sensitivity.iter().map(row),
    ));
    blocks.extend(Block::list_if_any("Verdicts under the other carries", words::carries(&s.analysis)));
    blocks.extend(pictures::latitudes(s, &format!("{id}_latitude")));
    blocks.extend(pictures::dwells(s, review, &format!("{id}_dwell")));
}

/// Sentence on the smallest number of cardinal attitudes that make every coefficient observable.
fn fewest_of_all(s: &SchemeReview, review: &ComparedScheme) -> Option<String> {
    let all = s.alternatives.all.as_ref()?;
    Some(match (all.positions, all.never.is_empty()) {
        (Some(k), _) => format!(
            "to observe every coefficient takes at least {k} of the 24 cardinal attitudes under {} carry \
             (exhaustive search), for instance {}",
            review.carry,
            all.witness.join(", ")
        ),
        (None, false) => format!("no set of the 24 cardinal attitudes determines {}", all.never.join(", ")),
        // larger sets were not searched
        (None, true) => format!(
            "no set of {} of the 24 cardinal attitudes determines every coefficient",
            all.none_of.last()?[0]
        ),
    })
}

fn fewest(blocks: &mut Vec<Block>, s: &SchemeReview, review: &ComparedScheme, id: &str) {
    let mut lines = Vec::new();
    let alternatives = &s.alternatives;
    if let Some(kept) = &alternatives.kept {
        lines.push(match kept.positions {
            Some(k) if k == s.positions.len() => {
                format!("all {k} positions are needed to observe {}", alternatives.required.join(", "))
            }
            Some(k) => format!(
                "{k} of the {} positions ({}) suffice to observe {}; whether they meet the requirements is \
                 another question",
                s.positions.len(),
                kept.witness.join(", "),
                alternatives.required.join(", ")
            ),
            None => "too many sets of positions to look for the fewest".into(),
        });
    }
    lines.extend(fewest_of_all(s, review));
    if let (Some(c), Some(best)) = (
        &alternatives.certificate,
        alternatives.front.iter().find(|f| s.positions.first().is_some_and(|p| p.dwell_s == f.dwell_s)),
    ) {
        let Excess { value, bound, percent } = Excess::new(best.value, c.best_possible, c.within_percent);
        lines.push(format!(
            "of {} of the 24 cardinal attitudes at {} s each none has a largest sigma of {} below {bound} \
             (optimal weights); the best found has {value}, at most {percent} above",
            alternatives.front_positions,
            number(best.dwell_s),
            alternatives.required.join(", "),
        ));
    }
    blocks.push(Block::list("", lines));
    let row = |d: &obsdeg_evidence::compare::DropOne| {
        let lost = if d.lost.is_empty() { "-".into() } else { d.lost.join(" ") };
        vec![
            d.position.clone(),
            lost,
            compare::worst(d.worst.as_ref()),
            compare::requirements(&d.requirements),
        ]
    };
    if !review.drop_one.is_empty() {
        let columns =
            ["without", "not observable any more", "worst sigma(D) [deg/h, /g]", compare::REQUIREMENTS[0]]
                .map(left);
        let table = Block::table("Without one position", columns, review.drop_one.iter().map(row));
        blocks.push(table.without(&left_out(review)));
    }
    if !alternatives.front.is_empty() {
        blocks.extend(pictures::time_against_sigma(std::slice::from_ref(s), &format!("{id}_front")));
    }
}

fn evidence(blocks: &mut Vec<Block>, s: &SchemeReview, id: &str) {
    match &s.evidence {
        Ok(c) => {
            let outcome = match (c.passed, c.verdicts_agree) {
                (true, _) if c.counts.not_resolvable > 0 => "agree in every check that is resolvable",
                (true, _) => "agree in every check",
                (false, true) => "agree, but the Monte Carlo runs do NOT fit the filter, as listed below",
                (false, false) => "DISAGREE, as listed below",
            };
            // the run below has the truth of the checks
            let run = if s.simulation.consistency.consistent {
                ""
            } else {
                ", but the run below is not consistent"
            };
            blocks.push(Block::Text(format!(
                "Exact verdicts and a Kalman filter are two independent paths: they {outcome}{run}."
            )));
            let document = c.document();
            blocks.extend(document.lead.into_iter().map(Block::Text));
            let kept = |b: &Block| !is_list(b, "Assumed") && !is_list(b, "Validity of the small-angle model");
            blocks.extend(document.blocks.into_iter().filter(kept));
            checks(blocks, c, id);
        }
        Err(e) => blocks.push(Block::Text(format!("None: {}.", words::no_evidence(e)))),
    }
    let run = s.simulation.document();
    blocks.push(Block::Text("One run against a simulated truth, with its errors and bands:".into()));
    let kept = |b: &Block| {
        matches!(b, Block::Table { .. } | Block::List { .. })
            && !is_list(b, "Assumed")
            && !is_list(b, "Validity of the small-angle model")
    };
    // the unknowns' table has the predicted sigmas, and a page has no room for more columns
    blocks.extend(run.blocks.into_iter().filter(kept).map(|b| b.without(&["predicted"])));
    let flat: Vec<&str> = (s.simulation.quantities.iter())
        .filter(|q| q.status == Exact::NotExcited && q.outcome == Outcome::PriorOnly)
        .map(|q| q.name.as_str())
        .collect();
    blocks.extend(pictures::errors(&s.traces, &flat, "last position", id));
}

fn checks(blocks: &mut Vec<Block>, c: &CrossCheck, id: &str) {
    blocks.extend(pictures::slopes(c, id));
    blocks.extend(pictures::consistency(c, id));
    blocks.push(pictures::correlation(c, &format!("{id}_correlation")));
}
