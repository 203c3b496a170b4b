//! Record of one run on its own timeline: the scheme with the times of the record, linearised along a
//! trajectory.

use std::iter::Peekable;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::settings::DriftNoise;
use obsdeg_core::model::{Dwell, Scheme};
use obsdeg_core::span::Span;
use obsdeg_ekf::{
    EkfError, Manifold, Measurement, Motion, ProcessNoise, ScalarOutput, Stage, Transition, Update,
};
use obsdeg_evidence::simulation::{
    Conditions, ExtendedFilter, Plan, PlanSegment, PlatformMotion, PlatformState, SegmentKind, Tilt,
};

use super::CalibrationError;
use super::clock::words;
use super::placed::BinPlace;
use super::placed::Reading;
use super::timeline::slews;
use crate::bins::{Bin, Mean};
use crate::least_squares::Linearised;
use crate::least_squares::TrajectoryGap;

/// Smallest distance between two bins, in s.
const CLOSEST: f64 = 1e-6;

/// Run with its bins on its timeline.
#[derive(Debug, Clone)]
pub(crate) struct RecordedRun {
    pub reading: Reading,
    pub plan: Plan,
    /// Bin at the end of each segment of the plan.
    pub bins: Vec<Option<BinPlace>>,
    /// Flags by bin (in order) and channel: true if the measurement counts.
    pub counts: Vec<Vec<bool>>,
    /// Changes of position whose time the rows leave open, in order.
    pub changes: Vec<PositionChange>,
}

/// Change of position at a time that is known to within an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PositionChange {
    /// Index of the position that begins.
    pub to: usize,
    /// Its first segment.
    pub begin: usize,
    /// Length of the interval, in s.
    pub open: f64,
}

/// Time over which a rate of drift is taken, in s.
const RATE_S: f64 = 1.0;
/// Noise of a change of position in all directions, as a fraction of that along the difference of the
/// drifts: it makes the covariance definite.
const AROUND: f64 = 1e-3;

/// Distance in time of the values whose differences give second derivatives, in s.
const BEND_S: f64 = 10.0;
/// Time in a position for which second derivatives are taken to be constant, in s: they change with the drift
/// and the rate of the earth, by about a hundredth.
const STEADY_S: f64 = 100.0;
/// Largest usual second derivative of Z in g/s^2: drifts of 30 deg/h that turn with the earth.
const BENDS: f64 = 2e-8;
/// Change of a mean by curvature, in sigma, below which the mean is that of a line.
const FLAT: f64 = 0.003;

/// Rate at which the platform drifts from `x`, in local coordinates (shape n, 1/s).
fn rate(motion: &impl Motion<PlatformState>, x: &PlatformState) -> Result<Vec<f64>, EkfError> {
    let mut moved = x.clone();
    motion.advance(0.0, RATE_S, &mut moved)?;
    let mut out = moved.local(x);
    out[3 * x.attitudes()..].fill(0.0);
    out.iter_mut().for_each(|d| *d /= RATE_S);
    Ok(out)
}

/// Second derivatives of the outputs at a position, in units of the outputs per s^2, and the time of the run
/// until which they are used, in s.
struct SecondDerivatives {
    position: usize,
    until: f64,
    values: Vec<f64>,
}

/// Second derivatives of the outputs from `x` on, in units of the outputs per s^2.
fn bend(
    motion: &(impl Motion<PlatformState> + Measurement<PlatformState>),
    x: &PlatformState,
) -> Result<Vec<f64>, EkfError> {
    let mut later = x.clone();
    let mut values = || -> Result<Vec<f64>, EkfError> {
        let here = motion.h(0.0, &later).iter().copied().collect();
        motion.advance(0.0, BEND_S, &mut later)?;
        Ok(here)
    };
    let [a, b, c] = [values()?, values()?, values()?];
    Ok(a.iter().zip(b).zip(c).map(|((a, b), c)| (a - 2.0 * b + c) / (BEND_S * BEND_S)).collect())
}

