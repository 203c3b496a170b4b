//! Plan of a scheme in numbers: the timeline of positions and slews, and a filter stage with the linear model
//! of each.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::settings::Propagation;
use obsdeg_core::model::slew::{Slew, Turn, W_IE, apply, times, transpose};
use obsdeg_core::model::{
    AZIMUTH, Carry, ErrorSource, ErrorTerm, Float, LOCAL, Matrix3, Path, Platform, PlatformPoint,
    PositionBlock, Scheme, Station, Unknowns, earth_rate_in, local_dynamics, local_output,
};
use obsdeg_ekf::integrate::runge_kutta;
use obsdeg_ekf::{Process, ProcessNoise, ScalarOutput, SensorNoise, Stage, Transition};

use super::biases::{Bias, biases, root};
use super::conditions::{Conditions, latitude_of};
use super::error::SimulationError;
use super::limits::{MAX_INTEGRATION, MAX_NUMBERS, MAX_STEPS, MAX_TURNING_STEPS, MAX_UNKNOWNS};

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
pub(super) fn integration_steps(turn: f64) -> Result<usize, SimulationError> {
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

/// Scheme and conditions in SI units, ready to run.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Platform of the scheme.
    pub platform: Platform,
    /// Rates and attitudes in numbers.
    pub point: PlatformPoint<Float>,
    /// Attitude `C_c^n` at the start of every position.
    pub attitudes: Vec<Matrix3<f64>>,
    /// Attitude `C_c^n` at the end of every position.
    pub ends: Vec<Matrix3<f64>>,
    /// Map `S_i` at the start of every position. The contribution of torquer errors to psi^n in instantaneous
    /// turns belongs to the map, not to psi.
    pub blocks: Vec<PositionBlock<f64>>,
    /// Positions and slews in order of time.
    pub segments: Vec<PlanSegment>,
    /// Linear model of the filter, by segment.
    pub stages: Vec<Stage>,
    /// Random errors of the gyros X, Y, Z, in rad/s.
    pub gyros: [SensorNoise; 3],
    /// Bias states of gyros and accelerometers, behind the unknowns.
    pub biases: Vec<Bias>,
    /// Lower triangular root, by segment, of the noise covariance of a step on its psi states (rad) and the
    /// biases (rad/s, g).
    pub noise_roots: Vec<DMatrix<f64>>,
    /// Components of Z that are used (1, 3, with errors of the accelerometers 2, and [`AZIMUTH`]).
    pub components: Vec<usize>,
}

impl Plan {
    /// Plan of `scheme`; a scheme without latitude gets the default latitude.
    ///
    /// # Errors
    /// [`SimulationError`] for generic angles, slews without inertial carry, too many unknowns or steps, and
    /// conditions that are not positive.
    pub fn new(scheme: &Scheme, conditions: &Conditions) -> Result<Self, SimulationError> {
        conditions.validate()?;
        Self::derived(scheme, conditions)
    }

    /// Plan of a scheme and conditions derived from admitted ones: their numbers may lie beyond the admitted
    /// ranges.
    ///
    /// # Errors
    /// [`SimulationError`], see [`Self::new`].
    pub fn derived(scheme: &Scheme, conditions: &Conditions) -> Result<Self, SimulationError> {
        let scheme = Scheme { latitude: latitude_of(scheme), ..scheme.clone() };
        if let Some(name) = scheme.generic_names().first() {
            return Err(SimulationError::GenericAngle { name: name.clone() });
        }
        let rates = scheme.positions.iter().skip(1).map(|p| conditions.slew_rate(p));
        if scheme.carry != Carry::Inertial && rates.flatten().next().is_some() {
            return Err(SimulationError::SlewCarry { carry: scheme.carry });
        }
        let platform = Platform::new(scheme.clone())?;
        conditions.concern(&platform)?;
        let n = platform.names().len();
        if n > MAX_UNKNOWNS {
            return Err(SimulationError::TooManyUnknowns { found: n });
        }
        let point = point_of(&platform, conditions);
        let stations = scheme.stations();
        // stations at the start and at the end of every position
        let bounds: Vec<(usize, usize)> = (0..scheme.positions.len())
            .filter_map(|p| {
                let of = |s: &Station<'_>| s.index == p;
                Some((stations.iter().position(of)?, stations.iter().rposition(of)?))
            })
            .collect();
        let attitudes: Vec<_> = bounds.iter().map(|b| point.attitudes[b.0]).collect();
        let ends: Vec<_> = bounds.iter().map(|b| point.attitudes[b.1]).collect();
        let segments = timeline(&scheme, conditions, n, &attitudes, &ends)?;
        let mut blocks: Vec<Option<PositionBlock<f64>>> =
            platform.blocks(&point).into_iter().map(Some).collect();
        let blocks: Vec<_> = bounds.iter().filter_map(|b| blocks[b.0].take()).collect();
        let outputs = local_output(&Float, platform.observed());
        let components = outputs.iter().map(|(c, _)| *c).collect();
        let gyros = conditions.gyro_noise.sensors();
        let mut plan = Self {
            platform,
            point,
            attitudes,
            ends,
            blocks,
            segments,
            stages: Vec::new(),
            biases: biases(&gyros, &conditions.accelerometer()),
            gyros,
            noise_roots: Vec::new(),
            components,
        };
        plan.model(conditions)?;
        Ok(plan)
    }

