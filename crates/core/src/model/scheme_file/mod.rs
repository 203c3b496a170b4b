//! Scheme files: TOML, with errors that state their place.

mod layout;
mod position;
mod write;

use std::collections::HashMap;
use std::ops::Range;

use serde_spanned::Spanned;

pub use layout::SchemeFile;
pub use write::write;

use super::acceptance::Acceptance;
use super::angle::parse_decimal;
use super::path::{Path, PathError};
use super::per_gyro::PerGyro;
use super::platform::Platform;
use super::scheme::{Latitude, Scheme};
use super::terms::{DefinedBy, Unknowns};
use crate::language::file_error::explain;
use crate::model::settings::Settings;
use crate::model::{combination, settings};
use layout::{AcceptanceEntry, GimbalEntry, Literal, Numbers, SimulationEntry};

/// Longest scheme file, in bytes: a thousand positions with all their keys.
pub const MAX_FILE: usize = 1_000_000;

/// Error for a file that is no scheme.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct SchemeFileError {
    /// Fault, expected value and value found.
    pub message: String,
    /// Byte range in the file; `None` if it is unknown.
    pub span: Option<Range<usize>>,
}

/// Reader of a file: its text, and the byte ranges of the values of its keys.
struct SchemeReader<'a> {
    text: &'a str,
    /// Byte ranges by key, as in `simulation.priors.D_F` or `position.0.name`; names in lists by the key of
    /// the list.
    places: HashMap<String, Range<usize>>,
}

