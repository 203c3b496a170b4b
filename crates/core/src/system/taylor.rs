//! Taylor series of all nodes in time, coefficient by coefficient, with the derivative by every unknown (one
//! dual component each), in any field.
//!
//! A node has dual components only for unknowns that it can depend on. The weight of a function has none: for
//! `dF = weight du` its values suffice. Orders are kept only if a later order needs them, as factors of a
//! product of two changing nodes.

use std::collections::HashMap;
use std::sync::Arc;

use obsdeg_exact::{SplitMix64, interrupt};

use super::constraints::below;
use super::dag::{Dag, Op};
use super::values::{ConstraintFailure, Values};
use super::work::{PER_NODE, Refused, Work, WorkStep, operations_of, product};
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

impl<'a, S: Values> Taylor<'a, S> {
    /// Series at order 0 of the nodes `roots` and all nodes that they depend on. `initial` gives every
    /// state's start (by slot). Rates take part if `moving`. Without components the series have values alone.
    ///
    /// # Errors
    /// [`Singular`] if the point has no series, or if its values and gradients exceed the limit of `work`.
    #[allow(clippy::too_many_arguments, reason = "all of a run")]
    pub(crate) fn new(
        dag: &'a Dag,
        f: S,
        components: usize,
        signals: Vec<Signal<S::Element>>,
        initial: &[Option<Initial<S::Element>>],
        roots: &[usize],
        moving: bool,
        rng: SplitMix64,
        work: &Work,
    ) -> Result<Self, Singular> {
        let n = dag.ops.len();
        let mut out = Self {
            dag,
            components,
            signals,
            rng,
            needed: vec![false; n],
            differentiated: vec![false; n],
            constant: vec![false; n],
            known: vec![false; n],
            kept: vec![false; n],
            support: Vec::new(),
            values: vec![Vec::new(); n],
            duals: vec![Vec::new(); n],
            inverses: vec![f.zero()],
            length: 0,
            sums: vec![f.no_sum(); components],
            f,
        };
        out.classify();
        out.need(roots, moving);
        out.start_values(initial, work)?;
        out.find_support(initial, moving, work)?;
        let gradients = (0..n).filter(|&i| out.differentiated[i] && !out.known[i]);
        let numbers: u64 = gradients.map(|i| out.support[i].len() as u64).sum();
        let bytes = numbers.saturating_mul(size_of::<S::Element>() as u64);
        work.take(WorkStep::Gradients, numbers.saturating_mul(2 * product::<S::Element>()), bytes)?;
        out.start_duals(initial)?;
        out.length = 1;
        Ok(out)
    }

    /// Marks nodes that are constant or known; functions are like their arguments.
    fn classify(&mut self) {
        for (i, op) in self.dag.ops.iter().enumerate() {
            let (constant, known) = match *op {
                Op::Number { .. } | Op::Pi => (true, true),
                Op::Slot(s) => match &self.signals[s] {
                    Signal::State { .. } => (false, false),
                    Signal::Constant { component, .. } => (true, component.is_none()),
                    Signal::Known { degree, .. } => (*degree == Some(0), true),
                    Signal::Unknown { count, .. } => (*count == 1, false),
                    Signal::Time { .. } => (false, true),
                },
                Op::Add(a, b) | Op::Subtract(a, b) | Op::Multiply(a, b) | Op::Divide(a, b) => {
                    (self.constant[a] && self.constant[b], self.known[a] && self.known[b])
                }
                Op::Primitive { of, .. } => (self.constant[of], self.known[of]),
            };
            (self.constant[i], self.known[i]) = (constant, known);
        }
    }

    /// Operands of a node; the rate of a state if `moving`; the argument of a function.
    fn operands(&self, i: usize, moving: bool) -> impl Iterator<Item = usize> {
        let both = match self.dag.ops[i] {
            Op::Number { .. } | Op::Pi => [None; 2],
            Op::Slot(s) => match self.signals[s] {
                Signal::State { rate } if moving => [Some(rate), None],
                _ => [None; 2],
            },
            Op::Add(a, b) | Op::Subtract(a, b) | Op::Multiply(a, b) | Op::Divide(a, b) => [Some(a), Some(b)],
            Op::Primitive { of, .. } => [Some(of), None],
        };
        both.into_iter().flatten()
    }

