//! Free attitudes: those that weights on all attitudes need, and those near them, with angles rounded. What is chosen is
//! evaluated as it is rounded.
//!
//! Schemes begin with the cardinal attitudes, with the rounded ones of the weights, and at random. Each of their positions
//! then moves on the grid of rounded angles until no move helps; the attitudes of the best are what is chosen from, beside those
//! they began with. The cardinal attitudes stay among them, and the best scheme of these is one to begin with, so that
//! no free scheme is worse.

use obsdeg_core::model::Scheme;
use obsdeg_core::model::{Angle, Carry, Euler, Gimbals, c_n_f64, format_decimal};
use obsdeg_evidence::simulation::Conditions;
use obsdeg_exact::SplitMix64;
use rayon::prelude::*;

use super::best::{Best, Scored};
use super::certificate::Everywhere;
use super::information::Evaluator;
use super::search::{Progress, Search};
use super::task::Task;
use super::ways::Stop;
use super::{Candidates, DesignError, DesignOptions, Prepared, QUICK};

/// Half a turn in 1e-9 degrees.
const HALF: i64 = 180_000_000_000;
/// The largest move of an angle, in 1e-9 degrees.
const FARTHEST: i64 = HALF / 4;
/// What rounding is held against: hundredths of a degree.
const FINE: i64 = 10_000_000;
/// Schemes that are moved, of different criteria: found by exchange, and at random.
const MOVED: usize = 8;
const RANDOM: usize = 8;
/// Attitudes of the weights that schemes are exchanged from, heaviest first.
const WEIGHED: usize = 48;
/// Those of them whose attitudes are chosen from.
const CHOSEN: usize = 2;
/// Criteria that differ by less than this part are those of images of one scheme.
const ALIKE: f64 = 1e-6;
/// Rounds over all positions at one size of moves, and over all sizes, at most.
const ROUNDS: usize = 40;
const CYCLES: usize = 6;

/// What a search for free attitudes chooses from, and where it begins.
pub(super) struct Free {
    /// What no scheme of any attitudes is below.
    pub(super) every: Everywhere,
    /// The cardinal attitudes, those of the weights, and those of the schemes that were moved.
    pub(super) candidates: Candidates,
    /// Schemes to begin with.
    starts: Vec<Vec<Euler>>,
    /// Sequences that were evaluated to find them.
    examined: u64,
    /// No scheme of the cardinal attitudes has a smaller worst degree, or a smaller criterion.
    cardinal: Option<(usize, f64)>,
    /// The best that was found with angles in hundredths of a degree.
    pub(super) finer: Option<Moved>,
}

/// A scheme that was moved.
#[derive(Debug, Clone)]
pub(super) struct Moved {
    /// How far limits are missed.
    violation: f64,
    /// The criterion.
    pub(super) value: f64,
    pub(super) scheme: Vec<Euler>,
    /// Schemes that were evaluated on the way.
    examined: u64,
}

impl Moved {
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        self.violation.total_cmp(&other.violation).then(self.value.total_cmp(&other.value))
    }
}

/// The task with the cardinal attitudes.
fn of_cardinals(options: &DesignOptions) -> DesignOptions {
    DesignOptions { candidates: Candidates::cardinals(), free: None, front: Vec::new(), ..options.clone() }
}

