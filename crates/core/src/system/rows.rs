//! Any system as a source of derivative rows: the dual components of the Taylor coefficients of its outputs.

mod by_output;
mod generic;
pub(crate) mod layout;
pub(crate) mod point;
pub(crate) mod run;

use obsdeg_exact::{RankMargin, RowSpace, SplitMix64};

use super::branches::{Signs, sided};
use super::model::compiled::{Compiled, CompiledSegment};
use super::model::{StartTime, SystemModel};
use super::taylor::Singular;
use super::values::Values;
use super::work::{Work, WorkStep, product};
use crate::degree::rows::DerivativeRows;
use layout::{Layout, Unknown};
use point::{PointBuilder, SharedValues};
use run::{EndCondition, RunRows, cost_of, rows_of};

pub use by_output::PointRows;

/// Rows of a system at one random point of one field.
#[derive(Debug, Clone)]
pub(crate) struct SystemRows<'a, S: Values> {
    field: S,
    components: usize,
    runs: Vec<RunRows<'a, S>>,
    bound: usize,
    /// Work of the points that were tried, and of all rows so far.
    work: &'a Work,
    /// Margin of the ranks at generic points.
    gap: RankMargin,
}

/// Number of points drawn until one is on the required side.
const SIDES: usize = 200;

/// Additional runs at a point, beyond one for each segment and experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct AdditionalRuns {
    /// Number of runs from the same start with other values of the generic inputs.
    others: usize,
    /// True if every output is followed to the end of its own rows.
    apart: bool,
}

impl<'a, S: Values> SystemRows<'a, S> {
    /// Rows of a system at a random point.
    ///
    /// # Errors
    /// [`Singular`] if no point was found, or if `work` refused to continue.
    pub(crate) fn new(
        model: &SystemModel,
        compiled: &'a Compiled,
        layout: &Layout,
        field: S,
        rng: &mut SplitMix64,
        work: &'a Work,
    ) -> Result<Self, Singular> {
        let builder = PointBuilder { model, compiled, layout, field, work };
        Self::drawn(&builder, work, rng, AdditionalRuns::default())
    }

    /// Rows of a system at a random point, then of `others` runs from the same start with other values of
    /// the generic inputs: the first with zeros, the others with random constants.
    ///
    /// # Errors
    /// [`Singular`], as for [`Self::new`].
    pub(super) fn with_inputs(
        model: &SystemModel,
        compiled: &'a Compiled,
        layout: &Layout,
        field: S,
        (rng, others): (&mut SplitMix64, usize),
        work: &'a Work,
    ) -> Result<Self, Singular> {
        let builder = PointBuilder { model, compiled, layout, field, work };
        Self::drawn(&builder, work, rng, AdditionalRuns { others, apart: false })
    }

    fn drawn(
        builder: &PointBuilder<'a, '_, S>,
        work: &'a Work,
        rng: &mut SplitMix64,
        followed: AdditionalRuns,
    ) -> Result<Self, Singular> {
        let (compiled, layout) = (builder.compiled, builder.layout);
        let mut last = Singular::Division(0);
        let (mut attempt, mut tries, mut elsewhere) = (0, 0, None);
        while attempt < S::ATTEMPTS {
            match Self::at(builder, work, (rng, followed), attempt) {
                Err(singular) if singular != Singular::Refused => {
                    last = singular;
                    attempt += 1;
                }
                Ok(rows) if tries < SIDES && !rows.is_on_side(compiled, layout) => {
                    elsewhere = Some(rows);
                    tries += 1;
                }
                Err(Singular::Refused) if elsewhere.is_some() => break,
                found => return found,
            }
        }
        elsewhere.ok_or(last)
    }

    /// True if the arguments of abs and sign have the signs that the layout requires.
    fn is_on_side(&self, compiled: &Compiled, layout: &Layout) -> bool {
        layout.sides.as_ref().is_none_or(|sides| *sides == self.signs(&sided(compiled)))
    }

    fn at(
        builder: &PointBuilder<'a, '_, S>,
        work: &'a Work,
        (rng, followed): (&mut SplitMix64, AdditionalRuns),
        attempt: usize,
    ) -> Result<Self, Singular> {
        let (model, compiled, f) = (builder.model, builder.compiled, &builder.field);
        let components = builder.layout.unknowns.len();
        let parameters = model.parameters.iter().map(|_| f.random(rng, attempt)).collect();
        let constants = model.constants.iter().map(|_| f.random(rng, attempt)).collect();
        let time = match model.time {
            StartTime::Zero => f.zero(),
            StartTime::At { mantissa, decimals } => f.number(mantissa, decimals),
            StartTime::Generic => f.random(rng, attempt),
        };
        let mut shared = SharedValues::<S> { parameters, constants, time };
        let whole = [CompiledSegment::default()];
        let segments = if compiled.segments.is_empty() { &whole[..] } else { &compiled.segments };
        let (mut runs, mut gap): (Vec<RunRows<'a, S>>, RankMargin) = (Vec::new(), RankMargin::OPEN);
        for experiment in 0..model.experiments.max(1) {
            let mut start = builder.start(experiment, &mut shared, rng, attempt)?;
            for (number, segment) in segments.iter().enumerate() {
                builder.enter(&mut start, (number, segment), rng)?;
                runs.push(builder.run(&start, number, followed.apart, rng, &mut gap)?);
                for number in 0..followed.others {
                    let other = start.point.with_constant_inputs(|| match number {
                        0 => f.zero(),
                        _ => f.random(rng, attempt),
                    });
                    let taylor = builder.series(&other, components)?;
                    runs.push(RunRows { taylor, ..runs[0].clone() });
                }
            }
        }
        Ok(Self { field: f.clone(), components, runs, bound: builder.layout.bound, work, gap })
    }

    /// Gradients of the combinations at the start of the first run.
    pub(crate) fn combinations(&self) -> &[Vec<S::Element>] {
        self.runs.first().map_or(&[], |r| &r.combinations)
    }

    /// Signs of some nodes at the start of every run in which they occur.
    pub(crate) fn signs(&self, nodes: &[usize]) -> Signs {
        let sign = |run: &RunRows<'_, S>, node: usize| {
            let taylor = &run.taylor;
            taylor.takes_part(node).then(|| self.field.is_positive(&taylor.start(node))).flatten()
        };
        nodes.iter().map(|&node| self.runs.iter().map(|run| sign(run, node)).collect()).collect()
    }

