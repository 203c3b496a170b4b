//! The main job: everything that is said about one scheme, as plain data.

use std::ops::Range;

use obsdeg_symbolic::Worker;
use schemars::JsonSchema;
use serde::Serialize;

use crate::degree::coefficient::{
    Coefficient, Form, Image, Number, rates_between, readable, recover_radical,
};
use crate::degree::ensemble::{EnsembleError, Verdicts, judge};
use crate::degree::staircase::Degrees;
use crate::degree::verdict::{combinations, expression, null_space, partners};
use crate::model::attitude::c_n_from_euler;
use crate::model::expression::{Environment, Expression, ExpressionError, evaluate, parse};
use crate::model::geometry::Geometry;
use crate::model::platform::{Platform, Sample};
use crate::model::ring::Float;
use crate::model::{Angle, Carry, Scheme, SchemeError, Unknowns};
use crate::solution::formulas::{Formula, formulas};
use crate::solution::loci::{Locus, loci};
use crate::solution::print::text;
use crate::solution::solver::{Frame, Functional, Solved, Solver, Sparse, Verification};

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.analysis/1";

/// What is to be computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Seed of all random choices.
    pub seed: u64,
    /// Whether solving expressions are wanted.
    pub solutions: bool,
    /// Whether the formulas of Z and its derivatives are wanted.
    pub formulas: bool,
    /// Axes of Z in solutions.
    pub frame: Frame,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 1, solutions: true, formulas: false, frame: Frame::N }
    }
}

/// Why there is no analysis.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AnalysisError {
    /// The scheme cannot be analysed.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// No verdict.
    #[error(transparent)]
    Verdict(#[from] EnsembleError),
    /// A combination is no linear combination of the unknowns.
    #[error("combination `{text}`: {reason}")]
    Combination {
        /// As written.
        text: String,
        /// What is wrong.
        reason: String,
        /// Where in the text.
        span: Range<usize>,
    },
}

/// Whether an unknown can be solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// It is in the span of the derivative rows.
    Observable,
    /// It moves Z, but only together with its partners.
    Inseparable,
    /// It does not move Z at all.
    NotExcited,
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Observable => "observable",
            Self::Inseparable => "inseparable",
            Self::NotExcited => "not excited",
        })
    }
}

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
    /// `dim V_0, dim V_1, ...`.
    pub rank_profile: Vec<usize>,
    /// The final rank.
    pub rank: usize,
    /// The unknowns in model order.
    pub unknowns: Vec<String>,
    /// The verdicts, best first.
    pub quantities: Vec<Quantity>,
    /// Observable combinations beyond single unknowns, by degree, and those asked for.
    pub combinations: Vec<CombinationReport>,
    /// Basis of the directions that Z does not see (unknowns that are not excited left out).
    pub null_space: Vec<Vec<Component>>,
    /// The verdicts under the other carries, where they differ.
    pub carries: Vec<CarryReport>,
    /// Conditions on generic angles under which the verdict changes.
    pub degenerate_loci: Option<Vec<Locus>>,
    /// Formulas of Z and its derivatives, position by position.
    pub formulas: Option<Vec<Formula>>,
    /// Axes of Z in solutions.
    pub frame: Frame,
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
    /// Gravity in platform axes, in g; null for generic angles.
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
    /// Unknowns that it cannot be told from.
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
    /// How exact its coefficients are.
    pub form: Form,
    /// How it was checked.
    pub verification: Verification,
    /// Its terms, for formatting.
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

/// A verdict that depends on the carry.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Difference {
    /// The unknown.
    pub name: String,
    /// Under the carry of the scheme.
    pub here: Verdict,
    /// Under the other one.
    pub there: Verdict,
}

/// Status and degree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Verdict {
    /// Whether it can be solved.
    pub status: Status,
    /// The observable degree.
    pub degree: Option<usize>,
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

