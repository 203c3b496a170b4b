//! The search for good sequences, and exhaustion.

use std::collections::{BTreeMap, HashSet};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use obsdeg_evidence::requirements::meets;
use rayon::prelude::*;

use super::best::{Best, Scored, Worth};
use super::criterion::{Criterion, Limits};
use super::information::{Evaluator, State};
use super::observability::{Patience, Rows};
use super::screen::{Scratch, Screen};
use super::symmetry::Symmetry;
use super::ways::Stop;

/// Restarts of the exchange that finds what an exhaustive search is pruned by.
const KNOWN_RESTARTS: u64 = 24;
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
fn beyond(found: f64, limit: Option<f64>) -> f64 {
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

/// What an exhaustive search takes at once.
pub(super) enum SearchLevel {
    /// All sequences whose set has this worst degree: the keys of these sets.
    Degree(usize, HashSet<u128>),
    /// All sets, where order does not matter.
    Sets,
}

/// What lets an exhaustive search leave out what is worse than sequences that are known beforehand.
pub(crate) struct Pruning<'a> {
    screen: Screen<'a>,
    /// The best sequences and the front known, by worst degree.
    known: BTreeMap<usize, Best>,
}

/// The pruning of one walk.
struct Pruned<'a> {
    screen: &'a Screen<'a>,
    known: &'a Best,
    scratch: Scratch,
    alive: Vec<bool>,
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
        out.complete = !self.stopped.load(Ordering::Relaxed);
        out
    }
}

/// A walk over sequences that shares what their prefixes have in common.
struct Walk<'a> {
    search: &'a Search<'a>,
    meter: &'a Meter<'a>,
    states: Vec<State>,
    root: Vec<f64>,
    sequence: Vec<Stop>,
    best: Best,
    pruned: Option<Pruned<'a>>,
    /// Positions that were put behind others.
    pushed: u64,
    stopped: bool,
}

impl<'a> Walk<'a> {
    fn new(search: &'a Search<'a>, meter: &'a Meter<'a>, k: usize) -> Self {
        Self {
            search,
            meter,
            states: (0..=k).map(|_| search.evaluator.start()).collect(),
            root: Vec::new(),
            sequence: Vec::with_capacity(k),
            best: Best::default(),
            pruned: None,
            pushed: 0,
            stopped: false,
        }
    }

    /// Whether times are within the limits.
    fn push(&mut self, stop: Stop) -> bool {
        let (search, depth) = (self.search, self.sequence.len());
        self.pushed += 1;
        if self.pushed.is_multiple_of(PATIENCE) {
            self.stopped = !self.meter.report(0, 0, None);
        }
        let last = self.sequence.last().map(|s| s.candidate);
        let slew = last.map_or(0.0, |last| search.evaluator.slew_s(last, stop.candidate));
        let (behind, ahead) = self.states.split_at_mut(depth + 1);
        search.evaluator.extend(&behind[depth], stop, &mut ahead[0]);
        self.sequence.push(stop);
        let c = search.constraints;
        beyond(slew, c.slew_s) == 0.0 && beyond(ahead[0].seconds, c.total_s) == 0.0
    }

    /// The sequence as it is; `images` of it are searched.
    fn score(&mut self, degree: usize, images: usize) {
        let (search, state) = (self.search, &self.states[self.sequence.len()]);
        let value = search.evaluator.value(state, search.criterion, &mut self.root);
        self.best.examined += 1;
        if self.best.examined.is_multiple_of(PATIENCE) {
            self.stopped = !self.meter.report(0, PATIENCE, self.best.found.first());
        }
        let worth = Worth { violation: 0.0, degree, value };
        if !worth.is_valid() {
            self.best.lost += 1;
            return;
        }
        let ties = self.best.ties.wants(&worth);
        let kept = self.best.wants(search.keep, &worth, state.seconds);
        if !ties && !kept {
            return;
        }
        if search.constraints.violation(search.evaluator, &self.sequence, state, &mut self.root) > 0.0 {
            return;
        }
        self.best.ties.add(&worth, images, 1);
        if kept {
            let scored = Scored { worth, seconds: state.seconds, sequence: self.sequence.clone() };
            self.best.add(search.keep, scored);
        }
    }

