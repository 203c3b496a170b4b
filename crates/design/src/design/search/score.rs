//! The score of a sequence.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::design::measure::stop::Stop;

/// Score of a sequence, better first: constraints kept, then a small worst degree, then a small criterion.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Worth")]
pub struct Score {
    /// Violation of time limits, requirements and degree caps, dimensionless; 0 when kept.
    pub violation: f64,
    /// Largest observable degree of a required coefficient.
    pub degree: usize,
    /// Criterion of the sequence, in the unit of the criterion asked for.
    pub value: f64,
}

impl Score {
    pub(crate) const NONE: Self = Self { violation: f64::INFINITY, degree: usize::MAX, value: f64::INFINITY };

    fn key(&self) -> (f64, usize, f64) {
        (self.violation, self.degree, self.value)
    }

    fn order(&self, other: &Self) -> std::cmp::Ordering {
        let ((a, b, c), (x, y, z)) = (self.key(), other.key());
        a.total_cmp(&x).then(b.cmp(&y)).then(c.total_cmp(&z))
    }

    pub(crate) fn better_than(&self, other: &Self) -> bool {
        self.order(other).is_lt()
    }

    pub(crate) fn is_valid(&self) -> bool {
        self.violation == 0.0 && self.value.is_finite()
    }
}

/// Sequence of candidates with its score.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scored {
    /// Score: constraints, worst degree and criterion.
    #[serde(rename = "worth")]
    pub score: Score,
    /// Total time of dwells and turns, in s.
    pub seconds: f64,
    /// Candidates of the sequence, in order, with the slew paths to them.
    pub sequence: Vec<Stop>,
}

/// True if `a` comes before `b`: by score, ties in lexicographic order of the sequences.
pub(crate) fn before(a: &Scored, b: &Scored) -> bool {
    a.score.order(&b.score).then_with(|| a.sequence.cmp(&b.sequence)).is_lt()
}
