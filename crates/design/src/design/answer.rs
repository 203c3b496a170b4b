//! Schemes that were found: plain data.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use obsdeg_core::model::{Carry, Geometry, GimbalReport};
use obsdeg_evidence::requirements::Requirements;
use obsdeg_evidence::simulation::omitted::OmittedEffects;
use obsdeg_evidence::simulation::{MeasurementReport, OtherCarry};

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.design/2";

/// Search for the best schemes of candidate attitudes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Design {
    /// Layout of this answer: `obsdeg.design/2`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Carry: quantity that continues from one position to the next.
    pub carry: Carry,
    /// Latitude of the scheme, in degrees.
    pub latitude_deg: f64,
    /// True if the program chose the latitude.
    pub latitude_by_default: bool,
    /// Mounting of the gyros and accelerometers.
    pub geometry: Geometry,
    /// Terms of the error model that are unknown besides psi; all of them are estimated.
    pub terms: String,
    /// Candidate attitudes of the search.
    pub candidates: Vec<String>,
    /// Attitudes that the gimbals do not reach.
    pub beyond_gimbals: Vec<String>,
    /// Number of rotations of the platform axes that turn schemes into equally good ones (1: the identity).
    pub symmetry: usize,
    /// Coefficients that must be observable; the criterion is computed from their sigmas.
    pub required: Vec<String>,
    /// Smallest number of positions that makes every required coefficient observable.
    pub minimum: Minimum,
    /// Search that was done, with its conditions; null when only the minimum was asked for.
    pub search: Option<SearchReport>,
    /// Best schemes that were found, best first.
    pub found: Vec<Found>,
    /// Schemes that no scheme found beats in both total time and criterion, by total time.
    pub front: Vec<Found>,
    /// Schemes that no scheme found beats in both sigma and bias by the bench, by sigma; left out where the
    /// search counts no bench.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bias_front: Vec<BiasPoint>,
    /// True if `bias_front` is of all sequences whose total is at most 100 times the best; false where it is
    /// of those that are best with other sizes of the bench, by exchange.
    #[serde(default)]
    pub bias_front_complete: bool,
    /// Unknowns and families with a stated requirement that is not judged, since only some coefficients are
    /// asked for.
    #[serde(default)]
    pub not_judged: Vec<String>,
    /// Effect of what the first scheme does not estimate, by the weights of its sigmas; null without a
    /// search.
    #[serde(default)]
    pub omitted: Option<OmittedEffects>,
    /// Outcome of the first scheme under the other carries; empty if no scheme was searched.
    #[serde(default)]
    pub other_carries: Vec<OtherCarry>,
    /// Turns of the first scheme beyond the gimbal limits, and positions of the file of candidates whose
    /// angles lie beyond. Left out where no limits are stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gimbals: Option<GimbalReport>,
    /// Number of independent random 61-bit primes by which every set is judged: it counts as observable when
    /// one of them says so.
    pub primes: usize,
    /// Bound on the probability that an observable set was overlooked, or a degree taken too large. Nothing
    /// is called proven unless it is below 1e-12.
    pub error_bound: f64,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Smallest number of positions that makes every required coefficient observable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Minimum {
    /// Number of positions; null if all candidates together are not enough, or if the sets are too many to be
    /// examined.
    pub positions: Option<usize>,
    /// Smallest candidate set that makes all required coefficients observable; empty if none was found.
    pub witness: Vec<String>,
    /// Number of positions below which no set is enough: the required coefficients over the rows of a
    /// position, rounded up (0 where torquer errors act in every turn).
    pub counting_bound: usize,
    /// Largest number of independent rows on the unknowns that a candidate adds, under reset carry without
    /// those that its psi takes.
    pub rows_per_position: usize,
    /// Sets excluded by exhaustion: `[size, number of sets]`, none of which is enough.
    pub none_of: Vec<[u64; 2]>,
    /// Coefficients that all candidates together leave unobservable.
    pub never: Vec<String>,
    /// True if `positions` is proven minimal, or the coefficients in `never` proven unobservable: no smaller
    /// set was left out, and the bound on the probability of an error is below 1e-12.
    pub proven: bool,
}

