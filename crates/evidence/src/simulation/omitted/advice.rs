//! Remedies where a bench uses up the margin of a requirement, each tried: the error among the unknowns,
//! re-levelling, another position. Comparison of the scheme under every carry: sigma against the contribution
//! of the bench.

use obsdeg_core::model::{Carry, Platform, Scheme, Term, Unknowns, cardinal, cardinal_names};

use super::answer::{Advice, AdviceKind, CarryUncertainty, Composition, OmittedEffects};
use crate::simulation::carries::under;
use crate::simulation::limits::MAX_UNKNOWNS;
use crate::simulation::{Attained, Conditions, SimulationError, is_rate, required_sigmas, shown_unit};

/// Sigma, contribution of the bench and total of the drift coefficient with the largest total; `None` if a
/// coefficient has no sigma.
fn composition(of: &Attained) -> Option<Composition> {
    let (names, units) = (of.plan.platform.names(), of.plan.platform.units());
    let worst = of.worst_of(&|_| true)?;
    let c = names.iter().position(|n| *n == worst.name)?;
    let (sigma, total) = (of.sigmas[c]?, of.totals[c]?);
    let bias = (total * total - sigma * sigma).max(0.0).sqrt();
    Some(Composition { unknown: worst.name, unit: shown_unit(units[c]).into(), sigma, bias, total })
}

/// Outcome of the scheme under every carry, its own first; without figures where a coefficient is not
/// observable, or the scheme could not be judged.
pub(crate) fn carries(
    attained: &Attained,
    conditions: &Conditions,
    seed: u64,
) -> Result<Vec<CarryUncertainty>, SimulationError> {
    let scheme = attained.plan.platform.scheme();
    let slews = attained.plan.slews().next().is_some();
    let mut out =
        vec![CarryUncertainty { carry: scheme.carry, without_slews: false, worst: composition(attained) }];
    for carry in Carry::ALL.into_iter().filter(|c| *c != scheme.carry) {
        let other = under(scheme, conditions, carry).map(|(s, c)| tried(s, &c, seed)).transpose()?.flatten();
        let worst = other.and_then(|(attained, _)| composition(&attained));
        out.push(CarryUncertainty { carry, without_slews: slews, worst });
    }
    Ok(out)
}

/// Changed scheme with its accuracy, and the conditions that concern it; `None` if it is invalid or too
/// large.
fn tried(
    scheme: Scheme,
    conditions: &Conditions,
    seed: u64,
) -> Result<Option<(Attained, Conditions)>, SimulationError> {
    let Ok(platform) = Platform::new(scheme.clone()) else { return Ok(None) };
    if platform.names().len() > MAX_UNKNOWNS {
        return Ok(None);
    }
    let conditions = conditions.within(&platform);
    Ok(Some((Attained::new(&scheme, &conditions, seed)?, conditions)))
}

/// Largest sigma and largest total over their requirements; `None` if a required unknown has none.
fn over_required(of: &Attained, conditions: &Conditions) -> Result<Option<[f64; 2]>, SimulationError> {
    let required = required_sigmas(&of.plan.platform, conditions)?;
    let mut out = [0.0f64; 2];
    for (c, required) in required.into_iter().enumerate().filter_map(|(c, r)| Some((c, r?))) {
        let (Some(sigma), Some(total)) = (of.sigmas[c], of.totals[c]) else { return Ok(None) };
        out = [out[0].max(sigma / required), out[1].max(total / required)];
    }
    Ok(Some(out))
}

/// Largest factor on the sigma of a drift coefficient that both schemes have.
fn sigma_factor(before: &Attained, after: &Attained) -> f64 {
    let names = after.plan.platform.names();
    let factor = |c: usize| {
        let name = &before.plan.platform.names()[c];
        let other = names.iter().position(|n| n == name)?;
        Some(after.sigmas[other]? / before.sigmas[c]?)
    };
    let units = before.plan.platform.units();
    (0..units.len()).filter(|&c| is_rate(units[c])).filter_map(factor).fold(0.0, f64::max)
}

