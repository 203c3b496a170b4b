//! A sign of life on stderr for what takes longer than a second.

use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{HumanCount, ProgressBar, ProgressDrawTarget, ProgressStyle};
use obsdeg_calibration::Going;
use obsdeg_design::design::Progress;
use obsdeg_report::visible;

/// What a spinner goes through, in characters that every terminal has.
const TURNS: &str = "|/-\\ ";

/// Shows a spinner on a terminal until it is dropped, if that takes longer than a second.
pub(crate) struct Spinner {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Spinner {
    /// A spinner with a message; silent when `quiet`.
    pub(crate) fn start(message: &'static str, quiet: bool) -> Self {
        if quiet {
            return Self { stop: None, thread: None };
        }
        let (stop, stopped) = channel();
        let thread = std::thread::spawn(move || {
            if stopped.recv_timeout(Duration::from_secs(1)) != Err(RecvTimeoutError::Timeout) {
                return;
            }
            let style = ProgressStyle::default_spinner().tick_chars(TURNS);
            let bar = ProgressBar::new_spinner().with_style(style).with_message(message);
            while stopped.recv_timeout(Duration::from_millis(100)) == Err(RecvTimeoutError::Timeout) {
                bar.tick();
            }
            bar.finish_and_clear();
        });
        Self { stop: Some(stop), thread: Some(thread) }
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.stop.take(); // the thread sees the channel close
        if let Some(thread) = self.thread.take() {
            // a panic there has said so already
            let _ = thread.join();
        }
    }
}

/// A bar on a terminal for work of known length, once it has taken a second.
pub(crate) struct Bar {
    bar: ProgressBar,
    started: Instant,
    quiet: bool,
}

impl Bar {
    /// A bar of `total` steps; silent when `quiet`.
    pub(crate) fn start(total: u64, message: &'static str, quiet: bool) -> Self {
        let bar =
            ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden()).with_message(message);
        if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:40}] {pos}/{len}, {eta} left") {
            bar.set_style(style.progress_chars("=> "));
        }
        Self { bar, started: Instant::now(), quiet }
    }

    /// How far a search is, with its rate and the best so far.
    pub(crate) fn search(&self, now: &Progress) {
        self.bar.set_length(now.total);
        let rate = now.examined as f64 / self.started.elapsed().as_secs_f64().max(1e-3);
        let best = if now.best.is_finite() { format!(", best {:.4}", now.best) } else { String::new() };
        self.bar.set_message(format!("searching, {}/s{best}", HumanCount(rate as u64)));
        self.at(now.done);
    }

    /// How far a calibration is: nobody knows how much there is.
    pub(crate) fn calibrates(&self, now: Going<'_>) {
        let (what, done) = match now {
            Going::Reads { record, samples } => (format!("reading {record}"), samples),
            Going::Passes(passes) => ("calibrating, linearisations".into(), passes),
        };
        if self.bar.message() != visible(&what) {
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}: {human_pos}, {elapsed}") {
                self.bar.set_style(style.tick_chars(TURNS));
            }
            self.says(&what);
        }
        self.at(done as u64);
    }

    /// What is being done.
    pub(crate) fn says(&self, what: &str) {
        self.bar.set_message(visible(what).into_owned());
    }

    /// So much is done.
    pub(crate) fn at(&self, done: u64) {
        if !self.quiet && self.bar.is_hidden() && self.started.elapsed() > Duration::from_secs(1) {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_position(done);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
