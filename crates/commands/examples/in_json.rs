//! Calls from other languages: a command by its name, options and files as JSON.
//!
//! `cargo run -p obsdeg-commands --example in_json`

#![allow(clippy::print_stdout, reason = "an example shows what it found")]

use obsdeg_commands::{Host, call};
use serde_json::{Value, json};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scheme = "carry = \"inertial\"\n[[position]]\nangles_deg = [0, 0, 0]\n[[position]]\nangles_deg = [180, 0, 0]\n";
    let asked = json!({ "sources": [{ "name": "two.toml", "text": scheme }], "solutions": false });
    let answer = call("analyze", &asked.to_string(), &mut Host::silent())?;
    let answer: Value = serde_json::from_str(&answer.text()?)?;
    println!("two positions, {} carry: rank {}", answer["carry"], answer["rank"]);

    // errors name their place
    let wrong = json!({ "sources": [{ "name": "two.toml", "text": "carry = \"sideways\"\n" }] });
    if let Err(problem) = call("analyze", &wrong.to_string(), &mut Host::silent()) {
        let place = problem.place.as_ref().map(|p| p.line_and_column());
        println!("{problem} at line and column {place:?}");
    }
    Ok(())
}
