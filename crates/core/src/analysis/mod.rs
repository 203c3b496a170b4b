//! The main job: everything that is said about one scheme, as plain data.

mod answer;
mod carries;
mod remedies;
mod why;

use obsdeg_symbolic::{Worker, WorkerError};

pub use answer::*;
pub use why::explain;

pub use crate::findings::AnalysisError;

use crate::degree::coefficient::{Coefficient, readable};
use crate::degree::ensemble::{Verdicts, degrees};
use crate::degree::status::Verdict;
use crate::engine::EngineBusy;
use crate::findings::{CombinationFinding, JudgedScheme, SchemeFindings};
use crate::model::attitude::Matrix3;
use crate::model::attitude::c_n_from_euler;
use crate::model::path::TurnAt;
use crate::model::platform::{Platform, PlatformPoint};
use crate::model::ring::Float;
use crate::model::slew::{Slew, Turn};
use crate::model::{Angle, Carry, ErrorSource, OmittedModel, Position, Scheme, Term, Unknowns};
use crate::omitted::omitted_verdicts;
use crate::remedies::Remedies;
use crate::solution::FoundBy;
use crate::solution::combinations::NullVector;
use crate::solution::formulas::formulas;
use crate::solution::loci::{DegenerateLoci, loci};
use crate::solution::print::{StationLabel, stations, terms, text};
use crate::solution::solver::{Frame, Functional, Solver, Sparse};

/// Name and version of the JSON layout.
pub const SCHEMA: &str = "obsdeg.analysis/1";

/// Contents and seed of an analysis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AnalysisOptions {
    /// Seed of all random choices.
    pub seed: u64,
    /// True if solving expressions are wanted.
    pub solutions: bool,
    /// True if the formulas of Z and its derivatives are wanted.
    pub formulas: bool,
    /// Axes of Z in solutions.
    pub frame: Frame,
    /// True if the exact classes of the errors that are not estimated are wanted.
    pub omitted: bool,
}

impl Default for AnalysisOptions {
    fn default() -> Self {
        Self { seed: 1, solutions: true, formulas: false, frame: Frame::N, omitted: true }
    }
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
    let judged = JudgedScheme::new(&platform, options.seed)?;
    let verdicts = &judged.verdicts;
    let built = worker.is_some();
    let worker = worker.filter(|_| options.solutions || options.formulas);
    let mut solver = judged.solver(options.frame, worker);
    let findings = judged.findings(&mut solver);

    // with torquer or accelerometer errors, derivatives of Z during a turn contain its rate
    let by_history = scheme.by_history();
    let printed = AnalysisOptions { solutions: options.solutions && !by_history, ..options };
    let mut printer =
        SolutionPrinter { solver, options: printed, stations: stations(scheme), notes: Vec::new() };
    printer.notes.extend(findings.accuracy.as_ref().err().map(ToString::to_string));
    let quantities = quantities(&platform, &findings, &mut printer)?;
    let combinations: Vec<CombinationReport> =
        findings.combinations.iter().map(|c| combination_report(c, &mut printer)).collect();
    let (found, is_explained) = printer.degenerate_loci(&platform, verdicts, options.seed);
    let loci_unexplained = !is_explained && !scheme.generic_names().is_empty();
    let formulas = options.formulas.then(|| formulas(&platform, &mut printer.solver));
    let formulas = formulas.and_then(|f| printer.noted(f));
    printer.notes.extend(term_notes(scheme));
    let (carries, carry_notes) = carries::carry_reports(&platform, verdicts, &findings.verdicts)?;
    let to_resolve = remedies::remedies(&platform, verdicts, &findings.verdicts, &carries);
    printer.notes.extend(carry_notes);
    let omitted = options.omitted.then(|| OmittedModel::new(&platform));
    let omitted = omitted.and_then(|model| omitted_verdicts(&platform, &model, options.seed).ok());
    printer.notes.extend(slew_note(scheme));
    let asked = (options.solutions && !by_history, loci_unexplained);
    let missing = MissingParts {
        left_out: printer.solver.left_out(),
        formulas: options.formulas && formulas.is_none(),
        ..MissingParts::new(&quantities, &combinations, &findings, &found, asked)
    };
    let sought = (options.solutions && !by_history || missing.formulas) && missing.any();
    let engine_busy = if sought { printer.note_missing(built, &missing) } else { None };
    Ok(Analysis {
        quantities,
        combinations,
        carries,
        omitted: omitted.filter(|o| !o.terms.is_empty()),
        to_resolve,
        degenerate_loci_incomplete: match found.loci {
            None if loci_unexplained => Some("not sought without the symbolic engine".into()),
            _ => found.incomplete,
        },
        degenerate_loci: found.loci,
        formulas,
        notes: printer.notes,
        engine_busy,
        ..outline(&platform, &findings, options.frame)
    })
}

