//! The unknowns of a rational system, one after the other.
//!
//! States are eliminated first: an equation that is linear in one gives it by all others, and its derivative is the
//! next equation (`d/dt` of the expression, less `f`). What is left holds parameters and signals only, at any time; it
//! and its derivatives are linear in the products of parameters that occur, and elimination over rational functions of
//! the signals shows which parameters stand alone.

use std::collections::BTreeMap;

use symbolica::prelude::*;

use super::JobError;
use super::tower::{Polynomial, Scalar, Tower, atom, degree};
use crate::protocol::RationalSystem;

/// An expression of more terms is followed no further.
const TERMS: usize = 150;
/// An equation with more products of parameters is too far from being solved.
const PRODUCTS: usize = 12;
/// What is put in for a state has at most so many.
const SUBSTITUTED: usize = 60;
/// A product of two expressions that may have more terms is not formed.
const PRODUCT: usize = 4000;

/// An equation `polynomial = 0`, and whether it holds at any time or at the start only.
struct Equation {
    zero: Scalar,
    at_any_time: bool,
}

/// How little an elimination is liked: divides by a parameter, by a signal, its order, its terms.
type Cost = (bool, bool, usize, usize);

struct Elimination<'a> {
    tower: &'a Tower,
    system: &'a RationalSystem,
    /// `f`, without the states that are gone.
    rates: Vec<Scalar>,
    /// What a state is in terms of what is left.
    solved: Vec<Option<Scalar>>,
    /// Symbols that time moves, with their derivatives.
    flow: Vec<(Symbol, Option<Scalar>)>,
}

fn to_atom(s: &Scalar) -> Atom {
    s.numerator.to_expression() / s.denominator.to_expression()
}

fn size(s: &Scalar) -> usize {
    s.numerator.nterms() + s.denominator.nterms()
}

/// One expression per state, then one per parameter; empty where there is none.
pub(crate) fn unknowns(tower: &Tower, system: &RationalSystem) -> Result<Vec<String>, JobError> {
    let n = system.states.len();
    if system.equations.len() != n {
        return Err(JobError::Shape { what: "dynamics", found: system.equations.len(), expected: n });
    }
    let all = n + system.parameters.len();
    if system.degrees.len() != all {
        return Err(JobError::Shape { what: "degrees", found: system.degrees.len(), expected: all });
    }
    let mut flow = Vec::new();
    let outputs = system.outputs.iter().map(|o| (&o.1, false));
    for (chain, ends) in outputs.chain(system.inputs.iter().map(|u| (&u.0, u.1))) {
        for pair in chain.windows(2) {
            flow.push((symbol!(&pair[0]), Some(tower.scalar(&pair[1])?)));
        }
        if let Some(last) = chain.last() {
            // the next derivative may have no name: what needs it is not followed
            let next = if ends { Some(tower.scalar("0")?) } else { None };
            flow.push((symbol!(last), next));
        }
    }
    if let Some(t) = &system.time {
        flow.push((symbol!(t), Some(tower.scalar("1")?)));
    }
    let mut work = Elimination {
        tower,
        system,
        rates: system.equations.iter().map(|e| tower.scalar(e)).collect::<Result<_, _>>()?,
        solved: vec![None; n],
        flow,
    };
    let mut equations = Vec::new();
    for (h, chain) in &system.outputs {
        let Some(y) = chain.first() else { continue };
        equations.push(work.equation(&tower.scalar(&format!("{y}-({h})"))?));
    }
    let mut relations = work.eliminate_states(equations)?;
    for (state, value) in &system.starts {
        if let Some(x) = &work.solved[*state] {
            let zero = &tower.scalar(value)? + &-x.clone();
            if !work.holds_state(&zero.numerator) {
                relations.push(Equation { zero: Scalar::from(zero.numerator), at_any_time: false });
            }
        }
    }
    let parameters = work.parameters(relations)?;
    let known: Vec<usize> = system.starts.iter().map(|s| s.0).collect();
    let mut out = Vec::new();
    for (i, expression) in work.solved.iter().chain(&parameters).enumerate() {
        let expression = expression.as_ref().filter(|_| !known.contains(&i) && system.degrees[i].is_some());
        let expression = expression.map(|e| work.without_unobservable(e, &parameters)).transpose()?;
        let kept = expression.filter(|e| work.is_solution(i, e));
        out.push(kept.map_or_else(String::new, |e| {
            (e.numerator.to_expression().factor() / e.denominator.to_expression().factor()).to_string()
        }));
    }
    Ok(out)
}

