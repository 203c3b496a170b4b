//! Exhaustion: all sequences that begin with given starts, traversed with shared states of their
//! prefixes.

use std::collections::BTreeMap;

use obsdeg_exact::parallel;

use crate::design::measure::evaluator::SequenceState;
use crate::design::measure::stop::Stop;
use crate::design::observable::rows::EnumerationLimits;
use crate::design::observable::sets::Sets;
use crate::design::observable::symmetry::CandidateSymmetry;
use crate::design::search::best::Best;
use crate::design::search::constraints::beyond;
use crate::design::search::progress::{Meter, PATIENCE};
use crate::design::search::score::{Score, Scored};
use crate::design::search::scoring::{SequenceSearch, candidates};
use crate::design::search::screen::{Scratch, Screen};

/// Restarts of the exchange that finds the incumbents for pruning.
const KNOWN_RESTARTS: u64 = 24;
/// Largest number of sequences behind a start, unless starts are too many: some 20 s of work, so an
/// interrupted or killed part loses only minutes.
pub(crate) const MOST_BEHIND: f64 = 2e7;
/// Largest number of starts of more than two positions.
const MOST_STARTS: f64 = 1e6;
/// Number of starts whose results are kept until they are merged.
const BATCH: usize = 4096;

/// Sequences that an exhaustive search covers at once.
pub(crate) enum SearchLevel {
    /// Sequences of one worst degree, whose sets are in the collection.
    Degree(usize, Sets),
    /// All sequences, where order does not matter.
    Any,
}

/// Bounds and incumbents with which an exhaustive search excludes worse sequences.
pub(crate) struct Pruning<'a> {
    screen: Screen<'a>,
    /// Best sequences and front known beforehand, by worst degree.
    known: BTreeMap<usize, Best>,
}

/// Pruning data of one traversal.
struct ActivePruning<'a> {
    screen: &'a Screen<'a>,
    known: &'a Best,
    scratch: Scratch,
    alive: Vec<bool>,
}

/// Traversal of sequences that shares the states of their prefixes.
struct Traversal<'a> {
    search: &'a SequenceSearch<'a>,
    meter: &'a Meter<'a>,
    states: Vec<SequenceState>,
    root: Vec<f64>,
    variances: Vec<f64>,
    sequence: Vec<Stop>,
    /// Working space.
    members: Vec<usize>,
    best: Best,
    pruned: Option<ActivePruning<'a>>,
    /// Number of positions added to sequences.
    pushed: u64,
    stopped: bool,
}

impl<'a> Traversal<'a> {
    fn new(search: &'a SequenceSearch<'a>, meter: &'a Meter<'a>, k: usize) -> Self {
        Self {
            search,
            meter,
            states: (0..=k).map(|_| search.evaluator.start()).collect(),
            root: Vec::new(),
            variances: Vec::new(),
            sequence: Vec::with_capacity(k),
            members: Vec::with_capacity(k),
            best: Best::default(),
            pruned: None,
            pushed: 0,
            stopped: false,
        }
    }

    /// Adds a position to the sequence; true if times are within the limits. The last position of a
    /// sequence is added without effects of errors that are not estimated; [`Self::score`] adds these
    /// if they count.
    fn push(&mut self, stop: Stop, last: bool) -> bool {
        let (search, depth) = (self.search, self.sequence.len());
        self.pushed += 1;
        if self.pushed.is_multiple_of(PATIENCE) {
            self.stopped = !self.meter.report(0, 0, None);
        }
        let before = self.sequence.last().map(|s| s.candidate);
        let slew = before.map_or(0.0, |before| search.evaluator.slew_s(before, stop.candidate));
        let (behind, ahead) = self.states.split_at_mut(depth + 1);
        match last {
            true => search.evaluator.extend_information(&behind[depth], stop, &mut ahead[0]),
            false => search.evaluator.extend(&behind[depth], stop, &mut ahead[0]),
        }
        self.sequence.push(stop);
        let c = search.constraints;
        beyond(slew, c.slew_s) == 0.0 && beyond(ahead[0].seconds, c.total_s) == 0.0
    }

