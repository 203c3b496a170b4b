//! Requests in JSON return what the command line prints, byte for byte.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use obsdeg_commands::{Host, call};
use serde_json::{Value, json};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Scheme and model files of all examples, by their paths in the repository.
fn examples() -> Vec<String> {
    let mut out = Vec::new();
    for folder in fs::read_dir(root().join("examples")).expect("examples") {
        let folder = folder.expect("an entry").path();
        let files: Vec<PathBuf> = match folder.is_dir() {
            true => fs::read_dir(&folder).expect("a folder").map(|f| f.expect("an entry").path()).collect(),
            false => continue,
        };
        let judged = files.into_iter().filter(|f| f.extension().is_some_and(|e| e == "toml"));
        out.extend(judged.map(|f| f.strip_prefix(root()).expect("below").display().to_string()));
    }
    out.sort();
    assert!(out.len() > 30, "{out:?}");
    out
}

fn source(file: &str) -> Value {
    json!({ "name": file, "text": fs::read_to_string(root().join(file)).expect("readable") })
}

/// Stdout and stderr of the command line, and true if it succeeds.
fn printed(arguments: &[&str]) -> (String, String, bool) {
    let done = Command::new(env!("CARGO_BIN_EXE_obsdeg"))
        .args(arguments)
        .args(["--format", "json"])
        .current_dir(root())
        .output()
        .expect("it runs");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (text(done.stdout), text(done.stderr), done.status.success())
}

fn same(command: &str, request: &Value, arguments: &[&str]) {
    let (text, said, passed) = printed(arguments);
    match call(command, &request.to_string(), &mut Host::silent()) {
        Ok(answer) => {
            assert!(answer.text().expect("text") == text, "{arguments:?}: other bytes than {said}{text}");
            assert_eq!(answer.passed, passed, "{arguments:?}");
        }
        Err(problem) => {
            assert_eq!(text, "", "{arguments:?}: {problem}");
            let message = problem.message.lines().next().unwrap_or_default();
            // option names are --in-kebab-case on the command line and in_snake_case in JSON
            let plain = |text: &str| text.replace("--", "").replace('-', "_");
            assert!(plain(&said).contains(&plain(message)), "{arguments:?}: `{message}` is not in {said}");
        }
    }
}

#[test]
#[ignore = "seconds: .ci/run release"]
fn every_example_is_judged_the_same() {
    for file in examples() {
        let request = json!({ "sources": [source(&file)], "solutions": false });
        same("analyze", &request, &["analyze", &file, "--solutions", "off"]);
    }
}

#[test]
#[ignore = "seconds: .ci/run"]
fn every_example_runs_the_same() {
    // a run of the other examples takes seconds each
    for file in examples().iter().filter(|f| !f.contains("slam") && !f.contains("self-calibration")) {
        same(
            "simulate",
            &json!({ "sources": [source(file)], "seed": 3 }),
            &["simulate", file, "--seed", "3"],
        );
    }
}

#[test]
fn options_are_the_same() {
    let angles = json!(["0,0,0", "180,0,0"]);
    let shell = ["--angles", "0,0,0", "--angles", "180,0,0"];
    let ask = |command: &str, more: Value, arguments: &[&str]| {
        let mut request = json!({ "angles": angles });
        for (name, value) in more.as_object().expect("options") {
            request[name] = value.clone();
        }
        same(command, &request, &[&[command], &shell[..], arguments].concat());
    };
    ask(
        "analyze",
        json!({ "carry": "inertial", "latitude": 28.2, "terms": "F,I", "solutions": false, "frame": "platform" }),
        &[
            "--carry",
            "inertial",
            "--latitude",
            "28.2",
            "--terms",
            "F,I",
            "--solutions",
            "off",
            "--frame",
            "platform",
        ],
    );
    ask("analyze", json!({ "combination": ["D_QQ"] }), &["--combination", "D_QQ"]);
    ask(
        "analyze",
        json!({ "solutions": false, "measured_azimuth": true }),
        &["--solutions", "off", "--measured-azimuth"],
    );
    let run = json!({
        "requirement": { "D": 0.05 }, "prior": ["D_F=30"], "step": 20, "rate_random_walk": "0.001,0.002,0.003",
        "drift_noise": "0.001 deg/sqrt(h)"
    });
    ask(
        "simulate",
        run,
        &[
            "--requirement",
            "D=0.05",
            "--prior",
            "D_F=30",
            "--step",
            "20",
            "--rate-random-walk",
            "0.001,0.002,0.003",
            "--drift-noise",
            "0.001 deg/sqrt(h)",
        ],
    );
    ask(
        "crosscheck",
        json!({ "runs": 20, "filter_carry": "inertial" }),
        &["--runs", "20", "--filter-carry", "inertial"],
    );
    ask("crosscheck", json!({ "filter_drop": "p9" }), &["--filter-drop", "p9"]);
    same(
        "design",
        &json!({
            "positions": 4, "carry": "inertial", "max_degree": ["D_F=1"], "immune": { "K0": 500 }, "keep": 3,
            "restarts": 5
        }),
        &[
            "design",
            "--positions",
            "4",
            "--carry",
            "inertial",
            "--max-degree",
            "D_F=1",
            "--immune",
            "K0=500",
            "--keep",
            "3",
            "--restarts",
            "5",
        ],
    );
    same("design", &json!({ "minimum": true }), &["design", "--minimum"]);
    let file = "examples/cardinal-24/scheme.toml";
    same(
        "design",
        &json!({ "positions": 3, "candidates_file": source(file), "observable": ["D_F"] }),
        &["design", "--positions", "3", "--candidates", file, "--observable", "D_F"],
    );
    same("paper", &json!({ "seed": 7 }), &["paper", "--seed", "7"]);
    let [a, b] = ["examples/five-positions/scheme.toml", "examples/six-positions/scheme.toml"];
    same(
        "compare",
        &json!({ "sources": [source(a), source(b)], "dwell": 500 }),
        &["compare", a, b, "--dwell", "500"],
    );
    same(
        "analyze",
        &json!({ "sources": [source(a), source("examples/sir/model.toml")], "solutions": false }),
        &["analyze", a, "examples/sir/model.toml", "--solutions", "off"],
    );
    let [model, data] = ["examples/influenza/model.toml", "examples/influenza/data.csv"];
    same(
        "calibrate",
        &json!({ "sources": [source(model)], "records": [source(data)], "profile": ["beta"] }),
        &["calibrate", model, data, "--profile", "beta"],
    );
}

#[test]
fn a_review_is_the_same_page() {
    let file = "examples/paper-p1-p2/scheme.toml";
    let page = tempfile::tempdir().expect("a folder");
    let page = page.path().join("review.html");
    let shown = page.display().to_string();
    let arguments = ["report", file, "--runs", "10", "--symbolic-limit", "0", "-o", &shown];
    let done = Command::new(env!("CARGO_BIN_EXE_obsdeg")).args(arguments).current_dir(root()).output();
    assert!(done.expect("it runs").status.success());
    let command = "obsdeg report examples/paper-p1-p2/scheme.toml --runs 10 --symbolic-limit 0";
    let request = json!({ "sources": [source(file)], "runs": 10, "command": command });
    let answer = call("report", &request.to_string(), &mut Host::silent()).expect("a page");
    assert!(answer.text().expect("text") == fs::read_to_string(&page).expect("the page"));
}
