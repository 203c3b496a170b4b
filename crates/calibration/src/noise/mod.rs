//! Noise of sensors from a static record: overlapping Allan deviations, and coefficients by a fit to them.

mod answer;
mod settings;
mod static_record;

use obsdeg_ekf::EkfError;
use obsdeg_ekf::allan_fit::{AllanPoint, NoiseFit, fit, overlapping_variance};

pub use answer::{
    AllanDeviation, ColumnNoise, NoiseCoefficient, NoiseKind, NoiseSetting, SensorKind, SensorNoiseReport,
};

use crate::CalibrationProgress;
use crate::record::{Record, RecordError, STANDARD_GRAVITY};
use static_record::{Channel, StaticRecord};

/// Divisor of the number of samples for the longest cluster: longer clusters leave too few differences.
const LONGEST: usize = 8;
/// Fewest samples of a column: clusters of 1, 2, 4, 8 and 16 samples.
pub(crate) const FEWEST: usize = 128;
/// Probability below which the three noises do not explain the deviations.
const UNEXPLAINED: f64 = 1e-3;

/// Reason why no noise was found in a static record.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoiseError {
    /// Error of the record.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A requested column does not exist.
    #[error("{record}: no column `{name}` with a unit of a rate or a force; expected one of {expected}")]
    Column {
        /// Name of the record.
        record: String,
        /// Name that was requested.
        name: String,
        /// Columns with units of sensors.
        expected: String,
    },
    /// No column of a sensor.
    #[error(
        "{record}: no column of a sensor; expected columns with a unit, of a gyro (deg/h, deg/s, rad/s) or \
         an accelerometer (g, mg, ug, m/s^2), found {found}"
    )]
    Sensors {
        /// Name of the record.
        record: String,
        /// Columns of the record.
        found: String,
    },
    /// The record has too many numbers.
    #[error(
        "{record}: more than {most} numbers in columns of sensors; expected fewer columns (--column) or a \
         shorter record"
    )]
    Long {
        /// Name of the record.
        record: String,
        /// Largest number allowed.
        most: usize,
    },
    /// Too few samples without a gap.
    #[error(
        "{record}, column `{column}`: {found} samples without a gap between them at most; expected {FEWEST} or more"
    )]
    Short {
        /// Name of the record.
        record: String,
        /// Name of the column.
        column: String,
        /// Number of samples of the longest stretch.
        found: usize,
    },
    /// Samples that do not vary.
    #[error("{record}, column `{column}`: all samples are {value}; expected the noise of a sensor")]
    Constant {
        /// Name of the record.
        record: String,
        /// Name of the column.
        column: String,
        /// Value of all samples.
        value: f64,
    },
    /// The fit fails on numbers that are not finite.
    #[error("{record}, column `{column}`: {source}")]
    Fit {
        /// Name of the record.
        record: String,
        /// Name of the column.
        column: String,
        /// Error of the fit.
        source: EkfError,
    },
    /// The caller stopped the work.
    #[error("interrupted")]
    Interrupted,
}

/// Columns, confidence and gravity for reading a static record.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseOptions {
    /// Names of the columns to use; empty for all with a unit of a sensor.
    pub columns: Vec<String>,
    /// Probability that a confidence band holds a deviation.
    pub confidence: f64,
    /// Acceleration of one g, in m/s^2.
    pub gravity_m_s2: f64,
}

impl Default for NoiseOptions {
    fn default() -> Self {
        Self { columns: Vec::new(), confidence: 0.95, gravity_m_s2: STANDARD_GRAVITY }
    }
}

