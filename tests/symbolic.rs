//! The symbolic worker as the program runs it: real process, real lock.
#![cfg(feature = "symbolica")]

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use obsdeg_symbolic::protocol::CheckTerm;
use obsdeg_symbolic::{
    Dynamics, Job, Order, Request, SubstitutionCheck, System, Waiting, Worker, WorkerConfig, WorkerError,
};

#[path = "../crates/cli/lock.rs"]
mod lock;

fn worker_of(limit: u64) -> Worker {
    Worker::new(WorkerConfig {
        program: env!("CARGO_BIN_EXE_obsdeg").into(),
        arguments: vec!["symbolic-worker".into()],
        limit,
        wait: std::time::Duration::from_secs(600),
        waiting: Waiting::silent(),
    })
}

fn worker() -> Worker {
    worker_of(1000)
}

fn strings<const N: usize>(texts: [&str; N]) -> Vec<String> {
    texts.map(String::from).to_vec()
}

fn request(job: Job) -> Request {
    Request {
        symbols: strings(["wN", "x"]),
        generators: vec![("r_2".into(), "2".into())],
        angles: strings(["a"]),
        job,
    }
}

fn solve(matrix: Vec<Vec<String>>, right: Vec<String>) -> Request {
    request(Job::Solve { system: System { matrix, right, outputs: vec![] }, check: None })
}

#[test]
fn systems_with_roots_and_angles() {
    let mut w = worker();
    // (r_2 x = 1), (c x + s y = 0)
    let matrix = vec![strings(["r_2", "0"]), strings(["c_a", "s_a"])];
    let (values, verified) = w.ask(&solve(matrix, strings(["1", "0"]))).expect("solved");
    assert_eq!((values, verified), (strings(["1/2*r_2", "-1/2*c_a*r_2/s_a"]), false));
    // 1/c is kept, and cos^2 + sin^2 = 1 is known: c x = 1, overdetermined but consistent
    let matrix = vec![strings(["c_a"]), strings(["c_a^2+s_a^2"])];
    let (values, _) = w.ask(&solve(matrix, strings(["1", "1/c_a"]))).expect("solved");
    assert_eq!(values, strings(["1/c_a"]));
    // a system without a unique solution is reported, and the worker continues
    for (right, reason) in [(["1", "1"], "inconsistent"), (["1", "2"], "underdetermined")] {
        let matrix = vec![strings(["1", "1"]), strings(["2", "2"])];
        let e = w.ask(&solve(matrix, strings(right))).expect_err("no solution");
        assert!(matches!(&e, WorkerError::Failed { reason: r } if r.contains(reason)), "{e}");
    }
    let e = w.ask(&solve(vec![strings(["sin(q)"])], strings(["1"]))).expect_err("unknown symbol");
    assert!(matches!(e, WorkerError::Failed { .. }), "{e}");
}

fn oscillator() -> Dynamics {
    Dynamics { states: strings(["p", "v"]), equations: strings(["v", "-wN^2*p"]), outputs: strings(["p"]) }
}

#[test]
fn derivatives_along_the_dynamics() {
    let (values, _) =
        worker().ask(&request(Job::Derive { dynamics: oscillator(), order: 3 })).expect("derived");
    assert_eq!(values, strings(["p", "v", "-wN^2*p", "-wN^2*v"]));
}

#[test]
fn a_false_solution_fails_its_verification() {
    let mut w = worker();
    // v = z'; the claim is y z' = v with y = 1 (right) or 2 (wrong)
    let claim = |right: &str| {
        let check = SubstitutionCheck {
            dynamics: oscillator(),
            unknowns: strings(["u_0", "u_1"]),
            segments: vec![strings(["u_0", "u_1"])],
            terms: vec![vec![CheckTerm { factor: "1".into(), segment: 0, output: 0, order: 1 }]],
            target: vec![("0".into(), "1".into()), ("1".into(), "1".into())],
        };
        let system = System { matrix: vec![strings(["1"])], right: strings([right]), outputs: vec![] };
        request(Job::Solve { system, check: Some(check) })
    };
    assert_eq!(w.ask(&claim("1")), Ok((strings(["1"]), true)));
    let e = w.ask(&claim("2")).expect_err("not verified");
    assert!(e.to_string().contains("failed its verification"), "{e}");
}

