//! The one interface between a model and the filtration.

use obsdeg_exact::Scalars;

/// An element of a field.
type RowElement<F> = <F as Scalars>::Element;

/// Source of derivative rows: the differentials of `Z_i^(k)` with respect to the unknowns, at one point of
/// one field.
pub trait DerivativeRows {
    /// Field of the entries: a prime field, or real numbers of many digits.
    type Field: Scalars;

    /// The field of the rows.
    fn field(&self) -> Self::Field;

    /// Number of unknowns, the length of a row.
    fn columns(&self) -> usize;

    /// Passes every row of order `order` to `sink`, which returns true if the row raised the rank. Returns
    /// false if no segment has rows of this or a higher order that could add anything: the chain of each
    /// segment has ended.
    #[expect(clippy::type_complexity, reason = "a function of a row, which would be no plainer under a name")]
    fn emit(&mut self, order: usize, sink: &mut dyn FnMut(&[RowElement<Self::Field>]) -> bool) -> bool;
}
