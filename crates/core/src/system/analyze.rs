//! Analysis of a model, in continuous or discrete time.

use super::answer::analyzed;
use super::answer::data::{SystemAnalysis, SystemOptions};
use super::discrete::analyze_discrete;
use super::error::ModelError;
use super::model::SystemModel;

/// Judges a model, without the symbolic engine.
///
/// # Errors
/// [`ModelError`].
pub fn analyze_system(model: &SystemModel, options: SystemOptions) -> Result<SystemAnalysis, ModelError> {
    match model.discrete {
        true => analyze_discrete(model, options),
        false => analyzed(model, options).map(|found| found.analysis),
    }
}
