//! The search for good sequences: exhaustion, and coordinate exchange where the space is too large.

use std::collections::HashSet;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use obsdeg_exact::SplitMix64;
use rayon::prelude::*;

use super::criterion::Criterion;
use super::information::{Evaluator, State};
use super::observability::Rows;

/// Rounds of one exchange before it is given up.
const ROUNDS: usize = 50;

/// What a sequence is worth, better first: constraints kept, then a small worst degree, then a small criterion.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Worth {
    /// How far time limits, requirements and degree caps are missed; 0 when kept.
    pub violation: f64,
    /// The largest degree of a required coefficient.
    pub degree: usize,
    /// The criterion.
    pub value: f64,
}

impl Worth {
    const NONE: Self = Self { violation: f64::INFINITY, degree: usize::MAX, value: f64::INFINITY };

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

    fn is_valid(&self) -> bool {
        self.violation == 0.0 && self.value.is_finite()
    }
}

/// A sequence with its worth.
#[derive(Debug, Clone, PartialEq)]
pub struct Scored {
    /// What it is worth.
    pub worth: Worth,
    /// Dwells and turns, in s.
    pub seconds: f64,
    /// The candidates in order.
    pub sequence: Vec<usize>,
}

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
    /// Largest sigma of every required coefficient, in deg/h (per g).
    pub sigmas: Option<Vec<f64>>,
    /// Largest degree of every required coefficient.
    pub degrees: Option<Vec<usize>>,
}

/// The best sequences, best first, and the front of time against the criterion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Best {
    /// At most as many as are kept.
    pub found: Vec<Scored>,
    /// Sequences that none beats in both time and criterion, by time.
    pub front: Vec<Scored>,
    /// Whether everything was searched.
    pub complete: bool,
    /// Sequences whose sigma was computed.
    pub examined: u64,
}

impl Best {
    /// Whether a sequence would be kept.
    fn wants(&self, keep: usize, worth: &Worth, seconds: f64) -> bool {
        worth.is_valid()
            && (self.found.len() < keep
                || self.found.last().is_some_and(|last| !last.worth.better_than(worth))
                || self.is_on_front(worth, seconds))
    }

    fn is_on_front(&self, worth: &Worth, seconds: f64) -> bool {
        !self.front.iter().any(|f| f.seconds <= seconds && f.worth.value <= worth.value)
    }

    fn add(&mut self, keep: usize, new: Scored) {
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

    /// Keeps a sequence unless another takes no more time and has no larger criterion; drops what it beats.
    pub fn add_to_front(&mut self, new: &Scored) {
        if self.is_on_front(&new.worth, new.seconds) {
            self.front.retain(|f| f.seconds < new.seconds || f.worth.value < new.worth.value);
            let place = self.front.partition_point(|f| f.seconds < new.seconds);
            self.front.insert(place, new.clone());
        }
    }

    fn merge(&mut self, keep: usize, other: Self) {
        for s in other.found.into_iter().chain(other.front) {
            self.add(keep, s);
        }
        self.examined += other.examined;
    }
}

/// Ties in lexicographic order.
fn before(a: &Scored, b: &Scored) -> bool {
    a.worth.order(&b.worth).then_with(|| a.sequence.cmp(&b.sequence)).is_lt()
}

/// What every search shares.
pub struct Search<'a> {
    /// Exact verdicts.
    pub rows: &'a Rows,
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
struct Meter {
    stopped: AtomicBool,
    done: AtomicU64,
    examined: AtomicU64,
    best: Mutex<f64>,
    total: u64,
}

impl Meter {
    fn new(total: usize) -> Self {
        Self {
            stopped: AtomicBool::new(false),
            done: AtomicU64::new(0),
            examined: AtomicU64::new(0),
            best: Mutex::new(f64::INFINITY),
            total: total as u64,
        }
    }

    /// Runs one part, unless the search was stopped.
    fn part(&self, search: &Search<'_>, work: impl FnOnce() -> Best) -> Best {
        if self.stopped.load(Ordering::Relaxed) {
            return Best::default();
        }
        let best = work();
        let value = best.found.first().map_or(f64::INFINITY, |b| b.worth.value);
        // a poisoned lock comes of a panic that is reported already
        let best_yet = self.best.lock().map_or(value, |mut b| {
            *b = b.min(value);
            *b
        });
        let now = Progress {
            done: self.done.fetch_add(1, Ordering::Relaxed) + 1,
            total: self.total,
            examined: self.examined.fetch_add(best.examined, Ordering::Relaxed) + best.examined,
            best: best_yet,
        };
        if !(search.progress)(now) && now.done < now.total {
            self.stopped.store(true, Ordering::Relaxed);
        }
        best
    }

