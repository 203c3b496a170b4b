//! Arguments that several commands share.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Command, Id};
use obsdeg_core::model::{
    Carry, DefinedBy, Euler, Latitude, Path, Rotation, Scheme, TermError, Unknowns, parse_attitude,
};

use crate::failure::Failure;
use crate::input::{Input, Source};

/// Options that a model takes as well as a scheme, or a model alone; all others of a command are about schemes.
const OF_MODELS: [&str; 14] = [
    "files",
    "starts",
    "profile",
    "before",
    "model",
    "order",
    "count_limit",
    "solutions",
    "symbolic_limit",
    "seed",
    "format",
    "output",
    "force",
    "quiet",
];

/// What is judged: a scheme, or a model.
#[derive(Debug, Args)]
pub(crate) struct InputArguments {
    /// Euler angles alpha,beta,gamma of a position in degrees (C_c^n = Mx My Mz); once per position.
    /// A name stands for any angle (alpha,0,gamma); three letters give the directions of X_p, Y_p, Z_p (NUE). A,B,G@X_p:360 turns from there, at a constant
    /// rate for its dwell, about a platform axis (X_p, Y_p, Z_p) or a geographic one (N, U, E)
    #[arg(long, value_name = "A,B,G", allow_hyphen_values = true, value_parser = attitude, conflicts_with = "scheme")]
    angles: Vec<EulerArgument>,

    /// Scheme file (TOML)
    #[arg(long, value_name = "FILE")]
    scheme: Option<PathBuf>,

    #[command(flatten)]
    assumptions: Assumptions,

    #[command(flatten)]
    terms: TermArguments,

    /// How the platform is turned from one position to the next: one-axis (the shortest way) or gimbals (alpha, beta, gamma). Torquer
    /// errors (GS, GM, GM3) act on the way under inertial carry
    #[arg(long, value_name = "PATH")]
    path: Option<Path>,

    /// The azimuth psi_y^n is measured too
    #[arg(long)]
    measured_azimuth: bool,

    /// A linear combination of unknowns to be judged too, such as "D_IX - D_IY"; coefficients may have wN, wU, sqrt(2), sqrt(3), and
    /// sines and cosines of the scheme's angles ("sin(20 deg)", "cos(alpha)")
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    combination: Vec<String>,

    /// Any other system: a model file (TOML, or JSON)
    #[arg(long, value_name = "FILE")]
    pub(crate) model: Option<PathBuf>,
}

/// What holds of schemes, whatever their files say.
#[derive(Debug, Args)]
pub(crate) struct Assumptions {
    /// What is carried between positions: platform (the paper), inertial or reset
    #[arg(long, value_name = "CARRY")]
    carry: Option<Carry>,

    /// Latitude in degrees, exact; left out: generic
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    latitude: Option<Latitude>,
}

/// What is unknown.
#[derive(Debug, Args)]
pub(crate) struct TermArguments {
    /// Unknown terms, separated by commas; or drift for eps^n of one position. Gyros: F,I,O,S,II,OO,SS,IO,IS,OS (drifts), GS (torquer
    /// scale factor), GM (misalignment of the input axes; GM3: its lower triangle). Accelerometers: K0 (bias), K1 (scale factor), M6
    /// (misalignment; M3: its lower triangle), K2, K3 (second and third power of the force), Kx (products of forces). Families: gyros is
    /// F,I,O,S,GS and the misalignment, accelerometers is K0,K1,K2 and the misalignment, all is both
    #[arg(long, value_name = "TERMS", value_parser = listed)]
    terms: Option<String>,

    /// What defines the platform axes, and so which misalignments the families have: accelerometers (default; GM and M3), gyros (GM3 and M6)
    /// or body (GM and M6, of which a rotation is not observable); `frame` in a scheme file
    #[arg(long, value_name = "SENSORS", requires = "terms")]
    axes: Option<DefinedBy>,
}

/// A list of terms, as it is written: the frame may change what families are.
fn listed(text: &str) -> Result<String, TermError> {
    text.parse::<Unknowns>().map(|_| text.into())
}

impl TermArguments {
    /// What is unknown, if they say so.
    pub(crate) fn unknowns(&self) -> Result<Option<Unknowns>, Failure> {
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

/// A command with `--model` refuses every option beside it that is about schemes.
pub(crate) fn scheme_or_model(command: Command) -> Command {
    let of_schemes = |id: &&Id| !OF_MODELS.contains(&id.as_str());
    let of_schemes: Vec<Id> =
        command.get_arguments().map(|a| a.get_id()).filter(of_schemes).cloned().collect();
    command.mut_args(|a| if a.get_id() == "model" { a.conflicts_with_all(&of_schemes) } else { a })
}

/// Reads one of several words, as what it stands for.
pub(crate) fn one_of<T: Clone + Send + Sync + 'static, const N: usize>(
    words: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    let read = PossibleValuesParser::new(words.iter().map(|(word, _)| *word).collect::<Vec<_>>());
    let meant = move |word: String| {
        words.iter().find(|(w, _)| *w == word).map(|(_, t)| t.clone()).ok_or("expected one of the words")
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
    /// The model, or the scheme: from the file or the angles, with whatever options override.
    pub(crate) fn read(&self) -> Result<Input, Failure> {
        if let Some(path) = &self.model {
            return Source::read(path, "model")?.model().map(Input::model);
        }
        let mut scheme = match &self.scheme {
            Some(path) => Source::read(path, "scheme")?.scheme()?,
            None if self.angles.is_empty() => {
                return Err(Failure::input(
                    "nothing to judge; expected --angles A,B,G (once per position) or --scheme FILE".into(),
                ));
            }
            None => {
                let mut scheme = Scheme::of_angles(self.angles.iter().map(|a| a.0.clone()));
                for (position, a) in scheme.positions.iter_mut().zip(&self.angles) {
                    position.rotation.clone_from(&a.1);
                }
                scheme
            }
        };
        self.assumptions.apply(&mut scheme);
        scheme.path = self.path.or(scheme.path);
        if let Some(terms) = self.terms.unknowns()? {
            scheme.unknowns = terms;
        }
        scheme.measured_azimuth |= self.measured_azimuth;
        scheme.combinations.extend(self.combination.iter().cloned());
        Ok(Input::scheme(scheme))
    }
}
