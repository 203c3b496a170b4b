//! Request of a design: options, candidates, limits, errors.

pub(crate) mod candidates;
pub(crate) mod error;
pub(crate) mod limits;
pub(crate) mod options;
