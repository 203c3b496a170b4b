//! Some of the sets of candidates, as one bit for each: at its place in the combinatorial number system (D.
//! E. Knuth, *The Art of Computer Programming*, volume 4A, 7.2.1.3), those of fewer members first.
//!
//! The set `c_1 < ... < c_t` is behind `sum_i binom(c_i, i)` others of its size. What is held does not grow
//! with the sequences, and with the sets by an eighth of a byte.

use std::sync::atomic::{AtomicU64, Ordering};

/// Sets of 1 up to so many candidates.
#[derive(Debug)]
pub(crate) struct Sets {
    candidates: usize,
    /// `binom(c, i)` at `i * candidates + c`, c below the number of candidates, i up to one more than the
    /// members of a set; those of which no set needs the place may be cut off at the largest number.
    binomials: Vec<usize>,
    /// How many sets have fewer members, by the number of members counted from 1, and how many there are in
    /// all.
    first: Vec<usize>,
    bits: Vec<AtomicU64>,
}

impl Sets {
    /// None of the sets of up to `most` candidates.
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
            // one behind the last of its size
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

    /// How many sets are before an ascending one, of sets with `more` smaller members each.
    fn behind(&self, set: &[usize], more: usize) -> usize {
        set.iter().zip(1 + more..).map(|(&c, i)| self.binomial(c, i)).sum()
    }

    fn place(&self, set: &[usize]) -> usize {
        self.first[set.len() - 1] + self.behind(set, 0)
    }

    fn bit(&self, place: usize) -> bool {
        self.bits[place / 64].load(Ordering::Relaxed) >> (place % 64) & 1 == 1
    }

    /// Takes up an ascending set of at least one.
    pub(crate) fn add(&self, set: &[usize]) {
        let place = self.place(set);
        self.bits[place / 64].fetch_or(1 << (place % 64), Ordering::Relaxed);
    }

    /// True if an ascending set of at least one is among them.
    pub(crate) fn contains(&self, set: &[usize]) -> bool {
        self.bit(self.place(set))
    }

    /// True if there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.bits.iter().all(|word| word.load(Ordering::Relaxed) == 0)
    }

    /// The candidates, ascending, of which each with an ascending set of at least one makes one of these;
    /// members of the set do where it is one itself. Sets of so many more must be possible.
    pub(crate) fn completing<'a>(&'a self, set: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
        let itself = self.contains(set);
        // of the set with a member before all others; this one goes up from there
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

    /// Every set of up to so many, by bit masks.
    fn every(candidates: usize, most: usize) -> Vec<Vec<usize>> {
        let members = |mask: u32| (0..candidates).filter(|c| mask >> c & 1 == 1).collect::<Vec<_>>();
        (1..1u32 << candidates).map(members).filter(|set| set.len() <= most).collect()
    }

    /// Against a tree of sets: what is added is there, nothing else is, and what completes a set does; a bit
    /// for each.
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

    /// Places of many candidates: the last set of each size is the last place.
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
