//! Unknowns of a rational system, one after the other, by elimination over a prime field.
//!
//! States are eliminated first. An equation that is linear in a state gives the state by all other
//! variables; its derivative is the next equation. The remaining equations contain parameters and signals
//! and hold at any time. They and their derivatives are linear in the products of parameters that occur.
//! Elimination over rational functions of the signals finds the parameters that are determined alone.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use obsdeg_exact::divisor::Algebra;
use obsdeg_exact::fraction::Fraction;
use obsdeg_exact::groebner::OverLimit;
use obsdeg_exact::multivariate::{Monomial, Polynomial};

/// Largest number of terms of an equation that is used.
const TERMS: usize = 150;
/// Largest number of products of parameters in an equation that is solved.
const PRODUCTS: usize = 12;
/// Largest number of terms of an expression that replaces a state.
const SUBSTITUTED: usize = 60;
/// Largest number of terms of a product before like terms are added.
const PRODUCT: usize = 4000;

/// A system `x' = f`, `y = h` in numbered variables: states, parameters, and signals with their derivatives.
pub(super) struct EliminationSystem {
    /// Variables of the states.
    pub(super) states: Vec<u32>,
    /// `f`, one per state.
    pub(super) rates: Vec<Fraction>,
    /// Variables of the unknown constants.
    pub(super) parameters: Vec<u32>,
    /// `h` of every output, with the variables of `y, y', y'', ...`.
    pub(super) outputs: Vec<(Fraction, Vec<u32>)>,
    /// Variables of `u, u', ...` of every known input; true if the derivatives beyond vanish.
    pub(super) inputs: Vec<(Vec<u32>, bool)>,
    /// Variable of the time, if it occurs.
    pub(super) time: Option<u32>,
    /// Known starts: state and variable of its value.
    pub(super) starts: Vec<(usize, u32)>,
    /// Degree of every state, then of every parameter.
    pub(super) degrees: Vec<Option<usize>>,
    /// Orders beyond its degree to which an expression may go.
    pub(super) beyond: usize,
    /// Parameters to which a symmetry may give any value: no observable unknown depends on them.
    pub(super) free: Vec<usize>,
}

/// Equation `polynomial = 0`, at any time or at the start only.
struct PolynomialEquation {
    zero: Polynomial,
    at_any_time: bool,
}

/// Cost of an elimination, compared in this order: division by a parameter, division by a signal, order,
/// number of terms.
type EliminationCost = (bool, bool, usize, usize);

/// Equation that is linear in products of parameters: their coefficients.
type PolynomialRow = BTreeMap<Monomial, Fraction>;

/// Subtracts the multiple of `row`, whose coefficient of `m` is one, that removes `m` from `other`. False if
/// a coefficient is beyond the limits of its size.
fn subtract_multiple(
    s: &mut Algebra,
    other: &mut PolynomialRow,
    m: &Monomial,
    row: &PolynomialRow,
) -> Result<bool, OverLimit> {
    let Some(factor) = other.get(m).map(|c| s.minus(c)) else { return Ok(true) };
    for (k, c) in row {
        if factor.terms() * c.terms() > PRODUCT {
            return Ok(false);
        }
        let mut sum = s.times(&factor, c)?;
        if let Some(old) = other.get(k) {
            sum = s.sum(old, &sum)?;
        }
        if sum.terms() > TERMS {
            return Ok(false);
        }
        if sum.is_zero() {
            other.remove(k);
        } else {
            other.insert(k.clone(), sum);
        }
    }
    Ok(true)
}

/// Derivative of an output or of a known input.
struct SignalDerivative {
    /// Order of the derivative; 0 for known inputs, which need no derivative of an output.
    order: usize,
    /// Variable of the next derivative; `None` if it has none.
    next: Option<u32>,
    /// True if derivatives without a variable vanish.
    ends: bool,
}

