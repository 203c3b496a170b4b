//! Error terms of gyros, torquers and accelerometers, and the selection of unknown terms.
//!
//! `family`, `source`, `shape`, `order` and `unit` have a default, so a new term compiles without its own.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::geometry::{GYROS, Geometry, GyroAxes, SignedAxis};

/// Term of the error model. Gyros: drift `D_F`, g-sensitive `D_I D_O D_S`, g^2-sensitive terms, scale factor
/// and misalignment of their torquing (IEEE Std 517 and 529). Accelerometers: bias, scale factor,
/// misalignment and nonlinear terms (IEEE Std 1293).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[allow(missing_docs, reason = "the letters say it: products of the components of g along I, O, S")]
pub enum Term {
    F,
    I,
    O,
    S,
    II,
    OO,
    SS,
    IO,
    IS,
    OS,
    /// Torquer scale factor: the torqued rate along the input axis.
    GS,
    /// Misalignment of the input axes: the torqued rate along the input axes of the other two gyros.
    GM,
    /// Lower triangle of GM: the gyros define the platform axes.
    GM3,
    /// Bias of the accelerometer.
    K0,
    /// Accelerometer scale factor: the specific force along the input axis.
    K1,
    /// Misalignment of the input axes: the specific force along the input axes of the other two
    /// accelerometers.
    M6,
    /// Lower triangle of M6: the accelerometers define the platform axes.
    M3,
    /// Square of the specific force along the input axis.
    K2,
    /// Third power of the specific force along the input axis.
    K3,
    /// Product of the specific force along the input axis with that along each of the other two.
    Kx,
}

/// Quantity that an error term depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorSource {
    /// Components of `g^c`, in g; the term is a drift.
    Gravity,
    /// Rate at which the gyro is torqued; the term is a drift.
    Rate,
    /// Components of the specific force `f = -g^c`, in g; the term is an error of Z.
    Force,
}

/// Effect of one unknown coefficient: along the input axis of its sensor, times components of the source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ErrorTerm {
    /// Input axis of the gyro or accelerometer.
    pub input: SignedAxis,
    /// Axes of the components that the coefficient multiplies; none for a constant.
    pub factors: Vec<SignedAxis>,
    /// Quantity whose components these are.
    pub source: ErrorSource,
}

impl ErrorTerm {
    /// Constant drift along the input axis of a gyro.
    pub fn bias(input: SignedAxis) -> Self {
        Self { input, factors: Vec::new(), source: ErrorSource::Gravity }
    }
}

/// Coefficients of a term in a triad of sensors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TriadShape {
    /// One coefficient per sensor.
    Each,
    /// One coefficient per sensor and other sensor.
    Others,
    /// One coefficient per sensor and sensor before it.
    Before,
}

impl Term {
    /// All terms in the order of the unknowns.
    pub const ALL: [Self; 20] = [
        Self::F,
        Self::I,
        Self::O,
        Self::S,
        Self::II,
        Self::OO,
        Self::SS,
        Self::IO,
        Self::IS,
        Self::OS,
        Self::GS,
        Self::GM,
        Self::GM3,
        Self::K0,
        Self::K1,
        Self::M6,
        Self::M3,
        Self::K2,
        Self::K3,
        Self::Kx,
    ];

