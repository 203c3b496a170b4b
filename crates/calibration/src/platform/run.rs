//! Record of one run on its own timeline: the scheme with the times of the record, linearised along a
//! trajectory.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::settings::DriftNoise;
use obsdeg_core::model::{Dwell, Scheme};
use obsdeg_ekf::{EkfError, Manifold, Measurement, Motion, ScalarOutput, Stage, Update};
use obsdeg_evidence::simulation::{Conditions, Extended, Plan, PlatformState, Segment, SegmentKind, Tilt};

use super::CalibrationError;
use super::clock::words;
use super::observe::{By, Reading};
use super::timeline::slews;
use crate::bins::{Bin, Mean};
use crate::least_squares::Linearised;

/// Smallest distance between two bins, in s.
const CLOSEST: f64 = 1e-6;

/// Run with its bins on its timeline.
#[derive(Debug, Clone)]
pub(crate) struct Run {
    pub reading: Reading,
    pub plan: Plan,
    /// Bin at the end of each segment of the plan, as (position, index).
    pub bins: Vec<Option<(usize, usize)>>,
    /// Flags by bin (in order) and channel: true if the measurement counts.
    pub counts: Vec<Vec<bool>>,
}

/// Measurement of a row of a linearised run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Key {
    pub position: usize,
    /// Index of the bin in the run.
    pub bin: usize,
    pub channel: usize,
}

/// Conditions of an estimate: random drift is a density, since the bins of a record have different lengths.
pub(crate) fn conditions(of: &Conditions) -> Conditions {
    let density = of.drift_noise.density_deg_sqrt_h(of.drift_noise_step_s);
    Conditions { drift_noise: DriftNoise::RandomWalk(density), ..of.clone() }
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

impl Run {
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
        let mut begins = vec![0.0; own.positions.len()];
        let mut stays = reading.stays.clone();
        let slews = slews(planned);
        let slew_s = |p: usize| slews[p];
        if reading.by == By::Static {
            // a window is not at rest for equal times before and behind a turn: the turn is in the middle of
            // the gap
            for p in 1..stays.len() {
                stays[p - 1].1 += ((stays[p].0 - stays[p - 1].1 - slew_s(p)) / 2.0).max(0.0);
            }
        }
        if matches!(reading.by, By::Label | By::Static) {
            // the platform leaves a position after its last sample, and spends the rest of a gap without slew
            // at the next position
            let mut left = 0.0;
            for (p, position) in own.positions.iter_mut().enumerate() {
                let turned = slew_s(p);
                let (first, last) = stays[p];
                begins[p] = left + turned;
                if begins[p] > first {
                    return Err(CalibrationError::Slew {
                        record: reading.name.clone(),
                        position: position.name.clone(),
                        gap_s: first - left,
                        slew_s: turned,
                        clock: reading.by_durations(planned).map_or_else(String::new, |fast| {
                            format!("; positions lie as by {}", words(fast))
                        }),
                    });
                }
                let dwell = (last - begins[p]).max(2.0 * CLOSEST * (1.0 + reading.bins[p].len() as f64));
                position.dwell = Dwell::from_seconds(dwell);
                left = begins[p] + dwell;
            }
        }
        let plan = Plan::derived(&own, conditions)?;
        for s in &plan.segments {
            if !matches!(s.kind, SegmentKind::Slew(_)) {
                begins[s.position] = s.start_s;
            }
        }
        let of = |s: &Segment| parts(&reading.bins[s.position], begins[s.position], s.steps as f64 * s.dt);
        let plan = plan.in_steps(conditions, of)?;
        let mut seen = vec![0; own.positions.len()];
        let mut bins = Vec::with_capacity(plan.segments.len());
        for s in &plan.segments {
            let next = seen[s.position];
            let there = !matches!(s.kind, SegmentKind::Slew(_)) && next < reading.bins[s.position].len();
            bins.push(there.then_some((s.position, next)));
            seen[s.position] += usize::from(there);
        }
        let all = bins.iter().flatten().count();
        let counts = vec![vec![true; plan.components.len()]; all];
        Ok(Self { reading, plan, bins, counts })
    }

    /// Number of bins.
    pub(crate) fn len(&self) -> usize {
        self.counts.len()
    }

    /// Measurements of the run in order, with their keys and bins.
    pub(crate) fn measured(&self) -> impl Iterator<Item = (Key, Mean, &Bin)> + '_ {
        let of = self.bins.iter().flatten().enumerate();
        of.flat_map(move |(bin, &(position, i))| {
            let b = &self.reading.bins[position][i];
            let means = b.channels.iter().enumerate();
            means.filter_map(move |(channel, m)| Some((Key { position, bin, channel }, (*m)?, b)))
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
        let filter = Extended::new(&self.plan, conditions, Update::default())?;
        let mut x = x0.clone();
        let tilt = |(k, s): (usize, &Segment)| filter.motion(k).tilt(0.0, s.dt, &mut x);
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
    ) -> Result<(Linearised, Vec<Key>), CalibrationError> {
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
    ) -> Result<(Linearised, Vec<Key>), CalibrationError> {
        let filter = Extended::new(&self.plan, conditions, Update::default())?;
        let (plan, n) = (&self.plan, self.plan.states());
        let (mut out, mut keys) = (Linearised::default(), Vec::new());
        let (mut x, mut bin) = (x0.clone(), 0);
        let mut nodes = nodes.iter().peekable();
        for (segment, s) in plan.segments.iter().enumerate() {
            let motion = filter.motion(segment);
            if let Some((_, node)) = nodes.next_if(|(at, _)| *at == segment) {
                let begins = x.clone().with_attitude_of(motion.block(), node);
                out.gaps.push((segment.saturating_sub(1), DVector::from_vec(x.local(&begins))));
                x = begins;
            }
            let (transition, noise) = motion.advance(0.0, s.dt, &mut x)?;
            let mut outputs = Vec::new();
            if let Some((position, i)) = self.bins[segment] {
                let (h, rows) = (motion.h(0.0, &x), Measurement::jacobian(&motion, 0.0, &x));
                for (channel, mean) in self.reading.bins[position][i].channels.iter().enumerate() {
                    let Some(mean) = mean.filter(|_| self.counts[bin][channel]) else { continue };
                    let row = rows.row(channel);
                    let h_of = row.iter().copied().enumerate().filter(|(_, c)| *c != 0.0).collect();
                    let r = mean.variance * if mean.given { 1.0 } else { sigmas[channel] * sigmas[channel] };
                    outputs.push(ScalarOutput { h: h_of, r });
                    out.residuals.push(mean.value - h[channel]);
                    keys.push(Key { position, bin, channel });
                }
                bin += 1;
            }
            out.roots.push(noise_root(plan, segment, n));
            out.stages.push(Stage { transition, noise: noise.into_owned(), outputs, steps: 1 });
        }
        if let Some(k) = out.residuals.iter().position(|x| !x.is_finite()) {
            let value = out.residuals[k];
            return Err(EkfError::NotFinite { what: "the residuals", value, row: k, column: 0 }.into());
        }
        Ok((out, keys))
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