#[test]
fn factors_of_a_minor() {
    let matrix = vec![strings(["x", "1"]), strings(["1", "x"])];
    let r = Request { generators: vec![], ..request(Job::MinorFactors { matrix }) };
    let (factors, _) = worker().ask(&r).expect("factored");
    assert_eq!(factors, strings(["-1+x", "1+x"]));
}

/// Request with `(1 + x)^40000` in an equation: hours of products.
fn endless() -> Request {
    solve(vec![strings(["(1+x+wN)^40000"])], strings(["1"]))
}

/// Request with growing derivatives, whose work counts no products.
fn uncounted() -> Request {
    let equations = strings(["(1+p+v)^9", "(1+p*v)^9"]);
    let dynamics = Dynamics { states: strings(["p", "v"]), equations, outputs: strings(["p"]) };
    request(Job::Derive { dynamics, order: 1000 })
}

/// Counted work ends at the work limit, other work at a limit of processor time. The next question is
/// answered.
#[test]
fn work_ends_at_its_limit() {
    let mut w = worker_of(1);
    for job in [endless(), uncounted()] {
        assert_eq!(w.ask(&job), Err(WorkerError::OverLimit { limit: 1 }));
        assert_eq!(w.ask(&solve(vec![strings(["2"])], strings(["1"]))), Ok((strings(["1/2"]), false)));
    }
    // every limit can be represented (one process at a time)
    w.rest();
    let mut w = worker_of(u64::MAX);
    assert_eq!(w.ask(&solve(vec![strings(["2"])], strings(["1"]))), Ok((strings(["1/2"]), false)));
}

/// The parent process may be killed at any time: its pipe closes, and the worker exits in the middle of its
/// work.
#[test]
fn a_worker_ends_with_whoever_started_it() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_obsdeg"))
        .arg("symbolic-worker")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut input = child.stdin.take().expect("a pipe");
    let order = Order { limit: u64::MAX, request: endless() };
    writeln!(input, "{}", serde_json::to_string(&order).expect("JSON")).expect("written");
    drop(input);
    assert!(child.wait().expect("it ends").success());
}

/// Holds the lock as another process does.
fn hold(path: &Path) -> File {
    let file = obsdeg_symbolic::lock::open(path).expect("a lock file");
    obsdeg_symbolic::lock::wait(&file, || Ok(())).expect("the lock");
    file
}

