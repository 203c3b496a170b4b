//! Verdicts on any system: degrees on which two random points agree, modulo two primes or in many digits.

use obsdeg_exact::certainty::{RankClaim, error_bound as bound_in};
use obsdeg_exact::{Echelon, Field, RankMargin, Reals, RootField, RowSpace, SplitMix64, parallel};

use super::addition::written_apart;
use super::branches::{BranchSide, Signs, sided, sides};
use super::constraints::slots_of;
use super::dag::{Dag, Op};
use super::error::ModelError;
use super::function_factors::ModelFactors;
use super::independent::independent_functions;
use super::model::{Compiled, MAX_UNKNOWNS, Role, StartTime, SystemModel};
use super::real_points::{dependent_at_points, real_point};
use super::rows::{Layout, PointBuilder, SystemRows, Unknown, random_field};
use super::taylor::Singular;
use super::values::Values;
use super::work::{Spent, Work, WorkStep, product};
use crate::degree::filtration::{Degrees, climb};
use crate::degree::findings::{ByPrimes, Findings};
use crate::degree::rows::DerivativeRows;
use crate::degree::status::{Status, Verdict};
use crate::language::Function;

/// Number of pairs of fields that are tried.
const ATTEMPTS: usize = 5;

/// Largest number of operations of verdicts in prime fields for which they are compared with those at a real
/// point, if there are constraints.
const COMPARED: u64 = 2_000_000;

/// Number of primes tried until constraints have a point.
const PRIMES: usize = 20;

/// Number of points drawn modulo each prime.
const POINTS: usize = 2;

/// Largest bound on the probability of a wrong verdict; a third prime is taken where two leave more.
const CERTAIN: f64 = 1e-9;

/// Number of orders from which, approximately, fields are chosen with roots of unity.
const LONG: usize = 100;

/// Verdicts on a system, with their certainty.
#[derive(Debug, Clone)]
pub struct Judgement {
    /// Unknowns of the system, and the bound on the order.
    pub layout: Layout,
    /// Verdicts on the unknowns and on requested combinations.
    pub findings: Findings,
    /// Certainty of the verdicts.
    pub certainty: SystemCertainty,
    /// Span of all rows in the first prime field; `None` if real numbers decided.
    pub span: Option<Echelon>,
    /// Number of independent functions of the reported unknowns that the outputs determine.
    pub(super) shown_rank: usize,
    /// The two prime fields of a rational model.
    pub fields: Option<[Field; 2]>,
    /// Number of functions whose values are proven to be independent of each other, so that random values
    /// replace them; `None` if true values were used.
    pub independent_functions: Option<usize>,
    /// Number of operations of the verdicts, at all points that were drawn.
    pub work: u64,
    /// True if unobservable unknowns might be observable beyond the bound on the order: it is not proven
    /// that higher orders add nothing.
    pub rests_on_bound: bool,
    /// Sides of the branches of abs and sign at the two points.
    pub sides: Vec<BranchSide>,
}

/// Certainty of the verdicts on a system.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SystemCertainty {
    /// Two prime fields that agree: a rational model, or one whose functions have independent values.
    Primes(ByPrimes),
    /// Two random real points that agree: any other model with functions.
    Digits(ByDigits),
}

/// Margin of rank decisions in real numbers. Decimal logarithms, relative to the largest entry of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ByDigits {
    /// Numbers of decimal digits at the first point and at the second.
    pub digits: [usize; 2],
    /// Smallest number that counts as non-zero: an error bound proves it.
    pub nonzero: f64,
    /// Widest error bound of a number that counts as zero: it contains zero.
    pub zero: f64,
}

impl Judgement {
    /// True if an unknown is reported: of arbitrary inputs only the signal itself, not its derivatives.
    pub fn shown(&self, model: &SystemModel, unknown: usize) -> bool {
        is_shown(model, &self.layout.unknowns[unknown])
    }

    /// Verdict on the unknown of a name; `None` if it is not reported.
    pub fn verdict(&self, model: &SystemModel, name: &str) -> Option<Verdict> {
        let unknown = self.layout.unknowns.iter().position(|u| u.name == name)?;
        self.shown(model, unknown).then(|| self.verdict_on(unknown))
    }

    /// Verdict on an unknown, as far as it is proven.
    pub fn verdict_on(&self, unknown: usize) -> Verdict {
        self.as_proven(self.findings.verdict(unknown))
    }

