//! Ctrl-C ends long work with what it has; a second one ends the program.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::failure::Failure;

/// True once the user has interrupted.
pub(crate) fn flag() -> Result<Arc<AtomicBool>, Failure> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&interrupted);
    let handler = move || {
        if seen.swap(true, Ordering::Relaxed) {
            // as a shell reports a program ended by SIGINT
            #[allow(clippy::exit, reason = "the user asked twice")]
            std::process::exit(130);
        }
    };
    ctrlc::set_handler(handler).map_err(|e| Failure::internal(format!("cannot listen to Ctrl-C: {e}")))?;
    Ok(interrupted)
}
