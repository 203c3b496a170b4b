//! Terminals and pipes: width, colours, and the character sets of stdout and stderr.

use std::io::IsTerminal;

use obsdeg_report::TerminalLayout;

/// Layout of a table that does not go to a terminal: 120 columns, no colours.
pub(crate) const PIPE: TerminalLayout =
    TerminalLayout { width: Some(120), color: false, ascii: false, brief: false };

/// Width, colours and character set of a table on stdout.
pub(crate) fn layout(ascii: bool) -> TerminalLayout {
    let stdout = std::io::stdout();
    let terminal = stdout.is_terminal();
    let ascii = ascii || plain(terminal, variable);
    if !terminal {
        return TerminalLayout { ascii, ..PIPE };
    }
    TerminalLayout {
        width: terminal_size::terminal_size().map(|(w, _)| w.0),
        color: anstream::AutoStream::choice(&stdout) != anstream::ColorChoice::Never,
        ascii,
        brief: false,
    }
}

/// Value of an environment variable; `None` if it is unset or empty.
fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|v| !v.is_empty())
}

/// True if a stream takes ASCII only. Without a locale variable the locale is C, whose characters are ASCII.
/// That is assumed of a terminal only: pipes are read as UTF-8, as files are, and Windows has no such
/// variables.
fn plain(terminal: bool, variable: impl Fn(&str) -> Option<String>) -> bool {
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find_map(&variable);
    let utf8 = locale.map(|l| ["utf-8", "utf8"].iter().any(|u| l.to_lowercase().contains(u)));
    !utf8.unwrap_or(!terminal || cfg!(windows)) || terminal && variable("TERM").is_some_and(|t| t == "dumb")
}

/// True if messages are ASCII: by `--ascii` (even on a command line that is otherwise wrong), or by the
/// character set of stderr.
pub(crate) fn plain_messages() -> bool {
    std::env::args_os().any(|a| a == "--ascii") || plain(std::io::stderr().is_terminal(), variable)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ascii_follows_the_locale_and_the_terminal() {
        let of = |terminal: bool, set: &[(&str, &str)]| {
            plain(terminal, |name| set.iter().find(|(n, _)| *n == name).map(|(_, v)| (*v).to_string()))
        };
        assert_eq!(of(true, &[]), !cfg!(windows));
        assert!(!of(false, &[]));
        for terminal in [true, false] {
            assert!(of(terminal, &[("LANG", "C")]) && of(terminal, &[("LC_CTYPE", "de_DE.ISO-8859-1")]));
            assert!(!of(terminal, &[("LANG", "C.UTF-8")]) && !of(terminal, &[("LANG", "en_US.utf8")]));
            // the first variable that is set decides
            assert!(of(terminal, &[("LC_ALL", "POSIX"), ("LANG", "C.UTF-8")]));
            assert!(!of(terminal, &[("LC_CTYPE", "C.UTF-8"), ("LANG", "C")]));
        }
        let dumb = [("TERM", "dumb"), ("LANG", "C.UTF-8")];
        assert!(of(true, &dumb) && !of(false, &dumb));
    }
}
