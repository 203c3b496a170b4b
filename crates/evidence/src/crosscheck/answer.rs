//! Evidence for and against the exact verdicts, as plain data.

use obsdeg_core::degree::Status;
use obsdeg_core::json_list;
use obsdeg_core::model::Carry;
use obsdeg_core::model::settings::FilterKind;
use obsdeg_core::span::Span;
use schemars::JsonSchema;
use serde::Serialize;

use crate::simulation::answer::{ConditionsReport, TimelineReport, Validity};

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.crosscheck/1";

/// Cross-check of the verdicts on one scheme against filters and samples.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CrossCheck {
    /// Layout of this answer: `obsdeg.crosscheck/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Carry: quantity that continues from one position to the next.
    pub carry: Carry,
    /// Deliberate error of the filter's model; null for the right filter.
    pub filter: Option<String>,
    /// Conditions of the runs, with their units.
    pub conditions: ConditionsReport,
    /// Bench that is stated, in words; no part of a cross-check. Null where none is stated.
    pub bench: Option<String>,
    /// Positions and slews of the run, in order of time.
    pub timeline: Vec<TimelineReport>,
    /// True if no check disagrees, evidence a to f.
    pub passed: bool,
    /// True if no check but evidence d disagrees. Evidence d compares the filter with drawn truths and also
    /// fails if the small-angle model does not hold.
    pub verdicts_agree: bool,
    /// Disagreements of the checks, in words.
    pub disagreements: Vec<String>,
    /// Reasons why checks are not resolvable, one for each such check.
    pub unresolved: Vec<String>,
    /// Number of checks by outcome.
    pub counts: Counts,
    /// Method of measuring slopes, and criteria for a check that is not resolvable.
    pub method: Vec<String>,
    /// Statements of an analysis that no evidence checks.
    pub not_tested: Vec<String>,
    /// Evidence a: ranks, null space and combinations against the samples.
    pub spaces: Vec<SpaceCheck>,
    /// Coverage of the accuracy orders by measured slopes.
    pub orders: Measured,
    /// Evidence a and b on each unknown and combination.
    pub quantities: Vec<QuantityEvidence>,
    /// Evidence on each direction that Z does not observe.
    pub null_space: Vec<NullEvidence>,
    /// Number of independent directions that Z does not observe.
    pub defect: Count,
    /// Evidence c: covariance of the filter against the inverse information.
    pub covariance: Vec<CovarianceDifference>,
    /// Evidence d: Monte Carlo statistics.
    pub monte_carlo: MonteCarlo,
    /// Evidence e: rank correlation of predicted and measured orders.
    pub ranking: Ranking,
    /// Evidence f: filters with a deliberate model error.
    pub controls: Vec<Control>,
    /// Validity of the small-angle model at the true values.
    pub validity: Validity,
    /// Sigma against dwell, for the plot.
    pub slopes: Vec<SlopeCurve>,
    /// Correlation matrix of the estimates under a diffuse prior.
    pub correlation: Correlation,
    /// Seed of the noise and of all random choices.
    pub seed: u64,
    /// Bound on the probability that a prediction is wrong.
    pub error_bound: f64,
}

/// Outcome of a check of a verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Agreement {
    /// Agreement: the measurement confirms the verdict.
    Agrees,
    /// Disagreement: the measurement contradicts the verdict.
    Disagrees,
    /// Measurement that neither supports nor contradicts the verdict, by a test that the answer states.
    NotResolvable,
    /// Check that was skipped: nothing was measured.
    NotTested,
}

impl Agreement {
    /// Agreement from the outcome of a comparison.
    pub(crate) fn of(agrees: bool) -> Self {
        if agrees { Self::Agrees } else { Self::Disagrees }
    }

    /// True if the evidence is for or against the verdict.
    pub fn is_resolved(self) -> bool {
        matches!(self, Self::Agrees | Self::Disagrees)
    }
}

/// Number of checks by outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct Counts {
    /// Number of checks that agree with the verdicts.
    pub agree: usize,
    /// Number of checks that disagree with the verdicts.
    pub disagree: usize,
    /// Number of checks that are not resolvable.
    pub not_resolvable: usize,
    /// Number of checks that were skipped.
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

/// Property that is no number, predicted and measured.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SpaceCheck {
    /// Property that is compared with the samples.
    pub what: String,
    /// Value by the exact verdicts.
    pub predicted: String,
    /// Value by the samples; empty if nothing was measured.
    pub measured: String,
    /// Outcome of the comparison of both values.
    pub outcome: Agreement,
}

