//! Calibration: estimates of a scheme's unknowns from the records of its runs, with their reliability.
//!
//! The samples of a record ([`record`]) form bins ([`bins`]), which are placed on the timeline of its scheme
//! ([`platform`]). The estimate is that of least squares without a prior ([`least_squares`]), of the unknowns
//! that the exact verdict calls determined. A filter checks it as a second path.
//!
//! Calibration of any other system from a record: x decays, and is measured.
//!
//! ```
//! use obsdeg_calibration::record::Record;
//! use obsdeg_calibration::{SystemCalibrationOptions, calibrate_system};
//! use obsdeg_core::system::model_file;
//!
//! let model = "name = 'decay'\nstates = { x = '-p*x' }\nparameters = ['p']\noutputs = { z = 'x' }\n\
//!     [simulation]\nvalues = { x = 1, p = 1 }\nnoise = { z = 0.001 }";
//! let times = (0..20).map(|k| 0.1 * f64::from(k));
//! let rows: String = times.map(|t| format!("{t},{}\n", 2.0 * (-0.5 * t).exp())).collect();
//! let record = Record::csv("decay.csv", Box::new(std::io::Cursor::new(format!("t,z\n{rows}"))))?;
//! let model = model_file::read(model)?;
//! let options = SystemCalibrationOptions { starts: 4, profiles: vec![], prior: None, seed: 1 };
//! let found = calibrate_system(&model, record, &options, &|_| true)?;
//! let p = found.quantities.iter().find(|u| u.name == "p").and_then(|u| u.estimate);
//! assert!((p.expect("it is determined") - 0.5).abs() < 1e-4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod answer;
pub mod bins;
mod compared;
mod csv_lines;
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

/// Progress of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CalibrationProgress<'a> {
    /// Samples of a record that were read.
    Reads {
        /// Name of the record.
        record: &'a str,
        /// Number of samples so far.
        samples: usize,
    },
    /// Number of linearisations of all runs, or of evaluations of a model, so far.
    Passes(usize),
}

pub use answer::{Before, Calibration};
pub use compared::{CalibrationChange, ChangeTest, CoefficientChange, compared};
pub use platform::{CalibrationError, Options, calibrate};
pub use setup::{Setup, SetupPosition, SourceRecord};
pub use system::{SystemCalibration, SystemCalibrationError, SystemCalibrationOptions, calibrate_system};
