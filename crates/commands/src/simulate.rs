//! One run of a filter against a simulated truth.

use clap::Args;
use obsdeg_evidence::requirements::Requirements;
use obsdeg_evidence::simulation::{Simulation, Traces};
use obsdeg_evidence::system::{SystemRun, simulate_system};
use obsdeg_report::{
    Answer, Document, File, ReportError, Table, budget_csv, series_csv, series_parquet, simulation_figures,
};
use serde::{Deserialize, Serialize};

use crate::arguments::{ANY, InputOptions, SEED, whole};
use crate::conditions::ConditionOptions;
use crate::problem::Problem;
use crate::source::Input;

/// Request of `simulate`: the input, and the conditions of the run.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct Simulate {
    /// Seed of the noise
    #[arg(long, default_value_t = SEED, value_parser = whole::<u64>(ANY))]
    pub seed: u64,

    /// Positions, combinations and assumptions.
    #[command(flatten)]
    #[serde(flatten)]
    pub input: InputOptions,

    /// Conditions of the run.
    #[command(flatten)]
    #[serde(flatten)]
    pub conditions: ConditionOptions,
}

impl Default for Simulate {
    fn default() -> Self {
        Self { seed: SEED, input: InputOptions::default(), conditions: ConditionOptions::default() }
    }
}

/// Run of a scheme or of a model.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Run {
    /// Run of a scheme.
    Scheme(Box<Simulation>),
    /// Run of a model.
    Model(Box<SystemRun>),
}

impl Run {
    /// Outcome of the requirements of a scheme, by prediction; `None` for a model, which has no requirements.
    pub fn requirements(&self) -> Option<&Requirements> {
        match self {
            Self::Scheme(run) => Some(&run.requirements),
            Self::Model(_) => None,
        }
    }
}

impl Answer for Run {
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

/// Simulates a run; returns it with its series.
///
/// # Errors
/// Defect of the scheme, the model or the conditions.
pub fn simulate(options: &Simulate, input: &Input) -> Result<(Run, Traces), Problem> {
    match input {
        Input::Scheme(scheme) => {
            options.conditions.concern(std::iter::once(&**scheme))?;
            let conditions = options.conditions.conditions(scheme);
            let (summary, record) = obsdeg_evidence::simulation::simulate(scheme, &conditions, options.seed)?;
            Ok((Run::Scheme(Box::new(summary)), record.traces))
        }
        Input::Model(file) => {
            let (run, traces) = simulate_system(&file.model, options.seed).map_err(|e| file.wrong_run(&e))?;
            Ok((Run::Model(Box::new(run)), traces))
        }
    }
}

/// Files beside the summary: the series, and with `pictures` the figures, which take most of the time.
///
/// # Errors
/// [`ReportError`] of a figure that cannot be drawn.
pub fn files(run: &Run, traces: &Traces, pictures: bool) -> Result<Vec<File>, ReportError> {
    let mut files = vec![
        File { name: "series.csv".into(), bytes: series_csv(traces)?.into_bytes() },
        File { name: "series.parquet".into(), bytes: series_parquet(traces, run)? },
    ];
    if let Run::Scheme(run) = run
        && !run.omitted.budgets.is_empty()
    {
        let bytes = budget_csv(&run.omitted.budgets)?.into_bytes();
        files.push(File { name: "budget.csv".into(), bytes });
    }
    if pictures {
        files.extend(simulation_figures(traces)?);
    }
    Ok(files)
}
