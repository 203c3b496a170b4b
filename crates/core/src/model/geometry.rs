//! How the gyros are mounted and which of their error coefficients are unknown.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A signed platform axis such as `+x` or `-z`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub struct SignedAxis {
    /// 0, 1, 2 for x, y, z.
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

/// The axes of one gyro: input I, output O, spin S, as signed platform axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the letters of IEEE Std 529")]
pub struct GyroAxes {
    /// Input axis.
    pub I: SignedAxis,
    /// Output axis.
    pub O: SignedAxis,
    /// Spin axis.
    pub S: SignedAxis,
}

/// The mounting of the X, Y and Z gyro. The default is the paper's, as it follows from its (22), (23),
/// (27) and (28).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the letters of the paper")]
pub struct Geometry {
    /// The gyro whose coefficients end in X.
    pub X: GyroAxes,
    /// The gyro whose coefficients end in Y.
    pub Y: GyroAxes,
    /// The gyro whose coefficients end in Z.
    pub Z: GyroAxes,
}

impl Default for Geometry {
    fn default() -> Self {
        let axis = |axis, negative| SignedAxis { axis, negative };
        Self {
            X: GyroAxes { I: axis(0, false), O: axis(2, true), S: axis(1, false) },
            Y: GyroAxes { I: axis(1, false), O: axis(2, true), S: axis(0, true) },
            Z: GyroAxes { I: axis(2, false), O: axis(0, false), S: axis(1, false) },
        }
    }
}

/// Why a mounting is impossible.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum GeometryError {
    /// Not an axis.
    #[error("`{found}` is not a platform axis; expected +x, -x, +y, -y, +z or -z")]
    Axis {
        /// The text found.
        found: String,
    },
    /// I, O, S of a gyro do not form a right-handed triad.
    #[error("the axes of gyro {gyro} (I={i} O={o} S={s}) are not right-handed; expected I x O = S")]
    NotRightHanded {
        /// X, Y or Z.
        gyro: char,
        /// Input axis.
        i: SignedAxis,
        /// Output axis.
        o: SignedAxis,
        /// Spin axis.
        s: SignedAxis,
    },
    /// Two gyros measure about the same axis.
    #[error(
        "gyros {first} and {second} both have their input axis along {axis}; expected three different axes"
    )]
    SharedInput {
        /// One gyro.
        first: char,
        /// The other.
        second: char,
        /// The axis: x, y or z.
        axis: char,
    },
}

/// The letters of the three gyros.
pub const GYROS: [char; 3] = ['X', 'Y', 'Z'];

impl Geometry {
    /// The three gyros in order X, Y, Z.
    pub fn gyros(&self) -> [GyroAxes; 3] {
        [self.X, self.Y, self.Z]
    }

    /// Checks that every gyro is right-handed and that the three input axes differ.
    ///
    /// # Errors
    /// [`GeometryError`] naming the gyro.
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
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            if gyros[a].I.axis == gyros[b].I.axis {
                let axis = ['x', 'y', 'z'][gyros[a].I.axis];
                return Err(GeometryError::SharedInput { first: GYROS[a], second: GYROS[b], axis });
            }
        }
        Ok(())
    }
}

/// A term of the gyro error model: `D_F`, the g-sensitive `D_I D_O D_S`, the g^2-sensitive rest
/// (IEEE Std 517 and 529).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "the letters say it: products of the components of g along I, O, S")]
pub enum Term {
    F,
    I,
    O,
    S,
    II,
    OO,
    SS,
    IO,
    IS,
    OS,
}

impl Term {
    /// All terms in the order of the unknowns.
    pub const ALL: [Self; 10] =
        [Self::F, Self::I, Self::O, Self::S, Self::II, Self::OO, Self::SS, Self::IO, Self::IS, Self::OS];

    /// The letters of the term.
    pub const fn letters(self) -> &'static str {
        match self {
            Self::F => "F",
            Self::I => "I",
            Self::O => "O",
            Self::S => "S",
            Self::II => "II",
            Self::OO => "OO",
            Self::SS => "SS",
            Self::IO => "IO",
            Self::IS => "IS",
            Self::OS => "OS",
        }
    }

    /// The gyro axes whose g components the term multiplies: none, one or two.
    pub fn factors(self, gyro: &GyroAxes) -> Vec<SignedAxis> {
        let letters = if self == Self::F { "" } else { self.letters() };
        letters
            .chars()
            .map(|letter| match letter {
                'I' => gyro.I,
                'O' => gyro.O,
                _ => gyro.S,
            })
            .collect()
    }

    /// The number of g factors.
    pub const fn order(self) -> usize {
        if matches!(self, Self::F) { 0 } else { self.letters().len() }
    }

    /// The unit of its coefficient.
    pub fn unit(self) -> &'static str {
        match self.letters().len() {
            _ if self == Self::F => "deg/h",
            1 => "deg/h/g",
            _ => "deg/h/g^2",
        }
    }
}

/// Why a list of terms is not usable.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TermError {
    /// Not a term.
    #[error(
        "`{found}` is not a term of the gyro model; expected some of F, I, O, S, II, OO, SS, IO, IS, OS, or `drift` alone"
    )]
    Unknown {
        /// The text found.
        found: String,
    },
    /// The same term twice.
    #[error("term {found} is listed twice; expected every term once")]
    Duplicate {
        /// The term.
        found: &'static str,
    },
}

/// What is unknown besides psi.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unknowns {
    /// The coefficients of these terms, for the three gyros.
    Coefficients(Vec<Term>),
    /// The total drift `eps^n` of a single position, with `psi` in n: (8), (9).
    Drift,
}

impl Default for Unknowns {
    fn default() -> Self {
        Self::Coefficients(vec![Term::F, Term::I, Term::O, Term::S])
    }
}

impl FromStr for Unknowns {
    type Err = TermError;

    /// A comma-separated list such as `F,I,O,S`, or `drift`.
    fn from_str(text: &str) -> Result<Self, TermError> {
        if text.trim() == "drift" {
            return Ok(Self::Drift);
        }
        let mut terms = Vec::new();
        for part in text.split(',') {
            let part = part.trim();
            let term = Term::ALL
                .into_iter()
                .find(|t| t.letters() == part)
                .ok_or_else(|| TermError::Unknown { found: part.into() })?;
            if terms.contains(&term) {
                return Err(TermError::Duplicate { found: term.letters() });
            }
            terms.push(term);
        }
        terms.sort_unstable();
        Ok(Self::Coefficients(terms))
    }
}

impl fmt::Display for Unknowns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Drift => f.write_str("drift"),
            Self::Coefficients(terms) => {
                let letters: Vec<&str> = terms.iter().map(|t| t.letters()).collect();
                f.write_str(&letters.join(","))
            }
        }
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
        let expected = GeometryError::SharedInput { first: 'X', second: 'Z', axis: 'x' };
        assert_eq!(shared.validate(), Err(expected));
        assert!("w".parse::<SignedAxis>().is_err());
    }

    #[test]
    fn term_lists() {
        let shown = |s: &str| s.parse::<Unknowns>().map(|u| u.to_string());
        assert_eq!(shown("S,F"), Ok("F,S".into()));
        assert_eq!(shown("drift"), Ok("drift".into()));
        assert_eq!(shown("F,F"), Err(TermError::Duplicate { found: "F" }));
        assert_eq!(shown("F,Q"), Err(TermError::Unknown { found: "Q".into() }));
        assert_eq!(shown(""), Err(TermError::Unknown { found: "".into() }));
    }
}
