//! Searches: exhaustive or by exchange, with their results.

pub(crate) mod best;
pub(crate) mod constraints;
pub(crate) mod exchange;
pub(crate) mod exhaust;
pub(crate) mod progress;
pub(crate) mod score;
pub(crate) mod scoring;
pub(crate) mod screen;
pub(crate) mod ties;
