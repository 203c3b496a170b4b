//! Taylor series of all nodes in time, coefficient by coefficient, with the derivative by every unknown (a dual lane
//! each), in a prime field.

use obsdeg_exact::{Field, SplitMix64};

use super::dag::{Dag, FunctionStart, Op};
use crate::model::expression::from_i128;

/// What a slot holds in one run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Signal {
    /// A state: the node of its derivative.
    State {
        /// The right-hand side.
        rate: usize,
    },
    /// A number that does not change, with its lane if it is unknown.
    Constant {
        /// The value.
        value: u64,
        /// The unknown.
        lane: Option<usize>,
    },
    /// A known input with random derivatives up to this order (`None`: all).
    Known {
        /// The order.
        degree: Option<usize>,
    },
    /// An unknown input: the lane of its first Taylor coefficient, and how many there are.
    Unknown {
        /// The first lane.
        lane: usize,
        /// The number of lanes.
        count: usize,
    },
    /// Time.
    Time,
}

/// The start of a state: its value and its derivative by every unknown (lane, value).
pub(crate) type Initial = (u64, Vec<(usize, u64)>);

/// Why there is no series at this point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Singular {
    /// A division by zero, at this node.
    Division(usize),
    /// A root that this field does not have here, at this node.
    Root(usize),
    /// Constraints that could not be solved here, this one among them.
    Constraint(usize),
}

/// The series of one run.
#[derive(Debug, Clone)]
pub(crate) struct Taylor<'a> {
    dag: &'a Dag,
    f: Field,
    lanes: usize,
    signals: Vec<Signal>,
    rng: SplitMix64,
    /// Whether a node is constant in time.
    constant: Vec<bool>,
    /// Whether a node depends on no unknown.
    known: Vec<bool>,
    /// `values[node][k]`.
    values: Vec<Vec<u64>>,
    /// `duals[node][k * lanes + lane]`.
    duals: Vec<Vec<u64>>,
    /// Inverses of small integers.
    inverses: Vec<u64>,
    /// Coefficients that are computed.
    pub length: usize,
    sums: Vec<u128>,
}

/// Random starts of functions, shared by all runs at one point.
#[derive(Debug, Clone, Default)]
pub(crate) struct Starts {
    free: Vec<u64>,
    /// `(cos, sin)`.
    circle: Vec<(u64, u64)>,
}

impl Starts {
    /// Random values for all functions of a graph.
    pub(crate) fn random(dag: &Dag, f: &Field, rng: &mut SplitMix64) -> Self {
        let p = f.modulus();
        let free = (0..dag.free).map(|_| 1 + rng.below(p - 1)).collect();
        let circle = (0..dag.angles)
            .map(|_| {
                loop {
                    let t = rng.below(p);
                    let square = f.mul(t, t);
                    let below = f.add(f.one(), square);
                    if below != 0 {
                        let inverse = f.inv(below);
                        let cos = f.mul(f.sub(f.one(), square), inverse);
                        break (cos, f.mul(f.add(t, t), inverse));
                    }
                }
            })
            .collect();
        Self { free, circle }
    }
}

impl<'a> Taylor<'a> {
    /// The series at order 0: `initial` gives every state's start (by slot).
    ///
    /// # Errors
    /// [`Singular`] when the point is none.
    pub(crate) fn new(
        dag: &'a Dag,
        f: Field,
        lanes: usize,
        signals: &[Signal],
        initial: &[Option<Initial>],
        starts: &Starts,
        rng: SplitMix64,
    ) -> Result<Self, Singular> {
        let n = dag.ops.len();
        let mut out = Self {
            dag,
            f,
            lanes,
            signals: signals.to_vec(),
            rng,
            constant: vec![false; n],
            known: vec![false; n],
            values: vec![Vec::new(); n],
            duals: vec![Vec::new(); n],
            inverses: vec![0],
            length: 0,
            sums: Vec::new(),
        };
        out.classify();
        out.start_values(initial, starts)?;
        out.start_duals(initial);
        out.length = 1;
        Ok(out)
    }

