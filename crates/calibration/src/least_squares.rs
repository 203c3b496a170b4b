//! Least squares on a linearised run in square-root information form, from its end to its start: without
//! covariances, gains or a prior.
//!
//! Rows `A d_k = b` hold the information of the measurements from step k on about the state there. With a
//! step `d_k = Phi d_(k-1) + G xi`, `xi` unit normals, they become `[A G, A Phi] [xi, d_(k-1)] = b` beside
//! `xi = 0`. A QR factorisation separates the rows of `xi` from those of `d_(k-1)` (Dyer, McReynolds 1969,
//! doi:10.1007/BF00929453; Bierman 1977, chapter X). At the start the triangle is the root of the information
//! on the start, and its last entry is the residual of the fit. In the forward direction, the rows of `xi`
//! give every state of the run with its covariance.

use nalgebra::{DMatrix, DVector, RowDVector};
use obsdeg_ekf::{EkfError, Stage, Transition};

/// Gap between two parts of a trajectory.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryGap {
    /// Number of the step before the next part.
    pub step: usize,
    /// End of that step in local coordinates of the next part (shape n).
    pub end: DVector<f64>,
}

/// Prior information on combinations of unknowns: `rows x = values`, with unit errors.
#[derive(Debug, Clone, PartialEq)]
pub struct PriorRows {
    /// Combinations (shape m x n), in SI units.
    pub rows: DMatrix<f64>,
    /// Values of the combinations (shape m).
    pub values: DVector<f64>,
}

/// Run linearised along one trajectory: Phi, Q and output rows of every step ([`Stage`]s of one step), a root
/// of Q, and the residuals of the measurements along the trajectory.
#[derive(Debug, Clone, Default)]
pub struct Linearised {
    /// Stages, one per step.
    pub stages: Vec<Stage>,
    /// Roots of Q by step: `G` (n x q) with `Q = G G^T`.
    pub roots: Vec<DMatrix<f64>>,
    /// Measurement minus output, in the order of the rows.
    pub residuals: Vec<f64>,
    /// Gaps of a trajectory in parts, in order. States behind a gap are corrections of the next part. Empty
    /// for a trajectory in one part.
    pub gaps: Vec<TrajectoryGap>,
}

impl Linearised {
    /// Number of states.
    pub fn states(&self) -> usize {
        self.stages.first().map_or(0, |s| s.transition.states())
    }

    /// Passes the corrections of all states after the steps to `on_step`, for a start corrected by `start`,
    /// without noise: `d_k = Phi d_(k-1)`, plus the gap where there is one. `on_step` gets the step and the
    /// correction behind its gap.
    pub(crate) fn carried(&self, start: &[f64], mut on_step: impl FnMut(usize, &[f64])) {
        let (mut d, mut scratch) = (start.to_vec(), Vec::new());
        let mut gaps = self.gaps.iter().peekable();
        for (step, stage) in self.stages.iter().enumerate() {
            stage.transition.apply(&mut d, &mut scratch);
            if let Some(TrajectoryGap { end: gap, .. }) = gaps.next_if(|gap| gap.step == step) {
                d.iter_mut().zip(gap).for_each(|(d, e)| *d += e);
            }
            on_step(step, &d);
        }
    }

    /// Run without the measurements for which `keep` is false.
    #[must_use]
    pub fn without(&self, keep: &[bool]) -> Self {
        let mut out = self.clone();
        let mut all = keep.iter().copied();
        for stage in &mut out.stages {
            stage.outputs.retain(|_| all.next().unwrap_or(true));
        }
        let mut all = keep.iter().copied();
        out.residuals.retain(|_| all.next().unwrap_or(true));
        out
    }
}

/// Rows of the noise of a step, given everything after it: `own xi + before d_(k-1) = right`.
#[derive(Debug, Clone)]
struct OfNoise {
    own: DMatrix<f64>,
    before: DMatrix<f64>,
    right: DVector<f64>,
}

/// Information of a run on its start.
#[derive(Debug, Clone)]
pub(crate) struct StartInformation {
    /// Root `S` (n x n) of the information on the start.
    pub root: DMatrix<f64>,
    /// Right side of `S d = right`, with d the most probable correction of the trajectory's start.
    pub right: DVector<f64>,
    /// Sum of squares at that correction.
    pub left: f64,
    noise: Vec<OfNoise>,
}

/// State of a run by all its measurements.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RunState {
    /// Correction of the trajectory's state.
    pub correction: DVector<f64>,
    /// Root (n x any) of the error covariance, which is this times its transpose.
    pub root: DMatrix<f64>,
}

