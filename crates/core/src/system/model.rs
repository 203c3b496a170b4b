//! Any system `x' = f(x, u, p, t)`, `z = h`: the content of its file, before any number is drawn.

pub(crate) mod compiled;

use std::collections::{BTreeMap, HashSet};

use super::constraints::ConstraintFactor;
use super::error::{FilePlace, ModelError};
use super::work::WorkLimit;
use crate::language::{Expression, Function, MAX_NAME};
use crate::model::recording::Recording;
use crate::title_block::TitleBlock;
use compiled::{Compiled, Role};

/// Expression with its place.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlacedExpression {
    /// Text as written.
    pub text: String,
    /// Expression that was read from the text.
    pub expression: Expression,
    /// Place of the text.
    pub place: FilePlace,
}

/// Name with unit and description.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Named {
    /// Name in the model.
    pub name: String,
    /// Unit; empty if none is given.
    pub unit: String,
    /// Description; empty if none is given.
    pub description: String,
}

/// Knowledge of the start of a state.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum StateStart {
    /// Unknown start.
    #[default]
    Unknown,
    /// Known start of generic value.
    Known,
    /// Known start with this value.
    Value(PlacedExpression),
}

/// State of a system.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct State {
    /// Name, unit and description.
    pub named: Named,
    /// Derivative of the state by time.
    pub equation: PlacedExpression,
    /// Start of the state.
    pub start: StateStart,
}

/// Algebraic unknown with its equation.
#[derive(Debug, Clone, PartialEq)]
pub struct AlgebraicEquation {
    /// Name, unit and description of the unknown.
    pub named: Named,
    /// Expression that is zero.
    pub equation: PlacedExpression,
}

/// True for the name of a derived quantity: it has a third index, which no name of a file has.
pub(super) fn is_derived(name: &str) -> bool {
    name.matches(',').count() == 2
}

/// Known input.
#[derive(Debug, Clone, PartialEq)]
pub enum KnownInput {
    /// Generic function of time.
    Generic,
    /// Polynomial in time of this degree with generic coefficients (0: a constant).
    Polynomial(usize),
    /// Given function of the time `t`.
    Function(PlacedExpression),
}

/// Known constant.
#[derive(Debug, Clone, PartialEq)]
pub enum Constant {
    /// Generic value.
    Generic,
    /// Given value.
    Value(PlacedExpression),
}

/// Quantity that could be measured, or one more experiment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Candidate {
    /// Name, unit and description: of an expression its text.
    pub named: Named,
    /// Expressions of its entries: one, or those of a vector; none for an experiment.
    pub parts: Vec<PlacedExpression>,
    /// True for one more experiment: the same outputs, from another start.
    pub experiment: bool,
    /// Cost of measuring it, above 0, dimensionless.
    pub cost: f64,
}

/// Part of the timeline with its own constants and a map of the states at its beginning.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ModelSegment {
    /// Constants with another value.
    pub constants: Vec<(String, PlacedExpression)>,
    /// States that jump: their values after the jump, in terms of those before.
    pub carry: Vec<(String, PlacedExpression)>,
}

/// Entries in which one experiment differs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ExperimentChanges {
    /// Constants with another value.
    pub constants: Vec<(String, PlacedExpression)>,
    /// Known inputs of another kind.
    pub known_inputs: Vec<(String, KnownInput)>,
}

/// Time at which the first segment begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StartTime {
    /// Time zero.
    #[default]
    Zero,
    /// Decimal `mantissa / 10^decimals`.
    At {
        /// All digits as an integer.
        mantissa: i128,
        /// Number of digits after the decimal point.
        decimals: i32,
    },
    /// Generic time: verdicts are those of almost every time.
    Generic,
}

impl StartTime {
    /// Time as a number; 1 for a generic one.
    pub fn number(self) -> f64 {
        match self {
            Self::Zero => 0.0,
            Self::At { mantissa, decimals } => mantissa as f64 / 10f64.powi(decimals),
            Self::Generic => 1.0,
        }
    }
}

/// Numbers for a simulation in the units of the model, as far as the file gives them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Nominal {
    /// Duration of a run.
    pub duration: Option<f64>,
    /// Time between two samples.
    pub step: Option<f64>,
    /// True values of states at the start, parameters, unknown inputs and generic constants.
    pub values: BTreeMap<String, f64>,
    /// Standard deviations of the initial estimates.
    pub priors: BTreeMap<String, f64>,
    /// Standard deviation of the noise of a sample, by output.
    pub noise: BTreeMap<String, f64>,
    /// Generic known inputs as functions of the time `t`.
    pub inputs: BTreeMap<String, PlacedExpression>,
}

