//! Ranges of the nodes of the graph over all real points, by interval arithmetic. They can prove the sign of
//! a constraint.

use std::collections::BTreeMap;

use super::constraints::below;
use super::dag::{Dag, Op};
use super::model::compiled::{Compiled, Role};
use crate::language::Function;

/// Interval of all numbers from `low` to `high`; bounds are rounded outwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    pub(super) low: f64,
    pub(super) high: f64,
    /// True if the interval does not contain zero, although zero may be a bound.
    never_zero: bool,
}

impl Interval {
    const ALL: Self = Self::between(f64::NEG_INFINITY, f64::INFINITY);
    const NOT_NEGATIVE: Self = Self::between(0.0, f64::INFINITY);

    const fn between(low: f64, high: f64) -> Self {
        Self { low, high, never_zero: false }
    }

    /// Interval of two bounds; bounds that are no numbers become infinite.
    fn new(low: f64, high: f64) -> Self {
        Self::between(
            if low.is_nan() { f64::NEG_INFINITY } else { low },
            if high.is_nan() { f64::INFINITY } else { high },
        )
    }

    /// True if the interval does not contain zero.
    pub(super) fn excludes_zero(&self) -> bool {
        self.never_zero || self.low > 0.0 || self.high < 0.0
    }

    /// The interval without zero, if `holds`.
    fn without_zero(self, holds: bool) -> Self {
        Self { never_zero: self.never_zero || holds, ..self }
    }

    /// Interval with room for rounding; an exact bound of zero stays.
    fn rounded(low: f64, high: f64) -> Self {
        let down = if low == 0.0 { low } else { low.next_down() };
        let up = if high == 0.0 { high } else { high.next_up() };
        Self::new(down, up)
    }

    /// Interval about a number, with a relative error of some units of the last place.
    pub(super) fn about(x: f64) -> Self {
        let room = x.abs() * 1e-14;
        Self::new(x - room, x + room)
    }

    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low, ..self }
    }

    fn plus(self, other: Self) -> Self {
        // a sum that rounds to zero need not be zero
        let bound = |x: f64, y: f64, next: fn(f64) -> f64| match x + y {
            z if z == 0.0 && x == 0.0 => z,
            z => next(z),
        };
        // both of one sign, and not both zero
        let one_sign = self.low >= 0.0 && other.low >= 0.0 || self.high <= 0.0 && other.high <= 0.0;
        Self::new(bound(self.low, other.low, f64::next_down), bound(self.high, other.high, f64::next_up))
            .without_zero(one_sign && (self.excludes_zero() || other.excludes_zero()))
    }

    fn times(self, other: Self) -> Self {
        // 0 times infinity is 0: the bound is no value
        let product = |x: f64, y: f64| if x == 0.0 || y == 0.0 { 0.0 } else { x * y };
        let (a, b) = ([self.low, self.high], [other.low, other.high]);
        let all = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(i, j)| product(a[i], b[j]));
        // an underflow to zero is no exact zero
        let exact = |x: f64| x == 0.0 && !a.iter().chain(&b).any(|y| *y != 0.0 && y.abs() < 1e-150);
        let (low, high) = (
            all.iter().copied().fold(f64::INFINITY, f64::min),
            all.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        );
        Self::new(
            if exact(low) { low } else { low.next_down() },
            if exact(high) { high } else { high.next_up() },
        )
        .without_zero(self.excludes_zero() && other.excludes_zero())
    }

    /// Reciprocal; if the interval reaches zero on one side only, the reciprocal of that side.
    fn inverse(self) -> Self {
        match (self.low, self.high) {
            (low, high) if low >= 0.0 => {
                let above = if low == 0.0 { f64::INFINITY } else { 1.0 / low };
                Self::rounded(if high.is_infinite() { 0.0 } else { 1.0 / high }, above).without_zero(true)
            }
            (_, high) if high <= 0.0 => self.neg().inverse().neg(),
            _ => Self::ALL.without_zero(true),
        }
    }

    fn within(self, other: Self) -> Self {
        Self { low: self.low.max(other.low), high: self.high.min(other.high), ..self }
    }

    /// Image under an increasing function.
    fn through(self, f: impl Fn(f64) -> f64) -> Self {
        let room = |x: f64| x.abs() * 1e-14 + 1e-300;
        let (low, high) = (f(self.low), f(self.high));
        Self::new(low - room(low), high + room(high))
    }
}

