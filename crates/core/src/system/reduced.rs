//! Reduced models: a fully observable model with the outputs of another one over complex numbers. As many
//! unknowns as there are unobservable directions take fixed numbers; the others represent identifiable
//! functions. Some real outputs may be missing: those with `a b^2 < 0` if `a` is fixed at 1.
//!
//! The fixed unknowns are independent of all functions that the outputs determine. If the remaining model is
//! fully observable, its number of unknowns is the rank of the first model, so the outputs of both fill a
//! variety of the same dimension. This variety is irreducible, and the outputs of the second model are among
//! those of the first. So at generic points, complex ones included, each has the outputs of the other.

use std::fmt::Write as _;

use obsdeg_exact::Echelon;

use super::error::ModelError;
use super::identifiable::{identifiable_functions, terms_of};
use super::judge::verdicts::Judgement;
use super::judge::{judge, judge_compiled};
use super::model::compiled::Role;
use super::model::{
    Constant, KnownInput, Named, PlacedExpression, StartTime, State, StateStart, SystemModel,
};
use super::model_file;
use super::quotients::QuotientTerms;
use super::symmetry::symmetries;

/// Reasons for the lack of a reduced model.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReducedError {
    /// The model has a fault.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The model is fully observable: there is nothing to reduce.
    #[error("the model is fully observable: there is nothing to reduce")]
    FullyObservable,
    /// The model is of a kind that is not covered.
    #[error("no reduced model is written for a model {0}")]
    NotCovered(&'static str),
    /// No suitable numbers were found.
    #[error("no numbers were found with which the model is fully observable")]
    NoNumbers,
}

/// Model with fewer unknowns and the same outputs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reduced {
    /// Text of the model file, TOML.
    pub text: String,
    /// Unknowns with a fixed number, as `(name, number)`.
    pub fixed: Vec<(String, i64)>,
    /// Functions that the remaining unknowns represent, as `(name, identifiable function)`, if they were
    /// found.
    pub stands_for: Vec<(String, String)>,
}

/// The reduced model, which was judged again: it is fully observable, with the rank of the model.
///
/// # Errors
/// [`ReducedError`].
pub fn reduced(model: &SystemModel, seed: u64, order: Option<usize>) -> Result<Reduced, ReducedError> {
    covered(model)?;
    let compiled = model.compile()?;
    let judged = judge_compiled(model, &compiled, seed, order)?;
    let rank = judged.findings.degrees.rank();
    let Some(span) = &judged.span else {
        return Err(ReducedError::NotCovered("with functions that are judged in real numbers"));
    };
    if rank == judged.layout.unknowns.len() {
        return Err(ReducedError::FullyObservable);
    }
    let unknowns = fixed_unknowns(&judged, span);
    let symmetries = symmetries(model, &compiled, &judged, seed)?;
    let functions = identifiable_functions(model, &compiled, &judged, &symmetries, seed)?.found;
    let mut listed: Vec<QuotientTerms> = symmetries.invariants.iter().map(terms_of).collect();
    listed.extend(functions.iter().map(|f| f.terms.clone()));
    let ones = unknowns.iter().map(|&l| (l, 1)).collect::<Vec<_>>();
    let primes = unknowns.iter().copied().zip([2, 3, 5, 7, 11, 13, 17, 19, 23, 29].into_iter().cycle());
    for (numbers, plain) in [(ones, true), (primes.collect(), false)] {
        let name = |unknown: usize| judged.layout.unknowns[unknown].name.clone();
        let stands_for: Vec<(String, String)> = match plain {
            true => listed.iter().filter_map(|terms| stands_for(terms, &numbers, &judged)).collect(),
            false => Vec::new(),
        };
        let fixed: Vec<(String, i64)> = numbers.iter().map(|&(l, x)| (name(l), x)).collect();
        let text = FileContent { model, fixed: &fixed, stands_for: &stands_for }.text();
        let holds = |m: &SystemModel| -> Result<bool, ModelError> {
            let again = judge(m, seed, order)?;
            let found = again.findings.degrees.rank();
            Ok(found == again.layout.unknowns.len() && found == rank)
        };
        if let Ok(m) = model_file::read(&text)
            && holds(&m).unwrap_or(false)
        {
            return Ok(Reduced { text, fixed, stands_for });
        }
    }
    Err(ReducedError::NoNumbers)
}

