//! Further positions of a scheme, or after a calibration.

use std::ops::RangeInclusive;

use clap::Args;
use obsdeg_calibration::Setup;
use obsdeg_calibration::answer::CovarianceTable;
use obsdeg_core::model::Scheme;
use obsdeg_core::model::ranges::Range;
use obsdeg_design::next::{NextOptions, NextPositions, next};
use obsdeg_evidence::simulation::{Conditions, KnownCovariance};
use serde::{Deserialize, Serialize};

use crate::arguments::{check_whole, whole};
use crate::conditions::within;
use crate::host::{Host, Now};
use crate::problem::Problem;
use crate::source::Source;

/// Numbers of added positions.
const ADDED: RangeInclusive<u64> = 1..=2;

/// Further positions.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Further positions")]
#[serde(default)]
pub struct FurtherOptions {
    /// Find the one or two positions by which the scheme gains most. The positions of the scheme stay, and
    /// candidates are added at its end. All extensions are compared: by the number of required coefficients
    /// that become observable, then the worst degree, then the largest ratio of uncertainty to requirement
    /// (without requirements the largest sigma), then the time
    #[arg(long, value_name = "1|2", value_parser = whole::<usize>(ADDED))]
    pub next: Option<usize>,

    /// With --after: days since the calibration, such as 30,90,365. The coefficients age as the ageing table
    /// of the scheme states. For each number of days: the fewest positions (up to --next) and the shortest
    /// run that meet every requirement again. The listed extensions are for the last number of days
    #[arg(long, value_name = "DAYS", value_delimiter = ',', value_parser = within(DAYS))]
    pub days: Vec<f64>,
}

/// Days since a calibration.
const DAYS: Range = Range { low: 0.01, high: 36_500.0, unit: "days" };

/// Options of `design` that also apply to further positions.
const APPLICABLE: [&str; 24] = [
    "seed",
    "days",
    "next",
    "candidates",
    "carry",
    "latitude",
    "terms",
    "axes",
    "keep",
    "observable",
    "max_time",
    "max_slew",
    "slew_rate",
    "gimbal",
    "requirement",
    "bench",
    "dwell",
    "step",
    "noise",
    "accelerometer_instability",
    "accelerometer_correlation_time",
    "azimuth_noise",
    "drift_noise",
    "prior",
];

/// Checks the options of a comparison. `names` are the stated options of `design`; `is_scheme` is true with a
/// scheme file, `is_after` with a calibration. Returns the number of added positions.
pub(crate) fn check_further(
    options: &FurtherOptions,
    names: &[&str],
    is_scheme: bool,
    is_after: bool,
) -> Result<usize, Problem> {
    let Some(added) = options.next else {
        return Err(Problem::input(
            "--after is the start of further positions; expected --next 1 or --next 2",
        ));
    };
    check_whole("--next", added as u64, &ADDED)?;
    if !is_scheme {
        return Err(Problem::input("--next extends a scheme; expected a scheme file"));
    }
    if let Some(other) = names.iter().find(|name| !APPLICABLE.contains(*name)) {
        return Err(Problem::input(format!("--{} does nothing with --next", other.replace('_', "-"))));
    }
    for days in &options.days {
        DAYS.check("--days", *days).map_err(|e| Problem::input(e.to_string()))?;
    }
    if !options.days.is_empty() && !is_after {
        return Err(Problem::input("--days counts from a calibration; expected --after FILE"));
    }
    if options.days.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err(Problem::input("--days: expected days in ascending order, as in 30,90,365"));
    }
    Ok(added)
}

/// Comparison of all extensions of a scheme.
pub(crate) fn further(
    base: &Scheme,
    conditions: &Conditions,
    options: &NextOptions,
    host: &Host<'_>,
) -> Result<NextPositions, Problem> {
    if !options.days.is_empty() && base.ageing.is_empty() {
        return Err(Problem::input(
            "--days needs the ageing of the coefficients; expected a table [ageing] in the scheme file, such \
             as D_F = 0.002",
        ));
    }
    if !options.days.is_empty() && conditions.requirements.is_empty() {
        return Err(Problem::input(
            "--days asks when requirements are met again; expected a requirement, by --requirement or a table \
             [requirements] in the scheme file",
        ));
    }
    let progress = |done, all| (host.progress)(Now::of("comparing extensions", done, all));
    Ok(next(base, conditions, options, &progress)?)
}

/// Covariance of a calibration of the platform of `base`, rescaled by its residuals. Positions, carry,
/// azimuth and terms of the calibration may be others; mounting and latitude may not.
pub(crate) fn calibrated(source: &Source, base: &Scheme) -> Result<KnownCovariance, Problem> {
    let wrong = |found: &str| {
        Problem::input(format!(
            "{}: {found}; expected the calibration.json that `obsdeg calibrate -o` wrote of a scheme",
            source.name
        ))
    };
    let value: serde_json::Value = serde_json::from_str(&source.text).map_err(|_| wrong("no JSON"))?;
    let schema = value.get("schema").and_then(|s| s.as_str()).unwrap_or_default();
    if schema.split('/').next() != Some("obsdeg.calibration") {
        return Err(wrong("no calibration of a scheme"));
    }
    let setup = value.get("setup").cloned().unwrap_or_default();
    let setup: Setup = serde_json::from_value(setup)
        .map_err(|e| wrong(&format!("a calibration of another version ({e})")))?;
    let own = Setup::of(base);
    let same = Setup { geometry: setup.geometry, latitude_deg: setup.latitude_deg, ..own.clone() };
    let differences = own.differences(&same);
    if !differences.is_empty() {
        let other = differences.join("; ");
        return Err(Problem::input(format!(
            "{}: a calibration of another platform or place: {other}; expected that of the scheme",
            source.name
        )));
    }
    let table = value.get("covariance").cloned().unwrap_or_default();
    let table: CovarianceTable = serde_json::from_value(table)
        .map_err(|e| wrong(&format!("a calibration of another version ({e})")))?;
    let n = table.names.len();
    if table.rescaled.len() != n || table.rescaled.iter().any(|row| row.len() != n) {
        return Err(wrong("a covariance that is not square"));
    }
    Ok(KnownCovariance { names: table.names, covariance: table.rescaled })
}
