//! Error of a model that cannot be judged.

use std::ops::Range;

/// Error of a model that cannot be judged: the place, the fault and the expectation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what}: {message}")]
pub struct ModelError {
    /// Place of the fault in words, such as `the equation of x1`.
    pub what: String,
    /// Fault, and what was expected.
    pub message: String,
    /// Byte range in the file; `None` where it is not known.
    pub span: Option<Range<usize>>,
}
