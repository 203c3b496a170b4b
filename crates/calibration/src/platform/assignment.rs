//! Assignment of the samples of a record to the positions of its scheme, and to bins.

use std::cmp::Ordering;

use obsdeg_core::model::{AZIMUTH, Matrix3};
use obsdeg_core::span::Span;
use obsdeg_evidence::simulation::{Plan, SegmentKind};

use super::CalibrationError;
use super::clock::bounds;
use super::force::Forces;
use super::gross::{self, GrossReason, LeftOutCell};
use super::mistaken::Mistaken;
use super::placed::{By, Reading, channel_name};
use super::record_columns::{OBSERVED, ObservedColumns, RecordColumns};
use super::timeline::Intervals;
use crate::bins::{Bin, BinSample, Binner, CHANNELS, FEWEST, Spike};
use crate::levels;
use crate::record::{Record, RecordRow, TIME_INDEX};
use crate::still::{DecidedSample, Detector};

/// Ratio to the interval before from which an interval is a gap, in which increments may be lost.
const GAP: f64 = 1.5;
/// Largest delay of a row by rounding, as a fraction of an interval, where positions follow each other
/// directly.
const ROUNDED: f64 = 1e-3;
/// Number of samples of a dense bin from which its median is taken.
const SOME: usize = 64;
/// Smallest difference of times, in s: below it they are equal but for rounding.
const ROUNDING_S: f64 = 1e-6;

/// Index of the position at a time of the scheme while Z is observed. A stamp may be late by `rounding` s
/// where one position follows another directly.
fn at_time(plan: &Plan, t: f64, rounding: f64) -> Option<usize> {
    let slew = |k: usize| plan.segments.get(k).is_none_or(|s| matches!(s.kind, SegmentKind::Slew(_)));
    let within = |(k, s): &(usize, &obsdeg_evidence::simulation::PlanSegment)| {
        let late = if slew(*k) || slew(k + 1) { 0.0 } else { rounding };
        t > s.start_s - 1e-9 && t <= s.start_s + s.dt * s.steps as f64 + late.max(1e-9)
    };
    // a time on the border belongs to the end of the first position
    let (k, found) = plan.segments.iter().enumerate().find(within)?;
    (!slew(k)).then_some(found.position)
}

/// Row in the detector: its line, its numbers, and the interval before it.
type Kept = (u64, Vec<Option<f64>>, Option<f64>);

/// Values of the channels, and their standard deviations where the record states them.
type ChannelValues = ([Option<f64>; CHANNELS], Option<[f64; CHANNELS]>);

/// Sample of a bin.
struct SampleRow {
    /// Line of the record.
    line: u64,
    /// Time, in s.
    t: f64,
    /// Values of the columns of the force or of Z.
    values: [f64; 3],
    /// True if the force is below the horizon of n.
    over: bool,
}

/// State of the assignment of samples to positions and bins.
pub(super) struct SampleAssignment<'a> {
    pub(super) layout: &'a RecordColumns,
    pub(super) plan: &'a Plan,
    /// Bins of the components of Z, in the order of the channels.
    binner: Binner,
    pub(super) out: Reading,
    /// Index of the position of the bin; `begin` is the time of the first sample.
    now: Option<usize>,
    pub(super) begin: f64,
    /// Forces, and the sum and number of their lengths (`length`).
    pub(super) forces: Forces,
    pub(super) length: (f64, usize),
    /// Noise of a sample, in g.
    noise: f64,
    /// Time of the sample before, and the interval before that sample.
    before: Option<(f64, Option<f64>)>,
    /// Intervals between rows.
    pub(super) intervals: Intervals,
    /// Detector of intervals at rest, if the file requests it.
    pub(super) detector: Option<Detector<Kept>>,
    decided: Vec<DecidedSample<Kept>>,
    /// First and last time of every interval at rest.
    pub(super) rests: Vec<(f64, f64)>,
    /// Samples of the bin; `rows` has the input of the robust pass, by position.
    samples: Vec<SampleRow>,
    rows: Vec<Vec<gross::MedianRow>>,
    /// Number of empty cells at positions, by requested number.
    pub(super) empty: Vec<usize>,
    /// Start of every position on the timeline of the scheme, in s.
    starts: Vec<f64>,
    /// Numbers of the current row.
    numbers: Vec<Option<f64>>,
    /// Position with the largest error of the gimbals, the error in deg, and its line.
    pub(super) gimbals: Option<(usize, f64, u64)>,
}

