//! Functions in the graph: sums inside them are taken apart, multiples and fractions of one argument become powers of
//! one function.

use std::collections::BTreeMap;

use super::dag::{Dag, DagError, FunctionStart, Op};
use crate::model::expression::Function;

/// A rational number.
type Ratio = (i64, i64);

/// Largest exponent and multiple of an angle.
const MAX_POWER: i64 = 1000;
/// Most terms of a sum inside a function.
const MAX_TERMS: usize = 1000;

/// Functions whose arguments may be fractions of one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Family {
    Circle,
    Exponential,
    Root,
}

impl Dag {
    /// The node as a rational number, if it is a small one.
    fn rational(&self, node: usize) -> Option<Ratio> {
        match self.ops[node] {
            Op::Number { mantissa, decimals } => {
                let ten = 10i64.checked_pow(decimals.unsigned_abs())?;
                let m = i64::try_from(mantissa).ok()?;
                if decimals < 0 { Some((m.checked_mul(ten)?, 1)) } else { reduced(m, ten) }
            }
            Op::Divide(a, b) => match (self.ops[a], self.ops[b]) {
                (Op::Number { .. }, Op::Number { .. }) => {
                    let ((a, b), (c, d)) = (self.rational(a)?, self.rational(b)?);
                    reduced(a.checked_mul(d)?, b.checked_mul(c)?)
                }
                _ => None,
            },
            Op::Multiply(a, b) => match (self.ops[a], self.ops[b]) {
                (Op::Number { .. }, Op::Number { .. }) => times(self.rational(a)?, self.rational(b)?),
                _ => None,
            },
            _ => None,
        }
    }

    /// The node as a sum of rational multiples of nodes that are no sums; the node of 1 stands for constants.
    fn linear_form(&mut self, node: usize) -> Result<BTreeMap<usize, Ratio>, DagError> {
        let one = self.integer(1);
        let (mut form, mut left) = (BTreeMap::new(), vec![(node, (1, 1))]);
        let mut steps = 0;
        while let Some((node, factor)) = left.pop() {
            steps += 1;
            if steps > MAX_TERMS {
                return Err(DagError::TooLarge("more than 1000 terms inside a function"));
            }
            let scaled =
                |k: Ratio| times(factor, k).ok_or(DagError::TooLarge("a coefficient inside a function"));
            if let Some(k) = self.rational(node) {
                accumulate(&mut form, one, scaled(k)?)?;
                continue;
            }
            match self.ops[node] {
                Op::Add(a, b) => left.extend([(a, factor), (b, factor)]),
                Op::Subtract(a, b) => left.extend([(a, factor), (b, scaled((-1, 1))?)]),
                Op::Multiply(a, b) if self.rational(a).is_some() => {
                    left.push((b, scaled(self.rational(a).unwrap_or((1, 1)))?));
                }
                Op::Multiply(a, b) if self.rational(b).is_some() => {
                    left.push((a, scaled(self.rational(b).unwrap_or((1, 1)))?));
                }
                Op::Divide(a, b) if self.rational(b).is_some_and(|k| k.0 != 0) => {
                    let (p, q) = self.rational(b).unwrap_or((1, 1));
                    left.push((a, scaled(reduced(q, p).unwrap_or((1, 1)))?));
                }
                _ => accumulate(&mut form, node, factor)?,
            }
        }
        form.retain(|_, k| k.0 != 0);
        Ok(form)
    }

    /// The multiple of `atom / d`, d the common denominator, that `k` atoms are.
    fn multiple(&mut self, family: Family, atom: usize, (p, q): Ratio) -> Result<(i64, i64), DagError> {
        let known = self.denominators.get(&(family, atom)).copied().unwrap_or(1);
        let common = (known / gcd(known, q)).checked_mul(q).filter(|d| *d <= MAX_POWER);
        let d = common.ok_or(DagError::TooLarge("a denominator above 1000 inside a function"))?;
        self.outdated |= d != known;
        self.denominators.insert((family, atom), d);
        let m = p.checked_mul(d / q).filter(|m| m.abs() <= MAX_POWER);
        Ok((m.ok_or(DagError::TooLarge("a multiple above 1000 inside a function"))?, d))
    }

    fn scaled(&mut self, atom: usize, d: i64) -> usize {
        let divisor = self.integer(d);
        self.quotient(atom, divisor)
    }

    /// `x^m` for a natural m.
    fn natural_power(&mut self, x: usize, mut m: u64) -> usize {
        let (mut result, mut square) = (self.integer(1), x);
        while m > 0 {
            if m & 1 == 1 {
                result = self.product(result, square);
            }
            m >>= 1;
            if m > 0 {
                square = self.product(square, square);
            }
        }
        result
    }

