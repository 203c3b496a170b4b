//! Evaluator of a search: its candidates, their dwells and the prior.

use std::ops::Mul;
use std::sync::{Arc, OnceLock};

use nalgebra::DMatrix;
use obsdeg_core::model::slew::Slew;
use obsdeg_core::model::{
    Carry, Float, LOCAL, Matrix3, PSI_EPS, Platform, earth_rate_in, local_dynamics, local_output,
};
use obsdeg_ekf::BiasState;
use obsdeg_ekf::integrate::van_loan;
use obsdeg_evidence::simulation::{Conditions, Plan, SimulationError, left_out, steps};

use crate::design::measure::elimination::eliminate;
use crate::design::measure::noise_process::{
    BiasDistribution, DwellInformation, ObservedComponent, of_dwell,
};
use crate::design::measure::omitted::{OmittedAt, OmittedErrors, OmittedSums, with_accelerometer};
use crate::design::measure::slew_path::SlewPath;
use crate::design::request::error::DesignError;
use crate::design::request::limits::MAX_UNKNOWNS;

/// One candidate: its attitude, with the effects of the coefficients on drift and accelerometers there.
#[derive(Debug, Clone)]
pub(crate) struct CandidateAttitude {
    pub(crate) c: Matrix3<f64>,
    /// `eps^n = C E(g)`, then the error of the accelerometers in `Z^n` (3 x d each), columns in the
    /// order of the evaluator; the last three are empty if no accelerometer error is unknown.
    pub(crate) effects: [Vec<f64>; LOCAL - 3],
    /// Information of a position there on the coefficients, psi eliminated (n x n, row by row, lower
    /// triangle): its contribution to any scheme under reset carry; empty under the other carries.
    pub(crate) own: Vec<f64>,
    /// Psi of a position there under reset carry, computed when first needed.
    pub(crate) psi: OnceLock<OwnPsi>,
    /// Effects of errors that are not estimated, at this attitude.
    pub(crate) omitted: OmittedAt,
    /// Index of its dwell in the evaluator.
    pub(crate) dwell: usize,
}

/// Psi of a single position in platform axes, at the end of the position.
#[derive(Debug, Clone)]
pub(crate) struct OwnPsi {
    /// Variance of every component in rad^2, prior included, for known coefficients; infinite where it
    /// is not determined.
    pub(crate) variances: [f64; 3],
    /// Error of each component as a functional of the errors of the coefficients (d x 3, in the order
    /// of the evaluator); zero where it is not determined.
    pub(crate) moved: Vec<[f64; 3]>,
}

/// Information and transition of a dwell for the local unknowns of a position.
#[derive(Debug, Clone)]
pub(crate) struct Dwelling {
    pub(crate) seconds: f64,
    /// Information of the position on its local unknowns.
    pub(crate) local: [[f64; LOCAL]; LOCAL],
    /// Information as in `local`, with the errors of the accelerometers, whether or not they are
    /// unknown.
    pub(crate) full: [[f64; LOCAL]; LOCAL],
    /// `psi^n` after the dwell as a function of `(psi^n, eps^n)` before it.
    pub(crate) phi: [[f64; PSI_EPS]; 3],
    /// Information of the samples where the noise of Z is correlated; `None` for white noise.
    pub(crate) correlated: Option<Box<DwellInformation>>,
}

/// Prior information; zero where none is stated.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Prior {
    /// Information on psi in platform axes at the start (under reset carry of every position), in
    /// 1/rad^2.
    pub(crate) psi: [f64; 3],
    /// Information on the coefficients, in the order and the units of the evaluator (shape d).
    pub(crate) coefficients: Vec<f64>,
}

