//! Verdicts on any system: degrees on which two random points agree, modulo two primes or in many digits.

pub(crate) mod claim;
pub(crate) mod point_degrees;
pub(crate) mod verdicts;

use obsdeg_exact::certainty::{RankClaim, error_bound as bound_in};
use obsdeg_exact::{Field, RankMargin, Reals, RootField, SplitMix64, parallel};

use super::addition::written_apart;
use super::branches::{Signs, sided, sides};
use super::error::ModelError;
use super::independent::independent_functions;
use super::model::compiled::Compiled;
use super::model::{MAX_UNKNOWNS, SystemModel};
use super::real_points::real_point;
use super::rows::layout::Layout;
use super::rows::point::{PointBuilder, random_field};
use super::values::Values;
use super::work::{Spent, Work};
use crate::degree::findings::ByPrimes;
use claim::{ATTEMPTS, claim};
use point_degrees::{climb_at, refuse};
use verdicts::{ByDigits, Judgement, SystemCertainty};

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
            let mut third = None;
            if bound_in(&claim, 2) > CERTAIN {
                let (r, other) = judged(2, spent)?;
                if !first.agrees(&other) {
                    continue;
                }
                third = Some(r);
            }
            let primes = certain([p, q], third, &claim)?;
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

/// Primes that agree on the verdicts, with the bound on an error of all together; refused above `CERTAIN`.
fn certain(two: [Field; 2], third: Option<Field>, claim: &RankClaim) -> Result<ByPrimes, ModelError> {
    let error_bound = bound_in(claim, if third.is_some() { 3 } else { 2 });
    if error_bound > CERTAIN {
        return Err(refuse(format!(
            "undecided, because the powers in it are too high for primes of 61 bits: three agree, but a \
             verdict may be wrong with probability {error_bound:.0e}, where {CERTAIN:.0e} is expected at most"
        )));
    }
    let third = third.map(|f| f.modulus());
    Ok(ByPrimes { primes: two.map(|f| f.modulus()), third, error_bound })
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