/// Number that was predicted and measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Check {
    /// Predicted number by the exact verdict: a slope, factor, part or correlation, dimensionless.
    pub predicted: f64,
    /// Measured number by the filter, dimensionless; null if it could not be measured.
    pub measured: Option<f64>,
    /// Outcome of the comparison of both numbers.
    pub outcome: Agreement,
}

impl Check {
    /// Check of a measured value by `agrees`; not tested without a measured value.
    pub(crate) fn new(predicted: f64, measured: Option<f64>, agrees: impl Fn(f64) -> bool) -> Self {
        let outcome = measured.map_or(Agreement::NotTested, |x| Agreement::of(agrees(x)));
        Self { predicted, measured, outcome }
    }

    /// True if a measured value disagrees with the prediction.
    pub fn fails(&self) -> bool {
        self.outcome == Agreement::Disagrees
    }
}

/// Coverage of the predicted orders by measured slopes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Measured {
    /// Number of orders that were measured by a slope.
    pub measured: usize,
    /// Number of unknowns and combinations that have an order.
    pub of: usize,
}

impl Measured {
    /// Counts over slopes; the flag is true where the verdict has an order.
    pub(crate) fn count<'a>(slopes: impl Iterator<Item = (&'a Check, bool)>) -> Self {
        let said: Vec<&Check> = slopes.filter(|(_, said)| *said).map(|(slope, _)| slope).collect();
        Self { measured: said.iter().filter(|c| c.outcome.is_resolved()).count(), of: said.len() }
    }
}

/// Evidence on one unknown or combination.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct QuantityEvidence {
    /// Name of the unknown, or the combination.
    pub name: String,
    /// Verdict: observable, inseparable or not excited.
    pub status: Status,
    /// Observable degree; null if not observable.
    pub degree: Option<usize>,
    /// Accuracy order; null if no dwell makes it observable, or if none were computed.
    pub accuracy_order: Option<usize>,
    /// True if the filter contains the unknown. A filter with a deliberate error may lack it; then nothing is
    /// measured.
    pub modelled: bool,
    /// Evidence a: log-log slope of sigma against the dwell, with psi of the start of each position handed on
    /// to the next. Predicted -(degree + 1/2); 0 if nothing is learnt.
    pub degree_slope: Check,
    /// Evidence a: status by the same information, from the column of the unknown and the span of the rows;
    /// null if it was not measured.
    pub status_measured: Option<Status>,
    /// Outcome of the comparison with the verdict.
    pub status_outcome: Agreement,
    /// Unknowns indistinguishable from it by derivatives; null for a combination.
    pub partners: Option<Partners>,
    /// Evidence a: log-log slope of sigma (psi: of the start) against the dwell. Predicted -(accuracy order +
    /// 1/2); 0 if nothing is learnt.
    pub slope: Check,
    /// Log-log slope of sigma with psi of the end, as in a filter.
    pub slope_at_end: Check,
    /// Evidence b: factor on sigma (psi: of the end) when the prior variance is multiplied by 100.
    pub inflation: Check,
}

/// Unknowns indistinguishable from one: those in a common direction of minimal support that Z does not
/// observe.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Partners {
    /// Partners by the exact verdicts.
    pub predicted: Vec<String>,
    /// Partners by the directions that the samples do not show; null if they were not measured.
    pub measured: Option<Vec<String>>,
    /// Outcome of the comparison of both lists.
    pub outcome: Agreement,
}

/// Evidence on one null vector.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NullEvidence {
    /// Null vector, as in `psi_y = 1, D_FZ = 6.4e-5`, in SI units.
    pub direction: String,
    /// Effect of the null vector on Z, relative to the most observable direction: predicted 0.
    pub seen: Check,
    /// Smallest correlation of its unknowns under a diffuse prior, signed by the prediction: predicted 1;
    /// null if other null vectors share its unknowns, or if it has only one.
    pub correlation: Option<Check>,
}

/// Count that was predicted and measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Count {
    /// Number that the exact verdicts predict.
    pub predicted: usize,
    /// Number that the samples show.
    pub measured: usize,
    /// Outcome of the comparison of both numbers.
    pub outcome: Agreement,
}