    /// Verdicts on requested combinations, as far as they are proven.
    pub fn asked(&self) -> impl Iterator<Item = Verdict> + '_ {
        self.findings.asked.iter().map(|v| self.as_proven(*v))
    }

    /// Verdict that allows for a higher order: an unobservable unknown is not resolved if no end is proven.
    fn as_proven(&self, verdict: Verdict) -> Verdict {
        match verdict.degree {
            None if self.rests_on_bound => Verdict { status: Status::NotSeen, ..verdict },
            _ => verdict,
        }
    }
}

/// True if an unknown is reported.
fn is_shown(model: &SystemModel, u: &Unknown) -> bool {
    match u.role {
        Role::UnknownInput(i) => u.derivative == 0 || model.unknown_inputs[i].1.is_some(),
        _ => true,
    }
}

/// Number of independent functionals in a span that contain only unknowns other than `hidden`.
fn rank_without<S: Values>(f: &S, span: &S::Space, hidden: &[usize]) -> usize {
    let mut part = <S::Space as RowSpace>::new(f.clone(), hidden.len());
    for i in 0..span.rank() {
        let row = span.row(i);
        part.insert(&hidden.iter().map(|&c| row[c]).collect::<Vec<_>>());
    }
    span.rank() - part.rank()
}

/// Degrees at one random point.
pub(crate) struct PointDegrees<S: Values> {
    pub(crate) degrees: Degrees,
    pub(crate) combinations: Vec<Verdict>,
    /// Span of all rows.
    pub(crate) span: S::Space,
    /// Value of every unknown at the point, then of the nodes of [`ModelFactors`].
    pub(crate) values: Vec<S::Element>,
    /// True if the last order is proven to be the last.
    ended: bool,
    /// True if the point is generic, so that an order that adds nothing is the last.
    closed: bool,
    gap: RankMargin,
    steps: OrderedRows<S>,
    /// Signs of the arguments of abs and sign.
    signs: Signs,
}

/// New rows of `V_0, V_1, ...`, order by order, each zero at the pivots of those before.
struct OrderedRows<S: Values> {
    field: S,
    rows: Vec<(usize, usize, Vec<S::Element>)>,
}

impl<S: Values> OrderedRows<S> {
    fn add(&mut self, order: usize, basis: &S::Space) {
        let pivots = basis.pivot_columns();
        for (i, &pivot) in pivots.iter().enumerate().skip(self.rows.len()) {
            self.rows.push((order, pivot, basis.row(i).to_vec()));
        }
    }

    /// Observable degree: the smallest k with a functional in `V_k`.
    fn degree(&self, functional: &[S::Element]) -> Option<usize> {
        let f = &self.field;
        let mut rest = functional.to_vec();
        let mut last = 0;
        for (order, pivot, row) in &self.rows {
            if f.is_zero(&rest[*pivot]) {
                continue;
            }
            let factor = f.neg(&f.mul(&rest[*pivot], &f.inverse(&row[*pivot])?));
            for (x, b) in rest.iter_mut().zip(row) {
                *x = f.add(x, &f.mul(&factor, b));
            }
            last = *order;
        }
        rest.iter().all(|x| f.is_zero(x)).then_some(last)
    }
}

impl<S: Values> PointDegrees<S> {
    /// Observable degree of a functional at this point.
    pub(crate) fn degree(&self, functional: &[S::Element]) -> Option<usize> {
        self.steps.degree(functional)
    }
}

/// Climbs the filtration of a system at a random point of a field. Adds the operations to `spent`, whether or
/// not there is a verdict.
pub(crate) fn climb_at<S: Values>(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    field: S,
    rng: &mut SplitMix64,
    spent: &mut Spent,
) -> Result<PointDegrees<S>, ModelError> {
    let work = Work::new(model.work_limit);
    let found = climbed(model, compiled, layout, field, rng, &work);
    spent.add(&work);
    found
}

