//! Number of solutions of every unknown, by stages: equations in the unknowns, relations among derivatives
//! of the outputs, and maps between solutions if derivatives of a higher order might leave fewer solutions.

use obsdeg_exact::groebner::RemainingWork;
use obsdeg_exact::{Field, SplitMix64, polynomial};

use super::constraints::slots_of;
use super::dag::{Dag, Op};
use super::fibre::{CountingPoint, Fibre, at_point};
use super::function_factors::ModelFactors;
use super::global::{self, ModelRelations, RelationConsequences};
use super::judge::verdicts::Judgement;
use super::maps::second_solution;
use super::model::compiled::{Compiled, Role};
use super::model::{KnownInput, StateStart, SystemModel};
use super::quotients::QuotientTerms;
use super::rows::SystemRows;
use super::twins::{Twin, images, twins};
use super::undecided::{ENOUGH, NotCounted, UNKNOWNS};
use super::work;

/// Number of orders beyond the last one at which rank grows. Of 0 to 6, this one decides most of the
/// reference models.
const BEYOND: usize = 3;
/// Number of runs from the same start with other values of generic inputs, if one run does not decide.
const OTHERS: usize = 2;

/// Limit of work of the first round of relations, in products of two coefficients.
const FIRST_ROUND: u64 = 100_000_000;
/// Divisor of the limit for another elimination: its products take some five times as long as those of
/// relations, as monomials are looked up for them.
const ELIMINATION: u64 = 5;

/// Number of values of an unknown, or the reason why it is not decided.
pub(super) type SolutionCount = Result<usize, NotCounted>;

/// Limits of work, in products of two coefficients at each of two points.
#[derive(Debug, Clone, Copy)]
pub(super) struct CountLimits {
    /// Limit for counting solutions of the equations in the unknowns.
    pub(super) count: u64,
    /// Limit for relations among derivatives of the outputs; a share of it for a second count if the first
    /// leaves numbers undecided; zero: neither is done.
    pub(super) relations: u64,
}

/// Numbers of solutions, and maps between them.
pub(super) struct Solutions {
    /// Number of values of every unknown, in the order of the layout, on which two random points in the two
    /// fields agree; `None` for unknowns that are not observable.
    pub(super) counts: Vec<Option<SolutionCount>>,
    /// Number of values of every function, on which both fields agree.
    pub(super) of_functions: Vec<SolutionCount>,
    /// The same for the combinations that the model asks for.
    pub(super) of_asked: Vec<SolutionCount>,
    /// Order of the derivatives of the outputs with which solutions were counted.
    pub(super) order: usize,
    /// Maps that take every solution to another, in words, if there are several solutions.
    pub(super) maps: Vec<String>,
}

/// Model, fields and order for counting solutions.
struct SolutionCounting<'a> {
    model: &'a SystemModel,
    compiled: &'a Compiled,
    judged: &'a Judgement,
    fields: [Field; 2],
    seed: u64,
    order: usize,
    /// Functions whose values are counted beside those of the unknowns.
    functions: &'a [QuotientTerms],
}

/// Stage of counting: the equations that it uses.
#[derive(Clone, Copy)]
struct CountStage {
    others: usize,
    limit: u64,
    /// True if functions and all unknowns are counted, not only observable unknowns.
    whole: bool,
}

impl CountStage {
    fn new(others: usize, limit: u64) -> Self {
        Self { others, limit, whole: false }
    }
}

