//! Margin of rank decisions in real numbers, between zeros and other numbers.

/// Margin between the numbers that counted as zero and those that did not, in rank decisions. Values
/// are binary logarithms relative to the largest entry of the row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RankMargin {
    /// Smallest number that did not count as zero.
    pub nonzero: f64,
    /// Largest radius of a number that counted as zero.
    pub zero: f64,
}

impl RankMargin {
    /// Margin before any decision.
    pub const OPEN: Self = Self { nonzero: 0.0, zero: f64::NEG_INFINITY };

    /// The weaker of two margins in both respects.
    pub fn and(self, other: Self) -> Self {
        Self { nonzero: self.nonzero.min(other.nonzero), zero: self.zero.max(other.zero) }
    }

    /// True if the margin is sufficient for numbers of `bits` bits: zeros are below half of the bits,
    /// and a quarter of the bits lies between the two kinds.
    pub fn is_decisive(self, bits: i64) -> bool {
        let bits = bits as f64;
        self.zero <= -bits / 2.0 && self.zero <= self.nonzero - bits / 4.0
    }
}
