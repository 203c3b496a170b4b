//! Measurements that were left out one after the other, all off to the same side: a step of an output or a
//! platform that moved, and no outliers, which are independent of each other.

use obsdeg_core::span::Span;

use super::CalibrationError;
use super::diagnose::data::AnswerData;
use super::gross::{GrossReason, LeftOutCell};
use super::placed::channel_name;
use super::run::RecordedRun;
use crate::answer::{CalibrationFinding, Outlier};

/// Least number of measurements of a succession.
const FEWEST: usize = 4;
/// Largest number of steps, from bin to bin or from row to row, between two of them.
const APART: usize = 2;

/// Measurement that was left out.
#[derive(Debug, Clone)]
pub(super) struct LeftOutMeasurement {
    pub outlier: Outlier,
    position: usize,
    /// Index among the rows of its position or the bins of the run; `None` for a sample of a dense bin, where
    /// a succession moves no bin.
    place: Option<usize>,
}

impl AnswerData<'_> {
    /// Measurements that were left out: single cells, then samples of dense bins, then bins, each with its
    /// distance from the value expected without it.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    pub(super) fn left_out(&self) -> Result<Vec<LeftOutMeasurement>, CalibrationError> {
        let mut out = Vec::new();
        let channel = |c: usize| channel_name(self.planned.components[c]);
        for (run, x) in self.problem.runs.iter().zip(&self.estimate.at.x) {
            let reading = &run.reading;
            let outlier = |lines, t: f64, channel, sigmas| Outlier {
                record: reading.name.clone(),
                lines,
                t_s: reading.origin + t,
                channel,
                sigmas,
            };
            let at = |t: f64| reading.stays.iter().rposition(|stay| stay.from <= t).unwrap_or(0);
            for LeftOutCell { cell, column } in
                reading.cells.iter().filter(|c| c.cell.why == GrossReason::Far)
            {
                let outlier = outlier(cell.lines, cell.t, column.clone(), cell.sigmas);
                out.push(LeftOutMeasurement { position: at(cell.t), place: cell.row, outlier });
            }
            for s in &reading.spikes {
                let outlier = outlier(Span { from: s.line, to: s.line }, s.t, channel(s.channel), s.sigmas);
                out.push(LeftOutMeasurement { position: at(s.t), place: None, outlier });
            }
            if run.counts.iter().flatten().all(|counts| *counts) {
                continue;
            }
            let mut all: RecordedRun = run.clone();
            all.counts.iter_mut().flatten().for_each(|counts| *counts = true);
            let (along, _) = all.along(self.problem.conditions, &self.problem.sigmas, x)?;
            let each = run.measured().zip(along.residuals);
            for ((key, mean, bin), off) in each.filter(|((k, ..), _)| !run.counts[k.bin][k.channel]) {
                let sigma = self.problem.sigmas[key.channel];
                let own = (mean.variance * if mean.given { 1.0 } else { sigma * sigma }).sqrt();
                let outlier = outlier(bin.lines, bin.t, channel(key.channel), off / own);
                out.push(LeftOutMeasurement { position: key.position, place: Some(key.bin), outlier });
            }
        }
        Ok(out)
    }

    /// Findings on successions among the measurements that were left out.
    pub(super) fn successions(&self, left_out: &[LeftOutMeasurement]) -> Vec<CalibrationFinding> {
        let mut all: Vec<&LeftOutMeasurement> = left_out.iter().collect();
        let group =
            |l: &LeftOutMeasurement| (l.outlier.record.clone(), l.outlier.channel.clone(), l.position);
        all.sort_by_key(|l| (group(l), l.place));
        let together = |a: &&LeftOutMeasurement, b: &&LeftOutMeasurement| {
            let apart = a.place.zip(b.place).map(|(a, b)| b.abs_diff(a));
            group(a) == group(b)
                && apart.is_some_and(|steps| steps <= APART)
                && a.outlier.sigmas.signum() == b.outlier.sigmas.signum()
        };
        let found = all.chunk_by(together).filter(|run| run.len() >= FEWEST);
        found
            .map(|run| {
                let sigmas = || run.iter().map(|l| l.outlier.sigmas.abs());
                let end = |l: &LeftOutMeasurement| l.outlier.t_s;
                let sign = run[0].outlier.sigmas.signum();
                CalibrationFinding::Succession {
                    record: run[0].outlier.record.clone(),
                    position: self.scheme.positions[run[0].position].name.clone(),
                    channel: run[0].outlier.channel.clone(),
                    count: run.len(),
                    lines: Span { from: run[0].outlier.lines.from, to: run[run.len() - 1].outlier.lines.to },
                    span_s: Span { from: end(run[0]), to: end(run[run.len() - 1]) },
                    sigmas: Span {
                        from: sign * sigmas().fold(f64::INFINITY, f64::min),
                        to: sign * sigmas().fold(0.0, f64::max),
                    },
                }
            })
            .collect()
    }
}
