//! The engine of obsdeg: models, observable degrees, solving expressions, and the audit of the paper.
//!
//! The way of the data: a model turns into derivative rows ([`degree::rows`]), these into a staircase
//! ([`degree::staircase`]), the staircase into verdicts ([`degree::status`]), these into sparse combinations
//! ([`solution::combinations`]) and solutions ([`solution`]), and all of it into one plain [`analysis::Analysis`]. Every module
//! imports only from those below it.

pub mod accuracy;
pub mod analysis;
pub mod audit;
pub mod compare;
pub mod crosscheck;
pub mod degree;
pub mod design;
pub mod model;
pub mod prediction;
pub mod requirements;
pub mod review;
pub mod simulation;
pub mod solution;
pub mod system;
