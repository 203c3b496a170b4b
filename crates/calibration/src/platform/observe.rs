//! Reading of a platform's record: its columns, the position of every sample, and bins of samples in n.

use obsdeg_core::model::Carry;
use obsdeg_core::span::Span;
use obsdeg_evidence::simulation::Plan;

use super::CalibrationError;
use super::assignment::SampleAssignment;
use super::clock::bounds;
use super::mistaken::Mistaken;
use super::placed::{By, Reading, TOLERANCE};
use super::record_columns::{ObservedColumns, RecordColumns, TIMES, units_of_force};
use super::timeline;
use crate::CalibrationProgress;
use crate::answer::ColumnRead;
use crate::bins::Bin;
use crate::record::Record;

/// Largest angle of the gimbal readings from the attitude of the scheme, in deg.
const GIMBALS_DEG: f64 = 5.0;
/// Interval of progress reports, in samples.
const OFTEN: usize = 10_000;

/// Checks for times in another unit than that of the header: all durations then have the same ratio to those
/// of the scheme.
fn check_times(reading: &Reading, plan: &Plan, time: &ColumnRead) -> Result<(), Box<Mistaken>> {
    let dwells: Vec<f64> = bounds(plan).iter().map(Span::length).collect();
    let lasts: Vec<f64> = reading.stays.iter().map(Span::length).collect();
    let ratio = |unit: f64| time.factor / unit;
    let like = |unit: f64| {
        let mut each = lasts.iter().enumerate().map(|(p, lasts)| lasts / dwells[p] / ratio(unit));
        (ratio(unit).ln().abs() > 1.0) && each.all(|x| (x - 1.0).abs() < 0.1)
    };
    match TIMES.iter().find(|(_, unit)| !lasts.is_empty() && like(*unit)) {
        Some((unit, _)) => Err(Box::new(Mistaken::TimeUnit {
            record: reading.name.clone(),
            column: time.column.clone(),
            found: format!("{:.6}", lasts[0]),
            expected: format!("{:.6}", dwells[0]),
            unit,
        })),
        None => Ok(()),
    }
}

/// Places positions known by labels on the timeline of the scheme, which says when each begins and ends
/// between the rows. Positions that do not fit the timeline were held for other durations, and end with their
/// last rows.
fn lay(reading: &mut Reading, plan: &Plan, tolerance: f64) {
    let by_clock: Vec<Span<f64>> = reading.stays.iter().map(|stay| stay.later(reading.origin)).collect();
    match timeline::begin(&by_clock, plan, tolerance) {
        Some(begin) => {
            *reading = reading.later(begin.at - reading.origin);
            (reading.by, reading.origin, reading.open) = (By::Both, begin.at, begin.open);
            reading.ends_open = false;
        }
        None => timeline::ends(&mut reading.stays, &reading.after, plan, reading.interval, tolerance),
    }
}

impl SampleAssignment<'_> {
    /// Ends the detector of intervals at rest, which are as many as the positions.
    fn end_rests(&mut self) -> Result<(), CalibrationError> {
        let Some(mut detector) = self.detector.take() else { return Ok(()) };
        let mut decided = Vec::new();
        detector.end(&mut decided);
        decided.iter().try_for_each(|one| self.at_rest(one))?;
        let positions = self.plan.platform.scheme().positions.len();
        if self.rests.len() == positions {
            return Ok(());
        }
        let spans: Vec<String> = self.rests.iter().map(|(a, b)| format!("{a} to {b}")).collect();
        Err(CalibrationError::Rests {
            record: self.out.name.clone(),
            found: spans.len(),
            expected: positions,
            spans: if spans.is_empty() { String::new() } else { format!(": {} s", spans.join(", ")) },
        })
    }

    /// Checks units, attitudes, times and gimbals, and leaves out gross cells, for an acceleration of 1 g of
    /// `gravity` m/s^2.
    fn check(&mut self, gravity: f64) -> Result<(), CalibrationError> {
        let (plan, layout) = (self.plan, self.layout);
        let scheme = plan.platform.scheme();
        let names: Vec<&str> = scheme.positions.iter().map(|position| position.name.as_str()).collect();
        // forces that are increments of velocity by the header, or the other way round
        let (between, gaps) = std::mem::take(&mut self.intervals).finish(plan);
        (self.out.interval, self.out.gaps) = (between, gaps);
        let per =
            |(u, size): (&'static str, f64)| (u, size * between.powi(if layout.increments { 1 } else { -1 }));
        let others = units_of_force(!layout.increments, gravity).map(per);
        self.forces.check_units(
            &self.out.name,
            &names,
            &plan.attitudes,
            layout.forces.as_ref(),
            &units_of_force(layout.increments, gravity),
            &others,
        )?;
        self.leave_out_gross();
        let inertial = scheme.carry == Carry::Inertial;
        self.forces.check_attitudes(&self.out.name, &names, &plan.attitudes, inertial)?;
        if self.out.by.own_time() {
            check_times(&self.out, plan, &layout.time)?;
        }
        let timeline = (self.out.by == By::Timeline).then(|| bounds(plan));
        self.forces.check_ends(&self.out.name, &names, &plan.attitudes, timeline.as_deref())?;
        match self.gimbals.filter(|(_, off, _)| *off > GIMBALS_DEG) {
            Some((p, off, line)) => Err(CalibrationError::Gimbals {
                record: self.out.name.clone(),
                line,
                position: names[p].into(),
                off_deg: format!("{off:.1}"),
            }),
            None => Ok(()),
        }
    }

    /// Reading of the record with this digest.
    fn finish(self, digest: String) -> Reading {
        let (length, count) = self.length;
        let force =
            (self.layout.observed == ObservedColumns::Force && count > 0).then(|| length / count as f64);
        let lengths = force.map(|_| self.forces.lengths());
        let mut out = self.out;
        out.lengths = lengths.unwrap_or(out.lengths);
        (out.force, out.gimbals, out.digest) = (force, self.gimbals.map(|(_, off, _)| off), digest);
        out.origin = if out.by.own_time() { self.begin } else { 0.0 };
        out
    }
}