/// Answer with the scheme and its ranks alone.
fn outline(platform: &Platform, findings: &SchemeFindings, frame: Frame) -> Analysis {
    let scheme = platform.scheme();
    Analysis {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        stations: stations(scheme),
        carry: scheme.carry,
        latitude_deg: scheme.latitude.map(|l| l.degrees()),
        geometry: scheme.geometry,
        terms: scheme.unknowns.to_string(),
        measured_azimuth: scheme.measured_azimuth,
        positions: position_reports(platform),
        rank_profile: findings.verdicts.degrees.rank_profile.clone(),
        rank: findings.verdicts.degrees.rank(),
        unknowns: platform.names().to_vec(),
        has_accuracy_orders: findings.accuracy.is_ok(),
        quantities: Vec::new(),
        combinations: Vec::new(),
        null_space: findings.null_space.iter().map(|v| null_report(platform, v)).collect(),
        carries: Vec::new(),
        omitted: None,
        to_resolve: Remedies::default(),
        why: Vec::new(),
        degenerate_loci: None,
        degenerate_loci_incomplete: None,
        formulas: None,
        frame,
        gimbals: scheme.gimbal_report(),
        certainty: Certainty {
            method: "exact ranks modulo two random 61-bit primes that agree".into(),
            error_bound: findings.certainty.error_bound,
            primes: findings.certainty.primes_as_text(),
            seed: findings.verdicts.seed,
        },
        notes: Vec::new(),
        engine_busy: None,
    }
}

/// Note on slews that the verdicts do not contain; `None` if there are none.
fn slew_note(scheme: &Scheme) -> Option<String> {
    (scheme.slews() && !scheme.torquers_act()).then(|| {
        "the slews of this scheme are not part of it: verdicts and formulas are those of repositioning at \
         once, and with slews of finite duration they need not hold"
            .into()
    })
}

/// Turns functionals into printed solutions, and collects notes about those without one.
struct SolutionPrinter<'a> {
    solver: Solver<'a>,
    options: AnalysisOptions,
    stations: Vec<StationLabel>,
    notes: Vec<String>,
}

impl SolutionPrinter<'_> {
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
                found_by: solved.found_by,
                verification: solved.verification,
                solved,
            }),
            Err(reason) => {
                self.notes.push(format!("no solution printed for {what}: {reason}"));
                None
            }
        }
    }

    /// Degenerate loci of a scheme; an error becomes a note. True if there was one: it explains why loci are
    /// missing.
    fn degenerate_loci(
        &mut self,
        platform: &Platform,
        verdicts: &Verdicts,
        seed: u64,
    ) -> (DegenerateLoci, bool) {
        let found = loci(platform, verdicts, &mut self.solver, seed);
        let is_explained = found.is_err();
        (self.noted(found).unwrap_or_default(), is_explained)
    }

    /// Notes the missing parts with their reason. Returns the process that has the engine, if this is it.
    fn note_missing(&mut self, built: bool, missing: &MissingParts) -> Option<EngineBusy> {
        let note = engine_note(built, &mut self.solver, missing);
        self.notes.extend(note);
        let failure = self.solver.worker().and_then(|w| w.failure().cloned());
        failure.and_then(|failure| EngineBusy::of(&failure))
    }

    /// Value of a result; an error becomes a note.
    fn noted<T>(&mut self, result: Result<T, impl std::error::Error>) -> Option<T> {
        result.map_err(|reason| self.notes.push(reason.to_string())).ok()
    }
}

