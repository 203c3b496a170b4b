//! Algebraic equations `0 = g(x, z, u)` of index 1: each unknown z becomes a state whose equation follows by
//! differentiation, `dg/dz z' = -dg/dx x' - dg/du u'`, and the equations become constraints of the start.

use std::cell::RefCell;
use std::collections::HashMap;

use obsdeg_exact::{Field, SplitMix64};

use super::error::ModelError;
use super::model::compiled::Role;
use super::model::{
    AlgebraicEquation, Constant, KnownInput, Named, PlacedExpression, State, StateStart, SystemModel,
};
use crate::language::{Environment, Expression, Node, evaluate};

/// Name of a derived quantity: its third index tells it from all names of a file.
fn derived(name: &str, index: usize) -> String {
    let (base, own) = name.split_once('[').unwrap_or((name, "0,0]"));
    let own = own.trim_end_matches(']');
    match own.contains(',') {
        true => format!("{base}[{own},{index}]"),
        false => format!("{base}[{own},0,{index}]"),
    }
}

/// Rate of change of an expression: the coefficient of each unknown rate `z'`, then the rest; `None` is zero.
type Rate = Vec<Option<String>>;

/// Expression that grows node by node.
struct Builder<'a> {
    of: &'a PlacedExpression,
    nodes: Vec<Node>,
}

impl Builder<'_> {
    fn push(&mut self, node: Node) -> Option<usize> {
        self.nodes.push(node);
        Some(self.nodes.len() - 1)
    }

    fn plus(&mut self, a: Option<usize>, b: Option<usize>) -> Option<usize> {
        match (a, b) {
            (Some(a), Some(b)) => self.push(Node::Add(a, b)),
            (one, other) => one.or(other),
        }
    }

    fn negated(&mut self, a: Option<usize>) -> Option<usize> {
        self.push(Node::Negate(a?))
    }

    fn times(&mut self, a: Option<usize>, b: usize) -> Option<usize> {
        if matches!(self.nodes[b], Node::Number { mantissa: 0, .. }) {
            return None;
        }
        self.push(Node::Multiply(a?, b))
    }

    fn over(&mut self, a: Option<usize>, b: usize) -> Option<usize> {
        self.push(Node::Divide(a?, b))
    }

    /// Part of the rate of node `i` of the expression; `rates` are those of the nodes before it.
    fn rate(
        &mut self,
        i: usize,
        rates: &[Option<usize>],
        name: Option<String>,
    ) -> Result<Option<usize>, ModelError> {
        let refuse = |message: &str| {
            let span = self.of.expression.spans.get(i).cloned().unwrap_or(0..0);
            Err(self.of.place.error(message.into(), span))
        };
        Ok(match self.nodes[i] {
            Node::Number { .. } => None,
            Node::Name(_) => name.and_then(|name| self.push(Node::Name(name))),
            Node::Call { .. } => {
                return refuse("a function in an algebraic equation; expected + - * / and whole powers");
            }
            Node::Negate(a) => self.negated(rates[a]),
            Node::Add(a, b) => self.plus(rates[a], rates[b]),
            Node::Subtract(a, b) => {
                let minus = self.negated(rates[b]);
                self.plus(rates[a], minus)
            }
            Node::Multiply(a, b) => {
                let (left, right) = (self.times(rates[a], b), self.times(rates[b], a));
                self.plus(left, right)
            }
            Node::Divide(a, b) => {
                let (left, right) = (rates[a], self.times(rates[b], i));
                let minus = self.negated(right);
                let above = self.plus(left, minus);
                self.over(above, b)
            }
            Node::Power(a, b) => {
                let Some(exponent) = self.of.expression.integer_at(b) else {
                    return refuse("a power in an algebraic equation whose exponent is no whole number");
                };
                let rate = rates[a];
                let factor = self.nodes.len();
                self.nodes.extend([whole(exponent), whole(exponent - 1), Node::Power(a, factor + 1)]);
                let product = self.push(Node::Multiply(factor, factor + 2));
                product.and_then(|product| self.times(rate, product))
            }
        })
    }
}

