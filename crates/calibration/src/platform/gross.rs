//! Gross errors in cells of a record, found by a robust pass over every position before anything is
//! estimated.
//!
//! A platform at rest turns slowly, so a component is a cubic of time over some minutes. The row farthest
//! from the cubic of all others is left out, and the cubic is fitted again, until no row is far. At 120 deg/h
//! a cubic is off by four times a noise of 1e-5 g at the ends of 1000 s, so rows that fit a polynomial of the
//! fifth degree through the others come back. The scatter comes from third differences, which neither a slow
//! turn nor single rows change. Values that repeat to the last digit, and are far from their neighbours, are
//! codes of missing values.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::span::Span;

/// Length of a window that is fitted by one cubic, in s; the fewest rows of a window follow.
const WINDOW_S: f64 = 1000.0;
const FEWEST: usize = 16;
/// Number of coefficients of a cubic, and of the polynomial by which rows come back.
const CUBIC: usize = 4;
const QUINTIC: usize = 6;
/// Distance from the cubic at which a row is gross, in standard deviations.
const GROSS: f64 = 8.0;
/// Least distance of a code of missing values from its neighbours, in standard deviations.
const CODE: f64 = 20.0;
/// Largest fraction of a window that may be gross.
const MOST: f64 = 0.3;
/// Least scatter, as a fraction of the stated noise.
const LEAST: f64 = 0.1;
/// Number of neighbouring rows on either side.
const BESIDE: usize = 2;
/// Least distance of a code from its neighbours, in usual differences between rows.
const STEPS: f64 = 10.0;
/// Factor by which the scatter falls without the most frequent value, where that is a code.
const CLEARED: f64 = 5.0;
/// Number of equal rows in succession that are stuck, where values seldom repeat.
const STUCK: usize = 4;

/// Row of a record, or the median of a dense bin of rows.
#[derive(Debug, Clone)]
pub(crate) struct MedianRow {
    /// First and last line.
    pub lines: Span<u64>,
    /// Time of the row, for a median the median of its times, in s of the record's clock.
    pub t: f64,
    /// Number of samples.
    pub samples: usize,
    /// Values of the three columns, in their unit; NaN for an empty cell.
    pub values: [f64; 3],
    /// Index of the bin within its position.
    pub bin: usize,
}

/// Reason to leave a cell out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GrossReason {
    /// Far from the polynomials of the rows around it.
    Far,
    /// Code of missing values: far from its neighbours, and equal to other cells to the last digit.
    Code,
    /// Stuck output: equal to the rows before it to the last digit.
    Stuck,
}

/// Cell that is left out, with its column.
#[derive(Debug, Clone)]
pub(crate) struct LeftOutCell {
    /// Cell, with its value as written in the record.
    pub cell: GrossCell,
    /// Text of its column.
    pub column: String,
}

/// Cell that is left out.
#[derive(Debug, Clone)]
pub(crate) struct GrossCell {
    /// First and last line.
    pub lines: Span<u64>,
    /// Index of its row within its position; `None` for a sample of a dense bin.
    pub row: Option<usize>,
    pub t: f64,
    /// Index of the column, 0 to 2.
    pub axis: usize,
    /// Value of the cell, in the unit of its column.
    pub value: f64,
    /// Distance from the expected value, in standard deviations.
    pub sigmas: f64,
    pub why: GrossReason,
}

