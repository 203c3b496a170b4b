//! Data of the answer for one system, serialisable, and the options of its analysis.

use schemars::JsonSchema;
use serde::Serialize;

use super::super::branches::BranchSide;
use super::super::constraints::ConstraintFactor;
use super::super::judge::verdicts::{ByDigits, Judgement, SystemCertainty};
use crate::degree::status::Status;
use crate::remedies::Remedies;
use crate::why::Why;

/// Default of [`SystemOptions::count_limit`]: most reference models need less.
pub const COUNT_LIMIT: u64 = 3;

/// Default of [`SystemOptions::relation_limit`]: a fraction of a second, and rarely more than two.
pub const RELATION_LIMIT: u64 = 50;

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.system/1";

/// Analysis of one system: verdicts, combinations, symmetries and remedies.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemAnalysis {
    /// Layout of this answer: `obsdeg.system/1`.
    pub schema: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Name of the system, as in its file.
    pub name: String,
    /// Description of the system, as in its file.
    pub description: String,
    /// Equations as written: `u = ...` of known inputs that are functions of time, definitions, `x' = ...`,
    /// `y = ...`.
    pub equations: Vec<String>,
    /// Rank profile: dim V_0, dim V_1, ..., the rank of the output derivatives up to each order.
    pub rank_profile: Vec<usize>,
    /// Rank of all output derivatives up to the last order.
    pub rank: usize,
    /// Number of unknowns that are judged.
    pub unknowns: usize,
    /// Verdicts on the unknowns, in model order.
    pub quantities: Vec<SystemQuantity>,
    /// States with a known initial value.
    pub known: Vec<String>,
    /// Time at which the first segment was judged: a number, or `generic` (almost every time, as in all later
    /// segments); null if the equations do not depend on time.
    pub time: Option<String>,
    /// Equations that hold at the start; their differentials count as rows of order 0.
    pub constraints: Vec<String>,
    /// Factors that stand for those of these equations that are products: verdicts are those where they are
    /// zero.
    pub constraint_factors: Vec<ConstraintFactor>,
    /// Combinations of unknowns that the model asks for.
    pub combinations: Vec<SystemCombination>,
    /// Number of independent directions that change no output.
    pub unobservable_directions: usize,
    /// Scalings, translations and polynomials among the unobservable directions, exactly; up to the bound on
    /// the order only if `rests_on_bound`.
    pub symmetries: Vec<SymmetryReport>,
    /// Unknowns affected by each remaining unobservable direction: at a generic point, no polynomial that was
    /// found describes it.
    pub other_directions: Vec<Vec<String>>,
    /// Observable combinations of unobservable unknowns.
    pub invariants: Vec<SystemCombination>,
    /// Number of independent identifiable functions of unobservable unknowns that exist beyond `invariants`:
    /// the rank less the observable unknowns less those listed.
    pub missing_functions: usize,
    /// Highest order of derivatives that was examined.
    pub last_order: usize,
    /// Order of derivatives at which the search ends at the latest.
    pub bound: usize,
    /// True for a model in discrete time: orders and degrees count steps, `y[t+1]`, instead of derivatives.
    /// Left out for a model in continuous time.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub discrete: bool,
    /// True if the end is proven: an order that adds nothing is the last. If false, unobservable verdicts
    /// hold up to the bound on the order only.
    pub closed: bool,
    /// True if a verdict holds up to the bound on the order only.
    pub rests_on_bound: bool,
    /// Functions with branches (abs, sign, roots, asin, acos) of unknowns, inputs, generic constants or the
    /// time. The verdicts hold on the branch of points near one, or where the model is undefined there, on
    /// the first branch that was found.
    pub branches: Vec<String>,
    /// Sides of the branches of abs and sign on which the verdicts hold.
    pub branch_sides: Vec<BranchSide>,
    /// Changes that make the unobservable unknowns observable.
    pub to_resolve: Remedies,
    /// Explanations of the verdicts that `--why` names; left out without it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub why: Vec<Why>,
    /// Reason why solving expressions were not sought, or not all of them; null otherwise.
    pub note: Option<String>,
    /// Maps that take every solution to another with the same outputs: `negate q1, q2`, `swap k1 and k2`.
    /// Sought among changes of signs and exchanges of
    /// places, then, of two solutions, among short expressions; empty if none was found.
    pub solution_maps: Vec<String>,
    /// Order of the derivatives with which solutions were counted by elimination; null if none were.
    pub counting_order: Option<usize>,
    /// Number of functions whose values are proven to be independent of each other at a generic point (Ax
    /// 1971, doi:10.2307/1970774), so that random values in prime fields replace them; 0 for a rational
    /// model, null if functions were evaluated in real numbers.
    pub independent_functions: Option<usize>,
    /// Random primes of the two prime fields, as text (61 bits), and a third one for a model so large that
    /// two might be wrong with a probability above 1e-9; null for a model judged in real numbers.
    pub primes: Option<Vec<String>>,
    /// Bound on the probability that a verdict is wrong; null for a model judged in real numbers.
    pub error_bound: Option<f64>,
    /// Margin of the rank decisions in real numbers; null for a model judged in prime fields.
    pub digits: Option<DigitsReport>,
    /// Seed of all random choices.
    pub seed: u64,
}

