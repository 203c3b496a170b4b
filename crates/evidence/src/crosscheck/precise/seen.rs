//! Observable directions of the information matrix, separated from rounding.

use std::collections::BTreeMap;

use super::digits::{Digits, Functional, ROUNDING, Real, Vector, log2};
use super::information::SampleInformation;

/// Bounds of a pivot, as fractions of the bits below the diagonal. A pivot above the first is observable: the
/// errors of Cholesky's elimination are within half of the digits. A pivot below the second is rounding.
/// Between them nothing is certain.
const CLEAR: f64 = 10.0 / 16.0;
const ROUNDING_BELOW: f64 = 11.0 / 16.0;
/// Size in bits, relative to the largest coefficient (drifts in units of the earth rate), below which a
/// coefficient is the rounding of doubles. Differences of positions, at least 1e-11, are far larger.
const NEGLIGIBLE: f64 = -46.0;
/// Bits by which a sum of errors may exceed the largest of them.
const SUMMED: f64 = 8.0;

/// Observable directions: `N = sum l_k l_k^T`, best observable first.
pub(in super::super) struct ObservableDirections {
    digits: Digits,
    /// Unknown of each pivot.
    pub(in super::super) pivots: Vec<usize>,
    /// Columns `l_k` (n entries each).
    columns: Vec<Vector>,
    /// Binary logarithms of the pivots, descending.
    pub(in super::super) sizes: Vec<f64>,
    /// Flags by unknown: true if its column is not zero.
    pub(in super::super) excited: Vec<bool>,
    /// Binary logarithms of the diagonal of N, by unknown.
    own: Vec<f64>,
    psi_at_end: Vec<Functional>,
}

impl SampleInformation {
    /// Cholesky factors, the largest pivot first; `None` where observable directions cannot be separated from
    /// rounding.
    pub(super) fn seen(mut self) -> Option<ObservableDirections> {
        let d = self.digits;
        let n = self.matrix.len();
        let diagonal = |m: &[Vector], c: usize| log2(&m[c][c]);
        let own: Vec<Option<f64>> = (0..n).map(|c| diagonal(&self.matrix, c)).collect();
        let largest = own.iter().flatten().copied().fold(f64::MIN, f64::max);
        let [rounding, clear] = [ROUNDING_BELOW, CLEAR].map(|part| -part * d.bits as f64);
        // a column whose entries are rounding lies below the square of that; an observable one lies above
        let excited: Vec<bool> =
            own.iter().map(|x| x.is_some_and(|x| x - largest > 2.0 * rounding)).collect();
        let doubtful = |x: f64| x - largest > 2.0 * rounding && x - largest < 2.0 * clear;
        if own.iter().flatten().any(|x| doubtful(*x)) {
            return None;
        }
        let mut left: Vec<usize> = (0..n).filter(|&c| excited[c]).collect();
        let (mut pivots, mut columns, mut sizes): (Vec<usize>, Vec<Vector>, Vec<f64>) = Default::default();
        loop {
            // rest of a column, relative to its own diagonal
            let part = |c: usize| Some((c, diagonal(&self.matrix, c)?, own[c]?));
            let parts = || left.iter().filter_map(|&c| part(c));
            let positive = |c: usize| self.matrix[c][c].is_positive();
            if parts().any(|(c, x, own)| x - own > rounding && (x - own < clear || !positive(c))) {
                return None;
            }
            let best = parts().filter(|(_, x, own)| x - own > rounding).max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((pivot, size, _)) = best else { break };
            let root = self.matrix[pivot][pivot].sqrt(d.bits, ROUNDING);
            let mut column = vec![d.int(0); n];
            column[pivot] = root.clone();
            left.retain(|c| *c != pivot);
            for &c in &left {
                column[c] = d.div(&self.matrix[c][pivot], &root);
            }
            for (i, &r) in left.iter().enumerate() {
                for &c in &left[i..] {
                    let x = d.sub(&self.matrix[r][c], &d.mul(&column[r], &column[c]));
                    self.matrix[c][r] = x.clone();
                    self.matrix[r][c] = x;
                }
            }
            pivots.push(pivot);
            columns.push(column);
            sizes.push(size);
        }
        let own = own.into_iter().map(|x| x.unwrap_or(f64::MIN)).collect();
        Some(ObservableDirections {
            digits: d,
            pivots,
            columns,
            sizes,
            excited,
            own,
            psi_at_end: self.psi_at_end,
        })
    }
}

/// Functional of psi at the end and the coefficients, as one of the unknowns at the start; `psi` has psi of
/// the end.
pub(super) fn at_start(d: Digits, psi: &[Functional], functional: &Functional) -> Functional {
    let moved = functional.iter().flat_map(|(c, x)| match psi.get(*c) {
        Some(psi) => psi.iter().map(|(k, y)| (*k, d.mul(x, y))).collect(),
        None => vec![(*c, x.clone())],
    });
    moved.filter(|(_, x)| !x.is_zero()).collect()
}

impl ObservableDirections {
    pub(in super::super) fn digits(&self) -> Digits {
        self.digits
    }

    /// Number of observable directions.
    pub(in super::super) fn rank(&self) -> usize {
        self.pivots.len()
    }

