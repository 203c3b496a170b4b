//! Sets of outputs of a model: which quantities to measure so that its unknowns are observable, with proof.
//!
//! The rows of all candidates are computed once, at two random points; the degrees under a set follow
//! from ranks. Another output never raises a degree, so a failing set excludes all its subsets
//! (`cuts`).
//!
//! ```
//! use obsdeg_core::system::model_file;
//! use obsdeg_design::sensors::{SensorOptions, sensors};
//!
//! let chain = "name='chain'\nparameters=['k']\n[states]\na='-k*a'\nb='k*a-b'\n[outputs]\ny='b'\n";
//! let model = model_file::read(chain)?;
//! let options = SensorOptions { candidates: model.candidates_of("states")?, ..SensorOptions::default() };
//! let found = sensors(&model, &options, &|_| true)?;
//! assert_eq!((found.front[0].outputs.as_slice(), found.front[0].degree), (&["b".to_string()][..], 2));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod answer;
mod confirm;
mod cuts;
mod ranks;
mod search;
mod unique;

use obsdeg_core::system::{
    Candidate, Gathered, Judgement, ModelError, OutputRows, Role, SystemModel, Unknown, check_cost, gather,
};
use obsdeg_exact::parallel;

pub use answer::{
    CountedSets, FrontSet, SCHEMA, SensorCandidate, SensorSet, SensorUnknown, Sensors, Unattainable,
};
use confirm::Confirmation;
use cuts::{cost_of, members};
use ranks::NONE;
pub use ranks::{Ordered, Ranks, Set};
use search::{CheapestSet, Goal, SetSearch, StopReason};
use unique::{UniqueSolutions, is_one};

use crate::degree_caps::{DegreeCap, widest_first};

/// Largest number of candidates.
pub(crate) const MAX_SENSORS: usize = 64;
/// Number of pairs of points that are tried.
const ATTEMPTS: usize = 5;
/// Limit of work of all sets together, as a multiple of that of one verdict.
const LIMITS: u64 = 50;
/// Number of sets that are judged whatever the limit of work.
const LEAST: u64 = 1000;
/// Millionths in a unit of cost.
const MILLION: f64 = 1e6;

/// Options of a search for outputs to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorOptions {
    /// Candidates of the sets.
    pub candidates: Vec<Candidate>,
    /// True if the outputs of the model are measured in every set.
    pub own_outputs: bool,
    /// Unknowns that must be observable; if empty, all unknowns.
    pub required: Vec<String>,
    /// Largest degrees of unknowns, or of all others.
    pub max_degree: Vec<DegreeCap>,
    /// True if every required unknown must have one solution.
    pub unique: bool,
    /// Largest number of minimal sets in the list.
    pub keep: usize,
    /// Highest order of derivatives; `None` for the bound of the model.
    pub order: Option<usize>,
    /// Seed of all random choices.
    pub seed: u64,
}

impl Default for SensorOptions {
    fn default() -> Self {
        Self {
            candidates: Vec::new(),
            own_outputs: false,
            required: Vec::new(),
            max_degree: Vec::new(),
            unique: false,
            keep: 10,
            order: None,
            seed: 1,
        }
    }
}

/// Error of a search for outputs to measure.
#[derive(Debug, thiserror::Error)]
pub enum SensorError {
    /// Error of the model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Too many candidates, or none.
    #[error("{found} candidates; expected 1 to {MAX_SENSORS}")]
    Candidates {
        /// Number of candidates.
        found: usize,
    },
    /// Name that is no unknown.
    #[error("`{name}` is no unknown of the model; expected one of {}", known.join(", "))]
    Unknown {
        /// Name that was found.
        name: String,
        /// Available names.
        known: Vec<String>,
    },
    /// Largest degree of an unknown that is not required.
    #[error(
        "a largest degree of {name} does nothing, because {name} is not required; expected one of {}",
        required.join(", ")
    )]
    NotRequired {
        /// The unknown.
        name: String,
        /// Required unknowns.
        required: Vec<String>,
    },
    /// Cost that is no positive number in range.
    #[error("the cost of {name}: {expected}")]
    Cost {
        /// Name of the candidate.
        name: String,
        /// Expected value, in words.
        expected: String,
    },
    /// Points that disagree, or leave ranks undecided.
    #[error("undecided: {reason}")]
    Undecided {
        /// Reason in words.
        reason: String,
    },
    /// Interruption before a set was found.
    #[error("interrupted before a set was found")]
    Interrupted,
}

/// Unknown whose degree is computed.
#[derive(Clone)]
struct TargetUnknown {
    name: String,
    unit: String,
    column: usize,
    /// True if every experiment has its own.
    in_experiment: bool,
}