/// Search for the best schemes, with its conditions and coverage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SearchReport {
    /// Number of positions of every scheme.
    pub positions: usize,
    /// Conditions of every sigma: the information of all samples on psi and all coefficients, with the stated
    /// random drift and priors. Every position has the dwell, slews are about the eigenaxis, Z is not used
    /// meanwhile.
    pub conditions: MeasurementReport,
    /// Random drift that is stated: the search leaves it out, and the figures of all listed schemes include
    /// it; null for none.
    pub drift_noise: Option<String>,
    /// Priors that are stated, which sigmas and the bound include beside the samples; null for none. The
    /// samples alone decide observability.
    pub prior: Option<String>,
    /// Criterion that orders schemes: worst, A, D, E or margin.
    pub criterion: String,
    /// Unit of the criterion: deg/h (per g), ug (per g), ppm or arcsec; null for margin, and for D of
    /// coefficients in several units, each in its own.
    pub unit: Option<String>,
    /// Number of sequences whose sigma was computed.
    pub examined: u64,
    /// Number of examined sequences that the exact verdict, of repositioning at once, calls observable, but
    /// whose samples do not determine every required coefficient in double precision. They rank below all
    /// others.
    pub lost: u64,
    /// Number of sequences, up to turns of the platform axes, in an exhaustive search if the search was not
    /// exhaustive (`within` 0); null if it was, and if they are too many to be held or counted.
    pub sequences: Option<u64>,
    /// Number of sequences, observable or not, that a bound excluded from examination: in double precision
    /// their criterion is larger than that of all listed.
    pub excluded: u64,
    /// True if no sequence of candidates within the constraints is better than the first, by exhaustion or by
    /// a bound: none has a smaller worst degree, or the same and a smaller criterion. With `parts` this holds
    /// if the parts were searched as they state.
    pub proven: bool,
    /// Parts that the answer was put together from; left out for a search as a whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parts: Option<PartsReport>,
    /// Number of sequences as good as the first; null if the search was not exhaustive.
    pub ties: Option<TiesReport>,
    /// True if orders of the same positions count as different schemes.
    pub order_matters: bool,
    /// True if the search was interrupted; if the first is proven nevertheless, before the front was
    /// complete.
    pub interrupted: bool,
    /// Smallest worst degree that all candidates together allow; null if torquer errors act during slews, so
    /// that sets have no degree.
    pub degree_floor: Option<usize>,
    /// Constraints of the search, in words.
    pub constraints: Vec<String>,
    /// Number of schemes of least sigma that were ranked by total uncertainty, and left out if not immune,
    /// where the search does not count errors that are not estimated; left out where it counts them, and
    /// where none is stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ranked: Option<usize>,
    /// Bound on the criterion of the best scheme; null if no such bound is known: under platform and inertial
    /// carry, and where the noise of Z is correlated, information is no sum over positions.
    pub certificate: Option<Certificate>,
}

/// Parts of a search that were put together: every sequence that they list was evaluated again, and their
/// starts and counts add up to the whole.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PartsReport {
    /// Number of parts put together.
    pub parts: usize,
    /// Versions of the program that searched the parts, each once.
    pub versions: Vec<String>,
    /// Number of blocks of starts in all parts, at all worst degrees that were searched.
    pub blocks: usize,
    /// Number of blocks, chosen at random, that were searched again with the same result (`--check`).
    pub searched_again: usize,
}

impl PartsReport {
    /// True if every block was searched again, so that nothing rests on the parts.
    pub fn is_repeated(&self) -> bool {
        self.searched_again == self.blocks
    }
}

/// Bound on the criterion of the best scheme of the same number of these candidates, from the optimal weights
/// of the candidates (approximate design theory). It holds for schemes of any worst degree, within the
/// constraints or not, and allows for the rounding in its evaluation; the information of each position is in
/// double precision, the same as in the search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Certificate {
    /// Lower bound on the criterion of schemes of the same number of these candidates, equal dwells, in the
    /// unit of `unit`.
    pub best_possible: f64,
    /// Largest excess of the first unrefined scheme's criterion over the bound, in percent of the bound.
    pub within_percent: f64,
    /// Efficiency, dimensionless, 0 to 1: square of the bound over that criterion, the least fraction of the
    /// best possible information (for D the D-efficiency).
    pub efficiency: f64,
    /// Relative rounding tolerance of that criterion, dimensionless, by the residual of the inverse; it is
    /// added before the criterion is compared with the bound. Null if the remaining unknowns are not
    /// determined: then it is unknown and nothing is added.
    pub rounding: Option<f64>,
    /// Criterion that the weights would have as a scheme, exactly as they are listed, in the unit of `unit`;
    /// the bound cannot be larger.
    pub attained: f64,
    /// Weights that divide the time among the candidates: fractions of their sum, rounded to two digits, or
    /// to as many as lose no more than a thousandth of the variance; those below 1e-7 are left out.
    pub weights: Vec<Weight>,
    /// Bound for any attitudes instead of the candidates; null if it was not asked for.
    pub everywhere: Option<EverywhereReport>,
    /// Lower bound over time: `[total time in s, criterion in the unit of unit]`. No scheme of these
    /// candidates, in equal dwells and one of the numbers of positions asked for, is below at this time.
    pub front: Vec<[f64; 2]>,
}

