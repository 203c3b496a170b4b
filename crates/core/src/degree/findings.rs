//! What is found of a model, whichever it is: exact and typed, without a text. Every answer is a view of it.

use super::staircase::Degrees;
use super::status::Verdict;

/// The verdicts on a model, a platform or any system.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    /// Ranks, and the degree of every unknown in model order.
    pub degrees: Degrees,
    /// For every unknown those that it cannot be told from.
    pub partners: Vec<Vec<usize>>,
    /// The verdicts on the combinations that were asked for.
    pub asked: Vec<Verdict>,
    /// Seed of all random choices.
    pub seed: u64,
}

/// How certain verdicts are that two prime fields agree on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ByPrimes {
    /// The two random primes (61 bits) that agree.
    pub primes: [u64; 2],
    /// Bound on the probability that any verdict is wrong.
    pub error_bound: f64,
}

impl ByPrimes {
    /// The primes as text: they are beyond what a number of JSON holds exactly.
    pub fn primes_as_text(&self) -> [String; 2] {
        self.primes.map(|p| p.to_string())
    }
}

impl Findings {
    /// The verdict on an unknown.
    pub fn verdict(&self, unknown: usize) -> Verdict {
        Verdict::of(&self.degrees, unknown)
    }
}
