//! Search for sets of candidates: the cheapest for a goal, and all minimal ones, with the failing sets
//! that prove them.

use std::collections::{BTreeSet, HashMap, HashSet};

use obsdeg_exact::parallel;

use super::cuts::{Cheapest, Transversals, cost_of, members, smallest};
use super::ranks::{NONE, Ranks, Set};
use super::unique::UniqueSolutions;

/// Largest number of nodes of a search for a cheapest set.
const NODES: u64 = 4_000_000;
/// Number of orders in which candidates are added to a failing set at once.
const ORDERS: usize = 4;
/// Number of rounds of cuts before all sets of a cost are judged one by one: if many sets are alike, a
/// cut excludes few.
const ROUNDS: usize = 40;
/// Number of sets judged at once if all sets of a cost are judged.
const BATCH: usize = 4096;
/// Number of sets judged at once in the search for all minimal ones.
const AT_ONCE: usize = 64;
/// Largest number of minimal sets that are stored.
const HELD: usize = 5_000;

/// Goal of a set of candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Goal {
    /// Make every required unknown observable, each with a degree of at most its own limit and this one.
    All(u16),
    /// Make one unknown observable with at most this degree.
    One(usize, u16),
}

/// Reason why a search ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StopReason {
    /// Limit of work: more sets would be judged than it allows.
    Work,
    /// Limit of counted solutions.
    Counts,
    /// Limit of nodes: too many sets hit all cuts.
    Nodes,
    /// Interruption by the caller.
    Interrupted,
}

/// Cheapest set with its proof.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CheapestSet {
    pub(crate) set: Set,
    /// Degree of the goal.
    pub(crate) degree: u16,
    /// Cuts that prove, with the examined sets, that no cheaper set reaches the goal.
    pub(crate) cuts: Vec<Set>,
    /// Number of cheaper sets that hit all these cuts and were judged one by one.
    pub(crate) examined: usize,
}

/// Largest number of different sums of costs.
const SUMS: usize = 20_000;

/// All sums of costs, ascending; `None` if there are too many.
fn sums(costs: &[u64]) -> Option<BTreeSet<u64>> {
    let mut out = BTreeSet::from([0]);
    for cost in costs {
        let more: Vec<u64> = out.iter().map(|sum| sum + cost).collect();
        out.extend(more);
        if out.len() > SUMS {
            return None;
        }
    }
    Some(out)
}

/// Enumeration of all sets of one cost that hit every cut.
struct EqualCostSets<'a> {
    cuts: &'a [Set],
    costs: &'a [u64],
    /// Number of nodes that may still be visited.
    nodes: u64,
    out: Vec<Set>,
}

impl EqualCostSets<'_> {
    /// Extends a set by candidates from `next` on with the total cost `left`; `None` at the limit of
    /// nodes.
    fn go_on(&mut self, set: Set, next: usize, left: u64) -> Option<()> {
        self.nodes = self.nodes.checked_sub(1)?;
        let later = if next >= 64 { 0 } else { Set::MAX << next };
        let hits = if left == 0 { set } else { set | later };
        if self.cuts.iter().any(|cut| cut & hits == 0) {
            return Some(());
        }
        if left == 0 {
            self.out.push(set);
            return Some(());
        }
        for c in next..self.costs.len() {
            if let Some(left) = left.checked_sub(self.costs[c]) {
                self.go_on(set | 1 << c, c + 1, left)?;
            }
        }
        Some(())
    }
}

/// Search among sets of candidates of one model.
pub(crate) struct SetSearch<'a> {
    ranks: &'a dyn Ranks,
    /// Cost of each candidate, in millionths.
    pub(crate) costs: Vec<u64>,
    /// Set of all candidates.
    pub(crate) all: Set,
    /// Largest degree allowed for each unknown in question; `None` if it is not required.
    pub(crate) limits: Vec<Option<u16>>,
    /// Numbers of solutions, if every required unknown must have one.
    pub(crate) unique: Option<UniqueSolutions<'a>>,
    /// Degrees under every set that was judged.
    pub(crate) judged: HashMap<Set, Box<[u16]>>,
    /// Sets whose degrees the answer rests on: all that were judged but for those tried while a failing set
    /// grew, of which only the last failing ones count.
    pub(crate) relied_on: HashSet<Set>,
    /// Maximal failing sets that were found, for any goal.
    failing: Vec<Set>,
    /// Number of sets that may still be judged.
    left: u64,
    progress: &'a (dyn Fn(u64) -> bool + Sync),
}