    /// Letters of the term in a list of terms.
    pub const fn letters(self) -> &'static str {
        match self {
            Self::F => "F",
            Self::I => "I",
            Self::O => "O",
            Self::S => "S",
            Self::II => "II",
            Self::OO => "OO",
            Self::SS => "SS",
            Self::IO => "IO",
            Self::IS => "IS",
            Self::OS => "OS",
            Self::GS => "GS",
            Self::GM => "GM",
            Self::GM3 => "GM3",
            Self::K0 => "K0",
            Self::K1 => "K1",
            Self::M6 => "M6",
            Self::M3 => "M3",
            Self::K2 => "K2",
            Self::K3 => "K3",
            Self::Kx => "Kx",
        }
    }

    /// Quantity that the term depends on.
    pub const fn source(self) -> ErrorSource {
        match self {
            Self::GS | Self::GM | Self::GM3 => ErrorSource::Rate,
            Self::K0 | Self::K1 | Self::M6 | Self::M3 | Self::K2 | Self::K3 | Self::Kx => ErrorSource::Force,
            _ => ErrorSource::Gravity,
        }
    }

    /// Family: first part of the names of the coefficients, and their common name.
    pub const fn family(self) -> &'static str {
        match self {
            Self::F => "D_F",
            Self::I => "D_I",
            Self::O => "D_O",
            Self::S => "D_S",
            Self::II => "D_II",
            Self::OO => "D_OO",
            Self::SS => "D_SS",
            Self::IO => "D_IO",
            Self::IS => "D_IS",
            Self::OS => "D_OS",
            Self::GM | Self::GM3 => "GM",
            Self::M6 | Self::M3 => "M",
            other => other.letters(),
        }
    }

    /// Description of the term in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::F => "drift that does not depend on g",
            Self::I => "drift proportional to g along the input axis",
            Self::O => "drift proportional to g along the output axis",
            Self::S => "drift proportional to g along the spin axis",
            Self::II => "drift proportional to the square of g along the input axis",
            Self::OO => "drift proportional to the square of g along the output axis",
            Self::SS => "drift proportional to the square of g along the spin axis",
            Self::IO => "drift proportional to g along the input times g along the output axis",
            Self::IS => "drift proportional to g along the input times g along the spin axis",
            Self::OS => "drift proportional to g along the output times g along the spin axis",
            Self::GS => "scale factor of the gyro torquer",
            Self::GM => "misalignment of the gyro's input axis, towards that of each other gyro",
            Self::GM3 => "the same, towards the gyros before it: the gyros define the platform axes",
            Self::K0 => "bias of the accelerometer",
            Self::K1 => "scale factor of the accelerometer",
            Self::M6 => "misalignment of the accelerometer's input axis, towards that of each other one",
            Self::M3 => "the same, towards those before it: the accelerometers define the platform axes",
            Self::K2 => "error proportional to the square of the specific force along the input axis",
            Self::K3 => "error proportional to its third power",
            Self::Kx => {
                "error proportional to the specific force along the input axis times that along another's"
            }
        }
    }

    const fn shape(self) -> TriadShape {
        match self {
            Self::GM | Self::M6 | Self::Kx => TriadShape::Others,
            Self::GM3 | Self::M3 => TriadShape::Before,
            _ => TriadShape::Each,
        }
    }

    /// Number of components that a coefficient multiplies: the factors of the term; 2 by default.
    pub const fn order(self) -> usize {
        match self {
            Self::F | Self::K0 => 0,
            Self::I
            | Self::O
            | Self::S
            | Self::GS
            | Self::GM
            | Self::GM3
            | Self::K1
            | Self::M6
            | Self::M3 => 1,
            Self::K3 => 3,
            _ => 2,
        }
    }

    /// Unit of the coefficients; deg/h/g^2 by default.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::F => "deg/h",
            Self::I | Self::O | Self::S => "deg/h/g",
            Self::GS | Self::K1 => "ppm",
            Self::GM | Self::GM3 | Self::M6 | Self::M3 => "arcsec",
            Self::K0 => "ug",
            Self::K2 | Self::Kx => "ug/g^2",
            Self::K3 => "ug/g^3",
            _ => "deg/h/g^2",
        }
    }

    /// Coefficients of the term, sensor by sensor: names and effects.
    pub(crate) fn coefficients(self, geometry: &Geometry) -> Vec<(String, ErrorTerm)> {
        let inputs = match self.source() {
            ErrorSource::Force => geometry.accelerometers.inputs(),
            _ => geometry.gyros().map(|g| g.I),
        };
        let mut out = Vec::new();
        for (i, input) in inputs.into_iter().enumerate() {
            let others: Vec<Option<usize>> = match self.shape() {
                TriadShape::Each => vec![None],
                TriadShape::Others => (0..3).filter(|&j| j != i).map(Some).collect(),
                TriadShape::Before => (0..i).map(Some).collect(),
            };
            for other in others {
                let factors = match (self, other) {
                    (Self::Kx, Some(j)) => vec![input, inputs[j]],
                    (_, Some(j)) => vec![inputs[j]],
                    (_, None) if self.source() == ErrorSource::Gravity => self.gravity(&geometry.gyros()[i]),
                    (_, None) => vec![input; self.order()],
                };
                let name = match other {
                    Some(j) => format!("{}_{}{}", self.family(), GYROS[i], GYROS[j]),
                    None if self.source() == ErrorSource::Gravity => format!("{}{}", self.family(), GYROS[i]),
                    None => format!("{}_{}", self.family(), GYROS[i]),
                };
                out.push((name, ErrorTerm { input, factors, source: self.source() }));
            }
        }
        out
    }

    /// Axes of a gyro whose components of g the drift is multiplied by.
    fn gravity(self, gyro: &GyroAxes) -> Vec<SignedAxis> {
        let letters = if self == Self::F { "" } else { self.letters() };
        let axis = |letter| match letter {
            'I' => gyro.I,
            'O' => gyro.O,
            _ => gyro.S,
        };
        letters.chars().map(axis).collect()
    }
}