    /// Scores the present sequence; `images` of it are searched.
    fn score(&mut self, degree: usize, images: usize) {
        let (search, depth) = (self.search, self.sequence.len());
        let (behind, ahead) = self.states.split_at_mut(depth);
        let state = &mut ahead[0];
        let mut value =
            search.evaluator.sigma_value(state, search.criterion, &mut self.root, &mut self.variances);
        self.best.examined += 1;
        if self.best.examined.is_multiple_of(PATIENCE) {
            self.stopped = !self.meter.report(0, PATIENCE, self.best.found.first());
        }
        let score = Score { violation: 0.0, degree, value };
        if !score.is_valid() {
            self.best.lost += 1;
            return;
        }
        let seconds = state.seconds;
        let wanted =
            |best: &Best, score: &Score| [best.ties.wants(score), best.wants(search.keep, score, seconds)];
        if wanted(&self.best, &score) == [false; 2] {
            return;
        }
        // the total uncertainty, which is at least the sigma
        if search.evaluator.omitted.is_some() {
            search.evaluator.extend_errors(&behind[depth - 1], self.sequence[depth - 1], state);
            value = search.evaluator.by_root(state, search.criterion, &self.root, &mut self.variances, true);
        }
        let score = Score { value, ..score };
        let [ties, kept] = wanted(&self.best, &score);
        if !ties && !kept {
            return;
        }
        if search.constraints.violation(search.evaluator, &self.sequence, state, &mut self.root) > 0.0 {
            return;
        }
        self.best.ties.add(&score, images, 1);
        if kept {
            let scored = Scored { score, seconds, sequence: self.sequence.clone() };
            self.best.add(search.keep, scored);
        }
    }

    /// Visits all continuations to `k` positions whose sets are in `sets`, all of this worst degree.
    fn visit(&mut self, sets: &Sets, degree: usize, k: usize) {
        let left = k - self.sequence.len();
        if left == 1 {
            return self.visit_last(sets, degree, |_| true);
        }
        if left == 2
            && let Some(mut pruned) = self.pruned.take()
        {
            self.visit_pairs(sets, degree, &mut pruned);
            self.pruned = Some(pruned);
            return;
        }
        let (rows, evaluator) = (self.search.rows, self.search.evaluator);
        let before = self.sequence.last().map(|s| s.candidate);
        for stop in (0..rows.candidates()).flat_map(|c| evaluator.stops(before, c)) {
            if self.push(stop, false) {
                self.visit(sets, degree, k);
            }
            self.sequence.pop();
            if self.stopped {
                return;
            }
        }
    }

    /// Visits all last positions with a candidate for which `among` is true.
    fn visit_last(&mut self, sets: &Sets, degree: usize, among: impl Fn(usize) -> bool) {
        let evaluator = self.search.evaluator;
        let before = self.sequence.last().map(|s| s.candidate);
        let mut members = std::mem::take(&mut self.members);
        set_of(&self.sequence, &mut members);
        let last = sets.completing(&members).filter(|&c| among(c));
        for stop in last.flat_map(|c| evaluator.stops(before, c)) {
            if self.push(stop, true) {
                self.score(degree, 1);
            }
            self.sequence.pop();
            if self.stopped {
                break;
            }
        }
        self.members = members;
    }

    /// Visits all pairs of last positions except those that a bound excludes.
    fn visit_pairs(&mut self, sets: &Sets, degree: usize, pruned: &mut ActivePruning<'_>) {
        let depth = self.sequence.len();
        let ActivePruning { screen, known, scratch, alive } = pruned;
        let candidates = self.search.rows.candidates();
        alive.clear();
        alive.resize(candidates * candidates, true);
        let limit = self.best.limit(self.search.keep, known);
        screen.pairs(&self.states[depth], limit, alive, scratch);
        self.best.excluded += alive.iter().filter(|alive| !**alive).count() as u64;
        for (first, alive) in alive.chunks_exact(candidates).enumerate().filter(|(_, a)| a.contains(&true)) {
            if self.push(first.into(), false) {
                self.visit_last(sets, degree, |second| alive[second]);
            }
            self.sequence.pop();
            if self.stopped {
                return;
            }
        }
    }

    /// Moves to a given sequence; states of the common prefix are kept.
    fn go_to(&mut self, sequence: &[Stop]) -> bool {
        let common = self.sequence.iter().zip(sequence).take_while(|(a, b)| a == b).count();
        self.sequence.truncate(common);
        let mut within = beyond(self.states[common].seconds, self.search.constraints.total_s) == 0.0;
        for &stop in &sequence[common..] {
            within &= self.push(stop, false);
        }
        within
    }
}

