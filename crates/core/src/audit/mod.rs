//! The paper against the algebra: every numbered equation and claim, recomputed.
//!
//! The source is Ding, Cai, Huang, J. NUDT 39(1), 2017, 1001-2486(2017)01-040-06. Equations are
//! compared with the model as identities in random prime fields; claims are judged by the engine.

mod claims;
mod equations;

use schemars::JsonSchema;
use serde::Serialize;

use crate::analysis::AnalysisError;

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.audit/1";

/// Whether the paper is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// It holds as printed.
    Agree,
    /// It does not.
    Disagree,
}

/// One equation or claim.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Line {
    /// Where in the paper, such as `(21)` or `conclusion 2`.
    pub place: String,
    /// What it says.
    pub claim: String,
    /// Whether it holds.
    pub finding: Finding,
    /// Why: the evidence, and for a slip the correction.
    pub reason: String,
}

/// The whole audit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Audit {
    /// `obsdeg.audit/1`.
    pub schema: String,
    /// Seed of all random points.
    pub seed: u64,
    /// The lines in the order of the paper.
    pub lines: Vec<Line>,
}

/// Recomputes every line.
///
/// # Errors
/// [`AnalysisError`] when a verdict cannot be reached.
pub fn audit(seed: u64) -> Result<Audit, AnalysisError> {
    let mut lines = equations::lines(seed)?;
    lines.extend(claims::lines(seed)?);
    Ok(Audit { schema: SCHEMA.into(), seed, lines })
}

pub(crate) fn finding(holds: bool) -> Finding {
    if holds { Finding::Agree } else { Finding::Disagree }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The slips of the paper, and nothing else, come out as disagreements, whatever the seed.
    #[test]
    fn the_slips_are_these() {
        for seed in [1, 2, 99] {
            let audit = audit(seed).expect("computed");
            let slips: Vec<&str> = audit
                .lines
                .iter()
                .filter(|l| l.finding == Finding::Disagree)
                .map(|l| l.place.as_str())
                .collect();
            assert_eq!(
                slips,
                ["(4)", "(21)", "(23)", "section 2.2", "section 2.2", "section 3.3", "conclusion 1"],
                "{audit:#?}"
            );
        }
    }
}
