//! `obsdeg completions` and `obsdeg man`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};
use obsdeg_report::File;

use crate::failure::Failure;
use crate::{command, output};

const AFTER_HELP: &str = "\
Examples:
  obsdeg completions bash > ~/.local/share/bash-completion/completions/obsdeg
  obsdeg completions zsh > ~/.zfunc/_obsdeg             with fpath+=~/.zfunc before compinit in ~/.zshrc
  obsdeg completions fish > ~/.config/fish/completions/obsdeg.fish";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// The shell
    shell: Shell,
}

pub(crate) fn run(a: &Arguments) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(a.shell, &mut command(), "obsdeg", &mut text);
    output::print(&text)
}

#[derive(Debug, Args)]
#[command(after_help = MAN_AFTER_HELP)]
pub(crate) struct ManArguments {
    /// The command whose page it is (default: that of the program)
    #[arg(value_name = "COMMAND")]
    command: Option<String>,

    /// Write all pages to a folder instead, obsdeg.1, obsdeg-analyze.1 and so on
    #[arg(short, long, value_name = "DIR", conflicts_with = "command")]
    output: Option<PathBuf>,

    /// Replace files in the folder
    #[arg(long)]
    force: bool,
}

const MAN_AFTER_HELP: &str = "\
Examples:
  obsdeg man | man -l -
  obsdeg man analyze | man -l -
  obsdeg man -o ~/.local/share/man/man1                 then: man obsdeg-analyze";

/// Manual pages of the program and of every command, each with its name.
fn pages(command: &clap::Command) -> impl Iterator<Item = (String, clap::Command)> {
    let program = (command.get_name().to_string(), command.clone());
    let of: Vec<_> = command.get_subcommands().cloned().collect();
    let of = of.into_iter().map(|c| {
        let name = format!("obsdeg-{}", c.get_name());
        (name.clone(), c.name(name))
    });
    std::iter::once(program).chain(of)
}

/// Manual page of `command` in roff. The text after the help becomes sections of its own; examples keep their
/// lines.
fn page(command: clap::Command) -> std::io::Result<Vec<u8>> {
    let footer = command.get_after_long_help().or(command.get_after_help());
    let footer = footer.map(ToString::to_string).unwrap_or_default();
    let mut text = Vec::new();
    Man::new(command.after_help(None::<&str>).after_long_help(None::<&str>)).render(&mut text)?;
    let mut roff = Roff::new();
    for part in footer.split("\n\n") {
        let (first, rest) = part.split_once('\n').unwrap_or((part, ""));
        if first == "Examples:" {
            roff.control("SH", ["EXAMPLES"]).control("nf", []);
            for line in rest.lines() {
                roff.text([roman(line)]);
            }
            roff.control("fi", []);
        } else if let Some(codes) = part.strip_prefix("Exit codes: ") {
            roff.control("SH", ["EXIT STATUS"]).text([roman(codes)]);
        } else {
            roff.control("SH", ["NOTES"]).text([roman(part)]);
        }
    }
    roff.to_writer(&mut text)?;
    Ok(text)
}

/// Prints one manual page, or writes all pages to a folder.
pub(crate) fn man(a: &ManArguments) -> Result<(), Failure> {
    let mut command = command().disable_help_subcommand(true);
    command.build();
    let page = |c| page(c).map_err(|e| Failure::internal(e.to_string()));
    let Some(folder) = &a.output else {
        let asked = a.command.as_ref().map_or("obsdeg".into(), |c| format!("obsdeg-{c}"));
        let found = pages(&command).find(|(name, _)| *name == asked);
        return found.map_or(Ok(()), |(_, c)| output::print(&page(c)?));
    };
    let files: Vec<File> = pages(&command)
        .map(|(name, c)| Ok(File { name: format!("{name}.1"), bytes: page(c)? }))
        .collect::<Result<_, Failure>>()?;
    if folder == std::path::Path::new("-") {
        return Err(Failure::input(
            "-o - is stdout; expected a folder for the pages (one goes to stdout without -o)".into(),
        ));
    }
    output::write_files(folder, &files, a.force)
}
