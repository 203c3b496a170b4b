//! Findings against a model and its sigmas, the most serious first. An answer with a finding is inconsistent.
//!
//! Tests have shares of the probability of a false alarm (`levels`); a finding with a certain cause has none.
//! Sentences and recommended actions are in the crate `report` (`calibration_findings`, `review/actions`).

use obsdeg_core::span::Span;
use obsdeg_ekf::consistency::chi_square_quantile;

use super::diagnose::data::AnswerData;
use super::gross::{GrossReason, LeftOutCell};
use super::length::wrong;
use super::run::RecordedRun;
use super::successions::LeftOutMeasurement;
use crate::answer::{
    Calibration, CalibrationFinding, CellKind, ClockRate, ForceLength, PositionFit, RecordReport,
};
use crate::least_squares::PriorRows;
use crate::levels;

/// Largest difference of the two paths, in sigma, that counts as agreement.
const AGREE: f64 = 1e-6;
/// Ratio to the median of the positions from which a position with a worse fit is named.
const APART: f64 = 2.0;

impl AnswerData<'_> {
    /// Findings against a calibration, with the measurements that it left out.
    pub(super) fn findings(
        &self,
        c: &Calibration,
        left_out: &[LeftOutMeasurement],
    ) -> Vec<CalibrationFinding> {
        let jump = self.clock_jump();
        if let Some(jump) = jump.clone().filter(|_| self.jump.is_some_and(|j| j.explains)) {
            // everything else is by times that are wrong
            let interrupted = self.interrupted.then_some(CalibrationFinding::Interrupted);
            return interrupted.into_iter().chain([jump]).collect();
        }
        let mut out = Vec::new();
        if self.interrupted {
            out.push(CalibrationFinding::Interrupted);
        } else if !self.estimate.converged {
            out.push(CalibrationFinding::NotSettled);
        }
        out.extend(jump);
        if !self.planned.platform.observed().accelerometers {
            out.extend(self.problem.runs.iter().filter_map(|run| self.force(run)));
        }
        out.extend(self.problem.runs.iter().flat_map(cells));
        out.extend(self.copies());
        out.extend(self.successions(left_out));
        out.extend(self.problem.runs.iter().filter_map(|run| self.turns(run)));
        out.extend(c.records.iter().filter_map(|record| clock(record, c)));
        out.extend(self.fits(c));
        out.extend(self.findings_of_channels(c));
        out.extend(
            self.too_many.map(|count| CalibrationFinding::Outliers { count, of: self.found.all.len() }),
        );
        if let Some(r) = c.repeatability.as_ref().filter(|r| r.chi_square > r.band.to) {
            out.push(CalibrationFinding::Repeatability { chi_square: r.chi_square });
        }
        if let Some(chi_square) = self.known_misfit() {
            out.push(CalibrationFinding::Known { chi_square });
        }
        out.extend(c.omitted.suspicion.as_ref().map(|s| CalibrationFinding::Suspect {
            errors: s.errors.iter().map(|e| e.name.clone()).collect(),
            chi_square_fall: s.chi_square_fall,
        }));
        let difference = c.second_path.difference.max(c.second_path.sigma_difference);
        if difference.is_nan() || difference > AGREE {
            out.push(CalibrationFinding::SecondPath { difference });
        }
        out
    }

    /// Findings on the residuals of single channels, of every record.
    fn findings_of_channels(&self, c: &Calibration) -> Vec<CalibrationFinding> {
        let tests = (c.records.len() * c.channels.len()) as f64;
        let mut out = Vec::new();
        for (r, record) in c.records.iter().enumerate() {
            for (k, channel) in c.channels.iter().enumerate() {
                if let Some(probability) =
                    self.whiteness(r, k).filter(|p| p.is_nan() || p * tests < levels::CORRELATED)
                {
                    let (record, channel) = (record.name.clone(), channel.channel.clone());
                    out.push(CalibrationFinding::Correlated { record, channel, probability });
                }
                if let Some(w) = self.warmth(r, k).filter(|w| w.probability * tests < levels::TEMPERATURE) {
                    out.push(CalibrationFinding::Temperature {
                        record: record.name.clone(),
                        channel: channel.channel.clone(),
                        correlation: w.correlation,
                        probability: w.probability,
                    });
                }
            }
        }
        out
    }

    /// Finding on a clock that was set forward during the run.
    fn clock_jump(&self) -> Option<CalibrationFinding> {
        let jump = self.jump?;
        let reading = &self.problem.runs[jump.run].reading;
        let gap = reading.gaps(self.scheme).swap_remove(jump.gap);
        Some(CalibrationFinding::ClockJump {
            record: reading.name.clone(),
            line: gap.line,
            place: gap.place,
            from_s: gap.from_s,
            by_s: jump.by,
            chi_square: jump.chi_square,
            explains: jump.explains,
        })
    }

    /// Finding on the turns of a run. Where positions last longer by the same factor, the clock is wrong.
    fn turns(&self, run: &RecordedRun) -> Option<CalibrationFinding> {
        let factor = run.reading.of_turns(self.planned)?;
        if run.reading.by_durations(self.planned).is_some() {
            return None;
        }
        let rate = self.problem.conditions.slew_rate_deg_s.map(|rate| rate / factor);
        Some(CalibrationFinding::Turns { record: run.reading.name.clone(), factor, slew_rate_deg_s: rate })
    }

    /// Finding on the length of the specific force of a run.
    fn force(&self, run: &RecordedRun) -> Option<CalibrationFinding> {
        let reading = &run.reading;
        let wrong = wrong(&reading.lengths, levels::FORCE / self.problem.runs.len() as f64)?;
        let end = |p: usize| ForceLength {
            position: self.scheme.positions[p].name.clone(),
            length_g: reading.lengths[p].map_or(f64::NAN, |l| l.length),
        };
        Some(CalibrationFinding::Force {
            record: reading.name.clone(),
            length_g: reading.force.unwrap_or(f64::NAN),
            alike: wrong.alike,
            least: end(wrong.ends[0]),
            most: end(wrong.ends[1]),
            causes: wrong.causes,
        })
    }

    /// Findings on the fit: single positions, or the noise, or single components.
    fn fits(&self, c: &Calibration) -> Vec<CalibrationFinding> {
        let all: Vec<&PositionFit> = c.positions.iter().filter(|p| p.degrees_of_freedom > 0.5).collect();
        let most = |dof: f64| chi_square_quantile(dof, 1.0 - levels::POSITION / all.len() as f64) / dof;
        let mut chi: Vec<f64> = all.iter().map(|p| p.chi_square).collect();
        chi.sort_by(f64::total_cmp);
        let usual = chi.get(chi.len().saturating_sub(1) / 2).copied().unwrap_or(1.0);
        let mut apart: Vec<&&PositionFit> = all
            .iter()
            .filter(|p| p.chi_square > most(p.degrees_of_freedom))
            .filter(|p| p.chi_square > APART * usual.min(c.fit.band.to.max(1.0)))
            .collect();
        apart.sort_by(|a, b| b.chi_square.total_cmp(&a.chi_square));
        let named = apart.iter().map(|p| CalibrationFinding::Position {
            record: p.record.clone(),
            position: p.position.clone(),
            chi_square: p.chi_square,
            factor: p.chi_square.sqrt(),
        });
        let mut out: Vec<CalibrationFinding> =
            if usual > APART && apart.iter().all(|p| p.chi_square < APART * usual) {
                Vec::new()
            } else {
                named.collect()
            };
        if !out.is_empty() {
            return out;
        }
        let total = c.fit.factor * c.fit.factor;
        if !c.fit.band.contains(&total) {
            out.push(CalibrationFinding::Noise { chi_square: total, factor: c.fit.factor });
            return out;
        }
        for channel in &c.channels {
            let (dof, level) = (channel.degrees_of_freedom, levels::CHANNEL / c.channels.len() as f64);
            let band = levels::band(dof.max(1e-3), level);
            if !band.contains(&channel.chi_square) {
                out.push(CalibrationFinding::Channel {
                    channel: channel.channel.clone(),
                    chi_square: channel.chi_square,
                    factor: channel.chi_square.sqrt(),
                });
            }
        }
        out
    }

    /// Chi-square of the prior information against the estimate; `None` within its band.
    fn known_misfit(&self) -> Option<f64> {
        let PriorRows { rows, values } = self.problem.known.as_ref()?;
        let dof = values.len() as f64;
        let left = values - rows * self.problem.values(&self.estimate.at.x);
        let chi = left.norm_squared() / dof;
        (chi > chi_square_quantile(dof, 1.0 - levels::KNOWN) / dof).then_some(chi)
    }
}

