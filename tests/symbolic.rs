//! The symbolic worker as the program runs it: real process, real lock.
#![cfg(feature = "symbolica")]

use std::time::Duration;

use obsdeg_symbolic::protocol::CheckTerm;
use obsdeg_symbolic::{Check, Dynamics, Job, Request, System, Worker, WorkerConfig, WorkerError};

#[allow(dead_code, reason = "shared with the command line")]
#[path = "../crates/cli/lock.rs"]
mod lock;

fn worker() -> Worker {
    Worker::new(WorkerConfig {
        program: env!("CARGO_BIN_EXE_obsdeg").into(),
        arguments: vec!["symbolic-worker".into()],
        lock_file: lock::symbolic_lock_file(),
        lock_limit: Duration::from_secs(60),
        time_limit: Duration::from_secs(60),
    })
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
    // 1/c is kept as such, and cos^2 + sin^2 = 1 is known: c x = 1, overdetermined but consistent
    let matrix = vec![strings(["c_a"]), strings(["c_a^2+s_a^2"])];
    let (values, _) = w.ask(&solve(matrix, strings(["1", "1/c_a"]))).expect("solved");
    assert_eq!(values, strings(["1/c_a"]));
    // what has no unique solution says so, and the worker lives on
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
        let check = Check {
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
