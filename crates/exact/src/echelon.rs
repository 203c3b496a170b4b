//! The incremental reduced row-echelon basis of a row space.

use crate::{Field, interrupt};

const NO_PIVOT: u32 = u32::MAX;

/// A row space over a prime field, kept in reduced row-echelon form while rows come in.
///
/// Every basis row has a nonzero entry in its pivot column, where all other basis rows are zero. So the
/// unit vector `e_c` lies in the space exactly when column `c` is a pivot column and its row is zero
/// elsewhere. Rows are not scaled to a one at the pivot: an inversion costs as much as a hundred
/// products, and without it elimination needs none.
///
/// ```
/// use obsdeg_exact::{Echelon, Field};
/// let f = Field::new((1 << 60) + 33);
/// let row = |a: [i64; 3]| a.map(|x| f.from_i64(x));
/// let mut v = Echelon::new(f, 3);
/// assert!(v.insert(&row([1, 1, 0])));
/// assert!(!v.insert(&row([2, 2, 0])));
/// assert!(!v.has_unit(0));
/// assert!(v.insert(&row([1, -1, 0])));
/// assert!(v.has_unit(0) && v.has_unit(1) && v.is_zero_column(2));
/// ```
#[derive(Debug, Clone)]
pub struct Echelon {
    field: Field,
    columns: usize,
    /// Basis rows, one after another.
    rows: Vec<u64>,
    /// Pivot column of each basis row.
    pivots: Vec<u32>,
    /// Basis row of each pivot column.
    row_of: Vec<u32>,
    /// The columns that are no pivots.
    free: Vec<u32>,
    scratch: Vec<u64>,
    workspace: Workspace,
}

/// A weight, and the start and the pivot entry of the basis row that it multiplies.
type Live = Vec<(u64, usize, u64)>;

/// Memory of a reduction, kept between rows.
#[derive(Debug, Clone, Default)]
struct Workspace {
    live: Live,
    sums: Vec<u128>,
}

impl Echelon {
    /// The zero space of row vectors of length `columns`.
    pub fn new(field: Field, columns: usize) -> Self {
        Self {
            field,
            columns,
            rows: Vec::new(),
            pivots: Vec::new(),
            row_of: vec![NO_PIVOT; columns],
            free: (0..columns as u32).collect(),
            scratch: vec![0; columns],
            workspace: Workspace::default(),
        }
    }

    /// Back to the zero space, keeping the memory.
    pub fn clear(&mut self) {
        self.rows.clear();
        self.pivots.clear();
        self.row_of.fill(NO_PIVOT);
        self.free.clear();
        self.free.extend(0..self.columns as u32);
    }

    /// The field.
    pub fn field(&self) -> Field {
        self.field
    }

    /// The length of a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// The dimension.
    pub fn rank(&self) -> usize {
        self.pivots.len()
    }

    /// Basis row `i`, shape `columns`.
    pub fn row(&self, i: usize) -> &[u64] {
        &self.rows[i * self.columns..(i + 1) * self.columns]
    }

