//! The same graph in floating point: right-hand sides, outputs and their Jacobians, for a filter.

use nalgebra::{DMatrix, DVector};
use obsdeg_ekf::{Measurement, Process};

use obsdeg_core::model::expression::{Expression, Function, evaluate_f64};
use obsdeg_core::system::{Compiled, Constant, FunctionStart, KnownInput, ModelError, Op, Role, SystemModel};

/// A state of the filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilterState {
    /// State i of the model.
    State(usize),
    /// Parameter i.
    Parameter(usize),
    /// A derivative of unknown input i.
    Input(usize, usize),
}

/// A model with numbers for what is known: states of the filter are the states of the model, its parameters, and the
/// derivatives of its unknown inputs.
#[derive(Debug, Clone)]
pub struct Numeric<'a> {
    compiled: &'a Compiled,
    /// The states of the filter.
    pub states: Vec<FilterState>,
    /// Their names.
    pub names: Vec<String>,
    /// The function of a node that is one.
    functions: Vec<Option<Function>>,
    /// Known inputs as functions of time.
    inputs: Vec<Option<Expression>>,
    /// Known constants, of every segment.
    constants: Vec<Vec<f64>>,
}

impl<'a> Numeric<'a> {
    /// Numbers for `model`: `inputs` are the generic known inputs as functions of `t`, `values` the generic constants.
    ///
    /// # Errors
    /// [`ModelError`] naming what has no number, and for several experiments and arbitrary unknown inputs.
    pub fn new(model: &SystemModel, compiled: &'a Compiled) -> Result<Self, ModelError> {
        let refuse = |what: String, message: &str| ModelError { what, message: message.into(), span: None };
        if model.experiments > 1 {
            return Err(refuse("experiments".into(), "a simulation runs one; expected a model with one"));
        }
        let mut states: Vec<FilterState> = (0..model.states.len()).map(FilterState::State).collect();
        let mut names: Vec<String> = model.states.iter().map(|s| s.named.name.clone()).collect();
        states.extend((0..model.parameters.len()).map(FilterState::Parameter));
        names.extend(model.parameters.iter().map(|p| p.name.clone()));
        for (i, (named, degree)) in model.unknown_inputs.iter().enumerate() {
            let what = || format!("the unknown input {}", named.name);
            let degree = degree
                .ok_or_else(|| refuse(what(), "arbitrary; a simulation expects { polynomial = degree }"))?;
            for k in 0..=degree {
                states.push(FilterState::Input(i, k));
                names.push(format!("{}{}", named.name, "'".repeat(k)));
            }
        }
        let nominal = &model.simulation;
        let mut inputs = Vec::new();
        for (named, kind) in &model.known_inputs {
            let own = nominal.inputs.get(&named.name).map(|f| f.expression.clone());
            inputs.push(match kind {
                // its value is a node of the graph
                KnownInput::Function(_) => None,
                _ => Some(own.ok_or_else(|| {
                    refuse(
                        format!("the known input {}", named.name),
                        "no function of time; expected one under [simulation.inputs]",
                    )
                })?),
            });
        }
        let mut whole: Vec<f64> = Vec::new();
        for (named, constant) in &model.constants {
            let at = |name: &str| {
                let place = model.constants.iter().position(|c| c.0.name == name);
                place.and_then(|p| whole.get(p)).copied().unwrap_or(f64::NAN)
            };
            let value = match constant {
                Constant::Value(formula) => evaluate_f64(&formula.expression, &at),
                Constant::Generic => nominal.values.get(&named.name).copied().ok_or_else(|| {
                    refuse(
                        format!("the constant {}", named.name),
                        "no value; expected one under [simulation.values]",
                    )
                })?,
            };
            whole.push(value);
        }
        let mut constants = vec![whole];
        if !model.segments.is_empty() {
            let mut current = constants.remove(0);
            for segment in &model.segments {
                let mut next = current.clone();
                for (name, formula) in &segment.constants {
                    let place = |name: &str| model.constants.iter().position(|c| c.0.name == name);
                    let at = |name: &str| place(name).map_or(f64::NAN, |p| current[p]);
                    if let Some(p) = place(name) {
                        next[p] = evaluate_f64(&formula.expression, &at);
                    }
                }
                constants.push(next.clone());
                current = next;
            }
        }
        Ok(Self { compiled, states, names, functions: compiled.dag.functions_of_nodes(), inputs, constants })
    }

