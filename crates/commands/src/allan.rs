//! Noise of sensors from a static record.

use clap::Args;
use obsdeg_calibration::CalibrationProgress;
use obsdeg_calibration::noise::{NoiseError, NoiseOptions, SensorNoiseReport, sensor_noise};
use obsdeg_calibration::record::{Record, STANDARD_GRAVITY};
use obsdeg_report::{File, Format, ReportError, TerminalLayout, sensor_noise_figures, written};
use serde::{Deserialize, Serialize};

use crate::calibrate::{GRAVITY, number_within};
use crate::host::Host;
use crate::problem::{Problem, ProblemKind};

/// Default probability of a confidence band.
const CONFIDENCE: f64 = 0.95;
/// Range of that probability.
const PROBABILITY: [f64; 2] = [0.5, 0.9999];

/// Request of `allan`: columns, confidence and gravity.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct Allan {
    /// Column to use, by its name; may be given several times (default: all with a unit of a rate or a
    /// specific force)
    #[arg(long, value_name = "NAME")]
    pub column: Vec<String>,

    /// Probability that a confidence band holds a deviation (0.5 to 0.9999)
    #[arg(long, value_name = "P", default_value_t = CONFIDENCE, value_parser = number_within(PROBABILITY))]
    pub confidence: f64,

    /// Value of one g, in m/s^2 (9 to 10.5)
    #[arg(long, value_name = "M_S2", default_value_t = STANDARD_GRAVITY, value_parser = number_within(GRAVITY))]
    pub gravity: f64,
}

impl Default for Allan {
    fn default() -> Self {
        Self { column: Vec::new(), confidence: CONFIDENCE, gravity: STANDARD_GRAVITY }
    }
}

/// Noise of the sensors of a static record.
///
/// # Errors
/// [`Problem`] of an option or of the record.
pub fn allan(a: &Allan, record: Record, host: &Host<'_>) -> Result<SensorNoiseReport, Problem> {
    let ranges = [("--confidence", a.confidence, PROBABILITY), ("--gravity", a.gravity, GRAVITY)];
    for (option, found, [low, high]) in ranges {
        if !(low..=high).contains(&found) {
            return Err(Problem::input(format!("{option} {found}: expected a number from {low} to {high}")));
        }
    }
    let options =
        NoiseOptions { columns: a.column.clone(), confidence: a.confidence, gravity_m_s2: a.gravity };
    let progress = |now: CalibrationProgress<'_>| (host.progress)(now.into());
    sensor_noise(record, &options, &progress).map_err(|e| match e {
        NoiseError::Interrupted => {
            Problem { kind: ProblemKind::Interrupted, ..Problem::input("interrupted") }
        }
        e => Problem::input(e.to_string()),
    })
}

/// Files beside the JSON: coefficients, deviations, the table for a scheme file, figures.
///
/// # Errors
/// [`ReportError`] of a figure that cannot be drawn.
pub fn files(found: &SensorNoiseReport) -> Result<Vec<File>, ReportError> {
    let coefficients = written(found, Format::Csv, TerminalLayout::default())?;
    let deviations = obsdeg_report::csv(found, Some("columns.deviations"))?;
    let mut files = vec![
        File { name: "coefficients.csv".into(), bytes: coefficients.into_bytes() },
        File { name: "deviations.csv".into(), bytes: deviations.into_bytes() },
        File { name: "simulation.toml".into(), bytes: found.simulation_table.clone().into_bytes() },
    ];
    files.extend(sensor_noise_figures(found)?);
    Ok(files)
}
