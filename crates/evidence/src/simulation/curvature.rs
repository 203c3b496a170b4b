//! Curvature of a run over directions that its measurements do not determine.
//!
//! A linearised run has a flat normal distribution where the likely starts lie along a curved set. Over the
//! spread of a hardly determined unknown, second-order terms shift estimates that are known far better. The
//! terms of second order therefore become unknowns of their own. With a likely start `x0 + sum_i s_i xi_i`,
//! the xi independent and of variance one, a run is
//! ```text
//! y = y0 + sum_i y_i xi_i + 1/2 sum_i y_ii + 1/2 sum_i y_ii (xi_i^2 - 1) + sum_(i<j) y_ij xi_i xi_j
//! ```
//!
//! where `xi_i^2 - 1` (variance 2) and `xi_i xi_j` (variance 1) correlate with no xi and not with each other:
//! to second moments they are further unknowns with a known prior. Only a few of their combinations exceed
//! the noise; these become columns. The mean and the covariance of such a model are those of the curved
//! distribution to this order (a linear regression over the likely starts instead of a tangent:
//! Garcia-Fernandez, Svensson, Morelande, Sarkka 2015, doi:10.1109/TSP.2015.2454485).

use nalgebra::DMatrix;
use obsdeg_ekf::{Covariance, CovarianceForm, EkfError, Manifold, Stage};

use super::extended::ExtendedFilter;
use super::state::PlatformState;
use super::trajectory::Trajectory;

/// Largest number of directions with curvature: their products are columns.
const MOST_DIRECTIONS: usize = 6;
/// Threshold in sigmas of all samples. A direction counts if the square of the angle by which it turns the
/// platform exceeds it; a column counts if its outputs do.
const SEEN: f64 = 0.1;

/// Second-order terms of a run, over the likely starts.
pub(super) struct SecondOrderTerms {
    /// Outputs of the run by row: first the mean run minus the run of the mean, then the columns.
    outputs: DMatrix<f64>,
    /// States of every step in local coordinates, with the same columns.
    states: DMatrix<f64>,
}

impl SecondOrderTerms {
    /// Curvature of the run linearised in `stages` along the trajectory `at` from `x0`. The start has the
    /// covariance `p` (n x n) and had the standard deviations `prior`. `None` where the curvature is
    /// negligible.
    ///
    /// # Errors
    /// [`EkfError`] for a trajectory that ends in numbers that are not finite.
    pub(super) fn new(
        filter: &ExtendedFilter<'_>,
        x0: &PlatformState,
        (stages, at): (&[Stage], &Trajectory),
        p: &DMatrix<f64>,
        prior: &[f64],
    ) -> Result<Option<Self>, EkfError> {
        let per_step = at.outputs.len() / stages.len().max(1);
        // an output that is not measured has no weight
        let weight = |row: usize| {
            stages[row / per_step].outputs.get(row % per_step).map_or(0.0, |o| o.r.sqrt().recip())
        };
        let weights: Vec<f64> = (0..at.outputs.len()).map(weight).collect();
        let least = SEEN / weights.iter().map(|w| w * w).sum::<f64>().sqrt();
        let directions = directions(stages, p, prior, filter.plan().constants(), least);
        let (mean, columns) = second_differences(filter, x0, at, &directions)?;
        if columns.is_empty() {
            return Ok(None);
        }
        // combinations that all samples could distinguish from zero
        let m = columns.len();
        let product = |a: &[f64], b: &[f64]| -> f64 {
            weights.iter().zip(a.iter().zip(b)).map(|(w, (a, b))| w * w * a * b).sum()
        };
        let seen = DMatrix::from_fn(m, m, |i, j| product(&columns[i], &columns[j])).symmetric_eigen();
        let mut kept: Vec<usize> = (0..m).filter(|&k| seen.eigenvalues[k] > SEEN * SEEN).collect();
        kept.sort_by(|&a, &b| seen.eigenvalues[b].total_cmp(&seen.eigenvalues[a]));
        let entry = |row: usize, column: usize| match column.checked_sub(1) {
            None => mean[row],
            Some(k) => (0..m).map(|i| columns[i][row] * seen.eigenvectors[(i, kept[k])]).sum(),
        };
        let (outputs, states) = (at.outputs.len(), mean.len() - at.outputs.len());
        let outputs_of = DMatrix::from_fn(outputs, 1 + kept.len(), entry);
        Ok(Some(Self {
            outputs: outputs_of,
            states: DMatrix::from_fn(states, 1 + kept.len(), |i, j| entry(outputs + i, j)),
        }))
    }

    /// Number of columns.
    fn columns(&self) -> usize {
        self.outputs.ncols() - 1
    }

    /// Difference of the mean run from the run of the mean, in one output.
    pub(super) fn mean_output(&self, row: usize) -> f64 {
        self.outputs[(row, 0)]
    }

    /// Prior covariance extended by the unknowns of the curvature.
    pub(super) fn prior(&self, p0: &DMatrix<f64>) -> DMatrix<f64> {
        let n = p0.nrows();
        let mut out = DMatrix::identity(n + self.columns(), n + self.columns());
        out.view_mut((0, 0), (n, n)).copy_from(p0);
        out
    }

