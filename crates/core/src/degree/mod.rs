//! Observable degrees: derivative rows, the filtration of their spans, verdicts, sparse bases.

pub(crate) mod coefficient;
pub(crate) mod ensemble;
pub(crate) mod filtration;
pub(crate) mod findings;
pub(crate) mod histories;
pub(crate) mod platform_rows;
mod reset;
pub(crate) mod rows;
pub(crate) mod sparse;
pub(crate) mod status;
pub(crate) mod transition;

pub use coefficient::{Coefficient, Form, Number};
pub use ensemble::{EnsembleError, Verdicts, filtration, judge};
pub use filtration::{Degrees, climb, partners};
pub use findings::{ByPrimes, Findings};
pub use platform_rows::{LocalRow, PlatformRows, local_chain};
pub use rows::DerivativeRows;
pub use status::{Difference, Status, Verdict};
