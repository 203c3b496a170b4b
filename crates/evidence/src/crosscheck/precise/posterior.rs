//! Covariance of a filter in high precision.

use super::digits::{Digits, Functional, ROUNDING, Vector, double};
use super::information::SampleInformation;
use super::seen::at_start;

/// Covariance at the end, by its inverse: the information of samples and prior.
pub(in super::super) struct Posterior {
    digits: Digits,
    /// Standard deviations of the prior.
    prior: Vector,
    /// Lower triangular `L` (n x n), row k of length k + 1: `L L^T` is the information in units of the prior.
    factor: Vec<Vector>,
    psi_at_end: Vec<Functional>,
}

impl Posterior {
    /// Covariance from the information of samples and a prior (standard deviations in rad and in w_ie).
    /// `None` when rounding destroys the information.
    pub(in super::super) fn new(information: &SampleInformation, prior: &[f64]) -> Option<Self> {
        let SampleInformation { digits: d, matrix, psi_at_end } = information;
        let d = *d;
        let prior: Vector = prior.iter().map(|p| d.double(*p)).collect();
        let n = prior.len();
        let mut factor: Vec<Vector> = Vec::with_capacity(n);
        for i in 0..n {
            let mut row: Vector = Vec::with_capacity(i + 1);
            for j in 0..=i {
                let scaled = d.mul(&d.mul(&prior[i], &prior[j]), &matrix[i][j]);
                let own = if i == j { d.add(&scaled, &d.int(1)) } else { scaled };
                let above = factor.get(j).unwrap_or(&row);
                let rest = d.sub(&own, &d.dot(row.iter().zip(above).take(j)));
                if i == j && !rest.is_positive() {
                    return None;
                }
                row.push(if i == j { rest.sqrt(d.bits, ROUNDING) } else { d.div(&rest, &factor[j][j]) });
            }
            factor.push(row);
        }
        Some(Self { digits: d, prior, factor, psi_at_end: psi_at_end.clone() })
    }

    /// Solution `L^-1 c` for a functional of psi at the end and the coefficients, in units of the prior. Its
    /// squared length is the variance.
    fn solved(&self, functional: &Functional) -> Vector {
        let d = self.digits;
        let mut c = vec![d.int(0); self.prior.len()];
        for (i, x) in at_start(d, &self.psi_at_end, functional) {
            c[i] = d.add(&c[i], &d.mul(&x, &self.prior[i]));
        }
        let mut out: Vector = Vec::with_capacity(c.len());
        for (x, row) in c.iter().zip(&self.factor) {
            let rest = d.sub(x, &d.dot(row.iter().zip(&out)));
            out.push(d.div(&rest, &row[out.len()]));
        }
        out
    }

    /// Standard deviation of a functional.
    pub(in super::super) fn sigma(&self, functional: &Functional) -> f64 {
        let d = self.digits;
        let y = self.solved(functional);
        double(&d.dot(y.iter().zip(&y)).sqrt(d.bits, ROUNDING))
    }

    /// Correlation of two functionals.
    pub(in super::super) fn correlation(&self, a: &Functional, b: &Functional) -> f64 {
        let d = self.digits;
        let (a, b) = (self.solved(a), self.solved(b));
        let product = |a: &Vector, b: &Vector| d.dot(a.iter().zip(b));
        let length = d.mul(&product(&a, &a), &product(&b, &b)).sqrt(d.bits, ROUNDING);
        double(&d.div(&product(&a, &b), &length))
    }
}
