//! The worker process as seen from the program: lock, start, ask, give up in time.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use crate::protocol::{PREFIX, Request, Response};

/// How to start the worker.
#[derive(Debug, Clone)]
pub struct WorkerConfig {
    /// The program, normally this binary.
    pub program: PathBuf,
    /// Its arguments, normally the hidden subcommand.
    pub arguments: Vec<String>,
    /// One per user: whoever holds its lock may run a worker.
    pub lock_file: PathBuf,
    /// How long to wait for the lock.
    pub lock_limit: Duration,
    /// How long one answer may take.
    pub time_limit: Duration,
}

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WorkerError {
    /// The lock file cannot be used.
    #[error("cannot lock {path}: {reason}")]
    Lock {
        /// The file.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// Another process of this user holds the lock.
    #[error("another obsdeg process has been using the symbolic engine for {seconds} s")]
    Busy {
        /// How long was waited.
        seconds: u64,
    },
    /// The process did not start.
    #[error("cannot start the symbolic worker {program}: {reason}")]
    Start {
        /// The program.
        program: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// The process ended without an answer.
    #[error(
        "the symbolic worker ended before it answered; is another Symbolica process of this user running?"
    )]
    Ended,
    /// The time is up.
    #[error("the symbolic worker took longer than {seconds} s")]
    TimedOut {
        /// The limit.
        seconds: u64,
    },
    /// The answer makes no sense.
    #[error("the symbolic worker answered with something else: {found}")]
    Garbled {
        /// The start of the answer.
        found: String,
    },
    /// The job itself failed.
    #[error("{reason}")]
    Failed {
        /// Why.
        reason: String,
    },
}

struct Running {
    child: Child,
    input: Option<ChildStdin>,
    lines: Receiver<String>,
    _lock: File,
}

