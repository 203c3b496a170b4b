//! Evaluation of a model's numbers and functions in prime fields and in real numbers of many digits.

use obsdeg_exact::{Ball, Field, Reals, Scalars, SplitMix64, Transform};

use super::constraints::hold;
use super::dag::Dag;
use super::newton::hold_by_newton;
use super::values::{ConstraintFailure, KeyedFactor, Values};
use super::work::Work;
use crate::language::{Function, from_i128};

/// Pseudo-random element for a kind of function and its argument.
fn any(f: &Field, kind: u64, x: u64) -> u64 {
    let mut rng = SplitMix64::new(SplitMix64::new(f.modulus() ^ kind).next_u64() ^ x);
    1 + rng.below(f.modulus() - 1)
}

impl Values for Field {
    const ATTEMPTS: usize = 64;
    const BITS: i64 = 64;
    const COEFFICIENTS: usize = 800;

    type SeriesPlan = Transform;

    fn plan(&self, length: usize) -> Transform {
        Transform::new(*self, length)
    }

    fn sums<'a>(
        &self,
        plan: &mut Transform,
        of: &[Option<&'a [u64]>],
        lists: &[Vec<KeyedFactor<'a, u64>>],
        n: usize,
    ) -> Vec<Option<Vec<u64>>> {
        plan.sums(of, lists, n)
    }

    fn number(&self, mantissa: i128, decimals: i32) -> u64 {
        let ten = self.pow(self.from_u64(10), decimals.unsigned_abs().into());
        let factor = if decimals < 0 { ten } else { self.inv(ten) };
        Field::mul(self, from_i128(self, mantissa), factor)
    }

    /// Image of pi. Pi is transcendental, so any element serves, always the same one.
    fn pi(&self) -> u64 {
        any(self, 0, 0)
    }

    /// Image of a function's value. A prime field does not determine it. If values are independent of each
    /// other (`independent`) any element serves, the same one for the same argument; functions of one
    /// argument are related.
    fn function(&self, function: Function, x: &u64) -> Option<u64> {
        let (f, one) = (self, Field::one(self));
        let exponential = || any(f, 1, *x);
        // tan(x/2)
        let half = || any(f, 2, *x);
        let over = |a: u64, b: u64| Scalars::inverse(f, &b).map(|inverse| Field::mul(f, a, inverse));
        let square = |a: u64| Field::mul(f, a, a);
        match function {
            Function::Exp => Some(exponential()),
            Function::Tanh => {
                let e = square(exponential());
                over(Field::sub(f, e, one), Field::add(f, e, one))
            }
            Function::Sin => over(Field::add(f, half(), half()), Field::add(f, one, square(half()))),
            Function::Cos => over(Field::sub(f, one, square(half())), Field::add(f, one, square(half()))),
            Function::Tan => over(Field::add(f, half(), half()), Field::sub(f, one, square(half()))),
            Function::Log => Some(any(f, 3, *x)),
            Function::Atan => Some(any(f, 4, *x)),
            Function::Asin | Function::Acos | Function::Sqrt | Function::Abs | Function::Sign => None,
        }
    }

    fn is_positive(&self, _: &u64) -> Option<bool> {
        None
    }

    fn random(&self, rng: &mut SplitMix64, _: usize) -> u64 {
        rng.below(self.modulus())
    }

    fn near(&self, _: f64, _: i64, _: &mut SplitMix64) -> Option<u64> {
        None
    }

    fn coefficient(&self, rng: &mut SplitMix64) -> u64 {
        rng.below(self.modulus())
    }

    fn hold(
        &self,
        dag: &Dag,
        constraints: &[usize],
        values: &mut [u64],
        free: &[bool],
        rng: &mut SplitMix64,
        work: &Work,
    ) -> Result<(), ConstraintFailure> {
        hold(dag, constraints, values, free, self, rng, work)
    }
}

/// Number of attempts at points of positive numbers near one, where most models are defined; later attempts
/// use larger numbers.
const NEAR: usize = 8;

impl<const N: usize> Values for Reals<N> {
    const ATTEMPTS: usize = 2000;
    const BITS: i64 = Ball::<N>::BITS;
    const COEFFICIENTS: usize = 200;

    type SeriesPlan = ();

    fn plan(&self, _: usize) {}

