//! The filter that is linearised again along the whole run: Gauss and Newton for its most probable start,
//! then the mean about it.
//!
//! A filter that goes through a run once linearises every step where the estimate was then, before the drifts
//! were known; later steps cannot mend that, and iterating single updates cannot either, since it is the
//! motion between them that is bent. So the run is linearised along one trajectory of the nonlinear
//! equations, filtered with its process noise as a linear model, and what all measurements say of its start
//! (`linear::smoothed_start`) moves the trajectory, until the estimate at the end stays (Bell 1994,
//! doi:10.1137/0804035). Where what is left open bends the run, a last pass takes that into the estimate and
//! its covariance (`curvature`).

use std::borrow::Cow;

use obsdeg_ekf::consistency::Nees;
use obsdeg_ekf::linear::{SmoothedStart, filter_pass, smoothed_start};
use obsdeg_ekf::{Covariance, EkfError, Form, Manifold, Update};

use super::conditions::Conditions;
use super::curvature::Curvature;
use super::error::SimulationError;
use super::extended::{Ended, Extended, check_measurements};
use super::plan::Plan;
use super::start::RunStart;
use super::state::PlatformState;
use super::trajectory::{Along, Trajectory};
use super::validity::Validity;

/// Most steps of a run that is iterated: each has a model of its own.
pub(crate) const MAX_ITERATED_STEPS: usize = 100_000;
/// Most linearisations of the run.
const PASSES: usize = 40;
/// The run has settled when the estimate at its end moves by less than this, in standard deviations of any
/// combination.
const SETTLED: f64 = 0.01;
/// Squared innovations of this many times their number are poor.
const POOR: f64 = 2.0;
/// Halvings of a step that leads away.
const HALVINGS: usize = 12;
/// A step leads away when the sum of the squared innovations grows by more than this part of it, and this.
const AWAY: (f64, f64) = (0.02, 10.0);

/// What a pass over the run made of it.
struct Pass {
    ended: (PlatformState, Covariance),
    /// What the run says of its start, as a correction of `x0`.
    start: SmoothedStart,
    /// The sum of the squared whitened innovations.
    misfit: f64,
}

/// One pass along the trajectory from `x0`, which bends as `curvature` says, over the steps that `z` is of.
fn pass(
    filter: &Extended<'_>,
    start: &RunStart,
    z: &[f64],
    x0: &PlatformState,
    curvature: Option<&Curvature>,
    mut on_step: impl FnMut(usize, &PlatformState, &Covariance, &[f64]),
) -> Result<Pass, EkfError> {
    let (n, m) = (x0.dimension(), filter.plan().components.len());
    let Along { mut stages, at } = Along::new(filter, z.len() / m, x0.clone())?;
    let mut p0 = start.variances();
    let mut from = start.state(filter.plan()).local(x0);
    if let Some(c) = curvature {
        c.widen(&mut stages);
        p0 = c.prior(&p0);
        from.resize(p0.nrows(), 0.0);
    }
    let prior = Covariance::new("P0", &p0, Form::Ud)?;
    let mut ended = (x0.clone(), prior.clone());
    let mut delta = from.clone();
    let mut whitened = Vec::with_capacity(z.len());
    let measure = |step: usize, _: usize, out: &mut [f64]| {
        for (row, x) in (step * m..).zip(out) {
            *x = z[row] - at.outputs[row] - curvature.map_or(0.0, |c| c.mean_output(row));
        }
    };
    let mut bent = Ok(());
    let gains = filter_pass(&stages, prior, &mut delta, measure, |step, delta, p, innovations| {
        whitened.extend_from_slice(innovations);
        let (delta, p) = match curvature.map(|c| c.of_state(step, delta, p)).transpose() {
            Ok(Some((delta, p))) => (Cow::Owned(delta), Cow::Owned(p)),
            Ok(None) => (Cow::Borrowed(delta), Cow::Borrowed(p)),
            Err(e) => {
                bent = Err(e);
                return;
            }
        };
        let mut x = at.states[step].clone();
        x.retract(&delta);
        on_step(step, &x, &p, innovations);
        if step + 1 == at.states.len() {
            ended = (x, p.into_owned());
        }
    })?;
    bent?;
    let mut start = smoothed_start(&stages, &gains, &whitened, &p0)?;
    start.correction.iter_mut().zip(&from).for_each(|(c, f)| *c += f);
    start.correction.truncate(n);
    start.covariance = start.covariance.view((0, 0), (n, n)).into_owned();
    Ok(Pass { ended, start, misfit: whitened.iter().map(|w| w * w).sum() })
}

