//! Exact observable degrees: the unknowns that the output of a system determines, and the number of
//! derivatives that each needs.
//!
//! Every function takes a scheme or a model and returns an answer. An answer is plain data, with the same
//! content as the program's JSON. The crates behind it (`obsdeg-core`, `obsdeg-evidence`, `obsdeg-design`,
//! `obsdeg-calibration`) may change their modules from version to version; the names here stay.
//!
//! | question | function | answer |
//! | --- | --- | --- |
//! | What does a torquing scheme determine? | [`analyze`] | [`Analysis`] |
//! | What does the output of any system determine? | [`analyze_model`] | [`ModelAnalysis`] |
//! | What does a filter make of the scheme? | [`simulate`] | [`Simulation`] |
//! | Does the filter confirm the verdicts? | [`crosscheck`] | [`CrossCheck`] |
//! | Which of several schemes is better? | [`compare`] | [`Comparison`] |
//! | Which positions are best? | [`design`] | [`Design`] |
//! | What does a record say? | [`calibrate`], [`calibrate_model`] | [`Calibration`], [`ModelCalibration`] |
//! | What are F, H and S_i? | [`platform_matrices`] | [`PlatformMatrices`] |
//!
//! # The paper's two positions
//!
//! ```
//! use obsdeg::{AnalysisOptions, Angle, Scheme, analyze};
//!
//! let positions = [[0, 0, 0], [180, 0, 0]].map(|angles| angles.map(Angle::from_degrees));
//! let answer = analyze(&Scheme::of_angles(positions), AnalysisOptions::default(), None)?;
//! let degree = |name| answer.quantities.iter().find(|q| q.name == name).and_then(|q| q.degree);
//! assert_eq!((degree("psi_x"), degree("D_FX")), (Some(0), Some(1)));
//! assert_eq!((degree("D_FY"), degree("D_FZ")), (Some(2), None));
//! # Ok::<(), obsdeg::error::AnalysisError>(())
//! ```
//!
//! # Any system, from the text of a file
//!
//! ```
//! use obsdeg::{ModelOptions, analyze_model, read_model};
//!
//! let model = read_model(
//!     "name = 'decay'\nstates = { x = '-p*x' }\nparameters = ['p']\noutputs = { z = 'x' }",
//! )?;
//! let answer = analyze_model(&model, ModelOptions::default())?;
//! assert_eq!(answer.quantities.iter().map(|q| q.degree).collect::<Vec<_>>(), [Some(0), Some(1)]);
//! # Ok::<(), obsdeg::error::ModelError>(())
//! ```
//!
//! # A scheme file, one run and the evidence
//!
//! ```
//! use obsdeg::{Conditions, CrossCheckOptions, crosscheck, read_scheme, simulate};
//!
//! let scheme = read_scheme(
//!     "carry = 'inertial'\n[[position]]\nangles_deg = [0, 0, 0]\n[[position]]\nangles_deg = [180, 0, 0]",
//! )?;
//! let (run, _record) = simulate(&scheme, &Conditions::default(), 1)?;
//! assert!(run.quantities.iter().filter(|e| e.name == "D_FX").all(|e| e.error.abs() < 4.0 * e.sigma));
//!
//! let options = CrossCheckOptions { runs: 20, seed: 1, ..CrossCheckOptions::default() };
//! assert!(crosscheck(&scheme, &Conditions::default(), &options, &|_| true)?.passed);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The best three positions
//!
//! ```
//! use obsdeg::{Conditions, DesignOptions, Scheme, design};
//!
//! let required = vec!["D_F".into()];
//! let options = DesignOptions { positions: Some(3), required, ..DesignOptions::default() };
//! let found = design(&Scheme::default(), &Conditions::default(), &options, &|_| true)?;
//! assert!(found.found.iter().all(|s| s.positions.len() == 3));
//! # Ok::<(), obsdeg::error::DesignError>(())
//! ```
//!
//! # The matrices, to check an answer by hand
//!
//! `analyze` prints `D_FX = 1/2 [ wU (Z1@p1 + Z1@p2) - Z3'@p1 - Z3'@p2 ]` for the paper's positions; with
//! `Z^(k) = H F^k S_i x` at position i this row must be the unit vector of `D_FX`:
//!
//! ```
//! use obsdeg::{Angle, Scheme, earth_rates, platform_matrices};
//!
//! let positions = [[0, 0, 0], [180, 0, 0]].map(|angles| angles.map(Angle::from_degrees));
//! let [w_n, w_u] = earth_rates(28.2);
//! let m = platform_matrices(&Scheme::of_angles(positions), [w_n, w_u])?;
//! let rows = |order: u32, i: usize| &m.h * m.f.pow(order) * &m.s[i];
//! let z = |component: usize, order: u32, i: usize| rows(order, i).row(component).into_owned();
//! let d_fx = 0.5 * (w_u * (z(0, 0, 0) + z(0, 0, 1)) - z(1, 1, 0) - z(1, 1, 1));
//! for (name, entry) in m.unknowns.iter().zip(d_fx.iter()) {
//!     assert!((entry - f64::from(u8::from(name == "D_FX"))).abs() < 1e-15, "{name}");
//! }
//! # Ok::<(), obsdeg::error::MatricesError>(())
//! ```

pub use obsdeg_calibration::record::Record;
pub use obsdeg_calibration::{
    Calibration, Options as CalibrationOptions, SystemCalibration as ModelCalibration,
    SystemCalibrationOptions as ModelCalibrationOptions, calibrate, calibrate_system as calibrate_model,
};
pub use obsdeg_core::analysis::{Analysis, AnalysisOptions, analyze};
pub use obsdeg_core::model::scheme_file::read as read_scheme;
pub use obsdeg_core::model::{
    Angle, Carry, Latitude, PlatformMatrices, Position, Scheme, earth_rates, platform_matrices,
};
pub use obsdeg_core::system::model_file::read as read_model;
pub use obsdeg_core::system::{
    SystemAnalysis as ModelAnalysis, SystemModel as Model, SystemOptions as ModelOptions,
    analyze_system as analyze_model,
};
pub use obsdeg_design::design::{Design, DesignOptions, design};
pub use obsdeg_evidence::compare::{Comparison, Entry as Compared, compare};
pub use obsdeg_evidence::crosscheck::{CrossCheck, CrossCheckOptions, crosscheck};
pub use obsdeg_evidence::simulation::{Conditions, Simulation, simulate};

/// Errors of this crate's functions; each names the place, the expected and the found.
pub mod error {
    pub use obsdeg_calibration::{CalibrationError, SystemCalibrationError as ModelCalibrationError};
    pub use obsdeg_core::analysis::AnalysisError;
    pub use obsdeg_core::model::scheme_file::SchemeFileError;
    pub use obsdeg_core::model::{MatricesError, SchemeError};
    pub use obsdeg_core::system::ModelError;
    pub use obsdeg_design::design::DesignError;
    pub use obsdeg_evidence::simulation::SimulationError;
}
