//! Evidence for exact verdicts: what a filter makes of the same scheme or system.

pub mod audit;
pub mod compare;
pub mod crosscheck;
pub mod prediction;
pub mod requirements;
pub mod simulation;
pub mod system;
