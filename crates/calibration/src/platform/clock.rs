//! Whether the clock of a record is right, by when positions begin and end beside the scheme.

use obsdeg_evidence::simulation::{Plan, SegmentKind};

/// So many intervals between samples a run must be longer or shorter to be told from how samples fall.
const TOLD: f64 = 4.0;

/// A straight line of times of a record over those of the scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Line {
    /// What the record has at 0, in s.
    pub at_zero: f64,
    /// How much faster its clock runs, as a part.
    pub fast: f64,
    /// The points are within this of it, in s.
    pub within: f64,
}

/// The line through points (scheme, record) in s, by least squares; none through fewer than three.
pub(crate) fn line(points: &[(f64, f64)]) -> Option<Line> {
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
    Some(Line { at_zero, fast: slope - 1.0, within: points.iter().map(off).fold(0.0, f64::max) })
}

/// A clock in words.
pub(crate) fn words(fast: f64) -> String {
    format!("a clock that is {:.2} % {}", 100.0 * fast.abs(), if fast < 0.0 { "slow" } else { "fast" })
}

/// When every position of the scheme begins and ends, in s.
pub(crate) fn bounds(plan: &Plan) -> Vec<(f64, f64)> {
    let mut out: Vec<(f64, f64)> = Vec::new();
    for s in plan.segments.iter().filter(|s| !matches!(s.kind, SegmentKind::Slew(_))) {
        let end = s.start_s + s.dt * s.steps as f64;
        match out.get_mut(s.position) {
            Some(bound) => bound.1 = end,
            None => out.push((s.start_s, end)),
        }
    }
    out
}

/// How much faster the clock of a record runs than that of the scheme, as a part, where its positions begin
/// and end, at `stays`, as they would by such a clock and not by a right one; `between` two samples there are
/// so many s. Positions that begin late or end early all alike are no matter.
pub(crate) fn by_durations(stays: &[(f64, f64)], between: f64, plan: &Plan) -> Option<f64> {
    let bounds = bounds(plan);
    let each = bounds.iter().zip(stays);
    let points: Vec<(f64, f64)> =
        each.flat_map(|(scheme, stay)| [(scheme.0, stay.0), (scheme.1, stay.1)]).collect();
    let line = line(&points)?;
    let whole = points.last()?.0 - points.first()?.0;
    (line.within <= TOLD / 2.0 * between && line.fast.abs() * whole > TOLD * between).then_some(line.fast)
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