fn whole(n: i32) -> Node {
    Node::Number { mantissa: n.into(), decimals: 0 }
}

/// Expression of these operations, all written in a text of `length` bytes.
fn expression(nodes: Vec<Node>, length: usize) -> Expression {
    let spans = vec![0..length; nodes.len()];
    Expression { nodes, spans }
}

/// Prime of the field in which entries are tested for zero.
const PRIME: u64 = (1 << 60) + 33;

/// Random values of all names without a definition or given value, and the values that follow.
struct RandomNameValues<'a> {
    model: &'a SystemModel,
    /// Index of every definition, by name.
    places: &'a HashMap<String, usize>,
    /// `None` for a definition that has no value here: a function, or a division by zero.
    known: &'a RefCell<HashMap<String, Option<u64>>>,
}

impl Environment for RandomNameValues<'_> {
    fn name(&self, name: &str) -> Option<u64> {
        if let Some(&value) = self.known.borrow().get(name) {
            return value;
        }
        let definition = self.places.get(name).map(|&i| &self.model.definitions[i].1);
        let given = self.model.constants.iter().find_map(|(named, value)| match value {
            Constant::Value(of) if named.name == name => Some(of),
            _ => None,
        });
        let value = match definition.or(given) {
            Some(of) => evaluate(&of.expression, &Field::new(PRIME), self).ok(),
            None => Some(SplitMix64::of(1, "algebraic equations", &[name]).below(PRIME)),
        };
        self.known.borrow_mut().insert(name.into(), value);
        value
    }

    fn cos_sin(&self, _: &str) -> Option<(u64, u64)> {
        None
    }

    fn known(&self) -> Vec<String> {
        Vec::new()
    }
}

/// Differentiation of a model by time.
struct Differentiation<'a> {
    model: &'a SystemModel,
    out: SystemModel,
    /// Number of derived names so far.
    made: usize,
    /// Rates of names that were differentiated.
    known: HashMap<String, Rate>,
    /// Index of every definition of `out`, by name.
    places: HashMap<String, usize>,
    /// Values at a random point that were needed so far.
    values: RefCell<HashMap<String, Option<u64>>>,
}

