//! The singular value decomposition, by one-sided Jacobi rotations.
//!
//! Hestenes 1958 (doi:10.1137/0106005): plane rotations from the right make the columns of A orthogonal;
//! their lengths are then the singular values and the product of the rotations is V. Small singular values
//! come out to their own relative precision where a column scaling is what makes A ill-conditioned (Demmel,
//! Veselic 1992, doi:10.1137/0613074).

use nalgebra::DMatrix;

use crate::error::{EkfError, check};

/// Largest number of rounds over all pairs of columns; seven or eight are usual.
const SWEEPS: usize = 60;
/// Squares of columns below this, beside a largest entry of one, count as zero.
const VANISHING: f64 = 1e-280;

/// Singular values, descending, and the right singular vectors as columns (n x n) of a matrix with at
/// least as many rows as columns.
///
/// # Errors
/// [`EkfError::NotFinite`], and [`EkfError::Singular`] should the iteration not converge.
pub fn singular_values(a: &DMatrix<f64>) -> Result<(Vec<f64>, DMatrix<f64>), EkfError> {
    let n = a.ncols();
    check("A", a, a.shape())?;
    let largest = a.amax();
    if n == 0 || largest == 0.0 {
        return Ok((vec![0.0; n], DMatrix::identity(n, n)));
    }
    // squares of its entries neither overflow nor vanish
    let scaled = a / largest;
    let mut columns = if a.nrows() > n { scaled.qr().r() } else { scaled };
    let mut v = DMatrix::identity(n, n);
    if let Some(column) = orthogonalise(&mut columns, &mut v) {
        return Err(EkfError::Singular { column });
    }
    let lengths: Vec<f64> = columns.column_iter().map(|c| c.norm()).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| lengths[j].total_cmp(&lengths[i]));
    let values = order.iter().map(|&i| lengths[i] * largest).collect();
    Ok((values, v.select_columns(&order)))
}

/// Turns pairs of columns until all are orthogonal to rounding, and those of `v` alike. Returns the
/// column that was turned last if they do not converge.
fn orthogonalise(columns: &mut DMatrix<f64>, v: &mut DMatrix<f64>) -> Option<usize> {
    let tolerance = f64::EPSILON * (columns.nrows() as f64).sqrt();
    let mut turned = None;
    for _ in 0..SWEEPS {
        turned = None;
        for j in 1..columns.ncols() {
            for i in 0..j {
                let (x, y) = (columns.column(i), columns.column(j));
                let (xx, yy, xy) = (x.norm_squared(), y.norm_squared(), x.dot(&y));
                // beside entries of one, a column whose square underflows counts as zero
                if xy.abs() <= tolerance * (xx * yy).sqrt() || xx.min(yy) < VANISHING {
                    continue;
                }
                turned = Some(j);
                let zeta = (yy - xx) / (2.0 * xy);
                let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                let cosine = 1.0 / tangent.hypot(1.0);
                rotate(columns, i, j, cosine, cosine * tangent);
                rotate(v, i, j, cosine, cosine * tangent);
            }
        }
        if turned.is_none() {
            break;
        }
    }
    turned
}

/// `(x, y)` becomes `(c x - s y, s x + c y)`, of columns i and j > i.
fn rotate(matrix: &mut DMatrix<f64>, i: usize, j: usize, c: f64, s: f64) {
    let rows = matrix.nrows();
    let (before, after) = matrix.as_mut_slice().split_at_mut(j * rows);
    for (x, y) in before[i * rows..(i + 1) * rows].iter_mut().zip(&mut after[..rows]) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The definition: V is orthogonal, A V has orthogonal columns, their lengths are the values.
        #[test]
        fn values_and_vectors(
            (m, n) in (1usize..12, 1usize..12).prop_map(|(m, n)| (m.max(n), n)),
            entries in prop::collection::vec(-3i32..4, 144),
            scales in prop::collection::vec(-12i32..13, 12),
        ) {
            let a = DMatrix::from_fn(m, n, |i, j| f64::from(entries[i * 12 + j]) * 10f64.powi(scales[j]));
            let (values, v) = singular_values(&a).expect("finite");
            prop_assert!(values.is_sorted_by(|x, y| x >= y));
            prop_assert!((v.transpose() * &v - DMatrix::identity(n, n)).amax() < 1e-13);
            let gram = (&a * &v).transpose() * (&a * &v);
            for i in 0..n {
                for j in 0..n {
                    let expected = if i == j { values[i] * values[i] } else { 0.0 };
                    prop_assert!((gram[(i, j)] - expected).abs() <= 1e-12 * values[0] * values[0]);
                }
            }
        }
    }

    #[test]
    fn small_values_keep_their_digits() {
        // columns of length 1 and 1e-20, 45 degrees apart: to first order 1 and 1e-20 sin 45
        let half = 0.5f64.sqrt();
        let a = DMatrix::from_row_slice(2, 2, &[1.0, half * 1e-20, 0.0, half * 1e-20]);
        let (values, _) = singular_values(&a).expect("finite");
        assert!((values[1] / (half * 1e-20) - 1.0).abs() < 1e-14, "{values:?}");
        let (tiny, _) = singular_values(&(a * 1e-250)).expect("finite");
        assert!((tiny[0] / 1e-250 - 1.0).abs() < 1e-14, "{tiny:?}");
    }

    #[test]
    fn nothing_is_of_rank_nothing() {
        let (values, v) = singular_values(&DMatrix::zeros(3, 2)).expect("finite");
        assert_eq!((values, v), (vec![0.0; 2], DMatrix::identity(2, 2)));
    }
}
