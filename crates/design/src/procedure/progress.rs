//! State of the coefficients after each position of a sheet.

use obsdeg_core::model::{Platform, Scheme};
use obsdeg_evidence::requirements::{Requirements, meets};
use obsdeg_evidence::simulation::{Attained, Conditions, SimulationError, required_sigmas, shown_unit};
use obsdeg_exact::parallel;

use super::answer::{AfterPosition, CoefficientProgress};

/// Largest number of positions of which every one is judged.
const MOST: usize = 100;

/// State of the coefficients along the scheme.
pub(super) struct SchemeProgress {
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
    seed: u64,
) -> Result<SchemeProgress, SimulationError> {
    let all = scheme.positions.len();
    let first = if all > MOST { all } else { 1 };
    let judged: Vec<Attained> =
        parallel::try_map(all + 1 - first, |k| judged(scheme, first + k, conditions, seed))?;
    let Some(last) = judged.last() else { return Err(SimulationError::Interrupted) };
    let requirements = last.requirements(conditions)?;
    let own = &last.plan.platform;
    let psi = own.names().len() - own.coefficients();
    let names: Vec<String> = own.names()[psi..].to_vec();
    let required = required_sigmas(own, conditions)?;
    let required = |c: usize| required[psi + c];
    let sigmas: Vec<Vec<Option<f64>>> =
        judged.iter().map(|a| names.iter().map(|name| uncertainty(a, name)).collect()).collect();
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
    Ok(SchemeProgress { after, coefficients, requirements })
}

/// Index of an unknown; `None` if it is none of the scheme.
fn index(of: &Attained, name: &str) -> Option<usize> {
    of.plan.platform.names().iter().position(|n| n == name)
}

/// Total uncertainty of an unknown at the end; `None` if it is not determined.
fn uncertainty(of: &Attained, name: &str) -> Option<f64> {
    of.totals[index(of, name)?]
}

/// True if samples determine an unknown at the end.
fn is_determined(name: &str, of: &Attained) -> bool {
    index(of, name).is_some_and(|c| of.prediction.unknowns[c].determined_at_end)
}

/// Accuracy of the first `count` positions.
fn judged(
    scheme: &Scheme,
    count: usize,
    conditions: &Conditions,
    seed: u64,
) -> Result<Attained, SimulationError> {
    let positions = scheme.positions[..count].to_vec();
    let scheme = Scheme { positions, combinations: Vec::new(), ..scheme.clone() };
    let conditions = conditions.within(&Platform::new(scheme.clone())?);
    Attained::new(&scheme, &conditions, seed)
}