impl Elimination<'_> {
    fn state(&self, i: usize) -> usize {
        self.tower.place(&self.system.states[i])
    }

    fn holds(&self, p: &Polynomial, name: &str) -> bool {
        degree(p, self.tower.place(name)) > 0
    }

    fn holds_state(&self, p: &Polynomial) -> bool {
        self.system.states.iter().any(|s| self.holds(p, s))
    }

    fn equation(&self, zero: &Scalar) -> Equation {
        Equation { zero: Scalar::from(zero.numerator.clone()), at_any_time: true }
    }

    /// `d/dt` along the flow; `None` when it needs a derivative without a name.
    fn derivative(&self, s: &Scalar) -> Result<Option<Scalar>, JobError> {
        let expression = to_atom(s);
        let mut sum = self.tower.scalar("0")?;
        let states = self.system.states.iter().zip(&self.rates).map(|(s, f)| (symbol!(s), Some(f.clone())));
        for (symbol, rate) in states.chain(self.flow.iter().cloned()) {
            let slope = expression.derivative(symbol);
            if slope.is_zero() {
                continue;
            }
            let Some(rate) = rate else { return Ok(None) };
            sum = &sum + &(&self.tower.scalar_of(&slope)? * &rate);
        }
        Ok(Some(sum))
    }

    /// The order of the outputs' derivatives in it.
    fn order(&self, s: &Scalar) -> usize {
        let chains = self.system.outputs.iter().map(|o| &o.1);
        let highest = |chain: &Vec<String>| {
            chain
                .iter()
                .rposition(|y| self.holds(&s.numerator, y) || self.holds(&s.denominator, y))
                .unwrap_or(0)
        };
        chains.map(highest).max().unwrap_or(0)
    }

    /// Eliminates states by equations that are linear in them; what is left of the equations without any.
    fn eliminate_states(&mut self, mut equations: Vec<Equation>) -> Result<Vec<Equation>, JobError> {
        loop {
            let mut best: Option<(Cost, usize, usize, Scalar)> = None;
            for (e, equation) in equations.iter().enumerate() {
                for v in 0..self.system.states.len() {
                    let Some((slope, rest)) = linear(&equation.zero.numerator, self.state(v)) else {
                        continue;
                    };
                    if self.holds_state(&slope) || rest.nterms() + slope.nterms() > SUBSTITUTED {
                        continue;
                    }
                    let unknown = self.system.parameters.iter().any(|p| self.holds(&slope, p));
                    let cost = (unknown, !slope.is_constant(), self.order(&equation.zero), rest.nterms());
                    if best.as_ref().is_none_or(|b| cost < b.0) {
                        let x = &-Scalar::from(rest) * &Scalar::from(slope).inv();
                        best = Some((cost, e, v, x));
                    }
                }
            }
            let Some((_, e, v, x)) = best else { break };
            equations.swap_remove(e);
            let name = atom(&self.system.states[v])?;
            let put = |s: &Scalar| -> Result<Scalar, JobError> {
                let replaced = to_atom(s).replace(name.clone()).with(to_atom(&x));
                self.tower.scalar_of(&replaced)
            };
            let rates = self.rates.iter().map(put).collect::<Result<Vec<_>, _>>()?;
            let solved: Vec<Option<Scalar>> =
                self.solved.iter().map(|s| s.as_ref().map(put).transpose()).collect::<Result<_, _>>()?;
            for equation in &mut equations {
                equation.zero = Scalar::from(put(&equation.zero)?.numerator);
            }
            (self.rates, self.solved) = (rates, solved);
            let rate = self.rates[v].clone();
            if let Some(slope) = self.derivative(&x)? {
                equations.push(self.equation(&(&slope + &-rate)));
            }
            self.solved[v] = Some(x);
            equations.retain(|e| !e.zero.is_zero() && size(&e.zero) < TERMS);
        }
        equations.retain(|e| !self.holds_state(&e.zero.numerator));
        Ok(equations)
    }

    /// The parameters that stand alone in the relations, at the lowest order. Beyond its degree a parameter counts as known at
    /// first, since others may be solved by it, and then as open.
    fn parameters(&self, relations: Vec<Equation>) -> Result<Vec<Option<Scalar>>, JobError> {
        let n = self.system.states.len();
        let degrees = &self.system.degrees[n..];
        let mut found: Vec<Option<Scalar>> = vec![None; self.system.parameters.len()];
        let beyond = self.system.beyond;
        let highest = degrees.iter().flatten().copied().max().unwrap_or(0) + beyond;
        // by order; a relation is differentiated when its turn comes
        let mut waiting: Vec<(usize, Equation)> =
            relations.into_iter().map(|r| (self.order(&r.zero), r)).collect();
        let mut pool: Vec<Scalar> = Vec::new();
        for order in 0..=highest {
            let (now, later) = waiting.into_iter().partition(|w| w.0 <= order);
            waiting = later;
            let now: Vec<(usize, Equation)> = now;
            for (_, equation) in now {
                if size(&equation.zero) > TERMS {
                    continue;
                }
                if equation.at_any_time
                    && let Some(next) = self.derivative(&equation.zero)?.filter(|d| !d.is_zero())
                {
                    let next = self.equation(&next);
                    waiting.push((self.order(&next.zero).max(order + 1), next));
                }
                pool.push(equation.zero);
            }
            loop {
                let open = |beyond: usize| -> Vec<usize> {
                    let left = |p: &usize| {
                        found[*p].is_none()
                            && !self.system.free.contains(p)
                            && degrees[*p].is_none_or(|d| d + beyond >= order)
                    };
                    (0..found.len()).filter(left).collect()
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
                    found[p] = Some(self.without_unobservable(&value, &found)?);
                }
            }
        }
        Ok(found)
    }

    /// The expression with what is not observable, but found once a free parameter is given, replaced: with it the free
    /// one goes too.
    fn without_unobservable(&self, value: &Scalar, found: &[Option<Scalar>]) -> Result<Scalar, JobError> {
        let n = self.system.states.len();
        let mut expression = to_atom(value);
        for (p, known) in found.iter().enumerate().filter(|(p, _)| self.system.degrees[n + p].is_none()) {
            if let Some(known) = known {
                expression = expression.replace(atom(&self.system.parameters[p])?).with(to_atom(known));
            }
        }
        self.tower.scalar_of(&expression)
    }

    /// Reduces the equations as linear ones in the products of the open parameters.
    fn standing_alone(&self, pool: &[Scalar], open: &[usize]) -> Result<Vec<(usize, Scalar)>, JobError> {
        let places: Vec<usize> = open.iter().map(|&p| self.tower.place(&self.system.parameters[p])).collect();
        type Row = BTreeMap<Vec<u16>, Scalar>;
        let mut rows: Vec<Row> = Vec::new();
        for equation in pool {
            let mut row = Row::new();
            for (powers, coefficient) in split(&equation.numerator, &places) {
                row.insert(powers, Scalar::from(coefficient));
            }
            rows.push(row);
        }
        let total = |powers: &[u16]| powers.iter().map(|&e| u32::from(e)).sum::<u32>();
        let mut done: Vec<(Vec<u16>, Row)> = Vec::new();
        loop {
            rows.retain(|r| !r.is_empty());
            // products go first, so that what is left is linear; of these the simplest pivot
            if rows.iter().any(|r| r.len() > PRODUCTS) {
                return Ok(Vec::new());
            }
            let pivot = (rows.iter().enumerate())
                .flat_map(|(i, row)| row.iter().map(move |(powers, c)| (i, powers, c, row.len())))
                .filter(|(_, powers, ..)| total(powers) > 0)
                .min_by_key(|(_, powers, c, len)| (std::cmp::Reverse(total(powers)), size(c), *len));
            let Some((i, powers, c, _)) = pivot else { break };
            let (powers, inverse) = (powers.clone(), c.clone().inv());
            let row: Row = rows.swap_remove(i).into_iter().map(|(k, c)| (k, &c * &inverse)).collect();
            for other in rows.iter_mut().chain(done.iter_mut().map(|d| &mut d.1)) {
                let Some(factor) = other.get(&powers).map(|c| -c.clone()) else { continue };
                for (k, c) in &row {
                    if size(&factor) * size(c) > PRODUCT {
                        return Ok(Vec::new());
                    }
                    let sum = match other.get(k) {
                        Some(old) => old + &(&factor * c),
                        None => &factor * c,
                    };
                    if size(&sum) > TERMS {
                        return Ok(Vec::new());
                    }
                    if sum.is_zero() {
                        other.remove(k);
                    } else {
                        other.insert(k.clone(), sum);
                    }
                }
            }
            done.push((powers, row));
        }
        let mut out = Vec::new();
        for (powers, row) in done {
            let alone = row.keys().all(|k| *k == powers || total(k) == 0);
            if total(&powers) == 1
                && alone
                && let Some(place) = powers.iter().position(|&e| e == 1)
            {
                let constant = vec![0; powers.len()];
                let value = row.get(&constant).map(|c| -c.clone());
                out.push((open[place], value.map_or_else(|| self.tower.scalar("0"), Ok)?));
            }
        }
        Ok(out)
    }

    /// Whether an expression holds no unknown of a higher degree than the unknown itself, and no derivative of an order
    /// too far beyond it.
    fn is_solution(&self, unknown: usize, e: &Scalar) -> bool {
        let Some(degree) = self.system.degrees[unknown] else { return false };
        let names = self.system.states.iter().chain(&self.system.parameters);
        let fits = |(name, d): (&String, &Option<usize>)| {
            !(self.holds(&e.numerator, name) || self.holds(&e.denominator, name))
                || d.is_some_and(|d| d <= degree)
        };
        self.order(e) <= degree + self.system.beyond && names.zip(&self.system.degrees).all(fits)
    }
}

/// `(a, b)` with `p = a v + b`, where `v` occurs to the first power.
fn linear(p: &Polynomial, variable: usize) -> Option<(Polynomial, Polynomial)> {
    if degree(p, variable) != 1 {
        return None;
    }
    let mut parts = split(p, &[variable]).into_iter();
    let (rest, slope) = match (parts.next(), parts.next()) {
        (Some((k, slope)), None) if k == [1] => (p.zero(), slope),
        (Some((_, rest)), Some((_, slope))) => (rest, slope),
        _ => return None,
    };
    Some((slope, rest))
}

/// A polynomial by its powers of some variables: the powers and what they are multiplied with.
fn split(p: &Polynomial, variables: &[usize]) -> BTreeMap<Vec<u16>, Polynomial> {
    let mut out: BTreeMap<Vec<u16>, Polynomial> = BTreeMap::new();
    for term in p {
        let powers = variables.iter().map(|&v| term.exponents[v]).collect();
        let mut exponents = term.exponents.to_vec();
        for &v in variables {
            exponents[v] = 0;
        }
        out.entry(powers).or_insert_with(|| p.zero()).append_monomial(term.coefficient.clone(), &exponents);
    }
    out
}
