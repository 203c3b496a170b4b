//! Reading of a platform's record: its columns, the position of every sample, and bins of samples in n.

use std::cmp::Ordering;

use obsdeg_core::model::slew::apply;
use obsdeg_core::model::{AZIMUTH, Carry, Float, Matrix3, Scheme, elementary, product};
use obsdeg_evidence::simulation::{Plan, SegmentKind};

use super::CalibrationError;
use super::clock::{bounds, by_durations, of_turns};
use super::force::{ForceColumn, Forces};
use super::gross;
use super::length::Length;
use super::mistaken::Mistaken;
use super::timeline::{self, Gap, Intervals, by_rows};
use crate::Going;
use crate::answer::{self, EmptyCells, PositionsBy};
use crate::bins::{Bin, Binner, CHANNELS, FEWEST, Sample, Spike};
use crate::levels;
use crate::record::{Column, Record, Row, Wanted};
use crate::still::{DecidedSample, Detector};

/// Units of forces, with their values in g (`None`: a metre per second squared, which depends on gravity).
const FORCES: [(&str, Option<f64>); 4] =
    [("g", Some(1.0)), ("mg", Some(1e-3)), ("ug", Some(1e-6)), ("m/s^2", None)];
/// Units of increments of velocity over the time since the sample before, with their values in m/s. The
/// quotient is the mean force in this interval.
const INCREMENTS: [(&str, f64); 4] = [("m/s", 1.0), ("cm/s", 1e-2), ("mm/s", 1e-3), ("um/s", 1e-6)];
/// Ratio to the interval before from which an interval is a gap, in which increments may be lost.
const GAP: f64 = 1.5;
/// Largest deviation of the time stamps from the timeline of the scheme, as a fraction of an interval, unless
/// the file states one.
pub(super) const TOLERANCE: f64 = 0.05;
/// Largest delay of a row by rounding, as a fraction of an interval, where positions follow each other
/// directly.
const ROUNDED: f64 = 1e-3;
const ANGLES: [(&str, f64); 4] = [
    ("rad", 1.0),
    ("mrad", 1e-3),
    ("deg", std::f64::consts::PI / 180.0),
    ("arcsec", std::f64::consts::PI / 648000.0),
];
/// Units of a temperature, whose zero does not matter.
const TEMPERATURES: [(&str, f64); 3] = [("degC", 1.0), ("C", 1.0), ("K", 1.0)];
/// Units of time.
pub(crate) const TIMES: [(&str, f64); 6] =
    [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("min", 60.0), ("h", 3600.0)];
/// Number of samples of a dense bin from which its median is taken.
const SOME: usize = 64;
/// Largest angle of the gimbal readings from the attitude of the scheme, in deg.
const GIMBALS_DEG: f64 = 5.0;

/// Smallest difference of times, in s: below it they are equal but for rounding.
const ROUNDING_S: f64 = 1e-6;

/// Interval of progress reports, in samples.
const OFTEN: usize = 10_000;

/// Meaning of the three observed columns of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Observed {
    /// Outputs of the accelerometers in platform axes.
    Force,
    /// Z in platform axes.
    Platform,
    /// Z in n.
    Geographic,
}

/// Source of the positions of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum By {
    /// Column of labels.
    Label,
    /// Timeline of the scheme.
    Timeline,
    /// Labels that agree with the timeline.
    Both,
    /// Intervals at rest that were found.
    Static,
}

/// Record with its samples at the positions of its scheme.
#[derive(Debug, Clone)]
pub(crate) struct Reading {
    pub name: String,
    pub by: By,
    /// Bins by position, with times in s from the first sample (labels) or from the start of the scheme.
    pub bins: Vec<Vec<Bin>>,
    /// Flags of the bins: true if most forces point below the horizon of n (a tilt beyond 90 deg); false also
    /// where the record has no forces.
    pub over: Vec<Vec<bool>>,
    /// Time of the record at time 0 of the bins, in s.
    pub origin: f64,
    /// Earliest and latest origin, in s; `None` unless labels leave it open and it differs from the scheme's
    /// clock.
    pub open: Option<(f64, f64)>,
    /// True if rows alone say when positions begin and end.
    pub ends_open: bool,
    /// Usual interval between rows, in s.
    pub interval: f64,
    /// Intervals with missing rows.
    pub gaps: Vec<Gap>,
    /// Times of the first and the last sample, by position, in s.
    pub stays: Vec<(f64, f64)>,
    /// Times of the first row behind each position, in s; infinite at the end of the record.
    pub after: Vec<f64>,
    pub spikes: Vec<Spike>,
    /// Cells that are left out, with the text of their column.
    pub cells: Vec<(gross::Cell, String)>,
    /// Columns that were read: text, and number of empty cells at positions.
    pub missing: Vec<(String, usize)>,
    pub samples: usize,
    /// Number of samples at no position.
    pub unused: usize,
    /// Number of samples at positions during a wait that the file states.
    pub waiting: usize,
    /// First and last time by the clock of the record, in s.
    pub span: (f64, f64),
    /// Columns that are not used.
    pub ignored: Vec<String>,
    /// Mean length of the specific force, in g; `None` if the record has no forces.
    pub force: Option<f64>,
    /// Lengths of the specific force, by position.
    pub lengths: Vec<Option<Length>>,
    /// Largest angle of the gimbal readings from the scheme, in deg; `None` if the record has none.
    pub gimbals: Option<f64>,
    /// Digest of the numbers.
    pub digest: String,
    /// Columns that are used, with the value of one of their numbers in s, g, g s, rad or degC.
    pub columns: Vec<(String, f64)>,
    /// Separator and decimal mark in words; `None` for commas and points.
    pub written: Option<String>,
}

