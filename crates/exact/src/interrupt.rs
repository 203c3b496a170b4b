//! Interruption of long computations.
//!
//! Long loops call [`check`]; the caller provides a callback with [`hearing`] that ends them. An
//! interruption unwinds the stack up to there, so no intermediate result has to carry it. Without
//! [`hearing`] no callback is called and no clock is read. Answers do not depend on interruption: there
//! is either the whole answer or none.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Source of the decision to continue, for the work of one thread.
enum Cancellation {
    /// Callback of this thread, called when the interval has passed.
    Callback { goes_on: Box<dyn FnMut() -> bool>, interval: Duration, last: Instant, clock: Clock },
    /// Flag that another thread sets.
    Flag(Arc<AtomicBool>),
}

/// Clock that is read at every check, or at one of [`SKIPPED`] where checks follow each other closely: their
/// number may be thousands in a millisecond.
struct Clock {
    read: Instant,
    /// Time of [`SKIPPED`] checks that follow each other closely.
    close: Duration,
    /// Number of checks until the next reading.
    left: u32,
}

/// Largest number of checks without a reading of the clock.
const SKIPPED: u32 = 15;

impl Clock {
    /// Time now, if it is read at this check.
    fn now(&mut self) -> Option<Instant> {
        if self.left > 0 {
            self.left -= 1;
            return None;
        }
        let now = Instant::now();
        self.left = if now - self.read < self.close { SKIPPED } else { 0 };
        self.read = now;
        Some(now)
    }
}

/// Payload of the unwinding.
struct Interrupted;

thread_local! {
    static CANCELLATION: Cell<Option<Cancellation>> = const { Cell::new(None) };
}

/// Runs `work` and calls `goes_on` on this thread whenever `interval` has passed, at the next
/// [`check`]. Returns `None` if it returned false; panics of the work propagate.
pub fn hearing<T>(
    interval: Duration,
    goes_on: impl FnMut() -> bool + 'static,
    work: impl FnOnce() -> T,
) -> Option<T> {
    let last = Instant::now();
    let clock = Clock { read: last, close: interval / 100, left: 0 };
    run(Cancellation::Callback { goes_on: Box::new(goes_on), interval, last, clock }, work)
}

/// Runs `work` until `wanted` is false, then returns `None`. [`crate::parallel`] carries this to other
/// threads.
pub fn while_wanted<T>(wanted: Arc<AtomicBool>, work: impl FnOnce() -> T) -> Option<T> {
    run(Cancellation::Flag(wanted), work)
}

fn run<T>(own: Cancellation, work: impl FnOnce() -> T) -> Option<T> {
    let before = CANCELLATION.replace(Some(own));
    let done = catch_unwind(AssertUnwindSafe(work));
    CANCELLATION.set(before);
    match done {
        Ok(done) => Some(done),
        Err(reason) if reason.is::<Interrupted>() => None,
        Err(panic) => resume_unwind(panic),
    }
}

/// Called by long loops, at least every tenth of a second. Does not return if the work must end.
pub fn check() {
    // the callback may run other work on this thread
    let Some(mut hearing) = CANCELLATION.take() else { return };
    let goes_on = match &mut hearing {
        Cancellation::Flag(wanted) => wanted.load(Ordering::Relaxed),
        Cancellation::Callback { goes_on, interval, last, clock } => match clock.now() {
            Some(now) if now - *last >= *interval => {
                let goes_on = goes_on();
                *last = Instant::now();
                goes_on
            }
            _ => true,
        },
    };
    CANCELLATION.set(Some(hearing));
    if !goes_on {
        resume_unwind(Box::new(Interrupted));
    }
}

/// Handle with which the parts of this thread's work on other threads end with it.
#[derive(Debug, Clone)]
pub(crate) struct InterruptHandle(Option<Arc<AtomicBool>>);

/// Handle for the parts of the work of this thread.
pub(crate) fn parts() -> InterruptHandle {
    let hearing = CANCELLATION.take();
    let wanted = match &hearing {
        Some(Cancellation::Flag(wanted)) => Some(wanted.clone()),
        _ => None,
    };
    CANCELLATION.set(hearing);
    InterruptHandle(wanted)
}

impl InterruptHandle {
    /// Runs a part on the calling thread. It ends with the whole.
    pub(crate) fn part<T>(&self, work: impl FnOnce() -> T) -> T {
        match &self.0 {
            None => work(),
            Some(wanted) => match while_wanted(wanted.clone(), work) {
                Some(done) => done,
                None => resume_unwind(Box::new(Interrupted)),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use std::rc::Rc;

    use super::*;

    fn count(to: u32, at: &Rc<Cell<u32>>) -> u32 {
        for i in 0..to {
            check();
            at.set(i);
        }
        at.get()
    }

    #[test]
    fn work_ends_where_it_is_told_to() {
        let at = Rc::new(Cell::new(0));
        let before = at.clone();
        let ended = hearing(Duration::ZERO, move || before.get() < 5, || count(100, &at));
        assert_eq!((ended, at.get()), (None, 5));
        // nothing remains after the interruption
        assert_eq!(count(100, &at), 99);
    }

    #[test]
    fn what_is_asked_may_work_itself() {
        let inner = move || hearing(Duration::ZERO, || false, || count(9, &Rc::default())).is_none();
        assert_eq!(hearing(Duration::ZERO, inner, || count(50, &Rc::default())), Some(49));
    }

    /// Where checks follow each other closely, one of sixteen reads the clock; where they do not, each does.
    #[test]
    fn the_clock_is_read_as_often_as_needed() {
        let mut clock = Clock { read: Instant::now(), close: Duration::from_secs(60), left: 0 };
        let readings = |clock: &mut Clock| (0..160).filter(|_| clock.now().is_some()).count();
        assert_eq!(readings(&mut clock), 10);
        clock.close = Duration::ZERO;
        assert_eq!(readings(&mut clock), 160);
    }

    #[test]
    fn parts_end_with_the_whole_on_their_own_threads() {
        let wanted = Arc::new(AtomicBool::new(true));
        let ended = while_wanted(wanted.clone(), || {
            let parts = parts();
            std::thread::scope(|scope| {
                let part = scope.spawn(|| {
                    parts.part(|| {
                        loop {
                            check()
                        }
                    })
                });
                wanted.store(false, Ordering::Relaxed);
                part.join().is_err()
            })
        });
        assert_eq!(ended, Some(true));
        assert_eq!(super::parts().part(|| count(9, &Rc::default())), 8);
    }

    #[test]
    fn panics_stay_panics() {
        let panic = catch_unwind(|| hearing(Duration::ZERO, || true, || resume_unwind(Box::new("other"))));
        assert!(panic.is_err_and(|reason| reason.is::<&str>()));
    }
}