/// Root of the noise of a step with that of a change of position at its end: its time is uniform within
/// `open` s, and the state changes by `drift` per second.
fn with_change(root: DMatrix<f64>, drift: &[f64], open: f64) -> DMatrix<f64> {
    let sigma = open / 12f64.sqrt();
    let drift = DVector::from_column_slice(drift) * sigma;
    let moved: Vec<usize> = (0..drift.len()).filter(|&i| drift[i] != 0.0).collect();
    let first = root.ncols();
    let mut out = root.resize_horizontally(first + 1 + moved.len(), 0.0);
    out.set_column(first, &drift);
    for (k, &i) in moved.iter().enumerate() {
        out[(i, first + 1 + k)] = AROUND * drift.norm();
    }
    out
}

/// Measurement of a row of a linearised run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MeasurementKey {
    pub position: usize,
    /// Index of the bin in the run.
    pub bin: usize,
    pub channel: usize,
}

/// Conditions of an estimate: random drift is a density, since the bins of a record have different lengths,
/// and rows that are left out are no bins.
pub(crate) fn conditions(of: &Conditions) -> Conditions {
    let density = of.drift_noise.density_deg_sqrt_h(of.drift_noise_step_s);
    Conditions { drift_noise: DriftNoise::RandomWalk(density), settle_s: 0.0, ..of.clone() }
}

/// Parts of a position that begins at `begin`: the steps to its bins, and the rest. Bins lie inside the
/// position, whatever their stamps.
fn parts(bins: &[Bin], begin: f64, length: f64) -> Vec<(usize, f64)> {
    let mut at = begin;
    let mut out: Vec<(usize, f64)> = Vec::with_capacity(bins.len() + 1);
    for bin in bins {
        let dt = (bin.t.min(begin + length) - at).max(CLOSEST);
        out.push((1, dt));
        at += dt;
    }
    let rest = begin + length - at;
    if rest > CLOSEST {
        out.push((1, rest));
    }
    out
}

/// Lengths of the intervals in which the rows leave open when each position begins, in s. Ends of `stays`
/// move to their middles.
fn open_ends(reading: &Reading, stays: &mut [Span<f64>], slews: &[f64]) -> Vec<f64> {
    let mut open = vec![0.0; reading.bins.len()];
    if reading.ends_open {
        // the platform leaves a position at any time between its last row and the latest time from which
        // the slew takes it to the next position before the first row there: on average in the middle
        for p in 1..stays.len() {
            open[p] = (stays[p].from - stays[p - 1].to - slews[p]).max(0.0);
            stays[p - 1].to += open[p] / 2.0;
        }
    }
    open
}

/// Sets the dwells of the positions of `own` and their beginnings (s) to those of the record. The platform
/// spends the rest of a gap without slew at the next position.
///
/// # Errors
/// [`CalibrationError::Slew`].
fn dwell_as_recorded(
    reading: &Reading,
    stays: &[Span<f64>],
    slews: &[f64],
    planned: &Plan,
    own: &mut Scheme,
    begins: &mut [f64],
) -> Result<(), CalibrationError> {
    let mut left = 0.0;
    for (p, position) in own.positions.iter_mut().enumerate() {
        let turned = slews[p];
        let Span { from: first, to: last } = stays[p];
        begins[p] = left + turned;
        if begins[p] > first {
            return Err(CalibrationError::Slew {
                record: reading.name.clone(),
                position: position.name.clone(),
                gap_s: first - left,
                slew_s: turned,
                clock: reading
                    .by_durations(planned)
                    .map_or_else(String::new, |rate| format!("; positions lie as by {}", words(rate.fast))),
            });
        }
        let dwell = (last - begins[p]).max(2.0 * CLOSEST * (1.0 + reading.bins[p].len() as f64));
        position.dwell = Dwell::from_seconds(dwell);
        left = begins[p] + dwell;
    }
    Ok(())
}

