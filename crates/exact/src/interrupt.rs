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
    Callback { goes_on: Box<dyn FnMut() -> bool>, interval: Duration, last: Instant, clock: CheckClock },
    /// Flag that another thread sets.
    Flag(Arc<AtomicBool>),
}

/// Clock that is read at every check, or at one of sixteen where checks follow each other closely: there may
/// be thousands in a millisecond.
struct CheckClock {
    read: Instant,
    /// Time of sixteen checks that follow each other closely.
    close: Duration,
}

/// Largest number of checks without a reading of the clock.
const SKIPPED: u32 = 15;

impl CheckClock {
    /// Time now; the next checks are skipped if this one follows those before closely.
    fn now(&mut self) -> Instant {
        let now = Instant::now();
        SKIP.set(if now - self.read < self.close { SKIPPED } else { 0 });
        self.read = now;
        now
    }
}

/// Payload of the unwinding.
struct Interrupted;

thread_local! {
    static CANCELLATION: Cell<Option<Cancellation>> = const { Cell::new(None) };
    /// Number of checks that do nothing.
    static SKIP: Cell<u32> = const { Cell::new(0) };
}

/// Runs `work` and calls `goes_on` on this thread whenever `interval` has passed, at the next
/// [`check`]. Returns `None` if it returned false; panics of the work propagate.
pub fn hearing<T>(
    interval: Duration,
    goes_on: impl FnMut() -> bool + 'static,
    work: impl FnOnce() -> T,
) -> Option<T> {
    let last = Instant::now();
    let clock = CheckClock { read: last, close: interval / 100 };
    run(Cancellation::Callback { goes_on: Box::new(goes_on), interval, last, clock }, work)
}

/// Runs `work` until `wanted` is false, then returns `None`. [`crate::parallel`] carries this to other
/// threads.
pub fn while_wanted<T>(wanted: Arc<AtomicBool>, work: impl FnOnce() -> T) -> Option<T> {
    run(Cancellation::Flag(wanted), work)
}

fn run<T>(own: Cancellation, work: impl FnOnce() -> T) -> Option<T> {
    let before = CANCELLATION.replace(Some(own));
    SKIP.set(0);
    let done = catch_unwind(AssertUnwindSafe(work));
    CANCELLATION.set(before);
    SKIP.set(0);
    match done {
        Ok(done) => Some(done),
        Err(reason) if reason.is::<Interrupted>() => None,
        Err(panic) => resume_unwind(panic),
    }
}

/// Called by long loops, at least every tenth of a second. Does not return if the work must end.
pub fn check() {
    let skip = SKIP.get();
    if skip > 0 {
        SKIP.set(skip - 1);
        return;
    }
    // the callback may run other work on this thread
    let Some(mut hearing) = CANCELLATION.take() else { return };
    let goes_on = match &mut hearing {
        Cancellation::Flag(wanted) => wanted.load(Ordering::Relaxed),
        Cancellation::Callback { goes_on, interval, last, clock } => {
            let due = clock.now() - *last >= *interval;
            let goes_on = !due || goes_on();
            if due {
                *last = Instant::now();
            }
            goes_on
        }
    };
    CANCELLATION.set(Some(hearing));
    if !goes_on {
        resume_unwind(Box::new(Interrupted));
    }
}

/// Handle with which the parts of this thread's work on other threads end with it.
#[derive(Debug, Clone)]
pub(crate) struct InterruptHandle(Option<Arc<AtomicBool>>);

/// True if a callback of this thread is asked whether its work goes on: then parts on other threads would
/// not hear the answer.
pub(crate) fn asks() -> bool {
    let hearing = CANCELLATION.take();
    let asks = matches!(hearing, Some(Cancellation::Callback { .. }));
    CANCELLATION.set(hearing);
    asks
}

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
    fn work_ends_where_it_is_interrupted() {
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

    /// One of sixteen checks that follow each other closely reads the clock; otherwise each check does.
    #[test]
    fn the_clock_is_read_as_often_as_needed() {
        for (interval, least, most) in [(6000, 10, 10), (0, 160, 160)] {
            let (asked, last) = (Rc::new(Cell::new(0)), Instant::now());
            let clock = CheckClock { read: last, close: Duration::from_secs(interval) / 100 };
            let count = asked.clone();
            let goes_on = move || {
                count.set(count.get() + 1);
                true
            };
            // every reading of the clock asks
            let own =
                Cancellation::Callback { goes_on: Box::new(goes_on), interval: Duration::ZERO, last, clock };
            assert_eq!(run(own, || (0..160).for_each(|_| check())), Some(()));
            assert!((least..=most).contains(&asked.get()), "{interval}: {}", asked.get());
        }
        assert_eq!(SKIP.get(), 0);
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
