//! The sequences that a search keeps: the best, the front of time against the criterion, ties.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::design::search::score::{Score, Scored, before};
use crate::design::search::ties::{TIE, Ties};

/// Best sequences, best first, and the front of time against the criterion.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Best {
    /// Best sequences that were found, best first, up to the number to keep.
    pub found: Vec<Scored>,
    /// Sequences of the smallest worst degree that none of these beats in both time and criterion, by time.
    pub front: Vec<Scored>,
    /// Number of sequences as good as the best, by criterion.
    pub ties: Ties,
    /// True if the search was complete.
    pub complete: bool,
    /// Number of sequences whose sigma was computed.
    pub examined: u64,
    /// Number of sequences, observable or not, that a bound excluded: they are worse than those kept.
    pub excluded: u64,
    /// Number of examined sequences that are observable (by the exact verdict, of repositioning at once) but
    /// whose samples do not determine the required coefficients in double precision.
    pub lost: u64,
}

impl Best {
    /// True if a sequence would be kept.
    pub(crate) fn wants(&self, keep: usize, score: &Score, seconds: f64) -> bool {
        score.is_valid()
            && (self.found.len() < keep
                || self.found.last().is_some_and(|last| !last.score.better_than(score))
                || self.is_on_front(score, seconds))
    }

    fn is_on_front(&self, score: &Score, seconds: f64) -> bool {
        let degree = self.front.first().map_or(usize::MAX, |f| f.score.degree);
        score.degree < degree
            || score.degree == degree
                && !self.front.iter().any(|f| f.seconds <= seconds && f.score.value <= score.value)
    }

    /// True if an equal sequence on the front is later in lexicographic order. The new one replaces it,
    /// so the front does not depend on the order of the search.
    fn is_before_its_equal(&self, new: &Scored) -> bool {
        let equal = |f: &&Scored| {
            f.score.degree == new.score.degree && f.seconds == new.seconds && f.score.value == new.score.value
        };
        self.front.iter().find(equal).is_some_and(|f| new.sequence < f.sequence)
    }

    pub(crate) fn add(&mut self, keep: usize, new: Scored) {
        if !new.score.is_valid() {
            return;
        }
        self.add_to_front(&new);
        let place = self.found.partition_point(|b| before(b, &new));
        if place < keep && self.found.get(place).is_none_or(|b| b.sequence != new.sequence) {
            self.found.insert(place, new);
            self.found.truncate(keep);
        }
    }

    /// Adds a sequence to the front unless another of no larger degree takes no more time and has no
    /// larger criterion; removes those that it beats.
    fn add_to_front(&mut self, new: &Scored) {
        if self.is_on_front(&new.score, new.seconds) || self.is_before_its_equal(new) {
            let beaten = |f: &Scored| {
                f.score.degree > new.score.degree
                    || f.seconds >= new.seconds && f.score.value >= new.score.value
            };
            self.front.retain(|f| !beaten(f));
            let place = self.front.partition_point(|f| f.seconds < new.seconds);
            self.front.insert(place, new.clone());
        }
    }

    /// Largest criterion of a sequence that may still be kept where all sequences take the same time:
    /// among the best `keep`, or as a tie of the first. `known` were found before, with the same worst
    /// degree.
    pub(crate) fn limit(&self, keep: usize, known: &Self) -> f64 {
        let value = |of: &Self, place: usize| of.found.get(place).map_or(f64::INFINITY, |s| s.score.value);
        let least = |place: usize| value(self, place).min(value(known, place));
        least(keep - 1).max(least(0) * (1.0 + TIE))
    }

    /// Adds the results of another search.
    pub(crate) fn merge(&mut self, keep: usize, other: Self) {
        for s in other.found.into_iter().chain(other.front) {
            self.add(keep, s);
        }
        self.ties.merge(other.ties);
        self.complete &= other.complete;
        self.examined += other.examined;
        self.excluded += other.excluded;
        self.lost += other.lost;
    }
}
