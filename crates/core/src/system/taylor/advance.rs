//! Next order of the Taylor series of a run, and the number of its operations.

use obsdeg_exact::interrupt;

use super::super::dag::Op;
use super::super::values::Values;
use super::{Signal, Taylor};

impl<S: Values> Taylor<'_, S> {
    /// Products and sums of the next order, by components: those independent of the order, and those for each
    /// order before it; then the number of nodes that take part, and of products of two series among them.
    pub(in crate::system) fn operations(&self) -> [u64; 4] {
        let mut out = [0u64; 4];
        for (i, op) in self.dag.ops.iter().enumerate().filter(|(i, _)| self.needed[*i]) {
            out[2] += 1;
            if self.constant[i] {
                continue;
            }
            let width = if self.differentiated[i] { self.support[i].len() as u64 + 1 } else { 1 };
            out[0] += width;
            let product = match *op {
                Op::Multiply(a, b) => !self.constant[a] && !self.constant[b],
                Op::Divide(_, b) => !self.constant[b],
                Op::Primitive { .. } => true,
                _ => false,
            };
            if product {
                out[1] += 2 * width;
                out[3] += 1;
            }
        }
        out
    }

    /// Computes the coefficient of the next order of all nodes.
    pub(crate) fn advance(&mut self) {
        let k = self.length;
        self.inverse(k);
        for i in 0..self.dag.ops.len() {
            if i % 64 == 0 {
                interrupt::check();
            }
            if self.needed[i] && !self.constant[i] {
                let x = self.next_value(i, k);
                self.values[i].push(x);
            }
        }
        for i in 0..if self.components == 0 { 0 } else { self.dag.ops.len() } {
            if self.differentiated[i] && !self.constant[i] && !self.known[i] {
                interrupt::check();
                self.next_dual(i, k);
            }
        }
        self.length += 1;
    }

    fn next_value(&mut self, i: usize, k: usize) -> S::Element {
        let f = &self.f;
        let of = |a: usize, j: usize| self.value(a, j);
        match self.dag.ops[i] {
            Op::Number { .. } | Op::Pi => f.zero(),
            Op::Slot(s) => match self.signals[s] {
                Signal::State { rate } => f.mul(&of(rate, k - 1), &self.inverses[k]),
                Signal::Constant { .. } => f.zero(),
                Signal::Known { degree, .. } if degree.is_some_and(|d| k > d) => f.zero(),
                Signal::Unknown { count, .. } if k >= count => f.zero(),
                Signal::Known { .. } | Signal::Unknown { .. } => f.coefficient(&mut self.rng),
                Signal::Time { .. } if k == 1 => f.one(),
                Signal::Time { .. } => f.zero(),
            },
            Op::Add(a, b) => f.add(&of(a, k), &of(b, k)),
            Op::Subtract(a, b) => f.sub(&of(a, k), &of(b, k)),
            Op::Multiply(a, b) => {
                let (a, b) = if self.constant[b] { (b, a) } else { (a, b) };
                if self.constant[a] {
                    return f.mul(&of(a, 0), &of(b, k));
                }
                f.dot(&f.zero(), (0..=k).map(|j| (&self.values[a][j], &self.values[b][k - j])))
            }
            Op::Divide(a, b) => {
                // c b = a
                let inverse = self.reciprocal(b);
                if self.constant[b] {
                    return f.mul(&of(a, k), &inverse);
                }
                let sum = f.dot(&f.zero(), (0..k).map(|j| (&self.values[i][j], &self.values[b][k - j])));
                f.mul(&f.sub(&of(a, k), &sum), &inverse)
            }
            Op::Primitive { of: u, weight, .. } => {
                // F' = weight u'
                let weights = &self.values[weight];
                let changes: Vec<S::Element> =
                    (1..=k).map(|j| f.mul(&f.integer(j as i64), &of(u, j))).collect();
                let terms = changes.iter().zip((0..k).rev()).filter_map(|(x, j)| Some((x, weights.get(j)?)));
                f.mul(&f.dot(&f.zero(), terms), &self.inverses[k])
            }
        }
    }

    /// Reciprocal of the start of a node, which is not zero: otherwise the series would not exist.
    fn reciprocal(&self, b: usize) -> S::Element {
        self.f.inverse(&self.values[b][0]).unwrap_or(self.f.zero())
    }

    fn next_dual(&mut self, i: usize, k: usize) {
        let f = self.f.clone();
        let mut sums = std::mem::take(&mut self.sums);
        let mut pending = 0;
        let of = |a: usize, j: usize| self.value(a, j);
        let (one, minus) = (f.one(), f.neg(&f.one()));
        let mut own: Option<(usize, S::Element)> = None;
        let mut scale = None;
        match self.dag.ops[i] {
            Op::Number { .. } | Op::Pi => {}
            Op::Slot(s) => match self.signals[s] {
                Signal::State { rate } => {
                    self.gather(&mut sums, &mut pending, rate, k - 1, &self.inverses[k])
                }
                Signal::Unknown { component, count, .. } if k < count => own = Some((component + k, one)),
                _ => {}
            },
            Op::Add(a, b) => {
                self.gather(&mut sums, &mut pending, a, k, &one);
                self.gather(&mut sums, &mut pending, b, k, &one);
            }
            Op::Subtract(a, b) => {
                self.gather(&mut sums, &mut pending, a, k, &one);
                self.gather(&mut sums, &mut pending, b, k, &minus);
            }
            Op::Multiply(a, b) => {
                for (a, b) in [(a, b), (b, a)] {
                    // a_j db_(k-j); a constant has order 0 only
                    let js = if self.constant[a] { 0..=0 } else { 0..=k };
                    for j in js.filter(|j| !self.constant[b] || *j == k) {
                        self.gather(&mut sums, &mut pending, b, k - j, &of(a, j));
                    }
                }
            }
            Op::Divide(a, b) => {
                // dc_k b_0 = da_k - sum_{j<k} dc_j b_(k-j) - sum_j c_j db_(k-j)
                self.gather(&mut sums, &mut pending, a, k, &one);
                if !self.constant[b] {
                    for j in 0..k {
                        self.gather(&mut sums, &mut pending, i, j, &f.neg(&of(b, k - j)));
                        self.gather(&mut sums, &mut pending, b, k - j, &f.neg(&of(i, j)));
                    }
                }
                self.gather(&mut sums, &mut pending, b, 0, &f.neg(&of(i, k)));
                scale = Some(self.reciprocal(b));
            }
            Op::Primitive { of: u, weight, .. } => {
                // dF = weight du
                for j in 0..=k {
                    self.gather(&mut sums, &mut pending, u, j, &of(weight, k - j));
                }
            }
        }
        self.store(i, k, &mut sums, scale.as_ref(), own.as_slice());
        self.sums = sums;
    }
}
