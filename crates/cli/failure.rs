//! Failures: what is said on stderr, and the exit code.

use std::process::ExitCode;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use obsdeg_commands::{Kind, Place, Problem};
use obsdeg_report::{ReportError, in_ascii, visible};

use crate::output::plain_messages;

/// A check failed.
const CHECK: u8 = 1;
/// Bad input.
pub(crate) const INPUT: u8 = 2;
/// A defect of the program.
pub(crate) const INTERNAL: u8 = 3;
/// The user did not want to wait: the code that a shell gives a program ended by Ctrl-C.
pub(crate) const INTERRUPTED: u8 = 130;

/// Says something of several lines on stderr. Names, paths and keys come from whoever wrote the input: nothing in them reaches a
/// terminal but text.
pub(crate) fn say(message: &str) {
    let plain = plain_messages();
    for line in message.lines() {
        let line = visible(line);
        eprintln!("{}", if plain { in_ascii(&line).into() } else { line });
    }
}

/// Why a command stopped.
#[derive(Debug)]
pub(crate) struct Failure {
    message: String,
    code: u8,
}

impl Failure {
    /// The input is wrong.
    pub(crate) fn input(message: String) -> Self {
        Self { message: format!("error: {message}"), code: INPUT }
    }

    /// A check failed: what was printed says which.
    pub(crate) fn check() -> Self {
        Self { message: String::new(), code: CHECK }
    }

    /// Interrupted with something written that another run goes on with.
    pub(crate) fn unfinished(message: String) -> Self {
        Self { message, code: INTERRUPTED }
    }

    /// The program is wrong.
    pub(crate) fn internal(message: String) -> Self {
        Self { message: format!("internal error: {message}"), code: INTERNAL }
    }

    /// The input is wrong at a place of a text, which is drawn.
    fn at(message: &str, place: &Place) -> Self {
        let annotation = AnnotationKind::Primary.span(place.span.clone());
        let snippet = Snippet::source(&place.text).path(&place.name).annotation(annotation);
        let report = [Level::ERROR.primary_title(message).element(snippet)];
        Self { message: Renderer::plain().render(&report).to_string(), code: INPUT }
    }

    pub(crate) fn report(&self) -> ExitCode {
        say(&self.message);
        ExitCode::from(self.code)
    }
}

impl From<Problem> for Failure {
    fn from(e: Problem) -> Self {
        match (e.kind, e.place) {
            (_, Some(place)) => Self::at(&e.message, &place),
            (Kind::Input, None) => Self::input(e.message),
            (Kind::Internal, None) => Self::internal(e.message),
            (Kind::Interrupted, None) => Self::unfinished(e.message),
        }
    }
}

impl From<ReportError> for Failure {
    fn from(e: ReportError) -> Self {
        Problem::from(e).into()
    }
}
