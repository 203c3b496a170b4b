//! Calibration of a torquing scheme from the records of its runs.

mod assignment;
mod clock;
mod copies;
mod curvature;
mod diagnose;
mod earth;
mod estimate;
mod findings;
mod force;
mod goodness;
mod gross;
mod jump;
mod length;
mod minimum;
mod mistaken;
mod next;
mod observe;
mod offset;
mod placed;
mod posterior;
mod reading;
mod record_columns;
mod residuals;
mod rounds;
mod run;
mod shooting;
mod successions;
mod suspects;
mod timeline;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::{Scheme, SchemeError};
use obsdeg_core::span::Span;
use obsdeg_ekf::EkfError;
use obsdeg_evidence::simulation::{Conditions, Plan, RunStart, SimulationError, predict, si_per_shown};

use crate::CalibrationProgress;
use crate::answer::{Before, Calibration, CovarianceTable};
use crate::least_squares::PriorRows;
pub use crate::record::STANDARD_GRAVITY;
use crate::record::{Record, RecordError};
use crate::setup::Setup;
use estimate::RunUnknowns;
use rounds::{CalibrationInputs, RoundEnd, Rounds};

pub use mistaken::Mistaken;
pub use reading::{CellRead, PositionRead, RecordRead, RecordsRead, read_records};
pub(crate) use record_columns::TIMES;

/// Reason why a scheme cannot be calibrated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// Error of the record.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A label that is no position of the scheme.
    #[error("{record}: line {line}, column `position`: no position is called `{found}`; expected {expected}")]
    UnknownPosition {
        /// Name of the record.
        record: String,
        /// Line of the record.
        line: u64,
        /// Label that was found.
        found: String,
        /// Names of the positions of the scheme.
        expected: String,
    },
    /// Positions in another order than in the scheme.
    #[error("{record}: line {line}, column `position`: found `{found}`, expected {expected}")]
    Order {
        /// Name of the record.
        record: String,
        /// Line of the record.
        line: u64,
        /// Label that was found.
        found: String,
        /// Position that the scheme expects there.
        expected: String,
    },
    /// A position without samples.
    #[error("{record}: the position {position} of the scheme has no samples: {hint}")]
    NoSamples {
        /// Name of the record.
        record: String,
        /// Name of the position.
        position: String,
        /// Possible cause.
        hint: String,
    },
    /// A force in another direction than the scheme has.
    #[error(
        "{record}: line {line}: at {position} the specific force is {off_deg} deg from where the scheme has \
         it; it is that of {like}"
    )]
    Attitude {
        /// Name of the record.
        record: String,
        /// First line of the position.
        line: u64,
        /// Name of the position.
        position: String,
        /// Angle of the difference, in deg.
        off_deg: String,
        /// Positions that the force fits.
        like: String,
    },
    /// A record that contradicts itself.
    #[error(transparent)]
    Mistaken(Box<Mistaken>),
    /// Another number of intervals at rest than of positions.
    #[error(
        "{record}: {found} intervals at rest; expected {expected}, one for each position of the \
         scheme{spans} (record.static says how they are found; a column `position` says what is where)"
    )]
    Rests {
        /// Name of the record.
        record: String,
        /// Number of intervals found.
        found: usize,
        /// Number of positions.
        expected: usize,
        /// Times of the intervals.
        spans: String,
    },
    /// Gimbals at another attitude than the scheme has.
    #[error(
        "{record}: line {line}: at {position} the gimbals are {off_deg} deg from where the scheme has them"
    )]
    Gimbals {
        /// Name of the record.
        record: String,
        /// Line of the record.
        line: u64,
        /// Name of the position.
        position: String,
        /// Angle of the difference, in deg.
        off_deg: String,
    },
    /// A missing or invalid standard deviation.
    #[error(
        "{record}: line {line}: no standard deviation of {channel}; expected one above zero beside every value"
    )]
    Sigma {
        /// Name of the record.
        record: String,
        /// Line of the record.
        line: u64,
        /// Component of Z.
        channel: String,
    },
    /// A gap too short for the slew.
    #[error(
        "{record}: {gap_s:.3} s between the last sample before {position} and its first; the slew of the \
         scheme takes {slew_s:.3} s{clock}"
    )]
    Slew {
        /// Name of the record.
        record: String,
        /// Name of the position after the gap.
        position: String,
        /// Duration of the gap, in s.
        gap_s: f64,
        /// Duration of the slew, in s.
        slew_s: f64,
        /// Relation to the clock of the record, in words.
        clock: String,
    },
    /// Rotating segments, which are not supported.
    #[error(
        "a record of a rotating segment cannot be calibrated yet; expected positions at rest, found {position}"
    )]
    Rotates {
        /// Name of the segment.
        position: String,
    },
    /// The caller stopped the work before there was an estimate.
    #[error("interrupted before anything was estimated")]
    Interrupted,
    /// No unknown is determined.
    #[error(
        "nothing is determined by these records: no unknown and no combination; expected several measurements of \
         each position (samples within --step are one)"
    )]
    Nothing,
    /// No record was given.
    #[error("found no record; expected one of each run of the scheme, at least one")]
    NoRecord,
    /// A record that counts already.
    #[error(
        "{record} has the same numbers as {other}; expected records of different runs, since what is the \
         same says nothing twice"
    )]
    SameRecord {
        /// Name of the record.
        record: String,
        /// Name of the equal record.
        other: String,
    },
    /// A prior calibration of another platform.
    #[error("the prior calibration is of a platform with {what}; expected one of this platform")]
    OtherPlatform {
        /// Differences, in words.
        what: String,
    },
    /// A prior calibration without unknowns of this platform.
    #[error("the prior calibration says nothing of this scheme: it has {found}")]
    Prior {
        /// Unknowns of the prior calibration.
        found: String,
    },
    /// Error of the scheme or its conditions.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

