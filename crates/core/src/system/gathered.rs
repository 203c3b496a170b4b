//! Rows of every output of a model at two points. Verdicts on any set of outputs are ranks of these rows.

use obsdeg_exact::certainty::{RankClaim, error_bound};
use obsdeg_exact::{Field, Reals, Scalars, SplitMix64};

use super::addition::written_apart;
use super::error::ModelError;
use super::judge::claim::claim_of;
use super::judge::point_degrees::{refuse, singular};
use super::judge::verdicts::{Judgement, SystemCertainty};
use super::judge::{FieldChoice, judge_compiled};
use super::model::SystemModel;
use super::model::compiled::Compiled;
use super::rows::layout::Layout;
use super::rows::{PointRows, SystemRows};
use super::values::Values;
use super::work::{Spent, Work};

/// Rows of every output of a model at two points, by the kind of numbers.
#[derive(Debug, Clone)]
pub enum OutputRows {
    /// Rows in two prime fields.
    Primes(Box<[PointRows<Field>; 2]>),
    /// Rows in real numbers of 192 and 308 digits.
    Digits(Box<(PointRows<Reals<10>>, PointRows<Reals<16>>)>),
}

/// Rows of every output of a model, and the verdicts on all outputs together.
#[derive(Debug, Clone)]
pub struct Gathered {
    /// Verdicts on all outputs together.
    pub judged: Judgement,
    /// Rows of the outputs.
    pub rows: OutputRows,
    /// Bound on the degree of one decision.
    claim: RankClaim,
    /// Number of decisions of the verdicts on one set of outputs.
    decisions: usize,
    /// Number of outputs of the model.
    outputs: usize,
}

impl Gathered {
    /// Bound on the probability that a verdict on one of `sets` sets of outputs is wrong although both prime
    /// fields agree; `None` in real numbers.
    pub fn error_bound(&self, sets: usize) -> Option<f64> {
        let decisions = self.decisions.saturating_mul(sets);
        let bound = || error_bound(&RankClaim { decisions, ..self.claim }, 2);
        matches!(self.rows, OutputRows::Primes(_)).then(bound)
    }

    /// True if an output of `measured` depends on an unknown, beyond what constraints and known starts tell.
    pub fn tells(&self, measured: &std::ops::Range<usize>) -> bool {
        fn any<S: Scalars>(rows: &PointRows<S>, outputs: usize, measured: &std::ops::Range<usize>) -> bool {
            rows.outputs
                .iter()
                .enumerate()
                .any(|(i, own)| measured.contains(&(i % outputs)) && !own.is_empty())
        }
        match &self.rows {
            OutputRows::Primes(points) => any(&points[0], self.outputs, measured),
            OutputRows::Digits(points) => any(&points.0, self.outputs, measured),
        }
    }

    /// True if the end of the rows of every output is proven.
    pub fn ended(&self) -> bool {
        match &self.rows {
            OutputRows::Primes(points) => points.iter().all(|p| p.ended),
            OutputRows::Digits(points) => points.0.ended && points.1.ended,
        }
    }
}

/// Rows of every output of a model at two points, run by run: of each segment of each experiment.
pub(super) enum RunOutputRows {
    /// In two prime fields.
    Primes([Vec<PointRows<Field>>; 2]),
    /// In real numbers of 192 and 308 digits.
    Digits(Vec<PointRows<Reals<10>>>, Vec<PointRows<Reals<16>>>),
}

/// Gathers the rows of every output of a judged model, run by run, and the order of the roots of unity of the
/// fields. `attempt` selects other points.
///
/// # Errors
/// [`ModelError`], of work beyond the limit too.
pub(super) fn gather_runs(
    model: &SystemModel,
    compiled: &Compiled,
    judged: &Judgement,
    attempt: usize,
) -> Result<(RunOutputRows, u64), ModelError> {
    let seed = judged.findings.seed;
    let layout = &judged.layout;
    match judged.certainty {
        SystemCertainty::Primes(_) => {
            let apart = if compiled.dag.is_rational() { None } else { written_apart(compiled) };
            let compiled = apart.as_ref().unwrap_or(compiled);
            let points = FieldChoice { model, compiled, layout, orders: layout.unknowns.len() };
            let mut spent = Spent::default();
            let mut at = |i: usize| {
                let name = format!("rows of outputs, attempt {attempt}, field {i}");
                let mut rng = model.random(seed, &name);
                let field =
                    points.field(&mut rng, &mut model.random(seed, &format!("{name}, points")), &mut spent);
                rows_at(model, compiled, layout, field, &mut rng)
            };
            Ok((RunOutputRows::Primes([at(0)?, at(1)?]), points.root_order()))
        }
        SystemCertainty::Digits(_) => {
            let mut rng = model.random(seed, &format!("rows of outputs, attempt {attempt}"));
            let first = rows_at(model, compiled, layout, Reals::<10>, &mut rng)?;
            Ok((RunOutputRows::Digits(first, rows_at(model, compiled, layout, Reals::<16>, &mut rng)?), 1))
        }
    }
}

/// Judges all outputs of a model together, and gathers the rows of each at two points. `attempt` selects
/// other points; `bound` overrides the highest order.
///
/// # Errors
/// [`ModelError`], also if the work exceeds its limit.
pub fn gather(
    model: &SystemModel,
    seed: u64,
    bound: Option<usize>,
    attempt: usize,
) -> Result<Gathered, ModelError> {
    let compiled = model.compile()?;
    let judged = judge_compiled(model, &compiled, seed, bound)?;
    let (runs, root_order) = gather_runs(model, &compiled, &judged, attempt)?;
    let segments = compiled.segments.len().max(1);
    let rows = match runs {
        RunOutputRows::Primes([first, second]) => {
            OutputRows::Primes(Box::new([merged(first, segments)?, merged(second, segments)?]))
        }
        RunOutputRows::Digits(first, second) => {
            OutputRows::Digits(Box::new((merged(first, segments)?, merged(second, segments)?)))
        }
    };
    let last = match &rows {
        OutputRows::Primes(points) => last_order(&points[0]),
        OutputRows::Digits(points) => last_order(&points.0),
    };
    let runs = segments * model.experiments.max(1);
    let unknowns = judged.layout.unknowns.len();
    let claim = RankClaim { order: root_order, ..claim_of(&compiled, &judged.layout, last + 1) };
    let decisions = (last + 2) * (1 + 2 * runs) + 2 * unknowns;
    Ok(Gathered { judged, rows, claim, decisions, outputs: model.outputs.len() })
}

fn merged<S: Values>(runs: Vec<PointRows<S>>, segments: usize) -> Result<PointRows<S>, ModelError> {
    PointRows::merged(runs, segments).ok_or_else(|| refuse("a model without outputs".into()))
}

/// Highest order of a row.
fn last_order<S: Values>(rows: &PointRows<S>) -> usize {
    rows.outputs.iter().filter_map(|own| own.last()).map(|row| row.0).max().unwrap_or(0)
}

fn rows_at<S: Values>(
    model: &SystemModel,
    compiled: &Compiled,
    layout: &Layout,
    field: S,
    rng: &mut SplitMix64,
) -> Result<Vec<PointRows<S>>, ModelError> {
    let work = Work::new(model.work_limit);
    let rows = SystemRows::apart(model, compiled, layout, field, rng, &work);
    match rows.map(SystemRows::by_run) {
        Ok(Some(rows)) => Ok(rows),
        Err(reason) if work.refused().is_none() => Err(singular::<S>(model, compiled, reason)),
        _ => Err(work.refused().unwrap_or_else(|| refuse("the limit of work".into()))),
    }
}
