//! Search for torquing schemes and for outputs of models, and design reviews.
//!
//! ```
//! use obsdeg_core::model::Scheme;
//! use obsdeg_design::design::{DesignOptions, design};
//! use obsdeg_evidence::simulation::Conditions;
//!
//! let required = vec!["D_F".into()];
//! let options = DesignOptions { positions: Some(3), required, ..DesignOptions::default() };
//! let found = design(&Scheme::default(), &Conditions::default(), &options, &|_| true)?;
//! assert!(found.found.iter().all(|s| s.positions.len() == 3));
//! # Ok::<(), obsdeg_design::design::DesignError>(())
//! ```
//!
//! [`design`] chooses positions from candidates: sets are judged exactly, sequences ranked by the information
//! of their samples. [`next`] chooses further positions of a scheme, [`sensors`] outputs of a model.
//! [`procedure`] is the sheet by which a scheme is run.
//! [`review`] gathers verdicts, a run, evidence, sweeps and alternatives for a report.

mod degree_caps;
pub mod design;
pub mod next;
pub mod procedure;
pub mod review;
pub mod sensors;

pub use degree_caps::DegreeCap;
