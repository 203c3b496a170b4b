//! Record of a platform with its samples at the positions of the scheme, in bins.

use obsdeg_core::model::{AZIMUTH, Scheme};
use obsdeg_core::span::Span;
use obsdeg_evidence::simulation::Plan;

use super::clock::{by_durations, of_turns};
use super::gross::LeftOutCell;
use super::length::Length;
use super::record_columns::RecordColumns;
use super::timeline::{self, RowGap, by_rows};
use crate::answer::{self, ColumnRead, EmptyCells, PositionsBy};
use crate::bins::{Bin, Spike};
use crate::record::Record;

/// Largest deviation of the time stamps from the timeline of the scheme, as a fraction of an interval, unless
/// the file states one.
pub(super) const TOLERANCE: f64 = 0.05;

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

/// Place of a bin among those of a reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BinPlace {
    /// Index of the position.
    pub position: usize,
    /// Index of the bin within the position.
    pub index: usize,
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
    pub open: Option<Span<f64>>,
    /// True if rows alone say when positions begin and end.
    pub ends_open: bool,
    /// Usual interval between rows, in s.
    pub interval: f64,
    /// Intervals with missing rows.
    pub gaps: Vec<RowGap>,
    /// Times of the first and the last sample, by position, in s.
    pub stays: Vec<Span<f64>>,
    /// Times of the first row behind each position, in s; infinite at the end of the record.
    pub after: Vec<f64>,
    pub spikes: Vec<Spike>,
    /// Cells that are left out.
    pub cells: Vec<LeftOutCell>,
    /// Columns that were read, with their empty cells at positions.
    pub missing: Vec<EmptyCells>,
    pub samples: usize,
    /// Number of samples at no position.
    pub unused: usize,
    /// Number of samples at positions during a wait that the file states.
    pub waiting: usize,
    /// First and last time by the clock of the record, in s.
    pub span: Span<f64>,
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
    pub columns: Vec<ColumnRead>,
    /// Separator and decimal mark in words; `None` for commas and points.
    pub written: Option<String>,
}

impl By {
    /// True if rows alone say when positions begin and end: times are then those since the first row at one.
    pub(super) fn own_time(self) -> bool {
        matches!(self, Self::Label | Self::Static)
    }
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
    /// Reading of a record before its first row, with `positions` positions.
    pub(super) fn new(record: &Record, columns: &RecordColumns, by: By, positions: usize) -> Self {
        Self {
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
            span: Span::default(),
            ignored: columns.ignored.clone(),
            force: None,
            lengths: vec![None; positions],
            gimbals: None,
            digest: String::new(),
            ends_open: by.own_time(),
            columns: columns.used(record),
            written: record.written().map(Into::into),
        }
    }

    /// Bin at a place.
    pub(crate) fn bin(&self, place: &BinPlace) -> &Bin {
        &self.bins[place.position][place.index]
    }

    /// Reading with the scheme beginning `by` s later by the clock of the record.
    pub(crate) fn later(&self, by: f64) -> Self {
        let mut out = self.clone();
        out.origin += by;
        out.bins.iter_mut().flatten().for_each(|b| b.t -= by);
        out.spikes.iter_mut().for_each(|s| s.t -= by);
        out.cells.iter_mut().for_each(|c| c.cell.t -= by);
        out.stays.iter_mut().for_each(|stay| *stay = stay.later(-by));
        out.after.iter_mut().for_each(|t| *t -= by);
        out
    }

    /// Reading by a clock that is fast by the fraction `by`, corrected: all times are divided by `1 + by`.
    pub(super) fn stretched(mut self, by: f64) -> Self {
        self.bins.iter_mut().flatten().for_each(|b| b.t /= 1.0 + by);
        self.stays.iter_mut().for_each(|s| *s = Span { from: s.from / (1.0 + by), to: s.to / (1.0 + by) });
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
        let of =
            |g: &RowGap| answer::Gap { from_s: g.from, to_s: g.to, line: g.line, place: place(g.between) };
        self.gaps.iter().map(of).collect()
    }

    /// Factor by which turns last longer than in the scheme; `None` if the record does not show it.
    pub(crate) fn of_turns(&self, plan: &Plan) -> Option<f64> {
        if self.by.own_time() { of_turns(&self.stays, self.interval, &timeline::slews(plan)) } else { None }
    }

    /// Fraction by which the clock is fast, by the durations of positions; `None` if the record does not show
    /// it.
    pub(crate) fn by_durations(&self, plan: &Plan) -> Option<answer::ClockRate> {
        let used = self.samples.saturating_sub(self.unused).max(1) as f64;
        let between = self.stays.iter().map(Span::length).sum::<f64>() / used;
        match self.by {
            // the timeline of the scheme does not hold, so the rate is not zero
            By::Label => by_durations(&self.stays, between, plan, by_rows(&self.stays, plan)),
            By::Static => by_durations(&self.stays, between, plan, None),
            By::Timeline | By::Both => None,
        }
    }
}

/// Name of a component of Z.
pub(crate) fn channel_name(component: usize) -> String {
    if component == AZIMUTH { "Za".into() } else { format!("Z{component}") }
}
