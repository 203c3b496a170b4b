//! Largest degrees that a request allows.

use std::fmt;
use std::str::FromStr;

/// Largest degree of one coefficient or family, or of all that are required: `D_F=1`, `1`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DegreeCap {
    /// Coefficient or family; `None` stands for all required coefficients.
    pub name: Option<String>,
    /// Largest degree allowed.
    pub cap: usize,
}

impl fmt::Display for DegreeCap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.name {
            Some(name) => write!(f, "{name}={}", self.cap),
            None => write!(f, "{}", self.cap),
        }
    }
}

impl FromStr for DegreeCap {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, cap) = text.split_once('=').map_or((None, text), |(name, cap)| (Some(name.trim()), cap));
        let cap =
            cap.trim().parse().map_err(|_| format!("expected a degree, as in 1 or D_F=1, found `{text}`"))?;
        Ok(Self { name: name.map(Into::into), cap })
    }
}

/// Caps from the general to the single, so that a narrower name overrides a wider one in whatever order they
/// are given. Among equal names the last one counts.
pub(crate) fn widest_first(caps: &[DegreeCap]) -> Vec<&DegreeCap> {
    let mut out: Vec<&DegreeCap> = caps.iter().collect();
    out.sort_by_key(|c| c.name.as_ref().map_or(0, String::len));
    out
}