/// The verdicts on all unknowns, best first.
fn quantities(
    platform: &Platform,
    findings: &SchemeFindings,
    printer: &mut SolutionPrinter<'_>,
) -> Result<Vec<Quantity>, AnalysisError> {
    let SchemeFindings { verdicts, .. } = findings;
    let (scheme, seed) = (platform.scheme(), verdicts.seed);
    let special = scheme.latitude.is_some_and(|l| l.is_pole() || l.is_equator());
    let other_latitudes =
        if special { Some(degrees_of(&Scheme { latitude: None, ..scheme.clone() }, seed)?) } else { None };
    let defect = verdicts.degrees.rank() < platform.names().len();
    let generic = generic_angles(scheme).filter(|_| defect);
    let other_angles = generic.map(|s| degrees_of(&s, seed)).transpose()?;

    let mut out = Vec::new();
    for (c, name) in platform.names().iter().enumerate() {
        let Verdict { status, degree } = verdicts.verdict(c);
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
            accuracy_order: findings.orders(c).start,
            partners: verdicts.partners[c].iter().map(|&d| platform.names()[d].clone()).collect(),
            solution,
            elsewhere: (degree.is_none() && somewhere).then_some(elsewhere),
        });
    }
    out.sort_by_key(|q| (q.status, q.degree));
    Ok(out)
}

fn combination_report(c: &CombinationFinding, printer: &mut SolutionPrinter<'_>) -> CombinationReport {
    let Verdict { status, degree } = c.verdict;
    CombinationReport {
        expression: c.name.clone(),
        requested: c.requested,
        status,
        degree,
        accuracy_order: c.orders.start,
        solution: degree.and_then(|k| printer.solution(c.functional.as_ref()?, k, &c.name)),
    }
}

fn null_report(platform: &Platform, v: &NullVector) -> Vec<Component> {
    components(platform, &v.support, v.components.as_ref())
}

/// The components of a null vector by name, with their coefficients where these were computed.
fn components(platform: &Platform, support: &[usize], found: Option<&Sparse>) -> Vec<Component> {
    let name = |c: usize| platform.names()[c].clone();
    let Some(components) = found else {
        return support.iter().map(|&c| Component { name: name(c), coefficient: None }).collect();
    };
    let printed = readable(components.iter().map(|(_, k)| k.clone()).collect());
    let pairs = components.iter().zip(printed);
    pairs.map(|((c, _), k)| Component { name: name(*c), coefficient: Some(k.to_string()) }).collect()
}

/// Parts of an answer that are missing without the symbolic engine.
#[derive(Debug, Default)]
struct MissingParts {
    /// Names of observable unknowns with a solution in decimals.
    decimals: Vec<String>,
    /// Names of observable unknowns without a solution.
    unsolved: Vec<String>,
    /// Number of combinations that are left out, since their coefficients are missing.
    left_out: usize,
    /// Number of unobservable directions without coefficients.
    directions: usize,
    /// True if degenerate angles may be missing.
    loci: bool,
    /// True if the formulas of Z that were asked for are missing.
    formulas: bool,
}

impl MissingParts {
    fn new(
        quantities: &[Quantity],
        combinations: &[CombinationReport],
        findings: &SchemeFindings,
        found: &DegenerateLoci,
        (solutions, generic): (bool, bool),
    ) -> Self {
        let quantities = quantities.iter().map(|q| (&q.name, q.degree, &q.solution));
        let all = quantities.chain(combinations.iter().map(|c| (&c.expression, c.degree, &c.solution)));
        let (mut decimals, mut unsolved) = (Vec::new(), Vec::new());
        for (name, _, solution) in all.filter(|(_, degree, _)| solutions && degree.is_some()) {
            match solution {
                None => unsolved.push(name.clone()),
                Some(s) if s.found_by == FoundBy::FloatingPoint => decimals.push(name.clone()),
                Some(_) => {}
            }
        }
        let directions = findings.null_space.iter().filter(|v| v.components.is_none()).count();
        Self {
            decimals,
            unsolved,
            directions,
            loci: found.incomplete.is_some() || generic && found.loci.is_none(),
            ..Self::default()
        }
    }

