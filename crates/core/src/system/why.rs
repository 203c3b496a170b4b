//! Explanation of the verdict on one unknown of a model.

use obsdeg_exact::{RowSpace, Scalars};

use super::answer::data::{SystemAnalysis, SystemOptions};
use super::error::ModelError;
use super::gathered::{RunOutputRows, gather_runs};
use super::judge::verdicts::Judgement;
use super::judge::{judge_beside, judge_compiled};
use super::model::compiled::Compiled;
use super::model::{Constant, KnownInput, StateStart, SystemModel};
use super::remedies::improvements;
use super::rows::PointRows;
use super::values::Values;
use super::work::Spent;
use crate::remedies::Directions;
use crate::why::{
    Assumption, AssumptionKind, Component, Improvement, MOST_DECIDED, Otherwise, OutputDerivative,
    UnseenDirection, Why, by_cost, deciding_rows, too_many,
};

/// Largest number of assumptions that are tried.
const MOST_ASSUMPTIONS: usize = 48;

/// Explains the verdict on one unknown of a model that was analysed with these options; `None` if the model
/// has no unknown of this name.
///
/// # Errors
/// [`ModelError`].
pub fn explain_system(
    model: &SystemModel,
    found: &SystemAnalysis,
    name: &str,
    options: SystemOptions,
) -> Result<Option<Why>, ModelError> {
    let compiled = model.compile()?;
    let judged = judge_compiled(model, &compiled, options.seed, options.order)?;
    let unknowns = &judged.layout.unknowns;
    let column = unknowns.iter().position(|u| u.name == name);
    let Some(column) = column.filter(|&c| judged.shown(model, c)) else { return Ok(None) };
    let verdict = judged.verdict_on(column);
    let mut not_explained = Vec::new();
    let decided = match unknowns.len() {
        n if n > MOST_DECIDED => Err(too_many(n)),
        _ => decided(model, &compiled, &judged, column),
    };
    let (determined_by, unseen) = decided.unwrap_or_else(|reason| {
        not_explained.push(reason);
        Default::default()
    });
    let (assumptions, spent, not_tried) = assumptions(model, &judged, column, options.order);
    let mut verdicts = assumptions.iter().map(|a| a.otherwise.len()).sum();
    not_explained.extend(not_tried);
    let mut remedies = Vec::new();
    if verdict.degree != Some(0) {
        let (single, not_tried, count) = improvements(model, &judged, (column, spent), options.order);
        verdicts += count;
        not_explained.extend(not_tried);
        remedies = single;
    }
    if verdict.degree.is_none() && remedies.is_empty() {
        remedies = two(found, name);
    }
    by_cost(&mut remedies);
    let own = found.symmetries.iter().filter(|s| s.unknowns.iter().any(|n| n == name));
    Ok(Some(Why {
        name: name.into(),
        status: verdict.status,
        degree: verdict.degree,
        determined_by,
        unseen,
        symmetries: own.map(|s| s.words.clone()).collect(),
        assumptions,
        remedies,
        not_explained,
        verdicts,
    }))
}

/// Pairs of changes, as the analysis has tried them.
fn two(found: &SystemAnalysis, name: &str) -> Vec<Improvement> {
    let of = found.to_resolve.remedies.iter().filter(|r| r.changes.len() > 1).filter_map(|r| {
        let degree = r.resolves.iter().find(|x| x.name == name)?.degree;
        let resolves = r.resolves.iter().filter(|x| x.name != name).cloned().collect();
        Some(Improvement { changes: r.changes.clone(), degree, resolves, loses: r.loses.clone() })
    });
    of.collect()
}

/// Deciding derivatives, and the direction along which no lower ones change.
type Decided = (Vec<OutputDerivative>, Option<UnseenDirection>);

/// Deciding derivatives and unobserved direction at the first of two points, confirmed at the second.
///
/// # Errors
/// Reason for a missing explanation, in words.
fn decided(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    column: usize,
) -> Result<Decided, String> {
    let gathered = gather_runs(model, compiled, judged, 0);
    let (runs, _) = gathered.map_err(|e| format!("deciding derivatives: {}", e.message))?;
    let derivatives = |run: usize, output: usize, order: usize| OutputDerivative {
        output: model.outputs[output].0.name.clone(),
        order,
        place: place(model, run),
    };
    match runs {
        RunOutputRows::Primes([first, second]) => {
            at_two_points(judged, column, labelled(first), labelled(second), derivatives)
        }
        RunOutputRows::Digits(first, second) => {
            at_two_points(judged, column, labelled(first), labelled(second), derivatives)
        }
    }
}

