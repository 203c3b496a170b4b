//! Options that several commands share: the input, and its assumptions.

use std::ffi::OsStr;
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};
use clap::{Arg, Args, Command};
use obsdeg_core::model::{
    Carry, DefinedBy, Euler, Latitude, Path, Rotation, Scheme, TermError, Unknowns, parse_attitude,
};
use obsdeg_core::system::WorkLimit;
use serde::{Deserialize, Serialize};

use crate::problem::Problem;
use crate::source::{Input, NamedInput, Source};
use crate::text;

/// Default seed.
pub(crate) const SEED: u64 = 1;

/// Options that concern a model as well as a scheme.
const OF_BOTH: [&str; 20] = [
    "files",
    "scheme",
    "model",
    "before",
    "calibration",
    "solutions",
    "symbolic_limit",
    "engine_wait",
    "monte_carlo",
    "seed",
    "format",
    "table",
    "certificate",
    "why",
    "ascii",
    "output",
    "force",
    "quiet",
    "help",
    "help_long",
];

/// Options that concern models only; all other options of a command concern schemes.
const OF_MODELS: [&str; 7] =
    ["order", "count_limit", "relation_limit", "work_limit", "reduced", "starts", "profile"];

/// Options on the command line that concern one kind of file only, as they are written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Given {
    schemes: Vec<String>,
    models: Vec<String>,
}

impl Given {
    /// Sorts the given options, each with its name in snake case, by the kind of file that they concern.
    pub fn of<'a>(given: impl IntoIterator<Item = (&'a str, String)>) -> Self {
        let mut out = Self::default();
        for (id, option) in given {
            if !OF_BOTH.contains(&id) {
                if OF_MODELS.contains(&id) { &mut out.models } else { &mut out.schemes }.push(option);
            }
        }
        out
    }

    /// The same options without `option`, which concerns both kinds of file in this command.
    pub(crate) fn without(mut self, option: &str) -> Self {
        self.schemes.retain(|o| o != option);
        self
    }

    /// Refuses options for schemes if all files are models, and options for models if all are schemes.
    ///
    /// # Errors
    /// The options, and a file of the other kind.
    pub fn concern<'a>(&self, read: impl IntoIterator<Item = &'a NamedInput>) -> Result<(), Problem> {
        let (mut schemes, mut models) = (None, None);
        for (name, input) in read {
            let of = if matches!(input, Input::Model(_)) { &mut models } else { &mut schemes };
            of.get_or_insert(name.as_str());
        }
        match (schemes, models) {
            (None, Some(file)) if !self.schemes.is_empty() => Err(Problem::input(format!(
                "{} is about schemes; {file} is a model file, which says all of a model",
                self.schemes.join(", ")
            ))),
            (Some(file), None) if !self.models.is_empty() => Err(Problem::input(format!(
                "{} is about models; {} is a scheme",
                self.models.join(", "),
                if file.is_empty() { "what --angles say" } else { file }
            ))),
            _ => Ok(()),
        }
    }
}

/// Input besides files: positions, combinations, and assumptions that override files.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[command(next_help_heading = "What is judged")]
#[serde(default)]
pub struct InputOptions {
    /// Euler angles alpha,beta,gamma of a position in degrees (C_c^n = Mx My Mz): those of the outer gimbal,
    /// about North, of the middle one, and of the inner one, about Z_p; once per position. A name stands for
    /// any angle (alpha,0,gamma); three letters give the directions of X_p, Y_p, Z_p (NUE). A,B,G@X_p:360
    /// turns from there, at a constant rate for its dwell, about a platform axis (X_p, Y_p, Z_p) or a
    /// geographic one (N, U, E)
    #[arg(long, value_name = "A,B,G", allow_hyphen_values = true)]
    #[serde(with = "text::list")]
    pub angles: Vec<Attitude>,

    /// A linear combination of unknowns to be judged too, such as "D_IX - D_IY"; coefficients may have wN,
    /// wU, sqrt(2), sqrt(3), and sines and cosines of the scheme's angles ("sin(20 deg)", "cos(alpha)")
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub combination: Vec<String>,

    /// Assumptions that override those of scheme files.
    #[command(flatten)]
    #[serde(flatten)]
    pub assumptions: Assumptions,

    /// Unknowns that override those of scheme files.
    #[command(flatten)]
    #[serde(flatten)]
    pub terms: TermOptions,

    /// Path of the platform from one position to the next. Torquer errors (GS, GM, GM3) act on the way
    /// under inertial carry
    #[arg(long, value_name = "PATH", help_heading = "Assumptions", value_parser = one_of(PATHS))]
    pub path: Option<Path>,

    /// The azimuth psi_y^n is measured too
    #[arg(long, help_heading = "Assumptions")]
    pub measured_azimuth: bool,

    /// Limit of the work of a verdict on a model at a random point, in millions of operations, with half as
    /// many bytes: what takes more is refused before it is computed (default: 600, some seconds)
    #[arg(long, value_name = "MILLIONS", help_heading = "Models", value_parser = whole::<u64>(WORK))]
    pub work_limit: Option<u64>,