    /// Computes the linear model of every segment.
    fn model(&mut self, conditions: &Conditions) -> Result<(), SimulationError> {
        let models = (0..self.segments.len()).map(|i| self.stage(i, conditions));
        (self.stages, self.noise_roots) = models.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        Ok(())
    }

    /// Plan with other steps: `parts` divides every segment at a position into (number of steps, step in s).
    ///
    /// # Errors
    /// [`SimulationError`], see [`Self::new`].
    pub fn in_steps(
        mut self,
        conditions: &Conditions,
        parts: impl Fn(&PlanSegment) -> Vec<(usize, f64)>,
    ) -> Result<Self, SimulationError> {
        let mut segments = Vec::new();
        for s in &self.segments {
            if matches!(s.kind, SegmentKind::Slew(_)) {
                segments.push(s.clone());
                continue;
            }
            let mut t = 0.0;
            for (steps, dt) in parts(s) {
                let part =
                    |kind, t: f64, steps| PlanSegment { kind, start_s: s.start_s + t, steps, dt, ..*s };
                match &s.kind {
                    // each step has a model of its own
                    SegmentKind::Rotation(whole) => segments.extend((0..steps).map(|i| {
                        let t = t + i as f64 * dt;
                        let slew = Slew { from: whole.at(t), duration_s: dt, ..whole.clone() };
                        part(SegmentKind::Rotation(slew), t, 1)
                    })),
                    kind => segments.push(part(kind.clone(), t, steps)),
                }
                t += steps as f64 * dt;
            }
        }
        self.segments = segments;
        self.model(conditions)?;
        Ok(self)
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.platform.names().len()
    }

    /// Number of states of the filter: the unknowns, then the biases.
    pub fn states(&self) -> usize {
        self.unknowns() + self.biases.len()
    }

    /// Number of states other than psi: coefficients and biases.
    pub fn constants(&self) -> usize {
        self.platform.coefficients() + self.biases.len()
    }

    /// Total time, in s.
    pub fn duration_s(&self) -> f64 {
        self.segments.last().map_or(0.0, |s| s.start_s + s.dt * s.steps as f64)
    }

    /// Slews: index of the position that each leads to, and its turn.
    pub fn slews(&self) -> impl Iterator<Item = (usize, Turn)> {
        self.segments.iter().filter_map(|s| match &s.kind {
            SegmentKind::Slew(slew) => Some((s.position, slew.turn())),
            SegmentKind::Dwell | SegmentKind::Rotation(_) => None,
        })
    }

    /// Psi states of a segment: the first three columns of its block.
    pub fn psi_columns(&self, segment: usize) -> &[usize] {
        &self.blocks[self.segments[segment].position].columns[..3]
    }

    /// Vector `psi^n` of the unknowns `x` at a segment's position (during a slew psi^n is carried).
    pub fn psi_n(&self, segment: usize, x: &[f64]) -> [f64; 3] {
        let block = &self.blocks[self.segments[segment].position];
        let row = |r: usize| block.rows[r].iter().zip(&block.columns).map(|(a, &c)| a * x[c]).sum();
        std::array::from_fn(row)
    }

