//! The extension module of the Python package `obsdeg`: commands by name, options as JSON. Everything else is
//! Python.

use std::cell::RefCell;
use std::fs::File;
use std::hint::black_box;
use std::io::Cursor;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use obsdeg_calibration::record::Record;
use obsdeg_commands::{Answered, Host, Kind, Now, Problem, call, call_allan, call_calibrate};
use obsdeg_exact::interrupt;
use obsdeg_report::Format;
use pyo3::create_exception;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use rayon::{ThreadPool, ThreadPoolBuilder};

create_exception!(
    obsdeg._obsdeg,
    ProblemError,
    PyValueError,
    "What is wrong with a request: `message`, and where, if it is in a text: `file`, `line`, `column` (counted from 1)."
);

/// An answer; it is written when that is asked for.
#[pyclass(frozen, module = "obsdeg._obsdeg")]
struct Answer(Answered);

#[pymethods]
impl Answer {
    /// True if nothing disagrees, and the model explains the records.
    #[getter]
    fn passed(&self) -> bool {
        self.0.passed
    }

    /// Name and version of the layout of the JSON; None of several answers, of a page and of a part of a
    /// search.
    #[getter]
    fn layout(&self) -> Option<&str> {
        self.0.answer.layout()
    }

    /// What the command line prints: `format` is table, json, markdown, csv or latex.
    fn written(&self, py: Python<'_>, format: &str) -> PyResult<String> {
        let format: Format = format.parse().map_err(|e| PyValueError::new_err(format!("{e}")))?;
        py.detach(|| self.0.answer.written(format)).map_err(raised)
    }

    /// A list of the JSON as CSV.
    #[pyo3(signature = (name=None))]
    fn table(&self, py: Python<'_>, name: Option<&str>) -> PyResult<String> {
        py.detach(|| self.0.answer.table(name)).map_err(raised)
    }

    /// A part of an HTML page.
    fn fragment(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| self.0.answer.fragment()).map_err(raised)
    }

    /// Figures, series and schemes that were found, by their names.
    fn files<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let files = py.detach(|| self.0.answer.files()).map_err(raised)?;
        let out = PyDict::new(py);
        for file in files {
            out.set_item(file.name, PyBytes::new(py, &file.bytes))?;
        }
        Ok(out)
    }
}

/// Answers a command; `request` is JSON, `progress` is called with (what, done, total, examined, best) ten
/// times a second at most, and ends the work with the best so far where it returns False. A keyboard
/// interrupt does too; it is raised where there is nothing so far.
#[pyfunction]
#[pyo3(signature = (command, request, progress=None))]
fn answer(py: Python<'_>, command: &str, request: &str, progress: Option<Py<PyAny>>) -> PyResult<Answer> {
    heard(py, command, progress, |host| call(command, request, host))
}

/// Calibrates from records: each a name with the path of a file (CSV or Parquet), or with its bytes.
#[pyfunction]
#[pyo3(signature = (request, records, progress=None))]
fn calibrate(
    py: Python<'_>,
    request: &str,
    records: Vec<(String, Option<Vec<u8>>)>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    heard(py, "calibrate", progress, move |host| {
        let records = records.into_iter().map(record).collect::<Result<Vec<_>, Problem>>()?;
        call_calibrate(request, records, host)
    })
}

/// A record of a name: the file of that path (CSV or Parquet), or its bytes.
fn record((name, bytes): (String, Option<Vec<u8>>)) -> Result<Record, Problem> {
    let unreadable = |e| Problem::input(format!("cannot read the record {name}: {e}"));
    let record = match bytes {
        Some(bytes) => Record::stream(&name, Box::new(Cursor::new(bytes))),
        None => Record::file(&name, File::open(&name).map_err(unreadable)?),
    };
    record.map_err(|e| Problem::input(e.to_string()))
}

/// The noise of sensors at rest, from one record as `calibrate` has them.
#[pyfunction]
#[pyo3(signature = (request, records, progress=None))]
fn allan(
    py: Python<'_>,
    request: &str,
    records: Vec<(String, Option<Vec<u8>>)>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    heard(py, "allan", progress, move |host| {
        let records = records.into_iter().map(record).collect::<Result<Vec<_>, Problem>>()?;
        call_allan(request, records, host)
    })
}

