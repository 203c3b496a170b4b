//! Construction of a plan: its timeline, and the linear model of every segment.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::settings::Propagation;
use obsdeg_core::model::slew::{Slew, W_IE, times, transpose};
use obsdeg_core::model::{
    AZIMUTH, Carry, Float, LOCAL, Matrix3, Platform, PlatformPoint, PositionBlock, Scheme, Station,
    local_dynamics, local_output,
};
use obsdeg_ekf::integrate::runge_kutta;
use obsdeg_ekf::{ProcessNoise, ScalarOutput, Stage, Transition};

use super::super::biases::{Bias, biases, root};
use super::super::conditions::{Conditions, latitude_of};
use super::super::error::SimulationError;
use super::super::limits::MAX_UNKNOWNS;
use super::Plan;
use super::process::PlatformProcess;
use super::timeline::{PlanSegment, SegmentKind, timeline};

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
