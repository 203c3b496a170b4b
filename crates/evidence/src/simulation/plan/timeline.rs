//! Timeline of a scheme: segments at rest and in motion, and their steps.

use obsdeg_core::model::slew::Slew;
use obsdeg_core::model::{Matrix3, Path, Scheme};

use super::super::conditions::Conditions;
use super::super::error::SimulationError;
use super::super::limits::{MAX_INTEGRATION, MAX_NUMBERS, MAX_STEPS, MAX_TURNING_STEPS};

/// Largest turn of one integration step, in rad.
const MAX_TURN: f64 = 0.02;

/// Count from a floating-point number, checked before conversion so that nothing overflows.
///
/// # Errors
/// [`SimulationError::TooManySteps`] above `most`, and for NaN.
fn counted(what: &'static str, found: f64, most: usize) -> Result<usize, SimulationError> {
    if found <= most as f64 {
        return Ok(found as usize);
    }
    let found = if found < 1e9 { format!("{found:.0}") } else { format!("{found:.3e}") };
    Err(SimulationError::TooManySteps { found, what, most })
}

/// Number of equal steps of at most `step_s` that a dwell is divided into.
///
/// # Errors
/// [`SimulationError::TooManySteps`].
pub fn steps(dwell_s: f64, step_s: f64) -> Result<usize, SimulationError> {
    // a small margin, so that 1000 s in steps of 10 s are 100 steps
    counted("steps", (dwell_s / step_s - 1e-9).ceil().max(1.0), MAX_STEPS)
}

/// Number of the first samples of a position at rest, `dt` s apart, that lie within `settle_s` s of its
/// start.
pub fn left_out(settle_s: f64, dt: f64) -> usize {
    (settle_s / dt + 1e-9).floor().max(0.0) as usize
}

/// Number of integration steps for a turn of `turn` rad.
///
/// # Errors
/// [`SimulationError::TooManySteps`].
pub(in crate::simulation) fn integration_steps(turn: f64) -> Result<usize, SimulationError> {
    counted("integration steps", (turn / MAX_TURN).ceil().max(1.0), MAX_INTEGRATION)
}

/// Kind of a segment of the timeline.
#[derive(Debug, Clone, PartialEq)]
pub enum SegmentKind {
    /// Position that tracks the geographic frame; Z is sampled at the end of every step.
    Dwell,
    /// Slew to the position; Z is not used.
    Slew(Slew),
    /// Step of a rotating segment; Z is sampled at its end.
    Rotation(Slew),
}

/// Segment of the timeline.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanSegment {
    /// Index of the position in which the segment is spent, or to which the slew leads.
    pub position: usize,
    /// Kind: position, slew or rotation.
    pub kind: SegmentKind,
    /// Start of the segment, in s.
    pub start_s: f64,
    /// Number of steps.
    pub steps: usize,
    /// Length of a step, in s.
    pub dt: f64,
    /// True if its samples are left out since the platform comes to rest.
    pub left_out: bool,
}

/// Turns to a position at a rate in rad/s: one turn, or one of each gimbal.
fn slews(
    scheme: &Scheme,
    position: usize,
    attitudes: &[Matrix3<f64>],
    ends: &[Matrix3<f64>],
    rate_rad_s: f64,
) -> Result<Vec<Slew>, SimulationError> {
    let p = &scheme.positions[position];
    let misses = || SimulationError::SlewMisses { name: p.name.clone() };
    let how = p.slew.clone().unwrap_or_default();
    if how.axis.is_none() && scheme.path == Some(Path::Gimbals) {
        let after = || SimulationError::GimbalsAfterRotation { name: p.name.clone() };
        let steps = Path::gimbals(&scheme.positions[position - 1], p).ok_or_else(after)?;
        let mut from = ends[position - 1];
        return Ok(steps
            .iter()
            .map(|step| {
                let turn = step.at_f64(&from);
                let slew = Slew::by(&from, &turn.axis.map(|x| x * turn.angle), rate_rad_s);
                from = slew.at(slew.duration_s);
                slew
            })
            .collect());
    }
    let slew = Slew::to(&ends[position - 1], &attitudes[position], &how, rate_rad_s);
    Ok(slew.map_err(|_| misses())?.into_iter().collect())
}

