//! Clock of a record, checked by the rates of the earth and of turns and, where the timeline of the scheme
//! stands, by its changes of position.
//!
//! A clock that is fast by a fraction `e` makes every rate of a record smaller by that fraction. Rates of
//! drift are unknown, so they show nothing of it. The rate of the earth is known. It shows where psi is large
//! enough for `w x psi` to matter, or where unknown torquer errors act with it. Rates of turns show by the
//! drift during a turn. Where positions change at the times of the scheme, these are later by the fraction in
//! the record, and the drift changes then.

use nalgebra::{Matrix2, Vector2};
use obsdeg_ekf::consistency::chi_square_band;
use obsdeg_evidence::simulation::{Conditions, Plan};

use super::clock::bounds;
use super::diagnose::data::AnswerData;
use super::estimate::{PlatformProblem, WEAK};
use super::placed::{By, Reading, TOLERANCE};
use super::run::RecordedRun;
use super::timeline::{narrow, slews};
use super::{CalibrationError, STRICT};
use crate::answer::{Clock, ClockRate};
use crate::least_squares::StartInformation;

/// Relative change of the rates for the finite differences.
const MOVED: f64 = 0.005;
/// Change of the last time for the finite differences where the timeline stands, in intervals between rows.
const MOVED_ROWS: f64 = 0.02;
/// Largest distance of the last change of position from the timeline, in intervals between rows, by a clock
/// that this finds: rows beyond would belong to other positions.
const MOST_ROWS: f64 = 2.0;
/// Standard deviation of an open beginning, in intervals between rows.
const FREE: f64 = 10.0;
/// Largest sigma of the result: above, three sigma exceed the clock rate that the parabola of nearby rates
/// can represent.
const LARGEST: f64 = 1.0 / 3.0;
/// Fall of the sum of squares (3.3 sigma squared), and smallest clock error (`FAR`, a fraction), from which
/// the parabola is checked by an estimate with that clock.
const SEEN: f64 = 10.8;
const FAR: f64 = 0.05;
/// Least fraction of a misfit that a wrong clock explains.
const EXPLAINED: f64 = 0.85;

/// Clock of a run by its changes of position.
#[derive(Debug, Clone)]
struct ByChanges {
    pub rate: ClockRate,
    /// Delay of the beginning of the scheme with this clock, in s.
    pub late_s: f64,
}

