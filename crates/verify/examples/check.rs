//! Checks a certificate: `cargo run -p obsdeg-verify --example check -- c.json [scheme.toml]`.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "an example")]

use std::process::ExitCode;

fn main() -> ExitCode {
    let mut paths = std::env::args().skip(1);
    let read = |path: String| std::fs::read(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let certificate = paths.next().map(read).expect("a certificate");
    let scheme = paths.next().map(read).map(|bytes| String::from_utf8(bytes).expect("a scheme in UTF-8"));
    match obsdeg_verify::verify(&certificate, scheme.as_deref()) {
        Ok(sentences) => {
            sentences.iter().for_each(|s| println!("{s}"));
            ExitCode::SUCCESS
        }
        Err(refused) => {
            eprintln!("refused: {refused}");
            ExitCode::FAILURE
        }
    }
}
