//! Number with the sum of the magnitudes of its terms, for bounds on rounding.

/// Value of an expression, and its size: the value with every term taken positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Value {
    pub(crate) value: f64,
    pub(crate) size: f64,
}

impl Value {
    pub(crate) fn of(value: f64) -> Self {
        Self { value, size: value.abs() }
    }

    pub(crate) fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, size: self.size + other.size }
    }

    pub(crate) fn negated(self) -> Self {
        Self { value: -self.value, size: self.size }
    }

    pub(crate) fn times(self, other: Self) -> Self {
        Self { value: self.value * other.value, size: self.size * other.size }
    }

    /// Quotient; its size includes the cancellation in the denominator.
    pub(crate) fn over(self, other: Self) -> Self {
        let d = other.value.abs();
        Self { value: self.value / other.value, size: self.size / d * (other.size / d) }
    }

    pub(crate) fn power(self, exponent: i32) -> Self {
        let base = if exponent < 0 { Self::of(1.0).over(self) } else { self };
        (0..exponent.abs()).fold(Self::of(1.0), |product, _| product.times(base))
    }

    /// True if the value equals `expected` within `tolerance` times its size.
    pub(crate) fn is(self, expected: f64, tolerance: f64) -> bool {
        (self.value - expected).abs() <= tolerance * self.size.max(expected.abs())
    }
}

/// Values by name; `None` for an unknown name.
pub(crate) type Names<'a> = dyn Fn(&str) -> Option<f64> + 'a;
