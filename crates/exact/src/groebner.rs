//! Groebner bases in the field, and properties of zero-dimensional ideals.
//!
//! The order is by weighted degree, then reverse lexicographic. Pairs are chosen by the criteria of Gebauer
//! and Möller (1988, doi:10.1016/S0747-7171(88)80048-8); all pairs of the lowest degree are reduced at once,
//! as rows of one matrix (Faugère's F4, 1999, doi:10.1016/S0022-4049(99)00005-5).

use std::cmp::Ordering;

use crate::multivariate::{Monomial, Polynomial};
use crate::{Field, SplitMix64, interrupt};

/// Limit of work in products of coefficients, counted down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RemainingWork {
    /// Remaining work.
    pub left: u64,
    /// True once the limit was reached. Otherwise [`OverLimit`] is a power above 255, which no limit
    /// allows.
    pub used_up: bool,
}

/// Error: the limit of work was reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OverLimit;

impl RemainingWork {
    /// Limit of `left` products.
    pub const fn new(left: u64) -> Self {
        Self { left, used_up: false }
    }

    /// Takes `amount` from the remaining work.
    ///
    /// # Errors
    /// [`OverLimit`] when less is left.
    pub fn take(&mut self, amount: u64) -> Result<(), OverLimit> {
        interrupt::check();
        let left = self.left.checked_sub(amount);
        self.used_up |= left.is_none();
        self.left = left.ok_or(OverLimit)?;
        Ok(())
    }
}

/// Monomials by number; equal monomials have the same number.
#[derive(Debug, Clone)]
struct MonomialTable {
    weights: Vec<u32>,
    exponents: Vec<u8>,
    degree: Vec<u32>,
    /// Bit mask of the variables that occur, modulo 64.
    mask: Vec<u64>,
    /// Hash: the sum of exponents times `keys`, so that the hash of a product is a sum.
    hash: Vec<u64>,
    keys: Vec<u64>,
    /// Open addressing by hash; the size is a power of two, at most half of it is used.
    slots: Vec<u32>,
}

/// Empty slot of the hash table.
const EMPTY: u32 = u32::MAX;

impl MonomialTable {
    fn new(weights: &[u32]) -> Self {
        let mut rng = SplitMix64::new(0);
        Self {
            weights: weights.to_vec(),
            exponents: Vec::new(),
            degree: Vec::new(),
            mask: Vec::new(),
            hash: Vec::new(),
            keys: weights.iter().map(|_| rng.next_u64()).collect(),
            slots: vec![EMPTY; 1024],
        }
    }

    fn of(&self, m: u32) -> &[u8] {
        let n = self.weights.len();
        &self.exponents[m as usize * n..(m as usize + 1) * n]
    }

    /// The slot of the monomial with this hash for which `is` is true, or the slot where it goes.
    fn slot(&self, hash: u64, is: impl Fn(u32) -> bool) -> usize {
        let last = self.slots.len() - 1;
        let mut at = (hash >> 20) as usize & last;
        while self.slots[at] != EMPTY && !(self.hash[self.slots[at] as usize] == hash && is(self.slots[at])) {
            at = (at + 1) & last;
        }
        at
    }

    fn put(&mut self, exponents: &[u8]) -> u32 {
        let hash = exponents
            .iter()
            .zip(&self.keys)
            .fold(0u64, |h, (&e, k)| h.wrapping_add(k.wrapping_mul(e.into())));
        let slot = self.slot(hash, |m| self.of(m) == exponents);
        if self.slots[slot] != EMPTY {
            return self.slots[slot];
        }
        let m = self.degree.len() as u32;
        self.degree.push(exponents.iter().zip(&self.weights).map(|(&e, w)| u32::from(e) * w).sum());
        let bit = |(v, &e): (usize, &u8)| u64::from(e > 0) << (v % 64);
        self.mask.push(exponents.iter().enumerate().map(bit).fold(0, |a, b| a | b));
        self.hash.push(hash);
        self.exponents.extend_from_slice(exponents);
        self.slots[slot] = m;
        if self.degree.len() * 2 > self.slots.len() {
            self.slots = vec![EMPTY; self.slots.len() * 2];
            for m in 0..self.degree.len() {
                let slot = self.slot(self.hash[m], |_| false);
                self.slots[slot] = m as u32;
            }
        }
        m
    }

