//! Functions of the extension module: commands by name, options as JSON. Everything else is
//! Python.

use std::cell::RefCell;
use std::fs::File;
use std::hint::black_box;
use std::io::Cursor;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use obsdeg_calibration::record::Record;
use obsdeg_commands::{Answered, Host, Now, Problem, ProblemKind, call, call_allan, call_calibrate};
use obsdeg_exact::interrupt;
use obsdeg_report::Format;
use pyo3::create_exception;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use rayon::{ThreadPool, ThreadPoolBuilder};

create_exception!(
    obsdeg,
    ProblemError,
    PyValueError,
    "What is wrong with a request: `message`, and where, if it is in a text: `file`, `line`, `column` (counted from 1)."
);

/// An answer; formats are written on request.
#[pyclass(frozen, module = "obsdeg._obsdeg")]
struct Answer(Answered);

#[pymethods]
impl Answer {
    /// True if no check disagrees and the model explains the records.
    #[getter]
    fn passed(&self) -> bool {
        self.0.passed
    }

    /// Name and version of the JSON layout; None for several answers, a page or a part of a search.
    #[getter]
    fn layout(&self) -> Option<&str> {
        self.0.answer.layout()
    }

    /// Text as the command line prints it; `format` is table, json, markdown, csv or latex.
    fn written(&self, py: Python<'_>, format: &str) -> PyResult<String> {
        let format: Format = format.parse().map_err(|e| PyValueError::new_err(format!("{e}")))?;
        py.detach(|| self.0.answer.written(format)).map_err(raised)
    }

    /// One list of the JSON as CSV.
    #[pyo3(signature = (name=None))]
    fn table(&self, py: Python<'_>, name: Option<&str>) -> PyResult<String> {
        py.detach(|| self.0.answer.table(name)).map_err(raised)
    }

    /// A part of an HTML page.
    fn fragment(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| self.0.answer.fragment()).map_err(raised)
    }

    /// Series, found schemes and, unless `pictures` is false, figures, by file name.
    #[pyo3(signature = (pictures=true))]
    fn files<'py>(&self, py: Python<'py>, pictures: bool) -> PyResult<Bound<'py, PyDict>> {
        let files = py.detach(|| self.0.answer.files(pictures)).map_err(raised)?;
        let out = PyDict::new(py);
        for file in files {
            out.set_item(file.name, PyBytes::new(py, &file.bytes))?;
        }
        Ok(out)
    }
}

/// Answers a command. `request` is JSON. `progress` is called with (what, done, total, examined, best) at
/// most ten times a second; if it returns False, the work ends with the best so far. So does a keyboard
/// interrupt, which is raised if there is no partial result.
#[pyfunction]
#[pyo3(signature = (command, request, progress=None))]
fn answer(py: Python<'_>, command: &str, request: &str, progress: Option<Py<PyAny>>) -> PyResult<Answer> {
    with_progress(py, command, progress, |host| call(command, request, host))
}

/// Calibrates from records. Each is a name with the path of a file (CSV or Parquet), or with its bytes.
#[pyfunction]
#[pyo3(signature = (request, records, progress=None))]
fn calibrate(
    py: Python<'_>,
    request: &str,
    records: Vec<(String, Option<Vec<u8>>)>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    with_progress(py, "calibrate", progress, move |host| {
        let records = records.into_iter().map(record).collect::<Result<Vec<_>, Problem>>()?;
        call_calibrate(request, records, host)
    })
}

/// Opens a record: the file at the path `name` (CSV or Parquet), or its bytes.
fn record((name, bytes): (String, Option<Vec<u8>>)) -> Result<Record, Problem> {
    let unreadable = |e| Problem::input(format!("cannot read the record {name}: {e}"));
    let record = match bytes {
        Some(bytes) => Record::stream(&name, Box::new(Cursor::new(bytes))),
        None => Record::file(&name, File::open(&name).map_err(unreadable)?),
    };
    record.map_err(|e| Problem::input(e.to_string()))
}

