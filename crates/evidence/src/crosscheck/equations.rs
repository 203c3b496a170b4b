//! The model that verdicts and linear filter share, against equations that are written a second time: those of direction
//! cosines, linearised at zero. A sign that is wrong in (2), (6) or in the carry shows here.

use obsdeg_ekf::{Measurement, Motion, Update};

use super::answer::{Agreement, Difference};
use crate::simulation::SimulationError;
use crate::simulation::conditions::Conditions;
use crate::simulation::extended::Extended;
use crate::simulation::plan::Plan;
use crate::simulation::state::PlatformState;

/// Relative difference that is rounding and the order of the integration.
const LIMIT: f64 = 1e-7;

/// The largest difference of Phi and H of any step, each column in units of its largest entry; `None` where the unknowns are
/// the drift itself, for which there are no such equations.
///
/// # Errors
/// [`SimulationError::Filter`] when a number is none.
pub(super) fn difference(
    plan: &Plan,
    conditions: &Conditions,
) -> Result<Option<Difference>, SimulationError> {
    if !plan.has_coefficients() {
        return Ok(None);
    }
    let filter = Extended::new(plan, conditions, Update::default())?;
    let n = plan.states();
    let zero = PlatformState::of_unknowns(&vec![0.0; n], plan.constants());
    let mut largest = 0.0f64;
    // NaN stays
    let mut add = |x: f64| largest = if x <= largest || largest.is_nan() { largest } else { x };
    for (segment, stage) in plan.stages.iter().enumerate() {
        let motion = filter.motion(segment);
        let phi = motion.advance(0.0, plan.segments[segment].dt, &mut zero.clone())?.0.matrix();
        let linear = stage.transition.matrix();
        // biases of gyros are no part of the verdicts
        for j in 0..plan.unknowns() {
            let scale = linear.column(j).amax().max(phi.column(j).amax());
            add((phi.column(j) - linear.column(j)).amax() / scale);
        }
        let h = Measurement::jacobian(&motion, 0.0, &zero);
        for (i, output) in stage.outputs.iter().enumerate() {
            let mut row = h.row(i).into_owned();
            output.h.iter().for_each(|&(j, c)| row[j] -= c);
            add(row.amax());
        }
    }
    Ok(Some(Difference {
        name: "model against the equations of direction cosines at zero".into(),
        difference: largest,
        limit: LIMIT,
        outcome: Agreement::of(largest <= LIMIT),
    }))
}
