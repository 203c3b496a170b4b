//! What a degree says of an unknown, and how verdicts differ.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::staircase::Degrees;

/// Whether an unknown can be solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// It is in the span of the derivative rows.
    Observable,
    /// It moves Z, but only together with its partners.
    Inseparable,
    /// It does not move Z at all.
    NotExcited,
    /// No order up to the last that was looked at solves it, and a higher one may: of systems with special starts, jumps or
    /// arbitrary inputs.
    NotSeen,
}

impl Status {
    /// The status of what has this degree, if any, and moves Z or does not.
    pub fn of(degree: Option<usize>, excited: bool) -> Self {
        match degree {
            Some(_) => Self::Observable,
            None if excited => Self::Inseparable,
            None => Self::NotExcited,
        }
    }
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Observable => "observable",
            Self::Inseparable => "inseparable",
            Self::NotExcited => "not excited",
            Self::NotSeen => "not seen",
        })
    }
}

/// Status and degree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Verdict {
    /// Whether it can be solved.
    pub status: Status,
    /// The observable degree.
    pub degree: Option<usize>,
}

impl Verdict {
    /// The verdict on a column.
    pub fn of(degrees: &Degrees, column: usize) -> Self {
        let degree = degrees.degree[column];
        Self { status: Status::of(degree, degrees.excited[column]), degree }
    }
}

/// A verdict that depends on the carry.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Difference {
    /// The unknown.
    pub name: String,
    /// Under the carry of the scheme.
    pub here: Verdict,
    /// Under the other one.
    pub there: Verdict,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_degree_says() {
        let of = |degree, excited| Status::of(degree, excited).to_string();
        assert_eq!(
            [of(Some(2), true), of(None, true), of(None, false)],
            ["observable", "inseparable", "not excited"]
        );
    }
}
