//! The extended Kalman filter.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::consistency::{Nees, chi_square_quantile};
use crate::covariance::{Covariance, CovarianceForm, Gain, ProcessNoise, ScalarOutput};
use crate::error::{EkfError, check, check_column, check_symmetric, is_positive};
use crate::integrate::runge_kutta;
use crate::manifold::Manifold;
use crate::model::{Measurement, Motion, Process};
use crate::transition::Transition;

/// An estimate with its covariance: that of the error in local coordinates about the estimate. After an
/// update the error is folded into the estimate (the reset of an error-state filter), so that Jacobians are
/// taken where the estimate is.
///
/// ```
/// use nalgebra::{DMatrix, DVector, dmatrix, dvector};
/// use obsdeg_ekf::{CovarianceForm, Filter, Measurement, Process};
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
/// let p0 = DMatrix::identity(2, 2) * 100.0;
/// let mut filter = Filter::new(DVector::zeros(2), &p0, CovarianceForm::Joseph)?;
/// for t in 0..50 {
///     filter.update(&Angle, t as f64, &dvector![0.5 * t as f64])?;
///     filter.predict(&Turn, t as f64, 1.0, 1)?;
/// }
/// assert!((filter.x()[1] - 0.5).abs() < 1e-6);
/// # Ok::<(), obsdeg_ekf::EkfError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Filter<X = DVector<f64>> {
    x: X,
    covariance: Covariance,
}

/// Options of an update.
#[derive(Debug, Clone, PartialEq)]
pub struct Update {
    /// Largest number of linearisations: 1 is the extended filter; more iterate by Gauss and Newton to
    /// the most probable state (Bell, Cathey 1993, doi:10.1109/9.250476).
    pub iterations: usize,
    /// Largest step of a coordinate, in its standard deviations, at which the iteration ends.
    pub tolerance: f64,
    /// Probability with which the measurement of a right model is accepted; less likely measurements
    /// are left out. `None` accepts all.
    pub gate: Option<f64>,
}

impl Default for Update {
    /// The extended filter without a gate.
    fn default() -> Self {
        Self { iterations: 1, tolerance: 1e-3, gate: None }
    }
}

impl Update {
    /// Update with up to `iterations` linearisations.
    pub fn iterated(iterations: usize) -> Self {
        Self { iterations, ..Self::default() }
    }
}

/// Result of one update.
#[derive(Debug, Clone, PartialEq)]
pub struct Innovation {
    /// Innovation at the prediction, whitened: independent unit normals if the model is right (one per
    /// component present).
    pub whitened: Vec<f64>,
    /// True if the measurement was used; false if the gate left it out.
    pub accepted: bool,
    /// Number of linearisations.
    pub iterations: usize,
    /// True if the last step was within the tolerance; always true for the single step of the extended
    /// filter.
    pub converged: bool,
}

impl Innovation {
    /// Normalised innovation squared, chi-square with as many degrees of freedom as components if the
    /// model is right.
    pub fn nis(&self) -> f64 {
        self.whitened.iter().map(|v| v * v).sum()
    }
}

impl<X: Manifold> Filter<X> {
    /// A filter that starts from `x0` with an error of covariance `p0` (n x n).
    ///
    /// # Errors
    /// [`EkfError`] unless `x0` is finite and `p0` positive definite.
    pub fn new(x0: X, p0: &DMatrix<f64>, form: CovarianceForm) -> Result<Self, EkfError> {
        let n = x0.dimension();
        check_state("x0", &x0)?;
        check("P0", p0, (n, n))?;
        Ok(Self { covariance: Covariance::new("P0", p0, form)?, x: x0 })
    }

    /// The estimate.
    pub fn x(&self) -> &X {
        &self.x
    }

    /// The covariance of its error.
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// Propagates from `t` to `t + dt`; a gap in the measurements is a longer step, or several. Returns
    /// Phi, for a smoother.
    ///
    /// # Errors
    /// [`EkfError`] if the model gives a wrong shape or a number that is not finite.
    pub fn advance(&mut self, motion: &impl Motion<X>, t: f64, dt: f64) -> Result<Transition, EkfError> {
        let (phi, noise) = motion.advance(t, dt, &mut self.x)?;
        check_state("x", &self.x)?;
        self.covariance.propagate(&phi, &noise)?;
        Ok(phi)
    }

