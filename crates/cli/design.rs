//! `obsdeg design`: the fewest positions, and the best of a number of positions.

use std::fmt::Write;
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use clap::{Args, ValueEnum};
use obsdeg_core::design::information::Criterion;
use obsdeg_core::design::{Design, DesignError, Options, design};
use obsdeg_core::model::attitude::{cardinal, cardinal_names};
use obsdeg_core::model::scheme::parse_attitude;
use obsdeg_core::model::{Carry, Latitude, Platform, Scheme, Unknowns};
use obsdeg_core::simulation::Conditions;
use obsdeg_core::simulation::conditions::resolve;

use crate::arguments::{OutputArguments, read_scheme};
use crate::conditions::MeasurementArguments;
use crate::failure::Failure;
use crate::progress::Bar;
use crate::{interrupt, output};

const AFTER_HELP: &str = "\
Examples:
  obsdeg design --minimum --carry inertial
  obsdeg design --positions 5 --carry inertial
  obsdeg design --positions 12 --dwell 417 --carry inertial --winner scheme.toml
  obsdeg design --positions 4 --candidates attitudes.toml
  obsdeg design --positions 6 --criterion margin --requirement D=0.05 --requirement D_F=0.01

Candidates are the 24 cardinal attitudes, or the positions of a scheme file. Up to 50 million sequences are searched
exhaustively, which proves the best; beyond, coordinate exchange from random starts. Ctrl-C ends with the best so far.
Exit codes: 0 done, 2 bad input (also when nothing can be found), 3 internal error.";

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CriterionArgument {
    Worst,
    A,
    D,
    E,
    Margin,
}

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// Find the best scheme of so many positions
    #[arg(long, value_name = "K", required_unless_present = "minimum")]
    positions: Option<usize>,

    /// Only find the fewest positions that make every coefficient observable, with the proof
    #[arg(long, conflicts_with = "positions")]
    minimum: bool,

    /// Positions of this scheme file to choose from; its carry, latitude, geometry and terms hold too (default: the 24
    /// cardinal attitudes)
    #[arg(long, value_name = "FILE")]
    candidates: Option<std::path::PathBuf>,

    /// What is carried between positions: platform (the paper), inertial or reset
    #[arg(long, value_name = "CARRY")]
    carry: Option<Carry>,

    /// Latitude in degrees (default: 28.2)
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    latitude: Option<Latitude>,

    /// Unknown terms of the gyro model: some of F,I,O,S,II,OO,SS,IO,IS,OS
    #[arg(long, value_name = "TERMS")]
    terms: Option<Unknowns>,

    /// What makes one scheme better: worst (largest sigma), a, d, e (optimal design), or margin (largest sigma over --requirement)
    #[arg(long, value_name = "HOW", default_value = "worst", hide_possible_values = true)]
    criterion: CriterionArgument,

    /// How many schemes are listed
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..=1000))]
    keep: u16,

    /// Restarts of the exchange
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u64).range(1..))]
    restarts: u64,

    /// Seed of all random choices; the result does not depend on the number of threads
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Write the best scheme to a scheme file
    #[arg(long, value_name = "FILE", requires = "positions")]
    winner: Option<std::path::PathBuf>,

    #[command(flatten)]
    output: OutputArguments,

    #[command(flatten)]
    measurement: MeasurementArguments,
}

