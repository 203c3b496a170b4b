//! Ranks of the rows of a run at a generic point.

use obsdeg_exact::{RankMargin, RowSpace, SplitMix64};

use super::super::adjoint::Adjoint;
use super::super::model::compiled::Role;
use super::super::taylor::{Signal, Singular, Taylor};
use super::super::values::Values;
use super::super::work::{WorkStep, product};
use super::point::{Point, PointBuilder};
use super::run::{Rows, cost_of, rows_of};

/// Spans of the rows of a run at a generic point, one per group of outputs.
struct GenericSpans<S: Values> {
    /// Rows by the unknowns and by the states of the run.
    whole: Vec<S::Space>,
    /// Rows by the unknowns, directly and through the states of the run.
    seen: Vec<S::Space>,
}

impl<S: Values> GenericSpans<S> {
    fn new(field: &S, unknowns: usize, components: usize, groups: usize) -> Self {
        Self {
            whole: vec![S::Space::new(field.clone(), components); groups],
            seen: vec![S::Space::new(field.clone(), unknowns); groups],
        }
    }

    /// Number of products so far for recomputed rows of all spans.
    fn refined(&self) -> u64 {
        let refined = |spaces: &[S::Space]| spaces.iter().map(RowSpace::refined).sum::<u64>();
        refined(&self.whole) + refined(&self.seen)
    }

    /// Margin of the rank decisions.
    fn gap(&self) -> RankMargin {
        self.whole.iter().chain(&self.seen).fold(RankMargin::OPEN, |gap, space| gap.and(space.gap()))
    }
}

