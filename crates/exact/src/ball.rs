//! Real numbers of many digits with a bound on their error.

use std::cmp::Ordering;

mod sum;

pub use sum::BallSum;

/// Real number `+-mantissa 2^(exponent - 64 N)`, known up to `error` units of its last place.
///
/// Every operation bounds its rounding, so a ball that does not contain zero is a number that is not
/// zero. A ball that contains zero is stored as zero with that error. One ball alone cannot decide
/// whether the number *is* zero; [`Ball::radius_log2`] gives a bound on its size. Midpoint-radius
/// arithmetic (van der Hoeven 2010, "Ball arithmetic").
///
/// ```
/// use obsdeg_exact::Ball;
/// let third = Ball::<4>::from_i64(3).inverse().expect("not zero");
/// let one = third.mul(&Ball::from_i64(3));
/// assert!(one.sub(&Ball::from_i64(1)).is_zero());
/// assert!(one.sub(&Ball::from_i64(1)).radius_log2() < -245.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball<const N: usize> {
    negative: bool,
    /// Exponent: the number is in `[2^(exponent - 1), 2^exponent)`; for zero, the place of the error.
    exponent: i64,
    /// Limbs, least first; the highest bit is set, or all are zero.
    mantissa: [u64; N],
    /// Error in units of `2^(exponent - 64 N)`.
    error: f64,
}

/// Largest exponent: smaller numbers become zero with this error, larger ones become unknown.
const FAR: f64 = 1e15;

/// Factor that covers the rounding of a sum of error terms, each a handful of operations on doubles.
const SLACK: f64 = 1.0 + 1e-12;

/// `2^k`, zero or infinite beyond the doubles.
const fn power(k: i64) -> f64 {
    match k {
        ..=-1023 => 0.0,
        -1022..=1023 => f64::from_bits(((k + 1023) as u64) << 52),
        _ => f64::INFINITY,
    }
}

impl<const N: usize> Ball<N> {
    /// Bits of a mantissa.
    pub const BITS: i64 = 64 * N as i64;
    /// Zero, exactly.
    pub const ZERO: Self = Self { negative: false, exponent: 0, mantissa: [0; N], error: 0.0 };

    /// An integer.
    pub fn from_i64(x: i64) -> Self {
        Self::from_i128(x.into())
    }

    /// An integer. (A ball has at least two limbs.)
    pub fn from_i128(x: i128) -> Self {
        const { assert!(N >= 2) };
        let size = x.unsigned_abs();
        if size == 0 {
            return Self::ZERO;
        }
        let shifted = size << size.leading_zeros();
        let mut mantissa = [0; N];
        (mantissa[N - 1], mantissa[N - 2]) = ((shifted >> 64) as u64, shifted as u64);
        Self { negative: x < 0, exponent: 128 - i64::from(size.leading_zeros()), mantissa, error: 0.0 }
    }

    /// Zero with an error of up to `2^log2`.
    fn zero_within(log2: f64) -> Self {
        if log2 == f64::NEG_INFINITY {
            return Self::ZERO;
        }
        Self { exponent: log2.ceil().clamp(-FAR, FAR) as i64 + Self::BITS, error: 1.0, ..Self::ZERO }
    }

    /// A double, exactly; zero for infinity and NaN.
    pub fn from_f64(x: f64) -> Self {
        if x == 0.0 || !x.is_finite() {
            return Self::ZERO;
        }
        let bits = x.abs().to_bits();
        let (raw, fraction) = ((bits >> 52) as i64, bits & ((1 << 52) - 1));
        let (integer, place) = if raw == 0 { (fraction, -1074) } else { (fraction | 1 << 52, raw - 1075) };
        let whole = Self::from_i64(integer as i64).shifted(place);
        if x < 0.0 { whole.neg() } else { whole }
    }

    /// The nearest double, approximately; infinite or zero beyond their range.
    pub fn to_f64(&self) -> f64 {
        let top = self.mantissa[N - 1] as f64;
        let size = if top == 0.0 { 0.0 } else { top * power(-64) };
        let half = self.exponent / 2;
        let value = size * power(half) * power(self.exponent - half);
        if self.negative { -value } else { value }
    }