    fn monomial(&mut self, m: &Monomial) -> Result<u32, OverLimit> {
        let mut dense = vec![0u8; self.weights.len()];
        for &(v, e) in m {
            dense[v as usize] = u8::try_from(e).map_err(|_| OverLimit)?;
        }
        Ok(self.put(&dense))
    }

    /// Combines two monomials exponent by exponent.
    fn combined(&mut self, a: u32, b: u32, rule: impl Fn(u8, u8) -> Option<u8>) -> Result<u32, OverLimit> {
        let both = self.of(a).iter().zip(self.of(b));
        let dense: Option<Vec<u8>> = both.map(|(&x, &y)| rule(x, y)).collect();
        Ok(self.put(&dense.ok_or(OverLimit)?))
    }

    fn product(&mut self, a: u32, b: u32) -> Result<u32, OverLimit> {
        let hash = self.hash[a as usize].wrapping_add(self.hash[b as usize]);
        let is = |m: u32| {
            let both = self.of(a).iter().zip(self.of(b));
            both.zip(self.of(m)).all(|((&x, &y), &z)| x.checked_add(y) == Some(z))
        };
        match self.slots[self.slot(hash, is)] {
            EMPTY => self.combined(a, b, u8::checked_add),
            m => Ok(m),
        }
    }

    fn lcm(&mut self, a: u32, b: u32) -> Result<u32, OverLimit> {
        self.combined(a, b, |x, y| Some(x.max(y)))
    }

    /// The quotient `a / b`, where b divides a.
    fn quotient(&mut self, a: u32, b: u32) -> Result<u32, OverLimit> {
        self.combined(a, b, u8::checked_sub)
    }

    fn divides(&self, a: u32, b: u32) -> bool {
        self.mask[a as usize] & !self.mask[b as usize] == 0
            && self.degree[a as usize] <= self.degree[b as usize]
            && self.of(a).iter().zip(self.of(b)).all(|(x, y)| x <= y)
    }

    fn disjoint(&self, a: u32, b: u32) -> bool {
        self.of(a).iter().zip(self.of(b)).all(|(&x, &y)| x == 0 || y == 0)
    }

    fn compare(&self, a: u32, b: u32) -> Ordering {
        self.degree[a as usize].cmp(&self.degree[b as usize]).then_with(|| {
            // of two monomials of one degree, the one with the smaller exponent in the last variable in
            // which they differ is larger
            self.of(b).iter().rev().cmp(self.of(a).iter().rev())
        })
    }
}

/// Terms from the leading one on, which has coefficient one in a basis.
type Row = Vec<(u32, u64)>;

/// Terms as entries of a matrix: column and coefficient.
type MatrixRow = Vec<(usize, u64)>;

/// Columns of a matrix: monomials, each once.
#[derive(Default)]
struct MonomialColumns {
    /// Column of every monomial; `usize::MAX` for one that does not occur.
    place: Vec<usize>,
    monomials: Vec<u32>,
}

impl MonomialColumns {
    /// Adds the monomials of a row.
    fn enter(&mut self, row: &Row) {
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
    fn sort(&mut self, table: &MonomialTable) {
        self.monomials.sort_unstable_by(|a, b| table.compare(*b, *a));
        for (c, &m) in self.monomials.iter().enumerate() {
            self.place[m as usize] = c;
        }
    }

    fn placed(&self, row: Row) -> MatrixRow {
        row.into_iter().map(|(m, c)| (self.place[m as usize], c)).collect()
    }
}

/// Matrix in row echelon form.
struct MacaulayMatrix {
    field: Field,
    /// Row of every pivot column.
    pivots: Vec<Option<MatrixRow>>,
    /// Row that is being reduced; zero between two rows.
    dense: Vec<u64>,
}

impl MacaulayMatrix {
    fn new(field: Field, columns: usize) -> Self {
        Self { field, pivots: vec![None; columns], dense: vec![0; columns] }
    }

