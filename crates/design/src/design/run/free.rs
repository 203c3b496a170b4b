//! Free attitudes: the support of the weights over all attitudes, and attitudes near it, with rounded
//! angles. All schemes are evaluated at the rounded angles.
//!
//! Schemes begin with the cardinal attitudes, with the rounded support, and at random. Each of their
//! positions then moves on the grid of rounded angles until no move helps. The attitudes of the best
//! become candidates beside the initial ones. The cardinal attitudes stay among them, and the best
//! scheme of these is a start, so no free scheme is worse.

use obsdeg_core::model::{Carry, Euler, Scheme, c_n_f64, format_decimal};
use obsdeg_evidence::simulation::Conditions;
use obsdeg_exact::{SplitMix64, parallel};

use crate::design::certificate::Everywhere;
use crate::design::certificate::WeightedAttitude;
use crate::design::measure::stop::Stop;
use crate::design::polish::rounding::{MovedScheme, Moves, OnGrids, random, rounded};
use crate::design::request::candidates::Candidates;
use crate::design::request::error::DesignError;
use crate::design::request::limits::QUICK;
use crate::design::request::options::DesignOptions;
use crate::design::run::prepared::PreparedSearch;
use crate::design::run::task::Task;
use crate::design::search::best::Best;
use crate::design::search::progress::NOTHING_YET;
use crate::design::search::progress::Progress;
use crate::design::search::score::Scored;
use crate::design::search::scoring::SequenceSearch;

/// Number of schemes by exchange that are moved, with different criteria, and number of random ones.
const MOVED: usize = 8;
const RANDOM: usize = 8;
/// Number of attitudes of the support that schemes are exchanged from, heaviest first.
const WEIGHED: usize = 48;
/// Number of moved schemes whose attitudes become candidates.
const CHOSEN: usize = 2;
/// Relative difference below which criteria belong to images of one scheme.
const ALIKE: f64 = 1e-6;
/// Candidates and starts of a search for free attitudes.
pub(crate) struct Free {
    /// Lower bound over all attitudes with its support.
    pub(crate) every: Everywhere,
    /// Cardinal attitudes, those of the support, and those of the schemes that were moved.
    pub(crate) candidates: Candidates,
    /// Schemes that the exchange starts from.
    starts: Vec<Vec<Euler>>,
    /// Number of sequences evaluated to find them.
    examined: u64,
    /// Lower bounds on the worst degree and on the criterion of schemes of the cardinal attitudes; `None` if
    /// unknown.
    cardinal: Option<(usize, f64)>,
    /// Best scheme with angles in hundredths of a degree; `None` if none was found.
    pub(crate) finer: Option<MovedScheme>,
}

/// Options of the same task with the cardinal attitudes.
fn of_cardinals(options: &DesignOptions) -> DesignOptions {
    DesignOptions { candidates: Candidates::cardinals(), free: None, front: Vec::new(), ..options.clone() }
}

impl Free {
    /// Free attitudes for a task whose candidates are the start of the search for them; angles are
    /// multiples of `step` 1e-9 degrees.
    ///
    /// # Errors
    /// [`DesignError`].
    pub(crate) fn new(
        base: &Scheme,
        conditions: &Conditions,
        options: &DesignOptions,
        step: i64,
        progress: &(dyn Fn(Progress) -> bool + Sync),
    ) -> Result<Self, DesignError> {
        let proceed = || progress(NOTHING_YET);
        let wrong = |found: String| DesignError::Free { found };
        let k = options.positions.ok_or_else(|| wrong("no number of positions".into()))?;
        if base.carry != Carry::Reset {
            return Err(wrong(format!("{} carry", base.carry)));
        }
        if step <= 0 {
            return Err(wrong(format!("angles rounded to {} degrees", format_decimal(step))));
        }
        let prepared = PreparedSearch::new(base, conditions, options, &proceed)?;
        prepared.check(k)?;
        if prepared.evaluator.bias.is_some() {
            return Err(wrong("noise of Z that is correlated from position to position".into()));
        }
        if !prepared.evaluator.prior.is_alike() {
            return Err(wrong("priors of psi that differ by axis".into()));
        }
        let every = prepared.evaluator.everywhere(&prepared.task.criterion, k, &proceed);
        let every = every.ok_or(DesignError::Interrupted)?;
        let (candidates, _) = Candidates::cardinals().within(&base.gimbals);
        let mut out =
            Self { every, candidates, starts: Vec::new(), examined: 0, cardinal: None, finer: None };
        if !out.candidates.attitudes.is_empty() {
            out.begin_with_cardinals(base, conditions, options, k, progress)?;
        }
        out.add_support(step);
        out.add_moved(base, conditions, options, (k, step), progress)?;
        Ok(out)
    }

    /// Adds the heaviest attitudes of the support, rounded to multiples of `step` 1e-9 degrees.
    fn add_support(&mut self, step: i64) {
        let mut support: Vec<&WeightedAttitude> = self.every.support.iter().collect();
        support.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        for WeightedAttitude { angles, .. } in support.into_iter().take(WEIGHED) {
            self.candidates.add(angles.each_ref().map(|angle| rounded(angle, step)));
        }
    }