    /// Jumps to `x`, whose local coordinates are `jacobian` times those before, with the noise of the
    /// jump: a repositioning, or a part of the state that is initialised again.
    ///
    /// # Errors
    /// [`EkfError`] for a wrong shape or a number that is not finite; nothing has changed then.
    pub fn jump(&mut self, x: X, jacobian: &Transition, noise: &ProcessNoise) -> Result<(), EkfError> {
        check_state("x", &x)?;
        self.covariance.propagate(jacobian, noise)?;
        self.x = x;
        Ok(())
    }

    /// Updates by the measurement `z` (shape m) at `t`, with all components present.
    ///
    /// # Errors
    /// [`EkfError`] as for [`Self::update_with`].
    pub fn update(
        &mut self,
        m: &impl Measurement<X>,
        t: f64,
        z: &DVector<f64>,
    ) -> Result<Innovation, EkfError> {
        let all: Vec<Option<f64>> = z.iter().copied().map(Some).collect();
        self.update_with(m, t, &all, &Update::default())
    }

    /// Updates by the components of `z` (shape m) that are present, at `t`. Correlated noise is
    /// decorrelated first; then the components are processed one by one, which is equivalent for a
    /// linearised model. An iteration that makes the state less probable is damped.
    ///
    /// # Errors
    /// [`EkfError`] for a wrong shape, a number that is not finite, or an R that is not positive definite.
    pub fn update_with(
        &mut self,
        m: &impl Measurement<X>,
        t: f64,
        z: &[Option<f64>],
        how: &Update,
    ) -> Result<Innovation, EkfError> {
        let seen = Present::new::<X>(m, t, z)?;
        let (residual, rows) = seen.at(&self.x)?;
        let mut after = self.covariance.clone();
        let mut whitened = Vec::with_capacity(seen.there.len());
        let mut delta =
            sequential(&mut after, &rows, &residual, &seen.whitener.variances, |w| whitened.push(w))?;
        let mut out = Innovation { whitened, accepted: true, iterations: 1, converged: true };
        if let Some(probability) = how.gate
            && !seen.there.is_empty()
            && out.nis() > chi_square_quantile(seen.there.len() as f64, probability)
        {
            out.accepted = false;
            return Ok(out);
        }
        if how.iterations > 1 {
            out.converged = false;
            after = self.iterate(&seen, &residual, &mut delta, how, &mut out)?;
        }
        if let Some(transport) = self.x.transport(&delta) {
            after.propagate(&transport, &ProcessNoise::none())?;
        }
        let mut x = self.x.clone();
        x.retract(&delta);
        check_state("x", &x)?;
        (self.x, self.covariance) = (x, after);
        Ok(out)
    }

    /// Linearises again at the end of the step `delta` until it changes no more; `residual` is that of the
    /// prediction. Returns the covariance of the last step.
    fn iterate<M: Measurement<X>>(
        &self,
        seen: &Present<'_, M>,
        residual: &[f64],
        delta: &mut Vec<f64>,
        how: &Update,
        out: &mut Innovation,
    ) -> Result<Covariance, EkfError> {
        let posterior =
            StateProbability { prediction: &self.x, prior: Nees::of_covariance(&self.covariance)?, seen };
        let mut after = self.covariance.clone();
        let mut before = vec![0.0; self.x.dimension()];
        let mut least = posterior.cost(&before, residual)?;
        while out.iterations < how.iterations {
            let (mut residual, mut rows) = posterior.damp(delta, &before, &mut least)?;
            // the rows in the coordinates about the prediction, and the residual of z there
            if let Some(transport) = self.x.transport(delta) {
                rows *= transport.matrix();
            }
            let linear = &rows * DVector::from_column_slice(delta);
            residual.iter_mut().zip(linear.iter()).for_each(|(e, l)| *e += l);
            after = self.covariance.clone();
            let next = sequential(&mut after, &rows, &residual, &seen.whitener.variances, |_| {})?;
            out.iterations += 1;
            let sigmas = after.sigmas();
            out.converged =
                next.iter().zip(&*delta).zip(&sigmas).all(|((a, b), s)| (a - b).abs() <= how.tolerance * s);
            before = std::mem::replace(delta, next);
            if out.converged {
                break;
            }
        }
        Ok(after)
    }
}