    /// `self 2^k`, exactly.
    pub fn shifted(&self, k: i64) -> Self {
        if self.is_exactly_zero() { Self::ZERO } else { Self { exponent: self.exponent + k, ..*self } }
    }

    /// The same midpoint, without an error.
    pub fn midpoint(&self) -> Self {
        if self.is_zero() { Self::ZERO } else { Self { error: 0.0, ..*self } }
    }

    /// True if the ball contains zero.
    pub fn is_zero(&self) -> bool {
        self.mantissa[N - 1] == 0
    }

    /// True if it is zero without an error.
    pub fn is_exactly_zero(&self) -> bool {
        self.is_zero() && self.error == 0.0
    }

    /// True if every number of the ball is above zero.
    pub fn is_positive(&self) -> bool {
        !self.is_zero() && !self.negative
    }

    /// True if every number of the ball is below zero.
    pub fn is_negative(&self) -> bool {
        !self.is_zero() && self.negative
    }

    /// `log2` of the absolute value of the midpoint, rounded up; minus infinity for zero.
    pub fn size_log2(&self) -> f64 {
        if self.is_zero() { f64::NEG_INFINITY } else { self.exponent as f64 }
    }

    /// `log2` of the error; minus infinity for exact numbers.
    pub fn radius_log2(&self) -> f64 {
        match self.error {
            0.0 => f64::NEG_INFINITY,
            e => (self.exponent - Self::BITS) as f64 + e.log2(),
        }
    }

    /// Widens the error by `2^log2`.
    pub fn widened(&self, log2: f64) -> Self {
        if log2 == f64::NEG_INFINITY {
            return *self;
        }
        let here = (self.exponent - Self::BITS) as f64;
        if self.is_exactly_zero() {
            return Self::zero_within(log2);
        }
        let added = (log2 - here + 1e-9).min(2000.0).exp2();
        Self { error: (self.error + added) * SLACK, ..*self }.settled()
    }

    /// Stores a ball that contains zero as zero with an error.
    fn settled(self) -> Self {
        if self.is_zero() {
            return self;
        }
        let size = self.mantissa_f64();
        if size > self.error {
            return self;
        }
        Self { negative: false, mantissa: [0; N], error: (self.error + size) * SLACK, ..self }
    }

    /// The mantissa as a double; infinite beyond their range.
    fn mantissa_f64(&self) -> f64 {
        // rounded down, so that an error is never taken to be smaller
        (self.mantissa[N - 1] as f64) * (1.0 - 1e-15) * power(Self::BITS - 64)
    }

    /// The mantissa divided by `2^(64 N)`, rounded up.
    fn fraction(&self) -> f64 {
        ((self.mantissa[N - 1] as f64) * power(-64) * SLACK).min(1.0)
    }

    /// `-self`.
    pub fn neg(&self) -> Self {
        Self { negative: !self.negative && !self.is_zero(), ..*self }
    }

    /// The absolute value, of the midpoint.
    pub fn abs(&self) -> Self {
        Self { negative: false, ..*self }
    }

