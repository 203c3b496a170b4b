//! Remedies resolve the unknowns that they name: every change is made in the text of the scheme or model, and
//! judged from there.

use std::collections::BTreeSet;

use obsdeg_core::analysis::{AnalysisOptions, analyze};
use obsdeg_core::degree::{DerivativeRows, PlatformRows};
use obsdeg_core::model::{Carry, Platform, RandomValues, Scheme, cardinal_names, scheme_file};
use obsdeg_core::remedies::{Change, Remedies, Remedy};
use obsdeg_core::system::{SystemOptions, analyze_system, json, judge, model_file};
use obsdeg_exact::{Field, SplitMix64};
use serde_json::Value;

use crate::models::models;

/// Seed of the verdicts, different from that of the remedies.
const SEED: u64 = 7;

pub(crate) type Degrees = Vec<(String, Option<usize>)>;

pub(crate) fn degree(all: &Degrees, name: &str) -> Option<usize> {
    all.iter().find(|q| q.0 == name).and_then(|q| q.1)
}

/// Errors of a remedy, by the verdicts before and after it.
fn wrong(remedy: &Remedy, before: &Degrees, after: &Degrees) -> Vec<String> {
    let mut out = Vec::new();
    for r in &remedy.resolves {
        let (was, is) = (degree(before, &r.name), degree(after, &r.name));
        if was.is_some() || is != Some(r.degree) {
            out.push(format!("{} had {was:?}, has {is:?}, not {}: {:?}", r.name, r.degree, remedy.changes));
        }
    }
    let lost = before.iter().filter(|q| q.1.is_some() && after.iter().any(|a| a.0 == q.0 && a.1.is_none()));
    let lost: BTreeSet<&String> = lost.map(|q| &q.0).collect();
    // psi of a position under reset carry is part of psi
    let said: BTreeSet<&String> = remedy.loses.iter().filter(|name| !name.contains('@')).collect();
    if lost != said {
        out.push(format!("loses {lost:?}, not {said:?}: {:?}", remedy.changes));
    }
    out
}

/// Unobservable unknowns that neither have a remedy nor are said to have none.
fn complete(remedies: &Remedies, before: &Degrees) -> Vec<String> {
    let resolved =
        |name: &String| remedies.remedies.iter().any(|r| r.resolves.iter().any(|x| x.name == *name));
    let open = before.iter().filter(|q| q.1.is_none()).map(|q| &q.0);
    open.filter(|name| resolved(name) == remedies.unresolved.contains(name))
        .map(|n| format!("{n} is left out"))
        .collect()
}

/// Row space by a separate Gaussian elimination, to test for unit vectors.
struct Span {
    field: Field,
    rows: Vec<(usize, Vec<u64>)>,
}

impl Span {
    fn rest(&self, row: &[u64]) -> Vec<u64> {
        let f = &self.field;
        let mut rest = row.to_vec();
        for (pivot, basis) in &self.rows {
            let factor = rest[*pivot];
            for (x, b) in rest.iter_mut().zip(basis) {
                *x = f.sub(*x, f.mul(factor, *b));
            }
        }
        rest
    }

    fn insert(&mut self, row: &[u64]) {
        let rest = self.rest(row);
        if let Some(pivot) = rest.iter().position(|x| *x != 0) {
            let inverse = self.field.inv(rest[pivot]);
            self.rows.push((pivot, rest.iter().map(|x| self.field.mul(*x, inverse)).collect()));
        }
    }

    fn has(&self, column: usize, columns: usize) -> bool {
        self.rest(&unit(&self.field, column, columns)).iter().all(|x| *x == 0)
    }
}

fn unit(field: &Field, column: usize, columns: usize) -> Vec<u64> {
    (0..columns).map(|c| if c == column { field.one() } else { 0 }).collect()
}

/// Degrees of a scheme with some known values, from its derivative rows.
pub(crate) fn degrees_of_scheme(scheme: &Scheme, known: &[&str]) -> Degrees {
    let platform = Platform::new(scheme.clone()).expect("a scheme");
    let values = RandomValues::draw(platform.scheme(), &mut SplitMix64::new(SEED)).expect("a field");
    let sample = values.sample(platform.scheme(), 1);
    let mut rows = PlatformRows::new(&platform, &sample);
    let (names, columns) = (platform.names(), platform.names().len());
    let mut span = Span { field: sample.point.ring, rows: Vec::new() };
    for name in known {
        let column = names.iter().position(|n| n == name).expect("an unknown");
        span.insert(&unit(&sample.point.ring, column, columns));
    }
    let mut out: Degrees = names.iter().map(|n| (n.clone(), None)).collect();
    for order in 0.. {
        let more = rows.emit(order, &mut |row| {
            span.insert(row);
            true
        });
        if !more {
            break;
        }
        for (c, q) in out.iter_mut().enumerate().filter(|(_, q)| q.1.is_none()) {
            q.1 = span.has(c, columns).then_some(order);
        }
    }
    out
}

