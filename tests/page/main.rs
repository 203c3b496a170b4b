//! Tests of the workbench in a real browser: `cargo test --workspace --test page`. They drive a draft, whose
//! engine is a program, or, once `cargo run -p obsdeg-web` has built the page in minutes, the page itself.
//! `cargo test` leaves them out.

#[path = "../it/browser.rs"]
mod browser;
mod design;
mod fields;
mod links;
mod opened;
mod positions;
#[path = "../it/program.rs"]
#[allow(dead_code, reason = "other tests need more of it")]
mod program;
mod verdicts;
mod why;
