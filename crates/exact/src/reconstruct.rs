//! Rational functions of one variable through points of the field.

use crate::Field;
use crate::polynomial::{trim, value};

/// Abscissae `0, 1, ..., n - 1`, prepared for many functions.
#[derive(Debug, Clone)]
pub struct Abscissae {
    field: Field,
    /// Inverses of `0, 1, ..., n - 1`.
    inverses: Vec<u64>,
    /// `x (x - 1) ... (x - n + 1)`, constant term first.
    vanishing: Vec<u64>,
}

/// A rational function of one variable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quotient {
    /// Coefficients of the numerator, constant term first.
    pub numerator: Vec<u64>,
    /// Coefficients of the denominator, constant term first.
    pub denominator: Vec<u64>,
}

impl Quotient {
    /// Degrees of numerator and denominator.
    pub fn degrees(&self) -> (usize, usize) {
        (self.numerator.len().saturating_sub(1), self.denominator.len().saturating_sub(1))
    }

    /// The derivative at zero; `None` where the denominator vanishes.
    pub fn slope_at_zero(&self, f: &Field) -> Option<u64> {
        let at = |p: &[u64], k: usize| p.get(k).copied().unwrap_or(0);
        let (n, d) = (&self.numerator, &self.denominator);
        if at(d, 0) == 0 {
            return None;
        }
        let above = f.sub(f.mul(at(n, 1), at(d, 0)), f.mul(at(n, 0), at(d, 1)));
        Some(f.mul(above, f.inv(f.mul(at(d, 0), at(d, 0)))))
    }
}

impl Abscissae {
    /// Number of points that confirm a reconstruction, beyond those that determine it.
    pub const SPARE: usize = 2;

    /// Abscissae `0, 1, ..., n - 1`.
    pub fn new(f: &Field, n: usize) -> Self {
        let mut vanishing = vec![f.one()];
        for k in 0..n as u64 {
            let mut next = vec![0; vanishing.len() + 1];
            for (j, &a) in vanishing.iter().enumerate() {
                next[j + 1] = f.add(next[j + 1], a);
                next[j] = f.sub(next[j], f.mul(a, f.from_u64(k)));
            }
            vanishing = next;
        }
        let inverses = (0..n as u64).map(|k| f.inv(f.from_u64(k))).collect();
        Self { field: *f, inverses, vanishing }
    }

    /// The polynomial of degree below n with the values `ys`.
    fn interpolated(&self, ys: &[u64]) -> Vec<u64> {
        let f = &self.field;
        let n = ys.len();
        let mut divided = ys.to_vec();
        for level in 1..n {
            for i in (level..n).rev() {
                divided[i] = f.mul(f.sub(divided[i], divided[i - 1]), self.inverses[level]);
            }
        }
        let mut out = vec![0; n];
        for i in (0..n).rev() {
            let x = f.from_u64(i as u64);
            for j in (0..n).rev() {
                let below = if j == 0 { divided[i] } else { out[j - 1] };
                out[j] = f.sub(below, f.mul(x, out[j]));
            }
        }
        trim(out)
    }

    /// The rational function of least total degree with the values `ys` at all abscissae, by the extended
    /// Euclidean algorithm without divisions; `None` where [`Self::SPARE`] points do not confirm it.
    pub fn rational(&self, ys: &[u64]) -> Option<Quotient> {
        let f = &self.field;
        let (mut r0, mut r1) = (self.vanishing.clone(), self.interpolated(ys));
        let (mut t0, mut t1) = (Vec::new(), vec![f.one()]);
        let mut best: Option<Quotient> = None;
        let total = |r: &[u64], t: &[u64]| r.len().saturating_sub(1) + t.len() - 1;
        loop {
            if best.as_ref().is_none_or(|b| total(&r1, &t1) < total(&b.numerator, &b.denominator)) {
                best = Some(Quotient { numerator: r1.clone(), denominator: t1.clone() });
            }
            if r1.is_empty() {
                break;
            }
            while r0.len() >= r1.len() {
                let shift = r0.len() - r1.len();
                let (a, b) = (r0[r0.len() - 1], r1[r1.len() - 1]);
                r0 = combined(f, (b, &r0), (a, &r1), shift);
                t0 = combined(f, (b, &t0), (a, &t1), shift);
            }
            std::mem::swap(&mut r0, &mut r1);
            std::mem::swap(&mut t0, &mut t1);
        }
        let confirmed = |q: &Quotient| {
            let fits = |(k, &y): (usize, &u64)| {
                let (x, below) = (f.from_u64(k as u64), &q.denominator);
                let below = value(f, below, x);
                below != 0 && value(f, &q.numerator, x) == f.mul(y, below)
            };
            total(&q.numerator, &q.denominator) + 1 + Self::SPARE <= ys.len()
                && ys.iter().enumerate().all(fits)
        };
        best.filter(confirmed)
    }
}

/// The combination `b p - a x^shift q`, without trailing zeros.
fn combined(f: &Field, (b, p): (u64, &[u64]), (a, q): (u64, &[u64]), shift: usize) -> Vec<u64> {
    let mut out = vec![0; p.len().max(q.len() + shift)];
    for (x, &c) in out.iter_mut().zip(p) {
        *x = f.mul(b, c);
    }
    for (x, &c) in out[shift..].iter_mut().zip(q) {
        *x = f.sub(*x, f.mul(a, c));
    }
    trim(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// A rational function is reconstructed, up to a common factor, from its values.
        #[test]
        fn functions_are_found(
            above in prop::collection::vec(1u64..1 << 60, 1..5),
            below in prop::collection::vec(1u64..1 << 60, 1..4),
        ) {
            let f = Field::new((1 << 60) + 33);
            let image = |p: &[u64]| -> Vec<u64> { p.iter().map(|&x| f.from_u64(x)).collect() };
            let (p, q) = (image(&above), image(&below));
            let ys: Vec<u64> = (0..10)
                .map(|k| f.from_u64(k))
                .map(|x| f.mul(value(&f, &p, x), f.inv(value(&f, &q, x))))
                .collect();
            let found = Abscissae::new(&f, 10).rational(&ys).expect("of low degree");
            prop_assert_eq!(found.degrees(), (p.len() - 1, q.len() - 1));
            let x = f.from_u64(77);
            let value_of = |q: &Quotient| f.mul(value(&f, &q.numerator, x), f.inv(value(&f, &q.denominator, x)));
            prop_assert_eq!(value_of(&found), f.mul(value(&f, &p, x), f.inv(value(&f, &q, x))));
            // (p/q)' = p'/q - p q'/q^2 at zero
            let second = |v: &[u64]| v.get(1).copied().unwrap_or(0);
            let slope = f.sub(
                f.mul(second(&p), f.inv(q[0])),
                f.mul(f.mul(p[0], second(&q)), f.inv(f.mul(q[0], q[0]))),
            );
            prop_assert_eq!(found.slope_at_zero(&f), Some(slope));
        }

        #[test]
        fn what_is_no_such_function_is_refused(ys in prop::collection::vec(1u64..1 << 60, 10)) {
            let f = Field::new((1 << 60) + 33);
            let ys: Vec<u64> = ys.into_iter().map(|y| f.from_u64(y)).collect();
            prop_assert_eq!(Abscissae::new(&f, 10).rational(&ys), None);
        }
    }
}
