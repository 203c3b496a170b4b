//! Observable degrees: derivative rows, the staircase of their spans, verdicts, sparse bases.

pub(crate) mod coefficient;
pub(crate) mod courses;
pub(crate) mod ensemble;
pub(crate) mod findings;
pub(crate) mod platform_rows;
mod reset;
pub(crate) mod rows;
pub(crate) mod sparse;
pub(crate) mod staircase;
pub(crate) mod status;
pub(crate) mod transition;

pub use coefficient::{Coefficient, Form, Number};
pub use ensemble::{EnsembleError, Verdicts, judge, staircase};
pub use findings::{ByPrimes, Findings};
pub use platform_rows::{LocalRow, PlatformRows, local_chain};
pub use rows::DerivativeRows;
pub use staircase::{Degrees, climb, partners};
pub use status::{Difference, Status, Verdict};
