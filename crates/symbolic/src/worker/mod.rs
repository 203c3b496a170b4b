//! Worker side: Symbolica behind [`serve`].

mod derive;
mod factor;
mod solve;
mod tower;

use std::io::{BufRead, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crate::lock;
use crate::protocol::{Job, Order, PREFIX, Request, Response, UNIT};
use tower::Tower;

/// Interval between two checks of the processor time of a job.
const WATCH: Duration = Duration::from_millis(20);

/// Processor time per unit of work, in s: the limit for work that cannot be counted.
const SECONDS_PER_UNIT: u64 = 2;

/// Error of a job.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum JobError {
    /// Text that is no rational function of the declared symbols.
    #[error("`{text}` is not a rational function of the announced symbols")]
    NotAnElement { text: String },
    /// Rows or columns of different lengths.
    #[error("the {what} has {found} entries, expected {expected}")]
    Shape { what: &'static str, found: usize, expected: usize },
    /// System with no solution, or more than one.
    #[error("the system is {0} over the field of its symbols")]
    NotUnique(&'static str),
    /// Solution that does not satisfy the check.
    #[error("the solution failed its verification by substitution")]
    NotVerified,
    /// Work beyond the limit.
    #[error("more work than the limit")]
    OverLimit,
}

/// Answers requests, one per line, as soon as this process holds `lock_file`. Output of the engine
/// itself to stdout does not begin with `obsdeg:`.
///
/// `end` ends the process. It is called at any point of the work when the input ends, since nobody
/// waits for an answer then, and when a job has used up its processor time.
///
/// Work is counted where possible (products of terms), so a job ends at the same point on every machine
/// and under any load. Work that cannot be counted, such as a factorisation, is bounded by the
/// processor time of this process.
///
/// # Errors
/// Errors of `output`.
pub fn serve(
    lock_file: &Path,
    input: impl BufRead + Send + 'static,
    output: impl Write + Send + 'static,
    end: fn() -> !,
) -> std::io::Result<()> {
    let output = Arc::new(Mutex::new(output));
    let say =
        |response: &Response| write(&mut *output.lock().unwrap_or_else(PoisonError::into_inner), response);
    let (sender, lines) = channel();
    std::thread::spawn(move || {
        for line in input.lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                break;
            }
        }
        end();
    });
    // held until the process ends
    let _held = match lock::open(lock_file).and_then(|file| {
        lock::wait(&file, || say(&Response::Waiting))?;
        Ok(file)
    }) {
        Ok(file) => file,
        Err(e) => {
            let reason = format!("cannot lock {}: {e}", lock_file.display());
            return say(&Response::Unusable { reason });
        }
    };
    say(&Response::Ready)?;
    for line in lines {
        let order: Order = match serde_json::from_str(&line) {
            Ok(order) => order,
            Err(e) => {
                say(&Response::Failed { reason: format!("the request is malformed: {e}") })?;
                continue;
            }
        };
        let (done, watched) = channel::<()>();
        let seconds = order.limit.saturating_mul(SECONDS_PER_UNIT);
        let watch = std::thread::spawn({
            let output = Arc::clone(&output);
            move || {
                if watch(&watched, seconds) {
                    // no other thread writes after this
                    let mut output = output.lock().unwrap_or_else(PoisonError::into_inner);
                    let _ = write(&mut *output, &Response::OverLimit); // errors are ignored: the process ends
                    end();
                }
            }
        });
        let response = answer(&order.request, order.limit.saturating_mul(UNIT));
        drop(done);
        let _ = watch.join(); // the thread does not panic
        say(&response)?;
    }
    Ok(())
}

fn write(output: &mut impl Write, response: &Response) -> std::io::Result<()> {
    let text = serde_json::to_string(response)?;
    writeln!(output, "{PREFIX}{text}")?;
    output.flush()
}

/// True if a job has spent `seconds` seconds on the processor before it was done.
fn watch(done: &Receiver<()>, seconds: u64) -> bool {
    let start = processor_time();
    while done.recv_timeout(WATCH) == Err(RecvTimeoutError::Timeout) {
        if processor_time().saturating_sub(start).as_secs() >= seconds {
            return true;
        }
    }
    false
}

/// Processor time of this process.
#[cfg(unix)]
fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    // never negative
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}

/// Unknown on this system: only counted work is limited.
#[cfg(not(unix))]
fn processor_time() -> Duration {
    Duration::ZERO
}

fn answer(request: &Request, limit: u64) -> Response {
    let tower = Tower::new(&request.symbols, &request.generators, &request.angles, limit);
    let result = tower.and_then(|tower| {
        tower.go_on()?;
        match &request.job {
            Job::Solve { system, check } => solve::solve(&tower, system, check.as_ref()),
            Job::Derive { dynamics, order } => derive::formulas(dynamics, *order).map(|v| (v, false)),
            Job::MinorFactors { matrix } => factor::minor_factors(&tower, matrix).map(|v| (v, false)),
        }
    });
    match result {
        Ok((values, verified)) => Response::Values { values, verified },
        Err(JobError::OverLimit) => Response::OverLimit,
        Err(e) => Response::Failed { reason: e.to_string() },
    }
}