    /// Standard deviation of a component of Z (in g), or of the azimuth (in rad).
    pub fn output_sigma(component: usize, conditions: &Conditions) -> f64 {
        if component == AZIMUTH {
            conditions.azimuth_noise_deg.to_radians()
        } else {
            conditions.accelerometer_noise_g
        }
    }

    /// Rows of Z at the end of a step of a segment (one per component), as functionals of the unknowns.
    pub(crate) fn output_rows(&self, segment: usize) -> Vec<Vec<(usize, f64)>> {
        let s = &self.segments[segment];
        let mut block = Cow::Borrowed(&self.blocks[s.position]);
        if let (SegmentKind::Rotation(turn), true) = (&s.kind, self.platform.observed().accelerometers) {
            let rows = self.platform.errors().accelerometer_rows(&Float, &turn.at(s.dt));
            for (old, new) in block.to_mut().rows[LOCAL - 3..].iter_mut().zip(rows) {
                old[3..].copy_from_slice(&new);
            }
        }
        local_output(&Float, self.platform.observed())
            .iter()
            .map(|(_, local)| {
                let entries =
                    block.columns.iter().enumerate().map(|(k, &c)| (c, block.entry(&Float, local, k)));
                entries.filter(|(_, x)| *x != 0.0).collect()
            })
            .collect()
    }

    /// Linear model of a segment, and the root of its noise.
    fn stage(
        &self,
        segment: usize,
        conditions: &Conditions,
    ) -> Result<(Stage, DMatrix<f64>), SimulationError> {
        let s = &self.segments[segment];
        let (n, states) = (self.unknowns(), self.states());
        let phi = self.psi_transition(segment, conditions)?;
        let q = self.psi_noise(s, conditions);
        let mut phi = phi.resize(states, states, 0.0);
        let mut q = DMatrix::from_fn(3, 3, |i, j| q[i][j]).resize(3 + states - n, 3 + states - n, 0.0);
        let moved: Vec<usize> = self.psi_columns(segment).iter().copied().chain(n..states).collect();
        if self.is_noisy() {
            let (own, noise) = self.bias_step(segment)?;
            q += noise;
            for (k, &c) in moved.iter().enumerate().skip(3) {
                for (i, &r) in moved.iter().enumerate() {
                    phi[(r, c)] = own[(i, k)];
                }
            }
        }
        let mut full = DMatrix::zeros(states, states);
        for (i, &r) in moved.iter().enumerate() {
            for (j, &c) in moved.iter().enumerate() {
                full[(r, c)] = q[(i, j)];
            }
        }
        let outputs = self.outputs(segment, conditions);
        let stage = Stage {
            transition: Transition::new(&phi)?,
            noise: ProcessNoise::new(&full)?,
            outputs,
            steps: s.steps,
        };
        Ok((stage, root(&q)))
    }

    /// Transition of the unknowns over a step of a segment.
    fn psi_transition(
        &self,
        segment: usize,
        conditions: &Conditions,
    ) -> Result<DMatrix<f64>, SimulationError> {
        let s = &self.segments[segment];
        if s.kind == SegmentKind::Dwell && conditions.propagation == Propagation::Exponential {
            return Ok(self.exponential(&self.blocks[s.position], s.dt));
        }
        let process = PlatformProcess { plan: self, segment };
        let start = DVector::zeros(self.unknowns());
        Ok(runge_kutta(&process, 0.0, &start, s.dt, self.substeps(segment))?.phi)
    }

    /// Covariance of psi from the random drift of a step of a segment; that of a slew is the one of the steps
    /// of a position of the same duration.
    fn psi_noise(&self, s: &PlanSegment, conditions: &Conditions) -> Matrix3<f64> {
        let block = &self.blocks[s.position];
        match &s.kind {
            SegmentKind::Dwell | SegmentKind::Rotation(_) => {
                self.held_noise(block, s.dt, conditions.drift_noise.held_rad_s(s.dt))
            }
            SegmentKind::Slew(_) => {
                let dt = conditions.step_s.min(s.dt);
                let held = conditions.drift_noise.held_rad_s(dt);
                self.held_noise(block, dt, held).map(|row| row.map(|x| x * s.dt / dt))
            }
        }
    }

