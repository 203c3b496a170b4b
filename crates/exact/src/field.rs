//! Arithmetic modulo a prime `2^60 < p < 2^61`.

/// A prime field in Montgomery form: an element is the `u64` `a * 2^64 mod p`, below `p`.
///
/// ```
/// use obsdeg_exact::Field;
/// let f = Field::new((1 << 60) + 33); // a prime
/// let third = f.inv(f.from_i64(3));
/// assert_eq!(f.mul(third, f.from_i64(-6)), f.from_i64(-2));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    p: u64,
    /// `-p^-1 mod 2^64`.
    neg_inv: u64,
    /// `2^64 mod p`, the image of one.
    one: u64,
    /// `2^128 mod p`.
    r2: u64,
}

impl Field {
    /// Number of products of two elements that may be added to a settled sum: `p 2^64 + 8 p^2 < 2 p
    /// 2^64`.
    pub const LAZY: usize = 8;
    /// Number of products of two elements that may be added to a settled sum before
    /// [`Field::settle_many`]: `p 2^64 + 56 p^2 < 2^125 + 56 * 2^122 = 2^128`.
    pub const MANY: usize = 56;

    /// The field of the prime `p`; the caller must pass an odd prime between 2^60 and 2^61.
    pub fn new(p: u64) -> Self {
        debug_assert!(p > 1 << 60 && p < 1 << 61 && p % 2 == 1);
        let mut inv = p; // Newton: doubles the number of right bits
        for _ in 0..5 {
            inv = inv.wrapping_mul(2u64.wrapping_sub(p.wrapping_mul(inv)));
        }
        let one = ((1u128 << 64) % u128::from(p)) as u64;
        let r2 = ((u128::from(one) * u128::from(one)) % u128::from(p)) as u64;
        Self { p, neg_inv: inv.wrapping_neg(), one, r2 }
    }

    /// The prime.
    pub fn modulus(&self) -> u64 {
        self.p
    }

    /// The neutral element of multiplication.
    pub fn one(&self) -> u64 {
        self.one
    }

    /// `t / 2^64 mod p` for `t < p * 2^64`.
    #[inline]
    fn redc(&self, t: u128) -> u64 {
        let m = (t as u64).wrapping_mul(self.neg_inv);
        let r = ((t + wide_product(m, self.p)) >> 64) as u64;
        self.once(r)
    }

    /// Reduces a number below `2p`: by a minimum, because a branch is mispredicted half of the time.
    #[inline]
    fn once(&self, a: u64) -> u64 {
        a.min(a.wrapping_sub(self.p))
    }

    /// The image of an unsigned integer.
    pub fn from_u64(&self, a: u64) -> u64 {
        self.redc(wide_product(a % self.p, self.r2))
    }

    /// The image of a signed integer.
    pub fn from_i64(&self, a: i64) -> u64 {
        let m = self.from_u64(a.unsigned_abs());
        if a < 0 { self.neg(m) } else { m }
    }

    /// The image of `num / den`; `den` must not be a multiple of `p`.
    pub fn from_ratio(&self, num: i64, den: i64) -> u64 {
        self.mul(self.from_i64(num), self.inv(self.from_i64(den)))
    }

    /// The representative in `0..p` of an element.
    pub fn to_u64(&self, a: u64) -> u64 {
        self.redc(u128::from(a))
    }

    /// `a + b`.
    #[inline]
    pub fn add(&self, a: u64, b: u64) -> u64 {
        self.once(a + b)
    }

    /// `a - b`.
    #[inline]
    pub fn sub(&self, a: u64, b: u64) -> u64 {
        let d = a.wrapping_sub(b);
        d.min(d.wrapping_add(self.p))
    }

    /// `-a`.
    #[inline]
    pub fn neg(&self, a: u64) -> u64 {
        if a == 0 { 0 } else { self.p - a }
    }

    /// `a b`.
    #[inline]
    pub fn mul(&self, a: u64, b: u64) -> u64 {
        self.redc(wide_product(a, b))
    }

    /// An element equal to `a b`, below `2p` but not always below p, for `a < 4p` and `b < 2p`: `t < 8
    /// p^2 <= p 2^64`.
    #[inline]
    pub(crate) fn loose_product(&self, a: u64, b: u64) -> u64 {
        let t = wide_product(a, b);
        let m = (t as u64).wrapping_mul(self.neg_inv);
        ((t + wide_product(m, self.p)) >> 64) as u64
    }