impl SolutionCounting<'_> {
    /// Random stream of the point in a field: the same at every call.
    fn random(&self, i: usize) -> SplitMix64 {
        self.model.random(self.seed, &format!("solutions, field {i}"))
    }

    /// Solutions in a field, given known consequences of relations.
    fn fibre(&self, i: usize, stage: CountStage, known: &RelationConsequences) -> Result<Fibre, NotCounted> {
        let Self { model, compiled, judged, order, .. } = *self;
        if judged.findings.degrees.degree.len() > UNKNOWNS {
            return Err(NotCounted::TooLarge);
        }
        let mut work = RemainingWork::new(stage.limit);
        let functions = stage.whole.then_some(self.functions);
        let at = CountingPoint { f: self.fields[i], order, others: stage.others, known, functions };
        let found = at_point(model, compiled, judged, at, &mut self.random(i), &mut work);
        let used_up = work.used_up;
        let why = |e: NotCounted| match e {
            NotCounted::OverLimit if !used_up => NotCounted::TooHigh,
            e => e,
        };
        let mut fibre = found.map_err(why)?;
        fibre
            .polynomials
            .iter_mut()
            .for_each(|p| *p = std::mem::replace(p, Err(NotCounted::NoPoint)).map_err(why));
        Ok(fibre)
    }

    /// Numbers of solutions in a field.
    fn counts(&self, i: usize, fibre: &Result<Fibre, NotCounted>) -> Vec<SolutionCount> {
        let roots = |p: &Result<Vec<u64>, NotCounted>| {
            p.as_ref().map(|p| polynomial::distinct_roots(&self.fields[i], p)).map_err(|e| *e)
        };
        match fibre {
            Ok(fibre) => fibre.polynomials.iter().map(roots).collect(),
            Err(e) => vec![Err(*e); self.judged.findings.degrees.degree.len()],
        }
    }

    /// Number on which both fields agree.
    fn agreed_number(&self, both: (SolutionCount, SolutionCount)) -> SolutionCount {
        match both {
            (Ok(a), Ok(b)) if a != b => Err(NotCounted::Disagree),
            (Ok(a), Ok(_)) if a > 1 && !self.is_proven() => Err(NotCounted::NotClosed(a)),
            (Ok(a), Ok(_)) => Ok(a),
            (Err(e), _) | (_, Err(e)) => Err(e),
        }
    }

    /// Numbers of the unknowns on which both fields agree.
    fn agreed(&self, fibres: &[Result<Fibre, NotCounted>; 2]) -> Vec<SolutionCount> {
        let both = self.counts(0, &fibres[0]).into_iter().zip(self.counts(1, &fibres[1]));
        both.map(|both| self.agreed_number(both)).collect()
    }

    /// Numbers of the functions on which both fields agree, then of the combinations that the model asks for.
    fn agreed_functions(&self, fibres: &[Result<Fibre, NotCounted>; 2]) -> Vec<SolutionCount> {
        let [first, second] = fibres;
        let of = |i: usize| -> SolutionCount {
            self.agreed_number((
                first.as_ref().map_err(|e| *e)?.functions[i],
                second.as_ref().map_err(|e| *e)?.functions[i],
            ))
        };
        (0..self.functions.len() + self.compiled.combinations.len()).map(of).collect()
    }

    /// Solutions in both fields; in the second only if the first decides a number.
    fn both(&self, stage: CountStage, known: [&RelationConsequences; 2]) -> [Result<Fibre, NotCounted>; 2] {
        let first = self.fibre(0, stage, known[0]);
        let second = match &first {
            Ok(fibre) if fibre.polynomials.iter().any(Result::is_ok) => self.fibre(1, stage, known[1]),
            _ => first.clone(),
        };
        [first, second]
    }

    /// True if the derivatives up to the order contain all information of the outputs (see `fibre`); for a
    /// system that is linear in its states by Cayley-Hamilton, whatever its start.
    fn is_proven(&self) -> bool {
        let Self { compiled, judged, order, .. } = *self;
        // a relation between derivatives that holds on one component of the constraints need not hold on
        // another; algebraic equations that are linear in their unknowns have one component where these are
        // determined
        let whole = compiled.constraints.is_empty() || compiled.kept_is_graph;
        let alone = compiled.segments.len() <= 1 && whole;
        let linear = linear_order(self.model, compiled).is_some_and(|last| order >= last);
        alone && (judged.layout.closed || linear)
    }

    /// Maps between solutions, if there are several. If derivatives of a higher order might leave fewer
    /// solutions than were counted, only the number that the maps prove is kept.
    fn confirmed(&self, counts: &mut [SolutionCount]) -> Vec<Twin> {
        let Self { model, compiled, judged, seed, fields, .. } = *self;
        let (layout, degrees) = (&judged.layout, &judged.findings.degrees);
        let several = |c: &SolutionCount| matches!(c, Ok(2..) | Err(NotCounted::NotClosed(_)));
        if !counts.iter().zip(&degrees.degree).any(|(c, d)| d.is_some() && several(c)) {
            return Vec::new();
        }
        let mut rng = model.random(seed, "maps between solutions");
        let found = twins(compiled, layout, &degrees.degree, fields, &mut rng);
        let verdict = work::Work::new(model.work_limit);
        let point = SystemRows::new(model, compiled, layout, fields[0], &mut rng, &verdict);
        if let Ok(point) = point
            && degrees.rank() == layout.unknowns.len()
        {
            let at = point.values(compiled, layout, &[]);
            for (unknown, count) in counts.iter_mut().enumerate() {
                if let Err(NotCounted::NotClosed(k)) = *count
                    && images(&found, compiled, layout, &fields[0], &at, unknown) == k
                {
                    *count = Ok(k);
                }
            }
        }
        found
    }

    /// Consequences of relations in both fields, if there are any; `single`: unknowns with one value.
    fn by_relations(&self, limit: u64, single: &[usize]) -> Option<[RelationConsequences; 2]> {
        let Self { model, compiled, judged, seed, fields, .. } = *self;
        let mut found = ModelRelations::default();
        let mut known = |i: usize| -> Option<RelationConsequences> {
            let verdict = work::Work::new(model.work_limit);
            let mut own = self.random(i);
            let point =
                SystemRows::new(model, compiled, &judged.layout, fields[i], &mut own, &verdict).ok()?;
            let nodes = ModelFactors::new(model, compiled, &judged.layout).nodes(compiled);
            let values = point.values(compiled, &judged.layout, &nodes);
            let mut rng = model.random(seed, &format!("relations, field {i}"));
            let system = (model, compiled, judged);
            let known = global::known(
                system,
                (fields[i], &values, single),
                &mut found,
                &mut rng,
                &mut RemainingWork::new(limit),
            );
            (known != RelationConsequences::default()).then_some(known)
        };
        Some([known(0)?, known(1)?])
    }

    /// Number of additional runs with other inputs.
    fn others(&self) -> usize {
        let Self { model, compiled, judged, .. } = *self;
        let generic = |role: &Role| {
            matches!(
                *role,
                Role::KnownInput(i) if matches!(model.known_input(0, i), KnownInput::Generic)
            )
        };
        let alone = judged.layout.closed
            && compiled.segments.len() <= 1
            && compiled.constraints.is_empty()
            && model.experiments <= 1
            && model.unknown_inputs.is_empty();
        if alone && compiled.roles.iter().any(generic) { OTHERS } else { 0 }
    }
}

