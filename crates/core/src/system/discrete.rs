//! Models in discrete time, `x[t+1] = f(x, u, p, t)`, `z = h`: static models of their outputs at t, t+1, ...,
//! t+k in terms of the unknowns at t. The degree of an unknown is the smallest such k that determines it.

use std::collections::HashSet;

use super::answer::data::{NumberOfSolutions, SystemAnalysis, SystemOptions, SystemQuantity};
use super::answer::{Analyzed, analyzed};
use super::error::FilePlace;
use super::error::ModelError;
use super::judge::judge;
use super::judge::verdicts::Judgement;
use super::model::compiled::Role;
use super::model::{Constant, KnownInput, Named, PlacedExpression, StartTime, StateStart, SystemModel};
use super::quotients::QuotientTerms;
use crate::degree::status::Status;
use crate::language::{Expression, Function, Node};
use crate::remedies::Remedies;

/// Name of a quantity a number of steps after t. Its third index tells it from all names of a file, which
/// have at most two: `x[0,0,2]`, of a vector `v[1,0,2]`, of a matrix `C[1,2,2]`.
fn later(name: &str, step: usize) -> String {
    if step == 0 {
        return name.into();
    }
    let Some((base, index)) = name.split_once('[') else { return format!("{name}[0,0,{step}]") };
    let index = index.trim_end_matches(']');
    match index.contains(',') {
        true => format!("{base}[{index},{step}]"),
        false => format!("{base}[{index},0,{step}]"),
    }
}

/// Name of a quantity in answers: `x[t+2]`.
fn shown(name: &str, step: usize) -> String {
    match step {
        0 => name.into(),
        _ => format!("{name}[t+{step}]"),
    }
}

/// Name of the time at t, which a file cannot contain.
const TIME: &str = "t[0,0,0]";

/// Formula with some names replaced.
fn renamed(formula: &PlacedExpression, name: &dyn Fn(&str) -> String) -> PlacedExpression {
    let mut out = formula.clone();
    for node in &mut out.expression.nodes {
        if let Node::Name(old) = node {
            *old = name(old);
        }
    }
    out
}

/// Formula that consists of the given operations.
fn formula(nodes: Vec<Node>) -> PlacedExpression {
    let spans = vec![0..0; nodes.len()];
    let place = FilePlace { what: "the model".into(), offset: None };
    PlacedExpression { text: String::new(), expression: Expression { nodes, spans }, place }
}

fn number(n: usize) -> Node {
    Node::Number { mantissa: n as i128, decimals: 0 }
}

/// Sum of products of powers of named quantities.
fn sum(terms: &QuotientTerms, factor: &dyn Fn(usize) -> (String, Option<Function>)) -> PlacedExpression {
    let mut nodes = vec![number(0)];
    let mut total = 0;
    for (coefficient, powers) in terms {
        nodes.push(Node::Number { mantissa: i128::from(*coefficient), decimals: 0 });
        let mut product = nodes.len() - 1;
        for &(unknown, exponent) in powers {
            for _ in 0..exponent.unsigned_abs() {
                let (name, function) = factor(unknown);
                nodes.push(Node::Name(name));
                let argument = nodes.len() - 1;
                nodes.extend(function.map(|function| Node::Call { function, argument }));
                let factor = nodes.len() - 1;
                nodes.push(match exponent > 0 {
                    true => Node::Multiply(product, factor),
                    false => Node::Divide(product, factor),
                });
                product = nodes.len() - 1;
            }
        }
        nodes.push(Node::Add(total, product));
        total = nodes.len() - 1;
    }
    formula(nodes)
}

