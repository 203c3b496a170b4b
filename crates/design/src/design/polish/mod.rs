//! Polishing of a found sequence: angles and dwells.

pub(crate) mod divide;
pub(crate) mod refine;
pub(crate) mod rounding;