impl Differentiation<'_> {
    /// Adds a definition at the place of `of`, and returns its name.
    fn define(&mut self, of: &PlacedExpression, nodes: Vec<Node>) -> String {
        let value = PlacedExpression { expression: expression(nodes, of.text.len()), ..of.clone() };
        self.made += 1;
        let name = derived("rate", self.made);
        self.places.insert(name.clone(), self.out.definitions.len());
        self.out.definitions.push((name.clone(), value));
        name
    }

    /// Definition of one operation on two names.
    fn operation(&mut self, of: &PlacedExpression, a: &str, b: &str, op: fn(usize, usize) -> Node) -> String {
        self.define(of, vec![Node::Name(a.into()), Node::Name(b.into()), op(0, 1)])
    }

    /// Rate of a name, computed once.
    fn rate_of_name(&mut self, name: &str, of: &PlacedExpression) -> Result<Rate, ModelError> {
        if let Some(rate) = self.known.get(name) {
            return Ok(rate.clone());
        }
        let rate = self.new_rate(name, of)?;
        self.known.insert(name.into(), rate.clone());
        Ok(rate)
    }

    /// Rate of a name: of algebraic unknowns by themselves, of states, definitions and inputs.
    fn new_rate(&mut self, name: &str, of: &PlacedExpression) -> Result<Rate, ModelError> {
        let count = self.model.algebraic.len();
        let mut rate: Rate = vec![None; count + 1];
        let refuse = |message: String| Err(of.place.error(message, 0..of.text.len()));
        if let Some(j) = self.model.algebraic.iter().position(|a| a.named.name == name) {
            rate[j] = Some(self.define(of, vec![whole(1)]));
        } else if let Some(state) = self.model.states.iter().find(|s| s.named.name == name) {
            rate[count] = Some(self.define(of, vec![Node::Name(state.named.name.clone())]));
            let last = self.out.definitions.len() - 1;
            self.out.definitions[last].1 = state.equation.clone();
        } else if let Some((_, value)) = self.model.definitions.iter().find(|d| d.0 == name) {
            return self.rate_of(value);
        } else if let Some((named, kind)) = self.model.known_inputs.iter().find(|u| u.0.name == name) {
            match kind {
                KnownInput::Generic => rate[count] = Some(self.input_as_state(named)),
                KnownInput::Polynomial(0) => self.input_as_constant(named),
                _ => {
                    return refuse(format!(
                        "the input `{name}` in an algebraic equation; expected a generic or constant one"
                    ));
                }
            }
        } else if self.model.unknown_inputs.iter().any(|u| u.0.name == name) {
            return refuse(format!(
                "the unknown input `{name}` in an algebraic equation; expected states, parameters, constants \
                 and known inputs"
            ));
        } else if name == "t" && self.model.roles().iter().any(|r| r.0 == "t" && r.1 == Role::Time) {
            return refuse(
                "the time in an algebraic equation; make it a state, clock = 1, with a known start".into(),
            );
        }
        Ok(rate)
    }

    /// Rate of an expression.
    fn rate_of(&mut self, of: &PlacedExpression) -> Result<Rate, ModelError> {
        let names: Vec<Rate> = of
            .expression
            .nodes
            .iter()
            .map(|node| match node {
                Node::Name(name) => self.rate_of_name(name, of),
                _ => Ok(Rate::new()),
            })
            .collect::<Result<_, _>>()?;
        let mut out = Rate::new();
        for part in 0..=self.model.algebraic.len() {
            let mut builder = Builder { of, nodes: of.expression.nodes.clone() };
            let mut rates = Vec::new();
            for (i, name) in names.iter().enumerate() {
                let rate = builder.rate(i, &rates, name.get(part).cloned().flatten())?;
                rates.push(rate);
            }
            let root = rates.last().copied().flatten();
            out.push(root.map(|root| {
                let mut nodes = builder.nodes;
                nodes.extend([whole(0), Node::Add(root, nodes.len())]);
                self.define(of, nodes)
            }));
        }
        Ok(out)
    }

    /// Makes a generic known input a state with a known start, whose rate is a generic known input.
    fn input_as_state(&mut self, named: &Named) -> String {
        let rate = derived(&named.name, 1);
        if let Some(i) = self.out.known_inputs.iter().position(|u| u.0.name == named.name) {
            self.out.known_inputs[i].0 = Named { name: rate.clone(), ..named.clone() };
            let expression = expression(vec![Node::Name(rate.clone())], 0);
            let equation = PlacedExpression { expression, ..PlacedExpression::default() };
            self.out.states.push(State { named: named.clone(), equation, start: StateStart::Known });
        }
        rate
    }

    /// Makes a constant known input a known constant of generic value.
    fn input_as_constant(&mut self, named: &Named) {
        if let Some(i) = self.out.known_inputs.iter().position(|u| u.0.name == named.name) {
            self.out.known_inputs.remove(i);
            self.out.constants.push((named.clone(), Constant::Generic));
        }
    }

    /// True if a definition is zero at a random point.
    fn is_zero(&self, name: &str) -> bool {
        let Self { out: model, places, values: known, .. } = self;
        RandomNameValues { model, places, known }.name(name) == Some(0)
    }

    /// Rates of the algebraic unknowns by elimination in `sum_j J_ij z_j' + r_i = 0`.
    fn solved(&mut self, mut rows: Vec<(PlacedExpression, Rate)>) -> Result<Vec<String>, ModelError> {
        let n = rows.len();
        for j in 0..n {
            let is_pivot = |i: &usize| rows[*i].1[j].as_ref().is_some_and(|entry| !self.is_zero(entry));
            let Some(pivot) = (j..n).find(is_pivot) else {
                let name = &self.model.algebraic[j].named.name;
                let message = format!(
                    "the algebraic equations do not determine `{name}`; expected index 1 (one of them \
                     differentiated by hand may determine it)"
                );
                let of = &rows[j].0;
                return Err(of.place.error(message, 0..of.text.len()));
            };
            rows.swap(j, pivot);
            for i in j + 1..n {
                self.eliminate(&mut rows, j, i);
            }
        }
        let mut rates: Vec<String> = vec![String::new(); n];
        for j in (0..n).rev() {
            let (of, row) = rows[j].clone();
            let mut sum = row[n].clone().unwrap_or_else(|| self.define(&of, vec![whole(0)]));
            for k in j + 1..n {
                if let Some(entry) = &row[k] {
                    let product = self.operation(&of, entry, &rates[k], Node::Multiply);
                    sum = self.operation(&of, &sum, &product, Node::Add);
                }
            }
            let pivot = row[j].clone().unwrap_or_default();
            let nodes = vec![Node::Name(sum), Node::Name(pivot), Node::Divide(0, 1), Node::Negate(2)];
            rates[j] = self.define(&of, nodes);
        }
        Ok(rates)
    }

    /// Subtracts a multiple of row `j` from row `i`, so that its entry in column `j` is zero.
    fn eliminate(&mut self, rows: &mut [(PlacedExpression, Rate)], j: usize, i: usize) {
        let (of, row) = rows[i].clone();
        let (Some(entry), pivot) = (&row[j], rows[j].1.clone()) else { return };
        let Some(by) = &pivot[j] else { return };
        let factor = self.operation(&of, entry, by, Node::Divide);
        rows[i].1[j] = None;
        for k in j + 1..pivot.len() {
            let Some(above) = &pivot[k] else { continue };
            let product = self.operation(&of, &factor, above, Node::Multiply);
            rows[i].1[k] = Some(match &row[k] {
                Some(own) => self.operation(&of, own, &product, Node::Subtract),
                None => self.define(&of, vec![Node::Name(product), Node::Negate(0)]),
            });
        }
    }
}

