//! Sets that hit every cut: the cheapest one, and all minimal ones.
//!
//! Another output never raises a degree, so every property of a set holds for all larger sets. A
//! failing set lies in a maximal failing set, and every set that does not fail contains a candidate
//! outside it: it hits the *cut*, the complement. The sets that do not fail are those that hit the cuts
//! of all maximal failing sets. The minimal ones among them are the minimal transversals of these cuts
//! (Berge 1989, *Hypergraphs*, chapter 2).

use super::ranks::Set;

/// Members of a set, ascending.
pub(crate) fn members(set: Set) -> impl Iterator<Item = usize> {
    let mut left = set;
    std::iter::from_fn(move || {
        let next = (left != 0).then(|| left.trailing_zeros() as usize);
        left &= left.wrapping_sub(1);
        next
    })
}

/// Sum of the costs of the members.
pub(crate) fn cost_of(set: Set, costs: &[u64]) -> u64 {
    members(set).map(|c| costs[c]).sum()
}

/// Cuts that contain no other cut.
pub(crate) fn smallest(mut cuts: Vec<Set>) -> Vec<Set> {
    cuts.sort_by_key(|cut| (cut.count_ones(), *cut));
    let mut out: Vec<Set> = Vec::new();
    for cut in cuts {
        if out.iter().all(|own| own & !cut != 0) {
            out.push(cut);
        }
    }
    out
}

/// Search for the cheapest set that hits every cut, by branch and bound.
pub(crate) struct Cheapest<'a> {
    cuts: &'a [Set],
    costs: &'a [u64],
    best: Option<(u64, Set)>,
    /// Number of nodes that may still be visited.
    nodes: u64,
}

impl<'a> Cheapest<'a> {
    /// Cheapest set that hits every cut; `None` if more than `nodes` nodes would be visited. Among
    /// equal costs it is the first in an order that the cuts determine.
    pub(crate) fn of(cuts: &'a [Set], costs: &'a [u64], nodes: u64) -> Option<Set> {
        let mut search = Self { cuts, costs, best: None, nodes };
        search.branch(0, 0, 0)?;
        search.best.map(|(_, set)| set)
    }

    /// Branches from a set with its cost, without the members of `left_out`; `None` at the limit of
    /// nodes.
    fn branch(&mut self, set: Set, cost: u64, left_out: Set) -> Option<()> {
        self.nodes = self.nodes.checked_sub(1)?;
        let (mut bound, mut used, mut open) = (cost, 0, None);
        for cut in self.cuts.iter().filter(|cut| *cut & set == 0) {
            let free = cut & !left_out;
            if free == 0 {
                return Some(());
            }
            // cuts without common members add up in the bound
            if free & used == 0 {
                used |= free;
                bound += members(free).map(|c| self.costs[c]).min().unwrap_or(0);
            }
            if open.is_none_or(|other: Set| free.count_ones() < other.count_ones()) {
                open = Some(free);
            }
        }
        if self.best.is_some_and(|(best, _)| bound >= best) {
            return Some(());
        }
        let Some(open) = open else {
            self.best = Some((cost, set));
            return Some(());
        };
        let mut ways: Vec<usize> = members(open).collect();
        ways.sort_by_key(|c| self.costs[*c]);
        let mut left_out = left_out;
        for c in ways {
            self.branch(set | 1 << c, cost + self.costs[c], left_out)?;
            left_out |= 1 << c;
        }
        Some(())
    }
}

/// Minimal sets that hit every cut, of up to `members` members.
#[derive(Debug, Clone)]
pub(crate) struct Transversals {
    cuts: Vec<Set>,
    pub(crate) sets: Vec<Set>,
    /// Largest number of members up to which the list is complete.
    pub(crate) members: u32,
    /// Largest number of sets that are stored.
    most: usize,
    /// Number of comparisons of a set with a cut that may still be made.
    left: u64,
}

/// Largest number of comparisons of sets with cuts.
const COMPARISONS: u64 = 2_000_000_000;

impl Transversals {
    /// Transversals of no cut: the empty set. At most `most` sets are stored.
    pub(crate) fn new(most: usize) -> Self {
        Self { cuts: Vec::new(), sets: vec![0], members: Set::BITS, most, left: COMPARISONS }
    }

