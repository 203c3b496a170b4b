//! Sets of candidates that make the required coefficients observable, with their degrees: exact ranks
//! in several prime fields. Sets are enumerated in lexicographic order and share the echelon bases of
//! their prefixes.
//!
//! A rank in a field can only be too small. A set that one field calls observable is therefore
//! observable, and the smallest degree of all fields is right unless all of them err. For each rank
//! this has a probability below `miss^fields`.

use std::collections::HashMap;

use obsdeg_core::degree::{EnsembleError, local_chain};
use obsdeg_core::model::{Carry, ErrorSource, Euler, Gimbals, Matrix3, Platform, RandomValues, Scheme};
use obsdeg_exact::certainty::{RankClaim, error_bound};
use obsdeg_exact::parallel;
use obsdeg_exact::{Echelon, Field};

use crate::design::observable::symmetry::CandidateSymmetry;
use crate::design::request::error::DesignError;

/// Bound on the probability that a rank is wrong in all fields, which sets their number: a search
/// decides up to 1e12 ranks.
const MISS: f64 = 1e-24;
/// Number of sets and prefixes between two calls of the cancellation callback.
const PATIENCE: u64 = 256;

/// Rows that each candidate adds, at any place of a scheme.
#[derive(Debug, Clone)]
pub struct AttitudeRows {
    /// Rows in independent random fields.
    fields: Vec<FieldRows>,
    columns: usize,
    /// Columns of the coefficients that must be observable.
    required: Vec<usize>,
    /// Bound on the probability that one rank is too small in one field.
    miss: f64,
    platform: Platform,
}

/// Rows of all candidates in one field.
#[derive(Debug, Clone)]
struct FieldRows {
    field: Field,
    /// Rows of each candidate, of all orders.
    rows: Vec<Vec<Vec<u64>>>,
    /// Rows that derivatives of an order add, by order and candidate.
    by_order: Vec<Vec<Vec<Vec<u64>>>>,
    /// Largest number of rows that a candidate adds.
    most: usize,
    /// Attitude `C_c^n` of every candidate in the field.
    attitudes: Vec<Matrix3<u64>>,
}

/// Limits of an enumeration of sets.
pub struct EnumerationLimits<'a> {
    /// Number of prefixes and sets that may still be examined.
    pub budget: u64,
    /// Cancellation callback: false ends the enumeration.
    pub proceed: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> EnumerationLimits<'a> {
    /// Limits without a budget: the enumeration stops when `proceed` returns false.
    pub(crate) fn without_budget(proceed: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self { budget: u64::MAX, proceed }
    }

    /// Counts one set or prefix; false if the enumeration must end.
    fn goes_on(&mut self) -> bool {
        self.budget = self.budget.saturating_sub(1);
        if self.budget.is_multiple_of(PATIENCE) && !(self.proceed)() {
            self.budget = 0;
        }
        self.budget > 0
    }
}