/// Evaluator of sequences: data that all evaluations share.
#[derive(Debug, Clone)]
pub struct Evaluator {
    pub(crate) platform: Platform,
    pub(crate) conditions: Conditions,
    /// Column of every coefficient in the order of the evaluator: those that count come last.
    pub(crate) order: Vec<usize>,
    /// Number of coefficients that do not count.
    pub(crate) nuisance: usize,
    /// Unit of every coefficient that is shown as 1, in `dph`, in the order of the evaluator.
    pub(crate) scale: Vec<f64>,
    /// Number of unknowns: three of psi, then d coefficients.
    pub(crate) n: usize,
    /// Number of local unknowns of a position.
    pub(crate) locals: usize,
    /// Rotation of the dynamics of psi^n: `psi' = W psi + eps`.
    pub(crate) w: Matrix3<f64>,
    /// Dwells by `CandidateAttitude::dwell`: one for all positions, or one per candidate.
    pub(crate) dwells: Vec<Dwelling>,
    pub(crate) candidates: Vec<CandidateAttitude>,
    /// Slew path from candidate i to j at `i * candidates + j`; empty if repositioning takes no time.
    pub(crate) slew_paths: Vec<SlewPath>,
    pub(crate) prior: Prior,
    /// Bias process of each accelerometer beside its white noise; `None` for white noise alone.
    pub(crate) bias: Option<BiasState>,
    /// Errors that are not estimated and count in total uncertainties; `None` without such errors.
    pub(crate) omitted: Option<Arc<OmittedErrors>>,
    /// 1 deg/h in rad/s. Coefficients of other units are scaled to it: a sigma divided by it is in the
    /// unit of its coefficient.
    pub(crate) dph: f64,
}

/// Information of a sequence of positions.
#[derive(Debug, Clone)]
pub struct SequenceState {
    /// Information (n x n), row by row, lower triangle.
    pub(crate) information: Vec<f64>,
    /// Psi in the carried axes as a functional of the unknowns (3 x n).
    pub(crate) psi: [Vec<f64>; 3],
    /// Distribution of the accelerometer biases given the unknowns; `None` for white noise of Z.
    pub(crate) joint: Option<BiasDistribution>,
    /// Effects of errors that are not estimated; `None` where they do not count.
    pub(crate) beside: Option<Box<OmittedSums>>,
    /// Candidates in order: index of each.
    pub(crate) path: Vec<usize>,
    /// Time of dwells and turns so far, in s.
    pub seconds: f64,
}

impl Evaluator {
    /// Evaluator with the same dwell `dwell_s`, in s, at every position.
    ///
    /// # Errors
    /// [`DesignError::Filter`].
    pub fn with_dwell(mut self, dwell_s: f64) -> Result<Self, DesignError> {
        self.dwells = vec![self.dwelling(dwell_s)?];
        let attitudes: Vec<Matrix3<f64>> = self.candidates.iter().map(|c| c.c).collect();
        let slew_paths = std::mem::take(&mut self.slew_paths);
        self.stand_at(&attitudes);
        self.slew_paths = slew_paths;
        Ok(self)
    }

    /// Dwell of `dwell_s` seconds at a position, without the samples that the record leaves out.
    pub(crate) fn dwelling(&self, dwell_s: f64) -> Result<Dwelling, DesignError> {
        let f = local_dynamics(&Float, &self.w[1][2], &-self.w[0][2]);
        let f = DMatrix::from_fn(LOCAL, LOCAL, |i, j| f[i][j]);
        let steps = steps(dwell_s, self.conditions.step_s)?;
        let none = DMatrix::zeros(LOCAL, LOCAL);
        let (step, _) = van_loan(&f, &none, dwell_s / steps as f64)?;
        let outputs: Vec<ObservedComponent> = local_output(&Float, self.platform.observed())
            .into_iter()
            .map(|(component, row)| {
                let weight = 1.0 / Plan::output_sigma(component, &self.conditions).powi(2);
                ObservedComponent { component, row, weight }
            })
            .collect();
        let mut now: DMatrix<f64> = DMatrix::identity(LOCAL, LOCAL);
        let (mut local, mut full) = ([[0.0; LOCAL]; LOCAL], [[0.0; LOCAL]; LOCAL]);
        let counted = if self.omitted.is_some() { &outputs[..] } else { &[] };
        let with_errors: Vec<_> = counted.iter().map(|o| with_accelerometer(o.component, o.row)).collect();
        let dt = dwell_s / steps as f64;
        let settle_s = self.conditions.settle_s;
        let first = left_out(settle_s, dt);
        if first >= steps {
            return Err(SimulationError::Settle { settle_s, place: "each position".into(), dwell_s }.into());
        }
        let of = |bias| Box::new(of_dwell(&outputs, bias, &step, first..steps, dt));
        let correlated = self.bias.as_ref().map(of);
        for k in 0..steps {
            now = &step * now;
            if k < first {
                continue;
            }
            for ObservedComponent { row: h, weight, .. } in &outputs {
                let row: [f64; LOCAL] = std::array::from_fn(|j| (0..LOCAL).map(|i| h[i] * now[(i, j)]).sum());
                add_square(&mut local, &row, *weight);
            }
            for (ObservedComponent { weight, .. }, h) in outputs.iter().zip(&with_errors) {
                let row: [f64; LOCAL] = std::array::from_fn(|j| (0..LOCAL).map(|i| h[i] * now[(i, j)]).sum());
                add_square(&mut full, &row, *weight);
            }
        }
        let phi = std::array::from_fn(|i| std::array::from_fn(|j| now[(i, j)]));
        Ok(Dwelling { seconds: dwell_s, local, full, phi, correlated })
    }

