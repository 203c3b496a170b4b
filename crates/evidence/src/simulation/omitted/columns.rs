//! Columns of omitted errors in the samples of a plan: contribution of one SI unit of each error to Z, step
//! by step, and to psi.
//!
//! `psi^n` of an error obeys the equations of the platform by itself: `psi' = psi x omega_ie + eps`. It is
//! integrated over each step (exactly while a position lasts) and carried between positions as the scheme
//! says, without the filter's model. For a platform known to be tilted by E ([`Tilt`]) it is the error
//! `delta` of its attitude. Excitations are then those of the tilted attitude, and errors of the site change
//! the commands equally in platform axes.

use nalgebra::DMatrix;
use obsdeg_core::model::slew::{Slew, apply, rotation, rotation_vector, times, transpose};
use obsdeg_core::model::{
    AZIMUTH, Carry, Columns, Float, LOCAL, Matrix3, OmittedKind, OmittedModel, OmittedTerm, Platform,
    PlatformPoint, local_dynamics,
};
use obsdeg_ekf::integrate::van_loan;

use crate::simulation::state::inverse_left_jacobian;
use crate::simulation::{Plan, SegmentKind, SimulationError, Tilt};

/// Vectors of three components, by error.
type Vectors = Vec<[f64; 3]>;

/// Columns of all errors of a model, along the timeline of a plan.
pub struct OmittedColumns<'a> {
    plan: &'a Plan,
    model: &'a OmittedModel,
    /// Values for instantaneous turns on which torquer errors act.
    turning: Option<PlatformPoint<Float>>,
    /// Tilts of the platform, step by step; empty for a platform in the attitude of the scheme.
    tilts: Vec<Tilt>,
    /// Number of finished steps, over all segments.
    done: usize,
    segment: usize,
    /// Number of finished steps of the current segment.
    step: usize,
    /// `psi^n` of every error, including the offsets of the position.
    psi: Vectors,
    offset: Vectors,
    current: Option<DwellStep>,
    /// Outputs of the last step: one row per component, one entry per error.
    rows: Vec<f64>,
    /// Psi of the unknowns at the ends at which they are estimated: (unknown, one entry per error).
    ends: Vec<(usize, Vec<f64>)>,
}

/// One step at a position: `psi+ = phi psi + added`, and the errors of the accelerometers.
struct DwellStep {
    phi: Matrix3<f64>,
    added: Vectors,
    outputs: Vectors,
}

/// Three rows as one vector per error.
fn vectors(rows: &Columns<f64>) -> Vectors {
    (0..rows[0].len()).map(|k| [rows[0][k], rows[1][k], rows[2][k]]).collect()
}

fn sum(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}

impl<'a> OmittedColumns<'a> {
    /// Columns at the start of `plan`, for a platform in the attitude of the scheme.
    pub fn new(plan: &'a Plan, model: &'a OmittedModel) -> Self {
        Self::of_tilted(plan, model, Vec::new())
    }

    /// Columns for a platform with the tilts `tilts`, one per step of `plan`.
    pub fn of_tilted(plan: &'a Plan, model: &'a OmittedModel, tilts: Vec<Tilt>) -> Self {
        let turning = model.turning().and_then(|s| Platform::new(s.clone()).ok());
        let [w_n, w_u, _] = plan.earth_rate();
        let zero = vec![[0.0; 3]; model.terms().len()];
        Self {
            plan,
            model,
            turning: turning.map(|p| PlatformPoint::in_floats(&p, w_n, w_u)),
            tilts,
            done: 0,
            segment: 0,
            step: 0,
            psi: zero.clone(),
            offset: zero,
            current: None,
            rows: Vec::new(),
            ends: Vec::new(),
        }
    }

    /// Number of errors.
    pub fn errors(&self) -> usize {
        self.model.terms().len()
    }

    /// Rows of the next step in the order of the outputs of the plan (outputs x errors, row by row); empty
    /// for a step without outputs. `None` at the end.
    ///
    /// # Errors
    /// [`SimulationError`] for a number that is not finite.
    pub fn step(&mut self) -> Result<Option<&[f64]>, SimulationError> {
        let Some(segment) = self.plan.segments.get(self.segment) else { return Ok(None) };
        if self.step == 0 {
            self.enter()?;
        }
        match &segment.kind {
            SegmentKind::Dwell => self.dwell()?,
            SegmentKind::Slew(slew) => self.turn(slew, segment.dt, false),
            SegmentKind::Rotation(slew) => self.turn(slew, segment.dt, true),
        }
        // a step during which nothing is sampled, such as one of a wait, has no rows
        if self.plan.stages[self.segment].outputs.is_empty() {
            self.rows.clear();
        }
        self.step += 1;
        self.done += 1;
        if self.step == segment.steps {
            self.leave();
        }
        Ok(Some(&self.rows))
    }