    /// Reduces a row and adds the rest, `monic` or not; returns its pivot, `None` if nothing remains.
    fn reduce(
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
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ENOUGH: RemainingWork = RemainingWork::new(50_000_000);

    fn field() -> Field {
        Field::new((1 << 60) + 33)
    }

    /// Polynomial from terms `(coefficient, exponents)`.
    fn polynomial(terms: &[(i64, Vec<u32>)]) -> Polynomial {
        let f = field();
        let mut out = Polynomial::default();
        for (c, exponents) in terms {
            let powers = exponents.iter().enumerate().filter(|p| *p.1 > 0).map(|(v, &e)| (v as u32, e));
            out.put(&f, powers.collect(), f.from_i64(*c));
        }
        out
    }

    /// Leading term in the textbook order, implemented independently: dense exponents and the
    /// coefficient.
    fn leading(p: &Polynomial, weights: &[u32]) -> Option<(Vec<u32>, u64)> {
        let dense = |m: &Monomial| {
            let mut out = vec![0u32; weights.len()];
            m.iter().for_each(|&(v, e)| out[v as usize] = e);
            out
        };
        let key = |e: &Vec<u32>| {
            let degree: u32 = e.iter().zip(weights).map(|(e, w)| e * w).sum();
            (degree, e.iter().rev().map(|&e| std::cmp::Reverse(e)).collect::<Vec<_>>())
        };
        p.terms().map(|(m, c)| (dense(m), c)).max_by_key(|(e, _)| key(e))
    }

    fn times(p: &Polynomial, exponents: &[u32], c: u64) -> Polynomial {
        let f = field();
        let mut factor = Polynomial::default();
        let powers = exponents.iter().enumerate().filter(|p| *p.1 > 0).map(|(v, &e)| (v as u32, e));
        factor.put(&f, powers.collect(), c);
        let mut out = Polynomial::default();
        out.add_product(&f, p, &factor);
        out
    }

    /// Remainder of a division step by step.
    fn divided(mut p: Polynomial, by: &[Polynomial], weights: &[u32]) -> Polynomial {
        let f = field();
        'next: while let Some((lead, c)) = leading(&p, weights) {
            for g in by {
                let (own, d) = leading(g, weights).expect("no zero in a basis");
                if own.iter().zip(&lead).all(|(a, b)| a <= b) {
                    let rest: Vec<u32> = lead.iter().zip(&own).map(|(a, b)| a - b).collect();
                    p.add_scaled(&f, &times(g, &rest, f.mul(c, f.inv(d))), f.neg(f.one()));
                    continue 'next;
                }
            }
            return p;
        }
        p
    }

    /// True if Buchberger's criterion holds and the ideal contains the input; by division only.
    fn is_basis_of(basis: &GroebnerBasis, input: &[Polynomial], weights: &[u32]) -> bool {
        let f = field();
        let elements = basis.elements();
        let closed = elements.iter().enumerate().all(|(i, a)| {
            elements[..i].iter().all(|b| {
                let ((x, c), (y, d)) = (leading(a, weights).expect("a"), leading(b, weights).expect("b"));
                let lcm: Vec<u32> = x.iter().zip(&y).map(|(x, y)| *x.max(y)).collect();
                let up = |m: &[u32]| lcm.iter().zip(m).map(|(l, m)| l - m).collect::<Vec<_>>();
                let mut s = times(a, &up(&x), d);
                s.add_scaled(&f, &times(b, &up(&y), c), f.neg(f.one()));
                divided(s, &elements, weights).is_empty()
            })
        });
        closed && input.iter().all(|p| divided(p.clone(), &elements, weights).is_empty())
    }

    fn terms(variables: usize) -> impl Strategy<Value = Vec<(i64, Vec<u32>)>> {
        prop::collection::vec((-5i64..6, prop::collection::vec(0u32..3, variables)), 1..5)
    }

    proptest! {
        /// Random ideals of any dimension.
        #[test]
        fn what_is_called_a_basis_is_one(
            input in prop::collection::vec(terms(3), 1..4),
            weights in prop::collection::vec(1u32..4, 3),
        ) {
            let input: Vec<Polynomial> = input.iter().map(|p| polynomial(p)).collect();
            let basis = GroebnerBasis::new(&field(), &weights, &input, &mut ENOUGH.clone());
            prop_assert!(basis.is_complete());
            prop_assert!(is_basis_of(&basis, &input, &weights));
        }

        /// Equations of a few points: x runs through given numbers, y and z are polynomials of it.
        #[test]
        fn solutions_are_counted(mut xs in prop::collection::vec(-9i64..10, 1..6), a in -3i64..4, b in 1i64..4) {
            let f = field();
            xs.sort_unstable();
            // prod (x - x_i), with multiplicity; y = a x^2 + 1; b z = x y
            let mut product = Polynomial::constant(f.one());
            for &x in &xs {
                let mut next = Polynomial::default();
                next.add_product(&f, &product, &polynomial(&[(1, vec![1, 0, 0]), (-x, vec![0, 0, 0])]));
                product = next;
            }
            let y = polynomial(&[(a, vec![2, 0, 0]), (1, vec![0, 0, 0]), (-1, vec![0, 1, 0])]);
            let z = polynomial(&[(b, vec![0, 0, 1]), (-1, vec![1, 1, 0])]);
            let input = [product, y, z];
            let mut basis = GroebnerBasis::new(&f, &[1, 1, 1], &input, &mut ENOUGH.clone());
            prop_assert!(is_basis_of(&basis, &input, &[1, 1, 1]));
            prop_assert_eq!(basis.dimension(50), Ok(Some(xs.len())));
            let mut values = |v: u32| {
                let element = Polynomial::variable(&f, v);
                let minimal = basis
                    .minimal_polynomial(&element, 50, &mut ENOUGH.clone())
                    .expect("work")
                    .expect("finite");
                crate::polynomial::distinct_roots(&f, &minimal)
            };
            let found = [values(0), values(1), values(2)];
            let distinct = |of: &dyn Fn(i64) -> i64| {
                xs.iter().map(|&x| of(x)).collect::<std::collections::BTreeSet<i64>>().len()
            };
            let y = |x: i64| a * x * x + 1;
            prop_assert_eq!(found, [distinct(&|x| x), distinct(&y), distinct(&|x| x * y(x))]);
        }
    }

