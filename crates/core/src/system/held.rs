//! Points of any field at which the constraints of a model hold, and the number of independent constraints
//! there.

use std::collections::BTreeSet;

use obsdeg_exact::{RowSpace, SplitMix64};

use super::constraints::slots_of;
use super::model::StateStart;
use super::model::compiled::Role;
use super::rows::point::{Point, PointBuilder};
use super::rows::run::{Rows, dense};
use super::taylor::{Signal, Singular, Taylor};
use super::values::Values;
use super::work::{WorkStep, product};

/// Numbers of bits that random starts near given values share with these, by attempt.
pub(super) const CLOSE: [i64; 3] = [10, 25, 40];

impl<S: Values> PointBuilder<'_, '_, S> {
    /// Changes states, and in the first experiment the shared values, so that the constraints hold.
    pub(super) fn hold_constraints(
        &self,
        point: &mut Point<S>,
        first: bool,
        rng: &mut SplitMix64,
        attempt: usize,
    ) -> Result<(), Singular> {
        let all = self.free(point.experiment);
        // shared values were changed in the first experiment
        let shared = |role: &Role| !matches!(role, Role::State(_));
        let own = all.iter().zip(&self.compiled.roles).map(|(free, role)| *free && (first || !shared(role)));
        self.hold(point, &self.compiled.constraints, (&all, &own.collect::<Vec<_>>()), (rng, attempt))
    }

    /// Changes every state and parameter so that the constraints of the motion hold; their differentials by
    /// the `components` of the point. `None` without constraints, or if the motion does not keep them.
    pub(super) fn hold_kept(
        &self,
        point: &mut Point<S>,
        components: usize,
        rng: &mut SplitMix64,
        attempt: usize,
    ) -> Result<Option<Rows<S>>, Singular> {
        let mut free = self.free(point.experiment);
        for (slot, role) in self.compiled.roles.iter().enumerate() {
            free[slot] |= matches!(role, Role::State(_));
        }
        self.hold(point, &self.compiled.kept, (&free, &free), (rng, attempt))?;
        let (rows, kept) = self.constraints(point, components)?;
        Ok((kept && !rows.is_empty()).then_some(rows))
    }

    /// Changes the `free` slots so that some constraints hold, which are independent in the slots `all`.
    fn hold(
        &self,
        point: &mut Point<S>,
        constraints: &[usize],
        (all, free): (&[bool], &[bool]),
        (rng, attempt): (&mut SplitMix64, usize),
    ) -> Result<(), Singular> {
        let compiled = self.compiled;
        if constraints.is_empty() {
            return Ok(());
        }
        let value = |slot: usize| match (&point.signals[slot], &point.initial[slot]) {
            (Signal::Constant { value, .. }, _) => *value,
            (_, Some(start)) => start.0,
            _ => self.field.zero(),
        };
        let mut values: Vec<S::Element> = (0..compiled.roles.len()).map(value).collect();
        let mut own = SplitMix64::new(rng.next_u64());
        if attempt.is_multiple_of(2) {
            let bits = CLOSE[attempt / 2 % CLOSE.len()];
            self.near_given(point.experiment, free, &mut values, bits, &mut own);
        }
        let distinct = turned(distinct(constraints), attempt);
        let place = |c: usize| constraints.iter().position(|node| *node == distinct[c]).unwrap_or(0);
        let held = self.field.hold(&compiled.dag, &distinct, &mut values, free, &mut own, self.work);
        held.map_err(|reason| reason.of(place))?;
        let independent = self.independent(&distinct, &values, all)?;
        if independent.len() + self.layout.dependent < distinct.len() {
            let dependent = (0..distinct.len()).find(|c| !independent.contains(c)).unwrap_or(0);
            return Err(Singular::Dependent(place(dependent)));
        }
        for (slot, x) in values.into_iter().enumerate() {
            match (&mut point.signals[slot], &mut point.initial[slot]) {
                (Signal::Constant { value, .. }, _) => *value = x,
                (_, Some(start)) => start.0 = x,
                _ => {}
            }
        }
        Ok(())
    }

    /// Slots that constraints can change: states, parameters and generic constants.
    pub(super) fn free(&self, experiment: usize) -> Vec<bool> {
        let free = |role: &Role| match *role {
            Role::State(i) => !matches!(self.model.states[i].start, StateStart::Value(_)),
            Role::Parameter(_) => true,
            Role::Constant(c) => self.compiled.constants(experiment)[c].is_none(),
            Role::KnownInput(_) | Role::UnknownInput(_) | Role::Time => false,
        };
        self.compiled.roles.iter().map(free).collect()
    }