    /// All parts, in their order.
    fn gather(&self, keep: usize, parts: Vec<Best>) -> Best {
        let mut out = Best { complete: !self.stopped.load(Ordering::Relaxed), ..Best::default() };
        for part in parts {
            out.merge(keep, part);
        }
        out
    }
}

/// A walk over sequences that shares what their prefixes have in common.
struct Walk<'a> {
    search: &'a Search<'a>,
    states: Vec<State>,
    root: Vec<f64>,
    sequence: Vec<usize>,
    best: Best,
}

impl<'a> Walk<'a> {
    fn new(search: &'a Search<'a>, k: usize) -> Self {
        let states = (0..=k).map(|_| search.evaluator.start()).collect();
        Self { search, states, root: Vec::new(), sequence: Vec::with_capacity(k), best: Best::default() }
    }

    /// Whether the turn is within the limits.
    fn push(&mut self, candidate: usize) -> bool {
        let depth = self.sequence.len();
        let limit = self.search.constraints.slew_s.unwrap_or(f64::INFINITY);
        let slew = self.sequence.last().map_or(0.0, |&last| self.search.evaluator.slew_s(last, candidate));
        let (behind, ahead) = self.states.split_at_mut(depth + 1);
        self.search.evaluator.extend(&behind[depth], candidate, &mut ahead[0]);
        self.sequence.push(candidate);
        let total = self.search.constraints.total_s.unwrap_or(f64::INFINITY);
        slew <= limit && ahead[0].seconds <= total
    }

    /// The sequence as it is.
    fn score(&mut self, degree: usize) {
        let state = &self.states[self.sequence.len()];
        let value = self.search.evaluator.value(state, self.search.criterion, &mut self.root);
        self.best.examined += 1;
        let worth = Worth { violation: 0.0, degree, value };
        if !self.best.wants(self.search.keep, &worth, state.seconds) {
            return;
        }
        if let Some(limits) = &self.search.constraints.sigmas {
            // a margin has no unit
            let margin = Criterion::Margin(limits.clone());
            if self.search.evaluator.value(state, &margin, &mut self.root) > 1.0 {
                return;
            }
        }
        let scored = Scored { worth, seconds: state.seconds, sequence: self.sequence.clone() };
        self.best.add(self.search.keep, scored);
    }

    /// All continuations to `k` positions whose set is observable.
    fn visit(&mut self, sets: &HashSet<u64>, degree: usize, key: u64, k: usize) {
        if self.sequence.len() == k {
            self.score(degree);
            return;
        }
        let last = self.sequence.len() + 1 == k;
        for c in 0..self.search.rows.candidates() {
            let longer = if self.sequence.contains(&c) { key } else { key ^ self.search.rows.key(&[c]) };
            if !last || sets.contains(&longer) {
                if self.push(c) {
                    self.visit(sets, degree, longer, k);
                }
                self.sequence.pop();
            }
        }
    }

    /// One given sequence; the states of what it has in common with the one before are kept.
    fn go_to(&mut self, sequence: &[usize]) -> bool {
        let common = self.sequence.iter().zip(sequence).take_while(|(a, b)| a == b).count();
        self.sequence.truncate(common);
        let mut within =
            self.states[common].seconds <= self.search.constraints.total_s.unwrap_or(f64::INFINITY);
        for &c in &sequence[common..] {
            within &= self.push(c);
        }
        within
    }
}

