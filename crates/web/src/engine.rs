//! Engine of the page as functions from text to text: the commands, and texts that only a page needs.

use obsdeg_commands::{Host, Now, Problem};
use serde_json::{Value, json};

/// Answer to a command by its name, with options and files as JSON: `{"text", "sentences", "explanations",
/// "passed"}`. `text` is that of the command line with `--format json`, `sentences` are its first lines,
/// `explanations` those of single verdicts (`why`) in words. A failure is `{"problem": {"kind", "message",
/// "place"}}`. `going` receives progress; it returns false to end the work.
pub(crate) fn call(command: &str, request: &str, going: &(dyn Fn(Now) -> bool + Sync)) -> String {
    let mut host = Host { worker: None, progress: going };
    match obsdeg_commands::call_json(command, request, &mut host) {
        Ok(a) => json!({
            "text": a.text, "sentences": a.sentences, "explanations": a.explanations, "passed": a.passed
        }),
        Err(problem) => json!({ "problem": problem_json(&problem) }),
    }
    .to_string()
}

/// A problem as JSON, with line and column of its place.
fn problem_json(problem: &Problem) -> Value {
    let place = problem.place.as_ref().map(|p| {
        let (line, column) = p.line_and_column();
        let count = |end: usize| p.text.get(..end).map_or(0, |t| t.encode_utf16().count());
        json!({ "name": p.name, "line": line, "column": column,
            // offsets in UTF-16 units, as in the page's texts
            "start": count(p.span.start), "end": count(p.span.end) })
    });
    json!({ "kind": problem.kind, "message": problem.message, "place": place })
}

/// TOML as JSON, or `{"problem": ...}` if the text is no TOML.
pub(crate) fn toml_as_json(text: &str) -> String {
    match toml::from_str::<Value>(text) {
        Ok(value) => json!({ "value": value }),
        Err(e) => {
            let problem = Problem::at(e.message(), "", text, e.span().unwrap_or(0..0));
            json!({ "problem": problem_json(&problem) })
        }
    }
    .to_string()
}

/// An expression of an answer, such as `1/2 [ Z1@p1 + wU*psi_y ]`, as MathML; empty where it cannot be
/// typeset.
pub(crate) fn mathml(expression: &str) -> String {
    obsdeg_report::mathml(expression).unwrap_or_default()
}

/// A solution of an answer as MathML: its terms as JSON, `[{"coefficient", "observation", "station"}]`; empty
/// where it cannot be typeset.
pub(crate) fn solution_mathml(terms: &str) -> String {
    let terms: Vec<Value> = serde_json::from_str(terms).unwrap_or_default();
    let parts = ["coefficient", "observation", "station"];
    let terms: Vec<[&str; 3]> =
        terms.iter().map(|t| parts.map(|part| t[part].as_str().unwrap_or_default())).collect();
    obsdeg_report::solution_mathml(&terms).unwrap_or_default()
}