impl AttitudeRows {
    /// Rows of `candidates` under the assumptions of `base`, in random fields that depend on `seed` and
    /// on these inputs; `required` are indices among the coefficients. Under platform and inertial
    /// carry psi is shared and the rows are those of the chain. Under reset carry psi of the position
    /// is eliminated, which leaves rows on the coefficients.
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
        // psi of a position of its own: for a single position all carries are equal
        let carry = if reset { Carry::Platform } else { base.carry };
        let positions = Scheme::of_angles(candidates.iter().cloned()).positions;
        let gimbals = Gimbals::default();
        let scheme = Scheme { positions, carry, combinations: Vec::new(), gimbals, ..base.clone() };
        let platform = Platform::new(scheme)?;
        let first = if reset { 3 } else { 0 };
        let entries = 3 + platform.coefficients();
        let factors = base.unknowns.terms().iter().map(|t| t.order()).max().unwrap_or(0).max(2);
        let mut rng = platform.scheme().random(seed, "sets of candidates");
        let (mut fields, mut miss) = (Vec::new(), 1.0);
        while fields.len() < 2 || f64::powi(miss, fields.len() as i32) > MISS {
            let values = RandomValues::draw(platform.scheme(), &mut rng).map_err(EnsembleError::from)?;
            let here = FieldRows::new(&platform, &values, first);
            // a rank is one minor: of the rows of all orders of some positions, each with a psi of its own
            // under reset carry
            let psi = if reset { 3 * candidates.len() } else { 3 };
            let orders = here.by_order.len();
            let claim = RankClaim {
                unknowns: platform.coefficients() + psi,
                decisions: 1,
                order: values.roots().order,
                row_degree: orders + usize::from(base.unknowns.have(ErrorSource::Rate)),
                // an entry is at most 6, denominators 2^9 (2^3 of every factor beyond two), 15 entries of
                // norm at most sqrt(15) together, with margin
                row_bits: 16.0 + 3.0 * (factors - 2) as f64 + (entries as f64 / 15.0).log2().max(0.0) / 2.0,
            };
            miss = error_bound(&claim, 1);
            fields.push(here);
        }
        Ok(Self {
            fields,
            columns: platform.names().len() - first,
            required: required.iter().map(|c| c + 3 - first).collect(),
            miss,
            platform,
        })
    }

    /// Number of candidates.
    pub fn candidates(&self) -> usize {
        self.fields.first().map_or(0, |here| here.rows.len())
    }

    /// Number of fields.
    pub fn fields(&self) -> usize {
        self.fields.len()
    }

    /// Bound on the probability that any of `sets` sets was judged too low, or that candidates were
    /// wrongly taken for images of each other.
    pub fn error_bound(&self, sets: f64) -> f64 {
        let images = 24.0 * (self.candidates() as f64).powi(2);
        let ranks = (sets + 1.0) * (self.last_order() + 1) as f64;
        ((ranks + images) * self.miss.powi(self.fields.len() as i32)).min(1.0)
    }

    /// Rows of the candidates with these indices, in this order.
    pub fn select(&self, order: &[usize]) -> Self {
        let of = |rows: &Vec<Vec<Vec<u64>>>| order.iter().map(|&i| rows[i].clone()).collect();
        let fields = self.fields.iter().map(|here| FieldRows {
            field: here.field,
            rows: of(&here.rows),
            by_order: here.by_order.iter().map(of).collect(),
            most: here.most,
            attitudes: order.iter().map(|&i| here.attitudes[i]).collect(),
        });
        Self {
            fields: fields.collect(),
            required: self.required.clone(),
            platform: self.platform.clone(),
            ..*self
        }
    }

    /// Indices of candidates with the same attitude as an earlier one.
    pub fn repeated(&self) -> Vec<usize> {
        let mut first: HashMap<Vec<&Matrix3<u64>>, usize> = HashMap::new();
        let everywhere = |i: usize| self.fields.iter().map(|here| &here.attitudes[i]).collect();
        let seen = |i: usize| (*first.entry(everywhere(i)).or_insert(i) != i).then_some(i);
        (0..self.candidates()).filter_map(seen).collect()
    }

    /// Symmetry of the candidates under turns of the platform axes; `same` as in [`CandidateSymmetry::new`].
    pub fn symmetry(&self, same: &dyn Fn(usize, usize) -> bool) -> CandidateSymmetry {
        let fields: Vec<(Field, &[Matrix3<u64>])> =
            self.fields.iter().map(|here| (here.field, &here.attitudes[..])).collect();
        CandidateSymmetry::new(&fields, &self.platform, same)
    }

    /// Lower bound on the number of positions, by counting rows.
    pub fn counting_bound(&self) -> usize {
        self.required.len().div_ceil(self.most().max(1))
    }

    /// Largest number of rows that a candidate adds.
    pub fn most(&self) -> usize {
        self.fields.iter().map(|here| here.most).max().unwrap_or(0)
    }

    /// Highest order of a derivative that adds rows.
    pub fn last_order(&self) -> usize {
        self.fields.iter().map(|here| here.by_order.len() - 1).max().unwrap_or(0)
    }

    /// Degree of every required coefficient in a set; `None` where it is not observable.
    pub fn degrees(&self, set: &[usize]) -> Vec<Option<usize>> {
        let mut best = self.likely_degrees(set);
        for here in &self.fields[1..] {
            // no degree is below 0
            if best.iter().all(|d| *d == Some(0)) {
                break;
            }
            for (best, other) in best.iter_mut().zip(here.degrees(set, self.columns, &self.required)) {
                *best = best.zip(other).map(|(a, b)| a.min(b)).or(*best).or(other);
            }
        }
        best
    }

    /// Degrees as [`Self::degrees`], in one field only: a degree may be too large.
    pub(crate) fn likely_degrees(&self, set: &[usize]) -> Vec<Option<usize>> {
        self.fields[0].degrees(set, self.columns, &self.required)
    }

    /// All sets of `size` candidates with every required coefficient observable, each ascending, in
    /// lexicographic order.
    pub fn observable_sets(&self, size: usize) -> Vec<Vec<usize>> {
        let behind = |first: usize| {
            let mut out = Vec::new();
            self.each(&[first], size, false, &mut EnumerationLimits::without_budget(&|| true), &mut |set| {
                out.push(set.to_vec());
                true
            });
            out
        };
        parallel::map(self.candidates(), behind).concat()
    }

    /// First observable set of `size` candidates that begins with one of `firsts`, and true if no enumeration
    /// was cut short. At most `budget` prefixes and sets are examined for each of `firsts`; stops when
    /// `proceed` returns false.
    pub(crate) fn first_observable_set(
        &self,
        size: usize,
        firsts: &[usize],
        budget: u64,
        proceed: &(dyn Fn() -> bool + Sync),
    ) -> (Option<Vec<usize>>, bool) {
        let found: Vec<(Option<Vec<usize>>, bool)> = parallel::map(firsts.len(), |i| {
            let (mut out, mut patience) = (None, EnumerationLimits { budget, proceed });
            self.each(&[firsts[i]], size, false, &mut patience, &mut |set| {
                out = Some(set.to_vec());
                false
            });
            (out, patience.budget > 0)
        });
        let complete = found.iter().all(|f| f.1);
        (found.into_iter().find_map(|f| f.0), complete)
    }

    /// Passes all observable sets of `size` that begin with `prefix` (ascending) to `found`, in
    /// lexicographic order, until `found` returns false. With `repeat` a candidate may occur more than
    /// once.
    pub fn each(
        &self,
        prefix: &[usize],
        size: usize,
        repeat: bool,
        patience: &mut EnumerationLimits<'_>,
        found: &mut dyn FnMut(&[usize]) -> bool,
    ) {
        let Some((&last, before)) = prefix.split_last() else { return };
        let mut bases: Vec<Echelon> =
            self.fields.iter().map(|here| Echelon::new(here.field, self.columns)).collect();
        for (basis, here) in bases.iter_mut().zip(&self.fields) {
            before.iter().for_each(|&c| here.add(basis, c));
        }
        self.extend(&bases, &mut before.to_vec(), last, (size, usize::from(!repeat)), patience, found);
    }

    /// Adds `candidate`, then all later ones at a distance of at least `step`, to a set with these
    /// bases. Returns false if `found` does or if the limits are reached.
    fn extend(
        &self,
        bases: &[Echelon],
        set: &mut Vec<usize>,
        candidate: usize,
        (size, step): (usize, usize),
        patience: &mut EnumerationLimits<'_>,
        found: &mut dyn FnMut(&[usize]) -> bool,
    ) -> bool {
        if !patience.goes_on() {
            return false;
        }
        let left = size - set.len() - 1;
        let longer = |(here, basis): (&FieldRows, &Echelon)| {
            let mut basis = basis.clone();
            here.add(&mut basis, candidate);
            basis
        };
        let mut bases = self.fields.iter().zip(bases);
        // every further position adds at most its rows
        let may_do =
            |here: &FieldRows, basis: &Echelon| basis.rank() + left * here.most >= self.required.len();
        set.push(candidate);
        let mut go_on = true;
        if left == 0 {
            let does = |basis: &Echelon| self.required.iter().all(|&c| basis.has_unit(c));
            if bases.any(|both| does(&longer(both))) {
                go_on = found(set);
            }
        } else {
            let bases: Vec<Echelon> = bases.map(longer).collect();
            if !self.fields.iter().zip(&bases).any(|(here, basis)| may_do(here, basis)) {
                // no set that begins like this is sufficient
            } else if left == 1 {
                go_on = self.last(&bases, set, candidate + step, patience, found);
            } else {
                for next in candidate + step..self.candidates() {
                    if step > 0 && self.candidates() - next < left {
                        break;
                    }
                    go_on = self.extend(&bases, set, next, (size, step), patience, found);
                    if !go_on {
                        break;
                    }
                }
            }
        }
        set.pop();
        go_on
    }

    /// Adds one more candidate, from `first` on, to a set with these bases.
    fn last(
        &self,
        bases: &[Echelon],
        set: &mut Vec<usize>,
        first: usize,
        patience: &mut EnumerationLimits<'_>,
        found: &mut dyn FnMut(&[usize]) -> bool,
    ) -> bool {
        // in further fields only if the first one says no
        let mut unseen: Vec<NullSpace> = Vec::with_capacity(bases.len());
        let mut scratch = Vec::new();
        for next in first..self.candidates() {
            if !patience.goes_on() {
                return false;
            }
            let does = self.fields.iter().zip(bases).enumerate().any(|(i, (here, basis))| {
                if unseen.len() == i {
                    unseen.push(NullSpace::new(basis, &self.required));
                }
                unseen[i].is_seen(&here.rows[next], &mut scratch)
            });
            if does {
                set.push(next);
                let go_on = found(set);
                set.pop();
                if !go_on {
                    return false;
                }
            }
        }
        true
    }
}

