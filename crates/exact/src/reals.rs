//! Real numbers of `64 N` bits as a field, and row spaces over them.
//!
//! The error bound of a ball proves that a number is not zero. No computation proves that a number is
//! zero: it counts as zero if its ball contains zero and is narrow, and the [`RankMargin`] is the margin
//! between the two kinds. If the margin is small nothing is decided, and the caller takes more digits.

use std::cell::Cell;

use crate::{Ball, BallSum, RankMargin, RowSpace, Scalars, interrupt};

/// Largest numerator and denominator that [`Scalars::rational`] accepts.
const SMALL: i64 = 1 << 20;

/// The field of real numbers of `64 N` bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reals<const N: usize>;

impl<const N: usize> Scalars for Reals<N> {
    type Element = Ball<N>;
    type Sum = BallSum<N>;
    type Space = RealSpace<N>;

    fn zero(&self) -> Ball<N> {
        Ball::ZERO
    }
    fn one(&self) -> Ball<N> {
        Ball::from_i64(1)
    }
    fn integer(&self, x: i64) -> Ball<N> {
        Ball::from_i64(x)
    }
    fn is_zero(&self, a: &Ball<N>) -> bool {
        a.is_zero()
    }
    fn add(&self, a: &Ball<N>, b: &Ball<N>) -> Ball<N> {
        a.add(b)
    }
    fn sub(&self, a: &Ball<N>, b: &Ball<N>) -> Ball<N> {
        a.sub(b)
    }
    fn neg(&self, a: &Ball<N>) -> Ball<N> {
        a.neg()
    }
    fn mul(&self, a: &Ball<N>, b: &Ball<N>) -> Ball<N> {
        a.mul(b)
    }
    fn inverse(&self, a: &Ball<N>) -> Option<Ball<N>> {
        a.inverse()
    }
    fn dot<'a>(&self, start: &Ball<N>, terms: impl Iterator<Item = (&'a Ball<N>, &'a Ball<N>)>) -> Ball<N> {
        let mut sum = BallSum::NONE;
        sum.add(start);
        terms.for_each(|(a, b)| sum.add_product(a, b));
        sum.ball()
    }
    fn no_sum(&self) -> BallSum<N> {
        BallSum::NONE
    }
    fn gather(
        &self,
        sums: &mut [BallSum<N>],
        _: &mut usize,
        factor: &Ball<N>,
        components: &[u32],
        row: &[Ball<N>],
    ) {
        for (&component, x) in components.iter().zip(row) {
            sums[component as usize].add_product(factor, x);
        }
    }
    fn reduce(&self, sum: &BallSum<N>) -> Ball<N> {
        sum.ball()
    }
    fn rational(&self, a: &Ball<N>) -> Option<(i64, i64)> {
        // its continued fraction, as long as the numbers stay small
        let (mut before, mut now) = ((0i64, 1i64), (1i64, 0i64));
        let mut rest = *a;
        for _ in 0..40 {
            let whole = rest.nearest_integer().filter(|w| w.abs() <= SMALL)?;
            let next = (whole * now.0 + before.0, whole * now.1 + before.1);
            if next.0.abs() > SMALL || next.1.abs() > SMALL {
                return None;
            }
            (before, now) = (now, next);
            let off = a.mul(&Ball::from_i64(now.1)).sub(&Ball::from_i64(now.0));
            if off.is_zero() {
                let narrow = off.radius_log2() <= -(Ball::<N>::BITS as f64) / 2.0;
                return narrow.then(|| if now.1 < 0 { (-now.0, -now.1) } else { now });
            }
            rest = rest.sub(&Ball::from_i64(whole)).inverse()?;
        }
        None
    }
}

