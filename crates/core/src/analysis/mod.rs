//! The main job: everything that is said about one scheme, as plain data.

mod answer;

use obsdeg_symbolic::{Worker, WorkerError};

pub use answer::*;

use crate::accuracy::Accuracy;
use crate::degree::coefficient::{Coefficient, readable};
use crate::degree::ensemble::{EnsembleError, Verdicts, degrees, judge};
use crate::degree::staircase::partners;
use crate::degree::status::{Difference, Status, Verdict};
use crate::model::attitude::c_n_from_euler;
use crate::model::platform::Platform;
use crate::model::ring::Float;
use crate::model::scheme::MAX_UNKNOWNS;
use crate::model::{Angle, Carry, Scheme, SchemeError, Unknowns};
use crate::solution::combinations::{Combination, NullVector, combinations, null_space};
use crate::solution::formulas::formulas;
use crate::solution::loci::loci;
use crate::solution::print::{StationLabel, stations, terms, text};
use crate::solution::requested::{CombinationError, Requested, requested_combinations};
use crate::solution::solver::{Frame, Functional, Solver};

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.analysis/1";

/// What is to be computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AnalysisOptions {
    /// Seed of all random choices.
    pub seed: u64,
    /// Whether solving expressions are wanted.
    pub solutions: bool,
    /// Whether the formulas of Z and its derivatives are wanted.
    pub formulas: bool,
    /// Axes of Z in solutions.
    pub frame: Frame,
}

impl Default for AnalysisOptions {
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
    #[error(transparent)]
    Combination(#[from] CombinationError),
}

/// Analyses `scheme`. The worker, if given, is started only when formulas are wanted.
///
/// # Errors
/// [`AnalysisError`].
pub fn analyze(
    scheme: &Scheme,
    options: AnalysisOptions,
    worker: Option<&mut Worker>,
) -> Result<Analysis, AnalysisError> {
    let platform = Platform::new(scheme.clone())?;
    few_enough(&platform)?;
    let verdicts = judge(&platform, options.seed)?;
    let requested = requested_combinations(&platform, &verdicts, options.seed)?;
    let built = worker.is_some();
    let worker = worker.filter(|_| options.solutions || options.formulas);
    let mut solver = Solver::new(&platform, &verdicts, options.seed, options.frame, worker);
    let basis = combinations(&platform, &verdicts, &mut solver);
    let null = null_space(&platform, &verdicts, &mut solver);

    let mut printer =
        Printer { solver, options, stations: stations(scheme), accuracy: None, notes: Vec::new() };
    let accuracy = Accuracy::new(&platform, &verdicts, options.seed);
    printer.accuracy = printer.noted(accuracy.map_err(|e| e.to_string()));
    let quantities = quantities(&platform, &verdicts, &mut printer)?;
    let mut combinations: Vec<CombinationReport> =
        basis.into_iter().map(|c| basis_report(c, &mut printer)).collect();
    combinations.extend(requested.into_iter().map(|r| requested_report(r, &mut printer)));
    let found = loci(&platform, &verdicts, &mut printer.solver, options.seed);
    let found = printer.noted(found).unwrap_or_default();
    printer.notes.extend(found.incomplete);
    let formulas = options.formulas.then(|| formulas(&platform, &mut printer.solver));
    let formulas = formulas.and_then(|f| printer.noted(f));
    if scheme.slews() {
        printer.notes.push(
            "the slews of this scheme are not part of it: verdicts and formulas are those of repositioning at once, and with slews of \
             finite duration they need not hold"
                .into(),
        );
    }
    if options.solutions {
        let note = engine_note(built, &mut printer.solver);
        printer.notes.extend(note);
    }

    Ok(Analysis {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        stations: printer.stations,
        carry: scheme.carry,
        latitude_deg: scheme.latitude.map(|l| l.degrees()),
        geometry: scheme.geometry,
        terms: scheme.unknowns.to_string(),
        measured_azimuth: scheme.measured_azimuth,
        positions: position_reports(scheme),
        rank_profile: verdicts.degrees.rank_profile.clone(),
        rank: verdicts.degrees.rank(),
        unknowns: platform.names().to_vec(),
        has_accuracy_orders: printer.accuracy.is_some(),
        quantities,
        combinations,
        null_space: null.iter().map(|v| null_report(&platform, v)).collect(),
        carries: carry_reports(&platform, &verdicts, options.seed)?,
        degenerate_loci: found.loci,
        formulas,
        frame: options.frame,
        certainty: Certainty {
            method: "exact ranks modulo two random 61-bit primes that agree".into(),
            error_bound: verdicts.error_bound,
            primes: [0, 1].map(|i| verdicts.values[i].roots().field.modulus().to_string()),
            seed: options.seed,
        },
        notes: printer.notes,
    })
}

/// Refuses more unknowns than an analysis takes, before anything grows.
pub fn few_enough(platform: &Platform) -> Result<(), SchemeError> {
    let found = platform.names().len();
    if found <= MAX_UNKNOWNS { Ok(()) } else { Err(SchemeError::TooManyUnknowns { found }) }
}

/// Turns functionals into printed solutions and collects what could not be said.
struct Printer<'a> {
    solver: Solver<'a>,
    options: AnalysisOptions,
    stations: Vec<StationLabel>,
    /// The accuracy orders, if they could be computed.
    accuracy: Option<Accuracy>,
    notes: Vec<String>,
}

