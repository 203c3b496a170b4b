//! What a report was made by and of: the command, and the digests of the files that it read.

use std::path::{Path, PathBuf};

use obsdeg_report::Origin;
use sha2::{Digest, Sha256};

use crate::failure::Failure;

/// The command without what says where its answer goes, and the digest of every file.
pub(crate) fn origin<'a>(files: impl Iterator<Item = &'a PathBuf>) -> Result<Origin, Failure> {
    let arguments = std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned());
    Ok(Origin { command: command(arguments), inputs: files.map(|f| digest(f)).collect::<Result<_, _>>()? })
}

/// A command that gives the same answer.
fn command(arguments: impl Iterator<Item = String>) -> String {
    let mut out = String::from("obsdeg");
    let mut arguments = arguments;
    while let Some(a) = arguments.next() {
        match a.as_str() {
            "-o" | "--output" => drop(arguments.next()),
            "-q" | "--quiet" | "--force" => {}
            a if a.starts_with("--output=") || a.starts_with("-o") => {}
            a => {
                out.push(' ');
                out.push_str(&quoted(a));
            }
        }
    }
    out
}

/// As a shell takes it for one argument.
fn quoted(a: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./=,:@%+".contains(c);
    if !a.is_empty() && a.chars().all(plain) { a.into() } else { format!("'{}'", a.replace('\'', "'\\''")) }
}

/// `sha256 of scheme.toml: ...`; a pipe was read, and is empty now.
fn digest(path: &Path) -> Result<String, Failure> {
    let name = path.display();
    if !path.is_file() {
        return Ok(format!("{name}: from a pipe, without a digest"));
    }
    let bytes = std::fs::read(path).map_err(|e| Failure::input(format!("cannot read {name}: {e}")))?;
    let hex: String = Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
    Ok(format!("sha256 of {name}: {hex}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_without_where_its_answer_goes() {
        let of = |text: &[&str]| command(text.iter().map(|a| (*a).to_string()));
        let asked =
            ["report", "a b.toml", "-o", "x.html", "--force", "--requirement", "D=0.05", "-q", "--output=y"];
        assert_eq!(of(&asked), "obsdeg report 'a b.toml' --requirement D=0.05");
        assert_eq!(of(&["report", "it's", ""]), "obsdeg report 'it'\\''s' ''");
    }
}
