//! Changes that would meet every requirement, where no scheme does: the nearest scheme, its limiting
//! unknown, and a longer dwell, more positions or other candidates. Every statement is about a scheme
//! that was evaluated; the work is counted, not timed.

use obsdeg_core::model::Scheme;
use obsdeg_evidence::simulation::Conditions;

use crate::design::answer::Found;
use crate::design::measure::stop::Stop;
use crate::design::nearest::Nearest;
use crate::design::nearest::TriedCandidates;
use crate::design::request::candidates::Candidates;
use crate::design::request::error::DesignError;
use crate::design::request::options::{CriterionName, DesignOptions};
use crate::design::run::prepared::PreparedSearch;
use crate::design::search::progress::{NOTHING_YET, Progress};
use crate::design::search::score::Scored;

/// Number of evaluated sequences after which no further step begins.
const WORK: u64 = 400_000;
/// Numbers of restarts of the exchange: for the nearest scheme (half of them for other candidates), and
/// for every other number of positions.
const RESTARTS: u64 = 24;
const FEW_RESTARTS: u64 = 4;
/// Largest number of positions tried beyond the number asked for.
const MORE: usize = 12;
/// Largest factor on the dwell.
const LONGEST: f64 = 1024.0;
/// Steps of the grids of attitudes that are tried, in 1e-9 degrees.
const GRIDS: [i64; 2] = [45_000_000_000, 30_000_000_000];

/// Search for changes that would meet every requirement.
struct AlternativeSearch<'a> {
    base: &'a Scheme,
    conditions: &'a Conditions,
    options: DesignOptions,
    progress: &'a (dyn Fn(Progress) -> bool + Sync),
    out: Nearest,
}

/// Best sequence of an exchange, and its scheme with the outcome of the requirements.
type BestScheme = (Scored, Found);

/// Changes that would meet every requirement; no scheme of `k` positions for `options` meets them.
pub(crate) fn seek(
    base: &Scheme,
    conditions: &Conditions,
    options: &DesignOptions,
    k: usize,
    progress: &(dyn Fn(Progress) -> bool + Sync),
) -> Result<Nearest, DesignError> {
    let options = DesignOptions {
        meet: false,
        criterion: CriterionName::Margin,
        keep: 1,
        refine: false,
        divide: false,
        front: Vec::new(),
        free: None,
        ..options.clone()
    };
    let mut seeking = AlternativeSearch { base, conditions, options, progress, out: Nearest::default() };
    match seeking.all(k) {
        Err(DesignError::Interrupted) => seeking.out.unfinished = true,
        done => done?,
    }
    Ok(seeking.out)
}

