//! Which sets of candidates make the required coefficients observable, and with what degrees: exact ranks, sets in
//! lexicographic order with the echelon basis of the prefix shared.

use std::collections::HashMap;

use obsdeg_exact::{Echelon, Field};
use rayon::prelude::*;

use super::DesignError;
use super::symmetry::Symmetry;
use crate::degree::ensemble::judge;
use crate::degree::platform_rows::local_chain;
use crate::model::attitude::{Euler, Matrix3};
use crate::model::platform::LOCAL;
use crate::model::{Carry, Gimbals, Platform, Scheme};

/// The rows that each candidate adds, whatever its place in the scheme.
#[derive(Debug, Clone)]
pub struct Rows {
    field: Field,
    columns: usize,
    /// The columns that must be solved.
    required: Vec<usize>,
    /// Bound on the probability that one set is taken for less than it is: ranks in a field can only be too small.
    pub miss: f64,
    /// Of every candidate: all its rows.
    rows: Vec<Vec<Vec<u64>>>,
    /// Of every order and candidate: the rows that derivatives of that order add.
    by_order: Vec<Vec<Vec<Vec<u64>>>>,
    /// A key of every candidate; the key of a set is their exclusive or.
    keys: Vec<u64>,
    /// `C_c^n` of every candidate in the field.
    attitudes: Vec<Matrix3<u64>>,
    platform: Platform,
}

impl Rows {
    /// The rows of `candidates` under the assumptions of `base`, in one random field of the stream of `seed`; `required` are indices
    /// among the coefficients. Under platform and inertial carry psi is shared and the rows are those of the chain; under reset
    /// carry psi of the position is eliminated, and rows of the coefficients are left.
    ///
    /// # Errors
    /// [`DesignError`].
    pub fn new(
        base: &Scheme,
        candidates: &[Euler],
        required: &[usize],
        seed: u64,
    ) -> Result<Self, DesignError> {
        let reset = base.carry == Carry::Reset;
        // psi of a position of its own: any carry does for one position
        let carry = if reset { Carry::Platform } else { base.carry };
        let positions = Scheme::of_angles(candidates.iter().cloned()).positions;
        let gimbals = Gimbals::default();
        let scheme = Scheme { positions, carry, combinations: Vec::new(), gimbals, ..base.clone() };
        let platform = Platform::new(scheme)?;
        let verdicts = judge(&platform, seed)?;
        let sample = verdicts.values[0].sample(platform.scheme(), 1);
        let (f, point) = (sample.point.ring, &sample.point);
        let chain = local_chain(&f, point.w_n, point.w_u, base.measured_azimuth);
        let n = platform.names().len();
        let first = if reset { 3 } else { 0 };
        let blocks = platform.blocks(point);
        let up_to = |order: usize| -> Vec<Vec<Vec<u64>>> {
            let rows = blocks.iter().map(|block| {
                let rows = chain.iter().filter(|local| local.order <= order).map(|local| {
                    let entry = |k: usize| f.dot(0, (0..LOCAL).map(|i| (local.row[i], block.rows[i][k])));
                    (0..n).map(entry).collect::<Vec<u64>>()
                });
                if reset { without_leading(f, rows.collect(), first) } else { rows.collect() }
            });
            rows.collect()
        };
        let last = chain.iter().map(|local| local.order).max().unwrap_or(0);
        let mut by_order: Vec<Vec<Vec<Vec<u64>>>> = (0..=last).map(up_to).collect();
        let rows = by_order[last].clone();
        if !reset {
            // what lower orders gave need not be given again
            for order in (1..=last).rev() {
                let (lower, this) = by_order.split_at_mut(order);
                for (rows, seen) in this[0].iter_mut().zip(&lower[order - 1]) {
                    rows.drain(..seen.len());
                }
            }
        }
        // the bound of two fields is the square of that of one
        let miss = verdicts.error_bound.sqrt();
        let mut rng = platform.scheme().random(seed, "keys of sets");
        Ok(Self {
            field: f,
            columns: n - first,
            required: required.iter().map(|c| c + 3 - first).collect(),
            miss,
            rows,
            by_order,
            keys: candidates.iter().map(|_| rng.next_u64()).collect(),
            attitudes: point.attitudes.clone(),
            platform,
        })
    }

    /// The number of candidates.
    pub fn candidates(&self) -> usize {
        self.rows.len()
    }

    /// The rows of some candidates, in this order.
    pub fn select(&self, order: &[usize]) -> Self {
        let of = |rows: &Vec<Vec<Vec<u64>>>| order.iter().map(|&i| rows[i].clone()).collect();
        Self {
            rows: of(&self.rows),
            by_order: self.by_order.iter().map(of).collect(),
            keys: order.iter().map(|&i| self.keys[i]).collect(),
            attitudes: order.iter().map(|&i| self.attitudes[i]).collect(),
            ..self.clone()
        }
    }

    /// Candidates that are the same attitude as an earlier one.
    pub fn repeated(&self) -> Vec<usize> {
        let mut first: HashMap<&Matrix3<u64>, usize> = HashMap::new();
        let seen = |(i, c)| (*first.entry(c).or_insert(i) != i).then_some(i);
        self.attitudes.iter().enumerate().filter_map(seen).collect()
    }

    /// How turning the platform axes maps the candidates.
    pub fn symmetry(&self, same: &dyn Fn(usize, usize) -> bool) -> Symmetry {
        Symmetry::new(&self.field, &self.platform, &self.attitudes, same)
    }