impl From<By> for PositionsBy {
    fn from(by: By) -> Self {
        match by {
            By::Label => Self::Labels,
            By::Timeline => Self::Timeline,
            By::Both => Self::Both,
            By::Static => Self::Static,
        }
    }
}

impl Reading {
    /// Reading with the scheme beginning `by` s later by the clock of the record.
    pub(crate) fn later(&self, by: f64) -> Self {
        let mut out = self.clone();
        out.origin += by;
        out.bins.iter_mut().flatten().for_each(|b| b.t -= by);
        out.spikes.iter_mut().for_each(|s| s.t -= by);
        out.cells.iter_mut().for_each(|(c, _)| c.t -= by);
        out.stays.iter_mut().for_each(|s| *s = (s.0 - by, s.1 - by));
        out.after.iter_mut().for_each(|t| *t -= by);
        out
    }

    /// Reading by a clock that is fast by the fraction `by`, corrected: all times are divided by `1 + by`.
    pub(super) fn stretched(mut self, by: f64) -> Self {
        self.bins.iter_mut().flatten().for_each(|b| b.t /= 1.0 + by);
        self.stays.iter_mut().for_each(|s| *s = (s.0 / (1.0 + by), s.1 / (1.0 + by)));
        self
    }

    /// Intervals with missing rows, by the names of positions.
    pub(crate) fn gaps(&self, scheme: &Scheme) -> Vec<answer::Gap> {
        let name = |p: usize| scheme.positions[p].name.clone();
        let place = |between: [Option<usize>; 2]| match between {
            [Some(p), Some(q)] if p == q => name(p),
            [Some(p), Some(q)] => format!("{} to {}", name(p), name(q)),
            [Some(p), None] => format!("after {}", name(p)),
            [None, Some(q)] => format!("before {}", name(q)),
            [None, None] => "between positions".into(),
        };
        let of = |g: &Gap| answer::Gap { from_s: g.from, to_s: g.to, line: g.line, place: place(g.between) };
        self.gaps.iter().map(of).collect()
    }

    /// Number of empty cells at positions, by column.
    pub(crate) fn empty_cells(&self) -> Vec<EmptyCells> {
        let of = |(column, count): &(String, usize)| EmptyCells { column: column.clone(), count: *count };
        self.missing.iter().map(of).collect()
    }

    /// Factor by which turns last longer than in the scheme; `None` if the record does not show it.
    pub(crate) fn of_turns(&self, plan: &Plan) -> Option<f64> {
        let own = matches!(self.by, By::Label | By::Static);
        if own { of_turns(&self.stays, self.interval, &timeline::slews(plan)) } else { None }
    }

    /// Fraction by which the clock is fast, by the durations of positions; `None` if the record does not show
    /// it.
    pub(crate) fn by_durations(&self, plan: &Plan) -> Option<answer::ClockRate> {
        let used = self.samples.saturating_sub(self.unused).max(1) as f64;
        let between = self.stays.iter().map(|(from, to)| to - from).sum::<f64>() / used;
        match self.by {
            // the timeline of the scheme does not hold, so the rate is not zero
            By::Label => by_durations(&self.stays, between, plan, by_rows(&self.stays, plan)),
            By::Static => by_durations(&self.stays, between, plan, None),
            By::Timeline | By::Both => None,
        }
    }
}

/// Layout of the requested numbers of a row: time, three of Z or of the force, the azimuth, standard
/// deviations of the three, gimbal angles, temperature.
struct Layout {
    observed: Observed,
    /// Columns of the force; `None` if Z is observed.
    forces: Option<[ForceColumn; 3]>,
    /// Column of the time: its text, and the value of one of its numbers in s.
    time: (String, f64),
    wanted: Vec<Wanted>,
    azimuth: bool,
    sigmas: bool,
    /// True if forces are increments of velocity, which are read in g s.
    increments: bool,
    /// Index of the first of the three gimbal angles among the requested numbers.
    gimbals: Option<usize>,
    temperature: Option<usize>,
    label: Option<usize>,
    ignored: Vec<String>,
    /// Texts of the three observed columns.
    columns: [String; 3],
}

