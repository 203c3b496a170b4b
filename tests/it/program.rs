//! Runs of the program as a process, in the root of the repository.

use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

pub(crate) fn obsdeg(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_obsdeg"));
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments).stdin(Stdio::null());
    // independent of the locale of the machine
    command.env_remove("LC_ALL").env_remove("LC_CTYPE").env("LANG", "C.UTF-8");
    command
}

pub(crate) fn run(arguments: &[&str]) -> Output {
    obsdeg(arguments).output().expect("it runs")
}

pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("UTF-8")
}

/// Parsed JSON output of a command that succeeds.
pub(crate) fn json(arguments: &[&str]) -> Value {
    let output = run(arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Asserts that a command is refused with a message that contains all given parts, and prints nothing on
/// stdout.
pub(crate) fn refused(arguments: &[&str], expected: &[&str]) {
    let output = run(arguments);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    for part in expected {
        assert!(message.contains(part), "{arguments:?}: {message}");
    }
}

/// Number of cases of a test: the first every day, the second with `AT_LENGTH=1`, as `.ci/run release` sets
/// it.
pub(crate) fn cases(daily: usize, all: usize) -> usize {
    if std::env::var_os("AT_LENGTH").is_some() { all } else { daily }
}

pub(crate) fn scratch() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("verdicts.json");
    (folder, file)
}
