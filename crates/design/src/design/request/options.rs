//! Options of a search.

use std::fmt;
use std::str::FromStr;

use obsdeg_core::model::ranges::BENCH;
use obsdeg_core::model::settings::concerns;
use obsdeg_core::model::{may_be_omitted, omitted_meant};
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
    /// Errors that are not estimated and that schemes must be immune to.
    pub immune: Vec<Immune>,
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
    /// True if the bound over all attitudes is sought too (reset carry).
    pub everywhere: bool,
    /// The candidates are where the search for the best attitudes of all begins; these take their place, with
    /// angles rounded to multiples of so many 1e-9 degrees (reset carry).
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
            immune: Vec::new(),
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

/// An error that schemes are immune to: it has no effect, or a record shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Immune {
    /// Name of an error or a family, such as `K0` or `K0_X`.
    pub name: String,
    /// Size from which on a record must show the error at three sigma, in its unit; `None`: it has no effect.
    pub size: Option<f64>,
}

impl fmt::Display for Immune {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.size {
            Some(size) => write!(f, "{}={size}", self.name),
            None => write!(f, "{}", self.name),
        }
    }
}

impl FromStr for Immune {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, size) = text.split_once('=').map_or((text, None), |(name, size)| (name, Some(size)));
        let name = name.trim().to_string();
        if !may_be_omitted(&name) {
            return Err(format!("no error is `{name}`; {}", omitted_meant(&name)));
        }
        let read = |size: &str| size.trim().parse().ok().filter(|x: &f64| *x > 0.0 && *x <= BENCH.high);
        let wrong = |size| format!("expected a size above 0 and up to {:e}, found `{size}`", BENCH.high);
        let size = size.map(|size| read(size).ok_or_else(|| wrong(size))).transpose()?;
        Ok(Self { name, size })
    }
}

impl Immune {
    /// True if this concerns an error of a family.
    pub(crate) fn names(&self, family: &str, name: &str) -> bool {
        self.name == family || concerns(&self.name, name)
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