/// Bin at the end of each segment of a plan, and the changes of position, each of which is `open` by some
/// time (s).
fn bins_of_segments(
    plan: &Plan,
    reading: &Reading,
    open: &[f64],
) -> (Vec<Option<BinPlace>>, Vec<PositionChange>) {
    let mut seen = vec![0; open.len()];
    let mut bins = Vec::with_capacity(plan.segments.len());
    let mut changes: Vec<PositionChange> = Vec::new();
    for (k, s) in plan.segments.iter().enumerate() {
        let next = seen[s.position];
        let at_rest = !matches!(s.kind, SegmentKind::Slew(_));
        let there = at_rest && next < reading.bins[s.position].len();
        let from = changes.last().map_or(0, |c| c.begin);
        if at_rest && s.position > plan.segments[from].position {
            // an attitude of its own begins where the position does
            let carried = plan.psi_columns(from) == plan.psi_columns(k);
            let open = if carried { open[s.position] } else { 0.0 };
            changes.push(PositionChange { to: s.position, begin: k, open });
        }
        bins.push(there.then_some(BinPlace { position: s.position, index: next }));
        seen[s.position] += usize::from(there);
    }
    changes.retain(|c| c.open > CLOSEST);
    (bins, changes)
}

impl RecordedRun {
    /// Places a reading on the timeline of `scheme`, whose own plan is `planned`: positions begin and end as
    /// in the record.
    ///
    /// # Errors
    /// [`CalibrationError`].
    pub(crate) fn new(
        reading: Reading,
        scheme: &Scheme,
        planned: &Plan,
        conditions: &Conditions,
    ) -> Result<Self, CalibrationError> {
        let mut own = scheme.clone();
        let mut stays = reading.stays.clone();
        let slews = slews(planned);
        let open = open_ends(&reading, &mut stays, &slews);
        let mut begins = vec![0.0; own.positions.len()];
        if reading.by.own_time() {
            dwell_as_recorded(&reading, &stays, &slews, planned, &mut own, &mut begins)?;
        }
        let plan = Plan::derived(&own, conditions)?;
        for s in &plan.segments {
            if !matches!(s.kind, SegmentKind::Slew(_)) {
                begins[s.position] = s.start_s;
            }
        }
        let of =
            |s: &PlanSegment| parts(&reading.bins[s.position], begins[s.position], s.steps as f64 * s.dt);
        let plan = plan.in_steps(conditions, of)?;
        let (bins, changes) = bins_of_segments(&plan, &reading, &open);
        let all = bins.iter().flatten().count();
        let counts = vec![vec![true; plan.components.len()]; all];
        Ok(Self { reading, plan, bins, counts, changes })
    }

    /// Number of bins.
    pub(crate) fn len(&self) -> usize {
        self.counts.len()
    }