fn climbed<S: Values>(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    field: S,
    rng: &mut SplitMix64,
    work: &Work,
) -> Result<PointDegrees<S>, ModelError> {
    let refused = || work.refused().map_or(Ok(()), Err);
    let mut rows = match SystemRows::new(model, compiled, layout, field.clone(), rng, work) {
        Ok(rows) => rows,
        Err(reason) => {
            refused()?;
            return Err(singular::<S>(model, compiled, reason));
        }
    };
    let scales = input_scales(layout, &field);
    let mut gradients = rows.combinations().to_vec();
    gradients.iter_mut().for_each(|row| scale(&field, row, &scales));
    let mut rows = DerivativesOfInputs { rows: &mut rows, scales: &scales };
    let mut found = vec![None; gradients.len()];
    let mut basis = <S::Space as RowSpace>::new(field.clone(), layout.unknowns.len());
    let mut steps = OrderedRows { field: field.clone(), rows: Vec::new() };
    let (mut refined, product) = (0, product::<S::Element>());
    let degrees = climb(&mut rows, &mut basis, |order, basis| {
        // rows that were computed again; a refusal ends the climb
        let again = basis.refined() - std::mem::replace(&mut refined, basis.refined());
        let _refused = work.take(WorkStep::Derivatives(order), again.saturating_mul(product), 0);
        for (degree, gradient) in found.iter_mut().zip(&gradients) {
            if degree.is_none() && basis.contains(gradient) {
                *degree = Some(order);
            }
        }
        steps.add(order, basis);
    });
    refused()?;
    let combinations = found
        .into_iter()
        .zip(&gradients)
        .map(|(degree, gradient)| {
            let moves =
                gradient.iter().zip(&degrees.excited).any(|(x, excited)| !field.is_zero(x) && *excited);
            Verdict { status: Status::of(degree, moves), degree }
        })
        .collect();
    let rows = rows.rows;
    let nodes = ModelFactors::new(model, compiled, layout).nodes(compiled);
    for (node, order) in nodes.iter().flatten().filter(|n| n.1 > 0) {
        rows.coefficient(0, *node, *order);
    }
    let mut values = rows.values(compiled, layout, &nodes);
    for (unknown, _) in &scales {
        values[*unknown] = field.mul(&values[*unknown], &layout.factorial(&field, *unknown));
    }
    let gap = basis.gap().and(rows.gap());
    let (ended, closed) = (rows.is_done(), rows.is_generic());
    let signs = rows.signs(&sided(compiled));
    Ok(PointDegrees { signs, degrees, combinations, span: basis, values, ended, closed, gap, steps })
}

/// Unknowns that are second or higher derivatives of inputs, with the inverse of `k!`.
fn input_scales<S: Values>(layout: &Layout, f: &S) -> Vec<(usize, S::Element)> {
    let unknowns = (0..layout.unknowns.len()).filter(|&unknown| layout.unknowns[unknown].derivative > 1);
    unknowns.map(|unknown| (unknown, f.inverse(&layout.factorial(f, unknown)).unwrap_or(f.zero()))).collect()
}

/// Turns a row by Taylor coefficients of inputs into one by their derivatives.
fn scale<S: Values>(f: &S, row: &mut [S::Element], scales: &[(usize, S::Element)]) {
    scales.iter().for_each(|(unknown, factor)| row[*unknown] = f.mul(&row[*unknown], factor));
}

/// Rows by the derivatives of inputs in place of their Taylor coefficients.
struct DerivativesOfInputs<'r, 'a, S: Values> {
    rows: &'r mut SystemRows<'a, S>,
    scales: &'r [(usize, S::Element)],
}

impl<S: Values> DerivativeRows for DerivativesOfInputs<'_, '_, S> {
    type Field = S;

    fn field(&self) -> S {
        self.rows.field()
    }

    fn columns(&self) -> usize {
        self.rows.columns()
    }

    fn emit(&mut self, order: usize, sink: &mut dyn FnMut(&[S::Element]) -> bool) -> bool {
        if self.scales.is_empty() {
            return self.rows.emit(order, sink);
        }
        let (f, scales) = (self.field(), self.scales);
        self.rows.emit(order, &mut |row| {
            let mut row = row.to_vec();
            scale(&f, &mut row, scales);
            sink(&row)
        })
    }
}

/// Message for a node without a value, or a derivative, at any of `points` points.
fn no_value(compiled: &Compiled, singular: Singular, points: usize) -> String {
    let name = |function| {
        let named = Function::ALL.iter().find(|(_, f)| *f == function);
        named.map_or("a function", |(name, _)| *name)
    };
    match singular {
        Singular::Domain(node, _) if compiled.dag.powers.contains(&node) => format!(
            "a power whose exponent is not known as a whole number or half of one is defined for a positive \
             base alone, which it was at none of {points} points that were tried"
        ),
        Singular::Domain(_, function) => {
            format!("{} is not defined here at any of {points} points that were tried", name(function))
        }
        Singular::Kink(_, function @ (Function::Asin | Function::Acos)) => format!(
            "{} at an end of its range, where it has no derivative; expected an argument between -1 and 1",
            name(function)
        ),
        Singular::Kink(_, function) => format!(
            "{} of zero, where it has no derivative; expected an argument that is not zero",
            name(function)
        ),
        _ => "division by zero at every point that was tried".into(),
    }
}

