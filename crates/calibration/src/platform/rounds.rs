//! Rounds of a calibration: estimates, between which the beginnings of the runs, the noise and the outliers
//! are settled.

use std::cell::Cell;

use obsdeg_core::model::Scheme;
use obsdeg_core::model::settings::concerns;
use obsdeg_ekf::consistency::chi_square_quantile;
use obsdeg_evidence::prediction::Prediction;
use obsdeg_evidence::simulation::{Conditions, Plan, PlatformState, RunStart};

use super::diagnose::data::AnswerData;
use super::diagnose::filter_path::Diagnosed;
use super::estimate::{PlatformEstimate, PlatformProblem, RunUnknowns};
use super::observe::observe;
use super::offset::{Offset, SETTLED};
use super::placed::Reading;
use super::run::{MeasurementKey, RecordedRun};
use super::{CalibrationError, Options, known};
use crate::CalibrationProgress;
use crate::answer::Calibration;
use crate::least_squares::PriorRows;
use crate::record::Record;
use crate::setup::SourceRecord;

/// Most rounds of leaving out outliers, or of estimating the noise.
const ROUNDS: usize = 6;
/// Largest fraction of all measurements that may be outliers.
const MOST_OUTLIERS: f64 = 0.02;

/// Inputs of a calibration besides the records.
pub(super) struct CalibrationInputs<'a> {
    pub scheme: &'a Scheme,
    /// Conditions as stated.
    pub conditions: &'a Conditions,
    /// Conditions of the estimate.
    pub own: &'a Conditions,
    /// Plan of the scheme by these conditions.
    pub planned: &'a Plan,
    pub options: &'a Options,
    /// Progress callback.
    pub progress: &'a dyn Fn(CalibrationProgress<'_>) -> bool,
}

/// Unknowns of all runs with the prior information on them.
pub(super) struct UnknownsWithPrior {
    pub unknowns: RunUnknowns,
    /// Rows and values of a prior calibration, with unit errors.
    pub known: Option<PriorRows>,
    /// Names in the prior calibration of what these rows determine.
    pub names: Vec<String>,
}

impl CalibrationInputs<'_> {
    /// Places a reading on the timeline of the scheme.
    ///
    /// # Errors
    /// [`CalibrationError`].
    fn lay(&self, reading: Reading) -> Result<RecordedRun, CalibrationError> {
        RecordedRun::new(reading, self.scheme, self.planned, self.own)
    }

    /// Runs of the records, and the records that the estimates rest on. `sigmas` are those of a sample, by
    /// channel.
    ///
    /// # Errors
    /// [`CalibrationError`], also for a record that counts already.
    pub(super) fn runs(
        &self,
        records: Vec<Record>,
        sigmas: &[f64],
    ) -> Result<(Vec<RecordedRun>, Vec<SourceRecord>), CalibrationError> {
        let mut runs = Vec::with_capacity(records.len());
        let before = self.options.prior.as_ref();
        let mut rests_on: Vec<SourceRecord> = Vec::new();
        for record in records {
            let (gravity, step) = (self.options.gravity_m_s2, self.conditions.step_s);
            let reading = observe(record, self.planned, gravity, step, sigmas.to_vec(), self.progress)?;
            let basis = SourceRecord { record: reading.name.clone(), digest: reading.digest.clone() };
            let same = |other: String| CalibrationError::SameRecord { record: basis.record.clone(), other };
            if let Some(other) = basis.among(&rests_on) {
                return Err(same(other.record.clone()));
            }
            if let Some(other) = before.and_then(|b| basis.among(&b.rests_on)) {
                return Err(same(format!("{}, which the calibration before rests on", other.record)));
            }
            rests_on.push(basis);
            runs.push(self.lay(reading)?);
        }
        rests_on.extend(before.iter().flat_map(|b| b.rests_on.iter().cloned()));
        Ok((runs, rests_on))
    }

    /// Unknowns of `runs` runs, by the priors as stated and the prior calibration.
    ///
    /// # Errors
    /// [`CalibrationError::Prior`].
    pub(super) fn unknowns(
        &self,
        runs: usize,
        start: &RunStart,
        prediction: &Prediction,
    ) -> Result<UnknownsWithPrior, CalibrationError> {
        let (planned, before) = (self.planned, self.options.prior.as_ref());
        let (n, coefficients, biases) =
            (planned.unknowns(), planned.platform.coefficients(), planned.biases.len());
        // priors that a prior calibration already includes do not count again
        let included = |name: &String| {
            before.is_some_and(|b| b.priors.contains(name) && b.estimates.names.contains(name))
        };
        let counts = |name: &String| {
            self.own.stated_priors().iter().any(|a| concerns(&a.name, name)) && !included(name)
        };
        let stated: Vec<bool> =
            planned.platform.names().iter().map(counts).chain(std::iter::repeat_n(false, biases)).collect();
        let mut unknowns = RunUnknowns::new(
            runs,
            [n - coefficients, coefficients, biases],
            &start.sigma,
            &start.estimate,
            &prediction.null_space,
            &stated,
        );
        let known = before.map(|b| known(&b.estimates, planned, prediction, &unknowns)).transpose()?;
        let (known, names) = known.map_or((None, Vec::new()), |(k, names)| (Some(k), names));
        let mut prior = unknowns.stated_rows();
        if let Some(PriorRows { rows, .. }) = &known {
            let above = prior.nrows();
            prior = prior.resize_vertically(above + rows.nrows(), 0.0);
            prior.rows_mut(above, rows.nrows()).copy_from(rows);
        }
        unknowns.determined_by(&prior);
        Ok(UnknownsWithPrior { unknowns, known, names })
    }
}

