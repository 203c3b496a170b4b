//! Any system in floating point: a filter on it (`run`) and the information of its samples (`evidence`).

pub(crate) mod evidence;
pub(crate) mod numeric;
pub(crate) mod run;

pub use evidence::{SymmetryEvidence, SystemEvidence, SystemQuantityEvidence, crosscheck_system};
pub use numeric::{FilterState, Numeric, SystemMeasurement, SystemProcess};
pub use run::{RunError, SystemEstimate, SystemRun, simulate_system};
