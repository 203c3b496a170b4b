//! Client of the worker process: start, wait for its turn, requests, failure.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use crate::protocol::{Order, PREFIX, Request, Response};

/// Largest length of a line of a worker, in bytes.
const MAX_LINE: usize = 4 << 20;
/// Largest output of a worker besides its answers, in bytes.
const MAX_BANNER: usize = 64 << 10;
/// Time that another process may hold the lock before the wait is reported.
const PATIENCE: Duration = Duration::from_secs(1);

/// Callback for a worker that waits for its turn.
#[derive(Clone)]
pub struct Waiting(pub Arc<dyn Fn() + Send + Sync>);

impl Waiting {
    /// Callback that does nothing.
    pub fn silent() -> Self {
        Self(Arc::new(|| {}))
    }
}

impl std::fmt::Debug for Waiting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Waiting")
    }
}

/// Configuration of the worker.
#[derive(Debug, Clone)]
pub struct WorkerConfig {
    /// Program of the worker, normally this binary.
    pub program: PathBuf,
    /// Arguments of the program, normally the hidden subcommand.
    pub arguments: Vec<String>,
    /// Largest work per answer, in [`UNIT`](crate::protocol::UNIT)s.
    pub limit: u64,
    /// Longest time, over all requests, that the worker may wait for other processes of this user.
    pub wait: Duration,
    /// Called once when the worker has waited a second for its turn.
    pub waiting: Waiting,
}

/// Error of a request.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WorkerError {
    /// Lock file that cannot be used.
    #[error("{reason}")]
    Lock {
        /// Path of the file, and its fault.
        reason: String,
    },
    /// Lock held by others for the whole of [`WorkerConfig::wait`].
    #[error("another process of this user held the symbolic engine for more than {seconds} s")]
    Busy {
        /// Time waited, in s.
        seconds: u64,
    },
    /// Process that did not start.
    #[error("cannot start the symbolic worker {program}: {reason}")]
    Start {
        /// Path of the program.
        program: PathBuf,
        /// Error message of the system.
        reason: String,
    },
    /// Process that ended without an answer.
    #[error(
        "the symbolic worker ended before it answered; is another Symbolica process of this user running?"
    )]
    Ended,
    /// Work beyond the limit.
    #[error("{}", over_limit(*limit))]
    OverLimit {
        /// Limit of work, in units.
        limit: u64,
    },
    /// Answer that does not follow the protocol.
    #[error("the symbolic worker answered with something else: {found}")]
    Garbled {
        /// Start of the answer, or its fault.
        found: String,
    },
    /// Job that failed.
    #[error("{reason}")]
    Failed {
        /// Reason in words.
        reason: String,
    },
}

fn over_limit(limit: u64) -> String {
    match limit {
        0 => "the symbolic engine is switched off by a limit of 0 (--symbolic-limit)".into(),
        _ => format!("the symbolic engine reached its limit, {limit} units of work (--symbolic-limit)"),
    }
}

struct WorkerProcess {
    child: Child,
    input: Option<ChildStdin>,
    lines: Receiver<Vec<u8>>,
    /// Number of bytes that were no answer.
    chatter: usize,
}

