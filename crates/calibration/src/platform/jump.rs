//! Clock of a record that was set forward during the run: rows seem to be missing, and none is.

use std::cell::Cell;

use obsdeg_ekf::consistency::chi_square_band;
use obsdeg_evidence::simulation::PlatformState;

use super::estimate::{PlatformEstimate, PlatformProblem};
use super::placed::Reading;
use super::run::RecordedRun;
use super::timeline::RowGap;
use super::{CalibrationError, STRICT};

/// Most gaps of a record that are examined, the longest first.
const MOST: usize = 3;
/// Largest fraction of the sum of squares that a record may leave without its gap.
const EXPLAINED: f64 = 0.05;
/// Factor on the band of chi-square that single outliers may take.
const REMAINS: f64 = 1.2;
/// Step for finite differences of a jump, in intervals between rows.
const NEARBY: f64 = 0.25;
/// Number of improvements of a jump.
const ROUNDS: usize = 4;

/// Fit of the runs without a jump.
struct Closed {
    cost: f64,
    /// Number of degrees of freedom.
    free: f64,
    x: Vec<PlatformState>,
}

/// Gap of a record that is a jump of its clock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Jump {
    /// Index of the run and of its gap.
    pub run: usize,
    pub gap: usize,
    /// Time by which the clock was set forward, in s.
    pub by: f64,
    /// Chi-square per degree of freedom without the jump.
    pub chi_square: f64,
    /// True if the model explains the records without the jump.
    pub explains: bool,
}

impl PlatformProblem<'_> {
    /// Jump of a clock that explains most of an inconsistent fit, by a fit of all measurements without it.
    /// `start` is the first iterate of every run; `lay` places a reading on the timeline.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite in the fit as it is.
    pub(super) fn jump(
        &self,
        estimate: &PlatformEstimate,
        start: &[PlatformState],
        lay: &dyn Fn(Reading) -> Result<RecordedRun, CalibrationError>,
    ) -> Result<Option<Jump>, CalibrationError> {
        let free = (self.rows(estimate) - self.unknowns.n as f64).max(1.0);
        let most = chi_square_band(free, 1.0, STRICT).1;
        if estimate.at.cost <= most || self.stopped.get() {
            return Ok(None);
        }
        let mut best: Option<(f64, Jump)> = None;
        for (run, own) in self.runs.iter().enumerate() {
            let mut gaps: Vec<usize> = (0..own.reading.gaps.len()).collect();
            let length = |g: &usize| own.reading.gaps[*g].to - own.reading.gaps[*g].from;
            gaps.sort_by(|a, b| length(b).total_cmp(&length(a)));
            for &gap in gaps.iter().take(MOST) {
                let Some((by, found)) = self.closed(run, gap, estimate.at.cost / 2.0, start, lay) else {
                    continue;
                };
                let falls = found.cost <= most.max(EXPLAINED * estimate.at.cost);
                if falls && best.as_ref().is_none_or(|(cost, _)| found.cost < *cost) {
                    // single outliers are found later
                    let explains = found.cost <= REMAINS * chi_square_band(found.free, 1.0, STRICT).1;
                    let chi_square = found.cost / found.free;
                    best = Some((found.cost, Jump { run, gap, by, chi_square, explains }));
                }
            }
        }
        Ok(best.map(|(_, jump)| jump))
    }

    /// Fit of all runs with all measurements where the clock of run `r` was set forward in a gap, with the
    /// time by which it was: the gap leaves that open by about an interval between rows, which is resolved if
    /// the sum of squares is below `most`.
    fn closed(
        &self,
        r: usize,
        gap: usize,
        most: f64,
        start: &[PlatformState],
        lay: &dyn Fn(Reading) -> Result<RecordedRun, CalibrationError>,
    ) -> Option<(f64, Closed)> {
        let reading = &self.runs[r].reading;
        let (gap, interval) = (&reading.gaps[gap], reading.interval);
        let mut runs = self.runs.to_vec();
        runs.iter_mut().flat_map(|run| &mut run.counts).for_each(|bin| bin.fill(true));
        let mut fit = |by: f64, x: &[PlatformState], first: bool| -> Option<Closed> {
            runs[r] = lay(reading.without(gap, by)).ok()?;
            let problem = PlatformProblem {
                runs: &runs,
                conditions: self.conditions,
                unknowns: self.unknowns,
                sigmas: self.sigmas.clone(),
                known: self.known.clone(),
                progress: self.progress,
                passes: Cell::new(self.passes.get()),
                stopped: Cell::new(self.stopped.get()),
            };
            let found = problem.estimate(x.to_vec(), first).ok();
            self.passes.set(problem.passes.get());
            self.stopped.set(problem.stopped.get());
            let found = found.filter(|f| f.converged && !self.stopped.get())?;
            Some(Closed {
                cost: found.at.cost,
                free: (problem.rows(&found) - self.unknowns.n as f64).max(1.0),
                x: found.at.x,
            })
        };
        // the first row behind the gap follows after about one interval
        let mut by = gap.to - gap.from - interval;
        let mut found = fit(by, start, true)?;
        let mut step = NEARBY * interval;
        // a jump in the middle of a turn may leave a large part to the better time
        let rounds = if found.cost < most { ROUNDS } else { 0 };
        for _ in 0..rounds {
            let beside = [-step, step].map(|d| fit(by + d, &found.x, false));
            let [Some(low), Some(high)] = beside else { break };
            let curvature = low.cost - 2.0 * found.cost + high.cost;
            let off = step * (low.cost - high.cost) / (2.0 * curvature);
            let off = if curvature > 0.0 { off.clamp(-interval, interval) } else { 0.0 };
            let vertex = fit(by + off, &found.x, false).map(|c| (by + off, c));
            let others = [(by - step, low), (by + step, high)].into_iter().chain(vertex);
            let least = others.min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
            if let Some(better) = least.filter(|(_, c)| c.cost < found.cost) {
                (by, found) = better;
            }
            step /= 2.0;
        }
        Some((by, found))
    }
}

impl Reading {
    /// Reading by a clock that was not set forward by `by` s in a gap.
    fn without(&self, gap: &RowGap, by: f64) -> Self {
        let mut out = self.clone();
        let behind = (gap.from + gap.to) / 2.0 - self.origin;
        let set = |t: &mut f64| {
            if *t > behind {
                *t -= by;
            }
        };
        out.bins.iter_mut().flatten().for_each(|bin| set(&mut bin.t));
        out.stays.iter_mut().for_each(|stay| {
            set(&mut stay.from);
            set(&mut stay.to);
        });
        out.after.iter_mut().for_each(set);
        out
    }
}
