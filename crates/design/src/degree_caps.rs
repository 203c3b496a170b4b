//! Largest degrees that a request allows.

/// Largest degree of the unknowns of a name; without a name, of all.
pub(crate) type DegreeCap = (Option<String>, usize);

/// Caps from the general to the single, so that a narrower name overrides a wider one in whatever order they
/// are given. Among equal names the last one counts.
pub(crate) fn widest_first(caps: &[DegreeCap]) -> Vec<&DegreeCap> {
    let mut out: Vec<&DegreeCap> = caps.iter().collect();
    out.sort_by_key(|(name, _)| name.as_ref().map_or(0, String::len));
    out
}
