//! Derivatives of identifiable functions along the motion, which are identifiable too: polynomials in the
//! factors, in which powers may be negative, split by the products of the inputs.

use std::collections::BTreeMap;

use obsdeg_exact::multivariate::{Monomial, Polynomial};
use obsdeg_exact::{Field, Scalars};

use super::dag::Op;
use super::function_factors::ModelFactors;
use super::judge::verdicts::Judgement;
use super::model::compiled::{Compiled, Role};
use super::model::{KnownInput, SystemModel};
use super::quotients::{QuotientPowers, QuotientTerms};
use super::rows::layout::Unknown;
use super::values::Values;

/// Largest number of terms of a polynomial that is formed, and of a function that is returned.
const FORMED: usize = 2000;
const GIVEN: usize = 40;
/// Largest number of terms of the polynomials of all nodes together.
const ALL: usize = 500_000;
/// Largest exponent of a polynomial that is formed.
const EXPONENT: i32 = 1000;

/// Sum of products of powers with coefficients in a prime field, none of which is zero.
pub(super) type LaurentPolynomial = BTreeMap<QuotientPowers, u64>;

/// Adds `c a b` to a sum; `None` if there are too many terms.
fn add_product(
    f: &Field,
    sum: &mut LaurentPolynomial,
    a: &LaurentPolynomial,
    b: &LaurentPolynomial,
    c: u64,
) -> Option<()> {
    if a.len() * b.len() > FORMED {
        return None;
    }
    for (first, x) in a {
        for (second, y) in b {
            let entry = sum.entry(multiplied(first, second)?).or_insert(0);
            *entry = f.add(*entry, f.mul(c, f.mul(*x, *y)));
        }
    }
    sum.retain(|_, x| *x != 0);
    (sum.len() <= FORMED).then_some(())
}

/// Product of two products of powers; `None` if an exponent is too large.
fn multiplied(a: &[(usize, i32)], b: &[(usize, i32)]) -> Option<QuotientPowers> {
    let mut out = a.to_vec();
    for &(v, e) in b {
        match out.iter_mut().find(|p| p.0 == v) {
            Some(own) => own.1 += e,
            None => out.push((v, e)),
        }
    }
    out.retain(|p| p.1 != 0);
    out.sort_unstable();
    out.iter().all(|p| p.1.abs() <= EXPONENT).then_some(out)
}

fn constant(f: &Field, c: u64) -> LaurentPolynomial {
    let one = LaurentPolynomial::from([(Vec::new(), c)]);
    if f.is_zero(&c) { LaurentPolynomial::new() } else { one }
}

/// Polynomial that is one variable.
pub(super) fn variable(f: &Field, v: usize) -> LaurentPolynomial {
    LaurentPolynomial::from([(vec![(v, 1)], f.one())])
}

/// Rates of change of the factors of a model, where they are polynomials in factors and inputs.
pub(super) struct FactorRates {
    f: Field,
    /// Rate of change by factor; `None` if it is no such polynomial.
    rates: Vec<Option<LaurentPolynomial>>,
    /// Number of the factors; inputs that are not constant have the numbers after them.
    factors: usize,
    /// Outputs that are such polynomials.
    pub(super) outputs: Vec<LaurentPolynomial>,
}

impl FactorRates {
    /// The motion of an experiment of a model: states of the others stand still.
    pub(super) fn new(
        system: (&SystemModel, &Compiled, &Judgement),
        factors: &ModelFactors,
        f: Field,
        experiment: usize,
    ) -> Self {
        let (model, compiled, judged) = system;
        let layout = &judged.layout;
        let nodes = nodes(system, factors, &f, experiment);
        let next = |u: &Unknown| {
            let is_next = |other: &Unknown| {
                (other.role, other.experiment) == (u.role, u.experiment)
                    && other.derivative == u.derivative + 1
            };
            layout.unknowns.iter().position(is_next)
        };
        let rate = |u: &Unknown| match u.role {
            _ if u.experiment.is_some_and(|e| e != experiment) => Some(LaurentPolynomial::new()),
            Role::State(s) => nodes[compiled.rates(experiment)[s]].clone(),
            Role::UnknownInput(i) => match next(u) {
                Some(next) => Some(variable(&f, next)),
                None => model.unknown_inputs[i].1.map(|_| LaurentPolynomial::new()),
            },
            _ => Some(LaurentPolynomial::new()),
        };
        let mut rates: Vec<Option<LaurentPolynomial>> = layout.unknowns.iter().map(rate).collect();
        rates.resize(factors.unknowns + factors.constants, Some(LaurentPolynomial::new()));
        rates.extend(factors.inputs.iter().map(|&(i, order)| {
            Some(
                factors.of_input(i, order + 1).map_or_else(LaurentPolynomial::new, |next| variable(&f, next)),
            )
        }));
        for own in &factors.functions {
            let weight = match compiled.dag.ops[own.node] {
                Op::Primitive { weight, .. } => nodes[weight].as_ref(),
                _ => None,
            };
            let product = weight.zip(rates[own.unknown].as_ref()).and_then(|(weight, rate)| {
                let mut product = LaurentPolynomial::new();
                add_product(&f, &mut product, weight, rate, f.one())?;
                Some(product)
            });
            rates.push(product);
        }
        let outputs = compiled.outputs(experiment).iter().filter_map(|&o| nodes[o].clone()).collect();
        Self { f, rates, factors: factors.len(), outputs }
    }

