//! Scheme files: TOML, with errors that know their place.

use std::collections::BTreeMap;
use std::ops::Range;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_spanned::Spanned;

use super::angle::{Angle, parse_decimal};
use super::attitude::Euler;
use super::dwell::Dwell;
use super::geometry::{Geometry, Unknowns};
use super::rotation::{AxisError, MIN_ROTATION, Rotation, SlewTo, whole_angle};
use super::scheme::{Latitude, Position, Scheme, parse_attitude};
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
    /// What the scheme is called in a report; the name of the file when left out.
    #[serde(default)]
    name: String,
    /// What it is for, where it comes from: a report says so.
    #[serde(default)]
    description: String,
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
    /// The largest sigma allowed by unknown or family, as in D_F = 0.02: deg for psi, deg/h for D_F, deg/h/g for the rest.
    #[serde(default)]
    requirements: BTreeMap<String, f64>,
    /// How far the gimbals turn; freely when left out.
    #[serde(default)]
    gimbals: GimbalEntry,
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
    /// The way from the position before, with psi^n carried; Z is not used meanwhile.
    #[schemars(with = "Option<SlewEntry>")]
    slew: Option<Spanned<SlewEntry>>,
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
    /// The whole angle in degrees, right-handed. Two of angle_deg, rate_deg_s and the position's dwell_s say all; angle_deg alone
    /// goes with the dwell of the conditions.
    #[schemars(with = "Option<f64>")]
    angle_deg: Option<Spanned<toml::Value>>,
    /// The rate in deg/s, right-handed.
    #[schemars(with = "Option<f64>")]
    rate_deg_s: Option<Spanned<toml::Value>>,
}

/// A turn to a position at a constant rate.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SlewEntry {
    /// The rate in deg/s; slew_rate_deg_s of the simulation when left out.
    #[schemars(with = "Option<f64>")]
    rate_deg_s: Option<Spanned<f64>>,
    /// X_p, Y_p, Z_p (platform) or N, U, E (geographic); the shortest way about any axis when left out.
    #[schemars(with = "Option<String>")]
    about: Option<Spanned<String>>,
    /// The whole angle about that axis in degrees, right-handed; the shorter way when left out.
    #[schemars(with = "Option<f64>")]
    angle_deg: Option<Spanned<toml::Value>>,
}

/// Limits of the Euler angles as [low, high] in degrees.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GimbalEntry {
    /// Of alpha.
    #[schemars(with = "Option<[f64; 2]>")]
    alpha_deg: Option<Spanned<Vec<Spanned<toml::Value>>>>,
    /// Of beta.
    #[schemars(with = "Option<[f64; 2]>")]
    beta_deg: Option<Spanned<Vec<Spanned<toml::Value>>>>,
    /// Of gamma.
    #[schemars(with = "Option<[f64; 2]>")]
    gamma_deg: Option<Spanned<Vec<Spanned<toml::Value>>>>,
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
        name: file.name,
        description: file.description,
        geometry: file.geometry.as_ref().map(|g| *g.get_ref()).unwrap_or_default(),
        measured_azimuth: file.measured_azimuth,
        combinations: file.combinations,
        simulation: file.simulation,
        requirements: file.requirements,
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
    let g = &file.gimbals;
    for (slot, entry) in scheme.gimbals.limits.iter_mut().zip([&g.alpha_deg, &g.beta_deg, &g.gamma_deg]) {
        let Some(list) = entry else { continue };
        let limits: Option<Vec<i64>> =
            list.get_ref().iter().map(|v| parse_decimal(&literal(v)).ok()).collect();
        match limits.as_deref() {
            Some(&[low, high]) if low <= high => *slot = Some([low, high]),
            _ => {
                let message = format!(
                    "`{}` are no gimbal limits; expected [low, high] in decimal degrees",
                    &text[list.span()]
                );
                return Err(at(list.span(), message));
            }
        }
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
        let dwell =
            p.dwell_s.as_ref().map(|d| literal(d).parse::<Dwell>().map_err(|e| at(d.span(), e.to_string())));
        let mut dwell = dwell.transpose()?;
        let rotation = match &p.rotation {
            None => None,
            Some(r) => {
                let RotationEntry { about, angle_deg, rate_deg_s } = r.get_ref();
                let axis = about.get_ref().parse().map_err(|e: AxisError| at(about.span(), e.to_string()))?;
                let angle = |v: &Spanned<toml::Value>| {
                    whole_angle(&literal(v)).map_err(|e| at(v.span(), e.to_string()))
                };
                let angle = match (angle_deg, rate_deg_s, dwell) {
                    (Some(a), None, _) => angle(a)?,
                    (Some(a), Some(rate), None) => {
                        let (angle, seconds) = (angle(a)?, literal(rate).parse::<f64>());
                        // how long it takes needs no exact number
                        let seconds = seconds.map_or(f64::NAN, |x| angle.nanodeg() as f64 / 1e9 / x);
                        let wrong = || {
                            let message = "expected a rate in deg/s with the sign of angle_deg, that ends within 1000000 s";
                            at(rate.span(), message.into())
                        };
                        dwell = Some(Dwell::from_seconds(seconds).ok_or_else(wrong)?);
                        angle
                    }
                    (None, Some(rate), Some(dwell)) => turned(&literal(rate), dwell).ok_or_else(|| {
                        let message = format!(
                            "at `{}` deg/s for {dwell} s there is no exact angle of at least 0.001 degrees; expected a decimal",
                            literal(rate)
                        );
                        at(rate.span(), message)
                    })?,
                    _ => {
                        let message = "expected angle_deg, or rate_deg_s with either angle_deg or dwell_s of the position";
                        return Err(at(r.span(), message.into()));
                    }
                };
                Some(Rotation { axis, angle })
            }
        };
        let slew = match &p.slew {
            None => None,
            Some(s) if i == 0 => {
                return Err(at(s.span(), "a slew to the first position; expected none".into()));
            }
            Some(s) => {
                let SlewEntry { rate_deg_s, about, angle_deg } = s.get_ref();
                if let Some(rate) =
                    rate_deg_s.as_ref().filter(|r| !(r.get_ref().is_finite() && *r.get_ref() > 0.0))
                {
                    return Err(at(rate.span(), "expected a rate above 0 deg/s".into()));
                }
                if let (Some(angle), None) = (angle_deg, about) {
                    return Err(at(angle.span(), "an angle without an axis; expected `about` too".into()));
                }
                let axis = about
                    .as_ref()
                    .map(|a| a.get_ref().parse().map_err(|e: AxisError| at(a.span(), e.to_string())));
                let angle = angle_deg
                    .as_ref()
                    .map(|a| whole_angle(&literal(a)).map_err(|e| at(a.span(), e.to_string())));
                let rate_deg_s = rate_deg_s.as_ref().map(|r| *r.get_ref());
                Some(SlewTo { rate_deg_s, axis: axis.transpose()?, angle: angle.transpose()? })
            }
        };
        scheme.positions.push(Position { name, angles, dwell, rotation, slew });
        if let Some((_, attitude)) = scheme.positions.last().and_then(|p| scheme.gimbals.beyond(p)) {
            let message = format!("the gimbals do not reach {attitude}; expected {}", scheme.gimbals);
            return Err(at(entry.span(), message));
        }
    }
    Ok(scheme)
}