    /// Marks the nodes that take part. The derivative of a function of known constants is not used: at the
    /// ends of its domain it need not exist.
    fn need(&mut self, roots: &[usize], moving: bool) {
        let mut left = roots.to_vec();
        while let Some(i) = left.pop() {
            if std::mem::replace(&mut self.needed[i], true) {
                continue;
            }
            left.extend(self.operands(i, moving));
            if let Op::Primitive { of, weight, .. } = self.dag.ops[i]
                && !(self.constant[of] && self.known[of])
            {
                left.push(weight);
            }
        }
        left.extend(roots);
        while let Some(i) = left.pop() {
            if !std::mem::replace(&mut self.differentiated[i], true) {
                left.extend(self.operands(i, moving));
            }
        }
        for i in (0..self.dag.ops.len()).filter(|&i| self.differentiated[i]) {
            match self.dag.ops[i] {
                Op::Multiply(a, b) if !self.constant[a] && !self.constant[b] => {
                    (self.kept[a], self.kept[b]) = (true, true);
                }
                Op::Divide(_, b) if !self.constant[b] => (self.kept[i], self.kept[b]) = (true, true),
                Op::Primitive { of, .. } if !self.constant[of] => self.kept[of] = true,
                _ => {}
            }
        }
    }

    fn start_values(&mut self, initial: &[Option<Initial<S::Element>>], work: &Work) -> Result<(), Singular> {
        work.take(WorkStep::Points, PER_NODE * self.dag.ops.len() as u64, 0)?;
        for (i, op) in self.dag.ops.iter().enumerate() {
            // the content of a slot is needed even if nothing uses it
            let x = match *op {
                Op::Slot(s) => match &self.signals[s] {
                    Signal::State { .. } => initial[s].as_ref().map_or(self.f.zero(), |x| x.0),
                    Signal::Constant { value, .. }
                    | Signal::Known { value, .. }
                    | Signal::Unknown { value, .. }
                    | Signal::Time { value } => *value,
                },
                op if self.needed[i] => {
                    work.take(WorkStep::Points, operations_of::<S::Element>(op), 0)?;
                    self.start_value(i)?
                }
                _ => continue,
            };
            self.values[i].push(x);
        }
        Ok(())
    }

    /// Start value of an operation from those of its operands.
    fn start_value(&self, i: usize) -> Result<S::Element, Singular> {
        let f = &self.f;
        let value = |a: usize| &self.values[a][0];
        Ok(match self.dag.ops[i] {
            Op::Number { mantissa, decimals } => f.number(mantissa, decimals),
            Op::Pi => f.pi(),
            Op::Slot(_) => self.start(i),
            Op::Add(a, b) => f.add(value(a), value(b)),
            Op::Subtract(a, b) => f.sub(value(a), value(b)),
            Op::Multiply(a, b) => f.mul(value(a), value(b)),
            Op::Divide(a, b) => {
                let inverse = f.inverse(value(b)).ok_or(Singular::Division(i))?;
                f.mul(value(a), &inverse)
            }
            Op::Primitive { function, of, .. } => {
                let argument = value(of);
                // zero where the function has no derivative
                let edge = match function {
                    Function::Abs | Function::Sign | Function::Sqrt => Some(*argument),
                    Function::Asin | Function::Acos => Some(f.sub(&f.one(), &f.mul(argument, argument))),
                    _ => None,
                };
                if edge.is_some_and(|x| f.is_zero(&x)) && !(self.constant[of] && self.known[of]) {
                    return Err(Singular::Kink(i, function));
                }
                f.function(function, argument).ok_or(Singular::Domain(i, function))?
            }
        })
    }

    /// Start value of a node that may not take part.
    pub(crate) fn start_of(&mut self, node: usize) -> Result<S::Element, Singular> {
        for i in below(self.dag, node) {
            if self.values[i].is_empty() {
                let x = self.start_value(i)?;
                self.values[i].push(x);
            }
        }
        Ok(self.start(node))
    }

