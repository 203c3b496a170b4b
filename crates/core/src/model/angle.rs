//! Euler angles: exact decimal degrees, names that stand for any angle, or a name with an offset.

use std::fmt;
use std::str::FromStr;

use obsdeg_exact::TurnFraction;

/// Decimals of a degree that are kept exactly.
pub(crate) const MAX_DECIMALS: usize = 9;
/// Largest magnitude of an angle in degrees.
pub(crate) const MAX_DEGREES: i64 = 1_000_000;
/// Largest number of characters of the name of an angle or a position.
pub(crate) const MAX_NAME: usize = 64;

/// Angle: `turn`, or `+-name + turn` for a generic angle.
///
/// ```
/// use obsdeg_core::model::Angle;
/// assert_eq!("-90".parse::<Angle>()?.to_string(), "-90");
/// assert_eq!("180-alpha".parse::<Angle>()?.to_string(), "-alpha+180");
/// assert!("1e3".parse::<Angle>().is_err());
/// # Ok::<(), obsdeg_core::model::AngleError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Angle {
    /// Constant part in 1e-9 degrees, as given (not reduced to a turn).
    nanodeg: i64,
    /// Name of the generic part, and true if it enters with a minus sign.
    generic: Option<(String, bool)>,
}

/// Reasons why a text is no angle.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AngleError {
    /// The text is empty.
    #[error("an angle is missing; expected decimal degrees such as -90 or 12.5, or a name such as alpha")]
    Empty,
    /// The number is NaN or infinite.
    #[error("angle `{found}` is not finite; expected decimal degrees such as -90 or 12.5")]
    NotFinite {
        /// The text found.
        found: String,
    },
    /// The text is neither a number nor a name.
    #[error(
        "angle `{found}` is not a number; expected decimal degrees such as -90 or 12.5, or a name such as alpha"
    )]
    NotANumber {
        /// The text found.
        found: String,
    },
    /// The number has more decimals than are kept exactly.
    #[error(
        "angle `{found}` has {decimals} decimals; expected at most {MAX_DECIMALS} (angles are exact, not rounded)"
    )]
    TooManyDecimals {
        /// The text found.
        found: String,
        /// Number of decimals found.
        decimals: usize,
    },
    /// The number exceeds the largest magnitude of an angle.
    #[error("angle `{found}` is out of range; expected at most {MAX_DEGREES} degrees in magnitude")]
    TooLarge {
        /// The text found.
        found: String,
    },
    /// The name is too long for formulas and tables.
    #[error("the name `{beginning}...` of an angle has {found} characters; expected at most {MAX_NAME}")]
    LongName {
        /// First characters of the name.
        beginning: String,
        /// Number of characters of the name.
        found: usize,
    },
    /// The name has another meaning.
    #[error("`{found}` cannot name an angle: it already stands for something in the formulas")]
    Reserved {
        /// Name found.
        found: String,
    },
}

/// Beginning of a text, short enough for a message.
pub(crate) fn excerpt(text: &str) -> String {
    let short: String = text.chars().take(60).collect();
    if short.len() < text.len() { short + "..." } else { short }
}

/// Exact decimal degrees in units of 1e-9 degrees.
///
/// # Errors
/// [`AngleError`] for anything but an optional sign, digits and up to nine decimals.
pub fn parse_decimal(text: &str) -> Result<i64, AngleError> {
    let found = || excerpt(text);
    if text.is_empty() {
        return Err(AngleError::Empty);
    }
    let (negative, digits) = match text.as_bytes()[0] {
        b'-' => (true, &text[1..]),
        b'+' => (false, &text[1..]),
        _ => (false, text),
    };
    if matches!(digits.to_ascii_lowercase().as_str(), "nan" | "inf" | "infinity") {
        return Err(AngleError::NotFinite { found: found() });
    }
    let (whole, decimals) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
    if whole.len() + decimals.len() == 0 || !all_digits(whole) || !all_digits(decimals) {
        return Err(AngleError::NotANumber { found: found() });
    }
    let significant = decimals.trim_end_matches('0');
    if significant.len() > MAX_DECIMALS {
        return Err(AngleError::TooManyDecimals { found: found(), decimals: significant.len() });
    }
    let whole = whole.trim_start_matches('0');
    let too_large = || AngleError::TooLarge { found: found() };
    let whole: i64 = if whole.is_empty() { 0 } else { whole.parse().map_err(|_| too_large())? };
    let padded = format!("{significant:0<MAX_DECIMALS$}");
    let fraction: i64 = padded.parse().map_err(|_| too_large())?;
    if whole > MAX_DEGREES || (whole == MAX_DEGREES && fraction > 0) {
        return Err(too_large());
    }
    let magnitude = whole * 1_000_000_000 + fraction;
    Ok(if negative { -magnitude } else { magnitude })
}

/// Shortest decimal text of an angle in 1e-9 degrees.
pub fn format_decimal(nanodeg: i64) -> String {
    let (sign, m) = (if nanodeg < 0 { "-" } else { "" }, nanodeg.unsigned_abs());
    let fraction = format!("{:09}", m % 1_000_000_000);
    let fraction = fraction.trim_end_matches('0');
    let dot = if fraction.is_empty() { "" } else { "." };
    format!("{sign}{}{dot}{fraction}", m / 1_000_000_000)
}

