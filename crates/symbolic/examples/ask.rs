//! One request to the worker: cos(a) x = 1, sqrt(2) y = cos(a). The first argument is the program that
//! contains the engine (default `obsdeg`; for example `target/debug/obsdeg`). If the worker is not
//! available, the example prints the reason.
#![allow(clippy::print_stdout, reason = "an example")]

use std::sync::Arc;

use obsdeg_symbolic::protocol::System;
use obsdeg_symbolic::{Job, Request, Waiting, Worker, WorkerConfig};

fn main() {
    let program = std::env::args().nth(1).unwrap_or_else(|| "obsdeg".into());
    let mut worker = Worker::new(WorkerConfig {
        program: program.into(),
        arguments: vec!["symbolic-worker".into()],
        limit: 1,
        wait: std::time::Duration::from_secs(600),
        waiting: Waiting(Arc::new(|| println!("waiting for another process of this user"))),
    });
    let rows = [["c_a", "0"], ["0", "r_2"]].map(|row| row.map(String::from).to_vec());
    let right = ["1", "c_a"].map(String::from).to_vec();
    let system = System { matrix: rows.to_vec(), right, outputs: Vec::new() };
    let request = Request {
        symbols: Vec::new(),
        generators: vec![("r_2".into(), "2".into())],
        angles: vec!["a".into()],
        job: Job::Solve { system, check: None },
    };
    match worker.ask(&request) {
        Ok((values, _)) => println!("x = {}, y = {}", values[0], values[1]),
        Err(reason) => println!("no answer: {reason}"),
    }
    for line in worker.banner() {
        println!("{line}");
    }
}
