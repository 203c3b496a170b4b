//! Linear time-varying models in stages of equal steps: the covariance does not depend on the data, so its
//! recursion runs once and serves any number of runs.

use nalgebra::{DMatrix, DVector};

use crate::covariance::{Covariance, Gain, ProcessNoise, ScalarOutput, check_step};
use crate::error::{EkfError, check, check_column};
use crate::transition::{Transition, dot};

/// Stage of equal steps: predict, then update by scalar measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Transition matrix Phi of one step.
    pub transition: Transition,
    /// Noise Q of one step.
    pub noise: ProcessNoise,
    /// Measurements at the end of each step; empty during a slew.
    pub outputs: Vec<ScalarOutput>,
    /// Number of steps.
    pub steps: usize,
}

impl Stage {
    /// Checks that transition, noise and outputs have n states.
    fn check(&self, n: usize) -> Result<(), EkfError> {
        check_step(n, &self.transition, &self.noise)?;
        self.outputs.iter().try_for_each(|output| output.check(n))
    }
}

/// Gains of all updates, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Gains {
    n: usize,
    /// Kalman gains, n numbers per update.
    k: Vec<f64>,
    /// Inverse standard deviation `1/sqrt(s)` of the innovation, per update.
    inverse_root: Vec<f64>,
}

impl Gains {
    /// Number of updates.
    pub fn updates(&self) -> usize {
        self.inverse_root.len()
    }
}

/// Runs the covariance recursion over `stages`. `on_step` receives the covariance after every step,
/// with the step's number from 0.
///
/// # Errors
/// [`EkfError`] for a stage that does not fit the states of `p`, or an output without noise, before
/// anything is computed.
pub fn covariance_pass(
    stages: &[Stage],
    mut p: Covariance,
    mut on_step: impl FnMut(usize, &Covariance),
) -> Result<Gains, EkfError> {
    let n = p.states();
    for stage in stages {
        stage.check(n)?;
    }
    let mut gains = Gains { n, ..Gains::default() };
    let mut gain = Gain { k: vec![0.0; n], s: 0.0 };
    let mut step = 0;
    for stage in stages {
        for _ in 0..stage.steps {
            p.propagate_checked(&stage.transition, &stage.noise);
            for output in &stage.outputs {
                p.update_checked(output, &mut gain);
                gains.k.extend_from_slice(&gain.k);
                gains.inverse_root.push(1.0 / gain.s.sqrt());
            }
            on_step(step, &p);
            step += 1;
        }
    }
    Ok(gains)
}

/// Covariance at the end of `stages`, without the gains that [`covariance_pass`] keeps.
///
/// # Errors
/// [`EkfError`] as for [`covariance_pass`].
pub fn last_covariance(stages: &[Stage], mut p: Covariance) -> Result<Covariance, EkfError> {
    let n = p.states();
    for stage in stages {
        stage.check(n)?;
    }
    let mut gain = Gain { k: vec![0.0; n], s: 0.0 };
    for stage in stages {
        for _ in 0..stage.steps {
            p.propagate_checked(&stage.transition, &stage.noise);
            stage.outputs.iter().for_each(|output| p.update_checked(output, &mut gain));
        }
    }
    Ok(p)
}

/// Runs the state recursion. `measure` fills in the measurements of a step (its number, the stage, one
/// number per output), `on_step` receives the estimate and the whitened innovations.
///
/// # Errors
/// [`EkfError::Shape`] unless `stages` and `x` are those of the gains, before anything is computed.
pub fn state_pass(
    stages: &[Stage],
    gains: &Gains,
    x: &mut [f64],
    mut measure: impl FnMut(usize, usize, &mut [f64]),
    mut on_step: impl FnMut(usize, &[f64], &[f64]),
) -> Result<(), EkfError> {
    let updates = stages.iter().map(|s| s.steps * s.outputs.len()).sum::<usize>();
    if x.len() != gains.n || updates != gains.updates() {
        let (expected, found) = ((gains.n, gains.updates()), (x.len(), updates));
        return Err(EkfError::Shape { what: "states by updates of the run", expected, found });
    }
    for stage in stages {
        stage.check(gains.n)?;
    }
    let mut scratch = Vec::with_capacity(gains.n);
    let most = stages.iter().map(|s| s.outputs.len()).max().unwrap_or(0);
    let (mut z, mut whitened) = (vec![0.0; most], vec![0.0; most]);
    let mut updates = gains.k.chunks_exact(gains.n.max(1)).zip(&gains.inverse_root);
    let mut step = 0;
    for (i, stage) in stages.iter().enumerate() {
        let m = stage.outputs.len();
        for _ in 0..stage.steps {
            stage.transition.apply(x, &mut scratch);
            measure(step, i, &mut z[..m]);
            for (j, (output, (k, inverse_root))) in stage.outputs.iter().zip(&mut updates).enumerate() {
                let innovation = z[j] - output.predict(x);
                whitened[j] = innovation * inverse_root;
                for (x, k) in x.iter_mut().zip(k) {
                    *x += k * innovation;
                }
            }
            on_step(step, x, &whitened[..m]);
            step += 1;
        }
    }
    Ok(())
}

