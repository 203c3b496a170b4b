//! Design review: its sections in the order of a review.

mod actions;
pub(crate) mod answers;
pub(crate) mod calibrated;
mod first;
mod generic;
mod model;
mod notation;
mod pictures;
pub(crate) mod title;
mod verdict;

use obsdeg_calibration::Calibration;
use obsdeg_core::analysis::Analysis;
use obsdeg_core::degree::Status;
use obsdeg_design::design::Minimum;
use obsdeg_design::review::{DesignReview, SchemeReview};
use obsdeg_evidence::compare::{ComparedScheme, Quantity};
use obsdeg_evidence::simulation::Outcome;

use crate::analysis::null_vector;
use crate::document::{Document, DocumentBlock, Fold, TableCell, Typeset, left, number, optional, right};
use crate::excess::Excess;
use crate::{Answer, Origin, budget, compare, gimbals, latex, omitted, resolve, simulation, stated, words};

/// Note on the effect of a calibration on the review of its scheme.
const CALIBRATED: &str = "The run that is simulated of its scheme, and the check whether the small-angle \
                          model holds, are of a platform with these estimates in place of the values that \
                          the scheme states (of several calibrations those of the last); what is not \
                          determined has the values of the scheme. The calibration has margins of its \
                          own: what is required over the uncertainty at the times of the record, with its \
                          noise. Margins of the design are for the dwells, steps and noise that the scheme \
                          states. Where the record has more samples or other noise, the two differ by the \
                          root of their ratio.";

/// Meaning of the grades of a status, and of a margin.
const GRADES: &str = "OK: a requirement is met or a check passes. LIMITED: limits the validity of other \
                      answers, as a check that fails does. NOT MET: a requirement is missed, or a record is \
                      not consistent. OPEN: not stated or not computed, so \
                      nothing is judged. Margin: what is required over the predicted sigma (with a bench over \
                      the total uncertainty); 1 or more is met.";

/// Review as one document: status, verdict and conditions, then the positions with what limits them and what
/// to change (some two printed pages), then the appendix. Several schemes are compared first.
pub(crate) fn document(
    r: &DesignReview,
    calibrations: &[(String, Calibration)],
    origin: &Origin,
) -> Document {
    let alone = r.schemes.len() + r.generic.len() + r.models.len() == 1;
    let certified = !origin.certificates.is_empty();
    let answers: Vec<answers::Answers> = (reviewed(r)
        .map(|(s, review)| answers::of_scheme(s, review, certified)))
    .chain(r.generic.iter().map(generic::answers))
    .chain(r.models.iter().map(model::answers))
    .collect();
    let answers = answers::tables(&answers);
    let (compared, own) = if r.schemes.len() > 1 { (answers, Vec::new()) } else { (Vec::new(), answers) };
    let mut blocks = vec![title::block(r, origin), DocumentBlock::Text(title::made_from(r, origin))];
    if r.schemes.len() > 1 {
        first::comparison(&mut blocks, r, compared);
    }
    blocks.push(DocumentBlock::Text(GRADES.into()));
    blocks.push(statuses(r, calibrations));
    blocks.extend(own);
    if alone {
        blocks.extend(reviewed(r).map(|(s, review)| first::margins(s, review, "s1")));
        blocks.extend(r.generic.iter().map(|g| first::generic_degrees(g, "g1")));
        blocks.extend(r.models.iter().map(|m| first::model_degrees(&m.analysis, "m1")));
    }
    if r.schemes.len() > 1 {
        blocks.push(comparison(r));
    }
    for (i, (name, c)) in calibrations.iter().enumerate() {
        let mut own = vec![DocumentBlock::Text(CALIBRATED.into())];
        own.extend(calibrated::section(c, &format!("c{}", i + 1)));
        blocks.push(DocumentBlock::fold(1, format!("Calibration {name}"), own));
    }
    parts(&mut blocks, r, alone);
    blocks.extend(certificates(origin));
    blocks.push(DocumentBlock::fold(1, "Notation", vec![notation::notation(r)]));
    blocks.push(about(r, origin));
    let names: Vec<&str> = (r.schemes.iter().map(|s| s.name.as_str()))
        .chain(r.generic.iter().map(|g| g.name.as_str()))
        .chain(r.models.iter().map(|m| m.analysis.name.as_str()))
        .collect();
    Document { title: format!("Design review: {}", names.join(", ")), lead: Vec::new(), blocks }
}

