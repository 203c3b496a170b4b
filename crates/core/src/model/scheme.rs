//! Torquing schemes: positions, carry, latitude, geometry and unknown terms.

use std::collections::{BTreeMap, HashSet};
use std::fmt;
use std::str::FromStr;

use super::acceptance::Acceptance;
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
use super::terms::{ErrorSource, Term, Unknowns};
use crate::model::ranges::{self, RangeError};
use crate::model::settings;
use crate::model::settings::Settings;
use crate::title_block::TitleBlock;

/// Geographic latitude, an exact decimal of degrees in -90..=90.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Latitude {
    nanodeg: i64,
}

/// Reasons why a text is no latitude.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LatitudeError {
    /// The text is not an exact decimal.
    #[error("latitude: {0}")]
    Decimal(AngleError),
    /// The latitude is beyond a pole.
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

    /// True at a pole, where `wN = 0`.
    pub fn is_pole(self) -> bool {
        self.nanodeg.abs() == 90_000_000_000
    }

    /// True at the equator, where `wU = 0`.
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

/// Torquing scheme, with the assumptions under which it is judged.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scheme {
    /// Name of the scheme; empty if it has none.
    pub name: String,
    /// Purpose of the scheme.
    pub description: String,
    /// Title block of its review.
    pub document: TitleBlock,
    /// Positions in order of time.
    pub positions: Vec<Position>,
    /// Carry between positions.
    pub carry: Carry,
    /// Latitude; `None`: generic (`wN`, `wU` independent).
    pub latitude: Option<Latitude>,
    /// Mounting of the gyros and accelerometers.
    pub geometry: Geometry,
    /// Unknowns besides psi.
    pub unknowns: Unknowns,
    /// True if `psi_y^n` is measured too.
    pub measured_azimuth: bool,
    /// Linear combinations of unknowns to be judged, as written by the user.
    pub combinations: Vec<String>,
    /// Conditions of a simulation, as far as the scheme states them.
    pub simulation: Settings,
    /// Largest sigma allowed, by unknown or family, in deg, deg/h, deg/h/g.
    pub requirements: BTreeMap<String, f64>,
    /// Sizes (one sigma) of errors that are not estimated, by error or family, in ug, ppm, arcsec,
    /// deg/h/g^2.
    pub bench: BTreeMap<String, f64>,
    /// Random walk of coefficients between calibrations, by coefficient or family, in the unit of the
    /// coefficient per sqrt(day).
    pub ageing: BTreeMap<String, f64>,
    /// Limits within which calibrated coefficients are accepted.
    pub acceptance: Acceptance,
    /// Limits of the gimbals.
    pub gimbals: Gimbals,
    /// Slew path between positions that state none; `None` if the scheme states no path.
    pub path: Option<Path>,
    /// Reading of the records of its runs.
    pub recording: Recording,
}

/// Largest number of unknowns of an analysis: bases of the spans of derivatives are square matrices of this
/// size.
pub(crate) const MAX_UNKNOWNS: usize = 1000;

