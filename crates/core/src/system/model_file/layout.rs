//! Layout of a model file, as its schema describes it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_spanned::Spanned;
use toml::Value;

use super::super::nominal::ModelSimulationEntry;
use crate::model::recording::ModelRecord;
use crate::title_block::TitleBlock;

/// Layout of a model file. Expressions are texts with `+ - * / ^`, brackets, decimals (exact),
/// `sin cos tan asin acos atan atan2 exp log sqrt tanh abs sign`, `pi`, `deg` and the names of the model; `t`
/// is the time. A name such as `"p[3]"` declares a vector, `"C[3,3]"` a matrix: `p` stands for the whole and
/// `p[1]`, `C[1,2]` for its entries, in expressions and in the answer. `[a, b]` makes a vector of scalars and
/// a matrix of rows. `cross dot norm transpose skew`, of quaternions (w, x, y, z) `R qmul conj qdot`, and the
/// turns `Rx Ry Rz` take them. Constants, definitions and outputs have the shape of their expression.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelFile {
    /// Name of the system in answers and reports.
    #[schemars(required)]
    pub(super) name: Option<String>,
    /// Purpose and source of the system, printed in reports.
    #[serde(default)]
    pub(super) description: String,
    /// Title block of the review: reference, revision, date, author, and the roles that sign.
    #[serde(default)]
    #[schemars(with = "Option<TitleBlock>")]
    pub(super) document: Option<Spanned<TitleBlock>>,
    /// True for a model in discrete time: the equation of a state is its value one step later,
    /// `x = "a*x"` for `x[t+1] = a x[t]`, and degrees count steps. `analyze` judges such models; the other
    /// commands refuse them.
    #[serde(default)]
    pub(super) discrete: bool,
    /// States: the derivative, `x = "-a*x"`, or a table with equation, initial ("known", or an exact value),
    /// unit, description. If there are none, the outputs depend on parameters and inputs alone.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) states: BTreeMap<String, Spanned<Value>>,
    /// Algebraic unknowns, each with an expression that is zero, `v = "R*i - v"`, or a table with equation,
    /// unit, description. Together the equations determine them (index 1); they hold + - * / and whole powers
    /// of states, algebraic unknowns, parameters, constants and known inputs.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) algebraic: BTreeMap<String, Spanned<Value>>,
    /// Unknown constants: a list of names, or tables with unit and description.
    #[serde(default)]
    #[schemars(with = "serde_json::Value")]
    pub(super) parameters: Option<Spanned<Value>>,
    /// Known inputs: "generic", "constant", { polynomial = degree }, { function = "sin(2*t)" }.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) known_inputs: BTreeMap<String, Spanned<Value>>,
    /// Unknown inputs: "arbitrary" or { polynomial = degree }.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) unknown_inputs: BTreeMap<String, Spanned<Value>>,
    /// Known constants: "generic", or an exact value.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) constants: BTreeMap<String, Spanned<Value>>,
    /// Names for subexpressions, in any order.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) definitions: BTreeMap<String, Spanned<Value>>,
    /// Outputs: an expression, or a table with expression, unit, description.
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) outputs: BTreeMap<String, Spanned<Value>>,
    /// Number of experiments: runs with their own initial states and shared parameters; when left out, the
    /// number of `[[experiment]]` tables, or 1.
    #[serde(default)]
    #[schemars(with = "Option<usize>")]
    pub(super) experiments: Option<Spanned<usize>>,
    /// Experiments one by one, with the constants and inputs that differ.
    #[serde(default, rename = "experiment")]
    pub(super) own: Vec<ExperimentEntry>,
    /// Segments of the timeline, reached at once: constants = { c = "-1" }, carry = { x = "-x" } (states
    /// that jump).
    #[serde(default, rename = "segment")]
    pub(super) segments: Vec<SegmentEntry>,
    /// Time t at which the run begins: a number (0 when left out), or "generic". Where equations or known
    /// inputs hold t, the first segment is judged at this time: verdicts at t = 0 may differ from those at
    /// any later time. Later segments are judged at a generic time.
    #[schemars(with = "Option<serde_json::Value>")]
    pub(super) time: Option<Spanned<Value>>,
    /// Equations that hold at the start of every experiment, as `norm(q) = 1`. There must be a real point
    /// that meets them and at which their gradients are independent; where none is found, one near
    /// `simulation.values` is. Random starts lie on them, and their differentials are known.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub(super) constraints: Vec<Spanned<String>>,
    /// Combinations of unknowns to be judged, as expressions.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub(super) combinations: Vec<Spanned<String>>,
    /// Quantities that could be measured, for `obsdeg design`: an expression, or a table with expression (or
    /// `experiment = true`: the same outputs from another start), cost (1 when left out), unit, description.
    /// Candidates are no outputs of the model.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) candidates: BTreeMap<String, Spanned<Value>>,
    /// Numbers for `obsdeg simulate --model`, in the units of the model.
    #[serde(default)]
    pub(super) simulation: ModelSimulationEntry,
    /// Reading of the record of `obsdeg calibrate --model`: columns, known values and intervals at rest.
    #[schemars(with = "Option<ModelRecord>")]
    pub(super) record: Option<Spanned<ModelRecord>>,
}

/// Experiment with constants or known inputs of its own.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExperimentEntry {
    /// Constants with another value in this experiment.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) constants: BTreeMap<String, Spanned<Value>>,
    /// Known inputs of another kind in this experiment.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) known_inputs: BTreeMap<String, Spanned<Value>>,
}

/// Segment of the timeline, with its own constants and jumps.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentEntry {
    /// Constants with another value in this segment.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) constants: BTreeMap<String, Spanned<Value>>,
    /// States after the jump, as expressions of those before.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub(super) carry: BTreeMap<String, Spanned<Value>>,
}