/// Schemes with their predictions.
fn reviewed(r: &DesignReview) -> impl Iterator<Item = (&SchemeReview, &ComparedScheme)> {
    r.schemes.iter().zip(&r.comparison.schemes)
}

/// Status of every scheme, model and calibration.
fn statuses(r: &DesignReview, calibrations: &[(String, Calibration)]) -> DocumentBlock {
    let run = calibrations.iter().map(|(name, c)| calibrated::status(c, format!("Calibration {name}")));
    let all = (reviewed(r).map(|(s, review)| verdict::status(s, review)))
        .chain(r.generic.iter().map(generic::status))
        .chain(r.models.iter().map(model::status))
        .chain(run);
    DocumentBlock::Status(all.collect())
}

/// Comparison of the schemes.
fn comparison(r: &DesignReview) -> DocumentBlock {
    let comparison = r.comparison.document();
    let mut own: Vec<DocumentBlock> = vec![compare::ratios(&r.comparison.schemes)];
    own.extend(pictures::time_against_sigma(&r.schemes, "comparison_front"));
    own.extend(comparison.blocks.into_iter().filter_map(|b| match b {
        DocumentBlock::Fold(details) => Some(DocumentBlock::Fold(Fold { level: 2, ..details })),
        _ => None,
    }));
    DocumentBlock::fold(1, "Comparison of the schemes", own)
}

/// Parts of the schemes and models; a single one has no fold of its own.
fn parts(blocks: &mut Vec<DocumentBlock>, r: &DesignReview, alone: bool) {
    let mut part = |title: String, own: Vec<DocumentBlock>| match alone {
        true => blocks.extend(own),
        false => blocks.extend([DocumentBlock::NewPage, DocumentBlock::fold(1, title, own)]),
    };
    for (i, (s, review)) in reviewed(r).enumerate() {
        let (mut own, id) = (Vec::new(), format!("s{}", i + 1));
        if !alone {
            own.push(first::margins(s, review, &id));
        }
        scheme(&mut own, s, review, alone, &id);
        part(format!("Scheme {}", s.name), own);
    }
    for (i, g) in r.generic.iter().enumerate() {
        let (mut own, id) = (Vec::new(), format!("g{}", i + 1));
        if !alone {
            own.push(first::generic_degrees(g, &id));
        }
        generic::part(&mut own, g, if alone { 1 } else { 2 }, &id);
        part(format!("Scheme {}", g.name), own);
    }
    for (i, m) in r.models.iter().enumerate() {
        let (mut own, id) = (Vec::new(), format!("m{}", i + 1));
        if !alone {
            own.push(first::model_degrees(&m.analysis, &id));
        }
        model::part(&mut own, m, if alone { 1 } else { 2 }, &id);
        part(format!("Model {}", m.analysis.name), own);
    }
}

/// Program, command and files of the review.
fn about(r: &DesignReview, origin: &Origin) -> DocumentBlock {
    let mut blocks = vec![DocumentBlock::list(
        "",
        vec![
            format!("obsdeg {}; seed {}; {} Monte Carlo runs", r.version, r.seed, r.runs),
            format!(
                "verdicts are exact ranks in prime fields; predicted {}",
                stated::predicted_of(r.comparison.schemes.iter().map(|s| &s.conditions))
            ),
        ],
    )];
    blocks.extend(title::origin_of(origin));
    DocumentBlock::fold(1, "About this report", blocks)
}