/// Segment and experiment of a run; `None` if the model has one of each.
fn place(model: &SystemModel, run: usize) -> Option<String> {
    let segments = model.segments.len().max(1);
    let experiment = (model.experiments > 1).then(|| format!("experiment {}", run / segments + 1));
    let segment = (segments > 1).then(|| format!("segment {}", run % segments + 1));
    match (experiment, segment) {
        (Some(e), Some(s)) => Some(format!("{e}, {s}")),
        (one, other) => one.or(other),
    }
}

/// Rows of all runs at one point.
struct Labelled<S: Scalars> {
    field: S,
    columns: usize,
    /// Differentials of the constraints.
    known: Vec<Vec<S::Element>>,
    /// Run, output, order and row.
    rows: Vec<(usize, usize, usize, Vec<S::Element>)>,
}

impl<S: Scalars> Labelled<S> {
    /// The span of the constraints and of the rows up to an order.
    fn space(&self, order: usize) -> S::Space {
        let mut space = S::Space::new(self.field.clone(), self.columns);
        let rows = self.rows.iter().filter(|row| row.2 <= order).map(|row| &row.3);
        self.known.iter().chain(rows).for_each(|row| _ = space.insert(row));
        space
    }
}

fn labelled<S: Values>(runs: Vec<PointRows<S>>) -> Option<Labelled<S>> {
    let first = runs.first()?;
    let (field, columns) = (first.field.clone(), first.columns);
    let mut out = Labelled { field, columns, known: Vec::new(), rows: Vec::new() };
    for (run, rows) in runs.into_iter().enumerate() {
        out.known.extend(rows.known);
        for (output, own) in rows.outputs.into_iter().enumerate() {
            out.rows.extend(own.into_iter().map(|(order, row)| (run, output, order, row)));
        }
    }
    out.rows.sort_by_key(|row| row.2);
    Some(out)
}

fn at_two_points<S: Scalars, T: Scalars>(
    judged: &Judgement,
    column: usize,
    first: Option<Labelled<S>>,
    second: Option<Labelled<T>>,
    derivative: impl Fn(usize, usize, usize) -> OutputDerivative,
) -> Result<Decided, String> {
    let (Some(first), Some(second)) = (first, second) else { return Ok(Default::default()) };
    let degree = judged.verdict_on(column).degree;
    let differ = || "deciding derivatives: two random points do not agree".to_string();
    let mut chosen: Vec<usize> = Vec::new();
    if let Some(degree) = degree {
        let known: Vec<_> = first.known.iter().map(Vec::as_slice).collect();
        let upto = first.rows.iter().filter(|row| row.2 <= degree);
        let rows: Vec<_> = upto.map(|row| row.3.as_slice()).collect();
        chosen = deciding_rows(&first.field, &known, &rows, column).ok_or_else(differ)?;
        let label = |i: &usize| (first.rows[*i].0, first.rows[*i].1, first.rows[*i].2);
        let labels: Vec<_> = chosen.iter().map(label).collect();
        let mut space = T::Space::new(second.field.clone(), second.columns);
        second.known.iter().for_each(|row| _ = space.insert(row));
        let same = second.rows.iter().filter(|row| labels.contains(&(row.0, row.1, row.2)));
        same.for_each(|row| _ = space.insert(&row.3));
        if !space.has_unit(column) {
            return Err(differ());
        }
    }
    let named = |i: usize| derivative(first.rows[i].0, first.rows[i].1, first.rows[i].2);
    let derivatives = chosen.iter().map(|&i| named(i)).collect();
    let last = judged.findings.degrees.rank_profile.len().saturating_sub(1);
    let Some(order) = degree.map_or(Some(last), |k| k.checked_sub(1)) else {
        return Ok((derivatives, None));
    };
    let space = first.space(order);
    let support = Directions::of(first.field.clone(), &space).shortest(column).ok_or_else(differ)?;
    if !Directions::of(second.field.clone(), &second.space(order)).is_support(&support) {
        return Err(differ());
    }
    let sees = vector_on(&first.field, &space, &support);
    let seen = chosen.iter().filter(|&&i| Some(first.rows[i].2) == degree && sees(&first.rows[i].3));
    let seen_by = seen.map(|&i| named(i)).collect();
    let coefficient = (support.len() == 1).then(|| "1".to_string());
    let component = |&c: &usize| Component {
        name: judged.layout.unknowns[c].name.clone(),
        coefficient: coefficient.clone(),
    };
    let components = support.iter().map(component).collect();
    let at_every_order = degree.is_none() && !judged.rests_on_bound;
    Ok((derivatives, Some(UnseenDirection { up_to_order: order, at_every_order, components, seen_by })))
}

