//! Certificates: the verdicts of a scheme or model with the witness that proves them, for programs that share
//! no code with this one. The chapter `certificate` of the book is the specification.

mod exact;
mod model;
mod witness;

pub use model::{
    CertifiedInput, CertifiedModel, CertifiedOutput, ModelCertificate, Operation, certify_model,
};

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::degree::coefficient::{Coefficient, Number};
use crate::degree::ensemble::EnsembleError;
use crate::degree::status::Status;
use crate::findings::{AnalysisError, JudgedScheme};
use crate::model::angle::format_decimal;
use crate::model::geometry::GyroAxes;
use crate::model::path::{PathStep, radical};
use crate::model::platform::{FieldSample, Platform};
use crate::model::scheme::MAX_COMBINATIONS;
use crate::model::{Carry, Scheme, Term, Unknowns};
use crate::solution::Frame;
use crate::system::ModelError;
use witness::{Filtration, WitnessedVerdict};

/// Name and version of the layout.
pub const LAYOUT: &str = "obsdeg.certificate/1";

/// Largest number of unknowns of a certificate.
pub(crate) const MOST_UNKNOWNS: usize = 300;

/// Name of a derivative row; in JSON `[segment, order, component]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowName {
    /// Number of the segment, from 1.
    pub segment: usize,
    /// Derivative order.
    pub order: usize,
    /// Component of Z; of a model the number of the output, from 1.
    pub component: usize,
}

crate::json_list!(RowName { segment: usize, order: usize, component: usize });

/// Row of the basis with its pivot; in JSON `[segment, order, component, pivot]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BasisRow {
    /// Number of the segment, from 1.
    pub segment: usize,
    /// Derivative order.
    pub order: usize,
    /// Component of Z; of a model the number of the output, from 1.
    pub component: usize,
    /// Name of the unknown that is the pivot.
    pub pivot: String,
}

crate::json_list!(BasisRow { segment: usize, order: usize, component: usize, pivot: String });

impl BasisRow {
    fn new(RowName { segment, order, component }: RowName, pivot: &str) -> Self {
        Self { segment, order, component, pivot: pivot.into() }
    }
}

/// Exact number: a sum of terms `[p, q, r, a, b]`, each `p/q sqrt(r) wN^a wU^b`.
pub(crate) type ExactNumber = Vec<[i64; 5]>;

/// Exact vector: the entries that are not 0, by the name of the unknown.
pub(crate) type ExactVector = BTreeMap<String, ExactNumber>;

/// Certificate: the verdicts on a scheme and the witness that proves them.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Certificate {
    /// Name and version of the layout, `obsdeg.certificate/1`.
    pub layout: String,
    /// Scheme that the verdicts are about, as far as they depend on it.
    pub problem: CertifiedProblem,
    /// Names of the unknowns, in the order of the columns of all rows.
    pub unknowns: Vec<String>,
    /// Kind of the witness: exact numbers, or a selection of rows that a checker solves modulo primes.
    pub kind: Kind,
    /// Ranks of the rows of order at most 0, 1, ..., K; higher orders add nothing.
    pub ranks: Vec<usize>,
    /// Basis rows: segment (from 1), derivative order, component of Z, name of the pivot unknown.
    pub basis: Vec<BasisRow>,
    /// Null vectors of the rows of order at most 0, 1, ..., K, one per unknown that is no pivot; null if the
    /// kind is modular.
    pub null_vectors: Option<Vec<Vec<ExactVector>>>,
    /// Verdict and witness for every unknown, in the order of the unknowns.
    pub verdicts: Vec<CertifiedUnknown>,
    /// Verdict and witness for combinations of unknowns.
    pub combinations: Vec<CertifiedCombination>,
}

/// Kind of the witness of a certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Exact: numbers of Q(sqrt 2, sqrt 3) times powers of wN and wU; checked without any chance of error.
    Exact,
    /// Modular: selection of rows, pivots and free unknowns, which a checker solves modulo primes of its own.
    Modular,
}

