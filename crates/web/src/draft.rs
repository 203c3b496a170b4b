//! Draft of the page: its engine is this program, compiled in seconds where WebAssembly takes minutes. The
//! page asks it over a socket of this machine.

use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::engine;

/// Time after which a command ends whose progress nobody took: its question was dropped.
const PATIENCE: Duration = Duration::from_secs(2);

/// Progress of a command that was sent and not yet taken.
struct Untaken {
    count: usize,
    /// Time at which progress was last taken, or could first be.
    since: Instant,
}

/// A command at work.
struct RunningCommand {
    /// Progress of the command, then its answer.
    receiver: Receiver<Value>,
    untaken: Arc<Mutex<Untaken>>,
}

/// Commands at work.
#[derive(Default)]
struct Works {
    /// Number of commands that were begun.
    begun: u64,
    /// Each by its number.
    works: BTreeMap<u64, RunningCommand>,
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Answers the draft's questions until the standard input ends.
pub(crate) fn serve(listener: TcpListener) {
    let works = Arc::<Mutex<Works>>::default();
    thread::spawn(move || {
        for stream in listener.incoming().filter_map(Result::ok) {
            let works = Arc::clone(&works);
            // a page that is closed takes no answer
            thread::spawn(move || respond(&stream, &works).ok());
        }
    });
    // the end of the input, or an error, ends the program
    let _ = io::copy(&mut io::stdin(), &mut io::sink());
}

/// Reads one question, `POST /FUNCTION` with its arguments as a JSON list of texts, and writes the answer.
fn respond(mut stream: &TcpStream, works: &Mutex<Works>) -> io::Result<()> {
    let mut reader = BufReader::new(stream);
    let mut line = String::new();
    reader.read_line(&mut line)?;
    let function = line.split(' ').nth(1).unwrap_or_default().trim_start_matches('/').to_string();
    let mut length = 0;
    loop {
        line.clear();
        reader.read_line(&mut line)?;
        let Some((name, value)) = line.split_once(':') else { break };
        if name.eq_ignore_ascii_case("content-length") {
            length = value.trim().parse().unwrap_or(0);
        }
    }
    let mut body = String::new();
    reader.take(length).read_to_string(&mut body)?;
    let arguments: Vec<Value> = serde_json::from_str(&body).unwrap_or_default();
    let text = |k: usize| arguments.get(k).and_then(Value::as_str).unwrap_or_default();
    let out = match function.as_str() {
        "call" => begin(text(0).into(), text(1).into(), works).to_string(),
        "next" => next(arguments.first().and_then(Value::as_u64).unwrap_or(0), works).to_string(),
        "toml_as_json" => engine::toml_as_json(text(0)),
        "mathml" => engine::mathml(text(0)),
        "solution_mathml" => engine::solution_mathml(text(0)),
        _ => return stream.write_all(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n"),
    };
    let head = format!(
        "HTTP/1.1 200 OK\r\nAccess-Control-Allow-Origin: *\r\nContent-Type: text/plain; charset=utf-8\r\n\
         Content-Length: {}\r\nConnection: close\r\n\r\n",
        out.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(out.as_bytes())
}

/// Begins a command; returns its first progress, or its answer.
fn begin(command: String, request: String, works: &Mutex<Works>) -> Value {
    let (sender, receiver) = channel();
    let untaken = Arc::new(Mutex::new(Untaken { count: 0, since: Instant::now() }));
    let number = {
        let mut works = lock(works);
        works.begun += 1;
        let number = works.begun;
        works.works.insert(number, RunningCommand { receiver, untaken: Arc::clone(&untaken) });
        number
    };
    thread::spawn(move || {
        let sender = Mutex::new(sender);
        let out = engine::call(&command, &request, &|now| {
            let mut untaken = lock(&untaken);
            if untaken.count == 0 {
                untaken.since = Instant::now();
            }
            untaken.count += 1;
            untaken.since.elapsed() < PATIENCE
                && lock(&sender).send(json!({ "work": number, "going": now })).is_ok()
        });
        lock(&sender).send(json!({ "work": number, "out": out }))
    });
    next(number, works)
}

/// Latest progress of a command, or its answer, which ends it; waits for the next where all was taken.
fn next(number: u64, works: &Mutex<Works>) -> Value {
    let taken = lock(works).works.remove(&number);
    let ended = json!({ "work": number, "out": "" });
    let Some(work) = taken else { return ended };
    let first = work.receiver.recv().unwrap_or(ended);
    let mut untaken = lock(&work.untaken);
    let said = work.receiver.try_iter().last().unwrap_or(first);
    *untaken = Untaken { count: 0, since: Instant::now() };
    drop(untaken);
    if said.get("going").is_some() {
        lock(works).works.insert(number, work);
    }
    said
}