impl SchemeReader<'_> {
    fn at(&self, span: Range<usize>, message: impl Into<String>) -> SchemeFileError {
        SchemeFileError { message: message.into(), span: Some(span) }
    }

    /// Text of a number in the file, which is its exact decimal.
    fn number(&self, value: &Spanned<toml::Value>) -> Result<String, SchemeFileError> {
        match value.get_ref() {
            toml::Value::Integer(_) | toml::Value::Float(_) => Ok(self.text[value.span()].replace('_', "")),
            _ => {
                let found = super::angle::excerpt(&self.text[value.span()]);
                Err(self.at(value.span(), format!("found {found}; expected a number")))
            }
        }
    }

    /// The value of a key; stores its byte range.
    fn keep<T: Clone>(&mut self, key: impl Into<String>, value: Option<&Spanned<T>>) -> Option<T> {
        let value = value?;
        self.places.insert(key.into(), value.span());
        Some(value.get_ref().clone())
    }

    /// Byte range of a part of a text in quotes; the range of the whole text if it has escapes.
    fn within(&self, value: &Spanned<String>, range: Range<usize>) -> Range<usize> {
        let (span, text) = (value.span(), value.get_ref());
        match self.text[span.clone()].find(text.as_str()) {
            Some(quotes) if !text.is_empty() => {
                let start = span.start + quotes;
                start + range.start.min(text.len())..start + range.end.min(text.len())
            }
            _ => span,
        }
    }

    /// Carry, latitude, unknown terms and path.
    fn conditions(&mut self, file: &SchemeFile, scheme: &mut Scheme) -> Result<(), SchemeFileError> {
        if let Some(carry) = &file.carry {
            scheme.carry = carry
                .get_ref()
                .parse()
                .map_err(|e: super::scheme::CarryError| self.at(carry.span(), e.to_string()))?;
        }
        if let Some(latitude) = &file.latitude_deg {
            let parsed: Result<Latitude, _> = self.number(latitude)?.parse();
            scheme.latitude = Some(parsed.map_err(|e| self.at(latitude.span(), e.to_string()))?);
        }
        let frame = file.frame.as_ref();
        let frame = frame
            .map(|f| f.get_ref().parse::<DefinedBy>().map_err(|e| self.at(f.span(), e.to_string())))
            .transpose()?;
        if let Some(terms) = &file.terms {
            self.places.insert("terms".into(), terms.span());
            scheme.unknowns = self.terms(terms, frame)?;
        } else if let Some(f) = &file.frame {
            return Err(self.at(f.span(), "a frame without terms; expected terms such as [\"all\"]"));
        }
        if let Some(path) = &file.path {
            self.places.insert("path".into(), path.span());
            let parsed: Result<Path, PathError> = path.get_ref().parse();
            scheme.path = Some(parsed.map_err(|e| self.at(path.span(), e.to_string()))?);
        }
        Ok(())
    }

    fn numbers(&mut self, key: &str, list: &Numbers) -> std::collections::BTreeMap<String, f64> {
        let kept = list.iter().map(|(name, x)| {
            // a wrong name is marked at the name, a wrong number at the number
            let place = if settings::may_be_unknown(name.get_ref()) { x.span() } else { name.span() };
            self.places.insert(format!("{key}.{}", name.get_ref()), place);
            (name.get_ref().clone(), *x.get_ref())
        });
        kept.collect()
    }

    fn acceptance(&mut self, entry: &AcceptanceEntry) -> Acceptance {
        let limits = entry.limits.iter().map(|(name, limit)| {
            let known = settings::may_be_unknown(name.get_ref());
            let place = if known { limit.span() } else { name.span() };
            self.places.insert(format!("acceptance.limits.{}", name.get_ref()), place);
            (name.get_ref().clone(), (*limit.get_ref()).into())
        });
        let limits = limits.collect();
        Acceptance { limits, risk: self.keep("acceptance.risk", entry.risk.as_ref()) }
    }

    /// Noise of the gyros: a number, or a list of three.
    fn per_gyro(&mut self, key: String, value: &Literal) -> Result<Option<PerGyro>, SchemeFileError> {
        let Some(value) = value else { return Ok(None) };
        let number = |v: &toml::Value| v.as_float().or_else(|| v.as_integer().map(|i| i as f64));
        let found = match value.get_ref() {
            toml::Value::Array(list) => {
                let numbers: Option<Vec<f64>> = list.iter().map(number).collect();
                numbers.and_then(|n| n.try_into().ok()).map(PerGyro)
            }
            one => number(one).map(PerGyro::all),
        };
        let message =
            "expected a number, or a list of three for the gyros X, Y, Z such as [0.01, 0.01, 0.02]";
        let found = found.ok_or_else(|| self.at(value.span(), message))?;
        self.places.insert(key, value.span());
        Ok(Some(found))
    }

    fn settings(&mut self, s: &SimulationEntry) -> Result<Settings, SchemeFileError> {
        let key = |key: &str| format!("simulation.{key}");
        Ok(Settings {
            truth: s.truth,
            filter: s.filter,
            propagation: s.propagation,
            step_s: self.keep(key("step_s"), s.step_s.as_ref()),
            dwell_s: self.keep(key("dwell_s"), s.dwell_s.as_ref()),
            slew_rate_deg_s: self.keep(key("slew_rate_deg_s"), s.slew_rate_deg_s.as_ref()),
            accelerometer_noise_g: self.keep(key("accelerometer_noise_g"), s.accelerometer_noise_g.as_ref()),
            accelerometer_bias_instability_ug: self
                .keep(key("accelerometer_bias_instability_ug"), s.accelerometer_bias_instability_ug.as_ref()),
            accelerometer_correlation_time_s: self
                .keep(key("accelerometer_correlation_time_s"), s.accelerometer_correlation_time_s.as_ref()),
            azimuth_noise_deg: self.keep(key("azimuth_noise_deg"), s.azimuth_noise_deg.as_ref()),
            drift_noise: self.keep(key("drift_noise"), s.drift_noise.as_ref()),
            angle_random_walk_deg_sqrt_h: self
                .per_gyro(key("angle_random_walk_deg_sqrt_h"), &s.angle_random_walk_deg_sqrt_h)?,
            rate_random_walk_dph_sqrt_h: self
                .per_gyro(key("rate_random_walk_dph_sqrt_h"), &s.rate_random_walk_dph_sqrt_h)?,
            bias_instability_dph: self.per_gyro(key("bias_instability_dph"), &s.bias_instability_dph)?,
            correlation_time_s: self.keep(key("correlation_time_s"), s.correlation_time_s.as_ref()),
            drift_scale: self.keep(key("drift_scale"), s.drift_scale.as_ref()),
            values: self.numbers("simulation.values", &s.values),
            estimates: self.numbers("simulation.estimates", &s.estimates),
            priors: self.numbers("simulation.priors", &s.priors),
        })
    }

    /// Unknown terms `["F", "I"]`, or `"F,I"`, with the frame that decides the misalignments.
    fn terms(
        &self,
        terms: &Spanned<toml::Value>,
        frame: Option<DefinedBy>,
    ) -> Result<Unknowns, SchemeFileError> {
        let kind = |found: &str| {
            let message = format!("found {found}; expected a list such as [\"F\", \"I\"], or \"drift\"");
            self.at(terms.span(), message)
        };
        let text = |value: &toml::Value| {
            let other =
                || kind(if value.is_integer() || value.is_float() { "a number" } else { "something else" });
            value.as_str().map(String::from).ok_or_else(other)
        };
        let joined = match terms.get_ref() {
            toml::Value::Array(list) => list.iter().map(text).collect::<Result<Vec<_>, _>>()?.join(","),
            other => text(other)?,
        };
        Unknowns::of(&joined, frame).map_err(|e| self.at(terms.span(), e.to_string()))
    }

    fn gimbals(&self, g: &GimbalEntry, scheme: &mut Scheme) -> Result<(), SchemeFileError> {
        let entries = [&g.alpha_deg, &g.beta_deg, &g.gamma_deg];
        for (slot, entry) in scheme.gimbals.limits.iter_mut().zip(entries) {
            let Some(list) = entry else { continue };
            let limits: Option<Vec<i64>> =
                list.get_ref().iter().map(|v| parse_decimal(&self.number(v).ok()?).ok()).collect();
            match limits.as_deref() {
                Some(&[low, high]) if low <= high => *slot = Some([low, high]),
                _ => {
                    let found = super::angle::excerpt(&self.text[list.span()]);
                    let message =
                        format!("`{found}` are no gimbal limits; expected [low, high] in decimal degrees");
                    return Err(self.at(list.span(), message));
                }
            }
        }
        Ok(())
    }

    /// Checks a scheme; an error has the byte range of the key at fault.
    fn validated(&self, scheme: Scheme, combinations: &[Spanned<String>]) -> Result<Scheme, SchemeFileError> {
        let platform = Platform::new(scheme).map_err(|e| {
            let span = e.key().and_then(|key| self.places.get(&key)).cloned();
            SchemeFileError { message: e.to_string(), span }
        })?;
        let scheme = platform.scheme();
        let lists = scheme.simulation.lists().map(|(key, list, _)| (format!("simulation.{key}"), list));
        for (key, list) in lists.into_iter().chain([("requirements".into(), &scheme.requirements)]) {
            let concerned = |name: &String| platform.names().iter().any(|n| settings::concerns(name, n));
            let strange = list.keys().find(|name| !concerned(name));
            if let Some(name) = strange {
                let message =
                    format!("`{name}`: no such unknown; {}", settings::known(platform.names(), name));
                let span = self.places.get(&format!("{key}.{name}")).cloned();
                return Err(SchemeFileError { message, span });
            }
        }
        let concerned = |name: &String| platform.names().iter().any(|n| settings::concerns(name, n));
        if let Some(name) = scheme.acceptance.limits.keys().find(|name| !concerned(name)) {
            let message =
                format!("limits of `{name}`: no such unknown; {}", settings::known(platform.names(), name));
            let span = self.places.get(&format!("acceptance.limits.{name}")).cloned();
            return Err(SchemeFileError { message, span });
        }
        for text in combinations {
            combination::check(text.get_ref(), &platform)
                .map_err(|e| self.at(self.within(text, e.span()), format!("combination: {e}")))?;
        }
        Ok(platform.into_scheme())
    }
}

