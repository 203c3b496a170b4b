//! Evidence: the exact verdicts compared with a filter.

use clap::Args;
use obsdeg_core::model::{Carry, Latitude, Scheme};
use obsdeg_evidence::crosscheck::{CrossCheck, CrossCheckOptions, FilterChange};
use obsdeg_evidence::system::{SystemEvidence, crosscheck_system};
use obsdeg_report::{Answer, Document, File, ReportError, Table, crosscheck_figures};
use serde::{Deserialize, Serialize};

use crate::arguments::{ANY, CARRIES, InputOptions, SEED, check_whole, one_of, whole};
use crate::conditions::{ConditionOptions, RUNS};
use crate::host::{Host, Now};
use crate::problem::Problem;
use crate::source::Input;
use crate::text;

/// Request of `crosscheck`: the input, its conditions, and defects put into the filter on purpose.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct Crosscheck {
    /// Seed of all random choices; the result does not depend on the number of threads
    #[arg(long, default_value_t = SEED, value_parser = whole::<u64>(ANY))]
    pub seed: u64,

    /// Positions, combinations and assumptions.
    #[command(flatten)]
    #[serde(flatten)]
    pub input: InputOptions,

    /// Conditions of a run.
    #[command(flatten)]
    #[serde(flatten)]
    pub conditions: ConditionOptions,

    /// Monte Carlo runs
    #[arg(long, value_name = "N", default_value_t = DEFAULT_RUNS, value_parser = whole::<u32>(RUNS))]
    pub runs: u32,

    /// Make the filter wrong: another carry
    #[arg(long, value_name = "CARRY", help_heading = "Controls", value_parser = one_of(CARRIES))]
    pub filter_carry: Option<Carry>,

    /// Make the filter wrong: another latitude in degrees
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, help_heading = "Controls")]
    #[serde(with = "text")]
    pub filter_latitude: Option<Latitude>,

    /// Make the filter wrong: it does not know of this position
    #[arg(long, value_name = "POSITION", help_heading = "Controls")]
    pub filter_drop: Option<String>,
}

/// Default number of Monte Carlo runs.
const DEFAULT_RUNS: u32 = 200;

impl Default for Crosscheck {
    fn default() -> Self {
        Self {
            seed: SEED,
            input: InputOptions::default(),
            conditions: ConditionOptions::default(),
            runs: DEFAULT_RUNS,
            filter_carry: None,
            filter_latitude: None,
            filter_drop: None,
        }
    }
}

/// Evidence on a scheme or a model.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Evidence {
    /// Evidence on a scheme.
    Scheme(Box<CrossCheck>),
    /// Evidence on a model.
    Model(Box<SystemEvidence>),
}

impl Evidence {
    /// True if no check disagrees.
    pub fn passed(&self) -> bool {
        match self {
            Self::Scheme(e) => e.passed,
            Self::Model(e) => e.passed,
        }
    }
}

impl Answer for Evidence {
    fn layout(&self) -> Option<&str> {
        match self {
            Self::Scheme(a) => a.layout(),
            Self::Model(a) => a.layout(),
        }
    }

    fn document(&self) -> Document {
        match self {
            Self::Scheme(a) => a.document(),
            Self::Model(a) => a.document(),
        }
    }

    fn tables(&self) -> Result<Vec<Table>, serde_json::Error> {
        match self {
            Self::Scheme(a) => a.tables(),
            Self::Model(a) => a.tables(),
        }
    }

    fn main_table(&self) -> &'static str {
        match self {
            Self::Scheme(a) => a.main_table(),
            Self::Model(a) => a.main_table(),
        }
    }
}

/// Compares the exact verdicts with a filter.
///
/// # Errors
/// Defect of the scheme, the model or the conditions.
pub fn crosscheck(options: &Crosscheck, input: &Input, host: &Host<'_>) -> Result<Evidence, Problem> {
    match input {
        Input::Scheme(scheme) => {
            check_whole("--runs", options.runs, &RUNS)?;
            options.conditions.concern(std::iter::once(&**scheme))?;
            let conditions = options.conditions.conditions(scheme);
            let dropped = options.filter_drop.as_ref().map(|name| position(scheme, name)).transpose()?;
            let filter =
                FilterChange { carry: options.filter_carry, latitude: options.filter_latitude, dropped };
            let runs = options.runs as usize;
            let settings = CrossCheckOptions { runs, seed: options.seed, filter };
            let progress = |done: usize| (host.progress)(Now::of("Monte Carlo", done as u64, runs as u64));
            let evidence =
                obsdeg_evidence::crosscheck::crosscheck(scheme, &conditions, &settings, &progress)?;
            Ok(Evidence::Scheme(Box::new(evidence)))
        }
        Input::Model(file) => {
            let evidence = crosscheck_system(&file.model, options.seed).map_err(|e| file.wrong_run(&e))?;
            Ok(Evidence::Model(Box::new(evidence)))
        }
    }
}

/// Files beside the evidence: its figures.
///
/// # Errors
/// [`ReportError`] of a figure that cannot be drawn.
pub fn files(evidence: &Evidence) -> Result<Vec<File>, ReportError> {
    match evidence {
        Evidence::Scheme(evidence) => Ok(crosscheck_figures(evidence)?),
        Evidence::Model(_) => Ok(Vec::new()),
    }
}

fn position(scheme: &Scheme, name: &str) -> Result<usize, Problem> {
    let names: Vec<&str> = scheme.positions.iter().map(|p| p.name.as_str()).collect();
    let found = names.iter().position(|n| *n == name);
    found.ok_or_else(|| {
        Problem::input(format!(
            "--filter-drop `{name}`: no such position; expected one of {}",
            names.join(", ")
        ))
    })
}