impl SystemModel {
    /// True if a state is an unknown of the algebraic equations.
    pub(super) fn is_algebraic(&self, state: usize) -> bool {
        self.algebraic.iter().any(|a| a.named.name == self.states[state].named.name)
    }

    /// The model with a state for every algebraic unknown; itself without any.
    ///
    /// # Errors
    /// [`ModelError`] for equations that do not determine their unknowns, functions, the time and unknown
    /// inputs in them, segments, and discrete time.
    pub(super) fn without_algebraic(self) -> Result<Self, ModelError> {
        if self.algebraic.is_empty() {
            return Ok(self);
        }
        let refuse = |what: &str, message: &str| {
            Err(ModelError { what: what.into(), message: message.into(), span: None })
        };
        if self.discrete {
            return refuse("[algebraic]", "equations in discrete time; expected continuous time");
        }
        if !self.segments.is_empty() {
            return refuse("[[segment]]", "segments with algebraic equations; expected one run");
        }
        if self.own.iter().any(|e| !e.known_inputs.is_empty()) {
            return refuse("[[experiment]]", "inputs of its own with algebraic equations; expected none");
        }
        let places = self.definitions.iter().enumerate().map(|(i, d)| (d.0.clone(), i)).collect();
        let (known, values) = (HashMap::new(), RefCell::default());
        let mut d = Differentiation { model: &self, out: self.clone(), made: 0, known, places, values };
        let mut rows = Vec::new();
        for equation in &self.algebraic {
            rows.push((equation.equation.clone(), d.rate_of(&equation.equation)?));
        }
        let rates = d.solved(rows)?;
        let mut out = d.out;
        for (AlgebraicEquation { named, equation }, rate) in self.algebraic.iter().zip(rates) {
            let expression = expression(vec![Node::Name(rate)], equation.text.len());
            let rate = PlacedExpression { expression, ..equation.clone() };
            out.states.push(State { named: named.clone(), equation: rate, start: StateStart::Unknown });
            out.constraints.push(equation.clone());
        }
        Ok(out)
    }
}
