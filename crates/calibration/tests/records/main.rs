//! Calibrations of records that an independent simulator wrote.

#![allow(clippy::print_stdout, reason = "what a sweep found")]

mod alarms;
mod campaign;
mod cells;
mod constraints;
mod faults;
mod formats;
mod handheld;
mod models;
mod next;
mod omitted;
mod round_trip;
mod sheet;
mod simulator;
mod spoil;
mod timeline;
