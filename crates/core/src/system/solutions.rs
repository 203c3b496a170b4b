//! Solving expressions: what an unknown is in terms of outputs, inputs, their derivatives, and unknowns that are solved
//! with fewer.
//!
//! The symbolic worker eliminates; every expression is then evaluated at random points of both prime fields, where it
//! must give the unknown's value, and only what holds is shown.

use obsdeg_exact::{Field, SplitMix64};
use obsdeg_symbolic::{Job, RationalSystem, Request, Worker, WorkerError};

use super::dag::{Dag, Op};
use super::judge::Judgement;
use super::model::{Compiled, KnownInput, Role, StateStart, SystemModel};
use super::rows::SystemRows;
use crate::language::{Environment, Names, evaluate, parse_with};

/// Most unknowns.
const UNKNOWNS: usize = 30;
/// Highest order.
const ORDER: usize = 16;
/// Orders beyond its degree to which an expression may go: there what has finitely many solutions may have one.
const BEYOND: usize = 2;
/// Longest formula that is sent.
const LENGTH: usize = 20_000;
/// Longest expression that is kept.
const KEPT: usize = 50_000;

/// A symbol that the worker is told about.
#[derive(Debug, Clone)]
struct Symbol {
    /// Its name there.
    raw: String,
    /// Its name here.
    shown: String,
    /// The node and the order of the derivative that it stands for.
    node: Option<usize>,
    order: usize,
}

/// Why there are no solving expressions.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum NoExpressions {
    /// Nobody solves.
    #[error("this build has no symbolic engine: no solving expressions")]
    NoEngine,
    /// Experiments or segments.
    #[error("no solving expressions: they are sought for a single experiment without segments")]
    Parts,
    /// An input is unknown.
    #[error("no solving expressions: they are not sought where an input is unknown")]
    UnknownInput,
    /// Too large a system.
    #[error("no solving expressions: more than {UNKNOWNS} unknowns, or a degree above {ORDER}")]
    TooMany,
    /// A function in an equation.
    #[error(
        "solving expressions are sought for models without functions only (elsewhere only where an unknown is an output or its derivative)"
    )]
    NotRational,
    /// Too long an equation.
    #[error("no solving expressions: the equations are too long")]
    TooLong,
    /// The engine gave up.
    #[error("no solving expressions: {0}")]
    Engine(WorkerError),
}

/// What an unknown is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Expression {
    /// In the names of the model.
    pub(super) text: String,
    /// Every unknown in it is known to have one solution, or has such an expression itself; in the end they rest on outputs,
    /// inputs and constants: there is one solution.
    pub(super) unique: bool,
}

/// Expressions for the unknowns, in the order of the layout, or why there are none; `single` says of which it is known
/// otherwise that they have one solution.
///
/// # Errors
/// A sentence for the reader.
pub(super) fn solutions(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    seed: u64,
    worker: Option<&mut Worker>,
    single: &[bool],
) -> Result<Vec<Option<Expression>>, NoExpressions> {
    let highest = judged.findings.degrees.degree.iter().flatten().copied().max();
    let n = judged.layout.unknowns.len();
    let Some(highest) = highest else { return Ok(vec![None; n]) };
    if judged.fields.is_none() {
        return Err(NoExpressions::NotRational);
    }
    let worker = worker.ok_or(NoExpressions::NoEngine)?;
    let (request, symbols) = request(model, compiled, judged, highest)?;
    let (texts, _) = worker.ask(&request).map_err(NoExpressions::Engine)?;
    let mut out: Vec<Option<String>> = vec![None; n];
    let Job::Unknowns { system } = &request.job else { return Ok(vec![None; n]) };
    let roles = (0..system.states.len()).map(Role::State).chain(roles_of_parameters(model));
    for (role, text) in roles.zip(&texts) {
        let lane = judged.layout.unknowns.iter().position(|u| u.role == role);
        if let Some(lane) = lane.filter(|_| !text.is_empty() && text.len() <= KEPT) {
            out[lane] = Some(text.clone());
        }
    }
    let mut rng = model.random(seed, "solving expressions");
    for field in judged.fields.into_iter().flatten() {
        let held = check(model, compiled, judged, field, &mut rng, &symbols, &out);
        for (slot, held) in out.iter_mut().zip(held) {
            if !held {
                *slot = None;
            }
        }
    }
    let unique = unique(judged, compiled, &symbols, &out, single);
    let kept = |(text, unique): (Option<String>, bool)| {
        text.map(|t| Expression { text: shown(&t, &symbols), unique })
    };
    Ok(out.into_iter().zip(unique).map(kept).collect())
}