/// Sensors that define the platform axes, and so the misalignments that are unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DefinedBy {
    /// Accelerometers: their input axes define the platform axes; unknown are GM and M3.
    #[default]
    Accelerometers,
    /// Gyros: their input axes define the platform axes; unknown are GM3 and M6.
    Gyros,
    /// Body axes: unknown are GM and M6, of which a rotation of all axes is not observable.
    Body,
}

impl DefinedBy {
    /// All frames.
    pub const ALL: [Self; 3] = [Self::Accelerometers, Self::Gyros, Self::Body];

    /// Name in files and options.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Accelerometers => "accelerometers",
            Self::Gyros => "gyros",
            Self::Body => "body",
        }
    }

    /// Terms of the misalignments of gyros and accelerometers.
    pub const fn misalignments(self) -> [Term; 2] {
        match self {
            Self::Accelerometers => [Term::GM, Term::M3],
            Self::Gyros => [Term::GM3, Term::M6],
            Self::Body => [Term::GM, Term::M6],
        }
    }
}

/// Error for a text that is not one of the frames.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is not a frame; expected accelerometers, gyros or body")]
pub struct FrameError {
    /// The text found.
    pub found: String,
}

impl FromStr for DefinedBy {
    type Err = FrameError;
    fn from_str(text: &str) -> Result<Self, FrameError> {
        let found = Self::ALL.into_iter().find(|f| f.name() == text);
        found.ok_or_else(|| FrameError { found: text.into() })
    }
}

/// Reasons why a list of terms is not usable.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TermError {
    /// A text is not a term.
    #[error(
        "`{found}` is not a term; expected some of F, I, O, S, II, OO, SS, IO, IS, OS, GS, GM, GM3 \
         (gyros), K0, K1, M6, M3, K2, K3, Kx (accelerometers), or gyros, accelerometers, all, or `drift` \
         alone"
    )]
    Unknown {
        /// The text found.
        found: String,
    },
    /// A term occurs twice.
    #[error("term {found} is listed twice; expected every term once")]
    Duplicate {
        /// Letters of the term.
        found: &'static str,
    },
    /// A term and its lower triangle both occur.
    #[error("terms {whole} and {triangle}: the second is part of the first; expected one of them")]
    Both {
        /// Letters of the term with six coefficients.
        whole: &'static str,
        /// Letters of its lower triangle.
        triangle: &'static str,
    },
    /// A misalignment does not fit the frame.
    #[error("frame {frame} makes {expected} the unknown misalignments; found {found} among the terms")]
    Frame {
        /// Name of the frame.
        frame: &'static str,
        /// Misalignments of the frame.
        expected: String,
        /// Letters of the misalignment found.
        found: &'static str,
    },
    /// A frame is given, but no term depends on it.
    #[error(
        "frame {frame}, but no misalignment is among the terms; expected a family (gyros, accelerometers, \
         all) or one of {expected}"
    )]
    NoMisalignment {
        /// Name of the frame.
        frame: &'static str,
        /// Misalignments of the frame.
        expected: String,
    },
}

