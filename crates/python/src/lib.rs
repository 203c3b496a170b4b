//! The extension module of the Python package `obsdeg`. Its tests are those of the package, in Python: a test
//! program of this crate would have to be linked with an interpreter.

#[cfg(not(test))]
mod module;