    /// Changes of psi of the unknowns at the end: (unknown, one entry per error in rad). Under reset carry
    /// they belong to the end of each position.
    pub fn ends(&self) -> &[(usize, Vec<f64>)] {
        &self.ends
    }

    /// Begins a segment: adds instantaneous turns and offsets of a position, and computes the step of a
    /// dwell.
    fn enter(&mut self) -> Result<(), SimulationError> {
        let plan = self.plan;
        let segment = &plan.segments[self.segment];
        let position = segment.position;
        let before = self.segment.checked_sub(1).map(|s| &plan.segments[s]);
        if matches!(segment.kind, SegmentKind::Slew(_)) {
            return Ok(());
        }
        let c = plan.attitudes[position];
        if before.is_some_and(|b| b.position != position) {
            self.carry(position);
        }
        if before.is_none_or(|b| b.position != position || matches!(b.kind, SegmentKind::Slew(_))) {
            self.offset = vectors(&self.model.offsets(&Float, position, &c));
            let tilt = self.tilts.get(self.done).map(|t| t.from);
            self.add_offset(1.0, tilt);
        }
        if segment.kind == SegmentKind::Dwell && self.tilts.is_empty() {
            self.current = Some(self.dwelt(&c, segment.dt, None)?);
        }
        Ok(())
    }

    /// Adds the offsets of a position, turned with the platform.
    fn add_offset(&mut self, sign: f64, tilt: Option<Matrix3<f64>>) {
        for (p, offset) in self.psi.iter_mut().zip(&self.offset) {
            let own = tilt.map_or(*offset, |e| apply(&e, offset));
            *p = sum(p, &own.map(|x| sign * x));
        }
    }

    /// Carries psi from one position to the next without a slew.
    fn carry(&mut self, position: usize) {
        match self.plan.platform.scheme().carry {
            Carry::Reset => self.psi.fill([0.0; 3]),
            Carry::Platform => {
                let from = transpose(&self.plan.ends[position - 1]);
                let to = self.plan.attitudes[position];
                self.psi.iter_mut().for_each(|p| *p = apply(&to, &apply(&from, p)));
            }
            Carry::Inertial => {
                let left = self.turning.as_ref().and_then(|p| self.model.turned(p, position));
                if let Some(left) = left {
                    let tilt = self.tilts.get(self.done).map(|t| t.from);
                    let there = |l: [f64; 3]| tilt.map_or(l, |e| apply(&e, &l));
                    self.psi.iter_mut().zip(vectors(&left)).for_each(|(p, l)| *p = sum(p, &there(l)));
                }
            }
        }
    }

    /// Ends a segment: records psi at the end of a position and removes its offsets.
    fn leave(&mut self) {
        let plan = self.plan;
        let position = plan.segments[self.segment].position;
        let next = plan.segments.get(self.segment + 1);
        let slewing = matches!(plan.segments[self.segment].kind, SegmentKind::Slew(_));
        if !slewing && next.is_none_or(|n| n.position != position) {
            if next.is_none() || plan.platform.scheme().carry == Carry::Reset {
                self.end_of(position);
            }
            let tilt = self.done.checked_sub(1).and_then(|k| self.tilts.get(k)).map(|t| t.to);
            self.add_offset(-1.0, tilt);
            self.offset.fill([0.0; 3]);
        }
        self.segment += 1;
        self.step = 0;
    }

    /// Records psi of the unknowns at the end of a position: `psi^n = P psi`, P a rotation.
    fn end_of(&mut self, position: usize) {
        let block = &self.plan.blocks[position];
        for (k, &column) in block.columns[..3].iter().enumerate() {
            let own = |p: &[f64; 3]| (0..3).map(|r| block.rows[r][k] * p[r]).sum();
            self.ends.push((column, self.psi.iter().map(own).collect()));
        }
    }

    /// One step of `dt` seconds at an attitude.
    fn dwelt(&self, c: &Matrix3<f64>, dt: f64, tilt: Option<&Tilt>) -> Result<DwellStep, SimulationError> {
        let [w_n, w_u, _] = self.plan.earth_rate();
        let f = local_dynamics(&Float, &w_n, &w_u);
        let f = DMatrix::from_fn(LOCAL, LOCAL, |i, j| f[i][j]);
        let (local, _) = van_loan(&f, &DMatrix::zeros(LOCAL, LOCAL), dt)?;
        let part = |first: usize| -> Matrix3<f64> {
            std::array::from_fn(|i| std::array::from_fn(|j| local[(i, first + j)]))
        };
        let gamma = part(3);
        let drifts = self.drifts(c, None, tilt.map(middle).as_ref());
        let outputs = |c: &Matrix3<f64>| vectors(&self.model.output_rows(&Float, c));
        let (phi, outputs) = match tilt {
            None => (part(0), outputs(c)),
            Some(t) => {
                let back = transpose(&t.to);
                let there = outputs(&times(&t.to, c));
                (t.transition, there.iter().map(|a| apply(&back, a)).collect())
            }
        };
        Ok(DwellStep { phi, added: drifts.iter().map(|d| apply(&gamma, d)).collect(), outputs })
    }

