//! Explanations of single verdicts. Every listed improvement is made in the text of the scheme or model and
//! judged from there, and no unlisted single change of the same kinds helps. Assumptions are removed in the
//! text too.

use obsdeg_core::analysis::{AnalysisOptions, analyze, explain};
use obsdeg_core::model::{Carry, Scheme, cardinal_names, scheme_file};
use obsdeg_core::remedies::Change;
use obsdeg_core::system::{SystemOptions, analyze_system, explain_system, json};
use obsdeg_core::why::{Assumption, AssumptionKind, Improvement, Why};
use obsdeg_exact::SplitMix64;
use serde_json::Value;

use crate::models::models;
use crate::program::{cases, refused, run, stderr, stdout};
use crate::remedies::{
    Degrees, changed_model, changed_scheme, degree, degrees_of_scheme, judged_model, judged_scheme, p1_p2,
    random_scheme,
};

fn explained(scheme: &Scheme, name: &str) -> Why {
    let options = AnalysisOptions { solutions: false, omitted: false, ..AnalysisOptions::default() };
    let found = analyze(scheme, options, None).expect("an analysis");
    explain(scheme, &found, name, 1).expect("an explanation").expect("an unknown")
}

fn lower(after: Option<usize>, before: Option<usize>) -> bool {
    after.is_some_and(|a| before.is_none_or(|b| a < b))
}

/// Verdicts on a scheme with some changes.
fn after(scheme: &Scheme, changes: &[Change]) -> Degrees {
    let (azimuth, rest): (Vec<&Change>, Vec<&Change>) =
        changes.iter().partition(|c| matches!(c, Change::Output { .. }));
    assert!(azimuth.iter().all(|c| matches!(c, Change::Output { state } if state == "psi_y^n")));
    let scheme =
        Scheme { measured_azimuth: scheme.measured_azimuth || !azimuth.is_empty(), ..scheme.clone() };
    let rest: Vec<Change> = rest.into_iter().cloned().collect();
    let (changed, known) = changed_scheme(&scheme, &rest);
    match known[..] {
        [] => judged_scheme(&changed).1,
        _ => degrees_of_scheme(&changed, &known),
    }
}

/// Errors of an improvement, from the verdicts before and after it.
fn wrong(name: &str, improvement: &Improvement, before: &Degrees, after: &Degrees) -> Vec<String> {
    let mut out = Vec::new();
    let (was, is) = (degree(before, name), degree(after, name));
    if !lower(is, was) || is != Some(improvement.degree) {
        out.push(format!("{name} had {was:?}, has {is:?}: {improvement:?}"));
    }
    for r in &improvement.resolves {
        if degree(before, &r.name).is_some() || degree(after, &r.name) != Some(r.degree) {
            out.push(format!("{} is not resolved: {improvement:?}", r.name));
        }
    }
    let given = |n: &String| improvement.changes.iter().any(|c| c.known() == Some(n));
    let won = before.iter().filter(|q| q.1.is_none() && q.0 != name && !given(&q.0));
    for (other, _) in won.filter(|q| degree(after, &q.0).is_some()) {
        // psi of a position under reset carry stands for psi
        if !improvement.resolves.iter().any(|r| r.name == *other) && !other.contains('@') {
            out.push(format!("{other} is resolved as well: {improvement:?}"));
        }
    }
    let lost = before.iter().filter(|q| q.1.is_some() && after.iter().any(|a| a.0 == q.0 && a.1.is_none()));
    let mut lost: Vec<&String> = lost.map(|q| &q.0).collect();
    let mut said: Vec<&String> = improvement.loses.iter().filter(|name| !name.contains('@')).collect();
    lost.sort();
    said.sort();
    if lost != said {
        out.push(format!("loses {lost:?}: {improvement:?}"));
    }
    out
}

