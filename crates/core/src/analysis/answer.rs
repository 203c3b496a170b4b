//! The answer for one scheme: plain data, serialisable, with its JSON Schema.

use schemars::JsonSchema;
use serde::Serialize;

use crate::degree::coefficient::Form;
use crate::degree::status::{Difference, Status};
use crate::engine::EngineBusy;
use crate::model::geometry::Geometry;
use crate::model::slew::Turn;
use crate::model::{Carry, GimbalReport};
use crate::omitted::OmittedVerdicts;
use crate::remedies::Remedies;
use crate::solution::formulas::Formula;
use crate::solution::loci::Locus;
use crate::solution::print::{SolutionTerm, StationLabel};
use crate::solution::solve::{FoundBy, Solved, Verification};
use crate::solution::solver::Frame;
use crate::why::Why;

pub use crate::why::Component;

/// Analysis of one scheme: verdicts, solutions and remedies.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Analysis {
    /// Layout of this answer: `obsdeg.analysis/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Carry: quantity that continues from one position to the next.
    pub carry: Carry,
    /// Latitude in degrees; null when generic.
    pub latitude_deg: Option<f64>,
    /// Mounting of the gyros and accelerometers.
    pub geometry: Geometry,
    /// Unknown terms of the gyro model, or `drift`.
    pub terms: String,
    /// True if psi_y^n is measured.
    pub measured_azimuth: bool,
    /// Positions of the scheme, in order of time.
    pub positions: Vec<PositionReport>,
    /// Stations: points at which the derivatives in solutions are taken, that is the positions and attitudes
    /// during rotations.
    pub stations: Vec<StationLabel>,
    /// Rank profile: dim V_0, dim V_1, ..., the rank of the derivatives of Z up to each order.
    pub rank_profile: Vec<usize>,
    /// Rank of all derivatives of Z up to the last order.
    pub rank: usize,
    /// Names of the unknowns, in model order.
    pub unknowns: Vec<String>,
    /// True if accuracy orders were computed. They are not for rotating segments; notes give other reasons.
    pub has_accuracy_orders: bool,
    /// Verdicts on the unknowns, best first.
    pub quantities: Vec<Quantity>,
    /// Observable combinations beyond single unknowns, by degree, and those asked for.
    pub combinations: Vec<CombinationReport>,
    /// Basis of the directions that Z does not observe, without unknowns that are not excited.
    pub null_space: Vec<Vec<Component>>,
    /// Verdicts under the other carries, where they differ.
    pub carries: Vec<CarryReport>,
    /// Exact classes of the errors that the scheme does not estimate; null with `--omitted off` and where
    /// none are computed (rotating segments, the drift as unknown, very many columns).
    pub omitted: Option<OmittedVerdicts>,
    /// Changes that make the unobservable unknowns observable.
    pub to_resolve: Remedies,
    /// Explanations of the verdicts that `--why` names; left out without it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub why: Vec<Why>,
    /// Conditions on generic angles under which a verdict changes; null if they were not computed.
    pub degenerate_loci: Option<Vec<Locus>>,
    /// Reason why `degenerate_loci` may lack some, or was not computed although angles are generic; null if
    /// it has all that one equation describes.
    pub degenerate_loci_incomplete: Option<String>,
    /// Formulas of Z and its derivatives, position by position; null if not asked for.
    pub formulas: Option<Vec<Formula>>,
    /// Axes in which Z is printed in solutions.
    pub frame: Frame,
    /// Angles and turns beyond the gimbal limits of the scheme; left out where it states none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gimbals: Option<GimbalReport>,
    /// Certainty of the verdicts: method, error bound, primes and seed.
    pub certainty: Certainty,
    /// Limitations of this answer, each with its reason.
    pub notes: Vec<String>,
    /// Mark of an answer without the formulas that need the symbolic engine, because other processes held it
    /// for the whole of --engine-wait; null otherwise.
    pub engine_busy: Option<EngineBusy>,
}

