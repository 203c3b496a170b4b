//! Finding schemes: the fewest positions, and the best of a number of positions.
//!
//! Sets of candidates are first judged exactly (`observability`). Sequences of those that make the required
//! coefficients observable, in every order where the carry makes order matter and by both ways of half turns (`ways`),
//! are then ranked (`search`): constraints first, then the worst degree, then a criterion of optimal design
//! (`information`), up to turns of the platform axes (`symmetry`).

pub(crate) mod answer;
pub(crate) mod candidates;
mod certificate;
mod certify;
mod correlated;
pub(crate) mod criterion;
mod divide;
pub(crate) mod information;
pub(crate) mod observability;
mod part;
mod psi;
mod refine;
mod screen;
pub(crate) mod search;
pub(crate) mod symmetry;
mod task;
pub(crate) mod ties;
pub(crate) mod walks;
pub(crate) mod ways;
mod winner;

pub use answer::*;
pub use candidates::Candidates;
pub use certificate::{Bound, Everywhere};
pub use criterion::{Criterion, Limits};
pub use information::{Evaluator, State};
pub use observability::{Patience, Rows};
pub use part::{Level, PART_SCHEMA, Part, PartError, design_merged, design_part, design_starts};
pub(crate) use search::Pruning;
pub use search::{Best, Constraints, Progress, Scored, Search, Worth};
pub use symmetry::Symmetry;
pub use ways::Stop;

use std::sync::atomic::{AtomicBool, Ordering};

use obsdeg_ekf::EkfError;

pub use ties::Ties;
pub use walks::{WalkOptions, Walks, is_walk, scheme_of_walk, walks};
pub use winner::scheme as scheme_found;

use candidates::MAX_CANDIDATES;
use certify::excess;
use obsdeg_core::degree::EnsembleError;
use obsdeg_core::model::{Angle, Carry, Euler, Path, Scheme, SchemeError, c_n_f64, format_decimal};
use obsdeg_evidence::simulation::{Conditions, MeasurementReport, SimulationError, latitude_of};
use task::Task;
use ties::TIE;

/// Most sequences that are searched exhaustively, up to symmetry.
pub const EXHAUSTIVE: u64 = 50_000_000;
/// From so many sequences on it is worth while to seek those that are good beforehand, and to leave out what is worse.
const MANY: u64 = 1_000_000;
/// Under reset carry: so many are searched without asking first whether a bound makes it unnecessary.
const QUICK: u64 = 2_000_000;
/// What may be wrong with a larger probability is not proven.
const PROOF: f64 = 1e-12;

