//! Positions of a scheme, stations at which rows are taken, and the carry between positions.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::angle::{Angle, AngleError, excerpt};
use super::attitude::{Euler, Matrix3, Turned, c_n, cardinal, cardinal_name};
use super::dwell::Dwell;
use super::ring::Ring;
use super::rotation::{Rotation, SlewTo};

/// Carry: quantity that continues from one position to the next (the paper does not state it).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Carry {
    /// Platform carry: `psi^c` continues, as in the paper's simulation.
    #[default]
    Platform,
    /// Inertial carry: `psi^n` continues, as in real torqued slews.
    Inertial,
    /// Reset carry: `psi` is a new unknown at each position.
    Reset,
}

impl Carry {
    /// The three carries.
    pub const ALL: [Self; 3] = [Self::Platform, Self::Inertial, Self::Reset];
}

impl fmt::Display for Carry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Platform => "platform",
            Self::Inertial => "inertial",
            Self::Reset => "reset",
        })
    }
}

/// Error for a text that is not one of the three carries.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is not a carry; expected platform, inertial or reset")]
pub struct CarryError {
    /// The text found.
    pub found: String,
}

impl FromStr for Carry {
    type Err = CarryError;
    fn from_str(text: &str) -> Result<Self, CarryError> {
        Self::ALL.into_iter().find(|c| c.to_string() == text).ok_or_else(|| CarryError { found: text.into() })
    }
}

/// Position of a scheme.
#[derive(Debug, Clone, PartialEq)]
pub struct Position {
    /// Name in solutions: `p1`, `p2`, ... unless the scheme file names it.
    pub name: String,
    /// Euler angles.
    pub angles: Euler,
    /// Duration of the position; `None` if the scheme does not state it.
    pub dwell: Option<Dwell>,
    /// Rotation at a constant rate while Z is observed; the angles are those at its start.
    pub rotation: Option<Rotation>,
    /// Slew from the position before, if it differs from the conditions.
    pub slew: Option<SlewTo>,
}

/// Attitude at which derivative rows are taken: a position, or a point of a rotating segment.
#[derive(Debug, Clone, PartialEq)]
pub struct Station<'a> {
    /// Position or segment.
    pub position: &'a Position,
    /// Index of the position.
    pub index: usize,
    /// Turn of the segment up to this station; `None` at its start.
    pub turned: Option<Turned>,
    /// True if psi^n continues from the station before, whatever the carry.
    pub continues: bool,
    /// True for an end of a rotation that is judged by its output history: no derivative row is taken here.
    pub by_history: bool,
}

impl Station<'_> {
    /// All angles of the station.
    pub fn angles(&self) -> impl Iterator<Item = &Angle> {
        self.position.angles.iter().chain(self.turned.iter().map(|t| &t.angle))
    }

    /// Attitude `C_c^n` of the station.
    pub fn attitude<R: Ring>(
        &self,
        ring: &R,
        cos_sin: impl Fn(&Angle) -> (R::Element, R::Element),
    ) -> Matrix3<R::Element> {
        c_n(ring, &self.position.angles, self.turned.as_ref(), cos_sin)
    }
}

/// Reasons why a text is no attitude.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PositionError {
    /// The text has not three parts.
    #[error(
        "position `{text}` has {found} angle(s); expected three, as in 180,0,0, or three direction letters, as in NUE"
    )]
    Count {
        /// The text found.
        text: String,
        /// Number of parts.
        found: usize,
    },
    /// One of the three angles is wrong.
    #[error("position `{text}`, {which}: {error}")]
    Angle {
        /// The text found.
        text: String,
        /// Name of the wrong angle: alpha, beta or gamma.
        which: &'static str,
        /// Error of the angle.
        error: AngleError,
    },
    /// The three parts are not separated by commas.
    #[error("position `{text}` has no commas; expected them between the angles, as in {hint}")]
    Commas {
        /// The text found.
        text: String,
        /// Text with commas.
        hint: String,
    },
    /// The direction letters are lower case.
    #[error("position `{text}` has small letters; expected directions out of N S U D E W, as in {hint}")]
    SmallLetters {
        /// The text found.
        text: String,
        /// Text in capitals.
        hint: String,
    },
    /// The letters are no right-handed attitude.
    #[error(
        "`{found}` is not an attitude; expected the directions of X_p, Y_p, Z_p out of N S U D E W, \
         perpendicular and right-handed, as in NUE or NDW"
    )]
    Cardinal {
        /// The text found.
        found: String,
    },
}

/// Reads `a,b,g` (degrees or names) or three direction letters.
///
/// # Errors
/// [`PositionError`] naming the part that is wrong.
pub fn parse_attitude(text: &str) -> Result<Euler, PositionError> {
    let trimmed = text.trim();
    let letters = !trimmed.is_empty() && trimmed.chars().all(|c| "NSUDEW".contains(c));
    if letters && trimmed.len() == 3 {
        return cardinal(trimmed).ok_or_else(|| PositionError::Cardinal { found: trimmed.into() });
    }
    let capitals = trimmed.to_ascii_uppercase();
    if trimmed.len() == 3 && capitals != trimmed && capitals.chars().all(|c| "NSUDEW".contains(c)) {
        return Err(PositionError::SmallLetters { text: trimmed.into(), hint: capitals });
    }
    let parts: Vec<&str> = trimmed.split(',').collect();
    let [a, b, c] = parts[..] else {
        let text = excerpt(trimmed);
        let others: Vec<&str> = trimmed.split([' ', '\t', ';', ':', '/']).filter(|p| !p.is_empty()).collect();
        if let (1, [a, b, c]) = (parts.len(), &others[..]) {
            return Err(PositionError::Commas { hint: excerpt(&format!("{a},{b},{c}")), text });
        }
        let found = if trimmed.is_empty() { 0 } else { parts.len() };
        return Err(PositionError::Count { text, found });
    };
    let parse = |part: &str, which| {
        let wrap = |error| PositionError::Angle { text: excerpt(trimmed), which, error };
        part.parse::<Angle>().map_err(wrap)
    };
    Ok([parse(a, "alpha")?, parse(b, "beta")?, parse(c, "gamma")?])
}

impl Position {
    /// Direction letters if all angles are multiples of 90 degrees; `None` otherwise.
    pub fn cardinal(&self) -> Option<String> {
        cardinal_name(&self.angles)
    }
}

impl Position {
    /// Replaces the slew by the shortest turn at the same rate, for a scheme in which the position before
    /// has another attitude.
    pub fn take_shortest_way(&mut self) {
        let rate_deg_s = self.slew.as_ref().and_then(|s| s.rate_deg_s);
        self.slew = rate_deg_s.map(|rate| SlewTo { rate_deg_s: Some(rate), ..SlewTo::default() });
    }
}