impl SystemModel {
    /// Refuses what models in discrete time cannot have.
    fn check_discrete(&self) -> Result<(), ModelError> {
        let refuse =
            |what: String, message: &str| Err(ModelError { what, message: message.into(), span: None });
        if !self.segments.is_empty() {
            return refuse("[[segment]]".into(), "a model in discrete time has none; expected one run");
        }
        let own = self.own.iter().flat_map(|e| &e.known_inputs);
        let inputs = self.known_inputs.iter().map(|(named, kind)| (&named.name, kind));
        for (name, kind) in inputs.chain(own.clone().map(|(name, kind)| (name, kind))) {
            if matches!(kind, KnownInput::Polynomial(d) if *d > 0) {
                return refuse(
                    format!("`{name}`"),
                    "a polynomial in discrete time; expected \"generic\", \"constant\" or a function of t",
                );
            }
        }
        if let Some((name, _)) = own.into_iter().next() {
            return refuse(
                format!("`{name}`"),
                "an input of one experiment; in discrete time all experiments have the same kinds of inputs",
            );
        }
        if let Some((named, _)) = self.unknown_inputs.iter().find(|(_, d)| d.is_some_and(|d| d > 0)) {
            return refuse(
                format!("`{}`", named.name),
                "a polynomial in discrete time; expected \"arbitrary\" or \"constant\"",
            );
        }
        Ok(())
    }

    /// Static model of the outputs from t to `last` steps later.
    ///
    /// # Errors
    /// [`ModelError`] for segments, and for inputs that are polynomials or those of one experiment.
    pub(super) fn unrolled(&self, last: usize) -> Result<Self, ModelError> {
        self.check_discrete()?;
        let mut out = Self { discrete: false, candidates: Vec::new(), ..self.clone() };
        for state in &mut out.states {
            state.equation = formula(vec![number(0)]);
        }
        (out.known_inputs, out.definitions, out.outputs) = (Vec::new(), Vec::new(), Vec::new());
        let timed = self.has_time();
        if timed {
            self.start_time(&mut out);
        }
        for step in 0..=last {
            self.add_step(&mut out, step, timed);
        }
        out.time = StartTime::Zero;
        out.drop_unused();
        Ok(out)
    }

    /// Adds the time at t: a number, or a generic constant.
    fn start_time(&self, out: &mut Self) {
        match self.time {
            StartTime::Generic => {
                out.constants.push((Named { name: TIME.into(), ..Named::default() }, Constant::Generic));
            }
            StartTime::Zero => out.definitions.push((TIME.into(), formula(vec![number(0)]))),
            StartTime::At { mantissa, decimals } => {
                out.definitions.push((TIME.into(), formula(vec![Node::Number { mantissa, decimals }])));
            }
        }
    }

    /// Adds inputs, states, definitions and outputs at `step` steps after t.
    fn add_step(&self, out: &mut Self, step: usize, timed: bool) {
        let name = |at: usize| {
            move |name: &str| match name {
                "t" if timed => format!("t[0,0,{at}]"),
                _ if self.changes(name) => later(name, at),
                _ => name.into(),
            }
        };
        if timed && step > 0 {
            let nodes = vec![Node::Name(TIME.into()), number(step), Node::Add(0, 1)];
            out.definitions.push((later("t", step), formula(nodes)));
        }
        for state in self.states.iter().filter(|_| step > 0) {
            let value = renamed(&state.equation, &name(step - 1));
            out.definitions.push((later(&state.named.name, step), value));
        }
        for (named, kind) in &self.known_inputs {
            match kind {
                KnownInput::Function(f) => {
                    out.definitions.push((later(&named.name, step), renamed(f, &name(step))));
                }
                KnownInput::Generic => out.known_inputs.push((
                    Named { name: later(&named.name, step), ..named.clone() },
                    KnownInput::Polynomial(0),
                )),
                KnownInput::Polynomial(_) if step == 0 => {
                    out.known_inputs.push((named.clone(), kind.clone()))
                }
                KnownInput::Polynomial(_) => {}
            }
        }
        for (i, (named, degree)) in self.unknown_inputs.iter().enumerate() {
            match step {
                0 => out.unknown_inputs[i].1 = Some(0),
                _ if degree.is_none() => out
                    .unknown_inputs
                    .push((Named { name: later(&named.name, step), ..named.clone() }, Some(0))),
                _ => {}
            }
        }
        for (defined, value) in &self.definitions {
            out.definitions.push((later(defined, step), renamed(value, &name(step))));
        }
        for (named, value) in &self.outputs {
            let named = Named { name: shown(&named.name, step), ..named.clone() };
            out.outputs.push((named, renamed(value, &name(step))));
        }
    }

