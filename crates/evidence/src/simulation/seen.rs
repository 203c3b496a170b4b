//! Unknowns that the samples of a plan with slews determine. No exact verdict covers a platform that turns
//! between positions, so this is decided in floating point, by the effect of a wider prior on the standard
//! deviations.

use nalgebra::DMatrix;
use obsdeg_ekf::{EkfError, SquareRootInformation};

use super::batch::{Batch, batch, diffuse_prior, wider};
use super::error::SimulationError;
use super::plan::Plan;
use crate::prediction::Prediction;

/// Ratios of two diffuse priors to the sigma of the best known unknown: far from 1e16, where rounding looks
/// like information.
const WIDTHS: [f64; 2] = [1e11, 1e13];
/// Largest factor of the wider of these on a standard deviation that the samples alone determine.
const ALONE: f64 = 1.05;
/// Factor by which the prior of a run is widened.
const WIDER: f64 = 10.0;
/// Factor of that widening from which a standard deviation counts as determined by the prior only.
const MOSTLY: f64 = 9.0;

/// Inverse roots of the information of all samples with either prior: of the unknowns at the start, and at
/// the end.
struct PriorRoots {
    start: [DMatrix<f64>; 2],
    end: [DMatrix<f64>; 2],
}

impl PriorRoots {
    /// Roots with the two priors that `priors` computes from the information.
    fn of(
        plan: &Plan,
        priors: impl FnOnce(&SquareRootInformation) -> [Vec<f64>; 2],
    ) -> Result<Self, EkfError> {
        let Batch { information, to_end } = batch(plan, SquareRootInformation::none(plan.unknowns()))?;
        let root = |sigmas: Vec<f64>| {
            let mut with = SquareRootInformation::prior(&sigmas)?;
            with.add(information.root())?;
            with.inverse_root()
        };
        let [narrow, wide] = priors(&information);
        let start = [root(narrow)?, root(wide)?];
        let end = start.each_ref().map(|root| &to_end * root);
        Ok(Self { start, end })
    }
}

/// True if the wider prior raises the standard deviation of a combination by `factor` at most.
fn determined(roots: &[DMatrix<f64>; 2], terms: &[(usize, f64)], factor: f64) -> bool {
    let sigma = |root: &DMatrix<f64>| {
        let zero = nalgebra::RowDVector::zeros(root.ncols());
        terms.iter().fold(zero, |sum, &(c, k)| sum + root.row(c) * k).norm()
    };
    let [narrow, wide] = roots.each_ref().map(sigma);
    wide <= factor * narrow
}

/// Exact prediction; with slews of finite duration, `seen` decides on the determined unknowns.
fn with_slews(
    plan: &Plan,
    seed: u64,
    factor: f64,
    seen: impl FnOnce() -> Result<PriorRoots, EkfError>,
) -> Result<Prediction, SimulationError> {
    let mut out = Prediction::new(&plan.platform, [plan.point.w_n, plan.point.w_u], seed)?;
    if plan.slews().next().is_none() {
        return Ok(out);
    }
    let seen = seen()?;
    for (c, u) in out.unknowns.iter_mut().enumerate() {
        u.determined = determined(&seen.start, &[(c, 1.0)], factor);
        u.determined_at_end = determined(&seen.end, &[(c, 1.0)], factor);
    }
    for c in &mut out.combinations {
        c.determined_at_end = determined(&seen.end, &c.terms, factor);
    }
    Ok(out)
}

/// Standard deviations of a prior that is diffuse beside the samples of `plan`, as in the decisions of this
/// module.
///
/// # Errors
/// [`EkfError`] for a number that is not finite.
pub(crate) fn no_prior(plan: &Plan) -> Result<Vec<f64>, EkfError> {
    if plan.slews().next().is_none() {
        return diffuse_prior(plan);
    }
    let information = batch(plan, SquareRootInformation::none(plan.unknowns()))?.information;
    Ok(wider(plan, &information, WIDTHS[0], WIDTHS[0]))
}

/// Prediction for `plan` without a prior: with slews, an unknown is determined if the samples alone determine
/// it.
///
/// # Errors
/// [`SimulationError`].
pub fn predict(plan: &Plan, seed: u64) -> Result<Prediction, SimulationError> {
    let wide = |information: &SquareRootInformation| WIDTHS.map(|w| wider(plan, information, w, w));
    with_slews(plan, seed, ALONE, || PriorRoots::of(plan, wide))
}

/// Prediction for a run of `plan` with a prior: with slews, an unknown counts as determined unless a prior
/// ten times wider widens its standard deviation (nearly) as much.
///
/// # Errors
/// [`SimulationError`].
pub(crate) fn predict_run(plan: &Plan, prior: &[f64], seed: u64) -> Result<Prediction, SimulationError> {
    let wide = [1.0, WIDER].map(|w| prior.iter().map(|s| s * w).collect());
    with_slews(plan, seed, MOSTLY, || PriorRoots::of(plan, |_| wide))
}
