//! Sums of products of balls, rounded once at the end.

use super::{Ball, FAR, SLACK, exact_tail, power, product, shifted_right, subtract_from};

/// Sum `sum a_i b_i` over balls: digits in two's complement above one last place, that of the largest
/// term so far.
///
/// Terms are neither normalised nor rounded one by one, which is most of the cost of a sum of balls.
/// The result contains every number that single operations by [`Ball::mul`] and [`Ball::add`] must
/// contain.
///
/// ```
/// use obsdeg_exact::{Ball, BallSum};
/// let third = Ball::<4>::from_i64(3).inverse().expect("not zero");
/// let mut sum = BallSum::NONE;
/// for k in 1..=3 {
///     sum.add_product(&third, &Ball::from_i64(k));
/// }
/// sum.add(&Ball::from_i64(-2));
/// assert!(sum.ball().is_zero() && sum.ball().radius_log2() < -245.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BallSum<const N: usize> {
    /// Exponent: every term is below `2^top`; a unit of the last place is `2^(top - 64 N)`.
    top: i64,
    /// Digits above `2^top`, and the sign.
    head: i64,
    /// Limbs, least first.
    digits: [u64; N],
    /// Error in units of the last place.
    error: f64,
}

impl<const N: usize> BallSum<N> {
    /// The empty sum.
    pub const NONE: Self = Self { top: i64::MIN / 4, head: 0, digits: [0; N], error: 0.0 };

    /// Adds `x y`, at the least cost where `x` is a power of two.
    #[inline]
    pub fn add_product(&mut self, x: &Ball<N>, y: &Ball<N>) {
        if x.is_zero() || y.is_zero() {
            if !x.is_exactly_zero() && !y.is_exactly_zero() {
                self.widen(x.bound_log2() + y.bound_log2());
            }
            return;
        }
        // a power of two, above all one
        if x.mantissa[N - 1] == 1 << 63 && x.error == 0.0 && x.mantissa[..N - 1].iter().all(|d| *d == 0) {
            let (negative, exponent) = (x.negative != y.negative, x.exponent + y.exponent - 1);
            return self.add_digits(negative, exponent, &y.mantissa, y.error);
        }
        let exponent = x.exponent + y.exponent;
        // the product of both errors, as fractions of 2^exponent, in factors that doubles can hold
        let part = power(-Ball::<N>::BITS / 4);
        let both = ((x.error * part) * (y.error * part)) * part * part;
        let error = x.fraction() * y.error + y.fraction() * x.error + both;
        if !error.is_finite() {
            return self.widen(x.bound_log2() + y.bound_log2());
        }
        let (digits, next) = product(&x.mantissa, &y.mantissa);
        // the digits below the last place, and what the product left out there
        let rounded = if error == 0.0 && next == 0 { exact_tail(&x.mantissa, &y.mantissa) } else { 2.0 };
        self.add_digits(x.negative != y.negative, exponent, &digits, error + rounded);
    }

    /// Adds `x`.
    pub fn add(&mut self, x: &Ball<N>) {
        if !x.is_zero() {
            self.add_digits(x.negative, x.exponent, &x.mantissa, x.error);
        } else if !x.is_exactly_zero() {
            self.widen(x.bound_log2());
        }
    }

    /// Adds digits below `2^exponent`, with an error in units of their last place.
    #[inline]
    fn add_digits(&mut self, negative: bool, exponent: i64, digits: &[u64; N], error: f64) {
        if exponent > self.top {
            self.rise(exponent);
        }
        let apart = self.top - exponent;
        if apart >= Ball::<N>::BITS || exponent as f64 > FAR {
            // digits far below the last place: only their size counts
            let off = (exponent - Ball::<N>::BITS) as f64 + error.log2();
            return self.widen((exponent as f64).max(off) + 1.0);
        }
        let (limbs, bits) = (apart as usize / 64, apart % 64);
        let lost = (digits[limbs] << 1) << (63 - bits) != 0 || digits[..limbs].iter().any(|d| *d != 0);
        let carry = if limbs == 0 {
            add_shifted(&mut self.digits, digits, bits, negative)
        } else {
            let mut lower = [0; N];
            lower[..N - limbs].copy_from_slice(&digits[limbs..]);
            add_shifted(&mut self.digits, &lower, bits, negative)
        };
        self.head += i64::from(carry) - i64::from(negative);
        self.error = (self.error + error * power(-apart) + f64::from(lost || apart > 900)) * SLACK;
    }

    /// Adds an error of `2^log2`.
    #[cold]
    fn widen(&mut self, log2: f64) {
        if log2 == f64::NEG_INFINITY {
            return;
        }
        let place = log2.clamp(-FAR, FAR).ceil() as i64 + Ball::<N>::BITS;
        // digits far below the error are useless, and the error must stay in the range of doubles
        if place - self.top > 512 {
            self.rise(place);
        }
        self.error = (self.error + power(place - self.top).max(f64::MIN_POSITIVE)) * SLACK;
    }

    /// Raises the last place.
    #[cold]
    fn rise(&mut self, top: i64) {
        let apart = top - self.top;
        self.top = top;
        if self.error > 0.0 {
            self.error = self.error * power(-apart) * SLACK + f64::MIN_POSITIVE;
        }
        if self.head == 0 && self.digits == [0; N] {
            return;
        }
        let mut lost = false;
        // rounded down
        let mut left = apart.min(64 * (N as i64 + 1));
        while left > 0 {
            let bits = left.min(63);
            lost |= self.digits[0] << (64 - bits) != 0;
            for i in 0..N {
                let above = if i + 1 < N { self.digits[i + 1] } else { self.head as u64 };
                self.digits[i] = self.digits[i] >> bits | above << (64 - bits);
            }
            self.head >>= bits;
            left -= bits;
        }
        self.error = (self.error + f64::from(lost)) * SLACK;
    }