    /// A known constant in the first segment.
    pub fn constant(&self, k: usize) -> f64 {
        self.constants[0][k]
    }

    /// The number of segments.
    pub fn segments(&self) -> usize {
        self.constants.len()
    }

    /// The values of all nodes at a time of a segment.
    fn values(&self, segment: usize, t: f64, x: &[f64]) -> Vec<f64> {
        let dag = &self.compiled.dag;
        let place = |state: FilterState| self.states.iter().position(|s| *s == state);
        let mut values: Vec<f64> = Vec::with_capacity(dag.ops.len());
        for (i, op) in dag.ops.iter().enumerate() {
            let own = |state| place(state).map_or(f64::NAN, |p| x[p]);
            let value = match *op {
                Op::Number { mantissa, decimals } => mantissa as f64 / 10f64.powi(decimals),
                Op::Slot(s) => match self.compiled.roles[s] {
                    Role::State(k) => own(FilterState::State(k)),
                    Role::Parameter(k) => own(FilterState::Parameter(k)),
                    Role::UnknownInput(k) => own(FilterState::Input(k, 0)),
                    Role::Constant(k) => self.constants[segment][k],
                    Role::KnownInput(k) => self.inputs[k]
                        .as_ref()
                        .map_or(0.0, |e| evaluate_f64(e, &|name| if name == "t" { t } else { f64::NAN })),
                    Role::Time => t,
                },
                Op::Add(a, b) => values[a] + values[b],
                Op::Subtract(a, b) => values[a] - values[b],
                Op::Multiply(a, b) => values[a] * values[b],
                Op::Divide(a, b) => values[a] / values[b],
                Op::Primitive { start: FunctionStart::Root { numerator, denominator }, of, .. } => {
                    values[of].powf(numerator as f64 / denominator as f64)
                }
                Op::Primitive { of, .. } => {
                    let u = values[of];
                    match self.functions[i] {
                        Some(Function::Sin) => u.sin(),
                        Some(Function::Cos) => u.cos(),
                        Some(Function::Exp) => u.exp(),
                        Some(Function::Log) => u.ln(),
                        Some(Function::Asin) => u.asin(),
                        Some(Function::Acos) => u.acos(),
                        Some(Function::Atan) => u.atan(),
                        // taken apart into those above
                        Some(Function::Tan | Function::Sqrt) | None => f64::NAN,
                    }
                }
            };
            values.push(value);
        }
        values
    }

