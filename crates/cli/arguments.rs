//! Arguments that several commands share.

use std::ffi::OsStr;
use std::ops::RangeInclusive;
use std::path::{Path as FilePath, PathBuf};

use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, Command};
use obsdeg_core::model::{
    Carry, DefinedBy, Euler, Latitude, Path, Rotation, Scheme, TermError, Unknowns, parse_attitude,
};

use crate::failure::Failure;
use crate::input::{Input, Source, is_stdin};

/// Options that concern a model as well as a scheme.
const OF_BOTH: [&str; 17] = [
    "files",
    "scheme",
    "model",
    "before",
    "calibration",
    "solutions",
    "symbolic_limit",
    "monte_carlo",
    "seed",
    "format",
    "table",
    "ascii",
    "output",
    "force",
    "quiet",
    "help",
    "help_long",
];

/// Options that concern models alone; all others of a command are about schemes.
const OF_MODELS: [&str; 4] = ["order", "count_limit", "starts", "profile"];

/// The options on the command line that concern one kind of file only, as they are written.
#[derive(Debug, Default)]
pub(crate) struct Given {
    schemes: Vec<String>,
    models: Vec<String>,
}

impl Given {
    /// What was given to a command.
    pub(crate) fn of(command: &Command, matches: &ArgMatches) -> Self {
        let mut out = Self::default();
        for arg in command.get_arguments() {
            let (id, name) = (arg.get_id().as_str(), arg.get_long().unwrap_or_default());
            let given = matches.value_source(id) == Some(ValueSource::CommandLine);
            if !given || OF_BOTH.contains(&id) {
                continue;
            }
            let of = if OF_MODELS.contains(&id) { &mut out.models } else { &mut out.schemes };
            of.push(format!("--{name}"));
        }
        out
    }

    /// Refuses options that are about the other kind of file than all that was read: nothing would hear of them.
    pub(crate) fn concern<'a>(&self, read: impl IntoIterator<Item = &'a Named>) -> Result<(), Failure> {
        let (mut schemes, mut models) = (None, None);
        for (name, input) in read {
            let of = if matches!(input, Input::Model(_)) { &mut models } else { &mut schemes };
            of.get_or_insert(name.as_str());
        }
        match (schemes, models) {
            (None, Some(file)) if !self.schemes.is_empty() => Err(Failure::input(format!(
                "{} is about schemes; {file} is a model file, which says all of a model",
                self.schemes.join(", ")
            ))),
            (Some(file), None) if !self.models.is_empty() => Err(Failure::input(format!(
                "{} is about models; {} is a scheme",
                self.models.join(", "),
                if file.is_empty() { "what --angles say" } else { file }
            ))),
            _ => Ok(()),
        }
    }
}

/// What was read, with the name of its file (none for angles).
pub(crate) type Named = (String, Input);

/// What is judged: schemes and models, told apart by what they say.
#[derive(Debug, Args)]
#[command(next_help_heading = "What is judged")]
pub(crate) struct InputArguments {
    /// Scheme files (TOML) and model files (TOML, or JSON): any system x' = f(x, u, p, t), z = h; - is stdin
    #[arg(value_name = "FILE", display_order = 0, conflicts_with_all = ["angles", "scheme", "model"])]
    files: Vec<PathBuf>,

    /// Euler angles alpha,beta,gamma of a position in degrees (C_c^n = Mx My Mz); once per position.
    /// A name stands for any angle (alpha,0,gamma); three letters give the directions of X_p, Y_p, Z_p (NUE). A,B,G@X_p:360 turns from there, at a constant
    /// rate for its dwell, about a platform axis (X_p, Y_p, Z_p) or a geographic one (N, U, E)
    #[arg(long, value_name = "A,B,G", allow_hyphen_values = true, value_parser = attitude, conflicts_with = "scheme")]
    angles: Vec<EulerArgument>,

    /// A scheme file, as without the option; it must be one
    #[arg(long, value_name = "FILE")]
    scheme: Option<PathBuf>,

    /// A model file, as without the option; it must be one
    #[arg(long, value_name = "FILE", conflicts_with_all = ["angles", "scheme"])]
    model: Option<PathBuf>,

    /// A linear combination of unknowns to be judged too, such as "D_IX - D_IY"; coefficients may have wN, wU, sqrt(2), sqrt(3), and
    /// sines and cosines of the scheme's angles ("sin(20 deg)", "cos(alpha)")
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    combination: Vec<String>,

    #[command(flatten)]
    assumptions: Assumptions,

