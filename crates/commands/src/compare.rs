//! Comparison of schemes.

use clap::Args;
use obsdeg_evidence::compare::{Comparison, Entry};
use serde::{Deserialize, Serialize};

use crate::arguments::{ANY, Assumptions, SEED, whole};
use crate::conditions::{GyroNoiseOptions, MeasurementOptions};
use crate::problem::Problem;
use crate::source::{Input, NamedInput, title};

/// Request of `compare`: assumptions, conditions and requirements.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct Compare {
    /// Seed of all random choices
    #[arg(long, default_value_t = SEED, value_parser = whole::<u64>(ANY))]
    pub seed: u64,

    /// Assumptions that override those of scheme files.
    #[command(flatten)]
    #[serde(flatten)]
    pub assumptions: Assumptions,

    /// Measurement and requirements.
    #[command(flatten)]
    #[serde(flatten)]
    pub measurement: MeasurementOptions,

    /// The datasheet of the gyros.
    #[command(flatten)]
    #[serde(flatten)]
    pub gyro_noise: GyroNoiseOptions,
}

impl Default for Compare {
    fn default() -> Self {
        Self {
            seed: SEED,
            assumptions: Assumptions::default(),
            measurement: MeasurementOptions::default(),
            gyro_noise: GyroNoiseOptions::default(),
        }
    }
}

/// Compares schemes.
///
/// # Errors
/// Defect of a scheme, with its name; a model among the inputs.
pub fn compare(options: &Compare, read: Vec<NamedInput>) -> Result<Comparison, Problem> {
    let mut entries = Vec::with_capacity(read.len());
    for (name, input) in read {
        let Input::Scheme(mut scheme) = input else {
            return Err(Problem::input(format!(
                "{name} is a model file; expected scheme files (`obsdeg analyze` and `obsdeg report` judge \
                 models side by side)"
            )));
        };
        options.assumptions.apply(&mut scheme);
        let mut conditions = options.measurement.conditions(&scheme);
        conditions.apply(&options.gyro_noise.settings());
        entries.push(Entry { name: title(&name), scheme: *scheme, conditions });
    }
    options.measurement.concern(entries.iter().map(|e| &e.scheme))?;
    obsdeg_evidence::compare::compare(&entries, options.seed)
        .map_err(|(name, e)| Problem::from(e).in_file(&name))
}