    /// The pivot columns, in the order in which they were found.
    pub fn pivots(&self) -> impl Iterator<Item = usize> + '_ {
        self.pivots.iter().map(|&c| c as usize)
    }

    /// The basis row whose pivot is `column`.
    pub fn pivot_row(&self, column: usize) -> Option<&[u64]> {
        match self.row_of[column] {
            NO_PIVOT => None,
            i => Some(self.row(i as usize)),
        }
    }

    /// A multiple of `row` plus basis rows that vanishes at all pivots: zero exactly when `row` is in
    /// the space. With pivot entries `d_i` and `D` their product over the basis rows that `row` needs,
    /// `out = D row - sum_i row[pivot_i] (D / d_i) basis_i`.
    fn reduce_into(&self, row: &[u64], out: &mut [u64], workspace: &mut Workspace) {
        interrupt::check();
        let f = self.field;
        let Workspace { live, sums } = workspace;
        live.clear();
        let mut product = f.one();
        for (c, (&a, &basis)) in row.iter().zip(&self.row_of).enumerate() {
            if a != 0 && basis != NO_PIVOT {
                let start = basis as usize * self.columns;
                let pivot = self.rows[start + c];
                live.push((f.neg(f.mul(a, product)), start, pivot));
                product = f.mul(product, pivot);
            }
        }
        let mut after = f.one();
        for (weight, _, pivot) in live.iter_mut().rev() {
            *weight = f.mul(*weight, after);
            after = f.mul(after, *pivot);
        }
        out.fill(0);
        if live.is_empty() {
            for &c in &self.free {
                out[c as usize] = row[c as usize];
            }
            return;
        }
        sums.clear();
        sums.extend(row.iter().map(|&x| f.lazy(product, x)));
        for (i, &(weight, start, _)) in live.iter().enumerate() {
            if (i + 1) % Field::LAZY == 0 {
                sums.iter_mut().for_each(|s| *s = f.settle(*s));
            }
            for (s, &b) in sums.iter_mut().zip(&self.rows[start..start + self.columns]) {
                *s += f.lazy(weight, b);
            }
        }
        for &c in &self.free {
            out[c as usize] = f.reduce(sums[c as usize]);
        }
    }

    /// Adds `row` (shape `columns`) to the space; true when the rank grew.
    pub fn insert(&mut self, row: &[u64]) -> bool {
        debug_assert_eq!(row.len(), self.columns);
        let mut new = std::mem::take(&mut self.scratch);
        let mut workspace = std::mem::take(&mut self.workspace);
        self.reduce_into(row, &mut new, &mut workspace);
        let pivot = new.iter().position(|&a| a != 0);
        if let Some(pivot) = pivot {
            let f = self.field;
            let entry = new[pivot];
            for (basis, &own) in self.rows.chunks_exact_mut(self.columns).zip(&self.pivots) {
                let factor = f.neg(basis[pivot]);
                if factor != 0 {
                    for &c in &self.free {
                        let c = c as usize;
                        basis[c] = f.reduce(f.lazy(entry, basis[c]) + f.lazy(factor, new[c]));
                    }
                    basis[own as usize] = f.mul(entry, basis[own as usize]);
                }
            }
            self.free.retain(|&c| c as usize != pivot);
            self.row_of[pivot] = self.rank() as u32;
            self.pivots.push(pivot as u32);
            self.rows.extend_from_slice(&new);
        }
        (self.scratch, self.workspace) = (new, workspace);
        pivot.is_some()
    }

    /// True if `row` (shape `columns`) lies in the space.
    pub fn contains(&self, row: &[u64]) -> bool {
        let mut out = vec![0; self.columns];
        self.reduce_into(row, &mut out, &mut Workspace::default());
        out.iter().all(|&a| a == 0)
    }

    /// True if the unit vector of `column` lies in the space.
    pub fn has_unit(&self, column: usize) -> bool {
        self.pivot_row(column).is_some_and(|row| row.iter().enumerate().all(|(c, &a)| a == 0 || c == column))
    }

    /// True if every vector of the space is zero in `column`.
    pub fn is_zero_column(&self, column: usize) -> bool {
        (0..self.rank()).all(|i| self.row(i)[column] == 0)
    }

    /// A basis of the null space `{v : r v = 0 for all r}`: one vector (shape `columns`) per column
    /// that is no pivot, in column order, with a one there.
    pub fn null_space(&self) -> Vec<Vec<u64>> {
        (0..self.columns)
            .filter(|&c| self.row_of[c] == NO_PIVOT)
            .map(|free| {
                let mut v = vec![0; self.columns];
                v[free] = self.field.one();
                for (i, pivot) in self.pivots().enumerate() {
                    let row = self.row(i);
                    if row[free] != 0 {
                        v[pivot] = self.field.neg(self.field.mul(row[free], self.field.inv(row[pivot])));
                    }
                }
                v
            })
            .collect()
    }

    /// Per column: the others that occur with it in some null vector of minimal support (a circuit of the
    /// matroid of the columns), in column order. They are its connected component of that matroid, whose
    /// parts are those of the graph that joins a pivot to the free columns where its row is not zero:
    /// whatever the pivots are, the parts are the same.
    pub fn companions(&self) -> Vec<Vec<usize>> {
        let pattern = |i: usize| self.row(i).iter().map(|a| *a != 0).collect::<Vec<bool>>();
        components(self.columns, self.pivots().enumerate().map(|(i, pivot)| (pivot, pattern(i))))
    }
}