impl RunState {
    /// Standard deviation of a component.
    pub(crate) fn sigma(&self, i: usize) -> f64 {
        self.root.row(i).norm()
    }
}

/// Upper triangle of a QR factorisation, with at least `rows` rows.
fn triangle(of: DMatrix<f64>, rows: usize) -> DMatrix<f64> {
    let r = of.qr().r();
    let columns = r.ncols();
    let found = r.nrows();
    if found < rows { r.resize(rows, columns, 0.0) } else { r }
}

/// Rows `A d = b` on the state before the steps that were taken, in the first `count` rows of `all` (any x
/// n + 1, `b` last); the others are zero. They are made a triangle where they are many: a factorisation at
/// every step would take most of the time.
struct Backward {
    all: DMatrix<f64>,
    count: usize,
}

/// Number of rows, in triangles, from which on rows are made a triangle.
const TRIANGLES: usize = 3;

impl Backward {
    fn new(n: usize) -> Self {
        Self { all: DMatrix::zeros(n + 1, n + 1), count: 0 }
    }

    /// Makes the rows a triangle.
    fn compress(&mut self) -> Result<(), EkfError> {
        let n = self.all.ncols();
        if self.count == 0 {
            return Ok(());
        }
        let own = self.all.view((0, 0), (self.count, n));
        if let Some(k) = own.iter().position(|x| !x.is_finite()) {
            let (row, column) = (k % self.count, k / self.count);
            return Err(EkfError::NotFinite {
                what: "the rows of a step",
                value: own[(row, column)],
                row,
                column,
            });
        }
        let found = own.into_owned().qr().r();
        self.all.fill(0.0);
        self.count = found.nrows();
        self.all.view_mut((0, 0), found.shape()).copy_from(&found);
        Ok(())
    }

    /// Rows on the state in front of a gap `e`: `A (d + e) = b`.
    fn behind(&mut self, gap: &DVector<f64>) {
        let n = gap.len();
        let shift = self.all.columns(0, n) * gap;
        let mut right = self.all.column_mut(n);
        right -= shift;
    }

    /// Adds the measurements of a stage.
    fn measured(&mut self, stage: &Stage, residuals: &[f64]) -> Result<(), EkfError> {
        let n = self.all.ncols() - 1;
        if self.count + stage.outputs.len() > TRIANGLES * (n + 1) {
            self.compress()?;
        }
        let rows = self.count + stage.outputs.len();
        if rows > self.all.nrows() {
            self.all.resize_vertically_mut((2 * rows).min(TRIANGLES * (n + 1)).max(rows), 0.0);
        }
        for (output, residual) in stage.outputs.iter().zip(residuals) {
            let weight = 1.0 / output.r.sqrt();
            output.h.iter().for_each(|&(j, c)| self.all[(self.count, j)] += weight * c);
            self.all[(self.count, n)] = weight * residual;
            self.count += 1;
        }
        Ok(())
    }

    /// Rows on the state before a transition: `A Phi`.
    fn before(&mut self, transition: &Transition) {
        let active: Vec<DVector<f64>> =
            transition.active().iter().map(|&i| self.all.column(i).into_owned()).collect();
        transition.active().iter().for_each(|&i| self.all.column_mut(i).fill(0.0));
        for (a, column) in active.iter().enumerate() {
            for (j, &phi) in transition.row(a).iter().enumerate().filter(|(_, phi)| **phi != 0.0) {
                self.all.column_mut(j).axpy(phi, column, 1.0);
            }
        }
    }

    /// Parts what rows say of the noise of a step, `N xi + A d = b` beside `xi = 0`, from what is left for
    /// `d`: one reflection for each noise, of its unit row and all others.
    fn without_noise(&mut self, mut of_noise: DMatrix<f64>) -> OfNoise {
        let (q, n) = (of_noise.ncols(), self.all.ncols() - 1);
        let mut top = DMatrix::zeros(q, q + n + 1);
        for k in 0..q {
            let v = of_noise.column(k).into_owned();
            let length = (1.0 + v.norm_squared()).sqrt();
            // (1, v) - (-length, 0)
            let first = 1.0 + length;
            let scale = 2.0 / (first * first + v.norm_squared());
            top[(k, k)] = -length;
            for j in k + 1..q {
                let share = scale * v.dot(&of_noise.column(j));
                top[(k, j)] = -share * first;
                of_noise.column_mut(j).axpy(-share, &v, 1.0);
            }
            for j in 0..=n {
                let mut column = self.all.rows_mut(0, self.count);
                let mut column = column.column_mut(j);
                let share = scale * v.dot(&column);
                top[(k, q + j)] = -share * first;
                column.axpy(-share, &v, 1.0);
            }
        }
        OfNoise {
            own: top.view((0, 0), (q, q)).into_owned(),
            before: top.view((0, q), (q, n)).into_owned(),
            right: top.view((0, q + n), (q, 1)).column(0).into_owned(),
        }
    }
}

