//! The answer for one scheme: plain data, serialisable, with its JSON Schema.

use schemars::JsonSchema;
use serde::Serialize;

use crate::degree::coefficient::Form;
use crate::degree::status::{Difference, Status};
use crate::model::geometry::Geometry;
use crate::model::slew::Turn;
use crate::model::{Carry, GimbalReport};
use crate::remedies::Remedies;
use crate::solution::formulas::Formula;
use crate::solution::loci::Locus;
use crate::solution::print::{SolutionTerm, StationLabel};
use crate::solution::solve::{FoundBy, Solved, Verification};
use crate::solution::solver::Frame;

/// The answer for one scheme.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Analysis {
    /// `obsdeg.analysis/1`.
    pub schema: String,
    /// Version of the program.
    pub version: String,
    /// What is carried between positions.
    pub carry: Carry,
    /// Latitude in degrees; null when generic.
    pub latitude_deg: Option<f64>,
    /// How the gyros are mounted.
    pub geometry: Geometry,
    /// Unknown terms of the gyro model, or `drift`.
    pub terms: String,
    /// Whether psi_y^n is measured.
    pub measured_azimuth: bool,
    /// The positions.
    pub positions: Vec<PositionReport>,
    /// Where the terms of solutions are taken: the positions, and attitudes of rotations.
    pub stations: Vec<StationLabel>,
    /// `dim V_0, dim V_1, ...`.
    pub rank_profile: Vec<usize>,
    /// The final rank.
    pub rank: usize,
    /// The unknowns in model order.
    pub unknowns: Vec<String>,
    /// Whether accuracy orders were computed: none are for rotating segments, and notes say why else.
    pub has_accuracy_orders: bool,
    /// The verdicts, best first.
    pub quantities: Vec<Quantity>,
    /// Observable combinations beyond single unknowns, by degree, and those asked for.
    pub combinations: Vec<CombinationReport>,
    /// Basis of the directions that Z does not see (unknowns that are not excited left out).
    pub null_space: Vec<Vec<Component>>,
    /// The verdicts under the other carries, where they differ.
    pub carries: Vec<CarryReport>,
    /// Changes that make the unobservable unknowns observable.
    pub to_resolve: Remedies,
    /// Conditions on generic angles under which the verdict changes.
    pub degenerate_loci: Option<Vec<Locus>>,
    /// Formulas of Z and its derivatives, position by position.
    pub formulas: Option<Vec<Formula>>,
    /// Axes of Z in solutions.
    pub frame: Frame,
    /// Angles and turns beyond the gimbal limits that the scheme states; left out where it states none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gimbals: Option<GimbalReport>,
    /// How certain all this is.
    pub certainty: Certainty,
    /// What could not be said, and why.
    pub notes: Vec<String>,
}

/// One position.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PositionReport {
    /// Its name.
    pub name: String,
    /// Euler angles alpha, beta, gamma in degrees, or names.
    pub angles_deg: [AngleReport; 3],
    /// Where X_p, Y_p, Z_p point, for a cardinal attitude.
    pub attitude: Option<String>,
    /// The rotation that starts there, such as `X_p:360`.
    pub rotation: Option<String>,
    /// The turns that lead there from the position before, where torquer errors act on them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub turns: Vec<Turn>,
    /// Gravity in platform axes (at the start of a rotation), in g; null for generic angles.
    pub g_c: Option<[f64; 3]>,
}

/// An angle.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum AngleReport {
    /// Degrees.
    Degrees(f64),
    /// A generic angle.
    Generic(String),
}

impl std::fmt::Display for AngleReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Degrees(x) => write!(f, "{x}"),
            Self::Generic(s) => f.write_str(s),
        }
    }
}

/// The verdict on one unknown.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Quantity {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Whether it can be solved.
    pub status: Status,
    /// The observable degree; null when it is not observable.
    pub degree: Option<usize>,
    /// The accuracy order: the best error falls with the dwell T as T^-(order + 1/2); null when no dwell
    /// makes it observable.
    pub accuracy_order: Option<usize>,
    /// Unknowns that it cannot be told from: those that share with it a direction that Z does not see and that holds no shorter one.
    pub partners: Vec<String>,
    /// How it is solved.
    pub solution: Option<Solution>,
    /// Where it would be observable.
    pub elsewhere: Option<Elsewhere>,
}

/// Degrees of an unobservable unknown under other conditions; null where it stays unobservable or the
/// condition is the given one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Elsewhere {
    /// At other latitudes (the given one is special).
    pub other_latitudes: Option<usize>,
    /// With the same number of positions at generic angles.
    pub other_angles: Option<usize>,
}

/// A solving expression.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Solution {
    /// The expression in one line.
    pub text: String,
    /// Its terms one by one.
    pub terms: Vec<SolutionTerm>,
    /// Whether derivatives in it are taken while the platform turns: at stations with a rate.
    pub turning: bool,
    /// How exact its coefficients are.
    pub form: Form,
    /// Where its coefficients come from.
    pub found_by: FoundBy,
    /// How it was checked.
    pub verification: Verification,
    /// The same as computed, for formatting.
    #[serde(skip)]
    #[schemars(skip)]
    pub solved: Solved,
}

/// An observable combination, or one that was asked for.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CombinationReport {
    /// The combination.
    pub expression: String,
    /// Whether it was asked for.
    pub requested: bool,
    /// Whether it can be solved.
    pub status: Status,
    /// Its observable degree.
    pub degree: Option<usize>,
    /// Its accuracy order.
    pub accuracy_order: Option<usize>,
    /// How it is solved.
    pub solution: Option<Solution>,
}

/// One component of a null vector.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Component {
    /// The unknown.
    pub name: String,
    /// Its coefficient; null when it was not computed.
    pub coefficient: Option<String>,
}

/// What changes under another carry.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CarryReport {
    /// The carry.
    pub carry: Carry,
    /// Its rank profile.
    pub rank_profile: Vec<usize>,
    /// Its number of unknowns.
    pub unknowns: usize,
    /// The unknowns of both carries whose verdict differs.
    pub differs: Vec<Difference>,
}

/// How certain the verdicts are.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Certainty {
    /// The method, in words.
    pub method: String,
    /// Bound on the probability that any verdict is wrong.
    pub error_bound: f64,
    /// The two primes, as text (61 bits).
    pub primes: [String; 2],
    /// The seed of all random choices.
    pub seed: u64,
}