    /// What does not change, and what is known: functions as their arguments.
    fn classify(&mut self) {
        for (i, op) in self.dag.ops.iter().enumerate() {
            let (constant, known) = match *op {
                Op::Number { .. } => (true, true),
                Op::Slot(s) => match &self.signals[s] {
                    Signal::State { .. } => (false, false),
                    Signal::Constant { lane, .. } => (true, lane.is_none()),
                    Signal::Known { degree } => (*degree == Some(0), true),
                    Signal::Unknown { count, .. } => (*count == 1, false),
                    Signal::Time => (false, true),
                },
                Op::Add(a, b) | Op::Subtract(a, b) | Op::Multiply(a, b) | Op::Divide(a, b) => {
                    (self.constant[a] && self.constant[b], self.known[a] && self.known[b])
                }
                Op::Primitive { of, .. } => (self.constant[of], self.known[of]),
            };
            (self.constant[i], self.known[i]) = (constant, known);
        }
    }

    fn start_values(&mut self, initial: &[Option<Initial>], starts: &Starts) -> Result<(), Singular> {
        let f = self.f;
        for (i, op) in self.dag.ops.iter().enumerate() {
            let value = |a: usize| self.values[a][0];
            let x = match *op {
                Op::Number { mantissa, decimals } => {
                    let ten = f.pow(f.from_u64(10), decimals.unsigned_abs().into());
                    f.mul(from_i128(&f, mantissa), if decimals < 0 { ten } else { f.inv(ten) })
                }
                Op::Slot(s) => match &self.signals[s] {
                    Signal::Constant { value, .. } => *value,
                    Signal::State { .. } => initial[s].as_ref().map_or(0, |x| x.0),
                    _ => self.rng.below(f.modulus()),
                },
                Op::Add(a, b) => f.add(value(a), value(b)),
                Op::Subtract(a, b) => f.sub(value(a), value(b)),
                Op::Multiply(a, b) => f.mul(value(a), value(b)),
                Op::Divide(_, b) if value(b) == 0 => return Err(Singular::Division(i)),
                Op::Divide(a, b) => f.mul(value(a), f.inv(value(b))),
                Op::Primitive { start, of, .. } => match start {
                    FunctionStart::Free(k) => starts.free[k],
                    FunctionStart::Cosine(k) => starts.circle[k].0,
                    FunctionStart::Sine(k) => starts.circle[k].1,
                    FunctionStart::Root { denominator, .. } => {
                        root(&f, value(of), denominator).ok_or(Singular::Root(i))?
                    }
                },
            };
            self.values[i].push(x);
        }
        Ok(())
    }

    fn start_duals(&mut self, initial: &[Option<Initial>]) {
        let f = self.f;
        for i in 0..self.dag.ops.len() {
            if self.known[i] {
                continue;
            }
            let mut row = vec![0; self.lanes];
            let mut add = |a: usize, factor: u64| {
                for (x, &y) in row.iter_mut().zip(&self.duals[a]) {
                    *x = f.add(*x, f.mul(factor, y));
                }
            };
            let value = |a: usize| self.values[a][0];
            match self.dag.ops[i] {
                Op::Number { .. } => {}
                Op::Slot(s) => match &self.signals[s] {
                    Signal::State { .. } => {
                        for &(lane, x) in initial[s].iter().flat_map(|x| &x.1) {
                            row[lane] = x;
                        }
                    }
                    Signal::Constant { lane: Some(lane), .. } | Signal::Unknown { lane, .. } => {
                        row[*lane] = f.one();
                    }
                    _ => {}
                },
                Op::Add(a, b) => {
                    add(a, f.one());
                    add(b, f.one());
                }
                Op::Subtract(a, b) => {
                    add(a, f.one());
                    add(b, f.neg(f.one()));
                }
                Op::Multiply(a, b) => {
                    add(a, value(b));
                    add(b, value(a));
                }
                Op::Divide(a, b) => {
                    let inverse = f.inv(value(b));
                    add(a, inverse);
                    add(b, f.neg(f.mul(value(i), inverse)));
                }
                Op::Primitive { of, weight, .. } => add(of, value(weight)),
            }
            self.duals[i] = row;
        }
    }

