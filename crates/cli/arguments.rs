//! Arguments that several commands share.

use std::path::{Path, PathBuf};

use clap::Args;
use obsdeg_core::model::attitude::Euler;
use obsdeg_core::model::rotation::Rotation;
use obsdeg_core::model::scheme::parse_attitude;
use obsdeg_core::model::{Carry, Latitude, Scheme, Unknowns, scheme_file};
use obsdeg_core::system::model_file;
use obsdeg_report::Format;

use crate::failure::Failure;
use crate::input::read_text;

/// What is analysed.
#[derive(Debug, Args)]
pub(crate) struct SchemeArguments {
    /// Euler angles alpha,beta,gamma of a position in degrees (C_c^n = Mx My Mz); once per position.
    /// A name stands for any angle (alpha,0,gamma); three letters give the directions of X_p, Y_p, Z_p (NUE). A,B,G@X_p:360 turns from there, at a constant
    /// rate for its dwell, about a platform axis (X_p, Y_p, Z_p) or a geographic one (N, U, E)
    #[arg(long, value_name = "A,B,G", allow_hyphen_values = true, value_parser = attitude, conflicts_with = "scheme")]
    angles: Vec<EulerArgument>,

    /// Scheme file (TOML)
    #[arg(long, value_name = "FILE")]
    scheme: Option<PathBuf>,

    /// What is carried between positions: platform (the paper), inertial or reset
    #[arg(long, value_name = "CARRY")]
    carry: Option<Carry>,

    /// Latitude in degrees, exact; left out: generic
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    latitude: Option<Latitude>,

    /// Unknown terms of the gyro model: some of F,I,O,S,II,OO,SS,IO,IS,OS; or drift for eps^n of one position
    #[arg(long, value_name = "TERMS")]
    terms: Option<Unknowns>,

    /// The azimuth psi_y^n is measured too
    #[arg(long)]
    measured_azimuth: bool,

    /// A linear combination of unknowns to be judged too, such as "D_IX - D_IY"; coefficients may have wN, wU, sqrt(2), sqrt(3), and
    /// sines and cosines of the scheme's angles ("sin(20 deg)", "cos(alpha)")
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    combination: Vec<String>,
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

impl SchemeArguments {
    /// The scheme: from the file or the angles, with whatever options override.
    pub(crate) fn scheme(&self) -> Result<Scheme, Failure> {
        let mut scheme = match &self.scheme {
            Some(path) => read_scheme(path)?,
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
        if let Some(carry) = self.carry {
            scheme.carry = carry;
        }
        if let Some(latitude) = self.latitude {
            scheme.latitude = Some(latitude);
        }
        if let Some(terms) = &self.terms {
            scheme.unknowns = terms.clone();
        }
        scheme.measured_azimuth |= self.measured_azimuth;
        scheme.combinations.extend(self.combination.iter().cloned());
        Ok(scheme)
    }
}

/// Whether a file that is no scheme is meant as a model.
fn is_model(path: &Path, text: &str) -> bool {
    let json = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    json || text.trim_start().starts_with('{') || model_file::is_model(text)
}

/// The scheme of a file.
pub(crate) fn read_scheme(path: &Path) -> Result<Scheme, Failure> {
    scheme_of(path, &read_text(path, "scheme")?)
}

/// The scheme of a file that was read.
pub(crate) fn scheme_of(path: &Path, text: &str) -> Result<Scheme, Failure> {
    let name = path.display().to_string();
    scheme_file::read(text).map_err(|e| match e.span {
        _ if is_model(path, text) => Failure::input(format!(
            "{name} is a model file; expected a scheme file, with [[position]] tables (models go with --model, or to report)"
        )),
        Some(span) => Failure::at(&e.message, &name, text, span),
        None => Failure::input(format!("{name}: {}", e.message)),
    })
}

/// Where and how results are written.
#[derive(Debug, Args)]
pub(crate) struct OutputArguments {
    /// table, json, markdown, csv or latex
    #[arg(long, value_name = "FORMAT", default_value_t = Format::Table)]
    pub(crate) format: Format,

    /// Write to a file instead of stdout
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long)]
    pub(crate) force: bool,

    /// Say nothing on stderr but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// Where results go when there are figures and series too.
#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub(crate) struct FolderArguments {
    /// Format on stdout: table, json, markdown, csv or latex
    #[arg(long, value_name = "FORMAT", default_value_t = Format::Table)]
    pub(crate) format: Format,

    /// Write summary, series and figures to a folder
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,

    /// Replace files in an existing folder
    #[arg(long)]
    pub(crate) force: bool,

    /// Say nothing on stderr but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
}
