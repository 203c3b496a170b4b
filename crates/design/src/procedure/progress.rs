//! State of the coefficients after each position of a sheet.

use obsdeg_core::model::{Platform, Scheme};
use obsdeg_evidence::requirements::{Requirements, meets};
use obsdeg_evidence::simulation::{
    Attained, Conditions, Plan, Segment, SegmentKind, SimulationError, required_sigmas, shown_unit,
};
use obsdeg_exact::parallel;

use super::answer::{AfterPosition, CoefficientProgress};
use super::options::ProcedureOptions;

/// Largest number of positions of which every one is judged.
const MOST: usize = 100;

/// State of the coefficients along the scheme.
pub(super) struct Progress {
    pub(super) after: Vec<AfterPosition>,
    pub(super) coefficients: Vec<CoefficientProgress>,
    pub(super) requirements: Requirements,
}

/// State of the coefficients after each position, and at the end.
///
/// # Errors
/// [`SimulationError`].
pub(super) fn progress(
    scheme: &Scheme,
    conditions: &Conditions,
    options: &ProcedureOptions,
) -> Result<Progress, SimulationError> {
    let all = scheme.positions.len();
    let first = if all > MOST { all } else { 1 };
    let judged: Vec<Attained> =
        parallel::try_map(all + 1 - first, |k| judged(scheme, first + k, conditions, options))?;
    let Some(last) = judged.last() else { return Err(SimulationError::Interrupted) };
    let requirements = last.requirements(conditions)?;
    let own = &last.plan.platform;
    let psi = own.names().len() - own.coefficients();
    let names: Vec<String> = own.names()[psi..].to_vec();
    let required = required_sigmas(own, conditions)?;
    let required = |c: usize| required[psi + c];
    let sigma =
        |of: &Attained, name: &String| of.totals[of.plan.platform.names().iter().position(|n| n == name)?];
    let sigmas: Vec<Vec<Option<f64>>> =
        judged.iter().map(|a| names.iter().map(|name| sigma(a, name)).collect()).collect();
    let is_determined = |name: &String, of: &Attained| {
        let own = of.plan.platform.names().iter().position(|n| n == name);
        own.is_some_and(|c| of.prediction.unknowns[c].determined_at_end)
    };
    let position = |k: usize| scheme.positions[first + k - 1].name.clone();
    // from the last position back to the first one before which the condition fails
    let from = |holds: &dyn Fn(usize) -> bool| {
        let failing = (0..sigmas.len()).rev().find(|&k| !holds(k)).map_or(0, |k| k + 1);
        (failing < sigmas.len()).then_some(failing)
    };
    let is_met = |c: usize, k: usize| sigmas[k][c].zip(required(c)).is_some_and(|(s, r)| meets(s, r));
    let (mut coefficients, mut determined, mut met) = (Vec::new(), Vec::new(), Vec::new());
    for (c, name) in names.iter().enumerate() {
        // where only the end is judged, nothing is known of the positions before
        let known = |of: Option<usize>| of.filter(|_| first == 1);
        determined.push(known(from(&|k| is_determined(name, &judged[k]))));
        met.push(known(from(&|k| is_met(c, k))));
        coefficients.push(CoefficientProgress {
            name: name.clone(),
            unit: shown_unit(own.units()[psi + c]).into(),
            uncertainty: sigmas.last().and_then(|s| s[c]),
            by_prior: last.by_prior[psi + c],
            required: required(c),
            determined_from: determined[c].map(position),
            met_from: met[c].map(position),
        });
    }
    let after = (0..sigmas.len()).map(|k| {
        let named = |from: &[Option<usize>]| -> Vec<String> {
            let here = (0..names.len()).filter(|&c| from[c] == Some(k));
            here.map(|c| names[c].clone()).collect()
        };
        AfterPosition {
            position: position(k),
            end_s: judged[k].plan.duration_s(),
            met: (0..names.len()).filter(|&c| is_met(c, k)).count(),
            determines: named(&determined),
            meets: named(&met),
            uncertainty: sigmas[k].clone(),
        }
    });
    let after = after.collect();
    Ok(Progress { after, coefficients, requirements })
}

