//! Noise-free run, and the run linearised along it.

use obsdeg_ekf::{EkfError, Measurement, Motion, ScalarOutput, Stage};
use obsdeg_exact::interrupt;

use super::extended::ExtendedFilter;
use super::extended::motion::PlatformMotion;
use super::state::PlatformState;

/// Run without noise.
pub(super) struct Trajectory {
    /// Outputs, by step and component.
    pub outputs: Vec<f64>,
    /// States after the steps.
    pub states: Vec<PlatformState>,
}

impl Trajectory {
    /// Moves from `x` through at most `most` steps. `on_step` gets the segment, the time within it, the
    /// length of the step, and the state, which it moves.
    fn through(
        filter: &ExtendedFilter<'_>,
        most: usize,
        mut x: PlatformState,
        mut on_step: impl FnMut(&PlatformMotion<'_>, f64, f64, &mut PlatformState) -> Result<(), EkfError>,
    ) -> Result<Self, EkfError> {
        let mut out = Self { outputs: Vec::new(), states: Vec::new() };
        for (segment, s) in filter.plan().segments.iter().enumerate() {
            let motion = filter.motion(segment);
            for i in 0..s.steps.min(most - out.states.len()) {
                interrupt::check();
                on_step(&motion, i as f64 * s.dt, s.dt, &mut x)?;
                out.outputs.extend_from_slice(motion.h(0.0, &x).as_slice());
                out.states.push(x.clone());
            }
        }
        Ok(out)
    }

    /// Noise-free run from `x`.
    pub(super) fn new(filter: &ExtendedFilter<'_>, x: PlatformState) -> Result<Self, EkfError> {
        Self::through(filter, usize::MAX, x, |motion, t, dt, x| motion.carry(t, dt, x))
    }
}

/// Run linearised along one trajectory.
pub(super) struct LinearisedRun {
    /// Linearised stages, one per step.
    pub stages: Vec<Stage>,
    /// Trajectory of the linearisation.
    pub at: Trajectory,
}

impl LinearisedRun {
    /// Linearisation along the trajectory from `x`, of at most `most` steps.
    pub(super) fn new(filter: &ExtendedFilter<'_>, most: usize, x: PlatformState) -> Result<Self, EkfError> {
        let mut stages = Vec::new();
        let at = Trajectory::through(filter, most, x, |motion, t, dt, x| {
            let (transition, noise) = motion.advance(t, dt, x)?;
            let rows = Measurement::jacobian(motion, 0.0, x);
            let row = |(j, o): (usize, &ScalarOutput)| ScalarOutput {
                h: rows.row(j).iter().copied().enumerate().filter(|(_, c)| *c != 0.0).collect(),
                r: o.r,
            };
            let outputs = motion.stage().outputs.iter().enumerate().map(row).collect();
            stages.push(Stage { transition, noise: noise.into_owned(), outputs, steps: 1 });
            Ok(())
        })?;
        Ok(Self { stages, at })
    }
}
