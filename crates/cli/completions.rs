//! `obsdeg completions` and `obsdeg man`.

use clap::Args;
use clap_complete::Shell;

use crate::failure::Failure;
use crate::{command, output};

const AFTER_HELP: &str = "\
Examples:
  obsdeg completions bash > /etc/bash_completion.d/obsdeg
  obsdeg completions zsh > _obsdeg";

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

/// The manual page: the program, then every command.
pub(crate) fn man() -> Result<(), Failure> {
    let mut text = Vec::new();
    let mut command = command();
    command.build();
    let mut render = |c: clap::Command| {
        clap_mangen::Man::new(c).render(&mut text).map_err(|e| Failure::internal(e.to_string()))
    };
    render(command.clone())?;
    for sub in command.get_subcommands().filter(|c| !c.is_hide_set() && c.get_name() != "help") {
        render(sub.clone().name(format!("obsdeg-{}", sub.get_name())))?;
    }
    output::print(&text)
}
