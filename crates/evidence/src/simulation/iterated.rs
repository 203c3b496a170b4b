//! Iterated filter, linearised along the whole run: Gauss-Newton for the most probable start, then the mean
//! about it.
//!
//! A single pass linearises every step at the estimate of that time, before the drifts are known. Later steps
//! cannot correct this, and neither can iterated updates, since the motion between updates is nonlinear. The
//! run is therefore linearised along one trajectory of the nonlinear equations and filtered with its process
//! noise as a linear model. The smoothed start (`linear::smoothed_start`) moves the trajectory, until the
//! estimate at the end stays (Bell 1994, doi:10.1137/0804035). Where undetermined directions curve the run, a
//! last pass corrects the estimate and its covariance (`curvature`).

use std::borrow::Cow;

use obsdeg_ekf::consistency::Nees;
use obsdeg_ekf::linear::{SmoothedStart, filter_pass, smoothed_start};
use obsdeg_ekf::{Covariance, CovarianceForm, EkfError, Manifold, Update};

use super::conditions::Conditions;
use super::curvature::SecondOrderTerms;
use super::error::SimulationError;
use super::extended::{ExtendedFilter, FilterResult, check_measurements};
use super::plan::Plan;
use super::start::RunStart;
use super::state::PlatformState;
use super::trajectory::{LinearisedRun, Trajectory};
use super::validity::Validity;

/// Most steps of an iterated run: each step has a model of its own.
pub(crate) const MAX_ITERATED_STEPS: usize = 100_000;
/// Most linearisations of the run.
const PASSES: usize = 40;
/// Convergence limit: largest change of the estimate at the end, in standard deviations of any combination.
const SETTLED: f64 = 0.01;
/// Ratio of the sum of squared innovations to their number above which a fit is poor.
const POOR: f64 = 2.0;
/// Most halvings of a step that increases the misfit.
const HALVINGS: usize = 12;
/// Largest increase of the sum of squared innovations by an accepted step: relative part, and absolute part.
const AWAY: (f64, f64) = (0.02, 10.0);

/// Result of a pass over the run.
struct Pass {
    ended: (PlatformState, Covariance),
    /// Smoothed start of the run, as a correction of `x0`.
    start: SmoothedStart,
    /// Sum of the squared whitened innovations.
    misfit: f64,
}