/// Scheme of a certificate, as far as its verdicts depend on it.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CertifiedProblem {
    /// Carry between positions: platform, inertial or reset.
    pub carry: Carry,
    /// Latitude in degrees as decimal text; null if it is generic.
    pub latitude_deg: Option<String>,
    /// True if `psi_y^n` is measured too.
    pub measured_azimuth: bool,
    /// Unknown terms, in the order of their coefficients.
    pub terms: Vec<Term>,
    /// Axes of the gyros X, Y, Z as signed platform axes.
    pub gyros: [GyroAxes; 3],
    /// Input axes of the accelerometers X, Y, Z as signed platform axes.
    pub accelerometers: [String; 3],
    /// Euler angles alpha, beta, gamma of every position in degrees, as decimal texts.
    pub positions: Vec<[String; 3]>,
    /// Turns that lead to every position, where torquer errors act on them; null where they do not.
    pub slews: Option<Vec<Vec<CertifiedTurn>>>,
}

/// One turn of a slew, about a fixed axis.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CertifiedTurn {
    /// Axis of the turn; null for the axis that the attitudes before and behind it give.
    pub about: Option<TurnAxis>,
    /// Angle of the turn in degrees, right-handed, as decimal text.
    pub angle_deg: String,
}

/// Axis of a turn: X_p, Y_p, Z_p, N, U, E, middle (gimbal), or a direction in n (dimensionless).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum TurnAxis {
    /// Name of the axis: X_p, Y_p, Z_p, N, U, E or middle.
    Named(&'static str),
    /// Direction in n (North, Up, East), dimensionless, of length 1.
    Direction([ExactNumber; 3]),
}

/// Verdict and witness for one unknown.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CertifiedUnknown {
    /// Name of the unknown that the verdict is about.
    pub unknown: String,
    /// Verdict on the unknown, and its witness.
    #[serde(flatten)]
    pub proof: Proof,
}

/// Verdict and witness for one combination of unknowns.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CertifiedCombination {
    /// Coefficients of the combination, in units of powers of wN and wU, by the name of the unknown.
    pub terms: ExactVector,
    /// Verdict on the combination, and its witness.
    #[serde(flatten)]
    pub proof: Proof,
}

/// Verdict and witness for a linear functional of the unknowns.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Proof {
    /// Status: observable, inseparable or not excited.
    pub status: Status,
    /// Observable degree; null if it is not observable.
    pub degree: Option<usize>,
    /// Basis rows (segment, order, index of the component) whose coefficient in the solution is not 0; null
    /// if it is not observable.
    pub solution: Option<Vec<RowName>>,
    /// Coefficients of these rows, in units of powers of wN and wU; null if it is not observable or the kind
    /// is modular.
    pub coefficients: Option<Vec<ExactNumber>>,
    /// Name of the free unknown of the null vector that proves the lower bound; null for degree 0.
    pub hidden_by: Option<String>,
    /// First row (segment, order, index of the component) with an entry other than 0 at an unknown of the
    /// functional; null unless it is inseparable.
    pub excited_by: Option<RowName>,
}

/// Reasons for the lack of a certificate.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CertificateError {
    /// The scheme cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The model cannot be judged.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The layout does not cover the scheme or model.
    #[error("no certificate: found {found}; certificates cover {expected}")]
    NotCovered {
        /// Feature of the scheme or model that the layout does not cover.
        found: String,
        /// Features that the layout covers instead.
        expected: &'static str,
    },
}

impl Certificate {
    /// JSON text with one key per line, and one list entry per line.
    ///
    /// # Errors
    /// None for the certificate of a scheme.
    pub fn text(&self) -> Result<String, serde_json::Error> {
        text(self)
    }
}

/// JSON text with one key per line, and one list entry per line.
fn text(certificate: &impl Serialize) -> Result<String, serde_json::Error> {
    let value = serde_json::to_value(certificate)?;
    let line = |(key, value): (&String, &serde_json::Value)| match value.as_array() {
        Some(list) if key != "unknowns" && key != "ranks" && !list.is_empty() => {
            let entries: Vec<String> = list.iter().map(|entry| format!("    {entry}")).collect();
            format!("  \"{key}\": [\n{}\n  ]", entries.join(",\n"))
        }
        _ => format!("  \"{key}\": {value}"),
    };
    let lines: Vec<String> = value.as_object().into_iter().flatten().map(line).collect();
    Ok(format!("{{\n{}\n}}\n", lines.join(",\n")))
}