    #[command(flatten)]
    terms: TermArguments,

    /// How the platform is turned from one position to the next. Torquer errors (GS, GM, GM3) act on the way under inertial carry
    #[arg(long, value_name = "PATH", help_heading = "Assumptions", value_parser = one_of(PATHS))]
    path: Option<Path>,

    /// The azimuth psi_y^n is measured too
    #[arg(long, help_heading = "Assumptions")]
    measured_azimuth: bool,
}

/// The words of `--path`.
const PATHS: [Word<Path>; 2] = [
    ("one-axis", "the shortest way", Path::OneAxis),
    ("gimbals", "alpha, beta, gamma, one after another", Path::Gimbals),
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

/// What holds of schemes, whatever their files say.
#[derive(Debug, Args)]
#[command(next_help_heading = "Assumptions")]
pub(crate) struct Assumptions {
    /// What is carried between positions
    #[arg(long, value_name = "CARRY", value_parser = one_of(CARRIES))]
    carry: Option<Carry>,

    /// Latitude in degrees, exact; left out: generic
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    latitude: Option<Latitude>,
}

/// What is unknown.
#[derive(Debug, Args)]
#[command(next_help_heading = "Assumptions")]
pub(crate) struct TermArguments {
    /// Unknown terms, separated by commas; or drift for eps^n of one position. Gyros: F,I,O,S,II,OO,SS,IO,IS,OS (drifts), GS (torquer
    /// scale factor), GM (misalignment of the input axes; GM3: its lower triangle). Accelerometers: K0 (bias), K1 (scale factor), M6
    /// (misalignment; M3: its lower triangle), K2, K3 (second and third power of the force), Kx (products of forces). Families: gyros is
    /// F,I,O,S,GS and the misalignment, accelerometers is K0,K1,K2 and the misalignment, all is both
    #[arg(long, value_name = "TERMS", value_parser = listed)]
    terms: Option<String>,

    /// With --terms: what defines the platform axes, and so which misalignments the families have (default: accelerometers); `frame` in a scheme file
    #[arg(long, value_name = "SENSORS", value_parser = one_of(AXES))]
    axes: Option<DefinedBy>,
}

/// A list of terms, as it is written: the frame may change what families are.
fn listed(text: &str) -> Result<String, TermError> {
    text.parse::<Unknowns>().map(|_| text.into())
}

impl TermArguments {
    /// What is unknown, if they say so.
    pub(crate) fn unknowns(&self) -> Result<Option<Unknowns>, Failure> {
        if let (None, Some(axes)) = (&self.terms, self.axes) {
            let word = AXES.iter().find(|(.., a)| *a == axes).map_or("", |(word, ..)| word);
            return Err(Failure::input(format!(
                "--axes {word} does nothing here: expected --terms with it, as in --terms all (a scheme file says frame = \"{word}\")"
            )));
        }
        let of = |text: &String| Unknowns::of(text, self.axes).map_err(|e| Failure::input(e.to_string()));
        self.terms.as_ref().map(of).transpose()
    }
}

impl Assumptions {
    /// Makes them hold.
    pub(crate) fn apply(&self, scheme: &mut Scheme) {
        scheme.carry = self.carry.unwrap_or(scheme.carry);
        scheme.latitude = self.latitude.or(scheme.latitude);
    }
}

/// Any whole number.
pub(crate) const ANY: RangeInclusive<u64> = 0..=u64::MAX;

/// Reads a whole number of a range.
pub(crate) fn whole<T: TryFrom<u64>>(
    range: RangeInclusive<u64>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.trim().parse().ok().filter(|n| range.contains(n));
        let high = if range == ANY { "2^64-1".into() } else { range.end().to_string() };
        let wrong = || format!("expected a whole number {} to {high}, found {text}", range.start());
        number.and_then(|n| T::try_from(n).ok()).ok_or_else(wrong)
    }
}

/// Any text; help and completions list the words that mean something of their own.
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

/// A word of an option, what it means and what it stands for.
pub(crate) type Word<T> = (&'static str, &'static str, T);

/// Reads one of several words, as what it stands for; the help and the completions list them.
pub(crate) fn one_of<T: Clone + Send + Sync + 'static, const N: usize>(
    words: [Word<T>; N],
) -> impl TypedValueParser<Value = T> {
    let listed = words.iter().map(|(word, help, _)| PossibleValue::new(*word).help(*help));
    let read = PossibleValuesParser::new(listed.collect::<Vec<_>>());
    let meant = move |word: String| {
        words.iter().find(|(w, ..)| *w == word).map(|(.., t)| t.clone()).ok_or("expected one of the words")
    };
    read.try_map(meant)
}

