//! The symbolic engine for the commands: limits, messages while waiting, licence notice.

use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use obsdeg_commands::whole;
use obsdeg_symbolic::{Waiting, Worker, WorkerConfig, WorkerError};

use crate::failure::{Failure, say};
use crate::progress::Spinner;

/// Limits of the symbolic engine: work, and waiting time.
#[derive(Debug, Args)]
#[command(next_help_heading = "Solutions")]
pub(crate) struct EngineArguments {
    /// Largest work of the symbolic engine for one formula, 0 (none) to 1000000: a unit is five million
    /// products of terms, about half a second, and ends at the same place on every machine and under any
    /// load. What cannot be counted (factorisation) ends after two seconds of processor time per unit
    #[arg(long, value_name = "UNITS", default_value_t = 5, value_parser = whole::<u64>(0..=1_000_000))]
    symbolic_limit: u64,

    /// Longest wait for other obsdeg processes of the same user, 0 to 86400 s: the symbolic engine runs once
    /// per user. Then the answer comes without the formulas that need the engine, and says so. No other
    /// option depends on the clock
    #[arg(long, value_name = "SECONDS", default_value_t = 10, value_parser = whole::<u64>(0..=86_400))]
    engine_wait: u64,
}

impl EngineArguments {
    /// The symbolic engine in a process of its own, `None` if this build has none; nothing starts yet.
    /// `meanwhile` gives the verdicts to print while another process holds the engine.
    pub(crate) fn worker(&self, quiet: bool, meanwhile: EarlyVerdicts) -> Result<Option<Worker>, Failure> {
        if !cfg!(feature = "symbolica") {
            return Ok(None);
        }
        let wait = self.engine_wait;
        let program = std::env::current_exe()
            .map_err(|e| Failure::internal(format!("cannot find the program itself: {e}")))?;
        Ok(Some(Worker::new(WorkerConfig {
            program,
            arguments: vec!["symbolic-worker".into()],
            limit: self.symbolic_limit,
            wait: Duration::from_secs(wait),
            waiting: match quiet {
                true => Waiting::silent(),
                false => Waiting(Arc::new(move || say_waiting(wait, &meanwhile()))),
            },
        })))
    }

    /// Result of `work` with the engine, which is then free for the next process. Shows a spinner, then the
    /// notice of the engine.
    pub(crate) fn lend<T>(
        &self,
        message: &'static str,
        quiet: bool,
        meanwhile: EarlyVerdicts,
        work: impl FnOnce(Option<&mut Worker>) -> Result<T, Failure>,
    ) -> Result<(T, Vec<String>), Failure> {
        let mut worker = self.worker(quiet, meanwhile)?;
        let spinner = Spinner::start(message, quiet);
        let found = work(worker.as_mut());
        drop(spinner);
        if let Some(worker) = worker.as_mut() {
            worker.rest();
            say_busy(worker);
        }
        Ok((found?, worker.iter().flat_map(Worker::banner).cloned().collect()))
    }
}

/// Names on stderr the parts of the answer that are missing without the engine, and how to get them;
/// `--quiet` does not suppress this.
pub(crate) fn say_busy(worker: &Worker) {
    let why = match worker.failure() {
        Some(WorkerError::Busy { seconds: 0 }) => {
            "another obsdeg process holds it, and --engine-wait 0 does not wait. Run the command again, or \
             wait (--engine-wait)"
                .into()
        }
        Some(WorkerError::Busy { seconds }) => format!(
            "another obsdeg process held it for more than {seconds} s. Run the command again, or wait longer \
             (--engine-wait)"
        ),
        Some(WorkerError::OverLimit { limit: 0 }) => "--symbolic-limit 0 switches it off".into(),
        _ => return,
    };
    say(&format!(
        "what needs the symbolic engine is missing or in decimals (the notes of a table and the JSON answer \
         say what): {why}"
    ));
}

/// Verdicts that need no engine, one per line; called once, after the wait for the engine has lasted 1 s.
pub(crate) type EarlyVerdicts = Box<dyn Fn() -> Vec<String> + Send + Sync>;

/// Says on stderr that the command waits for the engine, at most `wait` s, and prints the verdicts.
fn say_waiting(wait: u64, meanwhile: &[String]) {
    eprintln!(
        "waiting for another obsdeg process, at most {wait} s (--engine-wait): the symbolic engine runs once \
         per user, and --solutions off does without it; Ctrl-C ends this command"
    );
    if !meanwhile.is_empty() {
        eprintln!("verdicts, which do not wait for it:");
    }
    for line in meanwhile {
        say(line);
    }
}

/// Prints the banner of the engine, its licence notice, unabridged and after the answer.
pub(crate) fn notice(banner: &[String], quiet: bool) {
    for line in banner.iter().filter(|_| !quiet) {
        say(line);
    }
}
