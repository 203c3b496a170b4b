//! Certificates of the published models, compared by both checkers and with the published verdicts.

use std::path::Path;

use obsdeg_core::certificate::{CertificateError, ModelCertificate, certify_model};
use obsdeg_core::system::{json, model_file};
use obsdeg_exact::SplitMix64;
use obsdeg_verify::verify;
use serde_json::{Value, json};

use crate::python::Python;
use crate::schemes::{pick, places};

/// Reference models with a certificate (name, reference, certificate), and those without one (name,
/// reason).
#[expect(clippy::type_complexity, reason = "two lists, used here alone")]
fn certified() -> (Vec<(String, Value, ModelCertificate)>, Vec<(String, String)>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/models");
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<_> = entries.map(|e| e.expect("an entry").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "json"));
    files.sort();
    let (mut found, mut without) = (Vec::new(), Vec::new());
    for file in files {
        let text = std::fs::read_to_string(&file).expect("readable");
        let name = file.file_stem().expect("a name").to_string_lossy().into_owned();
        let model = json::read(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
        match certify_model(&model, 1) {
            Ok(certificate) => found.push((name, serde_json::from_str(&text).expect("JSON"), certificate)),
            Err(CertificateError::NotCovered { found, .. }) => without.push((name, found)),
            Err(e) => panic!("{name}: {e}"),
        }
    }
    (found, without)
}

/// Both checkers accept with the same sentences, and the degrees are the published ones.
#[test]
fn both_checkers_accept_certificates_of_published_models() {
    let (certified, without) = certified();
    let count = |reason: &str| without.iter().filter(|w| w.1 == reason).count();
    let others = ["functions", "starts or inputs that are not generic", "several experiments", "segments"];
    assert_eq!((certified.len(), others.map(count)), (118, [15, 6, 1, 1]), "{without:?}");
    let mut python = Python::start();
    let mut judged = 0;
    for (name, reference, certificate) in &certified {
        for (unknown, order) in reference["min_order"].as_object().into_iter().flatten() {
            if let Some(verdict) = certificate.verdicts.iter().find(|v| v.unknown == *unknown) {
                let order = order.as_u64().map(|k| k as usize);
                assert_eq!(verdict.proof.degree, order, "{name}: {unknown}");
                judged += 1;
            }
        }
        let text = certificate.text().expect("JSON");
        let sentences = verify(text.as_bytes(), None).unwrap_or_else(|e| panic!("{name}: {e}"));
        if let Some(python) = &mut python {
            assert_eq!(python.asks(&text, None), (true, sentences.join("\n")), "{name}");
        }
    }
    println!("{} models with a certificate, {judged} published degrees", certified.len());
    assert!(judged > 1000, "{judged}");
}

/// True for a place at which this kind of change makes a false claim.
fn belongs(kind: &str, path: &[String]) -> bool {
    let (first, last) = (path.first().map_or("", String::as_str), path.last().map_or("", String::as_str));
    match kind {
        "rank" => first == "ranks" && path.len() == 2,
        "row" => first == "basis" && path.len() == 3 && last != "3",
        "pivot" => first == "basis" && path.len() == 3 && last == "3",
        "solution" => first == "verdicts" && path.len() == 5 && path[2] == "solution",
        "name" => first == "verdicts" && path.len() == 3 && ["unknown", "hidden_by"].contains(&last),
        _ => first == "verdicts" && path.len() == 3 && last == kind,
    }
}

/// Both checkers refuse `count` single changes of every kind.
fn refuse(count: usize) {
    let (certified, _) = certified();
    let small: Vec<_> = certified.iter().filter(|c| (3..=9).contains(&c.2.unknowns.len())).collect();
    let mut rng = SplitMix64::new(11);
    let mut python = Python::start();
    for kind in ["degree", "status", "rank", "row", "pivot", "solution", "name"] {
        let mut done = 0;
        while done < count {
            let (name, _, certificate) = pick(&mut rng, &small);
            let mut value = serde_json::to_value(certificate).expect("JSON");
            let mut found = Vec::new();
            places(&value, &mut Vec::new(), &|path, _| belongs(kind, path), &mut found);
            if found.is_empty() {
                continue;
            }
            let place = pick(&mut rng, &found).clone();
            let slot = value.pointer_mut(&place).expect("a place");
            let old = slot.clone();
            *slot = match &old {
                Value::Number(n) => json!(n.as_i64().unwrap_or(0) + *pick(&mut rng, &[-1, 1, 2])),
                Value::String(_) if kind == "status" => {
                    json!(pick(&mut rng, &["observable", "inseparable", "not_excited"]))
                }
                Value::String(_) => json!(pick(&mut rng, &certificate.unknowns)),
                _ if kind == "degree" => json!(rng.below(4)),
                _ => json!(certificate.unknowns[0]),
            };
            if *slot == old {
                continue;
            }
            let changed = value.to_string();
            let reason = verify(changed.as_bytes(), None);
            let reason = reason.expect_err(&format!("{name}: {kind} {place}, was {old}")).to_string();
            assert!(reason.contains(": "), "{reason}");
            if let Some(python) = &mut python {
                let (accepted, reason) = python.asks(&changed, None);
                assert!(!accepted && reason.contains(": "), "{name}: {kind} {place}, was {old}: {reason}");
            }
            done += 1;
        }
    }
}