/// Findings on repeated values of cells in a column.
fn cells(run: &RecordedRun) -> Vec<CalibrationFinding> {
    let mut out: Vec<CalibrationFinding> = Vec::new();
    for LeftOutCell { cell, column: own } in &run.reading.cells {
        let kind = match cell.why {
            GrossReason::Far => continue,
            GrossReason::Code => CellKind::Code,
            GrossReason::Stuck => CellKind::Stuck,
        };
        let same = out.iter_mut().find_map(|f| match f {
            CalibrationFinding::Cells { column, kind_of_cells, value, count, lines, .. }
                if column == own && *kind_of_cells == kind && *value == cell.value =>
            {
                Some((count, lines))
            }
            _ => None,
        });
        match same {
            Some((count, lines)) => {
                *count += 1;
                *lines = Span { from: lines.from.min(cell.lines.from), to: lines.to.max(cell.lines.to) };
            }
            None => out.push(CalibrationFinding::Cells {
                record: run.reading.name.clone(),
                column: own.clone(),
                kind_of_cells: kind,
                value: cell.value,
                count: 1,
                lines: cell.lines,
            }),
        }
    }
    out
}

/// Finding on the clock of a record: significant by its changes of position or by the rate of the earth, with
/// sigmas as the fit has them; or by the durations of positions, where a clock would change a drift by more
/// than its sigma. If the rate of the earth shows a right clock, positions were only held longer or shorter
/// than in the scheme, and there is no finding.
fn clock(record: &RecordReport, c: &Calibration) -> Option<CalibrationFinding> {
    // two tests
    let level = levels::CLOCK / (2 * c.records.len()) as f64;
    let most = chi_square_quantile(1.0, 1.0 - level).sqrt() * c.fit.factor.max(1.0);
    let beyond = |by: &Option<ClockRate>, from: f64| {
        by.as_ref().is_some_and(|e| (e.fast - from).abs() > most * e.sigma)
    };
    let clock = &record.clock;
    let held = clock.by_durations.is_some_and(|fast| beyond(&clock.by_earth, fast));
    let [changes, earth] =
        [&clock.by_changes, &clock.by_earth].map(|by| by.clone().filter(|_| beyond(by, 0.0)));
    let rates = c.quantities.iter().filter(|q| q.unit.starts_with("deg/h"));
    let sigmas = rates.filter_map(|q| Some((q.estimate? / q.sigma?).abs())).fold(0.0, f64::max);
    let matters = clock.by_durations.is_some_and(|fast| fast.abs() * sigmas > 1.0);
    (changes.is_some() || earth.is_some() || matters && !held).then(|| CalibrationFinding::Clock {
        record: record.name.clone(),
        by_durations: clock.by_durations,
        by_durations_sigma: clock.by_durations_sigma,
        by_changes: changes,
        by_earth: earth,
    })
}