    /// Margin of the ranks of single runs.
    pub(crate) fn gap(&self) -> RankMargin {
        self.runs.iter().fold(self.gap, |gap, run| gap.and(run.own.gap()))
    }

    /// True if every run starts at a generic point.
    pub(crate) fn is_generic(&self) -> bool {
        self.runs.iter().all(|r| r.end == EndCondition::Stagnation)
    }

    /// True if the end of every run is proven, as far as its orders were requested.
    pub(crate) fn is_done(&self) -> bool {
        self.runs.iter().all(|r| r.done)
    }

    /// Derivative of the given order of a node at the start of the first run.
    pub(crate) fn derivative(&mut self, node: usize, order: usize) -> S::Element {
        let f = self.field.clone();
        let Some(run) = self.runs.first_mut() else { return f.zero() };
        let value = match &mut run.adjoint {
            Some(adjoint) => adjoint.values_to(order).value(node, order),
            None => {
                while run.taylor.length <= order {
                    run.taylor.advance();
                }
                run.taylor.value(node, order)
            }
        };
        (1..=order).fold(value, |x, k| f.mul(&x, &f.integer(k as i64)))
    }

    /// Taylor coefficient of a node at the start of a run.
    pub(super) fn coefficient(&mut self, run: usize, node: usize, order: usize) -> S::Element {
        let taylor = &mut self.runs[run].taylor;
        while taylor.length <= order {
            taylor.advance();
        }
        // a node that occurs only in a jump takes no part in the run
        match order {
            0 => taylor.start_of(node).unwrap_or(self.field.zero()),
            _ => taylor.value(node, order),
        }
    }

    /// True if a node depends on no unknown in a run.
    pub(super) fn is_known(&self, run: usize, node: usize) -> bool {
        self.runs[run].taylor.is_known(node)
    }

    /// Value of every unknown at this point (of inputs the Taylor coefficients), then of derivatives of some
    /// nodes that were computed (in the first segment), zero without a node.
    pub(crate) fn values(
        &self,
        compiled: &Compiled,
        layout: &Layout,
        nodes: &[Option<(usize, usize)>],
    ) -> Vec<S::Element> {
        let segments = compiled.segments.len().max(1);
        let value = |u: &Unknown| {
            let run = self.runs.get(u.experiment.unwrap_or(0) * segments)?;
            Some(run.taylor.value(compiled.node_of(u.role)?, u.derivative))
        };
        let of_node = |node: &Option<(usize, usize)>| {
            let (node, order) = (*node)?;
            let value = self.runs.first()?.taylor.value(node, order);
            Some((2..=order).fold(value, |x, k| self.field.mul(&x, &self.field.integer(k as i64))))
        };
        let unknowns = layout.unknowns.iter().map(value);
        unknowns.chain(nodes.iter().map(of_node)).map(|x| x.unwrap_or(self.field.zero())).collect()
    }
}

impl<S: Values> DerivativeRows for SystemRows<'_, S> {
    type Field = S;

    fn field(&self) -> S {
        self.field.clone()
    }

    fn columns(&self) -> usize {
        self.components
    }

    fn emit(&mut self, order: usize, sink: &mut dyn FnMut(&[S::Element]) -> bool) -> bool {
        if order > self.bound || self.is_done() {
            return false;
        }
        let single = self.runs.len() == 1;
        for run in self.runs.iter_mut().filter(|r| !r.done) {
            let sweeps = run.adjoint.as_ref().map(|a| a.sweeps(order));
            if !self.work.spend(order, &cost_of(&run.taylor, sweeps, run.outputs.len())) {
                return false;
            }
            let (mut grew, before) = (false, run.own.refined());
            // a constraint is an output that is known at the start only
            for row in run.known.iter().filter(|_| order == 0) {
                sink(row);
                run.own.insert(row);
            }
            for row in rows_of(&mut run.taylor, run.adjoint.as_mut(), run.outputs, order) {
                let new = sink(&row);
                // runs that share the rank are each followed until their own rank stalls
                grew |=
                    if single && run.end == EndCondition::Stagnation { new } else { run.own.insert(&row) };
            }
            let again = (run.own.refined() - before).saturating_mul(product::<S::Element>());
            if self.work.take(WorkStep::Derivatives(order), again, 0).is_err() {
                return false;
            }
            run.done = run.end.is_reached(0, order, grew, run.own.rank());
        }
        true
    }
}