/// Checks that every position has samples.
fn check_samples(out: &Reading, plan: &Plan) -> Result<(), CalibrationError> {
    let empty = |b: &Vec<Bin>| b.iter().all(|b| b.channels.iter().all(Option::is_none));
    let Some(p) = out.bins.iter().position(empty) else { return Ok(()) };
    let scheme = plan.platform.scheme();
    Err(CalibrationError::NoSamples {
        record: out.name.clone(),
        position: scheme.positions[p].name.clone(),
        hint: match out.by {
            By::Label | By::Both | By::Static if out.stays.len() <= p && p > 0 => {
                "its label does not occur (where the run ended before it, delete its [[position]] in the scheme)"
                    .into()
            }
            By::Label | By::Both | By::Static if out.waiting > 0 => format!(
                "settle of {} s leaves none of its rows",
                scheme.recording.settle.unwrap_or_default()
            ),
            By::Label | By::Both | By::Static => "its label does not occur".into(),
            By::Timeline => format!(
                "the record is of {:.3} to {:.3} s, the scheme of 0 to {:.3} s (a column `position` says \
                 what is where)",
                out.span.from,
                out.span.to,
                plan.duration_s()
            ),
        },
    })
}

/// Reads `record` with the timeline of `plan`, into bins of at most `bin_s`; `sigmas` are approximate ones of
/// a sample, by channel.
///
/// # Errors
/// [`CalibrationError`].
pub(crate) fn observe(
    record: Record,
    plan: &Plan,
    gravity: f64,
    bin_s: f64,
    sigmas: Vec<f64>,
    progress: &dyn Fn(CalibrationProgress<'_>) -> bool,
) -> Result<Reading, CalibrationError> {
    let record = record.named(&plan.platform.scheme().recording)?;
    let layout = RecordColumns::of(&record, plan, gravity)?;
    let mut assignment = SampleAssignment::new(&record, &layout, plan, bin_s, sigmas);
    let (name, mut rows) = (record.name().to_string(), 0_usize);
    let record_columns: Vec<String> = record.columns().iter().map(|c| c.text.clone()).collect();
    let digest = record.read(&layout.wanted, layout.label, false, |row| {
        rows += 1;
        if rows.is_multiple_of(OFTEN)
            && !progress(CalibrationProgress::Reads { record: &name, samples: rows })
        {
            return Err(CalibrationError::Interrupted);
        }
        assignment.take(&row)
    })?;
    assignment.end_rests()?;
    assignment.end();
    assignment.check_held()?;
    assignment.forces.end();
    assignment.out.missing = layout.missing(&record_columns, &assignment.empty);
    assignment.check(gravity)?;
    let mut out = assignment.finish(digest);
    if out.by == By::Label && out.stays.len() == plan.platform.scheme().positions.len() {
        let part = plan.platform.scheme().recording.tolerance.unwrap_or(TOLERANCE);
        let tolerance = part * out.interval;
        lay(&mut out, plan, tolerance);
    }
    check_samples(&out, plan)?;
    Ok(out)
}