/// Median of some numbers; zero for none.
pub(crate) fn median(mut of: Vec<f64>) -> f64 {
    let middle = of.len() / 2;
    if of.is_empty() { 0.0 } else { *of.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Standard deviation of a sample, by third differences.
fn scatter(values: &[f64]) -> f64 {
    let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
    1.4826 * median(values.windows(4).map(third).collect()) / 20f64.sqrt()
}

/// Distance of the value of row `i` from its nearest neighbours; equal values are skipped.
fn beside(values: &[f64], i: usize) -> f64 {
    let other = |x: &&f64| **x != values[i];
    let left = values[..i].iter().rev().filter(other).take(BESIDE);
    let right = values[i + 1..].iter().filter(other).take(BESIDE);
    let off = left.chain(right).map(|x| values[i] - x);
    off.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
}

/// Column of a window: times, values, and weights of the rows, 1 for the usual number of samples, less for
/// fewer.
struct Window<'a> {
    t: &'a [f64],
    values: &'a [f64],
    weights: &'a [f64],
    /// Values in ascending order.
    sorted: Vec<f64>,
    /// Differences between different values next to each other in size.
    steps: Vec<f64>,
    /// Standard deviation of a row.
    s: f64,
    /// Least distance of a code from its neighbours.
    far: f64,
}

/// Gross cell of a window: index, sigmas and reason.
type GrossValue = (usize, f64, GrossReason);

impl<'a> Window<'a> {
    /// Window with a standard deviation of a row of about `noise`.
    fn new(t: &'a [f64], values: &'a [f64], weights: &'a [f64], noise: f64) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let steps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).filter(|d| *d > 0.0).collect();
        // a converter with steps above the noise
        let coarse = 2 * steps.len() < values.len();
        let step = if coarse { steps.iter().copied().fold(f64::INFINITY, f64::min) } else { 0.0 };
        // a code in many rows is in most differences of neighbours
        let often = sorted.chunk_by(|a, b| a == b).max_by_key(|equal| equal.len()).map(|equal| equal[0]);
        let others: Vec<f64> = values.iter().copied().filter(|x| Some(*x) != often).collect();
        let usual = if CLEARED * scatter(&others) < scatter(values) { &others } else { values };
        let s = scatter(usual).max(LEAST * noise).max(if step.is_finite() { step } else { 0.0 });
        let far = (CODE * s).max(STEPS * median(usual.windows(2).map(|w| (w[1] - w[0]).abs()).collect()));
        Self { t, values, weights, sorted, steps, s, far }
    }

    /// True for each row of an output that gets stuck: it holds a value that fits the row before, which a
    /// code does not.
    fn gets_stuck(&self) -> Vec<bool> {
        let values = self.values;
        let mut out = vec![false; values.len()];
        let mut start = 0;
        for run in values.chunk_by(|a, b| a == b) {
            let near = start > 0 && (values[start] - values[start - 1]).abs() <= self.far;
            out[start..start + run.len()].fill(near && run.len() >= STUCK);
            start += run.len();
        }
        out
    }

    /// Codes of missing values.
    fn codes(&self) -> Vec<GrossValue> {
        let gets_stuck = self.gets_stuck();
        let below = |is: &dyn Fn(f64) -> bool| self.sorted.partition_point(|y| is(*y));
        let count = |x: f64| below(&|y| y <= x) - below(&|y| y < x);
        let mut out = Vec::new();
        for (i, &x) in self.values.iter().enumerate() {
            let off = beside(self.values, i);
            if (x == 0.0 || count(x) > 1) && off.abs() * self.weights[i] > self.far && !gets_stuck[i] {
                out.push((i, off * self.weights[i] / self.s, GrossReason::Code));
            }
        }
        out
    }

    /// Adds the rows of a stuck output: values that hardly ever repeat, and then do many times in a row. The
    /// expected number of such successions by chance, from how often two neighbours are equal, is below
    /// `stuck`.
    fn add_stuck(&self, stuck: f64, out: &mut Vec<GrossValue>) {
        let (values, steps, n) = (self.values, &self.steps, self.values.len());
        let equal = values.windows(2).filter(|w| w[0] == w[1]).count();
        // steps of a converter below the noise, as the least difference shows them: normal values equal their
        // neighbours this often, too seldom to count; values that move by more than the noise do not
        let step_of_values = steps.iter().copied().filter(|d| *d < self.s).fold(f64::INFINITY, f64::min);
        let by_step = if step_of_values.is_finite() {
            step_of_values / (self.s * (4.0 * std::f64::consts::PI).sqrt())
        } else {
            0.0
        };
        for run in values.chunk_by(|a, b| a == b).scan(0, |at, run| {
            *at += run.len();
            Some(*at - run.len()..*at)
        }) {
            let seldom = 2 * steps.len() > n - run.len();
            let equal = equal.saturating_sub(run.len() - 1) as f64 / n as f64;
            let by_chance = n as f64 * equal.max(by_step).powi(run.len() as i32 - 1);
            let seldom = seldom && by_chance < stuck;
            if run.len() >= STUCK && seldom && out.iter().all(|o| !run.contains(&o.0)) {
                out.extend((run.start + 1..run.end).map(|i| (i, 0.0, GrossReason::Stuck)));
            }
        }
    }

    /// Time of a row, from -1 to 1 over the window.
    fn x(&self, i: usize) -> f64 {
        let (from, to) = (self.t[0], self.t[self.t.len() - 1]);
        if to > from { (2.0 * self.t[i] - from - to) / (to - from) } else { 0.0 }
    }

    /// Powers of the time (rows x `count`) at the rows `kept`, and their values.
    fn powers(&self, kept: &[usize], count: usize) -> (DMatrix<f64>, DVector<f64>) {
        let a = DMatrix::from_fn(kept.len(), count, |i, j| self.x(kept[i]).powi(j as i32));
        (a, DVector::from_fn(kept.len(), |i, _| self.values[kept[i]]))
    }

    /// Moves rows that are far from the cubic of all others from `kept` to `out`, the farthest first.
    fn add_far(&self, kept: &mut Vec<usize>, out: &mut Vec<GrossValue>) {
        while kept.len() >= FEWEST / 2 && (out.len() as f64) < MOST * self.values.len() as f64 {
            let (a, y) = self.powers(kept, CUBIC);
            let q = a.qr().q();
            let left = &y - &q * (q.transpose() * &y);
            // residual of a row from the cubic of all others
            let alone = |i: usize| {
                let free = (1.0 - q.row(i).norm_squared()).max(1e-6);
                (i, left[i] * self.weights[kept[i]] / free.sqrt() / self.s)
            };
            let furthest = (0..kept.len()).map(alone).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            let Some((i, sigmas)) = furthest.filter(|f| f.1.abs() > GROSS) else { break };
            out.push((kept.remove(i), sigmas, GrossReason::Far));
        }
    }

    /// Takes rows back that fit a polynomial of the fifth degree through the rows `kept`.
    fn take_back(&self, kept: &[usize], out: &mut Vec<GrossValue>) {
        if kept.len() < FEWEST {
            return;
        }
        let (a, y) = self.powers(kept, QUINTIC);
        if let Some(normal) = (a.transpose() * &a).cholesky() {
            let coefficients = normal.solve(&(a.transpose() * y));
            let far = |i: usize| {
                let row = DVector::from_fn(QUINTIC, |j, _| self.x(i).powi(j as i32));
                let variance = 1.0 / self.weights[i].powi(2) + row.dot(&normal.solve(&row));
                (self.values[i] - row.dot(&coefficients)).abs() > GROSS * self.s * variance.sqrt()
            };
            out.retain(|o| o.2 != GrossReason::Far || far(o.0));
        }
    }

    /// Cells whose values are gross; `stuck` as in [`Self::add_stuck`].
    fn gross(&self, stuck: f64) -> Vec<GrossValue> {
        let n = self.values.len();
        let mut out = self.codes();
        self.add_stuck(stuck, &mut out);
        let mut kept: Vec<usize> = (0..n).filter(|i| out.iter().all(|o| o.0 != *i)).collect();
        self.add_far(&mut kept, &mut out);
        self.take_back(&kept, &mut out);
        // so many are no errors of single cells
        if out.len() as f64 >= MOST * n as f64 {
            out.retain(|o| o.2 == GrossReason::Code)
        }
        out
    }
}

/// First and last row (exclusive) of every window of a position.
fn windows(rows: &[MedianRow]) -> Vec<(usize, usize)> {
    let (mut out, mut from) = (Vec::new(), 0);
    while from < rows.len() {
        let long = |to: usize| to - from >= FEWEST && rows[to - 1].t - rows[from].t >= WINDOW_S;
        let mut to = (from + 1..=rows.len()).find(|&to| long(to)).unwrap_or(rows.len());
        if rows.len() - to < FEWEST {
            to = rows.len();
        }
        out.push((from, to));
        from = to;
    }
    out
}

/// The gross cells of the rows of a position; `noise` is about the standard deviation of a sample, `stuck`
/// the probability that chance makes an output look stuck.
pub(crate) fn cells(rows: &[MedianRow], noise: f64, stuck: f64) -> Vec<GrossCell> {
    let mut out = Vec::new();
    let windows = windows(rows);
    let stuck = stuck / (3 * windows.len()) as f64;
    for &(from, to) in &windows {
        let own = &rows[from..to];
        for axis in 0..3 {
            let finite = |(_, r): &(usize, &MedianRow)| r.values[axis].is_finite();
            let there: Vec<(usize, &MedianRow)> = (from..).zip(own).filter(finite).collect();
            if there.len() < FEWEST / 2 {
                continue;
            }
            let (t, values): (Vec<f64>, Vec<f64>) = there.iter().map(|(_, r)| (r.t, r.values[axis])).unzip();
            let samples: Vec<f64> = there.iter().map(|(_, r)| r.samples as f64).collect();
            let usual = median(samples.clone());
            let weights: Vec<f64> = samples.iter().map(|n| (n / usual).min(1.0).sqrt()).collect();
            let window = Window::new(&t, &values, &weights, noise);
            out.extend(window.gross(stuck).into_iter().map(|(i, sigmas, why)| GrossCell {
                lines: there[i].1.lines,
                row: Some(there[i].0),
                t: there[i].1.t,
                axis,
                value: values[i],
                sigmas,
                why,
            }));
        }
    }
    // a run of equal values that a window ends in
    let held: Vec<(usize, f64)> =
        out.iter().filter(|c| c.why == GrossReason::Stuck).map(|c| (c.axis, c.value)).collect();
    for cell in out.iter_mut().filter(|c| held.contains(&(c.axis, c.value))) {
        (cell.why, cell.sigmas) = (GrossReason::Stuck, 0.0);
    }
    out.sort_by_key(|c| (c.lines, c.axis));
    out
}

/// Position, column and value of an output that holds one value through a position of at least [`FEWEST`]
/// rows, while most of its values differ at every other position (not so for coarse steps of a converter).
pub(crate) fn held(positions: &[Vec<MedianRow>]) -> Option<(usize, usize, f64)> {
    (0..3).find_map(|axis| {
        // number of values, and those that differ
        let values = |rows: &Vec<MedianRow>| {
            let mut out: Vec<f64> = rows.iter().map(|r| r.values[axis]).filter(|x| x.is_finite()).collect();
            out.sort_by(f64::total_cmp);
            let all = out.len();
            out.dedup();
            (all, out)
        };
        let each: Vec<(usize, Vec<f64>)> = positions.iter().map(values).collect();
        let p = each.iter().position(|(all, differ)| *all >= FEWEST && differ.len() == 1)?;
        let varies = |(q, (all, differ)): (usize, &(usize, Vec<f64>))| q == p || 2 * differ.len() > *all;
        (each.len() > 1 && each.iter().enumerate().all(varies)).then(|| (p, axis, each[p].1[0]))
    })
}

/// Largest change of the length of the force during a turn, in g; the least angle of a turn, in deg, follows.
const LONG: f64 = 1e-3;
const TURNS_DEG: f64 = 1.0;

/// Keeps rows at the beginning and the end of a position whose force has the usual length and another
/// direction: the platform turns there.
pub(crate) fn keep_turns(rows: &[MedianRow], found: &mut Vec<GrossCell>) {
    let length = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let is_found = |r: &MedianRow| found.iter().any(|c| c.lines == r.lines && c.why == GrossReason::Far);
    let good: Vec<&MedianRow> = rows.iter().filter(|r| !is_found(r)).collect();
    let (Some(first), Some(last)) = (good.first(), good.last()) else { return };
    let turns = |r: &MedianRow, beside: &MedianRow| {
        let dot: f64 = r.values.iter().zip(&beside.values).map(|(a, b)| a * b).sum();
        let (own, usual) = (length(&r.values), length(&beside.values));
        let turned = (dot / (own * usual)).clamp(-1.0, 1.0).acos().to_degrees();
        is_found(r) && (own - usual).abs() < LONG && turned > TURNS_DEG
    };
    let begin = rows.iter().take_while(|r| turns(r, first)).map(|r| r.lines);
    let end = rows.iter().rev().take_while(|r| turns(r, last)).map(|r| r.lines);
    let kept: Vec<Span<u64>> = begin.chain(end).collect();
    found.retain(|c| !kept.contains(&c.lines));
}

#[cfg(test)]
mod tests {
    use obsdeg_evidence::simulation::Noise;

    use super::*;

    /// Row `i` of a record, at time `t` (s); the header is line 1.
    fn row(i: usize, t: f64, values: [f64; 3]) -> MedianRow {
        let line = i as u64 + 2;
        MedianRow { lines: Span { from: line, to: line }, t, samples: 1, values, bin: i }
    }

    /// Rows of a platform that drifts by thirteen degrees an hour about its second axis, with noise of 1e-5.
    fn rows(seed: u64) -> Vec<MedianRow> {
        let mut noise = Noise::new(seed, 0);
        let of = |i: usize| {
            let t = 10.0 * i as f64;
            let angle = 0.3 + 6.3e-5 * t;
            let values = [angle.cos(), 0.2, angle.sin()].map(|x: f64| x + 1e-5 * noise.normal());
            row(i, t, values)
        };
        (0..250).map(of).collect()
    }

    #[test]
    fn what_is_gross_is_found_and_no_more() {
        for seed in 0..20 {
            let right = rows(seed);
            assert!(cells(&right, 1e-5, 5e-4).is_empty(), "{:?}", cells(&right, 1e-5, 5e-4));
            let mut spoiled = right.clone();
            spoiled[0].values[0] += 0.1;
            spoiled[60].values[2] -= 2e-4;
            spoiled[130].values[1] = -9999.0;
            (160..172).for_each(|i| spoiled[i].values[0] = 0.0);
            let held = spoiled[200].values[2];
            (200..206).for_each(|i| spoiled[i].values[2] = held);
            let found = cells(&spoiled, 1e-5, 5e-4);
            let mut expected: Vec<(u64, usize, GrossReason)> =
                vec![(2, 0, GrossReason::Far), (62, 2, GrossReason::Far), (132, 1, GrossReason::Far)];
            expected.extend((162..174).map(|line| (line, 0, GrossReason::Code)));
            expected.extend((203..208).map(|line| (line, 2, GrossReason::Stuck)));
            let found: Vec<_> = found.iter().map(|c| (c.lines.from, c.axis, c.why)).collect();
            assert_eq!(found, expected, "{seed}");
        }
    }

    /// Right rows at ten times the paper's drifts are no gross errors, and a bad row at the end of a position
    /// is.
    #[test]
    fn fast_drifts_are_right() {
        let mut found = 0;
        for seed in 0..20 {
            let mut noise = Noise::new(seed, 0);
            let of = |i: usize| {
                let angle = 0.1 * seed as f64 + 130f64.to_radians() / 3600.0 * 10.0 * i as f64;
                let values = [angle.cos(), 0.0, angle.sin()].map(|x: f64| x + 1e-5 * noise.normal());
                row(i, 10.0 * i as f64, values)
            };
            let mut rows: Vec<MedianRow> = (0..101).map(of).collect();
            assert!(cells(&rows, 1e-5, 5e-4).is_empty(), "{seed}: {:?}", cells(&rows, 1e-5, 5e-4));
            rows[100].values[0] += 3e-4;
            found += usize::from(cells(&rows, 1e-5, 5e-4).iter().any(|c| c.lines.from == 102));
        }
        assert_eq!(found, 20);
    }

    /// Four equal values of a converter in succession are no stuck output where its steps are a tenth of the
    /// noise: of 3 million values in windows of a hundred some sixty begin such a succession (1/35 to the
    /// third).
    #[test]
    fn successions_by_chance_are_right() {
        let mut noise = Noise::new(5, 0);
        let (mut successions, mut found) = (0, 0);
        for _ in 0..10_000 {
            let of = |i: usize| {
                let values = [0; 3].map(|_| (10.0 * noise.normal()).round() * 1e-6);
                row(i, 10.0 * i as f64, values)
            };
            let own: Vec<MedianRow> = (0..100).map(of).collect();
            let equal = |w: &&[MedianRow]| (0..3).any(|k| w.iter().all(|r| r.values[k] == w[0].values[k]));
            successions += own.windows(4).filter(equal).count();
            found += usize::from(cells(&own, 1e-5, 5e-4).iter().any(|c| c.why == GrossReason::Stuck));
        }
        assert!(successions > 20 && found <= 15, "{successions} {found}");
    }

    /// Values in steps of a converter repeat, and are no codes.
    #[test]
    fn steps_of_a_converter_are_right() {
        for quantum in [1e-6, 2e-5, 1e-4] {
            let mut all = rows(3);
            all.iter_mut().for_each(|r| r.values = r.values.map(|x| (x / quantum).round() * quantum));
            assert!(cells(&all, 1e-5, 5e-4).is_empty(), "{quantum}: {:?}", cells(&all, 1e-5, 5e-4));
        }
    }
}
