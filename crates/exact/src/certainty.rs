//! The bound on the probability that a verdict computed modulo random primes is wrong.

/// Quantities that the error bound depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RankClaim {
    /// Number of unknowns: no minor that decides a rank is larger.
    pub unknowns: usize,
    /// Number of rank decisions that the verdict rests on.
    pub decisions: usize,
    /// Order of the roots of unity of the angles.
    pub order: u64,
    /// Bound on the degree of one row in the random values (angular rates, generic angles).
    pub row_degree: usize,
    /// Bound on the bits of one row: log2 of its norm once denominators are cleared.
    pub row_bits: f64,
}

/// An upper bound on the probability that at least one rank decision is wrong in each of `fields`
/// independent random fields.
///
/// A rank can only come out too small, and only if the minor that shows the true rank vanishes. That
/// minor is a polynomial in the random values over the integers of the n-th cyclotomic field:
/// - it vanishes at a random point with probability at most `unknowns * row_degree / 2^60`
///   (Schwartz 1980, doi:10.1145/322217.322225);
/// - its coefficients vanish modulo a random prime ideal of norm above 2^60 with probability at most
///   `unknowns * row_bits / 60` over the number of primes `p = 1 mod n` of 61 bits, taken by their
///   density `2^60 / (phi(n) ln 2^61)`.
///
/// Primes and points are random to the author of the input, since a hash of the input chooses them
/// ([`crate::SplitMix64::of`]); every field has a stream of its own.
///
/// ```
/// use obsdeg_exact::certainty::{RankClaim, error_bound};
/// let claim = RankClaim { unknowns: 15, decisions: 48, order: 24, row_degree: 4, row_bits: 12.0 };
/// assert!(error_bound(&claim, 2) < 1e-20);
/// ```
pub fn error_bound(claim: &RankClaim, fields: i32) -> f64 {
    let two60 = 2f64.powi(60);
    let phi = [2u64, 3, 5]
        .iter()
        .filter(|&&q| claim.order.is_multiple_of(q))
        .fold(claim.order as f64, |phi, &q| phi * (1.0 - 1.0 / q as f64));
    let primes = two60 / (phi * 61.0 * std::f64::consts::LN_2);
    let n = claim.unknowns as f64;
    let point = n * claim.row_degree as f64 / two60;
    let prime = (n * claim.row_bits / 60.0) / primes;
    (claim.decisions as f64 * (point + prime)).min(1.0).powi(fields)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values computed by hand from the two items of [`error_bound`], with powers of two as exact
    /// decimals.
    #[test]
    fn hand_computed_values() {
        const TWO60: f64 = 1_152_921_504_606_846_976.0;
        let close = |found: f64, expected: f64| {
            assert!((found / expected - 1.0).abs() < 1e-12, "{found:e} instead of {expected:e}");
        };
        let nothing = RankClaim { unknowns: 3, decisions: 7, order: 4, row_degree: 0, row_bits: 0.0 };
        assert_eq!(error_bound(&nothing, 1), 0.0);
        // 7 decisions, each a minor of degree 3 * 5
        let point = RankClaim { row_degree: 5, ..nothing };
        close(error_bound(&point, 1), 105.0 / TWO60);
        close(error_bound(&point, 2), (105.0 / TWO60) * (105.0 / TWO60));
        // minors of 3 * 40 bits have at most two prime factors of 60 bits, out of 2^60 / (phi ln 2^61)
        // primes; ln 2^61
        // = 42.281978...
        let ln = 42.281_978_014_156_64;
        for (order, phi) in [(4, 2.0), (24, 8.0), (360, 96.0), (1000, 400.0), (7_200, 1920.0)] {
            let prime = RankClaim { row_bits: 40.0, order, ..nothing };
            close(error_bound(&prime, 1), 7.0 * 2.0 * phi * ln / TWO60);
            let both = RankClaim { row_degree: 5, ..prime };
            close(error_bound(&both, 1), (105.0 + 14.0 * phi * ln) / TWO60);
        }
    }

    #[test]
    fn finer_angles_weaken_the_bound_and_fields_multiply() {
        let claim = |order| RankClaim { unknowns: 15, decisions: 48, order, row_degree: 4, row_bits: 12.0 };
        let coarse = error_bound(&claim(24), 2);
        let fine = error_bound(&claim(360_000_000_000), 2);
        assert!(coarse < fine && fine < 1e-4, "{coarse:e} {fine:e}");
        let one = error_bound(&claim(24), 1);
        assert!((error_bound(&claim(24), 2) / (one * one) - 1.0).abs() < 1e-12);
        assert_eq!(error_bound(&RankClaim { decisions: usize::MAX, ..claim(24) }, 1), 1.0);
    }
}
