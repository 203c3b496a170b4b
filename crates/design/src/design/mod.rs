//! Finding schemes: the fewest positions, and the best of a number of positions.
//!
//! Sets of candidates are first judged exactly (`observability`). Sequences of those that make the required
//! coefficients observable, in every order where the carry makes order matter and by both ways of half turns (`ways`),
//! are then ranked (`search`, `exhaust`, `exchange`): constraints first, then the worst degree, then a criterion of optimal design
//! (`information`), up to turns of the platform axes (`symmetry`).

pub(crate) mod answer;
mod best;
pub(crate) mod candidates;
mod certificate;
mod certify;
mod correlated;
pub(crate) mod criterion;
mod divide;
mod error;
mod exchange;
mod exhaust;
pub(crate) mod information;
mod nearest;
pub(crate) mod observability;
mod part;
mod psi;
mod refine;
mod rounding;
mod screen;
pub(crate) mod search;
mod sets;
pub(crate) mod symmetry;
mod task;
pub(crate) mod ties;
pub(crate) mod walks;
pub(crate) mod ways;
mod winner;

pub use answer::*;
pub use best::{Best, Scored, Worth};
pub use candidates::Candidates;
pub use certificate::{Bound, Everywhere};
pub use criterion::{Criterion, Limits};
pub use error::DesignError;
pub(crate) use exhaust::Pruning;
pub use information::{Evaluator, State};
pub use nearest::Nearest;
pub use observability::{Patience, Rows};
pub use part::{Level, PART_SCHEMA, Part, PartError, design_merged, design_part, design_starts};
pub use search::{Constraints, Progress, Search};
pub use symmetry::Symmetry;
pub use ways::Stop;

use std::sync::atomic::{AtomicBool, Ordering};

pub use ties::Ties;
pub use walks::{WalkOptions, Walks, is_walk, scheme_of_walk, walks};
pub use winner::scheme as scheme_found;

use certify::excess;
use obsdeg_core::model::settings::{Assignment, concerns};
use obsdeg_core::model::{Angle, Euler, Path, Scheme, c_n_f64};
use obsdeg_evidence::simulation::{Conditions, MeasurementReport, latitude_of, other_carries};
use rounding::Free;
use serde::{Deserialize, Serialize};
use task::Task;
pub use task::asked;
use ties::TIE;

/// Most sequences that are searched exhaustively, up to symmetry.
pub const EXHAUSTIVE: u64 = 50_000_000;
/// From so many sequences on it is worth while to seek those that are good beforehand, and to leave out what is worse.
const MANY: u64 = 1_000_000;
/// Under reset carry: so many are searched without asking first whether a bound makes it unnecessary.
const QUICK: u64 = 2_000_000;
/// What may be wrong with a larger probability is not proven.
const PROOF: f64 = 1e-12;

/// What is to be found.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignOptions {
    /// What to choose from.
    pub candidates: Candidates,
    /// Number of positions; `None`: only the minimum is asked for.
    pub positions: Option<usize>,
    /// Coefficients or families that must be observable; none: all.
    pub required: Vec<String>,
    /// Largest degrees: of a coefficient or family, or of all that are required.
    pub degree_caps: Vec<(Option<String>, usize)>,
    /// Only schemes that meet the requirements of the conditions on what is required, and on psi when that is
    /// everything.
    pub meet: bool,
    /// Largest total time, in s.
    pub total_s: Option<f64>,
    /// Longest turn between successive positions, in s.
    pub slew_s: Option<f64>,
    /// What makes one scheme better than another.
    pub criterion: CriterionName,
    /// How many schemes are listed.
    pub keep: usize,
    /// Restarts of the exchange, where the space is too large for exhaustion.
    pub restarts: u64,
    /// Refine the angles of the best continuously.
    pub refine: bool,
    /// Divide the total time among the positions of the best.
    pub divide: bool,
    /// Numbers of positions for the front of total time, besides that asked for.
    pub front: Vec<usize>,
    /// Where many sequences would have to be searched and information adds (reset carry): all are searched
    /// unless the criterion of a scheme found by exchange is within this part of a bound on what is possible
    /// at all. `None`: they are not searched, and the answer says how far that scheme is from the bound at
    /// most. 0: all are searched, however many they are, under any carry.
    pub within: Option<f64>,
    /// Whether the bound over all attitudes is sought too (reset carry).
    pub everywhere: bool,
    /// The candidates are where the search for the best attitudes of all begins; these take their place, with angles
    /// rounded to multiples of so many 1e-9 degrees (reset carry).
    pub free: Option<i64>,
    /// Seed of all random choices.
    pub seed: u64,
}

