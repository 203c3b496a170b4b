//! How an observable quantity is solved from the derivatives of Z.

pub mod ask;
pub mod combinations;
pub mod formulas;
mod half_tangent;
pub mod local;
pub mod loci;
pub mod print;
pub mod problem;
pub mod requested;
pub mod solver;
pub mod substitution;
pub mod support;
pub mod tables;
pub mod turning;
