//! Checkers in Python, `tools/verify_certificate.py` and those beside it.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::json;

/// Process of the checker in Python, which checks one certificate after the other.
pub(crate) struct Python {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

const DRIVER: &str = r#"
import json, sys
sys.path.insert(0, sys.argv[1])
sys.dont_write_bytecode = True
from verify_certificate import Refused, verify
for line in sys.stdin:
    certificate, scheme, *replay = json.loads(line)
    try:
        answer = [True, "\n".join(verify(certificate.encode(), scheme, *replay))]
    except Refused as e:
        answer = [False, str(e)]
    print(json.dumps(answer), flush=True)
"#;

impl Python {
    /// Starts the checker; `None` without Python 3.11.
    pub(crate) fn start() -> Option<Self> {
        let probe = Command::new("python3").args(["-c", "import tomllib"]).stderr(Stdio::null()).status();
        if !probe.is_ok_and(|s| s.success()) {
            eprintln!("skipped: no python3 with tomllib");
            return None;
        }
        let tools = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tools");
        let mut child = Command::new("python3")
            .args(["-c", DRIVER])
            .arg(tools)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("python3 starts");
        let input = child.stdin.take().expect("a pipe");
        let output = BufReader::new(child.stdout.take().expect("a pipe"));
        Some(Self { child, input, output })
    }

    /// True if the certificate is accepted, and the printed text.
    pub(crate) fn asks(&mut self, certificate: &str, scheme: Option<&str>) -> (bool, String) {
        self.answers(certificate, &json!([certificate, scheme, 1_000_000]))
    }

    /// Result as [`Self::asks`] for an optimum, with `blocks` blocks searched again that `seed`
    /// chooses.
    pub(crate) fn replays(&mut self, certificate: &str, blocks: usize, seed: u64) -> (bool, String) {
        self.answers(certificate, &json!([certificate, null, blocks, seed]))
    }

    fn answers(&mut self, certificate: &str, asked: &serde_json::Value) -> (bool, String) {
        writeln!(self.input, "{asked}").expect("written");
        let mut line = String::new();
        self.output.read_line(&mut line).expect("an answer");
        serde_json::from_str(&line).unwrap_or_else(|e| panic!("{e}: {line:?} about {certificate}"))
    }
}

impl Drop for Python {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
