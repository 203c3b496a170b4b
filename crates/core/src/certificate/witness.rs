//! The witness that rows give in one field, and the derivative rows of a scheme by definition,
//! `H_c F^k S_i`.

use obsdeg_exact::{Echelon, Field};

use super::RowName;
use crate::degree::status::Status;
use crate::model::platform::{FieldSample, LOCAL, Platform, local_dynamics, local_output};

/// Orders 0 to 3 suffice: `F^4 = -(wN^2 + wU^2) F^2`.
const ORDERS: usize = 4;

/// Basis rows, pivots and ranks of the rows in one field.
pub(super) struct Filtration {
    field: Field,
    rows: Vec<(RowName, Vec<u64>)>,
    /// Basis rows, each with its pivot.
    pub basis: Vec<(RowName, usize)>,
    /// Indices of the basis rows in `rows`.
    of_basis: Vec<usize>,
    /// `dim V_0, ..., dim V_K`, where `V_K = V_3`.
    pub ranks: Vec<usize>,
    /// Spaces of all rows up to each order 0 to 3.
    spaces: Vec<Echelon>,
}

/// Status, degree and witness of one functional.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct WitnessedVerdict {
    pub status: Status,
    pub degree: Option<usize>,
    /// Indices of the basis rows in the solution.
    pub solution: Option<Vec<usize>>,
    pub hidden_by: Option<usize>,
    pub excited_by: Option<RowName>,
}

/// All rows of orders 0 to 3, sorted by order, segment, component.
fn all_rows(platform: &Platform, sample: &FieldSample) -> Vec<(RowName, Vec<u64>)> {
    let point = &sample.point;
    let field = point.ring;
    let f = local_dynamics(&field, &point.w_n, &point.w_u);
    let mut outputs = local_output(&field, platform.observed());
    let blocks = platform.blocks(point);
    let mut out = Vec::with_capacity(ORDERS * blocks.len() * outputs.len());
    for order in 0..ORDERS {
        for (i, block) in blocks.iter().enumerate() {
            for (component, functional) in &outputs {
                let mut row = vec![0; platform.names().len()];
                for (k, &column) in block.columns.iter().enumerate() {
                    row[column] = block.entry(&field, functional, k);
                }
                out.push((RowName { segment: i + 1, order, component: *component }, row));
            }
        }
        for (_, functional) in &mut outputs {
            let old = *functional;
            *functional = std::array::from_fn(|j| field.dot(0, (0..LOCAL).map(|i| (old[i], f[i][j]))));
        }
    }
    out
}

impl Filtration {
    /// Filtration of the rows of `platform` at `sample`, lowest order first.
    pub(super) fn new(platform: &Platform, sample: &FieldSample) -> Self {
        Self::of(sample.roots.field, platform.names().len(), all_rows(platform, sample))
    }

    /// Filtration of rows with the given number of columns, sorted by order; rows of the highest order must
    /// add nothing.
    pub(super) fn of(field: Field, columns: usize, rows: Vec<(RowName, Vec<u64>)>) -> Self {
        let mut space = Echelon::new(field, columns);
        let (mut basis, mut of_basis, mut ranks, mut spaces) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for order in 0..=rows.iter().map(|r| r.0.order).max().unwrap_or(0) {
            for (index, (name, row)) in rows.iter().enumerate().filter(|(_, r)| r.0.order == order) {
                if space.insert(row) {
                    basis.extend(space.pivots().last().map(|pivot| (*name, pivot)));
                    of_basis.push(index);
                }
            }
            ranks.push(space.rank());
            spaces.push(space.clone());
        }
        let last = ranks.iter().position(|r| *r == space.rank()).unwrap_or(0);
        ranks.truncate(last + 1);
        Self { field, rows, basis, of_basis, ranks, spaces }
    }

    /// Unknowns that are no pivots at an order, in model order.
    pub(super) fn free(&self, order: usize) -> Vec<usize> {
        let space = &self.spaces[order];
        (0..space.columns()).filter(|&c| space.pivot_row(c).is_none()).collect()
    }

    /// Null vectors at an order: one per free unknown, in model order.
    pub(super) fn null_vectors(&self, order: usize) -> Vec<Vec<u64>> {
        self.spaces[order].null_space()
    }