/// Part on checking the exact verdicts of schemes without this program.
fn certificates(origin: &Origin) -> Option<DocumentBlock> {
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
    let steps = DocumentBlock::list("", steps.map(String::from).to_vec());
    let own = vec![steps, DocumentBlock::list("Certificates", origin.certificates.clone())];
    (!origin.certificates.is_empty()).then(|| DocumentBlock::fold(1, "How to check this without obsdeg", own))
}

fn section(level: usize, title: impl Into<String>) -> DocumentBlock {
    DocumentBlock::Section { level, title: title.into() }
}

fn is_list(block: &DocumentBlock, name: &str) -> bool {
    matches!(block, DocumentBlock::List { heading, .. } if heading == name)
}

fn joined<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}

/// Two pages and the appendix of a scheme. Of several schemes a printed page has the two pages alone.
fn scheme(blocks: &mut Vec<DocumentBlock>, s: &SchemeReview, review: &ComparedScheme, alone: bool, id: &str) {
    let level = if alone { 1 } else { 2 };
    let coefficients: Vec<&Quantity> =
        review.quantities.iter().filter(|q| !q.name.starts_with("psi")).collect();
    blocks.push(section(level, "Verdict"));
    verdict(blocks, s, review, &coefficients);
    blocks.push(section(level, "Positions"));
    positions(blocks, s, id);
    blocks.push(section(level, "What limits it, and what to change"));
    fewest(blocks, s, review);
    let typical = omitted::typical(review);
    blocks.extend(DocumentBlock::list_if_any("What errors outside the model would do", typical));
    blocks.extend(met_while(review).map(DocumentBlock::Text));
    blocks.extend(correlated(s));
    let caption =
        "Uncertainty budgets: shares of samples and of the errors of the bench in the squared total";
    let picture = budget::bars(&review.omitted);
    blocks.extend(picture.map(|svg| pictures::still(&format!("{id}_budget"), caption, svg)));
    blocks.extend(pictures::dwells(s, review, &format!("{id}_dwell")));
    if !s.alternatives.front.is_empty() {
        blocks.extend(pictures::time_against_sigma(std::slice::from_ref(s), &format!("{id}_front")));
    }
    if alone {
        blocks.push(section(1, "Appendix"));
    }
    let parts = appendix(s, review, &coefficients, id).into_iter();
    let large = s.positions.len() > MANY_POSITIONS || s.analysis.quantities.len() > MANY_UNKNOWNS;
    let parts = parts.map(|(title, blocks)| {
        let printed = !large || !SECONDARY.contains(&title);
        DocumentBlock::Fold(Fold { level: if alone { 2 } else { 3 }, title: title.into(), printed, blocks })
    });
    match alone {
        true => blocks.extend(parts),
        false => blocks.extend(DocumentBlock::details(2, format!("Appendix of {}", s.name), parts.collect())),
    }
}

/// Numbers of positions and of unknowns above which a printed appendix leaves out what matters least.
const MANY_POSITIONS: usize = 7;
const MANY_UNKNOWNS: usize = 20;
const SECONDARY: [&str; 2] = ["Positions in numbers", "Sensitivity"];

/// Verdict in sentences, with its conditions in one list.
fn verdict(
    blocks: &mut Vec<DocumentBlock>,
    s: &SchemeReview,
    review: &ComparedScheme,
    coefficients: &[&Quantity],
) {
    let a = &s.analysis;
    blocks.push(DocumentBlock::Text(verdict::sentences(s, review, coefficients)));
    blocks.extend((!s.description.is_empty()).then(|| DocumentBlock::Text(s.description.clone())));
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
        blocks.push(DocumentBlock::Text(text));
    }
    blocks.extend(simulation::warning(&s.simulation.conditions).map(DocumentBlock::Text));
}

/// Sentence on the sizes of errors outside the model that use up a margin, also of single terms.
fn met_while(review: &ComparedScheme) -> Option<String> {
    let r = &review.requirements;
    omitted::met_while(&review.omitted, r.with_bench, true).filter(|_| r.all_met() && r.stated > 0)
}