/// True if a text is meant as a scheme.
pub fn is_scheme(text: &str) -> bool {
    text.lines().map(str::trim_start).any(|l| {
        l.starts_with("[[position]]")
            || l.strip_prefix("position").is_some_and(|r| r.trim_start().starts_with('='))
    })
}

/// Reads a scheme and checks all of it.
///
/// # Errors
/// [`SchemeFileError`] with the byte range of the fault.
pub fn read(text: &str) -> Result<Scheme, SchemeFileError> {
    let whole = |message: String| SchemeFileError { message, span: None };
    if text.len() > MAX_FILE {
        return Err(whole(format!("{} bytes; expected a scheme file of at most {MAX_FILE}", text.len())));
    }
    let file: SchemeFile = toml::from_str(text).map_err(|e| {
        let (message, span) = explain::<SchemeFile>(text, &e);
        SchemeFileError { message, span }
    })?;
    let mut r = SchemeReader { text, places: HashMap::new() };
    let mut scheme = Scheme {
        name: r.keep("name", file.name.as_ref()).unwrap_or_default(),
        description: r.keep("description", file.description.as_ref()).unwrap_or_default(),
        document: r.keep("document", file.document.as_ref()).unwrap_or_default(),
        geometry: r.keep("geometry", file.geometry.as_ref()).unwrap_or_default(),
        measured_azimuth: file.measured_azimuth,
        simulation: r.settings(&file.simulation)?,
        requirements: r.numbers("requirements", &file.requirements),
        bench: r.numbers("bench", &file.bench),
        ageing: r.numbers("ageing", &file.ageing),
        acceptance: r.acceptance(&file.acceptance),
        ..Scheme::default()
    };
    if let Some(record) = &file.record {
        scheme.recording = record.get_ref().clone().into();
        scheme.recording.check().map_err(|e| r.at(record.span(), format!("record: {e}")))?;
    }
    for (i, text) in file.combinations.iter().enumerate() {
        scheme.combinations.extend(r.keep(format!("combinations.{i}"), Some(text)));
        r.places.insert("combinations".into(), text.span());
    }
    r.conditions(&file, &mut scheme)?;
    r.gimbals(&file.gimbals, &mut scheme)?;
    if file.positions.is_empty() {
        return Err(whole("no position; expected at least one [[position]] table".into()));
    }
    for (i, entry) in file.positions.iter().enumerate() {
        let position = r.position(i, entry)?;
        scheme.positions.push(position);
    }
    r.validated(scheme, &file.combinations)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Carry, SlewAxis, SlewTo};

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
slew = { about = [1, -0.5, 0] }
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
        assert_eq!(crate::model::angles_text(&scheme.positions[0].angles), "0,-12.123456789,alpha");
        assert_eq!(
            (
                scheme.positions[1].name.as_str(),
                crate::model::angles_text(&scheme.positions[1].angles).as_str()
            ),
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
        let direction = SlewAxis::Direction([1.0, -0.5, 0.0]);
        assert_eq!(p3.slew, Some(SlewTo { axis: Some(direction), ..SlewTo::default() }));
        assert_eq!(scheme.requirements["D_F"], 0.01);
        assert_eq!(scheme.gimbals.limits, [Some([-180_000_000_000, 180_500_000_000]), None, None]);
        assert_eq!(scheme.validate(), Ok(()));
    }

    /// Message of the error in a text, and the part of the text that it marks.
    fn place(text: &str) -> (Option<String>, String) {
        let e = read(text).expect_err("wrong");
        (e.span.map(|s| text[s].to_string()), e.message)
    }

    #[test]
    fn errors_know_their_place() {
        let (span, message) = place("carry = \"sideways\"\n[[position]]\nangles_deg=[0,0,0]");
        assert_eq!(span.as_deref(), Some("\"sideways\""));
        assert!(message.contains("expected platform, inertial or reset"));
        assert_eq!(place("[[position]]\nangles_deg=[0,0]").0.as_deref(), Some("[0,0]"));
        assert_eq!(place("[[position]]\nangles_deg=[0,0,1e3]").0.as_deref(), Some("1e3"));
        assert_eq!(place("[[position]]\nangles_deg=[0,0,nan]").0.as_deref(), Some("nan"));
        assert_eq!(place("[[position]]\nangles_deg=[0,0,true]").1, "found true; expected a number");
        assert_eq!(
            place("latitude_deg = \"28\"\n[[position]]\nattitude=\"NUE\"").1,
            "found \"28\"; expected a number"
        );
        assert_eq!(place("latitude_deg = 91\n[[position]]\nattitude=\"NUE\"").0.as_deref(), Some("91"));
        assert!(place("[[position]]\nangels_deg=[0,0,0]").1.contains("did you mean `angles_deg`?"));
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
        for wrong in ["[0, 0, 0]", "[1, 2]", "[1, 0, nan]", "[1, 0, \"E\"]", "3"] {
            assert_eq!(slew(&format!("about={wrong}")).as_deref(), Some(wrong));
        }
        let gimbals = |keys: &str| place(&format!("[[position]]\nangles_deg=[0,90,0]\n[gimbals]\n{keys}"));
        assert_eq!(gimbals("beta_deg=[80,-80]").0.as_deref(), Some("[80,-80]"));
        assert!(gimbals("beta_deg=[-80,80]").1.contains("(0,90,0); expected beta from -80 to 80 deg"));
        assert!(place("carry = ").0.is_some());
        assert_eq!(place("").0, None);
    }

    /// Every number and every name is checked, whatever the command uses, and marked at its place.
    #[test]
    fn the_whole_file_is_checked() {
        const ONE: &str = "[[position]]\nangles_deg=[0,0,0]\n";
        let drawn = |keys: &str, offender: &str, said: &str| {
            let (span, message) = place(&format!("{ONE}{keys}"));
            assert_eq!(span.as_deref(), Some(offender), "{keys}: {message}");
            assert!(message.contains(said), "{keys}: {message}");
        };
        let numbers = [
            "step_s",
            "dwell_s",
            "slew_rate_deg_s",
            "accelerometer_noise_g",
            "azimuth_noise_deg",
            "drift_scale",
        ];
        for key in numbers {
            for x in ["-5", "0", "nan", "inf", "1e-300", "1e200"] {
                drawn(&format!("[simulation]\n{key} = {x}"), x, "; expected ");
            }
            drawn(&format!("[simulation]\n{key} = \"5\""), "\"5\"", "expected a number");
        }
        for list in ["requirements", "simulation.priors"] {
            for x in ["-0.1", "0", "nan", "1e-300", "1e200"] {
                drawn(&format!("[{list}]\nD = {x}"), x, "; expected ");
            }
        }
        for list in ["requirements", "simulation.priors", "simulation.values", "simulation.estimates"] {
            drawn(&format!("[{list}]\nD_FX = true"), "true", "expected a number");
            drawn(&format!("[{list}]\nD_QX = 0.1"), "D_QX", "no such unknown");
            drawn(&format!("[{list}]\n\"psi_x@2\" = 0.1"), "0.1", "no such unknown");
            drawn(&format!("[{list}]\neps_x = 0.1"), "0.1", "no such unknown");
            drawn(&format!("[{list}]\nD_FX = inf"), "inf", "; expected ");
            drawn(&format!("[{list}]\nD_SS = 0.1"), "0.1", "no such unknown");
            let second = format!("terms = [\"F\", \"SS\"]\n{ONE}[{list}]\nD_SS = 0.1\npsi_z = 0.1");
            assert!(read(&second).is_ok(), "{list}");
        }
        drawn("[simulation.values]\nD = -1e7", "-1e7", "-1e6 to 1e6");
        drawn("[simulation]\ndrift_noise = \"1e200 deg/h\"", "\"1e200 deg/h\"", "1e-12 to 1e6 deg/h");
        drawn("[simulation]\ntruth = \"exct\"", "\"exct\"", "did you mean `exact`?");
        drawn("[[position]]\nattitude=\"NUE\"\nname = \"p1\"", "\"p1\"", "two positions");
        drawn("[[position]]\nattitude=\"NUE\"\nname = \"a/b\"", "\"a/b\"", "expected up to 64 letters");
        drawn("[[position]]\nattitude=\"NUE\"\nname = 5", "5", "expected a text in quotes");
        drawn("dwell_s = 0.0001", "0.0001", "0.001 to 1e6 s");
        drawn("rotation = { angle_deg = 5 }", "{ angle_deg = 5 }", "`about` is missing");
        let first = |keys: &str| place(&format!("{keys}\n{ONE}"));
        assert_eq!(
            first("terms = [\"F\", 3]"),
            (
                Some("[\"F\", 3]".into()),
                "found a number; expected a list such as [\"F\", \"I\"], or \"drift\"".into()
            )
        );
        assert_eq!(first("combinations = [\"D_IX - D_IW\"]").0.as_deref(), Some("D_IW"));
        assert!(first("combinations = [\"D_IX*D_IY\"]").1.contains("linear"));
        assert_eq!(
            first(&format!("name = \"{}\"", "x".repeat(201))).1,
            "name has 201 characters; expected at most 200"
        );
        assert_eq!(first("carry = inertial").0.as_deref(), Some("inertial"));
    }

    /// Limits are tested before anything grows with the file.
    #[test]
    fn files_that_are_too_large() {
        let (span, message) = place(&"\n".repeat(MAX_FILE + 1));
        assert_eq!(
            (span, message),
            (None, "1000001 bytes; expected a scheme file of at most 1000000".into())
        );
        let long = "a".repeat(65);
        let name = |n: &str| place(&format!("[[position]]\nname=\"{n}\"\nangles_deg=[0,0,0]"));
        assert!(name(&long).1.contains("expected up to 64"));
        let angle = |n: &str| place(&format!("[[position]]\nangles_deg=[0,0,\"{n}\"]"));
        assert_eq!(
            angle(&long).1,
            "the name `aaaaaaaaaaaa...` of an angle has 65 characters; expected at most 64"
        );
        assert!(angle(&"-".repeat(100_000)).1.len() < 300);
        let many = place(&"[[position]]\nangles_deg=[0,0,0]\n".repeat(1001));
        assert_eq!(many.1, "the scheme has 1001 positions; expected at most 1000");
    }
}