/// Derivative of a variable: zero, an expression, or a derivative without a variable.
enum TimeDerivative {
    Zero,
    Is(Fraction),
    Nameless,
}

struct Elimination<'a> {
    s: &'a mut Algebra,
    system: &'a EliminationSystem,
    /// Rates `f`, without the eliminated states.
    rates: Vec<Fraction>,
    /// Expressions of the eliminated states, in the remaining variables.
    solved: Vec<Option<Fraction>>,
    /// Expressions of the parameters that were found.
    found: Vec<Option<Fraction>>,
    /// Index of the state, by variable.
    states: BTreeMap<u32, usize>,
    /// Outputs and known inputs with their derivatives, by variable.
    signals: BTreeMap<u32, SignalDerivative>,
}

/// Expressions of the states, then of the parameters, and true if all were sought within the limit of work.
pub(super) fn eliminate(s: &mut Algebra, system: &EliminationSystem) -> (Vec<Option<Fraction>>, bool) {
    let mut work = Elimination {
        s,
        system,
        rates: system.rates.clone(),
        solved: vec![None; system.states.len()],
        found: vec![None; system.parameters.len()],
        states: system.states.iter().enumerate().map(|(i, &v)| (v, i)).collect(),
        signals: signals(system),
    };
    let ended = work.run();
    let mut complete = ended.is_ok();
    let known: Vec<usize> = system.starts.iter().map(|s| s.0).collect();
    let all: Vec<Option<Fraction>> = work.solved.iter().chain(&work.found).cloned().collect();
    let mut out = Vec::new();
    for (i, expression) in all.into_iter().enumerate() {
        let sought = !known.contains(&i) && system.degrees[i].is_some();
        let expression = expression.filter(|_| sought).map(|e| work.without_unobservable(&e));
        complete &= !matches!(expression, Some(Err(_)));
        out.push(expression.and_then(Result::ok).filter(|e| work.is_solution(i, e)));
    }
    (out, complete)
}

/// Outputs and known inputs with their derivatives, by variable.
fn signals(system: &EliminationSystem) -> BTreeMap<u32, SignalDerivative> {
    let outputs = system.outputs.iter().map(|(_, chain)| (chain, false, true));
    let inputs = system.inputs.iter().map(|(chain, ends)| (chain, *ends, false));
    let mut out = BTreeMap::new();
    for (chain, ends, counts) in outputs.chain(inputs) {
        for (k, &v) in chain.iter().enumerate() {
            let order = if counts { k } else { 0 };
            out.entry(v).or_insert(SignalDerivative { order, next: chain.get(k + 1).copied(), ends });
        }
    }
    out
}