    /// Evaluator with a dwell of its own for every candidate; [`Self::dwell_at`] changes them.
    pub(crate) fn with_dwells(mut self) -> Self {
        self.dwells = vec![self.dwells[0].clone(); self.candidates.len()];
        self.candidates.iter_mut().enumerate().for_each(|(i, c)| c.dwell = i);
        self
    }

    /// Changes the dwell of a candidate that has one of its own.
    pub(crate) fn dwell_at(&mut self, candidate: usize, dwelling: &Dwelling) {
        let CandidateAttitude { c, effects, dwell, .. } = &self.candidates[candidate];
        self.dwells[*dwell].clone_from(dwelling);
        let own = self.information_alone(c, effects, dwelling);
        let omitted = self.omitted_at(c, effects, dwelling);
        let changed = &mut self.candidates[candidate];
        (changed.own, changed.omitted, changed.psi) = (own, omitted, OnceLock::new());
    }

    /// Dwell of a candidate.
    pub(crate) fn dwelling_of(&self, candidate: usize) -> &Dwelling {
        &self.dwells[self.candidates[candidate].dwell]
    }

    /// Rows of `eps^n` on the coefficients at an attitude, while the platform turns by `slew`.
    pub(crate) fn drift_rows(&self, c: &Matrix3<f64>, slew: Option<&Slew>) -> [Vec<f64>; 3] {
        let rate = || {
            let earth = earth_rate_in(&Float, c, &self.w[1][2], &-self.w[0][2]);
            std::array::from_fn(|i| earth[i] + slew.map_or(0.0, |s| s.rate[i]))
        };
        self.platform.errors().drift_rows(&Float, c, rate)
    }

    /// [`CandidateAttitude::effects`] of an attitude.
    pub(crate) fn effects(&self, c: &Matrix3<f64>) -> [Vec<f64>; LOCAL - 3] {
        let [x, y, z] = self.ordered_columns(self.drift_rows(c, None));
        let [a, b, c] = match self.platform.observed().accelerometers {
            true => self.ordered_columns(self.platform.errors().accelerometer_rows(&Float, c)),
            false => Default::default(),
        };
        [x, y, z, a, b, c]
    }

    /// Replaces the candidates by the given attitudes, without slew paths between them.
    pub(crate) fn stand_at(&mut self, attitudes: &[Matrix3<f64>]) {
        self.candidates = attitudes
            .iter()
            .map(|c| {
                let effects = self.effects(c);
                CandidateAttitude {
                    own: self.information_alone(c, &effects, &self.dwells[0]),
                    omitted: self.omitted_at(c, &effects, &self.dwells[0]),
                    effects,
                    c: *c,
                    psi: OnceLock::new(),
                    dwell: 0,
                }
            })
            .collect();
        self.slew_paths.clear();
    }

    /// Attitude and dwell of a candidate.
    pub(crate) fn stands(&self, candidate: usize) -> (&Matrix3<f64>, &Dwelling) {
        let CandidateAttitude { c, dwell, .. } = &self.candidates[candidate];
        (c, &self.dwells[*dwell])
    }

    /// Information of one position with a psi of its own on the coefficients; empty where psi or the
    /// noise of Z continues from position to position.
    fn information_alone(
        &self,
        c: &Matrix3<f64>,
        effects: &[Vec<f64>; LOCAL - 3],
        dwelling: &Dwelling,
    ) -> Vec<f64> {
        if self.ordered() {
            return Vec::new();
        }
        let n = self.n;
        let mut local = [[0.0; MAX_UNKNOWNS]; LOCAL];
        for r in 0..3 {
            local[r][..3].copy_from_slice(&c[r]);
        }
        for (row, effect) in local[3..self.locals].iter_mut().zip(effects) {
            row[3..n].copy_from_slice(effect);
        }
        let weighted = self.weighted(&local, dwelling);
        let mut own = [[0.0; MAX_UNKNOWNS]; MAX_UNKNOWNS];
        for (i, row) in own[..n].iter_mut().enumerate() {
            for (l, w) in local.iter().zip(&weighted) {
                for (x, y) in row[..=i].iter_mut().zip(&w[..=i]) {
                    *x += l[i] * y;
                }
            }
        }
        self.prior.psi.iter().enumerate().for_each(|(k, p)| own[k][k] += p);
        eliminate(&mut own, n, 0..3);
        own[..n]
            .iter()
            .enumerate()
            .flat_map(|(i, row)| (0..n).map(move |j| if j <= i { row[j] } else { 0.0 }))
            .collect()
    }