/// Row space over the reals in reduced row-echelon form, with a one at every pivot.
///
/// Elimination with rows that were eliminated before multiplies their errors by every small pivot. So
/// the given rows are kept, with the weights (numbers without errors of their own) that make the
/// reduced rows of them, approximately. A new row is first reduced by the given rows, whose errors are
/// those of the input; the small residues at the pivots are reduced by the reduced rows. When these
/// have become wide they are recomputed from the given rows: if `F = T G` is the identity at the pivots
/// up to a matrix of norm d, the reduced rows differ from F by `2 d max |F|` at most (the a posteriori
/// bound of Rump 2010, doi:10.1017/S096249291000005X). Bits are then lost once for the condition of the
/// rows, not once for each pivot.
///
/// ```
/// use obsdeg_exact::{Ball, RealSpace, Reals, RowSpace};
/// let x = Ball::<4>::from_i64(2).sqrt().expect("positive");
/// let one = Ball::from_i64(1);
/// let mut v = RealSpace::new(Reals, 2);
/// assert!(v.insert(&[x, one]));
/// // sqrt 2 (sqrt 2, 1) = (2, sqrt 2)
/// assert!(!v.insert(&[Ball::from_i64(2), x]));
/// assert!(v.gap().is_decisive(256) && v.rank() == 1);
/// ```
#[derive(Debug, Clone)]
pub struct RealSpace<const N: usize> {
    columns: usize,
    rows: Vec<Vec<Ball<N>>>,
    /// The independent rows as they were given.
    given: Vec<Vec<Ball<N>>>,
    /// Weights that make the reduced rows of the given ones, approximately: numbers without errors.
    weights: Vec<Vec<Ball<N>>>,
    pivots: Vec<usize>,
    row_of: Vec<Option<usize>>,
    gap: Cell<RankMargin>,
    /// Number of products that [`refine`](Self::refine) took.
    refined: u64,
}

impl<const N: usize> RealSpace<N> {
    /// The largest exponent of a row; for a row without digits, 0.
    fn scale(row: &[Ball<N>]) -> f64 {
        let largest = row.iter().map(Ball::size_log2).fold(f64::NEG_INFINITY, f64::max);
        if largest == f64::NEG_INFINITY { 0.0 } else { largest }
    }

    /// True if an entry counts as different from zero, in a row of this scale; the gap records the
    /// decision.
    fn differs(&self, entry: &Ball<N>, scale: f64) -> bool {
        if entry.is_exactly_zero() {
            return false;
        }
        let gap = self.gap.get();
        let zero = entry.is_zero();
        self.gap.set(if zero {
            RankMargin { zero: gap.zero.max(entry.radius_log2() - scale), ..gap }
        } else {
            RankMargin { nonzero: gap.nonzero.min(entry.size_log2() - scale), ..gap }
        });
        !zero
    }

    /// The residue of a row after reduction by the basis, and the weights of the given rows in it.
    fn reduced(&self, row: &[Ball<N>]) -> (Vec<Ball<N>>, Vec<Ball<N>>) {
        interrupt::check();
        let factors = self.pivots.iter().map(|&p| row[p].midpoint().neg());
        let taken = combined(factors, &self.weights, self.weights.len());
        let taken: Vec<Ball<N>> = taken.iter().map(|x| x.ball().midpoint()).collect();
        let mut sums = combined(taken.iter().copied(), &self.given, self.columns);
        sums.iter_mut().zip(row).for_each(|(sum, x)| sum.add(x));
        let left: Vec<Ball<N>> = self.pivots.iter().map(|&p| sums[p].ball().neg()).collect();
        for (factor, basis) in left.iter().zip(&self.rows) {
            add_multiple(&mut sums, factor, basis);
        }
        let scale = Self::scale(row);
        let of = |(c, sum): (usize, &BallSum<N>)| {
            let x = if self.row_of[c].is_some() { Ball::ZERO } else { sum.ball() };
            if self.differs(&x, scale) { x } else { Ball::ZERO }
        };
        (sums.iter().enumerate().map(of).collect(), taken)
    }

    /// True if an entry of a reduced row is too uncertain to be judged.
    fn is_wide(&self) -> bool {
        let narrow = -0.75 * Ball::<N>::BITS as f64;
        let wide = |row: &Vec<Ball<N>>| row.iter().any(|x| x.radius_log2() - Self::scale(row) > narrow);
        self.rows.iter().any(wide)
    }

