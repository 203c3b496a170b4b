//! Comparison of the model that verdicts and linear filter share with equations written a second time: those
//! of direction cosines, linearised at zero. A wrong sign in (2), (6) or in the carry shows here.

use obsdeg_ekf::{Measurement, Motion, Update};

use super::answer::{Agreement, CovarianceDifference};
use crate::simulation::SimulationError;
use crate::simulation::conditions::Conditions;
use crate::simulation::extended::ExtendedFilter;
use crate::simulation::plan::Plan;
use crate::simulation::state::PlatformState;

/// Largest relative difference that rounding and the order of the integration cause.
const LIMIT: f64 = 1e-7;

/// Largest difference of Phi and H over all steps, each column in units of its largest entry. `None` where
/// the unknowns are the drift itself, which has no such equations. `None` also where torquer errors act in
/// instantaneous turns, which full attitudes do not have.
///
/// # Errors
/// [`SimulationError::Filter`] for a number that is not finite.
pub(super) fn difference(
    plan: &Plan,
    conditions: &Conditions,
) -> Result<Option<CovarianceDifference>, SimulationError> {
    if !plan.has_coefficients() || plan.torqued_at_once() {
        return Ok(None);
    }
    let filter = ExtendedFilter::new(plan, conditions, Update::default())?;
    let n = plan.states();
    let zero = PlatformState::of_unknowns(&vec![0.0; n], plan.constants());
    let mut largest = 0.0f64;
    // NaN stays
    let mut add = |x: f64| largest = if x <= largest || largest.is_nan() { largest } else { x };
    for (segment, stage) in plan.stages.iter().enumerate() {
        let motion = filter.motion(segment);
        let phi = motion.advance(0.0, plan.segments[segment].dt, &mut zero.clone())?.0.matrix();
        let linear = stage.transition.matrix();
        // the verdicts do not include the biases of gyros
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
    Ok(Some(CovarianceDifference {
        name: "model against the equations of direction cosines at zero".into(),
        difference: largest,
        limit: LIMIT,
        outcome: Agreement::of(largest <= LIMIT),
    }))
}

#[cfg(test)]
mod tests {
    use obsdeg_core::model::{Carry, Scheme, parse_attitude};
    use obsdeg_ekf::Transition;

    use super::*;

    /// Every changed sign of the blocks and of the outputs is detected, one after the other.
    #[test]
    fn a_sign_that_is_wrong_shows() {
        let attitudes = || ["10,25,40", "130,-50,70"].map(|a| parse_attitude(a).expect("an attitude"));
        for carry in Carry::ALL {
            let conditions = Conditions::default();
            let plan =
                Plan::new(&Scheme { carry, ..Scheme::of_angles(attitudes()) }, &conditions).expect("a plan");
            let holds = |plan: &Plan| {
                difference(plan, &conditions).expect("numbers").expect("coefficients").outcome
                    == Agreement::Agrees
            };
            assert!(holds(&plan), "{carry}");
            let mut changed = 0;
            for (k, stage) in plan.stages.iter().enumerate() {
                let phi = stage.transition.matrix();
                let entries = (0..phi.nrows()).flat_map(|i| (0..phi.ncols()).map(move |j| (i, j)));
                for (i, j) in entries.filter(|&(i, j)| i != j && phi[(i, j)].abs() > 1e-6) {
                    let (mut wrong, mut turned) = (plan.clone(), phi.clone());
                    turned[(i, j)] *= -1.0;
                    wrong.stages[k].transition = Transition::new(&turned).expect("finite");
                    assert!(!holds(&wrong), "{carry}: Phi {i} {j}");
                    changed += 1;
                }
                for (i, output) in stage.outputs.iter().enumerate() {
                    for j in 0..output.h.len() {
                        let mut wrong = plan.clone();
                        wrong.stages[k].outputs[i].h[j].1 *= -1.0;
                        assert!(!holds(&wrong), "{carry}: H {i} {j}");
                        changed += 1;
                    }
                }
            }
            assert!(changed > 40, "{carry}: {changed}");
        }
    }
}
