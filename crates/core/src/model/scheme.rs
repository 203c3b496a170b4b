//! A torquing scheme: positions, carry, latitude, geometry and what is unknown.

use std::collections::{BTreeMap, HashSet};
use std::fmt;
use std::str::FromStr;

use super::angle::{Angle, AngleError, MAX_NAME, excerpt, format_decimal, parse_decimal};
use super::attitude::{Euler, Turned};
use super::dwell::Dwell;
use super::error_model::ErrorModel;
use super::geometry::Geometry;
use super::gimbals::Gimbals;
use super::observed::Observed;
use super::omitted_names;
use super::path::{self, Path, PathError, PathStep, StepError};
pub(crate) use super::position::{Carry, CarryError, Position, Station, parse_attitude};
use super::recording::Recording;
use super::rotation::{MIN_ROTATION, Rotation};
use super::terms::{Source, Term, Unknowns};
use crate::model::ranges::{self, RangeError};
use crate::model::settings;
use crate::model::settings::Settings;

/// A geographic latitude, an exact decimal of degrees in -90..=90.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Latitude {
    nanodeg: i64,
}

/// Why a text is no latitude.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LatitudeError {
    /// Not an exact decimal.
    #[error("latitude: {0}")]
    Decimal(AngleError),
    /// Beyond a pole.
    #[error("latitude {found} is out of range; expected -90 to 90 degrees")]
    OutOfRange {
        /// The text found.
        found: String,
    },
}

impl Latitude {
    /// The latitude in 1e-9 degrees.
    pub fn nanodeg(self) -> i64 {
        self.nanodeg
    }

    /// The latitude in degrees.
    pub fn degrees(self) -> f64 {
        self.nanodeg as f64 / 1e9
    }

    /// True if `wN = 0`.
    pub fn is_pole(self) -> bool {
        self.nanodeg.abs() == 90_000_000_000
    }

    /// True if `wU = 0`.
    pub(crate) fn is_equator(self) -> bool {
        self.nanodeg == 0
    }
}

impl FromStr for Latitude {
    type Err = LatitudeError;
    fn from_str(text: &str) -> Result<Self, LatitudeError> {
        let nanodeg = parse_decimal(text.trim()).map_err(LatitudeError::Decimal)?;
        if nanodeg.abs() > 90_000_000_000 {
            return Err(LatitudeError::OutOfRange { found: text.into() });
        }
        Ok(Self { nanodeg })
    }
}

impl fmt::Display for Latitude {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&format_decimal(self.nanodeg))
    }
}

/// A torquing scheme and the assumptions under which it is judged.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scheme {
    /// What it is called; empty where nothing says.
    pub name: String,
    /// What it is for.
    pub description: String,
    /// The positions, in order.
    pub positions: Vec<Position>,
    /// What is carried between positions.
    pub carry: Carry,
    /// `None`: generic (`wN`, `wU` independent).
    pub latitude: Option<Latitude>,
    /// How the gyros are mounted.
    pub geometry: Geometry,
    /// What is unknown besides psi.
    pub unknowns: Unknowns,
    /// True if `psi_y^n` is measured too.
    pub measured_azimuth: bool,
    /// Linear combinations of unknowns to be judged, as written by the user.
    pub combinations: Vec<String>,
    /// Conditions of a simulation, as far as the scheme gives them.
    pub simulation: Settings,
    /// The largest sigma allowed, by unknown or family, in deg, deg/h, deg/h/g.
    pub requirements: BTreeMap<String, f64>,
    /// Sizes (one sigma) of errors that are not estimated, by error or family, in ug, ppm, arcsec, deg/h/g^2.
    pub bench: BTreeMap<String, f64>,
    /// Random walk of coefficients between calibrations, by coefficient or family, in the unit of the
    /// coefficient per sqrt(day).
    pub ageing: BTreeMap<String, f64>,
    /// How far the gimbals turn.
    pub gimbals: Gimbals,
    /// How the platform is turned from one position to the next, where a position does not say.
    pub path: Option<Path>,
    /// How the records of its runs are read.
    pub recording: Recording,
}

/// Most unknowns of an analysis: bases of what derivatives span are matrices of unknowns by unknowns.
pub(crate) const MAX_UNKNOWNS: usize = 1000;