    /// `self + other`.
    #[inline(never)]
    pub fn add(&self, other: &Self) -> Self {
        if self.is_exactly_zero() {
            return *other;
        }
        if other.is_exactly_zero() {
            return *self;
        }
        let (x, y) = if self.exponent >= other.exponent { (self, other) } else { (other, self) };
        // a zero has no digits to align
        if x.is_zero() && !y.is_zero() {
            return y.with_error_of(x);
        }
        if y.is_zero() {
            return x.with_error_of(y);
        }
        let apart = x.exponent - y.exponent;
        let mut error = x.error + y.error * power(-apart);
        let small = if apart >= Self::BITS {
            error += 1.0;
            [0; N]
        } else {
            let (small, lost) = shifted_right(&y.mantissa, apart as usize);
            error += f64::from(lost);
            small
        };
        let mut out = Self { negative: x.negative, exponent: x.exponent, mantissa: x.mantissa, error };
        if x.negative == y.negative {
            if add_to(&mut out.mantissa, &small) {
                let (half, lost) = shifted_right(&out.mantissa, 1);
                out.mantissa = half;
                out.mantissa[N - 1] |= 1 << 63;
                out.exponent += 1;
                out.error = out.error / 2.0 + f64::from(lost);
            }
            out.error *= SLACK;
            return out.settled();
        }
        match compare(&x.mantissa, &small) {
            Ordering::Equal => {
                return match error {
                    0.0 => Self::ZERO,
                    _ => Self { negative: false, mantissa: [0; N], error: error * SLACK, ..out },
                };
            }
            Ordering::Greater => {
                subtract_from(&mut out.mantissa, &small);
            }
            Ordering::Less => {
                out.mantissa = small;
                subtract_from(&mut out.mantissa, &x.mantissa);
                out.negative = !x.negative;
            }
        }
        out.normalised(error * SLACK)
    }

    /// Normalises digits of any height, with `error` in units of their last place.
    fn normalised(mut self, error: f64) -> Self {
        let top = (0..N).rev().find(|&i| self.mantissa[i] != 0);
        let Some(top) = top else {
            return Self { negative: false, error, ..self };
        };
        // a lower bound of the remaining size, to be compared with the error before it is scaled
        let size = (self.mantissa[top] as f64) * (1.0 - 1e-15) * power(64 * top as i64);
        if size <= error {
            let whole = (self.mantissa[top] as f64 + 1.0) * SLACK * power(64 * top as i64);
            return Self { negative: false, mantissa: [0; N], error: (error + whole) * SLACK, ..self };
        }
        let bits = self.mantissa[top].leading_zeros() as usize + 64 * (N - 1 - top);
        if bits > 0 {
            self.mantissa = shifted_left(&self.mantissa, bits);
            self.exponent -= bits as i64;
        }
        self.error = if error == 0.0 { 0.0 } else { error * power(bits as i64) };
        self
    }

    /// The same midpoint, with the error of a zero added.
    fn with_error_of(&self, zero: &Self) -> Self {
        let apart = zero.exponent - self.exponent;
        let out = Self { error: (self.error + zero.error * power(apart)) * SLACK, ..*self };
        if out.error.is_finite() {
            return out.settled();
        }
        Self::zero_within(self.bound_log2().max(zero.radius_log2()) + 1.0)
    }

    /// `self - other`.
    pub fn sub(&self, other: &Self) -> Self {
        self.add(&other.neg())
    }

    /// `self other`.
    #[inline(never)]
    pub fn mul(&self, other: &Self) -> Self {
        let (x, y) = (self, other);
        if x.is_exactly_zero() || y.is_exactly_zero() {
            return Self::ZERO;
        }
        if x.is_zero() || y.is_zero() {
            return Self::zero_within(x.bound_log2() + y.bound_log2());
        }
        let exponent = x.exponent + y.exponent;
        if (exponent as f64).abs() > FAR {
            return Self::zero_within(exponent as f64);
        }
        // the product of both errors, as fractions of 2^exponent, in factors that doubles can hold
        let part = power(-Self::BITS / 4);
        let both = ((x.error * part) * (y.error * part)) * part * part;
        let error = x.fraction() * y.error + y.fraction() * x.error + both;
        if !error.is_finite() {
            return Self::zero_within(x.bound_log2() + y.bound_log2());
        }
        let (mut mantissa, next) = product(&x.mantissa, &y.mantissa);
        let mut out_exponent = exponent;
        let mut error = error;
        if mantissa[N - 1] >> 63 == 0 {
            mantissa = shifted_left(&mantissa, 1);
            mantissa[0] |= next >> 63;
            out_exponent -= 1;
            error *= 2.0;
        }
        // the digits below the last place, and what the product left out there
        error = if error == 0.0 && next == 0 { exact_tail(&x.mantissa, &y.mantissa) } else { error + 2.0 };
        Self { negative: x.negative != y.negative, exponent: out_exponent, mantissa, error: error * SLACK }
            .settled()
    }