/// All single changes of a scheme.
fn singles(scheme: &Scheme, before: &Degrees, name: &str) -> Vec<Change> {
    let known = before.iter().filter(|q| q.0 != name).map(|q| Change::Known { name: q.0.clone() });
    let position = format!("p{}", scheme.positions.len() + 1);
    let drift = scheme.unknowns.to_string() == "drift";
    let attitude = |attitude| Change::Attitude { position: position.clone(), attitude };
    let attitudes = cardinal_names().into_iter().filter(|_| !drift).map(attitude);
    let azimuth = Change::Output { state: "psi_y^n".into() };
    let carries = Carry::ALL.into_iter().filter(|c| *c != scheme.carry && !drift);
    (known.chain(attitudes))
        .chain((!scheme.measured_azimuth).then_some(azimuth))
        .chain(carries.map(|carry| Change::Carry { carry }))
        .collect()
}

/// Errors of the improvements of an explanation, listed and missing ones.
fn improvements(scheme: &Scheme, before: &Degrees, why: &Why) -> Vec<String> {
    let mut out = Vec::new();
    for improvement in &why.remedies {
        out.extend(wrong(&why.name, improvement, before, &after(scheme, &improvement.changes)));
    }
    let pairs = why.remedies.iter().any(|i| i.changes.len() > 1);
    let mut helps = 0;
    for change in singles(scheme, before, &why.name) {
        let found = degree(&after(scheme, std::slice::from_ref(&change)), &why.name);
        let listed = why.remedies.iter().any(|i| i.changes == [change.clone()]);
        helps += usize::from(lower(found, why.degree));
        // psi of positions under reset carry is compared with psi of the others
        let other_psi = matches!(change, Change::Carry { .. }) && why.name.contains('@');
        if listed != lower(found, why.degree) && !other_psi {
            out.push(format!("{} by {change:?}: {found:?}, listed: {listed}", why.name));
        }
    }
    if pairs && helps > 0 {
        out.push("two changes where one is enough".into());
    }
    out
}

/// The scheme under the condition that replaces an assumption.
fn relaxed(scheme: &Scheme, a: &Assumption, condition: &str) -> Option<Scheme> {
    let text = scheme_file::write(scheme);
    let line = |key: &str, value: Option<&str>| {
        let lines = text.lines().filter(|l| !l.starts_with(&format!("{key} =")));
        let new = value.map(|v| format!("{key} = {v}"));
        new.into_iter().chain(lines.map(String::from)).collect::<Vec<_>>().join("\n")
    };
    let changed = match a.kind {
        AssumptionKind::Carry => line("carry", Some(&format!("\"{condition}\""))),
        AssumptionKind::Latitude => match condition {
            "pole" => line("latitude_deg", Some("90")),
            "equator" => line("latitude_deg", Some("0")),
            _ => line("latitude_deg", None),
        },
        AssumptionKind::Azimuth => line("measured_azimuth", Some("false")),
        AssumptionKind::Position => {
            let parts: Vec<&str> = text.split("[[position]]").collect();
            let others = parts[1..].iter().filter(|p| !p.contains(&format!("name = \"{}\"", a.stated)));
            others.fold(parts[0].to_string(), |text, p| format!("{text}[[position]]{p}"))
        }
        _ => return None,
    };
    Some(scheme_file::read(&changed).unwrap_or_else(|e| panic!("{e:?}\n{changed}")))
}

/// Errors of the assumptions of an explanation.
fn assumptions(scheme: &Scheme, why: &Why) -> Vec<String> {
    let mut out = Vec::new();
    for a in &why.assumptions {
        if a.decides != a.otherwise.iter().any(|o| o.degree != why.degree) {
            out.push(format!("{a:?}"));
        }
        // psi of a position has another name there
        for other in a.otherwise.iter().filter(|_| !why.name.contains('@')) {
            let Some(changed) = relaxed(scheme, a, &other.condition) else { continue };
            let found = judged_scheme(&changed).1;
            if degree(&found, &why.name) != other.degree {
                out.push(format!("{} without {a:?}: {:?}", why.name, degree(&found, &why.name)));
            }
        }
    }
    let positions = why.assumptions.iter().filter(|a| a.kind == AssumptionKind::Position).count();
    let listed = positions == scheme.positions.len() || why.name.starts_with("psi");
    if scheme.positions.len() > 1 && !listed && !scheme.torquers_act() {
        out.push(format!("{positions} positions"));
    }
    out
}