    /// Dual components of the unknowns that each node can depend on, at any order.
    fn find_support(
        &mut self,
        initial: &[Option<Initial<S::Element>>],
        moving: bool,
        work: &Work,
    ) -> Result<(), Singular> {
        let n = self.dag.ops.len();
        if self.components == 0 {
            self.support = vec![Arc::from([]); n];
            return Ok(());
        }
        let words = self.components.div_ceil(64);
        let (operations, bytes) = (2 * n as u64 * words as u64, 8 * n as u64 * words as u64);
        let mut sets = self.components_of_slots(initial, words);
        // add components of operands until nothing is added
        loop {
            work.take(WorkStep::Gradients, operations, bytes)?;
            if !self.add_components_of_operands(&mut sets, words, moving) {
                break;
            }
        }
        let mut lists: HashMap<&[u64], Arc<[u32]>> = HashMap::new();
        self.support = sets
            .chunks(words.max(1))
            .map(|set| {
                let list = || {
                    let components =
                        (0..self.components as u32).filter(|l| set[*l as usize / 64] >> (l % 64) & 1 == 1);
                    components.collect()
                };
                Arc::clone(lists.entry(set).or_insert_with(list))
            })
            .collect();
        self.support.resize(n, Arc::from([]));
        Ok(())
    }

    /// Components of the content of each slot, as a set of `words` words of 64 bits per node; empty for other
    /// nodes.
    fn components_of_slots(&self, initial: &[Option<Initial<S::Element>>], words: usize) -> Vec<u64> {
        let mut sets = vec![0u64; self.dag.ops.len() * words];
        let mut own = |i: usize, component: usize| sets[i * words + component / 64] |= 1 << (component % 64);
        for (i, op) in self.dag.ops.iter().enumerate().filter(|(i, _)| self.needed[*i]) {
            let Op::Slot(s) = *op else { continue };
            match &self.signals[s] {
                Signal::State { .. } => {
                    initial[s].iter().flat_map(|x| &x.1).for_each(|(component, _)| own(i, *component));
                }
                Signal::Constant { component: Some(component), .. } => own(i, *component),
                Signal::Unknown { component, count, .. } => {
                    (*component..component + count).for_each(|component| own(i, component))
                }
                _ => {}
            }
        }
        sets
    }

    /// Adds to the set of each node those of its operands, node by node. True if any set grew.
    fn add_components_of_operands(&self, sets: &mut [u64], words: usize, moving: bool) -> bool {
        let mut grew = false;
        for i in (0..self.dag.ops.len()).filter(|&i| self.needed[i]) {
            let parts = match self.dag.ops[i] {
                Op::Number { .. } | Op::Pi => continue,
                Op::Slot(s) => match self.signals[s] {
                    Signal::State { rate } if moving => [rate, rate],
                    _ => continue,
                },
                Op::Add(a, b) | Op::Subtract(a, b) | Op::Multiply(a, b) | Op::Divide(a, b) => [a, b],
                Op::Primitive { of, .. } => [of, of],
            };
            for part in parts {
                for w in 0..words {
                    let new = sets[part * words + w] & !sets[i * words + w];
                    sets[i * words + w] |= new;
                    grew |= new != 0;
                }
            }
        }
        grew
    }

