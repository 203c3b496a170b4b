//! Dependencies among the columns of a dense matrix over the field.

use crate::Field;
use crate::groebner::{OverLimit, RemainingWork};

/// Row echelon form of a matrix, columns from left to right: every column is a pivot or depends on pivots
/// before it.
#[derive(Debug, Clone)]
pub struct ColumnEchelon {
    field: Field,
    /// Rows in echelon form, one per pivot, with a one at their pivots.
    rows: Vec<Vec<u64>>,
    pivots: Vec<usize>,
    free: Vec<usize>,
}

impl ColumnEchelon {
    /// The echelon form of `rows` (each of `columns` entries).
    ///
    /// # Errors
    /// [`OverLimit`] when `work` is used up; a product of two entries is one unit.
    pub fn new(
        f: &Field,
        columns: usize,
        mut rows: Vec<Vec<u64>>,
        work: &mut RemainingWork,
    ) -> Result<Self, OverLimit> {
        let (mut pivots, mut free) = (Vec::new(), Vec::new());
        for column in 0..columns {
            let top = pivots.len();
            let Some(found) = (top..rows.len()).find(|&r| rows[r][column] != 0) else {
                free.push(column);
                continue;
            };
            rows.swap(top, found);
            let inverse = f.inv(rows[top][column]);
            rows[top][column..].iter_mut().for_each(|x| *x = f.mul(*x, inverse));
            let (above, below) = rows.split_at_mut(top + 1);
            work.take(((below.len() + 1) * (columns - column)) as u64)?;
            let pivot = &above[top][column..];
            for row in below {
                let factor = f.neg(row[column]);
                if factor != 0 {
                    for (x, &p) in row[column..].iter_mut().zip(pivot) {
                        *x = f.add(*x, f.mul(factor, p));
                    }
                }
            }
            pivots.push(column);
        }
        rows.truncate(pivots.len());
        Ok(Self { field: *f, rows, pivots, free })
    }

    /// The rank.
    pub fn rank(&self) -> usize {
        self.pivots.len()
    }

    /// Columns that depend on pivots before them, in order.
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// The dependency of a free column on the pivots before it: coefficients `c`, shape `column + 1`, with
    /// `sum_j c_j column_j = 0` and a one at the last place. It is the only one of this form.
    pub fn dependency(&self, column: usize) -> Vec<u64> {
        let f = &self.field;
        let mut out = vec![0; column + 1];
        out[column] = f.one();
        for (row, &pivot) in self.rows.iter().zip(&self.pivots).rev() {
            if pivot < column {
                let later = row[pivot + 1..=column].iter().copied().zip(out[pivot + 1..].iter().copied());
                out[pivot] = f.neg(f.dot(0, later));
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ENOUGH: RemainingWork = RemainingWork::new(1_000_000);

    proptest! {
        /// Dependent columns are found, with the coefficients that they were made with.
        #[test]
        fn made_columns_are_found(
            entries in prop::collection::vec(1u64..1 << 60, 6 * 8),
            made in prop::collection::vec(-9i64..9, 3),
        ) {
            let f = Field::new((1 << 60) + 33);
            // six rows; columns 0, 1, 2 at random, column 3 a combination, column 4 at random
            let rows: Vec<Vec<u64>> = entries.chunks(8).map(|e| {
                let x: Vec<u64> = e.iter().map(|&x| f.from_u64(x)).collect();
                let sum = (0..3).fold(0, |s, j| f.add(s, f.mul(f.from_i64(made[j]), x[j])));
                vec![x[0], x[1], x[2], sum, x[3]]
            }).collect();
            let echelon = ColumnEchelon::new(&f, 5, rows.clone(), &mut ENOUGH.clone()).expect("enough work");
            prop_assume!(echelon.rank() == 4);
            prop_assert_eq!(echelon.free(), &[3]);
            let c = echelon.dependency(3);
            let expected: Vec<u64> = made.iter().map(|&m| f.from_i64(-m)).chain([f.one()]).collect();
            prop_assert_eq!(c, expected);
        }
    }

    #[test]
    fn work_is_limited() {
        let f = Field::new((1 << 60) + 33);
        let rows = vec![vec![f.one(); 4]; 4];
        assert!(ColumnEchelon::new(&f, 4, rows, &mut RemainingWork::new(3)).is_err());
    }
}
