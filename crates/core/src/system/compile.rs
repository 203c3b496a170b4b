//! Compilation of a model: every text of its file as a node of one graph.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use super::constraints::{below, slots_of};
use super::dag::{Dag, DagError, Op};
use super::error::FilePlace;
use super::error::ModelError;
use super::model::compiled::{Compiled, CompiledExperiment, CompiledSegment, Role};
use super::model::{KnownInput, MAX_NODES, ModelSegment, PlacedExpression, StateStart, SystemModel};
use crate::language::{Node, among, nearest};

/// Nodes by name.
type NodesByName = HashMap<String, usize>;

/// Names in a formula.
fn names_of(formula: &PlacedExpression) -> impl Iterator<Item = &str> {
    formula.expression.nodes.iter().filter_map(|node| match node {
        Node::Name(name) => Some(name.as_str()),
        _ => None,
    })
}

impl SystemModel {
    /// Graph of a model without faults in its names.
    pub(super) fn graph(&self) -> Result<Compiled, ModelError> {
        let mut compiler = Compiler::new(self);
        let (experiments, names) = compiler.experiments()?;
        let start_names = compiler.names_of_starts(&names);
        let starts = compiler.starts(&start_names)?;
        compiler.check_own_constants()?;
        let segments = compiler.segments(&names, &start_names)?;
        let kept = compiler.nodes(&self.constraints, &names)?;
        let kept_is_graph = compiler.are_linear(&kept);
        let constraints = compiler.constraints(&names, &starts)?;
        let not_negative = compiler.nodes(&self.not_negative, &names)?;
        let combinations = compiler.nodes(&self.combinations, &names)?;
        Ok(Compiled {
            dag: compiler.dag,
            roles: compiler.roles.into_iter().map(|r| r.1).collect(),
            experiments,
            starts,
            segments,
            constraints,
            kept,
            kept_is_graph,
            not_negative,
            combinations,
            places: compiler.places,
        })
    }
}

/// Compiler of a model, with the graph so far.
struct Compiler<'m> {
    model: &'m SystemModel,
    dag: Dag,
    /// Names with their roles, in slot order.
    roles: Vec<(String, Role)>,
    role_of: HashMap<String, Role>,
    slot_of: HashMap<String, usize>,
    /// Nodes of all slots.
    slots: NodesByName,
    /// Nodes of known constants.
    constants: NodesByName,
    /// Place at which each node was written first.
    places: HashMap<usize, (FilePlace, Range<usize>)>,
}

impl<'m> Compiler<'m> {
    fn new(model: &'m SystemModel) -> Self {
        let (mut dag, roles) = (Dag::default(), model.roles());
        let mut slots = NodesByName::new();
        for (slot, (name, _)) in roles.iter().enumerate() {
            slots.insert(name.clone(), dag.slot(slot));
        }
        Self {
            model,
            dag,
            role_of: roles.iter().cloned().collect(),
            slot_of: roles.iter().enumerate().map(|(i, r)| (r.0.clone(), i)).collect(),
            constants: model.constants.iter().map(|(n, _)| (n.name.clone(), slots[&n.name])).collect(),
            roles,
            slots,
            places: HashMap::new(),
        }
    }

    /// Node of a formula that may use `names`.
    fn node(&mut self, formula: &PlacedExpression, names: &NodesByName) -> Result<usize, ModelError> {
        let before = self.dag.ops.len();
        let made = self.dag.translate(&formula.expression, &|name| names.get(name).copied());
        let span = |i: usize| formula.expression.spans.get(i).cloned().unwrap_or(0..0);
        let node = made.map_err(|(error, i)| formula.place.error(self.explained(&error, names), span(i)))?;
        for made in before..self.dag.ops.len() {
            self.places.insert(made, (formula.place.clone(), formula.expression.span()));
        }
        if self.dag.ops.len() > MAX_NODES {
            return Err(formula
                .place
                .error(format!("more than {MAX_NODES} operations in the model"), span(0)));
        }
        Ok(node)
    }

    /// Message of an error, with the names that are known.
    fn explained(&self, error: &DagError, names: &NodesByName) -> String {
        let is_output = |name: &String| self.model.outputs.iter().any(|o| o.0.name == *name);
        let hint = match error {
            DagError::UnknownName(name) if is_output(name) => {
                Some(": an output, to which nothing can refer".into())
            }
            DagError::UnknownName(name) => {
                let mut known: Vec<String> = names.keys().cloned().collect();
                known.sort();
                let declared = match nearest(name, &known) {
                    Some(_) => "",
                    None => "; new names are declared as parameters, constants or known_inputs",
                };
                Some(format!("; {}{declared}", among(name, &known)))
            }
            _ => None,
        };
        format!("{error}{}", hint.unwrap_or_default())
    }

    /// Nodes of formulas, in their order.
    fn nodes(
        &mut self,
        formulas: &[PlacedExpression],
        names: &NodesByName,
    ) -> Result<Vec<usize>, ModelError> {
        formulas.iter().map(|formula| self.node(formula, names)).collect()
    }

