//! Real points at which the constraints of a model hold: prime fields may have points where there is no real
//! one.

use obsdeg_exact::{Ball, Reals, SplitMix64};

use super::error::ModelError;
use super::held::{CLOSE, distinct, turned};
use super::intervals::range;
use super::model::SystemModel;
use super::model::compiled::Compiled;
use super::newton::{hold_by_newton, off, vanishing};
use super::rows::layout::Layout;
use super::rows::point::PointBuilder;
use super::taylor::{Signal, Singular, Taylor};
use super::values::{ConstraintFailure, Values};
use super::work::{Refused, Spent, Work};

/// Number of starts of Newton's method: first near the values of the file, then at random points of growing
/// size.
const TRIES: usize = 200;
/// Number of random attempts from one start to the next; their sizes grow.
const FARTHER: usize = 10;
/// Number of starts that reach only points with dependent gradients, before the search ends.
const DEPENDENT: usize = 20;
/// Number of points near a point at which constraints are tested for following from the others.
const NEARBY: usize = 3;
/// Relative residual, as a power of two, below which a constraint holds at such a point.
const HOLDS: f64 = -128.0;

/// Number of bits of the values of a file.
const DOUBLE: i64 = 52;

/// Outcome of one start.
enum StartOutcome {
    /// A point, and the number of constraints that follow from the others there.
    Point(usize),
    /// A point at which gradients of constraints are dependent, although the constraints are not.
    Dependent(usize),
    Nothing,
}

/// Searches for a real point at which all constraints hold and their gradients are independent. Returns the
/// number of constraints that follow from the others there.
///
/// # Errors
/// [`ModelError`] if the signs of both sides contradict, if constraints hold only at points with dependent
/// gradients, if no point was found, or if the search exceeds the limit of work.
pub(super) fn real_point(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    seed: u64,
    spent: &mut Spent,
) -> Result<usize, ModelError> {
    if model.constraints.is_empty() {
        return Ok(0);
    }
    signs(model, compiled)?;
    let work = Work::new(model.work_limit);
    let found = sought(model, compiled, layout, seed, &work);
    spent.add(&work);
    found
}

fn sought(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    seed: u64,
    work: &Work,
) -> Result<usize, ModelError> {
    let Some(first) = model.constraints.first() else { return Ok(0) };
    let builder = PointBuilder { model, compiled, layout, field: Reals::<4>, work };
    let mut rng = model.random(seed, "real points");
    let free = builder.free(0);
    let mut dependent: Vec<usize> = Vec::new();
    if builder.gives_start()
        && let Some(mut values) = builder.values(&mut rng.clone(), 0)
    {
        builder.near_given(0, &free, &mut values, DOUBLE, &mut rng.clone());
        if let Some(c) = vanishing(&compiled.dag, &compiled.constraints, &values, &free, work) {
            return Err(dependent_at_points(model, c));
        }
    }
    for attempt in 0..TRIES {
        let Some(mut values) = builder.values(&mut rng, attempt * FARTHER) else { continue };
        if let Some(&bits) = CLOSE.get(attempt) {
            builder.near_given(0, &free, &mut values, bits, &mut rng);
        }
        match from_start(&builder, values, &free, attempt, &mut rng) {
            Ok(StartOutcome::Point(following)) => return Ok(following),
            Ok(StartOutcome::Dependent(c)) => dependent.push(c),
            Ok(StartOutcome::Nothing) => {}
            Err(Refused) => break,
        }
        if dependent.len() >= DEPENDENT && dependent.len() > attempt / 2 {
            break;
        }
    }
    if let Some(&c) = dependent.first() {
        return Err(dependent_at_points(model, c));
    }
    work.refused().map_or(Ok(()), Err)?;
    let all = if model.constraints.len() > 1 { " together with the others" } else { "" };
    let message = format!(
        "no real point was found at which it holds{all}, by Newton's method from {TRIES} starts{}",
        match builder.gives_start() {
            true =>
                ", the first three near the values given under [simulation.values]; if there is one, give \
                 values nearer to it",
            false => "; if there is one, give it under [simulation.values]",
        }
    );
    Err(first.place.error(message, 0..first.text.len()))
}

/// Error for a constraint at whose points gradients are dependent.
pub(super) fn dependent_at_points(model: &SystemModel, c: usize) -> ModelError {
    let own = &model.constraints[c];
    let message = "at the points found at which it holds its gradient vanishes or depends on those of the \
                   other constraints, so that derivatives do not say what it leaves free; expected \
                   constraints with independent gradients (x = 0 and y = 0 in place of x^2 + y^2 = 0, and \
                   none that follows from the others)";
    own.place.error(message.into(), 0..own.text.len())
}

