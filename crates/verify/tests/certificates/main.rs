//! Certificates of random schemes and published models, and changed ones, compared by both checkers.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "what was measured")]

mod models;
mod optima;
mod python;
mod schemes;
