//! Derivatives of outputs and known inputs ("jets") at random points of a model, and the choice of
//! independent ones.

use obsdeg_exact::groebner::{OverLimit, RemainingWork};
use obsdeg_exact::{Echelon, Field, SplitMix64};

use super::super::dag::Op;
use super::super::model::compiled::{Compiled, Role};
use super::super::model::{KnownInput, SystemModel};
use super::super::rows::layout::Layout;
use super::super::taylor::{Initial, Signal, Taylor};
use super::super::work;

/// Number of orders beyond the last independent one to which an output is followed.
pub(super) const BEYOND: usize = 3;

/// Derivative of an output or of a known input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Jet {
    /// Order of the derivative.
    pub(super) order: usize,
    /// True for an output, false for a known input.
    pub(super) is_output: bool,
    /// Index of the output or known input in the model.
    pub(super) index: usize,
}

/// States in which a trajectory starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Start {
    Random,
    /// The values of the unknowns.
    Given,
}

/// A model with chosen values of the quantities that do not change in time (parameters, and states with the
/// rate zero), and with random states and inputs.
pub(super) struct JetSource<'a> {
    pub(super) f: Field,
    model: &'a SystemModel,
    compiled: &'a Compiled,
    layout: &'a Layout,
    /// Slots of the states that change in time.
    moving: Vec<usize>,
    /// Unknowns that do not change in time.
    pub(super) constants: Vec<usize>,
}

/// Jets of the outputs that are independent of those before them, as functions of the states that change.
pub(super) struct JetStructure {
    /// First order, per output, that depends on the jets before it.
    pub(super) first_dependent: Vec<usize>,
    /// True, per output, if it does not change in time.
    pub(super) still: Vec<bool>,
    /// Jets of inputs in each output derivative, as `inputs[output][order]`.
    inputs: Vec<Vec<Vec<Jet>>>,
    /// Derivatives of each output jet by the states that change, as `rows[output][order]`.
    rows: Vec<Vec<Vec<u64>>>,
    f: Field,
}

impl<'a> JetSource<'a> {
    /// Source for a model with one experiment and one segment, generic starts, no unknown input, no time.
    pub(super) fn new(model: &'a SystemModel, compiled: &'a Compiled, layout: &'a Layout, f: Field) -> Self {
        let is_zero =
            |i: usize| matches!(compiled.dag.ops[compiled.rates(0)[i]], Op::Number { mantissa: 0, .. });
        let moves = |role: &Role| matches!(*role, Role::State(i) if !is_zero(i));
        let slots = compiled.roles.iter().enumerate();
        let moving = slots.filter(|(_, role)| moves(role)).map(|(slot, _)| slot).collect();
        let constants = (0..layout.unknowns.len()).filter(|&l| !moves(&layout.unknowns[l].role)).collect();
        Self { f, model, compiled, layout, moving, constants }
    }

