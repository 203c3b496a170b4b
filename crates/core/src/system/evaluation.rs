//! Evaluation of a model's numbers and functions in prime fields and in real numbers of many digits.

use obsdeg_exact::{Ball, Field, RealSpace, Reals, RowSpace, Scalars, SplitMix64, Transform};

use super::constraints::hold;
use super::dag::Dag;
use super::taylor::{Signal, Singular, Taylor};
use super::values::{NotHeld, Values};
use super::work::{Step, Work, product};
use crate::language::{Function, from_i128};

/// An element as if at random, of a kind of function and its argument.
fn any(f: &Field, kind: u64, x: u64) -> u64 {
    let mut rng = SplitMix64::new(SplitMix64::new(f.modulus() ^ kind).next_u64() ^ x);
    1 + rng.below(f.modulus() - 1)
}

impl Values for Field {
    const ATTEMPTS: usize = 64;
    const BITS: i64 = 64;
    const COEFFICIENTS: usize = 800;

    type Plan = Transform;

    fn plan(&self, length: usize) -> Transform {
        Transform::new(*self, length)
    }

    fn products(
        &self,
        plan: &mut Transform,
        a: &[u64],
        factors: &[(usize, &[u64])],
        n: usize,
    ) -> Vec<Vec<u64>> {
        plan.products(a, factors, n)
    }

    fn number(&self, mantissa: i128, decimals: i32) -> u64 {
        let ten = self.pow(self.from_u64(10), decimals.unsigned_abs().into());
        let factor = if decimals < 0 { ten } else { self.inv(ten) };
        Field::mul(self, from_i128(self, mantissa), factor)
    }

    /// It is transcendental: any element serves, always the same one.
    fn pi(&self) -> u64 {
        any(self, 0, 0)
    }

    /// Nothing in a prime field knows the value of a function. Where values are independent of each other
    /// (`independent`) any element serves, the same one for the same argument; those of one argument belong together.
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

    fn random(&self, rng: &mut SplitMix64, _: usize) -> u64 {
        rng.below(self.modulus())
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
    ) -> Result<(), NotHeld> {
        hold(dag, constraints, values, free, self, rng, work)
    }
}

/// Attempts at points of positive numbers near one, where most models are at home; later ones look further.
const NEAR: usize = 8;

impl<const N: usize> Values for Reals<N> {
    const ATTEMPTS: usize = 2000;
    const BITS: i64 = Ball::<N>::BITS;
    const COEFFICIENTS: usize = 200;

    type Plan = ();

    fn plan(&self, _: usize) {}

    fn products(
        &self,
        (): &mut (),
        a: &[Ball<N>],
        factors: &[(usize, &[Ball<N>])],
        n: usize,
    ) -> Vec<Vec<Ball<N>>> {
        let product = |(_, b): &(usize, &[Ball<N>])| {
            let terms = |k: usize| (0..=k).filter_map(move |j| Some((a.get(j)?, b.get(k - j)?)));
            (0..n).map(|k| self.dot(&Ball::ZERO, terms(k))).collect()
        };
        factors.iter().map(product).collect()
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
        // the other side of the right triangle with this one and the hypotenuse 1
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
                // on the cut of the angle, but defined
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

    /// A rational number of 60 bits: of the first attempts in (1/4, 5/4); then of either sign, the larger the later.
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
    ) -> Result<(), NotHeld> {
        hold_by_newton(dag, constraints, values, free, work)
    }
}

/// Steps of Newton's method to a point where constraints hold: they double the digits.
const STEPS: usize = 60;

/// The nearest point at which constraints hold, about: Newton's steps of least length, from the random values. What is left of the constraints
/// is in the error of the values.
fn hold_by_newton<const N: usize>(
    dag: &Dag,
    constraints: &[usize],
    values: &mut [Ball<N>],
    free: &[bool],
    work: &Work,
) -> Result<(), NotHeld> {
    let failed = NotHeld::Constraint(0);
    let places: Vec<usize> = (0..values.len()).filter(|&s| free[s]).collect();
    // the rank of the rows, their products, and the system of these
    let (rows, columns) = (constraints.len() as u64, places.len() as u64);
    let pairs = rows.saturating_mul(rows).saturating_mul(rows.saturating_add(columns.saturating_mul(2)));
    let operations = pairs.saturating_mul(product::<Ball<N>>());
    for _ in 0..STEPS {
        work.take(Step::Constraints, operations, 0)?;
        let signal = |s: usize| Signal::Constant {
            value: values[s],
            lane: places.iter().position(|place| *place == s),
        };
        let signals = (0..values.len()).map(signal).collect();
        let starts = vec![None; values.len()];
        let seed = SplitMix64::new(0);
        let at = Taylor::new(dag, Reals::<N>, places.len(), signals, &starts, constraints, false, seed, work)
            .map_err(|e| if e == Singular::Refused { NotHeld::Refused } else { failed })?;
        // independent rows (J | -g): those that add to the rank of J
        let (mut rank, mut rows) = (RealSpace::new(Reals, places.len()), Vec::new());
        let mut off = f64::NEG_INFINITY;
        for &node in constraints {
            let mut row = vec![Ball::ZERO; places.len()];
            for (&lane, x) in at.lanes_of(node).iter().zip(at.dual(node, 0)) {
                row[lane as usize] = x.midpoint();
            }
            off = off.max(at.start(node).midpoint().size_log2());
            if rank.insert(&row) {
                rows.push((row, at.start(node).midpoint().neg()));
            }
        }
        let done = -(Ball::<N>::BITS as f64) + 24.0;
        if off <= done {
            for &s in &places {
                values[s] = values[s].midpoint().widened(done);
            }
            return Ok(());
        }
        // the step J' y with J J' y = -g
        let (m, dot) = (rows.len(), |a: &[Ball<N>], b: &[Ball<N>]| Reals.dot(&Ball::ZERO, a.iter().zip(b)));
        let mut system = RealSpace::new(Reals, m + 1);
        for (row, g) in &rows {
            let mut line: Vec<Ball<N>> = rows.iter().map(|(other, _)| dot(row, other)).collect();
            line.push(g.neg());
            system.insert(&line);
        }
        let solution = system.null_space();
        let [y] = solution.as_slice() else { return Err(failed) };
        let scale = y[m].inverse().ok_or(failed)?;
        for (k, &s) in places.iter().enumerate() {
            for ((row, _), weight) in rows.iter().zip(y) {
                values[s] = values[s].add(&row[k].mul(weight).mul(&scale)).midpoint();
            }
        }
    }
    Err(failed)
}
