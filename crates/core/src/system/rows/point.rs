//! Random points of a system: values at the start of every segment, and the runs from there.

use obsdeg_exact::prime::is_prime;
use obsdeg_exact::{Field, RankMargin, RowSpace, SplitMix64};

use super::super::adjoint::Adjoint;
use super::super::model::compiled::{Compiled, CompiledSegment, Role};
use super::super::model::{KnownInput, StartTime, StateStart, SystemModel};
use super::super::taylor::{Initial, Signal, Singular, Taylor};
use super::super::values::Values;
use super::super::work::{Work, WorkStep};
use super::layout::Layout;
use super::run::{EndCondition, Rows, RunRows, dense};

/// Number of unknowns per output from which rows are computed backwards (`adjoint`): with fewer unknowns
/// there are few orders, and forward computation is faster.
const LONG: usize = 48;

/// Number of unknowns from which rows are always computed backwards, to save memory.
const MANY: usize = 256;

/// Field modulo a random prime `2^60 < p < 2^61`.
pub(crate) fn random_field(rng: &mut SplitMix64) -> Field {
    loop {
        let p = (1 << 60) + rng.below(1 << 60) / 2 * 2 + 1;
        if p < 1 << 61 && is_prime(p) {
            return Field::new(p);
        }
    }
}

/// Values at a point that the runs of one experiment share.
#[derive(Clone)]
pub(in crate::system) struct Point<S: Values> {
    pub(in crate::system) signals: Vec<Signal<S::Element>>,
    pub(in crate::system) initial: Vec<Option<Initial<S::Element>>>,
    pub(in crate::system) seed: u64,
    pub(in crate::system) experiment: usize,
}

impl<S: Values> Point<S> {
    /// The point with generic known inputs replaced by constant values.
    pub(super) fn with_constant_inputs(&self, mut constant: impl FnMut() -> S::Element) -> Self {
        let mut out = self.clone();
        for signal in &mut out.signals {
            if let Signal::Known { value, degree: degree @ None } = signal {
                (*value, *degree) = (constant(), Some(0));
            }
        }
        out
    }
}

/// Values at a point that all experiments share.
pub(super) struct SharedValues<S: Values> {
    pub(super) parameters: Vec<S::Element>,
    pub(super) constants: Vec<S::Element>,
    /// Time at the start of each experiment.
    pub(super) time: S::Element,
}

/// Start of a segment.
pub(super) struct SegmentStart<S: Values> {
    pub(super) point: Point<S>,
    /// Differentials of the constraints at the start of the experiment.
    known: Rows<S>,
    /// True if the point is generic among those where the constraints hold.
    generic: bool,
    time: S::Element,
}

/// Builder of points: model, graph, unknowns, field and work.
pub(in crate::system) struct PointBuilder<'a, 'b, S: Values> {
    pub(in crate::system) model: &'b SystemModel,
    pub(in crate::system) compiled: &'a Compiled,
    pub(in crate::system) layout: &'b Layout,
    pub(in crate::system) field: S,
    pub(in crate::system) work: &'b Work,
}

