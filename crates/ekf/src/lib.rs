//! Extended Kalman filter, information matrix and consistency statistics. The crate works with numbers
//! only and knows no exact verdicts, so it can confirm or refute them.
//!
//! - [`model`]: the description of a system for a filter; [`integrate`]: Runge-Kutta and exact
//!   discretisation;
//! - [`filter`]: the extended and the iterated Kalman filter; [`manifold`]: states that are no vectors;
//!   [`smoother`]: estimates from all data of an interval; [`covariance`]: Joseph's and the UD form;
//! - [`linear`]: linear models in stages, whose covariance is computed once for many runs;
//! - [`information`]: the square root of the information matrix of a batch;
//! - [`noise`]: random walks and bias instability of sensors; [`allan`]: the Allan deviation;
//!   [`allan_fit`]: noise coefficients from it;
//! - [`consistency`]: NEES, NIS, whiteness and their bands; [`decomposition`]: singular values.

pub mod allan;
pub mod allan_fit;
pub mod consistency;
pub mod covariance;
pub mod decomposition;
pub mod error;
pub mod filter;
pub mod information;
pub mod integrate;
pub mod linear;
pub mod manifold;
pub mod model;
pub mod noise;
pub mod smoother;
pub mod transition;

pub use covariance::{Covariance, CovarianceForm, Gain, ProcessNoise, ScalarOutput};
pub use error::EkfError;
pub use filter::{Filter, Innovation, Update};
pub use information::SquareRootInformation;
pub use linear::{Gains, Stage};
pub use manifold::Manifold;
pub use model::{Measurement, Motion, Process};
pub use noise::{BiasState, SensorNoise};
pub use smoother::{FixedInterval, Smoothed};
pub use transition::Transition;

/// The examples of the README, as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
