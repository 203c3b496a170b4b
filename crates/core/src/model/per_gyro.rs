//! Numbers per gyro: one for each of the three, or one for all.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ranges::{self, RangeError};

/// Noise of the X, Y and Z gyro, in the unit of the key; zero for none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct PerGyro(pub [f64; 3]);

/// Error for a text that is no noise of gyros.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{found}` is no noise of gyros; expected a number, or three as in 0.01,0.01,0.02 (X,Y,Z), each 0 or {}",
    ranges::GYRO_NOISE
)]
pub struct PerGyroError {
    /// The text found.
    pub found: String,
}

impl PerGyro {
    /// The same number for all gyros.
    pub fn all(x: f64) -> Self {
        Self([x; 3])
    }

    /// True if all numbers are zero.
    pub fn is_none(&self) -> bool {
        self.0 == [0.0; 3]
    }

    /// Numbers other than zero.
    pub(crate) fn amounts(self) -> impl Iterator<Item = f64> {
        self.0.into_iter().filter(|x| *x != 0.0)
    }

    /// Refuses numbers that are neither zero nor in their range.
    ///
    /// # Errors
    /// [`RangeError`] that names `what`.
    pub fn check(self, what: &str) -> Result<(), RangeError> {
        self.amounts().try_for_each(|x| ranges::GYRO_NOISE.check(what, x))
    }
}

impl FromStr for PerGyro {
    type Err = PerGyroError;
    fn from_str(text: &str) -> Result<Self, PerGyroError> {
        let wrong = || PerGyroError { found: text.into() };
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|x| x.trim().parse()).collect();
        let out = match numbers.map_err(|_| wrong())?[..] {
            [x] => Self::all(x),
            [x, y, z] => Self([x, y, z]),
            _ => return Err(wrong()),
        };
        out.check("").map_err(|_| wrong())?;
        Ok(out)
    }
}

impl fmt::Display for PerGyro {
    /// Text `0.01`, or `0.01, 0.01, 0.02` if the gyros differ.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.0;
        if x == y && y == z { write!(f, "{x}") } else { write!(f, "{x}, {y}, {z}") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_or_three() {
        assert_eq!("0.01".parse(), Ok(PerGyro::all(0.01)));
        assert_eq!("0, 1e-3,2".parse(), Ok(PerGyro([0.0, 1e-3, 2.0])));
        for wrong in ["", "0.01,0.02", "1,2,3,4", "-1", "nan", "1e-13", "0,0,1e7", "0.01 deg/h", "1;2;3"] {
            assert!(wrong.parse::<PerGyro>().is_err(), "{wrong}");
        }
        assert_eq!(
            (PerGyro::all(0.5).to_string(), PerGyro([1.0, 0.0, 1.0]).to_string()),
            ("0.5".into(), "1, 0, 1".into())
        );
        assert!("0".parse::<PerGyro>().is_ok_and(|x| x.is_none()) && !PerGyro([0.0, 0.0, 1.0]).is_none());
    }
}