impl Drop for WorkerProcess {
    fn drop(&mut self) {
        self.input.take(); // end of input: the worker ends by itself at any point
        let patience = Instant::now() + Duration::from_millis(500);
        while Instant::now() < patience {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                return;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        // the worker has not ended by itself; errors are ignored here
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Worker process, started with the first request. It keeps its turn until [`Self::rest`]. After work
/// beyond its limit it starts again with the next request; after any other failure of the process it
/// stays down and repeats the reason.
pub struct Worker {
    config: WorkerConfig,
    /// Remaining time for waits for other processes.
    patience: Duration,
    running: Option<WorkerProcess>,
    failure: Option<WorkerError>,
    banner: Vec<String>,
}

impl Worker {
    /// Worker that is not started yet.
    pub fn new(config: WorkerConfig) -> Self {
        Self { patience: config.wait, config, running: None, failure: None, banner: Vec::new() }
    }

    /// Lines that the engine printed besides its answers.
    pub fn banner(&self) -> &[String] {
        &self.banner
    }

    /// Last failure of the process; `None` if it never failed.
    pub fn failure(&self) -> Option<&WorkerError> {
        self.failure.as_ref()
    }

    /// Ends the process, so that another may take its turn; the next request starts it again.
    pub fn rest(&mut self) {
        self.running = None;
    }

    /// Sends one request and waits for its answer: the expressions, and true if a check held. With a
    /// limit of 0 no process starts.
    ///
    /// # Errors
    /// [`WorkerError::Failed`] if the job failed; any other error if the process did, now or before.
    pub fn ask(&mut self, request: &Request) -> Result<(Vec<String>, bool), WorkerError> {
        if self.config.limit == 0 {
            return Err(self.down(WorkerError::OverLimit { limit: 0 }));
        }
        match &self.failure {
            None | Some(WorkerError::OverLimit { .. }) => {}
            Some(reason) => return Err(reason.clone()),
        }
        match self.exchange(request) {
            Ok(Response::Values { values, verified }) => Ok((values, verified)),
            Ok(Response::Failed { reason }) => Err(WorkerError::Failed { reason }),
            Ok(other) => Err(self.down(garbled(format!("{other:?} in place of an answer")))),
            Err(error) => Err(self.down(error)),
        }
    }

    /// Ends the process and stores the reason.
    fn down(&mut self, error: WorkerError) -> WorkerError {
        if let Some(running) = &mut self.running {
            let _ = running.child.kill(); // already failing: the first error is the one to report
        }
        self.running = None;
        self.failure = Some(error.clone());
        error
    }

    fn exchange(&mut self, request: &Request) -> Result<Response, WorkerError> {
        if self.running.is_none() {
            self.running = Some(start(&self.config)?);
            self.take_turn()?;
        }
        let order = Order { limit: self.config.limit, request: request.clone() };
        let line = serde_json::to_string(&order).map_err(|e| garbled(e.to_string()))?;
        let input = self.running.as_mut().and_then(|r| r.input.as_mut()).ok_or(WorkerError::Ended)?;
        writeln!(input, "{line}").and_then(|()| input.flush()).map_err(|_| WorkerError::Ended)?;
        let response = self.response(None)?.ok_or(WorkerError::Ended)?;
        match (&response, request.answers()) {
            (Response::OverLimit, _) => Err(WorkerError::OverLimit { limit: self.config.limit }),
            (Response::Values { values, .. }, Some(expected)) if values.len() != expected => {
                Err(garbled(format!("{} expressions, expected {expected}", values.len())))
            }
            _ => Ok(response),
        }
    }

    /// Waits until the worker holds the lock. Calls the callback once after [`PATIENCE`]; gives up
    /// after [`WorkerConfig::wait`].
    fn take_turn(&mut self) -> Result<(), WorkerError> {
        let mut since: Option<Instant> = None;
        let mut said = false;
        loop {
            let left = since.map(|since| self.patience.saturating_sub(since.elapsed()));
            match self.response(left.map(|left| if said { left } else { left.min(PATIENCE) }))? {
                None if since.is_some_and(|since| since.elapsed() >= self.patience) => {
                    return Err(WorkerError::Busy { seconds: self.config.wait.as_secs() });
                }
                None if !said => {
                    (self.config.waiting.0)();
                    said = true;
                }
                None => {}
                Some(Response::Waiting) => since = Some(Instant::now()),
                Some(Response::Ready) => {
                    let waited = since.map_or(Duration::ZERO, |since| since.elapsed());
                    self.patience = self.patience.saturating_sub(waited);
                    return Ok(());
                }
                Some(Response::Unusable { reason }) => return Err(WorkerError::Lock { reason }),
                Some(other) => return Err(garbled(format!("{other:?} before it was asked"))),
            }
        }
    }

    /// Next response of the worker; `None` if none arrives within `patience`.
    fn response(&mut self, patience: Option<Duration>) -> Result<Option<Response>, WorkerError> {
        let Some(running) = &mut self.running else { return Err(WorkerError::Ended) };
        loop {
            let line = match patience {
                None => running.lines.recv().map_err(|_| WorkerError::Ended)?,
                Some(time) => match running.lines.recv_timeout(time) {
                    Ok(line) => line,
                    Err(RecvTimeoutError::Timeout) => return Ok(None),
                    Err(RecvTimeoutError::Disconnected) => return Err(WorkerError::Ended),
                },
            };
            if line.len() > MAX_LINE {
                return Err(garbled(format!("a line of more than {MAX_LINE} bytes")));
            }
            let line = String::from_utf8_lossy(&line);
            if let Some(answer) = line.strip_prefix(PREFIX) {
                let wrong = |_| garbled(answer.chars().take(80).collect());
                return serde_json::from_str(answer).map(Some).map_err(wrong);
            }
            running.chatter += line.len() + 1;
            if running.chatter > MAX_BANNER {
                return Err(garbled(format!("more than {MAX_BANNER} bytes that are no answer")));
            }
            if !self.banner.iter().any(|known| *known == line) {
                self.banner.push(line.into_owned());
            }
        }
    }
}

fn garbled(found: String) -> WorkerError {
    WorkerError::Garbled { found }
}

fn start(config: &WorkerConfig) -> Result<WorkerProcess, WorkerError> {
    let mut child = Command::new(&config.program)
        .args(&config.arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|e| WorkerError::Start { program: config.program.clone(), reason: e.to_string() })?;
    let input = child.stdin.take();
    // a worker with endless output is blocked, and no line exceeds the refused length
    let (sender, lines) = sync_channel(1);
    if let Some(output) = child.stdout.take() {
        std::thread::spawn(move || {
            let mut output = BufReader::new(output);
            loop {
                let mut line = Vec::new();
                let read = output.by_ref().take(MAX_LINE as u64 + 2).read_until(b'\n', &mut line);
                if !matches!(read, Ok(n) if n > 0) {
                    break;
                }
                line.pop_if(|last| *last == b'\n');
                let too_long = line.len() > MAX_LINE;
                if sender.send(line).is_err() || too_long {
                    break;
                }
            }
        });
    }
    Ok(WorkerProcess { child, input, lines, chatter: 0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{Job, System};

    /// Request with one expression as its answer.
    fn request() -> Request {
        let system = System { matrix: vec![vec!["1".into()]], right: vec!["x".into()], outputs: vec![] };
        Request {
            symbols: vec![],
            generators: vec![],
            angles: vec![],
            job: Job::Solve { system, check: None },
        }
    }

    /// Worker that is a shell script.
    fn scripted(script: &str) -> Worker {
        Worker::new(WorkerConfig {
            program: "/bin/sh".into(),
            arguments: vec!["-c".into(), script.into()],
            limit: u64::MAX,
            wait: Duration::from_secs(60),
            waiting: Waiting::silent(),
        })
    }

    const READY: &str = r#"echo 'obsdeg:"ready"'; read line; "#;

    #[test]
    fn answers_are_distinguished_from_the_banner() {
        let answer = r#"echo banner; echo 'obsdeg:{"values":{"values":["x"],"verified":true}}'"#;
        let mut worker = scripted(&format!("echo banner; {READY} {answer}; read line; {answer}"));
        for _ in 0..2 {
            assert_eq!(worker.ask(&request()), Ok((vec!["x".into()], true)));
        }
        assert_eq!(worker.banner(), ["banner"]);
        // the process may rest between two requests
        worker.rest();
        assert_eq!(worker.ask(&request()), Ok((vec!["x".into()], true)));
    }

    #[test]
    fn crashes_and_nonsense_are_reported_and_stay() {
        let garbled = |found: &str| WorkerError::Garbled { found: found.into() };
        for (script, expected) in [
            ("exit 3", WorkerError::Ended),
            ("READY exit 3", WorkerError::Ended),
            ("READY echo obsdeg:nonsense", garbled("nonsense")),
            (
                r#"echo 'obsdeg:{"values":{"values":[],"verified":true}}'"#,
                garbled("Values { values: [], verified: true } before it was asked"),
            ),
            (r#"READY echo 'obsdeg:"ready"'"#, garbled("Ready in place of an answer")),
            (
                r#"READY echo 'obsdeg:{"values":{"values":["a","b"],"verified":true}}'"#,
                garbled("2 expressions, expected 1"),
            ),
            (
                r#"echo 'obsdeg:{"unusable":{"reason":"cannot lock"}}'"#,
                WorkerError::Lock { reason: "cannot lock".into() },
            ),
            // one line without end, lines without end
            ("READY cat /dev/zero", garbled("a line of more than 4194304 bytes")),
            ("READY printf obsdeg:; cat /dev/zero", garbled("a line of more than 4194304 bytes")),
            ("READY yes", garbled("more than 65536 bytes that are no answer")),
        ] {
            let mut worker = scripted(&script.replace("READY", READY));
            assert_eq!(worker.ask(&request()), Err(expected.clone()), "{script}");
            assert_eq!(worker.ask(&request()), Err(expected.clone()));
            assert_eq!(worker.failure(), Some(&expected));
        }
    }

    /// Work beyond the limit ends the process, and the next request starts another.
    #[test]
    fn work_beyond_the_limit_is_reported_each_time() {
        let mut worker = scripted(&format!("{READY} echo 'obsdeg:\"over_limit\"'; exec sleep 60"));
        for _ in 0..2 {
            assert_eq!(worker.ask(&request()), Err(WorkerError::OverLimit { limit: u64::MAX }));
        }
    }

    /// The worker waits for the lock as long as allowed, and reports the wait once.
    #[test]
    fn a_long_wait_is_said() {
        static SAID: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);
        let wait = |seconds: &str| {
            let answer = r#"echo 'obsdeg:{"values":{"values":["x"],"verified":false}}'"#;
            let script = format!("echo 'obsdeg:\"waiting\"'; sleep {seconds}; {READY} {answer}");
            let mut worker = scripted(&script);
            worker.config.waiting = Waiting(Arc::new(|| {
                SAID.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            }));
            assert_eq!(worker.ask(&request()), Ok((vec!["x".into()], false)));
        };
        wait("1.5");
        assert_eq!(SAID.load(std::sync::atomic::Ordering::Relaxed), 1);
    }

    /// The time for waiting is shared by all requests; afterwards no worker waits or starts.
    #[test]
    fn a_wait_ends() {
        let mut worker = scripted("echo 'obsdeg:\"waiting\"'; exec sleep 60");
        (worker.config.wait, worker.patience) = (Duration::from_secs(1), Duration::from_secs(1));
        let start = Instant::now();
        for _ in 0..2 {
            assert_eq!(worker.ask(&request()), Err(WorkerError::Busy { seconds: 1 }));
        }
        assert!(start.elapsed() >= Duration::from_secs(1) && start.elapsed() < Duration::from_secs(30));
        // the wait for the first turn leaves less time for the second; it counts from its report on
        let turn = "echo 'obsdeg:\"waiting\"'; sleep 1; echo 'obsdeg:\"ready\"'; read line; echo \
            'obsdeg:\"over_limit\"'";
        let mut worker = scripted(turn);
        (worker.config.wait, worker.patience) = (Duration::from_secs(1000), Duration::from_secs(1000));
        assert!(matches!(worker.ask(&request()), Err(WorkerError::OverLimit { .. })));
        assert!(worker.patience <= Duration::from_millis(999_500), "{:?}", worker.patience);
    }

    /// With a limit of zero nothing starts, so no wait occurs.
    #[test]
    fn a_limit_of_zero_starts_nothing() {
        let folder = std::env::temp_dir().join(format!("obsdeg-limit-{}", std::process::id()));
        let mut worker = scripted(&format!("touch {}; exec sleep 60", folder.display()));
        worker.config.limit = 0;
        for _ in 0..2 {
            assert_eq!(worker.ask(&request()), Err(WorkerError::OverLimit { limit: 0 }));
        }
        assert!(worker.running.is_none() && !folder.exists());
    }

    #[test]
    fn a_missing_program_is_named() {
        let mut worker = scripted("");
        worker.config.program = "/no/such/program".into();
        assert!(matches!(worker.ask(&request()), Err(WorkerError::Start { .. })));
    }
}