    /// Recomputes the reduced rows from the given ones.
    fn refine(&mut self) {
        let products = self.rows.len() * self.rows.len() * self.columns;
        self.refined = self.refined.saturating_add(products as u64);
        let made = |weights: &Vec<Ball<N>>| {
            let sums = combined(weights.iter().copied(), &self.given, self.columns);
            sums.iter().map(BallSum::ball).collect::<Vec<_>>()
        };
        let mut made: Vec<Vec<Ball<N>>> = self.weights.iter().map(made).collect();
        let one = Ball::from_i64(1);
        // log2 of the sum of the differences from the identity, for each row
        let off = |(i, row): (usize, &Vec<Ball<N>>)| {
            let of = |(j, &p): (usize, &usize)| if i == j { row[p].sub(&one) } else { row[p] }.bound_log2();
            let largest = self.pivots.iter().enumerate().map(of).fold(f64::NEG_INFINITY, f64::max);
            largest + (self.pivots.len() as f64).log2()
        };
        let off: Vec<f64> = made.iter().enumerate().map(off).collect();
        if off.iter().any(|off| *off > -2.0) {
            return;
        }
        for c in 0..self.columns {
            let size = made.iter().map(|row| row[c].bound_log2()).fold(f64::NEG_INFINITY, f64::max);
            for (row, off) in made.iter_mut().zip(&off) {
                row[c] = row[c].widened(off + 1.0 + size);
            }
        }
        for (i, &p) in self.pivots.iter().enumerate() {
            made.iter_mut().for_each(|row| row[p] = Ball::ZERO);
            made[i][p] = one;
        }
        self.rows = made;
    }
}

/// `sum factor_i rows_i`.
fn combined<const N: usize>(
    factors: impl Iterator<Item = Ball<N>>,
    rows: &[Vec<Ball<N>>],
    columns: usize,
) -> Vec<BallSum<N>> {
    let mut sums = vec![BallSum::NONE; columns];
    factors.zip(rows).for_each(|(factor, row)| add_multiple(&mut sums, &factor, row));
    sums
}

fn add_multiple<const N: usize>(sums: &mut [BallSum<N>], factor: &Ball<N>, row: &[Ball<N>]) {
    if !factor.is_exactly_zero() {
        sums.iter_mut().zip(row).for_each(|(sum, x)| sum.add_product(factor, x));
    }
}

/// Adds `factor basis` to `row`.
fn eliminate<const N: usize>(row: &mut [Ball<N>], basis: &[Ball<N>], factor: &Ball<N>) {
    for (x, b) in row.iter_mut().zip(basis).filter(|(_, b)| !b.is_exactly_zero()) {
        *x = x.add(&factor.mul(b));
    }
}

impl<const N: usize> RowSpace for RealSpace<N> {
    type Field = Reals<N>;
    type Element = Ball<N>;

    fn new(_: Reals<N>, columns: usize) -> Self {
        Self {
            columns,
            rows: Vec::new(),
            given: Vec::new(),
            weights: Vec::new(),
            pivots: Vec::new(),
            row_of: vec![None; columns],
            gap: Cell::new(RankMargin::OPEN),
            refined: 0,
        }
    }

    fn clear(&mut self) {
        self.rows.clear();
        self.given.clear();
        self.weights.clear();
        self.pivots.clear();
        self.row_of.fill(None);
    }

    fn columns(&self) -> usize {
        self.columns
    }

    fn rank(&self) -> usize {
        self.rows.len()
    }

    fn insert(&mut self, row: &[Ball<N>]) -> bool {
        let (mut new, mut weights) = self.reduced(row);
        let size = |x: &Ball<N>| if x.is_zero() { f64::NEG_INFINITY } else { x.size_log2() };
        let pivot = (0..self.columns).filter(|&c| !new[c].is_zero()).max_by(|&a, &b| {
            // the first of the largest
            size(&new[a]).total_cmp(&size(&new[b])).then(b.cmp(&a))
        });
        let Some((pivot, inverse)) = pivot.and_then(|p| Some((p, new[p].inverse()?))) else { return false };
        for x in new.iter_mut().filter(|x| !x.is_exactly_zero()) {
            *x = x.mul(&inverse);
        }
        new[pivot] = Ball::from_i64(1);
        weights.push(Ball::from_i64(1));
        weights.iter_mut().for_each(|x| *x = x.mul(&inverse).midpoint());
        let mut changed = Vec::new();
        for (i, (basis, made)) in self.rows.iter_mut().zip(&mut self.weights).enumerate() {
            made.push(Ball::ZERO);
            let factor = basis[pivot].neg();
            if factor.is_exactly_zero() {
                continue;
            }
            eliminate(basis, &new, &factor);
            basis[pivot] = Ball::ZERO;
            eliminate(made, &weights, &factor.midpoint());
            made.iter_mut().for_each(|x| *x = x.midpoint());
            changed.push(i);
        }
        self.row_of[pivot] = Some(self.rows.len());
        self.pivots.push(pivot);
        self.rows.push(new);
        self.given.push(row.to_vec());
        self.weights.push(weights);
        if self.is_wide() {
            self.refine();
            changed = (0..self.rows.len()).collect();
        }
        let mut rows = std::mem::take(&mut self.rows);
        for i in changed {
            let scale = Self::scale(&rows[i]);
            for x in &mut rows[i] {
                if !self.differs(x, scale) {
                    *x = Ball::ZERO;
                }
            }
        }
        self.rows = rows;
        true
    }

