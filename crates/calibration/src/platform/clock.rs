//! Clock of a record, checked by the times at which positions begin and end, compared with the scheme.

use obsdeg_core::span::Span;
use obsdeg_evidence::simulation::{Plan, SegmentKind};

use crate::answer::ClockRate;

/// Smallest difference of durations that is significant, in intervals between samples.
const SIGNIFICANT: f64 = 4.0;

/// Straight line of the times of a record over those of the scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ClockLine {
    /// Time of the record at time 0 of the scheme, in s.
    pub at_zero: f64,
    /// Excess rate of the record's clock, as a fraction.
    pub fast: f64,
    /// Largest distance of a point from the line, in s.
    pub within: f64,
    /// Standard deviation of `fast` for times of the record with one of 1 s.
    pub sigma: f64,
}

/// Least-squares line through points (scheme, record) in s; `None` for fewer than three points.
pub(crate) fn line(points: &[(f64, f64)]) -> Option<ClockLine> {
    let n = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let along: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    if points.len() < 3 || along <= 0.0 {
        return None;
    }
    let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / along;
    let at_zero = y - slope * x;
    let off = |p: &(f64, f64)| (p.1 - at_zero - slope * p.0).abs();
    Some(ClockLine {
        at_zero,
        fast: slope - 1.0,
        within: points.iter().map(off).fold(0.0, f64::max),
        sigma: along.powf(-0.5),
    })
}

/// Description of a clock in words.
pub(crate) fn words(fast: f64) -> String {
    format!("a clock that is {:.2} % {}", 100.0 * fast.abs(), if fast < 0.0 { "slow" } else { "fast" })
}

/// Begin and end of every position of the scheme, in s.
pub(crate) fn bounds(plan: &Plan) -> Vec<Span<f64>> {
    let mut out: Vec<Span<f64>> = Vec::new();
    for s in plan.segments.iter().filter(|s| !matches!(s.kind, SegmentKind::Slew(_))) {
        let end = s.start_s + s.dt * s.steps as f64;
        match out.get_mut(s.position) {
            Some(bound) => bound.to = end,
            None => out.push(Span { from: s.start_s, to: end }),
        }
    }
    out
}

/// Excess rate of a record's clock by its positions `stays` (begin and end), as a fraction; `between` is the
/// time between two samples, in s: a begin or an end is equally likely anywhere in it. `None` unless such a
/// clock explains the positions and a right one does not: by far or, for `inside`, with the least and the
/// largest rate by which all rows lie inside their positions. A common delay of begins or ends has no effect.
pub(crate) fn by_durations(
    stays: &[Span<f64>],
    between: f64,
    plan: &Plan,
    inside: Option<Span<f64>>,
) -> Option<ClockRate> {
    let bounds = bounds(plan);
    let each = bounds.iter().zip(stays);
    let points: Vec<(f64, f64)> =
        each.flat_map(|(scheme, stay)| [(scheme.from, stay.from), (scheme.to, stay.to)]).collect();
    let line = line(&points)?;
    let whole = points.last()?.0 - points.first()?.0;
    let explains = line.within <= SIGNIFICANT / 2.0 * between;
    let of = |width: f64| width / 12f64.sqrt();
    let sigma = of(between) * line.sigma;
    let far =
        || (line.fast.abs() * whole > SIGNIFICANT * between).then_some(ClockRate { fast: line.fast, sigma });
    let middle = |rates: Span<f64>| ClockRate { fast: rates.middle(), sigma: sigma.max(of(rates.length())) };
    if explains { inside.map(middle).or_else(far) } else { None }
}

/// Factor by which the turns of a record last longer than in the scheme: the slope of the times between the
/// positions `stays` (begin and end) over the durations of the slews. `between` is the time between two
/// samples, in s. `None` unless such a factor explains these times and one does not; a common time to settle
/// has no effect.
pub(crate) fn of_turns(stays: &[Span<f64>], between: f64, slews: &[f64]) -> Option<f64> {
    let each = (1..stays.len()).map(|p| (slews[p], stays[p].from - stays[p - 1].to));
    let points: Vec<(f64, f64)> = each.collect();
    let line = line(&points)?;
    let ends = points.iter().fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), p| (a.min(p.0), b.max(p.0)));
    let explains = line.within <= SIGNIFICANT / 2.0 * between;
    (explains && line.fast.abs() * (ends.1 - ends.0) > SIGNIFICANT * between).then_some(1.0 + line.fast)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines() {
        let points = [(0.0, 3.0), (100.0, 104.0), (300.0, 306.0)];
        let found = line(&points).expect("a line");
        assert!(
            (found.fast - 0.01).abs() < 1e-12 && (found.at_zero - 3.0).abs() < 1e-9 && found.within < 1e-9
        );
        assert_eq!((line(&points[..2]), line(&[(1.0, 1.0); 3])), (None, None));
    }
}