impl StartInformation {
    /// Information of a run.
    ///
    /// # Errors
    /// [`EkfError::NotFinite`].
    pub(crate) fn of(run: &Linearised) -> Result<Self, EkfError> {
        let n = run.states();
        let mut rows = Backward::new(n);
        let mut noise = Vec::with_capacity(run.stages.len());
        let mut next = run.residuals.len();
        let mut gaps = run.gaps.iter().rev().peekable();
        for (step, (stage, g)) in run.stages.iter().zip(&run.roots).enumerate().rev() {
            next -= stage.outputs.len();
            if let Some(TrajectoryGap { end: gap, .. }) = gaps.next_if(|gap| gap.step == step) {
                rows.behind(gap);
            }
            rows.measured(stage, &run.residuals[next..])?;
            let of_noise = rows.all.view((0, 0), (rows.count, n)) * g;
            rows.before(&stage.transition);
            noise.push(rows.without_noise(of_noise));
        }
        noise.reverse();
        rows.compress()?;
        let rows = rows.all;
        Ok(Self {
            root: rows.view((0, 0), (n, n)).into_owned(),
            right: rows.view((0, n), (n, 1)).column(0).into_owned(),
            left: rows[(n, n)].powi(2),
            noise,
        })
    }

    /// Sum of squares of a run that starts as the trajectory does; the noise of its steps is free.
    pub(crate) fn at_zero(&self) -> f64 {
        self.left + self.right.norm_squared()
    }

    /// States of the run from its start on, for the start `start`; `run` is the run of this information.
    ///
    /// # Errors
    /// [`EkfError::Singular`].
    pub(crate) fn states(&self, run: &Linearised, start: RunState) -> Result<Vec<RunState>, EkfError> {
        let mut out = vec![start];
        let mut gaps = run.gaps.iter().peekable();
        for (step, ((stage, g), of)) in run.stages.iter().zip(&run.roots).zip(&self.noise).enumerate() {
            let Some(RunState { correction: d, root: p }) = out.last() else { break };
            let phi = stage.transition.matrix();
            let solve = |b: &DMatrix<f64>| {
                of.own.solve_upper_triangular(b).ok_or(EkfError::Singular { column: of.own.ncols() })
            };
            let mut next = if g.ncols() == 0 {
                RunState { correction: &phi * d, root: &phi * p }
            } else {
                let right = &of.right - &of.before * d;
                let xi = solve(&DMatrix::from_column_slice(right.len(), 1, right.as_slice()))?;
                let through = &phi - g * solve(&of.before)?;
                let own = g * solve(&DMatrix::identity(g.ncols(), g.ncols()))?;
                // both parts of the error side by side, then as a triangle
                let (n, m) = (p.nrows(), p.ncols());
                let mut both = (&through * p).resize_horizontally(m + own.ncols(), 0.0);
                both.columns_mut(m, own.ncols()).copy_from(&own);
                let root = if both.ncols() > n { both.transpose().qr().r().transpose() } else { both };
                RunState { correction: &phi * d + g * xi.column(0), root }
            };
            if let Some(TrajectoryGap { end: gap, .. }) = gaps.next_if(|gap| gap.step == step) {
                next.correction += gap;
            }
            out.push(next);
        }
        Ok(out)
    }
}

/// Least-squares solution of stacked rows.
#[derive(Debug, Clone)]
pub(crate) struct LeastSquaresSolution {
    /// Unknowns (shape n).
    pub x: DVector<f64>,
    /// Inverse root of the information (n x any): the covariance is this times its transpose.
    pub inverse_root: DMatrix<f64>,
    /// Root of the information, by the directions in which the unknowns are free.
    pub root: DMatrix<f64>,
    /// Sum of squares of the residuals.
    pub left: f64,
}

/// Rows `A x = b` with unit errors, stacked.
#[derive(Debug, Clone)]
pub(crate) struct StackedRows {
    all: DMatrix<f64>,
}

impl StackedRows {
    /// No rows, for n unknowns.
    pub(crate) fn new(n: usize) -> Self {
        Self { all: DMatrix::zeros(0, n + 1) }
    }

