//! Evidence for exact verdicts: a filter on the same scheme or system, compared with them.
//!
//! ```
//! use obsdeg_core::model::{Angle, Scheme};
//! use obsdeg_evidence::simulation::{Conditions, simulate};
//!
//! let positions = [[0, 0, 0], [180, 0, 0]].map(|p| p.map(Angle::from_degrees));
//! let scheme = Scheme::of_angles(positions);
//! let (run, _traces) = simulate(&scheme, &Conditions::default(), 1)?;
//! let d_fx = run.quantities.iter().find(|e| e.name == "D_FX").expect("an unknown of every scheme");
//! assert!(d_fx.error.abs() < 4.0 * d_fx.sigma);
//! # Ok::<(), obsdeg_evidence::simulation::SimulationError>(())
//! ```
//!
//! A scheme and the conditions of a run ([`simulation`]) become a timeline and a linear model in SI units.
//! The exact verdicts, as numbers ([`prediction`]), are compared with the information of all samples, slopes
//! over the dwell and Monte Carlo runs ([`crosscheck`]); those of any other system likewise ([`system`]).
//! [`requirements`] decides on sigmas for all commands, [`acceptance`] on estimates within limits,
//! [`compare`] sets schemes side by side, and [`audit`] checks the paper, equation by equation.

pub mod acceptance;
pub mod audit;
pub mod compare;
pub mod crosscheck;
pub mod prediction;
pub mod requirements;
pub mod simulation;
pub mod system;