impl Free {
    /// The attitudes for a task whose candidates are where the search for them begins; angles are multiples of `step` 1e-9 degrees.
    ///
    /// # Errors
    /// [`DesignError`].
    pub(super) fn new(
        base: &Scheme,
        conditions: &Conditions,
        options: &DesignOptions,
        step: i64,
        progress: &(dyn Fn(Progress) -> bool + Sync),
    ) -> Result<Self, DesignError> {
        let going = || progress(super::NOTHING_YET);
        let wrong = |found: String| DesignError::Free { found };
        let k = options.positions.ok_or_else(|| wrong("no number of positions".into()))?;
        if base.carry != Carry::Reset {
            return Err(wrong(format!("{} carry", base.carry)));
        }
        if step <= 0 {
            return Err(wrong(format!("angles rounded to {} degrees", format_decimal(step))));
        }
        let prepared = Prepared::new(base, conditions, options, &going)?;
        prepared.check(k)?;
        if prepared.evaluator.bias.is_some() {
            return Err(wrong("noise of Z that is correlated from position to position".into()));
        }
        if !prepared.evaluator.prior.is_alike() {
            return Err(wrong("priors of psi that differ by axis".into()));
        }
        let every = prepared.evaluator.everywhere(&prepared.task.criterion, k, &going);
        let every = every.ok_or(DesignError::Interrupted)?;
        let (mut candidates, _) = Candidates::cardinals().within(&base.gimbals);
        let mut out = Self {
            every,
            candidates: candidates.clone(),
            starts: Vec::new(),
            examined: 0,
            cardinal: None,
            finer: None,
        };
        if !candidates.attitudes.is_empty() {
            out.begin_with_cardinals(base, conditions, options, k, progress)?;
        }
        let mut support: Vec<&(Euler, f64)> = out.every.support.iter().collect();
        support.sort_by(|a, b| b.1.total_cmp(&a.1));
        for (euler, _) in support.into_iter().take(WEIGHED) {
            candidates.add(euler.each_ref().map(|angle| rounded(angle, step)));
        }
        out.candidates = candidates;
        // schemes of these, by exchange
        let chosen = DesignOptions { candidates: out.candidates.clone(), ..options.clone() };
        let prepared = Prepared::new(base, conditions, &chosen, &going)?;
        let task = &prepared.task;
        let search = Search { keep: options.restarts as usize, ..prepared.search(progress) };
        let best = search.exchange(k, &task.sequences_of(&out.starts), options.restarts, options.seed);
        out.examined += best.examined;
        let exchanged = unlike(&best.found);
        let attitudes = |scored: &Scored| task.placed(scored).0;
        out.starts.extend(exchanged.iter().take(options.keep.max(MOVED)).map(|s| attitudes(s)));
        let mut rng = SplitMix64::new(options.seed ^ 0x726f_756e_6465_6421);
        let random = (0..RANDOM).filter_map(|_| random(k, step, &base.gimbals, &mut rng));
        let first: Vec<Vec<Euler>> =
            exchanged.iter().take(MOVED).map(|s| attitudes(s)).chain(random).collect();
        let moved = first.par_iter().map(|start| task.rounded(&prepared.evaluator, start, step, &going));
        let mut moved: Vec<[Moved; 2]> = moved.collect();
        out.examined += moved.iter().flatten().map(|m| m.examined).sum::<u64>();
        let finer = moved.iter().map(|[finer, _]| finer).min_by(|a, b| a.order(b));
        out.finer = finer.filter(|f| f.violation == 0.0 && f.value.is_finite()).cloned();
        moved.sort_by(|[_, a], [_, b]| a.order(b));
        for [_, Moved { scheme, .. }] in moved.into_iter().take(CHOSEN) {
            scheme.iter().for_each(|euler| out.candidates.add(euler.clone()));
            out.starts.push(scheme);
        }
        Ok(out)
    }

    /// The best schemes of the cardinal attitudes that an exchange finds, and what none of them is below.
    fn begin_with_cardinals(
        &mut self,
        base: &Scheme,
        conditions: &Conditions,
        options: &DesignOptions,
        k: usize,
        progress: &(dyn Fn(Progress) -> bool + Sync),
    ) -> Result<(), DesignError> {
        let going = || progress(super::NOTHING_YET);
        let options = of_cardinals(options);
        let prepared = Prepared::new(base, conditions, &options, &going)?;
        if prepared.check(k).is_err() {
            return Ok(());
        }
        let search = prepared.search(progress);
        let bound = prepared.task.bound(&prepared.evaluator, k, &going);
        self.cardinal = Some((search.floor, bound.map_or(0.0, |b| b.value)));
        let best = search.exchange(k, &[], options.restarts, options.seed);
        self.examined += best.examined;
        self.starts.extend(best.found.iter().take(1).map(|s| prepared.task.placed(s).0));
        Ok(())
    }

