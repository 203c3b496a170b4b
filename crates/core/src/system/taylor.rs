//! Taylor series of all nodes in time, coefficient by coefficient, with the derivative by every unknown (one
//! dual component each), in any field.
//!
//! A node has dual components only for unknowns that it can depend on. The weight of a function has none: for
//! `dF = weight du` its values suffice. Orders are kept only if a later order needs them, as factors of a
//! product of two changing nodes.

mod advance;
mod start;

use std::sync::Arc;

use obsdeg_exact::SplitMix64;

use super::dag::{Dag, Op};
use super::values::{ConstraintFailure, Values};
use super::work::Refused;
use crate::language::Function;

/// Content of a slot in one run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Signal<E> {
    /// State, by the node of its derivative.
    State {
        /// Node of the right-hand side.
        rate: usize,
    },
    /// Number that does not change, with its dual component if it is unknown.
    Constant {
        /// Value of the number.
        value: E,
        /// Index of the unknown's dual component; `None` if the number is known.
        component: Option<usize>,
    },
    /// Known input that starts at a value and has random derivatives up to this order (`None`: all).
    Known {
        /// Value at the start.
        value: E,
        /// Highest order of a derivative that is not zero.
        degree: Option<usize>,
    },
    /// Unknown input: its start, the dual component of its first Taylor coefficient, and their number.
    Unknown {
        /// Value at the start.
        value: E,
        /// Index of the first dual component.
        component: usize,
        /// Number of dual components.
        count: usize,
    },
    /// Time of the run.
    Time {
        /// Time at the start.
        value: E,
    },
}

/// Start of a state: its value and its derivative by every unknown (dual component, value).
pub(crate) type Initial<E> = (E, Vec<(usize, E)>);

/// Reasons why there is no series at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Singular {
    /// Division by zero, at this node.
    Division(usize),
    /// Function that is not defined here, at this node.
    Domain(usize, Function),
    /// Function that is defined but has no derivative here, at this node.
    Kink(usize, Function),
    /// Constraints that could not be solved here, this one among them.
    Constraint(usize),
    /// Constraints whose gradients are dependent here, this one among them.
    Dependent(usize),
    /// Values or gradients beyond the limit of work, which records the reason.
    Refused,
}

impl From<Refused> for Singular {
    fn from(_: Refused) -> Self {
        Self::Refused
    }
}

impl From<ConstraintFailure> for Singular {
    fn from(reason: ConstraintFailure) -> Self {
        match reason {
            ConstraintFailure::Constraint(c) => Self::Constraint(c),
            ConstraintFailure::Dependent(c) => Self::Dependent(c),
            ConstraintFailure::Refused => Self::Refused,
        }
    }
}

/// Taylor series of one run.
#[derive(Debug, Clone)]
pub(crate) struct Taylor<'a, S: Values> {
    dag: &'a Dag,
    f: S,
    components: usize,
    signals: Vec<Signal<S::Element>>,
    rng: SplitMix64,
    /// True, per node, if it takes part in the run.
    needed: Vec<bool>,
    /// True, per node, if its duals are needed: for a weight that nothing else uses the values suffice.
    differentiated: Vec<bool>,
    /// True, per node, if it is constant in time.
    constant: Vec<bool>,
    /// True, per node, if it depends on no unknown.
    known: Vec<bool>,
    /// True, per node, if every order of its duals is needed later; otherwise two orders are kept.
    kept: Vec<bool>,
    /// Dual components of each node, ascending.
    support: Vec<Arc<[u32]>>,
    /// Taylor coefficients `values[node][k]`.
    values: Vec<Vec<S::Element>>,
    /// Dual components `duals[node][k * components of the node + i]`, with k modulo 2 for nodes that are not
    /// kept.
    duals: Vec<Vec<S::Element>>,
    /// Inverses of small integers.
    inverses: Vec<S::Element>,
    /// Number of coefficients that are computed.
    pub length: usize,
    sums: Vec<S::Sum>,
}

