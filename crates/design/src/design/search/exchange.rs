//! Coordinate exchange, for spaces too large for exhaustion.

use obsdeg_exact::{SplitMix64, parallel};

use crate::design::measure::evaluator::SequenceState;
use crate::design::measure::stop::Stop;
use crate::design::search::best::Best;
use crate::design::search::progress::{Meter, PATIENCE};
use crate::design::search::score::{Scored, Worth};
use crate::design::search::scoring::{Search, Trial};

/// Largest number of rounds of one exchange.
const ROUNDS: usize = 50;

impl Search<'_> {
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
        let candidates = self.rows.candidates();
        let total = given.len() + restarts as usize;
        let meter = Meter::new(self.progress, total);
        let from = |start: u64| {
            let mut rng = SplitMix64::new(seed ^ start.wrapping_mul(0x9e37_79b9_7f4a_7c15));
            let mut draw = |n: usize| rng.below(n as u64) as usize;
            let random = || {
                let place = |place: usize| match firsts {
                    Some(firsts) if place == 0 => firsts[draw(firsts.len())],
                    _ => draw(candidates),
                };
                (0..k).map(place).map(Stop::from).collect()
            };
            let mut now: Vec<Stop> = given.get(start as usize).cloned().unwrap_or_else(random);
            let mut best = Best::default();
            let mut held = Scored { worth: Worth::NONE, seconds: 0.0, sequence: now.clone() };
            let mut trial = Trial::new(self.evaluator);
            // keeps a better sequence; false when the search is stopped
            let mut try_out = |before: (&SequenceState, usize), now: &[Stop], held: &mut Scored| {
                best.examined += 1;
                let other = self.worth_behind(before, now, &mut trial);
                if firsts.is_some() && best.wants(self.keep, &other.worth, other.seconds) {
                    let mut other = self.judged(other.clone());
                    self.evaluator.tidy(&mut other.sequence);
                    best.add(self.keep, other);
                }
                if other.worth.better_than(&held.worth) {
                    let other = self.judged(other);
                    if other.worth.better_than(&held.worth) {
                        *held = other;
                    }
                }
                !best.examined.is_multiple_of(PATIENCE)
                    || meter.report(0, PATIENCE, Some(&*held).filter(|h| h.worth.is_valid()))
            };
            'rounds: for _ in 0..ROUNDS {
                let round = held.worth;
                for place in 0..k {
                    // a choice may change the turn to the next position, but never the one to this
                    // position
                    let before = self.evaluator.state_of(&now[..place]);
                    let first = |stop: Stop| place > 0 || firsts.is_none_or(|f| f.contains(&stop.candidate));
                    for (stop, next) in self.choices(&now, place).into_iter().filter(|c| first(c.0)) {
                        now[place] = stop;
                        next.into_iter().for_each(|next| now[place + 1] = next);
                        if !try_out((&before, place), &now, &mut held) {
                            break 'rounds;
                        }
                    }
                    now.copy_from_slice(&held.sequence);
                }
                for (a, b) in (0..k).flat_map(|a| (0..a).map(move |b| (a, b))) {
                    let first = b > 0 || firsts.is_none_or(|f| f.contains(&now[a].candidate));
                    if first && self.evaluator.ordered() && now[a].candidate != now[b].candidate {
                        let before = self.evaluator.state_of(&now[..b]);
                        now.swap(a, b);
                        if !try_out((&before, b), &now, &mut held) {
                            break 'rounds;
                        }
                        now.copy_from_slice(&held.sequence);
                    }
                }
                if !held.worth.better_than(&round) {
                    break;
                }
            }
            self.evaluator.tidy(&mut held.sequence);
            best.add(self.keep, held);
            best
        };
        let parts = parallel::map(total, |start| meter.part(|| from(start as u64)));
        meter.gather(self.keep, parts)
    }
}