/// Seconds that a command takes when it is asked so many times from Rust, its JSON written or not: what the
/// package adds to that is measured against it (`python/benches/overhead.py`).
#[pyfunction]
fn seconds(py: Python<'_>, command: &str, request: &str, times: u32, written: bool) -> PyResult<f64> {
    py.detach(|| {
        let start = Instant::now();
        for _ in 0..times {
            let answered = call(command, request, &mut Host::silent())?;
            if written {
                black_box(answered.text()?);
            }
            black_box(answered.passed);
        }
        Ok(start.elapsed().as_secs_f64())
    })
    .map_err(raised)
}

/// Between two times that Python hears of progress, or is asked whether a key was pressed.
const INTERVAL: Duration = Duration::from_millis(100);

/// Commands that work on several threads. Those with `true` end by themselves, with the best so far.
const PARALLEL: [(&str, bool); 6] = [
    ("calibrate", true),
    ("compare", false),
    ("crosscheck", true),
    ("design", true),
    ("report", true),
    ("simulate", false),
];

/// The threads of parallel work, and the process that they belong to: of work that is cut short, and of work
/// that ends by itself, which must not run beside it on one thread.
static THREADS: [Mutex<Option<(u32, &'static ThreadPool)>>; 2] = [const { Mutex::new(None) }; 2];

/// The threads of this process. A process that began as a copy of another (`fork`) has none of its threads,
/// and waits for ever for what they are given; it has new ones here. This needs the lock of the interpreter,
/// under which Python forks: no copy is made while the mutex is held.
fn threads(_py: Python<'_>, ends: bool) -> PyResult<&'static ThreadPool> {
    let failed = |why: String| PyRuntimeError::new_err(format!("no threads: {why}"));
    let mut threads = THREADS[usize::from(ends)].lock().map_err(|e| failed(e.to_string()))?;
    let process = std::process::id();
    match *threads {
        Some((owner, pool)) if owner == process => Ok(pool),
        _ => {
            let pool = ThreadPoolBuilder::new().build().map_err(|e| failed(e.to_string()))?;
            // for the life of the process; that of the process before cannot be ended here
            let pool: &'static ThreadPool = Box::leak(Box::new(pool));
            *threads = Some((process, pool));
            Ok(pool)
        }
    }
}

/// Works without the lock of the interpreter. Ten times a second whoever called hears how far it is, and is
/// asked whether a key was pressed and the work goes on.
fn heard(
    py: Python<'_>,
    command: &str,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&mut Host<'_>) -> Result<Answered, Problem> + Send,
) -> PyResult<Answer> {
    match PARALLEL.iter().find(|c| c.0 == command) {
        Some(&(_, ends)) => in_threads(py, progress, ends, work),
        None => in_this_thread(py, command, progress, work),
    }
}

/// Asks Python: a key pressed is an error, a `progress` that says False is false.
fn goes_on(progress: Option<&Py<PyAny>>, now: Option<Now>) -> PyResult<bool> {
    Python::attach(|py| {
        py.check_signals()?;
        let (Some(progress), Some(now)) = (progress, now) else { return Ok(true) };
        let said = progress.call1(py, (now.what, now.done, now.total, now.examined, now.best))?;
        Ok(!said.extract::<bool>(py).is_ok_and(|goes_on| !goes_on))
    })
}

/// Work that was ended and has no answer.
fn interrupted() -> PyErr {
    PyKeyboardInterrupt::new_err("interrupted; there is no answer")
}

/// Short work, which no other thread is begun for: it asks Python itself.
fn in_this_thread(
    py: Python<'_>,
    command: &str,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&mut Host<'_>) -> Result<Answered, Problem> + Send,
) -> PyResult<Answer> {
    let what = format!("{command}, tenths of a second");
    let (done, inside) = py.detach(move || {
        let inside: Rc<RefCell<Option<PyErr>>> = Rc::default();
        let said = inside.clone();
        let mut asked = 0;
        let ask = move || {
            asked += 1;
            let now = Now { what: what.clone(), done: asked, total: None, examined: None, best: None };
            goes_on(progress.as_ref(), Some(now)).unwrap_or_else(|e| {
                said.replace(Some(e));
                false
            })
        };
        (interrupt::hearing(INTERVAL, ask, || work(&mut Host::silent())), inside.take())
    });
    match (done, inside) {
        (_, Some(e)) => Err(e),
        (None, None) => Err(interrupted()),
        (Some(done), None) => done.map(Answer).map_err(raised),
    }
}

/// Work on all threads; this one, which may be the only one that hears of keys, asks Python. Where the work
/// `ends` by itself it is told so, and gives what it has; else it is cut short.
fn in_threads(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    ends: bool,
    work: impl FnOnce(&mut Host<'_>) -> Result<Answered, Problem> + Send,
) -> PyResult<Answer> {
    let pool = threads(py, ends)?;
    let wanted = Arc::new(AtomicBool::new(true));
    let last: Mutex<Option<Now>> = Mutex::new(None);
    let going = |now: Now| {
        // of several at once one is enough
        if let Ok(mut last) = last.try_lock() {
            *last = Some(now);
        }
        wanted.load(Ordering::Relaxed)
    };
    let answered = || {
        let mut host = Host { worker: None, going: &going };
        if ends {
            return Some(work(&mut host));
        }
        interrupt::while_wanted(wanted.clone(), || work(&mut host))
    };
    let (done, inside) = py.detach(|| {
        std::thread::scope(|scope| {
            let (send, receive) = channel();
            scope.spawn(move || {
                // nobody listens only if this function has ended
                let _ = send.send(pool.install(answered));
            });
            let mut inside = None;
            let mut asked = 0;
            loop {
                match receive.recv_timeout(INTERVAL) {
                    Ok(done) => return (Some(done), inside),
                    Err(RecvTimeoutError::Disconnected) => return (None, inside),
                    Err(RecvTimeoutError::Timeout) if inside.is_some() => {}
                    Err(RecvTimeoutError::Timeout) => {
                        asked += 1;
                        let silent = Now {
                            what: "tenths of a second".into(),
                            done: asked,
                            total: None,
                            examined: None,
                            best: None,
                        };
                        let now =
                            last.lock().ok().and_then(|mut last| last.take()).or((!ends).then_some(silent));
                        match goes_on(progress.as_ref(), now) {
                            Ok(true) => {}
                            Ok(false) => wanted.store(false, Ordering::Relaxed),
                            Err(e) => {
                                wanted.store(false, Ordering::Relaxed);
                                inside = Some(e);
                            }
                        }
                    }
                }
            }
        })
    });
    match (done, inside) {
        (None, _) => Err(PyRuntimeError::new_err("the work ended without an answer")),
        (Some(Some(Ok(answer))), None) => Ok(Answer(answer)),
        // the best so far
        (Some(Some(Ok(answer))), Some(e)) if e.is_instance_of::<PyKeyboardInterrupt>(py) => {
            Ok(Answer(answer))
        }
        (Some(_), Some(e)) => Err(e),
        (Some(None), None) => Err(interrupted()),
        (Some(Some(Err(problem))), None) => Err(raised(problem)),
    }
}

/// A problem as Python has it.
fn raised(problem: Problem) -> PyErr {
    match problem.kind {
        Kind::Interrupted => PyKeyboardInterrupt::new_err(problem.message),
        Kind::Internal => PyRuntimeError::new_err(problem.message),
        Kind::Input => Python::attach(|py| {
            let place = problem.place.as_ref().map(|p| (p.name.clone(), p.line_and_column()));
            let text = match &place {
                Some((name, (line, column))) => {
                    format!("{} ({name}, line {line}, column {column})", problem.message)
                }
                None => problem.message.clone(),
            };
            let error = ProblemError::new_err(text);
            let value = error.value(py);
            let (file, at) = place.unzip();
            let (line, column) = at.unzip();
            let set = value
                .setattr("message", problem.message)
                .and_then(|()| value.setattr("file", file))
                .and_then(|()| value.setattr("line", line))
                .and_then(|()| value.setattr("column", column));
            match set {
                Ok(()) => error,
                Err(e) => e,
            }
        }),
    }
}

/// The extension module.
#[pymodule]
fn _obsdeg(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("ProblemError", m.py().get_type::<ProblemError>())?;
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add("COMMANDS", obsdeg_commands::COMMANDS.to_vec())?;
    m.add_class::<Answer>()?;
    m.add_function(wrap_pyfunction!(answer, m)?)?;
    m.add_function(wrap_pyfunction!(allan, m)?)?;
    m.add_function(wrap_pyfunction!(calibrate, m)?)?;
    m.add_function(wrap_pyfunction!(seconds, m)?)
}
