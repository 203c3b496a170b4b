//! Degrees at one random point of a field, and the errors of a model without a value there.

use obsdeg_exact::{RankMargin, RowSpace, SplitMix64};

use super::super::branches::{Signs, sided};
use super::super::constraints::slots_of;
use super::super::error::ModelError;
use super::super::function_factors::ModelFactors;
use super::super::model::compiled::{Compiled, Role};
use super::super::model::{StartTime, SystemModel};
use super::super::real_points::dependent_at_points;
use super::super::rows::SystemRows;
use super::super::rows::layout::Layout;
use super::super::taylor::Singular;
use super::super::values::Values;
use super::super::work::{Spent, Work, WorkStep, product};
use crate::degree::filtration::{Degrees, climb};
use crate::degree::rows::DerivativeRows;
use crate::degree::status::{Status, Verdict};
use crate::language::Function;

/// Degrees at one random point.
pub(crate) struct PointDegrees<S: Values> {
    pub(crate) degrees: Degrees,
    pub(crate) combinations: Vec<Verdict>,
    /// Span of all rows.
    pub(crate) span: S::Space,
    /// Value of every unknown at the point, then of the nodes of [`ModelFactors`].
    pub(crate) values: Vec<S::Element>,
    /// True if the last order is proven to be the last.
    pub(super) ended: bool,
    /// True if the point is generic, so that an order that adds nothing is the last.
    pub(super) closed: bool,
    pub(super) gap: RankMargin,
    pub(super) steps: OrderedRows<S>,
    /// Signs of the arguments of abs and sign.
    pub(super) signs: Signs,
}

/// New rows of `V_0, V_1, ...`, order by order, each zero at the pivots of those before.
pub(super) struct OrderedRows<S: Values> {
    pub(super) field: S,
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
pub(in crate::system) fn singular<S: Values>(
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

pub(in crate::system) fn refuse(message: String) -> ModelError {
    ModelError { what: "the model".into(), message, span: None }
}

impl<S: Values> PointDegrees<S> {
    pub(super) fn agrees<T: Values>(&self, other: &PointDegrees<T>) -> bool {
        (&self.degrees, &self.combinations, self.ended) == (&other.degrees, &other.combinations, other.ended)
    }
}
