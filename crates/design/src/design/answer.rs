//! Schemes that were found: plain data.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use obsdeg_core::model::{Carry, Geometry, GimbalReport};
use obsdeg_evidence::requirements::Requirements;
use obsdeg_evidence::simulation::{MeasurementReport, OtherCarry};

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.design/2";

/// The result of a search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Design {
    /// `obsdeg.design/2`.
    pub schema: String,
    /// Version of the program.
    pub version: String,
    /// What is carried between positions.
    pub carry: Carry,
    /// Latitude in degrees.
    pub latitude_deg: f64,
    /// Whether the latitude was chosen by the program.
    pub latitude_by_default: bool,
    /// Axes of the gyros.
    pub geometry: Geometry,
    /// Unknown besides psi; all of them are estimated.
    pub terms: String,
    /// The attitudes to choose from.
    pub candidates: Vec<String>,
    /// Attitudes that the gimbals do not reach.
    pub beyond_gimbals: Vec<String>,
    /// Rotations of the platform axes that turn schemes into equally good ones (1: the identity).
    pub symmetry: usize,
    /// Coefficients that must be observable, and that the criterion is about.
    pub required: Vec<String>,
    /// The fewest positions.
    pub minimum: Minimum,
    /// What was searched; null when only the minimum was asked for.
    pub search: Option<SearchReport>,
    /// The best schemes, best first.
    pub found: Vec<Found>,
    /// Schemes that none found beats in both total time and criterion, by total time.
    pub front: Vec<Found>,
    /// Unknowns and families with a stated requirement that is not judged, since only some coefficients are
    /// asked for.
    #[serde(default)]
    pub not_judged: Vec<String>,
    /// The first scheme under the other carries; empty where none was searched.
    #[serde(default)]
    pub other_carries: Vec<OtherCarry>,
    /// Turns of the first scheme beyond the gimbal limits, and positions of the file of candidates whose
    /// angles lie beyond. Left out where no limits are stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gimbals: Option<GimbalReport>,
    /// How many independent random 61-bit primes every set is judged by: it counts as observable when one of them says so.
    pub primes: usize,
    /// Bound on the probability that an observable set was overlooked, or a degree taken too large; nothing is called proven unless it is
    /// below 1e-12.
    pub error_bound: f64,
    /// Seed of all random choices.
    pub seed: u64,
}

/// The fewest positions that make every required coefficient observable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Minimum {
    /// Their number; null when all candidates together do not do, or when the sets are too many to be examined.
    pub positions: Option<usize>,
    /// A set that does.
    pub witness: Vec<String>,
    /// No fewer can do: the required coefficients over the rows of a position, rounded up (0 where torquer errors act in every turn).
    pub counting_bound: usize,
    /// The most independent rows on the unknowns that a candidate adds, under reset carry without those that its psi takes.
    pub rows_per_position: usize,
    /// `[size, number of sets]`: none of these does, by exhaustion.
    pub none_of: Vec<[u64; 2]>,
    /// Coefficients that all candidates together leave unobservable.
    pub never: Vec<String>,
    /// Whether `positions` is the fewest, or `never` is never, by more than rounding and chance: nothing smaller was left out, and the
    /// bound on the probability of an error is below 1e-12.
    pub proven: bool,
}