/// Analyses `scheme`. The worker, if given, is started only when formulas are wanted.
///
/// # Errors
/// [`AnalysisError`].
pub fn analyze(
    scheme: &Scheme,
    options: Options,
    worker: Option<&mut Worker>,
) -> Result<Analysis, AnalysisError> {
    let platform = Platform::new(scheme.clone())?;
    let verdicts = judge(&platform, options.seed)?;
    let requested = requested_combinations(&platform, &verdicts)?;
    let mut notes = Vec::new();
    let built = worker.is_some();
    let worker = worker.filter(|_| options.solutions || options.formulas);
    let mut solver = Solver::new(&platform, &verdicts, options.seed, options.frame, worker);
    let basis = combinations(&platform, &verdicts, &mut solver);
    let null = null_space(&platform, &verdicts, &mut solver);
    let partners = partners(platform.names().len(), &null);
    let units: Vec<Option<Functional>> =
        (0..platform.names().len()).map(|c| solver.functional(vec![(c, Coefficient::one())])).collect();
    let requested: Vec<(String, Option<Functional>, Verdict)> = requested
        .into_iter()
        .map(|(text, terms, verdict)| (text, solver.functional(terms), verdict))
        .collect();
    let names: Vec<String> = scheme.positions.iter().map(|p| p.name.clone()).collect();
    let mut solve = |functional: &Functional, degree: usize, what: &str| -> Option<Solution> {
        match solver.solve(functional, degree) {
            Ok(solved) => Some(Solution {
                text: text(&solved, options.frame, &names),
                form: solved.form(),
                verification: solved.verification,
                solved,
            }),
            Err(reason) => {
                notes.push(format!("no solution printed for {what}: {reason}"));
                None
            }
        }
    };

    let other_latitudes = match scheme.latitude {
        Some(l) if l.is_pole() || l.is_equator() => {
            Some(degrees_of(&Scheme { latitude: None, ..scheme.clone() }, options.seed)?)
        }
        _ => None,
    };
    let defect = verdicts.degrees.rank() < platform.names().len();
    let generic = generic_angles(scheme).filter(|_| defect);
    let other_angles = generic.map(|s| degrees_of(&s, options.seed)).transpose()?;

    let mut quantities: Vec<Quantity> = Vec::new();
    for (c, name) in platform.names().iter().enumerate() {
        let Verdict { status, degree } = verdict(&verdicts.degrees, c);
        let unit = units[c].as_ref();
        let solution = degree.filter(|_| options.solutions).and_then(|k| solve(unit?, k, name));
        let elsewhere = (degree.is_none()).then(|| Elsewhere {
            other_latitudes: other_latitudes.as_ref().and_then(|d| d[c]),
            other_angles: other_angles.as_ref().and_then(|d| d[c]),
        });
        quantities.push(Quantity {
            name: name.clone(),
            unit: platform.units()[c].into(),
            status,
            degree,
            partners: partners[c].iter().map(|&d| platform.names()[d].clone()).collect(),
            solution,
            elsewhere: elsewhere.filter(|e| e.other_latitudes.is_some() || e.other_angles.is_some()),
        });
    }
    quantities.sort_by_key(|q| (q.status, q.degree));

    let mut reports: Vec<CombinationReport> = Vec::new();
    for c in &basis {
        let expression = expression(&platform, &c.support, c.functional.as_ref().map(|f| &f.terms));
        let wanted = c.functional.as_ref().filter(|_| options.solutions);
        let solution = wanted.and_then(|f| solve(f, c.degree, &expression));
        reports.push(CombinationReport {
            expression,
            requested: false,
            status: Status::Observable,
            degree: Some(c.degree),
            solution,
        });
    }
    for (text, functional, verdict) in requested {
        let wanted = verdict.degree.filter(|_| options.solutions);
        let solution = wanted.and_then(|k| solve(functional.as_ref()?, k, &text));
        reports.push(CombinationReport {
            expression: text,
            requested: true,
            status: verdict.status,
            degree: verdict.degree,
            solution,
        });
    }

    let degenerate_loci = match loci(&platform, &verdicts, &mut solver, options.seed) {
        Ok(found) => found,
        Err(reason) => {
            notes.push(reason);
            None
        }
    };
    let z_formulas = if options.formulas {
        match formulas(&platform, &mut solver) {
            Ok(found) => Some(found),
            Err(reason) => {
                notes.push(reason);
                None
            }
        }
    } else {
        None
    };
    if options.solutions {
        notes.extend(engine_note(built, &mut solver));
    }

    Ok(Analysis {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        carry: scheme.carry,
        latitude_deg: scheme.latitude.map(|l| l.degrees()),
        geometry: scheme.geometry,
        terms: scheme.unknowns.to_string(),
        measured_azimuth: scheme.measured_azimuth,
        positions: position_reports(scheme),
        rank_profile: verdicts.degrees.rank_profile.clone(),
        rank: verdicts.degrees.rank(),
        unknowns: platform.names().to_vec(),
        quantities,
        combinations: reports,
        null_space: null
            .iter()
            .map(|v| match &v.components {
                Some(f) => f
                    .iter()
                    .zip(readable(f.iter().map(|(_, k)| k.clone()).collect()))
                    .map(|((c, _), k)| Component {
                        name: platform.names()[*c].clone(),
                        coefficient: Some(k.to_string()),
                    })
                    .collect(),
                None => v
                    .support
                    .iter()
                    .map(|&c| Component { name: platform.names()[c].clone(), coefficient: None })
                    .collect(),
            })
            .collect(),
        carries: carry_reports(&platform, &verdicts, options.seed)?,
        degenerate_loci,
        formulas: z_formulas,
        frame: options.frame,
        certainty: Certainty {
            method: "exact ranks modulo two random 61-bit primes that agree".into(),
            error_bound: verdicts.error_bound,
            primes: [0, 1].map(|i| verdicts.values[i].roots().field.modulus().to_string()),
            seed: options.seed,
        },
        notes,
    })
}

