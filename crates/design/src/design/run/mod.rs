//! A search from request to answer.

pub(crate) mod alternatives;
pub(crate) mod certify;
pub(crate) mod driver;
pub(crate) mod free;
pub(crate) mod inputs;
pub(crate) mod merged;
#[cfg(test)]
mod omitted_tests;
pub(crate) mod optimum;
pub(crate) mod part;
pub(crate) mod part_check;
pub(crate) mod prepared;
pub(crate) mod task;
pub(crate) mod trade;
pub(crate) mod winner;
