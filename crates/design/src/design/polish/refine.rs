//! Continuous refinement of the Euler angles of a sequence for a smaller criterion (COBYLA: M. J. D.
//! Powell, 1994).

use cobyla::{RhoBeg, StopTols, minimize};
use obsdeg_core::model::{Angle, Euler, Gimbals, c_n_f64};

use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::Evaluator;
use crate::design::measure::stop::Stop;

/// Largest number of evaluations of the criterion.
const EVALUATIONS: usize = 20_000;
/// First changes of the angles, in degrees, one run each.
const STEPS: [f64; 3] = [20.0, 5.0, 1.0];
/// Step to which angles are rounded, in 1e-9 degrees.
const ROUNDED: i64 = 10_000_000;

/// Sequence of attitudes near `start` with a smaller criterion, within the gimbal limits, angles in
/// hundredths of a degree. `allowed` receives the evaluator whose candidates are the attitudes; `path`
/// is the sequence through them. `None` if none was found.
pub(crate) fn refine(
    evaluator: &Evaluator,
    start: &[Euler],
    path: &[Stop],
    criterion: &Criterion,
    gimbals: &Gimbals,
    allowed: &dyn Fn(&Evaluator) -> bool,
) -> Option<(f64, Vec<Euler>)> {
    let euler = |x: &[f64], unit: i64| -> Vec<Euler> {
        let angle = |deg: f64| Angle::from_nanodeg((deg * 1e9 / unit as f64).round() as i64 * unit);
        x.chunks_exact(3).map(|a| std::array::from_fn(|k| angle(a[k]))).collect()
    };
    let value = |attitudes: &[Euler]| {
        if !attitudes.iter().all(|a| gimbals.reach(a)) {
            return f64::INFINITY;
        }
        let there = evaluator.along(&attitudes.iter().map(c_n_f64).collect::<Vec<_>>());
        if allowed(&there) { there.of_sequence(path, criterion) } else { f64::INFINITY }
    };
    let degrees = |e: &Euler| e.each_ref().map(|a| a.nanodeg() as f64 / 1e9);
    let mut x: Vec<f64> = start.iter().flat_map(degrees).collect();
    let first = value(start);
    let mut best = first;
    // penalty outside the constraints: ten times the value at the start
    let objective = |x: &[f64], _: &mut ()| value(&euler(x, 1)).min(10.0 * first);
    let no_constraints: [fn(&[f64], &mut ()) -> f64; 0] = [];
    let bounds = vec![(-400.0, 400.0); x.len()];
    for step in STEPS {
        let stop = StopTols { xtol_abs: vec![ROUNDED as f64 / 1e9; x.len()], ..StopTols::default() };
        let found =
            minimize(objective, &x, &bounds, &no_constraints, (), EVALUATIONS, RhoBeg::All(step), Some(stop));
        let (_, found, _) = found.unwrap_or_else(|(_, x, _)| (cobyla::SuccessStatus::Success, x, 0.0));
        let there = value(&euler(&found, ROUNDED));
        if there < best {
            (x, best) = (found, there);
        }
    }
    (best < first).then(|| (best, euler(&x, ROUNDED)))
}