/// Error that states where the model has no value.
pub(super) fn singular<S: Values>(
    model: &SystemModel,
    compiled: &Compiled,
    singular: Singular,
) -> ModelError {
    let points = S::ATTEMPTS;
    let (node, message) = match singular {
        Singular::Constraint(c) => {
            let (of, message) = (
                &model.constraints[c],
                format!(
                    "no point was found at which it holds, from {points} starts; give one under [simulation.values]"
                ),
            );
            return of.place.error(message, 0..of.text.len());
        }
        Singular::Dependent(c) => return dependent_at_points(model, c),
        // reported before, with the exceeded limit
        Singular::Refused => return refuse("the limit of work".into()),
        Singular::Division(node) | Singular::Domain(node, _) | Singular::Kink(node, _) => {
            (node, no_value(compiled, singular, points))
        }
    };
    let of_time = slots_of(&compiled.dag, node).into_iter().any(|s| compiled.roles[s] == Role::Time);
    let message = match model.time {
        StartTime::Generic => message,
        _ if !of_time => message,
        _ => format!(
            "{message}; it depends on the time, which is that of the start: `time` in the file chooses \
             another, or \"generic\""
        ),
    };
    match compiled.places.get(&node) {
        Some((place, span)) if model.algebraic.iter().any(|a| a.equation.place == *place) => {
            let message = format!(
                "{message}, on its way to the rate of change of an unknown of [algebraic]; expected equations \
                 that determine their unknowns at every point that satisfies them (index 1)"
            );
            place.error(message, span.clone())
        }
        Some((place, span)) => place.error(message, span.clone()),
        None => ModelError { what: "the model".into(), message, span: None },
    }
}

/// Judges a model at two random points, each with its own stream of `seed` and the model. A rational model,
/// or one whose functions have independent values, is judged modulo two primes; any other in many digits.
/// `bound` overrides the highest order.
///
/// # Errors
/// [`ModelError`].
pub fn judge(model: &SystemModel, seed: u64, bound: Option<usize>) -> Result<Judgement, ModelError> {
    judge_compiled(model, &model.compile()?, seed, bound)
}

/// Judges a change of a judged model, on the same sides of abs and sign if it has as many. Adds the
/// operations at all points to `spent`, whether or not there is a verdict.
///
/// # Errors
/// [`ModelError`].
pub(super) fn judge_beside(
    judged: &Judgement,
    model: &SystemModel,
    bound: Option<usize>,
    spent: &mut Spent,
) -> Result<Judgement, ModelError> {
    let compiled = model.compile()?;
    let shape = |signs: &Signs| -> Vec<usize> { signs.iter().map(Vec::len).collect() };
    let runs = compiled.segments.len().max(1) * model.experiments.max(1);
    let own = vec![runs; sided(&compiled).len()];
    let sides = judged.layout.sides.clone().filter(|sides| shape(sides) == own);
    judge_within(model, &compiled, (judged.findings.seed, bound), sides, spent)
}

/// Judges a compiled model.
///
/// # Errors
/// [`ModelError`].
pub fn judge_compiled(
    model: &SystemModel,
    compiled: &Compiled,
    seed: u64,
    bound: Option<usize>,
) -> Result<Judgement, ModelError> {
    judge_within(model, compiled, (seed, bound), None, &mut Spent::default())
}

/// Judges a model at points on the given `sides`, if any.
fn judge_within(
    model: &SystemModel,
    compiled: &Compiled,
    (seed, bound): (u64, Option<usize>),
    sides: Option<Signs>,
    spent: &mut Spent,
) -> Result<Judgement, ModelError> {
    let mut layout = Layout { sides, ..checked_layout(model, compiled, bound)? };
    layout.dependent = real_point(model, compiled, &layout, seed, spent)?;
    let rational = compiled.dag.is_rational();
    if !rational {
        let mut rng = model.random(seed, "values of functions");
        let apart = written_apart(compiled);
        let apart = apart.as_ref().unwrap_or(compiled);
        let independent = independent_functions(model, apart, &layout, &mut rng, spent);
        // if prime fields fail for any reason, real numbers give the reason
        if let Some(count) = independent
            && let Ok(judged) = judge_in_fields(model, apart, &layout, seed, spent)
        {
            return Ok(Judgement { independent_functions: Some(count), ..judged });
        }
        return judge_by_digits(model, compiled, &layout, seed, spent);
    }
    match judge_in_fields(model, compiled, &layout, seed, spent) {
        // constraints with real points but without points in prime fields, within the limit of work
        Err(_) if !compiled.constraints.is_empty() && !spent.refused => {
            judge_by_digits(model, compiled, &layout, seed, spent)
        }
        Ok(judged) if !holds_at_real_point(model, compiled, &layout, &judged, spent) => {
            judge_by_digits(model, compiled, &layout, seed, spent)
        }
        judged => Ok(Judgement { independent_functions: Some(0), ..judged? }),
    }
}