    /// Nodes of every experiment, and the names in the first one: those in starts, jumps and combinations,
    /// with values that are the same in all experiments.
    fn experiments(&mut self) -> Result<(Vec<CompiledExperiment>, NodesByName), ModelError> {
        let model = self.model;
        let mut first = self.slots.clone();
        let mut experiments: Vec<CompiledExperiment> = Vec::new();
        let mut always: Option<HashMap<usize, (i64, i64)>> = None;
        for experiment in 0..model.own.len().max(1) {
            self.dag.definite.clear();
            let constants = self.known_constants(experiment)?;
            let inside = self.names_in(experiment)?;
            let mut own = CompiledExperiment { constants, ..CompiledExperiment::default() };
            for s in &model.states {
                own.rates.push(self.node(&s.equation, &inside)?);
            }
            for (_, formula) in &model.outputs {
                own.outputs.push(self.node(formula, &inside)?);
            }
            if experiment == 0 {
                first = inside;
            }
            experiments.push(own);
            let here = &self.dag.definite;
            always = Some(match always {
                None => here.clone(),
                Some(all) => all.into_iter().filter(|(slot, value)| here.get(slot) == Some(value)).collect(),
            });
        }
        self.dag.definite = always.unwrap_or_default();
        Ok((experiments, first))
    }

    /// Nodes of known constants in an experiment. Rational values that no segment changes become definite
    /// values of the graph.
    fn known_constants(&mut self, experiment: usize) -> Result<Vec<Option<usize>>, ModelError> {
        let model = self.model;
        let changed: HashSet<&str> =
            model.segments.iter().flat_map(|s| &s.constants).map(|(name, _)| name.as_str()).collect();
        let mut out = Vec::new();
        // names in the value of a constant: other constants that come before
        let mut before = NodesByName::new();
        for (i, (named, _)) in model.constants.iter().enumerate() {
            let formula = model.constant_formula(experiment, i);
            let node = formula.map(|f| self.node(f, &before)).transpose()?;
            out.push(node);
            before.insert(named.name.clone(), self.slots[&named.name]);
            let own_value = node.filter(|_| !changed.contains(named.name.as_str()));
            if let Some(value) = own_value.and_then(|node| self.dag.rational(node)) {
                self.dag.definite.insert(self.slot_of[&named.name], value);
            }
        }
        Ok(out)
    }

    /// NodesByName in the equations of an experiment: slots, known inputs that are functions of time, and
    /// definitions.
    fn names_in(&mut self, experiment: usize) -> Result<NodesByName, ModelError> {
        let model = self.model;
        let mut inside = self.slots.clone();
        for (i, (named, _)) in model.known_inputs.iter().enumerate() {
            if let KnownInput::Function(formula) = model.known_input(experiment, i) {
                let mut allowed = self.constants.clone();
                if let Some(&t) = self.slots.get("t").filter(|_| self.role_of.get("t") == Some(&Role::Time)) {
                    allowed.insert("t".into(), t);
                }
                let value = self.node(formula, &allowed)?;
                inside.insert(named.name.clone(), value);
            }
        }
        for (name, formula) in &model.definitions {
            let value = self.node(formula, &inside)?;
            inside.insert(name.clone(), value);
        }
        Ok(inside)
    }

    /// NodesByName in a known start: constants, parameters, and states whose start is not given by a formula.
    fn names_of_starts(&self, names: &NodesByName) -> NodesByName {
        let mut out = self.constants.clone();
        for p in &self.model.parameters {
            out.insert(p.name.clone(), names[&p.name]);
        }
        for s in self.model.states.iter().filter(|s| !matches!(s.start, StateStart::Value(_))) {
            out.insert(s.named.name.clone(), names[&s.named.name]);
        }
        out
    }

    /// Nodes of known starts, by state.
    fn starts(&mut self, names: &NodesByName) -> Result<Vec<Option<usize>>, ModelError> {
        let mut starts = Vec::new();
        for s in &self.model.states {
            starts.push(match &s.start {
                StateStart::Value(formula) => Some(self.node(formula, names)?),
                _ => None,
            });
        }
        Ok(starts)
    }

    /// Refuses values of experiments for names that are no known constants.
    fn check_own_constants(&self) -> Result<(), ModelError> {
        for (name, formula) in self.model.own.iter().flat_map(|e| &e.constants) {
            self.constant(name, formula)?;
        }
        Ok(())
    }

    /// Number of the known constant with this name; `formula` is its value.
    fn constant(&self, name: &str, formula: &PlacedExpression) -> Result<usize, ModelError> {
        match self.role_of.get(name) {
            Some(Role::Constant(c)) => Ok(*c),
            _ => {
                let message = format!("`{name}` is no known constant; expected one of the constants");
                Err(formula.place.error(message, 0..0))
            }
        }
    }

    /// Nodes of all segments.
    fn segments(
        &mut self,
        names: &NodesByName,
        start_names: &NodesByName,
    ) -> Result<Vec<CompiledSegment>, ModelError> {
        let model = self.model;
        model.segments.iter().map(|segment| self.segment(segment, names, start_names)).collect()
    }

