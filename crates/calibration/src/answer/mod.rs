//! Answer of a calibration as plain data.

mod findings;
mod fit;
mod records;

use obsdeg_core::model::settings::Assignment;
use obsdeg_core::title_block::TitleBlock;
use obsdeg_evidence::acceptance::AcceptanceReport;
use obsdeg_evidence::requirements::Requirements;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::setup::{Setup, SourceRecord};

pub use findings::{
    CalibrationFinding, CellKind, FamilyLimit, ForceCause, ForceError, ForceLength, Omitted, SilentError,
};
pub use fit::{
    Before, ChannelFit, CovarianceTable, Curvature, Estimated, Fit, Moved, NextRun, Outlier, PositionFit,
    Repeatability, SecondPath, Warmth,
};
pub use records::{
    Assumed, Clock, ClockRate, ColumnRead, EmptyCells, Gap, HeldUnknown, PositionsBy, RecordReport, Residual,
    ResidualDeviation, ResidualPoint, ResidualSeries,
};

/// Name and version of the JSON layout.
pub const LAYOUT: &str = "obsdeg.calibration/1";

/// Calibration of a scheme from one or several records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Calibration {
    /// Layout of this answer: `obsdeg.calibration/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Name of the scheme; empty if it has none.
    #[serde(default)]
    pub name: String,
    /// Title block of the scheme's documents.
    #[serde(default)]
    pub document: TitleBlock,
    /// True if the model and its sigmas explain the records.
    pub consistent: bool,
    /// Evidence against the model or its sigmas, the gravest first; empty if there is none.
    pub findings: Vec<CalibrationFinding>,
    /// Estimates of the unknowns, psi of the start of each record.
    pub quantities: Vec<Estimated>,
    /// Outcome of the requirements on coefficients by the sigmas of the estimates, rescaled where they are
    /// too small, with what a bench adds and what a suspected error would change; null if none is stated.
    /// Requirements on psi are not judged: a calibration estimates psi of the start of a record.
    #[serde(default)]
    pub requirements: Option<Requirements>,
    /// Acceptance of the coefficients within the limits of the scheme, by the same uncertainties; null if no
    /// limits are stated.
    #[serde(default)]
    pub acceptance: Option<AcceptanceReport>,
    /// Further runs that bring coefficients to requirements they miss; empty if none is missed.
    #[serde(default)]
    pub next_runs: Vec<NextRun>,
    /// Estimates of combinations of unknowns that are not determined alone, and of those asked for.
    pub combinations: Vec<Estimated>,
    /// Covariance of all estimates that do not follow from others.
    pub covariance: CovarianceTable,
    /// Quality of the whole fit: chi-square, its band and its factor.
    pub fit: Fit,
    /// Curvature of the estimates over what the records and priors leave open.
    #[serde(default)]
    pub curvature: Curvature,
    /// Quality of the fit by record and position.
    pub positions: Vec<PositionFit>,
    /// Quality of the fit by component of Z.
    pub channels: Vec<ChannelFit>,
    /// Measurements that were left out as outliers.
    pub outliers: Vec<Outlier>,
    /// Number of measurements that were left out as outliers.
    pub outlier_count: usize,
    /// Second path to the estimate: the filter against least squares.
    pub second_path: SecondPath,
    /// Agreement of the coefficients of several records; null for one record.
    pub repeatability: Option<Repeatability>,
    /// Records that were read, with their clocks and columns.
    pub records: Vec<RecordReport>,
    /// Assumptions of the estimates: conditions, noise, priors and gate.
    pub assumed: Assumed,
    /// Errors that the scheme does not estimate: suspicion in these records, and what they cannot show.
    #[serde(default)]
    pub omitted: Omitted,
    /// Scheme, geometry and carry that were calibrated.
    pub setup: Setup,
    /// Records that the estimates rest on, including those of the calibration before.
    pub rests_on: Vec<SourceRecord>,
    /// Residuals over time, by record and component.
    pub series: Vec<ResidualSeries>,
    /// Every measurement and what the estimate leaves of it.
    #[serde(skip)]
    #[schemars(skip)]
    pub residuals: Vec<Residual>,
}

impl Calibration {
    /// True values of another run of the calibrated platform: the determined unknowns, with psi of the first
    /// record.
    pub fn values(&self) -> Vec<Assignment> {
        let first = |e: &Estimated| {
            let name = e.name.strip_suffix(" (record 1)").unwrap_or(&e.name).to_string();
            Some(Assignment { value: e.estimate.filter(|_| !name.contains(" (record "))?, name })
        };
        self.quantities.iter().filter_map(first).collect()
    }
}