    /// Outputs at the end of a step of a segment; none while samples are left out.
    fn outputs(&self, segment: usize, conditions: &Conditions) -> Vec<ScalarOutput> {
        let s = &self.segments[segment];
        if s.left_out || matches!(s.kind, SegmentKind::Slew(_)) {
            return Vec::new();
        }
        let n = self.unknowns();
        let output = |(mut h, &c): (Vec<(usize, f64)>, &usize)| {
            // biases of the accelerometers are in platform axes
            if c != AZIMUTH {
                let attitude = self.attitude(segment, s.dt);
                let entry = |(k, axis, _): (usize, usize, &Bias)| (n + k, attitude[c - 1][axis]);
                h.extend(self.accelerometer_biases().map(entry).filter(|(_, x)| *x != 0.0));
            }
            ScalarOutput { h, r: Self::output_sigma(c, conditions).powi(2) }
        };
        self.output_rows(segment).into_iter().zip(&self.components).map(output).collect()
    }

    /// Transition Phi of a dwell of `dt`: the exponential of the local dynamics, carried to the unknowns by
    /// `S_i`.
    fn exponential(&self, block: &PositionBlock<f64>, dt: f64) -> DMatrix<f64> {
        let (turned, held) = earth_step(self.point.w_n, self.point.w_u, dt);
        let n = self.unknowns();
        let mut phi = DMatrix::identity(n, n);
        // psi+ = P^T (A (P psi + J D) + B E D - J D); in local unknowns (drift alone) P = 1
        for (k, &column) in block.columns.iter().enumerate() {
            let after: [f64; 3] = std::array::from_fn(|r| {
                let mut of_local = [0.0; LOCAL];
                of_local[..3].copy_from_slice(&turned[r]);
                of_local[3..6].copy_from_slice(&held[r]);
                let torqued = if k < 3 { 0.0 } else { block.rows[r][k] };
                block.entry(&Float, &of_local, k) - torqued
            });
            for (i, &row) in block.columns[..3].iter().enumerate() {
                phi[(row, column)] = (0..3).map(|r| block.rows[r][i] * after[r]).sum();
            }
        }
        phi
    }

    /// Covariance of psi from a drift of standard deviation `held` (rad/s) held over `dt`.
    fn held_noise(&self, block: &PositionBlock<f64>, dt: f64, held: f64) -> Matrix3<f64> {
        let (_, b) = earth_step(self.point.w_n, self.point.w_u, dt);
        let p: Matrix3<f64> = std::array::from_fn(|r| std::array::from_fn(|k| block.rows[r][k]));
        let to_psi = times(&transpose(&p), &b);
        times(&to_psi, &transpose(&to_psi)).map(|row| row.map(|x| x * held * held))
    }
}

/// Psi after `dt` s by psi before (`exp(W dt)`, W the rate of the earth in rad/s) and by a constant drift
/// (the integral of `exp(W t)`, in s), by Rodrigues' formula. A plan of a record calls it for every bin;
/// buffers of matrix products, allocated between the results that stay, would fragment the memory.
fn earth_step(w_n: f64, w_u: f64, dt: f64) -> (Matrix3<f64>, Matrix3<f64>) {
    let f = local_dynamics(&Float, &w_n, &w_u);
    let w: Matrix3<f64> = std::array::from_fn(|i| std::array::from_fn(|j| f[i][j] * dt));
    let w2 = times(&w, &w);
    let x = w_n.hypot(w_u) * dt;
    let series = x < 0.1;
    let half = if x > 0.0 { (x / 2.0).sin() / (x / 2.0) } else { 1.0 };
    // sin x / x, (1 - cos x) / x^2, (x - sin x) / x^3
    let third = if series {
        1.0 / 6.0 - x * x / 120.0 + x.powi(4) / 5040.0 - x.powi(6) / 362_880.0
    } else {
        (x - x.sin()) / x.powi(3)
    };
    let (first, second) = (1.0 - third * x * x, 0.5 * half * half);
    let of = |a: f64, b: f64| -> Matrix3<f64> {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| f64::from(u8::from(i == j)) + a * w[i][j] + b * w2[i][j])
        })
    };
    (of(first, second), of(second, third).map(|row| row.map(|x| x * dt)))
}