impl SolutionCounting<'_> {
    /// Numbers of solutions, stage by stage, as far as the limits allow.
    fn by_stages(&self, limits: CountLimits) -> Vec<SolutionCount> {
        let nothing = RelationConsequences::default();
        let mut counts = self.agreed(&self.both(CountStage::new(0, limits.count), [&nothing; 2]));
        let others = self.others();
        if self.is_open(&counts) && others > 0 {
            self.again(&mut counts, CountStage::new(others, limits.count), [&nothing; 2]);
        }
        if !self.compiled.dag.is_rational() {
            return counts;
        }
        let runs = if others > 0 { vec![0, others] } else { vec![0] };
        let relations = global::applies(self.model, self.compiled, self.judged);
        for limit in rounds(limits.relations) {
            let single: Vec<usize> = (0..counts.len()).filter(|&l| counts[l] == Ok(1)).collect();
            if relations
                && self.is_open(&counts)
                && let Some([first, second]) = self.by_relations(limit, &single)
            {
                self.again(&mut counts, CountStage::new(others, limits.count), [&first, &second]);
            }
            let elimination = limit / ELIMINATION;
            for &others in runs.iter().filter(|_| elimination > limits.count) {
                if self.is_open(&counts) {
                    self.again(&mut counts, CountStage::new(others, elimination), [&nothing; 2]);
                }
            }
        }
        counts
    }

    /// True if a number is open that more work may decide.
    fn is_open(&self, counts: &[SolutionCount]) -> bool {
        let decided =
            |c: &SolutionCount| matches!(c, Ok(_) | Err(NotCounted::NotClosed(_) | NotCounted::TooMany));
        let degrees = &self.judged.findings.degrees.degree;
        counts.iter().zip(degrees).any(|(c, d)| !decided(c) && d.is_some())
    }

    /// Counts again, and fills in numbers that were not decided before.
    fn again(&self, counts: &mut [SolutionCount], stage: CountStage, known: [&RelationConsequences; 2]) {
        let mut new = self.agreed(&self.both(stage, known));
        let unique = known[0].unique.iter().filter(|l| known[1].unique.contains(l));
        unique.for_each(|&unknown| new[unknown] = Ok(1));
        for (count, new) in counts.iter_mut().zip(new) {
            if count.is_err() && new.is_ok() {
                *count = new;
            }
        }
    }

    /// Results of counting with all unknowns: a map between two solutions if `maps` has none, and the
    /// numbers of values of the functions.
    fn of_all(
        &self,
        counts: &[SolutionCount],
        mut maps: Vec<String>,
        limit: u64,
    ) -> (Vec<String>, Vec<SolutionCount>) {
        let degrees = &self.judged.findings.degrees.degree;
        let two = counts.iter().zip(degrees).any(|(c, d)| d.is_some() && *c == Ok(2));
        let pairs = maps.is_empty() && two;
        let mut found = [Err(NotCounted::OverLimit), Err(NotCounted::OverLimit)];
        // if the smaller count is not decided, the count with all unknowns is not either
        let functions = !self.functions.is_empty() || !self.compiled.combinations.is_empty();
        if (pairs || functions) && !self.is_open(counts) {
            let stage = CountStage { whole: true, ..CountStage::new(0, limit) };
            found = self.both(stage, [&RelationConsequences::default(); 2]);
        }
        let name = |unknown: usize| self.judged.layout.unknowns[unknown].name.clone();
        if pairs && let [Ok(first), Ok(second)] = &found {
            maps.extend(second_solution(self.fields, [first, second], &name));
        }
        (maps, self.agreed_functions(&found))
    }
}

