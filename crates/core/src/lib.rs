//! The exact engine of obsdeg: which unknowns a model's output determines, with how many derivatives, and by
//! which expressions.
//!
//! A torquing scheme:
//!
//! ```
//! use obsdeg_core::analysis::{AnalysisOptions, analyze};
//! use obsdeg_core::model::{Angle, Scheme};
//!
//! let positions = [[0, 0, 0], [180, 0, 0]].map(|p| p.map(Angle::from_degrees));
//! let answer = analyze(&Scheme::of_angles(positions), AnalysisOptions::default(), None)?;
//! let degree = |name| answer.quantities.iter().find(|q| q.name == name).and_then(|q| q.degree);
//! assert_eq!((answer.rank, answer.unknowns.len()), (8, 15));
//! assert_eq!((degree("D_FX"), degree("D_FZ")), (Some(1), None));
//! # Ok::<(), obsdeg_core::analysis::AnalysisError>(())
//! ```
//!
//! Any system, read from a file's text:
//!
//! ```
//! use obsdeg_core::system::{SystemOptions, analyze_system, model_file};
//!
//! let text = r#"
//! name = "decay"
//! states = { x = "-p*x" }
//! parameters = ["p"]
//! outputs = { z = "x" }
//! "#;
//! let model = model_file::read(text)?;
//! let answer = analyze_system(&model, SystemOptions::default())?;
//! assert_eq!(answer.quantities.iter().map(|q| q.degree).collect::<Vec<_>>(), [Some(0), Some(1)]);
//! # Ok::<(), obsdeg_core::system::ModelError>(())
//! ```
//!
//! Data flow: a model ([`model`], [`system`]) gives derivative rows, the rows a filtration and verdicts
//! ([`degree`]), these sparse combinations, a null space and solutions ([`solution`]), and with dwells
//! accuracy orders ([`accuracy`]). All findings form one exact value ([`findings`]); an
//! [`analysis::Analysis`] is its view in words. No module imports from one that comes after it here.

pub mod accuracy;
pub mod analysis;
pub mod certificate;
pub mod degree;
pub mod engine;
pub mod findings;
pub mod language;
pub mod model;
pub mod omitted;
pub mod remedies;
pub mod solution;
pub mod span;
pub mod system;
pub mod title_block;
pub mod why;
