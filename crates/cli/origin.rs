//! Command line that a report names as its origin.

/// Command line of this process without the options for the place of the answer.
pub(crate) fn command() -> String {
    without_target(std::env::args_os().skip(1).map(|a| a.to_string_lossy().into_owned()))
}

/// Command line that gives the same answer: `arguments` without the options for its place.
fn without_target(arguments: impl Iterator<Item = String>) -> String {
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

/// Argument quoted so that a shell reads it as one.
fn quoted(a: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./=,:@%+".contains(c);
    if !a.is_empty() && a.chars().all(plain) { a.into() } else { format!("'{}'", a.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_without_where_its_answer_goes() {
        let of = |text: &[&str]| without_target(text.iter().map(|a| (*a).to_string()));
        let asked =
            ["report", "a b.toml", "-o", "x.html", "--force", "--requirement", "D=0.05", "-q", "--output=y"];
        assert_eq!(of(&asked), "obsdeg report 'a b.toml' --requirement D=0.05");
        assert_eq!(of(&["report", "it's", ""]), "obsdeg report 'it'\\''s' ''");
    }
}
