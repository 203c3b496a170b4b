//! Which sets of candidates make the required unknowns observable: exact ranks, sets in lexicographic order with the
//! echelon basis of the prefix shared.

use obsdeg_exact::{Echelon, Field};
use rayon::prelude::*;

use super::DesignError;
use crate::degree::ensemble::judge;
use crate::degree::platform_rows::local_chain;
use crate::model::attitude::Euler;
use crate::model::platform::LOCAL;
use crate::model::{Carry, Platform, Scheme};

/// The rows that each candidate adds, whatever its place in the scheme.
#[derive(Debug, Clone)]
pub struct Rows {
    field: Field,
    columns: usize,
    /// The columns that must be solved.
    required: Vec<usize>,
    /// Bound on the probability that one set is taken for less than it is: ranks in a field can only be too small.
    pub miss: f64,
    /// Of every candidate: its rows.
    rows: Vec<Vec<Vec<u64>>>,
}

impl Rows {
    /// The rows of `candidates` under the assumptions of `base`, in one random field of the stream of `seed`.
    /// Under platform and inertial carry psi is shared and the rows are those of the chain; under reset carry psi of
    /// the position is eliminated, and rows of the coefficients are left.
    ///
    /// # Errors
    /// [`DesignError`].
    pub fn new(base: &Scheme, candidates: &[Euler], seed: u64) -> Result<Self, DesignError> {
        let reset = base.carry == Carry::Reset;
        // psi of a position of its own: any carry does for one position
        let carry = if reset { Carry::Platform } else { base.carry };
        let positions = Scheme::of_angles(candidates.iter().cloned()).positions;
        let scheme = Scheme { positions, carry, combinations: Vec::new(), ..base.clone() };
        let platform = Platform::new(scheme)?;
        let verdicts = judge(&platform, seed)?;
        let sample = verdicts.values[0].sample(platform.scheme(), 1);
        let (f, point) = (sample.point.ring, &sample.point);
        let chain = local_chain(&f, point.w_n, point.w_u, base.measured_azimuth);
        let n = platform.names().len();
        let first = if reset { 3 } else { 0 };
        let blocks = platform.blocks(point);
        let rows = blocks.iter().map(|block| {
            let rows = chain.iter().map(|local| {
                let entry = |k: usize| f.dot(0, (0..LOCAL).map(|i| (local.row[i], block.rows[i][k])));
                (0..n).map(entry).collect::<Vec<u64>>()
            });
            if reset { without_leading(f, rows.collect(), first) } else { rows.collect() }
        });
        let required = (0..n).filter(|&c| platform.units()[c] != "rad").map(|c| c - first).collect();
        // the bound of two fields is the square of that of one
        let miss = verdicts.error_bound.sqrt();
        Ok(Self { field: f, columns: n - first, required, miss, rows: rows.collect() })
    }

    /// The number of candidates.
    pub fn candidates(&self) -> usize {
        self.rows.len()
    }

    /// The least number of positions that could do, by counting rows.
    pub fn counting_bound(&self) -> usize {
        let most = self.rows.iter().map(Vec::len).max().unwrap_or(0).max(1);
        self.required.len().div_ceil(most)
    }

    /// All sets of `size` candidates with every required unknown observable, each ascending, in lexicographic order.
    pub fn observable_sets(&self, size: usize) -> Vec<Vec<usize>> {
        let firsts: Vec<usize> = (0..self.candidates()).collect();
        let found: Vec<Vec<Vec<usize>>> = firsts
            .par_iter()
            .map(|&first| {
                let mut out = Vec::new();
                let mut basis = Echelon::new(self.field, self.columns);
                self.extend(&mut basis, &mut Vec::with_capacity(size), first, size, &mut |set| {
                    out.push(set.to_vec());
                    true
                });
                out
            })
            .collect();
        found.into_iter().flatten().collect()
    }

    /// The first such set.
    pub fn first_observable_set(&self, size: usize) -> Option<Vec<usize>> {
        let firsts: Vec<usize> = (0..self.candidates()).collect();
        let found: Vec<Option<Vec<usize>>> = firsts
            .par_iter()
            .map(|&first| {
                let mut out = None;
                let mut basis = Echelon::new(self.field, self.columns);
                self.extend(&mut basis, &mut Vec::with_capacity(size), first, size, &mut |set| {
                    out = Some(set.to_vec());
                    false
                });
                out
            })
            .collect();
        found.into_iter().flatten().next()
    }

    /// Adds `candidate` and everything behind it; false when `found` wants no more.
    fn extend(
        &self,
        basis: &mut Echelon,
        set: &mut Vec<usize>,
        candidate: usize,
        size: usize,
        found: &mut dyn FnMut(&[usize]) -> bool,
    ) -> bool {
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
                for next in candidate + 1..self.candidates() {
                    if self.candidates() - next < left {
                        break;
                    }
                    let mut longer = basis.clone();
                    go_on = self.extend(&mut longer, set, next, size, found);
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
