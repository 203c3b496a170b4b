//! One position of a sequence.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A position of a sequence: which candidate, and which way there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub struct Stop {
    /// The candidate.
    pub candidate: usize,
    /// A half turn to it goes the other way round than `Slew::to` says.
    pub reversed: bool,
}

impl From<usize> for Stop {
    fn from(candidate: usize) -> Self {
        Self { candidate, reversed: false }
    }
}