/// Timeline under construction, with the counts that are limited.
#[derive(Default)]
struct Timeline {
    segments: Vec<PlanSegment>,
    /// End of the last segment, in s.
    end_s: f64,
    /// Numbers of steps, of steps of rotating segments, and of integration steps.
    all: f64,
    turning: f64,
    integration: f64,
}

impl Timeline {
    /// Adds a segment of `steps` equal steps.
    fn push(&mut self, position: usize, kind: SegmentKind, duration: f64, steps: usize, left_out: bool) {
        let dt = duration / steps as f64;
        self.segments.push(PlanSegment { position, kind, start_s: self.end_s, steps, dt, left_out });
        self.end_s += duration;
    }

    /// Adds a slew to a position.
    fn slew(&mut self, position: usize, slew: Slew) -> Result<(), SimulationError> {
        let duration = slew.duration_s;
        self.all += 1.0;
        self.integration += slew.turned(duration) / MAX_TURN;
        counted("integration steps", self.integration, MAX_INTEGRATION)?;
        self.push(position, SegmentKind::Slew(slew), duration, 1, false);
        Ok(())
    }

    /// Counts the steps of a position before they are made.
    fn count(&mut self, steps: usize, unknowns: usize) -> Result<(), SimulationError> {
        self.all += steps as f64;
        counted("steps", self.all, MAX_STEPS)?;
        counted("steps times unknowns", self.all * unknowns as f64, MAX_NUMBERS)?;
        Ok(())
    }

    /// Adds a position at rest. Samples of its first `settle_s` s are left out.
    fn rest(
        &mut self,
        (position, name): (usize, &str),
        dwell: f64,
        steps: usize,
        settle_s: f64,
    ) -> Result<(), SimulationError> {
        let dt = dwell / steps as f64;
        let first = left_out(settle_s, dt);
        if first >= steps {
            return Err(SimulationError::Settle { settle_s, place: format!("`{name}`"), dwell_s: dwell });
        }
        let waited = dt * first as f64;
        if first > 0 {
            self.push(position, SegmentKind::Dwell, waited, first, true);
        }
        self.push(position, SegmentKind::Dwell, dwell - waited, steps - first, false);
        Ok(())
    }

    /// Adds a rotating position, step by step.
    fn rotation(&mut self, position: usize, whole: &Slew, steps: usize) -> Result<(), SimulationError> {
        let (dwell, dt) = (whole.duration_s, whole.duration_s / steps as f64);
        self.turning += steps as f64;
        self.integration += whole.turned(dwell) / MAX_TURN;
        counted("steps of rotating segments", self.turning, MAX_TURNING_STEPS)?;
        counted("integration steps", self.integration, MAX_INTEGRATION)?;
        for k in 0..steps {
            let from = whole.at(k as f64 * dt);
            let step = Slew { from, duration_s: dt, ..whole.clone() };
            self.push(position, SegmentKind::Rotation(step), dt, 1, false);
        }
        Ok(())
    }
}

/// Segments of positions and slews in order; numbers of steps are checked before they are made.
pub(super) fn timeline(
    scheme: &Scheme,
    conditions: &Conditions,
    unknowns: usize,
    attitudes: &[Matrix3<f64>],
    ends: &[Matrix3<f64>],
) -> Result<Vec<PlanSegment>, SimulationError> {
    let mut out = Timeline::default();
    for (position, p) in scheme.positions.iter().enumerate() {
        if let (Some(rate), true) = (conditions.slew_rate(p), position > 0) {
            for slew in slews(scheme, position, attitudes, ends, rate.to_radians())? {
                out.slew(position, slew)?;
            }
        }
        let dwell = p.dwell.map_or(conditions.dwell_s, |d| d.seconds());
        let steps = steps(dwell, conditions.step_s)?;
        out.count(steps, unknowns)?;
        match p.rotation.as_ref() {
            None => out.rest((position, p.name.as_str()), dwell, steps, conditions.settle_s)?,
            Some(r) => out.rotation(position, &Slew::about(&attitudes[position], r, dwell), steps)?,
        }
    }
    Ok(out.segments)
}
