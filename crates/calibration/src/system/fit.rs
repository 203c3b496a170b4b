//! Least squares of a model on the rows of its data: Levenberg-Marquardt with the Jacobians of its graph.

use nalgebra::{DMatrix, DVector, RowDVector};
use obsdeg_ekf::decomposition::singular_values;
use obsdeg_ekf::integrate::runge_kutta;
use obsdeg_ekf::{EkfError, Measurement};
use obsdeg_evidence::system::Numeric;

use super::data::{Data, ModelData};
use crate::CalibrationProgress;
use crate::least_squares::{LeastSquaresSolution, StackedRows};

/// Most iterations from a start.
const PASSES: usize = 200;
/// Number of rows of a long evaluation between two calls of `progress`.
const OFTEN: usize = 256;
/// Number of integration steps from which an evaluation counts as long.
pub(super) const LONG: f64 = 20_000.0;
/// Convergence limit: largest step, in standard deviations by the fit.
const SETTLED: f64 = 1e-5;
/// Width of a weak pull, relative to the size of an unknown.
pub(super) const WEAK: f64 = 1e7;

/// Model with its data.
pub(super) struct SystemProblem<'a> {
    pub(super) numeric: Numeric<'a>,
    pub(super) data: &'a ModelData,
    /// Filter states that are estimated.
    pub(super) free: Vec<usize>,
    /// Noise by output: from the model's file, or as estimated; a sigma of the record takes precedence.
    pub(super) noise: Vec<f64>,
    /// Longest step of integration.
    pub(super) longest: f64,
    /// Rows and values of the prior information on the free unknowns, with unit errors.
    pub(super) known: (DMatrix<f64>, DVector<f64>),
    /// True if an evaluation is long: `progress` is then also called within it, and can end it.
    pub(super) long: bool,
    /// Progress callback, called for every evaluation; iterations end when it returns false.
    pub(super) progress: &'a dyn Fn(CalibrationProgress<'_>) -> bool,
    /// Number of evaluations.
    pub(super) passes: usize,
    /// True if the callback returned false.
    pub(super) stopped: bool,
}

/// Rows of the model at some unknowns: derivatives by the free unknowns, residuals, and sigmas.
pub(super) struct ModelRows {
    pub(super) rows: DMatrix<f64>,
    pub(super) left: DVector<f64>,
    pub(super) sigmas: Vec<f64>,
    /// Row of the data and index of the output, by row.
    pub(super) keys: Vec<(usize, usize)>,
    /// Rows and residuals of the prior information, with unit errors.
    pub(super) known: (DMatrix<f64>, DVector<f64>),
    /// Directions in which the unknowns are free ([`SystemProblem::ways`]).
    pub(super) ways: DMatrix<f64>,
}

/// Filter states along a run of the data.
#[derive(Debug, Clone)]
struct ModelTrajectory {
    /// Number of the run; `None` at the start, before the first.
    run: Option<usize>,
    /// Time from the start of the states.
    t: f64,
    /// All filter states.
    x: DVector<f64>,
    /// Derivatives of the states by the free unknowns.
    by_free: DMatrix<f64>,
    /// Index of the segment.
    segment: usize,
}

impl ModelTrajectory {
    /// Trajectory at its start.
    fn from_start(x: DVector<f64>, by_free: DMatrix<f64>) -> Self {
        Self { run: None, t: 0.0, x, by_free, segment: 0 }
    }
}

impl ModelRows {
    /// Sum of squares in sigma.
    pub(super) fn cost(&self) -> f64 {
        self.cost_by(&self.sigmas)
    }

    /// Sum of squares with other sigmas: those by errors of the inputs change with the unknowns.
    pub(super) fn cost_by(&self, sigmas: &[f64]) -> f64 {
        let measured: f64 = self.left.iter().zip(sigmas).map(|(e, s)| (e / s).powi(2)).sum();
        measured + self.known.1.norm_squared()
    }
}