impl Search<'_> {
    /// The worst degree of a set, if its degrees are within the caps.
    fn worst_degree(&self, set: &[usize]) -> Option<usize> {
        // no set is better than all candidates together, none worse than the last order
        if self.constraints.degrees.is_none() && self.floor == self.rows.last_order() {
            return Some(self.floor);
        }
        let degrees: Option<Vec<usize>> = self.rows.degrees(set).into_iter().collect();
        let degrees = degrees?;
        let capped = self.constraints.degrees.as_ref();
        let kept = capped.is_none_or(|caps| degrees.iter().zip(caps).all(|(d, cap)| d <= cap));
        degrees.into_iter().max().filter(|_| kept)
    }

    /// All sequences of `k` candidates, repeated ones too, that begin with one of `firsts` (where order does not matter: that have one of
    /// them as their smallest), with the smallest worst degree.
    pub fn exhaust(&self, firsts: &[usize], k: usize) -> Best {
        let lead = if k > 1 { self.rows.candidates() } else { 1 };
        let starts: Vec<Vec<usize>> = firsts
            .iter()
            .flat_map(|&a| (0..lead).map(move |b| if k > 1 { vec![a, b] } else { vec![a] }))
            .filter(|s| self.evaluator.ordered() || s.is_sorted())
            .collect();
        let (sets, degree) = if self.evaluator.ordered() { self.sets(k) } else { (HashSet::new(), 0) };
        if self.evaluator.ordered() && sets.is_empty() {
            return Best { complete: true, ..Best::default() };
        }
        let meter = Meter::new(starts.len());
        let from = |start: &Vec<usize>| {
            let mut walk = Walk::new(self, k);
            if self.evaluator.ordered() {
                if walk.go_to(start) && (start.len() < k || sets.contains(&self.rows.key(start))) {
                    walk.visit(&sets, degree, self.rows.key(start), k);
                }
            } else {
                self.rows.each(start, k, true, &mut { u64::MAX }, &mut |set| {
                    if let Some(degree) = self.worst_degree(set)
                        && walk.go_to(set)
                    {
                        walk.score(degree);
                    }
                    true
                });
            }
            walk.best
        };
        let parts = starts.par_iter().map(|start| meter.part(self, || from(start))).collect();
        meter.gather(self.keep, parts)
    }

    /// The keys of all observable sets of up to `k` with the smallest worst degree, and that degree.
    fn sets(&self, k: usize) -> (HashSet<u64>, usize) {
        let (mut keys, mut smallest) = (HashSet::new(), usize::MAX);
        for size in 1..=k.min(self.rows.candidates()) {
            let sets = self.rows.observable_sets(size);
            let degrees: Vec<Option<usize>> = sets.par_iter().map(|s| self.worst_degree(s)).collect();
            for (set, degree) in sets.iter().zip(degrees).filter_map(|(s, d)| Some((s, d?))) {
                if degree < smallest {
                    (keys, smallest) = (HashSet::new(), degree);
                }
                if degree == smallest {
                    keys.insert(self.rows.key(set));
                }
            }
        }
        (keys, smallest)
    }

    /// What a sequence is worth, with its time.
    pub fn worth(&self, sequence: &[usize]) -> Scored {
        let state = self.evaluator.state_of(sequence);
        let mut root = Vec::new();
        let value = self.evaluator.value(&state, self.criterion, &mut root);
        let c = self.constraints;
        let over = |found: f64, limit: Option<f64>| limit.map_or(0.0, |l| (found / l - 1.0).max(0.0));
        let slews = sequence.windows(2).map(|w| over(self.evaluator.slew_s(w[0], w[1]), c.slew_s));
        let mut violation = slews.sum::<f64>() + over(state.seconds, c.total_s);
        if let Some(limits) = &c.sigmas {
            let margin = self.evaluator.value(&state, &Criterion::Margin(limits.clone()), &mut root);
            violation += (margin - 1.0).max(0.0);
        }
        let degree = self.worst_degree(sequence);
        if degree.is_none() {
            violation += 1.0;
        }
        let worth = Worth { violation, degree: degree.unwrap_or(usize::MAX), value };
        Scored { worth, seconds: state.seconds, sequence: sequence.to_vec() }
    }

    /// With what the exact verdict misses: slews may determine a coefficient that the verdict, of repositioning at once, does not.
    fn judged(&self, mut scored: Scored) -> Scored {
        let missing = self.rows.degrees(&scored.sequence).iter().filter(|d| d.is_none()).count();
        scored.worth.violation += missing as f64;
        scored
    }

    /// Coordinate exchange: each place of the sequence takes the candidate that is best there, until none helps. From the
    /// sequences given, then from random ones.
    pub fn exchange(&self, k: usize, given: &[Vec<usize>], restarts: u64, seed: u64) -> Best {
        let candidates = self.rows.candidates();
        let from = |start: u64| {
            let mut rng = SplitMix64::new(seed ^ start.wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let random = || (0..k).map(|_| rng.below(candidates as u64) as usize).collect();
            let mut now = given.get(start as usize).cloned().unwrap_or_else(random);
            let mut best = Best::default();
            let mut held = Scored { worth: Worth::NONE, seconds: 0.0, sequence: now.clone() };
            for _ in 0..ROUNDS {
                let round = held.worth;
                for place in 0..k {
                    for c in 0..candidates {
                        now[place] = c;
                        let other = self.worth(&now);
                        if other.worth.better_than(&held.worth) {
                            let other = self.judged(other);
                            if other.worth.better_than(&held.worth) {
                                held = other;
                            }
                        }
                    }
                    now.copy_from_slice(&held.sequence);
                }
                best.examined += (k * candidates) as u64;
                if !held.worth.better_than(&round) {
                    break;
                }
            }
            best.add(self.keep, held);
            best
        };
        let total = given.len() + restarts as usize;
        let meter = Meter::new(total);
        let parts = (0..total as u64).into_par_iter().map(|start| meter.part(self, || from(start))).collect();
        meter.gather(self.keep, parts)
    }
}
