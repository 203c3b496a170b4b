//! Solving expressions: an unknown in terms of outputs, inputs, their derivatives, and unknowns of lower
//! degrees.
//!
//! Elimination over the first prime field finds them (`elimination`), with integers recovered from it
//! (`formula`). Every expression is then evaluated at random points of both prime fields, where it must give
//! the unknown's value. Only expressions that pass are shown.

use std::collections::BTreeSet;

use obsdeg_exact::divisor::Algebra;
use obsdeg_exact::fraction::Fraction;
use obsdeg_exact::groebner::RemainingWork;
use obsdeg_exact::multivariate::Polynomial;
use obsdeg_exact::{Field, SplitMix64};

use super::dag::Op;
use super::elimination::{EliminationSystem, eliminate};
use super::fibre::reached;
use super::formula;
use super::judge::verdicts::Judgement;
use super::model::compiled::{Compiled, Role};
use super::model::{KnownInput, StateStart, SystemModel};
use super::rows::SystemRows;
use super::values::Values;
use super::work::Work as VerdictWork;
use crate::language::{Environment, Names, evaluate, parse_with};

/// Largest number of unknowns.
const UNKNOWNS: usize = 30;
/// Highest order of derivatives.
const ORDER: usize = 16;
/// Number of orders beyond its degree to which an expression may go: there an unknown with finitely many
/// solutions may have one.
const BEYOND: usize = 2;
/// Longest expression that is kept, in characters.
const KEPT: usize = 50_000;
/// Limit of products of coefficients of the elimination: about a second.
const WORK: u64 = 100_000_000;

/// Symbol in expressions.
#[derive(Debug, Clone)]
struct Symbol {
    /// Internal name, which no other symbol has.
    raw: String,
    /// Name in the answer.
    shown: String,
    /// Node and derivative order that the symbol stands for.
    node: Option<usize>,
    order: usize,
}

/// Reasons why there are no solving expressions, or why some are missing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum NoExpressions {
    /// The model has several experiments or segments.
    #[error("no solving expressions: they are sought for a single experiment without segments")]
    Parts,
    /// An input is unknown.
    #[error("no solving expressions: they are not sought where an input is unknown")]
    UnknownInput,
    /// The system is too large.
    #[error("no solving expressions: more than {UNKNOWNS} unknowns, or a degree above {ORDER}")]
    TooMany,
    /// An equation contains a function.
    #[error(
        "solving expressions are sought for models without functions only (elsewhere only where an unknown \
         is an output or its derivative)"
    )]
    NotRational,
    /// The elimination exceeds its limit of work.
    #[error(
        "solving expressions are missing where the elimination is beyond its limit of work, which no option raises"
    )]
    OverLimit,
}

/// Solving expression of an unknown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SolvingExpression {
    /// Text in the names of the model.
    pub(super) text: String,
    /// True if the unknown is known to have one solution: every unknown in the expression has one solution,
    /// or has such an expression itself. In the end they depend on outputs, inputs and constants alone.
    pub(super) unique: bool,
}

/// Expressions for the unknowns, in the order of the layout, and the reason why there are none, or why some
/// are missing; `single` is true for unknowns that are otherwise known to have one solution.
pub(super) fn solutions(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    seed: u64,
    single: &[bool],
) -> (Vec<Option<SolvingExpression>>, Option<NoExpressions>) {
    let n = judged.layout.unknowns.len();
    let none = |reason| (vec![None; n], reason);
    let highest = judged.findings.degrees.degree.iter().flatten().copied().max();
    let Some(highest) = highest else { return none(None) };
    let Some(fields) = judged.fields else { return none(Some(NoExpressions::NotRational)) };
    let signals = match Signals::new(model, compiled, judged, highest) {
        Ok(signals) => signals,
        Err(reason) => return none(Some(reason)),
    };
    let mut rng = model.random(seed, "solving expressions");
    let s = Algebra { f: fields[0], rng: model.random(seed, "elimination"), work: RemainingWork::new(WORK) };
    let (mut out, complete) = match by_elimination(s, model, compiled, judged, &signals) {
        Ok(found) => found,
        Err(reason) => return none(Some(reason)),
    };
    for field in fields {
        let held = check(model, compiled, judged, field, &mut rng, &signals.symbols, &out);
        for (slot, held) in out.iter_mut().zip(held) {
            slot.take_if(|_| !held);
        }
    }
    let mut sought = out.iter().zip(&judged.findings.degrees.degree);
    let missing = sought.any(|(e, degree)| e.is_none() && degree.is_some());
    let reason = (!complete && missing).then_some(NoExpressions::OverLimit);
    let mut rests_on = rests_on(judged, compiled, &signals.symbols, &out);
    drop_circles(&mut rests_on);
    let unique = unique(&rests_on, single);
    let kept = |((text, on), unique): ((Option<String>, Option<BTreeSet<usize>>), bool)| {
        let text = on.and(text)?;
        Some(SolvingExpression { text: shown(&text, &signals.symbols), unique })
    };
    (out.into_iter().zip(rests_on).zip(unique).map(kept).collect(), reason)
}

