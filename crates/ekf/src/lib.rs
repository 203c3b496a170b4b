//! The extended Kalman filter, the information matrix and consistency statistics. Numbers only: nothing here
//! knows of exact verdicts, which is why it can confirm or refute them.
//!
//! - [`model`]: what a system is to a filter; [`integrate`]: Runge-Kutta and exact discretisation;
//! - [`filter`]: the extended Kalman filter; [`covariance`]: Joseph's and the UD form;
//! - [`linear`]: linear models in stages, whose covariance is computed once for many runs;
//! - [`information`]: the square root of the information matrix of a batch;
//! - [`noise`]: random walks and bias instability of sensors; [`allan`]: the Allan deviation;
//! - [`consistency`]: NEES, NIS, whiteness and their bands; [`decomposition`]: singular values.

pub mod allan;
pub mod consistency;
pub mod covariance;
pub mod decomposition;
pub mod error;
pub mod filter;
pub mod information;
pub mod integrate;
pub mod linear;
pub mod model;
pub mod noise;
pub mod transition;

pub use covariance::{Covariance, Form, Gain, ProcessNoise, ScalarOutput};
pub use error::EkfError;
pub use filter::{Filter, Innovation};
pub use information::SquareRootInformation;
pub use linear::{Gains, Stage};
pub use model::{Measurement, Process};
pub use noise::{BiasState, SensorNoise};
pub use transition::Transition;