/// Notes, with those on several unknowns that say the same in one.
fn alike(notes: &[String]) -> Vec<String> {
    let mut out: Vec<(String, String)> = Vec::new();
    for note in notes {
        let (head, tail) = note.split_once(": ").unwrap_or((note, ""));
        let (start, name) = head.rsplit_once(' ').unwrap_or(("", head));
        match out.iter_mut().find(|(own, rest)| !tail.is_empty() && rest == tail && own.starts_with(start)) {
            Some((own, _)) => own.push_str(&format!(", {name}")),
            None => out.push((head.into(), tail.into())),
        }
    }
    let line =
        |(head, tail): (String, String)| if tail.is_empty() { head } else { format!("{head}: {tail}") };
    out.into_iter().map(line).collect()
}

/// Parts of the appendix: title and content.
fn appendix(
    s: &SchemeReview,
    review: &ComparedScheme,
    coefficients: &[&Quantity],
    id: &str,
) -> Vec<(&'static str, Vec<DocumentBlock>)> {
    let a = &s.analysis;
    let mut indistinguishable = Vec::new();
    null_space(&mut indistinguishable, a);
    let mut assumed = words::assumptions(a);
    // carry, latitude and observation are stated above
    assumed
        .extend(stated::measurement(&review.conditions).into_iter().filter(|l| !l.starts_with("latitude")));
    assumed.extend(simulation::conditions(&s.simulation.conditions, &s.simulation.timeline));
    assumed.push(words::certainty(a));
    let evidence = s.evidence.as_ref().err().map(words::no_evidence);
    let alternatives = s.alternatives.refused.iter().map(|e| format!("no alternatives: {e}"));
    let notes = alike(&a.notes).into_iter().chain(evidence).chain(alternatives);
    assumed.extend(notes.map(|n| format!("note: {n}")));
    let mut valid =
        vec![DocumentBlock::list("", simulation::validity(&s.simulation.validity, &s.simulation.conditions))];
    valid.extend(compare::at_own_drifts(std::slice::from_ref(review)));
    vec![
        ("Unknowns", vec![unknowns(a, review), pictures::staircase(a, &format!("{id}_staircase"))]),
        ("What cannot be told apart", indistinguishable),
        ("Positions in numbers", numbers(s, coefficients, review, id)),
        ("How each is solved", solved(a)),
        ("Sensitivity", sensitivity(s, review, id)),
        ("What is not estimated", not_estimated(review)),
        ("Evidence by a filter", evidence_of(s, id)),
        ("One run of the filter", run(s, review, id)),
        ("Validity of the small-angle model", valid),
        ("Assumptions and certainty", vec![DocumentBlock::list("", assumed)]),
    ]
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

/// Largest number of rows of a table in the printed part of an appendix.
const PRINTED: usize = 14;

/// Effects of errors that the scheme does not estimate; with a bench also the budgets. Long tables are
/// details.
fn not_estimated(review: &ComparedScheme) -> Vec<DocumentBlock> {
    let (effects, budgets) = omitted::in_full(&review.omitted);
    let long = |b: &DocumentBlock| matches!(b, DocumentBlock::Table { rows, .. } if rows.len() > PRINTED);
    let (long, mut out): (Vec<DocumentBlock>, Vec<DocumentBlock>) = effects.into_iter().partition(long);
    out.extend(DocumentBlock::details(3, "Every error that is not estimated", long));
    out.extend(DocumentBlock::details(3, "Uncertainty budgets, line by line", budgets));
    out
}

fn unknowns(a: &Analysis, review: &ComparedScheme) -> DocumentBlock {
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
    DocumentBlock::table(
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

fn null_space(blocks: &mut Vec<DocumentBlock>, a: &Analysis) {
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
    blocks.push(DocumentBlock::list("", lines));
    blocks.extend(DocumentBlock::formulas(words::UNSEEN, a.null_space.iter().map(|v| null_vector(v))));
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
    blocks
        .extend(DocumentBlock::formulas("Observable combinations", words::combinations(a).map(combination)));
}

/// A time in s, to a tenth.
fn seconds(t: f64) -> String {
    let text = format!("{t:.1}");
    text.strip_suffix(".0").map_or(text.clone(), String::from)
}

/// A time in s, and in minutes, hours or days if it is long: `2628.1 s (44 min)`, `5000 s (1 h 23 min)`.
fn duration(t_s: f64) -> String {
    let minutes = (t_s / 60.0).round() as u64;
    let (hours, days) = (minutes / 60, minutes / 1440);
    let long = match (days, hours) {
        (2.., _) => format!(" ({days} d {} h)", hours % 24),
        (_, 1..) => format!(" ({hours} h {} min)", minutes % 60),
        _ if minutes >= 2 => format!(" ({minutes} min)"),
        _ => String::new(),
    };
    format!("{} s{long}", seconds(t_s))
}

fn positions(blocks: &mut Vec<DocumentBlock>, s: &SchemeReview, id: &str) {
    let rows = s.analysis.positions.iter().zip(&s.positions).map(|(p, numbers)| {
        vec![
            p.name.clone(),
            words::angles(p),
            p.attitude.clone().unwrap_or_else(|| "-".into()),
            seconds(numbers.start_s),
            seconds(numbers.dwell_s),
            numbers.slew_s.map_or_else(|| "-".into(), seconds),
            numbers.turn.map_or_else(|| "-".into(), |turn| words::turn(&turn)),
        ]
    });
    let columns = [
        left("position"),
        left("alpha, beta, gamma [deg]"),
        left("X_p Y_p Z_p"),
        right("start [s]"),
        right("dwell [s]"),
        right("slew to it [s]"),
        left("turn"),
    ];
    let table = DocumentBlock::table("Positions in order of time", columns, rows);
    let empty = |all: &dyn Fn(usize) -> bool| (0..s.positions.len()).all(all);
    let unused = [
        ("X_p Y_p Z_p", empty(&|i| s.analysis.positions[i].attitude.is_none())),
        ("slew to it [s]", empty(&|i| s.positions[i].slew_s.is_none())),
        ("turn", empty(&|i| s.positions[i].turn.is_none())),
    ];
    let unused: Vec<&str> = unused.into_iter().filter(|c| c.1).map(|c| c.0).collect();
    blocks.push(table.without(&unused));
    blocks.extend(gimbals::block(s.analysis.gimbals.as_ref()));
    let at = &s.simulation.conditions;
    blocks.extend(pictures::poses(&s.poses, at.latitude_deg, at.latitude_by_default, id));
}

/// Gravity along the axes of the gyros at each position, and what each position excites.
fn numbers(
    s: &SchemeReview,
    coefficients: &[&Quantity],
    review: &ComparedScheme,
    id: &str,
) -> Vec<DocumentBlock> {
    let component = |x: f64| if x == x.round() { format!("{x:.0}") } else { format!("{x:.3}") };
    let g = |g: [f64; 3]| g.map(component).join(", ");
    let row =
        |p: &obsdeg_design::review::PositionReview| vec![p.name.clone(), g(p.g[0]), g(p.g[1]), g(p.g[2])];
    let mut out = vec![
        DocumentBlock::table(
            "Components of g along the axes I, O, S of each gyro (in g, at the start)",
            [left("position"), right("gyro X: I O S"), right("gyro Y: I O S"), right("gyro Z: I O S")],
            s.positions.iter().map(row),
        ),
        pictures::attitudes(s, &format!("{id}_attitude")),
    ];
    if coefficients.iter().any(|q| !q.excitation.is_empty()) {
        out.push(pictures::excitation(coefficients, &review.positions, &format!("{id}_excitation")));
    }
    out
}

/// Length in bytes from which a formula is one of many terms or decimals.
const LONG_FORMULA: usize = 220;

fn solved(a: &Analysis) -> Vec<DocumentBlock> {
    let formula = |left: String, expression: &str, solution: &obsdeg_core::analysis::Solution| Typeset {
        text: format!("{expression} = {}", solution.text),
        latex: format!("{left} = {}", latex::solution(solution, a.frame, &a.stations)),
    };
    let unknowns = a.quantities.iter().filter_map(|q| {
        let solution = q.solution.as_ref()?;
        Some(formula(latex::symbol(&q.name), &q.name, solution))
    });
    let combinations = words::combinations(a).filter_map(|c| {
        let solution = c.solution.as_ref()?;
        Some(formula(latex::expression(&c.expression), &c.expression, solution))
    });
    let is_long = |f: &Typeset| f.text.len() > LONG_FORMULA;
    let ((long, short), (long_sums, short_sums)): ((Vec<_>, Vec<_>), (Vec<_>, Vec<_>)) =
        (unknowns.partition(is_long), combinations.partition(is_long));
    let none = long.is_empty() && short.is_empty();
    let mut out: Vec<DocumentBlock> =
        Vec::from_iter(none.then(|| DocumentBlock::Text("No unknown is observable by itself.".into())));
    out.extend(DocumentBlock::formulas("Unknowns", short));
    out.extend(DocumentBlock::formulas("Combinations", short_sums));
    out.extend(DocumentBlock::list_if_any(words::ACCURACY, words::accuracy(a)));
    let long = DocumentBlock::formulas("Unknowns", long)
        .into_iter()
        .chain(DocumentBlock::formulas("Combinations", long_sums));
    out.extend(DocumentBlock::details(3, "Formulas of many terms or decimals", long.collect()));
    out
}

fn sensitivity(s: &SchemeReview, review: &ComparedScheme, id: &str) -> Vec<DocumentBlock> {
    let row = |c: &obsdeg_evidence::compare::Sensitivity| {
        vec![
            c.condition.clone(),
            compare::rank(c.rank, review.has_accuracy_orders),
            compare::worst(c.worst.as_ref()),
            compare::worst(c.worst_determined.as_ref()),
        ]
    };
    let mut out = vec![DocumentBlock::table(
        format!(
            "Rank, and largest {} in deg/h (per g): of all coefficients, of those determined here (- where one \
             is not observable)",
            if review.conditions.bench.is_some() { "total uncertainty with the bench" } else { "sigma" }
        ),
        [left("condition"), right("rank with dwell"), left("of all"), left("of those determined")],
        review.sensitivity.iter().map(row),
    )];
    out.extend(DocumentBlock::list_if_any("Verdicts under the other carries", words::carries(&s.analysis)));
    out.extend(pictures::latitudes(s, &format!("{id}_latitude")));
    out
}

/// Absolute value from which a correlation of two estimates is listed, and the number of lines.
const CORRELATED: f64 = 0.9;
const LINES: usize = 6;

/// Strongest correlations, under a diffuse prior, of the estimates of unknowns that are determined.
fn correlated(s: &SchemeReview) -> Option<DocumentBlock> {
    let of = &s.evidence.as_ref().ok()?.correlation;
    let determined = |name: &str| {
        let found = s.analysis.quantities.iter().find(|q| q.name == name);
        found.is_some_and(|q| q.degree.is_some())
    };
    let mut pairs: Vec<(f64, &str, &str)> = Vec::new();
    for (i, a) in of.names.iter().enumerate().filter(|(_, name)| determined(name)) {
        for (j, b) in of.names.iter().enumerate().take(i).filter(|(_, name)| determined(name)) {
            pairs.push((of.values[i][j], b, a));
        }
    }
    pairs.retain(|p| p.0.abs() >= CORRELATED);
    pairs.sort_by(|p, q| q.0.abs().total_cmp(&p.0.abs()));
    let more = pairs.len().saturating_sub(LINES);
    let mut lines: Vec<String> =
        pairs.iter().take(LINES).map(|(r, a, b)| format!("{a} and {b}: {r:.3}")).collect();
    lines.extend((more > 0).then(|| format!("{more} more pairs")));
    let title = format!(
        "Estimates that depend on each other (correlation of {CORRELATED} or more, with a diffuse prior)"
    );
    DocumentBlock::list_if_any(title, lines)
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

/// Fewest positions, the best scheme of the cardinal attitudes, and what each position is needed for.
fn fewest(blocks: &mut Vec<DocumentBlock>, s: &SchemeReview, review: &ComparedScheme) {
    let mut lines = Vec::new();
    lines.extend(s.alternatives.kept.as_ref().map(|kept| fewest_of_these(kept, s, review)));
    lines.extend(fewest_of_all(s, review));
    lines.extend(best_of_all(s));
    lines.extend(resolve::position_to_drop(review));
    blocks.push(DocumentBlock::list("", lines));
    if !review.drop_one.is_empty() {
        blocks.push(without_one_position(review));
    }
}

/// Sentence on the fewest positions of the scheme that observe what it observes.
fn fewest_of_these(kept: &Minimum, s: &SchemeReview, review: &ComparedScheme) -> String {
    let required = &s.alternatives.required;
    match kept.positions {
        Some(k) if k == s.positions.len() => {
            // what slews determine besides is in the rows without one position
            let beside = match review.slews.is_empty() {
                true => "",
                false => "; what follows counts the slews too",
            };
            format!(
                "all {k} positions are needed to observe {} by repositioning at once{beside}",
                required.join(", ")
            )
        }
        Some(k) => format!(
            "{k} of the {} positions ({}) suffice to observe {}; whether they meet the requirements is \
             another question",
            s.positions.len(),
            kept.witness.join(", "),
            required.join(", ")
        ),
        None => "too many sets of positions to look for the fewest".into(),
    }
}

/// Sentence on the best scheme of cardinal attitudes at the dwell of this one, and on the bound of its
/// criterion.
fn best_of_all(s: &SchemeReview) -> Option<String> {
    let alternatives = &s.alternatives;
    let c = alternatives.certificate.as_ref()?;
    let same_dwell = |dwell_s: f64| s.positions.first().is_some_and(|p| p.dwell_s == dwell_s);
    let best = alternatives.front.iter().find(|f| same_dwell(f.dwell_s))?;
    let Excess { value, bound, percent } = Excess::new(best.value, c.best_possible, c.within_percent);
    Some(format!(
        "of {} of the 24 cardinal attitudes at {} s each none has a largest sigma of {} below {bound} \
         (optimal weights); the best found has {value}, at most {percent} above",
        alternatives.front_positions,
        number(best.dwell_s),
        alternatives.required.join(", "),
    ))
}

/// Table of the scheme without one of its positions.
fn without_one_position(review: &ComparedScheme) -> DocumentBlock {
    let row = |d: &obsdeg_evidence::compare::DropOne| {
        let lost = if d.lost.is_empty() { "-".into() } else { d.lost.join(" ") };
        vec![
            d.position.clone(),
            lost,
            compare::worst(d.worst.as_ref()),
            compare::requirements(&d.requirements),
        ]
    };
    let figure = match review.conditions.bench.is_some() {
        true => "worst total(D), with the bench [deg/h, /g]",
        false => "worst sigma(D) [deg/h, /g]",
    };
    let columns = ["without", "not observable any more", figure, compare::REQUIREMENTS[0]].map(left);
    let table = DocumentBlock::table("Without one position", columns, review.drop_one.iter().map(row));
    table.without(&left_out(review))
}

/// Largest number of pictures of slopes, one for each unit, in the printed part of an appendix.
const SLOPES: usize = 4;

/// Evidence: a line per kind of check that agrees, and the rows of those that do not.
fn evidence_of(s: &SchemeReview, id: &str) -> Vec<DocumentBlock> {
    let c = match &s.evidence {
        Ok(c) => c,
        Err(e) => return vec![DocumentBlock::Text(format!("None: {}.", words::no_evidence(e)))],
    };
    let outcome = match (c.passed, c.verdicts_agree) {
        (true, _) if c.counts.not_resolvable > 0 => "agree in every check that is resolvable",
        (true, _) => "agree in every check",
        (false, true) => "agree, but the Monte Carlo runs do NOT fit the filter, as listed below",
        (false, false) => "DISAGREE, as listed below",
    };
    // the run has the truth of the checks
    let run = if s.simulation.consistency.consistent { "" } else { ", but the run below is not consistent" };
    let mut out = vec![DocumentBlock::Text(format!(
        "Exact verdicts and a Kalman filter are two independent paths: they {outcome}{run}."
    ))];
    let Document { lead, blocks, .. } = c.document();
    out.extend(lead.into_iter().map(DocumentBlock::Text));
    let (mut agree, mut open, mut details) = (Vec::new(), Vec::new(), Vec::new());
    for block in blocks {
        match block {
            DocumentBlock::Table { heading, columns, rows } => {
                let fails = |row: &&Vec<TableCell>| {
                    row.iter().any(|c| c.text == "FAIL" || c.text == "not resolvable")
                };
                let failing: Vec<Vec<TableCell>> = rows.iter().filter(fails).cloned().collect();
                agree.push(format!("{heading}: {} of {} agree", rows.len() - failing.len(), rows.len()));
                if !failing.is_empty() {
                    open.push(DocumentBlock::Table {
                        heading: format!("Not agreeing: {heading}"),
                        columns: columns.clone(),
                        rows: failing,
                    });
                }
                details.push(DocumentBlock::Table { heading, columns, rows });
            }
            b if is_list(&b, "Assumed") || is_list(&b, "Validity of the small-angle model") => {}
            b if is_list(&b, "What disagrees") || is_list(&b, "Not resolvable, and why") => open.push(b),
            b => details.push(b),
        }
    }
    out.push(DocumentBlock::list("Checks", agree));
    out.extend(open);
    let mut slopes = pictures::slopes(c, id);
    let more = slopes.split_off(slopes.len().min(SLOPES));
    out.extend(slopes);
    out.extend(pictures::consistency(c, id));
    details.extend(more);
    details.push(pictures::correlation(c, &format!("{id}_correlation")));
    out.extend(DocumentBlock::details(3, "Every check", details));
    out
}

/// Number of pictures of errors in the printed part of an appendix.
const ERRORS: usize = 6;

/// One run against a simulated truth: its lists, the errors of the worst unknowns, and in the details all.
fn run(s: &SchemeReview, review: &ComparedScheme, id: &str) -> Vec<DocumentBlock> {
    let blocks = s.simulation.document().blocks.into_iter();
    let kept = |b: &DocumentBlock| {
        matches!(b, DocumentBlock::Table { .. } | DocumentBlock::List { .. })
            && !["Assumed", "Validity of the small-angle model"].iter().any(|name| is_list(b, name))
            && !matches!(b, DocumentBlock::List { heading, .. } if heading.starts_with("Not estimated"))
    };
    // the unknowns' table has the predicted sigmas, and a page has no room for more columns
    let blocks = blocks.filter(kept).map(|b| b.without(&["predicted"]));
    let (mut details, mut out): (Vec<DocumentBlock>, Vec<DocumentBlock>) =
        blocks.partition(|b| matches!(b, DocumentBlock::Table { .. }));
    out.insert(0, DocumentBlock::Text("One run against a simulated truth, with its errors:".into()));
    let flat: Vec<&str> = (s.simulation.quantities.iter())
        .filter(|q| q.status == Status::NotExcited && q.outcome == Outcome::PriorOnly)
        .map(|q| q.name.as_str())
        .collect();
    let margin = |name: &str| review.quantities.iter().find(|q| q.name == name).and_then(|q| q.margin);
    let mut errors = pictures::errors(&s.traces, &flat, id);
    errors.sort_by(|(a, _), (b, _)| {
        margin(a).unwrap_or(f64::INFINITY).total_cmp(&margin(b).unwrap_or(f64::INFINITY))
    });
    let mut pictures: Vec<DocumentBlock> = errors.into_iter().map(|(_, picture)| picture).collect();
    let rest = pictures.split_off(pictures.len().min(ERRORS));
    out.extend(pictures);
    out.extend(pictures::not_drawn(&flat));
    details.extend(rest);
    out.extend(DocumentBlock::details(3, "Estimates at the end, and the errors of all others", details));
    out
}