impl Default for DesignOptions {
    /// The minimum, of the cardinal attitudes.
    fn default() -> Self {
        Self {
            candidates: Candidates::cardinals(),
            positions: None,
            required: Vec::new(),
            degree_caps: Vec::new(),
            meet: false,
            total_s: None,
            slew_s: None,
            criterion: CriterionName::default(),
            keep: 10,
            restarts: 200,
            refine: false,
            divide: false,
            front: Vec::new(),
            within: None,
            everywhere: false,
            free: None,
            seed: 1,
        }
    }
}

/// The name of a criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CriterionName {
    /// The largest sigma.
    #[default]
    Worst,
    /// A-optimal.
    A,
    /// D-optimal.
    D,
    /// E-optimal.
    E,
    /// The largest sigma over its requirement.
    Margin,
}

/// Finds schemes under the assumptions of `base` (its positions do not matter); `conditions` give the noise, the dwell,
/// the rate of slews and the requirements. `progress` says whether to go on: a search that is stopped gives the best so
/// far.
///
/// # Errors
/// [`DesignError`].
pub fn design(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Design, DesignError> {
    answered(base, conditions, options, progress, None)
}

/// Work that is told once to stop stays stopped; it hears of that too.
fn watched<T>(
    progress: &(dyn Fn(Progress) -> bool + Sync),
    work: impl FnOnce(&(dyn Fn(Progress) -> bool + Sync), &AtomicBool) -> T,
) -> T {
    let stopped = AtomicBool::new(false);
    let progress = |now: Progress| {
        if !stopped.load(Ordering::Relaxed) && !progress(now) {
            stopped.store(true, Ordering::Relaxed);
        }
        !stopped.load(Ordering::Relaxed)
    };
    work(&progress, &stopped)
}

/// Nothing is done yet.
const NOTHING_YET: Progress = Progress { done: 0, total: 1, examined: 0, best: f64::INFINITY };

/// A search that can begin: its task, and what evaluates sequences.
struct Prepared<'a> {
    task: Task<'a>,
    evaluator: Evaluator,
    conditions: &'a Conditions,
    /// The degree of every required coefficient in all candidates together.
    degrees: Vec<Option<usize>>,
    /// Attitudes that the gimbals do not reach.
    beyond: Vec<String>,
}

