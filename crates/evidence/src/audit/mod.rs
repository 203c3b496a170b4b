//! The paper against the algebra: every numbered equation and claim, recomputed.
//!
//! The source is Ding, Cai, Huang, J. NUDT 39(1), 2017, 1001-2486(2017)01-040-06. Equations are compared with
//! the model as identities in random prime fields. Claims about degrees are judged by the engine, those of
//! section 3.3 by the filter under the conditions of section 3.1. Every statement that is not covered has a
//! line of its own.

mod claims;
mod equations;
mod frames;
mod simulated;

use obsdeg_core::accuracy::AccuracyError;
use obsdeg_core::analysis::AnalysisError;
use schemars::JsonSchema;
use serde::Serialize;

use crate::simulation::SimulationError;

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.audit/1";

/// Outcome of checking an equation or claim of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Finding")]
pub enum AuditFinding {
    /// True as printed in the paper.
    Agree,
    /// True under a condition that the paper does not state; the reason states it.
    Conditional,
    /// False as printed in the paper.
    Disagree,
    /// Not judged; the reason gives the cause.
    NotCovered,
}

/// Equation or claim of the paper, with its outcome.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Line {
    /// Place in the paper, such as `(21)` or `conclusion 2`.
    pub place: String,
    /// Equation or claim, in words.
    pub claim: String,
    /// Outcome: agree, conditional, disagree or not covered.
    pub finding: AuditFinding,
    /// Reason of the outcome: the computation, for a slip the correction, and for a line that is not covered
    /// the cause.
    pub reason: String,
}

/// Audit of the paper, equation by equation and claim by claim.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Audit {
    /// Layout of this answer: `obsdeg.audit/1`.
    pub schema: String,
    /// Seed of all random points and of the noise.
    pub seed: u64,
    /// Equations by number, then claims in the order of the paper, then everything that is not covered.
    pub lines: Vec<Line>,
}