    /// Drifts `eps^n` for the computed attitude `c` and the tilt `e` of the platform.
    fn drifts(&self, c: &Matrix3<f64>, slew: Option<&Slew>, e: Option<&Matrix3<f64>>) -> Vectors {
        let [w_n, w_u, _] = self.plan.earth_rate();
        let rate = self.plan.torqued_rate(c, slew);
        let Some(e) = e else { return vectors(&self.model.drift_rows(&Float, c, rate, [&w_n, &w_u])) };
        let there = vectors(&self.model.drift_rows(&Float, &times(e, c), rate, [&w_n, &w_u]));
        // a wrong command is the same in platform axes
        let turned = |(d, t): ([f64; 3], &OmittedTerm)| match t.kind {
            OmittedKind::Coefficient => d,
            _ => apply(e, &d),
        };
        there.into_iter().zip(self.model.terms()).map(turned).collect()
    }

    fn dwell(&mut self) -> Result<(), SimulationError> {
        let tilt = self.tilts.get(self.done);
        if tilt.is_some() {
            let segment = &self.plan.segments[self.segment];
            self.current = Some(self.dwelt(&self.plan.attitudes[segment.position], segment.dt, tilt)?);
        }
        let Some(step) = &self.current else { return Ok(()) };
        for (p, added) in self.psi.iter_mut().zip(&step.added) {
            *p = sum(&apply(&step.phi, p), added);
        }
        self.rows.clear();
        for &component in &self.plan.components {
            let of = |(p, a): (&[f64; 3], &[f64; 3])| match tilt {
                Some(t) => tilted_output(component, p, a, &t.to),
                None => output(component, p, a),
            };
            self.rows.extend(self.psi.iter().zip(&step.outputs).map(of));
        }
        Ok(())
    }

    /// Integrates one step of a turning platform by Runge-Kutta.
    fn turn(&mut self, slew: &Slew, dt: f64, sampled: bool) {
        let parts = self.plan.substeps(self.segment);
        let h = dt / parts as f64;
        for i in 0..parts {
            let t = i as f64 * h;
            let e = self.tilts.get(self.done).map(middle);
            let at = |t: f64| self.drifts(&slew.at(t), Some(slew), e.as_ref());
            let drifts = [at(t), at(t + h / 2.0), at(t + h)];
            let w = self.plan.earth_rate();
            for (k, p) in self.psi.iter_mut().enumerate() {
                let rate = |p: &[f64; 3], d: &[f64; 3]| sum(&cross(p, &w), d);
                let ahead =
                    |f: f64, r: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] + f * h * r[i]) };
                let k1 = rate(p, &drifts[0][k]);
                let k2 = rate(&ahead(0.5, &k1), &drifts[1][k]);
                let k3 = rate(&ahead(0.5, &k2), &drifts[1][k]);
                let k4 = rate(&ahead(1.0, &k3), &drifts[2][k]);
                *p = std::array::from_fn(|i| p[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
            }
        }
        self.rows.clear();
        if sampled {
            let outputs = vectors(&self.model.output_rows(&Float, &slew.at(dt)));
            for &component in &self.plan.components {
                self.rows.extend(self.psi.iter().zip(&outputs).map(|(p, a)| output(component, p, a)));
            }
        }
    }
}

/// Tilt `E` in the middle of a step.
fn middle(tilt: &Tilt) -> Matrix3<f64> {
    let turn = rotation_vector(&times(&tilt.to, &transpose(&tilt.from)));
    times(&rotation(&turn.map(|x| x / 2.0)), &tilt.from)
}

/// One component of Z of a platform tilted by `e`: `-E^T [g^n x] delta` and the error of the accelerometers,
/// or the azimuth.
fn tilted_output(component: usize, delta: &[f64; 3], accelerometers: &[f64; 3], e: &Matrix3<f64>) -> f64 {
    if component == AZIMUTH {
        return apply(&inverse_left_jacobian(&rotation_vector(e)), delta)[1];
    }
    let tilt = apply(&transpose(e), &[delta[2], 0.0, -delta[0]]);
    tilt[component - 1] + accelerometers[component - 1]
}

/// One component of Z: `(psi_z, 0, -psi_x)` and the error of the accelerometers, or `psi_y`.
fn output(component: usize, psi: &[f64; 3], accelerometers: &[f64; 3]) -> f64 {
    match component {
        1 => psi[2] + accelerometers[0],
        2 => accelerometers[1],
        AZIMUTH => psi[1],
        _ => -psi[0] + accelerometers[2],
    }
}

fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