impl<'a> SetSearch<'a> {
    pub(crate) fn new(
        ranks: &'a dyn Ranks,
        costs: Vec<u64>,
        unknowns: usize,
        most: u64,
        progress: &'a (dyn Fn(u64) -> bool + Sync),
    ) -> Self {
        let all = if costs.len() >= 64 { Set::MAX } else { (1 << costs.len()) - 1 };
        let limits = vec![None; unknowns];
        let (judged, relied_on, failing) = (HashMap::new(), HashSet::new(), Vec::new());
        Self { ranks, costs, all, limits, unique: None, judged, relied_on, failing, left: most, progress }
    }

    /// Judges sets that are not judged yet, on all cores, and counts solutions where they are required.
    pub(crate) fn judge(&mut self, sets: &[Set]) -> Result<(), StopReason> {
        self.try_out(sets)?;
        self.relied_on.extend(sets);
        Ok(())
    }

    /// Judges sets whose degrees the answer does not rest on.
    fn try_out(&mut self, sets: &[Set]) -> Result<(), StopReason> {
        self.judge_degrees(sets)?;
        let Some(mut unique) = self.unique.take() else { return Ok(()) };
        let mut counted = Ok(());
        for &set in sets.iter().filter(|set| self.worst_of(**set) < NONE) {
            if !unique.count(set) {
                counted = Err(StopReason::Counts);
            } else if !(self.progress)(self.judged.len() as u64) {
                counted = Err(StopReason::Interrupted);
            }
            if counted.is_err() {
                break;
            }
        }
        self.unique = Some(unique);
        counted
    }

    fn judge_degrees(&mut self, sets: &[Set]) -> Result<(), StopReason> {
        let mut new: Vec<Set> = sets.iter().copied().filter(|s| !self.judged.contains_key(s)).collect();
        new.sort_unstable();
        new.dedup();
        if new.is_empty() {
            return Ok(());
        }
        self.left = self.left.checked_sub(new.len() as u64).ok_or(StopReason::Work)?;
        let ranks = self.ranks;
        let found: Vec<_> = match new.len() {
            1 => vec![ranks.degrees(new[0])],
            _ => parallel::map(new.len(), |i| ranks.degrees(new[i])),
        };
        self.judged.extend(new.into_iter().zip(found));
        match (self.progress)(self.judged.len() as u64) {
            true => Ok(()),
            false => Err(StopReason::Interrupted),
        }
    }

    /// Degrees under a set.
    pub(crate) fn degrees(&mut self, set: Set) -> Result<&[u16], StopReason> {
        self.judge(&[set])?;
        self.judged.get(&set).map(|d| &**d).ok_or(StopReason::Work)
    }

    /// Largest degree of the required unknowns under a set; `NONE` if one is not observable within its
    /// limit.
    pub(crate) fn worst(&mut self, set: Set) -> Result<u16, StopReason> {
        self.judge(&[set])?;
        Ok(self.worst_of(set))
    }

    fn worst_of(&self, set: Set) -> u16 {
        let Some(degrees) = self.judged.get(&set) else { return NONE };
        let of = |(degree, limit): (&u16, &Option<u16>)| match limit {
            Some(limit) if degree > limit => NONE,
            Some(_) => *degree,
            None => 0,
        };
        degrees.iter().zip(&self.limits).map(of).max().unwrap_or(0)
    }

    /// True if a judged set reaches a goal.
    fn reaches(&self, set: Set, goal: Goal) -> bool {
        match goal {
            Goal::All(most) => {
                self.worst_of(set) <= most && self.unique.as_ref().is_none_or(|unique| unique.holds(set))
            }
            Goal::One(u, most) => self.judged.get(&set).is_some_and(|degrees| degrees[u] <= most),
        }
    }

    /// Cuts of the failing sets known so far, for a goal.
    pub(crate) fn cuts(&self, goal: Goal) -> Vec<Set> {
        let failing = self.failing.iter().filter(|set| !self.reaches(**set, goal));
        smallest(failing.map(|set| self.all & !set).collect())
    }

