//! Search: candidates, criterion, constraints, and the score of one sequence.

use crate::design::measure::criterion::Criterion;
use crate::design::measure::evaluator::{Evaluator, SequenceState};
use crate::design::measure::stop::Stop;
use crate::design::observable::rows::AttitudeRows;
use crate::design::search::constraints::Constraints;
use crate::design::search::progress::Progress;
use crate::design::search::score::{Score, Scored};

/// Data that all searches share.
pub struct SequenceSearch<'a> {
    /// Exact verdicts of sets.
    pub rows: &'a AttitudeRows,
    /// True if torquer errors act in turns. Sets have no verdict then; a sequence counts if its samples
    /// determine the required coefficients.
    pub slew_sequences: bool,
    /// Evaluator of sigmas.
    pub evaluator: &'a Evaluator,
    /// Criterion to minimise.
    pub criterion: &'a Criterion,
    /// Constraints of the schemes.
    pub constraints: &'a Constraints,
    /// Number of sequences to keep.
    pub keep: usize,
    /// Smallest worst degree that all candidates together allow: no set is better.
    pub floor: usize,
    /// Progress callback: false stops the search.
    pub progress: &'a (dyn Fn(Progress) -> bool + Sync),
}

/// Working space for successive trials.
pub(crate) struct Trial {
    now: SequenceState,
    next: SequenceState,
    root: Vec<f64>,
}

impl Trial {
    pub(crate) fn new(evaluator: &Evaluator) -> Self {
        Self { now: evaluator.start(), next: evaluator.start(), root: Vec::new() }
    }
}

impl SequenceSearch<'_> {
    /// Worst of these degrees; `None` if one is missing or beyond its cap.
    pub(crate) fn worst(&self, degrees: Vec<Option<usize>>) -> Option<usize> {
        let degrees: Vec<usize> = degrees.into_iter().collect::<Option<_>>()?;
        degrees.iter().max().copied().filter(|_| self.constraints.cap(&degrees))
    }

    /// Worst degree of every observable set if it is known beforehand: at least that of all candidates
    /// together, at most the last order. `None` if sets differ.
    pub(crate) fn only_degree(&self) -> Option<usize> {
        if self.slew_sequences {
            return Some(0);
        }
        (self.constraints.degrees.is_none() && self.floor == self.rows.last_order()).then_some(self.floor)
    }

    /// Score and time of a sequence from the state behind its first `known` positions; at least one position
    /// follows. Degrees are those of one field.
    pub(crate) fn score_behind(
        &self,
        (state, known): (&SequenceState, usize),
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
        let score = Score { violation, degree: degree.unwrap_or(usize::MAX), value };
        Scored { score, seconds: state.seconds, sequence: sequence.to_vec() }
    }

    /// Score corrected where the exact verdict, of instantaneous repositioning, misses a coefficient
    /// that slews may determine.
    pub(crate) fn judged(&self, mut scored: Scored) -> Scored {
        if self.slew_sequences {
            return scored;
        }
        let degrees = self.rows.likely_degrees(&candidates(&scored.sequence));
        scored.score.violation += degrees.iter().filter(|d| d.is_none()).count() as f64;
        scored
    }
}

/// Candidates of a sequence.
pub(crate) fn candidates(sequence: &[Stop]) -> Vec<usize> {
    sequence.iter().map(|s| s.candidate).collect()
}