/// Why a scheme cannot be analysed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SchemeError {
    /// No position.
    #[error("the scheme has no position; expected at least one, as in --angles 0,0,0")]
    Empty,
    /// More positions than the program takes.
    #[error("the scheme has {found} positions; expected at most {MAX_POSITIONS}")]
    TooMany {
        /// Number of positions.
        found: usize,
    },
    /// More unknowns than an analysis takes.
    #[error(
        "{found} unknowns; expected at most {} (under reset carry every position has three of its own)",
        MAX_UNKNOWNS
    )]
    TooManyUnknowns {
        /// Their number.
        found: usize,
    },
    /// Two positions of one name.
    #[error("two positions are named `{name}`; expected different names")]
    DuplicateName {
        /// The name.
        name: String,
        /// The index of the second.
        index: usize,
    },
    /// A name that tables and formulas cannot hold.
    #[error("position name `{name}`; expected up to {MAX_NAME} letters, digits, `_`, `-`, `.` and blanks")]
    PositionName {
        /// The name, or its first characters.
        name: String,
        /// The index of the position.
        index: usize,
    },
    /// A text that is too long for a report.
    #[error("{key} has {found} characters; expected at most {most}")]
    LongText {
        /// The key in a scheme file.
        key: String,
        /// Its length.
        found: usize,
        /// The most.
        most: usize,
    },
    /// Too many combinations.
    #[error("{found} combinations; expected at most {MAX_COMBINATIONS}")]
    Combinations {
        /// Their number.
        found: usize,
    },
    /// A number beyond its range.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// A number for something that no gyro model has.
    #[error("`{name}`: no such unknown; {}", settings::meant(name))]
    UnknownName {
        /// The key in a scheme file.
        key: String,
        /// The name, or its first characters.
        name: String,
    },
    /// A size for something that no bench has.
    #[error("`{name}`: no such error; {}", omitted_names::omitted_meant(name))]
    BenchName {
        /// The key in a scheme file.
        key: String,
        /// The name, or its first characters.
        name: String,
    },
    /// The drift alone is constant at one position only.
    #[error(
        "the unknowns `drift` describe a single position; found {found} positions (use coefficients such as --terms F,I,O,S)"
    )]
    DriftPositions {
        /// Number of positions.
        found: usize,
    },
    /// A dwell out of range.
    #[error("a dwell of {found} s; expected 1e-9 to 1e9 s")]
    Dwell {
        /// The seconds found.
        found: String,
    },
    /// A rotation that is none.
    #[error("the rotation of `{name}` is too small or generic; expected at least 0.001 degrees")]
    Rotation {
        /// The segment.
        name: String,
        /// Its index.
        index: usize,
    },
    /// A position that the gimbals do not reach.
    #[error("the gimbals do not reach `{name}` ({attitude}); expected {limits}")]
    Gimbals {
        /// The position.
        name: String,
        /// Its index.
        index: usize,
        /// Its angles, and how far it has turned.
        attitude: String,
        /// The limits.
        limits: String,
    },
    /// A slew to the first position.
    #[error("`{name}` is the first position; expected no slew to it")]
    FirstSlew {
        /// The position.
        name: String,
    },
    /// An impossible mounting.
    #[error(transparent)]
    Geometry(#[from] super::geometry::GeometryError),
    /// A coefficient that is there twice.
    #[error(transparent)]
    Terms(#[from] super::terms::TermError),
    /// A way that has no exact verdict.
    #[error(transparent)]
    Path(#[from] PathError),
}

/// A turn in 1e-9 degrees.
const FULL_TURN: i64 = 360_000_000_000;
/// Stations of a rotation lie at multiples of this part of it (of a turn, if it is more): at most seven of
/// them.
const STATION_STEPS: i64 = 8;
/// So many are different along a whole turn, which is enough for two g factors; with more the verdicts would
/// say too little.
const _: () = {
    let mut term = 0;
    while term < Term::ALL.len() {
        assert!(
            !matches!(Term::ALL[term].source(), Source::Gravity)
                || 2 * (1 + Term::ALL[term].order() as i64) < STATION_STEPS,
            "more steps for a drift of more g factors"
        );
        term += 1;
    }
};

/// Most positions that a scheme may have.
pub(crate) const MAX_POSITIONS: usize = 1000;
/// Most combinations that a scheme may ask for, and characters of one.
pub(crate) const MAX_COMBINATIONS: usize = 100;
const MAX_COMBINATION: usize = 1000;
/// Most characters of the name and of the description of a scheme.
const MAX_TITLE: usize = 200;
const MAX_DESCRIPTION: usize = 10_000;

impl SchemeError {
    /// The key of the offender in a scheme file, as in `position.1.name`; `None` when it is the whole scheme.
    pub fn key(&self) -> Option<String> {
        match self {
            Self::Empty | Self::Dwell { .. } | Self::TooManyUnknowns { .. } => None,
            Self::TooMany { .. } => Some(format!("position.{MAX_POSITIONS}")),
            Self::DuplicateName { index, .. } | Self::PositionName { index, .. } => {
                Some(format!("position.{index}.name"))
            }
            Self::LongText { key, .. } | Self::UnknownName { key, .. } | Self::BenchName { key, .. } => {
                Some(key.clone())
            }
            Self::Combinations { .. } => Some("combinations".into()),
            Self::Range(e) => Some(e.what.clone()),
            Self::DriftPositions { .. } | Self::Terms(_) => Some("terms".into()),
            Self::Rotation { index, .. } => Some(format!("position.{index}.rotation")),
            Self::Gimbals { index, .. } => Some(format!("position.{index}")),
            Self::FirstSlew { .. } => Some("position.0.slew".into()),
            Self::Geometry(_) => Some("geometry".into()),
            Self::Path(e) => e.key(),
        }
    }
}

impl Scheme {
    /// A scheme of the given attitudes, named p1, p2, ..., with the paper's defaults.
    pub fn of_angles(angles: impl IntoIterator<Item = Euler>) -> Self {
        let positions = angles
            .into_iter()
            .enumerate()
            .map(|(i, angles)| Position {
                name: format!("p{}", i + 1),
                angles,
                dwell: None,
                rotation: None,
                slew: None,
            })
            .collect();
        Self { positions, ..Self::default() }
    }

    /// Checks what the types do not.
    ///
    /// # Errors
    /// [`SchemeError`] naming the offender.
    pub fn validate(&self) -> Result<(), SchemeError> {
        let found = self.positions.len();
        if found == 0 {
            return Err(SchemeError::Empty);
        }
        if found > MAX_POSITIONS {
            return Err(SchemeError::TooMany { found });
        }
        self.geometry.validate()?;
        self.unknowns.validate()?;
        self.validate_texts()?;
        self.validate_numbers()?;
        for (index, p) in self.positions.iter().enumerate() {
            let name = p.name.clone();
            let none = |r: &Rotation| r.angle.generic().is_some() || r.angle.nanodeg().abs() < MIN_ROTATION;
            if p.rotation.as_ref().is_some_and(none) {
                return Err(SchemeError::Rotation { name, index });
            }
            if index == 0 && p.slew.is_some() {
                return Err(SchemeError::FirstSlew { name });
            }
            if let Some((name, attitude)) = self.gimbals.beyond(p) {
                return Err(SchemeError::Gimbals { name, index, attitude, limits: self.gimbals.to_string() });
            }
        }
        if self.unknowns == Unknowns::Drift && (found > 1 || self.rotates()) {
            return Err(SchemeError::DriftPositions { found });
        }
        self.paths()?;
        Ok(())
    }

    /// Names and other texts.
    fn validate_texts(&self) -> Result<(), SchemeError> {
        let plain = |c: char| c.is_alphanumeric() || "_-. ".contains(c);
        let mut names = HashSet::new();
        for (index, p) in self.positions.iter().enumerate() {
            let length = p.name.chars().count();
            if !(1..=MAX_NAME).contains(&length) || !p.name.chars().all(plain) {
                return Err(SchemeError::PositionName { name: excerpt(&p.name), index });
            }
            if !names.insert(&p.name) {
                return Err(SchemeError::DuplicateName { name: p.name.clone(), index });
            }
        }
        let found = self.combinations.len();
        if found > MAX_COMBINATIONS {
            return Err(SchemeError::Combinations { found });
        }
        let combinations = self.combinations.iter().enumerate();
        let combinations = combinations.map(|(i, text)| (format!("combinations.{i}"), text, MAX_COMBINATION));
        let own = [("name", &self.name, MAX_TITLE), ("description", &self.description, MAX_DESCRIPTION)];
        let own = own.into_iter().map(|(key, text, most)| (key.to_string(), text, most));
        for (key, text, most) in own.chain(combinations) {
            let found = text.chars().count();
            if found > most {
                return Err(SchemeError::LongText { key, found, most });
            }
        }
        Ok(())
    }

    /// Numbers and the names that they are for.
    fn validate_numbers(&self) -> Result<(), SchemeError> {
        let lists = self.simulation.lists().map(|(key, list, _)| (format!("simulation.{key}"), list));
        for (key, list) in lists
            .into_iter()
            .chain([("requirements".into(), &self.requirements), ("ageing".into(), &self.ageing)])
        {
            if let Some(name) = list.keys().find(|name| !settings::may_be_unknown(name)) {
                return Err(SchemeError::UnknownName { key: format!("{key}.{name}"), name: excerpt(name) });
            }
        }
        if let Some(name) = self.bench.keys().find(|name| !omitted_names::may_be_omitted(name)) {
            return Err(SchemeError::BenchName { key: format!("bench.{name}"), name: excerpt(name) });
        }
        let bench = self.bench.iter().map(|(name, x)| (format!("bench.{name}"), *x, ranges::BENCH));
        let ageing = self.ageing.iter().map(|(name, x)| (format!("ageing.{name}"), *x, ranges::AGEING));
        let required = self.requirements.iter();
        let required = required.map(|(name, x)| (format!("requirements.{name}"), *x, ranges::REQUIREMENT));
        let slews = self.positions.iter().enumerate().filter_map(|(i, p)| {
            let rate = p.slew.as_ref()?.rate_deg_s?;
            Some((format!("position.{i}.slew.rate_deg_s"), rate, ranges::SLEW_RATE_DEG_S))
        });
        for (key, x, range) in
            self.simulation.numbers().into_iter().chain(required).chain(bench).chain(ageing).chain(slews)
        {
            range.check(key, x)?;
        }
        Ok(())
    }

    /// The scheme with every dwell times `factor`; `dwell_s` is that of positions that do not say.
    ///
    /// # Errors
    /// [`SchemeError::Dwell`] when that is no dwell.
    pub fn with_dwells(&self, dwell_s: f64, factor: f64) -> Result<Self, SchemeError> {
        let mut other = self.clone();
        for p in &mut other.positions {
            let seconds = p.dwell.map_or(dwell_s, Dwell::seconds) * factor;
            let found = seconds.to_string();
            p.dwell = Some(Dwell::from_seconds(seconds).ok_or(SchemeError::Dwell { found })?);
        }
        Ok(other)
    }

    /// True if it says that turning to a position takes time.
    pub fn slews(&self) -> bool {
        let own = |p: &Position| p.slew.as_ref().is_some_and(|s| s.rate_deg_s.is_some());
        self.simulation.slew_rate_deg_s.is_some() || self.positions.iter().any(own)
    }

    /// The scheme without a position; the one behind it is reached from another attitude then, the shortest
    /// way.
    pub fn without_position(&self, index: usize) -> Self {
        let mut rest = self.clone();
        rest.positions =
            self.positions.iter().enumerate().filter(|(i, _)| *i != index).map(|(_, p)| p.clone()).collect();
        if let Some(next) = rest.positions.get_mut(index) {
            next.take_shortest_way();
            next.slew.take_if(|_| index == 0);
        }
        rest
    }

    /// Name of a further position: `p3` for the third, unless another position has it.
    pub(crate) fn free_name(&self, number: usize) -> String {
        let mut name = format!("p{number}");
        while self.positions.iter().any(|p| p.name == name) {
            name.push('_');
        }
        name
    }

    /// True if a segment rotates.
    pub fn rotates(&self) -> bool {
        self.positions.iter().any(|p| p.rotation.is_some())
    }

    /// True if rotations are judged by the course of Z while they go on, not at attitudes of the arc: where
    /// not only drifts are unknown.
    pub fn by_course(&self) -> bool {
        self.rotates() && (self.unknowns.have(Source::Rate) || self.unknowns.have(Source::Force))
    }

    /// What is observed.
    pub fn observed(&self) -> Observed {
        Observed { azimuth: self.measured_azimuth, accelerometers: self.unknowns.have(Source::Force) }
    }

    /// How the unknown coefficients enter.
    pub fn error_model(&self) -> ErrorModel {
        let terms = self.unknowns.terms().iter().flat_map(|t| t.coefficients(&self.geometry));
        terms.map(|(_, effect)| effect).collect::<Vec<_>>().into()
    }

    /// The attitudes at which derivative rows are taken. The rows along a rotation are trigonometric
    /// polynomials of its angle, of degree m = 1 + the largest number of g factors (one for `C_c^n`, one for
    /// each component of g^c): any 2m+1 different angles of the arc span what all of it spans. The end is
    /// added, where psi is handed on. Of a rotation that is judged by its course both ends are there, and no
    /// row is taken at them.
    pub fn stations(&self) -> Vec<Station<'_>> {
        let degree = 1 + self.unknowns.terms().iter().map(|t| t.order()).max().unwrap_or(0);
        let course = self.by_course();
        let mut out = Vec::with_capacity(self.positions.len());
        for (index, position) in self.positions.iter().enumerate() {
            let Some(r) = &position.rotation else {
                out.push(Station { position, index, turned: None, continues: false, course: false });
                continue;
            };
            let whole = r.angle.nanodeg();
            let step = whole.clamp(-FULL_TURN, FULL_TURN) / STATION_STEPS;
            let along = if course { 0..=0 } else { 0..=2 * degree as i64 };
            let angles = along.map(|k| k * step).chain([whole]);
            out.extend(angles.map(|angle| Station {
                position,
                index,
                turned: Some(Turned { axis: r.axis, angle: Angle::from_nanodeg(angle) }),
                continues: angle != 0,
                course,
            }));
        }
        out
    }

    /// True if verdicts depend on how positions are reached: torquer errors act while psi^n is carried.
    pub fn torquers_act(&self) -> bool {
        self.carry == Carry::Inertial && self.unknowns.have(Source::Rate) && self.positions.len() > 1
    }

    /// The turns that lead to every position, where verdicts depend on them; nothing where they do not.
    ///
    /// # Errors
    /// [`PathError`] when a way is not stated or has no exact form.
    pub fn paths(&self) -> Result<Vec<Vec<PathStep>>, PathError> {
        if !self.torquers_act() {
            return Ok(Vec::new());
        }
        let mut out = vec![Vec::new()];
        for (i, pair) in self.positions.windows(2).enumerate() {
            let [from, to] = pair else { continue };
            let (name, index) = (to.name.clone(), i + 1);
            let stated = to.slew.is_some() || self.simulation.slew_rate_deg_s.is_some();
            let Some(path) = self.path.or(stated.then_some(Path::OneAxis)) else {
                let of_rate = self.unknowns.terms().iter().filter(|t| t.source() == Source::Rate);
                let terms = of_rate.map(|t| t.letters()).collect::<Vec<_>>().join(", ");
                return Err(PathError::NotStated { name, index, terms });
            };
            out.push(path::steps(from, to, path).map_err(|e| match e {
                StepError::NoWay => PathError::NoWay { name, index },
                StepError::NotExact(found) => PathError::NotExact { name, index, found },
            })?);
        }
        Ok(out)
    }

    /// The names of generic angles, in order of appearance.
    pub fn generic_names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for (name, _) in self.positions.iter().flat_map(|p| &p.angles).filter_map(Angle::generic) {
            if !names.iter().any(|n| n == name) {
                names.push(name.into());
            }
        }
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scheme that no file was read for is checked as well.
    #[test]
    fn names_of_requirements_and_settings_are_known() {
        let zero = || std::array::from_fn(|_| Angle::from_degrees(0));
        let scheme = Scheme::of_angles([zero()]);
        assert_eq!(scheme.validate(), Ok(()));
        let known = |name: &str| [(name.to_string(), 0.1)].into();
        let wrong = Scheme { requirements: known("D_QX"), ..scheme.clone() };
        let error = SchemeError::UnknownName { key: "requirements.D_QX".into(), name: "D_QX".into() };
        assert_eq!(wrong.validate(), Err(error));
        let simulation = Settings { priors: known("psi_w"), ..Settings::default() };
        let wrong = Scheme { simulation, ..scheme.clone() };
        assert_eq!(wrong.validate().map_err(|e| e.key()), Err(Some("simulation.priors.psi_w".into())));
        assert_eq!(Scheme { requirements: known("D_F"), ..scheme }.validate(), Ok(()));
    }
}