/// What was searched, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SearchReport {
    /// The number of positions.
    pub positions: usize,
    /// Conditions of every sigma: the information of all samples on psi and all coefficients, with the random
    /// drift and the priors that are stated. Every position has the dwell, slews are about the eigenaxis, Z
    /// is not used meanwhile.
    pub conditions: MeasurementReport,
    /// Random drift that is stated: the search leaves it out, and the figures of all schemes that are listed
    /// count it; null: none.
    pub drift_noise: Option<String>,
    /// Knowledge beforehand that sigmas and the bound count beside the samples: the priors that are stated; null: none. What is observable is
    /// by the samples alone.
    pub prior: Option<String>,
    /// What makes a scheme better: worst, A, D, E or margin.
    pub criterion: String,
    /// Its unit: deg/h (per g), ug (per g), ppm or arcsec; null for margin, and for D of coefficients in several units, each in its own.
    pub unit: Option<String>,
    /// Sequences whose sigma was computed.
    pub examined: u64,
    /// Of these, sequences that the exact verdict, of repositioning at once, calls observable, but whose samples do not determine every
    /// required coefficient as far as double precision tells: they count as worse than all others.
    pub lost: u64,
    /// Number of sequences, up to turns of the platform axes, that a search of all would go through where not
    /// all were searched (`within` 0); null where all were, and where they are too many to be held or
    /// counted.
    pub sequences: Option<u64>,
    /// Sequences, observable or not, that were not examined because a bound leaves no doubt: as far as double precision tells their criterion is
    /// larger than that of all listed.
    pub excluded: u64,
    /// Whether no sequence of candidates within the constraints is better than the first, by exhaustion, or because a bound excludes the rest:
    /// none has a smaller worst degree, or the same and a smaller criterion.
    pub proven: bool,
    /// How many sequences are as good as the first; null where not all were searched.
    pub ties: Option<TiesReport>,
    /// Whether orders of the same positions count as different schemes.
    pub order_matters: bool,
    /// Whether the search was interrupted; if the first is proven nevertheless, before the front was complete.
    pub interrupted: bool,
    /// The smallest worst degree that all candidates together allow; null where torquer errors act on the way, so that sets have no degree.
    pub degree_floor: Option<usize>,
    /// The constraints in words.
    pub constraints: Vec<String>,
    /// How good the best can be; null where no such bound is known: under platform and inertial carry, and where the noise of Z is
    /// correlated, information is no sum over positions.
    pub certificate: Option<Certificate>,
}

/// How good the best scheme of so many of these candidates can be: a bound from the optimal weights of the candidates (approximate design
/// theory). It holds for schemes of any worst degree, within the constraints or not, and allows for the rounding in its evaluation; the
/// information of each position is as double precision gives it, the same as in the search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Certificate {
    /// No scheme of so many of these candidates, equal dwells, has a smaller criterion.
    pub best_possible: f64,
    /// The criterion of the first scheme that is not refined is at most so much above, in percent of the bound.
    pub within_percent: f64,
    /// The square of the bound over that criterion: how much of the information that the best could have it has at least (for D the D-efficiency).
    pub efficiency: f64,
    /// What rounding may hide of that criterion, as a part of it: it is added before the criterion is held against the bound. By the residual
    /// of the inverse; null where what does not count is not determined, so that nothing is known of it and nothing added.
    pub rounding: Option<f64>,
    /// The criterion that the weights would have as a scheme, exactly as they are listed; the bound cannot be larger.
    pub attained: f64,
    /// How the weights divide the time among the candidates: parts of their sum, rounded to two digits, or to as many as lose no
    /// more than a thousandth of the variance; those below 1e-7 are left out.
    pub weights: Vec<Weight>,
    /// The same for all attitudes; null where it was not asked for.
    pub everywhere: Option<EverywhereReport>,
    /// `[total time in s, criterion]`: no scheme of these candidates, in equal dwells and one of the numbers of positions asked for, is below at
    /// this time.
    pub front: Vec<[f64; 2]>,
}

/// How good the best scheme of any attitudes can be, whatever the candidates and the gimbals are; requirements on psi left out. Attitudes are
/// taken up where they add most; between the points of a net of 3 degrees what they add is bounded as a trigonometric polynomial, and rounding
/// with it, so that the bound holds for all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EverywhereReport {
    /// No scheme of so many attitudes, equal dwells, has a smaller criterion.
    pub best_possible: f64,
    /// The criterion of the first scheme that is not refined is at most so much above, in percent of the bound.
    pub within_percent: f64,
    /// What rounding may hide of that criterion, as a part of it: as above, that of the attitudes of the scheme with it.
    pub rounding: Option<f64>,
    /// The criterion that the weights would have as a scheme: all of them, with angles to hundredths of a
    /// degree and weights as they are rounded here.
    pub attained: f64,
    /// The ten heaviest attitudes, each once, with their weights, heaviest first: Euler angles in degrees,
    /// beta up to 90, the others above -180 and up to 180. Weights are parts of the sum of all, rounded to
    /// two digits, or to as many as lose no more than a thousandth of the variance; those below 1e-7 are left
    /// out.
    pub weights: Vec<Weight>,
    /// Number of lighter attitudes, which are not listed.
    pub lighter: usize,
    /// Sum of the weights of the lighter attitudes.
    pub lighter_weight: f64,
    /// Where attitudes were free: how their angles were rounded, and what that costs; null where candidates were given.
    pub rounded: Option<Rounded>,
}