fn covered(model: &SystemModel) -> Result<(), ReducedError> {
    let plain = |name: &String| name.chars().all(|c| c.is_alphanumeric() || c == '_');
    let names = model.states.iter().map(|s| &s.named.name).chain(model.parameters.iter().map(|p| &p.name));
    let reason = match () {
        () if model.experiments > 1 || !model.own.is_empty() => "with several experiments",
        () if !model.segments.is_empty() => "with segments",
        () if !model.constraints.is_empty() => "with constraints",
        () if !model.unknown_inputs.is_empty() => "with unknown inputs",
        () if !names.into_iter().all(plain) => "with vectors",
        () => return Ok(()),
    };
    Err(ReducedError::NotCovered(reason))
}

/// Unknowns that are independent of all functions that the outputs determine, one for each direction:
/// parameters first.
fn fixed_unknowns(judged: &Judgement, span: &Echelon) -> Vec<usize> {
    let (f, n) = (span.field(), judged.layout.unknowns.len());
    let is_parameter = |unknown: &usize| matches!(judged.layout.unknowns[*unknown].role, Role::Parameter(_));
    let (mut order, states): (Vec<usize>, Vec<usize>) = (0..n).partition(is_parameter);
    order.extend(states);
    let mut space = span.clone();
    order.retain(|&unknown| {
        let unit: Vec<u64> = (0..n).map(|i| if i == unknown { f.one() } else { 0 }).collect();
        space.insert(&unit)
    });
    order.sort_unstable();
    order
}

/// Function that an unknown represents when the fixed ones are one: a product in which it is the only other
/// factor.
fn stands_for(terms: &QuotientTerms, fixed: &[(usize, i64)], judged: &Judgement) -> Option<(String, String)> {
    let [(1, powers)] = &terms[..] else { return None };
    let is_fixed = |unknown: usize| fixed.iter().any(|f| f.0 == unknown);
    let mut others = powers.iter().filter(|p| !is_fixed(p.0));
    let &(unknown, exponent) = others.next().filter(|p| p.1.abs() == 1)?;
    let observable = judged.findings.degrees.degree[unknown].is_some();
    if others.next().is_some() || observable {
        return None;
    }
    let powers = powers.iter().map(|&(l, e)| (l, e * exponent)).collect();
    let function = super::identifiable::IdentifiableFunction { terms: vec![(1, powers)], degree: 0 };
    // a fixed state is fixed at the start
    let name = |l: usize| {
        let u = &judged.layout.unknowns[l];
        let at_start = matches!(u.role, Role::State(_)) && is_fixed(l);
        if at_start { format!("{}(0)", u.name) } else { u.name.clone() }
    };
    Some((name(unknown), function.text(&name)))
}

/// Text as a string of JSON, which is also one of TOML.
fn quoted(text: &str) -> String {
    serde_json::Value::String(text.into()).to_string()
}

/// Content of a model file.
struct FileContent<'a> {
    model: &'a SystemModel,
    fixed: &'a [(String, i64)],
    stands_for: &'a [(String, String)],
}