impl<'a> SampleAssignment<'a> {
    /// State before the first row of a record. Bins are at most `bin_s` long; `sigmas` are approximate ones
    /// of a sample, by channel.
    pub(super) fn new(
        record: &Record,
        layout: &'a RecordColumns,
        plan: &'a Plan,
        bin_s: f64,
        sigmas: Vec<f64>,
    ) -> Self {
        let scheme = plan.platform.scheme();
        let positions = scheme.positions.len();
        let still = scheme.recording.still.as_ref().filter(|_| layout.label.is_none());
        let by = match still {
            _ if layout.label.is_some() => By::Label,
            Some(_) => By::Static,
            None => By::Timeline,
        };
        let of_force = plan.components.iter().zip(&sigmas).find(|(k, _)| **k != AZIMUTH);
        let noise = of_force.map_or(0.0, |(_, sigma)| *sigma);
        Self {
            layout,
            plan,
            binner: Binner::new(bin_s, sigmas),
            out: Reading::new(record, layout, by, positions),
            now: None,
            begin: 0.0,
            forces: Forces::new(positions, bin_s),
            length: (0.0, 0),
            noise,
            before: None,
            intervals: Intervals::default(),
            detector: still.map(Detector::new),
            decided: Vec::new(),
            rests: Vec::new(),
            samples: Vec::new(),
            rows: vec![Vec::new(); positions],
            empty: vec![0; layout.wanted.len()],
            starts: bounds(plan).into_iter().map(|b| b.from).collect(),
            numbers: Vec::new(),
            gimbals: None,
        }
    }

    fn names(&self) -> String {
        let names: Vec<&str> =
            self.plan.platform.scheme().positions.iter().map(|p| p.name.as_str()).collect();
        names.join(", ")
    }

    /// Position of a row.
    fn position(
        &self,
        row: &RecordRow<'_>,
        t: f64,
        dt: Option<f64>,
    ) -> Result<Option<usize>, CalibrationError> {
        let positions = &self.plan.platform.scheme().positions;
        match self.out.by {
            By::Timeline | By::Both | By::Static => Ok(at_time(self.plan, t, ROUNDED * dt.unwrap_or(0.0))),
            By::Label if row.label.is_empty() => Ok(None),
            By::Label => {
                let found = positions.iter().position(|p| p.name == row.label);
                let found = found.ok_or_else(|| CalibrationError::UnknownPosition {
                    record: self.out.name.clone(),
                    line: row.line,
                    found: row.label.into(),
                    expected: self.names(),
                })?;
                let last = self.out.stays.len();
                let next = if self.now == Some(found) { last - 1 } else { last };
                if found == next {
                    return Ok(Some(found));
                }
                Err(CalibrationError::Order {
                    record: self.out.name.clone(),
                    line: row.line,
                    found: row.label.into(),
                    expected: positions.get(last).map_or_else(
                        || format!("no position after {}, the last of the scheme", positions[last - 1].name),
                        |p| format!("{} (the scheme's positions are {})", p.name, self.names()),
                    ),
                })
            }
        }
    }

    /// Assigns a row.
    ///
    /// # Errors
    /// [`CalibrationError`].
    pub(super) fn take(&mut self, row: &RecordRow<'_>) -> Result<(), CalibrationError> {
        let Some(time) = row.time() else { return Ok(()) };
        if self.out.samples == 0 {
            self.out.span.from = time;
        }
        self.out.span.to = time;
        self.out.samples += 1;
        let mut numbers = std::mem::take(&mut self.numbers);
        numbers.clear();
        numbers.extend_from_slice(row.numbers);
        self.leave_out_codes(&mut numbers);
        let dt = self.interval(time);
        if self.layout.increments {
            self.layout.divide(&mut numbers, dt);
        }
        if let Some(mut detector) = self.detector.take() {
            // a row without forces shows no rest
            if let [Some(x), Some(y), Some(z)] = numbers[OBSERVED] {
                let mut decided = std::mem::take(&mut self.decided);
                detector.push(time, vec![x, y, z], (row.line, numbers.clone(), dt), &mut decided);
                decided.drain(..).try_for_each(|one| self.at_rest(&one))?;
                self.decided = decided;
            } else {
                self.out.unused += 1;
            }
            self.detector = Some(detector);
            self.numbers = numbers;
            return Ok(());
        }
        let found = self.position(row, time, dt)?;
        self.intervals.push(time, row.line, found);
        if self.layout.increments && found != self.now {
            // a part of the increment belongs to the motion to this position
            self.layout.divide(&mut numbers, None);
        }
        let taken = self.put((row.line, &numbers, dt), time, found);
        self.numbers = numbers;
        taken
    }

