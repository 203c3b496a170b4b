//! Observable degrees of any system `x' = f(x, u, p, t)`, `z = h`, on the same filtration as the platform.
//!
//! A model is read ([`model_file`], [`json`]) and stored as a graph of shared operations (`dag`). It is
//! evaluated as Taylor series with a dual component per unknown at a random point of a prime field
//! (`taylor`, Sedoglavic 2002, doi:10.1006/jsco.2002.0532). The dual components of its outputs are the
//! derivative rows (`rows`).

mod addition;
mod adjoint;
mod algebraic;
mod analyze;
mod answer;
mod branches;
mod candidates;
mod canonical;
mod compile;
pub(crate) mod constraints;
mod counts;
pub(crate) mod dag;
mod discrete;
mod elimination;
mod error;
mod evaluation;
mod factors;
mod families;
mod fibre;
mod formula;
mod function_factors;
mod functions;
mod gathered;
mod global;
mod held;
mod identifiable;
mod independent;
mod intervals;
pub mod json;
pub(crate) mod judge;
mod lie;
mod maps;
pub(crate) mod model;
pub mod model_file;
mod newton;
mod nominal;
mod quotients;
mod reader;
pub(crate) mod real_points;
mod reduced;
mod remedies;
pub(crate) mod rows;
mod solutions;
pub(crate) mod symmetry;
pub(crate) mod taylor;
mod text;
mod twins;
mod undecided;
pub(crate) mod values;
mod why;
pub(crate) mod work;

pub use analyze::analyze_system;
pub use answer::data::*;
pub use answer::texts::{invariant_reports, symmetry_reports};
pub use branches::BranchSide;
pub use candidates::{CANDIDATE_WORDS, check_cost};
pub use constraints::ConstraintFactor;
pub use dag::{Dag, DagError, Op};
pub use error::FilePlace;
pub use error::ModelError;
pub use gathered::{Gathered, OutputRows, gather};
pub use judge::verdicts::{ByDigits, Judgement, SystemCertainty};
pub use judge::{judge, judge_compiled, judge_in_digits};
pub use model::compiled::{Compiled, CompiledExperiment, CompiledSegment, Role};
pub use model::{
    AlgebraicEquation, Candidate, Constant, ExperimentChanges, KnownInput, ModelSegment, Named, Nominal,
    PlacedExpression, StartTime, State, StateStart, SystemModel,
};
pub use reduced::{Reduced, ReducedError, reduced};
pub use rows::PointRows;
pub use rows::layout::{Layout, Unknown};
pub use symmetry::{Invariant, POLYNOMIAL_DEGREE, PolynomialDirection, Symmetries, Symmetry, symmetries};
pub use why::explain_system;
pub use work::WorkLimit;