    /// The value of the sum.
    pub fn ball(&self) -> Ball<N> {
        let mut mantissa = self.digits;
        let (negative, mut head) = (self.head < 0, self.head as u64);
        if negative {
            mantissa = [0; N];
            let borrow = subtract_from(&mut mantissa, &self.digits);
            head = head.wrapping_neg().wrapping_sub(u64::from(borrow));
        }
        let out = Ball { negative, exponent: self.top, mantissa, error: self.error };
        if head == 0 {
            if self.error == 0.0 && mantissa == [0; N] {
                return Ball::ZERO;
            }
            return out.normalised(self.error);
        }
        let bits = 64 - head.leading_zeros();
        let (mut mantissa, lost) = shifted_right(&mantissa, bits as usize);
        mantissa[N - 1] |= head << (64 - bits);
        let error = (self.error * power(-i64::from(bits)) + f64::from(lost)) * SLACK;
        Ball { mantissa, exponent: self.top + i64::from(bits), error, ..out }.settled()
    }
}

/// Adds digits shifted to the right by less than 64 bits, or subtracts them if `negative`. Returns the
/// carry of the sum, for a subtraction that of the complement.
#[inline(always)]
fn add_shifted<const N: usize>(sum: &mut [u64; N], digits: &[u64; N], bits: i64, negative: bool) -> bool {
    let (mask, mut carry) = (0u64.wrapping_sub(u64::from(negative)), negative);
    for i in 0..N {
        let above = if i + 1 < N { digits[i + 1] } else { 0 };
        let shifted = (digits[i] >> bits | (above << 1) << (63 - bits)) ^ mask;
        let (x, first) = sum[i].overflowing_add(shifted);
        let (x, second) = x.overflowing_add(u64::from(carry));
        sum[i] = x;
        carry = first | second;
    }
    carry
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ball::tests::{exact, holds, numbers};
    use num_rational::BigRational;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// For all true numbers, every partial sum contains the true sum, and is not much wider than by
        /// single operations.
        #[test]
        fn sums_hold_the_true_ones(
            terms in prop::collection::vec((numbers(), numbers()), 0..6),
            backwards in any::<bool>(),
        ) {
            let (mut sum, mut one_by_one) = (BallSum::NONE, Ball::<2>::ZERO);
            let mut truth = BigRational::from_integer(0.into());
            let mut all: Vec<_> = terms.iter().map(|((a, x), (b, y))| (*a, *b, x * y)).collect();
            if backwards {
                // cancelling terms
                all.extend(all.clone().into_iter().rev().map(|(a, b, z)| (a.neg(), b, -z)));
            }
            for (a, b, z) in &all {
                sum.add_product(a, b);
                one_by_one = one_by_one.add(&a.mul(b));
                truth += z;
                let ball = sum.ball();
                prop_assert!(holds(&ball, &truth), "{ball:?} of {sum:?}");
                prop_assert!(ball.is_zero() == holds(&ball, &BigRational::from_integer(0.into())));
                // at most a unit of the largest term for each further term
                let largest = all.iter().map(|(a, b, _)| a.bound_log2() + b.bound_log2()).fold(f64::MIN, f64::max);
                prop_assert!(ball.radius_log2() <= one_by_one.radius_log2().max(largest - 124.0) + 4.0);
            }
            for (a, _, _) in &all {
                sum.add(a);
                sum.add(&a.neg());
            }
            prop_assert!(holds(&sum.ball(), &truth));
        }
    }

    #[test]
    fn exact_sums_stay_exact() {
        let of = |x: i64| Ball::<4>::from_i64(x);
        let mut sum = BallSum::NONE;
        assert_eq!(sum.ball(), Ball::ZERO);
        sum.add_product(&of(3), &of(-5));
        sum.add_product(&of(7), &of(1).shifted(70));
        assert_eq!(exact(&sum.ball()), exact(&of(-15).add(&of(7).shifted(70))));
        sum.add_product(&of(-7).shifted(35), &of(1).shifted(35));
        sum.add(&of(15));
        assert_eq!(sum.ball(), Ball::ZERO);
        // carries beyond the largest term
        for _ in 0..5000 {
            sum.add_product(&of(i64::MAX), &of(-i64::MAX));
        }
        let square = of(i64::MAX).mul(&of(i64::MAX));
        assert_eq!(exact(&sum.ball()), exact(&square.mul(&of(-5000))));
    }

    #[test]
    fn sums_of_any_size_end_somewhere() {
        let square = |x: f64| (0..70).fold(Ball::<2>::from_f64(x), |x, _| x.mul(&x));
        let (large, small) = (square(3.0), square(0.3));
        let mut sum = BallSum::NONE;
        sum.add_product(&small, &small);
        sum.add(&Ball::from_i64(1));
        assert!(sum.ball().is_positive());
        sum.add_product(&large, &Ball::from_i64(1));
        assert!(sum.ball().is_zero() && sum.ball().radius_log2() > 1e14);
        let mut sum = BallSum::<2>::NONE;
        let far = Ball::<2>::from_i64(1).shifted(900_000_000_000_000);
        sum.add_product(&far, &far);
        assert!(sum.ball().is_zero() && sum.ball().radius_log2() > 1e14);
    }
}
