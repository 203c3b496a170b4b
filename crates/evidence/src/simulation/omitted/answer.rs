//! Sensitivities to errors that a scheme does not estimate, as plain data.

use obsdeg_core::model::Carry;
use obsdeg_core::omitted::{ExactChange, OmittedClass};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Effect of everything that a scheme does not estimate: the other terms of the error model, the site, and
/// the attitudes of the positions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OmittedEffects {
    /// Effects family by family: all terms of a family have the same size, and their changes add up as
    /// squares.
    pub families: Vec<FamilyEffect>,
    /// Effects term by term, in the order of the error model.
    pub terms: Vec<OmittedEffect>,
    /// Uncertainty budgets of the unknowns that have a sigma; empty without a bench.
    pub budgets: Vec<Budget>,
    /// Uncertainty of the scheme under every carry, its own first; empty without a bench.
    pub carries: Vec<CarryUncertainty>,
    /// Changes that lower the largest total over its requirement, the lowest first; empty unless sigma meets
    /// every requirement and the total with the bench does not.
    pub advice: Vec<Advice>,
    /// Effect of correlated noise on the sigmas; null if no correlated noise is stated.
    pub correlated_noise: Option<CorrelatedNoise>,
    /// True if torquer errors (GS, GM) act in the stated turns; otherwise they act at the earth rate alone.
    pub torquers_in_turns: bool,
    /// Bound on the probability that a class is wrong, dimensionless; null where no classes were computed.
    pub error_bound: Option<f64>,
    /// Reason why there are no exact classes; null if there are.
    pub not_classified: Option<String>,
    /// Names in the bench that are among the unknowns: estimated, so that their sizes do not count.
    #[serde(default)]
    pub estimated: Vec<String>,
    /// True if priors are stated: figures count them, exact changes by silent errors do not.
    #[serde(default)]
    pub priors: bool,
    /// True if attitudes of the positions are among the terms: those of rotating positions, and of more than
    /// 64, are not computed.
    #[serde(default = "yes")]
    pub attitudes: bool,
}

/// Value of `attitudes` in answers without this field.
fn yes() -> bool {
    true
}

/// Effect of one error that is not estimated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OmittedEffect {
    /// Name of the error, such as `K0_X`, `latitude` or `attitude_x@2`.
    pub name: String,
    /// Family of the error, such as `K0`, `latitude` or `attitude`.
    pub family: String,
    /// Unit of its sizes: ug, ppm, arcsec, ...
    pub unit: String,
    /// Exact class: no effect, silent or visible; null where none was computed.
    pub class: Option<OmittedClass>,
    /// Exact changes by a silent error, in SI units; null if they have no exact form, or for other classes.
    pub exact: Option<Vec<ExactChange>>,
    /// Size that a record of this scheme shows at three sigma, in the unit of `unit`; null unless the error
    /// is visible.
    pub visible_from: Option<f64>,
    /// Size stated by the bench (one sigma), in the unit of `unit`; null where the bench states none.
    pub size: Option<f64>,
    /// Changes of the estimates per unit of the error; estimates that it does not change are left out.
    pub sensitivities: Vec<ChangePerUnit>,
    /// Size at which the error uses up the margin of a requirement; null if there is no requirement, or none
    /// that it affects.
    pub uses_up: Option<UsesUp>,
}

/// Change of one estimate per unit of an error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChangePerUnit {
    /// Name of the unknown whose estimate changes.
    pub unknown: String,
    /// Unit of the unknown whose estimate changes.
    pub unit: String,
    /// Estimate minus truth, in the unit of the unknown per unit of the error.
    pub per_unit: f64,
}

/// Size of an error at which a requirement is just met.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UsesUp {
    /// Name of the unknown with this requirement.
    pub unknown: String,
    /// Size (one sigma) of the error at which the total uncertainty reaches the requirement, in the unit of
    /// the error; a requirement that is missed without the error has no such size.
    pub size: f64,
}