/// The parts of the graph that joins the pivot of a row to the columns where the row is not zero, as the
/// others of each column.
pub(crate) fn components(columns: usize, rows: impl Iterator<Item = (usize, Vec<bool>)>) -> Vec<Vec<usize>> {
    let mut part: Vec<usize> = (0..columns).collect();
    for (pivot, pattern) in rows {
        let mut touched = vec![false; columns];
        for (&p, _) in part.iter().zip(&pattern).filter(|(_, differs)| **differs) {
            touched[p] = true;
        }
        let name = part[pivot];
        for p in part.iter_mut().filter(|p| touched[**p]) {
            *p = name;
        }
    }
    (0..columns).map(|c| (0..columns).filter(|&d| d != c && part[d] == part[c]).collect()).collect()
}

/// The columns, out of `n`, in which some row is not zero.
pub fn nonzero_columns<'a>(n: usize, rows: impl Iterator<Item = &'a [u64]>) -> Vec<usize> {
    let mut seen = vec![0; n];
    for row in rows {
        for (s, x) in seen.iter_mut().zip(row) {
            *s |= x;
        }
    }
    (0..n).filter(|&c| seen[c] != 0).collect()
}

/// Solves `sum_i y_i rows[i] = target` (each of shape n): a solution `y` with zeros for the rows that
/// depend on earlier ones, or `None` when `target` is not in their span.
pub fn express(field: Field, rows: &[&[u64]], target: &[u64]) -> Option<Vec<u64>> {
    // columns that are zero everywhere give no condition
    let used = nonzero_columns(target.len(), rows.iter().copied().chain([target]));
    let short = |row: &[u64]| -> Vec<u64> { used.iter().map(|&c| row[c]).collect() };
    // echelon form of [rows | identity]: the right part remembers how each basis row was made
    let (m, n) = (rows.len(), used.len());
    let mut basis: Vec<(usize, Vec<u64>, Vec<u64>)> = Vec::new();
    let reduce = |basis: &[(usize, Vec<u64>, Vec<u64>)], row: &mut [u64], made: &mut [u64]| {
        for (pivot, b, how) in basis {
            let factor = field.neg(row[*pivot]);
            if factor != 0 {
                for (x, &y) in row.iter_mut().zip(b).filter(|(_, y)| **y != 0) {
                    *x = field.add(*x, field.mul(factor, y));
                }
                for (x, &y) in made.iter_mut().zip(how).filter(|(_, y)| **y != 0) {
                    *x = field.add(*x, field.mul(factor, y));
                }
            }
        }
    };
    for (i, row) in rows.iter().enumerate() {
        let mut row = short(row);
        let mut made = vec![0; m];
        made[i] = field.one();
        reduce(&basis, &mut row, &mut made);
        if let Some(pivot) = (0..n).find(|&c| row[c] != 0) {
            let scale = field.inv(row[pivot]);
            for x in row.iter_mut().chain(made.iter_mut()) {
                *x = field.mul(*x, scale);
            }
            basis.push((pivot, row, made));
        }
    }
    let mut rest = short(target);
    let mut made = vec![0; m];
    reduce(&basis, &mut rest, &mut made);
    rest.iter().all(|&a| a == 0).then(|| made.iter().map(|&a| field.neg(a)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_bigint::BigInt;
    use num_rational::BigRational;
    use proptest::prelude::*;

    fn field() -> Field {
        Field::new((1 << 60) + 33)
    }

    /// Rank by fraction Gaussian elimination in plain rationals: the oracle.
    fn rank_rational(rows: &[Vec<i64>]) -> usize {
        let zero = BigRational::from_integer(BigInt::from(0));
        let mut m: Vec<Vec<BigRational>> =
            rows.iter().map(|r| r.iter().map(|&a| BigRational::from_integer(a.into())).collect()).collect();
        let mut rank = 0;
        for c in 0..rows.first().map_or(0, Vec::len) {
            let Some(p) = (rank..m.len()).find(|&i| m[i][c] != zero) else { continue };
            m.swap(rank, p);
            for i in rank + 1..m.len() {
                let q = &m[i][c] / &m[rank][c];
                for j in c..m[i].len() {
                    let d = &q * &m[rank][j];
                    m[i][j] -= d;
                }
            }
            rank += 1;
        }
        rank
    }

    fn matrices() -> impl Strategy<Value = Vec<Vec<i64>>> {
        (1usize..7, 1usize..7)
            .prop_flat_map(|(m, n)| prop::collection::vec(prop::collection::vec(-2i64..3, n), m))
    }

    /// The rank modulo `p` by the schoolbook, one reduction a product.
    fn rank_modulo(p: u64, mut m: Vec<Vec<u64>>) -> usize {
        let times = |a: u64, b: u64| (u128::from(a) * u128::from(b) % u128::from(p)) as u64;
        let power = |a: u64, e: u64| {
            (0..61).rev().fold(1, |x, bit| {
                let square = times(x, x);
                if e >> bit & 1 == 1 { times(square, a) } else { square }
            })
        };
        let mut rank = 0;
        for c in 0..m[0].len() {
            let Some(pivot) = (rank..m.len()).find(|&i| m[i][c] != 0) else { continue };
            m.swap(rank, pivot);
            let (above, below) = m.split_at_mut(rank + 1);
            let pivot = &above[rank];
            let inverse = power(pivot[c], p - 2);
            for row in below {
                let q = times(row[c], inverse);
                for (x, &y) in row[c..].iter_mut().zip(&pivot[c..]) {
                    *x = (*x + (p - times(q, y))) % p;
                }
            }
            rank += 1;
        }
        rank
    }

    /// Per column the other columns of all circuits through it: dependent sets of columns whose proper
    /// subsets are all independent.
    fn companions_by_subsets(rows: &[Vec<i64>]) -> Vec<Vec<usize>> {
        let n = rows[0].len();
        let columns = |set: usize| (0..n).filter(move |c| set >> c & 1 == 1);
        let dependent = |set: usize| {
            let picked: Vec<Vec<i64>> = rows.iter().map(|r| columns(set).map(|c| r[c]).collect()).collect();
            rank_rational(&picked) < columns(set).count()
        };
        let circuit = |set: &usize| dependent(*set) && columns(*set).all(|c| !dependent(*set & !(1 << c)));
        let circuits: Vec<usize> = (1..1usize << n).filter(circuit).collect();
        let together = |c: usize, d: usize| circuits.iter().any(|s| s >> c & 1 == 1 && s >> d & 1 == 1);
        (0..n).map(|c| (0..n).filter(|&d| d != c && together(c, d)).collect()).collect()
    }

    /// Null vectors (0,1,1,0), (0,0,1,1): their difference contains columns 1 and 3 without 2.
    #[test]
    fn companions_are_more_than_a_basis_shows() {
        let mut v = Echelon::new(field(), 4);
        v.insert(&[0, 1, -1, 1].map(|a| field().from_i64(a)));
        assert_eq!(v.companions(), [vec![], vec![2, 3], vec![1, 3], vec![1, 2]]);
        let none: [Vec<usize>; 2] = [vec![], vec![]];
        assert_eq!(Echelon::new(field(), 2).companions(), none);
    }

    #[test]
    fn cleared_it_is_the_zero_space() {
        let f = field();
        let row = |a: [i64; 2]| a.map(|x| f.from_i64(x));
        let mut v = Echelon::new(f, 2);
        assert!(v.insert(&row([1, 2])));
        v.clear();
        assert_eq!((v.rank(), v.columns(), v.contains(&row([1, 2]))), (0, 2, false));
        // the former pivot is free again
        assert!(v.insert(&row([0, 3])) && v.insert(&row([1, 0])) && v.has_unit(0));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        /// Full rows of large entries at the largest prime, with more pivots than products fit into one
        /// sum.
        #[test]
        fn wide_rows_of_large_entries(
            rank in 1usize..95,
            mixes in prop::collection::vec(prop::collection::vec(0u64..4, 95), 1..4),
            seed in any::<u64>(),
        ) {
            let f = Field::new((1 << 61) - 1);
            let n = 96;
            let mut rng = crate::SplitMix64::new(seed);
            let top = |rng: &mut crate::SplitMix64| f.modulus() - 1 - rng.below(3);
            let rows: Vec<Vec<u64>> = (0..rank).map(|_| (0..n).map(|_| top(&mut rng)).collect()).collect();
            let mixed = |weights: &Vec<u64>| -> Vec<u64> {
                let entry = |c: usize| f.dot(0, rows.iter().zip(weights).map(|(r, &w)| (f.from_u64(w), r[c])));
                (0..n).map(entry).collect()
            };
            let mut v = Echelon::new(f, n);
            for row in &rows {
                v.insert(row);
            }
            let plain = |rows: &[Vec<u64>]| -> usize {
                let values: Vec<Vec<u64>> =
                    rows.iter().map(|r| r.iter().map(|&a| f.to_u64(a)).collect()).collect();
                rank_modulo(f.modulus(), values)
            };
            prop_assert_eq!(v.rank(), plain(&rows));
            for weights in &mixes {
                let inside = mixed(weights);
                prop_assert!(v.contains(&inside) && !v.clone().insert(&inside));
                let mut beside = inside;
                beside[rank.min(n - 1)] = f.add(beside[rank.min(n - 1)], f.one());
                let mut all = rows.clone();
                all.push(beside.clone());
                prop_assert_eq!(v.contains(&beside), plain(&all) == v.rank());
            }
        }

        #[test]
        fn rank_null_space_and_units(rows in matrices()) {
            let f = field();
            let n = rows[0].len();
            let image: Vec<Vec<u64>> =
                rows.iter().map(|r| r.iter().map(|&a| f.from_i64(a)).collect()).collect();
            let mut v = Echelon::new(f, n);
            for r in &image {
                v.insert(r);
            }
            let rank = rank_rational(&rows);
            prop_assert_eq!(v.rank(), rank);
            prop_assert_eq!(v.companions(), companions_by_subsets(&rows));
            let null = v.null_space();
            prop_assert_eq!(null.len(), n - rank);
            for u in &null {
                for r in &image {
                    let zipped = r.iter().copied().zip(u.iter().copied());
                    prop_assert_eq!(f.dot(0, zipped), 0);
                }
            }
            let refs: Vec<&[u64]> = image.iter().map(Vec::as_slice).collect();
            for c in 0..n {
                let mut with_unit = rows.clone();
                with_unit.push((0..n).map(|j| i64::from(j == c)).collect());
                let inside = rank_rational(&with_unit) == rank;
                prop_assert_eq!(v.has_unit(c), inside);
                let unit: Vec<u64> = (0..n).map(|j| if j == c { f.one() } else { 0 }).collect();
                prop_assert_eq!(v.contains(&unit), inside);
                match express(f, &refs, &unit) {
                    None => prop_assert!(!inside),
                    Some(y) => {
                        prop_assert!(inside);
                        for j in 0..n {
                            let sum = f.dot(0, y.iter().zip(&image).map(|(&a, r)| (a, r[j])));
                            prop_assert_eq!(sum, unit[j]);
                        }
                    }
                }
                prop_assert_eq!(v.is_zero_column(c), rows.iter().all(|r| r[c] == 0));
            }
        }
    }
}