/// Margin of rank decisions in real numbers of many digits, at two random points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct DigitsReport {
    /// Number of decimal digits at the first and at the second point.
    pub digits: [usize; 2],
    /// Decimal logarithm (dimensionless) of the smallest number, relative to its row, that is proven to
    /// differ from zero.
    pub nonzero_log10: f64,
    /// Decimal logarithm (dimensionless) of the widest error bound, relative to its row, of a number that
    /// counts as zero; null if all were exact.
    pub zero_log10: Option<f64>,
}

/// Verdict on one unknown of a system.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemQuantity {
    /// Name of the unknown, as in the model.
    pub name: String,
    /// Kind of the unknown: state, algebraic, parameter or input.
    pub kind: String,
    /// Unit of the unknown, as in the model file.
    pub unit: String,
    /// Description of the unknown, as in the model file.
    pub description: String,
    /// Verdict: locally observable (no other value nearby gives the same outputs), inseparable from its
    /// partners, not excited, or not resolved up to the bound on the order.
    pub status: Status,
    /// Observable degree: the smallest order of derivatives that determines the unknown; null if it is not
    /// observable.
    pub degree: Option<usize>,
    /// Unknowns indistinguishable from it: those in a common unobservable direction of minimal support.
    pub partners: Vec<String>,
    /// Expression of the unknown in outputs, inputs, their derivatives (up to two orders beyond the degree)
    /// and unknowns of no higher degree, in which it is linear; verified in both fields. Null if none was
    /// found.
    pub solution: Option<String>,
    /// Number of solutions for the unknown; null if it is not observable, or if solutions were not sought.
    pub number_of_solutions: Option<NumberOfSolutions>,
    /// Identifiability of the unknown in the usual terms: `globally_identifiable`, `locally_identifiable`
    /// (the number of solutions is in `number_of_solutions`), `not_identifiable` or `not_decided`.
    pub identifiability: Identifiability,
}

/// Identifiability of an unknown (of a state: observability), in the usual terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Identifiability {
    /// Globally identifiable: the outputs of a generic point have one solution for the unknown.
    GloballyIdentifiable,
    /// Locally identifiable: no other value nearby gives the same outputs; several solutions, or their number
    /// is not decided.
    LocallyIdentifiable,
    /// Not identifiable: values as near as one likes give the same outputs.
    NotIdentifiable,
    /// Not decided: the unknown is not observable up to the bound on the order, where no end is proven.
    NotDecided,
}

impl SystemQuantity {
    /// The quantity with the identifiability that follows from its verdict and its number of solutions.
    pub(super) fn with_identifiability(self) -> Self {
        Self { identifiability: self.identifiability(), ..self }
    }

    /// Identifiability that follows from the verdict and the number of solutions.
    pub(in crate::system) fn identifiability(&self) -> Identifiability {
        match (self.status, &self.number_of_solutions) {
            (
                Status::Observable,
                Some(NumberOfSolutions::OneByExpression | NumberOfSolutions::Counted(1)),
            ) => Identifiability::GloballyIdentifiable,
            (Status::Observable, _) => Identifiability::LocallyIdentifiable,
            (Status::NotSeen, _) => Identifiability::NotDecided,
            (Status::Inseparable | Status::NotExcited, _) => Identifiability::NotIdentifiable,
        }
    }

