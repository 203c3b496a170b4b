//! The evidence for and against the exact verdicts: plain data.

use obsdeg_core::degree::Status;
use obsdeg_core::model::Carry;
use obsdeg_core::model::settings::FilterKind;
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
    /// Reasons why checks are not resolvable, one for each such check.
    pub unresolved: Vec<String>,
    /// How many checks agree, disagree, are not resolvable, were not made.
    pub counts: Counts,
    /// How slopes are measured, and when something is not resolvable.
    pub method: Vec<String>,
    /// What an analysis says and nothing here is held against.
    pub not_tested: Vec<String>,
    /// a: ranks, null space and combinations against the samples.
    pub spaces: Vec<SpaceCheck>,
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

/// What evidence makes of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Agreement {
    /// What was measured is what the verdict says.
    Agrees,
    /// It is not.
    Disagrees,
    /// Something was measured, but neither for nor against the verdict, by a test that the answer states.
    NotResolvable,
    /// Nothing was measured.
    NotTested,
}

impl Agreement {
    /// Of what was measured.
    pub(crate) fn of(agrees: bool) -> Self {
        if agrees { Self::Agrees } else { Self::Disagrees }
    }

    /// Whether it is for or against the verdict.
    pub fn is_resolved(self) -> bool {
        matches!(self, Self::Agrees | Self::Disagrees)
    }
}

/// How many checks came out how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct Counts {
    /// Agree.
    pub agree: usize,
    /// Disagree.
    pub disagree: usize,
    /// Are not resolvable.
    pub not_resolvable: usize,
    /// Were not made.
    pub not_tested: usize,
}

impl Counts {
    pub(crate) fn of(outcomes: impl Iterator<Item = Agreement>) -> Self {
        let mut out = Self::default();
        for outcome in outcomes {
            *match outcome {
                Agreement::Agrees => &mut out.agree,
                Agreement::Disagrees => &mut out.disagree,
                Agreement::NotResolvable => &mut out.not_resolvable,
                Agreement::NotTested => &mut out.not_tested,
            } += 1;
        }
        out
    }
}

/// Something that is no number, predicted and measured.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SpaceCheck {
    /// What is held against the samples.
    pub what: String,
    /// By the exact verdicts.
    pub predicted: String,
    /// By the samples; empty when nothing was measured.
    pub measured: String,
    /// Whether they agree.
    pub outcome: Agreement,
}

/// A predicted and a measured number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Check {
    /// What the exact verdict says.
    pub predicted: f64,
    /// What the filter shows; null when it could not be measured.
    pub measured: Option<f64>,
    /// Whether they agree.
    pub outcome: Agreement,
}

impl Check {
    /// What was measured is held against the prediction by `agrees`; what was not is not tested.
    pub(crate) fn new(predicted: f64, measured: Option<f64>, agrees: impl Fn(f64) -> bool) -> Self {
        let outcome = measured.map_or(Agreement::NotTested, |x| Agreement::of(agrees(x)));
        Self { predicted, measured, outcome }
    }

    /// Whether something was measured that disagrees.
    pub fn fails(&self) -> bool {
        self.outcome == Agreement::Disagrees
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
        Self { measured: said.iter().filter(|c| c.outcome.is_resolved()).count(), of: said.len() }
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
    /// a: log-log slope of sigma against the dwell, psi handed on between positions as it was at the start of each:
    /// -(degree + 1/2); 0 when nothing is learnt.
    pub degree_slope: Check,
    /// a: whether its column of that information is zero, and whether it is in the span; null when it was not measured.
    pub status_measured: Option<Status>,
    /// Whether that is the verdict.
    pub status_outcome: Agreement,
    /// Unknowns that derivatives do not tell it from; null for a combination.
    pub partners: Option<Partners>,
    /// a: log-log slope of sigma (psi: of the start) against the dwell: -(accuracy order + 1/2); 0 when nothing is learnt.
    pub slope: Check,
    /// The same with psi of the end, which is what a filter shows.
    pub slope_at_end: Check,
    /// b: factor on sigma (psi: of the end) when the prior variance is multiplied by 100.
    pub inflation: Check,
}

/// Unknowns that share with one a direction that Z does not see and that holds no shorter one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Partners {
    /// By the exact verdicts.
    pub predicted: Vec<String>,
    /// Those of the directions that the samples do not show; null when they were not measured.
    pub measured: Option<Vec<String>>,
    /// Whether they are the same.
    pub outcome: Agreement,
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
    /// By the samples.
    pub measured: usize,
    /// Whether they agree.
    pub outcome: Agreement,
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
    /// Whether it is kept; not resolvable where rounding may make a tenth of it: the largest variance of the prior, beside the smallest at the
    /// end, times the steps times 2e-16.
    pub outcome: Agreement,
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
    /// Which filter.
    pub filter: FilterKind,
    /// Whether all runs have the scheme's own truth, with initial estimates drawn about it from the prior; otherwise truths are drawn about the
    /// initial estimate.
    pub about_the_truth: bool,
    /// Number of runs.
    pub runs: usize,
    /// Runs whose linearisations did not settle.
    pub unsettled: usize,
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
    /// Of runs with full attitudes: Kendall's tau-b of the predicted orders at the end and the errors there, root mean square in sigmas of the
    /// prior; null where the filter is linear. It decides nothing: orders are of short dwells, errors of those of the scheme.
    pub errors: Option<f64>,
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
    /// By how many degrees its latitude or an attitude is off.
    pub off_deg: f64,
    /// Whether it was found out; not resolvable where it was not, and need not be.
    pub outcome: Agreement,
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