/// The scheme with the changes of a remedy, written and read again, and the names of the known values.
pub(crate) fn changed_scheme<'a>(scheme: &Scheme, changes: &'a [Change]) -> (Scheme, Vec<&'a str>) {
    let mut text = scheme_file::write(scheme);
    let mut known = Vec::new();
    for change in changes {
        match change {
            Change::Attitude { position, attitude } => {
                text.push_str(&format!("\n[[position]]\nname = \"{position}\"\nattitude = \"{attitude}\"\n"));
            }
            Change::Carry { carry } => {
                let other = Scheme { carry: *carry, ..scheme.clone() };
                text = scheme_file::write(&other);
            }
            Change::Known { name } => known.push(name.as_str()),
            Change::Output { .. } => panic!("a scheme has no such output"),
        }
    }
    (scheme_file::read(&text).unwrap_or_else(|e| panic!("{e:?}\n{text}")), known)
}

pub(crate) fn judged_scheme(scheme: &Scheme) -> (Remedies, Degrees) {
    let options = AnalysisOptions { seed: SEED, solutions: false, ..AnalysisOptions::default() };
    let a = analyze(scheme, options, None).expect("an analysis");
    (a.to_resolve, a.quantities.into_iter().map(|q| (q.name, q.degree)).collect())
}

fn of_remedy(scheme: &Scheme, before: &Degrees, remedy: &Remedy) -> Vec<String> {
    let (changed, known) = changed_scheme(scheme, &remedy.changes);
    let after = match known[..] {
        [] => judged_scheme(&changed).1,
        _ => degrees_of_scheme(&changed, &known),
    };
    wrong(remedy, before, &after)
}

/// Errors of the remedies of a scheme.
fn of_scheme(scheme: &Scheme) -> Vec<String> {
    let options = AnalysisOptions { solutions: false, ..AnalysisOptions::default() };
    let remedies = analyze(scheme, options, None).expect("an analysis").to_resolve;
    let before = judged_scheme(scheme).1;
    let mut out = complete(&remedies, &before);
    out.extend(remedies.remedies.iter().flat_map(|r| of_remedy(scheme, &before, r)));
    // an unknown that one more attitude resolves must not be called unresolved
    if let (Some(name), true) =
        (remedies.unresolved.first(), remedies.not_tried.is_empty() && scheme.unknowns.to_string() != "drift")
    {
        for attitude in cardinal_names() {
            let change = [Change::Attitude { position: "further".into(), attitude }];
            let after = judged_scheme(&changed_scheme(scheme, &change).0).1;
            if degree(&after, name).is_some() {
                out.push(format!("{name} is resolved by {change:?}"));
            }
        }
    }
    out
}

/// Random scheme of one to four positions.
pub(crate) fn random_scheme(rng: &mut SplitMix64) -> Scheme {
    fn pick<'a>(rng: &mut SplitMix64, list: &[&'a str]) -> &'a str {
        list[rng.below(list.len() as u64) as usize]
    }
    let terms = pick(
        rng,
        &["F,I,O,S", "F,I,O,S", "F", "F,I", "F,I,O,S,II,OO,SS", "F,I,O,S,GS", "F,I,O,S,K0,K1", "drift"],
    );
    let positions = if terms == "drift" { 1 } else { 1 + rng.below(4) };
    let carry = pick(rng, &["platform", "inertial", "reset"]);
    let latitude = pick(rng, &["", "", "latitude_deg = 48.2", "latitude_deg = 90", "latitude_deg = 0"]);
    let azimuth = if rng.below(6) == 0 { "measured_azimuth = true" } else { "" };
    let path = if terms.contains("GS") { "path = \"gimbals\"" } else { "" };
    let mut text = format!("carry = \"{carry}\"\nterms = \"{terms}\"\n{latitude}\n{azimuth}\n{path}\n");
    for i in 1..=positions {
        let names = cardinal_names();
        let angle = |rng: &mut SplitMix64| 15 * (rng.below(24) as i64 - 12);
        let attitude = match rng.below(3) {
            0 => format!("angles_deg = [{}, {}, {}]", angle(rng), angle(rng), angle(rng)),
            _ => format!("attitude = \"{}\"", names[rng.below(24) as usize]),
        };
        text.push_str(&format!("[[position]]\nname = \"p{i}\"\n{attitude}\n"));
    }
    scheme_file::read(&text).unwrap_or_else(|e| panic!("{e:?}\n{text}"))
}