    /// Derivative of a polynomial in the factors; `None` if it is not formed.
    pub(super) fn derivative(&self, p: &LaurentPolynomial) -> Option<LaurentPolynomial> {
        let f = &self.f;
        let mut out = LaurentPolynomial::new();
        for (powers, &x) in p {
            for &(v, e) in powers {
                let rate = self.rates[v].as_ref()?;
                let lower = LaurentPolynomial::from([(multiplied(powers, &[(v, -1)])?, x)]);
                add_product(f, &mut out, &lower, rate, f.from_i64(e.into()))?;
            }
        }
        Some(out)
    }

    /// Coefficients of a polynomial by the products of inputs: products of powers of factors.
    pub(super) fn coefficients(&self, p: &LaurentPolynomial) -> Vec<LaurentPolynomial> {
        let mut parts: BTreeMap<QuotientPowers, LaurentPolynomial> = BTreeMap::new();
        for (powers, &x) in p {
            let (own, inputs): (Vec<_>, Vec<_>) = powers.iter().partition(|p| p.0 < self.factors);
            parts.entry(inputs).or_default().insert(own, x);
        }
        parts.into_values().collect()
    }

    /// Function as a polynomial.
    pub(super) fn polynomial(&self, terms: &QuotientTerms) -> LaurentPolynomial {
        let f = &self.f;
        terms.iter().map(|(c, powers)| (powers.clone(), f.from_i64(*c))).collect()
    }
}

/// Every node as a polynomial in factors and inputs; `None` for another node.
fn nodes(
    (model, compiled, judged): (&SystemModel, &Compiled, &Judgement),
    factors: &ModelFactors,
    f: &Field,
    experiment: usize,
) -> Vec<Option<LaurentPolynomial>> {
    let own_constant = |c: usize| {
        let name = &model.constants[c].0.name;
        model.own.iter().any(|own| own.constants.iter().any(|(changed, _)| changed == name))
    };
    let mut out: Vec<Option<LaurentPolynomial>> = Vec::with_capacity(compiled.dag.ops.len());
    let mut left = ALL;
    for (node, op) in compiled.dag.ops.iter().enumerate() {
        let sum = |a: usize, b: usize, sign: u64| {
            let (a, b) = (out[a].as_ref()?, out[b].as_ref()?);
            let mut sum = a.clone();
            add_product(f, &mut sum, b, &constant(f, f.one()), sign)?;
            Some(sum)
        };
        let product = |a: &LaurentPolynomial, b: &LaurentPolynomial| {
            let mut product = LaurentPolynomial::new();
            add_product(f, &mut product, a, b, f.one())?;
            Some(product)
        };
        let own = match *op {
            Op::Number { mantissa, decimals } => Some(constant(f, f.number(mantissa, decimals))),
            Op::Slot(slot) => match compiled.roles[slot] {
                Role::KnownInput(i) if matches!(model.known_input(experiment, i), KnownInput::Generic) => {
                    Some(variable(f, factors.len() + i))
                }
                // the value in the first experiment is no factor of the others
                Role::Constant(c) if own_constant(c) => None,
                role => factors.of_role(role, &judged.layout, experiment).map(|v| variable(f, v)),
            },
            Op::Add(a, b) => sum(a, b, f.one()),
            Op::Subtract(a, b) => sum(a, b, f.neg(f.one())),
            Op::Multiply(a, b) => out[a].as_ref().zip(out[b].as_ref()).and_then(|(a, b)| product(a, b)),
            Op::Divide(a, b) => out[a].as_ref().zip(out[b].as_ref()).and_then(|(a, b)| {
                let (powers, &x) = b.first_key_value().filter(|_| b.len() == 1)?;
                let inverse = powers.iter().map(|&(v, e)| (v, -e)).collect();
                product(a, &LaurentPolynomial::from([(inverse, f.inv(x))]))
            }),
            Op::Primitive { .. } => {
                let own =
                    factors.of_functions().find(|&c| factors.function(c).is_some_and(|f| f.node == node));
                own.map(|c| variable(f, c))
            }
            Op::Pi => None,
        };
        let terms = own.as_ref().map_or(0, BTreeMap::len);
        out.push(own.filter(|_| terms <= left));
        left = left.saturating_sub(terms);
    }
    out
}

/// Terms with integer coefficients, up to a common factor; `None` if there are many, or some are not
/// rational.
fn with_integers(f: &Field, terms: &[(Monomial, u64)]) -> Option<QuotientTerms> {
    if terms.len() > GIVEN {
        return None;
    }
    let lead = f.inv(terms.first()?.1);
    let numbers: Option<Vec<(i64, i64)>> = terms.iter().map(|t| f.rational(&f.mul(t.1, lead))).collect();
    let numbers = super::symmetry::integers(&numbers?);
    let powers = |m: &Monomial| m.iter().map(|&(v, e)| (v as usize, e as i32)).collect();
    Some(numbers.into_iter().zip(terms).map(|(c, t)| (c, powers(&t.0))).collect())
}

/// Quotient as terms, or its inverse; `None` if both parts have several terms.
pub(super) fn terms_of_quotient(f: &Field, [above, below]: &[Polynomial; 2]) -> Option<QuotientTerms> {
    let (sum, one) = if below.len() == 1 { (above, below) } else { (below, above) };
    let (divisor, _) = one.terms().next().filter(|_| one.len() == 1)?;
    let terms: Vec<(Monomial, u64)> = sum.terms().map(|(m, c)| (m.clone(), c)).collect();
    let mut terms = with_integers(f, &terms)?;
    let divisor: QuotientPowers = divisor.iter().map(|&(v, e)| (v as usize, -(e as i32))).collect();
    for (_, powers) in &mut terms {
        *powers = multiplied(powers, &divisor)?;
    }
    Some(terms)
}