impl Printer<'_> {
    /// The solution of a functional of a known degree; a note when there is none to print.
    fn solution(&mut self, functional: &Functional, degree: usize, what: &str) -> Option<Solution> {
        if !self.options.solutions {
            return None;
        }
        match self.solver.solve(functional, degree) {
            Ok(solved) => Some(Solution {
                text: text(&solved, self.options.frame, &self.stations),
                terms: terms(&solved, self.options.frame, &self.stations),
                turning: solved.terms.iter().any(|t| t.order > 0 && self.stations[t.station].rate.is_some()),
                form: solved.form(),
                verification: solved.verification,
                solved,
            }),
            Err(reason) => {
                self.notes.push(format!("no solution printed for {what}: {reason}"));
                None
            }
        }
    }

    /// The accuracy order of a functional in the first field of the verdicts.
    fn accuracy_order(&self, row: &[u64], degree: Option<usize>) -> Option<usize> {
        self.accuracy.as_ref()?.of_functional(row, degree)
    }

    /// The value, or a note.
    fn noted<T>(&mut self, result: Result<T, String>) -> Option<T> {
        result.map_err(|reason| self.notes.push(reason)).ok()
    }
}

/// The verdicts on all unknowns, best first.
fn quantities(
    platform: &Platform,
    verdicts: &Verdicts,
    printer: &mut Printer<'_>,
) -> Result<Vec<Quantity>, AnalysisError> {
    let (scheme, seed) = (platform.scheme(), printer.options.seed);
    let special = scheme.latitude.is_some_and(|l| l.is_pole() || l.is_equator());
    let other_latitudes =
        if special { Some(degrees_of(&Scheme { latitude: None, ..scheme.clone() }, seed)?) } else { None };
    let defect = verdicts.degrees.rank() < platform.names().len();
    let generic = generic_angles(scheme).filter(|_| defect);
    let other_angles = generic.map(|s| degrees_of(&s, seed)).transpose()?;
    let partners = partners(platform.names().len(), &verdicts.stairs);

    let mut out = Vec::new();
    for (c, name) in platform.names().iter().enumerate() {
        let Verdict { status, degree } = Verdict::of(&verdicts.degrees, c);
        let unit = printer.solver.functional(vec![(c, Coefficient::one())]);
        let solution = degree.and_then(|k| printer.solution(unit.as_ref()?, k, name));
        let elsewhere = Elsewhere {
            other_latitudes: other_latitudes.as_ref().and_then(|d| d[c]),
            other_angles: other_angles.as_ref().and_then(|d| d[c]),
        };
        let somewhere = elsewhere.other_latitudes.is_some() || elsewhere.other_angles.is_some();
        out.push(Quantity {
            name: name.clone(),
            unit: platform.units()[c].into(),
            status,
            degree,
            accuracy_order: printer.accuracy.as_ref().and_then(|a| a.order[c]),
            partners: partners[c].iter().map(|&d| platform.names()[d].clone()).collect(),
            solution,
            elsewhere: (degree.is_none() && somewhere).then_some(elsewhere),
        });
    }
    out.sort_by_key(|q| (q.status, q.degree));
    Ok(out)
}