    /// Taylor series at states from `start` and random inputs; `values` are those of the unknowns, then of
    /// the known constants. With `orders`, it has dual components for the states that change and for as many
    /// jets of every input.
    fn series(
        &self,
        values: &[u64],
        orders: Option<usize>,
        start: Start,
        rng: &mut SplitMix64,
    ) -> Option<Taylor<'a, Field>> {
        let (f, unknowns) = (self.f, self.layout.unknowns.len());
        let mut initial: Vec<Option<Initial<u64>>> = vec![None; self.compiled.roles.len()];
        let mut component = self.moving.len();
        let mut signals = Vec::new();
        for (slot, role) in self.compiled.roles.iter().enumerate() {
            let place = self.layout.unknowns.iter().position(|u| u.role == *role);
            signals.push(match *role {
                Role::State(i) if self.moving.contains(&slot) => {
                    let own = self.moving.iter().position(|&s| s == slot).map(|l| (l, f.one()));
                    let start = match start {
                        Start::Random => rng.below(f.modulus()),
                        Start::Given => values[place?],
                    };
                    initial[slot] = Some((start, own.filter(|_| orders.is_some()).into_iter().collect()));
                    Signal::State { rate: self.compiled.rates(0)[i] }
                }
                Role::State(_) | Role::Parameter(_) => {
                    Signal::Constant { value: values[place?], component: None }
                }
                Role::Constant(i) => Signal::Constant { value: values[unknowns + i], component: None },
                Role::KnownInput(i) => {
                    let degree = match self.model.known_input(0, i) {
                        KnownInput::Polynomial(d) => Some(*d),
                        _ => None,
                    };
                    let value = rng.below(f.modulus());
                    match orders {
                        None => Signal::Known { value, degree },
                        Some(orders) => {
                            let count = degree.map_or(orders, |d| orders.min(d + 1));
                            component += orders;
                            Signal::Unknown { value, component: component - orders, count }
                        }
                    }
                }
                // no node in use depends on the time
                Role::Time => Signal::Time { value: 0 },
                Role::UnknownInput(_) => return None,
            });
        }
        let components = orders.map_or(0, |_| component);
        let seed = SplitMix64::new(rng.next_u64());
        let outputs = self.compiled.outputs(0);
        let work = work::Work::new(self.model.work_limit);
        Taylor::new(&self.compiled.dag, f, components, signals, &initial, outputs, true, seed, &work).ok()
    }

    /// True if the model has known inputs.
    pub(super) fn has_inputs(&self) -> bool {
        self.compiled.roles.iter().any(|r| matches!(r, Role::KnownInput(_)))
    }

    fn node(&self, jet: &Jet) -> Option<usize> {
        match jet.is_output {
            true => self.compiled.outputs(0).get(jet.index).copied(),
            false => self.compiled.node_of(Role::KnownInput(jet.index)),
        }
    }

    /// Work of a series up to an order, in products.
    fn cost(&self, order: usize) -> u64 {
        (self.compiled.dag.ops.len() * (order + 2) * (order + 2)) as u64
    }

    /// Values of jets at random states and inputs; `None` if the series is not defined.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub(super) fn point(
        &self,
        values: &[u64],
        jets: &[Jet],
        rng: &mut SplitMix64,
        work: &mut RemainingWork,
    ) -> Result<Option<Vec<u64>>, OverLimit> {
        let highest = jets.iter().map(|j| j.order).max().unwrap_or(0);
        work.take(self.cost(highest))?;
        let Some(mut series) = self.series(values, None, Start::Random, rng) else { return Ok(None) };
        while series.length <= highest {
            series.advance();
        }
        let mut factorials = vec![self.f.one()];
        for k in 1..=highest as u64 {
            factorials.push(self.f.mul(factorials[k as usize - 1], self.f.from_u64(k)));
        }
        let value = |j: &Jet| Some(self.f.mul(series.value(self.node(j)?, j.order), factorials[j.order]));
        Ok(jets.iter().map(value).collect())
    }

    /// First `length` Taylor coefficients of jets along one trajectory; `None` if the series is not defined.
    ///
    /// # Errors
    /// [`OverLimit`].
    pub(super) fn trajectory(
        &self,
        values: &[u64],
        (jets, length): (&[Jet], usize),
        start: Start,
        rng: &mut SplitMix64,
        work: &mut RemainingWork,
    ) -> Result<Option<Vec<Vec<u64>>>, OverLimit> {
        let f = self.f;
        let highest = jets.iter().map(|j| j.order).max().unwrap_or(0) + length;
        work.take(self.cost(highest) / 2)?;
        let Some(mut series) = self.series(values, None, start, rng) else { return Ok(None) };
        while series.length <= highest {
            series.advance();
        }
        // (i + k)!/i!, the factor of the coefficient i + k
        let rising =
            |i: usize, k: usize| (i + 1..=i + k).fold(f.one(), |x, j| f.mul(x, f.from_u64(j as u64)));
        let coefficients = |j: &Jet| {
            let node = self.node(j)?;
            let one = |i: usize| f.mul(series.value(node, i + j.order), rising(i, j.order));
            Some((0..length).map(one).collect::<Vec<u64>>())
        };
        Ok(jets.iter().map(coefficients).collect())
    }

    /// Independent jets at a random point; `None` if no point was found.
    pub(super) fn structure(&self, values: &[u64], rng: &mut SplitMix64) -> Option<JetStructure> {
        let (f, n) = (self.f, self.moving.len());
        let orders = n + BEYOND + 2;
        let mut series = self.series(values, Some(orders), Start::Random, rng)?;
        let outputs = self.compiled.outputs(0);
        let component_of_input: Vec<usize> = (self.compiled.roles.iter())
            .filter_map(|r| if let Role::KnownInput(i) = *r { Some(i) } else { None })
            .collect();
        let mut space = Echelon::new(f, n);
        let mut out = JetStructure {
            first_dependent: vec![usize::MAX; outputs.len()],
            still: vec![false; outputs.len()],
            inputs: vec![Vec::new(); outputs.len()],
            rows: vec![Vec::new(); outputs.len()],
            f,
        };
        for order in 0..orders {
            while series.length <= order {
                series.advance();
            }
            for (j, &node) in outputs.iter().enumerate() {
                let mut row = vec![0; n + component_of_input.len() * orders];
                for (&component, &x) in series.components_of(node).iter().zip(series.dual(node, order)) {
                    row[component as usize] = x;
                }
                let used = (n..row.len()).filter(|&l| row[l] != 0).map(|l| Jet {
                    order: (l - n) % orders,
                    is_output: false,
                    index: component_of_input[(l - n) / orders],
                });
                out.inputs[j].push(used.collect());
                if order == 0 {
                    out.still[j] = row.iter().all(|&x| x == 0);
                }
                if out.first_dependent[j] == usize::MAX && !space.insert(&row[..n]) {
                    out.first_dependent[j] = order;
                }
                row.truncate(n);
                out.rows[j].push(row);
            }
            let followed = out.first_dependent.iter().all(|&k| k.saturating_add(BEYOND) <= order);
            if followed {
                return Some(out);
            }
        }
        None
    }
}

