//! Graph of a model in floating point: right-hand sides, outputs and their Jacobians, for a filter.

use nalgebra::{DMatrix, DVector};
use obsdeg_ekf::{Measurement, Process};

use obsdeg_core::language::{Expression, evaluate_f64};
use obsdeg_core::system::{Compiled, KnownInput, ModelError, Named, Op, Role, SystemModel};

/// State of the filter, with the experiment that it belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "said above")]
pub enum FilterState {
    /// State i of the model.
    State { experiment: usize, i: usize },
    /// Parameter i of the model.
    Parameter(usize),
    /// Derivative of unknown input i.
    Input { experiment: usize, i: usize, derivative: usize },
}

/// Model with numbers for all known quantities. The states of the filter are the states of the model and the
/// derivatives of its unknown inputs, by experiment, and its parameters. The parts of its timeline are the
/// segments of the first experiment, then those of the next.
#[derive(Debug, Clone)]
pub struct Numeric<'a> {
    compiled: &'a Compiled,
    /// States of the filter.
    pub states: Vec<FilterState>,
    /// Names of the states.
    pub names: Vec<String>,
    /// Known inputs as functions of time, by experiment.
    inputs: Vec<Vec<Option<Expression>>>,
    /// Known constants, by part.
    constants: Vec<Vec<f64>>,
    /// Known inputs with held values, whatever the time.
    held: Vec<Option<f64>>,
    /// Time of the model at which a run begins, by experiment.
    origins: Vec<f64>,
    /// Index of the filter state of each slot, by experiment.
    columns: Vec<Vec<Option<usize>>>,
}

impl<'a> Numeric<'a> {
    /// Numbers for `model`: generic known inputs as functions of `t` and generic constants as numbers, from
    /// `[simulation]`.
    ///
    /// # Errors
    /// [`ModelError`] for a quantity without a number, and for arbitrary unknown inputs.
    pub fn new(model: &SystemModel, compiled: &'a Compiled) -> Result<Self, ModelError> {
        Self::with_inputs(model, compiled, &[])
    }

    /// Numbers for `model`, whose known inputs with the indices `given` get values by [`Self::hold`].
    ///
    /// # Errors
    /// See [`Self::new`].
    pub fn with_inputs(
        model: &SystemModel,
        compiled: &'a Compiled,
        given: &[usize],
    ) -> Result<Self, ModelError> {
        let refuse = |what: String, message: &str| ModelError { what, message: message.into(), span: None };
        let experiments = model.experiments.max(1);
        let suffix = |experiment: usize| match experiments {
            1 => String::new(),
            _ => format!("@{}", experiment + 1),
        };
        let (mut states, mut names) = (Vec::new(), Vec::new());
        for experiment in 0..experiments {
            for (i, s) in model.states.iter().enumerate() {
                states.push(FilterState::State { experiment, i });
                names.push(format!("{}{}", s.named.name, suffix(experiment)));
            }
        }
        states.extend((0..model.parameters.len()).map(FilterState::Parameter));
        names.extend(model.parameters.iter().map(|p| p.name.clone()));
        for experiment in 0..experiments {
            for (i, (named, degree)) in model.unknown_inputs.iter().enumerate() {
                let what = || format!("the unknown input {}", named.name);
                let degree = degree.ok_or_else(|| {
                    refuse(what(), "arbitrary; a simulation expects { polynomial = degree }")
                })?;
                for derivative in 0..=degree {
                    states.push(FilterState::Input { experiment, i, derivative });
                    names.push(format!("{}{}{}", named.name, "'".repeat(derivative), suffix(experiment)));
                }
            }
        }
        let (mut inputs, mut constants, mut columns) = (Vec::new(), Vec::new(), Vec::new());
        for experiment in 0..experiments {
            inputs.push(inputs_of(model, experiment, given)?);
            constants.extend(constants_of(model, experiment)?);
            let column = |role: &Role| {
                let state = match *role {
                    Role::State(i) => FilterState::State { experiment, i },
                    Role::Parameter(i) => FilterState::Parameter(i),
                    Role::UnknownInput(i) => FilterState::Input { experiment, i, derivative: 0 },
                    Role::Constant(_) | Role::KnownInput(_) | Role::Time => return None,
                };
                states.iter().position(|s| *s == state)
            };
            columns.push(compiled.roles.iter().map(column).collect());
        }
        let held = vec![None; model.known_inputs.len()];
        let origins = vec![model.time.number(); experiments];
        Ok(Self { compiled, states, names, inputs, constants, held, origins, columns })
    }