    /// An element equal to `a b + c d`, below `2p`, for all of them below `2p`: `t < 8 p^2`.
    #[inline]
    pub(crate) fn loose_sum(&self, [a, b]: [u64; 2], [c, d]: [u64; 2]) -> u64 {
        let t = wide_product(a, b) + wide_product(c, d);
        let m = (t as u64).wrapping_mul(self.neg_inv);
        ((t + wide_product(m, self.p)) >> 64) as u64
    }

    /// Reduces a number below `4p` to one below `2p`.
    #[inline]
    pub(crate) fn loosely(&self, a: u64) -> u64 {
        a.min(a.wrapping_sub(2 * self.p))
    }

    /// Reduces a number below `2p`.
    #[inline]
    pub(crate) fn reduced(&self, a: u64) -> u64 {
        a.min(a.wrapping_sub(self.p))
    }

    /// `a^e`.
    pub fn pow(&self, mut a: u64, mut e: u64) -> u64 {
        let mut r = self.one;
        while e > 0 {
            if e & 1 == 1 {
                r = self.mul(r, a);
            }
            a = self.mul(a, a);
            e >>= 1;
        }
        r
    }

    /// `1 / a` (0 for `a = 0`), by the extended Euclidean algorithm.
    pub fn inv(&self, a: u64) -> u64 {
        let (mut r0, mut r1) = (self.p, a);
        let (mut t0, mut t1) = (0i64, 1i64); // |t| < p < 2^61
        while r1 != 0 {
            let q = r0 / r1;
            (r0, r1) = (r1, r0 - q * r1);
            (t0, t1) = (t1, t0 - q as i64 * t1);
        }
        // a = A 2^64; t0 = A^-1 2^-64: two factors 2^64 restore the form
        let plain = if a == 0 {
            0
        } else if t0 < 0 {
            (t0 + self.p as i64) as u64
        } else {
            t0 as u64
        };
        self.mul(self.mul(plain, self.r2), self.r2)
    }

    /// The product as an unreduced sum: see [`Field::settle`] and [`Field::reduce`].
    #[inline]
    pub fn lazy(&self, a: u64, b: u64) -> u128 {
        wide_product(a, b)
    }

    /// Brings a settled sum plus at most [`Field::LAZY`] products below `p 2^64`: a settled sum.
    #[inline]
    pub fn settle(&self, sum: u128) -> u128 {
        let bound = u128::from(self.p) << 64;
        if sum >= bound { sum - bound } else { sum }
    }

    /// The element of a settled sum plus at most [`Field::LAZY`] products.
    #[inline]
    pub fn reduce(&self, sum: u128) -> u64 {
        self.redc(self.settle(sum))
    }

    /// The element of a settled sum, or of a sum of at most [`Field::LAZY`] products: `8 p^2 < p 2^64`.
    #[inline]
    pub fn reduce_settled(&self, sum: u128) -> u64 {
        self.redc(sum)
    }

    /// Brings a settled sum plus at most [`Field::MANY`] products below `p 2^64`: a settled sum.
    #[inline]
    pub fn settle_many(&self, sum: u128) -> u128 {
        let below = |high: u64, bound: u64| high.min(high.wrapping_sub(bound));
        let high = (sum >> 64) as u64; // below 2^64 < 16 p
        let high = [8, 4, 2, 1].iter().fold(high, |high, k| below(high, k * self.p));
        u128::from(high) << 64 | u128::from(sum as u64)
    }

    /// The element of a settled sum plus at most [`Field::MANY`] products.
    #[inline]
    pub fn reduce_many(&self, sum: u128) -> u64 {
        self.redc(self.settle_many(sum))
    }

    /// `start + sum a_i b_i`, with one reduction at the end.
    #[inline]
    pub fn dot(&self, start: u64, terms: impl IntoIterator<Item = (u64, u64)>) -> u64 {
        // `start` enters as start * 2^64, which the reduction divides out
        let mut sum = u128::from(start) << 64;
        let mut pending = 0;
        for (a, b) in terms {
            if pending == Self::LAZY {
                sum = self.settle(sum);
                pending = 0;
            }
            sum += self.lazy(a, b);
            pending += 1;
        }
        self.reduce(sum)
    }
}