/// Range of a function.
fn of_function(function: Function, x: Interval) -> Interval {
    let unit = Interval::between(-1.0, 1.0);
    match function {
        Function::Exp => x.through(f64::exp).within(Interval::NOT_NEGATIVE).without_zero(true),
        Function::Log => x.within(Interval::NOT_NEGATIVE).through(f64::ln),
        Function::Sqrt => {
            let root = x.within(Interval::NOT_NEGATIVE).through(f64::sqrt).within(Interval::NOT_NEGATIVE);
            root.without_zero(x.excludes_zero())
        }
        Function::Tanh => x.through(f64::tanh).within(unit),
        Function::Atan => x.through(f64::atan),
        Function::Asin => x.within(unit).through(f64::asin),
        Function::Acos => x.within(unit).neg().through(|x| (-x).acos()),
        Function::Abs if x.low >= 0.0 => x,
        Function::Abs if x.high <= 0.0 => x.neg(),
        Function::Abs => Interval { low: 0.0, high: x.high.max(-x.low), ..x },
        Function::Sign if x.low > 0.0 => Interval::between(1.0, 1.0),
        Function::Sign if x.high < 0.0 => Interval::between(-1.0, -1.0),
        // sine and cosine change no faster than their argument
        Function::Sin | Function::Cos if x.high - x.low < 1e-9 => {
            let value = function.value(x.low);
            let room = (x.high - x.low) + 1e-14 * (1.0 + x.low.abs());
            Interval::between(value - room, value + room).within(unit)
        }
        Function::Sin | Function::Cos | Function::Sign => unit,
        Function::Tan => Interval::ALL,
    }
}

/// Range of a node for given ranges of the slots (all numbers for slots without one).
pub(super) fn of_node(dag: &Dag, node: usize, slots: &BTreeMap<usize, Interval>) -> Interval {
    let mut found: BTreeMap<usize, Interval> = BTreeMap::new();
    for i in below(dag, node) {
        let at = |a: usize| found.get(&a).copied().unwrap_or(Interval::ALL);
        let range = match dag.ops[i] {
            Op::Number { mantissa, decimals } => {
                Interval::about(mantissa as f64 * 10f64.powi(decimals.saturating_neg()))
            }
            Op::Pi => Interval::about(std::f64::consts::PI),
            Op::Slot(s) => slots.get(&s).copied().unwrap_or(Interval::ALL),
            Op::Add(a, b) => at(a).plus(at(b)),
            Op::Subtract(a, b) => at(a).plus(at(b).neg()),
            Op::Multiply(a, b) => {
                let range = at(a).times(at(b));
                if is_square(dag, i) { range.within(Interval::NOT_NEGATIVE) } else { range }
            }
            Op::Divide(a, b) => at(a).times(at(b).inverse()),
            Op::Primitive { function, of, .. } => of_function(function, at(of)),
        };
        found.insert(i, range);
    }
    found.get(&node).copied().unwrap_or(Interval::ALL)
}

/// True if every factor of a product occurs an even number of times.
fn is_square(dag: &Dag, node: usize) -> bool {
    /// Largest number of factors that are examined.
    const MOST: usize = 64;
    let (mut odd, mut open) = (BTreeMap::<usize, bool>::new(), vec![node]);
    let mut looked = 0;
    while let Some(i) = open.pop() {
        looked += 1;
        match dag.ops[i] {
            _ if looked > MOST => return false,
            Op::Multiply(a, b) if a == b => {}
            Op::Multiply(a, b) => open.extend([a, b]),
            _ => {
                let seen = odd.entry(i).or_insert(false);
                *seen = !*seen;
            }
        }
    }
    odd.values().all(|odd| !odd)
}

