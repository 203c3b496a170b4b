//! Motion of psi along a segment as a process, and the rates and attitudes of a platform there.

use nalgebra::{DMatrix, DVector};
use obsdeg_core::model::slew::{Slew, W_IE, apply, times, transpose};
use obsdeg_core::model::{ErrorSource, ErrorTerm, Float, Matrix3, Unknowns, earth_rate_in, local_dynamics};
use obsdeg_ekf::Process;

use super::super::limits::MAX_INTEGRATION;
use super::Plan;
use super::timeline::{SegmentKind, integration_steps};

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
pub(in crate::simulation) const G_N: [f64; 3] = [0.0, -1.0, 0.0];

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
    pub(in crate::simulation) fn turns(&self, segment: usize) -> Option<&Slew> {
        match &self.segments[segment].kind {
            SegmentKind::Dwell => None,
            SegmentKind::Slew(slew) | SegmentKind::Rotation(slew) => Some(slew),
        }
    }

    /// True if torquer errors act in instantaneous turns, which full attitudes do not have.
    pub(crate) fn torqued_at_once(&self) -> bool {
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
    pub(in crate::simulation) fn accelerometer_error(
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
    pub(in crate::simulation) fn attitude(&self, segment: usize, t: f64) -> Matrix3<f64> {
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
