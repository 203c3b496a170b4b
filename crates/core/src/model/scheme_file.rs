//! Scheme files: TOML, with errors that know their place.

use std::ops::Range;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_spanned::Spanned;

use super::angle::Angle;
use super::attitude::Euler;
use super::dwell::Dwell;
use super::geometry::{Geometry, Unknowns};
use super::scheme::{Latitude, Position, Rotation, RotationError, Scheme, parse_attitude};
use crate::simulation::conditions::Settings;

/// Why a file is no scheme.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct SchemeFileError {
    /// What is wrong, what was expected and what was found.
    pub message: String,
    /// Byte range in the file.
    pub span: Option<Range<usize>>,
}

/// The layout of a scheme file. Angles and the latitude are read as exact decimals.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SchemeFile {
    /// platform (default), inertial or reset.
    #[schemars(with = "Option<super::scheme::Carry>")]
    carry: Option<Spanned<String>>,
    /// Latitude in degrees; generic when left out.
    #[schemars(with = "Option<f64>")]
    latitude_deg: Option<Spanned<toml::Value>>,
    /// Unknown terms of the gyro model, for instance `["F", "I", "O", "S"]`, or `"drift"`.
    #[schemars(with = "Option<Vec<super::geometry::Term>>")]
    terms: Option<Spanned<TermList>>,
    /// Whether psi_y^n is measured too.
    #[serde(default)]
    measured_azimuth: bool,
    /// Axes of the gyros; the paper's when left out.
    #[schemars(with = "Option<Geometry>")]
    geometry: Option<Spanned<Geometry>>,
    /// Linear combinations of unknowns to be judged, for instance `"D_IX - D_IY"`.
    #[serde(default)]
    combinations: Vec<String>,
    /// Conditions of `obsdeg simulate` and `obsdeg crosscheck`.
    #[serde(default)]
    simulation: Settings,
    /// The positions in order.
    #[serde(default, rename = "position")]
    #[schemars(with = "Vec<PositionEntry>")]
    positions: Vec<Spanned<PositionEntry>>,
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum TermList {
    One(String),
    Many(Vec<String>),
}

/// One position: `angles_deg` or `attitude`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PositionEntry {
    /// Name in solutions; p1, p2, ... when left out.
    name: Option<String>,
    /// Euler angles alpha, beta, gamma in degrees; a string names a generic angle.
    #[schemars(with = "Option<Vec<f64>>")]
    angles_deg: Option<Spanned<Vec<Spanned<toml::Value>>>>,
    /// How long the position lasts, in seconds.
    #[schemars(with = "Option<f64>")]
    dwell_s: Option<Spanned<toml::Value>>,
    /// Makes the position a rotating segment that starts there; dwell_s is how long it turns.
    #[schemars(with = "Option<RotationEntry>")]
    rotation: Option<Spanned<RotationEntry>>,
    /// Directions of X_p, Y_p, Z_p out of N S U D E W, as in "NUE".
    #[schemars(with = "Option<String>")]
    attitude: Option<Spanned<String>>,
}

/// A rotation at a constant rate.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotationEntry {
    /// X_p, Y_p, Z_p (platform) or N, U, E (geographic).
    #[schemars(with = "String")]
    about: Spanned<String>,
    /// The whole angle in degrees, right-handed.
    #[schemars(with = "f64")]
    angle_deg: Spanned<toml::Value>,
}

