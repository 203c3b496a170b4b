//! Derivative rows without a dual component per unknown in every node: the differentials of
//! `h, L_f h, L_f^2 h, ...` along the trajectory, propagated backwards through the graph.
//!
//! Let `d(L_f^k h) = sum_s w_s dx_s` over states and unknown constants, with `w_s` series in time. The next
//! `w_s` is `w_s' + sum_r w_r d(f_r)/dx_s`: a derivative, and one backward sweep through the graph (Hermann,
//! Krener 1977, doi:10.1109/TAC.1977.1101601, for the Lie derivatives of covectors). A row of order k is the
//! value at the start, which is k! times the Taylor coefficient. For orders below K, series of length K - k
//! suffice. So n unknowns and n orders take n^2 numbers in memory instead of n^3, and n^2 products of
//! series, or n^3 log n operations if these are transformed. Where the Jacobian `df_r/dx_s` has few entries
//! its series replace the graph: each `w_r` is transformed once, and each sum once back.

use std::cell::RefCell;

use obsdeg_exact::interrupt;

use super::constraints::below;
use super::dag::{Dag, Op};
use super::taylor::{Initial, Signal, Taylor};
use super::values::Values;
use super::work::Sweeps;

/// Power series in time, as its coefficients.
type TaylorSeries<S> = Vec<<S as obsdeg_exact::Scalars>::Element>;

/// Length of the first series: most runs need no more orders.
const SHORT: usize = 16;
/// Factor by which series that are too short are lengthened. All their orders are computed again.
const LONGER: usize = 4;

/// Entry of the Jacobian: the slot of its row, which is a state, and its series.
type JacobianEntry<S> = (usize, TaylorSeries<S>);

/// Largest number of nodes below all rates, for each node of the graph, for which a Jacobian is computed.
const SHARED: usize = 8;

/// Rows of one run, computed backwards.
#[derive(Debug, Clone)]
pub(super) struct Adjoint<'a, S: Values> {
    dag: &'a Dag,
    f: S,
    components: usize,
    signals: Vec<Signal<S::Element>>,
    initial: Vec<Option<Initial<S::Element>>>,
    outputs: Vec<usize>,
    /// Number of orders of the values of all nodes; 0 before the first row.
    length: usize,
    /// Length that suffices for most runs: it gives every unknown a row.
    enough: usize,
    values: Taylor<'a, S>,
    /// Factors of every quotient: one over the divisor, and minus the quotient over the divisor.
    quotients: Vec<Option<[TaylorSeries<S>; 2]>>,
    /// Whole numbers from one on.
    integers: Vec<S::Element>,
    /// Entries of the Jacobian by the slot of their column; `None` if sweeps through the graph take less.
    jacobian: Option<Vec<Vec<JacobianEntry<S>>>>,
    plan: RefCell<S::SeriesPlan>,
    /// Order of the differentials in `held`.
    order: usize,
    /// Factors of the differentials, by output and slot.
    held: Vec<Vec<Option<TaylorSeries<S>>>>,
}

impl<'a, S: Values> Adjoint<'a, S> {
    /// Prepares the rows of a run, from order 0, and its values; `None` if inputs are unknown.
    pub(super) fn new(
        dag: &'a Dag,
        f: S,
        components: usize,
        signals: &[Signal<S::Element>],
        initial: &[Option<Initial<S::Element>>],
        outputs: &[usize],
        values: Taylor<'a, S>,
    ) -> Option<Self> {
        if signals.iter().any(|s| matches!(s, Signal::Unknown { .. })) {
            return None;
        }
        let enough = components / outputs.len().max(1) + 2;
        let (signals, initial, outputs) = (signals.to_vec(), initial.to_vec(), outputs.to_vec());
        let plan = RefCell::new(f.plan(1));
        let quotients = Vec::new();
        Some(Self {
            dag,
            f,
            components,
            signals,
            initial,
            outputs,
            length: 0,
            enough,
            values,
            quotients,
            integers: Vec::new(),
            jacobian: None,
            plan,
            order: 0,
            held: Vec::new(),
        })
    }