/// Why no scheme is found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// Nothing to choose from, or too much.
    #[error("{found} candidates; expected at least one and at most {MAX_CANDIDATES}")]
    Candidates {
        /// Their number.
        found: usize,
    },
    /// Too many turns between candidates.
    #[error("{found} candidates with slews; expected at most {}", ways::MAX_TURNING)]
    Pairs {
        /// Their number.
        found: usize,
    },
    /// Steps that do not fit.
    #[error("a grid of {found} degrees; expected a step that divides 90 degrees, as in grid:45")]
    Grid {
        /// The step.
        found: String,
    },
    /// A number of positions that cannot be.
    #[error("{found} positions; expected 1 to 100")]
    Positions {
        /// The number asked for.
        found: usize,
    },
    /// The drift itself is constant at one position only.
    #[error("a design needs coefficients; found the unknowns `drift` (use terms such as F,I,O,S)")]
    Drift,
    /// A rotating segment has no place among candidates.
    #[error("a design chooses among positions; found the rotating segment `{name}`")]
    Rotation {
        /// The segment.
        name: String,
    },
    /// A generic angle has no sigma.
    #[error("the angle `{name}` is generic; expected numbers for a design")]
    GenericAngle {
        /// Its name.
        name: String,
    },
    /// A name that is no coefficient.
    #[error("`{found}` is no coefficient of this scheme; expected some of {known}, or families such as D_F")]
    UnknownName {
        /// The name found.
        found: String,
        /// The coefficients.
        known: String,
    },
    /// A requirement that cannot be.
    #[error("the requirement for {name} is {found}; expected a sigma above 0")]
    Requirement {
        /// The coefficient.
        name: String,
        /// The number found.
        found: f64,
    },
    /// Positions are what is searched for.
    #[error(
        "the {what} for `{found}` is that of one position; expected psi, psi_x, psi_y or psi_z, for every position"
    )]
    OnePosition {
        /// A requirement or a prior.
        what: &'static str,
        /// The name found.
        found: String,
    },
    /// A limit that cannot be.
    #[error("{what} of {found} s; expected more than 0")]
    Limit {
        /// What is limited.
        what: &'static str,
        /// The number found.
        found: f64,
    },
    /// Too many coefficients.
    #[error("{found} unknowns; expected at most {}", information::MAX)]
    TooManyUnknowns {
        /// Number of unknowns.
        found: usize,
    },
    /// No sequence of that many candidates is what is wanted.
    #[error("no scheme of {positions} of these candidates {wanted}: {why}")]
    Impossible {
        /// The number of positions.
        positions: usize,
        /// What is wanted, with all limits.
        wanted: String,
        /// What is missed, or how that is known.
        why: String,
    },
    /// Of those that were looked at, no sequence is what is wanted.
    #[error(
        "no scheme found: none of the {examined} sequences of {positions} of these candidates that were looked at {wanted}; there are too many to look at all"
    )]
    NotFound {
        /// The number of positions.
        positions: usize,
        /// What is wanted, with all limits.
        wanted: String,
        /// How many were looked at.
        examined: u64,
    },
    /// Parts of no exhaustive search.
    #[error("parts are of a search for so many positions of given candidates; expected these")]
    Parts,
    /// A part that is none.
    #[error("part {} of {}; expected 1 of 1 or more, as in 2/7", .found[0], .found[1])]
    PartNumber {
        /// Which of how many.
        found: [usize; 2],
    },
    /// A part that is not taken.
    #[error("{name}: {why}")]
    Part {
        /// Its name.
        name: String,
        /// Why.
        why: PartError,
    },
    /// Parts that are not there.
    #[error("missing of {of} parts: {}", listed(.missing))]
    MissingParts {
        /// Their numbers.
        missing: Vec<usize>,
        /// How many there are.
        of: usize,
    },
    /// More sequences than an exhaustive search takes, in parts or not.
    #[error(
        "all sequences of {positions} of {candidates} candidates are too many for an exhaustive search, in parts too"
    )]
    TooMany {
        /// The number of positions.
        positions: usize,
        /// The number of candidates.
        candidates: usize,
    },
    /// Attitudes chosen freely where nothing says which.
    #[error(
        "free attitudes are chosen for a number of positions under reset carry, where information adds; found {found}"
    )]
    Free {
        /// What was found.
        found: String,
    },
    /// Stopped before anything was found.
    #[error("interrupted before anything was found")]
    Interrupted,
    /// The scheme.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// Conditions that do not go together.
    #[error(transparent)]
    Conditions(#[from] SimulationError),
    /// No verdict.
    #[error(transparent)]
    Verdict(#[from] EnsembleError),
    /// No turn, or too many, between candidates whose way counts.
    #[error(
        "{found} turns between candidates; expected 1 to {most}: take a larger or smaller --max-turn, or other candidates"
    )]
    Turns {
        /// Their number.
        found: usize,
        /// The most.
        most: usize,
    },
    /// What is searched over sets only.
    #[error(
        "torquer errors act on the way between positions, so schemes are walks: found {found}; expected slews that take time (--slew-rate), about one \
         axis, between cardinal attitudes, by exchange (no --refine, --divide, --part, or cap of degrees); --minimum finds the fewest positions"
    )]
    Walks {
        /// What is not of walks.
        found: String,
    },
    /// No sigma is the largest of several units.
    #[error(
        "{criterion} compares sigmas in one unit, but {units} are required; expected criterion margin (over requirements), or D (their geometric mean), or \
         --observable with coefficients of one unit: the others are estimated with them"
    )]
    Units {
        /// The criterion.
        criterion: &'static str,
        /// An example of every unit.
        units: String,
    },
    /// A number is not finite.
    #[error(transparent)]
    Filter(#[from] EkfError),
}

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
    /// Where many sequences would have to be searched and information adds (reset carry): a scheme found by exchange whose
    /// criterion is within this part of what is possible at all is enough; 0: all are searched, however many they are, under any carry.
    pub within: f64,
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
            within: 1e-4,
            everywhere: false,
            free: None,
            seed: 1,
        }
    }
}

/// The name of a criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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

