//! Draft of the page: its engine is this program, which is compiled in seconds where WebAssembly takes minutes.
//! The page asks it over a socket of this machine.

use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use serde_json::{Value, json};

use crate::engine;

/// Commands at work.
#[derive(Default)]
struct Works {
    /// Number of commands that were begun.
    begun: u64,
    /// Progress of each, then its answer, by its number.
    receivers: BTreeMap<u64, Receiver<Value>>,
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
    // progress that nobody takes, since the question was dropped, holds the command up
    let (sender, receiver) = sync_channel(1);
    let work = {
        let mut works = works.lock().unwrap_or_else(PoisonError::into_inner);
        works.begun += 1;
        let work = works.begun;
        works.receivers.insert(work, receiver);
        work
    };
    thread::spawn(move || {
        let out = engine::call(&command, &request, &|now| {
            sender.send(json!({ "work": work, "going": now })).is_ok()
        });
        sender.send(json!({ "work": work, "out": out }))
    });
    next(work, works)
}

/// Next progress of a command, or its answer, which ends it.
fn next(work: u64, works: &Mutex<Works>) -> Value {
    let lock = || works.lock().unwrap_or_else(PoisonError::into_inner);
    let taken = lock().receivers.remove(&work);
    let ended = json!({ "work": work, "out": "" });
    let Some(receiver) = taken else { return ended };
    let said = receiver.recv().unwrap_or(ended);
    if said.get("going").is_some() {
        lock().receivers.insert(work, receiver);
    }
    said
}
