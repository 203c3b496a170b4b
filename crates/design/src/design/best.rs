//! What sequences are worth, and those that are kept.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ties::{TIE, Ties};
use super::ways::Stop;

/// Score of a sequence, better first: constraints kept, then a small worst degree, then a small criterion.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize, JsonSchema)]
pub struct Worth {
    /// Violation of time limits, requirements and degree caps, dimensionless; 0 when kept.
    pub violation: f64,
    /// Largest observable degree of a required coefficient.
    pub degree: usize,
    /// Criterion of the sequence, in the unit of the criterion asked for.
    pub value: f64,
}

impl Worth {
    pub(super) const NONE: Self = Self { violation: f64::INFINITY, degree: usize::MAX, value: f64::INFINITY };

    fn key(&self) -> (f64, usize, f64) {
        (self.violation, self.degree, self.value)
    }

    fn order(&self, other: &Self) -> std::cmp::Ordering {
        let ((a, b, c), (x, y, z)) = (self.key(), other.key());
        a.total_cmp(&x).then(b.cmp(&y)).then(c.total_cmp(&z))
    }

    pub(super) fn better_than(&self, other: &Self) -> bool {
        self.order(other).is_lt()
    }

    pub(super) fn is_valid(&self) -> bool {
        self.violation == 0.0 && self.value.is_finite()
    }
}

/// Sequence of candidates with its score.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scored {
    /// Score: constraints, worst degree and criterion.
    pub worth: Worth,
    /// Total time of dwells and turns, in s.
    pub seconds: f64,
    /// Candidates of the sequence, in order, with the slew paths to them.
    pub sequence: Vec<Stop>,
}

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
    /// Whether a sequence would be kept.
    pub(super) fn wants(&self, keep: usize, worth: &Worth, seconds: f64) -> bool {
        worth.is_valid()
            && (self.found.len() < keep
                || self.found.last().is_some_and(|last| !last.worth.better_than(worth))
                || self.is_on_front(worth, seconds))
    }

    fn is_on_front(&self, worth: &Worth, seconds: f64) -> bool {
        let degree = self.front.first().map_or(usize::MAX, |f| f.worth.degree);
        worth.degree < degree
            || worth.degree == degree
                && !self.front.iter().any(|f| f.seconds <= seconds && f.worth.value <= worth.value)
    }

    /// Whether an equal one of the front comes later in lexicographic order: then the new one takes its place, so that the
    /// front does not depend on the order in which sequences come.
    fn is_before_its_equal(&self, new: &Scored) -> bool {
        let equal = |f: &&Scored| {
            f.worth.degree == new.worth.degree && f.seconds == new.seconds && f.worth.value == new.worth.value
        };
        self.front.iter().find(equal).is_some_and(|f| new.sequence < f.sequence)
    }

    pub(super) fn add(&mut self, keep: usize, new: Scored) {
        if !new.worth.is_valid() {
            return;
        }
        self.add_to_front(&new);
        let place = self.found.partition_point(|b| before(b, &new));
        if place < keep && self.found.get(place).is_none_or(|b| b.sequence != new.sequence) {
            self.found.insert(place, new);
            self.found.truncate(keep);
        }
    }

    /// Keeps a sequence unless another of no larger degree takes no more time and has no larger criterion; drops what
    /// it beats.
    fn add_to_front(&mut self, new: &Scored) {
        if self.is_on_front(&new.worth, new.seconds) || self.is_before_its_equal(new) {
            let beaten = |f: &Scored| {
                f.worth.degree > new.worth.degree
                    || f.seconds >= new.seconds && f.worth.value >= new.worth.value
            };
            self.front.retain(|f| !beaten(f));
            let place = self.front.partition_point(|f| f.seconds < new.seconds);
            self.front.insert(place, new.clone());
        }
    }

    /// The largest criterion that may still count where all sequences take the same time: among the best `keep`, or as a tie of
    /// the first. `known` were found before, of the same worst degree.
    pub(super) fn limit(&self, keep: usize, known: &Self) -> f64 {
        let value = |of: &Self, place: usize| of.found.get(place).map_or(f64::INFINITY, |s| s.worth.value);
        let least = |place: usize| value(self, place).min(value(known, place));
        least(keep - 1).max(least(0) * (1.0 + TIE))
    }

    /// Takes over what another found.
    pub(super) fn merge(&mut self, keep: usize, other: Self) {
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

/// Ties in lexicographic order.
fn before(a: &Scored, b: &Scored) -> bool {
    a.worth.order(&b.worth).then_with(|| a.sequence.cmp(&b.sequence)).is_lt()
}