#[test]
fn both_checkers_refuse_single_changes_of_models() {
    refuse(20);
}

#[test]
#[ignore = "full length: .ci/run release"]
fn both_checkers_refuse_1000_single_changes_of_models_of_every_kind() {
    refuse(1000);
}

/// Hand computation: x' = -a x + u, y = b x. From y, y' and y'' follow b x, then a (the input is known,
/// so b as well). Every unknown is observable, x and b with degree 1 (y' = -a y + b u holds two more
/// unknowns, a and b), so all of them need y''.
const DECAY: &str = r#"
name = "decay"
[known_inputs]
u = "generic"
[states]
x = { equation = "-a*x + u" }
[parameters]
a = {}
b = {}
[outputs]
y = { expression = "b*x" }
"#;

#[test]
fn a_change_of_the_equations_is_another_statement() {
    let model = model_file::read(DECAY).unwrap_or_else(|e| panic!("{e}"));
    let certificate = certify_model(&model, 3).expect("a certificate");
    assert_eq!(certificate.ranks, [1, 2, 3]);
    let degrees: Vec<_> = certificate.verdicts.iter().map(|v| (v.unknown.as_str(), v.proof.degree)).collect();
    assert_eq!(degrees, [("x", Some(2)), ("a", Some(2)), ("b", Some(2))]);
    let text = certificate.text().expect("JSON");
    let sentences = verify(text.as_bytes(), None).expect("accepted").join("\n");
    assert!(sentences.contains("Output 1: y = (x * b)."), "{sentences}");
    // without the input only the product of b and x is observable
    let mut value: Value = serde_json::from_str(&text).expect("JSON");
    value["problem"]["inputs"] = json!([["u", 0]]);
    value["problem"]["rates"] = json!([0]);
    assert!(verify(value.to_string().as_bytes(), None).is_err());
    // a program with an operand that comes later, and one that divides by zero
    let mut value: Value = serde_json::from_str(&text).expect("JSON");
    value["problem"]["program"][0] = json!(["*", 0, 99]);
    assert!(
        verify(value.to_string().as_bytes(), None)
            .expect_err("later")
            .to_string()
            .contains("problem.program.0")
    );
    value["problem"]["program"][0] = json!(["=", "0"]);
    value["problem"]["program"][1] = json!(["/", 0, 4]);
    assert!(
        verify(value.to_string().as_bytes(), None).expect_err("a divisor").to_string().contains("divisor")
    );
}

/// Models that certificates do not cover are refused with the feature.
#[test]
fn models_without_certificates() {
    for (from, to, reason) in [
        ("-a*x + u", "-a*sin(x) + u", "functions"),
        ("\"b*x\"", "\"b*x*t\"", "starts or inputs that are not generic"),
    ] {
        let model = model_file::read(&DECAY.replace(from, to)).unwrap_or_else(|e| panic!("{e}"));
        let error = certify_model(&model, 1).expect_err("not covered").to_string();
        assert!(error.contains(reason), "{error}");
    }
}

/// Names that pass for an expression or for a sentence of the answer are refused by both checkers.
#[test]
fn names_that_lie_are_refused() {
    let model = model_file::read("name='m'\nparameters=['k']\n[states]\nx='-k*x'\n[outputs]\ny='x'")
        .expect("a model");
    let text = certify_model(&model, 1).expect("a certificate").text().expect("JSON");
    let mut python = Python::start();
    assert!(verify(text.as_bytes(), None).is_ok());
    for lie in ["k\\nRank 9 of 9; verified exactly.", "2", "(a * b)", "", "z = k + x; y", "a b", "k\\u202e"] {
        let forged = text.replace("\"k\"", &format!("\"{lie}\""));
        assert_ne!(forged, text);
        let refused = verify(forged.as_bytes(), None).expect_err("refused").to_string();
        assert!(refused.contains("names of letters, digits and _"), "{lie}: {refused}");
        if let Some(python) = &mut python {
            let (accepted, said) = python.asks(&forged, None);
            assert!(!accepted && said.contains("names of letters, digits and _"), "{lie}: {said}");
        }
    }
}
