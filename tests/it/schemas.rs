//! What the program reads and writes, held against the JSON Schemas that it prints.

use std::collections::BTreeMap;

use jsonschema::Validator;
use serde_json::Value;

use crate::program::{json, run, stdout};

/// The schemas by the names that answers give themselves.
fn validators() -> BTreeMap<String, Validator> {
    let kinds = [
        "analysis",
        "audit",
        "calibration",
        "comparison",
        "crosscheck",
        "design",
        "model",
        "part",
        "scheme",
        "simulation",
        "system",
        "system-calibration",
        "system-evidence",
        "system-run",
        "walks",
    ];
    let of = |kind: &str| {
        let schema = json(&["schema", kind]);
        let version = if ["comparison", "design", "simulation"].contains(&kind) { 2 } else { 1 };
        assert_eq!(schema["$id"], format!("urn:obsdeg:{kind}:{version}"));
        (format!("obsdeg.{kind}/{version}"), jsonschema::validator_for(&schema).expect("a schema"))
    };
    kinds.map(of).into()
}

fn check(validators: &BTreeMap<String, Validator>, name: &str, value: &Value, what: &str) {
    let errors: Vec<String> =
        validators[name].iter_errors(value).map(|e| format!("{}: {e}", e.instance_path())).collect();
    assert!(errors.is_empty(), "{what}, {name}: {errors:?}");
}

fn examples(ending: &str) -> Vec<String> {
    let mut found = Vec::new();
    for folder in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/examples")).expect("a folder") {
        let folder = folder.expect("an entry").path();
        let name = folder.file_name().expect("a name").to_string_lossy().into_owned();
        if !folder.is_dir() || name.starts_with("wrong-") {
            continue;
        }
        for file in std::fs::read_dir(&folder).expect("a folder") {
            let file = file.expect("an entry").file_name().to_string_lossy().into_owned();
            if file.ends_with(".toml") && (file == "scheme.toml") == (ending == "scheme") {
                found.push(format!("examples/{name}/{file}"));
            }
        }
    }
    found.sort();
    assert!(found.len() > 10);
    found
}

#[test]
fn files_and_answers_are_as_their_schemas_say() {
    let validators = validators();
    let mut seen = BTreeMap::<String, usize>::new();
    let mut answer = |value: &Value, what: &str| {
        let name = value["schema"].as_str().expect("a schema").to_string();
        check(&validators, &name, value, what);
        *seen.entry(name).or_default() += 1;
    };
    for (kind, files) in [("scheme", examples("scheme")), ("model", examples("model"))] {
        for file in &files {
            let text =
                std::fs::read_to_string(format!("{}/{file}", env!("CARGO_MANIFEST_DIR"))).expect("text");
            let value: toml::Value = toml::from_str(&text).expect("TOML");
            let value = serde_json::to_value(value).expect("JSON");
            check(&validators, &format!("obsdeg.{kind}/1"), &value, file);
            answer(&json(&["analyze", file, "--solutions", "off", "--format", "json"]), file);
            // without numbers there is no run
            let run = run(&["simulate", file, "--format", "json"]);
            if run.status.success() {
                answer(&serde_json::from_str(&stdout(&run)).expect("JSON"), file);
            }
        }
    }
    let (five, six) = ("examples/five-positions/scheme.toml", "examples/six-positions/scheme.toml");
    let folder = tempfile::tempdir().expect("a folder");
    let part = folder.path().join("part.json").display().to_string();
    run(&["design", "--positions", "5", "--carry", "inertial", "--part", "1/40", "-o", &part]);
    answer(&serde_json::from_str(&std::fs::read_to_string(&part).expect("written")).expect("JSON"), "a part");
    for line in [
        &["analyze", "--angles", "0,0,0", "--angles", "180,0,0", "--formulas"][..],
        &["analyze", "--angles", "NUE@X_p:360", "--angles", "alpha,0,0", "--latitude", "90"],
        &["paper"],
        &["compare", five, six],
        &["crosscheck", "--angles", "0,0,0", "--angles", "180,0,0", "--runs", "20"],
        &["crosscheck", "examples/lotka-volterra/model.toml"],
        &["calibrate", "examples/bench-day/scheme.toml", "examples/bench-day/record.csv"],
        &["calibrate", "examples/hudson-bay/model.toml", "examples/hudson-bay/data.csv", "--starts", "2"],
        &["design", "--positions", "4", "--observable", "D_F", "--carry", "inertial"],
        &["design", "--positions", "6", "--carry", "reset"],
        &["design", "--minimum"],
        &["design", "--minimum", "--terms", "gyros", "--carry", "inertial"],
    ] {
        answer(&json(&[line, &["--format", "json"]].concat()), &line.join(" "));
    }
    // every schema of an answer was used
    let unused: Vec<&String> = validators
        .keys()
        .filter(|k| !seen.contains_key(*k) && !["obsdeg.scheme/1", "obsdeg.model/1"].contains(&k.as_str()))
        .collect();
    assert!(unused.is_empty(), "{unused:?}");
    // and they refuse: a field that is missing, one of another type
    let mut wrong = json(&["analyze", five, "--solutions", "off", "--format", "json"]);
    wrong["rank"] = "eight".into();
    assert!(!validators["obsdeg.analysis/1"].is_valid(&wrong));
    wrong.as_object_mut().expect("an object").remove("rank");
    assert!(!validators["obsdeg.analysis/1"].is_valid(&wrong));
}