    /// Inverse of the minor of the basis rows and pivots up to an order; `None` where it is singular.
    pub(super) fn inverse(&self, order: usize) -> Option<Vec<Vec<u64>>> {
        let rank = self.ranks[order];
        let minor = |i: usize| self.basis[..rank].iter().map(move |(_, p)| self.rows[self.of_basis[i]].1[*p]);
        invert(&self.field, (0..rank).map(|i| minor(i).collect()).collect())
    }

    /// The solution `y` of `y M = c`, for a functional of the span of the rows up to an order.
    pub(super) fn solution(&self, inverse: &[Vec<u64>], c: &[(usize, u64)]) -> Vec<u64> {
        let f = &self.field;
        let mut y = vec![0; inverse.len()];
        for (i, row) in inverse.iter().enumerate() {
            let at = c.iter().find(|(column, _)| *column == self.basis[i].1).map_or(0, |(_, x)| *x);
            if at != 0 {
                for (y, &x) in y.iter_mut().zip(row) {
                    *y = f.add(*y, f.mul(at, x));
                }
            }
        }
        y
    }

    /// True if `y` times the first basis rows equals the functional `c`.
    pub(super) fn makes(&self, y: &[u64], c: &[(usize, u64)]) -> bool {
        let f = &self.field;
        let mut rest = vec![0; self.spaces[0].columns()];
        for &(column, x) in c {
            rest[column] = f.sub(rest[column], x);
        }
        for (&y, &row) in y.iter().zip(&self.of_basis) {
            for (rest, &x) in rest.iter_mut().zip(&self.rows[row].1) {
                *rest = f.add(*rest, f.mul(y, x));
            }
        }
        rest.iter().all(|x| *x == 0)
    }

    /// Status, degree and witness of functionals, each as columns and values.
    pub(super) fn found(&self, functionals: &[Vec<(usize, u64)>]) -> Vec<WitnessedVerdict> {
        let orders = 0..self.ranks.len();
        let null: Vec<_> = orders.clone().map(|k| (self.free(k), self.null_vectors(k))).collect();
        let inverses: Vec<_> = orders.map(|k| self.inverse(k).unwrap_or_default()).collect();
        let excites = |c: &[(usize, u64)]| {
            let seen = self.rows.iter().find(|(_, row)| c.iter().any(|(column, _)| row[*column] != 0));
            seen.map(|(name, _)| *name)
        };
        let dot = |n: &Vec<u64>, c: &[(usize, u64)]| self.field.dot(0, c.iter().map(|&(k, x)| (n[k], x)));
        functionals
            .iter()
            .map(|c| {
                let hidden: Vec<Option<usize>> = null
                    .iter()
                    .map(|(free, vectors)| {
                        free.iter().zip(vectors).find(|(_, n)| dot(n, c) != 0).map(|(f, _)| *f)
                    })
                    .collect();
                let degree = hidden.iter().position(Option::is_none);
                let solution = degree.map(|k| {
                    let y = self.solution(&inverses[k], c);
                    (0..y.len()).filter(|&j| y[j] != 0).collect()
                });
                let excited = excites(c);
                let hidden_by = match degree {
                    Some(k) => k.checked_sub(1).and_then(|k| hidden[k]),
                    None => hidden.last().copied().flatten(),
                };
                WitnessedVerdict {
                    status: Status::of(degree, excited.is_some()),
                    degree,
                    solution,
                    hidden_by,
                    excited_by: excited.filter(|_| degree.is_none()),
                }
            })
            .collect()
    }
}

/// The inverse of a square matrix, if it has one.
fn invert(f: &Field, mut m: Vec<Vec<u64>>) -> Option<Vec<Vec<u64>>> {
    let n = m.len();
    for (i, row) in m.iter_mut().enumerate() {
        row.extend((0..n).map(|j| if i == j { f.one() } else { 0 }));
    }
    for c in 0..n {
        let pivot = (c..n).find(|&i| m[i][c] != 0)?;
        m.swap(c, pivot);
        let scale = f.inv(m[c][c]);
        let row: Vec<u64> = m[c].iter().map(|&x| f.mul(x, scale)).collect();
        for (i, other) in m.iter_mut().enumerate() {
            let factor = f.neg(other[c]);
            if i != c && factor != 0 {
                for (x, &y) in other.iter_mut().zip(&row).filter(|(_, y)| **y != 0) {
                    *x = f.add(*x, f.mul(factor, y));
                }
            }
        }
        m[c] = row;
    }
    Some(m.into_iter().map(|row| row[n..].to_vec()).collect())
}