fn random_schemes(count: usize) {
    let mut rng = SplitMix64::new(11);
    let mut tried = 0;
    for i in 0..count {
        let scheme = random_scheme(&mut rng);
        let remedies = judged_scheme(&scheme).0;
        tried += remedies.remedies.len();
        assert_eq!(of_scheme(&scheme), [] as [String; 0], "scheme {i}:\n{}", scheme_file::write(&scheme));
    }
    assert!(tried > count, "{tried} remedies of {count} schemes");
}

#[test]
fn remedies_of_random_schemes_are_true() {
    random_schemes(25);
}

#[test]
#[ignore = "at full length: .ci/run release"]
fn remedies_of_500_random_schemes_are_true() {
    random_schemes(500);
}

/// JSON of a model with the changes of a remedy.
pub(crate) fn changed_model(model: &Value, changes: &[Change]) -> String {
    let mut model = model.clone();
    let has = |model: &Value, key: &str, name: &str| {
        model[key].as_array().is_some_and(|list| list.iter().any(|x| x == name))
    };
    let take = |model: &mut Value, from: &str, name: &str| {
        if let Some(list) = model[from].as_array_mut() {
            list.retain(|x| x != name);
        }
    };
    let put = |model: &mut Value, to: &str, name: &str| match model[to].as_array_mut() {
        Some(list) => list.push(name.into()),
        None => model[to] = vec![name].into(),
    };
    for change in changes {
        match change {
            Change::Known { name } if has(&model, "states", name) => {
                put(&mut model, "known_initial_conditions", name)
            }
            Change::Known { name } if has(&model, "params", name) => {
                take(&mut model, "params", name);
                put(&mut model, "known_constants", name);
            }
            Change::Known { name } => {
                take(&mut model, "unknown_inputs", name);
                put(&mut model, "known_inputs", name);
                if model["unknown_input_max_derivative"] == 0 {
                    if !model["input_assumption"].is_object() {
                        model["input_assumption"] = serde_json::json!({});
                    }
                    model["input_assumption"][name] = "constant".into();
                }
            }
            Change::Output { state } => model["outputs"][format!("{state}_more")] = state.as_str().into(),
            Change::Attitude { .. } | Change::Carry { .. } => panic!("a model has no such change"),
        }
    }
    model.to_string()
}