    /// Adds candidates to failing sets as long as they fail, each in its own order, and keeps the
    /// maximal ones.
    fn grow(&mut self, sets: Vec<(Set, usize)>, goal: Goal) -> Result<(), StopReason> {
        let n = self.costs.len();
        let mut sets = sets;
        for step in 0..n {
            let with = |&(set, first): &(Set, usize)| set | 1 << ((first + step) % n);
            let longer: Vec<Set> = sets.iter().map(with).collect();
            self.try_out(&longer)?;
            for ((set, _), longer) in sets.iter_mut().zip(longer) {
                if !self.reaches(longer, goal) {
                    *set = longer;
                }
            }
        }
        for (set, _) in sets {
            self.relied_on.insert(set);
            if !self.failing.contains(&set) {
                self.failing.push(set);
            }
        }
        Ok(())
    }

    /// Cheapest set that reaches a goal, and the number of cheaper sets that hit all cuts and were
    /// judged one by one. All candidates together must reach the goal. `None` if every set costs more
    /// than `most`.
    fn cheapest(&mut self, goal: Goal, most: u64) -> Result<Option<(Set, usize)>, StopReason> {
        for _ in 0..ROUNDS {
            let cuts = self.cuts(goal);
            let set = Cheapest::of(&cuts, &self.costs, NODES).ok_or(StopReason::Nodes)?;
            if cost_of(set, &self.costs) > most {
                return Ok(None);
            }
            self.judge(&[set])?;
            if self.reaches(set, goal) {
                return Ok(Some((set, 0)));
            }
            let n = self.costs.len();
            let starts = (0..ORDERS).map(|k| (set, k * n / ORDERS)).collect();
            self.grow(starts, goal)?;
        }
        let cuts = self.cuts(goal);
        let least = Cheapest::of(&cuts, &self.costs, NODES).ok_or(StopReason::Nodes)?;
        let (from, mut failed) = (cost_of(least, &self.costs), 0);
        let sums = sums(&self.costs).ok_or(StopReason::Nodes)?;
        for cost in sums.into_iter().filter(|cost| (from..=most).contains(cost)) {
            let mut sets =
                EqualCostSets { cuts: &cuts, costs: &self.costs.clone(), nodes: NODES, out: Vec::new() };
            sets.go_on(0, 0, cost).ok_or(StopReason::Nodes)?;
            for batch in sets.out.chunks(BATCH) {
                self.judge(batch)?;
                if let Some(set) = batch.iter().find(|set| self.reaches(**set, goal)) {
                    return Ok(Some((*set, failed)));
                }
            }
            failed += sets.out.len();
        }
        Ok(None)
    }

    /// Cheapest set that reaches a goal, of the smallest degree at this cost, with the proof of its
    /// cost; `with` is the goal for a degree.
    pub(crate) fn best(&mut self, with: &dyn Fn(u16) -> Goal, most: u16) -> Result<CheapestSet, StopReason> {
        let (mut set, examined) = self.cheapest(with(most), u64::MAX)?.ok_or(StopReason::Nodes)?;
        let cuts = self.cuts(with(most));
        let everything = self.degree_of(self.all, with(most))?;
        loop {
            let degree = self.degree_of(set, with(most))?;
            if degree <= everything {
                return Ok(CheapestSet { set, degree, cuts, examined });
            }
            match self.cheapest(with(degree - 1), cost_of(set, &self.costs))? {
                Some((other, _)) => set = other,
                None => return Ok(CheapestSet { set, degree, cuts, examined }),
            }
        }
    }

    fn degree_of(&mut self, set: Set, goal: Goal) -> Result<u16, StopReason> {
        match goal {
            Goal::All(_) => self.worst(set),
            Goal::One(u, _) => Ok(self.degrees(set)?[u]),
        }
    }

    /// Cuts that the proof of a cheapest set needs. If no set was judged one by one, a cut is dropped
    /// if all sets that hit the others cost as much.
    pub(crate) fn needed(&self, best: &CheapestSet) -> Vec<Set> {
        let (mut cuts, cost) = (best.cuts.clone(), cost_of(best.set, &self.costs));
        let mut at = if best.examined > 0 { 0 } else { cuts.len() };
        while at > 0 {
            at -= 1;
            let mut fewer = cuts.clone();
            fewer.remove(at);
            let least = Cheapest::of(&fewer, &self.costs, NODES / 64);
            if least.is_some_and(|set| cost_of(set, &self.costs) >= cost) {
                cuts = fewer;
            }
        }
        cuts
    }

