//! Groebner bases in the field, and properties of zero-dimensional ideals.
//!
//! The order is by weighted degree, then reverse lexicographic. Pairs are chosen by the criteria of Gebauer
//! and Möller (1988, doi:10.1016/S0747-7171(88)80048-8); all pairs of the lowest degree are reduced at once,
//! as rows of one matrix (Faugère's F4, 1999, doi:10.1016/S0022-4049(99)00005-5).

mod matrix;
mod monomials;
mod work;

use crate::Field;
use crate::multivariate::Polynomial;
use matrix::{MacaulayMatrix, MatrixRow, MonomialColumns, Row};
use monomials::MonomialTable;

pub use work::{OverLimit, RemainingWork};

struct Pair {
    lcm: u32,
    i: usize,
    j: usize,
}

/// Groebner basis, or the part of it that was found.
#[derive(Debug, Clone)]
pub struct GroebnerBasis {
    field: Field,
    table: MonomialTable,
    rows: Vec<Row>,
    /// True, by row, if no other leading monomial divides that of the row.
    active: Vec<bool>,
    /// True if it is a Groebner basis, found within the limit of work.
    complete: bool,
}

impl GroebnerBasis {
    /// The Groebner basis of the ideal of `input`, with one variable per entry of `weights`. If `work`
    /// is not sufficient the basis is not [complete](Self::is_complete), but all its elements are in
    /// the ideal.
    pub fn new(f: &Field, weights: &[u32], input: &[Polynomial], work: &mut RemainingWork) -> Self {
        let mut out = Self {
            field: *f,
            table: MonomialTable::new(weights),
            rows: Vec::new(),
            active: Vec::new(),
            complete: false,
        };
        out.complete = out.close(input, work).is_ok();
        out
    }

    /// True if it is a Groebner basis.
    pub fn is_complete(&self) -> bool {
        self.complete
    }

    /// The elements with minimal leading monomials.
    pub fn elements(&self) -> Vec<Polynomial> {
        self.rows.iter().zip(&self.active).filter(|r| *r.1).map(|r| self.polynomial(r.0)).collect()
    }

    fn polynomial(&self, row: &Row) -> Polynomial {
        let mut out = Polynomial::default();
        for &(m, c) in row {
            let powers = self.table.of(m).iter().enumerate().filter(|p| *p.1 > 0);
            out.put(&self.field, powers.map(|(v, &e)| (v as u32, e.into())).collect(), c);
        }
        out
    }

    fn row(&mut self, p: &Polynomial) -> Result<Row, OverLimit> {
        let mut row: Row =
            p.terms().map(|(m, c)| Ok((self.table.monomial(m)?, c))).collect::<Result<_, _>>()?;
        row.sort_unstable_by(|a, b| self.table.compare(b.0, a.0));
        Ok(row)
    }

    fn close(&mut self, input: &[Polynomial], work: &mut RemainingWork) -> Result<(), OverLimit> {
        let mut pairs: Vec<Pair> = Vec::new();
        let rows = input.iter().map(|p| self.row(p)).collect::<Result<Vec<_>, _>>()?;
        let mut new = self.reduced(rows, true, work)?;
        loop {
            new.sort_by(|a, b| self.table.compare(a[0].0, b[0].0));
            for row in new {
                self.insert(row, &mut pairs, work)?;
            }
            let Some(degree) = pairs.iter().map(|p| self.table.degree[p.lcm as usize]).min() else {
                return Ok(());
            };
            let (now, later) =
                pairs.into_iter().partition(|p: &Pair| self.table.degree[p.lcm as usize] == degree);
            pairs = later;
            let mut halves: Vec<(usize, u32)> = Vec::new();
            let now: Vec<Pair> = now;
            for p in now {
                halves.extend([(p.i, p.lcm), (p.j, p.lcm)]);
            }
            halves.sort_unstable();
            halves.dedup();
            let rows =
                halves.into_iter().map(|(i, m)| self.multiple(i, m, work)).collect::<Result<Vec<_>, _>>()?;
            new = self.reduced(rows, true, work)?;
        }
    }

    /// The multiple of element i whose leading monomial is m.
    fn multiple(&mut self, i: usize, m: u32, work: &mut RemainingWork) -> Result<Row, OverLimit> {
        let factor = self.table.quotient(m, self.rows[i][0].0)?;
        work.take(8 * self.rows[i].len() as u64)?;
        (0..self.rows[i].len())
            .map(|t| {
                let (m, c) = self.rows[i][t];
                Ok((self.table.product(factor, m)?, c))
            })
            .collect()
    }

    fn reducer(&self, m: u32) -> Option<usize> {
        (0..self.rows.len()).find(|&i| self.active[i] && self.table.divides(self.rows[i][0].0, m))
    }

    /// Remainders of the rows, reduced by the basis and by each other: rows with different leading
    /// monomials that are no multiples of those of the basis.
    fn reduced(
        &mut self,
        rows: Vec<Row>,
        monic: bool,
        work: &mut RemainingWork,
    ) -> Result<Vec<Row>, OverLimit> {
        // every monomial that may occur, with the row that removes it
        let mut columns = MonomialColumns::default();
        let mut removers: Vec<Row> = Vec::new();
        for row in &rows {
            columns.enter(row);
        }
        let mut next = 0;
        while next < columns.monomials.len() {
            let m = columns.monomials[next];
            next += 1;
            work.take(self.active.len() as u64 / 4 + 1)?;
            if let Some(i) = self.reducer(m) {
                let row = self.multiple(i, m, work)?;
                columns.enter(&row);
                removers.push(row);
            }
        }
        columns.sort(&self.table);
        let mut matrix = MacaulayMatrix::new(self.field, columns.monomials.len());
        for row in removers {
            let row = columns.placed(row);
            let lead = row[0].0;
            matrix.pivots[lead] = Some(row);
        }
        let mut rows: Vec<MatrixRow> =
            rows.into_iter().map(|row| columns.placed(row)).filter(|r| !r.is_empty()).collect();
        // short rows first
        rows.sort_by_key(|r| (r.len(), std::cmp::Reverse(r[0].0)));
        let mut found = Vec::new();
        for row in rows {
            found.extend(matrix.reduce(&row, monic, work)?);
        }
        let out = found.into_iter().filter_map(|lead| matrix.pivots[lead].take());
        Ok(out.map(|row| row.into_iter().map(|(c, x)| (columns.monomials[c], x)).collect()).collect())
    }

