//! Discretisation of a continuous system: Runge-Kutta in general, the matrix exponential for a linear
//! system.

use nalgebra::{DMatrix, DVector};

use crate::error::{EkfError, check, check_column, check_symmetric};
use crate::model::Process;

/// A state after a step, with its transition matrix and the noise of the step.
#[derive(Debug, Clone, PartialEq)]
pub struct Propagated {
    /// `x(t + dt)` (shape n).
    pub x: DVector<f64>,
    /// `Phi = dx(t + dt)/dx(t)` (n x n).
    pub phi: DMatrix<f64>,
    /// Covariance of the noise accumulated over the step (n x n).
    pub q: DMatrix<f64>,
}

/// Derivatives within a step; zero rows of F, those of constants, are left out.
struct Slope {
    /// `f` (shape n).
    x: DVector<f64>,
    /// Indices of the rows of F that are not zero (r of n).
    rows: Vec<usize>,
    /// These rows of `F Phi` (n x r, a column each).
    phi: DMatrix<f64>,
    /// These rows of `F Q_d` (n x r, a column each); `None` if it is zero.
    fq: Option<DMatrix<f64>>,
    /// Spectral density `Q` (n x n); `None` if it is zero.
    noise: Option<DMatrix<f64>>,
}

impl Slope {
    fn of(process: &impl Process, t: f64, y: &Propagated) -> Self {
        let (f, n) = (process.jacobian(t, &y.x), y.x.len());
        let rows: Vec<usize> = (0..n).filter(|&i| f.row(i).iter().any(|&a| a != 0.0)).collect();
        // columns are contiguous
        let columns = f.select_rows(&rows).transpose();
        let times = |m: &DMatrix<f64>| m.tr_mul(&columns);
        let some = |m: &DMatrix<f64>| m.iter().any(|&a| a != 0.0);
        let noise = Some(process.noise(t)).filter(some);
        Self { x: process.f(t, &y.x), phi: times(&y.phi), fq: some(&y.q).then(|| times(&y.q)), noise, rows }
    }

    /// `y + h k`.
    fn add_to(&self, y: &mut Propagated, h: f64) {
        y.x.axpy(h, &self.x, 1.0);
        for (r, &i) in self.rows.iter().enumerate() {
            for j in 0..y.x.len() {
                y.phi[(i, j)] += self.phi[(j, r)] * h;
            }
        }
        if let Some(fq) = &self.fq {
            for (r, &i) in self.rows.iter().enumerate() {
                for j in 0..y.x.len() {
                    y.q[(i, j)] += fq[(j, r)] * h;
                    y.q[(j, i)] += fq[(j, r)] * h;
                }
            }
        }
        if let Some(noise) = &self.noise {
            y.q.zip_apply(noise, |q, a| *q += a * h);
        }
    }
}

/// One classical Runge-Kutta step of `x' = f`, `Phi' = F Phi`, `Q_d' = F Q_d + Q_d F^T + Q`, in
/// `substeps` equal parts.
///
/// # Errors
/// [`EkfError`] for a shape that does not fit the states, and for a number that is not finite before or
/// after the step.
pub fn runge_kutta(
    process: &impl Process,
    t: f64,
    x: &DVector<f64>,
    dt: f64,
    substeps: usize,
) -> Result<Propagated, EkfError> {
    let n = process.states();
    check_column("x", x.as_slice(), n)?;
    check_column("f", process.f(t, x).as_slice(), n)?;
    check("F", &process.jacobian(t, x), (n, n))?;
    check_symmetric("Q", &process.noise(t), n)?;
    let slope = |t: f64, y: &Propagated| Slope::of(process, t, y);
    let mut y = Propagated { x: x.clone(), phi: DMatrix::identity(n, n), q: DMatrix::zeros(n, n) };
    let h = dt / substeps.max(1) as f64;
    let mut between = y.clone();
    for i in 0..substeps.max(1) {
        let t = t + h * i as f64;
        let k1 = slope(t, &y);
        between.clone_from(&y);
        k1.add_to(&mut between, h / 2.0);
        let k2 = slope(t + h / 2.0, &between);
        between.clone_from(&y);
        k2.add_to(&mut between, h / 2.0);
        let k3 = slope(t + h / 2.0, &between);
        between.clone_from(&y);
        k3.add_to(&mut between, h);
        let k4 = slope(t + h, &between);
        for (k, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
            k.add_to(&mut y, h * weight / 6.0);
        }
    }
    check_column("x", y.x.as_slice(), n)?;
    Ok(y)
}

/// Exact discretisation of `x' = F x + w` over `dt`: `(Phi, Q_d)` by the exponential of `[[-F, Q], [0,
/// F^T]] dt` (Van Loan 1978, doi:10.1109/TAC.1978.1101743).
///
/// # Errors
/// [`EkfError`] unless F and Q are square, finite and of one size, and Q is symmetric.
pub fn van_loan(
    f: &DMatrix<f64>,
    q: &DMatrix<f64>,
    dt: f64,
) -> Result<(DMatrix<f64>, DMatrix<f64>), EkfError> {
    let n = f.nrows();
    check("F", f, (n, n))?;
    check_symmetric("Q", q, n)?;
    check("dt", &DMatrix::from_element(1, 1, dt), (1, 1))?;
    let mut block = DMatrix::zeros(2 * n, 2 * n);
    block.view_mut((0, 0), (n, n)).copy_from(&(-f * dt));
    block.view_mut((0, n), (n, n)).copy_from(&(q * dt));
    block.view_mut((n, n), (n, n)).copy_from(&(f.transpose() * dt));
    let exponential = block.exp();
    let phi = exponential.view((n, n), (n, n)).transpose();
    let q_d = &phi * exponential.view((0, n), (n, n));
    let symmetric = (&q_d + q_d.transpose()) / 2.0;
    Ok((phi, symmetric))
}