    fn start_duals(&mut self, initial: &[Option<Initial<S::Element>>]) -> Result<(), Singular> {
        let f = self.f.clone();
        for i in 0..self.dag.ops.len() {
            if self.known[i] || !self.differentiated[i] || self.components == 0 {
                continue;
            }
            let mut sums = std::mem::take(&mut self.sums);
            let mut pending = 0;
            let mut own: Vec<(usize, S::Element)> = Vec::new();
            {
                let mut add =
                    |a: usize, factor: &S::Element| self.gather(&mut sums, &mut pending, a, 0, factor);
                let value = |a: usize| &self.values[a][0];
                match self.dag.ops[i] {
                    Op::Number { .. } | Op::Pi => {}
                    Op::Slot(s) => match &self.signals[s] {
                        Signal::State { .. } => own.extend(initial[s].iter().flat_map(|x| &x.1).copied()),
                        Signal::Constant { component: Some(component), .. }
                        | Signal::Unknown { component, .. } => {
                            own.push((*component, f.one()));
                        }
                        _ => {}
                    },
                    Op::Add(a, b) => {
                        add(a, &f.one());
                        add(b, &f.one());
                    }
                    Op::Subtract(a, b) => {
                        add(a, &f.one());
                        add(b, &f.neg(&f.one()));
                    }
                    Op::Multiply(a, b) => {
                        add(a, value(b));
                        add(b, value(a));
                    }
                    Op::Divide(a, b) => {
                        let inverse = f.inverse(value(b)).ok_or(Singular::Division(i))?;
                        add(a, &inverse);
                        add(b, &f.neg(&f.mul(value(i), &inverse)));
                    }
                    Op::Primitive { of, weight, .. } => add(of, value(weight)),
                }
            }
            self.store(i, 0, &mut sums, None, &own);
            self.sums = sums;
        }
        Ok(())
    }

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

    /// Products and sums of the next order, by components: those independent of the order, and those for each
    /// order before it; then the number of nodes that take part, and of products of two series among them.
    pub(super) fn operations(&self) -> [u64; 4] {
        let mut out = [0u64; 4];
        for (i, op) in self.dag.ops.iter().enumerate().filter(|(i, _)| self.needed[*i]) {
            out[2] += 1;
            if self.constant[i] {
                continue;
            }
            let width = if self.differentiated[i] { self.support[i].len() as u64 + 1 } else { 1 };
            out[0] += width;
            let product = match *op {
                Op::Multiply(a, b) => !self.constant[a] && !self.constant[b],
                Op::Divide(_, b) => !self.constant[b],
                Op::Primitive { .. } => true,
                _ => false,
            };
            if product {
                out[1] += 2 * width;
                out[3] += 1;
            }
        }
        out
    }

    /// Computes the coefficient of the next order of all nodes.
    pub(crate) fn advance(&mut self) {
        let k = self.length;
        self.inverse(k);
        for i in 0..self.dag.ops.len() {
            if i % 64 == 0 {
                interrupt::check();
            }
            if self.needed[i] && !self.constant[i] {
                let x = self.next_value(i, k);
                self.values[i].push(x);
            }
        }
        for i in 0..if self.components == 0 { 0 } else { self.dag.ops.len() } {
            if self.differentiated[i] && !self.constant[i] && !self.known[i] {
                interrupt::check();
                self.next_dual(i, k);
            }
        }
        self.length += 1;
    }

    fn next_value(&mut self, i: usize, k: usize) -> S::Element {
        let f = &self.f;
        let of = |a: usize, j: usize| self.value(a, j);
        match self.dag.ops[i] {
            Op::Number { .. } | Op::Pi => f.zero(),
            Op::Slot(s) => match self.signals[s] {
                Signal::State { rate } => f.mul(&of(rate, k - 1), &self.inverses[k]),
                Signal::Constant { .. } => f.zero(),
                Signal::Known { degree, .. } if degree.is_some_and(|d| k > d) => f.zero(),
                Signal::Unknown { count, .. } if k >= count => f.zero(),
                Signal::Known { .. } | Signal::Unknown { .. } => f.coefficient(&mut self.rng),
                Signal::Time { .. } if k == 1 => f.one(),
                Signal::Time { .. } => f.zero(),
            },
            Op::Add(a, b) => f.add(&of(a, k), &of(b, k)),
            Op::Subtract(a, b) => f.sub(&of(a, k), &of(b, k)),
            Op::Multiply(a, b) => {
                let (a, b) = if self.constant[b] { (b, a) } else { (a, b) };
                if self.constant[a] {
                    return f.mul(&of(a, 0), &of(b, k));
                }
                f.dot(&f.zero(), (0..=k).map(|j| (&self.values[a][j], &self.values[b][k - j])))
            }
            Op::Divide(a, b) => {
                // c b = a
                let inverse = self.reciprocal(b);
                if self.constant[b] {
                    return f.mul(&of(a, k), &inverse);
                }
                let sum = f.dot(&f.zero(), (0..k).map(|j| (&self.values[i][j], &self.values[b][k - j])));
                f.mul(&f.sub(&of(a, k), &sum), &inverse)
            }
            Op::Primitive { of: u, weight, .. } => {
                // F' = weight u'
                let weights = &self.values[weight];
                let changes: Vec<S::Element> =
                    (1..=k).map(|j| f.mul(&f.integer(j as i64), &of(u, j))).collect();
                let terms = changes.iter().zip((0..k).rev()).filter_map(|(x, j)| Some((x, weights.get(j)?)));
                f.mul(&f.dot(&f.zero(), terms), &self.inverses[k])
            }
        }
    }

