//! Exact verdicts on sets and sequences of candidates.

pub(crate) mod rows;
pub(crate) mod sets;
pub(crate) mod slew_sequences;
pub(crate) mod symmetry;
