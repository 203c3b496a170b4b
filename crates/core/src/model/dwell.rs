//! Dwell: duration of a position.

use std::fmt;
use std::str::FromStr;

use super::angle::{format_decimal, parse_decimal};
use crate::model::ranges::DWELL_S;

/// Dwell: duration of a position, an exact decimal of seconds.
///
/// ```
/// use obsdeg_core::model::Dwell;
/// assert_eq!("12.5".parse::<Dwell>()?.seconds(), 12.5);
/// assert!("0".parse::<Dwell>().is_err());
/// # Ok::<(), obsdeg_core::model::DwellError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Dwell {
    nanoseconds: u64,
}

/// Error for a text that is no dwell.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is not a dwell; expected {}, with at most nine decimals", DWELL_S)]
pub struct DwellError {
    /// The text found.
    pub found: String,
}

impl Dwell {
    /// The dwell of the paper's positions, 1000 s.
    pub const PAPER: Self = Self { nanoseconds: 1_000_000_000_000 };

    /// Dwell of `seconds` in s, to 1e-9 s. Sweeps exceed the range that schemes admit: `None` only outside
    /// 1e-9 to 1e9 s.
    pub fn from_seconds(seconds: f64) -> Option<Self> {
        let nanoseconds = (seconds * 1e9).round();
        (1.0..=1e18).contains(&nanoseconds).then_some(Self { nanoseconds: nanoseconds as u64 })
    }

    /// The dwell in 1e-9 s.
    pub(crate) fn nanoseconds(self) -> u64 {
        self.nanoseconds
    }

    /// The dwell in seconds.
    pub fn seconds(self) -> f64 {
        self.nanoseconds as f64 / 1e9
    }
}

impl FromStr for Dwell {
    type Err = DwellError;
    fn from_str(text: &str) -> Result<Self, DwellError> {
        let nanoseconds = parse_decimal(text.trim()).ok().and_then(|n| u64::try_from(n).ok());
        let dwell =
            nanoseconds.map(|nanoseconds| Self { nanoseconds }).filter(|d| DWELL_S.admits(d.seconds()));
        dwell.ok_or_else(|| DwellError { found: text.into() })
    }
}

impl fmt::Display for Dwell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // at most 1e18 ns
        f.write_str(&format_decimal(self.nanoseconds as i64))
    }
}