/// Bound on the criterion of the best scheme of any attitudes, whatever the candidates and the gimbals are,
/// without requirements on psi. Attitudes are added where they contribute most. Between the points of a net
/// of 3 degrees their contribution is bounded as a trigonometric polynomial, and rounding with it, so that
/// the bound holds for all.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EverywhereReport {
    /// Lower bound on the criterion of schemes of the same number of any attitudes, equal dwells, in the unit
    /// of `unit`.
    pub best_possible: f64,
    /// Largest excess of the first unrefined scheme's criterion over the bound, in percent of the bound.
    pub within_percent: f64,
    /// Relative rounding tolerance of that criterion, dimensionless, with that of the attitudes of the
    /// scheme; null if it is unknown.
    pub rounding: Option<f64>,
    /// Criterion that the weights would have as a scheme, in the unit of `unit`: all of them, with angles to
    /// hundredths of a degree and weights as they are rounded here.
    pub attained: f64,
    /// Ten heaviest attitudes, each once, with their weights, heaviest first: Euler angles in degrees, beta
    /// up to 90, the others above -180 and up to 180. Weights are fractions of the sum of all, rounded to two
    /// digits, or to as many as lose no more than a thousandth of the variance; those below 1e-7 are left
    /// out.
    pub weights: Vec<Weight>,
    /// Number of lighter attitudes, which are not listed.
    pub lighter: usize,
    /// Sum of the weights of the lighter attitudes, dimensionless, 0 to 1.
    pub lighter_weight: f64,
    /// Rounding of the angles of free attitudes, and its cost; null if candidates were given.
    pub rounded: Option<Rounded>,
}

/// Rounding of the angles of free attitudes: every scheme is evaluated at the rounded angles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rounded {
    /// Step of the angles, in degrees. Exceptions: the cardinal attitudes, which may be chosen too, and
    /// angles that gimbal limits require: the twin (alpha+180, 180-beta, gamma+180) of rounded angles, and at
    /// beta = +-90 another alpha.
    pub step_deg: f64,
    /// Better scheme, by the same search with angles in hundredths of a degree; null if none was found.
    pub finer: Option<Finer>,
}

/// Better scheme that rounding of the angles excludes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Finer {
    /// Criterion of the scheme, in the unit of `unit`.
    pub value: f64,
    /// Euler angles of its positions, in degrees.
    pub angles: Vec<String>,
}

/// Candidate attitude with its weight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Weight {
    /// Candidate attitude: its name, or its Euler angles in degrees.
    pub candidate: String,
    /// Weight of the candidate: its fraction of all positions, dimensionless, as it is before the division by
    /// the sum of all.
    pub weight: f64,
}

/// Number of sequences that are as good as the best.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TiesReport {
    /// Number of sequences as good as the best, with the best and all images under turns of the platform
    /// axes.
    pub sequences: u64,
    /// Largest relative difference of two criteria, in double precision and dimensionless, that counts as
    /// equal; their worst degrees must be equal too.
    pub within: f64,
}

/// Scheme on the front of sigma against bias: all figures in the unit of the criterion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BiasPoint {
    /// Candidates of the scheme, in order of time.
    pub positions: Vec<String>,
    /// Criterion of the sigmas alone, in the unit of the criterion.
    pub sigma: f64,
    /// Criterion of what the errors of the bench add alone, in the unit of the criterion.
    pub bias: f64,
    /// Criterion of the total uncertainties, in the unit of the criterion.
    pub total: f64,
}

/// Scheme that the search found, with its figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Found {
    /// Candidates of the scheme, in order of time.
    pub positions: Vec<String>,
    /// Index, from 1, of the scheme listed before that a turn of the platform axes turns into this one
    /// (coefficients renamed): the same scheme in other axes; null for none.
    pub image_of: Option<usize>,
    /// Gimbal angles alpha,beta,gamma of the positions, in degrees: within the gimbal limits, each with the
    /// shortest gimbal path from the position before (without limits as the candidates have them, in (-180,
    /// 180]).
    pub angles: Vec<String>,
    /// Half turns between the positions, each with its direction; the other direction makes another scheme.
    pub half_turns: Vec<HalfTurn>,
    /// True if its angles were refined continuously.
    pub refined: bool,
    /// Dwell of each position, in s; the mean if the dwells differ.
    pub dwell_s: f64,
    /// Dwell of each position, in s, if the total time was divided among the positions; empty if the dwells
    /// are equal. Moving 1/256 of an equal dwell (at least the time between samples) from one position to
    /// another makes none of them better.
    pub dwells_s: Vec<f64>,
    /// Total time with turns, in s.
    pub total_s: f64,
    /// Criterion of the scheme, in the unit of `unit`, with a bench of its total uncertainties; for margin
    /// the largest sigma over its requirement, psi included where it counts.
    pub value: f64,
    /// Largest sigma of a required drift coefficient, in deg/h (per g): information of all samples, prior if
    /// one is stated, no drift noise; with a bench the largest total uncertainty; null if none is required.
    pub worst_sigma_dph: Option<f64>,
    /// Coefficient with the largest sigma; null if none is required.
    pub worst: Option<String>,
    /// Outcome of the requirements on the required coefficients, and on psi (of the start, under reset carry
    /// of every position) if every coefficient is required.
    pub requirements: Requirements,
    /// Largest observable degree of a required coefficient.
    pub worst_degree: usize,
    /// Largest accuracy order of a required coefficient; null if it was not computed.
    pub worst_accuracy_order: Option<usize>,
    /// Rank by derivatives, exact, then the number of unknowns.
    pub rank: [usize; 2],
}

/// Half turn to a position, with its direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HalfTurn {
    /// Index, from 1, of the position that the half turn leads to.
    pub to: usize,
    /// Axis of the half turn, right-handed: a unit vector (North, Up, East), dimensionless.
    pub about: [f64; 3],
}
