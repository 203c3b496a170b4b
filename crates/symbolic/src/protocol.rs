//! What travels between the program and its worker: one JSON object per line.

use serde::{Deserialize, Serialize};

/// Starts every answer of the worker, so that a banner is told from an answer.
pub const PREFIX: &str = "obsdeg:";

/// The unit of work: so many products of terms, about half a second.
pub const UNIT: u64 = 5_000_000;

/// Seconds of processor time that go with a unit of work: what cannot be counted ends there.
pub const SECONDS_PER_UNIT: u64 = 2;

/// What the program sends: a request, and how many [`UNIT`]s of work its answer may take.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Order {
    /// Units of work.
    pub limit: u64,
    /// What is asked.
    pub request: Request,
}

/// A job and the numbers it is about: rational functions of `symbols` and of the cosines and sines of
/// `angles`, extended by square roots.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Request {
    /// Independent symbols, in the order of the model.
    pub symbols: Vec<String>,
    /// Square roots `g` with `g^2` given, such as `r_2` with `2`.
    pub generators: Vec<(String, String)>,
    /// Angles: `alpha` announces `c_alpha` and `s_alpha` (and `t_alpha`, the tangent of its half).
    pub angles: Vec<String>,
    /// What to do.
    pub job: Job,
}

/// What to do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Job {
    /// Solve `M x = b` and answer with `x`, or `P x`; verify `x` by substitution if asked.
    Solve {
        /// The system.
        system: System,
        /// How the solution is checked against the dynamics.
        check: Option<Check>,
    },
    /// Differentiate the outputs along the dynamics up to `order`; answer output by output, order by
    /// order.
    Derive {
        /// The system.
        dynamics: Dynamics,
        /// Highest order.
        order: usize,
    },
    /// The irreducible factors of one maximal minor of a matrix of rational functions of the symbols.
    MinorFactors {
        /// The matrix.
        matrix: Vec<Vec<String>>,
    },
}

/// A linear system in text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct System {
    /// `M`, row by row: rational functions of whatever is announced.
    pub matrix: Vec<Vec<String>>,
    /// `b`.
    pub right: Vec<String>,
    /// `P`; empty for the identity.
    pub outputs: Vec<Vec<String>>,
}

/// `x' = f(x)`, `z = h(x)`, polynomial in the states with coefficients in symbols and generators.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dynamics {
    /// The states.
    pub states: Vec<String>,
    /// `f`, one per state.
    pub equations: Vec<String>,
    /// `h`.
    pub outputs: Vec<String>,
}

/// A claim `sum_i x_i sum_t factor_t (d/dt)^order_t z_output_t at segment_t = target`, to be verified
/// by differentiating and substituting.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Check {
    /// The local system of every segment.
    pub dynamics: Dynamics,
    /// The unknowns.
    pub unknowns: Vec<String>,
    /// Per segment, the states as linear expressions in the unknowns.
    pub segments: Vec<Vec<String>>,
    /// Per `x_i`, its terms.
    pub terms: Vec<Vec<CheckTerm>>,
    /// The claimed combination: per unknown, a rational function of symbols and generators and one
    /// of the symbols to multiply it with.
    pub target: Vec<(String, String)>,
}

/// One term of a [`Check`].
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CheckTerm {
    /// Factor: a rational function of the symbols.
    pub factor: String,
    /// Index of the segment.
    pub segment: usize,
    /// Index of the output.
    pub output: usize,
    /// Derivative order.
    pub order: usize,
}

impl Request {
    /// How many expressions answer it, where that does not depend on their values.
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

/// What the worker says.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Response {
    /// Another process holds the lock; the worker waits for it.
    Waiting,
    /// The lock is held: requests are answered.
    Ready,
    /// There is no lock to be had.
    Unusable {
        /// Why.
        reason: String,
    },
    /// The work of a request was beyond its limit.
    OverLimit,
    /// Expressions, in the order that the job states, and whether the check, if any, held.
    Values {
        /// The expressions.
        values: Vec<String>,
        /// True when a check was asked for and held.
        verified: bool,
    },
    /// The job failed.
    Failed {
        /// Why.
        reason: String,
    },
}