impl From<Box<Mistaken>> for CalibrationError {
    fn from(e: Box<Mistaken>) -> Self {
        Self::Mistaken(e)
    }
}

impl From<EkfError> for CalibrationError {
    fn from(e: EkfError) -> Self {
        Self::Simulation(e.into())
    }
}

impl From<SchemeError> for CalibrationError {
    fn from(e: SchemeError) -> Self {
        Self::Simulation(e.into())
    }
}

/// Options of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Acceleration of 1 g, in m/s^2.
    pub gravity_m_s2: f64,
    /// True if the noise is estimated from the records.
    pub estimate_noise: bool,
    /// Probability that no measurement of a right record is left out as an outlier; 1 leaves none out.
    pub gate: f64,
    /// Prior calibration of the same platform.
    pub prior: Option<Before<Setup>>,
    /// Seed of the exact verdicts.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { gravity_m_s2: STANDARD_GRAVITY, estimate_noise: false, gate: 0.999, prior: None, seed: 1 }
    }
}

/// Probability with which what a right record leaves is below a bound that asks for a closer look.
const STRICT: f64 = 0.999;

/// Checks that records of this scheme are supported: positions at rest, at least one record.
fn concern(scheme: &Scheme, records: &[Record]) -> Result<(), CalibrationError> {
    if let Some(p) = scheme.positions.iter().find(|p| p.rotation.is_some()) {
        return Err(CalibrationError::Rotates { position: p.name.clone() });
    }
    if records.is_empty() { Err(CalibrationError::NoRecord) } else { Ok(()) }
}

