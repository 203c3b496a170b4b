//! Spinner and progress bar on stderr for work that takes longer than a second.

use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{HumanCount, ProgressBar, ProgressDrawTarget, ProgressStyle};
use obsdeg_commands::Now;
use obsdeg_report::visible;

/// Characters of the spinner, which every terminal has.
const TURNS: &str = "|/-\\ ";

/// Shows a spinner on a terminal after one second, until it is dropped.
pub(crate) struct Spinner {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Spinner {
    /// Starts a spinner with a message; shows nothing if `quiet`.
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
            // the panic of the thread has printed its message
            let _ = thread.join();
        }
    }
}

/// Progress bar on a terminal, shown after one second of work.
pub(crate) struct Bar {
    bar: ProgressBar,
    started: Instant,
    quiet: bool,
}

/// Template of the bar for work of known length.
const KNOWN: &str = "{msg} [{bar:40}] {pos}/{len}, {eta} left";
/// Template for work of unknown length.
const UNKNOWN: &str = "{spinner} {msg}: {human_pos}, {elapsed}";

impl Bar {
    /// Starts a bar; shows nothing if `quiet`.
    pub(crate) fn start(quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::hidden());
        Self { bar, started: Instant::now(), quiet }
    }

    /// Shows how far the work is; for a search also its rate per second and the best criterion so far.
    pub(crate) fn show(&self, now: &Now) {
        let mut what = visible(&now.what).into_owned();
        if let Some(examined) = now.examined {
            let rate = examined as f64 / self.started.elapsed().as_secs_f64().max(1e-3);
            let best = now.best.map_or_else(String::new, |best| format!(", best {best:.4}"));
            what = format!("{what}, {}/s{best}", HumanCount(rate as u64));
        }
        if self.bar.message() != what {
            let template = if now.total.is_some() { KNOWN } else { UNKNOWN };
            if let Ok(style) = ProgressStyle::with_template(template) {
                self.bar.set_style(style.progress_chars("=> ").tick_chars(TURNS));
            }
            self.bar.set_message(what);
        }
        if let Some(total) = now.total {
            self.bar.set_length(total);
        }
        self.set_position(now.done);
    }

    /// Shows the name of the current work.
    pub(crate) fn set_message(&self, what: &str) {
        self.bar.set_message(visible(what).into_owned());
    }

    /// Sets the position of the bar, and shows the bar after one second.
    fn set_position(&self, done: u64) {
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
