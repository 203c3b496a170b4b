//! Values of rational functions of the unknowns among all solutions: their minimal polynomials in the
//! quotient ring of the equations.

use obsdeg_exact::Field;
use obsdeg_exact::groebner::{GroebnerBasis, RemainingWork};
use obsdeg_exact::multivariate::Polynomial;

use super::undecided::{NotCounted, SOLUTIONS};

/// Limit of the work of one remainder by an unfinished basis.
const REMAINDER: u64 = 100_000;

/// Product of powers: `(unknown, exponent)`.
pub(super) type QuotientPowers = Vec<(usize, i32)>;

/// Sum of products of powers with integer coefficients.
pub(super) type Terms = Vec<(i64, QuotientPowers)>;

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
        terms: &Terms,
        unknowns: &[Polynomial],
        work: &mut RemainingWork,
    ) -> Result<Polynomial, NotCounted> {
        let f = self.f;
        let mut sum = Polynomial::default();
        for (number, powers) in terms {
            let mut product = Polynomial::constant(f.from_i64(*number));
            for &(lane, exponent) in powers {
                let factor = match exponent < 0 {
                    true => self.inverse(&unknowns[lane], work)?,
                    false => unknowns[lane].clone(),
                };
                for _ in 0..exponent.unsigned_abs() {
                    product = self.product(&product, &factor, work)?;
                }
            }
            sum.add_scaled(&f, &product, f.one());
        }
        Ok(sum)
    }
}
