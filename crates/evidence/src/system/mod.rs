//! Any system in floating point: a filter on it ([`run`]) and the information of its samples ([`evidence`]).

pub mod evidence;
pub mod numeric;
pub mod run;

pub use evidence::{SystemEvidence, crosscheck_system};
pub use run::{SystemRun, simulate_system};