impl<S: Values> Taylor<'_, S> {
    /// Writes the sums (times a factor) as the duals of order k, adds contributions to single components, and
    /// clears the sums.
    fn store(
        &mut self,
        i: usize,
        k: usize,
        sums: &mut [S::Sum],
        factor: Option<&S::Element>,
        own: &[(usize, S::Element)],
    ) {
        let f = &self.f;
        let support = &self.support[i];
        let start = if self.kept[i] { k } else { k % 2 } * support.len();
        let row = &mut self.duals[i];
        if row.len() < start + support.len() {
            row.resize(start + support.len(), f.zero());
        }
        for (x, &component) in row[start..].iter_mut().zip(support.iter()) {
            let sum = &mut sums[component as usize];
            *x = f.reduce(sum);
            if let Some(factor) = factor {
                *x = f.mul(x, factor);
            }
            *sum = f.no_sum();
        }
        for (component, value) in own {
            if let Ok(place) = support.binary_search(&(*component as u32)) {
                let x = &mut row[start + place];
                *x = f.add(x, value);
            }
        }
    }

    fn inverse(&mut self, k: usize) {
        while self.inverses.len() <= k {
            let next = self.f.integer(self.inverses.len() as i64);
            // no integer as small as an order is zero in the field
            self.inverses.push(self.f.inverse(&next).unwrap_or(self.f.zero()));
        }
    }

    /// Coefficient of a node at order k; zero beyond order 0 for a constant.
    pub(crate) fn value(&self, a: usize, k: usize) -> S::Element {
        self.values[a].get(k).copied().unwrap_or(self.f.zero())
    }

    /// Derivative of a node at order k by the unknowns of [`Taylor::components_of`]; empty if it is zero. Of
    /// orders before the last, only those that are needed again are stored.
    pub(crate) fn dual(&self, a: usize, k: usize) -> &[S::Element] {
        if k > 0 && self.constant[a] {
            return &[];
        }
        let (width, place) = (self.support[a].len(), if self.kept[a] { k } else { k % 2 });
        self.duals[a].get(place * width..(place + 1) * width).unwrap_or(&[])
    }

    /// Dual components of the unknowns that a node can depend on.
    pub(crate) fn components_of(&self, a: usize) -> &[u32] {
        &self.support[a]
    }

    /// Field of the series.
    pub(super) fn field(&self) -> S {
        self.f.clone()
    }

    /// Number of unknowns.
    pub(super) fn components(&self) -> usize {
        self.components
    }

    /// True if a node takes part.
    pub(super) fn takes_part(&self, a: usize) -> bool {
        self.needed[a]
    }

    /// All coefficients of a node that are computed; one for a constant.
    pub(super) fn series(&self, a: usize) -> &[S::Element] {
        &self.values[a]
    }

    /// True if a node depends on no unknown.
    pub(crate) fn is_known(&self, a: usize) -> bool {
        self.known[a]
    }

    /// Value of a node at order 0.
    pub(crate) fn start(&self, a: usize) -> S::Element {
        self.value(a, 0)
    }

    /// True if any node that takes part depends on the time explicitly.
    pub(crate) fn depends_on_time(&self) -> bool {
        let is_time = |s: usize| matches!(self.signals[s], Signal::Time { .. });
        self.dag
            .ops
            .iter()
            .zip(&self.needed)
            .any(|(op, needed)| *needed && matches!(*op, Op::Slot(s) if is_time(s)))
    }

    /// True if the system is at rest: every rate is zero and every signal constant.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.dag.ops.iter().zip(&self.needed).all(|(op, needed)| match *op {
            Op::Slot(s) if *needed => match self.signals[s] {
                Signal::State { rate } => self.f.is_zero(&self.start(rate)),
                Signal::Constant { .. } => true,
                Signal::Known { degree, .. } => degree == Some(0),
                Signal::Unknown { count, .. } => count == 1,
                Signal::Time { .. } => false,
            },
            _ => true,
        })
    }

    /// Adds `factor * dual(a, j)` to the sums.
    fn gather(&self, sums: &mut [S::Sum], pending: &mut usize, a: usize, j: usize, factor: &S::Element) {
        let row = self.dual(a, j);
        if !row.is_empty() && *factor != self.f.zero() {
            self.f.gather(sums, pending, factor, &self.support[a], row);
        }
    }
}