    /// True if the quantity of this name may differ from step to step.
    fn changes(&self, name: &str) -> bool {
        self.states.iter().any(|s| s.named.name == name)
            || self.definitions.iter().any(|d| d.0 == name)
            || self.known_inputs.iter().any(|u| u.0.name == name && !matches!(u.1, KnownInput::Polynomial(_)))
            || self.unknown_inputs.iter().any(|u| u.0.name == name && u.1.is_none())
    }

    /// Leaves out definitions and later inputs that no output depends on.
    fn drop_unused(&mut self) {
        let mut used: HashSet<String> = HashSet::new();
        let names = |f: &PlacedExpression, used: &mut HashSet<String>| {
            for node in &f.expression.nodes {
                if let Node::Name(name) = node {
                    used.insert(name.clone());
                }
            }
        };
        let asked = self.combinations.iter().chain(&self.constraints).chain(&self.not_negative);
        for f in self.outputs.iter().map(|o| &o.1).chain(asked) {
            names(f, &mut used);
        }
        // definitions use only those before them
        for (name, f) in self.definitions.iter().rev() {
            if used.contains(name) {
                names(f, &mut used);
            }
        }
        let later = |name: &str| name.matches(',').count() == 2;
        self.definitions.retain(|d| used.contains(&d.0));
        self.known_inputs.retain(|u| used.contains(&u.0.name) || !later(&u.0.name));
        self.unknown_inputs.retain(|u| used.contains(&u.0.name) || !later(&u.0.name));
    }

    /// Checks all formulas.
    ///
    /// # Errors
    /// [`ModelError`] of the first fault.
    pub(super) fn checked(&self) -> Result<(), ModelError> {
        match self.discrete {
            true => self.unrolled(1)?.compile().map(|_| ()),
            false => self.compile().map(|_| ()),
        }
    }

    /// Number of steps after which no output adds anything, and true if that is proven. With all states
    /// unknown or known at generic values, the images of the map fall in dimension at most as often as there
    /// are unknowns; on an image onto itself the first step that adds nothing is the last.
    fn last_step(&self) -> (usize, bool) {
        let unknown = self.states.len() * self.experiments.max(1);
        let constant = self.unknown_inputs.iter().filter(|u| u.1.is_some()).count();
        // the time is one more state
        let n = unknown + self.parameters.len() + constant + 1;
        let special = self.states.iter().any(|s| matches!(s.start, StateStart::Value(_)));
        let arbitrary = self.unknown_inputs.iter().any(|u| u.1.is_none());
        let proven = !special && !arbitrary && self.constraints.is_empty() && self.time_is_generic();
        (if proven { n } else { 2 * n + 2 }, proven)
    }

    /// True if `t` is the time, not a quantity of the model.
    fn has_time(&self) -> bool {
        self.roles().iter().any(|(_, role)| *role == Role::Time)
    }

    /// True if nothing depends on a time that is given.
    fn time_is_generic(&self) -> bool {
        let states = self.states.iter().map(|s| &s.equation);
        let inputs = self.known_inputs.iter().filter_map(|(_, kind)| match kind {
            KnownInput::Function(f) => Some(f),
            KnownInput::Generic | KnownInput::Polynomial(_) => None,
        });
        let others = self.definitions.iter().map(|d| &d.1).chain(self.outputs.iter().map(|o| &o.1));
        let has_time = |f: &PlacedExpression| f.expression.nodes.contains(&Node::Name("t".into()));
        self.time == StartTime::Generic
            || !self.has_time()
            || !states.chain(inputs).chain(others).any(has_time)
    }
}

