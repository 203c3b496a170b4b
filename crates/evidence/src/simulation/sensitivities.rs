//! Verdicts on a scheme, with the sensitivities of its estimates to errors that it does not estimate.

use obsdeg_core::analysis::Analysis;
use obsdeg_core::model::Scheme;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::answer::MeasurementReport;
use super::omitted::{OmittedEffects, omitted_effects};
use super::{Attained, Conditions, SimulationError};

/// Verdicts on a scheme, with the sensitivities of its estimates where they are asked for.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Analysis")]
pub struct SchemeAnalysis {
    /// Exact verdicts on the scheme.
    #[serde(flatten)]
    pub verdicts: Analysis,
    /// Changes of the estimates per unit of each error that is not estimated; left out unless they are asked
    /// for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensitivities: Option<Sensitivities>,
}

/// Changes of the estimates of a scheme per unit of each error that it does not estimate, by the weights of
/// one record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Sensitivities {
    /// Conditions of the record whose noise and priors weight the samples.
    pub conditions: MeasurementReport,
    /// Effects of the errors on the estimates from this record.
    pub effects: OmittedEffects,
}

/// Sensitivities of the estimates of `scheme` to everything that it does not estimate, by the record of its
/// predicted sigmas.
///
/// # Errors
/// [`SimulationError`].
pub fn sensitivities(
    scheme: &Scheme,
    conditions: &Conditions,
    seed: u64,
) -> Result<Sensitivities, SimulationError> {
    let attained = Attained::new(scheme, conditions, seed)?;
    Ok(Sensitivities {
        conditions: MeasurementReport::new(scheme, conditions),
        effects: omitted_effects(&attained, conditions, seed)?,
    })
}