/// Noise of sensors at rest, from one record given as in `calibrate`.
#[pyfunction]
#[pyo3(signature = (request, records, progress=None))]
fn allan(
    py: Python<'_>,
    request: &str,
    records: Vec<(String, Option<Vec<u8>>)>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Answer> {
    with_progress(py, "allan", progress, move |host| {
        let records = records.into_iter().map(record).collect::<Result<Vec<_>, Problem>>()?;
        call_allan(request, records, host)
    })
}

/// Seconds that `times` calls of a command take in Rust; `written`: true if the JSON is written too.
/// Reference for the overhead of the package (`python/benches/overhead.py`).
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

/// Time between two calls of `progress` or two checks for a keyboard interrupt.
const INTERVAL: Duration = Duration::from_millis(100);

/// Commands that work on several threads. `true`: the command ends by itself when asked, with the best so
/// far.
const PARALLEL: [(&str, bool); 6] = [
    ("calibrate", true),
    ("compare", false),
    ("crosscheck", true),
    ("design", true),
    ("report", true),
    ("simulate", false),
];

/// Thread pools of parallel work, each with the process it belongs to. The first is for work that is cut
/// short, the second for work that ends by itself: the two kinds of work must not share a thread.
static THREADS: [Mutex<Option<(u32, &'static ThreadPool)>>; 2] = [const { Mutex::new(None) }; 2];

/// Thread pool of this process. A forked process has none of its parent's threads and would wait for ever for
/// their results, so it makes a new pool. The interpreter's lock is held here and during a fork: no process
/// is forked while the mutex is locked.
fn threads(_py: Python<'_>, ends: bool) -> PyResult<&'static ThreadPool> {
    let failed = |why: String| PyRuntimeError::new_err(format!("no threads: {why}"));
    let mut threads = THREADS[usize::from(ends)].lock().map_err(|e| failed(e.to_string()))?;
    let process = std::process::id();
    match *threads {
        Some((owner, pool)) if owner == process => Ok(pool),
        _ => {
            let pool = ThreadPoolBuilder::new().build().map_err(|e| failed(e.to_string()))?;
            // lives as long as the process; the parent's pool cannot be ended here
            let pool: &'static ThreadPool = Box::leak(Box::new(pool));
            *threads = Some((process, pool));
            Ok(pool)
        }
    }
}

/// Works without the interpreter's lock. Ten times a second Python receives the progress and is asked for a
/// keyboard interrupt and for the return value of `progress`.
fn with_progress(
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

/// Asks Python: a keyboard interrupt is an error; false if `progress` returns False.
fn goes_on(progress: Option<&Py<PyAny>>, now: Option<Now>) -> PyResult<bool> {
    Python::attach(|py| {
        py.check_signals()?;
        let (Some(progress), Some(now)) = (progress, now) else { return Ok(true) };
        let said = progress.call1(py, (now.what, now.done, now.total, now.examined, now.best))?;
        Ok(!said.extract::<bool>(py).is_ok_and(|goes_on| !goes_on))
    })
}

/// Error of work that was ended without an answer.
fn interrupted() -> PyErr {
    PyKeyboardInterrupt::new_err("interrupted; there is no answer")
}

/// Short work on this thread, which asks Python itself.
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

/// Work on all threads. This thread asks Python, since only the main thread receives keyboard interrupts.
/// With `ends`, the work ends by itself and gives its partial result; otherwise it is cut short.
fn in_threads(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    ends: bool,
    work: impl FnOnce(&mut Host<'_>) -> Result<Answered, Problem> + Send,
) -> PyResult<Answer> {
    let pool = threads(py, ends)?;
    let wanted = Arc::new(AtomicBool::new(true));
    let last: Mutex<Option<Now>> = Mutex::new(None);
    let report = |now: Now| {
        // of several reports at a time one is enough
        if let Ok(mut last) = last.try_lock() {
            *last = Some(now);
        }
        wanted.load(Ordering::Relaxed)
    };
    let answered = || {
        let mut host = Host { worker: None, progress: &report };
        if ends {
            return Some(work(&mut host));
        }
        interrupt::while_wanted(wanted.clone(), || work(&mut host))
    };
    let (done, inside) = py.detach(|| {
        std::thread::scope(|scope| {
            let (send, receive) = channel();
            scope.spawn(move || {
                // the receiver is gone only if this function has returned
                let _ = send.send(pool.install(answered));
            });
            waited(&receive, progress.as_ref(), &last, &wanted, ends)
        })
    });
    outcome(py, done, inside)
}

/// Result of work on other threads; `None` if it was cut short.
type Done = Option<Result<Answered, Problem>>;

/// Waits for the work, and asks Python ten times a second, until Python raises an error. Gives the result,
/// `None` if the work ended without one, and the error.
fn waited(
    receive: &Receiver<Done>,
    progress: Option<&Py<PyAny>>,
    last: &Mutex<Option<Now>>,
    wanted: &AtomicBool,
    ends: bool,
) -> (Option<Done>, Option<PyErr>) {
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
                let now = last.lock().ok().and_then(|mut last| last.take()).or((!ends).then_some(silent));
                match goes_on(progress, now) {
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
}

/// Answer from the result of the work and the error that Python raised meanwhile.
fn outcome(py: Python<'_>, done: Option<Done>, inside: Option<PyErr>) -> PyResult<Answer> {
    match (done, inside) {
        (None, _) => Err(PyRuntimeError::new_err("the work ended without an answer")),
        (Some(Some(Ok(answer))), None) => Ok(Answer(answer)),
        // the partial result
        (Some(Some(Ok(answer))), Some(e)) if e.is_instance_of::<PyKeyboardInterrupt>(py) => {
            Ok(Answer(answer))
        }
        (Some(_), Some(e)) => Err(e),
        (Some(None), None) => Err(interrupted()),
        (Some(Some(Err(problem))), None) => Err(raised(problem)),
    }
}

/// A problem as a Python exception.
fn raised(problem: Problem) -> PyErr {
    match problem.kind {
        ProblemKind::Interrupted => PyKeyboardInterrupt::new_err(problem.message),
        ProblemKind::Internal => PyRuntimeError::new_err(problem.message),
        ProblemKind::Input => Python::attach(|py| {
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

/// Extension module `obsdeg._obsdeg`.
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
