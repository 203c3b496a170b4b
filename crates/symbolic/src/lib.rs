//! Symbolic algebra for obsdeg: text in, text out.
//!
//! The engine is Symbolica. Without a licence key it prints a banner on stdout and allows one process
//! per user, so it runs in a worker process: the same binary under a hidden subcommand that calls
//! [`worker::serve`]. The worker waits for the lock of its user before it touches the engine, holds it
//! until it ends, and ends with the process that started it. [`client::Worker`] starts it and turns a
//! refusal, a crash, work beyond its limit or an invalid answer into an error that the caller prints in
//! place of the solution. This is the only crate that names Symbolica, and only the worker's thread
//! calls it.
//!
//! ```
//! use std::time::Duration;
//!
//! use obsdeg_symbolic::{Dynamics, Job, Request, Waiting, Worker, WorkerConfig, WorkerError};
//!
//! let oscillator = Dynamics {
//!     states: vec!["x".into(), "v".into()],
//!     equations: vec!["v".into(), "-w^2*x".into()],
//!     outputs: vec!["x".into()],
//! };
//! let job = Job::Derive { dynamics: oscillator, order: 2 };
//! let request = Request { symbols: vec!["w".into()], generators: vec![], angles: vec![], job };
//! // a missing program is an error, without further effect
//! let config = WorkerConfig {
//!     program: "no/such/program".into(),
//!     arguments: vec![],
//!     limit: 1,
//!     wait: Duration::ZERO,
//!     waiting: Waiting::silent(),
//! };
//! assert!(matches!(Worker::new(config).ask(&request), Err(WorkerError::Start { .. })));
//! ```

pub mod client;
pub mod lock;
pub mod protocol;
#[cfg(feature = "symbolica")]
pub mod worker;

pub use client::{Waiting, Worker, WorkerConfig, WorkerError};
pub use protocol::{Dynamics, Job, Order, Request, Response, SubstitutionCheck, System};
