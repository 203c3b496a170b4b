//! Design review: its sections in the order of a review.

mod actions;
pub(crate) mod answers;
pub(crate) mod calibrated;
mod evidence;
mod first;
mod generic;
mod model;
mod notation;
mod pictures;
mod positions;
mod sections;
mod sensitivity;
pub(crate) mod title;
mod unknowns;
mod verdict;

use obsdeg_calibration::Calibration;
use obsdeg_design::review::{DesignReview, SchemeReview};
use obsdeg_evidence::compare::{ComparedQuantity, ComparedScheme};

use crate::Answer;
use crate::document::{Document, DocumentBlock, Fold};
use crate::{Origin, budget, compare, omitted, simulation, stated, words};
use evidence::{evidence_of, run};
use positions::{numbers, positions};
use sections::section;
use sensitivity::{correlated, fewest, sensitivity};
use unknowns::{not_estimated, null_space, solved, unknowns};

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

/// Two pages and the appendix of a scheme. Of several schemes a printed page has the two pages alone.
fn scheme(blocks: &mut Vec<DocumentBlock>, s: &SchemeReview, review: &ComparedScheme, alone: bool, id: &str) {
    let level = if alone { 1 } else { 2 };
    let coefficients: Vec<&ComparedQuantity> =
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
    coefficients: &[&ComparedQuantity],
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
    coefficients: &[&ComparedQuantity],
    id: &str,
) -> Vec<(&'static str, Vec<DocumentBlock>)> {
    let a = &s.analysis;
    let mut indistinguishable = Vec::new();
    null_space(&mut indistinguishable, a);
    let mut assumed = words::assumptions::assumptions(a);
    // carry, latitude and observation are stated above
    assumed
        .extend(stated::measurement(&review.conditions).into_iter().filter(|l| !l.starts_with("latitude")));
    assumed.extend(simulation::conditions(&s.simulation.conditions, &s.simulation.timeline));
    assumed.push(words::certainty(a));
    let evidence = s.evidence.as_ref().err().map(words::run::no_evidence);
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
