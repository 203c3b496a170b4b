//! Calibration: what a scheme determines, estimated from the record of its run, with how far that can be trusted.
//!
//! A record ([`record`]) is taken together into bins ([`bins`]) and laid beside the timeline of its scheme ([`platform`]); the estimate is that of least
//! squares without a prior ([`least_squares`]), of what the exact verdict calls determined; a filter is the second path to it.

pub mod answer;
pub mod bins;
pub mod least_squares;
pub mod platform;
pub mod record;
mod setup;
pub mod still;
pub mod system;

/// How far a calibration is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Going<'a> {
    /// So many samples of a record are read.
    Reads {
        /// The record.
        record: &'a str,
        /// The samples.
        samples: usize,
    },
    /// So many linearisations of all runs, or evaluations of a model, were made.
    Passes(usize),
}

pub use answer::{Before, Calibration};
pub use platform::{CalibrationError, Options, calibrate};
pub use setup::{Basis, Setup};
pub use system::{SystemCalibration, SystemCalibrationError, SystemOptions, calibrate_system};