/// Where the trajectory starts that ends at `x`.
fn back(filter: &Extended<'_>, mut x: PlatformState) -> Result<PlatformState, EkfError> {
    for (segment, s) in filter.plan().segments.iter().enumerate().rev() {
        let motion = filter.motion(segment);
        for i in (1..=s.steps).rev() {
            motion.carry(i as f64 * s.dt, -s.dt, &mut x)?;
        }
    }
    Ok(x)
}

/// Where the iteration ended.
struct Settled {
    /// The start of the trajectory.
    x0: PlatformState,
    passes: usize,
    converged: bool,
    /// The sum of the squared whitened innovations.
    misfit: f64,
}

impl Settled {
    /// True if it is to be preferred: one that settled, then one that fits.
    fn is_better_than(&self, other: &Self) -> bool {
        (self.converged, -self.misfit) > (other.converged, -other.misfit)
    }
}

/// Linearises along the trajectory from `x0` again and again until the estimate at its end stays.
fn settle(
    filter: &Extended<'_>,
    start: &RunStart,
    z: &[f64],
    mut x0: PlatformState,
) -> Result<Settled, EkfError> {
    let mut best = pass(filter, start, z, &x0, None, |_, _, _, _| {})?;
    let (mut passes, mut converged) = (1, false);
    while passes < PASSES && !converged {
        let mut step = best.start.correction.clone();
        let mut found = None;
        for _ in 0..=HALVINGS {
            let mut x = x0.clone();
            x.retract(&step);
            passes += 1;
            // a trajectory far off may end in numbers that are none
            let next = pass(filter, start, z, &x, None, |_, _, _, _| {}).ok();
            found = next.filter(|n| n.misfit <= best.misfit * (1.0 + AWAY.0) + AWAY.1).map(|n| (x, n));
            if found.is_some() {
                break;
            }
            step.iter_mut().for_each(|s| *s /= 2.0);
        }
        let Some((x, next)) = found else { break };
        let mut moved = next.ended.0.local(&best.ended.0);
        converged = Nees::of_covariance(&next.ended.1)?.of(&mut moved)? <= SETTLED * SETTLED;
        (x0, best) = (x, next);
    }
    Ok(Settled { x0, passes, converged, misfit: best.misfit })
}

/// Settles on the first eighth of the run, from there on the first quarter, and so on: a trajectory that is
/// known for a while is near enough to be known for longer.
fn settle_by_and_by(filter: &Extended<'_>, start: &RunStart, z: &[f64]) -> Result<Settled, EkfError> {
    let outputs = filter.plan().components.len();
    let mut x0 = start.state(filter.plan());
    let mut passes = 0;
    for part in [8, 4, 2] {
        let steps = (z.len() / outputs).div_ceil(part);
        let settled = settle(filter, start, &z[..steps * outputs], x0)?;
        passes += settled.passes;
        x0 = settled.x0;
    }
    let settled = settle(filter, start, z, x0)?;
    Ok(Settled { passes: passes + settled.passes, ..settled })
}