    /// Half the digits, as a binary logarithm: a smaller number, in units of the largest rounding error, is
    /// rounding.
    fn rounding(&self) -> f64 {
        -(self.digits.bits as f64) / 2.0
    }

    /// Binary logarithm of sigma of a functional, by the observable directions alone; `None` outside their
    /// span. `rounded` is the relative error of its coefficients; without it they are exact.
    pub(in super::super) fn sigma(&self, functional: &Functional, rounded: Option<f64>) -> Option<f64> {
        let d = self.digits;
        let mut rest = vec![d.int(0); self.own.len()];
        for (c, x) in functional {
            rest[*c] = d.add(&rest[*c], x);
        }
        // sums of the magnitudes of the terms that the rest is the difference of
        let mut sizes: Vec<Real> = rest.iter().map(Real::abs).collect();
        let mut variance = d.int(0);
        let largest = rest.iter().filter_map(log2).fold(f64::MIN, f64::max);
        let vanishes = |rest: &Vector, sizes: &Vector, variance: &Real| {
            let sigma = log2(variance).map(|v| v / 2.0);
            rest.iter().zip(sizes).zip(&self.own).all(|((x, size), own)| {
                let Some(x) = log2(x) else { return true };
                let coefficients = rounded
                    .zip(log2(size))
                    .is_some_and(|(r, size)| x - size < r.log2() || x - largest < NEGLIGIBLE);
                // error of N, relative to its diagonal
                coefficients || sigma.is_some_and(|sigma| x - (own / 2.0 + sigma) < self.rounding())
            })
        };
        for (pivot, column) in self.pivots.iter().zip(&self.columns) {
            if vanishes(&rest, &sizes, &variance) {
                break;
            }
            let y = d.div(&rest[*pivot], &column[*pivot]);
            variance = d.add(&variance, &d.mul(&y, &y));
            for ((x, size), l) in rest.iter_mut().zip(&mut sizes).zip(column).filter(|(_, l)| !l.is_zero()) {
                let part = d.mul(&y, l);
                *x = d.sub(x, &part);
                *size = d.add(size, &part.abs());
            }
            rest[*pivot] = d.int(0);
        }
        vanishes(&rest, &sizes, &variance).then(|| log2(&variance).map(|v| v / 2.0)).flatten()
    }

    /// Functional of psi at the end and the coefficients, as one of the unknowns at the start. Rounding
    /// residue of unknowns that affect no sample is left out (`cos^2 + sin^2 - 1` where attitudes cancel).
    pub(in super::super) fn at_start(&self, functional: &Functional) -> Functional {
        let mut moved: BTreeMap<usize, Real> = BTreeMap::new();
        for (c, x) in at_start(self.digits, &self.psi_at_end, functional) {
            let sum = moved.entry(c).or_insert_with(|| self.digits.int(0));
            *sum = self.digits.add(sum, &x);
        }
        let largest = moved.values().filter_map(log2).fold(f64::MIN, f64::max);
        let counts = |x: &Real| log2(x).is_some_and(|x| x - largest > self.rounding());
        moved.retain(|c, x| self.excited[*c] || counts(x));
        moved.into_iter().collect()
    }

    /// Excited unknowns that are not pivots.
    pub(in super::super) fn free(&self) -> Vec<usize> {
        (0..self.own.len()).filter(|c| self.excited[*c] && !self.pivots.contains(c)).collect()
    }

    /// Unobservable directions: `x_pivots = -R x_free` with `R = R_11^-1 R_12`. Returns the free unknowns
    /// (excited ones only), and for every pivot its row of R, with zeros for rounding.
    pub(in super::super) fn reduced(&self) -> (Vec<usize>, Vec<Vector>) {
        let d = self.digits;
        let free = self.free();
        // from the last pivot up; the rounding error of an entry comes from its own pivot, or from entries
        // below
        let mut rows: Vec<Vector> = Vec::new();
        let mut errors: Vec<Vec<f64>> = Vec::new();
        for (k, column) in self.columns.iter().enumerate().rev() {
            let below = &self.pivots[k + 1..];
            let pivot = &column[self.pivots[k]];
            let (mut row, mut error) = (Vec::new(), Vec::new());
            for (j, &f) in free.iter().enumerate() {
                let known = below.iter().map(|&p| &column[p]).zip(rows.iter().rev().map(|r: &Vector| &r[j]));
                let x = d.div(&d.sub(&column[f], &d.dot(known)), pivot);
                let own = (self.own[f] - self.sizes[k]) / 2.0 + self.rounding();
                let inherited = below
                    .iter()
                    .zip(errors.iter().rev())
                    .filter_map(|(&p, e)| Some(log2(&column[p])? + e[j]));
                let inherited =
                    log2(pivot).map_or(f64::MIN, |size| inherited.fold(f64::MIN, f64::max) - size);
                let rounded = own.max(inherited + SUMMED);
                row.push(if log2(&x).is_none_or(|x| x < rounded) { d.int(0) } else { x });
                error.push(rounded);
            }
            rows.push(row);
            errors.push(error);
        }
        rows.reverse();
        (free, rows)
    }
}