    /// Adds an element, with its pairs by the criteria of Gebauer and Möller.
    fn insert(&mut self, row: Row, pairs: &mut Vec<Pair>, work: &mut RemainingWork) -> Result<(), OverLimit> {
        let (h, lead) = (self.rows.len(), row[0].0);
        let active: Vec<usize> = (0..h).filter(|&i| self.active[i]).collect();
        work.take(8 * (active.len() + pairs.len()) as u64)?;
        let mut fresh: Vec<(Pair, bool)> = Vec::new();
        for &i in &active {
            let other = self.rows[i][0].0;
            let lcm = self.table.lcm(lead, other)?;
            fresh.push((Pair { lcm, i, j: h }, self.table.disjoint(lead, other)));
        }
        let mut kept: Vec<(Pair, bool)> = Vec::new();
        while let Some((pair, disjoint)) = fresh.pop() {
            let covered = |(other, _): &(Pair, bool)| self.table.divides(other.lcm, pair.lcm);
            if disjoint || !(fresh.iter().any(covered) || kept.iter().any(covered)) {
                kept.push((pair, disjoint));
            }
        }
        for k in (0..pairs.len()).rev() {
            let Pair { lcm, i, j } = pairs[k];
            if self.table.divides(lead, lcm)
                && self.table.lcm(self.rows[i][0].0, lead)? != lcm
                && self.table.lcm(self.rows[j][0].0, lead)? != lcm
            {
                pairs.remove(k);
            }
        }
        pairs.extend(kept.into_iter().filter(|p| !p.1).map(|p| p.0));
        for i in active {
            self.active[i] = !self.table.divides(lead, self.rows[i][0].0);
        }
        self.rows.push(row);
        self.active.push(true);
        Ok(())
    }

    /// The remainder of a polynomial. For a complete basis it is zero exactly for elements of the
    /// ideal.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn remainder(&mut self, p: &Polynomial, work: &mut RemainingWork) -> Result<Polynomial, OverLimit> {
        let row = self.row(p)?;
        let rest = self.reduced(vec![row], false, work)?;
        Ok(rest.first().map_or_else(Polynomial::default, |r| self.polynomial(r)))
    }

    /// The monomials that are no multiples of leading ones: a basis of the quotient ring. `None` if
    /// there are more than `most`.
    fn standard(&mut self, most: usize) -> Result<Option<Vec<u32>>, OverLimit> {
        let n = self.table.weights.len();
        let one = self.table.put(&vec![0; n]);
        let mut out: Vec<u32> = (self.reducer(one).is_none()).then_some(one).into_iter().collect();
        let mut next = 0;
        while next < out.len() {
            if out.len() > most {
                return Ok(None);
            }
            let dense = self.table.of(out[next]).to_vec();
            next += 1;
            // each monomial once: by its last variable
            let last = dense.iter().rposition(|&e| e > 0).unwrap_or(0);
            for v in last..n {
                let mut dense = dense.clone();
                dense[v] = dense[v].checked_add(1).ok_or(OverLimit)?;
                let m = self.table.put(&dense);
                if self.reducer(m).is_none() {
                    out.push(m);
                }
            }
        }
        Ok(Some(out))
    }

    /// Number of solutions with multiplicity, the dimension of the quotient ring; `None` if it exceeds
    /// `most`.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn dimension(&mut self, most: usize) -> Result<Option<usize>, OverLimit> {
        Ok(self.standard(most)?.map(|m| m.len()))
    }

    /// The minimal polynomial of an element in the quotient ring, constant term first; `None` if its
    /// degree exceeds `most`.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub fn minimal_polynomial(
        &mut self,
        element: &Polynomial,
        most: usize,
        work: &mut RemainingWork,
    ) -> Result<Option<Vec<u64>>, OverLimit> {
        let f = self.field;
        let mut power = self.remainder(&Polynomial::constant(f.one()), work)?;
        // remainder of a power, and the combination of powers that gives it
        let mut rows: Vec<(Polynomial, Vec<u64>)> = Vec::new();
        for k in 0..=most {
            let mut rest = power.clone();
            let mut combination = vec![0; k + 1];
            combination[k] = f.one();
            for (row, by) in &rows {
                let Some((lead, c)) = row.terms().next_back() else { continue };
                let factor = f.neg(f.mul(rest.coefficient(lead), f.inv(c)));
                if factor == 0 {
                    continue;
                }
                work.take(row.len() as u64)?;
                rest.add_scaled(&f, row, factor);
                for (x, &y) in combination.iter_mut().zip(by) {
                    *x = f.add(*x, f.mul(factor, y));
                }
            }
            if rest.is_empty() {
                return Ok(Some(combination));
            }
            rows.push((rest, combination));
            let mut next = Polynomial::default();
            work.take((power.len() * element.len()) as u64)?;
            next.add_product(&f, &power, element);
            power = self.remainder(&next, work)?;
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests;