    /// The best of the candidates, which `prepared` has; all of them where they are few, with the number of sets and sequences.
    ///
    /// # Errors
    /// [`DesignError`].
    pub(super) fn searched(
        &self,
        prepared: &Prepared<'_>,
        search: &Search<'_>,
        k: usize,
    ) -> Result<(Best, Option<(u64, u64)>), DesignError> {
        let task = &prepared.task;
        let space = task.space(k, &prepared.evaluator).filter(|space| space.1 < QUICK);
        if space.is_some() {
            return Ok((search.exhaust(&task.symmetry, k), space));
        }
        let mut best = search.exchange(k, &task.sequences_of(&self.starts), 0, task.options.seed);
        let better = |(degree, least): (usize, f64)| {
            best.found.first().is_some_and(|f| f.worth.degree <= degree && f.worth.value <= least)
        };
        if best.complete && self.cardinal.is_some_and(|cardinal| !better(cardinal)) {
            // what the cardinal attitudes can do is not beaten: then it is sought as it is without free ones
            let options = of_cardinals(task.options);
            let going = || (search.progress)(super::NOTHING_YET);
            let cardinal = Prepared::new(task.base, prepared.conditions, &options, &going)?;
            let bound = cardinal.task.bound(&cardinal.evaluator, k, &going);
            let (found, _) = cardinal.searched(&cardinal.search(search.progress), k, bound.as_ref());
            let starts: Vec<Vec<Euler>> = found.found.iter().map(|s| cardinal.task.placed(s).0).collect();
            best.examined += found.examined;
            best.merge(search.keep, search.exchange(k, &task.sequences_of(&starts), 0, task.options.seed));
        }
        best.examined += self.examined;
        Ok((best, None))
    }
}

/// The multiple of `step` that is nearest.
fn rounded(angle: &Angle, step: i64) -> Angle {
    Angle::from_nanodeg((angle.nanodeg() as f64 / step as f64).round() as i64 * step)
}

/// Those of different criteria, best first.
fn unlike(found: &[Scored]) -> Vec<&Scored> {
    let mut out: Vec<&Scored> = Vec::new();
    for scored in found {
        let alike = |last: &&Scored| {
            last.worth.degree == scored.worth.degree && scored.worth.value <= last.worth.value * (1.0 + ALIKE)
        };
        if !out.last().is_some_and(alike) {
            out.push(scored);
        }
    }
    out
}

/// `k` attitudes with angles that are multiples of `step`; `None` where the gimbals reach few of them.
fn random(k: usize, step: i64, gimbals: &Gimbals, rng: &mut SplitMix64) -> Option<Vec<Euler>> {
    const TRIES: usize = 1000;
    let mut within = |most: i64| {
        let most = most / step;
        Angle::from_nanodeg((rng.below(2 * most as u64 + 1) as i64 - most) * step)
    };
    let drawn = (0..TRIES).map(|_| [within(HALF), within(HALF / 2), within(HALF)]);
    let out: Vec<Euler> = drawn.filter(|euler| gimbals.reach(euler)).take(k).collect();
    (out.len() == k).then_some(out)
}

/// Attitudes around one: every angle moved by `by`, either way or not, and a multiple of `step` as before.
fn around(euler: &Euler, by: i64, step: i64) -> impl Iterator<Item = Euler> {
    let at = euler.each_ref().map(Angle::nanodeg);
    (0..27).filter(|i| *i != 13).filter_map(move |i| {
        let ways: [i64; 3] = [i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1];
        within_a_turn(std::array::from_fn(|axis| at[axis] + ways[axis] * by), step)
    })
}

/// The same attitude with beta up to a quarter of a turn and the others up to half of one, where half a turn is a multiple of
/// `step`; where it is not, none beyond them.
fn within_a_turn(at: [i64; 3], step: i64) -> Option<Euler> {
    let wrapped = |x: i64| {
        if x > HALF {
            x - 2 * HALF
        } else if x <= -HALF {
            x + 2 * HALF
        } else {
            x
        }
    };
    let [alpha, beta, gamma] = match (HALF % step, at[1].abs() > HALF / 2) {
        (0, false) => [wrapped(at[0]), at[1], wrapped(at[2])],
        // Mx(180) My(180 - beta) Mz(180) = My(beta)
        (0, true) => [wrapped(at[0] + HALF), wrapped(HALF - at[1]), wrapped(at[2] + HALF)],
        (_, beyond) => {
            let far = beyond || at[0].abs().max(at[2].abs()) > HALF;
            return (!far).then(|| at.map(Angle::from_nanodeg));
        }
    };
    Some([alpha, beta, gamma].map(Angle::from_nanodeg))
}