fn basis_report(c: Combination, printer: &mut Printer<'_>) -> CombinationReport {
    let Combination { name: expression, vector, functional, degree } = c;
    let solution = functional.and_then(|f| printer.solution(&f, degree, &expression));
    CombinationReport {
        expression,
        requested: false,
        status: Status::Observable,
        degree: Some(degree),
        accuracy_order: printer.accuracy_order(&vector, Some(degree)),
        solution,
    }
}

fn requested_report(r: Requested, printer: &mut Printer<'_>) -> CombinationReport {
    let Requested { text, row, terms, verdict } = r;
    let functional = printer.solver.functional(terms);
    let solution = verdict.degree.and_then(|k| printer.solution(functional.as_ref()?, k, &text));
    CombinationReport {
        expression: text,
        requested: true,
        status: verdict.status,
        degree: verdict.degree,
        accuracy_order: printer.accuracy_order(&row, verdict.degree),
        solution,
    }
}

fn null_report(platform: &Platform, v: &NullVector) -> Vec<Component> {
    let name = |c: usize| platform.names()[c].clone();
    let Some(components) = &v.components else {
        return v.support.iter().map(|&c| Component { name: name(c), coefficient: None }).collect();
    };
    let printed = readable(components.iter().map(|(_, k)| k.clone()).collect());
    let pairs = components.iter().zip(printed);
    pairs.map(|((c, _), k)| Component { name: name(*c), coefficient: Some(k.to_string()) }).collect()
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
    if matches!(failure, WorkerError::OverLimit { .. }) && !solver.given_up() {
        return None;
    }
    Some(format!(
        "formulas were given up ({failure}): coefficients are reconstructed from the prime fields where they \
         are rationals and square roots, and decimals elsewhere"
    ))
}

fn degrees_of(scheme: &Scheme, seed: u64) -> Result<Vec<Option<usize>>, AnalysisError> {
    Ok(degrees(&Platform::new(scheme.clone())?, seed)?.degree)
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
                rotation: p.rotation.as_ref().map(ToString::to_string),
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
        let there = degrees(&other, seed)?;
        // under reset carry every position has a psi of its own: each is held against the psi of the other carry
        let reset = [scheme.carry, carry].contains(&Carry::Reset);
        let one = |name: &str| name.split('@').next().unwrap_or(name).to_string();
        let pairs = (0..platform.names().len()).flat_map(|c| (0..other.names().len()).map(move |d| (c, d)));
        let differs = pairs.filter_map(|(c, d)| {
            let (name, of) = (&platform.names()[c], &other.names()[d]);
            let same = name == of || reset && one(name) == one(of);
            let (here, there) = (Verdict::of(&verdicts.degrees, c), Verdict::of(&there, d));
            let longer = if name.len() < of.len() { of } else { name };
            (same && here != there).then(|| Difference { name: longer.clone(), here, there })
        });
        out.push(CarryReport {
            carry,
            unknowns: other.names().len(),
            differs: differs.collect(),
            rank_profile: there.rank_profile.clone(),
        });
    }
    Ok(out)
}
