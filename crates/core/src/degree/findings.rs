//! Verdicts on any model: exact and typed, without texts. Every answer is a view of them.

use super::filtration::Degrees;
use super::status::Verdict;

/// The verdicts on a model, a platform or any system.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// Ranks, and the degree of every unknown in model order.
    pub degrees: Degrees,
    /// Indistinguishable unknowns of every unknown.
    pub partners: Vec<Vec<usize>>,
    /// Verdicts on the requested combinations.
    pub asked: Vec<Verdict>,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Certainty of verdicts on which two prime fields agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ByPrimes {
    /// The two random primes (61 bits) that agree.
    pub primes: [u64; 2],
    /// A third one, where two leave a larger probability than one in 10^9; `None` where they do not.
    pub third: Option<u64>,
    /// Bound on the probability that any verdict is wrong.
    pub error_bound: f64,
}

impl ByPrimes {
    /// The two primes as text: they exceed the integers that a JSON number holds exactly.
    pub(crate) fn primes_as_text(&self) -> [String; 2] {
        self.primes.map(|p| p.to_string())
    }

    /// All primes as text.
    pub(crate) fn all_as_text(&self) -> Vec<String> {
        self.primes_as_text().into_iter().chain(self.third.map(|p| p.to_string())).collect()
    }
}

impl Findings {
    /// Verdict on an unknown.
    pub fn verdict(&self, unknown: usize) -> Verdict {
        Verdict::of(&self.degrees, unknown)
    }
}