/// Explains two unknowns of each random scheme. Returns the number of improvements.
fn random_schemes(count: usize, seed: u64) -> usize {
    let mut rng = SplitMix64::new(seed);
    let mut tried = 0;
    for i in 0..count {
        let scheme = random_scheme(&mut rng);
        let before = judged_scheme(&scheme).1;
        for _ in 0..2 {
            let name = &before[rng.below(before.len() as u64) as usize].0;
            let why = explained(&scheme, name);
            assert_eq!(why.degree, degree(&before, name));
            tried += why.remedies.len();
            let mut found = improvements(&scheme, &before, &why);
            found.extend(assumptions(&scheme, &why));
            assert_eq!(found, [] as [String; 0], "scheme {i}:\n{}", scheme_file::write(&scheme));
        }
    }
    tried
}

#[test]
fn what_is_said_to_help_does_and_nothing_else() {
    let count = cases(4, 8);
    assert!(random_schemes(count, 21) > 5 * count);
}

#[test]
#[ignore = "at full length: .ci/run release"]
fn what_is_said_to_help_does_in_500_schemes() {
    let tried = random_schemes(500, 22);
    assert!(tried > 1500, "{tried}");
}

/// Explains two unknowns of every `step`th model: the worst and one more. Returns the number of improvements.
fn of_models(step: usize) -> usize {
    let mut tried = 0;
    for (i, (name, value, text)) in models().into_iter().enumerate().filter(|(i, _)| i % step == 0) {
        let model = json::read(&text).expect("a model");
        let options = SystemOptions { solutions: false, ..SystemOptions::default() };
        let found = analyze_system(&model, options).expect("an answer");
        let before = judged_model(&text);
        let worst = before.iter().max_by_key(|q| q.1.map_or(usize::MAX, |k| k)).expect("an unknown");
        for (unknown, _) in [worst, &before[i % before.len()]] {
            let why =
                explain_system(&model, &found, unknown, options).expect("explained").expect("an unknown");
            assert_eq!(why.degree, degree(&before, unknown), "{name}");
            assert_eq!(why.determined_by.iter().map(|d| d.order).max(), why.degree, "{name}: {why:?}");
            let unseen = why.unseen.as_ref().map(|u| u.up_to_order);
            assert!(why.degree.is_none_or(|k| unseen == k.checked_sub(1)), "{name}: {why:?}");
            for improvement in &why.remedies {
                tried += 1;
                let after = judged_model(&changed_model(&value, &improvement.changes));
                let wrong = wrong(unknown, improvement, &before, &after);
                assert_eq!(wrong, [] as [String; 0], "{name}");
            }
            for a in &why.assumptions {
                let Some(text) = without(&value, a) else { continue };
                let after = judged_model(&text);
                assert_eq!(degree(&after, unknown), a.otherwise[0].degree, "{name} without {a:?}");
            }
        }
    }
    tried
}

/// JSON of a model without an assumption; `None` if more than one name would have to move.
fn without(model: &Value, a: &Assumption) -> Option<String> {
    let input = a.kind == AssumptionKind::KnownInput;
    if input && !(model["input_assumption"].is_null() && model["unknown_input_max_derivative"].is_null()) {
        return None;
    }
    let mut model = model.clone();
    let mut take = |key: &str, name: &str| {
        // an index would add what is not there
        match model.get_mut(key) {
            Some(Value::Array(list)) => list.retain(|x| x != name),
            Some(Value::Object(map)) => _ = map.remove(name),
            _ => {}
        }
    };
    let put = match a.kind {
        AssumptionKind::Output => {
            take("outputs", &a.stated);
            None
        }
        AssumptionKind::KnownStart => {
            take("known_initial_conditions", &a.stated);
            take("known_initial_values", &a.stated);
            None
        }
        AssumptionKind::KnownConstant => {
            take("known_constants", &a.stated);
            Some("params")
        }
        AssumptionKind::KnownInput => {
            take("known_inputs", &a.stated);
            Some("unknown_inputs")
        }
        _ => panic!("{a:?}"),
    };
    if let Some(list) = put {
        match model[list].as_array_mut() {
            Some(names) => names.push(a.stated.as_str().into()),
            None => model[list] = vec![a.stated.as_str()].into(),
        }
    }
    Some(model.to_string())
}