/// Runs `filter` over the measurements `z` as [`Extended::run`] does, and then again along the trajectory
/// that it found, until that stays. Where it does not, or fits poorly, longer and longer parts of the run are
/// tried from the initial estimate too.
///
/// # Errors
/// [`EkfError`] when a number is none, or `z` is of another run.
pub fn iterated(
    filter: &Extended<'_>,
    start: &RunStart,
    z: &[f64],
    on_step: impl FnMut(usize, &PlatformState, &Covariance, &[f64]),
) -> Result<Ended, EkfError> {
    check_measurements(filter.plan(), z)?;
    let samples: usize = filter.plan().stages.iter().map(|s| s.steps * s.outputs.len()).sum();
    let poor = |s: &Settled| !s.converged || s.misfit > POOR * samples as f64;
    let once = filter.run(start, z, |_, _, _, _| {}).and_then(|once| back(filter, once.x));
    let mut found = once.and_then(|x| settle(filter, start, z, x));
    if found.as_ref().map_or(true, poor) {
        let other = settle_by_and_by(filter, start, z);
        found = match (found, other) {
            (Ok(a), Ok(b)) => {
                let passes = a.passes + b.passes;
                Ok(Settled { passes, ..if b.is_better_than(&a) { b } else { a } })
            }
            (Ok(a), Err(_)) | (Err(_), Ok(a)) => Ok(a),
            (Err(e), Err(_)) => Err(e),
        };
    }
    let Settled { mut x0, passes, converged, .. } = found?;
    let curvature = if converged { bent(filter, start, z, &mut x0)? } else { None };
    let (x, covariance) = pass(filter, start, z, &x0, curvature.as_ref(), on_step)?.ended;
    Ok(Ended { x, covariance, passes, converged })
}

/// How the run bends about its most probable start `x0`, which becomes the mean of the likely ones.
fn bent(
    filter: &Extended<'_>,
    start: &RunStart,
    z: &[f64],
    x0: &mut PlatformState,
) -> Result<Option<Curvature>, EkfError> {
    let Along { stages, at } = Along::new(filter, usize::MAX, x0.clone())?;
    let p = pass(filter, start, z, x0, None, |_, _, _, _| {})?.start.covariance;
    let curvature = Curvature::new(filter, x0, (&stages, &at), &p, &start.sigma)?;
    if let Some(c) = &curvature {
        x0.retract(&pass(filter, start, z, x0, Some(c), |_, _, _, _| {})?.start.correction);
    }
    Ok(curvature)
}

/// Validity of the small-angle model, and standard deviations at the end (SI units, by state), of a run at
/// the drifts that `conditions` say, by equations of full attitudes linearised along it: with the prior,
/// without noise of the drift. `None` where the unknowns are the drift itself, where torquer errors act in
/// turns at once, or for a run of too many steps.
///
/// # Errors
/// [`SimulationError`] for conditions that cannot be, and numbers that are none.
pub(crate) fn at_own_drifts(
    plan: &Plan,
    conditions: &Conditions,
) -> Result<Option<(Validity, Vec<f64>)>, SimulationError> {
    let steps = plan.segments.iter().map(|s| s.steps).sum::<usize>();
    if !plan.has_coefficients() || plan.torqued_at_once() || steps > MAX_ITERATED_STEPS {
        return Ok(None);
    }
    let start = RunStart::new(plan, conditions)?;
    let filter = Extended::new(plan, conditions, Update::default())?;
    let mut x0 = PlatformState::of_unknowns(&start.truth, plan.constants());
    let at = Trajectory::new(&filter, x0.clone())?;
    let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let psi = |x: &PlatformState| -> f64 {
        let x = x.unknowns();
        x[..x.len() - plan.constants()].chunks_exact(3).map(length).fold(0.0, f64::max)
    };
    let largest = at.states.iter().map(psi).fold(0.0, f64::max);
    // measured without noise, and known before as well as it will be
    let known = RunStart { estimate: start.truth.clone(), ..start.clone() };
    let curvature = bent(&filter, &known, &at.outputs, &mut x0)?;
    let ended = pass(&filter, &known, &at.outputs, &x0, curvature.as_ref(), |_, _, _, _| {})?.ended;
    Ok(Some((Validity::of(plan, conditions, &start.truth, largest)?, ended.1.sigmas())))
}
