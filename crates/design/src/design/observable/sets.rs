//! Collection of sets of candidates with one bit per set, at its index in the combinatorial number
//! system (D. E. Knuth, *The Art of Computer Programming*, volume 4A, 7.2.1.3), sets with fewer members
//! first.
//!
//! The set `c_1 < ... < c_t` has `sum_i binom(c_i, i)` sets of its size before it. Memory does not grow
//! with the sequences; it is an eighth of a byte per set.

use std::sync::atomic::{AtomicU64, Ordering};

/// Collection of sets of 1 to `most` candidates.
#[derive(Debug)]
pub(crate) struct Sets {
    candidates: usize,
    /// `binom(c, i)` at `i * candidates + c`, c below the number of candidates, i up to one more than
    /// the largest number of members. Values that no index needs may be cut off at the largest number.
    binomials: Vec<usize>,
    /// Number of sets with fewer members, by the number of members (from 1), then the number of all
    /// sets.
    first: Vec<usize>,
    bits: Vec<AtomicU64>,
}

impl Sets {
    /// Empty collection for sets of up to `most` candidates.
    pub(crate) fn none(candidates: usize, most: usize) -> Self {
        let most = most.min(candidates);
        let mut binomials = vec![1; candidates];
        for i in 1..=most + 1 {
            let mut below = 0usize;
            for c in 0..candidates {
                binomials.push(below);
                below = below.saturating_add(binomials[(i - 1) * candidates + c]);
            }
        }
        let mut out = Self { candidates, binomials, first: vec![0], bits: Vec::new() };
        for size in 1..=most {
            // index after the last set of its size
            let last: Vec<usize> = (candidates - size..candidates).collect();
            let next = out.first[size - 1] + out.behind(&last, 0) + 1;
            out.first.push(next);
        }
        out.bits.resize_with(out.first[most].div_ceil(64), AtomicU64::default);
        out
    }

    fn binomial(&self, c: usize, i: usize) -> usize {
        self.binomials[i * self.candidates + c]
    }

    /// Number of sets before an ascending one, among sets with `more` smaller members each.
    fn behind(&self, set: &[usize], more: usize) -> usize {
        set.iter().zip(1 + more..).map(|(&c, i)| self.binomial(c, i)).sum()
    }

    fn place(&self, set: &[usize]) -> usize {
        self.first[set.len() - 1] + self.behind(set, 0)
    }

    fn bit(&self, place: usize) -> bool {
        self.bits[place / 64].load(Ordering::Relaxed) >> (place % 64) & 1 == 1
    }

    /// Adds an ascending set, which must not be empty.
    pub(crate) fn add(&self, set: &[usize]) {
        let place = self.place(set);
        self.bits[place / 64].fetch_or(1 << (place % 64), Ordering::Relaxed);
    }

    /// True if the collection contains an ascending set, which must not be empty.
    pub(crate) fn contains(&self, set: &[usize]) -> bool {
        self.bit(self.place(set))
    }

    /// True if the collection is empty.
    pub(crate) fn is_empty(&self) -> bool {
        self.bits.iter().all(|word| word.load(Ordering::Relaxed) == 0)
    }

    /// Candidates, ascending, whose union with an ascending set (not empty) is in the collection;
    /// members of the set are included if the set is. Sets of one more member must be within the limit.
    pub(crate) fn completing<'a>(&'a self, set: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
        let itself = self.contains(set);
        // index of the set with a new first member; it rises with the candidate
        let mut others = self.first[set.len()] + self.behind(set, 1);
        let mut smaller = 0;
        (0..self.candidates).filter(move |&c| {
            if set.get(smaller) == Some(&c) {
                smaller += 1;
                others = others + self.binomial(c, smaller) - self.binomial(c, smaller + 1);
                return itself;
            }
            self.bit(others + self.binomial(c, smaller + 1))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// All sets of up to `most` candidates, by bit masks.
    fn every(candidates: usize, most: usize) -> Vec<Vec<usize>> {
        let members = |mask: u32| (0..candidates).filter(|c| mask >> c & 1 == 1).collect::<Vec<_>>();
        (1..1u32 << candidates).map(members).filter(|set| set.len() <= most).collect()
    }

    /// Collection against a tree of sets: added sets are contained, others are not, and completions are
    /// right. One bit per set.
    #[test]
    fn sets_are_those_added() {
        for (candidates, most) in [(1, 1), (1, 4), (5, 2), (7, 3), (6, 6), (4, 9), (10, 5)] {
            let all = every(candidates, most);
            for step in [1, 2, 3, 7] {
                let sets = Sets::none(candidates, most);
                assert!(sets.is_empty());
                assert_eq!(sets.bits.len(), all.len().div_ceil(64));
                let added: BTreeSet<&Vec<usize>> = all.iter().step_by(step).collect();
                added.iter().for_each(|set| sets.add(set));
                assert!(!sets.is_empty());
                for set in &all {
                    assert_eq!(sets.contains(set), added.contains(set), "{set:?}");
                    if set.len() == most && most < candidates {
                        continue;
                    }
                    let with = |c: &usize| {
                        let mut longer = set.clone();
                        longer.push(*c);
                        longer.sort_unstable();
                        longer.dedup();
                        added.contains(&longer)
                    };
                    let expected: Vec<usize> = (0..candidates).filter(with).collect();
                    assert_eq!(sets.completing(set).collect::<Vec<_>>(), expected, "{set:?}");
                }
            }
        }
    }

    /// Indices for many candidates: the last set of each size has the last index.
    #[test]
    fn places_of_many_candidates() {
        for (candidates, most, all) in [(1000, 2, 500_500), (24, 7, 536_154), (300, 3, 4500250)] {
            let sets = Sets::none(candidates, most);
            assert_eq!(sets.first[most], all, "{candidates} {most}");
            let last: Vec<usize> = (candidates - most..candidates).collect();
            assert_eq!(sets.place(&last), all - 1);
            sets.add(&last);
            assert_eq!(sets.completing(&last[1..]).collect::<Vec<_>>(), [last[0]]);
        }
    }
}