/// Judges a model in two prime fields: a rational one, or one whose functions have independent values.
fn judge_in_fields(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    seed: u64,
    spent: &mut Spent,
) -> Result<Judgement, ModelError> {
    let before = spent.operations;
    let orders = layout.unknowns.len() / model.outputs.len().max(1);
    let points = FieldChoice { model, compiled, layout, orders };
    let order = points.root_order();
    let runs = compiled.segments.len().max(1) * model.experiments.max(1);
    for attempt in 0..ATTEMPTS {
        let judged = |i: usize, spent: &mut Spent| {
            let mut rng = model.random(seed, &format!("verdicts, attempt {attempt}, field {i}"));
            let mut own = model.random(seed, &format!("points of constraints, attempt {attempt}, field {i}"));
            let field = points.field(&mut rng, &mut own, spent);
            climb_at(model, compiled, layout, field, &mut rng, spent).map(|at| (field, at))
        };
        let alone = |i: usize| {
            let mut own = Spent::default();
            (judged(i, &mut own), own)
        };
        // long work is done at both points at once
        let ((p, first), (q, second)) = if orders < LONG {
            (judged(0, spent)?, judged(1, spent)?)
        } else {
            let ((first, of_first), (second, of_second)) = parallel::join(|| alone(0), || alone(1));
            spent.join(&of_first);
            spent.join(&of_second);
            (first?, second?)
        };
        if first.agrees(&second) {
            let claim = RankClaim { order, ..claim(compiled, layout, &first.degrees, runs) };
            let (mut third, mut error_bound) = (None, bound_in(&claim, 2));
            if error_bound > CERTAIN {
                let (r, other) = judged(2, spent)?;
                if !first.agrees(&other) {
                    continue;
                }
                (third, error_bound) = (Some(r.modulus()), bound_in(&claim, 3));
            }
            if error_bound > CERTAIN {
                return Err(refuse(format!(
                    "undecided, because the powers in it are too high for primes of 61 bits: three agree, \
                     but a verdict may be wrong with probability {error_bound:.0e}, where {CERTAIN:.0e} is \
                     expected at most"
                )));
            }
            let primes = ByPrimes { primes: [p, q].map(|f| f.modulus()), third, error_bound };
            let span = first.span.clone();
            let judged = Judgement::of(model, layout.clone(), first, SystemCertainty::Primes(primes), seed);
            let fields = compiled.dag.is_rational().then_some([p, q]);
            let work = spent.operations - before;
            return Ok(Judgement { span: fields.map(|_| span), fields, work, ..judged });
        }
    }
    Err(refuse(format!(
        "two random primes disagreed {ATTEMPTS} times in a row; expected at most one disagreement in 10^6 \
         runs: please report this model"
    )))
}

/// False if verdicts in prime fields differ from those at a real point. Constraints may hold on several
/// components, one of them without a real point, as for x = 1 or x^2 + y^2 = 0. True if the comparison would
/// take too much work, or decides nothing.
fn holds_at_real_point(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    judged: &Judgement,
    spent: &mut Spent,
) -> bool {
    if compiled.constraints.is_empty() || judged.work > COMPARED {
        return true;
    }
    let mut rng = model.random(judged.findings.seed, "verdicts, real point of the constraints");
    match climb_at(model, compiled, layout, Reals::<4>, &mut rng, spent) {
        Ok(at) if at.gap.is_decisive(Reals::<4>::BITS) => {
            let asked = at.combinations == judged.findings.asked;
            asked && at.degrees == judged.findings.degrees
        }
        _ => true,
    }
}

/// Choice of prime fields in which points of a model are drawn.
pub(super) struct FieldChoice<'a> {
    pub(super) model: &'a SystemModel,
    pub(super) compiled: &'a Compiled,
    pub(super) layout: &'a Layout,
    /// Approximate number of orders of derivatives that may be needed.
    pub(super) orders: usize,
}

impl FieldChoice<'_> {
    /// Order of the roots of unity in a field: long series are multiplied by transforms, which need them.
    pub(super) fn root_order(&self) -> u64 {
        if self.orders < LONG { 1 } else { (2 * self.orders as u64 + 4).next_power_of_two() }
    }

    /// Random field in which the constraints hold at a point, if one is found; `own` draws these points.
    pub(super) fn field(&self, rng: &mut SplitMix64, own: &mut SplitMix64, spent: &mut Spent) -> Field {
        let order = self.root_order();
        let draw = |rng: &mut SplitMix64| match order {
            1 => random_field(rng),
            // this order has divisors enough
            _ => RootField::random(order, rng).map_or_else(|_| random_field(rng), |k| k.field),
        };
        let mut field = draw(rng);
        // constraints with isolated points have one modulo some primes
        for _ in 1..PRIMES {
            if can_hold(self.model, self.compiled, self.layout, field, own, spent) {
                break;
            }
            field = draw(rng);
        }
        field
    }
}