/// Components of a measurement that are present, made independent.
struct Present<'a, M> {
    m: &'a M,
    t: f64,
    /// Numbers of the components.
    there: Vec<usize>,
    z: Vec<f64>,
    whitener: Whitener,
}

impl<'a, M> Present<'a, M> {
    /// Components of `z` (shape m) at `t` that are present.
    ///
    /// # Errors
    /// [`EkfError`] for a wrong shape, a number that is not finite, or an R that is not positive definite.
    fn new<X: Manifold>(m: &'a M, t: f64, z: &[Option<f64>]) -> Result<Self, EkfError>
    where
        M: Measurement<X>,
    {
        let outputs = m.outputs();
        if z.len() != outputs {
            return Err(EkfError::Shape { what: "z", expected: (outputs, 1), found: (z.len(), 1) });
        }
        let there: Vec<usize> = (0..outputs).filter(|&i| z[i].is_some()).collect();
        let z: Vec<f64> = z.iter().copied().flatten().collect();
        check_column("z", &z, z.len())?;
        let r = m.noise(t);
        check("R", &r, (outputs, outputs))?;
        let whitener = Whitener::new(&r.select_rows(&there).select_columns(&there))?;
        Ok(Self { m, t, there, z, whitener })
    }

    /// Residual of z at a state, and the derivative of h with respect to the coordinates about it.
    fn at<X: Manifold>(&self, x: &X) -> Result<(Vec<f64>, DMatrix<f64>), EkfError>
    where
        M: Measurement<X>,
    {
        let outputs = self.m.outputs();
        let (h, jacobian) = (self.m.h(self.t, x), self.m.jacobian(self.t, x));
        check_column("h", h.as_slice(), outputs)?;
        check("H", &jacobian, (outputs, x.dimension()))?;
        let residual = self.there.iter().zip(&self.z).map(|(&i, z)| z - h[i]).collect();
        Ok((self.whitener.apply(residual), self.whitener.rows(&jacobian.select_rows(&self.there))))
    }
}

/// Probability of states about a prediction, given a measurement.
struct StateProbability<'a, X, M> {
    prediction: &'a X,
    prior: Nees,
    seen: &'a Present<'a, M>,
}

impl<X: Manifold, M: Measurement<X>> StateProbability<'_, X, M> {
    /// Twice the negative logarithm of the probability of the state at `delta`, up to a constant.
    fn cost(&self, delta: &[f64], residual: &[f64]) -> Result<f64, EkfError> {
        let variances = &self.seen.whitener.variances;
        let misfit = residual.iter().zip(variances).map(|(e, r)| e * e / r).sum::<f64>();
        Ok(self.prior.of(&mut delta.to_vec())? + misfit)
    }

    /// Halves the step from `before` to `delta` as long as it makes the state less probable than `least`.
    /// Returns the residual and the derivative of h at its end.
    fn damp(
        &self,
        delta: &mut [f64],
        before: &[f64],
        least: &mut f64,
    ) -> Result<(Vec<f64>, DMatrix<f64>), EkfError> {
        let mut halvings = 0;
        loop {
            let mut x = self.prediction.clone();
            x.retract(delta);
            let (residual, rows) = self.seen.at(&x)?;
            let found = self.cost(delta, &residual)?;
            if found <= *least * (1.0 + 1e-12) || halvings == HALVINGS {
                *least = found;
                return Ok((residual, rows));
            }
            delta.iter_mut().zip(before).for_each(|(d, b)| *d = 0.5 * (*d + b));
            halvings += 1;
        }
    }
}