/// Ranks of the outputs up to each step, and their end.
struct Steps {
    /// Rank with the outputs up to each step.
    ranks: Vec<usize>,
    /// True if no later step can add anything.
    ended: bool,
    /// Sum of the bounds on the probability that a rank is wrong; `None` in real numbers.
    error_bound: Option<f64>,
}

/// Ranks step by step, until a later step cannot add anything, or up to `most` steps.
fn steps(model: &SystemModel, most: Option<usize>, seed: u64) -> Result<Steps, ModelError> {
    let (bound, generic) = model.last_step();
    let last = most.unwrap_or(bound);
    // the ranks of a model with known starts are those of columns of the whole, and may stand still before
    let whole = model.states.iter().all(|s| s.start == StateStart::Unknown);
    let mut out = Steps { ranks: Vec::new(), ended: false, error_bound: Some(0.0) };
    let mut invertible = None;
    for step in 0..=last {
        let part = SystemModel { combinations: Vec::new(), ..model.unrolled(step)? };
        let at = judge(&part, seed, None)?;
        let (before, rank) = (out.ranks.last().copied(), at.findings.degrees.rank());
        out.error_bound = out.error_bound.zip(at.error_bound()).map(|(sum, more)| sum + more);
        out.ranks.push(rank);
        let full = rank == at.layout.unknowns.len() && model.unknown_inputs.iter().all(|u| u.1.is_some());
        let stalled = generic && whole && before == Some(rank);
        out.ended = full || (generic && step >= bound);
        if stalled && !out.ended {
            out.ended = match invertible {
                Some(known) => known,
                None => *invertible.insert(is_invertible(model, seed)?),
            };
        }
        if out.ended {
            if step == 0 {
                // the map of a step must have a value, even if it shows nothing more
                judge(&SystemModel { combinations: Vec::new(), ..model.unrolled(1)? }, seed, None)?;
            }
            break;
        }
    }
    Ok(out)
}

/// True if almost every value of the states is that of one step before: the map of a step has an inverse near
/// almost every point.
fn is_invertible(model: &SystemModel, seed: u64) -> Result<bool, ModelError> {
    if model.states.is_empty() {
        return Ok(true);
    }
    let next = model.states.iter().map(|s| (s.named.clone(), s.equation.clone()));
    let ahead = SystemModel { outputs: next.collect(), combinations: Vec::new(), ..model.clone() };
    let mut ahead = ahead.unrolled(0)?;
    let known = ahead.parameters.drain(..).chain(ahead.unknown_inputs.drain(..).map(|u| u.0));
    let known: Vec<_> = known.map(|named| (named, Constant::Generic)).collect();
    ahead.constants.splice(0..0, known);
    for state in &mut ahead.states {
        state.start = StateStart::Unknown;
    }
    ahead.constraints.clear();
    let at = judge(&ahead, seed, None)?;
    Ok(at.findings.degrees.rank() == at.layout.unknowns.len())
}

/// Degrees of the unknowns and combinations of a model that was judged with all its steps.
struct StepDegrees {
    unknowns: Vec<Option<usize>>,
    combinations: Vec<Option<usize>>,
}

/// Smallest number of steps that determines each unknown and combination of `whole`.
fn degrees(
    model: &SystemModel,
    (whole, judged): (&SystemModel, &Judgement),
    last: usize,
    seed: u64,
) -> Result<StepDegrees, ModelError> {
    let names: Vec<&str> = judged.layout.unknowns.iter().map(|u| u.name.as_str()).collect();
    let mut out =
        StepDegrees { unknowns: vec![None; names.len()], combinations: vec![None; whole.combinations.len()] };
    for step in 0..=last {
        let mut part = model.unrolled(step)?;
        let known: HashSet<String> =
            part.slot_names().into_iter().chain(part.definitions.iter().map(|d| d.0.clone())).collect();
        // what names a later input is not known by the outputs so far
        let named = |c: &PlacedExpression| {
            c.expression.nodes.iter().all(|node| match node {
                Node::Name(name) => known.contains(name) || matches!(name.as_str(), "pi" | "deg"),
                _ => true,
            })
        };
        let asked: Vec<usize> =
            (0..whole.combinations.len()).filter(|&c| named(&whole.combinations[c])).collect();
        part.combinations = asked.iter().map(|&c| whole.combinations[c].clone()).collect();
        let at = judge(&part, seed, None)?;
        for (degree, name) in out.unknowns.iter_mut().zip(&names) {
            let seen = at.verdict(&part, name).is_some_and(|v| v.degree.is_some());
            *degree = degree.or(seen.then_some(step));
        }
        for (&c, verdict) in asked.iter().zip(at.asked()) {
            let degree = &mut out.combinations[c];
            *degree = degree.or(verdict.degree.map(|_| step));
        }
    }
    Ok(out)
}