    /// Identifiability in words, with the number of solutions: `locally identifiable (2 solutions)`.
    pub fn identifiability_words(&self) -> String {
        match (self.identifiability, &self.number_of_solutions) {
            (Identifiability::GloballyIdentifiable, _) => "globally identifiable".into(),
            (Identifiability::LocallyIdentifiable, Some(NumberOfSolutions::Counted(k))) => {
                format!("locally identifiable ({k} solutions)")
            }
            (Identifiability::LocallyIdentifiable, Some(_)) => {
                "locally identifiable (number of solutions not decided)".into()
            }
            (Identifiability::LocallyIdentifiable, None) => {
                "locally identifiable (solutions not counted)".into()
            }
            (Identifiability::NotIdentifiable, _) => "not identifiable".into(),
            (Identifiability::NotDecided, _) => "identifiability not decided".into(),
        }
    }
}

/// Number of values of an unknown among all points with the same outputs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NumberOfSolutions {
    /// Single value: the solving expression depends on outputs, inputs, constants and unknowns that have one
    /// solution.
    OneByExpression,
    /// Number of solutions, complex ones included, by elimination at a random point modulo each prime.
    Counted(usize),
    /// Locally unique. The text is the reason why the number of solutions is not decided.
    Undecided(String),
}

/// Combination of unknowns, with its verdict.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SystemCombination {
    /// Combination as written in the model, or `b*x1`.
    pub expression: String,
    /// Observable degree of the combination; null if it is not observable.
    pub degree: Option<usize>,
    /// Number of values of an identifiable function among all points with the same outputs; null if it is not
    /// observable or solutions were not sought.
    pub number_of_solutions: Option<NumberOfSolutions>,
}

/// Symmetry of the system, in words.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SymmetryReport {
    /// Change that leaves every output as it is (if `rests_on_bound`: its derivatives up to the bound at the
    /// start), for every `c` (every positive one where something is
    /// multiplied or divided): `multiply alpha by c; divide gamma by c`. At c = 1, and where nothing is
    /// multiplied or divided at c = 0, nothing changes.
    pub words: String,
    /// Unknowns that the symmetry changes.
    pub unknowns: Vec<String>,
}

impl Judgement {
    /// Bound on the probability that a verdict is wrong; `None` for a model judged in real numbers.
    pub fn error_bound(&self) -> Option<f64> {
        match self.certainty {
            SystemCertainty::Primes(primes) => Some(primes.error_bound),
            SystemCertainty::Digits(_) => None,
        }
    }

    /// Margin of the rank decisions in real numbers; `None` for a model judged in prime fields.
    pub fn digits(&self) -> Option<DigitsReport> {
        match self.certainty {
            SystemCertainty::Primes(_) => None,
            SystemCertainty::Digits(digits) => Some(digits.into()),
        }
    }
}

impl From<ByDigits> for DigitsReport {
    fn from(d: ByDigits) -> Self {
        let round = |x: f64| (10.0 * x).round() / 10.0;
        Self {
            digits: d.digits,
            nonzero_log10: round(d.nonzero),
            zero_log10: d.zero.is_finite().then(|| round(d.zero)),
        }
    }
}

/// Options of the analysis of a system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SystemOptions {
    /// Seed of all random choices.
    pub seed: u64,
    /// True if solving expressions and the number of solutions are wanted.
    pub solutions: bool,
    /// Limit of the work of counting solutions, in millions of products of two coefficients, at each of two
    /// points.
    pub count_limit: u64,
    /// Limit of the work of relations among derivatives of the outputs, which are sought if counting leaves
    /// a number undecided; a fifth of it for another count after them. In millions of products of two
    /// coefficients, at each of two points; 0: neither is done.
    pub relation_limit: u64,
    /// Highest order of derivatives. `None`: n for each experiment if chains end by themselves, else 2n+4,
    /// and at least 60 without arbitrary inputs.
    pub order: Option<usize>,
}

impl Default for SystemOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            solutions: true,
            count_limit: COUNT_LIMIT,
            relation_limit: RELATION_LIMIT,
            order: None,
        }
    }
}