    /// All minimal sets that reach a goal, the number of members up to which the list is complete, and
    /// the reason for an early end.
    pub(crate) fn minimal(&mut self, goal: Goal) -> (Vec<Set>, u32, Option<StopReason>) {
        let mut found = Transversals::new(HELD);
        let all_added = |found: &mut Transversals, cuts: Vec<Set>| cuts.into_iter().all(|cut| found.add(cut));
        let mut within = all_added(&mut found, self.cuts(goal));
        // all sets with fewer members than this one are judged
        let mut shortest;
        let stopped = loop {
            let mut open: Vec<Set> =
                found.sets.iter().copied().filter(|set| !self.judged.contains_key(set)).collect();
            open.sort_by_key(|set| (set.count_ones(), *set));
            shortest = open.first().map_or(Set::BITS, |set| set.count_ones());
            let mut failing: Vec<Set> =
                found.sets.iter().copied().filter(|s| self.known_failing(*s, goal)).collect();
            if !within {
                break Some(StopReason::Nodes);
            }
            if failing.is_empty() && open.is_empty() {
                break None;
            }
            open.truncate(AT_ONCE);
            if let Err(stopped) = self.judge(&open) {
                break Some(stopped);
            }
            failing.extend(open.into_iter().filter(|set| !self.reaches(*set, goal)));
            failing.truncate(AT_ONCE);
            let n = self.costs.len();
            let starts = failing.iter().enumerate().map(|(k, set)| (*set, (7 * k) % n)).collect();
            if let Err(stopped) = self.grow(starts, goal) {
                break Some(stopped);
            }
            within = all_added(&mut found, self.cuts(goal));
        };
        let complete = match stopped {
            None => found.members,
            Some(_) => found.members.min(shortest.saturating_sub(1)),
        };
        let reach = |set: &Set| self.judged.contains_key(set) && self.reaches(*set, goal);
        let mut sets: Vec<Set> = found.sets.into_iter().filter(reach).collect();
        self.relied_on.extend(&sets);
        sets.sort_by_key(|set| {
            (cost_of(*set, &self.costs), self.worst_of(*set), members(*set).collect::<Vec<_>>())
        });
        (sets, complete, stopped)
    }