    /// Lets the runs of `experiment` begin at the time `t` of the model.
    pub fn begin(&mut self, experiment: usize, t: f64) {
        self.origins[experiment] = t;
    }

    /// Holds the known input `input` at a value from now on.
    pub fn hold(&mut self, input: usize, value: f64) {
        self.held[input] = Some(value);
    }

    /// Value of a known constant in the first segment.
    pub fn constant(&self, k: usize) -> f64 {
        self.constants[0][k]
    }

    /// Number of experiments.
    pub fn experiments(&self) -> usize {
        self.columns.len()
    }

    /// Number of segments of an experiment.
    pub fn segments(&self) -> usize {
        self.constants.len() / self.experiments()
    }

    /// Values of all nodes at a time of a part.
    fn values(&self, part: usize, t: f64, x: &[f64]) -> Vec<f64> {
        let dag = &self.compiled.dag;
        let experiment = part / self.segments();
        let t = t + self.origins[experiment];
        let mut values: Vec<f64> = Vec::with_capacity(dag.ops.len());
        for op in &dag.ops {
            let value = match *op {
                Op::Number { mantissa, decimals } => mantissa as f64 / 10f64.powi(decimals),
                Op::Slot(s) => match self.compiled.roles[s] {
                    Role::State(_) | Role::Parameter(_) | Role::UnknownInput(_) => {
                        self.columns[experiment][s].map_or(f64::NAN, |c| x[c])
                    }
                    Role::Constant(k) => self.constants[part][k],
                    Role::KnownInput(k) => match (self.held[k], &self.inputs[experiment][k]) {
                        (Some(value), _) => value,
                        (None, Some(e)) => evaluate_f64(e, &|name| if name == "t" { t } else { f64::NAN }),
                        (None, None) => 0.0,
                    },
                    Role::Time => t,
                },
                Op::Add(a, b) => values[a] + values[b],
                Op::Subtract(a, b) => values[a] - values[b],
                Op::Multiply(a, b) => values[a] * values[b],
                Op::Divide(a, b) => values[a] / values[b],
                Op::Pi => std::f64::consts::PI,
                Op::Primitive { function, of, .. } => function.value(values[of]),
            };
            values.push(value);
        }
        values
    }

    /// Derivatives of all nodes by the states of the filter, node by node, from their values in a part.
    fn duals(&self, part: usize, values: &[f64]) -> Vec<f64> {
        let dag = &self.compiled.dag;
        let n = self.states.len();
        let columns = &self.columns[part / self.segments()];
        let mut duals = vec![0.0; dag.ops.len() * n];
        for (i, op) in dag.ops.iter().enumerate() {
            let (before, rest) = duals.split_at_mut(i * n);
            let row = &mut rest[..n];
            let mut add = |a: usize, factor: f64| {
                // a constant argument has no derivative, even where that of its function is infinite
                let others = before[a * n..(a + 1) * n].iter().filter(|_| factor != 0.0);
                for (x, y) in row.iter_mut().zip(others).filter(|(_, y)| **y != 0.0) {
                    *x += factor * y;
                }
            };
            match *op {
                Op::Number { .. } | Op::Pi => {}
                Op::Slot(s) => {
                    if let Some(c) = columns[s] {
                        row[c] = 1.0;
                    }
                }
                Op::Add(a, b) => {
                    add(a, 1.0);
                    add(b, 1.0);
                }
                Op::Subtract(a, b) => {
                    add(a, 1.0);
                    add(b, -1.0);
                }
                Op::Multiply(a, b) => {
                    add(a, values[b]);
                    add(b, values[a]);
                }
                Op::Divide(a, b) => {
                    add(a, 1.0 / values[b]);
                    add(b, -values[i] / values[b]);
                }
                Op::Primitive { of, weight, .. } => add(of, values[weight]),
            }
        }
        duals
    }