    /// Reciprocal of the start of a node, which is not zero: otherwise the series would not exist.
    fn reciprocal(&self, b: usize) -> S::Element {
        self.f.inverse(&self.values[b][0]).unwrap_or(self.f.zero())
    }

    /// Adds `factor * dual(a, j)` to the sums.
    fn gather(&self, sums: &mut [S::Sum], pending: &mut usize, a: usize, j: usize, factor: &S::Element) {
        let row = self.dual(a, j);
        if !row.is_empty() && *factor != self.f.zero() {
            self.f.gather(sums, pending, factor, &self.support[a], row);
        }
    }

    fn next_dual(&mut self, i: usize, k: usize) {
        let f = self.f.clone();
        let mut sums = std::mem::take(&mut self.sums);
        let mut pending = 0;
        let of = |a: usize, j: usize| self.value(a, j);
        let (one, minus) = (f.one(), f.neg(&f.one()));
        let mut own: Option<(usize, S::Element)> = None;
        let mut scale = None;
        match self.dag.ops[i] {
            Op::Number { .. } | Op::Pi => {}
            Op::Slot(s) => match self.signals[s] {
                Signal::State { rate } => {
                    self.gather(&mut sums, &mut pending, rate, k - 1, &self.inverses[k])
                }
                Signal::Unknown { component, count, .. } if k < count => own = Some((component + k, one)),
                _ => {}
            },
            Op::Add(a, b) => {
                self.gather(&mut sums, &mut pending, a, k, &one);
                self.gather(&mut sums, &mut pending, b, k, &one);
            }
            Op::Subtract(a, b) => {
                self.gather(&mut sums, &mut pending, a, k, &one);
                self.gather(&mut sums, &mut pending, b, k, &minus);
            }
            Op::Multiply(a, b) => {
                for (a, b) in [(a, b), (b, a)] {
                    // a_j db_(k-j); a constant has order 0 only
                    let js = if self.constant[a] { 0..=0 } else { 0..=k };
                    for j in js.filter(|j| !self.constant[b] || *j == k) {
                        self.gather(&mut sums, &mut pending, b, k - j, &of(a, j));
                    }
                }
            }
            Op::Divide(a, b) => {
                // dc_k b_0 = da_k - sum_{j<k} dc_j b_(k-j) - sum_j c_j db_(k-j)
                self.gather(&mut sums, &mut pending, a, k, &one);
                if !self.constant[b] {
                    for j in 0..k {
                        self.gather(&mut sums, &mut pending, i, j, &f.neg(&of(b, k - j)));
                        self.gather(&mut sums, &mut pending, b, k - j, &f.neg(&of(i, j)));
                    }
                }
                self.gather(&mut sums, &mut pending, b, 0, &f.neg(&of(i, k)));
                scale = Some(self.reciprocal(b));
            }
            Op::Primitive { of: u, weight, .. } => {
                // dF = weight du
                for j in 0..=k {
                    self.gather(&mut sums, &mut pending, u, j, &of(weight, k - j));
                }
            }
        }
        self.store(i, k, &mut sums, scale.as_ref(), own.as_slice());
        self.sums = sums;
    }
}