impl TargetUnknown {
    /// Name in a model that may have one more experiment than `model`.
    fn name_in(&self, model: &SystemModel, measuring: &SystemModel) -> String {
        let more = model.experiments <= 1 && measuring.experiments > 1 && self.in_experiment;
        format!("{}{}", self.name, if more { FIRST } else { "" })
    }
}

/// Finds sets of outputs. `progress` receives the number of sets judged; the search ends when it returns
/// false.
///
/// # Errors
/// [`SensorError`].
pub fn sensors(
    model: &SystemModel,
    options: &SensorOptions,
    progress: &(dyn Fn(u64) -> bool + Sync),
) -> Result<Sensors, SensorError> {
    let costs = checked(&options.candidates)?;
    let (whole, ranges) = model.measuring(&options.candidates, options.own_outputs);
    let mut disagreed = None;
    for attempt in 0..ATTEMPTS {
        let gathered = gather(&whole, options.seed, options.order, attempt)?;
        let owners = owners(&whole, &ranges, options);
        let asked = unknowns(model, &whole, &gathered.judged);
        let columns: Vec<usize> = asked.iter().map(|u| u.column).collect();
        let [first, second]: [Box<dyn Ranks>; 2] = match &gathered.rows {
            OutputRows::Primes(points) => {
                let [p, q] = &**points;
                let one_run = whole.experiments <= 1 && whole.segments.len() <= 1;
                let generic = one_run && gathered.judged.layout.closed;
                [p, q].map(|p| Box::new(Ordered::new(p, &owners, &columns, generic)) as Box<dyn Ranks>)
            }
            OutputRows::Digits(points) => {
                let (p, q) = &**points;
                let first = Ordered::new(p, &owners, &columns, false);
                [Box::new(first), Box::new(Ordered::new(q, &owners, &columns, false))]
            }
        };
        let n = gathered.judged.layout.unknowns.len() as u64;
        let most = (LIMITS * model.work_limit.operations() / (n * n * n / 2 + 1)).max(LEAST);
        let search = SetSearch::new(&*first, costs.clone(), asked.len(), most, progress);
        let mut task = SensorTask {
            model,
            options,
            gathered: &gathered,
            asked,
            search,
            ranges: &ranges,
            required: Vec::new(),
        };
        let answer = task.answer()?;
        match task.differs(&*second) {
            None if first.is_clear() && second.is_clear() => return Ok(answer),
            None => {
                let reason = "real numbers of 192 and 308 digits leave ranks unclear".into();
                return Err(SensorError::Undecided { reason });
            }
            differs => disagreed = differs,
        }
    }
    let set = disagreed.map_or_else(String::new, |set: Set| names(set, options).join(", "));
    let reason =
        format!("two random points disagreed {ATTEMPTS} times, on the set {set}: please report this model");
    Err(SensorError::Undecided { reason })
}

/// Costs of the candidates in millionths.
fn checked(candidates: &[Candidate]) -> Result<Vec<u64>, SensorError> {
    let found = candidates.len();
    if found == 0 || found > MAX_SENSORS {
        return Err(SensorError::Candidates { found });
    }
    let cost = |c: &Candidate| match check_cost(c.cost) {
        Ok(()) => Ok((c.cost * MILLION).round() as u64),
        Err(expected) => Err(SensorError::Cost { name: c.named.name.clone(), expected }),
    };
    candidates.iter().map(cost).collect()
}

/// Candidates that the rows of each output need, as a set, experiment by experiment: the one that is
/// measured, and of the last experiment the one that adds it. The set is empty for the own outputs of the
/// model.
fn owners(whole: &SystemModel, ranges: &[std::ops::Range<usize>], options: &SensorOptions) -> Vec<Set> {
    let owner = |i: usize| ranges.iter().position(|range| range.contains(&i)).map_or(0, |c| 1 << c);
    let experiments = whole.experiments.max(1);
    let added = options.candidates.iter().position(|c| c.experiment).map_or(0, |c| 1 << c);
    let of = |e: usize| if e + 1 == experiments { added } else { 0 };
    (0..experiments).flat_map(|e| (0..whole.outputs.len()).map(move |i| of(e) | owner(i))).collect()
}