/// Which expressions rest on nothing but what is `single` or has an expression that does, and not on themselves.
fn unique(
    judged: &Judgement,
    compiled: &Compiled,
    symbols: &[Symbol],
    expressions: &[Option<String>],
    single: &[bool],
) -> Vec<bool> {
    let lane_of = |word: &str| {
        // of states, parameters and inputs that are unknown; an output may share the node of one
        let symbol = symbols.iter().find(|s| s.raw == word && word.starts_with(['x', 'p', 'w']))?;
        judged.layout.unknowns.iter().position(|u| compiled.node_of(u.role) == symbol.node)
    };
    let rests_on: Vec<Option<Vec<usize>>> =
        expressions.iter().map(|e| Some(words(e.as_ref()?).filter_map(lane_of).collect())).collect();
    let mut unique = vec![false; expressions.len()];
    loop {
        let before = unique.clone();
        for (lane, on) in rests_on.iter().enumerate() {
            unique[lane] =
                on.as_ref().is_some_and(|on| on.iter().all(|&other| before[other] || single[other]));
        }
        if unique == before {
            return unique;
        }
    }
}

/// Unknown constants: parameters, and unknown inputs that do not change.
fn roles_of_parameters(model: &SystemModel) -> impl Iterator<Item = Role> {
    (0..model.parameters.len())
        .map(Role::Parameter)
        .chain((0..model.unknown_inputs.len()).map(Role::UnknownInput))
}

fn request(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    highest: usize,
) -> Result<(Request, Vec<Symbol>), NoExpressions> {
    if model.experiments > 1 || !model.segments.is_empty() {
        return Err(NoExpressions::Parts);
    }
    if model.unknown_inputs.iter().any(|u| u.1 != Some(0)) {
        return Err(NoExpressions::UnknownInput);
    }
    if judged.layout.unknowns.len() > UNKNOWNS || highest > ORDER {
        return Err(NoExpressions::TooMany);
    }
    let mut symbols: Vec<Symbol> = Vec::new();
    let mut names: Vec<String> = Vec::new();
    let put = |symbols: &mut Vec<Symbol>, raw: String, shown: String, node: Option<usize>, order: usize| {
        symbols.push(Symbol { raw: raw.clone(), shown, node, order });
        raw
    };
    let mut time = None;
    let mut states = Vec::new();
    let mut inputs = Vec::new();
    let mut parameters = Vec::new();
    for role in &compiled.roles {
        let node = compiled.node_of(*role);
        names.push(match *role {
            Role::State(i) => {
                states.push(put(&mut symbols, format!("x_{i}"), model.states[i].named.name.clone(), node, 0));
                format!("x_{i}")
            }
            Role::Parameter(i) => {
                parameters.push(put(
                    &mut symbols,
                    format!("p_{i}"),
                    model.parameters[i].name.clone(),
                    node,
                    0,
                ));
                format!("p_{i}")
            }
            Role::UnknownInput(i) => {
                let name = model.unknown_inputs[i].0.name.clone();
                parameters.push(put(&mut symbols, format!("w_{i}"), name, node, 0));
                format!("w_{i}")
            }
            Role::Constant(i) => {
                put(&mut symbols, format!("k_{i}"), model.constants[i].0.name.clone(), node, 0)
            }
            Role::KnownInput(i) => {
                let (named, kind) = &model.known_inputs[i];
                let last = match kind {
                    KnownInput::Polynomial(d) => (*d).min(highest + 1 + BEYOND),
                    _ => highest + 1 + BEYOND,
                };
                let chain = (0..=last)
                    .map(|k| put(&mut symbols, format!("u_{i}_{k}"), derivative(&named.name, k), node, k))
                    .collect();
                inputs.push((chain, matches!(kind, KnownInput::Polynomial(d) if *d <= last)));
                format!("u_{i}_0")
            }
            Role::Time => {
                time = node.map(|_| put(&mut symbols, "t_0".into(), "t".into(), node, 0));
                "t_0".into()
            }
        });
    }
    // a constant that is given by a formula is no symbol of its own: its value is
    let texts = texts(&compiled.dag, &names)?;
    let text = |node: usize| texts[node].clone().ok_or(NoExpressions::NotRational);
    let mut outputs = Vec::new();
    for (j, &node) in compiled.outputs(0).iter().enumerate() {
        let name = &model.outputs[j].0.name;
        let chain = (0..=highest + 1 + BEYOND)
            .map(|k| put(&mut symbols, format!("y_{j}_{k}"), derivative(name, k), Some(node), k))
            .collect();
        outputs.push((text(node)?, chain));
    }
    let mut starts = Vec::new();
    for (i, s) in model.states.iter().enumerate().filter(|(_, s)| s.start != StateStart::Unknown) {
        let (node, shown) = (compiled.node_of(Role::State(i)), format!("{}(0)", s.named.name));
        starts.push((i, put(&mut symbols, format!("s_{i}"), shown, node, 0)));
    }
    let roles = (0..states.len()).map(Role::State).chain(roles_of_parameters(model));
    let degree = |role: Role| {
        let lane = judged.layout.unknowns.iter().position(|u| u.role == role)?;
        judged.findings.degrees.degree[lane]
    };
    let role_is_free = |role: Role| {
        let lane = judged.layout.unknowns.iter().position(|u| u.role == role);
        lane.is_some_and(|lane| judged.span.as_ref().is_some_and(|s| s.pivots().all(|p| p != lane)))
    };
    let free = roles_of_parameters(model).enumerate().filter(|(_, role)| role_is_free(*role));
    let free = free.map(|(p, _)| p).collect();
    let system = RationalSystem {
        equations: compiled.rates(0).iter().map(|&r| text(r)).collect::<Result<_, _>>()?,
        states,
        parameters,
        outputs,
        inputs,
        time,
        starts,
        degrees: roles.map(degree).collect(),
        beyond: BEYOND,
        free,
    };
    let request = Request {
        symbols: symbols.iter().map(|s| s.raw.clone()).collect(),
        generators: vec![],
        angles: vec![],
        job: Job::Unknowns { system },
    };
    Ok((request, symbols))
}