/// True if a point at which the constraints hold was found in a prime field.
fn can_hold(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    field: Field,
    rng: &mut SplitMix64,
    spent: &mut Spent,
) -> bool {
    if compiled.constraints.is_empty() {
        return true;
    }
    let work = Work::new(model.work_limit);
    let builder = PointBuilder { model, compiled, layout, field, work: &work };
    let free = builder.free(0);
    let found = (0..POINTS).any(|attempt| {
        let Some(mut values) = builder.values(rng, attempt) else { return false };
        field.hold(&compiled.dag, &compiled.constraints, &mut values, &free, rng, &work).is_ok()
    });
    spent.add(&work);
    // beyond the limit of work another prime does not help
    found || work.refused().is_some()
}

/// Judges any model, rational or not, by real numbers: the independent path to the same verdicts.
///
/// # Errors
/// [`ModelError`], with the reason if no number of digits decides.
pub fn judge_in_digits(
    model: &SystemModel,
    compiled: &Compiled,
    seed: u64,
    bound: Option<usize>,
) -> Result<Judgement, ModelError> {
    let (mut layout, mut spent) = (checked_layout(model, compiled, bound)?, Spent::default());
    layout.dependent = real_point(model, compiled, &layout, seed, &mut spent)?;
    judge_by_digits(model, compiled, &layout, seed, &mut spent)
}

fn judge_by_digits(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    seed: u64,
    spent: &mut Spent,
) -> Result<Judgement, ModelError> {
    let before = spent.operations;
    let mut reason = String::new();
    for pair in [pair::<4, 6>, pair::<6, 10>, pair::<10, 16>, pair::<16, 32>] {
        match pair(model, compiled, layout, seed, spent)? {
            Ok(judged) => return Ok(Judgement { work: spent.operations - before, ..judged }),
            Err(why) => reason = why,
        }
    }
    let other = match compiled.constraints.is_empty() {
        true => "",
        false => {
            "; points near values that hold the constraints, given under [simulation.values], may decide it"
        }
    };
    Err(refuse(format!("undecided, because {reason}{other}")))
}

pub(super) fn refuse(message: String) -> ModelError {
    ModelError { what: "the model".into(), message, span: None }
}

fn checked_layout(
    model: &SystemModel,
    compiled: &Compiled,
    bound: Option<usize>,
) -> Result<Layout, ModelError> {
    let layout = Layout::new(model, compiled, bound);
    let found = layout.unknowns.len();
    match found <= MAX_UNKNOWNS {
        true => Ok(layout),
        false => Err(refuse(format!("{found} unknowns; expected at most {MAX_UNKNOWNS}"))),
    }
}

/// Verdicts at a point in `64 A` bits and at another in `64 B`, or the reason why they decide nothing.
fn pair<const A: usize, const B: usize>(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    seed: u64,
    spent: &mut Spent,
) -> Result<Result<Judgement, String>, ModelError> {
    let random = |i: usize| model.random(seed, &format!("verdicts, {A} and {B} words, point {i}"));
    let decimal = |bits: f64| bits * std::f64::consts::LOG10_2;
    let digits = [A, B].map(|n| decimal(64.0 * n as f64) as usize);
    let unclear = |gap: RankMargin, digits: usize| {
        // error bounds as wide as their numbers decide nothing
        if gap.zero >= 0.0 {
            return format!(
                "with {digits} digits the numbers that decide a rank lose all of them to rounding"
            );
        }
        format!(
            "with {digits} digits what counts as zero is known to 10^{:.0} of its row, and the least of \
             the rest is 10^{:.0}",
            decimal(gap.zero),
            decimal(gap.nonzero)
        )
    };
    let first = climb_at(model, compiled, layout, Reals::<A>, &mut random(0), spent)?;
    if !first.gap.is_decisive(64 * A as i64) {
        return Ok(Err(unclear(first.gap, digits[0])));
    }
    // all other points are on the sides of this one
    let layout = &Layout { sides: Some(first.signs.clone()), ..layout.clone() };
    let second = climb_at(model, compiled, layout, Reals::<B>, &mut random(1), spent)?;
    if !second.gap.is_decisive(64 * B as i64) {
        return Ok(Err(unclear(second.gap, digits[1])));
    }
    if !first.agrees(&second) {
        return Ok(Err(format!("two random points disagree with {} and {} digits", digits[0], digits[1])));
    }
    let gap = first.gap.and(second.gap);
    let certainty =
        SystemCertainty::Digits(ByDigits { digits, nonzero: decimal(gap.nonzero), zero: decimal(gap.zero) });
    let sides = sides(model, compiled, &[first.signs.clone(), second.signs]);
    Ok(Ok(Judgement { sides, ..Judgement::of(model, layout.clone(), first, certainty, seed) }))
}

