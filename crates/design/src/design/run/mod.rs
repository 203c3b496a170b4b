//! A search from request to answer.

pub(crate) mod alternatives;
pub(crate) mod certify;
pub(crate) mod driver;
pub(crate) mod free;
pub(crate) mod part;
pub(crate) mod prepared;
pub(crate) mod task;
pub(crate) mod winner;
