//! Arithmetic of high precision.

use astro_float_num::{BigFloat, Consts, RoundingMode, WORD_BIT_SIZE};

/// Number of high precision.
pub(in super::super) type Real = BigFloat;
pub(super) type Vector = Vec<Real>;
/// Functional of the unknowns: `(unknown, coefficient)`, drifts in units of the earth rate.
pub(in super::super) type Functional = Vec<(usize, Real)>;

/// Arithmetic of a stated number of bits.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Digits {
    pub(in super::super) bits: usize,
}

pub(super) const ROUNDING: RoundingMode = RoundingMode::None;

impl Digits {
    pub(super) fn int(self, x: i64) -> Real {
        Real::from_i64(x, self.bits)
    }

    pub(in super::super) fn double(self, x: f64) -> Real {
        Real::from_f64(x, self.bits)
    }

    pub(super) fn add(self, a: &Real, b: &Real) -> Real {
        a.add(b, self.bits, ROUNDING)
    }

    pub(super) fn sub(self, a: &Real, b: &Real) -> Real {
        a.sub(b, self.bits, ROUNDING)
    }

    pub(super) fn mul(self, a: &Real, b: &Real) -> Real {
        a.mul(b, self.bits, ROUNDING)
    }

    pub(super) fn div(self, a: &Real, b: &Real) -> Real {
        a.div(b, self.bits, ROUNDING)
    }

    pub(super) fn dot<'a>(self, terms: impl Iterator<Item = (&'a Real, &'a Real)>) -> Real {
        let terms = terms.filter(|(a, b)| !a.is_zero() && !b.is_zero());
        terms.fold(self.int(0), |sum, (a, b)| self.add(&sum, &self.mul(a, b)))
    }

    /// Cosine and sine of an angle in 1e-9 degrees; exact at quarter turns.
    pub(super) fn cos_sin(self, nanodeg: i64, constants: &mut Constants) -> (Real, Real) {
        const QUARTER: i64 = 90_000_000_000;
        let (quarters, rest) = (nanodeg.div_euclid(QUARTER).rem_euclid(4), nanodeg.rem_euclid(QUARTER));
        let (c, s) = if rest == 0 {
            (self.int(1), self.int(0))
        } else {
            let turn = self.div(&self.int(rest), &self.int(2 * QUARTER));
            let x = self.mul(&turn, &constants.pi(self.bits));
            (x.cos(self.bits, ROUNDING, &mut constants.0), x.sin(self.bits, ROUNDING, &mut constants.0))
        };
        match quarters {
            0 => (c, s),
            1 => (s.neg(), c),
            2 => (c.neg(), s.neg()),
            _ => (s, c.neg()),
        }
    }
}

/// Cache of constants for cosines, sines and pi.
pub(super) struct Constants(Consts);

impl Constants {
    /// Cache of constants; `None` when memory does not suffice.
    pub(super) fn new() -> Option<Self> {
        Some(Self(Consts::new().ok()?))
    }

    pub(super) fn pi(&mut self, bits: usize) -> Real {
        self.0.pi(bits, ROUNDING)
    }
}

/// Binary logarithm of a magnitude; `None` for zero.
pub(in super::super) fn log2(x: &Real) -> Option<f64> {
    let (words, _, _, exponent, _) = x.as_raw_parts()?;
    // the mantissa is in 0.5..1, its highest word last
    let top = words.last().filter(|w| **w != 0)?;
    Some(f64::from(exponent) + (*top as f64).log2() - WORD_BIT_SIZE as f64)
}

/// Value in double precision.
pub(in super::super) fn double(x: &Real) -> f64 {
    let sign = if x.is_negative() { -1.0 } else { 1.0 };
    log2(x).map_or(0.0, |e| sign * e.exp2())
}

/// Magnitude of a sum of products (or of numbers), relative to the sum of the magnitudes of its terms.
pub(in super::super) fn add_up<'a>(
    d: Digits,
    parts: impl Iterator<Item = (Option<&'a Real>, &'a Real)>,
) -> f64 {
    let (mut sum, mut size) = (d.int(0), d.int(0));
    for (factor, x) in parts {
        let part = factor.map_or_else(|| x.clone(), |f| d.mul(f, x));
        sum = d.add(&sum, &part);
        size = d.add(&size, &part.abs());
    }
    if size.is_zero() { 0.0 } else { double(&d.div(&sum.abs(), &size)) }
}