impl<S: Values> PointDegrees<S> {
    fn agrees<T: Values>(&self, other: &PointDegrees<T>) -> bool {
        (&self.degrees, &self.combinations, self.ended) == (&other.degrees, &other.combinations, other.ended)
    }
}

impl Judgement {
    fn of<S: Values>(
        model: &SystemModel,
        layout: Layout,
        at: PointDegrees<S>,
        certainty: SystemCertainty,
        seed: u64,
    ) -> Self {
        let full = at.degrees.rank() == layout.unknowns.len();
        let hidden = |unknown: &usize| !is_shown(model, &layout.unknowns[*unknown]);
        let hidden: Vec<usize> = (0..layout.unknowns.len()).filter(hidden).collect();
        Self {
            shown_rank: rank_without(&at.steps.field, &at.span, &hidden),
            rests_on_bound: !full && !at.ended,
            findings: Findings {
                partners: at.span.companions(),
                degrees: at.degrees,
                asked: at.combinations,
                seed,
            },
            layout: Layout { closed: at.closed, ..layout },
            certainty,
            span: None,
            fields: None,
            independent_functions: None,
            sides: Vec::new(),
            work: 0,
        }
    }
}

/// Size of the claim: the degree and the coefficients of the polynomials that decide a rank (derivation:
/// crates/README.md, *Certainty*).
///
/// With `f_i = N_i / D` over a common denominator, `L_f^k h = P_k / D^(2k+1)`. The degree of `P_k` grows
/// by at most `delta = max(deg N, deg D) + deg D` an order. Its coefficients grow by the effect of a
/// derivative and two products.
fn claim(compiled: &Compiled, layout: &Layout, degrees: &Degrees, runs: usize) -> RankClaim {
    // Decisions at each of ATTEMPTS points: a rank at each order, of all runs and of each alone, here and at
    // a generic point; that no unit vector comes an order early (if the ranks are correct none comes late);
    // and that no column or entry of the last basis is zero by chance.
    let decisions = ATTEMPTS
        * ((degrees.rank_profile.len() + 1) * (1 + 2 * runs)
            + 2 * layout.unknowns.len()
            + 2 * compiled.combinations.len()
            + degrees.rank() * (layout.unknowns.len() - degrees.rank()));
    RankClaim { decisions, ..claim_of(compiled, layout, degrees.rank_profile.len()) }
}

/// Size of the claim of one decision on rows of the given number of orders.
pub(super) fn claim_of(compiled: &Compiled, layout: &Layout, orders: usize) -> RankClaim {
    let fractions = fractions(&compiled.dag);
    let experiments = 0..compiled.experiments.len();
    let used: Vec<QuotientBounds> = experiments
        .flat_map(|e| {
            let given = compiled.constants(e).iter().flatten();
            compiled.rates(e).iter().chain(compiled.outputs(e)).chain(given)
        })
        .chain(compiled.starts.iter().flatten())
        .chain(
            compiled.segments.iter().flat_map(|s| s.constants.iter().chain(&s.carry)).map(|(_, node)| node),
        )
        .map(|&node| fractions[node])
        .chain(function_rates(&compiled.dag, &fractions, compiled))
        .collect();
    // over the product of all denominators
    let (below, below_bits) = used.iter().fold((0.0, 0.0), |(d, b), f| (d + f.below.0, b + f.below.1));
    let above = |part: fn(&QuotientBounds) -> f64| used.iter().map(part).fold(0.0, f64::max);
    let (top, top_bits) = (above(|f| f.above.0) + below, above(|f| f.above.1) + below_bits);
    let delta = top.max(below) + below;
    let (orders, n) = (orders as f64, layout.unknowns.len() as f64);
    // jets of inputs and states are variables too
    let functions = compiled.dag.ops.iter().filter(|op| matches!(op, Op::Primitive { .. })).count();
    let variables = (compiled.roles.len() as f64) * (orders + 1.0) + functions as f64;
    let degree = top + orders * delta + below;
    let step =
        (variables * (degree + (2.0 * orders + 1.0) * below).max(1.0)).log2() + 2.0 * (top_bits + below_bits);
    let bits = top_bits + (orders + 1.0) * step + n.max(1.0).log2();
    RankClaim {
        unknowns: layout.unknowns.len(),
        decisions: 1,
        order: 1,
        row_degree: degree.min(1e18) as usize,
        row_bits: bits,
    }
}

