//! Linear time-varying models in stages of equal steps: the covariance does not depend on the data, so its
//! recursion runs once and serves any number of runs.

use crate::covariance::{Covariance, Gain, ProcessNoise, ScalarOutput, check_step};
use crate::error::EkfError;
use crate::transition::Transition;

/// Equal steps: predict, then update by scalar measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Phi of one step.
    pub transition: Transition,
    /// Q of one step.
    pub noise: ProcessNoise,
    /// The measurements at the end of each step; none during a slew.
    pub outputs: Vec<ScalarOutput>,
    /// The number of steps.
    pub steps: usize,
}

impl Stage {
    /// Checks that all its parts are of n states.
    fn check(&self, n: usize) -> Result<(), EkfError> {
        check_step(n, &self.transition, &self.noise)?;
        self.outputs.iter().try_for_each(|output| output.check(n))
    }
}

/// The gains of all updates, in order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Gains {
    n: usize,
    /// n numbers per update.
    k: Vec<f64>,
    /// `1/sqrt(s)` per update.
    inverse_root: Vec<f64>,
}

impl Gains {
    /// The number of updates.
    pub fn updates(&self) -> usize {
        self.inverse_root.len()
    }
}

/// The covariance recursion over `stages`. `on_step` sees the covariance after every step, with its number
/// from 0.
///
/// # Errors
/// [`EkfError`] for a stage that is not one of the states of `p`, or an output without noise, before anything is
/// computed.
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

/// The state recursion: `measure` fills in the measurements of a step (its number, the stage, one number per
/// output), `on_step` sees the estimate and the whitened innovations.
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
