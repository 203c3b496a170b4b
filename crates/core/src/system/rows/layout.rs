//! Unknowns of a system, as columns of its rows, and the orders to which it has to be differentiated.

use obsdeg_exact::Scalars;

use super::super::branches::Signs;
use super::super::model::compiled::{Compiled, Role};
use super::super::model::{StateStart, SystemModel};

/// Smallest number of orders that are followed if no end is proven.
const ORDERS: usize = 60;

/// Unknown of a system.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unknown {
    /// Name of the unknown; `x@2` in the second experiment.
    pub name: String,
    /// Role of the unknown.
    pub role: Role,
    /// Order of the Taylor coefficient, for an unknown input; 0 for others.
    pub derivative: usize,
    /// Experiment of the unknown; `None` for parameters, which all experiments share.
    pub experiment: Option<usize>,
}

impl Unknown {
    /// Name in a formula: `w''''` instead of `w^(4)`, which reads as a power there.
    pub(in crate::system) fn in_formulas(&self) -> String {
        let order = self.derivative;
        self.name.replacen(&format!("^({order})"), &"'".repeat(order), 1)
    }
}

/// Unknowns of a system, and the orders to which it has to be differentiated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Unknowns, in the order of the columns.
    pub unknowns: Vec<Unknown>,
    /// Highest order of derivatives.
    pub bound: usize,
    /// True if the point and every input are generic, so that an order that adds nothing is the last.
    pub closed: bool,
    /// Number of constraints that follow from the others where these hold.
    pub dependent: usize,
    /// Required signs of the arguments of abs and sign at all points: those of the first point, since
    /// verdicts hold on one side. `None` before the first point.
    pub(in crate::system) sides: Option<Signs>,
}

impl Layout {
    /// Unknowns of `model`; `bound` overrides the highest order.
    pub fn new(model: &SystemModel, compiled: &Compiled, bound: Option<usize>) -> Self {
        let arbitrary = model.unknown_inputs.iter().any(|u| u.1.is_none());
        let starts = model.states.iter().all(|s| s.start == StateStart::Unknown);
        let jumps = model.segments.iter().any(|s| !s.carry.is_empty());
        // only a point shows whether the motion keeps constraints
        let free = compiled.constraints.is_empty();
        let closed = starts && !arbitrary && !jumps && !compiled.uses_time() && free;
        let finite: usize = model.unknown_inputs.iter().map(|u| u.1.map_or(1, |d| d + 1)).sum();
        let n = model.states.len() + finite + model.parameters.len();
        let open = if arbitrary { 2 * n + 4 } else { ORDERS.max(2 * n + 4) };
        let bound = bound.unwrap_or(if closed { n * model.experiments.max(1) } else { open });
        let mut unknowns = Vec::new();
        for experiment in 0..model.experiments.max(1) {
            let suffix = if model.experiments > 1 { format!("@{}", experiment + 1) } else { String::new() };
            for (i, s) in model.states.iter().enumerate().filter(|s| s.1.start == StateStart::Unknown) {
                unknowns.push(Unknown {
                    name: format!("{}{suffix}", s.named.name),
                    role: Role::State(i),
                    derivative: 0,
                    experiment: Some(experiment),
                });
            }
        }
        for (i, p) in model.parameters.iter().enumerate() {
            unknowns.push(Unknown {
                name: p.name.clone(),
                role: Role::Parameter(i),
                derivative: 0,
                experiment: None,
            });
        }
        for experiment in 0..model.experiments.max(1) {
            let suffix = if model.experiments > 1 { format!("@{}", experiment + 1) } else { String::new() };
            for (i, (named, degree)) in model.unknown_inputs.iter().enumerate() {
                for derivative in 0..=degree.unwrap_or(bound) {
                    let primes = "'".repeat(derivative.min(3));
                    let name = match derivative {
                        0..=3 => format!("{}{primes}{suffix}", named.name),
                        k => format!("{}^({k}){suffix}", named.name),
                    };
                    unknowns.push(Unknown {
                        name,
                        role: Role::UnknownInput(i),
                        derivative,
                        experiment: Some(experiment),
                    });
                }
            }
        }
        Self { unknowns, bound, closed, dependent: 0, sides: None }
    }

    /// Ratio of an unknown to the Taylor coefficient that stands for it in rows: `k!` for the derivative k of
    /// an input, 1 for every other unknown.
    pub(in crate::system) fn factorial<S: Scalars>(&self, f: &S, unknown: usize) -> S::Element {
        (2..=self.unknowns[unknown].derivative).fold(f.one(), |x, k| f.mul(&x, &f.integer(k as i64)))
    }

    /// Index of the unknown with a role in an experiment; `None` if there is none.
    pub(in crate::system) fn index_of(&self, role: Role, experiment: usize) -> Option<usize> {
        let own = |u: &Unknown| u.role == role && u.experiment.is_none_or(|e| e == experiment);
        self.unknowns.iter().position(own)
    }
}