    fn contains(&self, row: &[Ball<N>]) -> bool {
        self.reduced(row).0.iter().all(Ball::is_zero)
    }

    fn has_unit(&self, column: usize) -> bool {
        let row = self.row_of[column].and_then(|i| self.rows.get(i));
        row.is_some_and(|row| row.iter().enumerate().all(|(c, x)| c == column || x.is_exactly_zero()))
    }

    fn is_zero_column(&self, column: usize) -> bool {
        self.rows.iter().all(|row| row[column].is_exactly_zero())
    }

    fn row(&self, i: usize) -> &[Ball<N>] {
        &self.rows[i]
    }

    fn pivot_columns(&self) -> Vec<usize> {
        self.pivots.clone()
    }

    fn null_space(&self) -> Vec<Vec<Ball<N>>> {
        let free = (0..self.columns).filter(|&c| self.row_of[c].is_none());
        free.map(|free| {
            let mut v = vec![Ball::ZERO; self.columns];
            v[free] = Ball::from_i64(1);
            for (row, &pivot) in self.rows.iter().zip(&self.pivots) {
                v[pivot] = row[free].neg();
            }
            v
        })
        .collect()
    }

    fn gap(&self) -> RankMargin {
        self.gap.get()
    }

    fn refined(&self) -> u64 {
        self.refined
    }