    /// Leaves out the numbers of a row that are codes of missing values by the file.
    fn leave_out_codes(&self, numbers: &mut [Option<f64>]) {
        let codes = &self.plan.platform.scheme().recording.missing;
        if !codes.is_empty() {
            for (number, w) in numbers.iter_mut().zip(&self.layout.wanted).skip(1) {
                *number = number.filter(|x| codes.iter().all(|code| *x != code * w.scale));
            }
        }
    }

    /// Interval between `time` and the sample before; `None` across a gap.
    fn interval(&mut self, time: f64) -> Option<f64> {
        let dt = self.before.map(|(t, _)| time - t);
        let regular =
            dt.filter(|dt| self.before.and_then(|(_, last)| last).is_none_or(|last| *dt <= GAP * last));
        self.before = Some((time, dt));
        regular
    }

    /// Assigns a sample that the detector has decided.
    ///
    /// # Errors
    /// [`CalibrationError`].
    pub(super) fn at_rest(&mut self, decided: &DecidedSample<Kept>) -> Result<(), CalibrationError> {
        let Some(time) = decided.sample.1[TIME_INDEX] else { return Ok(()) };
        if let Some(k) = decided.interval {
            if k == self.rests.len() {
                self.rests.push((time, time));
            }
            self.rests[k].1 = time;
        }
        let positions = self.plan.attitudes.len();
        let found = decided.interval.filter(|k| *k < positions);
        self.intervals.push(time, decided.sample.0, found);
        let (line, numbers, dt) = &decided.sample;
        self.put((*line, numbers, *dt), time, found)
    }

    /// Assigns a sample to its position.
    fn put(
        &mut self,
        (line, numbers, dt): (u64, &[Option<f64>], Option<f64>),
        time: f64,
        found: Option<usize>,
    ) -> Result<(), CalibrationError> {
        if found != self.now {
            self.leave_position(time);
        }
        let Some(p) = found else {
            self.out.unused += 1;
            self.now = None;
            return Ok(());
        };
        let t = self.enter_position(p, time);
        let plan = self.plan;
        let c = &plan.attitudes[p];
        let waiting: Vec<Option<f64>>;
        let numbers = match self.waits(p, t) {
            true => {
                self.out.waiting += 1;
                waiting = numbers.iter().enumerate().map(|(i, x)| x.filter(|_| i == TIME_INDEX)).collect();
                &waiting[..]
            }
            false => numbers,
        };
        self.put_gimbals(p, line, numbers, c);
        let in_n = self.layout.in_n(numbers, c);
        self.put_force(p, (line, time, numbers), &in_n, c);
        let (z, sigma) = self.components(line, numbers, &in_n, c)?;
        let temperature = self.layout.temperature.and_then(|i| numbers[i]);
        // a mean belongs to the middle of its interval
        let t = t - dt.filter(|_| self.layout.increments).map_or(0.0, |dt| dt / 2.0);
        let spikes = self.out.spikes.len();
        let bins = self.binner.push(BinSample { line, t, z, sigma, temperature }, &mut self.out.spikes);
        for bin in bins {
            self.put_bin(p, bin, spikes);
        }
        // f = Z - g points down
        let over = in_n[1].is_some_and(|z| z < -1.0);
        let values =
            std::array::from_fn(|i| numbers[OBSERVED][i].filter(|_| self.layout.own(i)).unwrap_or(f64::NAN));
        self.samples.push(SampleRow { line, t, values, over });
        if !self.waits(p, t) {
            for (count, number) in self.empty.iter_mut().zip(numbers) {
                *count += usize::from(number.is_none());
            }
        }
        Ok(())
    }

    /// Ends a position with the first row behind it, at `time` of the record.
    fn leave_position(&mut self, time: f64) {
        self.end();
        if let Some(after) = self.now.and_then(|p| self.out.after.get_mut(p)) {
            *after = time - if self.out.by.own_time() { self.begin } else { 0.0 };
        }
    }

    /// Continues a position with a row at `time` of the record, or begins it. Returns the time of the row in
    /// the run.
    fn enter_position(&mut self, p: usize, time: f64) -> f64 {
        let own_time = self.out.by.own_time();
        if own_time && self.out.stays.is_empty() {
            self.begin = time;
        }
        let t = time - if own_time { self.begin } else { 0.0 };
        if self.now != Some(p) {
            // the timeline may begin late, or leave positions out
            while self.out.stays.len() <= p {
                self.out.stays.push(Span { from: t, to: t });
                self.out.after.push(f64::INFINITY);
            }
        }
        self.now = Some(p);
        self.out.stays[p].to = t;
        t
    }