/// State between the rounds.
pub(super) struct Rounds<'a> {
    inputs: &'a CalibrationInputs<'a>,
    prediction: &'a Prediction,
    known: &'a UnknownsWithPrior,
    /// Standard deviations of a sample, by channel.
    sigmas: Vec<f64>,
    /// Iterate of the starts of the runs, and the first one.
    x: Vec<PlatformState>,
    first: Vec<PlatformState>,
    /// Number of rounds since the runs were laid anew.
    round: usize,
    /// Number of linearisations.
    passes: usize,
    /// Number of other minima of the first round that are nearly as low.
    rivals: usize,
    /// Number of times that the beginnings were sought.
    beginnings: usize,
    /// True if beginnings other than those by the clock of the scheme were tried.
    elsewhere: bool,
    /// Beginning of the scheme by run; `None` where it was not estimated.
    offsets: Vec<Option<Offset>>,
}

/// Change of the runs after a round.
pub(super) enum RoundEnd {
    /// Beginnings that have not settled, in [`Rounds::offsets`].
    Later,
    /// Runs whose beginnings the records leave open.
    Open(Vec<bool>),
    /// Measurements that are left out.
    LeftOut(Vec<(usize, MeasurementKey)>),
    /// No change.
    Last(Box<LastRound>),
}

/// Estimate of the last round.
pub(super) struct LastRound {
    estimate: PlatformEstimate,
    found: Diagnosed,
    /// Number of outliers where they are too many to be left out.
    too_many: Option<usize>,
}

impl<'a> Rounds<'a> {
    /// State before the first round of `runs` runs.
    pub(super) fn new(
        inputs: &'a CalibrationInputs<'a>,
        (start, prediction): (&RunStart, &'a Prediction),
        known: &'a UnknownsWithPrior,
        sigmas: Vec<f64>,
        runs: usize,
    ) -> Self {
        let state = || PlatformState::of_unknowns(&start.estimate, inputs.planned.constants());
        let x: Vec<PlatformState> = (0..runs).map(|_| state()).collect();
        let first = x.clone();
        let (offsets, elsewhere) = (vec![None; runs], false);
        let (round, passes, rivals, beginnings) = (0, 0, 0, 0);
        Self {
            inputs,
            prediction,
            known,
            sigmas,
            x,
            first,
            round,
            passes,
            rivals,
            beginnings,
            elsewhere,
            offsets,
        }
    }

    /// Problem of the next round.
    pub(super) fn problem<'p>(&self, runs: &'p [RecordedRun]) -> PlatformProblem<'p>
    where
        'a: 'p,
    {
        PlatformProblem {
            conditions: self.inputs.own,
            runs,
            unknowns: &self.known.unknowns,
            sigmas: self.sigmas.clone(),
            known: self.known.known.clone(),
            progress: self.inputs.progress,
            passes: Cell::new(self.passes),
            stopped: Cell::new(false),
        }
    }