    /// Information of a position on its drift in n and on the error of its accelerometers in `Z^n`, psi
    /// eliminated; the prior of psi must be the same about every axis.
    pub(crate) fn information_of_effects(&self) -> [[f64; LOCAL - 3]; LOCAL - 3] {
        let mut all = [[0.0; MAX_UNKNOWNS]; MAX_UNKNOWNS];
        for (row, local) in all.iter_mut().zip(&self.dwells[0].local) {
            row[..LOCAL].copy_from_slice(local);
        }
        self.prior.psi.iter().enumerate().for_each(|(k, p)| all[k][k] += p);
        eliminate(&mut all, LOCAL, 0..3);
        std::array::from_fn(|i| std::array::from_fn(|j| all[3 + i.max(j)][3 + i.min(j)]))
    }

    /// Products `G L`, L the functionals `local` of the local unknowns at a position (of n unknowns
    /// each).
    pub(crate) fn weighted<const L: usize, const N: usize>(
        &self,
        local: &[[f64; N]; L],
        dwelling: &Dwelling,
    ) -> [[f64; N]; L] {
        let n = self.n;
        let mut weighted = [[0.0; N]; L];
        for (row, weights) in weighted.iter_mut().zip(&dwelling.local) {
            for (l, &g) in local.iter().zip(weights) {
                if g != 0.0 {
                    for (x, y) in row[..n].iter_mut().zip(&l[..n]) {
                        *x += g * y;
                    }
                }
            }
        }
        weighted
    }

    /// Rows on the coefficients in SI units, rearranged to the order and the units of the evaluator.
    pub(crate) fn ordered_columns(&self, rows: [Vec<f64>; 3]) -> [Vec<f64>; 3] {
        rows.map(|row| self.in_order(&row))
    }

    /// Row in SI units rearranged as by [`Self::ordered_columns`], with entries of any number type.
    pub(crate) fn in_order<X: Copy + Mul<f64, Output = X>>(&self, row: &[X]) -> Vec<X> {
        self.order.iter().zip(&self.scale).filter_map(|(&c, scale)| Some(*row.get(c)? * *scale)).collect()
    }

    /// Evaluator without a prior.
    pub(crate) fn without_prior(&self) -> Self {
        let prior = Prior { psi: [0.0; 3], coefficients: vec![0.0; self.n - 3] };
        let attitudes: Vec<Matrix3<f64>> = self.candidates.iter().map(|c| c.c).collect();
        let mut out = Self { prior, ..self.clone() };
        out.stand_at(&attitudes);
        out.slew_paths.clone_from(&self.slew_paths);
        out
    }

    /// True if the order of positions makes a difference.
    pub(crate) fn ordered(&self) -> bool {
        self.carry() != Carry::Reset || self.bias.is_some()
    }

    pub(crate) fn carry(&self) -> Carry {
        self.platform.scheme().carry
    }

    /// Largest time between samples, in s.
    pub(crate) fn step_s(&self) -> f64 {
        self.conditions.step_s
    }

    /// Time at the start of a position whose samples are left out, in s.
    pub(crate) fn settle_s(&self) -> f64 {
        self.conditions.settle_s
    }

    /// Dwell of each position, in s; of the first if dwells differ.
    pub fn dwell_s(&self) -> f64 {
        self.dwells[0].seconds
    }
}

/// Adds `weight row^T row` to `sum`.
fn add_square(sum: &mut [[f64; LOCAL]; LOCAL], row: &[f64; LOCAL], weight: f64) {
    for (line, x) in sum.iter_mut().zip(row) {
        line.iter_mut().zip(row).for_each(|(sum, y)| *sum += weight * x * y);
    }
}

impl Prior {
    /// True if the prior of psi is the same about every axis.
    pub(crate) fn is_alike(&self) -> bool {
        self.psi.iter().all(|p| *p == self.psi[0])
    }
}
