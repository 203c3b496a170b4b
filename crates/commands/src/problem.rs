//! Reason for a missing answer: kind, message and place.

use std::ops::Range;

use obsdeg_calibration::CalibrationError;
use obsdeg_core::analysis::AnalysisError;
use obsdeg_core::certificate::CertificateError;
use obsdeg_core::solution::CombinationError;
use obsdeg_design::design::DesignError;
use obsdeg_evidence::prediction::PredictionError;
use obsdeg_evidence::simulation::SimulationError;
use obsdeg_report::ReportError;
use serde::Serialize;

/// Origin of a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ProblemKind {
    /// Bad input.
    Input,
    /// Defect of the program.
    Internal,
    /// Interruption by the caller.
    Interrupted,
}

/// Place in a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextPlace {
    /// Name of the text.
    pub name: String,
    /// The complete text.
    pub text: String,
    /// Range of bytes that the message is about.
    pub span: Range<usize>,
}

impl TextPlace {
    /// Place whose range is clipped to the text.
    fn new(name: &str, text: &str, span: Range<usize>) -> Self {
        let end = span.end.min(text.len());
        Self { name: name.into(), text: text.into(), span: span.start.min(end)..end }
    }

    /// Line and column of the beginning of the range, counted from 1; columns are characters.
    pub fn line_and_column(&self) -> (usize, usize) {
        let before = self.text.get(..self.span.start).unwrap_or_default();
        let line = before.rsplit('\n').next().unwrap_or_default();
        (before.matches('\n').count() + 1, line.chars().count() + 1)
    }
}

/// Reason for a missing answer. Options are written in it as on the command line, `--slew-rate`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Problem {
    /// Origin of the problem.
    pub kind: ProblemKind,
    /// Message: place, expected, found.
    pub message: String,
    /// Place of the problem; `None` if it is not in a text.
    pub place: Option<TextPlace>,
}

impl Problem {
    /// Bad input.
    pub fn input(message: impl Into<String>) -> Self {
        Self { kind: ProblemKind::Input, message: message.into(), place: None }
    }

    /// Defect of the program.
    pub fn internal(message: impl Into<String>) -> Self {
        Self { kind: ProblemKind::Internal, message: message.into(), place: None }
    }

    /// Interruption by the caller, without a partial result.
    pub fn interrupted() -> Self {
        Self {
            kind: ProblemKind::Interrupted,
            message: "interrupted; nothing was written".into(),
            place: None,
        }
    }

    /// Bad input at a place of a text.
    pub fn at(message: impl Into<String>, name: &str, text: &str, span: Range<usize>) -> Self {
        Self { place: Some(TextPlace::new(name, text, span)), ..Self::input(message) }
    }

    /// The problem with the name of its scheme before the message.
    #[must_use]
    pub(crate) fn in_file(mut self, name: &str) -> Self {
        self.message = format!("{} (in {name})", self.message);
        self
    }
}

/// Bad input: a scheme or model that certificates do not cover, or that is defective.
impl From<CertificateError> for Problem {
    fn from(e: CertificateError) -> Self {
        match e {
            CertificateError::Analysis(e) => e.into(),
            CertificateError::Model(_) | CertificateError::NotCovered { .. } => Self::input(e.to_string()),
        }
    }
}

/// Bad input, or a defect of the program.
impl From<AnalysisError> for Problem {
    fn from(e: AnalysisError) -> Self {
        match e {
            AnalysisError::Combination(CombinationError { text, reason, span }) => {
                Self::at(format!("combination: {reason}"), "--combination", &text, span)
            }
            AnalysisError::Scheme(e) => Self::input(e.to_string()),
            AnalysisError::Verdict(e) => Self::internal(e.to_string()),
        }
    }
}

impl From<SimulationError> for Problem {
    fn from(e: SimulationError) -> Self {
        match e {
            SimulationError::Prediction(PredictionError::Analysis(e)) => e.into(),
            // accuracy orders above the largest that the series determine
            SimulationError::Prediction(PredictionError::Accuracy(_)) => Self::input(e.to_string()),
            SimulationError::Filter(e) if e.is_numeric() => Self::input(format!(
                "these numbers cannot be resolved in double precision ({e}); expected priors, noise, steps \
                 and rates that are closer together"
            )),
            SimulationError::Filter(_) => Self::internal(e.to_string()),
            _ => Self::input(e.to_string()),
        }
    }
}

impl From<CalibrationError> for Problem {
    fn from(e: CalibrationError) -> Self {
        match e {
            CalibrationError::Simulation(e) => e.into(),
            CalibrationError::Interrupted => {
                Self { kind: ProblemKind::Interrupted, ..Self::input(e.to_string()) }
            }
            _ => Self::input(e.to_string()),
        }
    }
}

impl From<DesignError> for Problem {
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

impl From<ReportError> for Problem {
    fn from(e: ReportError) -> Self {
        match e {
            ReportError::NoPdf | ReportError::NoTable { .. } => Self::input(e.to_string()),
            e => Self::internal(e.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_are_counted_in_characters_from_one() {
        let text = "a = 1\nψ = \"x\"\n";
        let at = |span| Problem::at("wrong", "file", text, span).place.map(|p| p.line_and_column());
        assert_eq!(at(0..1), Some((1, 1)));
        assert_eq!(at(text.find('"').unwrap_or(0)..text.len()), Some((2, 5)));
        // a range beyond the end of the text
        assert_eq!(at(1000..2000), Some((3, 1)));
    }
}
