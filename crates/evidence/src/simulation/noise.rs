//! Random numbers of a run.

use obsdeg_exact::SplitMix64;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Stream of random numbers of one run.
#[derive(Debug, Clone)]
pub struct Noise(Pcg64);

impl Noise {
    /// Stream of run `run` under `seed`: streams do not depend on each other.
    pub fn new(seed: u64, run: u64) -> Self {
        let mut mixed = SplitMix64::new(seed ^ run.rotate_left(32));
        let state = u128::from(mixed.next_u64()) << 64 | u128::from(mixed.next_u64());
        Self(Pcg64::new(state, u128::from(run)))
    }

    /// Standard normal random number.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}
