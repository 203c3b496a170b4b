//! Work on all threads of the pool: one compiled copy of the scheduler for every closure.
//!
//! Parallel iterators instantiate some five thousand lines for each chain of adaptors. Here closures are
//! called through a reference, once for each item, so items are worth at least some microseconds. Work on
//! other threads ends with the work of the calling thread ([`interrupt`]).

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

use crate::interrupt;

/// Calls `work` for every index below `count`, in any order, on all threads; on this one if a callback of it
/// is asked whether the work goes on.
fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    if interrupt::asks() {
        return (0..count).for_each(work);
    }
    let parts = interrupt::parts();
    (0..count).into_par_iter().with_max_len(1).for_each(|i| parts.part(|| work(i)));
}

/// Values for all indices below `count`, in the order of the indices.
///
/// ```
/// assert_eq!(obsdeg_exact::parallel::map(4, |i| i * i), [0, 1, 4, 9]);
/// ```
pub fn map<T: Send>(count: usize, value: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let slots: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    each(count, &|i| {
        let found = value(i);
        if let Ok(mut slot) = slots[i].lock() {
            *slot = Some(found);
        }
    });
    // a panic of any item has ended the call: every slot is filled
    slots.into_iter().filter_map(|slot| slot.into_inner().ok().flatten()).collect()
}

/// Values for all indices below `count`, or the error of the smallest index that has one.
///
/// # Errors
/// The error of `value`. Items that have not begun are skipped after an error at a smaller index.
pub fn try_map<T: Send, E: Send>(
    count: usize,
    value: impl Fn(usize) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let failed = AtomicUsize::new(usize::MAX);
    let found = map(count, |i| {
        if failed.load(Ordering::Relaxed) < i {
            return None;
        }
        let found = value(i);
        if found.is_err() {
            failed.fetch_min(i, Ordering::Relaxed);
        }
        Some(found)
    });
    // all items before the first error are there
    found.into_iter().flatten().collect()
}

/// Value of the smallest index below `count` that has one. Items behind a found one are skipped.
///
/// ```
/// assert_eq!(obsdeg_exact::parallel::find_first(9, |i| (i > 4).then_some(10 * i)), Some(50));
/// ```
pub fn find_first<T: Send>(count: usize, value: impl Fn(usize) -> Option<T> + Sync) -> Option<T> {
    let first = AtomicUsize::new(usize::MAX);
    let best: Mutex<Option<(usize, T)>> = Mutex::new(None);
    each(count, &|i| {
        if first.load(Ordering::Relaxed) < i {
            return;
        }
        if let (Some(found), Ok(mut best)) = (value(i), best.lock())
            && best.as_ref().is_none_or(|b| i < b.0)
        {
            first.fetch_min(i, Ordering::Relaxed);
            *best = Some((i, found));
        }
    });
    best.into_inner().ok().flatten().map(|b| b.1)
}

/// True if `holds` is true for every index below `count`. Items that have not begun are skipped after a
/// false one.
pub fn all(count: usize, holds: &(dyn Fn(usize) -> bool + Sync)) -> bool {
    let failed = AtomicBool::new(false);
    each(count, &|i| {
        if !failed.load(Ordering::Relaxed) && !holds(i) {
            failed.store(true, Ordering::Relaxed);
        }
    });
    !failed.into_inner()
}

/// Results of two pieces of work that run at the same time.
pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    let work = (Mutex::new(Some(a)), Mutex::new(Some(b)));
    let found = (Mutex::new(None), Mutex::new(None));
    each(2, &|i| match i {
        0 => once(&work.0, &found.0),
        _ => once(&work.1, &found.1),
    });
    match (found.0.into_inner(), found.1.into_inner()) {
        (Ok(Some(a)), Ok(Some(b))) => (a, b),
        _ => unreachable!("both pieces of work have ended"),
    }
}

/// Does the work that is still there, and stores its result.
fn once<T>(work: &Mutex<Option<impl FnOnce() -> T>>, found: &Mutex<Option<T>>) {
    let work = work.lock().ok().and_then(|mut work| work.take());
    let result = work.map(|work| work());
    if let Ok(mut found) = found.lock() {
        *found = result;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU64;

    use super::*;

    #[test]
    fn orders_are_those_of_a_loop() {
        let square = |i: usize| (i * i) as u64;
        assert_eq!(map(1000, square), (0..1000).map(square).collect::<Vec<_>>());
        assert_eq!(map(0, square), []);
        let odd = |i: usize| if i % 7 == 5 { Err(i) } else { Ok(i) };
        assert_eq!(try_map(1000, odd), Err(5));
        assert_eq!(try_map(5, odd), Ok(vec![0, 1, 2, 3, 4]));
        assert_eq!(find_first(1000, |i| (i % 10 == 9).then_some(i)), Some(9));
        assert_eq!(find_first(1000, |_| None::<u8>), None);
        assert!(all(1000, &|i| i < 1000) && !all(1000, &|i| i != 999));
        assert_eq!(join(|| join(|| 1, || "b"), || 2.5), ((1, "b"), 2.5));
    }

    /// A callback of this thread is asked during the items, and ends them.
    #[test]
    fn a_callback_ends_the_items() {
        let asked = std::rc::Rc::new(std::cell::Cell::new(0));
        let count = asked.clone();
        let goes_on = move || {
            count.set(count.get() + 1);
            count.get() < 3
        };
        let work = || join(|| (0..1000).for_each(|_| interrupt::check()), || ());
        assert!(interrupt::hearing(std::time::Duration::ZERO, goes_on, work).is_none());
        assert_eq!(asked.get(), 3);
    }

    #[test]
    fn every_item_is_done_once() {
        let counts: Vec<AtomicU64> = (0..500).map(|_| AtomicU64::new(0)).collect();
        map(500, |i| map(3, |_| counts[i].fetch_add(1, Ordering::Relaxed)));
        assert!(counts.iter().all(|c| c.load(Ordering::Relaxed) == 3));
    }

    #[test]
    fn a_panic_of_an_item_is_that_of_the_call() {
        let ended = std::panic::catch_unwind(|| map(10, |i| assert!(i != 3, "three")));
        assert!(ended.is_err());
    }
}