/// `y`, `y'`, `y''`, `y'''`, `y^(4)`.
fn derivative(name: &str, order: usize) -> String {
    match order {
        0..=3 => format!("{name}{}", "'".repeat(order)),
        k => format!("{name}^({k})"),
    }
}

/// Every node as text, in the names of the slots; `None` for what is not rational.
fn texts(dag: &Dag, names: &[String]) -> Result<Vec<Option<String>>, NoExpressions> {
    let mut out: Vec<Option<String>> = Vec::with_capacity(dag.ops.len());
    for op in &dag.ops {
        let two = |a: usize, b: usize, sign: &str| {
            let (a, b) = (out.get(a)?.as_ref()?, out.get(b)?.as_ref()?);
            Some(format!("({a}{sign}{b})"))
        };
        let text = match *op {
            Op::Number { mantissa, decimals } if decimals > 0 => Some(format!("({mantissa}/10^{decimals})")),
            Op::Number { mantissa, decimals } => Some(format!("({mantissa}*10^{})", -decimals)),
            Op::Slot(slot) => names.get(slot).cloned(),
            Op::Add(a, b) => two(a, b, "+"),
            Op::Subtract(a, b) => two(a, b, "-"),
            Op::Multiply(a, b) => two(a, b, "*"),
            Op::Divide(a, b) => two(a, b, "/"),
            Op::Primitive { .. } | Op::Pi => None,
        };
        if text.as_ref().is_some_and(|t| t.len() > LENGTH) {
            return Err(NoExpressions::TooLong);
        }
        out.push(text);
    }
    Ok(out)
}

struct Point<'a>(&'a [(String, u64)]);

impl Environment for Point<'_> {
    fn name(&self, name: &str) -> Option<u64> {
        self.0.iter().find(|(n, _)| n == name).map(|(_, x)| *x)
    }

    fn cos_sin(&self, _: &str) -> Option<(u64, u64)> {
        None
    }

    fn known(&self) -> Vec<String> {
        Vec::new()
    }
}

/// Whether the expressions give the unknowns at a random point.
fn check(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    field: Field,
    rng: &mut SplitMix64,
    symbols: &[Symbol],
    expressions: &[Option<String>],
) -> Vec<bool> {
    let Ok(mut rows) = SystemRows::new(model, compiled, &judged.layout, field, rng) else {
        return vec![false; expressions.len()];
    };
    let used = |s: &&Symbol| expressions.iter().flatten().any(|e| words(e).any(|w| w == s.raw));
    let values: Vec<(String, u64)> = (symbols.iter().filter(used))
        .filter_map(|s| Some((s.raw.clone(), rows.derivative(s.node?, s.order))))
        .collect();
    let truth = rows.values(compiled, &judged.layout, 0);
    let holds = |(text, truth): (&Option<String>, &u64)| {
        let value = text.as_ref().and_then(|t| {
            let parsed = parse_with(t, Names::Plain).ok()?;
            evaluate(&parsed, &field, &Point(&values)).ok()
        });
        value == Some(*truth)
    };
    expressions.iter().zip(&truth).map(holds).collect()
}

/// Names and what stands between them.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let mut rest = text;
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let is_name = |c: char| c.is_alphanumeric() || c == '_';
        let end = rest.find(|c: char| is_name(c) != is_name(first)).unwrap_or(rest.len());
        let (word, tail) = rest.split_at(end);
        rest = tail;
        Some(word)
    })
}

fn shown(text: &str, symbols: &[Symbol]) -> String {
    words(text).map(|w| symbols.iter().find(|s| s.raw == w).map_or(w, |s| s.shown.as_str())).collect()
}