    /// Measurements of the run in order, with their keys and bins.
    pub(crate) fn measured(&self) -> impl Iterator<Item = (MeasurementKey, Mean, &Bin)> + '_ {
        let of = self.bins.iter().flatten().enumerate();
        of.flat_map(move |(bin, place)| {
            let (position, b) = (place.position, self.reading.bin(place));
            let means = b.channels.iter().enumerate();
            means.filter_map(move |(channel, m)| Some((MeasurementKey { position, bin, channel }, (*m)?, b)))
        })
    }

    /// Tilts of the platform along the trajectory from `x0`, step by step.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    pub(super) fn tilts(
        &self,
        conditions: &Conditions,
        x0: &PlatformState,
    ) -> Result<Vec<Tilt>, CalibrationError> {
        let filter = ExtendedFilter::new(&self.plan, conditions, Update::default())?;
        let mut x = x0.clone();
        let tilt = |(k, s): (usize, &PlanSegment)| filter.motion(k).tilt(0.0, s.dt, &mut x);
        Ok(self.plan.segments.iter().enumerate().map(tilt).collect::<Result<_, _>>()?)
    }

    /// Run linearised along the trajectory from `x0`, with all bins that count; `sigmas` are those of a
    /// sample, by channel.
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    pub(crate) fn along(
        &self,
        conditions: &Conditions,
        sigmas: &[f64],
        x0: &PlatformState,
    ) -> Result<(Linearised, Vec<MeasurementKey>), CalibrationError> {
        self.along_parts(conditions, sigmas, x0, &[])
    }

    /// Run linearised along a trajectory in parts: each node has the segment at which its part begins, and
    /// its attitude (the constants are those of the trajectory).
    ///
    /// # Errors
    /// [`CalibrationError`] for a number that is not finite.
    pub(super) fn along_parts(
        &self,
        conditions: &Conditions,
        sigmas: &[f64],
        x0: &PlatformState,
        nodes: &[(usize, PlatformState)],
    ) -> Result<(Linearised, Vec<MeasurementKey>), CalibrationError> {
        let filter = ExtendedFilter::new(&self.plan, conditions, Update::default())?;
        let mut out = Linearised::default();
        let mut along = RunLinearisation::new(self, sigmas, &filter, x0);
        let mut nodes = nodes.iter().peekable();
        for (segment, s) in self.plan.segments.iter().enumerate() {
            let motion = filter.motion(segment);
            if let Some((_, node)) = nodes.next_if(|(at, _)| *at == segment) {
                let begins = along.x.clone().with_attitude_of(motion.block(), node);
                let end = DVector::from_vec(along.x.local(&begins));
                out.gaps.push(TrajectoryGap { step: segment.saturating_sub(1), end });
                along.x = begins;
            }
            let (transition, noise) = motion.advance(0.0, s.dt, &mut along.x)?;
            along.now += s.dt;
            let outputs = along.outputs(segment, &motion)?;
            let (root, noise) = along.noise(segment, &motion, &transition, noise.into_owned())?;
            out.roots.push(root);
            out.stages.push(Stage { transition, noise, outputs, steps: 1 });
        }
        out.residuals = along.residuals;
        if let Some(k) = out.residuals.iter().position(|x| !x.is_finite()) {
            let value = out.residuals[k];
            return Err(EkfError::NotFinite { what: "the residuals", value, row: k, column: 0 }.into());
        }
        Ok((out, along.keys))
    }
}

/// Linearisation of a run, segment by segment.
struct RunLinearisation<'a> {
    run: &'a RecordedRun,
    /// Standard deviations of a sample, by channel.
    sigmas: &'a [f64],
    filter: &'a ExtendedFilter<'a>,
    /// State of the trajectory, and its time in s.
    x: PlatformState,
    now: f64,
    /// Index of the next bin.
    bin: usize,
    residuals: Vec<f64>,
    keys: Vec<MeasurementKey>,
    second: Option<SecondDerivatives>,
    /// Changes of position that follow, and the drift (1/s) before the next, carried to the trajectory's
    /// time.
    changes: Peekable<std::slice::Iter<'a, PositionChange>>,
    drift: Vec<f64>,
    scratch: Vec<f64>,
}

impl<'a> RunLinearisation<'a> {
    /// Linearisation before the first segment, from `x0`.
    fn new(
        run: &'a RecordedRun,
        sigmas: &'a [f64],
        filter: &'a ExtendedFilter<'a>,
        x0: &PlatformState,
    ) -> Self {
        Self {
            run,
            sigmas,
            filter,
            x: x0.clone(),
            now: 0.0,
            bin: 0,
            residuals: Vec::new(),
            keys: Vec::new(),
            second: None,
            changes: run.changes.iter().peekable(),
            drift: Vec::new(),
            scratch: Vec::new(),
        }
    }