/// The exact angle of so many deg/s over a dwell, if it is a decimal.
fn turned(rate: &str, dwell: Dwell) -> Option<Angle> {
    let rate = i128::from(parse_decimal(rate).ok()?);
    let product = rate * i128::from(dwell.nanoseconds());
    let nanodeg = i64::try_from(product / 1_000_000_000).ok().filter(|_| product % 1_000_000_000 == 0)?;
    let limit = super::angle::MAX_DEGREES * 1_000_000_000;
    (MIN_ROTATION..=limit).contains(&nanodeg.abs()).then(|| Angle::from_nanodeg(nanodeg))
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
dwell_s = 100
rotation = { about = "E", rate_deg_s = -0.3 }
slew = { rate_deg_s = 2, about = "N", angle_deg = 180 }
[[position]]
angles_deg = [0, 0, 0]
rotation = { about = "Z_p", angle_deg = 45, rate_deg_s = 0.5 }
[requirements]
D_F = 0.01
[gimbals]
alpha_deg = [-180, 180.5]
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
        let [_, p2, p3] = &scheme.positions[..] else { panic!("three positions") };
        assert_eq!(p2.rotation.as_ref().map(ToString::to_string), Some("E:-30".into()));
        assert_eq!(p3.dwell.map(|d| d.seconds()), Some(90.0));
        let slew = p2.slew.clone().expect("a slew");
        assert_eq!(
            (slew.rate_deg_s, slew.axis, slew.angle),
            (Some(2.0), "N".parse().ok(), "180".parse().ok())
        );
        assert_eq!(scheme.requirements["D_F"], 0.01);
        assert_eq!(scheme.gimbals.limits, [Some([-180_000_000_000, 180_500_000_000]), None, None]);
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
        let entry = |keys: &str| place(&format!("[[position]]\nattitude=\"NUE\"\n{keys}"));
        assert_eq!(entry("rotation={about=\"U\"}").0.as_deref(), Some("{about=\"U\"}"));
        let third = entry("dwell_s=1\nrotation={about=\"U\",rate_deg_s=0.0001}");
        assert!(third.0.as_deref() == Some("0.0001") && third.1.contains("no exact angle"), "{third:?}");
        assert_eq!(entry("rotation={about=\"U\",rate_deg_s=-1,angle_deg=5}").0.as_deref(), Some("-1"));
        assert!(entry("slew={rate_deg_s=1}").1.contains("first position"));
        let slew = |keys: &str| entry(&format!("[[position]]\nattitude=\"NDW\"\nslew={{{keys}}}")).0;
        assert_eq!(slew("rate_deg_s=0").as_deref(), Some("0"));
        assert_eq!(slew("angle_deg=180").as_deref(), Some("180"));
        assert_eq!(slew("about=\"X\"").as_deref(), Some("\"X\""));
        let gimbals = |keys: &str| place(&format!("[[position]]\nangles_deg=[0,90,0]\n[gimbals]\n{keys}"));
        assert_eq!(gimbals("beta_deg=[80,-80]").0.as_deref(), Some("[80,-80]"));
        assert!(gimbals("beta_deg=[-80,80]").1.contains("0,90,0; expected beta from -80 to 80 deg"));
        assert!(place("carry = ").0.is_some());
        assert_eq!(place("").0, None);
    }
}