pub(crate) fn judged_model(text: &str) -> Degrees {
    let model = json::read(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let judged = judge(&model, SEED, None).expect("a verdict");
    let names = judged.layout.unknowns.iter().enumerate().filter(|(c, _)| judged.shown(&model, *c));
    names.map(|(c, u)| (u.name.clone(), judged.verdict_on(c).degree)).collect()
}

/// Judges the remedies of every `step`th model and returns their number.
fn of_models(step: usize) -> usize {
    let mut tried = 0;
    for (name, value, text) in models().into_iter().step_by(step) {
        let options = SystemOptions { solutions: false, ..SystemOptions::default() };
        let remedies =
            analyze_system(&json::read(&text).expect("a model"), options).expect("an answer").to_resolve;
        let before = judged_model(&text);
        let mut found = complete(&remedies, &before);
        for remedy in &remedies.remedies {
            tried += 1;
            found.extend(wrong(remedy, &before, &judged_model(&changed_model(&value, &remedy.changes))));
        }
        assert_eq!(found, [] as [String; 0], "{name}");
    }
    tried
}

#[test]
fn remedies_of_models_are_true() {
    assert!(of_models(9) > 20);
}

#[test]
#[ignore = "at full length: .ci/run release"]
fn remedies_of_all_models_are_true() {
    assert!(of_models(1) > 300);
}

/// A search for symmetries that uses up its work leaves enough for the changes. All eight of this model are
/// tried, and a separate verdict confirms each remedy.
#[test]
fn a_search_for_symmetries_leaves_work_for_changes() {
    let (_, value, text) = models().into_iter().find(|m| m.0 == "seaijrc_covid").expect("a reference model");
    let model = json::read(&text).expect("a model");
    let options = SystemOptions { solutions: false, ..SystemOptions::default() };
    let answer = analyze_system(&model, options).expect("an answer");
    assert!(answer.note.expect("a note").contains("not all symmetries were sought"));
    let remedies = answer.to_resolve;
    assert_eq!((remedies.verdicts, &remedies.not_tried[..], remedies.remedies.len()), (8, &[][..], 8));
    let before = judged_model(&text);
    for remedy in &remedies.remedies {
        let found = wrong(remedy, &before, &judged_model(&changed_model(&value, &remedy.changes)));
        assert_eq!(found, [] as [String; 0]);
    }
}

pub(crate) fn p1_p2() -> Scheme {
    scheme_file::read("[[position]]\nattitude = \"NUE\"\n[[position]]\nattitude = \"NDW\"\n")
        .expect("a scheme")
}

/// Remedies of the paper's two positions by hand: D_FZ - wN psi_y has degree 1, so that each of the two
/// determines the other. Inertial carry makes D_FZ observable and D_SZ unobservable.
#[test]
fn remedies_of_two_positions() {
    let (remedies, _) = judged_scheme(&p1_p2());
    let by = |change: &Change| -> Vec<(&str, usize)> {
        let remedy = remedies.remedies.iter().find(|r| r.changes == [change.clone()]);
        remedy.map_or_else(Vec::new, |r| r.resolves.iter().map(|x| (x.name.as_str(), x.degree)).collect())
    };
    assert_eq!(by(&Change::Known { name: "psi_y".into() }), [("D_FZ", 1)]);
    assert_eq!(by(&Change::Known { name: "D_FZ".into() }), [("psi_y", 1)]);
    assert_eq!(by(&Change::Carry { carry: Carry::Inertial }), [("D_FZ", 1)]);
    assert!(remedies.unresolved.is_empty() && remedies.not_tried.is_empty());
    let inertial = remedies.remedies.iter().find(|r| matches!(r.changes[..], [Change::Carry { .. }]));
    assert_eq!(inertial.map(|r| r.loses.clone()), Some(vec!["D_SZ".to_string()]));
}

/// A state with a known start is no unknown, but as an output it tells more: the rate b of `z' = -b z`.
#[test]
fn states_with_known_starts_are_tried_as_outputs() {
    let text = "name='chain'\nparameters=['a','b']\n[states]\nz={equation='-b*z', initial='1'}\nv='-a*v'\n\
                [outputs]\ny='v'";
    let model = model_file::read(text).expect("a model");
    let found = analyze_system(&model, SystemOptions::default()).expect("judged").to_resolve;
    let output = Change::Output { state: "z".into() };
    let remedy = found.remedies.iter().find(|r| r.changes == [output.clone()]).expect("z as an output");
    assert_eq!((remedy.resolves[0].name.as_str(), remedy.resolves[0].degree), ("b", 1));
}

/// A wrong remedy is caught: another degree, another unknown, an attitude that the scheme already has,
/// another value.
#[test]
fn a_wrong_remedy_is_caught() {
    let scheme = p1_p2();
    let (remedies, before) = judged_scheme(&scheme);
    let mut mutated = 0;
    for right in &remedies.remedies {
        assert_eq!(of_remedy(&scheme, &before, right), [] as [String; 0]);
        let mut wrongs = Vec::new();
        let mut degree = right.clone();
        degree.resolves[0].degree += 1;
        wrongs.push(degree);
        let mut unknown = right.clone();
        unknown.resolves[0].name = "D_FX".into();
        wrongs.push(unknown);
        let mut loses = right.clone();
        loses.loses.push("D_FX".into());
        wrongs.push(loses);
        let mut change = right.clone();
        change.changes[0] = match &right.changes[0] {
            Change::Attitude { position, .. } => {
                Change::Attitude { position: position.clone(), attitude: "NUE".into() }
            }
            Change::Known { .. } => Change::Known { name: "D_IX".into() },
            _ => Change::Carry { carry: Carry::Reset },
        };
        wrongs.push(change);
        for wrong in wrongs {
            mutated += 1;
            assert!(!of_remedy(&scheme, &before, &wrong).is_empty(), "{wrong:?}");
        }
    }
    assert_eq!(mutated, 20);
}