/// Says why solutions are not symbolic, if they are not.
fn engine_note(built: bool, solver: &mut Solver<'_>) -> Option<String> {
    if !built {
        return Some(
            "built without the symbolic engine: coefficients are reconstructed from the prime fields where \
             they are rationals and square roots, and decimals elsewhere"
                .into(),
        );
    }
    if solver.too_many_angles() {
        return Some(
            "too many different angles for formulas in their sines and cosines: coefficients are decimals \
             where they are no rationals and square roots"
                .into(),
        );
    }
    let failure = solver.worker().and_then(|w| w.failure().cloned())?;
    Some(format!(
        "formulas were given up ({failure}): coefficients are reconstructed from the prime fields where they are \
         rationals and square roots, and decimals elsewhere"
    ))
}

pub(crate) fn verdict(degrees: &Degrees, column: usize) -> Verdict {
    let degree = degrees.degree[column];
    let status = match degree {
        Some(_) => Status::Observable,
        None if degrees.excited[column] => Status::Inseparable,
        None => Status::NotExcited,
    };
    Verdict { status, degree }
}

fn degrees_of(scheme: &Scheme, seed: u64) -> Result<Vec<Option<usize>>, AnalysisError> {
    Ok(judge(&Platform::new(scheme.clone())?, seed)?.degrees.degree)
}

/// The same scheme with a name for every angle; `None` when some are names already.
fn generic_angles(scheme: &Scheme) -> Option<Scheme> {
    if !scheme.generic_names().is_empty() || scheme.unknowns == Unknowns::Drift {
        return None;
    }
    let mut out = scheme.clone();
    for (i, position) in out.positions.iter_mut().enumerate() {
        for (k, angle) in position.angles.iter_mut().enumerate() {
            *angle = format!("any{i}x{k}").parse::<Angle>().ok()?;
        }
    }
    Some(out)
}

fn position_reports(scheme: &Scheme) -> Vec<PositionReport> {
    let report = |angle: &Angle| {
        angle.degrees().map_or_else(|| AngleReport::Generic(angle.to_string()), AngleReport::Degrees)
    };
    scheme
        .positions
        .iter()
        .map(|p| {
            let constant = p.angles.iter().all(|a| a.generic().is_none());
            let cos_sin = std::array::from_fn(|k| p.angles[k].turn().cos_sin_f64());
            let c = c_n_from_euler(&Float, &cos_sin);
            PositionReport {
                name: p.name.clone(),
                angles_deg: std::array::from_fn(|k| report(&p.angles[k])),
                attitude: p.cardinal(),
                g_c: constant.then(|| std::array::from_fn(|j| 0.0 - c[1][j])),
            }
        })
        .collect()
}

fn carry_reports(
    platform: &Platform,
    verdicts: &Verdicts,
    seed: u64,
) -> Result<Vec<CarryReport>, AnalysisError> {
    let scheme = platform.scheme();
    if scheme.unknowns == Unknowns::Drift {
        return Ok(Vec::new());
    }
    let mut out = Vec::new();
    for carry in Carry::ALL.into_iter().filter(|&c| c != scheme.carry) {
        let other = Platform::new(Scheme { carry, ..scheme.clone() })?;
        let there = judge(&other, seed)?;
        let differs = platform.names().iter().enumerate().filter_map(|(c, name)| {
            let d = other.names().iter().position(|n| n == name)?;
            let (here, there) = (verdict(&verdicts.degrees, c), verdict(&there.degrees, d));
            (here != there).then(|| Difference { name: name.clone(), here, there })
        });
        out.push(CarryReport {
            carry,
            unknowns: other.names().len(),
            differs: differs.collect(),
            rank_profile: there.degrees.rank_profile.clone(),
        });
    }
    Ok(out)
}

struct Unit<'a> {
    names: &'a [String],
    /// The value of each unknown.
    values: &'a [u64],
    rates: [u64; 2],
}

impl Environment for Unit<'_> {
    fn name(&self, name: &str) -> Option<u64> {
        match name {
            "wN" => Some(self.rates[0]),
            "wU" => Some(self.rates[1]),
            _ => self.names.iter().position(|n| n == name).map(|c| self.values[c]),
        }
    }
    fn cos_sin(&self, _: &str) -> Option<(u64, u64)> {
        None
    }
    fn known(&self) -> Vec<String> {
        self.names.iter().cloned().chain(["wN".into(), "wU".into()]).collect()
    }
}