/// Null space of the rows of a set, with basis v_1 .. v_m.
struct NullSpace {
    field: Field,
    vectors: Vec<Vec<u64>>,
    /// Independent rows of the matrix of the required components of v_1 .. v_m.
    wanted: Vec<Vec<u64>>,
}

impl NullSpace {
    fn new(basis: &Echelon, required: &[usize]) -> Self {
        let f = basis.field();
        // with pivot entries d_i and D their product: D at a free column, -row_i (D / d_i) at pivot i
        let pivots: Vec<(usize, u64)> =
            basis.pivots().enumerate().map(|(i, c)| (c, basis.row(i)[c])).collect();
        let mut weights = vec![f.one(); pivots.len()];
        let mut product = f.one();
        for (w, (_, d)) in weights.iter_mut().zip(&pivots) {
            *w = product;
            product = f.mul(product, *d);
        }
        let mut after = f.neg(f.one());
        for (w, (_, d)) in weights.iter_mut().zip(&pivots).rev() {
            *w = f.mul(*w, after);
            after = f.mul(after, *d);
        }
        let vector = |free: usize| {
            let mut v = vec![0; basis.columns()];
            v[free] = product;
            for (i, ((c, _), &w)) in pivots.iter().zip(&weights).enumerate() {
                v[*c] = f.mul(basis.row(i)[free], w);
            }
            v
        };
        let is_free = |c: &usize| basis.pivot_row(*c).is_none();
        let vectors: Vec<Vec<u64>> = (0..basis.columns()).filter(is_free).map(vector).collect();
        let mut components = Echelon::new(f, vectors.len());
        for &c in required {
            if components.rank() < vectors.len() {
                components.insert(&vectors.iter().map(|v| v[c]).collect::<Vec<_>>());
            }
        }
        let wanted = (0..components.rank()).map(|i| components.row(i).to_vec()).collect();
        Self { field: f, vectors, wanted }
    }

