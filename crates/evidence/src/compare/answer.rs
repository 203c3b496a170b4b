//! Comparison of schemes as plain data.

use obsdeg_core::degree::Status;
use obsdeg_core::model::slew::Turn;
use obsdeg_core::model::{Carry, GimbalReport};
use schemars::JsonSchema;
use serde::Serialize;

use crate::requirements::{Requirements, Worst};
use crate::simulation::answer::{MeasurementReport, Validity};
use crate::simulation::omitted::OmittedEffects;
use crate::simulation::{NoiseFloor, OtherCarry};

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.comparison/2";

/// Comparison of several schemes under the same method.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Comparison {
    /// Layout of this answer: `obsdeg.comparison/2`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Schemes of the comparison, in the order given.
    pub schemes: Vec<ComparedScheme>,
    /// Differences between the schemes besides positions, dwells and slews: carry, latitude, unknowns,
    /// requirements, noise, random drift or bias instability, prior, bench, step, settle.
    pub differ: Vec<String>,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Scheme of a comparison, with its predicted sigmas.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Review")]
pub struct ComparedScheme {
    /// Name of the scheme: that of its file.
    pub name: String,
    /// Carry: quantity that continues from one position to the next.
    pub carry: Carry,
    /// Conditions of the predicted sigmas.
    pub conditions: MeasurementReport,
    /// Names of the positions, in order of time.
    pub positions: Vec<String>,
    /// Slews of finite duration, each with the position that it leads to.
    pub slews: Vec<ComparedSlew>,
    /// Total time of the scheme with slews, in s.
    pub total_s: f64,
    /// Rank with dwell (by derivatives if accuracy orders are not computed), then the number of unknowns.
    pub rank: [usize; 2],
    /// Verdict, sigma and requirement of each unknown.
    pub quantities: Vec<ComparedQuantity>,
    /// Largest sigma of a coefficient; null if one is not observable.
    pub worst: Option<Worst>,
    /// True if requirements are stated and every one is met.
    pub meets_requirements: bool,
    /// Outcome of the requirements by the predicted sigmas.
    pub requirements: Requirements,
    /// Outcome of the same scheme under the other carries.
    pub other_carries: Vec<OtherCarry>,
    /// Effect of what the scheme does not estimate, by the weights of the predicted sigmas.
    pub omitted: OmittedEffects,
    /// True if accuracy orders are computed. They are not for rotating segments.
    pub has_accuracy_orders: bool,
    /// Validity of the small-angle model at the drifts that are stated; null where none are (`values`), or
    /// for very many steps.
    pub validity: Option<Validity>,
    /// Schemes with one position left out, for each position.
    pub drop_one: Vec<DropOne>,
    /// Worst sigmas under other conditions.
    pub sensitivity: Vec<Sensitivity>,
    /// Noise floor: the least sigmas under random drift, however long the dwells; left out where the gyros
    /// have no noise of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_floor: Option<NoiseFloor>,
    /// Angles and turns beyond the gimbal limits of the scheme; left out where it states none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gimbals: Option<GimbalReport>,
}

/// Slew of finite duration to a position.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Slew")]
pub struct ComparedSlew {
    /// Name of the position that the slew leads to.
    pub to: String,
    /// Turn of the slew: its axis and angle.
    pub turn: Turn,
}

/// Verdict, sigma and requirement of one unknown of a scheme.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Quantity")]
pub struct ComparedQuantity {
    /// Name of the unknown, as in the scheme's model.
    pub name: String,
    /// Unit of sigma, of the requirement and of `sigma_extended`.
    pub unit: String,
    /// Verdict: observable, inseparable or not excited.
    pub status: Status,
    /// Observable degree; null if the unknown is not observable.
    pub degree: Option<usize>,
    /// Accuracy order; null if no dwell makes the unknown observable, or if none were computed.
    pub accuracy_order: Option<usize>,
    /// Predicted standard deviation at the end of the scheme under the stated conditions, in the unit of
    /// `unit`; null if neither samples nor stated priors bound it.
    pub sigma: Option<f64>,
    /// True if the samples do not determine the unknown, so that sigma depends on stated priors alone.
    pub by_prior: bool,
    /// Standard deviation of a coefficient at the end by a filter with full attitudes, with the prior, in the
    /// unit of `unit`; null if the small-angle model holds for the stated drifts, or none are stated.
    pub sigma_extended: Option<f64>,
    /// Largest sigma allowed, in the unit of `unit`; null if none is required.
    pub requirement: Option<f64>,
    /// Total uncertainty with the errors of the bench, in the unit of `unit`; null without a bench or a
    /// sigma.
    pub total: Option<f64>,
    /// Requirement over sigma (total uncertainty with a bench), dimensionless: met from 1; null if there is
    /// no requirement or no sigma.
    pub margin: Option<f64>,
    /// Factors by which the unknown enters the drift, position by position, dimensionless: products of
    /// components of g (1 for D_F), root mean square over the arc of a rotating segment. Empty for psi.
    pub excitation: Vec<f64>,
    /// Positions without which the unknown is not observable.
    pub carried_by: Vec<String>,
}

/// Scheme without one of its positions.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DropOne {
    /// Name of the position that is left out.
    pub position: String,
    /// Unknowns that are not observable without the position.
    pub lost: Vec<String>,
    /// Worst sigma without the position; null if a coefficient is not observable.
    pub worst: Option<Worst>,
    /// Outcome of the requirements without the position.
    pub requirements: Requirements,
}

/// Worst sigma of the scheme under another condition.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Sensitivity {
    /// Condition: `latitude 60 deg`, `dwell x 2`, `reset carry`; `platform carry, no slews` for a scheme with
    /// slews, which only inertial carry has.
    pub condition: String,
    /// Rank with dwell, then the number of unknowns, under the condition.
    pub rank: [usize; 2],
    /// Worst sigma under the condition; null if a coefficient is not observable.
    pub worst: Option<Worst>,
    /// Worst sigma, under the condition, of the coefficients that are observable in the scheme itself; null
    /// if one is not.
    pub worst_determined: Option<Worst>,
}
