//! Progress of a search: reports of its workers, and interruption.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::design::search::best::Best;
use crate::design::search::score::Scored;

/// Number of sequences between two calls of the progress callback.
pub(crate) const PATIENCE: u64 = 256;

/// Progress of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Number of parts done.
    pub done: u64,
    /// Number of all parts.
    pub total: u64,
    /// Number of sequences whose sigma was computed.
    pub examined: u64,
    /// Best criterion so far; infinite if there is none.
    pub best: f64,
}

/// Progress before any work.
pub(crate) const NOTHING_YET: Progress = Progress { done: 0, total: 1, examined: 0, best: f64::INFINITY };

/// Runs work whose progress callback stays false once it was false; the work also receives the flag.
pub(crate) fn watched<T>(
    progress: &(dyn Fn(Progress) -> bool + Sync),
    work: impl FnOnce(&(dyn Fn(Progress) -> bool + Sync), &AtomicBool) -> T,
) -> T {
    let stopped = AtomicBool::new(false);
    let progress = |now: Progress| {
        if !stopped.load(Ordering::Relaxed) && !progress(now) {
            stopped.store(true, Ordering::Relaxed);
        }
        !stopped.load(Ordering::Relaxed)
    };
    work(&progress, &stopped)
}

/// Shared meter of the workers of a search.
pub(crate) struct Meter<'a> {
    progress: &'a (dyn Fn(Progress) -> bool + Sync),
    stopped: AtomicBool,
    done: AtomicU64,
    examined: AtomicU64,
    best: Mutex<f64>,
    total: u64,
}

impl<'a> Meter<'a> {
    pub(crate) fn new(progress: &'a (dyn Fn(Progress) -> bool + Sync), total: usize) -> Self {
        Self {
            progress,
            stopped: AtomicBool::new(false),
            done: AtomicU64::new(0),
            examined: AtomicU64::new(0),
            best: Mutex::new(f64::INFINITY),
            total: total as u64,
        }
    }

    /// Adds to the work done; false if the search must stop.
    pub(crate) fn report(&self, parts: u64, examined: u64, best: Option<&Scored>) -> bool {
        let value = best.map_or(f64::INFINITY, |b| b.score.value);
        // a poisoned lock follows from a panic that is reported already
        let best = self.best.lock().map_or(value, |mut b| {
            *b = b.min(value);
            *b
        });
        let now = Progress {
            done: self.done.fetch_add(parts, Ordering::Relaxed) + parts,
            total: self.total,
            examined: self.examined.fetch_add(examined, Ordering::Relaxed) + examined,
            best,
        };
        if !(self.progress)(now) && now.done < now.total {
            self.stopped.store(true, Ordering::Relaxed);
        }
        !self.stopped.load(Ordering::Relaxed)
    }

    /// Runs one part, unless the search was stopped.
    pub(crate) fn part(&self, work: impl FnOnce() -> Best) -> Best {
        if self.stopped.load(Ordering::Relaxed) {
            return Best::default();
        }
        let best = work();
        self.report(1, best.examined % PATIENCE, best.found.first());
        best
    }

    /// Merges the results of all parts, in their order.
    pub(crate) fn gather(&self, keep: usize, parts: Vec<Best>) -> Best {
        let mut out = Best { complete: true, ..Best::default() };
        for part in parts {
            out.merge(keep, part);
        }
        out.complete = !self.is_stopped();
        out
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }
}