/// Rates, attitudes and instantaneous turns of a scheme with a latitude and without generic angles.
fn point_of(platform: &Platform, conditions: &Conditions) -> PlatformPoint<Float> {
    let scheme = platform.scheme();
    let (c, s) = scheme
        .latitude
        .map_or((1.0, 0.0), |l| obsdeg_exact::TurnFraction::from_nanodeg(l.nanodeg()).cos_sin_f64());
    let mut point = PlatformPoint::in_floats(platform, W_IE * c, W_IE * s);
    // turns of finite duration are integrated instead
    for (station, turns) in scheme.stations().iter().zip(&mut point.turns) {
        if conditions.slew_rate(station.position).is_some() {
            turns.clear();
        }
    }
    point
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
fn timeline(
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

/// Linear model of one segment as a process: `psi' = psi x omega + eps` in the axes of the unknowns.
pub struct PlatformProcess<'a> {
    /// Plan of the scheme.
    pub plan: &'a Plan,
    /// Index of the segment, whose time starts at 0.
    pub segment: usize,
}

impl PlatformProcess<'_> {
    /// Rows of `psi'` in the axes of psi (3 x n).
    fn rows(&self, t: f64) -> [Vec<f64>; 3] {
        let plan = self.plan;
        let segment = &plan.segments[self.segment];
        let block = &plan.blocks[segment.position];
        let p: Matrix3<f64> = std::array::from_fn(|r| std::array::from_fn(|k| block.rows[r][k]));
        let f = local_dynamics(&Float, &plan.point.w_n, &plan.point.w_u);
        let w: Matrix3<f64> = std::array::from_fn(|i| std::array::from_fn(|j| f[i][j]));
        let to_psi = transpose(&p);
        let turning = times(&to_psi, &times(&w, &p));
        let drift: [Vec<f64>; 3] = match &segment.kind {
            SegmentKind::Slew(slew) | SegmentKind::Rotation(slew) => plan.drift_rows(&slew.at(t), Some(slew)),
            SegmentKind::Dwell => std::array::from_fn(|r| block.rows[3 + r][3..].to_vec()),
        };
        // psi^n = P psi + J D
        let torqued = |r: usize, k: usize| (0..3).map(|j| w[r][j] * block.rows[j][k]).sum::<f64>();
        let mut rows: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; plan.unknowns()]);
        for (i, row) in rows.iter_mut().enumerate() {
            for (k, &c) in block.columns.iter().enumerate() {
                row[c] = match k {
                    0..3 => turning[i][k],
                    _ => (0..3).map(|r| to_psi[i][r] * (drift[r][k - 3] + torqued(r, k))).sum(),
                };
            }
        }
        rows
    }
}

impl Process for PlatformProcess<'_> {
    fn states(&self) -> usize {
        self.plan.unknowns()
    }

    fn f(&self, t: f64, x: &DVector<f64>) -> DVector<f64> {
        let mut out = DVector::zeros(x.len());
        for (row, &c) in self.rows(t).iter().zip(self.plan.psi_columns(self.segment)) {
            out[c] = row.iter().zip(x.iter()).map(|(a, b)| a * b).sum();
        }
        out
    }

    fn jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(x.len(), x.len());
        for (row, &c) in self.rows(t).iter().zip(self.plan.psi_columns(self.segment)) {
            for (j, &value) in row.iter().enumerate() {
                out[(c, j)] = value;
            }
        }
        out
    }

    /// Zero: random drift is held over a step and enters as its covariance.
    fn noise(&self, _: f64) -> DMatrix<f64> {
        DMatrix::zeros(self.plan.unknowns(), self.plan.unknowns())
    }
}

/// Gravity `g^n`, in g.
pub(super) const G_N: [f64; 3] = [0.0, -1.0, 0.0];

impl Plan {
    /// Rows of `eps^n` at an attitude: torquers act with the earth rate, and with the rate of a slew (rad/s).
    pub(crate) fn drift_rows(&self, c: &Matrix3<f64>, slew: Option<&Slew>) -> [Vec<f64>; 3] {
        self.platform.errors().drift_rows(&Float, c, || self.torqued_rate(c, slew))
    }

    /// Rate at which the gyros are torqued at the attitude `c`, in the axes of c (rad/s).
    pub(crate) fn torqued_rate(&self, c: &Matrix3<f64>, slew: Option<&Slew>) -> [f64; 3] {
        let earth = earth_rate_in(&Float, c, &self.point.w_n, &self.point.w_u);
        std::array::from_fn(|i| earth[i] + slew.map_or(0.0, |s| s.rate[i]))
    }