impl<'a, S: Values> PointBuilder<'a, '_, S> {
    /// Upper bounds on the ranks of a run's rows, of all outputs together or (`apart`) of each. They are the
    /// ranks at a generic point, where every state is an unknown, the time is arbitrary, and the first order
    /// that adds nothing is the last, multiplied by the derivatives of the run's states by the unknowns. A
    /// minor that is not zero at the run's own point is not zero there either. Constraints that the motion
    /// keeps hold at that point too.
    pub(super) fn generic_ranks(
        &self,
        point: &Point<S>,
        known: &[Vec<S::Element>],
        apart: bool,
        rng: &mut SplitMix64,
    ) -> Option<(Vec<usize>, RankMargin)> {
        let unknowns = self.layout.unknowns.len();
        let groups = if apart { self.compiled.outputs(point.experiment).len() } else { 1 };
        let states: Vec<usize> =
            (0..self.model.states.len()).filter_map(|i| self.slot_of(Role::State(i))).collect();
        let components = unknowns + states.len();
        for attempt in 0..S::ATTEMPTS {
            let drawn = self.generic_point(point, &states, rng, attempt);
            let found =
                self.on_constraints(point, drawn, components, rng, attempt).and_then(|(generic, rows)| {
                    let taylor = self.series(&generic, components)?;
                    Ok((taylor, generic, rows))
                });
            let (taylor, generic, kept) = match found {
                Ok(found) => found,
                Err(Singular::Refused) => return None,
                Err(_) => continue,
            };
            let adjoint = self.adjoint(&generic, components);
            let mut spans = GenericSpans::new(&self.field, unknowns, components, groups);
            for row in &kept {
                spans.whole.iter_mut().for_each(|space| _ = space.insert(row));
                let row = self.through_states(row, point, &states);
                spans.seen.iter_mut().for_each(|space| _ = space.insert(&row));
            }
            for row in known.iter().filter(|_| kept.is_empty()) {
                spans.seen.iter_mut().for_each(|space| _ = space.insert(row));
            }
            self.fill(&mut spans, (taylor, adjoint), point, &states)?;
            return Some((spans.seen.iter().map(RowSpace::rank).collect(), spans.gap()));
        }
        None
    }

    /// A generic point where the constraints hold, with their differentials, if the motion keeps them: there
    /// the first order that adds nothing to these is the last. It has to be on the same part of their
    /// solutions as the start of the run: it is this start if no start is given, or another one where the
    /// constraints have a single solution. Otherwise the point `drawn` itself, without any.
    fn on_constraints(
        &self,
        start: &Point<S>,
        drawn: Point<S>,
        components: usize,
        rng: &mut SplitMix64,
        attempt: usize,
    ) -> Result<(Point<S>, Rows<S>), Singular> {
        let mut held = drawn.clone();
        let rows = if self.compiled.kept.is_empty() {
            None
        } else if self.compiled.starts.iter().all(Option::is_none) {
            for (signal, own) in held.signals.iter_mut().zip(&start.signals) {
                if matches!(own, Signal::Constant { .. }) {
                    *signal = own.clone();
                }
            }
            for (state, own) in held.initial.iter_mut().zip(&start.initial) {
                if let (Some(state), Some(own)) = (state, own) {
                    state.0 = own.0;
                }
            }
            let (rows, kept) = self.constraints(&held, components)?;
            kept.then_some(rows)
        } else if self.compiled.kept_is_graph {
            self.hold_kept(&mut held, components, rng, attempt)?
        } else {
            None
        };
        Ok(rows.map_or((drawn, Vec::new()), |rows| (held, rows)))
    }

    /// The point with random values instead of all that are unknown or change, and the states in the slots
    /// `states` as further unknowns.
    fn generic_point(
        &self,
        point: &Point<S>,
        states: &[usize],
        rng: &mut SplitMix64,
        attempt: usize,
    ) -> Point<S> {
        let (f, unknowns) = (&self.field, self.layout.unknowns.len());
        let mut generic = Point {
            signals: point.signals.clone(),
            initial: point.initial.clone(),
            seed: rng.next_u64(),
            experiment: point.experiment,
        };
        for (k, &slot) in states.iter().enumerate() {
            generic.initial[slot] = Some((f.random(rng, attempt), vec![(unknowns + k, f.one())]));
        }
        for signal in &mut generic.signals {
            match signal {
                Signal::Time { value } | Signal::Known { value, .. } | Signal::Unknown { value, .. } => {
                    *value = f.random(rng, attempt);
                }
                Signal::Constant { value, component: Some(_) } => *value = f.random(rng, attempt),
                _ => {}
            }
        }
        generic
    }

    /// Adds the rows at a generic point to their spans, order by order, until an order adds nothing. `point`
    /// has the derivatives of the states by the unknowns. `None` if `work` refused the rows.
    fn fill(
        &self,
        spans: &mut GenericSpans<S>,
        (mut taylor, mut adjoint): (Taylor<'a, S>, Option<Adjoint<'a, S>>),
        point: &Point<S>,
        states: &[usize],
    ) -> Option<()> {
        let outputs = self.compiled.outputs(point.experiment);
        let groups = spans.whole.len();
        for order in 0..=self.layout.unknowns.len() + states.len() {
            let sweeps = adjoint.as_ref().map(|a| a.sweeps(order));
            if !self.work.spend(order, &cost_of(&taylor, sweeps, outputs.len())) {
                return None;
            }
            let mut grew = false;
            let before = spans.refined();
            for (i, row) in rows_of(&mut taylor, adjoint.as_mut(), outputs, order).into_iter().enumerate() {
                let group = i.min(groups - 1);
                grew |= spans.whole[group].insert(&row);
                spans.seen[group].insert(&self.through_states(&row, point, states));
            }
            let again = spans.refined() - before;
            self.work
                .take(WorkStep::Derivatives(order), again.saturating_mul(product::<S::Element>()), 0)
                .ok()?;
            if !grew {
                break;
            }
        }
        Some(())
    }

    /// Derivatives by the unknowns themselves, and through the states.
    fn through_states(&self, row: &[S::Element], point: &Point<S>, states: &[usize]) -> Vec<S::Element> {
        let (f, unknowns) = (&self.field, self.layout.unknowns.len());
        let mut through = row[..unknowns].to_vec();
        for (x, &slot) in row[unknowns..].iter().zip(states) {
            for (component, d) in point.initial[slot].iter().flat_map(|s| &s.1) {
                through[*component] = f.add(&through[*component], &f.mul(x, d));
            }
        }
        through
    }
}