/// The best attitudes of all for a task, and as candidates with rounded angles.
fn freely(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    step: i64,
    going: &(dyn Fn() -> bool + Sync),
) -> Result<(Everywhere, Candidates), DesignError> {
    let wrong = |found: String| DesignError::Free { found };
    let k = options.positions.ok_or_else(|| wrong("no number of positions".into()))?;
    if base.carry != Carry::Reset {
        return Err(wrong(format!("{} carry", base.carry)));
    }
    if step <= 0 {
        return Err(wrong(format!("angles rounded to {} degrees", format_decimal(step))));
    }
    let prepared = Prepared::new(base, conditions, options, going)?;
    prepared.check(k)?;
    if prepared.evaluator.bias.is_some() {
        return Err(wrong("noise of Z that is correlated from position to position".into()));
    }
    if !prepared.evaluator.prior.is_alike() {
        return Err(wrong("priors of psi that differ by axis".into()));
    }
    let found = prepared.evaluator.everywhere(&prepared.task.criterion, k, going);
    let found = found.ok_or(DesignError::Interrupted)?;
    let rounded =
        |angle: &Angle| Angle::from_nanodeg((angle.nanodeg() as f64 / step as f64).round() as i64 * step);
    let mut candidates = Candidates::default();
    for (euler, _) in &found.support {
        candidates.add(euler.each_ref().map(rounded));
    }
    Ok((found, candidates))
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
    watched(progress, |progress, stopped| {
        let going = || progress(NOTHING_YET);
        let mut every = None;
        let mut chosen = options.clone();
        if let Some(step) = options.free {
            let (found, candidates) = freely(base, conditions, options, step, &going)?;
            (every, chosen.candidates) = (Some(found), candidates);
        }
        let options = &chosen;
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
        let mut exhaustive = task.space(k, evaluator);
        let best = if let Some(elsewhere) = elsewhere {
            elsewhere(&prepared, k)?
        } else {
            let most = if options.within > 0.0 { EXHAUSTIVE } else { u64::MAX };
            exhaustive = exhaustive.filter(|space| space.1 <= most);
            let mut tried = None;
            if let (Some((_, QUICK..)), Some(bound)) = (exhaustive, &bound)
                && options.within > 0.0
            {
                let exchanged = search.exchange(k, &[], options.restarts, options.seed);
                let enough = |f: &Scored| {
                    f.worth.degree == search.floor && excess(f.worth.value, bound.value) < options.within
                };
                if !exchanged.complete || exchanged.found.first().is_some_and(enough) {
                    (tried, exhaustive) = (Some(exchanged), None);
                }
            }
            tried.unwrap_or_else(|| match exhaustive {
                Some((_, MANY..)) => search.exhaust_pruned(&task.symmetry, k, options.seed),
                Some(_) => search.exhaust(&task.symmetry, k),
                None => search.exchange(k, &[], options.restarts, options.seed),
            })
        };
        if let Some((more, _)) = exhaustive {
            sets += more as f64;
            out.error_bound = task.rows.error_bound(sets);
        }
        let all = exhaustive.is_some() && best.complete;
        out.found = task.all_found(evaluator, &best.found)?;
        let Some(first) = best.found.first().filter(|_| !out.found.is_empty()) else {
            let (positions, wanted) = (k, task.wanted());
            return Err(match (best.complete, exhaustive) {
                (false, _) => DesignError::Interrupted,
                (true, Some(_)) => DesignError::Impossible {
                    positions,
                    wanted,
                    why: examined(best.lost, conditions.slew_rate_deg_s.is_some()),
                },
                (true, None) => DesignError::NotFound { positions, wanted, examined: best.examined },
            });
        };
        out.front = task.all_found(evaluator, &best.front)?;
        let mut certificate = bound.map(|bound| task.certificate(&bound, first.worth.value));
        if best.complete {
            let of = (k, conditions.dwell_s);
            let wanted = certificate.is_some() && options.everywhere && every.is_none();
            let over_all = || wanted.then(|| evaluator.everywhere(&task.criterion, k, &going)).flatten();
            let line = || certificate.is_some().then(|| task.front_bound(evaluator, of, &going));
            let (front, (found, line)) =
                rayon::join(|| task.front(evaluator, &search, of, &best), || rayon::join(over_all, line));
            out.front.extend(front?);
            if let (Some(certificate), Some(line)) = (&mut certificate, line) {
                let value = first.worth.value;
                let every = every.or(found);
                certificate.everywhere = every.map(|every| certify::everywhere(&every, value, options.free));
                certificate.front = line;
            }
        }
        if options.refine && going() {
            let refined = task.refined(evaluator, first, &going)?;
            out.front.extend(refined.iter().cloned());
            out.found.splice(0..0, refined);
        }
        if options.divide && going() {
            let divided = task.divided(evaluator, first, &going)?;
            out.front.extend(divided.iter().cloned());
            out.found.splice(0..0, divided);
        }
        out.front = pareto(std::mem::take(&mut out.front));
        out.search = Some(SearchReport {
            positions: k,
            conditions: MeasurementReport::new(base, conditions),
            drift_noise: None,
            prior: prior_in_words(conditions),
            criterion: task.criterion.name().into(),
            unit: task.unit().ok().flatten().map(Into::into),
            examined: best.examined,
            excluded: best.excluded,
            lost: best.lost,
            proven: all && out.error_bound < PROOF,
            ties: all.then(|| TiesReport { sequences: best.ties.total(task.symmetry.order), within: TIE }),
            order_matters: evaluator.ordered(),
            interrupted: stopped.load(Ordering::Relaxed),
            degree_floor: (!task.walks).then_some(search.floor),
            constraints: task.constraints_in_words(),
            certificate,
        });
        Ok(out)
    })
}

/// `psi 0.05 deg, D_F 20`: the priors that are stated, later ones over earlier ones.
fn prior_in_words(conditions: &Conditions) -> Option<String> {
    let stated = conditions.stated_priors();
    let scale = match conditions.drift_scale {
        1.0 => String::new(),
        factor => format!(", those of drifts times {factor}"),
    };
    let listed: Vec<String> = stated.iter().map(|a| format!("{} {}", a.name, a.value)).collect();
    (!listed.is_empty()).then(|| format!("{}{scale}", listed.join(", ")))
}

/// `2, 5`: at most twenty numbers.
fn listed(numbers: &[usize]) -> String {
    const SHOWN: usize = 20;
    let shown: Vec<String> = numbers.iter().take(SHOWN).map(ToString::to_string).collect();
    let more = numbers.len().saturating_sub(SHOWN);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", shown.join(", "))
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
