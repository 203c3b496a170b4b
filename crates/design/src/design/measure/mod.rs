//! Information of the samples of a sequence: criteria, psi, errors that are not estimated.

pub(crate) mod beside;
pub(crate) mod carry;
pub(crate) mod correlated;
pub(crate) mod criterion;
pub(crate) mod elimination;
pub(crate) mod evaluator;
pub(crate) mod extend;
pub(crate) mod noise_process;
pub(crate) mod omitted;
pub(crate) mod psi;
pub(crate) mod setup;
pub(crate) mod slew_path;
pub(crate) mod slews;
pub(crate) mod stop;