/// Position of the scheme, with gravity in platform axes.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PositionReport {
    /// Name of the position in the scheme.
    pub name: String,
    /// Euler angles alpha, beta, gamma in degrees, or names of generic angles.
    pub angles_deg: [AngleReport; 3],
    /// Directions of X_p, Y_p, Z_p for a cardinal attitude, as in "NUE"; null for others.
    pub attitude: Option<String>,
    /// Rotation that starts at the position, such as `X_p:360`; null for none.
    pub rotation: Option<String>,
    /// Turns from the position before to this one, where torquer errors act on them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub turns: Vec<Turn>,
    /// Gravity in platform axes (at the start of a rotation), in g; null for generic angles.
    pub g_c: Option<[f64; 3]>,
}

/// Angle in degrees, or name of a generic angle.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum AngleReport {
    /// Value of the angle, in degrees.
    Degrees(f64),
    /// Name of a generic angle, of unknown value.
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

/// Verdict on one unknown of a scheme.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Quantity {
    /// Name of the unknown, as in the model.
    pub name: String,
    /// Unit of the unknown: deg, deg/h, deg/h/g, ...
    pub unit: String,
    /// Verdict: observable, inseparable or not excited.
    pub status: Status,
    /// Observable degree: the smallest order of derivatives that determines the unknown; null if it is not
    /// observable.
    pub degree: Option<usize>,
    /// Accuracy order: the best error falls with the dwell T as T^-(order + 1/2); null if no dwell makes it
    /// observable.
    pub accuracy_order: Option<usize>,
    /// Unknowns indistinguishable from it: those in a common unobservable direction of minimal support.
    pub partners: Vec<String>,
    /// Solving expression of the unknown; null if there is none.
    pub solution: Option<Solution>,
    /// Degrees under conditions where the unknown is observable; null if it is observable, or under none of
    /// them.
    pub elsewhere: Option<Elsewhere>,
}

/// Observable degrees of an unobservable unknown under other conditions; each is null if the unknown stays
/// unobservable or the condition is the given one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Elsewhere {
    /// Observable degree at other latitudes; null unless the given one is special (equator, pole), or if
    /// unobservable there too.
    pub other_latitudes: Option<usize>,
    /// Observable degree with the same number of positions at generic angles; null if unobservable there too,
    /// or if they were not judged.
    pub other_angles: Option<usize>,
}

/// Solving expression of an unknown or a combination.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Solution {
    /// Solving expression in one line.
    pub text: String,
    /// Terms of the solving expression, one by one.
    pub terms: Vec<SolutionTerm>,
    /// True if derivatives in it are taken while the platform turns: at stations with a rate.
    pub turning: bool,
    /// Form of its coefficients: exact, symbolic or decimal.
    pub form: Form,
    /// Source of its coefficients: prime fields, symbolic engine or floating point.
    pub found_by: FoundBy,
    /// Check that the expression passed before it was printed.
    pub verification: Verification,
    /// The same as computed, for formatting.
    #[serde(skip)]
    #[schemars(skip)]
    pub solved: Solved,
}

/// Observable combination of unknowns, or one that was asked for.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CombinationReport {
    /// Combination of unknowns, as an expression.
    pub expression: String,
    /// True if the combination was asked for.
    pub requested: bool,
    /// Verdict: observable, inseparable or not excited.
    pub status: Status,
    /// Observable degree of the combination; null if it is not observable.
    pub degree: Option<usize>,
    /// Accuracy order of the combination, as of an unknown; null if no dwell makes it observable.
    pub accuracy_order: Option<usize>,
    /// Solving expression of the combination; null if there is none.
    pub solution: Option<Solution>,
}

/// Verdicts of the scheme under another carry.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CarryReport {
    /// Carry for which these verdicts hold.
    pub carry: Carry,
    /// Rank profile under this carry: dim V_0, dim V_1, ...
    pub rank_profile: Vec<usize>,
    /// Number of unknowns under this carry.
    pub unknowns: usize,
    /// Unknowns of both carries whose verdict differs.
    pub differs: Vec<Difference>,
}

/// Certainty of the verdicts: method, error bound, primes and seed.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Certainty {
    /// Method of the verdicts, in words.
    pub method: String,
    /// Bound on the probability that any verdict is wrong.
    pub error_bound: f64,
    /// Random primes of the two prime fields, as text (61 bits).
    pub primes: [String; 2],
    /// Seed of all random choices.
    pub seed: u64,
}