    /// True if `rows` make every required component observable: their products with v_1 .. v_m span
    /// `wanted`.
    fn is_seen(&self, rows: &[Vec<u64>], scratch: &mut Vec<u64>) -> bool {
        let (f, m) = (self.field, self.vectors.len());
        if rows.len() < self.wanted.len() {
            return false;
        }
        scratch.clear();
        for row in rows {
            let entry = |v: &Vec<u64>| f.dot(0, row.iter().copied().zip(v.iter().copied()));
            scratch.extend(self.vectors.iter().map(entry));
        }
        self.wanted.iter().for_each(|row| scratch.extend(row));
        // elimination with the pivots in `rows`
        let (mut top, all) = (0, rows.len() + self.wanted.len());
        for c in 0..m {
            let Some(p) = (top..rows.len()).find(|r| scratch[r * m + c] != 0) else { continue };
            (0..m).for_each(|j| scratch.swap(p * m + j, top * m + j));
            let (done, below) = scratch.split_at_mut((top + 1) * m);
            let pivot = &done[top * m..];
            for row in below.chunks_exact_mut(m).take(all - top - 1) {
                if row[c] != 0 {
                    let factor = f.neg(row[c]);
                    for (x, &y) in row.iter_mut().zip(pivot).skip(c) {
                        *x = f.add(f.mul(*x, pivot[c]), f.mul(factor, y));
                    }
                }
            }
            top += 1;
        }
        scratch[rows.len() * m..].iter().all(|x| *x == 0)
    }
}