/// Unknowns besides psi.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unknowns {
    /// Coefficients of these terms, for the three gyros and accelerometers.
    Coefficients(Vec<Term>),
    /// Total drift `eps^n` of a single position, with `psi` in n: (8), (9).
    Drift,
}

impl Default for Unknowns {
    fn default() -> Self {
        Self::Coefficients(vec![Term::F, Term::I, Term::O, Term::S])
    }
}

impl Unknowns {
    /// A comma-separated list of terms such as `F,I,O,S` and families (`gyros`, `accelerometers`, `all`), or
    /// `drift`. The `frame` decides the misalignments of families.
    ///
    /// # Errors
    /// [`TermError`].
    pub fn of(text: &str, frame: Option<DefinedBy>) -> Result<Self, TermError> {
        if text.trim() == "drift" && frame.is_none() {
            return Ok(Self::Drift);
        }
        let [of_gyros, of_accelerometers] = frame.unwrap_or_default().misalignments();
        let gyros = [Term::F, Term::I, Term::O, Term::S, Term::GS, of_gyros];
        let accelerometers = [Term::K0, Term::K1, of_accelerometers, Term::K2];
        let mut terms = Vec::new();
        for part in text.split(',').map(str::trim) {
            let named: Vec<Term> = match part {
                "gyros" => gyros.to_vec(),
                "accelerometers" => accelerometers.to_vec(),
                "all" => gyros.into_iter().chain(accelerometers).collect(),
                _ => Term::ALL.into_iter().filter(|t| t.letters() == part).collect(),
            };
            if named.is_empty() {
                return Err(TermError::Unknown { found: part.into() });
            }
            for term in named {
                if terms.contains(&term) {
                    return Err(TermError::Duplicate { found: term.letters() });
                }
                terms.push(term);
            }
        }
        if let Some(frame) = frame {
            let own = frame.misalignments();
            let expected = own.map(Term::letters).join(" and ");
            let frame = frame.name();
            let mut found =
                terms.iter().filter(|t| t.shape() != TriadShape::Each && **t != Term::Kx).peekable();
            if found.peek().is_none() {
                return Err(TermError::NoMisalignment { frame, expected });
            }
            if let Some(other) = found.find(|t| !own.contains(t)) {
                return Err(TermError::Frame { frame, expected, found: other.letters() });
            }
        }
        terms.sort_unstable();
        let unknowns = Self::Coefficients(terms);
        unknowns.validate()?;
        Ok(unknowns)
    }

    /// Checks that no coefficient occurs twice.
    ///
    /// # Errors
    /// [`TermError::Both`].
    pub(super) fn validate(&self) -> Result<(), TermError> {
        let has = |term: Term| self.terms().contains(&term);
        for (whole, triangle) in [(Term::GM, Term::GM3), (Term::M6, Term::M3)] {
            if has(whole) && has(triangle) {
                return Err(TermError::Both { whole: whole.letters(), triangle: triangle.letters() });
            }
        }
        Ok(())
    }

    /// Terms; none if the unknown is the drift itself.
    pub fn terms(&self) -> &[Term] {
        match self {
            Self::Coefficients(terms) => terms,
            Self::Drift => &[],
        }
    }

    /// True if the unknowns have a term with this source.
    pub fn have(&self, source: ErrorSource) -> bool {
        self.terms().iter().any(|t| t.source() == source)
    }
}

impl FromStr for Unknowns {
    type Err = TermError;

