//! Who asks: what an answer may use, and who hears how far it is.

use obsdeg_calibration::Going;
use obsdeg_design::design::Progress;
use obsdeg_symbolic::Worker;
use serde::Serialize;

/// How far an answer is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Now {
    /// What is being done.
    pub what: String,
    /// So much of it is done.
    pub done: u64,
    /// How much there is; none where nobody knows.
    pub total: Option<u64>,
    /// Of a search: sequences that were evaluated.
    pub examined: Option<u64>,
    /// Of a search: the best criterion so far.
    pub best: Option<f64>,
}

impl Now {
    /// Some of a known amount.
    pub(crate) fn of(what: impl Into<String>, done: u64, total: u64) -> Self {
        Self { what: what.into(), done, total: Some(total), examined: None, best: None }
    }

    /// Some of an amount that nobody knows.
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

impl From<Going<'_>> for Now {
    fn from(going: Going<'_>) -> Self {
        let (what, done) = match going {
            Going::Reads { record, samples } => (format!("reading {record}"), samples),
            Going::Passes(passes) => ("calibrating, linearisations".into(), passes),
        };
        Self::open(what, done as u64)
    }
}

/// What an answer may use, and who hears how far it is.
pub struct Host<'a> {
    /// The symbolic engine, where there is one.
    pub worker: Option<&'a mut Worker>,
    /// Told how far the work is; work that is told `false` ends.
    pub going: &'a (dyn Fn(Now) -> bool + Sync),
}

impl Host<'_> {
    /// Without a symbolic engine, and nobody who listens.
    pub fn silent() -> Self {
        Self { worker: None, going: &|_| true }
    }
}
