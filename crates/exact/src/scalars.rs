//! The fields in which ranks are decided, and the spaces of rows over them.

use std::fmt::Debug;

use crate::{Echelon, Field, RankMargin, Ratio};

/// Field whose elements a series or a row space contains.
pub trait Scalars: Clone + Debug {
    /// Element of the field.
    type Element: Copy + Debug + PartialEq;
    /// Sum of products before reduction.
    type Sum: Copy + Debug;
    /// Row spaces over the field.
    type Space: RowSpace<Field = Self, Element = Self::Element>;

    /// 0.
    fn zero(&self) -> Self::Element;
    /// 1.
    fn one(&self) -> Self::Element;
    /// The image of an integer.
    fn integer(&self, x: i64) -> Self::Element;
    /// True if an element cannot be distinguished from zero.
    fn is_zero(&self, a: &Self::Element) -> bool;
    /// `a + b`.
    fn add(&self, a: &Self::Element, b: &Self::Element) -> Self::Element;
    /// `a - b`.
    fn sub(&self, a: &Self::Element, b: &Self::Element) -> Self::Element;
    /// `-a`.
    fn neg(&self, a: &Self::Element) -> Self::Element;
    /// `a b`.
    fn mul(&self, a: &Self::Element, b: &Self::Element) -> Self::Element;
    /// `1 / a`; `None` for an element that cannot be distinguished from zero.
    fn inverse(&self, a: &Self::Element) -> Option<Self::Element>;
    /// `start + sum a_i b_i`.
    fn dot<'a>(
        &self,
        start: &Self::Element,
        terms: impl Iterator<Item = (&'a Self::Element, &'a Self::Element)>,
    ) -> Self::Element
    where
        Self::Element: 'a;
    /// The empty sum.
    fn no_sum(&self) -> Self::Sum;
    /// Adds `factor row_i` to `sums[components[i]]`; `pending` counts products since the sums were settled.
    fn gather(
        &self,
        sums: &mut [Self::Sum],
        pending: &mut usize,
        factor: &Self::Element,
        components: &[u32],
        row: &[Self::Element],
    );
    /// The value of a sum.
    fn reduce(&self, sum: &Self::Sum) -> Self::Element;
    /// The element as a small rational number `(numerator, denominator)`; `None` if it is none.
    fn rational(&self, a: &Self::Element) -> Option<(i64, i64)>;
}

/// The span of rows that come one by one.
pub trait RowSpace: Clone + Debug {
    /// The field.
    type Field: Scalars<Element = Self::Element>;
    /// Element of the field.
    type Element: Copy;

    /// The zero space of rows of length `columns`.
    fn new(field: Self::Field, columns: usize) -> Self;
    /// Back to the zero space.
    fn clear(&mut self);
    /// The length of a row.
    fn columns(&self) -> usize;
    /// The dimension.
    fn rank(&self) -> usize;
    /// Adds a row; true if the rank grew.
    fn insert(&mut self, row: &[Self::Element]) -> bool;
    /// True if a row lies in the space.
    fn contains(&self, row: &[Self::Element]) -> bool;
    /// True if the unit vector of a column lies in the space.
    fn has_unit(&self, column: usize) -> bool;
    /// True if a column is zero in every row.
    fn is_zero_column(&self, column: usize) -> bool;
    /// Row i of a reduced basis.
    fn row(&self, i: usize) -> &[Self::Element];
    /// The pivot columns, in the order of the rows.
    fn pivot_columns(&self) -> Vec<usize>;
    /// A basis of the null space: one vector for each column that is no pivot, with a one there.
    fn null_space(&self) -> Vec<Vec<Self::Element>>;
    /// Per column the others that share a null vector of minimal support with it
    /// ([`Echelon::companions`]).
    fn companions(&self) -> Vec<Vec<usize>>;
    /// Margin of the decisions; exact fields have none.
    fn gap(&self) -> RankMargin {
        RankMargin::OPEN
    }
    /// Number of products so far beyond those of an elimination, for rows recomputed because of wide
    /// errors.
    fn refined(&self) -> u64 {
        0
    }
}

impl Scalars for Field {
    type Element = u64;
    type Sum = u128;
    type Space = Echelon;

    #[inline]
    fn zero(&self) -> u64 {
        0
    }
    #[inline]
    fn one(&self) -> u64 {
        Field::one(self)
    }
    #[inline]
    fn integer(&self, x: i64) -> u64 {
        self.from_i64(x)
    }
    #[inline]
    fn is_zero(&self, a: &u64) -> bool {
        *a == 0
    }
    #[inline]
    fn add(&self, a: &u64, b: &u64) -> u64 {
        Field::add(self, *a, *b)
    }
    #[inline]
    fn sub(&self, a: &u64, b: &u64) -> u64 {
        Field::sub(self, *a, *b)
    }
    #[inline]
    fn neg(&self, a: &u64) -> u64 {
        Field::neg(self, *a)
    }
    #[inline]
    fn mul(&self, a: &u64, b: &u64) -> u64 {
        Field::mul(self, *a, *b)
    }
    #[inline]
    fn inverse(&self, a: &u64) -> Option<u64> {
        (*a != 0).then(|| self.inv(*a))
    }
    #[inline]
    fn dot<'a>(&self, start: &u64, terms: impl Iterator<Item = (&'a u64, &'a u64)>) -> u64 {
        Field::dot(self, *start, terms.map(|(&a, &b)| (a, b)))
    }
    #[inline]
    fn no_sum(&self) -> u128 {
        0
    }
    #[inline]
    fn gather(&self, sums: &mut [u128], pending: &mut usize, factor: &u64, components: &[u32], row: &[u64]) {
        if *pending == Self::LAZY {
            sums.iter_mut().for_each(|s| *s = self.settle(*s));
            *pending = 0;
        }
        *pending += 1;
        if components.len() == sums.len() {
            for (s, &x) in sums.iter_mut().zip(row) {
                *s += self.lazy(*factor, x);
            }
            return;
        }
        for (&component, &x) in components.iter().zip(row) {
            sums[component as usize] += self.lazy(*factor, x);
        }
    }
    #[inline]
    fn reduce(&self, sum: &u128) -> u64 {
        if *sum == 0 { 0 } else { Field::reduce(self, *sum) }
    }
    #[inline]
    fn rational(&self, a: &u64) -> Option<(i64, i64)> {
        Ratio::recover(self, *a).map(|r| (r.num, r.den))
    }
}

impl RowSpace for Echelon {
    type Field = Field;
    type Element = u64;

    fn new(field: Field, columns: usize) -> Self {
        Self::new(field, columns)
    }
    fn clear(&mut self) {
        Self::clear(self);
    }
    fn columns(&self) -> usize {
        Self::columns(self)
    }
    fn rank(&self) -> usize {
        Self::rank(self)
    }
    fn insert(&mut self, row: &[u64]) -> bool {
        Self::insert(self, row)
    }
    fn contains(&self, row: &[u64]) -> bool {
        Self::contains(self, row)
    }
    fn has_unit(&self, column: usize) -> bool {
        Self::has_unit(self, column)
    }
    fn is_zero_column(&self, column: usize) -> bool {
        Self::is_zero_column(self, column)
    }
    fn row(&self, i: usize) -> &[u64] {
        Self::row(self, i)
    }
    fn pivot_columns(&self) -> Vec<usize> {
        self.pivots().collect()
    }
    fn null_space(&self) -> Vec<Vec<u64>> {
        Self::null_space(self)
    }
    fn companions(&self) -> Vec<Vec<usize>> {
        Self::companions(self)
    }
}
