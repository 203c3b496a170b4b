//! Answer of a calibration of a system, and the reasons why there is none.

use obsdeg_core::degree::Status;
use obsdeg_core::json_list;
use obsdeg_core::span::Span;
use obsdeg_core::system::ModelError;
use obsdeg_ekf::EkfError;
use schemars::JsonSchema;
use serde::Serialize;

use crate::answer::CovarianceTable;
use crate::record::{MOST, RecordError};
use crate::setup::SourceRecord;

/// Calibration of a system from one record.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemCalibration {
    /// Layout of this answer: `obsdeg.system-calibration/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Name of the system, as in its file.
    pub name: String,
    /// True if model and noise explain the data; null if the noise was estimated from the residuals, which
    /// then decide nothing.
    pub consistent: Option<bool>,
    /// Evidence against the model or the noise; empty if there is none.
    pub findings: Vec<SystemFinding>,
    /// Estimates of states at the start of every experiment, parameters, and unknowns of inputs.
    pub quantities: Vec<SystemEstimated>,
    /// Estimates of combinations that the model asks for, and of products and sums that are determined though
    /// their unknowns alone are not.
    pub combinations: Vec<SystemEstimated>,
    /// Covariance of all unknowns that are determined.
    pub covariance: CovarianceTable,
    /// Chi-square: the sum of squares of all residuals in sigma, dimensionless.
    pub chi_square: f64,
    /// Number of degrees of freedom: measurements minus determined unknowns.
    pub degrees_of_freedom: usize,
    /// Acceptance band of 99.9 % of chi-square per degree of freedom, dimensionless.
    pub band: Span<f64>,
    /// Root of chi-square per degree of freedom, dimensionless; 1 is expected.
    pub factor: f64,
    /// Quality of the fit of each output.
    pub outputs: Vec<OutputFit>,
    /// Other solutions that fit nearly as well, the best first: the values of the unknowns.
    pub others: Vec<OtherSolution>,
    /// Number of starts that were tried, then the number that led to the solution.
    pub starts: TriedStarts,
    /// Ends of the starts that did not lead to the solution.
    pub other_starts: OtherStarts,
    /// Largest number of starts; fewer are enough when no other solution is to be expected.
    pub starts_at_most: usize,
    /// Profiles of the unknowns that were asked for.
    pub profiles: Vec<Profile>,
    /// Number of rows of the record.
    pub samples: usize,
    /// Number of intervals at rest; null if the file does not ask for them.
    pub intervals: Option<usize>,
    /// Time of the record at which the states start (those of the first experiment), in the unit of the
    /// model; null where that is 0.
    pub begins: Option<f64>,
    /// Rule of the start of the states.
    pub states_start: StatesStart,
    /// Time from the start of the states to the first row, in the unit of the model, where it is longer than
    /// the record; null elsewhere.
    pub before_first_row: Option<f64>,
    /// Number of rows that the model is fitted to: those of the record, or the intervals and the runs between
    /// them.
    pub rows: usize,
    /// Columns that are not used.
    pub ignored: Vec<String>,
    /// Digest of the model, to recognise it.
    pub model: String,
    /// Records that the estimates rest on, including those of the calibration before.
    pub rests_on: Vec<SourceRecord>,
    /// True if the calibration before rests on the same record, by another model.
    pub shared: bool,
    /// Largest number of integration steps between two rows.
    pub substeps: usize,
    /// Seed of starts and verdicts.
    pub seed: u64,
    /// Every measurement and what is left of it.
    #[serde(skip)]
    #[schemars(skip)]
    pub residuals: Vec<SystemResidual>,
}

/// Evidence against the model or the noise.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum SystemFinding {
    /// Interrupted iteration: the estimates are where the best one was then.
    Interrupted,
    /// Iteration that did not converge from any start.
    NotSettled,
    /// Chi-square that is outside its acceptance band.
    Noise {
        /// Chi-square per degree of freedom, dimensionless; 1 is expected.
        chi_square: f64,
        /// Factor to multiply the sigmas by, dimensionless.
        factor: f64,
    },
    /// Residuals of an output that are not independent of each other.
    Correlated {
        /// Name of the output with this finding.
        output: String,
        /// Probability that independent residuals are as correlated as these.
        probability: f64,
    },
    /// Measurement that is far from its expected value.
    Outlier {
        /// Name of the output with this finding.
        output: String,
        /// Line number of the measurement in the record.
        line: u64,
        /// Residual in sigma by the other measurements (at least the given sigma), dimensionless.
        sigmas: f64,
    },
}