#[test]
fn what_is_said_to_help_in_models_does() {
    assert!(of_models(12) > 20);
}

#[test]
#[ignore = "at full length: .ci/run release"]
fn what_is_said_to_help_in_all_models_does() {
    assert!(of_models(1) > 300);
}

/// The paper's two positions by hand. D_FZ - wN psi_y has degree 1 (17), so that the two go together:
/// psi_y = 1/wN for D_FZ = 1. One known value, or a measured azimuth, gives the other. D_FY needs Z1''
/// (16): eps_y of the two positions, D_FY +- D_IY.
#[test]
fn two_positions_by_hand() {
    let why = explained(&p1_p2(), "D_FZ");
    assert!(why.degree.is_none() && why.determined_by.is_empty());
    let unseen = why.unseen.expect("a direction");
    let components = unseen.components.iter().map(|c| (c.name.as_str(), c.coefficient.as_deref()));
    assert_eq!(components.collect::<Vec<_>>(), [("D_FZ", Some("1")), ("psi_y", Some("1/wN"))]);
    assert!(unseen.at_every_order && unseen.seen_by.is_empty());
    let changes: Vec<&Change> = why.remedies.iter().map(|i| &i.changes[0]).collect();
    assert_eq!(*changes[0], Change::Known { name: "psi_y".into() });
    assert!(changes.contains(&&Change::Carry { carry: Carry::Inertial }), "{changes:?}");
    assert!(why.assumptions[0].decides && why.assumptions[0].stated == "platform");

    let why = explained(&p1_p2(), "D_FY");
    let derivatives: Vec<(&str, usize, Option<&str>)> =
        why.determined_by.iter().map(|d| (d.output.as_str(), d.order, d.place.as_deref())).collect();
    assert_eq!(why.degree, Some(2));
    for place in ["p1", "p2"] {
        assert!(derivatives.contains(&("Z1", 2, Some(place))), "{derivatives:?}");
        let position = why.assumptions.iter().find(|a| a.stated == place).expect("a position");
        assert!(position.decides);
    }
    // without an azimuth no smaller order is enough
    assert_eq!(why.unseen.expect("a direction").up_to_order, 1);
    let why = explained(&p1_p2(), "psi_x");
    assert_eq!((why.degree, why.unseen, why.remedies.len()), (Some(0), None, 0));
    let why = explained(&p1_p2(), "D_IX");
    assert_eq!(why.unseen.expect("a direction").components.len(), 1);
}

/// Names that are not unknowns are refused with similar names.
#[test]
fn names_are_checked() {
    let asked = ["analyze", "--angles", "NUE", "--why", "D_FW", "--solutions", "off"];
    refused(&asked, &["--why: no unknown `D_FW`; did you mean `D_FX`?"]);
}

/// A family stands for its coefficients, a state for that of every experiment; none is explained twice.
#[test]
fn a_family_is_explained_one_by_one() {
    let names = |arguments: &[&str]| -> Vec<String> {
        let run = run(&[arguments, &["--solutions", "off", "--format", "json"]].concat());
        assert!(run.status.success(), "{}", stderr(&run));
        let answer: Value = serde_json::from_str(&stdout(&run)).expect("JSON");
        let why = answer["why"].as_array().expect("a list");
        why.iter().map(|w| w["name"].as_str().expect("a name").to_string()).collect()
    };
    let scheme = ["analyze", "--angles", "NUE", "--why", "D_FY", "--why", "D_F"];
    assert_eq!(names(&scheme), ["D_FY", "D_FX", "D_FZ"]);
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("m.toml");
    let text =
        "name='m'\nparameters=['k']\n[states]\nx='-k*x'\n[outputs]\ny='x'\n[[experiment]]\n[[experiment]]\n";
    std::fs::write(&file, text).expect("written");
    let model = ["analyze", "--model", file.to_str().expect("UTF-8"), "--why", "x"];
    assert_eq!(names(&model), ["x@1", "x@2"]);
}