/// Runs both recursions at once, for a single run: `measure` as in [`state_pass`]; `on_step` receives
/// the estimate, its covariance and the whitened innovations after every step.
///
/// # Errors
/// [`EkfError`] as for [`covariance_pass`], and [`EkfError::Shape`] unless `x` has the states of `p`.
pub fn filter_pass(
    stages: &[Stage],
    mut p: Covariance,
    x: &mut [f64],
    mut measure: impl FnMut(usize, usize, &mut [f64]),
    mut on_step: impl FnMut(usize, &[f64], &Covariance, &[f64]),
) -> Result<Gains, EkfError> {
    let n = p.states();
    check_column("x", x, n)?;
    for stage in stages {
        stage.check(n)?;
    }
    let mut gains = Gains { n, ..Gains::default() };
    let mut gain = Gain { k: vec![0.0; n], s: 0.0 };
    let mut scratch = Vec::with_capacity(n);
    let most = stages.iter().map(|s| s.outputs.len()).max().unwrap_or(0);
    let (mut z, mut whitened) = (vec![0.0; most], vec![0.0; most]);
    let mut step = 0;
    for (i, stage) in stages.iter().enumerate() {
        let m = stage.outputs.len();
        for _ in 0..stage.steps {
            p.propagate_checked(&stage.transition, &stage.noise);
            stage.transition.apply(x, &mut scratch);
            measure(step, i, &mut z[..m]);
            for (j, output) in stage.outputs.iter().enumerate() {
                p.update_checked(output, &mut gain);
                let (innovation, inverse_root) = (z[j] - output.predict(x), 1.0 / gain.s.sqrt());
                whitened[j] = innovation * inverse_root;
                x.iter_mut().zip(&gain.k).for_each(|(x, k)| *x += k * innovation);
                gains.k.extend_from_slice(&gain.k);
                gains.inverse_root.push(inverse_root);
            }
            on_step(step, x, &p, &whitened[..m]);
            step += 1;
        }
    }
    Ok(gains)
}

/// Estimate of the start of a run from all its measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct SmoothedStart {
    /// Correction of the prior mean (shape n).
    pub correction: Vec<f64>,
    /// Covariance of the start (n x n). It is a difference from the prior: values below 1e-16 of the
    /// prior variance are rounding.
    pub covariance: DMatrix<f64>,
    /// Residuals of the measurements, one per update, in order.
    pub left_out: Vec<LeftOut>,
}

/// Measurement compared with its prediction from all others of its run. The difference is `u/D` with
/// variance `1/D`. The residual of the estimate from all of them is `r u` with variance `r^2 D` (de
/// Jong 1989, doi:10.1080/01621459.1989.10478853).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Smoothed error over the variance of the noise, `u`.
    pub u: f64,
    /// Variance `D` of u.
    pub variance: f64,
}

impl LeftOut {
    /// Difference in units of its own standard deviation: a unit normal if the model is right.
    pub fn normalised(&self) -> f64 {
        self.u / self.variance.sqrt()
    }
}

/// Estimate of the start from all measurements of a run, as a correction of its prior mean: `P0` times
/// the innovations summed backwards through the gains, and its covariance alike (Bryson, Frazier 1963;
/// Bierman 1973, doi:10.1016/0005-1098(73)90027-2). No covariance is inverted. `whitened` holds the
/// innovations of the run divided by their standard deviations, in order.
///
/// # Errors
/// [`EkfError::Shape`] unless stages, gains, innovations and `p0` belong to one run.
pub fn smoothed_start(
    stages: &[Stage],
    gains: &Gains,
    whitened: &[f64],
    p0: &DMatrix<f64>,
) -> Result<SmoothedStart, EkfError> {
    let n = gains.n;
    check("P0", p0, (n, n))?;
    check_column("the innovations", whitened, gains.updates())?;
    let updates = stages.iter().map(|s| s.steps * s.outputs.len()).sum::<usize>();
    if updates != gains.updates() {
        let (expected, found) = ((n, gains.updates()), (n, updates));
        return Err(EkfError::Shape { what: "states by updates of the run", expected, found });
    }
    for stage in stages {
        stage.check(n)?;
    }
    let (mut lambda, mut information) = (vec![0.0; n], DMatrix::zeros(n, n));
    let (mut update, mut against) = (updates, DVector::zeros(n));
    let mut scratch = Vec::with_capacity(n);
    let mut left_out = Vec::with_capacity(updates);
    for stage in stages.iter().rev() {
        for _ in 0..stage.steps {
            for output in stage.outputs.iter().rev() {
                update -= 1;
                let k = DVector::from_column_slice(&gains.k[update * n..(update + 1) * n]);
                let inverse_root = gains.inverse_root[update];
                // lambda <- (I - k h)^T lambda + h^T e/s
                let seen = whitened[update] * inverse_root - dot(k.as_slice(), &lambda);
                output.h.iter().for_each(|&(i, c)| lambda[i] += c * seen);
                // Lambda <- (I - k h)^T Lambda (I - k h) + h^T h/s
                against.gemv(1.0, &information, &k, 0.0);
                let both = against.dot(&k) + inverse_root * inverse_root;
                left_out.push(LeftOut { u: seen, variance: both });
                for &(i, c) in &output.h {
                    information.column_mut(i).axpy(-c, &against, 1.0);
                }
                for &(i, c) in &output.h {
                    (0..n).for_each(|j| information[(i, j)] -= c * against[j]);
                    output.h.iter().for_each(|&(j, d)| information[(i, j)] += c * d * both);
                }
            }
            stage.transition.apply_transposed(&mut lambda, &mut scratch);
            for _ in 0..2 {
                for column in information.as_mut_slice().chunks_exact_mut(n.max(1)) {
                    stage.transition.apply_transposed(column, &mut scratch);
                }
                information.transpose_mut();
            }
        }
    }
    let covariance = p0 - p0 * information * p0;
    left_out.reverse();
    Ok(SmoothedStart {
        correction: (p0 * DVector::from_vec(lambda)).as_slice().to_vec(),
        covariance: (&covariance + covariance.transpose()) / 2.0,
        left_out,
    })
}