    /// The derivatives of all nodes by the states of the filter, node by node, from their values.
    fn duals(&self, values: &[f64]) -> Vec<f64> {
        let dag = &self.compiled.dag;
        let n = self.states.len();
        let place = |state: FilterState| self.states.iter().position(|s| *s == state);
        let mut duals = vec![0.0; dag.ops.len() * n];
        for (i, op) in dag.ops.iter().enumerate() {
            let (before, rest) = duals.split_at_mut(i * n);
            let row = &mut rest[..n];
            let mut add = |a: usize, factor: f64| {
                if factor != 0.0 {
                    for (x, y) in row.iter_mut().zip(&before[a * n..(a + 1) * n]) {
                        *x += factor * y;
                    }
                }
            };
            match *op {
                Op::Number { .. } => {}
                Op::Slot(s) => {
                    let state = match self.compiled.roles[s] {
                        Role::State(k) => place(FilterState::State(k)),
                        Role::Parameter(k) => place(FilterState::Parameter(k)),
                        Role::UnknownInput(k) => place(FilterState::Input(k, 0)),
                        Role::Constant(_) | Role::KnownInput(_) | Role::Time => None,
                    };
                    if let Some(c) = state {
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

    /// The rates of a segment as a process without noise.
    pub fn process(&self, segment: usize) -> SystemProcess<'_> {
        SystemProcess { numeric: self, segment }
    }

    /// The outputs with the standard deviations of their noise.
    pub fn measurement<'b>(&'b self, segment: usize, sigmas: &'b [f64]) -> SystemMeasurement<'b> {
        SystemMeasurement { numeric: self, segment, sigmas }
    }

    /// The states behind the jump into a segment, and their derivatives by those before.
    pub fn carry(&self, segment: usize, t: f64, x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let n = self.states.len();
        let (mut after, mut jacobian) = (x.clone(), DMatrix::identity(n, n));
        let carry = self.compiled.segments.get(segment).map_or(&[][..], |s| &s.carry);
        let values = self.values(segment, t, x.as_slice());
        let duals = self.duals(&values);
        for &(state, node) in carry {
            if let Some(row) = self.states.iter().position(|s| *s == FilterState::State(state)) {
                after[row] = values[node];
                for c in 0..n {
                    jacobian[(row, c)] = duals[node * n + c];
                }
            }
        }
        (after, jacobian)
    }

    /// The starts of states that are given by formulas, from the other values.
    pub(crate) fn set_known_starts(&self, x: &mut DVector<f64>) {
        let values = self.values(0, 0.0, x.as_slice());
        for (state, node) in self.compiled.starts.iter().enumerate() {
            let row = self.states.iter().position(|s| *s == FilterState::State(state));
            if let (Some(node), Some(row)) = (node, row) {
                x[row] = values[*node];
            }
        }
    }
}

/// The dynamics of a segment: parameters stay, the derivatives of an unknown input integrate each other.
#[derive(Debug, Clone, Copy)]
pub struct SystemProcess<'a> {
    numeric: &'a Numeric<'a>,
    segment: usize,
}

impl SystemProcess<'_> {
    /// The filter states that are derivatives of an unknown input, with the place of the next derivative.
    fn chained(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let states = &self.numeric.states;
        states.iter().enumerate().filter_map(move |(row, state)| match *state {
            FilterState::Input(i, k) => {
                let next = states.iter().position(|s| *s == FilterState::Input(i, k + 1))?;
                Some((row, next))
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
        let numeric = self.numeric;
        let values = numeric.values(self.segment, t, x.as_slice());
        let mut f = DVector::zeros(x.len());
        for (row, state) in numeric.states.iter().enumerate() {
            if let FilterState::State(i) = *state {
                f[row] = values[numeric.compiled.rates[i]];
            }
        }
        for (row, next) in self.chained() {
            f[row] = x[next];
        }
        f
    }

    fn jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64> {
        let numeric = self.numeric;
        let n = x.len();
        let duals = numeric.duals(&numeric.values(self.segment, t, x.as_slice()));
        let mut jacobian = DMatrix::zeros(n, n);
        for (row, state) in numeric.states.iter().enumerate() {
            if let FilterState::State(i) = *state {
                for c in 0..n {
                    jacobian[(row, c)] = duals[numeric.compiled.rates[i] * n + c];
                }
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

/// The outputs of a segment.
#[derive(Debug, Clone, Copy)]
pub struct SystemMeasurement<'a> {
    numeric: &'a Numeric<'a>,
    segment: usize,
    sigmas: &'a [f64],
}

impl Measurement for SystemMeasurement<'_> {
    fn outputs(&self) -> usize {
        self.numeric.compiled.outputs.len()
    }

    fn h(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        let values = self.numeric.values(self.segment, t, x.as_slice());
        let outputs = &self.numeric.compiled.outputs;
        DVector::from_iterator(outputs.len(), outputs.iter().map(|&node| values[node]))
    }

    fn jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64> {
        let n = self.numeric.states.len();
        let duals = self.numeric.duals(&self.numeric.values(self.segment, t, x.as_slice()));
        let outputs = &self.numeric.compiled.outputs;
        DMatrix::from_fn(outputs.len(), n, |i, c| duals[outputs[i] * n + c])
    }

    fn noise(&self, _: f64) -> DMatrix<f64> {
        DMatrix::from_diagonal(&DVector::from_iterator(self.sigmas.len(), self.sigmas.iter().map(|s| s * s)))
    }
}