/// Model of a system.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SystemModel {
    /// Name of the system.
    pub name: String,
    /// Description and source of the system.
    pub description: String,
    /// Title block of its review.
    pub document: TitleBlock,
    /// True in discrete time: equations of states give their next values, `x[t+1] = f(x, u, p, t)`.
    pub discrete: bool,
    /// States of the system.
    pub states: Vec<State>,
    /// Algebraic equations as read; their unknowns are among the states, the equations among the constraints.
    pub algebraic: Vec<AlgebraicEquation>,
    /// Unknown constants.
    pub parameters: Vec<Named>,
    /// Known inputs, each with its kind.
    pub known_inputs: Vec<(Named, KnownInput)>,
    /// Unknown inputs, each with its degree as a polynomial in time; `None`: arbitrary.
    pub unknown_inputs: Vec<(Named, Option<usize>)>,
    /// Known constants, each with its value.
    pub constants: Vec<(Named, Constant)>,
    /// Names of subexpressions, in order of use.
    pub definitions: Vec<(String, PlacedExpression)>,
    /// Outputs, each with its expression.
    pub outputs: Vec<(Named, PlacedExpression)>,
    /// Number of experiments: runs with their own starts and unknown inputs; parameters are shared.
    pub experiments: usize,
    /// Differences of the experiments; empty if there are none.
    pub own: Vec<ExperimentChanges>,
    /// Segments; empty for a single one without changes.
    pub segments: Vec<ModelSegment>,
    /// Constraints: expressions of states, parameters and constants that are zero at the start of every
    /// experiment, with the equation as their text.
    pub constraints: Vec<PlacedExpression>,
    /// Factors that replace constraints that are products.
    pub factors: Vec<ConstraintFactor>,
    /// Expressions that are not negative where the constraints hold: the other sides of constraints with a
    /// single root on the left, which is squared.
    pub not_negative: Vec<PlacedExpression>,
    /// Combinations to be judged.
    pub combinations: Vec<PlacedExpression>,
    /// Quantities that could be measured.
    pub candidates: Vec<Candidate>,
    /// Time at which the first segment begins.
    pub time: StartTime,
    /// Numbers for a simulation.
    pub simulation: Nominal,
    /// Reading of the records of its runs.
    pub recording: Recording,
    /// Limit of the work of a verdict; an option, not part of the model.
    pub work_limit: WorkLimit,
}

/// Largest number of unknowns of a system.
pub(crate) const MAX_UNKNOWNS: usize = 4000;

/// Largest number of experiments.
pub(crate) const MAX_EXPERIMENTS: usize = 20;

/// Highest degree of an input that is a polynomial in time.
pub(crate) const MAX_DEGREE: usize = 50;

/// Largest number of characters of a unit of an unknown, an input or an output.
const MAX_UNIT: usize = 256;

/// Largest number of characters of a description of one of these, and of the name of a model.
const MAX_DESCRIPTION: usize = 4000;

/// Largest number of operations of a system.
pub(crate) const MAX_NODES: usize = 200_000;

/// Largest number of signs `+ - * /` and powers in the text of a system. They are counted before the text is
/// read; operations may be written more than once.
const MAX_SIGNS: usize = 2 * MAX_NODES;

/// Refuses a text with more operation signs than a system may have.
pub(super) fn check_signs(text: &str) -> Result<(), ModelError> {
    let mut signs = text.bytes().enumerate().filter(|(_, b)| b"+-*/^".contains(b));
    let Some((at, _)) = signs.nth(MAX_SIGNS) else { return Ok(()) };
    let message = format!("more than {MAX_SIGNS} signs + - * / ^");
    Err(ModelError { what: "the model file".into(), message, span: Some(at..at + 1) })
}

impl Nominal {
    /// Value of `x@2` in `map`, or else of `x`.
    pub fn named(&self, map: &BTreeMap<String, f64>, name: &str) -> Option<f64> {
        let shared = name.split('@').next().unwrap_or_default();
        map.get(name).or_else(|| map.get(shared)).copied()
    }

    /// Value of `name` in an experiment (counted from 0).
    pub fn value(&self, name: &str, experiment: usize) -> Option<f64> {
        self.named(&self.values, &format!("{name}@{}", experiment + 1))
    }
}

/// Refuses a text of more than `most` characters; `of` names the entry.
fn check_length(what: &str, of: &str, text: &str, most: usize) -> Result<(), ModelError> {
    if text.chars().nth(most).is_none() {
        return Ok(());
    }
    let shown: String = of.chars().take(20).collect();
    let more = if shown.len() < of.len() { "..." } else { "" };
    let message = format!("a {what} of {} characters; expected at most {most}", text.chars().count());
    Err(ModelError { what: format!("`{shown}{more}`"), message, span: None })
}

