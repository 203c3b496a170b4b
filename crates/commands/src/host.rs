//! Caller of a command: the resources that an answer may use, and the receiver of its progress.

use obsdeg_calibration::CalibrationProgress;
use obsdeg_design::design::Progress;
use obsdeg_symbolic::Worker;
use serde::Serialize;

/// Progress of an answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Now {
    /// Name of the current work.
    pub what: String,
    /// Amount of work done, in the unit that `what` names.
    pub done: u64,
    /// Total amount of work; `None` if it is unknown.
    pub total: Option<u64>,
    /// Number of sequences evaluated; `None` outside searches.
    pub examined: Option<u64>,
    /// Best criterion so far; `None` outside searches and before a value is found.
    pub best: Option<f64>,
}

impl Now {
    /// Progress of work of a known amount.
    pub(crate) fn of(what: impl Into<String>, done: u64, total: u64) -> Self {
        Self { what: what.into(), done, total: Some(total), examined: None, best: None }
    }

    /// Progress of work of an unknown amount.
    pub(crate) fn open(what: impl Into<String>, done: u64) -> Self {
        Self { what: what.into(), done, total: None, examined: None, best: None }
    }
}

impl From<Progress> for Now {
    fn from(p: Progress) -> Self {
        let best = Some(p.best).filter(|b| b.is_finite());
        Self { examined: Some(p.examined), best, ..Self::of("searching", p.done, p.total) }
    }
}

impl From<CalibrationProgress<'_>> for Now {
    fn from(progress: CalibrationProgress<'_>) -> Self {
        let (what, done) = match progress {
            CalibrationProgress::Reads { record, samples } => (format!("reading {record}"), samples),
            CalibrationProgress::Passes(passes) => ("calibrating, linearisations".into(), passes),
        };
        Self::open(what, done as u64)
    }
}

/// Resources that an answer may use, and the receiver of its progress.
pub struct Host<'a> {
    /// Symbolic engine; `None` if there is none.
    pub worker: Option<&'a mut Worker>,
    /// Receiver of the progress; it returns false to end the work.
    pub progress: &'a (dyn Fn(Now) -> bool + Sync),
}

impl Host<'_> {
    /// Host without a symbolic engine that ignores progress.
    pub fn silent() -> Self {
        Self { worker: None, progress: &|_| true }
    }
}
