//! Names of errors that a scheme may leave out of its unknowns, as a bench states them.

use super::settings::is_family;
use super::terms::Term;
use crate::language::nearest;

/// Families of errors that are no coefficient, with their units.
pub(crate) const SITE_FAMILIES: [(&str, &str); 5] = [
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

/// Unit of the size of an error or of a family of errors: ug, ppm, arcsec, ...; `None` for an unknown name.
pub fn omitted_unit(name: &str) -> Option<&'static str> {
    let own = name.split('@').next().unwrap_or(name);
    let is = |family: &str| {
        own.strip_prefix(family).is_some_and(|rest| {
            rest.trim_start_matches('_').chars().all(|c| "XYZxyz".contains(c)) && rest.len() <= 3
        })
    };
    let site = SITE_FAMILIES.iter().find(|(family, _)| is(family)).map(|(_, unit)| *unit);
    site.or_else(|| Term::ALL.iter().find(|t| is(t.family())).map(|t| t.unit()))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_the_units_of_their_families() {
        for (names, unit) in [
            (&["K0", "K0_X"][..], Some("ug")),
            (&["M", "M_XY", "GM_ZX", "latitude", "attitude", "attitude_x@12"], Some("arcsec")),
            (&["K1_Z", "GS", "earth_rate", "gravity"], Some("ppm")),
            (&["D_F", "D_FX"], Some("deg/h")),
            (&["D_IIX", "D_OS"], Some("deg/h/g^2")),
            (&["K3_Y"], Some("ug/g^3")),
            (&["M_nonsense", "heat", ""], None),
        ] {
            names.iter().for_each(|name| assert_eq!(omitted_unit(name), unit, "{name}"));
        }
    }
}