impl Angle {
    /// The angle of `nanodeg` 1e-9 degrees.
    pub fn from_nanodeg(nanodeg: i64) -> Self {
        Self { nanodeg, generic: None }
    }

    /// The angle of a whole number of degrees.
    pub fn from_degrees(deg: i32) -> Self {
        Self::from_nanodeg(i64::from(deg) * 1_000_000_000)
    }

    /// The constant part in 1e-9 degrees, as given.
    pub fn nanodeg(&self) -> i64 {
        self.nanodeg
    }

    /// The constant part, modulo a turn.
    pub fn turn(&self) -> TurnFraction {
        TurnFraction::from_nanodeg(self.nanodeg)
    }

    /// The generic part: its name, and true for a minus sign.
    pub fn generic(&self) -> Option<(&str, bool)> {
        self.generic.as_ref().map(|(name, minus)| (name.as_str(), *minus))
    }

    /// Angle in degrees; `None` when it is generic.
    pub fn degrees(&self) -> Option<f64> {
        self.generic.is_none().then_some(self.nanodeg as f64 / 1e9)
    }

    fn named(name: &str, minus: bool, nanodeg: i64) -> Result<Self, AngleError> {
        let mut bytes = name.bytes();
        let letter_first = bytes.next().is_some_and(|b| b.is_ascii_alphabetic());
        if !letter_first || !bytes.all(|b| b.is_ascii_alphanumeric() || b == b'_') {
            return Err(AngleError::NotANumber { found: excerpt(name) });
        }
        if matches!(name.to_ascii_lowercase().as_str(), "nan" | "inf" | "infinity") {
            return Err(AngleError::NotFinite { found: name.into() });
        }
        if name.len() > MAX_NAME {
            return Err(AngleError::LongName { beginning: name[..12].into(), found: name.len() });
        }
        let taken = matches!(name, "wN" | "wU" | "sin" | "cos" | "tan" | "sqrt" | "deg")
            || ["D_", "psi", "eps", "Z", "r_", "s_", "c_", "t_"].iter().any(|p| name.starts_with(p));
        if taken {
            return Err(AngleError::Reserved { found: name.into() });
        }
        Ok(Self { nanodeg, generic: Some((name.into(), minus)) })
    }
}

impl FromStr for Angle {
    type Err = AngleError;

    fn from_str(text: &str) -> Result<Self, AngleError> {
        let text = text.trim();
        // split `+-number` and `+-name` at a sign inside the text
        let split = text.char_indices().skip(1).find(|&(_, c)| c == '+' || c == '-').map(|(i, _)| i);
        let is_name =
            |s: &str| s.trim_start_matches(['+', '-']).starts_with(|c: char| c.is_ascii_alphabetic());
        let signed = |s: &str, nanodeg: i64| {
            let minus = s.starts_with('-');
            Self::named(s.strip_prefix(['+', '-']).unwrap_or(s), minus, nanodeg)
        };
        match split.map(|i| (&text[..i], &text[i..])) {
            Some((a, b)) if is_name(a) && !is_name(b) => signed(a, parse_decimal(b)?),
            Some((a, b)) if !is_name(a) && is_name(b) => signed(b, parse_decimal(a)?),
            Some(_) => Err(AngleError::NotANumber { found: excerpt(text) }),
            None if is_name(text) => signed(text, 0),
            None => parse_decimal(text).map(Self::from_nanodeg),
        }
    }
}

impl fmt::Display for Angle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.generic {
            None => f.write_str(&format_decimal(self.nanodeg)),
            Some((name, minus)) => {
                write!(f, "{}{name}", if *minus { "-" } else { "" })?;
                match self.nanodeg {
                    0 => Ok(()),
                    n if n > 0 => write!(f, "+{}", format_decimal(n)),
                    n => f.write_str(&format_decimal(n)),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accepted() {
        for (text, shown) in [
            ("0", "0"),
            ("-90", "-90"),
            ("+12.50", "12.5"),
            (".5", "0.5"),
            ("360.000000001", "360.000000001"),
            ("0.1000000000000", "0.1"),
            ("alpha", "alpha"),
            ("-alpha", "-alpha"),
            ("90-alpha", "-alpha+90"),
            ("alpha-0.5", "alpha-0.5"),
        ] {
            assert_eq!(text.parse::<Angle>().expect("an angle").to_string(), shown, "{text}");
        }
    }

    #[test]
    fn refused() {
        for text in [
            "",
            "nan",
            "-inf",
            "Infinity",
            "1e3",
            "1..2",
            "1.2.3",
            "0x10",
            "1.0000000001",
            "1000001",
            "99999999999999999999",
            "alpha+beta",
            "2alpha",
            "alpha*2",
            "psi_x",
            "wN",
            "-",
            "١٢",
        ] {
            assert!(text.parse::<Angle>().is_err(), "{text}");
        }
    }
}