    /// Notes the largest error of the gimbals.
    fn put_gimbals(&mut self, p: usize, line: u64, numbers: &[Option<f64>], c: &Matrix3<f64>) {
        if let Some(off) = self.layout.gimbals_off(numbers, c)
            && self.gimbals.is_none_or(|(_, most, _)| off > most)
        {
            self.gimbals = Some((p, off, line));
        }
    }

    /// Adds the force of a row (line, time, numbers) with the components `in_n` at the attitude `c`.
    fn put_force(
        &mut self,
        p: usize,
        (line, time, numbers): (u64, f64, &[Option<f64>]),
        in_n: &[Option<f64>; 4],
        c: &Matrix3<f64>,
    ) {
        // Z2 may be missing
        let ([Some(x), Some(y), Some(z), _], true) =
            (*in_n, self.layout.observed != ObservedColumns::Geographic)
        else {
            return;
        };
        let f = [x, y + 1.0, z];
        let own = std::array::from_fn(|j| (0..3).map(|i| c[i][j] * f[i]).sum());
        // the vertical component determines the length
        let up = self.layout.sigmas_in_n(numbers, c).and_then(|s| s[1]);
        self.forces.push(p, line, time, own, up.unwrap_or(self.noise));
        // codes of missing values have no length
        let length = (f[0] * f[0] + f[1] * f[1] + f[2] * f[2]).sqrt();
        if (length - 1.0).abs() < 0.5 {
            self.length.0 += length;
            self.length.1 += 1;
        }
    }

    /// Components of Z in a row, and their standard deviations where the record states them, by channel.
    fn components(
        &self,
        line: u64,
        numbers: &[Option<f64>],
        in_n: &[Option<f64>; 4],
        c: &Matrix3<f64>,
    ) -> Result<ChannelValues, CalibrationError> {
        let components = &self.plan.components;
        let mut z = [None; CHANNELS];
        for (z, &k) in z.iter_mut().zip(components) {
            *z = in_n[if k == AZIMUTH { 3 } else { k - 1 }];
        }
        let Some(own) = self.layout.sigmas_in_n(numbers, c) else { return Ok((z, None)) };
        let mut all = [f64::NAN; CHANNELS];
        for (sigma, &k) in all.iter_mut().zip(components).filter(|(_, k)| **k != AZIMUTH) {
            *sigma = own[k - 1].unwrap_or(f64::NAN);
        }
        // a value with an invalid sigma is an error; without a value the sigma does not matter
        let invalid = |k: &usize| z[*k].is_some() && (all[*k].is_nan() || all[*k] <= 0.0);
        match (0..components.len()).find(invalid) {
            Some(k) => Err(CalibrationError::Sigma {
                record: self.out.name.clone(),
                line,
                channel: channel_name(components[k]),
            }),
            None => Ok((z, Some(all))),
        }
    }

    /// True for a row at time `t` of a position during the wait that the file states: from the first row of
    /// the position on, or from its start on the timeline of the scheme.
    fn waits(&self, p: usize, t: f64) -> bool {
        let Some(settle) = self.plan.platform.scheme().recording.settle else { return false };
        match self.out.by.own_time() {
            true => t - self.out.stays[p].from < settle - ROUNDING_S,
            false => t - self.starts[p] <= settle + ROUNDING_S,
        }
    }

    /// Ends the position of the last sample, or the record.
    pub(super) fn end(&mut self) {
        let spikes = self.out.spikes.len();
        let bins = self.binner.end(&mut self.out.spikes);
        let Some(p) = self.now else { return };
        for bin in bins {
            self.put_bin(p, bin, spikes);
        }
    }

