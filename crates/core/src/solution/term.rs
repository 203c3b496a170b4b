//! Terms of a solution: a coefficient and the derivative of Z that it multiplies.

use crate::degree::coefficient::Coefficient;

/// Term `coefficient * w^turns * Z_component^(order) @ station`, with the turning rate w of the platform at
/// the station.
#[derive(Debug, Clone, PartialEq)]
pub struct DerivativeTerm {
    /// Index of the station.
    pub station: usize,
    /// Component 1, 2, 3 in n or platform axes, or the number of a measured azimuth.
    pub component: usize,
    /// True if this is the measured azimuth.
    pub azimuth: bool,
    /// Derivative order; during a rotation, the derivative on the turning platform.
    pub order: usize,
    /// Power of the turning rate.
    pub turns: usize,
    /// Coefficient without the turning rate.
    pub coefficient: Coefficient,
}
