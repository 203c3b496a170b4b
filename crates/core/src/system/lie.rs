//! Derivatives of the outputs as polynomials in the unknowns: identifiable functions by definition, used if
//! no simpler ones were found.

use obsdeg_exact::Field;
use obsdeg_exact::Scalars;
use obsdeg_exact::multivariate::{Monomial, Polynomial};

use super::dag::Op;
use super::judge::Judgement;
use super::model::{Compiled, KnownInput, Role, SystemModel};
use super::quotients::Terms;
use super::values::Values;

/// Largest number of terms of a polynomial that is formed, and of a function that is returned.
const FORMED: usize = 2000;
const GIVEN: usize = 40;

/// Coefficients of derivatives of the outputs by the products of inputs, in the order of the derivatives.
/// Empty for a model that is not polynomial, or with special starts, several runs, arbitrary inputs or
/// generic constants.
pub(super) fn lie_derivatives(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    f: Field,
) -> Vec<Terms> {
    let alone = judged.layout.closed && compiled.segments.len() <= 1 && compiled.constraints.is_empty();
    let inputs = model.known_inputs.len();
    let generic = (0..inputs).all(|i| matches!(model.known_input(0, i), KnownInput::Generic));
    if !alone || !generic || model.experiments > 1 || !model.unknown_inputs.is_empty() {
        return Vec::new();
    }
    let lanes = judged.layout.unknowns.len();
    let jet = |input: usize, order: usize| (lanes + order * inputs + input) as u32;
    let Some(nodes) = nodes(compiled, judged, &f, &|input| jet(input, 0)) else { return Vec::new() };
    let mut rates: Vec<(u32, Polynomial)> = Vec::new();
    for (s, &rate) in compiled.rates(0).iter().enumerate() {
        let Some(lane) = judged.layout.lane(Role::State(s), 0) else { return Vec::new() };
        rates.push((lane as u32, nodes[rate].clone()));
    }
    let mut derivatives: Vec<Polynomial> = compiled.outputs(0).iter().map(|&o| nodes[o].clone()).collect();
    let mut out = Vec::new();
    for order in 0..=lanes {
        for p in &derivatives {
            out.extend(coefficients(p, lanes as u32, &f));
        }
        // the next derivative contains one order more of the inputs
        rates.extend((0..inputs).map(|i| (jet(i, order), Polynomial::variable(&f, jet(i, order + 1)))));
        for p in &mut derivatives {
            let mut next = Polynomial::default();
            for (v, rate) in &rates {
                let part = p.derivative(&f, *v);
                if part.len() * rate.len() > FORMED {
                    return out;
                }
                next.add_product(&f, &part, rate);
            }
            if next.len() > FORMED {
                return out;
            }
            *p = next;
        }
    }
    out
}

/// Every node as a polynomial; `None` if a node in use is none.
fn nodes(
    compiled: &Compiled,
    judged: &Judgement,
    f: &Field,
    input: &dyn Fn(usize) -> u32,
) -> Option<Vec<Polynomial>> {
    let needed = super::fibre::reached(compiled, compiled.outputs(0), |s| Some(compiled.rates(0)[s]));
    let mut out: Vec<Polynomial> = Vec::with_capacity(needed.len());
    for (op, needed) in compiled.dag.ops.iter().zip(needed) {
        let mut p = Polynomial::default();
        if needed {
            match *op {
                Op::Number { mantissa, decimals } => p = Polynomial::constant(f.number(mantissa, decimals)),
                Op::Slot(slot) => match compiled.roles[slot] {
                    Role::KnownInput(i) => p = Polynomial::variable(f, input(i)),
                    role => p = Polynomial::variable(f, judged.layout.lane(role, 0)? as u32),
                },
                Op::Add(a, b) | Op::Subtract(a, b) => {
                    p = out[a].clone();
                    let sign = if matches!(op, Op::Add(..)) { f.one() } else { f.neg(f.one()) };
                    p.add_scaled(f, &out[b], sign);
                }
                Op::Multiply(a, b) if out[a].len() * out[b].len() <= FORMED => {
                    p.add_product(f, &out[a], &out[b]);
                }
                Op::Divide(a, b) => {
                    let below = out[b].as_constant().filter(|&x| x != 0)?;
                    p = out[a].scaled(f, f.inv(below));
                }
                _ => return None,
            }
        }
        out.push(p);
    }
    Some(out)
}

/// Coefficients of a polynomial by the products of variables from `first` on, with integer numbers; only
/// those with few terms.
fn coefficients(p: &Polynomial, first: u32, f: &Field) -> Vec<Terms> {
    let mut parts: std::collections::BTreeMap<Monomial, Vec<(Monomial, u64)>> =
        std::collections::BTreeMap::new();
    for (m, c) in p.terms() {
        let (of_unknowns, of_inputs): (Vec<_>, Vec<_>) = m.iter().copied().partition(|x| x.0 < first);
        parts.entry(of_inputs).or_default().push((of_unknowns, c));
    }
    parts.into_values().filter_map(|terms| with_integers(f, &terms)).collect()
}

/// Terms with integer coefficients, up to a common factor; `None` if there are many, or some are not
/// rational.
fn with_integers(f: &Field, terms: &[(Monomial, u64)]) -> Option<Terms> {
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
pub(super) fn terms_of_quotient(f: &Field, [above, below]: &[Polynomial; 2]) -> Option<Terms> {
    let (sum, one) = if below.len() == 1 { (above, below) } else { (below, above) };
    let (divisor, _) = one.terms().next().filter(|_| one.len() == 1)?;
    let terms: Vec<(Monomial, u64)> = sum.terms().map(|(m, c)| (m.clone(), c)).collect();
    let mut terms = with_integers(f, &terms)?;
    for (_, powers) in &mut terms {
        for &(v, e) in divisor {
            match powers.iter_mut().find(|p| p.0 == v as usize) {
                Some(own) => own.1 -= e as i32,
                None => powers.push((v as usize, -(e as i32))),
            }
        }
        powers.retain(|p| p.1 != 0);
        powers.sort_unstable();
    }
    Some(terms)
}
