//! Columns of omitted errors in the samples of a plan: what one SI unit of each adds to Z, step by step, and
//! to psi.
//!
//! `psi^n` of an error obeys the equations of the platform by itself: `psi' = psi x omega_ie + eps`,
//! integrated over each step (exactly while a position lasts), carried between positions as the scheme says.
//! Nothing of the filter's model enters.

use nalgebra::DMatrix;
use obsdeg_core::model::slew::{Slew, apply, transpose};
use obsdeg_core::model::{
    AZIMUTH, Carry, Columns, Float, LOCAL, Matrix3, OmittedModel, Platform, Point, local_dynamics,
};
use obsdeg_ekf::integrate::van_loan;

use crate::simulation::{Plan, SegmentKind, SimulationError};

/// Three numbers of every error.
type Vectors = Vec<[f64; 3]>;

/// The columns of all errors of a model, along the timeline of a plan.
pub struct OmittedColumns<'a> {
    plan: &'a Plan,
    model: &'a OmittedModel,
    /// Turns at once on which torquer errors act.
    turning: Option<Point<Float>>,
    segment: usize,
    /// Steps of the segment that are done.
    step: usize,
    /// `psi^n` of every error, offsets of the position included.
    psi: Vectors,
    offset: Vectors,
    current: Option<Dwelt>,
    /// Outputs of the last step: one row per component, one entry per error.
    rows: Vec<f64>,
    /// Psi of the unknowns where it counts: (unknown, one entry per error).
    ends: Vec<(usize, Vec<f64>)>,
}

/// One step at a position: `psi+ = phi psi + added`, and the errors of the accelerometers.
struct Dwelt {
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
    /// Columns at the start of `plan`.
    pub fn new(plan: &'a Plan, model: &'a OmittedModel) -> Self {
        let turning = model.turning().and_then(|s| Platform::new(s.clone()).ok());
        let [w_n, w_u, _] = plan.earth_rate();
        let zero = vec![[0.0; 3]; model.terms().len()];
        Self {
            plan,
            model,
            turning: turning.map(|p| Point::in_floats(&p, w_n, w_u)),
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

    /// The rows of the next step in the order of the outputs of the plan (outputs x errors, row by row); none
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
            SegmentKind::Dwell => self.dwell(),
            SegmentKind::Slew(slew) => self.turn(slew, segment.dt, false),
            SegmentKind::Rotation(slew) => self.turn(slew, segment.dt, true),
        }
        self.step += 1;
        if self.step == segment.steps {
            self.leave();
        }
        Ok(Some(&self.rows))
    }

    /// Psi of the unknowns at the end, as far as the errors change it: (unknown, one entry per error in rad).
    /// Under reset carry at the end of each position.
    pub fn ends(&self) -> &[(usize, Vec<f64>)] {
        &self.ends
    }

    /// What begins with a segment: turns at once and offsets of a position, and the step of a dwell.
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
            self.psi.iter_mut().zip(&self.offset).for_each(|(p, o)| *p = sum(p, o));
        }
        if segment.kind == SegmentKind::Dwell {
            self.current = Some(self.dwelt(&c, segment.dt)?);
        }
        Ok(())
    }

    /// From one position to the next without a slew.
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
                    self.psi.iter_mut().zip(vectors(&left)).for_each(|(p, l)| *p = sum(p, &l));
                }
            }
        }
    }

    /// What ends with a segment.
    fn leave(&mut self) {
        let plan = self.plan;
        let position = plan.segments[self.segment].position;
        let next = plan.segments.get(self.segment + 1);
        let slewing = matches!(plan.segments[self.segment].kind, SegmentKind::Slew(_));
        if !slewing && next.is_none_or(|n| n.position != position) {
            if next.is_none() || plan.platform.scheme().carry == Carry::Reset {
                self.end_of(position);
            }
            self.psi.iter_mut().zip(&self.offset).for_each(|(p, o)| *p = sum(p, &o.map(|x| -x)));
            self.offset.fill([0.0; 3]);
        }
        self.segment += 1;
        self.step = 0;
    }

    /// Psi of the unknowns at the end of a position: `psi^n = P psi`, P a rotation.
    fn end_of(&mut self, position: usize) {
        let block = &self.plan.blocks[position];
        for (k, &column) in block.columns[..3].iter().enumerate() {
            let own = |p: &[f64; 3]| (0..3).map(|r| block.rows[r][k] * p[r]).sum();
            self.ends.push((column, self.psi.iter().map(own).collect()));
        }
    }

    /// One step of `dt` seconds at an attitude.
    fn dwelt(&self, c: &Matrix3<f64>, dt: f64) -> Result<Dwelt, SimulationError> {
        let [w_n, w_u, _] = self.plan.earth_rate();
        let f = local_dynamics(&Float, &w_n, &w_u);
        let f = DMatrix::from_fn(LOCAL, LOCAL, |i, j| f[i][j]);
        let (local, _) = van_loan(&f, &DMatrix::zeros(LOCAL, LOCAL), dt)?;
        let part = |first: usize| -> Matrix3<f64> {
            std::array::from_fn(|i| std::array::from_fn(|j| local[(i, first + j)]))
        };
        let drift = vectors(&self.drift(c, None));
        let gamma = part(3);
        let outputs = vectors(&self.model.output_rows(&Float, c));
        Ok(Dwelt { phi: part(0), added: drift.iter().map(|d| apply(&gamma, d)).collect(), outputs })
    }

    fn drift(&self, c: &Matrix3<f64>, slew: Option<&Slew>) -> Columns<f64> {
        let [w_n, w_u, _] = self.plan.earth_rate();
        self.model.drift_rows(&Float, c, self.plan.torqued_rate(c, slew), [&w_n, &w_u])
    }

    fn dwell(&mut self) {
        let Some(step) = &self.current else { return };
        for (p, added) in self.psi.iter_mut().zip(&step.added) {
            *p = sum(&apply(&step.phi, p), added);
        }
        self.rows.clear();
        for &component in &self.plan.components {
            self.rows.extend(self.psi.iter().zip(&step.outputs).map(|(p, a)| output(component, p, a)));
        }
    }

    /// One step while the platform turns, by Runge and Kutta.
    fn turn(&mut self, slew: &Slew, dt: f64, sampled: bool) {
        let parts = self.plan.substeps(self.segment);
        let h = dt / parts as f64;
        for i in 0..parts {
            let t = i as f64 * h;
            let at = |t: f64| vectors(&self.drift(&slew.at(t), Some(slew)));
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