/// Linear functional of the unknowns with exact coefficients: columns and coefficients.
type Exactly = Vec<(usize, Coefficient)>;

/// The certificate of a scheme. It is exact if the angles are multiples of 15 degrees, only drifts are
/// unknown, and the numbers are small; otherwise modular.
///
/// # Errors
/// [`CertificateError`].
pub fn certify(scheme: &Scheme, seed: u64) -> Result<Certificate, CertificateError> {
    check_covered(scheme)?;
    let platform = Platform::new(scheme.clone()).map_err(AnalysisError::from)?;
    let found = platform.names().len();
    if found > MOST_UNKNOWNS {
        return Err(not_covered(format!("{found} unknowns"), "at most 300"));
    }
    let judged = JudgedScheme::new(&platform, seed)?;
    let combinations = combinations(&platform, &judged);
    let fields = [0, 1].map(|i| {
        let sample = judged.verdicts.values[i].sample(scheme, 1);
        let found = Filtration::new(&platform, &sample);
        let functionals = functionals(&platform, &combinations, &sample);
        (found.found(&functionals), found)
    });
    let [(found, filtration), (second, other)] = fields;
    if found != second || filtration.basis != other.basis || filtration.ranks != other.ranks {
        return Err(AnalysisError::from(EnsembleError::Disagreement).into());
    }
    let exact = exact::exact(&platform, &judged.verdicts, &filtration, &combinations, &found);
    Ok(written(&platform, &filtration, &combinations, found, exact))
}

fn not_covered(found: impl Into<String>, expected: &'static str) -> CertificateError {
    CertificateError::NotCovered { found: found.into(), expected }
}

/// Refuses schemes that the layout does not cover.
fn check_covered(scheme: &Scheme) -> Result<(), CertificateError> {
    scheme.validate().map_err(AnalysisError::from)?;
    if let Some(name) = scheme.generic_names().first() {
        return Err(not_covered(format!("the generic angle {name}"), "angles in decimal degrees"));
    }
    if let Some(p) = scheme.positions.iter().find(|p| p.rotation.is_some()) {
        return Err(not_covered(format!("the rotating segment {}", p.name), "standing positions"));
    }
    if scheme.unknowns == Unknowns::Drift {
        return Err(not_covered("the unknowns `drift`", "coefficients of gyros and accelerometers"));
    }
    Ok(())
}

/// Combinations that were found or that the scheme requests, where their coefficients are exact.
fn combinations(platform: &Platform, judged: &JudgedScheme<'_>) -> Vec<Exactly> {
    let mut solver = judged.solver(Frame::N, None);
    let found = judged.findings(&mut solver).combinations;
    let latitude = platform.scheme().latitude;
    let [pole, equator] = [latitude.is_some_and(|l| l.is_pole()), latitude.is_some_and(|l| l.is_equator())];
    let writable = |c: &Coefficient| {
        matches!(c.number, Number::Radical(_))
            && !c.is_zero()
            && (c.rates[0] == 0 || !pole)
            && (c.rates[1] == 0 || !equator)
    };
    found
        .into_iter()
        .filter_map(|c| Some(c.functional?.terms))
        .filter(|terms| !terms.is_empty() && terms.iter().all(|(_, c)| writable(c)))
        .take(MAX_COMBINATIONS)
        .collect()
}

/// All functionals in a field: every unknown, then the combinations.
fn functionals(
    platform: &Platform,
    combinations: &[Exactly],
    sample: &FieldSample,
) -> Vec<Vec<(usize, u64)>> {
    let one = sample.roots.field.one();
    let unknowns = (0..platform.names().len()).map(|c| vec![(c, one)]);
    let images = combinations.iter().map(|c| exact::image(c, sample, [sample.point.w_n, sample.point.w_u]));
    unknowns.chain(images).collect()
}

/// Terms of an exact coefficient.
fn number(c: &Coefficient) -> ExactNumber {
    let Number::Radical(radical) = &c.number else { return Vec::new() };
    let [a, b] = c.rates.map(i64::from);
    let parts = radical.coefficients.iter().zip([1, 2, 3, 6]);
    parts.filter(|(q, _)| q.num != 0).map(|(q, root)| [q.num, q.den, root, a, b]).collect()
}

