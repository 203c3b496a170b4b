//! Words of a found scheme: criterion, unit, dwells and names of candidates.

use obsdeg_design::design::{Design, Found, SearchReport};
use obsdeg_evidence::requirements::{Miss, Requirements};

use crate::document::number;
use crate::{stated, words};

pub(super) fn criterion(name: &str) -> &'static str {
    match name {
        "A" => {
            "A: root of the mean variance of the coefficients (psi is estimated with them and does not count)"
        }
        "D" => {
            "D: geometric mean of the principal sigmas of the coefficients (psi is estimated with them and \
             does not count)"
        }
        "E" => {
            "E: largest principal sigma of the coefficients (psi is estimated with them and does not count)"
        }
        "margin" => {
            "margin: largest sigma over what is required, of psi too where every coefficient is asked for; \
             up to 1 all requirements are met"
        }
        _ => "worst: largest sigma of a coefficient (psi is estimated with them and does not count)",
    }
}

/// ` [deg/h, /g]`: the unit of the criterion, if it has one.
pub(super) fn unit(s: &SearchReport) -> String {
    match s.unit.as_deref() {
        Some(unit @ ("deg/h" | "ug")) => format!(" [{unit}, /g]"),
        Some(unit) => format!(" [{unit}]"),
        None => String::new(),
    }
}

/// `NUE (-N) NDW`: the positions in order, with the axes of the half turns between them.
pub(super) fn route(f: &Found) -> String {
    let mut out = Vec::new();
    for (i, position) in f.positions.iter().enumerate() {
        let turn = f.half_turns.iter().find(|t| t.to == i + 1);
        out.extend(turn.map(|t| format!("({})", words::direction(&t.about))));
        out.push(position.clone());
    }
    out.join(" ")
}

/// `0.5 (psi_y)`, and the unknowns without a margin.
pub(super) fn margin(r: &Requirements) -> String {
    let unseen: Vec<&str> =
        r.missed.iter().filter(|m| m.why != Miss::TooLarge).map(|m| m.name.as_str()).collect();
    let none = (!unseen.is_empty()).then(|| format!("none ({})", words::names(unseen)));
    none.or_else(|| stated::worst_margin(r)).unwrap_or_else(|| "-".into())
}

/// ` (900, 1100 s)`: dwells that are not equal.
pub(super) fn dwells(f: &Found) -> String {
    let listed: Vec<String> = f.dwells_s.iter().map(|s| number(*s)).collect();
    if listed.is_empty() { String::new() } else { format!(" ({} s)", listed.join(", ")) }
}

pub(super) fn candidates(names: &[String]) -> String {
    format!("{} candidates: {}", names.len(), shortened(names))
}

/// Names, at most thirty of them.
pub(super) fn shortened(names: &[String]) -> String {
    const SHOWN: usize = 30;
    let more =
        if names.len() > SHOWN { format!(" ... ({} more)", names.len() - SHOWN) } else { String::new() };
    format!("{}{more}", names.iter().take(SHOWN).cloned().collect::<Vec<_>>().join(" "))
}

/// Name of the scheme that a refined or divided one started from: the first of the search.
pub(super) fn searched(d: &Design) -> &'static str {
    match (d.found.iter().any(|f| f.refined), d.found.iter().any(|f| !f.dwells_s.is_empty())) {
        (false, false) => "the first",
        (true, false) => "the first that is not refined",
        (false, true) => "the first of equal dwells",
        (true, true) => "the first of equal dwells that is not refined",
    }
}