/// Changes that lower the largest total over its requirement, the lowest first. They are sought where sigma
/// meets every requirement and the total does not.
pub(crate) fn advice(
    attained: &Attained,
    conditions: &Conditions,
    effects: &OmittedEffects,
    seed: u64,
) -> Result<Vec<Advice>, SimulationError> {
    let Some([sigma, now]) = over_required(attained, conditions)? else { return Ok(Vec::new()) };
    if sigma > 1.0 || now <= 1.0 {
        return Ok(Vec::new());
    }
    let scheme = attained.plan.platform.scheme();
    let judged = |kind, what: &str, changed: Scheme, conditions: &Conditions| {
        let Some((after, conditions)) = tried(changed, conditions, seed)? else { return Ok(None) };
        let Some([_, over]) = over_required(&after, &conditions)? else { return Ok(None) };
        Ok::<_, SimulationError>((over < now).then(|| Advice {
            kind,
            what: what.into(),
            total_over_required: over,
            now,
            sigma_factor: sigma_factor(attained, &after),
            met: over <= 1.0,
        }))
    };
    let mut out = Vec::new();
    for (families, changed) in estimated(scheme, effects) {
        out.extend(judged(AdviceKind::Estimate, &families, changed, conditions)?);
    }
    if scheme.carry != Carry::Reset
        && let Some((changed, conditions)) = under(scheme, conditions, Carry::Reset)
    {
        out.extend(judged(AdviceKind::Relevel, &Carry::Reset.to_string(), changed, &conditions)?);
    }
    let mut best: Option<Advice> = None;
    for (name, changed) in with_position(scheme) {
        let found = judged(AdviceKind::AddPosition, &name, changed, conditions)?;
        let lower = |a: &Advice| best.as_ref().is_none_or(|b| a.total_over_required < b.total_over_required);
        best = found.filter(lower).or(best);
    }
    out.extend(best);
    out.sort_by(|a, b| a.total_over_required.total_cmp(&b.total_over_required));
    Ok(out)
}

/// Schemes with families of the bench among the unknowns, for those families that a required total rests on:
/// each by itself, and all together.
fn estimated(scheme: &Scheme, effects: &OmittedEffects) -> Vec<(String, Scheme)> {
    let Unknowns::Coefficients(terms) = &scheme.unknowns else { return Vec::new() };
    let mut families: Vec<Term> = Vec::new();
    for t in effects.terms.iter().filter(|t| t.size.is_some_and(|s| s > 0.0) && !t.sensitivities.is_empty()) {
        // M and GM whole come before their triangles
        let term = Term::ALL.into_iter().find(|of| of.family() == t.family);
        families.extend(term.filter(|term| !families.contains(term)));
    }
    let with = |more: &[Term]| {
        let mut terms = [&terms[..], more].concat();
        terms.sort_unstable();
        Scheme { unknowns: Unknowns::Coefficients(terms), ..scheme.clone() }
    };
    let letters = |of: &[Term]| of.iter().map(|t| t.letters()).collect::<Vec<_>>().join(",");
    let all = (families.len() > 1).then_some(&families[..]);
    families.chunks(1).chain(all).map(|more| (letters(more), with(more))).collect()
}

/// Schemes with one more cardinal position, as long as the last position.
fn with_position(scheme: &Scheme) -> Vec<(String, Scheme)> {
    let Some(last) = scheme.positions.last().filter(|_| !scheme.rotates()) else { return Vec::new() };
    let longer = |name: &String| {
        let mut added = Scheme::of_angles([cardinal(name)?]).positions.pop()?;
        (added.name, added.dwell) = ("added".into(), last.dwell);
        let positions = scheme.positions.iter().cloned().chain([added]).collect();
        Some((name.clone(), Scheme { positions, ..scheme.clone() }))
    };
    cardinal_names().iter().filter_map(longer).collect()
}
