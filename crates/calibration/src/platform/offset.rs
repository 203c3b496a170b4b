//! The moment at which the scheme begins by the clock of a record, where labels leave it open: drift differs
//! from position to position, so a beginning that is wrong by some seconds shows at every change of position.
//!
//! The sum of squares that is left when all unknowns follow is a parabola of that moment. Labels bound it: it
//! is uniform between these bounds beforehand, which is taken as a normal distribution of the same variance.

use nalgebra::DVector;
use obsdeg_ekf::consistency::chi_square_band;

use super::estimate::{Estimate, Problem, WEAK};
use super::observe::{By, Reading};
use super::run::Run;
use super::{CalibrationError, STRICT};
use crate::least_squares::Information;

/// Part of the open interval by which the beginning is moved to see what that does.
const MOVED: f64 = 0.02;
/// Part of its sigma within which the beginning has settled.
pub(super) const SETTLED: f64 = 0.1;
/// Standard deviations from which on a beginning that is not that of the scheme's clock is believed.
const BELIEVED: f64 = 4.0;

/// Such a beginning leaves less than this part of the sum of squares: far from it the parabola is not all.
const EXPLAINED: f64 = 0.2;

/// A better beginning of a run.
#[derive(Debug, Clone)]
pub(super) struct Offset {
    /// Shift of the beginning, in s; positive is later.
    pub by: f64,
    /// Its standard deviation, in s.
    pub sigma: f64,
    /// The sum of squares that is left there.
    pub left: f64,
    /// Change of all unknowns per second of shift.
    pub direction: DVector<f64>,
}

/// Change of the measurements of a run with its beginning, unknowns as they are.
#[derive(Debug, Clone)]
pub(super) struct Later {
    /// Change of every residual per second, in the order of the rows.
    pub column: Vec<f64>,
    /// Weight of the labels: one over the variance that they leave the beginning, in 1/s^2.
    pub weight: f64,
}

impl Problem<'_> {
    /// The beginning of run `r` that fits best between `from` and `to` (s of its clock) when all unknowns
    /// follow; `lay` lays a reading on the timeline.
    ///
    /// # Errors
    /// [`CalibrationError`] when a number is none.
    pub(super) fn offset(
        &self,
        estimate: &Estimate,
        r: usize,
        (from, to): (f64, f64),
        lay: &dyn Fn(Reading) -> Result<Run, CalibrationError>,
    ) -> Result<Offset, CalibrationError> {
        let (own, at) = (&self.runs[r], &estimate.at);
        let (middle, width) = ((from + to) / 2.0, (to - from) / 12f64.sqrt());
        let step = MOVED * (to - from);
        let left = |by: f64| -> Result<(f64, DVector<f64>), CalibrationError> {
            let mut run = lay(own.reading.later(by))?;
            run.counts.clone_from(&own.counts);
            let (along, _) = run.along(self.conditions, &self.sigmas, &at.x[r])?;
            let information = Information::of(&along)?;
            let solution = self.step_with(at, WEAK, Some((r, &information)))?;
            let before = ((own.reading.origin + by - middle) / width).powi(2);
            Ok((information.left + solution.left + before, solution.x))
        };
        let [(low, x), (same, _), (high, y)] = [left(-step)?, left(0.0)?, left(step)?];
        // at least what the labels say
        let curvature = ((low - 2.0 * same + high) / (step * step)).max(2.0 / (width * width));
        let slope = (high - low) / (2.0 * step);
        let best = -slope / curvature;
        let by = best.clamp(from - own.reading.origin, to - own.reading.origin);
        Ok(Offset {
            by,
            sigma: (2.0 / curvature).sqrt(),
            left: same + slope * by + curvature * by * by / 2.0,
            direction: (y - x) / (2.0 * step),
        })
    }

    /// The beginnings that labels leave open, by run.
    ///
    /// # Errors
    /// As [`Self::offset`].
    pub(super) fn open(
        &self,
        estimate: &Estimate,
        lay: &dyn Fn(Reading) -> Result<Run, CalibrationError>,
    ) -> Result<Vec<Option<Offset>>, CalibrationError> {
        let of = |(r, run): (usize, &Run)| {
            run.reading.open.map(|window| self.offset(estimate, r, window, lay)).transpose()
        };
        self.runs.iter().enumerate().map(of).collect()
    }

    /// Changes with the beginnings of the runs where labels leave them open. `None` too where a shift moves
    /// measurements to other bins.
    ///
    /// # Errors
    /// [`CalibrationError`] when a number is none.
    pub(super) fn later(
        &self,
        estimate: &Estimate,
        lay: &dyn Fn(Reading) -> Result<Run, CalibrationError>,
    ) -> Result<Vec<Option<Later>>, CalibrationError> {
        let of = |(r, own): (usize, &Run)| -> Result<Option<Later>, CalibrationError> {
            let Some((from, to)) = own.reading.open else { return Ok(None) };
            let step = MOVED * (to - from);
            let residuals = |by: f64| {
                let mut run = lay(own.reading.later(by))?;
                run.counts.clone_from(&own.counts);
                let (along, keys) = run.along(self.conditions, &self.sigmas, &estimate.at.x[r])?;
                Ok::<_, CalibrationError>((along.residuals, keys))
            };
            let [(low, keys), (high, others)] = [residuals(-step)?, residuals(step)?];
            let column = low.iter().zip(&high).map(|(low, high)| (high - low) / (2.0 * step)).collect();
            let same = keys == others && keys == estimate.at.runs[r].1;
            Ok(same.then(|| Later { column, weight: 12.0 / (to - from).powi(2) }))
        };
        self.runs.iter().enumerate().map(of).collect()
    }

    /// True if an inconsistent fit becomes consistent when run `r` begins elsewhere within one interval
    /// between rows.
    ///
    /// # Errors
    /// As [`Self::offset`].
    pub(super) fn begins_elsewhere(
        &self,
        estimate: &Estimate,
        r: usize,
        lay: &dyn Fn(Reading) -> Result<Run, CalibrationError>,
    ) -> Result<bool, CalibrationError> {
        let reading = &self.runs[r].reading;
        if reading.open.is_some() || !matches!(reading.by, By::Timeline | By::Both) {
            return Ok(false);
        }
        let free = (self.rows(estimate) - self.unknowns.n as f64).max(1.0);
        let most = chi_square_band(free, 1.0, STRICT).1;
        if estimate.at.cost <= most {
            return Ok(false);
        }
        let found = self.offset(
            estimate,
            r,
            (reading.origin - reading.interval, reading.origin + reading.interval),
            lay,
        )?;
        let explains = found.left <= most.max(EXPLAINED * estimate.at.cost);
        Ok(explains && found.by.abs() > BELIEVED * found.sigma)
    }
}
