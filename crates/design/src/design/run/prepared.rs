//! Prepared search: its task, and the evaluator of sequences.

use obsdeg_core::model::{Euler, Path, Scheme, c_n_f64};
use obsdeg_evidence::simulation::Conditions;

use crate::design::certificate::Bound;
use crate::design::certificate::value::excess;
use crate::design::measure::evaluator::Evaluator;
use crate::design::observable::slew_sequences::is_slew_sequence;
use crate::design::request::error::DesignError;
use crate::design::request::limits::{EXHAUSTIVE, MANY, QUICK};
use crate::design::request::options::DesignOptions;
use crate::design::run::task::Task;
use crate::design::search::best::Best;
use crate::design::search::exhaust::Pruning;
use crate::design::search::progress::Progress;
use crate::design::search::score::Scored;
use crate::design::search::scoring::SequenceSearch;
use crate::design::search::screen::Screen;

/// Number of schemes of least sigma that are kept, to be ranked by total uncertainty, if the search
/// does not count it.
const RANKED: usize = 100;

/// Prepared search: its task, and the evaluator of sequences.
pub(crate) struct PreparedSearch<'a> {
    pub(crate) task: Task<'a>,
    pub(crate) evaluator: Evaluator,
    pub(crate) conditions: &'a Conditions,
    /// Degree of every required coefficient in all candidates together; `None` where it is not
    /// observable.
    pub(crate) degrees: Vec<Option<usize>>,
    /// Attitudes that the gimbals do not reach.
    pub(crate) beyond: Vec<String>,
}

impl<'a> PreparedSearch<'a> {
    pub(crate) fn new(
        base: &'a Scheme,
        conditions: &'a Conditions,
        options: &'a DesignOptions,
        proceed: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, DesignError> {
        if is_slew_sequence(base) {
            check_slew_sequence(base, conditions, options)?;
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
        let omitted = task.omitted.clone();
        let evaluator =
            Evaluator::interruptible((base, attitudes), &indices, (conditions, omitted), proceed)?;
        if let Some(most) = options.positions.iter().chain(&options.front).max() {
            evaluator.check_immune(&options.immune, *most, conditions)?;
        }
        Ok(Self { task, evaluator, conditions, degrees, beyond })
    }

    pub(crate) fn search<'s>(
        &'s self,
        progress: &'s (dyn Fn(Progress) -> bool + Sync),
    ) -> SequenceSearch<'s> {
        SequenceSearch {
            rows: &self.task.rows,
            slew_sequences: self.task.slew_sequences,
            evaluator: &self.evaluator,
            criterion: &self.task.criterion,
            constraints: &self.task.constraints,
            keep: match self.task.ranks() {
                true => self.task.options.keep.max(RANKED),
                false => self.task.options.keep,
            },
            floor: self.degrees.iter().flatten().max().copied().unwrap_or(0),
            progress,
        }
    }

    /// Checks that schemes of `k` positions can be sufficient at all.
    pub(crate) fn check(&self, k: usize) -> Result<(), DesignError> {
        let impossible = |why| Err(DesignError::Impossible { positions: k, wanted: self.task.wanted(), why });
        if let Some(limit) = self.task.options.total_s
            && limit < k as f64 * self.conditions.dwell_s
        {
            return impossible(format!(
                "{k} times {} s at a position are more than {limit} s",
                self.conditions.dwell_s
            ));
        }
        if self.task.slew_sequences {
            return Ok(());
        }
        let never: Vec<&str> = self.task.never(&self.degrees).collect();
        match never.is_empty() {
            true => Ok(()),
            false => impossible(format!("all together leave {} unobservable", never.join(", "))),
        }
    }

    /// Bounds and incumbents for an exhaustive search; `None` if it excludes nothing.
    pub(crate) fn pruning<'s>(&self, search: &'s SequenceSearch<'_>, k: usize) -> Option<Pruning<'s>> {
        let (_, sequences) = self.task.space(k, &self.evaluator)?;
        (sequences >= MANY).then(|| search.pruning(&self.task.symmetry, k, self.task.options.seed))?
    }

    /// True if an exhaustive search may exclude sequences.
    pub(crate) fn prunes(&self, k: usize) -> bool {
        let many = self.task.space(k, &self.evaluator).is_some_and(|space| space.1 >= MANY);
        many && k >= 3 && Screen::new(&self.evaluator, &self.task.criterion).is_some()
    }

    /// Best sequences. All are searched, with the number of sets and sequences returned, unless they
    /// are too many or `bound` shows that the best of an exchange are good enough.
    pub(crate) fn searched(
        &self,
        search: &SequenceSearch<'_>,
        k: usize,
        bound: Option<&Bound>,
    ) -> (Best, Option<(u64, u64)>) {
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
                options.within.is_none_or(|within| f.score.degree == search.floor && near(f) < within)
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

    /// Numbers of sets and of sequences of an exhaustive search.
    pub(crate) fn exhaustible(&self, k: usize) -> Result<(u64, u64), DesignError> {
        if self.task.slew_sequences {
            return Err(DesignError::SlewSequences { found: "a search of all sequences".into() });
        }
        let too_many = DesignError::TooMany { positions: k, candidates: self.task.rows.candidates() };
        self.task.space(k, &self.evaluator).ok_or(too_many)
    }
}

/// Refuses options that do not apply where torquer errors act in turns.
fn check_slew_sequence(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
) -> Result<(), DesignError> {
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
        Some(found) => Err(DesignError::SlewSequences { found }),
        None => Ok(()),
    }
}
