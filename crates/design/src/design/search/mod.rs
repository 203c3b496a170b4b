//! Searches: all sequences, or an exchange; what they keep.

pub(crate) mod best;
pub(crate) mod constraints;
pub(crate) mod exchange;
pub(crate) mod exhaust;
pub(crate) mod progress;
pub(crate) mod score;
pub(crate) mod scoring;
pub(crate) mod screen;
pub(crate) mod ties;