/// Refuses constraints that the signs of their sides contradict, or that hold only where their sides touch.
fn signs(model: &SystemModel, compiled: &Compiled) -> Result<(), ModelError> {
    for experiment in 0..compiled.experiments.len() {
        for (root, &node) in model.not_negative.iter().zip(&compiled.not_negative) {
            let refuse = |message: &str| Err(root.place.error(message.into(), 0..root.text.len()));
            match range(compiled, node, experiment) {
                right if right.high <= 0.0 && right.excludes_zero() => {
                    return refuse(
                        "no real point meets it: its right side is negative everywhere, which a root or norm never is",
                    );
                }
                right if right.high <= 0.0 => {
                    return refuse(
                        "it holds only where both sides are zero, because its right side is never positive \
                         and a root or norm never negative; expected these conditions as constraints of \
                         their own",
                    );
                }
                _ => {}
            }
        }
        for (own, &node) in model.constraints.iter().zip(&compiled.constraints) {
            let refuse = |message: String| Err(own.place.error(message, 0..own.text.len()));
            let difference = range(compiled, node, experiment);
            let (sign, bound) = match (difference.low >= 0.0, difference.high <= 0.0) {
                (true, _) => ("negative", difference.low),
                (_, true) => ("positive", difference.high),
                _ => continue,
            };
            if bound != 0.0 || difference.excludes_zero() {
                let sign = if sign == "negative" { "positive" } else { "negative" };
                return refuse(format!(
                    "no real point meets it: its left side minus its right side is {sign} everywhere"
                ));
            }
            return refuse(format!(
                "its left side minus its right side is never {sign}: where it holds, if anywhere, its \
                 gradient vanishes and says nothing; expected the conditions themselves as constraints (x \
                 = 0 and y = 0 in place of x^2 + y^2 = 0)"
            ));
        }
    }
    Ok(())
}

/// Newton's method from one start, and the kind of the point that it reaches.
fn from_start(
    builder: &PointBuilder<'_, '_, Reals<4>>,
    mut values: Vec<Ball<4>>,
    free: &[bool],
    attempt: usize,
    rng: &mut SplitMix64,
) -> Result<StartOutcome, Refused> {
    let compiled = builder.compiled;
    let (dag, all) = (&compiled.dag, turned(distinct(&compiled.constraints), attempt));
    let place = |c: usize| compiled.constraints.iter().position(|node| *node == all[c]).unwrap_or(0);
    match hold_by_newton(dag, &all, &mut values, free, builder.work) {
        Ok(()) => {}
        Err(ConstraintFailure::Constraint(_)) => return Ok(StartOutcome::Nothing),
        Err(ConstraintFailure::Dependent(c)) => return Ok(StartOutcome::Dependent(place(c))),
        Err(ConstraintFailure::Refused) => return Err(Refused),
    }
    if !are_not_negative(builder, &values) {
        return Ok(StartOutcome::Nothing);
    }
    let independent = match builder.independent(&all, &values, free) {
        Ok(independent) => independent,
        Err(Singular::Refused) => return Err(Refused),
        Err(_) => return Ok(StartOutcome::Nothing),
    };
    let Some(other) = (0..all.len()).find(|c| !independent.contains(c)) else {
        return Ok(StartOutcome::Point(0));
    };
    // the others hold wherever the independent ones do, or only at points like this one
    let kept: Vec<usize> = independent.iter().map(|&c| all[c]).collect();
    let others: Vec<usize> = (0..all.len()).filter(|c| !independent.contains(c)).map(|c| all[c]).collect();
    let follow = (0..NEARBY).all(|_| {
        let mut nearby: Vec<Ball<4>> = values.iter().map(Ball::midpoint).collect();
        for (x, _) in nearby.iter_mut().zip(free).filter(|(_, free)| **free) {
            *x = Reals::<4>.near(x.to_f64(), CLOSE[0], rng).unwrap_or(*x);
        }
        hold_by_newton(dag, &kept, &mut nearby, free, builder.work).is_ok()
            && off(dag, &others, &nearby, builder.work).is_some_and(|off| off < HOLDS)
    });
    Ok(if follow { StartOutcome::Point(others.len()) } else { StartOutcome::Dependent(place(other)) })
}

/// True if no root in a constraint would be negative at a point.
fn are_not_negative(builder: &PointBuilder<'_, '_, Reals<4>>, values: &[Ball<4>]) -> bool {
    let compiled = builder.compiled;
    let signals = values.iter().map(|value| Signal::Constant { value: *value, component: None }).collect();
    let (starts, seed) = (vec![None; values.len()], SplitMix64::new(0));
    let nodes = &compiled.not_negative;
    let at = Taylor::new(&compiled.dag, Reals::<4>, 0, signals, &starts, nodes, false, seed, builder.work);
    at.is_ok_and(|at| nodes.iter().all(|&node| !at.start(node).is_negative()))
}