impl SystemProblem<'_> {
    /// All filter states at the free values `x`; known starts follow from the others.
    pub(super) fn all(&self, base: &DVector<f64>, x: &DVector<f64>) -> DVector<f64> {
        let mut out = base.clone();
        self.free.iter().zip(x.iter()).for_each(|(&i, v)| out[i] = *v);
        self.numeric.set_known_starts(&mut out);
        out
    }

    /// Derivatives of all filter states at the start by the free ones.
    pub(super) fn of_free(&self, base: &DVector<f64>, x: &DVector<f64>) -> DMatrix<f64> {
        let n = base.len();
        let mut out = DMatrix::zeros(n, self.free.len());
        for j in 0..self.free.len() {
            let h = 1e-6 * x[j].abs().max(1e-6);
            let at = |sign: f64| {
                let mut moved = x.clone();
                moved[j] += sign * h;
                self.all(base, &moved)
            };
            out.set_column(j, &((at(1.0) - at(-1.0)) / (2.0 * h)));
            out[(self.free[j], j)] = 1.0;
        }
        out
    }

    /// Rows of the model at the free values `x`, with integration steps `1/finer` as long.
    pub(super) fn at(
        &mut self,
        base: &DVector<f64>,
        x: &DVector<f64>,
        finer: usize,
    ) -> Result<ModelRows, EkfError> {
        self.passes += 1;
        self.stopped |= !(self.progress)(CalibrationProgress::Passes(self.passes));
        let start = ModelTrajectory::from_start(self.all(base, x), self.of_free(base, x));
        let mut out = ModelRows {
            rows: DMatrix::zeros(0, 0),
            left: DVector::zeros(0),
            sigmas: Vec::new(),
            keys: Vec::new(),
            known: (self.known.0.clone(), &self.known.1 - &self.known.0 * x),
            ways: self.ways(base, x, None)?,
        };
        let (mut rows, mut left): (Vec<RowDVector<f64>>, Vec<f64>) = (Vec::new(), Vec::new());
        let data = self.data;
        let ones = vec![1.0; self.noise.len()];
        let mut now = start.clone();
        for (k, row) in data.rows.iter().enumerate() {
            if now.run != Some(row.run) {
                now = self.begin(&start, row);
            }
            let asked = self.long && k.is_multiple_of(OFTEN);
            if asked && !(self.progress)(CalibrationProgress::Passes(self.passes)) {
                self.stopped = true;
                return Err(EkfError::Interrupted);
            }
            self.carry_to(&mut now, row, finer)?;
            let part = self.part(row, now.segment);
            for (&input, (value, _)) in data.inputs.iter().zip(&row.inputs) {
                self.numeric.hold(input, *value);
            }
            if row.outputs.iter().all(Option::is_none) {
                continue;
            }
            let h = self.numeric.measurement(part, &ones).h(row.t, &now.x);
            let jacobian = Measurement::jacobian(&self.numeric.measurement(part, &ones), row.t, &now.x);
            let by_inputs = self.by_inputs(part, row, &now.x, &ones);
            for (j, measured) in row.outputs.iter().enumerate() {
                let Some(measured) = measured else { continue };
                let own = row.sigmas[j].unwrap_or(self.noise[j]);
                out.sigmas.push((own * own + by_inputs[j]).sqrt());
                rows.push(jacobian.row(j) * &now.by_free);
                left.push(measured - h[j]);
                out.keys.push((k, j));
            }
        }
        let n = self.free.len();
        out.rows = DMatrix::from_fn(rows.len(), n, |i, j| rows[i][j]);
        out.left = DVector::from_vec(left);
        let bad = out.left.iter().chain(out.rows.iter()).find(|x| !x.is_finite());
        match bad {
            Some(&value) => Err(EkfError::NotFinite { what: "the outputs", value, row: 0, column: 0 }),
            None => Ok(out),
        }
    }

    /// Index of the process and the measurement of a segment, in the experiment of a row.
    fn part(&self, row: &Data, segment: usize) -> usize {
        row.experiment * self.numeric.segments() + segment
    }

    /// Trajectory at the start of the run of a row.
    fn begin(&self, start: &ModelTrajectory, row: &Data) -> ModelTrajectory {
        let (x, by) = self.numeric.carry(self.part(row, 0), 0.0, &start.x);
        ModelTrajectory { run: Some(row.run), t: 0.0, x, by_free: by * &start.by_free, segment: 0 }
    }

    /// Carries a trajectory to the time and the segment of a row. Inputs hold until there the values of the
    /// row before. A segment begins with its first row.
    fn carry_to(&self, now: &mut ModelTrajectory, row: &Data, finer: usize) -> Result<(), EkfError> {
        if row.t > now.t {
            let process = self.numeric.process(self.part(row, now.segment));
            let steps = ((row.t - now.t) / self.longest).ceil().max(1.0) as usize * finer;
            let next = runge_kutta(&process, now.t, &now.x, row.t - now.t, steps)?;
            now.t = row.t;
            now.x = next.x;
            now.by_free = next.phi * &now.by_free;
        }
        while now.segment < row.segment {
            now.segment += 1;
            let (x, by) = self.numeric.carry(self.part(row, now.segment), row.t, &now.x);
            now.x = x;
            now.by_free = by * &now.by_free;
        }
        Ok(())
    }

    /// Variance of every output by the errors of a row's inputs.
    pub(super) fn by_inputs(&mut self, part: usize, row: &Data, x: &DVector<f64>, ones: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; ones.len()];
        for (&input, &(value, sigma)) in self.data.inputs.iter().zip(&row.inputs) {
            if sigma == 0.0 {
                continue;
            }
            let mut at = |by: f64| {
                self.numeric.hold(input, value + by);
                self.numeric.measurement(part, ones).h(row.t, x)
            };
            let half = (at(sigma) - at(-sigma)) / 2.0;
            self.numeric.hold(input, value);
            out.iter_mut().zip(half.iter()).for_each(|(v, h)| *v += h * h);
        }
        out
    }
}

/// Size of an unknown, for a pull.
pub(super) fn size(x: f64) -> f64 {
    x.abs().max(1e-3)
}

