//! How clearly zeros and other numbers were distinguished where ranks were decided by real numbers.

/// How far apart the two kinds of numbers were that decided ranks: binary logarithms, relative to the largest
/// entry of their row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// The smallest that is not zero.
    pub nonzero: f64,
    /// The widest that was taken for zero.
    pub zero: f64,
}

impl Gap {
    /// Nothing was decided.
    pub const OPEN: Self = Self { nonzero: 0.0, zero: f64::NEG_INFINITY };

    /// The weaker of two in both respects.
    pub fn and(self, other: Self) -> Self {
        Self { nonzero: self.nonzero.min(other.nonzero), zero: self.zero.max(other.zero) }
    }

    /// True if the two kinds are unmistakable with so many bits: zero below half of them, and a quarter of
    /// them between the two.
    pub fn is_decisive(self, bits: i64) -> bool {
        let bits = bits as f64;
        self.zero <= -bits / 2.0 && self.zero <= self.nonzero - bits / 4.0
    }
}