    /// Rates of a part as a process without noise.
    pub fn process(&self, part: usize) -> SystemProcess<'_> {
        SystemProcess { numeric: self, part }
    }

    /// Outputs of a part with the standard deviations of their noise.
    pub fn measurement<'b>(&'b self, part: usize, sigmas: &'b [f64]) -> SystemMeasurement<'b> {
        SystemMeasurement { numeric: self, part, sigmas }
    }

    /// States after the jump into a part, and their derivatives by those before.
    pub fn carry(&self, part: usize, t: f64, x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let n = self.states.len();
        let (mut after, mut jacobian) = (x.clone(), DMatrix::identity(n, n));
        let (experiment, segment) = (part / self.segments(), part % self.segments());
        let carry = self.compiled.segments.get(segment).map_or(&[][..], |s| &s.carry);
        let values = self.values(part, t, x.as_slice());
        let duals = self.duals(part, &values);
        for &(i, node) in carry {
            if let Some(row) = self.states.iter().position(|s| *s == FilterState::State { experiment, i }) {
                after[row] = values[node];
                for c in 0..n {
                    jacobian[(row, c)] = duals[node * n + c];
                }
            }
        }
        (after, jacobian)
    }

    /// Sets the starts of states that are given by formulas, from the other values.
    pub fn set_known_starts(&self, x: &mut DVector<f64>) {
        for experiment in 0..self.experiments() {
            let values = self.values(experiment * self.segments(), 0.0, x.as_slice());
            for (i, node) in self.compiled.starts.iter().enumerate() {
                let row = self.states.iter().position(|s| *s == FilterState::State { experiment, i });
                if let (Some(node), Some(row)) = (node, row) {
                    x[row] = values[*node];
                }
            }
        }
    }

    /// Values of the requested combinations, of the unknowns at the start of the first experiment, and their
    /// derivatives by the states of the filter, one row each.
    pub fn combinations(&self, x: &DVector<f64>) -> (Vec<f64>, DMatrix<f64>) {
        let (nodes, n) = (&self.compiled.combinations, self.states.len());
        let values = self.values(0, 0.0, x.as_slice());
        let duals = self.duals(0, &values);
        let rows = DMatrix::from_fn(nodes.len(), n, |i, c| duals[nodes[i] * n + c]);
        (nodes.iter().map(|&node| values[node]).collect(), rows)
    }

    /// Values of the constraints at the start of every experiment, which should be zero, and their
    /// derivatives by the states of the filter, one row each.
    pub fn constraints(&self, x: &DVector<f64>) -> (Vec<f64>, DMatrix<f64>) {
        let nodes = &self.compiled.constraints;
        let n = self.states.len();
        let (mut found, mut rows) = (Vec::new(), DMatrix::zeros(nodes.len() * self.experiments(), n));
        for experiment in 0..self.experiments() {
            let part = experiment * self.segments();
            let values = self.values(part, 0.0, x.as_slice());
            let duals = self.duals(part, &values);
            for &node in nodes {
                for c in 0..n {
                    rows[(found.len(), c)] = duals[node * n + c];
                }
                found.push(values[node]);
            }
        }
        (found, rows)
    }
}

/// Known inputs of an experiment as functions of time; `None` for those whose value is a node of the graph.
fn inputs_of(
    model: &SystemModel,
    experiment: usize,
    given: &[usize],
) -> Result<Vec<Option<Expression>>, ModelError> {
    let nominal = &model.simulation.inputs;
    let of = |(k, (named, _)): (usize, &(Named, KnownInput))| {
        let own = nominal.get(&format!("{}@{}", named.name, experiment + 1)).or(nominal.get(&named.name));
        match (model.known_input(experiment, k), own) {
            (KnownInput::Function(_), _) => Ok(None),
            (_, Some(f)) => Ok(Some(f.expression.clone())),
            (_, None) if given.contains(&k) => Ok(None),
            (_, None) => Err(ModelError {
                what: format!("the known input {}", named.name),
                message: "no function of time; expected one under [simulation.inputs]".into(),
                span: None,
            }),
        }
    };
    model.known_inputs.iter().enumerate().map(of).collect()
}

