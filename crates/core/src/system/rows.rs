//! Any system as a source of derivative rows: the duals of the Taylor coefficients of its outputs.

use obsdeg_exact::prime::is_prime;
use obsdeg_exact::{Echelon, Field, SplitMix64, gcd};

use super::constraints::hold;
use super::dag::{FunctionStart, Op};
use super::model::{Compiled, KnownInput, Role, StateStart, SystemModel};
use super::taylor::{Initial, Signal, Singular, Starts, Taylor};
use crate::degree::rows::DerivativeRows;

/// Points that are tried before a division by zero or a missing root is taken to be there at every point.
const ATTEMPTS: usize = 64;

/// An unknown of a system.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unknown {
    /// Its name; `x@2` in the second experiment.
    pub name: String,
    /// What it is.
    pub role: Role,
    /// The Taylor coefficient of an unknown input that it is.
    pub derivative: usize,
    /// The experiment it belongs to; parameters belong to all.
    pub experiment: Option<usize>,
}

/// The unknowns of a system, and how far it has to be differentiated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Every lane.
    pub unknowns: Vec<Unknown>,
    /// The highest order that is looked at.
    pub bound: usize,
    /// The point is generic and every input is, so that an order that adds nothing is the end. Otherwise only the bound
    /// ends it.
    pub closed: bool,
}

impl Layout {
    /// The unknowns of `model`; `bound` overrides the order at which it is given up.
    pub fn new(model: &SystemModel, bound: Option<usize>) -> Self {
        let arbitrary = model.unknown_inputs.iter().any(|u| u.1.is_none());
        let starts = model.states.iter().all(|s| s.start == StateStart::Unknown);
        Self::of(model, bound, starts && !arbitrary)
    }

    /// The same where it is known whether an order that adds nothing is the end.
    pub(crate) fn of(model: &SystemModel, bound: Option<usize>, closed: bool) -> Self {
        let finite: usize = model.unknown_inputs.iter().map(|u| u.1.map_or(1, |d| d + 1)).sum();
        let n = model.states.len() + finite + model.parameters.len();
        let bound = bound.unwrap_or(if closed { n * model.experiments.max(1) } else { 2 * n + 4 });
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
        Self { unknowns, bound, closed }
    }

    pub(super) fn lane(&self, role: Role, experiment: usize) -> Option<usize> {
        let own = |u: &Unknown| u.role == role && u.experiment.is_none_or(|e| e == experiment);
        self.unknowns.iter().position(own)
    }
}

/// The rows of a system at one random point of one field.
#[derive(Debug, Clone)]
pub(crate) struct SystemRows<'a> {
    field: Field,
    lanes: usize,
    runs: Vec<Run<'a>>,
    bound: usize,
    closed: bool,
    kept: bool,
    single: bool,
    row: Vec<u64>,
}

#[derive(Debug, Clone)]
struct Run<'a> {
    taylor: Taylor<'a>,
    outputs: &'a [usize],
    /// Its own rank, where there are several runs.
    own: Echelon,
    stalled: bool,
    /// Differentials of the constraints at the start of its experiment.
    known: Vec<Vec<u64>>,
    /// Gradients of the combinations at its start.
    combinations: Vec<Vec<u64>>,
}

/// A random prime `2^60 < p < 2^61` in whose field the roots of a graph can be had.
pub(crate) fn field_for(compiled: &Compiled, rng: &mut SplitMix64) -> Field {
    let degrees: Vec<u64> = compiled
        .dag
        .ops
        .iter()
        .filter_map(|op| match op {
            Op::Primitive { start: FunctionStart::Root { denominator, .. }, .. } => {
                let mut odd = denominator.unsigned_abs();
                while odd > 0 && odd.is_multiple_of(2) {
                    odd /= 2;
                }
                Some(odd)
            }
            _ => None,
        })
        .collect();
    loop {
        let p = (1 << 60) + rng.below(1 << 60) / 4 * 4 + 3;
        if p < 1 << 61 && degrees.iter().all(|&q| q <= 1 || gcd(q, p - 1) == 1) && is_prime(p) {
            return Field::new(p);
        }
    }
}

impl<'a> SystemRows<'a> {
    /// The rows of a system at a random point.
    ///
    /// # Errors
    /// [`Singular`] when no point could be found.
    pub(crate) fn new(
        model: &SystemModel,
        compiled: &'a Compiled,
        layout: &Layout,
        field: Field,
        rng: &mut SplitMix64,
    ) -> Result<Self, Singular> {
        let mut last = Singular::Division(0);
        for _ in 0..ATTEMPTS {
            match Self::at(model, compiled, layout, field, rng) {
                Err(singular) => last = singular,
                found => return found,
            }
        }
        Err(last)
    }

