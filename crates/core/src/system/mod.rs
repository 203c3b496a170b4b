//! Observable degrees of any system `x' = f(x, u, p, t)`, `z = h`, on the same staircase as the platform.
//!
//! A model is read ([`model_file`], [`json`]), held as a graph of shared operations ([`dag`]), evaluated as Taylor series with a dual
//! lane per unknown at a random point of a prime field ([`taylor`], Sedoglavic 2002, doi:10.1006/jsco.2002.0532), and its outputs' duals
//! are the derivative rows ([`rows`]).

pub mod answer;
mod canonical;
pub mod dag;
mod functions;
pub mod json;
pub mod judge;
pub mod model;
pub mod model_file;
pub mod rows;
mod solutions;
pub mod symmetry;
pub mod taylor;

pub use answer::{SystemAnalysis, SystemOptions, analyze_system};
pub use judge::{Judgement, judge};
pub use model::{ModelError, SystemModel};
