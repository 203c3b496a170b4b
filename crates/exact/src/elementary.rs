//! Elementary functions of balls. All steps are ball operations, so truncation errors are in the error
//! of the result.
//!
//! Functions are Taylor sums at an argument reduced by halving, which squaring or the double angle
//! undoes. Inverse functions start from doubles and add one series (Brent, Zimmermann 2010, "Modern
//! Computer Arithmetic", chapter 4).

use crate::Ball;

/// Arguments of exp, sin and cos beyond `2^LARGE` are refused.
const LARGE: f64 = 40.0;

impl<const N: usize> Ball<N> {
    fn one() -> Self {
        Self::from_i64(1)
    }

    /// `x / n`.
    fn over(&self, n: i64) -> Self {
        self.div(&Self::from_i64(n)).unwrap_or(Self::ZERO)
    }

    /// Number of halvings of an argument; series then take about as many terms.
    fn halvings(&self) -> i64 {
        let small = 8 + Self::BITS / 48;
        (self.bound_log2().max(-1e6) as i64 + small).max(0)
    }

    /// `sum_(k>=0) x^(step k + first) sign^k / (step k + first)!` for `|x| <= 1/2`.
    fn series(&self, first: i64, step: i64, sign: i64) -> Self {
        let mut term = if first == 0 { Self::one() } else { *self };
        let x = if step == 1 { *self } else { self.mul(self) };
        let mut sum = term;
        for k in 1.. {
            let last = step * k + first;
            let factorial = if step == 1 { last } else { last * (last - 1) };
            term = term.mul(&x).over(sign * factorial);
            if term.is_zero() || term.bound_log2() < sum.bound_log2() - (Self::BITS + 8) as f64 {
                // the remainder is less than this term
                return sum.widened(term.bound_log2() + 1.0);
            }
            sum = sum.add(&term);
        }
        sum
    }

    /// `exp x`; `None` beyond 2^40.
    pub fn exp(&self) -> Option<Self> {
        if self.is_exactly_zero() {
            return Some(Self::one());
        }
        if self.bound_log2() > LARGE {
            return None;
        }
        let halvings = self.halvings();
        let mut out = self.shifted(-halvings).series(0, 1, 1);
        for _ in 0..halvings {
            out = out.mul(&out);
        }
        Some(out)
    }

    /// `(sin x, cos x)`; `None` beyond 2^40.
    pub fn sin_cos(&self) -> Option<(Self, Self)> {
        if self.is_exactly_zero() {
            return Some((Self::ZERO, Self::one()));
        }
        if self.bound_log2() > LARGE {
            return None;
        }
        let halvings = self.halvings();
        let small = self.shifted(-halvings);
        let (mut s, mut c) = (small.series(1, 2, -1), small.series(0, 2, -1));
        for _ in 0..halvings {
            (s, c) = (s.mul(&c).shifted(1), Self::one().sub(&s.mul(&s).shifted(1)));
        }
        Some((s, c))
    }

    /// `sum_(k>=0) sign^k x^(2k+1) / (2k+1)` for `|x| <= 1/2`: atan (sign -1) or artanh (1).
    fn odd_series(&self, sign: i64) -> Self {
        let square = self.mul(self);
        let (mut power, mut sum) = (*self, *self);
        if self.is_zero() {
            return *self;
        }
        for k in 1.. {
            power = power.mul(&square);
            if sign < 0 {
                power = power.neg();
            }
            if power.is_zero() || power.bound_log2() < sum.bound_log2() - (Self::BITS + 8) as f64 {
                return sum.widened(power.bound_log2() + 1.0);
            }
            sum = sum.add(&power.over(2 * k + 1));
        }
        sum
    }

    /// The natural logarithm; `None` unless the ball is above zero.
    pub fn ln(&self) -> Option<Self> {
        if !self.is_positive() {
            return None;
        }
        // x = exp(y) (1 + d), y in doubles
        let (fraction, exponent) = (self.shifted(-self.exponent_of_size()), self.exponent_of_size());
        let y = Self::from_f64(fraction.to_f64().ln() + exponent as f64 * std::f64::consts::LN_2);
        let d = self.mul(&y.neg().exp()?).sub(&Self::one());
        if d.bound_log2() > -3.0 {
            return None;
        }
        // log(1 + d) = 2 artanh(d / (2 + d))
        let rest = d.div(&d.add(&Self::from_i64(2)))?.odd_series(1).shifted(1);
        Some(y.add(&rest))
    }

    /// The angle of the point `(x, y)`, as `atan2(y, x)`; `None` on the cut (negative x-axis) and at the
    /// origin.
    pub fn atan2(y: &Self, x: &Self) -> Option<Self> {
        if y.is_zero() && !x.is_positive() {
            return None;
        }
        // common exponent removed, so that doubles hold both
        let place = x.exponent_of_size().max(y.exponent_of_size());
        let (near_x, near_y) = (x.shifted(-place).to_f64(), y.shifted(-place).to_f64());
        let about = Self::from_f64(near_y.atan2(near_x));
        let (s, c) = about.sin_cos()?;
        // the rest of the angle: (x + iy) e^(-i about)
        let cross = y.mul(&c).sub(&x.mul(&s));
        let along = x.mul(&c).add(&y.mul(&s));
        let rest = cross.div(&along)?;
        (rest.bound_log2() < -2.0).then(|| about.add(&rest.odd_series(-1)))
    }

