//! The worker side: Symbolica behind [`serve`].

mod derive;
mod factor;
mod solve;
mod tower;
mod unknowns;

use std::io::{BufRead, Write};

use crate::protocol::{Job, PREFIX, Request, Response};
use tower::Tower;

/// Why a job failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum JobError {
    /// A text is no rational function of the announced symbols.
    #[error("`{text}` is not a rational function of the announced symbols")]
    NotAnElement { text: String },
    /// Rows or columns of different lengths.
    #[error("the {what} has {found} entries, expected {expected}")]
    Shape { what: &'static str, found: usize, expected: usize },
    /// No solution, or more than one.
    #[error("the system is {0} over the field of its symbols")]
    NotUnique(&'static str),
    /// The solution does not satisfy the check.
    #[error("the solution failed its verification by substitution")]
    NotVerified,
}

/// Answers requests, one per line, until the input ends. Whatever the engine itself writes to stdout
/// has no [`PREFIX`].
///
/// # Errors
/// Whatever `input` or `output` report.
pub fn serve(input: impl BufRead, mut output: impl Write) -> std::io::Result<()> {
    for line in input.lines() {
        let response = match serde_json::from_str::<Request>(&line?) {
            Ok(request) => answer(&request),
            Err(e) => Response::Failed { reason: format!("the request is malformed: {e}") },
        };
        let text = serde_json::to_string(&response)?;
        writeln!(output, "{PREFIX}{text}")?;
        output.flush()?;
    }
    Ok(())
}

fn answer(request: &Request) -> Response {
    let tower = Tower::new(&request.symbols, &request.generators, &request.angles);
    let result = tower.and_then(|tower| match &request.job {
        Job::Solve { system, check } => solve::solve(&tower, system, check.as_ref()),
        Job::Derive { dynamics, order } => derive::formulas(dynamics, *order).map(|v| (v, false)),
        Job::Unknowns { system } => unknowns::unknowns(&tower, system).map(|v| (v, false)),
        Job::MinorFactors { matrix } => factor::minor_factors(&tower, matrix).map(|v| (v, false)),
    });
    match result {
        Ok((values, verified)) => Response::Values { values, verified },
        Err(e) => Response::Failed { reason: e.to_string() },
    }
}