    /// One round.
    ///
    /// # Errors
    /// [`CalibrationError`].
    pub(super) fn round(&mut self, problem: &PlatformProblem<'_>) -> Result<RoundEnd, CalibrationError> {
        self.round += 1;
        let mut estimate = problem.estimate(std::mem::take(&mut self.x), self.round == 1)?;
        if self.round == 1 {
            self.rivals = estimate.rivals;
        }
        estimate.rivals = self.rivals;
        if self.beginnings < ROUNDS && !problem.stopped.get() && self.begin_later(problem, &estimate)? {
            (self.x, self.round) = (estimate.at.x, 0);
            return Ok(RoundEnd::Later);
        }
        let found = Diagnosed::of(problem, &estimate, self.prediction)?;
        self.passes = problem.passes.get();
        let interrupted = problem.stopped.get();
        let last = self.round == ROUNDS || interrupted;
        let options = self.inputs.options;
        // noise first: a gate needs it
        let rescaled = options.estimate_noise.then(|| found.channel_factors(self.sigmas.len()));
        let settled = rescaled.as_ref().is_none_or(|f| f.iter().all(|f| (f - 1.0).abs() < 1e-3));
        let off = found.beyond(gate(options.gate, found.all.len()));
        let many = off.len() as f64 > MOST_OUTLIERS * found.all.len() as f64;
        let leave_out = !off.is_empty() && !many;
        if !last && settled && !leave_out && !self.elsewhere {
            self.elsewhere = true;
            let lay = |reading: Reading| self.inputs.lay(reading);
            let begins = |r: usize| problem.begins_elsewhere(&estimate, r, &lay);
            let found = (0..problem.runs.len()).map(begins).collect::<Result<Vec<bool>, _>>()?;
            if found.contains(&true) {
                (self.x, self.beginnings) = (estimate.at.x, 0);
                return Ok(RoundEnd::Open(found));
            }
        }
        if last || (settled && !leave_out) {
            let too_many = many.then_some(off.len());
            return Ok(RoundEnd::Last(Box::new(LastRound { estimate, found, too_many })));
        }
        if let Some(factors) = rescaled {
            self.sigmas.iter_mut().zip(factors).for_each(|(s, f)| *s *= f);
        }
        self.x = estimate.at.x;
        Ok(RoundEnd::LeftOut(if leave_out { off } else { Vec::new() }))
    }

    /// Seeks the beginnings that labels leave open; true if one of them has not settled.
    fn begin_later(
        &mut self,
        problem: &PlatformProblem<'_>,
        estimate: &PlatformEstimate,
    ) -> Result<bool, CalibrationError> {
        self.beginnings += 1;
        let inputs = self.inputs;
        self.offsets = problem.open(estimate, &|reading| inputs.lay(reading))?;
        self.passes = problem.passes.get();
        Ok(self.offsets.iter().flatten().any(|o| o.by.abs() > SETTLED * o.sigma))
    }

    /// Lays runs anew, with their beginnings of the last round.
    ///
    /// # Errors
    /// [`CalibrationError`].
    pub(super) fn shift(&self, runs: &mut [RecordedRun]) -> Result<(), CalibrationError> {
        for (run, o) in runs.iter_mut().zip(&self.offsets) {
            if let Some(o) = o {
                let counts = std::mem::take(&mut run.counts);
                *run = self.inputs.lay(run.reading.later(o.by))?;
                run.counts = counts;
            }
        }
        Ok(())
    }

    /// Answer by the last round.
    ///
    /// # Errors
    /// [`CalibrationError`].
    pub(super) fn answer(
        &self,
        problem: &PlatformProblem<'_>,
        last: LastRound,
        rests_on: Vec<SourceRecord>,
    ) -> Result<Calibration, CalibrationError> {
        let LastRound { mut estimate, found, too_many } = last;
        let inputs = self.inputs;
        let lay = |reading: Reading| inputs.lay(reading);
        let linear = estimate.solution.clone();
        let bent = problem.bent(&estimate, inputs.options.seed)?;
        if let Some(found) = &bent.found {
            estimate.solution.inverse_root.clone_from(&found.root);
        }
        for o in self.offsets.iter().flatten() {
            let root = &mut estimate.solution.inverse_root;
            let columns = root.ncols();
            *root = std::mem::take(root).insert_column(columns, 0.0);
            root.set_column(columns, &(&o.direction * o.sigma));
        }
        let later = problem.later(&estimate, &lay)?;
        let jump = problem.jump(&estimate, &self.first, &lay)?;
        let parts = AnswerData {
            scheme: inputs.scheme,
            conditions: inputs.conditions,
            options: inputs.options,
            planned: inputs.planned,
            prediction: self.prediction,
            problem,
            estimate: &estimate,
            linear: &linear,
            bent: &bent,
            found: &found,
            offsets: &self.offsets,
            later: &later,
            jump,
            too_many,
            known: self.known.names.clone(),
            rests_on,
            interrupted: problem.stopped.get(),
        };
        parts.answer()
    }
}

/// Distance, in standard deviations, beyond which a measurement out of `of` is left out.
fn gate(probability: f64, of: usize) -> f64 {
    if probability >= 1.0 {
        return f64::INFINITY;
    }
    chi_square_quantile(1.0, 1.0 - (1.0 - probability) / of.max(1) as f64).sqrt()
}
