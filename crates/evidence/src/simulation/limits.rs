//! Limits of a run.

/// Most unknowns of a run: the covariance is a full matrix.
pub(crate) const MAX_UNKNOWNS: usize = 300;
/// Most steps of a run.
pub(crate) const MAX_STEPS: usize = 1_000_000;
/// Most steps of rotating segments: each has a model of its own.
pub(crate) const MAX_TURNING_STEPS: usize = 100_000;
/// Most numbers of a series: steps times unknowns.
pub(crate) const MAX_NUMBERS: usize = 20_000_000;
/// Most integration steps, of slews and rotations or of a true attitude.
pub(crate) const MAX_INTEGRATION: usize = 2_000_000;