/// Reasons why a scheme cannot be analysed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SchemeError {
    /// Title block with a wrong entry.
    #[error("the title block: {message}")]
    TitleBlock {
        /// Entry, what was found and what is expected.
        message: String,
    },
    /// Acceptance limits with a wrong entry.
    #[error("{message}")]
    Acceptance {
        /// Key in a scheme file.
        key: String,
        /// Entry, the value found and the values expected.
        message: String,
    },
    /// The scheme has no position.
    #[error("the scheme has no position; expected at least one, as in --angles 0,0,0")]
    Empty,
    /// The scheme has more positions than the program takes.
    #[error("the scheme has {found} positions; expected at most {MAX_POSITIONS}")]
    TooMany {
        /// Number of positions.
        found: usize,
    },
    /// The scheme has more unknowns than an analysis takes.
    #[error(
        "{found} unknowns; expected at most {} (under reset carry every position has three of its own)",
        MAX_UNKNOWNS
    )]
    TooManyUnknowns {
        /// Number of unknowns.
        found: usize,
    },
    /// Two positions have the same name.
    #[error("two positions are named `{name}`; expected different names")]
    DuplicateName {
        /// Name of the two positions.
        name: String,
        /// Index of the second position.
        index: usize,
    },
    /// Tables and formulas cannot print a position's name.
    #[error("position name `{name}`; expected up to {MAX_NAME} letters, digits, `_`, `-`, `.` and blanks")]
    PositionName {
        /// Name of the position, or its first characters.
        name: String,
        /// Index of the position.
        index: usize,
    },
    /// A text is too long for a report.
    #[error("{key} has {found} characters; expected at most {most}")]
    LongText {
        /// Key in a scheme file.
        key: String,
        /// Number of characters of the text.
        found: usize,
        /// Largest number of characters.
        most: usize,
    },
    /// The scheme has too many combinations.
    #[error("{found} combinations; expected at most {MAX_COMBINATIONS}")]
    Combinations {
        /// Number of combinations.
        found: usize,
    },
    /// A number is beyond its range.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// A number is given for an unknown that no gyro model has.
    #[error("`{name}`: no such unknown; {}", settings::meant(name))]
    UnknownName {
        /// Key in a scheme file.
        key: String,
        /// Name found, or its first characters.
        name: String,
    },
    /// A size is given for an error that no bench has.
    #[error("`{name}`: no such error; {}", omitted_names::omitted_meant(name))]
    BenchName {
        /// Key in a scheme file.
        key: String,
        /// Name found, or its first characters.
        name: String,
    },
    /// Several positions with the unknowns `drift`: the drift is constant at one position only.
    #[error(
        "the unknowns `drift` describe a single position; found {found} positions (use coefficients such \
         as --terms F,I,O,S)"
    )]
    DriftPositions {
        /// Number of positions.
        found: usize,
    },
    /// A dwell is out of range.
    #[error("a dwell of {found} s; expected 1e-9 to 1e9 s")]
    Dwell {
        /// Seconds found.
        found: String,
    },
    /// A rotation is impossible.
    #[error("the rotation of `{name}` is too small or generic; expected at least 0.001 degrees")]
    Rotation {
        /// Name of the segment.
        name: String,
        /// Index of the segment.
        index: usize,
    },
    /// The gimbals do not reach a position.
    #[error("the gimbals do not reach `{name}` ({attitude}); expected {limits}")]
    Gimbals {
        /// Name of the position.
        name: String,
        /// Index of the position.
        index: usize,
        /// Angles of the position, and the angle of its rotation so far.
        attitude: String,
        /// Limits of the gimbals.
        limits: String,
    },
    /// The first position has a slew.
    #[error("`{name}` is the first position; expected no slew to it")]
    FirstSlew {
        /// Name of the first position.
        name: String,
    },
    /// The mounting is impossible.
    #[error(transparent)]
    Geometry(#[from] super::geometry::GeometryError),
    /// A coefficient occurs twice.
    #[error(transparent)]
    Terms(#[from] super::terms::TermError),
    /// A slew path has no exact verdict.
    #[error(transparent)]
    Path(#[from] PathError),
}

/// Whole turn in 1e-9 degrees.
const FULL_TURN: i64 = 360_000_000_000;
/// Stations of a rotation lie at multiples of this fraction of it (of a whole turn, if the rotation exceeds
/// one): at most seven of them.
const STATION_STEPS: i64 = 8;
/// Asserts that the distinct stations along a whole turn suffice for the g factors of every drift term (at
/// most two). With more factors they would span too little, and verdicts would miss observable unknowns.
const _: () = {
    let mut term = 0;
    while term < Term::ALL.len() {
        assert!(
            !matches!(Term::ALL[term].source(), ErrorSource::Gravity)
                || 2 * (1 + Term::ALL[term].order() as i64) < STATION_STEPS,
            "more steps for a drift of more g factors"
        );
        term += 1;
    }
};

/// Largest number of positions of a scheme.
pub(crate) const MAX_POSITIONS: usize = 1000;
/// Largest number of combinations that a scheme may request, and of characters of one.
pub(crate) const MAX_COMBINATIONS: usize = 100;
const MAX_COMBINATION: usize = 1000;
/// Largest number of characters of the name and of the description of a scheme.
const MAX_TITLE: usize = 200;
const MAX_DESCRIPTION: usize = 10_000;

impl SchemeError {
    /// Key of the offending entry in a scheme file, as in `position.1.name`; `None` for the whole scheme.
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
            Self::Acceptance { key, .. } => Some(key.clone()),
            Self::TitleBlock { .. } => Some("document".into()),
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

    /// Checks all conditions that the types do not ensure.
    ///
    /// # Errors
    /// [`SchemeError`] naming the offending entry.
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

    /// Checks names and other texts.
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
        if let Some(message) = self.document.wrong() {
            return Err(SchemeError::TitleBlock { message });
        }
        let own = own.into_iter().map(|(key, text, most)| (key.to_string(), text, most));
        for (key, text, most) in own.chain(combinations) {
            let found = text.chars().count();
            if found > most {
                return Err(SchemeError::LongText { key, found, most });
            }
        }
        Ok(())
    }

    /// Checks numbers and the names that they are for.
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
        let limited = self.acceptance.limits.keys();
        if let Some(name) = limited.into_iter().find(|name| !settings::may_be_unknown(name)) {
            let key = format!("acceptance.limits.{name}");
            return Err(SchemeError::UnknownName { key, name: excerpt(name) });
        }
        if let Some((key, message)) = self.acceptance.wrong() {
            return Err(SchemeError::Acceptance { key, message });
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

    /// The scheme with every dwell multiplied by `factor`; `dwell_s` is the dwell, in s, of positions that
    /// state none.
    ///
    /// # Errors
    /// [`SchemeError::Dwell`] if a product is no dwell.
    pub fn with_dwells(&self, dwell_s: f64, factor: f64) -> Result<Self, SchemeError> {
        let mut other = self.clone();
        for p in &mut other.positions {
            let seconds = p.dwell.map_or(dwell_s, Dwell::seconds) * factor;
            let found = seconds.to_string();
            p.dwell = Some(Dwell::from_seconds(seconds).ok_or(SchemeError::Dwell { found })?);
        }
        Ok(other)
    }

    /// True if the scheme states that turns between positions take time.
    pub fn slews(&self) -> bool {
        let own = |p: &Position| p.slew.as_ref().is_some_and(|s| s.rate_deg_s.is_some());
        self.simulation.slew_rate_deg_s.is_some() || self.positions.iter().any(own)
    }

    /// The scheme without a position. The next position is then reached from another attitude, by the
    /// shortest turn.
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

    /// Name of a further position: `p3` for the third, unless another position has that name.
    pub(crate) fn free_name(&self, number: usize) -> String {
        let mut name = format!("p{number}");
        while self.positions.iter().any(|p| p.name == name) {
            name.push('_');
        }
        name
    }

    /// True if any segment rotates.
    pub fn rotates(&self) -> bool {
        self.positions.iter().any(|p| p.rotation.is_some())
    }

    /// True if rotations are judged by the output history during the turn, not at attitudes of the arc: if
    /// not only drifts are unknown.
    pub(crate) fn by_history(&self) -> bool {
        self.rotates() && (self.unknowns.have(ErrorSource::Rate) || self.unknowns.have(ErrorSource::Force))
    }

    /// Observed quantities.
    pub fn observed(&self) -> Observed {
        Observed { azimuth: self.measured_azimuth, accelerometers: self.unknowns.have(ErrorSource::Force) }
    }

    /// Error model of the unknown coefficients.
    pub(crate) fn error_model(&self) -> ErrorModel {
        let terms = self.unknowns.terms().iter().flat_map(|t| t.coefficients(&self.geometry));
        terms.map(|(_, effect)| effect).collect::<Vec<_>>().into()
    }

    /// Stations: attitudes at which derivative rows are taken. The rows along a rotation are trigonometric
    /// polynomials of its angle, of degree m = 1 + the largest number of g factors (one for `C_c^n`, one for
    /// each component of g^c). Any 2m+1 distinct angles of the arc span the same space as the whole arc. The
    /// end is added, since psi continues from there. A rotation that is judged by its output history has
    /// stations at both ends, and no row is taken at them.
    pub fn stations(&self) -> Vec<Station<'_>> {
        let degree = 1 + self.unknowns.terms().iter().map(|t| t.order()).max().unwrap_or(0);
        let by_history = self.by_history();
        let mut out = Vec::with_capacity(self.positions.len());
        for (index, position) in self.positions.iter().enumerate() {
            let Some(r) = &position.rotation else {
                out.push(Station { position, index, turned: None, continues: false, by_history: false });
                continue;
            };
            let whole = r.angle.nanodeg();
            let step = whole.clamp(-FULL_TURN, FULL_TURN) / STATION_STEPS;
            let along = if by_history { 0..=0 } else { 0..=2 * degree as i64 };
            let angles = along.map(|k| k * step).chain([whole]);
            out.extend(angles.map(|angle| Station {
                position,
                index,
                turned: Some(Turned { axis: r.axis, angle: Angle::from_nanodeg(angle) }),
                continues: angle != 0,
                by_history,
            }));
        }
        out
    }

    /// True if verdicts depend on the slew paths: torquer errors act while psi^n is carried.
    pub fn torquers_act(&self) -> bool {
        self.carry == Carry::Inertial && self.unknowns.have(ErrorSource::Rate) && self.positions.len() > 1
    }

    /// Turns that lead to every position, if verdicts depend on them; empty otherwise.
    ///
    /// # Errors
    /// [`PathError`] if a slew path is not stated or has no exact form.
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
                let of_rate = self.unknowns.terms().iter().filter(|t| t.source() == ErrorSource::Rate);
                let terms = of_rate.map(|t| t.letters()).collect::<Vec<_>>().join(", ");
                return Err(PathError::NotStated { name, index, terms });
            };
            out.push(path::steps(from, to, path).map_err(|e| match e {
                StepError::NotReached => PathError::NotReached { name, index },
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

    /// A scheme that was not read from a file is checked as well.
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
