//! What a calibration of a system says, and why there is none.

use obsdeg_core::degree::Status;
use obsdeg_core::system::ModelError;
use obsdeg_ekf::EkfError;
use schemars::JsonSchema;
use serde::Serialize;

use crate::answer::CovarianceTable;
use crate::record::{MOST, RecordError};
use crate::setup::Basis;

/// A calibration of a system.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemCalibration {
    /// `obsdeg.system-calibration/1`.
    pub schema: String,
    /// Version of the program.
    pub version: String,
    /// The system.
    pub name: String,
    /// Whether model and noise explain the data; null where the noise was estimated from what is left, which then decides nothing.
    pub consistent: Option<bool>,
    /// What speaks against it.
    pub findings: Vec<SystemFinding>,
    /// States at the start of every experiment, parameters, and what is unknown of inputs.
    pub quantities: Vec<SystemEstimated>,
    /// The combinations that the model asks for, and products and sums of what is not determined alone that it determines.
    pub combinations: Vec<SystemEstimated>,
    /// Of all unknowns that are determined.
    pub covariance: CovarianceTable,
    /// The sum of squares of all residuals, in sigma.
    pub chi_square: f64,
    /// Measurements minus what they determine.
    pub degrees_of_freedom: usize,
    /// Where chi-square per degree of freedom lies with a probability of 99.9 %.
    pub band: (f64, f64),
    /// The root of chi-square per degree of freedom.
    pub factor: f64,
    /// By output.
    pub outputs: Vec<OutputFit>,
    /// Other solutions that fit nearly as well, the best first: the values of the unknowns.
    pub others: Vec<OtherSolution>,
    /// Starts that were tried, and how many led to the solution.
    pub starts: (usize, usize),
    /// How many would have been tried at most: fewer are enough when no other solution is to be expected.
    pub starts_at_most: usize,
    /// Profiles that were asked for.
    pub profiles: Vec<Profile>,
    /// Rows of the record.
    pub samples: usize,
    /// Intervals at rest, where the file says how they are found.
    pub intervals: Option<usize>,
    /// Time of the record at which the model starts, in its unit; null where that is 0. A record that begins
    /// more than 100 times its own length after 0 starts with its first row.
    pub begins: Option<f64>,
    /// Rows that the model is held against: those of the record, or the intervals and what is between them.
    pub rows: usize,
    /// Columns that nothing was made of.
    pub ignored: Vec<String>,
    /// The digest of the model.
    pub model: String,
    /// The records that the estimates rest on, those of the calibration before too.
    pub rests_on: Vec<Basis>,
    /// Whether the calibration before rests on the same record, by another model.
    pub shared: bool,
    /// Steps of integration between two rows, at most.
    pub substeps: usize,
    /// Seed of starts and verdicts.
    pub seed: u64,
    /// Every measurement and what is left of it.
    #[serde(skip)]
    #[schemars(skip)]
    pub residuals: Vec<SystemResidual>,
}

/// What speaks against model or noise.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum SystemFinding {
    /// Interrupted: the estimates are where the best iteration was then.
    Interrupted,
    /// No start settled.
    NotSettled,
    /// Chi-square is outside its band.
    Noise {
        /// Per degree of freedom.
        chi_square: f64,
        /// What sigmas are to be multiplied by.
        factor: f64,
    },
    /// The residuals of an output are not independent of each other.
    Correlated {
        /// The output.
        output: String,
        /// Probability that independent ones are correlated so.
        probability: f64,
    },
    /// A measurement is far off.
    Outlier {
        /// The output.
        output: String,
        /// Its line in the record.
        line: u64,
        /// By how much the others leave it off, in sigma as these have it (at least as it was given).
        sigmas: f64,
    },
}

/// An unknown or a combination.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemEstimated {
    /// Its name.
    pub name: String,
    /// Its unit, as the file says.
    pub unit: String,
    /// The exact verdict; null for what is known.
    pub status: Option<Status>,
    /// The degree.
    pub degree: Option<usize>,
    /// Whether model and data determine it.
    pub determined: bool,
    /// The estimate.
    pub estimate: Option<f64>,
    /// Its standard deviation by the noise.
    pub sigma: Option<f64>,
    /// The same with errors of the data times the root of chi-square per degree of freedom, where that is above one; what was known before stays as it is.
    pub sigma_rescaled: Option<f64>,
}

/// How well an output fits.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct OutputFit {
    /// The output.
    pub output: String,
    /// Its measurements.
    pub measurements: usize,
    /// The noise of a measurement; null where every row has its own.
    pub sigma: Option<f64>,
    /// Whether it was estimated from what is left.
    pub estimated: bool,
    /// Chi-square per degree of freedom.
    pub chi_square: f64,
    /// Root of the mean square of what is left, in the unit of the output.
    pub rms: f64,
    /// The same of what sigmas let expect.
    pub expected_rms: f64,
    /// Measurements minus what they determine.
    pub degrees_of_freedom: f64,
    /// Further off than this, in sigma as the others have it, a measurement is named; null where too few others are left to say.
    pub outlier_gate: Option<f64>,
    /// Probability that independent residuals are correlated as these are; null for few.
    pub whiteness_probability: Option<f64>,
}

