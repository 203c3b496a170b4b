//! Calibration of a torquing scheme from the records of its runs.

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
mod posterior;
mod reading;
mod residuals;
mod run;
mod shooting;
mod successions;
mod suspects;
mod timeline;

use std::cell::Cell;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::settings::concerns;
use obsdeg_core::model::{Scheme, SchemeError};
use obsdeg_ekf::EkfError;
use obsdeg_ekf::consistency::chi_square_quantile;
use obsdeg_evidence::simulation::{
    Conditions, Plan, PlatformState, RunStart, SimulationError, predict, si_per_shown,
};

use crate::Going;
use crate::answer::{Before, Calibration, CovarianceTable};
pub use crate::record::STANDARD_GRAVITY;
use crate::record::{Record, RecordError};
use crate::setup::{Basis, Setup};
use diagnose::Diagnosed;
use estimate::{Problem, Unknowns};
use observe::Reading;
use offset::Offset;
use run::Run;

pub use mistaken::Mistaken;
pub(crate) use observe::TIMES;
pub use reading::{CellRead, ColumnRead, PositionRead, RecordRead, RecordsRead, read_records};

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
/// Most rounds of leaving out outliers, or of estimating the noise.
const ROUNDS: usize = 6;
/// Largest fraction of all measurements that may be outliers.
const MOST_OUTLIERS: f64 = 0.02;

/// Checks that records of this scheme are supported: positions at rest, at least one record.
fn concern(scheme: &Scheme, records: &[Record]) -> Result<(), CalibrationError> {
    if let Some(p) = scheme.positions.iter().find(|p| p.rotation.is_some()) {
        return Err(CalibrationError::Rotates { position: p.name.clone() });
    }
    if records.is_empty() { Err(CalibrationError::NoRecord) } else { Ok(()) }
}

