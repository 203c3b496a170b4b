//! Rows of every output separately, each output followed to the end of its own rows. They contain the rows
//! of any set of outputs.
//!
//! Let `V_k(y)` be the span of the rows of output y up to order k. `V_k(S)` of a set S is the sum of
//! `V_k(y)` over its outputs. So a row of y in the span of rows of y of no higher order adds nothing to any
//! set: it is left out.

use obsdeg_exact::{RankMargin, RowSpace, Scalars, SplitMix64};

use super::super::model::SystemModel;
use super::super::model::compiled::Compiled;
use super::super::taylor::Singular;
use super::super::values::Values;
use super::super::work::{Work, WorkStep, product};
use super::layout::Layout;
use super::point::PointBuilder;
use super::run::{cost_of, rows_of};
use super::{AdditionalRuns, SystemRows};

/// Rows of an output: order, and differential of a derivative by the unknowns.
pub(crate) type OwnRows<S> = Vec<(usize, Vec<<S as Scalars>::Element>)>;

/// Rows of all outputs at one random point.
#[derive(Debug, Clone)]
pub struct PointRows<S: Scalars> {
    /// Field of the rows.
    pub field: S,
    /// Number of unknowns, the length of a row.
    pub columns: usize,
    /// Differentials of the constraints, which count as rows of order 0 of every set.
    pub known: Vec<Vec<S::Element>>,
    /// Rows per experiment and output, those of the first experiment first; of each low orders first, without
    /// those that depend on other rows of no higher order of the same output and run.
    pub outputs: Vec<OwnRows<S>>,
    /// True if the end of the rows of every output is proven.
    pub ended: bool,
    /// Margin of the rank decisions.
    pub gap: RankMargin,
}

impl<'a, S: Values> SystemRows<'a, S> {
    /// Rows of a system at a random point, prepared for output-by-output collection.
    ///
    /// # Errors
    /// [`Singular`], as for [`SystemRows::new`].
    pub(in crate::system) fn apart(
        model: &SystemModel,
        compiled: &'a Compiled,
        layout: &Layout,
        field: S,
        rng: &mut SplitMix64,
        work: &'a Work,
    ) -> Result<Self, Singular> {
        let builder = PointBuilder { model, compiled, layout, field, work };
        Self::drawn(&builder, work, rng, AdditionalRuns { others: 0, apart: true })
    }

    /// All rows of every output, run by run; `None` if `work` refused them.
    pub(in crate::system) fn by_run(mut self) -> Option<Vec<PointRows<S>>> {
        let (field, columns) = (self.field.clone(), self.components);
        let mut out = Vec::with_capacity(self.runs.len());
        for run in 0..self.runs.len() {
            let mut all = S::Space::new(field.clone(), columns);
            let mut known = self.runs[run].known.clone();
            known.retain(|row| all.insert(row));
            let (mut outputs, mut ended) = (vec![OwnRows::<S>::new(); self.runs[run].outputs.len()], true);
            let spaces = self.follow(run, &mut outputs, &mut ended)?;
            let gap = spaces.iter().fold(self.gap.and(all.gap()), |gap, space| gap.and(space.gap()));
            out.push(PointRows { field: field.clone(), columns, known, outputs, ended, gap });
        }
        Some(out)
    }

    /// Adds the rows of a run to those of its outputs. Returns their spans in this run; `None` if the work
    /// exceeds its limit.
    fn follow(&mut self, run: usize, outputs: &mut [OwnRows<S>], ended: &mut bool) -> Option<Vec<S::Space>> {
        let (work, bound) = (self.work, self.bound);
        let run = &mut self.runs[run];
        let mut spaces = vec![S::Space::new(self.field.clone(), self.components); outputs.len()];
        spaces.iter_mut().for_each(|space| run.known.iter().for_each(|row| _ = space.insert(row)));
        let mut done = vec![false; outputs.len()];
        for order in 0..=bound {
            if done.iter().all(|done| *done) {
                break;
            }
            let sweeps = run.adjoint.as_ref().map(|a| a.sweeps(order));
            if !work.spend(order, &cost_of(&run.taylor, sweeps, outputs.len())) {
                return None;
            }
            let rows = rows_of(&mut run.taylor, run.adjoint.as_mut(), run.outputs, order);
            for (i, row) in rows.into_iter().enumerate() {
                if done[i] {
                    continue;
                }
                let before = spaces[i].refined();
                let grew = spaces[i].insert(&row);
                let again = (spaces[i].refined() - before).saturating_mul(product::<S::Element>());
                work.take(WorkStep::Derivatives(order), again, 0).ok()?;
                done[i] = run.end.is_reached(i, order, grew, spaces[i].rank());
                if grew {
                    outputs[i].push((order, row));
                }
            }
        }
        *ended &= done.iter().all(|done| *done);
        Some(spaces)
    }
}

impl<S: Scalars> PointRows<S> {
    /// The rows of several runs together: per experiment of `segments` runs, and output, by their order.
    pub(in crate::system) fn merged(runs: Vec<Self>, segments: usize) -> Option<Self> {
        let first = runs.first()?;
        let (field, columns) = (first.field.clone(), first.columns);
        let mut all = S::Space::new(field.clone(), columns);
        let known = runs.iter().flat_map(|run| &run.known).filter(|row| all.insert(row)).cloned().collect();
        let gap = runs.iter().fold(all.gap(), |gap, run| gap.and(run.gap));
        let ended = runs.iter().all(|run| run.ended);
        let mut outputs = vec![OwnRows::<S>::new(); first.outputs.len() * (runs.len() / segments)];
        for (run, rows) in runs.into_iter().enumerate() {
            let experiment = run / segments;
            let own = outputs.iter_mut().skip(experiment * rows.outputs.len());
            own.zip(rows.outputs).for_each(|(all, rows)| all.extend(rows));
        }
        outputs.iter_mut().for_each(|rows| rows.sort_by_key(|(order, _)| *order));
        Some(Self { field, columns, known, outputs, ended, gap })
    }
}