pub(crate) fn run(a: &Arguments) -> Result<ExitCode, Failure> {
    output::check(&a.output)?;
    if let Some(path) = a.winner.as_ref().filter(|p| p.exists() && !a.output.force) {
        return Err(Failure::input(format!("{} exists; --force replaces it", path.display())));
    }
    let mut base = a.candidates.as_deref().map(read_scheme).transpose()?.unwrap_or_default();
    base.carry = a.carry.unwrap_or(base.carry);
    base.latitude = a.latitude.or(base.latitude);
    if let Some(terms) = &a.terms {
        base.unknowns = terms.clone();
    }
    let conditions = a.measurement.conditions(&base);
    conditions.validate().map_err(|e| Failure::input(e.to_string()))?;
    let (names, candidates) = if base.positions.is_empty() {
        let named = cardinal_names().into_iter().filter_map(|n| cardinal(&n).map(|c| (n, c)));
        named.unzip()
    } else {
        base.positions.iter().map(|p| (p.name.clone(), p.angles.clone())).unzip()
    };
    let options = Options {
        names,
        candidates,
        positions: a.positions,
        dwell_s: conditions.dwell_s,
        criterion: match a.criterion {
            CriterionArgument::Worst => Criterion::Worst,
            CriterionArgument::A => Criterion::A,
            CriterionArgument::D => Criterion::D,
            CriterionArgument::E => Criterion::E,
            CriterionArgument::Margin => Criterion::Margin(requirements(&base, &conditions)?),
        },
        keep: a.keep.into(),
        restarts: a.restarts,
        seed: a.seed,
    };
    let bar = Bar::start(1, "searching", a.output.quiet);
    let interrupted = interrupt::flag()?;
    let designed = design(&base, &conditions, &options, &|done, total, best| {
        bar.best(done, total, best);
        !interrupted.load(Ordering::Relaxed)
    });
    drop(bar);
    let found = designed.map_err(|e| match e {
        DesignError::Verdict(_) | DesignError::Filter(_) => Failure::internal(e.to_string()),
        _ => Failure::input(e.to_string()),
    })?;
    let text = obsdeg_report::design(&found, a.output.format, output::layout(&a.output))
        .map_err(|e| Failure::internal(e.to_string()))?;
    if let Some(path) = &a.winner {
        output::write_file(path, &scheme_file(&found, &base, &options))
            .map_err(|e| Failure::input(format!("cannot write {}: {e}", path.display())))?;
    }
    output::write(&a.output, &text)?;
    Ok(ExitCode::SUCCESS)
}

/// What is required of every coefficient.
fn requirements(base: &Scheme, conditions: &Conditions) -> Result<Vec<f64>, Failure> {
    let positions = Scheme::of_angles(cardinal("NUE")).positions;
    let scheme = Scheme { positions, combinations: Vec::new(), ..base.clone() };
    let platform = Platform::new(scheme).map_err(|e| Failure::input(e.to_string()))?;
    let all = resolve("required sigma", &platform, &conditions.requirements, f64::NAN);
    let all = all.map_err(|e| Failure::input(e.to_string()))?;
    let drifts =
        platform.names().iter().zip(platform.units()).zip(all).filter(|((_, unit), _)| **unit != "rad");
    let mut out = Vec::new();
    for ((name, _), required) in drifts {
        if !(required.is_finite() && required > 0.0) {
            return Err(Failure::input(format!(
                "the requirement for {name} is {required}; expected a sigma above 0"
            )));
        }
        out.push(required);
    }
    Ok(out)
}

/// The best scheme as a file that `obsdeg analyze --scheme` reads.
fn scheme_file(found: &Design, base: &Scheme, options: &Options) -> String {
    let mut out = String::new();
    let Some(best) = found.found.first() else { return out };
    let proven = if found.proven { "proven best" } else { "best found" };
    // writing to a String does not fail
    let _ = writeln!(
        out,
        "# {proven}: worst sigma(D) {:.4} deg/h (per g), seed {}",
        best.worst_sigma_dph, found.seed
    );
    let _ = writeln!(out, "carry = \"{}\"\nlatitude_deg = {}", found.carry, found.latitude_deg);
    let terms: Vec<String> = base.unknowns.to_string().split(',').map(|t| format!("\"{t}\"")).collect();
    let _ = writeln!(out, "terms = [{}]", terms.join(", "));
    for (letter, g) in ["X", "Y", "Z"].iter().zip(base.geometry.gyros()) {
        let _ = writeln!(out, "geometry.{letter} = {{ I = \"{}\", O = \"{}\", S = \"{}\" }}", g.I, g.O, g.S);
    }
    if base.measured_azimuth {
        out.push_str("measured_azimuth = true\n");
    }
    for (i, name) in best.positions.iter().enumerate() {
        let place = options.names.iter().position(|n| n == name);
        let angles = place.map(|c| options.candidates[c].each_ref().map(ToString::to_string).join(", "));
        let angles = angles.unwrap_or_default();
        let attitude = parse_attitude(name).map_or("", |_| name.as_str());
        let _ = writeln!(
            out,
            "\n[[position]] # {attitude}\nname = \"p{}\"\nangles_deg = [{angles}]\ndwell_s = {}",
            i + 1,
            found.dwell_s
        );
    }
    out
}