/// Calibrates `scheme` from records of its runs. `conditions` give noise, steps (the length of bins) and
/// slews. The callback `progress` can stop the work: while a record is read there is then no answer, later
/// the answer is the current iterate, with a finding.
///
/// # Errors
/// [`CalibrationError`].
pub fn calibrate(
    scheme: &Scheme,
    conditions: &Conditions,
    records: Vec<Record>,
    options: &Options,
    progress: &dyn Fn(CalibrationProgress<'_>) -> bool,
) -> Result<Calibration, CalibrationError> {
    concern(scheme, &records)?;
    let own = run::conditions(conditions);
    let planned = Plan::new(scheme, &own)?;
    let sigmas: Vec<f64> = planned.components.iter().map(|&c| Plan::output_sigma(c, &own)).collect();
    if options.prior.as_ref().is_some_and(|b| b.of.geometry != scheme.geometry) {
        return Err(CalibrationError::OtherPlatform {
            what: "another mounting of the sensors (geometry)".into(),
        });
    }
    let inputs = CalibrationInputs { scheme, conditions, own: &own, planned: &planned, options, progress };
    let (mut runs, rests_on) = inputs.runs(records, &sigmas)?;
    let prediction = predict(&planned, options.seed)?;
    let start = RunStart::new(&planned, &own)?;
    let known = inputs.unknowns(runs.len(), &start, &prediction)?;
    let mut rounds = Rounds::new(&inputs, (&start, &prediction), &known, sigmas, runs.len());
    loop {
        let problem = rounds.problem(&runs);
        match rounds.round(&problem)? {
            RoundEnd::Later => rounds.shift(&mut runs)?,
            RoundEnd::Open(found) => {
                for (run, found) in runs.iter_mut().zip(found) {
                    let (at, interval) = (run.reading.origin, run.reading.interval);
                    let window = Span { from: at - interval, to: at + interval };
                    run.reading.open = found.then_some(window).or(run.reading.open);
                }
            }
            RoundEnd::LeftOut(off) => {
                for (run, key) in off {
                    runs[run].counts[key.bin][key.channel] = false;
                }
            }
            RoundEnd::Last(last) => return rounds.answer(&problem, *last, rests_on),
        }
    }
}

/// Prior information on the coefficients and their combinations: rows with unit errors, and names.
type Known = (PriorRows, Vec<String>);

fn known(
    table: &CovarianceTable,
    plan: &Plan,
    prediction: &obsdeg_evidence::prediction::Prediction,
    unknowns: &RunUnknowns,
) -> Result<Known, CalibrationError> {
    let (names, units) = (plan.platform.names(), plan.platform.units());
    let psi = plan.unknowns() - plan.platform.coefficients();
    let functional = |name: &String| -> Option<(Vec<(usize, f64)>, f64)> {
        let single = names.iter().position(|n| n == name).map(|i| vec![(i, 1.0)]);
        let of = |c: &obsdeg_evidence::prediction::PredictedCombination| c.expression == *name;
        let terms =
            single.or_else(|| prediction.combinations.iter().find(|c| of(c)).map(|c| c.terms.clone()))?;
        // psi belongs to another run
        let scale = si_per_shown(units[terms[0].0]);
        terms.iter().all(|(i, _)| *i >= psi).then_some((terms, scale))
    };
    let n = table.names.len();
    let shapes = table.estimates.len() == n
        && table.covariance.len() == n
        && table.covariance.iter().all(|row| row.len() == n);
    let found: Vec<_> = (0..n).filter_map(|k| Some((k, functional(&table.names[k])?))).collect();
    let nothing = || CalibrationError::Prior { found: table.names.join(", ") };
    if found.is_empty() || !shapes {
        return Err(nothing());
    }
    let m = found.len();
    let covariance = DMatrix::from_fn(m, m, |i, j| {
        let ((a, (_, s)), (b, (_, t))) = (&found[i], &found[j]);
        table.covariance[*a][*b] * s * t
    });
    let root = nalgebra::Cholesky::new(covariance).ok_or_else(nothing)?.l();
    let mut rows = DMatrix::zeros(m, unknowns.n);
    let mut values = DVector::zeros(m);
    for (i, (k, (terms, scale))) in found.iter().enumerate() {
        terms.iter().for_each(|&(s, c)| rows[(i, unknowns.index[0][s])] += c);
        values[i] = table.estimates[*k] * scale;
    }
    let solve = |b: DMatrix<f64>| root.solve_lower_triangular(&b).ok_or_else(nothing);
    let values = solve(DMatrix::from_column_slice(m, 1, values.as_slice()))?.column(0).into_owned();
    let prior = PriorRows { rows: solve(rows)?, values };
    Ok((prior, found.iter().map(|(k, _)| table.names[*k].clone()).collect()))
}
