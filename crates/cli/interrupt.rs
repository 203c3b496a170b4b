//! Ctrl-C, and the signals with which a system ends a program (SIGTERM, SIGHUP). They end the program, or
//! long work that has a partial result.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::failure::{Failure, INTERRUPTED};
use crate::{files, print};

/// From now on an interrupt ends the program at once, with the code that a shell gives a program ended by
/// Ctrl-C. Files that are being put in place are completed first; otherwise none is left.
pub(crate) fn ends() -> Result<(), Failure> {
    listen(|| {
        eprintln!("interrupted");
        end();
    })
}

/// Flag that is true after an interrupt: work then ends with its partial result. A second interrupt ends the
/// program.
pub(crate) fn flag() -> Result<Arc<AtomicBool>, Failure> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&interrupted);
    listen(move || {
        if seen.swap(true, Ordering::Relaxed) {
            end();
        }
    })?;
    Ok(interrupted)
}

fn listen(handler: impl FnMut() + Send + 'static) -> Result<(), Failure> {
    ctrlc::set_handler(handler).map_err(|e| Failure::internal(format!("cannot listen to Ctrl-C: {e}")))
}

fn end() {
    print::abandon();
    files::abandon();
    #[allow(clippy::exit, reason = "the user asked for it")]
    std::process::exit(INTERRUPTED.into());
}
