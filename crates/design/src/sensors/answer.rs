//! The answer on sets of outputs: plain data, serialisable.

use obsdeg_core::system::{DigitsReport, NumberOfSolutions};
use schemars::JsonSchema;
use serde::Serialize;

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.sensors/1";

/// Sets of outputs of a model that make its unknowns observable.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Sensors {
    /// Layout of this answer: `obsdeg.sensors/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Name of the system, as in its file.
    pub name: String,
    /// Outputs of the model that are measured in every set; empty if sets replace the outputs.
    pub own_outputs: Vec<String>,
    /// Quantities that sets are chosen from.
    pub candidates: Vec<SensorCandidate>,
    /// Unknowns that every set in `front` and `sets` makes observable: those asked for, or all, without those
    /// in `unattainable`.
    pub required: Vec<String>,
    /// Largest degrees that were asked for, as written: `6`, `k1=4`.
    pub max_degree: Vec<String>,
    /// Unknowns asked for that all candidates together leave unobservable, observable with a larger degree
    /// than asked for, or without the one solution that is required.
    pub unattainable: Vec<Unattainable>,
    /// Counts of solutions, by which every set leaves one for every required unknown; null if this is not
    /// required.
    pub one_solution: Option<CountedSets>,
    /// Worst degree of the required unknowns if all candidates are measured; null if none is required.
    pub least_degree: Option<usize>,
    /// Front of cost against the largest degree: per cost the set with the smallest, if it is smaller than
    /// for every lower cost. Cheapest first.
    pub front: Vec<FrontSet>,
    /// Minimal sets: without any of its outputs a set fails. Cheapest first, then by degree; at most as many
    /// as asked for.
    pub sets: Vec<SensorSet>,
    /// Number of minimal sets; null if not all were found.
    pub minimal_sets: Option<usize>,
    /// Number of minimal sets that were found, whether or not they are listed.
    pub minimal_sets_found: usize,
    /// All minimal sets with up to so many outputs were found; null if all were, whatever their number of
    /// outputs.
    pub complete_to: Option<usize>,
    /// Per unknown the cheapest set that makes it observable.
    pub quantities: Vec<SensorUnknown>,
    /// Number of sets whose degrees were computed, at one point each.
    pub judged_sets: usize,
    /// Number of sets, out of these, that the answer rests on: those listed, and those whose failure or whose
    /// degree its proofs use. Their degrees were computed at a second point too, and are the same.
    pub relied_on_sets: usize,
    /// Number of sets, out of those in this answer and those that its proofs rest on, that `analyze` judged
    /// again as a model with these outputs: the degrees are the same.
    pub confirmed_sets: usize,
    /// True if all derivatives that can add to a rank were examined; if false, unobservable verdicts hold up
    /// to order `last_order` only.
    pub closed: bool,
    /// Order of derivatives at which the search ends at the latest.
    pub last_order: usize,
    /// Reason why the search ended early; null if it did not. What is listed is true, but there may be more,
    /// and cheaper sets for lower degrees.
    pub stopped: Option<String>,
    /// Bound on the probability that the degrees of a set that the answer rests on are wrong; null for a
    /// model judged in real numbers.
    pub error_bound: Option<f64>,
    /// Margin of the rank decisions on all candidates together, in real numbers; null for a model judged in
    /// prime fields.
    pub digits: Option<DigitsReport>,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Quantity that can be measured, or one more experiment.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SensorCandidate {
    /// Name: that of a state, input or parameter, the key in the file, or the expression itself.
    pub name: String,
    /// True for one more experiment: the outputs of a set, measured again from another start.
    pub experiment: bool,
    /// True if the candidate depends on an unknown; if false it adds nothing to any set.
    pub tells: bool,
    /// Expression of the candidate, as written; empty for an experiment.
    pub expression: String,
    /// Unit, as in the model file.
    pub unit: String,
    /// Description, as in the model file.
    pub description: String,
    /// Cost of measuring it, dimensionless.
    pub cost: f64,
    /// Worst degree of the required unknowns if it alone is measured; null if one of them is not
    /// observable.
    pub degree: Option<usize>,
    /// Number of required unknowns that are observable if it alone is measured.
    pub observable: usize,
    /// Degrees of the unknowns if it alone is measured, in the order of `quantities`; null of one that is not
    /// observable.
    pub degrees: Vec<Option<usize>>,
}

/// Unknown that no set makes observable as asked for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Unattainable {
    /// Name of the unknown, as in the model.
    pub name: String,
    /// Observable degree if all candidates are measured; null if it is not observable.
    pub degree: Option<usize>,
    /// Number of solutions if all candidates are measured; null if one solution is not required, or if its
    /// degree already excludes the unknown.
    pub number_of_solutions: Option<NumberOfSolutions>,
}

/// Sets whose solutions were counted, at the seed of the answer, as `analyze` counts them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct CountedSets {
    /// Number of sets whose solutions were counted.
    pub counted: usize,
    /// Number of these under which the number of solutions of some required unknown is not decided. They
    /// count as failing: a cheaper set than those in `front` may leave one solution.
    pub undecided: usize,
}

/// Set of outputs that are measured together.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SensorSet {
    /// Candidates that are measured.
    pub outputs: Vec<String>,
    /// Sum of the costs of these candidates, dimensionless.
    pub cost: f64,
    /// Worst degree: the largest one of the required unknowns.
    pub degree: usize,
}

/// Set of outputs on the front, with the proof that no cheaper one does.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FrontSet {
    /// Candidates that are measured.
    pub outputs: Vec<String>,
    /// Sum of the costs of these candidates, dimensionless.
    pub cost: f64,
    /// Worst degree: the largest one of the required unknowns.
    pub degree: usize,
    /// Observable degree up to which no cheaper set makes all required unknowns observable; null if no
    /// cheaper set does so with any degree that `max_degree` allows.
    pub below: Option<usize>,
    /// Proof: every set with degrees of at most `below` and `max_degree` holds a candidate of each of these
    /// groups, since all candidates outside a group fail together; the cheapest choice has the cost of this
    /// set if `examined` is 0.
    pub one_of_each: Vec<Vec<String>>,
    /// Number of sets that hold a candidate of each group, cost less than this set, and were judged one by
    /// one: all of them fail.
    pub examined: usize,
}

/// Cheapest set for one unknown.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SensorUnknown {
    /// Name of the unknown, as in the model.
    pub name: String,
    /// Unit of the unknown, as in the model file.
    pub unit: String,
    /// True if it is one of the required unknowns.
    pub required: bool,
    /// Cheapest set that makes the unknown observable, of the smallest degree at this cost; null if all
    /// candidates together do not, or if the search ended before.
    pub cheapest: Option<SensorSet>,
    /// Observable degree of the unknown with the outputs of the model alone; null if it is not observable,
    /// if sets replace the outputs, or if the search ended before.
    pub own_degree: Option<usize>,
    /// Observable degree of the unknown if all candidates are measured; null if it is not observable.
    pub least_degree: Option<usize>,
}