/// Three Euler angles (a type of its own: clap would take a list for several values).
#[derive(Debug, Clone)]
struct EulerArgument(Euler, Option<Rotation>);

fn attitude(text: &str) -> Result<EulerArgument, String> {
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
    let euler = parse_attitude(start).map_err(|e| e.to_string())?;
    Ok(EulerArgument(euler, rotation.transpose()?))
}

impl InputArguments {
    /// The models and the schemes: from the files or the angles, with whatever options override.
    pub(crate) fn read(&self, given: &Given) -> Result<Vec<Named>, Failure> {
        let mut read = if let Some(path) = &self.model {
            vec![model_in(path)?]
        } else if let Some(path) = &self.scheme {
            vec![scheme_in(path)?]
        } else if !self.files.is_empty() {
            read_all(&self.files)?
        } else if !self.angles.is_empty() {
            let mut scheme = Scheme::of_angles(self.angles.iter().map(|a| a.0.clone()));
            for (position, a) in scheme.positions.iter_mut().zip(&self.angles) {
                position.rotation.clone_from(&a.1);
            }
            vec![(String::new(), Input::scheme(scheme))]
        } else {
            return Err(Failure::input(
                "nothing to judge; expected a scheme or model FILE, or --angles A,B,G once per position"
                    .into(),
            ));
        };
        given.concern(&read)?;
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

    /// The same of a command that takes one.
    pub(crate) fn read_one(&self, given: &Given) -> Result<Input, Failure> {
        let read = self.read(given)?.into_iter().next();
        read.map(|(_, input)| input).ok_or_else(|| Failure::input("nothing to judge".into()))
    }
}

/// The files of a command that takes several and nothing else to judge.
#[derive(Debug, Args)]
#[command(next_help_heading = "What is judged")]
pub(crate) struct FileArguments {
    /// Scheme files (TOML) and model files (TOML, or JSON); - is stdin
    #[arg(value_name = "FILE", display_order = 0, required_unless_present_any = ["scheme", "model"])]
    files: Vec<PathBuf>,

    /// A scheme file, as without the option; it must be one
    #[arg(long, value_name = "FILE")]
    scheme: Vec<PathBuf>,

    /// A model file, as without the option; it must be one
    #[arg(long, value_name = "FILE")]
    model: Vec<PathBuf>,
}

impl FileArguments {
    /// All of them, in the order in which they are read.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.files.iter().chain(&self.scheme).chain(&self.model)
    }

    /// The schemes and models in them.
    pub(crate) fn read(&self) -> Result<Vec<Named>, Failure> {
        one_on_stdin(self.paths())?;
        let mut read = read_all(&self.files)?;
        for path in &self.scheme {
            read.push(scheme_in(path)?);
        }
        for path in &self.model {
            read.push(model_in(path)?);
        }
        Ok(read)
    }
}

/// What a command says that judges one scheme or model at a time.
pub(crate) fn one_file(arg: Arg) -> Arg {
    match arg.get_id() == "files" {
        true => arg.num_args(0..=1).action(clap::ArgAction::Set).help(
            "A scheme file (TOML) or a model file (TOML, or JSON), with numbers for a simulation; - is stdin",
        ),
        false => arg,
    }
}

/// The scheme in a file that must be one.
pub(crate) fn scheme_in(path: &FilePath) -> Result<Named, Failure> {
    let source = Source::read(path, "scheme")?;
    Ok((source.name(), Input::scheme(source.scheme()?)))
}

/// The model in a file that must be one.
pub(crate) fn model_in(path: &FilePath) -> Result<Named, Failure> {
    let source = Source::read(path, "model")?;
    Ok((source.name(), Input::model(source.model()?)))
}

/// Refuses to read stdin twice.
fn one_on_stdin<'a>(paths: impl Iterator<Item = &'a PathBuf>) -> Result<(), Failure> {
    match paths.filter(|path| is_stdin(path)).count() {
        0 | 1 => Ok(()),
        _ => Err(Failure::input("- is given twice; expected one file on stdin".into())),
    }
}

/// Schemes and models from files, told apart by what they say.
fn read_all(paths: &[PathBuf]) -> Result<Vec<Named>, Failure> {
    one_on_stdin(paths.iter())?;
    let one = |path: &PathBuf| {
        let source = Source::read(path, "scheme or model")?;
        Ok((source.name(), source.scheme_or_model()?))
    };
    paths.iter().map(one).collect()
}