    /// `1 / self`; `None` for a ball that contains zero or nearly does.
    #[inline(never)]
    pub fn inverse(&self) -> Option<Self> {
        if self.is_zero() {
            return None;
        }
        let middle = self.midpoint();
        // 1/m for the mantissa in [1/2, 1), then Newton's y (2 - m y), which doubles the digits
        let scaled = middle.shifted(-middle.exponent).abs();
        let mut y = Self::from_f64(1.0 / scaled.to_f64());
        let mut digits = 48;
        let one = Self::from_i64(1);
        while digits < Self::BITS + 8 {
            let e = one.sub(&scaled.mul(&y)).midpoint();
            y = y.add(&y.mul(&e)).midpoint();
            digits *= 2;
        }
        let mut y = y.shifted(-middle.exponent);
        y.negative = self.negative;
        // 1/x = y (1 + e + e^2/(1 - e)), e = 1 - x y
        let e = one.sub(&self.mul(&y));
        let size = e.bound_log2();
        if size > -1.5 {
            return None;
        }
        let out = y.add(&y.mul(&e));
        Some(out.widened(y.size_log2() + 2.0 * size + 1.0))
    }

    /// `self / other`; `None` for a divisor that may be zero.
    pub fn div(&self, other: &Self) -> Option<Self> {
        Some(self.mul(&other.inverse()?))
    }

    /// `log2` of a bound on the absolute value of every number of the ball.
    pub(crate) fn bound_log2(&self) -> f64 {
        let (size, radius) = (self.size_log2(), self.radius_log2());
        match size.max(radius) {
            f64::NEG_INFINITY => f64::NEG_INFINITY,
            larger => larger + 1.0,
        }
    }

    /// The square root; `None` for a ball with numbers that are not positive. Zero without an error has
    /// the root zero.
    #[inline(never)]
    pub fn sqrt(&self) -> Option<Self> {
        if self.is_exactly_zero() {
            return Some(Self::ZERO);
        }
        if !self.is_positive() {
            return None;
        }
        // r = 1/sqrt(m) for m in [1/4, 1) by Newton's r (3 - m r^2) / 2
        let even = self.exponent + self.exponent.rem_euclid(2);
        let scaled = self.shifted(-even);
        let middle = scaled.midpoint();
        let one = Self::from_i64(1);
        let mut r = Self::from_f64(1.0 / middle.to_f64().sqrt());
        let mut digits = 48;
        while digits < Self::BITS + 8 {
            let e = one.sub(&middle.mul(&r.mul(&r))).midpoint();
            r = r.add(&r.mul(&e).shifted(-1)).midpoint();
            digits *= 2;
        }
        // sqrt m = m r (1 - e)^(-1/2), e = 1 - m r^2
        let e = one.sub(&scaled.mul(&r.mul(&r)));
        let size = e.bound_log2();
        if size > -2.0 {
            return None;
        }
        let factor = one.add(&e.shifted(-1)).widened(2.0 * size);
        Some(scaled.mul(&r).mul(&factor).shifted(even / 2))
    }

    /// The nearest integer to the midpoint; `None` for a large one.
    pub(crate) fn nearest_integer(&self) -> Option<i64> {
        if self.is_zero() {
            return Some(0);
        }
        if self.exponent > 62 {
            return None;
        }
        let half = Self::from_i64(1).shifted(-1);
        let up = self.abs().midpoint().add(&half);
        let whole = match up.exponent {
            e if e <= 0 => 0,
            e => (up.mantissa[N - 1] >> (64 - e)) as i64,
        };
        Some(if self.negative { -whole } else { whole })
    }
}

/// The high N limbs of a product and the limb below them; the omitted part is below a unit of the last
/// place.
#[inline(always)]
fn product<const N: usize>(a: &[u64; N], b: &[u64; N]) -> ([u64; N], u64) {
    // row by row, a limb further up each; columns below N - 2 are left out and add less than N / 2^64 units
    // of the last place
    let (mut out, mut below) = ([0; N], 0);
    for (i, &x) in a.iter().enumerate() {
        let mut carry = 0;
        for j in (N - 2).saturating_sub(i)..N {
            let sum = u128::from(x) * u128::from(b[j]) + u128::from(out[j]) + u128::from(carry);
            carry = (sum >> 64) as u64;
            match j {
                0 => below = sum as u64,
                _ => out[j - 1] = sum as u64,
            }
        }
        out[N - 1] = carry;
    }
    (out, below)
}

