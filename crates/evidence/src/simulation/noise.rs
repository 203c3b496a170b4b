//! Random numbers of a run.

use obsdeg_exact::SplitMix64;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// The stream of random numbers of one run.
#[derive(Debug, Clone)]
pub struct Noise(Pcg64);

impl Noise {
    /// The stream of run `run` under `seed`: streams do not depend on who else draws.
    pub fn new(seed: u64, run: u64) -> Self {
        let mut mixed = SplitMix64::new(seed ^ run.rotate_left(32));
        let state = u128::from(mixed.next_u64()) << 64 | u128::from(mixed.next_u64());
        Self(Pcg64::new(state, u128::from(run)))
    }

    /// A standard normal.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}
