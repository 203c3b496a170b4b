//! Functions in the graph, each with its derivative.

use std::collections::{BTreeMap, HashMap};

use super::constraints::{below, slots_of};
use super::dag::{Dag, DagError, Op};
use super::intervals::{Interval, of_node};
use crate::language::Function;

/// Largest integer exponent.
const MAX_POWER: i64 = 1000;

impl Dag {
    /// Node of a constant that every model knows; `None` for another name.
    pub(super) fn constant(&mut self, name: &str) -> Option<usize> {
        if !matches!(name, "pi" | "deg") {
            return None;
        }
        let pi = self.add(Op::Pi);
        if name == "pi" {
            return Some(pi);
        }
        let half_turn = self.integer(180);
        Some(self.quotient(pi, half_turn))
    }

    /// Value of the node as a small rational number; `None` unless it consists of numbers and of constants
    /// with known values (`definite`).
    pub(super) fn rational(&self, node: usize) -> Option<(i64, i64)> {
        // operands come before the operations that use them
        let mut found: HashMap<usize, (i64, i64)> = HashMap::new();
        for i in below(self, node) {
            let value = match self.ops[i] {
                Op::Number { mantissa, decimals } => {
                    // 2.000 is 2
                    let (mut mantissa, mut decimals) = (mantissa, decimals);
                    while decimals > 0 && mantissa % 10 == 0 {
                        (mantissa, decimals) = (mantissa / 10, decimals - 1);
                    }
                    let ten = 10i64.checked_pow(decimals.unsigned_abs())?;
                    let m = i64::try_from(mantissa).ok()?;
                    if decimals < 0 { (m.checked_mul(ten)?, 1) } else { reduced(m, ten)? }
                }
                Op::Slot(s) => *self.definite.get(&s)?,
                Op::Add(a, b) => plus(found[&a], found[&b])?,
                Op::Subtract(a, b) => plus(found[&a], (-found[&b].0, found[&b].1))?,
                Op::Multiply(a, b) => times(found[&a], found[&b])?,
                Op::Divide(a, b) => times(found[&a], (found[&b].1, found[&b].0))?,
                Op::Pi | Op::Primitive { .. } => return None,
            };
            found.insert(i, value);
        }
        found.get(&node).copied()
    }

    /// Node of `x^m`.
    pub(super) fn integer_power(&mut self, x: usize, m: i64) -> Result<usize, DagError> {
        if m.abs() > MAX_POWER {
            return Err(DagError::TooLarge("an exponent above 1000"));
        }
        let (mut power, mut square, mut left) = (self.integer(1), x, m.unsigned_abs());
        while left > 0 {
            if left & 1 == 1 {
                power = self.product(power, square);
            }
            left >>= 1;
            if left > 0 {
                square = self.product(square, square);
            }
        }
        if m >= 0 {
            return Ok(power);
        }
        if self.is(power, 0) {
            return Err(DagError::Undefined("division by zero"));
        }
        let one = self.integer(1);
        Ok(self.quotient(one, power))
    }

    /// True if a node consists of numbers and of constants with known values, and provably exceeds the range
    /// of [`Self::rational`].
    fn is_beyond_powers(&self, node: usize) -> bool {
        let largest = i64::MAX as f64;
        let given = |s: &usize| self.definite.get(s).map(|&(p, q)| p as f64 / q as f64);
        let slots = slots_of(self, node);
        let known: Option<BTreeMap<usize, f64>> = slots.iter().map(|s| Some((*s, given(s)?))).collect();
        known.is_some_and(|known| {
            let size =
                of_node(self, node, &known.into_iter().map(|(s, x)| (s, Interval::about(x))).collect());
            size.low > largest || size.high < -largest
        })
    }

    /// Node of `x^e`: repeated products for an integer, roots for half of one, else `exp(e log x)`.
    pub(super) fn power(&mut self, x: usize, e: usize) -> Result<usize, DagError> {
        match self.rational(e) {
            Some((m, 1)) => self.integer_power(x, m),
            Some((m, 2)) => {
                let root = self.function(Function::Sqrt, x);
                self.integer_power(root, m)
            }
            None if self.is_beyond_powers(e) => Err(DagError::TooLarge("an exponent above 1000")),
            _ => {
                let written = self.has(Function::Log, x);
                let log = self.function(Function::Log, x);
                if !written {
                    self.powers.insert(log);
                }
                let exponent = self.product(e, log);
                Ok(self.function(Function::Exp, exponent))
            }
        }
    }

    /// Node of a function of a node, with checks.
    pub(super) fn call(&mut self, function: Function, node: usize) -> Result<usize, DagError> {
        match function {
            Function::Log if self.is(node, 0) => Err(DagError::Undefined("the logarithm of zero")),
            _ => Ok(self.function(function, node)),
        }
    }

    /// Node of a function, with its derivative.
    pub(super) fn function(&mut self, function: Function, of: usize) -> usize {
        if let Some(&known) = self.functions.get(&(function, of)) {
            return known;
        }
        self.ops.push(Op::Primitive { function, of, weight: usize::MAX });
        let own = self.ops.len() - 1;
        self.functions.insert((function, of), own);
        let one = self.integer(1);
        let derivative = match function {
            Function::Sin => self.function(Function::Cos, of),
            Function::Cos => {
                let sine = self.function(Function::Sin, of);
                self.negative(sine)
            }
            Function::Exp => own,
            Function::Log => self.quotient(one, of),
            Function::Sqrt => {
                let twice = self.sum(own, own);
                self.quotient(one, twice)
            }
            Function::Tanh => {
                let square = self.product(own, own);
                self.difference(one, square)
            }
            Function::Abs => self.function(Function::Sign, of),
            Function::Sign => self.integer(0),
            Function::Tan => {
                let square = self.product(own, own);
                self.sum(one, square)
            }
            Function::Atan => {
                let square = self.product(of, of);
                let sum = self.sum(one, square);
                self.quotient(one, sum)
            }
            Function::Asin | Function::Acos => {
                let square = self.product(of, of);
                let rest = self.difference(one, square);
                let root = self.function(Function::Sqrt, rest);
                let sign = self.integer(if function == Function::Asin { 1 } else { -1 });
                self.quotient(sign, root)
            }
        };
        if let Op::Primitive { weight, .. } = &mut self.ops[own] {
            *weight = derivative;
        }
        own
    }
}

/// Greatest common divisor, not negative.
pub(super) fn gcd(a: i64, b: i64) -> i64 {
    obsdeg_exact::gcd(a.unsigned_abs(), b.unsigned_abs()) as i64
}

/// Fraction in lowest terms, the denominator positive; `None` beyond small numbers.
fn reduced(p: i64, q: i64) -> Option<(i64, i64)> {
    if q == 0 || p == i64::MIN || q == i64::MIN {
        return None;
    }
    let g = gcd(p, q) * q.signum();
    Some((p / g, q / g))
}

/// Product of rational numbers; `None` beyond small ones.
pub(super) fn times((a, b): (i64, i64), (c, d): (i64, i64)) -> Option<(i64, i64)> {
    reduced(a.checked_mul(c)?, b.checked_mul(d)?)
}

/// Sum of rational numbers; `None` beyond small ones.
pub(super) fn plus((a, b): (i64, i64), (c, d): (i64, i64)) -> Option<(i64, i64)> {
    reduced(a.checked_mul(d)?.checked_add(c.checked_mul(b)?)?, b.checked_mul(d)?)
}
