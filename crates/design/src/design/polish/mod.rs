//! What makes a found sequence better: angles, dwells.

pub(crate) mod divide;
pub(crate) mod refine;
pub(crate) mod rounding;