    /// Adds `a` (any x n) and `b`.
    pub(crate) fn add(&mut self, a: &DMatrix<f64>, b: &DVector<f64>) {
        let (rows, n) = (self.all.nrows(), self.all.ncols() - 1);
        let mut all = self.all.clone().resize_vertically(rows + a.nrows(), 0.0);
        all.view_mut((rows, 0), (a.nrows(), n)).copy_from(a);
        all.view_mut((rows, n), (a.nrows(), 1)).copy_from(b);
        self.all = if all.nrows() > 4 * (n + 1) { all.qr().r() } else { all };
    }

    /// Least-squares solution of the rows.
    ///
    /// # Errors
    /// [`EkfError::Singular`] when the rows do not determine all unknowns.
    pub(crate) fn solve(&self) -> Result<LeastSquaresSolution, EkfError> {
        let n = self.all.ncols() - 1;
        let r = triangle(self.all.clone(), n + 1);
        let root = r.view((0, 0), (n, n)).into_owned();
        let pivot = |j: usize| root[(j, j)].abs() - 1e-15 * root.column(j).norm();
        let singular = (0..n).find(|&j| pivot(j).is_nan() || pivot(j) <= 0.0);
        if let Some(column) = singular {
            return Err(EkfError::Singular { column });
        }
        let inverse_root =
            root.solve_upper_triangular(&DMatrix::identity(n, n)).ok_or(EkfError::Singular { column: n })?;
        let right = r.view((0, n), (n, 1)).column(0).into_owned();
        let x = &inverse_root * right;
        Ok(LeastSquaresSolution { x, inverse_root, root, left: r[(n, n)].powi(2) })
    }
}

impl LeastSquaresSolution {
    /// Covariance (n x n).
    pub(crate) fn covariance(&self) -> DMatrix<f64> {
        &self.inverse_root * self.inverse_root.transpose()
    }

    /// Covariance of two functionals if the errors of the rows are `factor` times as large as assumed, except
    /// for the rows `known` (any x n): `a^T C (f^2 (C^-1 - K^T K) + K^T K) C b`.
    pub(crate) fn covariance_with(
        &self,
        a: &[(usize, f64)],
        b: &[(usize, f64)],
        factor: f64,
        known: &DMatrix<f64>,
    ) -> f64 {
        let more = factor * factor;
        // by roots: an undetermined direction is huge in the covariance itself
        let (a, b) = (self.whitened(a), self.whitened(b));
        let known = known * &self.inverse_root;
        more * a.dot(&b) - (more - 1.0) * (&known * a.transpose()).dot(&(&known * b.transpose()))
    }

    /// Functional of the unknowns as a row over unit errors.
    fn whitened(&self, terms: &[(usize, f64)]) -> RowDVector<f64> {
        let zero = RowDVector::zeros(self.inverse_root.ncols());
        terms.iter().fold(zero, |sum, &(i, k)| sum + self.inverse_root.row(i) * k)
    }

    /// Standard deviation of a functional of the unknowns.
    pub(crate) fn sigma(&self, terms: &[(usize, f64)]) -> f64 {
        self.whitened(terms).norm()
    }
}

#[cfg(test)]
mod tests {
    use obsdeg_ekf::{ProcessNoise, ScalarOutput};

    use super::*;

    /// Errors of the data three times as large, those of the known rows unchanged:
    /// `A^-1 (9 J^T J + K^T K) A^-1`, where `A = J^T J + K^T K`.
    #[test]
    fn what_is_known_stays_as_it_is() {
        let j = DMatrix::from_fn(5, 3, |i, k| ((3 * i + k) as f64 * 1.7).sin() * 4.0);
        let known = DMatrix::from_row_slice(2, 3, &[2.0, 0.3, 0.0, -1.0, 4.0, 0.5]);
        let mut rows = StackedRows::new(3);
        rows.add(&j, &DVector::zeros(5));
        rows.add(&known, &DVector::zeros(2));
        let solution = rows.solve().expect("determined");
        let (data, before) = (j.transpose() * &j, known.transpose() * &known);
        let inverse = (&data + &before).try_inverse().expect("regular");
        let expected = &inverse * (data * 9.0 + before) * &inverse;
        let found =
            DMatrix::from_fn(3, 3, |i, k| solution.covariance_with(&[(i, 1.0)], &[(k, 1.0)], 3.0, &known));
        assert!((found - expected).amax() < 1e-12);
    }

    /// Measurements of the run below; that of step 3 is missing.
    const Z: [f64; 8] = [0.7, 1.9, -0.4, 0.2, 2.2, 1.0, 0.3, -0.8];

