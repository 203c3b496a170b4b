//! Any system as a source of derivative rows: the dual components of the Taylor coefficients of its outputs.

use obsdeg_exact::prime::is_prime;
use obsdeg_exact::{Field, RankMargin, RowSpace, Scalars, SplitMix64};

use super::adjoint::Adjoint;
use super::branches::{Signs, sided};
use super::model::{Compiled, CompiledSegment, KnownInput, Role, StartTime, StateStart, SystemModel};
use super::taylor::{Initial, Signal, Singular, Taylor};
use super::values::Values;
use super::work::{RowCost, Sweeps, Work, WorkStep, product};
use crate::degree::rows::DerivativeRows;

mod by_output;
mod generic;

pub use by_output::{OwnRows, PointRows};

/// Smallest number of orders that are followed if no end is proven.
const ORDERS: usize = 60;
/// Number of unknowns per output from which rows are computed backwards (`adjoint`): with fewer unknowns
/// there are few orders, and forward computation is faster.
const LONG: usize = 48;
/// Number of unknowns from which rows are always computed backwards, to save memory.
const MANY: usize = 256;

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
    pub(super) fn in_formulas(&self) -> String {
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
    pub(super) sides: Option<Signs>,
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
    pub(super) fn factorial<S: Scalars>(&self, f: &S, unknown: usize) -> S::Element {
        (2..=self.unknowns[unknown].derivative).fold(f.one(), |x, k| f.mul(&x, &f.integer(k as i64)))
    }

    /// Index of the unknown with a role in an experiment; `None` if there is none.
    pub(super) fn index_of(&self, role: Role, experiment: usize) -> Option<usize> {
        let own = |u: &Unknown| u.role == role && u.experiment.is_none_or(|e| e == experiment);
        self.unknowns.iter().position(own)
    }
}

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

/// Condition that ends a run.
#[derive(Debug, Clone, PartialEq, Eq)]
enum EndCondition {
    /// The point is generic: an order that adds nothing is the last.
    Stagnation,
    /// No higher rank is possible: these are the ranks at a generic point, of all outputs together, or of
    /// each alone.
    Rank(Vec<usize>),
    /// The system is at rest: the rows are `C A^k`, and by Cayley-Hamilton those of this order are the last
    /// that can add anything.
    Order(usize),
    /// No end is proven.
    Open,
}

impl EndCondition {
    /// True if a run has ended: its rows, or those of one of its outputs, have this rank after an order;
    /// `grew` is true if that order raised the rank.
    fn is_reached(&self, output: usize, order: usize, grew: bool, rank: usize) -> bool {
        match self {
            Self::Stagnation => !grew,
            Self::Rank(ranks) => ranks.get(output).is_some_and(|most| rank >= *most),
            Self::Order(last) => order >= *last,
            Self::Open => false,
        }
    }
}

#[derive(Debug, Clone)]
struct RunRows<'a, S: Values> {
    taylor: Taylor<'a, S>,
    /// Rows computed backwards, if there are many unknowns.
    adjoint: Option<Adjoint<'a, S>>,
    outputs: &'a [usize],
    /// Span of the run's own rows.
    own: S::Space,
    end: EndCondition,
    done: bool,
    /// Differentials of the constraints at the start of the experiment.
    known: Rows<S>,
    /// Gradients of the combinations at the start of the run.
    combinations: Rows<S>,
}

/// Field modulo a random prime `2^60 < p < 2^61`.
pub(crate) fn random_field(rng: &mut SplitMix64) -> Field {
    loop {
        let p = (1 << 60) + rng.below(1 << 60) / 2 * 2 + 1;
        if p < 1 << 61 && is_prime(p) {
            return Field::new(p);
        }
    }
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

/// Rows over the unknowns.
pub(super) type Rows<S> = Vec<Vec<<S as Scalars>::Element>>;

/// Values at a point that the runs of one experiment share.
#[derive(Clone)]
pub(super) struct Point<S: Values> {
    pub(super) signals: Vec<Signal<S::Element>>,
    pub(super) initial: Vec<Option<Initial<S::Element>>>,
    pub(super) seed: u64,
    pub(super) experiment: usize,
}

impl<S: Values> Point<S> {
    /// The point with generic known inputs replaced by constant values.
    fn with_constant_inputs(&self, mut constant: impl FnMut() -> S::Element) -> Self {
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
struct SharedValues<S: Values> {
    parameters: Vec<S::Element>,
    constants: Vec<S::Element>,
    /// Time at the start of each experiment.
    time: S::Element,
}

/// Start of a segment.
struct SegmentStart<S: Values> {
    point: Point<S>,
    /// Differentials of the constraints at the start of the experiment.
    known: Rows<S>,
    /// True if the point is generic among those where the constraints hold.
    generic: bool,
    time: S::Element,
}

/// Builder of points: model, graph, unknowns, field and work.
pub(super) struct PointBuilder<'a, 'b, S: Values> {
    pub(super) model: &'b SystemModel,
    pub(super) compiled: &'a Compiled,
    pub(super) layout: &'b Layout,
    pub(super) field: S,
    pub(super) work: &'b Work,
}

impl<'a, S: Values> PointBuilder<'a, '_, S> {
    fn slot_of(&self, role: Role) -> Option<usize> {
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
    pub(super) fn values(&self, rng: &mut SplitMix64, attempt: usize) -> Option<Vec<S::Element>> {
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
    fn series(&self, point: &Point<S>, components: usize) -> Result<Taylor<'a, S>, Singular> {
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
    fn adjoint(&self, point: &Point<S>, components: usize) -> Option<Adjoint<'a, S>> {
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
    pub(super) fn both(&self, rng: &mut SplitMix64) -> (Taylor<'a, S>, Adjoint<'a, S>) {
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
    fn start(
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
    fn enter(
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
    fn run(
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

/// Cost of the rows of a run.
fn cost_of<S: Values>(taylor: &Taylor<'_, S>, backwards: Option<Sweeps>, outputs: usize) -> RowCost {
    let [fixed, growing, nodes, products] = taylor.operations();
    RowCost {
        fixed,
        growing,
        nodes,
        products,
        backwards,
        outputs: outputs as u64,
        components: taylor.components() as u64,
        words: (size_of::<S::Element>() as u64).div_ceil(8),
    }
}

/// Rows of an order of all outputs.
fn rows_of<S: Values>(
    taylor: &mut Taylor<'_, S>,
    adjoint: Option<&mut Adjoint<'_, S>>,
    outputs: &[usize],
    order: usize,
) -> Rows<S> {
    if let Some(adjoint) = adjoint {
        return adjoint.rows(order);
    }
    while taylor.length <= order {
        taylor.advance();
    }
    let row = |&output: &usize| {
        dense(&taylor.field(), taylor.components(), taylor.components_of(output), taylor.dual(output, order))
    };
    outputs.iter().map(row).collect()
}

/// Given entries, each with its index.
fn given(list: &[Option<usize>]) -> Vec<(usize, usize)> {
    list.iter().enumerate().filter_map(|(i, node)| Some((i, (*node)?))).collect()
}

/// Full row of a sparse one: zeros outside its support.
pub(super) fn dense<S: Values>(
    f: &S,
    components: usize,
    support: &[u32],
    row: &[S::Element],
) -> Vec<S::Element> {
    let mut out = vec![f.zero(); components];
    for (&component, x) in support.iter().zip(row) {
        out[component as usize] = *x;
    }
    out
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
