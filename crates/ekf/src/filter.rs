//! The extended Kalman filter.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::covariance::{Covariance, Form, Gain, ProcessNoise, ScalarOutput};
use crate::error::{EkfError, check, check_symmetric, is_positive};
use crate::integrate::runge_kutta;
use crate::model::{Measurement, Process};
use crate::transition::Transition;

/// An estimate with its covariance.
///
/// ```
/// use nalgebra::{DMatrix, DVector, dmatrix, dvector};
/// use obsdeg_ekf::{Filter, Form, Measurement, Process};
///
/// /// A constant rate: x = (angle, rate), the angle measured.
/// struct Turn;
/// impl Process for Turn {
///     fn states(&self) -> usize { 2 }
///     fn f(&self, _: f64, x: &DVector<f64>) -> DVector<f64> { dvector![x[1], 0.0] }
///     fn jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> { dmatrix![0.0, 1.0; 0.0, 0.0] }
///     fn noise(&self, _: f64) -> DMatrix<f64> { DMatrix::zeros(2, 2) }
/// }
/// struct Angle;
/// impl Measurement for Angle {
///     fn outputs(&self) -> usize { 1 }
///     fn h(&self, _: f64, x: &DVector<f64>) -> DVector<f64> { dvector![x[0]] }
///     fn jacobian(&self, _: f64, _: &DVector<f64>) -> DMatrix<f64> { dmatrix![1.0, 0.0] }
///     fn noise(&self, _: f64) -> DMatrix<f64> { dmatrix![1e-6] }
/// }
/// let mut filter = Filter::new(DVector::zeros(2), &(DMatrix::identity(2, 2) * 100.0), Form::Joseph)?;
/// for t in 0..50 {
///     filter.update(&Angle, t as f64, &dvector![0.5 * t as f64])?;
///     filter.predict(&Turn, t as f64, 1.0, 1)?;
/// }
/// assert!((filter.x()[1] - 0.5).abs() < 1e-6);
/// # Ok::<(), obsdeg_ekf::EkfError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    x: DVector<f64>,
    covariance: Covariance,
}

/// What one update saw.
#[derive(Debug, Clone, PartialEq)]
pub struct Innovation {
    /// The innovation, whitened: independent unit normals when the model is right (shape m).
    pub whitened: Vec<f64>,
}

impl Innovation {
    /// The normalised innovation squared, chi-square with m degrees of freedom when the model is right.
    pub fn nis(&self) -> f64 {
        self.whitened.iter().map(|v| v * v).sum()
    }
}

impl Filter {
    /// A filter that starts from `x0 ~ N(x0, p0)`.
    ///
    /// # Errors
    /// [`EkfError`] unless `x0` is finite and `p0` positive definite.
    pub fn new(x0: DVector<f64>, p0: &DMatrix<f64>, form: Form) -> Result<Self, EkfError> {
        let n = x0.len();
        check("x0", &DMatrix::from_column_slice(n, 1, x0.as_slice()), (n, 1))?;
        check("P0", p0, (n, n))?;
        Ok(Self { covariance: Covariance::new("P0", p0, form)?, x: x0 })
    }

    /// The estimate (shape n).
    pub fn x(&self) -> &DVector<f64> {
        &self.x
    }

    /// The covariance of its error.
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// From `t` to `t + dt`, integrated in `substeps` Runge-Kutta steps.
    ///
    /// # Errors
    /// [`EkfError`] when the model gives a shape or a number that cannot be.
    pub fn predict(
        &mut self,
        process: &impl Process,
        t: f64,
        dt: f64,
        substeps: usize,
    ) -> Result<(), EkfError> {
        let n = self.x.len();
        let f = process.f(t, &self.x);
        check("f", &DMatrix::from_column_slice(f.len(), 1, f.as_slice()), (n, 1))?;
        check("F", &process.jacobian(t, &self.x), (n, n))?;
        check_symmetric("Q", &process.noise(t), n)?;
        let next = runge_kutta(process, t, &self.x, dt, substeps);
        check("x", &DMatrix::from_column_slice(n, 1, next.x.as_slice()), (n, 1))?;
        self.covariance.propagate(&Transition::new(&next.phi)?, &ProcessNoise::new(&next.q)?);
        self.x = next.x;
        Ok(())
    }

    /// The update by the measurement `z` (shape m) at `t`. Correlated noise is decorrelated first; then the
    /// components are processed one by one, which is the same for a linearised model.
    ///
    /// # Errors
    /// [`EkfError`] for a wrong shape, a number that is not finite, or an R that is not positive definite.
    pub fn update(&mut self, m: &impl Measurement, t: f64, z: &DVector<f64>) -> Result<Innovation, EkfError> {
        let (n, outputs) = (self.x.len(), m.outputs());
        let (jacobian, r) = (m.jacobian(t, &self.x), m.noise(t));
        let column = |v: &DVector<f64>| DMatrix::from_column_slice(v.len(), 1, v.as_slice());
        let predicted = m.h(t, &self.x);
        check("z", &column(z), (outputs, 1))?;
        check("h", &column(&predicted), (outputs, 1))?;
        check("H", &jacobian, (outputs, n))?;
        let (root, variances) = decorrelation(&r, outputs)?;
        let (h, residual) = match &root {
            None => (jacobian, z - predicted),
            Some(l) => {
                let solve = |m: &DMatrix<f64>| l.solve_lower_triangular(m).unwrap_or_else(|| m.clone());
                let residual = solve(&column(&(z - predicted)));
                (solve(&jacobian), DVector::from_column_slice(residual.as_slice()))
            }
        };
        let before = self.x.clone();
        let mut gain = Gain { k: vec![0.0; n], s: 0.0 };
        let mut whitened = Vec::with_capacity(outputs);
        for (i, &variance) in variances.iter().enumerate() {
            let row = (0..n).map(|j| (j, h[(i, j)])).filter(|(_, c)| *c != 0.0).collect();
            let output = ScalarOutput { h: row, r: variance };
            self.covariance.update(&output, &mut gain);
            // the residual was taken at the prediction; components already used have moved x
            let moved = (&self.x - &before).as_slice().to_vec();
            let innovation = residual[i] - output.predict(&moved);
            whitened.push(innovation / gain.s.sqrt());
            for (x, k) in self.x.iter_mut().zip(&gain.k) {
                *x += k * innovation;
            }
        }
        Ok(Innovation { whitened })
    }
}

/// The Cholesky factor that makes the noise independent of unit variance, `None` when it is independent
/// already; and the variances.
fn decorrelation(r: &DMatrix<f64>, m: usize) -> Result<(Option<DMatrix<f64>>, Vec<f64>), EkfError> {
    check_symmetric("R", r, m)?;
    let diagonal = (0..m).all(|j| (0..m).all(|i| i == j || r[(i, j)] == 0.0));
    let refuse = |row: usize, pivot: f64| EkfError::NotPositiveDefinite { what: "R", pivot, row };
    if diagonal {
        let variances: Vec<f64> = (0..m).map(|i| r[(i, i)]).collect();
        return match variances.iter().position(|v| !is_positive(*v)) {
            Some(row) => Err(refuse(row, variances[row])),
            None => Ok((None, variances)),
        };
    }
    crate::covariance::ud_factors("R", r, true)?;
    let root = Cholesky::new(r.clone()).ok_or_else(|| refuse(0, f64::NAN))?;
    Ok((Some(root.l()), vec![1.0; m]))
}