/// Internal name of an unknown in expressions.
fn raw(role: Role) -> String {
    match role {
        Role::State(i) => format!("x_{i}"),
        Role::Parameter(i) => format!("p_{i}"),
        Role::UnknownInput(i) => format!("w_{i}"),
        Role::Constant(i) => format!("k_{i}"),
        Role::KnownInput(i) => format!("u_{i}_0"),
        Role::Time => "t_0".into(),
    }
}

/// Texts of states, then of constants, in the order of the layout, without those that are too long.
fn in_layout(
    model: &SystemModel,
    judged: &Judgement,
    texts: impl IntoIterator<Item = Option<String>>,
) -> Vec<Option<String>> {
    let mut out: Vec<Option<String>> = vec![None; judged.layout.unknowns.len()];
    let roles = (0..model.states.len()).map(Role::State).chain(roles_of_parameters(model));
    for (role, text) in roles.zip(texts) {
        let unknown = judged.layout.unknowns.iter().position(|u| u.role == role);
        if let Some(unknown) = unknown {
            out[unknown] = text.filter(|t| !t.is_empty() && t.len() <= KEPT);
        }
    }
    out
}

/// Expressions by elimination over the field, and true if all were sought within the limit of work.
fn by_elimination(
    mut s: Algebra,
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    signals: &Signals,
) -> Result<(Vec<Option<String>>, bool), NoExpressions> {
    let fractions = match fractions(&mut s, compiled, signals)? {
        Some(fractions) => fractions,
        None => return Ok((vec![None; judged.layout.unknowns.len()], false)),
    };
    let numbers = |list: &[usize]| -> Vec<u32> { list.iter().map(|&i| i as u32).collect() };
    let fraction = |node: usize| fractions[node].clone().ok_or(NoExpressions::NotRational);
    let system = EliminationSystem {
        states: numbers(&signals.states),
        rates: compiled.rates(0).iter().map(|&r| fraction(r)).collect::<Result<_, _>>()?,
        parameters: numbers(&signals.parameters),
        outputs: (compiled.outputs(0).iter().zip(&signals.outputs))
            .map(|(&node, chain)| Ok((fraction(node)?, numbers(chain))))
            .collect::<Result<_, _>>()?,
        inputs: signals.inputs.iter().map(|(chain, ends)| (numbers(chain), *ends)).collect(),
        time: signals.time.map(|t| t as u32),
        starts: signals.starts.iter().map(|&(i, value)| (i, value as u32)).collect(),
        degrees: signals.degrees.clone(),
        beyond: BEYOND,
        free: signals.free.clone(),
    };
    let (found, mut complete) = eliminate(&mut s, &system);
    let names: Vec<String> = signals.symbols.iter().map(|s| s.raw.clone()).collect();
    let mut texts = Vec::new();
    for e in found {
        let text = e.map(|e| formula::text(&mut s, &e, &names));
        complete &= !matches!(text, Some(Err(_)));
        texts.push(text.and_then(Result::ok).flatten());
    }
    Ok((in_layout(model, judged, texts), complete))
}

/// Nodes that rates and outputs depend on, as fractions; `None` if their work exceeds the limit.
fn fractions(
    s: &mut Algebra,
    compiled: &Compiled,
    signals: &Signals,
) -> Result<Option<Vec<Option<Fraction>>>, NoExpressions> {
    let roots: Vec<usize> = compiled.rates(0).iter().chain(compiled.outputs(0)).copied().collect();
    let needed = reached(compiled, &roots, |_| None);
    let mut out: Vec<Option<Fraction>> = Vec::with_capacity(needed.len());
    for (op, needed) in compiled.dag.ops.iter().zip(needed) {
        if !needed {
            out.push(None);
            continue;
        }
        let value = |node: usize| out.get(node).and_then(Option::as_ref).ok_or(NoExpressions::NotRational);
        let made = match *op {
            Op::Number { mantissa, decimals } => {
                let number = Values::number(&s.f, mantissa, decimals);
                Ok(s.whole(Polynomial::constant(number)))
            }
            Op::Slot(slot) => {
                let symbol = signals.slots.get(slot).copied().flatten().ok_or(NoExpressions::NotRational)?;
                Ok(s.whole(Polynomial::variable(&s.f, symbol as u32)))
            }
            Op::Add(a, b) => s.sum(value(a)?, value(b)?),
            Op::Subtract(a, b) => {
                let minus = s.minus(value(b)?);
                s.sum(value(a)?, &minus)
            }
            Op::Multiply(a, b) => s.times(value(a)?, value(b)?),
            Op::Divide(a, b) => match value(b)? {
                zero if zero.is_zero() => return Err(NoExpressions::NotRational),
                below => {
                    let inverse = s.inverse(below);
                    s.times(value(a)?, &inverse)
                }
            },
            Op::Primitive { .. } | Op::Pi => return Err(NoExpressions::NotRational),
        };
        match made {
            Ok(fraction) if s.keep(fraction.terms()).is_ok() => out.push(Some(fraction)),
            _ => return Ok(None),
        }
    }
    Ok(Some(out))
}