/// The coefficients of a linear expression at one sample, or why it is not linear.
fn row_of(expression: &Expression, names: &[String], sample: &Sample) -> Result<Vec<u64>, ExpressionError> {
    let f = sample.roots.field;
    let rates = [sample.point.w_n, sample.point.w_u];
    let at = |values: &[u64]| evaluate(expression, &f, &Unit { names, values, rates });
    let zero = vec![0; names.len()];
    let unit =
        |c: usize| -> Vec<u64> { (0..names.len()).map(|j| if j == c { f.one() } else { 0 }).collect() };
    let row: Vec<u64> = (0..names.len()).map(|c| at(&unit(c))).collect::<Result<_, _>>()?;
    let probe: Vec<u64> = (0..names.len() as u64).map(|c| f.from_u64(1_000_003 + 7919 * c * c)).collect();
    let linear = at(&zero)? == 0 && at(&probe)? == f.dot(0, row.iter().copied().zip(probe.iter().copied()));
    if !linear {
        return Err(ExpressionError::Syntax {
            expected: "a linear combination of unknowns such as D_IX - D_IY",
            found: "something that is not linear in them".into(),
            span: expression.span.clone(),
        });
    }
    Ok(row)
}

type Requested = (String, Sparse, Verdict);

/// Reads and judges the combinations that a scheme asks for.
fn requested_combinations(platform: &Platform, verdicts: &Verdicts) -> Result<Vec<Requested>, AnalysisError> {
    let scheme = platform.scheme();
    let names = platform.names();
    scheme
        .combinations
        .iter()
        .map(|text| {
            let wrap = |e: ExpressionError| AnalysisError::Combination {
                text: text.clone(),
                reason: e.to_string(),
                span: e.span(),
            };
            let parsed = parse(text).map_err(wrap)?;
            let sample = verdicts.values[0].sample(scheme, 1);
            let row = row_of(&parsed, names, &sample).map_err(wrap)?;
            let degree = verdicts.stairs.iter().position(|v| v.contains(&row));
            let moved = (0..names.len()).any(|c| row[c] != 0 && verdicts.degrees.excited[c]);
            let status = match degree {
                Some(_) => Status::Observable,
                None if moved => Status::Inseparable,
                None => Status::NotExcited,
            };
            let terms = terms_of(&parsed, platform, verdicts).map_err(wrap)?;
            Ok((text.clone(), terms, Verdict { status, degree }))
        })
        .collect()
}

/// The exact coefficients of a linear expression with rational coefficients and rates.
fn terms_of(
    parsed: &Expression,
    platform: &Platform,
    verdicts: &Verdicts,
) -> Result<Sparse, ExpressionError> {
    let scheme = platform.scheme();
    let names = platform.names();
    let at = |field: usize, a: u64, rates: Option<[u64; 2]>| {
        let mut sample = verdicts.values[field].sample(scheme, a);
        if let Some([w_n, w_u]) = rates {
            (sample.point.w_n, sample.point.w_u) = (w_n, w_u);
        }
        let rates = [sample.point.w_n, sample.point.w_u];
        row_of(parsed, names, &sample).map(|row| (row, rates, sample.roots.field))
    };
    let fields = [*verdicts.values[0].roots(), *verdicts.values[1].roots()];
    let f = fields[0].field;
    let pairs = [[f.from_u64(1009), f.from_u64(2003)], [f.from_u64(3001), f.from_u64(4001)]];
    let first = at(0, 1, Some(pairs[0]))?;
    let second = at(0, 1, Some(pairs[1]))?;
    let ones = [0, 1].map(|i| at(i, 1, Some([fields[i].field.one(); 2])));
    let [one_a, one_b] = ones;
    let (one_a, one_b) = (one_a?, one_b?);
    let unsupported = || ExpressionError::Syntax {
        expected: "rational coefficients times powers of wN and wU",
        found: "another coefficient".into(),
        span: parsed.span.clone(),
    };
    (0..names.len())
        .filter(|&c| first.0[c] != 0)
        .map(|c| {
            let a = Image { value: first.0[c], rates: first.1 };
            let b = Image { value: second.0[c], rates: second.1 };
            let rates = rates_between(&f, a, b).ok_or_else(unsupported)?;
            let images = [[one_a.0[c]; 4], [one_b.0[c]; 4]];
            let number = recover_radical(&fields, &images).ok_or_else(unsupported)?;
            Ok((c, Coefficient { number: Number::Radical(number), rates }))
        })
        .collect()
}
