//! Names of errors that a scheme may leave out of its unknowns, as a bench states them.

use super::settings::is_family;
use super::terms::Term;
use crate::language::nearest;

/// Families of errors that are no coefficient, with their units.
pub const SITE_FAMILIES: [(&str, &str); 5] = [
    ("latitude", "arcsec"),
    ("azimuth", "arcsec"),
    ("earth_rate", "ppm"),
    ("gravity", "ppm"),
    ("attitude", "arcsec"),
];

/// True if some scheme can have an error or a family of errors of this name.
pub fn may_be_omitted(name: &str) -> bool {
    let attitude = |name: &str| {
        let own = name.split('@').next().unwrap_or(name);
        matches!(own, "attitude_x" | "attitude_y" | "attitude_z")
            && name.split_once('@').is_none_or(|(_, i)| i.parse::<usize>().is_ok_and(|i| i > 0))
    };
    let site = SITE_FAMILIES.iter().any(|(family, _)| *family == name);
    let state = ["psi", "eps"].contains(&name);
    site || attitude(name) || (is_family(name) && !state)
}

/// Hint for an unknown `name`: the nearest name of an error or family.
pub fn omitted_meant(name: &str) -> String {
    let site = SITE_FAMILIES.iter().map(|(family, _)| family.to_string());
    let all: Vec<String> = Term::ALL.iter().map(|t| t.family().to_string()).chain(site).collect();
    let expected = "expected an error such as K0_X, a family such as K0, M or GS, or latitude, azimuth, \
                    earth_rate, gravity, attitude";
    // letters of a term: its errors have the name of its family
    let term = Term::ALL.iter().find(|t| t.letters() == name).map(|t| t.family().to_string());
    match term.or_else(|| nearest(name, &all)) {
        Some(near) => format!("did you mean `{near}`? ({expected})"),
        None => expected.into(),
    }
}