impl<'a> Prepared<'a> {
    fn new(
        base: &'a Scheme,
        conditions: &'a Conditions,
        options: &'a DesignOptions,
        going: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, DesignError> {
        if is_walk(base) {
            check_walks(base, conditions, options)?;
        }
        let (reached, beyond) = options.candidates.clone().within(&base.gimbals);
        let task = Task::new(base, conditions, options, reached)?;
        if options.positions.is_some() {
            task.unit()?;
        }
        let every: Vec<usize> = (0..task.rows.candidates()).collect();
        let degrees = task.rows.degrees(&every);
        let indices: Vec<usize> = task.required.iter().map(|r| r.1).collect();
        // without a number of positions nothing is evaluated
        let evaluated = options.positions.map_or(1, |_| task.candidates.attitudes.len());
        let attitudes = &task.candidates.attitudes[..evaluated];
        let evaluator = Evaluator::while_going(base, attitudes, &indices, conditions, going)?;
        Ok(Self { task, evaluator, conditions, degrees, beyond })
    }

    fn search<'s>(&'s self, progress: &'s (dyn Fn(Progress) -> bool + Sync)) -> Search<'s> {
        Search {
            rows: &self.task.rows,
            walks: self.task.walks,
            evaluator: &self.evaluator,
            criterion: &self.task.criterion,
            constraints: &self.task.constraints,
            keep: self.task.options.keep,
            floor: self.degrees.iter().flatten().max().copied().unwrap_or(0),
            progress,
        }
    }

    /// Whether schemes of `k` positions can do at all.
    fn check(&self, k: usize) -> Result<(), DesignError> {
        let impossible = |why| Err(DesignError::Impossible { positions: k, wanted: self.task.wanted(), why });
        if let Some(limit) = self.task.options.total_s
            && limit < k as f64 * self.conditions.dwell_s
        {
            return impossible(format!(
                "{k} times {} s at a position are more than {limit} s",
                self.conditions.dwell_s
            ));
        }
        if self.task.walks {
            return Ok(());
        }
        let never: Vec<&str> = self.task.never(&self.degrees).collect();
        match never.is_empty() {
            true => Ok(()),
            false => impossible(format!("all together leave {} unobservable", never.join(", "))),
        }
    }

    /// What is left out of an exhaustive search.
    fn pruning<'s>(&self, search: &'s Search<'_>, k: usize) -> Option<Pruning<'s>> {
        let (_, sequences) = self.task.space(k, &self.evaluator)?;
        (sequences >= MANY).then(|| search.pruning(&self.task.symmetry, k, self.task.options.seed))?
    }

    /// The best sequences: all are searched, with the number of sets and sequences, unless they are too many or `bound` shows that those
    /// an exchange finds are good enough.
    fn searched(&self, search: &Search<'_>, k: usize, bound: Option<&Bound>) -> (Best, Option<(u64, u64)>) {
        let (task, options) = (&self.task, self.task.options);
        let all = options.within == Some(0.0);
        let most = if all { u64::MAX } else { EXHAUSTIVE };
        let exhaustive = task.space(k, &self.evaluator).filter(|space| space.1 <= most);
        let exchanged = || search.exchange(k, &[], options.restarts, options.seed);
        if let (Some((_, QUICK..)), Some(bound)) = (exhaustive, bound)
            && !all
        {
            let exchanged = exchanged();
            let near = |f: &Scored| excess(task.value(&self.evaluator, f).at_most, bound.value);
            let enough = |f: &Scored| {
                options.within.is_none_or(|within| f.worth.degree == search.floor && near(f) < within)
            };
            if !exchanged.complete || exchanged.found.first().is_some_and(enough) {
                return (exchanged, None);
            }
        }
        let best = match exhaustive {
            Some((_, MANY..)) => search.exhaust_pruned(&task.symmetry, k, options.seed),
            Some(_) => search.exhaust(&task.symmetry, k),
            None => exchanged(),
        };
        (best, exhaustive)
    }

    /// The number of sets and of sequences of an exhaustive search.
    fn exhaustible(&self, k: usize) -> Result<(u64, u64), DesignError> {
        if self.task.walks {
            return Err(DesignError::Walks { found: "a search of all sequences".into() });
        }
        let too_many = DesignError::TooMany { positions: k, candidates: self.task.rows.candidates() };
        self.task.space(k, &self.evaluator).ok_or(too_many)
    }
}

/// Refuses what is not done where torquer errors act on the way between positions.
fn check_walks(base: &Scheme, conditions: &Conditions, options: &DesignOptions) -> Result<(), DesignError> {
    let whole = |x: &f64| (x - x.round()).abs() < 1e-12;
    let cardinal = |a: &Euler| c_n_f64(a).as_flattened().iter().all(whole);
    let other = options.candidates.attitudes.iter().position(|a| !cardinal(a));
    let found = [
        conditions.slew_rate_deg_s.is_none().then(|| "repositioning at once".into()),
        (base.path == Some(Path::Gimbals)).then(|| "slews gimbal by gimbal".into()),
        other.map(|i| format!("candidate {}", options.candidates.names[i])),
        options.refine.then(|| "--refine".into()),
        options.divide.then(|| "--divide".into()),
        (!options.degree_caps.is_empty()).then(|| "a cap of degrees".into()),
    ];
    match found.into_iter().flatten().next() {
        Some(found) => Err(DesignError::Walks { found }),
        None => Ok(()),
    }
}

/// What an exhaustive search found elsewhere.
type Elsewhere<'a> = &'a dyn Fn(&Prepared<'_>, usize) -> Result<Best, DesignError>;

/// The answer; `elsewhere` instead of a search.
fn answered(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    progress: &(dyn Fn(Progress) -> bool + Sync),
    elsewhere: Option<Elsewhere<'_>>,
) -> Result<Design, DesignError> {
    let stated = conditions;
    let conditions = &asked(base, conditions, &options.required)?;
    watched(progress, |progress, stopped| {
        let going = || progress(NOTHING_YET);
        let free =
            options.free.map(|step| Free::new(base, conditions, options, step, progress)).transpose()?;
        let chosen =
            free.as_ref().map(|f| DesignOptions { candidates: f.candidates.clone(), ..options.clone() });
        let options = chosen.as_ref().unwrap_or(options);
        let prepared = Prepared::new(base, conditions, options, &going)?;
        let task = &prepared.task;
        let minimum = task.minimum(&prepared.degrees, &going)?;
        let mut sets = minimum.none_of.iter().fold(0.0, |sum, [_, sets]| sum + *sets as f64);
        let mut out = Design {
            schema: SCHEMA.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            carry: base.carry,
            latitude_deg: latitude_of(base).map_or(0.0, |l| l.degrees()),
            latitude_by_default: base.latitude.is_none(),
            geometry: base.geometry,
            terms: base.unknowns.to_string(),
            candidates: task.candidates.names.clone(),
            beyond_gimbals: prepared.beyond.clone(),
            symmetry: task.symmetry.order,
            required: task.required.iter().map(|r| r.0.clone()).collect(),
            minimum,
            search: None,
            found: Vec::new(),
            front: Vec::new(),
            other_carries: Vec::new(),
            not_judged: not_judged(stated, conditions),
            gimbals: None,
            primes: task.rows.fields(),
            error_bound: task.rows.error_bound(sets),
            seed: options.seed,
        };
        out.minimum.proven &= out.error_bound < PROOF;
        let Some(k) = options.positions else { return Ok(out) };
        prepared.check(k)?;
        let evaluator = &prepared.evaluator;
        let search = prepared.search(progress);
        let bound = task.bound(evaluator, k, &going);
        let (best, exhaustive) = match (elsewhere, &free) {
            (Some(elsewhere), _) => (elsewhere(&prepared, k)?, task.space(k, evaluator)),
            (None, Some(free)) => free.searched(&prepared, &search, k)?,
            (None, None) => prepared.searched(&search, k, bound.as_ref()),
        };
        if let Some((more, _)) = exhaustive {
            sets += more as f64;
            out.error_bound = task.rows.error_bound(sets);
        }
        let all = exhaustive.is_some() && best.complete;
        out.found = task.all_found(evaluator, &best.found)?;
        if task.is_noisy() {
            out.found.sort_by(|a, b| a.worst_degree.cmp(&b.worst_degree).then(a.value.total_cmp(&b.value)));
        }
        task.mark_images(&mut out.found, evaluator.ordered());
        let Some(first) = best.found.first().filter(|_| !out.found.is_empty()) else {
            let (positions, wanted) = (k, task.wanted());
            let error = match (best.complete, exhaustive) {
                (false, _) => return Err(DesignError::Interrupted),
                (true, Some(_)) => DesignError::Impossible {
                    positions,
                    wanted,
                    why: examined(best.lost, conditions.slew_rate_deg_s.is_some()),
                },
                (true, None) => DesignError::NotFound { positions, wanted, examined: best.examined },
            };
            if !options.meet {
                return Err(error);
            }
            let nearest = Nearest::seek(base, conditions, options, k, progress)?;
            return Err(DesignError::NotMet { why: Box::new(error), nearest: Box::new(nearest) });
        };
        out.front = task.all_found(evaluator, &best.front)?;
        // the bound is of samples without random drift: it says nothing of how far above it figures with it
        // may be
        let certified = bound.filter(|_| !task.is_noisy());
        let mut certificate = certified.map(|bound| task.certificate(&bound, task.value(evaluator, first)));
        if best.complete {
            let of = (k, conditions.dwell_s);
            let wanted = certificate.is_some() && options.everywhere && free.is_none();
            let over_all = || wanted.then(|| evaluator.everywhere(&task.criterion, k, &going)).flatten();
            let line = || certificate.is_some().then(|| task.front_bound(evaluator, of, &going));
            let (front, (found, line)) =
                rayon::join(|| task.front(evaluator, &search, of, &best), || rayon::join(over_all, line));
            out.front.extend(front?);
            if let (Some(certificate), Some(line)) = (&mut certificate, line) {
                let every = free.as_ref().map(|f| &f.every).or(found.as_ref());
                certificate.everywhere = every.map(|every| {
                    let rounded = options.free.zip(free.as_ref()).map(|(step, f)| (step, f.finer.as_ref()));
                    certify::everywhere(every, task.value_among_all(evaluator, first), rounded)
                });
                certificate.front = line;
            }
        }
        if options.refine && going() {
            let refined = task.refined(evaluator, first, &going)?;
            out.front.extend(refined.iter().cloned());
            put_first(&mut out.found, refined);
        }
        if options.divide && going() {
            let divided = task.divided(evaluator, first, &going)?;
            out.front.extend(divided.iter().cloned());
            put_first(&mut out.found, divided);
        }
        out.front = pareto(std::mem::take(&mut out.front));
        out.other_carries = match out.found.first() {
            Some(best) => {
                let scheme = winner::scheme(best, base, conditions)?;
                other_carries(&scheme, &Conditions::of(&scheme), options.seed)?
            }
            None => Vec::new(),
        };
        out.search = Some(SearchReport {
            positions: k,
            // positions that are searched for have the dwell of the conditions
            conditions: MeasurementReport::new(
                &Scheme { positions: Scheme::of_angles([zero()]).positions, ..base.clone() },
                conditions,
            ),
            drift_noise: conditions.as_stated().drift_noise_in_words(),
            prior: conditions.stated_prior_in_words(),
            criterion: task.criterion.name().into(),
            unit: task.unit().ok().flatten().map(Into::into),
            examined: best.examined,
            excluded: best.excluded,
            lost: best.lost,
            sequences: task.space(k, evaluator).map(|s| s.1).filter(|_| !all && free.is_none()),
            proven: all && out.error_bound < PROOF && !task.is_noisy(),
            ties: all.then(|| TiesReport { sequences: best.ties.total(task.symmetry.order), within: TIE }),
            order_matters: evaluator.ordered(),
            interrupted: stopped.load(Ordering::Relaxed),
            degree_floor: (!task.walks).then_some(search.floor),
            constraints: task.constraints_in_words(),
            certificate,
        });
        winner::within_gimbals(&mut out, base, conditions)?;
        Ok(out)
    })
}

/// Names of the requirements that `conditions` leave out of those that are stated.
fn not_judged(stated: &Conditions, conditions: &Conditions) -> Vec<String> {
    let judged = |a: &Assignment| conditions.requirements.iter().any(|r| concerns(&a.name, &r.name));
    stated.requirements.iter().filter(|a| !judged(a)).map(|a| a.name.clone()).collect()
}

/// The attitude with all angles zero.
fn zero() -> Euler {
    std::array::from_fn(|_| Angle::from_degrees(0))
}

/// Why an exhaustive search found nothing.
fn examined(lost: u64, slews: bool) -> String {
    let with = if slews { " with the slews" } else { "" };
    match lost {
        0 => "every sequence was examined".into(),
        _ => format!(
            "every sequence was examined; the samples of {lost} with observable positions do not determine it{with}, as far as double precision \
             tells"
        ),
    }
}

/// Puts a scheme before others, if there is one.
fn put_first(found: &mut Vec<Found>, first: Option<Found>) {
    let moved = usize::from(first.is_some());
    found.iter_mut().flat_map(|f| &mut f.image_of).for_each(|of| *of += moved);
    found.splice(0..0, first);
}

/// Those that none beats in both total time and criterion, by time.
fn pareto(mut found: Vec<Found>) -> Vec<Found> {
    found.sort_by(|a, b| a.total_s.total_cmp(&b.total_s).then(a.value.total_cmp(&b.value)));
    let mut least = f64::INFINITY;
    found.retain(|f| {
        let better = f.value < least;
        least = least.min(f.value);
        better
    });
    found
}