    /// The angle of the half turn.
    pub fn pi() -> Self {
        // Machin: pi/4 = 4 atan(1/5) - atan(1/239)
        let of = |n: i64| Self::one().over(n).odd_series(-1);
        of(5).shifted(2).sub(&of(239)).shifted(2)
    }

    /// The exponent of the midpoint; a very small one for zero.
    fn exponent_of_size(&self) -> i64 {
        self.size_log2().max(-1e15) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use astro_float_num::{BigFloat, Consts, RoundingMode, Sign};
    use proptest::prelude::*;

    const BITS: usize = 640;
    const ROUND: RoundingMode = RoundingMode::None;

    /// The same number in the other library.
    fn other<const N: usize>(x: &Ball<N>) -> BigFloat {
        // in digits of 32 bits
        let (mut out, mut rest) = (BigFloat::from_i32(0, BITS), *x);
        while !rest.is_zero() {
            let part = Ball::<N>::from_f64(rest.to_f64());
            out = out.add(&BigFloat::from_f64(part.to_f64(), BITS), BITS, ROUND);
            rest = rest.midpoint().sub(&part);
        }
        out
    }

    /// Binary logarithm of the distance to a number of the other library.
    fn off<const N: usize>(x: &Ball<N>, y: &BigFloat) -> f64 {
        let off = other(x).sub(y, BITS, ROUND);
        let Some((words, _, sign, exponent, _)) = off.as_raw_parts() else { return f64::INFINITY };
        assert!(matches!(sign, Sign::Pos | Sign::Neg));
        // the mantissa is at least a half, its highest word last
        let highest = words.last().map_or(0.0, |w| *w as f64 / 2f64.powi(64));
        if highest == 0.0 { f64::NEG_INFINITY } else { f64::from(exponent) + highest.log2() }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        /// Functions compared with those of an independent library at twice the digits: the ball
        /// contains the true value and is narrow.
        #[test]
        fn functions_agree_with_another_library(m in any::<i64>(), place in -70i64..-56) {
            let mut consts = Consts::new().expect("constants");
            let cc = &mut consts;
            let x = Ball::<4>::from_i64(m).shifted(place);
            let y = other(&x);
            let check = |name: &str, ball: Option<Ball<4>>, truth: BigFloat, lost: f64| {
                let ball = ball.unwrap_or_else(|| panic!("{name} of {x:?}"));
                let off = off(&ball, &truth);
                prop_assert!(off <= ball.radius_log2() + 1e-9, "{name}: off {off}, {ball:?}");
                let narrow = ball.bound_log2() - 250.0 + lost;
                prop_assert!(ball.radius_log2() <= narrow, "{name}: {} above {narrow}", ball.radius_log2());
                Ok(())
            };
            let turns = 30.0;
            check("exp", x.exp(), y.exp(BITS, ROUND, cc), 40.0)?;
            let (s, c) = x.sin_cos().expect("small");
            check("sin", Some(s), y.sin(BITS, ROUND, cc), turns + 64.0)?;
            check("cos", Some(c), y.cos(BITS, ROUND, cc), turns + 64.0)?;
            check("atan", Ball::atan2(&x, &Ball::one()), y.atan(BITS, ROUND, cc), turns)?;
            if m != 0 {
                check("ln", x.abs().ln(), y.abs().ln(BITS, ROUND, cc), turns + 64.0)?;
            }
        }
    }

    #[test]
    fn values_by_hand() {
        let at = |x: f64| Ball::<4>::from_f64(x);
        let near = |x: &Ball<4>, y: f64| assert!((x.to_f64() - y).abs() < 1e-15, "{x:?} {y}");
        near(&Ball::pi(), std::f64::consts::PI);
        assert!(Ball::<4>::pi().sin_cos().expect("small").0.is_zero());
        for (y, x) in
            [(1.0, 2.0), (1.0, -2.0), (-1.0, -2.0), (-1.0, 2.0), (3.0, 0.0), (0.0, 3.0), (-3.0, 0.0)]
        {
            near(&Ball::atan2(&at(y), &at(x)).expect("off the cut"), f64::atan2(y, x));
        }
        assert_eq!(Ball::atan2(&at(0.0), &at(-1.0)), None);
        assert_eq!(Ball::atan2(&at(0.0), &at(0.0)), None);
        assert_eq!((at(0.0).ln(), at(-1.0).ln(), at(1e13).exp()), (None, None, None));
        assert_eq!(at(0.0).exp(), Some(at(1.0)));
        // large arguments
        near(&at(1e9).sin_cos().expect("small").0, 1e9f64.sin());
        near(&at(1e-300).ln().expect("positive").over(1000), 1e-300f64.ln() / 1000.0);
        // more digits: the square root of e
        let e = Ball::<16>::from_i64(1).exp().expect("small");
        let half = Ball::<16>::from_f64(0.5).exp().expect("small");
        let off = half.mul(&half).sub(&e);
        assert!(off.is_zero() && off.radius_log2() < -960.0, "{}", off.radius_log2());
    }
}