/// Limits of the work of the rounds: a small one first, since relations that decide nothing take all the work
/// that is allowed, and a count that decides often takes little.
fn rounds(limit: u64) -> Vec<u64> {
    let mut out = vec![FIRST_ROUND.min(limit), limit];
    out.dedup();
    out.retain(|&round| round > 0);
    out
}

/// Numbers of values that the unknowns and functions take.
pub(super) fn values_taken(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    functions: &[QuotientTerms],
    (seed, limits): (u64, CountLimits),
) -> Solutions {
    let degrees = &judged.findings.degrees;
    let last = degrees.rank_profile.iter().position(|&r| r == degrees.rank()).unwrap_or(0);
    let wanted = match linear_order(model, compiled) {
        Some(linear) if !judged.layout.closed => linear.max(last + BEYOND),
        _ => last + BEYOND,
    };
    let order = wanted.min(if judged.layout.closed { usize::MAX } else { judged.layout.bound.max(last) });
    let Some(fields) = judged.fields else {
        let why = if compiled.dag.is_rational() { NotCounted::InDigits } else { NotCounted::NotRational };
        let none = degrees.degree.iter().map(|degree| degree.and(Some(Err(why))));
        let (counts, of_functions) = (none.collect(), vec![Err(why); functions.len()]);
        let of_asked = vec![Err(why); compiled.combinations.len()];
        return Solutions { counts, of_functions, of_asked, order, maps: Vec::new() };
    };
    let counting = SolutionCounting { model, compiled, judged, fields, seed, order, functions };
    let mut counts = counting.by_stages(limits);
    let twins = counting.confirmed(&mut counts);
    let maps: Vec<String> = twins.iter().map(|t| t.words(compiled, &|role| role_name(model, role))).collect();
    let (maps, mut of_functions) = counting.of_all(&counts, maps, limits.count);
    let of_asked = of_functions.split_off(functions.len());
    let advised = |count: SolutionCount| match count {
        Err(NotCounted::OverLimit) if limits.relations < ENOUGH * 1_000_000 => Err(NotCounted::InLittleWork),
        count => count,
    };
    let observable =
        counts.into_iter().zip(&degrees.degree).map(|(count, degree)| degree.and(Some(advised(count))));
    let counts: Vec<Option<SolutionCount>> = observable.collect();
    let of_functions = with_single(functions, of_functions, &counts);
    let is_single = |s: usize| match compiled.roles[s] {
        Role::Constant(_) | Role::KnownInput(_) | Role::Time => true,
        // a start that is given may contain parameters
        Role::State(i) if model.states[i].start == StateStart::Known => true,
        role => judged.layout.index_of(role, 0).is_some_and(|unknown| counts[unknown] == Some(Ok(1))),
    };
    let single = |&node: &usize| slots_of(&compiled.dag, node).into_iter().all(is_single);
    let of_asked = compiled.combinations.iter().zip(of_asked);
    let of_asked = of_asked.map(|(node, count)| if single(node) { Ok(1) } else { count }).collect();
    Solutions { counts, of_functions, of_asked, order, maps }
}

