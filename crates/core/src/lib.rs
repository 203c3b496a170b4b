//! The exact engine of obsdeg: models, observable degrees and solving expressions.
//!
//! The way of the data: a model turns into derivative rows ([`degree::rows`]), these into a staircase
//! ([`degree::staircase`]), the staircase into verdicts ([`degree::status`]), these into sparse combinations
//! ([`solution::combinations`]) and solutions ([`solution`]), and all of it into one plain [`analysis::Analysis`]. Every module
//! imports only from those below it.

pub mod accuracy;
pub mod analysis;
pub mod degree;
pub mod model;
pub mod solution;
pub mod system;