    /// Adds a bin of a position. Its spikes are among those from index `spikes` on; each is replaced by a
    /// cell in the column that is farthest off.
    fn put_bin(&mut self, p: usize, bin: Bin, spikes: usize) {
        let own = self.samples.partition_point(|s| s.line <= bin.lines.to);
        let samples: Vec<SampleRow> = self.samples.drain(..own).collect();
        let over = samples.iter().filter(|s| s.over).count();
        let index = self.out.bins[p].len();
        self.out.bins[p].push(bin);
        self.out.over[p].push(2 * over > samples.len());
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return };
        if samples.len() < FEWEST {
            let row = |s: &SampleRow| gross::MedianRow {
                lines: Span { from: s.line, to: s.line },
                t: s.t,
                samples: 1,
                values: s.values,
                bin: index,
            };
            self.rows[p].extend(samples.iter().map(row));
            return;
        }
        // the median of a part of the samples is the usual value
        let some = samples.iter().step_by(samples.len().div_ceil(SOME));
        let usual: [f64; 3] = std::array::from_fn(|i| {
            gross::median(some.clone().map(|s| s.values[i]).filter(|x| x.is_finite()).collect())
        });
        let lines = Span { from: first.line, to: last.line };
        let t = gross::median(some.map(|s| s.t).collect());
        self.rows[p].push(gross::MedianRow { lines, t, samples: samples.len(), values: usual, bin: index });
        let inside = |s: &Spike| lines.contains(&s.line);
        let (found, others): (Vec<Spike>, Vec<Spike>) = self.out.spikes.drain(spikes..).partition(inside);
        self.out.spikes.extend(others);
        self.put_spikes(found, &samples, &usual);
    }

    /// Replaces the spikes of a bin by cells in the columns that are farthest from their `usual` values.
    fn put_spikes(&mut self, mut found: Vec<Spike>, samples: &[SampleRow], usual: &[f64; 3]) {
        found.sort_by(|a, b| {
            (a.line, b.sigmas.abs()).partial_cmp(&(b.line, a.sigmas.abs())).unwrap_or(Ordering::Equal)
        });
        found.dedup_by_key(|s| s.line);
        for spike in found {
            let Some(s) = samples.iter().find(|s| s.line == spike.line) else { continue };
            let off = |i: usize| (s.values[i] - usual[i]).abs();
            let axis = (0..3).filter(|&i| s.values[i].is_finite()).max_by(|a, b| off(*a).total_cmp(&off(*b)));
            // a measured azimuth is no such column
            let Some(axis) = axis.filter(|_| self.plan.components[spike.channel] != AZIMUTH) else {
                self.out.spikes.push(spike);
                continue;
            };
            self.cell(gross::GrossCell {
                row: None,
                lines: Span { from: spike.line, to: spike.line },
                t: spike.t,
                axis,
                value: s.values[axis],
                sigmas: spike.sigmas,
                why: GrossReason::Far,
            });
        }
    }

    /// Adds a cell that is left out, with its value as written in the record.
    fn cell(&mut self, mut cell: gross::GrossCell) {
        cell.value /= self.layout.wanted[OBSERVED][cell.axis].scale;
        let column = self.layout.columns[cell.axis].clone();
        self.out.cells.push(LeftOutCell { cell, column });
    }

    /// Checks for outputs that hold one value through a position.
    pub(super) fn check_held(&self) -> Result<(), Box<Mistaken>> {
        let Some((p, axis, value)) = gross::held(&self.rows) else { return Ok(()) };
        Err(Box::new(Mistaken::Held {
            record: self.out.name.clone(),
            line: self.rows[p][0].lines.from,
            column: self.layout.columns[axis].clone(),
            value: (value / self.layout.wanted[OBSERVED][axis].scale).to_string(),
            rows: self.rows[p].iter().map(|r| r.samples).sum(),
            position: self.plan.platform.scheme().positions[p].name.clone(),
        }))
    }

    /// Leaves out the cells that a robust pass over every position finds gross. A turn (length of 1 g, at
    /// either end) is kept for the check of positions.
    pub(super) fn leave_out_gross(&mut self) {
        let noise = self.noise;
        let stuck = levels::STUCK / self.rows.len().max(1) as f64;
        for p in 0..self.rows.len() {
            let rows = std::mem::take(&mut self.rows[p]);
            let mut found = gross::cells(&rows, noise, stuck);
            if self.layout.observed == ObservedColumns::Force {
                gross::keep_turns(&rows, &mut found);
            }
            for cell in &found {
                let lines = cell.lines;
                if let Some(row) = rows.iter().find(|r| r.lines == lines) {
                    self.out.bins[p][row.bin].channels.iter_mut().for_each(|c| *c = None);
                }
                self.forces.leave_out(p, lines);
            }
            found.into_iter().for_each(|cell| self.cell(cell));
        }
        // a value far from its neighbours that occurs several times in the record is a code too
        let all: Vec<(usize, f64)> = self.out.cells.iter().map(|c| (c.cell.axis, c.cell.value)).collect();
        let again = |c: &gross::GrossCell| all.iter().filter(|a| **a == (c.axis, c.value)).count() > 1;
        let far = |c: &&mut LeftOutCell| c.cell.why == GrossReason::Far;
        for left_out in self.out.cells.iter_mut().filter(far).filter(|c| again(&c.cell)) {
            left_out.cell.why = GrossReason::Code;
        }
    }
}