    /// A case in which a published program was wrong, by hand: x y = 1 and y = -x^2/5 give x^3 = -5.
    #[test]
    fn a_basis_by_hand() {
        let f = field();
        let input = [
            polynomial(&[(1, vec![2, 0]), (5, vec![0, 1])]),
            polynomial(&[(1, vec![1, 1]), (-1, vec![0, 0])]),
        ];
        let mut basis = GroebnerBasis::new(&f, &[1, 1], &input, &mut ENOUGH.clone());
        assert!(is_basis_of(&basis, &input, &[1, 1]));
        let x = Polynomial::variable(&f, 0);
        let cube = basis.minimal_polynomial(&x, 5, &mut ENOUGH.clone()).expect("work").expect("finite");
        assert_eq!((cube, basis.dimension(5)), (vec![f.from_i64(5), 0, 0, f.one()], Ok(Some(3))));
        assert_eq!(basis.dimension(2), Ok(None));
        // no solution, and infinitely many
        let none = [input[1].clone(), x.clone()];
        assert_eq!(GroebnerBasis::new(&f, &[1, 1], &none, &mut ENOUGH.clone()).dimension(5), Ok(Some(0)));
        assert_eq!(GroebnerBasis::new(&f, &[1, 1], &input[..1], &mut ENOUGH.clone()).dimension(5), Ok(None));
    }

    /// Katsura's fourth system has sixteen solutions; with too little work no false statement results.
    #[test]
    fn work_ends() {
        let f = field();
        // sum u_|i| u_|m-i| = u_m for m = 0..3, u_0 + 2 sum u_i = 1
        let n = 5usize;
        let mut input = Vec::new();
        for m in 0..n as i64 - 1 {
            let mut p = polynomial(&[(-1, (0..n as i64).map(|v| u32::from(v == m)).collect())]);
            for i in 1 - n as i64..n as i64 {
                let j = (m - i).unsigned_abs() as usize;
                if j < n {
                    let mut exponents = vec![0; n];
                    exponents[i.unsigned_abs() as usize] += 1;
                    exponents[j] += 1;
                    p.add_scaled(&f, &polynomial(&[(1, exponents)]), f.one());
                }
            }
            input.push(p);
        }
        let mut sum = polynomial(&[(-1, vec![0; n])]);
        for i in 0..n {
            let exponents = (0..n).map(|v| u32::from(v == i)).collect();
            sum.add_scaled(&f, &polynomial(&[(if i == 0 { 1 } else { 2 }, exponents)]), f.one());
        }
        input.push(sum);
        let mut work = ENOUGH;
        let mut basis = GroebnerBasis::new(&f, &[1; 5], &input, &mut work);
        assert_eq!(basis.dimension(100), Ok(Some(16)));
        assert!(is_basis_of(&basis, &input, &[1; 5]));
        let needed = ENOUGH.left - work.left;
        assert!(!work.used_up);
        let mut short = RemainingWork::new(needed / 2);
        let part = GroebnerBasis::new(&f, &[1; 5], &input, &mut short);
        assert!(!part.is_complete() && short.used_up);
        // all elements found are in the ideal
        assert!(part.elements().iter().all(|p| divided(p.clone(), &basis.elements(), &[1; 5]).is_empty()));
    }
}