impl AnswerData<'_> {
    /// Clock of run `r`: its offset, and its rate in three ways.
    pub(super) fn clock(&self, r: usize) -> Clock {
        let reading = &self.problem.runs[r].reading;
        let changes = self.clock_by_changes(r).ok().flatten();
        let durations = reading.by_durations(self.planned);
        Clock {
            offset_s: matches!(reading.by, By::Timeline | By::Both).then_some(reading.origin),
            offset_sigma_s: self.offsets[r].as_ref().map(|o| o.sigma),
            by_durations: durations.as_ref().map(|d| d.fast),
            by_durations_sigma: durations.map(|d| d.sigma),
            by_changes: changes.as_ref().map(|c| c.rate.clone()),
            by_earth: self.clock_by_rates(r, changes.as_ref()).ok().flatten(),
        }
    }

    /// Sum of squares of all runs, with `instead` in place of run `r`, and all unknowns free.
    fn left_with(
        &self,
        r: usize,
        instead: &RecordedRun,
        conditions: &Conditions,
    ) -> Result<f64, CalibrationError> {
        let at = &self.estimate.at;
        let (along, _) = instead.along(conditions, &self.problem.sigmas, &at.x[r])?;
        let information = StartInformation::of(&along)?;
        Ok(information.left + self.problem.step_with(at, WEAK, Some((r, &information)))?.left)
    }

    /// True if a clock that lowers the sum of squares by `fall` explains the misfit, or if there is none:
    /// another error in the model, such as a scale of an axis, looks partly like any clock.
    fn explains(&self, fall: f64) -> bool {
        let (_, free) = self.found.sums(|_| true);
        let beyond = self.estimate.at.cost - chi_square_band(free.max(1.0), 1.0, STRICT).1;
        beyond <= 0.0 || fall >= EXPLAINED * (self.estimate.at.cost - free)
    }

    /// Fraction by which the clock of run `r` is fast, on the timeline of the scheme, by its changes of
    /// position: all times of the record are divided by `1 + e`, its beginning is free as far as the rows
    /// leave it open, and so are all unknowns. The minimum of a parabola through the sums of squares nearby.
    /// `None` where the changes say too little, or are so far off that rows would be at other positions.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    fn clock_by_changes(&self, r: usize) -> Result<Option<ByChanges>, CalibrationError> {
        let own = &self.problem.runs[r];
        if !matches!(own.reading.by, By::Timeline | By::Both) {
            return Ok(None);
        }
        let interval = own.reading.interval;
        let last = bounds(self.planned).last().map_or(0.0, |b| b.to);
        let step = MOVED_ROWS * interval;
        let left = |late: f64, stretched: f64| {
            let reading = own.reading.later(late * step).stretched(stretched * step / last);
            let mut run = RecordedRun::new(reading, self.scheme, self.planned, self.problem.conditions)?;
            run.counts.clone_from(&own.counts);
            self.left_with(r, &run, self.problem.conditions)
        };
        // rows at the end of a position stay at it if all times are earlier
        let same = left(0.0, 0.0)?;
        let [late, later] = [left(1.0, 0.0)?, left(2.0, 0.0)?];
        let [fast, faster] = [left(0.0, 1.0)?, left(0.0, 2.0)?];
        let both = left(1.0, 1.0)?;
        let tolerance = self.scheme.recording.tolerance.unwrap_or(TOLERANCE);
        // what rows say of a beginning that is open depends on the clock
        let open = own.reading.open.is_some() || own.reading.origin.abs() > tolerance * interval;
        let known = if open { FREE } else { tolerance } * interval / step;
        let cross = both - late - fast + same;
        let hessian = Matrix2::new(
            same - 2.0 * late + later + 2.0 / (known * known),
            cross,
            cross,
            same - 2.0 * fast + faster,
        );
        let slope = Vector2::new(-3.0 * same + 4.0 * late - later, -3.0 * same + 4.0 * fast - faster) / 2.0;
        let Some(inverse) = hessian.cholesky().map(|c| c.inverse()) else { return Ok(None) };
        let scale = step / last;
        let [late, fast] = (-(inverse * slope)).into();
        let rate = ClockRate { fast: fast * scale, sigma: (2.0 * inverse[(1, 1)]).sqrt() * scale };
        let near = (rate.fast.abs() + rate.sigma) * last <= MOST_ROWS * interval;
        let near = near && self.explains((slope.transpose() * inverse * slope)[0] / 2.0);
        Ok(near.then_some(ByChanges { rate, late_s: late * step }))
    }

    /// Fraction by which the clock of run `r` is fast, by the best fit of the rates of the earth and of turns
    /// with all unknowns free. The result is the minimum of a parabola through the sums of squares at three
    /// rates; `None` where they are nearly equal. If the changes of position show a wrong clock, the rates
    /// are those by this clock.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    fn clock_by_rates(
        &self,
        r: usize,
        changes: Option<&ByChanges>,
    ) -> Result<Option<ClockRate>, CalibrationError> {
        let own = &self.problem.runs[r];
        let mut reading = own.reading.clone();
        let changes = changes.filter(|c| (c.rate.fast / c.rate.sigma).powi(2) > SEEN);
        if let Some(c) = changes {
            reading = reading.later(c.late_s).stretched(c.rate.fast);
        }
        if matches!(reading.by, By::Timeline | By::Both) {
            // as with labels, so that turns may take less time
            let ends = bounds(self.planned).into_iter().map(|b| b.to);
            reading.by = By::Label;
            reading.stays.iter_mut().zip(ends).for_each(|(stay, end)| stay.to = end);
        }
        let left = |by: f64| -> Result<f64, CalibrationError> {
            let (conditions, run) = self.at_rate(own, &reading, by)?;
            self.left_with(r, &run, &conditions)
        };
        // slower turns may not fit between two samples: use faster ones only
        let [same, fast, faster] = [left(0.0)?, left(MOVED)?, left(2.0 * MOVED)?];
        let curvature = same - 2.0 * fast + faster;
        let sigma = MOVED * (2.0 / curvature).sqrt();
        // a fast clock makes all rates small
        let found =
            ClockRate { fast: -MOVED * (3.0 * same - 4.0 * fast + faster) / (2.0 * curvature), sigma };
        let fall = (found.fast / sigma).powi(2);
        let far = fall > SEEN && found.fast.abs() > FAR;
        if sigma.is_nan()
            || sigma >= LARGEST
            || (far && !self.fits_at(r, &reading, &found, same - fall / 2.0))
        {
            return Ok(None);
        }
        let before = changes.map_or(0.0, |c| c.rate.fast);
        Ok(Some(ClockRate { fast: found.fast + before, ..found }))
    }

    /// Run and conditions in which the earth and the platform turn `1 + by` times as fast as in the scheme.
    fn at_rate(
        &self,
        own: &RecordedRun,
        reading: &Reading,
        by: f64,
    ) -> Result<(Conditions, RecordedRun), CalibrationError> {
        let rate = |rate: &mut Option<f64>| rate.iter_mut().for_each(|rate| *rate *= 1.0 + by);
        let (mut scheme, mut conditions) = (self.scheme.clone(), self.problem.conditions.clone());
        rate(&mut conditions.slew_rate_deg_s);
        scheme.positions.iter_mut().filter_map(|p| p.slew.as_mut()).for_each(|s| rate(&mut s.rate_deg_s));
        let planned = Plan::derived(&scheme, &conditions)?;
        let mut reading = reading.clone();
        // the same clock for all positions says more of each change than the rows beside it
        if reading.ends_open && reading.by_durations(self.planned).is_some() {
            narrow(&mut reading.stays, self.planned, &slews(&planned));
        }
        let mut run = RecordedRun::new(reading, &scheme, &planned, &conditions)?;
        run.counts.clone_from(&own.counts);
        run.plan.point.w_n *= 1.0 + by;
        run.plan.point.w_u *= 1.0 + by;
        Ok((conditions, run))
    }

    /// True if the estimate with the found clock of run `r` converges to a sum of squares below `most`. The
    /// parabola of nearby rates does not hold for a clock that is far off where the model is nonlinear. A
    /// clock with which turns do not fit between two samples cannot be tried, and is accepted.
    fn fits_at(&self, r: usize, reading: &Reading, found: &ClockRate, most: f64) -> bool {
        let own = self.problem;
        let Ok((conditions, run)) = self.at_rate(&own.runs[r], reading, -found.fast) else { return true };
        let mut runs = own.runs.to_vec();
        runs[r] = run;
        let other = PlatformProblem {
            conditions: &conditions,
            runs: &runs,
            unknowns: own.unknowns,
            sigmas: own.sigmas.clone(),
            known: own.known.clone(),
            progress: own.progress,
            passes: own.passes.clone(),
            stopped: own.stopped.clone(),
        };
        other.settle(self.estimate.at.x.clone()).is_ok_and(|e| e.converged && e.at.cost < most)
    }
}