/// Verdict and witness of a functional in the form of the file.
fn proof(
    found: WitnessedVerdict,
    coefficients: Option<Vec<ExactNumber>>,
    filtration: &Filtration,
    names: &[String],
) -> Proof {
    Proof {
        status: found.status,
        degree: found.degree,
        solution: found.solution.map(|rows| rows.into_iter().map(|j| filtration.basis[j].0).collect()),
        coefficients,
        hidden_by: found.hidden_by.map(|c| names[c].clone()),
        excited_by: found.excited_by,
    }
}

/// Assembles the certificate in the form of the file.
fn written(
    platform: &Platform,
    filtration: &Filtration,
    combinations: &[Exactly],
    found: Vec<WitnessedVerdict>,
    exact: Option<exact::ExactWitness>,
) -> Certificate {
    let names = platform.names();
    let exactly = exact.is_some();
    let (null_vectors, coefficients) = match exact {
        Some(exact) => (Some(exact.null_vectors), exact.coefficients),
        None => (None, vec![None; found.len()]),
    };
    let mut proofs = found.into_iter().zip(coefficients).map(|(f, c)| proof(f, c, filtration, names));
    let verdicts: Vec<CertifiedUnknown> = names
        .iter()
        .zip(proofs.by_ref())
        .map(|(name, proof)| CertifiedUnknown { unknown: name.clone(), proof })
        .collect();
    let vector = |c: &Exactly| c.iter().map(|(column, c)| (names[*column].clone(), number(c))).collect();
    let combinations =
        combinations.iter().zip(proofs).map(|(c, proof)| CertifiedCombination { terms: vector(c), proof });
    Certificate {
        layout: LAYOUT.into(),
        problem: problem(platform),
        unknowns: names.to_vec(),
        kind: if exactly { Kind::Exact } else { Kind::Modular },
        ranks: filtration.ranks.clone(),
        basis: filtration.basis.iter().map(|&(row, pivot)| BasisRow::new(row, &names[pivot])).collect(),
        null_vectors,
        verdicts,
        combinations: combinations.collect(),
    }
}

/// One turn of a slew; `None` where its axis has no exact form.
fn turn(step: &PathStep) -> Option<CertifiedTurn> {
    let half_turn = step.angle().turn().is_multiple_of_deg(180);
    let about = match step {
        PathStep::Named { axis, .. } if axis.geographic => Some(TurnAxis::Named(["N", "U", "E"][axis.index])),
        PathStep::Named { axis, .. } => Some(TurnAxis::Named(["X_p", "Y_p", "Z_p"][axis.index])),
        PathStep::Middle { .. } => Some(TurnAxis::Named("middle")),
        PathStep::Direct { about, .. } if half_turn => {
            let component = |x: f64| {
                let number_ = Number::Radical(radical(x)?);
                Some(number(&Coefficient { number: number_, rates: [0, 0] }))
            };
            let [n, u, e] = about.map(component);
            Some(TurnAxis::Direction([n?, u?, e?]))
        }
        PathStep::Direct { .. } => None,
    };
    Some(CertifiedTurn { about, angle_deg: format_decimal(step.angle().nanodeg()) })
}

fn problem(platform: &Platform) -> CertifiedProblem {
    let scheme = platform.scheme();
    let slews = platform.paths().iter().map(|steps| steps.iter().filter_map(turn).collect());
    CertifiedProblem {
        slews: Some(slews.collect()).filter(|s: &Vec<Vec<CertifiedTurn>>| !s.is_empty()),
        carry: scheme.carry,
        latitude_deg: scheme.latitude.map(|l| l.to_string()),
        measured_azimuth: scheme.measured_azimuth,
        terms: scheme.unknowns.terms().to_vec(),
        gyros: scheme.geometry.gyros(),
        accelerometers: scheme.geometry.accelerometers.inputs().map(|a| a.to_string()),
        positions: scheme
            .positions
            .iter()
            .map(|p| p.angles.each_ref().map(|a| format_decimal(a.nanodeg())))
            .collect(),
    }
}
