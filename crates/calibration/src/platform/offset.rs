//! Beginning of the scheme by the clock of a record, where labels leave it open. Drift differs from position
//! to position, so a beginning that is wrong by some seconds shows at every change of position.
//!
//! The sum of squares with all unknowns free is a parabola of the beginning. Labels bound it. Its prior is
//! uniform between these bounds, represented by a normal distribution of the same variance.

use nalgebra::DVector;
use obsdeg_core::span::Span;
use obsdeg_ekf::consistency::chi_square_band;

use super::estimate::{PlatformEstimate, PlatformProblem, WEAK};
use super::placed::{By, Reading};
use super::run::RecordedRun;
use super::{CalibrationError, STRICT};
use crate::least_squares::StartInformation;

/// Step for finite differences of the beginning, as a fraction of the open interval.
const MOVED: f64 = 0.02;
/// Largest change of a settled beginning, as a fraction of its sigma.
pub(super) const SETTLED: f64 = 0.1;
/// Significance, in standard deviations, from which a beginning other than that of the scheme's clock is
/// accepted.
const BELIEVED: f64 = 4.0;

/// Largest fraction of the sum of squares that such a beginning may leave: far from it the parabola is not
/// exact.
const EXPLAINED: f64 = 0.2;

/// Better beginning of a run.
#[derive(Debug, Clone)]
pub(super) struct Offset {
    /// Shift of the beginning, in s; positive is later.
    pub by: f64,
    /// Standard deviation of the shift, in s.
    pub sigma: f64,
    /// Sum of squares at the new beginning.
    pub left: f64,
    /// Change of all unknowns per second of shift.
    pub direction: DVector<f64>,
}

/// Change of the measurements of a run with its beginning, at fixed unknowns.
#[derive(Debug, Clone)]
pub(super) struct Later {
    /// Change of every residual per second, in the order of the rows.
    pub column: Vec<f64>,
    /// Weight of the labels: inverse variance of the beginning by the labels alone, in 1/s^2.
    pub weight: f64,
}

impl PlatformProblem<'_> {
    /// Best beginning of run `r` between `from` and `to` (s of its clock) with all unknowns free; `lay`
    /// places a reading on the timeline.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    pub(super) fn offset(
        &self,
        estimate: &PlatformEstimate,
        r: usize,
        window: Span<f64>,
        lay: &dyn Fn(Reading) -> Result<RecordedRun, CalibrationError>,
    ) -> Result<Offset, CalibrationError> {
        let (own, at) = (&self.runs[r], &estimate.at);
        let (middle, width) = (window.middle(), window.length() / 12f64.sqrt());
        let step = MOVED * window.length();
        let left = |by: f64| -> Result<(f64, DVector<f64>), CalibrationError> {
            let mut run = lay(own.reading.later(by))?;
            run.counts.clone_from(&own.counts);
            let (along, _) = run.along(self.conditions, &self.sigmas, &at.x[r])?;
            let information = StartInformation::of(&along)?;
            let solution = self.step_with(at, WEAK, Some((r, &information)))?;
            let before = ((own.reading.origin + by - middle) / width).powi(2);
            Ok((information.left + solution.left + before, solution.x))
        };
        let [(low, x), (same, _), (high, y)] = [left(-step)?, left(0.0)?, left(step)?];
        // at least the information of the labels
        let curvature = ((low - 2.0 * same + high) / (step * step)).max(2.0 / (width * width));
        let slope = (high - low) / (2.0 * step);
        let best = -slope / curvature;
        let by = best.clamp(window.from - own.reading.origin, window.to - own.reading.origin);
        Ok(Offset {
            by,
            sigma: (2.0 / curvature).sqrt(),
            left: same + slope * by + curvature * by * by / 2.0,
            direction: (y - x) / (2.0 * step),
        })
    }

    /// Beginnings that labels leave open, by run.
    ///
    /// # Errors
    /// See [`Self::offset`].
    pub(super) fn open(
        &self,
        estimate: &PlatformEstimate,
        lay: &dyn Fn(Reading) -> Result<RecordedRun, CalibrationError>,
    ) -> Result<Vec<Option<Offset>>, CalibrationError> {
        let of = |(r, run): (usize, &RecordedRun)| {
            run.reading.open.map(|window| self.offset(estimate, r, window, lay)).transpose()
        };
        self.runs.iter().enumerate().map(of).collect()
    }

    /// Changes of the measurements with the beginnings, for runs in which labels leave them open. `None` also
    /// where a shift moves measurements to other bins.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    pub(super) fn later(
        &self,
        estimate: &PlatformEstimate,
        lay: &dyn Fn(Reading) -> Result<RecordedRun, CalibrationError>,
    ) -> Result<Vec<Option<Later>>, CalibrationError> {
        let of = |(r, own): (usize, &RecordedRun)| -> Result<Option<Later>, CalibrationError> {
            let Some(window) = own.reading.open else { return Ok(None) };
            let step = MOVED * window.length();
            let residuals = |by: f64| {
                let mut run = lay(own.reading.later(by))?;
                run.counts.clone_from(&own.counts);
                let (along, keys) = run.along(self.conditions, &self.sigmas, &estimate.at.x[r])?;
                Ok::<_, CalibrationError>((along.residuals, keys))
            };
            let [(low, keys), (high, others)] = [residuals(-step)?, residuals(step)?];
            let column = low.iter().zip(&high).map(|(low, high)| (high - low) / (2.0 * step)).collect();
            let same = keys == others && keys == estimate.at.runs[r].keys;
            Ok(same.then(|| Later { column, weight: 12.0 / window.length().powi(2) }))
        };
        self.runs.iter().enumerate().map(of).collect()
    }

    /// True if an inconsistent fit becomes consistent when run `r` begins elsewhere within one interval
    /// between rows.
    ///
    /// # Errors
    /// See [`Self::offset`].
    pub(super) fn begins_elsewhere(
        &self,
        estimate: &PlatformEstimate,
        r: usize,
        lay: &dyn Fn(Reading) -> Result<RecordedRun, CalibrationError>,
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
            Span { from: reading.origin - reading.interval, to: reading.origin + reading.interval },
            lay,
        )?;
        let explains = found.left <= most.max(EXPLAINED * estimate.at.cost);
        Ok(explains && found.by.abs() > BELIEVED * found.sigma)
    }
}