    /// Adds the best schemes of these candidates, by exchange, and the attitudes of schemes that are moved on
    /// the grid of `step` 1e-9 degrees.
    fn add_moved(
        &mut self,
        base: &Scheme,
        conditions: &Conditions,
        options: &DesignOptions,
        (k, step): (usize, i64),
        progress: &(dyn Fn(Progress) -> bool + Sync),
    ) -> Result<(), DesignError> {
        let proceed = || progress(NOTHING_YET);
        let chosen = DesignOptions { candidates: self.candidates.clone(), ..options.clone() };
        let prepared = PreparedSearch::new(base, conditions, &chosen, &proceed)?;
        let task = &prepared.task;
        let search = SequenceSearch { keep: options.restarts as usize, ..prepared.search(progress) };
        let best = search.exchange(k, &task.sequences_of(&self.starts), options.restarts, options.seed);
        self.examined += best.examined;
        let exchanged = unlike(&best.found);
        let attitudes = |scored: &Scored| task.placed(scored).0;
        self.starts.extend(exchanged.iter().take(options.keep.max(MOVED)).map(|s| attitudes(s)));
        let mut rng = SplitMix64::new(options.seed ^ 0x726f_756e_6465_6421);
        let random = (0..RANDOM).filter_map(|_| random(k, step, &base.gimbals, &mut rng));
        let first: Vec<Vec<Euler>> =
            exchanged.iter().take(MOVED).map(|s| attitudes(s)).chain(random).collect();
        let moves = Moves {
            evaluator: &prepared.evaluator,
            gimbals: &base.gimbals,
            constraints: &task.constraints,
            criterion: &task.criterion,
            proceed: &proceed,
        };
        let mut moved: Vec<OnGrids> = parallel::map(first.len(), |i| moves.rounded(&first[i], step));
        self.examined += moved.iter().map(|m| m.finer.examined + m.on_step.examined).sum::<u64>();
        let finer = moved.iter().map(|m| &m.finer).min_by(|a, b| a.order(b));
        self.finer = finer.filter(|f| f.violation == 0.0 && f.value.is_finite()).cloned();
        moved.sort_by(|a, b| a.on_step.order(&b.on_step));
        for OnGrids { on_step: MovedScheme { scheme, .. }, .. } in moved.into_iter().take(CHOSEN) {
            scheme.iter().for_each(|euler| self.candidates.add(euler.clone()));
            self.starts.push(scheme);
        }
        Ok(())
    }

    /// Finds the best schemes of the cardinal attitudes by exchange, and a lower bound on all of these.
    fn begin_with_cardinals(
        &mut self,
        base: &Scheme,
        conditions: &Conditions,
        options: &DesignOptions,
        k: usize,
        progress: &(dyn Fn(Progress) -> bool + Sync),
    ) -> Result<(), DesignError> {
        let proceed = || progress(NOTHING_YET);
        let options = of_cardinals(options);
        let prepared = PreparedSearch::new(base, conditions, &options, &proceed)?;
        if prepared.check(k).is_err() {
            return Ok(());
        }
        let search = prepared.search(progress);
        let bound = prepared.task.bound(&prepared.evaluator, k, &proceed);
        self.cardinal = Some((search.floor, bound.map_or(0.0, |b| b.value)));
        let best = search.exchange(k, &[], options.restarts, options.seed);
        self.examined += best.examined;
        self.starts.extend(best.found.iter().take(1).map(|s| prepared.task.placed(s).0));
        Ok(())
    }

    /// Best schemes of the candidates of `prepared`. All sequences are searched if they are few; the
    /// numbers of sets and sequences are returned then.
    ///
    /// # Errors
    /// [`DesignError`].
    pub(crate) fn searched(
        &self,
        prepared: &PreparedSearch<'_>,
        search: &SequenceSearch<'_>,
        k: usize,
    ) -> Result<(Best, Option<(u64, u64)>), DesignError> {
        let task = &prepared.task;
        let space = task.space(k, &prepared.evaluator).filter(|space| space.1 < QUICK);
        if space.is_some() {
            return Ok((search.exhaust(&task.symmetry, k), space));
        }
        let mut best = search.exchange(k, &task.sequences_of(&self.starts), 0, task.options.seed);
        let better = |(degree, least): (usize, f64)| {
            best.found.first().is_some_and(|f| f.score.degree <= degree && f.score.value <= least)
        };
        if best.complete && self.cardinal.is_some_and(|cardinal| !better(cardinal)) {
            // no free scheme found beats the bound on the cardinal attitudes: search these as without free
            // attitudes
            let options = of_cardinals(task.options);
            let proceed = || (search.progress)(NOTHING_YET);
            let cardinal = PreparedSearch::new(task.base, prepared.conditions, &options, &proceed)?;
            let bound = cardinal.task.bound(&cardinal.evaluator, k, &proceed);
            let (found, _) = cardinal.searched(&cardinal.search(search.progress), k, bound.as_ref());
            let starts: Vec<Vec<Euler>> = found.found.iter().map(|s| cardinal.task.placed(s).0).collect();
            best.examined += found.examined;
            best.merge(search.keep, search.exchange(k, &task.sequences_of(&starts), 0, task.options.seed));
        }
        best.examined += self.examined;
        Ok((best, None))
    }
}

/// Sequences with different criteria, best first.
fn unlike(found: &[Scored]) -> Vec<&Scored> {
    let mut out: Vec<&Scored> = Vec::new();
    for scored in found {
        let alike = |last: &&Scored| {
            last.score.degree == scored.score.degree && scored.score.value <= last.score.value * (1.0 + ALIKE)
        };
        if !out.last().is_some_and(alike) {
            out.push(scored);
        }
    }
    out
}

impl Task<'_> {
    /// Sequences of the given schemes whose attitudes are candidates.
    fn sequences_of(&self, schemes: &[Vec<Euler>]) -> Vec<Vec<Stop>> {
        let matrix = |euler: &Euler| c_n_f64(euler).map(|row| row.map(|x| (x * 1e9).round() as i64));
        let known: Vec<_> = self.candidates.attitudes.iter().map(matrix).collect();
        let place = |euler: &Euler| known.iter().position(|c| *c == matrix(euler)).map(Stop::from);
        schemes.iter().filter_map(|scheme| scheme.iter().map(place).collect()).collect()
    }
}