/// Starts a command that needs formulas, and reads the first line of its stderr.
fn waiting(command: &mut Command) -> (Child, BufReader<std::process::ChildStderr>, String) {
    command.args(["analyze", "--angles", "25,0,0", "--angles", "NUE", "--format", "json"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut errors = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut line = String::new();
    errors.read_line(&mut line).expect("text");
    (child, errors, line)
}

/// While another process has the engine, all others wait and say so; then all get formulas.
#[test]
fn everybody_waits_for_a_turn() {
    let held = hold(&lock::symbolic_lock_file());
    let started: Vec<_> = (0..3).map(|_| waiting(&mut Command::new(env!("CARGO_BIN_EXE_obsdeg")))).collect();
    drop(held);
    for (child, mut errors, line) in started {
        assert!(line.contains("waiting for another obsdeg process"), "{line}");
        errors.read_to_string(&mut String::new()).expect("text");
        let output = child.wait_with_output().expect("it ends");
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let list = answer["quantities"].as_array().expect("a list");
        let by_engine = |q: &serde_json::Value| q["solution"]["found_by"] == "symbolic_engine";
        assert!(list.iter().any(by_engine) && answer["engine_busy"].is_null(), "{answer}");
    }
}

/// While another process holds the engine, verdicts are given nevertheless, and missing parts are named, with
/// --quiet too.
#[test]
fn a_held_engine_keeps_no_verdict_waiting() {
    let folder = tempfile::tempdir().expect("a folder");
    let _held = hold(&folder.path().join("obsdeg-symbolic.lock"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_obsdeg"));
    command.args([
        "analyze",
        "--angles",
        "25,0,0",
        "--angles",
        "NUE",
        "--format",
        "json",
        "-q",
        "--engine-wait",
        "0",
    ]);
    let output = command.env("XDG_RUNTIME_DIR", folder.path()).output().expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && stderr.contains("--engine-wait"), "{stderr}");
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let list = answer["quantities"].as_array().expect("a list");
    assert!(list.iter().any(|q| q["status"] == "observable" && q["degree"].is_u64()), "{answer}");
    assert!(answer["notes"].to_string().contains("held the symbolic engine for more than 0 s"), "{answer}");
    let mark = &answer["engine_busy"];
    assert!(mark["waited_s"] == 0 && mark["advice"].to_string().contains("--engine-wait"), "{mark}");
}

/// While another process holds the engine, the note lists exactly the parts that the answer with the engine
/// has in addition. With a limit of 0 there is no wait, and the same parts are missing.
#[test]
fn what_is_missing_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let answer = |angles: &str, more: &[&str]| -> serde_json::Value {
        let mut command = Command::new(env!("CARGO_BIN_EXE_obsdeg"));
        command.args(["analyze", "--angles", angles, "--angles", "NUE", "--format", "json", "-q"]);
        let output = command.args(more).env("XDG_RUNTIME_DIR", folder.path()).output().expect("it runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let note = |answer: &serde_json::Value| -> Option<(String, String)> {
        let list = answer["notes"].as_array().expect("notes");
        let own = list.iter().filter_map(|n| n.as_str()).find_map(|n| n.split_once(", therefore: "));
        own.map(|(why, missing)| (why.into(), missing.into()))
    };
    let list = |a: &serde_json::Value, key: &str| a[key].as_array().expect("a list").clone();
    let mut kinds = std::collections::BTreeSet::new();
    for angles in ["alpha,0,0", "25,35,10", "alpha,35,10"] {
        let held = hold(&folder.path().join("obsdeg-symbolic.lock"));
        let began = std::time::Instant::now();
        let none = answer(angles, &["--symbolic-limit", "0", "--engine-wait", "300"]);
        assert!(began.elapsed().as_secs() < 200, "a held lock is waited for at a limit of 0");
        let busy = answer(angles, &["--engine-wait", "0"]);
        drop(held);
        let whole = answer(angles, &["--engine-wait", "300", "--symbolic-limit", "20"]);
        assert_eq!(note(&whole), None);
        let (why, missing) = note(&busy).expect("a note");
        assert!(why.contains("held the symbolic engine for more than 0 s"), "{why}");
        let (why, same) = note(&none).expect("a note");
        assert!(why.contains("switched off by a limit of 0") && same == missing, "{why}: {same}");
        assert!(none["engine_busy"].is_null() && busy["engine_busy"]["waited_s"] == 0);
        let judged = |key: &str, name: &str| -> Vec<(String, serde_json::Value)> {
            let all = list(&busy, key).into_iter().filter(|q| q["degree"].is_u64());
            all.map(|q| (q[name].as_str().expect("a name").to_string(), q["solution"].clone())).collect()
        };
        let judged = [judged("quantities", "name"), judged("combinations", "expression")].concat();
        let names = |of: &dyn Fn(&serde_json::Value) -> bool| -> String {
            let all: Vec<&str> =
                judged.iter().filter(|(_, s)| of(s)).map(|(name, _)| name.as_str()).collect();
            all.join(", ")
        };
        let unsolved = names(&|s| s.is_null());
        let decimal = names(&|s| s["found_by"] == "floating_point");
        let expressions = |a: &serde_json::Value| -> Vec<serde_json::Value> {
            list(a, "combinations").iter().map(|c| c["expression"].clone()).collect()
        };
        let open = |a: &serde_json::Value| {
            let unnamed = |v: &serde_json::Value| v.as_array().expect("a vector")[0]["coefficient"].is_null();
            list(a, "null_space").iter().filter(|v| unnamed(v)).count()
        };
        // a complete list has one combination for each rank that no unknown takes, without local unknowns
        let local = expressions(&busy).iter().any(|e| e.as_str().is_some_and(|e| e.contains("^n")));
        let fewer = judged.len() < busy["rank"].as_u64().expect("a rank") as usize;
        assert!(local || fewer || expressions(&busy) == expressions(&whole), "{angles}");
        let clauses = [
            (format!("no solutions of {unsolved}"), !unsolved.is_empty()),
            (format!("solutions in decimals of {decimal}"), !decimal.is_empty()),
            ("left out of the list".into(), local || fewer),
            (format!("{} unobservable directions without coefficients", open(&busy)), open(&busy) > 0),
            ("degenerate angles".into(), busy["degenerate_loci"] != whole["degenerate_loci"]),
        ];
        for (kind, (clause, holds)) in clauses.into_iter().enumerate() {
            assert_eq!(missing.contains(&clause), holds, "{angles}: {clause}: {missing}");
            kinds.extend(holds.then_some(kind));
        }
        // the answer says so beside the list
        let says = |a: &serde_json::Value| a["degenerate_loci_incomplete"].is_string();
        assert!(!says(&whole) && says(&busy) == missing.contains("degenerate angles"), "{angles}: {missing}");
        assert!(open(&whole) == 0 && !missing.contains("formulas of Z"), "{missing}");
    }
    assert_eq!(kinds.len(), 5, "{kinds:?}");
}

/// With named angles the verdicts are printed while the command waits for the engine, in the words of an
/// answer without solutions.
#[test]
fn verdicts_are_said_before_the_engine_is_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let held = hold(&folder.path().join("obsdeg-symbolic.lock"));
    let scheme = ["analyze", "--angles", "alpha,0,0", "--angles", "NUE", "--engine-wait", "3000"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_obsdeg"));
    command.args(scheme).env("XDG_RUNTIME_DIR", folder.path());
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut errors = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut said = String::new();
    while !said.contains("degrees: ") {
        assert!(errors.read_line(&mut said).expect("text") > 0, "{said}");
    }
    assert!(child.try_wait().expect("a process").is_none(), "it has not answered");
    drop(held);
    errors.read_to_string(&mut String::new()).expect("text");
    let output = child.wait_with_output().expect("it ends");
    let first =
        String::from_utf8_lossy(&output.stdout).lines().nth(1).expect("a sentence").trim().to_string();
    assert!(said.contains(&first), "{said}: {first}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_obsdeg"));
    let output =
        command.args(scheme).args(["--solutions", "off", "--format", "json"]).output().expect("it runs");
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let line = said.lines().find_map(|l| l.trim().strip_prefix("degrees: ")).expect("degrees");
    let degrees: Vec<&str> = line.split(", ").collect();
    for (q, said) in answer["quantities"].as_array().expect("a list").iter().zip(&degrees) {
        let degree = q["degree"].as_u64().map_or_else(|| "not observable".into(), |k| k.to_string());
        assert_eq!(*said, format!("{} {degree}", q["name"].as_str().expect("a name")));
    }
}

/// Models do not need the engine: with expressions, for every ninth reference model (every third with
/// `AT_LENGTH=1`), nothing is missing while another process holds it.
#[test]
fn no_model_starts_the_engine() {
    let folder = tempfile::tempdir().expect("a folder");
    let _held = hold(&folder.path().join("obsdeg-symbolic.lock"));
    let models = format!("{}/tests/data/models", env!("CARGO_MANIFEST_DIR"));
    let mut files: Vec<_> =
        std::fs::read_dir(models).expect("models").map(|f| f.expect("a file").path()).collect();
    files.retain(|f| f.extension() == Some("json".as_ref()));
    files.sort();
    let step = if std::env::var_os("AT_LENGTH").is_some() { 3 } else { 9 };
    let mut command = Command::new(env!("CARGO_BIN_EXE_obsdeg"));
    command.args(["analyze", "--format", "json", "-q", "--engine-wait", "0"]);
    command.args(files.iter().step_by(step)).env("XDG_RUNTIME_DIR", folder.path());
    let output = command.output().expect("it runs");
    assert!(
        output.status.success() && output.stderr.is_empty(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.matches("\"one_by_expression\"").count() > 180 / step && !text.contains("symbolic engine"));
}

#[test]
fn an_interrupt_is_heard_while_waiting() {
    let folder = tempfile::tempdir().expect("a folder");
    let _held = hold(&folder.path().join("obsdeg-symbolic.lock"));
    let (child, _errors, line) =
        waiting(Command::new(env!("CARGO_BIN_EXE_obsdeg")).env("XDG_RUNTIME_DIR", folder.path()));
    assert!(line.contains("waiting"), "{line}");
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), output.stdout.as_slice()), (Some(130), &[][..]));
}
