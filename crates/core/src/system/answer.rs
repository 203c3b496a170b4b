//! The answer for one system: plain data, serialisable.

pub(super) mod data;
pub(super) mod texts;

use super::branches::branches;
use super::counts::{CountLimits, SolutionCount, Solutions, values_taken};
use super::error::ModelError;
use super::function_factors::ModelFactors;
use super::identifiable::{IdentifiableFunctions, identifiable_functions, terms_of};
use super::judge::judge_compiled;
use super::judge::verdicts::{Judgement, SystemCertainty};
use super::model::compiled::{Compiled, Role};
use super::model::{StartTime, StateStart, SystemModel};
use super::quotients::QuotientTerms;
use super::remedies::remedies;
use super::rows::layout::Unknown;
use super::solutions::solutions;
use super::symmetry::{Symmetries, symmetries};
use crate::degree::status::Verdict;
use crate::remedies::Remedies;
use data::{
    Identifiability, NumberOfSolutions, SCHEMA, SystemAnalysis, SystemCombination, SystemOptions,
    SystemQuantity,
};
use texts::{invariant_reports, name_of, named, symmetry_reports};

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