    /// [`Unknowns::of`] without a frame.
    fn from_str(text: &str) -> Result<Self, TermError> {
        Self::of(text, None)
    }
}

impl fmt::Display for Unknowns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Drift => f.write_str("drift"),
            Self::Coefficients(terms) => {
                let letters: Vec<&str> = terms.iter().map(|t| t.letters()).collect();
                f.write_str(&letters.join(","))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn term_lists() {
        let shown = |s: &str| s.parse::<Unknowns>().map(|u| u.to_string());
        assert_eq!(shown("S,F"), Ok("F,S".into()));
        assert_eq!(shown("drift"), Ok("drift".into()));
        assert_eq!(shown("F,F"), Err(TermError::Duplicate { found: "F" }));
        assert_eq!(shown("F,Q"), Err(TermError::Unknown { found: "Q".into() }));
        assert_eq!(shown(""), Err(TermError::Unknown { found: "".into() }));
        assert_eq!(shown("GM,GM3"), Err(TermError::Both { whole: "GM", triangle: "GM3" }));
        assert_eq!(shown("gyros,F"), Err(TermError::Duplicate { found: "F" }));
        assert_eq!(shown("Kx, K3 ,accelerometers"), Ok("K0,K1,M3,K2,K3,Kx".into()));
    }

    #[test]
    fn frames_choose_misalignments() {
        let of = |text: &str, frame| Unknowns::of(text, Some(frame)).map(|u| u.to_string());
        assert_eq!(of("all", DefinedBy::Accelerometers), Ok("F,I,O,S,GS,GM,K0,K1,M3,K2".into()));
        assert_eq!(of("all", DefinedBy::Gyros), Ok("F,I,O,S,GS,GM3,K0,K1,M6,K2".into()));
        assert_eq!(of("all", DefinedBy::Body), Ok("F,I,O,S,GS,GM,K0,K1,M6,K2".into()));
        assert_eq!(of("F,GM3", DefinedBy::Gyros), Ok("F,GM3".into()));
        let wrong = |text, frame| of(text, frame).map_err(|e| e.to_string()).err().unwrap_or_default();
        assert!(
            wrong("F,GM", DefinedBy::Gyros).contains("makes GM3 and M6 the unknown misalignments; found GM")
        );
        assert!(wrong("F,I,Kx", DefinedBy::Body).contains("no misalignment"));
        assert!(wrong("drift", DefinedBy::Body).contains("not a term"));
        assert!("sideways".parse::<DefinedBy>().is_err());
    }

    /// Every term has the number of coefficients of the model, and every name occurs once.
    #[test]
    fn coefficients_of_every_term() {
        let geometry = Geometry::default();
        let names = |t: Term| t.coefficients(&geometry).into_iter().map(|(n, _)| n).collect::<Vec<_>>();
        for term in Term::ALL {
            let expected = match term {
                Term::GM | Term::M6 | Term::Kx => 6,
                _ => 3,
            };
            let found = term.coefficients(&geometry);
            assert_eq!(found.len(), expected, "{term:?}");
            assert!(
                found.iter().all(|(n, e)| n.starts_with(term.family()) && e.factors.len() == term.order())
            );
        }
        assert_eq!(names(Term::F), ["D_FX", "D_FY", "D_FZ"]);
        assert_eq!(names(Term::GM3), ["GM_YX", "GM_ZX", "GM_ZY"]);
        assert_eq!(names(Term::M6), ["M_XY", "M_XZ", "M_YX", "M_YZ", "M_ZX", "M_ZY"]);
        assert_eq!(names(Term::K2), ["K2_X", "K2_Y", "K2_Z"]);
        let kx = &Term::Kx.coefficients(&geometry)[1];
        assert_eq!(
            (kx.0.as_str(), kx.1.input.axis, kx.1.factors[0].axis, kx.1.factors[1].axis),
            ("Kx_XZ", 0, 0, 2)
        );
    }
}