/// Unknowns of the model with their units, by their columns in the rows of `whole`, which may have one more
/// experiment.
fn unknowns(model: &SystemModel, whole: &SystemModel, judged: &Judgement) -> Vec<TargetUnknown> {
    let unit = |role: Role| match role {
        Role::State(i) => model.states[i].named.unit.clone(),
        Role::Parameter(i) => model.parameters[i].unit.clone(),
        Role::UnknownInput(i) => model.unknown_inputs[i].0.unit.clone(),
        _ => String::new(),
    };
    let all = judged.layout.unknowns.iter().enumerate().filter(|(c, _)| judged.shown(model, *c));
    let own = all.filter(|(_, u)| u.experiment.is_none_or(|e| e < model.experiments.max(1)));
    let more = model.experiments <= 1 && whole.experiments > 1;
    let name = |name: &String| match name.strip_suffix(FIRST).filter(|_| more) {
        Some(name) => name.into(),
        None => name.clone(),
    };
    let of = |(column, u): (usize, &Unknown)| {
        let in_experiment = u.experiment.is_some();
        TargetUnknown { name: name(&u.name), unit: unit(u.role), column, in_experiment }
    };
    own.map(of).collect()
}

/// End of the name of an unknown of the first of several experiments.
const FIRST: &str = "@1";

fn names(set: Set, options: &SensorOptions) -> Vec<String> {
    members(set).map(|c| options.candidates[c].named.name.clone()).collect()
}

fn degree(degree: u16) -> Option<usize> {
    (degree < NONE).then_some(degree.into())
}

/// Search with its options.
struct SensorTask<'a> {
    model: &'a SystemModel,
    options: &'a SensorOptions,
    gathered: &'a Gathered,
    asked: Vec<TargetUnknown>,
    search: SetSearch<'a>,
    /// Outputs of each candidate, among those of all.
    ranges: &'a [std::ops::Range<usize>],
    /// Required unknowns: indices among all.
    required: Vec<usize>,
}

