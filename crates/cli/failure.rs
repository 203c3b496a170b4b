//! Failures: messages on stderr and exit codes.

use std::process::ExitCode;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use clap::builder::styling::AnsiColor;
use obsdeg_commands::{Problem, ProblemKind, TextPlace};
use obsdeg_report::{ReportError, in_ascii, visible};

use crate::terminal::plain_messages;

/// Exit code of a failed check.
const CHECK: u8 = 1;
/// Exit code of bad input.
pub(crate) const INPUT: u8 = 2;
/// Exit code of a defect of the program.
pub(crate) const INTERNAL: u8 = 3;
/// Exit code of an interrupted command: the code that a shell gives a program ended by Ctrl-C.
pub(crate) const INTERRUPTED: u8 = 130;

/// Prints a message of one or more lines on stderr. Names, paths and keys in it come from the input, so
/// control characters are written out: a terminal shows them and does not obey them.
pub(crate) fn say(message: &str) {
    say_as(message, |line| line.into());
}

/// Prints every line of `message` on stderr, without control characters and passed through `made`.
fn say_as(message: &str, made: impl Fn(&str) -> String) {
    let plain = plain_messages();
    for line in message.lines() {
        let line = visible(line);
        eprintln!("{}", made(&if plain { in_ascii(&line).into() } else { line }));
    }
}

/// A line in the colours of clap's errors. `drawn`: true if the line may belong to a drawn excerpt of a text,
/// with a margin and marks below the place that is meant.
fn colored(line: &str, drawn: bool) -> String {
    let error = AnsiColor::Red.on_default().bold();
    let margin = AnsiColor::BrightBlue.on_default().bold();
    for title in ["error:", "internal error:"] {
        if let Some(rest) = line.strip_prefix(title) {
            return format!("{error}{title}{error:#}{rest}");
        }
    }
    let behind = line.trim_start().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start();
    let end = match () {
        () if !drawn => 0,
        () if behind.starts_with("-->") => line.len() - behind.len() + "-->".len(),
        () if behind.starts_with('|') => line.len() - behind.len() + 1,
        () => 0,
    };
    let (before, text) = line.split_at(end);
    let marks = end > 0 && text.contains('^') && text.chars().all(|c| c == ' ' || c == '^');
    let text = if marks { format!("{error}{text}{error:#}") } else { text.into() };
    if end > 0 { format!("{margin}{before}{margin:#}{text}") } else { text }
}

/// Error message and exit code with which a command stops.
#[derive(Debug)]
pub(crate) struct Failure {
    message: String,
    /// True if the lines after the first draw an excerpt of a text.
    drawn: bool,
    code: u8,
}

impl Failure {
    /// Bad input.
    pub(crate) fn input(message: String) -> Self {
        Self { message: format!("error: {message}"), drawn: false, code: INPUT }
    }

    /// A failed check, without a message of its own: the printed answer names the check.
    pub(crate) fn check() -> Self {
        Self { message: String::new(), drawn: false, code: CHECK }
    }

    /// Interrupted after a partial result was written, from which another run continues.
    pub(crate) fn unfinished(message: String) -> Self {
        Self { message, drawn: false, code: INTERRUPTED }
    }

    /// A defect of the program.
    pub(crate) fn internal(message: String) -> Self {
        Self { message: format!("internal error: {message}"), drawn: false, code: INTERNAL }
    }

    /// Bad input at a place of a text; the message draws the place.
    fn at(message: &str, place: &TextPlace) -> Self {
        let annotation = AnnotationKind::Primary.span(place.span.clone());
        let snippet = Snippet::source(&place.text).path(&place.name).annotation(annotation);
        let report = [Level::ERROR.primary_title(message).element(snippet)];
        Self { message: Renderer::plain().render(&report).to_string(), drawn: true, code: INPUT }
    }

    pub(crate) fn report(&self) -> ExitCode {
        let in_color = anstream::AutoStream::choice(&std::io::stderr()) != anstream::ColorChoice::Never;
        let drawn = self.drawn;
        say_as(&self.message, |line| if in_color { colored(line, drawn) } else { line.into() });
        ExitCode::from(self.code)
    }
}

impl From<Problem> for Failure {
    fn from(e: Problem) -> Self {
        match (e.kind, e.place) {
            (_, Some(place)) => Self::at(&e.message, &place),
            (ProblemKind::Input, None) => Self::input(e.message),
            (ProblemKind::Internal, None) => Self::internal(e.message),
            (ProblemKind::Interrupted, None) => Self::unfinished(e.message),
        }
    }
}

impl From<ReportError> for Failure {
    fn from(e: ReportError) -> Self {
        Problem::from(e).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Colours add only escape sequences, at the places where clap has them: title, margin, marks.
    #[test]
    fn messages_are_coloured() {
        let place = TextPlace { name: "a.toml".into(), text: "carry = \"x | ^\"\n".into(), span: 8..15 };
        let failure = Failure::at("expected a carry", &place);
        let plain = |text: &str| anstream::adapter::strip_str(text).to_string();
        let lines: Vec<String> = failure.message.lines().map(|line| colored(line, true)).collect();
        for (line, colored) in failure.message.lines().zip(&lines) {
            assert_eq!(plain(colored), line);
        }
        assert_eq!(lines[0], "\u{1b}[1m\u{1b}[31merror:\u{1b}[0m expected a carry");
        assert!(
            lines[1].starts_with("\u{1b}[1m\u{1b}[94m ") && lines[1].contains("-->\u{1b}[0m a.toml:1:9"),
            "{lines:?}"
        );
        assert!(lines[3].ends_with("|\u{1b}[0m carry = \"x | ^\""), "{lines:?}");
        assert!(lines[4].contains("\u{1b}[31m         ^^^^^^^"), "{lines:?}");
        assert_eq!(colored("1 | of a list --> there", false), "1 | of a list --> there");
    }
}
