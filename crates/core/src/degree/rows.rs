//! The one interface between a model and the staircase.

use obsdeg_exact::Scalars;

/// An element of a field.
type Element<F> = <F as Scalars>::Element;

/// A source of derivative rows: the differentials of `Z_i^(k)` with respect to the unknowns, at one point
/// over one field.
pub trait DerivativeRows {
    /// What the rows are made of: a prime field, or real numbers of many digits.
    type Field: Scalars;

    /// The field of the rows.
    fn field(&self) -> Self::Field;

    /// The number of unknowns: the length of a row.
    fn columns(&self) -> usize;

    /// Hands every row of order `order` to `sink`, which says whether it raised the rank. False when no
    /// segment has rows of this or a higher order that could add anything: each segment's own chain has
    /// ended.
    #[expect(clippy::type_complexity, reason = "a function of a row, which would be no plainer under a name")]
    fn emit(&mut self, order: usize, sink: &mut dyn FnMut(&[Element<Self::Field>]) -> bool) -> bool;
}
