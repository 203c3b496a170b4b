//! Constraints on the unknowns: values at which they hold, and the directions in which the unknowns stay
//! free.

use nalgebra::{DMatrix, DVector, DVectorView};
use obsdeg_ekf::EkfError;
use obsdeg_ekf::decomposition::singular_values;

use super::fit::{SystemProblem, size};

/// Most steps back to a point where the constraints hold.
const BACK: usize = 30;
/// Residual of a constraint, relative to its terms, at which it holds. Rounding may leave more, up to
/// `ROUGHLY`.
const HOLDS: f64 = 1e-15;
const ROUGHLY: f64 = 1e-10;
/// Singular value of rows of unit length below which constraints are redundant.
const SAME: f64 = 1e-9;
/// Slope of a constraint, relative to that nearby, below which it has none.
const FLAT: f64 = 1e-4;

/// Residuals and derivatives of the constraints.
struct ConstraintResiduals {
    /// Relative residuals, by the terms of the constraints.
    over: DVector<f64>,
    /// Residuals as distances along `rows`.
    far: DVector<f64>,
    /// Derivatives (constraints x free unknowns) by the unknowns relative to their sizes, rows of unit
    /// length; zero for a constraint among known quantities.
    rows: DMatrix<f64>,
    /// Sizes of the terms of the constraints.
    terms: Vec<f64>,
}

impl SystemProblem<'_> {
    fn left(&self, base: &DVector<f64>, x: &DVector<f64>, fixed: Option<usize>) -> ConstraintResiduals {
        let all = self.all(base, x);
        let (over, by_all) = self.numeric.constraints(&all);
        let by = |i: usize, j: usize| match fixed == Some(j) {
            true => 0.0,
            false => by_all[(i, self.free[j])] * size(x[j]),
        };
        let mut rows = DMatrix::from_fn(over.len(), x.len(), by);
        let lengths: Vec<f64> = rows.row_iter().map(|row| row.norm()).collect();
        let terms = |i: usize| by_all.row(i).iter().zip(all.iter()).map(|(c, x)| (c * size(*x)).abs()).sum();
        let terms: Vec<f64> = (0..over.len()).map(terms).collect();
        let part = |value: f64, of: f64| if value == 0.0 { 0.0 } else { value / of };
        for (mut row, length) in rows.row_iter_mut().zip(&lengths) {
            row.iter_mut().for_each(|c| *c = part(*c, *length));
        }
        let distance = |i: usize, _| if lengths[i] == 0.0 { 0.0 } else { over[i] / lengths[i] };
        ConstraintResiduals {
            over: DVector::from_fn(over.len(), |i, _| part(over[i], terms[i])),
            far: DVector::from_fn(over.len(), distance),
            rows,
            terms,
        }
    }

    /// Values near `x` at which the constraints hold, by the least steps relative to the sizes of the
    /// unknowns; the unknown `fixed` stays.
    ///
    /// # Errors
    /// Index of the constraint with the largest residual.
    pub(super) fn on_constraints(
        &self,
        base: &DVector<f64>,
        mut x: DVector<f64>,
        fixed: Option<usize>,
    ) -> Result<DVector<f64>, usize> {
        for _ in 0..BACK {
            let ConstraintResiduals { over, far, rows, .. } = self.left(base, &x, fixed);
            let finite = far.iter().chain(rows.iter()).all(|c| c.is_finite());
            if !finite || over.iter().all(|c| c.abs() <= HOLDS) {
                break;
            }
            let Ok(by) = least(&rows, &far) else { break };
            x = DVector::from_fn(x.len(), |j, _| x[j] - by[j] * size(x[j]));
        }
        let over = self.left(base, &x, fixed).over;
        let over = over.map(|c| if c.is_finite() { c.abs() } else { f64::INFINITY });
        if over.iter().all(|c| *c <= ROUGHLY) { Ok(x) } else { Err(over.imax()) }
    }

    /// Directions (free unknowns x any) in which constraints leave the unknowns free at `x`, orthonormal
    /// relative to their sizes; the unknown `fixed` counts as free.
    pub(super) fn ways(
        &self,
        base: &DVector<f64>,
        x: &DVector<f64>,
        fixed: Option<usize>,
    ) -> Result<DMatrix<f64>, EkfError> {
        Ok(bound_and_free(&self.left(base, x, fixed).rows)?.1)
    }

    /// Rows of the constraints at `x` (constraints x free unknowns), of unit length, by the unknowns relative
    /// to their sizes.
    pub(super) fn bounds(&self, base: &DVector<f64>, x: &DVector<f64>) -> DMatrix<f64> {
        self.left(base, x, None).rows
    }

    /// Index of a constraint whose slope vanishes at `x`, as that of a square does at zero: it determines
    /// nothing there.
    pub(super) fn flat(&self, base: &DVector<f64>, x: &DVector<f64>) -> Option<usize> {
        let here = self.left(base, x, None).terms;
        // a point nearby, at a different distance for each unknown
        let moved = |j: usize, _| x[j] + 1e-3 * size(x[j]) * (1.0 + (1.618 * (j + 1) as f64).fract());
        let near = self.left(base, &DVector::from_fn(x.len(), moved), None).terms;
        (0..here.len()).find(|&i| here[i] < FLAT * near[i])
    }
}

/// Shortest step among those for which `rows` times the step is nearest to `far`.
fn least(rows: &DMatrix<f64>, far: &DVector<f64>) -> Result<DVector<f64>, EkfError> {
    let (m, n) = rows.shape();
    let (values, directions) = singular_values(&rows.clone().resize_vertically(m.max(n), 0.0))?;
    let counts = values.iter().zip(directions.column_iter()).filter(|(value, _)| **value > SAME);
    let along = |(value, v): (&f64, DVectorView<'_, f64>)| v * ((rows * v).dot(far) / (value * value));
    Ok(counts.map(along).fold(DVector::zeros(n), |sum, step| sum + step))
}

/// Orthonormal directions (unknowns x any) that `rows` (any x unknowns) bind, and those that they leave free.
pub(super) fn bound_and_free(rows: &DMatrix<f64>) -> Result<(DMatrix<f64>, DMatrix<f64>), EkfError> {
    let (m, n) = rows.shape();
    if m == 0 {
        return Ok((DMatrix::zeros(n, 0), DMatrix::identity(n, n)));
    }
    let (values, directions) = singular_values(&rows.clone().resize_vertically(m.max(n), 0.0))?;
    let rank = values.iter().filter(|v| **v > SAME).count();
    Ok((directions.columns(0, rank).into_owned(), directions.columns(rank, n - rank).into_owned()))
}