    fn known_failing(&self, set: Set, goal: Goal) -> bool {
        self.judged.contains_key(&set) && !self.reaches(set, goal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use obsdeg_exact::SplitMix64;

    /// Random degrees that another output never raises: per unknown some sets with a degree each; the
    /// least degree of the sets contained counts.
    struct Drawn(Vec<Vec<(Set, u16)>>);

    impl Ranks for Drawn {
        fn degrees(&self, set: Set) -> Box<[u16]> {
            let of = |sets: &Vec<(Set, u16)>| {
                let inside = sets.iter().filter(|(own, _)| own & !set == 0).map(|s| s.1);
                inside.min().unwrap_or(NONE)
            };
            self.0.iter().map(of).collect()
        }
    }

    /// Random degrees compared with all sets one by one: cheapest sets and their degrees, minimal sets,
    /// proofs.
    #[test]
    fn sets_are_those_of_exhaustion() {
        let mut rng = SplitMix64::new(2);
        for round in 0..120 {
            let n = 1 + rng.below(8) as usize;
            let set = |rng: &mut SplitMix64| rng.below(1 << n) & rng.below(1 << n) | 1 << rng.below(n as u64);
            let unknown = |rng: &mut SplitMix64| -> Vec<(Set, u16)> {
                (0..1 + rng.below(5)).map(|_| (set(&mut *rng), rng.below(6) as u16)).collect()
            };
            let drawn = Drawn((0..3).map(|_| unknown(&mut rng)).collect());
            let costs: Vec<u64> = (0..n).map(|_| 1 + if round % 2 == 0 { 0 } else { rng.below(4) }).collect();
            let mut search = SetSearch::new(&drawn, costs.clone(), 3, u64::MAX, &|_| true);
            search.limits = vec![Some(NONE - 1), Some(4), None];
            let all: Vec<Set> = (0..1 << n).collect();
            search.judge(&all).expect("few");
            let worst: Vec<u16> = all.iter().map(|s| search.worst_of(*s)).collect();
            let cost = |s: Set| cost_of(s, &costs);
            let least = worst[all.len() - 1];
            if least == NONE {
                continue;
            }
            for most in least..=7 {
                let goal = Goal::All(most);
                let fits = || all.iter().filter(|s| worst[**s as usize] <= most);
                let cheapest = fits().map(|s| cost(*s)).min().expect("all together do");
                let (found, _) = search.cheapest(goal, u64::MAX).expect("few").expect("a set");
                assert!(worst[found as usize] <= most && cost(found) == cheapest);
                assert_eq!(search.cheapest(goal, cheapest - 1), Ok(None));
                let best = search.best(&Goal::All, most).expect("few");
                let degree = best.degree;
                let of_cost = fits().filter(|s| cost(**s) == cheapest).map(|s| worst[*s as usize]);
                assert_eq!(Some(degree), of_cost.min());
                let proof = search.needed(&best);
                let hits = |s: &&Set| proof.iter().all(|cut| cut & **s != 0);
                assert_eq!(all.iter().filter(hits).map(|s| cost(*s)).min(), Some(cheapest));
                assert!(proof.iter().all(|cut| worst[(search.all & !cut) as usize] > most));
                let minimal = |s: &&&Set| members(***s).all(|c| worst[(**s & !(1 << c)) as usize] > most);
                let mut minimal: Vec<Set> = fits().filter(|s| minimal(&s)).copied().collect();
                let (mut sets, complete, stopped) = search.minimal(goal);
                sets.sort_unstable();
                minimal.sort_unstable();
                assert_eq!((sets, stopped), (minimal, None));
                assert!(complete >= n as u32);
            }
            let CheapestSet { set: found, degree, .. } =
                search.best(&|k| Goal::One(2, k), NONE - 1).expect("few");
            let degree_of = |s: Set| drawn.degrees(s)[2];
            let fits = || all.iter().filter(|s| degree_of(**s) < NONE);
            let cheapest = fits().map(|s| cost(*s)).min();
            assert_eq!(Some(cost(found)), cheapest);
            let of_cost = fits().filter(|s| Some(cost(**s)) == cheapest).map(|s| degree_of(*s));
            assert_eq!(Some(degree), of_cost.min());
        }
    }

    /// 14 candidates of which any five reach the goal and no four: cuts are too many, so all sets of
    /// four are judged one by one.
    #[test]
    fn alike_candidates_are_judged_one_by_one() {
        struct AnyFive;
        impl Ranks for AnyFive {
            fn degrees(&self, set: Set) -> Box<[u16]> {
                Box::new([if set.count_ones() >= 5 { 1 } else { NONE }])
            }
        }
        let mut search = SetSearch::new(&AnyFive, vec![1; 14], 1, u64::MAX, &|_| true);
        search.limits = vec![Some(NONE - 1)];
        let best = search.best(&Goal::All, NONE - 1).expect("few");
        assert_eq!((best.set.count_ones(), best.degree), (5, 1));
        assert!(best.examined > 500 && best.examined <= 2002, "{}", best.examined);
        let mut sets = EqualCostSets { cuts: &[0b11], costs: &[1, 2, 3, 4], nodes: 99, out: Vec::new() };
        assert_eq!(sets.go_on(0, 0, 5), Some(()));
        assert_eq!((sets.out, sums(&[1, 1, 3])), (vec![0b1001, 0b0110], Some([0, 1, 2, 3, 4, 5].into())));
    }

    /// The limit of sets and an interruption are reported.
    #[test]
    fn what_ends_a_search_is_said() {
        let drawn = Drawn(vec![vec![(0b11_1000, 1), (0b111, 0)]]);
        let mut search = SetSearch::new(&drawn, vec![1; 6], 1, 3, &|_| true);
        search.limits = vec![Some(NONE - 1)];
        assert_eq!(search.cheapest(Goal::All(9), 9), Err(StopReason::Work));
        let mut search = SetSearch::new(&drawn, vec![1; 6], 1, 99, &|_| false);
        search.limits = vec![Some(NONE - 1)];
        assert_eq!(search.cheapest(Goal::All(9), 9), Err(StopReason::Interrupted));
        let mut search = SetSearch::new(&drawn, vec![1; 6], 1, 5, &|_| true);
        search.limits = vec![Some(NONE - 1)];
        let (sets, complete, stopped) = search.minimal(Goal::All(9));
        assert!(sets.is_empty() && complete == 0 && stopped == Some(StopReason::Work));
    }
}
