//! Symbolic algebra for obsdeg: text in, text out.
//!
//! The engine is Symbolica. Without a licence key it prints a banner on stdout and allows one process
//! per user, so it runs in a worker process: the same binary under a hidden subcommand that calls
//! [`worker::serve`]. [`client::Worker`] starts it, one at a time per user through a lock file, and
//! turns a refusal, a crash or a time-out into an error that the caller prints in place of the
//! solution. This is the only crate that names Symbolica, and no thread but the worker's touches it.

pub mod client;
pub mod protocol;
#[cfg(feature = "symbolica")]
pub mod worker;

pub use client::{Worker, WorkerConfig, WorkerError};
pub use protocol::{Check, Dynamics, Job, RationalSystem, Request, Response, System};