/// Range of a node at the start of an experiment: constants have their values, all other slots any number.
pub(super) fn range(compiled: &Compiled, node: usize, experiment: usize) -> Interval {
    let mut slots: BTreeMap<usize, Interval> = BTreeMap::new();
    for (c, formula) in compiled.constants(experiment).iter().enumerate() {
        let slot = compiled.roles.iter().position(|r| *r == Role::Constant(c));
        if let (Some(slot), Some(formula)) = (slot, formula) {
            let range = of_node(&compiled.dag, *formula, &slots);
            slots.insert(slot, range);
        }
    }
    of_node(&compiled.dag, node, &slots)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::language::{Names, evaluate_f64, parse_with};
    use obsdeg_exact::SplitMix64;

    fn of(text: &str) -> Interval {
        let names = ["x", "y", "a"];
        let mut dag = Dag::default();
        let slots: Vec<usize> = (0..3).map(|s| dag.slot(s)).collect();
        let e = parse_with(text, Names::Plain).expect("an expression");
        let slot = |name: &str| Some(slots[names.iter().position(|n| *n == name)?]);
        let node = dag.translate(&e, &slot).expect("a node");
        of_node(&dag, node, &BTreeMap::new())
    }

    /// Signs follow from the rules of sums, even powers, roots and absolute values; otherwise they are
    /// unknown.
    #[test]
    fn signs_by_hand() {
        for text in [
            "x^2 + y^2 + 1",
            "1 + 1/(x^2 + 1)",
            "exp(x) + 0.001",
            "sqrt(x) + abs(y) + 2",
            "3 - tanh(x)",
            "x^10*y^4 + 1e-9",
        ] {
            assert!(of(text).low > 0.0, "{text}: {:?}", of(text));
        }
        for text in ["-x^2 - 1", "-1 - abs(a)", "-(x*y*x*y) - 1e-30", "-sqrt(2)", "cos(3.1)"] {
            assert!(of(text).high < 0.0, "{text}: {:?}", of(text));
        }
        for text in ["x^2 + y^2", "(x - y)^2", "x^100", "(x*y)*(y*x)", "x^2/(1 + y^4)", "sqrt(x)"] {
            assert_eq!(of(text).low, 0.0, "{text}");
        }
        for text in ["x^3", "x^2 - y^2", "x*y", "x^2 + y", "1/x", "(0.1 + 0.2) - 0.3", "x^2 + x"] {
            let range = of(text);
            assert!(range.low < 0.0 && range.high > 0.0, "{text}: {range:?}");
        }
    }

    /// Values of random expressions at random points lie inside their ranges.
    #[test]
    fn no_value_is_outside() {
        let mut rng = SplitMix64::new(5);
        let leaves = ["x", "y", "a", "2", "0.3", "-1.5"];
        for _ in 0..400 {
            let mut text = leaves[rng.below(6) as usize].to_string();
            for _ in 0..rng.below(7) {
                let leaf = leaves[rng.below(6) as usize];
                text = match rng.below(9) {
                    0 => format!("({text} + {leaf})"),
                    1 => format!("({text} - ({leaf}))"),
                    2 => format!("({text})*({leaf})"),
                    3 => format!("({text})^2"),
                    4 => format!("({text})^3"),
                    5 => format!("1/(1 + ({text})^2)"),
                    6 => format!("tanh({text})"),
                    7 => format!("abs({text})"),
                    _ => format!("sqrt(1 + ({text})^2)"),
                };
            }
            let e = parse_with(&text, Names::Plain).expect("an expression");
            let range = of(&text);
            for _ in 0..20 {
                let point: Vec<f64> = (0..3).map(|_| rng.below(8000) as f64 / 1000.0 - 4.0).collect();
                let at = |name: &str| point[["x", "y", "a"].iter().position(|n| *n == name).expect("a name")];
                let value = evaluate_f64(&e, &at);
                let room = 1e-9 * (1.0 + value.abs());
                assert!(range.low <= value + room && value - room <= range.high, "{text}: {value} {range:?}");
            }
        }
    }
}