    /// Extends the steps of a run by the unknowns of the curvature.
    pub(super) fn widen(&self, stages: &mut [Stage]) {
        let per_step = self.outputs.nrows() / stages.len().max(1);
        for (step, stage) in stages.iter_mut().enumerate() {
            let n = stage.transition.states();
            stage.transition = stage.transition.widened(self.columns());
            for (j, output) in stage.outputs.iter_mut().enumerate() {
                let row = self.outputs.row(step * per_step + j);
                output.h.extend((0..self.columns()).map(|c| (n + c, row[1 + c])));
            }
        }
    }

    /// Local coordinates after a step and their covariance, with the contribution of the curvature.
    ///
    /// # Errors
    /// [`EkfError::NotPositiveDefinite`] where rounding destroys the covariance.
    pub(super) fn of_state(
        &self,
        step: usize,
        delta: &[f64],
        p: &Covariance,
    ) -> Result<(Vec<f64>, Covariance), EkfError> {
        let n = delta.len() - self.columns();
        let bent = self.states.rows(step * n, n);
        let mut to = DMatrix::identity(n, delta.len());
        to.view_mut((0, n), (n, self.columns())).copy_from(&bent.columns(1, self.columns()));
        let x = &to * DMatrix::from_column_slice(delta.len(), 1, delta) + bent.column(0);
        let p = &to * p.matrix() * to.transpose();
        Ok((x.as_slice().to_vec(), Covariance::new("P", &((&p + p.transpose()) / 2.0), CovarianceForm::Ud)?))
    }
}

/// Second differences along `directions` of the outputs of a run, then of its states, about the trajectory
/// `at` from `x0`: those of the mean, and a column for each direction and each pair.
fn second_differences(
    filter: &ExtendedFilter<'_>,
    x0: &PlatformState,
    at: &Trajectory,
    directions: &[Vec<f64>],
) -> Result<(Vec<f64>, Vec<Vec<f64>>), EkfError> {
    let path = |directions: &[(f64, &Vec<f64>)]| -> Result<Vec<f64>, EkfError> {
        let mut delta = vec![0.0; x0.dimension()];
        for (by, direction) in directions {
            delta.iter_mut().zip(*direction).for_each(|(x, d)| *x += by * d);
        }
        let mut x = x0.clone();
        x.retract(&delta);
        let there = Trajectory::new(filter, x)?;
        let outputs = there.outputs.iter().zip(&at.outputs).map(|(a, b)| a - b);
        Ok(outputs.chain(there.states.iter().zip(&at.states).flat_map(|(a, b)| a.local(b))).collect())
    };
    let ahead = directions.iter().map(|s| path(&[(1.0, s)])).collect::<Result<Vec<_>, _>>()?;
    let (mut mean, mut columns) =
        (vec![0.0; at.outputs.len() + at.states.len() * x0.dimension()], Vec::new());
    for (i, s) in directions.iter().enumerate() {
        let back = path(&[(-1.0, s)])?;
        let twice: Vec<f64> = ahead[i].iter().zip(&back).map(|(a, b)| a + b).collect();
        mean.iter_mut().zip(&twice).for_each(|(m, x)| *m += x / 2.0);
        columns.push(twice.iter().map(|x| x / f64::sqrt(2.0)).collect::<Vec<f64>>());
        for (j, other) in directions[..i].iter().enumerate() {
            let mut both = path(&[(1.0, s), (1.0, other)])?;
            both.iter_mut().zip(ahead[i].iter().zip(&ahead[j])).for_each(|(x, (a, b))| *x -= a + b);
            columns.push(both);
        }
    }
    Ok((mean, columns))
}

/// Directions of the likely starts, each one standard deviation long, that turn the platform by angles whose
/// square exceeds `least`; the widest first.
fn directions(
    stages: &[Stage],
    p: &DMatrix<f64>,
    prior: &[f64],
    constants: usize,
    least: f64,
) -> Vec<Vec<f64>> {
    let n = prior.len();
    // in units of the prior, so that rounding counts as rounding
    let spread = DMatrix::from_fn(n, n, |i, j| p[(i, j)] / (prior[i] * prior[j])).symmetric_eigen();
    let direction = |k: usize| -> Vec<f64> {
        let root = spread.eigenvalues[k].max(0.0).sqrt();
        (0..n).map(|i| spread.eigenvectors[(i, k)] * root * prior[i]).collect()
    };
    let turn = |direction: &[f64]| -> f64 {
        let (mut x, mut scratch, mut turn) = (direction.to_vec(), Vec::new(), 0.0);
        for stage in stages {
            stage.transition.apply(&mut x, &mut scratch);
            let psi = x[..n - constants].chunks_exact(3).map(|v| v.iter().map(|x| x * x).sum::<f64>());
            turn = psi.fold(turn, f64::max);
        }
        turn
    };
    let mut out: Vec<(f64, Vec<f64>)> = (0..n).map(direction).map(|d| (turn(&d), d)).collect();
    out.retain(|(turn, _)| *turn > least);
    out.sort_by(|a, b| b.0.total_cmp(&a.0));
    out.truncate(MOST_DIRECTIONS);
    out.into_iter().map(|(_, d)| d).collect()
}