    /// All continuations to `k` positions with one of `sets`, all of this worst degree.
    fn visit(&mut self, sets: &HashSet<u128>, degree: usize, key: u128, k: usize) {
        if self.sequence.len() == k {
            self.score(degree, 1);
            return;
        }
        if self.sequence.len() + 2 == k
            && let Some(mut pruned) = self.pruned.take()
        {
            self.visit_pairs(sets, degree, key, &mut pruned);
            self.pruned = Some(pruned);
            return;
        }
        let (rows, evaluator) = (self.search.rows, self.search.evaluator);
        let before = self.sequence.last().map(|s| s.candidate);
        let last = self.sequence.len() + 1 == k;
        for c in 0..rows.candidates() {
            let there = self.sequence.iter().any(|s| s.candidate == c);
            let longer = if there { key } else { key ^ rows.key(c) };
            if last && !sets.contains(&longer) {
                continue;
            }
            for stop in evaluator.stops(before, c) {
                if self.push(stop) {
                    self.visit(sets, degree, longer, k);
                }
                self.sequence.pop();
                if self.stopped {
                    return;
                }
            }
        }
    }

    /// The same of the last two positions, those left out that a bound excludes.
    fn visit_pairs(&mut self, sets: &HashSet<u128>, degree: usize, key: u128, pruned: &mut Pruned<'_>) {
        let (rows, depth) = (self.search.rows, self.sequence.len());
        let Pruned { screen, known, scratch, alive } = pruned;
        let candidates = rows.candidates();
        alive.clear();
        alive.resize(candidates * candidates, true);
        let limit = self.best.limit(self.search.keep, known);
        screen.pairs(&self.states[depth], limit, alive, scratch);
        self.best.excluded += alive.iter().filter(|alive| !**alive).count() as u64;
        let with = |walk: &Self, key: u128, c: usize| {
            if walk.sequence.iter().any(|s| s.candidate == c) { key } else { key ^ rows.key(c) }
        };
        for (first, alive) in alive.chunks_exact(candidates).enumerate().filter(|(_, a)| a.contains(&true)) {
            let key = with(self, key, first);
            if self.push(first.into()) {
                for second in (0..candidates).filter(|&c| alive[c]) {
                    if sets.contains(&with(self, key, second)) {
                        if self.push(second.into()) {
                            self.score(degree, 1);
                        }
                        self.sequence.pop();
                    }
                    if self.stopped {
                        break;
                    }
                }
            }
            self.sequence.pop();
            if self.stopped {
                return;
            }
        }
    }

    /// One given sequence; the states of what it has in common with the one before are kept.
    fn go_to(&mut self, sequence: &[Stop]) -> bool {
        let common = self.sequence.iter().zip(sequence).take_while(|(a, b)| a == b).count();
        self.sequence.truncate(common);
        let mut within = beyond(self.states[common].seconds, self.search.constraints.total_s) == 0.0;
        for &stop in &sequence[common..] {
            within &= self.push(stop);
        }
        within
    }
}