/// Units of the force in g, or of increments of velocity in g s.
fn units_of_force(increments: bool, gravity: f64) -> [(&'static str, f64); 4] {
    match increments {
        true => INCREMENTS.map(|(u, size)| (u, size / gravity)),
        false => FORCES.map(|(u, g)| (u, g.unwrap_or(1.0 / gravity))),
    }
}

impl Layout {
    fn of(record: &Record, plan: &Plan, gravity: f64) -> Result<Self, CalibrationError> {
        let time = record.find("t").ok_or_else(|| record.missing("`t [s]`"))?;
        let mut wanted = vec![record.wanted(time, &TIMES)?];
        let families = [
            (Observed::Force, ["fx", "fy", "fz"]),
            (Observed::Platform, ["Zx", "Zy", "Zz"]),
            (Observed::Geographic, ["Z1", "Z2", "Z3"]),
        ];
        let there = |names: &[&str; 3]| names.iter().any(|n| record.find(n).is_some());
        let mut of = families.iter().filter(|(_, names)| there(names));
        let expected = "`fx [g]`, `fy [g]`, `fz [g]` (outputs of the accelerometers in platform axes), or \
            `Zx`, `Zy`, `Zz`, or `Z1`, `Z3`";
        let &(observed, names) = of.next().ok_or_else(|| record.missing(expected))?;
        if let Some((_, others)) = of.next() {
            let also = format!("either {}, {}, {} or {}", names[0], names[1], names[2], others.join(", "));
            return Err(record.missing(&also).into());
        }
        let unit = |name: &&str| record.columns()[record.find(name)?].unit.as_deref();
        let increment = |unit: &str| INCREMENTS.iter().any(|(u, _)| *u == unit);
        let increments = observed == Observed::Force && names.iter().filter_map(unit).any(increment);
        let forces = units_of_force(increments, gravity);
        let needed = |i: usize| observed != Observed::Geographic || plan.components.contains(&(i + 1));
        let mut own = Vec::new();
        for (i, name) in names.iter().enumerate() {
            match record.find(name) {
                Some(column) => own.push((i, record.wanted(column, &forces)?)),
                None if needed(i) => return Err(record.missing(&format!("`{name} [g]`")).into()),
                // Z2 of a scheme without unknown accelerometers
                None => own.push((i, wanted[0])),
            }
        }
        wanted.extend(own.iter().map(|(_, w)| *w));
        let own_forces = (observed == Observed::Force).then(|| {
            std::array::from_fn(|i| ForceColumn {
                text: record.columns()[own[i].1.column].text.clone(),
                scale: own[i].1.scale,
            })
        });
        let columns = std::array::from_fn(|i| record.columns()[own[i].1.column].text.clone());
        let time = (record.columns()[time].text.clone(), wanted[0].scale);
        let azimuth = plan.components.contains(&AZIMUTH);
        if azimuth {
            let column =
                record.find("Za").ok_or_else(|| record.missing("`Za [deg]` (the measured azimuth)"))?;
            wanted.push(record.wanted(column, &ANGLES)?);
        }
        let mut sigmas = false;
        let of_sigma: Vec<Option<usize>> = names.iter().map(|n| record.find(&format!("sigma_{n}"))).collect();
        if of_sigma.iter().any(Option::is_some) {
            sigmas = true;
            for (i, (column, name)) in of_sigma.iter().zip(names).enumerate() {
                match column {
                    Some(column) => wanted.push(record.wanted(*column, &forces)?),
                    None if needed(i) => return Err(record.missing(&format!("`sigma_{name} [g]`")).into()),
                    None => wanted.push(wanted[0]),
                }
            }
        }
        let mut gimbals = None;
        let angles = ["alpha", "beta", "gamma"];
        if angles.iter().any(|a| record.find(a).is_some()) {
            gimbals = Some(wanted.len());
            for name in angles {
                let column = record.find(name);
                let column = column.ok_or_else(|| record.missing(&format!("`{name} [deg]`")))?;
                wanted.push(record.wanted(column, &ANGLES)?);
            }
        }
        let mut temperature = None;
        if let Some(column) = record.find("T") {
            temperature = Some(wanted.len());
            wanted.push(record.wanted(column, &TEMPERATURES)?);
        }
        let label = record.find("position");
        let used = |i: usize| label == Some(i) || wanted.iter().any(|w| w.column == i);
        let ignored = record.columns().iter().enumerate().filter(|(i, _)| !used(*i));
        let ignored = ignored.map(|(_, c): (usize, &Column)| c.text.clone()).collect();
        Ok(Self {
            observed,
            forces: own_forces,
            time,
            wanted,
            azimuth,
            sigmas,
            increments,
            gimbals,
            temperature,
            label,
            ignored,
            columns,
        })
    }

    /// True if the record has the observed column `i` of three; otherwise its number is that of the time.
    fn own(&self, i: usize) -> bool {
        self.wanted[i + 1].column != self.wanted[0].column
    }

    /// Columns that are used, in their order, with the value of one of their numbers.
    fn used(&self, record: &Record) -> Vec<(String, f64)> {
        let mut all: Vec<&Wanted> = self.wanted.iter().collect();
        all.sort_by_key(|w| w.column);
        all.dedup_by_key(|w| w.column);
        all.into_iter().map(|w| (record.columns()[w.column].text.clone(), w.scale)).collect()
    }

    /// Columns with empty cells, and their number.
    fn missing(&self, columns: &[String], empty: &[usize]) -> Vec<(String, usize)> {
        let mut out: Vec<(usize, usize)> =
            self.wanted.iter().zip(empty).map(|(w, n)| (w.column, *n)).filter(|(_, n)| *n > 0).collect();
        out.sort_unstable();
        out.dedup();
        out.into_iter().map(|(c, n)| (columns[c].clone(), n)).collect()
    }

    /// Divides the increments of a row by the interval `dt` (s) into mean forces; an unknown interval leaves
    /// none.
    fn divide(&self, numbers: &mut [Option<f64>], dt: Option<f64>) {
        let first = if self.azimuth { 5 } else { 4 };
        let sigmas = if self.sigmas { first..first + 3 } else { 0..0 };
        for i in (1..4).chain(sigmas) {
            numbers[i] = numbers[i].and_then(|dv| Some(dv / dt?));
        }
    }

    /// Components 1, 2, 3 of Z in n, and the azimuth, of a row at the attitude `c`.
    fn in_n(&self, n: &[Option<f64>], c: &Matrix3<f64>) -> [Option<f64>; 4] {
        let azimuth = if self.azimuth { n[4] } else { None };
        let turned = match (n[1], n[2], n[3]) {
            (Some(x), Some(y), Some(z)) => Some(apply(c, &[x, y, z])),
            _ => None,
        };
        match self.observed {
            Observed::Geographic => [n[1], n[2], n[3], azimuth],
            Observed::Platform => [turned.map(|z| z[0]), turned.map(|z| z[1]), turned.map(|z| z[2]), azimuth],
            // Z^c = f^c + g^c
            Observed::Force => {
                [turned.map(|z| z[0]), turned.map(|z| z[1] - 1.0), turned.map(|z| z[2]), azimuth]
            }
        }
    }

    /// Angle of the turn between the gimbal readings and the attitude `c`, in deg.
    fn gimbals_off(&self, n: &[Option<f64>], c: &Matrix3<f64>) -> Option<f64> {
        let first = self.gimbals?;
        let [alpha, beta, gamma] = [n[first]?, n[first + 1]?, n[first + 2]?];
        let turn = |axis: usize, angle: f64| elementary(&Float, axis, &(angle.cos(), angle.sin()));
        let read = product(&Float, &product(&Float, &turn(0, alpha), &turn(1, beta)), &turn(2, gamma));
        let trace: f64 = (0..3).map(|i| (0..3).map(|j| read[i][j] * c[i][j]).sum::<f64>()).sum();
        Some(((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees())
    }

    /// Standard deviations of the components in n; `None` if the record has none. Those of platform axes are
    /// turned without their correlation.
    fn sigmas_in_n(&self, n: &[Option<f64>], c: &Matrix3<f64>) -> Option<[Option<f64>; 3]> {
        let first = if self.azimuth { 5 } else { 4 };
        let own = self.sigmas.then(|| [n[first], n[first + 1], n[first + 2]])?;
        if self.observed == Observed::Geographic {
            return Some(own);
        }
        let squares: Option<Vec<f64>> = own.iter().map(|s| s.map(|s| s * s)).collect();
        Some(std::array::from_fn(|i| {
            let squares = squares.as_ref()?;
            Some((0..3).map(|j| c[i][j] * c[i][j] * squares[j]).sum::<f64>().sqrt())
        }))
    }
}

/// Index of the position at a time of the scheme while Z is observed. A stamp may be late by `rounding` s
/// where one position follows another directly.
fn at_time(plan: &Plan, t: f64, rounding: f64) -> Option<usize> {
    let slew = |k: usize| plan.segments.get(k).is_none_or(|s| matches!(s.kind, SegmentKind::Slew(_)));
    let within = |(k, s): &(usize, &obsdeg_evidence::simulation::Segment)| {
        let late = if slew(*k) || slew(k + 1) { 0.0 } else { rounding };
        t > s.start_s - 1e-9 && t <= s.start_s + s.dt * s.steps as f64 + late.max(1e-9)
    };
    // a time on the border belongs to the end of the first position
    let (k, found) = plan.segments.iter().enumerate().find(within)?;
    (!slew(k)).then_some(found.position)
}

/// Row in the detector: its line, its numbers, and the interval before it.
type Kept = (u64, Vec<Option<f64>>, Option<f64>);

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
struct SampleAssignment<'a> {
    layout: &'a Layout,
    plan: &'a Plan,
    /// Bins of the components of Z, in the order of the channels.
    binner: Binner,
    out: Reading,
    /// Index of the position of the bin; `begin` is the time of the first sample.
    now: Option<usize>,
    begin: f64,
    /// Forces, and the sum and number of their lengths (`length`).
    forces: Forces,
    length: (f64, usize),
    /// Noise of a sample, in g.
    noise: f64,
    /// Time of the sample before, and the interval before that sample.
    before: Option<(f64, Option<f64>)>,
    /// Intervals between rows.
    intervals: Intervals,
    /// Detector of intervals at rest, if the file requests it.
    detector: Option<Detector<Kept>>,
    decided: Vec<DecidedSample<Kept>>,
    /// First and last time of every interval at rest.
    rests: Vec<(f64, f64)>,
    /// Samples of the bin; `rows` has the input of the robust pass, by position.
    samples: Vec<SampleRow>,
    rows: Vec<Vec<gross::Row>>,
    /// Number of empty cells at positions, by requested number.
    empty: Vec<usize>,
    /// Start of every position on the timeline of the scheme, in s.
    starts: Vec<f64>,
    /// Numbers of the current row.
    numbers: Vec<Option<f64>>,
    /// Position with the largest error of the gimbals, the error in deg, and its line.
    gimbals: Option<(usize, f64, u64)>,
}

impl SampleAssignment<'_> {
    fn names(&self) -> String {
        let names: Vec<&str> =
            self.plan.platform.scheme().positions.iter().map(|p| p.name.as_str()).collect();
        names.join(", ")
    }

    /// Position of a row.
    fn position(&self, row: &Row<'_>, t: f64, dt: Option<f64>) -> Result<Option<usize>, CalibrationError> {
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

    fn take(&mut self, row: &Row<'_>) -> Result<(), CalibrationError> {
        let Some(time) = row.numbers[0] else { return Ok(()) };
        if self.out.samples == 0 {
            self.out.span.0 = time;
        }
        self.out.span.1 = time;
        self.out.samples += 1;
        let mut numbers = std::mem::take(&mut self.numbers);
        numbers.clear();
        numbers.extend_from_slice(row.numbers);
        // codes of missing values by the file
        let codes = &self.plan.platform.scheme().recording.missing;
        if !codes.is_empty() {
            for (number, w) in numbers.iter_mut().zip(&self.layout.wanted).skip(1) {
                *number = number.filter(|x| codes.iter().all(|code| *x != code * w.scale));
            }
        }
        let dt = self.interval(time);
        if self.layout.increments {
            self.layout.divide(&mut numbers, dt);
        }
        if let Some(mut detector) = self.detector.take() {
            // a row without forces shows no rest
            if let [Some(x), Some(y), Some(z)] = numbers[1..4] {
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

    /// Interval between `time` and the sample before; `None` across a gap.
    fn interval(&mut self, time: f64) -> Option<f64> {
        let dt = self.before.map(|(t, _)| time - t);
        let regular =
            dt.filter(|dt| self.before.and_then(|(_, last)| last).is_none_or(|last| *dt <= GAP * last));
        self.before = Some((time, dt));
        regular
    }

    /// Assigns a sample that the detector has decided.
    fn at_rest(&mut self, decided: &DecidedSample<Kept>) -> Result<(), CalibrationError> {
        let Some(time) = decided.sample.1[0] else { return Ok(()) };
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
        let own_time = matches!(self.out.by, By::Label | By::Static);
        if found != self.now {
            self.end();
            if let Some(after) = self.now.and_then(|p| self.out.after.get_mut(p)) {
                *after = time - if own_time { self.begin } else { 0.0 };
            }
        }
        let Some(p) = found else {
            self.out.unused += 1;
            self.now = None;
            return Ok(());
        };
        if own_time && self.out.stays.is_empty() {
            self.begin = time;
        }
        let t = time - if own_time { self.begin } else { 0.0 };
        if self.now != Some(p) {
            // the timeline may begin late, or leave positions out
            while self.out.stays.len() <= p {
                self.out.stays.push((t, t));
                self.out.after.push(f64::INFINITY);
            }
        }
        self.now = Some(p);
        self.out.stays[p].1 = t;
        let c = &self.plan.attitudes[p];
        let waiting: Vec<Option<f64>>;
        let numbers = match self.waits(p, t, own_time) {
            true => {
                self.out.waiting += 1;
                waiting = std::iter::once(numbers[0]).chain(numbers[1..].iter().map(|_| None)).collect();
                &waiting[..]
            }
            false => numbers,
        };
        if let Some(off) = self.layout.gimbals_off(numbers, c)
            && self.gimbals.is_none_or(|(_, most, _)| off > most)
        {
            self.gimbals = Some((p, off, line));
        }
        let in_n = self.layout.in_n(numbers, c);
        // Z2 may be missing
        if let ([Some(x), Some(y), Some(z), _], true) = (in_n, self.layout.observed != Observed::Geographic) {
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
        let components = &self.plan.components;
        let mut z = [None; CHANNELS];
        for (z, &k) in z.iter_mut().zip(components) {
            *z = in_n[if k == AZIMUTH { 3 } else { k - 1 }];
        }
        let mut sigma = None;
        if let Some(own) = self.layout.sigmas_in_n(numbers, c) {
            let mut all = [f64::NAN; CHANNELS];
            for (sigma, &k) in all.iter_mut().zip(components).filter(|(_, k)| **k != AZIMUTH) {
                *sigma = own[k - 1].unwrap_or(f64::NAN);
            }
            // a value with an invalid sigma is an error; without a value the sigma does not matter
            if let Some(k) =
                (0..components.len()).find(|&k| z[k].is_some() && (all[k].is_nan() || all[k] <= 0.0))
            {
                return Err(CalibrationError::Sigma {
                    record: self.out.name.clone(),
                    line,
                    channel: channel_name(self.plan.components[k]),
                });
            }
            sigma = Some(all);
        }
        let temperature = self.layout.temperature.and_then(|i| numbers[i]);
        // a mean belongs to the middle of its interval
        let t = t - dt.filter(|_| self.layout.increments).map_or(0.0, |dt| dt / 2.0);
        let spikes = self.out.spikes.len();
        let bins = self.binner.push(Sample { line, t, z, sigma, temperature }, &mut self.out.spikes);
        for bin in bins {
            self.put_bin(p, bin, spikes);
        }
        // f = Z - g points down
        let over = in_n[1].is_some_and(|z| z < -1.0);
        let values =
            std::array::from_fn(|i| numbers[i + 1].filter(|_| self.layout.own(i)).unwrap_or(f64::NAN));
        self.samples.push(SampleRow { line, t, values, over });
        if !self.waits(p, t, own_time) {
            for (count, number) in self.empty.iter_mut().zip(numbers) {
                *count += usize::from(number.is_none());
            }
        }
        Ok(())
    }

    /// True for a row at time `t` of a position during the wait that the file states: from the first row of
    /// the position on, or from its start on the timeline of the scheme.
    fn waits(&self, p: usize, t: f64, own_time: bool) -> bool {
        let Some(settle) = self.plan.platform.scheme().recording.settle else { return false };
        match own_time {
            true => t - self.out.stays[p].0 < settle - ROUNDING_S,
            false => t - self.starts[p] <= settle + ROUNDING_S,
        }
    }

    fn end(&mut self) {
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
        let own = self.samples.partition_point(|s| s.line <= bin.lines.1);
        let samples: Vec<SampleRow> = self.samples.drain(..own).collect();
        let over = samples.iter().filter(|s| s.over).count();
        let index = self.out.bins[p].len();
        self.out.bins[p].push(bin);
        self.out.over[p].push(2 * over > samples.len());
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return };
        if samples.len() < FEWEST {
            let row = |s: &SampleRow| gross::Row {
                lines: (s.line, s.line),
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
        let lines = (first.line, last.line);
        let t = gross::median(some.map(|s| s.t).collect());
        self.rows[p].push(gross::Row { lines, t, samples: samples.len(), values: usual, bin: index });
        let inside = |s: &Spike| (lines.0..=lines.1).contains(&s.line);
        let (mut found, others): (Vec<Spike>, Vec<Spike>) = self.out.spikes.drain(spikes..).partition(inside);
        self.out.spikes.extend(others);
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
            self.cell(gross::Cell {
                row: None,
                lines: (spike.line, spike.line),
                t: spike.t,
                axis,
                value: s.values[axis],
                sigmas: spike.sigmas,
                why: gross::Why::Far,
            });
        }
    }

    /// Adds a cell that is left out, with its value as written in the record.
    fn cell(&mut self, mut cell: gross::Cell) {
        cell.value /= self.layout.wanted[cell.axis + 1].scale;
        self.out.cells.push((cell.clone(), self.layout.columns[cell.axis].clone()));
    }

    /// Checks for outputs that hold one value through a position.
    fn check_held(&self) -> Result<(), Box<Mistaken>> {
        let Some((p, axis, value)) = gross::held(&self.rows) else { return Ok(()) };
        Err(Box::new(Mistaken::Held {
            record: self.out.name.clone(),
            line: self.rows[p][0].lines.0,
            column: self.layout.columns[axis].clone(),
            value: (value / self.layout.wanted[axis + 1].scale).to_string(),
            rows: self.rows[p].iter().map(|r| r.samples).sum(),
            position: self.plan.platform.scheme().positions[p].name.clone(),
        }))
    }

    /// Leaves out the cells that a robust pass over every position finds gross. A turn (length of 1 g, at
    /// either end) is kept for the check of positions.
    fn leave_out_gross(&mut self) {
        let noise = self.noise;
        let stuck = levels::STUCK / self.rows.len().max(1) as f64;
        for p in 0..self.rows.len() {
            let rows = std::mem::take(&mut self.rows[p]);
            let mut found = gross::cells(&rows, noise, stuck);
            if self.layout.observed == Observed::Force {
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
        let all: Vec<(usize, f64)> = self.out.cells.iter().map(|(c, _)| (c.axis, c.value)).collect();
        let again = |c: &gross::Cell| all.iter().filter(|a| **a == (c.axis, c.value)).count() > 1;
        for (cell, _) in self.out.cells.iter_mut().filter(|(c, _)| c.why == gross::Why::Far && again(c)) {
            cell.why = gross::Why::Code;
        }
    }
}

/// Checks for times in another unit than that of the header: all durations then have the same ratio to those
/// of the scheme.
fn check_times(reading: &Reading, plan: &Plan, (column, scale): &(String, f64)) -> Result<(), Box<Mistaken>> {
    let dwells: Vec<f64> = bounds(plan).iter().map(|(from, to)| to - from).collect();
    let lasts: Vec<f64> = reading.stays.iter().map(|(from, to)| to - from).collect();
    let ratio = |unit: f64| scale / unit;
    let like = |unit: f64| {
        let mut each = lasts.iter().enumerate().map(|(p, lasts)| lasts / dwells[p] / ratio(unit));
        (ratio(unit).ln().abs() > 1.0) && each.all(|x| (x - 1.0).abs() < 0.1)
    };
    match TIMES.iter().find(|(_, unit)| !lasts.is_empty() && like(*unit)) {
        Some((unit, _)) => Err(Box::new(Mistaken::TimeUnit {
            record: reading.name.clone(),
            column: column.clone(),
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
    let by_clock: Vec<(f64, f64)> =
        reading.stays.iter().map(|(from, to)| (from + reading.origin, to + reading.origin)).collect();
    match timeline::begin(&by_clock, plan, tolerance) {
        Some(begin) => {
            *reading = reading.later(begin.at - reading.origin);
            (reading.by, reading.origin, reading.open) = (By::Both, begin.at, begin.open);
            reading.ends_open = false;
        }
        None => timeline::ends(&mut reading.stays, &reading.after, plan, reading.interval, tolerance),
    }
}

/// Name of a component of Z.
pub(crate) fn channel_name(component: usize) -> String {
    if component == AZIMUTH { "Za".into() } else { format!("Z{component}") }
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
    going: &dyn Fn(Going<'_>) -> bool,
) -> Result<Reading, CalibrationError> {
    let record = record.named(&plan.platform.scheme().recording)?;
    let layout = Layout::of(&record, plan, gravity)?;
    let positions = plan.platform.scheme().positions.len();
    let still = plan.platform.scheme().recording.still.as_ref().filter(|_| layout.label.is_none());
    let by = match still {
        _ if layout.label.is_some() => By::Label,
        Some(_) => By::Static,
        None => By::Timeline,
    };
    let out = Reading {
        name: record.name().into(),
        by,
        bins: vec![Vec::new(); positions],
        over: vec![Vec::new(); positions],
        origin: 0.0,
        open: None,
        interval: 1.0,
        gaps: Vec::new(),
        stays: Vec::new(),
        after: Vec::new(),
        spikes: Vec::new(),
        cells: Vec::new(),
        missing: Vec::new(),
        samples: 0,
        unused: 0,
        waiting: 0,
        span: (0.0, 0.0),
        ignored: layout.ignored.clone(),
        force: None,
        lengths: vec![None; positions],
        gimbals: None,
        digest: String::new(),
        ends_open: matches!(by, By::Label | By::Static),
        columns: layout.used(&record),
        written: record.written().map(Into::into),
    };
    let of_force = plan.components.iter().zip(&sigmas).find(|(k, _)| **k != AZIMUTH);
    let noise = of_force.map_or(0.0, |(_, sigma)| *sigma);
    let binner = Binner::new(bin_s, sigmas);
    let mut assignment = SampleAssignment {
        layout: &layout,
        plan,
        binner,
        out,
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
        starts: bounds(plan).into_iter().map(|b| b.0).collect(),
        numbers: Vec::new(),
        gimbals: None,
    };
    let (name, mut rows) = (record.name().to_string(), 0_usize);
    let record_columns: Vec<String> = record.columns().iter().map(|c| c.text.clone()).collect();
    let digest = record.read(&layout.wanted, layout.label, false, |row| {
        rows += 1;
        if rows.is_multiple_of(OFTEN) && !going(Going::Reads { record: &name, samples: rows }) {
            return Err(CalibrationError::Interrupted);
        }
        assignment.take(&row)
    })?;
    if let Some(mut detector) = assignment.detector.take() {
        let mut decided = Vec::new();
        detector.end(&mut decided);
        decided.iter().try_for_each(|one| assignment.at_rest(one))?;
        if assignment.rests.len() != positions {
            let spans: Vec<String> = assignment.rests.iter().map(|(a, b)| format!("{a} to {b}")).collect();
            return Err(CalibrationError::Rests {
                record: assignment.out.name,
                found: spans.len(),
                expected: positions,
                spans: if spans.is_empty() { String::new() } else { format!(": {} s", spans.join(", ")) },
            });
        }
    }
    assignment.end();
    assignment.check_held()?;
    assignment.forces.end();
    assignment.out.missing = layout.missing(&record_columns, &assignment.empty);
    let names: Vec<&str> =
        plan.platform.scheme().positions.iter().map(|position| position.name.as_str()).collect();
    // forces that are increments of velocity by the header, or the other way round
    let (between, gaps) = std::mem::take(&mut assignment.intervals).finish(plan);
    (assignment.out.interval, assignment.out.gaps) = (between, gaps);
    let per =
        |(u, size): (&'static str, f64)| (u, size * between.powi(if layout.increments { 1 } else { -1 }));
    let others = units_of_force(!layout.increments, gravity).map(per);
    assignment.forces.check_units(
        &assignment.out.name,
        &names,
        &plan.attitudes,
        layout.forces.as_ref(),
        &units_of_force(layout.increments, gravity),
        &others,
    )?;
    assignment.leave_out_gross();
    let inertial = plan.platform.scheme().carry == Carry::Inertial;
    assignment.forces.check_attitudes(&assignment.out.name, &names, &plan.attitudes, inertial)?;
    if matches!(by, By::Label | By::Static) {
        check_times(&assignment.out, plan, &layout.time)?;
    }
    let timeline = (by == By::Timeline).then(|| bounds(plan));
    assignment.forces.check_ends(&assignment.out.name, &names, &plan.attitudes, timeline.as_deref())?;
    if let Some((p, off, line)) = assignment.gimbals.filter(|(_, off, _)| *off > GIMBALS_DEG) {
        return Err(CalibrationError::Gimbals {
            record: assignment.out.name.clone(),
            line,
            position: plan.platform.scheme().positions[p].name.clone(),
            off_deg: format!("{off:.1}"),
        });
    }
    let (length, count) = assignment.length;
    let force = (layout.observed == Observed::Force && count > 0).then(|| length / count as f64);
    let begin = assignment.begin;
    let gimbals = assignment.gimbals.map(|(_, off, _)| off);
    let lengths = force.map(|_| assignment.forces.lengths());
    let mut out = assignment.out;
    out.lengths = lengths.unwrap_or(out.lengths);
    (out.force, out.gimbals, out.digest) = (force, gimbals, digest);
    out.origin = if matches!(by, By::Label | By::Static) { begin } else { 0.0 };
    if out.by == By::Label && out.stays.len() == positions {
        let part = plan.platform.scheme().recording.tolerance.unwrap_or(TOLERANCE);
        lay(&mut out, plan, part * between);
    }
    if let Some(p) = out.bins.iter().position(|b| b.iter().all(|b| b.channels.iter().all(Option::is_none))) {
        let scheme = plan.platform.scheme();
        return Err(CalibrationError::NoSamples {
            record: out.name,
            position: scheme.positions[p].name.clone(),
            hint: match by {
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
                    out.span.0,
                    out.span.1,
                    plan.duration_s()
                ),
            },
        });
    }
    Ok(out)
}
