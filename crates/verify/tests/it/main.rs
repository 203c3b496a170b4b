//! Certificates of random schemes and published models and the changes of them, held against both checkers.

mod models;
mod python;
mod schemes;
