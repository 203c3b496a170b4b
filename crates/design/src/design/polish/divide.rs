//! Division of the total time among the positions of a sequence, in steps of the samples.

use std::collections::BTreeMap;

use obsdeg_evidence::simulation::{left_out, steps};

use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::{Dwelling, Evaluator};
use crate::design::measure::stop::Stop;
use crate::design::request::error::DesignError;

/// Divisor of an equal dwell for the smallest time moved from one position to another (at least one
/// step).
const FINEST: usize = 256;

/// Dwells of the positions of `path` with a smaller criterion than equal ones; candidates of
/// `evaluator` are its positions in order. Dwells are multiples of the time between samples with the same
/// sum, each with at least one sample that counts. Moving the smallest time from one position to another
/// makes none of them better. `allowed` is true if dwells keep the constraints. `None` if equal dwells are
/// as good.
///
/// # Errors
/// [`DesignError::Filter`].
pub(crate) fn divide(
    evaluator: &Evaluator,
    path: &[Stop],
    criterion: &Criterion,
    allowed: &dyn Fn(&Evaluator) -> bool,
) -> Result<Option<(f64, Evaluator)>, DesignError> {
    let equal = evaluator.dwell_s();
    let samples = steps(equal, evaluator.step_s())?;
    let unit = equal / samples as f64;
    let first_counted = left_out(evaluator.settle_s(), unit);
    let mut known: BTreeMap<usize, Dwelling> = BTreeMap::new();
    let mut of = |samples: usize| -> Result<Dwelling, DesignError> {
        if let Some(dwelling) = known.get(&samples) {
            return Ok(dwelling.clone());
        }
        let dwelling = evaluator.dwelling(samples as f64 * unit)?;
        known.insert(samples, dwelling.clone());
        Ok(dwelling)
    };
    let mut now = evaluator.clone().with_dwells();
    let mut counts = vec![samples; path.len()];
    let first = now.of_sequence(path, criterion);
    let mut best = first;
    let mut moved = samples / 2;
    while moved * FINEST >= samples.max(FINEST) {
        let before = best;
        for (from, to) in (0..path.len()).flat_map(|a| (0..path.len()).map(move |b| (a, b))) {
            if from == to || counts[from] <= moved + first_counted {
                continue;
            }
            let held = [from, to].map(|i| now.dwelling_of(i).clone());
            now.dwell_at(from, &of(counts[from] - moved)?);
            now.dwell_at(to, &of(counts[to] + moved)?);
            let value = now.of_sequence(path, criterion);
            if value < best && allowed(&now) {
                best = value;
                counts[from] -= moved;
                counts[to] += moved;
            } else {
                [from, to].iter().zip(&held).for_each(|(&i, held)| now.dwell_at(i, held));
            }
        }
        if best == before {
            moved /= 2;
        }
    }
    Ok((best < first).then_some((best, now)))
}