    fn phi() -> DMatrix<f64> {
        DMatrix::from_row_slice(3, 3, &[1.0, 0.3, 0.5, -0.1, 0.9, 0.0, 0.0, 0.0, 1.0])
    }

    fn noise_root() -> DMatrix<f64> {
        DMatrix::from_row_slice(3, 2, &[0.4, 0.0, 0.1, 0.2, 0.0, 0.0])
    }

    /// Run of a random walk in two states with a constant, partly observed.
    fn random_walk() -> Linearised {
        let (phi, g) = (phi(), noise_root());
        let stage = |k: usize| Stage {
            transition: Transition::new(&phi).expect("finite"),
            noise: ProcessNoise::new(&(&g * g.transpose())).expect("Q"),
            // no measurement at one step
            outputs: if k == 3 { vec![] } else { vec![ScalarOutput { h: vec![(0, 1.0), (1, 0.5)], r: 0.3 }] },
            steps: 1,
        };
        Linearised {
            stages: (0..8).map(stage).collect(),
            roots: vec![g.clone(); 8],
            residuals: (0..8).filter(|k| *k != 3).map(|k| Z[k]).collect(),
            gaps: vec![],
        }
    }

    /// Normal equations of all states of that run at once.
    struct NormalEquations {
        /// Matrices from the unknowns, the start (3) and xi of every step (2 each), to the states.
        maps: Vec<DMatrix<f64>>,
        covariance: DMatrix<f64>,
        right: DVector<f64>,
        /// Sum of squares of the measurements.
        squares: f64,
    }

    fn normal_equations() -> NormalEquations {
        let (phi, g) = (phi(), noise_root());
        let n = 3 + 16;
        let (mut information, mut right, mut squares) = (DMatrix::zeros(n, n), DVector::zeros(n), 0.0);
        let mut map = DMatrix::zeros(3, n);
        map.view_mut((0, 0), (3, 3)).fill_with_identity();
        let mut maps = vec![map.clone()];
        for k in 0..8 {
            map = &phi * map;
            map.view_mut((0, 3 + 2 * k), (3, 2)).copy_from(&g);
            maps.push(map.clone());
            for i in 0..2 {
                information[(3 + 2 * k + i, 3 + 2 * k + i)] += 1.0;
            }
            if k != 3 {
                let row = (map.row(0) + map.row(1) * 0.5) / 0.3f64.sqrt();
                let value = Z[k] / 0.3f64.sqrt();
                information += row.transpose() * &row;
                right += row.transpose() * value;
                squares += value * value;
            }
        }
        let covariance = information.try_inverse().expect("definite");
        NormalEquations { maps, covariance, right, squares }
    }

    /// A random walk in two states with a constant, partly observed, against the normal equations of all
    /// states at once.
    #[test]
    fn all_states_at_once() {
        let run = random_walk();
        let NormalEquations { maps, covariance, right, squares } = normal_equations();
        let x = &covariance * &right;
        let found = StartInformation::of(&run).expect("finite");
        let mut rows = StackedRows::new(3);
        rows.add(&found.root, &found.right);
        let solution = rows.solve().expect("determined");
        assert!((found.left - (squares - right.dot(&x))).abs() < 1e-10);
        let start = RunState { correction: solution.x.clone(), root: solution.inverse_root.clone() };
        let states = found.states(&run, start).expect("regular");
        assert_eq!(states.len(), 9);
        for (k, (state, map)) in states.iter().zip(&maps).enumerate() {
            assert!((&state.correction - map * &x).amax() < 1e-10, "state {k}");
            let found = &state.root * state.root.transpose();
            let gap = found - map * &covariance * map.transpose();
            assert!(gap.amax() < 1e-10, "covariance {k}");
        }
    }

    /// The same run about a trajectory in two parts: the second begins elsewhere after step 4.
    #[test]
    fn gaps_change_nothing() {
        let run = random_walk();
        let found = StartInformation::of(&run).expect("finite");
        let c = DVector::from_column_slice(&[0.6, -1.1, 0.4]);
        let mut parted = Linearised { gaps: vec![TrajectoryGap { step: 4, end: -&c }], ..run.clone() };
        let (phi, mut at) = (phi(), c);
        // step 3 has no measurement
        for row in 4..7 {
            at = &phi * at;
            parted.residuals[row] -= at[0] + 0.5 * at[1];
        }
        let again = StartInformation::of(&parted).expect("finite");
        assert!((again.at_zero() - found.at_zero()).abs() < 1e-9);
        assert!((again.left - found.left).abs() < 1e-9 && (&again.right - &found.right).amax() < 1e-9);
    }
}
