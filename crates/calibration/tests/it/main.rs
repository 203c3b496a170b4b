//! Calibrations of records that an independent simulator wrote.

#![allow(clippy::print_stdout, reason = "what a sweep found")]

mod constraints;
mod faults;
mod handheld;
mod models;
mod round_trip;
mod simulator;
mod timeline;