/// Unknowns in every expression.
fn rests_on(
    judged: &Judgement,
    compiled: &Compiled,
    symbols: &[Symbol],
    expressions: &[Option<String>],
) -> Vec<Option<BTreeSet<usize>>> {
    let component_of = |word: &str| {
        // symbols of unknown states, parameters and inputs; an output may share the node of one
        let symbol = symbols.iter().find(|s| s.raw == word && word.starts_with(['x', 'p', 'w']))?;
        judged.layout.unknowns.iter().position(|u| compiled.node_of(u.role) == symbol.node)
    };
    expressions.iter().map(|e| Some(words(e.as_ref()?).filter_map(component_of).collect())).collect()
}

/// Drops expressions that are no solutions: an expression contains its own unknown, directly or through the
/// expressions of the unknowns in it.
fn drop_circles(rests_on: &mut [Option<BTreeSet<usize>>]) {
    for unknown in 0..rests_on.len() {
        let (mut seen, mut left) = (BTreeSet::new(), vec![unknown]);
        while let Some(at) = left.pop() {
            left.extend(rests_on[at].iter().flatten().filter(|&&on| seen.insert(on)));
        }
        rests_on[unknown].take_if(|_| seen.contains(&unknown));
    }
}

/// True for expressions that depend only on unknowns that are `single` or have such an expression.
fn unique(rests_on: &[Option<BTreeSet<usize>>], single: &[bool]) -> Vec<bool> {
    let mut unique = vec![false; rests_on.len()];
    loop {
        let before = unique.clone();
        for (unknown, on) in rests_on.iter().enumerate() {
            unique[unknown] =
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

/// Symbols of a system, by their indices in the list.
#[derive(Default)]
struct Signals {
    symbols: Vec<Symbol>,
    /// Symbol of every slot; `None` for a slot without one.
    slots: Vec<Option<usize>>,
    states: Vec<usize>,
    /// Symbols of the unknown constants.
    parameters: Vec<usize>,
    /// Symbols of every output and its derivatives: `y, y', y'', ...`.
    outputs: Vec<Vec<usize>>,
    /// Symbols of every known input and its derivatives: `u, u', ...`; true if further derivatives vanish.
    inputs: Vec<(Vec<usize>, bool)>,
    time: Option<usize>,
    /// Known starts: state, and the symbol of its value.
    starts: Vec<(usize, usize)>,
    /// Degree of every state, then of every unknown constant.
    degrees: Vec<Option<usize>>,
    /// Unknown constants that a symmetry changes.
    free: Vec<usize>,
}

impl Signals {
    /// Symbols of a model whose expressions are sought.
    fn new(
        model: &SystemModel,
        compiled: &Compiled,
        judged: &Judgement,
        highest: usize,
    ) -> Result<Self, NoExpressions> {
        if model.experiments > 1 || !model.segments.is_empty() {
            return Err(NoExpressions::Parts);
        }
        if model.unknown_inputs.iter().any(|u| u.1 != Some(0)) {
            return Err(NoExpressions::UnknownInput);
        }
        if judged.layout.unknowns.len() > UNKNOWNS || highest > ORDER {
            return Err(NoExpressions::TooMany);
        }
        let mut out = Self::default();
        let last = highest + 1 + BEYOND;
        for role in &compiled.roles {
            let symbol = out.add_slot(model, *role, compiled.node_of(*role), last);
            out.slots.push(symbol);
        }
        for (j, &node) in compiled.outputs(0).iter().enumerate() {
            let chain = out.chain(&format!("y_{j}"), &model.outputs[j].0.name, Some(node), last);
            out.outputs.push(chain);
        }
        for (i, s) in model.states.iter().enumerate().filter(|(_, s)| s.start != StateStart::Unknown) {
            let (node, shown) = (compiled.node_of(Role::State(i)), format!("{}(0)", s.named.name));
            let start = out.add(format!("s_{i}"), shown, node, 0);
            out.starts.push((i, start));
        }
        let unknown = |role: Role| judged.layout.unknowns.iter().position(|u| u.role == role);
        let roles = (0..out.states.len()).map(Role::State).chain(roles_of_parameters(model));
        let degree = |role| unknown(role).and_then(|l| judged.findings.degrees.degree[l]);
        out.degrees = roles.map(degree).collect();
        let is_free = |role: Role| {
            unknown(role).is_some_and(|l| judged.span.as_ref().is_some_and(|s| s.pivots().all(|p| p != l)))
        };
        let free = roles_of_parameters(model).enumerate().filter(|(_, role)| is_free(*role));
        out.free = free.map(|(p, _)| p).collect();
        Ok(out)
    }

    /// Appends a symbol; returns its index.
    fn add(&mut self, raw: String, shown: String, node: Option<usize>, order: usize) -> usize {
        self.symbols.push(Symbol { raw, shown, node, order });
        self.symbols.len() - 1
    }

    /// Appends the symbols of a signal and its derivatives up to the order `last`.
    fn chain(&mut self, raw: &str, name: &str, node: Option<usize>, last: usize) -> Vec<usize> {
        (0..=last).map(|k| self.add(format!("{raw}_{k}"), derivative(name, k), node, k)).collect()
    }

    /// Appends the symbols of a slot, of a known input up to the order `last`; returns that of its value.
    fn add_slot(
        &mut self,
        model: &SystemModel,
        role: Role,
        node: Option<usize>,
        last: usize,
    ) -> Option<usize> {
        match role {
            Role::State(i) => {
                let symbol = self.add(raw(role), model.states[i].named.name.clone(), node, 0);
                self.states.push(symbol);
                Some(symbol)
            }
            Role::Parameter(i) => {
                let symbol = self.add(raw(role), model.parameters[i].name.clone(), node, 0);
                self.parameters.push(symbol);
                Some(symbol)
            }
            Role::UnknownInput(i) => {
                let symbol = self.add(raw(role), model.unknown_inputs[i].0.name.clone(), node, 0);
                self.parameters.push(symbol);
                Some(symbol)
            }
            Role::Constant(i) => Some(self.add(raw(role), model.constants[i].0.name.clone(), node, 0)),
            Role::KnownInput(i) => {
                let (named, kind) = &model.known_inputs[i];
                let last = match kind {
                    KnownInput::Polynomial(d) => (*d).min(last),
                    _ => last,
                };
                let chain = self.chain(&format!("u_{i}"), &named.name, node, last);
                let first = chain.first().copied();
                self.inputs.push((chain, matches!(kind, KnownInput::Polynomial(d) if *d <= last)));
                first
            }
            Role::Time => {
                self.time = node.map(|_| self.add(raw(role), "t".into(), node, 0));
                self.time
            }
        }
    }
}

/// Name of a derivative: `y`, `y'`, `y''`, `y'''`, `y^(4)`.
fn derivative(name: &str, order: usize) -> String {
    match order {
        0..=3 => format!("{name}{}", "'".repeat(order)),
        k => format!("{name}^({k})"),
    }
}

struct SymbolPoint<'a>(&'a [(String, u64)]);

impl Environment for SymbolPoint<'_> {
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

/// True, per expression, if it gives its unknown at a random point.
fn check(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    field: Field,
    rng: &mut SplitMix64,
    symbols: &[Symbol],
    expressions: &[Option<String>],
) -> Vec<bool> {
    let work = VerdictWork::new(model.work_limit);
    let Ok(mut rows) = SystemRows::new(model, compiled, &judged.layout, field, rng, &work) else {
        return vec![false; expressions.len()];
    };
    let used: BTreeSet<&str> = expressions.iter().flatten().flat_map(|e| words(e)).collect();
    let values: Vec<(String, u64)> = (symbols.iter().filter(|s| used.contains(s.raw.as_str())))
        .filter_map(|s| Some((s.raw.clone(), rows.derivative(s.node?, s.order))))
        .collect();
    let truth = rows.values(compiled, &judged.layout, &[]);
    let holds = |(text, truth): (&Option<String>, &u64)| {
        let value = text.as_ref().and_then(|t| {
            let parsed = parse_with(t, Names::Plain).ok()?;
            evaluate(&parsed, &field, &SymbolPoint(&values)).ok()
        });
        value == Some(*truth)
    };
    expressions.iter().zip(&truth).map(holds).collect()
}

/// Names in a text and the parts between them.
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
