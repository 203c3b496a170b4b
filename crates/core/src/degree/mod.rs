//! Observable degrees: derivative rows, the staircase of their spans, verdicts, sparse bases.

pub mod coefficient;
pub mod ensemble;
pub mod platform_rows;
mod reset;
pub mod rows;
pub mod sparse;
pub mod staircase;
pub mod status;