    fn any(&self) -> bool {
        !self.parts().is_empty()
    }

    /// One clause for each kind of missing part.
    fn parts(&self) -> Vec<String> {
        let count =
            |n: usize, one: &str, many: &str| if n == 1 { one.to_string() } else { format!("{n} {many}") };
        let mut out = Vec::new();
        let mut say = |holds: bool, text: String| out.extend(holds.then_some(text));
        say(!self.unsolved.is_empty(), format!("no solutions of {}", self.unsolved.join(", ")));
        say(!self.decimals.is_empty(), format!("solutions in decimals of {}", self.decimals.join(", ")));
        say(
            self.left_out > 0,
            format!(
                "{} left out of the list, or written by psi^n and eps^n of single positions",
                count(self.left_out, "one combination", "combinations")
            ),
        );
        say(
            self.directions > 0,
            format!(
                "{} without coefficients",
                count(self.directions, "one unobservable direction", "unobservable directions")
            ),
        );
        say(self.loci, "an incomplete list of degenerate angles".into());
        say(self.formulas, "no formulas of Z".into());
        out
    }
}

/// Note on the parts that are missing because the symbolic engine gave no formulas, with the reason; `None`
/// where nothing is missing for that reason.
fn engine_note(built: bool, solver: &mut Solver<'_>, missing: &MissingParts) -> Option<String> {
    let failure = solver.worker().and_then(|w| w.failure().cloned());
    let why = match failure {
        _ if !built => "built without the symbolic engine".into(),
        _ if solver.too_many_angles() => {
            "too many different angles for formulas in their sines and cosines".into()
        }
        Some(WorkerError::OverLimit { .. }) if !solver.given_up() && !missing.formulas => return None,
        Some(failure) => format!("formulas were given up ({failure})"),
        None => return None,
    };
    Some(format!("{why}, therefore: {}", missing.parts().join("; ")))
}

fn degrees_of(scheme: &Scheme, seed: u64) -> Result<Vec<Option<usize>>, AnalysisError> {
    Ok(degrees(&Platform::new(scheme.clone())?, seed)?.degree)
}