impl SequenceSearch<'_> {
    /// Searches all sequences of `k` candidates, with repetitions and both paths of half turns, that
    /// begin with the first candidate of an orbit (where order does not matter: that have one as their
    /// smallest). Worst degrees are searched in order until `keep` sequences are found.
    pub fn exhaust(&self, symmetry: &CandidateSymmetry, k: usize) -> Best {
        self.exhausted(symmetry, k, None)
    }

    /// Exhaustion as [`Self::exhaust`]; where order matters, sequences that a bound excludes are not
    /// evaluated. The sequences kept are the same. Incumbents come from an exchange with `seed`.
    pub fn exhaust_pruned(&self, symmetry: &CandidateSymmetry, k: usize, seed: u64) -> Best {
        let Some(pruning) = self.pruning(symmetry, k, seed) else { return self.exhaust(symmetry, k) };
        let mut best = self.exhausted(symmetry, k, Some(&pruning));
        if !best.complete {
            pruning.known.into_values().for_each(|known| best.merge(self.keep, known));
        }
        best
    }

    fn exhausted(&self, symmetry: &CandidateSymmetry, k: usize, pruning: Option<&Pruning<'_>>) -> Best {
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

    /// Bounds and incumbents for a search of `k` positions; `None` if it excludes nothing.
    pub(crate) fn pruning(&self, symmetry: &CandidateSymmetry, k: usize, seed: u64) -> Option<Pruning<'_>> {
        if k < 3 || self.keep == 0 {
            return None;
        }
        let screen = Screen::new(self.evaluator, self.criterion)?;
        let firsts = symmetry.representatives();
        let exchanged = self.exchange_from(k, &[], KNOWN_RESTARTS, seed, Some(&firsts));
        let mut known: BTreeMap<usize, Best> = BTreeMap::new();
        for mut scored in exchanged.found.into_iter().chain(exchanged.front) {
            // degree as in the sets that are searched
            if let Some(degree) = self.worst(self.rows.degrees(&candidates(&scored.sequence))) {
                scored.score.degree = degree;
                known.entry(degree).or_default().add(self.keep, scored);
            }
        }
        Some(Pruning { screen, known })
    }

    /// Starts of all sequences of an exhaustive search, in order: one or two positions, or more where
    /// too many sequences would follow.
    pub fn starts(&self, symmetry: &CandidateSymmetry, k: usize) -> Vec<Vec<Stop>> {
        self.starts_of(self.depth(symmetry.representatives().len(), k), symmetry)
    }

    /// All sequences of `k` positions, observable or not, the first positions up to symmetry; `None` if
    /// there are more than `most`.
    pub(crate) fn few(&self, symmetry: &CandidateSymmetry, k: usize, most: f64) -> Option<Vec<Vec<Stop>>> {
        let firsts = symmetry.representatives().len() as f64;
        let all = || self.starts_of(k, symmetry);
        (firsts * self.behind(k - 1) <= most && !self.slew_sequences)
            .then(all)
            .filter(|s| s.len() as f64 <= 8.0 * most)
    }

    /// Number of sequences of `positions` further positions.
    fn behind(&self, positions: usize) -> f64 {
        let n = self.rows.candidates();
        match self.evaluator.ordered() {
            true => (n as f64).powi(positions as i32),
            false => multisets(n, positions),
        }
    }

    /// Starts of `depth` positions.
    pub(crate) fn starts_of(&self, depth: usize, symmetry: &CandidateSymmetry) -> Vec<Vec<Stop>> {
        let ordered = self.evaluator.ordered();
        let longer = |start: &[Stop]| -> Vec<Vec<Stop>> {
            let last = start.last().map(|s| s.candidate);
            let least = if ordered { 0 } else { last.unwrap_or(0) };
            let stops = (least..self.rows.candidates())
                .flat_map(|c| self.evaluator.stops(last, c))
                .collect::<Vec<_>>();
            stops.into_iter().map(|stop| [start, &[stop]].concat()).collect()
        };
        let firsts: Vec<Vec<Stop>> = symmetry.representatives().into_iter().map(|a| vec![a.into()]).collect();
        (1..depth).fold(firsts, |starts, _| starts.iter().flat_map(|start| longer(start)).collect())
    }

    /// Number of positions of a start; `firsts` is the number of first positions.
    fn depth(&self, firsts: usize, k: usize) -> usize {
        let starts = |depth: usize| firsts as f64 * self.behind(depth - 1);
        let mut depth = k.min(2);
        while depth + 2 < k && self.behind(k - depth) > MOST_BEHIND && starts(depth + 1) <= MOST_STARTS {
            depth += 1;
        }
        depth
    }

    /// Work behind every start: its number of sequences, or a number in proportion.
    pub(crate) fn work(&self, starts: &[Vec<Stop>], k: usize) -> Vec<f64> {
        let n = self.rows.candidates();
        let behind = |start: &Vec<Stop>| {
            let left = k - start.len();
            let choices = start.last().map_or(n, |last| n - last.candidate);
            match self.evaluator.ordered() {
                true => 1.0,
                false => multisets(choices, left),
            }
        };
        starts.iter().map(behind).collect()
    }

    /// Levels to search one after the other, smallest worst degree first; `None` when the search was
    /// stopped.
    pub(crate) fn levels_of(&self, k: usize) -> Option<Vec<SearchLevel>> {
        if !self.evaluator.ordered() {
            return Some(vec![SearchLevel::Any]);
        }
        let levels = self.levels(k)?.into_iter().enumerate().filter(|(_, sets)| !sets.is_empty());
        Some(levels.map(|(degree, sets)| SearchLevel::Degree(degree, sets)).collect())
    }

    /// Searches the sequences of one level that begin with the given starts.
    pub(crate) fn exhaust_starts(
        &self,
        starts: &[Vec<Stop>],
        symmetry: &CandidateSymmetry,
        k: usize,
        level: &SearchLevel,
        pruning: Option<&Pruning<'_>>,
    ) -> Best {
        let meter = Meter::new(self.progress, starts.len());
        let from = |start: &Vec<Stop>| match level {
            SearchLevel::Degree(degree, sets) => {
                let known = pruning.and_then(|p| Some((&p.screen, p.known.get(degree)?)));
                self.exhaust_sequences(&meter, start, k, (*degree, sets), known)
            }
            SearchLevel::Any => self.exhaust_sets(&meter, start, k, symmetry),
        };
        let mut best = Best { complete: true, ..Best::default() };
        for batch in starts.chunks(BATCH) {
            let parts = parallel::map(batch.len(), |i| meter.part(|| from(&batch[i])));
            parts.into_iter().for_each(|part| best.merge(self.keep, part));
        }
        Best { complete: !meter.is_stopped(), ..best }
    }

    /// Searches the sequences behind a start whose sets are in `sets`, all of this worst degree.
    fn exhaust_sequences(
        &self,
        meter: &Meter<'_>,
        start: &[Stop],
        k: usize,
        (degree, sets): (usize, &Sets),
        known: Option<(&Screen<'_>, &Best)>,
    ) -> Best {
        let mut traversal = Traversal::new(self, meter, k);
        traversal.pruned = known.map(|(screen, known)| ActivePruning {
            screen,
            known,
            scratch: screen.scratch(),
            alive: Vec::new(),
        });
        if traversal.go_to(start) {
            if start.len() < k {
                traversal.visit(sets, degree, k);
            } else {
                set_of(start, &mut traversal.members);
                if sets.contains(&traversal.members) {
                    traversal.score(degree, 1);
                }
            }
        }
        traversal.best
    }

    /// Searches the sets behind a start, where order does not matter.
    fn exhaust_sets(
        &self,
        meter: &Meter<'_>,
        start: &[Stop],
        k: usize,
        symmetry: &CandidateSymmetry,
    ) -> Best {
        let proceed = || meter.report(0, 0, None);
        let mut traversal = Traversal::new(self, meter, k);
        let mut sequence = Vec::with_capacity(k);
        self.rows.each(
            &candidates(start),
            k,
            true,
            &mut EnumerationLimits::without_budget(&proceed),
            &mut |set| {
                let degree = self.only_degree().or_else(|| self.worst(self.rows.degrees(set)));
                sequence.clear();
                sequence.extend(set.iter().map(|&c| Stop::from(c)));
                if let Some(degree) = degree
                    && traversal.go_to(&sequence)
                {
                    traversal.score(degree, symmetry.searched_images(set));
                }
                !traversal.stopped
            },
        );
        traversal.best
    }

    /// All observable sets of up to `k` candidates within the caps, by worst degree; `None` when the
    /// search was stopped. Each set is judged once and stored as one bit.
    fn levels(&self, k: usize) -> Option<Vec<Sets>> {
        let meter = Meter::new(self.progress, 1);
        let proceed = || meter.report(0, 0, None);
        let candidates = self.rows.candidates();
        let levels: Vec<Sets> = (0..=self.rows.last_order()).map(|_| Sets::none(candidates, k)).collect();
        let judged = |prefix: &[usize], size: usize| {
            let mut patience = EnumerationLimits::without_budget(&proceed);
            self.rows.each(prefix, size, false, &mut patience, &mut |set| {
                let degree = self.only_degree().or_else(|| self.worst(self.rows.degrees(set)));
                degree.inspect(|&degree| levels[degree].add(set));
                true
            });
            patience.budget > 0
        };
        let behind = |first: usize, size: usize| match size {
            1 => judged(&[first], size),
            _ => parallel::all(candidates - first - 1, &|i| judged(&[first, first + 1 + i], size)),
        };
        let sizes = 1..=k.min(candidates);
        let mut all = sizes.map(|size| parallel::all(candidates, &|first| proceed() && behind(first, size)));
        (all.all(|done| done) && proceed()).then_some(levels)
    }
}

/// Number of multisets of `positions` out of `n`.
fn multisets(n: usize, positions: usize) -> f64 {
    (0..positions).map(|i| (n + i) as f64 / (i + 1) as f64).product()
}

/// Writes the candidates of a sequence to `members`, each once and ascending.
fn set_of(sequence: &[Stop], members: &mut Vec<usize>) {
    members.clear();
    members.extend(sequence.iter().map(|s| s.candidate));
    members.sort_unstable();
    members.dedup();
}
