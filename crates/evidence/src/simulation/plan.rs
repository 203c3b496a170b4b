//! Plan of a scheme in numbers: the timeline of positions and slews, and a filter stage with the linear model
//! of each.

mod build;
pub(crate) mod process;
pub(crate) mod timeline;

use std::borrow::Cow;

use nalgebra::DMatrix;
use obsdeg_core::model::slew::Turn;
use obsdeg_core::model::{
    AZIMUTH, Float, LOCAL, Matrix3, Platform, PlatformPoint, PositionBlock, local_output,
};
use obsdeg_ekf::{SensorNoise, Stage};

use super::biases::Bias;
use super::conditions::Conditions;
use timeline::{PlanSegment, SegmentKind};

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
}