    /// Given options that concern one kind of file only.
    #[arg(skip)]
    #[serde(skip)]
    pub given: Given,
}

/// Range of work limits, in millions of operations.
pub(crate) const WORK: RangeInclusive<u64> = 1..=1_000_000_000;

/// The words of `--path`.
const PATHS: [Word<Path>; 2] = [
    ("one-axis", "the shortest way, by one turn", Path::OneAxis),
    (
        "gimbals",
        "alpha (outer), beta (middle), gamma (inner), one after another; within gimbal limits if both ends are",
        Path::Gimbals,
    ),
];

/// The words of `--carry`.
pub(crate) const CARRIES: [Word<Carry>; 3] = [
    ("platform", "psi goes on in platform axes, as in the paper", Carry::Platform),
    ("inertial", "psi goes on in geographic axes: real torqued slews", Carry::Inertial),
    ("reset", "every position has a psi of its own", Carry::Reset),
];

/// The words of `--axes`.
const AXES: [Word<DefinedBy>; 3] = [
    ("accelerometers", "families have GM and M3", DefinedBy::Accelerometers),
    ("gyros", "families have GM3 and M6", DefinedBy::Gyros),
    ("body", "families have GM and M6, of which a rotation is not observable", DefinedBy::Body),
];

/// Assumptions that override those of scheme files.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Assumptions")]
#[serde(default)]
pub struct Assumptions {
    /// Quantity that continues from one position to the next
    #[arg(long, value_name = "CARRY", value_parser = one_of(CARRIES))]
    pub carry: Option<Carry>,

    /// Latitude in degrees, exact; left out: generic
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    #[serde(with = "text")]
    pub latitude: Option<Latitude>,
}

/// Unknown terms of the error model.
#[derive(Debug, Clone, Default, PartialEq, Args, Serialize, Deserialize)]
#[command(next_help_heading = "Assumptions")]
#[serde(default)]
pub struct TermOptions {
    /// Unknown terms, separated by commas; or drift for eps^n of one position. Gyros:
    /// F,I,O,S,II,OO,SS,IO,IS,OS (drifts), GS (torquer scale factor), GM (misalignment of the input axes;
    /// GM3: its lower triangle). Accelerometers: K0 (bias), K1 (scale factor), M6 (misalignment; M3: its
    /// lower triangle), K2, K3 (second and third power of the force), Kx (products of forces). Families:
    /// gyros is F,I,O,S,GS and the misalignment, accelerometers is K0,K1,K2 and the misalignment, all is both
    #[arg(long, value_name = "TERMS", value_parser = listed)]
    pub terms: Option<String>,

    /// With --terms: what defines the platform axes, and so which misalignments the families have (default:
    /// accelerometers); `frame` in a scheme file
    #[arg(long, value_name = "SENSORS", value_parser = one_of(AXES))]
    pub axes: Option<DefinedBy>,
}

/// Reads a list of terms and keeps it as text: the frame may change the meaning of families.
fn listed(text: &str) -> Result<String, TermError> {
    text.parse::<Unknowns>().map(|_| text.into())
}

impl TermOptions {
    /// Unknowns that the options name; `None` without `--terms`.
    ///
    /// # Errors
    /// Unknown terms, terms that exclude each other, or `--axes` without `--terms`.
    pub fn unknowns(&self) -> Result<Option<Unknowns>, Problem> {
        if let (None, Some(axes)) = (&self.terms, self.axes) {
            let word = AXES.iter().find(|(.., a)| *a == axes).map_or("", |(word, ..)| word);
            return Err(Problem::input(format!(
                "--axes {word} does nothing here: expected --terms with it, as in --terms all (a scheme file \
                 says frame = \"{word}\")"
            )));
        }
        let of = |text: &String| Unknowns::of(text, self.axes).map_err(|e| Problem::input(e.to_string()));
        self.terms.as_ref().map(of).transpose()
    }
}

impl Assumptions {
    /// Sets the assumptions in a scheme.
    pub fn apply(&self, scheme: &mut Scheme) {
        scheme.carry = self.carry.unwrap_or(scheme.carry);
        scheme.latitude = self.latitude.or(scheme.latitude);
    }
}

/// Range of all whole numbers.
pub const ANY: RangeInclusive<u64> = 0..=u64::MAX;

/// Parser of a whole number within a range.
pub fn whole<T: TryFrom<u64>>(
    range: RangeInclusive<u64>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.trim().parse().ok().filter(|n| range.contains(n));
        let wrong = || format!("{}, found {text}", expected(&range));
        number.and_then(|n| T::try_from(n).ok()).ok_or_else(wrong)
    }
}

fn expected(range: &RangeInclusive<u64>) -> String {
    let high = if *range == ANY { "2^64-1".into() } else { range.end().to_string() };
    format!("expected a whole number {} to {high}", range.start())
}