/// Another solution.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct OtherSolution {
    /// Its sum of squares.
    pub chi_square: f64,
    /// How many starts led there.
    pub starts: usize,
    /// Values of the unknowns, in their order.
    pub values: Vec<f64>,
}

/// What the data say of one unknown when all others follow.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Profile {
    /// The unknown.
    pub name: String,
    /// Its values, and by how much the sum of squares is larger there than at the solution.
    pub points: Vec<(f64, f64)>,
    /// Whether it is flat: no value changes the sum of squares by more than a hundredth of one.
    pub flat: bool,
}

/// A measurement and what is left of it.
#[derive(Debug, Clone, PartialEq)]
pub struct SystemResidual {
    /// The output, from 0.
    pub output: usize,
    /// The experiment, from 0.
    pub experiment: usize,
    /// The line.
    pub line: u64,
    /// The time.
    pub t: f64,
    /// What was measured.
    pub measured: f64,
    /// Measurement minus estimate.
    pub residual: f64,
    /// Its sigma.
    pub sigma: f64,
    /// What the others leave of it, in sigma.
    pub normalised: f64,
}

/// Why a system cannot be calibrated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SystemCalibrationError {
    /// The model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The record.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// What records of some kinds cannot have.
    #[error("a model with {what} cannot be calibrated yet; expected one without")]
    NotYet {
        /// What it has.
        what: &'static str,
    },
    /// Too many columns.
    #[error("{found} columns are needed; expected at most {MOST}")]
    TooMany {
        /// How many.
        found: usize,
    },
    /// Times that take too long to follow.
    #[error(
        "{record}: its times, up to {last}, take {found} steps of integration of at most {longest}; expected at most {most}: times in the unit of the model that begin at its start, or a longer `step` under [simulation]"
    )]
    TooLong {
        /// The record.
        record: String,
        /// The last time.
        last: f64,
        /// How many steps they take.
        found: f64,
        /// The longest step.
        longest: f64,
        /// How many there may be.
        most: f64,
    },
    /// Rows that the model cannot have.
    #[error("{record}: line {line}, column `{column}`: found {found}, expected {expected}")]
    Value {
        /// The record.
        record: String,
        /// The line.
        line: u64,
        /// The column.
        column: String,
        /// What there is.
        found: String,
        /// Changes that would meet every requirement.
        expected: String,
    },
    /// Less data than unknowns.
    #[error("{found} measurements of {unknowns} unknowns that the model determines; expected more")]
    TooFew {
        /// Measurements.
        found: usize,
        /// Unknowns.
        unknowns: usize,
    },
    /// Interrupted before there was anything.
    #[error("interrupted before anything was estimated")]
    Interrupted,
    /// A record that counts already.
    #[error(
        "{record} has the same numbers as {other}; expected another record, since what is the same says nothing twice"
    )]
    SameRecord {
        /// The record.
        record: String,
        /// The one that it is.
        other: String,
    },
    /// A calibration of another system.
    #[error("the prior calibration says nothing of this model: it has {found}")]
    Prior {
        /// What it has.
        found: String,
    },
    /// A calibration of a system with constraints, for one without.
    #[error(
        "the prior calibration knows {found} as constraints make them, which the model has not; expected the same `constraints`"
    )]
    PriorHeld {
        /// What it has of the unknowns of the model.
        found: String,
    },
    /// Constraints that cannot be met.
    #[error(
        "the constraint {constraint} does not hold anywhere near one of {starts} starts; expected constraints that hold at once, and values under [simulation.values] near the solution"
    )]
    Unheld {
        /// How many were tried.
        starts: usize,
        /// The first that does not.
        constraint: String,
    },
    /// A constraint that says nothing where it holds.
    #[error(
        "the constraint {constraint} has no slope at the solution, as a square has none where it is zero; expected one that changes with the unknowns in it"
    )]
    Flat {
        /// The constraint.
        constraint: String,
    },
    /// Nothing to learn from intervals at rest.
    #[error(
        "{record}: {found} intervals at rest; expected two at least (record.static says how they are found)"
    )]
    NoRest {
        /// The record.
        record: String,
        /// How many there are.
        found: usize,
    },
    /// Nowhere a number.
    #[error(
        "from none of {starts} starts does the model give numbers at all rows: {reason}; expected values under [simulation.values] near the solution"
    )]
    Nowhere {
        /// How many were tried.
        starts: usize,
        /// What the first said.
        reason: EkfError,
    },
    /// A profile of nothing.
    #[error("no unknown is called `{found}`; expected one of {expected}")]
    NoUnknown {
        /// The name.
        found: String,
        /// Those that there are.
        expected: String,
    },
}