impl AlternativeSearch<'_> {
    /// Tries all changes, one kind after the other.
    fn all(&mut self, k: usize) -> Result<(), DesignError> {
        let nearest = self.exchanged(k, None, RESTARTS.min(self.options.restarts), Vec::new())?;
        if let Some((scored, found)) = &nearest {
            self.out.scheme = Some(found.clone());
            self.longer(scored, k)?;
        }
        self.other_candidates(k)?;
        self.more_positions(k, nearest.map(|(scored, _)| scored.sequence))
    }

    /// True if another step may begin.
    fn goes_on(&mut self) -> bool {
        let on = self.out.examined < WORK && (self.progress)(NOTHING_YET);
        self.out.unfinished |= !on;
        on
    }

    /// Best sequence of `k` positions by exchange, from `candidates` or from those of the options;
    /// `None` if none was found or the work is used up.
    fn exchanged(
        &mut self,
        k: usize,
        candidates: Option<Candidates>,
        restarts: u64,
        given: Vec<Vec<Stop>>,
    ) -> Result<Option<BestScheme>, DesignError> {
        if !self.goes_on() {
            return Ok(None);
        }
        let candidates = candidates.unwrap_or_else(|| self.options.candidates.clone());
        let options = DesignOptions { positions: Some(k), candidates, ..self.options.clone() };
        let proceed = || (self.progress)(NOTHING_YET);
        let prepared = PreparedSearch::new(self.base, self.conditions, &options, &proceed)?;
        if prepared.check(k).is_err() {
            return Ok(None);
        }
        let best = prepared.search(self.progress).exchange(k, &given, restarts, options.seed);
        self.out.examined += best.examined;
        self.out.unfinished |= !best.complete;
        for scored in best.found {
            // the verdict may confirm none of the first sequences
            if let Some(found) = prepared.task.found(&prepared.evaluator, &scored)? {
                return Ok(Some((scored, found)));
            }
        }
        Ok(None)
    }

    /// Finds the shortest dwell with which the nearest scheme meets the requirements: by factors of
    /// two, then by bisection.
    fn longer(&mut self, nearest: &Scored, k: usize) -> Result<(), DesignError> {
        let options = DesignOptions { positions: Some(k), ..self.options.clone() };
        let proceed = || (self.progress)(NOTHING_YET);
        let prepared = PreparedSearch::new(self.base, self.conditions, &options, &proceed)?;
        let known = self.conditions.dwell_s;
        let mut examined = 0;
        let mut tried = |dwell_s: f64| -> Result<Option<Found>, DesignError> {
            // dwells with too many steps, or beyond the time limit
            let Ok(there) = prepared.evaluator.clone().with_dwell(dwell_s) else { return Ok(None) };
            examined += 1;
            if !prepared.task.constraints.keep(&there, &nearest.sequence) {
                return Ok(None);
            }
            let value = there.of_sequence(&nearest.sequence, &prepared.task.criterion);
            let mut scored = nearest.clone();
            scored.score.value = value;
            let found = prepared.task.all_found(&there, &[scored])?;
            Ok(found.into_iter().next().filter(|f| f.requirements.all_met()))
        };
        let (mut short, mut long, mut found) = (known, known, None);
        while found.is_none() && long < known * LONGEST && proceed() {
            short = long;
            long = rounded_up(2.0 * long);
            found = tried(long)?;
        }
        self.out.longest_s = long;
        while found.is_some() && long > short * 1.01 && proceed() {
            let middle = rounded_up(0.5 * (short + long));
            if middle >= long {
                break;
            }
            match tried(middle)? {
                Some(better) => (long, found) = (middle, Some(better)),
                None => short = middle,
            }
        }
        self.out.examined += examined;
        self.out.dwell = found;
        Ok(())
    }

    /// Tries grids of attitudes within the gimbals other than the present candidates.
    fn other_candidates(&mut self, k: usize) -> Result<(), DesignError> {
        for step in GRIDS {
            let grid = Candidates::grid(step)?;
            let chosen = &self.options.candidates.names;
            if grid.names.iter().all(|name| chosen.contains(name)) || !self.goes_on() {
                continue;
            }
            // torquer errors act between cardinal attitudes only, and turns between too many attitudes
            // do not fit in memory
            let best = match self.exchanged(k, Some(grid), RESTARTS / 2, Vec::new()) {
                Err(
                    DesignError::SlewSequences { .. }
                    | DesignError::Pairs { .. }
                    | DesignError::Candidates { .. },
                ) => return Ok(()),
                best => best?,
            };
            let name = format!("grid:{}", step / 1_000_000_000);
            let best = best.map(|(_, found)| found);
            let does = best.as_ref().is_some_and(|f| f.requirements.all_met());
            self.out.candidates.push(TriedCandidates { name, best });
            if does {
                break;
            }
        }
        Ok(())
    }

    /// Tries larger numbers of positions one after the other; each begins with the best sequence before
    /// and one position more.
    fn more_positions(&mut self, k: usize, nearest: Option<Vec<Stop>>) -> Result<(), DesignError> {
        let mut known = nearest;
        self.out.most = k;
        for more in k + 1..=(k + MORE).min(100) {
            let longer = known.take().map(|mut sequence| {
                sequence.extend(sequence.last().copied().map(|last| Stop::from(last.candidate)));
                sequence
            });
            if !self.goes_on() {
                return Ok(());
            }
            let best = self.exchanged(more, None, FEW_RESTARTS, longer.into_iter().collect())?;
            self.out.most = more;
            let Some((scored, found)) = best else { continue };
            if found.requirements.all_met() {
                self.out.positions = Some(found);
                return Ok(());
            }
            known = Some(scored.sequence);
        }
        Ok(())
    }
}

/// Number rounded up to three digits.
fn rounded_up(x: f64) -> f64 {
    let unit = 10f64.powi(x.log10().floor() as i32 - 2);
    if unit < 1.0 { (x / unit - 1e-9).ceil() / (1.0 / unit).round() } else { (x / unit - 1e-9).ceil() * unit }
}