    fn integer_power(&mut self, x: usize, m: i64) -> usize {
        let power = self.natural_power(x, m.unsigned_abs());
        if m >= 0 {
            return power;
        }
        let one = self.integer(1);
        self.quotient(one, power)
    }

    /// `(cos, sin)` of the sum of two angles.
    fn turned(&mut self, (a, b): (usize, usize), (c, d): (usize, usize)) -> (usize, usize) {
        let (ac, bd, ad, bc) =
            (self.product(a, c), self.product(b, d), self.product(a, d), self.product(b, c));
        (self.difference(ac, bd), self.sum(ad, bc))
    }

    /// `(cos, sin)` of an expression.
    fn circle(&mut self, node: usize) -> Result<(usize, usize), DagError> {
        let mut out = (self.integer(1), self.integer(0));
        for (atom, k) in self.linear_form(node)? {
            let (m, d) = self.multiple(Family::Circle, atom, k)?;
            let angle = self.scaled(atom, d);
            let (s, c) = self.sine_and_cosine(angle);
            let mut base = (c, if m < 0 { self.negative(s) } else { s });
            let mut left = m.unsigned_abs();
            while left > 0 {
                if left & 1 == 1 {
                    out = self.turned(out, base);
                }
                left >>= 1;
                if left > 0 {
                    base = self.turned(base, base);
                }
            }
        }
        Ok(out)
    }

    fn sine_and_cosine(&mut self, angle: usize) -> (usize, usize) {
        if let Some(&known) = self.functions.get(&(Function::Sin, angle)) {
            return known;
        }
        let k = self.angles;
        self.angles += 1;
        let sine = self.primitive(FunctionStart::Sine(k), angle);
        let cosine = self.primitive(FunctionStart::Cosine(k), angle);
        let minus = self.negative(sine);
        self.set_weight(sine, cosine);
        self.set_weight(cosine, minus);
        self.functions.insert((Function::Sin, angle), (sine, cosine));
        (sine, cosine)
    }

    /// A function whose weight is still to come.
    fn primitive(&mut self, start: FunctionStart, of: usize) -> usize {
        self.ops.push(Op::Primitive { start, of, weight: usize::MAX });
        self.ops.len() - 1
    }

    fn set_weight(&mut self, node: usize, to: usize) {
        if let Op::Primitive { weight, .. } = &mut self.ops[node] {
            *weight = to;
        }
    }

    /// A function with a free start and the weight made by `weight` of itself and its argument.
    fn free_function(
        &mut self,
        function: Function,
        of: usize,
        weight: impl FnOnce(&mut Self, usize) -> Result<usize, DagError>,
    ) -> Result<usize, DagError> {
        if let Some(&(known, _)) = self.functions.get(&(function, of)) {
            return Ok(known);
        }
        let k = self.free;
        self.free += 1;
        let node = self.primitive(FunctionStart::Free(k), of);
        let weight = weight(self, node)?;
        self.set_weight(node, weight);
        self.functions.insert((function, of), (node, node));
        Ok(node)
    }

    fn exponential(&mut self, node: usize) -> Result<usize, DagError> {
        let mut out = self.integer(1);
        for (atom, k) in self.linear_form(node)? {
            let power = if let Some(&x) = self.logarithm_of.get(&atom) {
                self.rational_power(x, k)?
            } else {
                let (m, d) = self.multiple(Family::Exponential, atom, k)?;
                let of = self.scaled(atom, d);
                let e = self.free_function(Function::Exp, of, |_, own| Ok(own))?;
                self.exponent_of.insert(e, of);
                self.integer_power(e, m)
            };
            out = self.product(out, power);
        }
        Ok(out)
    }

    fn logarithm(&mut self, node: usize) -> Result<usize, DagError> {
        if self.is(node, 1) {
            return Ok(self.integer(0));
        }
        if self.is(node, 0) {
            return Err(DagError::Undefined("the logarithm of zero"));
        }
        if let Some(&of) = self.exponent_of.get(&node) {
            return Ok(of);
        }
        // factor by factor
        let (mut out, mut left) = (self.integer(0), vec![(node, true)]);
        let mut steps = 0;
        while let Some((node, positive)) = left.pop() {
            steps += 1;
            if steps > MAX_TERMS {
                return Err(DagError::TooLarge("more than 1000 factors inside a logarithm"));
            }
            match self.ops[node] {
                Op::Multiply(a, b) => left.extend([(a, positive), (b, positive)]),
                Op::Divide(a, b) => left.extend([(a, positive), (b, !positive)]),
                _ if self.is(node, 1) => {}
                _ => {
                    let own = match self.exponent_of.get(&node) {
                        Some(&of) => of,
                        None => {
                            let own = self.free_function(Function::Log, node, |dag, _| {
                                let one = dag.integer(1);
                                Ok(dag.quotient(one, node))
                            })?;
                            self.logarithm_of.insert(own, node);
                            own
                        }
                    };
                    out = if positive { self.sum(out, own) } else { self.difference(out, own) };
                }
            }
        }
        Ok(out)
    }

