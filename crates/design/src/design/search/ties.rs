//! Number of sequences that are as good as the best.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::design::search::score::Score;

/// Relative difference of criteria below which sequences of equal worst degree tie.
pub(crate) const TIE: f64 = 1e-6;

/// Sequences near the best so far, counted by criterion.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Counted", into = "Counted")]
#[schemars(with = "Counted")]
pub struct Ties {
    /// Smallest worst degree of the sequences.
    degree: usize,
    /// Number of sequences by the bits of the criterion, which order positive numbers, and the searched
    /// images of a sequence.
    counts: BTreeMap<(u64, usize), u64>,
}

/// Sequences near the best so far, counted by criterion, as a list.
#[derive(Serialize, Deserialize, JsonSchema)]
struct Counted {
    /// Smallest worst degree of the sequences.
    degree: usize,
    /// Criterion (in the unit of the criterion asked for), number of searched images of a sequence, number of
    /// sequences.
    counts: Vec<(f64, usize, u64)>,
}

impl From<Counted> for Ties {
    fn from(listed: Counted) -> Self {
        let counts =
            listed.counts.into_iter().map(|(value, images, count)| ((value.to_bits(), images), count));
        Self { degree: listed.degree, counts: counts.collect() }
    }
}

impl From<Ties> for Counted {
    fn from(ties: Ties) -> Self {
        let counts = ties.counts.into_iter();
        Self {
            degree: ties.degree,
            counts: counts.map(|((bits, images), count)| (f64::from_bits(bits), images, count)).collect(),
        }
    }
}

impl Ties {
    /// Largest criterion that still ties with the best.
    fn limit(&self) -> f64 {
        self.counts.keys().next().map_or(f64::INFINITY, |k| f64::from_bits(k.0) * (1.0 + TIE))
    }

    /// True if a sequence with this score is as good as the best so far, or better.
    pub(crate) fn wants(&self, score: &Score) -> bool {
        self.counts.is_empty()
            || score.degree < self.degree
            || score.degree == self.degree && score.value <= self.limit()
    }

    /// Adds `count` sequences with this score, each with `images` searched images.
    pub(crate) fn add(&mut self, score: &Score, images: usize, count: u64) {
        if !self.wants(score) {
            return;
        }
        if score.degree != self.degree {
            self.counts.clear();
            self.degree = score.degree;
        }
        *self.counts.entry((score.value.to_bits(), images)).or_default() += count;
        // criteria that do not tie with a better one are removed
        let limit = self.limit();
        while let Some(last) = self.counts.last_entry().filter(|e| f64::from_bits(e.key().0) > limit) {
            last.remove();
        }
    }

    /// Smallest worst degree, smallest criterion and number of searched sequences; `None` if there are
    /// none.
    pub(crate) fn first(&self) -> Option<(usize, f64, u64)> {
        let least = f64::from_bits(self.counts.keys().next()?.0);
        Some((self.degree, least, self.counts.values().fold(0, |sum, count| sum.saturating_add(*count))))
    }

    /// True if all criteria tie with the smallest one and all sequences have 1 to `order` searched
    /// images, as after any search.
    pub(crate) fn are_tidy(&self, order: usize) -> bool {
        let limit = self.limit();
        let tidy = |(&(bits, images), &count): (&(u64, usize), &u64)| {
            let value = f64::from_bits(bits);
            value > 0.0 && value <= limit && (1..=order).contains(&images) && count > 0
        };
        self.counts.iter().all(tidy)
    }

    pub(crate) fn merge(&mut self, other: Self) {
        for ((bits, images), count) in other.counts {
            let value = f64::from_bits(bits);
            self.add(&Score { violation: 0.0, degree: other.degree, value }, images, count);
        }
    }

    /// Number of all sequences that tie: each searched one stands for `order` divided by its searched
    /// images.
    pub fn total(&self, order: usize) -> u64 {
        let limit = self.limit();
        let mut by_images: BTreeMap<usize, u128> = BTreeMap::new();
        for (&(bits, images), &count) in &self.counts {
            if f64::from_bits(bits) <= limit {
                *by_images.entry(images).or_default() += u128::from(count) * order as u128;
            }
        }
        // images of one sequence have as many searched images: each sum is a multiple of that number
        // but for rounding at the limit
        let all = by_images.into_iter().map(|(images, sum)| (sum + images as u128 / 2) / images as u128);
        u64::try_from(all.sum::<u128>()).unwrap_or(u64::MAX)
    }
}
