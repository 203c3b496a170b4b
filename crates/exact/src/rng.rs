//! The seeded generator behind every random choice of this crate.

use sha2::{Digest, Sha256};

/// SplitMix64 (Steele, Lea, Flood 2014, doi:10.1145/2660193.2660195): one seed, one stream.
///
/// ```
/// use obsdeg_exact::SplitMix64;
/// let (mut a, mut b) = (SplitMix64::new(7), SplitMix64::new(7));
/// assert_eq!(a.next_u64(), b.next_u64());
/// ```
#[derive(Debug, Clone)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// The stream of `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The stream of `seed` for one purpose and one input: it starts at the first 64 bits of SHA-256 (FIPS
    /// 180-4) of all three.
    ///
    /// Primes drawn from a stream that does not depend on the input are known constants, and an input
    /// can be built in which they divide a deciding minor. Here every change of the input changes the
    /// primes: an input that is wrong with probability q takes about 1/q trials. A weaker hash would
    /// suffice against accidents. SHA-256 is fixed by a standard, so the same input has the same primes
    /// in every version, and no attack on it is known.
    ///
    /// `input` is hashed part by part, each with its length, so that the division into parts counts.
    ///
    /// ```
    /// use obsdeg_exact::SplitMix64;
    /// let first = |input: &[&str]| SplitMix64::of(1, "verdicts", input).next_u64();
    /// assert_eq!(first(&["x", "-x"]), first(&["x", "-x"]));
    /// assert_ne!(first(&["x", "-x"]), first(&["x-", "x"]));
    /// ```
    pub fn of<S: AsRef<str>>(seed: u64, purpose: &str, input: &[S]) -> Self {
        let mut hash = Sha256::new();
        hash.update(seed.to_le_bytes());
        for part in std::iter::once(purpose).chain(input.iter().map(AsRef::as_ref)) {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
        let digest = hash.finalize();
        Self(digest.iter().take(8).rev().fold(0, |state, &byte| state << 8 | u64::from(byte)))
    }

    /// The next 64 bits.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// An integer of `0..bound`, with a bias below 2^-64.
    pub fn below(&mut self, bound: u64) -> u64 {
        ((u128::from(self.next_u64()) * u128::from(bound)) >> 64) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The start of a stream as computed by `printf` and `sha256sum`.
    #[test]
    fn streams_start_where_the_standard_says() {
        assert_eq!(SplitMix64::of(1, "verdicts", &["a", "bc"]).0, 0x83cf_5556_0392_a482);
        assert_eq!(SplitMix64::of::<&str>(0, "", &[]).0, 0xd59d_71f7_ff08_4737);
    }

    #[test]
    fn reference_vector() {
        // the outputs of the authors' program for the seed 1234567
        let mut rng = SplitMix64::new(1_234_567);
        let expected = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!(expected.map(|_| rng.next_u64()), expected);
    }

    #[test]
    fn integers_below_a_bound() {
        let first = 6_457_827_717_110_365_317u64;
        let below = |bound: u64| SplitMix64::new(1_234_567).below(bound);
        assert_eq!((below(1), below(1 << 63)), (0, first >> 1));
        // floor(100 * 0.350078...)
        assert_eq!(below(100), 35);
    }
}