impl FieldRows {
    /// Rows of every position of `platform` at random values; psi, the first `leading` columns, is
    /// eliminated.
    fn new(platform: &Platform, values: &RandomValues, leading: usize) -> Self {
        let sample = values.sample(platform.scheme(), 1);
        let (f, point) = (sample.point.ring, &sample.point);
        let chain = local_chain(&f, point.w_n, point.w_u, platform.observed());
        let n = platform.names().len();
        let blocks = platform.blocks(point);
        let up_to = |order: usize| -> Vec<Vec<Vec<u64>>> {
            let rows = blocks.iter().map(|block| {
                let rows = chain.iter().filter(|local| local.order <= order).map(|local| {
                    let entry = |k: usize| block.entry(&f, &local.row, k);
                    (0..n).map(entry).collect::<Vec<u64>>()
                });
                if leading > 0 { without_leading(f, rows.collect(), leading) } else { rows.collect() }
            });
            rows.collect()
        };
        let last = chain.iter().map(|local| local.order).max().unwrap_or(0);
        let mut by_order: Vec<Vec<Vec<Vec<u64>>>> = (0..=last).map(up_to).collect();
        let rows = by_order[last].clone();
        if leading == 0 {
            // rows of lower orders are not repeated
            for order in (1..=last).rev() {
                let (lower, this) = by_order.split_at_mut(order);
                for (rows, seen) in this[0].iter_mut().zip(&lower[order - 1]) {
                    rows.drain(..seen.len());
                }
            }
        }
        let most = rows.iter().map(Vec::len).max().unwrap_or(0);
        Self { field: f, rows, by_order, most, attitudes: sample.point.attitudes }
    }

    fn add(&self, basis: &mut Echelon, candidate: usize) {
        for row in &self.rows[candidate] {
            basis.insert(row);
        }
    }

    fn degrees(&self, set: &[usize], columns: usize, required: &[usize]) -> Vec<Option<usize>> {
        let mut basis = Echelon::new(self.field, columns);
        let mut degrees = vec![None; required.len()];
        for (order, rows) in self.by_order.iter().enumerate() {
            for row in set.iter().flat_map(|&c| &rows[c]) {
                basis.insert(row);
            }
            for (degree, &c) in degrees.iter_mut().zip(required) {
                if degree.is_none() && basis.has_unit(c) {
                    *degree = Some(order);
                }
            }
        }
        degrees
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