    /// Slew of a segment; `None` if the platform does not turn.
    pub(super) fn turns(&self, segment: usize) -> Option<&Slew> {
        match &self.segments[segment].kind {
            SegmentKind::Dwell => None,
            SegmentKind::Slew(slew) | SegmentKind::Rotation(slew) => Some(slew),
        }
    }

    /// True if torquer errors act in instantaneous turns, which full attitudes do not have.
    pub fn torqued_at_once(&self) -> bool {
        self.point.turns.iter().any(|turns| !turns.is_empty())
    }

    /// Bound on the rate at which coefficients turn the platform, in rad/s: g is one at most, and torquers
    /// have the earth rate and that of the fastest turn.
    pub(crate) fn drift_bound(&self, coefficients: &[f64]) -> f64 {
        let fastest = (0..self.segments.len()).filter_map(|i| self.turns(i)).map(|s| s.turned(1.0));
        let fastest = fastest.fold(W_IE, f64::max);
        let of = |(term, d): (&ErrorTerm, &f64)| match term.source {
            ErrorSource::Gravity => d.abs(),
            ErrorSource::Rate => d.abs() * fastest,
            ErrorSource::Force => 0.0,
        };
        self.platform.error_terms().iter().zip(coefficients).map(of).sum()
    }

    /// Contribution of the accelerometers to `Z^n` at the attitude `c`, with the specific force `f` in their
    /// axes.
    pub(super) fn accelerometer_error(
        &self,
        c: &Matrix3<f64>,
        f: &[f64; 3],
        coefficients: &[f64],
    ) -> [f64; 3] {
        let rows = self.platform.errors().accelerometer_columns(&Float, f);
        apply(c, &rows.map(|row| row.iter().zip(coefficients).map(|(a, k)| a * k).sum()))
    }

    /// Earth rate `omega_ie^n`, in rad/s.
    pub fn earth_rate(&self) -> [f64; 3] {
        [self.point.w_n, self.point.w_u, 0.0]
    }

    /// Computed attitude `C_c^n` at time `t` of a segment.
    pub(super) fn attitude(&self, segment: usize, t: f64) -> Matrix3<f64> {
        let s = &self.segments[segment];
        match &s.kind {
            SegmentKind::Dwell => self.attitudes[s.position],
            SegmentKind::Slew(slew) | SegmentKind::Rotation(slew) => slew.at(t),
        }
    }

    /// Number of integration steps per step of a segment: psi turns with the earth rate, and the platform
    /// with the commanded rate.
    pub(crate) fn substeps(&self, segment: usize) -> usize {
        let s = &self.segments[segment];
        let turn = match &s.kind {
            SegmentKind::Dwell => W_IE * s.dt,
            SegmentKind::Slew(slew) | SegmentKind::Rotation(slew) => slew.turned(s.dt),
        };
        // the timeline has checked their number
        integration_steps(turn).unwrap_or(MAX_INTEGRATION)
    }

    /// True if the unknowns are coefficients, not the drift itself.
    pub(crate) fn has_coefficients(&self) -> bool {
        self.platform.scheme().unknowns != Unknowns::Drift
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use obsdeg_ekf::integrate::van_loan;

    /// Comparison with the exponential of the whole dynamics, from steps of microseconds to five days.
    #[test]
    fn earth_steps_are_exponentials() {
        let (w_n, w_u) = (W_IE * 0.8, W_IE * 0.6);
        let f = local_dynamics(&Float, &w_n, &w_u);
        let f = DMatrix::from_fn(6, 6, |i, j| f[i][j]);
        for dt in [1e-6, 1e-2, 10.0, 1300.0, 1371.0, 1372.0, 9e4, 4.3e5] {
            let (phi, _) = van_loan(&f, &DMatrix::zeros(6, 6), dt).expect("finite");
            let (turned, held) = earth_step(w_n, w_u, dt);
            for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
                assert!((turned[i][j] - phi[(i, j)]).abs() < 1e-13, "{dt}: {} {}", turned[i][j], phi[(i, j)]);
                let of = (held[i][j] - phi[(i, 3 + j)]) / dt;
                assert!(of.abs() < 1e-13, "{dt}: {} {}", held[i][j], phi[(i, 3 + j)]);
            }
        }
    }
}