/// The error of the product of two exact numbers: zero if all digits below the last place are zero.
fn exact_tail<const N: usize>(a: &[u64; N], b: &[u64; N]) -> f64 {
    let zeros = |m: &[u64; N]| {
        let limb = m.iter().position(|x| *x != 0).unwrap_or(N);
        64 * limb + m.get(limb).map_or(0, |x| x.trailing_zeros() as usize)
    };
    if zeros(a) + zeros(b) >= 64 * N { 0.0 } else { 2.0 }
}

/// Digits shifted to the right; true if any were lost.
fn shifted_right<const N: usize>(a: &[u64; N], bits: usize) -> ([u64; N], bool) {
    if bits == 0 {
        return (*a, false);
    }
    let (limbs, bits) = (bits / 64, bits % 64);
    let mut out = [0; N];
    let mut lost = a[..limbs.min(N)].iter().any(|x| *x != 0);
    if bits == 0 {
        out[..N - limbs].copy_from_slice(&a[limbs..]);
        return (out, lost);
    }
    lost |= a.get(limbs).is_some_and(|x| x << (64 - bits) != 0);
    for i in 0..N - limbs {
        let high = a.get(i + limbs + 1).map_or(0, |x| x << (64 - bits));
        out[i] = a[i + limbs] >> bits | high;
    }
    (out, lost)
}

fn shifted_left<const N: usize>(a: &[u64; N], bits: usize) -> [u64; N] {
    let (limbs, bits) = (bits / 64, bits % 64);
    let mut out = [0; N];
    for i in (limbs..N).rev() {
        let low = if bits > 0 && i > limbs { a[i - limbs - 1] >> (64 - bits) } else { 0 };
        out[i] = a[i - limbs] << bits | low;
    }
    out
}

/// Adds `b` to `a`; true if the sum has one bit more.
fn add_to<const N: usize>(a: &mut [u64; N], b: &[u64; N]) -> bool {
    let mut carry = false;
    for (x, &y) in a.iter_mut().zip(b) {
        let (sum, first) = x.overflowing_add(y);
        let (sum, second) = sum.overflowing_add(u64::from(carry));
        *x = sum;
        carry = first || second;
    }
    carry
}

/// Subtracts `b` from `a`; true if the result is below zero.
fn subtract_from<const N: usize>(a: &mut [u64; N], b: &[u64; N]) -> bool {
    let mut borrow = false;
    for (x, &y) in a.iter_mut().zip(b) {
        let (rest, first) = x.overflowing_sub(y);
        let (rest, second) = rest.overflowing_sub(u64::from(borrow));
        *x = rest;
        borrow = first || second;
    }
    borrow
}