fn role_name(model: &SystemModel, role: Role) -> String {
    match role {
        Role::State(i) => model.states[i].named.name.clone(),
        Role::Parameter(i) => model.parameters[i].name.clone(),
        Role::UnknownInput(i) => {
            let (named, degree) = &model.unknown_inputs[i];
            let derivatives = if *degree == Some(0) { "" } else { " with its derivatives" };
            format!("{}{derivatives}", named.name)
        }
        Role::Constant(i) => model.constants[i].0.name.clone(),
        Role::KnownInput(i) => model.known_inputs[i].0.name.clone(),
        Role::Time => "t".into(),
    }
}

/// Counts of functions; a function of unknowns with one value each has one value.
fn with_single(
    functions: &[QuotientTerms],
    counted: Vec<SolutionCount>,
    unknowns: &[Option<SolutionCount>],
) -> Vec<SolutionCount> {
    // factors beyond the unknowns are known values
    let is_single = |c: usize| unknowns.get(c).is_none_or(|count| *count == Some(Ok(1)));
    let single = |terms: &QuotientTerms| terms.iter().flat_map(|t| &t.1).all(|p| is_single(p.0));
    functions.iter().zip(counted).map(|(terms, count)| if single(terms) { Ok(1) } else { count }).collect()
}

/// Order of the last derivative that can distinguish two points of a model that is linear in its states (and
/// constants beside them), with one segment and no inputs other than polynomials in time. Two copies of the
/// model side by side are a linear system of twice its states with the inputs' derivatives and a constant.
/// By Cayley-Hamilton their outputs agree if that many derivatives do.
fn linear_order(model: &SystemModel, compiled: &Compiled) -> Option<usize> {
    if compiled.segments.len() > 1 || compiled.uses_time() || !model.unknown_inputs.is_empty() {
        return None;
    }
    let mut signals = 1;
    for e in 0..compiled.experiments.len() {
        let mut own = 1;
        for i in 0..model.known_inputs.len() {
            match model.known_input(e, i) {
                KnownInput::Polynomial(degree) => own += degree + 1,
                KnownInput::Generic | KnownInput::Function(_) => return None,
            }
        }
        signals = signals.max(own);
        let degrees = degrees_in_states(&compiled.dag, &compiled.roles);
        let roots = compiled.rates(e).iter().chain(compiled.outputs(e));
        if roots.into_iter().any(|&r| degrees[r].is_none_or(|d| d > 1)) {
            return None;
        }
    }
    Some(2 * model.states.len() + signals - 1)
}

/// Degree of each node in states and known inputs together; `None` if it is no polynomial in them.
fn degrees_in_states(dag: &Dag, roles: &[Role]) -> Vec<Option<usize>> {
    let mut out: Vec<Option<usize>> = Vec::with_capacity(dag.ops.len());
    for op in &dag.ops {
        let degree = match *op {
            Op::Number { .. } | Op::Pi => Some(0),
            Op::Slot(s) => match roles[s] {
                Role::State(_) | Role::KnownInput(_) | Role::UnknownInput(_) | Role::Time => Some(1),
                Role::Parameter(_) | Role::Constant(_) => Some(0),
            },
            Op::Add(a, b) | Op::Subtract(a, b) => out[a].zip(out[b]).map(|(a, b)| a.max(b)),
            Op::Multiply(a, b) => out[a].zip(out[b]).map(|(a, b)| a + b),
            Op::Divide(a, b) => out[a].filter(|_| out[b] == Some(0)),
            Op::Primitive { .. } => None,
        };
        out.push(degree);
    }
    out
}
