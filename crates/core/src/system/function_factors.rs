//! Factors of identifiable functions: unknowns, known values, and functions of one unknown.

use obsdeg_exact::Field;

use super::dag::Op;
use super::model::{Compiled, KnownInput, Role, SystemModel};
use super::rows::Layout;
use crate::language::Function;

/// Function of one unknown, as the sine of an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UnknownFunction {
    pub(super) function: Function,
    /// Unknown that is its argument.
    pub(super) lane: usize,
    pub(super) node: usize,
    /// Node of its derivative by the argument.
    weight: usize,
}

/// Factors in the order of their numbers: unknowns, known constants, constant known inputs, functions of one
/// unknown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Factors {
    pub(super) unknowns: usize,
    pub(super) constants: usize,
    /// Known inputs that are constant.
    pub(super) inputs: Vec<usize>,
    pub(super) functions: Vec<UnknownFunction>,
}

impl Factors {
    /// Factors of a model. With several experiments there are unknowns and constants only, as the others
    /// differ between experiments.
    pub(super) fn new(model: &SystemModel, compiled: &Compiled, layout: &Layout) -> Self {
        let mut out = Self {
            unknowns: layout.unknowns.len(),
            constants: model.constants.len(),
            inputs: Vec::new(),
            functions: Vec::new(),
        };
        if model.experiments > 1 {
            return out;
        }
        let is_constant = |i: &usize| matches!(model.known_input(0, *i), KnownInput::Polynomial(0));
        out.inputs = (0..model.known_inputs.len()).filter(is_constant).collect();
        let function = |(node, op): (usize, &Op)| {
            let Op::Primitive { function, of, weight } = *op else { return None };
            let Op::Slot(slot) = compiled.dag.ops[of] else { return None };
            let role @ (Role::State(_) | Role::Parameter(_)) = compiled.roles[slot] else { return None };
            Some(UnknownFunction { function, lane: layout.lane(role, 0)?, node, weight })
        };
        out.functions = compiled.dag.ops.iter().enumerate().filter_map(function).collect();
        out
    }

    /// Number of factors.
    pub(super) fn len(&self) -> usize {
        self.unknowns + self.constants + self.inputs.len() + self.functions.len()
    }

    /// Nodes whose values at a point follow those of the unknowns: known values, functions, and the
    /// derivatives of the functions. `None` for a value that the model does not use.
    pub(super) fn nodes(&self, compiled: &Compiled) -> Vec<Option<usize>> {
        let constants = (0..self.constants).map(|c| compiled.node_of(Role::Constant(c)));
        let inputs = self.inputs.iter().map(|&i| compiled.node_of(Role::KnownInput(i)));
        let functions = self.functions.iter().map(|f| Some(f.node));
        let weights = self.functions.iter().map(|f| Some(f.weight));
        constants.chain(inputs).chain(functions).chain(weights).collect()
    }

    /// Numbers of the functions of one unknown.
    pub(super) fn of_functions(&self) -> std::ops::Range<usize> {
        self.len() - self.functions.len()..self.len()
    }

    /// Function that is the factor of this number; `None` for another factor.
    pub(super) fn function(&self, factor: usize) -> Option<&UnknownFunction> {
        self.functions.get(factor.checked_sub(self.of_functions().start)?)
    }

    /// Unknown on which a factor depends; `None` for a known value.
    pub(super) fn lane(&self, factor: usize) -> Option<usize> {
        if factor < self.unknowns { Some(factor) } else { self.function(factor).map(|f| f.lane) }
    }

    /// Number of the factor with a role; `None` if there is none.
    pub(super) fn of_role(&self, role: Role, layout: &Layout) -> Option<usize> {
        match role {
            Role::Constant(c) => Some(self.unknowns + c),
            Role::KnownInput(i) => {
                Some(self.unknowns + self.constants + self.inputs.iter().position(|&own| own == i)?)
            }
            role => layout.lane(role, 0),
        }
    }

    /// Derivative of a factor by its unknown, given the values at a point.
    pub(super) fn slope(&self, factor: usize, f: &Field, values: &[u64]) -> Option<(usize, u64)> {
        match factor < self.unknowns {
            true => Some((factor, f.one())),
            // the derivatives follow the functions
            false => Some((self.function(factor)?.lane, values[factor + self.functions.len()])),
        }
    }

    /// Name of a factor, as `x` or `cos(th)`.
    pub(super) fn name(&self, factor: usize, model: &SystemModel, layout: &Layout) -> String {
        if let Some(f) = self.function(factor) {
            let named = Function::ALL.iter().find(|(_, function)| *function == f.function);
            return format!("{}({})", named.map_or("", |n| n.0), layout.unknowns[f.lane].name);
        }
        let constant = factor.checked_sub(self.unknowns);
        match constant.map(|c| c.checked_sub(self.constants).ok_or(c)) {
            None => layout.unknowns[factor].name.clone(),
            Some(Err(c)) => model.constants[c].0.name.clone(),
            Some(Ok(i)) => model.known_inputs[self.inputs[i]].0.name.clone(),
        }
    }
}
