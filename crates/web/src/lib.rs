//! What the page's worker calls: the commands, and what only a page needs of texts.
#![cfg(target_arch = "wasm32")]

use obsdeg_commands::{Host, Now, Problem};
use serde_json::{Value, json};
use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
extern "C" {
    /// Of the worker: hears how far the work is, as JSON; false ends it.
    fn going(now: &str) -> bool;
}

/// A command by its name, with options and files as JSON. The answer is `{"text", "sentences", "passed"}`:
/// the text is the command line's with `--format json`, the sentences are its first lines; or `{"problem":
/// {"kind", "message", "place"}}`.
#[wasm_bindgen]
pub fn call(command: &str, request: &str) -> String {
    let hears = |now: Now| going(&serde_json::to_string(&now).unwrap_or_default());
    let mut host = Host { worker: None, going: &hears };
    match obsdeg_commands::call_json(command, request, &mut host) {
        Ok(a) => json!({ "text": a.text, "sentences": a.sentences, "passed": a.passed }),
        Err(problem) => json!({ "problem": said(&problem) }),
    }
    .to_string()
}

/// A problem, with the line and the column of its place.
fn said(problem: &Problem) -> Value {
    let place = problem.place.as_ref().map(|p| {
        let (line, column) = p.line_and_column();
        let count = |end: usize| p.text.get(..end).map_or(0, |t| t.encode_utf16().count());
        json!({ "name": p.name, "line": line, "column": column,
            // in the units of a page's texts
            "start": count(p.span.start), "end": count(p.span.end) })
    });
    json!({ "kind": problem.kind, "message": problem.message, "place": place })
}

/// TOML as JSON, or `{"problem": ...}` where it is none.
#[wasm_bindgen]
pub fn toml_as_json(text: &str) -> String {
    match toml::from_str::<Value>(text) {
        Ok(value) => json!({ "value": value }),
        Err(e) => {
            let problem = Problem::at(e.message(), "", text, e.span().unwrap_or(0..0));
            json!({ "problem": said(&problem) })
        }
    }
    .to_string()
}

/// An expression of an answer, such as `1/2 [ Z1@p1 + wU*psi_y ]`, as MathML; empty where it cannot be
/// typeset.
#[wasm_bindgen]
pub fn mathml(expression: &str) -> String {
    obsdeg_report::mathml(expression).unwrap_or_default()
}

/// A solution of an answer as MathML: its terms as JSON, `[{"coefficient", "observation", "station"}]`; empty
/// where it cannot be typeset.
#[wasm_bindgen]
pub fn solution_mathml(terms: &str) -> String {
    let terms: Vec<Value> = serde_json::from_str(terms).unwrap_or_default();
    let parts = ["coefficient", "observation", "station"];
    let terms: Vec<[&str; 3]> =
        terms.iter().map(|t| parts.map(|part| t[part].as_str().unwrap_or_default())).collect();
    obsdeg_report::solution_mathml(&terms).unwrap_or_default()
}
