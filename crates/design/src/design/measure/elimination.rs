//! Elimination of unknowns from an information matrix.

use std::ops::Range;

/// Schur complement of the unknowns `pivots` of a symmetric matrix (n x n, lower triangle); rows before
/// them must be zero, those of the pivots are set to zero.
pub(crate) fn eliminate<const N: usize>(m: &mut [[f64; N]], n: usize, pivots: Range<usize>) {
    for p in pivots {
        let pivot = m[p][p];
        if pivot <= 0.0 {
            continue;
        }
        let column: [f64; N] = std::array::from_fn(|i| if i < n && i >= p { m[i][p] } else { 0.0 });
        for i in p + 1..n {
            for j in p + 1..=i {
                m[i][j] -= column[i] * column[j] / pivot;
            }
        }
        for row in m.iter_mut().take(n).skip(p) {
            row[p] = 0.0;
        }
    }
}
