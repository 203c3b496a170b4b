//! Schemes side by side: plain data.

use obsdeg_core::degree::Status;
use obsdeg_core::model::slew::Turn;
use obsdeg_core::model::{Carry, GimbalReport};
use schemars::JsonSchema;
use serde::Serialize;

use crate::requirements::{Requirements, Worst};
use crate::simulation::answer::{MeasurementReport, Validity};
use crate::simulation::{NoiseFloor, OtherCarry};

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.comparison/2";

/// Several schemes, judged alike.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Comparison {
    /// `obsdeg.comparison/2`.
    pub schema: String,
    /// Version of the program.
    pub version: String,
    /// The schemes in the order given.
    pub schemes: Vec<ComparedScheme>,
    /// What differs between the schemes besides positions, dwells and slews: carry, latitude, unknowns, requirements, noise, step.
    pub differ: Vec<String>,
    /// Seed of all random choices.
    pub seed: u64,
}

/// One scheme.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Review")]
pub struct ComparedScheme {
    /// Its name: the file's.
    pub name: String,
    /// What is carried between positions.
    pub carry: Carry,
    /// What its sigmas rest on.
    pub conditions: MeasurementReport,
    /// Its positions.
    pub positions: Vec<String>,
    /// The turns between them that take time, with the position that each leads to.
    pub slews: Vec<Slew>,
    /// Total time with slews, in s.
    pub total_s: f64,
    /// The rank with dwell (by derivatives where accuracy orders are not computed), and the number of unknowns.
    pub rank: [usize; 2],
    /// Per unknown.
    pub quantities: Vec<Quantity>,
    /// The largest sigma of a coefficient; null when one is not observable.
    pub worst: Option<Worst>,
    /// True if requirements are stated and every one is met.
    pub meets_requirements: bool,
    /// Outcome of the requirements by the predicted sigmas.
    pub requirements: Requirements,
    /// The same scheme under the other carries.
    pub other_carries: Vec<OtherCarry>,
    /// Whether accuracy orders are computed: none are for rotating segments.
    pub has_accuracy_orders: bool,
    /// Validity of the small-angle model at the drifts that are stated; null where none are (`values`), or
    /// for very many steps.
    pub validity: Option<Validity>,
    /// What happens without each of the positions.
    pub drop_one: Vec<DropOne>,
    /// The worst sigma under other conditions.
    pub sensitivity: Vec<Sensitivity>,
    /// How well coefficients can be known under random drift, however long the dwells; left out where the gyros have no noise of their own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_floor: Option<NoiseFloor>,
    /// Angles and turns beyond the gimbal limits that the scheme states; left out where it states none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gimbals: Option<GimbalReport>,
}

/// A turn to a position.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Slew {
    /// The position.
    pub to: String,
    /// How it turns.
    pub turn: Turn,
}

/// One unknown of a scheme.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Quantity {
    /// Its name.
    pub name: String,
    /// Unit of sigma.
    pub unit: String,
    /// The exact verdict.
    pub status: Status,
    /// The observable degree.
    pub degree: Option<usize>,
    /// The accuracy order.
    pub accuracy_order: Option<usize>,
    /// Predicted standard deviation at the end of the scheme, by the conditions that are stated; null when
    /// neither samples nor stated priors bound it.
    pub sigma: Option<f64>,
    /// True if the samples do not determine it, so that sigma rests on stated priors alone.
    pub by_prior: bool,
    /// Standard deviation of a coefficient, where the small-angle model does not hold for the drifts that are
    /// stated, by a filter with full attitudes at the end, with the prior.
    pub sigma_extended: Option<f64>,
    /// The largest sigma allowed.
    pub requirement: Option<f64>,
    /// Requirement over sigma: above 1 is met.
    pub margin: Option<f64>,
    /// Per position: how it moves the drift there, as a product of components of g (1 for D_F); its root mean square over the arc of a
    /// rotating segment; empty for psi.
    pub excitation: Vec<f64>,
    /// Positions without which it is not observable.
    pub carried_by: Vec<String>,
}

/// A scheme without one of its positions.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DropOne {
    /// The position left out.
    pub position: String,
    /// Unknowns that are not observable without it.
    pub lost: Vec<String>,
    /// The worst sigma without it.
    pub worst: Option<Worst>,
    /// Outcome of the requirements without it.
    pub requirements: Requirements,
}

/// The worst sigma under another condition.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Sensitivity {
    /// The condition: `latitude 60 deg`, `dwell x 2`, `reset carry`; `platform carry, no slews` where the scheme has slews, which only
    /// inertial carry knows.
    pub condition: String,
    /// The rank with dwell and the number of unknowns there.
    pub rank: [usize; 2],
    /// The worst sigma there.
    pub worst: Option<Worst>,
    /// The worst sigma there of the coefficients that the scheme itself makes observable; null when one is not.
    pub worst_determined: Option<Worst>,
}
