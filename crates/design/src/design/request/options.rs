//! Options of a search.

use std::fmt;
use std::str::FromStr;

use obsdeg_core::model::ranges::BENCH;
use obsdeg_core::model::settings::concerns;
use obsdeg_core::model::{may_be_omitted, omitted_meant};
use serde::{Deserialize, Serialize};

use crate::degree_caps::DegreeCap;
use crate::design::request::candidates::Candidates;

/// Options of a design.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignOptions {
    /// Candidate attitudes.
    pub candidates: Candidates,
    /// Number of positions; `None` to find only the minimum.
    pub positions: Option<usize>,
    /// Coefficients or families that must be observable; if empty, all coefficients.
    pub required: Vec<String>,
    /// Largest degrees of coefficients or families, or of all other required coefficients.
    pub degree_caps: Vec<DegreeCap>,
    /// Errors that are not estimated and that schemes must be immune to.
    pub immune: Vec<Immune>,
    /// True if only schemes are accepted that meet the requirements of the conditions on the required
    /// coefficients, and on psi if every coefficient is required.
    pub meet: bool,
    /// Largest total time, in s.
    pub total_s: Option<f64>,
    /// Longest turn between successive positions, in s.
    pub slew_s: Option<f64>,
    /// Criterion that orders schemes.
    pub criterion: CriterionName,
    /// Number of schemes to list.
    pub keep: usize,
    /// Number of restarts of the exchange, if the space is too large for exhaustion.
    pub restarts: u64,
    /// True if the angles of the best scheme are refined continuously.
    pub refine: bool,
    /// True if the total time is divided among the positions of the best scheme.
    pub divide: bool,
    /// Numbers of positions for the front of total time, besides `positions`.
    pub front: Vec<usize>,
    /// Relative excess over a lower bound, dimensionless, up to which a scheme found by exchange is
    /// accepted instead of a search of all sequences. It applies where sequences are many and
    /// information adds (reset carry). `None`: no search of all; the answer states the excess. 0: all
    /// sequences are searched, however many they are, under any carry.
    pub within: Option<f64>,
    /// True if the bound over all attitudes is computed too (reset carry).
    pub everywhere: bool,
    /// Step of free attitudes in 1e-9 degrees (reset carry); `None` to choose among the candidates.
    /// Free attitudes, with angles rounded to this step, replace the candidates, from which their
    /// search begins.
    pub free: Option<i64>,
    /// Seed of all random choices.
    pub seed: u64,
}

impl Default for DesignOptions {
    /// Search for the minimum with the cardinal attitudes.
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

/// Error that schemes must be immune to: it has no effect, or a record shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Immune {
    /// Name of an error or a family, such as `K0` or `K0_X`.
    pub name: String,
    /// Size at which a record must show the error at three sigma, in its unit; `None`: it must have no
    /// effect.
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
    /// True if this applies to an error `name` of `family`.
    pub(crate) fn names(&self, family: &str, name: &str) -> bool {
        self.name == family || concerns(&self.name, name)
    }
}

/// Name of a criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CriterionName {
    /// Largest sigma.
    #[default]
    Worst,
    /// Root of the mean variance (A-optimal).
    A,
    /// Geometric mean of the principal sigmas (D-optimal).
    D,
    /// Largest principal sigma (E-optimal).
    E,
    /// Largest sigma over its requirement.
    Margin,
}