impl SystemModel {
    /// Equations as written: known inputs that are functions of time, then definitions, rates and outputs:
    /// `u = ...`, `a = ...`, `x' = ...`, `y = ...`. A text for all entries of a vector stands once. An
    /// experiment with its own function is named.
    pub(crate) fn equations(&self) -> Vec<String> {
        let mut inputs = Vec::new();
        for (i, (named, _)) in self.known_inputs.iter().enumerate() {
            let of = |e: usize| match self.known_input(e, i) {
                KnownInput::Function(f) => Some(f),
                KnownInput::Generic | KnownInput::Polynomial(_) => None,
            };
            let all: Vec<_> = (0..self.own.len().max(1)).map(of).collect();
            let text = |f: Option<&PlacedExpression>| f.map(|f| f.text.clone());
            if all.iter().all(|f| text(*f) == text(all[0])) {
                inputs.extend(all[0].map(|f| (&named.name, String::new(), f)));
                continue;
            }
            let own = all.into_iter().enumerate().filter_map(|(e, f)| Some((e, f?)));
            inputs.extend(own.map(|(e, f)| (&named.name, format!(" in experiment {}", e + 1), f)));
        }
        let inputs = inputs.iter().map(|(name, at, f)| (*name, at.as_str(), *f));
        let definitions = self.definitions.iter().filter(|d| !is_derived(&d.0)).map(|(n, e)| (n, "", e));
        let next = if self.discrete { "[t+1]" } else { "'" };
        let differential = |s: &&State| {
            !self.algebraic.iter().any(|a| a.named.name == s.named.name) && !s.equation.text.is_empty()
        };
        let states = self.states.iter().filter(differential).map(|s| (&s.named.name, next, &s.equation));
        let outputs = self.outputs.iter().map(|(n, e)| (&n.name, "", e));
        let base = |name: &str| name.split('[').next().unwrap_or_default().to_string();
        let lines = |all: Vec<(&String, &str, &PlacedExpression)>| -> Vec<String> {
            let line = |(i, (name, sign, e)): (usize, &(&String, &str, &PlacedExpression))| {
                let same =
                    |j: usize| all.get(j).is_some_and(|o| base(o.0) == base(name) && o.2.place == e.place);
                match (i > 0 && same(i - 1), same(i + 1)) {
                    (true, _) => None,
                    (false, true) => Some(format!("{}{sign} = {}", base(name), e.text)),
                    (false, false) => Some(format!("{name}{sign} = {}", e.text)),
                }
            };
            all.iter().enumerate().filter_map(line).collect()
        };
        let mut algebraic: Vec<String> =
            self.algebraic.iter().map(|a| format!("0 = {}", a.equation.text)).collect();
        algebraic.dedup();
        [lines(inputs.chain(definitions).chain(states).collect()), algebraic, lines(outputs.collect())]
            .concat()
    }

    /// Constraints as written; one text may contain those of all entries of a vector.
    pub(crate) fn constraint_texts(&self) -> Vec<String> {
        let mut out: Vec<&PlacedExpression> = self.constraints.iter().collect();
        out.dedup_by(|a, b| a.place == b.place);
        let text = |c: &PlacedExpression| match self.algebraic.iter().any(|a| a.equation.place == c.place) {
            true => format!("{} = 0", c.text),
            false => c.text.clone(),
        };
        out.into_iter().map(text).collect()
    }

    /// Known input in an experiment (counted from 0).
    pub fn known_input(&self, experiment: usize, i: usize) -> &KnownInput {
        let (named, kind) = &self.known_inputs[i];
        let own = self.own.get(experiment).and_then(|e| e.known_inputs.iter().find(|u| u.0 == named.name));
        own.map_or(kind, |u| &u.1)
    }

    /// Known constant in an experiment (counted from 0), before the first segment changes it: its own
    /// formula, if it has one.
    pub fn constant_formula(&self, experiment: usize, i: usize) -> Option<&PlacedExpression> {
        let (named, constant) = &self.constants[i];
        let own = self.own.get(experiment).and_then(|e| e.constants.iter().find(|c| c.0 == named.name));
        match (own, constant) {
            (Some((_, formula)), _) | (None, Constant::Value(formula)) => Some(formula),
            (None, Constant::Generic) => None,
        }
    }

    /// Value that the file gives for a simulation to the quantity with this role, in an experiment (counted
    /// from 0).
    pub(super) fn given(&self, role: Role, experiment: usize) -> Option<f64> {
        let name = match role {
            Role::State(i) => &self.states[i].named.name,
            Role::Parameter(i) => &self.parameters[i].name,
            Role::Constant(i) => &self.constants[i].0.name,
            Role::KnownInput(_) | Role::UnknownInput(_) | Role::Time => return None,
        };
        self.simulation.value(name, experiment)
    }

    /// Names of all slots.
    pub(super) fn slot_names(&self) -> Vec<String> {
        self.roles().into_iter().map(|(name, _)| name).collect()
    }