/// Step from `at`, with a pull of `pull` per size of an unknown, along the directions that constraints leave
/// free. The root of the solution refers to these directions.
pub(super) fn step(at: &ModelRows, x: &DVector<f64>, pull: f64) -> Result<LeastSquaresSolution, EkfError> {
    let mut ways = at.ways.clone();
    ways.row_iter_mut().zip(x.iter()).for_each(|(mut row, x)| row.scale_mut(size(*x)));
    let n = ways.ncols();
    let mut rows = StackedRows::new(n);
    let mut whitened = &at.rows * &ways;
    whitened.row_iter_mut().zip(&at.sigmas).for_each(|(mut row, s)| row.scale_mut(1.0 / s));
    let left = at.left.zip_map(&DVector::from_column_slice(&at.sigmas), |e, s| e / s);
    rows.add(&whitened, &left);
    rows.add(&(&at.known.0 * &ways), &at.known.1);
    rows.add(&(DMatrix::identity(n, n) * pull), &DVector::zeros(n));
    let found = rows.solve()?;
    Ok(LeastSquaresSolution { x: &ways * found.x, inverse_root: &ways * found.inverse_root, ..found })
}

/// Reason why an iteration does not end.
#[derive(Debug, Clone)]
pub(super) enum Stuck {
    /// The model gives no finite numbers.
    Numbers(EkfError),
    /// The constraint of this index does not hold.
    Constraint(usize),
}

impl From<EkfError> for Stuck {
    fn from(e: EkfError) -> Self {
        Self::Numbers(e)
    }
}

/// End of an iteration.
#[derive(Debug, Clone)]
pub(super) struct Settled {
    pub(super) x: DVector<f64>,
    pub(super) cost: f64,
    pub(super) converged: bool,
}

/// Levenberg-Marquardt from `x`; the unknown `fixed` stays.
pub(super) fn settle(
    problem: &mut SystemProblem<'_>,
    base: &DVector<f64>,
    mut x: DVector<f64>,
    finer: usize,
    fixed: Option<usize>,
) -> Result<Settled, Stuck> {
    let there = |problem: &mut SystemProblem<'_>, x: &DVector<f64>| -> Result<ModelRows, EkfError> {
        let mut at = problem.at(base, x, finer)?;
        if let Some(j) = fixed {
            at.rows.column_mut(j).fill(0.0);
            at.known.0.column_mut(j).fill(0.0);
            at.ways = problem.ways(base, x, fixed)?;
        }
        Ok(at)
    };
    x = problem.on_constraints(base, x, fixed).map_err(Stuck::Constraint)?;
    let mut at = there(problem, &x)?;
    let mut cost = at.cost();
    // an initial pull much weaker than the data
    let mut pull = 1e-2 * (cost.max(1.0)).sqrt();
    let mut converged = false;
    for _ in 0..PASSES {
        if problem.stopped {
            break;
        }
        let solution = step(&at, &x, pull)?;
        let moved = problem.on_constraints(base, &x + &solution.x, fixed).ok();
        let next = moved.and_then(|moved| Some((there(problem, &moved).ok()?, moved)));
        let next = next.filter(|(n, _)| n.cost_by(&at.sigmas) <= cost * (1.0 + 1e-12));
        let scale = (cost / at.sigmas.len() as f64).max(1.0).sqrt();
        // remaining step without the pull
        let weak = step(&at, &x, 1.0 / WEAK)?;
        let left = determined_part(&at, &weak);
        if left <= SETTLED * scale {
            converged = true;
            break;
        }
        match next {
            Some((n, moved)) => {
                (x, cost, at) = (moved, n.cost(), n);
                pull = (pull / 5.0).max(1.0 / WEAK);
            }
            None => {
                pull *= 4.0;
                if pull > 1e12 {
                    break;
                }
            }
        }
    }
    Ok(Settled { x, cost, converged })
}

/// Change of the outputs by a step, in sigma.
pub(super) fn determined_part(at: &ModelRows, solution: &LeastSquaresSolution) -> f64 {
    let moved = &at.rows * &solution.x;
    let measured: f64 = moved.iter().zip(&at.sigmas).map(|(m, s)| (m / s).powi(2)).sum();
    (measured + (&at.known.0 * &solution.x).norm_squared()).sqrt()
}

/// Leverage of a measurement: the fraction of it that the fit follows.
pub(super) fn leverage(at: &ModelRows, solution: &LeastSquaresSolution, i: usize) -> f64 {
    let row = at.rows.row(i) * &solution.inverse_root;
    (row.norm() / at.sigmas[i]).powi(2)
}

/// Number of combinations that the data determine; only the pull holds the others.
pub(super) fn rank(solution: &LeastSquaresSolution) -> usize {
    // relative to sizes, singular values of the root are those of the pull, or far larger
    let values = singular_values(&solution.root).map(|(v, _)| v).unwrap_or_default();
    values.iter().filter(|v| **v > 10.0 / WEAK).count()
}
