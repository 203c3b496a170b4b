//! Clock of a record compared with the timeline of its scheme: the beginning of the scheme by that clock, and
//! intervals with missing rows.
//!
//! A row labelled with a position lies inside it, so the first and the last row of every position bound the
//! beginning of the scheme. If these bounds contain zero, the clock of the record is that of the scheme.

use obsdeg_core::span::Span;
use obsdeg_evidence::simulation::{Plan, PlanSegment, SegmentKind};

use super::clock::bounds;

/// Ratio to the usual interval from which an interval between rows is a gap.
const GAP: f64 = 3.0;
/// Most gaps that are kept.
const MOST: usize = 1000;
/// Smallest difference of times, in s: below it they are equal but for rounding.
const ROUNDING_S: f64 = 1e-9;
/// Largest rate of a clock that is tried, as a fraction.
const FASTEST: f64 = 0.1;
/// Number of intervals of the rates of a clock at which the ends of positions are taken.
const CLOCKS: usize = 20;

/// Beginning of a scheme by the clock of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Begin {
    /// Beginning that is used, in s.
    pub at: f64,
    /// Earliest and latest beginning, in s; `None` where the beginning is that of the scheme's own clock.
    pub open: Option<Span<f64>>,
}

/// Bounds of the beginning if positions last `1 + rate` times as long as in the scheme.
fn window(stays: &[Span<f64>], bounds: &[Span<f64>], rate: f64) -> Span<f64> {
    let each = || stays.iter().zip(bounds);
    let from = each().map(|(stay, own)| stay.to - (1.0 + rate) * own.to).fold(f64::NEG_INFINITY, f64::max);
    let to = each().map(|(stay, own)| stay.from - (1.0 + rate) * own.from).fold(f64::INFINITY, f64::min);
    Span { from, to }
}

/// Beginning of the scheme by the clock of a record with the first and last rows of its positions at `stays`
/// (s). All of these lie inside the positions of the timeline, within `tolerance` s. `None` where no
/// beginning satisfies this.
pub(crate) fn begin(stays: &[Span<f64>], plan: &Plan, tolerance: f64) -> Option<Begin> {
    let Span { from, to } = window(stays, &bounds(plan), 0.0);
    let tolerance = tolerance.max(ROUNDING_S);
    if from - to > 2.0 * tolerance {
        return None;
    }
    let (from, to) = if from <= to { (from, to) } else { ((from + to) / 2.0, (from + to) / 2.0) };
    let nearest = 0.0_f64.clamp(from, to);
    let at = if nearest.abs() <= ROUNDING_S { 0.0 } else { nearest };
    let open = (at.abs() > tolerance && to - from > tolerance).then_some(Span { from, to });
    // complete rows of a position leave one interval open: its middle is as likely as any other time
    Some(Begin { at: open.map_or(at, |open| open.middle()), open })
}

/// Least and largest excess duration of the positions over the scheme, as a fraction, with which all rows lie
/// inside them.
fn rates(stays: &[Span<f64>], bounds: &[Span<f64>], tolerance: f64) -> Option<Span<f64>> {
    let beyond = |rate: f64| {
        let Span { from, to } = window(stays, bounds, rate);
        from - to - 2.0 * tolerance
    };
    // convex in the rate
    let (mut low, mut high) = (-FASTEST, FASTEST);
    for _ in 0..100 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if beyond(a) < beyond(b) { high = b } else { low = a }
    }
    let best = (low + high) / 2.0;
    let end = |mut outside: f64| {
        let mut inside = best;
        for _ in 0..60 {
            let middle = (inside + outside) / 2.0;
            if beyond(middle) <= 0.0 { inside = middle } else { outside = middle }
        }
        inside
    };
    (beyond(best) <= 0.0).then(|| Span { from: end(-FASTEST), to: end(FASTEST) })
}

/// Middle of these excess durations.
fn rate(stays: &[Span<f64>], bounds: &[Span<f64>], tolerance: f64) -> Option<f64> {
    rates(stays, bounds, tolerance).map(|rates| rates.middle())
}

/// Duration of the slew to each position, in s.
pub(crate) fn slews(plan: &Plan) -> Vec<f64> {
    let of = |p: usize| {
        let slew = |s: &&PlanSegment| s.position == p && matches!(s.kind, SegmentKind::Slew(_));
        plan.segments.iter().filter(slew).map(|s| s.dt * s.steps as f64).sum()
    };
    (0..plan.attitudes.len()).map(of).collect()
}

/// Ends of positions with other durations than in the scheme: the last row of each or, where rows are missing
/// behind it, as many intervals later as a common rate requires. `after` has the next row of any kind.
pub(crate) fn ends(stays: &mut [Span<f64>], after: &[f64], plan: &Plan, interval: f64, tolerance: f64) {
    let (own, slews) = (bounds(plan), slews(plan));
    let Some(rate) = rate(stays, &own, tolerance) else { return };
    let begin = window(stays, &own, rate).middle();
    for p in 0..stays.len() {
        let Some(next) = stays.get(p + 1) else { break };
        let room = (next.from - slews[p + 1]).min(after[p]) - stays[p].to;
        let by = (1.0 + rate) * own[p].to + begin - stays[p].to;
        // the next row is no longer at the position
        let most = ((room / interval - 0.5).floor()).max(0.0);
        stays[p].to += (by / interval).floor().clamp(0.0, most) * interval;
    }
}