/// Accuracy of the first `count` positions without the samples of the waits.
fn judged(
    scheme: &Scheme,
    count: usize,
    conditions: &Conditions,
    options: &ProcedureOptions,
) -> Result<Attained, SimulationError> {
    let positions = scheme.positions[..count].to_vec();
    let scheme = Scheme { positions, combinations: Vec::new(), ..scheme.clone() };
    let conditions = conditions.as_stated();
    let conditions = conditions.within(&Platform::new(scheme.clone())?);
    let plan = Plan::new(&scheme, &conditions)?;
    let plan = match options.settle_s {
        0.0 => plan,
        settle_s => waited(plan, &conditions, settle_s, |plan, k| plan.stages[k].outputs.clear())?,
    };
    Attained::of_plan(plan, &conditions, None, options.seed)
}

/// The plan with steps that end where the waits of `settle_s` s end; `silence` is called with the indices of
/// the segments of the waits.
fn waited(
    plan: Plan,
    conditions: &Conditions,
    settle_s: f64,
    silence: impl Fn(&mut Plan, usize),
) -> Result<Plan, SimulationError> {
    // the wait, then the samples at the same steps
    let parts = |s: &Segment| {
        if s.kind != SegmentKind::Dwell {
            return vec![(s.steps, s.dt)];
        }
        let waited = (settle_s / s.dt - 1e-9).floor().max(0.0) as usize;
        let rest = settle_s - waited as f64 * s.dt;
        let first = ((waited + 1) as f64 * s.dt) - settle_s;
        let mut out = vec![(waited, s.dt), (1, rest), (1, first), (s.steps.saturating_sub(waited + 1), s.dt)];
        out.retain(|(steps, dt)| *steps > 0 && *dt > 1e-9);
        out
    };
    let mut plan = plan.in_steps(conditions, parts)?;
    let mut begins = vec![f64::INFINITY; plan.attitudes.len()];
    for k in 0..plan.segments.len() {
        let s = &plan.segments[k];
        if s.kind == SegmentKind::Dwell {
            begins[s.position] = begins[s.position].min(s.start_s);
            let end = s.start_s + s.dt * s.steps as f64 - begins[s.position];
            if end <= settle_s + 1e-9 {
                silence(&mut plan, k);
            }
        }
    }
    Ok(plan)
}

#[cfg(test)]
mod tests {
    use obsdeg_core::model::scheme_file;

    use super::*;

    /// Samples that are left out count as samples of a noise a million times larger do, also for the bench:
    /// errors that are not estimated enter the samples that remain at their own times. So by the information
    /// of all samples, and by a filter with random drift.
    #[test]
    fn left_out_samples_are_samples_of_great_noise() {
        let names = ["NUE", "USE", "EDN", "WND", "DNE"].map(|n| format!("[[position]]\nattitude = '{n}'\n"));
        for drift in ["", "drift_noise = '0.001 deg/sqrt(h)'\n"] {
            let text = format!(
                "carry = 'inertial'\nlatitude_deg = 40\n[simulation]\nslew_rate_deg_s = 2\ndwell_s = 300\n{drift}\
                 [bench]\nK0 = 20\nM = 5\nlatitude = 10\n[requirements]\nD = 0.1\n{}",
                names.concat()
            );
            let scheme = scheme_file::read(&text).expect("a scheme");
            let stated = Conditions::of(&scheme).as_stated();
            let conditions = stated.within(&Platform::new(scheme.clone()).expect("a platform"));
            for settle_s in [20.0, 47.0, 150.0] {
                let options = ProcedureOptions { settle_s, ..Default::default() };
                let left_out = judged(&scheme, 5, &Conditions::of(&scheme), &options).expect("a state");
                let plan = Plan::new(&scheme, &conditions).expect("a plan");
                let plan = waited(plan, &conditions, settle_s, |plan, k| {
                    plan.stages[k].outputs.iter_mut().for_each(|o| o.r *= 1e12);
                });
                let noisy = Attained::of_plan(plan.expect("a plan"), &conditions, None, 1).expect("a state");
                assert!(left_out.totals.iter().flatten().count() > 10);
                for (a, b) in left_out.totals.iter().zip(&noisy.totals) {
                    let (Some(a), Some(b)) = (a, b) else { panic!("{a:?} {b:?}") };
                    assert!((a / b - 1.0).abs() < 1e-4, "{drift} {settle_s} s: {a} {b}");
                }
            }
        }
    }
}
