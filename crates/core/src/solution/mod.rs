//! How an observable quantity is solved from the derivatives of Z.

pub mod local;
pub mod problem;
pub mod support;
