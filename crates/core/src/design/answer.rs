//! Schemes that were found: plain data.

use schemars::JsonSchema;
use serde::Serialize;

use crate::model::Carry;

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.design/1";

/// The result of a search.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Design {
    /// `obsdeg.design/1`.
    pub schema: String,
    /// Version of the program.
    pub version: String,
    /// What is carried between positions.
    pub carry: Carry,
    /// Latitude in degrees.
    pub latitude_deg: f64,
    /// The attitudes to choose from.
    pub candidates: Vec<String>,
    /// The fewest positions; null when all candidates together do not do.
    pub minimum: Option<Minimum>,
    /// The number of positions asked for.
    pub positions: Option<usize>,
    /// Dwell of each, in s.
    pub dwell_s: f64,
    /// What makes a scheme better: worst, A, D, E or margin.
    pub criterion: String,
    /// The best schemes, best first.
    pub found: Vec<Found>,
    /// Sequences whose sigma was computed.
    pub examined: u64,
    /// Whether the first is proven to be the best, by exhaustion.
    pub proven: bool,
    /// Whether orders of the same positions count as different schemes.
    pub order_matters: bool,
    /// Whether the search was interrupted.
    pub interrupted: bool,
    /// Bound on the probability that an observable set was overlooked: sets are judged modulo one random 61-bit prime (the
    /// schemes listed modulo two).
    pub error_bound: f64,
    /// Seed of all random choices.
    pub seed: u64,
}

/// The fewest positions that make every coefficient observable.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Minimum {
    /// Their number.
    pub positions: usize,
    /// A set that does.
    pub witness: Vec<String>,
    /// No fewer can do: that many rows are needed.
    pub counting_bound: usize,
    /// `[size, number of sets]`: none of these does, by exhaustion.
    pub none_of: Vec<[u64; 2]>,
}

/// A scheme that was found.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Found {
    /// Its positions in order.
    pub positions: Vec<String>,
    /// The criterion: a sigma in deg/h (per g), or for margin the largest sigma over its target.
    pub value: f64,
    /// The largest sigma of a coefficient in deg/h (per g): information of all samples, no prior, no drift noise.
    pub worst_sigma_dph: f64,
    /// Its exact rank and the number of unknowns.
    pub rank: [usize; 2],
}
