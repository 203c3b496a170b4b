//! Audit of the paper: its equations and claims against the model.

use clap::Args;
use obsdeg_evidence::audit::{Audit, audit};
use serde::{Deserialize, Serialize};

use crate::arguments::{ANY, SEED, whole};
use crate::problem::Problem;

/// Request of `paper`: the seed.
#[derive(Debug, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct Paper {
    /// Seed of the random points and of the noise
    #[arg(long, default_value_t = SEED, value_parser = whole::<u64>(ANY))]
    pub seed: u64,
}

impl Default for Paper {
    fn default() -> Self {
        Self { seed: SEED }
    }
}

/// Recomputes the equations and claims of the paper.
///
/// # Errors
/// Defect of the program.
pub fn paper(options: &Paper) -> Result<Audit, Problem> {
    audit(options.seed).map_err(|e| Problem::internal(e.to_string()))
}
