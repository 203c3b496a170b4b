//! `obsdeg analyze`: the degree tables of schemes and models.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use obsdeg_commands::{Analyze, Given, Host, Input, NamedInput, analyze, certificate, reduced_model, title};
use obsdeg_report::position_figure;

use crate::arguments::Files;
use crate::engine::{EarlyVerdicts, EngineArguments, notice};
use crate::failure::Failure;
use crate::interrupt;
use crate::output::{Output, write_file, write_files};

const AFTER_HELP: &str = "\
Examples:
  obsdeg analyze --angles 0,0,0 --angles 180,0,0        the paper's two positions
  obsdeg analyze --angles NUE --angles NDW              the same by direction letters
  obsdeg analyze --angles alpha,0,gamma                 any alpha, any gamma, with degenerate angles
  obsdeg analyze --angles -90,0,0 --latitude 28.2 --carry inertial
  obsdeg analyze --angles 0,0,0 --terms drift           eps^n of a single position
  obsdeg analyze --angles 0,0,0 --combination \"D_FZ - wN*psi_y\"
  obsdeg analyze scheme.toml -o verdicts.json           JSON by the ending; .csv, .md, .tex as well
  obsdeg analyze model.toml                             any system x' = f(x, u, p, t), z = h
  obsdeg analyze examples/*/scheme.toml -o all.csv      several, one after another
  obsdeg analyze --angles NUE --angles NDW --why D_FZ   why it is not observable, and what would change that
  obsdeg analyze --angles NUE --angles NDW --figures pictures
  obsdeg analyze scheme.toml --certificate c.json       the proof, for obsdeg verify and other checkers

Units: angles and latitude in deg; psi in rad and D in rad/s, rad/s/g inside the formulas, with wN, wU in \
rad/s and Z in g.

Exit codes: 0 done, 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Analyze,

    #[command(flatten)]
    files: Files,

    #[command(flatten)]
    engine: EngineArguments,

    #[command(flatten)]
    output: Output,

    /// Draw the positions of every scheme, with g and the earth rate, as SVG into a folder
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    figures: Option<PathBuf>,

    /// Write a certificate of the verdicts on one scheme or rational model (JSON): its witness proves them to
    /// checkers that share no code with obsdeg
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    certificate: Option<PathBuf>,

    /// Write a model with the same outputs over complex numbers that is fully observable (TOML): some
    /// unknowns of the model with fixed numbers, the others in place of identifiable functions
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    reduced: Option<PathBuf>,
}

pub(crate) fn run(mut a: Arguments, given: Given) -> Result<(), Failure> {
    interrupt::ends()?;
    let target = &a.output.target;
    a.output.check()?;
    let new = [&a.certificate, &a.reduced];
    if let Some(path) = new.into_iter().flatten().find(|path| path.exists() && !target.force) {
        return Err(Failure::input(format!("{} exists; --force replaces it", path.display())));
    }
    a.asked.input.given = given;
    let read = a.asked.input.read(a.files.read()?)?;
    let message = match read[..] {
        [(_, Input::Model(_))] => "judging the model",
        _ => "solving symbolically (--solutions off leaves it out)",
    };
    // fails for a scheme or model without a certificate before anything is solved or written
    let certificate =
        a.certificate.as_ref().map(|path| Ok::<_, Failure>((path, certificate(&a.asked, &read)?)));
    let certificate = certificate.transpose()?;
    let reduced = a.reduced.as_ref().map(|path| Ok::<_, Failure>((path, reduced_model(&a.asked, &read)?)));
    let reduced = reduced.transpose()?;
    let read = Arc::new(read);
    let (judged, banner) = a.engine.lend(message, target.quiet, verdicts(&a.asked, &read), |worker| {
        Ok(analyze(&a.asked, &read, &mut Host { worker, ..Host::silent() })?)
    })?;
    if let Some(folder) = &a.figures {
        let mut figures = Vec::new();
        for (name, input) in read.iter() {
            let Input::Scheme(scheme) = input else { continue };
            let mut file = position_figure(scheme);
            if read.len() > 1 {
                file.name = format!("{}-{}", title(name), file.name);
            }
            figures.push(file);
        }
        write_files(folder, &figures, target.force)?;
    }
    for (path, file) in certificate.into_iter().chain(reduced) {
        write_file(path, &file.bytes)?;
    }
    a.output.write(&judged)?;
    notice(&banner, target.quiet);
    Ok(())
}

/// Verdicts without solutions, one line each; printed while another process uses the symbolic engine.
fn verdicts(asked: &Analyze, read: &Arc<Vec<NamedInput>>) -> EarlyVerdicts {
    let asked = Analyze { solutions: false, formulas: false, why: Vec::new(), ..asked.clone() };
    let read = Arc::clone(read);
    Box::new(move || {
        let found = analyze(&asked, &read, &mut Host::silent());
        found.map_or_else(|_| Vec::new(), |judged| judged.verdicts())
    })
}