impl FileContent<'_> {
    fn number(&self, name: &str) -> Option<i64> {
        self.fixed.iter().find(|f| f.0 == name).map(|f| f.1)
    }

    /// Text ` description = ... `, with the function that the unknown represents; empty if there is none.
    /// Units are omitted: those of the function differ.
    fn description(&self, name: &str, own: &str) -> String {
        let meaning = self.stands_for.iter().find(|s| s.0 == name).map(|s| format!("stands for {}", s.1));
        let both = [meaning.unwrap_or_default(), own.to_string()];
        let words = both.iter().filter(|t| !t.is_empty()).cloned().collect::<Vec<_>>().join("; ");
        if words.is_empty() { words } else { format!("description = {}", quoted(&words)) }
    }

    fn head(&self) -> String {
        let list = self.fixed.iter().map(|(name, x)| format!("{name} = {x}")).collect::<Vec<_>>().join(", ");
        let name = &self.model.name;
        let description = format!(
            "Reduced model, with the outputs of {name} over complex numbers and {list}: every unknown is observable"
        );
        let time = match self.model.time {
            StartTime::Zero => String::new(),
            StartTime::Generic => "time = \"generic\"\n".into(),
            time => format!("time = {:?}\n", time.number()),
        };
        let name = quoted(&format!("{name}, reduced"));
        format!("name = {name}\ndescription = {}\n{time}", quoted(&description))
    }

    fn states(&self) -> Vec<String> {
        let state = |s: &State| {
            let name = &s.named.name;
            let mut parts = vec![format!("equation = {}", quoted(&s.equation.text))];
            match (&s.start, self.number(name)) {
                (_, Some(x)) => parts.push(format!("initial = {x}")),
                (StateStart::Known, _) => parts.push("initial = \"known\"".into()),
                (StateStart::Value(value), _) => parts.push(format!("initial = {}", quoted(&value.text))),
                (StateStart::Unknown, _) => {}
            }
            let words = self.description(name, &s.named.description);
            parts.extend((!words.is_empty()).then_some(words));
            format!("{} = {{ {} }}", quoted(name), parts.join(", "))
        };
        self.model.states.iter().map(state).collect()
    }

    fn parameters(&self) -> Vec<String> {
        let left = self.model.parameters.iter().filter(|p| self.number(&p.name).is_none());
        let parameter = |p: &Named| match self.description(&p.name, &p.description) {
            none if none.is_empty() => format!("{} = {{}}", quoted(&p.name)),
            words => format!("{} = {{ {words} }}", quoted(&p.name)),
        };
        left.map(parameter).collect()
    }

    fn constants(&self) -> Vec<String> {
        let constant = |(named, constant): &(Named, Constant)| match constant {
            Constant::Generic => format!("{} = \"generic\"", quoted(&named.name)),
            Constant::Value(value) => format!("{} = {}", quoted(&named.name), quoted(&value.text)),
        };
        let fixed = |p: &Named| Some(format!("{} = {}", quoted(&p.name), self.number(&p.name)?));
        let fixed = self.model.parameters.iter().filter_map(fixed);
        self.model.constants.iter().map(constant).chain(fixed).collect()
    }

    fn inputs(&self) -> Vec<String> {
        let input = |(named, input): &(Named, KnownInput)| {
            let kind = match input {
                KnownInput::Generic => "\"generic\"".into(),
                KnownInput::Polynomial(degree) => format!("{{ polynomial = {degree} }}"),
                KnownInput::Function(f) => format!("{{ function = {} }}", quoted(&f.text)),
            };
            format!("{} = {kind}", quoted(&named.name))
        };
        self.model.known_inputs.iter().map(input).collect()
    }

    fn text(&self) -> String {
        let line = |name: &str, e: &PlacedExpression| format!("{} = {}", quoted(name), quoted(&e.text));
        let definitions = self.model.definitions.iter().map(|(name, e)| line(name, e));
        let outputs = self.model.outputs.iter().map(|(named, e)| line(&named.name, e));
        let sections = [
            ("states", self.states()),
            ("parameters", self.parameters()),
            ("constants", self.constants()),
            ("known_inputs", self.inputs()),
            ("definitions", definitions.collect()),
            ("outputs", outputs.collect()),
        ];
        let mut out = self.head();
        for (title, lines) in sections.iter().filter(|s| !s.1.is_empty()) {
            let _ = write!(out, "\n[{title}]\n{}\n", lines.join("\n"));
        }
        out
    }
}
