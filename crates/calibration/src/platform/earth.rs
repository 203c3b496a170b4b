//! Clock of a record, checked by the rates of the earth and of turns.
//!
//! A clock that is fast by a fraction `e` makes every rate of a record smaller by that fraction. Rates of
//! drift are unknown, so they show nothing of it. The rate of the earth is known. It shows where psi is large
//! enough for `w x psi` to matter, or where unknown torquer errors act with it. Rates of turns show by the
//! drift during a turn.

use obsdeg_evidence::simulation::{Conditions, Plan};

use super::CalibrationError;
use super::clock::bounds;
use super::diagnose::Parts;
use super::estimate::{Problem, WEAK};
use super::observe::{By, Reading};
use super::run::Run;
use crate::answer::ClockByEarth;
use crate::least_squares::Information;

/// Relative change of the rates for the finite differences.
const MOVED: f64 = 0.005;
/// Largest sigma of the result: above, three sigma exceed the clock rate that the parabola of nearby rates
/// can represent.
const LARGEST: f64 = 1.0 / 3.0;
/// Fall of the sum of squares (3.3 sigma squared), and smallest clock error (`FAR`, a fraction), from which
/// the parabola is checked by an estimate with that clock.
const SEEN: f64 = 10.8;
const FAR: f64 = 0.05;

impl Parts<'_> {
    /// Fraction by which the clock of run `r` is fast, by the best fit of the rates of the earth and of turns
    /// with all unknowns free. The result is the minimum of a parabola through the sums of squares at three
    /// rates; `None` where they are nearly equal.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    pub(super) fn clock(&self, r: usize) -> Result<Option<ClockByEarth>, CalibrationError> {
        let own = &self.problem.runs[r];
        let mut reading = own.reading.clone();
        if matches!(reading.by, By::Timeline | By::Both) {
            // as with labels, so that turns may take less time
            let ends = bounds(self.planned).into_iter().map(|(_, end)| end);
            reading.by = By::Label;
            reading.stays.iter_mut().zip(ends).for_each(|(stay, end)| stay.1 = end);
        }
        let left = |by: f64| -> Result<f64, CalibrationError> {
            let (conditions, run) = self.at_rate(own, &reading, by)?;
            let (sigmas, at) = (&self.problem.sigmas, &self.estimate.at);
            let (along, _) = run.along(&conditions, sigmas, &at.x[r])?;
            let information = Information::of(&along)?;
            Ok(information.left + self.problem.step_with(at, WEAK, Some((r, &information)))?.left)
        };
        // slower turns may not fit between two samples: use faster ones only
        let [same, fast, faster] = [left(0.0)?, left(MOVED)?, left(2.0 * MOVED)?];
        let curvature = same - 2.0 * fast + faster;
        let sigma = MOVED * (2.0 / curvature).sqrt();
        // a fast clock makes all rates small
        let found =
            ClockByEarth { fast: -MOVED * (3.0 * same - 4.0 * fast + faster) / (2.0 * curvature), sigma };
        let fall = (found.fast / sigma).powi(2);
        let far = fall > SEEN && found.fast.abs() > FAR;
        if sigma.is_nan()
            || sigma >= LARGEST
            || (far && !self.fits_at(r, &reading, &found, same - fall / 2.0))
        {
            return Ok(None);
        }
        Ok(Some(found))
    }

    /// Run and conditions in which the earth and the platform turn `1 + by` times as fast as in the scheme.
    fn at_rate(&self, own: &Run, reading: &Reading, by: f64) -> Result<(Conditions, Run), CalibrationError> {
        let rate = |rate: &mut Option<f64>| rate.iter_mut().for_each(|rate| *rate *= 1.0 + by);
        let (mut scheme, mut conditions) = (self.scheme.clone(), self.problem.conditions.clone());
        rate(&mut conditions.slew_rate_deg_s);
        scheme.positions.iter_mut().filter_map(|p| p.slew.as_mut()).for_each(|s| rate(&mut s.rate_deg_s));
        let planned = Plan::derived(&scheme, &conditions)?;
        let mut run = Run::new(reading.clone(), &scheme, &planned, &conditions)?;
        run.counts.clone_from(&own.counts);
        run.plan.point.w_n *= 1.0 + by;
        run.plan.point.w_u *= 1.0 + by;
        Ok((conditions, run))
    }

    /// True if the estimate with the found clock of run `r` converges to a sum of squares below `most`. The
    /// parabola of nearby rates does not hold for a clock that is far off where the model is nonlinear. A
    /// clock with which turns do not fit between two samples cannot be tried, and is accepted.
    fn fits_at(&self, r: usize, reading: &Reading, found: &ClockByEarth, most: f64) -> bool {
        let own = self.problem;
        let Ok((conditions, run)) = self.at_rate(&own.runs[r], reading, -found.fast) else { return true };
        let mut runs = own.runs.to_vec();
        runs[r] = run;
        let other = Problem {
            conditions: &conditions,
            runs: &runs,
            unknowns: own.unknowns,
            sigmas: own.sigmas.clone(),
            known: own.known.clone(),
            draw: None,
            going: own.going,
            passes: own.passes.clone(),
            stopped: own.stopped.clone(),
        };
        other.settle(self.estimate.at.x.clone()).is_ok_and(|e| e.converged && e.at.cost < most)
    }
}
