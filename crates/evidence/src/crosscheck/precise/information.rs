//! Information of the samples on the unknowns at the start.

use std::sync::Arc;

use super::digits::{Digits, Functional, Real, Vector};
use super::model::{LOCAL, Moments, PreciseModel};

/// Motion of psi between the starts of two positions, besides the carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Between {
    /// None: Phi = 1, so that samples determine what derivatives do.
    Nothing,
    /// Motion during the dwell.
    Dwell,
}

/// Local unknown at the start of a position as a functional: nine rows, one entry per column.
struct LocalUnknown {
    columns: Vec<usize>,
    rows: [Vector; LOCAL],
}

/// Information of all samples on the unknowns at the start.
pub(in super::super) struct SampleInformation {
    pub(super) digits: Digits,
    /// Information matrix (n x n), symmetric.
    pub(super) matrix: Vec<Vector>,
    /// psi of the end in the carried axes, as functionals of the unknowns at the start: one for each unknown
    /// psi. Under reset carry each belongs to the end of its own position, otherwise to the end of the run.
    pub(super) psi_at_end: Vec<Functional>,
}

impl SampleInformation {
    /// Information of the samples of a filter, at the ends of equal steps, `samples` of them per position.
    /// The first position lasts `dwell / w_ie`. `noise` has the standard deviations of Z and of a measured
    /// azimuth.
    pub(in super::super) fn of_filter(
        model: &PreciseModel,
        dwell: f64,
        samples: &[usize],
        noise: [f64; 2],
    ) -> Self {
        let d = model.digits;
        let weights = noise.map(|s| d.double(1.0 / (s * s)));
        Self::new(model, &model.moments(dwell, samples, &weights), Between::Dwell)
    }

    /// Information of the samples `moments`, one entry for each position.
    pub(super) fn new(model: &PreciseModel, moments: &[Arc<Moments>], between: Between) -> Self {
        let (d, reset) = (model.digits, model.reset);
        let n = model.unknowns;
        let coefficients = model.drifts[0][0].len();
        let first = n - coefficients;
        let unit = |r: usize| (0..3 + coefficients).map(|k| d.int(i64::from(r == k))).collect::<Vector>();
        // psi in the carried axes, as functionals of psi at the start and the coefficients
        let mut psi: [Vector; 3] = std::array::from_fn(unit);
        let mut matrix = vec![vec![d.int(0); n]; n];
        let mut psi_at_end = Vec::new();
        for (i, (to_n, drift)) in model.carried.iter().zip(&model.drifts).enumerate() {
            if reset {
                psi = std::array::from_fn(unit);
            }
            let own = if reset { 3 * i } else { 0 };
            let columns: Vec<usize> = (own..own + 3).chain(first..n).collect();
            let behind =
                |row: &Vector| (0..3).map(|_| d.int(0)).chain(row.iter().cloned()).collect::<Vector>();
            // in instantaneous turns torquers add to psi^n, not to the carried psi
            let torqued: [Vector; 3] = std::array::from_fn(|r| behind(&model.torqued[i][r]));
            let carried = |r: usize, k: usize| d.dot((0..3).map(|j| (&to_n[r][j], &psi[j][k])));
            let carried: [Vector; 3] =
                std::array::from_fn(|r| (0..columns.len()).map(|k| carried(r, k)).collect());
            let rows: [Vector; LOCAL] = std::array::from_fn(|r| match r {
                0..3 => carried[r].iter().zip(&torqued[r]).map(|(x, y)| d.add(x, y)).collect(),
                3..6 => behind(&drift[r - 3]),
                _ => behind(&model.errors[i][r - 6]),
            });
            let local = LocalUnknown { columns, rows };
            local.add(d, &moments[i].gram, &mut matrix);
            if between == Between::Dwell {
                let after = local.after(d, &moments[i].end, (&carried, &torqued));
                psi = std::array::from_fn(|j| {
                    (0..local.columns.len())
                        .map(|k| d.dot((0..3).map(|r| (&to_n[r][j], &after[r][k]))))
                        .collect()
                });
            }
            if !reset {
                psi_at_end.clear();
            }
            psi_at_end.extend(psi.iter().map(|row| -> Functional {
                let entries = local.columns.iter().copied().zip(row.iter().cloned());
                entries.filter(|(_, x)| !x.is_zero()).collect()
            }));
        }
        Self { digits: d, matrix, psi_at_end }
    }
}

impl LocalUnknown {
    /// `psi^n` after a dwell that moves it by `moved`, less the torqued one, by the carried and the torqued
    /// psi^n before.
    fn after(
        &self,
        d: Digits,
        moved: &[Vector; 3],
        (carried, torqued): (&[Vector; 3], &[Vector; 3]),
    ) -> [Vector; 3] {
        std::array::from_fn(|r| {
            // effect of the dwell on torqued psi^n, less the torqued psi^n itself: no digits remain where
            // nothing moves it
            let change = |j: usize| d.sub(&moved[r][j], &d.int(i64::from(r == j)));
            let change: [Real; 3] = std::array::from_fn(change);
            let after = |k: usize| {
                let own = carried.iter().chain(&self.rows[3..6]).map(|row| &row[k]);
                d.dot(moved[r].iter().zip(own).chain(change.iter().zip((0..3).map(|j| &torqued[j][k]))))
            };
            (0..self.columns.len()).map(after).collect()
        })
    }

    /// Adds `L^T G L` to `matrix`.
    fn add(&self, d: Digits, gram: &[Vector], matrix: &mut [Vector]) {
        let c = self.columns.len();
        let weighted: Vec<Vector> = gram
            .iter()
            .map(|g| (0..c).map(|k| d.dot(g.iter().zip(self.rows.iter().map(|r| &r[k])))).collect())
            .collect();
        for (i, &row) in self.columns.iter().enumerate() {
            for (j, &column) in self.columns.iter().enumerate().skip(i) {
                let entry = d.dot(self.rows.iter().map(|r| &r[i]).zip(weighted.iter().map(|w| &w[j])));
                let sum = d.add(&matrix[row][column], &entry);
                matrix[column][row] = sum.clone();
                matrix[row][column] = sum;
            }
        }
    }
}
