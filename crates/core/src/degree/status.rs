//! Statuses of unknowns, by their degrees, and differences of verdicts.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::filtration::Degrees;

/// Verdict on an unknown or a combination.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Observable: the unknown is in the span of the derivative rows.
    Observable,
    /// Inseparable: it affects Z, but only together with its partners.
    Inseparable,
    /// Not excited: it does not affect Z at all.
    NotExcited,
    /// Not resolved up to the bound on the order; a higher order may resolve it. For systems with special
    /// starts, jumps or arbitrary inputs.
    NotSeen,
}

impl Status {
    /// Status of an unknown or combination with this degree, if any, that affects Z or does not.
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

/// Verdict on one unknown: status and degree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Verdict {
    /// Status: observable, inseparable, not excited or not seen.
    pub status: Status,
    /// Observable degree of the unknown; null if it is not observable.
    pub degree: Option<usize>,
}

impl Verdict {
    /// The verdict on a column.
    pub fn of(degrees: &Degrees, column: usize) -> Self {
        let degree = degrees.degree[column];
        Self { status: Status::of(degree, degrees.excited[column]), degree }
    }
}

/// Verdict that depends on the carry.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Difference {
    /// Name of the unknown whose verdict differs.
    pub name: String,
    /// Verdict under the carry of the scheme, or at generic angles.
    pub here: Verdict,
    /// Verdict under the other carry, or at the special angles.
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