/// Least and largest excess duration of all positions over the scheme, as a fraction, with which the rows of
/// all of them lie inside; `None` where no such rate exists.
pub(crate) fn by_rows(stays: &[Span<f64>], plan: &Plan) -> Option<Span<f64>> {
    rates(stays, &bounds(plan), ROUNDING_S)
}

/// Narrows what the rows beside a change of position leave open, if all positions last equally many times as
/// long as in the scheme: such a clock has one beginning, which the rows of all positions bound. `slews` has
/// the duration of the slew to each position by the clock of the record.
pub(crate) fn narrow(stays: &mut [Span<f64>], plan: &Plan, slews: &[f64]) {
    let own = bounds(plan);
    let Some(all) = rates(stays, &own, ROUNDING_S) else { return };
    // earliest and latest end of each position over all clocks
    let clocks: Vec<(f64, Span<f64>)> = (0..=CLOCKS)
        .map(|k| all.from + all.length() * k as f64 / CLOCKS as f64)
        .map(|rate| (rate, window(stays, &own, rate)))
        .collect();
    for p in 0..stays.len().saturating_sub(1) {
        let ends = clocks.iter().map(|(rate, begin)| ((1.0 + rate) * own[p].to + begin.from, begin.length()));
        let (earliest, latest) = ends
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), (end, open)| {
                (least.min(end), most.max(end + open))
            });
        stays[p].to = stays[p].to.max(earliest);
        stays[p + 1].from = stays[p + 1].from.min(latest + slews[p + 1]).max(stays[p].to + slews[p + 1]);
    }
}

/// Interval without rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RowGap {
    /// Times of the rows before (`from`) and after it, in s of the record's clock.
    pub from: f64,
    pub to: f64,
    /// Line of the row after the gap.
    pub line: u64,
    /// Positions of these rows.
    pub between: [Option<usize>; 2],
}

/// Intervals between the rows of a record.
#[derive(Debug, Clone, Default)]
pub(crate) struct Intervals {
    /// First intervals, kept until the usual one is known.
    first: Vec<RowGap>,
    usual: Option<f64>,
    last: Option<(f64, Option<usize>)>,
    found: Vec<RowGap>,
}

/// Number of intervals from which the usual interval is taken.
const FIRST: usize = 101;

impl Intervals {
    /// Adds a row.
    pub(crate) fn push(&mut self, t: f64, line: u64, position: Option<usize>) {
        if let Some((from, before)) = self.last.replace((t, position)) {
            let gap = RowGap { from, to: t, line, between: [before, position] };
            match self.usual {
                Some(usual) => self.keep(gap, usual),
                None => {
                    self.first.push(gap);
                    if self.first.len() == FIRST {
                        self.end();
                    }
                }
            }
        }
    }

    fn keep(&mut self, gap: RowGap, usual: f64) {
        if gap.to - gap.from > GAP * usual && self.found.len() < MOST {
            self.found.push(gap);
        }
    }

    /// Determines the usual interval from the first ones, at the end of the record at the latest.
    fn end(&mut self) {
        let mut all: Vec<f64> = self.first.iter().map(|g| g.to - g.from).collect();
        let middle = all.len() / 2;
        let usual = if all.is_empty() { 1.0 } else { *all.select_nth_unstable_by(middle, f64::total_cmp).1 };
        self.usual = Some(usual);
        for gap in std::mem::take(&mut self.first) {
            self.keep(gap, usual);
        }
    }

    /// Usual interval in s (one second for a single row), and the gaps; a slew within a gap does not count as
    /// missing rows.
    pub(crate) fn finish(mut self, plan: &Plan) -> (f64, Vec<RowGap>) {
        if self.usual.is_none() {
            self.end();
        }
        let usual = self.usual.unwrap_or(1.0);
        let slews = slews(plan);
        let slew = |g: &RowGap| match g.between {
            [Some(p), Some(q)] if q > p => (p + 1..=q).map(|k| slews[k]).sum(),
            _ => 0.0,
        };
        self.found.retain(|g| g.to - g.from - slew(g) > GAP * usual);
        (usual, self.found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_and_rates() {
        let own = [(0.0, 100.0), (110.0, 210.0), (220.0, 320.0)].map(Span::from);
        let stays = [(1003.0, 1100.0), (1113.0, 1209.0), (1223.0, 1320.0)].map(Span::from);
        assert_eq!(window(&stays, &own, 0.0), (1000.0, 1003.0).into());
        let slow = stays.map(|s| Span { from: 0.98 * s.from, to: 0.98 * s.to });
        let found = rate(&slow, &own, 0.0).expect("a rate");
        assert!(
            (found + 0.02).abs() < 0.01
                && rate(&[(0.0, 10.0), (400.0, 450.0)].map(Span::from), &own[..2], 0.0).is_none()
        );
    }

    #[test]
    fn gaps_are_found_when_the_usual_interval_is_known() {
        let mut of = Intervals::default();
        for k in (0..300).filter(|k| !(40..44).contains(k) && !(200..203).contains(k) && *k != 250) {
            of.push(f64::from(k) / 2.0, k as u64 + 2, None);
        }
        assert_eq!(of.usual, Some(0.5));
        let found: Vec<(f64, u64)> = of.found.iter().map(|g| (g.from, g.line)).collect();
        assert_eq!(found, [(19.5, 46), (99.5, 205)]);
    }
}