/// Calibrates `scheme` from records of its runs. `conditions` give noise, steps (the length of bins) and
/// slews. The progress callback `going` can stop the work: while a record is read there is then no answer,
/// later the answer is the current iterate, with a finding.
///
/// # Errors
/// [`CalibrationError`].
pub fn calibrate(
    scheme: &Scheme,
    conditions: &Conditions,
    records: Vec<Record>,
    options: &Options,
    going: &dyn Fn(Going<'_>) -> bool,
) -> Result<Calibration, CalibrationError> {
    concern(scheme, &records)?;
    let own = run::conditions(conditions);
    let planned = Plan::new(scheme, &own)?;
    let mut sigmas: Vec<f64> = planned.components.iter().map(|&c| Plan::output_sigma(c, &own)).collect();
    let mut runs = Vec::with_capacity(records.len());
    let before = options.prior.as_ref();
    if before.is_some_and(|b| b.of.geometry != scheme.geometry) {
        return Err(CalibrationError::OtherPlatform {
            what: "another mounting of the sensors (geometry)".into(),
        });
    }
    let mut rests_on: Vec<Basis> = Vec::new();
    for record in records {
        let reading = observe::observe(
            record,
            &planned,
            options.gravity_m_s2,
            conditions.step_s,
            sigmas.clone(),
            going,
        )?;
        let basis = Basis { record: reading.name.clone(), digest: reading.digest.clone() };
        let same = |other: String| CalibrationError::SameRecord { record: basis.record.clone(), other };
        if let Some(other) = basis.among(&rests_on) {
            return Err(same(other.record.clone()));
        }
        if let Some(other) = before.and_then(|b| basis.among(&b.rests_on)) {
            return Err(same(format!("{}, which the calibration before rests on", other.record)));
        }
        rests_on.push(basis);
        runs.push(Run::new(reading, scheme, &planned, &own)?);
    }
    rests_on.extend(before.iter().flat_map(|b| b.rests_on.iter().cloned()));
    let prediction = predict(&planned, options.seed)?;
    let start = RunStart::new(&planned, &own)?;
    let (n, coefficients, biases) =
        (planned.unknowns(), planned.platform.coefficients(), planned.biases.len());
    // priors that a prior calibration already includes do not count again
    let held =
        |name: &String| before.is_some_and(|b| b.priors.contains(name) && b.estimates.names.contains(name));
    let counts = |name: &String| own.stated_priors().iter().any(|a| concerns(&a.name, name)) && !held(name);
    let stated: Vec<bool> =
        planned.platform.names().iter().map(counts).chain(std::iter::repeat_n(false, biases)).collect();
    let mut unknowns = Unknowns::new(
        runs.len(),
        [n - coefficients, coefficients, biases],
        &start.sigma,
        &start.estimate,
        &prediction.null_space,
        &stated,
    );
    let known = before.map(|b| known(&b.estimates, &planned, &prediction, &unknowns)).transpose()?;
    let (known, known_names) = known.map_or((None, Vec::new()), |(k, names)| (Some(k), names));
    let mut prior = unknowns.stated_rows();
    if let Some((rows, _)) = &known {
        let above = prior.nrows();
        prior = prior.resize_vertically(above + rows.nrows(), 0.0);
        prior.rows_mut(above, rows.nrows()).copy_from(rows);
    }
    unknowns.determined_by(&prior);
    let mut x: Vec<PlatformState> =
        runs.iter().map(|_| PlatformState::of_unknowns(&start.estimate, planned.constants())).collect();
    let first = x.clone();
    let (mut round, mut passes, mut too_many) = (0, 0, None);
    let lay = |reading: Reading| Run::new(reading, scheme, &planned, &own);
    let mut rivals = 0;
    let (mut beginnings, mut elsewhere, mut offsets) = (0, false, vec![None; runs.len()]);
    loop {
        round += 1;
        let problem = Problem {
            conditions: &own,
            runs: &runs,
            unknowns: &unknowns,
            sigmas: sigmas.clone(),
            known: known.clone(),
            going,
            passes: Cell::new(passes),
            stopped: Cell::new(false),
        };
        let mut estimate = problem.estimate(x, round == 1)?;
        if round == 1 {
            rivals = estimate.rivals;
        }
        estimate.rivals = rivals;
        if beginnings < ROUNDS && !problem.stopped.get() {
            beginnings += 1;
            offsets = problem.open(&estimate, &lay)?;
            passes = problem.passes.get();
            if offsets.iter().flatten().any(|o: &Offset| o.by.abs() > offset::SETTLED * o.sigma) {
                for (run, o) in runs.iter_mut().zip(&offsets) {
                    if let Some(o) = o {
                        let counts = std::mem::take(&mut run.counts);
                        *run = lay(run.reading.later(o.by))?;
                        run.counts = counts;
                    }
                }
                (x, round) = (estimate.at.x, 0);
                continue;
            }
        }
        let found = Diagnosed::of(&problem, &estimate, &prediction)?;
        passes = problem.passes.get();
        let interrupted = problem.stopped.get();
        let last = round == ROUNDS || interrupted;
        // noise first: a gate needs it
        let rescaled = options.estimate_noise.then(|| found.channel_factors(sigmas.len()));
        let settled = rescaled.as_ref().is_none_or(|f| f.iter().all(|f| (f - 1.0).abs() < 1e-3));
        let off = found.beyond(gate(options.gate, found.all.len()));
        let many = off.len() as f64 > MOST_OUTLIERS * found.all.len() as f64;
        if many {
            too_many = Some(off.len());
        }
        let leave_out = !off.is_empty() && !many;
        if !last && settled && !leave_out && !elsewhere {
            elsewhere = true;
            let begins = |r: usize| problem.begins_elsewhere(&estimate, r, &lay);
            let found = (0..runs.len()).map(begins).collect::<Result<Vec<bool>, _>>()?;
            if found.contains(&true) {
                for (run, found) in runs.iter_mut().zip(found) {
                    let (at, interval) = (run.reading.origin, run.reading.interval);
                    run.reading.open = found.then_some((at - interval, at + interval)).or(run.reading.open);
                }
                (x, beginnings) = (estimate.at.x, 0);
                continue;
            }
        }
        if last || (settled && !leave_out) {
            let linear = estimate.solution.clone();
            let bent = problem.bent(&estimate, options.seed)?;
            if let Some((_, root)) = &bent.found {
                estimate.solution.inverse_root.clone_from(root);
            }
            for o in offsets.iter().flatten() {
                let root = &mut estimate.solution.inverse_root;
                let columns = root.ncols();
                *root = std::mem::take(root).insert_column(columns, 0.0);
                root.set_column(columns, &(&o.direction * o.sigma));
            }
            let later = problem.later(&estimate, &lay)?;
            let jump = problem.jump(&estimate, &first, &lay)?;
            let parts = diagnose::Parts {
                scheme,
                conditions,
                options,
                planned: &planned,
                prediction: &prediction,
                problem: &problem,
                estimate: &estimate,
                linear: &linear,
                bent: &bent,
                found: &found,
                offsets: &offsets,
                later: &later,
                jump,
                too_many: too_many.filter(|_| many),
                known: known_names,
                rests_on,
                interrupted: problem.stopped.get(),
            };
            return parts.answer();
        }
        let next = estimate.at.x.clone();
        if let Some(factors) = rescaled {
            sigmas.iter_mut().zip(factors).for_each(|(s, f)| *s *= f);
        }
        if leave_out {
            for (run, key) in off {
                runs[run].counts[key.bin][key.channel] = false;
            }
        }
        x = next;
    }
}

/// Distance, in standard deviations, beyond which a measurement out of `of` is left out.
fn gate(probability: f64, of: usize) -> f64 {
    if probability >= 1.0 {
        return f64::INFINITY;
    }
    chi_square_quantile(1.0, 1.0 - (1.0 - probability) / of.max(1) as f64).sqrt()
}

/// Prior information on the coefficients and their combinations: rows with unit errors, and names.
type Known = ((DMatrix<f64>, DVector<f64>), Vec<String>);

fn known(
    table: &CovarianceTable,
    plan: &Plan,
    prediction: &obsdeg_evidence::prediction::Prediction,
    unknowns: &Unknowns,
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
    Ok(((solve(rows)?, values), found.iter().map(|(k, _)| table.names[*k].clone()).collect()))
}