/// Analysis of a model in discrete time; degrees are numbers of steps.
///
/// # Errors
/// [`ModelError`], as for [`super::analyze_system`].
pub(super) fn analyze_discrete(
    model: &SystemModel,
    options: SystemOptions,
) -> Result<SystemAnalysis, ModelError> {
    let Steps { ranks, ended, error_bound } = steps(model, options.order, options.seed)?;
    let last = ranks.len() - 1;
    let mut whole = model.unrolled(last)?;
    let options_of_steps = SystemOptions { order: None, ..options };
    let Analyzed { analysis: mut out, judged, functions, factors } = analyzed(&whole, options_of_steps)?;
    let further = recount(model, &mut out, last, options_of_steps)?;
    let asked = whole.combinations.len();
    // combinations are those of the first experiment, where names have no number
    let plain = |c: usize| factors.name(c, &whole, &judged.layout).trim_end_matches("@1").to_string();
    let factor = |c: usize| match factors.function(c) {
        Some(f) => (plain(f.unknown), Some(f.function)),
        None => (plain(c), None),
    };
    let functions: Vec<PlacedExpression> = functions.iter().map(|terms| sum(terms, &factor)).collect();
    whole.combinations.extend(functions);
    let found = degrees(model, (&whole, &judged), last, options.seed)?;
    for q in &mut out.quantities {
        let place = judged.layout.unknowns.iter().position(|u| u.name == q.name);
        q.degree = place.and_then(|c| found.unknowns[c]);
    }
    // a map of solutions is one as far as the outputs were looked at
    out.solution_maps.clear();
    let (own, rest) = found.combinations.split_at(asked);
    for (c, degree) in out.combinations.iter_mut().zip(own).chain(out.invariants.iter_mut().zip(rest)) {
        c.degree = *degree;
    }
    let listed = out.invariants.len();
    out.invariants.retain(|c| c.degree.is_some());
    out.missing_functions += listed - out.invariants.len();
    out.rests_on_bound = !ended && out.rank < out.unknowns;
    for q in out.quantities.iter_mut() {
        if out.rests_on_bound && q.degree.is_none() {
            q.status = Status::NotSeen;
        }
        q.identifiability = q.identifiability();
    }
    (out.discrete, out.closed, out.bound, out.last_order) = (true, ended, model.last_step().0, last);
    if let Some(order) = options.order {
        out.bound = order;
    }
    (out.rank_profile, out.error_bound) = (ranks, error_bound.zip(out.error_bound).map(|(a, b)| 2.0 * a + b));
    out.equations = model.equations();
    out.counting_order = out.counting_order.map(|_| further);
    out.time = (!model.time_is_generic()).then(|| model.time.number().to_string());
    if out.quantities.iter().any(|q| q.degree.is_none()) {
        let text = "known values and outputs, in discrete time".into();
        out.to_resolve = Remedies { not_tried: vec![text], ..Remedies::default() };
    }
    let own = model.slot_names();
    out.quantities.retain(|q| own.iter().any(|name| q.name.split('@').next() == Some(name)));
    renew_names(&mut out, model, further);
    Ok(out)
}

