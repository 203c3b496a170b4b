//! Solutions of observable quantities in derivatives of Z.

mod angle_products;
pub(crate) mod ask;
mod closed_form;
pub(crate) mod combinations;
pub(crate) mod formulas;
mod half_tangent;
pub(crate) mod local;
pub(crate) mod loci;
pub(crate) mod print;
pub(crate) mod problem;
pub(crate) mod requested;
pub(crate) mod solve;
pub(crate) mod solver;
pub(crate) mod substitution;
pub(crate) mod support;
pub(crate) mod tables;
mod term;
pub(crate) mod turning;

pub use combinations::NullVector;
pub use formulas::Formula;
pub use loci::Locus;
pub use print::{Group, Grouped, SolutionTerm, StationLabel, group};
pub use requested::CombinationError;
pub use solve::{FoundBy, Solved, Verification};
pub use solver::{Frame, Functional, Solver, Sparse};
pub use term::DerivativeTerm;