    /// The key of a set (candidates may be repeated).
    pub fn key(&self, sequence: &[usize]) -> u64 {
        let once = |(i, c): (usize, &usize)| (!sequence[..i].contains(c)).then(|| self.keys[*c]);
        sequence.iter().enumerate().filter_map(once).fold(0, |key, k| key ^ k)
    }

    /// The least number of positions that could do, by counting rows.
    pub fn counting_bound(&self) -> usize {
        let most = self.rows.iter().map(Vec::len).max().unwrap_or(0).max(1);
        self.required.len().div_ceil(most)
    }

    /// Highest order of a derivative that adds anything.
    pub fn last_order(&self) -> usize {
        self.by_order.len() - 1
    }

    /// The degree of every required coefficient in a set; `None` where it is not observable.
    pub fn degrees(&self, set: &[usize]) -> Vec<Option<usize>> {
        let mut basis = Echelon::new(self.field, self.columns);
        let mut degrees = vec![None; self.required.len()];
        for (order, rows) in self.by_order.iter().enumerate() {
            for row in set.iter().flat_map(|&c| &rows[c]) {
                basis.insert(row);
            }
            for (degree, &c) in degrees.iter_mut().zip(&self.required) {
                if degree.is_none() && basis.has_unit(c) {
                    *degree = Some(order);
                }
            }
        }
        degrees
    }

    /// All sets of `size` candidates with every required coefficient observable, each ascending, in lexicographic order.
    pub fn observable_sets(&self, size: usize) -> Vec<Vec<usize>> {
        let firsts: Vec<usize> = (0..self.candidates()).collect();
        let found: Vec<Vec<Vec<usize>>> = firsts
            .par_iter()
            .map(|&first| {
                let mut out = Vec::new();
                self.each(&[first], size, false, &mut { u64::MAX }, &mut |set| {
                    out.push(set.to_vec());
                    true
                });
                out
            })
            .collect();
        found.into_iter().flatten().collect()
    }

    /// The first such set among those that begin with one of `firsts`, and whether all were examined otherwise: no more than `budget`
    /// prefixes and sets are looked at for each of `firsts`.
    pub fn first_observable_set(
        &self,
        size: usize,
        firsts: &[usize],
        budget: u64,
    ) -> (Option<Vec<usize>>, bool) {
        let found: Vec<(Option<Vec<usize>>, bool)> = firsts
            .par_iter()
            .map(|&first| {
                let (mut out, mut left) = (None, budget);
                self.each(&[first], size, false, &mut left, &mut |set| {
                    out = Some(set.to_vec());
                    false
                });
                (out, left > 0)
            })
            .collect();
        let complete = found.iter().all(|f| f.1);
        (found.into_iter().find_map(|f| f.0), complete)
    }

    /// Hands all observable sets of `size` that begin with `prefix` (ascending) to `found`, in lexicographic order, until it wants no
    /// more; `repeat`: a candidate may be taken more than once.
    pub fn each(
        &self,
        prefix: &[usize],
        size: usize,
        repeat: bool,
        budget: &mut u64,
        found: &mut dyn FnMut(&[usize]) -> bool,
    ) {
        let Some((&last, before)) = prefix.split_last() else { return };
        let mut basis = Echelon::new(self.field, self.columns);
        for row in before.iter().flat_map(|&c| &self.rows[c]) {
            basis.insert(row);
        }
        self.extend(&mut basis, &mut before.to_vec(), last, (size, usize::from(!repeat)), budget, found);
    }

    /// Adds `candidate` and everything behind it, `step` further on at least; false when `found` wants no more or the budget is spent.
    fn extend(
        &self,
        basis: &mut Echelon,
        set: &mut Vec<usize>,
        candidate: usize,
        (size, step): (usize, usize),
        budget: &mut u64,
        found: &mut dyn FnMut(&[usize]) -> bool,
    ) -> bool {
        *budget = budget.saturating_sub(1);
        if *budget == 0 {
            return false;
        }
        set.push(candidate);
        for row in &self.rows[candidate] {
            basis.insert(row);
        }
        let left = size - set.len();
        // every further position adds at most its rows
        let most = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let mut go_on = true;
        if basis.rank() + left * most >= self.required.len() {
            if left == 0 {
                if self.required.iter().all(|&c| basis.has_unit(c)) {
                    go_on = found(set);
                }
            } else {
                for next in candidate + step..self.candidates() {
                    if step > 0 && self.candidates() - next < left {
                        break;
                    }
                    let mut longer = basis.clone();
                    go_on = self.extend(&mut longer, set, next, (size, step), budget, found);
                    if !go_on {
                        break;
                    }
                }
            }
        }
        set.pop();
        go_on
    }
}

/// Combinations of `rows` that vanish in the first `leading` columns, without these columns.
fn without_leading(f: Field, mut rows: Vec<Vec<u64>>, leading: usize) -> Vec<Vec<u64>> {
    for c in 0..leading {
        let Some(p) = rows.iter().position(|r| r[c] != 0) else { continue };
        let pivot = rows.swap_remove(p);
        let inverse = f.inv(pivot[c]);
        for row in rows.iter_mut().filter(|r| r[c] != 0) {
            let factor = f.neg(f.mul(row[c], inverse));
            for (x, &y) in row.iter_mut().zip(&pivot) {
                *x = f.add(*x, f.mul(factor, y));
            }
        }
    }
    rows.into_iter().map(|r| r[leading..].to_vec()).filter(|r| r.iter().any(|&x| x != 0)).collect()
}
