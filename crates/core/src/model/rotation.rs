//! Turning the platform: rotating segments, and the way from one position to the next.

use std::fmt;
use std::str::FromStr;

use super::angle::{Angle, parse_decimal};

/// Smallest rotation in 1e-9 degrees.
pub(crate) const MIN_ROTATION: i64 = 1_000_000;

/// An axis to turn about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axis {
    /// 0, 1, 2: X_p, Y_p, Z_p or N, U, E.
    pub index: usize,
    /// A geographic axis, not one of the platform.
    pub geographic: bool,
}

/// Not one of the six axes.
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

/// A rotating segment: psi^n goes on through it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rotation {
    /// About what.
    pub axis: Axis,
    /// The whole angle, right-handed; constant and not zero.
    pub angle: Angle,
}

/// Why a text is no rotation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RotationError {
    /// Not an axis.
    #[error(transparent)]
    About(#[from] AxisError),
    /// Not an angle.
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

/// An angle to turn by.
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

/// What a slew turns about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SlewAxis {
    /// One of the six axes.
    Named(Axis),
    /// A direction in n (North, Up, East), of any length but 0.
    Direction([f64; 3]),
}

impl SlewAxis {
    /// A direction in n, if it is one.
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

/// The way to a position from the one before: a turn at a constant rate, without observation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SlewTo {
    /// The rate in deg/s; `None`: that of the conditions.
    pub rate_deg_s: Option<f64>,
    /// About this axis; `None`: the shortest way, half turns about the axis in n (North, Up, East) whose
    /// first component that is not zero is positive.
    pub axis: Option<SlewAxis>,
    /// By this angle, right-handed; `None`: the shorter way about the axis, half turns right-handed.
    pub angle: Option<Angle>,
}