    fn segment(
        &mut self,
        segment: &ModelSegment,
        names: &NodesByName,
        start_names: &NodesByName,
    ) -> Result<CompiledSegment, ModelError> {
        let mut compiled = CompiledSegment::default();
        for (name, formula) in &segment.constants {
            let c = self.constant(name, formula)?;
            let allowed = self.constants.clone();
            compiled.constants.push((c, self.node(formula, &allowed)?));
        }
        let mut carried = start_names.clone();
        for s in &self.model.states {
            carried.insert(s.named.name.clone(), names[&s.named.name]);
        }
        for (name, formula) in &segment.carry {
            let Some(&Role::State(s)) = self.role_of.get(name) else {
                let message = format!("`{name}` is no state; expected one of the states");
                return Err(formula.place.error(message, 0..0));
            };
            compiled.carry.push((s, self.node(formula, &carried)?));
        }
        Ok(compiled)
    }

    /// True if the nodes of all constraints are linear in the algebraic unknowns together, and there are no
    /// constraints beside their equations.
    fn are_linear(&self, constraints: &[usize]) -> bool {
        let own: HashSet<usize> =
            self.model.algebraic.iter().filter_map(|a| self.slot_of.get(&a.named.name).copied()).collect();
        // degree in these unknowns, at most 2
        let mut degrees: Vec<usize> = Vec::new();
        for op in &self.dag.ops {
            let of = |i: &usize| degrees.get(*i).copied().unwrap_or(2);
            degrees.push(match op {
                Op::Number { .. } | Op::Pi => 0,
                Op::Slot(slot) => usize::from(own.contains(slot)),
                Op::Add(a, b) | Op::Subtract(a, b) => of(a).max(of(b)),
                Op::Multiply(a, b) => (of(a) + of(b)).min(2),
                Op::Divide(a, b) if of(b) == 0 => of(a),
                Op::Divide(..) => 2,
                Op::Primitive { of: argument, .. } if of(argument) == 0 => 0,
                Op::Primitive { .. } => 2,
            });
        }
        constraints.len() == own.len() && constraints.iter().all(|&node| degrees[node] == 1)
    }

    /// Names at the start of a run, with the given starts instead of their states, and the definitions that
    /// the constraints use.
    fn names_at_start(
        &mut self,
        names: &NodesByName,
        starts: &[Option<usize>],
    ) -> Result<NodesByName, ModelError> {
        let model = self.model;
        let mut out = names.clone();
        let given = model.states.iter().zip(starts).filter_map(|(s, node)| Some((&s.named.name, (*node)?)));
        out.extend(given.map(|(name, node)| (name.clone(), node)));
        let mut used: HashSet<&str> = model.constraints.iter().flat_map(names_of).collect();
        for (name, formula) in model.definitions.iter().rev() {
            if used.contains(name.as_str()) {
                used.extend(names_of(formula));
            }
        }
        for (name, formula) in model.definitions.iter().filter(|d| used.contains(d.0.as_str())) {
            let value = self.node(formula, &out)?;
            out.insert(name.clone(), value);
        }
        Ok(out)
    }

    /// Nodes of the constraints at the start, each checked once it is made.
    fn constraints(
        &mut self,
        names: &NodesByName,
        starts: &[Option<usize>],
    ) -> Result<Vec<usize>, ModelError> {
        let model = self.model;
        let mut constraints = Vec::new();
        let names =
            if starts.iter().any(Option::is_some) { &self.names_at_start(names, starts)? } else { names };
        for formula in &model.constraints {
            let made = self.node(formula, names)?;
            self.check_constraint(made, formula)?;
            constraints.push(made);
        }
        Ok(constraints)
    }

    /// Checks that a constraint at the start is rational in states, parameters and constants, and that its
    /// value can change.
    fn check_constraint(&self, node: usize, formula: &PlacedExpression) -> Result<(), ModelError> {
        let dag = &self.dag;
        let refuse = |message: String| Err(formula.place.error(message, 0..formula.text.len()));
        if below(dag, node).into_iter().any(|i| matches!(dag.ops[i], Op::Primitive { .. } | Op::Pi)) {
            return refuse(
                "a function; expected + - * / and whole powers, or norm(v) = c, which is taken squared"
                    .into(),
            );
        }
        let mut moves = false;
        for slot in slots_of(dag, node) {
            let (name, role) = &self.roles[slot];
            let kind = match role {
                Role::State(_) | Role::Parameter(_) => {
                    moves = true;
                    continue;
                }
                Role::Constant(_) => continue,
                Role::KnownInput(_) | Role::UnknownInput(_) => "an input",
                Role::Time => "the time",
            };
            return refuse(format!("`{name}` is {kind}; expected states, parameters and constants"));
        }
        match moves {
            true => Ok(()),
            false => refuse("nothing unknown; expected states or parameters in it".into()),
        }
    }
}