    /// Length of the series for the rows of an order.
    fn length_for(&self, order: usize) -> usize {
        if order < self.length {
            return self.length;
        }
        let longer = (LONGER * self.length).max(SHORT).min(self.enough);
        if order < longer { longer } else { order + 1 + order / 2 }
    }

    /// Series that the rows of an order will take, starting from the current differentials.
    pub(super) fn sweeps(&self, order: usize) -> Sweeps {
        let length = self.length_for(order);
        let held = self.values.length;
        let (from, values) = match length == self.length {
            true => (self.order + 1, held),
            false => (0, held.max(length)),
        };
        let count = (order + 1).saturating_sub(from);
        Sweeps {
            longest: length.saturating_sub(from) as u64,
            count: count as u64,
            values: [held as u64, values as u64],
        }
    }

    /// Computes the values up to the length, and the differentials of order 0.
    fn begin(&mut self) {
        while self.values.length < self.length {
            self.values.advance();
        }
        self.plan = RefCell::new(self.f.plan(self.length));
        let (f, n) = (&self.f, self.length);
        let quotient = |(i, op): (usize, &Op)| match *op {
            Op::Divide(_, b) if self.values.takes_part(i) && !self.values.is_known(i) => {
                let below = inverse(f, self.values.series(b), n);
                let ratio: TaylorSeries<S> = self.values.series(i).iter().map(|x| f.neg(x)).collect();
                // a key that no other factor has
                let other = self.products(&ratio, &[(usize::MAX - i, &below)], n);
                Some([below, other.into_iter().next()?])
            }
            _ => None,
        };
        self.quotients = self.dag.ops.iter().enumerate().map(quotient).collect();
        self.integers = (1..=self.length as i64).map(|k| self.f.integer(k)).collect();
        self.order = 0;
        let start = |&output: &usize| {
            let mut one = vec![self.f.zero(); n];
            one[0] = self.f.one();
            self.sweep(vec![(output, one)], n)
        };
        self.held = self.outputs.iter().map(start).collect();
        self.jacobian = self.jacobian();
        if self.jacobian.is_some() {
            // with the keys of its entries
            self.plan = RefCell::new(self.f.plan(self.length));
        }
    }

    /// Slots of the states, each with the node of its rate.
    fn rates(&self) -> Vec<(usize, usize)> {
        let rate = |(slot, signal): (usize, &Signal<S::Element>)| match signal {
            Signal::State { rate } => Some((slot, *rate)),
            _ => None,
        };
        self.signals.iter().enumerate().filter_map(rate).collect()
    }

    /// Numbers of series that a sweep from all rates transforms and multiplies; `None` if the nodes below
    /// each rate are many together.
    fn sweep_size(&self) -> Option<(usize, usize)> {
        let (mut transforms, mut products, mut nodes) = (0, 0, 0);
        let mut counted = vec![false; self.dag.ops.len()];
        for (_, rate) in self.rates() {
            for i in below(self.dag, rate) {
                nodes += 1;
                if nodes > SHARED * self.dag.ops.len() {
                    return None;
                }
                if std::mem::replace(&mut counted[i], true) || self.values.is_known(i) {
                    continue;
                }
                let is_series = |i: usize| self.values.series(i).len() > 1;
                let parts = match self.dag.ops[i] {
                    Op::Multiply(a, b) => {
                        let part = |(to, by): &(usize, usize)| !self.values.is_known(*to) && is_series(*by);
                        [(a, b), (b, a)].iter().filter(|p| part(p)).count()
                    }
                    Op::Divide(a, b) => [a, b].iter().filter(|to| !self.values.is_known(**to)).count(),
                    Op::Primitive { .. } => 1,
                    _ => 0,
                };
                products += parts;
                transforms += if parts > 0 { 1 + parts } else { 0 };
            }
        }
        Some((transforms, products))
    }