/// One pass along the trajectory from `x0`, with the curvature `curvature`, over the steps of `z`.
fn pass(
    filter: &ExtendedFilter<'_>,
    start: &RunStart,
    z: &[f64],
    x0: &PlatformState,
    curvature: Option<&SecondOrderTerms>,
    mut on_step: impl FnMut(usize, &PlatformState, &Covariance, &[f64]),
) -> Result<Pass, EkfError> {
    let (n, m) = (x0.dimension(), filter.plan().components.len());
    let LinearisedRun { mut stages, at } = LinearisedRun::new(filter, z.len() / m, x0.clone())?;
    let mut p0 = start.variances();
    let mut from = start.state(filter.plan()).local(x0);
    if let Some(c) = curvature {
        c.widen(&mut stages);
        p0 = c.prior(&p0);
        from.resize(p0.nrows(), 0.0);
    }
    let prior = Covariance::new("P0", &p0, CovarianceForm::Ud)?;
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

/// Start of the trajectory that ends at `x`.
fn back(filter: &ExtendedFilter<'_>, mut x: PlatformState) -> Result<PlatformState, EkfError> {
    for (segment, s) in filter.plan().segments.iter().enumerate().rev() {
        let motion = filter.motion(segment);
        for i in (1..=s.steps).rev() {
            motion.carry(i as f64 * s.dt, -s.dt, &mut x)?;
        }
    }
    Ok(x)
}

/// Result of the iteration.
struct IterationResult {
    /// Start of the trajectory.
    x0: PlatformState,
    passes: usize,
    converged: bool,
    /// Sum of the squared whitened innovations.
    misfit: f64,
}

impl IterationResult {
    /// True if it is preferable: a converged one first, then the one with the smaller misfit.
    fn is_better_than(&self, other: &Self) -> bool {
        (self.converged, -self.misfit) > (other.converged, -other.misfit)
    }
}

/// Linearises along the trajectory from `x0` until the estimate at its end stays.
fn settle(
    filter: &ExtendedFilter<'_>,
    start: &RunStart,
    z: &[f64],
    mut x0: PlatformState,
) -> Result<IterationResult, EkfError> {
    let mut best = pass(filter, start, z, &x0, None, |_, _, _, _| {})?;
    let (mut passes, mut converged) = (1, false);
    while passes < PASSES && !converged {
        let mut step = best.start.correction.clone();
        let mut found = None;
        for _ in 0..=HALVINGS {
            let mut x = x0.clone();
            x.retract(&step);
            passes += 1;
            // a trajectory far off may end in numbers that are not finite
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
    Ok(IterationResult { x0, passes, converged, misfit: best.misfit })
}

/// Converges on the first eighth of the run, then from there on the first quarter, and so on: each trajectory
/// starts close enough for twice the duration.
fn settle_in_stages(
    filter: &ExtendedFilter<'_>,
    start: &RunStart,
    z: &[f64],
) -> Result<IterationResult, EkfError> {
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
    Ok(IterationResult { passes: passes + settled.passes, ..settled })
}

/// Runs `filter` over the measurements `z` as [`ExtendedFilter::run`] does, then again along the trajectory
/// found, until it stays. If it does not converge, or fits poorly, longer and longer parts of the run are
/// tried from the initial estimate too.
///
/// # Errors
/// [`EkfError`] for a number that is not finite, or if `z` belongs to another run.
pub fn iterated(
    filter: &ExtendedFilter<'_>,
    start: &RunStart,
    z: &[f64],
    on_step: impl FnMut(usize, &PlatformState, &Covariance, &[f64]),
) -> Result<FilterResult, EkfError> {
    check_measurements(filter.plan(), z)?;
    let samples: usize = filter.plan().stages.iter().map(|s| s.steps * s.outputs.len()).sum();
    let poor = |s: &IterationResult| !s.converged || s.misfit > POOR * samples as f64;
    let once = filter.run(start, z, |_, _, _, _| {}).and_then(|once| back(filter, once.x));
    let mut found = once.and_then(|x| settle(filter, start, z, x));
    if found.as_ref().map_or(true, poor) {
        let other = settle_in_stages(filter, start, z);
        found = match (found, other) {
            (Ok(a), Ok(b)) => {
                let passes = a.passes + b.passes;
                Ok(IterationResult { passes, ..if b.is_better_than(&a) { b } else { a } })
            }
            (Ok(a), Err(_)) | (Err(_), Ok(a)) => Ok(a),
            (Err(e), Err(_)) => Err(e),
        };
    }
    let IterationResult { mut x0, passes, converged, .. } = found?;
    let curvature = if converged { bent(filter, start, z, &mut x0)? } else { None };
    let (x, covariance) = pass(filter, start, z, &x0, curvature.as_ref(), on_step)?.ended;
    Ok(FilterResult { x, covariance, passes, converged })
}

/// Curvature of the run about its most probable start `x0`, which becomes the mean of the likely starts.
fn bent(
    filter: &ExtendedFilter<'_>,
    start: &RunStart,
    z: &[f64],
    x0: &mut PlatformState,
) -> Result<Option<SecondOrderTerms>, EkfError> {
    let LinearisedRun { stages, at } = LinearisedRun::new(filter, usize::MAX, x0.clone())?;
    let p = pass(filter, start, z, x0, None, |_, _, _, _| {})?.start.covariance;
    let curvature = SecondOrderTerms::new(filter, x0, (&stages, &at), &p, &start.sigma)?;
    if let Some(c) = &curvature {
        x0.retract(&pass(filter, start, z, x0, Some(c), |_, _, _, _| {})?.start.correction);
    }
    Ok(curvature)
}

/// Validity of the small-angle model, and standard deviations at the end (SI units, by state), of a run at
/// the drifts in `conditions`. Equations of full attitudes are linearised along the run, with the prior and
/// without noise of the drift. `None` where the unknowns are the drift itself, where torquer errors act in
/// instantaneous turns, or for a run of too many steps.
///
/// # Errors
/// [`SimulationError`] for invalid conditions, and numbers that are not finite.
pub(crate) fn at_own_drifts(
    plan: &Plan,
    conditions: &Conditions,
) -> Result<Option<(Validity, Vec<f64>)>, SimulationError> {
    let steps = plan.segments.iter().map(|s| s.steps).sum::<usize>();
    if !plan.has_coefficients() || plan.torqued_at_once() || steps > MAX_ITERATED_STEPS {
        return Ok(None);
    }
    let start = RunStart::new(plan, conditions)?;
    let filter = ExtendedFilter::new(plan, conditions, Update::default())?;
    let mut x0 = PlatformState::of_unknowns(&start.truth, plan.constants());
    let at = Trajectory::new(&filter, x0.clone())?;
    let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let psi = |x: &PlatformState| -> f64 {
        let x = x.unknowns();
        x[..x.len() - plan.constants()].chunks_exact(3).map(length).fold(0.0, f64::max)
    };
    let largest = at.states.iter().map(psi).fold(0.0, f64::max);
    // noise-free measurements, and an initial estimate equal to the truth
    let known = RunStart { estimate: start.truth.clone(), ..start.clone() };
    let curvature = bent(&filter, &known, &at.outputs, &mut x0)?;
    let ended = pass(&filter, &known, &at.outputs, &x0, curvature.as_ref(), |_, _, _, _| {})?.ended;
    Ok(Some((Validity::of(plan, conditions, &start.truth, largest)?, ended.1.sigmas())))
}