impl Search<'_> {
    /// The worst of these degrees, if they are within the caps.
    fn worst(&self, degrees: Vec<Option<usize>>) -> Option<usize> {
        let degrees: Vec<usize> = degrees.into_iter().collect::<Option<_>>()?;
        degrees.iter().max().copied().filter(|_| self.constraints.cap(&degrees))
    }

    /// The worst degree of every observable set, where it is known beforehand: none is better than all candidates
    /// together, none worse than the last order.
    fn only_degree(&self) -> Option<usize> {
        if self.walks {
            return Some(0);
        }
        (self.constraints.degrees.is_none() && self.floor == self.rows.last_order()).then_some(self.floor)
    }

    /// All sequences of `k` candidates, repeated ones and both ways of half turns too, that begin with the first of an
    /// orbit (where order does not matter: that have one of them as their smallest). As many of the best as are kept:
    /// worst degrees that are too large for these are not looked at.
    pub fn exhaust(&self, symmetry: &Symmetry, k: usize) -> Best {
        self.exhausted(symmetry, k, None)
    }

    /// The same, where order matters without those that a bound leaves out: what is kept is the same. The bound is held
    /// against what an exchange from `seed` finds first.
    pub fn exhaust_pruned(&self, symmetry: &Symmetry, k: usize, seed: u64) -> Best {
        let Some(pruning) = self.pruning(symmetry, k, seed) else { return self.exhaust(symmetry, k) };
        let mut best = self.exhausted(symmetry, k, Some(&pruning));
        if !best.complete {
            pruning.known.into_values().for_each(|known| best.merge(self.keep, known));
        }
        best
    }

    fn exhausted(&self, symmetry: &Symmetry, k: usize, pruning: Option<&Pruning<'_>>) -> Best {
        let Some(levels) = self.levels_of(k) else { return Best::default() };
        let starts = self.starts(symmetry, k);
        let mut best = Best { complete: true, ..Best::default() };
        for level in levels {
            best.merge(self.keep, self.exhaust_starts(&starts, symmetry, k, &level, pruning));
            if !best.complete || best.found.len() >= self.keep.max(1) {
                break;
            }
        }
        best
    }

    /// What lets a search of `k` positions leave sequences out; `None` where nothing does.
    pub(super) fn pruning(&self, symmetry: &Symmetry, k: usize, seed: u64) -> Option<Pruning<'_>> {
        if k < 3 || self.keep == 0 {
            return None;
        }
        let screen = Screen::new(self.evaluator, self.criterion)?;
        let firsts = symmetry.representatives();
        let exchanged = self.exchange_from(k, &[], KNOWN_RESTARTS, seed, Some(&firsts));
        let mut known: BTreeMap<usize, Best> = BTreeMap::new();
        for mut scored in exchanged.found.into_iter().chain(exchanged.front) {
            // as in the sets that are searched
            if let Some(degree) = self.worst(self.rows.degrees(&candidates(&scored.sequence))) {
                scored.worth.degree = degree;
                known.entry(degree).or_default().add(self.keep, scored);
            }
        }
        Some(Pruning { screen, known })
    }

    /// What every sequence of an exhaustive search begins with, in order: its first one or two positions.
    pub fn starts(&self, symmetry: &Symmetry, k: usize) -> Vec<Vec<Stop>> {
        let ordered = self.evaluator.ordered();
        let second = |a: usize| {
            let least = if ordered { 0 } else { a };
            let stops = (least..self.rows.candidates()).flat_map(move |b| self.evaluator.stops(Some(a), b));
            stops.map(move |b| vec![a.into(), b])
        };
        let firsts = symmetry.representatives();
        match k {
            1 => firsts.into_iter().map(|a| vec![a.into()]).collect(),
            _ => firsts.into_iter().flat_map(second).collect(),
        }
    }

    /// How many sequences are behind every start, or in proportion to that.
    pub(super) fn work(&self, starts: &[Vec<Stop>], k: usize) -> Vec<f64> {
        let n = self.rows.candidates();
        let behind = |start: &Vec<Stop>| {
            let left = k - start.len();
            let choices = start.last().map_or(n, |last| n - last.candidate);
            match self.evaluator.ordered() {
                true => 1.0,
                // multisets of so many
                false => (0..left).map(|i| (choices + i) as f64 / (i + 1) as f64).product(),
            }
        };
        starts.iter().map(behind).collect()
    }

    /// What is searched one after the other, by worst degree; `None` when the search was stopped.
    pub(super) fn levels_of(&self, k: usize) -> Option<Vec<SearchLevel>> {
        if !self.evaluator.ordered() {
            return Some(vec![SearchLevel::Sets]);
        }
        Some(self.levels(k)?.into_iter().map(|(degree, sets)| SearchLevel::Degree(degree, sets)).collect())
    }

    /// The sequences of one level that begin with some of the starts.
    pub(super) fn exhaust_starts(
        &self,
        starts: &[Vec<Stop>],
        symmetry: &Symmetry,
        k: usize,
        level: &SearchLevel,
        pruning: Option<&Pruning<'_>>,
    ) -> Best {
        let meter = Meter::new(self, starts.len());
        let from = |start: &Vec<Stop>| match level {
            SearchLevel::Degree(degree, sets) => {
                let known = pruning.and_then(|p| Some((&p.screen, p.known.get(degree)?)));
                self.exhaust_sequences(&meter, start, k, (*degree, sets), known)
            }
            SearchLevel::Sets => self.exhaust_sets(&meter, start, k, symmetry),
        };
        let parts = starts.par_iter().map(|start| meter.part(|| from(start))).collect();
        meter.gather(self.keep, parts)
    }

    /// The sequences behind a start whose set is one of `sets`, all of this worst degree.
    fn exhaust_sequences(
        &self,
        meter: &Meter<'_>,
        start: &[Stop],
        k: usize,
        (degree, sets): (usize, &HashSet<u128>),
        known: Option<(&Screen<'_>, &Best)>,
    ) -> Best {
        let mut walk = Walk::new(self, meter, k);
        walk.pruned = known.map(|(screen, known)| Pruned {
            screen,
            known,
            scratch: screen.scratch(),
            alive: Vec::new(),
        });
        let (a, b) = (start[0].candidate, start[start.len() - 1].candidate);
        let key = if a == b { self.rows.key(a) } else { self.rows.key(a) ^ self.rows.key(b) };
        if walk.go_to(start) && (start.len() < k || sets.contains(&key)) {
            walk.visit(sets, degree, key, k);
        }
        walk.best
    }

    /// The sets behind a start, where order does not matter.
    fn exhaust_sets(&self, meter: &Meter<'_>, start: &[Stop], k: usize, symmetry: &Symmetry) -> Best {
        let going = || meter.report(0, 0, None);
        let mut walk = Walk::new(self, meter, k);
        let mut sequence = Vec::with_capacity(k);
        self.rows.each(&candidates(start), k, true, &mut Patience::while_going(&going), &mut |set| {
            let degree = self.only_degree().or_else(|| self.worst(self.rows.degrees(set)));
            sequence.clear();
            sequence.extend(set.iter().map(|&c| Stop::from(c)));
            if let Some(degree) = degree
                && walk.go_to(&sequence)
            {
                walk.score(degree, symmetry.searched_images(set));
            }
            !walk.stopped
        });
        walk.best
    }

    /// The keys of all observable sets of up to `k` within the caps, by their worst degree; `None` when the search was
    /// stopped.
    fn levels(&self, k: usize) -> Option<BTreeMap<usize, HashSet<u128>>> {
        let meter = Meter::new(self, 1);
        let going = || meter.report(0, 0, None);
        let mut levels: BTreeMap<usize, HashSet<u128>> = BTreeMap::new();
        for size in 1..=k.min(self.rows.candidates()) {
            let sets = self.rows.observable_sets_while(size, &going)?;
            let judged = |set: &Vec<usize>| {
                let key = set.iter().fold(0, |key, &c| key ^ self.rows.key(c));
                let degree = self.only_degree().or_else(|| self.worst(self.rows.degrees(set)));
                degree.map(|degree| (degree, key))
            };
            let chunks = sets.par_chunks(PATIENCE as usize).map(|chunk| {
                let judged = || chunk.iter().filter_map(judged).collect();
                going().then(judged)
            });
            let chunks: Vec<Vec<(usize, u128)>> = chunks.collect::<Option<_>>()?;
            for (degree, key) in chunks.into_iter().flatten() {
                levels.entry(degree).or_default().insert(key);
            }
        }
        going().then_some(levels)
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