    /// The Jacobian of the rates, if products with it take less than a sweep through the graph.
    fn jacobian(&self) -> Option<Vec<Vec<JacobianEntry<S>>>> {
        let (transforms, products) = self.sweep_size()?;
        let rates = self.rates();
        let mut columns: Vec<Vec<JacobianEntry<S>>> = vec![Vec::new(); self.signals.len()];
        let (mut entries, n) = (0, self.length);
        for &(row, rate) in &rates {
            let mut one = vec![self.f.zero(); n];
            one[0] = self.f.one();
            for (column, series) in self.sweep(vec![(rate, one)], n).into_iter().enumerate() {
                columns[column].extend(series.map(|series| (row, series)));
            }
            entries = columns.iter().map(Vec::len).sum();
            if entries > products {
                return None;
            }
        }
        let sums = columns.iter().filter(|c| !c.is_empty()).count();
        (rates.len() + sums + entries / 4 < transforms).then_some(columns)
    }

    /// Factors of the differentials of slots from those of the states, by the Jacobian.
    fn by_jacobian(
        &self,
        columns: &[Vec<JacobianEntry<S>>],
        held: &[Option<TaylorSeries<S>>],
        n: usize,
    ) -> Vec<Option<TaylorSeries<S>>> {
        let of: Vec<Option<&[S::Element]>> = held.iter().map(|w| w.as_ref().map(|w| &w[..n])).collect();
        // the same keys at every order
        let mut keys = 0usize..;
        let mut lists = Vec::with_capacity(columns.len());
        for column in columns {
            let entries = column.iter().zip(&mut keys);
            lists.push(entries.map(|((row, series), key)| (*row, key, &series[..])).collect());
        }
        self.f.sums(&mut self.plan.borrow_mut(), &of, &lists, n)
    }

    /// Advances the differentials by one order.
    fn step(&mut self) {
        let (f, n) = (&self.f, self.length - self.order - 1);
        let next = |held: &Vec<Option<TaylorSeries<S>>>| {
            let seeds = held.iter().zip(&self.signals).filter_map(|(w, signal)| match (w, signal) {
                (Some(w), Signal::State { rate }) => Some((*rate, w[..n].to_vec())),
                _ => None,
            });
            let mut out = match &self.jacobian {
                Some(columns) => self.by_jacobian(columns, held, n),
                None => self.sweep(seeds.collect(), n),
            };
            for (next, w) in out.iter_mut().zip(held) {
                let Some(w) = w else { continue };
                let next = next.get_or_insert_with(|| vec![f.zero(); n]);
                for ((x, later), factor) in next.iter_mut().zip(&w[1..]).zip(&self.integers) {
                    *x = f.add(x, &f.mul(factor, later));
                }
            }
            out
        };
        let held = self.held.iter().map(next).collect();
        self.held = held;
        self.order += 1;
    }