/// Largest difference of two covariances.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Difference")]
pub struct CovarianceDifference {
    /// Covariances or models that are compared.
    pub name: String,
    /// Largest relative difference, dimensionless: `max |P_ij - Q_ij| / sqrt(Q_ii Q_jj)`.
    pub difference: f64,
    /// Largest difference allowed, dimensionless.
    pub limit: f64,
    /// Outcome: agreement within the limit. Not resolvable if rounding may reach a tenth of the limit:
    /// largest variance of the prior, over the smallest at the end, times steps times 2e-16.
    pub outcome: Agreement,
}

/// Averaged statistic with its acceptance bands.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Statistic {
    /// Name of the averaged statistic.
    pub name: String,
    /// Expectation of the average, dimensionless.
    pub expected: f64,
    /// Average over runs and samples, dimensionless.
    pub measured: f64,
    /// Band of 95 % of the average, dimensionless.
    pub band: Span<f64>,
    /// Acceptance band of 99.9 % of the average, dimensionless.
    pub wide_band: Span<f64>,
    /// True if `measured` lies inside its acceptance band.
    pub pass: bool,
}

/// Evidence d: statistics of Monte Carlo runs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct MonteCarlo {
    /// Filter of the runs: linear, extended or iterated.
    pub filter: FilterKind,
    /// True if all runs have the scheme's own truth and draw initial estimates about it from the prior. If
    /// false, truths are drawn about the initial estimate.
    pub about_the_truth: bool,
    /// Number of runs, each with its own noise.
    pub runs: usize,
    /// Number of runs whose linearisations did not converge.
    pub unsettled: usize,
    /// Average NEES and NIS, with their bands.
    pub statistics: Vec<Statistic>,
    /// Probability that white innovations have autocorrelations as large.
    pub whiteness_probability: f64,
    /// True if `whiteness_probability` is above 0.001.
    pub white: bool,
    /// Average NEES and mean NIS over time.
    pub history: Vec<HistoryPoint>,
}

/// Averages over the runs at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct HistoryPoint {
    /// Time since the start of the run, in s.
    pub t_s: f64,
    /// Average NEES of all unknowns, dimensionless.
    pub nees: f64,
    /// Mean NIS since the point before, dimensionless.
    pub nis: f64,
    /// Number of samples in the mean NIS, all runs together.
    pub samples: usize,
}

/// Rank correlation of all unknowns by predicted and measured orders.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Ranking {
    /// Kendall's tau-b of predicted and measured accuracy orders, dimensionless, -1 to 1; null if all are
    /// tied.
    pub kendall_tau: Option<f64>,
    /// True if `kendall_tau` is 1 (or all orders are tied on both sides).
    pub pass: bool,
    /// Kendall's tau-b, dimensionless, of the predicted orders at the end and the errors of runs with full
    /// attitudes, root mean square in sigmas of the prior; null for a linear filter. It decides nothing:
    /// orders hold for short dwells, errors for those of the scheme.
    pub errors: Option<f64>,
}

/// Filter with a deliberate model error, which the checks must detect.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Control {
    /// Deliberate error of the filter's model.
    pub name: String,
    /// Number of checks of evidence a and b that fail with the filter.
    pub failed: usize,
    /// Number of checks of evidence a and b performed.
    pub checks: usize,
    /// Mean NIS of the filter, dimensionless.
    pub nis: f64,
    /// Band of 99.9 % of the mean NIS of a right filter, dimensionless.
    pub band: Span<f64>,
    /// Angle in degrees by which the filter's latitude or attitude is wrong.
    pub off_deg: f64,
    /// Outcome: agreement if the error was detected. Not resolvable if it was not, and need not be.
    pub outcome: Agreement,
}

/// Sigma against the dwell, for one unknown or combination.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SlopeCurve {
    /// Name of the unknown, or the combination.
    pub name: String,
    /// Unit of the sigmas in `points`.
    pub unit: String,
    /// Accuracy order; null if no dwell makes it observable.
    pub accuracy_order: Option<usize>,
    /// Points of the curve: `(dwell in s, sigma)`, sigma in the unit of `unit`.
    pub points: Vec<SlopePoint>,
}

/// Point of a slope curve; in JSON `[dwell_s, sigma]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlopePoint {
    /// Dwell of every position, in s.
    pub dwell_s: f64,
    /// Standard deviation of the unknown, in the unit of its curve.
    pub sigma: f64,
}

json_list!(SlopePoint { dwell_s: f64, sigma: f64 });

/// Correlation matrix of the estimates.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Correlation {
    /// Names of the unknowns, in the order of rows and columns.
    pub names: Vec<String>,
    /// Rows of the matrix: correlations, dimensionless, -1 to 1.
    pub values: Vec<Vec<f64>>,
}
