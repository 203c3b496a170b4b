//! The answer for one system: plain data, serialisable.

use schemars::JsonSchema;
use serde::Serialize;

use super::branches::{BranchSide, branches};
use super::constraints::ConstraintFactor;
use super::counts::{CountLimits, SolutionCount, Solutions, values_taken};
use super::error::ModelError;
use super::function_factors::ModelFactors;
use super::functions::gcd;
use super::identifiable::{IdentifiableFunctions, identifiable_functions, terms_of};
use super::judge::judge_compiled;
use super::judge::verdicts::{ByDigits, Judgement, SystemCertainty};
use super::model::{Compiled, Role, StartTime, StateStart, SystemModel};
use super::quotients::QuotientTerms;
use super::remedies::remedies;
use super::rows::layout::Unknown;
use super::solutions::solutions;
use super::symmetry::{Invariant, PolynomialDirection, PolynomialTerm, Symmetries, Symmetry, symmetries};
use crate::degree::status::{Status, Verdict};
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
    fn with_identifiability(self) -> Self {
        Self { identifiability: self.identifiability(), ..self }
    }

    /// Identifiability that follows from the verdict and the number of solutions.
    pub(super) fn identifiability(&self) -> Identifiability {
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

/// Analysis of a model with what it rests on.
pub(super) struct Analyzed {
    pub(super) analysis: SystemAnalysis,
    pub(super) judged: Judgement,
    /// Identifiable functions, in the order of the invariants of the analysis, and their factors.
    pub(super) functions: Vec<QuotientTerms>,
    pub(super) factors: ModelFactors,
}

/// Analysis of a model in continuous time.
pub(super) fn analyzed(model: &SystemModel, options: SystemOptions) -> Result<Analyzed, ModelError> {
    let SystemOptions { seed, order, .. } = options;
    let compiled = model.compile()?;
    let judged = judge_compiled(model, &compiled, seed, order)?;
    let symmetries = symmetries(model, &compiled, &judged, seed)?;
    let mut out = answer(model, &judged, &symmetries);
    out.note = symmetries.stopped.clone();
    let IdentifiableFunctions { found: functions, missing, factors } =
        identifiable_functions(model, &compiled, &judged, &symmetries, seed)?;
    let name = |c: usize| factors.name(c, model, &judged.layout);
    out.invariants.extend(functions.iter().map(|f| SystemCombination {
        expression: f.text(&name),
        degree: Some(f.degree),
        number_of_solutions: None,
    }));
    let own = symmetries.invariants.iter().map(terms_of);
    let listed: Vec<QuotientTerms> = own.chain(functions.into_iter().map(|f| f.terms)).collect();
    out.missing_functions = missing;
    out.branches = branches(&compiled);
    out.to_resolve = remedies(model, &compiled, &judged, (seed, symmetries.work), order);
    out.time = compiled.uses_time().then(|| match model.time {
        StartTime::Generic => "generic".into(),
        time => time.number().to_string(),
    });
    if !options.solutions {
        return Ok(Analyzed { analysis: out, judged, functions: listed, factors });
    }
    let limits = CountLimits {
        count: options.count_limit.saturating_mul(1_000_000),
        relations: options.relation_limit.saturating_mul(1_000_000),
    };
    let Solutions { counts, of_functions, of_asked, order: counting_order, maps } =
        values_taken(model, &compiled, &judged, &listed, (seed, limits));
    out.solution_maps = maps;
    for (function, count) in out.invariants.iter_mut().zip(of_functions) {
        function.number_of_solutions = Some(number_of_solutions(count, false));
    }
    for (asked, count) in out.combinations.iter_mut().zip(of_asked) {
        asked.number_of_solutions = asked.degree.map(|_| number_of_solutions(count, false));
    }
    let single: Vec<bool> = counts.iter().map(|c| *c == Some(Ok(1))).collect();
    let (found, missing) = solutions(model, &compiled, &judged, seed, &single);
    let notes: Vec<String> =
        symmetries.stopped.into_iter().chain(missing.map(|reason| reason.to_string())).collect();
    out.note = (!notes.is_empty()).then(|| notes.join("; "));
    for ((u, count), found) in judged.layout.unknowns.iter().zip(counts).zip(found) {
        if let Some(q) = out.quantities.iter_mut().find(|q| q.name == u.name) {
            let shown =
                (q.degree.is_some() && found.is_none()).then(|| shown_by(model, &compiled, u)).flatten();
            let unique = shown.is_some() || found.as_ref().is_some_and(|e| e.unique);
            q.solution = found.map(|e| e.text).or(shown);
            q.number_of_solutions = count.map(|count| number_of_solutions(count, unique));
            q.identifiability = q.identifiability();
        }
    }
    let counted = |q: &SystemQuantity| matches!(q.number_of_solutions, Some(NumberOfSolutions::Counted(_)));
    out.counting_order = out.quantities.iter().any(counted).then_some(counting_order);
    Ok(Analyzed { analysis: out, judged, functions: listed, factors })
}

/// Name of the output that equals a state, or of the output derivative that equals it: `y`, `y'`, `y''`;
/// `None` if no output does.
fn shown_by(model: &SystemModel, compiled: &Compiled, unknown: &Unknown) -> Option<String> {
    if model.experiments > 1 || !model.segments.is_empty() || !matches!(unknown.role, Role::State(_)) {
        return None;
    }
    let mut node = compiled.node_of(unknown.role)?;
    for primes in 0..4 {
        if let Some(output) = compiled.outputs(0).iter().position(|&o| o == node) {
            return Some(format!("{}{}", model.outputs[output].0.name, "'".repeat(primes)));
        }
        let state = compiled.rates(0).iter().position(|&rate| rate == node)?;
        node = compiled.node_of(Role::State(state))?;
    }
    None
}

fn number_of_solutions(count: SolutionCount, unique: bool) -> NumberOfSolutions {
    match (count, unique) {
        (Ok(1) | Err(_), true) => NumberOfSolutions::OneByExpression,
        (Ok(k), true) => NumberOfSolutions::Undecided(format!(
            "one solution by its expression and {k} by elimination: please report this model"
        )),
        (Ok(k), false) => NumberOfSolutions::Counted(k),
        (Err(e), false) => NumberOfSolutions::Undecided(e.to_string()),
    }
}

/// Verdict on unknown c, without its solutions.
fn quantity(model: &SystemModel, judged: &Judgement, c: usize, unknown: &Unknown) -> SystemQuantity {
    let (kind, named) = match unknown.role {
        Role::State(i) if model.is_algebraic(i) => ("algebraic", &model.states[i].named),
        Role::State(i) => ("state", &model.states[i].named),
        Role::Parameter(i) => ("parameter", &model.parameters[i]),
        Role::UnknownInput(i) => ("input", &model.unknown_inputs[i].0),
        // these roles are no unknowns
        Role::KnownInput(_) | Role::Constant(_) | Role::Time => ("known", &model.states[0].named),
    };
    let Verdict { status, degree } = judged.verdict_on(c);
    SystemQuantity {
        name: unknown.name.clone(),
        kind: kind.into(),
        unit: named.unit.clone(),
        description: named.description.clone(),
        status,
        degree,
        partners: judged.findings.partners[c].iter().map(|&p| name_of(model, judged, p)).collect(),
        solution: None,
        number_of_solutions: None,
        identifiability: Identifiability::NotDecided,
    }
}

/// Answer for a judged model.
fn answer(model: &SystemModel, judged: &Judgement, symmetries: &Symmetries) -> SystemAnalysis {
    let findings = &judged.findings;
    let name = |c: usize| name_of(model, judged, c);
    let shown = judged.layout.unknowns.iter().enumerate().filter(|&(c, _)| judged.shown(model, c));
    let quantities = shown.map(|(c, u)| quantity(model, judged, c, u).with_identifiability());
    let asked = model.combinations.iter().zip(judged.asked());
    let primes = match judged.certainty {
        SystemCertainty::Primes(primes) => Some(primes),
        SystemCertainty::Digits(_) => None,
    };
    SystemAnalysis {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        name: model.name.clone(),
        description: model.description.clone(),
        equations: model.equations(),
        rank_profile: findings.degrees.rank_profile.clone(),
        rank: findings.degrees.rank(),
        unknowns: judged.layout.unknowns.len(),
        quantities: quantities.collect(),
        known: (model.states.iter().filter(|s| s.start != StateStart::Unknown))
            .map(|s| s.named.name.clone())
            .collect(),
        time: None,
        constraints: model.constraint_texts(),
        constraint_factors: model.factors.clone(),
        combinations: asked
            .map(|(c, verdict)| SystemCombination {
                expression: c.text.clone(),
                degree: verdict.degree,
                number_of_solutions: None,
            })
            .collect(),
        unobservable_directions: judged.layout.unknowns.len() - findings.degrees.rank(),
        other_directions: named(&symmetries.unexplained, &name),
        invariants: invariant_reports(judged, symmetries),
        missing_functions: 0,
        symmetries: symmetry_reports(model, judged, symmetries),
        last_order: findings.degrees.rank_profile.len().saturating_sub(1),
        bound: judged.layout.bound,
        discrete: false,
        closed: judged.layout.closed,
        rests_on_bound: judged.rests_on_bound,
        branches: Vec::new(),
        branch_sides: judged.sides.clone(),
        to_resolve: Remedies::default(),
        why: Vec::new(),
        note: None,
        solution_maps: Vec::new(),
        counting_order: None,
        independent_functions: judged.independent_functions,
        primes: primes.map(|p| p.all_as_text()),
        error_bound: judged.error_bound(),
        digits: judged.digits(),
        seed: findings.seed,
    }
}

/// Name of an unknown; known constants are numbered after the unknowns.
fn name_of(model: &SystemModel, judged: &Judgement, c: usize) -> String {
    match judged.layout.unknowns.get(c) {
        Some(u) => u.name.clone(),
        None => model.constants[c - judged.layout.unknowns.len()].0.name.clone(),
    }
}

fn named(list: &[Vec<usize>], name: &dyn Fn(usize) -> String) -> Vec<Vec<String>> {
    list.iter().map(|columns| columns.iter().map(|&c| name(c)).collect()).collect()
}

/// `c`, or a similar name that the model does not use.
fn free_name(model: &SystemModel) -> String {
    let own = model.slot_names();
    let taken = |name: &str| own.iter().any(|n| n == name);
    ["c", "s", "k", "factor"].into_iter().find(|n| !taken(n)).unwrap_or("factor_").into()
}

/// Symmetries of a judged model in words: scalings and translations, then polynomial directions.
pub fn symmetry_reports(
    model: &SystemModel,
    judged: &Judgement,
    symmetries: &Symmetries,
) -> Vec<SymmetryReport> {
    let c = free_name(model);
    let name = &|c: usize| name_of(model, judged, c);
    let plain = symmetries.found.iter().map(|s| SymmetryReport {
        words: words(s, &c, name),
        unknowns: {
            let scaled = |t: &&(usize, _)| s.scaling.iter().any(|own| own.0 == t.0);
            let moved = s.translation.iter().filter(|t| !scaled(t));
            s.scaling.iter().chain(moved).map(|t| name(t.0)).collect()
        },
    });
    let polynomial = symmetries.polynomial.iter().map(|d| SymmetryReport {
        words: along(d, name),
        unknowns: d.components.iter().map(|c| name(c.0)).collect(),
    });
    plain.chain(polynomial).collect()
}

/// Text such as `move x, y, theta along -y, x, 1`.
fn along(d: &PolynomialDirection, name: &dyn Fn(usize) -> String) -> String {
    let term = |(factors, (p, q)): &PolynomialTerm, first: bool| {
        let sign = match (*p < 0, first) {
            (true, true) => "-",
            (true, false) => " - ",
            (false, true) => "",
            (false, false) => " + ",
        };
        let size = match (p.abs(), *q) {
            (1, 1) if !factors.is_empty() => String::new(),
            (p, 1) => p.to_string(),
            (p, q) => format!("{p}/{q}"),
        };
        let mut powers: Vec<(usize, usize)> = Vec::new();
        for &f in factors {
            match powers.last_mut() {
                Some((last, power)) if *last == f => *power += 1,
                _ => powers.push((f, 1)),
            }
        }
        let power = |&(f, power): &(usize, usize)| match power {
            1 => name(f),
            k => format!("{}^{k}", name(f)),
        };
        let factor = powers.iter().map(power).collect::<Vec<_>>().join("*");
        let times = if size.is_empty() || factor.is_empty() { "" } else { "*" };
        format!("{sign}{size}{times}{factor}")
    };
    let component = |terms: &Vec<PolynomialTerm>| -> String {
        terms.iter().enumerate().map(|(i, t)| term(t, i == 0)).collect()
    };
    let names: Vec<String> = d.components.iter().map(|c| name(c.0)).collect();
    let speeds: Vec<String> = d.components.iter().map(|c| component(&c.1)).collect();
    format!("move {} along {}", names.join(", "), speeds.join(", "))
}

/// A symmetry as its effect on the unknowns, for every `c` (every positive one if it has a scaling). It is
/// the flow of `x_i' = c_i x_i + d_i` after the time `log c`, or after `c` without a scaling. Examples:
/// `multiply a, b by c; divide d by c^2`, `add c to x; subtract 2 c from y`,
/// `multiply a by c; replace x by c*x + 1 - c; add log(c) to y`.
fn words(s: &Symmetry, c: &str, name: &dyn Fn(usize) -> String) -> String {
    let fraction = |(p, q): (i64, i64)| if q == 1 { p.to_string() } else { format!("{p}/{q}") };
    let power = |(p, q): (i64, i64)| match (p, q) {
        (1, 1) => c.to_string(),
        (p, 1) if p > 0 => format!("{c}^{p}"),
        k => format!("{c}^({})", fraction(k)),
    };
    let step = if s.scaling.is_empty() { c.to_string() } else { format!("log({c})") };
    let amount = |(p, q): (i64, i64)| {
        if (p, q) == (1, 1) { step.clone() } else { format!("{} {step}", fraction((p, q))) }
    };
    // unknowns with the same change stand together
    let mut groups: Vec<(String, Vec<String>, String)> = Vec::new();
    let mut put =
        |verb: &str, name: String, rest: String| match groups.iter_mut().find(|g| g.0 == verb && g.2 == rest)
        {
            Some(group) => group.1.push(name),
            None => groups.push((verb.into(), vec![name], rest)),
        };
    for &(i, (p, q)) in &s.scaling {
        let Some(&(_, (d, e))) = s.translation.iter().find(|t| t.0 == i) else {
            let verb = if p > 0 { "multiply" } else { "divide" };
            put(verb, name(i), format!("by {}", power((p.abs(), q))));
            continue;
        };
        // x' = k x + d moves x away from -d/k
        let (above, below) = (d * q, e * p);
        let divisor = gcd(above, below) * below.signum();
        let (centre, factor) = ((above / divisor, below / divisor), power((p, q)));
        let size = match (centre.0.abs(), centre.1) {
            (1, 1) => String::new(),
            size => format!("{}*", fraction(size)),
        };
        let moved = match (centre.0 > 0, size.is_empty()) {
            (true, true) => format!("{factor} - 1"),
            (false, true) => format!("1 - {factor}"),
            (true, false) => format!("{size}({factor} - 1)"),
            (false, false) => format!("{size}(1 - {factor})"),
        };
        put("replace", name(i), format!("by {factor}*{} + {moved}", name(i)));
    }
    let scaled = |i: usize| s.scaling.iter().any(|t| t.0 == i);
    for &(i, (p, q)) in s.translation.iter().filter(|t| !scaled(t.0)) {
        let (verb, to) = if p > 0 { ("add", "to") } else { ("subtract", "from") };
        put(&format!("{verb} {} {to}", amount((p.abs(), q))), name(i), String::new());
    }
    let join = |(verb, names, rest): &(String, Vec<String>, String)| {
        format!("{verb} {} {rest}", names.join(", ")).trim_end().to_string()
    };
    groups.iter().map(join).collect::<Vec<_>>().join("; ")
}

/// Observable combinations of unobservable unknowns in words, in the order of `symmetries.invariants`.
pub fn invariant_reports(judged: &Judgement, symmetries: &Symmetries) -> Vec<SystemCombination> {
    let name = |c: usize| judged.layout.unknowns[c].in_formulas();
    let product = |i: &Invariant| {
        let power = |&(c, m): &(usize, i64)| match m.abs() {
            1 => name(c),
            m => format!("{}^{m}", name(c)),
        };
        let part = |positive: bool| -> Vec<String> {
            i.terms.iter().filter(|t| (t.1 > 0) == positive).map(power).collect()
        };
        let (above, below) = (part(true), part(false));
        let above = if above.is_empty() { "1".into() } else { above.join("*") };
        match below.len() {
            0 => above,
            1 => format!("{above}/{}", below[0]),
            _ => format!("{above}/({})", below.join("*")),
        }
    };
    let sum = |i: &Invariant| {
        let mut out = String::new();
        for &(c, m) in &i.terms {
            let sign = match (out.is_empty(), m > 0) {
                (true, true) => "",
                (true, false) => "-",
                (false, true) => " + ",
                (false, false) => " - ",
            };
            let factor = if m.abs() == 1 { String::new() } else { format!("{}*", m.abs()) };
            out.push_str(&format!("{sign}{factor}{}", name(c)));
        }
        out
    };
    let report = |i: &Invariant| SystemCombination {
        expression: if i.product { product(i) } else { sum(i) },
        degree: Some(i.degree),
        number_of_solutions: None,
    };
    symmetries.invariants.iter().map(report).collect()
}