    /// Values of the run, up to an order.
    pub(super) fn values_to(&mut self, order: usize) -> &Taylor<'a, S> {
        while self.values.length <= order {
            self.values.advance();
        }
        &self.values
    }

    /// Rows of an order, one for each output. Orders must not decrease from call to call.
    pub(super) fn rows(&mut self, order: usize) -> Vec<TaylorSeries<S>> {
        if order >= self.length {
            self.length = self.length_for(order);
            self.begin();
        }
        while self.order < order {
            self.step();
        }
        let f = &self.f;
        let row = |held: &Vec<Option<TaylorSeries<S>>>| {
            let mut row = vec![f.zero(); self.components];
            for ((w, signal), start) in held.iter().zip(&self.signals).zip(&self.initial) {
                let Some(w) = w else { continue };
                match signal {
                    Signal::Constant { component: Some(component), .. } => {
                        row[*component] = f.add(&row[*component], &w[0])
                    }
                    Signal::State { .. } => {
                        for (component, d) in start.iter().flat_map(|s| &s.1) {
                            row[*component] = f.add(&row[*component], &f.mul(&w[0], d));
                        }
                    }
                    _ => {}
                }
            }
            row
        };
        self.held.iter().map(row).collect()
    }

    /// Factors of the differentials of slots, from those of nodes, for the first `n` orders.
    fn sweep(&self, seeds: Vec<(usize, TaylorSeries<S>)>, n: usize) -> Vec<Option<TaylorSeries<S>>> {
        let f = &self.f;
        let mut left: Vec<Option<TaylorSeries<S>>> = vec![None; self.dag.ops.len()];
        let mut slots = vec![None; self.signals.len()];
        let last = seeds.iter().map(|s| s.0).max().unwrap_or(0);
        for (node, w) in seeds {
            self.put(&mut left[node], w);
        }
        for i in (0..=last).rev() {
            let Some(w) = left[i].take() else { continue };
            interrupt::check();
            if self.values.is_known(i) {
                continue;
            }
            match self.dag.ops[i] {
                Op::Number { .. } | Op::Pi => {}
                Op::Slot(s) => slots[s] = Some(w),
                Op::Add(a, b) => {
                    self.put(&mut left[a], w.clone());
                    self.put(&mut left[b], w);
                }
                Op::Subtract(a, b) => {
                    self.put(&mut left[b], w.iter().map(|x| f.neg(x)).collect());
                    self.put(&mut left[a], w);
                }
                Op::Multiply(a, b) => {
                    let known = |i: &usize| !self.values.is_known(*i);
                    let [a, b] = [(a, b), (b, a)].map(|(to, by)| Some(to).filter(known).map(|to| (to, by)));
                    let parts: Vec<(usize, usize)> = a.into_iter().chain(b).collect();
                    let factors: Vec<_> =
                        parts.iter().map(|&(_, by)| (3 * by, self.values.series(by))).collect();
                    for ((to, _), part) in parts.iter().zip(self.products(&w, &factors, n)) {
                        self.put(&mut left[*to], part);
                    }
                }
                Op::Divide(a, b) => {
                    let [by_a, by_b] =
                        [0, 1].map(|k| self.quotients[i].as_ref().map(|q| (3 * i + 1 + k, &q[k][..])));
                    let parts = [(a, by_a), (b, by_b)].into_iter().filter(|p| !self.values.is_known(p.0));
                    let (to, factors): (Vec<usize>, Vec<_>) =
                        parts.filter_map(|(to, factor)| Some((to, factor?))).unzip();
                    for (to, part) in to.into_iter().zip(self.products(&w, &factors, n)) {
                        self.put(&mut left[to], part);
                    }
                }
                Op::Primitive { of, weight, .. } => {
                    for part in self.products(&w, &[(3 * weight, self.values.series(weight))], n) {
                        self.put(&mut left[of], part);
                    }
                }
            }
        }
        slots
    }

    fn put(&self, place: &mut Option<TaylorSeries<S>>, w: TaylorSeries<S>) {
        match place {
            None => *place = Some(w),
            Some(sum) => sum.iter_mut().zip(&w).for_each(|(x, y)| *x = self.f.add(x, y)),
        }
    }

    /// First `n` coefficients of the products of a series with others, each with its own key; a constant is
    /// a series of length one.
    fn products(
        &self,
        w: &[S::Element],
        factors: &[(usize, &[S::Element])],
        n: usize,
    ) -> Vec<TaylorSeries<S>> {
        let f = &self.f;
        let series: Vec<_> =
            factors.iter().filter(|(_, b)| b.len() > 1).map(|&(key, b)| vec![(0, key, b)]).collect();
        let mut products = f.sums(&mut self.plan.borrow_mut(), &[Some(w)], &series, n).into_iter().flatten();
        let product = |&(_, b): &(usize, &[S::Element])| match *b {
            [factor] => Some(w[..n.min(w.len())].iter().map(|x| f.mul(x, &factor)).collect()),
            _ => products.next(),
        };
        factors.iter().filter_map(product).collect()
    }
}

/// First `n` coefficients of one over a series.
fn inverse<S: Values>(f: &S, b: &[S::Element], n: usize) -> TaylorSeries<S> {
    // no divisor is zero: otherwise the series would not exist
    let first = f.inverse(&b[0]).unwrap_or(f.zero());
    let mut out = vec![first];
    if b.len() == 1 {
        return out;
    }
    for k in 1..n {
        let known = (0..k).filter_map(|j| Some((&out[j], b.get(k - j)?)));
        out.push(f.neg(&f.mul(&first, &f.dot(&f.zero(), known))));
    }
    out
}

