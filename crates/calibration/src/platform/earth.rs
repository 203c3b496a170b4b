//! Whether the clock of a record is right, by the rates of the earth and of turns.
//!
//! A clock that runs fast by a part `e` makes every rate of a record smaller by that part. Rates of drift are
//! unknown, so of them nothing shows; the rate of the earth is known, and shows where psi is large enough for
//! `w x psi` to matter, or where torquers are unknown that are driven with it; those of turns show by the
//! drift meanwhile.

use obsdeg_evidence::simulation::{Conditions, Plan};

use super::CalibrationError;
use super::clock::bounds;
use super::diagnose::Parts;
use super::estimate::{Problem, WEAK};
use super::observe::{By, Reading};
use super::run::Run;
use crate::answer::ClockByEarth;
use crate::least_squares::Information;

/// By this part the rates are moved to see what that does.
const MOVED: f64 = 0.005;
/// With a larger sigma the clock may be off by all that it goes (three sigma), which the parabola at rates so
/// near does not reach.
const LARGEST: f64 = 1.0 / 3.0;
/// Fall of the sum of squares (3.3 sigma squared), and the least part that a clock is off, from which on the
/// parabola is held against an estimate by that clock.
const SEEN: f64 = 10.8;
const FAR: f64 = 0.05;

impl Parts<'_> {
    /// The part by which the clock of run `r` is fast, by the rates of the earth and of turns that fit its
    /// measurements best when all unknowns follow: of the sum of squares at three rates, the lowest point of
    /// a parabola; `None` where they are nearly the same.
    ///
    /// # Errors
    /// [`CalibrationError`] when a number is none.
    pub(super) fn clock(&self, r: usize) -> Result<Option<ClockByEarth>, CalibrationError> {
        let own = &self.problem.runs[r];
        let mut reading = own.reading.clone();
        if matches!(reading.by, By::Timeline | By::Both) {
            // as by labels, so that turns may take less time
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
        // turns that take longer may not fit between two samples: of faster ones alone
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

    /// A run and its conditions where the earth and the platform turn `1 + by` times as fast as in the
    /// scheme.
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

    /// True if the estimate settles with run `r` by the clock that was found, and its sum of squares is below
    /// `most`. A parabola at rates so near says nothing of a clock that is far off where the unknowns bend. A
    /// clock by which turns do not fit between two samples cannot be tried, and is taken as it was found.
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