    /// `x^k` for a rational k.
    fn rational_power(&mut self, x: usize, k: Ratio) -> Result<usize, DagError> {
        if k.1 == 1 {
            return match k.0.abs() <= MAX_POWER {
                true => Ok(self.integer_power(x, k.0)),
                false => Err(DagError::TooLarge("an exponent above 1000")),
            };
        }
        let (m, d) = self.multiple(Family::Root, x, k)?;
        let root = match self.functions.get(&(Function::Sqrt, x)) {
            Some(&(known, _)) => known,
            None => {
                let root = self.primitive(FunctionStart::Root { numerator: 1, denominator: d }, x);
                let d = self.integer(d);
                let dx = self.product(d, x);
                let weight = self.quotient(root, dx);
                self.set_weight(root, weight);
                self.functions.insert((Function::Sqrt, x), (root, root));
                root
            }
        };
        Ok(self.integer_power(root, m))
    }

    /// `x^e`.
    pub(super) fn power(&mut self, x: usize, e: usize) -> Result<usize, DagError> {
        if let Some(k) = self.rational(e) {
            return self.rational_power(x, k);
        }
        // x^(a + k) = exp(a log x) x^k
        let one = self.integer(1);
        let log = self.logarithm(x)?;
        let mut out = one;
        for (atom, k) in self.linear_form(e)? {
            let factor = if atom == one {
                self.rational_power(x, k)?
            } else {
                let (p, q) = (self.integer(k.0), self.integer(k.1));
                let product = self.product(atom, log);
                let product = self.product(p, product);
                let argument = self.quotient(product, q);
                self.exponential(argument)?
            };
            out = self.product(out, factor);
        }
        Ok(out)
    }

    /// A function of a node.
    pub(super) fn call(&mut self, function: Function, node: usize) -> Result<usize, DagError> {
        let one = self.integer(1);
        // 1 - u^2 under the root of asin and acos
        let arc = |dag: &mut Self, sign: i64| {
            let square = dag.product(node, node);
            let rest = dag.difference(one, square);
            let root = dag.rational_power(rest, (1, 2))?;
            let sign = dag.integer(sign);
            Ok(dag.quotient(sign, root))
        };
        match function {
            Function::Sin => Ok(self.circle(node)?.1),
            Function::Cos => Ok(self.circle(node)?.0),
            Function::Tan => {
                let (c, s) = self.circle(node)?;
                Ok(self.quotient(s, c))
            }
            Function::Exp => self.exponential(node),
            Function::Log => self.logarithm(node),
            Function::Sqrt => self.rational_power(node, (1, 2)),
            Function::Atan => self.free_function(function, node, |dag, _| {
                let square = dag.product(node, node);
                let sum = dag.sum(one, square);
                Ok(dag.quotient(one, sum))
            }),
            Function::Asin => self.free_function(function, node, |dag, _| arc(dag, 1)),
            Function::Acos => self.free_function(function, node, |dag, _| arc(dag, -1)),
        }
    }
}

/// The greatest common divisor, not negative.
pub(super) fn gcd(a: i64, b: i64) -> i64 {
    obsdeg_exact::gcd(a.unsigned_abs(), b.unsigned_abs()) as i64
}

fn reduced(p: i64, q: i64) -> Option<Ratio> {
    let g = gcd(p, q);
    (q != 0 && g != 0).then(|| if q < 0 { (-p / g, -q / g) } else { (p / g, q / g) })
}

fn times((a, b): Ratio, (c, d): Ratio) -> Option<Ratio> {
    reduced(a.checked_mul(c)?, b.checked_mul(d)?)
}

fn accumulate(form: &mut BTreeMap<usize, Ratio>, key: usize, (c, d): Ratio) -> Result<(), DagError> {
    let (a, b) = form.get(&key).copied().unwrap_or((0, 1));
    let numerator = a.checked_mul(d).zip(c.checked_mul(b)).and_then(|(x, y)| x.checked_add(y));
    let sum = numerator.zip(b.checked_mul(d)).and_then(|(n, m)| reduced(n, m));
    form.insert(key, sum.ok_or(DagError::TooLarge("a coefficient inside a function"))?);
    Ok(())
}