impl Task<'_> {
    /// Sequences of attitudes that are candidates.
    fn sequences_of(&self, schemes: &[Vec<Euler>]) -> Vec<Vec<Stop>> {
        let matrix = |euler: &Euler| c_n_f64(euler).map(|row| row.map(|x| (x * 1e9).round() as i64));
        let known: Vec<_> = self.candidates.attitudes.iter().map(matrix).collect();
        let place = |euler: &Euler| known.iter().position(|c| *c == matrix(euler)).map(Stop::from);
        schemes.iter().filter_map(|scheme| scheme.iter().map(place).collect()).collect()
    }

    /// A scheme moved with angles in hundredths of a degree, and with multiples of `step` 1e-9 degrees.
    fn rounded(
        &self,
        evaluator: &Evaluator,
        start: &[Euler],
        step: i64,
        going: &(dyn Fn() -> bool + Sync),
    ) -> [Moved; 2] {
        let to_step = |scheme: &[Euler]| -> Vec<Euler> {
            scheme.iter().map(|euler| euler.each_ref().map(|angle| rounded(angle, step))).collect()
        };
        let first = self.moved(evaluator, &to_step(start), step, going);
        if step <= FINE {
            return [first.clone(), Moved { examined: 0, ..first }];
        }
        let finer = self.moved(evaluator, &first.scheme, FINE, going);
        let again = self.moved(evaluator, &to_step(&finer.scheme), step, going);
        let examined = first.examined + again.examined;
        let best = if again.order(&first).is_lt() { again } else { first };
        [finer, Moved { examined, ..best }]
    }

    /// A scheme moved on the grid of multiples of `step` 1e-9 degrees: one position after the other goes where the criterion is
    /// smallest around it, by smaller and smaller moves, until none helps.
    fn moved(
        &self,
        evaluator: &Evaluator,
        start: &[Euler],
        step: i64,
        going: &(dyn Fn() -> bool + Sync),
    ) -> Moved {
        let k = start.len();
        let mut root = Vec::new();
        let mut of = |here: &Evaluator, sequence: &[Stop], scheme: Vec<Euler>| {
            let state = here.state_of(sequence);
            let violation = if scheme.iter().all(|e| self.base.gimbals.reach(e)) {
                self.constraints.violation(here, sequence, &state, &mut root)
            } else {
                f64::INFINITY
            };
            let value = here.value(&state, &self.criterion, &mut root);
            Moved { violation, value, scheme, examined: 0 }
        };
        let order: Vec<Stop> = (0..k).map(Stop::from).collect();
        let mut here = evaluator.along(&start.iter().map(c_n_f64).collect::<Vec<_>>());
        let (mut best, mut examined) = (of(&here, &order, start.to_vec()), 1);
        let sizes = std::iter::successors(Some(step), |by| Some(by * 2));
        let farthest = sizes.take_while(|by| *by <= FARTHEST).last().unwrap_or(step);
        for _ in 0..CYCLES {
            let before = best.clone();
            let mut by = farthest;
            while by >= step {
                for _ in 0..ROUNDS {
                    let round = best.clone();
                    for place in 0..k {
                        let near: Vec<Euler> = around(&best.scheme[place], by, step).collect();
                        let all: Vec<_> = best.scheme.iter().chain(&near).map(c_n_f64).collect();
                        here.stand_at(&all);
                        let (mut order, scheme) = (order.clone(), best.scheme.clone());
                        for (i, euler) in near.into_iter().enumerate() {
                            order[place] = Stop::from(k + i);
                            let mut scheme = scheme.clone();
                            scheme[place] = euler;
                            let there = of(&here, &order, scheme);
                            examined += 1;
                            if there.order(&best).is_lt() {
                                best = there;
                            }
                        }
                    }
                    if !best.order(&round).is_lt() || !going() {
                        break;
                    }
                }
                by /= 2;
            }
            if !best.order(&before).is_lt() || !going() {
                break;
            }
        }
        Moved { examined, ..best }
    }
}