    /// Sets the `free` values that constraints contain close to those that the file gives for a simulation:
    /// they agree in the given number of bits.
    pub(super) fn near_given(
        &self,
        experiment: usize,
        free: &[bool],
        values: &mut [S::Element],
        bits: i64,
        rng: &mut SplitMix64,
    ) {
        let dag = &self.compiled.dag;
        let held: BTreeSet<usize> =
            self.compiled.constraints.iter().flat_map(|&node| slots_of(dag, node)).collect();
        for slot in held.into_iter().filter(|&slot| free[slot]) {
            let given = self.model.given(self.compiled.roles[slot], experiment);
            if let Some(near) = given.and_then(|x| self.field.near(x, bits, rng)) {
                values[slot] = near;
            }
        }
    }

    /// True if the file gives a value that a constraint can change.
    pub(super) fn gives_start(&self) -> bool {
        let free = self.free(0);
        let slots = self.compiled.constraints.iter().flat_map(|&node| slots_of(&self.compiled.dag, node));
        slots.into_iter().any(|s| free[s] && self.model.given(self.compiled.roles[s], 0).is_some())
    }

    /// Constraints that are independent of those before them at a point, by their derivatives in the `free`
    /// slots.
    pub(super) fn independent(
        &self,
        constraints: &[usize],
        values: &[S::Element],
        free: &[bool],
    ) -> Result<Vec<usize>, Singular> {
        let places: Vec<usize> = (0..values.len()).filter(|&s| free[s]).collect();
        let component = |slot: usize| places.iter().position(|place| *place == slot);
        let signal = |(slot, value): (usize, &S::Element)| Signal::Constant {
            value: *value,
            component: component(slot),
        };
        let signals = values.iter().enumerate().map(signal).collect();
        let (starts, seed) = (vec![None; values.len()], SplitMix64::new(0));
        let (dag, f) = (&self.compiled.dag, self.field.clone());
        let at = Taylor::new(dag, f, places.len(), signals, &starts, constraints, false, seed, self.work)?;
        let (rows, columns) = (constraints.len() as u64, places.len() as u64);
        let elimination = rows.saturating_mul(rows).saturating_mul(columns);
        self.work.take(WorkStep::Constraints, elimination.saturating_mul(product::<S::Element>()), 0)?;
        let mut space = S::Space::new(self.field.clone(), places.len());
        let mut out = Vec::new();
        for (c, &node) in constraints.iter().enumerate() {
            if space.insert(&dense(&self.field, places.len(), at.components_of(node), at.dual(node, 0))) {
                out.push(c);
            }
        }
        Ok(out)
    }

    /// Differentials of the constraints by the `components` of the point, and true if their first time
    /// derivatives are zero here. The motion then keeps them, and the point is generic among those where they
    /// hold.
    pub(super) fn constraints(
        &self,
        point: &Point<S>,
        components: usize,
    ) -> Result<(Rows<S>, bool), Singular> {
        let (compiled, f) = (self.compiled, &self.field);
        if compiled.kept.is_empty() {
            return Ok((Vec::new(), true));
        }
        let mut seen = Taylor::new(
            &compiled.dag,
            f.clone(),
            components,
            point.signals.clone(),
            &point.initial,
            &compiled.kept,
            true,
            SplitMix64::new(point.seed),
            self.work,
        )?;
        let row = |&node: &usize| dense(f, components, seen.components_of(node), seen.dual(node, 0));
        let rows = compiled.kept.iter().map(row).collect();
        seen.advance();
        let kept = compiled.kept.iter().all(|&node| f.is_zero(&seen.value(node, 1)));
        Ok((rows, kept))
    }
}

/// Nodes of a list, each once: mirrored entries are one node.
pub(super) fn distinct(nodes: &[usize]) -> Vec<usize> {
    let first = |(i, node): (usize, &usize)| (!nodes[..i].contains(node)).then_some(*node);
    nodes.iter().enumerate().filter_map(first).collect()
}

/// The list rotated so that another entry comes first at each attempt. Newton's steps follow the first
/// constraints with independent gradients. If only others are independent at the point, these must come
/// first.
pub(super) fn turned(mut nodes: Vec<usize>, attempt: usize) -> Vec<usize> {
    let turn = attempt % nodes.len().max(1);
    nodes.rotate_left(turn);
    nodes
}
