//! What the samples of a plan with slews determine. No exact verdict covers a platform that turns between positions, so this is decided in
//! floating point, by what a wider prior does to the standard deviations.

use nalgebra::DMatrix;
use obsdeg_ekf::{EkfError, SquareRootInformation};

use super::SimulationError;
use super::batch::{Batch, batch, wider};
use super::plan::Plan;
use crate::prediction::Prediction;

/// Two priors, so many times wider than what the samples say of the best known unknown: wide against all that is of use, and far from 1e16,
/// where rounding looks like information.
const WIDTHS: [f64; 2] = [1e7, 1e9];
/// What a hundredfold prior may do to the standard deviation of what is determined.
const UNMOVED: f64 = 3.0;

/// Inverse roots of the information of all samples with either prior: of the unknowns at the start, and at the end.
struct Seen {
    start: [DMatrix<f64>; 2],
    end: [DMatrix<f64>; 2],
}

impl Seen {
    fn of(plan: &Plan) -> Result<Self, EkfError> {
        let n = plan.unknowns();
        let Batch { information, to_end } = batch(plan, SquareRootInformation::none(n))?;
        let root = |width: f64| {
            let mut with = SquareRootInformation::prior(&wider(plan, &information, width, width))?;
            with.add(information.root())?;
            with.inverse_root()
        };
        let start = [root(WIDTHS[0])?, root(WIDTHS[1])?];
        let end = start.each_ref().map(|root| &to_end * root);
        Ok(Self { start, end })
    }
}

/// Whether a wider prior leaves the standard deviation of a combination.
fn determined(roots: &[DMatrix<f64>; 2], terms: &[(usize, f64)]) -> bool {
    let sigma = |root: &DMatrix<f64>| {
        let zero = nalgebra::RowDVector::zeros(root.ncols());
        terms.iter().fold(zero, |sum, &(c, k)| sum + root.row(c) * k).norm()
    };
    let [narrow, wide] = roots.each_ref().map(sigma);
    wide <= UNMOVED * narrow
}

/// The prediction for `plan`: where slews take time, what samples determine is what they determine with the slews.
///
/// # Errors
/// [`SimulationError`].
pub fn predict(plan: &Plan, seed: u64) -> Result<Prediction, SimulationError> {
    let mut out = Prediction::new(&plan.platform, [plan.point.w_n, plan.point.w_u], seed)?;
    if plan.slews().next().is_none() {
        return Ok(out);
    }
    let seen = Seen::of(plan)?;
    for (c, u) in out.unknowns.iter_mut().enumerate() {
        u.determined = determined(&seen.start, &[(c, 1.0)]);
        u.determined_at_end = determined(&seen.end, &[(c, 1.0)]);
    }
    for c in &mut out.combinations {
        c.determined_at_end = determined(&seen.end, &c.terms);
    }
    Ok(out)
}
