//! Double-precision numbers with bounds on their rounding errors: running error analysis (N. J. Higham,
//! *Accuracy and Stability of Numerical Algorithms*, 2nd edition, 2002, section 3.3).

use obsdeg_core::model::Ring;

/// Bound on the relative rounding error of a sum of `terms` products, in any order: Higham's `gamma_n =
/// n u / (1 - n u)` (3.4), u = 2^-53, with a factor of two and some operations to spare. It thus also
/// covers the rounding of computed bounds.
pub(crate) fn rounding(terms: usize) -> f64 {
    (terms + 16) as f64 * f64::EPSILON
}

/// Interval of radius `radius` about `value`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounded {
    pub(super) value: f64,
    pub(super) radius: f64,
}

impl Bounded {
    pub(super) fn exact(value: f64) -> Self {
        Self { value, radius: 0.0 }
    }

    /// Result of one more operation: its radius grows by u of the result, and by as much for the radius
    /// itself.
    fn rounded(value: f64, radius: f64) -> Self {
        let radius = radius + f64::EPSILON * value.abs();
        Self { value, radius: radius * (1.0 + 4.0 * f64::EPSILON) }
    }
}

impl std::ops::Add for Bounded {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::rounded(self.value + other.value, self.radius + other.radius)
    }
}

impl std::ops::Mul for Bounded {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let radius = self.value.abs() * other.radius + self.radius * (other.value.abs() + other.radius);
        Self::rounded(self.value * other.value, radius)
    }
}

impl std::ops::Mul<f64> for Bounded {
    type Output = Self;
    fn mul(self, exact: f64) -> Self {
        self * Self::exact(exact)
    }
}

impl std::iter::Sum for Bounded {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self::exact(0.0), |sum, x| sum + x)
    }
}

/// Ring of [`Bounded`] numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds;

impl Ring for Bounds {
    type Element = Bounded;
    fn zero(&self) -> Bounded {
        Bounded::exact(0.0)
    }
    fn one(&self) -> Bounded {
        Bounded::exact(1.0)
    }
    fn add(&self, a: &Bounded, b: &Bounded) -> Bounded {
        *a + *b
    }
    fn mul(&self, a: &Bounded, b: &Bounded) -> Bounded {
        *a * *b
    }
    fn neg(&self, a: &Bounded) -> Bounded {
        Bounded { value: -a.value, ..*a }
    }
    fn is_zero(&self, a: &Bounded) -> bool {
        a.value == 0.0 && a.radius == 0.0
    }
}
