//! The evidence for and against the exact verdicts: plain data.

use obsdeg_core::degree::Status;
use obsdeg_core::model::Carry;
use schemars::JsonSchema;
use serde::Serialize;

use crate::simulation::answer::{ConditionsReport, TimelineReport, Validity};

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.crosscheck/1";

/// The cross-check of one scheme.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CrossCheck {
    /// `obsdeg.crosscheck/1`.
    pub schema: String,
    /// Version of the program.
    pub version: String,
    /// What is carried between positions.
    pub carry: Carry,
    /// How the filter was made to differ from the truth; null for a right one.
    pub filter: Option<String>,
    /// Under which conditions.
    pub conditions: ConditionsReport,
    /// The timeline.
    pub timeline: Vec<TimelineReport>,
    /// Whether everything agrees.
    pub passed: bool,
    /// Whether all but d agrees: d holds the filter against drawn truths, which fails where the small-angle model does, too.
    pub verdicts_agree: bool,
    /// What disagrees, in words.
    pub disagreements: Vec<String>,
    /// How many accuracy orders were measured.
    pub orders: Measured,
    /// Evidence a and b per unknown and combination.
    pub quantities: Vec<QuantityEvidence>,
    /// Directions that Z does not see.
    pub null_space: Vec<NullEvidence>,
    /// Number of directions that Z does not see.
    pub defect: Count,
    /// Evidence c: covariance of the filter against the inverse information.
    pub covariance: Vec<Difference>,
    /// Evidence d: Monte Carlo statistics.
    pub monte_carlo: MonteCarlo,
    /// Evidence e: rank correlation of predicted and measured orders.
    pub ranking: Ranking,
    /// Evidence f: filters that are wrong on purpose.
    pub controls: Vec<Control>,
    /// Whether the small-angle model holds for the true values.
    pub validity: Validity,
    /// Sigma against dwell, for the plot.
    pub slopes: Vec<SlopeCurve>,
    /// Correlation of the estimate under a diffuse prior.
    pub correlation: Correlation,
    /// Seed of the noise.
    pub seed: u64,
    /// Bound on the probability that a prediction is wrong.
    pub error_bound: f64,
}

/// A predicted and a measured number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Check {
    /// What the exact verdict says.
    pub predicted: f64,
    /// What the filter shows; null when it could not be measured.
    pub measured: Option<f64>,
    /// Whether they agree; null when nothing was measured, which is neither.
    pub pass: Option<bool>,
}

impl Check {
    /// What was measured is held against the prediction by `agrees`; what was not is left open.
    pub(crate) fn new(predicted: f64, measured: Option<f64>, agrees: impl Fn(f64) -> bool) -> Self {
        Self { predicted, measured, pass: measured.map(agrees) }
    }

    /// Whether something was measured that disagrees.
    pub fn fails(&self) -> bool {
        self.pass == Some(false)
    }
}

/// How many of the orders that the verdicts say were measured by a slope.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Measured {
    /// Slopes that were measured.
    pub measured: usize,
    /// Unknowns and combinations that have an order.
    pub of: usize,
}

impl Measured {
    /// Counts over slopes, each with whether the verdict says an order.
    pub(crate) fn count<'a>(slopes: impl Iterator<Item = (&'a Check, bool)>) -> Self {
        let said: Vec<&Check> = slopes.filter(|(_, said)| *said).map(|(slope, _)| slope).collect();
        Self { measured: said.iter().filter(|c| c.pass.is_some()).count(), of: said.len() }
    }
}

/// Evidence on one unknown or combination.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct QuantityEvidence {
    /// The unknown or combination.
    pub name: String,
    /// The exact verdict.
    pub status: Status,
    /// The observable degree.
    pub degree: Option<usize>,
    /// The accuracy order.
    pub accuracy_order: Option<usize>,
    /// Whether the filter has it: one that was made wrong may lack an unknown, and nothing is measured then.
    pub modelled: bool,
    /// a: log-log slope of sigma (psi: of the start) against the dwell; 0, or more, when nothing is learnt.
    pub slope: Check,
    /// b: factor on sigma (psi: of the end) when the prior variance is multiplied by 100.
    pub inflation: Check,
}

/// Evidence on one null vector.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NullEvidence {
    /// `psi_y = 1, D_FZ = 6.4e-5` in SI units.
    pub direction: String,
    /// How much of it Z sees, relative to the best seen direction: predicted 0.
    pub seen: Check,
    /// Smallest correlation of its unknowns under a diffuse prior, signed by the prediction: predicted 1; null
    /// when other null vectors share its unknowns, or when it has only one.
    pub correlation: Option<Check>,
}

/// A predicted and a measured count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Count {
    /// By the exact verdicts.
    pub predicted: usize,
    /// Singular values of the information below 1e-10 of the largest.
    pub measured: usize,
    /// Whether they agree.
    pub pass: bool,
}

/// The largest difference of two covariances.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Difference {
    /// What is compared.
    pub name: String,
    /// `max |P_ij - Q_ij| / sqrt(Q_ii Q_jj)`.
    pub difference: f64,
    /// The limit.
    pub limit: f64,
    /// Whether it is kept.
    pub pass: bool,
}

/// A statistic with its bands.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Statistic {
    /// What is averaged.
    pub name: String,
    /// Its expectation.
    pub expected: f64,
    /// The average.
    pub measured: f64,
    /// The band of 95 %.
    pub band: (f64, f64),
    /// The band of 99.9 %, in which it must be.
    pub wide_band: (f64, f64),
    /// Whether it is.
    pub pass: bool,
}

/// Monte Carlo evidence.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MonteCarlo {
    /// Number of runs.
    pub runs: usize,
    /// ANEES and NIS.
    pub statistics: Vec<Statistic>,
    /// Probability that white innovations have autocorrelations as large.
    pub whiteness_probability: f64,
    /// Whether that is above 0.001.
    pub white: bool,
    /// ANEES and mean NIS over time.
    pub history: Vec<HistoryPoint>,
}

/// Averages over the runs at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct HistoryPoint {
    /// Time in s.
    pub t_s: f64,
    /// ANEES of all unknowns.
    pub nees: f64,
    /// Mean NIS since the point before.
    pub nis: f64,
    /// Number of samples in it, all runs together.
    pub samples: usize,
}

/// Agreement of the order of all unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Ranking {
    /// Kendall's tau-b of predicted and measured accuracy orders; null when all are tied.
    pub kendall_tau: Option<f64>,
    /// Whether it is 1 (or all are tied on both sides).
    pub pass: bool,
}

/// A filter that is wrong on purpose, and must be found out.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Control {
    /// What is wrong with it.
    pub name: String,
    /// How many checks of a and b fail with it.
    pub failed: usize,
    /// Out of how many.
    pub checks: usize,
    /// Its mean NIS.
    pub nis: f64,
    /// The band in which a right filter's would be (99.9 %).
    pub band: (f64, f64),
    /// Whether it was found out.
    pub pass: bool,
}

/// Sigma against the dwell.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SlopeCurve {
    /// The unknown or combination.
    pub name: String,
    /// Unit of sigma.
    pub unit: String,
    /// The accuracy order.
    pub accuracy_order: Option<usize>,
    /// `(dwell in s, sigma)`.
    pub points: Vec<(f64, f64)>,
}

/// A correlation matrix.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Correlation {
    /// The unknowns.
    pub names: Vec<String>,
    /// Row by row.
    pub values: Vec<Vec<f64>>,
}
