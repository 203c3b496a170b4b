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
    /// Attitudes that the gimbals do not reach.
    pub beyond_gimbals: Vec<String>,
    /// Rotations of the platform axes that turn schemes into equally good ones (1: the identity).
    pub symmetry: usize,
    /// Coefficients that must be observable, and that the criterion is about.
    pub required: Vec<String>,
    /// The fewest positions.
    pub minimum: Minimum,
    /// What was searched; null when only the minimum was asked for.
    pub search: Option<SearchReport>,
    /// The best schemes, best first.
    pub found: Vec<Found>,
    /// Schemes that none found beats in both total time and criterion, by total time.
    pub front: Vec<Found>,
    /// Bound on the probability that an observable set was overlooked: sets are judged modulo one random 61-bit prime (the
    /// schemes listed modulo two).
    pub error_bound: f64,
    /// Seed of all random choices.
    pub seed: u64,
}

/// The fewest positions that make every required coefficient observable.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Minimum {
    /// Their number; null when all candidates together do not do, or when the sets are too many to be examined.
    pub positions: Option<usize>,
    /// A set that does.
    pub witness: Vec<String>,
    /// No fewer can do: that many rows are needed.
    pub counting_bound: usize,
    /// `[size, number of sets]`: none of these does, by exhaustion.
    pub none_of: Vec<[u64; 2]>,
    /// Coefficients that all candidates together leave unobservable.
    pub never: Vec<String>,
}

/// What was searched, and how.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SearchReport {
    /// The number of positions.
    pub positions: usize,
    /// Dwell of each, in s.
    pub dwell_s: f64,
    /// Rate of the turns between positions in deg/s; null: they take no time.
    pub slew_rate_deg_s: Option<f64>,
    /// What makes a scheme better: worst, A, D, E or margin.
    pub criterion: String,
    /// Sequences whose sigma was computed.
    pub examined: u64,
    /// Whether the first is proven to be the best sequence of candidates, by exhaustion.
    pub proven: bool,
    /// Whether orders of the same positions count as different schemes.
    pub order_matters: bool,
    /// Whether the search was interrupted.
    pub interrupted: bool,
    /// The smallest worst degree that all candidates together allow.
    pub degree_floor: usize,
    /// The constraints in words.
    pub constraints: Vec<String>,
}

/// A scheme that was found.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Found {
    /// Its positions in order.
    pub positions: Vec<String>,
    /// Their Euler angles in degrees.
    pub angles: Vec<String>,
    /// Its angles were refined continuously.
    pub refined: bool,
    /// Dwell of each position, in s.
    pub dwell_s: f64,
    /// Total time with turns, in s.
    pub total_s: f64,
    /// The criterion: a sigma in deg/h (per g), or for margin the largest sigma over its requirement.
    pub value: f64,
    /// The largest sigma of a required coefficient in deg/h (per g): information of all samples, no prior, no drift noise.
    pub worst_sigma_dph: f64,
    /// The coefficient that has it.
    pub worst: String,
    /// Its largest degree of a required coefficient.
    pub worst_degree: usize,
    /// Its largest accuracy order of a required coefficient.
    pub worst_accuracy_order: Option<usize>,
    /// Its exact rank and the number of unknowns.
    pub rank: [usize; 2],
}