/// Noise of the sensors of a static record.
///
/// # Errors
/// [`NoiseError`].
pub fn sensor_noise(
    record: Record,
    options: &NoiseOptions,
    progress: &dyn Fn(CalibrationProgress<'_>) -> bool,
) -> Result<SensorNoiseReport, NoiseError> {
    let read = StaticRecord::read(record, options, progress)?;
    let columns =
        read.channels.iter().map(|c| column(&read, c, options)).collect::<Result<Vec<ColumnNoise>, _>>()?;
    let settings = settings::of(&columns, read.interval_s);
    Ok(SensorNoiseReport {
        schema: answer::SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        record: read.name.clone(),
        samples: read.samples,
        span_s: read.span_s,
        interval_s: read.interval_s,
        gaps: read.gaps,
        jitter: read.jitter,
        ignored: read.ignored.clone(),
        simulation_table: settings::table(&settings),
        notes: settings::notes(&columns, read.interval_s),
        columns,
        settings,
    })
}

/// Noise of one column.
fn column(read: &StaticRecord, channel: &Channel, options: &NoiseOptions) -> Result<ColumnNoise, NoiseError> {
    let (record, column) = (|| read.name.clone(), || channel.text.clone());
    let lengths: Vec<usize> = channel.stretches.iter().map(Vec::len).collect();
    let longest = lengths.iter().copied().max().unwrap_or(0);
    if longest < FEWEST {
        return Err(NoiseError::Short { record: record(), column: column(), found: longest });
    }
    let all = || channel.stretches.iter().flatten().copied();
    let samples = lengths.iter().sum::<usize>();
    let first = all().next().unwrap_or(0.0);
    if all().all(|x| x == first) {
        return Err(NoiseError::Constant {
            record: record(),
            column: column(),
            value: first / channel.scale,
        });
    }
    let clusters =
        std::iter::successors(Some(1_usize), |m| Some(2 * m)).take_while(|m| m * LONGEST <= longest);
    let points: Vec<AllanPoint> =
        clusters.filter_map(|m| overlapping_variance(&channel.stretches, m)).collect();
    let wrong = |source| NoiseError::Fit { record: record(), column: column(), source };
    let found = fit(&points, &lengths, options.confidence).map_err(wrong)?;
    let dt = read.interval_s;
    let deviation = |p: &obsdeg_ekf::allan_fit::FittedPoint| AllanDeviation {
        tau_s: p.samples as f64 * dt,
        samples: p.samples,
        deviation: p.deviation,
        low: p.low,
        high: p.high,
        degrees_of_freedom: p.degrees_of_freedom,
        fitted: p.fitted,
    };
    Ok(ColumnNoise {
        column: channel.text.clone(),
        sensor: channel.sensor,
        unit: channel.sensor.unit().into(),
        samples,
        empty_cells: channel.empty,
        left_out: channel.left_out.len(),
        left_out_lines: channel.left_out.iter().copied().take(20).collect(),
        mean: first + all().map(|x| x - first).sum::<f64>() / samples as f64,
        coefficients: coefficients(&found, channel.sensor, dt),
        chi_square: found.chi_square,
        degrees_of_freedom: found.degrees_of_freedom,
        probability: found.probability,
        explained: found.probability > UNEXPLAINED,
        deviations: found.points.iter().map(deviation).collect(),
    })
}

impl SensorKind {
    /// Unit of the Allan deviations of a sensor.
    fn unit(self) -> &'static str {
        match self {
            Self::Gyro => "deg/h",
            Self::Accelerometer => "ug",
        }
    }
}

/// Coefficients of a fit in the units of datasheets; samples are `dt` s apart.
fn coefficients(found: &NoiseFit, sensor: SensorKind, dt: f64) -> Vec<NoiseCoefficient> {
    // a rate in deg/h (ug) times the root of a second; N = sigma sqrt(dt), K = step/sqrt(dt)
    let units: [(NoiseKind, &str, &str, f64); 3] = match sensor {
        SensorKind::Gyro => [
            (NoiseKind::RandomWalk, "angle random walk", "deg/sqrt(h)", dt.sqrt() / 60.0),
            (NoiseKind::BiasInstability, "bias instability", "deg/h", 1.0),
            (NoiseKind::RateRandomWalk, "rate random walk", "deg/h/sqrt(h)", 60.0 / dt.sqrt()),
        ],
        SensorKind::Accelerometer => [
            (
                NoiseKind::RandomWalk,
                "velocity random walk",
                "m/s/sqrt(h)",
                dt.sqrt() * 60.0 * 1e-6 * STANDARD_GRAVITY,
            ),
            (NoiseKind::BiasInstability, "bias instability", "ug", 1.0),
            (NoiseKind::RateRandomWalk, "acceleration random walk", "ug/sqrt(h)", 60.0 / dt.sqrt()),
        ],
    };
    let of = |((noise, name, unit, scale), term): (
        (NoiseKind, &str, &str, f64),
        &obsdeg_ekf::allan_fit::TermFit,
    )| {
        NoiseCoefficient {
            noise,
            name: name.into(),
            unit: unit.into(),
            resolved: term.found.is_some(),
            value: term.found.map(|f| f.value * scale),
            sigma: term.found.map(|f| f.sigma * scale),
            limit: term.limit * scale,
            least_resolved: term.least * scale,
        }
    };
    units.into_iter().zip(&found.terms).map(of).collect()
}
