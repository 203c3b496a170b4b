//! Functions that the page's worker calls.
#![cfg(target_arch = "wasm32")]

mod engine;

use wasm_bindgen::prelude::wasm_bindgen;

#[wasm_bindgen]
extern "C" {
    /// Function of the worker that receives progress as JSON; it returns false to end the work.
    fn going(now: &str) -> bool;
}

/// Answer to a command by its name, as JSON; see `engine.rs`.
#[wasm_bindgen]
pub fn call(command: &str, request: &str) -> String {
    engine::call(command, request, &|now| going(&serde_json::to_string(&now).unwrap_or_default()))
}

/// TOML as JSON, or `{"problem": ...}` if the text is no TOML.
#[wasm_bindgen]
pub fn toml_as_json(text: &str) -> String {
    engine::toml_as_json(text)
}

/// An expression of an answer as MathML; empty where it cannot be typeset.
#[wasm_bindgen]
pub fn mathml(expression: &str) -> String {
    engine::mathml(expression)
}

/// A solution of an answer as MathML, its terms as JSON; empty where it cannot be typeset.
#[wasm_bindgen]
pub fn solution_mathml(terms: &str) -> String {
    engine::solution_mathml(terms)
}
