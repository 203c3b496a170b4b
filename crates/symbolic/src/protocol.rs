//! Protocol between the program and its worker: one JSON object per line.

use serde::{Deserialize, Serialize};

/// Prefix of every answer of the worker, which distinguishes it from a banner.
pub(crate) const PREFIX: &str = "obsdeg:";

/// Unit of work: number of products of terms that take about half a second.
pub const UNIT: u64 = 5_000_000;

/// Request with its limit of work.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Order {
    /// Largest work of the answer, in [`UNIT`]s.
    pub limit: u64,
    /// Request of the program.
    pub request: Request,
}

/// Job with the field of its numbers: rational functions of `symbols` and of the cosines and sines of
/// `angles`, extended by square roots.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Request {
    /// Independent symbols, in the order of the model.
    pub symbols: Vec<String>,
    /// Square roots `g` with `g^2` given, such as `r_2` with `2`.
    pub generators: Vec<(String, String)>,
    /// Angles: `alpha` declares `c_alpha` and `s_alpha` (and `t_alpha`, the tangent of its half).
    pub angles: Vec<String>,
    /// Job to do.
    pub job: Job,
}

/// Job of the worker.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Job {
    /// Solve `M x = b` and answer with `x`, or `P x`; verify `x` by substitution if asked.
    Solve {
        /// Linear system to solve.
        system: System,
        /// Check of the solution against the dynamics; `None` for no check.
        check: Option<SubstitutionCheck>,
    },
    /// Differentiate the outputs along the dynamics up to `order`; answer output by output, order by
    /// order.
    Derive {
        /// Dynamics and outputs.
        dynamics: Dynamics,
        /// Highest order of derivatives.
        order: usize,
    },
    /// The irreducible factors of one maximal minor of a matrix of rational functions of the symbols.
    MinorFactors {
        /// Entries of the matrix, row by row.
        matrix: Vec<Vec<String>>,
    },
}

/// Linear system as text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct System {
    /// Matrix `M`, row by row: rational functions of the declared names.
    pub matrix: Vec<Vec<String>>,
    /// Right side `b`.
    pub right: Vec<String>,
    /// Matrix `P`; empty for the identity.
    pub outputs: Vec<Vec<String>>,
}

/// Dynamics `x' = f(x)`, `z = h(x)`, polynomial in the states with coefficients in symbols and
/// generators.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dynamics {
    /// Names of the states.
    pub states: Vec<String>,
    /// Right sides `f`, one per state.
    pub equations: Vec<String>,
    /// Outputs `h`.
    pub outputs: Vec<String>,
}

/// Claim `sum_i x_i sum_t factor_t (d/dt)^order_t z_output_t at segment_t = target`, to be verified by
/// differentiating and substituting.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SubstitutionCheck {
    /// Local system of every segment.
    pub dynamics: Dynamics,
    /// Names of the unknowns.
    pub unknowns: Vec<String>,
    /// States of each segment as linear expressions in the unknowns.
    pub segments: Vec<Vec<String>>,
    /// Terms of each `x_i`.
    pub terms: Vec<Vec<CheckTerm>>,
    /// Claimed combination: per unknown, a rational function of symbols and generators, and a factor
    /// that is one of the symbols.
    pub target: Vec<(String, String)>,
}

/// One term of a [`SubstitutionCheck`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckTerm {
    /// Factor: a rational function of the symbols.
    pub factor: String,
    /// Index of the segment, from 0.
    pub segment: usize,
    /// Index of the output, from 0.
    pub output: usize,
    /// Order of the derivative.
    pub order: usize,
}

impl Request {
    /// Number of expressions in the answer; `None` if it depends on their values.
    pub fn answers(&self) -> Option<usize> {
        match &self.job {
            Job::Solve { system, .. } if system.outputs.is_empty() => {
                Some(system.matrix.first().map_or(0, Vec::len))
            }
            Job::Solve { system, .. } => Some(system.outputs.len()),
            Job::Derive { dynamics, order } => Some(dynamics.outputs.len() * (order + 1)),
            Job::MinorFactors { .. } => None,
        }
    }
}

/// Response of the worker.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Response {
    /// Another process holds the lock; the worker waits for it.
    Waiting,
    /// Lock obtained: requests are answered.
    Ready,
    /// Lock file that cannot be used.
    Unusable {
        /// Reason in words.
        reason: String,
    },
    /// Work beyond the limit of the request.
    OverLimit,
    /// Expressions, in the order that the job states, with the result of the check.
    Values {
        /// Expressions of the answer.
        values: Vec<String>,
        /// True if a check was asked for and held.
        verified: bool,
    },
    /// Job that failed.
    Failed {
        /// Reason in words.
        reason: String,
    },
}
