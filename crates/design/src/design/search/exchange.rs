//! Coordinate exchange, for spaces too large for exhaustion.

use obsdeg_exact::{SplitMix64, parallel};

use crate::design::measure::evaluator::SequenceState;
use crate::design::measure::stop::Stop;
use crate::design::search::best::Best;
use crate::design::search::progress::{Meter, PATIENCE};
use crate::design::search::score::{Score, Scored};
use crate::design::search::scoring::{SequenceSearch, Trial};

/// Largest number of rounds of one exchange.
const ROUNDS: usize = 50;

impl SequenceSearch<'_> {
    /// Stops that may stand at a place, each with the next stop by either slew path.
    fn choices(&self, now: &[Stop], place: usize) -> Vec<(Stop, Option<Stop>)> {
        let last = place.checked_sub(1).map(|p| now[p].candidate);
        let next = now.get(place + 1).map(|next| next.candidate);
        let with_next = |stop: Stop| -> Vec<(Stop, Option<Stop>)> {
            let Some(next) = next else { return vec![(stop, None)] };
            self.evaluator.stops(Some(stop.candidate), next).map(|next| (stop, Some(next))).collect()
        };
        (0..self.rows.candidates()).flat_map(|c| self.evaluator.stops(last, c)).flat_map(with_next).collect()
    }

    /// Coordinate exchange: each place of the sequence takes its best candidate and the better path of
    /// half turns, then pairs of places are swapped, until nothing helps. Starts are the sequences in
    /// `given`, then random ones.
    pub fn exchange(&self, k: usize, given: &[Vec<Stop>], restarts: u64, seed: u64) -> Best {
        self.exchange_from(k, given, restarts, seed, None)
    }

    /// Exchange as [`Self::exchange`]. With `firsts` all sequences begin with one of them, and
    /// every evaluated sequence may be kept, not only the results.
    pub(crate) fn exchange_from(
        &self,
        k: usize,
        given: &[Vec<Stop>],
        restarts: u64,
        seed: u64,
        firsts: Option<&[usize]>,
    ) -> Best {
        let total = given.len() + restarts as usize;
        let meter = Meter::new(self.progress, total);
        let from = |start: u64| {
            let mut rng = SplitMix64::new(seed ^ start.wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let random = || self.drawn(k, firsts, &mut rng);
            let now: Vec<Stop> = given.get(start as usize).cloned().unwrap_or_else(random);
            let mut exchange = Exchange::new(self, &meter, firsts, now);
            exchange.improve(k);
            exchange.finished()
        };
        let parts = parallel::map(total, |start| meter.part(|| from(start as u64)));
        meter.gather(self.keep, parts)
    }

    /// Random sequence of `k` candidates, the first of them one of `firsts`.
    fn drawn(&self, k: usize, firsts: Option<&[usize]>, rng: &mut SplitMix64) -> Vec<Stop> {
        let mut draw = |n: usize| rng.below(n as u64) as usize;
        let place = |place: usize| match firsts {
            Some(firsts) if place == 0 => firsts[draw(firsts.len())],
            _ => draw(self.rows.candidates()),
        };
        (0..k).map(place).map(Stop::from).collect()
    }
}

/// Exchange from one start.
struct Exchange<'a> {
    search: &'a SequenceSearch<'a>,
    meter: &'a Meter<'a>,
    /// Candidates that may stand first; `None` for all.
    firsts: Option<&'a [usize]>,
    /// Sequence that is tried.
    now: Vec<Stop>,
    /// Best sequence of this exchange.
    held: Scored,
    /// Kept sequences, and the number of sequences examined.
    best: Best,
    trial: Trial,
}

impl<'a> Exchange<'a> {
    fn new(
        search: &'a SequenceSearch<'a>,
        meter: &'a Meter<'a>,
        firsts: Option<&'a [usize]>,
        now: Vec<Stop>,
    ) -> Self {
        Self {
            search,
            meter,
            firsts,
            held: Scored { score: Score::NONE, seconds: 0.0, sequence: now.clone() },
            now,
            best: Best::default(),
            trial: Trial::new(search.evaluator),
        }
    }

    /// Exchanges and swaps the `k` places until neither helps.
    fn improve(&mut self, k: usize) {
        for _ in 0..ROUNDS {
            let round = self.held.score;
            if !self.replace(k) || !self.swap(k) || !self.held.score.better_than(&round) {
                break;
            }
        }
    }

    /// True if a candidate may stand at a place.
    fn may_stand(&self, candidate: usize, place: usize) -> bool {
        place > 0 || self.firsts.is_none_or(|f| f.contains(&candidate))
    }

    /// Puts the best choice at each place; false when the search is stopped.
    fn replace(&mut self, k: usize) -> bool {
        for place in 0..k {
            // a choice may change the turn to the next position, but never the one to this position
            let before = self.search.evaluator.state_of(&self.now[..place]);
            for (stop, next) in self.search.choices(&self.now, place) {
                if !self.may_stand(stop.candidate, place) {
                    continue;
                }
                self.now[place] = stop;
                next.into_iter().for_each(|next| self.now[place + 1] = next);
                if !self.try_out((&before, place)) {
                    return false;
                }
            }
            self.now.copy_from_slice(&self.held.sequence);
        }
        true
    }

    /// Swaps pairs of places where that is better; false when the search is stopped.
    fn swap(&mut self, k: usize) -> bool {
        for (a, b) in (0..k).flat_map(|a| (0..a).map(move |b| (a, b))) {
            let differ = self.now[a].candidate != self.now[b].candidate;
            if self.may_stand(self.now[a].candidate, b) && self.search.evaluator.ordered() && differ {
                let before = self.search.evaluator.state_of(&self.now[..b]);
                self.now.swap(a, b);
                if !self.try_out((&before, b)) {
                    return false;
                }
                self.now.copy_from_slice(&self.held.sequence);
            }
        }
        true
    }

    /// Keeps the present sequence if it is better; false when the search is stopped. `before` is the state
    /// behind its first positions, with their number.
    fn try_out(&mut self, before: (&SequenceState, usize)) -> bool {
        let (search, keep) = (self.search, self.search.keep);
        self.best.examined += 1;
        let other = search.score_behind(before, &self.now, &mut self.trial);
        if self.firsts.is_some() && self.best.wants(keep, &other.score, other.seconds) {
            let mut other = search.judged(other.clone());
            search.evaluator.tidy(&mut other.sequence);
            self.best.add(keep, other);
        }
        if other.score.better_than(&self.held.score) {
            let other = search.judged(other);
            if other.score.better_than(&self.held.score) {
                self.held = other;
            }
        }
        !self.best.examined.is_multiple_of(PATIENCE)
            || self.meter.report(0, PATIENCE, Some(&self.held).filter(|h| h.score.is_valid()))
    }

    /// Kept sequences with the best one of this exchange.
    fn finished(self) -> Best {
        let Self { search, mut held, mut best, .. } = self;
        search.evaluator.tidy(&mut held.sequence);
        best.add(search.keep, held);
        best
    }
}
