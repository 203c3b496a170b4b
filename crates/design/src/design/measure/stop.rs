//! One position of a sequence.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Position of a sequence: the candidate, and the slew path to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub struct Stop {
    /// Index of the candidate, from 0.
    pub candidate: usize,
    /// True if a half turn to the position goes the other way round than by default: about the axis whose
    /// first non-zero component is negative.
    pub reversed: bool,
}

impl From<usize> for Stop {
    fn from(candidate: usize) -> Self {
        Self { candidate, reversed: false }
    }
}