impl SensorTask<'_> {
    /// Indices of the unknowns with this name: one, or one per experiment.
    fn named(&self, name: &str) -> Result<Vec<usize>, SensorError> {
        let is = |u: &TargetUnknown| {
            u.name == name || u.name.split_once('@').is_some_and(|(base, _)| base == name)
        };
        let found: Vec<usize> = (0..self.asked.len()).filter(|&u| is(&self.asked[u])).collect();
        match found.is_empty() {
            false => Ok(found),
            true => Err(SensorError::Unknown {
                name: name.into(),
                known: self.asked.iter().map(|u| u.name.clone()).collect(),
            }),
        }
    }

    /// Sets the limits of the required unknowns; those beyond the reach of all candidates are left out
    /// and listed.
    fn require(&mut self) -> Result<Vec<Unattainable>, SensorError> {
        let mut limits = vec![NONE - 1; self.asked.len()];
        for DegreeCap { name, cap } in widest_first(&self.options.max_degree) {
            let of = name.as_ref().map_or_else(|| Ok((0..limits.len()).collect()), |n| self.named(n))?;
            let most = u16::try_from(*cap).unwrap_or(NONE - 1).min(NONE - 1);
            of.into_iter().for_each(|u| limits[u] = most);
        }
        let mut required: Vec<usize> = match self.options.required.is_empty() {
            true => (0..self.asked.len()).collect(),
            false => {
                let all = self.options.required.iter().map(|name| self.named(name));
                all.collect::<Result<Vec<_>, _>>()?.concat()
            }
        };
        required.sort_unstable();
        required.dedup();
        for name in self.options.max_degree.iter().filter_map(|c| c.name.as_ref()) {
            if !self.named(name)?.iter().any(|u| required.contains(u)) {
                let required = self.options.required.clone();
                return Err(SensorError::NotRequired { name: name.clone(), required });
            }
        }
        let everything = self.search.all;
        let reached = self.search.degrees(everything).map_err(|_| SensorError::Interrupted)?.to_vec();
        let (reach, never): (Vec<usize>, Vec<usize>) =
            required.into_iter().partition(|u| reached[*u] <= limits[*u]);
        let name = |u: usize| self.asked[u].name.clone();
        let out_of_reach =
            |u: usize| Unattainable { name: name(u), degree: degree(reached[u]), number_of_solutions: None };
        let mut out: Vec<Unattainable> = never.into_iter().map(out_of_reach).collect();
        self.required = reach;
        if self.options.unique {
            out.extend(self.require_one_solution(&reached));
        }
        self.required.iter().for_each(|&u| self.search.limits[u] = Some(limits[u]));
        Ok(out)
    }

    /// Requires one solution of every required unknown; those that all candidates leave with several, or with
    /// a number that is not decided, are left out and listed.
    fn require_one_solution(&mut self, reached: &[u16]) -> Vec<Unattainable> {
        let mut unique = UniqueSolutions::new(self.model, self.options);
        let required: Vec<TargetUnknown> = self.required.iter().map(|&u| self.asked[u].clone()).collect();
        let numbers = unique.numbers_of_all(self.search.all, &required);
        let (one, more): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.required).into_iter().zip(numbers).partition(|(_, n)| is_one(n));
        self.required = one.into_iter().map(|(u, _)| u).collect();
        unique.required = self.required.iter().map(|&u| self.asked[u].clone()).collect();
        unique.one_under(self.search.all);
        self.search.unique = Some(unique);
        let of = |(u, number_of_solutions): (usize, _)| {
            let (name, degree) = (self.asked[u].name.clone(), degree(reached[u]));
            Unattainable { name, degree, number_of_solutions }
        };
        more.into_iter().map(of).collect()
    }

    fn set(&self, set: Set, degree: u16) -> SensorSet {
        let cost = self.cost(cost_of(set, &self.search.costs));
        SensorSet { outputs: names(set, self.options), cost, degree: degree.into() }
    }

    fn cost(&self, millionths: u64) -> f64 {
        millionths as f64 / MILLION
    }

    /// Adds the front of cost against degree to `out`, as far as it is found: sets with their proofs.
    fn front(&mut self, out: &mut Vec<(Set, FrontSet)>) -> Result<(), StopReason> {
        let (mut most, everything) = (NONE - 1, self.search.worst(self.search.all)?);
        loop {
            let best = self.search.best(&Goal::All, most)?;
            let cuts = self.search.needed(&best);
            let CheapestSet { set, degree: worst, examined, .. } = best;
            let one_of_each = cuts.into_iter().map(|cut| names(cut, self.options)).collect();
            let SensorSet { outputs, cost, degree } = self.set(set, worst);
            let below = (most < NONE - 1).then_some(most.into());
            out.push((set, FrontSet { outputs, cost, degree, below, one_of_each, examined }));
            if worst <= everything {
                return Ok(());
            }
            most = worst - 1;
        }
    }

    /// Cheapest set for every unknown.
    fn of_unknowns(&mut self, stopped: &mut Option<StopReason>) -> Vec<SensorUnknown> {
        let reached = self.search.degrees(self.search.all).map(<[u16]>::to_vec).unwrap_or_default();
        let own = match self.options.own_outputs {
            true => self.search.degrees(0).map(<[u16]>::to_vec).unwrap_or_default(),
            false => Vec::new(),
        };
        let mut out = Vec::new();
        for u in 0..self.asked.len() {
            let least = reached.get(u).copied().unwrap_or(NONE);
            let mut cheapest = None;
            if least < NONE && stopped.is_none() {
                match self.search.best(&|k| Goal::One(u, k), NONE - 1) {
                    Ok(best) => cheapest = Some(self.set(best.set, best.degree)),
                    Err(reason) => *stopped = Some(reason),
                }
            }
            let (name, unit) = (self.asked[u].name.clone(), self.asked[u].unit.clone());
            let required = self.required.contains(&u);
            let own_degree = own.get(u).copied().and_then(degree);
            let least_degree = degree(least);
            out.push(SensorUnknown { name, unit, required, cheapest, own_degree, least_degree });
        }
        out
    }

    /// Candidates, each with the degrees under it alone.
    fn candidates(&mut self) -> Vec<SensorCandidate> {
        let alone = (0..self.options.candidates.len()).map(|c| 1 << c);
        // with its own outputs the model itself is judged too, before the limit of work is reached
        let alone: Vec<Set> = alone.chain(self.options.own_outputs.then_some(0)).collect();
        let judged = self.search.judge(&alone).is_ok();
        let mut out = Vec::new();
        for (c, candidate) in self.options.candidates.iter().enumerate() {
            let degrees =
                if judged { self.search.degrees(1 << c).map(<[u16]>::to_vec) } else { Ok(Vec::new()) };
            let degrees: Vec<Option<usize>> = degrees.unwrap_or_default().into_iter().map(degree).collect();
            let required = self.required.iter().filter_map(|&u| degrees.get(u).copied());
            let observable: Vec<usize> = required.flatten().collect();
            let all = observable.len() == self.required.len();
            out.push(SensorCandidate {
                name: candidate.named.name.clone(),
                experiment: candidate.experiment,
                tells: candidate.experiment || self.gathered.tells(&self.ranges[c]),
                expression: candidate.parts.first().map_or_else(String::new, |p| p.text.clone()),
                unit: candidate.named.unit.clone(),
                description: candidate.named.description.clone(),
                cost: candidate.cost,
                degree: observable.iter().max().copied().filter(|_| all),
                observable: observable.len(),
                degrees,
            });
        }
        out
    }

    /// Sets with their degrees, as they are listed.
    fn listed(&mut self, sets: &[Set]) -> Result<Vec<SensorSet>, SensorError> {
        let mut listed = Vec::new();
        for &set in sets {
            let worst = self.search.worst(set).map_err(|_| SensorError::Interrupted)?;
            listed.push(self.set(set, worst));
        }
        Ok(listed)
    }

    /// Largest degrees asked for, as a user writes them.
    fn caps_in_words(&self) -> Vec<String> {
        self.options.max_degree.iter().map(ToString::to_string).collect()
    }

    fn answer(&mut self) -> Result<Sensors, SensorError> {
        let unattainable = self.require()?;
        let candidates = self.candidates();
        let (mut front, mut sets, mut complete, mut stopped) = (Vec::new(), Vec::new(), u32::MAX, None);
        let any = !self.required.is_empty();
        if any {
            stopped = self.front(&mut front).err();
            complete = if stopped.is_some() { 0 } else { complete };
            if front.is_empty() && stopped == Some(StopReason::Interrupted) {
                return Err(SensorError::Interrupted);
            }
        }
        if any && stopped.is_none() {
            (sets, complete, stopped) = self.search.minimal(Goal::All(NONE - 1));
        }
        let quantities = self.of_unknowns(&mut stopped);
        let all = self.options.candidates.len() as u32;
        let (found, complete_to) = (sets.len(), (complete < all).then_some(complete as usize));
        sets.truncate(self.options.keep);
        let listed = self.listed(&sets)?;
        let least = self.search.worst(self.search.all).ok().filter(|_| any);
        let relied = front.iter().map(|f| f.0).chain(sets).chain(self.proofs(&front));
        let confirmed = Confirmation::of(self, relied.collect())?;
        Ok(Sensors {
            schema: SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            name: self.model.name.clone(),
            own_outputs: match self.options.own_outputs {
                true => self.model.outputs.iter().map(|o| o.0.name.clone()).collect(),
                false => Vec::new(),
            },
            candidates,
            required: self.required.iter().map(|&u| self.asked[u].name.clone()).collect(),
            max_degree: self.caps_in_words(),
            unattainable,
            one_solution: self
                .search
                .unique
                .as_ref()
                .map(|unique| CountedSets { counted: unique.counted(), undecided: unique.undecided() }),
            least_degree: least.and_then(degree),
            front: front.into_iter().map(|f| f.1).collect(),
            sets: listed,
            minimal_sets: (any && stopped.is_none() && complete_to.is_none()).then_some(found),
            minimal_sets_found: found,
            complete_to,
            quantities,
            judged_sets: self.search.judged.len(),
            relied_on_sets: self.search.relied_on.len(),
            confirmed_sets: confirmed.sets,
            closed: self.gathered.ended(),
            last_order: self.gathered.judged.layout.bound,
            stopped: stopped.map(|s| s.words().into()),
            error_bound: self.gathered.error_bound(self.search.relied_on.len()),
            digits: self.gathered.judged.digits(),
            seed: self.options.seed,
        })
    }

    /// Failing sets that the proofs of a front rest on.
    fn proofs(&self, front: &[(Set, FrontSet)]) -> Vec<Set> {
        let place = |name: &String| {
            self.options.candidates.iter().position(|c| c.named.name == *name).map_or(0, |c| 1 << c)
        };
        let cut = |group: &Vec<String>| group.iter().map(place).fold(0, |all: Set, one: Set| all | one);
        let cuts = front.iter().flat_map(|f| &f.1.one_of_each).map(cut);
        cuts.map(|cut| self.search.all & !cut).collect()
    }

    /// Set that the answer rests on and under which another point gives other degrees; `None` if there is
    /// none.
    fn differs(&self, other: &dyn Ranks) -> Option<Set> {
        let judged = &self.search.judged;
        let mut sets: Vec<Set> = self.search.relied_on.iter().copied().collect();
        sets.sort_unstable();
        parallel::find_first(sets.len(), |i| (judged[&sets[i]] != other.degrees(sets[i])).then_some(sets[i]))
    }
}

impl StopReason {
    fn words(self) -> &'static str {
        match self {
            Self::Work => {
                "more sets would be judged than the limit of work allows; a larger --work-limit allows more"
            }
            Self::Counts => "the solutions under more sets would be counted than the limit allows",
            Self::Nodes => {
                "there are too many ways to choose from the groups of candidates that the proofs need"
            }
            Self::Interrupted => "interrupted",
        }
    }
}
