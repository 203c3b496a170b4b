//! Changes of the estimates by omitted errors, by the weights of the sigmas of an answer.

use nalgebra::DMatrix;
use obsdeg_core::model::OmittedModel;
use obsdeg_core::omitted::{OmittedClass, OmittedVerdicts};
use obsdeg_ekf::linear::{covariance_pass, state_pass};
use obsdeg_ekf::{Covariance, SquareRootInformation};

use super::columns::OmittedColumns;
use crate::simulation::{Plan, SimulationError, each_row, si_per_shown};

/// Relative size of a change that counts as rounding: the change over the samples of the error, both in
/// sigmas.
const ROUNDING: f64 = 1e-12;
/// Number of rows that are reduced at a time.
const ROWS: usize = 1024;

/// Effects of one SI unit of every omitted error.
#[derive(Debug, Clone)]
pub struct Influence {
    /// Change of the error of every estimate at the end (unknowns x errors, SI units).
    pub changes: DMatrix<f64>,
    /// Information `O_j' R^-1 (O_j - J B_j)` by error: an error of k gives a record a chi-square of k^2 times
    /// it.
    pub information: Vec<f64>,
    /// Squares `O_j' R^-1 O_j` by error: squared size of all its samples, in sigmas of the noise.
    pub squares: Vec<f64>,
}

impl Influence {
    /// Changes of every estimate that has a sigma, per unit of every error in shown units (unknowns x
    /// errors). They are zero where the exact class says so, and where they are rounding. `units` and
    /// `sigmas` (shown) are those of the unknowns.
    pub fn shown(
        &self,
        units: &[&'static str],
        sigmas: &[Option<f64>],
        model: &OmittedModel,
        verdicts: Option<&OmittedVerdicts>,
    ) -> Vec<Vec<f64>> {
        let none = |c: usize, j: usize| {
            units[c] != "rad" && verdicts.is_some_and(|v| v.terms[j].class == OmittedClass::NoEffect)
        };
        let shown = |c: usize, j: usize| match sigmas[c] {
            Some(_) if !none(c, j) => {
                self.changes[(c, j)] * si_per_shown(model.terms()[j].unit) / si_per_shown(units[c])
            }
            _ => 0.0,
        };
        let m = model.terms().len();
        let mut out: Vec<Vec<f64>> =
            (0..units.len()).map(|c| (0..m).map(|j| shown(c, j)).collect()).collect();
        for j in 0..m {
            let in_sigmas = |c: usize, x: f64| sigmas[c].map_or(0.0, |s| (x / s).abs());
            // a change has at most as many sigmas as the samples of the error
            let most = self.squares[j].sqrt() * si_per_shown(model.terms()[j].unit);
            for (c, row) in out.iter_mut().enumerate() {
                if in_sigmas(c, row[j]) < ROUNDING * most {
                    row[j] = 0.0;
                }
            }
        }
        out
    }
}

/// Influence by the information of all samples and independent priors (shape n, SI units):
/// `B = (J' R^-1 J + P^-1)^-1 J' R^-1 O`, by orthogonal reduction of `[J O]`.
///
/// # Errors
/// [`SimulationError`] for a number that is not finite.
pub(crate) fn by_information(
    plan: &Plan,
    model: &OmittedModel,
    prior: &[f64],
) -> Result<Influence, SimulationError> {
    let (n, m) = (plan.unknowns(), model.terms().len());
    if m == 0 {
        return Ok(Influence { changes: DMatrix::zeros(n, 0), information: Vec::new(), squares: Vec::new() });
    }
    let mut reduced = ReducedColumns {
        root: SquareRootInformation::prior(prior)?.root().clone(),
        right: DMatrix::zeros(n, m),
        information: vec![0.0; m],
        squares: vec![0.0; m],
    };
    let mut columns = OmittedColumns::new(plan, model);
    let (mut left, mut right) = (Vec::with_capacity((ROWS + 8) * n), Vec::with_capacity((ROWS + 8) * m));
    // weights of the outputs of every step, in the order of the rows of J
    let weights = plan.stages.iter().flat_map(|s| {
        let of = s.outputs.iter().map(|o| 1.0 / o.r.sqrt()).collect::<Vec<f64>>();
        std::iter::repeat_n(of, s.steps)
    });
    let mut weights = weights.filter(|w| !w.is_empty());
    let (mut pending, mut failed) = (Vec::new(), None);
    let to_end = each_row(plan, |row| {
        if pending.is_empty() {
            match next_rows(&mut columns, &mut weights, m) {
                Ok(rows) => pending = rows,
                Err(e) => failed = failed.take().or(Some(e)),
            }
        }
        left.extend(row);
        match pending.pop() {
            Some(of) => right.extend(of),
            None => right.extend(std::iter::repeat_n(0.0, m)),
        }
        if left.len() >= ROWS * n {
            reduced.add(&left, &right);
            left.clear();
            right.clear();
        }
        Ok(())
    })?;
    if let Some(e) = failed {
        return Err(e);
    }
    if !left.is_empty() {
        reduced.add(&left, &right);
    }
    while columns.step()?.is_some() {}
    let start = reduced.solve()?;
    // column by column: a product of whole matrices uses other instructions, and gives other bits, on other
    // processors
    let ended: Vec<_> = start.column_iter().map(|column| &to_end * column).collect();
    let changes = at_the_end(plan, &DMatrix::from_columns(&ended), &columns);
    Ok(Influence { changes, information: reduced.information, squares: reduced.squares })
}

/// Weighted rows of the next step with outputs, the last output first.
fn next_rows(
    columns: &mut OmittedColumns<'_>,
    weights: &mut impl Iterator<Item = Vec<f64>>,
    m: usize,
) -> Result<Vec<Vec<f64>>, SimulationError> {
    while let Some(rows) = columns.step()? {
        if rows.is_empty() {
            continue;
        }
        let weights = weights.next().unwrap_or_default();
        let weighted = rows.chunks_exact(m.max(1)).zip(weights);
        return Ok(weighted.map(|(row, w)| row.iter().map(|x| w * x).collect()).rev().collect());
    }
    Ok(Vec::new())
}

/// Matrix `[J O]` with J reduced to its root.
struct ReducedColumns {
    root: DMatrix<f64>,
    right: DMatrix<f64>,
    information: Vec<f64>,
    squares: Vec<f64>,
}

impl ReducedColumns {
    fn add(&mut self, left: &[f64], right: &[f64]) {
        let (n, m) = (self.root.ncols(), self.right.ncols());
        let rows = left.len() / n;
        // errors that enter no sample so far need no reduction
        let enters = |j: &usize| {
            right.iter().skip(*j).step_by(m).any(|x| *x != 0.0)
                || self.right.column(*j).iter().any(|x| *x != 0.0)
        };
        let entering: Vec<usize> = (0..m).filter(enters).collect();
        let j = DMatrix::from_fn(n + rows, n, |r, c| match r.checked_sub(n) {
            Some(r) => left[r * n + c],
            None => self.root[(r, c)],
        });
        let mut o = DMatrix::from_fn(n + rows, entering.len(), |r, c| match r.checked_sub(n) {
            Some(r) => right[r * m + entering[c]],
            None => self.right[(r, entering[c])],
        });
        for (&k, column) in entering.iter().zip(o.column_iter()) {
            self.squares[k] += column.rows_range(n..).norm_squared();
        }
        let qr = j.qr();
        qr.q_tr_mul(&mut o);
        self.root = qr.r();
        for (&k, column) in entering.iter().zip(o.column_iter()) {
            self.right.set_column(k, &column.rows_range(..n));
            self.information[k] += column.rows_range(n..).norm_squared();
        }
    }