/// `a b` in 128 bits.
#[cfg(not(target_arch = "wasm32"))]
#[inline(always)]
fn wide_product(a: u64, b: u64) -> u128 {
    u128::from(a) * u128::from(b)
}

/// `a b` in 128 bits by products of 32 bits: a processor without 128 bits calls a function for them.
#[cfg(any(test, target_arch = "wasm32"))]
#[inline(always)]
fn product_of_halves(a: u64, b: u64) -> u128 {
    let low = |x: u64| x & 0xffff_ffff;
    let ll = low(a) * low(b);
    let lh = low(a) * (b >> 32) + (ll >> 32);
    let hl = (a >> 32) * low(b) + low(lh);
    let high = (a >> 32) * (b >> 32) + (lh >> 32) + (hl >> 32);
    u128::from(high) << 64 | u128::from(hl << 32 | low(ll))
}

#[cfg(target_arch = "wasm32")]
use product_of_halves as wide_product;

#[cfg(test)]
mod tests {
    use super::*;
    use num_bigint::BigUint;
    use proptest::prelude::*;

    const P: u64 = (1 << 60) + 33;

    fn big(a: u64) -> BigUint {
        BigUint::from(a)
    }

    fn big128(a: u128) -> BigUint {
        BigUint::from(a)
    }

    proptest! {
        #[test]
        fn products_by_halves(a in any::<u64>(), b in any::<u64>()) {
            for (a, b) in [(a, b), (u64::MAX, b), (u64::MAX, u64::MAX), (a << 32 | 0xffff_ffff, b | 0xffff_ffff)] {
                prop_assert_eq!(product_of_halves(a, b), u128::from(a) * u128::from(b));
            }
        }

        #[test]
        fn agrees_with_big_integers(a in any::<u64>(), b in any::<u64>()) {
            let f = Field::new(P);
            let (x, y) = (f.from_u64(a), f.from_u64(b));
            prop_assert_eq!(big(f.to_u64(f.mul(x, y))), big(a) * big(b) % big(P));
            prop_assert_eq!(big(f.to_u64(f.add(x, y))), (big(a) + big(b)) % big(P));
            prop_assert_eq!(f.add(f.sub(x, y), y), x);
            prop_assert_eq!(f.sub(x, y), f.add(x, f.neg(y)));
            if a % P != 0 {
                prop_assert_eq!(f.mul(x, f.inv(x)), f.one());
            }
        }

        #[test]
        fn dot_is_the_sum_of_products(v in prop::collection::vec((0..P, 0..P), 0..60), s in 0..P) {
            let f = Field::new(P);
            let slow = v.iter().fold(s, |acc, &(a, b)| f.add(acc, f.mul(a, b)));
            prop_assert_eq!(f.dot(s, v.iter().copied()), slow);
        }
    }

    #[test]
    fn extremes_do_not_overflow() {
        // the smallest and the largest prime allowed
        for p in [P, (1 << 61) - 1] {
            let f = Field::new(p);
            let m = p - 1;
            let n = 1000;
            let slow = (0..n).fold(m, |acc, _| f.add(acc, f.mul(m, m)));
            assert_eq!(f.dot(m, (0..n).map(|_| (m, m))), slow);
            // the largest sums: of products alone, and of a settled sum with products
            let few = (0..Field::LAZY).fold(0, |sum, _| sum + f.lazy(m, m));
            assert_eq!(f.reduce_settled(few), f.dot(0, (0..Field::LAZY).map(|_| (m, m))));
            let largest = (u128::from(p) << 64) - 1;
            let many = (0..Field::MANY).fold(largest, |sum, _| sum + f.lazy(m, m));
            let settled = f.settle_many(many);
            assert_eq!((settled <= largest, big128(settled) % big(p)), (true, big128(many) % big(p)));
            assert_eq!(f.reduce_many(many), f.reduce_settled(settled));
            // around the multiples of the modulus that are subtracted
            for k in 0..8u128 {
                let at = k * (u128::from(p) << 64);
                for sum in [at, at + 1, at + largest, at.saturating_sub(1)] {
                    let settled = f.settle_many(sum);
                    assert_eq!((settled <= largest, big128(settled) % big(p)), (true, big128(sum) % big(p)));
                }
            }
        }
    }
}