/// Known constants of every segment of an experiment.
fn constants_of(model: &SystemModel, experiment: usize) -> Result<Vec<Vec<f64>>, ModelError> {
    let place = |name: &str| model.constants.iter().position(|c| c.0.name == name);
    let mut whole: Vec<f64> = Vec::new();
    for (k, (named, _)) in model.constants.iter().enumerate() {
        let at = |name: &str| place(name).and_then(|p| whole.get(p)).copied().unwrap_or(f64::NAN);
        let value = match model.constant_formula(experiment, k) {
            Some(formula) => evaluate_f64(&formula.expression, &at),
            None => model.simulation.value(&named.name, experiment).ok_or_else(|| ModelError {
                what: format!("the constant {}", named.name),
                message: "no value; expected one under [simulation.values]".into(),
                span: None,
            })?,
        };
        whole.push(value);
    }
    if model.segments.is_empty() {
        return Ok(vec![whole]);
    }
    let mut out = Vec::new();
    for segment in &model.segments {
        let mut next = whole.clone();
        for (name, formula) in &segment.constants {
            let at = |name: &str| place(name).map_or(f64::NAN, |p| whole[p]);
            if let Some(p) = place(name) {
                next[p] = evaluate_f64(&formula.expression, &at);
            }
        }
        out.push(next.clone());
        whole = next;
    }
    Ok(out)
}

/// Dynamics of a part: parameters and states of other experiments are constant, and the derivatives of an
/// unknown input integrate each other.
#[derive(Debug, Clone, Copy)]
pub struct SystemProcess<'a> {
    numeric: &'a Numeric<'a>,
    part: usize,
}

impl SystemProcess<'_> {
    /// Rows of the states of this experiment, with the nodes of their rates.
    fn moving(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let own = self.part / self.numeric.segments();
        let rates = self.numeric.compiled.rates(own);
        self.numeric.states.iter().enumerate().filter_map(move |(row, state)| match *state {
            FilterState::State { experiment, i } if experiment == own => Some((row, rates[i])),
            _ => None,
        })
    }

    /// Filter states that are derivatives of an unknown input of this experiment, with the index of the next
    /// derivative.
    fn chained(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let states = &self.numeric.states;
        let own = self.part / self.numeric.segments();
        states.iter().enumerate().filter_map(move |(row, state)| match *state {
            FilterState::Input { experiment, i, derivative } if experiment == own => {
                let next = FilterState::Input { experiment, i, derivative: derivative + 1 };
                Some((row, states.iter().position(|s| *s == next)?))
            }
            _ => None,
        })
    }
}

impl Process for SystemProcess<'_> {
    fn states(&self) -> usize {
        self.numeric.states.len()
    }

    fn f(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        let values = self.numeric.values(self.part, t, x.as_slice());
        let mut f = DVector::zeros(x.len());
        for (row, node) in self.moving() {
            f[row] = values[node];
        }
        for (row, next) in self.chained() {
            f[row] = x[next];
        }
        f
    }

    fn jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64> {
        let n = x.len();
        let duals = self.numeric.duals(self.part, &self.numeric.values(self.part, t, x.as_slice()));
        let mut jacobian = DMatrix::zeros(n, n);
        for (row, node) in self.moving() {
            for c in 0..n {
                jacobian[(row, c)] = duals[node * n + c];
            }
        }
        for (row, next) in self.chained() {
            jacobian[(row, next)] = 1.0;
        }
        jacobian
    }

    fn noise(&self, _: f64) -> DMatrix<f64> {
        DMatrix::zeros(self.states(), self.states())
    }
}

/// Outputs of a part.
#[derive(Debug, Clone, Copy)]
pub struct SystemMeasurement<'a> {
    numeric: &'a Numeric<'a>,
    part: usize,
    sigmas: &'a [f64],
}

impl SystemMeasurement<'_> {
    fn nodes(&self) -> &[usize] {
        self.numeric.compiled.outputs(self.part / self.numeric.segments())
    }
}

impl Measurement for SystemMeasurement<'_> {
    fn outputs(&self) -> usize {
        self.nodes().len()
    }

    fn h(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        let values = self.numeric.values(self.part, t, x.as_slice());
        DVector::from_iterator(self.outputs(), self.nodes().iter().map(|&node| values[node]))
    }

    fn jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64> {
        let n = self.numeric.states.len();
        let duals = self.numeric.duals(self.part, &self.numeric.values(self.part, t, x.as_slice()));
        let nodes = self.nodes();
        DMatrix::from_fn(nodes.len(), n, |i, c| duals[nodes[i] * n + c])
    }

    fn noise(&self, _: f64) -> DMatrix<f64> {
        DMatrix::from_diagonal(&DVector::from_iterator(self.sigmas.len(), self.sigmas.iter().map(|s| s * s)))
    }
}
