//! One term of a solution: a coefficient and the derivative of Z that it multiplies.

use crate::degree::coefficient::Coefficient;

/// `coefficient * w^turns * Z_component^(order) @ station`, w being the rate at which the platform turns
/// there.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Index of the station.
    pub station: usize,
    /// 1, 2, 3: component in n or platform axis; of a measured azimuth its number.
    pub component: usize,
    /// True if this is the measured azimuth.
    pub azimuth: bool,
    /// Derivative order; at a rotation, of the platform that turns.
    pub order: usize,
    /// The power of the rate of turning.
    pub turns: usize,
    /// The coefficient, without it.
    pub coefficient: Coefficient,
}
