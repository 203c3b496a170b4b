//! Degrees of all unknowns under any set of outputs, by the ranks of their rows at one point.

use std::sync::Mutex;

use obsdeg_core::system::PointRows;
use obsdeg_exact::{Field, Gap, Reals, RowSpace, Scalars};

/// Set of candidates, one bit each.
pub type Set = u64;

/// Degree of an unknown that is not observable.
pub(crate) const NONE: u16 = u16::MAX;

/// Degrees under sets of candidates at one point.
pub trait Ranks: Sync {
    /// Degree of every unknown in question, `u16::MAX` where it is not observable.
    fn degrees(&self, set: Set) -> Box<[u16]>;

    /// True if every decision so far was clear.
    fn is_clear(&self) -> bool {
        true
    }
}

/// Row with its order, the candidates that must all be in a set for the row to be present (empty: present
/// under every set), and its index among all rows.
#[derive(Debug, Clone, Copy)]
struct Row {
    order: usize,
    owner: Set,
    start: usize,
}

/// Rows of all candidates at one point, sorted by order.
#[derive(Debug)]
pub struct Ordered<S: Scalars> {
    field: S,
    columns: usize,
    rows: Vec<Row>,
    entries: Vec<S::Element>,
    /// Columns of the unknowns in question.
    asked: Vec<usize>,
    gap: Mutex<Gap>,
}

impl<S: Scalars> Ordered<S> {
    /// Sorts the rows of all outputs. `owners` are the candidates that each output needs, a set; `asked` are
    /// the columns of the unknowns in question.
    pub fn new(point: &PointRows<S>, owners: &[Set], asked: &[usize]) -> Self {
        let mut all: Vec<(usize, Set, &[S::Element])> =
            point.known.iter().map(|row| (0, 0, row.as_slice())).collect();
        for (owner, rows) in owners.iter().zip(&point.outputs) {
            all.extend(rows.iter().map(|(order, row)| (*order, *owner, row.as_slice())));
        }
        all.sort_by_key(|(order, owner, _)| (*order, *owner));
        let mut entries = Vec::with_capacity(all.len() * point.columns);
        let mut rows = Vec::with_capacity(all.len());
        for (order, owner, row) in all {
            rows.push(Row { order, owner, start: entries.len() });
            entries.extend_from_slice(row);
        }
        let (field, columns, asked) = (point.field.clone(), point.columns, asked.to_vec());
        Self { field, columns, rows, entries, asked, gap: Mutex::new(point.gap) }
    }

    /// Adds the rows of a set to a space, order by order, until no more unknowns can become observable.
    fn climb<B: Basis<S::Element>>(&self, set: Set, basis: &mut B) -> Box<[u16]> {
        let mut degrees = vec![NONE; self.asked.len()].into_boxed_slice();
        let (mut open, mut rows) = (self.asked.len(), self.rows.as_slice());
        while let Some(first) = rows.first().filter(|_| open > 0) {
            let order = first.order;
            let (now, later) = rows.split_at(rows.partition_point(|row| row.order == order));
            rows = later;
            let mut grew = false;
            for row in now.iter().filter(|row| row.owner & !set == 0) {
                if basis.is_full() {
                    break;
                }
                grew |= basis.add(&self.entries[row.start..row.start + self.columns]);
            }
            if !grew {
                continue;
            }
            for (degree, &column) in degrees.iter_mut().zip(&self.asked).filter(|(d, _)| **d == NONE) {
                if basis.holds_unit(column) {
                    *degree = order as u16;
                    open -= 1;
                }
            }
        }
        degrees
    }
}

/// Row space that rows are added to.
trait Basis<E> {
    /// Adds a row; true if the rank grew.
    fn add(&mut self, row: &[E]) -> bool;
    /// True if the rank is full.
    fn is_full(&self) -> bool;
    /// True if the unit vector of a column is in the space.
    fn holds_unit(&self, column: usize) -> bool;
}

impl Ranks for Ordered<Field> {
    fn degrees(&self, set: Set) -> Box<[u16]> {
        self.climb(set, &mut Compact::new(self.field, self.columns))
    }
}

impl<const N: usize> Ranks for Ordered<Reals<N>>
where
    Reals<N>: Scalars + Sync,
    <Reals<N> as Scalars>::Element: Sync,
{
    fn degrees(&self, set: Set) -> Box<[u16]> {
        let mut space = AnyBasis(<<Reals<N> as Scalars>::Space as RowSpace>::new(Reals::<N>, self.columns));
        let degrees = self.climb(set, &mut space);
        if let Ok(mut gap) = self.gap.lock() {
            *gap = gap.and(space.0.gap());
        }
        degrees
    }

    fn is_clear(&self) -> bool {
        self.gap.lock().is_ok_and(|gap| gap.is_decisive(64 * N as i64))
    }
}

/// Basis from any row space.
struct AnyBasis<R>(R);

impl<E: Copy, R: RowSpace<Element = E>> Basis<E> for AnyBasis<R> {
    fn add(&mut self, row: &[E]) -> bool {
        self.0.insert(row)
    }

