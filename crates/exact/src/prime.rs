//! Random primes `p = 1 mod n` of 61 bits, with a primitive n-th root of unity.

use crate::{Field, SplitMix64};

/// Error of the choice of a field.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PrimeError {
    /// Order that is not usable.
    #[error(
        "the order of the roots of unity is {found}; expected a multiple of 4 up to 2^42 with no prime \
         factor but 2, 3 and 5"
    )]
    Order {
        /// The order that was asked for.
        found: u64,
    },
}

/// A random prime field that holds the n-th roots of unity.
///
/// ```
/// use obsdeg_exact::{RootField, SplitMix64};
/// let k = RootField::random(360, &mut SplitMix64::new(1))?;
/// let f = k.field;
/// assert_eq!(f.pow(k.root, 360), f.one());
/// assert_ne!(f.pow(k.root, 180), f.one());
/// # Ok::<(), obsdeg_exact::PrimeError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct RootField {
    /// The field.
    pub field: Field,
    /// The order `n` of the root.
    pub order: u64,
    /// A primitive n-th root of unity `g`, the image of `exp(2 pi i / n)`.
    pub root: u64,
}

const LOW: u64 = 1 << 60;

impl RootField {
    /// A field with a random prime `2^60 < p < 2^61`, `p = 1 mod order`, and a random primitive root.
    ///
    /// # Errors
    /// [`PrimeError::Order`] when `order` is not a multiple of 4, exceeds 2^42, or has a prime factor
    /// other than 2, 3 and 5 (no decimal of a degree needs another).
    pub fn random(order: u64, rng: &mut SplitMix64) -> Result<Self, PrimeError> {
        let smooth = [2u64, 3, 5].iter().fold(order, |mut rest, &q| {
            while rest != 0 && rest.is_multiple_of(q) {
                rest /= q;
            }
            rest
        });
        if !order.is_multiple_of(4) || order > 1 << 42 || smooth != 1 {
            return Err(PrimeError::Order { found: order });
        }
        let first = LOW / order + 1;
        let count = LOW / order;
        let p = loop {
            let p = 1 + order * (first + rng.below(count - 1));
            if is_prime(p) {
                break p;
            }
        };
        let field = Field::new(p);
        let root = loop {
            let x = field.from_u64(2 + rng.below(p - 2));
            let g = field.pow(x, (p - 1) / order);
            let primitive = [2, 3, 5]
                .iter()
                .filter(|&&q| order.is_multiple_of(q))
                .all(|&q| field.pow(g, order / q) != field.one());
            if primitive {
                break g;
            }
        };
        Ok(Self { field, order, root })
    }

    /// The same field under another embedding, `g -> g^a`; `a` must be prime to the order.
    pub fn conjugate(&self, a: u64) -> Self {
        Self { root: self.field.pow(self.root, a), ..*self }
    }
}

/// Miller-Rabin with the first twelve primes: a proof for every 64-bit integer
/// (Sorenson, Webster 2015, doi:10.1090/mcom/3134).
pub fn is_prime(n: u64) -> bool {
    const BASES: [u64; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
    if n < 2 {
        return false;
    }
    for q in BASES {
        if n.is_multiple_of(q) {
            return n == q;
        }
    }
    let mul = |a: u64, b: u64| (u128::from(a) * u128::from(b) % u128::from(n)) as u64;
    let s = (n - 1).trailing_zeros();
    BASES.iter().all(|&base| {
        let (mut x, mut square, mut e) = (1, base, (n - 1) >> s);
        while e > 0 {
            if e & 1 == 1 {
                x = mul(x, square);
            }
            square = mul(square, square);
            e >>= 1;
        }
        if x == 1 || x == n - 1 {
            return true;
        }
        (1..s).any(|_| {
            x = mul(x, x);
            x == n - 1
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn primality_of_known_numbers() {
        // OEIS A014233: the least strong pseudoprimes to the first 1, 2, .. 11 prime bases
        for n in [
            2047,
            1_373_653,
            25_326_001,
            3_215_031_751,
            2_152_302_898_747,
            3_474_749_660_383,
            341_550_071_728_321,
            3_825_123_056_546_413_051,
        ] {
            assert!(!is_prime(n), "{n}");
        }
        // 2^61 - 1 is a Mersenne prime; 2^60 + 33 is the first prime past 2^60
        assert!(is_prime((1 << 61) - 1));
        assert!((1..33).all(|d| !is_prime((1u64 << 60) + d)));
        assert!(is_prime((1 << 60) + 33));
        let sieve = |n: u64| n > 1 && (2..n).all(|d| !n.is_multiple_of(d));
        assert!((0..500).all(|n| is_prime(n) == sieve(n)));
    }

    #[test]
    fn roots_have_their_exact_order() {
        for order in [4, 24, 360, 3_600, 360_000_000_000] {
            let k = RootField::random(order, &mut SplitMix64::new(order)).expect("valid order");
            assert_eq!(k.field.modulus() % order, 1);
            assert_eq!(k.field.pow(k.root, order), k.field.one());
            assert_eq!(k.field.pow(k.root, order / 2), k.field.neg(k.field.one()));
        }
    }

    #[test]
    fn bad_orders_are_named() {
        for order in [0, 2, 6, 28, 1 << 43] {
            let e = RootField::random(order, &mut SplitMix64::new(1)).expect_err("bad order");
            assert_eq!(e, PrimeError::Order { found: order });
        }
    }
}
