//! Start of the Taylor series of a run: which nodes take part, their values and dual components at order 0.

use std::collections::HashMap;
use std::sync::Arc;

use obsdeg_exact::SplitMix64;

use super::super::constraints::below;
use super::super::dag::{Dag, Op};
use super::super::values::Values;
use super::super::work::{PER_NODE, Work, WorkStep, operations_of, product};
use super::{Initial, Signal, Singular, Taylor};
use crate::language::Function;

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
}
