//! Options of a search.

use serde::{Deserialize, Serialize};

use crate::design::request::candidates::Candidates;

/// What is to be found.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignOptions {
    /// What to choose from.
    pub candidates: Candidates,
    /// Number of positions; `None`: only the minimum is asked for.
    pub positions: Option<usize>,
    /// Coefficients or families that must be observable; none: all.
    pub required: Vec<String>,
    /// Largest degrees: of a coefficient or family, or of all that are required.
    pub degree_caps: Vec<(Option<String>, usize)>,
    /// Only schemes that meet the requirements of the conditions on what is required, and on psi when that is
    /// everything.
    pub meet: bool,
    /// Largest total time, in s.
    pub total_s: Option<f64>,
    /// Longest turn between successive positions, in s.
    pub slew_s: Option<f64>,
    /// What makes one scheme better than another.
    pub criterion: CriterionName,
    /// How many schemes are listed.
    pub keep: usize,
    /// Restarts of the exchange, where the space is too large for exhaustion.
    pub restarts: u64,
    /// Refine the angles of the best continuously.
    pub refine: bool,
    /// Divide the total time among the positions of the best.
    pub divide: bool,
    /// Numbers of positions for the front of total time, besides that asked for.
    pub front: Vec<usize>,
    /// Where many sequences would have to be searched and information adds (reset carry): all are searched
    /// unless the criterion of a scheme found by exchange is within this part of a bound on what is possible
    /// at all. `None`: they are not searched, and the answer says how far that scheme is from the bound at
    /// most. 0: all are searched, however many they are, under any carry.
    pub within: Option<f64>,
    /// Whether the bound over all attitudes is sought too (reset carry).
    pub everywhere: bool,
    /// The candidates are where the search for the best attitudes of all begins; these take their place, with angles
    /// rounded to multiples of so many 1e-9 degrees (reset carry).
    pub free: Option<i64>,
    /// Seed of all random choices.
    pub seed: u64,
}

impl Default for DesignOptions {
    /// The minimum, of the cardinal attitudes.
    fn default() -> Self {
        Self {
            candidates: Candidates::cardinals(),
            positions: None,
            required: Vec::new(),
            degree_caps: Vec::new(),
            meet: false,
            total_s: None,
            slew_s: None,
            criterion: CriterionName::default(),
            keep: 10,
            restarts: 200,
            refine: false,
            divide: false,
            front: Vec::new(),
            within: None,
            everywhere: false,
            free: None,
            seed: 1,
        }
    }
}

/// The name of a criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CriterionName {
    /// The largest sigma.
    #[default]
    Worst,
    /// A-optimal.
    A,
    /// D-optimal.
    D,
    /// E-optimal.
    E,
    /// The largest sigma over its requirement.
    Margin,
}