/// The same scheme with a name for every angle; `None` when some are names already.
fn generic_angles(scheme: &Scheme) -> Option<Scheme> {
    // the angle of a slew is not determined by its sine and cosine
    if !scheme.generic_names().is_empty() || scheme.unknowns == Unknowns::Drift || scheme.torquers_act() {
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

/// True if the force along every input axis is -1, 0 or 1 g at all positions.
fn is_cardinal(scheme: &Scheme) -> bool {
    let force = |p: &Position| -> Vec<f64> {
        let c = c_n_from_euler(&Float, &std::array::from_fn(|k| p.angles[k].turn().cos_sin_f64()));
        scheme.geometry.accelerometers.inputs().iter().map(|a| c[1][a.axis]).collect()
    };
    let whole = |x: &f64| x.abs() < 1e-15 || (x.abs() - 1.0).abs() < 1e-15;
    let stands = |p: &Position| p.rotation.is_none() && p.angles.iter().all(|a| a.generic().is_none());
    scheme.positions.iter().all(|p| stands(p) && force(p).iter().all(whole))
}

/// Notes on ambiguities of the unknown terms, which hold whatever the verdicts are.
pub fn term_notes(scheme: &Scheme) -> Vec<String> {
    let terms = scheme.unknowns.terms();
    let have = |all: &[Term]| all.iter().all(|t| terms.contains(t));
    let cardinal = is_cardinal(scheme);
    let mut out = Vec::new();
    let mut say = |holds: bool, text: &str| out.extend(holds.then(|| text.to_string()));
    say(
        have(&[Term::GM, Term::M6]) && !scheme.measured_azimuth,
        "GM and M6 together leave the platform axes undefined: turning psi, GM and M6 by one rotation \
         changes no output, so three directions are not observable by any scheme that has Z alone; let the \
         accelerometers (GM and M3) or the gyros (GM3 and M6) define the axes",
    );
    say(
        have(&[Term::GM3, Term::M3]),
        "GM3 and M3 together take both triads as defining the platform axes: the rotation between them counts as known",
    );
    say(
        have(&[Term::F, Term::II, Term::OO, Term::SS]),
        "the squares of the components of g along I, O and S add up to 1 g^2 at every attitude: D_F, D_II, \
         D_OO and D_SS of a gyro are never told apart",
    );
    say(
        cardinal && have(&[Term::K1, Term::K3]),
        "at attitudes where the force along every input axis is -1, 0 or 1 g its third power is itself: K1 \
         and K3 are not told apart there",
    );
    say(
        cardinal && have(&[Term::Kx]),
        "at attitudes where the force is along one input axis the product of two components is zero: Kx is \
         not excited there",
    );
    say(
        scheme.by_history(),
        "while the platform turns steadily, drift integrates to what errors of accelerometers and torquers \
         look like, so a rotating segment is judged by the course of Z, at almost any rate: a degree is a \
         power of time, the order of the derivative at positions, and what has accumulated in psi while \
         the platform turned counts by its power; expressions are not written out, and of combinations and \
         directions whose coefficients hold the rate of turning the former are not listed, the latter \
         named without numbers",
    );
    say(
        scheme.unknowns.have(ErrorSource::Rate)
            && scheme.carry == Carry::Platform
            && scheme.positions.len() > 1,
        "under platform carry a repositioning leaves psi in platform axes as it is, torquer errors \
         included: they act at positions and in rotations alone, as if nothing had been torqued in \
         between; real slews need inertial carry and a path",
    );
    say(
        scheme.unknowns.have(ErrorSource::Rate) && scheme.carry == Carry::Reset && scheme.positions.len() > 1,
        "under reset carry what torquer errors leave in psi during a slew is part of the new psi: they act \
         at positions and in rotations alone",
    );
    out
}

fn position_reports(platform: &Platform) -> Vec<PositionReport> {
    let scheme = platform.scheme();
    let turns = turns(platform);
    let report = |angle: &Angle| {
        angle.degrees().map_or_else(|| AngleReport::Generic(angle.to_string()), AngleReport::Degrees)
    };
    scheme
        .positions
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let constant = p.angles.iter().all(|a| a.generic().is_none());
            let cos_sin = std::array::from_fn(|k| p.angles[k].turn().cos_sin_f64());
            let c = c_n_from_euler(&Float, &cos_sin);
            PositionReport {
                name: p.name.clone(),
                angles_deg: std::array::from_fn(|k| report(&p.angles[k])),
                attitude: p.cardinal(),
                rotation: p.rotation.as_ref().map(ToString::to_string),
                turns: turns.get(i).cloned().unwrap_or_default(),
                g_c: constant.then(|| std::array::from_fn(|j| 0.0 - c[1][j])),
            }
        })
        .collect()
}

/// The turns that lead to every position, where torquer errors act on them.
fn turns(platform: &Platform) -> Vec<Vec<Turn>> {
    if platform.paths().is_empty() {
        return Vec::new();
    }
    let point = PlatformPoint::in_floats(platform, 1.0, 1.0);
    let turn = |(from, turn): (Matrix3<f64>, &TurnAt<f64>)| {
        Slew::by(&from, &turn.axis.map(|x| x * turn.angle), 1.0).turn()
    };
    let stations = platform.scheme().stations();
    let starts = (0..point.turns.len()).filter(|&i| !stations[i].continues);
    starts.map(|i| point.turns_to(i).into_iter().map(turn).collect()).collect()
}