/// Counts with the outputs of one more step, which may leave fewer solutions, where those up to `last` leave
/// more than one or do not decide. Returns the last step of the outputs that were counted with.
fn recount(
    model: &SystemModel,
    out: &mut SystemAnalysis,
    last: usize,
    options: SystemOptions,
) -> Result<usize, ModelError> {
    use NumberOfSolutions::{Counted, OneByExpression};
    let left = |n: &Option<NumberOfSolutions>| {
        n.as_ref().is_some_and(|n| !matches!(n, Counted(1) | OneByExpression))
    };
    let unknowns = out.quantities.iter().any(|q| left(&q.number_of_solutions));
    let functions = out.invariants.iter().chain(&out.combinations);
    if !unknowns && !functions.into_iter().any(|c| left(&c.number_of_solutions)) {
        return Ok(last);
    }
    let further = last + 1;
    let more = analyzed(&model.unrolled(further)?, options)?.analysis;
    for q in out.quantities.iter_mut().filter(|q| left(&q.number_of_solutions)) {
        let again = more.quantities.iter().find(|other| other.name == q.name);
        fewer(&mut q.number_of_solutions, again.and_then(|q| q.number_of_solutions.clone()), last);
    }
    let listed = out.invariants.iter_mut().map(|c| (c, &more.invariants));
    let asked = out.combinations.iter_mut().map(|c| (c, &more.combinations));
    for (c, more) in listed.chain(asked).filter(|(c, _)| left(&c.number_of_solutions)) {
        let again = more.iter().find(|other| other.expression == c.expression);
        fewer(&mut c.number_of_solutions, again.and_then(|c| c.number_of_solutions.clone()), last);
    }
    out.error_bound = out.error_bound.zip(more.error_bound).map(|(a, b)| a + b);
    Ok(further)
}

/// Takes the number of solutions of the outputs up to `last + 1` where it is smaller or the first is not
/// known. More than one solution is no verdict: the outputs of later steps may leave fewer.
fn fewer(number: &mut Option<NumberOfSolutions>, again: Option<NumberOfSolutions>, last: usize) {
    use NumberOfSolutions::{Counted, OneByExpression, Undecided};
    let (k, step) = match (&*number, &again) {
        (_, Some(Counted(1) | OneByExpression)) => {
            *number = again;
            return;
        }
        (Some(Counted(k)), Some(Counted(l))) if l > k => (*k, last),
        (_, Some(Counted(l))) => (*l, last + 1),
        (Some(Counted(k)), _) => (*k, last),
        _ => return,
    };
    *number = Some(Undecided(format!(
        "{k} solutions of the outputs up to t+{step}; those of later steps may leave fewer"
    )));
}

/// Writes `w[t+2]` for the names of later quantities in all texts of an answer.
fn renew_names(out: &mut SystemAnalysis, model: &SystemModel, last: usize) {
    let inputs =
        model.unknown_inputs.iter().map(|u| &u.0.name).chain(model.known_inputs.iter().map(|u| &u.0.name));
    let mut names: Vec<(String, String)> = vec![(TIME.into(), "t".into())];
    for name in inputs {
        names.extend((1..=last).map(|step| (later(name, step), shown(name, step))));
    }
    let renew = |text: &mut String| {
        if text.contains(",") {
            for (internal, shown) in &names {
                if text.contains(internal.as_str()) {
                    *text = text.replace(internal.as_str(), shown);
                }
            }
        }
    };
    for SystemQuantity { partners, solution, .. } in &mut out.quantities {
        partners.iter_mut().for_each(renew);
        solution.iter_mut().for_each(renew);
    }
    for s in &mut out.symmetries {
        renew(&mut s.words);
        s.unknowns.iter_mut().for_each(renew);
    }
    out.other_directions.iter_mut().flatten().for_each(renew);
    out.invariants.iter_mut().for_each(|c| renew(&mut c.expression));
    out.solution_maps.iter_mut().for_each(renew);
    out.branches.iter_mut().for_each(renew);
}