/// Free attitudes with rounded angles: every scheme is evaluated at the angles as they are rounded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rounded {
    /// Angles are multiples of so many degrees, but for the cardinal attitudes, which may be chosen too, and
    /// for what gimbal limits ask for: the twin (alpha+180, 180-beta, gamma+180) of such angles, and at beta
    /// = +-90 another alpha.
    pub step_deg: f64,
    /// A better scheme, by the same search with angles in hundredths of a degree; null where none was found.
    pub finer: Option<Finer>,
}

/// A scheme that rounding leaves out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Finer {
    /// Its criterion.
    pub value: f64,
    /// Euler angles of its positions in degrees.
    pub angles: Vec<String>,
}

/// A candidate and its weight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Weight {
    /// The candidate.
    pub candidate: String,
    /// Its part of all positions, before it is divided by the sum of all.
    pub weight: f64,
}

/// Sequences that are as good as the best.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TiesReport {
    /// How many, the best and all their images under turns of the platform axes among them.
    pub sequences: u64,
    /// Two tie when their worst degrees are equal and their criteria, as double precision gives them, differ by less than this part.
    pub within: f64,
}

/// A scheme that was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Found {
    /// Its positions in order.
    pub positions: Vec<String>,
    /// Which of those listed before it, counted from 1, a turn of the platform axes turns into it (coefficients renamed): the same scheme in
    /// other axes; null: none.
    pub image_of: Option<usize>,
    /// Their gimbal angles alpha,beta,gamma in degrees: within the gimbal limits, each with the shortest
    /// gimbal way from the position before (without limits as the candidates have them, in (-180, 180]).
    pub angles: Vec<String>,
    /// The half turns between them, each with its direction: the other one is another scheme.
    pub half_turns: Vec<HalfTurn>,
    /// Its angles were refined continuously.
    pub refined: bool,
    /// Dwell of each position, in s; the mean where they have dwells of their own.
    pub dwell_s: f64,
    /// Where the total time was divided among the positions: the dwell of each, in s; empty where they are equal. Moving a two hundred and
    /// fifty-sixth of an equal dwell (at least the time between samples) from one position to another makes none of them better.
    pub dwells_s: Vec<f64>,
    /// Total time with turns, in s.
    pub total_s: f64,
    /// The criterion: a sigma in its unit, or for margin the largest sigma over its requirement, psi's too where it counts.
    pub value: f64,
    /// The largest sigma of a required drift coefficient in deg/h (per g): information of all samples, prior if one is stated, no drift noise; null when
    /// none is required.
    pub worst_sigma_dph: Option<f64>,
    /// The coefficient that has it.
    pub worst: Option<String>,
    /// What became of the requirements on what must be observable, and on psi (of the start, under reset carry of every position) when that is
    /// every coefficient.
    pub requirements: Requirements,
    /// Its largest degree of a required coefficient.
    pub worst_degree: usize,
    /// Its largest accuracy order of a required coefficient.
    pub worst_accuracy_order: Option<usize>,
    /// Its exact rank by derivatives, and the number of unknowns.
    pub rank: [usize; 2],
}

/// Half a turn to a position.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HalfTurn {
    /// Which position it leads to, counted from 1.
    pub to: usize,
    /// The axis, about which it is right-handed: a unit vector (North, Up, East).
    pub about: [f64; 3],
}