fn compare<const N: usize>(a: &[u64; N], b: &[u64; N]) -> Ordering {
    a.iter().rev().cmp(b.iter().rev())
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use num_bigint::BigInt;
    use num_rational::BigRational;
    use proptest::prelude::*;

    fn two(k: i64) -> BigRational {
        let big = BigRational::from_integer(BigInt::from(1) << k.unsigned_abs());
        if k < 0 { big.recip() } else { big }
    }

    pub(crate) fn exact<const N: usize>(ball: &Ball<N>) -> BigRational {
        let digits =
            ball.mantissa.iter().rev().fold(BigInt::from(0), |x, limb| (x << 64) + BigInt::from(*limb));
        let size = BigRational::from_integer(digits) * two(ball.exponent - Ball::<N>::BITS);
        if ball.negative { -size } else { size }
    }

    /// True if a number lies in the ball.
    pub(crate) fn holds<const N: usize>(ball: &Ball<N>, x: &BigRational) -> bool {
        let radius =
            BigRational::from_float(ball.error).expect("finite") * two(ball.exponent - Ball::<N>::BITS);
        let off = exact(ball) - x;
        off <= radius.clone() && off >= -radius
    }

    /// Numbers of any size, some close to each other, some with few digits, some uncertain, each with a
    /// number that its ball contains.
    pub(crate) fn numbers() -> impl Strategy<Value = (Ball<2>, BigRational)> {
        let places = prop_oneof![Just(0i64), -3..3i64, -140..140i64];
        let digits = prop_oneof![any::<i128>(), (-9..9i128), (i128::MAX - 3..i128::MAX)];
        (digits, places, -200.0..0.0f64, 0..3u8, -1.0..1.0f64).prop_map(|(m, place, wide, kind, inside)| {
            let ball = Ball::<2>::from_i128(m).shifted(place);
            let x = BigRational::from_integer(m.into()) * two(place);
            if kind > 0 {
                return (ball, x);
            }
            let wide = wide.round() as i64 + ball.exponent;
            let off = BigRational::from_float(inside).expect("finite") * two(wide);
            (ball.widened(wide as f64), x + off)
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// For all true numbers, the result contains the true result.
        #[test]
        fn results_hold_the_true_ones((a, x) in numbers(), (b, y) in numbers(), (c, z) in numbers()) {
            prop_assert!(holds(&a, &x));
            prop_assert!(holds(&a.add(&b), &(&x + &y)));
            prop_assert!(holds(&a.sub(&b), &(&x - &y)));
            prop_assert!(holds(&a.mul(&b), &(&x * &y)));
            // cancellation, in three ways
            prop_assert!(holds(&a.add(&b).sub(&a), &y));
            prop_assert!(holds(&a.mul(&b).sub(&b.mul(&c)), &(&x * &y - &y * &z)));
            let zero = BigRational::from_integer(0.into());
            if let Some(inverse) = b.inverse() {
                prop_assert!(y != zero && holds(&inverse, &y.recip()));
                prop_assert!(holds(&a.mul(&inverse).mul(&c), &(&x / &y * &z)));
            }
            if let Some(root) = a.sqrt() {
                prop_assert!(x >= zero && holds(&root.mul(&root), &x));
                prop_assert!(!root.is_negative());
            }
            // a ball that contains zero is zero
            prop_assert_eq!(a.is_zero(), holds(&a, &zero));
        }
    }

    #[test]
    fn exponents_end_somewhere() {
        // squared seventy times: beyond any exponent
        let square = |x: f64| (0..70).fold(Ball::<2>::from_f64(x), |x, _| x.mul(&x));
        let (large, small) = (square(3.0), square(0.3));
        assert!(large.is_zero() && large.radius_log2() > 1e14, "{large:?}");
        assert!(small.is_zero() && small.radius_log2() < -1e14, "{small:?}");
        assert!(large.add(&Ball::from_i64(1)).is_zero() && large.inverse().is_none());
        assert!(Ball::from_i64(1).add(&small).is_positive());
        assert!(Ball::<2>::zero_within(f64::INFINITY).mul(&large).is_zero());
    }

    #[test]
    fn digits_are_not_lost() {
        // as narrow as possible: sqrt 2 and 1/3 to the last places of 256 bits
        let two = Ball::<4>::from_i64(2);
        for x in [two.sqrt(), Ball::from_i64(3).inverse()].map(|x| x.expect("defined")) {
            assert!(x.radius_log2() < -248.0, "{x:?}");
        }
        assert!(two.mul(&two).error == 0.0 && two.sub(&two).is_exactly_zero());
        assert_eq!(two.sqrt().expect("root").nearest_integer(), Some(1));
        assert_eq!(Ball::<4>::from_f64(-2.5).to_f64(), -2.5);
        assert_eq!(Ball::<4>::from_f64(-2.51).nearest_integer(), Some(-3));
        assert_eq!(Ball::<4>::ZERO.inverse(), None);
        assert_eq!(Ball::<4>::from_i64(-1).sqrt(), None);
    }
}