/// Bounds of a quotient of polynomials: degree, and `log2` of the sum of the absolute coefficients.
#[derive(Debug, Clone, Copy)]
struct QuotientBounds {
    above: (f64, f64),
    below: (f64, f64),
}

impl QuotientBounds {
    const ZERO: Self = Self { above: (0.0, 0.0), below: (0.0, 0.0) };
    const VARIABLE: Self = Self { above: (1.0, 0.0), below: (0.0, 0.0) };

    fn plus(self, other: Self) -> Self {
        let (left, right) = (times(self.above, other.below), times(other.above, self.below));
        Self {
            above: (left.0.max(right.0), left.1.max(right.1) + 1.0),
            below: times(self.below, other.below),
        }
    }

    fn times(self, other: Self) -> Self {
        Self { above: times(self.above, other.above), below: times(self.below, other.below) }
    }

    fn inverse(self) -> Self {
        Self { above: self.below, below: self.above }
    }
}

/// Bounds of a product of polynomials.
fn times(x: (f64, f64), y: (f64, f64)) -> (f64, f64) {
    (x.0 + y.0, x.1 + y.1)
}

/// Time derivatives of the variables that replace functions: `E' = E u'` for exp and tanh, `(1 + t^2)/2 u'`
/// with `t = tan(u/2)` for sin, cos and tan, `weight u'` for a logarithm and an arc tangent.
fn function_rates(dag: &Dag, fractions: &[QuotientBounds], compiled: &Compiled) -> Vec<QuotientBounds> {
    // derivatives of all nodes; a jet of an input is a variable
    let mut rates: Vec<QuotientBounds> = Vec::with_capacity(dag.ops.len());
    let mut out = Vec::new();
    for (i, op) in dag.ops.iter().enumerate() {
        rates.push(match *op {
            Op::Number { .. } | Op::Pi => QuotientBounds::ZERO,
            Op::Slot(s) => match compiled.roles[s] {
                Role::State(k) => fractions[compiled.rates(0)[k]],
                _ => QuotientBounds::VARIABLE,
            },
            Op::Add(a, b) | Op::Subtract(a, b) => rates[a].plus(rates[b]),
            Op::Multiply(a, b) => rates[a].times(fractions[b]).plus(fractions[a].times(rates[b])),
            // (a' - (a/b) b') / b
            Op::Divide(a, b) => {
                let below = fractions[b].inverse();
                rates[a].plus(fractions[i].times(rates[b])).times(below)
            }
            Op::Primitive { of, weight, function } => {
                let factor = match function {
                    Function::Exp | Function::Tanh => QuotientBounds::VARIABLE,
                    Function::Sin | Function::Cos | Function::Tan => {
                        QuotientBounds { above: (2.0, 1.0), below: (0.0, 1.0) }
                    }
                    _ => fractions[weight],
                };
                out.push(factor.times(rates[of]));
                fractions[weight].times(rates[of])
            }
        });
    }
    out
}

/// Every node of a graph as a quotient of polynomials over the integers, in the slots and in one variable
/// for each function.
fn fractions(dag: &Dag) -> Vec<QuotientBounds> {
    let mut out: Vec<QuotientBounds> = Vec::with_capacity(dag.ops.len());
    for op in &dag.ops {
        let one = (0.0, 0.0);
        out.push(match *op {
            Op::Number { mantissa, decimals } => {
                let digits = (mantissa.unsigned_abs().max(1) as f64).log2();
                let ten = f64::from(decimals.abs()) * std::f64::consts::LOG2_10;
                match decimals > 0 {
                    true => QuotientBounds { above: (0.0, digits), below: (0.0, ten) },
                    false => QuotientBounds { above: (0.0, digits + ten), below: one },
                }
            }
            Op::Slot(_) | Op::Pi => QuotientBounds::VARIABLE,
            Op::Primitive { function, .. } => match function {
                // (E^2 - 1)/(E^2 + 1), 2t/(1 + t^2) and similar quotients
                Function::Tanh | Function::Sin | Function::Cos | Function::Tan => {
                    QuotientBounds { above: (2.0, 1.0), below: (2.0, 1.0) }
                }
                _ => QuotientBounds::VARIABLE,
            },
            Op::Add(a, b) | Op::Subtract(a, b) => out[a].plus(out[b]),
            Op::Multiply(a, b) => out[a].times(out[b]),
            Op::Divide(a, b) => out[a].times(out[b].inverse()),
        });
    }
    out
}