    fn companions(&self) -> Vec<Vec<usize>> {
        let patterns =
            self.rows.iter().map(|r| r.iter().map(|x| !x.is_exactly_zero()).collect::<Vec<bool>>());
        crate::echelon::components(self.columns, self.pivots.iter().copied().zip(patterns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Echelon, Field};
    use proptest::prelude::*;

    type Real = Ball<4>;

    proptest! {
        /// Over the integers both kinds of spaces give the same results.
        #[test]
        fn the_same_as_modulo_a_prime(
            rows in prop::collection::vec(prop::collection::vec(-2i64..3, 6), 1..8),
            probe in prop::collection::vec(-2i64..3, 6),
        ) {
            let f = Field::new((1 << 60) + 33);
            let mut prime = Echelon::new(f, 6);
            let mut real = RealSpace::new(Reals::<4>, 6);
            // as real numbers: with an irrational factor
            let factor = Real::from_i64(2).sqrt().expect("positive");
            for row in &rows {
                let image: Vec<u64> = row.iter().map(|&x| f.from_i64(x)).collect();
                let digits: Vec<Real> = row.iter().map(|&x| Real::from_i64(x).mul(&factor)).collect();
                prop_assert_eq!(prime.insert(&image), real.insert(&digits));
            }
            prop_assert_eq!(prime.rank(), real.rank());
            prop_assert_eq!(prime.companions(), real.companions());
            for c in 0..6 {
                prop_assert_eq!(prime.has_unit(c), real.has_unit(c));
                prop_assert_eq!(prime.is_zero_column(c), real.is_zero_column(c));
            }
            let image: Vec<u64> = probe.iter().map(|&x| f.from_i64(x)).collect();
            let digits: Vec<Real> = probe.iter().map(|&x| Real::from_i64(x)).collect();
            prop_assert_eq!(prime.contains(&image), real.contains(&digits));
            for v in real.null_space() {
                for row in &rows {
                    let digits: Vec<Real> = row.iter().map(|&x| Real::from_i64(x)).collect();
                    prop_assert!(Reals.dot(&Real::ZERO, digits.iter().zip(&v)).is_zero());
                }
                for x in &v {
                    let (p, q) = Reals.rational(x).expect("rows of small integers");
                    prop_assert!(x.sub(&Real::from_i64(p).div(&Real::from_i64(q)).expect("not zero")).is_zero());
                }
            }
            prop_assert!(real.gap().is_decisive(256), "{:?}", real.gap());
            prop_assert_eq!(real.refined(), 0);
        }
    }

    /// Rows with an error of 20 digits above their last place are recomputed, each time from all given
    /// rows. The products are counted: 2 * 2 * 4 for the second row and 3 * 3 * 4 for the third.
    #[test]
    fn rows_made_anew_are_counted() {
        let mut space = RealSpace::<4>::new(Reals, 4);
        let wide = |x: i64| Real::from_i64(x).widened(-180.0);
        space.insert(&[1, 2, 3, 4].map(Real::from_i64));
        assert_eq!(space.refined(), 0);
        space.insert(&[5, 7, 11, 13].map(wide));
        assert_eq!(space.refined(), 2 * 2 * 4);
        space.insert(&[1, 1, 2, 5].map(wide));
        assert_eq!((space.rank(), space.refined()), (3, 2 * 2 * 4 + 3 * 3 * 4));
    }

    /// Rows `(1, x, x^2, ...)` whose pivots fall to 2^-70, eliminated in 256 bits: the products of the
    /// pivots would be far below any error.
    #[test]
    fn small_pivots_do_not_add_up() {
        let n = 20;
        let power = |k: i64| {
            let x = Real::from_i64(k).add(&Real::from_i64(2).sqrt().expect("positive")).shifted(-4);
            let mut row = vec![Real::from_i64(1)];
            (1..n).for_each(|j| row.push(row[j - 1].mul(&x)));
            row
        };
        let rows: Vec<Vec<Real>> = (0..n as i64 - 1).map(power).collect();
        let mut v = RealSpace::new(Reals::<4>, n);
        for (i, row) in rows.iter().enumerate() {
            assert!(v.insert(row) && v.rank() == i + 1);
            // a dependent row
            let sum: Vec<Real> =
                (0..n).map(|c| rows[..=i].iter().fold(Real::ZERO, |s, r| s.add(&r[c]))).collect();
            assert!(v.contains(&sum));
        }
        assert!(v.gap().nonzero < -55.0 && v.gap().zero < -128.0, "{:?}", v.gap());
        // against the polynomial with these roots, orthogonal to all rows
        let null = v.null_space().remove(0);
        for row in &rows {
            let value = Reals.dot(&Real::ZERO, row.iter().zip(&null));
            assert!(value.is_zero() && value.radius_log2() < -64.0, "{value:?}");
        }
        assert!((0..n).all(|c| !v.has_unit(c)));
        assert!(v.insert(&power(40)) && (0..n).all(|c| v.has_unit(c)));
    }

    #[test]
    fn what_is_not_clear_is_not_decided() {
        let one = Real::from_i64(1);
        let rank = |small: Real| {
            let mut v = RealSpace::new(Reals::<4>, 2);
            v.insert(&[one, Real::ZERO]);
            let grew = v.insert(&[one, small]);
            (grew, v.gap().is_decisive(256))
        };
        assert_eq!(rank(one.shifted(-60)), (true, true));
        // proven not to be zero, and nothing else is small
        assert_eq!(rank(one.shifted(-200)), (true, true));
        // a quarter of the bits above the level of zeros, or less
        let gap = |nonzero: f64| RankMargin { nonzero, zero: -130.0 }.is_decisive(256);
        assert!(gap(-65.0) && !gap(-67.0));
        // contains zero: clear if it is narrow
        assert_eq!(rank(Real::ZERO.widened(-200.0)), (false, true));
        assert_eq!(rank(Real::ZERO.widened(-100.0)), (false, false));
        assert!(RankMargin { nonzero: -3.0, zero: -9.0 }.and(RankMargin::OPEN).zero == -9.0);
    }

    #[test]
    fn numbers_that_are_rational() {
        let of = |p: i64, q: i64| Real::from_i64(p).div(&Real::from_i64(q)).expect("not zero");
        for (p, q) in [(0, 1), (1, 1), (-7, 3), (355, 113), (1, 1000), (-999_983, 1_000_003)] {
            assert_eq!(Reals.rational(&of(p, q)), Some((p, q)));
        }
        assert_eq!(Reals.rational(&of(1, 3_000_017)), None);
        assert_eq!(Reals.rational(&Real::pi()), None);
        assert_eq!(Reals.rational(&of(1, 3).widened(-100.0)), None);
    }
}
