//! Answers without the solutions that need the symbolic engine, because other processes held it.

use obsdeg_symbolic::WorkerError;
use schemars::JsonSchema;
use serde::Serialize;

/// Mark of an answer without the solutions that need the symbolic engine, because other processes held it.
/// The verdicts do not depend on it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct EngineBusy {
    /// Time after which the wait for the engine ended, in s.
    pub waited_s: u64,
    /// Advice on how to get the missing solutions.
    pub advice: String,
}

impl EngineBusy {
    /// Mark for a failure of the worker; `None` if the failure has another reason than a busy engine.
    pub(crate) fn of(failure: &WorkerError) -> Option<Self> {
        let WorkerError::Busy { seconds } = failure else { return None };
        let advice = "Run the command again, or wait longer (--engine-wait).".into();
        Some(Self { waited_s: *seconds, advice })
    }
}
