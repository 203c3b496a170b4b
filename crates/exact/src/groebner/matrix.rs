//! Matrix of polynomials by monomials, and its reduction (Macaulay).

use super::monomials::MonomialTable;
use super::work::{OverLimit, RemainingWork};
use crate::Field;

/// Terms from the leading one on, which has coefficient one in a basis.
pub(super) type Row = Vec<(u32, u64)>;

/// Terms as entries of a matrix: column and coefficient.
pub(super) type MatrixRow = Vec<(usize, u64)>;

/// Columns of a matrix: monomials, each once.
#[derive(Default)]
pub(super) struct MonomialColumns {
    /// Column of every monomial; `usize::MAX` for one that does not occur.
    place: Vec<usize>,
    pub(super) monomials: Vec<u32>,
}

impl MonomialColumns {
    /// Adds the monomials of a row.
    pub(super) fn enter(&mut self, row: &Row) {
        for &(m, _) in row {
            if self.place.len() <= m as usize {
                self.place.resize(m as usize + 1, usize::MAX);
            }
            if self.place[m as usize] == usize::MAX {
                self.place[m as usize] = 0;
                self.monomials.push(m);
            }
        }
    }

    /// Orders the columns: the largest monomial first.
    pub(super) fn sort(&mut self, table: &MonomialTable) {
        self.monomials.sort_unstable_by(|a, b| table.compare(*b, *a));
        for (c, &m) in self.monomials.iter().enumerate() {
            self.place[m as usize] = c;
        }
    }

    pub(super) fn placed(&self, row: Row) -> MatrixRow {
        row.into_iter().map(|(m, c)| (self.place[m as usize], c)).collect()
    }
}

/// Matrix in row echelon form.
pub(super) struct MacaulayMatrix {
    field: Field,
    /// Row of every pivot column.
    pub(super) pivots: Vec<Option<MatrixRow>>,
    /// Row that is being reduced; zero between two rows.
    dense: Vec<u64>,
}

impl MacaulayMatrix {
    pub(super) fn new(field: Field, columns: usize) -> Self {
        Self { field, pivots: vec![None; columns], dense: vec![0; columns] }
    }

    /// Reduces a row and adds the rest, `monic` or not; returns its pivot, `None` if nothing remains.
    pub(super) fn reduce(
        &mut self,
        row: &MatrixRow,
        monic: bool,
        work: &mut RemainingWork,
    ) -> Result<Option<usize>, OverLimit> {
        let Self { field: f, pivots, dense } = self;
        let columns = dense.len();
        let start = row[0].0;
        for &(c, x) in row {
            dense[c] = x;
        }
        let mut lead = None;
        work.take(columns as u64 / 8)?;
        for c in start..columns {
            let x = dense[c];
            if x == 0 {
                continue;
            }
            match &pivots[c] {
                Some(pivot) => {
                    work.take(pivot.len() as u64)?;
                    let minus = f.neg(x);
                    for &(d, y) in pivot {
                        dense[d] = f.add(dense[d], f.mul(minus, y));
                    }
                }
                None => lead = lead.or(Some(c)),
            }
        }
        let Some(lead) = lead else { return Ok(None) };
        let inverse = if monic { f.inv(dense[lead]) } else { f.one() };
        let mut kept = Vec::new();
        for (c, x) in dense.iter_mut().enumerate().skip(lead).filter(|x| *x.1 != 0) {
            kept.push((c, f.mul(*x, inverse)));
            *x = 0;
        }
        pivots[lead] = Some(kept);
        Ok(Some(lead))
    }
}
