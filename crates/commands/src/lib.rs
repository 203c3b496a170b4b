//! Commands of obsdeg as functions from options and texts to answers. The command line, Python and the
//! browser call these and nothing else, so they give the same answers.
//!
//! Every command is a function with a struct of options, which can be read from a command line and from JSON
//! (names of options in snake case). Nothing here reads files or prints. [`Host`] is the only link to the
//! caller.
//!
//! ```
//! use obsdeg_commands::{Host, call};
//!
//! let asked = r#"{"angles": ["0,0,0", "180,0,0"], "carry": "inertial", "solutions": false}"#;
//! let answer = call("analyze", asked, &mut Host::silent())?;
//! assert!(answer.text()?.contains("\"rank\""));
//! # Ok::<(), obsdeg_commands::Problem>(())
//! ```

mod allan;
mod analyze;
mod arguments;
mod calibrate;
mod call;
mod compare;
mod conditions;
mod crosscheck;
mod design;
mod designed;
mod host;
mod measure;
mod next;
mod paper;
mod problem;
mod procedure;
mod report;
mod simulate;
mod source;
#[cfg(test)]
mod tests;
mod text;

pub use allan::{Allan, allan, files as allan_files};
pub use analyze::{Analyze, Judged, Judgements, analyze, certificate, reduced_model};
pub use arguments::{ANY, Assumptions, Attitude, Given, InputOptions, TermOptions, Word, one_of, whole};
pub use calibrate::{Calibrate, Calibrated, calibrate};
pub use call::{Answered, COMMANDS, InJson, Rendered, call, call_allan, call_calibrate, call_json};
pub use compare::{Compare, compare};
pub use conditions::{ConditionOptions, GyroNoiseOptions, MeasurementOptions, RequirementOptions};
pub use crosscheck::{Crosscheck, Evidence, crosscheck, files as crosscheck_files};
pub use design::options::{Search, SearchFiles, WantedOptions};
pub use design::{design, is_word};
pub use designed::{Designed, Searched, SearchedSlewSequence};
pub use host::{Host, Now};
pub use measure::MeasureOptions;
pub use next::FurtherOptions;
pub use obsdeg_evidence::acceptance::AcceptanceReport;
pub use paper::{Paper, paper};
pub use problem::{Problem, ProblemKind, TextPlace};
pub use procedure::{Dialect, Planned, ProcedureRequest, procedure};
pub use report::{CalibrationFile, Report, Reviewed, calibration_report, origin, report};
pub use simulate::{Run, Simulate, files as simulation_files, simulate};
pub use source::{Expected, Input, ModelWithText, NamedInput, Source, title};