#[cfg(test)]
mod tests {
    use obsdeg_exact::{Field, RootField, Scalars, SplitMix64};

    use crate::system::model_file;
    use crate::system::rows::layout::Layout;
    use crate::system::rows::point::{PointBuilder, random_field};
    use crate::system::work::Work;

    /// Holds the rows of a model against duals in every node; returns true if a Jacobian was used.
    fn holds_against_forwards(text: &str, field: impl Fn(&mut SplitMix64) -> Field, orders: usize) -> bool {
        let model = model_file::read(text).expect("a model");
        let compiled = model.compile().expect("a graph");
        let layout = Layout::new(&model, &compiled, None);
        let mut rng = SplitMix64::new(5);
        let field = field(&mut rng);
        let work = Work::new(model.work_limit);
        let builder =
            PointBuilder { model: &model, compiled: &compiled, layout: &layout, field, work: &work };
        let (mut forward, mut adjoint) = builder.both(&mut rng);
        let mut factorial = field.one();
        for order in 0..orders {
            factorial = Scalars::mul(&field, &factorial, &field.integer((order as i64).max(1)));
            while forward.length <= order {
                forward.advance();
            }
            for (&output, row) in compiled.outputs(0).iter().zip(adjoint.rows(order)) {
                let mut expected = vec![0; layout.unknowns.len()];
                for (&component, x) in forward.components_of(output).iter().zip(forward.dual(output, order)) {
                    expected[component as usize] = Scalars::mul(&field, x, &factorial);
                }
                assert_eq!(row, expected, "order {order} of {text}");
            }
        }
        adjoint.jacobian.is_some()
    }

    /// The rows agree with duals in every node, to orders beyond the first length.
    #[test]
    fn the_same_as_forwards() {
        for text in [
            "[states]\nx='-a*x*z + u'\nz='x/(z + b)'\nw='w'\n[outputs]\ny='x*z'\nv='w + \
             t'\n[known_inputs]\nu='generic'\n",
            "[states]\nx={equation='a*sin(z)', initial='2*b'}\nz='exp(x) - \
             u*z/x'\n[outputs]\ny='x^3/z'\n[known_inputs]\nu={polynomial=1}\n",
            "[states]\nx='a/b'\nz='log(x + z)*tanh(a)'\n[outputs]\ny='z'\n",
        ] {
            holds_against_forwards(&format!("name='m'\nparameters=['a', 'b']\n{text}"), random_field, 12);
        }
    }

    /// The same for chains whose series are long enough to be transformed, at all sizes, with a Jacobian; and
    /// for a model whose Jacobian is full, without one.
    #[test]
    fn the_same_by_the_jacobian() {
        let n = 60;
        let states: String = (1..n).map(|i| format!("x{i}='a{i}*(x{} - x{i})*x{i} + u'\n", i - 1)).collect();
        let parameters: String = (0..n).map(|i| format!("a{i}={{}}\n")).collect();
        let text = |rate: &str| {
            format!(
                "name='m'\n[states]\nx0='{rate}'\n{states}[parameters]\n{parameters}[known_inputs]\nu='generic'\n\
                 [outputs]\ny='x{}'\nz='x1*a0'\n",
                n - 1
            )
        };
        let root = |rng: &mut SplitMix64| RootField::random(1 << 9, rng).expect("a field").field;
        assert!(holds_against_forwards(&text("-a0*x0*x0"), root, 140));
        let all: Vec<String> = (1..n).map(|i| format!("x{i}")).collect();
        let full: String = (0..n).map(|i| format!("x{i}='a{i}*x{i}*({})'\n", all.join(" + "))).collect();
        let full = format!("name='m'\n[states]\n{full}[parameters]\n{parameters}[outputs]\ny='x1'\n");
        assert!(!holds_against_forwards(&full, root, 20));
    }
}
