//! `obsdeg verify`: certificates, checked by a crate that shares no code with the engine.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use obsdeg_report::visible;
use obsdeg_verify::{Replay, verify_with};

use crate::failure::Failure;
use crate::input::{one_on_stdin, read};
use crate::interrupt;
use crate::output;

const AFTER_HELP: &str = "\
Examples:
  obsdeg analyze scheme.toml --certificate c.json
  obsdeg verify c.json scheme.toml
  obsdeg verify c.json                                   without a scheme: that of the certificate
  obsdeg design --positions 4 --carry inertial --certificate best.json
  obsdeg verify best.json --blocks 3                     an optimum: three of its blocks, searched again

It prints one sentence per unknown: what was verified, and how. Certificates of kind exact are checked in \
exact arithmetic, those of kind modular modulo two primes that a hash of the certificate chooses. The \
chapter Certificates of the book specifies the file, so that other checkers can be written; \
tools/verify_certificate.py is one.

Exit codes: 0 accepted, 1 refused (the reason is printed), 2 bad input, 3 internal error, 130 interrupted.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// Certificate (JSON), or - for stdin
    #[arg(value_name = "CERTIFICATE")]
    certificate: PathBuf,

    /// Scheme file (TOML) that the certificate must be of
    #[arg(value_name = "SCHEME")]
    scheme: Option<PathBuf>,

    /// Number of blocks of the certificate of an optimum that are searched again, chosen at random (default:
    /// all up to two million sequences, otherwise as many blocks as these fill)
    #[arg(long, value_name = "N")]
    blocks: Option<NonZeroUsize>,

    /// Seed of this choice (default: a number of the system, which is printed)
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    interrupt::ends()?;
    one_on_stdin([Some(&a.certificate), a.scheme.as_ref()].into_iter().flatten())?;
    let certificate = read(&a.certificate, "certificate")?;
    let scheme = a.scheme.as_ref().map(|path| read(path, "scheme")).transpose()?;
    let replay = Replay { blocks: a.blocks.map(NonZeroUsize::get), seed: a.seed };
    let text = scheme.as_ref().map(|s| s.text.as_str());
    let verified = verify_with(certificate.text.as_bytes(), text, &replay);
    if let Some(refused) = verified.as_ref().err().filter(|refused| refused.is_unreadable()) {
        return Err(Failure::input(visible(&refused.to_string()).into_owned()));
    }
    let lines = match &verified {
        Ok(sentences) => sentences.join("\n"),
        Err(refused) => format!("refused: {refused}"),
    };
    let lines: Vec<_> = lines.lines().map(visible).collect();
    output::print((lines.join("\n") + "\n").as_bytes())?;
    if verified.is_ok() { Ok(()) } else { Err(Failure::check()) }
}