    fn sums<'a>(
        &self,
        (): &mut (),
        of: &[Option<&'a [Ball<N>]>],
        lists: &[Vec<KeyedFactor<'a, Ball<N>>>],
        n: usize,
    ) -> Vec<Option<Vec<Ball<N>>>> {
        let sum = |list: &Vec<KeyedFactor<'a, Ball<N>>>| {
            let parts: Vec<(&'a [Ball<N>], &'a [Ball<N>])> =
                list.iter().filter_map(|&(i, _, b)| Some((of[i]?, b))).collect();
            let terms = |k: usize| {
                let products = move |&(a, b): &(&'a [Ball<N>], &'a [Ball<N>])| {
                    (0..=k).filter_map(move |j| Some((a.get(j)?, b.get(k - j)?)))
                };
                parts.iter().flat_map(products)
            };
            (!parts.is_empty()).then(|| (0..n).map(|k| self.dot(&Ball::ZERO, terms(k))).collect())
        };
        lists.iter().map(sum).collect()
    }

    fn number(&self, mantissa: i128, decimals: i32) -> Ball<N> {
        let mut ten = Ball::from_i64(1);
        for _ in 0..decimals.unsigned_abs() {
            ten = ten.mul(&Ball::from_i64(10));
        }
        let whole = Ball::from_i128(mantissa);
        if decimals < 0 { whole.mul(&ten) } else { whole.div(&ten).unwrap_or(Ball::ZERO) }
    }

    fn pi(&self) -> Ball<N> {
        Ball::pi()
    }

    fn function(&self, function: Function, x: &Ball<N>) -> Option<Ball<N>> {
        let one = Ball::from_i64(1);
        // the other side of the right triangle with this side and the hypotenuse 1
        let side = || one.sub(&x.mul(x)).sqrt();
        match function {
            Function::Sin => Some(x.sin_cos()?.0),
            Function::Cos => Some(x.sin_cos()?.1),
            Function::Tan => {
                let (s, c) = x.sin_cos()?;
                s.div(&c)
            }
            Function::Asin => Ball::atan2(x, &side()?),
            Function::Acos => {
                // on the branch cut of the angle, but defined
                if x.add(&one).is_exactly_zero() { Some(self.pi()) } else { Ball::atan2(&side()?, x) }
            }
            Function::Atan => Ball::atan2(x, &one),
            Function::Exp => x.exp(),
            Function::Log => x.ln(),
            Function::Sqrt => x.sqrt(),
            Function::Tanh => {
                // (1 - e)/(1 + e), e = exp(-2|x|)
                let e = x.abs().shifted(1).neg().exp()?;
                let size = one.sub(&e).div(&one.add(&e))?;
                Some(if x.is_negative() { size.neg() } else { size })
            }
            Function::Abs => Some(if x.is_negative() { x.neg() } else { *x }),
            Function::Sign if x.is_zero() && !x.is_exactly_zero() => None,
            Function::Sign => Some(Ball::from_i64(i64::from(x.is_positive()) - i64::from(x.is_negative()))),
        }
    }

    fn is_positive(&self, x: &Ball<N>) -> Option<bool> {
        (!x.is_zero()).then(|| x.is_positive())
    }

    /// Random rational number of 60 bits: in the first attempts from (1/4, 5/4); then of either sign, and
    /// larger with each attempt.
    fn random(&self, rng: &mut SplitMix64, attempt: usize) -> Ball<N> {
        let digits = Ball::from_i64((rng.next_u64() >> 4) as i64).shifted(-60);
        let size = digits.add(&Ball::from_i64(1).shifted(-2));
        if attempt < NEAR {
            return size;
        }
        let places = 3 + (attempt / 100) as u64;
        let place = rng.below(2 * places) as i64 - (places as i64).min(4);
        let far = size.shifted(place);
        if rng.below(2) == 0 { far } else { far.neg() }
    }

    fn near(&self, x: f64, bits: i64, rng: &mut SplitMix64) -> Option<Ball<N>> {
        let part = Ball::from_i64((rng.next_u64() >> 4) as i64).shifted(-60 - bits);
        let size = if x == 0.0 { Ball::from_i64(1) } else { Ball::from_f64(x) };
        Some(Ball::from_f64(x).add(&size.mul(&part)))
    }

    fn coefficient(&self, rng: &mut SplitMix64) -> Ball<N> {
        self.random(rng, 0)
    }

    fn hold(
        &self,
        dag: &Dag,
        constraints: &[usize],
        values: &mut [Ball<N>],
        free: &[bool],
        _: &mut SplitMix64,
        work: &Work,
    ) -> Result<(), ConstraintFailure> {
        hold_by_newton(dag, constraints, values, free, work)
    }
}