/// Largest number of halvings of a step that makes the state less probable.
const HALVINGS: usize = 8;

impl Filter {
    /// Propagates from `t` to `t + dt`, integrated in `substeps` Runge-Kutta steps.
    ///
    /// # Errors
    /// [`EkfError`] if the model gives a wrong shape or a number that is not finite.
    pub fn predict(
        &mut self,
        process: &impl Process,
        t: f64,
        dt: f64,
        substeps: usize,
    ) -> Result<(), EkfError> {
        let next = runge_kutta(process, t, &self.x, dt, substeps)?;
        self.jump(next.x, &Transition::new(&next.phi)?, &ProcessNoise::new(&next.q)?)
    }
}

/// Refuses a state that is not finite.
fn check_state<X: Manifold>(what: &'static str, x: &X) -> Result<(), EkfError> {
    if x.is_finite() { Ok(()) } else { Err(EkfError::StateNotFinite { what }) }
}

/// Updates `p` by independent rows, one by one. Returns the estimate of the error; `seen` receives the
/// whitened innovations.
fn sequential(
    p: &mut Covariance,
    rows: &DMatrix<f64>,
    residual: &[f64],
    variances: &[f64],
    mut seen: impl FnMut(f64),
) -> Result<Vec<f64>, EkfError> {
    let n = p.states();
    let mut delta = vec![0.0; n];
    let mut gain = Gain { k: vec![0.0; n], s: 0.0 };
    for (i, (residual, &r)) in residual.iter().zip(variances).enumerate() {
        let h = (0..n).map(|j| (j, rows[(i, j)])).filter(|(_, c)| *c != 0.0).collect();
        let output = ScalarOutput { h, r };
        p.update(&output, &mut gain)?;
        // the residual is that of the prediction; components already used have moved the error
        let innovation = residual - output.predict(&delta);
        seen(innovation / gain.s.sqrt());
        for (x, k) in delta.iter_mut().zip(&gain.k) {
            *x += k * innovation;
        }
    }
    Ok(delta)
}

/// Transformation that makes the noise of a measurement independent.
struct Whitener {
    /// The lower triangular root of R; `None` where the noise is independent already.
    root: Option<DMatrix<f64>>,
    /// The variances of the independent components.
    variances: Vec<f64>,
}

impl Whitener {
    /// Whitener for the covariance `r`.
    ///
    /// # Errors
    /// [`EkfError`] unless `r` is finite, symmetric and positive definite.
    fn new(r: &DMatrix<f64>) -> Result<Self, EkfError> {
        let m = r.nrows();
        check_symmetric("R", r, m)?;
        let diagonal = (0..m).all(|j| (0..m).all(|i| i == j || r[(i, j)] == 0.0));
        let refuse = |row: usize, pivot: f64| EkfError::NotPositiveDefinite { what: "R", pivot, row };
        if diagonal {
            let variances: Vec<f64> = (0..m).map(|i| r[(i, i)]).collect();
            return match variances.iter().position(|v| !is_positive(*v)) {
                Some(row) => Err(refuse(row, variances[row])),
                None => Ok(Self { root: None, variances }),
            };
        }
        crate::covariance::ud_factors("R", r, true)?;
        let root = Cholesky::new(r.clone()).ok_or_else(|| refuse(0, f64::NAN))?;
        Ok(Self { root: Some(root.l()), variances: vec![1.0; m] })
    }

    /// Rows (m x n) of the independent components.
    fn rows(&self, rows: &DMatrix<f64>) -> DMatrix<f64> {
        let solved = self.root.as_ref().and_then(|l| l.solve_lower_triangular(rows));
        solved.unwrap_or_else(|| rows.clone())
    }

    /// Independent components of a residual.
    fn apply(&self, residual: Vec<f64>) -> Vec<f64> {
        if self.root.is_none() {
            return residual;
        }
        self.rows(&DMatrix::from_column_slice(residual.len(), 1, &residual)).as_slice().to_vec()
    }
}