/// Estimate of an unknown or a combination.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemEstimated {
    /// Name of the unknown, or the combination.
    pub name: String,
    /// Unit of the estimate, as in the model file.
    pub unit: String,
    /// Verdict on the unknown or combination; null if it is known.
    pub status: Option<Status>,
    /// Observable degree; null if not observable.
    pub degree: Option<usize>,
    /// True if model and data determine it.
    pub determined: bool,
    /// Estimate in the unit of `unit`; null if not determined.
    pub estimate: Option<f64>,
    /// Standard deviation of the estimate by the noise, in the unit of `unit`; null if not determined.
    pub sigma: Option<f64>,
    /// Standard deviation, in the unit of `unit`, with errors of the data times the root of chi-square per
    /// degree of freedom, where that is above one; prior knowledge stays as it is. Null if not determined.
    pub sigma_rescaled: Option<f64>,
}

/// Quality of the fit of one output.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct OutputFit {
    /// Name of the output in the model.
    pub output: String,
    /// Number of measurements of the output.
    pub measurements: usize,
    /// Standard deviation of the noise of a measurement, in the unit of the output; null if rows have
    /// different ones.
    pub sigma: Option<f64>,
    /// True if the noise was estimated from the residuals.
    pub estimated: bool,
    /// Chi-square per degree of freedom, dimensionless; 1 is expected.
    pub chi_square: f64,
    /// Root mean square of the residuals, in the unit of the output.
    pub rms: f64,
    /// Root mean square of the residuals that the sigmas predict, in the unit of the output.
    pub expected_rms: f64,
    /// Number of degrees of freedom: measurements minus the unknowns that they determine; fractions occur.
    pub degrees_of_freedom: f64,
    /// Residual in sigma by the other measurements (dimensionless) above which a measurement is an outlier;
    /// null if there are too few others.
    pub outlier_gate: Option<f64>,
    /// Probability that independent residuals are as correlated as these; null for few.
    pub whiteness_probability: Option<f64>,
}

/// Rule of the start of the states.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StatesStart {
    /// Time at which the model lets a run begin (`time` in its file; 0 without it).
    Model,
    /// First row of every experiment, as the model asks for (`time = "generic"`).
    Rows,
    /// First row of every experiment, since the record begins long after 0 and the model states no time: more
    /// than the length of an experiment where no start is known, more than 100 times the length of every
    /// experiment where a start or a constraint is known and no function depends on the time.
    FarRows,
}

/// Ends of the starts that did not lead to the solution. The numbers and that of the starts that led there
/// add up to the number of starts.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct OtherStarts {
    /// Number of starts that led to other solutions that fit nearly as well.
    pub near: usize,
    /// Number of starts that ended at a minimum with a larger chi-square.
    pub higher: usize,
    /// Least chi-square of those minima, dimensionless; null if there are none.
    pub least_higher_chi_square: Option<f64>,
    /// Number of starts whose iteration did not settle.
    pub unsettled: usize,
    /// Number of starts from which the model gives no numbers.
    pub failed: usize,
}

/// Other solution that fits nearly as well.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct OtherSolution {
    /// Sum of squares of all residuals in sigma, dimensionless.
    pub chi_square: f64,
    /// Number of starts that led to this solution.
    pub starts: usize,
    /// Values of the unknowns, in their order and units.
    pub values: Vec<f64>,
}

/// Profile of one unknown: the fit as a function of its value when all others follow.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Profile {
    /// Name of the unknown that is fixed.
    pub name: String,
    /// Value of the unknown, in its unit, and the sum of squares there minus that at the solution,
    /// dimensionless.
    pub points: Vec<ProfilePoint>,
    /// True if the profile is flat: no value changes the sum of squares by more than 0.01.
    pub flat: bool,
}

/// Point of a profile; in JSON `[value, rise]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfilePoint {
    /// Value of the unknown, in its unit.
    pub value: f64,
    /// Sum of squares there minus that at the solution, dimensionless.
    pub rise: f64,
}

json_list!(ProfilePoint { value: f64, rise: f64 });

/// Number of starts of a search; in JSON `[tried, led]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TriedStarts {
    /// Number of starts that were tried.
    pub tried: usize,
    /// Number of these that led to the solution.
    pub led: usize,
}

