//! Dependencies among the columns of a dense matrix over the field.

use crate::Field;
use crate::groebner::{OverLimit, RemainingWork};

/// Number of pivot rows that are subtracted in one pass over a row.
const BLOCK: usize = 4;

/// Row echelon form of a matrix, columns from left to right: every column is a pivot or depends on pivots
/// before it.
#[derive(Debug, Clone)]
pub struct ColumnEchelon {
    field: Field,
    /// One row per pivot, by pivot, with a one at its pivot and zeros before it.
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
        rows: Vec<Vec<u64>>,
        work: &mut RemainingWork,
    ) -> Result<Self, OverLimit> {
        let mut out = Self { field: *f, rows: Vec::new(), pivots: Vec::new(), free: Vec::new() };
        let mut sums: Vec<u128> = Vec::new();
        for row in rows {
            if out.rank() == columns {
                break;
            }
            work.take(out.pivots.iter().map(|p| (columns - p) as u64).sum::<u64>() + columns as u64)?;
            sums.clear();
            sums.extend(row.iter().map(|&x| f.lazy(f.one(), x)));
            let mut new = out.reduced(&mut sums);
            let Some(pivot) = new.iter().position(|&x| x != 0) else { continue };
            let inverse = f.inv(new[pivot]);
            new[pivot..].iter_mut().for_each(|x| *x = f.mul(*x, inverse));
            let place = out.pivots.partition_point(|&p| p < pivot);
            out.pivots.insert(place, pivot);
            out.rows.insert(place, new);
        }
        out.free = (0..columns).filter(|c| out.pivots.binary_search(c).is_err()).collect();
        Ok(out)
    }

    /// The row of the given sums (each of one product) less the multiples of the pivot rows that make it
    /// zero at all pivots.
    fn reduced(&self, sums: &mut [u128]) -> Vec<u64> {
        let f = &self.field;
        let mut pending = 1;
        for (rows, pivots) in self.rows.chunks(BLOCK).zip(self.pivots.chunks(BLOCK)) {
            if pending + BLOCK > Field::MANY {
                sums[pivots[0]..].iter_mut().for_each(|s| *s = f.settle_many(*s));
                pending = 0;
            }
            // the factor of each row, from the entries at its pivot of the rows before it
            let mut factors = [0; BLOCK];
            for (i, &p) in pivots.iter().enumerate() {
                let before = rows[..i].iter().zip(&factors);
                let sum = before.fold(sums[p], |sum, (row, &factor)| sum + f.lazy(factor, row[p]));
                factors[i] = f.neg(f.reduce_many(sum));
            }
            let from = pivots[0];
            let sums = &mut sums[from..];
            if let [a, b, c, d] = rows {
                let both = a[from..].iter().zip(&b[from..]).zip(c[from..].iter().zip(&d[from..]));
                for (s, ((&a, &b), (&c, &d))) in sums.iter_mut().zip(both) {
                    let first = f.lazy(factors[0], a) + f.lazy(factors[1], b);
                    *s += first + f.lazy(factors[2], c) + f.lazy(factors[3], d);
                }
            } else {
                for (row, &factor) in rows.iter().zip(&factors) {
                    for (s, &x) in sums.iter_mut().zip(&row[from..]) {
                        *s += f.lazy(factor, x);
                    }
                }
            }
            pending += BLOCK;
        }
        sums.iter().map(|&s| f.reduce_many(s)).collect()
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