impl JetStructure {
    /// Jets of outputs that change in time, up to their first dependent order, and `beyond` more for output
    /// `leader` (for all outputs without one), with the jets of inputs in them; sorted by order, outputs
    /// last.
    pub(super) fn jets(&self, leader: Option<usize>, beyond: usize) -> Vec<Jet> {
        let mut out = Vec::new();
        let highest = leader.map(|l| self.first_dependent[l] + beyond);
        for (index, &dependent) in self.first_dependent.iter().enumerate() {
            let leads = leader.is_none_or(|l| l == index);
            if self.still[index] && leader != Some(index) {
                continue;
            }
            let last = if leads { dependent + beyond } else { dependent.saturating_sub(1) };
            let last = highest.map_or(last, |h| last.min(h));
            for order in (0..=last).take_while(|_| leads || dependent > 0) {
                out.push(Jet { order, is_output: true, index });
                out.extend(self.inputs[index].get(order).into_iter().flatten());
            }
        }
        out.sort_unstable();
        out.dedup();
        self.without_independent(out)
    }

    /// The jets without those of outputs that are algebraically independent of all others: no relation
    /// contains them.
    pub(super) fn without_independent(&self, mut jets: Vec<Jet>) -> Vec<Jet> {
        let is_chosen = |j: &Jet| j.is_output;
        let chosen: Vec<Jet> = jets.iter().filter(|j| is_chosen(j)).copied().collect();
        let columns = self.rows.iter().flatten().next().map_or(0, Vec::len);
        let rank = |without: Option<&Jet>| {
            let mut space = Echelon::new(self.f, columns);
            let others = chosen.iter().filter(|j| Some(*j) != without);
            others.filter(|j| space.insert(&self.rows[j.index][j.order])).count()
        };
        let all = rank(None);
        jets.retain(|j| !is_chosen(j) || rank(Some(j)) == all);
        jets
    }
}