/// Reason why the paper cannot be audited.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AuditError {
    /// A verdict cannot be reached.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// An accuracy order cannot be computed.
    #[error(transparent)]
    Accuracy(#[from] AccuracyError),
    /// The filter cannot be run.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// Place, claim and reason of every statement of the paper that is not judged.
const NOT_COVERED: [[&str; 3]; 8] = [
    [
        "introduction",
        "what other methods of observability analysis lack",
        "about other publications; nothing here to recompute",
    ],
    [
        "Fig. 1",
        "the mounting of gyros and accelerometers",
        "the figure is missing; (3) and (4) say what mountings agree with (22), (27), (28)",
    ],
    [
        "section 1.1",
        "with X_p, Y_p along accelerometer axes the system is observable",
        "rests on another publication; mounting errors are no unknowns of this paper",
    ],
    [
        "(3)",
        "the gyro noise w_x",
        "noise has no part in a degree; the runs for section 3.3 have random drift",
    ],
    [
        "section 2.1",
        "the observable degree falls with the highest order of derivative in the solution",
        "a definition; it is what is used here (a larger number is worse)",
    ],
    [
        "section 3.1",
        "latitude, prior covariance, unit of psi(0), what is carried between positions",
        "not given; what the runs for section 3.3 use instead stands in their lines",
    ],
    ["Figs 2-10", "the curves", "the figures are missing; what section 3.3 says of them is judged"],
    [
        "section 4",
        "the analysis holds for all torquing schemes",
        "its equations take (7), a platform that tracks the geographic frame; the lines here judge \
         positions, no rotating segments",
    ],
];

/// Recomputes every line of the audit.
///
/// # Errors
/// [`AuditError`].
pub fn audit(seed: u64) -> Result<Audit, AuditError> {
    let mut lines = frames::lines(seed)?;
    lines.extend(equations::lines(seed)?);
    lines.sort_by_key(|l| l.place.trim_matches(['(', ')']).parse::<usize>().unwrap_or(usize::MAX));
    lines.extend(claims::section_2(seed)?);
    lines.extend(simulated::lines(seed)?);
    lines.extend(claims::conclusions(seed)?);
    lines.extend(
        NOT_COVERED.map(|[place, claim, why]| line(place, claim, AuditFinding::NotCovered, why.into())),
    );
    Ok(Audit { schema: SCHEMA.into(), seed, lines })
}

fn line(place: &str, claim: &str, finding: AuditFinding, reason: String) -> Line {
    Line { place: place.into(), claim: claim.into(), finding, reason }
}

fn finding(holds: bool) -> AuditFinding {
    if holds { AuditFinding::Agree } else { AuditFinding::Disagree }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The audit finds the slips, conditions and uncovered statements listed here and agrees with all other
    /// lines, whatever the seed.
    #[test]
    fn the_findings_are_these() {
        use AuditFinding::{Conditional, Disagree, NotCovered};
        for seed in [1, 2, 99] {
            let audit = audit(seed).expect("computed");
            let agree =
                audit.lines.iter().filter(|l| l.finding == AuditFinding::Agree).map(|l| l.place.as_str());
            let equations = "(1) (2) (3) (6) (8) (9) (10) (11) (12) (13) (14) (15) (16) (17) (18) (19) (20) \
                (22) (24) (25) (27) (28)";
            let claims = [["section 2.2"; 4].as_slice(), &["section 3.3"; 5], &["conclusion 2"]].concat();
            assert_eq!(
                agree.collect::<Vec<_>>(),
                [equations.split(' ').collect(), claims].concat(),
                "{audit:#?}"
            );
            let rest = audit.lines.iter().filter(|l| l.finding != AuditFinding::Agree);
            assert_eq!(
                rest.map(|l| (l.place.as_str(), l.finding)).collect::<Vec<_>>(),
                [
                    ("(4)", Conditional),
                    ("(5)", Disagree),
                    ("(7)", Disagree),
                    ("(21)", Disagree),
                    ("(23)", Disagree),
                    ("(26)", Conditional),
                    ("section 2.2", Conditional),
                    ("section 2.2", Conditional),
                    ("section 3.3", Disagree),
                    ("section 3.3", Conditional),
                    ("section 3.3", Conditional),
                    ("section 3.3", Conditional),
                    ("conclusion 1", Disagree),
                    ("introduction", NotCovered),
                    ("Fig. 1", NotCovered),
                    ("section 1.1", NotCovered),
                    ("(3)", NotCovered),
                    ("section 2.1", NotCovered),
                    ("section 3.1", NotCovered),
                    ("Figs 2-10", NotCovered),
                    ("section 4", NotCovered),
                ],
                "{audit:#?}"
            );
        }
    }

    /// Every numbered equation has a line that judges it, in the paper's order.
    #[test]
    fn no_equation_is_left_out() {
        let audit = audit(3).expect("computed");
        let judged = audit.lines.iter().filter(|l| l.finding != AuditFinding::NotCovered);
        let numbers = judged.filter_map(|l| l.place.trim_matches(['(', ')']).parse::<usize>().ok());
        assert_eq!(numbers.collect::<Vec<_>>(), (1..=28).collect::<Vec<_>>());
    }

    /// Numbers in the reasons equal those computed by hand: wN psi_y(0) at 28.2 degrees, the fewest positions
    /// of the reference verdicts, the accuracy orders, the mounting of the paper.
    #[test]
    fn the_reasons_say_these_numbers() {
        let audit = audit(1).expect("computed");
        let reason = |place: &str, claim: &str| {
            let found = audit.lines.iter().find(|l| l.place == place && l.claim.contains(claim));
            found.map_or_else(|| panic!("{place} {claim}"), |l| l.reason.clone())
        };
        for (place, claim, numbers) in [
            (
                "(3)",
                "",
                "X I=+x O=-z S=+y right-handed, Y I=+y O=-z S=-x right-handed, Z I=+z O=+x S=+y right-handed",
            ),
            ("(4)", "", "when eps is positive about +I, no mounting with -g^c"),
            ("(4)", "", "when eps is positive about -I: X I=-x O=+z S=-y left-handed"),
            ("section 2.2", "need only Z and Z'", "6 under platform, 6 under inertial, 11 under reset carry"),
            ("section 2.2", "need only Z and Z'", "D_FY has degree 2"),
            ("section 2.2", "at least two", "suffice under platform carry, not under inertial, reset carry"),
            ("conclusion 2", "", "1 1 1 at 5 under platform, 1 1 1 at 6 under platform"),
            ("conclusion 2", "", "2 2 2 at 6 under inertial"),
            ("conclusion 2", "", "at a pole it is in no derivative"),
            // 15.0411 cos(28.2 deg) 0.1 pi/180 and 15.0411 0.1 pi/180
            (
                "section 3.3",
                "D_FZ quickly",
                "-wN psi_y(0) is -0.02314 deg/h, with the whole earth rate -0.02625",
            ),
            (
                "section 3.3",
                "D_FY and D_IY",
                "degree 1, not observable, degree 1, degree 1, degree 2, degree 2",
            ),
        ] {
            let found = reason(place, claim);
            assert!(found.contains(numbers), "{place}: {found}");
        }
    }
}
