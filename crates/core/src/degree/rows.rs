//! The one interface between a model and the staircase.

use obsdeg_exact::Field;

/// A source of derivative rows: the differentials of `Z_i^(k)` with respect to the unknowns, at one
/// random point of one prime field.
pub trait DerivativeRows {
    /// The field of the rows.
    fn field(&self) -> Field;

    /// The number of unknowns: the length of a row.
    fn columns(&self) -> usize;

    /// Hands every row of order `order` to `sink`, which says whether it raised the rank. False when no segment has
    /// rows of this or a higher order that could add anything: each segment's own chain has stalled.
    fn emit(&mut self, order: usize, sink: &mut dyn FnMut(&[u64]) -> bool) -> bool;
}
