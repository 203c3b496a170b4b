//! Any text as the right-hand side of a small system.
#![no_main]

use libfuzzer_sys::fuzz_target;
use obsdeg_core::language::{Names, parse, parse_with};
use obsdeg_core::system::{json, judge};

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let _ = parse(text);
    if parse_with(text, Names::Plain).is_err() || text.contains(['"', '\\']) || text.chars().any(char::is_control) {
        return;
    }
    let model = format!(
        r#"{{"name": "f", "states": ["x", "y"], "params": ["a", "n"], "equations": {{"x": "{text}", "y": "x"}}, "outputs": {{"z": "y"}}}}"#
    );
    if let Ok(model) = json::read(&model) {
        let _ = judge(&model, 1, Some(5));
    }
});
