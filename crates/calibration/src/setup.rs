//! Subject of a calibration and its records: they prevent numbers of another platform from being used, and
//! records from counting twice.

use obsdeg_core::json_list;
use obsdeg_core::model::{Carry, Geometry, Scheme};
use obsdeg_evidence::simulation::latitude_of;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Setup of a scheme: the meaning of its coefficients, and the identity of records of its runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Setup {
    /// Terms of the error model, as in `--terms`.
    pub terms: String,
    /// Mounting of the gyros and accelerometers.
    pub geometry: Geometry,
    /// Carry: quantity that continues from one position to the next.
    pub carry: Carry,
    /// Latitude in deg; 28.2 if the scheme states none.
    pub latitude_deg: f64,
    /// True if psi_y is measured.
    pub measured_azimuth: bool,
    /// Names and Euler angles in deg of the positions.
    pub positions: Vec<SetupPosition>,
}

/// Position of a setup; in JSON `[name, angles]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SetupPosition {
    /// Name of the position.
    pub name: String,
    /// Euler angles alpha, beta, gamma in deg, as `0,90,0`.
    pub angles: String,
}

json_list!(SetupPosition { name: String, angles: String });

impl Setup {
    /// Setup of a scheme.
    pub fn of(scheme: &Scheme) -> Self {
        let angles = |p: &obsdeg_core::model::Position| {
            p.angles.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")
        };
        Self {
            terms: scheme.unknowns.to_string(),
            geometry: scheme.geometry,
            carry: scheme.carry,
            latitude_deg: latitude_of(scheme).map_or(0.0, |l| l.degrees()),
            measured_azimuth: scheme.measured_azimuth,
            positions: scheme
                .positions
                .iter()
                .map(|p| SetupPosition { name: p.name.clone(), angles: angles(p) })
                .collect(),
        }
    }

    /// Differences from `there`, in words; empty if both describe the same platform.
    pub fn differences(&self, there: &Self) -> Vec<String> {
        let mut out = Vec::new();
        let mut say = |what: &str, here: &str, there: &str| {
            if here != there {
                out.push(format!("{what} {there} instead of {here}"));
            }
        };
        say("terms", &self.terms, &there.terms);
        say("carry", &self.carry.to_string(), &there.carry.to_string());
        say("latitude", &self.latitude_deg.to_string(), &there.latitude_deg.to_string());
        let azimuth = |s: &Self| if s.measured_azimuth { "measured" } else { "not measured" };
        say("azimuth", azimuth(self), azimuth(there));
        let count = |s: &Self| s.positions.len().to_string();
        say("number of positions", &count(self), &count(there));
        if self.positions.len() == there.positions.len() {
            for (here, other) in self.positions.iter().zip(&there.positions) {
                say(&format!("angles of {}", here.name), &here.angles, &other.angles);
            }
        }
        if self.geometry != there.geometry {
            out.push("another mounting of the sensors (geometry)".into());
        }
        out
    }
}

/// Record that estimates rest on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Basis")]
pub struct SourceRecord {
    /// Name of the record, as it was given.
    pub record: String,
    /// Digest of the numbers of the record.
    pub digest: String,
}

impl SourceRecord {
    /// Element of `others` with the same numbers.
    pub(crate) fn among<'a>(&self, others: &'a [Self]) -> Option<&'a Self> {
        others.iter().find(|o| o.digest == self.digest)
    }
}
