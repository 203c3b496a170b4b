//! Mounting of gyros and accelerometers.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Signed platform axis such as `+x` or `-z`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct SignedAxis {
    /// Index of the axis: 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// True for the negative direction.
    pub negative: bool,
}

impl SignedAxis {
    /// Components along x, y, z.
    pub fn vector(self) -> [i32; 3] {
        let mut v = [0; 3];
        v[self.axis] = if self.negative { -1 } else { 1 };
        v
    }
}

impl FromStr for SignedAxis {
    type Err = GeometryError;
    fn from_str(text: &str) -> Result<Self, GeometryError> {
        let (negative, letter) = match text.as_bytes() {
            [b'+', l] => (false, l),
            [b'-', l] => (true, l),
            [l] => (false, l),
            _ => return Err(GeometryError::Axis { found: text.into() }),
        };
        let axis = match letter {
            b'x' => 0,
            b'y' => 1,
            b'z' => 2,
            _ => return Err(GeometryError::Axis { found: text.into() }),
        };
        Ok(Self { axis, negative })
    }
}

impl TryFrom<String> for SignedAxis {
    type Error = GeometryError;
    fn try_from(text: String) -> Result<Self, GeometryError> {
        text.parse()
    }
}

impl From<SignedAxis> for String {
    fn from(a: SignedAxis) -> Self {
        a.to_string()
    }
}

impl fmt::Display for SignedAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", if self.negative { '-' } else { '+' }, ['x', 'y', 'z'][self.axis])
    }
}

/// Axes of one gyro: input I, output O, spin S, as signed platform axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the letters of IEEE Std 529")]
pub struct GyroAxes {
    /// Input axis of the gyro, a signed platform axis.
    pub I: SignedAxis,
    /// Output axis of the gyro, a signed platform axis.
    pub O: SignedAxis,
    /// Spin axis of the gyro, a signed platform axis.
    pub S: SignedAxis,
}

/// Mounting of the X, Y and Z gyro. The default is the paper's, as it follows from its (22), (23), (27) and
/// (28).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[allow(non_snake_case, reason = "the letters of the paper")]
pub struct Geometry {
    /// Axes of the gyro whose coefficients end in X.
    pub X: GyroAxes,
    /// Axes of the gyro whose coefficients end in Y.
    pub Y: GyroAxes,
    /// Axes of the gyro whose coefficients end in Z.
    pub Z: GyroAxes,
    /// Input axes of the accelerometers; X_p, Y_p, Z_p when left out.
    #[serde(skip_serializing_if = "Accelerometers::is_default")]
    pub accelerometers: Accelerometers,
}

/// Input axes of the accelerometers as signed platform axes; X_p, Y_p, Z_p by default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the letters of the coefficients")]
pub struct Accelerometers {
    /// Input axis of accelerometer X, whose coefficients end in X or have it first.
    pub X: SignedAxis,
    /// Input axis of accelerometer Y, a signed platform axis.
    pub Y: SignedAxis,
    /// Input axis of accelerometer Z, a signed platform axis.
    pub Z: SignedAxis,
}

impl Default for Accelerometers {
    fn default() -> Self {
        let axis = |axis| SignedAxis { axis, negative: false };
        Self { X: axis(0), Y: axis(1), Z: axis(2) }
    }
}

impl Accelerometers {
    /// Input axes in order X, Y, Z.
    pub fn inputs(&self) -> [SignedAxis; 3] {
        [self.X, self.Y, self.Z]
    }

