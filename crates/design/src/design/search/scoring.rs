//! A search: what it chooses from, what it minimises, and the score of one sequence.

use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::{Evaluator, State};
use crate::design::measure::stop::Stop;
use crate::design::observable::rows::Rows;
use crate::design::search::constraints::Constraints;
use crate::design::search::progress::Progress;
use crate::design::search::score::{Scored, Worth};

/// What every search shares.
pub struct Search<'a> {
    /// Exact verdicts of sets.
    pub rows: &'a Rows,
    /// Torquer errors act on the way: then a set has no verdict, and those sequences count whose samples
    /// determine what is required.
    pub walks: bool,
    /// Sigmas.
    pub evaluator: &'a Evaluator,
    /// What is to be small.
    pub criterion: &'a Criterion,
    /// What must be kept.
    pub constraints: &'a Constraints,
    /// How many are kept.
    pub keep: usize,
    /// The smallest worst degree that all candidates together allow: no set is better.
    pub floor: usize,
    /// Hears of progress, says whether to go on.
    pub progress: &'a (dyn Fn(Progress) -> bool + Sync),
}

/// Working space of one trial after the other.
pub(crate) struct Trial {
    now: State,
    next: State,
    root: Vec<f64>,
}

impl Trial {
    pub(crate) fn new(evaluator: &Evaluator) -> Self {
        Self { now: evaluator.start(), next: evaluator.start(), root: Vec::new() }
    }
}

impl Search<'_> {
    /// The worst of these degrees, if they are within the caps.
    pub(crate) fn worst(&self, degrees: Vec<Option<usize>>) -> Option<usize> {
        let degrees: Vec<usize> = degrees.into_iter().collect::<Option<_>>()?;
        degrees.iter().max().copied().filter(|_| self.constraints.cap(&degrees))
    }

    /// The worst degree of every observable set, where it is known beforehand: none is better than all
    /// candidates together, none worse than the last order.
    pub(crate) fn only_degree(&self) -> Option<usize> {
        if self.walks {
            return Some(0);
        }
        (self.constraints.degrees.is_none() && self.floor == self.rows.last_order()).then_some(self.floor)
    }

    /// Score and time of a sequence from the state behind its first `known` positions; at least one position
    /// follows. Degrees are those of one field.
    pub(crate) fn worth_behind(
        &self,
        (state, known): (&State, usize),
        sequence: &[Stop],
        trial: &mut Trial,
    ) -> Scored {
        let Trial { now, next, root } = trial;
        self.evaluator.extend(state, sequence[known], now);
        for &stop in &sequence[known + 1..] {
            self.evaluator.extend(now, stop, next);
            std::mem::swap(now, next);
        }
        let state = &*now;
        let value = self.evaluator.value(state, self.criterion, root);
        let mut violation = self.constraints.violation(self.evaluator, sequence, state, root);
        let degree =
            self.only_degree().or_else(|| self.worst(self.rows.likely_degrees(&candidates(sequence))));
        if degree.is_none() {
            violation += 1.0;
        }
        let worth = Worth { violation, degree: degree.unwrap_or(usize::MAX), value };
        Scored { worth, seconds: state.seconds, sequence: sequence.to_vec() }
    }

    /// With what the exact verdict misses: slews may determine a coefficient that the verdict, of
    /// repositioning at once, does not.
    pub(crate) fn judged(&self, mut scored: Scored) -> Scored {
        if self.walks {
            return scored;
        }
        let degrees = self.rows.likely_degrees(&candidates(&scored.sequence));
        scored.worth.violation += degrees.iter().filter(|d| d.is_none()).count() as f64;
        scored
    }
}

/// The candidates of a sequence.
pub(crate) fn candidates(sequence: &[Stop]) -> Vec<usize> {
    sequence.iter().map(|s| s.candidate).collect()
}