/// Reads a scheme.
///
/// # Errors
/// [`SchemeFileError`] with the byte range of the offender.
pub fn read(text: &str) -> Result<Scheme, SchemeFileError> {
    let file: SchemeFile = toml::from_str(text)
        .map_err(|e| SchemeFileError { message: e.message().trim().to_string(), span: e.span() })?;
    let at = |span: Range<usize>, message: String| SchemeFileError { message, span: Some(span) };
    // numbers are read from the text itself, where they are exact
    let literal = |value: &Spanned<toml::Value>| match value.get_ref() {
        toml::Value::String(s) => s.clone(),
        _ => text[value.span()].replace('_', ""),
    };
    let mut scheme = Scheme {
        geometry: file.geometry.as_ref().map(|g| *g.get_ref()).unwrap_or_default(),
        measured_azimuth: file.measured_azimuth,
        combinations: file.combinations,
        simulation: file.simulation,
        ..Scheme::default()
    };
    if let Some(geometry) = &file.geometry {
        geometry.get_ref().validate().map_err(|e| at(geometry.span(), e.to_string()))?;
    }
    if let Some(carry) = &file.carry {
        scheme.carry = carry
            .get_ref()
            .parse()
            .map_err(|e: super::scheme::CarryError| at(carry.span(), e.to_string()))?;
    }
    if let Some(latitude) = &file.latitude_deg {
        let parsed: Result<Latitude, _> = literal(latitude).parse();
        scheme.latitude = Some(parsed.map_err(|e| at(latitude.span(), e.to_string()))?);
    }
    if let Some(terms) = &file.terms {
        let joined = match terms.get_ref() {
            TermList::One(s) => s.clone(),
            TermList::Many(list) => list.join(","),
        };
        let parsed: Result<Unknowns, _> = joined.parse();
        scheme.unknowns = parsed.map_err(|e| at(terms.span(), e.to_string()))?;
    }
    if file.positions.is_empty() {
        return Err(SchemeFileError {
            message: "no position; expected at least one [[position]] table".into(),
            span: None,
        });
    }
    for (i, entry) in file.positions.iter().enumerate() {
        let p = entry.get_ref();
        let angles: Euler = match (&p.angles_deg, &p.attitude) {
            (Some(list), None) => {
                let parse = |v: &Spanned<toml::Value>| {
                    literal(v).parse::<Angle>().map_err(|e| at(v.span(), e.to_string()))
                };
                let parsed: Result<Vec<Angle>, _> = list.get_ref().iter().map(parse).collect();
                parsed?.try_into().map_err(|found: Vec<Angle>| {
                    at(list.span(), format!("{} angle(s); expected three: alpha, beta, gamma", found.len()))
                })?
            }
            (None, Some(letters)) => {
                parse_attitude(letters.get_ref()).map_err(|e| at(letters.span(), e.to_string()))?
            }
            _ => {
                return Err(at(entry.span(), "expected either angles_deg or attitude in a position".into()));
            }
        };
        let name = p.name.clone().unwrap_or_else(|| format!("p{}", i + 1));
        let plain = |c: char| c.is_alphanumeric() || "_-. ".contains(c);
        if name.is_empty() || !name.chars().all(plain) {
            return Err(at(
                entry.span(),
                format!("position name `{name}`; expected letters, digits, `_`, `-`, `.` and blanks"),
            ));
        }
        let rotation = p.rotation.as_ref().map(|r| {
            let (about, angle) = (&r.get_ref().about, &r.get_ref().angle_deg);
            let text = literal(angle);
            Rotation::new(about.get_ref(), &text).map_err(|e| match e {
                RotationError::About { .. } => at(about.span(), e.to_string()),
                RotationError::Angle { .. } => at(angle.span(), e.to_string()),
            })
        });
        let dwell =
            p.dwell_s.as_ref().map(|d| literal(d).parse::<Dwell>().map_err(|e| at(d.span(), e.to_string())));
        scheme.positions.push(Position {
            name,
            angles,
            dwell: dwell.transpose()?,
            rotation: rotation.transpose()?,
        });
    }
    Ok(scheme)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Carry;

    #[test]
    fn reads_every_key() {
        let scheme = read(
            r#"
carry = "inertial"
latitude_deg = 28.2
terms = ["F", "I", "SS"]
measured_azimuth = true
combinations = ["D_IX - D_IY"]
geometry.X = { I = "+x", O = "+y", S = "+z" }
geometry.Y = { I = "+y", O = "+z", S = "+x" }
geometry.Z = { I = "+z", O = "+x", S = "+y" }
[[position]]
angles_deg = [0, -12.123456789, "alpha"]
[[position]]
name = "upside down"
attitude = "NDW"
"#,
        )
        .expect("a scheme");
        assert_eq!(scheme.carry, Carry::Inertial);
        assert_eq!(scheme.latitude.map(|l| l.to_string()), Some("28.2".into()));
        assert_eq!(scheme.unknowns.to_string(), "F,I,SS");
        assert_eq!(scheme.positions[0].angles_text(), "0,-12.123456789,alpha");
        assert_eq!(
            (scheme.positions[1].name.as_str(), scheme.positions[1].angles_text().as_str()),
            ("upside down", "180,0,0")
        );
        assert_eq!(scheme.validate(), Ok(()));
    }

    #[test]
    fn errors_know_their_place() {
        let place = |text: &str| {
            let e = read(text).expect_err("wrong");
            (e.span.map(|s| text[s].to_string()), e.message)
        };
        let (span, message) = place("carry = \"sideways\"\n[[position]]\nangles_deg=[0,0,0]");
        assert_eq!(span.as_deref(), Some("\"sideways\""));
        assert!(message.contains("expected platform, inertial or reset"));
        assert_eq!(place("[[position]]\nangles_deg=[0,0]").0.as_deref(), Some("[0,0]"));
        assert_eq!(place("[[position]]\nangles_deg=[0,0,1e3]").0.as_deref(), Some("1e3"));
        assert_eq!(place("[[position]]\nangles_deg=[0,0,nan]").0.as_deref(), Some("nan"));
        assert_eq!(place("latitude_deg = 91\n[[position]]\nattitude=\"NUE\"").0.as_deref(), Some("91"));
        assert!(place("[[position]]\nangels_deg=[0,0,0]").1.contains("unknown field"));
        let rotation = |about: &str, angle: &str| {
            place(&format!(
                "[[position]]\nattitude=\"NUE\"\nrotation={{about=\"{about}\",angle_deg={angle}}}"
            ))
            .0
        };
        assert_eq!(rotation("X", "90").as_deref(), Some("\"X\""));
        assert_eq!(rotation("X_p", "0.0").as_deref(), Some("0.0"));
        assert!(place("carry = ").0.is_some());
        assert_eq!(place("").0, None);
    }
}