/// Says whether a row changes along the null vector of a space on its support.
fn vector_on<'a, S: Scalars>(
    field: &'a S,
    space: &S::Space,
    support: &'a [usize],
) -> impl Fn(&[S::Element]) -> bool + 'a {
    let mut short = S::Space::new(field.clone(), support.len());
    for i in 0..space.rank() {
        let row: Vec<S::Element> = support.iter().map(|&c| space.row(i)[c]).collect();
        short.insert(&row);
    }
    let vector = short.null_space().into_iter().next().unwrap_or_default();
    move |row| {
        let terms = support.iter().zip(&vector).map(|(&c, x)| (&row[c], x));
        !field.is_zero(&field.dot(&field.zero(), terms))
    }
}

/// Assumptions of the verdict on an unknown with the verdicts without them; the number of operations spent;
/// sentences on assumptions that were not tried.
fn assumptions(
    model: &SystemModel,
    judged: &Judgement,
    column: usize,
    order: Option<usize>,
) -> (Vec<Assumption>, u64, Vec<String>) {
    let name = &judged.layout.unknowns[column].name;
    let degree = judged.verdict_on(column).degree;
    let changes = relaxed(model);
    let (count, mut spent, mut out) = (changes.len(), Spent::default(), Vec::new());
    for (done, (kind, stated, condition, mut changed)) in changes.into_iter().enumerate() {
        let left = model.work_limit.operations().saturating_sub(spent.operations);
        if done == MOST_ASSUMPTIONS || left < judged.work {
            let text = format!("{} of {count} assumptions: at most {done} are tried", count - done);
            return (out, spent.operations, vec![text]);
        }
        changed.work_limit = model.work_limit.within(left.max(judged.work.saturating_mul(8)));
        let Ok(other) = judge_beside(judged, &changed, order, &mut spent) else { continue };
        let Some(verdict) = other.verdict(&changed, name) else { continue };
        let otherwise = vec![Otherwise { condition: condition.into(), degree: verdict.degree }];
        out.push(Assumption::new(kind, stated, otherwise, degree));
    }
    (out, spent.operations, Vec::new())
}

/// A model without one of its assumptions: kind and name of the assumption, and the condition instead.
type Relaxed = (AssumptionKind, String, &'static str, SystemModel);

/// The model without each of its assumptions.
fn relaxed(model: &SystemModel) -> Vec<Relaxed> {
    let model = &SystemModel { combinations: Vec::new(), ..model.clone() };
    let mut out: Vec<Relaxed> = Vec::new();
    for (i, (named, _)) in model.outputs.iter().enumerate().filter(|_| model.outputs.len() > 1) {
        let mut changed = model.clone();
        changed.outputs.remove(i);
        out.push((AssumptionKind::Output, named.name.clone(), "not measured", changed));
    }
    for (i, state) in model.states.iter().enumerate().filter(|s| s.1.start != StateStart::Unknown) {
        let mut changed = model.clone();
        changed.states[i].start = StateStart::Unknown;
        out.push((AssumptionKind::KnownStart, state.named.name.clone(), "unknown", changed));
    }
    let own_constant = |name: &String| {
        let segments = model.segments.iter().flat_map(|s| &s.constants);
        segments.chain(model.own.iter().flat_map(|e| &e.constants)).any(|c| c.0 == *name)
    };
    for (i, (named, kind)) in model.constants.iter().enumerate().filter(|c| !own_constant(&c.1.0.name)) {
        let stated = match kind {
            Constant::Generic => named.name.clone(),
            Constant::Value(value) => format!("{} = {}", named.name, value.text),
        };
        let mut changed = model.clone();
        changed.parameters.push(changed.constants.remove(i).0);
        out.push((AssumptionKind::KnownConstant, stated, "unknown", changed));
    }
    let own_input = |name: &String| model.own.iter().flat_map(|e| &e.known_inputs).any(|u| u.0 == *name);
    for (i, (named, kind)) in model.known_inputs.iter().enumerate().filter(|u| !own_input(&u.1.0.name)) {
        let degree = match kind {
            KnownInput::Polynomial(degree) => Some(*degree),
            KnownInput::Generic | KnownInput::Function(_) => None,
        };
        let mut changed = model.clone();
        changed.known_inputs.remove(i);
        changed.unknown_inputs.push((named.clone(), degree));
        out.push((AssumptionKind::KnownInput, named.name.clone(), "unknown", changed));
    }
    let mut texts = model.constraint_texts();
    // a product of factors is judged where one of them is zero
    texts.retain(|_| model.factors.is_empty());
    for text in texts {
        let mut changed = model.clone();
        changed.constraints.retain(|c| c.text != text);
        out.push((AssumptionKind::Constraint, text, "left out", changed));
    }
    out
}