    fn solve(&self) -> Result<DMatrix<f64>, SimulationError> {
        let singular = || obsdeg_ekf::EkfError::Singular { column: self.root.ncols() };
        Ok(self.root.solve_upper_triangular(&self.right).ok_or_else(singular)?)
    }
}

/// Change of the error of the estimates: the estimates at the end minus the true changes of psi there.
fn at_the_end(plan: &Plan, estimate: &DMatrix<f64>, columns: &OmittedColumns<'_>) -> DMatrix<f64> {
    let mut out = estimate.rows_range(..plan.unknowns()).into_owned();
    for (unknown, truth) in columns.ends() {
        for (j, x) in truth.iter().enumerate() {
            out[(*unknown, j)] -= x;
        }
    }
    out
}

/// Influence by the gains of the filter with random drift and biases: the filter runs on each error alone,
/// without noise.
///
/// # Errors
/// [`SimulationError`].
pub(crate) fn by_filter(
    plan: &Plan,
    model: &OmittedModel,
    prior: Covariance,
) -> Result<Influence, SimulationError> {
    let m = model.terms().len();
    let mut columns = OmittedColumns::new(plan, model);
    let mut samples: Vec<f64> = Vec::new();
    while let Some(rows) = columns.step()? {
        samples.extend(rows);
    }
    let gains = covariance_pass(&plan.stages, prior, |_, _| {})?;
    let mut out = DMatrix::zeros(plan.states(), m);
    let mut information = vec![0.0; m];
    for j in 0..m {
        let (mut x, mut row) = (vec![0.0; plan.states()], 0);
        let measure = |_: usize, _: usize, z: &mut [f64]| {
            for z in z.iter_mut() {
                *z = samples[row * m + j];
                row += 1;
            }
        };
        let sum = &mut information[j];
        let on_step = |_: usize, _: &[f64], w: &[f64]| *sum += w.iter().map(|w| w * w).sum::<f64>();
        state_pass(&plan.stages, &gains, &mut x, measure, on_step)?;
        out.column_mut(j).copy_from_slice(&x);
    }
    let weights = plan.stages.iter().flat_map(|s| {
        std::iter::repeat_n(s.outputs.iter().map(|o| 1.0 / o.r).collect::<Vec<f64>>(), s.steps).flatten()
    });
    let mut squares = vec![0.0; m];
    for (row, weight) in samples.chunks_exact(m.max(1)).zip(weights) {
        squares.iter_mut().zip(row).for_each(|(sum, x)| *sum += weight * x * x);
    }
    Ok(Influence { changes: at_the_end(plan, &out, &columns), information, squares })
}