    fn inverse(&mut self, k: usize) -> u64 {
        while self.inverses.len() <= k {
            self.inverses.push(self.f.inv(self.f.from_u64(self.inverses.len() as u64)));
        }
        self.inverses[k]
    }

    /// The coefficient of a node at order k; zero beyond the start of what is constant.
    pub(crate) fn value(&self, a: usize, k: usize) -> u64 {
        self.values[a].get(k).copied().unwrap_or(0)
    }

    /// The derivative of a node at order k by every unknown; empty when it is zero.
    pub(crate) fn dual(&self, a: usize, k: usize) -> &[u64] {
        self.duals[a].get(k * self.lanes..(k + 1) * self.lanes).unwrap_or(&[])
    }

    /// Whether a node depends on no unknown.
    pub(crate) fn is_known(&self, a: usize) -> bool {
        self.known[a]
    }

    /// The value of a node at order 0.
    pub(crate) fn start(&self, a: usize) -> u64 {
        self.values[a][0]
    }

    /// Computes the coefficient of the next order of all nodes.
    pub(crate) fn advance(&mut self) {
        let k = self.length;
        self.inverse(k);
        for i in 0..self.dag.ops.len() {
            if !self.constant[i] {
                let x = self.next_value(i, k);
                self.values[i].push(x);
            }
        }
        for i in 0..self.dag.ops.len() {
            if !self.constant[i] && !self.known[i] {
                self.next_dual(i, k);
            }
        }
        self.length += 1;
    }

    fn next_value(&mut self, i: usize, k: usize) -> u64 {
        let f = self.f;
        let of = |a: usize, j: usize| self.value(a, j);
        match self.dag.ops[i] {
            Op::Number { .. } => 0,
            Op::Slot(s) => match self.signals[s] {
                Signal::State { rate } => f.mul(of(rate, k - 1), self.inverses[k]),
                Signal::Constant { .. } => 0,
                Signal::Known { degree } if degree.is_some_and(|d| k > d) => 0,
                Signal::Unknown { count, .. } if k >= count => 0,
                Signal::Known { .. } | Signal::Unknown { .. } => self.rng.below(f.modulus()),
                Signal::Time => u64::from(k == 1) * f.one(),
            },
            Op::Add(a, b) => f.add(of(a, k), of(b, k)),
            Op::Subtract(a, b) => f.sub(of(a, k), of(b, k)),
            Op::Multiply(a, b) => {
                let (a, b) = if self.constant[b] { (b, a) } else { (a, b) };
                if self.constant[a] {
                    return f.mul(of(a, 0), of(b, k));
                }
                f.dot(0, (0..=k).map(|j| (self.values[a][j], self.values[b][k - j])))
            }
            Op::Divide(a, b) => {
                // c b = a
                let inverse = f.inv(of(b, 0));
                if self.constant[b] {
                    return f.mul(of(a, k), inverse);
                }
                let sum = f.dot(0, (0..k).map(|j| (self.values[i][j], self.values[b][k - j])));
                f.mul(f.sub(of(a, k), sum), inverse)
            }
            Op::Primitive { of: u, weight, .. } => {
                // F' = weight u'
                let terms = (1..=k).map(|j| (f.mul(f.from_u64(j as u64), of(u, j)), of(weight, k - j)));
                f.mul(f.dot(0, terms), self.inverses[k])
            }
        }
    }

    /// Adds `factor * dual(a, j)` to the sums.
    fn gather(&self, sums: &mut [u128], pending: &mut usize, a: usize, j: usize, factor: u64) {
        let row = self.dual(a, j);
        if factor == 0 || row.is_empty() {
            return;
        }
        if *pending == Field::LAZY {
            sums.iter_mut().for_each(|s| *s = self.f.settle(*s));
            *pending = 0;
        }
        *pending += 1;
        for (s, &x) in sums.iter_mut().zip(row) {
            *s += self.f.lazy(factor, x);
        }
    }

