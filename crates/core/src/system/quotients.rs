//! Values of rational functions of the unknowns among all solutions: their minimal polynomials in the
//! quotient ring of the equations.

use std::collections::BTreeMap;

use obsdeg_exact::Field;
use obsdeg_exact::groebner::{GroebnerBasis, RemainingWork};
use obsdeg_exact::multivariate::Polynomial;

use super::constraints::below;
use super::dag::{Dag, Op};
use super::undecided::{NotCounted, SOLUTIONS};
use super::values::Values;

/// Limit of the work of one remainder by an unfinished basis.
const REMAINDER: u64 = 100_000;

/// Product of powers: `(unknown, exponent)`.
pub(super) type QuotientPowers = Vec<(usize, i32)>;

/// Sum of products of powers with integer coefficients.
pub(super) type QuotientTerms = Vec<(i64, QuotientPowers)>;

/// Quotient ring of equations by their Groebner basis.
pub(super) struct Quotients<'a> {
    pub(super) f: Field,
    pub(super) basis: &'a mut GroebnerBasis,
}

impl Quotients<'_> {
    /// Polynomial whose roots are the values of an element at all solutions, constant term first.
    pub(super) fn values(
        &mut self,
        p: &Polynomial,
        work: &mut RemainingWork,
    ) -> Result<Vec<u64>, NotCounted> {
        let f = self.f;
        if !self.basis.is_complete() {
            // an element that is a number modulo an ideal is one modulo every larger ideal
            let number = self.basis.remainder(p, &mut RemainingWork::new(REMAINDER))?.as_constant();
            return number.map(|x| vec![f.neg(x), f.one()]).ok_or(NotCounted::OverLimit);
        }
        self.basis.minimal_polynomial(p, SOLUTIONS, work)?.ok_or(NotCounted::TooMany)
    }

    fn product(
        &mut self,
        a: &Polynomial,
        b: &Polynomial,
        work: &mut RemainingWork,
    ) -> Result<Polynomial, NotCounted> {
        let mut out = Polynomial::default();
        work.take(1 + (a.len() * b.len()) as u64)?;
        out.add_product(&self.f, a, b);
        Ok(self.basis.remainder(&out, work)?)
    }

    /// Inverse of an element that vanishes at no solution: with `m(p) = 0`, it is `(m(0) - m(p))/(m(0) p)`.
    fn inverse(&mut self, p: &Polynomial, work: &mut RemainingWork) -> Result<Polynomial, NotCounted> {
        let f = self.f;
        let minimal = self.values(p, work)?;
        let last = f.inv(minimal[0]);
        if last == 0 || minimal[0] == 0 {
            return Err(NotCounted::NoPoint);
        }
        let mut out = Polynomial::default();
        for &c in minimal[1..].iter().rev() {
            out = self.product(&out, p, work)?;
            out.add_scaled(&f, &Polynomial::constant(f.one()), c);
        }
        Ok(out.scaled(&f, f.neg(last)))
    }

    /// Element of the ring for a function of the unknowns.
    pub(super) fn function(
        &mut self,
        terms: &QuotientTerms,
        unknowns: &[Polynomial],
        work: &mut RemainingWork,
    ) -> Result<Polynomial, NotCounted> {
        let f = self.f;
        let mut sum = Polynomial::default();
        for (number, powers) in terms {
            let mut product = Polynomial::constant(f.from_i64(*number));
            for &(unknown, exponent) in powers {
                let factor = match exponent < 0 {
                    true => self.inverse(&unknowns[unknown], work)?,
                    false => unknowns[unknown].clone(),
                };
                for _ in 0..exponent.unsigned_abs() {
                    product = self.product(&product, &factor, work)?;
                }
            }
            sum.add_scaled(&f, &product, f.one());
        }
        Ok(sum)
    }

    /// Element of the ring for a node of the graph, given the elements of the slots.
    pub(super) fn node(
        &mut self,
        dag: &Dag,
        node: usize,
        slot: impl Fn(usize) -> Option<Polynomial>,
        work: &mut RemainingWork,
    ) -> Result<Polynomial, NotCounted> {
        let f = self.f;
        let mut found: BTreeMap<usize, Polynomial> = BTreeMap::new();
        for i in below(dag, node) {
            let element = match dag.ops[i] {
                Op::Number { mantissa, decimals } => Polynomial::constant(f.number(mantissa, decimals)),
                Op::Slot(s) => slot(s).ok_or(NotCounted::KnownSignal)?,
                Op::Add(a, b) | Op::Subtract(a, b) => {
                    let minus = matches!(dag.ops[i], Op::Subtract(..));
                    let mut sum = found[&a].clone();
                    sum.add_scaled(&f, &found[&b], if minus { f.neg(f.one()) } else { f.one() });
                    sum
                }
                Op::Multiply(a, b) => self.product(&found[&a], &found[&b], work)?,
                Op::Divide(a, b) => {
                    let inverse = self.inverse(&found[&b], work)?;
                    self.product(&found[&a], &inverse, work)?
                }
                Op::Primitive { .. } | Op::Pi => return Err(NotCounted::NotRational),
            };
            found.insert(i, element);
        }
        found.remove(&node).ok_or(NotCounted::NoPoint)
    }
}