    fn is_full(&self) -> bool {
        self.0.rank() == self.0.columns()
    }

    fn holds_unit(&self, column: usize) -> bool {
        self.0.has_unit(column)
    }
}

/// Row space over a prime field in reduced echelon form. Only columns without a pivot are stored: `d_i
/// e_(pivot i) + sum_j b_ij e_(free j)`. This takes a third of the products of a form with all columns.
struct Compact {
    field: Field,
    columns: usize,
    free: Vec<u32>,
    /// `b_ij` at `i * columns + j`.
    rest: Vec<u64>,
    /// Pivot column and its entry `d_i`, by row.
    pivots: Vec<(u32, u64)>,
    new: Vec<u64>,
    sums: Vec<u128>,
    /// Index and weight of each row that takes part in a reduction.
    live: Vec<(usize, u64)>,
}

impl Compact {
    fn new(field: Field, columns: usize) -> Self {
        Self {
            field,
            columns,
            free: (0..columns as u32).collect(),
            rest: Vec::with_capacity(columns * columns),
            pivots: Vec::with_capacity(columns),
            new: Vec::with_capacity(columns),
            sums: Vec::with_capacity(columns),
            live: Vec::with_capacity(columns),
        }
    }

    /// Reduces a row in the free columns: `D row - sum_i row[pivot_i] (D / d_i) b_i` with the product D
    /// of the `d_i` that take part.
    fn reduce(&mut self, row: &[u64]) {
        let (f, columns) = (self.field, self.columns);
        self.live.clear();
        let mut product = f.one();
        for (i, &(pivot, entry)) in self.pivots.iter().enumerate() {
            let x = row[pivot as usize];
            if x != 0 {
                self.live.push((i, f.neg(f.mul(x, product))));
                product = f.mul(product, entry);
            }
        }
        let mut after = f.one();
        for (i, weight) in self.live.iter_mut().rev() {
            *weight = f.mul(*weight, after);
            after = f.mul(after, self.pivots[*i].1);
        }
        self.sums.clear();
        self.sums.extend(self.free.iter().map(|&c| f.lazy(product, row[c as usize])));
        for (k, &(i, weight)) in self.live.iter().enumerate() {
            if (k + 1) % Field::LAZY == 0 {
                self.sums.iter_mut().for_each(|s| *s = f.settle(*s));
            }
            let rest = &self.rest[i * columns..i * columns + self.free.len()];
            for (s, &b) in self.sums.iter_mut().zip(rest) {
                *s += f.lazy(weight, b);
            }
        }
        self.new.clear();
        self.new.extend(self.sums.iter().map(|&s| f.reduce(s)));
    }
}

impl Basis<u64> for Compact {
    fn add(&mut self, row: &[u64]) -> bool {
        self.reduce(row);
        let Some(at) = self.new.iter().position(|x| *x != 0) else { return false };
        let (f, columns, last) = (self.field, self.columns, self.free.len() - 1);
        let entry = self.new[at];
        // the pivot leaves the free columns, and the last of these takes its place
        self.new.swap_remove(at);
        for (rest, (_, own)) in self.rest.chunks_exact_mut(columns).zip(&mut self.pivots) {
            let factor = rest[at];
            rest[at] = rest[last];
            if factor == 0 {
                continue;
            }
            let factor = f.neg(factor);
            for (b, &x) in rest[..last].iter_mut().zip(&self.new) {
                *b = f.reduce(f.lazy(entry, *b) + f.lazy(factor, x));
            }
            *own = f.mul(entry, *own);
        }
        self.pivots.push((self.free.swap_remove(at), entry));
        self.rest.extend_from_slice(&self.new);
        self.rest.resize(self.pivots.len() * columns, 0);
        true
    }

    fn is_full(&self) -> bool {
        self.free.is_empty()
    }

    fn holds_unit(&self, column: usize) -> bool {
        let row = self.pivots.iter().position(|p| p.0 as usize == column);
        row.is_some_and(|i| self.rest[i * self.columns..][..self.free.len()].iter().all(|b| *b == 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use obsdeg_exact::{Echelon, SplitMix64};

    /// Random sparse rows compared with the basis with all columns: ranks and unit vectors after every
    /// row.
    #[test]
    fn stored_columns_are_enough() {
        let f = Field::new((1 << 60) + 33);
        let mut rng = SplitMix64::new(11);
        for columns in [1, 2, 5, 9, 14] {
            for _ in 0..40 {
                let (mut all, mut compact) = (Echelon::new(f, columns), Compact::new(f, columns));
                for _ in 0..columns + 4 {
                    let mut entry = || if rng.below(3) == 0 { f.from_u64(rng.below(4)) } else { 0 };
                    let row: Vec<u64> = (0..columns).map(|_| entry()).collect();
                    assert_eq!(all.insert(&row), compact.add(&row));
                    assert_eq!(compact.is_full(), all.rank() == columns);
                    for c in 0..columns {
                        assert_eq!(all.has_unit(c), compact.holds_unit(c), "column {c} of {columns}");
                    }
                }
            }
        }
    }
}