    fn next_dual(&mut self, i: usize, k: usize) {
        let f = self.f;
        let mut sums = std::mem::take(&mut self.sums);
        sums.clear();
        sums.resize(self.lanes, 0);
        let mut pending = 0;
        let of = |a: usize, j: usize| self.value(a, j);
        let minus = |x: u64| f.neg(x);
        let mut lane_of_input = None;
        let mut scale = None;
        match self.dag.ops[i] {
            Op::Number { .. } => {}
            Op::Slot(s) => match self.signals[s] {
                Signal::State { rate } => self.gather(&mut sums, &mut pending, rate, k - 1, self.inverses[k]),
                Signal::Unknown { lane, count } if k < count => lane_of_input = Some(lane + k),
                _ => {}
            },
            Op::Add(a, b) => {
                self.gather(&mut sums, &mut pending, a, k, f.one());
                self.gather(&mut sums, &mut pending, b, k, f.one());
            }
            Op::Subtract(a, b) => {
                self.gather(&mut sums, &mut pending, a, k, f.one());
                self.gather(&mut sums, &mut pending, b, k, minus(f.one()));
            }
            Op::Multiply(a, b) => {
                for (a, b) in [(a, b), (b, a)] {
                    // a_j db_(k-j); what is constant has order 0 only
                    let js = if self.constant[a] { 0..=0 } else { 0..=k };
                    for j in js.filter(|j| !self.constant[b] || *j == k) {
                        self.gather(&mut sums, &mut pending, b, k - j, of(a, j));
                    }
                }
            }
            Op::Divide(a, b) => {
                // dc_k b_0 = da_k - sum_{j<k} dc_j b_(k-j) - sum_j c_j db_(k-j)
                self.gather(&mut sums, &mut pending, a, k, f.one());
                if !self.constant[b] {
                    for j in 0..k {
                        self.gather(&mut sums, &mut pending, i, j, minus(of(b, k - j)));
                        self.gather(&mut sums, &mut pending, b, k - j, minus(of(i, j)));
                    }
                }
                self.gather(&mut sums, &mut pending, b, 0, minus(of(i, k)));
                scale = Some(f.inv(of(b, 0)));
            }
            Op::Primitive { of: u, weight, .. } => {
                for j in 1..=k {
                    let count = f.from_u64(j as u64);
                    self.gather(&mut sums, &mut pending, u, j, f.mul(count, of(weight, k - j)));
                    self.gather(&mut sums, &mut pending, weight, k - j, f.mul(count, of(u, j)));
                }
                scale = Some(self.inverses[k]);
            }
        }
        let scale = scale.unwrap_or(f.one());
        let one = f.one();
        self.duals[i].extend(sums.iter().map(|&s| if s == 0 { 0 } else { f.reduce(s) }));
        if scale != one {
            for x in &mut self.duals[i][k * self.lanes..] {
                *x = f.mul(*x, scale);
            }
        }
        if let Some(lane) = lane_of_input {
            self.duals[i][k * self.lanes + lane] = one;
        }
        self.sums = sums;
    }
}

/// A q-th root of `x`; in a field with p = 3 mod 4 whose p - 1 has no odd factor of q: unique up to sign, and of a
/// square for every factor of two.
fn root(f: &Field, x: u64, q: i64) -> Option<u64> {
    let p = f.modulus();
    let (mut odd, mut twos) = (q.unsigned_abs(), 0);
    while odd.is_multiple_of(2) {
        odd /= 2;
        twos += 1;
    }
    if x == 0 || odd == 0 {
        return None;
    }
    let mut out = x;
    for _ in 0..twos {
        let r = f.pow(out, (p + 1) / 4);
        if f.mul(r, r) != out {
            return None;
        }
        // of the two roots the one that is a square
        let square = f.pow(r, (p - 1) / 2) == f.one();
        out = if square { r } else { f.neg(r) };
    }
    if odd > 1 {
        // odd * e = 1 mod p - 1
        let m = u128::from(p - 1);
        let e = (1..odd).find(|t| (m * u128::from(*t) + 1).is_multiple_of(u128::from(odd)))?;
        let e = (m * u128::from(e) + 1) / u128::from(odd);
        out = f.pow(out, e as u64);
    }
    Some(out)
}