    /// Rows of the measurements that count at the end of a segment.
    fn outputs(
        &mut self,
        segment: usize,
        motion: &PlatformMotion<'_>,
    ) -> Result<Vec<ScalarOutput>, EkfError> {
        let (run, sigmas, now, bin) = (self.run, self.sigmas, self.now, self.bin);
        let mut outputs = Vec::new();
        let Some(place) = &run.bins[segment] else { return Ok(outputs) };
        let position = place.position;
        let channels = &run.reading.bin(place).channels;
        let bent = channels.iter().zip(sigmas).any(|(mean, sigma)| {
            let bends =
                |m: &Mean| m.bend * BENDS > FLAT * m.variance.sqrt() * if m.given { 1.0 } else { *sigma };
            mean.as_ref().is_some_and(bends)
        });
        let steady = |b: &SecondDerivatives| b.position == position && b.until >= now;
        if bent && !self.second.as_ref().is_some_and(steady) {
            let values = bend(motion, &self.x)?;
            self.second = Some(SecondDerivatives { position, until: now + STEADY_S, values });
        }
        let (h, rows) = (motion.h(0.0, &self.x), Measurement::jacobian(motion, 0.0, &self.x));
        for (channel, mean) in channels.iter().enumerate() {
            let Some(mean) = mean.filter(|_| run.counts[bin][channel]) else { continue };
            let row = rows.row(channel);
            let h_of = row.iter().copied().enumerate().filter(|(_, c)| *c != 0.0).collect();
            let r = mean.variance * if mean.given { 1.0 } else { sigmas[channel] * sigmas[channel] };
            outputs.push(ScalarOutput { h: h_of, r });
            let bend = match &self.second {
                Some(b) if bent => b.values[channel],
                _ => 0.0,
            };
            self.residuals.push(mean.value - h[channel] - bend * mean.bend);
            self.keys.push(MeasurementKey { position, bin, channel });
        }
        self.bin += 1;
        Ok(outputs)
    }

    /// Noise of a segment with its root. A change of position that is later by some time adds the drift
    /// before it, carried through the slew, and takes away that behind it.
    fn noise(
        &mut self,
        segment: usize,
        motion: &PlatformMotion<'_>,
        transition: &Transition,
        noise: ProcessNoise,
    ) -> Result<(DMatrix<f64>, ProcessNoise), EkfError> {
        let plan = &self.run.plan;
        let root = noise_root(plan, segment, plan.states());
        let Some(&&change) = self.changes.peek() else { return Ok((root, noise)) };
        let (position, next) = (plan.segments[segment].position, segment + 1);
        if position < change.to && plan.segments[next].position == change.to {
            self.drift = rate(motion, &self.x)?;
        } else if position == change.to {
            transition.apply(&mut self.drift, &mut self.scratch);
        }
        if next != change.begin {
            return Ok((root, noise));
        }
        let behind = rate(&self.filter.motion(next), &self.x)?;
        self.drift.iter_mut().zip(behind).for_each(|(d, b)| *d -= b);
        let root = with_change(root, &self.drift, change.open);
        let noise = ProcessNoise::new(&(&root * root.transpose()))?;
        self.changes.next();
        Ok((root, noise))
    }
}

/// Root of the noise of a segment of a plan on all `n` states, without directions of zero noise.
pub(super) fn noise_root(plan: &Plan, segment: usize, n: usize) -> DMatrix<f64> {
    let root = &plan.noise_roots[segment];
    let moved: Vec<usize> = plan.psi_columns(segment).iter().copied().chain(plan.unknowns()..n).collect();
    let there: Vec<usize> = (0..root.ncols()).filter(|&j| root.column(j).amax() > 0.0).collect();
    let mut out = DMatrix::zeros(n, there.len());
    for (k, &j) in there.iter().enumerate() {
        for (i, &row) in moved.iter().enumerate() {
            out[(row, k)] = root[(i, j)];
        }
    }
    out
}
