//! System as a graph: slots with their roles, and nodes of rates, outputs, constants and segments.

use std::collections::HashMap;
use std::ops::Range;

use super::super::dag::{Dag, Op};
use super::super::error::FilePlace;

/// Role of a slot of the graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// State of this index.
    State(usize),
    /// Parameter of this index.
    Parameter(usize),
    /// Known input of this index.
    KnownInput(usize),
    /// Unknown input of this index.
    UnknownInput(usize),
    /// Known constant of this index.
    Constant(usize),
    /// Time.
    Time,
}

/// System as a graph.
#[derive(Debug, Clone)]
pub struct Compiled {
    /// Graph of operations.
    pub dag: Dag,
    /// Role of every slot.
    pub roles: Vec<Role>,
    /// Nodes that differ between experiments: one entry for each, or one for all.
    pub experiments: Vec<CompiledExperiment>,
    /// Nodes of known starts, by state.
    pub starts: Vec<Option<usize>>,
    /// Nodes of constants and of carried states, per segment.
    pub segments: Vec<CompiledSegment>,
    /// Nodes of the constraints at the start, with given starts in place of their states: zero.
    pub constraints: Vec<usize>,
    /// Nodes of the constraints in all states, which the motion may keep.
    pub kept: Vec<usize>,
    /// True if the constraints are those of algebraic equations that are linear in their unknowns: they have
    /// one solution for all other values.
    pub kept_is_graph: bool,
    /// Nodes that are not negative where the constraints hold.
    pub not_negative: Vec<usize>,
    /// Nodes of the combinations.
    pub combinations: Vec<usize>,
    /// Place at which each division and root was written first.
    pub places: HashMap<usize, (FilePlace, Range<usize>)>,
}

impl Compiled {
    fn experiment(&self, i: usize) -> &CompiledExperiment {
        &self.experiments[i.min(self.experiments.len() - 1)]
    }

    /// Node of every state's derivative in an experiment.
    pub fn rates(&self, experiment: usize) -> &[usize] {
        &self.experiment(experiment).rates
    }

    /// Nodes of the outputs in an experiment.
    pub fn outputs(&self, experiment: usize) -> &[usize] {
        &self.experiment(experiment).outputs
    }

    /// Nodes of known constants in an experiment, by constant.
    pub fn constants(&self, experiment: usize) -> &[Option<usize>] {
        &self.experiment(experiment).constants
    }

    /// True if a rate or an output depends on the time explicitly.
    pub fn uses_time(&self) -> bool {
        let mut seen = vec![false; self.dag.ops.len()];
        let parts = self.experiments.iter().flat_map(|e| e.rates.iter().chain(&e.outputs));
        let mut left: Vec<usize> = parts.copied().collect();
        while let Some(i) = left.pop() {
            if std::mem::replace(&mut seen[i], true) {
                continue;
            }
            match self.dag.ops[i] {
                Op::Slot(s) if self.roles[s] == Role::Time => return true,
                Op::Number { .. } | Op::Slot(_) | Op::Pi => {}
                Op::Add(a, b) | Op::Subtract(a, b) | Op::Multiply(a, b) | Op::Divide(a, b) => {
                    left.extend([a, b])
                }
                Op::Primitive { of, .. } => left.push(of),
            }
        }
        false
    }

    /// The system in another graph; `nodes` are the nodes there for those of this one.
    pub(in crate::system) fn with(&self, dag: Dag, nodes: &[usize]) -> Self {
        let all = |list: &[usize]| list.iter().map(|&i| nodes[i]).collect();
        let given = |list: &[Option<usize>]| list.iter().map(|i| i.map(|i| nodes[i])).collect();
        let named = |list: &[(usize, usize)]| list.iter().map(|&(of, i)| (of, nodes[i])).collect();
        let experiment = |e: &CompiledExperiment| CompiledExperiment {
            rates: all(&e.rates),
            outputs: all(&e.outputs),
            constants: given(&e.constants),
        };
        let segment =
            |s: &CompiledSegment| CompiledSegment { constants: named(&s.constants), carry: named(&s.carry) };
        Self {
            dag,
            roles: self.roles.clone(),
            experiments: self.experiments.iter().map(experiment).collect(),
            starts: given(&self.starts),
            segments: self.segments.iter().map(segment).collect(),
            constraints: all(&self.constraints),
            kept: all(&self.kept),
            kept_is_graph: self.kept_is_graph,
            not_negative: all(&self.not_negative),
            combinations: all(&self.combinations),
            places: self.places.iter().map(|(i, place)| (nodes[*i], place.clone())).collect(),
        }
    }

    /// Node of the slot with this role; `None` if nothing uses it.
    pub(crate) fn node_of(&self, role: Role) -> Option<usize> {
        let slot = self.roles.iter().position(|r| *r == role)?;
        self.dag.ops.iter().position(|op| *op == Op::Slot(slot))
    }
}

/// Experiment as nodes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CompiledExperiment {
    pub(in crate::system) rates: Vec<usize>,
    pub(in crate::system) outputs: Vec<usize>,
    pub(in crate::system) constants: Vec<Option<usize>>,
}

/// Segment as nodes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CompiledSegment {
    /// Constants, each with its node.
    pub constants: Vec<(usize, usize)>,
    /// States, each with its node.
    pub carry: Vec<(usize, usize)>,
}
