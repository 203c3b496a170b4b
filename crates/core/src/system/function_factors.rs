//! Factors of identifiable functions: unknowns, known values, and functions of one unknown.

use obsdeg_exact::Field;

use super::dag::Op;
use super::model::compiled::{Compiled, Role};
use super::model::{KnownInput, SystemModel};
use super::rows::layout::Layout;
use crate::language::Function;

/// Function of one unknown, as the sine of an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UnknownFunction {
    pub(super) function: Function,
    /// Unknown that is its argument.
    pub(super) unknown: usize,
    pub(super) node: usize,
    /// Node of its derivative by the argument.
    weight: usize,
}

/// Factors in the order of their numbers: unknowns, known constants, known inputs that are polynomials in
/// time with their derivatives, functions of one unknown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ModelFactors {
    pub(super) unknowns: usize,
    pub(super) constants: usize,
    /// Known inputs, each with the order of its derivative.
    pub(super) inputs: Vec<(usize, usize)>,
    pub(super) functions: Vec<UnknownFunction>,
}

impl ModelFactors {
    /// Factors of a model. With several experiments there are no inputs and no functions of states, as these
    /// differ between experiments.
    pub(super) fn new(model: &SystemModel, compiled: &Compiled, layout: &Layout) -> Self {
        let one = model.experiments <= 1;
        let derivatives = |i: usize| match model.known_input(0, i) {
            KnownInput::Polynomial(degree) if one => (0..=*degree).map(|k| (i, k)).collect(),
            _ => Vec::new(),
        };
        let function = |(node, op): (usize, &Op)| {
            let Op::Primitive { function, of, weight } = *op else { return None };
            let Op::Slot(slot) = compiled.dag.ops[of] else { return None };
            let role = compiled.roles[slot];
            let is_unknown = matches!(role, Role::Parameter(_))
                || one && matches!(role, Role::State(_) | Role::UnknownInput(_));
            let unknown = layout.index_of(role, 0).filter(|_| is_unknown)?;
            Some(UnknownFunction { function, unknown, node, weight })
        };
        Self {
            unknowns: layout.unknowns.len(),
            constants: model.constants.len(),
            inputs: (0..model.known_inputs.len()).flat_map(derivatives).collect(),
            functions: compiled.dag.ops.iter().enumerate().filter_map(function).collect(),
        }
    }

    /// Number of factors.
    pub(super) fn len(&self) -> usize {
        self.unknowns + self.constants + self.inputs.len() + self.functions.len()
    }

    /// Nodes whose values at a point follow those of the unknowns, each with an order of differentiation:
    /// known values, functions, and the derivatives of the functions. `None` for a value that the model does
    /// not use.
    pub(super) fn nodes(&self, compiled: &Compiled) -> Vec<Option<(usize, usize)>> {
        let known = |role: Role, order: usize| Some((compiled.node_of(role)?, order));
        let constants = (0..self.constants).map(|c| known(Role::Constant(c), 0));
        let inputs = self.inputs.iter().map(|&(i, order)| known(Role::KnownInput(i), order));
        let functions = self.functions.iter().map(|f| Some((f.node, 0)));
        let weights = self.functions.iter().map(|f| Some((f.weight, 0)));
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
    pub(super) fn unknown(&self, factor: usize) -> Option<usize> {
        if factor < self.unknowns { Some(factor) } else { self.function(factor).map(|f| f.unknown) }
    }

    /// Number of the factor with a role in an experiment; `None` if there is none.
    pub(super) fn of_role(&self, role: Role, layout: &Layout, experiment: usize) -> Option<usize> {
        match role {
            Role::Constant(c) => Some(self.unknowns + c),
            Role::KnownInput(i) => self.of_input(i, 0),
            role => layout.index_of(role, experiment),
        }
    }

    /// Number of the derivative of a known input; `None` if it is no factor.
    pub(super) fn of_input(&self, input: usize, order: usize) -> Option<usize> {
        let place = self.inputs.iter().position(|&own| own == (input, order))?;
        Some(self.unknowns + self.constants + place)
    }

    /// Derivative of a factor by its unknown, given the values at a point.
    pub(super) fn slope(&self, factor: usize, f: &Field, values: &[u64]) -> Option<(usize, u64)> {
        match factor < self.unknowns {
            true => Some((factor, f.one())),
            // the derivatives follow the functions
            false => Some((self.function(factor)?.unknown, values[factor + self.functions.len()])),
        }
    }

    /// Name of a factor, as `x` or `cos(th)`.
    pub(super) fn name(&self, factor: usize, model: &SystemModel, layout: &Layout) -> String {
        if let Some(f) = self.function(factor) {
            let named = Function::ALL.iter().find(|(_, function)| *function == f.function);
            return format!("{}({})", named.map_or("", |n| n.0), layout.unknowns[f.unknown].in_formulas());
        }
        let constant = factor.checked_sub(self.unknowns);
        match constant.map(|c| c.checked_sub(self.constants).ok_or(c)) {
            None => layout.unknowns[factor].in_formulas(),
            Some(Err(c)) => model.constants[c].0.name.clone(),
            Some(Ok(i)) => {
                let (input, order) = self.inputs[i];
                format!("{}{}", model.known_inputs[input].0.name, "'".repeat(order))
            }
        }
    }
}