/// Refuses a whole number outside a range.
pub(crate) fn check_whole(
    option: &str,
    number: impl Into<u64>,
    range: &RangeInclusive<u64>,
) -> Result<(), Problem> {
    let number = number.into();
    match range.contains(&number) {
        true => Ok(()),
        false => Err(Problem::input(format!("{option} {number}: {}", expected(range)))),
    }
}

/// Parser of any text; help and completions list the words with a meaning of their own.
#[derive(Clone)]
pub(crate) struct WordOr<const N: usize>(pub(crate) [(&'static str, &'static str); N]);

impl<const N: usize> TypedValueParser for WordOr<N> {
    type Value = String;

    fn parse_ref(&self, command: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<String, clap::Error> {
        StringValueParser::new().parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(self.0.iter().map(|(word, help)| PossibleValue::new(*word).help(*help))))
    }
}

/// Word of an option, its meaning, and its value.
pub type Word<T> = (&'static str, &'static str, T);

/// Parser of one of several words, as its value; help and completions list the words.
pub fn one_of<T: Clone + Send + Sync + 'static, const N: usize>(
    words: [Word<T>; N],
) -> impl TypedValueParser<Value = T> {
    let listed = words.iter().map(|(word, help, _)| PossibleValue::new(*word).help(*help));
    let read = PossibleValuesParser::new(listed.collect::<Vec<_>>());
    let meant = move |word: String| {
        words.iter().find(|(w, ..)| *w == word).map(|(.., t)| t.clone()).ok_or("expected one of the words")
    };
    read.try_map(meant)
}

/// Three Euler angles and, if given, the turn that starts there, as they were written.
#[derive(Debug, Clone, PartialEq)]
pub struct Attitude {
    text: String,
    pub(crate) angles: Euler,
    pub(crate) rotation: Option<Rotation>,
}

impl fmt::Display for Attitude {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Attitude {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.starts_with("--") {
            return Err(format!("expected three angles such as 180,0,0, found the option `{text}`"));
        }
        let (start, rotation) = text.split_once('@').map_or((text, None), |(a, r)| (a, Some(r)));
        let rotation = rotation.map(|r| {
            let (about, angle) = r.split_once(':').ok_or_else(|| {
                format!("expected an axis and an angle after @, as in 0,0,0@X_p:360, found `{r}`")
            })?;
            Rotation::new(about, angle).map_err(|e| e.to_string())
        });
        let angles = parse_attitude(start).map_err(|e| e.to_string())?;
        Ok(Self { text: text.into(), angles, rotation: rotation.transpose()? })
    }
}

impl InputOptions {
    /// Reads schemes and models from texts or from `--angles`, and applies the options that override them.
    ///
    /// # Errors
    /// Defect of an input, with its place.
    pub fn read(&self, sources: Vec<Source>) -> Result<Vec<NamedInput>, Problem> {
        let mut read: Vec<NamedInput> = sources.into_iter().map(Source::read).collect::<Result<_, _>>()?;
        if read.is_empty() {
            if self.angles.is_empty() {
                return Err(Problem::input(
                    "nothing to judge; expected a scheme or model FILE, or --angles A,B,G once per position",
                ));
            }
            let mut scheme = Scheme::of_angles(self.angles.iter().map(|a| a.angles.clone()));
            for (position, a) in scheme.positions.iter_mut().zip(&self.angles) {
                position.rotation.clone_from(&a.rotation);
            }
            read.push((String::new(), Input::Scheme(Box::new(scheme))));
        } else if !self.angles.is_empty() {
            return Err(Problem::input("found --angles beside a file; expected one of them"));
        }
        self.given.concern(&read)?;
        if let Some(limit) = self.work_limit {
            check_whole("--work-limit", limit, &WORK)?;
            for (_, input) in &mut read {
                if let Input::Model(file) = input {
                    file.model.work_limit = WorkLimit(limit);
                }
            }
        }
        let terms = self.terms.unknowns()?;
        for (_, input) in &mut read {
            let Input::Scheme(scheme) = input else { continue };
            self.assumptions.apply(scheme);
            scheme.path = self.path.or(scheme.path);
            if let Some(terms) = &terms {
                scheme.unknowns = terms.clone();
            }
            scheme.measured_azimuth |= self.measured_azimuth;
            scheme.combinations.extend(self.combination.iter().cloned());
        }
        Ok(read)
    }

    /// Reads exactly one scheme or model, as [`InputOptions::read`] does.
    ///
    /// # Errors
    /// Defect of the input, with its place; more than one input.
    pub fn read_one(&self, sources: Vec<Source>) -> Result<Input, Problem> {
        let mut read = self.read(sources)?;
        match (read.pop(), read.len()) {
            (Some((_, input)), 0) => Ok(input),
            (_, more) => {
                Err(Problem::input(format!("found {} files; expected one scheme or model", more + 1)))
            }
        }
    }
}