impl<'a, S: Values> PointBuilder<'a, '_, S> {
    pub(super) fn slot_of(&self, role: Role) -> Option<usize> {
        self.compiled.roles.iter().position(|r| *r == role)
    }

    /// Random values of all slots that are not given. Columns of states are those of the layout, or
    /// consecutive numbers if every state is an unknown.
    fn draw(
        &self,
        experiment: usize,
        (parameters, constants): (&[S::Element], &[S::Element]),
        time: S::Element,
        rng: &mut SplitMix64,
        attempt: usize,
    ) -> Result<Point<S>, Singular> {
        let (f, model) = (&self.field, self.model);
        // each slot searches for its column
        let looks = self.compiled.roles.len().saturating_mul(self.layout.unknowns.len());
        self.work.take(WorkStep::Points, looks as u64, 0)?;
        let mut random = || f.random(rng, attempt);
        let mut signals = Vec::new();
        let mut initial = vec![None; self.compiled.roles.len()];
        for (slot, role) in self.compiled.roles.iter().enumerate() {
            let component = self.layout.index_of(*role, experiment);
            signals.push(match *role {
                Role::State(i) => {
                    initial[slot] = Some((random(), component.map(|l| (l, f.one())).into_iter().collect()));
                    Signal::State { rate: self.compiled.rates(experiment)[i] }
                }
                Role::Parameter(i) => Signal::Constant { value: parameters[i], component },
                Role::Constant(i) => Signal::Constant { value: constants[i], component: None },
                Role::KnownInput(i) => Signal::Known {
                    value: random(),
                    degree: match model.known_input(experiment, i) {
                        KnownInput::Polynomial(d) => Some(*d),
                        _ => None,
                    },
                },
                Role::UnknownInput(i) => Signal::Unknown {
                    value: random(),
                    component: component.unwrap_or(0),
                    count: model.unknown_inputs[i].1.unwrap_or(self.layout.bound) + 1,
                },
                Role::Time => Signal::Time { value: time },
            });
        }
        Ok(Point { signals, initial, seed: rng.next_u64(), experiment })
    }

    /// Values of all slots at a start: given ones, and random ones for the rest. `None` if a given one is
    /// not defined.
    pub(in crate::system) fn values(&self, rng: &mut SplitMix64, attempt: usize) -> Option<Vec<S::Element>> {
        let f = &self.field;
        let random =
            |n: usize, rng: &mut SplitMix64| (0..n).map(|_| f.random(rng, attempt)).collect::<Vec<_>>();
        let (parameters, constants) =
            (random(self.model.parameters.len(), rng), random(self.model.constants.len(), rng));
        let mut point = self.draw(0, (&parameters, &constants), f.random(rng, attempt), rng, attempt).ok()?;
        self.set_constants(&mut point, &given(self.compiled.constants(0)), false).ok()?;
        self.set_states(&mut point, &given(&self.compiled.starts)).ok()?;
        let value = |(signal, start): (&Signal<S::Element>, &Option<Initial<S::Element>>)| match signal {
            Signal::State { .. } => start.as_ref().map_or(f.zero(), |s| s.0),
            Signal::Constant { value, .. }
            | Signal::Known { value, .. }
            | Signal::Unknown { value, .. }
            | Signal::Time { value } => *value,
        };
        Some(point.signals.iter().zip(&point.initial).map(value).collect())
    }

    /// Values and gradients of some nodes at a point, at order 0.
    fn look(&self, point: &Point<S>, nodes: &[usize]) -> Result<Taylor<'a, S>, Singular> {
        Taylor::new(
            &self.compiled.dag,
            self.field.clone(),
            self.layout.unknowns.len(),
            point.signals.clone(),
            &point.initial,
            nodes,
            false,
            SplitMix64::new(point.seed),
            self.work,
        )
    }

    /// Sets constants to the values of their formulas, one after the other: a formula may use constants
    /// before it.
    fn set_constants(
        &self,
        point: &mut Point<S>,
        formulas: &[(usize, usize)],
        at_once: bool,
    ) -> Result<(), Singular> {
        let mut values: Vec<(usize, S::Element)> = Vec::new();
        for &(c, node) in formulas {
            let value = self.look(point, &[node])?.start(node);
            if at_once {
                values.push((c, value));
            } else {
                self.set_constant(point, c, value);
            }
        }
        for (c, value) in values {
            self.set_constant(point, c, value);
        }
        Ok(())
    }

    fn set_constant(&self, point: &mut Point<S>, c: usize, value: S::Element) {
        if let Some(slot) = self.slot_of(Role::Constant(c)) {
            point.signals[slot] = Signal::Constant { value, component: None };
        }
    }

    /// Sets states to the values of their formulas, all at once.
    fn set_states(&self, point: &mut Point<S>, formulas: &[(usize, usize)]) -> Result<(), Singular> {
        if formulas.is_empty() {
            return Ok(());
        }
        let nodes: Vec<usize> = formulas.iter().map(|f| f.1).collect();
        let seen = self.look(point, &nodes)?;
        for &(state, node) in formulas {
            if let Some(slot) = self.slot_of(Role::State(state)) {
                let components = seen.components_of(node).iter().map(|l| *l as usize);
                let duals = components.zip(seen.dual(node, 0).iter().copied());
                point.initial[slot] =
                    Some((seen.start(node), duals.filter(|(_, x)| *x != self.field.zero()).collect()));
            }
        }
        Ok(())
    }

    /// Taylor series of a run.
    pub(super) fn series(&self, point: &Point<S>, components: usize) -> Result<Taylor<'a, S>, Singular> {
        let compiled = self.compiled;
        let roots: Vec<usize> =
            compiled.outputs(point.experiment).iter().chain(&compiled.combinations).copied().collect();
        Taylor::new(
            &compiled.dag,
            self.field.clone(),
            components,
            point.signals.clone(),
            &point.initial,
            &roots,
            true,
            SplitMix64::new(point.seed),
            self.work,
        )
    }

    /// Rows of a run computed backwards; `None` if there are few unknowns.
    pub(super) fn adjoint(&self, point: &Point<S>, components: usize) -> Option<Adjoint<'a, S>> {
        let outputs = self.compiled.outputs(point.experiment).len();
        if components < MANY && components < LONG * outputs {
            None
        } else {
            self.backwards(point, components)
        }
    }

    fn backwards(&self, point: &Point<S>, components: usize) -> Option<Adjoint<'a, S>> {
        let outputs = self.compiled.outputs(point.experiment);
        let (dag, f) = (&self.compiled.dag, self.field.clone());
        let values = self.series(point, 0).ok()?;
        Adjoint::new(dag, f, components, &point.signals, &point.initial, outputs, values)
    }

    /// A run at a random point, computed forwards and backwards.
    #[cfg(test)]
    pub(in crate::system) fn both(&self, rng: &mut SplitMix64) -> (Taylor<'a, S>, Adjoint<'a, S>) {
        let f = &self.field;
        let parameters: Vec<S::Element> = self.model.parameters.iter().map(|_| f.random(rng, 0)).collect();
        let mut point = self.draw(0, (&parameters, &[]), f.zero(), rng, 0).expect("work");
        self.set_states(&mut point, &given(&self.compiled.starts)).expect("starts");
        let components = self.layout.unknowns.len();
        let forward = self.series(&point, components).expect("a point");
        (forward, self.backwards(&point, components).expect("no unknown inputs"))
    }

    /// Random values of an experiment that satisfy the constraints. The parameters and constants of the first
    /// experiment become those of all.
    pub(super) fn start(
        &self,
        experiment: usize,
        shared: &mut SharedValues<S>,
        rng: &mut SplitMix64,
        attempt: usize,
    ) -> Result<SegmentStart<S>, Singular> {
        let compiled = self.compiled;
        let (parameters, constants) = (&shared.parameters, &shared.constants);
        let mut point = self.draw(experiment, (parameters, constants), shared.time, rng, attempt)?;
        self.set_constants(&mut point, &given(compiled.constants(experiment)), false)?;
        self.hold_constraints(&mut point, experiment == 0, rng, attempt)?;
        for (slot, role) in compiled.roles.iter().enumerate() {
            let Signal::Constant { value, .. } = &point.signals[slot] else { continue };
            match *role {
                Role::Parameter(i) => shared.parameters[i] = *value,
                Role::Constant(i) => shared.constants[i] = *value,
                _ => {}
            }
        }
        self.set_states(&mut point, &given(&compiled.starts))?;
        let (known, kept) = self.constraints(&point, self.layout.unknowns.len())?;
        let generic = kept && self.model.states.iter().all(|s| s.start == StateStart::Unknown);
        Ok(SegmentStart { point, known, generic, time: shared.time })
    }

    /// Changes the start of the segment before into that of this one.
    pub(super) fn enter(
        &self,
        start: &mut SegmentStart<S>,
        (number, segment): (usize, &CompiledSegment),
        rng: &mut SplitMix64,
    ) -> Result<(), Singular> {
        let f = &self.field;
        if number > 0
            && let Some(slot) = self.slot_of(Role::Time)
        {
            // the start time of a later segment is not given, but it is later
            let lasts = f.random(rng, 0);
            let lasts = if f.is_positive(&lasts) == Some(false) { f.neg(&lasts) } else { lasts };
            start.time = f.add(&start.time, &lasts);
            start.point.signals[slot] = Signal::Time { value: start.time };
        }
        self.set_constants(&mut start.point, &segment.constants, true)?;
        self.set_states(&mut start.point, &segment.carry)?;
        start.generic &= segment.carry.is_empty();
        Ok(())
    }

    /// Run of a segment, whose outputs are followed `apart` or together. Reduces `gap` to the margin of its
    /// end condition.
    pub(super) fn run(
        &self,
        start: &SegmentStart<S>,
        number: usize,
        apart: bool,
        rng: &mut SplitMix64,
        gap: &mut RankMargin,
    ) -> Result<RunRows<'a, S>, Singular> {
        let (compiled, f, components) = (self.compiled, &self.field, self.layout.unknowns.len());
        let point = &start.point;
        let taylor = self.series(point, components)?;
        let gradient = |&node: &usize| dense(f, components, taylor.components_of(node), taylor.dual(node, 0));
        let combinations = compiled.combinations.iter().map(gradient).collect();
        let arbitrary = self.model.unknown_inputs.iter().any(|u| u.1.is_none());
        let any_time = self.model.time == StartTime::Generic;
        let end = match () {
            () if arbitrary => EndCondition::Open,
            () if start.generic && (number > 0 || any_time || !taylor.depends_on_time()) => {
                EndCondition::Stagnation
            }
            () if taylor.is_at_rest() => EndCondition::Order(components + self.model.states.len()),
            () => match self.generic_ranks(point, &start.known, apart, rng) {
                None => EndCondition::Open,
                Some((ranks, clear)) => {
                    *gap = gap.and(clear);
                    EndCondition::Rank(ranks)
                }
            },
        };
        let own = S::Space::new(f.clone(), components);
        let outputs = compiled.outputs(point.experiment);
        let adjoint = self.adjoint(point, components);
        let known = start.known.clone();
        Ok(RunRows { taylor, adjoint, outputs, own, end, done: false, known, combinations })
    }
}

/// Given entries, each with its index.
fn given(list: &[Option<usize>]) -> Vec<(usize, usize)> {
    list.iter().enumerate().filter_map(|(i, node)| Some((i, (*node)?))).collect()
}
