//! Uncertainty budgets in the form of the GUM (JCGM 100:2008): every source with its standard uncertainty, sensitivity
//! and contribution, the largest first.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::answer::OmittedEffect;

/// Uncertainty budget of one unknown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Budget {
    /// Name of the unknown.
    pub unknown: String,
    /// Unit of the unknown, of its contributions and of the total.
    pub unit: String,
    /// Total standard uncertainty: root of the sum of the squared contributions, in `unit`.
    pub total: f64,
    /// Largest standard uncertainty allowed, in `unit`; null if none is required.
    pub requirement: Option<f64>,
    /// Sources of uncertainty, the largest contribution first.
    pub lines: Vec<BudgetLine>,
}

/// Evaluation of a standard uncertainty, by the GUM.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Evaluation {
    /// Type A: statistical, from the scatter of the samples that the estimates are computed from.
    A,
    /// Type B: by other means, such as a datasheet or an earlier calibration.
    B,
}

/// Source of uncertainty in a budget.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BudgetLine {
    /// Source: the samples (with the random drift and the priors that are stated), or the name of an error.
    pub source: String,
    /// Evaluation of its standard uncertainty: type A or B.
    pub evaluation: Evaluation,
    /// Standard uncertainty of the source, in `value_unit`.
    pub value: f64,
    /// Unit of the standard uncertainty of the source.
    pub value_unit: String,
    /// Sensitivity of the unknown to the source, in the unit of the unknown per `value_unit`.
    pub sensitivity: f64,
    /// Contribution to the standard uncertainty of the unknown, in its unit: value times sensitivity, positive.
    pub contribution: f64,
    /// Part of the squared total, in percent.
    pub percent: f64,
}

/// Name of the source that the samples are.
pub const SAMPLES: &str = "samples";

/// Budget of an unknown of standard deviation `sigma`, with the errors that have a size.
pub(crate) fn budget(
    unknown: (&str, &str),
    sigma: f64,
    requirement: Option<f64>,
    effects: &[OmittedEffect],
) -> Budget {
    let (name, unit) = unknown;
    let line = |source: &str, evaluation, (value, value_unit): (f64, &str), sensitivity: f64| BudgetLine {
        source: source.into(),
        evaluation,
        value,
        value_unit: value_unit.into(),
        sensitivity,
        contribution: (value * sensitivity).abs(),
        percent: 0.0,
    };
    let mut lines = vec![line(SAMPLES, Evaluation::A, (sigma, unit), 1.0)];
    lines.extend(effects.iter().filter_map(|e| {
        let own = e.sensitivities.iter().find(|s| s.unknown == name)?;
        Some(line(&e.name, Evaluation::B, (e.size.filter(|s| *s > 0.0)?, e.unit.as_str()), own.per_unit))
    }));
    lines.sort_by(|a, b| b.contribution.total_cmp(&a.contribution));
    let squared: f64 = lines.iter().map(|l| l.contribution * l.contribution).sum();
    for l in &mut lines {
        l.percent = if squared > 0.0 { 100.0 * l.contribution * l.contribution / squared } else { 0.0 };
    }
    Budget { unknown: name.into(), unit: unit.into(), total: squared.sqrt(), requirement, lines }
}
