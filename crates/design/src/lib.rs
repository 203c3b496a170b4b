//! The search for torquing schemes, and all that a review of them needs.

pub mod design;
pub mod review;
