//! Files with schemes and models on the command line, and the options that depend on them.

use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, Command};
use obsdeg_commands::{Expected, Given, Source};
use obsdeg_evidence::requirements::Requirements;

use crate::failure::Failure;
use crate::input::{one_on_stdin, read_all, read_as};

/// Options given on the command line of `command`: in snake case, and as they are written.
pub(crate) fn given(command: &Command, matches: &ArgMatches) -> Given {
    let given = command.get_arguments().filter_map(|arg| {
        let id = arg.get_id().as_str();
        let given = matches.value_source(id) == Some(ValueSource::CommandLine);
        given.then(|| (id, format!("--{}", arg.get_long().unwrap_or_default())))
    });
    Given::of(given)
}

/// Schemes and models to judge; the content of a file decides which of the two it is.
#[derive(Debug, Args)]
#[command(next_help_heading = "What is judged")]
pub(crate) struct Files {
    /// Scheme files (TOML) and model files (TOML, or JSON): any system x' = f(x, u, p, t), z = h; - is stdin
    #[arg(value_name = "FILE", display_order = 0, conflicts_with_all = ["angles", "scheme", "model"])]
    files: Vec<PathBuf>,

    /// A scheme file, as without the option; it must be one
    #[arg(long, value_name = "FILE", conflicts_with = "angles")]
    scheme: Option<PathBuf>,

    /// A model file, as without the option; it must be one
    #[arg(long, value_name = "FILE", conflicts_with_all = ["angles", "scheme"])]
    model: Option<PathBuf>,
}

impl Files {
    /// Texts of the files; empty if positions are given by angles.
    pub(crate) fn read(&self) -> Result<Vec<Source>, Failure> {
        match (&self.scheme, &self.model) {
            (Some(path), _) => Ok(vec![read_as(path, Expected::Scheme)?]),
            (_, Some(path)) => Ok(vec![read_as(path, Expected::Model)?]),
            _ => read_all(&self.files),
        }
    }
}

/// Scheme and model files of a command that has no other input to judge.
#[derive(Debug, Args)]
#[command(next_help_heading = "What is judged")]
pub(crate) struct AllFiles {
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

impl AllFiles {
    /// Texts of all files.
    pub(crate) fn read(&self) -> Result<Vec<Source>, Failure> {
        one_on_stdin(self.files.iter().chain(&self.scheme).chain(&self.model))?;
        let mut read = read_all(&self.files)?;
        for (paths, must_be) in [(&self.scheme, Expected::Scheme), (&self.model, Expected::Model)] {
            for path in paths {
                read.push(read_as(path, must_be)?);
            }
        }
        Ok(read)
    }
}

/// `--require-met`: the exit code reports missed requirements to scripts.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct RequireMet {
    /// Exit with 1 if a stated requirement is missed (2: none is stated)
    #[arg(long, help_heading = "Output")]
    require_met: bool,
}

impl RequireMet {
    /// Refuses an answer in which no requirement is stated.
    ///
    /// # Errors
    /// Input error, before anything is written.
    pub(crate) fn check<'a>(self, all: impl IntoIterator<Item = &'a Requirements>) -> Result<(), Failure> {
        let mut all = all.into_iter().peekable();
        let none = all.peek().is_none() || all.any(|r| r.stated == 0);
        match self.require_met && none {
            true => Err(Failure::input(
                "--require-met: no requirement is stated (of some scheme); expected --requirement NAME=SIGMA \
                 or [requirements] in the scheme file".into(),
            )),
            false => Ok(()),
        }
    }

    /// Reports a missed requirement by the exit code.
    ///
    /// # Errors
    /// Failed check, after the answer is printed.
    pub(crate) fn decide<'a>(self, all: impl IntoIterator<Item = &'a Requirements>) -> Result<(), Failure> {
        self.decide_with(all, true)
    }

    /// Reports a missed requirement, or limits within which not everything is accepted, by the exit code.
    ///
    /// # Errors
    /// Failed check, after the answer is printed.
    pub(crate) fn decide_with<'a>(
        self,
        all: impl IntoIterator<Item = &'a Requirements>,
        accepted: bool,
    ) -> Result<(), Failure> {
        let missed = self.require_met && (!accepted || all.into_iter().any(Requirements::any_missed));
        if missed { Err(Failure::check()) } else { Ok(()) }
    }
}

/// Help of `files` for a command that judges one scheme or model at a time.
pub(crate) fn one_file(arg: Arg) -> Arg {
    match arg.get_id() == "files" {
        true => arg.num_args(0..=1).action(clap::ArgAction::Set).help(
            "A scheme file (TOML) or a model file (TOML, or JSON), with numbers for a simulation; - is stdin",
        ),
        false => arg,
    }
}

/// Help of `--latitude` for commands whose numbers need a latitude.
pub(crate) fn with_latitude(arg: Arg) -> Arg {
    match arg.get_id() == "latitude" {
        true => arg.help("Latitude in degrees (default: that of the file, or 28.2)"),
        false => arg,
    }
}
