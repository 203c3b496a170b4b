//! The symbolic engine as the commands use it.

use clap::Args;
use obsdeg_commands::whole;
use obsdeg_symbolic::{Worker, WorkerConfig};

use crate::failure::{Failure, say};
use crate::progress::Spinner;

/// How much the engine may do.
#[derive(Debug, Args)]
#[command(next_help_heading = "Solutions")]
pub(crate) struct EngineArguments {
    /// How much work the symbolic engine may do for one formula, 0 (none) to 1000000: a unit is five million products of terms, about half a second, and
    /// ends at the same place on every machine and under any load. What cannot be counted (factorisation) ends after two seconds of
    /// processor time per unit
    #[arg(long, value_name = "UNITS", default_value_t = 5, value_parser = whole::<u64>(0..=1_000_000))]
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

    /// What `work` finds with the engine, with a sign of life, and what the engine says of itself; then the next process may have it.
    pub(crate) fn lend<T>(
        &self,
        message: &'static str,
        quiet: bool,
        work: impl FnOnce(Option<&mut Worker>) -> Result<T, Failure>,
    ) -> Result<(T, Vec<String>), Failure> {
        let mut worker = self.worker(quiet)?;
        let spinner = Spinner::start(message, quiet);
        let found = work(worker.as_mut());
        drop(spinner);
        if let Some(worker) = worker.as_mut() {
            worker.rest();
        }
        Ok((found?, worker.iter().flat_map(Worker::banner).cloned().collect()))
    }
}

fn say_waiting() {
    eprintln!(
        "waiting for another obsdeg process: the symbolic engine runs once per user (--solutions off needs none; Ctrl-C ends the wait)"
    );
}

/// The banner of the engine is its licence notice: whole, and after the answer.
pub(crate) fn notice(banner: &[String], quiet: bool) {
    for line in banner.iter().filter(|_| !quiet) {
        say(line);
    }
}