impl Drop for Running {
    fn drop(&mut self) {
        self.input.take(); // end of input: the worker leaves by itself
        let patience = Instant::now() + Duration::from_millis(500);
        while Instant::now() < patience {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                return;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        // it does not leave: nothing more can be done about an error here
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A worker that starts with the first request. After a time-out it starts afresh with the next one;
/// after any other failure of the process it stays down and repeats the reason.
pub struct Worker {
    config: WorkerConfig,
    running: Option<Running>,
    failure: Option<WorkerError>,
    banner: Vec<String>,
}

impl Worker {
    /// A worker that is not started yet.
    pub fn new(config: WorkerConfig) -> Self {
        Self { config, running: None, failure: None, banner: Vec::new() }
    }

    /// What the engine printed besides its answers.
    pub fn banner(&self) -> &[String] {
        &self.banner
    }

    /// The last failure of the process.
    pub fn failure(&self) -> Option<&WorkerError> {
        self.failure.as_ref()
    }

    /// Sends one request and waits for its answer: the expressions, and whether a check held.
    ///
    /// # Errors
    /// [`WorkerError::Failed`] when the job failed; anything else when the process did, now or before.
    pub fn ask(&mut self, request: &Request) -> Result<(Vec<String>, bool), WorkerError> {
        match &self.failure {
            None | Some(WorkerError::TimedOut { .. }) => {}
            Some(reason) => return Err(reason.clone()),
        }
        match self.exchange(request) {
            Ok(Response::Values { values, verified }) => Ok((values, verified)),
            Ok(Response::Failed { reason }) => Err(WorkerError::Failed { reason }),
            Err(error) => {
                if let Some(running) = &mut self.running {
                    let _ = running.child.kill(); // already failing: the first error is the one to tell
                }
                self.running = None;
                self.failure = Some(error.clone());
                Err(error)
            }
        }
    }

    fn exchange(&mut self, request: &Request) -> Result<Response, WorkerError> {
        if self.running.is_none() {
            self.running = Some(start(&self.config)?);
        }
        let Some(running) = &mut self.running else { return Err(WorkerError::Ended) };
        let line =
            serde_json::to_string(request).map_err(|e| WorkerError::Garbled { found: e.to_string() })?;
        let input = running.input.as_mut().ok_or(WorkerError::Ended)?;
        writeln!(input, "{line}").and_then(|()| input.flush()).map_err(|_| WorkerError::Ended)?;
        let deadline = Instant::now() + self.config.time_limit;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let line = running.lines.recv_timeout(left).map_err(|e| match e {
                RecvTimeoutError::Timeout => {
                    WorkerError::TimedOut { seconds: self.config.time_limit.as_secs() }
                }
                RecvTimeoutError::Disconnected => WorkerError::Ended,
            })?;
            match line.strip_prefix(PREFIX) {
                None => self.banner.push(line),
                Some(answer) => {
                    let found = || answer.chars().take(80).collect();
                    return serde_json::from_str(answer).map_err(|_| WorkerError::Garbled { found: found() });
                }
            }
        }
    }
}

fn start(config: &WorkerConfig) -> Result<Running, WorkerError> {
    let lock = acquire(config)?;
    let mut child = Command::new(&config.program)
        .args(&config.arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|e| WorkerError::Start { program: config.program.clone(), reason: e.to_string() })?;
    let input = child.stdin.take();
    let (sender, lines) = channel();
    if let Some(output) = child.stdout.take() {
        std::thread::spawn(move || {
            for line in BufReader::new(output).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
    }
    Ok(Running { child, input, lines, _lock: lock })
}

fn acquire(config: &WorkerConfig) -> Result<File, WorkerError> {
    let lock_error =
        |e: std::io::Error| WorkerError::Lock { path: config.lock_file.clone(), reason: e.to_string() };
    let file = OpenOptions::new()
        .create(true)
        .truncate(false)
        .write(true)
        .open(&config.lock_file)
        .map_err(lock_error)?;
    let deadline = Instant::now() + config.lock_limit;
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(file),
            Err(TryLockError::Error(e)) => return Err(lock_error(e)),
            Err(TryLockError::WouldBlock) if Instant::now() < deadline => {
                std::thread::sleep(Duration::from_millis(3));
            }
            Err(TryLockError::WouldBlock) => {
                return Err(WorkerError::Busy { seconds: config.lock_limit.as_secs() });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Job;

    fn request() -> Request {
        Request {
            symbols: vec![],
            generators: vec![],
            angles: vec![],
            job: Job::MinorFactors { matrix: vec![] },
        }
    }

    /// A worker that is a shell script.
    fn scripted(script: &str, lock_file: PathBuf) -> Worker {
        Worker::new(WorkerConfig {
            program: "/bin/sh".into(),
            arguments: vec!["-c".into(), script.into()],
            lock_file,
            lock_limit: Duration::from_millis(50),
            time_limit: Duration::from_millis(400),
        })
    }

    fn lock() -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("lock");
        (dir, path)
    }

    #[test]
    fn answers_are_told_from_the_banner() {
        let (_dir, path) = lock();
        let script = r#"echo banner; read line; echo 'obsdeg:{"values":{"values":["x"],"verified":true}}'"#;
        let mut worker = scripted(script, path);
        assert_eq!(worker.ask(&request()), Ok((vec!["x".into()], true)));
        assert_eq!(worker.banner(), ["banner"]);
    }

    #[test]
    fn crashes_time_outs_and_nonsense_are_told_and_stay() {
        for (script, expected) in [
            ("exit 3", WorkerError::Ended),
            ("read line; exec sleep 5", WorkerError::TimedOut { seconds: 0 }),
            ("read line; echo obsdeg:nonsense", WorkerError::Garbled { found: "nonsense".into() }),
        ] {
            let (_dir, path) = lock();
            let mut worker = scripted(script, path);
            assert_eq!(worker.ask(&request()), Err(expected.clone()), "{script}");
            assert_eq!(worker.ask(&request()), Err(expected.clone()));
            assert_eq!(worker.failure(), Some(&expected));
        }
    }

    #[test]
    fn one_at_a_time() {
        let (_dir, path) = lock();
        let holder = File::create(&path).expect("a file");
        holder.lock().expect("the lock");
        let mut worker = scripted("exit 0", path.clone());
        assert_eq!(worker.ask(&request()), Err(WorkerError::Busy { seconds: 0 }));
        let mut worker = scripted("exit 0", path.join("no/such/folder"));
        assert!(matches!(worker.ask(&request()), Err(WorkerError::Lock { .. })));
    }

    #[test]
    fn a_missing_program_is_named() {
        let (_dir, path) = lock();
        let mut worker = scripted("", path);
        worker.config.program = "/no/such/program".into();
        assert!(matches!(worker.ask(&request()), Err(WorkerError::Start { .. })));
    }
}