impl Elimination<'_> {
    fn run(&mut self) -> Result<(), OverLimit> {
        let (mut equations, system) = (Vec::new(), self.system);
        for (h, chain) in &system.outputs {
            let Some(&y) = chain.first() else { continue };
            let y = self.s.whole(Polynomial::variable(&self.s.f, y));
            let minus = self.s.minus(h);
            equations.push(PolynomialEquation { zero: self.s.sum(&y, &minus)?.numerator, at_any_time: true });
        }
        let mut relations = self.eliminate_states(equations)?;
        for &(state, value) in &system.starts {
            if let Some(x) = &self.solved[state] {
                let value = self.s.whole(Polynomial::variable(&self.s.f, value));
                let minus = self.s.minus(x);
                let zero = self.s.sum(&value, &minus)?.numerator;
                if !self.holds_state(&zero) {
                    relations.push(PolynomialEquation { zero, at_any_time: false });
                }
            }
        }
        self.parameters(relations)
    }

    fn holds_state(&self, p: &Polynomial) -> bool {
        p.variables().iter().any(|v| self.states.contains_key(v))
    }

    /// Derivative of a variable by time.
    fn rate(&self, v: u32) -> TimeDerivative {
        if let Some(&i) = self.states.get(&v) {
            return TimeDerivative::Is(self.rates[i].clone());
        }
        if let Some(signal) = self.signals.get(&v) {
            return match signal.next {
                Some(next) => TimeDerivative::Is(self.s.whole(Polynomial::variable(&self.s.f, next))),
                None if signal.ends => TimeDerivative::Zero,
                None => TimeDerivative::Nameless,
            };
        }
        match self.system.time == Some(v) {
            true => TimeDerivative::Is(self.s.whole(Polynomial::constant(self.s.f.one()))),
            false => TimeDerivative::Zero,
        }
    }

    /// Derivative `d/dt` along the motion; `None` if it needs a derivative without a variable.
    fn derivative(&mut self, p: &Polynomial) -> Result<Option<Fraction>, OverLimit> {
        let mut sum = self.s.whole(Polynomial::default());
        for v in p.variables() {
            let rate = match self.rate(v) {
                TimeDerivative::Zero => continue,
                TimeDerivative::Nameless => return Ok(None),
                TimeDerivative::Is(rate) => rate,
            };
            let slope = self.s.whole(p.derivative(&self.s.f, v));
            let part = self.s.times(&slope, &rate)?;
            sum = self.s.sum(&sum, &part)?;
        }
        Ok(Some(sum))
    }

    /// Order of the outputs' derivatives in a polynomial.
    fn order(&self, p: &Polynomial) -> usize {
        p.variables().iter().filter_map(|v| self.signals.get(v)).map(|s| s.order).max().unwrap_or(0)
    }

    /// Equation that is linear in a state at the least cost: its index, the state, and the state's
    /// expression.
    fn best(
        &mut self,
        equations: &[PolynomialEquation],
    ) -> Result<Option<(usize, usize, Fraction)>, OverLimit> {
        let mut best: Option<(EliminationCost, usize, usize, [Polynomial; 2])> = None;
        // slope and rest together have as many terms as the equation
        let short = |e: &(usize, &PolynomialEquation)| e.1.zero.len() <= SUBSTITUTED;
        for (e, equation) in equations.iter().enumerate().filter(short) {
            let occurring: BTreeSet<usize> =
                equation.zero.variables().iter().filter_map(|v| self.states.get(v)).copied().collect();
            for i in occurring {
                let Some([slope, rest]) = linear(&equation.zero, self.system.states[i]) else { continue };
                if self.holds_state(&slope) {
                    continue;
                }
                let unknown = self.system.parameters.iter().any(|&p| slope.terms_with(p) > 0);
                let order = self.order(&equation.zero);
                let cost = (unknown, slope.as_constant().is_none(), order, rest.len());
                if best.as_ref().is_none_or(|b| cost < b.0) {
                    best = Some((cost, e, i, [slope, rest]));
                }
            }
        }
        let Some((_, e, i, [slope, rest])) = best else { return Ok(None) };
        let minus = self.s.f.neg(self.s.f.one());
        let x = self.s.fraction(&rest.scaled(&self.s.f, minus), &slope)?;
        Ok(Some((e, i, x)))
    }

    /// Eliminates states by equations that are linear in them. Returns the remaining equations, which
    /// contain no state.
    fn eliminate_states(
        &mut self,
        mut equations: Vec<PolynomialEquation>,
    ) -> Result<Vec<PolynomialEquation>, OverLimit> {
        while let Some((e, i, x)) = self.best(&equations)? {
            let v = self.system.states[i];
            equations.swap_remove(e);
            // the equation without its common factor; its derivative, before anything is substituted
            let mut own = self.s.product(&Polynomial::variable(&self.s.f, v), &x.denominator)?;
            own.add_scaled(&self.s.f, &x.numerator, self.s.f.neg(self.s.f.one()));
            let next = self.derivative(&own)?;
            let put = |s: &mut Algebra, a: &Fraction| s.replaced(a, v, &x)?.ok_or(OverLimit);
            let below = x.denominator.clone();
            for k in 0..self.rates.len() {
                self.rates[k] = put(self.s, &self.rates[k])?;
                if let Some(own) = &self.solved[k] {
                    self.solved[k] = Some(put(self.s, own)?);
                }
            }
            equations.extend(next.map(|d| PolynomialEquation { zero: d.numerator, at_any_time: true }));
            for equation in &mut equations {
                if equation.zero.terms_with(v) > 0 {
                    let zero = self.s.put_into(&equation.zero, v, &x)?.numerator;
                    equation.zero = self.without(zero, &below)?;
                }
            }
            self.solved[i] = Some(x);
            equations.retain(|e| !e.zero.is_empty() && e.zero.len() < TERMS);
        }
        equations.retain(|e| !self.holds_state(&e.zero));
        Ok(equations)
    }

    /// A polynomial without the factors that it shares with a non-zero one.
    fn without(&mut self, p: Polynomial, factors: &Polynomial) -> Result<Polynomial, OverLimit> {
        let mut rest = p;
        while !rest.is_empty() {
            let common = self.s.divisor(&rest, factors)?;
            if common.as_constant().is_some() {
                break;
            }
            rest = self.s.quotient(&rest, &common)?.ok_or(OverLimit)?;
        }
        Ok(rest)
    }

    /// Finds parameters that are determined alone by the relations, at the lowest order. Beyond its degree a
    /// parameter counts as known at first, since others may be solved by it, and then as open.
    fn parameters(&mut self, relations: Vec<PolynomialEquation>) -> Result<(), OverLimit> {
        let system = self.system;
        let (degrees, beyond) = (&system.degrees[system.states.len()..], system.beyond);
        let highest = degrees.iter().flatten().copied().max().unwrap_or(0) + beyond;
        // sorted by order; a relation is differentiated when its turn comes
        let mut waiting: Vec<(usize, PolynomialEquation)> =
            relations.into_iter().map(|r| (self.order(&r.zero), r)).collect();
        let mut pool: Vec<Polynomial> = Vec::new();
        for order in 0..=highest {
            let (now, later): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|w| w.0 <= order);
            waiting = later;
            for (_, equation) in now {
                if equation.zero.len() > TERMS {
                    continue;
                }
                if equation.at_any_time
                    && let Some(next) = self.derivative(&equation.zero)?.filter(|d| !d.is_zero())
                {
                    let next = PolynomialEquation { zero: next.numerator, at_any_time: true };
                    waiting.push((self.order(&next.zero).max(order + 1), next));
                }
                pool.push(equation.zero);
            }
            loop {
                let open = |beyond: usize| -> Vec<usize> {
                    let left = |p: &usize| {
                        self.found[*p].is_none()
                            && !self.system.free.contains(p)
                            && degrees[*p].is_none_or(|d| d + beyond >= order)
                    };
                    (0..self.found.len()).filter(left).collect()
                };
                let (now, more) = (open(0), open(beyond));
                let mut new = self.standing_alone(&pool, &now)?;
                if new.is_empty() && more != now {
                    new = self.standing_alone(&pool, &more)?;
                }
                if new.is_empty() {
                    break;
                }
                for (p, value) in new {
                    self.found[p] = Some(self.without_unobservable(&value)?);
                }
            }
        }
        Ok(())
    }

    /// The expression with unobservable parameters replaced, if they are determined by a free parameter: the
    /// free parameter cancels.
    fn without_unobservable(&mut self, value: &Fraction) -> Result<Fraction, OverLimit> {
        let n = self.system.states.len();
        let mut out = value.clone();
        for p in (0..self.found.len()).filter(|p| self.system.degrees[n + p].is_none()) {
            if let Some(known) = &self.found[p] {
                out = self.s.replaced(&out, self.system.parameters[p], known)?.ok_or(OverLimit)?;
            }
        }
        Ok(out)
    }

    /// Reduces the equations as linear ones in the products of the open parameters. Returns the parameters
    /// that are determined alone.
    fn standing_alone(
        &mut self,
        pool: &[Polynomial],
        open: &[usize],
    ) -> Result<Vec<(usize, Fraction)>, OverLimit> {
        let places: Vec<u32> = open.iter().map(|&p| self.system.parameters[p]).collect();
        let mut rows: Vec<PolynomialRow> = Vec::new();
        for zero in pool {
            let parts = by_products(&self.s.f, zero, &places);
            rows.push(parts.into_iter().map(|(m, c)| (m, self.s.whole(c))).collect());
        }
        let total = |m: &Monomial| m.iter().map(|x| x.1).sum::<u32>();
        let mut done: Vec<(Monomial, PolynomialRow)> = Vec::new();
        loop {
            rows.retain(|r| !r.is_empty());
            // eliminate products first, so that the rest is linear; of these choose the simplest pivot
            if rows.iter().any(|r| r.len() > PRODUCTS) {
                return Ok(Vec::new());
            }
            let pivot = (rows.iter().enumerate())
                .flat_map(|(i, row)| row.iter().map(move |(m, c)| (i, m, c, row.len())))
                .filter(|(_, m, ..)| total(m) > 0)
                .min_by_key(|(_, m, c, len)| (Reverse(total(m)), c.terms(), *len));
            let Some((i, m, c, _)) = pivot else { break };
            let (m, inverse) = (m.clone(), self.s.inverse(c));
            let mut row = PolynomialRow::new();
            for (k, c) in rows.swap_remove(i) {
                row.insert(k, self.s.times(&c, &inverse)?);
            }
            for other in rows.iter_mut().chain(done.iter_mut().map(|d| &mut d.1)) {
                if !subtract_multiple(self.s, other, &m, &row)? {
                    return Ok(Vec::new());
                }
            }
            done.push((m, row));
        }
        let mut out = Vec::new();
        for (m, row) in done {
            let alone = row.keys().all(|k| *k == m || k.is_empty());
            let place = open.iter().find(|&&p| m == [(self.system.parameters[p], 1)]);
            if let Some(&p) = place.filter(|_| alone) {
                let zero = self.s.whole(Polynomial::default());
                out.push((p, row.get(&Monomial::new()).map_or(zero, |c| self.s.minus(c))));
            }
        }
        Ok(out)
    }

    /// True if an expression contains no unknown of a higher degree than its own, and no derivative of an
    /// order too far beyond its degree.
    fn is_solution(&self, unknown: usize, e: &Fraction) -> bool {
        let Some(degree) = self.system.degrees[unknown] else { return false };
        let variables = self.system.states.iter().chain(&self.system.parameters);
        let fits = |(&v, d): (&u32, &Option<usize>)| !e.holds(v) || d.is_some_and(|d| d <= degree);
        self.order(&e.numerator).max(self.order(&e.denominator)) <= degree + self.system.beyond
            && variables.zip(&self.system.degrees).all(fits)
    }
}

/// Coefficients `[a, b]` of `p = a v + b`; `None` unless `v` occurs to the first power.
fn linear(p: &Polynomial, v: u32) -> Option<[Polynomial; 2]> {
    if p.degree_in(v) != 1 {
        return None;
    }
    let mut parts = p.split(v);
    let slope = parts.remove(&1)?;
    Some([slope, parts.remove(&0).unwrap_or_default()])
}

/// Coefficients of a polynomial by the products of some variables in it.
fn by_products(f: &obsdeg_exact::Field, p: &Polynomial, variables: &[u32]) -> BTreeMap<Monomial, Polynomial> {
    let mut out: BTreeMap<Monomial, Polynomial> = BTreeMap::new();
    for (m, c) in p.terms() {
        let (inside, outside): (Monomial, Monomial) = m.iter().partition(|x| variables.contains(&x.0));
        out.entry(inside).or_default().put(f, outside, c);
    }
    out
}