json_list!(TriedStarts { tried: usize, led: usize });

/// Residual of one measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct SystemResidual {
    /// Index of the output, from 0.
    pub output: usize,
    /// Index of the experiment, from 0.
    pub experiment: usize,
    /// Line of the record.
    pub line: u64,
    /// Time of the measurement, in the unit of the model.
    pub t: f64,
    /// Measured value.
    pub measured: f64,
    /// Measurement minus estimate.
    pub residual: f64,
    /// Standard deviation of the measurement.
    pub sigma: f64,
    /// Difference from the value that all other measurements predict, in sigma.
    pub normalised: f64,
}

/// Reason why a system cannot be calibrated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SystemCalibrationError {
    /// Error of the model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Error of the record.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A property of the model that calibrations do not support.
    #[error("a model with {what} cannot be calibrated yet; expected one without")]
    NotYet {
        /// Name of the property.
        what: &'static str,
    },
    /// Too many columns.
    #[error("{found} columns are needed; expected at most {MOST}")]
    TooMany {
        /// Number of columns.
        found: usize,
    },
    /// The times need too many integration steps.
    #[error(
        "{record}: its times, up to {last} after the start of the states, take {found} steps of integration of at \
         most {longest}; expected at most {most}: times in the unit of the model that begin at its start (`time` in \
         the file sets it), or a longer `step` under [simulation]"
    )]
    TooLong {
        /// Name of the record.
        record: String,
        /// Last time, from the start of the states.
        last: f64,
        /// Number of steps that the times need.
        found: f64,
        /// Longest step.
        longest: f64,
        /// Largest number of steps allowed.
        most: f64,
    },
    /// A value that the model excludes.
    #[error("{record}: line {line}, column `{column}`: found {found}, expected {expected}")]
    Value {
        /// Name of the record.
        record: String,
        /// Line of the record.
        line: u64,
        /// Name of the column.
        column: String,
        /// Value that was found.
        found: String,
        /// Expected values.
        expected: String,
    },
    /// Fewer measurements than unknowns.
    #[error("{found} measurements of {unknowns} unknowns that the model determines; expected more")]
    TooFew {
        /// Number of measurements.
        found: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// The caller stopped the work before there was an estimate.
    #[error("interrupted before anything was estimated")]
    Interrupted,
    /// A record counts already.
    #[error(
        "{record} has the same numbers as {other}; expected another record, since what is the same says nothing twice"
    )]
    SameRecord {
        /// Name of the record.
        record: String,
        /// Name of the equal record.
        other: String,
    },
    /// A prior calibration of another system.
    #[error("the prior calibration says nothing of this model: it has {found}")]
    Prior {
        /// Unknowns of the prior calibration.
        found: String,
    },
    /// A prior calibration with constraints, for a model without them.
    #[error(
        "the prior calibration knows {found} as constraints make them, which the model has not; expected the \
         same `constraints`"
    )]
    PriorConstrained {
        /// Unknowns of the model that the prior calibration constrains.
        found: String,
    },
    /// Constraints that cannot be met.
    #[error(
        "the constraint {constraint} does not hold anywhere near one of {starts} starts; expected \
         constraints that hold at once, and values under [simulation.values] near the solution"
    )]
    ConstraintUnmet {
        /// Number of starts that were tried.
        starts: usize,
        /// First constraint that does not hold.
        constraint: String,
    },
    /// A constraint without slope at the solution.
    #[error(
        "the constraint {constraint} has no slope at the solution, as a square has none where it is zero; \
         expected one that changes with the unknowns in it"
    )]
    Flat {
        /// Name of the constraint.
        constraint: String,
    },
    /// Too few intervals at rest.
    #[error(
        "{record}: {found} intervals at rest; expected two at least (record.static says how they are found)"
    )]
    NoRest {
        /// Name of the record.
        record: String,
        /// Number of intervals found.
        found: usize,
    },
    /// No start gives numbers at all rows.
    #[error(
        "from none of {starts} starts does the model give numbers at all rows: {reason}; expected values \
         under [simulation.values] near the solution"
    )]
    Nowhere {
        /// Number of starts that were tried.
        starts: usize,
        /// Error of the first start.
        reason: EkfError,
    },
    /// A profile of a name that is no unknown.
    #[error("no unknown is called `{found}`; expected one of {expected}")]
    NoUnknown {
        /// Name that was found.
        found: String,
        /// Names of the unknowns.
        expected: String,
    },
}
