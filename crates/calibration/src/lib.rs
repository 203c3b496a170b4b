//! Calibration: what a scheme determines, estimated from the record of its run, with how far that can be
//! trusted.
//!
//! A record ([`record`]) is taken together into bins ([`bins`]) and laid beside the timeline of its scheme
//! ([`platform`]); the estimate is that of least squares without a prior ([`least_squares`]), of what the
//! exact verdict calls determined; a filter is the second path to it.
//!
//! A record of any system: x decays, and is measured.
//!
//! ```
//! use obsdeg_calibration::record::Record;
//! use obsdeg_calibration::{SystemOptions, calibrate_system};
//! use obsdeg_core::system::model_file;
//!
//! let model = "name = 'decay'\nstates = { x = '-p*x' }\nparameters = ['p']\noutputs = { z = 'x' }\n\
//!     [simulation]\nvalues = { x = 1, p = 1 }\nnoise = { z = 0.001 }";
//! let rows: String = (0..20).map(|k| 0.1 * f64::from(k)).map(|t| format!("{t},{}\n", 2.0 * (-0.5 * t).exp())).collect();
//! let record = Record::csv("decay.csv", Box::new(std::io::Cursor::new(format!("t,z\n{rows}"))))?;
//! let model = model_file::read(model)?;
//! let options = SystemOptions { starts: 4, profiles: vec![], prior: None, seed: 1 };
//! let found = calibrate_system(&model, record, &options, &|_| true)?;
//! let p = found.quantities.iter().find(|u| u.name == "p").and_then(|u| u.estimate).expect("it is determined");
//! assert!((p - 0.5).abs() < 1e-4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod answer;
pub mod bins;
pub mod least_squares;
pub mod levels;
pub mod noise;
pub mod platform;
pub mod record;
mod setup;
pub mod still;
pub mod system;
mod white;
#[cfg(feature = "parquet")]
mod zstd_pages;

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