/// Effect of a family of errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FamilyEffect {
    /// Name of the family, such as `K0` or `latitude`.
    pub family: String,
    /// Unit of its sizes: ug, ppm, arcsec, ...
    pub unit: String,
    /// Number of terms of the family that the scheme does not estimate.
    pub terms: usize,
    /// Number of terms without effect; null where no classes were computed.
    pub no_effect: Option<usize>,
    /// Number of terms that no record can show; null where no classes were computed.
    pub silent: Option<usize>,
    /// Largest change of a drift coefficient per unit size of all terms (root of the sum of squares); null if
    /// no drift coefficient changes.
    pub worst: Option<ChangePerUnit>,
    /// Largest change of a drift coefficient per unit size in its own sigma (dimensionless per unit of the
    /// error); null if no drift coefficient changes.
    pub worst_in_sigmas: Option<f64>,
    /// Smallest size of a single term that a record shows at three sigma, in the unit of `unit`; null if none
    /// is visible.
    pub visible_from: Option<f64>,
    /// Smallest size of all terms of the family together that uses up the margin of a requirement; null if
    /// none does.
    pub uses_up: Option<UsesUp>,
    /// Smallest size of a single term, the others being zero, that uses up the margin of a requirement; null
    /// if none does.
    pub one_uses_up: Option<UsesUp>,
}

/// Uncertainty budget of one unknown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Budget {
    /// Name of the unknown of the budget.
    pub unknown: String,
    /// Unit of the unknown, of its contributions and of the total.
    pub unit: String,
    /// Total standard uncertainty: root of the sum of the squared contributions, in the unit of `unit`.
    pub total: f64,
    /// Largest standard uncertainty allowed, in the unit of `unit`; null if none is required.
    pub requirement: Option<f64>,
    /// Sources of uncertainty, the largest contribution first.
    pub lines: Vec<BudgetLine>,
}

/// Uncertainty of a scheme under one carry, with the bench.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CarryUncertainty {
    /// Carry: quantity that continues from one position to the next.
    pub carry: Carry,
    /// True if the slews of the scheme are left out, since only inertial carry has slews.
    pub without_slews: bool,
    /// Drift coefficient with the largest total; null if one is not observable, or if nothing was judged.
    pub worst: Option<Composition>,
}

/// Uncertainty of one unknown: by the samples, by the bench, and both.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Composition {
    /// Name of the unknown with these figures.
    pub unknown: String,
    /// Unit of sigma, bias and total.
    pub unit: String,
    /// Sigma by the samples, in the unit of `unit`.
    pub sigma: f64,
    /// Contribution of the errors of the bench (root of the sum of squares), in the unit of `unit`.
    pub bias: f64,
    /// Total uncertainty: root of the sum of both squares, in the unit of `unit`.
    pub total: f64,
}

/// Kind of a change that lowers a total uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AdviceKind {
    /// Families of errors are estimated: terms among the unknowns.
    Estimate,
    /// The platform is levelled again before each position: reset carry.
    Relevel,
    /// One more position, as long as the last one.
    AddPosition,
}

/// Change of a scheme that lowers the largest total uncertainty over its requirement, as it was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Advice {
    /// Kind of the change: errors estimated too, the platform levelled again, or a position added.
    pub kind: AdviceKind,
    /// Terms that become unknowns, the carry, or the attitude that is added.
    pub what: String,
    /// Largest total uncertainty over its requirement with the change, dimensionless.
    pub total_over_required: f64,
    /// The same without the change, dimensionless.
    pub now: f64,
    /// Largest factor on the sigma of a drift coefficient, dimensionless: what the change costs.
    pub sigma_factor: f64,
    /// True if every requirement is met with the change.
    pub met: bool,
}

/// Effect of correlated noise: sigmas with it over sigmas of the white noise alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CorrelatedNoise {
    /// Smallest factor on the sigma of a drift coefficient, dimensionless.
    pub smallest: f64,
    /// Largest factor on the sigma of a drift coefficient, dimensionless.
    pub largest: f64,
    /// Name of the drift coefficient with the largest factor.
    pub unknown: String,
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
    /// Standard uncertainty of the source, in the unit of `value_unit`.
    pub value: f64,
    /// Unit of the standard uncertainty of the source.
    pub value_unit: String,
    /// ChangePerUnit of the unknown to the source, in the unit of the unknown per `value_unit`.
    pub sensitivity: f64,
    /// Contribution to the standard uncertainty of the unknown, in its unit: value times sensitivity,
    /// positive.
    pub contribution: f64,
    /// Part of the squared total, in percent.
    pub percent: f64,
}

/// Name of the samples as a source of a budget.
pub const SAMPLES: &str = "samples";
