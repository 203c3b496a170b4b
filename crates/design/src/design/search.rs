//! What every search shares: constraints, progress, what a sequence is worth.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use obsdeg_evidence::requirements::meets;

use super::best::{Best, Scored, Worth};
use super::criterion::{Criterion, Limits};
use super::information::{Evaluator, State};
use super::observability::Rows;
use super::ways::Stop;

/// Sequences between two questions whether to go on.
pub(super) const PATIENCE: u64 = 256;

/// How far a search is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Parts done.
    pub done: u64,
    /// Parts in all.
    pub total: u64,
    /// Sequences whose sigma was computed.
    pub examined: u64,
    /// The best criterion so far; infinite when there is none.
    pub best: f64,
}

/// What a scheme must keep besides observability.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Constraints {
    /// Largest total time with turns, in s.
    pub total_s: Option<f64>,
    /// Longest turn between successive positions, in s.
    pub slew_s: Option<f64>,
    /// Largest sigmas.
    pub sigmas: Option<Limits>,
    /// Largest degree of every required coefficient.
    pub degrees: Option<Vec<usize>>,
}

impl Constraints {
    /// Whether the degrees of the required coefficients are within the caps.
    pub(super) fn cap(&self, degrees: &[usize]) -> bool {
        self.degrees.as_ref().is_none_or(|caps| degrees.iter().zip(caps).all(|(d, cap)| d <= cap))
    }

    /// How far times and sigmas of a sequence, with `state` behind it, are beyond the limits; 0 when they are kept.
    pub(super) fn violation(
        &self,
        evaluator: &Evaluator,
        sequence: &[Stop],
        state: &State,
        root: &mut Vec<f64>,
    ) -> f64 {
        let slew = |w: &[Stop]| evaluator.slew_s(w[0].candidate, w[1].candidate);
        let slews = sequence.windows(2).map(|w| beyond(slew(w), self.slew_s)).sum::<f64>();
        let margin = |limits: &Limits| {
            // a margin has no unit: largest sigma over requirement
            let over = evaluator.value(state, &Criterion::Margin(limits.clone()), root);
            if meets(over, 1.0) { 0.0 } else { over - 1.0 }
        };
        slews + beyond(state.seconds, self.total_s) + self.sigmas.as_ref().map_or(0.0, margin)
    }

    /// Whether times and sigmas of a sequence are within the limits.
    pub(super) fn keep(&self, evaluator: &Evaluator, sequence: &[Stop]) -> bool {
        self.violation(evaluator, sequence, &evaluator.state_of(sequence), &mut Vec::new()) == 0.0
    }
}

/// How far a limit is passed, as a part of it; 0 for what rounding may do.
pub(super) fn beyond(found: f64, limit: Option<f64>) -> f64 {
    limit.map(|l| found / l - 1.0).filter(|over| *over > 1e-9).unwrap_or(0.0)
}

/// What every search shares.
pub struct Search<'a> {
    /// Exact verdicts of sets.
    pub rows: &'a Rows,
    /// Torquer errors act on the way: then a set has no verdict, and those sequences count whose samples determine what is required.
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

/// What the workers of a search report to.
pub(super) struct Meter<'a> {
    progress: &'a (dyn Fn(Progress) -> bool + Sync),
    stopped: AtomicBool,
    done: AtomicU64,
    examined: AtomicU64,
    best: Mutex<f64>,
    total: u64,
}

impl<'a> Meter<'a> {
    pub(super) fn new(search: &Search<'a>, total: usize) -> Self {
        Self {
            progress: search.progress,
            stopped: AtomicBool::new(false),
            done: AtomicU64::new(0),
            examined: AtomicU64::new(0),
            best: Mutex::new(f64::INFINITY),
            total: total as u64,
        }
    }

    /// So much more is done; whether to go on.
    pub(super) fn report(&self, parts: u64, examined: u64, best: Option<&Scored>) -> bool {
        let value = best.map_or(f64::INFINITY, |b| b.worth.value);
        // a poisoned lock comes of a panic that is reported already
        let best = self.best.lock().map_or(value, |mut b| {
            *b = b.min(value);
            *b
        });
        let now = Progress {
            done: self.done.fetch_add(parts, Ordering::Relaxed) + parts,
            total: self.total,
            examined: self.examined.fetch_add(examined, Ordering::Relaxed) + examined,
            best,
        };
        if !(self.progress)(now) && now.done < now.total {
            self.stopped.store(true, Ordering::Relaxed);
        }
        !self.stopped.load(Ordering::Relaxed)
    }

    /// Runs one part, unless the search was stopped.
    pub(super) fn part(&self, work: impl FnOnce() -> Best) -> Best {
        if self.stopped.load(Ordering::Relaxed) {
            return Best::default();
        }
        let best = work();
        self.report(1, best.examined % PATIENCE, best.found.first());
        best
    }

    /// All parts, in their order.
    pub(super) fn gather(&self, keep: usize, parts: Vec<Best>) -> Best {
        let mut out = Best { complete: true, ..Best::default() };
        for part in parts {
            out.merge(keep, part);
        }
        out.complete = !self.is_stopped();
        out
    }

    pub(super) fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}

impl Search<'_> {
    /// The worst of these degrees, if they are within the caps.
    pub(super) fn worst(&self, degrees: Vec<Option<usize>>) -> Option<usize> {
        let degrees: Vec<usize> = degrees.into_iter().collect::<Option<_>>()?;
        degrees.iter().max().copied().filter(|_| self.constraints.cap(&degrees))
    }

    /// The worst degree of every observable set, where it is known beforehand: none is better than all candidates
    /// together, none worse than the last order.
    pub(super) fn only_degree(&self) -> Option<usize> {
        if self.walks {
            return Some(0);
        }
        (self.constraints.degrees.is_none() && self.floor == self.rows.last_order()).then_some(self.floor)
    }

    /// What a sequence is worth, with its time. Its degrees are those of one field.
    pub(super) fn worth(&self, sequence: &[Stop]) -> Scored {
        let state = self.evaluator.state_of(sequence);
        let mut root = Vec::new();
        let value = self.evaluator.value(&state, self.criterion, &mut root);
        let mut violation = self.constraints.violation(self.evaluator, sequence, &state, &mut root);
        let degree =
            self.only_degree().or_else(|| self.worst(self.rows.likely_degrees(&candidates(sequence))));
        if degree.is_none() {
            violation += 1.0;
        }
        let worth = Worth { violation, degree: degree.unwrap_or(usize::MAX), value };
        Scored { worth, seconds: state.seconds, sequence: sequence.to_vec() }
    }

    /// With what the exact verdict misses: slews may determine a coefficient that the verdict, of repositioning at
    /// once, does not.
    pub(super) fn judged(&self, mut scored: Scored) -> Scored {
        if self.walks {
            return scored;
        }
        let degrees = self.rows.likely_degrees(&candidates(&scored.sequence));
        scored.worth.violation += degrees.iter().filter(|d| d.is_none()).count() as f64;
        scored
    }
}

/// The candidates of a sequence.
pub(super) fn candidates(sequence: &[Stop]) -> Vec<usize> {
    sequence.iter().map(|s| s.candidate).collect()
}
