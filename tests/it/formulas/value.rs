//! A number with the sum of the magnitudes that went into it, by which rounding is judged.

/// A value and its size: the same with every term taken positive.
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

    /// What cancels in the denominator counts.
    pub(crate) fn over(self, other: Self) -> Self {
        let d = other.value.abs();
        Self { value: self.value / other.value, size: self.size / d * (other.size / d) }
    }

    pub(crate) fn power(self, exponent: i32) -> Self {
        let base = if exponent < 0 { Self::of(1.0).over(self) } else { self };
        (0..exponent.abs()).fold(Self::of(1.0), |product, _| product.times(base))
    }

    /// True if it is `expected` up to `tolerance` times what went into it.
    pub(crate) fn is(self, expected: f64, tolerance: f64) -> bool {
        (self.value - expected).abs() <= tolerance * self.size.max(expected.abs())
    }
}

/// Where names get their values.
pub(crate) type Names<'a> = dyn Fn(&str) -> Option<f64> + 'a;