    fn at(
        model: &SystemModel,
        compiled: &'a Compiled,
        layout: &Layout,
        field: Field,
        rng: &mut SplitMix64,
    ) -> Result<Self, Singular> {
        let f = field;
        let lanes = layout.unknowns.len();
        let starts = Starts::random(&compiled.dag, &f, rng);
        let p = f.modulus();
        let mut random = || rng.below(p);
        let mut parameters: Vec<u64> = model.parameters.iter().map(|_| random()).collect();
        let mut constants: Vec<u64> = model.constants.iter().map(|_| random()).collect();
        let mut runs: Vec<Run<'a>> = Vec::new();
        let mut kept = true;
        for experiment in 0..model.experiments.max(1) {
            let mut signals: Vec<Signal> = Vec::new();
            let mut initial: Vec<Option<Initial>> = vec![None; compiled.roles.len()];
            for (slot, role) in compiled.roles.iter().enumerate() {
                signals.push(match *role {
                    Role::State(i) => {
                        let lane = layout.lane(*role, experiment);
                        initial[slot] = Some((random(), lane.map(|l| (l, f.one())).into_iter().collect()));
                        Signal::State { rate: compiled.rates(experiment)[i] }
                    }
                    Role::Parameter(i) => {
                        Signal::Constant { value: parameters[i], lane: layout.lane(*role, experiment) }
                    }
                    Role::Constant(i) => Signal::Constant { value: constants[i], lane: None },
                    Role::KnownInput(i) => Signal::Known {
                        degree: match model.known_input(experiment, i) {
                            KnownInput::Polynomial(d) => Some(*d),
                            _ => None,
                        },
                    },
                    Role::UnknownInput(i) => Signal::Unknown {
                        lane: layout.lane(*role, experiment).unwrap_or(0),
                        count: model.unknown_inputs[i].1.unwrap_or(layout.bound) + 1,
                    },
                    Role::Time => Signal::Time,
                });
            }
            let seed = random();
            let slot_of = |role: Role| compiled.roles.iter().position(|r| *r == role);
            // constants and starts that are given by formulas are read off a first look at the point
            let look = |signals: &[Signal], initial: &[Option<Initial>]| {
                Taylor::new(&compiled.dag, f, lanes, signals, initial, &starts, SplitMix64::new(seed))
            };
            let given = compiled.constants(experiment);
            if given.iter().any(Option::is_some) {
                // a constant may use those before it
                for _ in 0..model.constants.len() {
                    let seen = look(&signals, &initial)?;
                    for (c, node) in given.iter().enumerate() {
                        if let (Some(node), Some(slot)) = (node, slot_of(Role::Constant(c))) {
                            signals[slot] = Signal::Constant { value: seen.start(*node), lane: None };
                        }
                    }
                }
            }
            if !compiled.constraints.is_empty() {
                let mut values = vec![0; compiled.roles.len()];
                let mut free = vec![false; compiled.roles.len()];
                for (slot, role) in compiled.roles.iter().enumerate() {
                    values[slot] = match (&signals[slot], &initial[slot]) {
                        (Signal::Constant { value, .. }, _) => *value,
                        (_, Some(start)) => start.0,
                        _ => 0,
                    };
                    // what the experiments share is chosen in the first
                    free[slot] = match *role {
                        Role::State(_) => true,
                        Role::Parameter(_) => experiment == 0,
                        Role::Constant(c) => experiment == 0 && given[c].is_none(),
                        Role::KnownInput(_) | Role::UnknownInput(_) | Role::Time => false,
                    };
                }
                let mut own = SplitMix64::new(random());
                hold(&compiled.dag, &compiled.constraints, &mut values, &free, &f, &mut own)
                    .map_err(Singular::Constraint)?;
                for (slot, role) in compiled.roles.iter().enumerate() {
                    match *role {
                        Role::State(_) => {
                            if let Some(start) = &mut initial[slot] {
                                start.0 = values[slot];
                            }
                        }
                        Role::Parameter(i) => parameters[i] = values[slot],
                        Role::Constant(c) => constants[c] = values[slot],
                        Role::KnownInput(_) | Role::UnknownInput(_) | Role::Time => {}
                    }
                    if let Signal::Constant { value, .. } = &mut signals[slot] {
                        *value = values[slot];
                    }
                }
            }
            let set = |initial: &mut Vec<Option<Initial>>, seen: &Taylor<'_>, state: usize, node: usize| {
                if let Some(slot) = slot_of(Role::State(state)) {
                    let duals = seen.dual(node, 0).iter().copied().enumerate().filter(|(_, x)| *x != 0);
                    initial[slot] = Some((seen.start(node), duals.collect()));
                }
            };
            if compiled.starts.iter().any(Option::is_some) {
                let seen = look(&signals, &initial)?;
                for (state, node) in compiled.starts.iter().enumerate() {
                    if let Some(node) = node {
                        set(&mut initial, &seen, state, *node);
                    }
                }
            }
            let mut known: Vec<Vec<u64>> = Vec::new();
            if !compiled.constraints.is_empty() {
                let mut seen = look(&signals, &initial)?;
                known = compiled.constraints.iter().map(|&node| seen.dual(node, 0).to_vec()).collect();
                seen.advance();
                kept &= compiled.constraints.iter().all(|&node| seen.value(node, 1) == 0);
            }
            let whole = vec![super::model::CompiledSegment::default()];
            let segments = if compiled.segments.is_empty() { &whole } else { &compiled.segments };
            for segment in segments {
                if !segment.constants.is_empty() {
                    let seen = look(&signals, &initial)?;
                    for (c, node) in &segment.constants {
                        if let Some(slot) = slot_of(Role::Constant(*c)) {
                            signals[slot] = Signal::Constant { value: seen.start(*node), lane: None };
                        }
                    }
                }
                if !segment.carry.is_empty() {
                    let seen = look(&signals, &initial)?;
                    for (state, node) in &segment.carry {
                        set(&mut initial, &seen, *state, *node);
                    }
                }
                let taylor = look(&signals, &initial)?;
                let gradient = |&node: &usize| {
                    let dual = taylor.dual(node, 0);
                    if dual.is_empty() { vec![0; lanes] } else { dual.to_vec() }
                };
                let combinations = compiled.combinations.iter().map(gradient).collect();
                let known = known.clone();
                let (own, outputs) = (Echelon::new(f, lanes), compiled.outputs(experiment));
                runs.push(Run { taylor, outputs, own, stalled: false, known, combinations });
            }
        }
        Ok(Self {
            field,
            lanes,
            single: runs.len() == 1,
            runs,
            bound: layout.bound,
            closed: layout.closed,
            kept,
            row: vec![0; lanes],
        })
    }

    /// Whether the first derivatives of all constraints are zero here.
    pub(crate) fn keeps_constraints(&self) -> bool {
        self.kept
    }

    /// The gradients of the combinations at the start of the first run.
    pub(crate) fn combinations(&self) -> &[Vec<u64>] {
        self.runs.first().map_or(&[], |r| &r.combinations)
    }

    /// The derivative of this order of a node at the start of the first run.
    pub(crate) fn derivative(&mut self, node: usize, order: usize) -> u64 {
        let f = self.field;
        let Some(run) = self.runs.first_mut() else { return 0 };
        while run.taylor.length <= order {
            run.taylor.advance();
        }
        (1..=order).fold(run.taylor.value(node, order), |x, k| f.mul(x, f.from_u64(k as u64)))
    }

    /// The Taylor coefficient of a node at the start of a run.
    pub(super) fn coefficient(&mut self, run: usize, node: usize, order: usize) -> u64 {
        let taylor = &mut self.runs[run].taylor;
        while taylor.length <= order {
            taylor.advance();
        }
        taylor.value(node, order)
    }

    /// Whether a node depends on no unknown in a run.
    pub(super) fn is_known(&self, run: usize, node: usize) -> bool {
        self.runs[run].taylor.is_known(node)
    }

    /// The value of every unknown at this point, then of every known constant (in the first segment).
    pub(crate) fn values(&self, compiled: &Compiled, layout: &Layout, constants: usize) -> Vec<u64> {
        let segments = compiled.segments.len().max(1);
        let node_of = |role: Role| compiled.node_of(role);
        let value = |u: &Unknown| {
            let run = self.runs.get(u.experiment.unwrap_or(0) * segments)?;
            Some(run.taylor.value(node_of(u.role)?, u.derivative))
        };
        let constant = |c: usize| Some(self.runs.first()?.taylor.start(node_of(Role::Constant(c))?));
        let unknowns = layout.unknowns.iter().map(value);
        unknowns.chain((0..constants).map(constant)).map(|x| x.unwrap_or(0)).collect()
    }
}

impl DerivativeRows for SystemRows<'_> {
    fn field(&self) -> Field {
        self.field
    }

    fn columns(&self) -> usize {
        self.lanes
    }

    fn emit(&mut self, order: usize, sink: &mut dyn FnMut(&[u64]) -> bool) -> bool {
        if order > self.bound || self.runs.iter().all(|r| r.stalled) {
            return false;
        }
        for run in self.runs.iter_mut().filter(|r| !r.stalled) {
            while run.taylor.length <= order {
                run.taylor.advance();
            }
            let mut grew = false;
            // a constraint is an output of which only the start is known
            for row in run.known.iter().filter(|_| order == 0) {
                sink(row);
                run.own.insert(row);
            }
            for &output in run.outputs {
                let dual = run.taylor.dual(output, order);
                let row = if dual.is_empty() { &self.row } else { dual };
                let new = sink(row);
                // where runs share the rank, each has to be followed until its own stalls
                grew |= if self.single { new } else { run.own.insert(row) };
            }
            run.stalled = self.closed && !grew;
        }
        true
    }
}
