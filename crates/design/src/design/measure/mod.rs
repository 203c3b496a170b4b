//! What the samples of a sequence say: information, criteria, psi.

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
