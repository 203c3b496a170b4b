//! Sets of outputs of a model that make its unknowns observable.

use std::ops::RangeInclusive;

use clap::Args;
use obsdeg_core::model::settings::{Assignment, AssignmentError};
use obsdeg_core::system::{CANDIDATE_WORDS, Candidate, ModelError, SystemModel, WorkLimit, check_cost};
use obsdeg_design::DegreeCap;
use obsdeg_design::sensors::{SensorError, SensorOptions, Sensors, sensors};
use serde::{Deserialize, Serialize};

use crate::arguments::{WORK, WordOr, check_whole, whole};
use crate::host::{Host, Now};
use crate::problem::Problem;
use crate::source::{Input, ModelWithText, Source};
use crate::text;

/// Largest orders of derivatives that a request may name.
const ORDERS: RangeInclusive<u64> = 0..=1000;

/// Candidates for the outputs of a model, their costs, and limits of the search.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Outputs of a model")]
#[serde(default)]
pub struct MeasureOptions {
    /// Choose outputs of a model from these candidates: words, names or expressions, separated by commas, as
    /// in "states", "x1, x2, x1 + x3" (default for a model file: candidates if it has any, else states)
    #[arg(long, value_name = "WHAT", allow_hyphen_values = true, value_parser = WordOr(CANDIDATE_WORDS))]
    pub measure: Option<String>,

    /// The outputs of the model stay, and candidates are added (default: candidates replace them)
    #[arg(long)]
    pub own_outputs: bool,

    /// Every unknown that must be observable must have one solution (globally identifiable), as `analyze`
    /// counts solutions; a number that is not decided counts as several
    #[arg(long)]
    pub unique: bool,

    /// Cost of a candidate, above 0 (default: that of the file, or 1): x1=2.5. Sets are compared by the sum
    #[arg(long, value_name = "NAME=COST", value_parser = cost)]
    #[serde(with = "text::list")]
    pub cost: Vec<Assignment>,

    /// The highest order of derivatives to look at in a model that has no proven end
    #[arg(long, value_name = "K", value_parser = whole::<u16>(ORDERS))]
    pub order: Option<u16>,

    /// Limit of the work of a verdict on the model at a random point, in millions of operations (default:
    /// 600); the search for sets may take fifty times as much
    #[arg(long, value_name = "MILLIONS", value_parser = whole::<u64>(WORK))]
    pub work_limit: Option<u64>,
}

fn cost(text: &str) -> Result<Assignment, String> {
    let cost: Assignment = text.parse().map_err(|e: AssignmentError| e.to_string())?;
    check_cost(cost.value)?;
    Ok(cost)
}

/// Requirements on a set of outputs, number of listed sets, and seed.
pub(crate) struct SetRequirements<'a> {
    /// Unknowns that must be observable; empty: all.
    pub(crate) required: &'a [String],
    /// Largest degree of one unknown; without a name, of all.
    pub(crate) max_degree: Vec<DegreeCap>,
    pub(crate) keep: usize,
    pub(crate) seed: u64,
}

/// Finds sets of outputs of a model that make the required unknowns observable.
pub(crate) fn measured(
    a: &MeasureOptions,
    wanted: &SetRequirements<'_>,
    file: &Source,
    host: &Host<'_>,
) -> Result<Sensors, Problem> {
    let (name, Input::Model(file)) = file.clone().read()? else {
        return Err(Problem::input(format!(
            "--measure is about models; {} is a scheme (positions are chosen by --positions or --minimum)",
            file.name
        )));
    };
    if let Some(limit) = a.work_limit {
        check_whole("--work-limit", limit, &WORK)?;
    }
    a.order.map_or(Ok(()), |order| check_whole("--order", order, &ORDERS))?;
    let model = match a.work_limit {
        Some(limit) => SystemModel { work_limit: WorkLimit(limit), ..file.model.clone() },
        None => file.model.clone(),
    };
    let candidates = candidates(a, &model).map_err(|e| wrong(&file, e))?;
    if !a.own_outputs && candidates.iter().all(|c| c.experiment) {
        return Err(Problem::input(
            "--measure experiment repeats outputs from another start, and none is chosen; expected candidates \
             beside it, or --own-outputs",
        ));
    }
    let options = SensorOptions {
        candidates,
        own_outputs: a.own_outputs,
        required: wanted.required.to_vec(),
        max_degree: wanted.max_degree.clone(),
        unique: a.unique,
        keep: wanted.keep,
        order: a.order.map(Into::into),
        seed: wanted.seed,
    };
    let progress = |done| (host.progress)(Now::open(format!("judging sets of outputs of {name}"), done));
    sensors(&model, &options, &progress).map_err(|e| wrong(&file, e))
}

/// Candidates for outputs, with the given costs.
fn candidates(a: &MeasureOptions, model: &SystemModel) -> Result<Vec<Candidate>, SensorError> {
    let all = if model.candidates.is_empty() { "states" } else { "candidates" };
    // an empty list stands for the default candidates
    let asked = a.measure.as_deref().filter(|list| !list.trim().is_empty());
    let mut out = model.candidates_of(asked.unwrap_or(all))?;
    for (i, given) in a.cost.iter().enumerate() {
        if a.cost[..i].iter().any(|other| other.name == given.name) {
            let what = format!("the cost of {}", given.name);
            let message = "it is given twice; expected one --cost for each candidate".into();
            return Err(ModelError { what, message, span: None }.into());
        }
        let known = out.iter().map(|c| c.named.name.clone()).collect::<Vec<_>>();
        let found = out.iter_mut().find(|c| c.named.name == given.name);
        let none = || ModelError {
            what: format!("the cost of {}", given.name),
            message: format!("there is no such candidate; expected one of {}", known.join(", ")),
            span: None,
        };
        found.ok_or_else(none)?.cost = given.value;
    }
    Ok(out)
}

fn wrong(file: &ModelWithText, e: SensorError) -> Problem {
    match e {
        SensorError::Model(e) => file.wrong(&e),
        SensorError::Interrupted => Problem::interrupted(),
        e => Problem::input(e.to_string()),
    }
}