    /// All names with their roles, in slot order.
    pub(super) fn roles(&self) -> Vec<(String, Role)> {
        let mut out: Vec<(String, Role)> = Vec::new();
        out.extend(self.states.iter().enumerate().map(|(i, s)| (s.named.name.clone(), Role::State(i))));
        out.extend(self.parameters.iter().enumerate().map(|(i, p)| (p.name.clone(), Role::Parameter(i))));
        out.extend(
            self.known_inputs.iter().enumerate().map(|(i, u)| (u.0.name.clone(), Role::KnownInput(i))),
        );
        out.extend(
            self.unknown_inputs.iter().enumerate().map(|(i, u)| (u.0.name.clone(), Role::UnknownInput(i))),
        );
        out.extend(self.constants.iter().enumerate().map(|(i, c)| (c.0.name.clone(), Role::Constant(i))));
        if out.iter().all(|(name, _)| name != "t") {
            out.push(("t".into(), Role::Time));
        }
        out
    }

    /// Graph of the system.
    ///
    /// # Errors
    /// [`ModelError`] for names that are unknown, defined twice or reserved, and for expressions that are
    /// never defined.
    pub fn compile(&self) -> Result<Compiled, ModelError> {
        if self.discrete {
            let message =
                "in discrete time; expected a model in continuous time (`analyze` judges both)".into();
            return Err(ModelError { what: "the model".into(), message, span: None });
        }
        self.check()?;
        let found = self.states.len() + self.parameters.len();
        if found > MAX_UNKNOWNS {
            let message = format!("{found} states and parameters; expected at most {MAX_UNKNOWNS} unknowns");
            return Err(ModelError { what: "the model".into(), message, span: None });
        }
        self.graph()
    }

    /// Checks conditions that need no graph: at least one state or parameter, one output, and distinct
    /// names.
    pub(super) fn check(&self) -> Result<(), ModelError> {
        let refuse = |what: String, message: String| Err(ModelError { what, message, span: None });
        if self.states.is_empty() && self.parameters.is_empty() {
            return refuse("the model".into(), "no state and no parameter; expected at least one".into());
        }
        if self.outputs.is_empty() {
            return refuse("the model".into(), "no output; expected at least one".into());
        }
        // an output may have the name of the state that it equals
        let mut outputs: Vec<&str> = self.outputs.iter().map(|o| o.0.name.as_str()).collect();
        outputs.sort_unstable();
        if let Some(pair) = outputs.windows(2).find(|pair| pair[0] == pair[1]) {
            return refuse(
                format!("`{}`", pair[0]),
                "two outputs of this name; expected different names".into(),
            );
        }
        self.check_texts()?;
        let mut seen: HashSet<String> = HashSet::new();
        let names = self.roles().into_iter().filter(|r| r.1 != Role::Time).map(|r| r.0);
        for name in names.chain(self.definitions.iter().map(|d| d.0.clone())) {
            check_length("name", &name, &name, MAX_NAME)?;
            if Function::named(name.split('[').next().unwrap_or_default()).is_some() {
                return refuse(
                    format!("`{name}`"),
                    "the name of a function; expected a name of its own".into(),
                );
            }
            // entries of vectors are named v[1], C[1,2]
            let (plain, index) = name.split_once('[').unwrap_or((&name, "1]"));
            let number = |i: &str| !i.is_empty() && i.chars().all(|c| c.is_ascii_digit());
            let index = index.strip_suffix(']').is_some_and(|i| i.split(',').all(number));
            let plain = plain.starts_with(|c: char| c.is_alphabetic() || c == '_')
                && plain.chars().all(|c| c.is_alphanumeric() || c == '_');
            if !plain || !index {
                return refuse(
                    format!("`{name}`"),
                    "not a name; expected a letter, then letters, digits and `_`".into(),
                );
            }
            if seen.contains(&name) {
                return refuse(format!("`{name}`"), "given twice; expected different names".into());
            }
            seen.insert(name);
        }
        Ok(())
    }

    /// Refuses texts that are too long for a column of a table.
    fn check_texts(&self) -> Result<(), ModelError> {
        check_length("name of a model", &self.name, &self.name, MAX_DESCRIPTION)?;
        let inputs = self.known_inputs.iter().map(|i| &i.0).chain(self.unknown_inputs.iter().map(|i| &i.0));
        let constants = self.constants.iter().map(|c| &c.0);
        let outputs = self.outputs.iter().map(|o| &o.0);
        let states = self.states.iter().map(|s| &s.named);
        for of in states.chain(&self.parameters).chain(inputs).chain(constants).chain(outputs) {
            check_length("name", &of.name, &of.name, MAX_NAME)?;
            check_length("unit", &of.name, &of.unit, MAX_UNIT)?;
            check_length("description", &of.name, &of.description, MAX_DESCRIPTION)?;
        }
        Ok(())
    }
}
