//! Choice of the observable rows of a short solution.

use obsdeg_exact::echelon::{express, nonzero_columns};
use obsdeg_exact::{Echelon, Field};

/// Number of orders of the rows that are tried.
const ORDERS: usize = 12;

/// Independent rows (indices into `rows`, ascending) out of `allowed` whose combination gives `target` with
/// no coefficient zero. Of the sets that different row orders give, the cheapest by the sum of `cost` is
/// taken. `None` if `target` is not in the span.
pub(crate) fn short_support(
    field: Field,
    rows: &[Vec<u64>],
    allowed: &[usize],
    target: &[u64],
    cost: impl Fn(usize) -> usize,
) -> Option<Vec<usize>> {
    let mut best: Option<(usize, usize, Vec<usize>)> = None;
    // rows that share a column with the target come first; no row is taken once the target is in the span
    let wanted: Vec<usize> = (0..target.len()).filter(|&c| target[c] != 0).collect();
    let (near, far): (Vec<usize>, Vec<usize>) =
        allowed.iter().partition(|&&j| wanted.iter().any(|&c| rows[j][c] != 0));
    let rotated = |list: &[usize], k: usize| -> Vec<usize> {
        let shift = k * list.len().div_ceil(ORDERS / 2);
        let (head, tail) = list.split_at(shift.min(list.len()));
        tail.iter().chain(head).copied().collect()
    };
    for k in 0..ORDERS / 2 {
        let (near, far) = (rotated(&near, k), rotated(&far, k));
        let backward: Vec<usize> = near.iter().rev().chain(far.iter().rev()).copied().collect();
        for order in [[near, far].concat(), backward] {
            let independent = spanning(field, rows, &order, target);
            let refs: Vec<&[u64]> = independent.iter().map(|&j| rows[j].as_slice()).collect();
            let y = express(field, &refs, target)?;
            let mut used: Vec<usize> =
                independent.iter().zip(&y).filter(|(_, y)| **y != 0).map(|(&j, _)| j).collect();
            used.sort_unstable();
            let key = (used.iter().map(|&j| cost(j)).sum(), used.len());
            if best.as_ref().is_none_or(|(a, b, _)| key < (*a, *b)) {
                best = Some((key.0, key.1, used));
            }
        }
    }
    best.map(|(_, _, used)| used)
}

/// First independent rows, in the given order, up to the one with which `target` is in their span. Most
/// targets are in the span of a few rows out of many columns, so the columns grow with the rows that are
/// examined.
fn spanning(field: Field, rows: &[Vec<u64>], order: &[usize], target: &[u64]) -> Vec<usize> {
    let mut looked_at = 16.min(order.len());
    loop {
        let seen = order[..looked_at].iter().map(|&j| rows[j].as_slice());
        let columns = nonzero_columns(target.len(), seen.chain([target]));
        let short = |row: &[u64]| -> Vec<u64> { columns.iter().map(|&c| row[c]).collect() };
        let (mut basis, target) = (Echelon::new(field, columns.len()), short(target));
        let mut independent: Vec<usize> = Vec::new();
        for &j in &order[..looked_at] {
            if basis.insert(&short(&rows[j])) {
                independent.push(j);
                if basis.contains(&target) {
                    return independent;
                }
            }
        }
        if looked_at == order.len() {
            return independent;
        }
        looked_at = (4 * looked_at).min(order.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_the_short_way() {
        let f = Field::new((1 << 60) + 33);
        let rows: Vec<Vec<u64>> = [[1, 1, 1], [0, 1, 1], [1, 1, 0], [0, 1, 0]]
            .map(|r| r.map(|a: i64| f.from_i64(a)).to_vec())
            .to_vec();
        let e0 = [f.one(), 0, 0];
        let found = short_support(f, &rows, &[0, 1, 2, 3], &e0, |_| 1);
        assert!(found == Some(vec![0, 1]) || found == Some(vec![2, 3]), "{found:?}");
        assert_eq!(
            short_support(f, &rows, &[0, 1, 2, 3], &e0, |j| if j < 2 { 5 } else { 1 }),
            Some(vec![2, 3])
        );
        assert_eq!(short_support(f, &rows, &[1], &e0, |_| 1), None);
    }
}