    /// Adds a cut; false if that would take more comparisons than are left. A minimal set that hits it
    /// too is either a present one, or one with another member from the cut.
    pub(crate) fn add(&mut self, cut: Set) -> bool {
        if self.cuts.iter().any(|own| own & !cut == 0) {
            return true;
        }
        let others = self.sets.iter().filter(|set| **set & cut == 0).count() as u64;
        let comparisons = others * u64::from(cut.count_ones()) * (self.cuts.len() as u64 + 1);
        let Some(left) = self.left.checked_sub(comparisons) else { return false };
        self.left = left;
        self.cuts.push(cut);
        let (mut out, others): (Vec<Set>, Vec<Set>) =
            self.sets.iter().copied().partition(|set| *set & cut != 0);
        for set in others {
            let longer = members(cut).map(|c| set | 1 << c);
            out.extend(longer.filter(|set| set.count_ones() <= self.members && self.is_minimal(*set)));
        }
        out.sort_unstable();
        out.dedup();
        self.sets = out;
        while self.sets.len() > self.most && self.members > 0 {
            let longest = self.sets.iter().map(|set| set.count_ones()).max().unwrap_or(0);
            self.members = longest.saturating_sub(1).min(self.members);
            let members = self.members;
            self.sets.retain(|set| set.count_ones() <= members);
        }
        true
    }

    /// True if each member alone hits some cut.
    fn is_minimal(&self, set: Set) -> bool {
        let alone = |cut: &Set| Some(cut & set).filter(|hit| hit.count_ones() == 1);
        self.cuts.iter().filter_map(alone).fold(0, |all, hit| all | hit) == set
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use obsdeg_exact::SplitMix64;

    /// Random cuts of up to ten candidates, compared with all sets one by one.
    #[test]
    fn hitting_sets_are_those_of_all_sets() {
        let mut rng = SplitMix64::new(5);
        for round in 0..300u32 {
            let n = 1 + rng.below(10) as u32;
            let cuts: Vec<Set> = (0..1 + rng.below(7)).map(|_| 1 + rng.below((1 << n) - 1)).collect();
            let costs: Vec<u64> = (0..n).map(|_| 1 + rng.below(if round % 2 == 0 { 1 } else { 5 })).collect();
            let hits = |set: Set| cuts.iter().all(|cut| cut & set != 0);
            let all: Vec<Set> = (0..1 << n).filter(|set| hits(*set)).collect();
            let least = all.iter().map(|set| cost_of(*set, &costs)).min().expect("the whole hits all");
            let reduced = smallest(cuts.clone());
            let found = Cheapest::of(&reduced, &costs, 1 << 20).expect("few nodes");
            assert!(hits(found) && cost_of(found, &costs) == least, "{cuts:?} {costs:?}: {found:b}");
            let minimal = |set: &&Set| members(**set).all(|c| !hits(**set & !(1 << c)));
            let minimal: Vec<Set> = all.iter().filter(minimal).copied().collect();
            let mut transversals = Transversals::new(usize::MAX);
            assert!(cuts.iter().all(|cut| transversals.add(*cut)));
            assert_eq!(transversals.sets, minimal, "{cuts:?}");
            // with few sets stored, the list is complete up to the stated number of members
            let mut few = Transversals::new(3);
            assert!(cuts.iter().all(|cut| few.add(*cut)));
            let short = |set: &&Set| set.count_ones() <= few.members;
            let short: Vec<Set> = minimal.iter().filter(short).copied().collect();
            assert!(few.sets == short && few.sets.len() <= 3, "{cuts:?}: {:?}", few.sets);
        }
    }

    #[test]
    fn nodes_are_counted() {
        let cuts: Vec<Set> = (0..8).map(|k| 0b111 << (3 * k)).collect();
        assert_eq!(Cheapest::of(&cuts, &[1; 24], 3), None);
        assert!(Cheapest::of(&cuts, &[1; 24], 100).is_some());
        assert_eq!(
            (members(0b1010).collect::<Vec<_>>(), smallest(vec![7, 3, 3, 8])),
            (vec![1, 3], vec![8, 3])
        );
    }
}
