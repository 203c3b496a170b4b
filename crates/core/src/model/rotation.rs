//! Turns of the platform: rotating segments, and slews from one position to the next.

use std::fmt;
use std::str::FromStr;

use super::angle::{Angle, parse_decimal};

/// Smallest rotation in 1e-9 degrees.
pub(crate) const MIN_ROTATION: i64 = 1_000_000;

/// Axis of a turn: one of six.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axis {
    /// Index 0, 1, 2 of the axis: X_p, Y_p, Z_p or N, U, E.
    pub index: usize,
    /// True for a geographic axis, false for a platform axis.
    pub geographic: bool,
}

/// Error for a text that is not one of the six axes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is not an axis to turn about; expected X_p, Y_p, Z_p (platform) or N, U, E (geographic)")]
pub struct AxisError {
    /// The text found.
    pub found: String,
}

impl Axis {
    const NAMES: [&'static str; 6] = ["X_p", "Y_p", "Z_p", "N", "U", "E"];
}

impl FromStr for Axis {
    type Err = AxisError;
    fn from_str(text: &str) -> Result<Self, AxisError> {
        let found = Self::NAMES.iter().position(|name| *name == text.trim());
        found
            .map(|i| Self { index: i % 3, geographic: i >= 3 })
            .ok_or_else(|| AxisError { found: text.into() })
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(Self::NAMES[self.index + if self.geographic { 3 } else { 0 }])
    }
}

/// Rotation of a segment; psi^n continues through it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rotation {
    /// Axis of the rotation.
    pub axis: Axis,
    /// Total angle, right-handed; constant and not zero.
    pub angle: Angle,
}

/// Reasons why a text is no rotation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RotationError {
    /// The text does not name an axis.
    #[error(transparent)]
    About(#[from] AxisError),
    /// The text has no admitted angle.
    #[error("`{found}` is no angle to turn by; expected decimal degrees of at least 0.001 in magnitude")]
    Angle {
        /// The text found.
        found: String,
    },
}

impl Rotation {
    /// A rotation about a named axis by decimal degrees.
    ///
    /// # Errors
    /// [`RotationError`].
    pub fn new(about: &str, angle: &str) -> Result<Self, RotationError> {
        Ok(Self { axis: about.parse()?, angle: whole_angle(angle)? })
    }
}

/// Angle of a rotation from its text.
///
/// # Errors
/// [`RotationError::Angle`] for anything but decimal degrees of at least 0.001 in magnitude.
pub(crate) fn whole_angle(text: &str) -> Result<Angle, RotationError> {
    let nanodeg = parse_decimal(text.trim()).ok().filter(|n| n.abs() >= MIN_ROTATION);
    nanodeg.map(Angle::from_nanodeg).ok_or_else(|| RotationError::Angle { found: text.into() })
}

impl fmt::Display for Rotation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.axis, self.angle)
    }
}

/// Axis of a slew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SlewAxis {
    /// One of the six axes.
    Named(Axis),
    /// A direction in n (North, Up, East), of any length but 0.
    Direction([f64; 3]),
}

impl SlewAxis {
    /// Direction in n; `None` unless it has three finite components, not all zero.
    pub fn direction(components: &[f64]) -> Option<Self> {
        let direction: [f64; 3] = components.try_into().ok()?;
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        (length.is_normal() && length < 1e100).then_some(Self::Direction(direction))
    }
}

impl FromStr for SlewAxis {
    type Err = AxisError;
    fn from_str(text: &str) -> Result<Self, AxisError> {
        text.parse().map(Self::Named)
    }
}

/// Slew to a position from the one before: a turn at a constant rate, without observation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SlewTo {
    /// Rate in deg/s; `None`: rate of the conditions.
    pub rate_deg_s: Option<f64>,
    /// Axis of the slew. `None`: the shortest turn; a half turn goes about the axis in n (North, Up, East)
    /// whose first non-zero component is positive.
    pub axis: Option<SlewAxis>,
    /// Angle of the slew, right-handed. `None`: the shorter turn about the axis; a half turn is
    /// right-handed.
    pub angle: Option<Angle>,
}
