//! Failures: what is said on stderr, and the exit code.

use std::ops::Range;
use std::process::ExitCode;

use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use obsdeg_calibration::CalibrationError;
use obsdeg_core::analysis::AnalysisError;
use obsdeg_core::solution::CombinationError;
use obsdeg_design::design::DesignError;
use obsdeg_evidence::prediction::PredictionError;
use obsdeg_evidence::simulation::SimulationError;
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

    /// Interrupted before there was anything to show.
    pub(crate) fn interrupted() -> Self {
        Self { message: "interrupted; nothing was written".into(), code: INTERRUPTED }
    }

    /// Interrupted with something written that another run goes on with.
    pub(crate) fn unfinished(message: String) -> Self {
        Self { message, code: INTERRUPTED }
    }

    /// The program is wrong.
    pub(crate) fn internal(message: String) -> Self {
        Self { message: format!("internal error: {message}"), code: INTERNAL }
    }

    /// The same failure, with the scheme it came from.
    pub(crate) fn in_file(mut self, name: &str) -> Self {
        self.message = format!("{} (in {name})", self.message);
        self
    }

    /// The input is wrong at a place of a text, which is drawn.
    pub(crate) fn at(message: &str, name: &str, text: &str, span: Range<usize>) -> Self {
        let end = span.end.min(text.len());
        let span = span.start.min(end)..end;
        let snippet = Snippet::source(text).path(name).annotation(AnnotationKind::Primary.span(span));
        let report = [Level::ERROR.primary_title(message).element(snippet)];
        Self { message: Renderer::plain().render(&report).to_string(), code: INPUT }
    }

    pub(crate) fn report(&self) -> ExitCode {
        say(&self.message);
        ExitCode::from(self.code)
    }
}

/// What is wrong with the input, or with the program.
impl From<AnalysisError> for Failure {
    fn from(e: AnalysisError) -> Self {
        match e {
            AnalysisError::Combination(CombinationError { text, reason, span }) => {
                Self::at(&format!("combination: {reason}"), "--combination", &text, span)
            }
            AnalysisError::Scheme(e) => Self::input(e.to_string()),
            AnalysisError::Verdict(e) => Self::internal(e.to_string()),
        }
    }
}

impl From<SimulationError> for Failure {
    fn from(e: SimulationError) -> Self {
        match e {
            SimulationError::Prediction(PredictionError::Analysis(e)) => e.into(),
            // accuracy orders beyond the series
            SimulationError::Prediction(PredictionError::Accuracy(_)) => Self::input(e.to_string()),
            SimulationError::Filter(e) if e.is_numeric() => Self::input(format!(
                "these numbers cannot be resolved in double precision ({e}); expected priors, noise, steps and rates that are closer together"
            )),
            SimulationError::Filter(_) => Self::internal(e.to_string()),
            _ => Self::input(e.to_string()),
        }
    }
}

impl From<CalibrationError> for Failure {
    fn from(e: CalibrationError) -> Self {
        match e {
            CalibrationError::Simulation(e) => e.into(),
            CalibrationError::Interrupted => Self::unfinished(e.to_string()),
            _ => Self::input(e.to_string()),
        }
    }
}

impl From<DesignError> for Failure {
    fn from(e: DesignError) -> Self {
        match e {
            DesignError::Verdict(_) => Self::internal(e.to_string()),
            DesignError::Filter(e) => SimulationError::from(e).into(),
            DesignError::Conditions(e) => e.into(),
            DesignError::Interrupted => Self::interrupted(),
            _ => Self::input(e.to_string()),
        }
    }
}

impl From<ReportError> for Failure {
    fn from(e: ReportError) -> Self {
        match e {
            ReportError::NoPdf | ReportError::NoTable { .. } => Self::input(e.to_string()),
            e => Self::internal(e.to_string()),
        }
    }
}
