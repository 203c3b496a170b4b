//! The symbolic engine as the commands use it.

use clap::Args;
use obsdeg_symbolic::{Worker, WorkerConfig};

use crate::failure::{Failure, say};

/// How much the engine may do.
#[derive(Debug, Args)]
pub(crate) struct EngineArguments {
    /// How much work the symbolic engine may do for one formula, 0 (none) to 1000000: a unit is five million products of terms, about half a second, and
    /// ends at the same place on every machine and under any load. What cannot be counted (factorisation) ends after two seconds of
    /// processor time per unit
    #[arg(long, value_name = "UNITS", default_value_t = 5, value_parser = clap::value_parser!(u64).range(0..=1_000_000))]
    symbolic_limit: u64,
}

impl EngineArguments {
    /// The symbolic engine in a process of its own, if this build has one; nothing starts yet.
    pub(crate) fn worker(&self, quiet: bool) -> Result<Option<Worker>, Failure> {
        if !cfg!(feature = "symbolica") {
            return Ok(None);
        }
        let program = std::env::current_exe()
            .map_err(|e| Failure::internal(format!("cannot find the program itself: {e}")))?;
        Ok(Some(Worker::new(WorkerConfig {
            program,
            arguments: vec!["symbolic-worker".into()],
            limit: self.symbolic_limit,
            waiting: if quiet { || {} } else { say_waiting },
        })))
    }
}

fn say_waiting() {
    eprintln!(
        "waiting for another obsdeg process: the symbolic engine runs once per user (--solutions off needs none; Ctrl-C ends the wait)"
    );
}

/// The engine is not needed any more: the next process may have it.
pub(crate) fn rest(worker: Option<&mut Worker>) {
    if let Some(worker) = worker {
        worker.rest();
    }
}

/// The banner of the engine is its licence notice.
pub(crate) fn notice(worker: Option<&Worker>, quiet: bool) {
    for line in worker.into_iter().flat_map(Worker::banner).filter(|_| !quiet) {
        say(line);
    }
}