    /// True if the input axes are the platform axes.
    pub(crate) fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl Default for Geometry {
    fn default() -> Self {
        let axis = |axis, negative| SignedAxis { axis, negative };
        Self {
            X: GyroAxes { I: axis(0, false), O: axis(2, true), S: axis(1, false) },
            Y: GyroAxes { I: axis(1, false), O: axis(2, true), S: axis(0, true) },
            Z: GyroAxes { I: axis(2, false), O: axis(0, false), S: axis(1, false) },
            accelerometers: Accelerometers::default(),
        }
    }
}

/// Reasons why a mounting is impossible.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GeometryError {
    /// The text is not an axis.
    #[error("`{found}` is not a platform axis; expected +x, -x, +y, -y, +z or -z")]
    Axis {
        /// The text found.
        found: String,
    },
    /// I, O, S of a gyro do not form a right-handed triad.
    #[error("the axes of gyro {gyro} (I={i} O={o} S={s}) are not right-handed; expected I x O = S")]
    NotRightHanded {
        /// Letter of the gyro: X, Y or Z.
        gyro: char,
        /// Input axis.
        i: SignedAxis,
        /// Output axis.
        o: SignedAxis,
        /// Spin axis.
        s: SignedAxis,
    },
    /// Two sensors of one kind measure along the same axis.
    #[error(
        "{sensors} {first} and {second} both have their input axis along {axis}; expected three different axes"
    )]
    SharedInput {
        /// Kind of the sensors: gyros or accelerometers.
        sensors: &'static str,
        /// Letter of the first sensor.
        first: char,
        /// Letter of the second sensor.
        second: char,
        /// Letter of the common axis: x, y or z.
        axis: char,
    },
}

/// The letters of the three gyros and of the three accelerometers.
pub const GYROS: [char; 3] = ['X', 'Y', 'Z'];

impl Geometry {
    /// The three gyros in order X, Y, Z.
    pub fn gyros(&self) -> [GyroAxes; 3] {
        [self.X, self.Y, self.Z]
    }

    /// Checks that every gyro is right-handed and that the three input axes of gyros and of accelerometers
    /// differ.
    ///
    /// # Errors
    /// [`GeometryError`] naming the sensor.
    pub fn validate(&self) -> Result<(), GeometryError> {
        let gyros = self.gyros();
        for (gyro, a) in GYROS.into_iter().zip(gyros) {
            let (i, o) = (a.I.vector(), a.O.vector());
            let cross: [i32; 3] = std::array::from_fn(|k| {
                let (l, m) = ((k + 1) % 3, (k + 2) % 3);
                i[l] * o[m] - i[m] * o[l]
            });
            if cross != a.S.vector() {
                return Err(GeometryError::NotRightHanded { gyro, i: a.I, o: a.O, s: a.S });
            }
        }
        let of_gyros = gyros.map(|g| g.I);
        for (sensors, inputs) in [("gyros", of_gyros), ("accelerometers", self.accelerometers.inputs())] {
            for (a, b) in [(0, 1), (0, 2), (1, 2)] {
                if inputs[a].axis == inputs[b].axis {
                    let axis = ['x', 'y', 'z'][inputs[a].axis];
                    let (first, second) = (GYROS[a], GYROS[b]);
                    return Err(GeometryError::SharedInput { sensors, first, second, axis });
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_the_papers_and_valid() {
        let g = Geometry::default();
        assert_eq!(g.validate(), Ok(()));
        let text: Vec<String> = g.gyros().iter().map(|a| format!("I={} O={} S={}", a.I, a.O, a.S)).collect();
        assert_eq!(text, ["I=+x O=-z S=+y", "I=+y O=-z S=-x", "I=+z O=+x S=+y"]);
    }

    #[test]
    fn impossible_mountings_are_named() {
        let mut left = Geometry::default();
        left.Y.S = "+x".parse().expect("an axis");
        assert!(matches!(left.validate(), Err(GeometryError::NotRightHanded { gyro: 'Y', .. })));
        let mut shared = Geometry::default();
        shared.Z = shared.X;
        let expected = GeometryError::SharedInput { sensors: "gyros", first: 'X', second: 'Z', axis: 'x' };
        assert_eq!(shared.validate(), Err(expected));
        assert!("w".parse::<SignedAxis>().is_err());
    }
}
